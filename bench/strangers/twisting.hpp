// SPDX-License-Identifier: BSD-3-Clause
// Twisting laws, which come to a slide of second order and hold it: the end is known, though
// nothing else is.
#pragma once

#include "one_surface.hpp"

namespace filippov::strangers {

/// A super-twisting law. Only its end is compared: on its way it turns for ever.
class TwistingProblem final : public Problem {
public:
    OneSurface law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const TwistingLaw& l = law.twisting_law;
        Exactly e;
        e.slides = true;
        e.t = to;
        e.z = {nudge.of(0), -l.d.exact(to, 0) + nudge.of(1),
               z0[2] + Long(l.c2) * (to - from) + nudge.of(2), 0};
        e.largest =
            std::max({std::abs(z0[0]), std::abs(z0[1]), std::abs(e.z[1]), std::abs(e.z[2])});
        return e;
    }
    Told ask(const Ask& ask) const override {
        Told told = ask_one_surface(law, disguise, ask);
        told.has_story = false;
        return told;
    }
    std::string text() const override {
        const TwistingLaw& l = law.twisting_law;
        char s[300];
        std::snprintf(s, sizeof s,
                      "z0' = -%.17g*sqrt(abs(z0))*sign(z0) + z1 + w, z1' = %.17g - %.17g*sign(z0), "
                      "z2' = %.17g, with w = ",
                      l.k, l.e, l.b, l.c2);
        return s + l.d.text();
    }
};

inline std::unique_ptr<Problem> draw_twisting(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<TwistingProblem>();
    const double fast = dice.logarithmic(0.1, 3), span = dice.uniform(15, 30);
    q->disguise.n = 3;
    q->disguise.draw(dice, 5 + span, dice.chance(0.5));
    const double from = dice.chance(0.5) ? 0 : dice.uniform(0, 100);
    q->t0 = from / q->disguise.speed;
    q->t_end = (from + span) / q->disguise.speed;
    q->law.kind = OneSurface::twisting;
    TwistingLaw& l = q->law.twisting_law;
    l.d = dice.wave(dice.uniform(0, 1) / fast, fast, true, 0, span);
    l.e = dice.uniform(-0.3, 0.3);
    // |d' + e| < L: it comes to rest with k = 1.5 L^(1/2) and b = 1.1 L, or more
    double largest = std::abs(l.e);
    for (const Term& term : l.d.terms)
        largest += std::abs(term.c * term.p);
    const double L = std::max(largest, 0.5) * dice.logarithmic(1, 3);
    l.k = 1.5 * std::sqrt(L) * dice.logarithmic(1, 2);
    l.b = 1.1 * L;
    l.c2 = dice.uniform(-1, 1);
    q->pace = std::min(l.d.pace(), 1.0);
    const Long t0 = Long(q->t0) * Long(q->disguise.speed);
    q->on_surface = dice.chance(0.3);
    q->x0 =
        q->on_surface
            ? q->disguise.seen({0, -l.d.exact(t0, 0), dice.uniform(-1, 1), 0})
            : q->disguise.seen({dice.uniform(-0.3, 0.3) * L, dice.uniform(-1, 1) - l.d.exact(t0, 0),
                                dice.uniform(-1, 1), 0});
    return q;
}

} // namespace filippov::strangers
