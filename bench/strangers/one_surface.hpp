// SPDX-License-Identifier: BSD-3-Clause
// Systems of three components and one surface: relays, blocks on belts, two-folds, gates. Which is
// known at run time, so that the engine is compiled once for all.
#pragma once

#include "relay.hpp"

namespace filippov::strangers {

/// z0' = a(t) - b s, z1' = c0 + c1 s, z2' = c2;  h = z0 - g(t).
struct RelayLaw {
    Relay relay;
    double c2 = 0;
    bool closed_form = false; ///< slides, at an even speed of the surface, are told in closed form
    double slope = 0;         ///< that speed

    template <class S> void field(const S& t, const S* z, const S& s, S* f) const {
        (void)z;
        f[0] = relay.a(t) - S(relay.b) * s;
        f[1] = S(relay.c0) + S(relay.c1) * s;
        f[2] = S(c2);
    }
    template <class S> S h(const S& t, const S* z) const { return z[0] - relay.g(t); }
};

/// A block on a belt: z0' = z1, z1' = F(t) - k z0 - c z1 + (k3 z0 + k4 sin(z0))/(1 + z0^2) -
/// mu(t) s, z2' = r0 - r1 z2;  h = z1 - V(t) - v1 sin(z0).
struct BeltLaw {
    Wave force, mu, belt;
    double k = 0, c = 0, k3 = 0, k4 = 0, v1 = 0, r0 = 0, r1 = 0;

    template <class S> void field(const S& t, const S* z, const S& s, S* f) const {
        using elementary::sin;
        f[0] = z[1];
        f[1] = force(t) - S(k) * z[0] - S(c) * z[1] - mu(t) * s;
        if (k3 != 0 || k4 != 0)
            f[1] = f[1] + (S(k3) * z[0] + S(k4) * sin(z[0])) / (S(1) + z[0] * z[0]);
        f[2] = S(r0) - S(r1) * z[2];
    }
    template <class S> S h(const S& t, const S* z) const {
        using elementary::sin;
        S height = z[1] - belt(t);
        if (v1 != 0)
            height = height - S(v1) * sin(z[0]);
        return height;
    }
};

/// Near a two-fold: z = (L1, -L2, h), so that h' = z0 below and -z1 above, and both components
/// change evenly: by `below` where h < 0, by `above` where h > 0.
struct TwoFoldLaw {
    std::array<double, 2> below{}, above{};

    template <class S> void field(const S&, const S* z, const S& s, S* f) const {
        const S up = (S(1) + s) * S(0.5), down = (S(1) - s) * S(0.5);
        for (std::size_t i = 0; i < 2; ++i)
            f[i] = down * S(below[i]) + up * S(above[i]);
        f[2] = down * z[0] - up * z[1];
    }
    template <class S> S h(const S&, const S* z) const { return z[2]; }
};

/// z0' = (1 + s)/2 - a z0, and (z1, z2) turn, or rest if the gate is one of time. It is open where
/// the cosine of its angle is above a level, or its tangent, or the angle below one.
struct GateLaw {
    enum Kind { pulse, pole, saw } kind = pulse;
    bool of_time = true;
    double a = 0, omega = 1, phase = 0, sharp = 1, level = 0;

    template <class S> void field(const S&, const S* z, const S& s, S* f) const {
        const S turn(of_time ? 0 : omega);
        f[0] = (S(1) + s) * S(0.5) - S(a) * z[0];
        f[1] = -turn * z[2];
        f[2] = turn * z[1];
    }
    template <class S> S h(const S& t, const S* z) const {
        using elementary::cos;
        using std::atan;
        using std::exp;
        using std::sqrt;
        using std::tan;
        const S angle = S(omega) * t + S(phase);
        if (kind == pulse) {
            const S c = of_time ? S(cos(angle)) : S(z[1] / sqrt(z[1] * z[1] + z[2] * z[2]));
            return exp(S(sharp) * (c - S(level))) - S(1);
        }
        const S ratio = of_time ? S(tan(angle)) : S(z[2] / z[1]);
        return kind == pole ? S(ratio - S(level)) : S(S(level) - atan(ratio));
    }
};

/// A section: W(t) + k0 z0 + k1 z1.
struct SectionLaw {
    bool watched = false;
    Wave wave{};
    double k0 = 0, k1 = 0;
};

struct OneSurface {
    enum Kind { relay, belt, two_fold, gate } kind = relay;
    RelayLaw relay_law{};
    BeltLaw belt_law{};
    TwoFoldLaw two_fold_law{};
    GateLaw gate_law{};
    SectionLaw section_law{};

    template <class S> void field(const S& t, const S* z, const S& s, S* f) const {
        switch (kind) {
        case relay:
            return relay_law.field(t, z, s, f);
        case belt:
            return belt_law.field(t, z, s, f);
        case gate:
            return gate_law.field(t, z, s, f);
        default:
            return two_fold_law.field(t, z, s, f);
        }
    }
    template <class S> S h(const S& t, const S* z) const {
        switch (kind) {
        case relay:
            return relay_law.h(t, z);
        case belt:
            return belt_law.h(t, z);
        case gate:
            return gate_law.h(t, z);
        default:
            return two_fold_law.h(t, z);
        }
    }
};

/// Defined in one_surface.cpp.
Told ask_one_surface(const OneSurface& law, const Disguise& disguise, const Ask& ask);

} // namespace filippov::strangers
