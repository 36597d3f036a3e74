// SPDX-License-Identifier: BSD-3-Clause
// Boundaries of the sliding region, tangencies, equilibria.

#include "catch.hpp"
#include "systems.hpp"

#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/geometry.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

Vector point(std::initializer_list<double> values) {
    Vector x(Eigen::Index(values.size()));
    std::copy(values.begin(), values.end(), x.begin());
    return x;
}

/// x' = (y + d, c - x) below y = 0 and (e (1 - y), -1 - x) above: sliding, tangencies and
/// equilibria in closed form.
struct Rotor {
    static constexpr int dim = 2;
    [[maybe_unused]] static constexpr std::array<std::string_view, 2> state{"x", "y"};
    static constexpr std::array<std::string_view, 3> params{"c", "d", "e"};
    static constexpr std::array<double, 3> defaults{0.5, 0.25, -1};

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return {x[1] + p[1], p[0] - x[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return {p[2] * (S(1) - x[1]), S(-1) - x[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 3>&) const { return x[1]; }
};

/// The rotor in another unit of length.
struct LongRotor : Rotor {
    static constexpr double unit = 1e10;
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return Vec<S, 2>(Rotor::f1(t, Vec<S, 2>(x / S(unit)), p) * S(unit));
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 3>& p) const {
        return Vec<S, 2>(Rotor::f2(t, Vec<S, 2>(x / S(unit)), p) * S(unit));
    }
};

/// x_i' = -1 - x_i below x_0 = 0, 1 above, in more dimensions than a grid has room for.
struct Many {
    static constexpr int dim = 20;
    static constexpr std::array<std::string_view, 0> params{};
    template <Scalar S> Vec<S, 20> f1(const S&, const Vec<S, 20>& x, const Vec<S, 0>&) const {
        return Vec<S, 20>(Vec<S, 20>::Constant(S(-1)) - x);
    }
    template <Scalar S> Vec<S, 20> f2(const S&, const Vec<S, 20>&, const Vec<S, 0>&) const {
        return Vec<S, 20>::Constant(S(1));
    }
    template <Scalar S> S h(const S&, const Vec<S, 20>& x, const Vec<S, 0>&) const { return x[0]; }
};

/// L1 = x - b (1 - cos t), L2 = -1, x' = -a sin t in a slide at L1 = 0: the boundary of the sliding
/// region is x = b (1 - cos t), with L1' = -(a + b) sin t, zero at t = 0 to the last bit.
struct Seam {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"a", "b"};
    static constexpr std::array<double, 2> defaults{1, 0};

    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        using elementary::cos;
        using elementary::sin;
        return {-p[0] * sin(t), x[0] - p[1] * (S(1) - cos(t))};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>&, const Vec<S, 2>&) const {
        return {S(0), S(-1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const { return x[1]; }
    template <Scalar S> S period(const Vec<S, 2>&) const { return S(2 * std::numbers::pi); }
};

/// L1 = x^2 - cos t: a boundary that is there for half of the period.
struct Lens {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 0> params{};

    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        using elementary::cos;
        return {S(1), x[0] * x[0] - cos(t)};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(0), S(-1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    template <Scalar S> S period(const Vec<S, 0>&) const { return S(2 * std::numbers::pi); }
};

/// L1 = x, L2 = -cos t: on the boundary x = 0 both fields are tangent twice a period.
struct TwoFolds {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 0> params{};

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {S(1), x[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>&, const Vec<S, 0>&) const {
        using elementary::cos;
        return {S(0), -cos(t)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    template <Scalar S> S period(const Vec<S, 0>&) const { return S(2 * std::numbers::pi); }
};

/// The only pseudo-equilibrium.
Equilibrium pseudo_of(const std::vector<Equilibrium>& all) {
    const auto is_pseudo = [](const Equilibrium& e) { return e.kind == Equilibrium::Kind::pseudo; };
    REQUIRE(std::ranges::count_if(all, is_pseudo) == 1);
    return *std::ranges::find_if(all, is_pseudo);
}

} // namespace

TEST_CASE("geometry: the boundary of the oscillator's sliding region", "[geometry]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 0.5, 2.9);
    for (const int side : {-1, 1}) {
        const SlidingBoundary b = sliding_boundary(*system, side, point({-4.0 * side, 1}), p);
        REQUIRE(b.points.size() == 257);
        for (const Tangency& point : b.points) {
            const double phase = 2.9 * point.t;
            CHECK(point.x[0] == Approx(-4 * side + 0.5 * std::cos(phase)).epsilon(1e-13));
            CHECK(point.x[1] == Approx(1).epsilon(1e-14));
            // |s| grows along the slide where side * (-V - A omega sin) > 0: q = -k y + A cos, q /
            // 4 = s
            CHECK(point.drift ==
                  Approx(side * (-1 - 0.5 * 2.9 * std::sin(phase)) / 4).margin(1e-12));
        }
        // 1 + A omega sin phi = 0 has two roots
        REQUIRE(b.tangential.size() == 2);
        for (const Tangency& point : b.tangential)
            CHECK(1 + 0.5 * 2.9 * std::sin(2.9 * point.t) == Approx(0).margin(1e-12));
    }
}

TEST_CASE("geometry: tangencies, pseudo-equilibria and boundary equilibria in closed form",
          "[geometry]") {
    const auto system = any_system(Rotor{});
    const Vector p = system->defaults();
    const StateBox box{point({-3, -2}), point({3, 2})};
    const auto below = tangencies(*system, -1, 0, box, p),
               above = tangencies(*system, 1, 0, box, p);
    REQUIRE(below.size() == 1);
    REQUIRE(above.size() == 1);
    CHECK((below[0].x - point({0.5, 0})).norm() < 1e-14);
    CHECK((above[0].x - point({-1, 0})).norm() < 1e-14);
    // h'' = -x' of the side's own field: -d below, 1 above
    CHECK(below[0].second == Approx(-0.25));
    CHECK(above[0].second == Approx(1));
    CHECK(below[0].visible());
    CHECK(above[0].visible());

    // Sliding for -1 < x < 0.5: L1 = c - x, L2 = -1 - x. The sliding field is
    // (-L2 d + L1 (-1)) / (L1 - L2) = ((1 + x) d - c + x) / (1 + c) = 0.
    const auto rest = equilibria(*system, box, p);
    int pseudo = 0;
    for (const Equilibrium& e : rest)
        if (e.kind == Equilibrium::Kind::pseudo) {
            ++pseudo;
            const double x = (0.5 - 0.25) / 1.25;
            CHECK((e.x - point({x, 0})).norm() < 1e-13);
            CHECK(e.s == Approx((0.5 - x + -1 - x) / 1.5).epsilon(1e-12));
            CHECK(e.real);
            REQUIRE(e.eigenvalues.size() == 1);
            CHECK(e.eigenvalues[0].real() == Approx(1.25 / 1.5).epsilon(1e-12));
        } else if (e.side < 0) {
            CHECK((e.x - point({0.5, -0.25})).norm() < 1e-13); // below: real
            CHECK(e.real);
        } else {
            CHECK((e.x - point({-1, 1})).norm() < 1e-13);
            CHECK(e.real);
        }
    CHECK(pseudo == 1);
    CHECK(rest.size() == 3);

    // the equilibrium of f1 reaches the surface where d = 0
    const auto boundary = boundary_equilibria(*system, box, p, 1, -1, 1);
    REQUIRE(boundary.size() == 1);
    CHECK(boundary[0].side == -1);
    CHECK(boundary[0].value == Approx(0).margin(1e-13));
    CHECK((boundary[0].x - point({0.5, 0})).norm() < 1e-13);
}

TEST_CASE("geometry: stability of pseudo-equilibria needs sliding that attracts", "[geometry]") {
    const auto system = any_system(Rotor{});
    const StateBox box{point({-3, -2}), point({3, 2})};
    // the sliding field is ((1 + x) d + e (c - x)) / (1 + c), its slope (d - e) / (1 + c)
    const auto rest = [&](double c, double d, double e) {
        const Equilibrium found = pseudo_of(equilibria(*system, box, point({c, d, e})));
        CHECK(found.x[0] == Approx(-(e * c + d) / (d - e)).epsilon(1e-12));
        CHECK(found.eigenvalues.at(0).real() == Approx((d - e) / (1 + c)).epsilon(1e-12));
        CHECK(found.real);
        return found;
    };
    // sliding attracts for -1 < x < c, repels for c < x < -1
    CHECK(rest(0.5, -0.25, 1).stable());
    CHECK_FALSE(rest(0.5, 0.25, -1).stable());
    const Equilibrium repelled = rest(-2, 0.25, -1);
    CHECK(repelled.eigenvalues[0].real() < 0);
    CHECK_FALSE(repelled.attracting);
    CHECK_FALSE(repelled.stable());
}

TEST_CASE("geometry: what becomes of a boundary equilibrium is seen on both sides of it",
          "[geometry]") {
    const auto system = any_system(Rotor{});
    const StateBox box{point({-3, -2}), point({3, 2})};
    for (const double e : {-1.0, 1.0}) {
        const Vector p = point({0.5, 0.25, e});
        const auto boundary = boundary_equilibria(*system, box, p, 1, -0.5, 0.5);
        REQUIRE(boundary.size() == 1);
        for (const double d : {-0.01, 0.01}) {
            const auto all = equilibria(*system, box, point({0.5, d, e}));
            const auto below = std::ranges::find(all, -1, &Equilibrium::side);
            REQUIRE(below != all.end());
            CHECK((pseudo_of(all).real != below->real) ==
                  (boundary[0].encounter == Equilibrium::Encounter::persistence));
        }
        CHECK(boundary[0].encounter != Equilibrium::Encounter::degenerate);
        // those of (0, 1; -1, 0)
        REQUIRE(boundary[0].eigenvalues.size() == 2);
        for (const auto& value : boundary[0].eigenvalues)
            CHECK(std::abs(value * value + 1.0) < 1e-14);
        CHECK_FALSE(boundary[0].stable());
    }
}

TEST_CASE("geometry: what becomes of a boundary equilibrium has no unit", "[geometry]") {
    const double unit = LongRotor::unit;
    const auto here = any_system(Rotor{}), there = any_system(LongRotor{});
    for (const double e : {-1.0, 1.0}) {
        const Vector p = point({0.5, 0.25, e});
        const auto a =
            boundary_equilibria(*here, {point({-3, -2}), point({3, 2})}, p, 1, -0.5, 0.5);
        const auto b = boundary_equilibria(*there, {unit * point({-3, -2}), unit * point({3, 2})},
                                           p, 1, -0.5, 0.5);
        REQUIRE(a.size() == 1);
        REQUIRE(b.size() == 1);
        CHECK(a[0].encounter != Equilibrium::Encounter::degenerate);
        CHECK(a[0].encounter == b[0].encounter);
    }
}

TEST_CASE("geometry: in many dimensions starts are as many as asked for", "[geometry]") {
    const auto system = any_system(Many{});
    const Vector one = Vector::Ones(20);
    const auto found = equilibria(*system, {-3 * one, 2 * one}, Vector(), 16);
    REQUIRE(found.size() == 2); // and x = 0, where both fields repel and cancel
    const auto below = std::ranges::find(found, -1, &Equilibrium::side);
    REQUIRE(below != found.end());
    CHECK((below->x + one).cwiseAbs().maxCoeff() < 1e-14);
    CHECK(below->real);
    CHECK(pseudo_of(found).x.cwiseAbs().maxCoeff() < 1e-14);
}

TEST_CASE("geometry: the block without a forcing rests where the friction holds the spring",
          "[geometry]") {
    const auto system = oscillator_system();
    Vector p = system->defaults();
    const StateBox box{point({-10, -3}), point({10, 3})};
    CHECK_THROWS_WITH(equilibria(*system, box, p), ContainsSubstring("depends on time"));
    CHECK_THROWS_WITH(boundary_equilibria(*system, box, p, 5, 0, 1),
                      ContainsSubstring("depends on time"));
    p[0] = 0;
    const auto all = equilibria(*system, box, p);
    REQUIRE(all.size() == 2);
    CHECK(all[0].side == -1);
    CHECK(all[0].x[0] == Approx(10 * (0.3 / 2.42 + 0.11)).epsilon(1e-14));
    CHECK(all[0].real);
    // friction that falls with speed drives the block: trace -10 mu'(1) > 0
    const double trace = 10 * (0.3 * 1.42 / (2.42 * 2.42) - 0.02);
    CHECK((all[0].eigenvalues[0] + all[0].eigenvalues[1]).real() == Approx(trace).epsilon(1e-13));
    CHECK_FALSE(all[0].stable());
    CHECK_FALSE(all[1].real);
}

TEST_CASE("geometry: a belt at rest is full of rest points, a degenerate encounter", "[geometry]") {
    const auto system = dieci_lopez_system();
    const auto found = boundary_equilibria(*system, {point({-3, -0.7}), point({3, 0.7})},
                                           system->defaults(), 0, -0.4, 0.6);
    REQUIRE(found.size() == 2);
    for (const Equilibrium& e : found) {
        CHECK(e.value == Approx(0).margin(1e-13));
        CHECK((e.x - point({-1.0 * e.side, 0})).norm() < 1e-13);
        CHECK(e.encounter == Equilibrium::Encounter::degenerate);
    }
}

TEST_CASE("geometry: a point of tangential sliding at phase zero is found once", "[geometry]") {
    const auto system = any_system(Seam{});
    for (const double sign : {1.0, -1.0}) {
        const SlidingBoundary b =
            sliding_boundary(*system, -1, point({0.1, 0}), point({sign, 0.3}), 64);
        CHECK(b.status == Status::ok);
        REQUIRE(b.points.size() == 65);
        CHECK(b.points[7].drift ==
              Approx(2 * (sign + 0.3) * std::sin(b.points[7].t)).epsilon(1e-12));
        REQUIRE(b.tangential.size() == 2);
        CHECK(b.tangential[0].t < 1e-12);
        CHECK(b.tangential[1].t == Approx(std::numbers::pi).epsilon(1e-13));
    }
}

TEST_CASE("geometry: where both fields are tangent no slide is tangential", "[geometry]") {
    const SlidingBoundary b =
        sliding_boundary(*any_system(TwoFolds{}), -1, point({0.1, 0}), Vector(0), 90);
    REQUIRE(b.points.size() == 91);
    // s' = -2/(L1 - L2) there, with a pole
    CHECK(b.points[0].drift == Approx(-2));
    CHECK(b.points[45].drift == Approx(2));
    CHECK(b.tangential.empty());
}

TEST_CASE("geometry: a boundary that ends, or is not there, is a status", "[geometry]") {
    const auto system = any_system(Lens{});
    const SlidingBoundary b = sliding_boundary(*system, -1, point({1, 0}), Vector(0), 100);
    CHECK(b.status == Status::not_converged);
    REQUIRE(b.points.size() == 26); // up to a quarter of the period, t = pi/2 itself by luck
    for (const Tangency& each : b.points)
        CHECK(each.x[0] == Approx(std::sqrt(std::max(0.0, std::cos(each.t)))).margin(1e-7));
    const SlidingBoundary none = sliding_boundary(*system, 1, point({1, 0}), Vector(0), 100);
    CHECK(none.status == Status::not_converged);
    CHECK(none.points.empty());
}

TEST_CASE("geometry: a caller who asks to stop is heard, a mistake is named", "[geometry]") {
    const auto system = any_system(Rotor{});
    const Vector p = system->defaults();
    const StateBox box{point({-3, -2}), point({3, 2})};
    const double inf = std::numeric_limits<double>::infinity();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_WITH(equilibria(*system, {point({-inf, -2}), point({3, 2})}, p),
                      ContainsSubstring("box.low[0]"));
    CHECK_THROWS_WITH(equilibria(*system, {point({-3, nan}), point({3, 2})}, p),
                      ContainsSubstring("box.low[1]"));
    CHECK_THROWS_WITH(equilibria(*system, box, point({nan, 0, 0})), ContainsSubstring("p[0]"));
    CHECK_THROWS_WITH(tangencies(*system, 0, 0, box, p), ContainsSubstring("side"));
    CHECK_THROWS_WITH(tangencies(*system, 1, nan, box, p), ContainsSubstring("t = nan"));
    CHECK_THROWS_WITH(tangencies(*system, 1, 0, box, p, 0), ContainsSubstring("seeds"));
    CHECK_THROWS_WITH(boundary_equilibria(*system, box, p, 3, 0, 1),
                      ContainsSubstring("parameter"));
    CHECK_THROWS_WITH(boundary_equilibria(*system, box, p, 1, nan, 1), ContainsSubstring("low"));

    Precision precision;
    int asked = 0;
    precision.interrupted = [&] { return ++asked > 10; };
    const auto stopped = any_system(Rotor{}, precision);
    tangencies(*stopped, -1, 0, box, p, 1'000'000);
    CHECK(asked == 11);
}

TEST_CASE("geometry: the exit of Dieci and Lopez's cycle", "[geometry]") {
    const auto system = dieci_lopez_system();
    const auto found =
        tangencies(*system, -1, 0, {point({-2, -1}), point({2, 1})}, system->defaults());
    REQUIRE(found.size() == 1);
    CHECK((found[0].x - point({1, 0.2})).norm() < 1e-13); // x1 = 1/(1 + v - v)
    CHECK(found[0].visible());
    CHECK(found[0].attracting());
    CHECK(found[0].drift > 0);
}
