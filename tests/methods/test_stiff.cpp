// SPDX-License-Identifier: BSD-3-Clause
// Stiff fields under the event-driven engine.
#include "run.hpp"
#include "stiff_systems.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/stiff_relay.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

using namespace filippov;
using Catch::Matchers::WithinAbs;

TEST_CASE("stiff: P8, however stiff, is hit at its time in few steps, and slides", "[stiff]") {
    const double lambda = GENERATE(1e3, 1e5, 1e7, 1e9);
    // the surface attracts from pi/2 on, and is met 1/lambda after that
    const auto r =
        run<Rodas5P>(models::StiffRelay{}, Params<models::StiffRelay, double>(lambda),
                     Vec<double, 1>(1), 0, 3, tolerance<1>(std::min(1e-8, 0.1 / lambda)));
    INFO(r.result.message());
    REQUIRE(r.result.status == Status::ok);
    REQUIRE(r.events.size() == 3);
    CHECK(r.events[1].kind == EventKind::enter_sliding);
    // x = (lambda^2 cos t + lambda sin t + e^(-lambda t))/(1 + lambda^2) is zero where
    // tan t = -lambda. 1e-7: ten tolerances.
    INFO("lambda " << lambda << ": " << r.result.counters.steps << " steps");
    CHECK_THAT(r.events[1].t, WithinAbs(std::numbers::pi - std::atan(lambda), 1e-7));
    CHECK(r.result.x[0] == 0);
    CHECK(r.result.counters.steps < 100);
}

namespace {

/// Slope of log error against log step over steps in equal ratios.
template <class Error>
double slope(double largest, double smallest, std::string& table, const Error& error) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int k = 0; k < 8; ++k) {
        const double step = largest * std::pow(smallest / largest, k / 7.0), e = error(step);
        char line[80];
        std::snprintf(line, sizeof line, "step %.4f: error %.2e\n", step, e);
        table += line;
        const double x = std::log(step), y = std::log(e);
        n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

template <class Sys>
auto precise(const Vec<double, dim_v<Sys>>& x0, double t_end, double tol = 1e-12) {
    auto settings = tolerance<dim_v<Sys>>(tol);
    settings.max_steps = 100'000'000;
    return run<DormandPrince8>(Sys{}, default_params<Sys>(), x0, 0, t_end, settings);
}

} // namespace

TEST_CASE("stiff: a relay behind a fast actuator, as the explicit method in its small steps",
          "[stiff]") {
    const Vec<double, 3> x0(1, 0, 0);
    const auto reference = precise<FastActuator>(x0, 20);
    REQUIRE(reference.result.status == Status::ok);
    REQUIRE(reference.events.size() > 10);
    for (const double tol : {1e-5, 1e-7, 1e-9}) {
        const auto r = run<Rodas5P>(FastActuator{}, default_params<FastActuator>(), x0, 0, 20,
                                    tolerance<3>(tol));
        REQUIRE(r.result.status == Status::ok);
        INFO("tolerance " << tol << ": " << r.result.counters.steps << " steps, the explicit one "
                          << reference.result.counters.steps);
        REQUIRE(r.events.size() == reference.events.size());
        double error = 0;
        for (std::size_t i = 0; i < r.events.size(); ++i) {
            CHECK(r.events[i].kind == reference.events[i].kind);
            error = std::max(error, std::abs(r.events[i].t - reference.events[i].t));
        }
        INFO("event times " << error << ", state "
                            << (r.result.x - reference.result.x).cwiseAbs().maxCoeff());
        CHECK(error < 100 * tol);
        CHECK((r.result.x - reference.result.x).cwiseAbs().maxCoeff() < 1000 * tol);
        CHECK(r.result.counters.steps < reference.result.counters.steps / 20);
    }
}

TEST_CASE("stiff: sticking and slipping through a contact of stiffness 1e6 keeps the order",
          "[stiff]") {
    const Vec<double, 4> x0(0, 0.2, 0, 0.2);
    const auto reference = precise<StiffContact>(x0, 12);
    REQUIRE(reference.result.status == Status::ok);
    REQUIRE(reference.events.size() > 4); // it sticks and slips
    std::string table;
    // fixed steps, hundreds of times as long as the fast time scale of 5e-4
    const double order = slope(0.2, 0.05, table, [&](double step) {
        Settings<double, 4> settings;
        settings.fixed_step = step;
        const auto r =
            run<Rodas5P>(StiffContact{}, default_params<StiffContact>(), x0, 0, 12, settings);
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(r.events.size() == reference.events.size());
        double error = 0;
        for (std::size_t i = 0; i < r.events.size(); ++i)
            error = std::max(error, std::abs(r.events[i].t - reference.events[i].t));
        return error;
    });
    INFO(table << "slope " << order);
    CHECK(order > 3.7); // that of the method on stiff problems is 4
}

namespace {

/// x' = 3/2 + clip(c x, -1, 1): a layer that grows, between kinks.
struct Clip {
    static constexpr int dim = 1, surfaces = 2;
    static constexpr std::array<SurfaceKind, 2> kinds{SurfaceKind::kink, SurfaceKind::kink};
    double c;
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        return {S(c) * x[0] + S(1), S(c) * x[0] - S(1)};
    }
    template <Scalar S>
    Vec<S, 1> region(const S&, const Vec<S, 1>& x, const Mode<2>& side, const Vec<S, 0>&) const {
        return Vec<S, 1>(side[1] > 0 ? S(2.5) : side[0] < 0 ? S(0.5) : S(S(1.5) + S(c) * x[0]));
    }
};
/// x' = 1000 y x + 1/1000, y' = 1: decays until t = 1, and grows from then on.
struct Grows {
    static constexpr int dim = 2, surfaces = 2;
    static constexpr std::array<SurfaceKind, 2> kinds{SurfaceKind::kink, SurfaceKind::kink};
    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(1e3) * x[1] * x[0] + S(1e-3), S(1)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(1), S(1)};
    }
};

} // namespace

TEST_CASE("stiff: what grows is not damped", "[stiff]") {
    // L-stable methods damp growing modes, and the estimates of their error with them
    const double c = GENERATE(1e4, 1e6);
    for (const double tol : {1e-4, 1e-6, 1e-8, 1e-10}) {
        const auto r =
            run<Rodas5P>(Clip{c}, Vec<double, 0>{}, Vec<double, 1>(-0.01), 0, 3, tolerance<1>(tol));
        INFO("c " << c << ", tolerance " << tol << ": " << r.result.counters.steps << " steps");
        REQUIRE(r.result.status == Status::ok);
        // exact: to -1/c at speed 1/2, through the layer in log(5)/c, on at speed 5/2
        const double exact = 1 / c + 2.5 * (3 - (0.01 - 1 / c) / 0.5 - std::log(5.0) / c);
        CHECK_THAT(r.result.x[0], WithinAbs(exact, 100 * tol));
        CHECK(r.result.counters.steps < 50);
    }
    for (const double tol : {1e-4, 1e-7, 1e-10}) {
        const Vec<double, 2> x0(1, -1);
        const auto r = run<Rodas5P>(Grows{}, Vec<double, 0>{}, x0, 0, 1.1, tolerance<2>(tol));
        const auto e =
            run<DormandPrince8>(Grows{}, Vec<double, 0>{}, x0, 0, 1.1, tolerance<2>(1e-13));
        INFO("tolerance " << tol << ": " << r.result.x[0] << ", " << e.result.x[0]);
        CHECK(std::abs(r.result.x[0] - e.result.x[0]) < 1e5 * tol * e.result.x[0]);
        CHECK(r.result.x[0] > 0);
    }
}

TEST_CASE("stiff: the chapter's oscillator, where nothing is stiff, has the same events",
          "[stiff]") {
    const auto p = default_params<models::Oscillator>();
    const Vec<double, 2> x0(0, 0);
    const auto exact =
        run<DormandPrince8>(models::Oscillator{}, p, x0, 0, 100, tolerance<2>(1e-12));
    const auto r = run<Rodas5P>(models::Oscillator{}, p, x0, 0, 100, tolerance<2>(1e-9));
    REQUIRE(r.events.size() == exact.events.size());
    for (std::size_t i = 0; i < r.events.size(); ++i) {
        CHECK(r.events[i].kind == exact.events[i].kind);
        CHECK_THAT(r.events[i].t, WithinAbs(exact.events[i].t, 1e-7));
    }
}

namespace {

/// x' = -1 + 2 cos t - 0.3 sign(x) |x|^e: what the other side does begins at its surface, where
/// |x|^e has no logarithm, and for e < 1 no slope.
struct PowerLaw {
    static constexpr int dim = 1;
    double e;

    template <class S> using X = Vec<S, 1>;
    template <class S> static X<S> field(const S& t, const S& drag) {
        using std::cos;
        return X<S>(S(-1) + S(2) * cos(t) + S(0.3) * drag);
    }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const Vec<S, 0>&) const {
        using std::pow;
        return field(t, S(pow(S(-x[0]), S(e))));
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const Vec<S, 0>&) const {
        using std::pow;
        return field(t, S(-pow(x[0], S(e))));
    }
    template <Scalar S> S h(const S&, const X<S>& x, const Vec<S, 0>&) const { return x[0]; }
};

} // namespace

TEST_CASE("stiff: a power law begins at the surface", "[stiff]") {
    const double e = GENERATE(0.3, 0.5, 1.0, 1.5, 2.0, 2.5, 3.5);
    const PowerLaw sys{e};
    const auto implicit =
        run<Rodas5P>(sys, Vec<double, 0>(), Vec<double, 1>(0.5), 0, 20, tolerance<1>(1e-9));
    const auto explicitly =
        run<DormandPrince8>(sys, Vec<double, 0>(), Vec<double, 1>(0.5), 0, 20, tolerance<1>(1e-9));
    INFO("exponent " << e << ": " << implicit.result.message());
    CHECK(implicit.result.status == Status::ok);
    CHECK(implicit.events.size() == explicitly.events.size());
    CHECK_THAT(implicit.result.x[0], WithinAbs(explicitly.result.x[0], 1e-6));
}

TEST_CASE("stiff: dense output of the stiff method is on the surface in a slide, and as exact",
          "[stiff]") {
    const auto p = default_params<StiffContact>();
    const Vec<double, 4> x0(0, 0.2, 0, 0.2);
    const auto r = simulate<Rodas5P>(StiffContact{}, p, x0, 0, 12, tolerance<4>(1e-8));
    const auto fine = simulate<Rodas5P>(StiffContact{}, p, x0, 0, 12, tolerance<4>(1e-11));
    REQUIRE(r.result.status == Status::ok);
    double worst = 0;
    for (double t = 0.0137; t < 12; t += 0.0291) {
        if (r.mode_at(t)[0] == 0)
            CHECK(r(t)[1] == 1);
        if (r.mode_at(t)[0] == fine.mode_at(t)[0])
            worst = std::max(worst, (r(t) - fine(t)).cwiseAbs().maxCoeff());
    }
    CHECK(worst < 1e-5); // the interpolant's order is one less than the method's
}
