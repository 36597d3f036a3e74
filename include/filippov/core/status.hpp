// SPDX-License-Identifier: BSD-3-Clause
// How a run ended, and the words for it.
#pragma once

#include <string_view>

namespace filippov {

/// How a run ended. Everything but `ok` and `event` is a reason to look at the result twice.
enum class [[nodiscard]] Status {
    ok,                 ///< reached the end of the time span
    event,              ///< stopped at a terminal section
    max_steps,          ///< Settings::max_steps used up
    max_events,         ///< Settings::max_events used up
    step_too_small,     ///< the error test asks for steps below the resolution of time
    not_finite,         ///< f or h is NaN or infinite and no shorter step helps
    ambiguous,          ///< not unique here, or not shown to be unique; the policy is `stop`
    degenerate_surface, ///< the gradient of h vanishes on the surface
    dependent_surfaces, ///< gradients of several surfaces are linearly dependent
    jump_cascade,       ///< too many state jumps in a row at one time
    accumulation,       ///< events accumulate at a finite time
    not_converged,      ///< an iteration did not converge
    escaped,            ///< the state left the domain of interest
    interrupted,        ///< the caller asked to stop
};

/// What happened, and what to try. Python shows these words.
constexpr std::string_view message(Status status) {
    switch (status) {
    case Status::ok:
        return "The end of the time span was reached.";
    case Status::event:
        return "A terminal event ended the run.";
    case Status::max_steps:
        return "The maximum number of steps was used up; raise max_steps or loosen the tolerance.";
    case Status::max_events:
        return "The maximum number of events was used up; raise max_events, or look for events "
               "that accumulate.";
    case Status::step_too_small:
        return "The step size fell below the resolution of time; the solution may blow up here, or "
               "the tolerance is below rounding.";
    case Status::not_finite:
        return "The right-hand side or the switching function is not finite, and no shorter step "
               "helps.";
    case Status::ambiguous:
        return "The solution is not unique, or not shown to be unique, at this point.";
    case Status::degenerate_surface:
        return "The gradient of the switching function vanishes on the surface; choose a switching "
               "function with a simple root.";
    case Status::dependent_surfaces:
        return "The gradients of the surfaces met here are linearly dependent.";
    case Status::jump_cascade:
        return "Too many state jumps in a row at one time.";
    case Status::accumulation:
        return "Events accumulate at a finite time.";
    case Status::not_converged:
        return "An iteration did not converge.";
    case Status::escaped:
        return "The state left the domain of interest.";
    case Status::interrupted:
        return "The run was interrupted by the caller.";
    }
    return "unknown status";
}

/// The name used in Python and in printed tables.
constexpr std::string_view name(Status status) {
    switch (status) {
    case Status::ok:
        return "ok";
    case Status::event:
        return "event";
    case Status::max_steps:
        return "max_steps";
    case Status::max_events:
        return "max_events";
    case Status::step_too_small:
        return "step_too_small";
    case Status::not_finite:
        return "not_finite";
    case Status::ambiguous:
        return "ambiguous";
    case Status::degenerate_surface:
        return "degenerate_surface";
    case Status::dependent_surfaces:
        return "dependent_surfaces";
    case Status::jump_cascade:
        return "jump_cascade";
    case Status::accumulation:
        return "accumulation";
    case Status::not_converged:
        return "not_converged";
    case Status::escaped:
        return "escaped";
    case Status::interrupted:
        return "interrupted";
    }
    return "unknown";
}

} // namespace filippov
