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
    bool closed_form; ///< which is told in closed form
    double swings;    ///< in the run; 0: it comes near zero once only
};
constexpr Shape shapes[] = {{"s, one bump", false, false, 0},
                            {"s, 10 swings", false, false, 10},
                            {"s, 1000 swings", false, false, 1000},
                            {"s in closed form, one bump", false, true, 0},
                            {"s in closed form, 10 swings", false, true, 10},
                            {"s in closed form, 1000 swings", false, true, 1000},
                            {"h, one bump", true, false, 0},
                            {"h, 10 swings", true, false, 10},
                            {"h, 1000 swings", true, false, 1000}};

/// A problem whose watched function is beyond zero once, for a part q of the run or of a swing.
struct Visit {
    std::unique_ptr<RelayProblem> problem;
    double end = 0;
};

inline Visit draw_visit(const Shape& shape, double q, std::uint64_t seed) {
    Dice dice(seed);
    Visit v{std::make_unique<RelayProblem>()};
    Wave wave; // its largest value lies beyond 1
    if (shape.swings == 0) {
        const double top = 1 + dice.logarithmic(1e-2, 1), // top/(1 + u^2) = 1
            middle = dice.uniform(0.05 + q / 2, 0.95 - q / 2);
        wave.add({Term::bump, top, q / 2 / std::sqrt(top - 1), middle});
        v.end = middle + q / 2;
    } else { // a bump lifts one of the tops, long after the first step (no step fits the swings)
        const double pi = std::acos(-1.0), swing = dice.uniform(1, 1.1) / shape.swings,
                     middle = dice.uniform(shape.swings > 1 ? 0.1 : 0.4, 0.9), w = q * swing / 2,
                     width = swing / 2;
        wave.add({Term::wave, 0.9, 2 * pi / swing, -2 * pi / swing * middle});
        wave.add({Term::bump, (1 - 0.9 * std::cos(pi * q)) * (1 + w * w / (width * width)), width,
                  middle});
        v.end = middle + w;
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
    p.law.relay_law.closed_form = shape.closed_form;
    return v;
}

inline bool is_missed(const Visit& v, const Told& told) {
    if (!told.has_story) // (lanes only count)
        return told.count == 0;
    return told.changes.empty() || !(told.changes[0].t <= v.end);
}

} // namespace filippov::strangers
