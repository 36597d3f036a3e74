// SPDX-License-Identifier: BSD-3-Clause
// Hard cases of finding an event and landing on it: H1-H4, H21-H25, H28, H29, H40, H42, user
// sections. Constant fields make the solution exact: what is left is the location's own error.
#include "hard.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/quartet.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

using namespace filippov;
using enum EventKind;

namespace {

constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

const auto turn = [](const auto&, const auto& x) { return like(x, x[1], -x[0]); };
const auto right = [](const auto&, const auto& x) { return like(x, 1, 0); };
const auto left = [](const auto&, const auto& x) { return like(x, -1, 0); };
const auto forward = [](const auto&, const auto& x) { return like(x, 1); };

/// x = sin t below the line x = 1; above it everything returns.
Plane grazing() {
    return {turn, left, [](const auto&, const auto& x) { return x[0] - 1; }};
}
/// x' = 1 + b cos t beneath x = c + a cos wt.
struct Swinging {
    static constexpr int dim = 1;
    double a, b, c, w;
    template <Scalar S> Vec<S, 1> f1(const S& t, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        using std::cos;
        return like(x, S(1) + S(b) * cos(t));
    }
    template <Scalar S> Vec<S, 1> f2(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        return like(x, -300);
    }
    template <Scalar S> S h(const S& t, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        using std::cos;
        return x[0] - S(c) - S(a) * cos(S(w) * t);
    }
};

/// x' = 1 through x = 0.5.
Line gate() {
    return {forward, forward, [](const auto&, const auto& x) { return x[0] - 0.5; }};
}

} // namespace

// --- H1, H2 --------------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H1: a touch from below is a graze at the extremum and changes no mode",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    const auto r = go<TestType>(grazing(), V2(0, 1), 0, 3, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "graze");
    // the extremum is where x' = 0: its time is as good as x'
    CHECK(r.events[1].t == Approx(pi / 2).epsilon(0).margin(100 * tol));
    CHECK(std::abs(r.events[1].x_right[1]) <
          0.01 * tol + 1e-10); // a landing may leave a hundredth of the tolerance
    CHECK(r.events[1].mode_before == r.events[1].mode_after);
    CHECK(r.events[1].mode_after[0] == -1);
    CHECK(r.events[1].surface == 0);
    CHECK(r.result.x[0] == Approx(std::sin(3.0)).epsilon(0).margin(100 * tol));
}

TEMPLATE_TEST_CASE("H1: a touch from above, on a surface that moves, is a graze too", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // x = 1 - t, so that h = (t - 1)^2 along the path; below everything rises
    const Line sys([](const auto&, const auto& x) { return like(x, 5); },
                   [](const auto&, const auto& x) { return like(x, -1); },
                   [](const auto& t, const auto& x) { return x[0] - 1 + t + (t - 1) * (t - 1); });
    const auto r = go<TestType>(sys, V1(1), 0, 2, bounded<1>(1e-9));
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "graze");
    CHECK(r.events[1].t == Approx(1).epsilon(0).margin(1e-9));
    CHECK(r.events[1].mode_after[0] == 1);
    CHECK(r.result.x[0] == Approx(-1).epsilon(0).margin(1e-14));
}

TEMPLATE_TEST_CASE("H2: a touch some ulp short or deep is answered alike", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    std::size_t n_other = 0;
    for (int k = -200; k <= 200; ++k) {
        const auto r = go<TestType>(grazing(), V2(0, 1 + k * eps), 0, 3, bounded<2>(tol));
        REQUIRE(r.result.status == Status::ok);
        if (word(r) != "graze")
            ++n_other;
        REQUIRE(r.result.x[0] == Approx(std::sin(3.0)).epsilon(0).margin(100 * tol));
    }
    CHECK(n_other == 0);
}

TEMPLATE_TEST_CASE(
    "H2: from a miss over a touch to a slide the answer changes twice, not back and forth",
    "[hard]", DormandPrince5, DormandPrince8) {
    // start (0, 1 + d): |d| from 1e-3 to 1e-16 below, then up again above
    std::vector<std::string> words;
    for (int sign = -1; sign <= 1; sign += 2)
        for (int k = 0; k <= 260; ++k) {
            const double size = std::pow(10.0, -3 - 0.05 * (sign < 0 ? k : 260 - k));
            const auto r = go<TestType>(grazing(), V2(0, 1 + sign * size), 0, 3, bounded<2>(1e-9));
            REQUIRE(r.result.status == Status::ok);
            if (words.empty() || words.back() != word(r))
                words.push_back(word(r));
        }
    CHECK(words == std::vector<std::string>{"", "graze", "enter_sliding exit_sliding"});
}

TEMPLATE_TEST_CASE(
    "H2: where the far side leads away, a touch is one of two answers or said to be ambiguous",
    "[hard]", DormandPrince5, DormandPrince8) {
    const Plane sys(turn, right, [](const auto&, const auto& x) { return x[0] - 1; });
    for (int k = -200; k <= 200; ++k) {
        const auto r = go<TestType>(sys, V2(0, 1 + k * 1e-12), 0, 3, bounded<2>(1e-10));
        CAPTURE(k, word(r), r.result.message());
        if (r.result.status == Status::ambiguous) { // exactly tangent, both ways are solutions
            REQUIRE(r.result.t == Approx(pi / 2).epsilon(0).margin(1e-4));
            continue;
        }
        REQUIRE(r.result.status == Status::ok);
        REQUIRE((word(r) == "cross" || word(r) == "graze" || word(r) == ""));
        REQUIRE(r.result.x[0] == Approx(word(r) == "cross" ? 1 + 3 - r.events[1].t : std::sin(3.0))
                                     .epsilon(0)
                                     .margin(1e-7));
    }
    // a depth of 1e-5 is plainly there, a gap of 1e-5 plainly not
    CHECK(word(go<TestType>(sys, V2(0, 1 + 1e-5), 0, 3, bounded<2>(1e-10))) == "cross");
    CHECK(word(go<TestType>(sys, V2(0, 1 - 1e-5), 0, 3, bounded<2>(1e-10))) == "");
}

// --- H3, H4 --------------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H3: two crossings inside one step are both found", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // h > 0 for |x - 0.5| < w: one step over everything would see h < 0 at both ends
    const double w = GENERATE(0.3, 0.1, 1e-2, 1e-3, 1e-4);
    const Plane sys(right, right, [w](const auto&, const auto& x) {
        return w * w - (x[0] - 0.5) * (x[0] - 0.5);
    });
    for (int k = 0; k < 50; ++k) {
        const double start = -0.02 * k;
        const auto r = go<TestType>(sys, V2(start, 0), 0, 2, bounded<2>(1e-9));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(word(r) == "cross cross");
        // h is flat: eps/w in its root
        REQUIRE(r.events[1].x_right[0] == Approx(0.5 - w).epsilon(0).margin(8 * eps / w));
        REQUIRE(r.events[2].x_right[0] == Approx(0.5 + w).epsilon(0).margin(8 * eps / w));
        REQUIRE(r.events[1].t == Approx(0.5 - w - start).epsilon(0).margin(8 * eps / w));
    }
}

TEMPLATE_TEST_CASE("H4: many roots in a step are all found, in order", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // (the field is constant: no error estimate bounds a step)
    const double frequency = GENERATE(10.0, 30.0, 70.0, 100.0, 300.0, 3000.0);
    const Line sys(forward, forward, [frequency](const auto&, const auto& x) {
        using std::sin;
        return sin(frequency * x[0]) + 0.5;
    });
    std::vector<double> roots;
    for (int k = 0;; ++k) {
        const double root = ((k % 2 == 0 ? 7 : 11) * pi / 6 + 2 * pi * (k / 2)) / frequency;
        if (root > 1)
            break;
        roots.push_back(root);
    }
    const auto r = go<TestType>(sys, V1(0), 0, 1, bounded<1>(1e-9));
    CHECK(r.result.status == Status::ok);
    const auto found = r.times(cross);
    REQUIRE(found.size() == roots.size());
    for (std::size_t k = 0; k < roots.size(); ++k)
        REQUIRE(found[k] == Approx(roots[k]).epsilon(0).margin(1e-14 + double(k) * eps));
}

TEMPLATE_TEST_CASE("H4: the first contact with a surface that swings is found, whatever the field",
                   "[hard]", DormandPrince5, DormandPrince8, Rodas5P) {
    // x' = 1 + b cos t beneath x = c + a cos wt: the field alone allows steps of many swings
    const double b = GENERATE(0.0, 0.3);
    std::mt19937_64 random(7);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<>(from, to)(random);
    };
    int missed = 0;
    for (int k = 0; k < 60; ++k) {
        const double a = uniform(0.5, 9), c = uniform(10, 20), w = std::pow(10, uniform(0, 2));
        const auto h_at = [&](double t) { return t + b * std::sin(t) - c - a * std::cos(w * t); };
        double before = 0, after = 0;
        while (!(h_at(after) > 0)) {
            before = after;
            after += 1e-3 / w;
        }
        for (int i = 0; i < 60; ++i)
            (h_at((before + after) / 2) > 0 ? after : before) = (before + after) / 2;
        const Swinging sys{a, b, c, w};
        const auto r = run<TestType>(sys, {}, V1(0), 0, 30, bounded<1>(1e-8, 100'000, 1));
        REQUIRE(r.events.size() > 1);
        missed += std::abs(r.events[1].t - after) > 1e-5;
    }
    CHECK(missed == 0);
}

TEMPLATE_TEST_CASE("H4: what looks like swings and is rounding of h holds no step back", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // h within 1e-7 of the sum of its terms, from starts where the first steps are tiny
    const double large = GENERATE(0.0, 1e3, 1e6, 1e9, 1e12), start = GENERATE(0.0, 1e-20, 0.9);
    const Line moves(forward, forward, [large](const auto& t, const auto& x) {
        return ((x[0] + t - 2.0) + large) - large;
    });
    const auto r = go<TestType>(moves, V1(start), 0, 3, bounded<1>(1e-9));
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.x[0] == Approx(start + 3).epsilon(1e-12));
    CHECK(r.result.counters.steps < 60);

    // far from a surface, through the origin of a state at rest there
    const Line far([](const auto& t, const auto& x) { return like(x, cos(t) - x[0]); }, forward,
                   [](const auto&, const auto& x) { return x[0] - 100; });
    const auto q = go<TestType>(far, V1(0), 0.75 * pi, 2 * pi, bounded<1>(1e-9));
    CHECK(q.result.status == Status::ok);
    CHECK(q.result.counters.steps < 500);
}

TEMPLATE_TEST_CASE("H4: the roots of a section that swings are all found, whatever the field",
                   "[hard]", DormandPrince5, DormandPrince8, Rodas5P) {
    const double w = GENERATE(5.0, 10.0, 50.0, 300.0);
    EventLog<double, 1, 1> log;
    const auto swing = sections(Section{[w](const auto& t, const auto&, const auto&) {
        using std::cos;
        return cos(w * t);
    }});
    const Swinging sys{0, 0, 1e6, 1};
    const auto result =
        flow<TestType>(sys, Vec<double, 0>(), V1(0), 0, 10, bounded<1>(1e-8), log, swing);
    CHECK(result.status == Status::ok);
    CHECK(log.events.size() == 2 + std::size_t(w * 10 / pi + 0.5));
}

TEMPLATE_TEST_CASE("H4: three roots close to each other are three events", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const double d =
        GENERATE(0.2, 0.05, 0.01); // below, h stays within the tolerance between the roots
    const Line sys(forward, forward, [d](const auto&, const auto& x) {
        return (x[0] - 0.5 + d) * (x[0] - 0.5) * (x[0] - 0.5 - d);
    });
    const auto r = go<TestType>(sys, V1(0), 0, 1, bounded<1>(1e-9));
    CHECK(r.result.status == Status::ok);
    REQUIRE(word(r) == "cross cross cross");
    for (int k = 0; k < 3; ++k)
        CHECK(r.events[std::size_t(k + 1)].t ==
              Approx(0.5 + (k - 1) * d).epsilon(0).margin(8 * eps * 0.25 / (d * d)));
}

// --- H21, H22 ------------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H20: a state that an h hardly depends on is not moved to be on its surface",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // x' = 0: whatever rounding leaves of h, which is a function of time but for k x
    const auto rest = [](const auto&, const auto& x) { return like(x, x[0] * 0, x[0] * 0 - 1); };
    const auto go_on = [](const auto&, const auto& x) { return like(x, x[0] * 0, x[0] * 0 + 1); };
    const auto ends_at_rest = [&](const auto& h, double t0) {
        const Plane sys(rest, go_on, h);
        const auto r = go<TestType>(sys, V2(1, 0), t0, t0 + 20, bounded<2>(1e-10));
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.times(cross).size() >= 6);
        CHECK(r.result.x[0] == 1);
    };
    for (const double k : {1e-18, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3}) {
        CAPTURE(k);
        const auto h = [k](const auto& t, const auto& x) {
            using std::sin;
            return sin(t) + 0.3 + k * x[0];
        };
        ends_at_rest(h, 0.5);
        ends_at_rest(h, 1e6);
    }
    const auto product = [](const auto& t, const auto& x) {
        using std::exp;
        using std::sin;
        return (sin(t) + 0.3) * exp(x[0]);
    };
    ends_at_rest(product, 0.5);
    ends_at_rest(product, 1e4);
}

TEMPLATE_TEST_CASE("H21: a surface without gradient is refused with the point", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto rise = [](const auto&, const auto& x) { return like(x, x[1], 1); };
    const auto fall = [](const auto&, const auto& x) { return like(x, x[1], -1); };
    const int power = GENERATE(2, 3);
    const Plane sys(rise, fall, [power](const auto&, const auto& x) {
        return power == 2 ? -x[1] * x[1] : x[1] * x[1] * x[1];
    });
    const auto r = go<TestType>(sys, V2(0, -1), 0, 2, bounded<2>(1e-9));
    CHECK(r.result.status == Status::degenerate_surface);
    // v^2 and v^3 are rounding, and no root can be told, below 1e-8 and 1e-5
    CHECK(r.result.diagnosis.x[1] == Approx(0).margin(1e-4));
    CHECK(r.result.diagnosis.t == Approx(1).margin(1e-4));
    CHECK(r.result.diagnosis.surface == 0);
    CHECK(r.result.message().find("grad h") != std::string::npos);

    const auto at_once = go<TestType>(sys, V2(0, 0), 0, 2, bounded<2>(1e-9));
    CHECK(at_once.result.status == Status::degenerate_surface);
    CHECK(at_once.result.t == 0);
}

TEMPLATE_TEST_CASE("H21: a curved surface that is touched by motion along it has a gradient",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // h = y - x^2: met at x = 0, where only x moves; from below it is touched, y being -1e-12
    const double slope = GENERATE(1.0, 1e-5, 1e5);
    const Plane sys(right, right,
                    [slope](const auto&, const auto& x) { return x[1] - slope * x[0] * x[0]; });
    const auto touch = go<TestType>(sys, V2(-1, 0), 0, 3, bounded<2>(1e-9));
    CHECK(touch.result.status == Status::ok);
    CHECK(word(touch) == "graze");
    // h = y - x^3: crossed there
    const Plane cubic(right, right, [slope](const auto&, const auto& x) {
        return x[1] - slope * x[0] * x[0] * x[0];
    });
    const auto crossed = go<TestType>(cubic, V2(-1, 0), 0, 3, bounded<2>(1e-9));
    CHECK(crossed.result.status == Status::ok);
    CHECK(word(crossed) == "cross");
}

TEMPLATE_TEST_CASE("H21: a start where two branches of a surface cross is refused", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const Plane sys(right, right, [](const auto&, const auto& x) { return x[0] * x[1]; });
    const auto r = go<TestType>(sys, V2(0, 0), 0, 1, bounded<2>(1e-9));
    CHECK(r.result.status == Status::degenerate_surface);
}

TEMPLATE_TEST_CASE("H22: kinks of h are crossed where they should be", "[hard]", DormandPrince5,
                   DormandPrince8) {
    SECTION("a kink away from the roots") {
        const Plane sys([](const auto&, const auto& x) { return like(x, 1, 0.3); },
                        [](const auto&, const auto& x) { return like(x, 1, -1); },
                        [](const auto&, const auto& x) {
                            using std::abs;
                            return abs(x[0] - 0.7) * 2 + x[1] - 0.9;
                        });
        const auto r = go<TestType>(sys, V2(0, 0), 0, 2, bounded<2>(1e-9));
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{cross, 1.0 / 6}, {cross, (2.3 + 1.0 / 6 + 0.05) / 2.3}}, 1e-14);
    }
    SECTION("a kink at the root") {
        const double slope = GENERATE(0.5, 0.9, -0.9);
        const Line sys(forward, forward, [slope](const auto&, const auto& x) {
            using std::abs;
            return x[0] - 0.5 + slope * abs(x[0] - 0.5);
        });
        const auto r = go<TestType>(sys, V1(0), 0, 1, bounded<1>(1e-9));
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{cross, 0.5}}, 1e-12);
    }
    SECTION("a corner that is only touched") {
        // the peak of h at x = 0.5 is a point, height -1e-3: nothing happens
        const Line sys(forward, forward, [](const auto&, const auto& x) {
            using std::abs;
            return -abs(x[0] - 0.5) - 1e-3;
        });
        const auto r = go<TestType>(sys, V1(0), 0, 1, bounded<1>(1e-9));
        CHECK(r.result.status == Status::ok);
        CHECK(word(r) == "");
        CHECK(r.result.x[0] == Approx(1).epsilon(1e-15));
    }
    SECTION("a narrow peak that is passed") {
        const double width = GENERATE(0.05, 0.01, 2e-3);
        auto settings = bounded<1>(1e-9);
        settings.max_step =
            4 * width; // a constant field takes any step: what is narrower must be said
        const Line sys(forward, forward, [width](const auto&, const auto& x) {
            using std::abs;
            return width - abs(x[0] - 0.5);
        });
        const auto r = go<TestType>(sys, V1(0), 0, 1, settings);
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{cross, 0.5 - width}, {cross, 0.5 + width}}, 1e-14);
    }
}

TEMPLATE_TEST_CASE("H22: a jump of h in time is an event at the jump", "[hard]", DormandPrince5,
                   DormandPrince8) {
    const double at = GENERATE(1.0, 0.3, 1.7320508);
    const Line sys([](const auto&, const auto& x) { return like(x, 0.1); },
                   [](const auto&, const auto& x) { return like(x, -0.1); },
                   [at](const auto& t, const auto& x) { return t < at ? x[0] - 1 : x[0] + 1; });
    const auto r = go<TestType>(sys, V1(0), 0, 2, bounded<1>(1e-9));
    CHECK(r.result.status == Status::ok);
    check_events(r.events, {{cross, at}}, 4 * eps);
    CHECK(r.events[1].x_right[0] ==
          Approx(0.1 * at).epsilon(1e-14)); // not moved onto a surface that is not there
    CHECK(r.result.x[0] == Approx(0.1 * at - 0.1 * (2 - at)).margin(1e-15));
}

TEMPLATE_TEST_CASE("H22: an h that changes its sign at a pole is crossed there", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // x = cos t, v = -sin t: v/x = -tan t
    const auto turn = [](const auto&, const auto& x) {
        auto f = x;
        f[0] = x[1];
        f[1] = -x[0];
        return f;
    };
    const double tol = GENERATE(1e-4, 1e-8, 1e-11), level = GENERATE(0.5, -2.0, 30.0);
    const double pi = std::numbers::pi;
    const bool third = GENERATE(false, true);
    const Plane sys(turn, turn, [=](const auto&, const auto& x) {
        const auto ratio = x[1] / x[0];
        return (third ? ratio * ratio * ratio : ratio) - level;
    });
    CAPTURE(third, level, tol);
    const auto r = go<TestType>(sys, V2(1, 0), 0, 9, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    std::vector<Expected> events;
    const double root = -std::atan(third ? std::cbrt(level) : level);
    for (int k = 0; k < 4; ++k)
        for (const double t : {(k + 0.5) * pi, root + k * pi})
            if (t > 0 && t < 9)
                events.push_back({cross, t});
    std::sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
    check_events(r.events, events, 200 * tol);
}

TEMPLATE_TEST_CASE("H22: a surface that jumps away leaves a slide behind", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // x slides on c(t), which rises by J from t = 1 on within a time w, and then waits for x.
    const double tol = GENERATE(1e-4, 1e-7, 1e-10);
    const double J = GENERATE(-3.0, -0.01, 0.01, 0.4, 3.0);
    const double w = GENERATE(0.0, 1e-12, 1e-8, 1e-4);
    const double along = GENERATE(-0.3, 0.0, 0.2);
    const auto c = [=](const auto& t) {
        using S = std::decay_t<decltype(t)>;
        const S rise = t < S(1) ? S(0) : t < S(1 + w) ? S((t - 1) / w * J) : S(J);
        return S(along * t + rise);
    };
    const Plane sys([](const auto&, const auto& x) { return like(x, 1, 1); },
                    [](const auto&, const auto& x) { return like(x, 1, -1); },
                    [c](const auto& t, const auto& x) {
                        using S = typename std::decay_t<decltype(x)>::Scalar;
                        return S(x[1] - c(S(t)));
                    });
    const double up = J > 0 ? 1 : -1, back = 1 + std::abs(J) / (1 - up * along);
    INFO("tolerance " << tol << ", J " << J << ", w " << w << ", along " << along);
    const auto r = go<TestType>(sys, V2(0, 0), 0, back + 1, bounded<2>(tol, 20'000));
    CHECK(r.result.status == Status::ok);
    REQUIRE(r.times(EventKind::exit_sliding).size() == 1);
    REQUIRE(r.times(EventKind::enter_sliding).size() == 1);
    CHECK(r.times(EventKind::exit_sliding)[0] == Approx(1).margin(tol + w));
    CHECK(r.times(EventKind::enter_sliding)[0] == Approx(back).margin(10 * tol + 2 * w));
    CHECK(r.result.x[1] == Approx(along * (back + 1) + J).margin(10 * tol));
}

TEMPLATE_TEST_CASE("H22: a curved surface that jumps at a place leaves a slide behind", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-6, 1e-10);
    const double curved = GENERATE(0.0, 0.05, 0.3);
    const double J = GENERATE(-1.0, -0.05, 0.1, 0.7);
    const Plane sys([](const auto&, const auto& x) { return like(x, 0.7, 1.5); },
                    [](const auto&, const auto& x) { return like(x, 0.7, -1.3); },
                    [=](const auto&, const auto& x) {
                        using std::sin;
                        using S = typename std::decay_t<decltype(x)>::Scalar;
                        return S(x[1] - curved * sin(x[0]) - (x[0] < S(0.6) ? 0.0 : J));
                    });
    const double away = 0.2 * std::abs(J) / 2, end = 0.6 / 0.7 + away;
    const auto r = go<TestType>(sys, V2(0, 0), 0, end, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "exit_sliding");
    CHECK(
        r.result.x[1] ==
        Approx(curved * std::sin(0.6) + (J > 0 ? 1.5 : -1.3) * away).epsilon(0).margin(100 * tol));
}

TEMPLATE_TEST_CASE("H22: what cancels within h moves no slide off its surface", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-7, 1e-11);
    const Plane sys([](const auto&, const auto& x) { return like(x, 1, 1); },
                    [](const auto&, const auto& x) { return like(x, 1, -1); },
                    [](const auto& t, const auto& x) {
                        using std::sin; // known to 1e-7 only
                        return (x[1] - 0.3 * sin(t) + 1e9) - 1e9;
                    });
    const auto r = go<TestType>(sys, V2(0, 0), 0, 20, bounded<2>(tol));
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "");
    CHECK(r.result.x[1] == Approx(0.3 * std::sin(20)).margin(1e-6));
}

TEMPLATE_TEST_CASE("H22: an h of infinite slope ends in an event or a status", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const Line sys(forward, forward, [](const auto&, const auto& x) {
        using std::sqrt;
        return x[0] < 0.5 ? -sqrt(0.5 - x[0]) : sqrt(x[0] - 0.5);
    });
    const auto r = go<TestType>(sys, V1(0), 0, 1, bounded<1>(1e-9));
    if (r.result.status == Status::ok) {
        check_events(r.events, {{cross, 0.5}}, 1e-9);
        CHECK(r.result.x[0] == Approx(1).epsilon(1e-9)); // the landing is as good as the tolerance
    } else {
        CHECK((r.result.status == Status::not_finite ||
               r.result.status == Status::degenerate_surface));
        CHECK(r.result.diagnosis.t == Approx(0.5).margin(1e-9));
    }
}

// --- H23, H24, H25 -------------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H23: NaN and infinity are reported with function, time and state", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double bad = std::array{no_number, inf, -inf}[std::size_t(GENERATE(0, 1, 2))];
    CAPTURE(bad);
    const auto settings = bounded<1>(1e-9);
    const auto far = [](const auto&, const auto& x) { return x[0] - 10; };
    SECTION("f1 after t = 0.5") {
        const Line sys(
            [bad](const auto& t, const auto& x) { return t < 0.5 ? like(x, 1) : like(x, bad); },
            forward, far);
        const auto r = go<TestType>(sys, V1(0), 0, 2, settings);
        CHECK(r.result.status == Status::not_finite);
        CHECK(r.result.diagnosis.what == "f1");
        CHECK(r.result.t == Approx(0.5).epsilon(0).margin(1e-9));
        CHECK(r.result.t <= 0.5);
        CHECK(r.result.x[0] == Approx(r.result.t).epsilon(1e-12)); // the last good state
    }
    SECTION("f2 beyond x = 0.5") {
        const Line sys(
            forward,
            [bad](const auto&, const auto& x) { return x[0] < 0.5 ? like(x, 1) : like(x, bad); },
            [](const auto&, const auto& x) { return x[0] + 10; });
        const auto r = go<TestType>(sys, V1(0), 0, 2, settings);
        CHECK(r.result.status == Status::not_finite);
        CHECK(r.result.diagnosis.what == "f2");
        CHECK(r.result.x[0] == Approx(0.5).epsilon(0).margin(1e-9));
    }
    SECTION("h after t = 0.5") {
        const Line sys(forward, forward, [bad](const auto& t, const auto& x) {
            return t < 0.5 ? x[0] - 10 : x[0] * bad;
        });
        const auto r = go<TestType>(sys, V1(0.1), 0, 2, settings);
        CHECK(r.result.status == Status::not_finite);
        CHECK(r.result.diagnosis.what == "h");
        CHECK(r.result.t == Approx(0.5).epsilon(0).margin(1e-9));
    }
    SECTION("h ends with an infinite rate, far from its root") {
        const Line sys(forward, forward, [](const auto& t, const auto& x) {
            using std::sqrt;
            return x[0] - 300 + sqrt(20 - t);
        });
        const auto r = go<TestType>(sys, V1(0), 0, 30, settings);
        CHECK(r.result.status == Status::not_finite);
        CHECK(r.result.diagnosis.what == "h");
        CHECK(r.result.t == Approx(20).epsilon(0).margin(1e-6));
        CHECK(r.result.x[0] == Approx(20).epsilon(0).margin(1e-6)); // it was put on the surface
    }
    SECTION("at the start") {
        const Line f(([bad](const auto&, const auto& x) { return like(x, bad); }), forward, far);
        const auto rf = go<TestType>(f, V1(0), 0, 2, settings);
        CHECK(rf.result.status == Status::not_finite);
        CHECK(rf.result.diagnosis.what == "f1");
        CHECK(rf.result.t == 0);
        const Line h(forward, forward,
                     [bad](const auto&, const auto& x) { return x[0] * 0 + bad; });
        const auto rh = go<TestType>(h, V1(0), 0, 2, settings);
        CHECK(rh.result.status == Status::not_finite);
        CHECK(rh.result.diagnosis.what == "h");
        CHECK(rh.result.counters.steps == 0);
    }
    SECTION("the other side at contact") {
        const Line sys(
            forward, [bad](const auto&, const auto& x) { return like(x, bad); },
            [](const auto&, const auto& x) { return x[0] - 0.5; });
        const auto r = go<TestType>(sys, V1(0), 0, 2, settings);
        CHECK(r.result.status == Status::not_finite);
        CHECK(r.result.diagnosis.what == "f2");
        CHECK(r.result.diagnosis.surface == 0);
        CHECK(r.result.t == Approx(0.5).epsilon(1e-15));
        CHECK(r.result.x[0] == Approx(0.5).epsilon(1e-15));
    }
}

TEMPLATE_TEST_CASE("H23: a field that is not finite while sliding is reported", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const Plane sys([](const auto& t,
                       const auto& x) { return t < 0.5 ? like(x, 1, 1) : like(x, no_number, 1); },
                    [](const auto&, const auto& x) { return like(x, 1, -1); },
                    [](const auto&, const auto& x) { return x[1]; });
    const auto r = go<TestType>(sys, V2(0, 0), 0, 2, bounded<2>(1e-9));
    CHECK(r.result.status == Status::not_finite);
    CHECK(r.result.diagnosis.what == "sliding field");
    CHECK(r.result.t == Approx(0.5).epsilon(0).margin(1e-9));
    CHECK(r.result.mode[0] == 0);
}

TEMPLATE_TEST_CASE("H24: a finite-time blow-up ends near its time with a good state", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto square = [](const auto&, const auto& x) { return like(x, x[0] * x[0]); };
    const Line sys(square, square, [](const auto&, const auto& x) { return x[0] * 0 - 1; });
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    const auto r = go<TestType>(sys, V1(1), 0, 2, bounded<1>(tol));
    CHECK(r.result.status == Status::step_too_small);
    CHECK(r.result.t == Approx(1).epsilon(0).margin(100 * tol));
    CHECK(r.result.x[0] > 1e9);
    CHECK(std::isfinite(r.result.x[0]));
    CHECK(r.result.message().find("blow up") != std::string::npos);
}

TEMPLATE_TEST_CASE("H25: a field that ends at its surface is followed to it", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // u = sqrt(-x): -2 u u' = 1 + u, so that x = 0 at 2 (1 - ln 2)
    const Line sys(
        [](const auto&, const auto& x) {
            using std::sqrt;
            return like(x, 1 + sqrt(-x[0]));
        },
        [](const auto&, const auto& x) {
            using std::sqrt;
            return like(x, -1 - sqrt(x[0]));
        },
        [](const auto&, const auto& x) { return x[0]; });
    const double tol = GENERATE(1e-3, 1e-6, 1e-9);
    const double start = GENERATE(-1.0, 1.0);
    const auto r = go<TestType>(sys, V1(start), 0, 2, bounded<1>(tol));
    CHECK(r.result.status == Status::ok);
    check_events(r.events, {{enter_sliding, 2 * (1 - std::log(2.0))}}, 100 * tol);
    CHECK(r.result.x[0] == 0);
    CHECK(r.result.mode[0] == 0);
}

TEMPLATE_TEST_CASE("H25: a field that ends at a surface far from zero is followed to it", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // u = place - x has the rounding of x, and f1 has one derivative, two or three there, or none
    const double power = GENERATE(0.5, 1.5, 2.5);
    const double place = GENERATE(0.0, 0.3, 1.0, 1000.0);
    const double tol = GENERATE(1e-4, 1e-6, 1e-9, 1e-12);
    const Line sys(
        [=](const auto&, const auto& x) {
            using std::pow;
            return like(x, 2 + pow(place - x[0], power));
        },
        [](const auto&, const auto& x) { return like(x, 3); },
        [=](const auto&, const auto& x) { return x[0] - place; });
    // t = int du / (2 + u^q), u = w^2: a smooth integrand
    const double t =
        simpson([&](double w) { return 2 * w / (2 + std::pow(w, 2 * power)); }, 0, 1, 4000);
    const double error = 10 * tol * (1 + place);
    const auto r = go<TestType>(sys, V1(place - 1), 0, 1, bounded<1>(tol));
    INFO("power " << power << ", at " << place << ", tol " << tol << r.result.message());
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "cross");
    CHECK(r.events[1].t == Approx(t).epsilon(0).margin(error));
    CHECK(r.result.x[0] == Approx(place + 3 * (1 - t)).epsilon(0).margin(3 * error));
}

TEMPLATE_TEST_CASE("H25: a slide ends where friction grows or falls like a root of the speed",
                   "[hard]", DormandPrince5, DormandPrince8) {
    // beyond t = 1: u' = t - 1 - k sqrt(u), so u = (z (t - 1))^2 with 2 z^2 + k z = 1
    const double k = GENERATE(0.5, 0.01, -0.3, -2.0);
    const double belt = GENERATE(0.7, 2.0, -30.0);
    const double tol = GENERATE(1e-6, 1e-9, 1e-12);
    const auto side = [=](double sign) {
        return [=](const auto& t, const auto& x) {
            using std::sqrt;
            return like(x, t - sign * (1 + k * sqrt(sign * (x[0] - belt))));
        };
    };
    const Line sys(side(-1), side(+1), [=](const auto&, const auto& x) { return x[0] - belt; });
    const auto r = go<TestType>(sys, V1(belt), 0, 2, bounded<1>(tol));
    const double z = (std::sqrt(k * k + 8) - k) / 4;
    INFO("k " << k << ", belt " << belt << ", tol " << tol << r.result.message());
    CHECK(r.result.status == Status::ok);
    CHECK(word(r) == "exit_sliding");
    CHECK(r.events[1].t == Approx(1).epsilon(1e-14));
    // an error in sqrt(u) of the size of sqrt(tol), at sqrt(u) = sqrt(tol), falls like
    // (t - 1)^(-1 / (2 z^2)): slowly where friction falls fast
    const double carried = std::pow(tol, std::min(1.0, (1 + 0.5 / (z * z)) / 2));
    CHECK(r.result.x[0] - belt ==
          Approx(z * z).epsilon(0).margin(100 * carried * (1 + std::abs(belt))));
}

TEMPLATE_TEST_CASE("H25: a field that ends a little beyond its surface is landed exactly", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double gap = GENERATE(1e-1, 1e-3, 1e-6, 1e-9);
    const auto field = [gap](double x) { return 1 + 0.1 * std::log(gap - x); };
    const Line sys(
        [gap](const auto&, const auto& x) {
            using std::log;
            return like(x, 1 + 0.1 * log(gap - x[0]));
        },
        [](const auto&, const auto& x) { return like(x, 1); },
        [](const auto&, const auto& x) { return x[0]; });
    // for gap < e^-10 the field turns negative before x = 0: such an orbit stays below
    const double turn_at = gap - std::exp(-10.0);
    const auto r = go<TestType>(sys, V1(-1), 0, 20, bounded<1>(1e-9));
    CHECK(r.result.status == Status::ok);
    if (turn_at > 0) {
        // dt = dx / f(x) with x = gap - e^-z: a smooth integrand
        const double t_hit =
            simpson([&](double z) { return std::exp(-z) / field(gap - std::exp(-z)); },
                    -std::log(1 + gap), -std::log(gap), 20000);
        REQUIRE(word(r) == "cross");
        CHECK(r.events[1].t == Approx(t_hit).epsilon(0).margin(1e-7));
        CHECK(std::abs(r.events[1].x_right[0]) < 1e-16);
    } else {
        CHECK(word(r) == "");
        CHECK(r.result.x[0] < 0);
    }
}

TEMPLATE_TEST_CASE("H25: the other side's field is not called here", "[hard]", DormandPrince5,
                   DormandPrince8) {
    static double farthest; // how far from the surface f2 was asked
    static bool early;      // f2 was asked before contact
    farthest = 0;
    early = false;
    const auto contact = [](double x) { return x > -0.5 - 1e-8; };
    // f2 lives in x > 0; the run comes from below, slides, and leaves below again: f2 is needed on
    // the surface only
    const Plane sys([](const auto&, const auto& x) { return like(x, 1, 0.5 - x[0]); },
                    [contact](const auto&, const auto& x) {
                        if constexpr (std::is_same_v<std::decay_t<decltype(x[1])>, double>) {
                            farthest = std::max(farthest, std::abs(x[1]));
                            if (!contact(x[0]))
                                early = true;
                        }
                        return like(x, 1, -1);
                    },
                    [](const auto&, const auto& x) { return x[1]; });
    // y = (x - x^2)/2 + y0 from x = -1: 0 at x = -0.5 if y0 = 0.375; it slides until 0.5
    const auto r = go<TestType>(sys, V2(-1, -0.625), 0, 2, bounded<2>(1e-9));
    CHECK(r.result.status == Status::ok);
    check_events(r.events, {{enter_sliding, 0.5}, {exit_sliding, 1.5}}, 1e-8);
    CHECK_FALSE(early);
    CHECK(farthest < 1e-12);
}

// --- H28, H29, H40, H42 --------------------------------------------------------------------------

TEMPLATE_TEST_CASE("H28: an event at the start, at the end or at an output time is there once",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const auto settings = bounded<1>(1e-9);
    SECTION("start") {
        const auto r = go<TestType>(gate(), V1(0.5), 0, 1, settings);
        CHECK(word(r) == "");
        CHECK(r.events[0].surface == 0);
        CHECK(r.events[0].mode_after[0] == 1);
        CHECK(r.result.x[0] == Approx(1.5).epsilon(1e-15));
    }
    SECTION("end, and the two floating-point numbers beside it") {
        const auto r = go<TestType>(gate(), V1(0), 0, 0.5, settings);
        REQUIRE(word(r) == "cross");
        CHECK(r.events[1].t == Approx(0.5).epsilon(2 * eps));
        CHECK(r.events[1].t <= 0.5);
        CHECK(r.result.t == 0.5);
        CHECK(r.result.mode[0] == 1);
        CHECK(word(go<TestType>(gate(), V1(0), 0, std::nextafter(0.5, 1.0), settings)) == "cross");
        CHECK(word(go<TestType>(gate(), V1(0), 0, 0.5 - 1e-12, settings)) == "");
    }
    SECTION("end, reached in pieces: a run split at the event has it once in all") {
        for (int k = -20; k <= 20; ++k) {
            const double split = 0.5 + k * eps / 4;
            const auto a = go<TestType>(gate(), V1(0), 0, split, settings);
            const auto b = go<TestType>(gate(), a.result.x, split, 1, settings);
            REQUIRE(a.result.status == Status::ok);
            REQUIRE(b.result.status == Status::ok);
            // the second run's start is on the surface if the first one ended there
            const std::size_t n = a.times(cross).size() + b.times(cross).size();
            REQUIRE(n <= 1);
            REQUIRE((n == 1 || b.events[0].surface == 0));
            REQUIRE(b.result.mode[0] == 1);
        }
    }
    SECTION("output times") {
        const std::vector<double> times{0, 0.25, 0.5, 0.75, 1};
        OutputTimes<double, 1, 1> output{times};
        const Line sys(
            forward, [](const auto&, const auto& x) { return like(x, 3); },
            [](const auto&, const auto& x) { return x[0] - 0.5; });
        const auto result = flow<TestType>(sys, Vec<double, 0>(), V1(0), 0, 1, settings, output);
        CHECK(result.status == Status::ok);
        REQUIRE(output.states.size() == times.size());
        const double exact[] = {0, 0.25, 0.5, 1.25, 2};
        for (std::size_t i = 0; i < times.size(); ++i)
            CHECK(output.states[i][0] == Approx(exact[i]).epsilon(1e-14));
        REQUIRE(output.events.size() == 3);
        CHECK(output.events[1].x_left == output.events[1].x_right);
        CHECK(output.events[1].mode_before[0] == -1);
        CHECK(output.events[1].mode_after[0] == 1);
    }
}

TEMPLATE_TEST_CASE("H28: the state is continuous through an event in dense output", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const auto r = simulate<TestType>(gate(), Vec<double, 0>(), V1(0), 0, 1, bounded<1>(1e-9));
    REQUIRE(r.events.size() == 3);
    const double t = r.events[1].t;
    CHECK(r(t)[0] == Approx(0.5).epsilon(1e-15));
    CHECK(r.mode_at(t)[0] == -1);
    CHECK(r.mode_at(std::nextafter(t, 1.0))[0] == 1);
    CHECK(r(0)[0] == 0);
    CHECK(r(1)[0] == Approx(1).epsilon(1e-15));
}

TEMPLATE_TEST_CASE("H29: an event inside a rejected step is ignored", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // x = e^-50t stays above -0.5; an explicit step of 1 lands far below it
    const auto decay = [](const auto&, const auto& x) { return like(x, -50 * x[0]); };
    const Line sys(decay, decay, [](const auto&, const auto& x) { return x[0] + 0.5; });
    auto settings = bounded<1>(1e-6);
    settings.first_step = 1;
    const auto r = go<TestType>(sys, V1(1), 0, 1, settings);
    CHECK(r.result.status == Status::ok);
    CHECK(r.result.counters.rejected > 0);
    CHECK(word(r) == "");
    CHECK(r.result.x[0] == Approx(0).margin(1e-5));
}

namespace {

/// On y = 0 below the line (1, x^2 - a^2), above it (1, -1): slides from x = -1, leaves below at
/// x = -a, and comes back at x = 2a (y = (x + a)^2 (x - 2a)/3).
Plane excursion(double a) {
    return {[a](const auto&, const auto& x) { return like(x, 1, (x[0] - a) * (x[0] + a)); },
            [](const auto&, const auto& x) { return like(x, 1, -1); },
            [](const auto&, const auto& x) { return x[1]; }};
}

/// Above the line (1, -1), below it (1, x): contact at x = -d is a crossing, the visit below ends
/// at x = d and the rest is a slide.
Plane visit() {
    return {[](const auto&, const auto& x) { return like(x, 1, x[0]); },
            [](const auto&, const auto& x) { return like(x, 1, -1); },
            [](const auto&, const auto& x) { return x[1]; }};
}

} // namespace

TEMPLATE_TEST_CASE("H40: an excursion from a slide is two events or none, however short", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-3, 1e-6, 1e-9, 1e-12);
    for (int k = 20; k <= 160; ++k) {
        const double a = std::pow(10.0, -0.1 * k);
        CAPTURE(a);
        const auto r = go<TestType>(excursion(a), V2(-1, 0), 0, 2, bounded<2>(tol, 5'000, 50));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(r.result.t == 2);
        REQUIRE(r.result.mode[0] == 0);
        const std::string w = word(r);
        CAPTURE(w);
        if (a > 1e-4 && a * a > 100 * tol)
            REQUIRE(w == "exit_sliding enter_sliding");
        REQUIRE((w == "exit_sliding enter_sliding" || w == "slide_extremum" || w == ""));
        if (w == "exit_sliding enter_sliding") {
            // L1 = x^2 - a^2 is rounding below eps/a; y' = 3 a^2 where it comes back, so that an
            // error of y counts for more
            REQUIRE(r.events[1].x_right[0] == Approx(-a).epsilon(0).margin(eps / a));
            REQUIRE(r.events[2].x_right[0] ==
                    Approx(2 * a).epsilon(0).margin(10 * (eps + tol) / (a * a)));
        }
        REQUIRE(r.result.x[0] == Approx(1).epsilon(0).margin(1e-12));
        REQUIRE(std::abs(r.result.x[1]) < 1e-15);
    }
}

TEMPLATE_TEST_CASE("H40: a crossing a hair outside the sliding boundary does not hold the loop",
                   "[hard]", DormandPrince5, DormandPrince8) {
    const double tol = GENERATE(1e-3, 1e-6, 1e-9, 1e-12);
    for (int k = 20; k <= 170; ++k) {
        const double d = std::pow(10.0, -0.1 * k);
        CAPTURE(d);
        const auto r = go<TestType>(visit(), V2(-1 - d, 1), 0, 2, bounded<2>(tol, 5'000, 50));
        REQUIRE(r.result.status == Status::ok);
        REQUIRE(r.result.t == 2);
        REQUIRE(r.result.mode[0] == 0);
        const std::string w = word(r);
        CAPTURE(w);
        REQUIRE((w == "cross enter_sliding" || w == "enter_sliding"));
        if (d > 1e-6) { // the visit's depth is d^2/2: below the rounding of h it is none
            REQUIRE(w == "cross enter_sliding");
            REQUIRE(r.events[1].t == Approx(1).epsilon(0).margin(1e-14));
            REQUIRE(r.events[2].t == Approx(1 + 2 * d).epsilon(0).margin(4 * eps + eps / d));
        }
        REQUIRE(r.result.x[0] == Approx(1 - d).epsilon(0).margin(1e-12));
    }
}

TEMPLATE_TEST_CASE("H42: a step that reaches over the pole of the far extension is cut", "[hard]",
                   DormandPrince5, DormandPrince8) {
    // f1 has its pole at v = V + 1/gamma = 1.704; a block that the belt overtakes slowly meets v =
    // V at any angle
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const double first = GENERATE(0.3, 1.0, 3.0);
    for (int i = 0; i < 30; ++i)
        for (int j = 0; j < 30; ++j) {
            const V2 x0(-4 + 8 * i / 29.0, -2 + 5 * j / 29.0);
            auto settings = bounded<2>(1e-3);
            settings.first_step = first;
            const auto r = run<TestType>(sys, p, x0, 0, 4, settings);
            CAPTURE(x0[0], x0[1], r.result.message());
            REQUIRE(r.result.status == Status::ok);
            REQUIRE(faults(r) == "");
            const auto fine = run<TestType>(sys, p, x0, 0, 4, bounded<2>(1e-10));
            REQUIRE((r.result.x - fine.result.x).norm() <
                    0.3); // a step across the pole would throw it off by far more
        }
}

TEMPLATE_TEST_CASE(
    "H42: a stage that is exactly NaN beyond the surface cuts the step and the run goes on",
    "[hard]", DormandPrince5, DormandPrince8) {
    const double wall = GENERATE(0.5, 0.1, 1e-3, 1e-8, 0.0);
    const Line sys([wall](const auto&,
                          const auto& x) { return x[0] > wall ? like(x, no_number) : like(x, 1); },
                   [](const auto&, const auto& x) { return like(x, 2); },
                   [](const auto&, const auto& x) { return x[0]; });
    for (const double first : {0.01, 0.3, 1.0, 2.0, 10.0}) {
        auto settings = bounded<1>(1e-9);
        settings.first_step = first;
        const auto r = go<TestType>(sys, V1(-1), 0, 2, settings);
        CHECK(r.result.status == Status::ok);
        check_events(r.events, {{cross, 1.0}}, 1e-14);
        CHECK(r.result.x[0] == Approx(2).epsilon(1e-13));
    }
}

// --- user sections -------------------------------------------------------------------------------

namespace {

using Watch = DynamicSections<double, 2, 0>;

template <class Tableau>
Run<Plane> watch(const Plane& sys, const V2& x0, double t0, double t_end,
                 std::vector<Section<Watch::Function>> list, double tol = 1e-9) {
    Watch watched;
    for (auto& s : list)
        watched.all[std::size_t(watched.count++)] = std::move(s);
    EventLog<double, 2, 1> log;
    const auto result =
        flow<Tableau>(sys, Vec<double, 0>(), x0, t0, t_end, bounded<2>(tol), log, watched);
    const Run<Plane> r{result, log.events};
    INFO(result.message());
    CHECK(faults(r, t_end < t0 ? -1 : 1) == "");
    return r;
}

Plane circle() {
    return {turn, turn, [](const auto&, const auto& x) { return x[0] * 0 - 1; }};
}

const auto height = [](double, const V2& x, const Vec<double, 0>&) { return x[1]; };
const auto abscissa = [](double, const V2& x, const Vec<double, 0>&) { return x[0]; };

} // namespace

TEMPLATE_TEST_CASE("H28: sections obey direction and terminal", "[hard]", DormandPrince5,
                   DormandPrince8) {
    // (sin t, cos t): cos falls through 0 at pi/2, rises at 3 pi/2
    const double tol = 1e-8;
    auto r = watch<TestType>(circle(), V2(0, 1), 0, 10, {{height}});
    check_events(r.events, {{section, pi / 2}, {section, 3 * pi / 2}, {section, 5 * pi / 2}}, tol);
    r = watch<TestType>(circle(), V2(0, 1), 0, 10, {{height, +1}});
    check_events(r.events, {{section, 3 * pi / 2}}, tol);
    r = watch<TestType>(circle(), V2(0, 1), 0, 10, {{height, -1}});
    check_events(r.events, {{section, pi / 2}, {section, 5 * pi / 2}}, tol);
    r = watch<TestType>(circle(), V2(0, 1), 0, 10, {{height, +1, true}});
    check_events(r.events, {{section, 3 * pi / 2}}, tol);
    CHECK(r.result.status == Status::event);
    CHECK(r.result.t == r.events[1].t);
    CHECK(std::abs(r.result.x[1]) < 1e-14);
    // three of them, two at once: each once and in order; the second is zero at the start too
    r = watch<TestType>(circle(), V2(0, 1), 0, 4, {{height}, {abscissa}, {height, -1}});
    check_events(r.events, {{section, 0}, {section, pi / 2}, {section, pi / 2}, {section, pi}},
                 tol);
    CHECK(r.events[2].surface + r.events[3].surface == 2);
    // backwards in time
    r = watch<TestType>(circle(), V2(0, 1), 0, -4, {{abscissa}});
    check_events(r.events, {{section, 0}, {section, -pi}}, tol);
}

TEMPLATE_TEST_CASE("H28: a section at the start or at the end is met once", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const bool terminal = GENERATE(false, true);
    const auto line = [](double level) {
        return [level](double, const V2& x, const Vec<double, 0>&) { return x[0] - level; };
    };
    const Plane sys(right, right, [](const auto&, const auto& x) { return x[0] * 0 - 1; });
    // at t0: logged once, and does not end the run
    auto r = watch<TestType>(sys, V2(0.5, 0), 0, 1, {{line(0.5), 0, terminal}});
    CHECK(word(r) == "section");
    CHECK(r.events[1].t == 0);
    CHECK(r.result.t == 1);
    // at t_end
    r = watch<TestType>(sys, V2(0, 0), 0, 0.5, {{line(0.5), 0, terminal}});
    CHECK(word(r) == "section");
    CHECK(r.events[1].t == Approx(0.5).epsilon(1e-15));
    CHECK(r.result.status == (terminal ? Status::event : Status::ok));
    // a start a few ulp on either side is one event or none, never two
    for (int k = -20; k <= 20; ++k) {
        r = watch<TestType>(sys, V2(0.5 + k * eps / 2, 0), 0, 1, {{line(0.5), 0, terminal}});
        REQUIRE(r.times(section).size() == (k <= 0 ? 1 : 0));
    }
    // a section touched, not crossed, is not an event
    r = watch<TestType>(circle(), V2(0, 1), 0, 3, {{line(1 + 1e-6), 0, terminal}});
    CHECK(word(r) == "");
}

TEMPLATE_TEST_CASE("H28: a section and a surface at the same time are one event each", "[hard]",
                   DormandPrince5, DormandPrince8) {
    const Plane sys(right, right, [](const auto&, const auto& x) { return x[0] - 0.5; });
    const Plane stop(right, left, [](const auto&, const auto& x) { return x[0] - 0.5; });
    const auto line = [](double level) {
        return [level](double, const V2& x, const Vec<double, 0>&) { return x[0] - level; };
    };
    const auto clock = [](double t, const V2&, const Vec<double, 0>&) { return t - 0.5; };
    SECTION("a crossing") {
        for (int k = -10; k <= 10; ++k) {
            CAPTURE(k);
            const auto r = watch<TestType>(sys, V2(k * eps / 4, 0), 0, 1, {{line(0.5)}, {clock}});
            REQUIRE(r.result.status == Status::ok);
            REQUIRE(r.times(cross).size() == 1);
            REQUIRE(r.times(section).size() == 2);
        }
    }
    SECTION("a landing: the section of the state is reached and not passed") {
        const auto r = watch<TestType>(stop, V2(0, 0), 0, 1, {{clock}});
        CHECK(r.times(enter_sliding).size() == 1);
        CHECK(r.times(section).size() == 1);
        // x stays on the section's zero for the whole slide: met at most once
        const auto on = watch<TestType>(stop, V2(0, 0), 0, 1, {{line(0.5)}});
        CHECK(on.result.status == Status::ok);
        CHECK(on.times(enter_sliding).size() == 1);
        CHECK(on.times(section).size() <= 1);
    }
    SECTION("a terminal section at a crossing ends the run after it") {
        const auto r = watch<TestType>(sys, V2(0, 0), 0, 1, {{line(0.5), 0, true}});
        CHECK(r.result.status == Status::event);
        CHECK(r.times(section).size() == 1);
        CHECK(r.result.t == Approx(0.5).epsilon(1e-15));
    }
}

namespace {

/// A pushed spring whose equilibrium is on the other side of 0 where v is.
struct Pushed {
    static constexpr int dim = 2;
    double force, frequency;
    template <Scalar S> Vec<S, 2> f(int side, const S& t, const Vec<S, 2>& x) const {
        using std::cos;
        return {x[1], S(-0.02 * side) - x[0] - S(0.1) * x[1] + S(force) * cos(S(frequency) * t)};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return f(-1, t, x);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return f(+1, t, x);
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    template <Scalar S> S period(const Vec<S, 0>&) const { return S(2 * pi / frequency); }
};

} // namespace

TEMPLATE_TEST_CASE("H28: a section that is zero on a surface is met once a crossing, whatever the "
                   "period",
                   "[hard]", DormandPrince5, DormandPrince8, Rodas5P) {
    // The surface is found in the time within a period, the section in the absolute time.
    std::size_t crossings = 0;
    for (int k = 0; k < 60; ++k) {
        CAPTURE(k);
        EventLog<double, 2, 1> log;
        const auto speed = [](const auto&, const auto& x, const auto&) { return x[1]; };
        const auto end =
            flow<TestType>(Pushed{1.5 + 0.06 * k, 0.5 + 0.04 * k}, Vec<double, 0>(), V2(0.1 * k, 1),
                           0, 12, bounded<2>(1e-8), log, sections(Section{speed, 0}));
        const Run<Pushed> r{end, log.events};
        REQUIRE(r.result.status == Status::ok);
        const std::size_t met = r.times(cross).size() + r.times(enter_sliding).size();
        CHECK(r.times(section).size() == met);
        crossings += met;
    }
    CHECK(crossings > 200);
}

TEMPLATE_TEST_CASE("H28: a section is found on a slide", "[hard]", DormandPrince5, DormandPrince8) {
    const Plane sys([](const auto&, const auto& x) { return like(x, 1, 1); },
                    [](const auto&, const auto& x) { return like(x, 1, -1); },
                    [](const auto&, const auto& x) { return x[1]; });
    const auto wave = [](double, const V2& x, const Vec<double, 0>&) {
        return std::sin(20 * x[0] + 1);
    };
    const auto r = watch<TestType>(sys, V2(0, 0), 0, 3, {{wave}});
    CHECK(r.result.status == Status::ok);
    std::vector<Expected> roots;
    for (int k = 1; (k * pi - 1) / 20 < 3; ++k)
        roots.push_back({section, (k * pi - 1) / 20});
    check_events(r.events, roots, 1e-13);
}

TEST_CASE("slides in closed form: shallow excursions beyond the boundary are exits, wherever the "
          "windows lie",
          "[hard]") {
    // s(t) = (A cos omega t - y0 - t)/4, shifted so that a local extremum passes +-1 by 1e-6 to
    // 1e-2
    const models::Oscillator sys;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> u(0, 1);
    int exits = 0;
    for (int k = 0; k < 4000; ++k) {
        auto p = default_params<models::Oscillator>();
        p[0] = 0.9 + 3.1 * u(random);
        p[1] = 0.5 + 2.7 * u(random);
        const double A = p[0], omega = p[1], period = 2 * 3.141592653589793 / omega;
        const double t0 = period * u(random), depth = std::pow(10.0, -6 + 4 * u(random));
        const int side = u(random) < 0.5 ? -1 : 1;
        // s' = 0 where sin(omega t) = -1/(A omega); s rises or falls between
        if (!(A * omega > 1))
            continue;
        const double a = std::asin(1 / (A * omega));
        const double phase = side < 0 ? 3.141592653589793 + a : -a; // of a minimum, a maximum of s
        double extremum = std::fmod(phase / omega - t0, period);
        while (extremum < 0.05 * period)
            extremum += period;
        const auto drift = [&](double t) { return A * std::cos(omega * (t0 + t)) - t; };
        const double y0 = drift(extremum) - 4 * side * (1 + depth);
        const auto margin = [&](double t) { return 1 - std::abs(drift(t) - y0) / 4; };
        // the first exit: on a fine grid that has this extremum as a point
        const int n = 2000;
        double before = -1, beyond = -1;
        if (!(margin(0) > 1e-3))
            continue;
        for (int i = 0; beyond < 0 && i <= n; ++i) {
            const double t = extremum * i / n;
            (margin(t) > 0 ? before : beyond) = t;
        }
        for (int i = 0; i < 60; ++i) {
            const double middle = (before + beyond) / 2;
            (margin(middle) > 0 ? before : beyond) = middle;
        }
        EventLog<double, 2, 1> log;
        const auto settings = tolerance<2>(1e-9);
        flow(sys, p, Vec<double, 2>(y0, 1), t0, t0 + extremum + period, settings, log);
        const auto found = std::find_if(log.events.begin(), log.events.end(), [](const auto& e) {
            return e.kind == EventKind::exit_sliding;
        });
        CAPTURE(k, A, omega, t0, y0, depth);
        REQUIRE(found != log.events.end());
        CHECK(found->t - t0 == Approx(beyond).margin(1e-6));
        ++exits;
    }
    CHECK(exits > 2000);
}
