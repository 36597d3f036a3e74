// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/methods/dormand_prince5.hpp>
#include <filippov/methods/dormand_prince8.hpp>

#include <cmath>
#include <vector>

using namespace filippov;

namespace {

using R = long double;

/// Rounding of a sum of products of thirty-digit coefficients, `size` the sum of their absolute
/// values.
R rounding(R size) { return 16 * epsilon<R> * (1 + size); }

/// x' = x (1 - r^2) - t y, y' = y (1 - r^2) + t x: a limit cycle run through ever faster, with a
/// closed form.
template <class S> Vec<S, 2> field(const S& t, const Vec<S, 2>& x) {
    const S growth = S(1) - x[0] * x[0] - x[1] * x[1];
    return {x[0] * growth - t * x[1], x[1] * growth + t * x[0]};
}
template <class S> Vec<S, 2> solution(const S& t) {
    const S r = S(1) / std::sqrt(S(1) + S(3) * std::exp(S(-2) * t)),
            angle = t * t / S(2); // r(0) = 1/2
    return {r * std::cos(angle), r * std::sin(angle)};
}

template <class S> double slope(const std::vector<S>& steps, const std::vector<S>& errors) {
    const auto log = [](const S& v) { return std::log(static_cast<double>(v)); };
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const double x = log(steps[i]), y = log(errors[i]);
        n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// Steps h_k = largest / 1.25^k, as numbers of equal steps to t = 2.
constexpr int n_steps_5[] = {20, 25, 31, 39, 49, 61, 76, 95, 119};
constexpr int n_steps_8[] = {8, 9, 10, 12, 14, 17, 20, 24, 28};

template <class Tableau, class S> double order_of_state() {
    const auto& counts = Tableau::order == 5 ? n_steps_5 : n_steps_8;
    const auto rhs = [](std::size_t, const S& t, const Vec<S, 2>& x) { return field(t, x); };
    std::vector<S> steps, errors;
    for (const int n : counts) {
        const S dt = S(2) / S(n);
        RungeKutta<Tableau, S, 2> rk;
        Vec<S, 2> x = solution(S(0)), next;
        rk.k[0] = field(S(0), x);
        for (int k = 0; k < n; ++k) {
            rk.step(rhs, S(S(k) * dt), x, dt, next);
            x = next;
            rk.k[0] = rk.k.at(rk.last);
        }
        steps.push_back(dt);
        errors.push_back((x - solution(S(2))).cwiseAbs().maxCoeff());
    }
    return slope(steps, errors);
}

/// Orders, in the length of one step from exact data, of: the interpolant, the error estimate.
template <class Tableau> std::array<double, 2> order_of_step() {
    std::vector<R> steps, dense, estimate;
    auto rhs = [](std::size_t, const R& t, const Vec<R, 2>& x) { return field(t, x); };
    const R t0 = 0.5L;
    for (R dt = Tableau::order == 5 ? 0.08L : 0.2L; steps.size() < 9; dt /= 1.25L) {
        RungeKutta<Tableau, R, 2> rk;
        const Vec<R, 2> x0 = solution(t0);
        Vec<R, 2> x1;
        rk.k[0] = field(t0, x0);
        rk.step(rhs, t0, x0, dt, x1);
        const Vec<R, 2> weight(dt, dt);
        estimate.push_back(std::sqrt(Tableau::squared_error(rk, weight)));
        const auto p = rk.interpolant(rhs, t0, x0, dt, x1);
        R worst = 0;
        for (int k = 1; k < 40; ++k) {
            const R theta = R(k) / 40;
            worst =
                std::max(worst, (p(theta) - solution(R(t0 + theta * dt))).cwiseAbs().maxCoeff());
        }
        steps.push_back(dt);
        dense.push_back(worst);
    }
    return {slope(steps, dense), slope(steps, estimate)};
}

} // namespace

TEMPLATE_TEST_CASE("runge_kutta: rows of the tableau sum to the nodes", "[runge_kutta]",
                   DormandPrince5, DormandPrince8) {
    constexpr int n = TestType::stages + TestType::extra_stages;
    for (int i = 1; i < n; ++i) {
        R sum = 0, size = 0;
        for (int j = 0; j < i; ++j)
            sum += TestType::a[i][j], size += std::abs(TestType::a[i][j]);
        CAPTURE(i);
        CHECK(std::abs(sum - TestType::c[i]) <= rounding(size));
        for (int j = i; j < n; ++j)
            CHECK(TestType::a[i][j] == 0); // explicit
    }
    CHECK(TestType::c[TestType::stages - 1] == 1); // the last stage is the first of the next step
}

TEMPLATE_TEST_CASE("runge_kutta: order conditions hold up to the order and not beyond",
                   "[runge_kutta]", DormandPrince5, DormandPrince8) {
    constexpr int s = TestType::stages - 1, p = TestType::order;
    const auto& b = TestType::a[s];
    const auto& c = TestType::c;
    const auto sum = [&](auto term) {
        R value = 0, size = 0;
        for (int i = 0; i < s; ++i)
            value += b[i] * term(i), size += std::abs(b[i]);
        return std::pair(value, rounding(4 * size));
    };
    const auto inner = [&](int i, int power) {
        R value = 0;
        for (int j = 0; j < i; ++j)
            value += TestType::a[i][j] * std::pow(c[j], power);
        return value;
    };
    for (int k = 1; k <= p; ++k) { // bushy trees: sum b c^(k-1) = 1/k
        const auto [value, margin] = sum([&](int i) { return std::pow(c[i], k - 1); });
        CAPTURE(k);
        CHECK(std::abs(value - 1 / R(k)) <= margin);
    }
    CHECK(std::abs(sum([&](int i) { return std::pow(c[i], p); }).first - 1 / R(p + 1)) > 1e-9L);
    for (int q = 1; q <= p - 2; ++q)
        for (int k = 0; k + q + 2 <= p;
             ++k) { // one branching: sum b c^k a c^q = 1/((q + 1)(k + q + 2))
            const auto [value, margin] =
                sum([&](int i) { return std::pow(c[i], k) * inner(i, q); });
            CAPTURE(k, q);
            // a of the 8th-order pair has entries up to 43
            CHECK(std::abs(value - 1 / R((q + 1) * (k + q + 2))) <= 100 * margin);
        }
    // the tall tree of linear problems: b a^(p-1) 1 = 1/p!
    std::vector<R> v(s, 1);
    R factorial = 1;
    for (int k = 1; k <= p; ++k) {
        factorial *= k;
        const auto [value, margin] = sum([&](int i) { return v[std::size_t(i)]; });
        CHECK(std::abs(value - 1 / factorial) <= 100 * margin);
        std::vector<R> next(s, 0);
        for (int i = 0; i < s; ++i)
            for (int j = 0; j < i; ++j)
                next[std::size_t(i)] += TestType::a[i][j] * v[std::size_t(j)];
        v = next;
    }
}

TEST_CASE("runge_kutta: error weights vanish on polynomials of the embedded order and not beyond",
          "[runge_kutta]") {
    const auto moment = [](const auto& e, const auto& c, int n, int power) {
        R sum = 0;
        for (int j = 0; j < n; ++j)
            sum += e[std::size_t(j)] * std::pow(c[j], power);
        return std::abs(sum);
    };
    const R zero = rounding(10);
    for (int k = 0; k < 4; ++k)
        CHECK(moment(DormandPrince5::e, DormandPrince5::c, 7, k) <= zero);
    CHECK(moment(DormandPrince5::e, DormandPrince5::c, 7, 4) > 1e-4L);
    // printed to 28 digits
    for (int k = 0; k < 5; ++k)
        CHECK(moment(DormandPrince8::e5, DormandPrince8::c, 13, k) <= zero);
    CHECK(moment(DormandPrince8::e5, DormandPrince8::c, 13, 5) > 1e-4L);
    for (int k = 0; k < 3; ++k)
        CHECK(moment(DormandPrince8::e3, DormandPrince8::c, 13, k) <= zero);
    CHECK(moment(DormandPrince8::e3, DormandPrince8::c, 13, 3) > 1e-4L);
}

TEMPLATE_TEST_CASE("runge_kutta: steps converge with the order of the method", "[runge_kutta]",
                   DormandPrince5, DormandPrince8) {
    const double in_double = order_of_state<TestType, double>(),
                 in_long_double = order_of_state<TestType, R>();
    CAPTURE(in_double, in_long_double);
    // 0.3: the steps are not all in the asymptotic range
    CHECK(in_double >= TestType::order - 0.3);
    CHECK(in_long_double >= TestType::order - 0.3);
}

TEST_CASE(
    "runge_kutta: interpolants are of orders 4 and 7, and so are off by h^5 and h^8 in a step",
    "[runge_kutta]") {
    const double five = order_of_step<DormandPrince5>()[0],
                 eight = order_of_step<DormandPrince8>()[0];
    CAPTURE(five, eight);
    CHECK(std::abs(five - 5) < 0.3);
    CHECK(std::abs(eight - 8) < 0.3);
}

TEST_CASE("runge_kutta: error estimates shrink with h^5 and h^8", "[runge_kutta]") {
    // 8(5,3): h err5^2/sqrt(err5^2 + 0.01 err3^2) ~ h h^10/h^3
    const double five = order_of_step<DormandPrince5>()[1],
                 eight = order_of_step<DormandPrince8>()[1];
    CAPTURE(five, eight);
    CHECK(std::abs(five - 5) < 0.3);
    CHECK(std::abs(eight - 8) < 0.3);
}

TEMPLATE_TEST_CASE("runge_kutta: the interpolant meets values and slopes of both ends",
                   "[runge_kutta]", DormandPrince5, DormandPrince8) {
    auto rhs = [](std::size_t, const double& t, const Vec<double, 2>& x) { return field(t, x); };
    const double t0 = 0.5, dt = 0.13;
    RungeKutta<TestType, double, 2> rk;
    const Vec<double, 2> x0 = solution(t0);
    Vec<double, 2> x1;
    rk.k[0] = field(t0, x0);
    rk.step(rhs, t0, x0, dt, x1);
    const auto check = [&](const Vec<double, 2>& end) {
        const auto p = rk.interpolant(rhs, t0, x0, dt, end);
        const double d = 1e-6;
        const Vec<double, 2> first = rk.k[0], last = rk.k.at(rk.last);
        CHECK(p(0) == x0);
        CHECK((p(1) - end).cwiseAbs().maxCoeff() <=
              epsilon<double>); // x0 + (x1 - x0), two roundings
        // central differences: rounding 1e-16/d, and d^2
        CHECK(((p(d) - p(-d)) / (2 * d * dt) - first).cwiseAbs().maxCoeff() < 1e-8);
        CHECK(((p(1 + d) - p(1 - d)) / (2 * d * dt) - last).cwiseAbs().maxCoeff() < 1e-8);
    };
    check(x1);
    check(x1 + Vec<double, 2>(1e-9, -2e-9)); // as when a landing has put it on a surface
}

TEMPLATE_TEST_CASE("runge_kutta: a stage that is not finite is seen", "[runge_kutta]",
                   DormandPrince5, DormandPrince8) {
    const int bad = GENERATE(1, 2, 5);
    int stage = 0;
    auto rhs = [&](std::size_t, const double&, const Vec<double, 1>& x) {
        return Vec<double, 1>(++stage == bad ? std::nan("") : -x[0]);
    };
    RungeKutta<TestType, double, 1> rk;
    rk.k.fill(Vec<double, 1>(0));
    Vec<double, 1> x1;
    stage = -100;
    rk.step(rhs, 0, Vec<double, 1>(1), 0.1, x1);
    CHECK(all_finite<double, 1>(rk.sum_of_stages()));
    stage = 0;
    rk.step(rhs, 0, Vec<double, 1>(1), 0.1, x1);
    CHECK_FALSE(all_finite<double, 1>(rk.sum_of_stages()));
}
