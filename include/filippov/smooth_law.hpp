// SPDX-License-Identifier: BSD-3-Clause
// The functions that replace a switch.
#pragma once

#include <filippov/scalar.hpp>

#include <cmath>
#include <numbers>

namespace filippov {

/// By what sign(h) is replaced: an odd function of u = c1 h that rises to 1.
enum class SmoothLaw : unsigned char {
    arctan,     ///< (2/pi) atan(u): the chapter's. It nears 1 like 1 - 2/(pi u).
    tanh,       ///< tanh(u), which nears 1 exponentially
    saturation, ///< u, cut at -1 and 1: exact beyond |h| = 1/c1, where it has corners
};

/// s(u) of a law.
/// @source (4.30) for the arctan
template <Scalar S> S smooth_sign(SmoothLaw law, const S& u) {
    using std::atan, std::tanh;
    switch (law) {
    case SmoothLaw::arctan:
        return S(2 / std::numbers::pi_v<Real<S>>) * atan(u);
    case SmoothLaw::tanh:
        return tanh(u);
    default:
        return select(u > S(1), S(1), select(u < S(-1), S(-1), u));
    }
}

} // namespace filippov
