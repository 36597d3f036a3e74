// SPDX-License-Identifier: BSD-3-Clause
// Maps, periodic orbits and Lyapunov exponents of systems with several surfaces and with jumps.
#include "catch.hpp"

#include <filippov/continuation/branch.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/impacts.hpp>
#include <filippov/models/switches.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/geometry.hpp>
#include <filippov/orbits/lyapunov.hpp>
#include <filippov/orbits/maps.hpp>
#include <filippov/orbits/orbit.hpp>

#include <algorithm>
#include <cmath>
#include <set>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::shared_ptr<const AnySystem>& chain() {
    static const auto system = any_system(models::BeltChain<2>{});
    return system;
}
const std::shared_ptr<const AnySystem>& impact_belt() {
    static const auto system = any_system(models::ImpactBelt{});
    return system;
}
const std::shared_ptr<const AnySystem>& ball() {
    static const auto system = any_system(models::BouncingBall{});
    return system;
}

Vector vector(std::initializer_list<double> values) {
    Vector x(Eigen::Index(values.size()));
    std::copy(values.begin(), values.end(), x.begin());
    return x;
}
Vector belt_at(double V) {
    Vector p = chain()->defaults();
    p[0] = V;
    return p;
}
Orbit settled(double V) { return settle(*chain(), belt_at(V), vector({0.5, 0, -0.3, 0})); }

std::vector<double> sizes(const Eigen::VectorXcd& values) {
    std::vector<double> all;
    for (const auto& v : values)
        all.push_back(std::abs(v));
    std::sort(all.rbegin(), all.rend());
    return all;
}

} // namespace

TEST_CASE("orbit surfaces: codes of modes name their entries", "[orbit]") {
    std::set<std::string> seen;
    for (int code = -13; code <= 13; ++code) {
        const Mode<3> mode = mode_of<3>(code);
        CHECK(mode.code() == code);
        CHECK(slid_on(code, 3) == mode.sliding());
        for (int j = 0; j < 3; ++j)
            CHECK(mode_entry(code, j) == mode[j]);
        seen.insert(mode_text(code, 3));
    }
    CHECK(seen.size() == 27);
    CHECK(mode_text(Mode<3>{{-1, 0, 1}}.code(), 3) == "-0+");
}

TEST_CASE("orbit surfaces: chains of blocks have orbits, with multipliers by two routes",
          "[orbit]") {
    const double V = GENERATE(0.05, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0);
    const Orbit orbit = settled(V);
    INFO("V = " << V << ": " << orbit.message << ", word " << orbit.cycle.word.string());
    REQUIRE(orbit.status == Status::ok);
    CHECK(orbit.stable(false));
    // it closes, in the engine's own run; margin: its error over a period, times the slope
    const History turn = chain()->run(0, orbit.x_start, orbit.cycle.period, orbit.cycle.p);
    CHECK((turn.x - orbit.x_start).norm() < 1e-9);
    // shooting follows prescribed modes; the engine's derivatives go through its events
    const auto shot = sizes(Eigen::Map<const Eigen::VectorXcd>(orbit.multipliers.data(), 4));
    const auto varied = sizes(orbit.monodromy.eigenvalues());
    for (std::size_t k = 0; k < 4; ++k)
        CHECK(shot[k] == Approx(varied[k]).epsilon(1e-7).margin(1e-9));
    // one is 1, and one is 0 for each surface that is slid on at once
    CHECK(std::count(orbit.multipliers.begin(), orbit.multipliers.end(), 1.0) == 1);
    const std::string word = orbit.cycle.word.string();
    const int most = word.find("00") != std::string::npos ? 2 : 1;
    CHECK(std::count(orbit.multipliers.begin(), orbit.multipliers.end(), 0.0) == most);
}

TEST_CASE("orbit surfaces: a word names all surfaces and starts at one place", "[orbit]") {
    const Orbit orbit = settled(0.4);
    REQUIRE(orbit.status == Status::ok);
    CHECK(orbit.cycle.word.string() == "0- -- -0 --");
    // the same orbit from its own state
    const Orbit again = orbit_near(*chain(), orbit.cycle.p, 0, orbit.x_start, 1);
    REQUIRE(again.status == Status::ok);
    CHECK(again.cycle.word.string() == orbit.cycle.word.string());
    CHECK(again.cycle.period == Approx(orbit.cycle.period).epsilon(1e-11));
    // and from its nodes at a belt a little faster
    Cycle moved = orbit.cycle;
    moved.p[0] = 0.41;
    const Orbit next = solve_orbit(*chain(), moved);
    REQUIRE(next.status == Status::ok);
    CHECK(next.cycle.period != orbit.cycle.period);
    const History turn = chain()->run(0, next.x_start, next.cycle.period, next.cycle.p);
    CHECK((turn.x - next.x_start).norm() < 1e-10);
}

TEST_CASE("orbit surfaces: exponents are those of the multipliers", "[lyapunov]") {
    for (const double V : {0.2, 0.4, 0.7}) {
        INFO("V = " << V);
        const Orbit orbit = settled(V);
        REQUIRE(orbit.status == Status::ok);
        const double T = orbit.cycle.period;
        const Lyapunov l = lyapunov(*chain(), belt_at(V), orbit.x_start,
                                    {.transient = 10 * T, .window = 1000 * T, .stretch = T});
        REQUIRE(l.status == Status::ok);
        int finite = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            const double size = std::abs(orbit.multipliers[k]);
            if (size == 0) {
                CHECK(l.exponents[Eigen::Index(k)] == -std::numeric_limits<double>::infinity());
                continue;
            }
            ++finite;
            // errors fall as 1/window, which is 2000 and more
            CHECK(l.exponents[Eigen::Index(k)] == Approx(std::log(size) / T).margin(5e-4));
        }
        CHECK(finite >= 2);
    }
}

TEST_CASE("orbit surfaces: the strobe map of impacts and friction has its derivatives", "[maps]") {
    const AnySystem& system = *impact_belt();
    const Vector p = system.defaults();
    for (const double x : {-0.4, 0.1, 0.5}) {
        const Vector x0 = vector({x, 0.2});
        const Mapped m = strobe(system, 0.3, x0, p, 2, {{0, 5}, nullptr});
        REQUIRE(m.ok());
        REQUIRE_FALSE(m.singular);
        const double h = 1e-6;
        for (int k = 0; k < 2; ++k) {
            Vector by = Vector::Zero(2);
            by[k] = h;
            const Vector d =
                (strobe(system, 0.3, x0 + by, p, 2).x - strobe(system, 0.3, x0 - by, p, 2).x) /
                (2 * h);
            CHECK((d - m.slope.col(k).head(2)).norm() <= 1e-5 * (1 + d.norm()));
        }
        for (int k = 0; k < 2; ++k) {
            Vector by = Vector::Zero(6);
            by[k == 0 ? 0 : 5] = h;
            const Vector d =
                (strobe(system, 0.3, x0, p + by, 2).x - strobe(system, 0.3, x0, p - by, 2).x) /
                (2 * h);
            CHECK((d - m.param_slope.col(k).head(2)).norm() <= 1e-5 * (1 + d.norm()));
        }
        const Vector d =
            (strobe(system, 0.3 + h, x0, p, 2).x - strobe(system, 0.3 - h, x0, p, 2).x) / (2 * h);
        CHECK((d - m.slope.col(2).head(2)).norm() <= 1e-5 * (1 + d.norm()));
    }
}

TEST_CASE("orbit surfaces: section maps go to events of one surface", "[maps]") {
    const Orbit orbit = settled(0.4);
    REQUIRE(orbit.status == Status::ok);
    for (const int surface : {0, 1}) {
        const SectionOf section{EventKind::exit_sliding, -1, surface};
        const Mapped first = section_map(*chain(), section, 0, orbit.x_start, orbit.cycle.p, 100);
        REQUIRE(first.ok());
        const Mapped next = section_map(*chain(), section, first.t, first.x, orbit.cycle.p, 100);
        REQUIRE(next.ok());
        CHECK(next.t - first.t == Approx(orbit.cycle.period).epsilon(1e-10));
        CHECK((next.x - first.x).norm() < 1e-9);
        CHECK(next.slides == 2);
    }
    CHECK_THROWS_WITH(
        section_map(*chain(), {EventKind::cross, 2, 2}, 0, orbit.x_start, orbit.cycle.p, 100),
        ContainsSubstring("section.surface = 2"));
}

namespace {

/// A block on a belt, V = 0.3, whose friction is half as strong beyond x = 0.7; `belt` is the index
/// of the surface on which it sticks. A slide ends where the other surface is crossed.
struct Patch {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    int belt = 0;
    double push = 0.1; ///< negative damping

    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        const S strength = S(0.75) - S(0.25) * s[1 - belt];
        return {x[1], -x[0] + S(push) * x[1] - strength * s[belt]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        Vec<S, 2> r;
        r[belt] = x[1] - S(0.3);
        r[1 - belt] = x[0] - S(0.7);
        return r;
    }
};

} // namespace

TEST_CASE("orbit surfaces: nothing depends on the order of the surfaces", "[orbit]") {
    double period[2];
    for (const int belt : {0, 1}) {
        const auto system = any_system(Patch{belt});
        const Orbit orbit = settle(*system, Vector(0), vector({0.5, 0}));
        INFO("belt is surface " << belt << ": " << orbit.message);
        REQUIRE(orbit.status == Status::ok);
        CHECK(orbit.cycle.word.string() == (belt == 0 ? "0- -+ --" : "-0 +- --"));
        period[belt] = orbit.cycle.period;
        // the slide ends where the other surface is crossed: one event, seen of both
        for (const int surface : {0, 1}) {
            const EventKind kind = surface == belt ? EventKind::exit_sliding : EventKind::cross;
            const Mapped m = section_map(*system, {kind, surface == belt ? 2 : 1, surface}, 0,
                                         orbit.x_start, Vector(0), 20);
            REQUIRE(m.ok());
            CHECK(m.x[0] == Approx(0.7).epsilon(1e-12));
        }
    }
    CHECK(period[0] == Approx(period[1]).epsilon(1e-12));
}

TEST_CASE("orbit surfaces: what Newton finds must be a solution", "[orbit]") {
    // The orbit of this word ends near V = 0.412; the equations of the word have solutions beyond.
    const Orbit orbit = settled(0.4);
    REQUIRE(orbit.status == Status::ok);
    for (const double V : {0.42, 0.55}) {
        Cycle moved = orbit.cycle;
        moved.p[0] = V;
        const Orbit found = solve_orbit(*chain(), moved);
        INFO("V = " << V);
        CHECK(found.status == Status::not_converged);
        CHECK_THAT(found.message, ContainsSubstring("no solution"));
    }
    // a solution that spirals in for ever is no orbit either
    const auto spiral = any_system(Patch{0, -0.1});
    CHECK(settle(*spiral, Vector(0), vector({0.5, 0}), {.transient = 20}).status != Status::ok);
}

TEST_CASE("orbit surfaces: events of two surfaces at once are events of each", "[maps]") {
    const auto system = any_system(models::DieciLopez2{});
    const Vector x0 = vector({0.3, 0.21, 0.4});
    double t[2];
    for (const int surface : {0, 1}) {
        const Mapped m =
            section_map(*system, {EventKind::exit_sliding, -1, surface}, 0, x0, Vector(0), 50);
        REQUIRE(m.ok());
        t[surface] = m.t;
        CHECK(m.x[0] == Approx(1).epsilon(1e-9)); // both leave at x1 = 1
    }
    CHECK(t[0] == t[1]);
}

TEST_CASE("orbit surfaces: exponents say what they leave out, and what impacts forget",
          "[lyapunov]") {
    // each turn meets both surfaces at once, where the flow has no derivative
    const auto system = any_system(models::DieciLopez2{});
    const Lyapunov l = lyapunov(*system, Vector(0), vector({0.04, -0.01, -0.02}),
                                {.transient = 50, .window = 200});
    CHECK(l.status == Status::not_converged);
    CHECK(l.skipped > 0);
    CHECK_THAT(l.message, ContainsSubstring("have no derivative"));
    // an impact that takes all of the speed
    Vector p = impact_belt()->defaults();
    p << 0.6, 1.2, 0, 50, 0.5, 0;
    const Lyapunov plastic =
        lyapunov(*impact_belt(), p, vector({-1, 0}), {.transient = 50, .window = 100});
    REQUIRE(plastic.status == Status::ok);
    CHECK(std::isfinite(plastic.exponents[0]));
    CHECK(plastic.exponents[1] == -std::numeric_limits<double>::infinity());
}

TEST_CASE("orbit surfaces: two surfaces met at once make no word", "[orbit]") {
    // Two equal blocks move as one: every event is of both.
    Vector p = belt_at(0.4);
    p[4] = p[3];
    const Orbit orbit = settle(*chain(), p, vector({0.5, 0, 0.5, 0}));
    CHECK(orbit.status == Status::not_converged);
}

TEST_CASE("orbit surfaces: what is for one surface is refused for others", "[orbit]") {
    const Orbit orbit = settled(0.4);
    REQUIRE(orbit.status == Status::ok);
    BranchTracer tracer(*chain(), 0, 0.3, 0.5);
    CHECK_THROWS_WITH(tracer.trace(orbit.cycle), ContainsSubstring("surfaces = 2"));
    CHECK_THROWS_WITH(TransitionMap(*impact_belt(), impact_belt()->defaults()),
                      ContainsSubstring("surfaces = 2"));
    CHECK_THROWS_WITH(TransitionMap(*ball(), ball()->defaults()),
                      ContainsSubstring("one switching surface"));
    CHECK_THROWS_WITH(settle(*ball(), ball()->defaults(), vector({1, 0})),
                      ContainsSubstring("jumps"));
    CHECK_THROWS_WITH(settle(*impact_belt(), impact_belt()->defaults(), vector({0, 0})),
                      ContainsSubstring("jumps"));
}
