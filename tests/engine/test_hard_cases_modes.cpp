// SPDX-License-Identifier: BSD-3-Clause
// Hard cases of the decision at a surface: H5-H13, H16, H32, H35, H38, policies where nothing is
// unique. On h = y most systems here are f1 = (1, L1(x)), f2 = (1, L2(x)): on the surface x is the
// time.
#include "hard.hpp"

#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/unit_circle.hpp>

#include <algorithm>
#include <cmath>

using namespace filippov;
using enum EventKind;

namespace {

const auto y_is_h = [](const auto&, const auto& x) { return x[1]; };

/// f1 = (1, l1(x)) below y = 0, f2 = (1, l2(x)) above.
template <class L1, class L2> Plane strip(L1 l1, L2 l2) {
    return {[l1](const auto&, const auto& x) { return like(x, 1, l1(x[0])); },
            [l2](const auto&, const auto& x) { return like(x, 1, l2(x[0])); }, y_is_h};
}

/// The strip with l1 = (x - 1)^2 - depth, or -(x - 1)^3, above it -1, and its slides known.
struct KnownStrip {
    static constexpr int dim = 2;
    bool cubic;
    double depth = 0;

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        const S u = x[0] - S(1);
        return {S(1), cubic ? S(-u * u * u) : S(u * u - S(depth))};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(1), S(-1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 0>&, const S& dt) const {
        return {x[0] + dt, x[1]};
    }
};

const auto down = [](const auto& x) { return x * 0 - 1; };
const auto up = [](const auto& x) { return x * 0 + 1; };
const auto plus_x = [](const auto& x) { return x; };
const auto minus_x = [](const auto& x) { return -x; };

} // namespace

// --- leaving a slide -----------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H5: a slide ends on a root of L to full accuracy, whatever the tolerance",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // F1 = (1, cos x) below, F2 = (3, -1) above: a sliding field that is no polynomial; L1 = cos x
    // = 0 at pi/2
    const Plane sys(
        [](const auto&, const auto& x) {
            using std::cos;
            return like(x, 1, cos(x[0]));
        },
        [](const auto&, const auto& x) { return like(x, 3, -1); }, y_is_h);
    const double tol = GENERATE(1e-3, 1e-6, 1e-9, 1e-12);
    const auto r = go<TestType>(sys, V2(0, 0), 0, 2, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "exit_sliding");
    CHECK(r.events[1].x_right[0] == Approx(pi / 2).epsilon(4 * eps));
    CHECK(r.events[1].x_right[1] == 0);
    CHECK(r.events[1].s == Approx(-1).epsilon(4 * eps));
    CHECK(r.events[1].mode_after[0] == -1);
    // on the surface x' = (1 + 3 cos x)/(1 + cos x)
    const double t = simpson([](double x) { return (1 + std::cos(x)) / (1 + 3 * std::cos(x)); }, 0,
                             pi / 2, 2000);
    CHECK(r.events[1].t == Approx(t).epsilon(0).margin(20 * tol));
}

TEMPLATE_TEST_CASE("H5: a slide ends above where L2 vanishes", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const auto r = go<TestType>(strip(up, plus_x), V2(-1, 0), 0, 2, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    check_events(r.events, {{exit_sliding, 1.0}}, 1e-15);
    CHECK(r.events[1].s == Approx(1).epsilon(eps));
    CHECK(r.result.x[1] == Approx(0.5).epsilon(1e-12)); // y = x^2/2
}

TEMPLATE_TEST_CASE(
    "H6: where L1 vanishes doubly the next derivative decides, and the slide goes on", "[hard]",
    DormandPrince5, DormandPrince8) {
    const auto r = go<TestType>(strip([](const auto& x) { return x * x; }, down), V2(-1, 0), 0, 2,
                                bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "slide_extremum");
    CHECK(r.events[1].t == Approx(1).epsilon(0).margin(1e-8));
    CHECK(r.result.mode[0] == 0);
    CHECK(r.result.x[1] == 0);
}

TEMPLATE_TEST_CASE("H5: a slide that ends just before L1 = L2 ends by tangency", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // v' = a - cos t sign v: sticks until cos t = |a|; at cos t = 0 the fields are the same
    const double tol = GENERATE(1e-3, 1e-6, 1e-10);
    const double a = GENERATE(0.1, 0.01, -1e-3, 1e-5, -1e-7, 1e-9);
    const double start = GENERATE(-1.4, -0.7, 0.0, 1.2);
    const auto side = [a](double sign) {
        return [a, sign](const auto& t, const auto& x) {
            using std::cos;
            return like(x, x[1], a - sign * cos(t));
        };
    };
    const Plane sys(side(-1), side(+1), [](const auto&, const auto& x) { return x[1]; });
    INFO("tolerance " << tol << ", a " << a << ", start " << start);
    const auto r = go<TestType>(sys, V2(0, 0), start, 2.5, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "exit_sliding");
    const double end = std::acos(std::abs(a)), sign = a > 0 ? 1 : -1;
    CHECK(r.events[1].t == Approx(end).epsilon(0).margin(1e-12));
    CHECK(r.result.x[1] == Approx(a * (2.5 - end) - sign * (std::sin(2.5) - std::sin(end)))
                               .epsilon(0)
                               .margin(10 * tol));
}

TEMPLATE_TEST_CASE("H5: a slide ends by tangency also where the pole comes in the same step",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // x' = k1 (ta - t) below 0, -k2 (tb - t) above: the slide ends at the first of ta and tb
    for (const auto& slopes : {std::pair(1.0, 0.1), {2.0, 0.1}, {1.0, 1.0}, {30.0, 0.5}})
        for (int i = 0; i < 35; ++i)
            for (const double apart : {0.2, 0.05, 0.01, 1e-3, -0.2, -0.02}) {
                // by name: clang 16 does not let a lambda capture parts of a pair under OpenMP
                const double k1 = slopes.first, k2 = slopes.second;
                const double ta = 0.5 + 0.1 * i, tb = ta + apart, first = std::min(ta, tb);
                CAPTURE(k1, k2, ta, apart);
                const Line sys([=](const auto& t, const auto& x) { return like(x, k1 * (ta - t)); },
                               [=](const auto& t, const auto& x) { return like(x, k2 * (t - tb)); },
                               [](const auto&, const auto& x) { return x[0]; });
                const auto r = go<TestType>(sys, V1(0), 0, first + 1, bounded<1>(1e-8));
                REQUIRE(r.result.status == Status::ok);
                REQUIRE(r.times(exit_sliding).size() == 1);
                CHECK(r.times(exit_sliding)[0] == Approx(first).epsilon(1e-12));
            }
}

TEMPLATE_TEST_CASE("H6: where L1 vanishes triply it changes sign, and the slide ends", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double from = GENERATE(1.0, 0.9, 0.7, 0.613, 0.31);
    const double tol = GENERATE(1e-4, 1e-6, 1e-9, 1e-12);
    // The landing is exact, or, where 1 + s = x^3 is rounding below 6e-6, that far off.
    const double rounds = GENERATE(0.0, 1.0);
    const auto l1 = [=](const auto& x) { return rounds - x * x * x - rounds; };
    const auto r = go<TestType>(strip(l1, down), V2(-from, 0), 0, from + 1, bounded<2>(tol));
    INFO("from " << from << ", tol " << tol << ", rounds " << rounds);
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "exit_sliding");
    CHECK(r.events[1].t == Approx(from).epsilon(0).margin(1e-5));
    CHECK(r.result.x[1] == Approx(-0.25).epsilon(0).margin(std::max(1e-9, tol)));
}

TEMPLATE_TEST_CASE("H6: where L1 vanishes triply a slide in closed form ends, too", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double from = GENERATE(1.0, 0.9, 0.7, 0.31);
    const double tol = GENERATE(1e-4, 1e-6, 1e-9, 1e-12);
    INFO("from " << from << ", tol " << tol);
    const auto r =
        run<TestType>(KnownStrip{true}, {}, V2(1 - from, 0), 0, from + 1, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "exit_sliding");
    CHECK(r.events[1].t == Approx(from).epsilon(0).margin(1e-5)); // (see above)
    CHECK(r.result.x[1] == Approx(-0.25).epsilon(0).margin(std::max(1e-9, tol)));
}

namespace {

/// v' = V'(t) + 1 + (t - 1)^3 - s beside V(t) = B sin 3t: the slide ends at t = 1, where s leaves 1
/// with three derivatives zero, and h = (t - 1)^4 / 4 from there on.
struct SlowExit {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"B"};

    template <Scalar S> static S a(const S& t, const Vec<S, 1>& p) {
        using std::cos;
        const S u = t - S(1);
        return p[0] * S(3) * cos(S(3) * t) + S(1) + u * u * u;
    }
    template <Scalar S> Vec<S, 1> f1(const S& t, const Vec<S, 1>&, const Vec<S, 1>& p) const {
        return Vec<S, 1>(a(t, p) + S(1));
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>&, const Vec<S, 1>& p) const {
        return Vec<S, 1>(a(t, p) - S(1));
    }
    template <Scalar S> S h(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        using std::sin;
        return x[0] - p[0] * sin(S(3) * t);
    }
};

} // namespace

TEMPLATE_TEST_CASE("H6: a slide left at fourth order does not graze its surface", "[hard]",
                   DormandPrince5, DormandPrince8) {
    for (const double B : {1.0, 10.0, 1000.0})
        for (const double tol : {1e-6, 1e-9, 1e-12}) {
            INFO("B = " << B << ", tolerance " << tol);
            const auto r =
                run<TestType>(SlowExit{}, V1(B), V1(B * std::sin(0.6)), 0.2, 3, bounded<1>(tol));
            CHECK(r.result.status == Status::ok);
            CHECK(r.times(exit_sliding).size() == 1);
            CHECK(r.times(graze).size() == 0);
        }
}

TEMPLATE_TEST_CASE("H13: a slide in closed form passes a dip of s, or leaves in it", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // s < -1 within sqrt(depth) of x = 1; what leaves comes back at 1 + 2 sqrt(depth)
    const double depth =
        GENERATE(0.0, 1e-15, 1e-14, 1e-12, 1e-11, 1e-10, 1e-9, 3e-9, 1e-8, 1e-7, 1e-6, 1e-4);
    const double tol = GENERATE(1e-4, 1e-6, 1e-8, 1e-10, 1e-12);
    INFO("depth " << depth << ", tol " << tol);
    const auto r = run<TestType>(KnownStrip{false, depth}, {}, V2(0, 0), 0, 2, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.mode[0] == 0);
    CHECK(r.result.x[1] == 0);
    const bool touches = word(r) == "slide_extremum";
    const bool leaves = word(r) == "exit_sliding enter_sliding";
    if (depth > 10 * tol) {
        REQUIRE(leaves);
        const double half = std::sqrt(depth);
        CHECK(r.events[1].t == Approx(1 - half).epsilon(0).margin(1e-12));
        // it comes back at the speed 3 depth, whose reciprocal errors are multiplied by
        CHECK(r.events[2].t == Approx(1 + 2 * half).epsilon(0).margin(1e-12 + tol));
    } else if (depth < 0.1 * tol)
        CHECK(touches);
    else
        CHECK(r.events.size() <= 5);
}

TEMPLATE_TEST_CASE("H6: a start on a double zero of L1 goes where the second derivative says",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // below: h' = h'' = 0, h''' = +-2: returns to the surface, so it slides, or leaves at once
    const auto slides = go<TestType>(strip([](const auto& x) { return x * x; }, down), V2(0, 0), 0,
                                     1, bounded<2>(1e-9));
    CHECK(slides.result.status == Status::ok);
    CHECK(word(slides) == "");
    CHECK(slides.result.mode[0] == 0);
    const auto leaves = go<TestType>(strip([](const auto& x) { return -x * x; }, down), V2(0, 0), 0,
                                     1, bounded<2>(1e-9));
    CHECK(leaves.result.status == Status::ok);
    CHECK(word(leaves) == "");
    CHECK(leaves.result.mode[0] == -1);
    CHECK(leaves.result.x[1] == Approx(-1.0 / 3).epsilon(1e-8));
}

// --- two-folds and repulsion ---------------------------------------------------------------------

TEMPLATE_TEST_CASE("H7: a two-fold is ambiguous and named", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const auto settings = bounded<2>(1e-9);
    const auto what = [&](const Plane& sys) {
        const auto r = go<TestType>(sys, V2(0, 0), 0, 1, settings);
        CHECK(r.result.status == Status::ambiguous);
        CHECK(r.result.t == 0);
        CHECK(r.result.counters.steps == 0);
        CHECK(r.result.diagnosis.surface == 0);
        return std::string(r.result.diagnosis.what);
    };
    CHECK(what(strip(minus_x, plus_x)) == "two-fold, visible-visible");
    CHECK(what(strip(minus_x, [](const auto& x) { return -2 * x; })) ==
          "two-fold, visible-invisible");
    CHECK(what(strip(plus_x, [](const auto& x) { return 2 * x; })) ==
          "two-fold, visible-invisible");
    CHECK(what(strip(plus_x, minus_x)) == "two-fold, invisible-invisible");
}

TEMPLATE_TEST_CASE("H7: where a force depends on the side of a position, both may lead away alike",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // x'' = F cos t - 0.2 x' - x - a sign(x) at rest on x = 0: if F > a it leaves at once
    const double a = 0.5, F = GENERATE(2.0, 0.6, -2.0), tol = GENERATE(1e-6, 1e-10);
    const auto side = [=](double s) {
        return [=](const auto& t, const auto& x) {
            using std::cos;
            return like(x, x[1], F * cos(t) - 0.2 * x[1] - x[0] - a * s);
        };
    };
    const Plane sys(side(-1), side(1), [](const auto&, const auto& x) { return x[0]; });
    INFO("F = " << F << ", tolerance " << tol);
    const auto r = go<TestType>(sys, V2(0, 0), 0, 7, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(r.events[0].mode_after[0] == (F > 0 ? 1 : -1));
    const auto beside =
        go<DormandPrince8>(sys, V2(F > 0 ? 1e-14 : -1e-14, 0), 0, 7, bounded<2>(1e-12));
    CHECK((r.result.x - beside.result.x).norm() < 100 * tol);
    CHECK(r.events.size() == beside.events.size());
    // with less force it stays: a slide of second order
    const Plane weak(
        [](const auto& t, const auto& x) {
            using std::cos;
            return like(x, x[1], 0.3 * cos(t) + 0.5);
        },
        [](const auto& t, const auto& x) {
            using std::cos;
            return like(x, x[1], 0.3 * cos(t) - 0.5);
        },
        [](const auto&, const auto& x) { return x[0]; });
    const auto stays = go<TestType>(weak, V2(0, 0), 0, 1, bounded<2>(tol));
    CHECK(stays.result.status == Status::ok);
    CHECK(stays.result.x == V2(0, 0));
    CHECK(stays.events.back().s == Approx(0.6 * std::cos(1.0)).epsilon(1e-12));
}

TEMPLATE_TEST_CASE("H7: at a two-fold a policy chooses, and every choice ends", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto choose = [](const Plane& sys, NonUnique policy) {
        auto settings = bounded<2>(1e-9);
        settings.on_nonunique = policy;
        return go<TestType>(sys, V2(0, 0), 0, 1, settings);
    };
    const Plane visible = strip(minus_x, [](const auto& x) { return 2 * x; });
    auto r = choose(visible, NonUnique::below);
    CHECK(r.result.status == Status::ok);
    CHECK(r.events[0].mode_after[0] == -1);
    CHECK(r.result.x[1] == Approx(-0.5).epsilon(1e-12));
    r = choose(visible, NonUnique::above);
    CHECK(r.result.status == Status::ok);
    CHECK(r.events[0].mode_after[0] == 1);
    CHECK(r.result.x[1] == Approx(1).epsilon(1e-12));
    r = choose(visible, NonUnique::stay); // L1 = L2 = 0 there: no sliding field
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.diagnosis.what == "L1 = L2: no sliding field");
    // an invisible fold has no orbit on its own side: the choice cannot be kept, which is said, or
    // goes to the surface again
    const Plane invisible = strip(plus_x, minus_x);
    for (const auto policy : {NonUnique::below, NonUnique::above, NonUnique::stay}) {
        r = choose(invisible, policy);
        CHECK((r.result.status == Status::ambiguous || r.result.status == Status::ok));
        CHECK(r.result.counters.events < 50);
    }
    const Plane mixed = strip(minus_x, [](const auto& x) { return -2 * x; });
    r = choose(mixed, NonUnique::below);
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.x[1] == Approx(-0.5).epsilon(1e-12));
    r = choose(mixed, NonUnique::above);
    CHECK((r.result.status == Status::ambiguous || r.result.status == Status::ok));
    CHECK(r.result.counters.events < 50);
}

TEMPLATE_TEST_CASE(
    "H8: a start where the slide would end at once leaves without a slide of no length", "[hard]",
    DormandPrince5, DormandPrince8) {
    const Plane sys = strip(minus_x, down);
    for (const double x0 : {0.0, 1e-17, 1e-12, 1e-6, 0.1}) {
        const auto r = go<TestType>(sys, V2(x0, 0), 0, 1, bounded<2>(1e-9));
        CHECK(r.result.status == Status::ok);
        CHECK(word(r) == "");
        CHECK(r.events[0].mode_after[0] == -1);
        CHECK(r.events[0].surface == 0);
        CHECK(r.result.x[1] == Approx(-0.5 - x0).epsilon(1e-9));
    }
    // and in the oscillator, on the belt at q = -4 and beyond
    const auto p = default_params<models::Oscillator>();
    for (const double y : {4.5, 4.6, 5.0}) {
        const auto r = run<TestType>(models::Oscillator{}, p, V2(y, 1), 0, 0.1, bounded<2>(1e-9));
        CHECK(r.result.status == Status::ok);
        CHECK(faults(r) == "");
        CHECK(word(r) == "");
        CHECK(r.events[0].mode_after[0] == -1);
    }
}

TEMPLATE_TEST_CASE("H9: starts a rounding error off the surface are classified like those on it",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const Plane sys = strip(minus_x, down);
    for (const double x0 : {-1.0, -0.1, -1e-3, 0.0, 1e-3, 1.0}) {
        const auto on = go<TestType>(sys, V2(x0, 0), 0, 2, bounded<2>(1e-9));
        for (const double h : {1e-17, -1e-17, 1e-16, -1e-16, 1e-14, -1e-14}) {
            CAPTURE(x0, h);
            const auto off = go<TestType>(sys, V2(x0, h), 0, 2, bounded<2>(1e-9));
            CHECK(off.result.status == on.result.status);
            CHECK(off.events[0].mode_after == on.events[0].mode_after);
            CHECK(word(off) == word(on));
            CHECK((off.result.x - on.result.x).norm() < 1e-12);
        }
    }
}

TEMPLATE_TEST_CASE("H9: at the limit of friction a block that rests goes on resting", "[hard]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12, 1e-13);
    const auto slide = [&](double mu, double x) {
        auto r = run<TestType>(models::Coulomb{}, Vec<double, 3>(mu, 0, 0.5), V2(x, 0), 0, 40,
                               bounded<2>(tol, 100'000, 100));
        CHECK(r.result.status == Status::ok);
        CHECK(faults(r) == "");
        return r;
    };
    for (const double mu : {0.4, 0.3, 7.7e5}) {
        for (const double x : {mu, -mu}) {
            const auto r = slide(mu, x);
            CHECK(r.events[0].mode_after[0] == 0);
            CHECK(r.result.x == V2(x, 0));
        }
        for (int k = 1; k < 8; ++k) { // the last reversal is at the limit
            CAPTURE(mu, k, tol);
            const double x = slide(mu, mu * (1 + 2 * k)).result.x[0];
            CHECK(x == Approx(k % 2 == 0 ? mu : -mu).epsilon(0).margin(20 * k * tol * (1 + mu)));
        }
    }
    CHECK(slide(0, 0).result.x == V2(0, 0)); // without friction, too
}

TEMPLATE_TEST_CASE("H9: what rests beside what leads away is not unique", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const auto nothing = [](const auto&, const auto& x) { return like(x, 0, 0); };
    const auto away = [](const auto&, const auto& x) { return like(x, 0, 1); };
    const auto back = [](const auto&, const auto& x) { return like(x, 0, -1); };
    const Plane leaves(nothing, away, y_is_h), stays(nothing, back, y_is_h);
    CHECK(go<TestType>(leaves, V2(0, 0), 0, 1, bounded<2>(1e-9)).result.status ==
          Status::ambiguous);
    CHECK(go<TestType>(stays, V2(0, 0), 0, 1, bounded<2>(1e-9)).result.x == V2(0, 0));
}

TEMPLATE_TEST_CASE("H9: what rests for a moment leaves, or is not decided", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // L1 = -t^4: four derivatives vanish at the start, and the solution is y = -t^5/5
    const Plane sys([](const auto& t, const auto& x) { return like(x, 0, -t * t * t * t); },
                    [](const auto&, const auto& x) { return like(x, 0, -1); }, y_is_h);
    const double tol = GENERATE(1e-4, 1e-6, 1e-9, 1e-12);
    const auto r = go<TestType>(sys, V2(0, 0), 0, 1, bounded<2>(tol));
    if (r.result.status != Status::ambiguous) {
        CHECK(r.result.status == Status::ok);
        CHECK(r.result.x[1] == Approx(-0.2).epsilon(0).margin(tol));
    }
}

TEMPLATE_TEST_CASE("H9: on the oscillator's belt the start is classified alike over forty ulp",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const auto mode_of = [&](double y, double v, double tol) {
        const auto r = run<TestType>(sys, p, V2(y, v), 0, 0.01, bounded<2>(tol));
        CHECK(r.result.status == Status::ok);
        CHECK(faults(r) == "");
        return r.events[0].mode_after[0];
    };
    for (const double tol : {1e-6, 1e-9, 1e-12}) {
        for (int k = -20; k <= 20; ++k) {
            CAPTURE(tol, k);
            // q = 0.5 - y: inside, on either boundary, outside
            REQUIRE(mode_of(0.5, 1 + k * eps / 2, tol) == 0);
            REQUIRE(mode_of(4.5, 1 + k * eps / 2, tol) == -1);
            REQUIRE(mode_of(5.0, 1 + k * eps / 2, tol) == -1);
            REQUIRE(mode_of(-5.0, 1 + k * eps / 2, tol) == +1);
        }
        // along the surface, across its boundary q = -4: one change of answer
        int changes = 0, last = 0;
        for (int k = -40; k <= 40; ++k) {
            const int mode = mode_of(4.5 + k * 4 * eps, 1, tol);
            if (mode != last)
                ++changes;
            last = mode;
        }
        CHECK(changes == 1);
        CHECK(last == -1);
    }
}

TEMPLATE_TEST_CASE("H10: from repulsive sliding the policy decides, and the result says how",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const models::Quartet sys;
    const Vec<double, 3> p(-1, 0, 0); // x' = sign x
    auto settings = bounded<1>(1e-9);
    auto r = run<TestType>(sys, p, V1(0), 0, 1, settings);
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.t == 0);
    CHECK(r.result.diagnosis.what.find("repulsive") != std::string_view::npos);
    const std::pair<NonUnique, int> choice[] = {
        {NonUnique::below, -1}, {NonUnique::above, 1}, {NonUnique::stay, 0}};
    for (const auto& [policy, mode] : choice) {
        settings.on_nonunique = policy;
        r = run<TestType>(sys, p, V1(0), 0, 1, settings);
        CHECK(r.result.status == Status::ok);
        CHECK(faults(r) == "");
        CHECK(word(r) == "");
        CHECK(r.events[0].mode_after[0] == mode);
        CHECK(r.result.mode[0] == mode);
        CHECK(r.result.x[0] == Approx(mode).epsilon(1e-14).margin(0));
    }
}

TEMPLATE_TEST_CASE("H10: a repulsive slide that turns attractive goes on", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // L1 = x - 1 < 0 < L2 = 2 - 2x until x = 1: a visible-visible... at x = 1 both vanish
    auto settings = bounded<2>(1e-9);
    settings.on_nonunique = NonUnique::stay;
    const auto r = go<TestType>(
        strip([](const auto& x) { return x - 1; }, [](const auto& x) { return 2 - 2 * x; }),
        V2(0, 0), 0, 2, settings);
    CHECK((r.result.status == Status::ambiguous || r.result.status == Status::ok));
    CHECK(r.result.t >= 1 - 1e-9);
    CHECK(std::abs(r.result.x[1]) < 1e-12);
}

TEMPLATE_TEST_CASE("H11: a slide that turns repulsive through a two-fold stops there", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const Plane sys = strip(minus_x, [](const auto& x) { return 2 * x; });
    auto settings = bounded<2>(1e-9);
    auto r = go<TestType>(sys, V2(-1, 0), 0, 2, settings);
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.t == Approx(1).epsilon(0).margin(1e-8));
    CHECK(r.result.diagnosis.what == "two-fold, visible-visible");
    CHECK(r.result.diagnosis.mode[0] == 0);
    settings.on_nonunique = NonUnique::below;
    r = go<TestType>(sys, V2(-1, 0), 0, 2, settings);
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "exit_sliding");
    CHECK(r.result.x[1] == Approx(-0.5).epsilon(1e-7));
    settings.on_nonunique = NonUnique::above;
    r = go<TestType>(sys, V2(-1, 0), 0, 2, settings);
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "exit_sliding");
    CHECK(r.result.x[1] == Approx(1).epsilon(1e-7));
}

// --- the boundary of the sliding set -------------------------------------------------------------

TEMPLATE_TEST_CASE("H12: an orbit that hits the sliding boundary goes on as its neighbours do",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    SECTION("where slides end: the corner is a crossing") {
        for (int k = -50; k <= 50; ++k) {
            const auto r = go<TestType>(strip(minus_x, down), V2(-1 + k * eps, 1), 0, 2,
                                        bounded<2>(tol, 5'000, 20));
            CAPTURE(k, word(r));
            REQUIRE(r.result.status == Status::ok);
            REQUIRE((word(r) == "cross" || word(r) == "enter_sliding exit_sliding"));
            REQUIRE(r.result.x[1] == Approx(-0.5).epsilon(1e-9));
            if (k == 0) {
                REQUIRE(word(r) == "cross");
                REQUIRE(r.events[1].mode_before[0] == 1);
                REQUIRE(r.events[1].mode_after[0] == -1);
                REQUIRE(r.events[1].s == Approx(-1).epsilon(1e-12));
            }
        }
    }
    SECTION("where slides begin: the corner is an entry") {
        for (int k = -50; k <= 50; ++k) {
            const auto r = go<TestType>(strip(plus_x, down), V2(-1 + k * eps, 1), 0, 2,
                                        bounded<2>(tol, 5'000, 20));
            CAPTURE(k, word(r));
            REQUIRE(r.result.status == Status::ok);
            REQUIRE((word(r) == "enter_sliding" || word(r) == "cross enter_sliding"));
            REQUIRE(std::abs(r.result.x[1]) < 1e-15);
            REQUIRE(r.result.mode[0] == 0);
            if (k == 0)
                REQUIRE(word(r) == "enter_sliding");
        }
    }
    SECTION("along a tangent from below, at a visible fold") {
        // y = x^2 / -2 + ... from below touching at (0, 0): stays below, a graze
        const auto r =
            go<TestType>(strip(minus_x, down), V2(-1, -0.5), 0, 2, bounded<2>(tol, 5'000, 20));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE((word(r) == "graze" || word(r) == "enter_sliding exit_sliding"));
        REQUIRE(r.result.x[1] == Approx(-0.5).epsilon(100 * tol));
    }
}

TEMPLATE_TEST_CASE("H13: a slide that nears its boundary stays a slide while |s| <= 1", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    for (int k = 0; k <= 160; k += 4) {
        const double gap = k == 160 ? 0 : std::pow(10.0, -2 - 0.1 * k);
        const auto r = go<TestType>(strip([gap](const auto& x) { return x * x + gap; }, down),
                                    V2(-1, 0), 0, 2, bounded<2>(tol, 5'000, 20));
        CAPTURE(gap, word(r));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(r.result.mode[0] == 0);
        REQUIRE((word(r) == "" || word(r) == "slide_extremum"));
        if (gap == 0)
            REQUIRE(word(r) == "slide_extremum");
        if (gap > 10 * tol)
            REQUIRE(word(r) == "");
        if (word(r) != "")
            REQUIRE(r.events[1].t == Approx(1).epsilon(0).margin(1e-6));
    }
}

TEMPLATE_TEST_CASE("H13: an oscillating s touches its boundary once a period, each found", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // 1 + s = 2 L1/(L1 + 1), L1 = 1 + cos 2 pi x: zero at x = 0.5, 1.5, ...
    const Plane sys = strip(
        [](const auto& x) {
            using std::cos;
            return 1 + cos(2 * pi * x);
        },
        down);
    const auto r = go<TestType>(sys, V2(0, 0), 0, 10, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    const auto touches = r.times(slide_extremum);
    REQUIRE(word(r).find("exit") == std::string::npos);
    REQUIRE(touches.size() == 10);
    for (std::size_t k = 0; k < touches.size(); ++k)
        CHECK(touches[k] == Approx(0.5 + double(k)).epsilon(0).margin(1e-7));
}

TEMPLATE_TEST_CASE(
    "H13: however fast s swings against the steps of a constant field, no exit is missed", "[hard]",
    DormandPrince5, DormandPrince8) {
    // L1 = a + cos 2 pi x < 0 around x = 0.5, 1.5, ...: one exit a unit of time, where cos 2 pi x =
    // -a
    for (int k = 0; k < 200; ++k) {
        const double a = 0.6 + 0.3 * k / 200, x0 = 0.3 * k / 200 - 0.3;
        const Plane sys = strip(
            [a](const auto& x) {
                using std::cos;
                return a + cos(2 * pi * x);
            },
            down);
        const auto r = go<TestType>(sys, V2(x0, 0), 0, 6.2, bounded<2>(1e-9));
        CAPTURE(a, x0);
        REQUIRE(r.result.status == Status::ok);
        std::vector<double> exits;
        for (double t = std::acos(-a) / (2 * pi) - x0; t < 6.2; t += 1)
            exits.push_back(t);
        const auto found = r.times(exit_sliding);
        REQUIRE(found.size() == exits.size());
        for (std::size_t i = 0; i < exits.size(); ++i)
            REQUIRE(found[i] == Approx(exits[i]).epsilon(0).margin(1e-12));
    }
}

TEMPLATE_TEST_CASE("H16: a normal component of rounding size at contact is decided by a rule",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    // contact at x = d, where L1 = +-d: from 1e-18 to 1e-12, from above and from below
    for (int k = 0; k <= 60; ++k)
        for (int sign = -1; sign <= 1; sign += 2) {
            const double d = sign * std::pow(10.0, -18 + 0.1 * k);
            CAPTURE(d, tol);
            const auto ends =
                go<TestType>(strip(minus_x, down), V2(-1 + d, 1), 0, 2, bounded<2>(tol, 5'000, 20));
            REQUIRE(ends.result.status == Status::ok);
            REQUIRE(ends.result.x[1] == Approx(-0.5).epsilon(1e-9));
            const auto begins =
                go<TestType>(strip(plus_x, down), V2(-1 + d, 1), 0, 2, bounded<2>(tol, 5'000, 20));
            REQUIRE(begins.result.status == Status::ok);
            REQUIRE(begins.result.mode[0] == 0);
            // L2 of rounding size too: L1 = 1, contact from below where L2 = +-d
            const auto above =
                go<TestType>(strip(up, plus_x), V2(-1 + d, -1), 0, 2, bounded<2>(tol, 5'000, 20));
            REQUIRE(above.result.status == Status::ok);
            REQUIRE(above.result.x[1] == Approx(0.5).epsilon(1e-9));
        }
}

TEMPLATE_TEST_CASE("H16: a first step of any size changes no event", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const double tol = GENERATE(1e-3, 1e-9, 1e-12);
    for (double first = 1e-14; first < 1; first *= 3) { // below, x does not move
        auto settings = bounded<2>(tol);
        settings.first_step = first;
        CAPTURE(tol, first);
        const auto word_of = [&](const Plane& sys) {
            const auto r = go<TestType>(sys, V2(-1, 0), 0, 2, settings);
            REQUIRE(r.result.status == Status::ok);
            return word(r);
        };
        REQUIRE(word_of(strip(up, up)) == "");
        REQUIRE(word_of(strip(down, down)) == "");
        REQUIRE(word_of(strip([](const auto& x) { return -1 - x; }, down)) == "");
        REQUIRE(word_of(strip(minus_x, down)) == "exit_sliding");
    }
    // starts on the surface, sliding and slipping
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    for (double y = -6; y <= 6; y += 0.37) {
        const auto word_of = [&](double first) {
            auto settings = bounded<2>(1e-9);
            settings.first_step = first;
            return word(run<TestType>(sys, p, V2(y, 1), 0, 20, settings));
        };
        const std::string expected = word_of(0);
        for (const double first : {1e-15, 1e-12, 1e-9, 1e-6, 1e-3}) {
            CAPTURE(y, first);
            REQUIRE(word_of(first) == expected);
        }
    }
}

// --- short visits --------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H32: a slide is kept if its ends differ, else it is a crossing", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-3, 1e-6, 1e-9, 1e-12);
    for (int k = 30; k <= 165; ++k) {
        // contact at x = -d, exit at x = 0
        const double d = std::pow(10.0, -0.1 * k);
        const auto r =
            go<TestType>(strip(minus_x, down), V2(-1 - d, 1), 0, 2, bounded<2>(tol, 5'000, 20));
        CAPTURE(d, tol, word(r));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE((word(r) == "enter_sliding exit_sliding" || word(r) == "cross"));
        if (word(r) == "enter_sliding exit_sliding") {
            REQUIRE(r.events[2].t > r.events[1].t);
            REQUIRE(r.events[2].t - r.events[1].t == Approx(d).epsilon(0).margin(4 * eps));
        }
        if (d >= 1e-12)
            REQUIRE(word(r) == "enter_sliding exit_sliding");
        REQUIRE(r.result.x[1] == Approx(-0.5 * (1 - d) * (1 - d)).epsilon(1e-9));
    }
}

TEMPLATE_TEST_CASE("H32: a slip is kept if its ends differ", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // crosses at x = -d and is back at x = d, where it sticks
    for (int k = 30; k <= 165; ++k) {
        const double d = std::pow(10.0, -0.1 * k);
        const auto r =
            go<TestType>(strip(plus_x, down), V2(-1 - d, 1), 0, 2, bounded<2>(1e-9, 5'000, 20));
        CAPTURE(d, word(r));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE((word(r) == "cross enter_sliding" || word(r) == "enter_sliding"));
        if (d >= 1e-6)
            REQUIRE(word(r) == "cross enter_sliding"); // below, its depth d^2/2 is rounding of h
    }
}

// --- backward time -------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H35: backward time undoes crossings to the tolerance", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    const models::UnitCircle sys;
    const auto p = default_params<models::UnitCircle>();
    const V2 x0(std::exp(-1.0), 0);
    const auto there = run<TestType>(sys, p, x0, 0, 1.5, bounded<2>(tol));
    REQUIRE(word(there) == "cross");
    const auto back = run<TestType>(sys, p, there.result.x, 1.5, 0, bounded<2>(tol));
    CHECK(back.result.status == Status::ok);
    CHECK(faults(back, -1) == "");
    REQUIRE(word(back) == "cross");
    CHECK(back.events[1].t == Approx(there.events[1].t).epsilon(0).margin(1000 * tol));
    CHECK(back.events[1].mode_before == there.events[1].mode_after);
    CHECK((back.result.x - x0).norm() < 1000 * tol);
}

TEMPLATE_TEST_CASE("H35: backward time undoes many crossings", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // a pendulum with a stronger spring on one side: half periods pi and pi/2
    const Plane sys([](const auto&, const auto& x) { return like(x, x[1], -x[0]); },
                    [](const auto&, const auto& x) { return like(x, x[1], -4 * x[0]); },
                    [](const auto&, const auto& x) { return x[0]; });
    const auto there = go<TestType>(sys, V2(-1, 0), 0, 20, bounded<2>(1e-11));
    const auto back = go<TestType>(sys, there.result.x, 20, 0, bounded<2>(1e-11));
    CHECK(there.result.status == Status::ok);
    CHECK(back.result.status == Status::ok);
    const auto a = there.times(cross), b = back.times(cross);
    // crossings at pi/2, pi, 5 pi/2 - pi/2 ...: gaps pi/2 (above) and pi (below) in turn
    REQUIRE(a.size() == 8);
    for (std::size_t k = 0; k + 1 < a.size(); ++k)
        CHECK(a[k + 1] - a[k] == Approx(k % 2 == 0 ? pi / 2 : pi).epsilon(0).margin(1e-8));
    REQUIRE(b.size() == a.size());
    for (std::size_t k = 0; k < a.size(); ++k)
        CHECK(b[k] == Approx(a[a.size() - 1 - k]).epsilon(0).margin(1e-8));
    CHECK((back.result.x - V2(-1, 0)).norm() < 1e-8);
}

TEMPLATE_TEST_CASE("H35: backward from a slide is ambiguous", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const Plane sys = strip(up, down);
    const auto r = go<TestType>(sys, V2(0, 0), 0, -1, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.diagnosis.what.find("repulsive") != std::string_view::npos);
    const auto p = default_params<models::Oscillator>();
    const auto stuck = run<TestType>(models::Oscillator{}, p, V2(1, 1), 1, 0, bounded<2>(1e-9));
    CHECK(stuck.result.status == Status::ambiguous);
    CHECK(stuck.result.t == 1);
    // a repulsive slide attracts in backward time
    const auto out = go<TestType>(strip(down, up), V2(0, -0.5), 0, -1, bounded<2>(1e-9));
    CHECK(out.result.status == Status::ok);
    check_events(out.events, {{enter_sliding, -0.5}}, 1e-15);
    CHECK(out.result.x[0] == Approx(-1).epsilon(1e-14));
}

// --- static friction -----------------------------------------------------------------------------

TEMPLATE_TEST_CASE(
    "H38: static friction above kinetic is the named model, and it stick-slips in closed form",
    "[hard]", DormandPrince5, DormandPrince8) {
    // weight 10, mu_0 = 0.3, mu_s = 0.4, no forcing: sticks until y = 4, slips as y - 3 = cos + sin
    // for 3 pi/2, sticks again at y = 2, and so on with period 2 + 3 pi/2
    const models::Stiction sys;
    auto p = default_params<models::Stiction>();
    p[0] = 0;
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    const auto r = run<TestType>(sys, p, V2(0, 1), 0, 30, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(faults(r) == "");
    std::vector<Expected> expected;
    for (double t = 4; t < 30; t += 2 + 1.5 * pi) {
        expected.push_back({exit_sliding, t});
        if (t + 1.5 * pi < 30)
            expected.push_back({enter_sliding, t + 1.5 * pi});
    }
    check_events(r.events, expected, 1000 * tol);
    CHECK(r.events[1].x_right[0] == Approx(4).epsilon(0).margin(1e-14));
    CHECK(r.events[2].x_right[0] == Approx(2).epsilon(0).margin(100 * tol));
}

TEMPLATE_TEST_CASE("H38: between kinetic and static friction a stick is kept, beyond it slips",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const models::Stiction sys;
    auto p = default_params<models::Stiction>();
    p[0] = 0;
    for (const double y : {-3.9, -3.5, -3.0, -2.0, 0.0, 2.0, 3.0, 3.5, 3.9, 3.999999}) {
        const auto r = run<TestType>(sys, p, V2(y, 1), 0, 1e-8, bounded<2>(1e-9));
        CHECK(r.result.status == Status::ok);
        CHECK(r.events[0].mode_after[0] == 0);
    }
    CHECK(run<TestType>(sys, p, V2(4.1, 1), 0, 1e-3, bounded<2>(1e-9)).events[0].mode_after[0] ==
          -1);
    CHECK(run<TestType>(sys, p, V2(-4.1, 1), 0, 1e-3, bounded<2>(1e-9)).events[0].mode_after[0] ==
          +1);
    const auto edge = run<TestType>(sys, p, V2(4, 1), 0, 1e-3, bounded<2>(1e-9));
    CHECK(edge.result.status == Status::ok);
    CHECK(edge.events[0].mode_after[0] == -1);
    CHECK(word(edge) == "");
}
