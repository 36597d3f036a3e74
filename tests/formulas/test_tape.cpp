// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"
#include "formulas.hpp"

#include <filippov/core/dual.hpp>
#include <filippov/core/lanes.hpp>
#include <filippov/formulas/tape_writer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

using namespace filippov;

namespace {

const std::vector<Op> functions{Op::neg,  Op::sqrt, Op::exp,       Op::log,  Op::sin,
                                Op::cos,  Op::tan,  Op::asin,      Op::atan, Op::sinh,
                                Op::cosh, Op::tanh, Op::magnitude, Op::sign};

template <class S> S ran(const Tape& tape, const S& t, const std::vector<S>& x, std::vector<S> p) {
    S out(0);
    tape.run(t, x.data(), p.data(), &out);
    return out;
}

/// A formula of these many operations, of numbers between 0 and 1 that stay of their size.
Expr random_formula(Graph& g, std::mt19937_64& random, int operations) {
    std::vector<Expr> all{g.time(), g.state(0), g.state(1), g.param(0), g.constant(0.75)};
    const auto any = [&] { return all[std::size_t(random() % all.size())]; };
    for (int k = 0; k < operations; ++k) {
        const Expr a = any(), b = any();
        switch (random() % 8) {
        case 0:
            all.push_back(g.mul(g.constant(0.5), g.add(a, b)));
            break;
        case 1:
            all.push_back(g.sub(a, b));
            break;
        case 2:
            all.push_back(g.mul(a, b));
            break;
        case 3:
            all.push_back(g.div(a, g.add(g.constant(1.5), g.mul(b, b))));
            break;
        case 4:
            all.push_back(g.unary(Op::sin, g.mul(a, b)));
            break;
        case 5:
            all.push_back(g.add(g.constant(0.1), g.div(a, g.constant(3))));
            break;
        case 6:
            all.push_back(g.where(g.step(g.sub(a, b)), a, b));
            break;
        default:
            all.push_back(g.unary(Op::tanh, a));
            all.push_back(g.unary(Op::magnitude, a));
        }
    }
    Expr sum = all.back();
    for (int k = 0; k < 3; ++k)
        sum = g.add(sum, any());
    return sum;
}

} // namespace

TEST_CASE("Tape: computes what the formula says", "[formulas]") {
    std::mt19937_64 random(4711);
    for (int k = 0; k < 400; ++k) {
        CAPTURE(k);
        Graph g;
        const Expr e = random_formula(g, random, 1 + k % 100);
        const double t = 0.3, wanted = g.value(e, t, std::vector{0.6, -0.4}, std::vector{0.9});
        const auto close = [&](double value) {
            CHECK(value == Approx(wanted).epsilon(1e-12).margin(1e-12));
        };
        close(ran<double>(write_tape(g, std::vector{e}), t, {0.6, -0.4}, {0.9}));
        // and with what depends on parameters alone derived before
        Derived derived(1, 8);
        const Tape tape = write_tape(g, std::vector{e}, &derived),
                   before = write_tape(g, derived.all());
        std::vector<double> p(8, 0.0);
        p[0] = 0.9;
        const std::vector<double> x{0.6, -0.4};
        before.run(t, x.data(), p.data(), p.data() + 1);
        close(ran<double>(tape, t, x, p));
    }
}

TEST_CASE("Tape: derivatives are those of the formula", "[formulas]") {
    using D = Dual<double, 2>;
    using Second = Dual<Dual<double, 1>, 2>;
    using Series = Taylor<double, 2>;
    Graph g;
    const Expr x = g.state(0), p = g.param(0);
    const std::vector<double> at{0.37}, params{1.3};
    for (const Op op : functions) {
        CAPTURE(int(op));
        const Expr e = g.add(g.unary(op, g.mul(x, p)), g.pow(x, p));
        const Tape tape = write_tape(g, std::vector{e});
        const Expr by_x = g.derivative(e, x), by_p = g.derivative(e, p);
        const double first = g.value(by_x, 0, at, params);
        const D value = ran<D>(tape, D(0), {D::variable(at[0], 0)}, {D::variable(params[0], 1)});
        CHECK(value.d[0] == Approx(first).epsilon(1e-13));
        CHECK(value.d[1] == Approx(g.value(by_p, 0, at, params)).epsilon(1e-13));
        const double second = g.value(g.derivative(by_x, x), 0, at, params);
        Second moving(Dual<double, 1>::variable(at[0], 0));
        moving.d[0] = Dual<double, 1>(1);
        const Second twice = ran<Second>(tape, Second(0.0), {moving}, {Second(params[0])});
        CHECK(twice.d[0].d[0] == Approx(second).epsilon(1e-12).margin(1e-12));
        const Series series =
            ran<Series>(tape, Series(0), {Series::variable(at[0])}, {Series(params[0])});
        CHECK(series.c[1] == Approx(first).epsilon(1e-13));
        CHECK(2 * series.c[2] == Approx(second).epsilon(1e-12).margin(1e-12));
    }
}

TEST_CASE("Tape: a lane computes what a number does", "[formulas]") {
    using T = Lanes<8>;
    std::mt19937_64 random(815);
    for (int k = 0; k < 50; ++k) {
        Graph g;
        const Tape tape = write_tape(g, std::vector{random_formula(g, random, 40)});
        const auto number = [&](int l) { return 0.1 * (l + 1); };
        const T x = T::of([&](int l) { return number(l); });
        const T all = ran<T>(tape, T(0.3), {x, T(-0.4)}, {T(0.9)});
        for (int l = 0; l < 8; ++l)
            CHECK(all[l] == ran<double>(tape, 0.3, {number(l), -0.4}, {0.9}));
    }
}

TEST_CASE("Tape: plain numbers take steps that compute what the loop does, to the bit",
          "[formulas]") {
    std::mt19937_64 random(2718);
    const std::vector<double> x{0.6, -0.4}, p{0.9};
    for (int k = 0; k < 300; ++k) {
        CAPTURE(k);
        Graph g;
        std::vector<Expr> outputs{g.state(1), g.param(0), g.time(), g.constant(3)};
        for (int i = 0; i < 3; ++i)
            outputs.push_back(random_formula(g, random, 1 + k % 100));
        outputs.push_back(outputs[std::size_t(random() % outputs.size())]); // one twice
        outputs.push_back(g.sub(outputs[4], g.mul(g.time(), outputs[5])));
        std::shuffle(outputs.begin(), outputs.end(), random);
        const Tape tape = write_tape(g, outputs);
        std::vector<double> steps(outputs.size()), loop(outputs.size());
        tape.run(0.3, x.data(), p.data(), steps.data());
        tape.run_in_loop(0.3, x.data(), p.data(), loop.data());
        for (std::size_t i = 0; i < outputs.size(); ++i)
            CHECK(steps[i] == loop[i]);
    }
}

TEST_CASE("Tape: steps for every operation and every place of its operands", "[formulas]") {
    Graph g;
    const double t = 0.7;
    const std::vector<double> x{0.6, 0.45}, p{0.9, 0.3};
    const std::vector<Expr> places{g.state(0),
                                   g.param(0),
                                   g.time(),
                                   g.constant(0.35),
                                   g.unary(Op::sqrt, g.state(1)),
                                   g.mul(g.param(1), g.state(1))};
    const auto same = [&](Expr e) {
        const Tape tape = write_tape(g, std::array{e, g.mul(e, e)});
        std::array<double, 2> steps{}, loop{};
        tape.run<2>(t, x.data(), p.data(), steps.data());
        tape.run_in_loop(t, x.data(), p.data(), loop.data());
        CHECK(steps == loop);
        CHECK(steps[0] == Approx(g.value(e, t, x, p)).epsilon(1e-12).margin(1e-12));
    };
    for (const Expr a : places) {
        for (const Op op : functions)
            same(g.unary(op, a));
        same(g.pow(a, g.constant(3)));
        for (const Expr b : places) {
            same(g.add(a, b));
            same(g.sub(a, b));
            same(g.mul(a, b));
            same(g.div(a, b));
            same(g.pow(a, b));
            same(g.unary(Op::sin, g.mul(a, b)));
            same(g.unary(Op::cos, g.mul(a, b)));
            for (const Expr c : places) {
                same(g.add(g.mul(a, b), c));
                same(g.sub(g.mul(a, b), c));
                same(g.sub(c, g.mul(a, b)));
                same(g.add(g.div(a, b), c));
                same(g.where(g.step(g.sub(a, b)), c, b));
            }
        }
    }
}

TEST_CASE("Tape: long formulas keep their numbers apart", "[formulas]") {
    Graph g;
    // 200 numbers that are all needed at once
    std::vector<Expr> all;
    for (int k = 0; k < 200; ++k)
        all.push_back(g.unary(Op::sin, g.mul(g.state(0), g.constant(k + 1))));
    Expr sum = g.constant(0);
    for (int k = 0; k < 200; ++k)
        sum = g.add(g.mul(all[std::size_t(k)], all[std::size_t(199 - k)]), sum);
    double wanted = 0;
    for (int k = 0; k < 200; ++k)
        wanted += std::sin(0.3 * (k + 1)) * std::sin(0.3 * (200 - k));
    CHECK(ran<double>(write_tape(g, std::vector{sum}), 0, {0.3}, {}) ==
          Approx(wanted).epsilon(1e-12));
}

TEST_CASE("Tape: constants that cannot be folded or inverted", "[formulas]") {
    Graph g;
    const Expr x = g.state(0), zero = g.constant(0), one = g.constant(1), large = g.constant(1e308),
               tiny = g.constant(4e-310);
    const auto at = [&](Expr e, double value) {
        return ran<double>(write_tape(g, std::array{e}), 0.0, {value}, {});
    };
    CHECK(at(g.div(one, zero), 0) == std::numeric_limits<double>::infinity());
    CHECK(at(g.div(one, g.sub(zero, zero)), 0) == std::numeric_limits<double>::infinity());
    CHECK(std::isnan(at(g.div(zero, zero), 0)));
    CHECK(at(g.add(large, large), 0) == std::numeric_limits<double>::infinity());
    CHECK(at(g.mul(large, g.constant(10)), 0) == std::numeric_limits<double>::infinity());
    CHECK(at(g.sub(g.neg(large), large), 0) == -std::numeric_limits<double>::infinity());
    CHECK(at(g.add(x, g.div(one, zero)), 2) == std::numeric_limits<double>::infinity());
    CHECK(at(g.div(x, tiny), 1e-3) == 1e-3 / 4e-310);
    CHECK(at(g.div(x, g.constant(1.7e308)), 1.7e308) == 1);
}

TEST_CASE("Tape: what cannot be written is refused", "[formulas]") {
    Graph g;
    Expr deep = g.state(0);
    for (int k = 0; k < 20000; ++k)
        deep = g.unary(Op::sin, deep);
    CHECK_THROWS_AS(write_tape(g, std::vector{deep}), std::invalid_argument);
    CHECK_THROWS_AS(Derived(9, 8), std::invalid_argument);
}
