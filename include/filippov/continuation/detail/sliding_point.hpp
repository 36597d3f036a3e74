// SPDX-License-Identifier: BSD-3-Clause
// A bifurcation in which the word changes, located: its name, its residuals and its multipliers.
#pragma once

#include <filippov/continuation/continuation.hpp>

#include <string>
#include <utility>
#include <vector>

namespace filippov {

namespace detail {

/// The residuals that the chapter lists, (4.24)-(4.29), in the signs of this library. Of a grazing
/// without a slide, where s has no meaning, those of the far side as well.
inline std::vector<std::pair<std::string, double>>
conditions_at(const AnySystem& system, Kind kind, const Cycle& c, std::size_t node, int side) {
    using K = Quantity::Kind;
    const auto at = [&](K quantity, int order) {
        return value_at(system, c, node, {quantity, side, order});
    };
    const std::string L = side < 0 ? "L1" : "L2", other = side < 0 ? "L2" : "L1";
    if (kind == Kind::grazing)
        return {{"h", at(K::h, 0)},
                {L, at(K::h, 1)},
                {L + "'", at(K::h, 2)},
                {L + "''", at(K::h, 3)},
                {other, value_at(system, c, node, {K::h, -side, 1})},
                {other + "'", value_at(system, c, node, {K::h, -side, 2})}};
    return {{"h", at(K::h, 0)},
            {side < 0 ? "1 + s" : "1 - s", at(K::margin, 0)},
            {L, at(K::h, 1)},
            {L + "'", at(K::h, 2)},
            {L + "''", at(K::h, 3)}};
}
/// True where h has the same rate along both fields at the node of a bifurcation, to rounding: its
/// relative degree is two there, and nothing slides.
inline bool crosses_alike(const AnySystem& system, const SlidingCondition& s) {
    const auto rate = [&](int side) {
        return value_at(system, s.cycle, s.node, {Quantity::Kind::h, side, 1});
    };
    return std::abs(rate(1) - rate(-1)) <= 1e-9 * fastest_rate(system, s.cycle);
}
/// Crossing and switching have the same equation; what follows where L' pushes tells them apart.
/// And a touch is followed by a slide if the far side's field leads back.
inline Kind named(const AnySystem& system, const SlidingCondition& s) {
    if (grazes(s.kind)) {
        const double far = value_at(system, s.cycle, s.node, {Quantity::Kind::h, -s.side, 1});
        return s.side * far > 0 && !crosses_alike(system, s) ? Kind::grazing_sliding
                                                             : Kind::grazing;
    }
    if (s.kind != Kind::switching_sliding && s.kind != Kind::crossing_sliding)
        return s.kind;
    const double push = value_at(system, s.cycle, s.node, {Quantity::Kind::h, s.side, 2});
    return s.side * push < 0 ? Kind::switching_sliding : Kind::crossing_sliding;
}
/// All that belongs to a bifurcation in which the word changes, but for the words. (A visit of the
/// far side that is no longer than a touch has no multipliers: they grow beyond all bounds.)
inline SpecialPoint special_point(const AnySystem& system, const SlidingCondition& s,
                                  const Convergence& convergence) {
    SpecialPoint special;
    special.kind = s.kind;
    special.cycle = s.cycle;
    special.node = s.node;
    special.side = s.side;
    special.conditions = conditions_at(system, s.kind, s.cycle, s.node, s.side);
    special.multipliers = floquet(system, parent_of(s));
    if (s.kind != Kind::grazing)
        special.multipliers_child =
            s.kind == Kind::grazing_sliding ? floquet_of_child(system, s) : special.multipliers;
    special.convergence = convergence;
    return special;
}

} // namespace detail

} // namespace filippov
