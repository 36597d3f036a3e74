// SPDX-License-Identifier: BSD-3-Clause
// Fields that are quiet, and what is watched has a pace of its own: s along a slide, a surface that
// moves or is curved, a user's section. Oracles are functions of time, scanned and bisected.
#include "ensembles.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <numbers>

using namespace ensembles;

namespace {

/// A wave, a second one, a slope and a dip.
struct Shape {
    double a = 0, omega = 1, phase = 0, b = 0, rate = 0, slope = 0, dip = 0, at = 0, width = 1;

    template <class S> S operator()(const S& t) const {
        using std::cos;
        using std::exp;
        const S u = (t - S(at)) / S(width);
        return S(a) * cos(S(omega) * t + S(phase)) + S(b) * cos(S(rate) * t) + S(slope) * t +
               S(dip) * exp(-u * u);
    }
};

/// x' = g(t) - sign x: at rest at 0 while |g| < 1.
struct Resting {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"period"};
    template <class S> using X = Vec<S, 1>;
    template <class S> using P = Vec<S, 1>;
    Shape g;
    bool forced = false;

    template <class S> X<S> f1(const S& t, const X<S>&, const P<S>&) const {
        return X<S>(g(t) + S(1));
    }
    template <class S> X<S> f2(const S& t, const X<S>&, const P<S>&) const {
        return X<S>(g(t) - S(1));
    }
    template <class S> S h(const S&, const X<S>& x, const P<S>&) const { return x[0]; }
    template <class S> S period(const P<S>& p) const { return p[0]; } // none, if it is 0
};

/// The same, and it is known that h is linear.
struct RestingLinear : Resting {
    static constexpr bool linear_h = true;
};

/// A block on a belt of speed V, its spring slack or not, driven by g(t).
struct Carried {
    static constexpr int dim = 2;
    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 0>;
    Shape g;
    double V = 0.1, k = 1;

    template <class S> X<S> side(const S& t, const X<S>& x, double push) const {
        return X<S>(x[1], g(t) - S(k) * x[0] + S(push));
    }
    template <class S> X<S> f1(const S& t, const X<S>& x, const P<S>&) const {
        return side(t, x, 1);
    }
    template <class S> X<S> f2(const S& t, const X<S>& x, const P<S>&) const {
        return side(t, x, -1);
    }
    template <class S> S h(const S&, const X<S>& x, const P<S>&) const { return x[1] - S(V); }
};

/// A constant field below a surface that moves.
struct Swinging {
    static constexpr int dim = 1;
    template <class S> using X = Vec<S, 1>;
    template <class S> using P = Vec<S, 0>;
    Shape g;
    double c = 0.1;

    template <class S> X<S> f1(const S&, const X<S>&, const P<S>&) const { return X<S>(S(c)); }
    template <class S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return f1(t, x, p);
    }
    template <class S> S h(const S& t, const X<S>& x, const P<S>&) const {
        return x[0] - g(t) - S(5);
    }
};

/// The same with a component that counts where it is.
struct Counted {
    static constexpr int dim = 2;
    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 0>;
    Shape g;
    double c = 0.1;

    template <class S> X<S> f1(const S&, const X<S>&, const P<S>&) const { return {S(c), S(-1)}; }
    template <class S> X<S> f2(const S&, const X<S>&, const P<S>&) const { return {S(c), S(1)}; }
    template <class S> S h(const S& t, const X<S>& x, const P<S>&) const { return x[0] - g(t); }
};

/// A constant field over a curved surface, z = a sin(omega x) + b cos(rate x).
struct Hilly {
    static constexpr int dim = 2;
    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 0>;
    Shape g;

    template <class S> X<S> f1(const S&, const X<S>&, const P<S>&) const {
        return X<S>(S(1), S(-0.02));
    }
    template <class S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return f1(t, x, p);
    }
    template <class S> S h(const S&, const X<S>& x, const P<S>&) const { return x[1] - g(x[0]); }
};

/// x' = 1 or 0, less a x: on in pulses, a part `duty` of each period.
struct Pulsed {
    static constexpr int dim = 1;
    template <class S> using X = Vec<S, 1>;
    template <class S> using P = Vec<S, 0>;
    double T = 1, duty = 0.1, sharp = 8, a = 1;
    bool declared = false;

    template <class S> X<S> f1(const S&, const X<S>& x, const P<S>&) const {
        return X<S>(S(-a) * x[0]);
    }
    template <class S> X<S> f2(const S&, const X<S>& x, const P<S>&) const {
        return X<S>(S(1) - S(a) * x[0]);
    }
    template <class S> S h(const S& t, const X<S>&, const P<S>&) const {
        using std::cos;
        using std::exp;
        const double pi = std::numbers::pi;
        return exp(S(sharp) * (cos(S(2 * pi / T) * t - S(pi)) - cos(S(pi * duty)))) - S(1);
    }
    template <class S> S period(const P<S>&) const { return declared ? S(T) : S(0); }
};

/// A body on a floor: it lies there while g(t) is less than its weight.
struct Lying {
    static constexpr int dim = 2;
    static constexpr std::array kinds{SurfaceKind::jump};
    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 0>;
    Shape g;
    double weight = 1;

    template <class S> X<S> f(const S& t, const X<S>& x, const P<S>&) const {
        return X<S>(x[1], g(t) - S(weight));
    }
    template <class S> S h(const S&, const X<S>& x, const P<S>&) const { return x[0]; }
    template <class S> X<S> jump(int, const S&, const X<S>& x, const P<S>&) const {
        return X<S>(x[0], S(0) * x[1]);
    }
};

constexpr double T = 40;

/// The first time at which v, positive before, is not; infinite if it stays positive. NaN if it
/// comes so near to zero, or so shortly below it, that a scan or a run may see another thing.
template <class F> double first_zero(F v, double omega) {
    const double dt = 0.02 / std::max(omega, 1.0);
    double before = v(0.0);
    for (double t = dt; t <= T; t += dt) {
        const double now = v(t), next = v(t + dt);
        if (now <= 0) {
            double low = t - dt, high = t;
            for (int k = 0; k < 60; ++k)
                (v((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
            double deepest = 0; // of the visit
            for (double u = high; v(u) <= 0 && u < T; u += dt / 4)
                deepest = std::min(deepest, v(u));
            return deepest < -1e-4 ? high : no_number;
        }
        if (now < before && now < next && now < 1e-3)
            return no_number;
        before = now;
    }
    return inf;
}

Shape draw(Random& random) {
    Shape g;
    g.a = random(0.3, 0.95);
    g.omega = std::exp(random(-1, 4));
    g.phase = random(0, 6);
    g.slope = random(-0.03, 0.03);
    if (random.below(3) == 0) {
        g.b = random(0, 0.3);
        g.rate = std::exp(random(-1, 4));
    }
    return g;
}
double quickest(const Shape& g) { return std::max(g.omega, g.rate); }

template <class Run> double first(const Run& run, std::initializer_list<EventKind> kinds) {
    for (const auto& event : run.events)
        for (const EventKind kind : kinds)
            if (event.kind == kind)
                return event.t;
    return inf;
}
const std::initializer_list<EventKind> leaves{EventKind::exit_sliding},
    meets{EventKind::cross, EventKind::enter_sliding, EventKind::graze};

/// Members in lanes against single runs of them.
template <class Sys> void compare(const Sys& sys, const Members<Sys>& members) {
    const auto settings = tolerance<Sys>(1e-8);
    const auto all = run(sys, members, settings);
    for (std::size_t i = 0; i < members.size(); ++i) {
        const auto& m = members[i];
        const auto one = simulate<DormandPrince8>(sys, m.p, m.x, m.t0, m.t_end, settings);
        CAPTURE(i);
        CHECK(all.outcomes[i].status == one.result.status);
        CHECK((all.outcomes[i].x - one.result.x).cwiseAbs().maxCoeff() < 1e-5);
        CHECK(all.outcomes[i].mode == one.result.mode[0]);
    }
}

/// Compares with the oracle, within what a tolerance of 1e-8 makes of times.
void check(double found, double exact) {
    if (exact < T)
        CHECK(found == Approx(exact).margin(1e-5));
    else
        CHECK(found == exact);
}

} // namespace

TEMPLATE_TEST_CASE("pace: a slide whose field is constant ends when s says so", "[pace]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    Random random(1);
    int n = 0;
    for (int i = 0; i < 150; ++i) {
        Resting sys{draw(random)};
        const double exact =
            first_zero([&](double t) { return 1 - std::abs(sys.g(t)); }, quickest(sys.g));
        if (!(exact == exact) || std::abs(sys.g(0.0)) > 0.99)
            continue;
        CAPTURE(i, sys.g.omega);
        ++n;
        const Vec<double, 1> none(0.0), declared(6.283185307179586 / sys.g.omega);
        check(first(simulate<TestType>(sys, none, none, 0, T, {.rtol = 1e-8}), leaves), exact);
        if (sys.g.slope == 0 || i % 2 == 0) {
            sys.g.slope = sys.g.b = 0; // what is declared to repeat does
            const double repeats =
                first_zero([&](double t) { return 1 - std::abs(sys.g(t)); }, sys.g.omega);
            if (repeats == repeats)
                check(first(simulate<TestType>(sys, declared, none, 0, T, {.rtol = 1e-8}), leaves),
                      repeats);
        }
    }
    CHECK(n > 80);
}

TEMPLATE_TEST_CASE("pace: a slide that a long slip led into ends by a bump of s", "[pace]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    // The slip's field is constant: its steps grow as long as may be.
    Random random(21);
    int n = 0;
    for (int i = 0; i < 20'000; ++i) {
        RestingLinear sys;
        sys.g.dip = -random(1.5, 5);
        sys.g.at = random(1, 4);
        sys.g.width = random(0.05, 0.2);
        sys.g.b = random(-0.3, 0.8);
        const double x0 = -random(0.5, 3), lands = -x0 / (1 + sys.g.b);
        const double half = sys.g.width * std::sqrt(std::log(-sys.g.dip / (1 + sys.g.b)));
        const double exact = sys.g.at - half;
        // the slip must know nothing of the bump, and the bump be long enough to be certain
        if (!(half > 0) || lands > sys.g.at - 6 * sys.g.width ||
            2 * half < std::max(2 * lands, sys.g.at - lands) / 12)
            continue;
        CAPTURE(i, lands, sys.g.at, sys.g.width, half);
        ++n;
        const Vec<double, 1> none(0.0), start(x0);
        check(first(simulate<TestType>(sys, none, start, 0, T, {.rtol = 1e-8}), leaves), exact);
        if (i % 20 == 0)
            compare(sys, {{start, none, 0, exact + half / 2}, {none, none, 0, exact + half / 2}});
    }
    CHECK(n > 2000);
}

TEMPLATE_TEST_CASE("pace: a block on a slow belt, and one at rest, slip when the force says so",
                   "[pace]", DormandPrince5, DormandPrince8, Rodas5P) {
    Random random(2);
    int n = 0;
    for (int i = 0; i < 150; ++i) {
        const Carried sys{draw(random), i % 3 == 0 ? 0 : random(0.01, 0.3), random(0, 1)};
        const double x0 = random(-0.05, 0.05);
        const auto pull = [&](double t) { return sys.g(t) - sys.k * (x0 + sys.V * t); };
        const double exact =
            first_zero([&](double t) { return 1 - std::abs(pull(t)); }, quickest(sys.g));
        if (!(exact == exact) || std::abs(pull(0)) > 0.99)
            continue;
        CAPTURE(i, sys.g.omega, sys.V);
        ++n;
        check(first(simulate<TestType>(sys, {}, Vec<double, 2>(x0, sys.V), 0, T, {.rtol = 1e-8}),
                    leaves),
              exact);
    }
    CHECK(n > 80);
}

TEMPLATE_TEST_CASE("pace: a constant field meets a surface that swings or is hilly", "[pace]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    Random random(3);
    int n = 0;
    for (int i = 0; i < 150; ++i) {
        Shape g = draw(random);
        const double c = random(0, 0.4);
        const Swinging sys{g, c};
        const double exact = first_zero([&](double t) { return g(t) + 5 - c * t; }, quickest(g));
        CAPTURE(i, g.omega);
        if (exact == exact) {
            ++n;
            check(first(simulate<TestType>(sys, {}, Vec<double, 1>(0.0), 0, T, {.rtol = 1e-8}),
                        meets),
                  exact);
        }
        const Hilly hills{g};
        const double z0 = g(0.0) + random(0.3, 1.5);
        const double hit = first_zero([&](double t) { return z0 - 0.02 * t - g(t); }, quickest(g));
        if (hit == hit) {
            ++n;
            check(first(simulate<TestType>(hills, {}, Vec<double, 2>(0, z0), 0, T, {.rtol = 1e-8}),
                        meets),
                  hit);
        }
    }
    CHECK(n > 150);
}

TEMPLATE_TEST_CASE("pace: pulses are not stepped over, whatever steps the field bears", "[pace]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    Random random(11);
    for (int i = 0; i < 400; ++i) {
        const Pulsed sys{std::exp(random(-5, 1)), random(0.03, 0.3), random(4, 40),
                         std::exp(random(-3, 2)), i % 2 == 0};
        const double tol = std::pow(10, random(-9, -3));
        const int n = 10;
        CAPTURE(i, sys.T, sys.duty, sys.sharp, sys.a, tol);
        const auto settings = tolerance<Pulsed>(tol);
        const auto r = simulate<TestType>(sys, {}, Vec<double, 1>(0.2), 0, n * sys.T, settings);
        REQUIRE(r.result.status == Status::ok);
        std::vector<double> met;
        for (const auto& event : r.events)
            if (event.kind == EventKind::cross)
                met.push_back(event.t / sys.T);
        REQUIRE(met.size() == 2 * n);
        for (int k = 0; k < n; ++k) {
            CHECK(met[std::size_t(2 * k)] == Approx(k + 0.5 - sys.duty / 2).epsilon(1e-9));
            CHECK(met[std::size_t(2 * k + 1)] == Approx(k + 0.5 + sys.duty / 2).epsilon(1e-9));
        }
    }
}

TEMPLATE_TEST_CASE("pace: a body lies on the floor until the force lifts it", "[pace]",
                   DormandPrince5, DormandPrince8) {
    Random random(4);
    int n = 0;
    for (int i = 0; i < 150; ++i) {
        const Lying body{draw(random), random(0.3, 1.0)};
        const auto lifted = [&](double t) { return body.weight - body.g(t); };
        const double exact = first_zero(lifted, quickest(body.g));
        if (!(exact == exact) || !(lifted(0.0) > 0.02))
            continue;
        ++n;
        CAPTURE(i, body.g.omega, body.weight);
        check(
            first(simulate<TestType>(body, {}, Vec<double, 2>(0, 0), 0, T, {.rtol = 1e-8}), leaves),
            exact);
    }
    CHECK(n > 60);
}

TEMPLATE_TEST_CASE("pace: a section is met whenever it is zero, in a slide and off it", "[pace]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    Random random(5);
    for (int i = 0; i < 60; ++i) {
        Shape g = draw(random);
        g.omega = std::min(g.omega, 20.0);
        g.b = 0;
        const double level = g.a * random(-0.9, 0.9);
        int crossings = 0;
        const double dt = 1e-3;
        for (double t = 0; t + dt <= T; t += dt)
            crossings += (g(t) - level) * (g(t + dt) - level) < 0;
        const auto section = [&](const auto& t, const auto&, const auto&) { return g(t) - level; };
        Resting rests{{.slope = 1e-3}}; // a slide throughout
        const Vec<double, 1> none(0.0);
        CAPTURE(i, g.omega);
        for (const double x0 : {0.0, 200.0}) { // 200: never there
            EventLog<double, 1, 1> log;
            const auto end = flow<TestType>(rests, none, Vec<double, 1>(x0), 0, T, {.rtol = 1e-8},
                                            log, sections(Section{section, 0}));
            CHECK(end.status == Status::ok);
            int met = 0;
            for (const auto& event : log.events)
                met += event.kind == EventKind::section;
            CHECK(met == crossings);
        }
    }
}

TEMPLATE_TEST_CASE("pace: a ripple makes three roots of one already in the first mode of a run",
                   "[pace]", DormandPrince5, DormandPrince8, Rodas5P) {
    // (the field is constant: no error estimate says that h is not linear)
    Random random(9);
    int n = 0;
    for (int i = 0; i < 150; ++i) {
        const double c = random(0.15, 0.4);
        Shape g;
        g.rate = std::exp(random(3, 6));
        g.b = random(1.2, 4) * c / g.rate;
        g.slope = random(-0.03, 0.03);
        const double exact = first_zero([&](double t) { return g(t) + 5 - c * t; }, g.rate);
        if (!(exact == exact))
            continue;
        ++n;
        CAPTURE(i, c, g.rate, g.b, g.slope);
        check(
            first(simulate<TestType>(Swinging{g, c}, {}, Vec<double, 1>(0.0), 0, T, {.rtol = 1e-8}),
                  meets),
            exact);
    }
    CHECK(n > 60);
}

TEMPLATE_TEST_CASE("pace: sections are met after a thousand declared periods", "[pace]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    // Within a period time has more digits than the absolute time that sections see.
    Random random(10);
    for (int i = 0; i < 100; ++i) {
        Resting sys{{.a = 3, .omega = random(100, 600)}};
        const double fast = sys.g.omega * random(0.3, 2), level = random(-0.9, 0.9);
        const double period = 2 * std::numbers::pi / sys.g.omega, t0 = random(1e3, 1e5) * period;
        const auto section = [&](const auto& t, const auto& x, const auto&) {
            using std::cos;
            return cos(fast * t) - level + 1e-3 * x[0];
        };
        EventLog<double, 1, 1> log;
        const auto end =
            flow<TestType>(sys, Vec<double, 1>(period), Vec<double, 1>(1.0), t0, t0 + 10 / fast,
                           {.rtol = 1e-4}, log, sections(Section{section, 0}));
        CHECK(end.status == Status::ok);
        CAPTURE(i, sys.g.omega, fast, t0);
        // within 1e-2: what x and errors at this tolerance may do
        std::vector<double> exact;
        for (double k = std::floor(fast * t0 / (2 * std::numbers::pi)) - 1; k < 1e9; ++k) {
            const double top = 2 * k * std::numbers::pi / fast, half = std::acos(level) / fast;
            if (top - half > t0 + 10 / fast)
                break;
            for (const double t : {top - half, top + half})
                if (t > t0 + 0.01 / fast && t < t0 + 9.99 / fast)
                    exact.push_back(t);
        }
        std::size_t met = 0;
        for (const auto& event : log.events) {
            if (event.kind != EventKind::section)
                continue;
            if (met < exact.size() && event.t > t0 + 0.01 / fast)
                CHECK(std::abs(event.t - exact[met++]) * fast < 1e-2);
        }
        CHECK(met == exact.size());
    }
}

TEST_CASE("pace: a visit beyond zero is found if it lasts a sixteenth of the time before it",
          "[pace]") {
    Random random(6);
    for (int i = 0; i < 300; ++i) {
        Resting sys;
        sys.g.dip = 1.4;
        sys.g.at = random(2, 30);
        // wider than 1 for at / 15
        sys.g.width = sys.g.at / 30 / std::sqrt(std::log(1.4));
        const double exact = first_zero([&](double t) { return 1 - sys.g(t); }, 10);
        CAPTURE(i, sys.g.at, exact);
        const Vec<double, 1> none(0.0);
        check(first(simulate<DormandPrince5>(sys, none, none, 0, T, {.rtol = 1e-8}), leaves),
              exact);
        check(first(simulate<DormandPrince8>(sys, none, none, 0, T, {.rtol = 1e-8}), leaves),
              exact);
    }
}

TEMPLATE_TEST_CASE("pace: a small ripple on a slow force ends a slide, and meets a section, first",
                   "[pace]", DormandPrince5, DormandPrince8, Rodas5P) {
    // A ripple of a hundredth or a thousandth makes several roots of one, and tops of its own.
    Random random(8);
    int n = 0;
    for (int i = 0; i < 120; ++i) {
        Resting sys;
        Shape& g = sys.g;
        g.omega = random(0.1, 0.5);
        g.phase = -0.5 * std::numbers::pi;
        g.b = std::exp(random(-7, -4));
        g.rate = std::exp(random(3, 6));
        const bool tops = i % 2 == 0; // it is the ripple alone that reaches beyond 1
        g.a = tops ? 1 - random(0.1, 0.9) * g.b : random(1.05, 1.8);
        const double exact = first_zero([&](double t) { return 1 - std::abs(g(t)); }, g.rate);
        if (!(exact == exact))
            continue;
        ++n;
        CAPTURE(i, g.a, g.omega, g.b, g.rate);
        const Vec<double, 1> none(0.0);
        check(first(simulate<TestType>(sys, none, none, 0, T, {.rtol = 1e-8}), leaves), exact);
        const auto section = [&](const auto& t, const auto&, const auto&) { return 1.0 - g(t); };
        const Resting rests{{.slope = 1e-3}};
        for (const double x0 : {0.0, 200.0}) { // 200: never there
            EventLog<double, 1, 1> log;
            flow<TestType>(rests, none, Vec<double, 1>(x0), 0, T, {.rtol = 1e-8}, log,
                           sections(Section{section, 0}));
            double met = inf;
            for (const auto& event : log.events)
                if (event.kind == EventKind::section)
                    met = std::min(met, event.t);
            const double zero = first_zero([&](double t) { return 1 - g(t); }, g.rate);
            if (zero == zero)
                check(met, zero);
        }
    }
    CHECK(n > 60);
}

TEST_CASE("pace: lanes see ripples and surfaces that swing six hundred times a unit of time",
          "[pace]") {
    Random random(9);
    for (int i = 0; i < 100; ++i) {
        const Counted swings{
            {.a = random(0.3, 0.95), .omega = std::exp(random(3, 6.5)), .phase = random(0, 6)},
            random(-0.3, 0.3)};
        Resting rests;
        rests.g = {.a = random(1.05, 1.5),
                   .omega = random(0.1, 0.5),
                   .phase = -1.5,
                   .b = std::exp(random(-7, -4)),
                   .rate = std::exp(random(3, 6))};
        CAPTURE(i, swings.g.omega, rests.g.rate);
        Members<Counted> beside;
        Members<Resting> at_rest;
        for (int k = 0; k < 16; ++k)
            beside.push_back({{-0.8 + 0.1 * k, 0}, Vec<double, 0>(), 0.0, 0.5});
        for (int k = 0; k < 4; ++k)
            at_rest.push_back({Vec<double, 1>(0.0), Vec<double, 1>(0.0), 0.0, 4.0 + 4 * k});
        compare(swings, beside);
        compare(rests, at_rest);
    }
}

TEMPLATE_TEST_CASE("pace: lanes step over no pulses", "[pace]", DormandPrince5, DormandPrince8) {
    Random random(12);
    for (int i = 0; i < 200; ++i) {
        const Pulsed sys{std::exp(random(-5, 1)), random(0.08, 0.3), random(4, 40),
                         std::exp(random(-3, 2)), i % 2 == 0};
        auto settings = tolerance<Pulsed>(std::pow(10, random(-9, -3)));
        settings.first_step = std::min(2 * sys.T, 1e-2 / sys.a);
        Members<Pulsed> members;
        for (int k = 0; k < 8; ++k)
            members.push_back({.x = Vec<double, 1>(random(0, 1)), .t_end = 10 * sys.T});
        CAPTURE(i, sys.T, sys.duty, sys.sharp, sys.a, settings.rtol);
        const auto all = run<TestType>(sys, members, settings);
        for (const auto& outcome : all.outcomes) {
            CHECK(outcome.status == Status::ok);
            CHECK(outcome.events == 20);
        }
    }
}

TEST_CASE("pace: lanes see what single runs see", "[pace]") {
    Random random(7);
    for (int i = 0; i < 40; ++i) {
        const Resting rests{draw(random)};
        if (std::abs(rests.g(0.0)) > 0.99)
            continue;
        const Swinging swings{draw(random), random(0, 0.3)};
        CAPTURE(i, rests.g.omega, swings.g.omega);
        Members<Resting> at_rest;
        Members<Swinging> below;
        for (int k = 0; k < 16; ++k) {
            at_rest.push_back({Vec<double, 1>(0.0), Vec<double, 1>(0.0), 0.0, 2.0 + 2 * k});
            below.push_back({Vec<double, 1>(0.1 * k), Vec<double, 0>(), 0.0, 20.0});
        }
        compare(rests, at_rest);
        compare(swings, below);
    }
}

TEST_CASE("pace: what is quiet is crossed in long steps", "[pace]") {
    const Vec<double, 1> none(0.0);
    Resting still;
    still.g.slope = 1e-9;
    const auto slides = simulate<DormandPrince8>(still, none, none, 0, 1e6, {.rtol = 1e-8});
    CHECK(slides.result.status == Status::ok);
    CHECK(slides.pieces.size() < 100);
    const Swinging calm{{.slope = 1e-6}, 1e-6};
    const auto passes =
        simulate<DormandPrince8>(calm, {}, Vec<double, 1>(0.0), 0, 1e6, {.rtol = 1e-8});
    CHECK(passes.pieces.size() < 100);
}
