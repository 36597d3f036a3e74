// SPDX-License-Identifier: BSD-3-Clause
// Problems with several surfaces, with jumps of the state, and with events that accumulate, by both
// methods, beside tables of arbitrary precision (reference/several_surfaces.py).
#include "reference/several_surfaces.hpp"
#include "run.hpp"

#include <filippov/models/blocks.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/impacts.hpp>
#include <filippov/models/switches.hpp>
#include <filippov/sliding/intersection.hpp>

#include <cmath>
#include <span>

using namespace filippov;
using enum EventKind;

namespace {

/// A hundred times the rounding of a double: what is left is the method's error.
constexpr double tight = 2e-14;

/// All events and the final state are those of a table, within `margin`.
template <class R>
void check_table(const R& r, std::span<const reference::Event> table, std::span<const double> end,
                 double margin) {
    INFO(r.result.message());
    CHECK(r.result.status == Status::ok);
    REQUIRE(r.events.size() == table.size() + 2);
    for (std::size_t k = 0; k < table.size(); ++k) {
        const auto& e = r.events[k + 1];
        INFO("event " << k << " at " << table[k].t);
        CHECK(name(e.kind) == name(table[k].kind));
        CHECK(e.surface == table[k].surface);
        CHECK(e.t == Approx(table[k].t).epsilon(0).margin(margin));
        for (int i = 0; i < R::N; ++i)
            CHECK(e.x_right[i] == Approx(table[k].x[std::size_t(i)]).epsilon(0).margin(margin));
        // on every surface that it says it is on, to rounding
        CHECK((e.contacts >> e.surface & 1u) == 1u);
        CHECK(e.alternatives == 0);
    }
    for (int i = 0; i < R::N; ++i)
        CHECK(r.result.x[i] == Approx(end[std::size_t(i)]).epsilon(0).margin(margin));
}

template <class T, class Sys, int N>
Run<Sys> solve(const Sys& sys, const Vec<double, N>& x0, double t_end, double tol = tight) {
    return run<T>(sys, default_params<Sys>(), x0, 0, t_end, tolerance<N>(tol));
}

} // namespace

// --- several surfaces ----------------------------------------------------------------------------

TEMPLATE_TEST_CASE("several surfaces: P12, two blocks cross seventeen times and come to rest",
                   "[surfaces]", DormandPrince5, DormandPrince8) {
    const auto r = solve<TestType>(models::TwoBlocks{}, Vec<double, 4>(-2, 0, 3, 0), 20);
    // Some hundred steps of 2e-14 each, and events that pass the error of one velocity on to the
    // next time.
    check_table(r, reference::two_blocks, reference::two_blocks_end, 2e-11);
    CHECK(r.result.mode == Mode<4>{{0, 0, -1, -1}});
    CHECK(r.result.x[1] == 0); // at rest to the last bit
    CHECK(r.result.x[3] == 0);
}

TEMPLATE_TEST_CASE("several surfaces: P13, the whole cycle of Dieci and Lopez's two surfaces",
                   "[surfaces]", DormandPrince5, DormandPrince8) {
    const Vec<double, 3> x0(0.04, -0.01, -0.02);
    const auto r = solve<TestType>(models::DieciLopez2{}, x0, 40);
    check_table(r, reference::dieci_lopez, reference::dieci_lopez_end, 5e-12);
    // exits and returns are of both surfaces at once
    for (std::size_t k = 2; k + 1 < r.events.size(); ++k)
        CHECK(r.events[k].contacts == 3u);
    // an exit is one point, so the orbit is periodic from the first on
    const auto exits = r.times(exit_sliding);
    REQUIRE(exits.size() == 5);
    for (std::size_t k = 1; k < exits.size(); ++k)
        CHECK(exits[k] - exits[k - 1] == Approx(8.288015791096261).epsilon(0).margin(2e-12));
}

TEMPLATE_TEST_CASE("several surfaces: P13 with the moments selection slides along a shorter while",
                   "[surfaces]", DormandPrince5, DormandPrince8) {
    const Vec<double, 3> x0(0.04, -0.01, -0.02);
    const auto r = solve<TestType>(WithMoments<models::DieciLopez2>{}, x0, 40);
    check_table(r, reference::dieci_lopez_moments, reference::dieci_lopez_moments_end, 5e-12);
}

TEMPLATE_TEST_CASE("several surfaces: P14, a relay that cannot hold its plant", "[surfaces]",
                   DormandPrince5, DormandPrince8) {
    const auto r = solve<TestType>(models::PlanarRelay{}, Vec<double, 2>(-2.8, 2.4), 3);
    check_table(r, reference::planar_relay, reference::planar_relay_end, 1e-12);
    // |x2| >= 10/3 on the wrong side: x2 grows like e^(3t) and never comes back
    const auto lost = solve<TestType>(models::PlanarRelay{}, Vec<double, 2>(-1, -4), 3);
    CHECK(lost.events.size() == 2);
    // exact: x2 = -10/3 + (x2(0) + 10/3) e^(3t)
    CHECK(lost.result.x[1] == Approx(-10.0 / 3 - 2.0 / 3 * std::exp(9.0)).epsilon(1e-12));
}

TEMPLATE_TEST_CASE("several surfaces: chains of blocks on a belt stick and slip in turn",
                   "[surfaces]", DormandPrince5, DormandPrince8) {
    const auto two = solve<TestType>(models::BeltChain<2>{}, Vec<double, 4>(0.5, 0, -0.3, 0), 20);
    check_table(two, reference::belt_chain_2, reference::belt_chain_2_end, 1e-11);
    const models::BeltChain<3> chain;
    auto p = default_params<models::BeltChain<3>>();
    p[5] = 0.9;
    Vec<double, 6> x0;
    x0 << 0.5, 0, -0.3, 0, 0.2, 0;
    const auto three = run<TestType>(chain, p, x0, 0, 20, tolerance<6>(tight));
    check_table(three, reference::belt_chain_3, reference::belt_chain_3_end, 1e-11);
}

TEMPLATE_TEST_CASE("several surfaces: of two genes the one that is ahead wins", "[surfaces]",
                   DormandPrince5, DormandPrince8) {
    const models::GeneSwitch genes;
    const auto b = solve<TestType>(genes, Vec<double, 2>(1, 2), 5);
    check_table(b, reference::gene_switch, reference::gene_switch_end, 1e-12);
    // exact: to the threshold of 4 from 2, both rising to 10 with rate 2, and on to 8
    CHECK(b.events[1].t == Approx(std::log(8.0 / 6) / 2).epsilon(1e-14));
    const auto beside = solve<TestType>(genes, Vec<double, 2>(3, 3.001), 5);
    check_table(beside, reference::gene_switch_beside, reference::gene_switch_beside_end, 1e-11);
    // mirrored, the other one
    const auto a = solve<TestType>(genes, Vec<double, 2>(2, 1), 5);
    CHECK(a.result.x[0] == b.result.x[1]);
    CHECK(a.result.x[1] == b.result.x[0]);
    // on the diagonal both reach 4 at once, a saddle of the sliding modes: nobody can tell
    const auto tie = solve<TestType>(genes, Vec<double, 2>(3, 3), 5);
    CHECK(tie.result.status == Status::ambiguous);
    CHECK(tie.result.t == Approx(std::log(7.0 / 6) / 2).epsilon(1e-14));
}

// --- jumps of the state --------------------------------------------------------------------------

TEMPLATE_TEST_CASE("jumps: P10, a ball comes to rest after infinitely many bounces", "[jumps]",
                   DormandPrince5, DormandPrince8) {
    const double e = GENERATE(0.9, 0.5, 0.1);
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    const auto r = run<TestType>(models::BouncingBall{}, Vec<double, 2>(9.8, e),
                                 Vec<double, 2>(10, 0), 0, 30, tolerance<2>(tol));
    INFO("e = " << e << ", tolerance " << tol);
    CHECK(r.result.status == Status::ok);
    const double t1 = std::sqrt(20 / 9.8);
    REQUIRE(r.events.size() > 4);
    double t = t1, v = 9.8 * t1;
    for (std::size_t k = 1; k + 2 < r.events.size() && k < 20; ++k) {
        v *= e;
        CHECK(r.events[k].kind == jump);
        CHECK(r.events[k].t == Approx(t).epsilon(1e-13));
        CHECK(r.events[k].x_right[1] == Approx(v).epsilon(0).margin(2e-14 * 14));
        CHECK(r.events[k].x_left[1] == Approx(-v / e).epsilon(0).margin(2e-14 * 14));
        t += 2 * v / 9.8;
    }
    const auto& limit = r.events[r.events.size() - 2];
    CHECK(limit.kind == accumulation);
    // what is left at the last bounce is below the tolerance, and extrapolated
    CHECK(limit.t == Approx(t1 * (1 + 2 * e / (1 - e))).epsilon(0).margin(tol));
    CHECK(limit.mode_after[0] == 0); // in contact
    CHECK(r.result.x[0] == 0);
    CHECK(r.result.x[1] == 0);
    CHECK(r.result.t == 30);
    CHECK(r.result.counters.events < 400);
}

TEMPLATE_TEST_CASE("jumps: P11, a thermostat switches at the times of its exponentials", "[jumps]",
                   DormandPrince5, DormandPrince8) {
    const auto r = solve<TestType>(models::Thermostat{}, Vec<double, 2>(15, 1), 40);
    CHECK(r.result.status == Status::ok);
    const double up = 10 * std::log(23 / 14.5), down = 10 * std::log(5.5 / 4),
                 again = 10 * std::log(16 / 14.5);
    double t = up;
    for (std::size_t k = 1; k + 1 < r.events.size(); ++k) {
        CHECK(r.events[k].kind == jump);
        CHECK(r.events[k].t == Approx(t).epsilon(1e-13));
        CHECK(r.events[k].x_right[1] == (k % 2 == 0 ? 1 : 0));
        CHECK(r.events[k].x_left[0] == Approx(k % 2 == 0 ? 22 : 23.5).epsilon(1e-15));
        t += k % 2 == 0 ? again : down;
    }
    CHECK(t > 40);
}

TEMPLATE_TEST_CASE("jumps: friction and impacts together", "[jumps]", DormandPrince5,
                   DormandPrince8) {
    const auto r = solve<TestType>(models::ImpactBelt{}, Vec<double, 2>(0, 0), 40);
    check_table(r, reference::impact_belt, reference::impact_belt_end, 1e-11);
    for (const auto& e : r.events)
        if (e.kind == jump) {
            CHECK(e.x_left[0] == 1); // the wall, exactly
            CHECK(e.x_right[1] == -0.8 * e.x_left[1]);
        }
}

// --- accumulation --------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("accumulation: P15, a spiral reaches the intersection in finite time",
                   "[accumulation]", DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-4, 1e-8, 1e-12);
    for (const auto& x0 : {Vec<double, 2>(0, 1), Vec<double, 2>(0.3, 0.7), Vec<double, 2>(-2, 1e-3),
                           Vec<double, 2>(-5, -4)}) {
        const auto r = run<TestType>(models::SignPlane{}, default_params<models::SignPlane>(), x0,
                                     0, 10, tolerance<2>(tol));
        INFO("from " << x0.transpose() << ", tolerance " << tol);
        CHECK(r.result.status == Status::ok);
        const auto limits = r.times(accumulation);
        REQUIRE(limits.size() == 1);
        CHECK(
            limits[0] ==
            Approx((std::abs(x0[0]) + std::abs(x0[1])) / 2).epsilon(0).margin(1e-2 * tol + 1e-14));
        CHECK(r.result.mode == Mode<2>{{0, 0}});
        CHECK(r.result.x.cwiseAbs().maxCoeff() < 1e-15);
        CHECK(r.result.counters.events < 60);
    }
}

// --- starts that are known -----------------------------------------------------------------------

namespace {

/// Two relays: x' = t - sign x, whose slide ends upwards at t = 1, and y' = 1/5 - sign y, which
/// slides for ever.
struct TwoRelays {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 0> params{};
    static constexpr std::array<double, 0> defaults{};

    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {t - s[0], S(0.2) - s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
};

} // namespace

TEMPLATE_TEST_CASE("several surfaces: a run that starts where one of two slides ends goes on with "
                   "the other",
                   "[surfaces]", DormandPrince5, DormandPrince8) {
    KnownStart<2> known;
    known.before.set(0, 0);
    known.before.set(1, 0);
    known.guard = Guard<2>::above(0);
    const double off = GENERATE(0.0, 1e-13, -1e-13, 1e-10, -1e-10);
    Observer<double, 2, 2> observer;
    observer.event = [&](const Event<double, 2, 2>& e) {
        if (e.kind == EventKind::start) {
            CHECK(e.mode_after[0] == 1);
            CHECK(e.mode_after[1] == 0);
            CHECK(e.x_right == Vec<double, 2>(0, 0)); // on both surfaces
        }
        CHECK(e.kind != EventKind::enter_sliding); // nothing has left y = 0
    };
    const auto r = flow<TestType>(TwoRelays{}, Vec<double, 0>(), Vec<double, 2>(off, -off), 1.0,
                                  3.0, tolerance<2>(1e-9), observer, {}, known);
    INFO(r.message());
    CHECK(r.status == Status::ok);
    CHECK(r.mode[0] == 1);
    CHECK(r.mode[1] == 0);
    CHECK(r.x[0] == Approx(2).epsilon(1e-8));
    CHECK(r.x[1] == 0.0);
}
