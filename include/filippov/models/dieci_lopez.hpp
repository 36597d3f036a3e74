// SPDX-License-Identifier: BSD-3-Clause
// The stick-slip systems of Dieci and Lopez, with one surface and with two.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// x1' = x2, x2' = -x1 + 1/(1.2 - x2) below x2 = 0.2 and -x1 - 1/(0.8 + x2) above.
/// @source Dieci & Lopez (2009), SIAM J. Numer. Anal. 47, 2023-2051
struct DieciLopez {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> state{"x1", "x2"};
    static constexpr std::array<std::string_view, 1> params{"v"};
    static constexpr std::array<double, 1> defaults{0.2};

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {x[1], -x[0] + S(1) / (S(1) + p[0] - x[1])};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {x[1], -x[0] - S(1) / (S(1) - p[0] + x[1])};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return x[1] - p[0];
    }
};

/// Two surfaces x2 = 0.2 and x3 = 0.4: x1' = (x2 + x3)/2, plus x1 (x2 + 0.8)(x3 + 0.6) where both
/// are passed; x2' and x3' as in DieciLopez, with levels 0.2 and 0.4.
/// @source Dieci & Lopez (2011), J. Comput. Appl. Math. 235, 3480-3500
struct DieciLopez2 {
    static constexpr int dim = 3;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 3> state{"x1", "x2", "x3"};
    static constexpr std::array<std::string_view, 0> params{};

    /// Bilinear in s: each x_j' is a blend in its own s_j, the extra term (1+s1)/2 (1+s2)/2 of
    /// both.
    template <Scalar S>
    Vec<S, 3> field(const S&, const Vec<S, 3>& x, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        const S a = (S(1) + s[0]) / S(2), b = (S(1) + s[1]) / S(2);
        const S extra = a * b * x[0] * (x[1] + S(0.8)) * (x[2] + S(0.6));
        const S f2_below = S(1) / (S(1.2) - x[1]), f2_above = -S(1) / (S(0.8) + x[1]);
        const S f3_below = S(1) / (S(1.4) - x[2]), f3_above = -S(1) / (S(0.6) + x[2]);
        return {(x[1] + x[2]) / S(2) + extra, -x[0] + (S(1) - a) * f2_below + a * f2_above,
                -x[0] + (S(1) - b) * f3_below + b * f3_above};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {x[1] - S(0.2), x[2] - S(0.4)};
    }
};

} // namespace filippov::models
