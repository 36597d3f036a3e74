// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of a system: its own where it has them, else by Taylor arithmetic.
#pragma once

#include <filippov/system/system.hpp>

#include <array>

namespace filippov {

/// A vector of scalars as a vector of constant series.
template <int K, class S, int N> Vec<Taylor<S, K>, N> lift(const Vec<S, N>& v) {
    Vec<Taylor<S, K>, N> r;
    for (int i = 0; i < N; ++i)
        r[i] = Taylor<S, K>(v[i]);
    return r;
}

/// Derivative of a function g(t, x) (returning a scalar) at (t, x) in the direction (dt, dx).
template <class G, class S, int N>
S directional(G&& g, const S& t, const Vec<S, N>& x, const S& dt, const Vec<S, N>& dx) {
    Taylor<S, 1> time(t);
    time.c[1] = dt;
    Vec<Taylor<S, 1>, N> state = lift<1>(x);
    for (int i = 0; i < N; ++i)
        state[i].c[1] = dx[i];
    return g(time, state).c[1];
}

/// Gradient dh_j/dx, shape (dim,).
/// @cost one grad_h, or dim evaluations of h in Taylor arithmetic
template <class Sys, class S>
State<Sys, S> grad_h(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                     const Params<Sys, S>& p) {
    if constexpr (HasGradH<Sys, S>) {
        return sys.grad_h(t, x, p);
    } else if constexpr (HasGradients<Sys, S>) {
        return sys.grad_h(j, t, x, p);
    } else {
        const auto q = lift<1>(p);
        State<Sys, S> gradient;
        for (int i = 0; i < dim_v<Sys>; ++i) {
            const auto h = [&](const auto& tau, const auto& y) {
                return switching(sys, tau, y, q)[j];
            };
            gradient[i] = directional(h, t, x, S(0), State<Sys, S>(State<Sys, S>::Unit(i)));
        }
        return gradient;
    }
}

/// Partial derivative dh_j/dt at fixed x.
template <class Sys, class S>
S h_t(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
    if constexpr (HasHt<Sys, S>) {
        return sys.h_t(t, x, p);
    } else if constexpr (HasGradients<Sys, S>) {
        return sys.h_t(j, t, x, p);
    } else {
        const auto q = lift<1>(p);
        const auto h = [&](const auto& tau, const auto& y) { return switching(sys, tau, y, q)[j]; };
        return directional(h, t, x, S(1), State<Sys, S>(State<Sys, S>::Zero()));
    }
}

/// Normal component L_j = h_t + <grad h_j, F> of a field value F at (t, x).
/// @source chapter, section 4.3, with the time derivative added
template <class Sys, class S>
FILIPPOV_INLINE S normal_component(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                                   const Params<Sys, S>& p, const State<Sys, S>& f) {
    if constexpr (HasGradH<Sys, S> && HasHt<Sys, S>) {
        S sum = sys.h_t(t, x, p);
        const State<Sys, S> g = sys.grad_h(t, x, p);
        for (int i = 0; i < dim_v<Sys>; ++i)
            sum += g[i] * f[i];
        return sum;
    } else {
        const auto q = lift<1>(p);
        const auto h = [&](const auto& tau, const auto& y) { return switching(sys, tau, y, q)[j]; };
        return directional(h, t, x, S(1), f);
    }
}

/// Jacobian of a field f(t, x, p) with respect to x, shape (dim, dim), column by column.
template <class F, class S, int N, int P>
Mat<S, N, N> jacobian(F&& f, const S& t, const Vec<S, N>& x, const Vec<S, P>& p) {
    const auto q = lift<1>(p);
    Mat<S, N, N> result;
    for (int i = 0; i < N; ++i) {
        Vec<Taylor<S, 1>, N> y = lift<1>(x);
        y[i].c[1] = S(1);
        const Vec<Taylor<S, 1>, N> column = f(Taylor<S, 1>(t), y, q);
        for (int r = 0; r < N; ++r)
            result(r, i) = column[r].c[1];
    }
    return result;
}

/// First K derivatives with respect to time of observe(t, x, p) along the flow of field(t, x, p):
/// the Lie derivatives L_F g, ..., L_F^K g, time included.
///
/// The series of the solution is grown order by order: x_k = [F(t + tau, x(tau))]_(k-1) / k.
/// @return array of length K: g', g'', ...
/// @cost   K evaluations of the field and one of g in Taylor arithmetic of order K
template <int K, class Field, class Observe, class S, int N, int P>
std::array<S, std::size_t(K)> lie_derivatives(Field&& field, Observe&& observe, const S& t,
                                              const Vec<S, N>& x, const Vec<S, P>& p) {
    const auto time = Taylor<S, K>::variable(t);
    const auto q = lift<K>(p);
    Vec<Taylor<S, K>, N> y = lift<K>(x);
    for (int k = 1; k <= K; ++k) {
        const Vec<Taylor<S, K>, N> f = field(time, y, q);
        for (int i = 0; i < N; ++i)
            y[i].c[std::size_t(k)] = f[i].c[std::size_t(k - 1)] / S(k);
    }
    const Taylor<S, K> g = observe(time, y, q);
    std::array<S, std::size_t(K)> derivative;
    S factorial(1);
    for (int k = 1; k <= K; ++k) {
        factorial = factorial * S(k);
        derivative[std::size_t(k - 1)] = factorial * g.c[std::size_t(k)];
    }
    return derivative;
}

} // namespace filippov
