// SPDX-License-Identifier: BSD-3-Clause
// float, double and long double: the same programs, each down to the floor that its rounding sets.
#include "../bench/rivals/reference_oscillator.hpp"
#include "run.hpp"

#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>

#include <numbers>

using namespace filippov;
using enum EventKind;

namespace {

/// A tolerance ten roundings wide.
template <class S> constexpr S tight = 10 * epsilon<S>;

/// Number of roundings in an error.
template <class S> double roundings(const S& value, long double expected) {
    return static_cast<double>(std::abs(static_cast<long double>(value) - expected) /
                               static_cast<long double>(epsilon<S>));
}

} // namespace

TEMPLATE_TEST_CASE("scalars: P1 is exact to the floor of each", "[scalars]", float, double,
                   long double) {
    using S = TestType;
    const Vec<S, 3> p(S(0.4L), S(0), S(0.5L));
    const auto r = run<DormandPrince5>(models::Coulomb{}, p, Vec<S, 2>(3, 0), 0, 15,
                                       tolerance<2, S>(tight<S>));
    CHECK(r.result.status == Status::ok);
    REQUIRE(r.events.size() == 6);
    double worst_t = 0, worst_x = 0;
    const long double reversal[] = {-2.2L, 1.4L, -0.6L, -0.2L};
    for (int k = 0; k < 4; ++k) {
        const auto& e = r.events[std::size_t(k + 1)];
        CHECK(e.kind == (k < 3 ? cross : enter_sliding));
        worst_t = std::max(worst_t, roundings(e.t, (k + 1) * std::numbers::pi_v<long double>));
        worst_x = std::max(worst_x, roundings(e.x_right[0], reversal[k]));
    }
    CAPTURE(worst_t, worst_x, r.result.counters.steps);
    // twenty times the tolerance of ten roundings: a free swing forgets no step's error
    CHECK(worst_t < 200);
    CHECK(worst_x < 200);
    CHECK(r.result.mode[0] == 0);
    CHECK(r.result.t == S(15));
}

TEMPLATE_TEST_CASE("scalars: P4 keeps to its limit cycle to the floor of each", "[scalars]", float,
                   double, long double) {
    using S = TestType;
    const Vec<S, 1> v(S(0.2L));
    const auto r = run<DormandPrince8>(models::DieciLopez{}, v, Vec<S, 2>(0, 0), 0, 30,
                                       tolerance<2, S>(tight<S>));
    CHECK(r.result.status == Status::ok);
    const auto exits = r.times(exit_sliding), entries = r.times(enter_sliding);
    REQUIRE(exits.size() == 3);
    REQUIRE(entries.size() == 4);
    // The exit is exact, x1 = 1/(1.2 - 0.2); so is the time of a slide at speed v between two known
    // points.
    double worst_x = 0, worst_t = 0;
    std::size_t slide = 0;
    for (std::size_t i = 0; i + 1 < r.events.size(); ++i) {
        if (r.events[i + 1].kind != exit_sliding)
            continue;
        worst_x = std::max(worst_x, roundings(r.events[i + 1].x_right[0], 1));
        const long double length = (1 - static_cast<long double>(r.events[i].x_right[0])) / 0.2L;
        worst_t = std::max(worst_t, roundings(r.events[i + 1].t - r.events[i].t, length));
        ++slide;
    }
    CHECK(slide == 3);
    const double cycle =
        roundings(exits[2] - exits[1], static_cast<long double>(exits[1] - exits[0]));
    CAPTURE(worst_x, worst_t, cycle, r.result.counters.steps);
    CHECK(worst_x < 4);
    CHECK(worst_t < 50); // times to 30: four bits fewer than those of a length of 1
    // three slips of some twenty steps, in float each off by the tolerance of ten roundings
    CHECK(cycle < 600);
    // the printed digits, or as many as the scalar has in such a time
    const double margin = std::max(2e-12, 600 * static_cast<double>(epsilon<S>));
    CHECK(static_cast<double>(entries[0]) == Approx(0.221654814176).epsilon(0).margin(margin));
    CHECK(static_cast<double>(exits[1] - exits[0]) ==
          Approx(9.230770458083).epsilon(0).margin(margin));
}

TEMPLATE_TEST_CASE("scalars: the oscillator keeps 200 periods to the floor of each", "[scalars]",
                   float, double, long double) {
    using S = TestType;
    const auto& reference = rivals::reference_home;
    Vec<S, 10> p;
    p << S(reference.A), S(reference.omega), S(1), S(1), S(10), S(1), S(0.3L), S(1.42L), S(0.1L),
        S(0.01L);
    const models::Oscillator sys;
    const S T = 2 * std::numbers::pi_v<S> / p[1];
    const auto r =
        run<DormandPrince5>(sys, p, Vec<S, 2>(0, 0), 0, S(200) * T, tolerance<2, S>(tight<S>));
    CHECK(r.result.status == Status::ok);
    REQUIRE(r.events.size() == std::size_t(reference.n_events) + 2);
    double worst_t = 0;
    for (std::size_t i = 0; i < reference.t_event.size(); ++i)
        worst_t = std::max(worst_t, roundings(r.events[i + 1].t, reference.t_event[i]));
    const double worst_x =
        std::max(roundings(r.result.x[0], reference.y), roundings(r.result.x[1], reference.v));
    CAPTURE(worst_t, worst_x);
    CHECK(worst_t < 100);  // ten events up to t = 38: five bits fewer than those of a length of 1
    CHECK(worst_x < 1000); // the orbit takes errors of 50 slips with it: some ten roundings each
}

TEST_CASE("scalars: float sees the oscillator's events and no others at any tolerance",
          "[scalars]") {
    Vec<float, 10> p = default_params<models::Oscillator, float>();
    for (const float tol : {1e-3f, 1e-4f, 1e-5f, 1e-6f}) {
        CAPTURE(tol);
        const auto r = run<DormandPrince5>(models::Oscillator{}, p, Vec<float, 2>(0, 0), 0, 40,
                                           tolerance<2, float>(tol));
        std::string kinds;
        for (const auto& e : r.events)
            kinds += e.kind == enter_sliding            ? 's'
                     : e.kind == exit_sliding           ? '1'
                     : e.kind == start || e.kind == end ? '|'
                                                        : '?';
        std::string expected = "|";
        expected += rivals::reference_home.kinds;
        expected += '|';
        CHECK(kinds == expected);
    }
}
