// SPDX-License-Identifier: BSD-3-Clause
// The stiff method by itself: its orders, its stability, its interpolant.
#include "catch.hpp"

#include <filippov/methods/rodas5p.hpp>

#include <cmath>
#include <vector>

using namespace filippov;

namespace {

/// x' = lambda (x - g(t)) + g'(t), g = sin: its solution from sin(0) is sin(t), however stiff.
/// @source Prothero & Robinson (1974), Math. Comp. 28, 145-162
struct ProtheroRobinson {
    double lambda;
    static constexpr double start = 0.0;

    Vec<double, 1> field(double t, const Vec<double, 1>& x) const {
        return Vec<double, 1>(lambda * (x[0] - std::sin(t)) + std::cos(t));
    }
    Vec<double, 1> operator()(std::size_t, double t, const Vec<double, 1>& x) const {
        return field(t, x);
    }
    Slopes<double, 1> slopes(double t, const Vec<double, 1>&) const {
        Slopes<double, 1> s;
        s.by_x(0, 0) = lambda;
        s.by_t[0] = -lambda * std::cos(t) - std::sin(t);
        return s;
    }
    double exact(double t) const { return std::sin(t); }
};

/// x' = x^2 cos t, x(0) = 1/2: x = 1/(2 - sin t). Its Jacobian changes along the way.
struct Nonlinear {
    static constexpr double start = 0.5;

    Vec<double, 1> field(double t, const Vec<double, 1>& x) const {
        return Vec<double, 1>(x[0] * x[0] * std::cos(t));
    }
    Slopes<double, 1> slopes(double t, const Vec<double, 1>& x) const {
        Slopes<double, 1> s;
        s.by_x(0, 0) = 2 * x[0] * std::cos(t);
        s.by_t[0] = -x[0] * x[0] * std::sin(t);
        return s;
    }
    double exact(double t) const { return 1 / (2 - std::sin(t)); }
};

struct Errors {
    double end = 0, inside = 0;
};

/// The largest errors of n equal steps over [0, 2]: at their ends, and inside, where the
/// interpolant says.
template <class Rhs> Errors errors(const Rhs& rhs, int n) {
    Rosenbrock<Rodas5P, double, 1> method;
    const double dt = 2.0 / n;
    Vec<double, 1> x(Rhs::start), x1;
    method.begin(rhs.field(0.0, x));
    Errors e;
    for (int k = 0; k < n; ++k) {
        const double t = k * dt;
        method.step(rhs, t, x, dt, x1);
        const auto p = method.interpolant(rhs, t, x, dt, x1);
        for (const double theta : {0.2, 0.5, 0.8})
            e.inside = std::max(e.inside, std::abs(p(theta)[0] - rhs.exact(t + theta * dt)));
        CHECK(p(0.0) == x);
        CHECK(p(1.0) == x1);
        x = x1;
        method.go_on();
        e.end = std::max(e.end, std::abs(x[0] - rhs.exact(t + dt)));
    }
    return e;
}

/// Slope of log error against log step, over a ladder of eight.
template <class Rhs> Errors slopes(const Rhs& rhs, int n0) {
    double n = 0, sx = 0, sxx = 0;
    Errors sy, sxy;
    for (int k = 0; k < 8; ++k) {
        const int steps = int(n0 * std::pow(1.25, k));
        const Errors e = errors(rhs, steps);
        const double x = -std::log(steps), y = std::log(e.end), z = std::log(e.inside);
        n += 1, sx += x, sxx += x * x;
        sy.end += y, sxy.end += x * y;
        sy.inside += z, sxy.inside += x * z;
    }
    const double below = n * sxx - sx * sx;
    return {(n * sxy.end - sx * sy.end) / below, (n * sxy.inside - sx * sy.inside) / below};
}

} // namespace

TEST_CASE("rosenbrock: Rodas5P has order 5, and its interpolant order 4", "[rosenbrock]") {
    const Errors order = slopes(Nonlinear{}, 8);
    INFO("slopes " << order.end << " and " << order.inside);
    CHECK(order.end > 4.7);
    CHECK(order.inside > 3.7);
}

TEST_CASE("rosenbrock: Rodas5P keeps order 4 where the problem is stiff", "[rosenbrock]") {
    // Along the steps. At their ends the error is smaller by lambda dt: with that factor it has
    // order 4, too, and without it the slope is one less.
    const double lambda = GENERATE(-1e4, -1e6, -1e8);
    const ProtheroRobinson rhs{lambda};
    const Errors order = slopes(rhs, 5);
    INFO("lambda " << lambda << ": slopes " << order.end << " and " << order.inside);
    CHECK(order.inside > 3.7);
    CHECK(order.end > 2.7);
    const Errors e = errors(rhs, 10);
    INFO("errors " << e.end << " and " << e.inside);
    CHECK(e.end < 100 * e.inside / (-lambda * 0.2));
}

TEST_CASE("rosenbrock: Rodas5P is L-stable", "[rosenbrock]") {
    // x' = lambda x in one step: x1/x0 is the stability function, |R| <= 1 on the axis and 0 at its
    // end. The complex plane's left half: x' = a x - b y, y' = b x + a y.
    struct Plane {
        double a, b;
        Vec<double, 2> field(double, const Vec<double, 2>& x) const {
            return {a * x[0] - b * x[1], b * x[0] + a * x[1]};
        }
        Slopes<double, 2> slopes(double, const Vec<double, 2>&) const {
            Slopes<double, 2> s;
            s.by_x << a, -b, b, a;
            s.by_t.setZero();
            return s;
        }
    };
    const auto growth = [](double a, double b) {
        const Plane rhs{a, b};
        Rosenbrock<Rodas5P, double, 2> method;
        const Vec<double, 2> x(1, 0);
        Vec<double, 2> x1;
        method.begin(rhs.field(0, x));
        method.step(rhs, 0.0, x, 1.0, x1);
        return x1.norm();
    };
    for (double r = 0.01; r < 1e6; r *= 1.3)
        for (double angle = 90; angle <= 180; angle += 2.5) {
            const double radians = angle / 180 * 3.14159265358979324;
            INFO("z = " << r << " exp(i " << angle << " degrees)");
            // on the imaginary axis cos(90 degrees) is rounding
            CHECK(growth(r * std::min(std::cos(radians), 0.0), r * std::sin(radians)) <= 1 + 1e-12);
        }
    CHECK(growth(-1e12, 0) < 1e-10);
}

TEMPLATE_TEST_CASE("rosenbrock: steps in every precision", "[rosenbrock]", float, double,
                   long double) {
    using S = TestType;
    struct Decay {
        Vec<S, 1> field(const S&, const Vec<S, 1>& x) const { return Vec<S, 1>(-x[0]); }
        Slopes<S, 1> slopes(const S&, const Vec<S, 1>&) const {
            Slopes<S, 1> s;
            s.by_x(0, 0) = S(-1);
            s.by_t[0] = S(0);
            return s;
        }
    } rhs;
    Rosenbrock<Rodas5P, S, 1> method;
    const Vec<S, 1> x(S(1));
    Vec<S, 1> x1;
    method.begin(rhs.field(S(0), x));
    method.step(rhs, S(0), x, S(0.01), x1);
    // the coefficients have 16 digits
    CHECK_THAT(double(x1[0]),
               Catch::Matchers::WithinAbs(std::exp(-0.01), std::same_as<S, float> ? 1e-7 : 1e-14));
}

namespace {

/// A stiff rotation x' = A x, with one component in units of `unit`.
struct Rotation {
    double unit;
    Vec<double, 2> field(double, const Vec<double, 2>& x) const {
        return {-x[0] - 1e3 * (x[1] / unit), unit * (1e3 * x[0]) - 2 * x[1]};
    }
    Slopes<double, 2> slopes(double, const Vec<double, 2>&) const {
        Slopes<double, 2> s;
        s.by_x << -1, -1e3 / unit, 1e3 * unit, -2;
        s.by_t.setZero();
        s.size << 1, unit;
        return s;
    }
};

} // namespace

TEST_CASE("rosenbrock: a step of no length stays", "[rosenbrock]") {
    // a landing may ask for one; 1/dt is infinite below the smallest normal number, too
    for (const double dt : {0.0, 4e-320, -1e-310}) {
        Rotation rhs{1};
        Rosenbrock<Rodas5P, double, 2> method;
        const Vec<double, 2> x(1, 0.5);
        Vec<double, 2> x1;
        method.begin(rhs.field(0, x));
        method.step(rhs, 0.0, x, dt, x1);
        CHECK(x1 == x);
        CHECK(method.mean_square_error(Vec<double, 2>(1e8, 1e8)) == 0);
        CHECK(method.sum_of_stages().allFinite());
        const auto path = method.interpolant(rhs, 0.0, x, dt, x1);
        CHECK(path(0.5) == x);
        method.go_on();
        method.step(rhs, 0.0, x, 1e-3, x1);
        CHECK(x1.allFinite());
    }
}

TEST_CASE("H20, rosenbrock: a step is the same to the bit in any units", "[rosenbrock]") {
    const auto step = [](double unit) {
        Rotation rhs{unit};
        Rosenbrock<Rodas5P, double, 2> method;
        const Vec<double, 2> x(1, 0.5 * unit);
        Vec<double, 2> x1;
        method.begin(rhs.field(0, x));
        method.step(rhs, 0.0, x, 1e-3, x1);
        return Vec<double, 2>(x1[0], x1[1] / unit);
    };
    for (const int power : {-40, -3, 17, 60})
        CHECK(step(std::ldexp(1.0, power)) == step(1));
}
