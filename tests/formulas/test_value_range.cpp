// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/formulas/expression.hpp>
#include <filippov/formulas/value_range.hpp>

#include <cmath>
#include <random>
#include <vector>

using namespace filippov;
using namespace filippov::detail;

TEST_CASE("ValueRange: holds every result of numbers that are in the operands' ranges",
          "[formulas]") {
    std::mt19937_64 random(20080131);
    std::normal_distribution<double> normal;
    const auto any = [&] {
        const double a = 3 * normal(random), b = 3 * normal(random);
        switch (random() % 4) {
        case 0:
            return ValueRange{};
        case 1:
            return ValueRange{a, ValueRange::infinite};
        default:
            return ValueRange{std::min(a, b), std::max(a, b)};
        }
    };
    const auto inside = [&](const ValueRange& r) {
        const double low = std::max(r.low, -20.0), high = std::max(low, std::min(r.high, 20.0));
        return low + (high - low) * std::uniform_real_distribution<double>(0, 1)(random);
    };
    const auto holds = [](const ValueRange& r, double v) {
        return std::isnan(v) || (r.low <= v && v <= r.high);
    };
    for (int k = 0; k < 20'000; ++k) {
        const ValueRange a = any(), b = any();
        const double u = inside(a), v = inside(b);
        const int n = int(random() % 9) - 4;
        CAPTURE(a.low, a.high, b.low, b.high, u, v, n);
        REQUIRE(holds(values::sum(a, b), u + v));
        REQUIRE(holds(values::sum(a, values::negative(b)), u - v));
        REQUIRE(holds(values::product(a, b), u * v));
        REQUIRE(holds(values::quotient(a, b), u / v));
        REQUIRE(holds(values::hull(a, b), v));
        REQUIRE(holds(values::magnitude(a), std::abs(u)));
        REQUIRE(holds(values::power(a, n), std::pow(u, n)));
        REQUIRE(holds(values::rising(a, [](double w) { return std::exp(w); }), std::exp(u)));
    }
}

TEST_CASE("ValueRange: tells no more than is so", "[formulas]") {
    using values::power;
    CHECK(power({-1, 2}, 2).low == 0);
    CHECK(power({-3, -2}, 2).low > 3.99);
    CHECK(power({-3, -2}, 3).high < -7.99);
    CHECK(values::quotient({1, 1}, {-1, 1}).low == -ValueRange::infinite);
    CHECK(values::product({0, 0}, {}).high == 0);
    CHECK(values::sum({ValueRange::infinite, ValueRange::infinite}, {}).low ==
          -ValueRange::infinite);
}
