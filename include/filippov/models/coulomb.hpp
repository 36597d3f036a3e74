// SPDX-License-Identifier: BSD-3-Clause
// Oscillators with Coulomb friction on resting ground.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/system/system.hpp>

namespace filippov::models {

/// x'' + x = a sin(omega t) - mu sign(x'), h = x'.
///
/// With a = 0 every half swing is a half circle, shorter by 2 mu: from (3, 0) with mu = 0.4 the
/// reversals are at k pi and the mass rests from 4 pi on at x = -0.2 (exact).
struct Coulomb {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> state{"x", "v"};
    static constexpr std::array<std::string_view, 3> params{"mu", "a", "omega"};
    static constexpr std::array<double, 3> defaults{0.4, 0.0, 0.5};

    template <Scalar S> static S pull(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) {
        using elementary::sin;
        return p[1] * sin(p[2] * t) - x[0];
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return {x[1], pull(t, x, p) + p[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return {x[1], pull(t, x, p) - p[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const { return x[1]; }
    /// At rest.
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 3>&, const S&) const {
        return {x[0], S(0)};
    }
};

/// Coulomb friction with a static coefficient above the kinetic one, law (4.4): not a Filippov
/// system. This is the named stiction model: the block sticks to the belt while the force it needs
/// is below m g mu_s, that is while |s| <= s_max = mu_s / mu_0, and slips with m g mu_0.
/// @source chapter, (4.2), (4.4)
struct Stiction {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> state{"y", "v"};
    static constexpr std::array<std::string_view, 6> params{"A",      "omega", "V",
                                                            "weight", "mu_0",  "mu_s"};
    static constexpr std::array<double, 6> defaults{0.5, 2.94, 1, 10, 0.3, 0.4};

    template <Scalar S> static S pull(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) {
        using elementary::cos;
        return p[0] * cos(p[1] * t) - x[0];
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {x[1], pull(t, x, p) + p[3] * p[4]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {x[1], pull(t, x, p) - p[3] * p[4]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return x[1] - p[2];
    }
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 6>& p, const S& dt) const {
        return {x[0] + p[2] * dt, p[2]};
    }
    template <Scalar S> S s_max(const Vec<S, 6>& p) const { return p[5] / p[4]; }
    template <Scalar S> S period(const Vec<S, 6>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[1];
    }
};

} // namespace filippov::models
