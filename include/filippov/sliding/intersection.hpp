// SPDX-License-Identifier: BSD-3-Clause
// Sliding on several surfaces at once: the sliding field.
#pragma once

#include <filippov/sliding/detail/attraction.hpp>
#include <filippov/sliding/detail/set_valued.hpp>

namespace filippov {

namespace detail {

/// Rounding of a share, or of a normal component in units of the largest.
template <class S> inline constexpr S share_rounding = S(1024) * epsilon<S>;

/// L1 - L2 of the i-th surface, the other surfaces blended: it ends a slide in which s_i stays at
/// an end.
template <std::floating_point R, int M, class S>
FILIPPOV_COLD R apart(const NormalField<R, M>& w, const Blend<S, M>& blend, int i) {
    Vec<R, M> share = Vec<R, M>::Zero();
    for (int k = 0; k < w.n; ++k) // (no number, or beyond, where the slide has just ended)
        if (const R below = value_of(blend.below[k]); below > R(0))
            share[k] = std::min(below / R(2), R(1));
    return -Multilinear<R, M>{w}.slope(share, i)[i];
}

} // namespace detail

/// Sliding on all surfaces with mode 0.
template <class Sys, class S> struct JointSliding {
    static constexpr int M = surfaces_v<Sys>;
    State<Sys, S> f; ///< F_s
    Vec<S, M> s;     ///< of the surfaces slid on, others unspecified
    /// Their margins, see Margin. Of a direction that of its first component below is 1 - |s|^2,
    /// and the others are 1.
    Vec<S, M> below, above;
    bool unique_s = true; ///< else s is the one of least norm, and one margin stands for all
    /// On one surface L1 - L2: positive where sliding attracts, negative where it repels. On more
    /// their attraction. 1 if all are contacts: that these attract is judged where they begin.
    Real<S> w = Real<S>(1);
    /// The same, but of a surface where s is at an end L1 - L2, with the sign of their attraction:
    /// it ends a slide in which s stays there.
    Vec<Real<S>, M> apart;
};

/// 1 - |s|^2 of components begin to end: what is left of the unit disc.
template <class S, int M> S disc_margin(const Vec<S, M>& s, int begin, int end) {
    S margin(1);
    for (int i = begin; i < end; ++i)
        margin -= s[i] * s[i];
    return margin;
}

namespace detail {

/// The surface of a slide whose s is not unique that has the margin of them all, and on which side:
/// a relay, if there is one, below; else a contact, above, where its force vanishes.
template <class Sys> std::pair<int, int> margin_of_all(const Sys& sys, const auto& on) {
    for (const int j : on)
        if (!is_kind(sys, j, SurfaceKind::jump))
            return {j, -1};
    return {on[0], +1};
}

/// Surfaces with layers attract for as long as their slides last, also one whose field on one side
/// leads nowhere: there s is at its end all the time, and ends the slide beyond it.
template <class Sys, class S>
FILIPPOV_COLD void
hold_in_layers(const Regions<Sys, S>& regions, const Layers<Sys, Real<S>>& layers,
               NormalField<Real<S>, surfaces_v<Sys>>& plain, JointSliding<Sys, S>& r) {
    using R = Real<S>;
    for (int i = 0; i < regions.on.n; ++i) {
        const int j = regions.on[i];
        if (!layers.has(j))
            continue;
        r.below[j] += S(layer_slack<R>);
        r.above[j] += S(layer_slack<R>);
        for (unsigned v = 0; v < plain.regions() && regions.on.n > 1; ++v)
            plain.normal[v][i] = (v >> i & 1u) != 0 ? R(-1) : R(1);
    }
}

/// How surely the slide attracts, and what is left to the end of one in which s stays at an end.
/// @param plain  the normal components
template <class Sys, class S>
FILIPPOV_INLINE void see_attraction(const Sys& sys, const Regions<Sys, S>& regions,
                                    const Blend<S, surfaces_v<Sys>>& blend,
                                    const NormalField<Real<S>, surfaces_v<Sys>>& plain,
                                    const Layers<Sys, Real<S>>* layers, JointSliding<Sys, S>& r) {
    using R = Real<S>;
    SurfaceSet<surfaces_v<Sys>> at_limit;
    bool all_apart = true;
    for (int i = 0; i < regions.on.n; ++i) {
        const int j = regions.on[i];
        if (!is_kind(sys, j, SurfaceKind::switching) || (layers != nullptr && layers->has(j)) ||
            !(std::min(value_of(blend.below[i]), value_of(blend.above[i])) <= share_rounding<R>))
            continue;
        at_limit.add(j);
        r.apart[j] = apart(plain, blend, i);
        all_apart = all_apart && r.apart[j] > R(0);
    }
    r.w = attraction(sys, regions.on, at_limit.n > 0 ? tangent_leads_in(plain) : plain);
    if constexpr (has_jumps_v<Sys>)
        if (!(r.w > R(0)) && contacts_hold(sys, regions))
            r.w = R(1);
    for (const int j : regions.on)
        if (!at_limit.contains(j))
            r.apart[j] = r.w;
        else if (all_apart && !(r.w > R(0)))
            r.apart[j] = -r.apart[j];
}

/// As `joint_sliding`, by the fields at the widths of layers, if there are some.
template <class Sys, class S>
FILIPPOV_NOINLINE JointSliding<Sys, S>
joint_sliding_at(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, const S& t,
                 const State<Sys, S>& x, const Params<Sys, S>& p,
                 const Layers<Sys, Real<S>>* layers) {
    const auto regions = regions_at(sys, mode, slid_surfaces(mode), t, x, p, layers);
    auto blend = blend_of<Sys, S>(regions.flow);
    JointSliding<Sys, S> r;
    if constexpr (JointSliding<Sys, S>::M > 1)
        if (may_be_set_valued(blend)) [[unlikely]]
            if (const auto set = set_valued(sys, regions); set.found) {
                r.unique_s = false;
                r.w = set.w;
                for (int i = 0; i < regions.on.n; ++i) {
                    const int j = regions.on[i];
                    r.s[j] = S(set.s[i]);
                    r.below[j] = r.above[j] = S(1);
                }
                const auto [j, side] = detail::margin_of_all(sys, regions.on);
                (side < 0 ? r.below : r.above)[j] = set.margin;
                blend = set.blend;
            }
    r.f = State<Sys, S>::Constant(S(0));
    for (unsigned v = 0; v < regions.flow.regions(); ++v)
        for (int i = 0; i < dim_v<Sys>; ++i)
            r.f[i] += blend.share[v] * regions.field[v][i];
    if (!r.unique_s) {
        r.apart = Vec<Real<S>, surfaces_v<Sys>>::Constant(r.w);
        return r;
    }
    bool contacts = true; // and nothing else
    for (int i = 0; i < regions.on.n; ++i) {
        const int j = regions.on[i];
        const S below = blend.below[i], above = blend.above[i];
        r.s[j] = below < above ? S(below - S(1)) : S(S(1) - above);
        const bool jumps = is_kind(sys, j, SurfaceKind::jump);
        r.below[j] = jumps ? S(1) : below;
        r.above[j] = jumps ? S(S(0.5) * above * regions.strength[i]) : above;
        contacts = contacts && jumps;
    }
    if constexpr (has_directions_v<Sys>)
        for (const int j : regions.on)
            if (is_directed(sys, j)) {
                r.below[j] = is_kind(sys, j, SurfaceKind::direction)
                                 ? disc_margin(r.s, j, direction_end(sys, j))
                                 : S(1);
                r.above[j] = S(1);
            }
    auto plain = detail::values_of_field(regions.flow);
    if (layers != nullptr)
        hold_in_layers(regions, *layers, plain, r);
    if (!contacts && regions.on.n == 1)
        r.w = plain(0, 0) - plain(1, 0);
    if (contacts || regions.on.n == 1)
        r.apart = Vec<Real<S>, surfaces_v<Sys>>::Constant(r.w);
    else
        see_attraction(sys, regions, blend, plain, layers, r);
    return r;
}

} // namespace detail

/// Sliding vector field on the intersection of the surfaces with mode 0: the blend of the regions
/// that meet there with which all their h stay zero.
///
/// Where s is not unique and the field is, the surfaces share one margin: how far the set of all s
/// is from empty.
///
/// @param x   state, shape (dim,), on these surfaces
/// @param layers  of those that are looked at from beside; null: of none
/// @error     none; NaN where there is no such blend
/// @cost      2^n fields and derivatives of h, n surfaces
/// @source    chapter, (4.11)-(4.12), for each surface; Selection for several
template <class Sys, class S>
FILIPPOV_INLINE JointSliding<Sys, S>
joint_sliding(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, const S& t, const State<Sys, S>& x,
              const Params<Sys, S>& p, const Layers<Sys, Real<S>>* layers = nullptr) {
    if (layers == nullptr)
        return detail::joint_sliding_at(sys, mode, t, x, p, layers);
    return held_in(
        *layers,
        [&](const auto& widths) { return detail::joint_sliding_at(sys, mode, t, x, p, &widths); },
        [&](const JointSliding<Sys, S>& slide) {
            for (int j = 0; j < surfaces_v<Sys>; ++j)
                if (mode[j] == 0 && layers->has(j) &&
                    !(slide.below[j] > S(0) && slide.above[j] > S(0)))
                    return false;
            return true;
        });
}

/// The slide of a mode, if its s is not unique.
template <class Sys, class S>
FILIPPOV_COLD SetValued<S, surfaces_v<Sys>>
set_valued_slide(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, const S& t,
                 const State<Sys, S>& x, const Params<Sys, S>& p,
                 const Layers<Sys, Real<S>>* layers = nullptr) {
    if (surfaces_v<Sys> == 1 || mode.sliding() < 2)
        return {};
    const auto regions = regions_at(sys, mode, slid_surfaces(mode), t, x, p, layers);
    return may_be_set_valued(blend_of<Sys, S>(regions.flow)) ? set_valued(sys, regions)
                                                             : SetValued<S, surfaces_v<Sys>>{};
}

/// The field of any mode.
template <class Sys, class S>
FILIPPOV_INLINE State<Sys, S>
mode_field(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, const S& t, const State<Sys, S>& x,
           const Params<Sys, S>& p, const Layers<Sys, Real<S>>* layers = nullptr) {
    if (sliding_surface(mode) < 0)
        return side_field(sys, mode, t, x, p);
    if constexpr (!single_v<Sys>)
        return joint_sliding(sys, mode, t, x, p, layers).f;
    else if (layers == nullptr)
        return sliding(sys, mode, t, x, p).f;
    else
        return sliding_in_layer(sys, mode, t, x, p, *layers).f;
}

/// The margins of the slide of `mode` at surface j.
template <class Sys, class S>
FILIPPOV_INLINE Margin<S> sliding_margin(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j,
                                         const S& t, const State<Sys, S>& x,
                                         const Params<Sys, S>& p,
                                         const Layers<Sys, Real<S>>* layers = nullptr) {
    if constexpr (single_v<Sys>) {
        if (layers == nullptr)
            return sliding_margin(sys, mode, t, x, p);
        const Sliding<Sys, S> slide = sliding_in_layer(sys, mode, t, x, p, *layers);
        return {slide.below - S(1), slide.below, slide.above, slide.w};
    } else {
        const auto slide = joint_sliding(sys, mode, t, x, p, layers);
        return {slide.s[j], slide.below[j], slide.above[j], S(slide.apart[j])};
    }
}

} // namespace filippov
