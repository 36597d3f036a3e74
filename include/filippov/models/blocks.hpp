// SPDX-License-Identifier: BSD-3-Clause
// Several blocks with friction: several surfaces at once.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// Two blocks on a rough ground, joined by a spring; the friction of each depends on where it is.
///
///   x1'' = -(x1 - x2) - F1 sign x1',   x2'' = -(x2 - x1) - F2 sign x2',
///   F1 = 1 where x1 > 0, else 0.6;     F2 = 0.2 where x2 > 0, else 0.5
///
/// Four surfaces: x1' and x2', on which the blocks rest, and x1 and x2, where coefficients switch.
struct TwoBlocks {
    static constexpr int dim = 4;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = 4;
    static constexpr std::array<std::string_view, 4> state{"x1", "v1", "x2", "v2"};
    static constexpr std::array<std::string_view, 4> params{"F1_right", "F1_left", "F2_right",
                                                            "F2_left"};
    static constexpr std::array<double, 4> defaults{1, 0.6, 0.2, 0.5};

    template <Scalar S>
    Vec<S, 4> field(const S&, const Vec<S, 4>& x, const Vec<S, 4>& s, const Vec<S, 4>& p) const {
        const auto friction = [](const S& side, const S& right, const S& left) {
            return S(((S(1) + side) * right + (S(1) - side) * left) * S(0.5));
        };
        const S pull = x[2] - x[0];
        return {x[1], pull - friction(s[2], p[0], p[1]) * s[0], x[3],
                -pull - friction(s[3], p[2], p[3]) * s[1]};
    }
    template <Scalar S> Vec<S, 4> h(const S&, const Vec<S, 4>& x, const Vec<S, 4>&) const {
        return {x[1], x[3], x[0], x[2]};
    }
};

/// A chain of n blocks on a belt, each tied to the wall by a spring of stiffness 1 and to its
/// neighbours by springs of stiffness c; friction falls with the speed against the belt.
///
///   x_i'' = -x_i - c (x_i - x_(i-1)) - c (x_i - x_(i+1)) - s_i F_i / (1 + gamma |x_i' - V|),
///   h_i = x_i' - V
///
/// State (x1, v1, x2, v2, ...). Each side's friction extends smoothly across its surface, with the
/// speed signed instead of its magnitude, up to a pole at a speed of 1/gamma on the other side.
/// @source after Galvanetto (2001), J. Sound Vib. 248, 653-669
template <int n> struct BeltChain {
    static_assert(n >= 1 && n <= 8, "filippov: a chain of one to eight blocks");
    static constexpr int dim = 2 * n;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = n;
    /// V, c, gamma, then F_1, F_2, ...
    static constexpr std::array<std::string_view, 3 + n> params = [] {
        constexpr std::array<std::string_view, 11> all{"V",  "c",  "gamma", "F1", "F2", "F3",
                                                       "F4", "F5", "F6",    "F7", "F8"};
        std::array<std::string_view, 3 + n> some{};
        for (std::size_t i = 0; i < some.size(); ++i)
            some[i] = all[i];
        return some;
    }();
    static constexpr std::array<double, 3 + n> defaults = [] {
        std::array<double, 3 + n> some{0.1, 1.2, 3.0};
        for (std::size_t i = 0; i < n; ++i)
            some[3 + i] = i % 2 == 0 ? 1.0 : 1.3;
        return some;
    }();
    static constexpr std::array<std::string_view, 2 * n> state = [] {
        constexpr std::array<std::string_view, 16> all{"x1", "v1", "x2", "v2", "x3", "v3",
                                                       "x4", "v4", "x5", "v5", "x6", "v6",
                                                       "x7", "v7", "x8", "v8"};
        std::array<std::string_view, 2 * n> some{};
        for (std::size_t i = 0; i < some.size(); ++i)
            some[i] = all[i];
        return some;
    }();

    template <Scalar S>
    Vec<S, 2 * n> region(const S&, const Vec<S, 2 * n>& x, const Mode<n>& side,
                         const Vec<S, 3 + n>& p) const {
        Vec<S, 2 * n> f;
        for (int i = 0; i < n; ++i) {
            const S& y = x[2 * i];
            const S& v = x[2 * i + 1];
            S pull = -y;
            if (i > 0)
                pull -= p[1] * (y - x[2 * i - 2]);
            if (i + 1 < n)
                pull -= p[1] * (y - x[2 * i + 2]);
            const S speed = side[i] > 0 ? S(v - p[0]) : S(p[0] - v);
            const S friction = p[3 + i] / (S(1) + p[2] * speed);
            f[2 * i] = v;
            f[2 * i + 1] = side[i] > 0 ? S(pull - friction) : S(pull + friction);
        }
        return f;
    }
    template <Scalar S> auto h(const S&, const Vec<S, 2 * n>& x, const Vec<S, 3 + n>& p) const {
        if constexpr (n == 1) {
            return S(x[1] - p[0]);
        } else {
            Vec<S, n> speed;
            for (int i = 0; i < n; ++i)
                speed[i] = x[2 * i + 1] - p[0];
            return speed;
        }
    }
};

} // namespace filippov::models
