// SPDX-License-Identifier: BSD-3-Clause
// The functions that replace a switch.
#pragma once

#include <filippov/core/scalar.hpp>

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

/// Takes `largest` down to what a step may err near a layer, where u = c1 h goes from u0 to u1: a
/// tenth of the distance from the layer's middle where the step is nearest to it, and of the layer
/// there. A step that errs by more may pass the layer, or leave it, without knowing. (From one side
/// of a layer to the other and back a method can step for ever.)
/// @param gradient  of u by the state
template <class S, int N>
void limit_to_layer(Vec<S, N>& largest, const S& u0, const S& u1, const Vec<S, N>& gradient) {
    using std::abs;
    const S a = abs(u0), b = abs(u1);
    const S nearest = select(u0 * u1 > S(0), select(a < b, a, b), S(0)) + S(1);
    for (int i = 0; i < N; ++i) {
        const S share = S(0.1) * nearest / abs(gradient[i]);
        largest[i] = select(share < largest[i], share, largest[i]);
    }
}

} // namespace filippov
