// SPDX-License-Identifier: BSD-3-Clause
// Slides of second order: h and h' both stay zero, and s follows from h'' = 0. Super-twisting laws
// under disturbances, Fuller's problem and its relatives, against closed forms.

#include "catch.hpp"
#include "run.hpp"

#include <filippov/engine/variation.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <random>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;
using enum EventKind;

namespace {

/// x' = -k sqrt|x| sign x + z + d(t),  z' = -b sign x + e,  d = A sin(w t) + B t^2/2, or its mirror
/// image; h is x times a scale. Where it slides z = -d and b s = d' + e.
struct SuperTwisting {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 8> params{"k", "b", "A",     "w",
                                                            "B", "e", "scale", "up"};
    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 8>;

    template <class S> X<S> side(const S& sign, const S& t, const X<S>& x, const P<S>& p) const {
        using std::abs;
        using std::sin;
        using std::sqrt;
        const S d = p[2] * sin(S(p[3] * t)) + p[4] * t * t / S(2);
        return {S(-p[0] * sqrt(S(abs(x[0]))) * sign + x[1] + p[7] * d),
                S(p[7] * p[5] - p[1] * sign)};
    }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const P<S>& p) const {
        return side(S(-1), t, x, p);
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return side(S(1), t, x, p);
    }
    template <Scalar S> S h(const S&, const X<S>& x, const P<S>& p) const { return p[6] * x[0]; }
};
using STParams = Vec<double, 8>;

STParams law(const std::array<double, 8>& values) { return STParams(values.data()); }
double disturbance(const STParams& p, double t) {
    return p[2] * std::sin(p[3] * t) + p[4] * t * t / 2;
}
double control(const STParams& p, double t) {
    return (p[2] * p[3] * std::cos(p[3] * t) + p[4] * t + p[5]) / p[1];
}

/// Super-twisting of a sliding variable sigma = v + c x: x' = v, v' = -c v - k sqrt|sigma| sign
/// sigma
/// + z + d. Where it slides x decays as exp(-c t).
struct SlidingVariable {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 3> params{"c", "A", "scale"};
    template <class S> using X = Vec<S, 3>;

    template <class S> X<S> side(const S& sign, const S& t, const X<S>& x, const X<S>& p) const {
        using std::abs;
        using std::cos;
        using std::sqrt;
        const S sigma = x[1] + p[0] * x[0];
        return {x[1], S(-p[0] * x[1] - S(1.5) * sqrt(S(abs(sigma))) * sign + x[2] + p[1] * cos(t)),
                S(S(-1.1) * sign)};
    }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const X<S>& p) const {
        return side(S(-1), t, x, p);
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const X<S>& p) const {
        return side(S(1), t, x, p);
    }
    template <Scalar S> S h(const S&, const X<S>& x, const X<S>& p) const {
        return p[2] * (x[1] + p[0] * x[0]);
    }
};

/// Super-twisting as typed formulas have it: each side's root ends at the surface, and is no number
/// beyond. The gains may be so large that it comes to h = h' = 0 from one side, without turns.
struct Typed {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"k", "scale"};
    template <class S> using X = Vec<S, 2>;

    template <class S> X<S> side(const S& sign, const S& t, const X<S>& x, const X<S>& p) const {
        using std::sin;
        using std::sqrt;
        return {S(-p[0] * sqrt(S(sign * x[0])) * sign + x[1] + S(0.5) * S(sin(t))), S(-sign)};
    }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const X<S>& p) const {
        return side(S(-1), t, x, p);
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const X<S>& p) const {
        return side(S(1), t, x, p);
    }
    template <Scalar S> S h(const S&, const X<S>& x, const X<S>& p) const { return p[1] * x[0]; }
};

/// Super-twisting that follows sin t: h = x - sin t, a surface that moves.
struct Tracker {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"scale"};
    template <class S> using X = Vec<S, 2>;

    template <class S> X<S> side(const S& sign, const S& t, const X<S>& x, const Vec<S, 1>&) const {
        using std::abs;
        using std::sin;
        using std::sqrt;
        const S error = x[0] - S(sin(t));
        return {S(S(-2) * sqrt(S(abs(error))) * sign + x[1] - x[0] * x[0]), S(S(-3) * sign)};
    }
    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const Vec<S, 1>& p) const {
        return side(S(-1), t, x, p);
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const Vec<S, 1>& p) const {
        return side(S(1), t, x, p);
    }
    template <Scalar S> S h(const S& t, const X<S>& x, const Vec<S, 1>& p) const {
        using std::sin;
        return p[0] * (x[0] - S(sin(t)));
    }
};

/// x'' = -sign(x + c x'|x'|): Fuller's problem, which chatters for c < 1/2 and slides for more.
struct Fuller {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"c", "scale"};
    template <class S> using X = Vec<S, 2>;

    template <Scalar S> X<S> f1(const S&, const X<S>& x, const X<S>&) const { return {x[1], S(1)}; }
    template <Scalar S> X<S> f2(const S&, const X<S>& x, const X<S>&) const {
        return {x[1], S(-1)};
    }
    template <Scalar S> S h(const S&, const X<S>& x, const X<S>& p) const {
        using std::abs;
        return p[1] * (x[0] + p[0] * x[1] * S(abs(x[1])));
    }
    /// When (1, 0) is at rest. From its first event at the speed v the next ones come at speeds of
    /// a geometric sequence, or it brakes at the rate 1/(2 c).
    static double rest(double c) {
        const double v = 1 / std::sqrt(c + 0.5);
        if (c >= 0.5)
            return v * (1 + 2 * c);
        const double q = std::sqrt((0.5 - c) / (0.5 + c));
        return v + v * (1 + q) / (1 - q);
    }
};

/// Super-twisting whose gain above is cos t, and below another.
struct Fading {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"below"};
    template <class S> using X = Vec<S, 2>;

    template <class S> S root(const S& x) const {
        using std::abs;
        using std::sqrt;
        return sqrt(S(abs(x)));
    }
    template <Scalar S> X<S> f1(const S&, const X<S>& x, const Vec<S, 1>& p) const {
        return {S(p[0] * root(x[0]) + x[1]), S(1)};
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const Vec<S, 1>&) const {
        using std::cos;
        return {S(-cos(t) * root(x[0]) + x[1]), S(-1)};
    }
    template <Scalar S> S h(const S&, const X<S>& x, const Vec<S, 1>&) const { return x[0]; }
};

/// A super-twisting law, and a surface that is never met.
struct BesideAnother {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 2> params{"k", "b"};
    template <class S> using X = Vec<S, 2>;

    template <Scalar S>
    X<S> region(const S&, const X<S>& x, const Mode<2>& side, const Vec<S, 2>& p) const {
        using std::abs;
        using std::sqrt;
        const S sign(side[0]);
        return {S(x[1] - p[0] * sign * sqrt(S(abs(x[0])))), S(-p[1] * sign)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const X<S>& x, const Vec<S, 2>&) const {
        return {x[0], S(x[1] - S(5))};
    }
};

/// x'' = -sign x + e + c x' + a x: a relay of second order whose sides bend smoothly.
struct Relay {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"e", "c", "a"};
    template <class S> using X = Vec<S, 2>;

    template <Scalar S> X<S> f1(const S&, const X<S>& x, const Vec<S, 3>& p) const {
        return {x[1], S(S(1) + p[0] + p[1] * x[1] + p[2] * x[0])};
    }
    template <Scalar S> X<S> f2(const S&, const X<S>& x, const Vec<S, 3>& p) const {
        return {x[1], S(S(-1) + p[0] + p[1] * x[1] + p[2] * x[0])};
    }
    template <Scalar S> S h(const S&, const X<S>& x, const Vec<S, 3>&) const { return x[0]; }
};

const double scales[]{1, 1e-9, 1e9};

template <class Run> auto last_of(const Run& r, EventKind kind) {
    for (auto e = r.events.rbegin(); e != r.events.rend(); ++e)
        if (e->kind == kind)
            return *e;
    FAIL("no such event: " << name(kind));
    return r.events.front();
}

} // namespace

TEMPLATE_TEST_CASE("second order: a super-twisting law takes its disturbance up", "[second_order]",
                   DormandPrince5, DormandPrince8) {
    std::mt19937 random(29);
    const auto within = [&](double low, double high) {
        return std::uniform_real_distribution<>(low, high)(random);
    };
    for (int n = 0; n < 12; ++n) {
        STParams p;
        p[2] = within(0.1, 0.6);
        p[3] = within(0.5, 3);
        p[4] = 0;
        p[5] = within(-0.2, 0.2);
        const double rate = p[2] * p[3] + std::abs(p[5]);
        p[0] = within(1.5, 2.5) * std::sqrt(rate);
        p[1] = within(1.1, 2) * rate;
        p[6] = scales[n % 3];
        p[7] = n % 2 == 0 ? 1 : -1;
        const Vec<double, 2> x0(within(-2, 2), within(-1, 1));
        CAPTURE(n, p.transpose(), x0.transpose());
        const auto r = run<TestType>(SuperTwisting{}, p, x0, 0.0, 40, tolerance<2>(1e-8));
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.times(accumulation).size() + r.times(enter_sliding).size() == 1);
        CHECK(r.result.x[0] == 0);
        CHECK(r.result.x[1] == Approx(-p[7] * disturbance(p, 40)).epsilon(0).margin(1e-13));
        CHECK(r.events.back().s == Approx(p[7] * control(p, 40)).epsilon(0).margin(1e-12));
        CHECK(r.result.mode[0] == 0);
        CHECK(r.result.mode.holds_rate(0));
        // one method does not know from the other when this begins
        CHECK(r.events[r.events.size() - 2].mode_after[0] == 0);
    }
}

TEMPLATE_TEST_CASE(
    "second order: the time of the accumulation is right to the root of the tolerance",
    "[second_order]", DormandPrince5, DormandPrince8) {
    // Without a disturbance times are in proportion to the root of x: both halves of a turn are
    // alike, and the first zero from (1, 0) comes at t1 with z = z1; then all is geometric.
    const STParams p = law({1.5, 1.1, 0, 1, 0, 0, 1, 1});
    const auto fine =
        run<DormandPrince8>(SuperTwisting{}, p, Vec<double, 2>(0, 1), 0.0, 20, tolerance<2>(1e-13));
    const auto turns = fine.times(cross);
    REQUIRE(turns.size() > 2);
    // from (0, 1) down to (0, -q): the next half takes q times as long
    const double q = -fine.events[1].x_right[1], half = turns[0], exact = half / (1 - q);
    CHECK(half == Approx((1 + q) / p[1]).epsilon(1e-10));
    for (const double tol : {1e-6, 1e-8, 1e-10}) {
        const auto r =
            run<TestType>(SuperTwisting{}, p, Vec<double, 2>(0, 1), 0.0, 20, tolerance<2>(tol));
        REQUIRE(r.result.status == Status::ok);
        CHECK(last_of(r, accumulation).t == Approx(exact).epsilon(0).margin(5 * std::sqrt(tol)));
    }
}

TEMPLATE_TEST_CASE("second order: the slide ends where the disturbance is too quick",
                   "[second_order]", DormandPrince5, DormandPrince8) {
    for (const double up : {1.0, -1.0})
        for (const double scale : scales)
            for (const double k : {1.5, 2.2}) {
                CAPTURE(up, scale, k);
                const STParams p = law({k, 1.1, 0, 1, 0.5, 0, scale, up});
                const double tol = 1e-9;
                const auto r = run<TestType>(SuperTwisting{}, p, Vec<double, 2>(up, 0), 0.0, 3,
                                             tolerance<2>(tol));
                REQUIRE(r.result.status == Status::ok);
                const auto exit = last_of(r, exit_sliding);
                CHECK(exit.t == Approx(2.2).epsilon(0).margin(1e-11));
                CHECK(exit.x_left[0] == 0);
                CHECK(exit.x_left[1] == Approx(-up * 1.21).epsilon(0).margin(1e-11));
                CHECK(exit.mode_before[0] == 0);
                CHECK(exit.mode_after[0] == int(up));
                // then 2 y y' = c u^2 - k y of the root y of x, u the time since then: a series
                // near zero, where that is stiff, and Runge and Kutta's method
                const double a = 0.25 / k, b = -4 * a * a / k, c = -10 * a * b / k,
                             d = -6 * (b * b + 2 * a * c) / k;
                double u = 0.02, y = u * u * (a + u * (b + u * (c + u * d)));
                const int steps = 200'000;
                const double dt = (0.8 - u) / steps;
                const auto slope = [&](double s, double root) {
                    return (0.25 * s * s - k * root) / (2 * root);
                };
                for (int n = 0; n < steps; ++n, u += dt) {
                    const double s1 = slope(u, y), s2 = slope(u + dt / 2, y + dt / 2 * s1),
                                 s3 = slope(u + dt / 2, y + dt / 2 * s2),
                                 s4 = slope(u + dt, y + dt * s3);
                    y += dt / 6 * (s1 + 2 * s2 + 2 * s3 + s4);
                }
                CHECK(up * r.result.x[0] == Approx(y * y).epsilon(0).margin(20 * tol));
                CHECK(up * r.result.x[1] == Approx(-1.21 - 1.1 * 0.8).epsilon(0).margin(20 * tol));
            }
}

TEMPLATE_TEST_CASE("second order: it slides again and again", "[second_order]", DormandPrince5,
                   DormandPrince8) {
    const STParams p = law({2, 1.1, 0.6, 2, 0, 0, 1, 1}); // |d'| is up to 1.2
    const auto r =
        run<TestType>(SuperTwisting{}, p, Vec<double, 2>(0.5, 0), 0.0, 20, tolerance<2>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    int exits = 0, rests = 0;
    for (const auto& e : r.events) {
        if (e.kind == exit_sliding) {
            ++exits;
            CHECK(std::abs(control(p, e.t)) == Approx(1).epsilon(1e-9));
            CHECK(e.mode_after[0] == (control(p, e.t) > 0 ? 1 : -1));
        }
        if (e.kind == accumulation || e.kind == enter_sliding) {
            ++rests;
            CHECK(e.x_right[1] == Approx(-disturbance(p, e.t)).epsilon(0).margin(1e-12));
            CHECK(e.s == Approx(control(p, e.t)).epsilon(0).margin(1e-10));
        }
    }
    CHECK(exits == 12); // once in each half turn of cos 2t, from the third on
    CHECK(rests == exits + (r.result.mode[0] == 0));
}

TEMPLATE_TEST_CASE("second order: a sliding variable of several components", "[second_order]",
                   DormandPrince5, DormandPrince8) {
    std::mt19937 random(7);
    std::uniform_real_distribution<> any(0.4, 2.5);
    for (int n = 0; n < 6; ++n) {
        const Vec<double, 3> p(any(random), 0.2 * any(random), scales[n % 3]);
        CAPTURE(p.transpose());
        const double tol = 1e-9;
        const auto r = run<TestType>(SlidingVariable{}, p, Vec<double, 3>(1, 0.3, 0), 0.0, 8,
                                     tolerance<3>(tol));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(r.result.mode.holds_rate(0));
        const auto rest = r.events[r.events.size() - 2];
        const double x = rest.x_right[0] * std::exp(-p[0] * (8 - rest.t));
        CHECK(r.result.x[0] == Approx(x).epsilon(0).margin(20 * tol));
        CHECK(r.result.x[1] == Approx(-p[0] * r.result.x[0]).epsilon(0).margin(1e-14));
        CHECK(r.result.x[2] == Approx(-p[1] * std::cos(8)).epsilon(0).margin(1e-12));
        CHECK(r.events.back().s == Approx(-p[1] * std::sin(8) / 1.1).epsilon(0).margin(1e-8));
    }
}

TEMPLATE_TEST_CASE("second order: roots that are no number beyond the surface", "[second_order]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double k : {1.2, 1.5, 2.0, 3.5, 5.0}) // from 2 sqrt 2 on there need be no turns
        for (const double scale : scales) {
            CAPTURE(k, scale);
            const auto r = run<TestType>(Typed{}, Vec<double, 2>(k, scale), Vec<double, 2>(2, 0),
                                         0.0, 30, tolerance<2>(1e-8));
            REQUIRE(r.result.status == Status::ok);
            CHECK(r.result.mode.holds_rate(0));
            CHECK(std::abs(r.result.x[0]) < 1e-20);
            CHECK(r.result.x[1] == Approx(-0.5 * std::sin(30.)).epsilon(1e-12));
            CHECK(r.events.back().s == Approx(0.5 * std::cos(30.)).epsilon(1e-11));
        }
}

TEMPLATE_TEST_CASE("second order: a surface that moves is followed", "[second_order]",
                   DormandPrince5, DormandPrince8) {
    for (const double scale : scales) {
        const auto r = run<TestType>(Tracker{}, Vec<double, 1>(scale), Vec<double, 2>(1.5, 0), 0.0,
                                     10, tolerance<2>(1e-9));
        REQUIRE(r.result.status == Status::ok);
        const double x = std::sin(10.), v = std::cos(10.);
        CHECK(r.result.x[0] == Approx(x).epsilon(1e-14));
        CHECK(r.result.x[1] == Approx(v + x * x).epsilon(1e-12));
        CHECK(r.events.back().s == Approx((x - 2 * x * v) / 3).epsilon(1e-9));
    }
}

TEMPLATE_TEST_CASE("second order: Fuller's problem comes to rest, and stays", "[second_order]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double c : {0.1, 0.3, 0.4446, 0.5, 0.55, 0.7, 1.5})
        for (const double scale : scales) {
            CAPTURE(c, scale);
            const auto r = run<TestType>(Fuller{}, Vec<double, 2>(c, scale), Vec<double, 2>(1, 0),
                                         0.0, 50, tolerance<2>(1e-9));
            REQUIRE(r.result.status == Status::ok);
            CHECK(r.result.x.norm() < 1e-300);
            CHECK(r.events.back().s == 0);
            const auto rest = r.events[r.events.size() - 2];
            CHECK(rest.kind == (c < 0.5 ? accumulation : enter_sliding));
            CHECK(rest.t == Approx(Fuller::rest(c)).epsilon(0).margin(1e-6));
            const auto start = run<TestType>(Fuller{}, Vec<double, 2>(c, scale),
                                             Vec<double, 2>(0, 0), 0.0, 5, tolerance<2>(1e-9));
            REQUIRE(start.result.status == Status::ok);
            CHECK(start.result.x == Vec<double, 2>(0, 0));
        }
}

TEMPLATE_TEST_CASE("second order: a start on h = h' = 0 slides if nothing leads away from it",
                   "[second_order]", DormandPrince5, DormandPrince8, Rodas5P) {
    const auto from_rest = [](const STParams& p, double t_end) {
        return run<TestType>(SuperTwisting{}, p, Vec<double, 2>(0, 0), 0.0, t_end,
                             tolerance<2>(1e-9));
    };
    for (const double scale : scales)
        for (const double up : {1.0, -1.0}) {
            CAPTURE(scale, up);
            const auto r = from_rest(law({1.5, 1.1, 0.4, 2, 0, 0.1, scale, up}), 6);
            REQUIRE(r.result.status == Status::ok);
            CHECK(r.events.size() == 2);
            CHECK(r.result.x[1] == Approx(-up * 0.4 * std::sin(12)).epsilon(1e-12));
            // Energy is kept exactly where no root takes it.
            CHECK(from_rest(law({0, 1.1, 0.4, 2, 0, 0.1, scale, up}), 6).result.status ==
                  Status::ok);
            // A root of the wrong sign makes solutions spiral away: backwards they come back.
            const auto away = from_rest(law({-1.5, 1.1, 0.4, 2, 0, 0.1, scale, up}), 6);
            CHECK(away.result.status == Status::ambiguous);
            CHECK_THAT(std::string(away.result.diagnosis.what), ContainsSubstring("away"));
            CHECK(from_rest(law({-1.5, 1.1, 0.4, 2, 0, 0.1, scale, up}), -6).result.status ==
                  Status::ok);
            CHECK(from_rest(law({1.5, 1.1, 0.4, 2, 0, 0.1, scale, up}), -6).result.status ==
                  Status::ambiguous);
            // both sides bend away
            CHECK(from_rest(law({1.5, -1.1, 0.4, 2, 0, 0.1, scale, up}), 6).result.status ==
                  Status::ambiguous);
        }
}

TEMPLATE_TEST_CASE("second order: what roots hold and another component repels goes its way",
                   "[second_order]", DormandPrince5, DormandPrince8) {
    // x' = z - 1.5 sqrt(x), z' = 1.1: in the end x = c t^2 with 2 c + 1.5 sqrt c = 1.1
    const double c = std::pow((-1.5 + std::sqrt(2.25 + 8 * 1.1)) / 4, 2);
    for (const double z : {1e-3, 1e-6, 1e-9, 1e-12, -1e-7}) {
        CAPTURE(z);
        const auto one = run<TestType>(SuperTwisting{}, law({1.5, -1.1, 0, 0, 0, 0, 1, 1}),
                                       Vec<double, 2>(0, z), 0.0, 2, tolerance<2>(1e-10));
        const auto two = run<TestType>(BesideAnother{}, Vec<double, 2>(1.5, -1.1),
                                       Vec<double, 2>(0, z), 0.0, 2, tolerance<2>(1e-10));
        REQUIRE(one.result.status == Status::ok);
        REQUIRE(two.result.status == Status::ok);
        CHECK(one.result.x[1] == Approx(z + std::copysign(2.2, z)).epsilon(1e-12));
        CHECK(std::abs(one.result.x[0]) == Approx(4 * c).epsilon(3 * std::abs(z) + 1e-9));
        CHECK(two.result.x[0] == Approx(one.result.x[0]).epsilon(1e-9));
    }
    const auto rest = run<TestType>(BesideAnother{}, Vec<double, 2>(1.5, -1.1),
                                    Vec<double, 2>(0, 0), 0.0, 2, tolerance<2>(1e-10));
    CHECK(rest.result.status == Status::ambiguous);
}

TEMPLATE_TEST_CASE("second order: it is over where roots begin to lead away", "[second_order]",
                   DormandPrince5, DormandPrince8) {
    // Turns lose what is proportional to the sum of both gains: until cos t = -below.
    for (const double below : {0.5, 0.0, -0.5}) {
        CAPTURE(below);
        const auto r = run<TestType>(Fading{}, Vec<double, 1>(below), Vec<double, 2>(0, 0), 0.0, 6,
                                     tolerance<2>(1e-9));
        CHECK(r.result.status == Status::ambiguous);
        CHECK_THAT(std::string(r.result.diagnosis.what), ContainsSubstring("away"));
        CHECK(r.result.t >= std::acos(-below) - 1e-6);
        CHECK(r.result.x == Vec<double, 2>(0, 0));
    }
    const auto r = run<TestType>(Fading{}, Vec<double, 1>(1.2), Vec<double, 2>(0, 0), 0.0, 6,
                                 tolerance<2>(1e-9));
    CHECK(r.result.status == Status::ok);
}

TEMPLATE_TEST_CASE("second order: relays with smooth sides rest where they are put",
                   "[second_order]", DormandPrince5, DormandPrince8, Rodas5P) {
    // Damped, driven or neither: from rest no solution leaves in finite time.
    for (const double e : {0.0, 0.3, -0.9})
        for (const double c : {0.0, -0.4, 0.4})
            for (const double a : {0.0, -2.0, 2.0}) {
                CAPTURE(e, c, a);
                const auto r = run<TestType>(Relay{}, Vec<double, 3>(e, c, a), Vec<double, 2>(0, 0),
                                             0.0, 5, tolerance<2>(1e-9));
                REQUIRE(r.result.status == Status::ok);
                CHECK(r.result.x == Vec<double, 2>(0, 0));
                CHECK(r.events.back().s == Approx(e).epsilon(0).margin(1e-15));
            }
    // beyond the reach of the relay it leaves at once
    const auto r = run<TestType>(Relay{}, Vec<double, 3>(1.5, 0, 0), Vec<double, 2>(0, 0), 0.0, 2,
                                 tolerance<2>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.result.x[0] == Approx(0.5 * 4 / 2).epsilon(1e-9));
}

TEST_CASE("second order: members in lanes go through it as runs do", "[second_order]") {
    const STParams p = law({2, 1.1, 0.6, 2, 0, 0, 1, 1});
    const auto settings = tolerance<2>(1e-8);
    std::vector<Member<2, 8>> members;
    for (int n = 0; n < 9; ++n)
        members.push_back({Vec<double, 2>(0.3 * (n - 4), n == 4 ? 0.0 : 0.1 * n), p, 0, 11.5});
    const auto r = ensemble<DormandPrince5, 8>(SuperTwisting{}, members, settings);
    REQUIRE(r.status == Status::ok);
    const double s = control(p, 11.5);
    REQUIRE(std::abs(s) < 1);
    for (std::size_t n = 0; n < members.size(); ++n) {
        CAPTURE(n);
        CHECK(r.outcomes[n].status == Status::ok);
        CHECK(r.outcomes[n].mode == 0);
        CHECK(r.outcomes[n].x[0] == 0);
        CHECK(r.outcomes[n].x[1] == Approx(-disturbance(p, 11.5)).epsilon(0).margin(1e-12));
    }
}

TEST_CASE("second order: no derivative is claimed through it", "[second_order]") {
    using D = Dual<double, 2>;
    const STParams p = law({1.5, 1.1, 0.4, 2, 0, 0, 1, 1});
    const Vec<D, 2> x0(D::variable(1, 0), D::variable(0, 1));
    Vec<D, 8> q;
    for (int i = 0; i < 8; ++i)
        q[i] = D(p[i]);
    const auto varied = [&](double t_end) {
        return flow<DormandPrince8>(SuperTwisting{}, q, x0, D(0), D(t_end), tolerance<2>(1e-9));
    };
    const auto before = varied(0.5);
    CHECK_FALSE(before.singular);
    const auto after = varied(6.0);
    REQUIRE(after.run.status == Status::ok);
    CHECK(after.singular);
    CHECK(std::isnan(after.x[1].d[0]));
    CHECK(value_of(after.x[1]) == Approx(-0.4 * std::sin(12)).epsilon(1e-12));
}
