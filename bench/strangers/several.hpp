// SPDX-License-Identifier: BSD-3-Clause
// Two surfaces at once: two relays that know nothing of each other, in changed variables in which
// both fields and surfaces are nonlinear and coupled.
#pragma once

#include "relay.hpp"

namespace filippov::strangers {

/// z_j' = a_j(t) - b_j s_j, z2' = c2;  h_j = (z_j - g_j(t)) (1 + factor_j z2^2).
struct TwoRelays {
    std::array<Relay, 2> relays{};
    std::array<double, 2> factor{};
    double c2 = 0;

    template <class S> void field(const S& t, const S* s, S* f) const {
        for (std::size_t j = 0; j < 2; ++j)
            f[j] = relays[j].a(t) - S(relays[j].b) * s[j];
        f[2] = S(c2);
    }
    template <class S> S h(std::size_t j, const S& t, const S* z) const {
        return (z[j] - relays[j].g(t)) * (S(1) + S(factor[j]) * z[2] * z[2]);
    }
};

/// Defined in several.cpp.
Told ask_several(const TwoRelays& law, const Disguise& disguise, const Ask& ask);

class SeveralProblem final : public Problem {
public:
    TwoRelays law{};
    std::array<bool, 2> begins_on{};

    Exactly follow(const Natural& z0, Long from, Long to, const Nudge& nudge) const override {
        Exactly e;
        e.t = to;
        for (int j = 0; j < 2; ++j) {
            const auto at = std::size_t(j);
            const RelayPath path(law.relays[at], z0[at], 0, begins_on[at] && to > from, from, to,
                                 nudge.of(j), std::min(pace, 1.0));
            if (!path.known)
                e.fate = Exactly::undecided;
            e.z[at] = path.z(path.time(to));
            for (std::size_t k = 0; k < path.pieces.size(); ++k) {
                const auto& p = path.pieces[k];
                if (k > 0)
                    e.changes.push_back({path.time(p.t), j, p.mode});
                e.slides = e.slides || p.mode == 0;
                e.largest = std::max(e.largest, std::abs(p.z));
            }
        }
        const Long way = to > from ? 1 : -1;
        std::stable_sort(e.changes.begin(), e.changes.end(),
                         [way](const Change& a, const Change& b) { return way * a.t < way * b.t; });
        e.z[2] = z0[2] + Long(law.c2) * (to - from) + nudge.size;
        e.largest = std::max({e.largest, std::abs(e.z[0]), std::abs(e.z[1]), std::abs(e.z[2])});
        return e;
    }
    Told ask(const Ask& ask) const override { return ask_several(law, disguise, ask); }
    std::string text() const override {
        std::string text = "fp.system(state=\"a b c\")(lambda t, s, p: (";
        char rest[60];
        for (std::size_t j = 0; j < 2; ++j) {
            std::snprintf(rest, sizeof rest, " - %.17g", law.relays[j].b);
            text += law.relays[j].a.text() + rest + "*np.sign(s." + (j == 0 ? "a" : "b") + " - (" +
                    law.relays[j].g.text() + ")), ";
        }
        std::snprintf(rest, sizeof rest, "%.17g))", law.c2);
        return text + rest;
    }
};

} // namespace filippov::strangers
