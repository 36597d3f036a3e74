// SPDX-License-Identifier: BSD-3-Clause
// Scalars and the fixed-size vectors made of them.
#pragma once

#include <filippov/core/config.hpp>

#include <Eigen/Core>

#include <cmath>
#include <concepts>
#include <limits>
#include <utility>

namespace filippov {

/// What the engine computes with: float, double, long double, a Taylor polynomial, a dual
/// number. `semiregular`, not `regular`: a lane's == is no bool.
template <class S>
concept Scalar = std::semiregular<S> && requires(S a, const S& b) {
    S(1);
    S(0.5);
    { a + b } -> std::convertible_to<S>;
    { a - b } -> std::convertible_to<S>;
    { a* b } -> std::convertible_to<S>;
    { a / b } -> std::convertible_to<S>;
    { -b } -> std::convertible_to<S>;
    a += b;
    a -= b;
};

/// The plain value of a scalar: what decisions look at.
template <std::floating_point S> S value_of(const S& x) { return x; }

/// The floating-point type under a scalar.
template <class S> using Real = decltype(value_of(std::declval<const S&>()));

/// True of scalars that fit into registers: code of theirs is unrolled.
template <class S> inline constexpr bool is_plain = std::floating_point<S>;

/// True of lanes: what counts is the number of operations, not how they wait for each other.
template <class S> inline constexpr bool is_wide = false;

/// Column vector of N scalars.
template <class S, int N> using Vec = Eigen::Matrix<S, N, 1>;

/// Matrix of R x C scalars.
template <class S, int R, int C> using Mat = Eigen::Matrix<S, R, C>;

/// Spacing of the floating-point numbers at 1.
template <std::floating_point S> inline constexpr S epsilon = std::numeric_limits<S>::epsilon();

/// Distance from |t| to the next floating-point number, or up to twice that; at least the smallest
/// normal number.
template <std::floating_point S> S ulp(S t) {
    return std::max(epsilon<S> * std::abs(t), std::numeric_limits<S>::min());
}

/// a b + c, rounded once where the machine can do that as fast as twice.
FILIPPOV_INLINE double fused(double a, double b, double c) {
#if defined(__FP_FAST_FMA)
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}
template <class S> FILIPPOV_INLINE S fused(const S& a, const S& b, const S& c) { return a * b + c; }

/// a if m, else b: what a kernel writes that may run in lanes.
template <class S> FILIPPOV_INLINE S select(bool m, const S& a, const S& b) { return m ? a : b; }

FILIPPOV_INLINE bool any(bool m) { return m; }

/// a / b where lanes may take the reciprocal of a number, rounded once more: in what a comparison
/// follows.
template <std::floating_point S> FILIPPOV_INLINE S ratio(S a, S b) { return a / b; }

/// True if every component is finite. Written on bits of arithmetic so that it vectorises: x*0 is
/// 0 for finite x and NaN otherwise.
template <class S, int N> FILIPPOV_INLINE bool all_finite(const Vec<S, N>& x) {
    S sum(0);
    for (int i = 0; i < N; ++i)
        sum += x[i] * S(0);
    return sum == S(0);
}

} // namespace filippov
