// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/core/elementary.hpp>

#include <cmath>
#include <limits>
#include <random>

namespace {

constexpr double ulp_of_one = std::numeric_limits<double>::epsilon();
constexpr double inf = std::numeric_limits<double>::infinity();

/// Error of cos and sin at x against extended precision, the larger of the two.
double error(double x) {
    const long double c = std::cos(static_cast<long double>(x)),
                      s = std::sin(static_cast<long double>(x));
    return static_cast<double>(
        std::max(std::abs(static_cast<long double>(filippov::elementary::cos(x)) - c),
                 std::abs(static_cast<long double>(filippov::elementary::sin(x)) - s)));
}

} // namespace

TEST_CASE("elementary: cos and sin are within two ulps of 1 everywhere below 1e5", "[elementary]") {
    std::mt19937_64 random(1);
    double worst = 0, where = 0;
    const auto look = [&](double x) {
        const double e = error(x);
        if (!(e <= worst))
            worst = e, where = x;
    };
    for (const double range : {1.0, 10.0, 1e3, 1e5})
        for (int k = 0; k < 200'000; ++k)
            look((static_cast<double>(random() >> 11) * 0x1p-52 - 1) * range);
    CAPTURE(worst / ulp_of_one, where);
    CHECK(worst <= 2 * ulp_of_one);
}

TEST_CASE("elementary: cos and sin keep their digits at multiples of pi/4", "[elementary]") {
    // where a reduction in too few digits shows, and where the choice of the quadrant is closest
    double worst = 0, where = 0;
    for (long k = -127'000; k <= 127'000; ++k) {
        const double x = static_cast<double>(k) * 0.78539816339744830962;
        for (const double y : {x, std::nextafter(x, inf), std::nextafter(x, -inf)}) {
            if (!(std::abs(y) < 1e5))
                continue;
            const double e = error(y);
            if (!(e <= worst))
                worst = e, where = y;
        }
    }
    CAPTURE(worst / ulp_of_one, where);
    CHECK(worst <= 2 * ulp_of_one);
}

TEST_CASE("elementary: sin has relative precision where it is small", "[elementary]") {
    // the reduced argument, not only the value, has to be right
    for (int k = 1; k < 30'000; k += 7) {
        const double x = k * 3.14159265358979323846;
        const long double s = std::sin(static_cast<long double>(x));
        // three-part pi/2: 33 + 33 + 53 bits, less 17 for k; the double x is about 1e-16 k from the
        // root
        CHECK(std::abs((static_cast<long double>(filippov::elementary::sin(x)) - s) / s) < 1e-10L);
    }
}

TEST_CASE("elementary: zero and subnormal arguments", "[elementary]") {
    CHECK(filippov::elementary::cos(0.0) == 1.0);
    CHECK(filippov::elementary::sin(0.0) == 0.0);
    CHECK(filippov::elementary::cos(-0.0) == 1.0);
    CHECK(filippov::elementary::sin(-0.0) == 0.0);
    for (const double x : {5e-324, 1e-310, 2.2250738585072014e-308, 1e-200, 1e-9}) {
        CHECK(filippov::elementary::sin(x) == x);
        CHECK(filippov::elementary::sin(-x) == -x);
        CHECK(filippov::elementary::cos(x) == 1.0);
    }
}

TEST_CASE("elementary: cos is even and sin is odd to the last bit", "[elementary]") {
    std::mt19937_64 random(2);
    int different = 0;
    for (int k = 0; k < 100'000; ++k) {
        const double x = static_cast<double>(random() >> 11) * 0x1p-53 * 1e5;
        different += filippov::elementary::cos(-x) != filippov::elementary::cos(x) ||
                     filippov::elementary::sin(-x) != -filippov::elementary::sin(x);
    }
    CHECK(different == 0);
}

TEST_CASE("elementary: NaN and infinities give NaN", "[elementary]") {
    for (const double x : {inf, -inf, std::numeric_limits<double>::quiet_NaN()}) {
        CHECK(std::isnan(filippov::elementary::cos(x)));
        CHECK(std::isnan(filippov::elementary::sin(x)));
    }
}

TEST_CASE("elementary: from 1e5 on the library's functions answer", "[elementary]") {
    for (const double x : {1e5, std::nextafter(1e5, inf), 123456.789, 1e10, 1e22, 1.7e308}) {
        CHECK(filippov::elementary::cos(x) == std::cos(x));
        CHECK(filippov::elementary::sin(x) == std::sin(x));
        CHECK(filippov::elementary::cos(-x) == std::cos(-x));
        CHECK(filippov::elementary::sin(-x) == std::sin(-x));
    }
    CHECK(std::abs(filippov::elementary::cos(std::nextafter(1e5, 0.0)) -
                   std::cos(std::nextafter(1e5, 0.0))) <= 2 * ulp_of_one);
}

TEMPLATE_TEST_CASE("elementary: other scalars have the library's functions", "[elementary]", float,
                   long double) {
    for (const TestType x : {TestType(0), TestType(0.7L), TestType(-2.5L), TestType(1e6L)}) {
        CHECK(filippov::elementary::cos(x) == std::cos(x));
        CHECK(filippov::elementary::sin(x) == std::sin(x));
    }
    CHECK(std::is_same_v<decltype(filippov::elementary::cos(TestType(1))), TestType>);
}
