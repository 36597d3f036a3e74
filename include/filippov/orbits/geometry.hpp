// SPDX-License-Identifier: BSD-3-Clause
// The sliding region without a trajectory: its boundaries, tangencies and equilibria.
#pragma once

#include <filippov/core/statistics.hpp>
#include <filippov/orbits/arclength.hpp>
#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/floquet.hpp>
#include <filippov/orbits/maps.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace filippov {

/// A rectangle of states.
struct StateBox {
    Vector low, high;
};

/// A point where the field of one side is tangent to the surface: h = 0, L = 0, an end of the
/// sliding region or of an escaping one.
struct Tangency {
    double t = 0;
    Vector x;
    int side = 0;      ///< whose field is tangent: -1 (s = -1) or +1 (s = +1)
    double second = 0; ///< h'' along that field
    double other = 0;  ///< L of the other side's field
    double drift = 0;  ///< derivative of |s| along the sliding field: > 0 where slides end

    /// True if that side's solution touches the surface from its own side.
    bool visible() const { return side * second > 0; }
    /// True if the sliding next to it attracts.
    bool attracting() const { return side * other > 0; }
};

/// A rest point.
struct Equilibrium {
    enum class Kind : unsigned char {
        regular, ///< of f1 or f2
        pseudo,  ///< of the sliding field
        boundary ///< of f1 or f2, on the surface
    };
    /// What a boundary equilibrium is to the parameter.
    enum class Encounter : unsigned char {
        none,        ///< it is no boundary equilibrium
        persistence, ///< it becomes a pseudo-equilibrium: one of the two on either side
        fold,        ///< a nonsmooth fold: it meets a pseudo-equilibrium, and both vanish
        degenerate   ///< neither: the surface is full of rest points, or the Jacobian is singular
    };
    Kind kind = Kind::regular;
    Encounter encounter = Encounter::none;
    Vector x;
    int side = 0;           ///< -1, +1; 0 for a pseudo-equilibrium
    double s = 0;           ///< blend variable of a pseudo-equilibrium
    double value = 0;       ///< the parameter, of a boundary equilibrium
    bool real = false;      ///< on its own side; |s| < s_max (1) for a pseudo-equilibrium
    bool attracting = true; ///< of a pseudo-equilibrium: the sliding around it attracts
    std::vector<std::complex<double>>
        eigenvalues{}; ///< on the surface: dim - 1 of a pseudo-equilibrium

    /// True if solutions nearby tend to it; never said of one on the surface's edge.
    bool stable() const {
        return kind != Kind::boundary && real && attracting &&
               std::ranges::all_of(eigenvalues, [](const auto& e) { return e.real() < 0; });
    }
};

namespace detail {

/// Newton with steps of least length: equations fewer than unknowns are welcome.
inline bool least_newton(const Equations& equations, Vector& z, const Vector& scale) {
    Vector F;
    Matrix J;
    for (int k = 0; k < 50; ++k) {
        if (!equations(z, F, J) || !F.allFinite() || !J.allFinite())
            return false;
        const Matrix scaled = J * scale.asDiagonal();
        const Vector dz = -scale.cwiseProduct(dense::shortest(scaled, F));
        if (!dz.allFinite())
            return false;
        z += dz;
        const double step = dz.cwiseQuotient(scale).cwiseAbs().maxCoeff();
        if (!(step < 1e3))
            return false;
        if (step <= 1e-14 || (step <= 1e-11 && k > 3)) {
            // where the equations contradict each other steps shrink, too, but what is left does
            // not
            const Vector size = scaled.cwiseAbs().rowwise().sum();
            return equations(z, F, J) && (F.cwiseAbs() - 1e-9 * size).maxCoeff() <= 0;
        }
    }
    return false;
}

/// Points of a grid over a box, about `n` of them, until the caller of the system asks to stop; in
/// so many dimensions that a grid has more, `n` at random, the same every time.
template <class Use> void each_seed(const AnySystem& system, const StateBox& box, int n, Use use) {
    const auto d = box.low.size();
    if (double(n) < std::pow(2.0, double(d))) {
        std::mt19937_64 random(20080131);
        for (int k = 0; k < n && !system.interrupted(); ++k) {
            Vector x(d);
            for (Eigen::Index i = 0; i < d; ++i)
                x[i] = box.low[i] + (box.high[i] - box.low[i]) * uniform(random);
            use(x);
        }
        return;
    }
    const int per_axis = std::max(2, int(std::ceil(std::pow(double(n), 1.0 / double(d)))));
    std::vector<int> index(std::size_t(d), 0);
    for (;;) {
        Vector x(d);
        for (Eigen::Index i = 0; i < d; ++i)
            x[i] =
                box.low[i] + (box.high[i] - box.low[i]) * (index[std::size_t(i)] + 0.5) / per_axis;
        if (system.interrupted())
            return;
        use(x);
        std::size_t axis = 0;
        while (axis < index.size() && ++index[axis] == per_axis)
            index[axis++] = 0;
        if (axis == index.size())
            return;
    }
}
inline bool inside(const StateBox& box, const Vector& x) {
    // A surface may be a side of the box; there rounding decides nothing.
    const Vector slack = 1e-12 * (box.low.cwiseAbs() + box.high.cwiseAbs());
    return (x - box.low + slack).minCoeff() >= 0 && (box.high - x + slack).minCoeff() >= 0;
}
inline void require_box(const AnySystem& system, const StateBox& box, const Vector& p, int seeds) {
    require_one_surface(system);
    if (box.low.size() != system.dim() || box.high.size() != system.dim())
        refuse("box", double(box.low.size()), "expected one range a state component");
    for (Eigen::Index i = 0; i < box.low.size(); ++i)
        require_range("box.low[" + std::to_string(i) + "]", box.low[i], box.high[i]);
    require_point(system, 0, box.low, p);
    require_positive("seeds", seeds);
}
inline void require_side(int side) {
    if (side != -1 && side != 1)
        refuse("side", side, "expected -1 or +1");
}

} // namespace detail

/// True if the fields or the surface change in time, as far as points of the box show.
inline bool depends_on_time(const AnySystem& system, const StateBox& box, const Vector& p) {
    detail::require_box(system, box, p, 1);
    const int d = system.dim();
    bool moves = false;
    // times without a common period: no forcing is at rest in all of them
    for (const double t : {0.3819660112501051, 1.7320508075688772, 4.6692016091029907})
        detail::each_seed(system, box, 8, [&](const Vector& x) {
            for (const int side : {-1, 1}) {
                const Jet f = system.rate(side, t, x, p, {}),
                          h = system.quantity({Quantity::Kind::h, side, 0}, t, x, p, {});
                moves = moves || f.slope.col(d).cwiseAbs().maxCoeff() > 0 ||
                        std::abs(h.slope(0, d)) > 0;
            }
        });
    return moves;
}

namespace detail {

inline void require_autonomous(const AnySystem& system, const StateBox& box, const Vector& p) {
    if (depends_on_time(system, box, p))
        throw std::invalid_argument(
            "filippov: system: expected an autonomous one; this one depends on time");
}

/// h = 0 and L = 0 of a side at a time, in the unknowns x.
inline Equations tangency_equations(const AnySystem& system, int side, double t, const Vector& p) {
    return [&system, side, t, p](const Vector& x, Vector& F, Matrix& J) {
        const auto d = x.size();
        F.resize(2);
        J.resize(2, d);
        for (int order = 0; order < 2; ++order) {
            const Jet jet = system.quantity({Quantity::Kind::h, side, order}, t, x, p, {});
            F[order] = jet.value[0];
            J.row(order) = jet.slope.row(0).head(d);
        }
        return true;
    };
}

} // namespace detail

/// All that distinguishes a tangency, at a point where h = L = 0.
inline Tangency describe_tangency(const AnySystem& system, int side, double t, const Vector& x,
                                  const Vector& p) {
    using K = Quantity::Kind;
    const auto at = [&](K kind, int of, int order) {
        return system.quantity({kind, of, order}, t, x, p, {}).value[0];
    };
    Tangency point;
    point.t = t;
    point.x = x;
    point.side = side;
    point.second = at(K::h, side, 2);
    point.other = at(K::h, -side, 1);
    point.drift = -at(K::margin, side, 1);
    return point;
}

/// Tangencies of one side's field with the surface at a time, within a box: isolated points of a
/// planar system, some points of each curve of a larger one.
/// @param seeds  starts of Newton's iteration, on a grid over the box
inline std::vector<Tangency> tangencies(const AnySystem& system, int side, double t,
                                        const StateBox& box, const Vector& p, int seeds = 64) {
    detail::require_box(system, box, p, seeds);
    detail::require_side(side);
    if (!std::isfinite(t))
        detail::refuse("t", t, "expected a finite number");
    const Equations equations = detail::tangency_equations(system, side, t, p);
    const Vector scale = box.high - box.low;
    std::vector<Tangency> found;
    detail::each_seed(system, box, seeds, [&](Vector x) {
        if (!detail::least_newton(equations, x, scale) || !detail::inside(box, x))
            return;
        for (const Tangency& known : found)
            if ((known.x - x).cwiseQuotient(scale).norm() < 1e-7)
                return;
        found.push_back(describe_tangency(system, side, t, x, p));
    });
    return found;
}

/// A boundary of the sliding region of a forced planar system over one period, and where on it the
/// sliding flow is tangent to it (cusps of the region's exits: adding-sliding happens there).
struct SlidingBoundary {
    int side = 0;
    std::vector<Tangency> points;     ///< at equidistant phases, from 0 to 2 pi
    std::vector<Tangency> tangential; ///< where `drift` vanishes, in order of time
    Status status = Status::ok;       ///< `not_converged` if it could not be followed all round
    std::string message;              ///< why
};

namespace detail {

/// The point of a boundary at a time, by Newton from a point nearby.
using PointAt = std::function<bool(double t, Vector& x)>;

/// The zero of `drift` between two neighbours, by bisection.
inline std::optional<Tangency> tangential_point(const AnySystem& system, const Vector& p,
                                                const PointAt& point, const Tangency& a,
                                                const Tangency& b) {
    double low = a.t, high = b.t;
    Tangency middle = a;
    for (int i = 0; i < 60 && high - low > 1e-15 * std::abs(b.t); ++i) {
        const double t = low + (high - low) / 2;
        Vector y = middle.x;
        if (!point(t, y))
            return std::nullopt;
        middle = describe_tangency(system, a.side, t, y, p);
        (middle.drift * a.drift > 0 ? low : high) = t;
    }
    // at a pole, where the other field is tangent as well, the sign changes without a zero
    if (!(std::abs(middle.drift) <= 1e-6 * (std::abs(a.drift) + std::abs(b.drift))))
        return std::nullopt;
    return middle;
}

/// All of them; one at phase zero may be seen from both ends of the period, or from neither.
inline void find_tangential(const AnySystem& system, const Vector& p, const PointAt& point,
                            double T, SlidingBoundary& boundary) {
    const auto keep = [&](const Tangency& found) {
        for (const Tangency& known : boundary.tangential)
            if (std::abs(std::remainder(known.t - found.t, T)) < 1e-9 * T)
                return;
        boundary.tangential.push_back(found);
    };
    const auto& points = boundary.points;
    for (std::size_t k = 0; k < points.size(); ++k) {
        const bool last = k + 1 == points.size(), seam = last && boundary.status == Status::ok;
        // exact zeros, and at the end a change that rounding has put on the seam
        if (std::abs(points[k].drift) <= 0 || (seam && points[k].drift * points[0].drift < 0))
            keep(points[seam ? 0 : k]);
        else if (!last && points[k].drift * points[k + 1].drift < 0)
            if (const auto found = tangential_point(system, p, point, points[k], points[k + 1]))
                keep(*found);
    }
    std::ranges::sort(boundary.tangential, {}, &Tangency::t);
}

} // namespace detail

/// @param near  a state from which Newton finds the boundary at phase zero
/// @param n     points over the period
inline SlidingBoundary sliding_boundary(const AnySystem& system, int side, const Vector& near,
                                        const Vector& p, int n = 256) {
    if (!system.forced() || system.dim() != 2)
        throw std::invalid_argument("filippov: system: expected a forced planar one");
    detail::require_one_surface(system);
    detail::require_side(side);
    detail::require_point(system, 0, near, p, "near");
    detail::require_positive("n", n);
    const double T = detail::require_period(system, p).value;
    const Vector scale = near.cwiseAbs().cwiseMax(1e-3 * (near.norm() > 0 ? near.norm() : 1.0));
    const detail::PointAt point = [&](double t, Vector& x) {
        return detail::least_newton(detail::tangency_equations(system, side, t, p), x, scale);
    };
    SlidingBoundary boundary;
    boundary.side = side;
    Vector x = near;
    for (int k = 0; k <= n; ++k) {
        const double t = T * k / n;
        if (system.interrupted())
            boundary.status = Status::interrupted;
        else if (!point(t, x))
            boundary.status = Status::not_converged;
        if (boundary.status != Status::ok) {
            boundary.message = "followed up to t = " + std::to_string(t);
            break;
        }
        boundary.points.push_back(describe_tangency(system, side, t, x, p));
    }
    if (boundary.status == Status::ok &&
        (boundary.points.back().x - boundary.points[0].x).cwiseQuotient(scale).norm() > 1e-6) {
        boundary.status = Status::not_converged;
        boundary.message = "after a period it is another point: take a larger n";
    }
    detail::find_tangential(system, p, point, T, boundary);
    return boundary;
}

/// Equilibria of f1 and f2 within a box, real and virtual, and pseudo-equilibria with |s| < 1 or
/// beyond, of an autonomous system.
inline std::vector<Equilibrium> equilibria(const AnySystem& system, const StateBox& box,
                                           const Vector& p, int seeds = 64) {
    detail::require_box(system, box, p, seeds);
    detail::require_autonomous(system, box, p);
    const int d = system.dim();
    std::vector<Equilibrium> found;
    const Vector scale = box.high - box.low;
    const auto h_at = [&](const Vector& x) {
        return system.quantity({Quantity::Kind::h, -1, 0}, 0, x, p, {});
    };
    const auto keep = [&](Equilibrium e) {
        if (!detail::inside(box, e.x))
            return;
        for (const Equilibrium& known : found)
            if (known.side == e.side && (known.x - e.x).cwiseQuotient(scale).norm() < 1e-7)
                return;
        found.push_back(std::move(e));
    };
    for (const int side : {-1, 1}) {
        const Equations rest = [&](const Vector& x, Vector& F, Matrix& J) {
            const Jet f = system.rate(side, 0, x, p, {});
            F = f.value;
            J = f.slope.leftCols(d);
            return true;
        };
        detail::each_seed(system, box, seeds, [&](Vector x) {
            if (!detail::least_newton(rest, x, scale))
                return;
            Equilibrium e;
            e.x = x;
            e.side = side;
            e.real = side * h_at(x).value[0] > 0;
            e.eigenvalues =
                detail::eigenvalues_of(system.rate(side, 0, x, p, {}).slope.leftCols(d));
            keep(e);
        });
    }
    // (1 - s)/2 f1 + (1 + s)/2 f2 = 0 and h = 0, in the unknowns x and s
    const Equations pseudo = [&](const Vector& z, Vector& F, Matrix& J) {
        const Vector x = z.head(d);
        const double a = (1 - z[d]) / 2, b = (1 + z[d]) / 2;
        const Jet f1 = system.rate(-1, 0, x, p, {}), f2 = system.rate(1, 0, x, p, {}), h = h_at(x);
        F.resize(d + 1);
        J = Matrix::Zero(d + 1, d + 1);
        F << a * f1.value + b * f2.value, h.value[0];
        J.topLeftCorner(d, d) = a * f1.slope.leftCols(d) + b * f2.slope.leftCols(d);
        J.topRightCorner(d, 1) = (f2.value - f1.value) / 2;
        J.bottomLeftCorner(1, d) = h.slope.leftCols(d);
        return true;
    };
    Vector scale_s(d + 1);
    scale_s << scale, 1;
    detail::each_seed(system, box, seeds, [&](const Vector& x) {
        Vector z(d + 1);
        z << x, 0;
        if (!detail::least_newton(pseudo, z, scale_s))
            return;
        Equilibrium e;
        e.kind = Equilibrium::Kind::pseudo;
        e.x = z.head(d);
        e.s = z[d];
        e.real = std::abs(e.s) < system.s_max(p);
        // the sliding flow's Jacobian on the tangent plane of the surface
        const Matrix normal = h_at(e.x).slope.leftCols(d).transpose();
        const Matrix Q = dense::orthogonal(normal);
        const Matrix tangent = Q.rightCols(d - 1);
        const Matrix J = system.rate(0, 0, e.x, p, {}).slope.leftCols(d);
        e.eigenvalues = detail::eigenvalues_of(tangent.transpose() * J * tangent);
        const auto L = [&](int side) {
            return system.quantity({Quantity::Kind::h, side, 1}, 0, e.x, p, {}).value[0];
        };
        e.attracting = L(-1) > L(1);
        keep(e);
    });
    return found;
}

namespace detail {

/// Eigenvalues of a boundary equilibrium, and what becomes of it: beyond it a pseudo-equilibrium
/// has the blend b of the other field, b <grad h, N^-1 (F_other - F)> = h at the equilibrium of F,
/// N = DF; it is one that slides (b > 0) where that equilibrium is virtual, or where it is real.
/// @source di Bernardo, Nordmark & Olivar (2008), Physica D 237, 119-136
inline void describe_boundary_equilibrium(const AnySystem& system, const Vector& p,
                                          const Vector& size, Equilibrium& e) {
    const int d = system.dim();
    const Jet f = system.rate(e.side, 0, e.x, p, {}), other = system.rate(-e.side, 0, e.x, p, {}),
              h = system.quantity({Quantity::Kind::h, e.side, 0}, 0, e.x, p, {});
    const Matrix N = f.slope.leftCols(d);
    e.eigenvalues = eigenvalues_of(N);
    const Vector normal = h.slope.row(0).head(d);
    // in units of the box, and of what each component of the field is made of
    const Matrix scaled = N * size.asDiagonal();
    const Vector rows = scaled.rowwise().norm().cwiseMax(std::numeric_limits<double>::min());
    const auto [x, regular] = dense::solve_and_judge(rows.cwiseInverse().asDiagonal() * scaled,
                                                     (other.value - f.value).cwiseQuotient(rows));
    const Vector step = size.cwiseProduct(x);
    const double across = e.side * normal.dot(step);
    if (!regular || !(std::abs(across) > 1e-9 * normal.cwiseProduct(step).cwiseAbs().sum()))
        e.encounter = Equilibrium::Encounter::degenerate;
    else
        e.encounter =
            across < 0 ? Equilibrium::Encounter::persistence : Equilibrium::Encounter::fold;
}

} // namespace detail

/// Boundary equilibria of an autonomous system over one parameter: an equilibrium of f1 or f2
/// reaches the surface.
inline std::vector<Equilibrium> boundary_equilibria(const AnySystem& system, const StateBox& box,
                                                    Vector p, int parameter, double low,
                                                    double high, int seeds = 64) {
    detail::require_box(system, box, p, seeds);
    detail::require_parameter(system, "parameter", parameter);
    detail::require_range("low", low, high);
    for (const double value : {low, low + (high - low) / 2, high}) {
        p[parameter] = value;
        detail::require_autonomous(system, box, p);
    }
    const int d = system.dim();
    const Directions along{{parameter, -1}, nullptr};
    std::vector<Equilibrium> found;
    Vector scale(d + 1);
    scale << box.high - box.low, high - low;
    for (const int side : {-1, 1}) {
        const Equations equations = [&](const Vector& z, Vector& F, Matrix& J) {
            Vector q = p;
            q[parameter] = z[d];
            const Vector x = z.head(d);
            const Jet f = system.rate(side, 0, x, q, along),
                      h = system.quantity({Quantity::Kind::h, side, 0}, 0, x, q, along);
            F.resize(d + 1);
            J.resize(d + 1, d + 1);
            F << f.value, h.value[0];
            J << f.slope.leftCols(d), f.slope.col(d + 2), h.slope.leftCols(d), h.slope.col(d + 2);
            return true;
        };
        detail::each_seed(system, box, seeds, [&](const Vector& x) {
            Vector z(d + 1);
            z << x, low + (high - low) / 2;
            if (!detail::least_newton(equations, z, scale) || !(z[d] >= low && z[d] <= high) ||
                !detail::inside(box, z.head(d)))
                return;
            for (const Equilibrium& known : found)
                if (known.side == side && std::abs(known.value - z[d]) < 1e-9 * (high - low) &&
                    (known.x - z.head(d)).cwiseQuotient(scale.head(d)).norm() < 1e-7)
                    return;
            Equilibrium e;
            e.kind = Equilibrium::Kind::boundary;
            e.x = z.head(d);
            e.side = side;
            e.s = side;
            e.value = z[d];
            e.real = true;
            Vector q = p;
            q[parameter] = z[d];
            detail::describe_boundary_equilibrium(system, q, scale.head(d), e);
            found.push_back(e);
        });
    }
    return found;
}

} // namespace filippov
