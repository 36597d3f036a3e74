// SPDX-License-Identifier: BSD-3-Clause
// Blocks on belts, driven by all sorts of forces: integrated by Gauss' method in extended
// precision, with its own law of sticking and its own search for events.
#pragma once

#include "gauss.hpp"
#include "one_surface.hpp"

namespace filippov::strangers {

/// Follows a block.
class BeltPath {
public:
    BeltPath(const BeltLaw& law, double pace, const Nudge& nudge)
        : law_(law), pace_(std::min(Long(pace), 0.4L)), nudge_(nudge) {}

    Exactly run(const Natural& z0, bool on_surface, Long from, Long to) {
        Exactly e;
        t_ = from;
        x_ = z0[0] + nudge_.of(0);
        v_ = z0[1] + nudge_.of(1);
        mode_ = on_surface ? mode_at_contact(e) : v_ > belt(t_, x_) ? 1 : -1;
        int short_steps = 8;
        while (t_ < to && e.fate == Exactly::ok) {
            const Long whole = std::min({pace_ * 0.5L, (to - from) / 16, to - t_});
            const Long d = short_steps-- > 0 ? std::min(whole, pace_ / 16) : whole;
            take(d);
            const Long theta =
                first_event(d, short_steps == 7 && (!e.changes.empty() || on_surface));
            e.slides = e.slides || mode_ == 0;
            if (theta > 1) {
                t_ = d < to - t_ ? t_ + d : to;
                x_ = at(x_, kx_, d, 1) + nudge_.of(0);
                v_ = mode_ == 0 ? belt(t_, x_) : at(v_, kv_, d, 1) + nudge_.of(1);
                farthest_ = std::max(farthest_, std::abs(v_ - belt(t_, x_)));
            } else if (theta < 0 || e.changes.size() > 2000) {
                e.fate = Exactly::undecided;
            } else {
                meet(e, theta * d);
                short_steps = 8;
            }
            e.largest = std::max({e.largest, std::abs(x_), std::abs(v_)});
        }
        e.t = to;
        const Long d = to - from, r0 = law_.r0, r1 = law_.r1;
        const Long w = r1 == 0 ? z0[2] + r0 * d : r0 / r1 + (z0[2] - r0 / r1) * std::exp(-r1 * d);
        e.z = {x_, v_, w + nudge_.of(2) * 20, 0};
        e.largest = std::max(e.largest, std::abs(w));
        return e;
    }

    /// The s that keeps the block on the belt.
    Long s(Long t, Long x) const {
        const Long v = belt(t, x);
        const Long pull = law_.belt.exact(t, 1) + Long(law_.v1) * std::cos(x) * v;
        return (force(law_.force.exact(t, 0), x, v) - pull) / law_.mu.exact(t, 0);
    }
    Long belt(Long t, Long x) const { return law_.belt.exact(t, 0) + Long(law_.v1) * std::sin(x); }

private:
    using Nodes = Gauss::Nodes;

    Long force(Long driven, Long x, Long v) const {
        return driven - Long(law_.k) * x - Long(law_.c) * v +
               (Long(law_.k3) * x + Long(law_.k4) * std::sin(x)) / (1 + x * x);
    }
    int mode_at_contact(Exactly& e) {
        v_ = belt(t_, x_);
        const Long now = s(t_, x_);
        if (std::abs(std::abs(now) - 1) < 1e-12L)
            e.fate = Exactly::undecided;
        return std::abs(now) < 1 ? 0 : now > 0 ? 1 : -1;
    }
    static Long at(Long y, const Nodes& k, Long d, Long theta) {
        Long sum = 0;
        for (int j = 0; j < Gauss::stages; ++j)
            sum += Gauss::method().weight(j, theta) * k[std::size_t(j)];
        return y + d * sum;
    }
    /// Stages of a step of length d.
    void take(Long d) {
        const Gauss& gauss = Gauss::method();
        static const auto a = [&] {
            std::array<Nodes, Gauss::stages> all{};
            for (std::size_t i = 0; i < Gauss::stages; ++i)
                for (std::size_t j = 0; j < Gauss::stages; ++j)
                    all[i][j] = gauss.weight(int(j), gauss.c[i]);
            return all;
        }();
        Nodes driven{}, moved{};
        for (std::size_t i = 0; i < Gauss::stages; ++i) {
            const Long t = t_ + d * gauss.c[i];
            if (mode_ == 0)
                moved[i] = law_.belt.exact(t, 0);
            else
                driven[i] = law_.force.exact(t, 0) - mode_ * law_.mu.exact(t, 0);
        }
        kx_ = kv_ = {};
        for (int turn = 0; turn < 60; ++turn) {
            Long change = 0;
            Nodes nx{}, nv{};
            for (std::size_t i = 0; i < Gauss::stages; ++i) {
                Long x = x_, v = v_;
                for (std::size_t j = 0; j < Gauss::stages; ++j) {
                    x += d * a[i][j] * kx_[j];
                    v += d * a[i][j] * kv_[j];
                }
                nx[i] = mode_ == 0 ? moved[i] + Long(law_.v1) * std::sin(x) : v;
                nv[i] = mode_ == 0 ? 0 : force(driven[i], x, v);
                change = std::max({change, std::abs(nx[i] - kx_[i]), std::abs(nv[i] - kv_[i])});
            }
            kx_ = nx;
            kv_ = nv;
            if (change * d < 1e-19L)
                break;
        }
    }
    /// What is positive as long as the mode lasts.
    Long margin(Long t, Long x, Long v) const {
        // (a dip of s beyond its end that is lower than the tolerance may be a touch; the last step
        // of a slip may err, too, however short it is)
        return mode_ == 0 ? 1 + 20 * nudge_.of(1) - std::abs(s(t, x))
                          : mode_ * (v - belt(t, x) + nudge_.of(1));
    }
    Long margin_within(Long d, Long theta) const {
        return margin(t_ + theta * d, at(x_, kx_, d, theta),
                      mode_ == 0 ? 0 : at(v_, kv_, d, theta));
    }
    /// Where in the step, by its polynomial; 2: nowhere; -1: nobody can tell.
    /// @param leaves  it begins at zero
    Long first_event(Long d, bool leaves) const {
        constexpr int n = 8;
        // (one sample before the step and one beyond: a minimum at its ends)
        Long m0 = leaves ? 1e30L : margin_within(d, -1.0L / n),
             m1 = leaves ? 1e30L : margin_within(d, 0);
        if (leaves && !(margin_within(d, 1.0L / 64) > 0))
            return -1;
        for (int k = 1; k <= n + 1; ++k) {
            const Long theta = Long(k) / n, m2 = margin_within(d, theta);
            if (!(m2 > 0) && k <= n)
                return narrowed(d, Long(k - 1) / n, theta);
            if (m1 <= m0 && m1 <= m2 && m0 < 1e29L) {
                Long a = Long(k - 2) / n, b = theta;
                for (int i = 0; i < 60 && b - a > 1e-10L; ++i) {
                    const Long c = a + (b - a) * 0.381966011250105151796L,
                               e = a + (b - a) * 0.618033988749894848204L;
                    const Long fc = margin_within(d, c), fe = margin_within(d, e);
                    if (!(fc > 0) && c >= 0 && c <= 1)
                        return narrowed(d, std::max(Long(k - 2) / n, 0.0L), c);
                    if (!(fe > 0) && e >= 0 && e <= 1)
                        return narrowed(d, std::max(Long(k - 2) / n, 0.0L), e);
                    (fc < fe ? b : a) = fc < fe ? e : c;
                }
            }
            m0 = m1;
            m1 = m2;
        }
        return 2;
    }
    Long narrowed(Long d, Long a, Long b) const {
        for (int i = 0; i < 60; ++i) {
            const Long c = a + (b - a) / 2;
            (margin_within(d, c) > 0 ? a : b) = c;
        }
        return b;
    }
    /// Goes to the event near t + d: by steps that end there, until they do.
    void meet(Exactly& e, Long d) {
        const Long t = t_, x = x_, v = v_;
        const auto value = [&](Long length) {
            t_ = t, x_ = x, v_ = v;
            take(length);
            return margin(t + length, at(x, kx_, length, 1), at(v, kv_, length, 1));
        };
        Long before = d * (1 - 1e-6L), f0 = value(before), f1 = value(d);
        for (int i = 0; i < 12 && f1 != f0; ++i) {
            const Long next = d - f1 * (d - before) / (f1 - f0);
            before = d, f0 = f1;
            d = next;
            f1 = value(d);
            if (std::abs(d - before) <= 1e-19L * (std::abs(t) + std::abs(d)))
                break;
        }
        // Of a slip that hardly leaves the belt, by a few tolerances, nothing is known.
        for (int k = 1; k < 8; ++k)
            farthest_ = std::max(farthest_, margin_within(d, Long(k) / 8));
        if (mode_ != 0 && slipped_ && farthest_ < 100 * nudge_.size)
            e.fate = Exactly::undecided;
        farthest_ = 0;
        slipped_ = mode_ == 0;
        t_ = t + d;
        x_ = at(x, kx_, d, 1);
        v_ = belt(t_, x_);
        const int before_it = mode_;
        mode_ = before_it == 0 ? (s(t_, x_) > 0 ? 1 : -1) : mode_at_contact(e);
        e.changes.push_back({t_, 0, mode_});
    }

    const BeltLaw& law_;
    Long pace_;
    Nudge nudge_;
    bool slipped_ = false; ///< this slip began at the end of a slide,
    Long farthest_ = 0;    ///< and came so far from the belt
    Long t_ = 0, x_ = 0, v_ = 0;
    int mode_ = 0;
    Nodes kx_{}, kv_{};
};

class BeltProblem final : public Problem {
public:
    OneSurface law{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        return BeltPath(law.belt_law, pace, nudge).run(z0, on_surface, from, to);
    }
    Told ask(const Ask& ask) const override { return ask_one_surface(law, disguise, ask); }
    std::string text() const override {
        const BeltLaw& l = law.belt_law;
        char rest[300];
        std::snprintf(rest, sizeof rest,
                      " - %.17g*s.x - %.17g*s.v + (%.17g*s.x + %.17g*np.sin(s.x))/(1 + s.x**2) - (",
                      l.k, l.c, l.k3, l.k4);
        char more[200];
        std::snprintf(more, sizeof more, ") - %.17g*np.sin(s.x)), %.17g - %.17g*s.w))", l.v1, l.r0,
                      l.r1);
        return "fp.system(state=\"x v w\")(lambda t, s, p: (s.v, " + l.force.text() + rest +
               l.mu.text() + ")*np.sign(s.v - (" + l.belt.text() + more;
    }
};

inline std::unique_ptr<BeltProblem> draw_belt(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<BeltProblem>();
    q->law.kind = OneSurface::belt;
    q->disguise.n = 3;
    const double fast = dice.logarithmic(0.5, 1000);
    const double span = std::min(dice.uniform(2, 12), (dice.chance(0.05) ? 500 : 80) / fast);
    const bool periodic = dice.chance(0.4);
    const double t0 = dice.chance(0.5) ? 0 : dice.uniform(0, 100);
    BeltLaw& law = q->law.belt_law;
    law.k = dice.chance(0.3) ? 0 : dice.uniform(0, 1.5);
    law.c = dice.chance(0.5) ? 0 : dice.uniform(-0.1, 0.5);
    law.k3 = dice.chance(0.6) ? 0 : dice.uniform(-1, 1);
    law.k4 = dice.chance(0.6) ? 0 : dice.uniform(-1, 1);
    const double mu = dice.uniform(0.4, 1.5);
    law.mu = Wave(mu);
    if (dice.chance(0.3)) {
        const Wave wave =
            dice.wave(0.2 * mu, periodic ? fast : dice.uniform(0.3, 3), true, t0, span);
        for (const Term& term : wave.terms)
            law.mu.add(term);
    }
    // a slow belt, often at rest
    const double moves = dice.uniform(0, 1);
    law.belt = Wave(moves < 0.3 ? 0 : moves < 0.6 ? dice.uniform(-0.1, 0.1) : dice.uniform(-1, 1));
    if (dice.chance(0.3)) {
        const double pace = periodic ? fast : dice.uniform(0.2, 3);
        Wave wave = dice.wave(0.2 * mu / pace, pace, true, t0, span);
        for (const Term& term : wave.terms)
            law.belt.add(term);
    }
    law.v1 = dice.chance(0.75) ? 0 : dice.uniform(-0.2, 0.2);
    law.r0 = dice.chance(0.5) ? 0 : dice.uniform(-0.5, 0.5);
    law.r1 = dice.chance(0.6) ? 0 : dice.uniform(0, 0.5);
    // amplitudes that are just enough
    law.force = dice.wave(1, fast, periodic, t0, span);
    double largest = 1e-9;
    for (double t = t0; t < t0 + span; t += std::min(law.force.pace() / 8, span / 64))
        largest = std::max(largest, double(std::abs(law.force.exact(t, 0))));
    const double offset = dice.chance(0.5) ? 0 : dice.uniform(-0.4, 0.4) * mu;
    const double part = dice.logarithmic(1e-4, 1) * (dice.chance(0.75) ? 1 : -0.5);
    law.force.scale((mu - std::abs(offset)) * (1 + part) / largest);
    law.force.add({Term::power, offset, 0, 0});

    q->pace = std::min({law.force.pace(), law.mu.pace(), law.belt.pace(), 0.4});
    q->disguise.draw(dice, 6 + span * span, dice.chance(0.25));
    if (periodic && dice.chance(0.6))
        q->disguise.period = 12 * std::acos(-1.0) / fast / q->disguise.speed;
    q->t0 = t0 / q->disguise.speed;
    q->t_end = (t0 + span) / q->disguise.speed;
    BeltPath path(law, q->pace, {});
    const Long t = Long(q->t0) * Long(q->disguise.speed), x = dice.uniform(-0.5, 0.5);
    q->on_surface = std::abs(path.s(t, x)) < 0.98L && dice.chance(0.7);
    Natural z{x, path.belt(t, x), dice.uniform(-1, 1), 0};
    if (!q->on_surface)
        z[1] += Long(dice.sign() * dice.uniform(0.05, 1));
    q->x0 = q->disguise.seen(z);
    return q;
}

} // namespace filippov::strangers
