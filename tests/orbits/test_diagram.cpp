// SPDX-License-Identifier: BSD-3-Clause
// Brute-force bifurcation diagrams, against closed forms, the chapter and runs of `flow`.

#include "catch.hpp"
#include "diagrams.hpp"
#include "run.hpp"

#include <filippov/models/relay.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;
using models::Oscillator;
using namespace diagrams;

namespace {

DiagramSettings<double, 2> settings(double each = 1e-10) {
    DiagramSettings<double, 2> d;
    d.run = tolerance<2>(each);
    d.transient = 200;
    d.keep = 100;
    return d;
}

/// x' = (a - x)/50 with a period of 1, in which nothing happens: steps over many of them.
struct Slow {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"a"};
    static constexpr std::array<double, 1> defaults{0.3};
    template <Scalar S> S period(const Vec<S, 1>&) const { return S(1); }
    template <Scalar S> Vec<S, 1> f1(const S&, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        return Vec<S, 1>(S(0.02) * (p[0] - x[0]));
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 1>&) const {
        return x[0] - S(100);
    }
};

template <class Tableau = DormandPrince8>
std::vector<Value> diagram(const std::vector<P>& params, const DiagramSettings<double, 2>& d,
                           const Vec<double, 2>& x0 = Vec<double, 2>(0, 0)) {
    return bifurcation_diagram<Tableau>(Oscillator{}, params, x0, d);
}

/// Phases omega t mod 2 pi that differ by more than `apart`, in order.
std::vector<double> phases(const Value& value, double apart = 1e-6) {
    std::vector<double> all, distinct;
    for (const auto& point : value.points)
        all.push_back(2 * std::numbers::pi * point.t_local / value.period);
    std::sort(all.begin(), all.end());
    for (const double phase : all)
        if (distinct.empty() || phase - distinct.back() > apart)
            distinct.push_back(phase);
    return distinct;
}

} // namespace

TEMPLATE_TEST_CASE("diagram: the attractors of the chapter have its numbers of transitions",
                   "[diagram]", DormandPrince5, DormandPrince8) {
    // section 4.6: one transition phase above omega = 2.9043, two below, down to 2.8942
    const auto values = diagram<TestType>(oscillators({2.94, 2.91, 2.9, 2.896}), settings());
    for (const Value& value : values)
        REQUIRE(value.status == Status::ok);
    CHECK(phases(values[0]).size() == 1);
    CHECK(phases(values[1]).size() == 1);
    CHECK(phases(values[2]).size() == 2);
    CHECK(phases(values[3]).size() == 2);
    // figure 4.6a: the stable point near 0.5; an orbit takes four periods of the forcing
    CHECK(phases(values[0])[0] == Approx(0.5).margin(0.1));
    CHECK(values[0].points.size() == 25);
    for (const auto& point : values[0].points) {
        CHECK(point.kind == EventKind::exit_sliding);
        CHECK(point.boundary == -1);
        CHECK(point.period >= 200);
        CHECK(point.period < 300);
        // the exit curve q = -4: y = 4 + A cos(phase), v = V; it has no error but the clock's
        CHECK(point.x[0] == Approx(4 + 0.5 * std::cos(2.94 * point.t_local)).epsilon(1e-14));
        CHECK(point.x[1] == 1);
    }
}

TEST_CASE("diagram: has the events of the run and no others", "[diagram]") {
    auto d = settings();
    d.section.events = {EventKind::enter_sliding, EventKind::exit_sliding, EventKind::cross};
    d.transient = 20;
    d.keep = 30;
    d.skip_repeats = GENERATE(false, true);
    const auto params = oscillators({1.72}, 5);
    const Value value = diagram(params, d)[0];
    const double T = Oscillator{}.period(params[0]);
    const auto reference =
        run<DormandPrince8>(Oscillator{}, params[0], Vec<double, 2>(0, 0), 0, 50 * T, d.run);
    std::size_t k = 0;
    for (const auto& event : reference.events) {
        if (event.period < 20 || event.kind == EventKind::end)
            continue;
        REQUIRE(k < value.points.size());
        const auto& point = value.points[k++];
        CHECK(point.kind == event.kind);
        CHECK(point.period == event.period);
        // the run may take other steps at its end only: repetition stays within 16 ulp a return
        CHECK(point.t_local == Approx(event.t_local).epsilon(0).margin(1e-12));
        CHECK((point.x - event.x_right).norm() < 1e-11);
        CHECK(point.boundary == (event.kind == EventKind::enter_sliding ? event.mode_before[0]
                                                                        : event.mode_after[0]));
    }
    CHECK(k == value.points.size());
    CHECK(k > 50);
}

TEST_CASE("diagram: a strobe is the state after each period", "[diagram]") {
    auto d = settings(1e-12);
    d.section.strobe = true;
    d.transient = 3;
    d.keep = 5;
    const auto params = oscillators({2.94, 2.85});
    const auto values = diagram(params, d);
    for (std::size_t i = 0; i < values.size(); ++i) {
        REQUIRE(values[i].points.size() == 5);
        const double T = Oscillator{}.period(params[i]);
        for (std::size_t k = 0; k < 5; ++k) {
            const auto& point = values[i].points[k];
            CHECK(point.period == static_cast<long long>(4 + k));
            CHECK(point.t_local == 0);
            // a run that ends there has no interpolant in it
            const auto reference =
                run<DormandPrince8>(Oscillator{}, params[i], Vec<double, 2>(0, 0), 0,
                                    static_cast<double>(point.period) * T, d.run);
            CHECK((point.x - reference.result.x).norm() < 1e-10);
        }
        CHECK((values[i].points.back().x - values[i].x_end).norm() == 0);
    }
}

TEST_CASE("diagram: a block that sticks to a belt at rest is strobed where it is", "[diagram]") {
    // |A cos(omega t) - y| < 4 for ever: no step, no event, and exactly the start
    auto params = oscillators({2.94});
    params[0][5] = 0;
    auto d = settings();
    d.section.strobe = true;
    const Value value = diagram(params, d, Vec<double, 2>(0.1, 0))[0];
    REQUIRE(value.status == Status::ok);
    REQUIRE(value.points.size() == 100);
    for (const auto& point : value.points) {
        CHECK(point.x == Vec<double, 2>(0.1, 0));
        CHECK(point.boundary == 0);
    }
}

TEST_CASE("diagram: no bit depends on the number of threads", "[diagram]") {
    auto d = settings(1e-9);
    d.keep = 50;
    d.follow = GENERATE(false, true);
    d.chains = 3;
    const auto params = oscillators({2.84, 2.85, 2.86, 2.87, 2.88, 2.89, 2.9});
    d.parallel.threads = 1;
    const auto one = diagram(params, d);
    for (const int threads : {2, 5}) {
        d.parallel.threads = threads;
        const auto many = diagram(params, d);
        for (std::size_t i = 0; i < params.size(); ++i)
            CHECK(same(one[i], many[i]));
    }
}

TEST_CASE("diagram: with follow a value starts where the last one ended", "[diagram]") {
    auto d = settings(1e-9);
    d.transient = 5;
    d.keep = 10;
    d.follow = true;
    const auto params = oscillators({2.9, 2.89, 2.88, 2.87});
    const auto chain = diagram(params, d);
    Vec<double, 2> start(0, 0);
    auto alone = d;
    alone.follow = false;
    for (std::size_t i = 0; i < params.size(); ++i) {
        CHECK(same(chain[i], diagram({params[i]}, alone, start)[0]));
        start = chain[i].x_end;
    }
    CHECK_FALSE(same(chain[1], diagram({params[1]}, alone)[0]));
    // two chains: the third value begins at x0 again
    d.chains = 2;
    const auto two = diagram(params, d);
    CHECK(same(two[1], chain[1]));
    CHECK(same(two[2], diagram({params[2]}, alone)[0]));
}

TEST_CASE("diagram: a value that fails has its own status and spoils no other", "[diagram]") {
    auto d = settings();
    d.follow = GENERATE(false, true);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    // omega = 0 has no period, NaN no meaning, and gamma = -1 puts the pole of mu in S1
    auto params = oscillators({2.94, 0.0, nan, 2.94, 2.94});
    params[3][7] = -1;
    const auto values = diagram(params, d);
    CHECK(values[0].status == Status::ok);
    CHECK(values[1].status == Status::not_finite);
    CHECK(values[2].status == Status::not_finite);
    CHECK(values[3].status != Status::ok);
    for (const std::size_t i : {1u, 2u, 3u}) {
        CHECK(values[i].points.empty());
        CHECK_FALSE(values[i].message.empty());
    }
    for (const std::size_t i : {1u, 2u}) {
        CHECK(std::isnan(values[i].x_end[0])); // there was no run
    }
    CHECK(values[4].status == Status::ok);
    CHECK(phases(values[4]).size() == 1);
}

TEST_CASE("diagram: without a period, transient and keep are times", "[diagram]") {
    // a relay oscillation of period T_r crosses x1 = 0 twice a period
    DiagramSettings<double, 3> d;
    d.run = tolerance<3>(1e-10);
    d.section.events = {EventKind::cross, EventKind::enter_sliding};
    d.transient = 100;
    d.keep = 50;
    const std::vector params{default_params<models::Relay>()};
    const Vec<double, 3> x0(0, -0.001, -0.02);
    const auto value = bifurcation_diagram(models::Relay{}, params, x0, d)[0];
    REQUIRE(value.status == Status::ok);
    const auto reference = run<DormandPrince5>(models::Relay{}, params[0], x0, 0, 150, d.run);
    std::size_t n = 0;
    for (const auto& event : reference.events)
        if (event.t >= 100 && d.section.events.has(event.kind)) {
            REQUIRE(n < value.points.size());
            CHECK(value.points[n].t_local == event.t); // the same run, to the bit
            CHECK(value.points[n++].x == event.x_right);
        }
    CHECK(n == value.points.size());
    CHECK(n > 3);
    CHECK(value.period == 0);
    CHECK(value.skipped == 0);
}

TEST_CASE("diagram: skipping what repeats itself changes no point by more than rounding",
          "[diagram]") {
    auto d = settings(1e-9);
    d.transient = 100;
    d.keep = 300;
    d.section.strobe = GENERATE(false, true);
    const auto params = oscillators({2.94, 2.92, 2.91, 2.88});
    const auto skipped = diagram(params, d);
    d.skip_repeats = false;
    const auto full = diagram(params, d);
    for (std::size_t i = 0; i < params.size(); ++i) {
        CHECK(full[i].cycle == 0);
        CHECK(full[i].skipped == 0);
        REQUIRE(skipped[i].points.size() == full[i].points.size());
        // steps may go another way round the cycle: then it is the tolerance, not rounding
        for (std::size_t k = 0; k < full[i].points.size(); ++k) {
            const auto &a = skipped[i].points[k], &b = full[i].points[k];
            CHECK(a.period == b.period);
            CHECK(a.t_local == Approx(b.t_local).epsilon(0).margin(1e-11));
            CHECK((a.x - b.x).norm() < 1e-10);
            CHECK(a.kind == b.kind);
            CHECK(a.boundary == b.boundary);
        }
        CHECK((skipped[i].x_end - full[i].x_end).norm() < 1e-10);
    }
    CHECK(skipped[0].cycle == (d.section.strobe ? 4 : 1));
    CHECK(skipped[0].skipped > 200);
    CHECK(skipped[0].counters.steps < full[0].counters.steps / 2);
}

TEST_CASE("diagram: steps over many flashes leave none out, and take none twice", "[diagram]") {
    DiagramSettings<double, 1> d;
    d.section.strobe = true;
    d.transient = 100;
    d.keep = 2000;
    for (const double a : {0.0, 0.3}) {
        CAPTURE(a);
        d.skip_repeats = true;
        const std::vector<Vec<double, 1>> p{Vec<double, 1>(a)};
        const Vec<double, 1> x0(1);
        const auto some = bifurcation_diagram<DormandPrince8>(Slow{}, p, x0, d)[0];
        d.skip_repeats = false;
        const auto all = bifurcation_diagram<DormandPrince8>(Slow{}, p, x0, d)[0];
        CHECK(some.skipped > 0);
        REQUIRE(all.points.size() == 2000);
        REQUIRE(some.points.size() == 2000);
        for (std::size_t k = 0; k < 2000; ++k) {
            REQUIRE(all.points[k].period == 101 + static_cast<long long>(k));
            REQUIRE(some.points[k].period == all.points[k].period);
            // steps at the limit of stability wander by the tolerance
            REQUIRE(std::abs(some.points[k].x[0] - all.points[k].x[0]) < d.run.rtol);
        }
    }
}

TEST_CASE("diagram: a run that does not come back is followed to its end", "[diagram]") {
    // whether chaos or a cycle longer than this: no two of its points agree
    auto d = settings(1e-12);
    d.keep = 1000;
    const Value value = diagram(oscillators({2.85809}), d)[0];
    CHECK(value.cycle == 0);
    CHECK(value.skipped == 0);
    CHECK(value.points.size() > 250);
    CHECK(phases(value, 1e-7).size() == value.points.size());
}

TEST_CASE("diagram: stops when asked, and keeps what is finished", "[diagram]") {
    auto d = settings(1e-9);
    d.parallel.threads = 1;
    std::size_t finished = 0;
    d.parallel.progress = [&](std::size_t done, std::size_t total) {
        finished = done;
        CHECK(total == 5);
    };
    d.parallel.cancelled = [&] { return finished >= 2; };
    const auto values = diagram(oscillators({2.94, 2.94, 2.94, 2.94, 2.94}), d);
    CHECK(values[0].status == Status::ok);
    CHECK(values[1].status == Status::ok);
    CHECK(values[4].status == Status::interrupted);
    CHECK(values[4].points.empty());
}

TEST_CASE("diagram: user sections are points too", "[diagram]") {
    auto d = settings();
    d.section.events = {EventKind::section};
    d.transient = 10;
    d.keep = 8;
    const auto zero_y = sections(
        Section{[](const double&, const Vec<double, 2>& x, const P&) { return x[0]; }, -1, false});
    const auto params = oscillators({2.94});
    const auto value = bifurcation_diagram<DormandPrince8>(Oscillator{}, params,
                                                           Vec<double, 2>(0, 0), d, zero_y)[0];
    // y falls through zero once an orbit, and an orbit takes four periods
    REQUIRE(value.points.size() == 2);
    for (const auto& point : value.points) {
        CHECK(std::abs(point.x[0]) < 1e-12);
        CHECK(point.x[1] < 0);
        CHECK(point.boundary == -1);
    }
}

TEST_CASE("diagram: refuses settings that make no sense", "[diagram]") {
    using Catch::Matchers::ContainsSubstring;
    const auto params = oscillators({2.94});
    const auto refused = [&](auto change, const char* words) {
        auto d = settings();
        change(d);
        CHECK_THROWS_WITH(diagram(params, d), ContainsSubstring(words));
    };
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    refused([](auto& d) { d.transient = 1.5; }, "transient = 1.5: expected a number >= 0");
    refused([](auto& d) { d.transient = nan; }, "transient = nan");
    refused([](auto& d) { d.keep = 0; }, "keep = 0: expected a number > 0");
    refused([](auto& d) { d.chains = 0; }, "chains = 0: expected an integer > 0");
    refused([](auto& d) { d.section.events = {}; }, "expected at least one kind");
    refused([](auto& d) { d.section.surface = -2; }, "section.surface = -2");
    refused([](auto& d) { d.run.rtol = 0; }, "rtol = 0");
    refused([](auto& d) { d.parallel.threads = -1; }, "threads = -1");
    CHECK_THROWS_WITH(diagram(params, settings(), Vec<double, 2>(nan, 0)),
                      ContainsSubstring("x0[0] = nan"));
    DiagramSettings<double, 3> strobe;
    strobe.section.strobe = true;
    CHECK_THROWS_WITH(bifurcation_diagram(models::Relay{},
                                          std::vector{default_params<models::Relay>()},
                                          Vec<double, 3>(0, 0, 1), strobe),
                      ContainsSubstring("expected a system with a period"));
}

TEST_CASE("diagram: the end of whole periods is not before it", "[diagram]") {
    for (int k = 1; k < 20'000; ++k) {
        const double T = 2 * std::numbers::pi / (2 + 0.001 * (k % 1000)), n = k;
        const auto end = Clock<double>::at(detail::end_of_periods(n, T), T);
        REQUIRE(end.index == k);
        REQUIRE(end.local <= 4 * ulp(n * T));
    }
}
