// SPDX-License-Identifier: BSD-3-Clause
// Points of codimension two where the bifurcation of a curve is itself degenerate: cusps, and ends
// of sliding bifurcations. And folds and flips of orbits that have a sliding bifurcation.
#pragma once

#include <filippov/continuation/detail/curve_place.hpp>
#include <filippov/continuation/detail/multiplier_tests.hpp>
#include <filippov/continuation/detail/sliding_point.hpp>
#include <filippov/orbits/dense.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace filippov {

namespace detail {

/// One direction of a curve, as it is followed.
struct HalfCurve : Branch {
    std::vector<DegeneratePoint> degenerate; ///< where other curves start
};

/// A point located on the curve.
inline SpecialPoint special_at(const AnySystem& system, const CurvePlace& here, const Located& at,
                               Kind kind) {
    SpecialPoint special;
    special.kind = kind;
    special.cycle = here.cycle(at.z);
    special.word_before = special.word_after = special.cycle.word.string();
    special.convergence = at.convergence;
    if (changes_word(here.kind)) {
        special.node = here.condition.node;
        special.side = here.condition.side;
        special.conditions =
            conditions_at(system, here.kind, special.cycle, special.node, special.side);
    }
    return special;
}

/// Of a fold: the second derivative along its null vector, w^T (F_uu v v). Bordered, so that w
/// keeps its sign along the curve: w and v appear in one determinant.
inline double fold_test(const CurvePlace& here, const Vector& z) {
    const int n = here.shooting->rows(), m = here.shooting->columns();
    Vector v = Vector::Zero(m);
    v.head(n) = z.tail(n);
    const auto e = here.shooting->evaluate(z.head(m), &v);
    const Vector bent = e.B * v;
    Matrix bordered(n + 1, n + 1);
    const Vector scale = here.curve->scale().head(n);
    const Matrix K = e.K.leftCols(n) * scale.asDiagonal();
    bordered << K, bent, v.head(n).cwiseQuotient(scale).transpose(), 0.0;
    return dense::determinant(bordered);
}
/// What distinguishes a bifurcation from a degenerate one: the next derivative at the node, or that
/// of a fold.
inline double second_order_test(const CurvePlace& here, const Vector& z) {
    if (!changes_word(here.kind))
        return here.kind == Kind::fold ? fold_test(here, z) : 1;
    const int order = here.kind == Kind::adding_sliding ? 3 : 2;
    const Quantity q{Quantity::Kind::h, here.condition.side, order};
    return here.shooting->at_node(z.head(here.shooting->columns()), here.condition.node, q).first;
}

/// True if a curve of entries on the boundary has started from a degenerate one, and leads to where
/// they are of the other kind.
inline bool is_beyond_degenerate(const CurvePlace& here, double second_order) {
    const double push = here.condition.side * second_order;
    return here.kind == Kind::crossing_sliding ? push < 0
                                               : here.kind == Kind::switching_sliding && push > 0;
}
/// True at a cusp: the parameters stand still while the orbit moves on. (The determinant of the
/// test also changes its sign where a second multiplier reaches 1.)
inline bool parameters_pause(const CurvePlace& here, const Located& at) {
    const auto first = here.shooting->rows();
    const Vector t = here.curve->tangent(at.J, here.t);
    return t.segment(first, 2).norm() < 1e-3 * here.t.segment(first, 2).norm();
}
inline void add_cusp(const AnySystem& system, const CurvePlace& here, const Located& at,
                     Branch& curve) {
    if (!parameters_pause(here, at))
        return;
    SpecialPoint cusp = special_at(system, here, at, Kind::cusp);
    cusp.conditions = {{"w.F_uu v v", second_order_test(here, at.z)}};
    cusp.multipliers = floquet(system, cusp.cycle);
    normalize(system, cusp.cycle);
    curve.special.push_back(cusp);
}
/// @param first    where the cycle with the plain word starts
/// @param vanishes the segment there has no length and is none of that word's
inline void end_at_degenerate(const AnySystem& system, const CurvePlace& here, const Located& at,
                              std::size_t first, bool vanishes, HalfCurve& curve) {
    const SpecialPoint special = special_at(system, here, at, Kind::degenerate_switching_sliding);
    Cycle plain = rotated(special.cycle, first);
    if (vanishes)
        erase_first(plain);
    curve.degenerate.push_back({plain, 0, special.side});
    curve.special.push_back(special);
    curve.points.push_back(point_of(system, here, at.z));
    curve.end = BranchEnd::degenerate_switching_sliding;
}
/// Where the orbit crosses into the far side tangent to second order. On the other side of it a
/// slide that begins on the boundary leaves it there at once.
inline void end_at_degenerate_crossing(const AnySystem& system, const CurvePlace& here,
                                       const Located& at, HalfCurve& curve) {
    curve.special.push_back(special_at(system, here, at, Kind::crossing_sliding));
    curve.points.push_back(point_of(system, here, at.z));
    curve.end = BranchEnd::degenerate_crossing_sliding;
}
/// True where an entry that is tangent to second order leads on to the far side.
inline bool leads_on(const CurvePlace& here, const Vector& z) {
    const int b = here.condition.side;
    return b * here.shooting->at_node(z, here.condition.node, {Quantity::Kind::h, b, 3}).first > 0;
}
/// A change of sign of the second-order test, from `before` to `after`, within a step. True if the
/// curve ends there.
inline bool second_order_point(const AnySystem& system, const CurvePlace& here, double ds,
                               double before, double after, HalfCurve& curve) {
    const auto test = [&](const Vector& z, const Matrix&) { return second_order_test(here, z); };
    const Located at = zero_along(*here.curve, here.z, here.t, ds, test, before, after);
    curve.corrections += at.convergence.iterations;
    if (!at.ok())
        return false;
    if (here.kind == Kind::fold) {
        add_cusp(system, here, at, curve);
        return false;
    }
    if (here.kind == Kind::switching_sliding || here.kind == Kind::crossing_sliding) {
        if (leads_on(here, at.z)) {
            if (here.kind == Kind::switching_sliding)
                return false; // the slide has vanished before
            end_at_degenerate_crossing(system, here, at, curve);
            return true;
        }
        // the visit of a crossing has no length
        end_at_degenerate(system, here, at, here.condition.node,
                          here.kind == Kind::crossing_sliding, curve);
        return true;
    }
    curve.special.push_back(special_at(system, here, at, here.kind));
    curve.points.push_back(point_of(system, here, at.z));
    curve.end = BranchEnd::degenerate;
    return true;
}

/// A fold or a flip of an orbit that has a sliding bifurcation: a multiplier passes 1 or -1.
/// @param after  multipliers at the end of the step
inline void add_smooth_point(const AnySystem& system, const CurvePlace& here, double ds, Kind kind,
                             const Multipliers& after, Branch& curve) {
    const double border = kind == Kind::fold ? 1 : -1;
    const auto test = [&](const Multipliers& multipliers) {
        return border_test(multipliers, border, system.forced());
    };
    const double f0 = test(curve.points.back().multipliers), f1 = test(after);
    if (!(f0 * f1 < 0))
        return;
    const auto along = [&](const Vector& z, const Matrix&) {
        return test(multipliers_of(system, here, z));
    };
    const Located at = zero_along(*here.curve, here.z, here.t, ds, along, f0, f1);
    if (!at.ok())
        return;
    SpecialPoint special = special_at(system, here, at, kind);
    special.multipliers = multipliers_of(system, here, at.z);
    special.conditions.emplace_back(kind == Kind::fold ? "det(M - 1)" : "det(M + 1)",
                                    test(special.multipliers));
    curve.special.push_back(special);
}

} // namespace detail

} // namespace filippov
