// SPDX-License-Identifier: BSD-3-Clause
// Laws that end like a root at their surface, as Torricelli's: it is reached in finite time, with
// no speed, and the solution rests there. Against closed forms.

#include "catch.hpp"
#include "run.hpp"

#include <filippov/methods/rodas5p.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

const double scales[]{1, 1e-9, 1e9};
constexpr double tol = 1e-8;

/// c |u|^a on the side that `above` names, u > 0 there; odd, even, or nothing below.
constexpr double odd = 1, one_sided = 0, even = -1;
template <class S> S power(const S& u, bool above, double shape, const S& c, const S& a) {
    using std::pow;
    if (above)
        return c * S(pow(u, a));
    return shape == one_sided ? S(0)
           : shape == odd     ? S(-c * S(pow(S(-u), a)))
                              : S(c * S(pow(S(-u), a)));
}

/// x' = q0 + q1 cos t - c x^a, while (y, z) turn.
struct Law {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 6> params{"scale", "a", "c", "q0", "q1", "shape"};
    static constexpr int surfaces = 1;
    static constexpr std::array<SurfaceKind, 1> kinds{SurfaceKind::kink};
    template <Scalar S>
    Vec<S, 3> region(const S& t, const Vec<S, 3>& x, const Mode<1>& side,
                     const Vec<S, 6>& p) const {
        using elementary::cos;
        const S out = power(x[0], side[0] > 0, double(value_of(p[5])), p[2], p[1]);
        return {p[3] + p[4] * S(cos(t)) - out, x[2], -x[1]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 6>& p) const {
        return p[0] * x[0];
    }
};
/// The distance h from the unit circle: h' = -c |h|^a sign h, while the state turns round it.
struct Round {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"scale", "a", "c"};
    static constexpr int surfaces = 1;
    static constexpr std::array<SurfaceKind, 1> kinds{SurfaceKind::kink};
    template <Scalar S> S distance(const Vec<S, 2>& x) const {
        return x[0] * x[0] + x[1] * x[1] - S(1);
    }
    template <Scalar S>
    Vec<S, 2> region(const S&, const Vec<S, 2>& x, const Mode<1>& side, const Vec<S, 3>& p) const {
        const S rate = power(distance(x), side[0] > 0, odd, p[2], p[1]);
        const S share = rate / (S(2) * (x[0] * x[0] + x[1] * x[1]));
        return {x[1] - share * x[0], -x[0] - share * x[1]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return p[0] * distance(x);
    }
};
/// Three vessels in a row, a flow k |difference|^a between neighbours, an inflow q into the first.
struct Vessels {
    static constexpr int dim = 4;
    static constexpr std::array<std::string_view, 8> params{"scale", "k1", "k2", "A",
                                                            "B",     "C",  "q",  "a"};
    static constexpr int surfaces = 2;
    static constexpr std::array<SurfaceKind, 2> kinds{SurfaceKind::kink, SurfaceKind::kink};
    template <Scalar S>
    Vec<S, 4> region(const S&, const Vec<S, 4>& x, const Mode<2>& side, const Vec<S, 8>& p) const {
        const S q1 = power(S(x[0] - x[1]), side[0] > 0, odd, p[1], p[7]);
        const S q2 = power(S(x[1] - x[2]), side[1] > 0, odd, p[2], p[7]);
        return {(p[6] - q1) / p[3], (q1 - q2) / p[4], q2 / p[5], S(1)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 4>& x, const Vec<S, 8>& p) const {
        return {p[0] * (x[0] - x[1]), p[0] * (x[1] - x[2])};
    }
};
/// A tank and a clock: out by c sqrt(x), in by q from `on` to `off`.
struct Tank {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 6> params{"scale", "c",   "q",
                                                            "on",    "off", "shape"};
    static constexpr int surfaces = 2;
    static constexpr std::array<SurfaceKind, 2> kinds{SurfaceKind::kink, SurfaceKind::switching};
    template <Scalar S>
    Vec<S, 2> region(const S&, const Vec<S, 2>& x, const Mode<2>& side, const Vec<S, 6>& p) const {
        const S out = power(x[0], side[0] > 0, double(value_of(p[5])), p[1], S(0.5));
        return {(side[1] > 0 ? p[2] : S(0)) - out, S(1)};
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const Vec<S, 2>& x, const Vec<S, 6>& p) const {
        return {p[0] * x[0], (t - p[3]) * (p[4] - t)};
    }
};
/// x' = q - c x^a, odd; what has flown out is collected, and |x|^b, in y.
struct Collector {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 4> params{"scale", "a", "b", "q"};
    static constexpr int surfaces = 1;
    static constexpr std::array<SurfaceKind, 1> kinds{SurfaceKind::kink};
    template <Scalar S>
    Vec<S, 3> region(const S&, const Vec<S, 3>& x, const Mode<1>& side, const Vec<S, 4>& p) const {
        const S out = power(x[0], side[0] > 0, odd, S(1), p[1]);
        return {p[3] - out, power(x[0], side[0] > 0, even, S(1), p[2]), out};
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 4>& p) const {
        return p[0] * x[0];
    }
};
/// Two sides of a switching surface and a clock: x' = -sqrt(x) above, 0 or sqrt(-x) below.
struct TwoSides {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"scale", "shape"};
    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {-power(x[0], false, double(value_of(p[1])), S(1), S(0.5)), S(1)};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const {
        return {-power(x[0], true, odd, S(1), S(0.5)), S(1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return p[0] * x[0];
    }
};

/// Kinds of event that change the mode.
template <class Run> std::string words(const Run& r) {
    std::string all;
    for (const auto& e : r.events)
        if (e.mode_before != e.mode_after)
            all += (all.empty() ? "" : " ") + std::string(name(e.kind));
    return all;
}
/// When h' = -c h^a has brought h to zero, and by how much an error of 30 tolerances, made when
/// that much is left, moves that.
double time_to(double h, double c, double a) { return std::pow(h, 1 - a) / (c * (1 - a)); }
double margin(double c, double a) { return time_to(30 * tol, c, a); }
/// u(t) of x = u^2, x' = q - c sqrt(x): 2 u u' = q - c u, by Newton's method on its integral.
double filled(double u0, double q, double c, double t) {
    double u = 0.999 * q / c;
    for (int k = 0; k < 200; ++k) {
        const double f =
            2 / c * (u0 - u) + 2 * q / (c * c) * std::log((q - c * u0) / (q - c * u)) - t;
        const double next = u - f * (q - c * u) / (2 * u);
        u = next > 0 && next < q / c ? next : (next > 0 ? (u + q / c) / 2 : u / 2);
    }
    return u;
}
template <class Run> void few_steps(const Run& r, long most = 500) {
    CHECK(r.result.counters.steps + r.result.counters.rejected < most);
}

} // namespace

TEMPLATE_TEST_CASE("roots: end on the surface, and rest there while the rest goes on", "[roots]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    std::mt19937 random(30);
    std::uniform_real_distribution<double> power_of(0.15, 0.8), factor(0.5, 2);
    for (int k = 0; k < 4; ++k) {
        const double a = power_of(random), c = factor(random), x0 = factor(random);
        const double T = time_to(x0, c, a), end = T + 2;
        for (const double scale : scales)
            for (const double shape : {odd, one_sided})
                for (const double up : {1.0, -1.0}) {
                    if (up < 0 && shape == one_sided)
                        continue;
                    CAPTURE(a, c, x0, scale, shape, up);
                    const auto r =
                        run<TestType>(Law{}, Vec<double, 6>{{scale, a, c, 0, 0, shape}},
                                      Vec<double, 3>(up * x0, 1, 0), 0.0, end, tolerance<3>(tol));
                    REQUIRE(r.result.status == Status::ok);
                    CHECK(words(r) == "enter_sliding");
                    CHECK(std::abs(r.events[1].t - T) < margin(c, a));
                    CHECK(std::isnan(r.events[1].s)); // both fields are the same there
                    CHECK(r.result.mode[0] == 0);
                    CHECK(r.result.x[0] == 0);
                    CHECK(std::abs(r.result.x[1] - std::cos(end)) < 1e3 * tol);
                    few_steps(r);
                }
    }
}

TEMPLATE_TEST_CASE("roots: on a curved surface", "[roots]", DormandPrince5, DormandPrince8,
                   Rodas5P) {
    for (const double a : {0.3, 0.5, 0.7})
        for (const double scale : scales)
            for (const double r0 : {1.4, 0.7}) {
                CAPTURE(a, scale, r0);
                const double T = time_to(std::abs(r0 * r0 - 1), 1, a), end = T + 3;
                const auto r = run<TestType>(Round{}, Vec<double, 3>(scale, a, 1),
                                             Vec<double, 2>(r0, 0), 0.0, end, tolerance<2>(tol));
                REQUIRE(r.result.status == Status::ok);
                CHECK(words(r) == "enter_sliding");
                CHECK(std::abs(r.events[1].t - T) < margin(1, a));
                CHECK(std::abs(r.result.x[0] - std::cos(end)) < 1e3 * tol);
                CHECK(std::abs(r.result.x[1] + std::sin(end)) < 1e3 * tol);
                few_steps(r, 1500); // (a curved surface has a pace of its own)
            }
}

TEMPLATE_TEST_CASE("roots: vessels level out", "[roots]", DormandPrince5, DormandPrince8, Rodas5P) {
    std::mt19937 random(89);
    std::uniform_real_distribution<double> area(0.5, 3), level(0.2, 2);
    const auto of = [&](Vec<double, 8> p, Vec<double, 4> x, double end) {
        return run<TestType>(Vessels{}, p, x, 0.0, end, tolerance<4>(tol));
    };
    for (int k = 0; k < 3; ++k)
        for (const double scale : scales) {
            const double A = area(random), B = area(random), C = area(random), a = level(random),
                         b = level(random), c = level(random);
            CAPTURE(scale, A, B, C, a, b, c);
            // two of them
            const double T = time_to(std::abs(a - b), 1 / A + 1 / B, 0.5);
            auto r = of(Vec<double, 8>{{scale, 1, 0, A, B, 1, 0, 0.5}},
                        Vec<double, 4>(a, b, std::min(a, b) - 1, 0), T + 2);
            REQUIRE(r.result.status == Status::ok);
            CHECK(words(r) == "enter_sliding");
            CHECK(std::abs(r.events[1].t - T) < margin(1 / A + 1 / B, 0.5));
            CHECK(r.result.x[0] == Approx((A * a + B * b) / (A + B)).epsilon(1e2 * tol));
            CHECK(std::abs(r.result.x[0] - r.result.x[1]) < 1e-15);
            few_steps(r);
            // all three, one after another
            r = of(Vec<double, 8>{{scale, 1, 1, A, B, C, 0, 0.5}}, Vec<double, 4>(a, b, c, 0), 20);
            REQUIRE(r.result.status == Status::ok);
            const double mean = (A * a + B * b + C * c) / (A + B + C);
            for (int i = 0; i < 3; ++i)
                CHECK(r.result.x[i] == Approx(mean).epsilon(1e3 * tol));
            CHECK(r.result.mode[0] == 0);
            CHECK(r.result.mode[1] == 0);
            few_steps(r);
        }
    // both differences at once: each falls by 2 sqrt(h) - sqrt(h)
    for (const double scale : scales) {
        const auto r =
            of(Vec<double, 8>{{scale, 1, 1, 1, 1, 1, 0, 0.5}}, Vec<double, 4>(3, 2, 1, 0), 6);
        REQUIRE(r.result.status == Status::ok);
        CHECK(std::abs(r.events[r.events.size() - 2].t - 2) < margin(1, 0.5));
        CHECK((r.result.x - Vec<double, 4>(2, 2, 2, 6)).norm() < 1e2 * tol);
        // and level from the start
        const auto s =
            of(Vec<double, 8>{{scale, 1, 1, 1, 2, 1, 0, 0.5}}, Vec<double, 4>(1.1, 1.1, 1.1, 0), 6);
        REQUIRE(s.result.status == Status::ok);
        CHECK((s.result.x - Vec<double, 4>(1.1, 1.1, 1.1, 6)).norm() < tol);
        CHECK(words(s).empty());
    }
}

TEMPLATE_TEST_CASE("roots: an inflow holds the levels apart", "[roots]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    for (const double scale : scales) {
        // h' = q/A - (1/A + 1/B) sqrt(h), from level
        const double A = 2, B = 0.8, q = 0.4, end = 3;
        const auto r = run<TestType>(Vessels{}, Vec<double, 8>{{scale, 1, 0, A, B, 1, q, 0.5}},
                                     Vec<double, 4>(1, 1, 0, 0), 0.0, end, tolerance<4>(tol));
        REQUIRE(r.result.status == Status::ok);
        const double u = filled(0, q / A, 1 / A + 1 / B, end);
        CHECK(std::abs(r.result.x[0] - r.result.x[1] - u * u) < 1e2 * tol);
        CHECK(std::abs(A * r.result.x[0] + B * r.result.x[1] - A - B - q * end) < 1e2 * tol);
        few_steps(r);
    }
}

TEMPLATE_TEST_CASE("roots: what rests leaves when an inflow opens", "[roots]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    for (const double scale : scales)
        for (const double up : {1.0, -1.0})
            for (const double x0 : {0.0, 0.9}) {
                CAPTURE(scale, up, x0);
                const double c = 1.1, q = 0.5, on = 3.1, off = 5.3;
                const auto r =
                    run<TestType>(Tank{}, Vec<double, 6>{{scale, c, up * q, on, off, odd}},
                                  Vec<double, 2>(up * x0, 0), 0.0, 12.0, tolerance<2>(tol));
                REQUIRE(r.result.status == Status::ok);
                CHECK(words(r) == (x0 > 0 ? "enter_sliding cross cross enter_sliding"
                                          : "cross cross enter_sliding"));
                const auto& closed =
                    *std::find_if(r.events.begin(), r.events.end(), [&](const auto& e) {
                        return e.kind == EventKind::cross && e.t > on + 1;
                    });
                const double u = filled(0, q, c, off - on);
                CHECK(closed.t == Approx(off).epsilon(1e-12));
                CHECK(std::abs(closed.x_right[0] - up * u * u) < 1e2 * tol);
                const auto& empty = r.events[r.events.size() - 2];
                CHECK(std::abs(empty.t - off - 2 * u / c) < margin(c, 0.5));
                CHECK(r.result.x[0] == 0);
                CHECK(r.result.x[1] == Approx(12).epsilon(1e-9));
                few_steps(r);
            }
    // filling from below, too, if nothing holds it there
    const auto r = run<TestType>(Tank{}, Vec<double, 6>{{1, 1, -0.5, 3.1, 5.3, one_sided}},
                                 Vec<double, 2>(1, 0), 0.0, 12.0, tolerance<2>(tol));
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.result.x[0] == Approx(-0.5 * 2.2).epsilon(1e-6));
}

TEMPLATE_TEST_CASE("roots: other components depend on what rests by laws of their own", "[roots]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double scale : scales)
        for (const double b : {0.2, 0.5, 1.5})
            for (const double q : {0.0, 2e-6}) { // the latter holds x at q^2, below the tolerance
                CAPTURE(scale, b, q);
                const auto r = run<TestType>(Collector{}, Vec<double, 4>(scale, 0.5, b, q),
                                             Vec<double, 3>(1, 0, 0), 0.0, 12.0, tolerance<3>(tol));
                REQUIRE(r.result.status == Status::ok);
                CHECK(std::abs(r.result.x[0]) < tol);
                CHECK(std::abs(r.result.x[2] - 1 - 12 * q) < 1e2 * tol);
                // the integral of x^b/(sqrt(x) - q) to first order in q, and at rest q^2b
                const double fallen = 1 / (b + 0.5) + q / b, rest = 10 * std::pow(q, 2 * b);
                CHECK(std::abs(r.result.x[1] - fallen - rest) < 1e-3 * rest + 2e3 * tol);
                few_steps(r);
            }
}

TEMPLATE_TEST_CASE("roots: an inflow that turns round takes the level through zero", "[roots]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    // with the inflow's quarter of a turn later all is mirrored, so that two routes meet
    for (const double a : {0.4, 0.5, 0.6})
        for (const double scale : scales) {
            CAPTURE(a, scale);
            const auto level = [&](double sign, double t) {
                const auto r =
                    run<TestType>(Law{}, Vec<double, 6>{{scale, a, 1, 0, sign, odd}},
                                  Vec<double, 3>(sign * 0.5, 1, 0), 0.0, t, tolerance<3>(tol));
                REQUIRE(r.result.status == Status::ok);
                CHECK(r.result.counters.steps + r.result.counters.rejected < 2000);
                return r.result.x[0];
            };
            CHECK(std::abs(level(1, 11) + level(-1, 11)) < 1e2 * tol);
            // and what it was is soon forgotten: a turn later it is the same
            const double twice = level(1, 11 + 2 * 3.14159265358979323846);
            CHECK(std::abs(level(1, 11) - twice) < 1e-6);
        }
}

TEMPLATE_TEST_CASE("roots: between the sides of a switch", "[roots]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    for (const double scale : scales)
        for (const double shape : {odd, one_sided})
            for (const double x0 : {1.0, 0.0}) {
                CAPTURE(scale, shape, x0);
                const auto r = run<TestType>(TwoSides{}, Vec<double, 2>(scale, shape),
                                             Vec<double, 2>(x0, 0), 0.0, 5.0, tolerance<2>(tol));
                REQUIRE(r.result.status == Status::ok);
                CHECK(words(r) == (x0 > 0 ? "enter_sliding" : ""));
                CHECK(r.result.x[0] == 0);
                CHECK(r.result.x[1] == Approx(5).epsilon(1e-9));
                if (x0 > 0)
                    CHECK(std::abs(r.events[1].t - 2) < margin(1, 0.5));
                few_steps(r);
            }
}

TEMPLATE_TEST_CASE("roots: that lead away make many solutions", "[roots]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    const auto law = [](double x0, double c, double shape, double end, NonUnique policy) {
        auto settings = tolerance<3>(tol);
        settings.on_nonunique = policy;
        return run<TestType>(Law{}, Vec<double, 6>{{1, 0.5, c, 0, 0, shape}},
                             Vec<double, 3>(x0, 1, 0), 0.0, end, settings);
    };
    for (const double shape : {odd, even}) {
        const auto r = law(0, -1, shape, 2, NonUnique::stop);
        CHECK(r.result.status == Status::ambiguous);
        CHECK_THAT(r.result.message(), ContainsSubstring("grows like a root"));
    }
    // x' = sqrt|x| reaches zero from below at t = 2
    auto r = law(-1, -1, even, 5, NonUnique::stop);
    CHECK(r.result.status == Status::ambiguous);
    CHECK(std::abs(r.result.t - 2) < margin(1, 0.5));
    r = law(-1, -1, even, 5, NonUnique::above);
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.x[0] == Approx(2.25).epsilon(1e-3)); // (5 - 2)^2/4, from errors of a root's size
    // no sliding field lies between two that lead the same way; it does where they lead apart
    r = law(-1, -1, even, 5, NonUnique::stay);
    CHECK(r.result.status == Status::ambiguous);
    r = law(0, -1, odd, 5, NonUnique::stay);
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.x[0] == 0);
    // backwards an empty tank may have been emptied at any time before
    r = law(0, 1, odd, -2, NonUnique::stop);
    CHECK(r.result.status == Status::ambiguous);
    r = law(0, 1, one_sided, -2, NonUnique::stop);
    CHECK(r.result.status == Status::ambiguous);
    // and what leads away forwards comes back to zero, once and for all
    r = law(1, -1, odd, -5, NonUnique::stop);
    REQUIRE(r.result.status == Status::ok);
    CHECK(std::abs(r.events[1].t + 2) < margin(1, 0.5));
    CHECK(r.result.x[0] == 0);
}

TEST_CASE("roots: a law without one is no such law", "[roots]") {
    // x' = -x stays above zero for ever, and rests on it from the start
    const auto r = run<DormandPrince8>(Law{}, Vec<double, 6>{{1, 1, 1, 0, 0, odd}},
                                       Vec<double, 3>(1, 1, 0), 0.0, 30.0, tolerance<3>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(words(r).empty());
    CHECK(r.result.mode[0] == 1);
    // x' = -1 - sqrt|x| sign x crosses
    const auto s = run<DormandPrince8>(Law{}, Vec<double, 6>{{1, 0.5, 1, -1, 0, odd}},
                                       Vec<double, 3>(1, 1, 0), 0.0, 3.0, tolerance<3>(tol));
    CHECK(s.result.status == Status::ok);
    CHECK(words(s) == "cross");
    CHECK(s.result.mode[0] == -1);
    // (with sqrt(x) = u: dt = 2 u du/(1 + u))
    CHECK(s.events[1].t == Approx(2 - 2 * std::log(2.0)).epsilon(1e-6));
}
