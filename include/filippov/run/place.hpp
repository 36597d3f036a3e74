// SPDX-License-Identifier: BSD-3-Clause
// Where a run is: what its steps move and its guards look at.
#pragma once

#include <filippov/run/clock.hpp>
#include <filippov/run/settings.hpp>
#include <filippov/sliding/intersection.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

namespace filippov {

/// Time, state and mode of a run, the system that it follows, and the lengths by which its errors
/// are judged.
template <class Sys, class S> struct Place {
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using P = Params<Sys, S>;

    const Sys& sys;
    const P p;
    const Settings<S, N>& settings;
    Clock<S> clock{};
    int direction = 1; ///< of time
    X x;
    X scale; ///< what the tolerance lets each component err
    Mode<M> mode{};
    Constraints<Sys> held{}; ///< what holds the solution in this mode
    Layers<Sys, S> layers{}; ///< of the surfaces slid on
    bool layered = false;    ///< there are some

    Place(const Sys& system, const P& params, const Settings<S, N>& how)
        : sys(system), p(params), settings(how) {}

    FILIPPOV_INLINE void put(const X& y) {
        x = y;
        weigh();
    }
    void enter(const Mode<M>& new_mode) {
        mode = new_mode;
        held = Constraints<Sys>(sys, mode);
        if constexpr (!single_v<Sys>)
            if (held.size() > 1)
                held = independent_part(sys, held, clock.local, x, p, scale);
        if constexpr (may_have_layers_v<Sys, S>)
            if (layered) [[unlikely]]
                look_from_beside(layers);
    }
    /// Surfaces slid on are looked at from beside: those that have layers.
    FILIPPOV_COLD void look_from_beside(const Layers<Sys, S>& all) {
        layers = all;
        for (int j = 0; j < M; ++j)
            if (mode[j] != 0)
                layers.width[j] = S(0);
        layered = layers.any();
    }
    /// The layers of the surfaces slid on; null: none has one.
    const Layers<Sys, S>* its_layers() const {
        if constexpr (may_have_layers_v<Sys, S>)
            return layered ? &layers : nullptr;
        else
            return nullptr;
    }

    /// The smallest step that moves the clock.
    S resolution() const { return filippov::resolution(clock.local); }

    /// The field of the mode.
    X field(const S& t, const X& y) const { return mode_field(sys, mode, t, y, p, its_layers()); }
    /// The margins of the slide on surface j.
    Margin<S> margin(int j, const S& t, const X& y) const {
        return sliding_margin(sys, mode, j, t, y, p, its_layers());
    }

    /// What holds the solution in this mode, and surface j that it meets.
    Constraints<Sys> held_with(int j, const S& t, const X& y) const {
        Constraints<Sys> on = held;
        on.add(j, false);
        if constexpr (single_v<Sys>)
            return on;
        else
            return on.of_state(sys, t, y, p);
    }

    /// Root mean square in units of the tolerance, over the components that there are.
    S norm(const X& v) const { return norm(v, scale); }
    /// The same in other units.
    S norm(const X& v, const X& unit) const {
        using std::sqrt;
        S sum(0);
        for (int i = 0; i < N; ++i)
            sum += (v[i] / unit[i]) * (v[i] / unit[i]);
        return sqrt(sum / S(component_count(sys)));
    }
    /// What the tolerance lets a step from here to x1 err.
    FILIPPOV_INLINE X scale_of_step(const X& x1, const S& dt) const {
        using std::abs;
        X lengths;
        for (int i = 0; i < N; ++i)
            lengths[i] =
                std::max(scale[i], error_allowed(settings.atol[i], settings.rtol, S(abs(x1[i]))));
        limit(lengths, S(clock.local + dt), x1);
        return lengths;
    }

    /// Names the function that is not finite at (t, y), if one is.
    std::string_view what_is_not_finite(const S& t, const X& y) const {
        if (!all_finite<S, M>(switching(sys, t, y, p)))
            return "h";
        if (!all_finite<S, N>(field(t, y))) {
            if constexpr (HasSides<Sys, S>)
                return mode[0] < 0 ? "f1" : mode[0] > 0 ? "f2" : "sliding field";
            return mode.sliding() > 0 ? "sliding field" : "field";
        }
        return "";
    }

private:
    FILIPPOV_INLINE void weigh() {
        using std::abs;
        for (int i = 0; i < N; ++i)
            scale[i] = error_allowed(settings.atol[i], settings.rtol, S(abs(x[i])));
        limit(scale, clock.local, x);
    }
    /// Takes lengths down to what the system lets a step from here to (t, y) err.
    FILIPPOV_INLINE void limit([[maybe_unused]] X& lengths, [[maybe_unused]] const S& t,
                               [[maybe_unused]] const X& y) const {
        if constexpr (HasLargestError<Sys, S>) {
            if constexpr (requires { sys.limits_errors(); })
                if (!sys.limits_errors())
                    return;
            const X largest = sys.largest_error(clock.local, x, t, y, p);
            for (int i = 0; i < N; ++i)
                lengths[i] = std::max(std::min(lengths[i], largest[i]), smallest_error<S>());
        }
    }
};

} // namespace filippov
