// SPDX-License-Identifier: BSD-3-Clause
// Two bodies on two floors, in contact or not at the same time: what one does is not seen in what
// becomes of the other, whatever the units, the method and its steps; and one on the other, where
// it is. A pressed body takes off where its force vanishes and lands where an antiderivative says.
#include "hard.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

using namespace filippov;
using enum EventKind;

namespace {

/// y'' = push cos(rate t + phase) - weight above a floor at `floor` + sway cos(sway_rate t), thrown
/// back with e.
struct Body {
    double push = 0, rate = 1, phase = 0, weight = 1, floor = 0, sway = 0, sway_rate = 1, e = 0;

    template <class S> S force(const S& t) const {
        using std::cos;
        return S(push) * cos(S(rate) * t + S(phase)) - S(weight);
    }
    template <class S> S height(const S& t) const {
        using std::cos;
        return S(floor) + S(sway) * cos(S(sway_rate) * t);
    }
    template <class S> S speed(const S& t) const {
        using std::sin;
        return S(-sway * sway_rate) * sin(S(sway_rate) * t);
    }

    // --- of one on a floor that rests ----------------------------------------------------------

    /// Where it takes off next, after t.
    double take_off(double t) const {
        const double at = -std::acos(weight / push) - phase; // the force vanishes and grows
        const double turns = std::ceil((rate * t - at) / (2 * pi));
        return (at + 2 * pi * turns) / rate;
    }
    /// Where it comes down after it took off at t.
    double landing(double t) const {
        const double a = rate * t + phase;
        const auto y = [&](double d) { // in units in which nothing cancels more than it must
            return push / (rate * rate) *
                       (2 * std::sin(rate * d / 2) * std::sin(a + rate * d / 2) -
                        rate * d * std::sin(a)) -
                   weight * d * d / 2;
        };
        double low = 0, high = 1e-3 / rate; // (no flight of these tests is as short)
        while (y(high) > 0) {
            low = high;
            high *= 1.02;
        }
        for (int k = 0; k < 200; ++k) {
            const double middle = (low + high) / 2;
            (y(middle) > 0 ? low : high) = middle;
        }
        return t + high;
    }
};

/// Both, in units of `length` and `time`.
struct TwoBodies {
    static constexpr int dim = 4, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    std::array<Body, 2> body{};
    double length = 1, time = 1;

    template <Scalar S> Vec<S, 4> f(const S& t, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        Vec<S, 4> f;
        for (int j = 0; j < 2; ++j) {
            f[2 * j] = x[2 * j + 1];
            f[2 * j + 1] = S(length / (time * time)) * body[j].force(S(t / S(time)));
        }
        return f;
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[0] - S(length) * body[0].height(S(t / S(time))),
                x[2] - S(length) * body[1].height(S(t / S(time)))};
    }
    template <Scalar S>
    Vec<S, 4> jump(int j, const S& t, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        Vec<S, 4> y = x;
        const S floor = S(length / time) * body[std::size_t(j)].speed(S(t / S(time)));
        y[2 * j + 1] = floor - S(body[std::size_t(j)].e) * (x[2 * j + 1] - floor);
        return y;
    }
};

template <class Tableau>
Trajectory<TwoBodies, double> run_bodies(const TwoBodies& sys, const Vec<double, 4>& start,
                                         double t_end, double tol) {
    const Vec<double, 4> unit(sys.length, sys.length / sys.time, sys.length, sys.length / sys.time);
    Settings<double, 4> settings;
    settings.rtol = tol;
    settings.atol = AbsoluteTolerance<double, 4>(Vec<double, 4>(tol * unit));
    return simulate<Tableau>(sys, {}, Vec<double, 4>(start.cwiseProduct(unit)), 0.0,
                             t_end * sys.time, settings);
}

/// Where body 0 is at time 6 if body 1 is out of its way: computed once for each floor and start.
double alone(TwoBodies sys, const Vec<double, 4>& start) {
    static std::map<std::array<double, 3>, double> known;
    const auto [place, is_new] = known.try_emplace({sys.body[0].sway_rate, start[0], start[1]});
    if (is_new) {
        sys.body[1] = {0, 1, 0, 1, 0};
        const Vec<double, 4> other(start[0], start[1], 0, 0);
        place->second = run_bodies<DormandPrince8>(sys, other, 6, 1e-12).result.x[0];
    }
    return place->second;
}

/// Take-offs and landings of body j, that does not bounce, are where they are to be, all of them.
template <class Run>
void check_flights(const TwoBodies& sys, const Run& r, int j, double from, double t_end,
                   double off) {
    CHECK(r.result.status == Status::ok);
    const Body& body = sys.body[std::size_t(j)];
    std::vector<double> up, down;
    for (const auto& e : r.events) {
        CHECK(e.mode_before[j] >= 0); // never beyond its floor
        CHECK(e.mode_after[j] >= 0);
        if (e.t / sys.time > from && e.mode_before[j] != e.mode_after[j])
            (e.mode_after[j] > 0 ? up : down).push_back(e.t / sys.time);
    }
    std::size_t k = 0;
    for (double t = body.take_off(from); t < t_end; t = body.take_off(t + 1e-3 / body.rate), ++k) {
        REQUIRE(k < up.size());
        CHECK(up[k] == Approx(t).margin(1e-12).epsilon(1e-12));
        const double landing = body.landing(t);
        if (landing > t_end)
            break;
        REQUIRE(k < down.size());
        CHECK(std::abs(down[k] - landing) <= off);
    }
}

} // namespace

TEMPLATE_TEST_CASE("contacts: take-offs of two bodies are found in any units", "[contacts]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    // The push is hardly more than the weight: both fly for a thirtieth of the time.
    TwoBodies sys;
    sys.body[0] = {0.72199736929080927, 1.3832504556344258, -1.2837491078809129,
                   0.72163367399339629, -0.025406194314436};
    sys.body[1] = {0.82203469198305279, 1.3832504556344258, -0.64485641447649167,
                   0.8217591019375845, 0.14779672517974751};
    sys.length = GENERATE(1e-3, 1.0, 300.0);
    sys.time = GENERATE(1e-3, 1.0, 30.0, 1e4);
    const double tol = GENERATE(1e-6, 1e-9);
    INFO("length " << sys.length << ", time " << sys.time << ", tolerance " << tol);
    const Vec<double, 4> start(sys.body[0].floor + 0.02, -0.6, sys.body[1].floor + 0.01, -0.7);
    const auto r = run_bodies<TestType>(sys, start, 12, tol);
    for (const int j : {0, 1})
        check_flights(sys, r, j, 0.1, 12, 3e-3);
}

TEMPLATE_TEST_CASE("contacts: a low flight ends in time beside the bounces of another body",
                   "[contacts]", DormandPrince5, DormandPrince8, Rodas5P) {
    // A step in which both come down: its interpolant has the low flight end behind the bounce, or
    // at once, and the error of either is nothing to the state.
    TwoBodies sys;
    const double tol = GENERATE(1e-4, 1e-6, 1e-8, 1e-10);
    INFO("tolerance " << tol);
    SECTION("a bounce cuts the flight") {
        sys.body[0] = {0, 1, 0, 0.61971951939491721, 0.38946164157267338, 0.003, 14.547, 0.462};
        sys.body[1] = {0.77949260739586002, 48.286261002914671, -1.1540398588164917,
                       0.77757641221365792, 0.22442917299543075};
    }
    SECTION("a flight hides an impact") {
        sys.body[0] = {0, 1, 0, 0.68300314119765693, -0.33620644467980842, 0.0063, 12.51, 0.456};
        sys.body[1] = {0.97958067539806104, 12.512653791679673, 1.2580114655083214,
                       0.97815106320138545, -0.37854649539623664};
    }
    for (const double fall : {-0.3, -0.6, -0.9, -0.95, -1.0, -1.1}) {
        INFO("fall " << fall);
        const Vec<double, 4> start(sys.body[0].floor + 0.28, fall, sys.body[1].floor + 0.0014,
                                   -0.28);
        const auto r = run_bodies<TestType>(sys, start, 6, tol);
        // (it comes down at 2e-5: what is nothing to its height is much to that time)
        check_flights(sys, r, 1, 0.05, 6, std::min(100 * tol + 1e-6, 5e-3));
        CHECK(std::abs(r.result.x[0] - alone(sys, start)) <= 1e4 * tol);
    }
}

TEMPLATE_TEST_CASE("contacts: bounces lost in rounding let others rest", "[contacts]",
                   DormandPrince5, DormandPrince8) {
    TwoBodies sys;
    sys.body[0] = {0, 1, 0, 0.80852871662747394, -0.23238863658194303, 0.0015, 16.5, 0.282};
    sys.body[1] = {0, 1, 0, 0.5, 0.01, 0, 1, 0};
    const double tol = GENERATE(1e-6, 1e-8, 1e-10);
    const auto r = run_bodies<TestType>(sys, Vec<double, 4>(-0.1, -1.1, 0.02, 0), 2, tol);
    CHECK(r.result.status == Status::ok);
    int rests = 0;
    for (const auto& e : r.events) {
        rests += e.kind == accumulation;
        if (e.t > 0.3) // body 1 has come down long before
            CHECK(e.mode_after[1] == 0);
    }
    CHECK(rests > 0);
}

namespace {

/// Three bodies, each on the one below, on a floor that sways, the lowest lifted by a force t.
/// Impacts have no restitution.
struct Pile {
    static constexpr int dim = 6, surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump, SurfaceKind::jump};
    std::array<double, 3> mass{};
    double sway = 0;

    template <Scalar S>
    Vec<S, 6> field(const S& t, const Vec<S, 6>& x, const Vec<S, 3>&, const Vec<S, 0>&) const {
        Vec<S, 6> f;
        f << x[3], x[4], x[5], t / S(mass[0]) - S(1), S(-1), S(-1);
        return f;
    }
    template <Scalar S> Vec<S, 3> h(const S& t, const Vec<S, 6>& x, const Vec<S, 0>&) const {
        using elementary::sin;
        return {x[0] - S(sway) * S(sin(t)), x[1] - x[0] - S(1), x[2] - x[1] - S(1)};
    }
    template <Scalar S>
    Vec<S, 6> jump(int j, const S& t, const Vec<S, 6>& x, const Vec<S, 0>&) const {
        using elementary::cos;
        Vec<S, 6> y = x;
        if (j == 0) {
            y[3] = S(sway) * S(cos(t));
            return y;
        }
        const double lower = mass[std::size_t(j - 1)], upper = mass[std::size_t(j)];
        y[2 + j] = y[3 + j] = (S(lower) * x[2 + j] + S(upper) * x[3 + j]) / S(lower + upper);
        return y;
    }
};

} // namespace

TEMPLATE_TEST_CASE("contacts: a floor carries what is on what stands on it", "[contacts]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const auto& mass :
         {std::array<double, 3>{1, 1, 1}, {1, 2, 3}, {3, 0.5, 1}, {1, 100, 0.01}})
        for (const double sway : {0.0, 0.2}) {
            CAPTURE(mass[0], mass[1], mass[2], sway);
            const double sum = mass[0] + mass[1] + mass[2];
            // what the floor carries vanishes at
            double off = sum;
            for (int k = 0; k < 100; ++k)
                off -= (off - sum * (1 - sway * std::sin(off))) / (1 + sum * sway * std::cos(off));
            if (sway > 0 && sum > 5)
                continue; // (where that may have more roots)
            Vec<double, 6> x;
            x << 0, 1, 2, sway, sway, sway;
            const double end = off + 0.1;
            const auto r =
                run<TestType>(Pile{mass, sway}, Vec<double, 0>{}, x, 0.0, end, tolerance<6>(1e-10));
            INFO(r.result.message());
            REQUIRE(r.result.status == Status::ok);
            REQUIRE(r.times(exit_sliding).size() == 1);
            CHECK(r.times(exit_sliding)[0] == Approx(off).epsilon(1e-9));
            CHECK(r.result.mode == Mode<3>{{1, 0, 0}});
            // y'' = t/sum - 1 from there
            const double height = sway * (std::sin(off) + 0.1 * std::cos(off)) +
                                  0.005 * (off / sum - 1) + 1e-3 / (6 * sum);
            for (int i = 0; i < 3; ++i)
                CHECK(std::abs(r.result.x[i] - i - height) < 1e-7);
        }
}
