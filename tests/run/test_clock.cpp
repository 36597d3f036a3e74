// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/run/clock.hpp>

#include <cmath>

using namespace filippov;

namespace {

const double T = 6.283185307179586 / 2.94; // a period with no short binary form

/// k dt - n T with one rounding: both products as a sum of two doubles.
double exact(long long k, double dt, long long n, double period) {
    const double a = static_cast<double>(k) * dt, a_rest = std::fma(static_cast<double>(k), dt, -a);
    const double b = static_cast<double>(n) * period,
                 b_rest = std::fma(static_cast<double>(n), period, -b);
    return (a - b) + (a_rest - b_rest);
}

/// Error of a clock with a period after about a million of them, in units of the last place of T.
double phase_error(double dt) {
    auto c = Clock<double>::at(0, T);
    long long k = 0;
    while (std::abs(c.index) < 1'000'000) {
        c.advance(dt);
        ++k;
        if (!(c.local >= 0 && c.local < T))
            return 1e300;
    }
    return std::abs(c.local + c.carry - exact(k, dt, c.index, T)) / (epsilon<double> * T);
}

} // namespace

TEST_CASE("clock: a million periods forwards cost no digit of the phase", "[clock]") {
    const double steps_a_period = GENERATE(3.1, 7.3, 21.9);
    // 2: the sum of local and carry, and that of the two halves of the oracle, round once each
    CHECK(phase_error(T / steps_a_period) <= 2);
}

TEST_CASE("clock: a million periods backwards cost no digit of the phase", "[clock]") {
    const double steps_a_period = GENERATE(3.1, 7.3, 21.9);
    CHECK(phase_error(-T / steps_a_period) <= 2);
}

TEST_CASE(
    "clock: without a period ten million steps lose nothing, and come back to where they started",
    "[clock]") {
    auto c = Clock<double>::at(0, 0);
    const double dt = 0.1;
    const long long n = 10'000'000;
    double plain = 0;
    for (long long k = 0; k < n; ++k) {
        c.advance(dt);
        plain += dt;
    }
    CHECK(std::abs(exact(n, dt, 1, c.local) - c.carry) <=
          ulp(c.local) * epsilon<double> * static_cast<double>(n));
    CHECK(std::abs(plain - c.local) > 1e-5); // what compensation saves
    CHECK(c.index == 0);
    for (long long k = 0; k < n; ++k)
        c.advance(-dt);
    CHECK(c.local + c.carry ==
          Approx(0).margin(1e-16 * 1e6)); // a rounding of the largest time's rounding, each step
}

TEST_CASE("clock: shows the time that it was set to", "[clock]") {
    for (const double t :
         {0.0, 0.3, T, 5.5 * T, -0.3, -T, -5.5 * T, 1e6 * T + 0.7, -1e6 * T + 0.7}) {
        CAPTURE(t);
        const auto c = Clock<double>::at(t, T);
        CHECK(c.local >= 0);
        CHECK(c.local < T);
        CHECK(static_cast<double>(c.index) == std::floor(t / T));
        // the phase is exact to rounding although t is large: the product is not rounded before the
        // difference
        CHECK(std::abs(c.local - exact(1, t, c.index, T)) <= epsilon<double> * T);
        CHECK(std::abs(c.absolute() - t) <= ulp(t) + ulp(T));
        CHECK(c.offset() + c.local == c.absolute());
    }
    const auto free = Clock<double>::at(-17.25, 0);
    CHECK(free.absolute() == -17.25);
    CHECK(free.offset() == 0);
    CHECK(free.index == 0);
}

TEST_CASE("clock: the time between two far clocks does not cancel", "[clock]") {
    auto a = Clock<double>::at(0, T), b = a;
    a.index = b.index = 1'000'000'000;
    b.local = 1e-13;
    CHECK(a.until(b) == 1e-13);
    CHECK(b.until(a) == -1e-13);
    b.index += 2;
    CHECK(a.until(b) == 2 * T + 1e-13);
}

TEST_CASE("clock: an advance is undone by its opposite across the wrap", "[clock]") {
    auto c = Clock<double>::at(0.25, T);
    for (const double dt : {0.5 * T, T, 3.75 * T}) {
        auto d = c;
        d.advance(dt);
        CHECK(c.until(d) == Approx(dt).epsilon(4 * epsilon<double>));
        d.advance(-dt);
        CHECK(d.index == c.index);
        // a few roundings at the size of 4 T
        CHECK(std::abs(d.local + d.carry - c.local) <= 4 * ulp(4 * T));
    }
}

TEMPLATE_TEST_CASE("clock: every scalar keeps time", "[clock]", float, long double) {
    using S = TestType;
    auto c = Clock<S>::at(S(0), S(1));
    for (int k = 0; k < 1000; ++k)
        c.advance(S(0.375)); // exact in binary
    CHECK(c.index == 375);
    CHECK(c.local == S(0));
    for (int k = 0; k < 2000; ++k)
        c.advance(S(-0.375));
    CHECK(c.index == -375);
    CHECK(c.local == S(0));
}

TEST_CASE("clock: many periods at once are one step", "[clock]") {
    auto c = Clock<double>::at(0.25, 1.0);
    c.advance(1e15); // nothing may count to that
    CHECK(c.index == 1'000'000'000'000'000);
    CHECK(c.local == 0.25);
    c.advance(-1e15);
    CHECK(c.index == 0);
    CHECK(c.local == 0.25);
}

namespace {

/// x' = cos(omega t), with the period that the formula gives.
struct Driven {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"omega"};
    template <Scalar S> Vec<S, 1> f1(const S& t, const Vec<S, 1>&, const Vec<S, 1>& p) const {
        using std::cos;
        return Vec<S, 1>(cos(p[0] * t));
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 1>&) const {
        return x[0] - S(100);
    }
    template <Scalar S> S period(const Vec<S, 1>& p) const { return S(6.283185307179586) / p[0]; }
};

} // namespace

TEST_CASE("clock: a period that is no finite number > 0 is none", "[clock]") {
    Settings<double, 1> settings;
    const Vec<double, 1> origin(0);
    const auto to_2 = [&](double omega) {
        return flow(Driven{}, Vec<double, 1>(omega), origin, 0.0, 2.0, settings);
    };
    CHECK(to_2(0).status == Status::ok); // 2 pi / 0
    CHECK(to_2(0).t == 2);
    CHECK(to_2(0).x[0] == Approx(2));
    CHECK(to_2(-1).x[0] == Approx(std::sin(2.0)));
    CHECK(to_2(1e-320).x[0] == Approx(2));
    // too short to tell the phase of t_end
    CHECK_THROWS_WITH(to_2(1e300), Catch::Matchers::ContainsSubstring("period = 6.28319e-300"));
    CHECK_THROWS_AS(to_2(1e17), std::invalid_argument);
}
