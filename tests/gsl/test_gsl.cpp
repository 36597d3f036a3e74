// SPDX-License-Identifier: BSD-3-Clause
// The component filippov::gsl: a second opinion on smoothed systems.
#include "catch.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/gsl/ode.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/system/smoothing.hpp>

#include <limits>

using namespace filippov;

namespace {

const auto p = default_params<models::Oscillator>();
const Vec<double, 2> origin(0, 0);

/// x' = log(x) - 2: falls to x = 0, where the field ends.
struct Ends {
    static constexpr int dim = 1;
    [[maybe_unused]] static constexpr std::array<SurfaceKind, 1> kinds{SurfaceKind::kink};
    template <Scalar S> Vec<S, 1> f(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        using std::log;
        return Vec<S, 1>(log(x[0]) - S(2));
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>&, const Vec<S, 0>&) const { return S(1); }
};

} // namespace

TEST_CASE("gsl: its stiff methods and Rodas5P agree on the smoothed oscillator", "[gsl]") {
    const auto smooth = smoothed(models::Oscillator{}, {.c1 = 1e3});
    const double t_end = 20;
    auto settings = filippov::Settings<double, 2>{};
    settings.rtol = 1e-10;
    settings.atol = AbsoluteTolerance<double, 2>(1e-10);
    const auto ours = flow<Rodas5P>(smooth, p, origin, 0.0, t_end, settings);
    REQUIRE(ours.status == Status::ok);
    using gsl::Method;
    for (const Method method : {Method::msbdf, Method::bsimp, Method::rk4imp}) {
        const auto theirs =
            gsl::run(method, smooth, p, origin, 0, t_end, {.rtol = 1e-9, .atol = 1e-9});
        INFO("method " << int(method) << ": " << theirs.message() << " " << theirs.steps
                       << " steps, off by " << (theirs.x - ours.x).cwiseAbs().maxCoeff());
        CHECK(theirs.status == Status::ok);
        // backward differences control the local error only: thousands of steps add up
        CHECK((theirs.x - ours.x).cwiseAbs().maxCoeff() < 1e-4);
        CHECK(theirs.jacobians > 0);
    }
}

TEST_CASE("gsl: goes backwards, and explicitly", "[gsl]") {
    const auto smooth = smoothed(models::Oscillator{}, {.c1 = 5});
    const auto there =
        gsl::run(gsl::Method::rk8pd, smooth, p, origin, 0, 3, {.rtol = 1e-12, .atol = 1e-12});
    REQUIRE(there.status == Status::ok);
    const auto back =
        gsl::run(gsl::Method::rk8pd, smooth, p, there.x, 3, 0, {.rtol = 1e-12, .atol = 1e-12});
    REQUIRE(back.status == Status::ok);
    // friction contracts, the way back expands: by some 1e6
    CHECK((back.x - origin).norm() < 1e-4);
}

TEST_CASE("gsl: a run that fails has a status, and the process goes on", "[gsl]") {
    // explicit steps of the width of the layer
    const auto smooth = smoothed(models::Oscillator{});
    const auto stopped =
        gsl::run(gsl::Method::rk8pd, smooth, p, origin, 0, 20, {.max_steps = 1000});
    CHECK(stopped.status == Status::max_steps);
    CHECK(stopped.t > 0);
    CHECK(stopped.t < 20);
    for (const auto method : {gsl::Method::msbdf, gsl::Method::rk8pd, gsl::Method::bsimp}) {
        const auto ended = gsl::run(method, Ends{}, Vec<double, 0>{}, Vec<double, 1>(1), 0, 5);
        INFO(ended.message());
        CHECK(ended.status != Status::ok);
        CHECK(ended.message().find("GSL says") != std::string::npos);
    }
    // and the handler is what it was
    const auto ours = [](const char*, const char*, int, int) {};
    gsl_error_handler_t* const before = gsl_set_error_handler(ours);
    (void)gsl::run(gsl::Method::msbdf, Ends{}, Vec<double, 0>{}, Vec<double, 1>(1), 0, 5);
    CHECK(gsl_set_error_handler(before) == static_cast<gsl_error_handler_t*>(ours));
}

TEST_CASE("gsl: refuses what makes no sense", "[gsl]") {
    const auto smooth = smoothed(models::Oscillator{});
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    using gsl::Method, gsl::run;
    CHECK_THROWS_AS(run(Method::msbdf, smooth, p, origin, 0, 1, {.rtol = 0}),
                    std::invalid_argument);
    CHECK_THROWS_AS(run(Method::msbdf, smooth, p, origin, 0, 1, {.atol = nan}),
                    std::invalid_argument);
    CHECK_THROWS_AS(run(Method::msbdf, smooth, p, origin, 0, nan), std::invalid_argument);
    CHECK_THROWS_AS(run(Method::msbdf, smooth, p, origin, 0, 1, {.first_step = -1}),
                    std::invalid_argument);
}
