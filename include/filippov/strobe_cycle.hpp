// SPDX-License-Identifier: BSD-3-Clause
// Cycles of the strobe map of a forced system, by Newton's method with exact derivatives.
#pragma once

#include <filippov/maps.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <complex>
#include <optional>
#include <vector>

namespace filippov {

/// A cycle of the strobe map P: an orbit of `period()` forcing periods.
struct StrobeCycle {
    std::vector<Vector> points;                    ///< x, P(x), ..., shape (period, dim)
    std::vector<std::complex<double>> multipliers; ///< of P^period, largest first
    std::vector<Matrix> slopes;                    ///< of P at each point
    double residual = 0;                           ///< |P^period(x) - x|, in units of the picture

    int period() const { return int(points.size()); }
    /// The slope of P^period at one of the points.
    Matrix round(std::size_t first) const {
        Matrix product = slopes[first];
        for (std::size_t k = 1; k < slopes.size(); ++k)
            product = slopes[(first + k) % slopes.size()] * product;
        return product;
    }
    bool stable() const { return !multipliers.empty() && std::abs(multipliers.front()) < 1; }
};

namespace detail {

/// Newton on P^period(x) = x, in units of the picture.
class CycleNewton {
public:
    CycleNewton(const AnySystem& system, const Vector& p, double t0, const Vector& unit)
        : system_(system), p_(p), t0_(t0), unit_(unit) {}

    /// The cycle near x, of the least period; none if Newton does not converge.
    std::optional<StrobeCycle> operator()(Vector x, int period) const {
        for (int k = 0; k < 25; ++k) {
            const Mapped m = strobe(system_, t0_, x, p_, period);
            if (!m.ok() || m.singular)
                return std::nullopt;
            const Eigen::Index n = x.size();
            const Matrix J = m.slope.topLeftCorner(n, n) - Matrix::Identity(n, n);
            const Vector step = J.partialPivLu().solve(m.x - x);
            const double size = scaled(step);
            if (!(size < 1))
                return std::nullopt;
            x -= step;
            if (size < 1e-13)
                return describe(x, period);
            if (size < 1e-11 && k > 6)
                return describe(x, period); // at the floor of rounding
        }
        return std::nullopt;
    }
    double scaled(const Vector& v) const { return v.cwiseQuotient(unit_).norm(); }

private:
    std::optional<StrobeCycle> describe(const Vector& x, int period) const {
        const Eigen::Index n = x.size();
        StrobeCycle c;
        Vector y = x;
        Matrix round = Matrix::Identity(n, n);
        int lost = 0;
        for (int k = 0; k < period; ++k) {
            if (k > 0 && scaled(y - x) < 1e-9)
                break; // a shorter cycle, gone round more than once
            const Mapped m = strobe(system_, t0_, y, p_, 1);
            if (!m.ok() || m.singular)
                return std::nullopt;
            c.points.push_back(y);
            c.slopes.push_back(m.slope.topLeftCorner(n, n));
            round = c.slopes.back() * round;
            lost = std::max(lost, m.lost);
            y = m.x;
        }
        c.residual = scaled(y - x);
        if (!round.allFinite())
            return std::nullopt;
        c.multipliers = multipliers_of(round, lost);
        begin_with_smallest(c);
        return c;
    }
    /// Eigenvalues, of which those are 0 that a slide makes 0: not rounding of it.
    static std::vector<std::complex<double>> multipliers_of(const Matrix& round, int lost) {
        const Eigen::VectorXcd mu = round.eigenvalues();
        std::vector<std::complex<double>> sorted(mu.begin(), mu.end());
        std::sort(sorted.begin(), sorted.end(),
                  [](const auto& a, const auto& b) { return std::abs(a) > std::abs(b); });
        const auto known = std::size_t(std::max(int(sorted.size()) - lost, 0));
        // half of a pair that loses the other is real
        if (known > 0 && known < sorted.size() && sorted[known] == std::conj(sorted[known - 1]))
            sorted[known - 1] = sorted[known - 1].real();
        std::fill(sorted.begin() + std::ptrdiff_t(known), sorted.end(), 0.0);
        return sorted;
    }
    static void begin_with_smallest(StrobeCycle& c) {
        const auto less = [](const Vector& a, const Vector& b) {
            return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
        };
        const auto first = std::min_element(c.points.begin(), c.points.end(), less);
        const auto by = first - c.points.begin();
        std::rotate(c.points.begin(), c.points.begin() + by, c.points.end());
        std::rotate(c.slopes.begin(), c.slopes.begin() + by, c.slopes.end());
    }

    const AnySystem& system_;
    const Vector p_;
    const double t0_;
    const Vector unit_;
};

} // namespace detail

} // namespace filippov
