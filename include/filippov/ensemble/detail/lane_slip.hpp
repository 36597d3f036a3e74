// SPDX-License-Identifier: BSD-3-Clause
// Slip in lanes: starts, steps on either side of the surface, and what ends them.
#pragma once

#include <filippov/ensemble/detail/lane_landing.hpp>

namespace filippov::lanes {

/// A side of the surface that is known when this is compiled: for steps, which are most of the
/// work.
template <int side> using Known = std::integral_constant<int, side>;

/// The tasks of members in slip, a group at a time. Each says who does not stay for another trip.
/// Those on one side are told on which, -1 or +1, as an int, or as Known.
template <class Sys, int W, class Tableau> class Slip {
    static constexpr int N = dim_v<Sys>;
    using Group = lanes::Group<Sys, W>;
    using Leaving = lanes::Leaving<W>;
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, N>;
    using Q = typename Group::Q;
    using Rk = RungeKutta<Tableau, T, N>;
    using Times = StageTimes<Tableau, double>;
    using Probed = lanes::Probed<Times, W>;
    using Look = lanes::Look<W>;
    using Landing = lanes::Landing<W, N>;
    using Contact = lanes::Contact<W, N>;

    static constexpr Task slip_task(int side) {
        return side < 0 ? Task::slip_below : Task::slip_above;
    }
    static constexpr Task fall_task(int side) {
        return side < 0 ? Task::fall_below : Task::fall_above;
    }
    static constexpr Task event_task(int side) {
        return side < 0 ? Task::event_below : Task::event_above;
    }

public:
    explicit Slip(Run<Sys>& run) : run_(run), sys_(run.sys) {}

    /// Finds the mode by the sign of h, or as at any contact where h is zero.
    Leaving begin(Group& g) const {
        const X x = g.x();
        const Q& p = g.p();
        const T t = g[time], value = h(t, x, p);
        X atol;
        for (int i = 0; i < N; ++i)
            atol[i] = T(run_.settings.atol[i]);
        const Mask on = abs(value) <= start_band(sys_, 0, t, x, p, atol);
        const Mask below = value < T(0);
        const X f = field_of_side(sys_, below, t, x, p);
        const T natural = first_step(g, x, p, f, below);
        const T first = run_.settings.first_step > 0 ? T(run_.settings.first_step) : natural;
        const StepControl<Tableau, T> control;
        g[proposal] = min(first, g[longest_step]);
        g[last_error] = control.previous;
        g[largest] = control.largest;
        g[reach] = infinity<W>();
        g[start_order] = T(0);
        g.set_k0(f, ~on);
        g.set(start_value, abs(value), ~on);
        Contact c = judge(run_, g, 0, Landing{x, f, T(0)}, on);
        c.mode = select(on, c.mode, select(below, T(-1), T(1)));
        c.plain = (on & c.plain) | (~on & finite(sum(f)) & (abs(value) < infinity<W>()));
        take_up(g, c, on & c.plain);
        Leaving leaving(g.active);
        send_on(leaving, c, c.plain);
        return leaving;
    }

    /// A trial step of every lane. It is taken, or to be tried shorter, or in doubt: then it goes
    /// to those who look for events.
    template <class Side> FILIPPOV_FLATTEN Leaving step(Group& g, Side side) const {
        const X x = g.x();
        const Q& p = g.p();
        const Trial<T> r = next_trial(g[proposal], T(g[longest_step]), g[reach], g[left]);
        const T t = g[time], dt = r.dt;

        Rk rk;
        rk.k[0] = g.k0();
        Probed guard; // of which each stage fills in its probe
        guard.start = g[start_value];
        guard.order = g[start_order];
        const auto rhs = [&](std::size_t k, const T& tau, const X& y) FILIPPOV_LAMBDA_INLINE {
            guard.probe[k] = T(side) * h(tau, y, p);
            return field(side, tau, y, p);
        };
        X x1;
        rk.step(rhs, t, x, dt, x1);
        T total = sum(X(x1 + rk.sum_of_stages()));
        for (std::size_t k = 1; k <= Times::n; ++k)
            total += guard.probe[k];
        const Mask accepted =
            accept(run_, g, rk, x, x1, total, r, [&] { return shorter_than(g, x, p, dt); });
        g.set(reach, guard.reach(dt, T(4) * resolution(t)), accepted);

        Mask doubt = accepted & guard.doubtful();
        if (!run_.linear_h) [[unlikely]]
            doubt = doubt | (accepted & ~shows_all(g, r, guard, accepted));
        const Mask taken = accepted & ~doubt;
        g.set(trial, dt, doubt);
        g.set_x(x1, taken);
        g.set_k0(rk.k[Rk::last], taken);
        g.set(start_value, guard.end(), taken);
        g.set(start_order, T(0), taken);
        advance(g, dt, taken);
        run_.counters.steps += std::popcount(g.active);

        const Mask gone = taken & beyond_bounds(run_, x1), ended = taken & r.last;
        Leaving leaving((doubt | gone | ended | gives_up(run_, g, t)).word() & g.active);
        if (leaving.lanes == 0)
            return leaving;
        if (run_.linear_h) [[likely]]
            leaving.send(doubt & falls_through(g, rk, guard, dt, x1, p, side), fall_task(side));
        leaving.send(doubt, event_task(side));
        leaving.send(gone, Task::escape);
        leaving.send(ended, Task::end_leg);
        return leaving;
    }

    /// A step that falls through the surface: its end is sought at once. Where that is not found as
    /// plainly, it is looked along like any other step in doubt.
    template <class Side> Leaving fall(Group& g, Side side) const {
        const Q& p = g.p();
        Rk rk;
        rk.k[0] = g.k0();
        Landing at{g.x(), g.k0(), g[trial]};
        const Mask landed = land_on_surface(rk, g, side, foreseen(g, p, side), Mask(true), at);
        const Contact contact = judge(run_, g, side, at, landed);
        const Mask met = landed & contact.plain;
        advance(g, at.dt, met);
        take_up(g, contact, met);
        Leaving leaving(g.active);
        send_on(leaving, contact, met);
        leaving.send(Mask(true), event_task(side));
        return leaving;
    }

    /// A step in doubt: taken again, looked along, and ended at the event if there is one.
    template <class Side> Leaving meet(Group& g, Side side) const {
        const Q& p = g.p();
        const T t = g[time], dt = g[trial];
        Rk rk;
        rk.k[0] = g.k0();
        Landing at;
        at.dt = dt;
        take_again(rk, g, side, dt, at.x);
        const X full = at.x, full_field = rk.k[Rk::last];
        at.field = full_field;
        const auto path = path_of(rk, g, side, dt, full);
        run_.counters.searches += std::popcount(g.active);

        const Mask rooted = g[start_order] > T(0), twice = g[start_order] > T(1);
        const T offset = select(rooted, g[start_value], T(0));
        const auto guard = [&](const T& u) {
            const T raw = T(side) * h(fused(u, dt, t), path(u), p) - offset;
            return raw / select(twice, u * u, select(rooted, u, T(1)));
        };
        const T end = T(side) * h(t + dt, full, p);
        Look look = run_.linear_h ? look_along(guard, g[start_value], end - offset, rooted)
                                  : look_closely(guard, g[start_value], end - offset, rooted);
        const T at_root = root(look, 1e-6, guard);
        if (!run_.linear_h) {
            look.hard = look.hard | (look.found & ~falls_smoothly(at_root, guard));
            look.settle();
        }
        const Mask landed = land_on_surface(rk, g, side, at_root * dt, look.found, at);
        const Contact contact = judge(run_, g, side, at, landed);

        const Mask met = landed & contact.plain, passes = ~(look.hard | look.found);
        const Mask last = passes & (dt >= g[left]), gone = passes & beyond_bounds(run_, full);
        g.set_x(full, passes);
        g.set_k0(full_field, passes);
        g.set(start_value, end, passes);
        g.set(start_order, T(0), passes);
        advance(g, select(passes, dt, at.dt), passes | met);
        take_up(g, contact, met);
        Leaving leaving(g.active);
        send_on(leaving, contact, met);
        leaving.send(gone, Task::escape);
        leaving.send(last, Task::end_leg);
        leaving.send(passes, slip_task(side));
        return leaving;
    }

private:
    /// A step of the group once more, not probed. No part of its callers: these take it in several
    /// places, and a step is the largest piece of code there is.
    template <class Side>
    FILIPPOV_FLATTEN FILIPPOV_NOINLINE void take_again(Rk& rk, const Group& g, Side side,
                                                       const T& dt, X& x1) const {
        const auto field = field_of(side, g.p());
        rk.step(field, g[time], g.x(), dt, x1);
    }
    /// The interpolant over it, the same.
    template <class Side>
    FILIPPOV_FLATTEN FILIPPOV_NOINLINE auto path_of(Rk& rk, const Group& g, Side side, const T& dt,
                                                    const X& x1) const {
        const auto field = field_of(side, g.p());
        return rk.interpolant(field, g[time], g.x(), dt, x1);
    }
    /// Shortens a step until it ends where h is zero: see `land`.
    template <class Side>
    FILIPPOV_FLATTEN FILIPPOV_NOINLINE Mask land_on_surface(Rk& rk, const Group& g, Side side,
                                                            const T& d, const Mask& wanted,
                                                            Landing& at) const {
        const Q& p = g.p();
        const auto take = [&](const T& length, X& x1) { take_again(rk, g, side, length, x1); };
        const auto to_surface = [&](const Landing& tried) {
            const T end = g[time] + tried.dt;
            return -h(end, tried.x, p) / normal_component(sys_, 0, end, tried.x, p, tried.field);
        };
        return land(run_, g, rk, take, d, wanted, at, Target{1e-3, to_surface});
    }
    template <class Side> auto field_of(Side side, const Q& p) const {
        return [this, side, &p](std::size_t, const T& tau, const X& y)
                   FILIPPOV_LAMBDA_INLINE { return field(side, tau, y, p); };
    }
    FILIPPOV_INLINE X field(int side, const T& t, const X& x, const Q& p) const {
        return side < 0 ? sys_.f1(t, x, p) : sys_.f2(t, x, p);
    }
    FILIPPOV_INLINE T h(const T& t, const X& x, const Q& p) const {
        return switching(sys_, t, x, p)[0];
    }

    /// What a guard shows along a step.
    /// @param rooted  where there was a root at the start, which is divided out
    template <class Guard>
    static Look look_along(const Guard& guard, const T& start, const T& end, const Mask& rooted) {
        std::array<T, 9> v;
        v[0] = start;
        for (std::size_t k = 1; k < 8; ++k)
            v[k] = guard(T(double(k) / 8));
        v[8] = end;
        return lanes::look_along(v, rooted);
    }
    /// The same of an h with a pace of its own. What a root divided out leaves at the start, the
    /// first samples tell.
    template <class Guard>
    FILIPPOV_COLD static Look look_closely(const Guard& guard, const T& start, const T& end,
                                           const Mask& rooted) {
        using Samples = SampleTimes<double>;
        std::array<T, Samples::n + 1> v;
        for (std::size_t k = 1; k < Samples::n; ++k)
            v[k] = guard(T(Samples::theta(k)));
        v[Samples::n] = end;
        constexpr double back = Samples::theta(1) / (Samples::theta(2) - Samples::theta(1));
        v[0] = select(rooted, fused(T(back), v[1] - v[2], v[1]), start);
        Look look = look_at_samples<Samples>(v);
        look.hard = look.hard | (look.found & rooted & (look.high <= T(Samples::theta(1))));
        look.settle();
        return look;
    }
    /// Where a step of a field shows all of an h with a pace of its own: its probes, if they are
    /// many, follow a cubic, or are far off it but farther from zero; a field that is quiet has not
    /// let it grow; and it is not the first of its mode. The next step is not to be too long for
    /// h: see Watch::look.
    FILIPPOV_COLD static Mask shows_all(Group& g, const Trial<T>& r, const Probed& guard,
                                        const Mask& accepted) {
        std::array<T, Times::n + 1> v = guard.probe;
        v[0] = guard.start;
        const Fit<T> fit = fit_of<Times>(v);
        const StepControl<Tableau, T> control;
        const Mask quiet = accepted & (g[last_error] <= control.previous);
        const Mask young = (g[start_order] > T(0)) | (g[tries] <= T(1));
        const T most =
            select(fit.full(), T(1), select((quiet | young) & ~r.cut, T(2), infinity<W>()));
        g.set(proposal, min(g[proposal], most * r.dt), accepted);
        constexpr bool few = Times::n < 10;
        return (fit.clear() | fit.resolved()) & ~(quiet | young | Mask(few));
    }
    /// As the first step of a segment, with a coarser power.
    T first_step(const Group& g, const X& x, const Q& p, const X& f, const Mask& below) const {
        const X size = scale(run_.settings, x);
        const T d0 = mean_square(run_, x, size), d1 = mean_square(run_, f, size);
        const T span = select(g[left] > T(0), g[left], T(1)); // its first leg may have no length
        const Mask some = d0 >= T(1e-10);
        const T h0 =
            select(some & (d1 > T(0)), T(0.01) * min(T(sqrt(d0 / d1)), span), T(1e-6) * span);
        const X change = field_of_side(sys_, below, T(g[time] + h0), moved(x, h0, f), p) - f;
        const T d2 = mean_square(run_, change, size) / (h0 * h0);
        const T found = sqrt(min(T(d0 / d1), T(sqrt(d0 / d2))));
        const Mask steady = d2 * span * span <= T(1e-18) * d1;
        const T other = T(1e-4) * span, soon = T(1e3) / sqrt(d1);
        const T unit =
            select(some & (found < infinity<W>()), found, select(steady, min(other, soon), other));
        const T most = max(T(d1 * unit * unit), T(d2 * unit * unit * unit * unit));
        const T power = T(-0.5 / Tableau::order) * detail::log2_of(T(most * T(1e4)));
        const T longest = run_.linear_h ? span : span / T(128);
        const T first = min(unit * min(T(1), detail::exp2_of(power)), longest);
        return select((first > T(0)) & (first < infinity<W>()), first, T(1e-6) * span);
    }
    /// The next trial after a stage that was not finite: nearly to the surface if the step led
    /// across it, else a quarter.
    FILIPPOV_COLD T shorter_than(const Group& g, const X& x, const Q& p, const T& dt) const {
        const T eta = -h(g[time], x, p) / normal_component(sys_, 0, g[time], x, p, g.k0());
        return select((eta > T(0)) & (eta < dt), T(0.9) * eta, T(0.25) * dt);
    }

    /// Where a step falls through the surface, once and all the way: from stage to stage, with
    /// slopes at both ends that lead down. Its end is left in the group.
    FILIPPOV_INLINE Mask falls_through(Group& g, const Rk& rk, const Probed& guard, const T& dt,
                                       const X& x1, const Q& p, int side) const {
        // the clock of a step in doubt has not moved
        const T end = g[time] + dt;
        g[fall_end] = guard.end();
        g[fall_slope] = T(side) * normal_component(sys_, 0, end, x1, p, rk.k[Rk::last]);
        const T slope0 = T(side) * normal_component(sys_, 0, g[time], g.x(), p, g.k0());
        return guard.falls() & (slope0 < T(0)) & (g[fall_slope] < T(0)) & (g[fall_end] < T(0));
    }
    /// When a falling guard is zero, by Newton on the cubic through its ends.
    T foreseen(const Group& g, const Q& p, int side) const {
        const T dt = g[trial], h0 = g[start_value], rise = g[fall_end] - h0;
        const T slope0 = T(side) * normal_component(sys_, 0, g[time], g.x(), p, g.k0());
        const T bend = fused(dt, slope0, -rise), tilt = fused(-dt, g[fall_slope], rise) - bend;
        T u = h0 / -rise;
        for (int k = 0; k < 3; ++k) {
            // h(u) = h0 + u (rise + (1 - u) (bend + u tilt))
            const T v = T(1) - u, inner = fused(u, tilt, bend);
            const T value = fused(u, fused(v, inner, rise), h0);
            const T slope = fused(u * v, tilt, fused(v - u, inner, rise));
            u = min(max(u - value / slope, T(0)), T(1));
        }
        return u * dt;
    }

    Run<Sys>& run_;
    const Sys& sys_;
};

} // namespace filippov::lanes
