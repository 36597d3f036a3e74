// SPDX-License-Identifier: BSD-3-Clause
// Where a branch changes its word: the sliding bifurcations behind it, and the curves of the words
// that follow.
#pragma once

#include <filippov/continuation/detail/branch_place.hpp>
#include <filippov/continuation/detail/sliding_point.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace filippov {

namespace detail {

// --- what happened -----------------------------------------------------------------------------

/// The duration of the segment that starts and ends near a time, up to whole cycles.
inline Test vanishing(const Cycle& c, double t) {
    Test test;
    const auto apart = [&](std::size_t i) {
        return std::abs(std::remainder(c.t[i] - t, c.period)) + std::abs(c.duration(i));
    };
    for (std::size_t i = 1; i < c.size(); ++i)
        if (apart(i) < apart(test.i))
            test.i = i;
    return test;
}
/// The cycle between the last good and the first bad one where a test vanishes, to first order.
inline Cycle nearer(const AnySystem& system, const Cycle& before, const Cycle& beyond,
                    const Test& test) {
    double good = 0;
    for (const Test& other : tests_of(system, before))
        if (other.what == test.what && other.i == test.i && other.least.side == test.least.side &&
            (good == 0 || other.value < good))
            good = other.value;
    const double fraction = good > 0 ? good / (good - test.value) : 1.0;
    Cycle c = before;
    for (std::size_t i = 0; i < c.size(); ++i) {
        c.t[i] += fraction * (beyond.t[i] - before.t[i]);
        c.x[i] += fraction * (beyond.x[i] - before.x[i]);
    }
    c.period += fraction * (beyond.period - before.period);
    c.p += fraction * (beyond.p - before.p);
    return c;
}

/// The conditions behind failed tests, each for the word without any of the segments that
/// vanish; none if a word cannot change into another there.
inline std::vector<SlidingCondition> conditions_behind(const AnySystem& system, const Cycle& before,
                                                       const Cycle& beyond,
                                                       const std::vector<Test>& causes) {
    std::vector<SlidingCondition> all;
    const Cycle at = nearer(system, before, beyond, causes[0]);
    for (const Test& own : causes) {
        Cycle c = at;
        for (const Test& other : causes)
            if (&other != &own && other.what == Test::What::duration) {
                const auto gone = condition_of(c, vanishing(c, at.t[other.i]));
                if (!gone)
                    return {};
                c = parent_of(*gone);
            }
        const bool dies = own.what == Test::What::duration;
        const auto condition = condition_of(c, dies ? vanishing(c, at.t[own.i]) : own);
        if (!condition)
            return {};
        all.push_back(*condition);
    }
    return all;
}
/// Newton on the shooting equations and the condition, the parameter free.
inline Convergence solve(const BranchLine& line, SlidingCondition& s) {
    const Shooting shooting(line.system, s.cycle, {line.parameter, -1});
    Vector z = shooting.pack(s.cycle);
    Matrix J;
    const Convergence c =
        newton(equations_with(shooting, s), line.scales(shooting, s.cycle), z, J, 1e-13);
    if (c.ok())
        s.cycle = shooting.unpack(z);
    return c;
}

/// Names the bifurcation by its conditions (model of the chapter, (4.24)-(4.29), in our signs).
inline SpecialPoint describe(const AnySystem& system, SlidingCondition& s, const Convergence& c) {
    s.kind = named(system, s);
    SpecialPoint special = special_point(system, s, c);
    if (s.kind == Kind::grazing_sliding)
        special.border_class = border_collision(special.multipliers, special.multipliers_child);
    return special;
}

/// True if nothing else has happened before a bifurcation: the orbit there is one of its word,
/// what is born where a slide begins is no second slide, and nothing pushes back what crosses.
inline bool alone(const AnySystem& system, const SlidingCondition& s) {
    const Cycle c = parent_of(s);
    for (const Test& test : tests_of(system, c))
        if (!(test.value > -1e-8))
            return false;
    const bool slides = s.cycle.word[s.node].mode == 0;
    return s.kind == Kind::crossing_sliding ? !slides : s.kind != Kind::switching_sliding || slides;
}

/// Adds to contacts whose far side turns round those that do so at the same parameter, as in the
/// other half of a symmetric orbit: in a short step rounding decides which have been seen.
inline void add_twins(const BranchLine& line, SlidingCondition s, std::vector<Test>& causes) {
    if (causes[0].what != Test::What::far_side || !solve(line, s).ok())
        return;
    for (const Test& test : tests_of(line.system, s.cycle)) {
        const auto is_it = [&](const Test& cause) { return cause.i == test.i; };
        if (test.what == Test::What::far_side && std::abs(test.value) < 1e-8 &&
            std::none_of(causes.begin(), causes.end(), is_it))
            causes.push_back(test);
    }
}

/// True if two bifurcations are one, of one orbit at one of its nodes.
inline bool same_point(const BranchLine& line, const SpecialPoint& a, const SpecialPoint& b) {
    if (a.kind != b.kind || a.side != b.side || a.cycle.turns != b.cycle.turns ||
        !(std::abs(line.value(a.cycle) - line.value(b.cycle)) < 1e-9 * line.width()))
        return false;
    const double turn = b.cycle.period / b.cycle.turns;
    const double apart = std::remainder(a.cycle.t[a.node] - b.cycle.t[b.node], turn);
    if (line.system.forced() && !(std::abs(apart) < 1e-6 * turn))
        return false;
    const Vector scale = Shooting(line.system, b.cycle).scales(b.cycle).head(line.system.dim());
    const Vector moved = a.cycle.x[a.node] - b.cycle.x[b.node];
    return moved.cwiseQuotient(scale).norm() < 1e-6;
}
/// Keeps those that come first in the direction of the branch; true if they are all.
inline bool keep_first(const BranchLine& line, std::vector<SlidingCondition>& conditions,
                       std::vector<SpecialPoint>& special, double direction) {
    const auto along = [&](const SlidingCondition& s) {
        return direction < 0 ? -line.value(s.cycle) : line.value(s.cycle);
    };
    double first = std::numeric_limits<double>::infinity();
    for (const SlidingCondition& s : conditions)
        first = std::min(first, along(s));
    const std::size_t n = conditions.size();
    for (std::size_t i = n; i-- > 0;)
        if (along(conditions[i]) > first + 1e-9 * line.width()) {
            conditions.erase(conditions.begin() + std::ptrdiff_t(i));
            special.erase(special.begin() + std::ptrdiff_t(i));
        }
    return conditions.size() == n;
}

// --- what goes on ------------------------------------------------------------------------------

/// The curve of the word with one segment more, in the direction in which that grows.
inline std::optional<BranchPlace> child(const BranchLine& line, const SlidingCondition& s) {
    if (s.kind == Kind::grazing) { // a visit of the far side, if that leads back
        const double far = value_at(line.system, s.cycle, s.node, {Quantity::Kind::h, -s.side, 2});
        if (!crosses_alike(line.system, s) || !(s.side * far > 0))
            return std::nullopt;
    }
    const Cycle c = child_of(s);
    const Shooting shape(line.system, c, {line.parameter, -1});
    return place_of(line, c, [&](const Vector& dz) { return shape.growth(0, dz); });
}
/// The curve of the word with several segments more, born together as in the halves of a
/// symmetric orbit. At the bifurcation it may cross others, so it is taken up where the
/// segments are short, but have a length.
inline std::optional<BranchPlace> children(const BranchLine& line,
                                           const std::vector<SlidingCondition>& all) {
    Cycle c = child_of(all[0]);
    for (std::size_t k = 1; k < all.size(); ++k)
        c = child_of(moved_to(c, all[k]));
    const double length = 1e-4 * c.period;
    std::size_t first = c.size();
    for (std::size_t i = c.size(); i-- > 0;)
        if (!(c.duration(i) > 0) && i + 1 < c.size()) {
            // it begins before the point it grows from, and ends behind it
            c.t[i] -= length / 3;
            c.t[i + 1] += 2 * length / 3;
            first = i;
        }
    if (first == c.size())
        return std::nullopt;
    const Shooting shooting(line.system, c, {line.parameter, -1});
    const Vector scale = line.scales(shooting, c);
    Vector z = shooting.pack(c), gradient = Vector::Zero(z.size());
    for (Eigen::Index i = 0; i < z.size(); ++i)
        gradient[i] = shooting.growth(first, Vector::Unit(z.size(), i));
    const Equations equations = [&](const Vector& u, Vector& F, Matrix& J) {
        const auto e = shooting.evaluate(u);
        if (e.status != Status::ok)
            return false;
        F.resize(u.size());
        J.resize(u.size(), u.size());
        F << e.F, gradient.dot(u) - length;
        J << e.J, gradient.transpose();
        return true;
    };
    Matrix J;
    if (!newton(equations, scale, z, J).ok())
        return std::nullopt;
    const Cycle at = shooting.unpack(z);
    return place_of(line, at, [&](const Vector& dz) { return shooting.growth(first, dz); });
}
/// How far the node of an orbit without events has moved along the orbit: where it touches the
/// surface is at another phase for another parameter, and no change of the orbit.
inline Vector slid_along(const AnySystem& system, const Cycle& at, const Cycle& later) {
    const Vector flow = system.field(at.word[0].mode, at.t[0], at.x[0], at.p);
    const double dt = system.forced() ? later.t[0] - at.t[0]
                                      : flow.dot(later.x[0] - at.x[0]) / flow.squaredNorm();
    return dt * flow;
}
/// The curve of the word with one segment less, in the direction in which it becomes right.
inline std::optional<BranchPlace> parent(const BranchLine& line, const SlidingCondition& s) {
    auto augmented = place_of(line, s.cycle, [&](const Vector& dz) {
        const Shooting shape(line.system, s.cycle, {line.parameter, -1});
        const auto [value, gradient] = shape.at_node(shape.pack(s.cycle), s.node, s.vanishes());
        int sign = 1;
        if (grazes(s.kind) || s.kind == Kind::crossing_sliding)
            sign = s.side;
        else if (s.kind == Kind::switching_sliding)
            sign = -s.side;
        return sign * gradient.dot(dz);
    });
    if (!augmented)
        return std::nullopt;
    SlidingCondition moved = s;
    moved.cycle = augmented->shooting->unpack(
        augmented->z + 1e-3 * augmented->curve.scale().cwiseProduct(augmented->t));
    const Cycle at = parent_of(s), later = parent_of(moved);
    const Shooting shape(line.system, at, {line.parameter, -1});
    Vector direction = shape.pack(later) - shape.pack(at);
    if (at.word[0].until == Until::phase)
        direction.head(at.x[0].size()) -= slid_along(line.system, at, later);
    const Vector scale = line.scales(shape, at);
    return place_of(line, at, [&](const Vector& dz) {
        return direction.cwiseQuotient(scale).dot(dz.cwiseQuotient(scale));
    });
}

} // namespace detail

} // namespace filippov
