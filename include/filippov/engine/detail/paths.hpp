// SPDX-License-Identifier: BSD-3-Clause
// The path of a step: by the method, in closed form, or straight.
#pragma once

#include <filippov/engine/detail/steps.hpp>
#include <filippov/run/path.hpp>
#include <filippov/run/place.hpp>
#include <filippov/run/report.hpp>

#include <limits>
#include <type_traits>

namespace filippov {

/// A step over [clock, clock + dt] by the method, its interpolant built when first asked for.
template <class Sys, class S> struct TrialPath final : TriedPath<S, dim_v<Sys>> {
    static constexpr int N = dim_v<Sys>;
    using X = State<Sys, S>;
    using Guards = Watch<Sys, S>;
    using TriedPath<S, N>::dt;
    using TriedPath<S, N>::x1;

    const Place<Sys, S>& at; ///< where the step starts
    Guards& guards;
    Steps<Sys, S>& steps;
    Counters& counters;
    bool slides;
    Judged<S> judged; ///< as it was tried
    S moved = S(0);   ///< how far the end was nudged from that of the stages
    bool built = false;
    Interpolant<S, N, 8> polynomial;
    int terms = 0; ///< of it

    /// Takes the step.
    FILIPPOV_INLINE TrialPath(const Place<Sys, S>& place, Guards& probed, Steps<Sys, S>& method,
                              Counters& all, const S& step)
        : TriedPath<S, N>({.by_method = true, .exact_probes = false, .vouched = false}), at(place),
          guards(probed), steps(method), counters(all), slides(place.mode.sliding() > 0) {
        take(step, true);
    }

    /// Its end is put on the surface.
    FILIPPOV_COLD void shorten(const S& step) override {
        take(step, false);
        put_end_on_surface();
    }
    void put_end_on_surface() {
        x1 = on_surface(x1, S(at.clock.local + dt));
        built = false;
    }
    /// Probes the guards along the interpolant, and judges the step.
    FILIPPOV_FLATTEN void probe() {
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
    X operator()(const S& theta) override {
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
    void store(const StoredPath<S, N>& kept) override {
        build();
        for (auto m = std::size_t(terms); m-- > 0;)
            kept.polynomial.c[m] = polynomial.c[m];
    }
    X end_field() const override { return steps.end_field(); }
    /// Of second order, x'' from the stages.
    FILIPPOV_COLD void nudge(const S& delta) override {
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
    /// All of its second-order term.
    FILIPPOV_COLD S nudge_error(const S& delta) const override {
        X bend;
        for (int i = 0; i < N; ++i)
            bend[i] = (steps.end_field()[i] - steps.start_field()[i]) / dt;
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
template <class Sys, class S> struct ClosedFormPath final : TriedPath<S, dim_v<Sys>> {
    static constexpr int N = dim_v<Sys>;
    using X = State<Sys, S>;
    using TriedPath<S, N>::dt;
    using TriedPath<S, N>::x1;

    const Place<Sys, S>& at; ///< where the window starts

    /// Where windows are probed.
    /// @param vouched  they are no longer than a swing of s
    static const ProbeTimes<S>& times(bool vouched) {
        return vouched ? probe_times<WindowTimes<S>, S> : probe_times<SampleTimes<S>, S>;
    }

    ClosedFormPath(const Place<Sys, S>& place, const S& window, bool vouched)
        : TriedPath<S, N>({.by_method = false, .exact_probes = !vouched, .vouched = vouched}),
          at(place) {
        dt = window;
        x1 = place.x;
    }

    X operator()(const S& theta) override {
        return at.sys.sliding_flow(at.clock.local, at.x, at.p, S(theta * dt));
    }
    /// Probes the guards along the window, up to its end.
    void probe(Watch<Sys, S>& guards) {
        const ProbeTimes<S>& probed = times(this->kind.vouched);
        for (std::size_t k = 1; k <= probed.n; ++k) {
            const S theta = probed.theta[k];
            const S t = at.clock.local + theta * dt;
            x1 = (*this)(theta);
            guards.probe_slide(k, sliding_margin(at.sys, at.mode, t, x1, at.p));
            guards.probe_sections(k, t, x1);
        }
    }
    void store(const StoredPath<S, N>& kept) override { kept.closed_form = true; }
    X end_field() const override { return at.field(S(at.clock.local + dt), x1); }
    void shorten(const S& d) override {
        dt = d;
        x1 = (*this)(S(1));
    }
    void nudge(const S& delta) override { shorten(dt + delta); }
    /// Evaluating again is as cheap.
    S nudge_error(const S&) const override { return std::numeric_limits<S>::infinity(); }
};

/// Straight from one state to another.
template <class S, int N> struct StraightPath final : Path<S, N> {
    using X = Vec<S, N>;
    using Path<S, N>::x1;

    X x0;

    StraightPath(const S& step, const X& from, const X& to) : x0(from) {
        this->dt = step;
        x1 = to;
    }
    X operator()(const S& theta) override {
        X x;
        for (int i = 0; i < N; ++i)
            x[i] = x0[i] + theta * (x1[i] - x0[i]);
        return x;
    }
    void store(const StoredPath<S, N>& kept) override {
        kept.polynomial.c[0] = x0;
        kept.polynomial.c[1] = x1 - x0;
    }
};

} // namespace filippov
