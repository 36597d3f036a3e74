// SPDX-License-Identifier: BSD-3-Clause
// Relay feedback of third order.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// x' = A x + B u, u = -sign x1,
///
///   A = [[-(2 z w + l), 1, 0], [-(2 z w l + w^2), 0, 1], [-l w^2, 0, 0]],  B = (b1, b2, b3)
///
/// With l = 1, z = 0.05, w = 25, B = (1, -2, 1) a limit cycle with several slides.
/// @source di Bernardo, Johansson, Vasca (2001), Int. J. Bifurcation and Chaos 11, 1121-1140
struct Relay {
    static constexpr int dim = 3;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 3> state{"x1", "x2", "x3"};
    static constexpr std::array<std::string_view, 6> params{"zeta", "omega", "lambda",
                                                            "b1",   "b2",    "b3"};
    static constexpr std::array<double, 6> defaults{0.05, 25, 1, 1, -2, 1};

    template <Scalar S>
    static Vec<S, 3> driven(const Vec<S, 3>& x, const Vec<S, 6>& p, const S& u) {
        const S zw = S(2) * p[0] * p[1], w2 = p[1] * p[1];
        return {x[1] - (zw + p[2]) * x[0] + p[3] * u, x[2] - (zw * p[2] + w2) * x[0] + p[4] * u,
                p[5] * u - p[2] * w2 * x[0]};
    }
    template <Scalar S> Vec<S, 3> f1(const S&, const Vec<S, 3>& x, const Vec<S, 6>& p) const {
        return driven(x, p, S(1));
    }
    template <Scalar S> Vec<S, 3> f2(const S&, const Vec<S, 3>& x, const Vec<S, 6>& p) const {
        return driven(x, p, S(-1));
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 6>&) const { return x[0]; }
};

} // namespace filippov::models
