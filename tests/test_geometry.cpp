// SPDX-License-Identifier: BSD-3-Clause
// Boundaries of the sliding region, tangencies, equilibria.

#include "catch.hpp"
#include "systems.hpp"

#include <filippov/geometry.hpp>

#include <cmath>
#include <numbers>

using namespace filippov;

namespace {

Vector point(std::initializer_list<double> values) {
    Vector x(Eigen::Index(values.size()));
    std::copy(values.begin(), values.end(), x.begin());
    return x;
}

/// x' = (y, -x + c) below y = 0 and (y - 1, x - 1 - c) above: sliding, tangencies and equilibria in
/// closed form.
struct Rotor {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> state{"x", "y"};
    static constexpr std::array<std::string_view, 2> params{"c", "d"};
    static constexpr std::array<double, 2> defaults{0.5, 0.25};

    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {x[1] + p[1], p[0] - x[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const {
        return {x[1] - S(1), S(-1) - x[0]};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const { return x[1]; }
};

} // namespace

TEST_CASE("geometry: the boundary of the oscillator's sliding region", "[geometry]") {
    const auto system = oscillator_system();
    Vector p = system->defaults();
    p[0] = 0.5;
    p[1] = 2.9;
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
