// SPDX-License-Identifier: BSD-3-Clause
// The pieces of a step in lanes: clock, tolerance, length and error control.
#pragma once

#include <filippov/ensemble/detail/lane_group.hpp>
#include <filippov/ensemble/detail/lane_guards.hpp>
#include <filippov/ensemble/population.hpp>
#include <filippov/methods/control.hpp>
#include <filippov/methods/runge_kutta.hpp>
#include <filippov/run/settings.hpp>

#include <limits>

namespace filippov::lanes {

/// What lanes compute with besides their members.
template <class Sys> struct Run {
    const Sys& sys;
    const Settings<double, dim_v<Sys>>& settings;
    const Vec<double, dim_v<Sys>>& escape; ///< see Population
    LaneCounters counters{};
    /// Steps that resolve the state resolve h.
    bool linear_h = has_linear_h(sys);
    bool bounded = (escape.array() < std::numeric_limits<double>::infinity()).any();
    double weight = mean_weight<Sys, double>(sys); ///< see there
};

// --- states --------------------------------------------------------------------------------------

template <int W, int N>
Vec<Lanes<W>, N> select_each(const LaneMask<W>& m, const Vec<Lanes<W>, N>& a,
                             const Vec<Lanes<W>, N>& b) {
    Vec<Lanes<W>, N> r;
    for (int i = 0; i < N; ++i)
        r[i] = select(m, a[i], b[i]);
    return r;
}
/// x + dt rate.
template <int W, int N>
Vec<Lanes<W>, N> moved(const Vec<Lanes<W>, N>& x, const Lanes<W>& dt,
                       const Vec<Lanes<W>, N>& rate) {
    Vec<Lanes<W>, N> y;
    for (int i = 0; i < N; ++i)
        y[i] = fused(dt, rate[i], x[i]);
    return y;
}
template <int W, int N> Lanes<W> sum(const Vec<Lanes<W>, N>& x) {
    Lanes<W> total = x[0];
    for (int i = 1; i < N; ++i)
        total += x[i];
    return total;
}
template <int W> LaneMask<W> finite(const Lanes<W>& sum) {
    return sum * Lanes<W>(0) == Lanes<W>(0);
}
/// The tolerance of the components, of which x has the larger size.
template <int W, int N>
Vec<Lanes<W>, N> scale(const Settings<double, N>& settings, const Vec<Lanes<W>, N>& x) {
    Vec<Lanes<W>, N> r;
    for (int i = 0; i < N; ++i)
        r[i] = error_allowed(settings.atol[i], settings.rtol, abs(x[i]));
    return r;
}
/// The same of a step from x to x1.
template <int W, int N>
FILIPPOV_INLINE Vec<Lanes<W>, N> scale_of_step(const Settings<double, N>& settings,
                                               const Vec<Lanes<W>, N>& x,
                                               const Vec<Lanes<W>, N>& x1) {
    Vec<Lanes<W>, N> r;
    for (int i = 0; i < N; ++i)
        r[i] = error_allowed(settings.atol[i], settings.rtol, max(abs(x[i]), abs(x1[i])));
    return r;
}
/// Over the components that there are.
template <class Sys, int W, int N>
Lanes<W> mean_square(const Run<Sys>& run, const Vec<Lanes<W>, N>& v,
                     const Vec<Lanes<W>, N>& scale) {
    Lanes<W> sum(0);
    for (int i = 0; i < N; ++i) {
        const Lanes<W> u = v[i] / scale[i];
        sum = fused(u, u, sum);
    }
    return sum * Lanes<W>(1.0 / component_count(run.sys));
}
template <class Sys, int W, int N>
LaneMask<W> beyond_bounds(const Run<Sys>& run, const Vec<Lanes<W>, N>& x) {
    LaneMask<W> out(false);
    for (int i = 0; run.bounded && i < N; ++i)
        out = out | (abs(x[i]) > Lanes<W>(run.escape[i]));
    return out;
}

// --- time ----------------------------------------------------------------------------------------

/// Moves the clock, as Clock::advance does. A step is no longer than a period. (What is left is
/// told by the clock: a difference for every step would lose digits in a long run.)
template <class Sys, int W>
void advance(Group<Sys, W>& g, const Lanes<W>& dt, const LaneMask<W>& where) {
    using T = Lanes<W>;
    const T step = dt + g[carry], next = g[time] + step;
    const T lost = step - (next - g[time]);
    const T T0 = g[period_length], turned = next - T0, back = turned - next;
    const T lost_too = (next - (turned - back)) - (T0 + back);
    const LaneMask<W> wraps = (T0 > T(0)) & (next >= T0);
    g.set(time, select(wraps, turned, next), where);
    g.set(carry, select(wraps, lost + lost_too, lost), where);
    g.set(index, select(wraps, g[index] + T(1), g[index]), where);
    const T periods = select(T0 > T(0), (g[end_index] - g[index]) * T0, T(0));
    g.set(left, periods + ((g[end_time] - g[time]) - g[carry]), where);
}
/// In which a forced s shows its swings.
template <class Sys, int W> Lanes<W> half_period(const Group<Sys, W>& g) {
    using T = Lanes<W>;
    return select(g[period_length] > T(0), T(0.5) * g[period_length], infinity<W>());
}

// --- trial steps ---------------------------------------------------------------------------------

/// The square of a step's error, in units of the tolerance.
/// @param x, x1  its ends
template <class Tableau, class Sys, int W, int N>
FILIPPOV_INLINE Lanes<W> step_error(const Run<Sys>& run, const RungeKutta<Tableau, Lanes<W>, N>& rk,
                                    const Vec<Lanes<W>, N>& x, const Vec<Lanes<W>, N>& x1,
                                    const Lanes<W>& dt) {
    Vec<Lanes<W>, N> weight = scale_of_step(run.settings, x, x1);
    Lanes<W> weighted = dt;
    if constexpr (requires { run.sys.components(); })
        weighted *= Lanes<W>(run.weight);
    for (int i = 0; i < N; ++i)
        weight[i] = weighted / weight[i];
    return Tableau::squared_error(rk, weight);
}
/// Where a step is accurate enough; the step control takes note.
/// @param x, x1    its ends
/// @param total    finite where all of it is
/// @param shorter  gives the next trial where it is not
template <class Tableau, class Sys, int W, int N, class Shorter>
FILIPPOV_INLINE LaneMask<W>
accept(const Run<Sys>& run, Group<Sys, W>& g, const RungeKutta<Tableau, Lanes<W>, N>& rk,
       const Vec<Lanes<W>, N>& x, const Vec<Lanes<W>, N>& x1, const Lanes<W>& total,
       const Trial<Lanes<W>>& r, const Shorter& shorter) {
    using T = Lanes<W>;
    const T error = step_error(run, rk, x, x1, r.dt);
    const LaneMask<W> sound = finite(total) & (error < infinity<W>());
    const LaneMask<W> accepted = sound & (error <= T(1));

    StepControl<Tableau, T> control{.previous = g[last_error], .largest = g[largest]};
    const T next = r.dt * control.factor(error, accepted);
    T proposed = select(accepted & (r.last | r.cut), max(next, g[proposal]), next);
    if (any(~sound))
        proposed = select(sound, proposed, shorter());
    g.set(last_error, control.previous, sound);
    g.set(largest, control.largest, sound);
    g[proposal] = proposed;
    g[tries] += T(1);
    return accepted;
}
/// Members that go no farther in lanes: no step moves them, or they took too many.
template <class Sys, int W>
LaneMask<W> gives_up(const Run<Sys>& run, const Group<Sys, W>& g, const Lanes<W>& t) {
    return (g[proposal] < resolution(t)) | (g[tries] >= Lanes<W>(double(run.settings.max_steps)));
}

} // namespace filippov::lanes
