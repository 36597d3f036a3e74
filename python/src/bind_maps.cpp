// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <filippov/lyapunov.hpp>
#include <filippov/map_graph.hpp>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// What both functions need: a map and the ears for Ctrl-C.
class Mapping {
public:
    Mapping(const Model& model, const Doubles& p, double rtol, double atol, double max_periods,
            const std::optional<Doubles>& guess)
        : system_(model.analysis({.rtol = rtol, .atol = atol})) {
        expect(system_ != nullptr, "one surface");
        expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
        TransitionSettings settings;
        settings.max_periods = max_periods;
        settings.interrupted = [this] { return signals_(); };
        if (guess) {
            expect(guess->size() == model.facts().dim, "guess has dim entries");
            settings.guess = Eigen::Map<const Vector>(guess->data(), guess->size());
        }
        map_.emplace(*system_, Eigen::Map<const Vector>(p.data(), p.size()), std::move(settings));
    }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;

    const TransitionMap& operator*() const { return *map_; }
    py::object raised() const { return signals_.raised(); }

private:
    std::shared_ptr<const AnySystem> system_;
    SignalCheck signals_;
    std::optional<TransitionMap> map_;
};

/// Points of a graph, one column a field.
py::dict columns(const std::vector<MapSample>& samples) {
    const auto n = py::ssize_t(samples.size());
    const auto column = [&](auto get) {
        std::vector<decltype(get(samples[0]))> values;
        values.reserve(samples.size());
        for (const MapSample& s : samples)
            values.push_back(get(s));
        return as_array(std::move(values), {n});
    };
    const auto number = [](const MapSample& s, double value) {
        return s.image.ok() ? value : std::numeric_limits<double>::quiet_NaN();
    };
    py::dict d;
    d["phase"] = column([](const MapSample& s) { return s.at.phase; });
    d["boundary"] =
        column([](const MapSample& s) { return static_cast<signed char>(s.at.boundary); });
    d["value"] = column([&](const MapSample& s) { return number(s, s.image.to.phase); });
    d["value_boundary"] = column([](const MapSample& s) {
        return static_cast<signed char>(s.image.ok() ? s.image.to.boundary : 0);
    });
    d["slope"] = column([&](const MapSample& s) { return number(s, s.image.slope); });
    d["turns"] = column([](const MapSample& s) { return s.image.ok() ? s.image.turns : 0LL; });
    d["true_exit"] = column([](const MapSample& s) -> unsigned char { return s.image.true_exit; });
    d["status"] = column([](const MapSample& s) { return static_cast<int>(s.image.status); });
    std::vector<std::string> words;
    for (const MapSample& s : samples)
        words.push_back(s.image.word);
    d["word"] = words;
    return d;
}

py::list points(const TransitionMap& map, const MapGraph& graph) {
    py::list list;
    for (const FixedPoint& f : graph.fixed_points) {
        const auto exit = map.exit_point(f.at);
        py::dict d;
        d["phase"] = f.at.phase;
        d["boundary"] = f.at.boundary;
        d["slope"] = f.slope;
        d["stable"] = f.stable();
        d["iterate"] = f.iterate;
        d["prime"] = f.prime;
        d["turns"] = f.turns;
        d["tangent"] = f.tangent;
        d["t"] = map.time_of(f.at.phase);
        d["x"] = std::vector<double>(exit->x.begin(), exit->x.end());
        list.append(d);
    }
    return list;
}

py::dict graph(const Model& model, const Doubles& p, double rtol, double atol, double max_periods,
               const std::optional<Doubles>& guess, int iterate, int samples,
               long long max_evaluations) {
    const Mapping map(model, p, rtol, atol, max_periods, guess);
    MapGraph g;
    {
        const py::gil_scoped_release unlocked;
        g = map_graph(*map, iterate, {.samples = samples, .max_evaluations = max_evaluations});
    }
    std::vector<MapSample> left, right;
    std::vector<bool> jump;
    for (const MapBreak& b : g.breaks) {
        left.push_back(b.left);
        right.push_back(b.right);
        jump.push_back(b.jump());
    }
    py::dict d;
    d["samples"] = columns(g.samples);
    d["left"] = columns(left);
    d["right"] = columns(right);
    d["jump"] = jump;
    d["points"] = points(*map, g);
    d["status"] = std::string(name(g.status));
    d["message"] = g.message;
    d["evaluations"] = g.evaluations;
    d["raised"] = map.raised();
    return d;
}

py::dict images(const Model& model, const Doubles& p, double rtol, double atol, double max_periods,
                const std::optional<Doubles>& guess, int iterate, const Array<int>& boundary,
                const Doubles& phase) {
    expect(boundary.size() == phase.size(), "boundary and phase have one size");
    const Mapping map(model, p, rtol, atol, max_periods, guess);
    std::vector<MapSample> samples;
    {
        const py::gil_scoped_release unlocked;
        for (py::ssize_t k = 0; k < phase.size(); ++k) {
            const Transition at{boundary.data()[k], phase.data()[k]};
            samples.push_back({at, (*map)(at, iterate)});
            if (samples.back().image.status == Status::interrupted)
                break;
        }
    }
    py::dict d = columns(samples);
    d["raised"] = map.raised();
    return d;
}

py::array_t<double> vector(const Vector& v) {
    return as_array(std::vector<double>(v.begin(), v.end()), {v.size()});
}

py::dict exponents(const Model& model, const Doubles& p, const Doubles& x0, double rtol,
                   double atol, double transient, double window, double stretch, int batches) {
    const auto system = model.analysis({.rtol = rtol, .atol = atol});
    expect(system != nullptr, "one surface");
    SignalCheck signals;
    LyapunovSettings settings{
        .transient = transient, .window = window, .stretch = stretch, .batches = batches};
    settings.interrupted = [&signals] { return signals(); };
    Lyapunov l;
    {
        const py::gil_scoped_release unlocked;
        l = lyapunov(*system, Eigen::Map<const Vector>(p.data(), p.size()),
                     Eigen::Map<const Vector>(x0.data(), x0.size()), settings);
    }
    py::dict d;
    d["exponents"] = vector(l.exponents);
    d["error"] = vector(l.error);
    d["t_begin"] = l.t_begin;
    d["t_end"] = l.t_end;
    d["slides"] = l.slides;
    d["stretches"] = l.stretches;
    d["skipped"] = l.skipped;
    d["x"] = vector(l.x);
    d["status"] = std::string(name(l.status));
    d["message"] = l.message;
    d["raised"] = signals.raised();
    return d;
}

} // namespace

void bind_maps(py::module_& m) {
    m.def("lyapunov", &exponents);
    m.def("map_graph", &graph);
    m.def("map_images", &images);
}

} // namespace filippov::python
