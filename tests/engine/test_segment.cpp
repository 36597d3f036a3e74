// SPDX-License-Identifier: BSD-3-Clause
// The lower layer: one prescribed mode to a target, without judgement; and the observers.

#include "catch.hpp"
#include "slow_belt.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/quartet.hpp>

#include <cmath>
#include <numbers>

using namespace filippov;

namespace {

constexpr int surface = Guard<1>::below(0);
const Settings<double, 2> tight{.rtol = 1e-12, .atol = 1e-12};

Mode<1> mode(int side) {
    Mode<1> m;
    m.set(0, side);
    return m;
}

} // namespace

TEST_CASE("segment: meets its surface where the closed form does", "[segment]") {
    // v < 0: x = 0.4 + 2.6 cos t from (3, 0); v returns to zero at pi, x = -2.2
    const auto p = default_params<models::Coulomb>();
    const auto r = segment<DormandPrince8>(models::Coulomb{}, p, mode(-1), Vec<double, 2>(3, 0), 0,
                                           10, surface, tight);
    CHECK(r.status == Status::event);
    CHECK(r.t == Approx(std::numbers::pi).epsilon(1e-11)); // a few tolerances
    CHECK(r.x[0] == Approx(-2.2).epsilon(1e-11));
    CHECK(r.x[1] == 0.0);
}

TEST_CASE("segment: follows a one-sided field beyond its side", "[segment]") {
    // the field of v < 0 started at v > 0: the same circle about 0.4, whatever the side
    const auto p = default_params<models::Coulomb>();
    const auto r = segment<DormandPrince8>(models::Coulomb{}, p, mode(-1), Vec<double, 2>(0.4, 1),
                                           0, 1, -1, tight);
    CHECK(r.status == Status::ok);
    CHECK(r.x[0] == Approx(0.4 + std::sin(1.0)).epsilon(1e-11));
    CHECK(r.x[1] == Approx(std::cos(1.0)).epsilon(1e-11));
    // and from there the surface is met from above
    const auto back = segment<DormandPrince8>(models::Coulomb{}, p, mode(-1),
                                              Vec<double, 2>(0.4, 1), 0, 10, surface, tight);
    CHECK(back.status == Status::event);
    CHECK(back.t == Approx(std::numbers::pi / 2).epsilon(1e-11));
}

TEST_CASE("segment: a slide goes on beyond its boundary unless that is the target", "[segment]") {
    // x' = t - sign x slides at 0 with s = t, which passes 1 at t = 1
    Params<models::Quartet, double> p(1, 0, 1);
    const auto on = segment<DormandPrince5>(models::Quartet{}, p, mode(0), Vec<double, 1>(0), 0, 2,
                                            -1, Settings<double, 1>{});
    CHECK(on.status == Status::ok);
    CHECK(on.t == 2.0);
    CHECK(on.x[0] == 0.0);
    const auto end = segment<DormandPrince5>(models::Quartet{}, p, mode(0), Vec<double, 1>(0), 0, 2,
                                             Guard<1>::above(0), Settings<double, 1>{});
    CHECK(end.status == Status::event);
    CHECK(end.t == Approx(1.0).epsilon(1e-14));
}

TEST_CASE("segment: guards that are not watched do not shorten steps", "[segment]") {
    // A slide by steps, whose s swings: a segment without a target has nothing to look for in it.
    const models::Oscillator sys;
    auto p = default_params<models::Oscillator>();
    p[0] = 0.5;
    p[1] = 2.92;
    for (const double tol : {1e-6, 1e-9, 1e-11, 1e-12}) {
        CAPTURE(tol);
        Settings<double, 2> settings{.rtol = tol, .atol = tol / 10};
        settings.closed_form_slides = false;
        const auto r = segment<DormandPrince8>(sys, p, mode(0), Vec<double, 2>(0.1, 1), 0.0, 30.0,
                                               -1, settings);
        CHECK(r.status == Status::ok);
        CHECK(r.x[0] == Approx(30.1).epsilon(1e-14));
        CHECK(r.counters.steps < 40);
    }
}

TEST_CASE("segment: runs backwards to where it came from", "[segment]") {
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const Vec<double, 2> x0(0, 0);
    const auto there = segment<DormandPrince8>(sys, p, mode(-1), x0, 0, 10, surface, tight);
    REQUIRE(there.status == Status::event);
    const auto back = segment<DormandPrince8>(sys, p, mode(-1), there.x, there.t, 0, -1, tight);
    CHECK(back.t == 0.0);
    CHECK((back.x - x0).norm() < 1e-10); // a hundred tolerances: the way back amplifies
}

namespace {

/// A slide on x = 0, of the segment's own, whose surface jumps to x = 1/2 at t = 1.
struct Jumping {
    static constexpr int dim = 2;
    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(1), S(1)};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(-1), S(1)};
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x[0] - S(t < S(1) ? 0 : 0.5);
    }
};

} // namespace

TEST_CASE("segment: a surface that jumps is no target", "[segment]") {
    for (const int target : {-1, surface, Guard<1>::above(0), Guard<1>::transversal(0)}) {
        const Jumping sys;
        const auto before =
            segment<DormandPrince8>(sys, {}, mode(0), Vec<double, 2>(0, 0), 0, 0.9, target, tight);
        CHECK(before.status == Status::ok);
        const auto r =
            segment<DormandPrince8>(sys, {}, mode(0), Vec<double, 2>(0, 0), 0, 2, target, tight);
        CHECK(r.status == Status::step_too_small);
        CHECK(r.t == Approx(1).epsilon(1e-12));
        CHECK(r.x[0] == 0);
    }
}

TEST_CASE("segment: never finds the target it starts on", "[segment]") {
    const auto p = default_params<models::Coulomb>();
    auto x = Vec<double, 2>(3, 0);
    double t = 0;
    for (int k = 1; k <= 3;
         ++k) { // each half circle starts on the surface and ends there, pi later
        const auto r = segment<DormandPrince5>(models::Coulomb{}, p, mode(k % 2 == 1 ? -1 : 1), x,
                                               t, t + 10, surface, tight);
        REQUIRE(r.status == Status::event);
        CHECK(r.t == Approx(k * std::numbers::pi).epsilon(1e-11));
        x = r.x;
        t = r.t;
    }
}

TEST_CASE("observers: output times are hit exactly once, whatever happens there", "[observers]") {
    const auto p = default_params<models::Coulomb>();
    const double pi = std::numbers::pi;
    const std::vector<double> times{0, 1, pi, 5, 4 * pi, 14, 15};
    OutputTimes<double, 2, 1> output{times};
    const auto r =
        flow<DormandPrince8>(models::Coulomb{}, p, Vec<double, 2>(3, 0), 0.0, 15.0, tight, output);
    REQUIRE(r.status == Status::ok);
    REQUIRE(output.states.size() == times.size());
    CHECK(output.states[1][0] ==
          Approx(0.4 + 2.6 * std::cos(1.0)).epsilon(1e-10)); // interpolant of order 7
    CHECK(output.states[2][0] == Approx(-2.2).epsilon(1e-10));
    CHECK(output.states[5][0] == Approx(-0.2).epsilon(1e-10));
    CHECK(output.modes[5][0] == 0);
    CHECK(output.states[6] == r.x);
}

TEST_CASE("observers: dense output agrees with steps, and lies on the surface in a slide",
          "[observers]") {
    Settings<double, 2> integrated{.rtol = 1e-9, .atol = 1e-9};
    integrated.closed_form_slides = false;
    const models::Oscillator sys;
    const auto run = simulate<DormandPrince5>(sys, default_params<models::Oscillator>(),
                                              Vec<double, 2>(0, 0), 0.0, 30.0, integrated);
    const auto closed = simulate<DormandPrince8>(sys, default_params<models::Oscillator>(),
                                                 Vec<double, 2>(0, 0), 0.0, 30.0, tight);
    REQUIRE(run.result.status == Status::ok);
    for (std::size_t i = 0; i < run.t.size(); ++i)
        CHECK((run(run.t[i]) - run.x[i]).norm() < 1e-12);
    for (int k = 0; k <= 300; ++k) {
        const double t = 0.1 * k;
        CHECK((run(t) - closed(t)).norm() < 1e-6); // order 4 between steps of order 5 at 1e-9
        if (run.mode_at(t)[0] == 0)
            CHECK(std::abs(run(t)[1] - 1.0) < 1e-15);
    }
    CHECK_THROWS_AS(run(-0.1), std::out_of_range);
    CHECK_THROWS_AS(run(30.1), std::out_of_range);
}

TEST_CASE("observers: one that asks to stop is obeyed, with everything so far", "[observers]") {
    int asked = 0;
    const auto at_the_fourth_time = [&] { return ++asked > 3; };
    const auto r = flow(models::Oscillator{}, {}, Vec<double, 2>(0, 0), 0.0, 1e6, {},
                        {.stop = at_the_fourth_time});
    CHECK(r.status == Status::interrupted);
    CHECK(r.t > 0.0);
    CHECK(r.t < 1e5);
}

TEST_CASE("flow: the first slip of a run that begins in a slide needs no absolute tolerance",
          "[segment]") {
    // the block rests, at speed 0 exactly, and starts: its first step is judged by its end
    const auto from_rest = [](double atol) {
        Settings<double, 2> settings{.rtol = 1e-8};
        settings.atol = AbsoluteTolerance<double, 2>(atol);
        const Vec<double, 2> p(0, 2), x(0.1, 0);
        return flow<DormandPrince8>(SlowBelt{}, p, x, 6.732, 14, settings);
    };
    const auto strict = from_rest(0), usual = from_rest(1e-9);
    REQUIRE(strict.status == Status::ok);
    CHECK(strict.counters.rejected <= usual.counters.rejected + 12);
    CHECK((strict.x - usual.x).norm() < 1e-7);
}
