// SPDX-License-Identifier: BSD-3-Clause
// Points of codimension two where the orbit of a curve has a second bifurcation, at which its word
// changes: the curve goes on with the next word, or ends.
#pragma once

#include <filippov/continuation/detail/degenerate_points.hpp>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

namespace detail {

/// The sliding bifurcation of an orbit that bifurcates otherwise, too.
inline SpecialPoint second_bifurcation(const AnySystem& system, const CurvePlace& here,
                                       const SlidingCondition& s, const Convergence& convergence) {
    SpecialPoint special = special_point(system, s, convergence);
    special.word_before = special.word_after = here.shooting->word().string();
    return special;
}

// --- where it is -------------------------------------------------------------------------------

/// The same test of a neighbouring cycle; NaN if it has none.
inline double test_value(const AnySystem& system, const Cycle& c, const Test& like) {
    if (like.what == Test::What::nearest)
        return polished(system, c, like.i, like.least).value;
    for (const Test& test : tests_of(system, c))
        if (test.what == like.what && test.i == like.i)
            return test.value;
    return std::numeric_limits<double>::quiet_NaN();
}
/// Where a test vanishes on the step from `here` to `beyond`.
inline Located locate(const AnySystem& system, const CurvePlace& here, const Vector& beyond,
                      double ds, const Test& test) {
    const auto value = [&](const Vector& z, const Matrix&) {
        return test_value(system, here.cycle(z), test);
    };
    const Matrix none;
    const double f0 = value(here.z, none), f1 = value(beyond, none);
    if (!(f0 * f1 < 0))
        return {};
    return zero_along(*here.curve, here.z, here.t, ds, value, f0, f1);
}
/// Where a function vanishes near a point of a curve, on either side of it.
inline Located zero_near(const Arclength& along, const Vector& z, const Vector& t,
                         const std::function<double(const Vector&, const Matrix&)>& test, double f0,
                         Branch& curve) {
    for (double reach = 1e-6; reach < 0.1; reach *= 4)
        for (const double ds : {reach, -reach}) {
            Vector u = z;
            Matrix J;
            const Convergence c = along.step(u, J, t, ds);
            curve.corrections += c.iterations;
            const double f1 = c.ok() ? test(u, J) : f0;
            if (f0 * f1 <= 0)
                return zero_along(along, z, t, ds, test, f0, f1);
        }
    return {};
}
/// Moves a sliding bifurcation along its curve to where the orbit with more segments has the fold
/// or flip, too: where a segment has no length the equations of those are singular.
/// @param last  becomes the end of their curve
inline bool meet(const CurvePlane& plane, Kind kind, SlidingCondition& s, BranchPoint& last,
                 Branch& curve) {
    const auto shooting = plane.shooting_of(s);
    const Arclength along(equations_with(*shooting, s), plane.scales(*shooting, s.cycle));
    Vector z = shooting->pack(s.cycle), t;
    Matrix J;
    if (!along.tangent_at(z, Vector::Unit(z.size(), shooting->rows()), t) ||
        !along.step(z, J, t, 0).ok())
        return false;
    t = along.tangent(J, t);
    SlidingCondition moved = s;
    const auto test = [&](const Vector& u, const Matrix&) {
        moved.cycle = shooting->unpack(u);
        return border_test(floquet_of_child(plane.system, moved), kind == Kind::fold ? 1 : -1,
                           plane.system.forced());
    };
    const Located at = zero_near(along, z, t, test, test(z, J), curve);
    if (!at.ok())
        return false;
    s.cycle = shooting->unpack(at.z);
    last = {child_of(s), floquet_of_child(plane.system, s)};
    normalize(plane.system, last.cycle);
    return true;
}
/// The slide's touch runs into its entry: the degenerate switching-sliding point.
inline bool touch_meets_entry(const CurvePlace& here, const Test& test) {
    const Word& word = here.shooting->word();
    const std::size_t n = word.size(), before = (here.condition.node + n - 1) % n;
    return here.kind == Kind::adding_sliding && test.what == Test::What::duration &&
           test.i == before && word[before + n - 1].mode == -here.condition.side;
}

/// The slide that begins on its boundary leaves it there again.
inline bool returns_at_once(const CurvePlace& here) {
    const Letter& slide = here.shooting->word()[here.condition.node];
    return here.kind == Kind::switching_sliding && slide.mode == 0 &&
           slide.until == (here.condition.side < 0 ? Until::exit_below : Until::exit_above);
}
/// True if that slide is about to vanish: the orbit crosses instead, tangent to second order, and
/// the curve ends. Its equations are singular there; those of the crossing are not.
inline bool ends_at_crossing(const CurvePlane& plane, const CurvePlace& here, HalfCurve& curve) {
    const Cycle c = here.cycle();
    if (!returns_at_once(here) || !(c.duration(here.condition.node) < 1e-2 * c.period))
        return false;
    CurveStart crossing;
    crossing.condition = *condition_of(c, {Test::What::duration, here.condition.node, 0, {}});
    crossing.kind = crossing.condition.kind;
    auto there = place_of(plane, crossing, +1);
    Matrix J;
    if (!there || !there->curve->step(there->z, J, there->t, 0).ok())
        return false;
    there->t = there->curve->tangent(J, there->t);
    const auto test = [&](const Vector& z, const Matrix&) { return second_order_test(*there, z); };
    const Located at = zero_near(*there->curve, there->z, there->t, test, test(there->z, J), curve);
    if (!at.ok() || !leads_on(*there, at.z))
        return false;
    for (std::size_t k = 0; k < 2; ++k)
        if (!(std::abs(there->parameter(at.z, k) - here.parameter(k)) < 1e-2 * plane.box.width(k)))
            return false;
    end_at_degenerate_crossing(plane.system, *there, at, curve);
    curve.special.back().word_before = here.shooting->word().string();
    return true;
}
/// The slide's touch runs into one of the slide's own ends, where it is no touch any more.
inline bool touch_meets_end(const CurvePlace& here, const Test& test) {
    const std::size_t n = here.shooting->word().size(), node = here.condition.node;
    return here.kind == Kind::adding_sliding && test.what == Test::What::duration &&
           (test.i == node || test.i == (node + n - 1) % n);
}

// --- what goes on ------------------------------------------------------------------------------

/// The node at a time, up to whole periods.
inline std::size_t node_at(const Cycle& c, double t) {
    const auto apart = [&](std::size_t i) {
        return std::abs(std::remainder(c.t[i] - t, c.period));
    };
    std::size_t best = 0;
    for (std::size_t i = 1; i < c.size(); ++i)
        if (apart(i) < apart(best))
            best = i;
    return best;
}
/// The curve with the next word, in the direction in which the parameters went.
inline std::optional<CurvePlace> continued(const CurvePlane& plane, const CurvePlace& here,
                                           const Located& at, const SlidingCondition& second,
                                           bool born) {
    if (grazes(second.kind) || grazes(here.kind))
        return std::nullopt; // multipliers jump, and with them the curve
    if (!changes_word(here.kind) && born)
        return std::nullopt; // a segment without length: the equations are singular
    const Cycle next = born ? child_of(second) : parent_of(second);
    CurveStart start;
    start.kind = here.kind;
    if (changes_word(here.kind)) {
        start.condition = here.condition;
        start.condition.cycle = next;
        start.condition.node = node_at(next, here.cycle(at.z).t[here.condition.node]);
    } else {
        start.cycle = next;
    }
    auto place = place_of(plane, start, +1);
    if (place && here.direction().dot(place->direction()) < 0)
        place->t = -place->t;
    return place;
}

/// Another bifurcation happens to the same orbit: a point of codimension two. Where the orbit and
/// its derivative go on through it, so does the curve, with the next word.
inline StepEnd change_word(const CurvePlane& plane, CurvePlace& here, const Vector& beyond,
                           double ds, const std::vector<Test>& failed, HalfCurve& curve,
                           BranchEnd& trouble) {
    const AnySystem& system = plane.system;
    trouble = BranchEnd::several_of_orbit;
    const std::vector<Test> causes = causes_of(failed, here.cycle(beyond));
    if (causes.size() > 1)
        return StepEnd::retry;
    const Test& cause = causes[0];
    if (cause.what == Test::What::duration && cause.i == here.condition.node &&
        returns_at_once(here))
        return ends_at_crossing(plane, here, curve) ? StepEnd::ended : StepEnd::retry;
    const Located at = locate(system, here, beyond, ds, cause);
    curve.corrections += at.convergence.iterations;
    if (!at.ok())
        return StepEnd::retry;
    for (const Test& test : failures(system, here, at.z, 1e-8))
        if (test.what != cause.what || test.i != cause.i)
            return StepEnd::retry; // something else has happened before
    if (touch_meets_entry(here, cause)) {
        end_at_degenerate(system, here, at, cause.i, true, curve);
        return StepEnd::ended;
    }
    if (touch_meets_end(here, cause)) {
        curve.points.push_back(point_of(system, here, at.z));
        for (auto& multiplier : curve.points.back().multipliers) // 0/0 where the end is tangent
            multiplier = std::numeric_limits<double>::quiet_NaN();
        curve.end = BranchEnd::end_of_slide;
        return StepEnd::ended;
    }
    const Cycle there = here.cycle(at.z);
    Test exact = cause;
    if (cause.what == Test::What::nearest)
        exact.least = polished(system, there, cause.i, cause.least);
    auto second = condition_of(there, exact);
    const bool dies = cause.what == Test::What::duration;
    if (!second || (dies && second->kind == Kind::grazing)) {
        trouble = BranchEnd::touches_crossed;
        return StepEnd::retry;
    }
    second->kind = named(system, *second);
    BranchPoint last = point_of(system, here, at.z);
    if (!changes_word(here.kind) && dies && !meet(plane, here.kind, *second, last, curve)) {
        trouble = BranchEnd::meeting_not_located;
        return StepEnd::retry;
    }
    curve.points.push_back(std::move(last));
    SpecialPoint special = second_bifurcation(system, here, *second, at.convergence);
    auto next = continued(plane, here, at, *second, !dies);
    if (next)
        special.word_after = next->shooting->word().string();
    curve.special.push_back(special);
    if (!next) {
        curve.end = BranchEnd::second_bifurcation;
        return StepEnd::ended;
    }
    here = std::move(*next);
    return StepEnd::goes_on;
}
/// True if a fold or flip that cannot be followed further is about to lose a segment: then its
/// curve ends there.
inline bool ends_at_short_segment(const CurvePlane& plane, const CurvePlace& here, Branch& curve) {
    const Cycle c = here.cycle();
    Test test;
    for (std::size_t i = 1; i < c.size(); ++i)
        if (c.duration(i) < c.duration(test.i))
            test.i = i;
    if (changes_word(here.kind) || !(c.duration(test.i) < 1e-2 * c.period))
        return false;
    auto s = condition_of(c, test);
    if (!s || s->kind == Kind::grazing)
        return false;
    s->kind = named(plane.system, *s);
    BranchPoint last;
    if (!meet(plane, here.kind, *s, last, curve))
        return false;
    for (std::size_t k = 0; k < 2; ++k)
        if (!(std::abs(plane.value(last.cycle, k) - here.parameter(k)) < 1e-3 * plane.box.width(k)))
            return false;
    Convergence located; // by meet
    located.status = Status::ok;
    curve.special.push_back(second_bifurcation(plane.system, here, *s, located));
    curve.special.back().word_after = parent_of(*s).word.string();
    curve.points.push_back(std::move(last));
    curve.end = BranchEnd::second_bifurcation;
    return true;
}

} // namespace detail

} // namespace filippov
