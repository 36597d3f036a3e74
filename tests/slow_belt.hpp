// SPDX-License-Identifier: BSD-3-Clause
// A forced block on a belt that is slow.
#pragma once

#include <filippov/core/elementary.hpp>
#include <filippov/system/system.hpp>

#include <array>
#include <cmath>
#include <string_view>

/// A block on a belt that may stand still: x'' = -x - 0.2 x' + F cos 0.7 t - 0.5 sign(x' - V).
struct SlowBelt {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"V", "F"};
    static constexpr std::array<double, 2> defaults{0, 2};
    template <filippov::Scalar S>
    filippov::State<SlowBelt, S> f1(const S& t, const filippov::State<SlowBelt, S>& x,
                                    const filippov::Params<SlowBelt, S>& p) const {
        return pulled(t, x, p, 0.5);
    }
    template <filippov::Scalar S>
    filippov::State<SlowBelt, S> f2(const S& t, const filippov::State<SlowBelt, S>& x,
                                    const filippov::Params<SlowBelt, S>& p) const {
        return pulled(t, x, p, -0.5);
    }
    template <filippov::Scalar S>
    S h(const S&, const filippov::State<SlowBelt, S>& x,
        const filippov::Params<SlowBelt, S>& p) const {
        return x[1] - p[0];
    }
    template <filippov::Scalar S> S period(const filippov::Params<SlowBelt, S>&) const {
        return S(2 * std::acos(-1.0) / 0.7);
    }

private:
    template <filippov::Scalar S>
    static filippov::State<SlowBelt, S> pulled(const S& t, const filippov::State<SlowBelt, S>& x,
                                               const filippov::Params<SlowBelt, S>& p,
                                               double friction) {
        using filippov::elementary::cos;
        return {x[1], S(friction) - x[0] - S(0.2) * x[1] + p[1] * cos(S(0.7) * t)};
    }
};
