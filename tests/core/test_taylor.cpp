// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/models/belt.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/unit_circle.hpp>
#include <filippov/system/derivatives.hpp>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

using namespace filippov;

namespace {

constexpr int K = 6;
using T = Taylor<double, K>;

/// Coefficients agree to a few roundings of the largest.
template <class S, int N>
void check_series(const Taylor<S, N>& a, std::initializer_list<double> expected) {
    double size = 0;
    for (const double e : expected)
        size = std::max(size, std::abs(e));
    std::size_t k = 0;
    for (const double e : expected) {
        CAPTURE(k);
        CHECK(a.c[k] == Approx(e).epsilon(0).margin(16 * epsilon<double> * size));
        ++k;
    }
    CHECK(k == a.c.size());
}

/// How many powers of tau the series of f(0.4 + tau - tau^2/2) misses: log2 of the remainder's
/// ratio at tau and tau/2.
template <class F> double missing_power(F f) {
    using L = Taylor<long double, K>;
    L a(0.4L);
    a.c[1] = 1;
    a.c[2] = -0.5L;
    const L series = f(a);
    const auto remainder = [&](long double tau) {
        long double sum = 0;
        for (std::size_t k = K + 1; k-- > 0;)
            sum = sum * tau + series.c[k];
        return std::abs(sum - f(0.4L + tau - tau * tau / 2));
    };
    return std::log2(static_cast<double>(remainder(0.008L) / remainder(0.004L)));
}

} // namespace

TEST_CASE("taylor: arithmetic is that of polynomials modulo tau^(K+1)", "[taylor]") {
    const T x = T::variable(2);
    check_series(x, {2, 1, 0, 0, 0, 0, 0});
    check_series(x + x * x, {6, 5, 1, 0, 0, 0, 0});
    check_series(T(3) - x, {1, -1, 0, 0, 0, 0, 0});
    check_series(-x, {-2, -1, 0, 0, 0, 0, 0});
    check_series(+x, {2, 1, 0, 0, 0, 0, 0});
    check_series(x * x * x * x * x * x * x,
                 {128, 448, 672, 560, 280, 84, 14}); // (2 + tau)^7 without its last term
    check_series(T(1) / x, {0.5, -0.25, 0.125, -0.0625, 0.03125, -0.015625, 0.0078125});
    check_series((x * x - T(1)) / (x - T(1)), {3, 1, 0, 0, 0, 0, 0});
    T y = x;
    y += x;
    y *= x;
    y -= T(3);
    y /= T(2);
    check_series(y, {2.5, 4, 1, 0, 0, 0, 0});       // x^2 - 3/2
    check_series(2 * x + 1, {5, 2, 0, 0, 0, 0, 0}); // with plain numbers
}

TEST_CASE("taylor: elementary functions have their known series", "[taylor]") {
    const T zero = T::variable(0), one = T::variable(1);
    check_series(exp(zero), {1, 1, 1 / 2.0, 1 / 6.0, 1 / 24.0, 1 / 120.0, 1 / 720.0});
    check_series(log(one), {0, 1, -1 / 2.0, 1 / 3.0, -1 / 4.0, 1 / 5.0, -1 / 6.0});
    check_series(sin(zero), {0, 1, 0, -1 / 6.0, 0, 1 / 120.0, 0});
    check_series(cos(zero), {1, 0, -1 / 2.0, 0, 1 / 24.0, 0, -1 / 720.0});
    check_series(tan(zero), {0, 1, 0, 1 / 3.0, 0, 2 / 15.0, 0});
    check_series(atan(zero), {0, 1, 0, -1 / 3.0, 0, 1 / 5.0, 0});
    check_series(asin(zero), {0, 1, 0, 1 / 6.0, 0, 3 / 40.0, 0});
    check_series(sinh(zero), {0, 1, 0, 1 / 6.0, 0, 1 / 120.0, 0});
    check_series(cosh(zero), {1, 0, 1 / 2.0, 0, 1 / 24.0, 0, 1 / 720.0});
    check_series(tanh(zero), {0, 1, 0, -1 / 3.0, 0, 2 / 15.0, 0});
    check_series(sqrt(one), {1, 1 / 2.0, -1 / 8.0, 1 / 16.0, -5 / 128.0, 7 / 256.0, -21 / 1024.0});
    check_series(pow(one, T(-1.5)),
                 {1, -3 / 2.0, 15 / 8.0, -35 / 16.0, 315 / 128.0, -693 / 256.0, 3003 / 1024.0});
    check_series(pow(one, -2), {1, -2, 3, -4, 5, -6, 7});
    check_series(pow(zero, 3),
                 {0, 0, 0, 1, 0, 0, 0}); // exact at zero, where a logarithm would not be
    check_series(pow(zero, 0), {1, 0, 0, 0, 0, 0, 0});
    check_series(abs(T::variable(-2)), {2, -1, 0, 0, 0, 0, 0});
    check_series(abs(T::variable(2)), {2, 1, 0, 0, 0, 0, 0});
}

TEST_CASE("taylor: a power of what is zero has the derivatives that it has", "[taylor]") {
    using T = Taylor<double, 4>;
    const T x = T::variable(0), a = T(2) * x + x * x;
    constexpr double none = std::numeric_limits<double>::infinity();
    const auto coefficients = [](const T& series) {
        return std::vector<double>(series.c.begin(), series.c.end());
    };
    using V = std::vector<double>;
    CHECK(coefficients(pow(a, T(2))) == V{0, 0, 4, 4, 1}); // (2x + x^2)^2
    CHECK(coefficients(pow(a, T(3))) == V{0, 0, 0, 8, 12});
    CHECK(coefficients(pow(a, T(1))) == V{0, 2, 1, 0, 0});
    CHECK(coefficients(pow(a, T(0))) == V{1, 0, 0, 0, 0});
    CHECK(pow(a, T(2.5)).c[2] == 0);
    CHECK(pow(a, T(2.5)).c[3] == none);
    CHECK(pow(a, T(0.5)).c[0] == 0);
    CHECK(pow(a, T(0.5)).c[1] == none);
    CHECK(pow(T(0) * x, T(0.5)).c[1] == 0); // it stays zero
    // series of series: x^2.5 y at x = 0
    using Q = Taylor<Taylor<double, 1>, 1>;
    const Q both = pow(Q::variable(Taylor<double, 1>::variable(0)), Q(2.5));
    CHECK(both.c[0].c[1] == 0);
    CHECK(both.c[1].c[0] == 0);
    CHECK(both.c[1].c[1] == 0);
}

TEST_CASE("taylor: what stays zero has a root that does, what leaves zero has an infinite slope",
          "[taylor]") {
    using T = Taylor<double, 2>;
    const T root = sqrt(T(0));
    CHECK(root.c == std::array<double, 3>{0, 0, 0});
    CHECK(std::isinf(sqrt(T::variable(0)).c[1]));
    Taylor<Taylor<double, 1>, 1> nested(Taylor<double, 1>(0));
    CHECK(sqrt(nested).c[1].c[1] == 0);
}

TEST_CASE("taylor: compositions miss the function by tau^7 and no less", "[taylor]") {
    using std::asin, std::atan, std::cos, std::cosh, std::exp, std::log, std::pow, std::sin,
        std::sinh, std::sqrt, std::tan, std::tanh;
    // 0.3: the next power of tau, at tau = 0.008
    const double order = K + 1;
    CHECK(std::abs(missing_power([](const auto& a) { return exp(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return log(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return sin(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return cos(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return tan(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return atan(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return asin(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return sinh(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return cosh(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return tanh(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return sqrt(a); }) - order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return decltype(a + a)(1) / a; }) - order) <
          0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return pow(a, decltype(a + a)(2.7L)); }) -
                   order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return decltype(a + a)(pow(a, -3)); }) -
                   order) < 0.3);
    CHECK(std::abs(missing_power([](const auto& a) { return exp(sin(a) * log(a)) / cos(a); }) -
                   order) < 0.3);
}

TEST_CASE("taylor: comparisons look at the value only", "[taylor]") {
    T a = T::variable(1), b(1);
    CHECK(a == b);
    CHECK(a <= b);
    CHECK(a >= b);
    CHECK_FALSE(a < b);
    CHECK_FALSE(a > b);
    CHECK(a < T(2));
    CHECK(T(2) > a);
    CHECK(value_of(a) == 1);
    CHECK(value_of(Taylor<T, 2>(a)) == 1);
    CHECK(value_of(0.5L) == 0.5L);
}

TEST_CASE("taylor: series of series hold mixed derivatives", "[taylor]") {
    using Inner = Taylor<double, 2>;
    using Outer = Taylor<Inner, 2>;
    const double x0 = 0.7, y0 = 1.3;
    const Outer x = Outer::variable(Inner(x0));
    const Outer y(Inner::variable(y0));
    const Outer f = exp(x * y) + sin(x) / y;
    const double e = std::exp(x0 * y0), s = std::sin(x0), c = std::cos(x0);
    // c[i].c[j] = d^(i+j) f / dx^i dy^j / (i! j!); margins of a few roundings of the largest, 5
    const auto is = [](double expected) { return Approx(expected).epsilon(0).margin(2e-14); };
    CHECK(f.c[0].c[0] == is(e + s / y0));
    CHECK(f.c[1].c[0] == is(y0 * e + c / y0));
    CHECK(f.c[0].c[1] == is(x0 * e - s / (y0 * y0)));
    CHECK(f.c[1].c[1] == is((1 + x0 * y0) * e - c / (y0 * y0)));
    CHECK(f.c[2].c[0] == is((y0 * y0 * e - s / y0) / 2));
    CHECK(f.c[0].c[2] == is((x0 * x0 * e + 2 * s / (y0 * y0 * y0)) / 2));
    CHECK(f.c[2].c[1] == is(((2 * y0 + x0 * y0 * y0) * e + s / (y0 * y0)) / 2));
    CHECK(f.c[1].c[2] == is(((2 * x0 + x0 * x0 * y0) * e + 2 * c / (y0 * y0 * y0)) / 2));
    const double d22 = (2 + 4 * x0 * y0 + x0 * x0 * y0 * y0) * e - 2 * s / (y0 * y0 * y0);
    CHECK(f.c[2].c[2] == is(d22 / 4));
}

TEST_CASE("derivatives: gradient, time derivative and normal component of a moving and of a curved "
          "surface",
          "[derivatives]") {
    const models::VaryingBelt belt;
    const auto p = default_params<models::VaryingBelt>();
    const Vec<double, 2> x(0.4, -1.1), f(2.0, 3.0);
    const double t = 0.9;
    CHECK(grad_h(belt, 0, t, x, p) == Vec<double, 2>(0, 1));
    CHECK(h_t(belt, 0, t, x, p) == Approx(std::sin(t)).epsilon(1e-15)); // h = v - cos t - V
    CHECK(normal_component(belt, 0, t, x, p, f) == Approx(std::sin(t) + 3).epsilon(1e-15));

    const models::UnitCircle circle;
    const auto q = default_params<models::UnitCircle>();
    CHECK((grad_h(circle, 0, t, x, q) - 2 * x).norm() < 1e-15);
    CHECK(h_t(circle, 0, t, x, q) == 0);
    CHECK(normal_component(circle, 0, t, x, q, f) == Approx(2 * x.dot(f)).epsilon(1e-15));

    // a model's own members say the same as the series
    const models::Oscillator oscillator;
    const auto r = default_params<models::Oscillator>();
    const auto h = [&](const auto& tau, const auto& y) { return oscillator.h(tau, y, lift<1>(r)); };
    CHECK(directional(h, t, x, 1.0, f) == normal_component(oscillator, 0, t, x, r, f));
}

TEST_CASE("derivatives: Lie derivatives are the time derivatives along the solution",
          "[derivatives]") {
    const Vec<double, 0> none;
    SECTION("rotation: x, v, -x, -v") {
        const auto field = [](const auto&, const auto& x, const auto&) {
            return std::decay_t<decltype(x)>(x[1], -x[0]);
        };
        const auto observe = [](const auto&, const auto& x, const auto&) { return x[0]; };
        const auto d = lie_derivatives<4>(field, observe, 0.0, Vec<double, 2>(0.25, -1.5), none);
        CHECK(d == std::array<double, 4>{-1.5, -0.25, 1.5, 0.25});
    }
    SECTION("time counts: x' = t^2 + x, observed x t") {
        const auto field = [](const auto& t, const auto& x, const auto&) {
            return std::decay_t<decltype(x)>(t * t + x[0]);
        };
        const auto observe = [](const auto& t, const auto& x, const auto&) { return x[0] * t; };
        const double t = 0.5, x = 0.75, x1 = t * t + x, x2 = 2 * t + x1, x3 = 2 + x2;
        const auto d = lie_derivatives<3>(field, observe, t, Vec<double, 1>(x), none);
        CHECK(d[0] == Approx(x1 * t + x).epsilon(1e-15));
        CHECK(d[1] == Approx(x2 * t + 2 * x1).epsilon(1e-15));
        CHECK(d[2] == Approx(x3 * t + 3 * x2).epsilon(1e-15));
    }
    SECTION("blow-up: x' = x^2, so the k-th derivative is k! x^(k+1)") {
        const auto field = [](const auto&, const auto& x, const auto&) {
            return std::decay_t<decltype(x)>(x[0] * x[0]);
        };
        const auto observe = [](const auto&, const auto& x, const auto&) { return x[0]; };
        const auto d = lie_derivatives<5>(field, observe, 0.0, Vec<double, 1>(1.5), none);
        double factorial = 1;
        for (int k = 1; k <= 5; ++k) {
            factorial *= k;
            CHECK(d[std::size_t(k - 1)] == Approx(factorial * std::pow(1.5, k + 1)).epsilon(1e-14));
        }
    }
    SECTION("the oscillator on its belt: L1 = q + m g mu(0), and its derivative along F1") {
        const models::Oscillator sys;
        const auto p = default_params<models::Oscillator>();
        const double t = 1.1, y = 0.8, A = p[0], omega = p[1];
        const auto field = [&](const auto& tau, const auto& x, const auto& q) {
            return sys.f1(tau, x, q);
        };
        const auto h = [&](const auto& tau, const auto& x, const auto& q) {
            return sys.h(tau, x, q);
        };
        const auto d = lie_derivatives<2>(field, h, t, Vec<double, 2>(y, 1), p);
        const double L1 = -y + A * std::cos(omega * t) + 4;
        CHECK(d[0] == Approx(L1).epsilon(1e-14));
        // q' = -v - A omega sin(omega t), and g mu'(0) (-v'), mu'(0) = -alpha gamma
        CHECK(d[1] ==
              Approx(-1 - A * omega * std::sin(omega * t) + 10 * 0.3 * 1.42 * L1).epsilon(1e-14));
    }
}

TEST_CASE("derivatives: the Jacobian of a field is the analytic one", "[derivatives]") {
    const auto field = [](const auto& t, const auto& x, const auto& p) {
        return std::decay_t<decltype(x)>(x[0] * x[1] + t, sin(x[1]) * x[2] + p[0] * x[0],
                                         exp(x[0] - x[2]));
    };
    const Vec<double, 3> x(0.3, -0.8, 1.2);
    const auto J = jacobian(field, 0.5, x, Vec<double, 1>(2.5));
    Mat<double, 3, 3> expected;
    const double e = std::exp(x[0] - x[2]);
    expected << x[1], x[0], 0, 2.5, std::cos(x[1]) * x[2], std::sin(x[1]), e, 0, -e;
    CHECK((J - expected).cwiseAbs().maxCoeff() < 1e-15);
}
