// SPDX-License-Identifier: BSD-3-Clause
// Cycles of the strobe map of a forced system, by Newton's method with exact derivatives.
#pragma once

#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/discrete.hpp>
#include <filippov/orbits/maps.hpp>

#include <algorithm>
#include <complex>
#include <optional>
#include <utility>
#include <vector>

namespace filippov {

/// A cycle of the strobe map P: an orbit of `period()` forcing periods.
struct StrobeCycle {
    std::vector<Vector> points;                    ///< x, P(x), ..., shape (period, dim)
    std::vector<std::complex<double>> multipliers; ///< of P^period, largest first; 1 of clocks
    std::vector<Matrix> slopes;                    ///< of P at each point
    double residual = 0;                           ///< |P^period(x) - x|, in units of the picture
    DiscretePart part{}; ///< which components are clocks and latches, on the way round
    double growth = 0;   ///< the largest |multiplier| of the other components

    int period() const { return int(points.size()); }
    /// The slope of P^period at one of the points.
    Matrix round(std::size_t first) const {
        Matrix product = slopes[first];
        for (std::size_t k = 1; k < slopes.size(); ++k)
            product = slopes[(first + k) % slopes.size()] * product;
        return product;
    }
    /// It attracts, but for what the clocks show, which nothing changes.
    bool stable() const { return !multipliers.empty() && growth < 1; }
};

namespace detail {

/// Newton on P^period(x) = x, in units of the picture.
class CycleNewton {
public:
    /// @param constant  components of constant rate, which may be clocks and latches
    CycleNewton(const AnySystem& system, const Vector& p, double t0, const Vector& unit,
                std::vector<int> constant)
        : system_(system), p_(p), t0_(t0), unit_(unit), constant_(std::move(constant)) {}

    /// The cycle near x, of the least period; none if Newton does not converge.
    std::optional<StrobeCycle> operator()(Vector x, int period) const {
        for (int k = 0; k < 25; ++k) {
            const Mapped m = strobe(system_, t0_, x, p_, period);
            if (!m.ok() || m.singular)
                return std::nullopt;
            const Vector step = newton_step(m, x);
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
    /// What is to be taken from x. Latches are what the map makes them; clocks come back by
    /// themselves, or it is no cycle.
    Vector newton_step(const Mapped& m, const Vector& x) const {
        const Eigen::Index n = x.size();
        const Matrix M = m.slope.topLeftCorner(n, n);
        const DiscretePart part = discrete_part(M, constant_);
        Vector step = x - m.x;
        if (part.rest.empty())
            return step;
        const auto k = Eigen::Index(part.rest.size());
        const Matrix J = part.of_rest(M) - Matrix::Identity(k, k);
        const Vector of_rest = dense::solve(J, part.of_rest(Vector(m.x - x)));
        step(part.rest) = of_rest;
        return step;
    }
    std::optional<StrobeCycle> describe(const Vector& x, int period) const {
        const Eigen::Index n = x.size();
        StrobeCycle c;
        c.part.discrete = constant_;
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
            c.part = discrete_part(c.slopes.back(), c.part.discrete);
            round = c.slopes.back() * round;
            lost = std::max(lost, m.lost);
            y = m.x;
        }
        c.residual = scaled(y - x);
        if (!round.allFinite())
            return std::nullopt;
        find_multipliers(c, round, lost);
        begin_with_smallest(c);
        return c;
    }
    static void find_multipliers(StrobeCycle& c, const Matrix& round, int lost) {
        c.part = discrete_part(round, c.part.discrete);
        c.multipliers = multipliers_of(c.part.of_rest(round), lost);
        c.growth = c.multipliers.empty() ? 0 : std::abs(c.multipliers.front());
        for (const auto& each : c.part.multipliers())
            c.multipliers.push_back(each);
        std::stable_sort(c.multipliers.begin(), c.multipliers.end(), larger);
    }
    static bool larger(const std::complex<double>& a, const std::complex<double>& b) {
        return std::abs(a) > std::abs(b);
    }
    /// Eigenvalues, of which those are 0 that a slide makes 0: not rounding of it.
    static std::vector<std::complex<double>> multipliers_of(const Matrix& round, int lost) {
        if (round.size() == 0)
            return {};
        const Eigen::VectorXcd mu = dense::eigenvalues(round);
        std::vector<std::complex<double>> sorted(mu.begin(), mu.end());
        std::sort(sorted.begin(), sorted.end(), larger);
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
    const std::vector<int> constant_;
};

} // namespace detail

} // namespace filippov
