// SPDX-License-Identifier: BSD-3-Clause
// Whether a slide has lost its surface: it jumped in a step, or ran away faster than guards show.
#pragma once

#include <filippov/run/place.hpp>

#include <algorithm>
#include <array>

namespace filippov {

namespace detail {

/// How rough h_j is over changes of this size along its gradient: the largest fourth difference, on
/// that side of the state where it is less, since h may jump beside the state. Where large terms
/// cancel within h, its rounding is far more than that of the state.
template <class Sys, class S>
FILIPPOV_COLD S roughness_of_h(const Place<Sys, S>& at, int j, const S& size) {
    using std::abs;
    using X = State<Sys, S>;
    const S t = at.clock.local;
    X across = grad_h(at.sys, j, t, at.x, at.p).cwiseProduct(at.scale); // in units of the tolerance
    across = (across * (size / across.squaredNorm())).cwiseProduct(at.scale);
    std::array<S, 2> largest{S(0), S(0)};
    for (std::size_t side = 0; side < 2; ++side) {
        std::array<S, 9> h;
        for (int k = 0; k < 9; ++k) {
            const S away = S(side == 0 ? -k : k) / S(8);
            h[std::size_t(k)] = switching(at.sys, t, X(at.x + away * across), at.p)[j];
        }
        for (std::size_t k = 0; k + 4 < h.size(); ++k)
            largest[side] = std::max(largest[side], S(abs(h[k] - S(4) * h[k + 1] + S(6) * h[k + 2] -
                                                          S(4) * h[k + 3] + h[k + 4])));
    }
    return std::min(largest[0], largest[1]);
}

} // namespace detail

/// What h_j may be off zero by where a slide on it has ended a step: ten times what a step may err.
/// @param lengths  what it lets each component err
template <class Sys, class S>
FILIPPOV_COLD S slide_band(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                           const Params<Sys, S>& p, const State<Sys, S>& lengths) {
    return S(1e3) * rounding_band(sys, j, t, x, p) + S(10) * change_over(sys, j, t, x, p, lengths);
}

/// The surface that a step of a slide has lost: the step's end lies off it by more than ten times
/// what the step may err. -1: none.
///
/// @param raw     the end of the step before it was put on the surface
/// @param beside  the step may have begun beside its surface
/// @cost one h; a gradient where that is not zero; 18 h where the surface seems lost
template <class Sys, class S>
FILIPPOV_COLD int lost_surface(const Place<Sys, S>& at, const State<Sys, S>& raw, const S& dt,
                               bool beside) {
    using std::abs;
    constexpr int M = surfaces_v<Sys>;
    const S t = at.clock.local + dt;
    Vec<S, M> off = switching(at.sys, t, raw, at.p);
    if (beside)
        off -= switching(at.sys, at.clock.local, at.x, at.p);
    for (int j = 0; j < M; ++j) {
        const S size = abs(off[j]);
        if (at.mode[j] != 0 || size == S(0))
            continue;
        if (!(size <= slide_band(at.sys, j, t, raw, at.p, at.scale_of_step(raw, dt))) &&
            !(size <= S(8) * detail::roughness_of_h(at, j, size)))
            return j;
    }
    return -1;
}

} // namespace filippov
