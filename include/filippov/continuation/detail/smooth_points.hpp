// SPDX-License-Identifier: BSD-3-Clause
// Folds, flips and Neimark-Sacker bifurcations within a step of a branch.
#pragma once

#include <filippov/continuation/detail/branch_place.hpp>
#include <filippov/continuation/detail/multiplier_tests.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

namespace detail {

/// A smooth bifurcation within a step, and how far along.
struct Passed {
    double along;
    SpecialPoint special;
};

/// All that belongs to a smooth bifurcation but its kind and its cycle.
inline void name_smooth(const AnySystem& system, SpecialPoint& special) {
    special.multipliers = floquet(system, special.cycle);
    normalize(system, special.cycle);
    special.conditions.clear();
    const bool forced = system.forced();
    if (special.kind == Kind::fold)
        special.conditions = {{"mu - 1", distance_to_one(special.multipliers, forced)}};
    else if (special.kind == Kind::flip)
        special.conditions = {{"det(M + 1)", flip_test(special.multipliers, forced)}};
    else if (special.kind == Kind::neimark_sacker)
        special.conditions = {{"|mu|^2 - 1", torus_test(special.multipliers)}};
    special.word_before = special.word_after = special.cycle.word.string();
}
/// @param t, after  tangent and multipliers at the end of the step
inline Passed locate(const AnySystem& system, const BranchPlace& here, const Vector& t, double ds,
                     Kind kind, Branch& branch, const Multipliers& after) {
    const auto test = [kind, forced = system.forced()](const Multipliers& m) {
        return kind == Kind::flip ? flip_test(m, forced) : torus_test(m);
    };
    const bool fold = kind == Kind::fold;
    const auto value = [&](const Vector& z, const Matrix& J) {
        if (fold) {
            const Vector tangent = here.curve.tangent(J, here.t);
            return tangent[tangent.size() - 1];
        }
        return test(floquet(system, here.shooting->unpack(z)));
    };
    const auto& before = multipliers_at(here, branch);
    const Located at =
        zero_along(here.curve, here.z, here.t, ds, value, fold ? here.slope() : test(before),
                   fold ? t[t.size() - 1] : test(after));
    branch.corrections += at.convergence.iterations;
    // where the search came if it did not come to rest, as it does beside a flip of an orbit of
    // half the period: the curve's equations are singular there
    const Vector& z = at.z.size() > 0 ? at.z : here.z;
    Passed passed{here.along(z), {}};
    SpecialPoint& special = passed.special;
    special.kind = kind;
    special.convergence = at.convergence;
    special.cycle = here.shooting->unpack(z);
    name_smooth(system, special);
    return passed;
}
/// A turn of the parameter that is the flip of an orbit of half the period: the branch comes
/// back on itself, half a period later. Then the flip of that orbit takes its place. (A turn that
/// could not be located may have been looked for far from there: both halves still differ.)
/// @param reach  of the step in the parameter
inline bool halve(const BranchLine& line, SpecialPoint& special, double reach) {
    const bool located = special.convergence.ok();
    const double away = located ? 1e-6 * line.width() : reach;
    Cycle one = shortest(line.system, special.cycle, located ? 1e-3 : 0.5);
    if (!(std::abs(one.period - special.cycle.period / 2) < 0.01 * one.period))
        return false;
    const bool forced = line.system.forced();
    // secant on the flip's test function, along the orbits of half the period
    const double from = line.value(special.cycle);
    const auto at = [&](double value) {
        one.p[line.parameter] = value;
        const Convergence c = shoot(line.system, one);
        return c.ok() ? flip_test(floquet(line.system, one), forced)
                      : std::numeric_limits<double>::quiet_NaN();
    };
    double a = from, b = from + 1e-6 * line.width(), fa = at(a), fb = at(b);
    for (int k = 0; k < 20 && std::abs(b - a) > 1e-15 * std::abs(b) && fa != fb; ++k) {
        const double next = b - fb * (b - a) / (fb - fa);
        a = b;
        fa = fb;
        b = next;
        fb = at(b);
    }
    if (!(std::abs(fb) < 1e-9 && std::abs(b - from) < away))
        return false;
    const std::string before = special.word_before;
    special.kind = Kind::flip;
    special.cycle = one;
    special.convergence.status = Status::ok;
    name_smooth(line.system, special);
    special.word_before = before;
    return true;
}
/// What the smooth bifurcations within a step mean for the branch.
enum class SmoothEnd {
    goes_on,
    merges,   ///< it ends at the last, on an orbit of half its period
    unlocated ///< one is there and was not located: nothing was added to the branch
};
/// Those within the step from `here`, in their order.
/// @param last_try  what is not located is added none the less, as it is
inline SmoothEnd smooth_points(const BranchLine& line, const BranchPlace& here, const Vector& t,
                               double ds, Branch& branch, const BranchPoint& next, bool last_try) {
    std::vector<Passed> passed;
    const bool forced = line.system.forced();
    const auto& before = multipliers_at(here, branch);
    // Where a segment is born the parameter may begin like the square of its length: a slope of
    // nothing but rounding, and no fold.
    if (std::abs(here.slope()) > 1e-9 && here.slope() * t[t.size() - 1] < 0)
        passed.push_back(locate(line.system, here, t, ds, Kind::fold, branch, next.multipliers));
    if (!before.empty()) {
        if (flip_test(before, forced) * flip_test(next.multipliers, forced) < 0)
            passed.push_back(
                locate(line.system, here, t, ds, Kind::flip, branch, next.multipliers));
        const double from = torus_test(before), to = torus_test(next.multipliers);
        if (from < 1 && to < 1 && from * to < 0) // a pair before and after
            passed.push_back(
                locate(line.system, here, t, ds, Kind::neimark_sacker, branch, next.multipliers));
    }
    if (line.system.interrupted()) // what was located is not what it seems
        return SmoothEnd::goes_on;
    std::stable_sort(passed.begin(), passed.end(),
                     [](const Passed& a, const Passed& b) { return a.along < b.along; });
    std::vector<SpecialPoint> found;
    SmoothEnd end = SmoothEnd::goes_on;
    for (Passed& p : passed) {
        if (p.special.kind == Kind::fold && halve(line, p.special, ds * line.width()))
            end = SmoothEnd::merges;
        if (!p.special.convergence.ok() && !last_try)
            return SmoothEnd::unlocated;
        found.push_back(std::move(p.special));
        if (end == SmoothEnd::merges)
            break;
    }
    branch.special.insert(branch.special.end(), std::make_move_iterator(found.begin()),
                          std::make_move_iterator(found.end()));
    return end;
}

/// A flip between `here` and the sliding bifurcation that ends its word.
inline void flip_before(const BranchLine& line, const BranchPlace& here, const SlidingCondition& s,
                        const SpecialPoint& end, bool born, Branch& branch) {
    const auto& before = multipliers_at(here, branch);
    const bool forced = line.system.forced();
    const auto& after = born ? end.multipliers : end.multipliers_child;
    if (before.empty() || after.empty() ||
        !(flip_test(before, forced) * flip_test(after, forced) < 0))
        return;
    const double length = along_to(line, here, born ? parent_of(s) : child_of(s));
    if (!(length > 0))
        return;
    Passed flip = locate(line.system, here, here.t, length, Kind::flip, branch, after);
    if (!line.system.interrupted())
        branch.special.push_back(std::move(flip.special));
}

} // namespace detail

} // namespace filippov
