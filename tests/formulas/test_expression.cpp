// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"

#include <filippov/formulas/expression.hpp>

#include <cmath>
#include <limits>
#include <vector>

using namespace filippov;

namespace {

/// Every function of one number, at a point where it is smooth.
const std::vector<Op> functions{Op::neg,  Op::sqrt, Op::exp,       Op::log,  Op::sin,
                                Op::cos,  Op::tan,  Op::asin,      Op::atan, Op::sinh,
                                Op::cosh, Op::tanh, Op::magnitude, Op::sign};

} // namespace

TEST_CASE("Graph: equal expressions are one node", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1);
    CHECK(g.add(x, y) == g.add(y, x));
    CHECK(g.mul(x, y) == g.mul(y, x));
    CHECK(g.sub(x, y) != g.sub(y, x));
    CHECK(g.neg(g.sub(x, y)) == g.sub(y, x));
    CHECK(g.sub(x, g.neg(y)) == g.add(x, y));
    CHECK(g.mul(g.neg(x), y) == g.neg(g.mul(x, y)));
    CHECK(g.mul(g.constant(2), g.mul(g.constant(3), x)) == g.mul(g.constant(6), x));
    CHECK(g.param(0) != x);
}

TEST_CASE("Graph: zeros, ones and constants vanish", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), zero = g.constant(0), one = g.constant(1);
    CHECK(g.add(x, zero) == x);
    CHECK(g.sub(x, x) == zero);
    CHECK(g.mul(x, zero) == zero);
    CHECK(g.mul(one, x) == x);
    CHECK(g.div(x, one) == x);
    CHECK(g.pow(x, zero) == one);
    CHECK(g.pow(x, one) == x);
    CHECK(g.pow(x, g.constant(2)) == g.mul(x, x));
    CHECK(g.constant(-0.0) == zero);
    const Expr y = g.state(1), p = g.param(0);
    CHECK(g.div(g.mul(p, x), x) == p);
    CHECK(g.div(g.mul(g.mul(p, x), y), g.mul(y, x)) == p);
    CHECK(g.div(g.neg(g.mul(y, x)), x) == g.neg(y));
    CHECK(g.div(p, p) != one); // 0/0 where p is 0
    CHECK(g.is_constant(g.unary(Op::cos, zero), 1));
    // what is not finite is not folded away: it is found when it is computed
    CHECK_FALSE(g.is_constant(g.div(one, zero)));
    CHECK_THROWS_AS(g.constant(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

TEST_CASE("Graph: a derivative agrees with differences", "[formulas]") {
    Graph g;
    const Expr t = g.time(), x = g.state(0), p = g.param(0);
    const std::vector<double> at{0.37}, params{1.3};
    const double time = 0.71, step = 1e-5;
    const auto agrees = [&](Expr e, Expr leaf) {
        const auto value = [&](double d) {
            return g.value(e, time + (leaf == t ? d : 0), std::vector{at[0] + (leaf == x ? d : 0)},
                           std::vector{params[0] + (leaf == p ? d : 0)});
        };
        // four points: an error of order step^4
        const double wanted =
            (8 * (value(step) - value(-step)) - (value(2 * step) - value(-2 * step))) / (12 * step);
        CHECK(g.value(g.derivative(e, leaf), time, at, params) ==
              Approx(wanted).epsilon(1e-9).margin(1e-9));
    };
    for (const Expr leaf : {t, x, p}) {
        const Expr inner = g.mul(x, g.add(t, g.mul(p, g.constant(0.1))));
        for (const Op op : functions) {
            CAPTURE(int(op));
            agrees(g.unary(op, inner), leaf);
        }
        agrees(g.div(inner, g.add(p, g.mul(x, t))), leaf);
        agrees(g.pow(inner, p), leaf);
        agrees(g.pow(g.add(x, t), g.constant(-3)), leaf);
        agrees(g.pow(g.add(x, t), g.constant(1.5)), leaf);
        agrees(g.where(g.step(g.sub(x, t)), inner, g.mul(inner, inner)), leaf);
        agrees(g.abs(g.sub(inner, g.constant(2))), leaf);
    }
}

TEST_CASE("Graph: a substitute stands for every occurrence of a leaf", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1);
    const Expr e = g.add(g.mul(x, y), g.unary(Op::sin, x));
    CHECK(g.substitute(e, x, g.constant(0)) == g.constant(0));
    CHECK(g.substitute(e, y, x) == g.add(g.mul(x, x), g.unary(Op::sin, x)));
}

TEST_CASE("Graph: a sign comes apart at products", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1);
    const auto sign = [&](Expr e) { return g.unary(Op::sign, e); };
    CHECK(sign(g.mul(x, y)) == g.mul(sign(x), sign(y)));
    CHECK(sign(g.pow(x, g.constant(3))) == sign(x));
    CHECK(sign(g.unary(Op::tanh, x)) == sign(x));
    CHECK(sign(g.unary(Op::exp, x)) == g.constant(1));
    CHECK(sign(g.mul(y, g.add(g.constant(1), g.mul(x, x)))) == sign(y));
    CHECK(sign(g.add(g.mul(x, x), g.mul(y, y))) != g.constant(1)); // zero at the origin
}

TEST_CASE("Graph: what multiplies the one factor that changes its sign turns it", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1), k = g.param(0), u = g.sub(x, y);
    const auto sign = [&](Expr e) { return g.unary(Op::sign, e); };
    const auto argument = [&](Expr e) {
        REQUIRE(g[sign(e)].op == Op::sign);
        return g[sign(e)].arg[0];
    };
    CHECK(argument(g.neg(x)) == g.neg(x));
    CHECK(argument(g.mul(g.constant(3), x)) == x);
    CHECK(argument(g.mul(g.constant(-3), u)) == g.sub(y, x));
    CHECK(argument(g.div(u, g.constant(-3))) == g.sub(y, x));
    CHECK(argument(g.mul(g.mul(g.constant(-3), g.unary(Op::exp, y)), x)) == g.neg(x));
    CHECK(argument(g.pow(g.neg(x), g.constant(3))) == g.neg(x));
    CHECK(argument(g.unary(Op::tanh, g.mul(g.constant(-1), x))) == g.neg(x));
    CHECK(argument(sign(g.neg(x))) == g.neg(x));
    // of x^2 y the second changes its sign, of x y both do: each then has its own
    CHECK(sign(g.mul(g.constant(-2), g.mul(g.mul(x, x), y))) ==
          g.mul(g.mul(sign(g.neg(y)), sign(x)), sign(x)));
    CHECK(sign(g.mul(g.constant(-2), g.mul(x, y))) == g.neg(g.mul(sign(x), sign(y))));
    // a parameter: at both of its signs, and where it is zero
    for (const Expr e : {g.mul(k, u), g.neg(g.mul(k, u)), g.div(g.mul(u, g.constant(-2)), k),
                         g.mul(g.mul(k, g.mul(k, k)), u), sign(g.mul(k, u)),
                         g.mul(g.neg(k), g.mul(g.sub(k, g.constant(9)), u))}) {
        Expr switched = -1;
        for (const Expr i : g.below(sign(e)))
            if (g[i].op == Op::sign && g.varies(i))
                switched = i;
        REQUIRE(switched >= 0);
        for (const double value : {-2.0, 0.0, 2.0}) {
            CAPTURE(e, value);
            const std::vector<double> at{0.5, 2}, p{value};
            CHECK(g.value(sign(e), 0, at, p) == g.value(switched, 0, at, p) * (value != 0));
            CHECK(g.value(switched, 0, at, p) != 0);
        }
        CHECK(sign(g.unary(Op::sign, e)) == sign(e));
        CHECK(sign(g[switched].arg[0]) == switched);
    }
}

TEST_CASE("Graph: what has no zero has no sign that changes", "[formulas]") {
    Graph g;
    const Expr t = g.time(), x = g.state(0), one = g.constant(1), two = g.constant(2);
    const auto sign = [&](Expr e) { return g.unary(Op::sign, e); };
    const Expr wave = g.unary(Op::sin, g.mul(g.constant(5), x));
    const std::vector<Expr> positive{g.add(two, wave),
                                     g.sub(two, g.mul(wave, g.unary(Op::cos, t))),
                                     g.add(one, g.mul(g.constant(-0.5), g.unary(Op::tanh, x))),
                                     g.add(g.constant(1.6), g.unary(Op::atan, x)),
                                     g.sub(g.unary(Op::exp, wave), g.constant(0.3)),
                                     g.sub(g.unary(Op::cosh, x), g.constant(0.9)),
                                     g.add(g.abs(g.mul(g.constant(-3), x)), one),
                                     g.div(one, g.add(one, g.pow(x, g.constant(4)))),
                                     g.pow(g.add(two, wave), g.constant(1.0 / 3)),
                                     g.unary(Op::sqrt, g.add(g.constant(1.5), wave)),
                                     g.where(g.step(x), g.add(two, wave), one)};
    for (const Expr e : positive) {
        CAPTURE(e);
        CHECK(sign(e) == one);
        CHECK(sign(g.neg(e)) == g.constant(-1));
        CHECK(sign(g.mul(g.neg(e), x)) == sign(g.neg(x)));
        CHECK(sign(g.div(x, e)) == sign(x));
    }
    for (const Expr e : {g.add(one, wave), g.add(g.constant(0.99), wave), g.add(x, two),
                         g.sub(g.unary(Op::exp, x), g.constant(0.3)),
                         g.add(g.unary(Op::tan, x), two), g.add(g.unary(Op::log, x), two),
                         g.sub(g.abs(x), one), g.add(g.mul(g.param(0), wave), two)})
        CHECK(g[sign(e)].op == Op::sign);
}

TEST_CASE("Graph: a square of squares is looked at once, and so is what it is a factor of",
          "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1);
    Expr square = g.sub(x, y), chain = x, odd = g.neg(y);
    for (int k = 0; k < 500; ++k) { // 2^500 factors
        square = g.mul(square, square);
        chain = g.mul(g.add(chain, g.constant(k + 1)), y);
        odd = g.mul(g.mul(odd, odd), g.neg(y));
    }
    const auto sign = [&](Expr e) { return g.unary(Op::sign, e); };
    const Expr u = g.sub(x, y);
    CHECK(sign(square) == g.mul(sign(u), sign(u)));
    CHECK(sign(g.neg(g.mul(square, x))) == g.mul(g.mul(sign(u), sign(u)), sign(g.neg(x))));
    CHECK(sign(odd) == sign(g.neg(y)));
    CHECK(g.div(square, x) == g.div(square, x));
    CHECK(g[g.div(g.mul(square, x), x)].op == Op::mul);
    CHECK(g.div(g.mul(square, x), x) == square);
    Expr sum = x;
    for (int k = 0; k < 200'000; ++k)
        sum = g.add(g.mul(sum, y), x);
    CHECK(sign(g.mul(g.constant(-2), sum)) == g.unary(Op::sign, g.neg(sum)));
    CHECK(g.div(sum, x) == g.div(sum, x));
}

TEST_CASE("Graph: a power of powers of powers does not exhaust the stack", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), y = g.state(1);
    Expr e = g.abs(x);
    for (int k = 0; k < 300'000; ++k)
        e = g.pow(e, y);
    CHECK(g[g.unary(Op::sign, e)].op == Op::sign);
    CHECK(g.unary(Op::sign, g.pow(g.pow(g.abs(x), y), y)) == g.constant(1));
    Expr shared = g.abs(x);
    for (int k = 0; k < 80; ++k) // 2^80 paths
        shared = g.mul(g.pow(shared, x), g.pow(shared, y));
    CHECK(g.unary(Op::sign, shared) == g.constant(1));
}
