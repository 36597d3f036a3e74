// SPDX-License-Identifier: BSD-3-Clause
// A sliding bifurcation that was located: its name, its residuals and its multipliers.
#pragma once

#include <filippov/continuation.hpp>

#include <string>
#include <utility>
#include <vector>

namespace filippov {

namespace detail {

inline constexpr const char* touches_crossed =
    "the orbit touches the surface where it is crossed: no orbit of any word goes on";

/// The residuals that the chapter lists, (4.24)-(4.29), in the signs of this library.
inline std::vector<std::pair<std::string, double>>
conditions_at(const AnySystem& system, const Cycle& c, std::size_t node, int side) {
    using K = Quantity::Kind;
    const auto at = [&](K kind, int order) {
        return value_at(system, c, node, {kind, side, order});
    };
    const std::string L = side < 0 ? "L1" : "L2";
    return {{"h", at(K::h, 0)},
            {side < 0 ? "1 + s" : "1 - s", at(K::margin, 0)},
            {L, at(K::h, 1)},
            {L + "'", at(K::h, 2)},
            {L + "''", at(K::h, 3)}};
}
/// Crossing and switching have the same equation; what follows where L' pushes tells them apart.
inline Kind named(const AnySystem& system, const SlidingCondition& s) {
    if (s.kind != Kind::switching_sliding && s.kind != Kind::crossing_sliding)
        return s.kind;
    const double push = value_at(system, s.cycle, s.node, {Quantity::Kind::h, s.side, 2});
    return s.side * push < 0 ? Kind::switching_sliding : Kind::crossing_sliding;
}
/// All that belongs to a sliding bifurcation, but for the words.
inline SpecialPoint special_point(const AnySystem& system, const SlidingCondition& s,
                                  const Convergence& convergence) {
    SpecialPoint special;
    special.kind = s.kind;
    special.cycle = s.cycle;
    special.node = s.node;
    special.side = s.side;
    special.conditions = conditions_at(system, s.cycle, s.node, s.side);
    special.multipliers = floquet(system, parent_of(s));
    special.multipliers_child =
        s.kind == Kind::grazing_sliding ? floquet_of_child(system, s) : special.multipliers;
    special.convergence = convergence;
    return special;
}

} // namespace detail

} // namespace filippov
