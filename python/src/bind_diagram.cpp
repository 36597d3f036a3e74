// SPDX-License-Identifier: BSD-3-Clause
#include "bind_lanes.hpp"

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// DiagramColumns in arrays: a row a point, and one a value of the swept parameter.
struct Diagram {
    py::array_t<long long> value, period;     // a point
    py::array_t<double> t_local, y;           // a point
    py::array_t<int> kind, surface;           // a point
    py::array_t<signed char> boundary;        // a point
    py::array_t<double> forcing, y_end;       // a value
    py::array_t<long long> cycle, skipped;    // a value
    std::vector<std::string> status, message; // a value
    py::dict counters;
    py::object raised = py::none();
};

Diagram diagram_of(DiagramColumns&& c, py::ssize_t dim) {
    const auto n = py::ssize_t(c.value.size()), values = py::ssize_t(c.forcing.size());
    return {.value = as_array(std::move(c.value), {n}),
            .period = as_array(std::move(c.period), {n}),
            .t_local = as_array(std::move(c.t_local), {n}),
            .y = as_array(std::move(c.x), {n, dim}),
            .kind = as_array(std::move(c.kind), {n}),
            .surface = as_array(std::move(c.surface), {n}),
            .boundary = as_array(std::move(c.boundary), {n}),
            .forcing = as_array(std::move(c.forcing), {values}),
            .y_end = as_array(std::move(c.x_end), {values, dim}),
            .cycle = as_array(std::move(c.cycle), {values}),
            .skipped = as_array(std::move(c.skipped), {values}),
            .status = std::move(c.status),
            .message = std::move(c.message),
            .counters = counters_to_dict(c.counters)};
}

Diagram diagram(const Model& model, const std::optional<py::capsule>& lanes, const Doubles& x0,
                const Doubles& params, const RunSettings& settings, const std::vector<int>& kinds,
                int surface, int direction, double transient, double keep, bool follow, int chains,
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
    task.lanes = lanes ? &lanes_in(*lanes) : nullptr;
    SignalCheck signals;
    task.parallel.threads = threads;
    task.parallel.cancelled = [&signals] { return signals(); };
    task.parallel.progress = progress(show, signals);

    DiagramColumns columns;
    {
        const py::gil_scoped_release unlocked;
        columns = model.diagram(task);
    }
    Diagram d = diagram_of(std::move(columns), facts.dim);
    d.raised = signals.raised();
    return d;
}

} // namespace

void bind_diagram(py::module_& m) {
    bind_struct<Diagram>(m, "Diagram")
        .field("value", &Diagram::value)
        .field("period", &Diagram::period)
        .field("t_local", &Diagram::t_local)
        .field("y", &Diagram::y)
        .field("kind", &Diagram::kind)
        .field("surface", &Diagram::surface)
        .field("boundary", &Diagram::boundary)
        .field("forcing", &Diagram::forcing)
        .field("y_end", &Diagram::y_end)
        .field("cycle", &Diagram::cycle)
        .field("skipped", &Diagram::skipped)
        .field("status", &Diagram::status)
        .field("message", &Diagram::message)
        .field("counters", &Diagram::counters)
        .field("raised", &Diagram::raised);
    m.def("diagram", &diagram);
}

} // namespace filippov::python
