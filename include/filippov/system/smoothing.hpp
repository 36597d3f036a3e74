// SPDX-License-Identifier: BSD-3-Clause
// Smoothing: the switch replaced by a steep function, as a system of its own.
#pragma once

#include <filippov/core/refuse.hpp>
#include <filippov/system/derivatives.hpp>
#include <filippov/system/smooth_law.hpp>

#include <limits>

namespace filippov {

/// How a system is smoothed.
struct Smoothing {
    double c1 = 1e8; ///< steepness, 1/units of h, > 0; the chapter's is 1e8
    SmoothLaw law = SmoothLaw::arctan;
    /// Half width of the layer |h| < band that counts as sticking, units of h; 0: nobody watches.
    /// The law `saturation` has corners at 1/c1, which are watched: its band is that.
    double band = 0;
};

/// A system whose sides exist on both sides of their surfaces, blended: `field` is
/// (F1 + F2)/2 + s (F2 - F1)/2 (4.11), which smoothing and time stepping ask for. Where a side has
/// a pole or ends beyond its surface the system has to give a `field` of its own.
template <class Sys> struct Blended : Sys {
    static_assert(surfaces_v<Sys> == 1,
                  "filippov: a system of several surfaces needs a `field` of its own");
    template <Scalar S>
    State<Sys, S> field(const S& t, const State<Sys, S>& x, const S& s,
                        const Params<Sys, S>& p) const {
        const State<Sys, S> f1 = this->f1(t, x, p), f2 = this->f2(t, x, p);
        const S share1 = S(0.5) * (S(1) - s), share2 = S(0.5) * (S(1) + s);
        State<Sys, S> f;
        for (int i = 0; i < dim_v<Sys>; ++i)
            f[i] = share1 * f1[i] + share2 * f2[i];
        return f;
    }
};

/// A system whose switches are replaced by s_j = s(c1 h_j): a smooth one, with a layer of width
/// 1/c1 where the switched one has a surface.
///
/// Its surfaces are the ends of the stick bands: 2j is -h_j - band and 2j+1 is h_j - band, kinks
/// that are always crossed. A crossing to side +1 leaves the band (from stick to slip, in the
/// chapter's words), one to side -1 enters it.
/// @source chapter, (4.30) and section 4.5
template <class Sys> struct Smoothed {
    static_assert(HasField<Sys, double>,
                  "filippov: smoothing needs `field(t, x, s, p)`, written with the true magnitude "
                  "of what switches (friction: s mu(|v - V|)); where both sides exist on both "
                  "sides of the surface, Blended<System> has it");
    static_assert(!has_jumps_v<Sys>, "filippov: a jump of the state cannot be smoothed");
    static_assert(!has_directions_v<Sys>, "filippov: a direction cannot be smoothed");
    static constexpr int dim = dim_v<Sys>;
    static constexpr int surfaces = 2 * surfaces_v<Sys>;
    static constexpr auto kinds = [] {
        std::array<SurfaceKind, std::size_t(surfaces)> all;
        all.fill(SurfaceKind::kink);
        return all;
    }();
    static constexpr auto params = [] {
        std::array<std::string_view, std::size_t(params_v<Sys>)> names;
        if constexpr (params_v<Sys> > 0)
            for (std::size_t i = 0; i < names.size(); ++i)
                names[i] = Sys::params[i];
        return names;
    }();
    static constexpr auto defaults = [] {
        std::array<double, std::size_t(params_v<Sys>)> values{};
        if constexpr (requires { Sys::defaults; })
            for (std::size_t i = 0; i < values.size(); ++i)
                values[i] = static_cast<double>(Sys::defaults[i]);
        return values;
    }();

    template <class S> using X = Vec<S, dim>;
    template <class S> using P = Params<Sys, S>;

    Sys sys{};
    Smoothing how{};

    template <Scalar S> X<S> f(const S& t, const X<S>& x, const P<S>& p) const {
        const Vec<S, surfaces_v<Sys>> h = switching(sys, t, x, p);
        Vec<S, surfaces_v<Sys>> s;
        for (int j = 0; j < surfaces_v<Sys>; ++j)
            s[j] = smooth_sign(how.law, S(S(how.c1) * h[j]));
        return blended_field(sys, t, x, s, p);
    }
    template <Scalar S> Vec<S, surfaces> h(const S& t, const X<S>& x, const P<S>& p) const {
        if (how.band == 0)
            return Vec<S, surfaces>::Constant(S(-1));
        const Vec<S, surfaces_v<Sys>> of = switching(sys, t, x, p);
        Vec<S, surfaces> ends;
        for (int j = 0; j < surfaces_v<Sys>; ++j) {
            ends[2 * j] = -of[j] - S(how.band);
            ends[2 * j + 1] = of[j] - S(how.band);
        }
        return ends;
    }
    /// See `limit_to_layer`.
    template <Scalar S>
    X<S> largest_error(const S& t0, const X<S>& x0, const S& t1, const X<S>& x1,
                       const P<S>& p) const {
        const auto before = switching(sys, t0, x0, p), after = switching(sys, t1, x1, p);
        const S c1(how.c1);
        X<S> largest = X<S>::Constant(S(std::numeric_limits<Real<S>>::max()));
        for (int j = 0; j < surfaces_v<Sys>; ++j)
            limit_to_layer(largest, S(c1 * before[j]), S(c1 * after[j]),
                           X<S>(c1 * grad_h(sys, j, t1, x1, p)));
        return largest;
    }
    template <Scalar S>
    S period(const P<S>& p) const
        requires HasPeriod<Sys, S>
    {
        return sys.period(p);
    }
};

/// It has the defaults that the system has.
template <class Sys> inline constexpr bool has_defaults_v<Smoothed<Sys>> = has_defaults_v<Sys>;

/// The smoothed version of a system.
/// @error std::invalid_argument for a steepness or a band that makes no sense, and for a band
///        other than 1/c1 with the law `saturation`
template <class Sys> Smoothed<Sys> smoothed(const Sys& sys, Smoothing how = {}) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    if (!(how.c1 > 0 && how.c1 < inf))
        detail::refuse("c1", how.c1, "expected a finite number > 0");
    if (!(how.band >= 0 && how.band < inf))
        detail::refuse("band", how.band, "expected a finite number >= 0");
    if (how.law == SmoothLaw::saturation) {
        if (how.band != 0 && how.band != 1 / how.c1)
            detail::refuse("band", how.band,
                           "expected 1/c1 with the law `saturation`, which has its corners there");
        how.band = 1 / how.c1;
    }
    return {sys, how};
}

} // namespace filippov
