// SPDX-License-Identifier: BSD-3-Clause
// A curved surface with an exact solution.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// x' = A1 x inside the unit circle, A2 x outside; A1 = [[1, w], [-w, 1]], A2 = [[1, -w], [w, 1]].
/// From (1/e, 0) the crossing is at t = 1 whatever w.
struct UnitCircle {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> state{"x", "y"};
    static constexpr std::array<std::string_view, 1> params{"w"};
    static constexpr std::array<double, 1> defaults{-6.283185307179586476925};

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {x[0] + p[0] * x[1], x[1] - p[0] * x[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {x[0] - p[0] * x[1], x[1] + p[0] * x[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 1>&) const {
        return x[0] * x[0] + x[1] * x[1] - S(1);
    }
};

} // namespace filippov::models
