// SPDX-License-Identifier: BSD-3-Clause
// The solution of a relay system in closed form: the oracle of the stability campaign.
//
// It shares no code with the engine. Everything is extended precision; a mode is a linear system,
// followed by its Taylor series; events are roots of linear functionals of the state, bracketed
// step by step; and which mode follows is found by trying all.
#pragma once

#include "relays.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

namespace filippov::stability {

using Long = long double;

/// What happened in an exact run.
enum class Fate {
    ok,
    not_unique,  ///< several modes go on
    undecided,   ///< none does, or a tie to the third derivative
    accumulates, ///< more events than are followed
};

template <int M> struct ExactEvent {
    Long t;
    Mode<M> mode; ///< after it
};

template <int N, int M> struct ExactRun {
    Fate fate = Fate::ok;
    Long t = 0;       ///< natural units, from the start
    Vec<Long, N> x;   ///< natural units, at t
    Long largest = 0; ///< of a component of x on the way, in units of `size`
    std::vector<ExactEvent<M>> events{};
    bool slides = false;

    bool same_story(const ExactRun& other) const {
        if (fate != other.fate || events.size() != other.events.size())
            return false;
        for (std::size_t i = 0; i < events.size(); ++i)
            if (!(events[i].mode == other.events[i].mode))
                return false;
        return true;
    }
};

/// Follows one problem, forwards or backwards, exactly or with errors added.
template <int N, int M> class Exact {
    // the state with cos, sin and 1 behind it, so that everything is linear
    static constexpr int L = N + 3;
    using State = Eigen::Matrix<Long, L, 1>;
    using Square = Eigen::Matrix<Long, L, L>;
    using Row = Eigen::Matrix<Long, 1, L>;

public:
    static constexpr std::size_t most_events = 1000;

    explicit Exact(const Problem<N, M>& q, int direction = 1) : q_(q) {
        const Relays<N, M>& z = q.sys;
        const Vec<Long, N> size = q.size.template cast<Long>();
        const Eigen::Matrix<Long, N, N> turn = q.turn.template cast<Long>();
        from_ = turn.inverse() * size.cwiseInverse().asDiagonal();
        to_ = size.asDiagonal() * turn;
        const Long pace = Long(direction) / Long(q.speed);
        field_.setZero();
        field_.template topLeftCorner<N, N>() = pace * from_ * z.A.template cast<Long>() * to_;
        field_.template block<N, 2>(0, N) = pace * from_ * z.e.template cast<Long>();
        field_(N, N + 1) = -pace * Long(z.omega);
        field_(N + 1, N) = pace * Long(z.omega);
        pull_.setZero();
        pull_.template topRows<N>() = pace * from_ * z.B.template cast<Long>();
        for (int j = 0; j < M; ++j) {
            Row& w = h_[std::size_t(j)];
            w.template head<N>() = z.C.row(j).template cast<Long>() * to_;
            w.template segment<2>(N) = z.q.row(j).template cast<Long>();
            w[L - 1] = Long(z.d[j]);
            w /= w.template head<N>().norm();
        }
    }

    /// In units of `size`, from what the engine is given.
    Vec<Long, N> natural(const Vec<double, N>& x) const { return from_ * x.template cast<Long>(); }
    /// Error of the engine's state beside an exact one, per component, in units of `size`.
    Long distance(const Vec<double, N>& x, const Vec<Long, N>& exact) const {
        return (x.template cast<Long>() - to_ * exact)
            .cwiseQuotient(q_.size.template cast<Long>())
            .cwiseAbs()
            .maxCoeff();
    }
    Vec<double, N> disguised(const Vec<Long, N>& x) const {
        return (to_ * x).template cast<double>();
    }

    /// @param t0     the engine's time of x0
    /// @param span   natural units, > 0
    /// @param error  added in every step, natural units; nothing is added where it is zero
    ExactRun<N, M> run(const Vec<Long, N>& x0, double t0, Long span,
                       const Vec<Long, N>& error) const {
        ExactRun<N, M> r;
        State z;
        const Long phase = Long(q_.sys.omega) * Long(t0);
        z << x0, std::cos(phase), std::sin(phase), 1;
        // A start is on a surface, or on the boundary of sliding, but for rounding of double; where
        // that makes a difference, nobody can tell.
        const bool matters = !q_.passive;
        Sides near = matters ? surely_on(x0, z) : near_surfaces(z, 2e-16L);
        if (matters && near != near_surfaces(z, 1e-12L)) {
            r.fate = Fate::undecided;
            r.x = x0;
            return r;
        }
        Mode<M> mode = sides_of(z);
        disturb(z, error, near);
        for (;;) {
            const Choice choice = choose(z, mode, near, matters && r.events.empty());
            if (choice.n != 1) {
                r.fate = choice.n > 1 ? Fate::not_unique : Fate::undecided;
                break;
            }
            mode = choice.mode;
            r.slides = r.slides || mode.sliding() > 0;
            r.events.push_back({r.t, mode});
            if (r.events.size() > most_events) {
                r.fate = Fate::accumulates;
                break;
            }
            const int met = follow(mode, near, z, r, span, error);
            if (met < 0)
                break;
            near = near_surfaces(z, 1e-16L); // what is spiralled onto is reached
            for (int j = 0; j < M; ++j)
                near[std::size_t(j)] = near[std::size_t(j)] || j == met || mode[j] == 0;
        }
        r.x = z.template head<N>();
        return r;
    }

private:
    using Sides = std::array<bool, std::size_t(M)>;
    /// Relative sizes of what counts as zero, and of what does not. A start is given in double
    /// precision: between them nobody can tell.
    static constexpr Long zero_below = 1e-15L, plain_above = 1e-12L;

    /// A mode as a linear system.
    struct Linear {
        Square G;
        std::array<Row, std::size_t(M)> s{}; ///< of surfaces slid on
        bool regular = true;
    };
    struct Choice {
        int n = 0; ///< how many modes go on; -1: nobody can tell
        Mode<M> mode{};
    };
    enum Beginning { falls = -1, stays = 0, rises = 1, unclear = 2 };

    Sides near_surfaces(const State& z, Long distance) const {
        Sides near{};
        for (std::size_t j = 0; j < near.size(); ++j)
            near[j] = std::abs(h_[j].dot(z)) <= distance * (1 + z.cwiseAbs().maxCoeff());
        return near;
    }
    /// The surfaces on which a start is for any engine: to a few ulp of the terms of h.
    Sides surely_on(const Vec<Long, N>& x0, const State& z) const {
        const Vec<Long, N> x = to_ * x0;
        Sides on{};
        for (int j = 0; j < M; ++j) {
            const auto C = q_.sys.C.row(j).template cast<Long>().eval();
            const Long terms = C.cwiseAbs().dot(x.cwiseAbs().transpose());
            on[std::size_t(j)] = std::abs(h_[std::size_t(j)].dot(z)) * (C * to_).norm() <=
                                 8 * std::numeric_limits<double>::epsilon() * terms;
        }
        return on;
    }
    Mode<M> sides_of(const State& z) const {
        Mode<M> mode;
        for (int j = 0; j < M; ++j)
            mode.set(j, h_[std::size_t(j)].dot(z) < 0 ? -1 : 1);
        return mode;
    }

    Linear linear(const Mode<M>& mode) const {
        Linear m{field_};
        std::vector<int> on;
        for (int j = 0; j < M; ++j) {
            if (mode[j] == 0)
                on.push_back(j);
            else
                m.G.col(L - 1) += Long(mode[j]) * pull_.col(j);
        }
        const auto n = Eigen::Index(on.size());
        if (n == 0)
            return m;
        // the s that keep h_j' = 0
        using Matrix = Eigen::Matrix<Long, Eigen::Dynamic, Eigen::Dynamic>;
        Matrix effect(n, n), rate(n, Eigen::Index(L));
        for (Eigen::Index i = 0; i < n; ++i) {
            const Row& w = h_[std::size_t(on[std::size_t(i)])];
            rate.row(i) = w * m.G;
            for (Eigen::Index k = 0; k < n; ++k)
                effect(i, k) = w.dot(pull_.col(on[std::size_t(k)]));
        }
        const Eigen::FullPivLU<Matrix> lu(effect);
        m.regular = lu.isInvertible();
        const Matrix s = -lu.solve(rate);
        for (Eigen::Index i = 0; i < n; ++i) {
            m.s[std::size_t(on[std::size_t(i)])] = s.row(i);
            m.G += pull_.col(on[std::size_t(i)]) * s.row(i);
        }
        return m;
    }

    enum Size { zero, tiny, plain };
    /// How large a functional is beside what it is summed of.
    static Size size_of(const Row& w, const State& v, Long value) {
        const Long scale = w.cwiseAbs().dot(v.cwiseAbs()) + w.norm();
        return std::abs(value) > plain_above * scale  ? plain
               : std::abs(value) > zero_below * scale ? tiny
                                                      : zero;
    }
    /// What a functional begins with, along a linear system.
    /// @param strict  what is zero to rounding may be anything
    static Beginning begins(const Row& w, const Square& G, const State& z, int first, bool strict) {
        State v = z;
        for (int k = 0; k < first; ++k)
            v = G * v;
        for (int k = first; k < first + 3; ++k) {
            const Long value = w.dot(v);
            const Size size = size_of(w, v, value);
            if (size != zero)
                return size == tiny ? unclear : value > 0 ? rises : falls;
            if (strict)
                return unclear;
            v = G * v;
        }
        return stays;
    }

    /// All modes that go on from z, where some surfaces are met or slid on.
    Choice choose(const State& z, const Mode<M>& before, const Sides& near, bool strict) const {
        Choice choice;
        int n_modes = 1;
        for (const bool at : near)
            n_modes *= at ? 3 : 1;
        for (int code = 0; code < n_modes; ++code) {
            Mode<M> mode = before;
            int rest = code;
            for (int j = 0; j < M; ++j)
                if (near[std::size_t(j)]) {
                    mode.set(j, rest % 3 - 1);
                    rest /= 3;
                }
            const Beginning what = goes_on(z, mode, near, strict);
            if (what == unclear)
                return {-1};
            if (what == rises) {
                ++choice.n;
                choice.mode = mode;
            }
        }
        return choice;
    }
    Beginning goes_on(const State& z, const Mode<M>& mode, const Sides& near, bool strict) const {
        const Linear m = linear(mode);
        if (!m.regular)
            return unclear;
        Beginning all = rises;
        const auto demand = [&](const Row& w, int first) {
            const Beginning one = begins(w, m.G, z, first, strict);
            if (one == falls || one == stays)
                all = falls;
            else if (one == unclear && all != falls)
                all = unclear;
        };
        for (int j = 0; j < M; ++j) {
            const auto at = std::size_t(j);
            if (!near[at])
                continue;
            if (mode[j] != 0) {
                demand(Long(mode[j]) * h_[at], 1);
                continue;
            }
            const Row one = Row::Unit(L - 1);
            demand(one - m.s[at], 0);
            demand(one + m.s[at], 0);
        }
        return all;
    }

    /// Adds the error, and puts the state back on the surfaces that it is on.
    void disturb(State& z, const Vec<Long, N>& error, const Sides& on) const {
        if (error.isZero(0))
            return;
        z.template head<N>() += error;
        Eigen::Matrix<Long, Eigen::Dynamic, N> w(0, N);
        Eigen::Matrix<Long, Eigen::Dynamic, 1> off(0);
        for (std::size_t j = 0; j < on.size(); ++j)
            if (on[j]) {
                w.conservativeResize(w.rows() + 1, N);
                off.conservativeResize(w.rows());
                w.row(w.rows() - 1) = h_[j].template head<N>();
                off[w.rows() - 1] = h_[j].dot(z);
            }
        if (w.rows() > 0)
            z.template head<N>() -= w.transpose() * (w * w.transpose()).ldlt().solve(off);
    }

    static State after(const Square& G, const State& z, Long dt) {
        State sum = z, term = z;
        for (int k = 1; k < 40; ++k) {
            term = (dt / Long(k)) * (G * term);
            sum += term;
            if (term.cwiseAbs().maxCoeff() <= 1e-21L * sum.cwiseAbs().maxCoeff())
                break;
        }
        return sum;
    }

    /// Follows a mode to the end of the run (-1), or to where a surface is met or left.
    int follow(const Mode<M>& mode, const Sides& near, State& z, ExactRun<N, M>& r, Long span,
               const Vec<Long, N>& error) const {
        const Linear m = linear(mode);
        std::vector<Watched> watched;
        Sides held{};
        for (int j = 0; j < M; ++j) {
            const auto at = std::size_t(j);
            held[at] = mode[j] == 0;
            const auto watch = [&](const Row& w) {
                watched.push_back({w, j, near[at] && size_of(w, z, w.dot(z)) == zero});
            };
            if (mode[j] != 0) {
                watch(Long(mode[j]) * h_[at]);
                continue;
            }
            const Row one = Row::Unit(L - 1);
            watch(one - m.s[at]);
            watch(one + m.s[at]);
        }
        const Long longest = 0.25L / m.G.cwiseAbs().rowwise().sum().maxCoeff();
        // The first step in sixteen: what rises from zero does not fall again within one of them.
        constexpr int parts = 16;
        for (int k = 0;; ++k) {
            const bool first = k == 0;
            if (k >= parts)
                disturb(z, error, held);
            r.largest = std::max(r.largest, (to_ * z.template head<N>())
                                                .cwiseQuotient(q_.size.template cast<Long>())
                                                .cwiseAbs()
                                                .maxCoeff());
            const Long left = span - r.t,
                       dt = std::min(k < parts ? longest / parts : longest, left);
            const State end = after(m.G, z, dt);
            Long theta = 2;
            int met = -1;
            for (const Watched& w : watched)
                if (const auto root = first_root(w, m.G, z, end, dt, first);
                    root && *root < theta) {
                    theta = *root;
                    met = w.surface;
                }
            if (met >= 0) {
                z = after(m.G, z, theta * dt);
                r.t += theta * dt;
                return met;
            }
            z = end;
            r.t = dt < left ? r.t + dt : span;
            if (!(dt < left))
                return -1;
        }
    }

    struct Watched {
        Row w;
        int surface;
        bool starts_at_zero; ///< and rises from there
    };

    /// Where in a step, in (0, 1], a functional that is positive becomes zero.
    std::optional<Long> first_root(const Watched& g, const Square& G, const State& z,
                                   const State& end, Long dt, bool first) const {
        const auto value = [&](Long u) { return g.w.dot(after(G, z, u * dt)); };
        const auto slope = [&](Long u) { return g.w.dot(G * after(G, z, u * dt)); };
        const bool leaves = first && g.starts_at_zero;
        const Long v0 = g.w.dot(z), v1 = g.w.dot(end);
        if (!leaves && v0 <= 0)
            return Long(0);
        const Long r0 = g.w.dot(G * z), r1 = g.w.dot(G * end);
        if (v1 > 0 && (leaves || !(r0 < 0 && r1 > 0)))
            return {};
        Long a = 0, b = 1; // positive at a, not at b
        if (v1 > 0) {      // a dip
            b = change(slope, Long(0), Long(1), -1);
            if (value(b) > 0)
                return {};
        } else if (leaves) {
            a = 1;
            for (int k = 0; k < 60 && !(value(a) > 0); ++k)
                a /= 2;
            b = std::min(2 * a, Long(1));
            if (!(value(a) > 0))
                return {};
        }
        return change(value, a, b, 1);
    }
    /// Where a function of sign `sign` at a, and not at b, changes it: the Illinois method.
    template <class F> static Long change(const F& f, Long a, Long b, int sign) {
        Long fa = Long(sign) * f(a), fb = Long(sign) * f(b);
        for (int k = 0; k < 100 && b - a > 1e-19L && fb < 0; ++k) {
            Long m = b - fb * (b - a) / (fb - fa);
            if (!(m > a && m < b) || k % 8 == 7)
                m = (a + b) / 2;
            const Long fm = Long(sign) * f(m);
            if (fm > 0) {
                fb /= 2;
                a = m;
                fa = fm;
            } else {
                fa /= 2;
                b = m;
                fb = fm;
            }
        }
        return b;
    }

    const Problem<N, M>& q_;
    Eigen::Matrix<Long, N, N> from_, to_;
    Square field_;
    Eigen::Matrix<Long, L, M> pull_;
    std::array<Row, std::size_t(M)> h_{};
};

} // namespace filippov::stability
