// SPDX-License-Identifier: BSD-3-Clause
// Pseudo-arclength: steps along a curve F(z) = 0 with one unknown more than equations.
#pragma once

#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/detail/shooting.hpp>

namespace filippov {

/// A curve F(z) = 0 in units of `scale`.
class Arclength {
public:
    Arclength(Equations equations, Vector scale)
        : equations_(std::move(equations)), scale_(std::move(scale)) {}

    const Vector& scale() const { return scale_; }

    /// Unit tangent in scaled unknowns where J is the Jacobian, oriented along `like`.
    Vector tangent(const Matrix& J, const Vector& like) const {
        const Matrix scaled = J * scale_.asDiagonal();
        const Matrix Q = dense::orthogonal(scaled.transpose());
        Vector t = Q.col(Q.cols() - 1);
        return t.dot(like) < 0 ? Vector(-t) : t;
    }
    /// The same at a point.
    bool tangent_at(const Vector& z, const Vector& like, Vector& t) const {
        Vector F;
        Matrix J;
        if (!equations_(z, F, J))
            return false;
        t = tangent(J, like);
        return t.allFinite();
    }

    /// The point of the curve in the plane across `t` at a distance ds from z.
    /// @return if converged, z and J are the new point and the Jacobian there
    Convergence step(Vector& z, Matrix& J, const Vector& t, double ds,
                     double tolerance = 1e-11) const {
        const Vector guess = z + ds * scale_.cwiseProduct(t);
        Vector next = guess;
        const auto bordered = [&](const Vector& u, Vector& F, Matrix& slope) {
            Vector f;
            Matrix j;
            if (!equations_(u, f, j))
                return false;
            F.resize(u.size());
            slope.resize(u.size(), u.size());
            F << f, t.dot((u - guess).cwiseQuotient(scale_));
            slope << j, t.cwiseQuotient(scale_).transpose();
            return true;
        };
        Matrix bordered_J;
        const Convergence c = newton(bordered, scale_, next, bordered_J, tolerance, 8);
        if (c.ok()) {
            z = next;
            J = bordered_J.topRows(bordered_J.rows() - 1);
        }
        return c;
    }

private:
    Equations equations_;
    Vector scale_;
};

/// A point of a curve that was located by a test function.
struct Located {
    Vector z;
    Matrix J;
    Convergence convergence;
    bool ok() const { return convergence.ok(); }
};

/// Where a function changes sign along a curve, between z and the point at a distance ds along t:
/// regula falsi (Illinois) on the distance, each point corrected onto the curve.
/// @param value  of a corrected point and the Jacobian there; f0 and f1 are its values at the ends
/// @return `ok` only if the iteration has come to rest
inline Located zero_along(const Arclength& curve, const Vector& z, const Vector& t, double ds,
                          const std::function<double(const Vector&, const Matrix&)>& value,
                          double f0, double f1) {
    Located best;
    double a = 0, b = ds;
    double moved = std::abs(ds);
    bool done = false;
    for (int k = 0; k < 80 && !done; ++k) {
        const double s = b - f1 * (b - a) / (f1 - f0);
        if (!(s > -std::numeric_limits<double>::infinity()))
            break;
        Located here{z, {}, {}};
        for (const double tolerance : {1e-13, 1e-11}) {
            here.z = z;
            here.convergence = curve.step(here.z, here.J, t, s, tolerance);
            if (here.ok())
                break;
        }
        if (!here.ok())
            break;
        best = here;
        const double f = value(here.z, here.J);
        moved = std::abs(s - b);
        done = moved <= 1e-14 * std::abs(ds) || f == 0;
        if (f * f1 < 0) {
            a = b;
            f0 = f1;
        } else {
            f0 /= 2;
        }
        b = s;
        f1 = f;
    }
    if (!done && !(moved <= 1e-9 * std::abs(ds))) // rounding may keep it from closing further
        best.convergence.status = Status::not_converged;
    return best;
}

} // namespace filippov
