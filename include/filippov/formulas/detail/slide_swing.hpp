// SPDX-License-Identifier: BSD-3-Clause
// How soon s may turn along a slide in closed form, where formulas show it: s is a line and waves
// of one frequency.
#pragma once

#include <filippov/formulas/expression.hpp>

#include <algorithm>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

namespace filippov::detail {

/// Along a constant field x(t) = x0 + F t, what L1 and L2 are: linear in time, states, and in sin
/// and cos of what is linear in those.
class SlideWaves {
public:
    SlideWaves(Graph& graph, std::span<const Expr> field) : graph_(graph), field_(field) {}

    /// Half a period of the only frequency, of parameters alone; infinite where nothing oscillates.
    /// @return nothing if s = (L1 + L2)/(L1 - L2) may be another function of time
    std::optional<Expr> swing(Expr l1, Expr l2) {
        const std::vector<Expr> all = graph_.below(std::array{l1, l2});
        if (all.size() > most_nodes)
            return std::nullopt;
        for (const Expr e : all)
            if (auto form = form_of(e))
                forms_.emplace(e, std::move(*form));
        const auto a = forms_.find(l1), b = forms_.find(l2);
        // L1 - L2 has to stay what it is
        if (a == forms_.end() || b == forms_.end() || a->second.terms != b->second.terms)
            return std::nullopt;
        const auto rate = only_rate(a->second);
        if (!rate)
            return std::nullopt;
        return graph_.div(graph_.constant(std::numbers::pi), graph_.unary(Op::magnitude, *rate));
    }

private:
    /// Bounds of what is looked at: formulas may be strangers'.
    static constexpr std::size_t most_nodes = 1000, most_terms = 8;

    /// rest + sum of factor * of; rest and factors do not vary.
    struct Form {
        std::map<Expr, Expr> terms; ///< of, factor
        Expr rest;
    };

    bool is_leaf(Expr e) const { return graph_[e].op == Op::time || graph_[e].op == Op::state; }
    std::optional<Form> form_of(Expr e) {
        const Graph::Node n = graph_[e]; // a copy: there will be new nodes
        if (!graph_.varies(e))
            return Form{{}, e};
        if (is_leaf(e) || is_wave(n))
            return Form{{{e, graph_.constant(1)}}, graph_.constant(0)};
        switch (n.op) {
        case Op::neg:
            return each(n.arg[0], [&](Expr c) { return graph_.neg(c); });
        case Op::add:
        case Op::sub:
            return sum(n);
        case Op::mul: {
            const std::size_t fixed = graph_.varies(n.arg[0]) ? 1 : 0;
            if (graph_.varies(n.arg[fixed]))
                return std::nullopt;
            return each(n.arg[1 - fixed], [&](Expr c) { return graph_.mul(c, n.arg[fixed]); });
        }
        case Op::div:
            if (graph_.varies(n.arg[1]))
                return std::nullopt;
            return each(n.arg[0], [&](Expr c) { return graph_.div(c, n.arg[1]); });
        default:
            return std::nullopt;
        }
    }
    bool is_wave(const Graph::Node& n) const {
        if (n.op != Op::sin && n.op != Op::cos)
            return false;
        const auto of = forms_.find(n.arg[0]);
        return of != forms_.end() &&
               std::all_of(of->second.terms.begin(), of->second.terms.end(),
                           [&](const auto& term) { return is_leaf(term.first); });
    }
    template <class F> std::optional<Form> each(Expr e, F f) {
        const auto found = forms_.find(e);
        if (found == forms_.end())
            return std::nullopt;
        Form form = found->second;
        for (auto& [of, factor] : form.terms)
            factor = f(factor);
        form.rest = f(form.rest);
        return form;
    }
    std::optional<Form> sum(const Graph::Node& n) {
        const auto a = forms_.find(n.arg[0]), b = forms_.find(n.arg[1]);
        if (a == forms_.end() || b == forms_.end())
            return std::nullopt;
        const auto joined = [&](Expr c, Expr d) {
            return n.op == Op::add ? graph_.add(c, d) : graph_.sub(c, d);
        };
        Form form = a->second;
        for (const auto& [of, factor] : b->second.terms)
            form.terms[of] =
                joined(form.terms.try_emplace(of, graph_.constant(0)).first->second, factor);
        form.rest = joined(form.rest, b->second.rest);
        if (form.terms.size() > most_terms)
            return std::nullopt;
        return form;
    }
    /// What all waves of a form turn at; 0 if there is none.
    std::optional<Expr> only_rate(const Form& form) {
        const Expr none = graph_.constant(0);
        Expr only = none;
        for (const auto& [of, factor] : form.terms) {
            const Expr rate = is_leaf(of) ? none : rate_of(graph_[of].arg[0]);
            if (only == none)
                only = rate;
            else if (rate != none && rate != only && rate != graph_.neg(only))
                return std::nullopt;
        }
        return only;
    }
    /// The derivative of a linear argument along the slide.
    Expr rate_of(Expr e) {
        Expr rate = graph_.constant(0);
        for (const auto& [of, factor] : forms_.at(e).terms) {
            const Graph::Node n = graph_[of];
            const Expr moves = n.op == Op::time ? graph_.constant(1) : field_[std::size_t(n.index)];
            rate = graph_.add(rate, graph_.mul(factor, moves));
        }
        return rate;
    }

    Graph& graph_;
    std::span<const Expr> field_; ///< of the slide, of parameters alone
    std::map<Expr, Form> forms_;  ///< of what has one
};

} // namespace filippov::detail
