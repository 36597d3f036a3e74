// SPDX-License-Identifier: BSD-3-Clause
// Where curves of bifurcations start: at the bifurcations of a branch, and where other curves end.
#pragma once

#include <filippov/continuation/continuation.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace filippov {

/// A rectangle in two parameters.
struct Box {
    std::array<int, 2> parameters{};
    std::array<double, 2> low{}, high{};

    double width(std::size_t k) const { return high[k] - low[k]; }
};

namespace detail {

inline void require_box(const AnySystem& system, const Box& box) {
    for (std::size_t k = 0; k < 2; ++k) {
        require_parameter(system, "box.parameters", box.parameters[k]);
        require_range("box.low", box.low[k], box.high[k]);
    }
    if (box.parameters[0] == box.parameters[1])
        refuse("box.parameters", box.parameters[1], "expected two different ones");
}

} // namespace detail

/// A curve of one kind of bifurcation.
struct Curve : Branch {
    Kind kind{};
};

/// Where a curve of bifurcations starts: an orbit that bifurcates, and how.
struct CurveStart {
    Kind kind{};
    SlidingCondition condition; ///< of a sliding bifurcation
    Cycle cycle;                ///< of a fold or a flip
    /// A segment whose duration grows from zero along the curve, -1: both directions are wanted.
    int growing = -1;
    int growing_rate = 0; ///< +-1: the second derivative at the node grows in this direction

    /// The orbit that bifurcates.
    const Cycle& orbit() const { return changes_word(kind) ? condition.cycle : cycle; }
};

/// The start of a curve from a bifurcation on a branch.
inline CurveStart curve_start(const SpecialPoint& s) {
    CurveStart start;
    start.kind = s.kind;
    if (changes_word(s.kind))
        start.condition = {s.kind, s.cycle, s.node, s.side};
    else
        start.cycle = s.cycle;
    return start;
}

/// A degenerate switching-sliding point: at a node the orbit enters its slide where the field of
/// the far side is tangent to second order.
struct DegeneratePoint {
    Cycle cycle; ///< with the plain word
    std::size_t node = 0;
    int side = 0; ///< the far side
};

/// The three curves that meet there.
inline std::vector<CurveStart> curves_at_degenerate(const DegeneratePoint& point) {
    const int b = point.side;
    const Cycle base = detail::rotated(point.cycle, point.node);
    std::vector<CurveStart> all(3);
    // switching: the entry stays on the boundary, and is pushed inwards (b L' < 0)
    all[0].kind = Kind::switching_sliding;
    all[0].condition = {all[0].kind, base, 0, b};
    all[0].growing_rate = -b;
    // crossing: a visit to the far side before the slide, tangent at its start
    all[1].kind = Kind::crossing_sliding;
    Cycle visit = base;
    detail::insert(visit, 0, {b, Until::surface}, base.t[0], base.x[0]);
    all[1].condition = {all[1].kind, visit, 0, b};
    all[1].growing = 0;
    // adding: the slide touches its boundary later than where it starts
    all[2].kind = Kind::adding_sliding;
    Cycle touch = base;
    detail::insert(touch, 0, {0, detail::extremum(b)}, base.t[0], base.x[0]);
    all[2].condition = {all[2].kind, touch, 1, b};
    all[2].growing = 0;
    return all;
}

} // namespace filippov
