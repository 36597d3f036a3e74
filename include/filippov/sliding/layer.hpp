// SPDX-License-Identifier: BSD-3-Clause
// Surfaces at which a field ends like a root: they are looked at from a little beside.
#pragma once

#include <filippov/system/surface.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <type_traits>

namespace filippov {

/// How far beside each surface its fields are taken: not at all, but where h' falls to zero like a
/// root of h, as in Torricelli's law.
///
/// Such a surface is reached in finite time, and on it the fields say nothing: h' is zero on both
/// sides and its derivatives are infinite. What the fields do to h = -width and h = width says it
/// all: where they lead towards each other what is between them stays there, nearer to the surface
/// than the tolerance can tell.
/// @tparam R  plain numbers
template <class Sys, class R> struct Layers {
    Vec<R, surfaces_v<Sys>> width = Vec<R, surfaces_v<Sys>>::Zero(); ///< in units of h_j
    Vec<R, dim_v<Sys>> lengths = Vec<R, dim_v<Sys>>::Zero(); ///< in which a change of x is smallest
    std::array<bool, std::size_t(surfaces_v<Sys>)>
        kept{}; ///< of others: near, their h stays what it is

    Vec<R, surfaces_v<Sys>> least = Vec<R, surfaces_v<Sys>>::Zero(); ///< width above rounding of h

    /// Layers of a part of these widths.
    Layers part(const R& share) const {
        Layers nearer = *this;
        for (int j = 0; j < surfaces_v<Sys>; ++j)
            if (has(j))
                nearer.width[j] = std::min(width[j], std::max(share * width[j], least[j]));
        return nearer;
    }
    /// True of a surface that is looked at from beside.
    bool has(int j) const { return width[j] > R(0); }
    bool any() const {
        for (int j = 0; j < surfaces_v<Sys>; ++j)
            if (has(j))
                return true;
        return false;
    }
};

/// True of systems that do not say themselves what a slide is.
template <class Sys, class S>
inline constexpr bool may_have_layers_v =
    !HasSlideComponents<Sys, S> && !HasSlidingFlow<Sys, S> && !HasEquivalentControl<Sys, S>;

/// The width of the layer around h_j = 0: what a tenth of the tolerance makes of h, and plainly
/// more than its rounding.
template <class Sys, class S>
FILIPPOV_COLD S layer_width(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                            const Params<Sys, S>& p, const State<Sys, S>& lengths) {
    return std::max(S(0.1) * change_over(sys, j, t, x, p, lengths),
                    S(64) * rounding_band(sys, j, t, x, p));
}

/// A slide within layers. How far it is from its ends is what it is at their widths. But its field
/// is that of the nearest layers that still hold the solution, where what holds it balances: other
/// components may depend on h by laws of their own. (At rest these are as near as numbers go. So
/// near derivatives are no numbers: those are taken at the widths.)
/// @param slide  (layers): the slide by fields at these widths
/// @param holds  (slide): true if the solution stays within
template <class Sys, class R, class Slide, class Holds>
FILIPPOV_COLD auto held_in(const Layers<Sys, R>& layers, const Slide& slide, const Holds& holds) {
    auto r = slide(layers);
    if constexpr (!std::floating_point<std::remove_cvref_t<decltype(r.f[0])>>)
        return r;
    R far(0), near = R(0.8) * std::log(std::numeric_limits<R>::min()); // logarithms of shares
    for (int k = 0; k < 40; ++k) {
        const R middle = k == 0 ? near : (far + near) / R(2);
        const auto nearer = slide(layers.part(std::exp(middle)));
        if (!holds(nearer)) {
            near = middle;
            continue;
        }
        r.f = nearer.f;
        far = middle;
        if (k == 0)
            break;
    }
    return r;
}

/// x, which lies on the surfaces `on`, moved to h_j = side_j width_j of each, by the smallest
/// change.
/// @param side  0: this h stays what it is
/// @error NaN where their gradients are dependent
template <class Sys, class S>
FILIPPOV_COLD State<Sys, S> beside(const Sys& sys, const Layers<Sys, Real<S>>& layers,
                                   const Mode<surfaces_v<Sys>>& side,
                                   const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                   const State<Sys, S>& x, const Params<Sys, S>& p) {
    using R = Real<S>;
    Mode<surfaces_v<Sys>> held = side;
    for (int j = 0; j < surfaces_v<Sys>; ++j)
        if (on.contains(j) || layers.kept[std::size_t(j)])
            held.set(j, 0);
    State<Sys, R> point;
    for (int i = 0; i < dim_v<Sys>; ++i)
        point[i] = value_of(x[i]);
    Params<Sys, R> given;
    for (int i = 0; i < params_v<Sys>; ++i)
        given[i] = value_of(p[i]);
    const Constraints<Sys> all =
        Constraints<Sys>(sys, held).of_state(sys, R(value_of(t)), point, given);
    const auto gradients =
        detail::gradients(sys, all, R(value_of(t)), point, given, layers.lengths);
    Vec<R, Constraints<Sys>::capacity> share;
    for (int a = 0; a < all.size(); ++a) {
        const int j = all.surface(a);
        const bool speed = a > 0 && all.surface(a - 1) == j;
        const R to = speed || !on.contains(j) ? R(0) : R(side[j]) * layers.width[j];
        share[a] = to / gradients.length[std::size_t(a)];
    }
    if (!(eliminate(gradients.cosine, share, all.size()) > R(1e-12))) // as `independent`
        share = decltype(share)::Constant(std::numeric_limits<R>::quiet_NaN());
    State<Sys, S> y = x;
    for (int a = 0; a < all.size(); ++a)
        for (int i = 0; i < dim_v<Sys>; ++i)
            y[i] += S(gradients.g[std::size_t(a)][i] * gradients.weight[i] *
                      (share[a] / gradients.length[std::size_t(a)]));
    return y;
}

} // namespace filippov
