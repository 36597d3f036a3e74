// SPDX-License-Identifier: BSD-3-Clause
// Hard cases of jumps: bounces that accumulate, what a jump may lead to, contact with a floor that
// rests or moves: H14, H30, H31, and H4 where a floor moves.
#include "hard.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/models/impacts.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace filippov;
using enum EventKind;

namespace {

/// A point that falls onto a floor and is thrown by what the test says.
struct Thrown {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    double floor_speed = 0; ///< speed after the floor, beside -x[1]/2
    double wall = 1e9;      ///< a second surface at this height
    int rule = 0;           ///< 0: as said; 1: into the floor; 2: nowhere; 3: nothing; 4: onto the
                            ///< wall; 5: walls that throw to each other

    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], S(wall) - x[0]};
    }
    template <Scalar S>
    Vec<S, 2> jump(int j, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        if (j == 1)
            return {rule == 5 ? S(0) : S(x[0]), rule == 5 ? S(-1) : S(x[1] * S(-0.5))};
        switch (rule) {
        case 1:
            return {S(-1), x[1]};
        case 2:
            return {x[0] / S(0), x[1]};
        case 3:
            return x;
        case 4:
            return {S(wall), S(1)};
        case 5:
            return {S(wall), S(1)};
        default:
            return {x[0], x[1] * S(-0.5) + S(floor_speed)};
        }
    }
};

/// Two balls on one floor.
struct TwoBalls {
    static constexpr int dim = 4;
    static constexpr int surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    double second = 0.5; ///< restitution of the second; that of the first is 0.5
    template <Scalar S> Vec<S, 4> f(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[1], S(-2), x[3], S(-2)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[0], x[2]};
    }
    template <Scalar S> Vec<S, 4> jump(int j, const S&, Vec<S, 4> x, const Vec<S, 0>&) const {
        x[2 * j + 1] *= S(j == 0 ? -0.5 : -second);
        return x;
    }
};

/// A ball, x'' = -2, on a floor anywhere.
struct HighFloor {
    static constexpr int dim = 2;
    static constexpr std::array kinds{SurfaceKind::jump};
    double floor = 0, e = 0.5;
    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-2)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x[0] - S(floor);
    }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], x[1] * S(-e)};
    }
};

/// A ball, x'' = -2, that is kicked up with speed 1 where it hits the floor more slowly than
/// `slow`.
struct Kicked {
    static constexpr int dim = 2;
    static constexpr std::array kinds{SurfaceKind::jump};
    double slow = 0;
    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-2)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[0]; }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], -x[1] > S(slow) ? S(x[1] * S(-0.5)) : S(1)};
    }
};

/// x' = q(t) - sign x, where q is a constant and two waves; as further components, as many as
/// there are: one that dies out, and the time.
template <int n> struct Driven {
    static constexpr int dim = n;
    double mean, a, omega, phase, b, rate;

    template <Scalar S> Vec<S, n> side(const S& t, const Vec<S, n>& x, double push) const {
        using std::cos;
        Vec<S, n> f;
        f[0] = S(mean + push) + S(a) * cos(S(omega) * t + S(phase)) + S(b) * cos(S(rate) * t);
        if constexpr (n > 1)
            f[1] = S(-1) * x[1];
        if constexpr (n > 2)
            f[2] = S(1);
        return f;
    }
    template <Scalar S> Vec<S, n> f1(const S& t, const Vec<S, n>& x, const Vec<S, 0>&) const {
        return side(t, x, 1);
    }
    template <Scalar S> Vec<S, n> f2(const S& t, const Vec<S, n>& x, const Vec<S, 0>&) const {
        return side(t, x, -1);
    }
    template <Scalar S> S h(const S&, const Vec<S, n>& x, const Vec<S, 0>&) const { return x[0]; }
};

} // namespace

// --- accumulation --------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H14: bounces that accumulate end in rest, in a bounded number of events",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const double e = GENERATE(0.01, 0.3, 0.7, 0.95);
    const double tol = GENERATE(1e-3, 1e-7, 1e-13);
    const auto r = follow<TestType>(models::BouncingBall{}, {9.8, e}, V2(1, 0.5), 60,
                                    bounded<2>(tol, 100'000, 2'000));
    INFO("e = " << e << ", tolerance " << tol);
    CHECK(r.result.status == Status::ok);
    const double t1 = (0.5 + std::sqrt(0.25 + 2 * 9.8)) / 9.8;
    const double v1 = std::sqrt(0.25 + 2 * 9.8);
    const auto limit = r.times(accumulation);
    REQUIRE(limit.size() == 1);
    // Each bounce is an ulp of t < 32 off, its speed g times that, and with it the time that is
    // left.
    const double left = 2 * e / (1 - e);
    const double rounding = double(r.events.size()) * 16 * eps * (1 + left);
    CHECK(limit[0] == Approx(t1 + 2 * e * v1 / (9.8 * (1 - e))).epsilon(0).margin(tol + rounding));
    CHECK(r.result.x[0] == 0);
    CHECK(r.result.x[1] == 0);
    CHECK(r.result.mode[0] == 0);
}

TEMPLATE_TEST_CASE("H14: bounces on a floor far from zero end where they end on one at zero",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // Their last ones are lower than the rounding of x - floor, and take their time none the less.
    const double floor = GENERATE(1.0, -3.0, 1e3, 1e6);
    const double e = GENERATE(0.1, 0.5, 0.9);
    const double tol = GENERATE(1e-4, 1e-8, 1e-12);
    const auto r = follow<TestType>(HighFloor{floor, e}, {}, V2(floor + 1, 0), 60, bounded<2>(tol));
    INFO("floor " << floor << ", e " << e << ", tolerance " << tol);
    CHECK(r.result.status == Status::ok);
    const auto limit = r.times(accumulation);
    REQUIRE(limit.size() == 1);
    // falls in 1 with speed 2; the last bounce that is seen is 16 eps floor high, and its time off
    // by an ulp of its place over its speed
    const double rounding = std::sqrt(eps * std::abs(floor)) / 8 / (1 - e);
    CHECK(limit[0] == Approx(1 + 2 * e / (1 - e)).epsilon(0).margin(1e-10 + rounding));
    CHECK(r.result.x[0] == floor);
    CHECK(r.result.x[1] == 0);
    CHECK(r.result.mode[0] == 0);
}

TEMPLATE_TEST_CASE("H14: without gravity nothing accumulates, and an elastic ball bounces on",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const auto flown =
        follow<TestType>(models::BouncingBall{}, {0.0, 0.5}, V2(1, -1), 10, bounded<2>(1e-9));
    CHECK(word(flown) == "jump");
    CHECK(flown.result.x[0] == Approx(4.5).epsilon(1e-12));
    // every flight lasts 2 sqrt(2 x0/g): five times 0.9035... in ten units of time
    const auto elastic =
        follow<TestType>(models::BouncingBall{}, {9.8, 1.0}, V2(1, 0), 10, bounded<2>(1e-9));
    CHECK(elastic.times(jump).size() == 11);
    CHECK(elastic.times(accumulation).empty());
    const double energy = 9.8 * elastic.result.x[0] + elastic.result.x[1] * elastic.result.x[1] / 2;
    CHECK(energy == Approx(9.8).epsilon(1e-7)); // eleven events of relative errors 1e-9
}

TEMPLATE_TEST_CASE("H14: bounces so weak that nothing but their ratio is left are followed",
                   "[hard]", DormandPrince5, DormandPrince8) {
    for (const double g : {1e-14, 1e-24, 1e14}) {
        INFO("g = " << g);
        auto settings = bounded<2>(1e-9, 100'000, 2'000);
        settings.atol = AbsoluteTolerance<double, 2>(0.0);
        const double t1 = std::sqrt(2 / g);
        const auto r =
            follow<TestType>(models::BouncingBall{}, {g, 0.5}, V2(1, 0), 4 * t1, settings);
        CHECK(r.result.status == Status::ok);
        const auto limit = r.times(accumulation);
        REQUIRE(limit.size() == 1);
        CHECK(limit[0] == Approx(3 * t1).epsilon(1e-8));
        CHECK(r.result.mode[0] == 0);
    }
    // an impact that takes all of the speed but rounding
    const auto r =
        follow<TestType>(models::BouncingBall{}, {2, 1e-20}, V2(1, 0), 3, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.mode[0] == 0);
    CHECK(r.result.counters.events <= 5);
}

TEMPLATE_TEST_CASE("H14: two balls come to rest at one time, or one after the other", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // flights from speed u last u: from a height of 1 all ends at 1 + 2 e/(1 - e)
    const Vec<double, 4> x0(1, 0, 1, 0);
    auto r = follow<TestType>(TwoBalls{}, {}, x0, 4, bounded<4>(1e-9));
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.mode == Mode<2>{{0, 0}});
    for (const double t : r.times(accumulation))
        CHECK(t == Approx(3).epsilon(1e-8));
    r = follow<TestType>(TwoBalls{0.7}, {}, x0, 7, bounded<4>(1e-9));
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.mode == Mode<2>{{0, 0}});
    const auto limits = r.times(accumulation);
    REQUIRE(limits.size() == 2);
    CHECK(limits[0] == Approx(3).epsilon(1e-8));
    CHECK(limits[1] == Approx(1 + 1.4 / 0.3).epsilon(1e-8));
}

TEMPLATE_TEST_CASE("H14: bounces that shrink and then do not are no accumulation", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // Flights last 1, 1/2, ..., until one ends more slowly than `slow`: 2 - 2^-k from kick to kick.
    const double slow = GENERATE(1e-2, 1e-6, 1e-8);
    const double tol = GENERATE(1e-4, 1e-9);
    const auto r = follow<TestType>(Kicked{slow}, {}, V2(0, 1), 9.5, bounded<2>(tol));
    INFO("slow " << slow << ", tolerance " << tol);
    CHECK(r.result.status == Status::ok);
    CHECK(r.times(accumulation).empty());
    const int k = int(std::ceil(std::log2(1 / slow)));
    const double cycle = 2 - std::ldexp(1.0, -k);
    int kicks = 0;
    for (const auto& e : r.events)
        if (e.kind == jump && e.x_right[1] == 1) {
            ++kicks;
            CHECK(e.t == Approx(kicks * cycle).epsilon(0).margin(1e-11 + 10 * tol));
        }
    CHECK(kicks == 4);
}

TEMPLATE_TEST_CASE("H14: events that by chance come ever sooner are no accumulation", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // At each event x is 0, so that the states say nothing. Zeros of a sum of waves do not
    // accumulate; where the time is a component it is plain that they do not.
    std::mt19937_64 bits(14);
    const auto random = [&](double low, double high) {
        return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53);
    };
    int events = 0;
    for (int i = 0; i < 300; ++i) {
        const double mean = random(-0.5, 0.5), a = random(0.3, 2), omega = std::exp(random(-1, 3)),
                     phase = random(0, 6), b = random(0.3, 2), rate = std::exp(random(-1, 4));
        const auto run = [&]<int n>(const Driven<n>& sys, const Vec<double, n>& x0) {
            const auto r = follow<TestType>(sys, {}, x0, 60, bounded<n>(1e-8));
            REQUIRE(r.result.status == Status::ok);
            CHECK(r.times(accumulation).empty());
            return r;
        };
        CAPTURE(i, mean, a, omega, phase, b, rate);
        const double x0 = random(-1, 1);
        const auto alone = run(Driven<1>{mean, a, omega, phase, b, rate}, Vec<double, 1>(x0));
        const auto beside = run(Driven<2>{mean, a, omega, phase, b, rate}, V2(x0, 1));
        const auto timed = run(Driven<3>{mean, a, omega, phase, b, rate}, Vec<double, 3>(x0, 1, 0));
        CHECK(alone.events.size() == timed.events.size());
        CHECK(beside.events.size() == timed.events.size());
        CHECK(alone.result.x[0] == Approx(timed.result.x[0]).epsilon(0).margin(1e-5));
        events += int(alone.events.size());
    }
    CHECK(events > 10'000);
}

// --- jumps ---------------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H30: a jump onto another surface is judged again, at most a hundred times",
                   "[hard]", DormandPrince5, DormandPrince8) {
    Thrown sys;
    sys.rule = 4; // from the floor onto the wall, against it: thrown back at once
    sys.wall = 2;
    auto r = follow<TestType>(sys, {}, V2(0.5, 0), 1.5, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "jump jump");
    CHECK(r.events[1].surface == 0);
    CHECK(r.events[2].surface == 1);
    CHECK(r.events[1].t == r.events[2].t);
    CHECK(r.events[2].x_right == V2(2, -0.5));
    sys.rule = 5; // thrown to and fro
    r = follow<TestType>(sys, {}, V2(0.5, 0), 1.5, bounded<2>(1e-9));
    CHECK(r.result.status == Status::jump_cascade);
    CHECK(r.result.t == Approx(1).epsilon(1e-9));
    CHECK(r.result.counters.events <= 101);
}

namespace {

/// A clock that fires at 1, sets itself back and kicks a second component, which moves at a rate of
/// its own and comes down by `drop` where it is at its limit or beyond.
struct Kicking {
    static constexpr int dim = 2, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    double rate = 0, kick = 1, limit = 1, drop = 1;
    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(1), S(rate)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(1) - x[0], S(limit) - x[1]};
    }
    template <Scalar S>
    Vec<S, 2> jump(int j, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return j == 0 ? Vec<S, 2>(S(0), x[1] + S(kick)) : Vec<S, 2>(x[0], x[1] - S(drop));
    }
};

/// A field that depends on the side of x = 0, below a wall at y = 4 that puts y back to 1/2.
struct Walled {
    static constexpr int dim = 2, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::switching, SurfaceKind::jump};
    double left = 1, right = 3; ///< x' on the two sides; there y' is -1 and 2
    template <Scalar S>
    Vec<S, 2> region(const S&, const Vec<S, 2>&, const Mode<2>& side, const Vec<S, 0>&) const {
        return side[0] < 0 ? Vec<S, 2>(S(left), S(-1)) : Vec<S, 2>(S(right), S(2));
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], S(4) - x[1]};
    }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], S(0.5)};
    }
};

} // namespace

TEMPLATE_TEST_CASE("H30: what a jump throws beyond a surface jumps there once", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto run = [](const Kicking& sys, double y, double t) {
        return follow<TestType>(sys, {}, V2(0, y), t, bounded<2>(1e-9));
    };
    for (const double rate : {0.1, -0.1, 0.0}) {
        CAPTURE(rate);
        const auto r = run({rate}, 0.7, 1.5);
        REQUIRE(r.result.status == Status::ok);
        CHECK(word(r) == "jump jump");
        CHECK(r.result.x[1] == Approx(0.7 + 1.5 * rate).epsilon(1e-9));
    }
    const auto counter = run({0, 4, 1.5, 4}, 0, 1.5); // a burst of four
    CHECK(word(counter) == "jump jump");
    CHECK(counter.result.x[1] == 0);
    // still beyond
    const auto twice = run({0.25, 1.5, 1, 0.75}, 0.5, 1.5);
    CHECK(twice.result.status == Status::escaped);
}

TEMPLATE_TEST_CASE("H30: a counter that a jump puts on its limit is at it", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const Kicking sys{0, 1, 3, 3};
    auto r = follow<TestType>(sys, {}, V2(0, 0), 7.5, bounded<2>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    CHECK(word(r) == "jump jump jump jump jump jump jump jump jump");
    CHECK(r.result.x[1] == 1);
    r = follow<TestType>(sys, {}, V2(0.25, 3), 0.5, bounded<2>(1e-9)); // as at a start
    CHECK(word(r) == "jump");
    CHECK(r.result.x[1] == 0);
}

TEMPLATE_TEST_CASE("H30: a start on a wall and a surface jumps where the solution leads into it",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const auto at = follow<TestType>(Walled{}, {}, V2(0, 4), 1, bounded<2>(1e-9));
    CHECK(word(at) == "jump");
    CHECK(at.result.x[0] == Approx(3).epsilon(1e-9));
    CHECK(at.result.x[1] == Approx(2.5).epsilon(1e-9));
    const auto beside = follow<TestType>(Walled{}, {}, V2(1e-9, 4), 1, bounded<2>(1e-9));
    CHECK(word(beside) == "jump");
    CHECK(beside.result.x[1] == Approx(2.5).epsilon(1e-9));
    // x = 0 holds it, where y' = 5/4 leads into the wall
    const auto held = follow<TestType>(Walled{3, -1}, {}, V2(0, 4), 1, bounded<2>(1e-9));
    REQUIRE(held.result.status == Status::ok);
    CHECK(held.result.x[0] == 0);
    CHECK(held.result.x[1] == Approx(1.75).epsilon(1e-9));
    // both lead away from the wall
    const auto down = follow<TestType>(Walled{-1, -1}, {}, V2(0, 4), 1, bounded<2>(1e-9));
    CHECK(down.result.x[1] == Approx(3).epsilon(1e-9));
}

TEMPLATE_TEST_CASE("H30: a jump in the last instant has happened", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const auto r =
        follow<TestType>(models::BouncingBall{}, {2, 0.5}, V2(1, 0), 1, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.t == 1);
    REQUIRE(word(r) == "jump");
    CHECK(r.events[1].t == Approx(1).epsilon(1e-15));
    CHECK(r.result.x[1] == Approx(1).epsilon(1e-15));
    CHECK(r.events.back().x_left == r.result.x);
    // a trajectory keeps both states, each with its piece; at the event it has the one before
    const auto kept =
        simulate<TestType>(models::BouncingBall{}, {2, 0.5}, V2(1, 0), 0, 1, bounded<2>(1e-9));
    CHECK(kept.pieces.size() + 1 == kept.t.size());
    CHECK(kept.x.back() == kept.result.x);
    CHECK(kept(kept.events[1].t)[1] == Approx(-2).epsilon(1e-9));
}

TEMPLATE_TEST_CASE("H30: a jump that leads nowhere is refused with its reason", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto end = [](int rule) {
        Thrown sys;
        sys.rule = rule;
        return follow<TestType>(sys, {}, V2(0.5, 0), 3, bounded<2>(1e-9)).result;
    };
    CHECK(end(1).status == Status::escaped);
    CHECK(end(1).diagnosis.what == "the jump leads beyond its surface");
    CHECK(end(2).status == Status::not_finite);
    CHECK(end(2).diagnosis.what == "jump");
    CHECK(end(3).status == Status::jump_cascade);
    CHECK(end(3).diagnosis.what == "the jump here changes nothing");
    for (const int rule : {1, 2, 3}) {
        CHECK(end(rule).t == Approx(1).epsilon(1e-9));
        CHECK(std::abs(end(rule).x[0]) < 1e-9); // the last good state
    }
    // a start beyond the surface has no meaning
    const auto r = follow<TestType>(Thrown{}, {}, V2(-0.5, 0), 3, bounded<2>(1e-9));
    CHECK(r.result.status == Status::escaped);
    CHECK(r.result.t == 0);
}

TEMPLATE_TEST_CASE("H30: a jump is not undone backwards in time", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // nobody knows which speed before became this one after: x = 1 + t - t^2 was thrown at the
    // negative root, at whatever speed
    for (const NonUnique policy : {NonUnique::stop, NonUnique::below, NonUnique::stay}) {
        auto settings = bounded<2>(1e-9);
        settings.on_nonunique = policy;
        const auto r = flow<TestType>(HighFloor{}, Vec<double, 0>(), V2(1, 1), 0.0, -3.0, settings);
        CHECK(r.status == Status::ambiguous);
        CHECK(r.message().find("not undone backwards in time") != std::string::npos);
        CHECK(r.t == Approx((1 - std::sqrt(5.0)) / 2).epsilon(1e-9));
        CHECK(std::abs(r.x[0]) < 1e-12);
    }
}

TEMPLATE_TEST_CASE("H31: contact with zero normal speed rests, without small bounces", "[hard]",
                   DormandPrince5, DormandPrince8) {
    for (const double v : {0.0, 1e-18, -1e-18}) {
        const auto r =
            follow<TestType>(models::BouncingBall{}, {9.8, 0.9}, V2(0, v), 1, bounded<2>(1e-9));
        CHECK(r.result.status == Status::ok);
        CHECK(r.result.counters.events <= 400);
        CHECK(r.result.mode[0] == 0);
        CHECK(r.result.x == V2(0, 0));
    }
    const auto rest =
        follow<TestType>(models::BouncingBall{}, {9.8, 0.9}, V2(0, 0), 1, bounded<2>(1e-9));
    CHECK(word(rest) == "");
    CHECK(rest.events[0].mode_after[0] == 0);
}

namespace {

/// A block on a table that shakes: x'' = -1 + 2 sin t seen from the table, x >= 0; contact lets go
/// where 2 sin t = 1.
struct Shaken {
    static constexpr int dim = 2;
    static constexpr std::array kinds{SurfaceKind::jump};
    template <Scalar S> Vec<S, 2> f(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        using std::sin;
        return {x[1], S(-1) + S(2) * sin(t)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[0]; }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], x[1] * S(-0.25)};
    }
};

} // namespace

TEMPLATE_TEST_CASE("H31: contact lets go where its force vanishes, and comes back", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto r = follow<TestType>(Shaken{}, {}, V2(0, 0), 9, bounded<2>(1e-11));
    CHECK(r.result.status == Status::ok);
    REQUIRE(r.events.size() > 5);
    CHECK(r.events[0].mode_after[0] == 0);
    CHECK(r.events[1].kind == exit_sliding);
    CHECK(r.events[1].t == Approx(pi / 6).epsilon(1e-12));
    // x = -(t - t0)^2/2 - 2 (sin t - sin t0) + 2 (t - t0) cos t0 in flight
    CHECK(r.events[2].kind == jump);
    const double t0 = pi / 6, t = r.events[2].t, u = t - t0;
    CHECK(-u * u / 2 - 2 * (std::sin(t) - 0.5) + 2 * u * std::cos(t0) == Approx(0).margin(1e-10));
    CHECK(r.events[2].x_right[1] == Approx(-0.25 * r.events[2].x_left[1]).epsilon(1e-15));
    // it comes to rest again before the table lets it go the next time
    CHECK(r.times(accumulation).size() == 1);
    const auto exits = r.times(exit_sliding);
    REQUIRE(exits.size() == 2);
    CHECK(exits[1] == Approx(2 * pi + pi / 6).epsilon(1e-12));
}

namespace {

/// A block on a table that shakes ever faster until t = 1: it rests, hops, and rests again, each
/// time about r = exp(-2 pi/12) as long as before. What comes down is thrown by the rounding of its
/// speed.
struct ShakenFaster {
    static constexpr int dim = 2;
    static constexpr std::array kinds{SurfaceKind::jump};
    double thrown = 0;
    template <Scalar S> static S push(const S& t) {
        using std::log;
        using std::sin;
        return sin(S(-6) * log((S(1) - t) * (S(1) - t) + S(nearest))) - S(0.75);
    }
    template <Scalar S> Vec<S, 2> f(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], push(t)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[0]; }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], S(thrown) * x[1]};
    }
    static constexpr double nearest = 0.0025;
    /// Where it takes off for the k-th time.
    static double takes_off(double k) {
        return 1 - std::sqrt(std::exp(-(std::asin(0.75) + 2 * pi * k) / 6) - nearest);
    }
    /// Height at t after it took off.
    static double height(double off, double t) {
        return simpson([&](double s) { return (t - s) * push(s); }, off, t, 2000);
    }
};

} // namespace

TEMPLATE_TEST_CASE("H14: rests between hops that grow shorter are no bounces", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // Each rest lasts as long as the mean of the hops beside it: times of four events in a row are
    // like those of bounces.
    for (const double thrown : {0.0, -1e-18, -1e-16}) {
        INFO("thrown by " << thrown);
        const auto r = follow<TestType>(ShakenFaster{thrown}, {}, V2(0, 0), 1.3, bounded<2>(1e-10));
        CHECK(r.result.status == Status::ok);
        CHECK(r.times(accumulation).empty());
        const auto exits = r.times(exit_sliding), landings = r.times(jump);
        REQUIRE(exits.size() > 5);
        REQUIRE(landings.size() > 5);
        for (std::size_t k = 0; k < 6; ++k) {
            CHECK(exits[k] == Approx(ShakenFaster::takes_off(double(k))).epsilon(1e-9));
            CHECK(ShakenFaster::height(exits[k], landings[k]) == Approx(0).margin(1e-8));
        }
    }
}

namespace {

/// A ball on a table that moves as A sin(omega t): z'' = -g, and h is the small difference of two
/// large terms. T is the period, or 0 for absolute time.
struct Table {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 5> params{"g", "e", "A", "omega", "T"};
    static constexpr std::array kinds{SurfaceKind::jump};

    template <Scalar S> Vec<S, 2> f(const S&, const Vec<S, 2>& x, const Vec<S, 5>& p) const {
        return {x[1], -p[0]};
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 5>& p) const {
        using std::sin;
        return x[0] - p[2] * sin(p[3] * t);
    }
    template <Scalar S>
    Vec<S, 2> jump(int, const S& t, const Vec<S, 2>& x, const Vec<S, 5>& p) const {
        using std::cos;
        return {x[0], -p[1] * x[1] + (S(1) + p[1]) * p[2] * p[3] * cos(p[3] * t)};
    }
    template <Scalar S> S period(const Vec<S, 5>& p) const { return p[4]; }

    static Vec<double, 5> with(double e, double A, bool periodic) {
        Vec<double, 5> p;
        p << 9.81, e, A, 10, periodic ? 2 * pi / 10 : 0.0;
        return p;
    }
    /// h after a flight of this length from (t, x), and its rate.
    static V2 flown(double dt, double t, const V2& x, const Vec<double, 5>& p) {
        return {x[0] + dt * (x[1] - p[0] * dt / 2) - p[2] * std::sin(p[3] * (t + dt)),
                x[1] - p[0] * dt - p[2] * p[3] * std::cos(p[3] * (t + dt))};
    }
};
constexpr std::array table_amplitudes{0.0983, 0.1037, 0.12, 0.13, 0.145, 0.16, 0.178, 0.2};

} // namespace

TEMPLATE_TEST_CASE("H31: events on a moving table are on it at their own time", "[hard]",
                   DormandPrince5, DormandPrince8) {
    for (const bool periodic : {false, true}) {
        const auto p = Table::with(0.8, 0.12, periodic);
        const auto r = run<TestType>(Table{}, p, V2(0.3, 0), 0, 30, bounded<2>(1e-9, 200'000));
        for (const auto& e : r.events) {
            if (e.kind != jump && e.kind != exit_sliding)
                continue;
            const V2 h = Table::flown(0, e.t_local, e.x_left, p);
            CHECK(std::abs(h[0]) <= 0.12 * eps); // an ulp of z, not of the time times the speed
            if (e.kind == exit_sliding)
                CHECK(std::abs(h[1]) <= 4 * 1.2 * eps);
        }
    }
}

TEMPLATE_TEST_CASE("H31: a moving table lets go in one way", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // Its acceleration vanishes there, and the speed is rounding.
    for (const double A : table_amplitudes)
        for (const bool periodic : {false, true}) {
            INFO("A = " << A << ", periodic " << periodic);
            const auto r = run<TestType>(Table{}, Table::with(0.2, A, periodic), V2(0.3, 0), 0, 30,
                                         bounded<2>(1e-6, 200'000));
            CHECK(r.result.status != Status::ambiguous);
        }
}

TEMPLATE_TEST_CASE("H31: where a moving table lets go nothing grazes", "[hard]", DormandPrince5,
                   DormandPrince8) {
    for (const double A : table_amplitudes)
        for (const double tol : {1e-9, 1e-12}) {
            INFO("A = " << A << ", tolerance " << tol);
            const auto r = run<TestType>(Table{}, Table::with(0.2, A, true), V2(0.3, 0), 0, 20,
                                         bounded<2>(tol, 200'000));
            CHECK(r.times(exit_sliding).size() > 0);
            CHECK(r.times(graze).size() == 0); // the next contact comes long after each take-off
        }
}

TEMPLATE_TEST_CASE("H4: the first of three meetings with a moving table in one long step", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // Thrown up at 1 cm/s it meets the table within a hundredth of the time of its second return,
    // and of a thousandth of a step that ends 300 m below.
    const auto p = Table::with(0.8, 0.12, false);
    const double t = 0.0646, speed = GENERATE(0.003, 0.01, 0.016);
    const V2 x(0.12 * std::sin(10 * t), 1.2 * std::cos(10 * t) + speed);
    double low = 1e-4, high = 0.02;
    REQUIRE(Table::flown(low, t, x, p)[0] > 0);
    REQUIRE(Table::flown(high, t, x, p)[0] < 0);
    for (int k = 0; k < 60; ++k) {
        const double middle = (low + high) / 2;
        (Table::flown(middle, t, x, p)[0] > 0 ? low : high) = middle;
    }
    auto settings = bounded<2>(1e-9);
    settings.first_step = GENERATE(0.3, 0.7, 2.0, 7.5);
    const auto r = run<TestType>(Table{}, p, x, t, 10, settings);
    INFO("speed " << speed << ", step " << settings.first_step);
    REQUIRE(r.events.size() > 2);
    CHECK(r.events[1].kind == jump);
    CHECK(r.events[1].t - t == Approx(low).margin(1e-12));
}

TEMPLATE_TEST_CASE("H31: a ball is carried by a moving table, leaves it and comes back", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    for (const double A : table_amplitudes)
        for (const double e : {0.2, 0.5, 0.8})
            for (const bool periodic : {false, true}) {
                INFO("A = " << A << ", e = " << e << ", periodic " << periodic);
                const auto p = Table::with(e, A, periodic);
                const auto r = follow<TestType>(Table{}, p, V2(0.3, 0), 12, bounded<2>(tol));
                CHECK(r.result.status == Status::ok);
                const double take_off = std::asin(9.81 / (A * 100)) / 10, T = 2 * pi / 10;
                for (std::size_t k = 1; k + 1 < r.events.size(); ++k) {
                    const auto &from = r.events[k - 1], &to = r.events[k];
                    if (to.kind == exit_sliding) // h'' = 0: an ulp of t off, and some of h''/h'''
                        CHECK(std::abs(std::remainder(to.t - take_off, T)) < 1e-13);
                    if (to.kind != jump || from.mode_after[0] == 0)
                        continue;
                    // The parabola is exact, and meets the table first where the run does.
                    const double flight = to.t - from.t;
                    const V2 h = Table::flown(flight, from.t, from.x_right, p);
                    CHECK(std::abs(h[0]) < 1e-12);
                    CHECK(to.x_left[1] == Approx(from.x_right[1] - 9.81 * flight).margin(1e-12));
                    double lowest = 0;
                    for (int i = 1; i < 64; ++i)
                        lowest = std::min(
                            lowest, Table::flown(flight * i / 64, from.t, from.x_right, p)[0]);
                    CHECK(lowest > -1e-12 - tol);
                }
            }
}

TEMPLATE_TEST_CASE("H4: errors of a method's first stages are no swings", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // 80 times the ball is let go, bounces about 25 times and is carried again.
    const auto r =
        run<TestType>(Table{}, Table::with(0.5, 0.12, false), V2(0.3, 0), 0, 50, bounded<2>(1e-12));
    CHECK(r.result.counters.steps < 12'000);
}
