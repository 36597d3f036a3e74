// SPDX-License-Identifier: BSD-3-Clause
// The steps of a method on a system: all that is compiled once a method. The engine is compiled
// once a system, and calls a step through a pointer: one indirect call a step, none a stage.
#pragma once

#include <filippov/engine/detail/probed_field.hpp>
#include <filippov/events/watch.hpp>
#include <filippov/methods/control.hpp>
#include <filippov/methods/runge_kutta.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <tuple>

namespace filippov {

/// What the engine knows of a method.
struct MethodFacts {
    int order;
    int field_calls;       ///< of a step
    int extra_field_calls; ///< of its interpolant, beyond those
    bool probes_stages;    ///< guards are probed while a step is taken, and else on its interpolant
    double exponent, memory, min_factor, max_factor; ///< of its step size, see StepControl

    template <class Tableau, class Stepper> static constexpr MethodFacts of() {
        return {.order = Tableau::order,
                .field_calls = Tableau::stages - 1,
                .extra_field_calls = Tableau::extra_stages,
                .probes_stages = Stepper::probes_stages,
                .exponent = Tableau::exponent,
                .memory = Tableau::memory,
                .min_factor = Tableau::min_factor,
                .max_factor = Tableau::max_factor};
    }
};

/// What a step is worth.
template <class S> struct Judged {
    S sum = S(0);   ///< of what it was made of: finite only if all of it is
    S error = S(0); ///< square of its error in units of the tolerance, if that is finite
    bool finite() const { return sum * S(0) == S(0); }
};

/// The steps of some method from a place; that and the guards are arguments of each call.
template <class Sys, class S> class Steps {
public:
    static constexpr int N = dim_v<Sys>;
    using X = State<Sys, S>;
    using At = Place<Sys, S>;
    using Guards = Watch<Sys, S>;

    Steps(const Steps&) = delete;
    Steps& operator=(const Steps&) = delete;

    const MethodFacts& facts() const { return facts_; }
    /// Where steps are probed.
    const ProbeTimes<S>& times() const { return times_; }

    /// The field at the start of a step, and at its end.
    X& start_field() { return *first_; }
    const X& start_field() const { return *first_; }
    X& end_field() { return *last_; }
    const X& end_field() const { return *last_; }
    /// The next step starts where this one ended ...
    void go_on() { *first_ = *last_; }
    /// ... or anywhere.
    virtual void begin(const X& field) = 0;

    /// Takes a step to x1, and probes the guards if stages are fit for that; then it is judged too,
    /// if it is to be.
    virtual Judged<S> take(const At& at, Guards& guards, S dt, X& x1, bool judge) = 0;
    /// Judges the step that was taken, and lets the guards see what was probed.
    virtual Judged<S> judge(const At& at, Guards& guards, const S& dt, const X& x1) const = 0;
    /// Square of the error of a step in units of the tolerance, its mean over the components that
    /// there are.
    virtual S squared_error(const At& at, const S& dt, const X& x1) const = 0;
    /// The interpolant over the step just taken, whose end may have been moved since; returns how
    /// many of its terms are used.
    virtual int interpolate(const At& at, Guards& guards, const S& dt, const X& x1,
                            Interpolant<S, N, 8>& polynomial) = 0;
    /// Two steps of a third of this one: value and derivative by theta at the end of each.
    virtual std::array<X, 4> thirds(const At& at, Guards& guards, const S& dt) const = 0;

protected:
    Steps(const MethodFacts& facts, const ProbeTimes<S>& times) : facts_(facts), times_(times) {}
    ~Steps() = default;
    /// Where the field at the start of a step is, and at its end.
    void keep_fields_in(X& first, X& last) {
        first_ = &first;
        last_ = &last;
    }

private:
    const MethodFacts& facts_;
    const ProbeTimes<S>& times_;
    X *first_ = nullptr, *last_ = nullptr;
};

/// The steps of one.
template <class Tableau, class Sys, class S> class StepsOf final : public Steps<Sys, S> {
    using Base = Steps<Sys, S>;
    using Base::N;
    using typename Base::At;
    using typename Base::Guards;
    using typename Base::X;
    using Stepper = typename Tableau::template Stepper<S, N>;
    static constexpr MethodFacts facts_of = MethodFacts::of<Tableau, Stepper>();
    static constexpr const ProbeTimes<S>& times_of = probe_times<StepTimes<Tableau, S, N>, S>;

public:
    StepsOf() : Base(facts_of, times_of) { this->keep_fields_in(rk_.k[0], rk_.k[Stepper::last]); }

    void begin(const X& field) override { rk_.begin(field); }
    FILIPPOV_FLATTEN Judged<S> take(const At& __restrict at, Guards& __restrict guards, S dt,
                                    X& __restrict x1, bool judge) override {
        if constexpr (!Stepper::probes_stages) {
            field_of_mode(at, guards,
                          [&](auto&& rhs) { rk_.step(rhs, at.clock.local, at.x, dt, x1); });
            return {};
        } else {
            probed_field(at, guards, [&](auto&& rhs) FILIPPOV_LAMBDA_INLINE {
                take_on(rk_, rhs, at.clock.local, at.x, dt, x1);
            });
            return judge ? judged(at, guards, dt, x1) : Judged<S>{};
        }
    }
    FILIPPOV_FLATTEN Judged<S> judge(const At& at, Guards& guards, const S& dt,
                                     const X& x1) const override {
        return judged(at, guards, dt, x1);
    }
    FILIPPOV_FLATTEN S squared_error(const At& at, const S& dt, const X& x1) const override {
        return error_of(at, dt, x1);
    }
    int interpolate(const At& at, Guards& guards, const S& dt, const X& x1,
                    Interpolant<S, N, 8>& polynomial) override {
        using Polynomial = typename Stepper::Polynomial;
        Polynomial p;
        field_of_mode(at, guards, [&](auto&& rhs) {
            auto field = bare(rhs);
            p = rk_.interpolant(field, at.clock.local, at.x, dt, x1);
        });
        static_assert(std::tuple_size_v<decltype(p.c)> <= 8,
                      "filippov: expected an interpolant of at most eight terms (four rows `d`)");
        std::copy(p.c.begin(), p.c.end(), polynomial.c.begin());
        return int(p.c.size());
    }
    std::array<X, 4> thirds(const At& at, Guards& guards, const S& dt) const override {
        std::array<X, 4> inside;
        if constexpr (Tableau::extra_stages > 0) {
            Stepper third;
            X x = at.x, slope = rk_.k[0];
            field_of_mode(at, guards, [&](auto&& rhs) {
                auto field = bare(rhs);
                for (std::size_t j = 0; j < 2; ++j) {
                    const S t = at.clock.local + S(j) / S(3) * dt;
                    third.begin(slope);
                    third.step(field, t, x, S(dt / S(3)), inside[2 * j]);
                    x = inside[2 * j];
                    slope = third.k[Stepper::last];
                    inside[2 * j + 1] = dt * slope;
                }
            });
        }
        return inside;
    }

private:
    /// The stages, which no store to a guard can reach: they are not read anew after each.
    template <class Rhs>
    FILIPPOV_INLINE static void take_on(Stepper& __restrict rk, Rhs& rhs, const S& t, const X& x,
                                        const S& dt, X& __restrict x1) {
        rk.step(rhs, t, x, dt, x1);
    }
    FILIPPOV_INLINE Judged<S> judged(const At& at, Guards& guards, const S& dt, const X& x1) const {
        const X all = x1 + rk_.sum_of_stages();
        Judged<S> judged;
        for (int i = 0; i < N; ++i)
            judged.sum += all[i];
        judged.sum += guards.see(times_of);
        if (judged.finite() && !(at.settings.fixed_step > S(0)))
            judged.error = error_of(at, dt, x1);
        return judged;
    }
    FILIPPOV_INLINE S error_of(const At& at, const S& dt, const X& x1) const {
        X weight = at.scale_of_step(x1, dt);
        for (int i = 0; i < N; ++i)
            weight[i] = dt / weight[i] * mean_weight<Sys, S>(at.sys);
        return Tableau::squared_error(rk_, weight);
    }
    /// A field whose guards nobody probes.
    template <class Rhs> static auto bare(const Rhs& rhs) {
        return [&rhs](std::size_t, const S& t, const X& x) { return rhs.field(t, x); };
    }

    Stepper rk_;
};

/// What `use` makes of the steps of a method. Where the method is known when the program runs,
/// another class chooses among these: all but the steps is compiled once.
template <class Tableau, class Sys, class S> struct WithSteps {
    template <class Use> auto operator()(const Use& use) const {
        StepsOf<Tableau, Sys, S> steps;
        return use(steps);
    }
};

} // namespace filippov
