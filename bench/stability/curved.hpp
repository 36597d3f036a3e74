// SPDX-License-Identifier: BSD-3-Clause
// A relay system in curved coordinates: nonlinear fields and curved surfaces whose solutions are
// known all the same.
#pragma once

#include "relays.hpp"

#include <array>
#include <cstdint>
#include <random>

namespace filippov::stability {

/// The system of a problem in x_i = z_i + bend_i z_{i+1}^2, z_i its own coordinates.
template <int N, int M> struct Curved {
    static constexpr int dim = N, surfaces = M;

    Relays<N, M> straight;
    std::array<double, std::size_t(N)> bend{}; ///< the last one is 0

    /// Up to `reach`, in units of the problem's sizes, x differs from z by a quarter of it at most,
    /// and no length by more than a factor of two.
    Curved(const Problem<N, M>& q, double reach, std::uint64_t seed) : straight(q.sys) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<> share(-0.25, 0.25);
        for (int i = 0; i + 1 < N; ++i)
            bend[std::size_t(i)] =
                share(random) / reach * q.size[i] / (q.size[i + 1] * q.size[i + 1]);
    }

    template <class S> Vec<S, N> bent(const Vec<S, N>& z) const {
        Vec<S, N> x = z;
        for (int i = 0; i + 1 < N; ++i)
            x[i] = z[i] + S(bend[std::size_t(i)]) * z[i + 1] * z[i + 1];
        return x;
    }
    template <class S> Vec<S, N> straightened(const Vec<S, N>& x) const {
        Vec<S, N> z = x;
        for (int i = N - 2; i >= 0; --i)
            z[i] = x[i] - S(bend[std::size_t(i)]) * z[i + 1] * z[i + 1];
        return z;
    }

    bool is_forced() const { return straight.is_forced(); }
    template <class S> S period(const Vec<S, 0>& p) const { return straight.period(p); }
    template <Scalar S>
    Vec<S, N> field(const S& t, const Vec<S, N>& x, const Vec<S, M>& s, const Vec<S, 0>& p) const {
        const Vec<S, N> z = straightened(x);
        const Vec<S, N> rate = straight.field(t, z, s, p);
        Vec<S, N> f = rate;
        for (int i = 0; i + 1 < N; ++i)
            f[i] = rate[i] + S(2 * bend[std::size_t(i)]) * z[i + 1] * rate[i + 1];
        return f;
    }
    template <Scalar S> auto h(const S& t, const Vec<S, N>& x, const Vec<S, 0>& p) const {
        return straight.h(t, straightened(x), p);
    }
};

} // namespace filippov::stability
