// SPDX-License-Identifier: BSD-3-Clause
// Directions beside each other, beside ordinary switches, and where the body turns.

#include "rounded.hpp"

#include <random>

namespace {

/// A block on the ground, tied to a wall by a spring, and another one on top of it. In the plane
/// their friction has directions; on a line it is an ordinary switch each.
template <int D> struct Stack {
    static constexpr int dim = 4 * D, surfaces = 2 * D;
    static constexpr auto kinds = [] {
        std::array<SurfaceKind, std::size_t(2 * D)> all;
        all.fill(D == 1 ? SurfaceKind::switching : SurfaceKind::component);
        if (D > 1)
            all[0] = all[std::size_t(D)] = SurfaceKind::direction;
        return all;
    }();
    static constexpr std::array<std::string_view, std::size_t(6 + 4 * D)> params{};
    enum : int {
        m,
        k,
        ground,
        between,
        w1,
        w2,
        cos1,
        sin1 = cos1 + D,
        cos2 = sin1 + D,
        sin2 = cos2 + D
    };
    template <class S> using X = Vec<S, dim>;
    template <class S> using P = Vec<S, 6 + 4 * D>;

    template <Scalar S>
    X<S> field(const S& t, const X<S>& x, const Vec<S, 2 * D>& s, const P<S>& p) const {
        using elementary::cos;
        using elementary::sin;
        X<S> rate;
        for (int i = 0; i < D; ++i) {
            const S lower = p[cos1 + i] * cos(S(p[w1] * t)) + p[sin1 + i] * sin(S(p[w1] * t)),
                    upper = p[cos2 + i] * cos(S(p[w2] * t)) + p[sin2 + i] * sin(S(p[w2] * t));
            rate[i] = x[2 * D + i];
            rate[D + i] = x[3 * D + i];
            rate[2 * D + i] = lower - p[k] * x[i] - p[ground] * s[i] + p[between] * s[D + i];
            rate[3 * D + i] = (upper - p[between] * s[D + i]) / p[m];
        }
        return rate;
    }
    template <Scalar S> Vec<S, 2 * D> h(const S&, const X<S>& x, const P<S>&) const {
        Vec<S, 2 * D> a;
        for (int i = 0; i < D; ++i) {
            a[i] = x[2 * D + i];
            a[D + i] = x[3 * D + i] - x[2 * D + i];
        }
        return a;
    }
};

/// A puck that is tied by a spring to a slider with dry friction on a rail.
struct PuckAndSlider {
    static constexpr int dim = 6, surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::switching, SurfaceKind::direction,
                                      SurfaceKind::component};
    static constexpr std::array<std::string_view, 5> params{"A", "w", "k", "mu", "rail"};

    template <Scalar S>
    Vec<S, 6> field(const S& t, const Vec<S, 6>& x, const Vec<S, 3>& s, const Vec<S, 5>& p) const {
        using elementary::cos;
        using elementary::sin;
        const S pull = p[2] * (x[4] - x[0]);
        return {x[2],
                x[3],
                p[0] * cos(S(p[1] * t)) + pull - p[3] * s[1],
                p[0] * sin(S(p[1] * t)) - S(0.3) * x[1] - p[3] * s[2],
                x[5],
                -pull - p[4] * s[0]};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 6>& x, const Vec<S, 5>&) const {
        return {x[5], x[2], x[3]};
    }
};

/// A block that stands on one point at a distance of its centre, and turns: the speed of that
/// point is what friction acts against.
struct TurningBlock {
    static constexpr int dim = 6, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::direction, SurfaceKind::component};
    static constexpr std::array<std::string_view, 5> params{"A", "w", "mu", "r", "inertia"};

    template <Scalar S>
    Vec<S, 6> field(const S& t, const Vec<S, 6>& x, const Vec<S, 2>& s, const Vec<S, 5>& p) const {
        using elementary::cos;
        using elementary::sin;
        const S force = p[0] * sin(S(p[1] * t));
        return {x[3],
                x[4],
                x[5],
                force - x[0] - p[2] * s[0],
                S(0.5) * force - p[2] * s[1],
                (-S(2) * x[2] - p[2] * p[3] * (cos(x[2]) * s[1] - sin(x[2]) * s[0])) / p[4]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 6>& x, const Vec<S, 5>& p) const {
        using elementary::cos;
        using elementary::sin;
        return {x[3] - p[3] * sin(x[2]) * x[5], x[4] + p[3] * cos(x[2]) * x[5]};
    }
};

/// A drill bit: what its friction acts against are two speeds and the speed of its rim.
struct DrillBit {
    static constexpr int dim = 6, surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::direction, SurfaceKind::component,
                                      SurfaceKind::component};
    static constexpr std::array<std::string_view, 3> params{"mu", "drive", "side"};

    template <Scalar S>
    Vec<S, 6> field(const S& t, const Vec<S, 6>& x, const Vec<S, 3>& s, const Vec<S, 3>& p) const {
        using elementary::sin;
        return {x[3],
                x[4],
                x[5],
                p[2] * sin(t) - x[0] - p[0] * s[0],
                S(0.2) - x[1] - p[0] * s[1],
                (t * p[1] - x[2] - p[0] * s[2]) * S(2)}; // driven by a shaft that twists
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 6>& x, const Vec<S, 3>&) const {
        return {x[3], x[4], S(0.5) * x[5]};
    }
};

/// A puck between two walls that throw it back, with a bell inside: a ball that bounces on its own
/// floor until it rests there.
struct PuckBetweenWalls {
    static constexpr int dim = 6, surfaces = 5;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::direction,
                                      SurfaceKind::component, SurfaceKind::jump, SurfaceKind::jump};
    static constexpr std::array<std::string_view, 2> params{"mu", "e"};

    template <Scalar S>
    Vec<S, 6> field(const S&, const Vec<S, 6>& x, const Vec<S, 5>& s, const Vec<S, 2>& p) const {
        return {x[2], x[3], -p[0] * s[1], -p[0] * s[2], x[5], S(-1)};
    }
    template <Scalar S> Vec<S, 5> h(const S&, const Vec<S, 6>& x, const Vec<S, 2>&) const {
        return {S(1) - x[0], x[2], x[3], S(1) + x[0], x[4]};
    }
    template <Scalar S> Vec<S, 6> jump(int j, const S&, Vec<S, 6> x, const Vec<S, 2>& p) const {
        if (j == 4)
            x[5] = -p[1] * x[5];
        else
            x[2] = -x[2];
        return x;
    }
};

/// Friction that acts at an angle to the motion, on a force that begins at t = 1.
struct Askew {
    static constexpr int dim = 4, surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::direction, SurfaceKind::component,
                                      SurfaceKind::switching};
    static constexpr std::array<std::string_view, 3> params{"angle", "before", "after"};

    template <Scalar S>
    Vec<S, 4> field(const S&, const Vec<S, 4>& x, const Vec<S, 3>& s, const Vec<S, 3>& p) const {
        using std::cos;
        using std::sin;
        const S c = cos(p[0]), d = sin(p[0]);
        const S force = S(0.5) * (p[1] + p[2] + s[2] * (p[2] - p[1]));
        return {x[2], x[3], S(0.6) * force - c * s[0] + d * s[1],
                S(0.8) * force - d * s[0] - c * s[1]};
    }
    template <Scalar S> Vec<S, 3> h(const S& t, const Vec<S, 4>& x, const Vec<S, 3>&) const {
        return {x[2], x[3], t - S(1)};
    }
};

} // namespace

TEMPLATE_TEST_CASE("directions: along a line they are ordinary switches", "[direction]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> of(0, 1);
    std::size_t events = 0;
    for (int n = 0; n < 6; ++n) {
        Stack<1>::P<double> p;
        Stack<2>::P<double> q;
        p << 0.5 + of(random), 0.5 + of(random), 0.3 + of(random), 0.2 + of(random),
            0.5 + of(random), 0.7 + of(random), 1 + of(random), 0.5, 0.2 + of(random), -0.4;
        const Vec<double, 4> x0(0, 0, of(random), -of(random));
        const double c = std::cos(n + 0.3), s = std::sin(n + 0.3);
        Vec<double, 8> y0;
        for (int i = 0; i < 6; ++i)
            q[i] = p[i];
        for (int i = 0; i < 4; ++i) {
            q[6 + 2 * i] = c * p[6 + i];
            q[7 + 2 * i] = s * p[6 + i];
            y0[2 * i] = c * x0[i];
            y0[2 * i + 1] = s * x0[i];
        }
        const auto line = run<TestType>(Stack<1>{}, p, x0, 0.0, 15.0, tolerance<4>(1e-10));
        const auto plane = run<TestType>(Stack<2>{}, q, y0, 0.0, 15.0, tolerance<8>(1e-10));
        CAPTURE(n, words(line), words(plane));
        REQUIRE(line.result.status == Status::ok);
        REQUIRE(plane.result.status == Status::ok);
        REQUIRE(line.events.size() == plane.events.size());
        for (std::size_t i = 0; i < line.events.size(); ++i)
            CHECK(line.events[i].t == Approx(plane.events[i].t).epsilon(0).margin(1e-7));
        for (int i = 0; i < 4; ++i) {
            CHECK(plane.result.x[2 * i] == Approx(c * line.result.x[i]).margin(1e-7));
            CHECK(plane.result.x[2 * i + 1] == Approx(s * line.result.x[i]).margin(1e-7));
        }
        events += line.events.size();
    }
    CHECK(events > 40);
}

TEMPLATE_TEST_CASE("directions: two bodies that rub on each other", "[direction]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> of(0, 1);
    std::size_t events = 0;
    for (int n = 0; n < 3; ++n) {
        Stack<2>::P<double> p;
        p << 0.8, 1, 0.5, 0.3 + 0.2 * of(random), 1.3, 0.9, 0.7 + of(random), -0.2, 0.1,
            0.8 + of(random), 0.2 * of(random), 0.3, -0.1, 0.25 * of(random);
        const Vec<double, 8> rest = Vec<double, 8>::Zero();
        const auto r = run<TestType>(Stack<2>{}, p, rest, 0.0, 8.0, tolerance<8>(1e-9));
        CAPTURE(n, words(r));
        REQUIRE(r.result.status == Status::ok);
        events += r.events.size();
        check_near(r.result.x, rounded<Stack<2>>(p, rest, 8.0), 1e-6);
    }
    CHECK(events > 9);
}

TEMPLATE_TEST_CASE("directions: beside an ordinary switch", "[direction]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    const Vec<double, 6> rest = Vec<double, 6>::Zero();
    for (const double A : {1.1, 1.4}) {
        const Vec<double, 5> p(A, 1.2, 1.5, 1.0, 0.4);
        const auto r = run<TestType>(PuckAndSlider{}, p, rest, 0.0, 12.0, tolerance<6>(1e-9));
        CAPTURE(A, words(r));
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.events.size() > 4);
        check_near(r.result.x, rounded<PuckAndSlider>(p, rest, 12.0), 1e-6);
    }
}

TEMPLATE_TEST_CASE("directions: of a point of a body that turns", "[direction]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    const Vec<double, 6> rest = Vec<double, 6>::Zero();
    const Vec<double, 5> p(1.1, 0.8, 0.9, 0.4, 0.6);
    const auto r = run<TestType>(TurningBlock{}, p, rest, 0.0, 10.0, tolerance<6>(1e-9));
    CAPTURE(words(r));
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.events.size() > 4);
    check_near(r.result.x, rounded<TurningBlock>(p, rest, 10.0), 1e-6);
}

TEMPLATE_TEST_CASE("directions: of a drill bit", "[direction]", DormandPrince5, DormandPrince8,
                   Rodas5P) {
    const Vec<double, 6> rest = Vec<double, 6>::Zero();
    const Vec<double, 3> p(0.8, 0.25, 0.6);
    const auto r = run<TestType>(DrillBit{}, p, rest, 0.0, 15.0, tolerance<6>(1e-9));
    CAPTURE(words(r));
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.events.size() > 3);
    check_near(r.result.x, rounded<DrillBit>(p, rest, 15.0), 1e-6);
}

TEMPLATE_TEST_CASE("directions: a force that jumps, and friction askew", "[direction]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    const Vec<double, 4> rest = Vec<double, 4>::Zero();
    const auto straight =
        run<TestType>(Askew{}, Vec<double, 3>(0, 0.5, 2), rest, 0.0, 3.0, tolerance<4>(1e-9));
    REQUIRE(straight.result.status == Status::ok);
    check_near(straight.result.x, Vec<double, 4>(1.2, 1.6, 1.2, 1.6), 1e-8);
    const auto stays =
        run<TestType>(Askew{}, Vec<double, 3>(0, 0.5, 0.9), rest, 0.0, 3.0, tolerance<4>(1e-9));
    REQUIRE(stays.result.status == Status::ok);
    check_near(stays.result.x, rest, 1e-15);
    // In both directions s is inside the disc where the force is less than friction ...
    for (const double angle : {0.5, -1.2}) {
        const auto askew = run<TestType>(Askew{}, Vec<double, 3>(angle, 0.99, 2), rest, 0.0, 2.0,
                                         tolerance<4>(1e-10));
        REQUIRE(askew.result.status == Status::ok);
        // ... and u solves 2 e - R u = lambda u, lambda = -cos(angle) + sqrt(4 - sin^2).
        const double lambda = -std::cos(angle) + std::sqrt(4 - std::sin(angle) * std::sin(angle));
        CHECK(std::hypot(askew.result.x[2], askew.result.x[3]) == Approx(lambda).epsilon(1e-8));
        const double turned = std::atan2(std::sin(angle), lambda + std::cos(angle));
        CHECK(askew.result.x[2] ==
              Approx(lambda * (0.6 * std::cos(turned) + 0.8 * std::sin(turned))).margin(1e-8));
    }
    // Friction that leads away from rest is not unique.
    CHECK(run<TestType>(Askew{}, Vec<double, 3>(2.0, 0.5, 2), rest, 0.0, 3.0, tolerance<4>(1e-9))
              .result.status == Status::ambiguous);
}

TEMPLATE_TEST_CASE("directions: beside impacts", "[direction]", DormandPrince5, DormandPrince8,
                   Rodas5P) {
    std::mt19937 random(13);
    std::uniform_real_distribution<double> speed(0.5, 3);
    for (int n = 0; n < 6; ++n) {
        const double u = speed(random), v = -speed(random), mu = 0.3 * speed(random), e = 0.4;
        const Vec<double, 6> x0(0.1, 0.0, u, v, 0.5, 0.0);
        const double w = std::hypot(u, v), T = w / mu;
        const auto r = run<TestType>(PuckBetweenWalls{}, Vec<double, 2>(mu, e), x0, 0.0, T + 8,
                                     tolerance<6>(1e-9));
        CAPTURE(n, u, v, mu, words(r));
        REQUIRE(r.result.status == Status::ok);
        // Unfolded at the walls its path is straight.
        double x = std::fmod(0.1 + u * T / 2 + 1, 4.0);
        x = x < 2 ? x - 1 : 3 - x;
        check_near(r.result.x, Vec<double, 6>(x, v * T / 2, 0, 0, 0, 0), 1e-7);
        CHECK(r.times(EventKind::enter_sliding).size() == 1);
        CHECK(r.times(EventKind::enter_sliding)[0] == Approx(T).margin(1e-8));
        // the ball rests after 1 + 2 e/(1 - e) falls from its height
        REQUIRE(r.times(EventKind::accumulation).size() == 1);
        CHECK(r.times(EventKind::accumulation)[0] ==
              Approx((1 + 2 * e / (1 - e)) * std::sqrt(2 * 0.5)).margin(1e-7));
    }
}
