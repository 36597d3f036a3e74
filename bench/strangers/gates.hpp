// SPDX-License-Identifier: BSD-3-Clause
// What a gate feeds: z0' = (1 + s)/2 - a z0. The gate opens and shuts with an angle, of the time or
// of two components that turn: in pulses, by a sawtooth, or where a ratio is large. Its times are
// known in closed form, and between them z0 decays.
#pragma once

#include "one_surface.hpp"

#include <algorithm>

namespace filippov::strangers {

class GateProblem final : public Problem {
public:
    OneSurface law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const GateLaw& gate = law.gate_law;
        // an error a radian, of the angle too, if components turn
        const Long turns = std::abs(Long(gate.omega) * (to - from)) + 1;
        const Long radius = std::hypot(z0[1], z0[2]);
        const Long slip = gate.of_time ? 0 : nudge.of(1) / radius;
        const Long angle0 =
            gate.of_time ? Long(gate.omega) * from + Long(gate.phase) : std::atan2(z0[2], z0[1]);
        const auto angle_at = [&](Long t) {
            return angle0 + Long(gate.omega) * (t - from) * (1 + slip);
        };
        Exactly e;
        e.t = to;
        const Long way = to > from ? 1 : -1, unit = Long(gate.omega) * (1 + slip);
        Long t = from, z = z0[0];
        bool open = is_open(angle0);
        e.largest = std::max({std::abs(z), std::abs(z0[1]), std::abs(z0[2]), radius});
        const auto go = [&](Long until) {
            const Long decay = std::exp(-Long(gate.a) * (until - t)), fed = open ? 1 : 0;
            z = gate.a == 0 ? z + fed * (until - t) : fed / gate.a + (z - fed / gate.a) * decay;
            t = until;
            e.largest = std::max(e.largest, std::abs(z));
        };
        for (int k = 0; k < 5000; ++k) {
            const Long next = next_edge(angle_at(t) + way * 1e-12L, int(way));
            const Long until = from + (next - angle0) / unit;
            if (way * (until - to) > 0)
                break;
            if (k == 0 && std::abs(until - from) * gate.omega < 1e-6L)
                e.fate = Exactly::undecided;
            go(until);
            open = !open;
            e.changes.push_back({t, 0, open ? 1 : -1});
        }
        go(to);
        const Long angle = angle_at(to);
        e.z = {
            z + nudge.of(0) * turns, gate.of_time ? z0[1] + nudge.of(1) : radius * std::cos(angle),
            gate.of_time ? z0[2] + nudge.of(2) : radius * std::sin(angle) + nudge.of(2) * turns, 0};
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_one_surface(law, disguise, ask); }
    std::string text() const override {
        const GateLaw& g = law.gate_law;
        char s[500];
        const std::string angle = [&] {
            char c[80];
            std::snprintf(c, sizeof c, "(%.17g*t + %.17g)", g.omega, g.phase);
            return std::string(c);
        }();
        const std::string cosine = g.of_time ? "np.cos(" + angle + ")"
                                             : "s.z1/np.sqrt(s.z1**2 + s.z2**2)",
                          ratio = g.of_time ? "np.tan(" + angle + ")" : "s.z2/s.z1";
        char h[300];
        if (g.kind == GateLaw::pulse)
            std::snprintf(h, sizeof h, "%s > %.17g", cosine.c_str(), g.level);
        else if (g.kind == GateLaw::pole)
            std::snprintf(h, sizeof h, "%s > %.17g", ratio.c_str(), g.level);
        else
            std::snprintf(h, sizeof h, "np.arctan(%s) < %.17g", ratio.c_str(), g.level);
        std::snprintf(s, sizeof s,
                      "fp.system(state=\"z0 z1 z2\")(lambda t, s, p: (np.where(%s, 1, 0) - "
                      "%.17g*s.z0, -%.17g*s.z2, %.17g*s.z1))  # sharpness %.3g",
                      h, g.a, g.of_time ? 0 : g.omega, g.of_time ? 0 : g.omega, g.sharp);
        return s;
    }

private:
    static constexpr Long pi = 3.14159265358979323846264338327950288L;

    /// Angles in one turn, or half a turn, at which the gate opens and shuts.
    struct Edges {
        Long opens, shuts, turn;
    };
    Edges edges() const {
        const GateLaw& g = law.gate_law;
        if (g.kind == GateLaw::pulse) {
            const Long half = std::acos(Long(g.level));
            return {-half, half, 2 * pi};
        }
        if (g.kind == GateLaw::pole)
            return {std::atan(Long(g.level)), pi / 2, pi};
        return {-pi / 2, Long(g.level), pi};
    }
    bool is_open(Long angle) const {
        const Edges e = edges();
        const Long since = angle - e.opens;
        return since - e.turn * std::floor(since / e.turn) < e.shuts - e.opens;
    }
    Long next_edge(Long angle, int way) const {
        const Edges e = edges();
        const auto after = [&](Long edge) {
            const Long turns = (angle - edge) / e.turn;
            return edge + e.turn * (way > 0 ? std::ceil(turns) : std::floor(turns));
        };
        const Long a = after(e.opens), b = after(e.shuts);
        return way > 0 ? std::min(a, b) : std::max(a, b);
    }
};

inline std::unique_ptr<GateProblem> draw_gate(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<GateProblem>();
    q->law.kind = OneSurface::gate;
    GateLaw& gate = q->law.gate_law;
    const double turn = 2 * std::acos(-1.0);
    gate.kind = GateLaw::Kind(dice.whole(3));
    gate.of_time = dice.chance(0.6);
    gate.omega = dice.logarithmic(0.5, 1000);
    gate.phase = dice.uniform(-3, 3);
    gate.a = dice.chance(0.2) ? 0 : dice.logarithmic(0.02, 10);
    gate.sharp = dice.logarithmic(1, 40);
    // open, or shut, for a thirtieth of a turn at least
    const double share = dice.chance(0.5) ? dice.uniform(0.1, 0.9) : dice.logarithmic(0.03, 0.3);
    gate.level = gate.kind == GateLaw::pulse  ? std::cos(turn / 2 * share)
                 : gate.kind == GateLaw::pole ? std::tan(turn / 4 - turn / 2 * share)
                                              : turn / 2 * (share - 0.5);
    const double span = turn / gate.omega * dice.uniform(1, 30);
    const double t0 = dice.chance(0.5) ? 0 : dice.uniform(0, 100);
    q->disguise.n = 3;
    q->disguise.draw(dice, 5 + span, dice.chance(0.25));
    if (gate.of_time && dice.chance(0.4))
        q->disguise.period = turn / gate.omega / q->disguise.speed;
    q->t0 = t0 / q->disguise.speed;
    q->t_end = (t0 + span) / q->disguise.speed;
    q->pace = 0.1 / gate.omega;
    q->back = gate.a * span < 2; // (else errors grow)
    const double angle = dice.uniform(-3, 3), radius = dice.uniform(0.3, 1.5);
    q->x0 = q->disguise.seen(
        Natural{dice.uniform(-1, 1), radius * std::cos(angle), radius * std::sin(angle), 0});
    return q;
}

} // namespace filippov::strangers
