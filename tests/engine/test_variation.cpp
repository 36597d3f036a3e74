// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of flows with crossings and slides: saltation matrices appear by themselves.

#include "run.hpp"

#include <filippov/engine/variation.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/unit_circle.hpp>

#include <Eigen/LU>

#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;

namespace {

/// x0 + e_i in component i, further directions for the parameters listed.
template <class D, int N> Vec<D, N> seeded(const Vec<double, N>& x, int first = 0) {
    Vec<D, N> y;
    for (int i = 0; i < N; ++i)
        y[i] = D::variable(x[i], first + i);
    return y;
}
template <class D, int P> Vec<D, P> constant(const Vec<double, P>& p) {
    Vec<D, P> q;
    for (int i = 0; i < P; ++i)
        q[i] = D(p[i]);
    return q;
}
template <class D, int N, int K> Mat<double, N, K> derivatives(const Vec<D, N>& x) {
    Mat<double, N, K> m;
    for (int r = 0; r < N; ++r)
        for (int c = 0; c < K; ++c)
            m(r, c) = value_of(x[r].d[std::size_t(c)]);
    return m;
}

/// dx(t_end)/dx0 of a flow.
template <class Sys>
Mat<double, dim_v<Sys>, dim_v<Sys>> monodromy(const Sys& sys, const Params<Sys, double>& p,
                                              const State<Sys, double>& x0, double t0, double t_end,
                                              double tol = 1e-13) {
    constexpr int N = dim_v<Sys>;
    using D = Dual<double, N>;
    const auto r = flow<DormandPrince8>(sys, constant<D>(p), seeded<D>(x0), D(t0), D(t_end),
                                        tolerance<N>(tol));
    REQUIRE(r.run.status == Status::ok);
    CHECK_FALSE(r.singular);
    return derivatives<D, N, N>(r.x);
}

/// Ends a run at the first event of a kind.
Observer<double, 2, 1> ends_at(EventKind kind) {
    return {.ends = [kind](const Event<double, 2, 1>& e) { return e.kind == kind; }};
}

Mat<double, 2, 2> rotation(double t) {
    Mat<double, 2, 2> r;
    r << std::cos(t), std::sin(t), -std::sin(t), std::cos(t);
    return r;
}

void check_close(const auto& a, const auto& b, double margin) {
    INFO("\n" << a << "\n and \n" << b);
    CHECK((a - b).cwiseAbs().maxCoeff() <= margin);
}

} // namespace

TEST_CASE("dual: functions have the derivatives of calculus", "[dual]") {
    using D = Dual<double, 1>;
    const auto slope = [](auto f, double x) { return f(D::variable(x, 0)).d[0]; };
    CHECK(slope([](D x) { return x * x * x; }, 2.0) == Approx(12).epsilon(1e-15));
    CHECK(slope([](D x) { return D(1) / x; }, 2.0) == Approx(-0.25).epsilon(1e-15));
    CHECK(slope([](D x) { return sqrt(x); }, 4.0) == Approx(0.25).epsilon(1e-15));
    CHECK(slope([](D x) { return exp(x); }, 0.5) == Approx(std::exp(0.5)).epsilon(1e-15));
    CHECK(slope([](D x) { return log(x); }, 0.5) == Approx(2).epsilon(1e-15));
    CHECK(slope([](D x) { return sin(x); }, 0.5) == Approx(std::cos(0.5)).epsilon(1e-15));
    CHECK(slope([](D x) { return cos(x); }, 0.5) == Approx(-std::sin(0.5)).epsilon(1e-15));
    CHECK(slope([](D x) { return tan(x); }, 0.5) ==
          Approx(1 / std::pow(std::cos(0.5), 2)).epsilon(1e-15));
    CHECK(slope([](D x) { return asin(x); }, 0.5) == Approx(1 / std::sqrt(0.75)).epsilon(1e-15));
    CHECK(slope([](D x) { return atan(x); }, 0.5) == Approx(0.8).epsilon(1e-15));
    CHECK(slope([](D x) { return sinh(x); }, 0.5) == Approx(std::cosh(0.5)).epsilon(1e-15));
    CHECK(slope([](D x) { return cosh(x); }, 0.5) == Approx(std::sinh(0.5)).epsilon(1e-15));
    CHECK(slope([](D x) { return tanh(x); }, 0.5) ==
          Approx(1 - std::pow(std::tanh(0.5), 2)).epsilon(1e-15));
    CHECK(slope([](D x) { return pow(x, 3); }, 0.0) == 0);
    CHECK(slope([](D x) { return pow(x, -2); }, 2.0) == Approx(-0.25).epsilon(1e-15));
    CHECK(slope([](D x) { return pow(x, D(2.5)); }, 2.0) ==
          Approx(2.5 * std::pow(2, 1.5)).epsilon(1e-14));
    CHECK(slope([](D x) { return abs(x); }, -2.0) == -1);
    CHECK(slope([](D x) { return 3.0 * x - x * 2.0 + x / 4 - 1; }, 5.0) == 1.25);
}

TEST_CASE("dual: a power of zero has the derivatives that it has", "[dual]") {
    using D = Dual<double, 2>;
    const D x = D::variable(0, 0);
    CHECK(pow(x, D(1.0)).d[0] == 1);
    CHECK(pow(x, D(1.5)).d[0] == 0);
    CHECK(pow(x, D(0.5)).d[0] == std::numeric_limits<double>::infinity());
    CHECK(pow(x, D(0.5)).d[1] == 0); // of what does not depend on that
    CHECK(pow(x, D(0.0)).v == 1);
    CHECK(pow(x, D(0.0)).d[0] == 0);
    CHECK(pow(D(0), D::variable(2.5, 1)).d[1] == 0); // 0^e for a varying e > 0
    using T = Taylor<D, 2>;
    const T along = pow(T::variable(x), T(D::variable(3.5, 1))); // (x + tau)^e at x = 0
    for (const D& c : along.c)
        for (const double d : c.d)
            CHECK(d == 0);
}
TEST_CASE("dual: nested twice gives second derivatives", "[dual]") {
    using D = Dual<Dual<double, 1>, 1>;
    const D x(Dual<double, 1>::variable(0.7, 0));
    D y = x;
    y.d[0] = Dual<double, 1>(1);
    const D z = sin(y) * exp(y);
    CHECK(value_of(z) == Approx(std::sin(0.7) * std::exp(0.7)).epsilon(1e-15));
    CHECK(z.d[0].d[0] == Approx(2 * std::cos(0.7) * std::exp(0.7)).epsilon(1e-15));
    CHECK(value_of(infinitesimal(z)) == 0);
    CHECK(infinitesimal(z).v.d[0] == z.v.d[0]);
}

TEST_CASE("variation: saltation at a crossing of a curved surface", "[variation]") {
    // x' = A1 x inside and A2 x outside |x| = 1, met at t = 1 (problem P2): everything is known
    const models::UnitCircle sys;
    const auto p = default_params<models::UnitCircle>();
    const Vec<double, 2> x0(std::exp(-1.0), 0);
    const double end = std::numbers::pi / 2, w = -2 * std::numbers::pi;
    const auto M = monodromy(sys, p, x0, 0, end);

    // exp(A t) = e^t R(w t); at t = 1 the state is (cos, -sin)(w) = (1, 0)
    const auto flow_of = [](double t, double angle) -> Mat<double, 2, 2> {
        return std::exp(t) * rotation(angle);
    };
    const Vec<double, 2> x(1, 0);
    Mat<double, 2, 2> A1, A2;
    A1 << 1, w, -w, 1;
    A2 << 1, -w, w, 1;
    const Vec<double, 2> f1 = A1 * x, f2 = A2 * x, n(1, 0);
    const Mat<double, 2, 2> S =
        Mat<double, 2, 2>::Identity() + (f2 - f1) * n.transpose() / n.dot(f1);
    const Mat<double, 2, 2> expected = flow_of(end - 1, -w * (end - 1)) * S * flow_of(1, w);
    check_close(M, expected, 1e-10);
}

TEST_CASE("variation: entry into sliding and exit", "[variation]") {
    // x'' + x = sin 0.5t - 0.4 sign x' from (1, 2) (problem P5): turn, turn, stick, slip
    const models::Coulomb sys;
    Vec<double, 3> p(0.4, 1.0, 0.5);
    const double turn1 = 1.062846232871, turn2 = 3.913987190289, stick = 4.415348156986,
                 slip = 6.140971435234, end = 7.0;
    const auto M = monodromy(sys, p, Vec<double, 2>(1, 2), 0, end);
    const Run<models::Coulomb> r =
        run<DormandPrince8>(sys, p, Vec<double, 2>(1, 2), 0, end, tolerance<2>(1e-13));
    REQUIRE(r.events.size() == 6);
    CHECK(r.events[3].t == Approx(stick).epsilon(1e-11));

    // L = sin 0.5t - x +- 0.4 at v = 0; the fields differ in v' alone by L
    const auto acceleration = [&](const auto& event, int side) {
        return std::sin(0.5 * event.t) - event.x_left[0] - side * 0.4;
    };
    Mat<double, 2, 2> expected = rotation(turn1);
    const auto saltation = [&](const auto& event, int before, double after) {
        Mat<double, 2, 2> S = Mat<double, 2, 2>::Identity();
        const double l = acceleration(event, before);
        S(1, 1) += (after - l) / l;
        return S;
    };
    expected = saltation(r.events[1], 1, acceleration(r.events[1], -1)) * expected;
    expected = rotation(turn2 - turn1) * expected;
    expected = saltation(r.events[2], -1, acceleration(r.events[2], 1)) * expected;
    expected = rotation(stick - turn2) * expected;
    expected = saltation(r.events[3], 1, 0.0) * expected; // entry: v' = 0 afterwards
    expected = rotation(end - slip) * expected;           // exit: the identity
    check_close(M, expected, 1e-9);
}

TEST_CASE("variation: parameters, start time and end time beside finite differences",
          "[variation]") {
    const models::Oscillator sys;
    auto p = default_params<models::Oscillator>();
    p[1] = 1.9; // crossings and slides
    p[0] = 4.4;
    constexpr int K = 6; // y, v, A, omega, t0, t_end
    using D = Dual<double, K>;
    auto q = constant<D>(p);
    q[0] = D::variable(p[0], 2);
    q[1] = D::variable(p[1], 3);
    const Vec<double, 2> x0(0.3, -0.4);
    const double t0 = 5.2, t_end = 5.2 + 11;
    const auto r = flow<DormandPrince8>(sys, q, seeded<D>(x0), D::variable(t0, 4),
                                        D::variable(t_end, 5), tolerance<2>(1e-13));
    REQUIRE(r.run.status == Status::ok);
    CHECK(r.run.counters.events >= 4);
    const auto exact = derivatives<D, 2, K>(r.x);

    const auto end = [&](const Vec<double, K>& z) -> Vec<double, 2> {
        auto params = p;
        params[0] = z[2];
        params[1] = z[3];
        return run<DormandPrince8>(sys, params, Vec<double, 2>(z[0], z[1]), z[4], z[5],
                                   tolerance<2>(1e-13))
            .result.x;
    };
    Vec<double, K> z;
    z << x0[0], x0[1], p[0], p[1], t0, t_end;
    Mat<double, 2, K> differences;
    for (int i = 0; i < K; ++i) {
        const Vec<double, K> e = 3e-4 * Vec<double, K>::Unit(i);
        const auto central = [&](double h) -> Vec<double, 2> {
            return (end(z + h * e) - end(z - h * e)) / (6e-4 * h);
        };
        // Richardson: the error of a difference falls with h^2, and then with h^4
        differences.col(i) = (4 * central(0.5) - central(1)) / 3;
    }
    check_close(exact, differences, 1e-6);
}

TEST_CASE("variation: second derivatives through events", "[variation]") {
    const models::Oscillator sys;
    auto p = default_params<models::Oscillator>();
    p[1] = 1.9;
    p[0] = 4.4;
    using Inner = Dual<double, 3>;
    using D = Dual<Inner, 3>; // y, v, omega
    const auto at = [&](const Vec<double, 3>& z) {
        Vec<D, 10> q = constant<D>(p);
        Vec<D, 2> x;
        const auto variable = [](double v, int i) {
            D d(Inner::variable(v, i));
            d.d[std::size_t(i)] = Inner(1);
            return d;
        };
        x[0] = variable(z[0], 0);
        x[1] = variable(z[1], 1);
        q[1] = variable(z[2], 2);
        const auto r = flow<DormandPrince8>(sys, q, x, D(5.2), D(16.2), tolerance<2>(1e-13));
        REQUIRE(r.run.status == Status::ok);
        return r.x;
    };
    const Vec<double, 3> z(0.3, -0.4, 1.9);
    const Vec<D, 2> x = at(z);
    for (int i = 0; i < 3; ++i) {
        const Vec<double, 3> e = 2e-4 * Vec<double, 3>::Unit(i);
        const Vec<D, 2> forward = at(z + e), backward = at(z - e);
        const Vec<D, 2> forward2 = at(z + e / 2), backward2 = at(z - e / 2);
        for (int r = 0; r < 2; ++r)
            for (std::size_t k = 0; k < 3; ++k) {
                const double wide = (forward[r].d[k].v - backward[r].d[k].v) / 4e-4;
                const double narrow = (forward2[r].d[k].v - backward2[r].d[k].v) / 2e-4;
                CAPTURE(r, i, k);
                CHECK(x[r].d[k].d[std::size_t(i)] ==
                      Approx((4 * narrow - wide) / 3).epsilon(1e-5).margin(1e-5));
                // Schwarz
                CHECK(x[r].d[k].d[std::size_t(i)] ==
                      Approx(x[r].d[std::size_t(i)].d[k]).epsilon(1e-9).margin(1e-9));
            }
    }
}

TEST_CASE("variation: neighbours of a solution that rests are followed as closely as others",
          "[variation]") {
    const models::UnitCircle sys; // r' = r, and a rotation
    using D = Dual<double, 2>;
    const auto p = default_params<models::UnitCircle>();
    const auto r = flow(sys, constant<D>(p), seeded<D>(Vec<double, 2>(0, 0)), D(0), D(20),
                        tolerance<2>(1e-10));
    CHECK(r.run.counters.steps < 20);
    // exp(20) times a rotation by 20 w; at ten tolerances a step, in some hundred steps
    const double turn = 20 * p[0];
    CHECK(r.x[0].d[0] == Approx(std::exp(20) * std::cos(turn)).epsilon(1e-6));
    CHECK(std::abs(r.x[1].d[0]) < 1e-6 * std::exp(20));
    CHECK(r.x[1].d[1] == Approx(r.x[0].d[0]).epsilon(1e-10));
}

TEST_CASE("variation: the values are those of the plain run", "[variation]") {
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    using D = Dual<double, 2>;
    const auto settings = tolerance<2>(1e-9);
    const Vec<double, 2> x0(0.1, 0.2);
    const auto r = flow(sys, constant<D>(p), seeded<D>(x0), D(0), D(50), settings);
    const auto plain = flow(sys, p, x0, 0.0, 50.0, settings);
    CHECK(values_of(r.x) == plain.x);
    CHECK(r.run.counters.field == plain.counters.field);
}

TEST_CASE("H36: slides limit the rank, exactly", "[variation][hard]") {
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const double T = period(sys, p);
    for (const int periods : {2, 20, 200}) {
        const auto M = monodromy(sys, p, Vec<double, 2>(0, 0), 0, periods * T, 1e-10);
        // after the first slide every column is a multiple of one vector
        const double size = M.cwiseAbs().maxCoeff();
        CAPTURE(periods, M);
        CHECK(std::abs(M.determinant()) <= 1e-15 * size * size);
    }
    // on the slide itself v = V whatever the start: a row of exact zeros
    const Run<models::Oscillator> r =
        run<DormandPrince5>(sys, p, Vec<double, 2>(0, 0), 0, 20, tolerance<2>(1e-10));
    double in_slide = 0;
    for (std::size_t i = 0; i + 1 < r.events.size(); ++i)
        if (r.events[i].mode_after[0] == 0)
            in_slide = (r.events[i].t + r.events[i + 1].t) / 2;
    REQUIRE(in_slide > 0);
    const auto M = monodromy(sys, p, Vec<double, 2>(0, 0), 0, in_slide, 1e-10);
    CHECK(M(1, 0) == 0);
    CHECK(M(1, 1) == 0);
    CHECK(std::abs(M(0, 0)) > 0);
}

TEST_CASE("H37: the derivative at a grazing contact is reported singular", "[variation][hard]") {
    // Without forcing, slip below has its highest point, v = V, over the fold y = 4. The run passes
    // `height` below that point half way.
    const models::Oscillator sys;
    auto p = default_params<models::Oscillator>();
    p[0] = 0;
    using D = Dual<double, 2>;
    const auto settings = tolerance<2>(1e-9);
    const auto passing = [&](double height) {
        const Vec<double, 2> top(4, 1 - height);
        const auto back = flow<DormandPrince8>(sys, p, top, 0.0, -0.3, settings);
        REQUIRE(back.status == Status::ok);
        return flow<DormandPrince8>(sys, constant<D>(p), seeded<D>(back.x), D(0), D(0.6), settings);
    };
    const auto clear = passing(1e-3);
    CHECK(clear.run.status == Status::ok);
    CHECK_FALSE(clear.singular);
    CHECK(std::abs(clear.x[0].d[0]) < 100);
    const auto touching = passing(1e-10);
    CHECK(touching.run.status == Status::ok);
    CHECK(touching.singular);
    CHECK(std::isfinite(touching.x[0].v));
    for (int i = 0; i < 2; ++i)
        for (std::size_t k = 0; k < 2; ++k)
            CHECK(std::isnan(touching.x[i].d[k]));
}

namespace {

/// Its surface x1 = 0 jumps to x1 = 1/2, at t = 1 or where x0 = 1; its fields lead there, across it
/// (speed 3), or hold the solution on it (speed 0).
struct JumpOfH {
    static constexpr int dim = 2;
    double speed = 0;
    bool in_time = true;
    template <class S> using X = Vec<S, 2>;
    template <Scalar S> X<S> f1(const S&, const X<S>& x, const Vec<S, 0>&) const {
        return {S(1) + S(0.2) * x[1], S(speed + 1) + S(0.3) * x[0]};
    }
    template <Scalar S> X<S> f2(const S&, const X<S>& x, const Vec<S, 0>&) const {
        return {S(1) + S(0.2) * x[1], S(speed - 1) + S(0.3) * x[0]};
    }
    template <Scalar S> S h(const S& t, const X<S>& x, const Vec<S, 0>&) const {
        return x[1] - S((in_time ? t : x[0]) < S(1) ? 0 : 0.5);
    }
};

} // namespace

TEST_CASE("H37: where h jumps there is no derivative, and that is said", "[variation][hard]") {
    using D = Dual<double, 2>;
    const bool in_time = GENERATE(true, false);
    const double speed = GENERATE(0.0, 3.0); // slides until then, or crosses by the jump
    const Vec<double, 2> start(0.1, speed == 0 ? 0 : -2.5);
    const auto r = flow<DormandPrince8>(JumpOfH{speed, in_time}, Vec<D, 0>(), seeded<D>(start),
                                        D(0), D(1.2), tolerance<2>(1e-10));
    CHECK(r.run.status == Status::ok);
    CHECK(r.singular == (speed == 0)); // (at 3.0 it is on its way to h = 0 all the time)
}

TEST_CASE("variation: the end at an event does not depend on sections passed before",
          "[variation]") {
    using D = Dual<double, 2>;
    const models::DieciLopez sys;
    const auto p = constant<D>(default_params<models::DieciLopez>());
    const auto settings = tolerance<2>(1e-12);
    const auto ends = ends_at(EventKind::exit_sliding);
    const auto x0 = seeded<D>(Vec<double, 2>(0, 0));
    const auto plain = flow<DormandPrince8>(sys, p, x0, D(0), D(20), settings, ends);
    const auto half = [](const auto&, const auto& x, const auto&) { return x[1] - 0.1; };
    const auto watched = flow<DormandPrince8>(sys, p, x0, D(0), D(20), settings, ends,
                                              sections(Section<decltype(half)>{half}));
    REQUIRE(plain.run.status == Status::event);
    REQUIRE(watched.run.status == Status::event);
    for (std::size_t k = 0; k < 2; ++k) {
        CHECK(std::abs(plain.t.d[k]) > 1);
        CHECK(watched.t.d[k] == Approx(plain.t.d[k]).epsilon(1e-9));
        CHECK(watched.x[0].d[k] == Approx(plain.x[0].d[k]).margin(1e-9));
    }
}

TEST_CASE("H37: a run that ends where it grazes is there, without a derivative",
          "[variation][hard]") {
    const models::Oscillator sys;
    auto p = default_params<models::Oscillator>();
    p[0] = 0;
    using D = Dual<double, 2>;
    const auto settings = tolerance<2>(1e-9);
    const Vec<double, 2> top(4, 1 - 1e-10);
    const auto back = flow<DormandPrince8>(sys, p, top, 0.0, -0.3, settings);
    const auto grazed = ends_at(EventKind::graze);
    const auto end = flow<DormandPrince8>(sys, constant<D>(p), seeded<D>(back.x), D(0), D(0.6),
                                          settings, grazed);
    CHECK(end.run.status == Status::event);
    CHECK(end.t.v == Approx(0.3).epsilon(1e-6));
    CHECK(end.x[0].v == Approx(4).epsilon(1e-6));
    CHECK(end.singular);
    CHECK(std::isnan(end.t.d[0]));
    CHECK(std::isnan(end.x[0].d[0]));
}
