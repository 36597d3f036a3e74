// SPDX-License-Identifier: BSD-3-Clause
// What a step shows of a guard, and landing on an event, on functions instead of trajectories.
#include "catch.hpp"

#include <filippov/ensemble/detail/lane_guards.hpp>
#include <filippov/events/guards.hpp>
#include <filippov/events/landing.hpp>
#include <filippov/methods/dormand_prince5.hpp>
#include <filippov/methods/dormand_prince8.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;

namespace {

using Track = Trace<double>;
template <class Times> constexpr const ProbeTimes<double>& times = probe_times<Times, double>;
template <class Tableau> using Stages = StageTimes<Tableau, double>;
using Sixths = WindowTimes<double>;

template <class Times, class F> Track track(F f) {
    Track t;
    t.sense = 1;
    t.start = f(0.0);
    for (std::size_t k = 1; k <= Times::n; ++k)
        t.probe[k] = f(Times::theta(k));
    t.see(times<Times>);
    return t;
}

} // namespace

TEMPLATE_TEST_CASE("guards: probes are read in the order of their times", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>, Sixths) {
    for (std::size_t i = 1; i < TestType::in_time.size(); ++i)
        CHECK(TestType::theta(TestType::in_time[i - 1]) <= TestType::theta(TestType::in_time[i]));
    CHECK(TestType::theta(TestType::n) == 1);
    CHECK(track<TestType>([](double u) { return u; }).turns(times<TestType>) == 0);
    CHECK(track<TestType>([](double u) { return std::exp(-u); }).turns(times<TestType>) == 0);
    CHECK(track<TestType>([](double u) { return u * (1 - u); }).turns(times<TestType>) == 1);
    const auto wave = [](double u) { return std::cos(6 * std::numbers::pi * u); };
    CHECK(track<TestType>(wave).turns(times<TestType>) > 1);
}

TEMPLATE_TEST_CASE("guards: a parabola that dips to zero is never overlooked", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>, Sixths) {
    // touching zero at any place, opening upwards, or falling through zero anywhere in the step
    for (double at = 1e-3; at < 1; at += 1e-3) {
        CAPTURE(at);
        const auto touch = [at](double u) { return (u - at) * (u - at); };
        REQUIRE(track<TestType>(touch).doubtful(times<TestType>));
        const auto root = [at](double u) { return (at - u) * (1 + 0.5 * u); };
        REQUIRE(track<TestType>(root).doubtful(times<TestType>));
    }
    // far from zero, or leaving it all the way, there is no doubt
    const auto high = [](double u) { return 1 + 0.1 * std::sin(6 * u); };
    CHECK_FALSE(track<TestType>(high).doubtful(times<TestType>));
    const auto leaving = [](double u) { return 0.1 + u; };
    CHECK_FALSE(track<TestType>(leaving).doubtful(times<TestType>));
    // a start on a root that is divided out: 3 u + u^2 leaves, u (0.5 - u) comes back
    auto away = track<TestType>([](double u) { return 3 * u + u * u; });
    away.order = 1;
    CHECK_FALSE(away.doubtful(times<TestType>));
    auto back = track<TestType>([](double u) { return u * (0.5 - u); });
    back.order = 1;
    CHECK(back.doubtful(times<TestType>));
    // a side that is not known yet
    auto unknown = track<TestType>(high);
    unknown.sense = 0;
    CHECK(unknown.doubtful(times<TestType>));
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
        CHECK(range.low[0] == one.range(times<TestType>).low);
        CHECK(range.high[3] == one.range(times<TestType>).high);
        CHECK(range.high[2] == 7.0);
        CHECK(all.turns()[0] == one.turns(times<TestType>));
        CHECK(all.turns()[3] == one.turns(times<TestType>));
    };
    for (const double swings : {0.0, 0.4, 1.0, 1.7, 3.0, 6.0})
        check([swings](double u) { return 1.5 + std::cos(swings * std::numbers::pi * u); });
    check([](double u) { return std::max(0.4, u); });
    check([](double u) { return 0.3 - u; });
}

TEST_CASE("guards: a plain fall through zero is bracketed by two probes", "[guards]") {
    const auto falls = [](auto f) { return track<Sixths>(f).falls_through(times<Sixths>); };
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
    CHECK(root.falls_through(times<Sixths>) == 0);
}

using Samples = SampleTimes<double>;

TEST_CASE("guards: samples lie nowhere farther apart than a sixteenth of the step", "[guards]") {
    double before = 0, widest = 0, narrowest = 1;
    for (std::size_t k = 1; k <= Samples::n; ++k) {
        widest = std::max(widest, Samples::theta(k) - before);
        narrowest = std::min(narrowest, Samples::theta(k) - before);
        before = Samples::theta(k);
    }
    CHECK(before == 1);
    CHECK(widest <= 1.0 / 16);
    CHECK(narrowest > 0);
    // no frequency up to a thousand in a step looks like another, slow one
    for (double cycles = 12; cycles < 1000; cycles += 0.037) {
        double cosine = 0, sine = 0;
        for (std::size_t k = 1; k < Samples::n; ++k) {
            cosine += std::cos(2 * std::numbers::pi * cycles * Samples::theta(k));
            sine += std::sin(2 * std::numbers::pi * cycles * Samples::theta(k));
        }
        REQUIRE(std::hypot(cosine, sine) < 0.55 * (Samples::n - 1));
    }
}

namespace {

template <class Times, class F> Fit<double> fit(F f) {
    const Track t = track<Times>(f);
    return fit_of(times<Times>, t.start, [&](std::size_t k) { return t.probe[k]; });
}

} // namespace

TEMPLATE_TEST_CASE("guards: a fit tells a cubic from what is none", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>, Sixths) {
    const auto cubic = fit<TestType>([](double u) { return 1 - u + 3 * u * u - 2 * u * u * u; });
    CHECK(cubic.off < 1e-14);
    CHECK(cubic.floor == Approx(2.0 / 3)); // its Bernstein coefficients are 1, 2/3, 4/3, 1
    CHECK(cubic.clear());
    CHECK(cubic.resolved());
    for (const double swings : {1.0, 3.0, 10.0, 77.0, 1000.0}) {
        CAPTURE(swings);
        const auto wave = [swings](double mean) {
            return fit<TestType>(
                [=](double u) { return mean + std::cos(2 * std::numbers::pi * swings * u); });
        };
        CHECK_FALSE(wave(0.8).clear());
        CHECK_FALSE(wave(0.8).resolved());
        CHECK(wave(0.8).room() < 1);
        CHECK(wave(100.0).clear());
    }
    const auto broken = fit<TestType>([](double u) { return u < 0.1 ? 1 : std::nan(""); });
    CHECK_FALSE(broken.clear());
    CHECK_FALSE(broken.resolved());
    CHECK(broken.room() < 1);
}

TEST_CASE("guards: the room of a fit is where a wave is a twentieth of its spread off",
          "[guards]") {
    for (const double cycles : {0.05, 0.1, 0.2, 0.4}) {
        const auto wave = [](double span) {
            return fit<Samples>(
                [=](double u) { return 0.5 + std::cos(2 * std::numbers::pi * span * u); });
        };
        const double room = wave(cycles).room();
        CHECK(room > 1);
        const auto longer = wave(cycles * room);
        CHECK((longer.clear() || longer.off < 0.2 * longer.spread));
    }
}

TEMPLATE_TEST_CASE("guards, in lanes: a fit is that of one guard", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>, Samples) {
    for (const double swings : {0.0, 0.4, 1.0, 1.7, 3.0, 60.0}) {
        const auto f = [swings](double u) { return 1.5 + std::cos(swings * std::numbers::pi * u); };
        const Fit<double> one = fit<TestType>(f);
        std::array<Lanes<4>, TestType::n + 1> v;
        v[0] = f(0.0);
        for (std::size_t k = 1; k <= TestType::n; ++k) {
            v[k] = f(TestType::theta(k));
            v[k].set(1, std::nan(""));
        }
        const Fit<Lanes<4>> all = lanes::fit_of<TestType>(v);
        CHECK(all.off[0] == Approx(one.off).margin(1e-13));
        CHECK(all.floor[2] == Approx(one.floor).epsilon(1e-12));
        CHECK(all.spread[3] == one.spread);
        CHECK((all.clear().word() & 1u) == unsigned(one.clear()));
        CHECK((all.clear().word() & 2u) == 0u);
        CHECK((all.resolved().word() & 2u) == 0u);
    }
}

TEST_CASE("guards, in lanes: samples show a root, nothing, or that they show too little",
          "[guards]") {
    const auto look = [](auto f) {
        std::array<Lanes<4>, Samples::n + 1> v;
        for (std::size_t k = 0; k <= Samples::n; ++k)
            v[k] = f(Samples::theta(k));
        return lanes::look_at_samples<Samples>(v);
    };
    const auto falls = look([](double u) { return 0.41 - u * u; });
    CHECK(falls.found.word() == 0b1111u);
    CHECK(falls.hard.word() == 0u);
    CHECK(falls.low[0] * falls.low[0] < 0.41);
    CHECK(falls.high[0] * falls.high[0] > 0.41);
    const auto passes = look([](double u) { return 0.5 + u - u * u; });
    CHECK(passes.found.word() == 0u);
    CHECK(passes.hard.word() == 0u);
    for (const double at : {0.05, 0.3, 0.51, 0.97}) // a dip that no sample need show
        CHECK(look([at](double u) { return (u - at) * (u - at) - 1e-5; }).hard.word() == 0b1111u);
    CHECK(look([](double u) { return 0.5 + std::cos(20 * u); }).hard.word() == 0b1111u);
    CHECK(look([](double u) { return 0.9 + std::cos(2000 * u); }).hard.word() == 0b1111u);
    CHECK(look([](double) { return std::nan(""); }).hard.word() == 0b1111u);
}

TEMPLATE_TEST_CASE("guards: the next zero of a parabola is exact", "[guards]",
                   Stages<DormandPrince5>, Stages<DormandPrince8>) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    const auto next = [](auto f, double within = std::numeric_limits<double>::infinity()) {
        return track<TestType>(f).next_zero(times<TestType>, within);
    };
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
    // what lies plainly later than asked need not be told
    for (const double root : {1.01, 1.5, 3.0, 100.0})
        for (const double bend : {-1.0, -0.3, 0.0, 0.3, 1.0}) {
            const auto f = [&](double u) { return (root - u) * (1 + bend * u); };
            for (const double within : {0.99, 1.01, 2.0})
                CHECK(next(f, within * (root - 1)) >= std::min(next(f), within * (root - 1)));
            CHECK(next(f, 1.01 * (root - 1)) == next(f));
        }
    CHECK(next([](double u) { return 2 - u; }, 0.9) == inf);
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
