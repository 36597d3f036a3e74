// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <filippov/continuation/bifurcation_set.hpp>

#include <pybind11/complex.h>

#include <algorithm>
#include <complex>
#include <limits>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

void append(std::vector<double>& out, const Vector& x) {
    out.insert(out.end(), x.begin(), x.end());
}
py::array_t<double> array_of(const Vector& x) {
    return as_array(std::vector<double>(x.begin(), x.end()), {x.size()});
}
py::array_t<std::complex<double>> array_of(const Multipliers& m) {
    return as_array(Multipliers(m), {py::ssize_t(m.size())});
}

/// The mode with a slide on this surface, too.
int sliding_at(int mode, int surface) {
    int power = 1;
    for (int j = 0; j < surface; ++j)
        power *= 3;
    return mode - mode_entry(mode, surface) * power;
}

/// Cycles, one after the other.
struct CycleColumns {
    std::vector<long long> size; ///< nodes of each
    std::vector<int> mode;       ///< Mode::code
    std::vector<int> until, surface;
    std::vector<double> t, x, s;   ///< of the nodes
    std::vector<double> period, p; ///< of each
    std::vector<double> t_start, x_start;
    std::vector<long long> turns;

    void add(const AnySystem& system, const Cycle& c) {
        const std::vector<SurfaceKind> kinds = system.kinds();
        size.push_back(static_cast<long long>(c.size()));
        for (std::size_t i = 0; i < c.size(); ++i) {
            mode.push_back(c.word[i].mode);
            until.push_back(static_cast<int>(c.word[i].until));
            surface.push_back(c.word[i].surface);
            t.push_back(c.t[i]);
            append(x, c.x[i]);
            const Letter& before = c.word[i + c.size() - 1];
            const Quantity margin{Quantity::Kind::margin, -1, 0, before.surface,
                                  sliding_at(before.mode, before.surface)}; // s_max + s
            const auto surface = std::size_t(before.surface);
            s.push_back(surface < kinds.size() && kinds[surface] == SurfaceKind::jump
                            ? std::numeric_limits<double>::quiet_NaN() // a force, and no s
                            : system.quantity(margin, c.t[i], c.x[i], c.p, {}).value[0] -
                                  system.s_max(c.p));
        }
        turns.push_back(c.turns);
        period.push_back(c.period);
        append(p, c.p);
        const auto [time, in] = start_of(system, c);
        t_start.push_back(time);
        append(x_start, system.arc(c.word[in].mode, c.t[in], c.x[in], time, c.p, {}).value);
    }
    void to_dict(py::dict& d, py::ssize_t dim, py::ssize_t params) {
        const auto n = py::ssize_t(size.size()), nodes = py::ssize_t(t.size());
        d["size"] = as_array(std::move(size), {n});
        d["mode"] = as_array(std::move(mode), {nodes});
        d["until"] = as_array(std::move(until), {nodes});
        d["surface"] = as_array(std::move(surface), {nodes});
        d["t"] = as_array(std::move(t), {nodes});
        d["x"] = as_array(std::move(x), {nodes, dim});
        d["s"] = as_array(std::move(s), {nodes});
        d["turns"] = as_array(std::move(turns), {n});
        d["period"] = as_array(std::move(period), {n});
        d["p"] = as_array(std::move(p), {n, params});
        d["t_start"] = as_array(std::move(t_start), {n});
        d["x_start"] = as_array(std::move(x_start), {n, dim});
    }
};

/// A cycle from its word, nodes, turns, period and parameters.
Cycle cycle_from(const Model& model, const py::tuple& columns) {
    const auto [mode, until, surface, t, x, turns, period, p] = columns.cast<
        std::tuple<Array<int>, Array<int>, Array<int>, Doubles, Doubles, int, double, Doubles>>();
    const Facts& facts = model.facts();
    const py::ssize_t n = t.size();
    expect(n > 0 && mode.size() == n && until.size() == n && surface.size() == n,
           "a cycle has nodes");
    int codes = 1; // of modes, on either side of 0
    for (int j = 1; j < facts.surfaces; ++j)
        codes = 3 * codes + 1;
    expect(x.ndim() == 2 && x.shape(0) == n && x.shape(1) == facts.dim, "x has shape (n, dim)");
    expect(std::size_t(p.size()) == facts.params.size(), "p has one entry a parameter");
    Cycle c;
    for (py::ssize_t i = 0; i < n; ++i) {
        expect(mode.at(i) >= -codes && mode.at(i) <= codes, "mode is the code of one");
        expect(surface.at(i) >= 0 && surface.at(i) < facts.surfaces, "surface is an index");
        expect(until.at(i) >= 0 && until.at(i) <= static_cast<int>(Until::phase),
               "until is 0 to 6");
        c.word.letters.push_back({mode.at(i), static_cast<Until>(until.at(i)), surface.at(i)});
        c.t.push_back(t.at(i));
        c.x.push_back(Eigen::Map<const Vector>(x.data(i, 0), facts.dim));
    }
    c.word.surfaces = facts.surfaces;
    c.turns = turns;
    c.period = period;
    c.p = vector_of(p);
    return c;
}

/// Largest of what is left of the equations of a cycle; NaN where there are none.
double residual(const AnySystem& system, const Cycle& c) {
    if (c.size() > 0) {
        const Shooting shooting(system, c);
        const auto e = shooting.evaluate(shooting.pack(c));
        if (e.status == Status::ok)
            return e.F.lpNorm<Eigen::Infinity>();
    }
    return std::numeric_limits<double>::quiet_NaN();
}

/// Everything about an orbit; without its monodromy matrix if it was not found.
py::dict to_dict(const Model& model, const AnySystem& system, const Orbit& orbit) {
    CycleColumns columns;
    Matrix transposed = orbit.monodromy.transpose(); // numpy goes row by row
    double left = 0;
    {
        const py::gil_scoped_release unlocked;
        if (orbit.cycle.size() > 0)
            columns.add(system, orbit.cycle);
        left = residual(system, orbit.cycle);
    }
    const auto dim = py::ssize_t(model.facts().dim);
    py::dict d;
    columns.to_dict(d, dim, py::ssize_t(model.facts().params.size()));
    d["multipliers"] = array_of(orbit.multipliers);
    d["monodromy"] =
        as_array(std::vector<double>(transposed.data(), transposed.data() + transposed.size()),
                 {py::ssize_t(orbit.monodromy.rows()), py::ssize_t(orbit.monodromy.cols())});
    d["stable"] = orbit.status == Status::ok && orbit.stable(system.forced());
    d["iterations"] = orbit.convergence.iterations;
    d["residual"] = left;
    d["status"] = std::string(name(orbit.status));
    d["message"] = orbit.message;
    return d;
}

/// Looks for an orbit without the lock.
template <class Search>
py::dict searched(const Model& model, const RunSettings& run, Search search) {
    Analysis analysis(model, run);
    Orbit orbit;
    {
        const py::gil_scoped_release unlocked;
        orbit = search(*analysis.system);
    }
    py::dict d = to_dict(model, *analysis.unstoppable, orbit);
    d["raised"] = analysis.signals.raised();
    return d;
}

void check_point(const Model& model, const Doubles& p, const Doubles& x0) {
    expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
    expect(x0.size() == model.facts().dim, "x0 has dim entries");
}

py::dict settled(const Model& model, const Doubles& p, const Doubles& x0, double transient,
                 int max_turns, double window, const RunSettings& run) {
    check_point(model, p, x0);
    const Vector params = vector_of(p), start = vector_of(x0);
    OrbitSearch search;
    search.transient = transient;
    search.max_turns = max_turns;
    search.window = window;
    return searched(model, run,
                    [&](const AnySystem& system) { return settle(system, params, start, search); });
}

py::dict near(const Model& model, const Doubles& p, double t0, const Doubles& x0, int turns,
              double window, const RunSettings& run) {
    check_point(model, p, x0);
    const Vector params = vector_of(p), start = vector_of(x0);
    OrbitSearch search;
    search.window = window;
    return searched(model, run, [&](const AnySystem& system) {
        return orbit_near(system, params, t0, start, turns, search);
    });
}

py::dict solved(const Model& model, const py::tuple& cycle, const RunSettings& run) {
    const Cycle start = cycle_from(model, cycle);
    return searched(model, run,
                    [&](const AnySystem& system) { return solve_orbit(system, start); });
}

// --- branches ----------------------------------------------------------------------------------

py::dict special_to_dict(const Model& model, const AnySystem& system, const SpecialPoint& s) {
    Orbit orbit;
    {
        const py::gil_scoped_release unlocked;
        orbit.cycle = s.cycle;
        orbit.convergence = s.convergence;
        orbit.status = s.convergence.status;
        if (orbit.cycle.size() > 0) {
            orbit.multipliers = floquet(system, s.cycle);
            find_start(system, orbit);
        } else {
            orbit.message = "the bifurcation was seen but not located";
        }
    }
    py::dict d;
    d["orbit"] = to_dict(model, system, orbit);
    d["kind"] = std::string(name(s.kind));
    d["node"] = s.side != 0 ? int(s.node) : -1;
    d["side"] = s.side;
    d["word_before"] = s.word_before;
    d["word_after"] = s.word_after;
    d["conditions"] = s.conditions;
    d["multipliers"] = array_of(s.multipliers);
    return d;
}

/// A branch of orbits, or a curve of bifurcations of a kind.
py::dict branch_to_dict(const Model& model, const AnySystem& system, const Branch& line,
                        std::string_view kind = {}) {
    CycleColumns columns;
    Multipliers multipliers;
    std::vector<signed char> stable;
    {
        const py::gil_scoped_release unlocked;
        for (const BranchPoint& point : line.points) {
            columns.add(system, point.cycle);
            multipliers.insert(multipliers.end(), point.multipliers.begin(),
                               point.multipliers.end());
            stable.push_back(point.stable(system.forced()) ? 1 : 0);
        }
    }
    const auto n = py::ssize_t(line.points.size()), dim = py::ssize_t(model.facts().dim);
    py::dict d;
    columns.to_dict(d, dim, py::ssize_t(model.facts().params.size()));
    d["multipliers"] = as_array(std::move(multipliers), {n, dim});
    d["stable"] = as_array(std::move(stable), {n});
    py::list special;
    for (const SpecialPoint& s : line.special)
        special.append(special_to_dict(model, system, s));
    d["special"] = special;
    d["ends"] = py::make_tuple(end_message(line, true), end_message(line, false));
    d["corrections"] = line.corrections;
    d["status"] = std::string(name(line.status));
    d["kind"] = std::string(kind);
    return d;
}

/// How far branches and curves go.
BranchSettings steps(double first_step, double max_step, int max_points) {
    BranchSettings settings;
    settings.first_step = first_step;
    settings.max_step = max_step;
    settings.max_points = max_points;
    return settings;
}

/// A bifurcation by its cycle, kind, node and side.
SpecialPoint special_from(const Model& model, const py::tuple& cycle, int kind, int node,
                          int side) {
    expect(kind >= 0 && kind <= static_cast<int>(Kind::grazing), "kind is 0 to 9");
    SpecialPoint point;
    point.kind = static_cast<Kind>(kind);
    point.cycle = cycle_from(model, cycle);
    expect(!changes_word(point.kind) || (node >= 0 && std::size_t(node) < point.cycle.size()),
           "node is an index");
    point.node = std::size_t(std::max(node, 0));
    point.side = side;
    point.convergence.status = Status::ok;
    return point;
}

/// @param kind  of the bifurcation where the branch starts, -1: none
py::dict traced(const Model& model, const py::tuple& cycle, int kind, int node, int side,
                int parameter, double low, double high, double first_step, double max_step,
                int max_points, const py::object& show, const RunSettings& run) {
    expect(parameter >= 0 && std::size_t(parameter) < model.facts().params.size(),
           "parameter is an index");
    const Cycle start = cycle_from(model, cycle);
    std::optional<SpecialPoint> special;
    if (kind >= 0)
        special = special_from(model, cycle, kind, node, side);
    Analysis analysis(model, run);
    BranchSettings settings = steps(first_step, max_step, max_points);
    if (const auto call = progress(show, analysis.signals))
        settings.progress = [=](std::size_t points) { call(points, 2 * std::size_t(max_points)); };
    Branch branch;
    {
        const py::gil_scoped_release unlocked;
        BranchTracer tracer(*analysis.system, parameter, low, high, settings);
        branch = special ? tracer.trace(*special) : tracer.trace(start);
    }
    py::dict d = branch_to_dict(model, *analysis.unstoppable, branch);
    d["raised"] = analysis.signals.raised();
    return d;
}

// --- two parameters ----------------------------------------------------------------------------

Box box_of(const Model& model, const std::array<int, 2>& parameters,
           const std::array<double, 2>& low, const std::array<double, 2>& high) {
    for (const int i : parameters)
        expect(i >= 0 && std::size_t(i) < model.facts().params.size(), "parameter is an index");
    return {parameters, low, high};
}

py::dict traced_curves(const Model& model, const py::tuple& cycle, int kind, int node, int side,
                       const std::array<int, 2>& parameters, const std::array<double, 2>& low,
                       const std::array<double, 2>& high, double first_step, double max_step,
                       int max_points, const RunSettings& run) {
    const SpecialPoint point = special_from(model, cycle, kind, node, side);
    const Box box = box_of(model, parameters, low, high);
    Analysis analysis(model, run);
    std::vector<Curve> curves;
    {
        const py::gil_scoped_release unlocked;
        curves = trace_connected(*analysis.system, box, curve_start(point),
                                 steps(first_step, max_step, max_points));
    }
    py::list all;
    for (const Curve& curve : curves)
        all.append(branch_to_dict(model, *analysis.unstoppable, curve, name(curve.kind)));
    py::dict d;
    d["curves"] = all;
    d["raised"] = analysis.signals.raised();
    return d;
}

py::dict explored(const Model& model, const Doubles& p, const std::array<int, 2>& parameters,
                  const std::array<double, 2>& low, const std::array<double, 2>& high,
                  const Doubles& x0, int lines, int starts, int max_turns, double transient,
                  double window, int max_curves, double first_step, double max_step, int max_points,
                  const py::object& show, const RunSettings& run) {
    expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
    const Box box = box_of(model, parameters, low, high);
    const Vector params = vector_of(p);
    BoxSearch search;
    search.x0 = vector_of(x0);
    search.lines = lines;
    search.starts = starts;
    search.max_curves = max_curves;
    search.orbit.max_turns = max_turns;
    search.orbit.transient = transient;
    search.orbit.window = window;
    search.steps = steps(first_step, max_step, max_points);
    Analysis analysis(model, run);
    search.progress = progress(show, analysis.signals);
    BifurcationSet set;
    {
        const py::gil_scoped_release unlocked;
        set = bifurcation_set(*analysis.system, params, box, search);
    }
    py::list branches, curves;
    for (const Branch& branch : set.branches)
        branches.append(branch_to_dict(model, *analysis.unstoppable, branch));
    for (const Curve& curve : set.curves)
        curves.append(branch_to_dict(model, *analysis.unstoppable, curve, name(curve.kind)));
    py::dict d;
    d["branches"] = branches;
    d["curves"] = curves;
    d["corrections"] = set.corrections;
    d["failed_starts"] = set.failed_starts;
    d["raised"] = analysis.signals.raised();
    return d;
}

} // namespace

void bind_orbit(py::module_& m) {
    m.def("settle", &settled);
    m.def("orbit_near", &near);
    m.def("solve_orbit", &solved);
    m.def("trace", &traced);
    m.def("trace_curves", &traced_curves);
    m.def("bifurcation_set", &explored);
    m.def("bifurcation_names", [] { return names_of(Kind::grazing); });
}

} // namespace filippov::python
