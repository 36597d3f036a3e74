// SPDX-License-Identifier: BSD-3-Clause
// Intervals that hold every value a formula can have: what tells that 2 + sin(x) has no zero.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace filippov {

/// Numbers from low to high; by default all of them. NaN is in every range: a formula may be
/// undefined anywhere.
struct ValueRange {
    static constexpr double infinite = std::numeric_limits<double>::infinity();
    double low = -infinite, high = infinite;
};

namespace detail::values {

/// Sums, products and quotients of doubles round monotonically: their ranges need no room for it.
/// What is no number (inf - inf) may be anything.
inline ValueRange range_from(double low, double high) {
    return {std::isnan(low) ? -ValueRange::infinite : low,
            std::isnan(high) ? ValueRange::infinite : high};
}
/// With room for the rounding of a function of the standard library.
inline ValueRange roomy(double low, double high) {
    constexpr double room = 8 * std::numeric_limits<double>::epsilon();
    return range_from(low - room * std::abs(low), high + room * std::abs(high));
}
inline ValueRange negative(const ValueRange& a) { return {-a.high, -a.low}; }
inline ValueRange sum(const ValueRange& a, const ValueRange& b) {
    return range_from(a.low + b.low, a.high + b.high);
}
inline ValueRange product(const ValueRange& a, const ValueRange& b) {
    const auto times = [](double u, double v) { return u == 0 || v == 0 ? 0 : u * v; };
    const auto [low, high] = std::minmax(
        {times(a.low, b.low), times(a.low, b.high), times(a.high, b.low), times(a.high, b.high)});
    return {low, high};
}
inline ValueRange quotient(const ValueRange& a, const ValueRange& b) {
    if (!(b.low > 0) && !(b.high < 0))
        return {};
    const ValueRange rounded_twice = product(a, {1 / b.high, 1 / b.low});
    return roomy(rounded_twice.low, rounded_twice.high);
}
inline ValueRange hull(const ValueRange& a, const ValueRange& b) {
    return {std::min(a.low, b.low), std::max(a.high, b.high)};
}
inline ValueRange magnitude(const ValueRange& a) {
    const double most = std::max(std::abs(a.low), std::abs(a.high));
    const double least = a.low > 0 ? a.low : a.high < 0 ? -a.high : 0;
    return {least, most};
}
/// Of a function that only rises.
template <class F> ValueRange rising(const ValueRange& a, F f) {
    return roomy(f(a.low), f(a.high));
}
/// Of a to the n-th.
inline ValueRange power(const ValueRange& a, int n) {
    if (n < 0)
        return quotient({1, 1}, power(a, -n));
    const auto f = [n](double v) { return std::pow(v, n); };
    return n % 2 == 0 ? rising(magnitude(a), f) : rising(a, f);
}

} // namespace detail::values

} // namespace filippov
