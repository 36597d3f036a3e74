// SPDX-License-Identifier: BSD-3-Clause
#include "bind_lanes.hpp"
#include "instruction_set.hpp"

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// Members given in arrays, of which one row, or one entry, may stand for all.
class Listed final : public AnyPopulation {
public:
    // one entry a member
    std::vector<double> x, t, slide_time;
    std::vector<long long> period;
    std::vector<signed char> status;
    std::vector<std::int16_t> mode; ///< Mode::code
    std::vector<std::int32_t> events, slides;

    Listed(std::size_t n, const Doubles& x0, const Doubles& params, const Doubles& t0,
           const Doubles& t_end)
        : x(n * std::size_t(x0.shape(1)), std::numeric_limits<double>::quiet_NaN()),
          t(n, std::numeric_limits<double>::quiet_NaN()), slide_time(n, 0.0), period(n, 0),
          status(n, static_cast<signed char>(Status::interrupted)), mode(n, 0), events(n, 0),
          slides(n, 0), x0_(view(x0)), params_(view(params)), t0_(view(t0)), t_end_(view(t_end)),
          dim_(std::size_t(x0.shape(1))), n_params_(std::size_t(params.shape(1))) {
        same_params = params.shape(0) == 1;
    }

    void member(std::size_t id, MemberView& m) override {
        row(x0_, dim_, id, m.x);
        row(params_, n_params_, id, m.p);
        m.t0 = t0_[t0_.size() == 1 ? 0 : id];
        m.t_end = t_end_[t_end_.size() == 1 ? 0 : id];
    }
    void take(std::size_t id, const OutcomeView& o) override {
        std::copy(o.x.begin(), o.x.end(), x.begin() + std::ptrdiff_t(id * dim_));
        t[id] = o.clock.absolute();
        period[id] = o.clock.index;
        status[id] = static_cast<signed char>(o.status);
        mode[id] = static_cast<std::int16_t>(o.mode);
        events[id] = o.events;
        slides[id] = o.slides;
        slide_time[id] = o.slide_time;
    }

private:
    static void row(std::span<const double> rows, std::size_t width, std::size_t id,
                    std::span<double> out) {
        if (width > 0)
            std::copy_n(rows.begin() + std::ptrdiff_t(rows.size() == width ? 0 : id * width), width,
                        out.begin());
    }
    const std::span<const double> x0_, params_, t0_, t_end_;
    const std::size_t dim_, n_params_;
};

/// An Ensemble: a row a member, in which it ended.
struct EnsembleColumns {
    py::array_t<double> x, t;
    py::array_t<long long> period;
    py::array_t<signed char> status;
    py::array_t<std::int16_t> mode; // Mode::code
    py::array_t<std::int32_t> events, slides;
    py::array_t<double> slide_time;
    py::dict counters;
    py::object raised = py::none();
};

EnsembleColumns ensemble(const py::capsule& capsule, std::size_t n, const Doubles& x0,
                         const Doubles& params, const Doubles& t0, const Doubles& t_end,
                         const std::optional<std::vector<double>>& escape,
                         const RunSettings& settings, int threads, const py::object& show) {
    const AnyLanes& lanes = lanes_in(capsule);
    const auto one_or_n = [n](py::ssize_t k) { return k == 1 || std::size_t(k) == n; };
    expect(x0.ndim() == 2 && x0.shape(1) == lanes.dim() && one_or_n(x0.shape(0)),
           "x0 has dim columns");
    expect(params.ndim() == 2 && params.shape(1) == lanes.params() && one_or_n(params.shape(0)),
           "params has a column a parameter");
    expect(t0.ndim() == 1 && one_or_n(t0.shape(0)) && t_end.ndim() == 1 && one_or_n(t_end.shape(0)),
           "t0 and t_end have one entry, or one a member");
    Listed members(n, x0, params, t0, t_end);
    if (escape)
        members.escape = *escape;
    SignalCheck signals;
    Parallel how;
    how.threads = threads;
    how.cancelled = [&signals] { return signals(); };
    how.progress = progress(show, signals);
    PopulationRun run;
    {
        const py::gil_scoped_release unlocked;
        run = lanes.run(n, members, settings, how);
    }
    const auto size = py::ssize_t(n);
    return {.x = as_array(std::move(members.x), {size, py::ssize_t(lanes.dim())}),
            .t = as_array(std::move(members.t), {size}),
            .period = as_array(std::move(members.period), {size}),
            .status = as_array(std::move(members.status), {size}),
            .mode = as_array(std::move(members.mode), {size}),
            .events = as_array(std::move(members.events), {size}),
            .slides = as_array(std::move(members.slides), {size}),
            .slide_time = as_array(std::move(members.slide_time), {size}),
            .counters = lane_counters_to_dict(run.counters),
            .raised = signals.raised()};
}

/// A capsule that owns a pointer.
template <class Pointer, const char* const& name> py::capsule capsule_of(Pointer pointer) {
    auto owned = std::make_unique<Pointer>(std::move(pointer));
    return py::capsule(owned.release(), name, [](PyObject* capsule) {
        delete static_cast<Pointer*>(PyCapsule_GetPointer(capsule, name));
    });
}

} // namespace

void bind_ensemble(py::module_& m) {
    bind_struct<EnsembleColumns>(m, "EnsembleColumns")
        .field("x", &EnsembleColumns::x)
        .field("t", &EnsembleColumns::t)
        .field("period", &EnsembleColumns::period)
        .field("status", &EnsembleColumns::status)
        .field("mode", &EnsembleColumns::mode)
        .field("events", &EnsembleColumns::events)
        .field("slides", &EnsembleColumns::slides)
        .field("slide_time", &EnsembleColumns::slide_time)
        .field("counters", &EnsembleColumns::counters)
        .field("raised", &EnsembleColumns::raised);
    m.def("ensemble", &ensemble);
    m.def("scalar", [](const Model& model) {
        return capsule_of<ScalarPointer, scalar_capsule>(model.scalar());
    });
    m.def("one_lane", [](const Model& model) -> py::object {
        LanesPointer lanes = model.one_lane();
        if (lanes == nullptr)
            return py::none();
        return capsule_of<LanesPointer, lanes_capsule>(std::move(lanes));
    });
    // Null for a system that is not one of formulas.
    m.def("tapes", [](const Model& model) -> py::object {
        TapesPointer tapes = model.tapes();
        if (tapes == nullptr)
            return py::none();
        return capsule_of<TapesPointer, tapes_capsule>(std::move(tapes));
    });
    m.def("instruction_set", &instruction_set);
}

} // namespace filippov::python
