// SPDX-License-Identifier: BSD-3-Clause
// How often is a short visit beyond zero missed? Slides of length 1 with a constant field whose s
// goes beyond 1 for a given time, and constant fields over which the surface rises for that time.
#pragma once

#include "relays.hpp"

namespace filippov::strangers {

/// What is watched, beside its long way from zero.
struct Shape {
    const char* name;
    bool off_surface; ///< h off the surface; else s in a slide
    double swings;    ///< in the run; 0: it comes near zero once only
};
constexpr Shape shapes[] = {{"s, one bump", false, 0},       {"s, 1 swing", false, 1},
                            {"s, 10 swings", false, 10},     {"s, 100 swings", false, 100},
                            {"s, 1000 swings", false, 1000}, {"h, one bump", true, 0},
                            {"h, 1 swing", true, 1},         {"h, 10 swings", true, 10},
                            {"h, 100 swings", true, 100},    {"h, 1000 swings", true, 1000}};

/// A problem whose watched function is beyond zero for a part q of the run, or of each swing.
inline std::unique_ptr<RelayProblem> draw_visit(const Shape& shape, double q, std::uint64_t seed) {
    Dice dice(seed);
    auto p = std::make_unique<RelayProblem>();
    p->disguise.n = 3;
    Relay& relay = p->law.relay_law.relay;
    Wave wave; // its largest value lies beyond 1
    if (shape.swings == 0) {
        const double top = 1 + dice.logarithmic(1e-2, 1); // top/(1 + u^2) = 1
        wave.add({Term::bump, top, q / 2 / std::sqrt(top - 1),
                  dice.uniform(0.05 + q / 2, 0.95 - q / 2)});
    } else {
        const double rate = 2 * std::acos(-1.0) * shape.swings;
        // (up to a tenth slower: no step fits)
        wave.add({Term::wave, 1 / std::cos(std::acos(-1.0) * std::min(q, 0.3)),
                  rate * dice.uniform(0.9, 1), dice.uniform(1.2, 5)});
    }
    p->t_end = 1;
    if (shape.off_surface) { // h = -1 + wave, and it is seen in z1' = s
        relay.a = Wave(0.0);
        relay.b = 0;
        relay.g = wave;
        relay.c1 = 1;
        p->x0 = {1, 0, 0, 0};
    } else {
        relay.a = wave;
        relay.g = Wave(0.0);
        p->on_surface = true;
        p->x0 = {0, 0, 0, 0};
    }
    p->pace = std::min(relay.pace(), 1.0);
    return p;
}

/// True if the first visit is missed.
inline bool is_missed(const RelayProblem& p, const Exactly& exact, const Told& told) {
    const Long last = exact.changes.size() > 1 ? exact.changes[1].t : Long(p.t_end);
    if (!told.has_story)
        return std::size_t(told.count) < exact.changes.size();
    return told.changes.empty() || !(told.changes[0].t < last);
}

} // namespace filippov::strangers
