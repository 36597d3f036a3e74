// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits where no word is known: from runs that settle, and near a state.
#pragma once

#include <filippov/orbits/floquet.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace filippov {

namespace detail {

/// True if one condition ends the mode: not where two surfaces are reached at once.
inline bool one_condition(const Happening& e, int surfaces) {
    if (surfaces == 1)
        return true;
    if (e.surface < 0 || mode_entry(e.before, e.surface) == mode_entry(e.after, e.surface))
        return false;
    for (int j = 0; j < surfaces; ++j)
        if (const int before = mode_entry(e.before, j);
            j != e.surface && before != 0 && before != mode_entry(e.after, j))
            return false;
    return true;
}

/// Changes of mode one after the other, as they are collected.
struct Changes {
    std::vector<int> modes, at;
    void add(const Happening& e) {
        modes.push_back(e.after);
        at.push_back(std::max(e.surface, 0));
    }
    Word word(int surfaces) const { return Word::of(modes, at, surfaces); }
};

} // namespace detail

/// The cycle that a run of `turns` forcing periods describes, closed or not; none if the modes at
/// its ends differ, it has events and no change of mode fits, or several surfaces are reached at
/// once.
inline std::optional<Cycle> cycle_of(const History& run, double t0, const Vector& x0, int turns,
                                     const Vector& p) {
    Cycle c;
    c.turns = turns;
    c.p = p;
    c.period = run.t - t0;
    detail::Changes changes;
    for (const Happening& e : run.events)
        if (e.before != e.after) {
            if (!changes.modes.empty() && changes.modes.back() != e.before)
                return std::nullopt;
            if (!detail::one_condition(e, run.surfaces))
                return std::nullopt;
            c.t.push_back(e.t);
            c.x.push_back(e.x);
            changes.add(e);
        }
    if (changes.modes.empty()) {
        c.word.letters = {{run.mode, Until::phase}};
        c.word.surfaces = run.surfaces;
        c.t = {t0};
        c.x = {x0};
        return c;
    }
    if (changes.modes.back() != run.mode || run.events.front().before != run.mode)
        return std::nullopt;
    c.word = changes.word(run.surfaces);
    return c;
}

/// The first events of an autonomous run that return: from an event to the first later one with the
/// same change of mode and each component within `closeness` of it, in units of its spread over the
/// events, or but for rounding.
inline std::optional<Cycle> recurrence_of(const History& run, double closeness, const Vector& p) {
    std::vector<const Happening*> changes;
    for (const Happening& e : run.events)
        if (e.before != e.after)
            changes.push_back(&e);
    Vector low = run.x, high = run.x;
    for (const Happening* e : changes) {
        low = low.cwiseMin(e->x);
        high = high.cwiseMax(e->x);
    }
    const Vector allowed =
        closeness * (high - low) + 1e-9 * low.cwiseAbs().cwiseMax(high.cwiseAbs());
    for (std::size_t i = 0; i < changes.size(); ++i)
        for (std::size_t j = i + 1; j < changes.size(); ++j) {
            const Happening &a = *changes[i], &b = *changes[j];
            if (a.before != b.before || a.after != b.after || a.surface != b.surface ||
                !((a.x - b.x).cwiseAbs().array() <= allowed.array()).all())
                continue;
            Cycle c;
            c.p = p;
            c.period = b.t - a.t;
            detail::Changes turn;
            bool known = true;
            for (std::size_t k = i; k < j; ++k) {
                c.t.push_back(changes[k]->t - a.t);
                c.x.push_back(changes[k]->x);
                turn.add(*changes[k]);
                known = known && detail::one_condition(*changes[k], run.surfaces);
            }
            if (!known)
                continue;
            c.word = turn.word(run.surfaces);
            return c;
        }
    return std::nullopt;
}

namespace detail {

/// When a run from t0 passes a surface that jumps over it: at a change of mode that is not on its
/// surface; or at the end, which t0 is one turn later. NaN: nowhere.
inline double surface_jumps(const AnySystem& system, const History& run, double t0,
                            const Vector& p) {
    const auto at = [&](int j, int mode, double t, const Vector& x) {
        return system.quantity({Quantity::Kind::h, mode, 0, j, mode}, t, x, p, {});
    };
    const auto h = [&](int j, int mode, double t, const Vector& x) {
        return mode_entry(mode, j) * at(j, mode, t, x).value[0];
    };
    // h changes by so much in the run: a millionth of it is no error of a location
    double size = 0;
    const auto leaves_a_side = [](const Happening& e) {
        return e.before != e.after && e.surface >= 0 && mode_entry(e.before, e.surface) != 0;
    };
    for (const Happening& e : run.events)
        if (leaves_a_side(e)) {
            const Eigen::RowVectorXd slope = at(e.surface, e.before, e.t, e.x).slope.row(0);
            const Vector flow = system.field(e.before, e.t, e.x, p);
            const double rate = slope.head(flow.size()).dot(flow) + slope[flow.size()];
            size = std::max(size, std::abs(rate) * (run.t - t0));
        }
    for (const Happening& e : run.events)
        if (leaves_a_side(e) && std::abs(h(e.surface, e.before, e.t, e.x)) > 1e-6 * size)
            return e.t;
    for (int j = 0; system.forced() && j < run.surfaces; ++j)
        if (mode_entry(run.mode, j) != 0 && h(j, run.mode, t0, run.x) < -1e-6 * size)
            return t0;
    return std::numeric_limits<double>::quiet_NaN();
}
inline std::string surface_jumps_at(double t) {
    return "the surface jumps in time, and the solution changes sides by it at t = " +
           std::to_string(t) + ": periodic orbits of such systems are not supported";
}

} // namespace detail

/// How an orbit is looked for.
struct OrbitSearch {
    double transient = 200;  ///< before it: forcing periods, or time for an autonomous system; >= 0
    int max_turns = 32;      ///< longest orbit, forcing periods, > 0
    double window = 200;     ///< time in which an autonomous orbit has to return, > 0
    double closeness = 1e-3; ///< of a return, relative to the orbit's size, > 0
};

namespace detail {

inline void validate(const OrbitSearch& s) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    if (!(s.transient >= 0 && s.transient < inf))
        refuse("transient", s.transient, "expected a finite number >= 0");
    require_positive("max_turns", s.max_turns);
    if (!(s.window > 0 && s.window < inf))
        refuse("window", s.window, "expected a finite number > 0");
    if (!(s.closeness > 0 && s.closeness < inf))
        refuse("closeness", s.closeness, "expected a finite number > 0");
}

/// The orbit that a solution comes back to from x at phase zero: the first stable one, else the
/// first.
inline Orbit orbit_from(const AnySystem& system, const Vector& p, Vector x,
                        const OrbitSearch& search) {
    Orbit found;
    found.status = Status::not_converged;
    if (!system.forced()) {
        const History window = system.run(0, x, search.window, p);
        found.status = window.status;
        found.message = window.message;
        if (window.status != Status::ok)
            return found;
        if (const auto cycle = recurrence_of(window, search.closeness, p))
            return solve_shortest(system, *cycle);
        found.status = Status::not_converged;
        found.message = "no event returns in the window";
        return found;
    }
    found.message = "no periodic orbit within max_turns forcing periods";
    const double T = system.period(p, {}).value;
    const Vector start = x;
    Vector size = x.cwiseAbs();
    for (int turns = 1; turns <= search.max_turns; ++turns) {
        const History turn = system.run(0, x, T, p);
        if (turn.status != Status::ok) {
            found.status = turn.status;
            found.message = turn.message;
            return found;
        }
        x = turn.x;
        size = size.cwiseMax(x.cwiseAbs());
        for (const Happening& e : turn.events)
            size = size.cwiseMax(e.x.cwiseAbs());
        if (!((x - start).norm() <= search.closeness * size.norm()))
            continue;
        const History whole = system.run(0, x, turns * T, p);
        const auto cycle = cycle_of(whole, 0, x, turns, p);
        Orbit orbit;
        orbit.status = Status::not_converged;
        if (cycle)
            orbit = solve_shortest(system, *cycle);
        if (orbit.status != Status::ok) {
            const double jump = surface_jumps(system, whole, 0, p);
            if (found.status != Status::ok && std::isfinite(jump)) {
                found.message = surface_jumps_at(jump);
                return found;
            }
            continue;
        }
        if (orbit.stable(true))
            return orbit;
        if (found.status != Status::ok)
            found = std::move(orbit);
    }
    return found;
}

} // namespace detail

namespace detail {

/// The rotations of a cycle that have the word of another, at the times nearest to its.
inline std::vector<Cycle> aligned(const AnySystem& system, const Cycle& c, const Cycle& like) {
    std::vector<Cycle> all;
    for (std::size_t k = 0; c.turns == like.turns && k < c.size(); ++k) {
        Cycle r = rotated(c, k);
        if (!(r.word == like.word))
            continue;
        const double T = like.period / like.turns, apart = like.t[0] - r.t[0];
        for (double& t : r.t)
            t += system.forced() ? T * std::round(apart / T) : apart;
        all.push_back(std::move(r));
    }
    return all;
}
/// True if two cycles are one orbit, wherever they are cut.
inline bool same_orbit(const AnySystem& system, const Cycle& a, const Cycle& b) {
    const Vector scale = Shooting(system, b).scales(b).head(system.dim());
    for (const Cycle& r : aligned(system, a, b)) {
        bool same = true;
        for (std::size_t i = 0; same && i < b.size(); ++i)
            same = std::abs(r.t[i] - b.t[i]) < 1e-7 * b.period &&
                   (r.x[i] - b.x[i]).cwiseQuotient(scale).norm() < 1e-7;
        if (same)
            return true;
    }
    return false;
}

} // namespace detail

/// The orbit that the solution from x0 at t0 = 0 settles on.
///
/// Beside an unstable orbit a solution may linger: it is followed longer then, up to sixteen times
/// as long, and the unstable one is the answer if it is still there.
inline Orbit settle(const AnySystem& system, const Vector& p, const Vector& x0,
                    const OrbitSearch& search = {}) {
    detail::refuse_jumps(system);
    detail::require_point(system, 0, x0, p, "x0");
    detail::validate(search);
    Orbit found;
    if (!system.forced() && depends_on_time(system, 0.1, x0, p)) {
        found.status = Status::not_converged;
        found.message = "the system depends on time and gives no period";
        return found;
    }
    const double unit = system.forced() ? system.period(p, {}).value : 1.0;
    Vector x = x0;
    double transient = search.transient;
    for (int attempt = 0; attempt < 3; ++attempt) {
        const History first = system.run(0, x, transient * unit, p);
        x = first.x;
        Orbit orbit;
        orbit.status = first.status;
        orbit.message = first.message;
        if (first.status == Status::ok)
            orbit = detail::orbit_from(system, p, x, search);
        const bool ok = orbit.status == Status::ok, stable = ok && orbit.stable(system.forced());
        if (attempt > 0 && ok && !stable && !detail::same_orbit(system, orbit.cycle, found.cycle)) {
            found = {};
            found.message = "the solution lingers beside several unstable orbits";
            break;
        }
        found = std::move(orbit);
        if (!ok || stable)
            break;
        transient = 4 * std::max(transient, 1.0);
    }
    return found;
}

/// The orbit near the solution from x0 at t0 (phase zero if 0), stable or not: `turns` forcing
/// periods long, or the first return of an event of an autonomous system.
inline Orbit orbit_near(const AnySystem& system, const Vector& p, double t0, const Vector& x0,
                        int turns, const OrbitSearch& search = {}) {
    detail::refuse_jumps(system);
    detail::require_point(system, t0, x0, p, "x0");
    detail::require_positive("turns", turns);
    detail::validate(search);
    Orbit none;
    const double T = system.period(p, {}).value;
    const double span = system.forced() ? turns * T : search.window;
    std::optional<Cycle> cycle;
    double jump = std::numeric_limits<double>::quiet_NaN();
    Vector x = x0;
    // A guess beside the surface may come round in another mode, and its image in the right one.
    for (int k = 0; k < 3 && !cycle; ++k) {
        const History run = system.run(t0, x, t0 + span, p);
        none.status = run.status;
        none.message = run.message;
        if (run.status != Status::ok)
            return none;
        cycle = system.forced() ? cycle_of(run, t0, x, turns, p) : recurrence_of(run, 0.1, p);
        if (!std::isfinite(jump))
            jump = detail::surface_jumps(system, run, t0, p);
        x = run.x;
    }
    if (!cycle)
        none.message = "the run from the guess does not come round to the mode it starts in";
    else if (Orbit orbit = solve_orbit(system, *cycle);
             orbit.status == Status::ok || !std::isfinite(jump))
        return orbit;
    none.status = Status::not_converged;
    if (std::isfinite(jump))
        none.message = detail::surface_jumps_at(jump);
    return none;
}

} // namespace filippov
