// SPDX-License-Identifier: BSD-3-Clause
// cos and sin that inline: a forcing is most of the cost of a small field, and a call into the
// mathematics library keeps the stages of a step from overlapping.
#pragma once

#include <filippov/config.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

namespace filippov {

namespace detail {

/// sin(r) and cos(r) for |r| <= pi/4.
/// @source polynomials of fdlibm (k_sin, k_cos), Sun Microsystems 1993, below 0.6 ulp
FILIPPOV_INLINE double sin_kernel(double r) {
    const double z = r * r;
    const double p =
        -1.66666666666666324348e-01 +
        z * (8.33333333332248946124e-03 +
             z * (-1.98412698298579493134e-04 +
                  z * (2.75573137070700676789e-06 +
                       z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))));
    return r + r * z * p;
}
FILIPPOV_INLINE double cos_kernel(double r) {
    const double z = r * r;
    const double p =
        4.16666666666666019037e-02 +
        z * (-1.38888888888741095749e-03 +
             z * (2.48015872894767294178e-05 +
                  z * (-2.75573143513906633035e-07 +
                       z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))));
    const double half = 0.5 * z, w = 1.0 - half;
    return w + (((1.0 - w) - half) + z * z * p);
}

/// cos(x - shift pi/2) for |x| < 1e5, to about one ulp of 1: three-part reduction by multiples of
/// pi/2 whose first two parts are exact, both polynomials, one selected. No branch.
FILIPPOV_INLINE double cos_shifted(double x, int shift) {
    constexpr double magic = 6755399441055744.0; // 1.5 * 2^52: adding it rounds to an integer
    const double rounded = x * 0.63661977236758134308 + magic;
    const double n = rounded - magic;
    const auto quadrant = static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(rounded)) +
                          static_cast<std::uint32_t>(4 - shift);
    const double r = ((x - n * 1.57079632673412561417e+00) - n * 6.07710050630396597660e-11) -
                     n * 2.02226624871116645580e-21;
    const double c = cos_kernel(r), s = sin_kernel(r);
    const double value = (quadrant & 1u) != 0 ? s : c;
    return ((quadrant + 1u) & 2u) != 0 ? -value : value;
}

} // namespace detail

/// cos(x), within 2 ulp of 1 in absolute error; beyond |x| = 1e5, and for NaN, the library's.
FILIPPOV_INLINE double cos(double x) {
    return std::abs(x) < 1e5 ? detail::cos_shifted(x, 0) : std::cos(x);
}
/// sin(x), as cos.
FILIPPOV_INLINE double sin(double x) {
    return std::abs(x) < 1e5 ? detail::cos_shifted(x, 1) : std::sin(x);
}

// Other scalars have their own; a model writes cos(omega * t) and gets the right one.
inline float cos(float x) { return std::cos(x); }
inline float sin(float x) { return std::sin(x); }
inline long double cos(long double x) { return std::cos(x); }
inline long double sin(long double x) { return std::sin(x); }

} // namespace filippov
