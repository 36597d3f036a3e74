// SPDX-License-Identifier: BSD-3-Clause
// Clocks and latches: what their multipliers and exponents are, against matrix exponentials.

#include "catch.hpp"
#include "converter.hpp"

#include <filippov/models/impacts.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/discrete.hpp>
#include <filippov/orbits/lyapunov.hpp>
#include <filippov/orbits/maps.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

using namespace filippov;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

// --- the converter, solved in closed form: nothing of the library --------------------------------

using Boost = ClockedBoost<>;

/// exp(A t) of a matrix with a pair of complex eigenvalues a +- ib.
Eigen::Matrix2d exponential(const Eigen::Matrix2d& A, double t) {
    const double a = A.trace() / 2, b = std::sqrt(A.determinant() - a * a);
    const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
    return std::exp(a * t) * (std::cos(b * t) * one + std::sin(b * t) / b * (A - a * one));
}

struct Solved {
    Eigen::Vector2d x; ///< voltage and current at the clock
    Eigen::Matrix2d slope;
};
/// A period of the converter, switched on at its beginning.
Solved period_of(const Eigen::Vector2d& x, double I_ref) {
    constexpr double E = Boost::E, L = Boost::L, C = Boost::C, R = Boost::R, T = Boost::T;
    Eigen::Matrix2d A;
    A << -1 / (R * C), 1 / C, -1 / L, 0;
    const Eigen::Vector2d rest(E, E / R);
    const double t_on = (I_ref - x[1]) * L / E;
    REQUIRE((t_on > 0 && t_on < T));
    const double fall = std::exp(-t_on / (R * C));
    const Eigen::Vector2d peak(x[0] * fall, I_ref);
    const Eigen::Matrix2d off = exponential(A, T - t_on);
    Solved s;
    s.x = rest + off * (peak - rest);
    // the end moves with the peak, and with the time that is left
    Eigen::Matrix2d to_peak;
    to_peak << fall, peak[0] / (R * C) * L / E, 0, 0;
    const Eigen::RowVector2d dt_on(0, -L / E);
    s.slope = off * to_peak - A * off * (peak - rest) * dt_on;
    return s;
}
/// Its exponents, largest first, of the fixed point that attracts.
std::array<double, 2> exponents_of(double I_ref, Eigen::Vector2d& x) {
    x = {13.8, 0.75};
    for (int k = 0; k <= 2000; ++k) // slowly up from 1 A, so that it stays near
        x = period_of(x, 1 + (I_ref - 1) * std::min(k / 1000.0, 1.0)).x;
    const Eigen::Vector2cd mu = period_of(x, I_ref).slope.eigenvalues();
    const double a = std::log(std::abs(mu[0])) / Boost::T, b = std::log(std::abs(mu[1])) / Boost::T;
    return {std::max(a, b), std::min(a, b)};
}

template <int Latched>
Lyapunov exponents(double I_ref, const Vector& x, LyapunovSettings settings) {
    const auto system = any_system(ClockedBoost<Latched>{});
    return lyapunov(*system, Vector::Constant(1, I_ref), x, settings);
}
Vector state(double v, double i, double q, double tau) { return Eigen::Vector4d(v, i, q, tau); }

// --- any linear fields, with a clock and a latch
// --------------------------------------------------

/// x' = A x + b, y = x0 + x1: from its clock until y meets `peak`, or to the next clock, A = A1,
/// and A = A2 then. The clock, and the peak, take x to B x + c of their own.
struct Clocked {
    static constexpr int dim = 5;
    static constexpr int surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::jump, SurfaceKind::jump};
    static constexpr std::array<std::string_view, 1> params{"peak"};
    static constexpr std::array<double, 1> defaults{1};
    static constexpr double T = 0.7;

    std::array<Eigen::Matrix3d, 2> A, B;
    std::array<Eigen::Vector3d, 2> b, c;

    template <Scalar S>
    static Vec<S, 3> affine(const Eigen::Matrix3d& A, const Eigen::Vector3d& b,
                            const Vec<S, 5>& x) {
        Vec<S, 3> y;
        for (int i = 0; i < 3; ++i)
            y[i] = S(b[i]) + S(A(i, 0)) * x[0] + S(A(i, 1)) * x[1] + S(A(i, 2)) * x[2];
        return y;
    }
    template <Scalar S>
    Vec<S, 5> field(const S&, const Vec<S, 5>& x, const Vec<S, 2>&, const Vec<S, 1>&) const {
        const Vec<S, 3> on = affine(A[0], b[0], x), off = affine(A[1], b[1], x);
        Vec<S, 5> f;
        for (int i = 0; i < 3; ++i)
            f[i] = x[3] * on[i] + (S(1) - x[3]) * off[i];
        f[3] = S(0);
        f[4] = S(3); // a clock in units of its own
        return f;
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 5>& x, const Vec<S, 1>& p) const {
        return {S(3 * T) - x[4], p[0] - x[0] - x[1] + S(50) * (S(1) - x[3])};
    }
    template <Scalar S>
    Vec<S, 5> jump(int j, const S&, const Vec<S, 5>& x, const Vec<S, 1>&) const {
        const Vec<S, 3> y = affine(B[std::size_t(j)], c[std::size_t(j)], x);
        return {y[0], y[1], y[2], S(j == 0 ? 1 : 0), j == 0 ? S(x[4] - S(3 * T)) : x[4]};
    }
    template <Scalar S> S period(const Vec<S, 1>&) const { return S(T); }
};
Clocked random_system(std::mt19937_64& random, bool lossy) {
    std::uniform_real_distribution<double> u(-1, 1);
    const auto matrix = [&] {
        return Eigen::Matrix3d::NullaryExpr([&] { return u(random); }).eval();
    };
    Clocked s;
    for (int k = 0; k < 2; ++k) {
        s.A[std::size_t(k)] = matrix() - 1.5 * Eigen::Matrix3d::Identity();
        s.b[std::size_t(k)] = Eigen::Vector3d(u(random), u(random), u(random));
        s.B[std::size_t(k)] = Eigen::Matrix3d::Identity() + 0.2 * matrix();
        s.c[std::size_t(k)] = 0.2 * Eigen::Vector3d(u(random), u(random), u(random));
    }
    s.b[0] += Eigen::Vector3d(3, 3, 0); // it rises while it is on, and falls from the peak
    s.c[1] -= Eigen::Vector3d(0.5, 0.5, 0);
    if (lossy)
        s.B[0].row(2).setZero();
    return s;
}

} // namespace

TEST_CASE("discrete: components of constant rate are those of the formulas", "[discrete]") {
    const auto boost = any_system(Boost{});
    const std::vector<Vector> at{state(12, 0.5, 1, 0), state(3, 1, 0, 0.05)};
    CHECK(detail::constant_components(*boost, 0, at, boost->defaults()) == std::vector{2, 3});
    const auto ball = any_system(models::BouncingBall{});
    CHECK(detail::constant_components(*ball, 0, {Eigen::Vector2d(1, 0)}, ball->defaults()) ==
          std::vector{1});
    const auto belt = any_system(models::ImpactBelt{});
    CHECK(detail::constant_components(*belt, 0, {Eigen::Vector2d(1, 0)}, belt->defaults()).empty());
}

TEST_CASE("discrete: a row that is no unit vector is no clock's", "[discrete]") {
    Matrix M(5, 5);
    M << 0.5, 0.1, 3, 4, 5, // depends on all
        0, 0, 0, -1, 0,     // turned round, from 3
        0, 0, 0, 0, 0,      // set
        0, 1, 0, 0, 0,      // from 1
        0, 0, 1, 0, 1;      // a sum
    const DiscretePart part = discrete_part(M, {1, 2, 3, 4});
    CHECK(part.discrete == std::vector{1, 2, 3});
    CHECK(part.rest == std::vector{0, 4});
    CHECK(part.from == std::vector{2, -1, 0});
    CHECK(part.sign == std::vector{-1, 1, 1});
    CHECK(part.neutral() == std::vector{true, false, true});
    // of M on 1 and 3: +-i
    auto mu = part.multipliers();
    REQUIRE(mu.size() == 3);
    std::sort(mu.begin(), mu.end(), [](auto a, auto b) { return a.imag() < b.imag(); });
    CHECK(std::abs(mu[0] - std::complex<double>(0, -1)) < 1e-15);
    CHECK(mu[1] == 0.0);
    CHECK(std::abs(mu[2] - std::complex<double>(0, 1)) < 1e-15);
    // what takes from what is none is none
    M(1, 3) = 0.5;
    CHECK(discrete_part(M, {1, 2, 3, 4}).discrete == std::vector{2});
    CHECK(discrete_part(M, {}).rest == std::vector{0, 1, 2, 3, 4});
}

TEST_CASE("discrete: exponents of a converter are those of matrix exponentials", "[discrete]") {
    for (const double I_ref : {1.0, 1.2, 1.5, 1.6}) {
        Eigen::Vector2d x;
        const auto exact = exponents_of(I_ref, x);
        CAPTURE(I_ref, exact[0], exact[1]);
        // wherever in the period it starts, however long a stretch, whatever the latch's number is
        for (const double tau : {0.0, 0.013, 0.0999})
            for (const double stretch : {0.25, 1.0, 4.0}) {
                CAPTURE(tau, stretch);
                const LyapunovSettings settings{
                    .transient = 400, .window = 100, .stretch = stretch, .batches = 5};
                for (const Lyapunov& l :
                     {exponents<100>(I_ref, state(x[0], 0.5, 1, tau), settings),
                      exponents<3>(I_ref, state(x[0], 0.5, 1, tau), settings),
                      exponents<1'000'000>(I_ref, state(x[0], 0.5, 1, tau), settings)}) {
                    REQUIRE(l.status == Status::ok);
                    CHECK(l.exponents[0] == 0);
                    CHECK(l.error[0] == 0);
                    // derivatives err by some 1e-11 a period, which is a tenth of a unit of time
                    CHECK(l.exponents[1] == Approx(exact[0]).epsilon(1e-8));
                    CHECK(l.exponents[2] == Approx(exact[1]).epsilon(1e-8));
                    CHECK(l.exponents[3] == -inf);
                    CHECK(l.skipped == 0);
                }
            }
    }
}

TEST_CASE("discrete: a stretch costs as its length", "[discrete]") {
    const auto steps = [](double stretch) {
        const auto system = any_system(Boost{});
        const Lyapunov l = lyapunov(*system, system->defaults(), state(12, 0.5, 1, 0),
                                    {.transient = 50, .window = 50, .stretch = stretch});
        REQUIRE(l.status == Status::ok);
        const Counters c = system->counters();
        return c.steps + c.rejected;
    };
    const long long whole = steps(1);
    // a step at least for each stretch, and the start is found again
    CHECK(steps(0.1) < 6 * whole);
    CHECK(whole < 100 * 40); // a period has three arcs
}

TEST_CASE("discrete: exponents are the logarithms of the strobe map's multipliers", "[discrete]") {
    std::mt19937_64 random(11);
    int lost = 0, peaks = 0;
    for (int found = 0, tries = 0; found < 20; ++tries) {
        REQUIRE(tries < 200);
        const auto system = any_system(random_system(random, tries % 4 == 0));
        const Vector p = system->defaults();
        Vector x = Vector::Zero(5);
        x[3] = 1;
        x[4] = Clocked::T; // a third of a period
        // a fixed point, if the random numbers have one
        Mapped m = strobe(*system, 0, x, p);
        for (int k = 0; k < 400 && m.ok(); ++k) {
            x = m.x;
            m = strobe(*system, 0, x, p);
        }
        if (!m.ok() || m.singular || !((m.x - x).norm() < 1e-11))
            continue;
        ++found;
        CAPTURE(tries);
        const Matrix M = m.slope.topLeftCorner(5, 5);
        const Eigen::VectorXcd mu = M.eigenvalues();
        std::vector<double> exact;
        for (const auto& each : mu)
            exact.push_back(std::abs(each) > 1e-9 ? std::log(std::abs(each)) / Clocked::T : -inf);
        std::sort(exact.rbegin(), exact.rend());
        const Lyapunov l = lyapunov(*system, p, x, {.transient = 200, .window = 200});
        REQUIRE(l.status == Status::ok);
        CHECK(std::count(l.exponents.begin(), l.exponents.end(), 0.0) == 1);
        CHECK(l.exponents[4] == -inf); // the latch
        for (int i = 0; i < 5; ++i) {
            const double value = exact[std::size_t(i)];
            // a pair turns round, and its halves differ by what that does over the window
            const auto half_of_pair = [&](int k) {
                return k >= 0 && k < 5 && std::abs(exact[std::size_t(k)] - value) < 1e-9;
            };
            if (value == -inf) {
                CHECK(l.exponents[i] == -inf);
            } else if (half_of_pair(i + 1)) {
                CHECK(l.exponents[i] + l.exponents[i + 1] == Approx(2 * value).epsilon(1e-7));
                CHECK(std::abs(l.exponents[i] - value) < 4 * l.error[i] + 1e-6);
            } else if (!half_of_pair(i - 1)) {
                // before the window the frame turned into its directions for 100 periods
                double gap = inf;
                for (int k = 0; k < 5; ++k)
                    if (k != i && exact[std::size_t(k)] != -inf)
                        gap = std::min(gap, std::abs(exact[std::size_t(k)] - value));
                CHECK(l.exponents[i] ==
                      Approx(value).epsilon(1e-7).margin(1e-8 + std::exp(-100 * Clocked::T * gap)));
            }
        }
        lost += l.exponents[3] == -inf;
        const auto events = system->run(0, x, Clocked::T, p).events;
        peaks += std::any_of(events.begin(), events.end(), [](const Happening& e) {
            return e.kind == EventKind::jump && e.surface == 1;
        });
    }
    // there are those with a direction that the clock ends, and those that meet their peak
    CHECK(lost >= 3);
    CHECK(peaks >= 5);
}

TEST_CASE("discrete: a strobe that flashes as the clock jumps sees what comes after",
          "[discrete]") {
    std::mt19937_64 random(5);
    int compared = 0;
    for (int tries = 0; tries < 20; ++tries) {
        const auto system = any_system(random_system(random, false));
        const Vector p = system->defaults();
        Vector x = Vector::Zero(5);
        x[3] = 1;
        for (int k = 0; k < 20; ++k) {
            const Mapped m = strobe(*system, 0, x, p);
            if (!m.ok())
                break;
            CAPTURE(tries, k);
            CHECK(m.x[3] == 1);
            CHECK(std::abs(m.x[4]) < 1e-9); // of a clock that moves by 2.1
            CHECK(m.slope.row(3).cwiseAbs().maxCoeff() == 0);
            if (k == 10 && !m.singular) { // right after the jump the map is continuous
                const Vector y = system->run(0, x, 1e-7, p).x;
                const Mapped later = strobe(*system, 0, y, p);
                CHECK((later.x - m.x).norm() < 1e-5);
                CHECK((later.slope - m.slope).norm() < 1e-4 * m.slope.norm());
                ++compared;
            }
            x = m.x;
        }
    }
    CHECK(compared >= 10);
}
