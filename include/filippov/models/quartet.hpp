// SPDX-License-Identifier: BSD-3-Clause
// Four scalar problems, one for each thing that can happen at a surface.
#pragma once

#include <filippov/system/system.hpp>

namespace filippov::models {

/// x' = c + d t - b sign x, h = x.
///
///   (b, c, d) = (1, 2, 0)   from -1: crosses at t = 1/3
///   (b, c, d) = (1, 0, 0)   slides
///   (b, c, d) = (1, 0, 1)   from 0: leaves at t = 1, x(2) = 0.5
///   (b, c, d) = (-1, 0, 0)  from 0: not unique
struct Quartet {
    static constexpr int dim = 1;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 1> state{"x"};
    static constexpr std::array<std::string_view, 3> params{"b", "c", "d"};
    static constexpr std::array<double, 3> defaults{1, 0, 0};

    template <Scalar S> Vec<S, 1> f1(const S& t, const Vec<S, 1>&, const Vec<S, 3>& p) const {
        return Vec<S, 1>(p[1] + p[2] * t + p[0]);
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>&, const Vec<S, 3>& p) const {
        return Vec<S, 1>(p[1] + p[2] * t - p[0]);
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 3>&) const { return x[0]; }
};

} // namespace filippov::models
