// SPDX-License-Identifier: BSD-3-Clause
// Two families of one relay: slides with constant fields, whose s is a function of time that swings
// up to a thousand times in a unit of time; and surfaces that swing under constant fields.
#pragma once

#include "one_surface.hpp"
#include "several.hpp"

namespace filippov::strangers {

class RelayProblem final : public Problem {
public:
    OneSurface law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const Relay& relay = law.relay_law.relay;
        const RelayPath path(relay, z0[0], z0[1], on_surface && to > from, from, to, nudge.of(0),
                             std::min(pace, 1.0));
        Exactly e;
        e.fate = path.known ? Exactly::ok : Exactly::undecided;
        e.t = to;
        const Long end = path.time(to), c2 = law.relay_law.c2;
        e.z = {path.z(end), path.y(end), z0[2] + c2 * (to - from) + nudge.size, 0};
        for (std::size_t k = 0; k < path.pieces.size(); ++k) {
            const auto& p = path.pieces[k];
            if (k > 0)
                e.changes.push_back({path.time(p.t), 0, p.mode});
            e.slides = e.slides || p.mode == 0;
            e.largest = std::max({e.largest, std::abs(p.z), std::abs(p.y)});
        }
        if (law.section_law.watched && path.known) {
            e.met = roots(path, end, 0);
            // (where the state's errors alone make roots or take them away)
            const SectionLaw& s = law.section_law;
            const Long few = 100 * std::abs(nudge.size) * (std::abs(s.k0) + std::abs(s.k1));
            for (const Long shift : {-few, few})
                if (few > 0 && roots(path, end, shift).size() != e.met.size())
                    e.fate = Exactly::undecided;
        }
        e.largest = std::max({e.largest, std::abs(e.z[0]), std::abs(e.z[1]), std::abs(e.z[2])});
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_one_surface(law, disguise, ask); }
    std::string text() const override {
        const RelayLaw& l = law.relay_law;
        const std::string sign = "np.sign(s.z - (" + l.relay.g.text() + "))";
        char rest[400];
        std::snprintf(rest, sizeof rest, " - %.17g*%s, %.17g + %.17g*%s, %.17g)", l.relay.b, "%s",
                      l.relay.c0, l.relay.c1, "%s", l.c2);
        std::string text = "fp.system(state=\"z y w\")(lambda t, s, p: (" + l.relay.a.text() + rest;
        for (std::size_t at; (at = text.find("%s")) != std::string::npos;)
            text.replace(at, 2, sign);
        if (law.section_law.watched) {
            char more[200];
            std::snprintf(more, sizeof more, " + %.17g*s.z + %.17g*s.y", law.section_law.k0,
                          law.section_law.k1);
            text += ", section " + law.section_law.wave.text() + more;
        }
        return text;
    }

private:
    /// When the section, and a little more, is zero.
    std::vector<Long> roots(const RelayPath& path, Long end, Long shift) const {
        const SectionLaw& s = law.section_law;
        const Long least = std::min({pace, s.wave.pace(), 1.0});
        std::vector<Long> met;
        for (std::size_t k = 0; k < path.pieces.size(); ++k) {
            const Long from = path.pieces[k].t,
                       to = k + 1 < path.pieces.size() ? path.pieces[k + 1].t : end;
            all_roots(
                [&](Long t) {
                    return s.wave.exact(path.time(t), 0) + Long(s.k0) * path.z(t) +
                           Long(s.k1) * path.y(t) + shift;
                },
                from, to, std::min(least, (to - from) / 16), met);
        }
        for (Long& t : met)
            t = path.time(t);
        return met;
    }
};

/// What these families have in common. In some, forces and surfaces have small ripples on top.
class RelayDrawn {
public:
    RelayDrawn(std::uint64_t seed, bool swings) : dice_(seed), swings_(swings) {}
    static RelayDrawn rippled(std::uint64_t seed) {
        RelayDrawn drawn(seed, false);
        drawn.ripples_ = true;
        drawn.swings_ = drawn.dice_.chance(0.5);
        return drawn;
    }

    std::unique_ptr<RelayProblem> problem() {
        auto q = std::make_unique<RelayProblem>();
        time_and_units(*q, dice_.chance(0.25));
        q->coupled = false;
        RelayLaw& law = q->law.relay_law;
        Relay& relay = law.relay;
        relay = this->relay();
        relay.c0 = dice_.chance(0.4) ? 0 : dice_.uniform(-1, 1);
        relay.c1 = dice_.chance(swings_ ? 0.2 : 0.7) ? 0 : dice_.uniform(-1, 1);
        law.c2 = dice_.chance(0.5) ? 0 : dice_.uniform(-1, 1);
        q->pace = std::min(relay.pace(), 1.0);
        section(*q);
        start(*q);
        declare_period(*q);
        const bool even =
            !swings_ && relay.c1 == 0 && q->disguise.bend == decltype(q->disguise.bend){};
        law.closed_form = even && dice_.chance(0.6);
        law.slope = double(relay.g.exact(t0_, 1));
        return q;
    }

    /// Two relays side by side.
    std::unique_ptr<SeveralProblem> two_problem() {
        auto q = std::make_unique<SeveralProblem>();
        time_and_units(*q, true);
        q->coupled = true;
        const Long t = Long(q->t0) * Long(q->disguise.speed);
        Natural z{0, 0, dice_.uniform(-1, 1), 0};
        for (std::size_t j = 0; j < 2; ++j) {
            swings_ = dice_.chance(0.5);
            const Relay relay = q->law.relays[j] = this->relay();
            q->law.factor[j] = dice_.uniform(0, 1);
            q->pace = std::min({q->pace, relay.pace(), 1.0});
            q->begins_on[j] = begins_on(relay, t);
            z[j] = relay.g.exact(t, 0);
            if (!q->begins_on[j])
                z[j] += Long(dice_.sign() * dice_.uniform(0.05, 1));
        }
        q->law.c2 = dice_.chance(0.5) ? 0 : dice_.uniform(-1, 1);
        q->x0 = q->disguise.seen(z);
        declare_period(*q);
        return q;
    }

private:
    void time_and_units(Problem& q, bool curved) {
        fast_ = dice_.logarithmic(0.5, 1000);
        span_ = std::min(dice_.uniform(2, 12), (dice_.chance(0.05) ? 1000 : 150) / fast_);
        periodic_ = !ripples_ && dice_.chance(0.4);
        if (ripples_) {
            fast_ = dice_.logarithmic(50, 3000);
            span_ = std::min(dice_.uniform(2, 12), 2000 / fast_);
        }
        t0_ = dice_.chance(0.5) ? 0 : dice_.uniform(0, 100);
        q.disguise.n = 3;
        q.disguise.draw(dice_, 5 + span_, curved);
        q.t0 = t0_ / q.disguise.speed;
        q.t_end = (t0_ + span_) / q.disguise.speed;
        q.back = true;
    }
    void declare_period(Problem& q) {
        if (periodic_ && dice_.chance(0.6))
            q.disguise.period = 12 * std::acos(-1.0) / fast_ / q.disguise.speed;
    }
    bool begins_on(const Relay& relay, Long t) {
        const Long s = (relay.a.exact(t, 0) - relay.g.exact(t, 1)) / Long(relay.b);
        return relay.b > 0 && std::abs(s) < 0.98L && dice_.chance(0.7);
    }
    Wave wave() {
        return ripples_ ? dice_.rippled(1, fast_, span_)
                        : dice_.wave(1, fast_, periodic_, t0_, span_);
    }
    Relay relay() {
        Relay relay;
        relay.b = dice_.uniform(0.5, 2);
        if (swings_) {
            relay.a = Wave(dice_.uniform(-0.6, 0.6));
            const double kind = dice_.uniform(0, 1);
            relay.b = kind < 0.3 ? 0 : kind < 0.8 ? relay.b : -relay.b;
            relay.g = wave();
            relay.g.add({Term::power, dice_.uniform(-0.5, 0.5), 0, 0});
            if (relay.b > 0 && dice_.chance(0.7))
                relay.g.scale(beyond(relay));
            else if (dice_.chance(0.3))
                relay.g.scale(1 / fast_);
        } else {
            const double c = periodic_ || dice_.chance(0.3) ? 0 : dice_.uniform(-0.5, 0.5);
            relay.a = wave();
            relay.a.add({Term::power, dice_.uniform(-0.5, 0.5), 0, 0});
            relay.a.scale(beyond(relay));
            relay.a.add({Term::power, c, 0, 0});
            relay.g = Wave(dice_.uniform(-1, 1));
            relay.g.add({Term::power, c, 1, t0_});
        }
        return relay;
    }
    /// By what the forcing is to be multiplied, so that the largest |s| is beyond 1 by something
    /// between 1e-5 and 1/2, or short of it, or anything.
    double beyond(const Relay& relay) {
        double largest = 1e-9;
        const double step = std::min(relay.pace() / 16, span_ / 64);
        for (double t = t0_; t < t0_ + span_; t += step)
            largest = std::max(
                largest, double(std::abs(relay.a.exact(t, 0) - relay.g.exact(t, 1)) / relay.b));
        if (dice_.chance(0.25))
            return dice_.uniform(0.5, 3) / largest;
        const double part = dice_.logarithmic(1e-5, 0.5);
        return (1 + (dice_.chance(0.7) ? part : -part)) / largest;
    }
    void section(RelayProblem& q) {
        if (!dice_.chance(0.5))
            return;
        SectionLaw& s = q.law.section_law;
        s.watched = true;
        s.wave = ripples_
                     ? wave()
                     : dice_.wave(1, dice_.chance(0.5) ? fast_ : dice_.logarithmic(0.5, fast_ + 1),
                                  false, t0_, span_);
        s.wave.add({Term::power, dice_.uniform(-1.2, 1.2), 0, 0});
        s.k0 = dice_.chance(0.5) ? 0 : dice_.uniform(-1, 1);
        s.k1 = dice_.chance(0.5) ? 0 : dice_.uniform(-1, 1);
    }
    void start(RelayProblem& q) {
        const Relay& relay = q.law.relay_law.relay;
        const Long t = Long(q.t0) * Long(q.disguise.speed);
        q.on_surface = begins_on(relay, t);
        Natural z{relay.g.exact(t, 0), dice_.uniform(-1, 1), dice_.uniform(-1, 1), 0};
        if (!q.on_surface)
            z[0] += Long(dice_.sign() * dice_.uniform(0.05, 1));
        q.x0 = q.disguise.seen(z);
    }

    Dice dice_;
    bool swings_, ripples_ = false, periodic_ = false;
    double fast_ = 1, span_ = 1, t0_ = 0;
};

} // namespace filippov::strangers
