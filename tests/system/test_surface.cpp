// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/core/lanes.hpp>
#include <filippov/system/surface.hpp>
#include <filippov/system/system.hpp>

using namespace filippov;

namespace {

/// h = a x + b y.
struct Line {
    static constexpr int dim = 2;
    double a, b;

    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return S(a) * x[0] + S(b) * x[1];
    }
};

using V2 = Vec<double, 2>;

V2 onto(const Line& line, const V2& x, const V2& scale) {
    return toward_surface(line, 0, 0.0, x, Vec<double, 0>(), scale);
}

} // namespace

TEST_CASE("toward_surface: exact where one component is all of the gradient, in any units",
          "[surface]") {
    for (const double a : {1.0, 1e-200, -1e200})
        for (const double scale : {1e-292, 1e-100, 1.0, 1e250}) {
            CAPTURE(a, scale);
            CHECK(onto({a, 0}, V2(-8e-37, 3), V2(scale, 1e-9)) == V2(0, 3));
        }
}

TEST_CASE("toward_surface: the smallest change in units of the scale, in any units", "[surface]") {
    // x + y = 3 and scales of 1 to 2: the components move as 1 to 4
    for (const double a : {1e-200, 1e-9, 1.0, 1e200})
        for (const double scale : {1e-200, 1e-9, 1.0, 1e200}) {
            CAPTURE(a, scale);
            const V2 y = onto({a, a}, V2(1, 2), V2(scale, 2 * scale));
            CHECK(y[0] == Approx(0.4).epsilon(1e-15));
            CHECK(y[1] == Approx(-0.4).epsilon(1e-15));
        }
    CHECK(onto({0, 0}, V2(1, 2), V2(1, 1)) == V2(1, 2)); // no gradient
}

TEST_CASE("toward_surface: a lane does as it would alone, whatever the others' units",
          "[surface]") {
    using L = Lanes<4>;
    const std::array<double, 4> scale{1e-292, 1, 1e250, 1e-9};
    const Line line{1, 1};
    Vec<L, 2> x, scales;
    for (std::size_t k = 0; k < 4; ++k) {
        x[0].set(k, 1 + double(k));
        x[1].set(k, 0.3);
        scales[0].set(k, scale[k]);
        scales[1].set(k, 3 * scale[k]);
    }
    const Vec<L, 2> y = toward_surface(line, 0, L(0.0), x, Vec<L, 0>(), scales);
    for (std::size_t k = 0; k < 4; ++k) {
        const V2 alone = onto(line, V2(1 + double(k), 0.3), V2(scale[k], 3 * scale[k]));
        CHECK(y[0][k] == alone[0]);
        CHECK(y[1][k] == alone[1]);
    }
}
