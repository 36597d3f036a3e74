// SPDX-License-Identifier: BSD-3-Clause
// Maps and their slopes, against closed forms, differences, and orbits found by shooting.

#include "catch.hpp"
#include "systems.hpp"

#include <filippov/models/coulomb.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/map_graph.hpp>
#include <filippov/orbits/orbit.hpp>

#include <cmath>
#include <numbers>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

/// A block on a belt that shakes with the forcing: the surface moves, no capability helps.
///   x'' = -x - c x' + a cos(omega t) - mu sign(h),  h = x' - V - b cos(omega t)
struct Shaker {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 6> params{"c", "a", "b", "mu", "V", "omega"};
    static constexpr std::array<double, 6> defaults{0.1, 1.2, 0.3, 2.0, 1.0, 1.7};
    template <Scalar S> static S drive(const S& t, const Vec<S, 6>& p) {
        using elementary::cos;
        return cos(p[5] * t);
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {x[1], p[1] * drive(t, p) - x[0] - p[0] * x[1] + p[3]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {x[1], p[1] * drive(t, p) - x[0] - p[0] * x[1] - p[3]};
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return x[1] - p[4] - p[2] * drive(t, p);
    }
    template <Scalar S> S period(const Vec<S, 6>& p) const {
        return S(2 * std::numbers::pi) / p[5];
    }
};

/// x'' = -x - F sign x' + A cos(omega t): friction alone damps it.
struct Undamped {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"F", "A", "omega"};
    static constexpr std::array<double, 3> defaults{0.3, 1, 0.5};
    template <Scalar S>
    static Vec<S, 2> pulled(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p, double side) {
        using elementary::cos;
        return {x[1], p[1] * cos(p[2] * t) - x[0] - S(side) * p[0]};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return pulled(t, x, p, -1);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return pulled(t, x, p, 1);
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const { return x[1]; }
    template <Scalar S> S period(const Vec<S, 3>& p) const {
        return S(2 * std::numbers::pi) / p[2];
    }
};

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

/// Central difference of the lifted phase.
double difference(const TransitionMap& map, const Transition& at, double step, int iterate = 1) {
    const auto lifted = [&](double phase) {
        const Image image = map({at.boundary, phase}, iterate);
        return image.to.phase + TransitionMap::turn * double(image.turns);
    };
    return (lifted(at.phase + step) - lifted(at.phase - step)) / (2 * step);
}

/// The orbit through a fixed point, by shooting on its word. Starts a moment after the transition:
/// an orbit's start is better not an event.
Orbit orbit_of(const TransitionMap& map, const FixedPoint& point) {
    const double t0 = map.time_of(point.at.phase), moment = 0.01;
    const auto exit = map.exit_point(point.at);
    REQUIRE(exit);
    Leg leg{.t0 = t0, .x = exit->x, .t_end = t0 + moment};
    leg.boundary = point.at.boundary;
    const Journey start = map.system().journey(leg, map.params(), {});
    REQUIRE(start.status == Status::ok);
    return orbit_near(map.system(), map.params(), t0 + moment, start.end.value.head(2),
                      int(point.turns));
}

/// Sign changes of P(phase) - phase on a grid, those at jumps left out.
std::vector<std::pair<double, double>> roots_on_grid(const TransitionMap& map, int iterate,
                                                     int boundary, double low, double high, int n) {
    std::vector<std::pair<double, double>> found;
    const auto gap = [](const Image& i, double at) {
        return std::remainder(i.to.phase - at, TransitionMap::turn);
    };
    Image before = map({boundary, low}, iterate);
    double phase0 = low;
    for (int k = 1; k <= n; ++k) {
        const double phase = low + (high - low) * k / n;
        const Image now = map({boundary, phase}, iterate);
        const double f0 = gap(before, phase0), f1 = gap(now, phase);
        // a jump changes the sign by a leap, a root by what the slopes explain
        const double reach =
            2 * (std::abs(before.slope) + std::abs(now.slope) + 2) * (phase - phase0);
        const bool back = before.to.boundary == boundary && now.to.boundary == boundary;
        if (before.ok() && now.ok() && back && before.true_exit && now.true_exit && f0 * f1 <= 0 &&
            std::abs(f0 - f1) < reach)
            found.emplace_back(phase0, phase);
        before = now;
        phase0 = phase;
    }
    return found;
}

} // namespace

TEST_CASE("maps: the strobe map's slope is the orbit's monodromy matrix", "[maps]") {
    for (const double omega : {2.5, 2.8}) {
        const Vector p = block_params(5, omega);
        const Orbit orbit = settle(*block(), p, point(0, 0));
        REQUIRE(orbit.status == Status::ok);
        const Mapped m = strobe(*block(), orbit.t_start, orbit.x_start, p, orbit.cycle.turns);
        REQUIRE(m.ok());
        CHECK((m.x - orbit.x_start).norm() < 1e-10);
        CHECK(m.t == Approx(orbit.t_start + orbit.cycle.period).epsilon(1e-15));
        CHECK((m.slope.topLeftCorner(2, 2) - orbit.monodromy).norm() < 1e-9);
        // later by dt at the start is later by dt at the end
        CHECK(m.slope(2, 2) == Approx(1).epsilon(1e-14));
    }
}

TEST_CASE("maps: the strobe map's slopes are those of differences", "[maps]") {
    const Vector p = block_params(3.6, 1.067);
    const double e = 1e-6;
    const Mapped m = strobe(*block(), 0.3, point(-0.7, 0.2), p);
    REQUIRE(m.ok());
    for (int i = 0; i < 3; ++i) {
        Vector dx = Vector::Zero(2);
        if (i < 2)
            dx[i] = e;
        const double dt = i < 2 ? 0 : e;
        const Mapped a = strobe(*block(), 0.3 + dt, point(-0.7, 0.2) + dx, p);
        const Mapped b = strobe(*block(), 0.3 - dt, point(-0.7, 0.2) - dx, p);
        // rounding of 1e-12/e and a curvature of e^2
        CHECK(((a.x - b.x) / (2 * e) - m.slope.col(i).head(2)).norm() < 2e-6);
        CHECK((a.t - b.t) / (2 * e) == Approx(m.slope(2, i)).margin(1e-8));
    }
}

TEST_CASE("maps: slopes by parameters are those of differences", "[maps]") {
    const auto system = any_system(Shaker{});
    const Vector p = system->defaults(), x0 = point(-0.7, 0.2);
    const Directions along{{5, 3}, nullptr}; // omega, on which the period depends, and mu
    const double e = 1e-6;
    const auto strobed = [&](const Vector& q) { return strobe(*system, 0.3, x0, q, 2, along); };
    const auto met = [&](const Vector& q) {
        return section_map(*system, {EventKind::exit_sliding}, 0.3, x0, q, 50, 2, along);
    };
    const auto check = [&](const auto& map) {
        const Mapped m = map(p);
        REQUIRE(m.ok());
        CHECK(m.message.empty());
        CHECK(m.slides > 0);
        CHECK_FALSE(m.singular);
        CHECK(m.param_slope.norm() > 0.1);
        for (int k = 0; k < 2; ++k) {
            Vector dp = Vector::Zero(6);
            dp[along.active[std::size_t(k)]] = e;
            const Mapped a = map(p + dp), b = map(p - dp);
            // rounding of 1e-12/e and a curvature of e^2
            CHECK(((a.x - b.x) / (2 * e) - m.param_slope.col(k).head(2)).norm() < 2e-6);
            CHECK((a.t - b.t) / (2 * e) == Approx(m.param_slope(2, k)).margin(2e-6));
        }
    };
    check(strobed);
    check(met);
    const double T = 2 * std::numbers::pi / 1.7;
    CHECK(strobed(p).param_slope(2, 0) == Approx(-2 * T / 1.7).epsilon(1e-14));
}

TEST_CASE("maps: sections that make no map are refused, and callers who ask to stop are heard",
          "[maps]") {
    const Vector p = block_params(0.5, 2.9);
    for (const EventKind kind : {EventKind::graze, EventKind::slide_extremum, EventKind::section})
        CHECK_THROWS_WITH(section_map(*block(), {kind}, 0, point(0, 0), p, 10),
                          ContainsSubstring("section.kind"));
    CHECK_THROWS_WITH(section_map(*block(), {.after = 3}, 0, point(0, 0), p, 10),
                      ContainsSubstring("section.after"));
    CHECK_THROWS_WITH(strobe(*block(), 0, point(0, 0), p, 1, {{10, -1}, nullptr}),
                      ContainsSubstring("along.active"));
    Precision precision;
    precision.interrupted = [] { return true; };
    const auto stopped = oscillator_system(precision);
    CHECK(strobe(*stopped, 0, point(0, 0), p, 1'000'000).status == Status::interrupted);
    CHECK(section_map(*stopped, {}, 0, point(0, 0), p, 100, 1'000'000).status ==
          Status::interrupted);
}

TEST_CASE("maps: the section map returns after the period of a limit cycle", "[maps]") {
    const auto system = dieci_lopez_system();
    const Vector p = system->defaults();
    const SectionOf exits{EventKind::exit_sliding, -1};
    const Mapped first = section_map(*system, exits, 0, point(0, 0), p, 100, 3);
    REQUIRE(first.ok());
    const Mapped next = section_map(*system, exits, first.t, first.x, p, 100);
    REQUIRE(next.ok());
    CHECK((next.x - first.x).norm() < 1e-10);
    CHECK(next.t - first.t == Approx(9.230770458083).epsilon(1e-11));
    // every slide ends in the same point: no deviation is left of the state, only of time
    CHECK(next.slope.topRows(2).norm() < 1e-9);
    CHECK(next.slope(2, 2) == Approx(1).epsilon(1e-12));

    const Mapped never = section_map(*system, {EventKind::cross}, 0, point(0, 0), p, 20);
    CHECK(never.status == Status::escaped);
    CHECK_THAT(never.message, ContainsSubstring("cross"));
}

TEST_CASE("maps: the exit curve is that of the closed form", "[maps]") {
    const double A = 0.5, omega = 2.94;
    const TransitionMap map(*block(), block_params(A, omega));
    for (int k = 0; k < 100; ++k) {
        const double phase = 0.063 * k;
        for (const int boundary : {-1, 1}) {
            const auto exit = map.exit_point({boundary, phase});
            REQUIRE(exit);
            CHECK(exit->x[0] == Approx(-boundary * 4 + A * std::cos(phase)).epsilon(1e-14));
            CHECK(exit->x[1] == 1);
            CHECK(exit->rate[0] == Approx(-A * omega * std::sin(phase)).margin(1e-13));
            CHECK(exit->true_exit() == (-boundary * (1 + A * omega * std::sin(phase)) > 0));
            CHECK(map({boundary, phase}).true_exit == exit->true_exit());
        }
    }
}

TEST_CASE("maps: the exit curve of a surface that moves", "[maps]") {
    const auto system = any_system(Shaker{});
    const Vector p = system->defaults();
    const TransitionMap map(*system, p);
    for (int k = 0; k < 20; ++k)
        for (const int boundary : {-1, 1}) {
            const double phase = 0.05 + 0.3 * k; // a difference over 2 pi is none
            const auto exit = map.exit_point({boundary, phase});
            REQUIRE(exit);
            const double v = p[4] + p[2] * std::cos(phase);
            // L = a cos - x - c v -+ mu + b omega sin = 0
            const double x =
                p[1] * std::cos(phase) - p[0] * v - boundary * p[3] + p[2] * p[5] * std::sin(phase);
            CHECK(exit->x[0] == Approx(x).epsilon(1e-13));
            CHECK(exit->x[1] == Approx(v).epsilon(1e-13));
            const Image image = map({boundary, phase});
            if (!image.ok())
                continue;
            CAPTURE(boundary, phase, image.word);
            CHECK(image.slope == Approx(difference(map, {boundary, phase}, 1e-6)).margin(1e-5));
        }
}

TEST_CASE("maps: slopes go through events, and through slides that start the map", "[maps]") {
    for (const double omega : {2.94, 2.9}) {
        const TransitionMap map(*block(), block_params(0.5, omega));
        for (const int boundary : {-1, 1})
            for (const double phase : {0.5, 2.0, 3.5, 4.0, 4.5, 5.0, 5.6, 6.0})
                for (const int iterate : {1, 2}) {
                    CAPTURE(omega, boundary, phase, iterate);
                    const Image image = map({boundary, phase}, iterate);
                    REQUIRE(image.ok());
                    const double d = difference(map, {boundary, phase}, 1e-6, iterate);
                    CHECK(image.slope == Approx(d).epsilon(1e-5).margin(2e-6));
                }
    }
}

TEST_CASE("maps: an iterate is the map of the map", "[maps]") {
    const TransitionMap map(*block(), block_params(0.5, 2.9));
    for (const double phase : {0.1, 1.0, 3.3, 4.2, 6.0}) {
        const Image one = map({-1, phase}), two = map(one.to), both = map({-1, phase}, 2);
        CHECK(both.to.phase == two.to.phase);
        CHECK(both.to.boundary == two.to.boundary);
        CHECK(both.slope == one.slope * two.slope);
        CHECK(both.turns == one.turns + two.turns);
        CHECK(both.word == one.word + "|" + two.word);
    }
}

TEST_CASE("map_graph: the chapter's figures 4.6 and 4.8", "[maps]") {
    struct Case {
        double omega;
        int iterate;
        std::vector<std::pair<int, bool>> points; // prime, stable; by phase
    };
    for (const Case& c : {Case{2.94, 1, {{1, true}, {1, false}}},
                          {2.94, 2, {{1, true}, {1, false}}},
                          {2.9, 1, {{1, false}}},
                          {2.9, 2, {{2, true}, {1, false}, {2, true}}},
                          {2.895, 1, {{1, false}}},
                          {2.895, 2, {{2, true}, {1, false}, {2, true}}},
                          {2.893, 1, {}},
                          {2.893, 2, {}}}) {
        CAPTURE(c.omega, c.iterate);
        const TransitionMap map(*block(), block_params(0.5, c.omega));
        const MapGraph graph = map_graph(map, c.iterate);
        REQUIRE(graph.status == Status::ok);
        REQUIRE(graph.fixed_points.size() == c.points.size());
        for (std::size_t k = 0; k < c.points.size(); ++k) {
            const FixedPoint& f = graph.fixed_points[k];
            CHECK(f.at.boundary == -1);
            CHECK(f.prime == c.points[k].first);
            CHECK(f.stable() == c.points[k].second);
            CHECK_FALSE(f.tangent);
            const Image image = map(f.at, c.iterate);
            // an error of 1e-12 in the map moves the point less than that, but not its image
            CHECK(std::remainder(image.to.phase - f.at.phase, TransitionMap::turn) ==
                  Approx(0).margin(1e-11 * (1 + std::abs(f.slope))));
        }
    }
}

TEST_CASE("map_graph: slopes are the multipliers of the orbits", "[maps]") {
    for (const double omega : {2.94, 2.9, 2.895}) {
        const TransitionMap map(*block(), block_params(0.5, omega));
        for (const int iterate : {1, 2})
            for (const FixedPoint& f : map_graph(map, iterate).fixed_points) {
                if (f.prime != iterate)
                    continue;
                CAPTURE(omega, iterate, f.at.phase, f.slope);
                const Orbit orbit = orbit_of(map, f);
                REQUIRE(orbit.status == Status::ok);
                CHECK(orbit.cycle.turns == f.turns);
                CHECK(orbit.multipliers[1] == 0.0);
                CHECK(std::abs(orbit.multipliers[0] - f.slope) <=
                      1e-9 * std::max(1.0, std::abs(f.slope)));
                // one of its transitions is at this phase
                double nearest = 1;
                for (std::size_t i = 0; i < orbit.cycle.size(); ++i)
                    if (orbit.cycle.word[i + orbit.cycle.size() - 1].mode == 0)
                        nearest = std::min(
                            nearest,
                            std::abs(std::remainder(
                                orbit.cycle.t[i] / map.period() * TransitionMap::turn - f.at.phase,
                                TransitionMap::turn)));
                CHECK(nearest < 1e-10);
            }
    }
}

TEST_CASE("map_graph: the stable point is where a run settles", "[maps]") {
    const Vector p = block_params(0.5, 2.94);
    const TransitionMap map(*block(), p);
    const MapGraph graph = map_graph(map);
    const Orbit orbit = settle(*block(), p, point(0, 0));
    REQUIRE(orbit.status == Status::ok);
    const FixedPoint& f = graph.fixed_points.at(0);
    CHECK(f.stable());
    CHECK(orbit.cycle.turns == f.turns);
    CHECK(std::abs(orbit.multipliers[0] - f.slope) < 1e-9);
}

TEST_CASE("map_graph: a belt at rest, where slides end in tangencies, is graphed in bounded time",
          "[maps]") {
    // (A run whose derivative is infinite once had no time either, and so 2^63 turns to count.)
    Vector p = block_params(3.07, 3.816);
    p[5] = 0; // V
    const TransitionMap map(*block(), p, {.max_periods = 20});
    // The friction is at its limit at phase pi, with s' = 0. From d before it the block slips, with
    // an acceleration A omega d that its rate -A omega^2 turns back: |v| reaches about A omega d^3,
    // 3e-13 from 3e-5.
    const Image image = map({-1, std::numbers::pi - 3e-5}, 1);
    CHECK(image.ok());
    CHECK(image.singular);
    CHECK(std::abs(image.turns) <= 20);
    // From 1e-7 it would be 1e-20, below the rounding of h in a step: that is no slip (H32).
    const Image nothing = map({-1, std::numbers::pi - 1e-7}, 1);
    CHECK(nothing.status == Status::escaped);
    CHECK_THAT(nothing.message, ContainsSubstring("The stick lasts longer"));
    const MapGraph graph = map_graph(map, 1, {.max_evaluations = 2000});
    CHECK(graph.status == Status::max_steps);
    CHECK(graph.evaluations < 2100);
    for (const MapSample& s : graph.samples)
        if (s.image.ok())
            REQUIRE(std::abs(s.image.turns) <= 20);
}

TEST_CASE("map_graph: breaks have both of their values", "[maps]") {
    const TransitionMap map(*block(), block_params(0.5, 2.94));
    const MapGraph graph = map_graph(map);
    int jumps = 0, starts = 0;
    for (const MapBreak& b : graph.breaks) {
        CHECK(b.right.at.phase > b.left.at.phase);
        CHECK(b.right.at.phase - b.left.at.phase < 1e-12);
        CHECK(b.left.at.boundary == b.right.at.boundary);
        jumps += b.jump();
        // where the map begins to start with a slide: 1 + A omega sin(phase) = 0
        const double edge = std::asin(-1 / (0.5 * 2.94));
        for (const double phase : {std::numbers::pi - edge, 2 * std::numbers::pi + edge})
            starts += b.left.at.boundary < 0 && std::abs(b.left.at.phase - phase) < 1e-3;
    }
    CHECK(starts == 2);
    CHECK(jumps == 6);
    // samples are in order and cover both circles
    for (std::size_t k = 1; k < graph.samples.size(); ++k) {
        const Transition &a = graph.samples[k - 1].at, &b = graph.samples[k].at;
        CHECK((a.boundary < b.boundary || (a.boundary == b.boundary && a.phase < b.phase)));
    }
}

TEST_CASE("map_graph: the three orbits of figure 4.16", "[maps]") {
    // by transitions: one of period one, two of period two that leave at both boundaries in turn
    const Vector p = block_params(3.6, 1.067);
    const TransitionMap map(*block(), p);
    const MapGraph graph = map_graph(map, 2, {.samples = 64});
    REQUIRE(graph.fixed_points.size() == 5);
    const Orbit a = orbit_near(*block(), p, 0, point(-0.685, 3.01), 1);
    const Orbit b = settle(*block(), p, point(0, 0));
    const Orbit c = orbit_near(*block(), p, 0, point(-0.445, 1.27), 1);
    const auto points_of = [&](const Orbit& orbit) {
        REQUIRE(orbit.status == Status::ok);
        // the multiplier of as many forcing periods as the iterate takes
        return std::count_if(
            graph.fixed_points.begin(), graph.fixed_points.end(), [&](const FixedPoint& f) {
                const double m = std::pow(orbit.multipliers[0].real(), double(f.turns));
                return std::abs(m - f.slope) < 1e-9;
            });
    };
    CHECK(points_of(a) == 1);
    CHECK(points_of(b) == 2);
    CHECK(points_of(c) == 2);
}

namespace {

/// Where the slope of P^2 is one between two phases of boundary -1.
double summit(const TransitionMap& map, double a, double b) {
    for (int k = 0; k < 50; ++k) {
        const double middle = (a + b) / 2;
        (map({-1, middle}, 2).slope < 1 ? a : b) = middle;
    }
    return (a + b) / 2;
}
/// How far P^2 is from the diagonal there.
double height(const TransitionMap& map) {
    const double phase = summit(map, 1.88, 2.0);
    return std::remainder(map({-1, phase}, 2).to.phase - phase, TransitionMap::turn);
}

} // namespace

TEST_CASE("map_graph: roots as close as a fold makes them, and its double root", "[.long][maps]") {
    // two orbits of period two merge between these frequencies; secant on the distance of the
    // graph from the diagonal
    const auto map_at = [](double omega) {
        return TransitionMap(*block(), block_params(3.6, omega));
    };
    double w0 = 1.11, w1 = 1.111, h0 = height(map_at(w0)), h1 = height(map_at(w1));
    for (int k = 0; k < 12 && std::abs(h1) > 1e-13; ++k) {
        const double w2 = w1 - h1 * (w1 - w0) / (h1 - h0);
        w0 = std::exchange(w1, w2);
        h0 = std::exchange(h1, height(map_at(w1)));
    }
    CAPTURE(w1, h1);
    REQUIRE(std::abs(h1) < 1e-12);
    const auto near_fold = [&](double omega) {
        std::vector<FixedPoint> found;
        for (const FixedPoint& f : map_graph(map_at(omega), 2, {.samples = 32}).fixed_points)
            if (f.at.boundary == -1 && f.prime == 2)
                found.push_back(f);
        return found;
    };
    double last = 0;
    for (const double below : {1e-6, 1e-8, 1e-10}) {
        CAPTURE(below);
        const auto pair = near_fold(w1 - below);
        REQUIRE(pair.size() == 2);
        CHECK(pair[0].stable() != pair[1].stable());
        CHECK_FALSE(pair[0].tangent);
        const double apart = std::abs(pair[1].at.phase - pair[0].at.phase);
        if (last > 0) // as the root of the distance; rounding of 1e-12 counts at the last
            CHECK(last / apart == Approx(10).epsilon(0.1));
        last = apart;
    }
    CHECK(near_fold(w1 + 1e-9).empty());
    const auto at = near_fold(w1);
    REQUIRE_FALSE(at.empty());
    CHECK(std::abs(at[0].slope - 1) < 1e-3);
}

TEST_CASE("map_graph: a regime without stick has no map, and says so", "[maps]") {
    // a belt too fast to be caught up: slip for ever
    Vector p = block_params(0.5, 3.0);
    p[5] = 50;
    p[7] = 0;
    const TransitionMap map(*block(), p, {.max_periods = 3});
    const Image image = map({-1, 0.5});
    CHECK(image.status == Status::escaped);
    CHECK_THAT(image.message, ContainsSubstring("No stick"));
    const MapGraph graph = map_graph(map, 1, {.samples = 8});
    CHECK(graph.status == Status::escaped);
    CHECK_THAT(graph.message, ContainsSubstring("nowhere"));
    CHECK(graph.fixed_points.empty());
}

TEST_CASE("map_graph: work is bounded, and can be stopped", "[maps]") {
    const Vector p = block_params(0.5, 2.94);
    const MapGraph few = map_graph(TransitionMap(*block(), p), 1, {.max_evaluations = 100});
    CHECK(few.status == Status::max_steps);
    CHECK(few.evaluations <= 110);
    int asked = 0;
    const auto system = oscillator_system({.interrupted = [&] { return ++asked > 50; }});
    const TransitionMap map(*system, p);
    CHECK(map_graph(map).status == Status::interrupted);
}

TEST_CASE("maps: what makes no sense is refused", "[maps]") {
    const Vector p = block_params(0.5, 2.94);
    const auto relay = relay_system();
    const auto autonomous = dieci_lopez_system();
    const auto stiction = any_system(models::Stiction{});
    const auto words = [](auto use) -> std::string {
        try {
            use();
        } catch (const std::invalid_argument& e) {
            return e.what();
        }
        return "";
    };
    CHECK_THAT(words([&] { TransitionMap(*relay, relay->defaults()); }),
               ContainsSubstring("dim = 3: expected 2"));
    CHECK_THAT(words([&] { TransitionMap(*autonomous, autonomous->defaults()); }),
               ContainsSubstring("period"));
    CHECK_THAT(words([&] { TransitionMap(*stiction, stiction->defaults()); }),
               ContainsSubstring("s_max = 1.33333: expected 1"));
    CHECK_THAT(words([&] { TransitionMap(*block(), p, {.max_periods = std::nan("")}); }),
               ContainsSubstring("max_periods = nan"));
    CHECK_THAT(words([&] { TransitionMap(*block(), p.head(3)); }), ContainsSubstring("p.size()"));
    CHECK_THAT(words([&] { strobe(*block(), 0, point(0, std::nan("")), p); }),
               ContainsSubstring("x[1] = nan"));
    CHECK_THAT(words([&] { strobe(*autonomous, 0, point(0, 0), autonomous->defaults()); }),
               ContainsSubstring("period"));
    CHECK_THAT(words([&] { section_map(*block(), {}, 0, point(0, 0), p, 0); }),
               ContainsSubstring("max_time = 0"));
    const TransitionMap map(*block(), p);
    CHECK_THAT(words([&] { map({0, 0.5}); }), ContainsSubstring("boundary = 0"));
    CHECK_THAT(words([&] { map_graph(map, 0); }), ContainsSubstring("iterate = 0"));
    CHECK_THAT(words([&] { map_graph(map, 1, {.samples = 7}); }), ContainsSubstring("samples = 7"));
}

TEST_CASE("map_graph: no fixed point is missed that 40,000 samples show", "[.long][maps]") {
    for (const double omega : {2.94, 2.9, 2.895, 2.893})
        for (const int iterate : {1, 2}) {
            const TransitionMap map(*block(), block_params(0.5, omega));
            const MapGraph graph = map_graph(map, iterate);
            CAPTURE(omega, iterate);
            const auto check = [&](int boundary, double low, double high, int n) {
                const auto roots = roots_on_grid(map, iterate, boundary, low, high, n);
                std::size_t inside = 0;
                for (const FixedPoint& f : graph.fixed_points)
                    inside += f.at.boundary == boundary && f.at.phase > low && f.at.phase < high;
                for (const auto& root : roots) {
                    const double a = root.first, b = root.second;
                    CAPTURE(boundary, a, b);
                    CHECK(std::any_of(graph.fixed_points.begin(), graph.fixed_points.end(),
                                      [&](const FixedPoint& f) {
                                          return f.at.boundary == boundary && f.at.phase >= a &&
                                                 f.at.phase <= b;
                                      }));
                }
                return std::pair(roots.size(), inside);
            };
            check(-1, 0, TransitionMap::turn, 10'000);
            check(+1, 0, TransitionMap::turn, 10'000);
            // where slopes of up to 1600 are too steep for the coarser grid, and a jump is 8e-6 off
            const auto [roots, inside] = check(-1, 3.43, 3.485, 20'000);
            CHECK(roots == inside);
        }
}

namespace {

/// A block on a belt on a bistable spring: at a phase up to three points end slides.
///   x'' = x - 0.3 x^3 - 0.1 x' + a cos(omega t) - mu sign(h),  h = x' - 0.5
struct Bistable {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"a", "mu", "omega"};
    static constexpr std::array<double, 3> defaults{0.25, 0.5, 1.1};
    template <Scalar S> static S force(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) {
        using elementary::cos;
        return x[0] - S(0.3) * x[0] * x[0] * x[0] - S(0.1) * x[1] + p[0] * cos(p[2] * t);
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return {x[1], force(t, x, p) + p[1]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return {x[1], force(t, x, p) - p[1]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const {
        return x[1] - S(0.5);
    }
    template <Scalar S> S period(const Vec<S, 3>& p) const {
        return S(2 * std::numbers::pi) / p[2];
    }
};

} // namespace

TEST_CASE("P_trans: a slide that ends on another branch of the exit curve has no image", "[maps]") {
    const auto system = any_system(Bistable{});
    const Vector p = system->defaults();
    const TransitionMap map(*system, p);
    int known = 0, elsewhere = 0;
    for (const int boundary : {-1, 1})
        for (int k = 0; k < 40; ++k) {
            const Transition at{boundary, TransitionMap::turn * k / 40};
            const auto start = map.exit_point(at);
            if (!start)
                continue;
            const Image image = map(at);
            // where the solution really goes: its next slide's end
            const double t0 = map.time_of(at.phase);
            const History run = system->run(t0, start->x, t0 + 50 * map.period(), p);
            const auto end = std::find_if(run.events.begin(), run.events.end(), [&](const auto& e) {
                return e.kind == EventKind::exit_sliding && e.t > t0 + 1e-9;
            });
            if (end == run.events.end() || !start->attracting)
                continue;
            const double phase =
                TransitionMap::wrapped(end->t / map.period() * TransitionMap::turn);
            const auto there = map.exit_point({end->after, phase});
            const bool on_curve = there && (there->x - end->x).norm() < 1e-6;
            CHECK(image.ok() == on_curve);
            known += on_curve;
            elsewhere += !on_curve;
            if (!image.ok())
                CHECK_THAT(image.message, ContainsSubstring("another branch of the exit curve"));
        }
    CHECK(known + elsewhere > 20);
    CHECK(elsewhere > 0);
}

TEST_CASE("map_graph: an evaluation that passes many modes counts as several", "[maps]") {
    // most solutions slip for ever, and turn round twice a period for the 50 periods of the wait
    const auto system = any_system(Undamped{});
    const TransitionMap map(*system, system->defaults());
    const MapGraph graph = map_graph(map, 1, {.max_evaluations = 1000});
    CHECK(graph.status == Status::max_steps);
    CHECK_THAT(graph.message, ContainsSubstring("max_evaluations"));
    const auto waits = std::count_if(graph.samples.begin(), graph.samples.end(), [](const auto& s) {
        return s.image.status == Status::escaped && s.image.word.size() >= 100;
    });
    CHECK(waits > 0);
    CHECK(graph.evaluations < 200);
}
