// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/formulas/detail/quick_sums.hpp>

#include <cmath>
#include <random>
#include <vector>

using namespace filippov;
using detail::QuickSums;

namespace {

constexpr std::size_t room = 100;

Expr quick(Graph& g, Expr e) { return QuickSums(g, std::vector{e})(e, room); }
/// The operand of a sum that is added last.
Expr last_of(const Graph& g, Expr e) {
    const Graph::Node& n = g[e];
    REQUIRE((n.op == Op::add || n.op == Op::sub));
    // (of a sum, which has no order, the one that is none itself)
    const Op first = g[n.arg[0]].op;
    return first == Op::add || first == Op::sub ? n.arg[1] : n.arg[0];
}

} // namespace

TEST_CASE("QuickSums: what depends on the state longest is added last", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), v = g.state(1), p = g.param(0), q = g.param(1);
    const Expr slow = g.div(q, g.add(g.constant(2), g.mul(v, v)));
    const Expr wave = g.unary(Op::cos, g.mul(q, g.time()));
    // (slow + p) - q x + wave, all over p
    const Expr e = g.mul(g.add(g.sub(g.add(slow, p), g.mul(q, x)), wave), p);
    const Expr sum = quick(g, e);
    CHECK(g[last_of(g, sum)].op == Op::div);
    CHECK_FALSE(g.varies(g[last_of(g, sum)].arg[0])); // with the factor of the sum in it
    CHECK(g.value(sum, 0.3, std::vector{0.2, 0.7}, std::vector{1.3, 0.9}) ==
          Approx(g.value(e, 0.3, std::vector{0.2, 0.7}, std::vector{1.3, 0.9})).epsilon(1e-14));
}

TEST_CASE("QuickSums: a difference of two given numbers stays one", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), p = g.param(0), q = g.param(1);
    const Expr e = g.mul(q, g.sub(x, p));
    const Expr sum = quick(g, g.add(e, g.unary(Op::sin, x)));
    // exact where x is close to p
    const double at = 1e8, near = std::nextafter(at, 2 * at);
    const double wanted = 3 * (near - at) + std::sin(near);
    CHECK(g.value(sum, 0, std::vector{near}, std::vector{at, 3.0}) == wanted);
}

TEST_CASE("QuickSums: a force is exactly zero at rest, however it is written", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1), p = g.param(0), k = g.param(1);
    // a spring of length p between two bodies, and what vanishes with their speeds
    const Expr damping = g.mul(g.state(2), g.mul(g.state(2), g.param(2)));
    for (const Expr stretch : {g.sub(x, g.add(y, p)), g.sub(g.sub(x, y), p), g.sub(g.sub(x, p), y),
                               g.add(g.neg(y), g.sub(x, p))}) {
        const Expr force = g.sub(g.mul(k, stretch), damping);
        const Expr sum = quick(g, force);
        const std::vector<double> rest{1e4 + 1.25, 1e4, 0}, params{1.25, 1.0 / 3, 0.7};
        CHECK(g.value(force, 0, rest, params) == 0);
        CHECK(g.value(sum, 0, rest, params) == 0);
    }
}

TEST_CASE("QuickSums: what is needed twice, or has no room, stays as it is", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), p = g.param(0);
    const Expr shared = g.add(g.unary(Op::sin, x), g.mul(x, x));
    const std::vector<Expr> both{g.mul(p, shared), g.add(shared, g.constant(1))};
    QuickSums sums(g, both);
    const Expr first = sums(both[0], room);
    CHECK(first == both[0]);
    CHECK(sums(both[1], room) == both[1]);
    const Expr wide = g.mul(p, g.sub(g.unary(Op::exp, x), g.mul(x, x)));
    CHECK(QuickSums(g, std::vector{wide})(wide, 1) == wide);
    Expr long_sum = x;
    for (int k = 1; k < 50; ++k)
        long_sum = g.add(long_sum, g.unary(Op::sin, g.mul(g.constant(k), x)));
    CHECK(quick(g, long_sum) == long_sum);
}

TEST_CASE("QuickSums: are the same sums to rounding", "[formulas]") {
    std::mt19937_64 random(90210);
    const std::vector<double> x{0.4, -0.7}, p{1.3, 0.6, 2.1};
    for (int k = 0; k < 300; ++k) {
        CAPTURE(k);
        Graph g;
        std::vector<Expr> all{g.time(), g.state(0), g.state(1), g.param(0), g.param(1), g.param(2)};
        const auto any = [&] { return all[std::size_t(random() % all.size())]; };
        for (int i = 0; i < 12; ++i) {
            const Expr a = any(), b = any();
            all.push_back(random() % 4 == 0   ? g.unary(Op::sin, a)
                          : random() % 3 == 0 ? g.mul(a, b)
                          : random() % 2 == 0 ? g.sub(a, b)
                                              : g.div(a, g.add(g.constant(3), g.mul(b, b))));
        }
        const Expr e = all.back(), sum = quick(g, e);
        const auto before = g.rounded(e, 0.3, x, p), after = g.rounded(sum, 0.3, x, p);
        CHECK(std::abs(before.value - after.value) <= before.error + after.error + 1e-15);
    }
}
