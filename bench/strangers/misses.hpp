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
struct Visits {
    std::unique_ptr<RelayProblem> problem;
    double first_end = 0; ///< of the first visit
    int count = 0;        ///< of visits that end within the run
};

inline Visits draw_visits(const Shape& shape, double q, std::uint64_t seed) {
    Dice dice(seed);
    Visits v{std::make_unique<RelayProblem>()};
    Wave wave; // its largest value lies beyond 1
    if (shape.swings == 0) {
        const double top = 1 + dice.logarithmic(1e-2, 1), // top/(1 + u^2) = 1
            middle = dice.uniform(0.05 + q / 2, 0.95 - q / 2);
        wave.add({Term::bump, top, q / 2 / std::sqrt(top - 1), middle});
        v.first_end = middle + q / 2;
        v.count = 1;
    } else { // (up to a tenth slower: no step fits)
        const double pi = std::acos(-1.0), rate = 2 * pi * shape.swings * dice.uniform(0.9, 1),
                     phase = dice.uniform(1.2, 5);
        wave.add({Term::wave, 1 / std::cos(pi * q), rate, phase});
        v.first_end = (2 * pi - phase + pi * q) / rate;
        for (double end = v.first_end; end < 1; end += 2 * pi / rate)
            ++v.count;
    }
    RelayProblem& p = *v.problem;
    p.disguise.n = 3;
    p.t_end = 1;
    Relay& relay = p.law.relay_law.relay;
    relay.a = shape.off_surface ? Wave(0.0) : wave;
    relay.g = shape.off_surface ? wave : Wave(0.0);
    relay.b = shape.off_surface ? 0 : 1;
    relay.c1 = shape.off_surface ? 1 : 0; // (else nothing changes where h = 1 - wave does)
    p.x0 = {shape.off_surface ? 1.0 : 0.0, 0, 0, 0};
    p.on_surface = !shape.off_surface;
    return v;
}

/// True if the first visit is missed; of lanes, which only count, if any is.
inline bool is_missed(const Visits& v, const Told& told) {
    if (!told.has_story) // each begins and ends, the last one maybe later
        return told.count < 2 * v.count - 1;
    return v.count > 0 && (told.changes.empty() || !(told.changes[0].t <= v.first_end));
}

} // namespace filippov::strangers
