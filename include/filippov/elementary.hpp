// SPDX-License-Identifier: BSD-3-Clause
// cos and sin that inline: a forcing is most of the cost of a small field, and a call into the
// mathematics library keeps the stages of a step from overlapping.
#pragma once

#include <filippov/config.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

namespace filippov::elementary {

namespace detail {

/// Digits of an argument of cos or sin beyond the nearest multiple of pi: x = n pi + r,
/// |r| <= pi/2, and the sign (-1)^n as a sign bit.
struct Reduced {
    double r;
    std::uint64_t sign;
};
/// For |x| < 1e5: three parts of pi, the first two products are exact.
FILIPPOV_INLINE Reduced reduce(double x) {
    constexpr double magic = 6755399441055744.0; // 1.5 * 2^52: adding it rounds to an integer
    const double rounded = x * 0.31830988618379067154 + magic;
    const double n = rounded - magic;
    const double r = ((x - n * 3.14159265346825122833e+00) - n * 1.21542010126079319e-10) -
                     n * 4.04453249759190132e-21;
    return {r, std::bit_cast<std::uint64_t>(rounded) << 63};
}
FILIPPOV_INLINE double with_sign(double value, std::uint64_t sign) {
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) ^ sign);
}

/// c[0] - c[1] z + c[2] z^2 - ... + c[8] z^8, in few dependent steps.
FILIPPOV_INLINE double alternating(const double (&c)[9], double z) {
    const double z2 = z * z, z4 = z2 * z2;
    const double low = (c[0] - z * c[1]) + z2 * (c[2] - z * c[3]);
    const double high = (c[4] - z * c[5]) + z2 * (c[6] - z * c[7]);
    return low + z4 * (high + z4 * c[8]);
}

/// The Taylor polynomials, degree 20 and 21, have a remainder below 2e-17 on [-pi/2, pi/2]. One
/// polynomial and no branch: a choice between two of them, as in libm, is mispredicted every other
/// stage.
FILIPPOV_INLINE double cos_kernel(double r) {
    constexpr double c[9] = {1.0 / 24,
                             1.0 / 720,
                             1.0 / 40320,
                             1.0 / 3628800,
                             1.0 / 479001600,
                             1.0 / 87178291200,
                             1.0 / 20922789888000,
                             1.0 / 6402373705728000,
                             1.0 / 2432902008176640000};
    const double z = r * r;
    return (1.0 - 0.5 * z) + z * z * alternating(c, z);
}
FILIPPOV_INLINE double sin_kernel(double r) {
    constexpr double c[9] = {1.0 / 120,
                             1.0 / 5040,
                             1.0 / 362880,
                             1.0 / 39916800,
                             1.0 / 6227020800,
                             1.0 / 1307674368000,
                             1.0 / 355687428096000,
                             1.0 / 121645100408832000,
                             1.0 / 51090942171709440000.0};
    const double z = r * r;
    return r + r * z * (z * alternating(c, z) - 1.0 / 6);
}

} // namespace detail

/// cos(x), within 2 ulp of 1 in absolute error; beyond |x| = 1e5, and for NaN, the library's.
FILIPPOV_INLINE double cos(double x) {
    if (!(std::abs(x) < 1e5)) [[unlikely]]
        return std::cos(x);
    const auto [r, sign] = detail::reduce(x);
    return detail::with_sign(detail::cos_kernel(r), sign);
}
/// sin(x), as cos.
FILIPPOV_INLINE double sin(double x) {
    if (!(std::abs(x) < 1e5)) [[unlikely]]
        return std::sin(x);
    const auto [r, sign] = detail::reduce(x);
    return detail::with_sign(detail::sin_kernel(r), sign);
}

// Other scalars have their own; a model writes cos(omega * t) and gets the right one.
inline float cos(float x) { return std::cos(x); }
inline float sin(float x) { return std::sin(x); }
inline long double cos(long double x) { return std::cos(x); }
inline long double sin(long double x) { return std::sin(x); }

} // namespace filippov::elementary
