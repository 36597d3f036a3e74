// SPDX-License-Identifier: BSD-3-Clause
// Takes a right-hand side apart in which something switches: into switching functions, and a smooth
// field on every side of them.
#pragma once

#include <filippov/formulas/detail/directions.hpp>
#include <filippov/formulas/detail/sample_points.hpp>
#include <filippov/formulas/detail/terms.hpp>
#include <filippov/system/system.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <optional>
#include <set>

namespace filippov {

/// A system as formulas.
struct Definition {
    Graph graph;
    int dim = 0;
    std::vector<std::string> state_names, param_names;
    std::vector<double> defaults; ///< of the parameters
    // one entry a surface
    std::vector<Expr> h;
    std::vector<SurfaceKind> kind;
    std::vector<std::vector<Expr>> jump; ///< the state after a jump; empty of other kinds
    /// One entry a region: bit j of its number is set where h_j > 0. Entry k of all directions is
    /// state(dim + k).
    std::vector<std::vector<Expr>> region;
    Expr period = -1; ///< -1: none
    /// What changes over a distance of about 1: the arguments of smoothed switches, times their
    /// steepness.
    std::vector<Expr> layer;

    int surfaces() const { return int(h.size()); }
    bool has_directions() const {
        return std::ranges::find(kind, SurfaceKind::direction) != kind.end();
    }
};

/// Surfaces that are split along, at most: there are 2^n regions.
inline constexpr int most_split_surfaces = 8;

namespace detail {

class Splitter {
public:
    Splitter(Graph& graph, int dim, std::span<const double> defaults)
        : graph_(graph), samples_(dim, defaults) {}

    /// Has formulas compared where their functions bend, too.
    void look_closely_at(std::span<const Expr> formulas) {
        samples_.look_where_functions_bend(scratch(), formulas);
    }

    /// Surfaces that are known already, each with its orientation.
    ///
    /// A factor of parameters alone is no surface of its own: h keeps it, and turns with its sign.
    /// What is no smooth function but has the sign of one, as cbrt(v), stands for that.
    /// @error std::invalid_argument for one that is several: sign(h) is a product of signs, or
    ///        switches itself; and for one that is a multiple of one before it
    void add_surface(Expr h) {
        const std::string name = "filippov: surface " + std::to_string(surfaces_.size());
        // sign(h) as the field has it: v exp(x) switches where v does
        const Expr s = graph_.unary(Op::sign, h);
        if (!graph_.varies(s))
            throw std::invalid_argument(name + " is none: its sign never changes");
        const auto [switched, factor] = without_params(s); // the factor is 1, or 0
        if (switched < 0 || !is_plain(graph_[switched].arg[0]))
            throw std::invalid_argument(
                name + " consists of several, where its factors or parts change sign; name those, "
                       "or leave them to be found in one right-hand side that switches by it");
        const Expr argument = graph_[switched].arg[0];
        const bool stands_for = has_switch(h) && argument != h;
        if (stands_for)
            h = argument;
        for (std::size_t j = 0; j < surfaces_.size(); ++j)
            if (proportion(h, surfaces_[j]))
                throw std::invalid_argument(name + " is surface " + std::to_string(j) +
                                            " again, up to a factor");
        const auto j = int(surfaces_.size());
        one_more(h);
        const Expr one = graph_.constant(1);
        know(argument, {j, stands_for ? one : factor});
        if (switched != s) // h is zero everywhere where the factor is, if it has that
            products_.try_emplace(s, Side{j, stands_for ? factor : one});
    }
    std::span<const Expr> surfaces() const { return surfaces_; }

    /// Finds every surface that the expressions switch on.
    /// @error std::invalid_argument for too many of them
    void discover(std::span<const Expr> all) { explore(all, {}); }

    /// The surface that an argument of `sign` belongs to: sign(u) = orientation sign(h).
    struct Side {
        int surface;
        Expr orientation; ///< 1, -1, or the sign of something of the parameters
    };
    /// @error std::invalid_argument if it is one surface too many
    Side side_of(Expr u) {
        if (const auto found = known_.find(u); found != known_.end())
            return found->second;
        // what only its sign tells from one that is known, which may depend on parameters
        const auto [plain, turn] = graph_.turned(u);
        if (const auto found = known_.find(plain); found != known_.end())
            return known_[u] = {found->second.surface, graph_.mul(turn, found->second.orientation)};
        for (std::size_t j = 0; j < surfaces_.size(); ++j) {
            const auto [h, turn_of_h] = graph_.turned(surfaces_[j]);
            if (const auto orientation = proportion(plain, h))
                return know(u, {int(j), graph_.mul(turn, graph_.mul(*orientation, turn_of_h))});
        }
        one_more(u);
        return know(u, {int(surfaces_.size()) - 1, graph_.constant(1)});
    }

    /// An expression on the given sides of all surfaces.
    Expr on_sides(Expr e, std::span<const int> side) { return restricted(e, side); }

    std::vector<OnSurface> points_on(Expr h) {
        std::vector<OnSurface> points;
        for (const Samples::Draw& draw : samples_.near())
            std::ranges::move(detail::points_on(graph_, h, draw), std::back_inserter(points));
        return points;
    }
    /// Surfaces other than j that have one sign all along surface j, as x - 1 on x + 1 = 0.
    std::vector<std::size_t> of_one_sign(std::size_t j, std::span<const OnSurface> points) const {
        std::vector<std::size_t> found;
        for (std::size_t k = 0; k < surfaces_.size(); ++k)
            if (k != j && is_constant_on(points, surfaces_[k]))
                found.push_back(k);
        return found;
    }
    /// Those of the points that a region can have, by the signs of these surfaces.
    /// @param code  bit k: h_k > 0 in the region
    std::vector<OnSurface> within(unsigned code, std::span<const std::size_t> surfaces,
                                  std::vector<OnSurface> points) const {
        for (const std::size_t k : surfaces)
            std::erase_if(points, [&](const OnSurface& point) {
                const double h = value(surfaces_[k], point.at);
                return (code >> k & 1) != 0 ? h < 0 : h > 0;
            });
        return points;
    }
    /// True if what is computed on both sides of a surface is equal on it: no further apart than
    /// rounding of the values, or of the point. Where no point tells, no.
    bool continuous(std::span<const OnSurface> points, std::span<const Expr> f,
                    std::span<const Expr> g) {
        for (std::size_t i = 0; i < f.size(); ++i) {
            if (f[i] == g[i])
                continue;
            const auto whole = differs(points, {{1, f[i]}, {-1, g[i]}}, graph_, false);
            const auto part = differs_in_part(points, f[i], g[i]);
            if (whole.value_or(false) || part.value_or(!whole))
                return false;
        }
        return true;
    }

private:
    static constexpr int unknown = 0;
    static constexpr double noise = 64 * epsilon<double>;

    /// Whether a difference is not zero on a surface; none where it has no value, or is zero far
    /// off the surface as well: there it tells nothing.
    /// @param bounded  of terms whose errors may be larger than rounding of their values
    static std::optional<bool> differs(std::span<const OnSurface> points, const Terms& difference,
                                       const Graph& graph, bool bounded) {
        const auto sum = [&](const Samples::Point& at) {
            Graph::Rounded total;
            for (const auto& [factor, e] : difference) {
                const auto [value, error] = graph.rounded(e, at.t, at.x, at.p);
                total.value += factor * value;
                total.error +=
                    std::abs(factor) * (noise * std::abs(value) + (bounded ? 4 * error : 0));
            }
            return total;
        };
        bool known = false;
        for (const OnSurface& point : points) {
            const auto [value, error] = sum(point.at);
            if (!std::isfinite(value) || std::isnan(error))
                continue;
            // of a kink it is proportional to the distance at most
            double beside = 0;
            for (const Samples::Point& near : point.beside)
                if (const double d = std::abs(sum(near).value); std::isfinite(d))
                    beside = std::max(beside, d);
            known = known || sum(point.from).value != 0;
            if (!(std::abs(value) <= 1e-3 * beside + error))
                return true;
        }
        return known ? std::optional(false) : std::nullopt;
    }
    /// The same of what is left when the terms that both have are taken away, if something is: a
    /// jump by 1e-18 does not vanish in the rounding of what it is added to.
    std::optional<bool> differs_in_part(std::span<const OnSurface> points, Expr f, Expr g) {
        Graph& graph = scratch();
        Terms terms;
        if (!expand(graph, f, 1, terms) || !expand(graph, g, -1, terms))
            return std::nullopt;
        std::map<Expr, std::pair<double, double>> sum; // factors, and their sizes
        for (const auto& [factor, e] : terms) {
            sum[e].first += factor;
            sum[e].second += std::abs(factor);
        }
        Terms rest;
        for (const auto& [e, factor] : sum)
            if (std::abs(factor.first) > noise * factor.second)
                rest.emplace_back(factor.first, e);
        if (rest.empty() || rest.size() == terms.size())
            return std::nullopt;
        return differs(points, rest, graph, true);
    }
    /// The one factor of a product of signs that varies, and the others; -1 if several vary.
    std::pair<Expr, Expr> without_params(Expr product) {
        const Graph::Node n = graph_[product];
        if (n.op == Op::sign)
            return {product, graph_.constant(1)};
        if (n.op != Op::mul)
            return {-1, -1};
        for (const auto& [e, rest] : {std::pair(n.arg[0], n.arg[1]), std::pair(n.arg[1], n.arg[0])})
            if (graph_.varies(e) && !graph_.varies(rest)) {
                const auto [switched, others] = without_params(e);
                return {switched, switched < 0 ? -1 : graph_.mul(rest, others)};
            }
        return {-1, -1};
    }

    /// Keeps where an argument belongs, and what is the same but for its sign.
    Side know(Expr u, Side side) {
        const auto [plain, turn] = graph_.turned(u); // turn^2 = 1
        known_.try_emplace(plain, Side{side.surface, graph_.mul(turn, side.orientation)});
        return known_.try_emplace(u, side).first->second;
    }
    void one_more(Expr h) {
        if (surfaces_.size() == most_split_surfaces)
            throw std::invalid_argument("filippov: the field switches on more than " +
                                        std::to_string(most_split_surfaces) + " surfaces");
        surfaces_.push_back(h);
    }

    void explore(std::span<const Expr> all, std::vector<int> side) {
        side.resize(surfaces_.size(), unknown);
        std::vector<Expr> rest;
        Expr first = -1;
        for (const Expr e : all) {
            rest.push_back(restricted(e, side));
            const Expr found = first_switch(rest.back());
            first = first < 0 || (found >= 0 && found < first) ? found : first;
        }
        if (first < 0)
            return;
        const std::size_t j = std::size_t(side_of(graph_[first].arg[0]).surface);
        side.resize(surfaces_.size(), unknown);
        for (const int s : {-1, 1}) {
            side[j] = s;
            explore(rest, side);
        }
    }
    /// The first switch in an expression whose argument is plain; -1: none. Those inside a smooth
    /// argument are parts of that.
    Expr first_switch(Expr e) {
        Expr first = -1;
        std::vector<Expr> ahead{e};
        for (std::set<Expr> seen; !ahead.empty();) {
            const Expr i = ahead.back();
            ahead.pop_back();
            if (!graph_.switches(i) || !seen.insert(i).second)
                continue;
            if (is_plain_switch(i))
                first = first < 0 ? i : std::min(first, i);
            else
                for (int k = 0; k < arity(graph_[i].op); ++k)
                    ahead.push_back(graph_[i].arg[std::size_t(k)]);
        }
        return first;
    }
    /// A switch whose argument does not switch itself, or does so smoothly.
    bool is_plain_switch(Expr e) {
        return graph_[e].op == Op::sign && graph_.varies(graph_[e].arg[0]) &&
               is_plain(graph_[e].arg[0]);
    }
    bool is_plain(Expr u) { return !has_switch(u) || is_smooth(u); }
    /// True of what switches and is smooth all the same, as v |v| or |v|^1.5 sign(v): it and its
    /// derivatives are the same on both sides of each of its switches. Of a root like |v|^0.5
    /// sign(v) derivatives are not; but neither side has values beyond, and it is continuous.
    bool is_smooth(Expr u) {
        if (const auto found = smooth_.find(u); found != smooth_.end())
            return found->second;
        bool smooth = true;
        for (const Expr i : graph_.below(u))
            if (graph_[i].op == Op::sign && graph_.varies(graph_[i].arg[0]))
                smooth = smooth && !has_switch(graph_[i].arg[0]) &&
                         is_smooth_across(u, graph_[i].arg[0]);
        return smooth_[u] = smooth;
    }
    bool is_smooth_across(Expr u, Expr v) {
        const auto on_side = [&](int side) {
            return graph_.rewrite(u, [&](Expr i, std::span<const Expr> arg) {
                if (graph_[i].op == Op::sign && graph_.varies(arg[0])) {
                    const auto [plain, turn] = graph_.turned(arg[0]);
                    const auto [wanted, other] = graph_.turned(v);
                    if (plain == wanted) {
                        const Expr one = graph_.mul(turn, other);
                        return side > 0 ? one : graph_.neg(one);
                    }
                }
                return graph_.with_args(i, arg);
            });
        };
        const std::vector<Expr> below{on_side(-1)}, above{on_side(+1)};
        const std::vector<OnSurface> points = points_on(v);
        if (points.empty() || !continuous(points, below, above))
            return false;
        const auto slopes = [&](Expr e) {
            std::vector<Expr> all{graph_.derivative(e, graph_.time())};
            for (std::size_t k = 0; k < points[0].at.x.size(); ++k)
                all.push_back(graph_.derivative(e, graph_.state(int(k))));
            return all;
        };
        const auto ends = [&](Expr e) {
            return std::ranges::all_of(points, [&](const OnSurface& point) {
                return std::ranges::any_of(point.beside, [&](const Samples::Point& near) {
                    return !std::isfinite(value(e, near));
                });
            });
        };
        return continuous(points, slopes(below[0]), slopes(above[0])) ||
               (ends(below[0]) && ends(above[0]));
    }
    bool has_switch(Expr e) const {
        if (!graph_.switches(e))
            return false;
        for (const Expr i : graph_.below(e))
            if (graph_[i].op == Op::sign && graph_.varies(graph_[i].arg[0]))
                return true;
        return false;
    }
    Expr restricted(Expr e, std::span<const int> side) {
        if (!graph_.switches(e))
            return e;
        return graph_.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
            if (const auto product = products_.find(i); product != products_.end()) {
                const auto j = std::size_t(product->second.surface);
                if (j < side.size() && side[j] != unknown)
                    return side[j] > 0 ? product->second.orientation
                                       : graph_.neg(product->second.orientation);
            }
            // (what switches smoothly stays whole, whatever the sides of its parts)
            const bool whole = graph_[i].op == Op::sign && graph_.varies(graph_[i].arg[0]) &&
                               has_switch(graph_[i].arg[0]) && is_smooth(graph_[i].arg[0]);
            const Expr u = whole ? graph_[i].arg[0] : arg.empty() ? -1 : arg[0];
            if (graph_[i].op == Op::sign && graph_.varies(u) && is_plain(u)) {
                const Side found = side_of(u);
                const auto j = std::size_t(found.surface);
                if (j < side.size() && side[j] != unknown)
                    return side[j] > 0 ? found.orientation : graph_.neg(found.orientation);
            }
            return whole ? i : graph_.with_args(i, arg);
        });
    }

    /// The sign of u/h if that is the same at all times and states.
    ///
    /// Far from a surface x - 1 and x - 1 - d, with a tiny d, look the same. So parameters are
    /// taken of other sizes, too, and one is evaluated where the other is zero.
    std::optional<Expr> proportion(Expr u, Expr h) {
        if (u == h)
            return graph_.constant(1);
        double low = std::numeric_limits<double>::infinity(), high = -low;
        const Samples::Point* reference = nullptr;
        std::vector<Draw> seen;
        bool varies = false;
        for (const auto& [all, given] :
             {std::pair(samples_.near(), true), std::pair(samples_.wide(), false)})
            for (const Samples::Draw& points : all) {
                std::vector<Graph::Rounded> ratios;
                for (const auto& point : points) {
                    varies = varies || differ(h, points[0], point);
                    const Graph::Rounded ratio = quotient(u, h, point);
                    if (!std::isfinite(ratio.value) || !(relative(ratio) < 0.1))
                        continue;
                    ratios.push_back(ratio);
                    if (reference == nullptr)
                        reference = &point;
                }
                if (given && !ratios.empty() && ratios.size() < 3)
                    return std::nullopt;
                if (ratios.size() < 3)
                    continue;
                const Graph::Rounded best = *std::ranges::min_element(ratios, {}, relative);
                for (const auto& [ratio, error] : ratios)
                    if (!(std::abs(ratio - best.value) <=
                          1e-9 * std::abs(best.value) + 8 * (error + best.error)))
                        return std::nullopt;
                low = std::min(low, best.value);
                high = std::max(high, best.value);
                seen.push_back({points, best.value});
            }
        if (seen.empty() || !varies || !vanish_together(u, h, seen))
            return std::nullopt;
        refuse_neighbours(u, h);
        if (high - low <= 1e-9 * std::abs(low))
            return graph_.constant(low > 0 ? 1 : -1);
        const Expr ratio = graph_.div(at(u, *reference), at(h, *reference));
        return graph_.unary(Op::sign, ratio);
    }
    static double relative(const Graph::Rounded& v) { return v.error / std::abs(v.value); }
    struct Draw {
        std::span<const Samples::Point> points;
        double ratio;
    };
    Graph::Rounded quotient(Expr u, Expr h, const Samples::Point& at) const {
        const auto a = graph_.rounded(u, at.t, at.x, at.p), b = graph_.rounded(h, at.t, at.x, at.p);
        const double ratio = a.value / b.value;
        return {ratio, (a.error + std::abs(ratio) * b.error) / std::abs(b.value)};
    }
    /// True if h is not the same at two points, whatever its rounding. (All constants are
    /// proportional.)
    bool differ(Expr h, const Samples::Point& one, const Samples::Point& other) const {
        const auto a = graph_.rounded(h, one.t, one.x, one.p);
        const auto b = graph_.rounded(h, other.t, other.x, other.p);
        return std::abs(a.value - b.value) > 8 * (a.error + b.error);
    }
    /// True if u = ratio h, to rounding, also where h = 0.
    bool vanish_together(Expr u, Expr h, std::span<const Draw> draws) {
        Graph& graph = scratch();
        for (const Draw& draw : draws)
            for (const OnSurface& point : detail::points_on(graph, h, draw.points)) {
                const Samples::Point& at = point.at;
                const auto a = graph.rounded(u, at.t, at.x, at.p);
                const auto b = graph.rounded(h, at.t, at.x, at.p);
                const double error = a.error + std::abs(draw.ratio) * b.error;
                if (std::abs(a.value - draw.ratio * b.value) > 8 * error)
                    return false;
            }
        return true;
    }
    /// Refuses what is equal to rounding, but not as it was written: |v - 1| < 1e-16 is a band
    /// whose sides cannot be told apart, and what holds inside would be lost.
    void refuse_neighbours(Expr u, Expr h) {
        Graph& graph = scratch();
        std::array<Terms, 2> terms;
        if (!expand(graph, u, 1, terms[0]) || !expand(graph, h, 1, terms[1]))
            return;
        std::map<Expr, std::array<double, 2>> sums;
        std::array<std::vector<double>, 2> constants;
        for (const std::size_t k : {0u, 1u})
            for (const auto& [factor, e] : terms[k])
                if (graph.is_constant(e))
                    constants[k].push_back(factor * graph[e].value);
                else
                    sums[e][k] += factor;
        double ratio = 0;
        for (const auto& [e, sum] : sums) {
            ratio = ratio == 0 ? sum[0] / sum[1] : ratio;
            if (!(std::abs(sum[0] - ratio * sum[1]) <= 8 * epsilon<double> * std::abs(sum[0])))
                return; // written in another way
        }
        double common = 0; // the largest constant that both have
        for (const double c : constants[1])
            if (const auto same = std::ranges::find(constants[0], ratio * c);
                same != constants[0].end()) {
                common = std::max(common, std::abs(*same));
                constants[0].erase(same);
            } else {
                constants[0].push_back(-ratio * c);
            }
        double rest = 0, most = 0;
        for (const double c : constants[0]) {
            rest += c;
            most = std::max(most, std::abs(c));
        }
        if (rest == 0 || most >= noise * common)
            return;
        char text[160];
        std::snprintf(
            text, sizeof text,
            "filippov: two switching functions differ by %.3g alone, which is lost in the "
            "rounding of %.3g: leave that out, or make it larger",
            std::abs(rest), common);
        throw std::invalid_argument(text);
    }
    /// An expression of the parameters alone: time and state are those of a point.
    Expr at(Expr e, const Samples::Point& point) {
        return graph_.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
            const Graph::Node n = graph_[i];
            return n.op == Op::time    ? graph_.constant(point.t)
                   : n.op == Op::state ? graph_.constant(point.x[std::size_t(n.index)])
                                       : graph_.with_args(i, arg);
        });
    }
    double value(Expr e, const Samples::Point& at) const {
        return graph_.value(e, at.t, at.x, at.p);
    }
    /// True if it depends on nothing but parameters on a surface, by three points or more a draw.
    bool is_constant_on(std::span<const OnSurface> points, Expr e) const {
        std::map<std::vector<double>, std::vector<Graph::Rounded>> values; // by parameters
        for (const OnSurface& point : points)
            values[point.at.p].push_back(graph_.rounded(e, point.at.t, point.at.x, point.at.p));
        return !values.empty() && std::ranges::all_of(values, [](const auto& draw) {
            const std::vector<Graph::Rounded>& v = draw.second;
            return v.size() >= 3 && std::ranges::all_of(v, [&](const Graph::Rounded& other) {
                       const double rounding = 8 * (other.error + v[0].error);
                       return std::abs(other.value - v[0].value) <=
                                  1e-9 * std::abs(v[0].value) + rounding &&
                              (v[0].value == 0 || std::abs(v[0].value) > rounding);
                   });
        });
    }

    /// The graph with what is only looked at: derivatives of surfaces, sums multiplied out.
    Graph& scratch() {
        if (scratch_from_ != graph_.size()) {
            scratch_ = graph_;
            scratch_from_ = graph_.size();
        }
        return scratch_;
    }

    Graph& graph_;
    Graph scratch_;
    std::size_t scratch_from_ = 0;
    Samples samples_;
    std::vector<Expr> surfaces_;
    std::map<Expr, Side> known_;
    std::map<Expr, bool> smooth_;   ///< what `is_smooth` has found
    std::map<Expr, Side> products_; ///< signs that are products of one surface's and parameters'
};

} // namespace detail

/// Splits a right-hand side into regions.
///
/// Switching functions are the arguments of the switches; equal ones, up to a factor, are one
/// surface. A switch inside another's argument splits that one: sign(|x| - 1) has the surfaces x,
/// x - 1 and -x - 1; but where the argument is smooth, as x + v |v|, it is one surface. A surface
/// at which nothing changes is dropped; one at which the field is continuous is a kink.
///
/// The entries of directions come behind them, two or three surfaces each.
///
/// @param written  the right-hand side
/// @param named  surfaces that come first and have the orientation that they are given in
/// @error std::invalid_argument for too many surfaces, or for a named one at which nothing changes;
///        for a direction that has no law at rest, or that something switches by
inline void split(Definition& d, std::span<const Expr> written, std::span<const Expr> named = {}) {
    Graph& graph = d.graph;
    detail::DirectionFinder directions(graph, d.dim, d.defaults);
    const std::vector<Expr> field = directions.find(written);
    detail::Splitter splitter(graph, d.dim + directions.leaves(), d.defaults);
    std::vector<Expr> formulas(field.begin(), field.end());
    formulas.insert(formulas.end(), named.begin(), named.end());
    splitter.look_closely_at(formulas);
    for (const Expr h : named)
        splitter.add_surface(h);
    splitter.discover(field);
    for (const Expr h : splitter.surfaces())
        for (const Expr e : graph.below(h))
            if (directions.is_leaf(e) || is_unit(graph[e].op))
                throw std::invalid_argument("filippov: something switches by an entry of unit: "
                                            "write it by an entry of its vector");

    const auto region = [&](unsigned code, std::size_t n) {
        std::vector<int> side;
        for (std::size_t j = 0; j < n; ++j)
            side.push_back((code >> j) & 1 ? 1 : -1);
        std::vector<Expr> f;
        for (const Expr e : field)
            f.push_back(splitter.on_sides(e, side));
        return f;
    };
    const std::size_t n = splitter.surfaces().size();
    std::vector<std::vector<Expr>> all;
    for (unsigned code = 0; code < 1u << n; ++code)
        all.push_back(region(code, n));

    std::vector<std::size_t> kept;
    for (std::size_t j = 0; j < n; ++j) {
        bool changes = false, compared = false, jumps = false;
        std::vector<detail::OnSurface> points;
        std::vector<std::size_t> others;
        for (unsigned code = 0; code < 1u << n; ++code) {
            const auto& below = all[code];
            const auto& above = all[code | (1u << j)];
            if ((code >> j) & 1 || below == above)
                continue;
            if (!changes) {
                points = splitter.points_on(splitter.surfaces()[j]);
                others = splitter.of_one_sign(j, points);
            }
            changes = true;
            const auto here = splitter.within(code, others, points);
            if (here.empty() && !points.empty())
                continue; // no region of this kind touches the surface
            compared = true;
            jumps = jumps || !splitter.continuous(here, below, above);
        }
        if (!changes) {
            if (j < named.size())
                throw std::invalid_argument("filippov: nothing changes at surface " +
                                            std::to_string(j));
            continue;
        }
        kept.push_back(j);
        d.h.push_back(splitter.surfaces()[j]);
        d.kind.push_back(jumps || !compared ? SurfaceKind::switching : SurfaceKind::kink);
        d.jump.emplace_back();
    }
    for (unsigned code = 0; code < 1u << kept.size(); ++code) {
        unsigned full = 0;
        for (std::size_t k = 0; k < kept.size(); ++k)
            full |= ((code >> k) & 1) << kept[k];
        d.region.push_back(all[full]);
    }
    if (directions.all().empty())
        return;
    for (std::vector<Expr>& f : d.region) {
        for (Expr& e : f)
            e = directions.with_smooth_lengths(e);
        directions.require_linear(f);
    }
    for (const detail::Entries& a : directions.all())
        for (std::size_t k = 0; k < a.size(); ++k) {
            d.h.push_back(a[k]);
            d.kind.push_back(k == 0 ? SurfaceKind::direction : SurfaceKind::component);
            d.jump.emplace_back();
        }
}

/// Adds a surface at which nothing changes, for the event of crossing it.
/// @error std::invalid_argument if it is one too many
inline void watch(Definition& d, Expr h) {
    if (d.surfaces() == most_split_surfaces)
        throw std::invalid_argument("filippov: there are more than " +
                                    std::to_string(most_split_surfaces) + " surfaces");
    d.h.push_back(h);
    d.kind.push_back(SurfaceKind::kink);
    d.jump.emplace_back();
    const auto same = d.region;
    d.region.insert(d.region.end(), same.begin(), same.end());
}

} // namespace filippov
