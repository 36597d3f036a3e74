// SPDX-License-Identifier: BSD-3-Clause
// Systems whose state jumps: impacts, and a switch with hysteresis.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/system/system.hpp>

namespace filippov::models {

/// A ball on a floor, x'' = -g; v+ = -e v at x = 0.
///
/// From (x0, 0) it hits the floor at t1 = sqrt(2 x0/g), and with e < 1 comes to rest at
/// t1 (1 + 2 e/(1 - e)), after infinitely many bounces.
struct BouncingBall {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> state{"x", "v"};
    static constexpr std::array<std::string_view, 2> params{"g", "e"};
    static constexpr std::array<double, 2> defaults{9.8, 0.9};
    static constexpr std::array kinds{SurfaceKind::jump};

    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {x[1], -p[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const { return x[0]; }
    template <Scalar S>
    Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {x[0], -p[1] * x[1]};
    }
};

/// A room with a heater that goes on below `low` and off above `high`: y' = -rate (y - outside) +
/// q power, q = 1 while it heats. Components that only jumps change are the discrete state.
struct Thermostat {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> state{"y", "q"};
    static constexpr std::array<std::string_view, 5> params{"rate", "outside", "power", "low",
                                                            "high"};
    static constexpr std::array<double, 5> defaults{0.1, 18, 2, 22, 23.5};
    static constexpr std::array kinds{SurfaceKind::jump};

    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 5>& p) const {
        return {-p[0] * (x[0] - p[1]) + x[1] * p[2], S(0)};
    }
    /// How far the switch is: below `high` while it heats, above `low` while it does not.
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 5>& p) const {
        return x[1] * (p[4] - x[0]) + (S(1) - x[1]) * (x[0] - p[3]);
    }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 5>&) const {
        return {x[0], S(1) - x[1]};
    }
};

/// A block on a belt in front of a rigid wall: x'' + x = A cos(omega t) - F sign(x' - V), x <=
/// wall; v+ = -e v at the wall.
struct ImpactBelt {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 2> state{"x", "v"};
    static constexpr std::array<std::string_view, 6> params{"A", "omega", "F", "V", "wall", "e"};
    static constexpr std::array<double, 6> defaults{0.6, 1.2, 0.2, 0.5, 1, 0.8};
    static constexpr std::array kinds{SurfaceKind::switching, SurfaceKind::jump};

    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>& x, const Vec<S, 2>& s, const Vec<S, 6>& p) const {
        using elementary::cos;
        return {x[1], p[0] * cos(p[1] * t) - x[0] - p[2] * s[0]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {x[1] - p[3], p[4] - x[0]};
    }
    template <Scalar S>
    Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {x[0], -p[5] * x[1]};
    }
    template <Scalar S> S period(const Vec<S, 6>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[1];
    }
};

} // namespace filippov::models
