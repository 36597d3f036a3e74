// SPDX-License-Identifier: BSD-3-Clause
// The size of a first step.
#pragma once

#include <filippov/run/place.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace filippov {

/// First step size by the field of the current mode: Hairer, Norsett, Wanner I, II.4, in the
/// system's own unit of time, whatever the user's is: the time in which the field, or its
/// change, makes as much as there is.
/// @param span   how far the run goes, > 0
/// @param order  of the method
template <class Sys, class S>
S estimate_first_step(const Place<Sys, S>& at, const S& span, int order) {
    using std::pow;
    using std::sqrt;
    using X = State<Sys, S>;
    constexpr S infinity = std::numeric_limits<S>::infinity();
    const S forward = S(at.direction);
    const X f0 = at.field(at.clock.local, at.x);
    const S d0 = at.norm(at.x), d1 = at.norm(f0);
    const bool some = d0 >= S(1e-5) && d0 < infinity;
    S h0 = some && d1 > S(0) ? S(0.01) * std::min(S(d0 / d1), span) : S(1e-6) * span, d2(0);
    for (int k = 0; k < 8; ++k) { // an Euler step may leave the domain of the field
        const X y = at.x + forward * h0 * f0;
        const X f1 = at.field(S(at.clock.local + forward * h0), y);
        d2 = at.norm(X(f1 - f0)) / h0;
        if (d2 < infinity)
            break;
        h0 /= S(10);
    }
    S unit = std::min(S(d0 / d1), S(sqrt(d0 / d2)));
    // a field of rounding size has no unit (over no time at all, any field is as small)
    const bool still = d1 * span < S(1e-13) * d0 && span > S(1e3) * at.resolution();
    if (!some || still || !(unit < infinity)) {
        unit = S(1e-4) * span;
        if (d2 * span <= S(1e-9) * d1) // what moves steadily may soon be somewhere
            unit = std::min(unit, S(S(1e3) / d1));
    }
    const S most = std::max(S(d1 * unit), S(d2 * unit * unit));
    const S h = unit * std::min(S(1), S(pow(S(0.01) / most, S(1) / S(order))));
    // With no absolute tolerance at x = 0 nothing is small: the error test will find the size.
    return h > S(0) && h < infinity ? h : S(1e-6) * span;
}

} // namespace filippov
