// SPDX-License-Identifier: BSD-3-Clause
// Three surfaces through one point of two dimensions: relays whose gradients are dependent. s is
// not unique where they meet, the velocity is.
#pragma once

#include "problem.hpp"

#include <functional>

namespace filippov::strangers {

/// z' = drift - sum c_j sign(a_j z) a_j in the plane, z2' = c2;  h_j = a_j z.
struct ThreeLines {
    std::array<std::array<double, 2>, 3> a{};
    std::array<double, 3> c{};
    std::array<double, 2> drift{};
    double c2 = 0;

    template <class S> void field(const S* s, S* f) const {
        for (std::size_t i = 0; i < 2; ++i) {
            f[i] = S(drift[i]);
            for (std::size_t j = 0; j < 3; ++j)
                f[i] = f[i] - S(c[j] * a[j][i]) * s[j];
        }
        f[2] = S(c2);
    }
    template <class S> S h(std::size_t j, const S* z) const {
        return S(a[j][0]) * z[0] + S(a[j][1]) * z[1];
    }
};

/// Defined in lines.cpp.
Told ask_lines(const ThreeLines& law, const Disguise& disguise, const Ask& ask);

/// The flow of least velocity, which is constant between lines.
class LinesProblem final : public Problem {
public:
    ThreeLines law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        Exactly e;
        e.slides = true;
        Pair z{z0[0] + nudge.of(0), z0[1] + nudge.of(1)};
        Long t = from;
        const Long near = 1e-13L * (1 + std::hypot(z[0], z[1]));
        for (int k = 0; t < to && k < 100; ++k) {
            std::array<int, 3> side{}; // 0: on it
            for (std::size_t j = 0; j < 3; ++j)
                side[j] = std::abs(height(j, z)) <= near ? 0 : height(j, z) < 0 ? -1 : 1;
            const Pair v = least_velocity(side);
            Long dt = to - t;
            for (std::size_t j = 0; j < 3; ++j)
                if (const Long rate = height(j, v); side[j] != 0 && Long(side[j]) * rate < 0)
                    dt = std::min(dt, -height(j, z) / rate);
            for (std::size_t i = 0; i < 2; ++i)
                z[i] += dt * v[i];
            t += dt;
            e.largest = std::max(e.largest, std::hypot(z[0], z[1]));
        }
        e.t = to;
        e.z = {z[0], z[1], z0[2] + Long(law.c2) * (to - from) + nudge.of(2), 0};
        e.largest = std::max(e.largest, std::abs(e.z[2]));
        return e;
    }
    Told ask(const Ask& ask) const override {
        Told told = ask_lines(law, disguise, ask);
        told.has_story = false; // which of three surfaces names an event is anyone's guess
        return told;
    }
    std::string text() const override {
        std::string text;
        char s[200];
        for (std::size_t j = 0; j < 3; ++j) {
            std::snprintf(s, sizeof s, " - %.17g*sign(%.17g*z0 + %.17g*z1)*(%.17g, %.17g)",
                          law.c[j], law.a[j][0], law.a[j][1], law.a[j][0], law.a[j][1]);
            text += s;
        }
        std::snprintf(s, sizeof s, "z' = (%.17g, %.17g)", law.drift[0], law.drift[1]);
        return s + text;
    }

private:
    using Pair = std::array<Long, 2>;

    Long height(std::size_t j, const Pair& z) const {
        return Long(law.a[j][0]) * z[0] + Long(law.a[j][1]) * z[1];
    }
    /// Of all velocities with these signs, a sign of 0 standing for any between, the shortest: of
    /// the set's corners, edges and inside.
    Pair least_velocity(const std::array<int, 3>& side) const {
        Pair base{law.drift[0], law.drift[1]};
        std::vector<std::size_t> free;
        for (std::size_t j = 0; j < 3; ++j) {
            if (side[j] == 0)
                free.push_back(j);
            for (std::size_t i = 0; i < 2; ++i)
                base[i] -= Long(side[j]) * Long(law.c[j]) * Long(law.a[j][i]);
        }
        // by projections in turn: they converge to the least distance of a sum of segments
        std::array<Long, 3> s{};
        Pair v = base;
        for (int sweep = 0; sweep < 100000; ++sweep) {
            Long moved = 0;
            for (const std::size_t j : free) {
                const Long c = law.c[j], size = c * (Long(law.a[j][0]) * law.a[j][0] +
                                                     Long(law.a[j][1]) * law.a[j][1]);
                const Long was = s[j];
                s[j] = std::clamp(was + height(j, v) / size, -1.0L, 1.0L);
                for (std::size_t i = 0; i < 2; ++i)
                    v[i] -= c * (s[j] - was) * Long(law.a[j][i]);
                moved = std::max(moved, std::abs(s[j] - was));
            }
            if (moved < 1e-19L)
                break;
        }
        for (Long& each : v) // at rest, or along a line, but for rounding
            if (std::abs(each) < 1e-16L)
                each = 0;
        return v;
    }
};

inline std::unique_ptr<Problem> draw_lines(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<LinesProblem>();
    q->coupled = true;
    q->disguise.n = 3;
    const double span = dice.uniform(0.5, 4);
    q->disguise.draw(dice, 5 + span, dice.chance(0.5));
    for (std::size_t j = 0; j < 3; ++j) {
        const double angle = std::acos(-1.0) * (double(j) + dice.uniform(-0.4, 0.4)) / 3;
        q->law.a[j] = {std::cos(angle), std::sin(angle)};
        if (dice.chance(0.3)) // friction on x, on y, and on their difference
            q->law.a[j] = {j == 1 ? 0.0 : 1.0, j == 0 ? 0.0 : j == 1 ? 1.0 : -1.0};
        q->law.c[j] = dice.uniform(0.3, 2);
    }
    // (a drift that the relays hold, or nearly)
    q->law.drift = {dice.uniform(-1, 1), dice.uniform(-1, 1)};
    q->law.c2 = dice.uniform(-1, 1);
    const double t0 = dice.chance(0.5) ? 0 : dice.uniform(0, 100);
    q->t0 = t0 / q->disguise.speed;
    q->t_end = (t0 + span) / q->disguise.speed;
    Natural z{dice.uniform(-1, 1), dice.uniform(-1, 1), dice.uniform(-1, 1), 0};
    if (dice.chance(0.3))
        z[0] = z[1] = 0;
    q->on_surface = z[0] == 0;
    q->x0 = q->disguise.seen(z);
    return q;
}

} // namespace filippov::strangers
