// SPDX-License-Identifier: BSD-3-Clause
// Formulas with something else in place of their switches: smooth functions, or blend variables.
#pragma once

#include <filippov/formulas/expression.hpp>
#include <filippov/formulas/split.hpp>
#include <filippov/system/smooth_law.hpp>

#include <algorithm>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace filippov {

/// An expression with `other(u)` for each sign(u) that changes with time or state.
///
/// |u|, which is u sign(u), stays what it is: smoothing and time stepping want the true magnitude
/// of what switches. A choice between two expressions becomes their blend.
template <class F> Expr replace_switches(Graph& graph, Expr e, const F& other) {
    // u sign(u), in whatever way |u| and a multiple of it were written
    const auto sign_of = [&](Expr s, Expr u) {
        if (!graph.varies(u) || !graph.switches(s))
            return 0;
        if (graph[s].op == Op::sign && graph[s].arg[0] == u)
            return 1;
        if (graph.switches(u))
            return 0;
        return graph.unary(Op::sign, u) == s              ? 1
               : graph.unary(Op::sign, graph.neg(u)) == s ? -1
                                                          : 0;
    };
    const auto magnitude = [&](int sign, Expr u) {
        const Expr size = graph.unary(Op::magnitude, u);
        return sign > 0 ? size : graph.neg(size);
    };
    return graph.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
        const Graph::Node n = graph[i];
        if (n.op == Op::sign && graph.varies(n.arg[0]))
            return other(arg[0]);
        if (n.op == Op::mul)
            for (const std::size_t k : {0u, 1u})
                if (const int sign = sign_of(n.arg[k], n.arg[1 - k]); sign != 0)
                    return magnitude(sign, arg[1 - k]);
        if (n.op == Op::where && graph.varies(n.arg[0]))
            return graph.add(arg[2], graph.mul(arg[0], graph.sub(arg[1], arg[2])));
        return graph.with_args(i, arg);
    });
}

/// s(u) as a formula.
inline Expr smooth_sign(Graph& graph, SmoothLaw law, Expr u) {
    const Expr one = graph.constant(1);
    switch (law) {
    case SmoothLaw::arctan:
        return graph.mul(graph.constant(2 / std::numbers::pi), graph.unary(Op::atan, u));
    case SmoothLaw::tanh:
        return graph.unary(Op::tanh, u);
    default: // (|u + 1| - |u - 1|)/2, whose corners are kinks
        return graph.mul(graph.constant(0.5),
                         graph.sub(graph.abs(graph.add(u, one)), graph.abs(graph.sub(u, one))));
    }
}

/// A right-hand side whose switches are smooth, and what they are functions of.
struct SmoothFormulas {
    std::vector<Expr> field;
    std::vector<Expr> argument; ///< u of each s(c1 u), each once
};
/// @param c1  steepness, an expression of the parameters
inline SmoothFormulas smooth_formulas(Graph& graph, std::span<const Expr> field, SmoothLaw law,
                                      Expr c1) {
    SmoothFormulas smooth;
    std::vector<std::pair<Expr, Expr>> made; // arguments, and c1 times them
    for (const Expr e : field)
        smooth.field.push_back(replace_switches(graph, e, [&](Expr u) {
            const Expr steep = graph.mul(c1, u);
            if (std::find(made.begin(), made.end(), std::pair(u, steep)) == made.end())
                made.emplace_back(u, steep);
            return smooth_sign(graph, law, steep);
        }));
    // The sign in a magnitude has vanished with it.
    const std::vector<Expr> used = graph.below(smooth.field);
    for (const auto& [u, steep] : made)
        if (std::binary_search(used.begin(), used.end(), steep))
            smooth.argument.push_back(u);
    return smooth;
}

namespace detail {

/// True if a switch is inside the argument of another.
inline bool nests_switches(const Graph& graph, std::span<const Expr> field) {
    for (const Expr e : graph.below(field)) {
        if (graph[e].op != Op::sign || !graph.varies(graph[e].arg[0]))
            continue;
        for (const Expr i : graph.below(graph[e].arg[0]))
            if (graph[i].op == Op::sign && graph.varies(graph[i].arg[0]))
                return true;
    }
    return false;
}
/// The fields of all regions, blended: each region's share is the product of (1 +- s_j)/2.
inline std::vector<Expr> blend_regions(Definition& d, std::span<const Expr> sign) {
    Graph& graph = d.graph;
    const Expr half = graph.constant(0.5), one = graph.constant(1);
    std::vector<std::vector<Expr>> blend = d.region;
    for (std::size_t j = sign.size(); j-- > 0;) {
        const Expr above = graph.mul(half, graph.add(one, sign[j]));
        const std::size_t n = blend.size() / 2; // bit j is the highest that is left
        for (std::size_t code = 0; code < n; ++code)
            for (std::size_t i = 0; i < blend[code].size(); ++i) {
                const Expr low = blend[code][i], high = blend[code + n][i];
                blend[code][i] = graph.add(low, graph.mul(above, graph.sub(high, low)));
            }
        blend.resize(n);
    }
    return blend[0];
}

} // namespace detail

/// A right-hand side with a parameter for the blend variable of each switching surface; s_j is
/// parameter `first` + j. Where switches are nested the regions are blended, and have to exist on
/// both sides of their surfaces.
/// @param d  what the right-hand side was split into
inline std::vector<Expr> blend_formulas(Definition& d, std::span<const Expr> field, int first) {
    Graph& graph = d.graph;
    if (detail::nests_switches(graph, field)) {
        std::vector<Expr> sign;
        for (std::size_t j = 0; j < d.h.size(); ++j)
            sign.push_back(d.kind[j] == SurfaceKind::switching ? graph.param(first + int(j))
                                                               : graph.unary(Op::sign, d.h[j]));
        return detail::blend_regions(d, sign);
    }
    detail::Splitter splitter(graph, d.dim, d.defaults);
    for (const Expr h : d.h)
        splitter.add_surface(h);
    std::vector<Expr> blend;
    for (const Expr e : field)
        blend.push_back(replace_switches(graph, e, [&](Expr u) {
            const auto side = splitter.side_of(u);
            const auto j = std::size_t(side.surface);
            if (j >= d.h.size() || d.kind[j] != SurfaceKind::switching)
                return graph.unary(Op::sign, u);
            return graph.mul(side.orientation, graph.param(first + side.surface));
        }));
    return blend;
}

} // namespace filippov
