// SPDX-License-Identifier: BSD-3-Clause
// One step of a Rosenbrock method, linearly implicit: for stiff fields. A method is a tableau (see
// rodas5p.hpp); there is one stepper.
#pragma once

#include <filippov/core/dual.hpp>
#include <filippov/core/growth_rates.hpp>
#include <filippov/methods/runge_kutta.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace filippov {

/// Derivatives of a field at one point.
template <class S, int N> struct Slopes {
    Mat<S, N, N> by_x; ///< the Jacobian
    Vec<S, N> by_t;
    Vec<S, N> size = Vec<S, N>::Ones(); ///< of the state's components, what is large there
};
/// The derivatives of a field f(t, x, p), exact.
template <class Field, class S, int N, int P>
Slopes<S, N> slopes_of(const Field& field, const S& t, const Vec<S, N>& x, const Vec<S, P>& p) {
    using D = Dual<S, N + 1>;
    Vec<D, N> y;
    for (int i = 0; i < N; ++i)
        y[i] = D::variable(x[i], i);
    Vec<D, P> q;
    for (int i = 0; i < P; ++i)
        q[i] = D(p[i]);
    const Vec<D, N> f = field(D::variable(t, N), y, q);
    Slopes<S, N> r;
    for (int i = 0; i < N; ++i) {
        r.by_t[i] = f[i].d[N];
        for (int k = 0; k < N; ++k)
            r.by_x(i, k) = f[i].d[std::size_t(k)];
    }
    return r;
}

/// The stages of one step:
///
///   (1/(gamma dt) - J) u_i = f(t + c_i dt, x + sum_j a_ij u_j) + sum_j C_ij u_j / dt + d_i dt f_t
///
/// x1 is the argument of the last stage plus its u, which is also the estimate of the error. J and
/// f_t are exact and belong to the start of the step: however often a step is tried or shortened,
/// they are computed once.
///
/// The estimate u is what the linear part makes of the error, and a start deep in a stiff layer
/// makes nothing of a step that leaves the layer. So the end is asked, too: what f and the slope of
/// the interpolant differ by there, seen through the Jacobian there, which is that of the next
/// start.
///
/// Modes that grow are another matter: L-stability damps them, too, and both estimates with them. A
/// step is refused if it is long against the fastest growth at its start.
///
/// Called as RungeKutta is, except that `rhs` also gives `field(t, x)`, the derivative that nobody
/// watches, and `slopes(t, x)`. Stages are too crude to tell where a solution is: guards are probed
/// on the interpolant, which costs no field.
/// @source Hairer & Wanner, Solving Ordinary Differential Equations II, IV.7
template <class Tableau, class S, int N> class Rosenbrock {
public:
    using Scalar = S;
    using State = Vec<S, N>;
    using Polynomial = Interpolant<S, N, 5>;
    static constexpr bool probes_stages = false;
    static constexpr std::size_t last = Tableau::stages - 1; ///< the field at the end

    std::array<State, Tableau::stages> k;

    /// The field may be another one than before.
    void begin(const State& f0) {
        k[0] = f0;
        start_.forget();
        end_.forget();
    }
    void go_on() { k[0] = k[last]; }

    template <class Rhs> void step(Rhs& rhs, const S& t, const State& x, const S& dt, State& x1) {
        if (!start_.is_at(t, x)) {
            if (end_.is_at(t, x))
                start_ = end_;
            else
                start_.move_to(t, x, rhs, S(1e-3) * dt, k[0]);
        }
        using std::abs;
        if (abs(dt) <= std::numeric_limits<S>::min())
            return stay(rhs, t, x, x1); // a landing may ask for nothing
        const auto solver = matrix(start_, dt);
        for (std::size_t i = 0; i < last; ++i) {
            State at = x, b = (S(Tableau::d[i]) * dt) * start_.slopes.by_t;
            for (std::size_t j = 0; j < i; ++j) {
                if (Tableau::a[i][j] != 0)
                    at += S(Tableau::a[i][j]) * u_[j];
                b += (S(Tableau::C[i][j]) / dt) * u_[j];
            }
            if (i > 0)
                k[i] = rhs.field(S(t + S(Tableau::c[i]) * dt), at);
            b += k[i];
            u_[i] = solve(start_, solver, b);
            x1 = at + u_[i];
        }
        k[last] = rhs.field(S(t + dt), x1);
        end_.move_to(S(t + dt), x1, rhs, S(-1e-3) * dt, k[last]);
        const Polynomial p = interpolant(rhs, t, x, dt, x1);
        const State slope = (p.c[1] - p.c[2] - p.c[3]) / dt, defect = k[last] - slope;
        error_ = u_[last - 1] / dt;
        growth_ = start_.growth(dt);
        // through a Jacobian with growing modes as if it were not there
        defect_ = end_.growth(dt) > S(1) ? State(S(Tableau::gamma) * defect)
                                         : State(solve(end_, matrix(end_, dt), defect) / dt);
    }

    /// The interpolant over the step just taken; x1 may have been moved onto a surface since.
    template <class Rhs>
    Polynomial interpolant(Rhs&, const S&, const State& x, const S&, const State& x1) const {
        std::array<State, 3> q;
        for (std::size_t r = 0; r < q.size(); ++r) {
            q[r].setZero();
            for (std::size_t j = 0; j < last; ++j)
                q[r] += S(Tableau::h[r][j]) * u_[j];
        }
        // theta (q1 + theta q2) = theta ((q1 + q2) - (1 - theta) q2)
        return {{x, State(x1 - x), q[0], State(q[1] + q[2]), State(-q[2])}};
    }

    /// Mean over the components of the square of the error, by weights that have the step in them:
    /// of the estimate or of the defect, whichever is larger.
    S mean_square_error(const State& weight) const {
        S error(0), defect(0);
        for (int i = 0; i < N; ++i) {
            error += weight[i] * error_[i] * weight[i] * error_[i];
            defect += weight[i] * defect_[i] * weight[i] * defect_[i];
        }
        // as an error that asks for a step in which growth is within bounds
        const S fast = growth_ * growth_ * growth_ * growth_ * growth_;
        const S larger = defect <= error ? error : defect; // NaN if one is
        return std::max(larger / S(N), growth_ > S(1) ? fast * fast : S(0));
    }

    /// Finite only if every stage of the step is.
    State sum_of_stages() const {
        State sum = k[1];
        for (std::size_t j = 2; j <= last; ++j)
            sum += k[j];
        return sum;
    }

private:
    /// A point and the field's derivatives there; the Jacobian in units of the components' sizes,
    /// powers of two, so that pivots, norms and eigenvalues are the same in any units.
    struct Linearised {
        S t = nowhere;
        State x;
        Slopes<S, N> slopes;

        /// Of all growth, per unit of time: the ends of the discs of Gershgorin that the
        /// eigenvalues lie in.
        S most_forwards = S(0), most_backwards = S(0);
        S rate_forwards = S(0), rate_backwards = S(0); ///< the fastest, once it is asked for
        bool known = false;

        static constexpr S nowhere = std::numeric_limits<S>::quiet_NaN();
        void forget() { t = nowhere; }
        /// How long a step is against the fastest growth; beyond 1 it is too long. Eigenvalues are
        /// looked for only if their discs do not tell.
        S growth(const S& dt) {
            const S at_most = (dt > S(0) ? dt * most_forwards : -dt * most_backwards) / S(longest);
            if (!(at_most > S(1)))
                return at_most;
            if (!known)
                find_rates();
            known = true;
            return dt > S(0) ? dt * rate_forwards / S(longest) : -dt * rate_backwards / S(longest);
        }
        /// exp(longest) is what a mode may grow by in a step.
        static constexpr double longest = 2;

        bool is_at(const S& time, const State& state) const { return t == time && x == state; }
        /// @param inside, field  from here into the step: at the end of a power law slopes can be
        ///                       infinite
        template <class Rhs>
        void move_to(const S& time, const State& state, const Rhs& rhs, const S& inside,
                     const State& field) {
            t = time;
            x = state;
            slopes = rhs.slopes(time, state);
            if (!(slopes.by_x.allFinite() && slopes.by_t.allFinite()))
                slopes = rhs.slopes(S(time + inside), State(state + inside * field));
            for (int i = 0; i < N; ++i)
                slopes.size[i] = power_of_two(slopes.size[i]);
            for (int i = 0; i < N; ++i)
                for (int j = 0; j < N; ++j)
                    slopes.by_x(i, j) *= slopes.size[j] / slopes.size[i];
            find_bounds();
            known = false;
        }
        static S power_of_two(const S& size) {
            using std::ilogb;
            using std::ldexp;
            return size > S(0) && size <= std::numeric_limits<S>::max() ? ldexp(S(1), ilogb(size))
                                                                        : S(1);
        }
        void find_bounds() {
            using std::abs;
            most_forwards = most_backwards = -std::numeric_limits<S>::infinity();
            for (int i = 0; i < N; ++i) {
                S radius(0);
                for (int j = 0; j < N; ++j)
                    radius += j == i ? S(0) : S(abs(slopes.by_x(i, j)));
                most_forwards = std::max(most_forwards, S(slopes.by_x(i, i) + radius));
                most_backwards = std::max(most_backwards, S(radius - slopes.by_x(i, i)));
            }
        }
        /// The largest real parts of the eigenvalues of J and of -J.
        void find_rates() {
            const Mat<S, N, N>& J = slopes.by_x;
            rate_forwards = rate_backwards = S(0);
            const auto include = [&](const S& real) {
                rate_forwards = std::max(rate_forwards, real);
                rate_backwards = std::max(rate_backwards, S(-real));
            };
            if constexpr (N == 1) {
                include(J(0, 0));
            } else if constexpr (N == 2) {
                using std::sqrt;
                const S mean = (J(0, 0) + J(1, 1)) / S(2), half = (J(0, 0) - J(1, 1)) / S(2);
                const S square = half * half + J(0, 1) * J(1, 0);
                const S root = square > S(0) ? S(sqrt(square)) : S(0);
                include(mean + root);
                include(mean - root);
            } else {
                constexpr int most = std::max(N, most_growth_rates);
                const GrowthRates rates = growth_rates<most>(J.template cast<double>());
                rate_forwards = S(rates.forwards);
                rate_backwards = S(rates.backwards);
            }
        }
    };
    /// A step of no length, by which nothing can be divided.
    template <class Rhs> void stay(Rhs& rhs, const S& t, const State& x, State& x1) {
        x1 = x;
        u_.fill(State::Zero());
        std::fill(k.begin() + 1, k.end(), rhs.field(t, x));
        end_ = start_;
        error_ = defect_ = State::Zero();
        growth_ = S(0);
    }
    static auto matrix(const Linearised& at, const S& dt) {
        Mat<S, N, N> m = -at.slopes.by_x;
        for (int i = 0; i < N; ++i)
            m(i, i) += S(1) / (S(Tableau::gamma) * dt);
        return Eigen::PartialPivLU<Mat<S, N, N>>(m);
    }
    template <class Solver>
    static State solve(const Linearised& at, const Solver& solver, const State& b) {
        const State& size = at.slopes.size;
        return size.cwiseProduct(solver.solve(State(b.cwiseQuotient(size))));
    }

    Linearised start_, end_;
    std::array<State, last> u_;
    State error_, defect_; ///< divided by the step
    S growth_ = S(0);
};

} // namespace filippov
