// SPDX-License-Identifier: BSD-3-Clause
// Friction of two and three components: a direction v/|v| in the field, and the unit disc at rest.
// Against closed forms, the same motion along a line by ordinary switches, and fields without any.

#include "rounded.hpp"

#include <filippov/engine/variation.hpp>

#include <cmath>
#include <random>

using namespace filippov;

namespace {

constexpr double rotation = 0.7;

/// A body of mass 1 on a table or a belt in the plane, or in a viscous bed in space: friction mu
/// against its velocity relative to V e_1, and a force f + A (cos wt, sin wt). The components of a
/// are as large as `scale` says.
template <int D> struct Puck {
    static constexpr int dim = 2 * D, surfaces = D, n_params = 6 + D;
    static constexpr auto kinds = [] {
        std::array<SurfaceKind, std::size_t(D)> all;
        all.fill(SurfaceKind::component);
        all[0] = SurfaceKind::direction;
        return all;
    }();
    static constexpr std::array<std::string_view, std::size_t(n_params)> params{};
    enum : int { mu, V, A, w, scale, grows, f };
    template <class S> using X = Vec<S, dim>;
    template <class S> using P = Vec<S, n_params>;

    template <Scalar S>
    X<S> field(const S& t, const X<S>& x, const Vec<S, D>& s, const P<S>& p) const {
        using elementary::cos;
        using elementary::sin;
        X<S> rate;
        for (int i = 0; i < D; ++i) {
            rate[i] = x[D + i];
            rate[D + i] = p[f + i] - p[mu] * s[i];
        }
        const S size = p[A] + p[grows] * t;
        rate[D] += size * cos(S(p[w] * t));
        rate[D + 1] += size * sin(S(p[w] * t));
        return rate;
    }
    template <Scalar S> Vec<S, D> h(const S&, const X<S>& x, const P<S>& p) const {
        Vec<S, D> a;
        for (int i = 0; i < D; ++i)
            a[i] = p[scale] * (i == 0 ? S(x[D] - p[V]) : x[D + i]);
        return a;
    }
};
template <int D> typename Puck<D>::template P<double> puck(double mu, double scale = 1) {
    typename Puck<D>::template P<double> p = Puck<D>::template P<double>::Zero();
    p[Puck<D>::mu] = mu;
    p[Puck<D>::scale] = scale;
    return p;
}

const double scales[]{1, 1e-9, 1e9};

} // namespace

TEMPLATE_TEST_CASE("directions: a puck stops on a straight line, and rests", "[direction]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> speed(-5, 5), friction(0.3, 4);
    for (int k = 0; k < 8; ++k)
        for (const double scale : scales) {
            const double mu = k == 0 ? 2.94 : friction(random);
            const Vec<double, 2> v =
                k == 0 ? Vec<double, 2>(3, 4) : Vec<double, 2>(speed(random), speed(random));
            const double T = v.norm() / mu;
            CAPTURE(k, scale, mu, v);
            const auto r =
                run<TestType>(Puck<2>{}, puck<2>(mu, scale), Vec<double, 4>(0, 0, v[0], v[1]), 0.0,
                              2 * T, tolerance<4>(1e-9));
            REQUIRE(r.result.status == Status::ok);
            check_events(r.events, {{EventKind::enter_sliding, T}}, 1e-9);
            CHECK(r.result.mode.sliding() == 2);
            check_near(r.result.x, Vec<double, 4>(v[0] * T / 2, v[1] * T / 2, 0, 0), 1e-8);
        }
}

TEMPLATE_TEST_CASE("directions: on a slope it turns downhill as it stops", "[direction]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    // With theta the angle to the force, u = tan(theta/2) and n = mu/f > 1 the hodograph is
    // v sin(theta) = C u^n, dt = -C/(2f) u^(n-2) (1 + u^2) du.
    std::mt19937 random(2);
    std::uniform_real_distribution<double> ratio(1.1, 6), size(0.2, 2), angle(0.2, 2.9);
    for (int k = 0; k < 8; ++k) {
        const double n = ratio(random), f = size(random), v = 2 * size(random), th = angle(random),
                     u = std::tan(th / 2), C = v * std::sin(th) / std::pow(u, n), c = C * C / f,
                     T = v * std::sin(th) / (2 * f) * (1 / (u * (n - 1)) + u / (n + 1)),
                     x = c / 4 *
                         (std::pow(u, 2 * n - 2) / (2 * n - 2) -
                          std::pow(u, 2 * n + 2) / (2 * n + 2)),
                     y = c / 2 *
                         (std::pow(u, 2 * n - 1) / (2 * n - 1) +
                          std::pow(u, 2 * n + 1) / (2 * n + 1));
        for (const double turn : {0.0, rotation, 4.0}) // the plane is as good in any direction
            for (const double mirror : {1.0, -1.0}) {
                CAPTURE(k, n, f, v, th, turn, mirror);
                auto p = puck<2>(n * f, turn > 1 ? 1e-9 : 1);
                p[Puck<2>::f] = f * std::cos(turn);
                p[Puck<2>::f + 1] = f * std::sin(turn);
                const Vec<double, 4> x0(0, 0, v * std::cos(turn + mirror * th),
                                        v * std::sin(turn + mirror * th));
                const auto r = run<TestType>(Puck<2>{}, p, x0, 0.0, T + 1, tolerance<4>(1e-9));
                REQUIRE(r.result.status == Status::ok);
                check_events(r.events, {{EventKind::enter_sliding, T}}, 1e-7);
                CHECK(r.events[1].s == Approx(std::cos(turn) / n).margin(1e-9));
                check_near(r.result.x,
                           Vec<double, 4>(x * std::cos(turn) - mirror * y * std::sin(turn),
                                          x * std::sin(turn) + mirror * y * std::cos(turn), 0, 0),
                           1e-7);
            }
    }
}

TEMPLATE_TEST_CASE("directions: a belt carries the puck along", "[direction]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    for (const double V : {-0.7, 0.0, 2.0}) {
        auto p = puck<2>(1.5);
        p[Puck<2>::V] = V;
        const Vec<double, 2> a(1.0 - V, -0.5); // as it begins
        const double T = a.norm() / 1.5;
        const auto r = run<TestType>(Puck<2>{}, p, Vec<double, 4>(0, 0, 1.0, -0.5), 0.0, T + 3,
                                     tolerance<4>(1e-9));
        CAPTURE(V);
        REQUIRE(r.result.status == Status::ok);
        check_events(r.events, {{EventKind::enter_sliding, T}}, 1e-9);
        check_near(r.result.x, Vec<double, 4>(V * (T + 3) + a[0] * T / 2, a[1] * T / 2, V, 0.0),
                   1e-8);
    }
}

TEMPLATE_TEST_CASE("directions: what sticks leaves where the force is as large as friction",
                   "[direction]", DormandPrince5, DormandPrince8, Rodas5P) {
    // A force that grows along a line, across one that does not.
    for (const double scale : scales) {
        auto p = puck<2>(1, scale);
        p[Puck<2>::f + 1] = 0.6;
        p[Puck<2>::grows] = 0.4;
        const Vec<double, 4> rest = Vec<double, 4>::Zero();
        const auto r = run<TestType>(Puck<2>{}, p, rest, 0.0, 3.0, tolerance<4>(1e-9));
        CAPTURE(scale);
        REQUIRE(r.result.status == Status::ok);
        check_events(r.events, {{EventKind::exit_sliding, 2.0}}, 1e-12);
        CHECK(r.events[1].s == Approx(0.8).margin(1e-12));
        check_near(r.result.x, rounded<Puck<2>>(p, rest, 3.0, scale), 1e-7);
    }
    // Along the line alone: 0.4 (t - 2.5) from 2.5 on.
    auto p = puck<2>(1);
    p[Puck<2>::grows] = -0.4;
    const auto r = run<TestType>(Puck<2>{}, p, Vec<double, 4>(Vec<double, 4>::Zero()), 0.0, 4.0,
                                 tolerance<4>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    check_events(r.events, {{EventKind::exit_sliding, 2.5}}, 1e-12);
    check_near(r.result.x, Vec<double, 4>(-0.4 * 3.375 / 6, 0, -0.4 * 2.25 / 2, 0), 1e-8);
}

TEMPLATE_TEST_CASE("directions: a turning force takes it off and lets it stick again",
                   "[direction]", DormandPrince5, DormandPrince8, Rodas5P) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> part(0.2, 0.45), force(0.75, 1.0), frequency(0.7, 2);
    for (int k = 0; k < 4; ++k) {
        auto p = puck<2>(1, k == 1 ? 1e-9 : 1);
        p[Puck<2>::f] = part(random);
        p[Puck<2>::f + 1] = -part(random);
        p[Puck<2>::A] = force(random);
        p[Puck<2>::w] = frequency(random);
        const Vec<double, 4> rest = Vec<double, 4>::Zero();
        const auto r = run<TestType>(Puck<2>{}, p, rest, 0.0, 12.0, tolerance<4>(1e-9));
        CAPTURE(k, words(r));
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.events.size() > 3);
        for (const auto& e : r.events)
            if (e.kind == EventKind::exit_sliding) { // there the force is as large as friction
                const double c = p[Puck<2>::w] * e.t, A = p[Puck<2>::A];
                CHECK(std::hypot(p[Puck<2>::f] + A * std::cos(c),
                                 p[Puck<2>::f + 1] + A * std::sin(c)) == Approx(1).epsilon(1e-11));
            }
        check_near(r.result.x, rounded<Puck<2>>(p, rest, 12.0, p[Puck<2>::scale]), 1e-6);
    }
}

TEMPLATE_TEST_CASE("directions: from rest it follows a larger force", "[direction]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    auto p = puck<2>(1);
    p[Puck<2>::f] = 1.2;
    p[Puck<2>::f + 1] = 1.6;
    const Vec<double, 4> rest = Vec<double, 4>::Zero();
    const auto r = run<TestType>(Puck<2>{}, p, rest, 0.0, 3.0, tolerance<4>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    CHECK(words(r).empty());
    check_near(r.result.x, Vec<double, 4>(0.6 * 4.5, 0.8 * 4.5, 1.8, 2.4), 1e-8);
    p[Puck<2>::A] = 0.7; // and one that turns
    p[Puck<2>::w] = 1.3;
    const auto turns = run<TestType>(Puck<2>{}, p, rest, 0.0, 3.0, tolerance<4>(1e-9));
    REQUIRE(turns.result.status == Status::ok);
    check_near(turns.result.x, rounded<Puck<2>>(p, rest, 3.0), 1e-7);
    // Head on against a larger force: it stops, and turns at once.
    p[Puck<2>::A] = 0;
    const auto back =
        run<TestType>(Puck<2>{}, p, Vec<double, 4>(0, 0, -1.8, -2.4), 0.0, 4.0, tolerance<4>(1e-9));
    REQUIRE(back.result.status == Status::ok);
    check_events(back.events, {{EventKind::graze, 1.0}}, 1e-8);
    check_near(back.result.x, Vec<double, 4>(0.6 * 3, 0.8 * 3, 1.8, 2.4), 1e-7);
    // A little beside it passes without an event.
    const auto beside = run<TestType>(Puck<2>{}, p, Vec<double, 4>(0, 0, -1.8, -2.41), 0.0, 4.0,
                                      tolerance<4>(1e-9));
    REQUIRE(beside.result.status == Status::ok);
    CHECK(words(beside).empty());
    check_near(beside.result.x, rounded<Puck<2>>(p, Vec<double, 4>(0, 0, -1.8, -2.41), 4.0), 1e-6);
}

TEMPLATE_TEST_CASE("directions: of three components", "[direction]", DormandPrince5, DormandPrince8,
                   Rodas5P) {
    // Motion under a constant force stays in a plane: the same as there.
    auto p = puck<3>(2.94);
    auto q = puck<2>(2.94);
    const Vec<double, 3> e1(2. / 3, 1. / 3, 2. / 3), e2(-2. / 3, 2. / 3, 1. / 3);
    q[Puck<2>::f] = 1;
    for (int i = 0; i < 3; ++i)
        p[Puck<3>::f + i] = e1[i];
    Vec<double, 6> x0 = Vec<double, 6>::Zero();
    for (int i = 0; i < 3; ++i)
        x0[3 + i] = 3 * e1[i] + 4 * e2[i];
    const auto r = run<TestType>(Puck<3>{}, p, x0, 0.0, 3.0, tolerance<6>(1e-10));
    REQUIRE(r.result.status == Status::ok);
    check_events(r.events, {{EventKind::enter_sliding, 2 * (1 / 0.97 + 0.5 / 3.94)}}, 1e-8);
    const auto plane =
        run<TestType>(Puck<2>{}, q, Vec<double, 4>(0, 0, 3, 4), 0.0, 3.0, tolerance<4>(1e-10));
    const Vec<double, 3> end = plane.result.x[0] * e1 + plane.result.x[1] * e2;
    check_near(end, r.result.x, 1e-8);
    // A force that turns, and one across.
    p = puck<3>(1, 1e-9);
    p[Puck<3>::f] = 0.2;
    p[Puck<3>::f + 2] = 0.3;
    p[Puck<3>::A] = 0.9;
    p[Puck<3>::w] = 1;
    const Vec<double, 6> rest = Vec<double, 6>::Zero();
    const auto turns = run<TestType>(Puck<3>{}, p, rest, 0.0, 8.0, tolerance<6>(1e-9));
    REQUIRE(turns.result.status == Status::ok);
    CHECK(turns.events.size() > 3);
    check_near(turns.result.x, rounded<Puck<3>>(p, rest, 8.0, 1e-9), 1e-6);
}

TEST_CASE("directions: backwards from motion, and not beyond the start of it", "[direction]") {
    auto p = puck<2>(1);
    p[Puck<2>::f] = 0.5;
    p[Puck<2>::A] = 0.3;
    p[Puck<2>::w] = 2;
    const Vec<double, 4> x0(0.3, -0.2, 3, 4);
    const auto there = run<DormandPrince8>(Puck<2>{}, p, x0, 0.0, 3.0, tolerance<4>(1e-11));
    REQUIRE(there.result.status == Status::ok);
    const auto back =
        run<DormandPrince8>(Puck<2>{}, p, there.result.x, 3.0, 0.0, tolerance<4>(1e-11));
    REQUIRE(back.result.status == Status::ok);
    check_near(back.result.x, x0, 1e-8);
    // At rest any past is as good: it may have slid here from anywhere.
    const auto rest = run<DormandPrince5>(Puck<2>{}, p, Vec<double, 4>(Vec<double, 4>::Zero()), 1.0,
                                          0.0, tolerance<4>(1e-9));
    CHECK(rest.result.status == Status::ambiguous);
}

TEST_CASE("directions: at the limit of friction it sticks, and what pushes is not unique",
          "[direction]") {
    auto p = puck<2>(1);
    p[Puck<2>::f] = 0.6;
    p[Puck<2>::f + 1] = 0.8;
    const Vec<double, 4> rest = Vec<double, 4>::Zero();
    const auto limit = run<DormandPrince5>(Puck<2>{}, p, rest, 0.0, 5.0, tolerance<4>(1e-9));
    REQUIRE(limit.result.status == Status::ok);
    CHECK(words(limit).empty());
    check_near(limit.result.x, rest, 1e-12);
    p = puck<2>(-1); // "friction" that accelerates
    p[Puck<2>::f] = 0.5;
    CHECK(run<DormandPrince5>(Puck<2>{}, p, rest, 0.0, 5.0, tolerance<4>(1e-9)).result.status ==
          Status::ambiguous);
    p[Puck<2>::f] = 2;
    CHECK(run<DormandPrince5>(Puck<2>{}, p, rest, 0.0, 5.0, tolerance<4>(1e-9)).result.status ==
          Status::ambiguous);
}

TEST_CASE("directions: derivatives while it moves, and none through rest", "[direction]") {
    using D = Dual<double, 1>;
    Vec<D, 8> p;
    Vec<D, 4> x0;
    auto q = puck<2>(1.5);
    q[Puck<2>::f] = 0.4;
    for (int i = 0; i < 8; ++i)
        p[i] = D(q[i]);
    const Vec<double, 4> start(0, 0, 3, 4);
    for (int i = 0; i < 4; ++i)
        x0[i] = D(start[i]);
    x0[2].d[0] = 1; // by the first component of the speed
    const auto moves = flow<DormandPrince8>(Puck<2>{}, p, x0, D(0.0), D(2.0), tolerance<4>(1e-11));
    REQUIRE(moves.run.status == Status::ok);
    REQUIRE_FALSE(moves.singular);
    const auto end = [&](double dv) {
        return run<DormandPrince8>(Puck<2>{}, q, Vec<double, 4>(0, 0, 3 + dv, 4), 0.0, 2.0,
                                   tolerance<4>(1e-12))
            .result.x;
    };
    const Vec<double, 4> slope = (end(1e-4) - end(-1e-4)) / 2e-4;
    for (int i = 0; i < 4; ++i)
        CHECK(moves.x[i].d[0] == Approx(slope[i]).margin(1e-6));
    CHECK(flow<DormandPrince8>(Puck<2>{}, p, x0, D(0.0), D(9.0), tolerance<4>(1e-9)).singular);
}
