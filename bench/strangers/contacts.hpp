// SPDX-License-Identifier: BSD-3-Clause
// Contacts after impacts on moving floors: flights are antiderivatives, in contact the force is a
// function of time, and the body takes off at its root.
#pragma once

#include "jumps.hpp"

#include <algorithm>

namespace filippov::strangers {

/// The exact path of one body.
class BodyPath {
public:
    BodyPath(const Body& body, Long y, Long v, Long t, Long t_end, Long nudge)
        : body_(body), rate_(nudge / Long(body.pace())), nudge_(std::abs(nudge)), t_(t),
          y_(y + nudge), v_(v + nudge) {
        const Long step = std::min(Long(body.pace()), (t_end - t) / 64);
        while (known) {
            const bool resting = resting_;
            const Long root = first_root(
                [&](Long at) { return resting ? pressure(at) : height(at) - floor(at, 0); }, t_,
                t_end, step);
            if (!(root <= t_end))
                break;
            const Long there = floor(root, 0), fast = resting ? floor(root, 1) : speed(root);
            if (resting)
                leave(root, there, fast);
            else
                hit(root, there, fast);
            known = known && ++events_ < 2000;
        }
        y_end = resting_ ? floor(t_end, 0) : height(t_end);
        v_end = resting_ ? floor(t_end, 1) : speed(t_end);
    }

    std::vector<std::pair<Long, int>> changes{};
    bool known = true;
    Long y_end = 0, v_end = 0, largest = 0;

private:
    Long force(Long t, int n) const { return body_.force.exact(t, n); }
    Long floor(Long t, int n) const { return body_.floor.exact(t, n); }
    Long pressure(Long t) const { return Long(body_.weight) - force(t, 0) - rate_ + floor(t, 2); }
    Long height(Long t) const {
        const Long d = t - t_;
        return y_ + v_ * d + (rate_ - Long(body_.weight)) * d * d / 2 + force(t, -2) -
               force(t_, -2) - force(t_, -1) * d;
    }
    Long speed(Long t) const {
        return v_ + (rate_ - Long(body_.weight)) * (t - t_) + force(t, -1) - force(t_, -1);
    }
    void set(Long t, Long y, Long v) {
        t_ = t, y_ = y, v_ = v;
        largest = std::max({largest, std::abs(y), std::abs(v)});
    }
    /// A flight has one step at least, and that errs by the nudge: however short it is, its landing
    /// is told no better than its height.
    void leave(Long t, Long y, Long v) {
        set(t, y + std::abs(nudge_), v);
        resting_ = false;
        taken_off_ = true;
        changes.emplace_back(t, 1);
    }
    void hit(Long t, Long y, Long v) {
        // Of a flight that is lower than a few tolerances nothing is known.
        const Long middle = t_ + (t - t_) / 2;
        known = known && !(taken_off_ && height(middle) - floor(middle, 0) < 100 * nudge_);
        taken_off_ = false;
        const Long w = floor(t, 1), back = Long(body_.e) * (w - v);
        set(t, y, w + back);
        Long push = pressure(t);
        const auto lower_than = [&](Long y_max) {
            return nudge_ > 0 && push > 0 && back * back < 2 * push * y_max;
        };
        const Long rounding = 64 * 0x1p-53L * (std::abs(y) + std::abs(t * w));
        if (back > 1e-11L && !lower_than(std::max(100 * nudge_, rounding)))
            return;
        // Bounces lower than a few tolerances end where they would under a constant force, but for
        // what is lower than rounding of doubles.
        if (back > 1e-11L) {
            t += 2 * back / (push * (1 - Long(body_.e))) - std::sqrt(rounding / push);
            push = pressure(t);
        }
        // the force decides whether it stays
        known = known && std::abs(push) > 1e-9L;
        set(t, floor(t, 0), floor(t, 1));
        if (push > 0) {
            resting_ = true;
            changes.emplace_back(t, 0);
        }
    }

    const Body& body_;
    Long rate_; ///< by which the force is off: what moves it by the nudge within its pace
    Long nudge_;
    Long t_, y_, v_;
    bool resting_ = false, taken_off_ = false;
    int events_ = 0;
};

class ContactProblem final : public Problem {
public:
    Jumping law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        Exactly e;
        e.slides = true;
        e.t = to;
        for (int j = 0; j < 2; ++j) {
            const auto at = std::size_t(2 * j);
            const BodyPath path(law.bodies.bodies[std::size_t(j)], z0[at], z0[at + 1], from, to,
                                nudge.of(j));
            if (!path.known)
                e.fate = Exactly::undecided;
            e.z[at] = path.y_end;
            e.z[at + 1] = path.v_end;
            e.largest =
                std::max({e.largest, path.largest, std::abs(path.y_end), std::abs(path.v_end)});
            for (const auto& [t, mode] : path.changes)
                e.changes.push_back({t, j, mode});
        }
        std::stable_sort(e.changes.begin(), e.changes.end(),
                         [](const Change& a, const Change& b) { return a.t < b.t; });
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_jumping(law, disguise, ask); }
    std::string text() const override {
        std::string text;
        for (const Body& body : law.bodies.bodies)
            text += "y'' = " + body.force.text() + " - " + digits(body.weight) +
                    ", y >= Y = " + body.floor.text() + ", e = " + digits(body.e) + ";  ";
        return text;
    }

private:
    static std::string digits(double v) {
        char s[40];
        std::snprintf(s, sizeof s, "%.17g", v);
        return s;
    }
};

inline std::unique_ptr<ContactProblem> draw_contact(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<ContactProblem>();
    const double fast = dice.logarithmic(0.5, 1000),
                 slow = std::min(fast, dice.logarithmic(0.5, 20));
    const double span = std::min(dice.uniform(2, 10), 150 / fast);
    const bool periodic = dice.chance(0.4);
    const double t0 = dice.chance(0.5) ? 0 : dice.uniform(0, 100);
    q->disguise.n = 4;
    q->disguise.draw(dice, 1, false);
    q->t0 = t0 / q->disguise.speed;
    q->t_end = (t0 + span) / q->disguise.speed;
    const Long t = Long(q->t0) * Long(q->disguise.speed);
    Natural z{};
    for (std::size_t j = 0; j < 2; ++j) {
        Body& body = q->law.bodies.bodies[j];
        body.weight = dice.uniform(0.5, 1.5);
        body.e = dice.chance(0.7) ? 0 : dice.uniform(0.1, 0.7);
        const double kind = dice.uniform(0, 1), part = dice.logarithmic(1e-3, 1);
        const double peak = body.weight * (1 + (dice.chance(0.8) ? part : -part / 2));
        body.floor = Wave(dice.uniform(-0.5, 0.5));
        if (kind < 0.7) { // a force that swings; else a floor that does
            body.force = dice.wave(1, fast, periodic, t0, span);
            double largest = 1e-9;
            for (double at = t0; at < t0 + span; at += std::min(body.force.pace() / 8, span / 64))
                largest = std::max(largest, double(body.force.exact(at, 0)));
            body.force.scale(peak / largest);
        }
        if (kind > 0.4) {
            const double f = periodic ? fast : slow;
            body.floor.add(
                {Term::wave, peak / (f * f) * (kind > 0.7 ? 1 : 0.3), f, dice.uniform(-3, 3)});
        }
        if (!periodic && dice.chance(0.3))
            body.floor.add({Term::power, dice.uniform(-0.3, 0.3), 1, t0});
        z[2 * j] = body.floor.exact(t, 0) + Long(dice.logarithmic(1e-3, 1) * std::min(1.0, span));
        z[2 * j + 1] = body.floor.exact(t, 1) + Long(dice.uniform(-1, 0.2));
        q->pace = std::min(q->pace, body.pace());
    }
    if (periodic && dice.chance(0.6))
        q->disguise.period = 12 * std::acos(-1.0) / fast / q->disguise.speed;
    q->x0 = q->disguise.seen(z);
    return q;
}

} // namespace filippov::strangers
