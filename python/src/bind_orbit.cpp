// SPDX-License-Identifier: BSD-3-Clause
#include "bind.hpp"

#include <filippov/continuation/bifurcation_set.hpp>

#include <pybind11/complex.h>

#include <algorithm>
#include <complex>
#include <limits>
#include <utility>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

void append(std::vector<double>& out, const Vector& x) {
    out.insert(out.end(), x.begin(), x.end());
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

/// Cycles, one after the other: a row a cycle, and one a node.
struct CycleColumns {
    py::array_t<long long> size;           // a cycle: its nodes
    py::array_t<int> mode, until, surface; // a node
    py::array_t<double> t, x, s;           // a node
    py::array_t<long long> turns;          // a cycle
    py::array_t<double> period, p;         // a cycle
    py::array_t<double> t_start, x_start;  // a cycle
};

/// Takes cycles without the lock, until they are made columns.
struct CycleRecorder {
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
    CycleColumns columns(const Facts& facts) {
        const auto n = py::ssize_t(size.size()), nodes = py::ssize_t(t.size());
        const auto dim = py::ssize_t(facts.dim), params = py::ssize_t(facts.params.size());
        return {.size = as_array(std::move(size), {n}),
                .mode = as_array(std::move(mode), {nodes}),
                .until = as_array(std::move(until), {nodes}),
                .surface = as_array(std::move(surface), {nodes}),
                .t = as_array(std::move(t), {nodes}),
                .x = as_array(std::move(x), {nodes, dim}),
                .s = as_array(std::move(s), {nodes}),
                .turns = as_array(std::move(turns), {n}),
                .period = as_array(std::move(period), {n}),
                .p = as_array(std::move(p), {n, params}),
                .t_start = as_array(std::move(t_start), {n}),
                .x_start = as_array(std::move(x_start), {n, dim})};
    }
};

/// The cycle of columns that hold one; `size`, `s`, `t_start` and `x_start` are not read.
Cycle cycle_from(const Model& model, const CycleColumns& columns) {
    const Array<int> mode = columns.mode, until = columns.until, surface = columns.surface;
    const Array<long long> turns = columns.turns;
    const Doubles t = columns.t, x = columns.x, period = columns.period, p = columns.p;
    const Facts& facts = model.facts();
    const py::ssize_t n = t.size();
    expect(turns.size() == 1 && period.size() == 1 && std::in_range<int>(*turns.data()),
           "there is one cycle");
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
    c.turns = int(*turns.data());
    c.period = *period.data();
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
struct OrbitResult {
    CycleColumns cycles; // one, or none
    py::array_t<std::complex<double>> multipliers;
    py::array_t<double> monodromy;
    bool stable = false;
    int iterations = 0;
    double residual = 0;
    std::string status, message;
    py::object raised = py::none();
};

OrbitResult result_of(const Model& model, const AnySystem& system, const Orbit& orbit) {
    CycleRecorder cycles;
    Matrix transposed = orbit.monodromy.transpose(); // numpy goes row by row
    double left = 0;
    {
        const py::gil_scoped_release unlocked;
        if (orbit.cycle.size() > 0)
            cycles.add(system, orbit.cycle);
        left = residual(system, orbit.cycle);
    }
    OrbitResult r;
    r.cycles = cycles.columns(model.facts());
    r.multipliers = array_of(orbit.multipliers);
    r.monodromy =
        as_array(std::vector<double>(transposed.data(), transposed.data() + transposed.size()),
                 {py::ssize_t(orbit.monodromy.rows()), py::ssize_t(orbit.monodromy.cols())});
    r.stable = orbit.status == Status::ok && orbit.stable(system.forced());
    r.iterations = orbit.convergence.iterations;
    r.residual = left;
    r.status = name(orbit.status);
    r.message = orbit.message;
    return r;
}

/// Looks for an orbit without the lock.
template <class Search>
OrbitResult searched(const Model& model, const RunSettings& run, Search search) {
    Analysis analysis(model, run);
    Orbit orbit;
    {
        const py::gil_scoped_release unlocked;
        orbit = search(*analysis.system);
    }
    OrbitResult r = result_of(model, *analysis.unstoppable, orbit);
    r.raised = analysis.signals.raised();
    return r;
}

void check_point(const Model& model, const Doubles& p, const Doubles& x0) {
    expect(std::size_t(p.size()) == model.facts().params.size(), "p has one entry a parameter");
    expect(x0.size() == model.facts().dim, "x0 has dim entries");
}

OrbitResult settled(const Model& model, const Doubles& p, const Doubles& x0, double transient,
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

OrbitResult near(const Model& model, const Doubles& p, double t0, const Doubles& x0, int turns,
                 double window, const RunSettings& run) {
    check_point(model, p, x0);
    const Vector params = vector_of(p), start = vector_of(x0);
    OrbitSearch search;
    search.window = window;
    return searched(model, run, [&](const AnySystem& system) {
        return orbit_near(system, params, t0, start, turns, search);
    });
}

OrbitResult solved(const Model& model, const CycleColumns& cycle, const RunSettings& run) {
    const Cycle start = cycle_from(model, cycle);
    return searched(model, run,
                    [&](const AnySystem& system) { return solve_orbit(system, start); });
}

// --- branches ----------------------------------------------------------------------------------

/// A bifurcation, and the orbit there.
struct SpecialPointResult {
    OrbitResult orbit;
    std::string kind;
    int node = -1; // none
    int side = 0;
    std::string word_before, word_after;
    std::vector<std::pair<std::string, double>> conditions;
    py::array_t<std::complex<double>> multipliers;
};

SpecialPointResult result_of(const Model& model, const AnySystem& system, const SpecialPoint& s) {
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
    return {.orbit = result_of(model, system, orbit),
            .kind = std::string(name(s.kind)),
            .node = s.side != 0 ? int(s.node) : -1,
            .side = s.side,
            .word_before = s.word_before,
            .word_after = s.word_after,
            .conditions = s.conditions,
            .multipliers = array_of(s.multipliers)};
}

/// A branch of orbits, or a curve of bifurcations of a kind: a row a point.
struct BranchColumns {
    std::string kind; // empty for orbits
    CycleColumns cycles;
    py::array_t<std::complex<double>> multipliers;
    py::array_t<signed char> stable;
    std::vector<SpecialPointResult> special;
    std::pair<std::string, std::string> ends;
    long long corrections = 0;
    std::string status;
    py::object raised = py::none();
};

BranchColumns columns_of(const Model& model, const AnySystem& system, const Branch& line,
                         std::string_view kind = {}) {
    CycleRecorder cycles;
    Multipliers multipliers;
    std::vector<signed char> stable;
    {
        const py::gil_scoped_release unlocked;
        for (const BranchPoint& point : line.points) {
            cycles.add(system, point.cycle);
            multipliers.insert(multipliers.end(), point.multipliers.begin(),
                               point.multipliers.end());
            stable.push_back(point.stable(system.forced()) ? 1 : 0);
        }
    }
    const auto n = py::ssize_t(line.points.size()), dim = py::ssize_t(model.facts().dim);
    BranchColumns c;
    c.kind = kind;
    c.cycles = cycles.columns(model.facts());
    c.multipliers = as_array(std::move(multipliers), {n, dim});
    c.stable = as_array(std::move(stable), {n});
    for (const SpecialPoint& s : line.special)
        c.special.push_back(result_of(model, system, s));
    c.ends = {end_message(line, true), end_message(line, false)};
    c.corrections = line.corrections;
    c.status = name(line.status);
    return c;
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
SpecialPoint special_from(const Model& model, const CycleColumns& cycle, int kind, int node,
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
BranchColumns traced(const Model& model, const CycleColumns& cycle, int kind, int node, int side,
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
    BranchColumns c = columns_of(model, *analysis.unstoppable, branch);
    c.raised = analysis.signals.raised();
    return c;
}

// --- two parameters ----------------------------------------------------------------------------

Box box_of(const Model& model, const std::array<int, 2>& parameters,
           const std::array<double, 2>& low, const std::array<double, 2>& high) {
    for (const int i : parameters)
        expect(i >= 0 && std::size_t(i) < model.facts().params.size(), "parameter is an index");
    return {parameters, low, high};
}

/// A curve of bifurcations, and those connected with it.
struct Curves {
    std::vector<BranchColumns> curves;
    py::object raised = py::none();
};

Curves traced_curves(const Model& model, const CycleColumns& cycle, int kind, int node, int side,
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
    Curves r;
    for (const Curve& curve : curves)
        r.curves.push_back(columns_of(model, *analysis.unstoppable, curve, name(curve.kind)));
    r.raised = analysis.signals.raised();
    return r;
}

/// What was found in a rectangle of two parameters.
struct BifurcationSetResult {
    std::vector<BranchColumns> branches, curves;
    long long corrections = 0;
    int failed_starts = 0;
    py::object raised = py::none();
};

BifurcationSetResult explored(const Model& model, const Doubles& p,
                              const std::array<int, 2>& parameters,
                              const std::array<double, 2>& low, const std::array<double, 2>& high,
                              const Doubles& x0, int lines, int starts, int max_turns,
                              double transient, double window, int max_curves, double first_step,
                              double max_step, int max_points, const py::object& show,
                              const RunSettings& run) {
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
    BifurcationSetResult r;
    for (const Branch& branch : set.branches)
        r.branches.push_back(columns_of(model, *analysis.unstoppable, branch));
    for (const Curve& curve : set.curves)
        r.curves.push_back(columns_of(model, *analysis.unstoppable, curve, name(curve.kind)));
    r.corrections = set.corrections;
    r.failed_starts = set.failed_starts;
    r.raised = analysis.signals.raised();
    return r;
}

} // namespace

void bind_orbit(py::module_& m) {
    bind_struct<CycleColumns>(m, "CycleColumns")
        .field("size", &CycleColumns::size)
        .field("mode", &CycleColumns::mode)
        .field("until", &CycleColumns::until)
        .field("surface", &CycleColumns::surface)
        .field("t", &CycleColumns::t)
        .field("x", &CycleColumns::x)
        .field("s", &CycleColumns::s)
        .field("turns", &CycleColumns::turns)
        .field("period", &CycleColumns::period)
        .field("p", &CycleColumns::p)
        .field("t_start", &CycleColumns::t_start)
        .field("x_start", &CycleColumns::x_start);
    bind_struct<OrbitResult>(m, "OrbitResult")
        .field("cycles", &OrbitResult::cycles)
        .field("multipliers", &OrbitResult::multipliers)
        .field("monodromy", &OrbitResult::monodromy)
        .field("stable", &OrbitResult::stable)
        .field("iterations", &OrbitResult::iterations)
        .field("residual", &OrbitResult::residual)
        .field("status", &OrbitResult::status)
        .field("message", &OrbitResult::message)
        .field("raised", &OrbitResult::raised);
    m.def("settle", &settled);
    m.def("orbit_near", &near);
    m.def("solve_orbit", &solved);
    bind_struct<SpecialPointResult>(m, "SpecialPointResult")
        .field("orbit", &SpecialPointResult::orbit)
        .field("kind", &SpecialPointResult::kind)
        .field("node", &SpecialPointResult::node)
        .field("side", &SpecialPointResult::side)
        .field("word_before", &SpecialPointResult::word_before)
        .field("word_after", &SpecialPointResult::word_after)
        .field("conditions", &SpecialPointResult::conditions)
        .field("multipliers", &SpecialPointResult::multipliers);
    bind_struct<BranchColumns>(m, "BranchColumns")
        .field("kind", &BranchColumns::kind)
        .field("cycles", &BranchColumns::cycles)
        .field("multipliers", &BranchColumns::multipliers)
        .field("stable", &BranchColumns::stable)
        .field("special", &BranchColumns::special)
        .field("ends", &BranchColumns::ends)
        .field("corrections", &BranchColumns::corrections)
        .field("status", &BranchColumns::status)
        .field("raised", &BranchColumns::raised);
    m.def("trace", &traced);
    bind_struct<Curves>(m, "Curves")
        .field("curves", &Curves::curves)
        .field("raised", &Curves::raised);
    m.def("trace_curves", &traced_curves);
    bind_struct<BifurcationSetResult>(m, "BifurcationSetResult")
        .field("branches", &BifurcationSetResult::branches)
        .field("curves", &BifurcationSetResult::curves)
        .field("corrections", &BifurcationSetResult::corrections)
        .field("failed_starts", &BifurcationSetResult::failed_starts)
        .field("raised", &BifurcationSetResult::raised);
    m.def("bifurcation_set", &explored);
    m.def("bifurcation_names", [] { return names_of(Kind::grazing); });
}

} // namespace filippov::python
