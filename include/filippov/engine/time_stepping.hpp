// SPDX-License-Identifier: BSD-3-Clause
// Time stepping: equal implicit steps over whatever switches, without looking for events.
#pragma once

#include <filippov/core/dual.hpp>
#include <filippov/core/status.hpp>
#include <filippov/run/settings.hpp>
#include <filippov/system/system.hpp>

#include <Eigen/LU>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace filippov {

/// A right-hand side with its blend variables as arguments, and its derivatives, at one point.
/// Sizes N and M may be Eigen::Dynamic.
template <int N, int M> struct BlendSlopes {
    Vec<double, N> f;
    Mat<double, N, N> f_x; ///< by the state
    Mat<double, N, M> f_s; ///< by the blend variables
    Vec<double, M> h;
    Mat<double, M, N> h_x;
};

/// `slopes(t, x, s)` of a compiled system that has `field`.
template <class Sys> class BlendOf {
public:
    static constexpr int N = dim_v<Sys>, M = surfaces_v<Sys>;
    static_assert(HasField<Sys, double>,
                  "filippov: time stepping needs `field(t, x, s, p)`, written with the true "
                  "magnitude of what switches (friction: s mu(|v - V|)); where both sides exist on "
                  "both sides of the surface, Blended<System> has it");
    static_assert(!has_jumps_v<Sys>, "filippov: time stepping knows no jumps of the state");
    static_assert(!has_directions_v<Sys>, "filippov: time stepping knows no directions");

    BlendOf(const Sys& sys, const GivenParams<Sys, double>& params)
        : sys_(sys), p_(params.of(sys)) {}

    int dim() const { return N; }
    int surfaces() const { return M; }
    bool slides(int j) const { return is_kind(sys_, j, SurfaceKind::switching); }
    void at(double t, const Vec<double, N>& x, const Vec<double, M>& s,
            BlendSlopes<N, M>& r) const {
        using D = Dual<double, N + M>;
        Vec<D, N> y;
        Vec<D, M> u;
        Params<Sys, D> q;
        for (int i = 0; i < N; ++i)
            y[i] = D::variable(x[i], i);
        for (int j = 0; j < M; ++j)
            u[j] = D::variable(s[j], N + j);
        for (int i = 0; i < params_v<Sys>; ++i)
            q[i] = D(p_[i]);
        const Vec<D, N> f = blended_field(sys_, D(t), y, u, q);
        const Vec<D, M> h = switching(sys_, D(t), y, q);
        for (int i = 0; i < N; ++i) {
            r.f[i] = f[i].v;
            for (int k = 0; k < N; ++k)
                r.f_x(i, k) = f[i].d[std::size_t(k)];
            for (int k = 0; k < M; ++k)
                r.f_s(i, k) = f[i].d[std::size_t(N + k)];
        }
        for (int j = 0; j < M; ++j) {
            r.h[j] = h[j].v;
            for (int k = 0; k < N; ++k)
                r.h_x(j, k) = h[j].d[std::size_t(k)];
        }
    }

private:
    const Sys sys_;
    const Params<Sys, double> p_;
};

/// What time stepping is told.
struct TimeSteppingSettings {
    long long steps = 1000; ///< equal steps from start to end, > 0
    double theta = 1;       ///< 1: implicit Euler; 1/2: the trapezoidal rule; or in between
    long long keep = 1;     ///< every so manieth state is kept, and the last, > 0
    int max_newton = 50;    ///< iterations for one guess of the mode, > 0
    std::function<bool()> interrupted{}; ///< asked now and then; may be empty
};

/// What time stepping leaves behind.
template <int N, int M> struct TimeSteps {
    Status status = Status::ok;
    std::vector<double> t;         ///< of the start and of the steps that are kept
    std::vector<Vec<double, N>> x; ///< states there
    std::vector<Vec<double, M>> s; ///< blend variables over the steps that end there, in [-1, 1]
    long long steps = 0;           ///< taken
    long long modes = 0;           ///< modes that were tried
    long long newtons = 0;         ///< iterations of Newton's method

    /// What happened.
    std::string message() const {
        return std::string(filippov::message(status)) +
               (status == Status::not_converged
                    ? " After t = " + std::to_string(t.back()) +
                          " no choice of sides and slides solves a step: take a smaller one."
                    : "");
    }
};

namespace detail {

/// One step after another.
template <class Blend, int N, int M> class TimeStepper {
public:
    using X = Vec<double, N>;
    using U = Vec<double, M>;

    TimeStepper(const Blend& blend, double t0, const X& x, const TimeSteppingSettings& settings,
                TimeSteps<N, M>& result)
        : blend_(blend), settings_(settings), n_(blend.dim()), m_(blend.surfaces()),
          max_newton_(settings.max_newton), theta_(settings.theta), result_(result), x_(x),
          s_(U::Zero(m_)), at_(sized()), before_(sized()) {
        // it starts on the side where it is
        blend.at(t0, x, s_, at_);
        for (int j = 0; j < m_; ++j)
            mode_.push_back(at_.h[j] < 0 ? -1 : 1);
    }

    const X& x() const { return x_; }
    const U& s() const { return s_; }
    bool interrupted() const { return interrupted_; }

    /// Guesses the mode from the one before, and then the others, the nearer ones first.
    bool step(double t0, double t1) {
        t0_ = t0;
        const double dt = t1 - t0;
        const std::vector<int> before = mode_;
        for (int changes = 0; changes <= m_; ++changes)
            if (with_changes(before, 0, changes, t1, dt))
                return true;
        mode_ = before;
        return false;
    }

private:
    bool with_changes(const std::vector<int>& before, int from, int changes, double t1, double dt) {
        if (changes == 0)
            return solves(t1, dt);
        for (int j = from; j + changes <= m_; ++j) {
            const auto k = std::size_t(j);
            for (int side = -1; side <= 1; ++side) {
                if (side == before[k] || (side == 0 && !blend_.slides(j)))
                    continue;
                mode_[k] = side;
                if (with_changes(before, j + 1, changes - 1, t1, dt))
                    return true;
            }
            mode_[k] = before[k];
        }
        return false;
    }

    /// True if a state and blend variables of this mode solve
    ///   x1 = x + dt ((1 - theta) f(t0, x, s) + theta f(t1, x1, s)),   s_j = side_j and side_j
    ///   h_j(x1) >= 0, or h_j(x1) = 0 and |s_j| <= 1
    bool solves(double t1, double dt) {
        if (++result_.modes % 256 == 0 && settings_.interrupted)
            interrupted_ = interrupted_ || settings_.interrupted();
        if (interrupted_)
            return false;
        X x = x_;
        U s = s_;
        std::vector<int> slid;
        for (int j = 0; j < m_; ++j) {
            const int side = mode_[std::size_t(j)];
            if (side == 0)
                slid.push_back(j);
            else
                s[j] = side;
        }
        const int k = int(slid.size()), n = n_ + k;
        double last = std::numeric_limits<double>::infinity();
        for (int iteration = 0; iteration < max_newton_; ++iteration) {
            ++result_.newtons;
            blend_.at(t1, x, s, at_);
            if (theta_ < 1)
                blend_.at(t0_, x_, s, before_);
            Big matrix = Big::Zero(n, n);
            Column rest = Column::Zero(n);
            matrix.topLeftCorner(n_, n_).setIdentity();
            matrix.topLeftCorner(n_, n_) -= theta_ * dt * at_.f_x;
            rest.head(n_) = x - x_ - theta_ * dt * at_.f - (1 - theta_) * dt * before_.f;
            for (int a = 0; a < k; ++a) {
                matrix.col(n_ + a).head(n_) =
                    -theta_ * dt * at_.f_s.col(slid[std::size_t(a)]) -
                    (1 - theta_) * dt * before_.f_s.col(slid[std::size_t(a)]);
                matrix.row(n_ + a).head(n_) = at_.h_x.row(slid[std::size_t(a)]);
                rest[n_ + a] = at_.h[slid[std::size_t(a)]];
            }
            const Column change = matrix.partialPivLu().solve(rest);
            x -= change.head(n_);
            for (int a = 0; a < k; ++a)
                s[slid[std::size_t(a)]] -= change[n_ + a];
            const double size =
                std::max(change.head(n_).cwiseAbs().cwiseQuotient(size_of(x, dt)).maxCoeff(),
                         k > 0 ? change.tail(k).cwiseAbs().maxCoeff() : 0.0);
            if (!(size < std::numeric_limits<double>::infinity()))
                return false;
            // converged: below rounding's reach, or no longer falling near it
            if (size <= 4e-16 || (size <= 1e-11 && size >= last / 2))
                return accept(t1, x, s);
            last = size;
        }
        return false;
    }
    /// How large each component is, and what goes into its change in a step; s is 1 at most.
    X size_of(const X& x, double dt) const {
        const X field = at_.f.cwiseAbs() + at_.f_s.cwiseAbs().rowwise().sum() +
                        at_.f_x.cwiseAbs() * x.cwiseAbs();
        return x.cwiseAbs()
            .cwiseMax(x_.cwiseAbs())
            .cwiseMax(std::abs(dt) * field)
            .cwiseMax(std::numeric_limits<double>::min());
    }

    bool accept(double t1, const X& x, const U& s) {
        blend_.at(t1, x, s, at_);
        constexpr double slack = 1e-12;
        for (int j = 0; j < m_; ++j) {
            const int side = mode_[std::size_t(j)];
            const double rounding =
                slack *
                (std::abs(at_.h[j]) +
                 (at_.h_x.row(j).transpose().cwiseAbs().array() * x.cwiseAbs().array()).sum());
            if (side == 0 ? !(std::abs(s[j]) <= 1 + slack) : !(side * at_.h[j] >= -rounding))
                return false;
        }
        x_ = x;
        s_ = s.cwiseMin(1.0).cwiseMax(-1.0);
        return true;
    }

    BlendSlopes<N, M> sized() const {
        return {X::Zero(n_), Mat<double, N, N>::Zero(n_, n_), Mat<double, N, M>::Zero(n_, m_),
                U::Zero(m_), Mat<double, M, N>::Zero(m_, n_)};
    }

    // at most N + M unknowns, on the stack where that is known
    static constexpr int most = N == Eigen::Dynamic || M == Eigen::Dynamic ? Eigen::Dynamic : N + M;
    using Big = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most, most>;
    using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most, 1>;

    const Blend& blend_;
    const TimeSteppingSettings& settings_;
    const int n_, m_, max_newton_;
    const double theta_;
    TimeSteps<N, M>& result_;
    X x_;
    U s_;
    std::vector<int> mode_;
    double t0_ = 0;
    bool interrupted_ = false;
    BlendSlopes<N, M> at_, before_; ///< at the end of the step, and at its start
};

} // namespace detail

/// Moreau's time stepping: in each step
///
///   x1 = x + dt ((1 - theta) f(t, x, s) + theta f(t1, x1, s)),   s_j in Sgn(h_j(t1, x1)),
///
/// is solved exactly: every choice of sides and slides is a smooth system for Newton's method, and
/// the first that is consistent is taken, the one of the step before first. So sticking is exact,
/// no event is looked for, and events that accumulate cost nothing.
///
/// With theta = 1 errors are of first order in dt. With theta = 1/2 they are of second order where
/// the solution sticks and slips, since s then holds it on the surface from the step in which it
/// is met; a crossing holds it there, too, for the rest of a step, which leaves first order.
///
/// @param blend  `BlendOf<Sys>`, or what gives `dim`, `surfaces`, `slides(j)` and `at(t, x, s, r)`
/// @error std::invalid_argument for settings or a start that make no sense; status `not_converged`
///        where no choice solves a step, with all steps before it
/// @cost  some Newton iterations a step, each with the derivatives of f and one elimination
/// @source Moreau (1988), in Nonsmooth Mechanics and Applications; Acary & Brogliato (2008),
///         Numerical Methods for Nonsmooth Dynamical Systems, chapter 9
template <class Blend, int N, int M>
TimeSteps<N, M> time_stepping(const Blend& blend, const Vec<double, N>& x0, double t0, double t_end,
                              const TimeSteppingSettings& settings) {
    detail::require_positive("steps", settings.steps);
    detail::require_positive("keep", settings.keep);
    detail::require_positive("max_newton", settings.max_newton);
    if (!(settings.theta >= 0.5 && settings.theta <= 1))
        detail::refuse("theta", settings.theta, "expected a number from 1/2 to 1");
    for (Eigen::Index i = 0; i < x0.size(); ++i)
        if (!std::isfinite(x0[i]))
            detail::refuse("x0[" + std::to_string(i) + "]", x0[i], "expected a finite number");
    if (!std::isfinite(t0) || !std::isfinite(t_end))
        detail::refuse("t_end", t_end, "expected finite times");
    TimeSteps<N, M> result;
    detail::TimeStepper<Blend, N, M> stepper(blend, t0, x0, settings, result);
    const auto keep = [&](double t) {
        result.t.push_back(t);
        result.x.push_back(stepper.x());
        result.s.push_back(stepper.s());
    };
    keep(t0);
    const double dt = (t_end - t0) / double(settings.steps);
    for (long long k = 1; k <= settings.steps; ++k) {
        const double t1 = k == settings.steps ? t_end : t0 + double(k) * dt;
        if (!stepper.step(t0 + double(k - 1) * dt, t1)) {
            result.status = stepper.interrupted() ? Status::interrupted : Status::not_converged;
            break;
        }
        result.steps = k;
        if (k % settings.keep == 0 || k == settings.steps)
            keep(t1);
    }
    if (result.s.size() > 1) // there is no step that ends at the start
        result.s.front() = result.s[1];
    return result;
}

/// The same for a system.
/// @param params  `{}`: the defaults
template <class Sys>
TimeSteps<dim_v<Sys>, surfaces_v<Sys>>
time_stepping(const Sys& sys, const GivenParams<Sys, double>& params,
              const Vec<double, dim_v<Sys>>& x0, double t0, double t_end,
              const TimeSteppingSettings& settings) {
    require_system<Sys>();
    const Params<Sys, double> p = params.of(sys);
    validate_start(x0, t0, t_end, p, given_params(sys));
    return time_stepping<BlendOf<Sys>, dim_v<Sys>, surfaces_v<Sys>>(BlendOf<Sys>(sys, p), x0, t0,
                                                                    t_end, settings);
}

} // namespace filippov
