// SPDX-License-Identifier: BSD-3-Clause
// Staying at limits of several surfaces, and contacts without a force: tanks that run empty and
// over into each other, an inflow that opens, bodies that fall in contact, rows of touching balls.
// Against closed forms, and against levels that are cut off at their limits in small steps of time.

#include "catch.hpp"
#include "run.hpp"

#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

using namespace filippov;

namespace {

template <class S> S positive(const S& v) { return value_of(v) > 0 ? v : S(0); }

/// A tank with the inflow cos t - 1/2, whose floor is a mode of its own while that is negative.
template <SurfaceKind Kind> struct Tank {
    static constexpr int dim = 2, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::switching, Kind};
    double scale = 1;

    template <class S> static S flow(const S& t) {
        using elementary::cos;
        return S(cos(t)) - S(0.5);
    }
    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        const S q = flow(t), floor = q * (S(1) + s[1]) * S(0.5);
        return {S(0.5) * (q + floor) + s[0] * S(0.5) * (q - floor), S(1)};
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(scale) * x[0], S(scale) * flow(t)};
    }
};

/// Two tanks, beside a clock; the first empties into the second if `into` is 1.
struct TwoTanks {
    static constexpr int dim = 3, surfaces = 2;
    double out = 1, into = 0;

    template <Scalar S>
    Vec<S, 3> field(const S&, const Vec<S, 3>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        const S first = (S(1) + s[0]) * S(0.5), net = S(into) * first - S(out);
        const S floor = positive(net);
        return {-first, S(0.5) * (net + floor) + s[1] * S(0.5) * (net - floor), S(1)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {x[0], x[1]};
    }
};

/// A tank that empties into a second one, and a third beside them.
struct ThreeTanks {
    static constexpr int dim = 3, surfaces = 3;
    template <Scalar S>
    Vec<S, 3> field(const S&, const Vec<S, 3>&, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        const S first = (S(1) + s[0]) * S(0.5), net = first - S(0.5), floor = positive(net);
        return {-first, S(0.5) * (net + floor) + s[1] * S(0.5) * (net - floor),
                S(-0.1) * (S(1) + s[2])};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return x;
    }
};

/// Two tanks between empty and full, with tides of their own; the first runs over into the second,
/// the second into a third that takes all.
struct Tides {
    static constexpr int dim = 3, surfaces = 4;
    std::array<double, 2> a{}, b{}, w{}, phase{}, scale{1, 1};

    template <class S> S flow(int i, const S& t) const {
        using elementary::cos;
        const auto k = std::size_t(i);
        return S(a[k]) * S(cos(S(S(w[k]) * t + S(phase[k])))) + S(b[k]);
    }
    template <Scalar S>
    Vec<S, 3> field(const S& t, const Vec<S, 3>&, const Vec<S, 4>& s, const Vec<S, 0>&) const {
        Vec<S, 3> f;
        S over(0);
        for (int i = 0; i < 2; ++i) {
            const S q = flow(i, t) + over, in = positive(q), out = q - in;
            const S empty = (S(1) - s[2 * i]) * S(0.5), full = (S(1) + s[2 * i + 1]) * S(0.5);
            f[i] = q - empty * out - full * in;
            over = full * in;
        }
        f[2] = over;
        return f;
    }
    template <Scalar S> Vec<S, 4> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {S(scale[0]) * x[0], S(scale[0]) * (x[0] - S(1)), S(scale[1]) * x[1],
                S(scale[1]) * (x[1] - S(1))};
    }

    /// The levels at the end of n steps of time, each cut off at its limits.
    Vec<double, 3> cut_off(Vec<double, 3> x, double t_end, int n) const {
        const auto volume = [&](std::size_t i, double t) {
            return a[i] / w[i] * std::sin(w[i] * t + phase[i]) + b[i] * t;
        };
        for (int k = 0; k < n; ++k) {
            const double t = t_end * k / n, later = t_end * (k + 1) / n;
            double over = 0;
            for (int i = 0; i < 2; ++i) {
                const auto j = std::size_t(i);
                const double level = x[i] + volume(j, later) - volume(j, t) + over;
                over = positive(level - 1);
                x[i] = std::min(1.0, positive(level));
            }
            x[2] += over;
        }
        return x;
    }
};

/// Play: what follows u = sin t when that pushes at either end of a slot of width 1.
struct Play {
    static constexpr int dim = 2, surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::switching, SurfaceKind::switching,
                                      SurfaceKind::kink};
    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>&, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        using elementary::cos;
        const S speed(cos(t)), up = speed * (S(1) + s[2]) * S(0.5), down = speed - up;
        return {speed, (S(1) + s[0]) * S(0.5) * up + (S(1) - s[1]) * S(0.5) * down};
    }
    template <Scalar S> Vec<S, 3> h(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        using elementary::cos;
        return {x[0] - x[1] - S(0.5), x[0] - x[1] + S(0.5), S(cos(t))};
    }
};

/// n balls of diameter 1 in a row, under gravity along it.
template <int n> struct Row {
    static constexpr int dim = 2 * n, surfaces = n - 1;
    static constexpr auto kinds = [] {
        std::array<SurfaceKind, std::size_t(n - 1)> all{};
        all.fill(SurfaceKind::jump);
        return all;
    }();
    double restitution = 1, gravity = 0;
    std::array<double, std::size_t(n)> mass{};

    template <Scalar S>
    Vec<S, 2 * n> field(const S&, const Vec<S, 2 * n>& x, const Vec<S, n - 1>&,
                        const Vec<S, 0>&) const {
        Vec<S, 2 * n> f;
        for (int i = 0; i < n; ++i) {
            f[i] = x[n + i];
            f[n + i] = S(-gravity);
        }
        return f;
    }
    template <Scalar S> Vec<S, n - 1> h(const S&, const Vec<S, 2 * n>& x, const Vec<S, 0>&) const {
        Vec<S, n - 1> gap;
        for (int i = 0; i + 1 < n; ++i)
            gap[i] = x[i + 1] - x[i] - S(1);
        return gap;
    }
    template <Scalar S>
    Vec<S, 2 * n> jump(int j, const S&, const Vec<S, 2 * n>& x, const Vec<S, 0>&) const {
        const auto k = std::size_t(j);
        const double sum = mass[k] + mass[k + 1];
        const S closing = S(1 + restitution) * (x[n + j] - x[n + j + 1]);
        Vec<S, 2 * n> y = x;
        y[n + j] -= S(mass[k + 1] / sum) * closing;
        y[n + j + 1] += S(mass[k] / sum) * closing;
        return y;
    }
};

/// Two bodies in contact that fall through air, the upper one with more drag, or less.
struct Drag {
    static constexpr int dim = 4, surfaces = 1;
    static constexpr std::array kinds{SurfaceKind::jump};
    double lower = 0, upper = 0;
    template <Scalar S>
    Vec<S, 4> field(const S&, const Vec<S, 4>& x, const Vec<S, 1>&, const Vec<S, 0>&) const {
        return {x[2], x[3], S(-1) - S(lower) * x[2], S(-1) - S(upper) * x[3]};
    }
    template <Scalar S> Vec<S, 1> h(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return Vec<S, 1>(x[1] - x[0]);
    }
    template <Scalar S> Vec<S, 4> jump(int, const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[0], x[1], x[3], x[2]};
    }
};

template <class Tableau, class Sys>
auto run_of(const Sys& sys, const Vec<double, Sys::dim>& x, double t_end, double tol = 1e-9) {
    return run<Tableau>(sys, Vec<double, 0>{}, x, 0.0, t_end, tolerance<Sys::dim>(tol));
}
template <class Run> std::string words(const Run& r) {
    std::string all;
    for (const auto& e : r.events)
        if (e.kind != EventKind::start && e.kind != EventKind::end)
            all += std::string(name(e.kind)) + std::to_string(e.surface) + " ";
    return all;
}

} // namespace

TEMPLATE_TEST_CASE("staying, several: a floor that is a mode of its own", "[staying]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    const auto check = [](const auto& tank) {
        for (const double start : {0.0, 0.5}) {
            const auto r = run_of<TestType>(tank, {start, 0}, 195);
            REQUIRE(r.result.status == Status::ok);
            // the inflow opens once a period, the last time at
            const double pi = std::numbers::pi, opens = 2 * pi * 30 + 5 * pi / 3;
            const double x = std::sin(195.0) - std::sin(opens) - (195 - opens) / 2;
            CHECK(std::abs(r.result.x[0] - x) < 1e-7);
            int exits = 0;
            for (const auto& e : r.events)
                exits += e.mode_before[0] == 0 && e.mode_after[0] != 0;
            CHECK(exits == 31);
        }
    };
    for (const double scale : {1.0, 1e-9, 1e9}) {
        CAPTURE(scale);
        check(Tank<SurfaceKind::kink>{scale});
        check(Tank<SurfaceKind::switching>{scale});
    }
}

TEMPLATE_TEST_CASE("staying, several: play turns where its kink is", "[staying]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    const auto r = run_of<TestType>(Play{}, {0, 0}, 100);
    INFO(r.result.message());
    REQUIRE(r.result.status == Status::ok);
    CHECK(std::abs(r.result.x[1] + 0.5) < 1e-7); // since sin t was -1, at 63 pi/2
    CHECK(r.times(EventKind::enter_sliding).size() == 32);
}

TEMPLATE_TEST_CASE("staying, several: three tanks, of which one runs into another", "[staying]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    const auto r = run_of<TestType>(ThreeTanks{}, {1, 1, 0.3}, 10);
    INFO(r.result.message());
    REQUIRE(r.result.status == Status::ok);
    CHECK(words(r) == "enter_sliding0 enter_sliding2 enter_sliding1 ");
    CHECK(r.events[3].t == Approx(4).epsilon(1e-12));
    CHECK(r.result.x.norm() < 1e-14);
}

TEMPLATE_TEST_CASE("staying, several: two tanks", "[staying]", DormandPrince5, DormandPrince8,
                   Rodas5P) {
    const auto at_end = [](const auto& r, std::string_view expected, double second) {
        REQUIRE(r.result.status == Status::ok);
        CHECK(words(r) == expected);
        CHECK(std::abs(r.result.x[0]) < 1e-15);
        CHECK(std::abs(r.result.x[1] - second) < 1e-14);
        CHECK(r.result.mode.sliding() == (second > 0 ? 1 : 2));
    };
    // both at once, from the start, one after the other, in both orders
    at_end(run_of<TestType>(TwoTanks{}, {1, 1, 0}, 3), "enter_sliding0 ", 0);
    at_end(run_of<TestType>(TwoTanks{}, {0, 0, 0}, 3), "", 0);
    at_end(run_of<TestType>(TwoTanks{0.5}, {1, 1, 0}, 3), "enter_sliding0 enter_sliding1 ", 0);
    at_end(run_of<TestType>(TwoTanks{2}, {1, 1, 0}, 3), "enter_sliding1 enter_sliding0 ", 0);
    // from the first into the second
    at_end(run_of<TestType>(TwoTanks{0.5, 1}, {1, 1, 0}, 3), "enter_sliding0 ", 0.5);
    at_end(run_of<TestType>(TwoTanks{0.5, 1}, {1, 1, 0}, 5), "enter_sliding0 enter_sliding1 ", 0);
    at_end(run_of<TestType>(TwoTanks{1.5, 1}, {1, 0.5, 0}, 5), "enter_sliding0 ", 0);
    at_end(run_of<TestType>(TwoTanks{0.5, 1}, {1, 0, 0}, 5), "enter_sliding0 enter_sliding1 ", 0);
}

TEMPLATE_TEST_CASE("staying, several: tides that run empty and over", "[staying]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    std::mt19937 random(32);
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int problem = 0; problem < 20; ++problem) {
        CAPTURE(problem);
        Tides tides;
        for (std::size_t i = 0; i < 2; ++i) {
            tides.a[i] = between(0.3, 2);
            tides.b[i] = between(-0.3, 0.3);
            tides.w[i] = between(0.5, 3);
            tides.phase[i] = between(0, 6);
            tides.scale[i] = std::pow(10.0, between(-9, 9));
        }
        // every other one starts empty or full
        const bool at_limit = problem % 2 == 1;
        const Vec<double, 3> x(at_limit ? double(problem % 4 == 1) : between(0, 1),
                               at_limit ? double(problem % 3 == 1) : between(0, 1), 0);
        const double t_end = 30;
        const auto r = run_of<TestType>(tides, x, t_end);
        INFO(r.result.message());
        REQUIRE(r.result.status == Status::ok);
        const auto cut = tides.cut_off(x, t_end, 300'000); // steps of 1e-4, of first order
        const auto fine = run_of<TestType>(tides, x, t_end, 1e-12);
        for (int i = 0; i < 3; ++i) {
            CHECK(std::abs(r.result.x[i] - cut[i]) < 1e-4);
            CHECK(std::abs(r.result.x[i] - fine.result.x[i]) < 1e-7);
        }
        CHECK(r.events.size() > 6);
    }
}

TEMPLATE_TEST_CASE("contact without a force: what falls together", "[staying]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    const auto row = [](double e) { return Row<3>{e, 1, {1, 2, 3}}; };
    for (const double e : {0.0, 0.5, 1.0})
        for (const double speed : {0.0, 0.3}) {
            Vec<double, 6> x;
            x << 0, 1, 2, speed, speed, speed;
            const auto r = run_of<TestType>(row(e), x, 2);
            REQUIRE(r.result.status == Status::ok);
            CHECK(words(r).empty());
            for (int i = 0; i < 3; ++i)
                CHECK(std::abs(r.result.x[i] - (i + 2 * speed - 2)) < 1e-12);
        }
}

TEST_CASE("contact without a force: rows of touching balls pass a shock on, pair by pair",
          "[staying]") {
    Vec<double, 6> x;
    x << -1, 1, 2, 1, 0, 0;
    const auto equal = run_of<DormandPrince5>(Row<3>{1, 0, {1, 1, 1}}, x, 5);
    REQUIRE(equal.result.status == Status::ok);
    CHECK(words(equal) == "jump0 jump1 ");
    CHECK((equal.result.x - (Vec<double, 6>() << 0, 1, 6, 0, 0, 1).finished()).norm() < 1e-12);

    // heavy, light, heavy: the light one goes to and fro between them, here twice
    const auto heavy = run_of<DormandPrince5>(Row<3>{1, 0, {2, 1, 2}}, x, 5);
    REQUIRE(heavy.result.status == Status::ok);
    CHECK(words(heavy) == "jump0 jump1 jump0 ");
    CHECK(heavy.result.x[3] == Approx(-5.0 / 27));
    CHECK(heavy.result.x[4] == Approx(16.0 / 27));
    CHECK(heavy.result.x[5] == Approx(8.0 / 9));

    // without restitution they go on together
    const auto soft = run_of<DormandPrince5>(Row<3>{0, 0, {1, 1, 1}}, x, 5);
    REQUIRE(soft.result.status == Status::ok);
    for (int i = 3; i < 6; ++i)
        CHECK(soft.result.x[i] == Approx(1.0 / 3));

    Vec<double, 8> two;
    two << -2, -1, 1, 2, 1, 1, 0, 0;
    const auto four = run_of<DormandPrince5>(Row<4>{1, 0, {1, 1, 1, 1}}, two, 5);
    REQUIRE(four.result.status == Status::ok);
    Vec<double, 8> after;
    after << -1, 0, 5, 6, 0, 0, 1, 1;
    CHECK((four.result.x - after).norm() < 1e-12);
}

TEST_CASE("contact without a force: what a drag pulls apart parts", "[staying]") {
    const auto speed = [](double drag) { return -(1 - std::exp(-2 * drag)) / drag; };
    const auto apart = run_of<DormandPrince5>(Drag{0.1, 0.3}, {0, 0, 0, 0}, 2);
    REQUIRE(apart.result.status == Status::ok);
    CHECK(apart.result.mode[0] == 1);
    CHECK(apart.result.x[2] == Approx(speed(0.1)).epsilon(1e-7));
    CHECK(apart.result.x[3] == Approx(speed(0.3)).epsilon(1e-7));
    // pressed together, of equal masses, they share the mean drag
    const auto pressed = run_of<DormandPrince5>(Drag{0.3, 0.1}, {0, 0, 0, 0}, 2);
    INFO(pressed.result.message());
    REQUIRE(pressed.result.status == Status::ok);
    CHECK(pressed.result.mode[0] == 0);
    CHECK(pressed.result.x[2] == Approx(speed(0.2)).epsilon(1e-7));
    CHECK(pressed.result.x[3] == Approx(speed(0.2)).epsilon(1e-7));
}
