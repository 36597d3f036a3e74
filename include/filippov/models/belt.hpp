// SPDX-License-Identifier: BSD-3-Clause
// Coulomb friction on a belt whose speed varies.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/system/system.hpp>

namespace filippov::models {

/// x'' = -x - c x' + cos(omega t) - mu sign(x' - cos t - V), h(t, x) = x' - cos t - V: a surface
/// that moves with time.
struct VaryingBelt {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> state{"x", "v"};
    static constexpr std::array<std::string_view, 4> params{"c", "omega", "mu", "V"};
    static constexpr std::array<double, 4> defaults{0.4, 0.7, 0.4, 0.7};

    template <Scalar S> static S pull(const S& t, const Vec<S, 2>& x, const Vec<S, 4>& p) {
        using elementary::cos;
        return cos(p[1] * t) - x[0] - p[0] * x[1];
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 4>& p) const {
        return {x[1], pull(t, x, p) + p[2]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 4>& p) const {
        return {x[1], pull(t, x, p) - p[2]};
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 4>& p) const {
        using elementary::cos;
        return x[1] - cos(t) - p[3];
    }
};

} // namespace filippov::models
