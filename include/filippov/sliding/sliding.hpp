// SPDX-License-Identifier: BSD-3-Clause
// Sliding motion by Utkin's equivalent control.
#pragma once

#include <filippov/sliding/layer.hpp>

namespace filippov {

/// The surface slid on in `mode`, -1 if there is none.
template <int M> FILIPPOV_INLINE int sliding_surface(const Mode<M>& mode) {
    for (int j = 0; j < M; ++j)
        if (mode[j] == 0)
            return j;
    return -1;
}

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

/// What h_j' along a field, f at (t, x), may be off by rounding of its terms.
template <class Sys, class S>
S rate_rounding(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
                const State<Sys, S>& f) {
    using std::abs;
    const State<Sys, S> gradient = grad_h(sys, j, t, x, p);
    S terms = abs(h_t(sys, j, t, x, p));
    for (int i = 0; i < dim_v<Sys>; ++i)
        terms += abs(gradient[i] * f[i]);
    return S(8) * epsilon<S> * terms;
}

/// The two fields, and how the rate of a slide of second order on surface j changes along each of
/// them: what normal components are to a slide of first order.
template <class Sys, std::floating_point S>
FILIPPOV_COLD Sides<Sys, S> second_order_sides(const Sys& sys, int j, const S& t,
                                               const State<Sys, S>& x, const Params<Sys, S>& p) {
    const auto exact = detail::exact_point(sys, j, t, x, p);
    Mode<surfaces_v<Sys>> mode;
    Sides<Sys, S> sides;
    mode.set(j, -1);
    sides.f1 = side_field(sys, mode, t, exact.x, p);
    mode.set(j, +1);
    sides.f2 = side_field(sys, mode, t, exact.x, p);
    sides.l1 = rate_change(sys, j, t, exact, p, S(1), sides.f1);
    sides.l2 = rate_change(sys, j, t, exact, p, S(1), sides.f2);
    return sides;
}
/// Sliding on one surface: the field, the blend variable and the transversality.
template <class Sys, class S> struct Sliding {
    State<Sys, S> f; ///< F_s
    S below, above;  ///< 1 + s and 1 - s: zero where the slide ends below and above
    S w;             ///< L1 - L2: positive where sliding attracts, negative where it repels
};

/// The blend of two sides with which their normal components cancel.
template <class Sys, class S> FILIPPOV_INLINE Sliding<Sys, S> blended(const Sides<Sys, S>& b) {
    Sliding<Sys, S> r;
    r.w = b.l1 - b.l2;
    // (1 - s)/2 = -L2/(L1 - L2) and (1 + s)/2 = L1/(L1 - L2): no cancellation at either end.
    const S share1 = -b.l2 / r.w, share2 = b.l1 / r.w;
    for (int i = 0; i < dim_v<Sys>; ++i)
        r.f[i] = share1 * b.f1[i] + share2 * b.f2[i];
    r.below = share2 + share2;
    r.above = share1 + share1;
    return r;
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
    if constexpr (slides_twice_v<Sys> && std::floating_point<S>)
        if (mode.holds_rate(0)) [[unlikely]]
            return blended(second_order_sides(sys, 0, t, x, p));
    if constexpr (HasSlideField<Sys, S>) {
        Sliding<Sys, S> r;
        const Vec<S, 2> l = sys.slide_components(t, x, p);
        r.w = l[0] - l[1];
        r.f = sys.slide_field(t, x, p);
        r.below = S(2) * l[0] / r.w;
        r.above = S(-2) * l[1] / r.w;
        return r;
    } else {
        return blended(both_sides(sys, mode, sliding_surface(mode), t, x, p));
    }
}

/// By how much s may lie beyond its ends in a slide within a layer: where one side's field leads
/// nowhere s is at an end all the time, but for rounding.
template <class R> inline constexpr R layer_slack = R(1024) * epsilon<R>;

/// The same by the fields at the width of a layer.
template <class Sys, class S>
FILIPPOV_COLD Sliding<Sys, S> sliding_beside(const Sys& sys, Mode<1> mode, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p,
                                             const Layers<Sys, Real<S>>& layers) {
    const auto side = [&](int sign, State<Sys, S>& f) {
        mode.set(0, sign);
        const State<Sys, S> y = beside(sys, layers, mode, slid_surfaces(Mode<1>{}), t, x, p);
        f = side_field(sys, mode, t, y, p);
        return normal_component(sys, 0, t, y, p, f);
    };
    State<Sys, S> f1, f2;
    const S l1 = side(-1, f1), l2 = side(+1, f2);
    const S w = l1 - l2, share1 = -l2 / w, share2 = l1 / w, slack(layer_slack<Real<S>>);
    Sliding<Sys, S> r;
    r.w = w;
    for (int i = 0; i < dim_v<Sys>; ++i)
        r.f[i] = share1 * f1[i] + share2 * f2[i];
    r.below = share2 + share2 + slack;
    r.above = share1 + share1 + slack;
    return r;
}
/// The same where the surface is looked at from beside.
template <class Sys, class S>
FILIPPOV_COLD Sliding<Sys, S> sliding_in_layer(const Sys& sys, const Mode<1>& mode, const S& t,
                                               const State<Sys, S>& x, const Params<Sys, S>& p,
                                               const Layers<Sys, Real<S>>& layers) {
    return held_in(
        layers, [&](const auto& widths) { return sliding_beside(sys, mode, t, x, p, widths); },
        [](const Sliding<Sys, S>& slide) { return slide.below > S(0) && slide.above > S(0); });
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
    const auto margin = [](const S& l1, const S& l2) {
        const S w = l1 - l2;
        return Margin<S>{(l1 + l2) / w, S(2) * l1 / w, S(-2) * l2 / w, w};
    };
    if constexpr (slides_twice_v<Sys> && std::floating_point<S>)
        if (mode.holds_rate(0)) [[unlikely]] {
            const Sides<Sys, S> b = second_order_sides(sys, 0, t, x, p);
            return margin(b.l1, b.l2);
        }
    if constexpr (HasEquivalentControl<Sys, S>) {
        const S s = sys.equivalent_control(t, x, p);
        return {s, S(1) + s, S(1) - s, S(1)};
    } else if constexpr (HasSlideComponents<Sys, S>) {
        const Vec<S, 2> l = sys.slide_components(t, x, p);
        return margin(l[0], l[1]);
    } else {
        const Sides<Sys, S> b = both_sides(sys, mode, sliding_surface(mode), t, x, p);
        return margin(b.l1, b.l2);
    }
}

} // namespace filippov
