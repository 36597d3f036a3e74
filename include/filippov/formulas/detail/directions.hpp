// SPDX-License-Identifier: BSD-3-Clause
// Directions a/|a| in formulas: those that are written so, and quotients that are the same.
#pragma once

#include <filippov/formulas/detail/sample_points.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace filippov::detail {

/// A vector of two or three expressions.
using Entries = std::vector<Expr>;

/// A formula p + q/|a|, where neither part has |a| below a line.
struct OverLength {
    Expr whole, part;
};

/// Finds the directions of a right-hand side, and gives each of their entries a leaf: entry k of
/// all is state(dim + k).
class DirectionFinder {
public:
    DirectionFinder(Graph& graph, int dim, std::span<const double> defaults)
        : graph_(graph), dim_(dim), samples_(dim, defaults) {}

    /// The field with a leaf for each entry of a direction.
    ///
    /// A quotient by the length of a vector, as vx/sqrt(vx^2 + vy^2), is a direction if the field
    /// pulls that vector to zero, as friction does. Else nothing ever comes there, and it stays
    /// what it is: the pull of a spring along its length, a rocket's thrust along its speed.
    /// @error std::invalid_argument for one that is none, with what to write instead
    std::vector<Expr> find(std::span<const Expr> field) {
        std::vector<Expr> f(field.begin(), field.end());
        std::vector<Entries> written;
        for (const Expr e : graph_.below(f))
            if (is_unit(graph_[e].op)) {
                written.push_back(graph_.vector_of(e));
                require_plain(written.back());
            }
        for (const Expr length : graph_.below(f)) {
            Entries a = roots_of_squares(length);
            if (a.empty())
                continue;
            bool is_known = false;
            for (const Entries& known : written)
                if (is_length(length, known)) {
                    a = known;
                    is_known = true;
                }
            const std::vector<Expr> moving = where_it_moves(f, length);
            const auto units = with_units(moving, a, length);
            if (!units.empty() && (is_known || pulls_to_zero(units, a)))
                f = units;
            else if (is_known)
                f = moving;
        }
        for (Expr& e : f)
            e = with_leaves(e);
        return f;
    }
    const std::vector<Entries>& all() const { return all_; }
    int leaves() const {
        std::size_t n = 0;
        for (const Entries& a : all_)
            n += a.size();
        return int(n);
    }
    bool is_leaf(Expr e) const { return graph_[e].op == Op::state && graph_[e].index >= dim_; }

    /// A region's formula with a.n for each length |a|: the same where it moves, and smooth at
    /// rest.
    Expr with_smooth_lengths(Expr e) {
        return graph_.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
            int leaf = dim_;
            for (const Entries& a : all_) {
                if (is_length(i, a))
                    return along(a, leaf);
                leaf += int(a.size());
            }
            return graph_.with_args(i, arg);
        });
    }
    /// Refuses a field that is not linear in a direction where that is at rest: it has no law
    /// there.
    void require_linear(std::span<const Expr> field) {
        int leaf = dim_;
        for (const Entries& a : all_) {
            for (const Samples::Point& rest : points_at_rest(a))
                for (const Expr e : field)
                    if (!is_linear(e, rest, leaf, int(a.size())))
                        throw std::invalid_argument(
                            "filippov: the field is not linear in unit where its vector is zero: "
                            "write it as a sum of entries of unit times factors, which may depend "
                            "on the length of that vector");
            leaf += int(a.size());
        }
    }

private:
    void require_plain(const Entries& a) const {
        for (const Expr e : a) {
            if (graph_.switches(e))
                throw std::invalid_argument(
                    "filippov: an entry of unit switches itself: write it without sign, abs, where "
                    "or another unit in it");
            if (!graph_.varies(e))
                throw std::invalid_argument(
                    "filippov: an entry of unit does not change with time or state: leave out what "
                    "is zero, and divide by the length of a vector that is never zero");
        }
    }

    // --- lengths ---------------------------------------------------------------------------------

    /// What is squared in a root of two or three squares and nothing else.
    Entries roots_of_squares(Expr length) const {
        if (graph_[length].op != Op::sqrt)
            return {};
        Entries roots;
        std::vector<Expr> rest{graph_[length].arg[0]};
        while (!rest.empty() && rest.size() + roots.size() <= 3) {
            const Graph::Node n = graph_[rest.back()];
            rest.pop_back();
            if (n.op == Op::add) {
                rest.push_back(n.arg[1]);
                rest.push_back(n.arg[0]);
            } else if (n.op == Op::mul && n.arg[0] == n.arg[1] && graph_.varies(n.arg[0]) &&
                       !graph_.switches(n.arg[0])) {
                roots.push_back(n.arg[0]);
            } else {
                return {};
            }
        }
        std::ranges::sort(roots);
        return rest.empty() && roots.size() >= 2 ? roots : Entries{};
    }
    /// True of |a|, whatever the order and the signs of its entries.
    bool is_length(Expr e, const Entries& a) {
        const Entries roots = roots_of_squares(e);
        const auto plain = [&](Entries v) {
            for (Expr& entry : v)
                entry = std::min(entry, graph_.neg(entry));
            std::ranges::sort(v);
            return v;
        };
        return roots.size() == a.size() && plain(roots) == plain(a);
    }

    /// Formulas where a length is not zero: `where(speed > 0, v/speed, 0)` means what `unit` does.
    std::vector<Expr> where_it_moves(std::span<const Expr> formulas, Expr length) {
        const Expr square = graph_[length].arg[0];
        std::vector<Expr> changed;
        for (const Expr e : formulas)
            changed.push_back(graph_.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
                return graph_[i].op == Op::sign && (arg[0] == length || arg[0] == square)
                           ? graph_.constant(1)
                           : graph_.with_args(i, arg);
            }));
        return changed;
    }

    // --- quotients -------------------------------------------------------------------------------

    /// Formulas with units for their quotients by |a|; empty if there are none, or others as well.
    std::vector<Expr> with_units(std::span<const Expr> formulas, const Entries& a, Expr length) {
        bool any = false;
        std::vector<Expr> changed;
        for (const Expr e : formulas) {
            const auto parts = divided(e, length);
            if (!parts)
                return {};
            if (graph_.is_constant(parts->part, 0)) {
                changed.push_back(e);
                continue;
            }
            const auto factors = linear_in(parts->part, a);
            if (!factors)
                return {};
            any = true;
            Expr sum = parts->whole;
            for (std::size_t k = 0; k < a.size(); ++k)
                sum = graph_.add(sum, graph_.mul((*factors)[k], graph_.unit(a, int(k))));
            changed.push_back(sum);
        }
        return any ? changed : std::vector<Expr>{};
    }
    /// It as p + q/length; none if that is not its form.
    std::optional<OverLength> divided(Expr e, Expr length) {
        std::vector<std::optional<OverLength>> became(std::size_t(e) + 1);
        const Expr none = graph_.constant(0);
        for (const Expr i : graph_.below(e)) {
            const Graph::Node n = graph_[i];
            std::array<OverLength, 3> arg{};
            bool known = true, plain = true;
            for (int k = 0; k < arity(n.op); ++k) {
                const auto& operand = became[std::size_t(n.arg[std::size_t(k)])];
                known = known && operand.has_value();
                if (!operand)
                    continue;
                arg[std::size_t(k)] = *operand;
                plain = plain && graph_.is_constant(operand->part, 0);
            }
            if (known)
                became[std::size_t(i)] =
                    plain && n.op != Op::div ? OverLength{i, none} : divided_node(i, arg, length);
        }
        return became[std::size_t(e)];
    }
    std::optional<OverLength> divided_node(Expr e, const std::array<OverLength, 3>& arg,
                                           Expr length) {
        const Graph::Node n = graph_[e];
        const auto& [a, b, c] = arg;
        const Expr none = graph_.constant(0);
        const auto has = [&](const OverLength& v) { return !graph_.is_constant(v.part, 0); };
        switch (n.op) {
        case Op::add:
            return OverLength{graph_.add(a.whole, b.whole), graph_.add(a.part, b.part)};
        case Op::sub:
            return OverLength{graph_.sub(a.whole, b.whole), graph_.sub(a.part, b.part)};
        case Op::neg:
            return OverLength{graph_.neg(a.whole), graph_.neg(a.part)};
        case Op::mul:
            if (has(a) && has(b))
                return std::nullopt;
            return OverLength{graph_.mul(a.whole, b.whole),
                              has(a) ? graph_.mul(a.part, b.whole) : graph_.mul(a.whole, b.part)};
        case Op::div: {
            if (has(b))
                return std::nullopt;
            const Expr rest = without_factor(b.whole, length);
            if (rest < 0 && !has(a))
                return OverLength{e, none};
            if (rest < 0)
                return OverLength{graph_.div(a.whole, b.whole), graph_.div(a.part, b.whole)};
            if (has(a))
                return std::nullopt;
            return OverLength{none, graph_.div(a.whole, rest)};
        }
        case Op::where:
            if (has(a))
                return std::nullopt;
            return OverLength{graph_.where(a.whole, b.whole, c.whole),
                              graph_.where(a.whole, b.part, c.part)};
        default:
            return std::nullopt;
        }
    }
    // (Each node is looked at once: what a formula shares it may share a thousand times.)

    /// A product without this factor, -1 if that is none of its factors.
    Expr without_factor(Expr product, Expr factor) {
        std::vector<Expr> rest(std::size_t(product) + 1, -1);
        for (const Expr e : graph_.below(product)) {
            const Graph::Node n = graph_[e];
            Expr& became = rest[std::size_t(e)];
            const auto of = [&](std::size_t k) { return rest[std::size_t(n.arg[k])]; };
            if (e == factor)
                became = graph_.constant(1);
            else if (n.op == Op::neg && of(0) >= 0)
                became = graph_.neg(of(0));
            else if (n.op == Op::mul && of(0) >= 0)
                became = graph_.mul(of(0), n.arg[1]);
            else if (n.op == Op::mul && of(1) >= 0)
                became = graph_.mul(of(1), n.arg[0]);
        }
        return rest[std::size_t(product)];
    }
    /// The factors c of c.a.
    using Factors = std::array<Expr, 3>;
    /// Factors c with e = c.a; none if that is not its form.
    std::optional<Factors> linear_in(Expr e, const Entries& a) {
        std::vector<std::optional<Factors>> became(std::size_t(e) + 1);
        for (const Expr i : graph_.below(e))
            became[std::size_t(i)] = linear_node(i, a, became);
        return became[std::size_t(e)];
    }
    std::optional<Factors> linear_node(Expr e, const Entries& a,
                                       const std::vector<std::optional<Factors>>& became) {
        const Expr none = graph_.constant(0);
        Factors c{none, none, none};
        if (graph_.is_constant(e, 0))
            return c;
        for (std::size_t k = 0; k < a.size(); ++k)
            if (e == a[k] || e == graph_.neg(a[k])) {
                c[k] = graph_.constant(e == a[k] ? 1 : -1);
                return c;
            }
        const Graph::Node n = graph_[e];
        const auto of = [&](std::size_t k) -> const std::optional<Factors>& {
            return became[std::size_t(n.arg[k])];
        };
        const auto changed = [&](std::size_t k, const auto& change) {
            auto r = of(k);
            if (r)
                for (Expr& x : *r)
                    x = change(x);
            return r;
        };
        const auto joined = [&](std::size_t i, std::size_t k,
                                const auto& join) -> std::optional<Factors> {
            if (!of(i) || !of(k))
                return std::nullopt;
            for (std::size_t r = 0; r < c.size(); ++r)
                c[r] = join((*of(i))[r], (*of(k))[r]);
            return c;
        };
        switch (n.op) {
        case Op::add:
            return joined(0, 1, [&](Expr u, Expr v) { return graph_.add(u, v); });
        case Op::sub:
            return joined(0, 1, [&](Expr u, Expr v) { return graph_.sub(u, v); });
        case Op::neg:
            return changed(0, [&](Expr x) { return graph_.neg(x); });
        case Op::mul: {
            const std::size_t k = of(0) ? 0 : 1;
            return changed(k, [&](Expr x) { return graph_.mul(x, n.arg[1 - k]); });
        }
        case Op::div:
            return changed(0, [&](Expr x) { return graph_.div(x, n.arg[1]); });
        case Op::where:
            return joined(1, 2, [&](Expr u, Expr v) { return graph_.where(n.arg[0], u, v); });
        default:
            return std::nullopt;
        }
    }
    /// True if such a field pulls a to zero where it is near: the trace of da'/dn is negative.
    bool pulls_to_zero(std::span<const Expr> field, const Entries& a) {
        const int leaf = dim_;
        std::vector<Expr> f;
        for (const Expr e : field)
            f.push_back(graph_.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
                if (is_length(i, a))
                    return along(a, leaf);
                const Graph::Node n = graph_[i];
                for (std::size_t k = 0; k < a.size(); ++k)
                    if (is_unit(n.op) && i == graph_.unit(a, int(k)))
                        return graph_.state(leaf + int(k));
                return graph_.with_args(i, arg);
            }));
        Expr trace = graph_.constant(0);
        for (std::size_t k = 0; k < a.size(); ++k)
            for (int i = 0; i < dim_; ++i) {
                const Expr by_state = graph_.derivative(a[k], graph_.state(i));
                const Expr by_unit =
                    graph_.derivative(f[std::size_t(i)], graph_.state(leaf + int(k)));
                trace = graph_.add(trace, graph_.mul(by_state, by_unit));
            }
        for (Samples::Point at : points_at_rest(a)) {
            at.x.resize(at.x.size() + a.size(), 0.5);
            if (graph_.value(trace, at.t, at.x, at.p) < 0)
                return true;
        }
        return false;
    }

    // --- at rest ---------------------------------------------------------------------------------

    /// Points at which a vector is zero, near the samples: onto one entry after the other, again
    /// and again.
    std::vector<Samples::Point> points_at_rest(const Entries& a) {
        std::vector<std::vector<Expr>> gradients;
        std::vector<Expr> rates;
        for (const Expr e : a) {
            gradients.emplace_back();
            for (int i = 0; i < dim_; ++i)
                gradients.back().push_back(graph_.derivative(e, graph_.state(i)));
            rates.push_back(graph_.derivative(e, graph_.time()));
        }
        std::vector<Samples::Point> found;
        for (const auto& draws : {samples_.near(), samples_.wide()})
            for (const Samples::Draw& draw : draws)
                for (std::size_t i = 0; i < draw.size(); i += 4) {
                    std::optional<Samples::Point> at = draw[i];
                    for (int sweep = 0; at && sweep < 60; ++sweep)
                        for (std::size_t k = 0; at && k < a.size(); ++k)
                            if (const auto there =
                                    put_on(graph_, a[k], gradients[k], rates[k], *at))
                                at = there->at;
                            else
                                at.reset();
                    if (at && is_at_rest(a, *at, draw[i]))
                        found.push_back(std::move(*at));
                }
        return found;
    }
    bool is_at_rest(const Entries& a, const Samples::Point& at, const Samples::Point& from) const {
        for (const Expr e : a)
            if (!(std::abs(graph_.value(e, at.t, at.x, at.p)) <=
                  1e-9 * std::abs(graph_.value(e, from.t, from.x, from.p))))
                return false;
        return true;
    }
    /// True if in the middle between two directions it is the mean of its values there.
    bool is_linear(Expr e, const Samples::Point& rest, int leaf, int n) const {
        Samples::Point at = rest;
        at.x.resize(std::size_t(dim_ + leaves()), 0.3);
        const auto value = [&](const std::array<double, 3>& s) {
            for (int k = 0; k < n; ++k)
                at.x[std::size_t(leaf + k)] = s[std::size_t(k)];
            return graph_.value(e, at.t, at.x, at.p);
        };
        const std::array<std::array<double, 3>, 4> ends{
            {{0.6, -0.7, 0.3}, {-0.2, 0.9, 0.35}, {-0.8, -0.4, -0.4}, {0.1, 0.2, 0.95}}};
        for (std::size_t i = 0; i < ends.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) {
                std::array<double, 3> middle{};
                for (std::size_t k = 0; k < 3; ++k)
                    middle[k] = (ends[i][k] + ends[j][k]) / 2;
                const double u = value(ends[i]), v = value(ends[j]), w = value(middle);
                const double off = std::abs(u + v - 2 * w);
                if (off > 1e-9 * (std::abs(u) + std::abs(v) + std::abs(w)))
                    return false; // (what is no number there has no law to be judged)
            }
        return true;
    }

    // --- leaves ----------------------------------------------------------------------------------

    /// a.n, which is |a|.
    Expr along(const Entries& a, int leaf) {
        Expr sum = graph_.constant(0);
        for (std::size_t k = 0; k < a.size(); ++k)
            sum = graph_.add(sum, graph_.mul(a[k], graph_.state(leaf + int(k))));
        return sum;
    }
    Expr with_leaves(Expr e) {
        return graph_.rewrite(e, [&](Expr i, std::span<const Expr> arg) {
            const Graph::Node n = graph_[i];
            if (!is_unit(n.op))
                return graph_.with_args(i, arg);
            const auto [first, turn] = place_of(graph_.vector_of(i));
            const Expr leaf = graph_.state(dim_ + first + n.index);
            return turn < 0 ? graph_.neg(leaf) : leaf;
        });
    }
    /// Where a vector's leaves begin, and -1 if they are those of its negative.
    std::pair<int, int> place_of(const Entries& a) {
        int first = 0;
        for (const Entries& known : all_) {
            if (const int turn = parallel(a, known); turn != 0)
                return {first, turn};
            first += int(known.size());
        }
        all_.push_back(a);
        return {first, 1};
    }
    /// 1 if two vectors have the same direction everywhere, -1 if they have opposite ones, else 0.
    int parallel(const Entries& a, const Entries& b) const {
        if (a.size() != b.size())
            return 0;
        if (a == b)
            return 1;
        int turn = 0;
        for (const auto& draws : {samples_.near(), samples_.wide()})
            for (const Samples::Draw& draw : draws)
                for (const Samples::Point& at : draw) {
                    const auto of = [&](Expr e) { return graph_.rounded(e, at.t, at.x, at.p); };
                    double dot = 0;
                    for (std::size_t i = 0; i < a.size(); ++i) {
                        const auto u = of(a[i]), v = of(b[i]);
                        dot += u.value * v.value;
                        for (std::size_t k = 0; k < i; ++k) {
                            const auto y = of(a[k]), z = of(b[k]);
                            const double one = u.value * z.value, other = y.value * v.value;
                            const double error =
                                u.error * std::abs(z.value) + z.error * std::abs(u.value) +
                                y.error * std::abs(v.value) + v.error * std::abs(y.value);
                            if (!(std::abs(one - other) <= 8 * error))
                                return 0;
                        }
                    }
                    const int here = dot > 0 ? 1 : dot < 0 ? -1 : 0;
                    if (here == 0 || (turn != 0 && here != turn))
                        return 0;
                    turn = here;
                }
        return turn;
    }

    Graph& graph_;
    int dim_;
    Samples samples_;
    std::vector<Entries> all_;
};

} // namespace filippov::detail
