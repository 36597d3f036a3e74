// SPDX-License-Identifier: BSD-3-Clause
// Lines through points, spreads, and random numbers.
#pragma once

#include <filippov/core/refuse.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <span>

namespace filippov {

namespace detail {

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// In [0, 1), the same numbers on every platform, which a standard distribution does not promise.
inline double uniform(std::mt19937_64& random) {
    return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// A line through weighted points.
struct Line {
    double slope = unknown;
    double intercept = unknown;
    double spread = 0; ///< sum of w (x - mean)^2: with weights 1/variance, 1/variance of the slope
    double chi2 = 0;   ///< sum of w (y - line)^2
};

/// Weighted least squares. Without two different x there is no line.
inline Line fit_line(std::span<const double> x, std::span<const double> y,
                     std::span<const double> w) {
    Line line;
    const auto [least, largest] = std::minmax_element(x.begin(), x.end());
    if (x.empty() || !(*least < *largest))
        return line;
    double weight = 0, x_mean = 0, y_mean = 0, product = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        weight += w[i];
        x_mean += w[i] * x[i];
        y_mean += w[i] * y[i];
    }
    x_mean /= weight;
    y_mean /= weight;
    for (std::size_t i = 0; i < x.size(); ++i) {
        line.spread += w[i] * (x[i] - x_mean) * (x[i] - x_mean);
        product += w[i] * (x[i] - x_mean) * (y[i] - y_mean);
    }
    line.slope = product / line.spread;
    line.intercept = y_mean - line.slope * x_mean;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double off = y[i] - y_mean - line.slope * (x[i] - x_mean);
        line.chi2 += w[i] * off * off;
    }
    return line;
}

/// Probability that chi^2 of so many degrees of freedom exceeds a value: for whole degrees a finite
/// sum, of (chi2/2)^k/Gamma(k + 1) over k = 0, 1, ... or 1/2, 3/2, ... below degrees/2.
inline double chi2_probability(double chi2, int degrees) {
    const double half = chi2 / 2;
    double sum = degrees % 2 == 0 ? 0 : std::erfc(std::sqrt(half));
    for (double k = degrees % 2 == 0 ? 0 : 0.5; k < degrees / 2.0; k += 1)
        sum += half > 0 ? std::exp(k * std::log(half) - half - std::lgamma(k + 1)) : k == 0;
    return std::min(sum, 1.0);
}

/// Standard deviation of values that are all there are.
inline double deviation(std::span<const double> values) {
    if (values.empty())
        return unknown;
    const auto n = static_cast<double>(values.size());
    double mean = 0, square = 0;
    for (const double v : values)
        mean += v / n;
    for (const double v : values)
        square += (v - mean) * (v - mean) / n;
    return std::sqrt(square);
}

} // namespace detail

/// Where the binomial probability of at most k successes in m falls to 1 - confidence: the exact
/// one-sided upper bound of a probability.
///
/// @pre     0 <= k <= m, 1/2 <= confidence < 1
/// @cost    O(k), some sixty times
/// @source  Clopper and Pearson, Biometrika 26 (1934)
inline double clopper_pearson_upper(int k, int m, double confidence = 0.95) {
    if (!(k >= 0 && k <= m))
        detail::refuse("k", k, "expected 0 <= k <= m");
    if (!(confidence >= 0.5 && confidence < 1))
        detail::refuse("confidence", confidence, "expected 1/2 <= confidence < 1");
    if (k == m)
        return 1;
    double log_choose = 0;
    for (int i = 0; i < k; ++i)
        log_choose += std::log((m - i) / (i + 1.0));
    // Above k/m the terms fall from i = k on, so those that no longer count can be left out.
    const auto at_most = [&](double p) {
        double term = std::exp(log_choose + k * std::log(p) + (m - k) * std::log1p(-p)), sum = 0;
        for (int i = k; i >= 0 && term > 1e-18 * sum; --i) {
            sum += term;
            term *= i / (m - i + 1.0) * ((1 - p) / p);
        }
        return sum;
    };
    double low = double(k) / m, high = 1;
    for (int i = 0; i < 100; ++i) {
        const double p = low + (high - low) / 2;
        if (!(p > low && p < high))
            break;
        (at_most(p) > 1 - confidence ? low : high) = p;
    }
    return high;
}

} // namespace filippov
