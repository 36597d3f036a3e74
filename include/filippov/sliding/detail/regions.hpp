// SPDX-License-Identifier: BSD-3-Clause
// The regions that meet where surfaces do, and what their fields do to these surfaces.
#pragma once

#include <filippov/sliding/layer.hpp>
#include <filippov/sliding/sliding.hpp>

namespace filippov {

/// Most surfaces of a system: 2^M regions can meet.
inline constexpr int max_surfaces = 8;

/// What 2^n regions around an intersection of n surfaces do to these surfaces: component i of
/// normal[v] is L of the i-th surface in region v. Bit i of v: the region is where its h > 0.
template <class S, int M> struct NormalField {
    static_assert(M <= max_surfaces, "filippov: a system has at most 8 surfaces");
    int n = 0;
    std::array<Vec<S, M>, std::size_t(1) << M> normal;

    unsigned regions() const { return 1u << n; }
    const S& operator()(unsigned v, int i) const { return normal[v][i]; }
};

/// The region that is `others` beside the i-th surface, and at this end (0 below, 1 above) of it.
constexpr unsigned with_end(unsigned others, int i, unsigned end) {
    const unsigned low = (1u << i) - 1;
    return (others & low) | end << i | (others & ~low) << 1;
}

/// The regions around an intersection, their fields and what these do to its surfaces.
template <class Sys, class S> struct Regions {
    static constexpr int M = surfaces_v<Sys>;
    SurfaceSet<M> on;
    std::array<State<Sys, S>, std::size_t(1) << M> field;
    NormalField<S, M> flow;
    Vec<S, M> strength; ///< of the push of the i-th surface, which has jumps; others unspecified
};

/// True if the fields of all regions are finite.
template <class Sys, class S> bool are_finite(const Regions<Sys, S>& regions) {
    for (unsigned v = 0; v < regions.flow.regions(); ++v)
        if (!all_finite<S, dim_v<Sys>>(regions.field[v]))
            return false;
    return true;
}

/// L_j of a field value for all surfaces.
template <class Sys, class S>
Vec<S, surfaces_v<Sys>> normal_components(const Sys& sys, const S& t, const State<Sys, S>& x,
                                          const Params<Sys, S>& p, const State<Sys, S>& f) {
    Vec<Taylor<S, 1>, dim_v<Sys>> y = lift<1>(x);
    for (int i = 0; i < dim_v<Sys>; ++i)
        y[i].c[1] = f[i];
    const auto h = switching(sys, Taylor<S, 1>::variable(t), y, lift<1>(p));
    Vec<S, surfaces_v<Sys>> normal;
    for (int j = 0; j < surfaces_v<Sys>; ++j)
        normal[j] = h[j].c[1];
    return normal;
}

/// How a surface with jumps pushes back in contact: what it adds to the field for one unit of
/// normal acceleration, in the direction in which its impacts throw the state.
///
/// An impact is x+ = x + W(x) h', so in contact F_s = F - W h''/(W h')', whatever the length of W;
/// W comes from the derivative of `jump` at h' = 0.
/// @return zero if the jump does not turn the normal speed: then there is no contact
/// @source di Bernardo, Budd, Champneys & Kowalczyk (2008), Piecewise-smooth Dynamical Systems,
///         section 2.2.4
template <class Sys, class S>
State<Sys, S> contact_push(const Sys& sys, const Mode<surfaces_v<Sys>>& side, int j, const S& t,
                           const State<Sys, S>& x, const Params<Sys, S>& p) {
    const auto q = lift<1>(p);
    const auto speed = [&](const auto& time, const auto& y) {
        return normal_speed(sys, side, j, time, y, q);
    };
    Vec<Taylor<S, 1>, dim_v<Sys>> y = lift<1>(x);
    for (int i = 0; i < dim_v<Sys>; ++i)
        y[i].c[1] = directional(speed, t, x, S(0), State<Sys, S>(State<Sys, S>::Unit(i)));
    const auto after = sys.jump(j, Taylor<S, 1>(t), y, q);
    State<Sys, S> push;
    S turn(0);
    for (int i = 0; i < dim_v<Sys>; ++i) {
        push[i] = y[i].c[1] - after[i].c[1];
        turn += y[i].c[1] * push[i];
    }
    for (int i = 0; i < dim_v<Sys>; ++i)
        push[i] = turn > S(0) ? S(push[i] / turn) : S(0);
    return push;
}

namespace detail {

/// Contact with a surface that has jumps as a slide: between the field, and the field pushed so
/// hard that it leaves whatever it was (by one unit of acceleration more than twice the largest;
/// the sliding field does not depend on it). The slide ends where the share of the push vanishes.
template <class Sys, class S>
void push_regions(const Sys& sys, Regions<Sys, S>& r, const Mode<surfaces_v<Sys>>& side, int i,
                  const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
    using std::abs;
    const auto q = lift<1>(p);
    const auto change_of_speed = [&](int k, const S& time_rate, const State<Sys, S>& f) {
        const auto speed = [&](const auto& time, const auto& y) {
            return normal_speed(sys, side, r.on[k], time, y, q);
        };
        return directional(speed, t, x, time_rate, f);
    };
    const unsigned bit = 1u << i;
    S largest(0);
    for (unsigned v = 0; v < r.flow.regions(); ++v) {
        r.flow.normal[v][i] = change_of_speed(i, S(1), r.field[v]);
        largest = std::max(largest, S(abs(r.flow.normal[v][i])));
    }
    const State<Sys, S> push = contact_push(sys, side, r.on[i], t, x, p);
    S length(0);
    for (int k = 0; k < dim_v<Sys>; ++k)
        length += abs(push[k]);
    const S strength = length > S(0) ? S(1) + S(2) * largest : S(0);
    r.strength[i] = strength;
    for (unsigned v = 0; v < r.flow.regions(); ++v)
        if ((v & bit) == 0) {
            for (int k = 0; k < dim_v<Sys>; ++k)
                r.field[v][k] += strength * push[k];
            r.flow.normal[v][i] += strength;
        }
    // What was looked at before does not know of this push yet.
    for (int before = 0; before < i; ++before)
        if (is_kind(sys, r.on[before], SurfaceKind::jump)) {
            const S passed_on = strength * change_of_speed(before, S(0), push);
            for (unsigned v = 0; v < r.flow.regions(); ++v)
                if ((v & bit) == 0)
                    r.flow.normal[v][before] += passed_on;
        }
}

/// The field of the region on these sides of the surfaces `on`. Of a direction, s = -1 and +1 of
/// each component: the corners of a cube around the disc, between which the field is as affine.
template <class Sys, class S>
State<Sys, S> region_field(const Sys& sys, const Mode<surfaces_v<Sys>>& side,
                           [[maybe_unused]] const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                           const State<Sys, S>& x, const Params<Sys, S>& p) {
    if constexpr (has_directions_v<Sys>)
        if (has_directions(sys)) {
            auto s = sides_and_directions(sys, side, t, x, p);
            for (const int j : on)
                s[j] = S(side[j]);
            return directed_field(sys, t, x, s, p);
        }
    return side_field(sys, side, t, x, p);
}

} // namespace detail

/// The regions that meet where the surfaces `on` do, the other surfaces as in `mode`. Of a surface
/// with jumps one is free, the other pushed, and what they do to it is to its normal speed.
/// @param layers  of the surfaces that are looked at from beside; null: of none
/// @cost 2^n fields and derivatives of h
template <class Sys, class S>
FILIPPOV_NOINLINE Regions<Sys, S> regions_at(const Sys& sys, Mode<surfaces_v<Sys>> mode,
                                             const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p,
                                             const Layers<Sys, Real<S>>* layers = nullptr) {
    constexpr int M = surfaces_v<Sys>;
    const int n = std::min(on.n, M);
    const auto jumps = [&](int i) { return is_kind(sys, on[i], SurfaceKind::jump); };
    Regions<Sys, S> r;
    r.on = on;
    r.flow.n = n;
    for (unsigned v = 0; v < r.flow.regions(); ++v) {
        for (int i = 0; i < n; ++i)
            mode.set(on[i], jumps(i) || (v >> i & 1u) != 0 ? 1 : -1);
        if (layers == nullptr) {
            r.field[v] = detail::region_field(sys, mode, r.on, t, x, p);
            continue;
        }
        const State<Sys, S> y = beside(sys, *layers, mode, on, t, x, p);
        r.field[v] = detail::region_field(sys, mode, r.on, t, y, p);
        const auto normal = normal_components(sys, t, y, p, r.field[v]);
        for (int i = 0; i < n; ++i)
            r.flow.normal[v][i] = normal[on[i]];
    }
    if constexpr (has_jumps_v<Sys>)
        for (int i = 0; i < n; ++i)
            if (jumps(i))
                detail::push_regions(sys, r, region_of(mode), i, t, x, p);
    for (unsigned v = 0; v < r.flow.regions() && layers == nullptr; ++v) {
        const auto normal = normal_components(sys, t, x, p, r.field[v]);
        for (int i = 0; i < n; ++i)
            if (!jumps(i))
                r.flow.normal[v][i] = normal[on[i]];
    }
    return r;
}

} // namespace filippov
