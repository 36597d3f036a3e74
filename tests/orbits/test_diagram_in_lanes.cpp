// SPDX-License-Identifier: BSD-3-Clause
// Diagrams whose values run side by side in lanes, against those of the engine of single runs.

#include "catch.hpp"
#include "diagrams.hpp"
#include "run.hpp"

#include <filippov/models/relay.hpp>
#include <filippov/orbits/diagram_in_lanes.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>

using namespace filippov;
using models::Oscillator;
using namespace diagrams;

namespace {

using Task = DiagramSettings<double, 2>;

Task task(double each = 1e-10) {
    Task d;
    d.run = tolerance<2>(each);
    d.transient = 100;
    d.keep = 60;
    return d;
}
template <class Tableau = DormandPrince8, int W = native_lanes>
std::vector<Value> in_lanes(const std::vector<P>& params, const Task& d,
                            const Vec<double, 2>& x0 = Vec<double, 2>(0, 0)) {
    return bifurcation_diagram_in_lanes<Tableau, W>(Oscillator{}, params, x0, d);
}
template <class Tableau = DormandPrince8>
std::vector<Value> alone(const std::vector<P>& params, const Task& d,
                         const Vec<double, 2>& x0 = Vec<double, 2>(0, 0)) {
    return bifurcation_diagram<Tableau>(Oscillator{}, params, x0, d);
}

/// The same points, but for the error of their places.
template <int N>
void check_close(const DiagramValue<double, N>& a, const DiagramValue<double, N>& b,
                 double within) {
    CHECK(a.status == b.status);
    CHECK(a.period == b.period);
    REQUIRE(a.points.size() == b.points.size());
    for (std::size_t k = 0; k < a.points.size(); ++k) {
        const auto &p = a.points[k], &q = b.points[k];
        CHECK(p.period == q.period);
        CHECK(std::abs(p.t_local - q.t_local) < within);
        CHECK((p.x - q.x).norm() < within);
        CHECK(p.kind == q.kind);
        CHECK(p.surface == q.surface);
        CHECK(p.boundary == q.boundary);
    }
    CHECK((a.x_end - b.x_end).norm() < within);
}

} // namespace

TEMPLATE_TEST_CASE("diagram in lanes: has the points of single runs, to the tolerance",
                   "[diagram][lanes]", DormandPrince5, DormandPrince8) {
    auto d = task();
    d.skip_repeats = GENERATE(false, true);
    SECTION("exits on attractors of one and of two transitions") {}
    SECTION("all changes of mode") {
        d.section.events = {EventKind::cross, EventKind::enter_sliding, EventKind::exit_sliding};
    }
    SECTION("exits that lead down") { d.section.direction = -1; }
    SECTION("exits that lead up, which there are none") { d.section.direction = 1; }
    SECTION("of the one surface") { d.section.surface = 0; }
    SECTION("a strobe") { d.section.strobe = true; }
    SECTION("a strobe from the start") {
        d.section.strobe = true;
        d.transient = 0;
        d.keep = 1;
    }
    const auto params = oscillators({2.94, 2.92, 2.91, 2.9, 2.88});
    const auto lanes = in_lanes<TestType>(params, d), single = alone<TestType>(params, d);
    for (std::size_t i = 0; i < params.size(); ++i) {
        CAPTURE(params[i][1]);
        check_close<2>(lanes[i], single[i], 100 * d.run.rtol);
        CHECK(lanes[i].counters.steps > 0);
    }
}

TEST_CASE("diagram in lanes: crossings from both sides", "[diagram][lanes]") {
    auto d = task();
    d.section.events = {EventKind::cross};
    d.section.direction = GENERATE(-1, 0, 1);
    d.transient = 20;
    const auto params = oscillators({1.6, 1.72, 1.8}, 5);
    const auto lanes = in_lanes(params, d), single = alone(params, d);
    for (std::size_t i = 0; i < params.size(); ++i)
        check_close<2>(lanes[i], single[i], 100 * d.run.rtol);
    CHECK(lanes[0].points.size() > 30); // at omega = 1.6 it crosses both ways
}

TEST_CASE("diagram in lanes: what repeats itself is seen to, and left out", "[diagram][lanes]") {
    auto d = task(1e-9);
    d.keep = 2000;
    d.section.strobe = GENERATE(false, true);
    // orbits of four periods; where steps end in it may take a few of them to repeat
    const auto params =
        oscillators({2.905, 2.91, 2.915, 2.92, 2.925, 2.93, 2.935, 2.94, 2.945, 2.95});
    const auto some = in_lanes(params, d);
    d.skip_repeats = false;
    const auto all = in_lanes(params, d);
    int seen = 0;
    for (std::size_t i = 0; i < params.size(); ++i) {
        CAPTURE(params[i][1]);
        check_close<2>(some[i], all[i], 100 * d.run.rtol);
        CHECK(all[i].cycle == 0);
        CHECK(all[i].skipped == 0);
        CHECK((some[i].cycle > 0) == (some[i].skipped > 0));
        if (some[i].cycle == 0)
            continue;
        ++seen;
        CHECK(some[i].skipped % 4 == 0);
        CHECK(some[i].cycle % (d.section.strobe ? 4 : 1) == 0);
        CHECK(some[i].counters.steps + some[i].skipped < all[i].counters.steps);
    }
    CHECK(seen >= 5);
}

TEST_CASE("diagram in lanes: no bit depends on threads, on neighbours or on how many lanes",
          "[diagram][lanes]") {
    auto d = task(1e-9);
    d.section.strobe = GENERATE(false, true);
    const auto params = oscillators({2.84, 2.85, 2.86, 2.87, 2.88, 2.89, 2.9});
    d.parallel.threads = 1;
    const auto one = in_lanes<DormandPrince8, 1>(params, d);
    const auto many = in_lanes<DormandPrince8, 4 * native_lanes>(params, d);
    d.parallel.threads = 3;
    const auto shared = in_lanes(params, d);
    for (std::size_t i = 0; i < params.size(); ++i) {
        CHECK(same(one[i], many[i]));
        CHECK(same(one[i], shared[i]));
        CHECK(same(one[i], in_lanes({params[i]}, d)[0]));
    }
}

TEST_CASE("diagram in lanes: what ends badly is told by the engine of single runs",
          "[diagram][lanes]") {
    auto d = task();
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    // no period, no meaning, the pole of mu in S1, and a period of less than nothing
    auto params = oscillators({2.94, 0.0, nan, 2.94, -1.0, 2.94});
    params[3][7] = -1;
    int told = 0;
    d.parallel.progress = [&told](long long done, long long) { told = int(done); };
    const auto lanes = in_lanes(params, d), single = alone(params, d);
    for (const std::size_t i : {1u, 2u, 3u, 4u}) {
        CAPTURE(i);
        CHECK(lanes[i].status != Status::ok);
        CHECK_FALSE(lanes[i].message.empty());
        CHECK(same(lanes[i], single[i]));
    }
    check_close<2>(lanes[0], single[0], 100 * d.run.rtol);
    check_close<2>(lanes[5], single[5], 100 * d.run.rtol);
    CHECK(told == 6);
    d.run.max_steps = 500;
    CHECK(in_lanes({params[0]}, d)[0].status == Status::max_steps);
    d.run.max_steps = 100'000;
    d.run.max_events = 3;
    CHECK(in_lanes({params[0]}, d)[0].status == Status::max_events);
}

TEST_CASE("diagram in lanes: what lanes do not know is the diagram of single runs",
          "[diagram][lanes]") {
    auto d = task(1e-9);
    SECTION("values that follow each other") {
        d.follow = true;
        d.chains = 2;
    }
    SECTION("grazes") { d.section.events.add(EventKind::graze); }
    SECTION("extrema of slides") { d.section.events = {EventKind::slide_extremum}; }
    SECTION("no look at steps without need") { d.run.skip_root_search = false; }
    CHECK_FALSE(lanes_know(d));
    const auto params = oscillators({2.94, 2.9, 2.88});
    const auto lanes = in_lanes(params, d), single = alone(params, d);
    for (std::size_t i = 0; i < params.size(); ++i)
        CHECK(same(lanes[i], single[i]));
}

TEST_CASE("diagram in lanes: without a period, transient and keep are times", "[diagram][lanes]") {
    DiagramSettings<double, 3> d;
    d.run = tolerance<3>(1e-10);
    d.section.events = {EventKind::cross, EventKind::enter_sliding};
    d.transient = 100;
    d.keep = 50;
    const std::vector params{default_params<models::Relay>()};
    const Vec<double, 3> x0(0, -0.001, -0.02);
    const auto lanes = bifurcation_diagram_in_lanes(models::Relay{}, params, x0, d)[0];
    const auto single = bifurcation_diagram<DormandPrince8>(models::Relay{}, params, x0, d)[0];
    CHECK(lanes.points.size() > 3);
    check_close<3>(lanes, single, 100 * d.run.rtol);
}

TEST_CASE("diagram in lanes: what makes no sense is refused before any work", "[diagram][lanes]") {
    const auto params = oscillators({2.94});
    auto d = task();
    SECTION("part of a period") { d.keep = 1.5; }
    SECTION("nothing to keep") { d.keep = 0; }
    SECTION("no events") { d.section.events = {}; }
    SECTION("a surface that is none") { d.section.surface = 1; }
    SECTION("a tolerance that is none") { d.run.rtol = -1; }
    CHECK_THROWS_AS(in_lanes(params, d), std::invalid_argument);
    CHECK_THROWS_AS(in_lanes(params, task(), Vec<double, 2>(std::nan(""), 0)),
                    std::invalid_argument);
}

TEST_CASE("diagram in lanes: no values make no points", "[diagram][lanes]") {
    CHECK(in_lanes({}, task()).empty());
}
