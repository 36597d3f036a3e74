// SPDX-License-Identifier: BSD-3-Clause
// What holds a solution without two fields that push against each other: the bottom of a tank, a
// law that ends like a root, a twisting law. Where the state is held it is known.
#pragma once

#include "one_surface.hpp"

namespace filippov::strangers {

/// A problem of one surface of which only the end is compared: where something rests, `s` and the
/// side are anyone's guess.
class HeldProblem : public Problem {
public:
    OneSurface law{};

    Told ask(const Ask& ask) const override {
        Told told = ask_one_surface(law, disguise, ask);
        told.has_story = false;
        return told;
    }

protected:
    static std::string typed(const char* form, std::initializer_list<double> values,
                             const std::string& wave) {
        char s[600];
        std::vector<double> v(values);
        v.resize(6);
        std::snprintf(s, sizeof s, form, v[0], v[1], v[2], v[3], v[4], v[5]);
        return s + std::string(", with w = ") + wave;
    }
};

/// A tank that runs empty, stays so, and fills again.
class TankProblem final : public Problem {
public:
    OneSurface law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const TankLaw& l = law.tank_law;
        const Long rate = nudge.of(0) / Long(std::min(pace, 1.0));
        const auto grown = [&](Long a, Long b) {
            return l.inflow.exact(b, -1) - l.inflow.exact(a, -1) + rate * (b - a);
        };
        Exactly e;
        e.slides = true;
        Long t = from, z = std::max(z0[0] + nudge.of(0), Long(0));
        bool empty = !(z > std::abs(nudge.size)) && on_surface;
        if (empty) {
            z = 0;
            empty = l.inflow.exact(t, 0) < 0;
        }
        const Long step = std::min((to - from) / 64, Long(std::min(pace, 1.0)));
        for (int k = 0; t < to; ++k) {
            const Long was = z, began = t;
            const Long root =
                empty ? first_root([&](Long at) { return -l.inflow.exact(at, 0); }, t, to, step)
                      : first_root([&](Long at) { return was + grown(began, at); }, t, to, step);
            t = std::min(root, to);
            z = empty ? 0 : was + grown(began, t);
            // (of a puddle of some errors nobody knows whether it was there)
            const Long middle = was + grown(began, began + (t - began) / 2);
            if ((!empty && k > 0 && middle < 100 * std::abs(nudge.size)) || k > 2000)
                e.fate = Exactly::undecided;
            e.largest = std::max({e.largest, std::abs(z), std::abs(middle)});
            if (root <= to) {
                empty = !empty;
                z = 0;
                e.changes.push_back({t, 0, empty ? 0 : 1});
            }
        }
        e.t = to;
        e.z = {z, z0[1] + Long(l.c0) * (to - from) + Long(l.c1) * (z - z0[0]) + nudge.of(1),
               z0[2] + Long(l.c2) * (to - from) + nudge.of(2), 0};
        e.largest = std::max({e.largest, std::abs(e.z[1]), std::abs(e.z[2])});
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_one_surface(law, disguise, ask); }
    std::string text() const override {
        const TankLaw& l = law.tank_law;
        char s[200];
        std::snprintf(s, sizeof s, "; z1' = %.17g + %.17g*z0', z2' = %.17g", l.c0, l.c1, l.c2);
        return "z0' = q where z0 > 0, else np.maximum(q, 0), q = " + l.inflow.text() + s;
    }
};

/// Runs out like a root, and stays out.
class RootProblem final : public HeldProblem {
public:
    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const RootLaw& l = law.root_law;
        const Long z = z0[0] + nudge.of(0), part = 1 - Long(l.a);
        const Long left =
            std::pow(std::abs(z), part) - part * (l.k.exact(to, -1) - l.k.exact(from, -1));
        Exactly e;
        e.slides = true;
        e.t = to;
        const bool still = z < 0 && !l.both; // nothing runs out below
        e.z[0] = still ? z : left > 0 ? std::copysign(std::pow(left, 1 / part), z) : Long(0);
        e.z[1] = z0[1] + Long(l.c0) * (to - from) + Long(l.c1) * (e.z[0] - z0[0]) + nudge.of(1);
        e.z[2] = z0[2] + Long(l.c2) * (to - from) + nudge.of(2);
        e.largest = std::max({std::abs(z), std::abs(e.z[1]), std::abs(e.z[2])});
        return e;
    }
    std::string text() const override {
        const RootLaw& l = law.root_law;
        return typed("z0' = -w*abs(z0)**%.17g*sign(z0)%.0s, z1' = %.17g + %.17g*z0', z2' = %.17g",
                     {l.a, 0, l.c0, l.c1, l.c2}, l.k.text()) +
               (l.both ? "" : ", z0' = 0 below");
    }
};

/// A twisting law that comes to its slide of second order, and holds.
class TwistingProblem final : public HeldProblem {
public:
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
    std::string text() const override {
        const TwistingLaw& l = law.twisting_law;
        return typed("z0' = -%.17g*sqrt(abs(z0))*sign(z0) + z1 + w, z1' = %.17g - %.17g*sign(z0), "
                     "z2' = %.17g",
                     {l.k, l.e, l.b, l.c2}, l.d.text());
    }
};

namespace detail {

/// Times, units and coordinates of a problem with a wave of this frequency.
inline void begin_held(Problem& q, Dice& dice, double span) {
    q.disguise.n = 3;
    q.disguise.draw(dice, 5 + span, dice.chance(0.5));
    const double t0 = dice.chance(0.5) ? 0 : dice.uniform(0, 100);
    q.t0 = t0 / q.disguise.speed;
    q.t_end = (t0 + span) / q.disguise.speed;
}

} // namespace detail

inline std::unique_ptr<Problem> draw_tank(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<TankProblem>();
    const double fast = dice.logarithmic(0.5, 300),
                 span = std::min(dice.uniform(2, 12), 100 / fast);
    detail::begin_held(*q, dice, span);
    q->law.kind = OneSurface::tank;
    TankLaw& l = q->law.tank_law;
    const double t0 = q->t0 * q->disguise.speed;
    l.inflow = dice.wave(1, fast, dice.chance(0.4), t0, span);
    l.inflow.add({Term::power, dice.uniform(-0.5, 0.3), 0, 0});
    l.c0 = dice.uniform(-1, 1);
    l.c1 = dice.uniform(-1, 1);
    l.c2 = dice.uniform(-1, 1);
    q->pace = std::min(l.inflow.pace(), 1.0);
    q->on_surface = dice.chance(0.4);
    q->x0 = q->disguise.seen({q->on_surface ? Long(0) : Long(dice.logarithmic(1e-3, 2) / fast),
                              dice.uniform(-1, 1), dice.uniform(-1, 1), 0});
    return q;
}

inline std::unique_ptr<Problem> draw_root(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<RootProblem>();
    const double fast = dice.logarithmic(0.5, 30), span = dice.uniform(1, 8);
    detail::begin_held(*q, dice, span);
    q->law.kind = OneSurface::root;
    RootLaw& l = q->law.root_law;
    l.a = dice.chance(0.5) ? 0.5 : dice.uniform(0.05, 0.9);
    l.both = dice.chance(0.6);
    l.k = dice.wave(0.4, fast, true, 0, span);
    l.k.add({Term::power, dice.uniform(1, 3), 0, 0}); // it always runs out
    l.c0 = dice.uniform(-1, 1);
    l.c1 = dice.uniform(-1, 1);
    l.c2 = dice.uniform(-1, 1);
    q->pace = std::min(l.k.pace(), 1.0);
    const double z = dice.chance(0.2) ? 0 : dice.logarithmic(1e-3, 5) * (l.both ? dice.sign() : 1);
    q->on_surface = z == 0;
    q->x0 = q->disguise.seen({z, dice.uniform(-1, 1), dice.uniform(-1, 1), 0});
    return q;
}

inline std::unique_ptr<Problem> draw_twisting(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<TwistingProblem>();
    const double fast = dice.logarithmic(0.1, 3), span = dice.uniform(15, 30);
    detail::begin_held(*q, dice, span);
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
