// SPDX-License-Identifier: BSD-3-Clause
// A relay that is stiff off its surface.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// x' = -lambda (x - cos t) sign x, h = x. From x(0) = 1 it follows cos t, meets the surface at
/// pi - arctan(lambda) (up to the initial layer) and slides at 0.
struct StiffRelay {
    static constexpr int dim = 1;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 1> state{"x"};
    static constexpr std::array<std::string_view, 1> params{"lambda"};
    static constexpr std::array<double, 1> defaults{1000};

    template <Scalar S> Vec<S, 1> f1(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        using std::cos;
        return Vec<S, 1>(p[0] * (x[0] - cos(t)));
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        using std::cos;
        return Vec<S, 1>(-p[0] * (x[0] - cos(t)));
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 1>&) const { return x[0]; }
};

} // namespace filippov::models
