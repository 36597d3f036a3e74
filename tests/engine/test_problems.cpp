// SPDX-License-Identifier: BSD-3-Clause
// Problems with known answers, by both methods. Margins without a reason of their own are the last
// printed digit of a table value, or a few times the global error that the tolerance leaves.
#include "run.hpp"

#include <filippov/models/belt.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/unit_circle.hpp>

#include <cmath>
#include <functional>
#include <numbers>

using namespace filippov;
using enum EventKind;

namespace {

constexpr double pi = std::numbers::pi;

/// Tight: a hundred times the rounding of a double.
constexpr double tight = 2e-14;

} // namespace

TEMPLATE_TEST_CASE("problems: P1, Coulomb friction stops the swing after four half circles",
                   "[problems]", DormandPrince5, DormandPrince8) {
    const auto r = run<TestType>(models::Coulomb{}, default_params<models::Coulomb>(),
                                 Vec<double, 2>(3, 0), 0, 20, tolerance<2>(tight));
    CHECK(r.result.status == Status::ok);
    // every half swing is exact but for the method's error, some ten steps of 1e-14 each
    check_events(r.events, {{cross, pi}, {cross, 2 * pi}, {cross, 3 * pi}, {enter_sliding, 4 * pi}},
                 1e-11);
    const double reversal[] = {-2.2, 1.4, -0.6, -0.2};
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(r.events[i + 1].x_right[0] == Approx(reversal[i]).epsilon(0).margin(1e-12));
        CHECK(std::abs(r.events[i + 1].x_right[1]) < 1e-16); // on the surface to rounding of x
    }
    CHECK(r.result.t == 20);
    CHECK(r.result.mode[0] == 0);
    CHECK(r.result.x[0] == r.events[4].x_right[0]); // at rest nothing moves at all
    CHECK(r.result.x[1] == 0);
}

TEMPLATE_TEST_CASE("problems: P2, a spiral crosses the unit circle at t = 1", "[problems]",
                   DormandPrince5, DormandPrince8) {
    const Vec<double, 2> x0(std::exp(-1.0), 0);
    const auto r = run<TestType>(models::UnitCircle{}, default_params<models::UnitCircle>(), x0, 0,
                                 pi / 2, tolerance<2>(tight));
    CHECK(r.result.status == Status::ok);
    // relative errors of 1e-14 a step grow like e^t; the crossing time inherits the radius's error
    check_events(r.events, {{cross, 1.0}}, 1e-12);
    CHECK(std::abs(r.events[1].x_right.norm() - 1) < 1e-15); // on the curved surface to rounding
    CHECK(r.result.x[0] == Approx(-1.5974603774507).epsilon(0).margin(2e-12));
    CHECK(r.result.x[1] == Approx(+0.7614936206060).epsilon(0).margin(2e-12));
}

TEMPLATE_TEST_CASE("problems: P3, friction on a belt of varying speed crosses and slides as known",
                   "[problems]", DormandPrince5, DormandPrince8) {
    const auto r = run<TestType>(models::VaryingBelt{}, default_params<models::VaryingBelt>(),
                                 Vec<double, 2>(3, 0), 0, 30, tolerance<2>(tight));
    CHECK(r.result.status == Status::ok);
    check_events(r.events,
                 {{cross, 7.6055699647},
                  {enter_sliding, 9.4833785789},
                  {exit_sliding, 9.7652587545},
                  {cross, 14.8051056891},
                  {cross, 17.4589396439},
                  {enter_sliding, 26.1316818246},
                  {exit_sliding, 27.2911568935}},
                 1e-10);
}

TEMPLATE_TEST_CASE(
    "problems: P4, Dieci and Lopez's stick-slip reaches its limit cycle at the first slide",
    "[problems]", DormandPrince5, DormandPrince8) {
    const auto r = run<TestType>(models::DieciLopez{}, default_params<models::DieciLopez>(),
                                 Vec<double, 2>(0, 0), 0, 30, tolerance<2>(tight));
    CHECK(r.result.status == Status::ok);
    const double hit = 0.221654814176, exit = 5.113776136063, cycle = 9.230770458083;
    REQUIRE(r.events.size() == 9);
    CHECK(r.events[1].kind == enter_sliding);
    CHECK(r.events[1].t == Approx(hit).epsilon(0).margin(1e-12));
    CHECK(r.events[1].x_right[0] == Approx(0.021575735623).epsilon(0).margin(1e-12));
    const auto exits = r.times(exit_sliding);
    REQUIRE(exits.size() == 3);
    CHECK(exits[0] == Approx(exit).epsilon(0).margin(2e-12));
    // an exit is one point, so the orbit is periodic from the first one on
    CHECK(exits[1] - exits[0] == Approx(cycle).epsilon(0).margin(2e-12));
    CHECK(exits[2] - exits[1] == Approx(cycle).epsilon(0).margin(2e-12));
    for (const auto& e : r.events)
        if (e.kind == exit_sliding) {
            // Exact: below, L1 = -x1 + 1/(1.2 - 0.2) vanishes at x1 = 1. To a few ulp: the landing
            // is on s = -1.
            CHECK(e.x_right[0] == Approx(1).epsilon(0).margin(1e-14));
            CHECK(e.x_right[1] == 0.2);
            CHECK(e.s == Approx(-1).epsilon(0).margin(1e-14));
        }
}

TEMPLATE_TEST_CASE(
    "problems: P5, Coulomb friction under a sine force turns, turns, sticks and slips",
    "[problems]", DormandPrince5, DormandPrince8) {
    const Vec<double, 3> p(0.4, 1, 0.5);
    const auto r =
        run<TestType>(models::Coulomb{}, p, Vec<double, 2>(1, 2), 0, 7, tolerance<2>(tight));
    CHECK(r.result.status == Status::ok);
    check_events(r.events,
                 {{cross, 1.062846232871},
                  {cross, 3.913987190289},
                  {enter_sliding, 4.415348156986},
                  {exit_sliding, 6.140971435234}},
                 2e-12);
    CHECK(r.events[1].x_right[0] == Approx(2.121614175528).epsilon(0).margin(1e-12));
    CHECK(r.events[3].x_right[0] == Approx(0.471047029348).epsilon(0).margin(1e-12));
    CHECK(r.events[4].x_right[0] == r.events[3].x_right[0]);
}

// --- P6 and P7: linear pieces, so that power series in extended precision are an oracle
// -----------

namespace {

/// Relay feedback x' = A x + B u, u = -sign x1 or the equivalent control, solved by power series.
struct LinearRelay {
    using R = long double;
    using V = std::array<R, 3>;
    R zeta, omega, lambda;
    V b;

    /// A x + B u; on the surface u = -x2/b1 keeps x1 = 0.
    V field(const V& x, int mode) const {
        const R u = mode == 0 ? -x[1] / b[0] : -R(mode);
        const R zw = 2 * zeta * omega, w2 = omega * omega;
        return {mode == 0 ? R(0) : x[1] - (zw + lambda) * x[0] + b[0] * u,
                x[2] - (zw * lambda + w2) * x[0] + b[1] * u, b[2] * u - lambda * w2 * x[0]};
    }
    /// x(dt), by the series of an affine field: x_(k+1) = (field(x_k) - field(0)) dt / (k + 1) from
    /// x_1 = field(x_0) dt.
    V flow(const V& x, int mode, R dt) const {
        V sum = x, term = field(x, mode);
        const V zero = field({0, 0, 0}, mode);
        for (auto& c : term)
            c *= dt;
        for (int k = 2; k < 60; ++k) {
            for (std::size_t i = 0; i < 3; ++i)
                sum[i] += term[i];
            term = field(term, mode);
            for (std::size_t i = 0; i < 3; ++i)
                term[i] = (term[i] - zero[i]) * dt / R(k);
        }
        return sum;
    }
    /// Times at which the mode changes, and the states there.
    struct Change {
        R t;
        int mode; // after it
        V x;
    };
    /// From a start on the surface in the sliding region, up to the window in which t_end is.
    std::vector<Change> changes(V x, R t_end) const {
        const R window = R(0.1L) / omega; // shorter than any visit to a side
        std::vector<Change> list;
        int mode = 0;
        for (R t = 0; t < t_end;) {
            const auto margin = [&](const V& y) {
                return mode == 0 ? R(1) - std::abs(y[1] / b[0]) : R(mode) * y[0];
            };
            const V next = flow(x, mode, window);
            if (margin(next) > 0) {
                x = next;
                t += window;
                continue;
            }
            R low = 0, high = window;
            for (int k = 0; k < 80; ++k) {
                const R middle = (low + high) / 2;
                (margin(flow(x, mode, middle)) > 0 ? low : high) = middle;
            }
            x = flow(x, mode, high);
            t += high;
            if (mode == 0) {
                mode = x[1] / b[0] > 0 ? 1 : -1; // x1' = x2 + b1 u at u = -+1
            } else {
                x[0] = 0;
                mode = std::abs(x[1]) < b[0] ? 0 : -mode;
            }
            list.push_back({t, mode, x});
        }
        return list;
    }
};

} // namespace

TEMPLATE_TEST_CASE("problems: P6, the relay starts sliding and leaves and enters as known",
                   "[problems]", DormandPrince5, DormandPrince8) {
    const Vec<double, 3> x0(0, -0.001, -0.02);
    const auto r = run<TestType>(models::Relay{}, default_params<models::Relay>(), x0, 0, 6,
                                 tolerance<3>(tight));
    CHECK(r.result.status == Status::ok);
    CHECK(r.events[0].mode_after[0] == 0);
    REQUIRE(r.events.size() > 5);
    const Expected table[] = {{exit_sliding, 2.812403376},
                              {enter_sliding, 3.041621639},
                              {exit_sliding, 3.068976833},
                              {enter_sliding, 3.289499164}};
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(r.events[i + 1].kind == table[i].kind);
        CHECK(r.events[i + 1].t ==
              Approx(table[i].t).epsilon(0).margin(5.1e-10)); // nine printed digits
    }
    const LinearRelay oracle{static_cast<long double>(0.05), 25, 1, {1, -2, 1}};
    const auto changes =
        oracle.changes({0, static_cast<long double>(-0.001), static_cast<long double>(-0.02)}, 6);
    REQUIRE(r.events.size() == changes.size() + 2);
    for (std::size_t i = 0; i < changes.size(); ++i) {
        CHECK(r.events[i + 1].mode_after[0] == changes[i].mode);
        // in a slide errors grow by e^t (a zero of B in the right half plane), over six time units
        CHECK(r.events[i + 1].t ==
              Approx(static_cast<double>(changes[i].t)).epsilon(0).margin(1e-10));
    }
}

TEMPLATE_TEST_CASE("problems: P7, relay limit cycles have the known periods and numbers of slides",
                   "[problems]", DormandPrince5, DormandPrince8) {
    struct Case {
        double zeta, omega, period;
        std::size_t slides;
    };
    const Case c = GENERATE(Case{1, 1, 8.8607064541, 2}, Case{0.05, 8, 5.6077496932, 4});
    Vec<double, 6> p;
    p << c.zeta, c.omega, 1, 1, -2, 1;
    const auto r =
        run<TestType>(models::Relay{}, p, Vec<double, 3>(0, 0.5, 0), 0, 150, tolerance<3>(1e-12));
    CHECK(r.result.status == Status::ok);
    std::vector<std::size_t> exits;
    for (std::size_t i = 0; i < r.events.size(); ++i)
        if (r.events[i].kind == exit_sliding)
            exits.push_back(i);
    REQUIRE(exits.size() > 3 * c.slides);
    const auto& last = r.events[exits.back()];
    // The period is the first return of the last exit's state, and has this many slides in it.
    std::size_t slides = 0;
    for (std::size_t k = exits.size() - 1; k-- > 0 && slides == 0;)
        if ((r.events[exits[k]].x_right - last.x_right).norm() < 1e-6)
            slides = exits.size() - 1 - k;
    CHECK(slides == c.slides);
    // ten printed digits
    CHECK(last.t - r.events[exits[exits.size() - 1 - c.slides]].t ==
          Approx(c.period).epsilon(0).margin(1e-10));
}

TEMPLATE_TEST_CASE("problems: P7, the undamped relay does not come back to where it was",
                   "[problems]", DormandPrince5, DormandPrince8) {
    Vec<double, 6> p;
    p << -0.07, 10, 0.05, 1, -2, 1;
    const auto r =
        run<TestType>(models::Relay{}, p, Vec<double, 3>(0, 0.5, 0), 0, 200, tolerance<3>(1e-10));
    CHECK(r.result.status == Status::ok);
    std::vector<Vec<double, 3>> exits;
    for (const auto& e : r.events)
        if (e.kind == exit_sliding && e.t > 100)
            exits.push_back(e.x_right);
    REQUIRE(exits.size() > 20);
    double nearest = 1;
    for (std::size_t k = 0; k + 1 < exits.size(); ++k)
        nearest = std::min(nearest, (exits[k] - exits.back()).norm());
    CHECK(nearest > 1e-6); // the limit cycles above return to 1e-9
}

TEMPLATE_TEST_CASE(
    "problems: P8, a stiff relay meets the surface at pi - arctan 1000 and slides at zero",
    "[problems]", DormandPrince5, DormandPrince8) {
    const auto r = run<TestType>(models::StiffRelay{}, default_params<models::StiffRelay>(),
                                 Vec<double, 1>(1), 0, 3, tolerance<1>(1e-12));
    CHECK(r.result.status == Status::ok);
    // x follows cos t to the tolerance, and x' = -1 where it meets the surface
    check_events(r.events, {{enter_sliding, pi - std::atan(1000.0)}}, 1e-11);
    CHECK(r.result.mode[0] == 0);
    CHECK(r.result.x[0] == 0);
    CHECK(r.result.t == 3);
    // The slide is not stiff: it takes a few steps that grow tenfold (twofold, at 8th order) from
    // the last stiff one.
    const auto hit = run<TestType>(models::StiffRelay{}, default_params<models::StiffRelay>(),
                                   Vec<double, 1>(1), 0, 1.6, tolerance<1>(1e-12));
    CHECK(hit.result.mode[0] == 0);
    CHECK(r.result.counters.steps - hit.result.counters.steps < 20);
}

TEMPLATE_TEST_CASE(
    "problems: P9, the quartet crosses, slides, leaves, and says that it cannot know", "[problems]",
    DormandPrince5, DormandPrince8) {
    const models::Quartet sys;
    const auto settings = tolerance<1>(1e-12);
    SECTION("crosses at 1/3") {
        const auto r =
            run<TestType>(sys, Vec<double, 3>(1, 2, 0), Vec<double, 1>(-1), 0, 1, settings);
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{cross, 1.0 / 3}}, 1e-15); // constant fields: rounding only
        CHECK(r.result.x[0] == Approx(2.0 / 3).epsilon(1e-15));
    }
    SECTION("slides from the start") {
        const auto r =
            run<TestType>(sys, Vec<double, 3>(1, 0, 0), Vec<double, 1>(0), 0, 1, settings);
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {}, 0);
        CHECK(r.events[0].mode_after[0] == 0);
        CHECK(r.result.x[0] == 0);
    }
    SECTION("falls onto the surface from either side and stays") {
        const double start = GENERATE(-0.7, 0.7);
        const auto r =
            run<TestType>(sys, Vec<double, 3>(1, 0, 0), Vec<double, 1>(start), 0, 2, settings);
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{enter_sliding, 0.7}}, 1e-15); // rounding of the steps' sum
        CHECK(r.result.x[0] == 0);
    }
    SECTION("leaves at t = 1") {
        const auto r =
            run<TestType>(sys, Vec<double, 3>(1, 0, 1), Vec<double, 1>(0), 0, 2, settings);
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{exit_sliding, 1.0}}, 1e-15); // x' = t - 1 is linear: rounding only
        CHECK(r.result.x[0] == Approx(0.5).epsilon(1e-15));
    }
    SECTION("is not unique, and stops before it moves") {
        const auto r =
            run<TestType>(sys, Vec<double, 3>(-1, 0, 0), Vec<double, 1>(0), 0, 1, settings);
        CHECK(r.result.status == Status::ambiguous);
        CHECK(r.result.t == 0);
        CHECK(r.result.message().find("not unique") != std::string::npos);
        CHECK(r.result.message().find("repulsive") != std::string::npos);
    }
}

// --- P16: what a user types ----------------------------------------------------------------------

namespace {

struct DampedOscillator {
    static constexpr int dim = 2;
    template <Scalar S> S friction(const S& r) const {
        return S(3) / (S(1) + S(1.42) * r) + S(1) + S(0.1) * r * r;
    }
    template <Scalar S> Vec<S, 2> slip(const S& t, const Vec<S, 2>& x, const S& force) const {
        using std::cos;
        return {x[1], S(0.2) * cos(S(1.067) * t) - x[0] - S(0.2) * x[1] + force};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return slip(t, x, friction(S(S(1) - x[1])));
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return slip(t, x, S(-friction(S(x[1] - S(1)))));
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x[1] - S(1);
    }
};

/// The same by hand: fourth-order steps of 1/2000 in extended precision, bisection on the step, and
/// a stick x' = 1.
std::vector<Expected> damped_oscillator_by_hand(long double t_end, std::array<long double, 2>& x) {
    using R = long double;
    using V = std::array<R, 2>;
    const auto mu = [](R r) { return 0.3L / (1 + 1.42L * r) + 0.1L + 0.01L * r * r; };
    const auto pull = [](R t, const V& y) {
        return 0.2L * std::cos(1.067L * t) - y[0] - 0.2L * y[1];
    };
    int side = x[1] > 1 ? 1 : -1;
    const auto f = [&](R t, const V& y) -> V {
        return {y[1], pull(t, y) - R(side) * 10 * mu(R(side) * (y[1] - 1))};
    };
    const auto step = [&](R t, const V& y, R d) -> V {
        if (side == 0)
            return {y[0] + d, 1};
        const auto at = [&](const V& k, R a) -> V { return {y[0] + a * k[0], y[1] + a * k[1]}; };
        const V k1 = f(t, y), k2 = f(t + d / 2, at(k1, d / 2)), k3 = f(t + d / 2, at(k2, d / 2)),
                k4 = f(t + d, at(k3, d));
        return {y[0] + d / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]),
                y[1] + d / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])};
    };
    const auto inside = [&](R t, const V& y) {
        return side == 0 ? 4 - std::abs(pull(t, y)) : R(side) * (y[1] - 1);
    };
    std::vector<Expected> events;
    for (R t = 0; t < t_end;) {
        R d = std::min(R(5e-4L), t_end - t);
        V next = step(t, x, d);
        if (inside(t + d, next) >= 0) {
            x = next;
            t += d;
            continue;
        }
        R low = 0;
        for (int k = 0; k < 70; ++k) {
            const R middle = (low + d) / 2;
            (inside(t + middle, step(t, x, middle)) >= 0 ? low : d) = middle;
        }
        x = {step(t, x, d)[0], 1};
        t += d;
        const R q = pull(t, x);
        const EventKind kind = side == 0 ? exit_sliding : std::abs(q) < 4 ? enter_sliding : cross;
        side = side == 0 ? (q > 0 ? 1 : -1) : kind == cross ? -side : 0;
        events.push_back({kind, static_cast<double>(t)});
    }
    return events;
}

} // namespace

TEMPLATE_TEST_CASE("problems: P16, a user's ten lines agree with an integration by hand",
                   "[problems]", DormandPrince5, DormandPrince8) {
    std::array<long double, 2> by_hand{1, 3};
    const auto expected = damped_oscillator_by_hand(20, by_hand);
    REQUIRE(expected.size() > 3);
    const Vec<double, 2> x0(1, 3);
    for (const double tol : {1e-9, 1e-12}) {
        const auto r =
            run<TestType>(DampedOscillator{}, Vec<double, 0>(), x0, 0, 20, tolerance<2>(tol));
        CHECK(r.result.status == Status::ok);
        // a local error of tol a step, some hundred steps; the hand's own error is (5e-4)^4 / 100 =
        // 6e-16 a unit of time
        check_events(r.events, expected, 20 * tol);
        for (int i = 0; i < 2; ++i)
            CHECK(r.result.x[i] ==
                  Approx(static_cast<double>(by_hand[std::size_t(i)])).epsilon(0).margin(20 * tol));
    }
}
