// SPDX-License-Identifier: BSD-3-Clause
// What a step shows of a guard, and landing on an event, on functions instead of trajectories.
#include "catch.hpp"

#include <filippov/dormand_prince5.hpp>
#include <filippov/dormand_prince8.hpp>
#include <filippov/guards.hpp>
#include <filippov/landing.hpp>
#include <filippov/lane_guards.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;

namespace {

using Track = Trace<double, 16>;
template <class Tableau> using Stages = StageTimes<Tableau, double>;
using Sixths = WindowTimes<double>;

template <class Times, class F> Track track(F f) {
    Track t;
    t.sense = 1;
    t.start = f(0.0);
    for (std::size_t k = 1; k <= Times::n; ++k)
        t.probe[k] = f(Times::theta(k));
    return t;
}

} // namespace

TEMPLATE_TEST_CASE("guards: probes are read in the order of their times", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>, Sixths) {
    for (std::size_t i = 1; i < TestType::in_time.size(); ++i)
        CHECK(TestType::theta(TestType::in_time[i - 1]) <= TestType::theta(TestType::in_time[i]));
    CHECK(TestType::theta(TestType::n) == 1);
    CHECK(track<TestType>([](double u) { return u; }).template turns<TestType>() == 0);
    CHECK(track<TestType>([](double u) { return std::exp(-u); }).template turns<TestType>() == 0);
    CHECK(track<TestType>([](double u) { return u * (1 - u); }).template turns<TestType>() == 1);
    const auto wave = [](double u) { return std::cos(6 * std::numbers::pi * u); };
    CHECK(track<TestType>(wave).template turns<TestType>() > 1);
}

TEMPLATE_TEST_CASE("guards: a parabola that dips to zero is never overlooked", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>, Sixths) {
    // touching zero at any place, opening upwards, or falling through zero anywhere in the step
    for (double at = 1e-3; at < 1; at += 1e-3) {
        CAPTURE(at);
        const auto touch = [at](double u) { return (u - at) * (u - at); };
        REQUIRE(track<TestType>(touch).template doubtful<TestType>(false));
        const auto root = [at](double u) { return (at - u) * (1 + 0.5 * u); };
        REQUIRE(track<TestType>(root).template doubtful<TestType>(false));
    }
    // far from zero, or leaving it all the way, there is no doubt
    const auto high = [](double u) { return 1 + 0.3 * std::sin(6 * u); };
    CHECK_FALSE(track<TestType>(high).template doubtful<TestType>(false));
    const auto leaving = [](double u) { return 0.1 + u; };
    CHECK_FALSE(track<TestType>(leaving).template doubtful<TestType>(false));
    // a start on a root that is divided out: 3 u + u^2 leaves, u (0.5 - u) comes back
    auto away = track<TestType>([](double u) { return 3 * u + u * u; });
    away.order = 1;
    CHECK_FALSE(away.template doubtful<TestType>(false));
    auto back = track<TestType>([](double u) { return u * (0.5 - u); });
    back.order = 1;
    CHECK(back.template doubtful<TestType>(false));
    // a side that is not known yet
    auto unknown = track<TestType>(high);
    unknown.sense = 0;
    CHECK(unknown.template doubtful<TestType>(false));
}

TEMPLATE_TEST_CASE("guards, in lanes: a fall goes down from probe to probe, and not from a root",
                   "[guards]", Stages<DormandPrince5>, Stages<DormandPrince8>) {
    using T = Lanes<4>;
    const auto falls = [](auto f, double order = 0) {
        lanes::Probed<TestType, 4> guard{T(f(0.0)), T(order), {}};
        for (std::size_t k = 1; k <= TestType::n; ++k)
            guard.probe[k] = f(TestType::theta(k));
        return guard.falls().word();
    };
    CHECK(falls([](double u) { return 0.8 - u; }) == 0b1111u);
    CHECK(falls([](double u) { return 0.8 - u; }, 1) == 0u);
    CHECK(falls([](double u) { return u - 0.5; }) == 0u);
    // down, up again and through: two roots more than a fall has
    CHECK(falls([](double u) { return 0.5 - u + 0.4 * std::sin(7 * u); }) == 0u);
    lanes::Probed<TestType, 4> one{T(1), T(0), {}};
    for (std::size_t k = 1; k <= TestType::n; ++k) {
        one.probe[k] = 1 - 2 * TestType::theta(k);
        one.probe[k].set(2, 1.0 + TestType::theta(k));
    }
    CHECK(one.falls().word() == 0b1011u);
}

TEMPLATE_TEST_CASE("guards, in lanes: range and turns are those of one guard", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>) {
    const auto check = [](auto f) {
        auto one = track<TestType>(f);
        lanes::Probed<TestType, 4> all{one.start, 0.0, {}};
        for (std::size_t k = 1; k <= TestType::n; ++k) {
            all.probe[k] = one.probe[k];
            all.probe[k].set(1, std::nan(""));
        }
        all.start.set(2, 7.0);
        const auto range = all.range();
        CHECK(range.low[0] == one.template range<TestType>().low);
        CHECK(range.high[3] == one.template range<TestType>().high);
        CHECK(range.high[2] == 7.0);
        CHECK(all.turns()[0] == one.template turns<TestType>());
        CHECK(all.turns()[3] == one.template turns<TestType>());
    };
    for (const double swings : {0.0, 0.4, 1.0, 1.7, 3.0, 6.0})
        check([swings](double u) { return 1.5 + std::cos(swings * std::numbers::pi * u); });
    check([](double u) { return std::max(0.4, u); });
    check([](double u) { return 0.3 - u; });
}

TEST_CASE("guards: a plain fall through zero is bracketed by two probes", "[guards]") {
    const auto falls = [](auto f) { return track<Sixths>(f).template falls_through<Sixths>(); };
    CHECK(falls([](double u) { return 0.4 - u; }) == 3);
    CHECK(falls([](double u) { return 1 - std::exp(u) / 2; }) == 5);
    CHECK(falls([](double u) { return 0.1 + u * (0.8 - u) * 3; }) == 6);      // rises, then falls
    CHECK(falls([](double u) { return 1 - u / 2; }) == 0);                    // not in this step
    CHECK(falls([](double u) { return (u - 0.3) * (u - 0.3) - 0.01; }) == 2); // at 0.2
    CHECK(falls([](double u) { return 0.5 + std::cos(20 * u); }) == 0);       // not resolved
    for (const double middle : {0.1, 0.4, 0.9}) // three roots where two probes see one
        CHECK(falls([middle](double u) {
                  const double v = u - middle;
                  return v * (1e-4 - v * v);
              }) == 0);
    auto root = track<Sixths>([](double u) { return u * (0.5 - u); });
    root.order = 1;
    CHECK(root.falls_through<Sixths>() == 0);
}

TEMPLATE_TEST_CASE("guards: swings count where they could reach zero", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>) {
    const auto wave = [](double mean) {
        return [mean](double u) { return mean + std::cos(6 * std::numbers::pi * u); };
    };
    CHECK(track<TestType>(wave(1.0)).template swings<TestType>(1e-9));
    CHECK_FALSE(track<TestType>(wave(9.0)).template swings<TestType>(1e-9));
    CHECK_FALSE(track<TestType>(wave(1.0)).template swings<TestType>(3.0)); // within the band
    CHECK_FALSE(track<TestType>([](double u) { return 1 - u; }).template swings<TestType>(1e-9));
}

TEMPLATE_TEST_CASE("guards: the next zero of a parabola is exact", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    const auto next = [](auto f) { return track<TestType>(f).template next_zero<TestType>(); };
    for (const double root : {1.01, 1.5, 3.0, 100.0}) {
        CHECK(next([root](double u) { return root - u; }) == Approx(root - 1).epsilon(1e-9));
        CHECK(next([root](double u) { return (root - u) * (1 + u); }) ==
              Approx(root - 1).epsilon(1e-9));
        CHECK(next([root](double u) { return (root - u) * (root + 1 - u) * 1e-300; }) ==
              Approx(root - 1).epsilon(1e-7));
    }
    CHECK(next([](double u) { return 1 + u; }) == inf);
    CHECK(next([](double u) { return 1 + (u - 2) * (u - 2); }) == inf);
    CHECK(next([](double) { return std::nan(""); }) == inf);
    CHECK(next([](double) { return 0.0; }) == inf);
    CHECK(next([](double u) { return 0.5 - u; }) == inf); // over already
}

namespace {

/// A path along a line: its end is its length.
struct Ruler {
    double dt;
    double inexact = 0; ///< error of a Taylor step
    int taken = 0;
    void shorten(double d) {
        dt = d;
        ++taken;
    }
    void nudge(double delta) { dt += delta * (1 + inexact); }
    double nudge_error(double delta) const { return std::abs(inexact * delta) * 1e12; }
    bool finite() const { return dt < edge; }
    double edge = 1e300; ///< from here on it is undefined
};

} // namespace

TEST_CASE("landing: ends where the residual does, from either side", "[guards]") {
    for (const double direction : {1.0, -1.0})
        for (const double at : {1e-6, 0.1, 0.5, 0.999})
            for (const double guess : {0.9 * at, at, std::min(1.1 * at, 1.0)})
                for (const double inexact : {0.0, 1e-3}) {
                    CAPTURE(direction, at, guess, inexact);
                    Ruler path{direction, inexact};
                    const auto residual = [&] { return std::tanh(at - direction * path.dt); };
                    const Landed landed = Landing(path, 0.0, 0.01, residual, [] {
                                              return true;
                                          }).run(direction * guess, -direction);
                    CHECK(path.dt == Approx(direction * at).epsilon(1e-14));
                    CHECK_FALSE(landed.jumped);
                    CHECK(landed.trials <= 12);
                }
}

TEST_CASE("landing: a jump of the residual is stopped at just beyond", "[guards]") {
    Ruler path{1};
    const auto residual = [&] { return path.dt < 0.3 ? 1.0 : -1.0; };
    const auto on_target = [] { return false; };
    const Landed landed = Landing(path, 0.0, 0.01, residual, on_target).run(0.5, -1.0);
    CHECK(landed.jumped);
    CHECK(landed.seen_beyond);
    CHECK(path.dt >= 0.3);
    CHECK(path.dt == Approx(0.3).epsilon(1e-14));
}

TEST_CASE("landing: what is undefined at the event is met just before it", "[guards]") {
    Ruler path{1};
    path.edge = 0.3;
    const auto residual = [&] { return std::abs(path.dt - 0.3); };
    Landing(path, 0.0, 0.01, residual, [] { return true; }).run(0.5, -1.0);
    CHECK(path.finite());
    CHECK(path.dt == Approx(0.3).epsilon(1e-14));
}

TEST_CASE("landing: no root is said to be none, in a bounded number of trials", "[guards]") {
    Ruler path{1};
    const Landed landed =
        Landing(path, 0.0, 0.01, [] { return 1.0; }, [] { return false; }).run(0.5, -1.0);
    CHECK_FALSE(landed.seen_beyond);
    CHECK(landed.trials <= 100);
    Ruler broken{1};
    const Landed lost = Landing(
                            broken, 0.0, 0.01, [] { return std::nan(""); }, [] { return false; })
                            .run(0.5, -1.0);
    CHECK(lost.trials <= 100);
}
