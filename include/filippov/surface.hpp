// SPDX-License-Identifier: BSD-3-Clause
// Points on a switching surface: how near is on it, and how to get there.
#pragma once

#include <filippov/derivatives.hpp>

#include <algorithm>

namespace filippov {

/// Size of h_j that rounding of t and x alone can make: |h| below it is zero.
///
///   16 eps (sum_i |dh/dx_i| |x_i| + |dh/dt| |t|)
///
/// Scales with h, and not at all with the units of x and t.
template <class Sys, class S>
S rounding_band(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                const Params<Sys, S>& p) {
    using std::abs;
    const State<Sys, S> g = grad_h(sys, j, t, x, p);
    S sum = abs(h_t(sys, j, t, x, p) * t);
    for (int i = 0; i < dim_v<Sys>; ++i)
        sum += abs(g[i] * x[i]);
    return S(16 * epsilon<Real<S>>) * sum;
}

/// How far h_j can change while each component of x changes by its length: sum_i |dh/dx_i| l_i.
template <class Sys, class S>
S change_over(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
              const State<Sys, S>& lengths) {
    using std::abs;
    const State<Sys, S> g = grad_h(sys, j, t, x, p);
    S sum(0);
    for (int i = 0; i < dim_v<Sys>; ++i)
        sum += abs(g[i]) * lengths[i];
    return sum;
}

/// Size of h_j below which a given start counts as on the surface: rounding, or a thousandth of the
/// absolute tolerance, below which the user said that nothing matters.
template <class Sys, class S>
S start_band(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
             const State<Sys, S>& atol) {
    return rounding_band(sys, j, t, x, p) + S(1e-3) * change_over(sys, j, t, x, p, atol);
}

/// One Newton step onto h_j = 0 along the gradient, in units of `scale` (one positive length per
/// component): x - h W g / (g' W g), W = diag(scale^2). The smallest change in the norm of the
/// error test, and so independent of the units of x.
///
/// @param scale  plain numbers, or lanes of them
/// @return x unchanged where h is zero already or the gradient vanishes
template <class Sys, class S, class R>
FILIPPOV_INLINE State<Sys, S> toward_surface(const Sys& sys, int j, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p,
                                             const Vec<R, dim_v<Sys>>& scale) {
    const S h = switching(sys, t, x, p)[j];
    if constexpr (std::floating_point<S>) // a dual that is zero still has derivatives
        if (h == S(0))
            return x;
    const State<Sys, S> g = grad_h(sys, j, t, x, p);
    S norm(0);
    for (int i = 0; i < dim_v<Sys>; ++i)
        norm += g[i] * g[i] * scale[i] * scale[i];
    State<Sys, S> y;
    // g_i^2 scale_i^2 / norm is exactly 1 where one component is all of the gradient: x_i - h/g_i,
    // to the last bit
    for (int i = 0; i < dim_v<Sys>; ++i) {
        const S share = g[i] * g[i] * scale[i] * scale[i] / norm;
        y[i] = select(share > S(0), S(x[i] - h / g[i] * share), x[i]);
    }
    return y;
}

/// Puts x on h_j = 0 to rounding: Newton until |h| stops falling, at most eight times.
template <class Sys, class S, class R>
State<Sys, S> project(const Sys& sys, int j, const S& t, State<Sys, S> x, const Params<Sys, S>& p,
                      const Vec<R, dim_v<Sys>>& scale) {
    using std::abs;
    S best = abs(switching(sys, t, x, p)[j]);
    for (int k = 0; k < 8 && any(best > S(0)); ++k) {
        const State<Sys, S> y = toward_surface(sys, j, t, x, p, scale);
        const S h = abs(switching(sys, t, y, p)[j]);
        const auto better = h < best;
        if (!any(better))
            break;
        best = select(better, h, best);
        for (int i = 0; i < dim_v<Sys>; ++i)
            x[i] = select(better, y[i], x[i]);
    }
    return x;
}

} // namespace filippov
