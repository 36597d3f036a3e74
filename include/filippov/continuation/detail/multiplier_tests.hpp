// SPDX-License-Identifier: BSD-3-Clause
// Test functions of Floquet multipliers: they vanish where one of them passes the unit circle.
#pragma once

#include <filippov/orbits/floquet.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

namespace filippov {

namespace detail {

/// Beyond this no digit of the other multipliers is left, and few of the orbit's.
inline constexpr double largest_multiplier = 1e12;

/// The multipliers without the 1 that an autonomous system has anyway.
inline Multipliers nontrivial(Multipliers multipliers, bool forced) {
    const auto one = std::find(multipliers.begin(), multipliers.end(), 1.0);
    if (!forced && one != multipliers.end())
        multipliers.erase(one);
    return multipliers;
}
/// The product of (mu - border) over these: border 1 for a fold, -1 for a flip.
inline double border_test(const Multipliers& multipliers, double border, bool forced) {
    std::complex<double> product = 1;
    for (const auto& m : nontrivial(multipliers, forced))
        product *= m - border;
    return product.real();
}
inline double flip_test(const Multipliers& multipliers, bool forced) {
    return border_test(multipliers, -1, forced);
}
/// |mu|^2 - 1 of the complex pair nearest to the unit circle; 1 if there is none.
inline double torus_test(const Multipliers& multipliers) {
    double best = 1;
    for (const auto& m : multipliers)
        if (m.imag() > 0 && std::abs(std::norm(m) - 1) < std::abs(best))
            best = std::norm(m) - 1;
    return best;
}
/// Of the multiplier nearest to 1.
inline double distance_to_one(const Multipliers& multipliers, bool forced) {
    double best = std::numeric_limits<double>::infinity();
    for (const auto& m : nontrivial(multipliers, forced))
        best = std::min(best, std::abs(m - 1.0));
    return best;
}

} // namespace detail

} // namespace filippov
