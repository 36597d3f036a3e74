// SPDX-License-Identifier: BSD-3-Clause
// Lyapunov exponents, against multipliers of orbits and closed forms.

#include "catch.hpp"
#include "systems.hpp"

#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/lyapunov.hpp>
#include <filippov/orbits/maps.hpp>
#include <filippov/orbits/orbit.hpp>

#include <cmath>
#include <numbers>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

/// Two linear fields that meet in a crossing: x' = -a x + b, y' = -c y +- d, h = x; unforced.
/// Far from the surface every exponent is that of the linear field.
struct Decay {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"a", "c"};
    static constexpr std::array<double, 2> defaults{0.3, 0.7};
    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {p[0] * (S(1) - x[0]), -p[1] * x[1]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {p[0] * (S(1) - x[0]), -p[1] * x[1]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const { return x[0]; }
};

/// x' = -x + cos(t)/10, y' = -k y: y rests at zero while x moves, and its neighbours are stiff.
struct Resting {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"k"};
    static constexpr std::array<double, 1> defaults{50};
    template <Scalar S> S period(const Vec<S, 1>&) const { return S(2 * std::numbers::pi); }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        using std::cos;
        return {S(0.1) * cos(t) - x[0], -p[0] * x[1]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 1>&) const {
        return x[0] - S(100);
    }
};

} // namespace

TEST_CASE("lyapunov: where the solution rests its neighbours may be stiff", "[lyapunov]") {
    const auto system = any_system(Resting{});
    const double T = 2 * std::numbers::pi;
    for (const double k : {2.0, 7.0, 50.0, 300.0}) {
        CAPTURE(k);
        const Vector p = Vector::Constant(1, k);
        const Vector rest = Vector::Unit(2, 0) * 0.05;
        const Lyapunov l = lyapunov(*system, p, rest, {.transient = 20, .window = 40});
        REQUIRE(l.status == Status::ok);
        // a stretch is followed in parts so short that nothing is hidden: 1e-7 of each
        CHECK(l.exponents[0] == Approx(-1).epsilon(1e-6));
        CHECK(l.exponents[1] == Approx(-k).epsilon(1e-6));
        CHECK(l.error.maxCoeff() < 1e-6 * k);
        // derivatives of one period, each to its own size: e^-2 pi and e^-2 pi k
        const Mapped m = strobe(*system, 0, rest, p);
        REQUIRE(m.ok());
        CHECK(m.slope(0, 0) == Approx(std::exp(-T)).epsilon(1e-7));
        CHECK(std::abs(m.slope(1, 1)) <= std::exp(-T * k) * 1.001 + 1e-300); // or next to 0
        CHECK(m.slope(1, 0) == 0);
    }
    // stiffer than any number of halves: refused, not wrong
    const Vector p = Vector::Constant(1, 1e9);
    const Mapped m = strobe(*system, 0, Vector::Unit(2, 0) * 0.05, p);
    CHECK(m.status == Status::step_too_small);
    CHECK_THAT(m.message, ContainsSubstring("stiff"));
}

TEST_CASE("lyapunov: on a periodic orbit it is the logarithm of the multiplier", "[lyapunov]") {
    const auto system = oscillator_system();
    struct Case {
        double A, omega, window;
    };
    // windows of whole cycles: 4, 4, 4, 1 forcing periods
    for (const Case& c :
         {Case{0.5, 2.94, 400}, {0.5, 2.9, 400}, {0.5, 2.895, 400}, {5, 2.8, 200}}) {
        CAPTURE(c.A, c.omega);
        const Vector p = params_at(*system, c.A, c.omega);
        const Orbit orbit = settle(*system, p, Vector::Zero(2));
        REQUIRE(orbit.status == Status::ok);
        const Lyapunov l =
            lyapunov(*system, p, Vector::Zero(2), {.transient = 300, .window = c.window});
        REQUIRE(l.status == Status::ok);
        CHECK(l.exponents[0] ==
              Approx(std::log(std::abs(orbit.multipliers[0])) / orbit.cycle.period).epsilon(1e-9));
        CHECK(l.exponents[1] == -inf);
        CHECK(l.error[0] < 1e-10);
        CHECK(l.error[1] == 0);
        CHECK(l.slides > 0);
        CHECK(l.skipped == 0);
        CHECK(l.stretches == std::llround(c.window));
        CHECK(l.t_end - l.t_begin == Approx(c.window * system->period(p, {}).value));
    }
}

TEST_CASE("lyapunov: with crossings alone all exponents are finite", "[lyapunov]") {
    const auto system = oscillator_system();
    const Vector p = params_at(*system, 5, 1.6); // figure 4.9: no stick
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    REQUIRE(orbit.cycle.word.string() == "-+");
    const Lyapunov l = lyapunov(*system, p, Vector::Zero(2), {.transient = 300, .window = 200});
    REQUIRE(l.status == Status::ok);
    CHECK(l.slides == 0);
    double sum = 0;
    for (const auto& m : orbit.multipliers)
        sum += std::log(std::abs(m)) / orbit.cycle.period;
    CHECK(l.exponents.sum() == Approx(sum).epsilon(1e-9));
    CHECK(l.exponents[0] >= l.exponents[1]);
}

TEST_CASE("lyapunov: a slide before the window takes nothing from it", "[lyapunov]") {
    // Friction falls with speed; the run sticks once, at the beginning, and never again.
    const auto system = oscillator_system();
    const Vector p = params_at(*system, 5, 1.6);
    Vector x(2);
    x << 0.1, 1;
    REQUIRE(system->run(0, x, 1, p).events[0].after == 0);
    const Orbit orbit = settle(*system, p, x);
    REQUIRE(orbit.cycle.word.string() == "-+");
    double sum = 0;
    for (const auto& m : orbit.multipliers)
        sum += std::log(std::abs(m)) / orbit.cycle.period;
    for (const double transient : {20.0, 60.0, 100.0}) {
        CAPTURE(transient);
        const Lyapunov l = lyapunov(*system, p, x, {.transient = transient, .window = 200});
        REQUIRE(l.status == Status::ok);
        CHECK(l.slides == 0);
        REQUIRE(l.exponents.allFinite());
        CHECK(l.exponents.sum() == Approx(sum).epsilon(1e-4));
    }
}

TEST_CASE("lyapunov: an autonomous cycle has the exponent zero", "[lyapunov]") {
    const auto system = dieci_lopez_system();
    const Lyapunov l = lyapunov(*system, system->defaults(), Vector::Zero(2),
                                {.transient = 200, .window = 9.230770458083 * 100, .stretch = 0.5});
    REQUIRE(l.status == Status::ok);
    // bounded growth over the window: no more than its inverse
    CHECK(std::abs(l.exponents[0]) < 3 / (l.t_end - l.t_begin));
    CHECK(l.exponents[1] == -inf);
}

TEST_CASE("lyapunov: a node's exponents are its eigenvalues", "[lyapunov]") {
    const auto system = any_system(Decay{});
    const Vector x0 = Eigen::Vector2d(-2, 1);
    // a tangent vector to nothing but the far field: the transient crosses the surface
    // at a point of rest the steps grow to the stretch; those of the tangent vectors may not
    for (const double stretch : {0.5, 2.0, 10.0}) {
        CAPTURE(stretch);
        const Lyapunov l = lyapunov(*system, system->defaults(), x0,
                                    {.transient = 100, .window = 200, .stretch = stretch});
        REQUIRE(l.status == Status::ok);
        CHECK(l.exponents[0] == Approx(-0.3).epsilon(1e-10));
        CHECK(l.exponents[1] == Approx(-0.7).epsilon(1e-10));
    }
}

TEST_CASE("lyapunov: relay feedback in three dimensions keeps its rank", "[lyapunov]") {
    const auto system = relay_system();
    Vector p(6), x0(3);
    p << 1, 1, 1, 1, -2, 1;
    x0 << 0, 0.5, 0;
    const Orbit orbit = settle(*system, p, x0, {.transient = 100});
    REQUIRE(orbit.status == Status::ok);
    const Lyapunov l = lyapunov(
        *system, p, x0,
        {.transient = 100, .window = orbit.cycle.period * 20, .stretch = orbit.cycle.period});
    REQUIRE(l.status == Status::ok);
    CHECK(l.exponents[0] == Approx(0).margin(1e-9));
    CHECK(l.exponents[1] ==
          Approx(std::log(std::abs(orbit.multipliers[1])) / orbit.cycle.period).epsilon(1e-7));
    CHECK(l.exponents[2] == -inf);
}

TEST_CASE("lyapunov: a run that fails says why, and can be stopped", "[lyapunov]") {
    const auto system = oscillator_system({.max_steps = 5});
    const Vector p = params_at(*system, 0.5, 2.94);
    const Lyapunov l = lyapunov(*system, p, Vector::Zero(2), {.transient = 0, .window = 100});
    CHECK(l.status == Status::max_steps);
    CHECK_FALSE(l.message.empty());
    CHECK(std::isnan(l.exponents[0]));

    int asked = 0;
    const auto good = oscillator_system({.interrupted = [&] { return ++asked > 5; }});
    const Lyapunov stopped = lyapunov(*good, p, Vector::Zero(2));
    CHECK(stopped.status == Status::interrupted);
}

TEST_CASE("lyapunov: what makes no sense is refused", "[lyapunov]") {
    const auto system = oscillator_system();
    const Vector p = system->defaults(), x0 = Vector::Zero(2);
    const auto words = [&](const Vector& x, const LyapunovSettings& settings) -> std::string {
        try {
            (void)lyapunov(*system, p, x, settings);
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
        return "";
    };
    CHECK_THAT(words(Vector::Zero(3), {}), ContainsSubstring("x0.size() = 3"));
    CHECK_THAT(words(Eigen::Vector2d(0, inf), {}), ContainsSubstring("x0[1] = inf"));
    CHECK_THAT(words(x0, {.transient = -1}), ContainsSubstring("transient = -1"));
    CHECK_THAT(words(x0, {.window = 10}), ContainsSubstring("window = 10"));
    CHECK_THAT(words(x0, {.stretch = std::nan("")}), ContainsSubstring("stretch = nan"));
    CHECK_THAT(words(x0, {.batches = 1}), ContainsSubstring("batches = 1"));
}
