// SPDX-License-Identifier: BSD-3-Clause
// What a run is given besides its settings, its start and its parameters, checked before any work.
#pragma once

#include <filippov/events/guards.hpp>
#include <filippov/run/settings.hpp>

#include <string>

namespace filippov {

/// A start at an event that is known already: the end of a slide, say, where an iterate of a map
/// begins. `guard` counts as met in mode `before`, and the engine judges how the solution goes on:
/// on its surface, and on those that `before` slides on (all of them, if it is not given).
template <int M> struct KnownStart {
    Mode<M> before{};
    int guard = -1; ///< see Guard; -1: nothing is known of the start
    /// The start slides, and so do its neighbours: for derivatives within the surfaces slid on.
    bool held = false;
};

namespace detail {

template <int M> void validate_mode(const char* argument, const Mode<M>& mode) {
    for (int j = 0; j < M; ++j)
        if (!(mode[j] >= -1 && mode[j] <= 1))
            refuse(std::string(argument) + "[" + std::to_string(j) + "]", mode[j],
                   "expected -1, 0 or +1");
}

/// The mode and the target of a prescribed segment.
template <class Sys>
void validate_prescribed(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int target) {
    validate_mode("mode", mode);
    const int guards = 3 * surface_count(sys);
    if (!(target >= -1 && target < guards))
        refuse("target", target, "expected a Guard of a surface, or -1");
}

/// What is known of the start of a run.
template <class Sys>
void validate_known_start(const Sys& sys, const KnownStart<surfaces_v<Sys>>& known) {
    validate_mode("known_start.before", known.before);
    if (!(known.guard >= -1 && known.guard < 3 * surface_count(sys)))
        refuse("known_start.guard", known.guard, "expected a Guard of a surface, or -1");
}

/// The sections that a run watches.
template <class Sec> void validate_sections(const Sec& watched) {
    const int size = watched.size();
    if (!(size >= 0 && size <= Sec::capacity))
        refuse("sections.count", size,
               "expected an integer from 0 to " + std::to_string(Sec::capacity));
    for (int q = 0; q < size; ++q) {
        const std::string name = "sections[" + std::to_string(q) + "]";
        if (!(watched.direction(q) >= -1 && watched.direction(q) <= 1))
            refuse(name + ".direction", watched.direction(q), "expected -1, 0 or +1");
        if constexpr (requires { watched.callable(q); })
            if (!watched.callable(q))
                refuse(name + ".value", 0, "expected a function, not an empty one");
    }
}

} // namespace detail

} // namespace filippov
