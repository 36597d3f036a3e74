// SPDX-License-Identifier: BSD-3-Clause
// What is bound of a system in lanes: ensembles and pictures share it.
#pragma once

#include "bind.hpp"
#include "lanes/lanes.hpp"

namespace filippov::python {

/// The lanes in a capsule that a module of lanes made.
inline const AnyLanes& lanes_in(const py::capsule& capsule) {
    const auto* lanes =
        static_cast<const LanesPointer*>(PyCapsule_GetPointer(capsule.ptr(), lanes_capsule));
    if (lanes == nullptr)
        throw py::error_already_set();
    return **lanes;
}

inline py::dict lane_counters_to_dict(const LaneCounters& c) {
    py::dict d;
    d["trips"] = c.trips;
    d["useful"] = c.useful;
    d["steps"] = c.steps;
    d["searches"] = c.searches;
    d["landings"] = c.landings;
    d["windows"] = c.windows;
    d["handed_over"] = c.handed_over;
    d["width"] = c.width;
    return d;
}

} // namespace filippov::python
