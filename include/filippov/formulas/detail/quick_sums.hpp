// SPDX-License-Identifier: BSD-3-Clause
// Sums in the order in which a processor has their terms.
//
// From one stage of a step to the next everything waits for what depends on the state. A sum as it
// was written may make it wait for the slowest term first, and for a factor of the whole sum last:
// a third of the time of a field.
#pragma once

#include <filippov/formulas/expression.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace filippov::detail {

/// Writes outputs that are sums as fixed + c1 a1 + c2 a2 + ..., the latest term last; factors of
/// sums, which do not vary, are multiplied into those of the terms. What is made of given numbers
/// by sums and differences alone, as (x - y) - a, stays as it was written: its terms have no
/// rounding of their own, so it is exact where they are close, and zero where a body is at rest. So
/// rounding is that of a sum in another order.
class QuickSums {
public:
    QuickSums(Graph& graph, std::span<const Expr> outputs)
        : graph_(graph), uses_(graph.size(), 0), late_(graph.size(), never),
          given_(graph.size(), false) {
        for (const Expr e : outputs)
            ++uses_[std::size_t(e)];
        for (const Expr e : graph.below(outputs)) {
            const Graph::Node& n = graph[e];
            int late = n.op == Op::state || n.op == Op::call ? 0 : never;
            for (int k = 0; k < arity(n.op); ++k) {
                const auto j = std::size_t(n.arg[std::size_t(k)]);
                ++uses_[j];
                late = std::max(late, late_[j]);
            }
            late_[std::size_t(e)] = late == never ? never : late + cost(n.op);
            given_[std::size_t(e)] = is_given(e);
        }
    }

    /// An output, written anew.
    /// @param room  so many factors may be kept
    Expr operator()(Expr e, std::size_t room) {
        terms_.clear();
        fixed_ = graph_.constant(0);
        if (!gather(e, false, graph_.constant(1), true, 0) || terms_.size() >= room)
            return e;
        std::stable_sort(terms_.begin(), terms_.end(),
                         [](const Term& a, const Term& b) { return a.late < b.late; });
        Expr sum = fixed_;
        for (const Term& term : terms_)
            sum = term.negative ? graph_.sub(sum, term.of) : graph_.add(sum, term.of);
        return sum;
    }

private:
    static constexpr int never = -1000;
    static constexpr std::size_t most_terms = 16;
    static constexpr int deepest = 64;

    struct Term {
        bool negative;
        Expr of;
        int late;
    };

    /// Cycles, roughly.
    static int cost(Op op) {
        switch (op) {
        case Op::state:
        case Op::neg:
        case Op::magnitude:
            return 0;
        case Op::add:
        case Op::sub:
        case Op::mul:
        case Op::sign:
        case Op::where:
            return 4;
        case Op::div:
        case Op::powi:
            return 14;
        case Op::sqrt:
            return 20;
        default:
            return 50;
        }
    }
    /// True of what is made of given numbers by sums and differences alone; those below are known.
    bool is_given(Expr e) const {
        const Graph::Node& n = graph_[e];
        if (!graph_.varies(e) || n.op == Op::state || n.op == Op::time)
            return true;
        if (n.op != Op::add && n.op != Op::sub && n.op != Op::neg)
            return false;
        for (int k = 0; k < arity(n.op); ++k)
            if (!given_[std::size_t(n.arg[std::size_t(k)])])
                return false;
        return true;
    }
    bool has_reciprocal(Expr e) const {
        return graph_.is_constant(e) && std::isnormal(1 / graph_[e].value);
    }
    /// Collects the terms of factor * e.
    /// @return false if there are too many
    bool gather(Expr e, bool negative, Expr factor, bool alone, int depth) {
        const Graph::Node n = graph_[e]; // a copy: there will be new nodes
        const auto [a, b, none] = n.arg;
        if (depth++ > deepest)
            return false;
        if (!graph_.varies(e)) {
            const Expr term = graph_.mul(factor, e);
            fixed_ = negative ? graph_.sub(fixed_, term) : graph_.add(fixed_, term);
            return true;
        }
        if (!alone && uses_[std::size_t(e)] != 1)
            return put(e, negative, graph_.mul(factor, e));
        if (given_[std::size_t(e)])
            return put(e, negative, graph_.mul(factor, e));
        if (n.op == Op::add || n.op == Op::sub)
            return gather(a, negative, factor, false, depth) &&
                   gather(b, negative != (n.op == Op::sub), factor, false, depth);
        if (n.op == Op::neg)
            return gather(a, !negative, factor, false, depth);
        if (n.op == Op::mul && !graph_.varies(a))
            return gather(b, negative, graph_.mul(factor, a), false, depth);
        if (n.op == Op::mul && !graph_.varies(b))
            return gather(a, negative, graph_.mul(factor, b), false, depth);
        if (n.op == Op::div && has_reciprocal(b))
            return gather(a, negative, graph_.mul(factor, graph_.constant(1 / graph_[b].value)),
                          false, depth);
        if (n.op == Op::div && !graph_.varies(a))
            return put(e, negative, graph_.div(graph_.mul(factor, a), b));
        return put(e, negative, graph_.mul(factor, e));
    }
    bool put(Expr late, bool negative, Expr of) {
        terms_.push_back({negative, of, late_[std::size_t(late)]});
        return terms_.size() <= most_terms;
    }

    Graph& graph_;
    std::vector<int> uses_;
    std::vector<int> late_;   ///< after the state is known, in cycles; never: before
    std::vector<bool> given_; ///< see is_given
    std::vector<Term> terms_;
    Expr fixed_ = -1; ///< what does not vary
};

} // namespace filippov::detail
