// SPDX-License-Identifier: BSD-3-Clause
// Formulas as sums of terms: two are compared without the rounding of what both have.
#pragma once

#include <filippov/formulas/expression.hpp>

#include <cstddef>
#include <utility>
#include <vector>

namespace filippov::detail {

/// A sum: factors and what they are of.
using Terms = std::vector<std::pair<double, Expr>>;

inline bool expand(Graph& graph, Expr e, double factor, Terms& to, int depth, int& steps) {
    constexpr std::size_t most = 256;
    const Graph::Node n = graph[e];
    const auto [a, b, none] = n.arg;
    if (to.size() >= most || depth-- == 0 || steps-- == 0)
        return false;
    if (n.op == Op::add || n.op == Op::sub)
        return expand(graph, a, factor, to, depth, steps) &&
               expand(graph, b, n.op == Op::add ? factor : -factor, to, depth, steps);
    if (n.op == Op::neg)
        return expand(graph, a, -factor, to, depth, steps);
    if (n.op != Op::mul && n.op != Op::div) {
        to.emplace_back(factor, e);
        return true;
    }
    Terms first, second;
    if (!expand(graph, a, 1, first, depth, steps))
        return false;
    if (n.op == Op::div)
        second.emplace_back(1, b);
    else if (!expand(graph, b, 1, second, depth, steps))
        return false;
    if (to.size() + first.size() * second.size() > most)
        return false;
    for (const auto& [c, u] : first)
        for (const auto& [d, v] : second) {
            double size = c * d * factor;
            Expr product = n.op == Op::mul ? graph.mul(u, v) : graph.div(u, v);
            for (bool more = true; more;) { // constants and signs out of it
                const Graph::Node p = graph[product];
                more = false;
                if (p.op == Op::neg) {
                    size = -size;
                    product = p.arg[0];
                    more = true;
                } else if (p.op == Op::mul && graph.is_constant(p.arg[0])) {
                    size *= graph[p.arg[0]].value;
                    product = p.arg[1];
                    more = true;
                }
            }
            to.emplace_back(size, product);
        }
    return true;
}

/// An expression as a sum, with products and quotients of sums multiplied out.
/// @return  false if it is too long, or what it consists of is: its parts may share theirs
inline bool expand(Graph& graph, Expr e, double factor, Terms& to) {
    int steps = 10'000;
    return expand(graph, e, factor, to, 256, steps);
}

} // namespace filippov::detail
