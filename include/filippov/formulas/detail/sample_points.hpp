// SPDX-License-Identifier: BSD-3-Clause
// Points at which formulas are compared: anywhere, and on a surface.
#pragma once

#include <filippov/formulas/expression.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace filippov::detail {

/// Points at which expressions are compared: draws of parameters, each with some draws of time and
/// state. Nothing is known of the scale of a system, so they have many.
class Samples {
public:
    struct Point {
        double t;
        std::vector<double> x, p;
    };
    using Draw = std::vector<Point>; ///< of the same parameters

    Samples(int dim, std::span<const double> defaults) {
        std::mt19937_64 random(20080131);
        std::normal_distribution<double> normal;
        std::uniform_real_distribution<double> uniform(0, 1);
        const auto draw = [&](std::vector<Draw>& to, const auto& size_of) {
            Draw drawn;
            std::vector<double> p;
            for (const double value : defaults)
                p.push_back(size_of(value));
            for (int k = 0; k < points; ++k) {
                const double size = std::pow(10.0, k % 3 - 1); // 0.1, 1, 10
                Point point{20 * uniform(random) - 10, {}, p};
                for (int j = 0; j < dim; ++j)
                    point.x.push_back(size * normal(random));
                drawn.push_back(std::move(point));
            }
            to.push_back(std::move(drawn));
        };
        for (int i = 0; i < draws; ++i)
            draw(near_, [&](double value) { // the first draw is what is given
                return i == 0       ? value
                       : value == 0 ? 0.3 * normal(random)
                                    : value * (1 + 0.2 * (2 * uniform(random) - 1));
            });
        // What is tiny as given may be large another time: sizes around 1, then around the given.
        for (int i = 0; i < draws; ++i)
            draw(wide_, [&](double value) {
                const double factor = std::pow(10.0, 2 * uniform(random) - 1);
                return value == 0   ? factor * normal(random)
                       : i % 2 == 0 ? std::copysign(factor, value)
                                    : 10 * factor * value;
            });
    }
    /// Those whose parameters are the given ones, or near them.
    std::span<const Draw> near() const { return near_; }
    /// Others whose parameters are far from the given ones. Not everything has a value there.
    std::span<const Draw> wide() const { return wide_; }

    inline void look_where_functions_bend(Graph& graph, std::span<const Expr> formulas);

private:
    static constexpr int draws = 4, points = 12;
    std::vector<Draw> near_, wide_;
};

/// A point on h = 0 to rounding, two beside it, a hundred thousand times as far off, and the one
/// that the search began at.
struct OnSurface {
    Samples::Point at;
    std::array<Samples::Point, 2> beside;
    Samples::Point from;
};

/// Newton onto h = 0 along its gradient, or in time where there is none.
inline std::optional<OnSurface> put_on(const Graph& graph, Expr h, std::span<const Expr> gradient,
                                       Expr h_t, Samples::Point point) {
    const auto value = [&graph](Expr e, const Samples::Point& at) {
        return graph.value(e, at.t, at.x, at.p);
    };
    const Samples::Point from = point;
    for (int k = 0; k < 50; ++k) {
        const double off = value(h, point), rate = value(h_t, point);
        std::vector<double> g;
        double norm = 0, rounding = 0;
        for (const Expr e : gradient) {
            g.push_back(value(e, point));
            norm += g.back() * g.back();
            rounding += std::abs(g.back()) * (1 + std::abs(point.x[g.size() - 1]));
        }
        rounding += std::abs(rate) * (1 + std::abs(point.t));
        if (!std::isfinite(off) || !(norm + std::abs(rate) > 0))
            return std::nullopt;
        const auto moved = [&](double change) {
            Samples::Point there = point;
            for (std::size_t i = 0; norm > 0 && i < g.size(); ++i)
                there.x[i] += change * g[i] / norm;
            if (!(norm > 0))
                there.t += change / rate;
            return there;
        };
        if (std::abs(off) <= 1e-14 * rounding)
            return OnSurface{point, {moved(-1e-9 * rounding), moved(1e-9 * rounding)}, from};
        point = moved(-off);
    }
    return std::nullopt;
}

/// Points on h = 0, one from each start that leads there. The graph gets the derivatives of h.
inline std::vector<OnSurface> points_on(Graph& graph, Expr h,
                                        std::span<const Samples::Point> starts) {
    std::vector<Expr> gradient;
    for (std::size_t i = 0; i < starts[0].x.size(); ++i)
        gradient.push_back(graph.derivative(h, graph.state(int(i))));
    const Expr h_t = graph.derivative(h, graph.time());
    std::vector<OnSurface> points;
    for (const Samples::Point& start : starts)
        if (auto found = put_on(graph, h, gradient, h_t, start))
            points.push_back(std::move(*found));
    return points;
}

/// What formulas take functions of that are not linear, from the leaves up: where these are about
/// zero the functions bend.
inline std::vector<Expr> arguments_of_functions(const Graph& graph,
                                                std::span<const Expr> formulas) {
    std::vector<Expr> found;
    for (const Expr e : graph.below(formulas)) {
        const Graph::Node& n = graph[e];
        if (n.op <= Op::sub || n.op == Op::neg || n.op == Op::where)
            continue;
        const auto varies = [&](Expr a) { return a >= 0 && graph.varies(a); };
        if (n.op == Op::mul && !(varies(n.arg[0]) && varies(n.arg[1])))
            continue;
        for (const Expr a : n.arg)
            if (varies(a) && graph[a].op != Op::time && graph[a].op != Op::state &&
                !graph.switches(a) && std::ranges::find(found, a) == found.end())
                found.push_back(a);
    }
    return found;
}

/// Adds points where the formulas' functions bend: the argument of a pulse, or of a tanh far from
/// the origin, is about zero nowhere else, and what it multiplies looks constant. Of many arguments
/// the first count, which the others are made of.
inline void Samples::look_where_functions_bend(Graph& graph, std::span<const Expr> formulas) {
    constexpr std::size_t most = 24;
    constexpr std::array<double, 6> levels{0, 0.5, -0.5, -0.5, 0, 0.5}; // three of the first draw
    std::vector<Expr> arguments = arguments_of_functions(graph, formulas);
    arguments.resize(std::min(arguments.size(), most));
    for (const Expr a : arguments)
        for (std::size_t k = 0; k < levels.size(); ++k) {
            Draw& draw = near_[k < 3 ? 0 : k - 2];
            const Expr off = graph.sub(a, graph.constant(levels[k]));
            for (OnSurface& found : points_on(graph, off, std::span(draw).subspan(k, 1)))
                draw.push_back(std::move(found.at));
        }
}

} // namespace filippov::detail
