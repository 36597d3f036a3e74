// SPDX-License-Identifier: BSD-3-Clause
// The dry friction oscillator of the chapter.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/system/system.hpp>

namespace filippov::models {

/// Block on a belt, spring to a wall, forced by A cos(omega t); kinetic friction (4.5).
///
///   m y'' + k y = A cos(omega t) + m g mu(V - y') sign(V - y'),
///   mu(r) = alpha/(1 + gamma r) + beta + eta r^2,   h = y' - V
///
/// S1 = {h < 0} is slip with the belt ahead, S2 = {h > 0} slip with the block ahead. Each side's
/// field extends smoothly across the surface (r with its sign, not |r|) up to a pole at
/// r = -1/gamma.
/// @source chapter, (4.3), (4.5), (4.18)-(4.21)
struct Oscillator {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> state{"y", "v"};
    static constexpr std::array<std::string_view, 10> params{"A", "omega", "m",     "k",    "g",
                                                             "V", "alpha", "gamma", "beta", "eta"};
    static constexpr std::array<double, 10> defaults{0.5, 2.94, 1, 1, 10, 1, 0.3, 1.42, 0.1, 0.01};

    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 10>;

    /// A cos(omega t) - k y
    template <Scalar S> static S pull(const S& t, const X<S>& x, const P<S>& p) {
        using elementary::cos;
        return p[0] * cos(p[1] * t) - p[3] * x[0];
    }
    /// 1/m: the same at every stage of a step, which a division would not be.
    template <Scalar S> static S per_mass(const P<S>& p) { return S(1) / p[2]; }
    /// g mu(r) of (4.5), r >= 0: the part without a pole.
    template <Scalar S> static S smooth_part(const S& r, const P<S>& p) {
        return p[4] * (p[8] + p[9] * r * r);
    }
    /// ... and the part with one, alpha/(1 + gamma r), from its denominator. A step waits for it,
    /// stage after stage: it joins the sum last, and f1 and f2 write 1 + gamma r with all that does
    /// not depend on v together.
    template <Scalar S> static S falling_part(const S& denominator, const P<S>& p) {
        return p[4] * p[6] / denominator;
    }

    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const P<S>& p) const {
        const S r = p[5] - x[1], denominator = (S(1) + p[7] * p[5]) - p[7] * x[1];
        return {x[1],
                (pull(t, x, p) * per_mass(p) + smooth_part(r, p)) + falling_part(denominator, p)};
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        const S r = x[1] - p[5], denominator = (S(1) - p[7] * p[5]) + p[7] * x[1];
        return {x[1],
                (pull(t, x, p) * per_mass(p) - smooth_part(r, p)) - falling_part(denominator, p)};
    }
    /// (4.18)
    template <Scalar S> S h(const S&, const X<S>& x, const P<S>& p) const { return x[1] - p[5]; }
    template <Scalar S> X<S> grad_h(const S&, const X<S>&, const P<S>&) const {
        return {S(0), S(1)};
    }
    template <Scalar S> S h_t(const S&, const X<S>&, const P<S>&) const { return S(0); }
    /// The blend with the true magnitude of the friction, -s mu(|v - V|): what smoothing and time
    /// stepping need, since the sides' extensions have a pole.
    template <Scalar S> X<S> field(const S& t, const X<S>& x, const S& s, const P<S>& p) const {
        using std::abs;
        const S r = abs(S(x[1] - p[5]));
        return {x[1], pull(t, x, p) * per_mass(p) -
                          s * (smooth_part(r, p) + falling_part(S(S(1) + p[7] * r), p))};
    }
    /// On the belt: s = (A cos(omega t) - k y) / (m g mu(0)), from (4.12) and (4.2).
    template <Scalar S> S equivalent_control(const S& t, const X<S>& x, const P<S>& p) const {
        return pull(t, x, p) / (p[2] * p[4] * (p[6] + p[8]));
    }
    /// (4.1)
    template <Scalar S>
    X<S> sliding_flow(const S&, const X<S>& x, const P<S>& p, const S& dt) const {
        return {x[0] + p[5] * dt, p[5]};
    }
    /// s follows a cosine and a line: half a forcing period.
    template <Scalar S> S slide_swing(const P<S>& p) const {
        return S(3.141592653589793238462643383279502884L) / p[1];
    }
    /// Forcing period 2 pi / omega.
    template <Scalar S> S period(const P<S>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[1];
    }
};

} // namespace filippov::models
