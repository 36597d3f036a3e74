// SPDX-License-Identifier: BSD-3-Clause
// The sliding region without a trajectory: its boundaries, tangencies and equilibria.
#pragma once

#include <filippov/arclength.hpp>

#include <array>
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
    Kind kind = Kind::regular;
    Vector x;
    int side = 0;      ///< -1, +1; 0 for a pseudo-equilibrium
    double s = 0;      ///< blend variable of a pseudo-equilibrium
    double value = 0;  ///< the parameter, of a boundary equilibrium
    bool real = false; ///< on its own side; |s| < 1 for a pseudo-equilibrium
    std::vector<std::complex<double>>
        eigenvalues{}; ///< on the surface: dim - 1 of a pseudo-equilibrium
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
        const Vector dz = -scale.cwiseProduct(scaled.completeOrthogonalDecomposition().solve(F));
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

/// Points of a grid over a box, about `n` of them.
template <class Use> void each_seed(const StateBox& box, int n, Use use) {
    const auto d = box.low.size();
    const int per_axis = std::max(2, int(std::ceil(std::pow(double(n), 1.0 / double(d)))));
    std::vector<int> index(std::size_t(d), 0);
    for (;;) {
        Vector x(d);
        for (Eigen::Index i = 0; i < d; ++i)
            x[i] =
                box.low[i] + (box.high[i] - box.low[i]) * (index[std::size_t(i)] + 0.5) / per_axis;
        use(x);
        std::size_t axis = 0;
        while (axis < index.size() && ++index[axis] == per_axis)
            index[axis++] = 0;
        if (axis == index.size())
            return;
    }
}
inline bool inside(const StateBox& box, const Vector& x) {
    return (x - box.low).minCoeff() >= 0 && (box.high - x).minCoeff() >= 0;
}
inline void require_box(const AnySystem& system, const StateBox& box) {
    if (box.low.size() != system.dim() || box.high.size() != system.dim())
        refuse("box", double(box.low.size()), "expected one range a state component");
    for (Eigen::Index i = 0; i < box.low.size(); ++i)
        if (!(box.low[i] < box.high[i]))
            refuse("box.low[" + std::to_string(i) + "]", box.low[i], "expected low < high");
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
    detail::require_box(system, box);
    const Equations equations = detail::tangency_equations(system, side, t, p);
    const Vector scale = box.high - box.low;
    std::vector<Tangency> found;
    detail::each_seed(box, seeds, [&](Vector x) {
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
    std::vector<Tangency> tangential; ///< where `drift` vanishes
};

/// @param near  a state from which Newton finds the boundary at phase zero
inline SlidingBoundary sliding_boundary(const AnySystem& system, int side, const Vector& near,
                                        const Vector& p, int n = 256) {
    if (!system.forced() || system.dim() != 2)
        throw std::invalid_argument("filippov: system: expected a forced planar one");
    const double T = system.period(p, {}).value;
    const Vector scale = near.cwiseAbs().cwiseMax(1e-3 * std::max(1.0, near.norm()));
    SlidingBoundary boundary;
    boundary.side = side;
    Vector x = near;
    const auto point = [&](double t, Vector& state) {
        return detail::least_newton(detail::tangency_equations(system, side, t, p), state, scale);
    };
    for (int k = 0; k <= n; ++k) {
        const double t = T * k / n;
        if (!point(t, x))
            break;
        boundary.points.push_back(describe_tangency(system, side, t, x, p));
    }
    for (std::size_t k = 1; k < boundary.points.size(); ++k) {
        const Tangency &a = boundary.points[k - 1], &b = boundary.points[k];
        if (!(a.drift * b.drift < 0))
            continue;
        double low = a.t, high = b.t;
        Tangency middle = a;
        for (int i = 0; i < 60 && high - low > 1e-15 * T; ++i) {
            const double t = low + (high - low) / 2;
            Vector y = middle.x;
            if (!point(t, y))
                break;
            middle = describe_tangency(system, side, t, y, p);
            (middle.drift * a.drift > 0 ? low : high) = t;
        }
        boundary.tangential.push_back(middle);
    }
    return boundary;
}

/// Equilibria of f1 and f2 within a box, real and virtual, and pseudo-equilibria with |s| < 1 or
/// beyond, of an autonomous system.
inline std::vector<Equilibrium> equilibria(const AnySystem& system, const StateBox& box,
                                           const Vector& p, int seeds = 64) {
    detail::require_box(system, box);
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
        detail::each_seed(box, seeds, [&](Vector x) {
            if (!detail::least_newton(rest, x, scale))
                return;
            Equilibrium e;
            e.x = x;
            e.side = side;
            e.real = side * h_at(x).value[0] > 0;
            const Eigen::VectorXcd values =
                Matrix(system.rate(side, 0, x, p, {}).slope.leftCols(d)).eigenvalues();
            e.eigenvalues.assign(values.begin(), values.end());
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
    detail::each_seed(box, seeds, [&](const Vector& x) {
        Vector z(d + 1);
        z << x, 0;
        if (!detail::least_newton(pseudo, z, scale_s))
            return;
        Equilibrium e;
        e.kind = Equilibrium::Kind::pseudo;
        e.x = z.head(d);
        e.s = z[d];
        e.real = std::abs(e.s) < 1;
        // the sliding flow's Jacobian on the tangent plane of the surface
        const Matrix normal = h_at(e.x).slope.leftCols(d).transpose();
        const Matrix Q = Eigen::HouseholderQR<Matrix>(normal).householderQ();
        const Matrix tangent = Q.rightCols(d - 1);
        const Matrix J = system.rate(0, 0, e.x, p, {}).slope.leftCols(d);
        if (d > 1) {
            const Eigen::VectorXcd values = Matrix(tangent.transpose() * J * tangent).eigenvalues();
            e.eigenvalues.assign(values.begin(), values.end());
        }
        keep(e);
    });
    return found;
}

/// Boundary equilibria of an autonomous system over one parameter: an equilibrium of f1 or f2
/// reaches the surface.
inline std::vector<Equilibrium> boundary_equilibria(const AnySystem& system, const StateBox& box,
                                                    Vector p, int parameter, double low,
                                                    double high, int seeds = 64) {
    detail::require_box(system, box);
    if (!(parameter >= 0 && parameter < p.size()))
        detail::refuse("parameter", parameter, "expected an index of a parameter");
    if (!(low < high))
        detail::refuse("low", low, "expected low < high");
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
        detail::each_seed(box, seeds, [&](const Vector& x) {
            Vector z(d + 1);
            z << x, low + (high - low) / 2;
            if (!detail::least_newton(equations, z, scale) || !(z[d] >= low && z[d] <= high) ||
                !detail::inside(box, z.head(d)))
                return;
            for (const Equilibrium& known : found)
                if (known.side == side && std::abs(known.value - z[d]) < 1e-9 * (high - low) &&
                    (known.x - z.head(d)).norm() < 1e-7 * scale.norm())
                    return;
            Equilibrium e;
            e.kind = Equilibrium::Kind::boundary;
            e.x = z.head(d);
            e.side = side;
            e.s = side;
            e.value = z[d];
            e.real = true;
            found.push_back(e);
        });
    }
    return found;
}

} // namespace filippov
