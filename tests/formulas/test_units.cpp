// SPDX-License-Identifier: BSD-3-Clause
// Directions in formulas: what is one, however it is written, and what stays a quotient.
#include "catch.hpp"
#include "formulas.hpp"

#include <filippov/engine/trajectory.hpp>

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

using namespace filippov;

namespace {

/// The state x, y, u, w, a parameter mu, and formulas of them.
struct Plane {
    Definition d;
    Graph& g = d.graph;
    Expr x, y, u, w, mu;

    Plane() {
        d.dim = 4;
        d.defaults = {2.94};
        d.state_names = {"x", "y", "u", "w"};
        d.param_names = {"mu"};
        x = g.state(0);
        y = g.state(1);
        u = g.state(2);
        w = g.state(3);
        mu = g.param(0);
    }
    std::vector<Expr> v() const { return {u, w}; }
    Expr n(int k) { return g.unit(v(), k); }
    Expr speed() { return g.length(v()); }
    Expr c(double value) { return g.constant(value); }
};
using Forces = std::function<std::vector<Expr>(Plane&)>;

Definition made(const Forces& forces) {
    Plane plane;
    std::vector<Expr> field{plane.u, plane.w};
    for (const Expr e : forces(plane))
        field.push_back(e);
    split(plane.d, field);
    return plane.d;
}
const std::vector<SurfaceKind> one_direction{SurfaceKind::direction, SurfaceKind::component};

/// The same divided by the speed in several ways.
std::map<std::string, Forces> friction() {
    return {
        {"unit",
         [](Plane& p) {
             return std::vector{p.g.neg(p.g.mul(p.mu, p.n(0))), p.g.neg(p.g.mul(p.mu, p.n(1)))};
         }},
        {"quotients",
         [](Plane& p) {
             return std::vector{p.g.div(p.g.neg(p.g.mul(p.mu, p.u)), p.speed()),
                                p.g.div(p.g.neg(p.g.mul(p.mu, p.w)), p.speed())};
         }},
        {"a factor for both",
         [](Plane& p) {
             const Expr k = p.g.div(p.g.neg(p.mu), p.speed());
             return std::vector{p.g.mul(k, p.u), p.g.mul(k, p.w)};
         }},
        {"a power",
         [](Plane& p) {
             const Expr square = p.g.add(p.g.mul(p.w, p.w), p.g.mul(p.u, p.u));
             const Expr k = p.g.mul(p.mu, p.g.pow(square, p.c(-0.5)));
             return std::vector{p.g.neg(p.g.mul(p.u, k)), p.g.neg(p.g.mul(k, p.w))};
         }},
        {"where it moves",
         [](Plane& p) {
             const Expr moves = p.g.step(p.speed());
             const auto one = [&](Expr e) {
                 return p.g.where(moves, p.g.div(p.g.neg(p.g.mul(p.mu, e)), p.speed()), p.c(0));
             };
             return std::vector{one(p.u), one(p.w)};
         }},
        {"both ways",
         [](Plane& p) {
             const std::vector<Expr> back{p.g.neg(p.u), p.g.neg(p.w)};
             return std::vector{p.g.mul(p.mu, p.g.unit(back, 0)),
                                p.g.neg(p.g.div(p.g.mul(p.mu, p.w), p.speed()))};
         }},
    };
}

/// The puck of these formulas in the header's terms.
struct Puck {
    static constexpr int dim = 4, surfaces = 2;
    static constexpr std::array kinds{SurfaceKind::direction, SurfaceKind::component};
    static constexpr std::array<std::string_view, 1> params{"mu"};

    template <Scalar S>
    Vec<S, 4> field(const S&, const Vec<S, 4>& x, const Vec<S, 2>& s, const Vec<S, 1>& p) const {
        return {x[2], x[3], -p[0] * s[0], -p[0] * s[1]};
    }
    template <Scalar S> Vec<S, 2> h(const S&, const Vec<S, 4>& x, const Vec<S, 1>&) const {
        return {x[2], x[3]};
    }
};

void refuses(const Forces& forces, const std::string& told) {
    CAPTURE(told);
    CHECK_THROWS_WITH(made(forces), Catch::Matchers::ContainsSubstring(told));
}

} // namespace

TEST_CASE("units: friction is a direction however it is written", "[formulas]") {
    const Vec<double, 1> mu(2.94);
    const auto wanted = flow(Puck{}, mu, Vec<double, 4>(0, 0, 3, 4), 0.0, 5.0, {.rtol = 1e-9});
    REQUIRE(wanted.status == Status::ok);
    for (const auto& [form, forces] : friction()) {
        CAPTURE(form);
        const Definition d = made(forces);
        REQUIRE(d.kind == one_direction);
        CHECK(d.region.size() == 1);
        const auto sys = tests::tape_system<8, 8>(d);
        CHECK(has_directions(sys));
        Vec<double, 8> x = Vec<double, 8>::Zero();
        x[2] = 3;
        x[3] = 4;
        const auto got =
            flow(sys, all_params<double>(sys, std::vector{2.94}), x, 0.0, 5.0, {.rtol = 1e-9});
        REQUIRE(got.status == Status::ok);
        CHECK(got.counters.steps == wanted.counters.steps);
        for (int i = 0; i < 4; ++i)
            CHECK(got.x[i] == Approx(wanted.x[i]).margin(1e-12));
        CHECK(got.mode[0] == 0);
        CHECK(got.mode[1] == 0);
    }
}

TEST_CASE("units: what a formula shares is looked at once") {
    // a square of squares: 2^40 ways lead through it
    const auto shared = [](Plane& p) {
        Expr q = p.g.div(p.x, p.g.add(p.c(1), p.g.mul(p.x, p.x)));
        for (int k = 0; k < 40; ++k)
            q = p.g.mul(q, p.g.add(q, p.y));
        return q;
    };
    const Definition factor = made([&](Plane& p) {
        const Expr q = p.g.add(p.c(1), p.g.mul(shared(p), shared(p)));
        const Expr k = p.g.div(p.g.neg(p.mu), p.speed());
        return std::vector{p.g.mul(q, p.g.mul(p.u, k)), p.g.mul(p.w, k)};
    });
    CHECK(factor.kind == one_direction);
    const Definition divisor = made([&](Plane& p) {
        const Expr push = p.g.div(p.c(1), shared(p));
        return std::vector{p.g.sub(push, p.g.div(p.g.mul(p.mu, p.u), p.speed())),
                           p.g.neg(p.g.div(p.g.mul(p.mu, p.w), p.speed()))};
    });
    CHECK(divisor.kind == one_direction);
}

TEST_CASE("units: what nothing pulls to rest stays a quotient", "[formulas]") {
    const auto none = [](const Forces& forces) { return made(forces).surfaces() == 0; };
    const auto over = [](Plane& p, Expr factor, Expr a, Expr b) {
        return std::vector{p.g.mul(factor, a), p.g.mul(factor, b)};
    };
    CHECK(none([&](Plane& p) { // a spring of length 1
        const Expr r = p.g.length(std::vector{p.x, p.y});
        return over(p, p.g.div(p.g.sub(p.c(1), r), r), p.x, p.y);
    }));
    CHECK(none([&](Plane& p) { // gravity
        const Expr r = p.g.length(std::vector{p.x, p.y});
        return over(p, p.g.div(p.c(-1), p.g.mul(r, p.g.mul(r, r))), p.x, p.y);
    }));
    CHECK(none([&](Plane& p) { return over(p, p.g.div(p.mu, p.speed()), p.u, p.w); })); // thrust
    CHECK(none([&](Plane& p) { // regularised
        const Expr square = p.g.add(p.g.add(p.g.mul(p.u, p.u), p.g.mul(p.w, p.w)), p.c(1e-6));
        return over(p, p.g.div(p.g.neg(p.mu), p.g.unary(Op::sqrt, square)), p.u, p.w);
    }));
    CHECK(none([&](Plane& p) { // of no direction
        return std::vector{p.g.div(p.g.neg(p.g.add(p.u, p.c(1))), p.speed()), p.w};
    }));
}

TEST_CASE("units: friction that depends on the speed is smooth at rest", "[formulas]") {
    Definition d = made([](Plane& p) {
        const Expr mu = p.g.add(p.mu, p.g.unary(Op::exp, p.g.neg(p.speed())));
        return std::vector{p.g.div(p.g.neg(p.g.mul(mu, p.u)), p.speed()),
                           p.g.neg(p.g.mul(mu, p.n(1)))};
    });
    REQUIRE(d.kind == one_direction);
    for (const Expr e : d.graph.below(d.region[0]))
        CHECK(d.graph[e].op != Op::sqrt);
    // moving: n is the direction, and u.n the speed
    const std::vector<double> x{0, 0, 0.3, 0.4, 0.6, 0.8}, mu{2.0};
    CHECK(d.graph.value(d.region[0][2], 0, x, mu) == Approx(-0.6 * (2 + std::exp(-0.5))));
    // at rest it is linear in s
    const std::vector<double> rest{0, 0, 0, 0, 0.1, -0.2};
    CHECK(d.graph.value(d.region[0][3], 0, rest, mu) == Approx(0.2 * 3));
}

TEST_CASE("units: opposite and scaled vectors are one direction, others are not", "[formulas]") {
    const auto kinds = [](const Forces& forces) { return made(forces).kind; };
    CHECK(kinds([](Plane& p) {
              const std::vector<Expr> rel{p.g.sub(p.u, p.c(1)), p.w},
                  back{p.g.sub(p.c(1), p.u), p.g.neg(p.w)},
                  thrice{p.g.mul(p.c(3), rel[0]), p.g.mul(p.c(3), rel[1])};
              return std::vector{p.g.sub(p.g.unit(back, 0), p.g.unit(thrice, 0)),
                                 p.g.neg(p.g.unit(rel, 1))};
          }) == one_direction);
    std::vector<SurfaceKind> two = one_direction;
    two.insert(two.end(), one_direction.begin(), one_direction.end());
    CHECK(kinds([](Plane& p) {
              const std::vector<Expr> other{p.u, p.g.mul(p.c(2), p.w)};
              return std::vector{p.g.neg(p.n(0)), p.g.neg(p.g.unit(other, 1))};
          }) == two);
    std::vector<SurfaceKind> beside{SurfaceKind::switching};
    beside.insert(beside.end(), one_direction.begin(), one_direction.end());
    CHECK(kinds([](Plane& p) {
              return std::vector{p.g.neg(p.n(0)),
                                 p.g.neg(p.g.add(p.n(1), p.g.unary(Op::sign, p.x)))};
          }) == beside);
}

TEST_CASE("units: entries that are zero or never zero make a sign or a quotient", "[formulas]") {
    Plane p;
    const Expr zero = p.c(0), one = p.c(1);
    CHECK(p.g.unit(std::vector{p.u, zero}, 0) == p.g.unary(Op::sign, p.u));
    CHECK(p.g.unit(std::vector{p.u, zero}, 1) == zero);
    CHECK(p.g.unit(std::vector{p.u, zero, p.w}, 2) == p.n(1));
    CHECK_FALSE(p.g.switches(p.g.unit(std::vector{p.u, one}, 0)));
    CHECK_FALSE(p.g.switches(p.g.unit(std::vector{p.mu, p.g.neg(p.mu)}, 0)));
    CHECK(p.g.unit(std::vector{p.g.neg(p.u), p.g.neg(p.w)}, 0) == p.g.neg(p.n(0)));
    CHECK(p.g.unary(Op::sqrt, p.g.mul(p.u, p.u)) == p.g.abs(p.u));
    // and its derivative
    const std::vector<double> at{0, 0, 0.3, -1.2}, mu{1};
    const double h = 1e-6;
    for (int k = 0; k < 2; ++k) {
        const Expr slope = p.g.derivative(p.n(k), p.u);
        std::vector<double> left = at, right = at;
        left[2] -= h;
        right[2] += h;
        CHECK(p.g.value(slope, 0, at, mu) ==
              Approx((p.g.value(p.n(k), 0, right, mu) - p.g.value(p.n(k), 0, left, mu)) / (2 * h))
                  .margin(1e-9));
    }
}

TEST_CASE("units: what has no law at rest is refused with what to write", "[formulas]") {
    refuses([](Plane& p) { return std::vector{p.g.neg(p.g.mul(p.n(0), p.n(0))), p.w}; },
            "not linear in unit");
    refuses(
        [](Plane& p) {
            return std::vector{p.g.unary(Op::sign, p.g.sub(p.n(0), p.c(0.5))), p.n(1)};
        },
        "switches by an entry of unit");
    refuses(
        [](Plane& p) {
            return std::vector{p.g.unit(std::vector{p.g.add(p.u, p.n(0)), p.w}, 0), p.w};
        },
        "an entry of unit switches itself");
    refuses([](Plane& p) { return std::vector{p.g.unit(std::vector{p.g.abs(p.u), p.w}, 0), p.w}; },
            "an entry of unit switches itself");
    refuses([](Plane& p) { return std::vector{p.g.unit(std::vector{p.u, p.mu}, 0), p.w}; },
            "does not change with time or state");
}
