// SPDX-License-Identifier: BSD-3-Clause
// Time stepping, the method without events.
#include "catch.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/engine/time_stepping.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/switches.hpp>
#include <filippov/system/smoothing.hpp>

#include <cmath>
#include <limits>
#include <string>

using namespace filippov;
using Catch::Matchers::WithinAbs;

namespace {

/// P15: x' = -sign x + 2 sign y, y' = -2 sign x - sign y.
struct Spiral {
    static constexpr int dim = 2, surfaces = 2;
    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {S(2) * s[1] - s[0], S(-2) * s[0] - s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
};

/// x' = 1 + sqrt(-x): there is no state beyond x = 0.
struct Ends {
    static constexpr int dim = 1;
    template <Scalar S>
    Vec<S, 1> field(const S&, const Vec<S, 1>& x, const S& s, const Vec<S, 0>&) const {
        using std::sqrt;
        return Vec<S, 1>(S(1) + sqrt(-x[0]) + S(0) * s);
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        return x[0] + S(10);
    }
};

/// x' = sign(x)/10, y' = -y^3.
struct Apart {
    static constexpr int dim = 2;
    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const S& s, const Vec<S, 0>&) const {
        return {S(0.1) * s, -x[1] * x[1] * x[1]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[0]; }
};

/// x' = sign x + 1/10: repels.
struct Repels {
    static constexpr int dim = 1;
    template <Scalar S>
    Vec<S, 1> field(const S&, const Vec<S, 1>&, const S& s, const Vec<S, 0>&) const {
        return Vec<S, 1>(s + S(0.1));
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const { return x[0]; }
};

/// Slope of log error against log step over nine numbers of steps.
template <class Sys>
double order(const Sys& sys, const Params<Sys, double>& p, const Vec<double, dim_v<Sys>>& x0,
             double t_end, const Vec<double, dim_v<Sys>>& exact, std::string& table,
             double theta = 1) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (long long steps = 4'000; steps <= (theta < 1 ? 512'000 : 1'024'000); steps *= 2) {
        const auto r =
            time_stepping(sys, p, x0, 0.0, t_end, {.steps = steps, .theta = theta, .keep = steps});
        REQUIRE(r.status == Status::ok);
        const double error = (r.x.back() - exact).cwiseAbs().maxCoeff();
        table += std::to_string(steps) + ": " + std::to_string(error) + "\n";
        const double x = -std::log(double(steps)), y = std::log(error);
        n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

template <class Sys>
Vec<double, dim_v<Sys>> event_driven(const Sys& sys, const Params<Sys, double>& p,
                                     const Vec<double, dim_v<Sys>>& x0, double t_end) {
    Settings<double, dim_v<Sys>> settings;
    settings.rtol = 1e-11;
    settings.atol = AbsoluteTolerance<double, dim_v<Sys>>(1e-12);
    const auto r = flow<DormandPrince8>(sys, p, x0, 0.0, t_end, settings);
    REQUIRE(r.status == Status::ok);
    return r.x;
}

} // namespace

TEST_CASE("time_stepping: first order over crossings, stick and slip", "[time_stepping]") {
    std::string table;
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const double t_end = 20 * sys.period(p);
    const Vec<double, 2> x0(0, 0);
    const double slope = order(sys, p, x0, t_end, event_driven(sys, p, x0, t_end), table);
    INFO(table << "slope " << slope);
    CHECK(slope > 0.9);
    CHECK(slope < 1.1);
}

TEST_CASE("time_stepping: the trapezoidal rule has second order over stick and slip",
          "[time_stepping]") {
    std::string table;
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const double t_end = 20 * sys.period(p);
    const Vec<double, 2> x0(0, 0);
    const double slope = order(sys, p, x0, t_end, event_driven(sys, p, x0, t_end), table, 0.5);
    INFO(table << "slope " << slope);
    CHECK(slope > 1.7);
}

TEST_CASE("time_stepping: crossings leave the trapezoidal rule first order", "[time_stepping]") {
    std::string table;
    const models::Oscillator sys;
    auto p = default_params<models::Oscillator>();
    p[0] = 5;
    p[1] = 1.6;
    const double t_end = 20 * sys.period(p);
    const Vec<double, 2> x0(0, 0);
    const double slope = order(sys, p, x0, t_end, event_driven(sys, p, x0, t_end), table, 0.5);
    INFO(table << "slope " << slope);
    CHECK(slope > 0.7);
    CHECK(slope < 1.5);
}

TEST_CASE("time_stepping: first order in three dimensions, from a slide on", "[time_stepping]") {
    std::string table;
    const Blended<models::Relay> sys;
    const auto p = default_params<models::Relay>();
    const Vec<double, 3> x0(0, -0.001, -0.02);
    const double slope = order(sys, p, x0, 4, event_driven(models::Relay{}, p, x0, 4), table);
    INFO(table << "slope " << slope);
    CHECK(slope > 0.9);
    CHECK(slope < 1.1);
}

TEST_CASE("time_stepping: P1 comes to rest and stays there to the last bit", "[time_stepping]") {
    const auto r = time_stepping(Blended<models::Coulomb>{}, default_params<models::Coulomb>(),
                                 Vec<double, 2>(3, 0), 0.0, 40.0, {.steps = 40'000});
    REQUIRE(r.status == Status::ok);
    REQUIRE(r.t.size() == 40'001);
    CHECK_THAT(r.x.back()[0], WithinAbs(-0.2, 0.03)); // first order: half a step's drift a swing
    for (std::size_t i = 20'000; i < r.t.size(); ++i) {
        REQUIRE(r.x[i] == r.x[20'000]);
        REQUIRE(std::abs(r.x[i][1]) < 1e-15); // no chatter
    }
    // the friction balances the spring: F s = -x
    CHECK_THAT(0.4 * r.s.back()[0], WithinAbs(-r.x.back()[0], 1e-12));
}

TEST_CASE("time_stepping: the unit of the state does not matter", "[time_stepping]") {
    // all of P1 that has a length: the start and the friction
    const auto run = [](double unit, double theta) {
        auto p = default_params<models::Coulomb>();
        p[0] *= unit;
        return time_stepping(Blended<models::Coulomb>{}, p, Vec<double, 2>(3 * unit, 0), 0.0, 40.0,
                             {.steps = 4'000, .theta = theta});
    };
    for (const double theta : {1.0, 0.5}) {
        const auto here = run(1, theta);
        REQUIRE(here.status == Status::ok);
        for (const double unit : {0x1p-60, 0x1p-30, 0x1p40}) {
            const auto there = run(unit, theta);
            REQUIRE(there.status == Status::ok);
            CHECK(there.newtons == here.newtons);
            for (std::size_t i = 0; i < here.x.size(); ++i)
                REQUIRE(there.x[i] == unit * here.x[i]);
        }
    }
}

TEST_CASE("time_stepping: components have units of their own", "[time_stepping]") {
    // y1 = 1 - y1^3 whatever x is
    const auto step = [](double x) {
        return time_stepping(Apart{}, Vec<double, 0>{}, Vec<double, 2>(x, 1), 0.0, 1.0,
                             {.steps = 1});
    };
    CHECK_THAT(step(1).x.back()[1], WithinAbs(0.6823278038280193, 1e-15));
    CHECK_THAT(step(1e16).x.back()[1], WithinAbs(0.6823278038280193, 1e-15));
    CHECK_THAT(step(1e-16).x.back()[1], WithinAbs(0.6823278038280193, 1e-15));
}

TEST_CASE("time_stepping: events that accumulate are harmless", "[time_stepping]") {
    // from (0, 1): at rest in (0, 0) from t = 1/2 on, after infinitely many crossings
    const auto r = time_stepping(Spiral{}, Vec<double, 0>{}, Vec<double, 2>(0, 1), 0.0, 1.0,
                                 {.steps = 10'000});
    REQUIRE(r.status == Status::ok);
    CHECK(r.x.back().norm() < 1e-15);
    double rest = 0;
    for (std::size_t i = 0; i < r.t.size() && rest == 0; ++i)
        if (r.x[i].norm() < 1e-15)
            rest = r.t[i];
    CHECK_THAT(rest, WithinAbs(0.5, 1e-3));
}

TEST_CASE("time_stepping: begins on the side where it starts", "[time_stepping]") {
    for (const long long steps : {10, 1000}) {
        const auto r = time_stepping(Repels{}, Vec<double, 0>{}, Vec<double, 1>(-1e-4), 0.0, 1.0,
                                     {.steps = steps});
        REQUIRE(r.status == Status::ok);
        CHECK_THAT(r.x.back()[0], WithinAbs(-0.9001, 1e-12));
    }
}

TEST_CASE("time_stepping: where nothing solves a step it says so and keeps what was",
          "[time_stepping]") {
    const auto r =
        time_stepping(Ends{}, Vec<double, 0>{}, Vec<double, 1>(-1.0), 0.0, 5.0, {.steps = 500});
    CHECK(r.status == Status::not_converged);
    CHECK(r.steps > 10);
    CHECK(r.x.size() == std::size_t(r.steps) + 1);
    CHECK_THAT(r.message(), Catch::Matchers::ContainsSubstring("take a smaller one"));
}

TEST_CASE("time_stepping: refuses what makes no sense", "[time_stepping]") {
    const auto p = default_params<models::Oscillator>();
    const Vec<double, 2> x0(0, 0);
    const models::Oscillator sys;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(time_stepping(sys, p, x0, 0.0, 1.0, {.steps = 0}), std::invalid_argument);
    CHECK_THROWS_AS(time_stepping(sys, p, x0, 0.0, 1.0, {.keep = 0}), std::invalid_argument);
    for (const double theta : {0.4, 1.1, nan})
        CHECK_THROWS_AS(time_stepping(sys, p, x0, 0.0, 1.0, {.theta = theta}),
                        std::invalid_argument);
    CHECK_THROWS_AS(time_stepping(sys, p, Vec<double, 2>(nan, 0), 0.0, 1.0, {}),
                    std::invalid_argument);
    CHECK_THROWS_AS(time_stepping(sys, p, x0, 0.0, nan, {}), std::invalid_argument);
}
