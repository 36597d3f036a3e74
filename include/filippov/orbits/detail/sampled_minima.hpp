// SPDX-License-Identifier: BSD-3-Clause
// Minima of a quantity along a segment, from samples of it.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace filippov {

namespace detail {

/// A point of a segment, with the quantities that are sampled there.
template <int N> struct Sample {
    double t;
    Vec<double, N> x;
    std::array<double, 2> value;
};

/// A minimum, between samples.
template <int N> struct SampledMinimum {
    double t;
    Vec<double, N> x;
    double value;
};

/// Minima of one quantity, each the vertex of a parabola through three samples; where the quantity
/// falls at the start, or rises at the end, and the neighbour lies above, through two and the
/// slope.
/// @param samples  at least two
/// @param which    of the quantities
template <int N>
std::vector<SampledMinimum<N>> sampled_minima(const std::vector<Sample<N>>& samples,
                                              std::size_t which, double first_slope,
                                              double last_slope) {
    std::vector<SampledMinimum<N>> found;
    const auto keep = [&](const Sample<N>& from, const Sample<N>& to, double dt, double value) {
        const double theta = dt / (to.t - from.t);
        found.push_back({from.t + dt, from.x + theta * (to.x - from.x), value});
    };
    const auto at_end = [&](const Sample<N>& end, const Sample<N>& inner, double slope) {
        const double u = inner.t - end.t, rise = inner.value[which] - end.value[which];
        if (!(slope * u < 0 && rise >= 0))
            return;
        const double bend = (rise / u - slope) / u;
        keep(end, inner, -slope / (2 * bend), end.value[which] - slope * slope / (4 * bend));
    };
    const std::size_t n = samples.size();
    at_end(samples[0], samples[1], first_slope);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const Sample<N>&a = samples[i - 1], &b = samples[i], &c = samples[i + 1];
        const double ga = a.value[which], gb = b.value[which], gc = c.value[which];
        if (!(gb < ga && gb <= gc))
            continue;
        const double u = a.t - b.t, w = c.t - b.t;
        const double ka = (ga - gb) / u, kc = (gc - gb) / w;
        const double bend = (kc - ka) / (w - u), slope = ka - bend * u;
        const double dt = bend > 0 ? std::clamp(-slope / (2 * bend), u, w) : 0.0;
        keep(b, dt < 0 ? a : c, dt, gb + dt * (slope + bend * dt));
    }
    at_end(samples[n - 1], samples[n - 2], last_slope);
    return found;
}

} // namespace detail

} // namespace filippov
