// SPDX-License-Identifier: BSD-3-Clause
// Formulas as data: what a right-hand side written in another language is recorded into.
#pragma once

#include <filippov/formulas/external.hpp>
#include <filippov/formulas/value_range.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace filippov {

/// What a node of a graph computes.
enum class Op : std::uint8_t {
    // leaves
    constant, ///< `value`
    time,
    state, ///< component `index`
    param, ///< parameter `index`
    call,  ///< output `index` of external function `value`, of time, state and parameters
    // of one number or two
    add,
    sub,
    mul,
    div,
    pow,
    neg,
    powi, ///< a to the integer `index`
    sqrt,
    exp,
    log,
    sin,
    cos,
    tan,
    asin,
    atan,
    sinh,
    cosh,
    tanh,
    magnitude, ///< |a| of which nobody asks where it has its kink
    // that switch
    sign,
    where, ///< b where a is 1, c where it is 0
    unit2, ///< entry `index` of the vector (a, b) over its length
    unit3, ///< the same of (a, b, c)
};

/// Operands of an operation: 0 of a leaf, up to 3.
constexpr int arity(Op op) {
    return op <= Op::call ? 0 : op <= Op::pow || op == Op::unit2 ? 2 : op < Op::where ? 1 : 3;
}
constexpr bool is_unit(Op op) { return op == Op::unit2 || op == Op::unit3; }

/// An expression: a number that names a node of a graph.
using Expr = std::int32_t;

/// Formulas that share what they have in common: an equal expression is the same node, so that
/// equality is equality of numbers. Operands have smaller numbers than what is made of them.
///
/// What can be known of an expression when it is made is used: constants are folded, zeros and ones
/// vanish, signs move outwards. Nothing is expanded or reordered that would change the rounding by
/// more than a sum in another order does.
class Graph {
public:
    struct Node {
        Op op{};
        std::array<Expr, 3> arg{-1, -1, -1};
        int index = 0;
        double value = 0;
    };

    std::size_t size() const { return nodes_.size(); }
    const Node& operator[](Expr e) const { return nodes_[std::size_t(e)]; }

    // --- leaves --------------------------------------------------------------------------------

    Expr constant(double value) {
        if (!std::isfinite(value))
            throw std::invalid_argument("filippov: a formula has a constant that is not finite");
        return node({Op::constant, {-1, -1, -1}, 0, value + 0.0}); // no -0.0
    }
    Expr time() { return node({Op::time}); }
    Expr state(int i) { return node({Op::state, {-1, -1, -1}, i}); }
    Expr param(int k) { return node({Op::param, {-1, -1, -1}, k}); }

    /// Makes an external function known; its number.
    /// @error std::invalid_argument for one that is empty or whose sizes do not fit together
    int add_function(std::shared_ptr<const External> f) {
        validate(f.get());
        functions_.push_back(std::move(f));
        return int(functions_.size()) - 1;
    }
    const std::vector<std::shared_ptr<const External>>& functions() const { return functions_; }
    Expr call(int function, int output) {
        if (output < 0 || output >= functions_.at(std::size_t(function))->outputs)
            throw std::invalid_argument("filippov: an external function has no such output");
        return node({Op::call, {-1, -1, -1}, output, double(function)});
    }

    // --- what an expression depends on -----------------------------------------------------------

    bool is_constant(Expr e) const { return (*this)[e].op == Op::constant; }
    bool is_constant(Expr e, double value) const {
        return is_constant(e) && (*this)[e].value == value;
    }
    /// True if it changes with time or state.
    bool varies(Expr e) const { return varies_[std::size_t(e)]; }
    /// True if it changes with a parameter.
    bool has_params(Expr e) const { return has_params_[std::size_t(e)]; }
    /// True if something in it switches.
    bool switches(Expr e) const { return switches_[std::size_t(e)]; }
    /// True if it may jump with time or state: something in it switches or has poles. (The slope of
    /// what jumps may still be the same everywhere: that of arctan(tan(t)) is 1.)
    bool may_jump(Expr e) const { return may_jump_[std::size_t(e)]; }

    // --- operations ------------------------------------------------------------------------------

    Expr add(Expr a, Expr b) {
        if (is_constant(a, 0))
            return b;
        if (is_constant(b, 0))
            return a;
        if ((*this)[b].op == Op::neg)
            return sub(a, (*this)[b].arg[0]);
        if ((*this)[a].op == Op::neg)
            return sub(b, (*this)[a].arg[0]);
        if (a == b)
            return mul(constant(2), a);
        return make(Op::add, std::max(a, b), std::min(a, b));
    }
    Expr sub(Expr a, Expr b) {
        if (is_constant(b, 0))
            return a;
        if (is_constant(a, 0))
            return neg(b);
        if (a == b)
            return constant(0);
        if ((*this)[b].op == Op::neg)
            return add(a, (*this)[b].arg[0]);
        if ((*this)[a].op == Op::neg)
            return neg(add((*this)[a].arg[0], b));
        return make(Op::sub, a, b);
    }
    Expr neg(Expr a) {
        if ((*this)[a].op == Op::neg)
            return (*this)[a].arg[0];
        if ((*this)[a].op == Op::sub)
            return sub((*this)[a].arg[1], (*this)[a].arg[0]);
        return make(Op::neg, a);
    }
    Expr mul(Expr a, Expr b) {
        if (is_constant(b) || (!is_constant(a) && a < b))
            std::swap(a, b); // a constant comes first, then what is younger
        if (is_constant(a, 0))
            return a;
        if (is_constant(a, 1))
            return b;
        if (is_constant(a, -1))
            return neg(b);
        if (is_constant(a) && (*this)[b].op == Op::mul && is_constant((*this)[b].arg[0]))
            return mul(mul(a, (*this)[b].arg[0]), (*this)[b].arg[1]);
        if ((*this)[a].op == Op::neg)
            return neg(mul((*this)[a].arg[0], b));
        if ((*this)[b].op == Op::neg)
            return neg(mul(a, (*this)[b].arg[0]));
        return make(Op::mul, a, b);
    }
    Expr div(Expr a, Expr b) {
        if (is_constant(b, 1) || (is_constant(a, 0) && !is_constant(b, 0)))
            return a;
        if (is_constant(b, -1))
            return neg(a);
        if ((*this)[a].op == Op::neg)
            return neg(div((*this)[a].arg[0], b));
        if ((*this)[b].op == Op::neg)
            return neg(div(a, (*this)[b].arg[0]));
        // c x/|x|, where x has a side: it is not 0/0 at x = 0
        if (const Expr rest = without(a, b); rest >= 0)
            return rest;
        if ((*this)[b].op == Op::mul) {
            const auto [first, second, none] = (*this)[b].arg;
            if (const Expr rest = without(a, first); rest >= 0)
                return div(rest, second);
            if (const Expr rest = without(a, second); rest >= 0)
                return div(rest, first);
        }
        return make(Op::div, a, b);
    }
    Expr pow(Expr a, Expr b) {
        if (is_constant(b)) {
            const double e = (*this)[b].value;
            if (e == 0)
                return constant(1);
            if (e == 1)
                return a;
            if (e == 2)
                return mul(a, a);
            if (e == 0.5)
                return unary(Op::sqrt, a);
            if (e == -1)
                return div(constant(1), a);
            if (e == -0.5)
                return div(constant(1), unary(Op::sqrt, a));
            if (e == std::trunc(e) && std::abs(e) < 1000)
                return make(Op::powi, a, -1, -1, int(e));
        }
        return make(Op::pow, a, b);
    }
    /// A function of one number.
    Expr unary(Op op, Expr a) {
        if (arity(op) != 1 || op == Op::powi)
            throw std::logic_error("filippov: not a function of one number");
        if (op == Op::neg)
            return neg(a);
        if (op == Op::sign)
            return sign(a);
        if (op == Op::sqrt && (*this)[a].op == Op::mul && (*this)[a].arg[0] == (*this)[a].arg[1])
            return abs((*this)[a].arg[0]);
        return make(op, a);
    }
    /// b where the condition is 1, c where it is 0.
    Expr where(Expr condition, Expr b, Expr c) {
        if (is_constant(condition))
            return (*this)[condition].value > 0.5 ? b : c;
        if (b == c)
            return b;
        return make(Op::where, condition, b, c);
    }
    /// a sign(a)
    Expr abs(Expr a) {
        const Expr s = sign(a);
        return mul(a, s);
    }
    /// 1 where a > 0, 0 where a < 0.
    Expr step(Expr a) {
        const Expr s = sign(a);
        return mul(constant(0.5), add(constant(1), s));
    }

    /// Entry k of a vector of two or three numbers over its length. Where all of them may vanish it
    /// switches, and has no value there; what cannot vanish is a quotient.
    Expr unit(std::span<const Expr> a, int k) {
        if (a.size() < 2 || a.size() > 3 || k < 0 || k >= int(a.size()))
            throw std::logic_error("filippov: a direction has two or three entries");
        bool changes = false;
        std::vector<Expr> rest; // that are not zero for ever
        for (const Expr e : a) {
            if (positive_[std::size_t(e)] || range_[std::size_t(e)].high < 0)
                return over_length(a, k);
            changes = changes || varies(e);
            if (!is_constant(e, 0))
                rest.push_back(e);
        }
        if (!changes)
            return over_length(a, k);
        const Expr own = a[std::size_t(k)];
        if (is_constant(own, 0))
            return own;
        if (rest.size() == 1)
            return sign(own);
        if (rest.size() < a.size())
            return unit(rest, int(std::ranges::find(rest, own) - rest.begin()));
        const auto turned_over = [&](Expr e) { return (*this)[e].op == Op::neg; };
        if (std::ranges::all_of(a, turned_over)) {
            for (Expr& e : rest)
                e = neg(e);
            return neg(unit(rest, k));
        }
        return make(a.size() == 2 ? Op::unit2 : Op::unit3, a[0], a[1], a.size() == 2 ? -1 : a[2],
                    k);
    }
    /// The same as a quotient, which is 0/0 where all entries are zero.
    Expr over_length(std::span<const Expr> a, int k) { return div(a[std::size_t(k)], length(a)); }
    /// The length of a vector.
    Expr length(std::span<const Expr> a) {
        Expr sum = mul(a[0], a[0]);
        for (const Expr e : a.subspan(1))
            sum = add(sum, mul(e, e));
        return unary(Op::sqrt, sum);
    }
    /// The vector of a unit2 or unit3.
    std::vector<Expr> vector_of(Expr e) const {
        const Node& n = (*this)[e];
        return {n.arg.begin(), n.arg.begin() + arity(n.op)};
    }

    /// What it is but for its sign, and that: 1, -1, or a choice by parameters between them.
    std::pair<Expr, Expr> turned(Expr e) {
        Expr turn = constant(1);
        for (;;) {
            const Node n = (*this)[e];
            if (n.op == Op::neg) {
                turn = neg(turn);
                e = n.arg[0];
            } else if (n.op == Op::mul && is_turn(n.arg[0])) {
                turn = mul(turn, n.arg[0]);
                e = n.arg[1];
            } else if (n.op == Op::mul && is_turn(n.arg[1])) {
                turn = mul(turn, n.arg[1]);
                e = n.arg[0];
            } else {
                return {e, turn};
            }
        }
    }

    /// A node as it was in another graph, whose nodes before it are all here.
    Expr restore(const Node& n) { return node(n); }

    // --- derivatives and substitution ------------------------------------------------------------

    /// Its partial derivative by a leaf. What switches is constant in between: its jumps have no
    /// derivative.
    Expr derivative(Expr e, Expr leaf) {
        return rewrite(e,
                       [&](Expr i, std::span<const Expr> d) { return derivative_of(i, leaf, d); });
    }
    /// It with another expression for a leaf.
    Expr substitute(Expr e, Expr leaf, Expr by) {
        return rewrite(e, [&](Expr i, std::span<const Expr> arg) {
            return i == leaf ? by : with_args(i, arg);
        });
    }
    /// It rebuilt from below: `f(node, what became of its operands)` for everything in it.
    template <class F> Expr rewrite(Expr e, F f) {
        std::vector<Expr> became(std::size_t(e) + 1, -1);
        for (const Expr i : below(e)) {
            const Node n = (*this)[i]; // a copy: f makes new nodes
            std::array<Expr, 3> arg{-1, -1, -1};
            for (int k = 0; k < arity(n.op); ++k)
                arg[std::size_t(k)] = became[std::size_t(n.arg[std::size_t(k)])];
            became[std::size_t(i)] = f(i, std::span<const Expr>(arg));
        }
        return became[std::size_t(e)];
    }
    /// The same node of other operands.
    Expr with_args(Expr e, std::span<const Expr> arg) {
        const Node n = (*this)[e];
        switch (n.op) {
        case Op::constant:
        case Op::time:
        case Op::state:
        case Op::param:
        case Op::call:
            return e;
        case Op::add:
            return add(arg[0], arg[1]);
        case Op::sub:
            return sub(arg[0], arg[1]);
        case Op::mul:
            return mul(arg[0], arg[1]);
        case Op::div:
            return div(arg[0], arg[1]);
        case Op::pow:
            return pow(arg[0], arg[1]);
        case Op::powi:
            return make(Op::powi, arg[0], -1, -1, n.index);
        case Op::where:
            return where(arg[0], arg[1], arg[2]);
        case Op::unit2:
        case Op::unit3:
            return unit(arg.first(std::size_t(arity(n.op))), n.index);
        default:
            return unary(n.op, arg[0]);
        }
    }
    /// Everything that an expression is made of, operands first, itself last.
    std::vector<Expr> below(Expr e) const { return below(std::array<Expr, 1>{e}); }
    std::vector<Expr> below(std::span<const Expr> roots) const {
        std::vector<bool> needed(size(), false);
        for (const Expr e : roots)
            needed[std::size_t(e)] = true;
        std::vector<Expr> all;
        for (Expr i = Expr(size()); i-- > 0;)
            if (needed[std::size_t(i)]) {
                all.push_back(i);
                for (int k = 0; k < arity((*this)[i].op); ++k)
                    needed[std::size_t((*this)[i].arg[std::size_t(k)])] = true;
            }
        return {all.rbegin(), all.rend()};
    }

    // --- values --------------------------------------------------------------------------------

    /// Its value at a point.
    double value(Expr e, double t, std::span<const double> x, std::span<const double> p) const {
        std::vector<double> v(std::size_t(e) + 1, 0.0);
        for (const Expr i : below(e)) {
            std::array<double, 3> arg{};
            for (int k = 0; k < arity((*this)[i].op); ++k)
                arg[std::size_t(k)] = v[std::size_t((*this)[i].arg[std::size_t(k)])];
            v[std::size_t(i)] = value_at((*this)[i], arg, t, x, p);
        }
        return v[std::size_t(e)];
    }
    /// A value, and how far rounding of constants, inputs and operations may have moved it.
    struct Rounded {
        double value = 0, error = 0;
    };
    /// Its value at a point with a bound of its rounding, to first order. The error is no number
    /// where an operand is as near to the end of a domain as its own rounding.
    Rounded rounded(Expr e, double t, std::span<const double> x, std::span<const double> p) const {
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        std::vector<Rounded> v(std::size_t(e) + 1);
        for (const Expr i : below(e)) {
            const Node& n = (*this)[i];
            const int operands = arity(n.op);
            std::array<double, 3> arg{};
            for (int k = 0; k < operands; ++k)
                arg[std::size_t(k)] = v[std::size_t(n.arg[std::size_t(k)])].value;
            Rounded& now = v[std::size_t(i)];
            now.value = value_at(n, arg, t, x, p);
            now.error = (n.op == Op::call ? 64 : 1) * epsilon * std::abs(now.value);
            for (int k = 0; k < operands; ++k) {
                const double by = v[std::size_t(n.arg[std::size_t(k)])].error;
                double most = 0;
                for (const double moved : {-by, by}) {
                    auto other = arg;
                    other[std::size_t(k)] += moved;
                    const double change = std::abs(value_of(n, other) - now.value);
                    most = change <= most ? most : change; // NaN stays
                }
                now.error += most;
            }
        }
        return v[std::size_t(e)];
    }

private:
    static constexpr std::size_t most_nodes = 1'000'000;

    /// The sign of a product is the product of signs: surfaces that cross are told apart. Where one
    /// factor alone changes its sign, what multiplies it turns it, so that the argument that is
    /// left has the sign that was written, whatever constants and parameters stand before it.
    Expr sign(Expr a) {
        Factors all = factors_of(a);
        if (all.zero)
            return constant(0);
        Expr product = constant(1);
        for (const Factor& fixed : all.fixed) {
            const bool turns = is_turn(fixed.of); // whose square is 1
            for (int k = 0; k < (turns ? fixed.count % 2 : fixed.count); ++k)
                product = mul(product, turns ? fixed.of : make(Op::sign, fixed.of));
        }
        if (Factor* const only = all.only_one(not_negative_)) {
            if (all.negative)
                only->of = neg(only->of);
            all.negative = false;
            if (!is_constant(product) && !all.fixed_are_even()) {
                const Expr turn = turn_of(product);
                only->of = mul(turn, only->of);
                product = product == turn ? constant(1) : mul(product, turn);
            }
        }
        for (const Factor& f : all.varying)
            for (int k = 0; k < f.count; ++k)
                product = mul(product, make(Op::sign, f.of));
        return all.negative ? neg(product) : product;
    }
    struct Factor {
        Expr of;
        int count;
    };
    /// What an expression has the sign of: a product.
    struct Factors {
        std::vector<Factor> fixed, varying; ///< of parameters alone; of time and state
        bool negative = false, zero = false;

        static bool turns(const Factor& f, const std::vector<bool>& not_negative) {
            return f.count % 2 != 0 && !not_negative[std::size_t(f.of)];
        }
        /// The factor that changes its sign with time or state; null if there are others, or none.
        Factor* only_one(const std::vector<bool>& not_negative) {
            Factor* found = nullptr;
            for (Factor& f : varying)
                if (turns(f, not_negative)) {
                    if (found != nullptr)
                        return nullptr;
                    found = &f;
                }
            return found;
        }
        bool fixed_are_even() const {
            return std::ranges::all_of(fixed, [](const Factor& f) { return f.count % 2 == 0; });
        }
    };
    /// @param deep  powers of powers that it is inside of: beyond some nothing is known of one
    Factors factors_of(Expr a, int deep = 0) {
        Factors all;
        // Each node once, the youngest first, with how often it is a factor: once or, as good as
        // any even number, twice. (A square of a square ... of 1000 squares has 2^1000 factors.)
        std::map<Expr, int> rest{{a, 1}};
        const auto more = [&rest](Expr e, int count) {
            int& n = rest[e];
            n += count;
            n = n > 2 ? n - 2 : n;
        };
        while (!rest.empty()) {
            const auto [e, count] = *rest.rbegin();
            const Node& n = (*this)[e];
            rest.erase(e);
            const bool negative = range_[std::size_t(e)].high < 0;
            if (n.op == Op::neg || negative)
                all.negative = all.negative != (count % 2 != 0);
            if (positive_[std::size_t(e)] || negative)
                continue;
            if (n.op == Op::constant) {
                all.zero = true;
            } else if (n.op == Op::mul || n.op == Op::div) {
                more(n.arg[0], count);
                more(n.arg[1], count);
            } else if (n.op == Op::neg || has_sign_of_operand(n)) {
                more(n.arg[0], count);
            } else if (n.op != Op::pow || !is_magnitude(n.arg[0], deep)) {
                // (|a|^b is zero at most)
                (varies(e) ? all.varying : all.fixed).push_back({e, count});
            }
        }
        return all;
    }
    static bool has_sign_of_operand(const Node& n) {
        return n.op == Op::sign || n.op == Op::sinh || n.op == Op::tanh || n.op == Op::atan ||
               n.op == Op::asin || (n.op == Op::powi && n.index % 2 != 0);
    }
    /// True if its form tells that it is negative nowhere, as that of x sign(x) does.
    bool is_magnitude(Expr e, int deep) {
        constexpr int most = 100;
        if (const auto found = magnitude_.find(e); found != magnitude_.end() || deep >= most)
            return found != magnitude_.end() && found->second;
        const Factors all = factors_of(e, deep + 1);
        const auto even = [&](const Factor& f) { return !Factors::turns(f, not_negative_); };
        return magnitude_[e] = !all.negative && std::ranges::all_of(all.varying, even) &&
                               std::ranges::all_of(all.fixed, even);
    }
    /// -1 where a product of signs is -1, else 1: also where it is 0, so that what it turns stays a
    /// surface.
    Expr turn_of(Expr signs) {
        return is_turn(signs) ? signs : where(neg(signs), constant(-1), constant(1));
    }
    bool is_turn(Expr e) const {
        const Node& n = (*this)[e];
        return n.op == Op::where && !varies(e) && is_constant(n.arg[1], -1) &&
               is_constant(n.arg[2], 1);
    }

    /// A product without one of its factors, which varies; -1 if it is none of them.
    Expr without(Expr product, Expr factor) {
        if (!varies(factor))
            return -1;
        std::map<Expr, Expr> above{{product, -1}}; // each node once: products may share factors
        std::vector<Expr> rest{product};
        while (!rest.empty() && rest.back() != factor) {
            const Expr e = rest.back();
            const Node& n = (*this)[e];
            rest.pop_back();
            if (n.op == Op::mul)
                for (const Expr other : {n.arg[1], n.arg[0]})
                    if (other >= factor && above.try_emplace(other, e).second)
                        rest.push_back(other);
        }
        if (rest.empty())
            return -1;
        Expr others = constant(1);
        for (Expr e = factor; e != product; e = above[e]) {
            const auto [first, second, none] = (*this)[above[e]].arg;
            others = mul(others, first == e ? second : first);
        }
        return others;
    }

    /// The node, or what it is equal to if its operands are constants.
    Expr make(Op op, Expr a, Expr b = -1, Expr c = -1, int index = 0) {
        const Node n{op, {a, b, c}, index, 0};
        bool folds = true;
        std::array<double, 3> arg{};
        for (int k = 0; k < arity(op); ++k) {
            const Node& operand = (*this)[n.arg[std::size_t(k)]];
            folds = folds && operand.op == Op::constant;
            arg[std::size_t(k)] = operand.value;
        }
        if (folds) {
            const double value = value_of(n, arg);
            if (std::isfinite(value))
                return constant(value);
        }
        return node(n);
    }
    /// What the form of a node tells of its sign, wherever it is defined.
    struct KnownSign {
        bool positive, not_negative;
    };
    KnownSign known_sign(const Node& n) const {
        const auto positive = [&](std::size_t k) { return bool(positive_[std::size_t(n.arg[k])]); };
        const auto not_negative = [&](std::size_t k) {
            return bool(not_negative_[std::size_t(n.arg[k])]);
        };
        switch (n.op) {
        case Op::constant:
            return {n.value > 0, n.value >= 0};
        case Op::add:
            return {(positive(0) && not_negative(1)) || (not_negative(0) && positive(1)),
                    not_negative(0) && not_negative(1)};
        case Op::mul:
            return {positive(0) && positive(1),
                    n.arg[0] == n.arg[1] || (not_negative(0) && not_negative(1))};
        case Op::div:
            return {positive(0) && positive(1), not_negative(0) && not_negative(1)};
        case Op::powi:
            return {positive(0), positive(0) || n.index % 2 == 0};
        case Op::sqrt:
            return {positive(0), true};
        default:
            return {n.op == Op::exp || n.op == Op::cosh, n.op == Op::exp || n.op == Op::cosh};
        }
    }
    /// The values of a node by those of its operands.
    ValueRange range_of(const Node& n) const {
        std::array<ValueRange, 3> of{};
        for (int k = 0; k < arity(n.op); ++k)
            of[std::size_t(k)] = range_[std::size_t(n.arg[std::size_t(k)])];
        if (n.op == Op::mul && n.arg[0] == n.arg[1])
            return detail::values::power(of[0], 2);
        if (n.op == Op::mul)
            if (const int side = magnitude_by_form(n); side != 0)
                return side > 0 ? ValueRange{0, ValueRange::infinite}
                                : ValueRange{-ValueRange::infinite, 0};
        switch (n.op) {
        case Op::constant:
            return {n.value, n.value};
        case Op::add:
            return detail::values::sum(of[0], of[1]);
        case Op::sub:
            return detail::values::sum(of[0], detail::values::negative(of[1]));
        case Op::neg:
            return detail::values::negative(of[0]);
        case Op::mul:
            return detail::values::product(of[0], of[1]);
        case Op::div:
            return detail::values::quotient(of[0], of[1]);
        case Op::powi:
            return n.index > -1000 && n.index < 1000 ? detail::values::power(of[0], n.index)
                                                     : ValueRange{};
        case Op::where:
            return detail::values::hull(of[1], of[2]);
        case Op::magnitude:
            return detail::values::magnitude(of[0]);
        case Op::sign:
        case Op::unit2:
        case Op::unit3:
        case Op::sin:
        case Op::cos:
            return {-1, 1};
        case Op::pow:
            return positive_[std::size_t(n.arg[0])] ? ValueRange{0, ValueRange::infinite}
                                                    : ValueRange{};
        default:
            return range_of_function(n.op, of[0]);
        }
    }
    static ValueRange range_of_function(Op op, const ValueRange& a) {
        constexpr double right = std::numbers::pi / 2;
        switch (op) {
        case Op::sqrt:
            return detail::values::rising(a, [](double v) { return std::sqrt(std::max(v, 0.0)); });
        case Op::exp:
            return detail::values::rising(a, [](double v) { return std::exp(v); });
        case Op::sinh:
            return detail::values::rising(a, [](double v) { return std::sinh(v); });
        case Op::cosh:
            return detail::values::rising(detail::values::magnitude(a),
                                          [](double v) { return std::cosh(v); });
        case Op::tanh:
            return detail::values::rising(a, [](double v) { return std::tanh(v); });
        case Op::atan:
            return detail::values::rising(a, [](double v) { return std::atan(v); });
        case Op::asin:
            return detail::values::roomy(-right, right);
        default: // a logarithm, a tangent, what is read from outside
            return {};
        }
    }
    /// 1 for c x sign(x), -1 for its negative, 0 for what is neither.
    int magnitude_by_form(const Node& n) const {
        for (const std::size_t k : {0u, 1u}) {
            const Node& s = (*this)[n.arg[k]];
            if (s.op != Op::sign)
                continue;
            const auto [u, of_sign] = without_constants(s.arg[0]);
            const auto [v, of_other] = without_constants(n.arg[1 - k]);
            if (u == v)
                return of_sign * of_other;
        }
        return 0;
    }
    std::pair<Expr, int> without_constants(Expr e) const {
        for (int sign = 1;;) {
            const Node& n = (*this)[e];
            const bool product = n.op == Op::mul && is_constant(n.arg[0]);
            if (n.op != Op::neg && !product)
                return {e, sign};
            sign = n.op == Op::neg || (*this)[n.arg[0]].value < 0 ? -sign : sign;
            e = n.arg[product ? 1 : 0];
        }
    }
    Expr node(const Node& n) {
        const auto found = known_.find({n.op, n.arg, n.index, n.value});
        if (found != known_.end())
            return found->second;
        if (size() >= most_nodes)
            throw std::invalid_argument("filippov: a formula of more than a million operations");
        const Expr e = Expr(size());
        const bool external = n.op == Op::call;
        bool varies = n.op == Op::time || n.op == Op::state || external;
        bool switches = n.op >= Op::sign, has_params = n.op == Op::param || external;
        bool may_jump = switches || external || n.op == Op::tan || n.op == Op::pow ||
                        (n.op == Op::powi && n.index < 0) ||
                        (n.op == Op::div && varies_[std::size_t(n.arg[1])]);
        for (int k = 0; k < arity(n.op); ++k) {
            varies = varies || varies_[std::size_t(n.arg[std::size_t(k)])];
            switches = switches || switches_[std::size_t(n.arg[std::size_t(k)])];
            has_params = has_params || has_params_[std::size_t(n.arg[std::size_t(k)])];
            may_jump = may_jump || may_jump_[std::size_t(n.arg[std::size_t(k)])];
        }
        nodes_.push_back(n);
        const KnownSign sign = known_sign(n);
        const ValueRange range = range_of(n);
        range_.push_back(range);
        positive_.push_back(sign.positive || range.low > 0);
        not_negative_.push_back(sign.not_negative || range.low >= 0);
        varies_.push_back(varies);
        switches_.push_back(switches);
        has_params_.push_back(has_params);
        may_jump_.push_back(may_jump && varies);
        known_.emplace(Key{n.op, n.arg, n.index, n.value}, e);
        return e;
    }
    double value_at(const Node& n, const std::array<double, 3>& arg, double t,
                    std::span<const double> x, std::span<const double> p) const {
        return n.op == Op::time    ? t
               : n.op == Op::state ? x[std::size_t(n.index)]
               : n.op == Op::param ? p[std::size_t(n.index)]
               : n.op == Op::call  ? called(n, t, x, p)
                                   : value_of(n, arg);
    }
    double called(const Node& n, double t, std::span<const double> x,
                  std::span<const double> p) const {
        const External& f = *functions_[std::size_t(n.value)];
        auto out = detail::unwritten<double>(f.outputs);
        evaluate(f, t, x.data(), p.data(), out.data());
        return out[std::size_t(n.index)];
    }
    /// The derivative of an external function by a leaf is another one.
    int partial_of(int function, Expr leaf) {
        const Node n = (*this)[leaf];
        const auto f = functions_[std::size_t(function)];
        const int input = n.op == Op::time    ? 0
                          : n.op == Op::state ? 1 + n.index
                                              : 1 + f->dim + n.index;
        const auto [found, is_new] = partials_.try_emplace({function, input}, -1);
        if (is_new)
            found->second = add_function(partial(f, input));
        return found->second;
    }
    static double value_of(const Node& n, const std::array<double, 3>& v) {
        switch (n.op) {
        case Op::constant:
            return n.value;
        case Op::add:
            return v[0] + v[1];
        case Op::sub:
            return v[0] - v[1];
        case Op::mul:
            return v[0] * v[1];
        case Op::div:
            return v[0] / v[1];
        case Op::pow:
            return std::pow(v[0], v[1]);
        case Op::neg:
            return -v[0];
        case Op::powi:
            return std::pow(v[0], n.index);
        case Op::sqrt:
            return std::sqrt(v[0]);
        case Op::exp:
            return std::exp(v[0]);
        case Op::log:
            return std::log(v[0]);
        case Op::sin:
            return std::sin(v[0]);
        case Op::cos:
            return std::cos(v[0]);
        case Op::tan:
            return std::tan(v[0]);
        case Op::asin:
            return std::asin(v[0]);
        case Op::atan:
            return std::atan(v[0]);
        case Op::sinh:
            return std::sinh(v[0]);
        case Op::cosh:
            return std::cosh(v[0]);
        case Op::tanh:
            return std::tanh(v[0]);
        case Op::magnitude:
            return std::abs(v[0]);
        case Op::sign:
            return v[0] > 0 ? 1 : v[0] < 0 ? -1 : v[0]; // NaN stays
        case Op::where:
            return v[0] > 0.5 ? v[1] : v[2];
        case Op::unit2:
            return v[std::size_t(n.index)] / std::hypot(v[0], v[1]);
        case Op::unit3:
            return v[std::size_t(n.index)] / std::hypot(v[0], v[1], v[2]);
        default:
            return std::numeric_limits<double>::quiet_NaN();
        }
    }
    /// @param d  derivatives of its operands
    Expr derivative_of(Expr e, Expr leaf, std::span<const Expr> d) {
        const Node n = (*this)[e];
        const Expr a = n.arg[0], b = n.arg[1];
        const Expr one = constant(1);
        const auto inner = [&](Expr slope) { return mul(slope, d[0]); };
        switch (n.op) {
        case Op::constant:
        case Op::time:
        case Op::state:
        case Op::param:
            return constant(e == leaf ? 1 : 0);
        case Op::call:
            return call(partial_of(int(n.value), leaf), n.index);
        case Op::add:
            return add(d[0], d[1]);
        case Op::sub:
            return sub(d[0], d[1]);
        case Op::neg:
            return neg(d[0]);
        case Op::mul:
            return add(mul(d[0], b), mul(a, d[1]));
        case Op::div: // (a' - (a/b) b')/b
            return div(sub(d[0], mul(e, d[1])), b);
        case Op::pow: { // b a^(b-1) a' + a^b log(a) b'
            const Expr by_base = mul(mul(b, pow(a, sub(b, one))), d[0]);
            return is_constant(d[1], 0) ? by_base
                                        : add(by_base, mul(mul(e, unary(Op::log, a)), d[1]));
        }
        case Op::powi:
            return inner(mul(constant(n.index), pow(a, constant(n.index - 1))));
        case Op::sqrt:
            return div(d[0], mul(constant(2), e));
        case Op::exp:
            return inner(e);
        case Op::log:
            return div(d[0], a);
        case Op::sin:
            return inner(unary(Op::cos, a));
        case Op::cos:
            return neg(inner(unary(Op::sin, a)));
        case Op::tan:
            return inner(add(one, mul(e, e)));
        case Op::asin:
            return div(d[0], unary(Op::sqrt, sub(one, mul(a, a))));
        case Op::atan:
            return div(d[0], add(one, mul(a, a)));
        case Op::sinh:
            return inner(unary(Op::cosh, a));
        case Op::cosh:
            return inner(unary(Op::sinh, a));
        case Op::tanh:
            return inner(sub(one, mul(e, e)));
        case Op::magnitude:
            return inner(sign(a));
        case Op::sign:
            return constant(0);
        case Op::where:
            return where(a, d[1], d[2]);
        case Op::unit2:
        case Op::unit3: { // (a_k' - n_k n.a')/|a|, n the direction
            const std::vector<Expr> of = vector_of(e);
            Expr along = constant(0);
            for (std::size_t k = 0; k < of.size(); ++k)
                along = add(along, mul(unit(of, int(k)), d[k]));
            return div(sub(d[std::size_t(n.index)], mul(e, along)), length(of));
        }
        }
        throw std::logic_error("filippov: an operation without a derivative");
    }

    using Key = std::tuple<Op, std::array<Expr, 3>, int, double>;
    std::vector<Node> nodes_;
    std::vector<bool> varies_, switches_, has_params_, may_jump_, positive_, not_negative_;
    std::vector<ValueRange> range_;  ///< that no value is outside of
    std::map<Expr, bool> magnitude_; ///< what is_magnitude has found
    std::map<Key, Expr> known_;
    std::vector<std::shared_ptr<const External>> functions_;
    std::map<std::pair<int, int>, int> partials_; ///< by function and input
};

} // namespace filippov
