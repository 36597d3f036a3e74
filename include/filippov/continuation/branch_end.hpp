// SPDX-License-Identifier: BSD-3-Clause
// Why a branch of orbits, or a curve of bifurcations, ends.
#pragma once

#include <filippov/core/status.hpp>

#include <cstdint>
#include <string_view>

namespace filippov {

/// From `bound` to `second_bifurcation` the branch is complete there; behind that, it had to stop.
enum class BranchEnd : std::uint8_t {
    unknown, ///< it was not followed this way
    bound,
    bound_of_two,
    closed,
    equilibrium,
    point,
    homoclinic,
    half_period,
    part_of_period,
    no_orbit,
    codimension_two,
    degenerate_switching_sliding,
    degenerate_crossing_sliding,
    degenerate,
    end_of_slide,
    second_bifurcation,
    no_convergence,
    no_start,
    max_points,
    interrupted,
    several,
    several_of_orbit,
    not_located,
    meeting_not_located,
    touches_crossed,
    turned_back,
    too_unstable,
};

/// The same in words.
constexpr std::string_view message(BranchEnd end) {
    switch (end) {
    case BranchEnd::unknown:
        return "";
    case BranchEnd::bound:
        return "bound of the parameter";
    case BranchEnd::bound_of_two:
        return "bound of the parameters";
    case BranchEnd::closed:
        return "the branch is closed: it comes back to its start";
    case BranchEnd::equilibrium:
        return "the orbit shrinks to an equilibrium";
    case BranchEnd::point:
        return "the orbit shrinks to a point, its period to nothing";
    case BranchEnd::homoclinic:
        return "the period grows without bound: the orbit comes to an equilibrium";
    case BranchEnd::half_period:
        return "it ends on the orbit of half its period, which flips there";
    case BranchEnd::part_of_period:
        return "it ends on an orbit of a part of its period";
    case BranchEnd::no_orbit:
        return "no orbit of a neighbouring word was found beyond this bifurcation";
    case BranchEnd::codimension_two:
        return "a point of codimension two";
    case BranchEnd::degenerate_switching_sliding:
        return "degenerate switching-sliding";
    case BranchEnd::degenerate_crossing_sliding:
        return "degenerate crossing-sliding";
    case BranchEnd::degenerate:
        return "degenerate";
    case BranchEnd::end_of_slide:
        return "the touch reaches an end of its slide";
    case BranchEnd::second_bifurcation:
        return "the same orbit has a second bifurcation";
    case BranchEnd::no_convergence:
        return "Newton's iteration does not converge";
    case BranchEnd::no_start:
        return "the start cannot be evaluated";
    case BranchEnd::max_points:
        return "max_points reached";
    case BranchEnd::interrupted:
        return message(Status::interrupted);
    case BranchEnd::several:
        return "several bifurcations at once";
    case BranchEnd::several_of_orbit:
        return "several bifurcations of the same orbit at once";
    case BranchEnd::not_located:
        return "a bifurcation could not be located";
    case BranchEnd::meeting_not_located:
        return "the point where it meets a curve of sliding bifurcations was not located";
    case BranchEnd::touches_crossed:
        return "the orbit touches the surface where it is crossed: no orbit of a neighbouring word "
               "was found";
    case BranchEnd::turned_back:
        return "the branch turns back on itself at a bifurcation: how it goes on was not found";
    case BranchEnd::too_unstable:
        return "the orbit is too unstable for double precision: a multiplier of 1e12";
    }
    return "";
}

} // namespace filippov
