// SPDX-License-Identifier: BSD-3-Clause
// Clocked converters: between jumps the exponential of a matrix of two rows, in closed form.
#pragma once

#include "jumps.hpp"

#include <algorithm>

namespace filippov::strangers {

class ConverterProblem final : public Problem {
public:
    Jumping law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const Converter& c = law.converter;
        Exactly e;
        e.slides = true;
        std::array<Long, 2> x{z0[0] + nudge.of(0), z0[1] + nudge.of(1)};
        Long t = from, next = from + Long(c.clock) - z0[2];
        bool on = z0[3] > 0.5L;
        for (;;) {
            const Long stop = std::min(next, to);
            Long root = stop + 1;
            if (on) {
                const Long tau0 = Long(c.clock) - next;
                root = first_root([&](Long at) { return below(moved(x, on, at - t), tau0 + at); },
                                  t, stop, std::min(0.25L / norm(), Long(c.clock) / 16));
            }
            if (root <= stop) {
                x = pushed(moved(x, on, root - t), nudge);
                t = root;
                on = false;
                e.changes.push_back({t, 1, 2});
                continue;
            }
            x = moved(x, on, stop - t);
            e.largest = std::max({e.largest, std::abs(x[0]), std::abs(x[1])});
            t = stop;
            if (!(next < to))
                break;
            x = pushed(x, nudge);
            on = true;
            next += Long(c.clock);
            e.changes.push_back({t, 0, 2});
            if (below(x, 0) < 0) { // beyond its level already
                on = false;
                e.changes.push_back({t, 1, 2});
            }
        }
        e.t = to;
        e.z = {x[0], x[1], Long(c.clock) - (next - to), on ? 1.0L : 0.0L};
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_jumping(law, disguise, ask); }
    std::string text() const override {
        const Converter& c = law.converter;
        std::string text;
        char s[500];
        for (std::size_t q = 0; q < 2; ++q) {
            std::snprintf(s, sizeof s,
                          "q = %zu: x' = (%.17g*x + %.17g*y + %.17g, %.17g*x + %.17g*y + %.17g); ",
                          q, c.a[q][0], c.a[q][1], c.b[q][0], c.a[q][2], c.a[q][3], c.b[q][1]);
            text += s;
        }
        std::snprintf(s, sizeof s,
                      "every %.17g: tau = 0, q = 1; q = 0 where %.17g*x + %.17g*y + %.17g*tau "
                      "reaches %.17g",
                      c.clock, c.c[0], c.c[1], c.ramp, c.level);
        return text + s;
    }

private:
    using Pair = std::array<Long, 2>;

    static Pair pushed(const Pair& x, const Nudge& nudge) {
        return {x[0] + nudge.of(0), x[1] + nudge.of(1)};
    }
    Long below(const Pair& x, Long tau) const {
        const Converter& c = law.converter;
        return Long(c.level) - Long(c.c[0]) * x[0] - Long(c.c[1]) * x[1] - Long(c.ramp) * tau;
    }
    Long norm() const {
        Long sum = 0.1L;
        for (const auto& a : law.converter.a)
            for (const double each : a)
                sum += std::abs(Long(each));
        return sum;
    }
    Pair moved(const Pair& x, bool on, Long d) const {
        const auto& a = law.converter.a[on];
        const auto& b = law.converter.b[on];
        const Long a11 = a[0], a12 = a[1], a21 = a[2], a22 = a[3], det = a11 * a22 - a12 * a21;
        const Pair rest{-(a22 * Long(b[0]) - a12 * Long(b[1])) / det,
                        -(a11 * Long(b[1]) - a21 * Long(b[0])) / det};
        const Pair w{x[0] - rest[0], x[1] - rest[1]};
        const Long mean = (a11 + a22) / 2, square = mean * mean - det,
                   root = std::sqrt(std::abs(square));
        const Long c = square > 0 ? std::cosh(root * d) : std::cos(root * d),
                   s = root == 0    ? d
                       : square > 0 ? std::sinh(root * d) / root
                                    : std::sin(root * d) / root;
        const Long grown = std::exp(mean * d);
        return {rest[0] + grown * (c * w[0] + s * ((a11 - mean) * w[0] + a12 * w[1])),
                rest[1] + grown * (c * w[1] + s * (a21 * w[0] + (a22 - mean) * w[1]))};
    }
};

inline std::unique_ptr<ConverterProblem> draw_converter(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<ConverterProblem>();
    q->law.converts = true;
    q->counts_jumps = true;
    Converter& c = q->law.converter;
    // a boost converter: L x' = E - (1 - q) y - r x, C y' = (1 - q) x - y/R
    const double L = dice.uniform(0.5, 2), C = dice.uniform(0.5, 4), R = dice.uniform(1, 20),
                 r = dice.uniform(0.01, 0.3), E = dice.uniform(0.5, 2);
    c.a[0] = {-r / L, -1 / L, 1 / C, -1 / (R * C)};
    c.a[1] = {-r / L, 0, 0, -1 / (R * C)};
    c.b[0] = c.b[1] = {E / L, 0};
    if (dice.chance(0.4)) // or anything alike
        for (auto& a : c.a)
            for (double& each : a)
                each += dice.uniform(-0.2, 0.2);
    c.c = {1, dice.chance(0.6) ? 0 : dice.uniform(-0.3, 0.3)};
    c.clock = dice.logarithmic(0.05, 1.5);
    c.ramp = dice.chance(0.5) ? 0 : dice.uniform(0, 1);
    c.level = dice.uniform(0.8, 3);
    q->disguise.n = 4;
    q->disguise.draw(dice, 1, false);
    q->disguise.size[3] = 1;
    q->pace = std::min(1.0, c.clock);
    const double t0 = dice.chance(0.5) ? 0 : dice.uniform(0, 10);
    q->t0 = t0 / q->disguise.speed;
    q->t_end = (t0 + c.clock * dice.uniform(3, 25)) / q->disguise.speed;
    if (dice.chance(0.5))
        q->disguise.period =
            c.clock * (dice.chance(0.5) ? 1 : dice.uniform(0.5, 2)) / q->disguise.speed;
    Natural z{c.level * dice.uniform(0.1, 0.8), dice.uniform(0, 3), c.clock * dice.uniform(0, 0.95),
              dice.chance(0.5) ? 1.0L : 0.0L};
    if (c.c[0] * z[0] + c.c[1] * z[1] + c.ramp * z[2] >
        0.99L * c.level) // (beyond it nothing is on)
        z[3] = 0;
    q->x0 = q->disguise.seen(z);
    return q;
}

} // namespace filippov::strangers
