// SPDX-License-Identifier: BSD-3-Clause
// Whether a slide has lost its surface, which jumped in a step, or ran away faster than guards
// show.
#pragma once

#include <filippov/guards.hpp>
#include <filippov/place.hpp>

#include <algorithm>
#include <array>

namespace filippov {

namespace detail {

/// How rough h_j is over changes of this size: fourth differences along its gradient. Where large
/// terms cancel within it, its rounding is far more than that of the state.
template <class Sys, class S>
FILIPPOV_COLD S roughness_of_h(const Place<Sys, S>& at, int j, const S& size) {
    using std::abs;
    using X = State<Sys, S>;
    const S t = at.clock.local;
    X across = grad_h(at.sys, j, t, at.x, at.p).cwiseProduct(at.scale); // in units of the tolerance
    across = (across * (size / across.squaredNorm())).cwiseProduct(at.scale);
    std::array<S, 9> h;
    for (int k = 0; k < 9; ++k)
        h[std::size_t(k)] = switching(at.sys, t, X(at.x + S(k - 4) / S(4) * across), at.p)[j];
    S largest(0);
    for (std::size_t k = 0; k + 4 < h.size(); ++k)
        largest = std::max(
            largest, S(abs(h[k] - S(4) * h[k + 1] + S(6) * h[k + 2] - S(4) * h[k + 3] + h[k + 4])));
    return largest;
}

} // namespace detail

/// The surface that a step of a slide has lost: the step's end lies off it by more than ten times
/// what the step may err. -1: none.
///
/// @param raw    the end of the step before it was put on the surface
/// @param first  of the steps of a forced mode, which may begin beside its surface
/// @cost two h and a gradient; nine h where it seems lost
template <class Sys, class S>
FILIPPOV_COLD int lost_surface(const Place<Sys, S>& at, const State<Sys, S>& raw, const S& dt,
                               bool first) {
    using std::abs;
    constexpr int M = surfaces_v<Sys>;
    const S t0 = at.clock.local, t1 = t0 + dt;
    const Vec<S, M> before = switching(at.sys, t0, at.x, at.p),
                    after = switching(at.sys, t1, raw, at.p);
    const State<Sys, S> lengths = at.scale_of_step(raw, dt);
    for (int j = 0; j < M; ++j) {
        if (at.mode[j] != 0)
            continue;
        const S band = S(1e3) * rounding_band(at.sys, j, t1, raw, at.p) +
                       S(10) * change_over(at.sys, j, t1, raw, at.p, lengths);
        const S off = abs(first ? S(after[j] - before[j]) : S(after[j]));
        if (!(off <= band) && !(off <= S(8) * detail::roughness_of_h(at, j, off)))
            return j;
    }
    return -1;
}

/// The guard by which a slide has ended at (t, x), -1: none.
template <class Sys, class S>
FILIPPOV_COLD int ended_slide(const Place<Sys, S>& at, const S& t, const State<Sys, S>& x) {
    constexpr int M = surfaces_v<Sys>;
    const S beyond = s_max(at.sys, at.p) - S(1);
    for (int j = 0; j < M; ++j) {
        if (at.mode[j] != 0)
            continue;
        const Margin<S> slide = sliding_margin(at.sys, at.mode, j, t, x, at.p);
        if (!(slide.below >= -beyond))
            return Guard<M>::below(j);
        if (!(slide.above >= -beyond))
            return Guard<M>::above(j);
    }
    return -1;
}

} // namespace filippov
