// SPDX-License-Identifier: BSD-3-Clause
// The path of a step: by the method, in closed form, or straight.
#pragma once

#include <filippov/engine/detail/steps.hpp>
#include <filippov/run/place.hpp>
#include <filippov/run/report.hpp>

#include <limits>
#include <type_traits>

namespace filippov {

/// A step over [clock, clock + dt] by the method, its interpolant built when first asked for.
template <class Sys, class S> struct TrialPath {
    static constexpr int N = dim_v<Sys>;
    using X = State<Sys, S>;
    using Guards = Watch<Sys, S>;
    static constexpr bool by_method = true;
    static constexpr bool exact_probes = false; ///< stages are crude
    static constexpr bool vouched = false;

    const Place<Sys, S>& at; ///< where the step starts
    Guards& guards;
    Steps<Sys, S>& steps;
    Counters& counters;
    bool slides;
    S dt;
    X x1;
    Judged<S> judged; ///< as it was tried
    S moved = S(0);   ///< how far the end was nudged from that of the stages
    bool built = false;
    Interpolant<S, N, 8> polynomial;
    int terms = 0; ///< of it

    /// Takes the step.
    FILIPPOV_INLINE TrialPath(const Place<Sys, S>& place, Guards& probed, Steps<Sys, S>& method,
                              Counters& all, const S& step)
        : at(place), guards(probed), steps(method), counters(all),
          slides(place.mode.sliding() > 0) {
        take(step, true);
    }

    /// Takes the step again, with another length, and puts its end on the surface.
    FILIPPOV_COLD void shorten(const S& step) {
        take(step, false);
        put_end_on_surface();
    }
    void put_end_on_surface() {
        x1 = on_surface(x1, S(at.clock.local + dt));
        built = false;
    }
    /// Probes the guards along the interpolant, and judges the step.
    void probe() {
        const ProbeTimes<S>& times = steps.times();
        build();
        probed_field(at, guards, [&](auto&& rhs) {
            for (std::size_t k = 1; k <= times.n; ++k) {
                const S theta = times.theta[k], t = at.clock.local + theta * dt;
                rhs.probe(k, t, on_surface(polynomial.at(theta, terms), t));
            }
        });
        judged = steps.judge(at, guards, dt, x1);
    }
    X operator()(const S& theta) {
        build();
        return on_surface(polynomial.at(theta, terms), S(at.clock.local + theta * dt));
    }
    /// What the middle of the step lacks of solving the equation, in units of the tolerance (that
    /// of its larger end). The field is called where no stage was, so that no chance hides an
    /// error from this.
    FILIPPOV_COLD S defect() {
        interpolate(); // by the step's own stages
        built = false;
        const S half(0.5);
        const X field = at.field(S(at.clock.local + half * dt), polynomial.at(half, terms));
        ++counters.field;
        return at.norm(X(dt * field - polynomial.slope(half, terms)), at.scale_of_step(x1, dt));
    }
    /// Leaves what is needed to evaluate this step later.
    template <class Piece> void store(Piece& piece) {
        build();
        for (auto m = std::size_t(terms); m-- > 0;)
            piece.polynomial.c[m] = polynomial.c[m];
    }
    bool finite() const { return all_finite<S, N>(x1); }
    const X& end_field() const { return steps.end_field(); }
    /// Moves the end by a second-order Taylor step, x'' from the stages.
    void nudge(const S& delta) {
        X& end = steps.end_field();
        for (int i = 0; i < N; ++i) {
            const S bend = dt != S(0) ? (end[i] - steps.start_field()[i]) / dt : S(0);
            x1[i] += delta * (end[i] + delta / S(2) * bend);
            end[i] += delta * bend;
        }
        dt += delta;
        moved += delta;
        put_end_on_surface();
    }
    /// Bound on the error of a nudge in units of the tolerance: all of its second-order term.
    S nudge_error(const S& delta) const {
        X bend;
        for (int i = 0; i < N; ++i)
            bend[i] = (end_field()[i] - steps.start_field()[i]) / dt;
        return at.norm(bend) * delta * delta;
    }

private:
    void build() {
        if (built)
            return;
        if (moved != S(0)) [[unlikely]]
            follow_end();
        interpolate();
        ++counters.interpolants;
        if (steps.facts().extra_field_calls > 0 &&
            at.norm(polynomial.c[std::size_t(terms - 1)]) > most_of_last) [[unlikely]]
            refit();
    }
    void interpolate() {
        terms = steps.interpolate(at, guards, dt, x1, polynomial);
        counters.field += steps.facts().extra_field_calls;
        built = true;
    }
    /// The last term of an interpolant of high order is a few tolerances. Where it is more, stages
    /// differ by what stability alone bounds: steps at its limit, whose ends are right, would be
    /// off by a thousand tolerances inside. Their interpolant goes through thirds of the step.
    FILIPPOV_COLD void refit() {
        const std::array<X, 4> inside = steps.thirds(at, guards, dt);
        counters.field += 2 * steps.facts().field_calls;
        terms = 8;
        polynomial.pass_thirds(inside);
    }
    FILIPPOV_INLINE void take(const S& step, bool judge) {
        judged = steps.take(at, guards, step, x1, judge);
        counters.field += steps.facts().field_calls;
        dt = step;
        moved = S(0);
    }
    /// Takes the stages again where the end was nudged to. (An error of the second order in a
    /// nudge is nothing to the end of a step. To its inside those stages are off by the first.)
    FILIPPOV_COLD void follow_end() {
        X& end = steps.end_field();
        if (!(at.norm(X(end - steps.start_field())) * abs_(moved) > S(0.01)))
            return;
        const X x = x1, slope = end;
        take(dt, false);
        x1 = x;
        end = slope;
    }
    static constexpr S most_of_last = S(1000); ///< in tolerances
    static S abs_(const S& v) {
        using std::abs;
        return abs(v);
    }
    X on_surface(const X& x, const S& t) const {
        if (slides)
            return project(at.sys, at.held, t, x, at.p, at.scale);
        else
            return x;
    }
};

/// A window of a slide that the system knows in closed form.
template <class Sys, class S> struct ClosedFormPath {
    using X = State<Sys, S>;
    static constexpr bool vouched = HasSlideSwing<Sys, S>; ///< it is no longer than a swing of s
    static constexpr const ProbeTimes<S>& times =
        probe_times<std::conditional_t<vouched, WindowTimes<S>, SampleTimes<S>>, S>;
    static constexpr bool by_method = false;
    static constexpr bool slides = true;
    static constexpr bool exact_probes = !vouched; ///< are samples of the path

    const Place<Sys, S>& at; ///< where the window starts
    S dt;
    X x1;

    X operator()(const S& theta) const {
        return at.sys.sliding_flow(at.clock.local, at.x, at.p, S(theta * dt));
    }
    /// Probes the guards along the window, up to its end.
    void probe(Watch<Sys, S>& guards) {
        for (std::size_t k = 1; k <= times.n; ++k) {
            const S theta = times.theta[k];
            const S t = at.clock.local + theta * dt;
            x1 = (*this)(theta);
            guards.probe_slide(k, sliding_margin(at.sys, at.mode, t, x1, at.p));
            guards.probe_sections(k, t, x1);
        }
    }
    template <class Piece> void store(Piece& piece) const { piece.closed_form = true; }
    bool finite() const { return all_finite<S, dim_v<Sys>>(x1); }
    X end_field() const { return at.field(S(at.clock.local + dt), x1); }
    void shorten(const S& d) {
        dt = d;
        x1 = (*this)(S(1));
    }
    void nudge(const S& delta) { shorten(dt + delta); }
    /// Evaluating again is as cheap.
    S nudge_error(const S&) const { return std::numeric_limits<S>::infinity(); }
};

/// Straight from one state to another.
template <class S, int N> struct StraightPath {
    using X = Vec<S, N>;

    S dt;
    X x0, x1;

    X operator()(const S& theta) const {
        X x;
        for (int i = 0; i < N; ++i)
            x[i] = x0[i] + theta * (x1[i] - x0[i]);
        return x;
    }
    template <class Piece> void store(Piece& piece) const {
        piece.polynomial.c[0] = x0;
        piece.polynomial.c[1] = x1 - x0;
    }
};

} // namespace filippov
