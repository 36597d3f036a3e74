// SPDX-License-Identifier: BSD-3-Clause
// One side's field is tangent to the surface, and the other pushes in: an empty tank, a blocked
// diode, a limited integrator. The solution stays there, a slide with s at its end, for as long as
// that is so. Against closed forms.

#include "catch.hpp"
#include "run.hpp"

#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <numbers>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Fields of height and clock, (height', 1), of which the upper side is above h = 0 or, mirrored,
/// below it; h is as large as its scale says.
template <class Law> struct Kept {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"up", "scale"};
    template <class S> using X = Vec<S, 2>;

    template <Scalar S> X<S> f1(const S& t, const X<S>& x, const X<S>& p) const {
        return value_of(p[0]) > 0 ? X<S>(Law::floor(t), S(1)) : X<S>(-Law::open(t, S(-x[0])), S(1));
    }
    template <Scalar S> X<S> f2(const S& t, const X<S>& x, const X<S>& p) const {
        return value_of(p[0]) > 0 ? X<S>(Law::open(t, x[0]), S(1)) : X<S>(-Law::floor(t), S(1));
    }
    template <Scalar S> S h(const S&, const X<S>& x, const X<S>& p) const { return p[1] * x[0]; }
};

struct Empties {
    template <class S> static S floor(const S&) { return S(0); }
    template <class S> static S open(const S&, const S&) { return S(-1); }
};
/// Torricelli's law made linear: empties ever more slowly, and at last with a speed.
struct Drains {
    template <class S> static S floor(const S&) { return S(0); }
    template <class S> static S open(const S&, const S& x) { return S(-0.5) - x; }
};
/// An inflow cos t and an outflow 1/2: it fills again.
struct Fills {
    template <class S> static S flow(const S& t) {
        using elementary::cos;
        return S(cos(t)) - S(0.5);
    }
    template <class S> static S floor(const S& t) {
        const S q = flow(t);
        return q > S(0) ? q : S(0);
    }
    template <class S> static S open(const S& t, const S&) { return flow(t); }
};
/// The floor gives way at t = 1.
struct Opens {
    template <class S> static S floor(const S& t) { return t > S(1) ? S(1) - t : S(0); }
    template <class S> static S open(const S&, const S&) { return S(-1); }
};
/// From t = 1 on there is a push from below.
struct Pushes {
    template <class S> static S floor(const S& t) { return t > S(1) ? t - S(1) : S(0); }
    template <class S> static S open(const S&, const S&) { return S(-1); }
};
/// The other side leads away.
struct Leads {
    template <class S> static S floor(const S&) { return S(0); }
    template <class S> static S open(const S&, const S&) { return S(1); }
};

const double ups[]{1, -1}, scales[]{1, 1e-9, 1e9};

/// Runs both ways up, with h of three sizes; calls check(run, +1 or -1).
template <class Tableau, class Law, class Check>
void each(Vec<double, 2> x0, double t_end, const Check& check) {
    for (const double up : ups)
        for (const double scale : scales) {
            CAPTURE(up, scale);
            const Vec<double, 2> start(up * x0[0], x0[1]);
            check(run<Tableau>(Kept<Law>{}, Vec<double, 2>(up, scale), start, 0.0, t_end,
                               tolerance<2>(1e-9)),
                  int(up));
        }
}
/// Kinds of event, start and end left out.
template <class Run> std::string words(const Run& r) {
    std::string all;
    for (const auto& e : r.events)
        if (e.kind != EventKind::start && e.kind != EventKind::end)
            all += (all.empty() ? "" : " ") + std::string(name(e.kind));
    return all;
}

} // namespace

TEMPLATE_TEST_CASE("staying: what is empty stays empty", "[staying]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    each<TestType, Empties>({0.5, 0}, 3, [](const auto& r, int up) {
        REQUIRE(r.result.status == Status::ok);
        CHECK(words(r) == "enter_sliding");
        CHECK(r.events[1].t == Approx(0.5).epsilon(1e-12));
        CHECK(r.events[1].s == -up);
        CHECK(std::abs(r.result.x[0]) < 1e-15);
        CHECK(r.result.x[1] == Approx(3).epsilon(1e-12));
        CHECK(r.result.mode[0] == 0);
    });
    each<TestType, Empties>({0, 0}, 3, [](const auto& r, int) {
        REQUIRE(r.result.status == Status::ok);
        CHECK(words(r).empty());
        CHECK(r.result.x[0] == 0);
    });
    each<TestType, Drains>({0.5, 0}, 3, [](const auto& r, int) {
        REQUIRE(r.result.status == Status::ok);
        CHECK(words(r) == "enter_sliding");
        CHECK(r.events[1].t == Approx(std::numbers::ln2).epsilon(1e-7));
        CHECK(std::abs(r.result.x[0]) < 1e-15);
    });
}

TEMPLATE_TEST_CASE("staying: until the side that pushes in turns round", "[staying]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    // empty when 1/2 + sin t = t/2, full again from cos t = 1/2 on
    double empty = 2;
    for (int k = 0; k < 50; ++k)
        empty -= (0.5 + std::sin(empty) - empty / 2) / (std::cos(empty) - 0.5);
    const double full = 5 * std::numbers::pi / 3;
    each<TestType, Fills>({0.5, 0}, 7, [&](const auto& r, int up) {
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(words(r) == "enter_sliding exit_sliding");
        CHECK(r.events[1].t == Approx(empty).epsilon(1e-7));
        CHECK(r.events[2].t == Approx(full).epsilon(1e-9));
        CHECK(r.result.mode[0] == up);
        const double x = std::sin(7) - std::sin(full) - (7 - full) / 2;
        CHECK(std::abs(r.result.x[0] - up * x) < 1e-7);
    });
    each<TestType, Fills>({0.5, 0}, 100, [](const auto& r, int) {
        CHECK(r.result.status == Status::ok);
        CHECK(r.events.size() == 2 + 32); // fills and empties once a period
    });
}

TEMPLATE_TEST_CASE("staying: until the side that it is held by says otherwise", "[staying]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    each<TestType, Opens>({0.5, 0}, 3, [](const auto& r, int up) {
        REQUIRE(r.result.status == Status::ok);
        CHECK(words(r) == "enter_sliding exit_sliding");
        CHECK(r.events[2].t == Approx(1).epsilon(1e-4)); // (1 - t)^2/2 is within the tolerance
        CHECK(r.result.x[0] == Approx(-2 * up).epsilon(1e-7));
        CHECK(r.result.mode[0] == -up);
    });
    each<TestType, Pushes>({0.5, 0}, 4, [](const auto& r, int up) {
        REQUIRE(r.result.status == Status::ok);
        CHECK(words(r) == "enter_sliding");
        CHECK(r.events.back().s == Approx(up * 0.5)); // (3 - 1)/(3 + 1)
        CHECK(std::abs(r.result.x[0]) < 1e-15);
    });
}

TEST_CASE("staying: not where the other side leads away, which makes two solutions", "[staying]") {
    each<DormandPrince5, Leads>({0, 0}, 3, [](const auto& r, int) {
        CHECK(r.result.status == Status::ambiguous);
        CHECK_THAT(r.result.message(), ContainsSubstring("tangent to the surface, the other"));
    });
    // nor backwards, where what emptied may have come from any height
    for (const double up : ups) {
        const auto r = run<DormandPrince5>(Kept<Empties>{}, Vec<double, 2>(up, 1),
                                           Vec<double, 2>(0, 0), 3.0, 0.0, tolerance<2>(1e-9));
        CHECK(r.result.status == Status::ambiguous);
    }
}

namespace {

/// x' = v, v' = -1 where x + v/2 > 1/20, else 0: slides along that line towards rest.
struct DeadZone {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 0> params{};
    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(0)};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x[0] + S(0.5) * x[1] - S(0.05);
    }
};

} // namespace

TEMPLATE_TEST_CASE("staying: a slide that tends to rest at its end", "[staying]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    const auto r = run<TestType>(DeadZone{}, Vec<double, 0>{}, Vec<double, 2>(0, 0.1), 0.0, 100.0,
                                 tolerance<2>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.result.mode[0] == 0);
    CHECK(std::abs(r.result.x[0] - 0.05) < 1e-9); // v' = -2 v along the line
    CHECK(std::abs(r.result.x[1]) < 1e-9);
}

namespace {

/// The same flow into a tank whose floor is a mode of its own while that is negative.
template <SurfaceKind Kind> struct Tank {
    static constexpr int dim = 2, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::switching, Kind};
    double scale = 1;

    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        const S q = Fills::flow(t), floor = q * (S(1) + s[1]) * S(0.5);
        return {S(0.5) * (q + floor) + s[0] * S(0.5) * (q - floor), S(1)};
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(scale) * x[0], S(scale) * Fills::flow(t)};
    }
};

} // namespace

TEMPLATE_TEST_CASE("staying: until an inflow opens, which is a surface of its own", "[staying]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    const auto check = [](const auto& tank) {
        for (const double start : {0.0, 0.5}) {
            const auto r = run<TestType>(tank, Vec<double, 0>{}, Vec<double, 2>(start, 0), 0.0,
                                         19.0, tolerance<2>(1e-9));
            REQUIRE(r.result.status == Status::ok);
            // it opens once a period, the last time at
            const double pi = std::numbers::pi, opens = 4 * pi + 5 * pi / 3;
            const double x = std::sin(19.0) - std::sin(opens) - (19 - opens) / 2;
            CHECK(std::abs(r.result.x[0] - x) < 1e-7);
            int exits = 0;
            for (const auto& e : r.events)
                exits += e.mode_before[0] == 0 && e.mode_after[0] != 0;
            CHECK(exits == 3);
        }
    };
    for (const double scale : {1.0, 1e-9, 1e9}) {
        CAPTURE(scale);
        check(Tank<SurfaceKind::kink>{scale});
        check(Tank<SurfaceKind::switching>{scale});
    }
}
