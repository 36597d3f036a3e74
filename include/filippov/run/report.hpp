// SPDX-License-Identifier: BSD-3-Clause
// What a run tells of itself: why it stopped, and where it failed.
#pragma once

#include <filippov/core/status.hpp>
#include <filippov/run/counters.hpp>
#include <filippov/sliding/mode.hpp>

#include <limits>
#include <string_view>

namespace filippov {

/// Where and in what a run failed.
template <class S, int N, int M> struct Diagnosis {
    std::string_view what; ///< "f1", "f2", "h", ..., or the reason of an ambiguity
    S t{};
    Vec<S, N> x = Vec<S, N>::Constant(std::numeric_limits<S>::quiet_NaN());
    Mode<M> mode{};
    int surface = -1;
    int branches = 0; ///< of an ambiguity, among which a policy may choose
};

/// Why a segment ended.
struct Stop {
    Status status = Status::ok; ///< not ok: the run is over
    int guard = -1;             ///< >= 0: the guard met; -1: the end of the time span
    bool touch = false;         ///< an extremum that touches zero, not a root
    bool missed = false;        ///< no event after all: the whole step is free
    bool again = false;         ///< another event came before: the step is tried again, shorter
    bool jumped = false; ///< h changed sign without being zero, or s is beyond its end (a jump)
    bool left_behind = false; ///< the surface slid on jumped away from the state
};

} // namespace filippov
