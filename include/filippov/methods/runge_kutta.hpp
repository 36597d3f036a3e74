// SPDX-License-Identifier: BSD-3-Clause
// One step of an explicit Runge-Kutta pair whose last stage is the first of the next step, and its
// interpolant. A method is a tableau (see dormand_prince5.hpp); there is one stepper.
#pragma once

#include <filippov/core/scalar.hpp>

#include <array>
#include <cstddef>
#include <utility>

namespace filippov {

/// Polynomial through a step, theta in [0, 1], in Hairer's alternating form
///   c0 + theta (c1 + (1 - theta) (c2 + theta (c3 + (1 - theta) (...)))),
/// which reproduces both end points exactly.
template <class S, int N, int Terms> struct Interpolant {
    std::array<Vec<S, N>, Terms> c;

    FILIPPOV_INLINE Vec<S, N> operator()(const S& theta) const { return at(theta, Terms); }
    /// The same by the first terms alone; at least one.
    FILIPPOV_INLINE Vec<S, N> at(const S& theta, int terms) const {
        const S one_minus = S(1) - theta;
        Vec<S, N> x = c[std::size_t(terms - 1)];
        for (auto m = std::size_t(terms - 1); m-- > 0;) {
            const S& factor = m % 2 == 0 ? theta : one_minus;
            for (int i = 0; i < N; ++i)
                x[i] = c[m][i] + factor * x[i];
        }
        return x;
    }
    /// The derivative by theta, by the first terms alone.
    Vec<S, N> slope(const S& theta, int terms = Terms) const {
        const S one_minus = S(1) - theta;
        Vec<S, N> x = c[std::size_t(terms - 1)], d = Vec<S, N>::Zero();
        for (auto m = std::size_t(terms - 1); m-- > 0;) {
            const S &factor = m % 2 == 0 ? theta : one_minus, sign(m % 2 == 0 ? 1 : -1);
            for (int i = 0; i < N; ++i) {
                d[i] = sign * x[i] + factor * d[i];
                x[i] = c[m][i] + factor * x[i];
            }
        }
        return d;
    }
    /// Its last four terms are made to pass two points: value and derivative by theta at 1/3, the
    /// same at 2/3.
    void pass_thirds(const std::array<Vec<S, N>, 4>& inside)
        requires(Terms == 8)
    {
        // beyond the cubic, theta^2 (1 - theta)^2 q(theta): q is a cubic, which starts and ends ...
        const S third = S(1) / S(3), weight = S(4) / S(81), tilt = S(4) / S(27);
        for (std::size_t m = 4; m < 8; ++m)
            c[m].setZero();
        const Vec<S, N> cubic_a = (*this)(third), cubic_b = (*this)(S(2) * third),
                        slope_a = slope(third), slope_b = slope(S(2) * third);
        for (int i = 0; i < N; ++i) {
            const S a = (inside[0][i] - cubic_a[i]) / weight,
                    b = (inside[2][i] - cubic_b[i]) / weight,
                    da = third * ((inside[1][i] - slope_a[i]) - tilt * a) / weight,
                    db = third * ((inside[3][i] - slope_b[i]) + tilt * b) / weight;
            const S rise = S(12) * (a - b);
            const S start = S(5) * b - S(4) * a - S(4) * da - S(2) * db,
                    end = S(5) * a - S(4) * b + S(2) * da + S(4) * db,
                    start_slope = (rise + S(8) * da + S(5) * db) / third,
                    end_slope = (rise + S(5) * da + S(8) * db) / third;
            // ... q = c4 + theta (c5 + (1 - theta) (c6 + theta c7)) with these
            c[4][i] = start;
            c[5][i] = end - start;
            c[6][i] = start_slope - c[5][i];
            c[7][i] = c[5][i] - c[6][i] - end_slope;
        }
    }
};

/// The stages of one step. `rhs(j, t, x)` returns the derivative at stage j, t = t0 + c[j] dt; it
/// sees every stage and so may also probe the state there.
template <class Tableau, class S, int N> class RungeKutta {
public:
    using Scalar = S;
    using State = Vec<S, N>;
    using Polynomial = Interpolant<S, N, 4 + Tableau::d_rows>;
    static constexpr bool probes_stages = true; ///< rhs sees where the solution is
    static constexpr std::size_t last = Tableau::stages - 1;

    std::array<State, Tableau::stages + Tableau::extra_stages> k;

    /// The field at the start of a first step ...
    FILIPPOV_INLINE void begin(const State& f0) { k[0] = f0; }
    /// ... and of the one after this.
    FILIPPOV_INLINE void go_on() { k[0] = k[last]; }

    /// Takes k[0] = f(t, x) as given, fills the other stages and x1 = x(t + dt).
    /// @param dt  an S, or the plain number under it
    template <class Rhs, class Step>
    FILIPPOV_INLINE void step(Rhs& rhs, const S& t, const State& x, const Step& dt, State& x1) {
        if constexpr (!is_plain<S>)
            return step_in_loops(rhs, t, x, dt, x1);
        State newest = k[0]; // in registers: the next stage waits for it
        [&]<std::size_t... J>(std::index_sequence<J...>) FILIPPOV_LAMBDA_INLINE {
            (stage<J + 1>(rhs, t, x, dt, x1, newest), ...);
        }(std::make_index_sequence<last>{});
    }

    /// The interpolant over the step just taken; x1 may have been moved onto a surface since.
    template <class Rhs>
    Polynomial interpolant(Rhs& rhs, const S& t, const State& x, const S& dt, const State& x1) {
        State unused, newest = k[last];
        [&]<std::size_t... J>(std::index_sequence<J...>) {
            (stage<Tableau::stages + J>(rhs, t, x, dt, unused, newest), ...);
        }(std::make_index_sequence<Tableau::extra_stages>{});
        Polynomial p;
        for (int i = 0; i < N; ++i) {
            const S rise = x1[i] - x[i];
            const S bend = dt * k[0][i] - rise;
            p.c[0][i] = x[i];
            p.c[1][i] = rise;
            p.c[2][i] = bend;
            p.c[3][i] = rise - dt * k[last][i] - bend;
            if constexpr (Tableau::d_rows > 0)
                [&]<std::size_t... R>(std::index_sequence<R...>) {
                    ((p.c[4 + R][i] =
                          dt * combine([](std::size_t j) { return Tableau::d[R][j]; }, i)),
                     ...);
                }(std::make_index_sequence<Tableau::d_rows>{});
        }
        return p;
    }

    /// Mean over the components of (weight_i sum_j e(j) k_j)^2.
    template <class Row> FILIPPOV_INLINE S mean_square(Row e, const State& weight) const {
        S sum(0);
        for (int i = 0; i < N; ++i) {
            const S scaled = weight[i] * combine(e, i);
            sum += scaled * scaled;
        }
        return sum / S(N);
    }

    /// Finite only if every stage of the step is: a formula with a zero weight, or a field that
    /// maps infinity to something finite, must not hide a stage that left the domain.
    FILIPPOV_INLINE const State& sum_of_stages() const { return sum_; }

private:
    /// For scalars that are large themselves: one field call in the code, not one a stage.
    template <class Rhs, class Step>
    FILIPPOV_NOINLINE void step_in_loops(Rhs& rhs, const S& t, const State& x, const Step& dt,
                                         State& x1) {
        static constexpr auto a = weights();
        for (std::size_t j = 1; j <= last; ++j) {
            State y = x; // not x1 itself, which might be a stage for all the compiler knows
            for (std::size_t m = 0; m < j; ++m)
                if (a[j][m] != 0)
                    for (int i = 0; i < N; ++i)
                        y[i] += (a[j][m] * dt) * k[m][i];
            x1 = y;
            k[j] = rhs(j, S(t + static_cast<Real<S>>(Tableau::c[j]) * dt), x1);
        }
    }
    /// The tableau in the scalar's precision: long double is slow to load in a loop.
    static constexpr auto weights() {
        std::array<std::array<Real<S>, last>, last + 1> a{};
        for (std::size_t j = 1; j <= last; ++j)
            for (std::size_t m = 0; m < j; ++m)
                a[j][m] = static_cast<Real<S>>(Tableau::a[j][m]);
        return a;
    }

    template <std::size_t J, class Rhs, class Step>
    FILIPPOV_INLINE void stage(Rhs& rhs, const S& t, const State& x, const Step& dt, State& x1,
                               State& newest) {
        constexpr auto theta = static_cast<Real<S>>(Tableau::c[J]);
        State xj;
        advance<J>(x, dt, newest, xj);
        if constexpr (J == last)
            x1 = xj;
        newest = rhs(J, S(t + theta * dt), xj);
        k[J] = newest;
        if constexpr (J <= last)
            sum_ = J == 1 ? newest : State(sum_ + newest);
    }

    template <std::size_t J> struct WeightsOf {
        constexpr long double operator()(std::size_t j) const { return Tableau::a[J][j]; }
    };

    /// x + dt sum_j a_j k_j. Only the newest stage is late: its term is added last, and dt
    /// multiplies the weights, so that the chain from one stage to the next is one product and one
    /// or two sums. At an inner stage x joins the early terms; in the result it is added last, for
    /// one rounding. In lanes, where the units are busy all the time, dt multiplies the sum.
    template <std::size_t J, class Step>
    FILIPPOV_INLINE void advance(const State& x, const Step& dt, const State& newest,
                                 State& out) const {
        constexpr long double last_weight = Tableau::a[J][J - 1];
        for (int i = 0; i < N; ++i) {
            if constexpr (is_wide<S>) {
                S sum(0);
                [&]<std::size_t... I>(std::index_sequence<I...>) FILIPPOV_LAMBDA_INLINE {
                    (add<I>(WeightsOf<J>{}, i, sum), ...);
                }(std::make_index_sequence<J>{});
                out[i] = fused(S(dt), sum, x[i]);
            } else {
                S early(0);
                [&]<std::size_t... I>(std::index_sequence<I...>) FILIPPOV_LAMBDA_INLINE {
                    (add_scaled<J, I>(dt, i, early), ...);
                }(std::make_index_sequence<J - 1>{});
                const S scaled = static_cast<Real<S>>(last_weight) * dt;
                out[i] = J == last ? x[i] + fused(scaled, newest[i], early)
                                   : fused(scaled, newest[i], S(x[i] + early));
            }
        }
    }
    template <std::size_t J, std::size_t I, class Step>
    FILIPPOV_INLINE void add_scaled(const Step& dt, int i, S& sum) const {
        constexpr long double weight = Tableau::a[J][I];
        if constexpr (weight != 0)
            sum = fused(S(static_cast<Real<S>>(weight) * dt), k[I][i], sum);
    }

    /// sum_j row(j) k_j[i] over the non-zero weights, unrolled at compile time.
    template <class Row> FILIPPOV_INLINE S combine(Row row, int i) const {
        S sum(0);
        [&]<std::size_t... J>(std::index_sequence<J...>) FILIPPOV_LAMBDA_INLINE {
            (add<J>(row, i, sum), ...);
        }(std::make_index_sequence<Tableau::stages + Tableau::extra_stages>{});
        return sum;
    }

    template <std::size_t J, class Row> FILIPPOV_INLINE void add(Row, int i, S& sum) const {
        constexpr long double weight = row_value<Row, J>();
        if constexpr (weight != 0)
            sum = fused(S(static_cast<Real<S>>(weight)), k[J][i], sum);
    }

    /// Beyond the last entry of a row that is shorter than the stage array the weight is zero.
    template <class Row, std::size_t J> static constexpr long double row_value() {
        return Row{}(J);
    }

    State sum_; ///< of the stages but the first
};

} // namespace filippov
