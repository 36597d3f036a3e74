// SPDX-License-Identifier: BSD-3-Clause
// cos and sin that inline: a forcing is most of the cost of a small field, and a call into the
// mathematics library keeps the stages of a step from overlapping.
#pragma once

#include <filippov/core/scalar.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

namespace filippov::elementary {

namespace detail {

/// value with its sign changed if `rounded`, an integer plus 1.5 * 2^52, is odd.
FILIPPOV_INLINE double flip_if_odd(double value, double rounded) {
    const std::uint64_t sign = std::bit_cast<std::uint64_t>(rounded) << 63;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) ^ sign);
}

/// Digits of an argument of cos or sin beyond the nearest multiple of pi: x = n pi + r,
/// |r| <= pi/2.
template <class S> struct Reduced {
    S r;
    S rounded; ///< n + 1.5 * 2^52
};
/// For |x| < 1e5: three parts of pi, the first two products are exact.
template <class S> FILIPPOV_INLINE Reduced<S> reduce(const S& x) {
    const S magic(6755399441055744.0); // 1.5 * 2^52: adding it rounds to an integer
    const S rounded = fused(x, S(0.31830988618379067154), magic);
    const S n = rounded - magic;
    const S high = fused(n, S(-3.14159265346825122833e+00), x);
    const S middle = fused(n, S(-1.21542010126079319e-10), high);
    return {fused(n, S(-4.04453249759190132e-21), middle), rounded};
}

/// c[0] + c[1] z + ... + c[6] z^6, in few dependent steps.
template <class S> FILIPPOV_INLINE S polynomial(const double (&c)[7], const S& z) {
    const S z2 = z * z, z4 = z2 * z2;
    const S low = fused(z2, fused(z, S(c[3]), S(c[2])), fused(z, S(c[1]), S(c[0])));
    const S high = fused(z2, S(c[6]), fused(z, S(c[5]), S(c[4])));
    return fused(z4, high, low);
}

/// Minimax on [-pi/2, pi/2] by Remez' algorithm in 60 digits; errors below 6e-18. One polynomial
/// and no branch: a choice between two of them, as in libm, is mispredicted every other stage.
template <class S> FILIPPOV_INLINE S near_cos(const S& x) {
    constexpr double c[7] = {0.041666666666665832922,    -0.0013888888888830049182,
                             0.000024801587285783897834, -2.7557317068510353633e-7,
                             2.0876592592490197749e-9,   -1.1463635437296011191e-11,
                             4.6161350494684534428e-14};
    const Reduced<S> a = reduce(x);
    const S z = a.r * a.r;
    return flip_if_odd(fused(S(z * z), polynomial(c, z), fused(S(-0.5), z, S(1))), a.rounded);
}
template <class S> FILIPPOV_INLINE S near_sin(const S& x) {
    constexpr double c[7] = {0.008333333333333264892,   -0.00019841269841226746023,
                             2.7557319213372026478e-6,  -2.5052107033526835665e-8,
                             1.6058946303260211041e-10, -7.6431358274933478654e-13,
                             2.7224817515841689096e-15};
    const Reduced<S> a = reduce(x);
    const S z = a.r * a.r;
    const S tail = fused(z, polynomial(c, z), S(-1.0 / 6));
    return flip_if_odd(fused(S(a.r * z), tail, a.r), a.rounded);
}

/// Beyond this the library's functions reduce the argument.
inline constexpr double near_bound = 1e5;

} // namespace detail

/// cos(x), within 2 ulp of 1 in absolute error; beyond |x| = 1e5, and for NaN, the library's.
FILIPPOV_INLINE double cos(double x) {
    if (!(std::abs(x) < detail::near_bound)) [[unlikely]]
        return std::cos(x);
    return detail::near_cos(x);
}
/// sin(x), as cos.
FILIPPOV_INLINE double sin(double x) {
    if (!(std::abs(x) < detail::near_bound)) [[unlikely]]
        return std::sin(x);
    return detail::near_sin(x);
}

// Other scalars have their own; a model writes cos(omega * t) and gets the right one.
inline float cos(float x) { return std::cos(x); }
inline float sin(float x) { return std::sin(x); }
inline long double cos(long double x) { return std::cos(x); }
inline long double sin(long double x) { return std::sin(x); }

} // namespace filippov::elementary
