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

/// Settings of every member, as the typed layer gives them.
inline EnsembleSettings ensemble_settings(bool eighth_order, double rtol, const Array<double>& atol,
                                          double max_step, double first_step, long long max_steps,
                                          long long max_events, int on_nonunique) {
    expect(on_nonunique >= 0 && on_nonunique <= static_cast<int>(NonUnique::stay),
           "on_nonunique is 0 to 3");
    EnsembleSettings s;
    s.eighth_order = eighth_order;
    s.rtol = rtol;
    s.atol = copy(atol);
    s.max_step = max_step;
    s.first_step = first_step;
    s.max_steps = max_steps;
    s.max_events = max_events;
    s.on_nonunique = static_cast<NonUnique>(on_nonunique);
    return s;
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
