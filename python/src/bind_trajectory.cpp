// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <cmath>
#include <limits>
#include <optional>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// A Python event function; with `params` it is called with them as a third argument.
std::function<double(double, const double*)> watch(int index, py::function function, int dim,
                                                   py::object params) {
    const auto ask = [=](double t, const double* x) {
        py::array_t<double> y(dim, x);
        return params.is_none() ? function(t, y) : function(t, y, params);
    };
    return [=](double t, const double* x) {
        py::object result;
        try {
            result = ask(t, x);
        } catch (const py::error_already_set& error) {
            if (!SignalCheck::defers(error))
                throw;
            return std::numeric_limits<double>::quiet_NaN();
        }
        const double value = PyFloat_AsDouble(result.ptr());
        if (value == -1.0 && PyErr_Occurred() != nullptr) {
            PyErr_Clear();
            throw py::type_error("events[" + std::to_string(index) + "] returned " +
                                 py::repr(result).cast<std::string>() + ": expected a number");
        }
        if (!std::isfinite(value))
            throw py::value_error("events[" + std::to_string(index) + "] returned " +
                                  std::to_string(value) + " at t = " + std::to_string(t) +
                                  ": expected a finite number");
        return value;
    };
}

/// The event log, a row an event.
struct EventArrays {
    py::array_t<double> t, t_local, s, x_left, x_right;
    py::array_t<long long> period;
    py::array_t<int> kind, surface, alternatives;
    py::array_t<unsigned> contacts;
    py::array_t<signed char> mode_before, mode_after;
};

EventArrays arrays_of(EventColumns&& e, py::ssize_t dim, py::ssize_t surfaces) {
    const auto n = py::ssize_t(e.t.size());
    return {.t = as_array(std::move(e.t), {n}),
            .t_local = as_array(std::move(e.t_local), {n}),
            .s = as_array(std::move(e.s), {n}),
            .x_left = as_array(std::move(e.x_left), {n, dim}),
            .x_right = as_array(std::move(e.x_right), {n, dim}),
            .period = as_array(std::move(e.period), {n}),
            .kind = as_array(std::move(e.kind), {n}),
            .surface = as_array(std::move(e.surface), {n}),
            .alternatives = as_array(std::move(e.alternatives), {n}),
            .contacts = as_array(std::move(e.contacts), {n}),
            .mode_before = as_array(std::move(e.mode_before), {n, surfaces}),
            .mode_after = as_array(std::move(e.mode_after), {n, surfaces})};
}

/// A run: a row a step, or a time asked for.
struct RunResult {
    py::array_t<double> t, y;
    py::array_t<signed char> mode;
    EventArrays events;
    std::shared_ptr<Solution> solution; ///< None without dense output
    py::dict counters;
    std::string status, message;
    py::object raised = py::none();
};

RunResult result_of(Run&& run, const Facts& facts, const py::object& raised) {
    const auto n = py::ssize_t(run.t.size());
    return {.t = as_array(std::move(run.t), {n}),
            .y = as_array(std::move(run.x), {n, facts.dim}),
            .mode = as_array(std::move(run.mode), {n, facts.surfaces}),
            .events = arrays_of(std::move(run.events), facts.dim, facts.surfaces),
            .solution = std::const_pointer_cast<Solution>(run.solution), // the holder has no const
            .counters = counters_to_dict(run.counters),
            .status = std::string(name(run.status)),
            .message = std::move(run.message),
            .raised = raised};
}

/// @param most  0: one solution, by the policy; else all of them, and so many at most
/// @return the runs, and whether these are all
std::pair<std::vector<RunResult>, bool> simulate(const Model& model, const Doubles& x0, double t0,
                                                 double t_end, const Doubles& p,
                                                 const RunSettings& settings, int most, bool dense,
                                                 const std::optional<Doubles>& t_eval,
                                                 const py::list& events, const py::object& params) {
    const Facts& facts = model.facts();
    expect(x0.size() == facts.dim, "x0 has dim entries");
    expect(std::size_t(p.size()) == facts.params.size(), "p has one entry a parameter");
    expect(events.size() <= std::size_t(max_watches), "too many event functions");
    Task task;
    task.x0 = copy(x0);
    task.params = copy(p);
    task.t0 = t0;
    task.t_end = t_end;
    task.settings = settings;
    task.dense = dense;
    if (t_eval)
        task.t_eval = copy(*t_eval);
    for (const py::handle& item : events) {
        const auto [function, direction, stop_after, with_params] =
            item.cast<std::tuple<py::function, int, long long, bool>>();
        task.watches.push_back({watch(int(task.watches.size()), function, facts.dim,
                                      with_params ? params : py::object(py::none())),
                                direction, stop_after});
    }
    SignalCheck signals;
    task.interrupted = [&signals] { return signals(); };

    Runs runs;
    {
        // Event functions run all the time: giving the lock away between them would only cost.
        std::optional<py::gil_scoped_release> unlocked;
        if (task.watches.empty())
            unlocked.emplace();
        if (most > 0)
            runs = model.simulate_all(task, most);
        else
            runs.all.push_back(model.simulate(task));
    }
    std::vector<RunResult> all;
    for (Run& run : runs.all)
        all.push_back(result_of(std::move(run), facts, signals.raised()));
    return {std::move(all), runs.complete};
}

py::dict pack(const Solution& solution) {
    PackedSolution s = solution.packed();
    const auto knots = py::ssize_t(s.t.size()), pieces = py::ssize_t(s.dt.size()),
               dim = py::ssize_t(s.scale.size());
    const auto rows = [](auto& column, py::ssize_t n) {
        const auto width = n == 0 ? 0 : py::ssize_t(column.size()) / n;
        return as_array(std::move(column), {n, width});
    };
    const auto line = [](auto& column) {
        const auto n = py::ssize_t(column.size());
        return as_array(std::move(column), {n});
    };
    py::dict d;
    d["params"] = line(s.params);
    d["scale"] = line(s.scale);
    d["t"] = line(s.t);
    d["x"] = rows(s.x, knots);
    d["mode"] = rows(s.mode, knots);
    d["period"] = line(s.period);
    d["t_local"] = line(s.t_local);
    d["carry"] = line(s.carry);
    d["dt"] = line(s.dt);
    d["x0"] = rows(s.x0, pieces);
    d["polynomial"] = as_array(std::move(s.polynomial), {pieces, py::ssize_t(solution_terms), dim});
    d["closed_form"] = line(s.closed_form);
    return d;
}
std::shared_ptr<Solution> unpack(const Model& model, const py::dict& d) {
    const auto column = [&]<class T>(const char* name, T) {
        const auto values = py::cast<Array<T>>(d[name]);
        return std::vector<T>(values.data(), values.data() + values.size());
    };
    PackedSolution s;
    s.params = column("params", 0.0);
    s.scale = column("scale", 0.0);
    s.t = column("t", 0.0);
    s.x = column("x", 0.0);
    s.mode = column("mode", static_cast<signed char>(0));
    s.period = column("period", 0LL);
    s.t_local = column("t_local", 0.0);
    s.carry = column("carry", 0.0);
    s.dt = column("dt", 0.0);
    s.x0 = column("x0", 0.0);
    s.polynomial = column("polynomial", 0.0);
    s.closed_form = column("closed_form", static_cast<signed char>(0));
    const Facts& facts = model.facts();
    const auto dim = std::size_t(facts.dim), knots = s.t.size(), pieces = s.dt.size();
    expect(s.params.size() == facts.params.size() && s.scale.size() == dim && knots >= 1 &&
               (pieces == 0 || pieces + 1 == knots) && s.x.size() == knots * dim &&
               s.mode.size() == knots * std::size_t(facts.surfaces) && s.period.size() == pieces &&
               s.t_local.size() == pieces && s.carry.size() == pieces &&
               s.x0.size() == pieces * dim &&
               s.polynomial.size() == pieces * dim * solution_terms &&
               s.closed_form.size() == pieces && (pieces > 0 || knots == 1),
           "the columns of a solution fit together");
    const bool forward = s.t.back() >= s.t.front();
    for (std::size_t k = 0; k + 1 < knots; ++k)
        expect(forward ? s.t[k] <= s.t[k + 1] : s.t[k] >= s.t[k + 1], "times are in order");
    for (const signed char mode : s.mode)
        expect(mode >= -1 && mode <= 1, "a mode is -1, 0 or 1");
    return std::const_pointer_cast<Solution>(model.solution(s)); // the holder type has no const
}

} // namespace

void bind_trajectory(py::module_& m) {
    py::class_<Solution, std::shared_ptr<Solution>>(m, "Solution")
        .def("pack", &pack)
        .def_static("unpack", &unpack)
        .def("knots",
             [](const Solution& s) {
                 const std::span<const double> t = s.knots();
                 return py::array_t<double>(py::ssize_t(t.size()), t.data());
             })
        .def("states",
             [](const Solution& s, const Doubles& t, int dim) {
                 std::vector<double> out(std::size_t(t.size() * dim));
                 s.states(view(t), out);
                 return as_array(std::move(out), {t.size(), dim});
             })
        .def("modes",
             [](const Solution& s, const Doubles& t, int surfaces) {
                 std::vector<signed char> out(std::size_t(t.size() * surfaces));
                 s.modes(view(t), out);
                 return as_array(std::move(out), {t.size(), surfaces});
             })
        .def("blend", [](const Solution& s, const Doubles& t, int surfaces) {
            std::vector<double> out(std::size_t(t.size() * surfaces));
            s.blend(view(t), out);
            return as_array(std::move(out), {t.size(), surfaces});
        });
    bind_struct<EventArrays>(m, "EventColumns")
        .field("t", &EventArrays::t)
        .field("t_local", &EventArrays::t_local)
        .field("s", &EventArrays::s)
        .field("x_left", &EventArrays::x_left)
        .field("x_right", &EventArrays::x_right)
        .field("period", &EventArrays::period)
        .field("kind", &EventArrays::kind)
        .field("surface", &EventArrays::surface)
        .field("alternatives", &EventArrays::alternatives)
        .field("contacts", &EventArrays::contacts)
        .field("mode_before", &EventArrays::mode_before)
        .field("mode_after", &EventArrays::mode_after);
    bind_struct<RunResult>(m, "Run")
        .field("t", &RunResult::t)
        .field("y", &RunResult::y)
        .field("mode", &RunResult::mode)
        .field("events", &RunResult::events)
        .field("solution", &RunResult::solution)
        .field("counters", &RunResult::counters)
        .field("status", &RunResult::status)
        .field("message", &RunResult::message)
        .field("raised", &RunResult::raised);
    m.def("simulate", &simulate);
    m.attr("max_event_functions") = max_watches;
}

} // namespace filippov::python
