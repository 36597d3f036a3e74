// SPDX-License-Identifier: BSD-3-Clause
// The field of a mode as the stages of a step see it: each evaluation also probes the guards.
#pragma once

#include <filippov/events/watch.hpp>
#include <filippov/methods/rosenbrock.hpp>
#include <filippov/run/place.hpp>

namespace filippov {

namespace detail {

/// Derivatives of the field of a slide of second order, in which there are derivatives already.
template <class Sys, class S>
FILIPPOV_COLD Slopes<S, dim_v<Sys>> slopes_by_differences(const Place<Sys, S>& at, const S& t,
                                                          const State<Sys, S>& x) {
    using std::abs;
    constexpr int N = dim_v<Sys>;
    const auto field = [&](const S& time, const State<Sys, S>& y) {
        return mode_field(at.sys, at.mode, time, toward(at.sys, at.held, time, y, at.p, at.scale),
                          at.p);
    };
    const S part = std::cbrt(epsilon<S>), unit = S(1) / at.settings.rtol;
    const State<Sys, S> f = field(t, x);
    Slopes<S, N> slopes;
    slopes.size = at.scale;
    S slowest = std::numeric_limits<S>::infinity(); // a time in which a component changes
    for (int i = 0; i < N; ++i) {
        const S d = part * unit * at.scale[i];
        const State<Sys, S> e = d * State<Sys, S>(State<Sys, S>::Unit(i));
        slopes.by_x.col(i) = (field(t, x + e) - field(t, x - e)) / (S(2) * d);
        slowest = std::min(slowest, S(unit * at.scale[i] / abs(f[i])));
    }
    const S d = part * (slowest < std::numeric_limits<S>::max() ? slowest : std::max(abs(t), S(1)));
    slopes.by_t = (field(S(t + d), x) - field(S(t - d), x)) / (S(2) * d);
    return slopes;
}

/// Derivatives of the field of the current mode, as its stages see it.
template <class Sys, class S>
Slopes<S, dim_v<Sys>> slopes_at(const Place<Sys, S>& at, const S& t, const State<Sys, S>& x) {
    if constexpr (slides_twice_v<Sys>)
        if (at.mode.second_order != 0) [[unlikely]]
            return slopes_by_differences(at, t, x);
    const auto field = [&](const auto& time, const auto& y, const auto& p) {
        return mode_field(at.sys, at.mode, time,
                          at.mode.sliding() > 0 ? toward(at.sys, at.held, time, y, p, at.scale) : y,
                          p, at.its_layers());
    };
    Slopes<S, dim_v<Sys>> slopes = slopes_of(field, t, x, at.p);
    slopes.size = at.scale;
    return slopes;
}

} // namespace detail

/// A one-sided field.
/// @tparam Side  of the one surface; 0: the mode says on which sides
template <int Side, class Sys, class S, class Guards> struct SideField {
    using X = State<Sys, S>;
    static constexpr bool slides = false;

    const Place<Sys, S>& at;
    Guards& guards;

    FILIPPOV_INLINE X field(const S& t, const X& x) const {
        if constexpr (Side == -1)
            return at.sys.f1(t, x, at.p);
        else if constexpr (Side == +1)
            return at.sys.f2(t, x, at.p);
        else
            return side_field(at.sys, at.mode, t, x, at.p);
    }
    FILIPPOV_INLINE void probe(std::size_t k, const S& t, const X& x) {
        constexpr int M = surfaces_v<Sys>;
        const Vec<S, M> h = switching(at.sys, t, x, at.p);
        if constexpr (Side != 0)
            guards.probe(0, k, h[0]);
        else
            for (int j = 0; j < M; ++j)
                guards.probe(Guard<M>::below(j), k, h[j]);
    }
    FILIPPOV_INLINE X operator()(std::size_t k, const S& t, const X& x) {
        probe(k, t, x);
        return field(t, x);
    }
    auto slopes(const S& t, const X& x) const { return detail::slopes_at(at, t, x); }
};

/// The sliding field; a stage is put on the surface first, so that the fields need not exist off
/// it.
template <class Sys, class S, class Guards> struct SlideField {
    using X = State<Sys, S>;
    static constexpr bool slides = true;

    const Place<Sys, S>& at;
    Guards& guards;

    FILIPPOV_INLINE X field(const S& t, const X& x) const { return slide(t, x).f; }
    FILIPPOV_INLINE void probe(std::size_t k, const S& t, const X& x) { (*this)(k, t, x); }
    FILIPPOV_INLINE X operator()(std::size_t k, const S& t, const X& x) {
        constexpr int M = surfaces_v<Sys>;
        const auto now = slide(t, x);
        if constexpr (single_v<Sys>) {
            guards.probe_slide(k, now);
        } else {
            const Vec<S, M> h = switching(at.sys, t, x, at.p);
            for (int j = 0; j < M; ++j)
                if (at.mode[j] == 0)
                    guards.probe_margins(j, k, now.below[j], now.above[j], guards.attracts(now, j));
                else
                    guards.probe(Guard<M>::below(j), k, h[j]);
        }
        return now.f;
    }
    auto slopes(const S& t, const X& x) const { return detail::slopes_at(at, t, x); }

private:
    FILIPPOV_INLINE auto slide(const S& t, const X& x) const {
        const X y = toward(at.sys, at.held, t, x, at.p, at.scale);
        if constexpr (!single_v<Sys>)
            return joint_sliding(at.sys, at.mode, t, y, at.p, at.its_layers());
        else if constexpr (may_have_layers_v<Sys, S>)
            return at.layered ? sliding_in_layer(at.sys, at.mode, t, y, at.p, at.layers)
                              : sliding(at.sys, at.mode, t, y, at.p);
        else
            return sliding(at.sys, at.mode, t, y, at.p);
    }
};

/// Calls use(rhs) with the field of the current mode, which probes all guards but sections.
template <class Sys, class S, class Guards, class Use>
FILIPPOV_INLINE void field_of_mode(const Place<Sys, S>& at, Guards& guards, Use use) {
    if (at.mode.sliding() > 0)
        return use(SlideField<Sys, S, Guards>{at, guards});
    if constexpr (HasSides<Sys, S> && !sides_are_data_v<Sys>) {
        if (at.mode[0] < 0)
            use(SideField<-1, Sys, S, Guards>{at, guards});
        else
            use(SideField<+1, Sys, S, Guards>{at, guards});
    } else {
        use(SideField<0, Sys, S, Guards>{at, guards});
    }
}

/// The field of the current mode where sections are watched. It is called, not inlined: sections
/// are functions behind pointers, beside which that costs little, and whoever has none has no trace
/// of them in his loop.
template <class Sys, class S, class Guards> struct WatchedField {
    using X = State<Sys, S>;

    const Place<Sys, S>& at;
    Guards& guards;

    FILIPPOV_NOINLINE void probe(std::size_t k, const S& t, const X& x) {
        field_of_mode(at, guards, [&](auto&& rhs) { rhs.probe(k, t, x); });
        guards.probe_sections(k, t, x);
    }
    FILIPPOV_NOINLINE X operator()(std::size_t k, const S& t, const X& x) {
        X f;
        field_of_mode(at, guards, [&](auto&& rhs) { f = rhs(k, t, x); });
        guards.probe_sections(k, t, x);
        return f;
    }
    auto slopes(const S& t, const X& x) const { return detail::slopes_at(at, t, x); }
};

/// Calls use(rhs) with the field of the current mode, which probes all guards.
template <class Sys, class S, class Guards, class Use>
FILIPPOV_INLINE void probed_field(const Place<Sys, S>& at, Guards& guards, Use use) {
    if (guards.watches_sections()) [[unlikely]]
        return use(WatchedField<Sys, S, Guards>{at, guards});
    field_of_mode(at, guards, use);
}

} // namespace filippov
