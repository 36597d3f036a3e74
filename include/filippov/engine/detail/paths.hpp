// SPDX-License-Identifier: BSD-3-Clause
// The path of a step: by the method, in closed form, or straight.
#pragma once

#include <filippov/events/guards.hpp>
#include <filippov/run/place.hpp>
#include <filippov/run/report.hpp>

#include <limits>
#include <type_traits>

namespace filippov {

/// A step over [clock, clock + dt] by the method, its interpolant built when first asked for.
/// @tparam Rhs  the field as the stages see it, see probed_field.hpp
template <class Tableau, class Sys, class S, class Rhs> struct TrialPath {
    static constexpr int N = dim_v<Sys>;
    using X = State<Sys, S>;
    using Stepper = typename Tableau::template Stepper<S, N>;
    using Times = StepTimes<Tableau, S, N>;
    static constexpr bool slides = Rhs::slides;
    static constexpr bool exact_probes = false; ///< stages are crude
    static constexpr bool vouched = false;

    const Place<Sys, S>& at; ///< where the step starts
    Rhs& rhs;
    Stepper& rk;
    Counters& counters;
    S dt;
    X x1;
    S moved = S(0); ///< how far the end was nudged from that of the stages
    bool built = false;
    typename Stepper::Polynomial polynomial;

    /// Takes the step.
    FILIPPOV_INLINE TrialPath(const Place<Sys, S>& place, Rhs& field, Stepper& stepper,
                              Counters& all, const S& step)
        : at(place), rhs(field), rk(stepper), counters(all) {
        take(step);
    }

    /// Takes the step again, with another length, and puts its end on the surface.
    FILIPPOV_COLD void shorten(const S& step) {
        take(step);
        put_end_on_surface();
    }
    void put_end_on_surface() {
        x1 = on_surface(x1, S(at.clock.local + dt));
        built = false;
    }
    /// Probes the guards along the interpolant.
    void probe() {
        for (std::size_t k = 1; k <= Times::n; ++k) {
            const S theta = Times::theta(k);
            rhs.probe(k, S(at.clock.local + theta * dt), (*this)(theta));
        }
    }
    X operator()(const S& theta) {
        build();
        return on_surface(polynomial(theta), S(at.clock.local + theta * dt));
    }
    /// What the middle of the step lacks of solving the equation, in units of the tolerance (that
    /// of its larger end). The field is called where no stage was, so that no chance hides an
    /// error from this.
    FILIPPOV_COLD S defect() {
        interpolate(); // by the step's own stages
        built = false;
        const S half(0.5);
        const X field = at.field(S(at.clock.local + half * dt), polynomial(half));
        ++counters.field;
        return at.norm(X(dt * field - polynomial.slope(half)), at.scale_of_step(x1, dt));
    }
    /// Leaves what is needed to evaluate this step later.
    template <class Piece> void store(Piece& piece) {
        build();
        for (std::size_t m = 0; m < polynomial.c.size(); ++m)
            piece.polynomial.c[m] = polynomial.c[m];
    }
    bool finite() const { return all_finite<S, N>(x1); }
    const X& end_field() const { return rk.k[Stepper::last]; }
    /// Moves the end by a second-order Taylor step, x'' from the stages.
    void nudge(const S& delta) {
        X& end = rk.k[Stepper::last];
        for (int i = 0; i < N; ++i) {
            const S bend = dt != S(0) ? (end[i] - rk.k[0][i]) / dt : S(0);
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
            bend[i] = (end_field()[i] - rk.k[0][i]) / dt;
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
        if constexpr (Tableau::extra_stages > 0)
            if (at.norm(polynomial.c.back()) > most_of_last) [[unlikely]]
                refit();
    }
    void interpolate() {
        polynomial = rk.interpolant(rhs, at.clock.local, at.x, dt, x1);
        counters.field += Tableau::extra_stages;
        built = true;
    }
    /// The last term of an interpolant of high order is a few tolerances. Where it is more, stages
    /// differ by what stability alone bounds: steps at its limit, whose ends are right, would be
    /// off by a thousand tolerances inside. Their interpolant goes through thirds of the step.
    FILIPPOV_COLD void refit() {
        const auto field = [&](std::size_t, const S& t, const X& x) { return rhs.field(t, x); };
        Stepper third;
        X x = at.x, slope = rk.k[0];
        std::array<X, 4> inside; // values and derivatives by theta at both
        for (std::size_t j = 0; j < 2; ++j) {
            const S t = at.clock.local + S(j) / S(3) * dt;
            third.begin(slope);
            third.step(field, t, x, S(dt / S(3)), inside[2 * j]);
            x = inside[2 * j];
            slope = third.k[Stepper::last];
            inside[2 * j + 1] = dt * slope;
        }
        counters.field += 2 * (Tableau::stages - 1);
        polynomial.pass_thirds(inside);
    }
    FILIPPOV_INLINE void take(const S& step) {
        rk.step(rhs, at.clock.local, at.x, step, x1);
        counters.field += Tableau::stages - 1;
        dt = step;
        moved = S(0);
    }
    /// Takes the stages again where the end was nudged to. (An error of the second order in a
    /// nudge is nothing to the end of a step. To its inside those stages are off by the first.)
    FILIPPOV_COLD void follow_end() {
        X& end = rk.k[Stepper::last];
        if (!(at.norm(X(end - rk.k[0])) * abs_(moved) > S(0.01)))
            return;
        const X x = x1, slope = end;
        take(dt);
        x1 = x;
        end = slope;
    }
    static constexpr S most_of_last = S(1000); ///< in tolerances
    static S abs_(const S& v) {
        using std::abs;
        return abs(v);
    }
    X on_surface(const X& x, const S& t) const {
        if constexpr (Rhs::slides)
            return project(at.sys, at.held, t, x, at.p, at.scale);
        else
            return x;
    }
};

/// A window of a slide that the system knows in closed form.
template <class Sys, class S> struct ClosedFormPath {
    using X = State<Sys, S>;
    static constexpr bool vouched = HasSlideSwing<Sys, S>; ///< it is no longer than a swing of s
    using Times = std::conditional_t<vouched, WindowTimes<S>, SampleTimes<S>>;
    static constexpr bool slides = true;
    static constexpr bool exact_probes = !vouched; ///< are samples of the path

    const Place<Sys, S>& at; ///< where the window starts
    S dt;
    X x1;

    X operator()(const S& theta) const {
        return at.sys.sliding_flow(at.clock.local, at.x, at.p, S(theta * dt));
    }
    /// Probes the guards along the window, up to its end.
    template <class Guards> void probe(Guards& guards) {
        for (std::size_t k = 1; k <= Times::n; ++k) {
            const S theta = Times::theta(k);
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
