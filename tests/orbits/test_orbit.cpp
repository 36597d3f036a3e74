// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits by shooting on words, and their multipliers.

#include "catch.hpp"
#include "converter.hpp"
#include "systems.hpp"

#include <filippov/models/coulomb.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/orbit.hpp>

#include <cmath>

using namespace filippov;

namespace {

Vector point(std::initializer_list<double> values) {
    Vector x(Eigen::Index(values.size()));
    std::copy(values.begin(), values.end(), x.begin());
    return x;
}
/// The same orbit by plain simulation: it returns to its start.
void check_returns(const AnySystem& system, const Orbit& orbit, double margin) {
    const History run =
        system.run(orbit.t_start, orbit.x_start, orbit.t_start + orbit.cycle.period, orbit.cycle.p);
    REQUIRE(run.status == Status::ok);
    CHECK((run.x - orbit.x_start).norm() <= margin);
}
/// Non-zero eigenvalues of the monodromy matrix are the multipliers: two different products.
void check_multipliers(const Orbit& orbit, double margin) {
    const Eigen::VectorXcd eigenvalues = orbit.monodromy.eigenvalues();
    std::vector<std::complex<double>> sorted(eigenvalues.begin(), eigenvalues.end());
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        return std::abs(a) != std::abs(b) ? std::abs(a) > std::abs(b) : a.imag() > b.imag();
    });
    REQUIRE(sorted.size() == orbit.multipliers.size());
    for (std::size_t k = 0; k < sorted.size(); ++k) {
        CAPTURE(k, sorted[k], orbit.multipliers[k]);
        CHECK(std::abs(sorted[k] - orbit.multipliers[k]) <= margin);
    }
}

/// Turns without a period; the fields have a corner at the origin, where they are not zero.
struct Corner {
    static constexpr int dim = 2;
    template <Scalar S> using X = State<Corner, S>;
    template <Scalar S> X<S> f1(const S&, const X<S>& x, const Params<Corner, S>&) const {
        using std::sqrt;
        return {x[1] + S(1), sqrt(x[0] * x[0] + x[1] * x[1]) - x[0]};
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const Params<Corner, S>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const X<S>& x, const Params<Corner, S>&) const {
        return x[0] + S(3);
    }
};

/// A buck converter: v is compared with a sawtooth that jumps at the end of a period; or, where
/// `smooth` is 1, with a sine.
struct Sawtooth : Converter<2> {
    static constexpr std::array<std::string_view, 2> params{"E", "smooth"};
    static constexpr std::array<double, 2> defaults{22, 0};
    template <Scalar S>
    S h(const S& t, const State<Sawtooth, S>& x, const Params<Sawtooth, S>& p) const {
        using std::atan, std::tan, std::sin;
        const S phase = t * S(std::acos(-1.0) / 0.4);
        const S jumps = S(0.5) + atan(tan(phase - S(std::acos(0.0)))) / S(std::acos(-1.0));
        const S ramp = p[1] * (S(0.5) + S(0.5) * sin(S(2) * phase)) + (S(1) - p[1]) * jumps;
        return S(3.8) + S(4.4) * ramp - S(8.4) * (x[0] - S(11.3));
    }
};

} // namespace

TEST_CASE("orbit: words of the chapter's orbits", "[orbit]") {
    const auto system = oscillator_system();
    struct Case {
        double A, omega;
        const char* word;
    };
    // figures 4.9, 4.10, 4.12: points 1 to 5
    for (const Case& c : {Case{5, 1.6, "-+"},
                          {5, 1.72, "0-+"},
                          {5, 2.5, "0-+"},
                          {5, 2.8, "0-"},
                          {4.9, 2.4, "0-+"},
                          {4.9, 2.7, "0-"},
                          {4.4, 1.6, "0-+"},
                          {4.4, 1.8, "0-0+"},
                          {4.4, 2.0, "0-"}}) {
        CAPTURE(c.A, c.omega);
        const Orbit orbit = settle(*system, params_at(*system, c.A, c.omega), point({0, 0}));
        REQUIRE(orbit.status == Status::ok);
        CHECK(orbit.cycle.word.string() == c.word);
        CHECK(orbit.cycle.turns == 1);
        CHECK(orbit.stable(true));
        check_returns(*system, orbit, 1e-10);
        check_multipliers(orbit, 1e-10);
        if (orbit.cycle.word.string().find('0') != std::string::npos)
            CHECK(orbit.multipliers.back() == 0.0); // exactly
    }
}

TEST_CASE("orbit: the three period-one orbits of figure 4.16", "[orbit]") {
    const auto system = oscillator_system();
    const Vector p = params_at(*system, 3.6, 1.067);
    const Orbit a = orbit_near(*system, p, 0, point({-0.685, 3.01}), 1);
    const Orbit c = orbit_near(*system, p, 0, point({-0.445, 1.27}), 1);
    // the printed start lies beside the surface, the orbit on it
    const Orbit b = orbit_near(*system, p, 0, point({-0.295, 0.99}), 1);
    for (const Orbit* o : {&a, &b, &c}) {
        REQUIRE(o->status == Status::ok);
        CHECK(o->cycle.turns == 1);
        check_multipliers(*o, 1e-10);
    }
    // the printed starts are read off a picture: two digits
    CHECK(std::abs(a.x_start[0] + 0.685) < 0.02);
    CHECK(std::abs(a.x_start[1] - 3.01) < 0.02);
    CHECK(std::abs(b.x_start[0] + 0.295) < 0.02);
    CHECK(std::abs(b.x_start[1] - 0.99) < 0.02);
    CHECK(std::abs(c.x_start[0] + 0.445) < 0.02);
    CHECK(std::abs(c.x_start[1] - 1.27) < 0.02);
    CHECK(a.stable(true));
    CHECK(b.stable(true));
    CHECK_FALSE(c.stable(true));
    check_returns(*system, a, 1e-10);
    check_returns(*system, b, 1e-10);
    check_returns(*system, c, 1e-10); // unstable, but one period grows errors by 2.1 only
}

TEST_CASE("orbit: methods and tolerances agree", "[orbit]") {
    const auto exact = oscillator_system({.rtol = 1e-13, .atol = 1e-14});
    const auto other = oscillator_system_5({.rtol = 1e-11, .atol = 1e-12});
    const Vector p = params_at(*exact, 3.6, 1.067);
    const Orbit a = orbit_near(*exact, p, 0, point({-0.445, 1.27}), 1);
    const Orbit b = orbit_near(*other, p, 0, point({-0.445, 1.27}), 1);
    REQUIRE(a.status == Status::ok);
    REQUIRE(b.status == Status::ok);
    CHECK((a.x_start - b.x_start).norm() < 1e-9);
    CHECK(std::abs(a.multipliers[0] - b.multipliers[0]) < 1e-8);
}

TEST_CASE("orbit: an orbit without events", "[orbit]") {
    // far below the belt's speed with friction that only brakes: slip for ever
    const auto system = oscillator_system();
    Vector p = params_at(*system, 0.5, 3.0);
    p[5] = 50; // V
    p[7] = 0;  // friction alpha + beta + eta r^2, which falls with v: damping of 2 g eta V
    const Orbit orbit = settle(*system, p, point({0, 0}), {.transient = 100});
    REQUIRE(orbit.status == Status::ok);
    CHECK(orbit.cycle.word.string() == "-");
    check_returns(*system, orbit, 1e-9);
    check_multipliers(orbit, 1e-10);
    CHECK(orbit.stable(true));
}

TEST_CASE("orbit: limit cycle of Dieci and Lopez (P4)", "[orbit]") {
    const auto system = dieci_lopez_system();
    const Orbit orbit = settle(*system, system->defaults(), point({0, 0}));
    REQUIRE(orbit.status == Status::ok);
    CHECK(orbit.cycle.word.string() == "0-");
    CHECK(orbit.cycle.period == Approx(9.230770458083).epsilon(1e-12));
    // planar, with a slide: 1 along the orbit, 0 across it
    CHECK(orbit.multipliers[0] == 1.0);
    CHECK(orbit.multipliers[1] == 0.0);
    check_multipliers(orbit, 1e-11);
    CHECK(orbit.stable(false));
}

TEST_CASE("orbit: limit cycles of relay feedback (P6, P7)", "[orbit]") {
    const auto system = relay_system();
    struct Case {
        Vector p;
        double period;
        std::size_t slides;
    };
    const auto variant = [](double zeta, double omega) {
        return point({zeta, omega, 1, 1, -2, 1});
    };
    for (const Case& c :
         {Case{variant(1, 1), 8.8607064541, 2}, {variant(0.05, 8), 5.6077496932, 4}}) {
        const Orbit orbit = settle(*system, c.p, point({0, 0.5, 0}), {.transient = 100});
        REQUIRE(orbit.status == Status::ok);
        CHECK(orbit.cycle.period == Approx(c.period).epsilon(1e-10));
        const std::string word = orbit.cycle.word.string();
        CHECK(std::size_t(std::count(word.begin(), word.end(), '0')) == c.slides);
        CHECK(orbit.multipliers.back() == 0.0);
        check_multipliers(orbit, 1e-9);
        CHECK(orbit.stable(false));
        // the sign of x may be turned: half a period later the orbit is its own mirror image
        const History half =
            system->run(orbit.t_start, orbit.x_start, orbit.t_start + orbit.cycle.period / 2, c.p);
        CHECK((half.x + orbit.x_start).norm() < 1e-8);
    }
    // P6: the slides lie at the times of the table
    const Orbit many =
        settle(*system, system->defaults(), point({0, -0.001, -0.02}), {.transient = 100});
    REQUIRE(many.status == Status::ok);
    check_multipliers(many, 1e-9);
}

TEST_CASE("orbit: a search that finds none says why", "[orbit]") {
    const auto system = oscillator_system();
    // long cycles and chaos below the grazing-sliding bifurcation
    const Orbit none = settle(*system, params_at(*system, 0.5, 2.87), point({0, 0}),
                              {.transient = 50, .max_turns = 2});
    CHECK(none.status == Status::not_converged);
    CHECK_FALSE(none.message.empty());
    CHECK_THROWS_AS(
        orbit_near(*system, params_at(*system, 0.5, 2.94), 0, point({0, std::nan("")}), 1),
        std::invalid_argument);
}

TEST_CASE("orbit: a caller who asks to stop is heard within an arc", "[orbit]") {
    const Vector p = params_at(*oscillator_system(), 0.5, 2.94);
    bool found = false;
    for (int patience = 0; patience < 4000 && !found; patience += 1 + patience / 8) {
        int asked = 0;
        const auto system = oscillator_system({.interrupted = [&] { return ++asked > patience; }});
        const Orbit orbit = settle(*system, p, point({0, 0}), {.transient = 100, .max_turns = 4});
        found = orbit.status == Status::ok;
        if (!found && orbit.status != Status::not_converged) {
            CHECK(orbit.status == Status::interrupted);
            CHECK_FALSE(orbit.message.empty());
        }
        CHECK(asked < patience + 60); // each arc that is still tried asks once and ends
    }
    CHECK(found);
}

TEST_CASE("orbit: beside a flip, the stable one, and once", "[orbit]") {
    const auto system = oscillator_system();
    const double flip = 0.475724531605; // a branch has it; beyond it the orbit's period is doubled
    for (const double beyond : {-1e-3, -1e-5, -1e-6, 1e-6, 1e-5, 1e-4}) {
        CAPTURE(beyond);
        const Orbit orbit =
            settle(*system, params_at(*system, 4.1171, flip + beyond), point({0, 0}));
        REQUIRE(orbit.status == Status::ok);
        CHECK(orbit.stable(true));
        CHECK(orbit.cycle.turns == (beyond < 0 ? 1 : 2));
        CHECK(orbit.cycle.word.string() == (beyond < 0 ? "0-0+" : "0-0+0-0+"));
    }
    // from the orbit that has lost its stability: it is left in the end
    Cycle cycle = settle(*system, params_at(*system, 4.1171, flip - 1e-5), point({0, 0})).cycle;
    const double beyond = flip + 1e-4, stretched = (flip - 1e-5) / beyond;
    for (double& t : cycle.t)
        t *= stretched;
    cycle.period *= stretched;
    cycle.p[1] = beyond;
    const Orbit lost = solve_orbit(*system, cycle);
    REQUIRE(lost.status == Status::ok);
    CHECK_FALSE(lost.stable(true));
    const Orbit found = settle(*system, cycle.p, lost.x_start, {.transient = 20});
    REQUIRE(found.status == Status::ok);
    CHECK(found.stable(true));
}

TEST_CASE("orbit: a derivative that is no number is no dependence on time", "[orbit]") {
    const auto system = any_system(Corner{});
    const Vector none;
    CHECK(std::isnan(system->rate(1, 0, Vector::Zero(2), none, {}).slope(1, 2)));
    CHECK_FALSE(depends_on_time(*system, 0.1, Vector::Zero(2), none));
    CHECK_FALSE(depends_on_time(*system, 0.1, point({1, 2}), none));
    const auto forced = oscillator_system();
    CHECK(depends_on_time(*forced, 0.1, Vector::Zero(2), forced->defaults()));
}

TEST_CASE("any_system: counts all that its runs did", "[orbit]") {
    const auto system = oscillator_system();
    const Counters once = system->run(0, Vector::Zero(2), 20, system->defaults()).counters;
    CHECK(once.events > 0);
    CHECK(system->counters().events == once.events);
    system->run(0, Vector::Zero(2), 20, system->defaults());
    CHECK(system->counters().steps == 2 * once.steps);
    CHECK(system->counters().landings == 2 * once.landings);
}

TEST_CASE("floquet: of a map that is no number no multiplier is one", "[orbit]") {
    for (const int n : {1, 2, 3, 5}) {
        Matrix map = Matrix::Identity(n, n) / 2;
        for (const auto& m : detail::eigenvalues_of(map))
            CHECK(m == 0.5);
        map(n - 1, 0) = std::nan("");
        for (const auto& m : detail::eigenvalues_of(map))
            CHECK(std::isnan(m.real()));
    }
    const auto system = oscillator_system();
    Matrix map = Matrix::Identity(2, 2) / 2;
    CHECK(is_stable(detail::sorted_multipliers(*system, map), true));
    map(0, 1) = std::nan("");
    CHECK_FALSE(is_stable(detail::sorted_multipliers(*system, map), true));
}

TEST_CASE("orbit: with static friction slides end at s_max", "[orbit]") {
    const auto system = any_system(models::Stiction{});
    for (const auto& [A, omega] : {std::pair{2.0, 1.2}, {4.0, 0.8}}) {
        CAPTURE(A, omega);
        const Orbit orbit = settle(*system, params_at(*system, A, omega), point({0, 0}));
        REQUIRE(orbit.status == Status::ok);
        const History run = system->run(orbit.t_start, orbit.x_start,
                                        orbit.t_start + orbit.cycle.period, orbit.cycle.p);
        CHECK((run.x - orbit.x_start).norm() < 1e-9);
        bool left = false;
        for (const Happening& e : run.events)
            if (e.kind == EventKind::exit_sliding) {
                // (A cos(omega t) - y)/(weight mu_0) = +-mu_s/mu_0
                const double s = (A * std::cos(omega * e.t) - e.x[0]) / 3;
                CHECK(std::abs(s) == Approx(4.0 / 3).epsilon(1e-9));
                left = true;
            }
        CHECK(left);
        // the monodromy matrix, by runs of neighbours on the surface
        if (run.mode == 0) {
            const double d = 1e-5;
            const auto end = [&](double off) {
                return system
                    ->run(orbit.t_start, orbit.x_start + point({off, 0}),
                          orbit.t_start + orbit.cycle.period, orbit.cycle.p)
                    .x[0];
            };
            CHECK(orbit.monodromy(0, 0) == Approx((end(d) - end(-d)) / (2 * d)).epsilon(1e-6));
        }
    }
}

TEST_CASE("orbit: a surface that jumps in time is named, and only where it is passed so",
          "[orbit]") {
    const auto system = any_system(Sawtooth{});
    Vector p = system->defaults();
    const std::string why = "the surface jumps in time";
    const Vector x = point({12, 0.5}), at_rest = system->run(0, x, 400, p).x;
    // a stable fixed point of plain runs
    CHECK((system->run(0, at_rest, 0.4, p).x - at_rest).norm() < 1e-8);
    for (const Orbit& orbit :
         {settle(*system, p, x), orbit_near(*system, p, 0, at_rest, 1),
          orbit_near(*system, p, 0, at_rest, 2), orbit_near(*system, p, 0.1, at_rest, 1)}) {
        CHECK(orbit.status == Status::not_converged);
        CHECK(orbit.message.substr(0, why.size()) == why);
    }
    // v stays below what the sawtooth asks for: it jumps, and is not passed
    p[0] = 5;
    const Orbit off = settle(*system, p, x);
    CHECK(off.status == Status::ok);
    // nor is a steep surface taken for one that jumps
    p = system->defaults();
    p[1] = 1;
    const Orbit smooth = settle(*system, p, x);
    CHECK(smooth.message.substr(0, why.size()) != why);
}
