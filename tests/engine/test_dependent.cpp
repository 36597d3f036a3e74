// SPDX-License-Identifier: BSD-3-Clause
// More surfaces meet than there are dimensions: friction, relays, diodes, an end stop. s is not
// unique, the velocity is. Against closed forms, and against minimal norms and implicit steps.

#include "catch.hpp"
#include "run.hpp"

#include <filippov/engine/variation.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <numbers>
#include <random>

using namespace filippov;

namespace {

constexpr int N = 4, M = 8;
using X = Vec<double, N>;

/// x' = drive sin(pace t) - sum c_j sign(a_j x) a_j: the gradient flow of sum c_j |a_j x|, driven.
/// h_j = scale_j a_j x.
struct Convex {
    static constexpr int dim = N;
    static constexpr int surfaces = M;
    static constexpr bool linear_h = true;
    int n_components = N, n_surfaces = M;
    std::array<X, M> a{};
    std::array<double, M> c{}, scale{};
    X drive = X::Zero();
    double pace = 1;

    int components() const { return n_components; }
    int count() const { return n_surfaces; }
    template <Scalar S>
    Vec<S, N> field(const S& t, const Vec<S, N>&, const Vec<S, M>& s, const Vec<S, 0>&) const {
        using elementary::sin;
        Vec<S, N> f;
        const S wave = sin(S(pace) * t);
        for (int i = 0; i < N; ++i) {
            f[i] = S(drive[i]) * wave;
            for (std::size_t j = 0; j < std::size_t(n_surfaces); ++j)
                f[i] -= S(std::copysign(c[j], scale[j]) * a[j][i]) * s[int(j)];
        }
        return f;
    }
    template <Scalar S> Vec<S, M> h(const S&, const Vec<S, N>& x, const Vec<S, 0>&) const {
        Vec<S, M> h = Vec<S, M>::Constant(S(1));
        for (std::size_t j = 0; j < std::size_t(n_surfaces); ++j) {
            h[int(j)] = S(0);
            for (int i = 0; i < n_components; ++i)
                h[int(j)] += S(scale[j] * a[j][i]) * x[i];
        }
        return h;
    }
};

Convex draw(std::mt19937& generator, int n_components, int n_surfaces, bool integers) {
    std::uniform_real_distribution<double> real(-1, 1);
    std::uniform_int_distribution<int> integer(-2, 2), power(-9, 9);
    Convex f;
    f.n_components = n_components;
    f.n_surfaces = n_surfaces;
    for (std::size_t j = 0; j < M; ++j) {
        f.a[j].setZero();
        const auto is_poor = [&] { // short, or that of a surface there is (which is refused)
            bool poor = f.a[j].norm() < 0.3;
            for (std::size_t k = 0; k < j; ++k)
                poor = poor || std::abs(f.a[j].normalized().dot(f.a[k].normalized())) > 0.999;
            return poor;
        };
        while (j < std::size_t(n_surfaces) && is_poor())
            for (int i = 0; i < n_components; ++i)
                f.a[j][i] = integers ? integer(generator) : real(generator);
        f.c[j] = 1.1 + real(generator);
        f.scale[j] = std::pow(10, power(generator)) * (real(generator) > 0 ? 1 : -1);
    }
    return f;
}

/// What has the least norm of all drive - sum c_j s_j a_j with these s_j, 2 standing for any.
X least_velocity(const Convex& f, const std::array<int, M>& side, const X& drive) {
    X v = drive;
    std::array<double, M> s{};
    for (std::size_t j = 0; j < std::size_t(f.n_surfaces); ++j)
        if (side[j] != 2)
            v -= f.c[j] * side[j] * f.a[j];
    for (int sweep = 0; sweep < 20000; ++sweep) {
        double moved = 0;
        for (std::size_t j = 0; j < std::size_t(f.n_surfaces); ++j) {
            if (side[j] != 2)
                continue;
            const double was = s[j], size = f.c[j] * f.a[j].squaredNorm();
            s[j] = std::clamp(was + v.dot(f.a[j]) / size, -1.0, 1.0);
            v -= f.c[j] * (s[j] - was) * f.a[j];
            moved = std::max(moved, std::abs(s[j] - was));
        }
        if (moved < 1e-15)
            break;
    }
    return v;
}
/// The gradient flow without a drive: at each kink on with the least velocity.
X follow_least_velocity(const Convex& f, X x, double t_end) {
    for (double t = 0; t < t_end;) {
        std::array<int, M> side{};
        for (std::size_t j = 0; j < std::size_t(f.n_surfaces); ++j) {
            const double h = f.a[j].dot(x);
            side[j] = std::abs(h) < 1e-9 ? 2 : h < 0 ? -1 : 1;
        }
        const X v = least_velocity(f, side, X::Zero());
        double dt = t_end - t;
        for (std::size_t j = 0; j < std::size_t(f.n_surfaces); ++j)
            if (const double rate = f.a[j].dot(v); side[j] != 2 && side[j] * rate < -1e-9)
                dt = std::min(dt, -f.a[j].dot(x) / rate);
        x += dt * v;
        t += dt;
    }
    return x;
}
/// The driven flow by implicit steps: errs by about their length.
X follow_implicitly(const Convex& f, X x, double t_end, int steps) {
    const double dt = t_end / steps;
    std::array<double, M> s{};
    for (int k = 1; k <= steps; ++k) {
        X y = x + dt * std::sin(f.pace * dt * k) * f.drive;
        for (std::size_t j = 0; j < std::size_t(f.n_surfaces); ++j)
            y -= dt * f.c[j] * s[j] * f.a[j];
        for (int sweep = 0; sweep < 2000; ++sweep) {
            double moved = 0;
            for (std::size_t j = 0; j < std::size_t(f.n_surfaces); ++j) {
                const double was = s[j], size = dt * f.c[j] * f.a[j].squaredNorm();
                s[j] = std::clamp(was + y.dot(f.a[j]) / size, -1.0, 1.0);
                y -= dt * f.c[j] * (s[j] - was) * f.a[j];
                moved = std::max(moved, std::abs(s[j] - was));
            }
            if (moved < 1e-12)
                break;
        }
        x = y;
    }
    return x;
}

} // namespace

TEMPLATE_TEST_CASE("dependent: gradients of convex functions, to rest where all surfaces meet",
                   "[dependent]", DormandPrince5, DormandPrince8, Rodas5P) {
    std::mt19937 generator(11);
    std::uniform_real_distribution<double> real(-1, 1);
    int rested = 0;
    for (int k = 0; k < 24; ++k) {
        const int n_components = 2 + k % 3, n_surfaces = 2 + k % 6;
        const Convex f = draw(generator, n_components, n_surfaces, k % 3 == 0);
        X x0 = X::Zero();
        for (int i = 0; i < n_components; ++i)
            x0[i] = real(generator);
        for (const double t_end : {0.3, 3.0}) {
            CAPTURE(k, n_components, n_surfaces, t_end);
            const auto r = run<TestType>(f, {}, x0, 0, t_end, tolerance<N>(1e-9));
            INFO(r.result.message());
            REQUIRE(r.result.status == Status::ok);
            const X x = follow_least_velocity(f, x0, t_end);
            CHECK((r.result.x - x).cwiseAbs().maxCoeff() < 1e-7);
            rested += r.result.mode.sliding() == n_surfaces;
        }
    }
    CHECK(rested > 12);
}

TEMPLATE_TEST_CASE("dependent: driven, they stick and slip", "[dependent]", DormandPrince5,
                   DormandPrince8, Rodas5P) {
    std::mt19937 generator(12);
    std::uniform_real_distribution<double> real(-1, 1);
    int left = 0;
    for (int k = 0; k < 12; ++k) {
        const int n_components = 2 + k % 3, n_surfaces = n_components + 1 + k % 2;
        Convex f = draw(generator, n_components, n_surfaces, k % 3 == 0);
        double most = 0;
        for (int i = 0; i < n_components; ++i)
            f.drive[i] = real(generator);
        for (std::size_t j = 0; j < std::size_t(n_surfaces); ++j)
            most += f.c[j] * f.a[j].norm();
        f.drive *= 1.5 * most / f.drive.norm();
        CAPTURE(k, n_components, n_surfaces);
        const auto r = run<TestType>(f, {}, X(X::Zero()), 0, 6, tolerance<N>(1e-9));
        INFO(r.result.message());
        REQUIRE(r.result.status == Status::ok);
        const X x = follow_implicitly(f, X::Zero(), 6, 6000);
        CHECK((r.result.x - x).cwiseAbs().maxCoeff() < 0.01 * most);
        for (const auto& e : r.events)
            left += e.kind == EventKind::exit_sliding && e.mode_before.sliding() > n_components;
    }
    CHECK(left >= 12);
}

// --- friction and an end stop ------------------------------------------------------------------

namespace {

using V2 = Vec<double, 2>;
using V4 = Vec<double, 4>;

/// A cylinder with dry friction between end stops: x'' = 3 sin t - sign(x')/2, |x| <= 1/2; with
/// `up` = -1 seen from the other side, and h as large as its scale says.
struct Cylinder {
    static constexpr int dim = 2;
    static constexpr int surfaces = 3;
    static constexpr bool linear_h = true;
    static constexpr std::array kinds{SurfaceKind::switching, SurfaceKind::jump, SurfaceKind::jump};
    double restitution = 0, scale = 1, up = 1;

    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        using elementary::sin;
        return {x[1], S(3 * up) * S(sin(t)) - S(0.5) * s[0]};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(scale) * x[1], S(scale) * (S(0.5) - x[0]), S(0.5) + x[0]};
    }
    template <Scalar S> Vec<S, 2> jump(int, const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], S(-restitution) * x[1]};
    }
};

/// A block that falls in a guide onto a floor: x' = u, y' = w, with friction across (u) or along
/// the fall (w) as well.
struct Guide {
    static constexpr int dim = 4;
    static constexpr int surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::switching, SurfaceKind::switching,
                                      SurfaceKind::jump};
    double across = 0.3, along = 0.2, restitution = 0.5;

    template <Scalar S>
    Vec<S, 4> field(const S&, const Vec<S, 4>& x, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        return {x[2], x[3], S(-across) * s[0], S(-1) - S(along) * s[1]};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[2], x[3], x[1]};
    }
    template <Scalar S> Vec<S, 4> jump(int, const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[0], x[1], x[2], S(-restitution) * x[3]};
    }
};

const double asin_sixth = std::asin(1.0 / 6);

} // namespace

TEMPLATE_TEST_CASE("dependent: friction and a stop hold the same speed", "[dependent]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double up : {1.0, -1.0})
        for (const double scale : {1.0, 1e-9, 1e9})
            for (const double restitution : {0.0, 0.4}) {
                CAPTURE(up, scale, restitution);
                const Cylinder cylinder{restitution, scale, up};
                auto r = run<TestType>(cylinder, {}, V2(0, 0), 0, 3, tolerance<2>(1e-10));
                INFO(r.result.message());
                REQUIRE(r.result.status == Status::ok);
                CHECK(r.events[1].t == Approx(asin_sixth).epsilon(1e-10));
                CHECK(r.result.x[0] == Approx(0.5 * up).epsilon(1e-14));
                CHECK(r.result.x[1] == 0);
                CHECK(r.result.mode[0] == 0);
                CHECK(r.result.mode[up > 0 ? 1 : 2] == 0);
                // 3 sin t pushes against the stop, which takes it; friction then has nothing to do
                CHECK(std::abs(r.events.back().s) < 1e-6);
                // until it pulls more than friction holds
                const double leaves = std::numbers::pi + asin_sixth;
                r = run<TestType>(cylinder, {}, V2(0, 0), 0, leaves + 0.5, tolerance<2>(1e-10));
                REQUIRE(r.result.status == Status::ok);
                const auto& exit = r.events[r.events.size() - 2];
                CHECK(exit.kind == EventKind::exit_sliding);
                CHECK(exit.t == Approx(leaves).epsilon(1e-10));
                CHECK(exit.mode_after[0] == -int(up));
                const double x = 3 * (std::sin(leaves) - std::sin(leaves + 0.5)) +
                                 3 * 0.5 * std::cos(leaves) + 0.5 * 0.125;
                CHECK(r.result.x[0] == Approx(up * (0.5 + x + 0)).epsilon(1e-8));
            }
}

TEMPLATE_TEST_CASE("dependent: a bouncing body in a dry guide comes to rest", "[dependent]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double e : {0.0, 0.5}) {
        const Guide guide{0.3, 0.2, e};
        const auto r = run<TestType>(guide, {}, V4(0, 1, 0.6, 0), 0, 20, tolerance<4>(1e-10));
        INFO(r.result.message());
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.result.x[0] == Approx(0.6 * 0.6 / 0.6).epsilon(1e-9)); // u^2/(2 across)
        CHECK(std::abs(r.result.x[1]) < 1e-10);
        CHECK(r.result.x[2] == 0);
        CHECK(std::abs(r.result.x[3]) < 1e-10);
        CHECK(r.result.mode == Mode<3>{{0, 0, 0}});
        // falls with 0.8, rises against 1.2
        const double fall = std::sqrt(2 / 0.8);
        CHECK(r.times(EventKind::jump)[0] == Approx(fall).epsilon(1e-9));
    }
}

// --- twisting ----------------------------------------------------------------------------------

namespace {

/// x'' = d(t) - 2 sign x - sign x', d = rise t + wave sin t.
struct Twisting {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    static constexpr bool linear_h = true;
    double rise = 0, wave = 0, scale = 1;
    std::array<double, 2> gain{2, 1};

    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>& x, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        using elementary::sin;
        return {x[1], S(rise) * t + S(wave) * S(sin(t)) - S(gain[0]) * s[0] - S(gain[1]) * s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(scale) * x[0], x[1]};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: twisting comes to rest and stays there", "[dependent]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double scale : {1.0, 1e-9, 1e9})
        for (const double wave : {0.0, 0.4, -0.9})
            for (const double x0 : {1.0, -0.3}) {
                CAPTURE(scale, wave, x0);
                const Twisting twisting{0, wave, scale};
                const auto r = run<TestType>(twisting, {}, V2(x0, 0), 0, 40, tolerance<2>(1e-9));
                INFO(r.result.message());
                REQUIRE(r.result.status == Status::ok);
                CHECK(r.result.x.cwiseAbs().maxCoeff() < 1e-12);
                CHECK(r.result.mode == Mode<2>{{0, 0}});
                // falls from x with 1, stops with 3: every swing takes 1/sqrt 3 of the one before;
                // the last ones are lower than a thousandth of the tolerance
                const double first = std::sqrt(2 * std::abs(x0)) * 4 / 3;
                if (wave == 0)
                    CHECK(r.events[r.events.size() - 2].t ==
                          Approx(first / (1 - 1 / std::sqrt(3))).margin(1e-5));
            }
    // until the disturbance is larger than both
    const auto r = run<TestType>(Twisting{0.5}, {}, V2(0, 0), 0, 8, tolerance<2>(1e-9));
    INFO(r.result.message());
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.events[1].t == Approx(6).epsilon(1e-9));
    CHECK(r.events[1].mode_after == Mode<2>{{1, 1}});
    CHECK(r.result.x[0] == Approx(0.5 * 8 / 6).epsilon(1e-6)); // t^3/12 after that
}

TEMPLATE_TEST_CASE("dependent: what twists the other way does not rest", "[dependent]",
                   DormandPrince5, DormandPrince8) {
    // it spirals out of the origin, at any time
    for (const std::array<double, 2> gain :
         {std::array{2.0, -1.0}, std::array{-2.0, 1.0}, std::array{2.0, 0.0}}) {
        Twisting twisting;
        twisting.gain = gain;
        const auto r = run<TestType>(twisting, {}, V2(0, 0), 0, 8, tolerance<2>(1e-9));
        CHECK(r.result.status == Status::ambiguous);
        CHECK(r.result.t == 0);
    }
}

namespace {

/// What looks like twisting and passes: x' = 1, y' = -2 sign x - sign y.
struct Passing {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;

    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {S(1), S(-2) * s[0] - s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], x[1]};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: a surface that is passed alike in all regions is passed",
                   "[dependent]", DormandPrince5, DormandPrince8) {
    const auto r = run<TestType>(Passing{}, {}, V2(-1, -1), 0, 3, tolerance<2>(1e-9));
    INFO(r.result.message());
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.result.x[0] == Approx(2));
    const auto at = run<TestType>(Passing{}, {}, V2(0, 0), 0, 3, tolerance<2>(1e-9));
    REQUIRE(at.result.status == Status::ok);
    CHECK(at.result.x[1] == Approx(-3)); // y' = -2 + 1
}

// --- the same surface twice --------------------------------------------------------------------

namespace {

/// x' = drive t - a s0 - b s1, y' = c s1 + q s0, with h = x and factor x.
struct Twofold {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    double factor = 2, a = 1, b = 1, c = 0, q = 0, drive = 1;

    template <Scalar S>
    Vec<S, 2> field(const S& t, const Vec<S, 2>&, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {S(drive) * t - S(a) * s[0] - S(b) * s[1], S(c) * s[1] + S(q) * s[0]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], S(factor) * x[0]};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: one surface given twice is refused, and said to be", "[dependent]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double factor : {2.0, 1.0, 1e-9, 1e9})
        for (const Twofold& sys : {Twofold{factor, 1, 0.5, 0, 0, 1}, Twofold{factor, 1, 1, 1, 0, 0},
                                   Twofold{factor, -1, -1, 0, 0, 0}}) {
            const auto r = run<TestType>(sys, {}, V2(0, 0), 0, 3, tolerance<2>(1e-9));
            CHECK(r.result.status == Status::dependent_surfaces);
            CHECK(r.result.t == 0);
            CHECK(r.result.message().find("are the same") != std::string::npos);
        }
}

// --- surfaces that part ------------------------------------------------------------------------

namespace {

/// A block between two belts, of which the weaker one starts to move at t = 1.
struct Belts {
    static constexpr int dim = 2;
    static constexpr int surfaces = 2;
    int power = 2; ///< its speed is (t - 1)^power

    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {x[1], S(0) - s[0] - S(0.6) * s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        const S late = t > S(1) ? t - S(1) : S(0);
        return {x[1], x[1] - (power == 2 ? late * late : late)};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: surfaces that were one part, and the block stays with one of them",
                   "[dependent]", DormandPrince5, DormandPrince8) {
    for (const int power : {1, 2}) {
        CAPTURE(power);
        const auto r = run<TestType>(Belts{power}, {}, V2(0, 0), 0, 3, tolerance<2>(1e-9));
        INFO(r.result.message());
        REQUIRE(r.result.status == Status::ok);
        const auto& exit = r.events[r.events.size() - 2];
        CHECK(exit.t == Approx(1).epsilon(1e-8));
        CHECK(exit.mode_after == Mode<2>{{0, -1}});
        CHECK(r.events.back().s == Approx(0.6));
        CHECK(r.result.x.cwiseAbs().maxCoeff() < 1e-12);
    }
}

// --- diodes ------------------------------------------------------------------------------------

namespace {

/// A bridge of six diodes between three phases with inductances and a capacitor with a load:
/// i_k' = e_k - v_n - (v/2) sign i_k, i_1 + i_2 + i_3 = 0, v' = (|i_1| + |i_2| + |i_3|)/2 - v/5.
struct Bridge {
    static constexpr int dim = 3;
    static constexpr int surfaces = 3;
    static constexpr bool linear_h = true;
    double volts = 1, scale = 1;

    template <Scalar S>
    Vec<S, 3> field(const S& t, const Vec<S, 3>& x, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        using elementary::sin;
        Vec<S, 3> drop;
        for (int k = 0; k < 3; ++k)
            drop[k] = S(volts) * S(sin(t - S(2 * std::numbers::pi / 3 * k))) - x[2] * s[k] * S(0.5);
        const S neutral = (drop[0] + drop[1] + drop[2]) / S(3), third = S(0) - x[0] - x[1];
        const S rectified = x[0] * s[0] + x[1] * s[1] + third * s[2];
        return {drop[0] - neutral, drop[1] - neutral, rectified * S(0.5) - x[2] / S(5)};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {x[0], S(scale) * x[1], S(0) - x[0] - x[1]};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: a bridge of diodes blocks, and conducts by two phases",
                   "[dependent]", DormandPrince5, DormandPrince8, Rodas5P) {
    const double pi = std::numbers::pi;
    const auto line = [&](double t) { // the largest difference of two phases
        double low = 1, high = -1;
        for (int k = 0; k < 3; ++k) {
            low = std::min(low, std::sin(t - 2 * pi / 3 * k));
            high = std::max(high, std::sin(t - 2 * pi / 3 * k));
        }
        return high - low;
    };
    for (const double scale : {1.0, 1e-9, 1e9})
        for (const double v0 : {2.0, 2.5, 5.0}) {
            CAPTURE(scale, v0);
            double t = 0;
            while (v0 * std::exp(-t / 5) > line(t))
                t += 1e-5;
            const auto r = run<TestType>(Bridge{1, scale}, {}, Vec<double, 3>(0, 0, v0), 0,
                                         t + 0.05, tolerance<3>(1e-9));
            INFO(r.result.message());
            REQUIRE(r.result.status == Status::ok);
            CHECK(r.events[0].mode_after == Mode<3>{{0, 0, 0}});
            CHECK(r.events[1].t == Approx(t).margin(2e-5));
            CHECK(r.events[1].mode_after.sliding() == 1);
            CHECK(r.events[1].x_right[2] == Approx(v0 * std::exp(-t / 5)).epsilon(1e-4));
            CHECK(r.result.x.head(2).cwiseAbs().maxCoeff() > 1e-6);
            // at start without a voltage there is no slide
            const auto cold = run<TestType>(Bridge{1, scale}, {}, Vec<double, 3>(0, 0, 0), 0.1, 9,
                                            tolerance<3>(1e-9));
            INFO(cold.result.message());
            CHECK(cold.result.status == Status::ok);
        }
}

// --- contacts alone ----------------------------------------------------------------------------

namespace {

/// Two bodies of weight one, one on the other on a floor; the lower one is pulled up with t.
struct Stack {
    static constexpr int dim = 4;
    static constexpr int surfaces = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    bool floor_first = true;

    template <Scalar S> Vec<S, 4> f(const S& t, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[2], x[3], t - S(1), S(-1)};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return floor_first ? Vec<S, 2>(x[0], x[1] - x[0]) : Vec<S, 2>(x[1] - x[0], x[0]);
    }
    template <Scalar S>
    Vec<S, 4> jump(int j, const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        if ((j == 0) == floor_first)
            return {x[0], x[1], S(0) * x[2], x[3]};
        const S both = (x[2] + x[3]) * S(0.5);
        return {x[0], x[1], both, both};
    }
};

/// A body in a corner of three walls of the plane, x, y and x + y >= 0, pushed by (t - 1, -1).
struct Corner {
    static constexpr int dim = 4;
    static constexpr int surfaces = 3;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump, SurfaceKind::jump};
    double scale = 1;

    template <Scalar S> Vec<S, 4> f(const S& t, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[2], x[3], t - S(1), S(-1)};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        return {x[0], x[1], S(scale) * (x[0] + x[1])};
    }
    template <Scalar S>
    Vec<S, 4> jump(int j, const S&, const Vec<S, 4>& x, const Vec<S, 0>&) const {
        if (j == 0)
            return {x[0], x[1], S(0) * x[2], x[3]};
        if (j == 1)
            return {x[0], x[1], x[2], S(0) * x[3]};
        const S half = (x[2] + x[3]) * S(0.5);
        return {x[0], x[1], x[2] - half, x[3] - half};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: a contact carries what rests on the body", "[dependent]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const bool floor_first : {true, false}) {
        const auto r =
            run<TestType>(Stack{floor_first}, {}, V4(0, 0, 0, 0), 0, 4, tolerance<4>(1e-9));
        INFO(r.result.message());
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.events[1].t == Approx(2).epsilon(1e-9)); // both weights
        CHECK(r.result.mode.sliding() == 1);
        for (const int body : {0, 1})
            CHECK(r.result.x[body] == Approx(8.0 / 12).epsilon(1e-7)); // x'' = (t - 2)/2
    }
}

TEMPLATE_TEST_CASE("dependent: three walls meet in a corner of the plane", "[dependent]",
                   DormandPrince5, DormandPrince8, Rodas5P) {
    for (const double scale : {1.0, 1e-9, 1e9}) {
        const auto r = run<TestType>(Corner{scale}, {}, V4(0, 0, 0, 0), 0, 3, tolerance<4>(1e-9));
        INFO(r.result.message());
        REQUIRE(r.result.status == Status::ok);
        CHECK(r.events[0].mode_after == Mode<3>{{0, 0, 0}});
        CHECK(r.events[1].t == Approx(1).epsilon(1e-9));
        CHECK(r.events[1].mode_after == Mode<3>{{1, 0, 1}});
        CHECK(r.result.x[0] == Approx(8.0 / 6).epsilon(1e-7));
        CHECK(std::abs(r.result.x[1]) < 1e-12);
    }
}

// --- what still stops --------------------------------------------------------------------------

TEMPLATE_TEST_CASE("dependent: backwards in time what rests may have come from anywhere",
                   "[dependent]", DormandPrince5, DormandPrince8) {
    std::mt19937 generator(21);
    const Convex f = draw(generator, 2, 4, false);
    auto r = run<TestType>(f, {}, X(X::Zero()), 1, 0, tolerance<N>(1e-9)).result;
    CHECK(r.status == Status::ambiguous);
    CHECK(r.t == 1);
    const auto back = run<TestType>(Twisting{}, {}, V2(0, 0), 1, 0, tolerance<2>(1e-9)).result;
    CHECK(back.status == Status::ambiguous);
    CHECK(back.t == 1);
}

namespace {

/// Three relays in the plane that turn it round: x' = -s0 - s2 + turn (s1, -s0), with h = x, y,
/// x + y; with a part that is not affine in s.
struct Turning {
    static constexpr int dim = 2;
    static constexpr int surfaces = 3;
    double turn = 0, product = 0;

    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>&, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        const S both = S(product) * s[0] * s[1];
        return {S(turn) * s[1] - s[0] - s[2] + both, S(0) - s[1] - s[2] - S(turn) * s[0]};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[0], x[1], x[0] + x[1]};
    }
};

} // namespace

TEMPLATE_TEST_CASE("dependent: what is not shown to stay, or has no unique velocity, stops",
                   "[dependent]", DormandPrince5, DormandPrince8) {
    const auto at_rest = [](double turn, double product) {
        return run<TestType>(Turning{turn, product}, {}, V2(0, 0), 0, 1, tolerance<2>(1e-9)).result;
    };
    CHECK(at_rest(0, 0).status == Status::ok);
    CHECK(at_rest(8, 0).status == Status::ambiguous);
    CHECK(at_rest(0, 0.1).status != Status::ok);
}

// --- derivatives -------------------------------------------------------------------------------

TEST_CASE("dependent: derivatives through such slides are right, or said not to be",
          "[dependent]") {
    using D = Dual<double, 4>;
    std::mt19937 generator(5);
    std::uniform_real_distribution<double> real(-1, 1);
    int right = 0;
    for (int k = 0; k < 8; ++k) {
        Convex f = draw(generator, 2, 3, k % 2 == 0);
        if (k >= 4)
            f.drive.head(2) = Vec<double, 2>(9, 4);
        X x0 = X::Zero();
        x0.head(2) = Vec<double, 2>(0.3 * real(generator), 0.3 * real(generator));
        Vec<D, N> x;
        for (int i = 0; i < N; ++i) {
            x[i] = D(x0[i]);
            x[i].d[std::size_t(i)] = 1;
        }
        const auto r = flow<DormandPrince5>(f, Vec<D, 0>{}, x, D(0.0), D(3.0), tolerance<N>(1e-11));
        REQUIRE(r.run.status == Status::ok);
        if (r.singular)
            continue;
        ++right;
        for (int i = 0; i < 2; ++i) {
            X ahead = x0, behind = x0;
            ahead[i] += 1e-5;
            behind[i] -= 1e-5;
            const X a = run<DormandPrince5>(f, {}, ahead, 0, 3, tolerance<N>(1e-11)).result.x,
                    b = run<DormandPrince5>(f, {}, behind, 0, 3, tolerance<N>(1e-11)).result.x;
            for (int q = 0; q < 2; ++q)
                CHECK(r.x[q].d[std::size_t(i)] == Approx((a[q] - b[q]) / 2e-5).margin(1e-4));
        }
    }
    CHECK(right >= 4);
}
