// SPDX-License-Identifier: BSD-3-Clause
// Relays and switches in the plane: what a solution does where surfaces meet.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// x' = a sign x + b sign y, y' = c sign x + d sign y.
///
/// With (-1, 2, -2, -1) solutions spiral into (0, 0), from (x0, y0) in the time (|x0| + |y0|)/2 and
/// through infinitely many crossings; with (1, 2, -2, 1) they spiral away from it.
struct SignPlane {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 2> state{"x", "y"};
    static constexpr std::array<std::string_view, 4> params{"a", "b", "c", "d"};
    static constexpr std::array<double, 4> defaults{-1, 2, -2, -1};

    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 4>& p) const {
        return {p[0] * s[0] + p[1] * s[1], p[2] * s[0] + p[3] * s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 4>&) const {
        return x;
    }
};

/// An unstable plant under a relay: x1' = -x1 + x2, x2' = 3 x2 - k sign(x1 + x2).
///
/// Where |x2| >= k/3 the relay cannot hold x2.
struct PlanarRelay {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> state{"x1", "x2"};
    static constexpr std::array<std::string_view, 1> params{"k"};
    static constexpr std::array<double, 1> defaults{10};

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {-x[0] + x[1], S(3) * x[1] + p[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {-x[0] + x[1], S(3) * x[1] - p[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 1>&) const {
        return x[0] + x[1];
    }
};

/// Two genes that inhibit each other, and at a higher level themselves.
///
///   a' = k s-(a, high) s-(b, low) - g a,   b' = k s-(a, low) s-(b, high) - g b,
///   s-(z, level) = 1 where z < level, else 0
///
/// Four surfaces, a and b at their two levels, and products of switches. Either gene can win; the
/// point (low, low) between them is a saddle at which solutions are not unique.
/// @source after Casey, de Jong & Gouze (2006), J. Math. Biol. 52, 27-56
struct GeneSwitch {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = 4;
    static constexpr std::array<std::string_view, 2> state{"a", "b"};
    static constexpr std::array<std::string_view, 4> params{"k", "g", "low", "high"};
    static constexpr std::array<double, 4> defaults{20, 2, 4, 8};

    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const Vec<S, 4>& s, const Vec<S, 4>& p) const {
        const auto off = [](const S& side) { return S((S(1) - side) * S(0.5)); };
        return {p[0] * off(s[2]) * off(s[1]) - p[1] * x[0],
                p[0] * off(s[0]) * off(s[3]) - p[1] * x[1]};
    }
    template <Scalar S> Vec<S, 4> h(const S&, const Vec<S, 2>& x, const Vec<S, 4>& p) const {
        return {x[0] - p[2], x[1] - p[2], x[0] - p[3], x[1] - p[3]};
    }
};

} // namespace filippov::models
