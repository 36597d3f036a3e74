// SPDX-License-Identifier: BSD-3-Clause
// Basins of the transition map, against the map itself, orbits found by shooting, and runs.

#include "catch.hpp"
#include "systems.hpp"

#include <filippov/basins/quotient.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/orbit.hpp>

#include <cmath>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::shared_ptr<const AnySystem>& block() {
    static const auto system = oscillator_system();
    return system;
}
Vector block_params(double A, double omega) {
    Vector p = block()->defaults();
    p[0] = A;
    p[1] = omega;
    return p;
}
Vector point(double a, double b) { return Eigen::Vector2d(a, b); }

/// Built once for all tests.
struct Built {
    TransitionMap map;
    ExitBasins basins;
    explicit Built(double A, double omega)
        : map(*block(), block_params(A, omega)), basins(exit_basins(map)) {}
};
const Built& three_orbits() { // figures 4.15 and 4.16
    static const Built built(3.6, 1.067);
    return built;
}
const Built& four_periods() { // figure 4.6a
    static const Built built(0.5, 2.94);
    return built;
}
const Built& two_transitions() { // figure 4.6b
    static const Built built(0.5, 2.9);
    return built;
}

double uniform(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

/// Labels of n random phases against the map itself.
void check_labels(const Built& b, int n) {
    std::mt19937_64 random(7);
    int resolved = 0, same_count = 0;
    for (int k = 0; k < n; ++k) {
        const Transition at{k % 2 == 0 ? -1 : 1, TransitionMap::turn * uniform(random)};
        const ExitLabel label = b.basins.at(at, k), truth = follow_exit(b.map, b.basins, at, k);
        CAPTURE(at.boundary, at.phase, label.distance, label.iterates, truth.iterates);
        CHECK(label.attractor == truth.attractor);
        CHECK(label.residue == truth.residue);
        // A change of the number is off by the graph's tolerance over the slope to where it counts.
        const auto beside = [&](double aside) {
            return b.basins.at({at.boundary, at.phase + aside}).iterates == truth.iterates;
        };
        CHECK((beside(0) || beside(-1e-5) || beside(1e-5)));
        resolved += label.attractor > 0;
        same_count += label.iterates == truth.iterates;
    }
    CHECK(resolved == n);
    CHECK(same_count >= n - 1 - n / 500); // the graph's tolerance beside changes
}
/// A multiplier over as many forcing periods as the orbit of the map takes.
double multiplier(const Orbit& orbit, const MapOrbit& of) {
    REQUIRE(orbit.status == Status::ok);
    return std::pow(orbit.multipliers[0].real(), double(of.periods) / orbit.cycle.turns);
}
void check_complete(const Built& b) {
    CAPTURE(b.basins.message);
    CHECK(b.basins.status == Status::ok);
    CHECK(b.basins.unresolved == 0);
    CHECK(b.basins.disagreements == 0);
    CHECK(b.basins.checks >= 64);
    double covered = 0;
    for (const BasinInterval& i : b.basins.intervals)
        covered += i.width();
    CHECK(covered == Approx(2 * TransitionMap::turn).epsilon(1e-14));
    // an unstable orbit is its own image: its slope tells how far rounding carries
    for (const MapOrbit& s : b.basins.saddles) {
        CHECK_FALSE(s.stable());
        const Image image = b.map(s.points[0], s.period());
        CHECK(std::abs(detail::around(image.to.phase - s.points[0].phase)) <
              1e-11 * (1 + std::abs(s.slope)));
        CHECK(image.turns == s.periods);
    }
}
/// Every end is led to the orbit or jump that is its cause.
void check_ends(const Built& b) {
    for (const BasinEnd& e : b.basins.ends) {
        CAPTURE(e.at.boundary, e.at.phase, e.uncertainty, e.steps);
        REQUIRE(e.cause == EndCause::unstable_orbit);
        CHECK(e.uncertainty < 1e-11);
        Transition at = e.at;
        double growth = 1;
        for (int k = 0; k < e.steps; ++k) {
            const Image image = b.map(at);
            growth *= std::abs(image.slope);
            at = image.to;
        }
        double apart = 1;
        for (const Transition& x : b.basins.saddles[std::size_t(e.orbit)].points)
            if (x.boundary == at.boundary)
                apart = std::min(apart, std::abs(detail::around(x.phase - at.phase)));
        CHECK(apart < 1e-11 * (1 + growth));
        // beside it fates differ
        const double aside = 1e-7;
        const ExitLabel left = follow_exit(b.map, b.basins, {e.at.boundary, e.at.phase - aside});
        const ExitLabel right = follow_exit(b.map, b.basins, {e.at.boundary, e.at.phase + aside});
        CHECK((left.attractor != right.attractor || left.residue != right.residue));
    }
}

} // namespace

TEST_CASE("quotient: two attractors and the saddle between them", "[quotient]") {
    const Built& b = three_orbits();
    check_complete(b);
    check_ends(b);
    REQUIRE(b.basins.attractors.size() == 2);
    REQUIRE(b.basins.saddles.size() == 1);
    const Vector& p = b.map.params();
    const Orbit upper = orbit_near(*block(), p, 0, point(-0.685, 3.01), 1);
    const Orbit lower = orbit_near(*block(), p, 0, point(-0.295, 0.99), 1);
    const Orbit saddle = orbit_near(*block(), p, 0, point(-0.445, 1.27), 1);
    const MapOrbit &first = b.basins.attractors[0].orbit, &second = b.basins.attractors[1].orbit,
                   &third = b.basins.saddles[0];
    CHECK(first.period() == 1);
    CHECK(second.period() == 2);
    CHECK(third.period() == 2);
    CHECK(std::abs(first.slope - multiplier(upper, first)) < 1e-9);
    CHECK(std::abs(second.slope - multiplier(lower, second)) < 1e-9);
    CHECK(std::abs(third.slope - multiplier(saddle, third)) < 1e-9);
    // both points of the saddle are ends
    for (const Transition& x : third.points)
        CHECK(std::any_of(b.basins.ends.begin(), b.basins.ends.end(), [&](const BasinEnd& e) {
            return e.at.boundary == x.boundary && e.at.phase == x.phase && e.steps == 0;
        }));
    CHECK(b.basins.at(third.points[0]).attractor == 0); // on the end: not resolved
    CHECK(b.basins.at(third.points[0]).distance == 0);
    CHECK(b.basins.evaluations < 5000);
    check_labels(b, 60);
}

TEST_CASE("quotient: labels of a thousand phases are those of the map", "[.long][quotient]") {
    check_labels(three_orbits(), 1000);
    check_labels(four_periods(), 1000);
    check_labels(two_transitions(), 1000);
}

TEST_CASE("quotient: an orbit of two transitions, told by its forcing periods", "[quotient]") {
    const Built& b = two_transitions();
    check_complete(b);
    check_ends(b);
    REQUIRE(b.basins.attractors.size() == 1);
    const MapOrbit& orbit = b.basins.attractors[0].orbit;
    CHECK(orbit.period() == 2);
    CHECK(orbit.periods == 4);
    CHECK(std::abs(orbit.slope - multiplier(settle(*block(), b.map.params(), point(0, 0)), orbit)) <
          1e-9);
    // on the orbit itself: each point is passed so many periods after the first
    for (std::size_t j = 0; j < 2; ++j)
        for (const long long period : {-5LL, 0LL, 3LL, 11LL}) {
            const ExitLabel label = b.basins.at(orbit.points[j], period);
            CHECK(label.residue == detail::residue_of(period - orbit.turns[j], 4));
            CHECK(label.iterates == 0);
        }
    check_labels(b, 40);
}

TEST_CASE("quotient: the residue says which copy of an orbit the strobe map finds", "[quotient]") {
    const Built& b = four_periods();
    check_complete(b);
    check_ends(b);
    REQUIRE(b.basins.attractors.size() == 1);
    const MapOrbit& orbit = b.basins.attractors[0].orbit;
    REQUIRE(orbit.periods == 4);
    const double T = b.map.period();
    const Vector& p = b.map.params();
    // the states of the copy 0 at 4 n - r periods
    const auto exit = b.map.exit_point(orbit.points[0]);
    REQUIRE(exit);
    std::vector<Vector> copies;
    for (int r = 0; r < 4; ++r) {
        const Leg leg{.t0 = b.map.time_of(orbit.points[0].phase),
                      .x = exit->x,
                      .t_end = (8 - r) * T,
                      .boundary = orbit.points[0].boundary};
        const Journey journey = block()->journey(leg, p, {});
        REQUIRE(journey.status == Status::ok);
        copies.push_back(journey.end.value.head(2));
    }
    std::array<int, 4> met{};
    std::mt19937_64 random(11);
    for (int k = 0; k < 24; ++k) {
        const Vector x0 = point(-6 + 12 * uniform(random), -4 + 8 * uniform(random));
        const double t0 = k % 4 * T; // a period later is another copy
        const History run = block()->run(t0, x0, 120 * T, p);
        REQUIRE(run.status == Status::ok);
        const auto first = std::find_if(run.events.begin(), run.events.end(), [](const auto& e) {
            return e.kind == EventKind::exit_sliding;
        });
        REQUIRE(first != run.events.end());
        const double periods = std::floor(first->t / T);
        const ExitLabel label = b.basins.at(
            {first->after, (first->t / T - periods) * TransitionMap::turn}, std::llround(periods));
        CAPTURE(k, label.residue);
        REQUIRE(label.attractor == 1);
        REQUIRE(label.residue >= 0);
        ++met[std::size_t(label.residue)];
        // the multiplier 0.22 leaves nothing of the start after thirty rounds
        CHECK((run.x - copies[std::size_t(label.residue)]).norm() < 1e-7);
    }
    CHECK(std::all_of(met.begin(), met.end(), [](int n) { return n > 0; }));
    CHECK((copies[0] - copies[1]).norm() > 0.1);
    check_labels(b, 40);
}

TEST_CASE("quotient: a long cycle in a range that looks chaotic", "[quotient]") {
    const Built b(0.5, 2.893);
    check_complete(b);
    check_ends(b);
    REQUIRE(b.basins.attractors.size() == 1);
    const MapOrbit& orbit = b.basins.attractors[0].orbit;
    CHECK(orbit.period() == 16);
    CHECK(orbit.periods == 50);
    // lyapunov.hpp finds the exponent -0.00905 here, in units of time
    CHECK(std::log(std::abs(orbit.slope)) / (50 * b.map.period()) == Approx(-0.00905).margin(1e-5));
    const Image image = b.map(orbit.points[0], 16);
    CHECK(std::abs(detail::around(image.to.phase - orbit.points[0].phase)) < 1e-10);
    CHECK(image.turns == 50);
}

TEST_CASE("quotient: what is not seen to repeat itself is kept as arcs", "[quotient]") {
    // the orbit of two transitions, where one is the most that is looked for
    const Built& known = two_transitions();
    const ExitBasins basins = exit_basins(known.map, {.settle = 100, .max_period = 1, .audits = 8});
    CHECK(basins.status == Status::ok);
    CHECK(basins.disagreements == 0);
    REQUIRE(basins.attractors.size() == 1);
    const MapAttractor& a = basins.attractors[0];
    CHECK_FALSE(a.periodic);
    CHECK(std::count(a.cells[0].begin(), a.cells[0].end(), true) == 2);
    CHECK(std::count(a.cells[1].begin(), a.cells[1].end(), true) == 0);
    for (const Transition& c : known.basins.attractors[0].orbit.points) {
        CHECK(a.cells[0][std::size_t(c.phase / TransitionMap::turn * 1024)]);
        const ExitLabel label = basins.at(c, 3);
        CHECK(label.attractor == 1);
        CHECK(label.residue == 0);
        CHECK(label.iterates == 0);
    }
}

TEST_CASE("quotient: an orbit too fine for the graph is not called an attractor without a word",
          "[.long][quotient]") {
    // 81 transitions, 297 forcing periods: what is nearer than 6e-5 is sure to stay
    const TransitionMap map(*block(), block_params(0.5, 2.88));
    const ExitBasins basins = exit_basins(map);
    CHECK(basins.status == Status::not_converged);
    CHECK_THAT(basins.message, ContainsSubstring("lower its tolerance"));
    const ExitBasins finer = exit_basins(map, {.graph = {.samples = 64, .tolerance = 1e-8}});
    REQUIRE(finer.attractors.size() == 1);
    const MapOrbit& orbit = finer.attractors[0].orbit;
    CHECK(orbit.period() == 81);
    CHECK(orbit.periods == 297);
    const Image image = map(orbit.points[0], 81);
    CHECK(std::abs(detail::around(image.to.phase - orbit.points[0].phase)) < 1e-10);
    CHECK(image.turns == 297);
    CHECK(image.slope == Approx(orbit.slope).epsilon(1e-6));
}

TEST_CASE("quotient: slip for ever is no return", "[quotient]") {
    Vector p = block_params(0.5, 3.0);
    p[5] = 50; // a belt too fast to be caught up
    p[7] = 0;
    const TransitionMap nowhere(*block(), p, {.max_periods = 3});
    const ExitBasins none = exit_basins(nowhere, {.graph = {.samples = 8}});
    CHECK(none.status == Status::escaped); // of the graph: nothing is defined
    CHECK(none.at({-1, 0.5}).attractor == 0);
    // figure 4.9: the orbit "-+" only crosses
    const TransitionMap map(*block(), block_params(5, 1.6), {.max_periods = 5});
    const ExitBasins basins = exit_basins(map, {.graph = {.samples = 16}, .audits = 8});
    CHECK(basins.attractors.empty());
    CHECK(basins.disagreements == 0);
    const ExitLabel label = basins.at({-1, 3.0});
    CHECK(label.attractor == -1);
    CHECK(label.status == Status::escaped);
    CHECK(label.residue == -1);
}

TEST_CASE("quotient: work is bounded, and can be stopped", "[quotient]") {
    const Vector p = block_params(3.6, 1.067);
    const ExitBasins few = exit_basins(TransitionMap(*block(), p), {.max_evaluations = 20});
    CHECK(few.status == Status::max_steps);
    int asked = 0, limit = 0;
    const auto system = oscillator_system({.interrupted = [&] { return ++asked > limit; }});
    const TransitionMap map(*system, p);
    limit = std::numeric_limits<int>::max();
    CHECK(exit_basins(map).status == Status::ok);
    const int all = asked;
    for (int k = 1; k < 12; ++k) { // at every stage
        limit = k * all / 12;
        asked = 0;
        const ExitBasins stopped = exit_basins(map);
        CAPTURE(limit, all);
        CHECK(stopped.status == Status::interrupted);
        CHECK(asked < limit + 200);
        CHECK(stopped.at({-1, 1.0}).attractor >= 0);
    }
}

TEST_CASE("quotient: whether it applies, and why not", "[quotient]") {
    const QuotientApplies yes = quotient_applies(*block(), block_params(3.6, 1.067));
    CHECK(yes);
    const auto relay = relay_system();
    const auto autonomous = dieci_lopez_system();
    const auto stiction = any_system(models::Stiction{});
    const auto why = [](const AnySystem& system, const Vector& p) {
        const QuotientApplies no = quotient_applies(system, p);
        CHECK_FALSE(no);
        return no.reason;
    };
    CHECK_THAT(why(*relay, relay->defaults()), ContainsSubstring("planar"));
    CHECK_THAT(why(*autonomous, autonomous->defaults()), ContainsSubstring("period"));
    CHECK_THAT(why(*stiction, stiction->defaults()), ContainsSubstring("static friction"));
    Vector p = block_params(0.5, 3.0);
    p[5] = 50; // a belt too fast to be caught up
    p[7] = 0;
    CHECK_FALSE(quotient_applies(*block(), p));
}

TEST_CASE("quotient: what makes no sense is refused", "[quotient]") {
    const TransitionMap map(*block(), block_params(3.6, 1.067));
    const auto words = [](auto use) -> std::string {
        try {
            use();
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
        return "";
    };
    const double nan = std::nan("");
    CHECK_THAT(words([&] { exit_basins(map, {.distance = nan}); }),
               ContainsSubstring("distance = nan"));
    CHECK_THAT(words([&] { exit_basins(map, {.resolution = 0}); }),
               ContainsSubstring("resolution = 0"));
    CHECK_THAT(words([&] { exit_basins(map, {.settle = 0}); }), ContainsSubstring("settle = 0"));
    CHECK_THAT(words([&] { exit_basins(map, {.audits = -1}); }), ContainsSubstring("audits = -1"));
    const ExitBasins empty;
    CHECK_THAT(words([&] { empty.at({0, 1}); }), ContainsSubstring("exit.boundary = 0"));
    CHECK_THAT(words([&] { empty.at({1, nan}); }), ContainsSubstring("exit.phase = nan"));
}
