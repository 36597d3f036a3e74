// SPDX-License-Identifier: BSD-3-Clause
// Where the tracer of a curve is: a point of the curve of bifurcating orbits, with its tangent.
#pragma once

#include <filippov/continuation/detail/curve_start.hpp>
#include <filippov/orbits/dense.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace filippov {

namespace detail {

/// What a curve is followed over: two parameters of a system, within a rectangle.
struct CurvePlane {
    const AnySystem& system;
    Box box;

    double value(const Cycle& c, std::size_t k) const { return c.p[box.parameters[k]]; }
    /// Lengths in which steps are measured: the orbit's own, and the rectangle's.
    Vector scales(const Shooting& shooting, const Cycle& c) const {
        Vector scale = shooting.scales(c);
        for (std::size_t k = 0; k < 2; ++k)
            scale[shooting.rows() + Eigen::Index(k)] = box.width(k);
        return scale;
    }
    /// The orbits that have a sliding bifurcation.
    std::shared_ptr<const Shooting> shooting_of(const SlidingCondition& s) const {
        return std::make_shared<const Shooting>(
            system, s.cycle, box.parameters, s.kind == Kind::crossing_sliding ? int(s.node) : -1);
    }
};

/// A point of a curve: its equations, unknowns (nodes, a, b, and v for folds and flips), and
/// tangent.
struct CurvePlace {
    Kind kind{};
    SlidingCondition condition; ///< its cycle is the start
    std::shared_ptr<const Shooting> shooting;
    std::optional<Arclength> curve;
    Vector z, t;
    std::vector<Test> twins; ///< what vanishes at the start as well, in a symmetric orbit's half

    Cycle cycle(const Vector& u) const { return shooting->unpack(u.head(shooting->columns())); }
    Cycle cycle() const { return cycle(z); }
    double parameter(const Vector& u, std::size_t k) const {
        return u[shooting->rows() + Eigen::Index(k)];
    }
    double parameter(std::size_t k) const { return parameter(z, k); }
    /// The parameters' part of the tangent.
    Eigen::Vector2d direction() const { return t.segment<2>(shooting->rows()); }
};

/// The tests of a cycle but for the place's own.
inline std::vector<Test> other_tests(const AnySystem& system, const CurvePlace& here,
                                     const Vector& z) {
    std::vector<Test> others;
    for (const Test& test : tests_of(system, here.cycle(z))) {
        const bool own = changes_word(here.kind) && test.what == Test::What::far_side &&
                         test.i == here.condition.node;
        if (!own)
            others.push_back(test);
    }
    return others;
}
inline std::vector<Test> failures(const AnySystem& system, const CurvePlace& here, const Vector& z,
                                  double slack) {
    std::vector<Test> failed;
    for (const Test& test : other_tests(system, here, z)) {
        const bool twin = std::any_of(here.twins.begin(), here.twins.end(), [&](const Test& t) {
            return t.what == test.what && t.i == test.i && t.least.side == test.least.side;
        });
        if (!(test.value > (twin ? -1e-8 : -slack)))
            failed.push_back(test);
    }
    return failed;
}

/// +1 if the tangent leads away from a point of codimension two, into the curve's own side.
inline double orientation(const CurveStart& start, const CurvePlace& p) {
    const Vector dz = p.curve->scale().cwiseProduct(p.t);
    double grows = 1;
    if (start.growing >= 0) {
        grows = p.shooting->growth(std::size_t(start.growing), dz);
    } else if (start.growing_rate != 0) {
        const Quantity rate{Quantity::Kind::h, p.condition.side, 2};
        grows =
            start.growing_rate * p.shooting->at_node(p.z, p.condition.node, rate).second.dot(dz);
    }
    return grows < 0 ? -1 : 1;
}
inline std::optional<CurvePlace> sliding_place(const CurvePlane& plane, const CurveStart& start,
                                               int direction) {
    const SlidingCondition& s = start.condition;
    CurvePlace p;
    p.kind = start.kind;
    p.condition = s;
    p.shooting = plane.shooting_of(s);
    p.z = p.shooting->pack(s.cycle);
    p.curve.emplace(equations_with(*p.shooting, s), plane.scales(*p.shooting, s.cycle));
    if (!p.curve->tangent_at(p.z, Vector::Unit(p.z.size(), p.shooting->rows()), p.t))
        return std::nullopt;
    p.t *= orientation(start, p) * direction;
    for (const Test& test : other_tests(plane.system, p, p.z))
        if (std::abs(test.value) < 1e-9 && test.what != Test::What::duration)
            p.twins.push_back(test);
    return p;
}

/// The equations of folds and flips: F = 0, K v = 0 and v of length one, K for variations that
/// return with the factor 1 or -1. The shooting has to outlive them.
inline Equations null_equations(const Shooting& shooting, const Vector& normal, double turned) {
    return [&shooting, normal, turned](const Vector& u, Vector& F, Matrix& J) {
        const int n = shooting.rows(), m = shooting.columns();
        Vector v = Vector::Zero(m);
        v.head(n) = u.tail(n);
        const auto e = shooting.evaluate(u.head(m), &v, turned);
        if (e.status != Status::ok)
            return false;
        F.resize(2 * n + 1);
        F << e.F, e.K.leftCols(n) * u.tail(n), normal.dot(u.tail(n)) - 1;
        J = Matrix::Zero(2 * n + 1, m + n);
        J.topLeftCorner(n, m) = e.J;
        J.block(n, 0, n, m) = e.B;
        J.block(n, m, n, n) = e.K.leftCols(n);
        J.block(2 * n, m, 1, n) = normal.transpose();
        return true;
    };
}
inline std::optional<CurvePlace> smooth_place(const CurvePlane& plane, const CurveStart& start,
                                              int direction) {
    CurvePlace p;
    p.kind = start.kind;
    p.shooting = std::make_shared<const Shooting>(plane.system, start.cycle, plane.box.parameters);
    const int n = p.shooting->rows(), m = p.shooting->columns();
    const double turned = start.kind == Kind::flip ? -1 : 1;
    const Vector scale = plane.scales(*p.shooting, start.cycle), none = Vector::Zero(m);
    p.z.resize(m + n);
    p.z.head(m) = p.shooting->pack(start.cycle);
    const auto at = p.shooting->evaluate(p.z.head(m), &none, turned);
    if (at.status != Status::ok)
        return std::nullopt;
    const Matrix K = at.K.leftCols(n) * scale.head(n).asDiagonal();
    const Vector v = dense::least_stretched(K);
    p.z.tail(n) = scale.head(n).cwiseProduct(v);
    Vector all(m + n);
    all << scale, scale.head(n);
    p.curve.emplace(null_equations(*p.shooting, v.cwiseQuotient(scale.head(n)), turned), all);
    if (!p.curve->tangent_at(p.z, Vector::Unit(m + n, n), p.t))
        return std::nullopt;
    p.t *= direction;
    return p;
}
/// A place on the curve of the kind that the start says.
/// @param direction  +1 or -1
inline std::optional<CurvePlace> place_of(const CurvePlane& plane, const CurveStart& start,
                                          int direction) {
    return changes_word(start.kind) ? sliding_place(plane, start, direction)
                                    : smooth_place(plane, start, direction);
}

/// Of the orbit without the node at which it bifurcates, where no return map has a slope.
inline Multipliers multipliers_of(const AnySystem& system, const CurvePlace& p, const Vector& z) {
    if (!changes_word(p.kind))
        return floquet(system, p.cycle(z));
    SlidingCondition s = p.condition;
    s.cycle = p.cycle(z);
    return floquet(system, parent_of(s));
}
inline BranchPoint point_of(const AnySystem& system, const CurvePlace& p, const Vector& z) {
    BranchPoint point{p.cycle(z), multipliers_of(system, p, z)};
    normalize(system, point.cycle);
    return point;
}

} // namespace detail

} // namespace filippov
