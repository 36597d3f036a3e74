// SPDX-License-Identifier: BSD-3-Clause
// Events in lanes: steps that end on them, and what goes on from there where that is plain.
#pragma once

#include <filippov/ensemble/detail/lane_guards.hpp>
#include <filippov/ensemble/detail/lane_step.hpp>
#include <filippov/sliding/mode.hpp>

namespace filippov::lanes {

// --- landing -------------------------------------------------------------------------------------

/// The end of a step.
template <int W, int N> struct Landing {
    Vec<Lanes<W>, N> x, field;
    Lanes<W> dt;

    /// Moves it by a second-order Taylor step.
    void nudge(const Lanes<W>& delta, const Vec<Lanes<W>, N>& bend) {
        for (int i = 0; i < N; ++i) {
            x[i] = fused(delta, fused(Lanes<W>(0.5) * delta, bend[i], field[i]), x[i]);
            field[i] = fused(delta, bend[i], field[i]);
        }
        dt += delta;
    }
};
/// What a step is to end on.
/// @tparam Correction  Newton's, of the time at which a landing is there
template <class Correction> struct Target {
    double near; ///< what the last correction may be, units of the step
    Correction correction;
};
template <class Correction> Target(double, Correction) -> Target<Correction>;

/// Shortens steps until they end on a target, by Newton on their length; the last correction is a
/// Taylor step, once its error is below a hundredth of the tolerance.
/// @param take  takes a step of some length to x1
/// @param d     first guess of the length
/// @param at    the whole step; where this succeeds, the shortened one
/// @return      where it does
template <class Sys, int W, int N, class Rk, class Take, class Correction>
LaneMask<W> land(Run<Sys>& run, const Group<Sys, W>& g, const Rk& rk, const Take& take, Lanes<W> d,
                 const LaneMask<W>& wanted, Landing<W, N>& at, const Target<Correction>& target) {
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    const Vec<T, N> x = g.x(), k0 = g.k0(), tolerance = scale(run.settings, x);
    const T longest = min(T(1.01) * at.dt, g[left]);
    Mask todo = wanted & g.members(), done(false);
    for (int k = 0; k < 8 && any(todo); ++k) {
        Landing<W, N> tried;
        take(d, tried.x);
        run.counters.landings += std::popcount(todo.word());
        tried.field = rk.k[Rk::last];
        tried.dt = d;
        Vec<T, N> bend;
        for (int i = 0; i < N; ++i)
            bend[i] = (tried.field[i] - k0[i]) / d;
        // (then the estimate of the whole step was small by chance)
        const Mask errs_more = ~(step_error(run, rk, x, tried.x, d) <= T(4));
        T delta = target.correction(tried);
        const T error = mean_square(run, bend, tolerance) * (delta * delta) * (delta * delta);
        const T next = d + delta;
        todo = todo & (next > T(0)) & (next < longest);
        for (int n = 0; n < 2; ++n) { // the second one mends what curvature left
            tried.nudge(delta, bend);
            delta = target.correction(tried);
        }
        const Mask there = todo & ~errs_more & (error <= T(1e-4)) &
                           (abs(delta) <= T(target.near) * d) & (tried.dt < longest);
        at.x = select_each(there, tried.x, at.x);
        at.field = select_each(there, tried.field, at.field);
        at.dt = select(there, tried.dt, at.dt);
        done = done | there;
        todo = todo & ~there;
        d = select(todo, next, d);
    }
    return done;
}

// --- contacts ------------------------------------------------------------------------------------

/// The sizes of normal components that need no thought: see `departure`.
template <int W> struct Plainly {
    Lanes<W> least, band;
    LaneMask<W> finite;
};
template <class Sys, int W>
Plainly<W> plainly(const Sides<Sys, Lanes<W>>& b, const Lanes<W>& rounding, const Lanes<W>& tau) {
    const Lanes<W> band = contact_band(rounding, b, tau);
    return {plain_slope(band) / tau, band, abs(b.l1) + abs(b.l2) < infinity<W>()};
}

/// f1 where `below`, elsewhere f2.
template <class Sys, int W, int N>
Vec<Lanes<W>, N> field_of_side(const Sys& sys, const LaneMask<W>& below, const Lanes<W>& t,
                               const Vec<Lanes<W>, N>& x, const Params<Sys, Lanes<W>>& p) {
    return select_each(below, Vec<Lanes<W>, N>(sys.f1(t, x, p)), Vec<Lanes<W>, N>(sys.f2(t, x, p)));
}

/// A side's field at a point of the surface, and the first derivative of h along it that is not
/// zero: of this order.
template <int Order, class Sys, int W> struct Leading {
    using T = Lanes<W>;
    using X = Vec<T, dim_v<Sys>>;
    LaneMask<W> below; ///< it is f1, elsewhere f2
    T t;
    X x, f;
    T derivative;

    /// h' after a step of Heun's, as a multiple of what this derivative makes of it.
    T multiple(const Sys& sys, const Params<Sys, T>& p, const T& dt) const {
        const T later = t + dt;
        const X end = field_of_side(sys, below, later, moved(x, dt, f), p);
        const X y = moved(x, T(T(0.5) * dt), X(f + end));
        const T rate =
            normal_component(sys, 0, later, y, p, field_of_side(sys, below, later, y, p));
        return rate / (Order == 1 ? derivative : derivative * dt);
    }
};
/// True where this derivative says where h goes, though it is not so large that nothing has to be
/// known of the next one.
///
/// `plain_slope` and `plain_bend` allow for a next derivative that changes h by all of its size
/// within a step. Of the shorter steps of a small tolerance it changes ever less, and by them alone
/// ever more would seem hard. So it is looked at, along the field, a step ahead and nearer by: h is
/// to rise far above its rounding within the step, and before the next derivative turns it back.
/// @param band  what rounding leaves of h
template <int Order, class Sys, int W>
FILIPPOV_COLD LaneMask<W> decides(const Sys& sys, const Group<Sys, W>& g,
                                  const Leading<Order, Sys, W>& a, const Lanes<W>& band) {
    using T = Lanes<W>;
    const T tau = g[proposal];
    // What is seen of the next derivative may be wrong by tens.
    const T far = T(1e3) * band;
    // c tau^n over the step, c' tau^(n+1) of the next, n = Order: they balance at c/c'.
    const T height = abs(a.derivative) * (Order == 1 ? tau : T(T(0.5) * tau * tau)) / far;
    LaneMask<W> sure = height > T(1);
    for (const double part : {1.0, 1.0 / 8, 1.0 / 64}) {
        const T multiple = a.multiple(sys, g.p(), T(T(part) * tau));
        // (1 + 1/n) c'/c tau, if the next derivative alone made the difference
        const T turn = (multiple - T(1)) * T(1 / part);
        sure = sure & (height > (Order == 1 ? abs(turn) : T(T(8.0 / 9) * turn * turn)));
        if constexpr (Order == 2) // differences of small numbers told it
            sure = sure & (multiple > T(0));
    }
    return sure;
}
/// What is sure, but for the lanes in which it is asked for in vain: there, what `look` finds.
template <int W, class Look>
FILIPPOV_INLINE LaneMask<W> surely(const LaneMask<W>& plainly, const LaneMask<W>& asked,
                                   const Look& look) {
    const LaneMask<W> open = asked & ~plainly;
    return any(open) ? plainly | (open & look()) : plainly;
}

/// `from`, put on the surface where it may be moved: at a start by a tolerance, after a step as
/// `may_be_put_on` says.
/// @param landed    where `from` is the end of a step, at t
/// @param rounding  of h, see `rounding_band_along`
template <class Sys, int W, int N>
Vec<Lanes<W>, N> settled(const Run<Sys>& run, const Group<Sys, W>& g, const Landing<W, N>& from,
                         const Lanes<W>& t, const LaneMask<W>& landed, const Lanes<W>& rounding) {
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    const Vec<T, N> lengths = scale(run.settings, from.x);
    const Vec<T, N> there = project(run.sys, 0, t, from.x, g.p(), lengths);
    const T h = switching(run.sys, t, from.x, g.p())[0];
    Mask rounds(true), near = ~landed | (abs(h) > rounding);
    for (int i = 0; i < N; ++i) {
        const T moved = abs(there[i] - from.x[i]);
        const T tick = T(32) * abs(from.x[i]) + T(64) * abs(t * from.field[i]);
        rounds = rounds & (moved <= T(epsilon<double>) * tick);
        near = near & (moved <= lengths[i]);
    }
    return select_each(rounds | near, there, from.x);
}

/// What goes on from a point of the surface.
template <int W, int N> struct Contact {
    Vec<Lanes<W>, N> x; ///< there
    Lanes<W> mode;      ///< -1, 0 or +1
    LaneMask<W> plain;  ///< nothing to think about
    Lanes<W> h;         ///< what rounding leaves of it
    Vec<Lanes<W>, N> f; ///< of the mode
    Lanes<W> s, w;      ///< of a slide, and L1 - L2
};
/// The first-order case of `admissible`: both normal components plainly not zero.
/// @param side   from which the solution comes; 0: it starts here
/// @param where  it took all of the step `at`; elsewhere none
template <class Sys, int W, int N>
FILIPPOV_NOINLINE Contact<W, N> judge(const Run<Sys>& run, const Group<Sys, W>& g, int side,
                                      const Landing<W, N>& at, const LaneMask<W>& where) {
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, N>;
    const Sys& sys = run.sys;
    const auto& p = g.p();
    const T t = g[time] + select(where, at.dt, T(0));
    Contact<W, N> c;
    const T rounding = rounding_band(sys, 0, t, at.x, p);
    const T rate = normal_component(sys, 0, t, at.x, p, at.field);
    const T met = rounding + T(8 * epsilon<double>) * abs(t * rate);
    c.x = settled(run, g, at, t, side == 0 ? Mask(false) : where, met);
    c.h = switching(sys, t, c.x, p)[0];
    const Sides<Sys, T> b = both_sides(sys, Mode<1>{}, 0, t, c.x, p);
    const Plainly<W> size = plainly(b, rounding, g[proposal]);
    const Mask up1 = b.l1 > T(0), up2 = b.l2 > T(0);
    c.w = b.l1 - b.l2;
    c.s = (b.l1 + b.l2) / c.w;
    const T limit = s_max(sys, p);
    // static friction: sliding is kept up to |s| = s_max, whatever the sides would do
    const Mask held =
        (limit > T(1)) & (b.l1 > b.l2) & (abs(c.s) < limit * T(1 - 16 * epsilon<double>));
    const Mask slides = (up1 & ~up2) | held, repels = ~up1 & up2;
    c.plain = size.finite & ~repels & (abs(c.h) <= T(4) * met);
    if (side != 0) // it comes from there
        c.plain = c.plain & (side < 0 ? up1 : ~up2);
    const auto sure = [&](bool below, const X& f, const T& l) {
        return surely(Mask(abs(l) > size.least), where & g.members() & c.plain, [&] {
            return decides(sys, g, Leading<1, Sys, W>{Mask(below), t, c.x, f, l}, size.band);
        });
    };
    c.plain = c.plain & sure(true, b.f1, b.l1) & sure(false, b.f2, b.l2);
    c.mode = select(slides, T(0), select(up1, T(1), T(-1)));
    for (int i = 0; i < N; ++i)
        c.f[i] =
            select(slides, (b.l1 * b.f2[i] - b.l2 * b.f1[i]) / c.w, select(up1, b.f2[i], b.f1[i]));
    return c;
}
/// Members at a contact take up their next mode.
template <class Sys, int W, int N>
void take_up(Group<Sys, W>& g, const Contact<W, N>& c, const LaneMask<W>& where) {
    using T = Lanes<W>;
    const LaneMask<W> slides = c.mode == T(0);
    g.set_x(c.x, where);
    g.set_k0(c.f, where);
    g.set(start_value, select(slides, c.s, c.mode * c.h), where);
    g.set(start_order, select(slides, T(0), T(1)), where);
    g.set(across, c.w, where);
    g.set(reach, infinity<W>(), where);
    const T window = select(g[period_length] > T(0), T(0.125) * g[period_length], g[proposal]);
    g.set(trial, window, where & slides);
}
/// ... and go on in it.
template <int W, int N>
void send_on(Leaving<W>& leaving, const Contact<W, N>& c, const LaneMask<W>& where) {
    leaving.send(where & (c.mode < Lanes<W>(0)), Task::enter_below);
    leaving.send(where & (c.mode == Lanes<W>(0)), Task::enter_slide);
    leaving.send(where & (c.mode > Lanes<W>(0)), Task::enter_above);
}

// --- ends of slides ------------------------------------------------------------------------------

/// What goes on from the end of a slide.
template <int W, int N> struct Exit {
    LaneMask<W> plain;
    Vec<Lanes<W>, N> f; ///< of the side it leaves into
    Lanes<W> h;         ///< what rounding leaves of it, positive on that side
};
/// The plain case of `admissible` there: the other side still holds, and the second derivative of h
/// along this side's field, which is that of L along the slide, leads away.
/// @param sign   +1 where the slide leaves below, -1 above
/// @param slope  of s_max + sign s along the slide
template <class Sys, int W, int N>
FILIPPOV_NOINLINE Exit<W, N> judge_end(const Run<Sys>& run, const Group<Sys, W>& g,
                                       const Vec<Lanes<W>, N>& x, const Lanes<W>& t,
                                       const Lanes<W>& sign, const Lanes<W>& slope) {
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, N>;
    const auto& p = g.p();
    const Sides<Sys, T> b = both_sides(run.sys, Mode<1>{}, 0, t, x, p);
    const Mask below = sign > T(0), kinetic = s_max(run.sys, p) > T(1);
    const T tau = g[proposal], w = b.l1 - b.l2;
    const T own = sign * select(below, b.l1, b.l2), other = -sign * select(below, b.l2, b.l1);
    const Plainly<W> size = plainly(b, rounding_band(run.sys, 0, t, x, p), tau);
    const T bend = T(0.5) * slope * w; // sign h'' of this side
    Exit<W, N> e;
    e.f = select_each(below, b.f1, b.f2);
    e.plain =
        (w > T(0)) & size.finite & (select(kinetic, own, bend) < T(0)) & (kinetic | (other > T(0)));
    const Mask wanted = e.plain & g.members();
    const auto first = [&](const Mask& side, const X& f, const T& l) {
        return decides(run.sys, g, Leading<1, Sys, W>{side, t, x, f, l}, size.band);
    };
    const Mask leads_away = surely(Mask(-own > size.least), wanted & kinetic,
                                   [&] { return first(below, e.f, T(sign * own)); });
    const Mask turns_away =
        surely(Mask(-(bend * tau * tau) > plain_bend(size.band)), wanted & ~kinetic, [&] {
            const Leading<2, Sys, W> side{below, t, x, e.f, T(sign * bend)};
            return decides(run.sys, g, side, size.band);
        });
    const Mask holds = surely(Mask(other > size.least), wanted & ~kinetic, [&] {
        return first(~below, select_each(below, b.f2, b.f1), T(-sign * other));
    });
    e.plain = e.plain & ((kinetic & leads_away) | (~kinetic & turns_away & holds));
    e.h = -sign * switching(run.sys, t, x, p)[0];
    return e;
}
/// Members at the end of a slide, a time dt from here, take up the slip after it.
/// @param limit  s_max
template <class Sys, int W, int N>
void take_up(Group<Sys, W>& g, const Exit<W, N>& exit, const Vec<Lanes<W>, N>& x,
             const Lanes<W>& dt, const Lanes<W>& limit, const LaneMask<W>& where) {
    using T = Lanes<W>;
    g.set_x(x, where);
    g.set_k0(exit.f, where);
    g.set(start_value, exit.h, where);
    g.set(start_order, select(limit > T(1), T(1), T(2)), where);
    g.set(reach, infinity<W>(), where);
    advance(g, dt, where);
}

} // namespace filippov::lanes
