// SPDX-License-Identifier: BSD-3-Clause
// Wrong arguments of public functions, a line each, and parameters that were not given. Without
// Catch2, which no memory sanitizer has seen: test_arguments.cpp and memory/main.cpp run it.
#pragma once

#include <filippov/basins/cells.hpp>
#include <filippov/continuation/branch.hpp>
#include <filippov/continuation/curve.hpp>
#include <filippov/engine/all_branches.hpp>
#include <filippov/engine/time_stepping.hpp>
#include <filippov/engine/variation.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/formulas/tape_system.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/diagram.hpp>
#include <filippov/orbits/geometry.hpp>
#include <filippov/orbits/lyapunov.hpp>
#include <filippov/orbits/maps.hpp>
#include <filippov/orbits/orbit.hpp>
#include <filippov/system/smoothing.hpp>

#ifdef __has_feature
#if __has_feature(memory_sanitizer)
#define FILIPPOV_MEMORY_SANITIZER
#include <sanitizer/msan_interface.h>
#endif
#endif

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace arguments {

using namespace filippov;
using models::Coulomb;
using models::Oscillator;

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double inf = std::numeric_limits<double>::infinity();

/// Collects what is not as it should be.
class Judge {
public:
    /// The call has to be refused by a message that has this in it.
    template <class Call> void refuses(const std::string& part, Call call) {
        ++cases;
        try {
            call();
            faults.push_back("not refused: " + part);
        } catch (const std::invalid_argument& e) {
            const char* text = what(e);
            believe(part.c_str());
            if (std::strstr(text, part.c_str()) == nullptr)
                faults.push_back("expected '" + part + "', and it says '" + text + "'");
        } catch (const std::exception& e) {
            faults.push_back("expected '" + part + "', and it throws '" + what(e) + "'");
        }
    }
    void holds(const std::string& statement, bool condition) {
        ++cases;
        if (!condition)
            faults.push_back("does not hold: " + statement);
    }
    int cases = 0;
    std::vector<std::string> faults;

private:
    // Errors and their texts are made in the standard library, which the memory sanitizer has not
    // seen.
    static const char* what(const std::exception& e) {
#ifdef FILIPPOV_MEMORY_SANITIZER
        __msan_unpoison(&e, sizeof e);
#endif
        const char* text = e.what();
        believe(text);
        return text;
    }
    static void believe([[maybe_unused]] const char* text) {
#ifdef FILIPPOV_MEMORY_SANITIZER
        __msan_unpoison_string(text);
#endif
    }
};

// --- runs ----------------------------------------------------------------------------------------

struct RunArguments {
    Vec<double, 3> p = default_params<Coulomb>();
    Vec<double, 2> x0{3, 0};
    double t0 = 0, t_end = 5;
    Settings<double, 2> settings{};
};
using Log = EventLog<double, 2, 1>;

/// All that a run is told, wrong in one thing at a time.
template <class Run> void judge_run(Judge& judge, const std::string& who, Run run) {
    const auto wrong = [&](const std::string& part, auto change) {
        RunArguments a;
        change(a);
        judge.refuses(part, [&] { run(a); });
    };
    const auto before = judge.faults.size();
    for (const double bad : {nan, inf, -inf}) {
        wrong("x0[1] = ", [&](auto& a) { a.x0[1] = bad; });
        wrong("params[2] = ", [&](auto& a) { a.p[2] = bad; });
        wrong("t0 = ", [&](auto& a) { a.t0 = bad; });
        wrong("t_end = ", [&](auto& a) { a.t_end = bad; });
        wrong("atol[0] = ", [&](auto& a) { a.settings.atol[0] = bad; });
        wrong("first_step = ", [&](auto& a) { a.settings.first_step = bad; });
        wrong("fixed_step = ", [&](auto& a) { a.settings.fixed_step = bad; });
    }
    for (const double bad : {nan, inf, 0.0, -1e-8, 1.0})
        wrong("rtol = ", [&](auto& a) { a.settings.rtol = bad; });
    for (const double bad : {nan, -inf, 0.0, -1.0})
        wrong("max_step = ", [&](auto& a) { a.settings.max_step = bad; });
    wrong("atol[1] = -1e-10", [](auto& a) { a.settings.atol[1] = -1e-10; });
    wrong("first_step = -1", [](auto& a) { a.settings.first_step = -1; });
    wrong("fixed_step = -1", [](auto& a) { a.settings.fixed_step = -1; });
    for (const long long bad : {0LL, -1LL}) {
        wrong("max_steps = ", [&](auto& a) { a.settings.max_steps = bad; });
        wrong("max_events = ", [&](auto& a) { a.settings.max_events = bad; });
    }
    for (auto k = before; k < judge.faults.size(); ++k)
        judge.faults[k] = who + ": " + judge.faults[k];
}

template <class D> Vec<D, 2> seeded(const Vec<double, 2>& x) {
    return {D::variable(x[0], 0), D::variable(x[1], 1)};
}
template <class D> Vec<D, 3> constant(const Vec<double, 3>& p) { return {p[0], p[1], p[2]}; }

inline void judge_runs(Judge& judge) {
    using D = Dual<double, 2>;
    judge_run(judge, "flow", [](const RunArguments& a) {
        Log log;
        flow(Coulomb{}, a.p, a.x0, a.t0, a.t_end, a.settings, log);
    });
    judge_run(judge, "simulate", [](const RunArguments& a) {
        simulate(Coulomb{}, a.p, a.x0, a.t0, a.t_end, a.settings);
    });
    judge_run(judge, "simulate_all", [](const RunArguments& a) {
        simulate_all(Coulomb{}, a.p, a.x0, a.t0, a.t_end, a.settings);
    });
    judge_run(judge, "segment", [](const RunArguments& a) {
        segment<DormandPrince5>(Coulomb{}, a.p, mode_of<1>(-1), a.x0, a.t0, a.t_end, -1,
                                a.settings);
    });
    judge_run(judge, "flow in duals", [](const RunArguments& a) {
        flow(Coulomb{}, constant<D>(a.p), seeded<D>(a.x0), D(a.t0), D(a.t_end), a.settings);
    });
    judge_run(judge, "segment in duals", [](const RunArguments& a) {
        segment<DormandPrince5>(Coulomb{}, constant<D>(a.p), mode_of<1>(-1), seeded<D>(a.x0),
                                D(a.t0), D(a.t_end), a.settings);
    });
    judge.refuses("most = 0",
                  [] { simulate_all(Coulomb{}, {}, Vec<double, 2>(3, 0), 0, 5, {}, 0); });
}

/// Modes, targets, starts that are known, sections.
inline void judge_parts_of_runs(Judge& judge) {
    const Vec<double, 2> x0(3, 0);
    const Settings<double, 2> settings;
    Log log;
    for (const int bad : {-2, 2, 127}) {
        Mode<1> mode;
        mode.set(0, bad);
        judge.refuses("mode[0] = ", [&] {
            segment<DormandPrince5>(Coulomb{}, {}, mode, x0, 0, 5, -1, settings);
        });
        KnownStart<1> known;
        known.before = mode;
        judge.refuses("known_start.before[0] = ",
                      [&] { flow(Coulomb{}, {}, x0, 0, 5, settings, log, {}, known); });
    }
    for (const int bad : {-2, 3, 1000})
        judge.refuses("target = ", [&] {
            segment<DormandPrince5>(Coulomb{}, {}, mode_of<1>(-1), x0, 0, 5, bad, settings);
        });
    for (const int bad : {-2, 3, 1000}) {
        KnownStart<1> known;
        known.guard = bad;
        judge.refuses("known_start.guard = ",
                      [&] { flow(Coulomb{}, {}, x0, 0, 5, settings, log, {}, known); });
    }
    const auto g = [](const auto&, const auto& x, const auto&) { return x[0]; };
    judge.refuses("sections[0].direction = 2",
                  [&] { flow(Coulomb{}, {}, x0, 0, 5, settings, log, sections(Section{g, 2})); });
    DynamicSections<double, 2, 3, 4> dynamic;
    for (const int bad : {-1, 5}) {
        dynamic.count = bad;
        judge.refuses("sections.count = ",
                      [&] { flow(Coulomb{}, {}, x0, 0, 5, settings, log, dynamic); });
    }
    dynamic.count = 1;
    judge.refuses("sections[0].value",
                  [&] { flow(Coulomb{}, {}, x0, 0, 5, settings, log, dynamic); });
}

/// Times at which states are kept.
inline void judge_output_times(Judge& judge) {
    const auto run = [](const std::vector<double>& times, double t0, double t_end) {
        OutputTimes<double, 2, 1> output{times};
        flow(Coulomb{}, {}, Vec<double, 2>(3, 0), t0, t_end, {}, output);
        return output.states.size();
    };
    const double beyond = std::nextafter(5.0, 6.0), before = std::nextafter(5.0, 4.0);
    judge.refuses("times[1] = 1: expected the order", [&] { run({3, 1, 2}, 0, 5); });
    judge.refuses("times[1] = 3: expected the order", [&] { run({1, 3, 2}, 5, 0); });
    judge.refuses("times[1] = 2: expected the order", [&] { run({1, 2, 3}, 5, 0); });
    judge.refuses("times[0] = -1: expected no time before", [&] { run({-1, 2}, 0, 5); });
    judge.refuses("times[0] = 6: expected no time before", [&] { run({6, 2}, 5, 0); });
    judge.refuses("times[1] = nan", [&] { run({1, nan, 2}, 0, 5); });
    judge.refuses("times[0] = inf", [&] { run({inf}, 0, 5); });
    judge.refuses("times[0] = -inf", [&] { run({-inf}, 5, 0); });
    judge.refuses("times[1] = 6: expected no time after", [&] { run({1, 6}, 0, 5); });
    judge.refuses("times[1] = 5.0000000000000009: expected no time after the end, t_end = 5",
                  [&] { run({1, beyond}, 0, 5); });
    judge.refuses("times[1] = -1: expected no time after", [&] { run({1, -1}, 5, 0); });
    judge.refuses("times[0] = 1: expected no time", [&] { run({1}, 0, 0); });
    judge.holds("no times", run({}, 0, 5) == 0);
    judge.holds("times twice", run({0, 0, 1, 1, 5, 5}, 0, 5) == 6);
    judge.holds("backwards", run({5, 3, 3, 0}, 5, 0) == 4);
    judge.holds("a run of no length", run({2, 2}, 2, 2) == 2);
    judge.holds("beside the end", run({before, 5}, 0, 5) == 2);
    OutputTimes<double, 2, 1> twice;
    const std::vector<double> times{1, 2};
    twice.times = times;
    for (int k = 0; k < 2; ++k)
        flow(Coulomb{}, {}, Vec<double, 2>(3, 0), 0, 5, {}, twice);
    judge.holds("each run keeps its own", twice.states.size() == 2 && twice.modes.size() == 2);
}

// --- parameters that were not given --------------------------------------------------------------

/// The same with `{}` and with the defaults, to the last bit.
inline void judge_defaults(Judge& judge) {
    const Vec<double, 2> x0(3, 0.1);
    const Vec<double, 3> p = default_params<Coulomb>();
    const Settings<double, 2> settings;
    using D = Dual<double, 2>;
    const auto end = simulate(Coulomb{}, p, x0, 0, 5).result.x;
    judge.holds("simulate", simulate(Coulomb{}, {}, x0, 0, 5).result.x == end);
    judge.holds("simulate, values in braces",
                simulate(Coulomb{}, {0.4, 0.0, 0.5}, x0, 0, 5).result.x == end);
    judge.holds("simulate, an expression",
                simulate(Coulomb{}, (2 * p) / 2, x0, 0, 5).result.x == end);
    judge.holds("simulate_all",
                simulate_all(Coulomb{}, {}, x0, 0, 5).all[0].trajectory.result.x == end);
    judge.holds("flow", flow(Coulomb{}, {}, x0, 0, 5, settings).x == end);
    const auto varied = flow(Coulomb{}, {}, seeded<D>(x0), D(0), D(5), settings);
    const auto wanted = flow(Coulomb{}, constant<D>(p), seeded<D>(x0), D(0), D(5), settings);
    judge.holds("flow in duals", varied.x[0].d == wanted.x[0].d && varied.x[1].d == wanted.x[1].d);
    const auto forced = [&](const auto& given) {
        return segment<DormandPrince5>(Coulomb{}, given, mode_of<1>(-1), x0, 0, 5, -1, settings).x;
    };
    judge.holds("segment",
                segment<DormandPrince5>(Coulomb{}, {}, mode_of<1>(-1), x0, 0, 5, -1, settings).x ==
                    forced(p));
    const auto dual_segment =
        segment<DormandPrince5>(Coulomb{}, {}, mode_of<1>(-1), seeded<D>(x0), D(0), D(5), settings);
    judge.holds("segment in duals", std::abs(dual_segment.x[0].v - forced(p)[0]) == 0);
    using Steps = Blended<Coulomb>;
    judge.holds("time_stepping", time_stepping(Steps{}, {}, x0, 0, 5, {}).x.back() ==
                                     time_stepping(Steps{}, p, x0, 0, 5, {}).x.back());
    const auto smooth = smoothed(Steps{}, {.c1 = 100});
    judge.holds("a smoothed system",
                simulate(smooth, {}, x0, 0, 5).result.x == simulate(smooth, p, x0, 0, 5).result.x);
    for (const int size : {0, 2, 4}) {
        const Eigen::VectorXd other = Eigen::VectorXd::Zero(size);
        judge.refuses("params.size() = ", [&] { simulate(Coulomb{}, other, x0, 0, 5); });
    }
}

/// A system that is made at run time: its defaults, and what is computed from them.
inline void judge_tape_defaults(Judge& judge) {
    Definition d;
    d.dim = 2;
    d.param_names = {"mu", "c"};
    d.defaults = {0.4, 2};
    Graph& g = d.graph;
    const Expr x = g.state(0), v = g.state(1), mu = g.param(0), c = g.param(1);
    const Expr force = g.sub(g.neg(x), g.mul(g.div(mu, g.mul(c, c)), g.unary(Op::sign, v)));
    split(d, std::vector<Expr>{v, force});
    const TapeSystem<2, 1, 8> block(std::make_shared<const TapeProgram>(d, 8));
    const auto p = all_params<double>(block, default_values(block));
    const Vec<double, 2> x0(3, 0);
    judge.holds("a system of formulas",
                simulate(block, {}, x0, 0, 5).result.x == simulate(block, p, x0, 0, 5).result.x);
}

/// Members of an ensemble and values of a diagram.
inline void judge_many(Judge& judge) {
    const auto p = default_params<Oscillator>();
    const Settings<double, 2> settings;
    std::vector<Member<2, 10>> members(4);
    members[0] = {{0, 0}, p, 0, 5};
    members[1] = {{0, 0}, {}, 0, 5};
    members[2] = {{}, p, 0, 5};
    members[3].t_end = 5;
    const auto result = ensemble<DormandPrince8, 4>(Oscillator{}, members, settings);
    judge.holds("a whole member", result.outcomes[0].status == Status::ok);
    for (std::size_t k = 1; k < members.size(); ++k)
        judge.holds("what a member lacks", result.outcomes[k].status == Status::not_finite);
    judge.refuses("threads = -1", [&] {
        ensemble<DormandPrince8, 4>(Oscillator{}, members, settings, {.threads = -1});
    });
    judge.refuses("rtol = 0",
                  [&] { ensemble<DormandPrince8, 4>(Oscillator{}, members, {.rtol = 0}); });

    const std::vector<Params<Oscillator, double>> values{p};
    const auto diagram = [&](auto change) {
        DiagramSettings<double, 2> d;
        d.transient = 2;
        d.keep = 2;
        Vec<double, 2> x0(0, 0);
        change(d, x0);
        return bifurcation_diagram(Oscillator{}, std::span(values), x0, d);
    };
    judge.holds("a diagram", diagram([](auto&, auto&) {})[0].status == Status::ok);
    judge.refuses("x0[0] = ", [&] { diagram([](auto&, auto& x) { x[0] = nan; }); });
    for (const double bad : {nan, inf, -1.0, 0.5}) {
        judge.refuses("transient = ", [&] { diagram([&](auto& d, auto&) { d.transient = bad; }); });
        judge.refuses("keep = ", [&] { diagram([&](auto& d, auto&) { d.keep = bad; }); });
    }
    judge.refuses("keep = 0", [&] { diagram([](auto& d, auto&) { d.keep = 0; }); });
    judge.refuses("chains = 0", [&] { diagram([](auto& d, auto&) { d.chains = 0; }); });
    judge.refuses("direction = 2",
                  [&] { diagram([](auto& d, auto&) { d.section.direction = 2; }); });
    for (const int bad : {-2, 1})
        judge.refuses("section.surface = ",
                      [&] { diagram([&](auto& d, auto&) { d.section.surface = bad; }); });
    judge.refuses("events", [&] { diagram([](auto& d, auto&) { d.section.events.bits = 0; }); });
    judge.refuses("max_step = 0", [&] { diagram([](auto& d, auto&) { d.run.max_step = 0; }); });
}

/// Time stepping and smoothing.
inline void judge_other_methods(Judge& judge) {
    using Steps = Blended<Coulomb>;
    const auto steps = [](auto change) {
        TimeSteppingSettings s;
        RunArguments a;
        change(s, a);
        time_stepping(Steps{}, a.p, a.x0, a.t0, a.t_end, s);
    };
    judge.refuses("steps = 0", [&] { steps([](auto& s, auto&) { s.steps = 0; }); });
    judge.refuses("keep = -1", [&] { steps([](auto& s, auto&) { s.keep = -1; }); });
    judge.refuses("max_newton = 0", [&] { steps([](auto& s, auto&) { s.max_newton = 0; }); });
    for (const double bad : {nan, 0.4, 1.1})
        judge.refuses("theta = ", [&] { steps([&](auto& s, auto&) { s.theta = bad; }); });
    judge.refuses("x0[0] = ", [&] { steps([](auto&, auto& a) { a.x0[0] = nan; }); });
    judge.refuses("params[0] = ", [&] { steps([](auto&, auto& a) { a.p[0] = inf; }); });
    judge.refuses("t0 = ", [&] { steps([](auto&, auto& a) { a.t0 = nan; }); });
    judge.refuses("t_end = ", [&] { steps([](auto&, auto& a) { a.t_end = inf; }); });
    for (const double bad : {nan, inf, 0.0, -1.0})
        judge.refuses("c1 = ", [&] { smoothed(Steps{}, {.c1 = bad}); });
    for (const double bad : {nan, inf, -1.0})
        judge.refuses("band = ", [&] { smoothed(Steps{}, {.band = bad}); });
}

// --- systems whose type is forgotten -------------------------------------------------------------

/// Numbers of another length than the system's: none is read beyond its end.
inline void judge_sizes(Judge& judge, const AnySystem& system, const Vector& x, const Vector& p) {
    const Vector one = Vector::Zero(1), none;
    const Directions far{{int(p.size()), -1}, nullptr}, short_v{{-1, -1}, &one};
    for (const Vector& q : {none, one}) {
        judge.refuses("p.size() = ", [&] { system.period(q, {}); });
        judge.refuses("p.size() = ", [&] { system.s_max(q); });
        judge.refuses("p.size() = ", [&] { system.field(1, 0, x, q); });
        judge.refuses("p.size() = ", [&] { system.rate(1, 0, x, q, {}); });
        judge.refuses("p.size() = ", [&] { system.quantity({}, 0, x, q, {}); });
        judge.refuses("p.size() = ", [&] { system.arc(1, 0, x, 1, q, {}); });
        judge.refuses("p.size() = ", [&] { system.minima(1, 0, x, 1, q); });
        judge.refuses("p.size() = ", [&] { system.run(0, x, 1, q); });
        judge.refuses("p.size() = ", [&] { system.journey({.x = x, .t_end = 1}, q, {}); });
        judge.refuses("x.size() = ", [&] { system.field(1, 0, q, p); });
        judge.refuses("x.size() = ", [&] { system.rate(1, 0, q, p, {}); });
        judge.refuses("x.size() = ", [&] { system.quantity({}, 0, q, p, {}); });
        judge.refuses("x.size() = ", [&] { system.arc(1, 0, q, 1, p, {}); });
        judge.refuses("x.size() = ", [&] { system.minima(1, 0, q, 1, p); });
        judge.refuses("x.size() = ", [&] { system.run(0, q, 1, p); });
        judge.refuses("x.size() = ", [&] { system.journey({.x = q, .t_end = 1}, p, {}); });
    }
    for (const int bad : {-2, 2, 9}) {
        judge.refuses("mode = ", [&] { system.field(bad, 0, x, p); });
        judge.refuses("mode = ", [&] { system.arc(bad, 0, x, 1, p, {}); });
    }
    judge.refuses("along.active = ", [&] { system.period(p, far); });
    judge.refuses("along.active = ", [&] { system.rate(1, 0, x, p, far); });
    judge.refuses("along.active = ", [&] { system.journey({.x = x, .t_end = 1}, p, far); });
    judge.refuses("along.v.size() = 1", [&] { system.rate(1, 0, x, p, short_v); });
    Quantity q;
    q.surface = 1;
    judge.refuses("surface = 1", [&] { system.quantity(q, 0, x, p, {}); });
    q.surface = 0;
    q.order = -1;
    judge.refuses("q.order = -1", [&] { system.quantity(q, 0, x, p, {}); });
}

inline void judge_maps(Judge& judge, const AnySystem& system, const Vector& x, const Vector& p) {
    Vector bad_x = x, bad_p = p;
    bad_x[0] = nan;
    bad_p[0] = inf;
    judge.refuses("x[0] = nan", [&] { strobe(system, 0, bad_x, p); });
    judge.refuses("p[0] = inf", [&] { strobe(system, 0, x, bad_p); });
    judge.refuses("t0 = nan", [&] { strobe(system, nan, x, p); });
    judge.refuses("iterate = 0", [&] { strobe(system, 0, x, p, 0); });
    judge.refuses("along.active = 10", [&] { strobe(system, 0, x, p, 1, {{10, -1}, nullptr}); });
    judge.refuses("x.size() = 0", [&] { strobe(system, 0, {}, p); });
    judge.refuses("p.size() = 0", [&] { strobe(system, 0, x, {}); });
    for (const double bad : {nan, inf, 0.0, -1.0})
        judge.refuses("max_time = ", [&] { section_map(system, {}, 0, x, p, bad); });
    judge.refuses("section.kind",
                  [&] { section_map(system, {.kind = EventKind::graze}, 0, x, p, 10); });
    judge.refuses("section.after = 3", [&] { section_map(system, {.after = 3}, 0, x, p, 10); });
    judge.refuses("section.surface = 1", [&] { section_map(system, {.surface = 1}, 0, x, p, 10); });
    for (const double bad : {nan, 0.0, -1.0, 1e10})
        judge.refuses("max_periods = ", [&] { TransitionMap(system, p, {.max_periods = bad}); });
    const TransitionMap map(system, p);
    judge.refuses("boundary = 0", [&] { map({0, 1}); });
    judge.refuses("from.phase = nan", [&] { map({-1, nan}); });
    judge.refuses("iterate = 0", [&] { map({-1, 1}, 0); });
}

inline void judge_orbits(Judge& judge, const AnySystem& system, const Vector& x, const Vector& p) {
    Vector bad = x;
    bad[1] = inf;
    judge.refuses("x0[1] = inf", [&] { settle(system, p, bad); });
    judge.refuses("x0.size() = 0", [&] { settle(system, p, {}); });
    judge.refuses("p.size() = 0", [&] { settle(system, {}, x); });
    for (const double value : {nan, inf, -1.0})
        judge.refuses("transient = ", [&] { settle(system, p, x, {.transient = value}); });
    judge.refuses("max_turns = 0", [&] { settle(system, p, x, {.max_turns = 0}); });
    for (const double value : {nan, inf, 0.0, -1.0}) {
        judge.refuses("window = ", [&] { settle(system, p, x, {.window = value}); });
        judge.refuses("closeness = ", [&] { settle(system, p, x, {.closeness = value}); });
    }
    judge.refuses("t0 = nan", [&] { orbit_near(system, p, nan, x, 1); });
    judge.refuses("turns = 0", [&] { orbit_near(system, p, 0, x, 0); });
    judge.refuses("x0[1] = inf", [&] { orbit_near(system, p, 0, bad, 1); });

    Cycle cycle;
    judge.refuses("cycle.t.size() = 0", [&] { solve_orbit(system, cycle); });
    cycle.t = {0};
    judge.refuses("cycle.word.letters.size() = 0", [&] { solve_orbit(system, cycle); });
    cycle.word.letters = {Letter{}};
    judge.refuses("cycle.x.size() = 0", [&] { solve_orbit(system, cycle); });
    cycle.x = {Vector::Zero(1)};
    judge.refuses("cycle.x[0].size() = 1", [&] { floquet(system, cycle); });
    cycle.x = {x};
    judge.refuses("p.size() = 0", [&] { solve_orbit(system, cycle); });

    judge.refuses("parameter = 10", [&] { BranchTracer(system, 10, 0, 1); });
    judge.refuses("parameter = -1", [&] { BranchTracer(system, -1, 0, 1); });
    for (const double high : {nan, inf, 0.0, -1.0})
        judge.refuses("low = ", [&] { BranchTracer(system, 0, 0, high); });
    judge.refuses("min_step = ", [&] { BranchTracer(system, 0, 0, 1, {.min_step = nan}); });
    judge.refuses("first_step = ", [&] { BranchTracer(system, 0, 0, 1, {.first_step = nan}); });
    judge.refuses("max_points = ", [&] { BranchTracer(system, 0, 0, 1, {.max_points = 0}); });
    judge.refuses("start.p[0]", [&] {
        cycle.p = p;
        BranchTracer(system, 0, 2, 3).trace(cycle);
    });
    judge.refuses("box.parameters", [&] { CurveTracer(system, Box{{0, 0}, {0, 0}, {1, 1}}); });
    judge.refuses("box.low", [&] { CurveTracer(system, Box{{0, 1}, {0, nan}, {1, 1}}); });
}

inline void judge_analysis(Judge& judge, const AnySystem& system, const Vector& x,
                           const Vector& p) {
    Vector bad = x;
    bad[0] = nan;
    judge.refuses("x0[0] = nan", [&] { lyapunov(system, p, bad); });
    judge.refuses("p.size() = 0", [&] { lyapunov(system, {}, x); });
    for (const double value : {nan, inf, -1.0})
        judge.refuses("transient = ", [&] { lyapunov(system, p, x, {.transient = value}); });
    for (const double value : {nan, inf, 0.0, -1.0}) {
        judge.refuses("window = ", [&] { lyapunov(system, p, x, {.window = value}); });
        judge.refuses("stretch = ", [&] { lyapunov(system, p, x, {.stretch = value}); });
    }
    judge.refuses("batches = 1", [&] { lyapunov(system, p, x, {.batches = 1}); });

    const StateBox box{Vector::Constant(2, -1), Vector::Constant(2, 1)};
    const StateBox none{Vector::Constant(2, 1), Vector::Constant(2, 1)}, flat{x.head(1), x.head(1)};
    judge.refuses("box.low[0] = ", [&] { tangencies(system, 1, 0, none, p); });
    judge.refuses("box", [&] { tangencies(system, 1, 0, flat, p); });
    judge.refuses("side = 0", [&] { tangencies(system, 0, 0, box, p); });
    judge.refuses("t = nan", [&] { tangencies(system, 1, nan, box, p); });
    judge.refuses("p.size() = 0", [&] { tangencies(system, 1, 0, box, {}); });
    judge.refuses("near[0] = nan", [&] { sliding_boundary(system, 1, bad, p); });
    judge.refuses("seeds = 0", [&] { equilibria(system, box, p, 0); });
}

inline void judge_cells(Judge& judge) {
    const CellAxis good{0, 0, 1, 10}, other{1, 0, 1, 10};
    const auto grid = [&](auto change) {
        CellAxis axis = good;
        change(axis);
        return CellGrid(axis, other);
    };
    for (const double bad : {nan, inf}) {
        judge.refuses("first.low = ", [&] { grid([&](auto& a) { a.low = bad; }); });
        judge.refuses("first.high = ", [&] { grid([&](auto& a) { a.high = bad; }); });
    }
    judge.refuses("first.high = 0", [&] { grid([](auto& a) { a.high = 0; }); });
    for (const int bad : {0, -1, 100'001})
        judge.refuses("first.n = ", [&] { grid([&](auto& a) { a.n = bad; }); });
    judge.refuses("first.coordinate = -1", [&] { grid([](auto& a) { a.coordinate = -1; }); });
    judge.refuses("second.coordinate = 0", [&] { CellGrid(good, good); });
    const CellGrid cells(good, other);
    std::vector<std::int32_t> image(99, 0);
    judge.refuses("image.size() = 99", [&] { cell_map(cells, image); });
    image.resize(100, 0);
    for (const int bad : {-3, 100}) {
        image[7] = bad;
        judge.refuses("image[7] = ", [&] { cell_map(cells, image); });
    }
    using Points = std::span<const std::array<double, 2>>;
    const std::function<void(Points, std::span<std::array<double, 2>>)> empty;
    judge.refuses("map: expected a function", [&] { cell_images(cells, empty); });
}

/// Functions that exist only as code.
inline void judge_external(Judge& judge) {
    const auto with = [](auto change) {
        auto f = std::make_shared<External>();
        f->dim = 1;
        f->outputs = 1;
        f->scale = {1, 1};
        f->value = [](double, const double* x, const double*, double* out) { out[0] = x[0]; };
        change(*f);
        return Graph().add_function(f);
    };
    judge.holds("an external function", with([](External&) {}) == 0);
    judge.refuses("not null", [] { Graph().add_function(nullptr); });
    judge.refuses("not an empty one", [&] { with([](External& f) { f.value = nullptr; }); });
    judge.refuses("outputs > 0", [&] { with([](External& f) { f.outputs = 0; }); });
    judge.refuses("params >= 0", [&] { with([](External& f) { f.params = -1; }); });
    judge.refuses("scale with one entry", [&] { with([](External& f) { f.scale = {1}; }); });
    for (const double bad : {nan, inf, 0.0, -1.0})
        judge.refuses("finite numbers > 0", [&] { with([&](External& f) { f.scale[1] = bad; }); });
    judge.refuses("outputs * dim", [&] {
        with([](External& f) {
            auto jacobian = std::make_shared<External>(f);
            jacobian->outputs = 2;
            f.jacobian = jacobian;
        });
    });
}

/// Everything.
inline Judge judged() {
    Judge judge;
    judge_runs(judge);
    judge_parts_of_runs(judge);
    judge_output_times(judge);
    judge_defaults(judge);
#ifndef FILIPPOV_MEMORY_SANITIZER // a Graph has maps, whose trees the standard library makes
    judge_tape_defaults(judge);
    judge_external(judge);
#endif
    judge_many(judge);
    judge_other_methods(judge);
    const auto system = any_system(Oscillator{});
    const Vector x = Vector::Zero(2), p = system->defaults();
    judge_sizes(judge, *system, x, p);
    judge_maps(judge, *system, x, p);
    judge_orbits(judge, *system, x, p);
    judge_analysis(judge, *system, x, p);
    judge_cells(judge);
    return judge;
}

} // namespace arguments
