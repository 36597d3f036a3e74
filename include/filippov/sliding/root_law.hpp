// SPDX-License-Identifier: BSD-3-Clause
// Where h' falls to zero like a root of h: the surface is reached in finite time, with no speed.
#pragma once

#include <filippov/sliding/intersection.hpp>
#include <filippov/sliding/mode.hpp>

#include <array>
#include <cmath>

namespace filippov {

/// What h' is on one side of a surface, near to it: h' = at_zero + c h^exponent.
template <class S> struct RootLaw {
    S rate = S(0);     ///< h' at the width of the layer, in the direction of time
    S at_zero = S(0);  ///< h' at the surface
    S exponent = S(0); ///< between 0 and 1; 0: there is no such law

    bool holds() const { return exponent > S(0); }
    /// True if the root leads away from the surface on this side of it.
    bool grows(int side) const { return holds() && S(side) * (rate - at_zero) > S(0); }
};

/// The law by three values of h', at the width of the layer, a quarter and a sixteenth of it.
/// @param noise  what is rounding of them
template <class S> FILIPPOV_COLD RootLaw<S> root_law(const std::array<S, 3>& rate, const S& noise) {
    using std::abs;
    using std::log;
    const S far = rate[0] - rate[1], near = rate[1] - rate[2], ratio = far / near;
    RootLaw<S> law{rate[0], rate[0], S(0)};
    // 4^a of exponents from 0.02 to 0.95: no jump, and no linear law
    if (!(abs(near) > noise && ratio > S(1.03) && ratio < S(3.73)))
        return law;
    law.exponent = log(ratio) / log(S(4));
    law.at_zero = rate[0] - far * ratio / (ratio - S(1));
    return law;
}

/// The law of h_j' on the side of surface j that `mode` names.
/// @param layers  of the surfaces `on`, of which j is one, those slid on included
/// @param x       on all of them
template <class Sys, class S>
FILIPPOV_COLD RootLaw<S> root_law(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j,
                                  const Layers<Sys, S>& layers,
                                  const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                  const State<Sys, S>& x, const Params<Sys, S>& p, int direction) {
    using std::abs;
    std::array<S, 3> rate{};
    S noise(0);
    Layers<Sys, S> nearer = layers;
    nearer.kept[std::size_t(j)] = true;
    for (S& l : rate) {
        const State<Sys, S> y = beside(sys, nearer, mode, on, t, x, p);
        const State<Sys, S> f = mode_field(sys, mode, t, y, p, &nearer);
        l = S(direction) * normal_component(sys, j, t, y, p, f);
        noise = std::max(noise, rate_rounding(sys, j, t, y, p, f));
        nearer.width[j] /= S(4);
    }
    RootLaw<S> law = root_law(rate, S(S(100) * noise));
    if (abs(law.rate) <= noise)
        law.rate = S(0);
    return law;
}

/// True if h_j' at the surface, of which the roots leave nothing, is led away from zero by the
/// fields of both sides: what rests on the surface does so on a needle's point. (What falls short
/// of a root is made up for by another component, as of a super-twisting law with the wrong sign.)
/// @param layers, on, x  see `root_law`
template <class Sys, class S>
FILIPPOV_COLD bool repels_to_second_order(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j,
                                          const Layers<Sys, S>& layers,
                                          const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                          const State<Sys, S>& x, const Params<Sys, S>& p,
                                          int direction, const S& tau) {
    using std::abs;
    const auto seen_from = [&](int side) {
        Mode<surfaces_v<Sys>> there = mode;
        there.set(j, side);
        return there;
    };
    Mode<surfaces_v<Sys>> held = mode;
    for (const int k : on)
        held.set(k, 0);
    S noise(0);
    const auto rate_at = [&](const S& time, const State<Sys, S>& point) {
        S sum(0);
        for (const int side : {-1, 1}) {
            const auto there = seen_from(side);
            const State<Sys, S> y = beside(sys, layers, there, on, time, point, p);
            const State<Sys, S> f = mode_field(sys, there, time, y, p, &layers);
            const S rate = normal_component(sys, j, time, y, p, f);
            // (a root makes of rounding of h what it makes of the width)
            const S by_h = abs(rate) * rounding_band(sys, j, time, y, p) / layers.width[j];
            sum += rate;
            noise = std::max({noise, by_h, rate_rounding(sys, j, time, y, p, f)});
        }
        return S(direction) * sum;
    };
    const S dt = S(1e-3) * S(direction) * tau, here = rate_at(t, x);
    std::array<int, 2> change{};
    for (const int side : {-1, 1}) {
        const auto there = seen_from(side);
        const State<Sys, S> f =
            mode_field(sys, there, t, beside(sys, layers, there, on, t, x, p), p, &layers);
        const State<Sys, S> y = project(sys, Constraints<Sys>(sys, held), S(t + dt),
                                        State<Sys, S>(x + dt * f), p, layers.lengths);
        const S by = rate_at(S(t + dt), y) - here;
        change[side > 0] = abs(by) <= S(16) * noise ? 0 : detail::sign(by);
    }
    return change[0] <= 0 && change[1] >= 0 && change[0] != change[1];
}

/// The surfaces at a point at which fields end like a root, and these laws.
template <class Sys, class S> struct RootLaws {
    static constexpr int M = surfaces_v<Sys>;
    Layers<Sys, S> layers; ///< of those that may hold the solution: h' is small beside the root
    Layers<Sys, S> beyond; ///< of all: a side on which h' bends infinitely is entered from beside
    std::array<RootLaw<S>, std::size_t(M)> below{}, above{};
    std::array<bool, std::size_t(M)> repels{}; ///< to second order

    bool any() const { return layers.any(); }
    /// True if h_j' grows like a root from nothing on a side that leads away: it may begin to at
    /// any time.
    bool grows_from_nothing(int j) const {
        return grows(below[std::size_t(j)], -1) || grows(above[std::size_t(j)], +1);
    }
    /// The side to which the rate at surface j leads, from where nothing but that counts; 0: none.
    int side_of_rate(int j) const {
        using std::abs;
        const RootLaw<S>&a = below[std::size_t(j)], &b = above[std::size_t(j)];
        const S rate = a.at_zero + b.at_zero, root = (a.rate - a.at_zero) - (b.rate - b.at_zero);
        return abs(rate) <= S(1e-3) * abs(root) ? 0 : detail::sign(rate);
    }

private:
    static bool grows(const RootLaw<S>& law, int side) {
        using std::abs;
        return law.grows(side) && S(side) * law.rate > S(0) &&
               abs(law.at_zero) <= S(0.05) * abs(law.rate);
    }
};

/// Which of the surfaces `on` have such a law, on one side or both.
/// @param mode    sides of all surfaces, those slid on at 0
/// @param wanted  (j): surface j is looked at
template <class Sys, class S, class Wanted>
FILIPPOV_COLD RootLaws<Sys, S>
root_laws(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, const SurfaceSet<surfaces_v<Sys>>& on,
          const S& t, const State<Sys, S>& x, const Params<Sys, S>& p, int direction,
          const State<Sys, S>& lengths, const Wanted& wanted) {
    using std::abs;
    RootLaws<Sys, S> laws;
    laws.layers.lengths = lengths;
    for (const int j : on)
        if (wanted(j)) {
            laws.layers.width[j] = layer_width(sys, j, t, x, p, lengths);
            laws.layers.least[j] = rounding_band(sys, j, t, x, p) / S(2);
        }
    const Vec<S, surfaces_v<Sys>> h = switching(sys, t, x, p);
    for (int k = 0; k < surfaces_v<Sys>; ++k)
        laws.layers.kept[std::size_t(k)] =
            !on.contains(k) && mode[k] != 0 && wanted(k) &&
            abs(h[k]) <= S(4) * layer_width(sys, k, t, x, p, lengths);
    const Layers<Sys, S> all = laws.beyond = laws.layers;
    for (const int j : on) {
        if (!all.has(j))
            continue;
        const auto seen_from = [&](int side) {
            Mode<surfaces_v<Sys>> there = mode;
            there.set(j, side);
            return root_law(sys, there, j, all, on, t, x, p, direction);
        };
        const auto i = std::size_t(j);
        laws.below[i] = seen_from(-1);
        laws.above[i] = seen_from(+1);
        const auto rests = [](const RootLaw<S>& law) {
            return law.holds() && abs(law.at_zero) <= S(2) * abs(law.rate - law.at_zero);
        };
        if (!rests(laws.below[i]) && !rests(laws.above[i]))
            laws.layers.width[j] = S(0);
        // What grows like a root makes much of where it begins: as near as rounding of h allows.
        const bool grows = laws.below[i].grows(-1) || laws.above[i].grows(+1);
        if (!laws.below[i].holds() && !laws.above[i].holds())
            laws.beyond.width[j] = S(0);
        else if (grows)
            laws.beyond.width[j] =
                std::max(S(64) * rounding_band(sys, j, t, x, p), S(1e-6) * all.width[j]);
    }
    return laws;
}

/// Admissible modes at a point of h_j = 0 at which fields end like a root: those of any surface, by
/// what the fields do a little beside it. A side that leads nowhere holds the solution there if the
/// other leads to the surface.
/// @param exit  the side by which a slide here has ended; 0: none did
template <class Sys, class S>
FILIPPOV_COLD Verdict<surfaces_v<Sys>> admissible_beside(const RootLaws<Sys, S>& laws,
                                                         const Mode<surfaces_v<Sys>>& mode, int j,
                                                         int exit, NonUnique policy) {
    const auto i = std::size_t(j);
    int below = exit < 0 ? -1 : detail::sign(laws.below[i].rate),
        above = exit > 0 ? +1 : detail::sign(laws.above[i].rate);
    const bool repelled = exit == 0 && laws.repels[i];
    if (repelled)
        below = above = laws.side_of_rate(j);
    Verdict<surfaces_v<Sys>> v;
    v.mode = mode;
    v.below = {below, below != 0 ? 1 : 0, true};
    v.above = {above, above != 0 ? 1 : 0, true};
    v.below.finite = laws.below[i].rate * S(0) == S(0);
    v.above.finite = laws.above[i].rate * S(0) == S(0);
    v.finite = v.below.finite && v.above.finite;
    if (!v.finite)
        return v;
    const auto option = [&](int side) {
        Mode<surfaces_v<Sys>> one = mode;
        one.set(j, side);
        v.add(one, {}, policy);
    };
    if (below >= 0 && above <= 0 && below != above) {
        v.unique = true;
        option(0);
    } else if (below == above && below != 0 && !(exit == 0 && laws.grows_from_nothing(j))) {
        v.unique = true;
        option(below);
    } else {
        v.reason = repelled ? "both sides' fields lead away from the surface to second order"
                   : below == above && below == 0 ? "both sides' fields are tangent to the surface"
                   : laws.grows_from_nothing(j)
                       ? "a field that leads away from the surface grows like a root from nothing"
                       : "one side's field leads away from the surface, the other not to it";
        for (const int side : {-1, 0, 1})
            option(side);
    }
    const int named = policy == NonUnique::below ? -1 : policy == NonUnique::above ? 1 : 0;
    if (!v.unique && policy != NonUnique::stop)
        v.mode.set(j, named);
    return v;
}

} // namespace filippov
