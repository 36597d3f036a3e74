// SPDX-License-Identifier: BSD-3-Clause
// Sliding motion by Utkin's equivalent control.
#pragma once

#include <filippov/system/surface.hpp>

namespace filippov {

/// The two fields that meet at surface j and their normal components, the other surfaces as in
/// `mode`.
template <class Sys, class S> struct Sides {
    State<Sys, S> f1, f2; ///< fields where h_j < 0 and where h_j > 0
    S l1, l2;             ///< their normal components L = h_t + <grad h, F>
};

template <class Sys, class S>
FILIPPOV_INLINE Sides<Sys, S> both_sides(const Sys& sys, Mode<surfaces_v<Sys>> mode, int j,
                                         const S& t, const State<Sys, S>& x,
                                         const Params<Sys, S>& p) {
    Sides<Sys, S> sides;
    mode.set(j, -1);
    sides.f1 = side_field(sys, mode, t, x, p);
    mode.set(j, +1);
    sides.f2 = side_field(sys, mode, t, x, p);
    sides.l1 = normal_component(sys, j, t, x, p, sides.f1);
    sides.l2 = normal_component(sys, j, t, x, p, sides.f2);
    return sides;
}

/// Sliding on one surface: the field, the blend variable and the transversality.
template <class Sys, class S> struct Sliding {
    State<Sys, S> f; ///< F_s
    S below, above;  ///< 1 + s and 1 - s: zero where the slide ends below and above
    S w;             ///< L1 - L2: positive where sliding attracts, negative where it repels
};

/// The surface slid on in `mode`, -1 if there is none.
template <int M> FILIPPOV_INLINE int sliding_surface(const Mode<M>& mode) {
    for (int j = 0; j < M; ++j)
        if (mode[j] == 0)
            return j;
    return -1;
}

/// Sliding vector field on h_j = 0, j the one surface with mode 0.
///
///   F_s = (F1 + F2)/2 + s (F2 - F1)/2,   s = -(L1 + L2)/(L2 - L1)
///
/// @param x   state, shape (dim,); off the surface the formula keeps h constant
/// @return    F_s, 1 + s, 1 - s and L1 - L2
/// @error     none; NaN where L1 = L2
/// @cost      both fields, two normal components
/// @source    chapter, (4.11)-(4.12)
template <class Sys, class S>
FILIPPOV_INLINE Sliding<Sys, S> sliding(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                                        const S& t, const State<Sys, S>& x,
                                        const Params<Sys, S>& p) {
    Sliding<Sys, S> r;
    if constexpr (HasSlideField<Sys, S>) {
        const Vec<S, 2> l = sys.slide_components(t, x, p);
        r.w = l[0] - l[1];
        r.f = sys.slide_field(t, x, p);
        r.below = S(2) * l[0] / r.w;
        r.above = S(-2) * l[1] / r.w;
    } else {
        const Sides<Sys, S> b = both_sides(sys, mode, sliding_surface(mode), t, x, p);
        r.w = b.l1 - b.l2;
        // (1 - s)/2 = -L2/(L1 - L2) and (1 + s)/2 = L1/(L1 - L2): no cancellation at either end.
        const S share1 = -b.l2 / r.w, share2 = b.l1 / r.w;
        for (int i = 0; i < dim_v<Sys>; ++i)
            r.f[i] = share1 * b.f1[i] + share2 * b.f2[i];
        r.below = share2 + share2;
        r.above = share1 + share1;
    }
    return r;
}

/// How far a slide is from its ends, without cancellation at either. A contact ends above alone,
/// where its force vanishes: the normal acceleration that it takes away is its margin there, and
/// not the share of a push, which is 1 but near the end where accelerations are large.
template <class S> struct Margin {
    S s;     ///< equivalent control
    S below; ///< 1 + s = 2 L1/(L1 - L2), zero where the slide leaves into h < 0; 1 of a contact
    S above; ///< 1 - s = -2 L2/(L1 - L2), zero where it leaves into h > 0
    S w;     ///< L1 - L2
};

/// The margins of the slide of `mode` at (t, x).
///
/// A system that gives `equivalent_control` vouches for a surface that sliding does not lose.
/// @error none; NaN or infinite where L1 = L2
template <class Sys, class S>
FILIPPOV_INLINE Margin<S> sliding_margin(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                                         const S& t, const State<Sys, S>& x,
                                         const Params<Sys, S>& p) {
    if constexpr (HasEquivalentControl<Sys, S>) {
        const S s = sys.equivalent_control(t, x, p);
        return {s, S(1) + s, S(1) - s, S(1)};
    } else if constexpr (HasSlideComponents<Sys, S>) {
        const Vec<S, 2> l = sys.slide_components(t, x, p);
        const S w = l[0] - l[1];
        return {(l[0] + l[1]) / w, S(2) * l[0] / w, S(-2) * l[1] / w, w};
    } else {
        const Sides<Sys, S> b = both_sides(sys, mode, sliding_surface(mode), t, x, p);
        const S w = b.l1 - b.l2;
        return {(b.l1 + b.l2) / w, S(2) * b.l1 / w, S(-2) * b.l2 / w, w};
    }
}

} // namespace filippov
