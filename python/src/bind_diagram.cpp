// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

namespace filippov::python {

namespace {

using Doubles = Array<double>;

py::dict to_dict(DiagramColumns&& c, py::ssize_t dim) {
    const auto n = py::ssize_t(c.value.size()), values = py::ssize_t(c.forcing.size());
    py::dict d;
    d["value"] = as_array(std::move(c.value), {n});
    d["period"] = as_array(std::move(c.period), {n});
    d["t_local"] = as_array(std::move(c.t_local), {n});
    d["y"] = as_array(std::move(c.x), {n, dim});
    d["kind"] = as_array(std::move(c.kind), {n});
    d["surface"] = as_array(std::move(c.surface), {n});
    d["boundary"] = as_array(std::move(c.boundary), {n});
    d["forcing"] = as_array(std::move(c.forcing), {values});
    d["y_end"] = as_array(std::move(c.x_end), {values, dim});
    d["cycle"] = as_array(std::move(c.cycle), {values});
    d["skipped"] = as_array(std::move(c.skipped), {values});
    d["status"] = c.status;
    d["message"] = c.message;
    d["counters"] = counters_to_dict(c.counters);
    return d;
}

py::dict diagram(const Model& model, const Doubles& x0, const Doubles& params,
                 const RunSettings& settings, const std::vector<int>& kinds, int surface,
                 int direction, double transient, double keep, bool follow, int chains,
                 bool skip_repeats, int threads, const py::object& show) {
    const Facts& facts = model.facts();
    expect(x0.size() == facts.dim, "x0 has dim entries");
    expect(params.ndim() == 2 && std::size_t(params.shape(1)) == facts.params.size(),
           "params has one row a value, one entry a parameter");
    for (const int kind : kinds)
        expect(kind >= 0 && kind <= static_cast<int>(EventKind::end), "kinds are event kinds");
    DiagramTask task;
    task.x0 = copy(x0);
    task.params = copy(params);
    task.settings = settings;
    task.kinds = kinds;
    task.surface = surface;
    task.direction = direction;
    task.transient = transient;
    task.keep = keep;
    task.follow = follow;
    task.chains = chains;
    task.skip_repeats = skip_repeats;
    SignalCheck signals;
    task.parallel.threads = threads;
    task.parallel.cancelled = [&signals] { return signals(); };
    task.parallel.progress = progress(show, signals);

    DiagramColumns columns;
    {
        const py::gil_scoped_release unlocked;
        columns = model.diagram(task);
    }
    py::dict d = to_dict(std::move(columns), facts.dim);
    d["raised"] = signals.raised();
    return d;
}

} // namespace

void bind_diagram(py::module_& m) { m.def("diagram", &diagram); }

} // namespace filippov::python
