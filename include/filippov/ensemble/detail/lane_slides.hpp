// SPDX-License-Identifier: BSD-3-Clause
// Slides in lanes: in windows of their closed form, or by steps along the sliding field.
#pragma once

#include <filippov/ensemble/detail/lane_landing.hpp>
#include <filippov/events/lost_surface.hpp>

#include <type_traits>

namespace filippov::lanes {

/// Slides that the system knows in closed form: in windows, a group at a time, as
/// Segment::run_closed_form takes them.
template <class Sys, int W> class Windows {
    using Group = lanes::Group<Sys, W>;
    using Leaving = lanes::Leaving<W>;
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, dim_v<Sys>>;
    using Q = typename Group::Q;
    using Look = lanes::Look<W>;
    /// The system says how soon s may turn.
    static constexpr bool vouched = HasSlideSwing<Sys, T>;
    using Times = std::conditional_t<vouched, WindowTimes<double>, SampleTimes<double>>;
    static constexpr std::size_t n_window = Times::n;

public:
    explicit Windows(Run<Sys>& run) : run_(run), sys_(run.sys) {}

    /// True of a system whose slides these are for. (One that is made at run time, and may say how
    /// soon s may turn, is followed by steps where it does not.)
    static bool are_for(const Sys& sys) {
        return vouched ? vouches_for_slides<T>(sys) : slides_in_closed_form<T>(sys);
    }

    /// A window of every lane.
    FILIPPOV_FLATTEN Leaving step(Group& g) const {
        const X x = g.x();
        const Q& p = g.p();
        const T t = g[time], limit = s_max(sys_, p);
        T longest = g[longest_step];
        if constexpr (vouched)
            longest = min(longest, sys_.slide_swing(p));
        T dt = min(g[trial], longest);
        const Mask last = dt >= g[left];
        dt = select(last, g[left], dt);
        run_.counters.windows += std::popcount(g.active);

        std::array<T, n_window + 1> below, above;
        T s = g[start_value];
        Mask attracts(true);
        for (std::size_t k = 0; k <= n_window; ++k) {
            if (k > 0) {
                const auto margin = margin_after(T(Times::theta(k)) * dt, t, x, p);
                s = margin.s;
                attracts = attracts & (margin.w > T(0));
            }
            below[k] = limit + s;
            above[k] = limit - s;
        }
        const Look down = look_in(below), up = look_in(above);
        // both ends in sight: the window is too long to tell which comes first; so it is where the
        // surface ceases to attract
        const Mask hard = down.hard | up.hard | (down.found & up.found) | ~attracts;
        const Mask ends = (down.found | up.found) & ~hard;
        const X x1 = sys_.sliding_flow(t, x, p, dt);
        const Mask passes = ~hard & ~ends & finite(sum(x1));
        const T shortest = T(1e-4) * select(g[period_length] > T(0), half_period(g), g[proposal]);
        const Mask shorter = hard & (dt > shortest);

        g.set_x(x1, passes);
        g.set(start_value, s, passes);
        const T growth(vouched ? 4 : 2);
        g.set(trial, select(passes, growth * dt, select(shorter, T(0.5) * dt, dt)), ~Mask(false));
        g.set(reach, select(down.found, down.low, up.low), ends);
        g.set(across, select(down.found, down.high, up.high), ends);
        g[tries] += T(1);
        advance(g, dt, passes);
        const Mask gone = passes & beyond_bounds(run_, x1),
                   stays = (passes & ~last & ~gone) | shorter,
                   spent = g[tries] >= T(double(run_.settings.max_steps));
        Leaving leaving((~stays | spent).word() & g.active);
        leaving.send(ends, Task::slide_end);
        leaving.send(gone, Task::escape);
        leaving.send(passes & last, Task::end_leg);
        return leaving;
    }

    /// The end of a slide in the piece of a window between `reach` and `across`.
    Leaving end(Group& g) const {
        const X x = g.x();
        const Q& p = g.p();
        const T t = g[time], dt = g[trial], limit = s_max(sys_, p);
        const auto s_at = [&](const T& u) { return s_after(u * dt, t, x, p); };
        Look look;
        look.low = g[reach];
        look.high = g[across];
        const T s_low = s_at(look.low), s_high = s_at(look.high);
        const Mask down = s_high < s_low;
        const T sign = select(down, T(1), T(-1));
        const auto margin = [&](const T& u) { return fused(sign, s_at(u), limit); };
        look.value_low = fused(sign, s_low, limit);
        look.value_high = fused(sign, s_high, limit);
        look.found = look.value_low > T(0);
        const T u = root(look, 4 * epsilon<double>, margin), d = u * dt;
        if constexpr (!vouched)
            look.found = look.found & falls_smoothly(u, margin);
        const T apart(0x1p-13);
        const T slope = (margin(u + apart) - margin(u - apart)) / (T(2) * apart * dt);
        const X x1 =
            project(sys_, 0, t + d, sys_.sliding_flow(t, x, p, d), p, scale(run_.settings, x));
        const auto exit = judge_end(run_, g, x1, t + d, sign, slope);
        const Mask leaves = look.found & exit.plain & finite(sum(x1)) & (d < g[left]);
        take_up(g, exit, x1, d, limit, leaves);
        Leaving leaving(g.active);
        leaving.send(leaves & down, Task::exit_below);
        leaving.send(leaves & ~down, Task::exit_above);
        return leaving;
    }

private:
    static Look look_in(const std::array<T, n_window + 1>& margin) {
        if constexpr (vouched)
            return look_in_window(margin);
        else
            return look_at_samples<Times>(margin);
    }
    /// A time after the clock.
    FILIPPOV_INLINE auto margin_after(const T& tau, const T& t, const X& x, const Q& p) const {
        return sliding_margin(sys_, Mode<1>{}, t + tau, sys_.sliding_flow(t, x, p, tau), p);
    }
    FILIPPOV_INLINE T s_after(const T& tau, const T& t, const X& x, const Q& p) const {
        return margin_after(tau, t, x, p).s;
    }

    Run<Sys>& run_;
    const Sys& sys_;
};

/// All other slides: by steps along the sliding field, a group at a time.
template <class Sys, int W, class Tableau> class SlideSteps {
    static constexpr int N = dim_v<Sys>;
    using Group = lanes::Group<Sys, W>;
    using Leaving = lanes::Leaving<W>;
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, N>;
    using Q = typename Group::Q;
    using Rk = RungeKutta<Tableau, T, N>;
    using Times = StageTimes<Tableau, double>;
    using Samples = SampleTimes<double>;
    using Look = lanes::Look<W>;
    using Landing = lanes::Landing<W, N>;

public:
    explicit SlideSteps(Run<Sys>& run) : run_(run), sys_(run.sys) {}

    /// A trial step of every lane: see Slip::step. No error estimate of the field resolves s: it
    /// has to be farther from both ends than it is off a cubic, and where the estimate told
    /// nothing it is looked along in any case.
    FILIPPOV_FLATTEN Leaving step(Group& g) const {
        const X x = g.x(), size = scale(run_.settings, x);
        const Q& p = g.p();
        const Trial<T> r =
            next_trial(g[proposal], T(min(half_period(g), g[longest_step])), g[reach], g[left]);
        const T t = g[time], limit = s_max(sys_, p), dt = r.dt;

        Rk rk;
        rk.k[0] = g.k0();
        std::array<T, Times::n + 1> s, w;
        s[0] = g[start_value];
        w[0] = g[across];
        const auto rhs = [&](std::size_t k, const T& tau, const X& y) FILIPPOV_LAMBDA_INLINE {
            const Sliding<Sys, T> at = slide_at(tau, y, p, size);
            s[k] = s_of(at);
            w[k] = at.w;
            return at.f;
        };
        X x1;
        rk.step(rhs, t, x, dt, x1);
        T total = sum(X(x1 + rk.sum_of_stages()));
        for (std::size_t k = 1; k <= Times::n; ++k)
            total += s[k] + w[k];
        const Mask accepted = accept(run_, g, rk, x, x1, total, r, [&] { return T(0.25) * dt; });

        const Fit<T> fit = fit_of<Times>(s), fit_w = fit_of<Times>(w);
        const T far = fused(T(8), fit.off, T(1e-6) * fit.spread);
        const Mask still = (limit + fit.floor > far) & (limit - fit.ceiling > far);
        const StepControl<Tableau, T> control;
        const Mask quiet = g[last_error] <= control.previous;
        const X raw = x1;
        x1 = project(sys_, 0, t + dt, x1, p, size);
        const Mask clear = still & fit_w.clear() & ~quiet & ~has_lost_surface(g, raw, x1, dt);
        // There may be a two-fold ahead: a lone run looks for it.
        const Mask narrows = accepted & ~(w[Times::n] > T(0.5) * w[0]);
        const Mask taken = accepted & clear & ~narrows, doubt = accepted & ~clear & ~narrows;
        g.set(trial, dt, doubt);
        g.set(proposal, min(g[proposal], select(~still & fit.full(), dt, T(2) * dt)), taken);
        go_on(g, {x1, rk.k[Rk::last], dt}, s[Times::n], w[Times::n], taken);
        run_.counters.windows += std::popcount(g.active);

        const Mask gone = taken & beyond_bounds(run_, x1), ended = taken & r.last;
        Leaving leaving((doubt | narrows | gone | ended | gives_up(run_, g, t)).word() & g.active);
        leaving.send(doubt, Task::slide_end);
        leaving.send(gone, Task::escape);
        leaving.send(ended, Task::end_leg);
        return leaving;
    }

    /// A step in doubt: taken again, looked along, and ended where the slide ends. A step that does
    /// not show plainly which end it meets, if any, is tried shorter.
    Leaving end(Group& g) const {
        const X x = g.x(), size = scale(run_.settings, x);
        const Q& p = g.p();
        const T t = g[time], dt = g[trial], limit = s_max(sys_, p);
        Rk rk;
        rk.k[0] = g.k0();
        const auto take = [&](const T& d, X& x1) { take_again(rk, g, size, d, x1); };
        Landing full;
        full.dt = dt;
        take(dt, full.x);
        const X raw = full.x;
        full.x = project(sys_, 0, t + dt, full.x, p, size);
        const Mask lost = has_lost_surface(g, raw, full.x, dt);
        full.field = rk.k[Rk::last];
        const auto path = path_of(rk, g, size, dt, full.x);
        const auto slide_in = [&](const T& u) {
            return slide_at(fused(u, dt, t), path(u), p, size);
        };
        run_.counters.searches += std::popcount(g.active);

        constexpr std::size_t n = Samples::n;
        std::array<T, n + 1> s, w, below, above;
        s[0] = g[start_value];
        w[0] = g[across];
        for (std::size_t k = 1; k <= n; ++k) {
            const Sliding<Sys, T> at = slide_in(T(Samples::theta(k)));
            s[k] = s_of(at);
            w[k] = at.w;
        }
        for (std::size_t k = 0; k <= n; ++k) {
            below[k] = limit + s[k];
            above[k] = limit - s[k];
        }
        const Look down = look_at_samples<Samples>(below), up = look_at_samples<Samples>(above),
                   flat = look_at_samples<Samples>(w);
        Mask hard = down.hard | up.hard | (down.found & up.found) | flat.hard | flat.found | lost;

        Look look;
        const T sign = select(down.found, T(1), T(-1));
        look.found = (down.found | up.found) & ~hard;
        look.low = select(down.found, down.low, up.low);
        look.high = select(down.found, down.high, up.high);
        look.value_low = select(down.found, down.value_low, up.value_low);
        look.value_high = select(down.found, down.value_high, up.value_high);
        const auto margin = [&](const T& u) { return fused(sign, s_of(slide_in(u)), limit); };
        const T u = root(look, 1e-6, margin), apart(0x1p-13);
        hard = hard | (look.found & ~falls_smoothly(u, margin));
        const Mask ends = look.found & ~hard, passes = ~hard & ~ends;
        const T slope = (margin(u + apart) - margin(u - apart)) / (T(2) * apart * dt);
        const Target end_of_slide{1e-9, [&](Landing& at) {
                                      at.x = project(sys_, 0, t + at.dt, at.x, p, size);
                                      const T s1 = s_of(slide_at(t + at.dt, at.x, p, size));
                                      return -fused(sign, s1, limit) / slope;
                                  }};
        Landing at = full;
        const Mask landed = land(run_, g, rk, take, u * dt, ends, at, end_of_slide);
        const auto exit = judge_end(run_, g, at.x, t + at.dt, sign, slope);
        const Mask leaves = landed & exit.plain & finite(sum(at.x));

        const T shortest = T(1e-4) * min(half_period(g), g[proposal]);
        const Mask shorter = hard & ~lost & (dt > max(shortest, T(16) * resolution(t)));
        const Mask last = passes & (dt >= g[left]), gone = passes & beyond_bounds(run_, full.x);
        g.set(reach, T(0.5) * dt, shorter);
        take_up(g, exit, at.x, at.dt, limit, leaves);
        g.set(proposal, min(g[proposal], T(2) * dt), passes);
        go_on(g, full, s[n], w[n], passes);
        Leaving leaving(g.active);
        leaving.send(leaves & down.found, Task::exit_below);
        leaving.send(leaves & up.found, Task::exit_above);
        leaving.send(gone, Task::escape);
        leaving.send(last, Task::end_leg);
        leaving.send(passes | shorter, Task::slide);
        return leaving;
    }

private:
    /// A step of the group once more, and its interpolant. No part of their caller: see Slip.
    FILIPPOV_FLATTEN FILIPPOV_NOINLINE void take_again(Rk& rk, const Group& g, const X& size,
                                                       const T& dt, X& x1) const {
        const auto field = field_of(g.p(), size);
        rk.step(field, g[time], g.x(), dt, x1);
    }
    FILIPPOV_FLATTEN FILIPPOV_NOINLINE auto path_of(Rk& rk, const Group& g, const X& size,
                                                    const T& dt, const X& x1) const {
        const auto field = field_of(g.p(), size);
        return rk.interpolant(field, g[time], g.x(), dt, x1);
    }
    auto field_of(const Q& p, const X& size) const {
        return [this, &p, &size](std::size_t, const T& tau, const X& y)
                   FILIPPOV_LAMBDA_INLINE { return slide_at(tau, y, p, size).f; };
    }
    /// The slide at a point, which is put on the surface first, so that the fields need not exist
    /// off it. Called by each stage: two fields, h and its gradient are worth a call.
    FILIPPOV_NOINLINE Sliding<Sys, T> slide_at(const T& t, const X& x, const Q& p,
                                               const X& size) const {
        return sliding(sys_, Mode<1>{}, t, toward_surface(sys_, 0, t, x, p, size), p);
    }
    /// Where the surface may have moved away from the step's end: see `lost_surface`. A lone run
    /// says if it has.
    /// @param raw, x1  the end, before and after it was put on the surface
    Mask has_lost_surface(const Group& g, const X& raw, const X& x1, const T& dt) const {
        const Mask far = ~(mean_square(run_, X(x1 - raw), scale(run_.settings, g.x())) <= T(1));
        return any(far) ? far & is_off_surface(g, raw, dt) : far;
    }
    FILIPPOV_COLD Mask is_off_surface(const Group& g, const X& raw, const T& dt) const {
        const T t = g[time] + dt;
        const X lengths = scale_of_step(run_.settings, g.x(), raw);
        return ~(abs(switching(sys_, t, raw, g.p())[0]) <=
                 slide_band(sys_, 0, t, raw, g.p(), lengths));
    }
    static T s_of(const Sliding<Sys, T>& a) { return T(0.5) * (a.below - a.above); }

    /// Members at the end of a step that stay in their slide.
    static void go_on(Group& g, const Landing& at, const T& s, const T& w, const Mask& where) {
        g.set_x(at.x, where);
        g.set_k0(at.field, where);
        g.set(start_value, s, where);
        g.set(across, w, where);
        g.set(reach, T(1.25) * g[reach], where);
        advance(g, at.dt, where);
    }

    Run<Sys>& run_;
    const Sys& sys_;
};

/// The slides of a system that is made at run time: it knows then how it slides.
template <class Sys, int W, class Tableau> class EitherSlides {
    using Group = lanes::Group<Sys, W>;
    using Leaving = lanes::Leaving<W>;

public:
    explicit EitherSlides(Run<Sys>& run)
        : windows_(run), steps_(run), in_closed_form_(Windows<Sys, W>::are_for(run.sys)) {}

    Leaving step(Group& g) const { return in_closed_form_ ? windows_.step(g) : steps_.step(g); }
    Leaving end(Group& g) const { return in_closed_form_ ? windows_.end(g) : steps_.end(g); }

private:
    const Windows<Sys, W> windows_;
    const SlideSteps<Sys, W, Tableau> steps_;
    const bool in_closed_form_;
};

/// The slides of a system.
template <class Sys, int W, class Tableau>
using Slides = std::conditional_t<
    !HasSlidingFlow<Sys, Lanes<W>>, SlideSteps<Sys, W, Tableau>,
    std::conditional_t<ChoosesSlides<Sys>, EitherSlides<Sys, W, Tableau>, Windows<Sys, W>>>;

} // namespace filippov::lanes
