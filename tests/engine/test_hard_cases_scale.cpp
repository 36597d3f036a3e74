// SPDX-License-Identifier: BSD-3-Clause
// Hard cases of scale: H20, H26, H34. The same problem in other units, and in other precisions.
#include "hard.hpp"

#include <filippov/models/belt.hpp>
#include <filippov/models/oscillator.hpp>

#include <array>
#include <cmath>

using namespace filippov;
using enum EventKind;

namespace {

/// A model with h multiplied by c (1 + x0^2/4): the same surface, a gradient of any length.
template <class Base> struct ScaledSwitch {
    static constexpr int dim = Base::dim;
    static constexpr auto params = Base::params;
    double c;

    template <Scalar S>
    State<Base, S> f1(const S& t, const State<Base, S>& x, const Params<Base, S>& p) const {
        return Base{}.f1(t, x, p);
    }
    template <Scalar S>
    State<Base, S> f2(const S& t, const State<Base, S>& x, const Params<Base, S>& p) const {
        return Base{}.f2(t, x, p);
    }
    template <Scalar S> S h(const S& t, const State<Base, S>& x, const Params<Base, S>& p) const {
        return S(c) * (S(1) + x[0] * x[0] / S(4)) * Base{}.h(t, x, p);
    }
};

/// A model in other units: x_i = unit_i X_i, t = unit_t T.
template <class Base> struct OtherUnits {
    static constexpr int dim = Base::dim;
    static constexpr auto params = Base::params;
    std::array<double, std::size_t(dim)> unit;
    double unit_t;

    template <class S> State<Base, S> in(const State<Base, S>& X) const {
        State<Base, S> x;
        for (int i = 0; i < dim; ++i)
            x[i] = S(unit[std::size_t(i)]) * X[i];
        return x;
    }
    template <class S> State<Base, S> out(const State<Base, S>& f) const {
        State<Base, S> F;
        for (int i = 0; i < dim; ++i)
            F[i] = f[i] * S(unit_t) / S(unit[std::size_t(i)]);
        return F;
    }
    template <Scalar S>
    State<Base, S> f1(const S& T, const State<Base, S>& X, const Params<Base, S>& p) const {
        return out<S>(Base{}.f1(S(S(unit_t) * T), in<S>(X), p));
    }
    template <Scalar S>
    State<Base, S> f2(const S& T, const State<Base, S>& X, const Params<Base, S>& p) const {
        return out<S>(Base{}.f2(S(S(unit_t) * T), in<S>(X), p));
    }
    template <Scalar S> S h(const S& T, const State<Base, S>& X, const Params<Base, S>& p) const {
        return Base{}.h(S(S(unit_t) * T), in<S>(X), p);
    }
};

template <class A, class B>
void check_same_events(const A& a, const B& b, double unit_t, double margin) {
    CHECK(a.result.status == b.result.status);
    REQUIRE(word(a) == word(b));
    for (std::size_t k = 0; k < a.events.size(); ++k) {
        CHECK(a.events[k].t == Approx(b.events[k].t * unit_t).epsilon(0).margin(margin));
        CHECK(a.events[k].mode_after == b.events[k].mode_after);
    }
}

} // namespace

TEMPLATE_TEST_CASE("H20: scaling h changes no event", "[hard]", DormandPrince5, DormandPrince8) {
    const double c = std::array{1e-9, 1.0, 1e9}[std::size_t(GENERATE(0, 1, 2))];
    CAPTURE(c);
    SECTION("oscillator") {
        auto p = default_params<models::Oscillator>();
        const double tol = 1e-10;
        for (const V2& x0 : {V2(0, 0), V2(3, 2), V2(-2, 1), V2(-0.685, 3.01)}) {
            const auto plain = run<TestType>(models::Oscillator{}, p, x0, 0, 10, bounded<2>(tol));
            const auto scaled =
                run<TestType>(ScaledSwitch<models::Oscillator>{c}, p, x0, 0, 10, bounded<2>(tol));
            CHECK(faults(scaled) == "");
            check_same_events(plain, scaled, 1, 1000 * tol);
        }
    }
    SECTION("belt of varying speed") {
        const auto p = default_params<models::VaryingBelt>();
        const double tol = 1e-10;
        const auto plain =
            run<TestType>(models::VaryingBelt{}, p, V2(3, 0), 0, 30, bounded<2>(tol));
        const auto scaled = run<TestType>(ScaledSwitch<models::VaryingBelt>{c}, p, V2(3, 0), 0, 30,
                                          bounded<2>(tol));
        CHECK(word(plain) ==
              "cross enter_sliding exit_sliding cross cross enter_sliding exit_sliding");
        CHECK(faults(scaled) == "");
        check_same_events(plain, scaled, 1, 1000 * tol);
    }
}

TEMPLATE_TEST_CASE("H26: other units of state and time give the same events", "[hard]",
                   DormandPrince5, DormandPrince8) {
    struct Units {
        double y, v, t;
    };
    const Units u =
        std::array<Units, 6>{{{1e9, 1e-9, 1},
                              {1e-9, 1e9, 1},
                              {1, 1, 1e12},
                              {1, 1, 1e-6},
                              {1e9, 1e9, 1e-6},
                              {1e-9, 1e-9, 1e12}}}[std::size_t(GENERATE(0, 1, 2, 3, 4, 5))];
    CAPTURE(u.y, u.v, u.t);
    const double tol = 1e-10;
    const auto p = default_params<models::VaryingBelt>();
    for (const V2& x0 : {V2(3, 0), V2(0, 1.7), V2(-1, 2)}) {
        const auto plain = run<TestType>(models::VaryingBelt{}, p, x0, 0, 30, bounded<2>(tol));
        auto settings = bounded<2>(tol);
        settings.atol = AbsoluteTolerance<double, 2>(V2(tol / u.y, tol / u.v));
        const auto other = run<TestType>(OtherUnits<models::VaryingBelt>{{u.y, u.v}, u.t}, p,
                                         V2(x0[0] / u.y, x0[1] / u.v), 0, 30 / u.t, settings);
        CHECK(faults(other) == "");
        check_same_events(plain, other, u.t, 1000 * tol);
        CHECK(other.result.x[0] * u.y == Approx(plain.result.x[0]).epsilon(0).margin(1000 * tol));
        CHECK(other.result.x[1] * u.v == Approx(plain.result.x[1]).epsilon(0).margin(1000 * tol));
    }
}

// --- H34 -----------------------------------------------------------------------------------------

namespace {

/// A slide to x = 0, where L1 = x^2 - x vanishes and turns; h = y - 1e6 has a coarse rounding.
struct CoarseSlide {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 0> params{};
    template <Scalar S>
    State<CoarseSlide, S> f1(const S&, const State<CoarseSlide, S>& x,
                             const Params<CoarseSlide, S>&) const {
        return {S(1), x[0] * (x[0] - S(1))};
    }
    template <Scalar S>
    State<CoarseSlide, S> f2(const S&, const State<CoarseSlide, S>&,
                             const Params<CoarseSlide, S>&) const {
        return {S(1), S(-1)};
    }
    template <Scalar S>
    S h(const S&, const State<CoarseSlide, S>& x, const Params<CoarseSlide, S>&) const {
        return x[1] - S(1e6);
    }
};

} // namespace

TEMPLATE_TEST_CASE("H26: the end of a slide does not depend on the unit of time", "[hard]",
                   DormandPrince5, DormandPrince8) {
    for (const double unit_t : {0x1p-60, 0x1p-30, 1.0, 0x1p30, 0x1p60}) {
        CAPTURE(unit_t);
        const OtherUnits<CoarseSlide> sys{{1.0, 1.0}, unit_t};
        const auto slide =
            run<TestType>(sys, Vec<double, 0>(), V2(-1, 1e6), 0, 1.5 / unit_t, bounded<2>(1e-9));
        CHECK(faults(slide) == "");
        REQUIRE(word(slide) == "exit_sliding");
        CHECK(slide.events[1].t * unit_t == Approx(1).margin(1e-12));
    }
}

TEMPLATE_TEST_CASE("H34: tolerances at the floor end in a result", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const auto p = default_params<models::VaryingBelt>();
    const double table[] = {7.6055699647,  9.4833785789,  9.7652587545, 14.8051056891,
                            17.4589396439, 26.1316818246, 27.2911568935};
    for (const double tol : {1e-13, 1e-14, 1e-15, 1e-16}) {
        const auto r =
            run<TestType>(models::VaryingBelt{}, p, V2(3, 0), 0, 30, bounded<2>(tol, 3'000'000));
        CAPTURE(tol, r.result.message());
        CHECK((r.result.status == Status::ok || r.result.status == Status::step_too_small));
        CHECK(faults(r) == "");
        if (tol >= 1e-14)
            CHECK(r.result.status == Status::ok);
        if (r.result.status == Status::ok) {
            REQUIRE(r.events.size() == 9);
            for (std::size_t k = 0; k < 7; ++k)
                CHECK(r.events[k + 1].t == Approx(table[k]).epsilon(0).margin(1e-10));
        } else {
            CHECK(r.result.message().find("tolerance is below rounding") != std::string::npos);
        }
    }
}

namespace {

template <class Tableau, class S> void other_scalar(S tol, double margin, bool at_floor) {
    const auto r = run<Tableau>(models::VaryingBelt{}, default_params<models::VaryingBelt, S>(),
                                Vec<S, 2>(S(3), S(0)), S(0), S(30), bounded<2, S>(tol, 3'000'000));
    CAPTURE(static_cast<double>(tol), r.result.message());
    CHECK(faults(r) == "");
    if (at_floor) {
        CHECK((r.result.status == Status::ok || r.result.status == Status::step_too_small));
        return;
    }
    CHECK(r.result.status == Status::ok);
    const double table[] = {7.6055699647,  9.4833785789,  9.7652587545, 14.8051056891,
                            17.4589396439, 26.1316818246, 27.2911568935};
    REQUIRE(r.events.size() == 9);
    for (std::size_t k = 0; k < 7; ++k)
        CHECK(static_cast<double>(r.events[k + 1].t) == Approx(table[k]).epsilon(0).margin(margin));
}

} // namespace

TEMPLATE_TEST_CASE("H34: float and long double find the same events, down to their floors",
                   "[hard]", DormandPrince5, DormandPrince8) {
    other_scalar<TestType, float>(1e-4f, 1e-2, false);
    other_scalar<TestType, float>(1e-6f, 1e-4, false);
    for (const float tol : {1e-7f, 1e-8f, 1e-9f, 1e-10f})
        other_scalar<TestType, float>(tol, 0, true);
    other_scalar<TestType, long double>(1e-13L, 1e-10, false);
    other_scalar<TestType, long double>(1e-16L, 1e-10, false);
    if constexpr (std::is_same_v<TestType, DormandPrince8>)
        for (const long double tol : {1e-18L, 1e-20L})
            other_scalar<TestType, long double>(tol, 0, true);
}
