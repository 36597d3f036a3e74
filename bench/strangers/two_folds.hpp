// SPDX-License-Identifier: BSD-3-Clause
// Slides near a two-fold. In z = (L1, -L2, h), with even fields on both sides, the sliding field
// times L1 - L2 is linear, so that slides are matrix exponentials: they end at one of the folds,
// which is visible, or in the two-fold, which attracting nodes reach in finite time.
#pragma once

#include "one_surface.hpp"

#include <optional>

namespace filippov::strangers {

class TwoFoldProblem final : public Problem {
public:
    OneSurface law{};
    double c2 = 0;

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        const Long spread = 20 * (1 + to - from);
        const std::array<Long, 2> w0{z0[0] + spread * nudge.of(0), z0[1] + spread * nudge.of(1)};
        Exactly e;
        e.slides = true;
        e.largest = std::max(std::abs(z0[0]), std::abs(z0[1]));
        const Long least = std::min(w0[0], w0[1]);
        if (!(least > 0)) {
            e.fate = Exactly::undecided;
            return e;
        }
        // in steps of the desingularised time
        const Long step = 0.5L / norm();
        for (Long tau = 0; tau < 400 / norm(); tau += step) {
            const Long root = first_root(
                [&](Long at) {
                    const auto w = slid(w0, at);
                    return std::min(w[0], w[1]) / (std::abs(w[0]) + std::abs(w[1]));
                },
                tau, tau + step, step);
            const Long last = std::min(root, tau + step);
            if (from + time(w0, last) >= to)
                return still_sliding(e, w0, tau, last, from, to);
            const auto w = slid(w0, last);
            // What leaves some errors beside the two-fold may as well end in it.
            if (w[0] + w[1] < std::max(1e-15L, 400 * nudge.size)) {
                e.fate = Exactly::stops;
                e.t = from + rest(w0);
                return e;
            }
            if (root <= tau + step)
                return leaves(e, w, from + time(w0, root), to);
        }
        e.fate = Exactly::undecided;
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_one_surface(law, disguise, ask); }
    std::string text() const override {
        const TwoFoldLaw& l = law.two_fold_law;
        char s[400];
        std::snprintf(s, sizeof s,
                      "fp.System(\"u v h\", fields={\"-\": lambda t, s, p: (%.17g, %.17g, s.u), "
                      "\"+\": lambda t, s, p: (%.17g, %.17g, -s.v)}, switch=\"h\")",
                      l.below[0], l.below[1], l.above[0], l.above[1]);
        return s;
    }

    /// Where it ends, if nothing ends it before.
    Exactly fate_of(const Natural& z0) const { return follow(z0, 0, 1e4L, {}); }
    bool solvable() const { return std::abs(determinant()) > 0.02L; }

private:
    // d(u, v)/dtau = M (u, v) = u above + v below, dt/dtau = u + v
    Long m(int i, int j) const {
        const TwoFoldLaw& l = law.two_fold_law;
        return j == 0 ? l.above[std::size_t(i)] : l.below[std::size_t(i)];
    }
    Long norm() const {
        return std::abs(m(0, 0)) + std::abs(m(0, 1)) + std::abs(m(1, 0)) + std::abs(m(1, 1));
    }
    Long determinant() const { return m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0); }
    std::array<Long, 2> slid(const std::array<Long, 2>& w, Long tau) const {
        const Long mean = (m(0, 0) + m(1, 1)) / 2, d = mean * mean - determinant(),
                   root = std::sqrt(std::abs(d));
        const Long c = d > 0 ? std::cosh(root * tau) : std::cos(root * tau),
                   s = root == 0 ? tau
                       : d > 0   ? std::sinh(root * tau) / root
                                 : std::sin(root * tau) / root;
        const Long grown = std::exp(mean * tau);
        return {grown * (c * w[0] + s * ((m(0, 0) - mean) * w[0] + m(0, 1) * w[1])),
                grown * (c * w[1] + s * (m(1, 0) * w[0] + (m(1, 1) - mean) * w[1]))};
    }
    /// 1^T M^-1 w
    Long sum_of_inverse(const std::array<Long, 2>& w) const {
        return ((m(1, 1) - m(1, 0)) * w[0] + (m(0, 0) - m(0, 1)) * w[1]) / determinant();
    }
    Long time(const std::array<Long, 2>& w0, Long tau) const {
        return sum_of_inverse(slid(w0, tau)) - sum_of_inverse(w0);
    }
    Long rest(const std::array<Long, 2>& w0) const { return -sum_of_inverse(w0); }

    Exactly still_sliding(Exactly e, const std::array<Long, 2>& w0, Long a, Long b, Long from,
                          Long to) const {
        for (int k = 0; k < 100; ++k) {
            const Long c = a + (b - a) / 2;
            (from + time(w0, c) < to ? a : b) = c;
        }
        const auto w = slid(w0, b);
        e.t = to;
        e.z = {w[0], w[1], 0, 0};
        return e;
    }
    Exactly leaves(Exactly e, const std::array<Long, 2>& w, Long t, Long to) const {
        const bool down = w[0] < w[1];
        const auto& rate = down ? law.two_fold_law.below : law.two_fold_law.above;
        const Long d = to - t;
        e.changes.push_back({t, 0, down ? -1 : 1});
        e.t = to;
        e.z = {(down ? 0 : w[0]) + Long(rate[0]) * d, (down ? w[1] : 0) + Long(rate[1]) * d,
               down ? Long(rate[0]) * d * d / 2 : -Long(rate[1]) * d * d / 2, 0};
        for (const Long z : e.z)
            e.largest = std::max(e.largest, std::abs(z));
        return e;
    }
};

inline std::unique_ptr<TwoFoldProblem> draw_two_fold(std::uint64_t seed) {
    Dice dice(seed);
    auto q = std::make_unique<TwoFoldProblem>();
    q->law.kind = OneSurface::two_fold;
    q->disguise.n = 3;
    const bool node = dice.chance(0.5);
    for (;;) {
        TwoFoldLaw& law = q->law.two_fold_law;
        for (auto* side : {&law.below, &law.above})
            for (double& rate : *side)
                rate = dice.uniform(-1.5, 1.5);
        const Natural z{dice.uniform(0.1, 1), dice.uniform(0.1, 1), 0, 0};
        if (!q->solvable())
            continue;
        const Exactly e = q->fate_of(z);
        if (e.fate == Exactly::undecided || node != (e.fate == Exactly::stops))
            continue;
        const double last = double(e.fate == Exactly::stops ? e.t
                                   : e.changes.empty()      ? 10.0L
                                                            : e.changes[0].t);
        const double span =
            std::min(last * (dice.chance(0.85) ? dice.uniform(1.05, 2) : 0.9), 20.0);
        q->disguise.draw(dice, 4 + 2 * span * span, dice.chance(0.4));
        const double t0 = dice.chance(0.5) ? 0 : dice.uniform(-20, 20);
        q->t0 = t0 / q->disguise.speed;
        q->t_end = (t0 + span) / q->disguise.speed;
        q->x0 = q->disguise.seen(z);
        q->on_surface = true;
        if (dice.chance(0.3))
            q->disguise.period = dice.uniform(0.5, 3) / q->disguise.speed;
        return q;
    }
}

} // namespace filippov::strangers
