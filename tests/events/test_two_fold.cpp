// SPDX-License-Identifier: BSD-3-Clause
// Slides into two-folds and past them: normal forms, nonlinear ones in curved coordinates and other
// units, driven ones, families of them, beside other surfaces, backwards and in lanes.

#include "hard.hpp"
#include "two_folds.hpp"

#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <algorithm>
#include <random>
#include <vector>

using namespace filippov;
using enum EventKind;

namespace {

using V3 = Vec<double, 3>;
using V4 = Vec<double, 4>;

/// Settings of a run in the units of a system.
Settings<double, 3> settings_of(const TwoFoldSystem& sys, double tol) {
    auto settings = bounded<3>(tol);
    for (int i = 0; i < 3; ++i)
        settings.atol[i] = tol * sys.scale[std::size_t(i)];
    return settings;
}
/// How far a state is from where (u, v) is on the surface, in the system's units.
double distance(const TwoFoldSystem& sys, const V3& x, double u, double v) {
    const V3 there = sys.start(u, v);
    double most = 0;
    for (int i = 0; i < 3; ++i)
        most = std::max(most, std::abs(x[i] - there[i]) / sys.scale[std::size_t(i)]);
    return most;
}
template <class T>
void ends_in_fold(const TwoFoldSystem& sys, double u, double v, double t, double tol,
                  double margin) {
    const auto r =
        run<T>(sys, {}, sys.start(u, v), 0, sys.t_scale * (t + 1), settings_of(sys, tol));
    INFO("tolerance " << tol << ", " << r.result.message());
    CHECK(r.result.status == Status::ambiguous);
    CHECK(std::string(r.result.diagnosis.what).starts_with("two-fold, "));
    CHECK(r.events.size() == 2);
    CHECK(r.result.t / sys.t_scale == Approx(t).epsilon(0).margin(margin));
    CHECK(distance(sys, r.result.x, 0, 0) <= tol);
}

/// Coefficients of a kind that random numbers often have.
Coefficients random_coefficients(std::mt19937& bits, bool nonlinear, bool invisible) {
    std::uniform_real_distribution<double> any(-1, 1);
    Coefficients c{2 * any(bits), 2 * any(bits), 2 * any(bits), 2 * any(bits)};
    if (invisible) {
        c.uu = -std::abs(c.uu) - 0.1;
        c.vv = -std::abs(c.vv) - 0.1;
        c.uv = std::abs(c.uv);
        c.vu = std::abs(c.vu);
    }
    for (double& b : c.bend)
        b = nonlinear ? any(bits) : 0;
    c.g1 = any(bits);
    c.g2 = any(bits);
    return c;
}
void disguise(TwoFoldSystem& sys, std::mt19937& bits, bool units) {
    std::uniform_real_distribution<double> any(-1, 1);
    const auto power = [&] { return std::pow(10, std::round(6 * any(bits))); };
    for (double& b : sys.bend)
        b = 0.4 * any(bits);
    for (double& o : sys.offset)
        o = any(bits);
    if (!units)
        return;
    for (double& s : sys.scale)
        s = power();
    sys.h_scale = power();
    sys.t_scale = power();
}

/// v and h alone; u = a - b t: the two-fold is at t = a/b, in the plane.
struct Driven {
    static constexpr int dim = 2;
    double a, b, vu, vv;

    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(vv), S(a) - S(b) * t};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(vu), -x[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};

/// A curve of two-folds, u = x0 - x3^2/2 = 0 = v = x1; x3 rises at other rates on both sides.
struct Family {
    static constexpr int dim = 4;
    Coefficients c;
    double rise1, rise2;

    template <class S> Vec<S, 4> field(int side, const Vec<S, 4>& x) const {
        const S u = x[0] - x[3] * x[3] / S(2), v = x[1];
        const auto a = c.along(side, u, v);
        const S rise(side == 1 ? rise1 : rise2);
        return {a[0] + x[3] * rise, a[1], side == 1 ? u : S(-v), rise};
    }
    template <Scalar S> Vec<S, 4> f1(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return field(1, x);
    }
    template <Scalar S> Vec<S, 4> f2(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return field(2, x);
    }
    template <Scalar S> S h(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const { return x[2]; }
};

/// The same fields as in TwoFoldSystem without a disguise, and a surface v = level that changes
/// nothing.
struct Beside {
    static constexpr int dim = 3;
    static constexpr int surfaces = 2;
    Coefficients c;
    double level;

    template <Scalar S>
    Vec<S, 3> field(const S&, const Vec<S, 3>& x, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        const auto a1 = c.along(1, x[0], x[1]), a2 = c.along(2, x[0], x[1]);
        const S share1 = (S(1) - s[0]) / S(2), share2 = (S(1) + s[0]) / S(2);
        return {share1 * a1[0] + share2 * a2[0], share1 * a1[1] + share2 * a2[1],
                share1 * x[0] - share2 * x[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {x[2], x[1] - S(level)};
    }
};

const Coefficients node{.uu = -1, .uv = 0.3, .vu = 0.3, .vv = -1}; // both folds invisible

} // namespace

TEMPLATE_TEST_CASE("two-fold: a slide into a node ends in it, at its time", "[two_fold]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    const TwoFoldSystem sys{.c = node};
    for (const double tol : {1e-3, 1e-6, 1e-9, 1e-12, 1e-14})
        for (const auto& [u, v] : {std::pair{0.9, 0.4}, std::pair{0.4, 0.9}, std::pair{0.5, 0.5}}) {
            CAPTURE(u, v);
            // of linear slides only steps err, and the last one is exact
            ends_in_fold<TestType>(sys, u, v, 1.3 * (u + v) / 0.91, tol, 10 * tol);
        }
}

TEMPLATE_TEST_CASE("two-fold: the orbit into a saddle, and into a node across it, ends there",
                   "[two_fold]", DormandPrince5, DormandPrince8, Rodas5P) {
    // Eigenvectors (1, 1), along which slides tend to it, and (1, -1), out of the slide: both folds
    // are visible. Beside that orbit a slide leaves on the side to which it is nearer.
    const double across = GENERATE(0.7, -0.4, -0.2); // the eigenvalue of (1, -1)
    const double a = (-1 + across) / 2, b = (-1 - across) / 2;
    const TwoFoldSystem sys{.c = {.uu = a, .uv = b, .vu = b, .vv = a}};
    CAPTURE(across);
    for (const double tol : {1e-4, 1e-8, 1e-12}) {
        ends_in_fold<TestType>(sys, 0.4, 0.4, 0.8, tol, 10 * tol);
        for (const double beside : {1e-2, -1e-2}) {
            const auto r = run<TestType>(sys, {}, sys.start(0.4 + beside, 0.4 - beside), 0, 0.9,
                                         settings_of(sys, tol));
            const auto right = outcome(sys.c, 0.4 + beside, 0.4 - beside);
            CHECK(r.result.status == Status::ok);
            REQUIRE(r.events.size() == 3);
            CHECK(r.events[1].mode_after[0] == (beside > 0 ? 1 : -1));
            CHECK(r.events[1].t == Approx(double(right.t)).epsilon(0).margin(100 * tol));
        }
    }
}

TEMPLATE_TEST_CASE("two-fold: slides turn round a focus and leave", "[two_fold]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    // (u, v)' = (v - u/2, -u - v/2): from u = 0 to v = 0, however near
    const TwoFoldSystem sys{.c = {.uu = -0.5, .uv = 1, .vu = -1, .vv = -0.5}};
    for (const double size : {0.5, 1e-2, 1e-4, 1e-6}) {
        const auto right = outcome(sys.c, 0.01 * size, size);
        REQUIRE(right.kind == SlideOutcome::above);
        const auto r = run<TestType>(sys, {}, sys.start(0.01 * size, size), 0,
                                     1.2 * double(right.t), settings_of(sys, 1e-10));
        CHECK(r.result.status == Status::ok);
        REQUIRE(r.events.size() == 3);
        CHECK(r.events[1].mode_after[0] == 1);
        CHECK(r.events[1].t == Approx(double(right.t)).epsilon(0).margin(1e-8));
        CHECK(distance(sys, r.events[1].x_left, double(right.u), 0) < 1e-8);
    }
}

TEMPLATE_TEST_CASE("two-fold: where slides turn so slowly that no number tells, they end in it",
                   "[two_fold]", DormandPrince5, DormandPrince8, Rodas5P) {
    // A focus that turns by 0.045 while the distance falls by a factor e, and a node with its
    // eigenvectors out of the slide: slides leave 1e-17 of their way from it, or nearer. From three
    // other foci they leave 1e-14 to 1e-17 from it.
    const Coefficients focus{.uu = -1.1765, .uv = 0.3223, .vu = -0.0543, .vv = -0.9295},
        node_aside{.uu = -1.002, .uv = -0.004, .vu = 0.0005, .vv = -0.998};
    struct Slide {
        Coefficients c;
        double u, v;
    };
    for (const auto& [c, u, v] : std::initializer_list<Slide>{
             {focus, 0.51, 0.93},
             {focus, 0.5, 0.6},
             {node_aside, 0.51, 0.93},
             {node_aside, 0.5, 0.6},
             {{.uu = -1.13395, .uv = 0.818191, .vu = -0.097983, .vv = -0.584652}, 0.3114, 0.6823},
             {{.uu = -0.509758, .uv = 0.393974, .vu = -0.292312, .vv = 0.168308}, 0.2964, 0.5026},
             {{.uu = -0.484005, .uv = -0.125504, .vu = 0.623946, .vv = -1.029478}, 0.5013, 0.1426}})
        for (const double tol : {1e-3, 1e-4, 1e-6, 1e-8, 1e-10}) {
            const TwoFoldSystem sys{.c = c};
            const double det = c.uu * c.vv - c.uv * c.vu;
            const double t = ((c.vu - c.vv) * u + (c.uv - c.uu) * v) / det;
            CAPTURE(c.uu, u, v);
            ends_in_fold<TestType>(sys, u, v, t, tol, 10 * tol);
            const std::vector<Member<3, 0>> members(3, {sys.start(u, v), {}, 0, t + 1});
            for (const auto& o : ensemble(sys, members, settings_of(sys, tol)).outcomes) {
                CHECK(o.status == Status::ambiguous);
                CHECK(o.x.cwiseAbs().maxCoeff() <= tol);
            }
        }
}

TEMPLATE_TEST_CASE("two-fold: random ones, nonlinear, in curved coordinates and in all units",
                   "[two_fold]", DormandPrince5, DormandPrince8, Rodas5P) {
    int folds = 0, exits = 0;
    for (unsigned k = 0; k < 200; ++k) {
        std::mt19937 bits(k);
        std::uniform_real_distribution<double> any(0, 1);
        TwoFoldSystem sys{.c = random_coefficients(bits, k % 2 == 1, k % 3 == 0)};
        if (k % 4 >= 2)
            disguise(sys, bits, k % 8 >= 6);
        if (k % 5 == 4)
            sys.t_scale = -sys.t_scale; // the same slides, backwards
        const double size = std::pow(10, -1.5 * any(bits)), part = 0.05 + 0.9 * any(bits),
                     u = part * size, v = (1 - part) * size;
        const auto right = outcome(sys.c, u, v);
        CAPTURE(k, u, v, right.kind, double(right.t));
        for (const double tol : {1e-4, 1e-7, 1e-10}) {
            // delicate: what ends elsewhere if the start moves by a hundred tolerances
            const double d = 100 * tol;
            const bool sure = [&] {
                for (const auto& [du, dv] : {std::pair{d, 0.}, {-d, 0.}, {0., d}, {0., -d}})
                    if (outcome(sys.c, u + du, v + dv, 1e-2L).kind != right.kind)
                        return false;
                return true;
            }();
            const double end = (right.kind == SlideOutcome::none ? 1 : 1.2) * double(right.t);
            const auto r = run<TestType>(sys, {}, sys.start(u, v), 0, sys.t_scale * end,
                                         settings_of(sys, tol));
            INFO("tolerance " << tol << ", " << r.result.message());
            // Who leaves within some tolerances of the two-fold may have met it.
            const bool close = std::max(double(right.u), double(right.v)) < 30 * tol;
            if (!sure || (right.kind != SlideOutcome::fold && close)) {
                CHECK((r.result.status == Status::ok || r.result.status == Status::ambiguous));
                continue;
            }
            // beside it the slide is accurate to its steps, each of which may err by a tolerance
            const double margin = 100 * tol * (1 + double(right.t));
            if (right.kind == SlideOutcome::fold) {
                ++folds;
                CHECK(r.result.status == Status::ambiguous);
                // (s may tend to 1, and touch it within the tolerance)
                CHECK(r.times(EventKind::exit_sliding).empty());
                CHECK(r.times(EventKind::cross).empty());
                CHECK(std::abs(r.result.t / sys.t_scale - double(right.t)) <= margin);
                CHECK(distance(sys, r.result.x, 0, 0) <= tol);
            } else if (right.kind == SlideOutcome::none) {
                CHECK(r.result.status == Status::ok);
                CHECK(r.events.size() == 2);
            } else {
                ++exits;
                REQUIRE(r.events.size() >= 3);
                CHECK(r.events[1].kind == exit_sliding);
                CHECK(r.events[1].mode_after[0] == (right.kind == SlideOutcome::below ? -1 : 1));
                CHECK(std::abs(r.events[1].t / sys.t_scale - double(right.t)) <= 10 * margin);
                CHECK(distance(sys, r.events[1].x_left, double(right.u), double(right.v)) <=
                      10 * margin);
            }
        }
    }
    CHECK(folds > 90);
    CHECK(exits > 90);
}

TEST_CASE("two-fold: a policy goes on to a side; to stay has no direction", "[two_fold]") {
    // visible below and above, along its strong direction
    const TwoFoldSystem sys{.c = {.uu = -0.8, .uv = -0.2, .vu = -0.2, .vv = -0.8}};
    auto settings = settings_of(sys, 1e-9);
    for (const auto& [policy, side] :
         {std::pair{NonUnique::below, -1}, std::pair{NonUnique::above, +1}}) {
        settings.on_nonunique = policy;
        const auto r = run<DormandPrince8>(sys, {}, sys.start(0.4, 0.4), 0, 1, settings);
        CHECK(r.result.status == Status::ok);
        REQUIRE(r.events.size() == 3);
        CHECK(r.events[1].t == Approx(0.8).epsilon(0).margin(1e-8));
        CHECK(r.events[1].mode_after[0] == side);
        // from (0, 0) for a time of 0.2
        const double u = 0.2 * (side < 0 ? sys.c.uv : sys.c.uu),
                     v = 0.2 * (side < 0 ? sys.c.vv : sys.c.vu);
        CHECK(r.result.x[0] == Approx(u).epsilon(0).margin(1e-8));
        CHECK(r.result.x[1] == Approx(v).epsilon(0).margin(1e-8));
    }
    settings.on_nonunique = NonUnique::stay;
    const auto r = run<DormandPrince8>(sys, {}, sys.start(0.4, 0.4), 0, 1, settings);
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.diagnosis.what == "L1 = L2: no sliding field");
    CHECK(distance(sys, r.result.x, 0, 0) <= 1e-9);
}

TEST_CASE("two-fold: of a field that time drives, in the plane", "[two_fold]") {
    for (unsigned k = 0; k < 100; ++k) {
        std::mt19937 bits(k);
        std::uniform_real_distribution<double> any(0, 1);
        const Driven sys{0.2 + any(bits), 0.2 + any(bits), 2 * any(bits) - 0.7, -2 * any(bits)};
        const double v = 0.1 + any(bits);
        const Coefficients c{-sys.b, -sys.b, sys.vu, sys.vv};
        const auto right = outcome(c, sys.a, v);
        CAPTURE(k, right.kind, double(right.t));
        for (const double tol : {1e-5, 1e-10}) {
            const auto r =
                run<DormandPrince8>(sys, {}, V2(v, 0), 0, 1.01 * double(right.t), bounded<2>(tol));
            if (right.kind == SlideOutcome::fold) {
                CHECK(r.result.status == Status::ambiguous);
                CHECK(r.result.t == Approx(sys.a / sys.b).epsilon(0).margin(tol));
                CHECK(r.result.x.cwiseAbs().maxCoeff() <= tol);
            } else if (std::max(double(right.u), double(right.v)) > 1e-3) {
                REQUIRE(r.events.size() >= 3);
                CHECK(r.events[1].t == Approx(double(right.t)).epsilon(0).margin(100 * tol));
            }
        }
    }
}

TEST_CASE("two-fold: at an instant, where a switch loses its force", "[two_fold]") {
    const double k = GENERATE(1.0, 0.3);
    const auto strength = [&](auto r) {
        return Line([=](const auto& t, const auto& x) { return like(x, r(t)); },
                    [=](const auto& t, const auto& x) { return like(x, -k * r(t)); },
                    [](const auto&, const auto& x) { return x[0]; });
    };
    const double tol = GENERATE(1e-5, 1e-10);
    const auto go_to = [&](const Line& sys, double end) {
        return run<DormandPrince8>(sys, {}, V1(0.0), 0, end, bounded<1>(tol));
    };
    // it turns repulsive
    auto r = go_to(strength([](const auto& t) { return 1 - t; }), 3);
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.t == Approx(1).epsilon(0).margin(1e-12));
    CHECK(std::abs(r.result.x[0]) <= eps); // of a force of size 1
    // It goes on attracting: x = 0 is the only solution. (The middle of the first run is the
    // instant itself.)
    for (const double end : {2.0, 2.7, 5.0}) {
        r = go_to(strength([](const auto& t) { return (t - 1) * (t - 1); }), end);
        CHECK(r.result.status == Status::ok);
        CHECK(r.result.t == end);
        CHECK(r.result.x[0] == 0);
    }
    // it turns repulsive slowly: 1e-16 of its force is left for a time of 5e-6
    r = go_to(strength([](const auto& t) { return (1 - t) * (1 - t) * (1 - t); }), 3);
    CHECK(r.result.status == Status::ambiguous);
    CHECK(r.result.t == Approx(1).epsilon(0).margin(1e-4));
    CHECK(r.result.x[0] == 0);
}

TEST_CASE("two-fold: one of a curve of them", "[two_fold]") {
    for (unsigned k = 0; k < 60; ++k) {
        std::mt19937 bits(k);
        std::uniform_real_distribution<double> any(-1, 1);
        const Family sys{random_coefficients(bits, false, true), any(bits), any(bits)};
        const auto right = outcome(sys.c, 0.3, 0.2);
        if (right.kind != SlideOutcome::fold)
            continue;
        // the integrals of v, by which F1 acts, and of u
        const auto& c = sys.c;
        const double det = c.uu * c.vv - c.uv * c.vu, of_u = (c.uv * 0.2 - c.vv * 0.3) / det,
                     of_v = (c.vu * 0.3 - c.uu * 0.2) / det,
                     end = 0.1 + sys.rise1 * of_v + sys.rise2 * of_u;
        const double size = 1 + std::abs(end) * std::abs(end) + double(right.t);
        for (const double tol : {1e-4, 1e-8, 1e-11}) {
            CAPTURE(k, tol);
            const auto r = run<DormandPrince8>(sys, {}, V4(0.3 + 0.1 * 0.1 / 2, 0.2, 0, 0.1), 0,
                                               2 * double(right.t), bounded<4>(tol));
            CHECK(r.result.status == Status::ambiguous);
            CHECK(r.result.t == Approx(of_u + of_v).epsilon(0).margin(20 * tol * size));
            const V4 there(end * end / 2, 0, 0, end);
            CHECK((r.result.x - there).cwiseAbs().maxCoeff() <= 20 * tol * size * size);
        }
    }
}

TEST_CASE("two-fold: of one surface, beside another", "[two_fold]") {
    for (const double tol : {1e-4, 1e-8, 1e-12})
        for (const double level : {-0.1, 0.3, 1e-2, 1e-5, 1e-7}) {
            CAPTURE(tol, level);
            const Beside sys{node, level};
            const auto r = run<DormandPrince8>(sys, {}, V3(0.9, 0.4, 0), 0, 3, bounded<3>(tol));
            CHECK(r.result.status == Status::ambiguous);
            CHECK(r.result.t == Approx(1.69 / 0.91).epsilon(0).margin(10 * tol));
            CHECK(r.result.x.cwiseAbs().maxCoeff() <= tol);
            // v may rise through the level first
            const auto crossed = r.times(cross);
            CHECK(crossed.size() == (level < 0 ? 0u : 1u));
        }
}

TEST_CASE("two-fold: members of an ensemble end as runs do", "[two_fold]") {
    for (unsigned k = 0; k < 40; ++k) {
        std::mt19937 bits(k);
        std::uniform_real_distribution<double> any(0, 1);
        TwoFoldSystem sys{.c = random_coefficients(bits, k % 2 == 1, k % 4 < 3)};
        std::vector<Member<3, 0>> members;
        std::vector<SlideOutcome> right;
        for (int i = 0; i < 16; ++i) {
            const double u = any(bits), v = any(bits);
            right.push_back(outcome(sys.c, 0.3 * u, 0.3 * v, 1e-2L));
            members.push_back({sys.start(0.3 * u, 0.3 * v), {}, 0, 0});
            const auto& o = right.back();
            members.back().t_end = o.kind == SlideOutcome::none ? 1 : 1.1 * double(o.t);
        }
        const double tol = 1e-8;
        const auto settings = settings_of(sys, tol);
        const auto all = ensemble(sys, members, settings);
        for (std::size_t i = 0; i < members.size(); ++i) {
            const auto& m = members[i];
            const auto alone = run<DormandPrince8>(sys, {}, m.x, 0, m.t_end, settings);
            CAPTURE(k, i, right[i].kind, alone.result.message());
            CHECK(all.outcomes[i].status == alone.result.status);
            if (right[i].kind == SlideOutcome::fold) {
                CHECK(all.outcomes[i].status == Status::ambiguous);
                CHECK(all.outcomes[i].x.cwiseAbs().maxCoeff() <= tol);
            } else if (alone.result.status == Status::ok) {
                // after a slide that ends near the two-fold errors grow
                CHECK((all.outcomes[i].x - alone.result.x).cwiseAbs().maxCoeff() <= 1e4 * tol);
            }
        }
    }
}
