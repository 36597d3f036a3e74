// SPDX-License-Identifier: BSD-3-Clause
// Random relay systems, disguised: what the engine is given.
#pragma once

#include <filippov/system/system.hpp>

#include <Eigen/QR>

#include <cmath>
#include <numbers>
#include <random>

namespace filippov::stability {

/// x' = A x + B s + e(t),  h = C x + d + q(t),  with e and q of one frequency.
///
/// Every mode is linear, slides included, so that solutions are known in closed form.
template <int N, int M> struct Relays {
    static constexpr int dim = N, surfaces = M;

    Eigen::Matrix<double, N, N> A;
    Eigen::Matrix<double, N, M> B;
    Eigen::Matrix<double, M, N> C;
    Eigen::Matrix<double, M, 1> d;
    Eigen::Matrix<double, N, 2> e; ///< of cos(omega t) and sin(omega t)
    Eigen::Matrix<double, M, 2> q;
    double omega = 0; ///< 0: nothing depends on time

    bool is_forced() const { return omega > 0; }
    template <class S> S period(const Vec<S, 0>&) const { return S(2 * std::numbers::pi / omega); }

    template <Scalar S>
    Vec<S, N> field(const S& t, const Vec<S, N>& x, const Vec<S, M>& s, const Vec<S, 0>&) const {
        const Forcing<S> now(omega, t);
        Vec<S, N> f;
        for (int i = 0; i < N; ++i) {
            f[i] = now.of(e(i, 0), e(i, 1));
            for (int k = 0; k < N; ++k)
                f[i] += S(A(i, k)) * x[k];
            for (int j = 0; j < M; ++j)
                f[i] += S(B(i, j)) * s[j];
        }
        return f;
    }
    template <Scalar S> auto h(const S& t, const Vec<S, N>& x, const Vec<S, 0>&) const {
        const Forcing<S> now(omega, t);
        Vec<S, M> value;
        for (int j = 0; j < M; ++j) {
            value[j] = S(d[j]) + now.of(q(j, 0), q(j, 1));
            for (int k = 0; k < N; ++k)
                value[j] += S(C(j, k)) * x[k];
        }
        if constexpr (M == 1)
            return S(value[0]);
        else
            return value;
    }

private:
    template <class S> struct Forcing {
        S c{}, s{};
        Forcing(double omega, const S& t) {
            using std::cos;
            using std::sin;
            if (omega > 0) {
                c = cos(S(omega) * t);
                s = sin(S(omega) * t);
            }
        }
        S of(double along_cos, double along_sin) const {
            return S(along_cos) * c + S(along_sin) * s;
        }
    };
};

/// What is drawn: a system in its natural units, and how it is disguised. x = size R z, h and t
/// have units of their own.
template <int N, int M> struct Problem {
    Relays<N, M> sys;                 ///< as the engine sees it
    Eigen::Matrix<double, N, N> turn; ///< R, orthogonal but for rounding
    Vec<double, N> size;              ///< powers of two
    double speed = 1;                 ///< natural units of time in one of the engine's
    Vec<double, N> x0;
    double t0 = 0, t_end = 0;
    bool passive = false; ///< solutions are unique
    int start = 0;        ///< which kind
};

/// The same problem in other units, powers of two, so that nothing is rounded.
template <int N, int M>
Problem<N, M> in_other_units(const Problem<N, M>& problem, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto unit = [&] { return std::ldexp(1.0, int(random() % 61) - 30); };
    Problem<N, M> q = problem;
    Vec<double, N> x;
    for (int i = 0; i < N; ++i)
        x[i] = unit();
    const double t = unit();
    Relays<N, M>& z = q.sys;
    z.A = (t * (x.asDiagonal() * z.A * x.cwiseInverse().asDiagonal())).eval();
    z.B = (t * (x.asDiagonal() * z.B)).eval();
    z.e = (t * (x.asDiagonal() * z.e)).eval();
    z.C = (z.C * x.cwiseInverse().asDiagonal()).eval();
    z.omega *= t;
    for (int j = 0; j < M; ++j) {
        const double h = unit();
        z.C.row(j) *= h;
        z.d[j] *= h;
        z.q.row(j) *= h;
    }
    q.speed *= t;
    q.t0 /= t;
    q.t_end /= t;
    q.size = q.size.cwiseProduct(x).eval();
    q.x0 = q.x0.cwiseProduct(x).eval();
    return q;
}

/// Where runs begin.
enum Start { anywhere, on_surface, near_surface, sliding_boundary, on_all, n_starts };

template <int N, int M> class Drawn {
    template <int R, int K> using Matrix = Eigen::Matrix<double, R, K>;

public:
    explicit Drawn(std::uint64_t seed) : random_(seed) {}

    Problem<N, M> problem() {
        Problem<N, M> q;
        Relays<N, M>& z = q.sys;
        // (what is drawn has a name, so that compilers draw in one order)
        const double damping = uniform(-0.2, 0.8);
        z.A = matrix<N, N>() / std::sqrt(double(N)) - damping * Matrix<N, N>::Identity();
        z.C = matrix<M, N>();
        z.C.rowwise().normalize();
        q.passive = M > 1 || chance(0.7);
        if (q.passive) { // B = -Q C^T, Q symmetric and positive
            const Matrix<N, N> root = 0.3 * matrix<N, N>();
            const double least = uniform(0.5, 2);
            z.B = -(least * Matrix<N, N>::Identity() + root * root.transpose()) * z.C.transpose();
        } else {
            z.B = matrix<N, M>();
        }
        z.d = chance(0.3) ? Matrix<M, 1>(Matrix<M, 1>::Zero()) : Matrix<M, 1>(0.3 * matrix<M, 1>());
        z.e.setZero();
        z.q.setZero();
        if (chance(0.4)) {
            z.omega = uniform(0.5, 4);
            z.e = 1.5 * matrix<N, 2>();
            if (chance(0.4))
                z.q = 0.3 * matrix<M, 2>();
            q.t0 = chance(0.5) ? 0 : uniform(0, 100);
        }
        q.t_end = q.t0 + uniform(2, 12);
        const Vec<long double, N> start = start_of(q);
        disguise(q, start);
        return q;
    }

private:
    bool chance(double p) { return uniform(0, 1) < p; }
    double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(random_); }
    template <int R, int K> Matrix<R, K> matrix() {
        Matrix<R, K> m;
        for (Eigen::Index i = 0; i < m.size(); ++i)
            m(i) = normal_(random_);
        return m;
    }

    /// In natural units; what it is on holds to rounding of `long double`.
    Vec<long double, N> start_of(Problem<N, M>& q) {
        q.start = int(random_() % (M > 1 ? n_starts : n_starts - 1));
        const Relays<N, M>& z = q.sys;
        using Long = long double;
        const Vec<Long, N> free = (2 * matrix<N, 1>()).template cast<Long>();
        if (q.start == anywhere)
            return free;
        const Long phase = Long(z.omega) * Long(q.t0), c = std::cos(phase), s = std::sin(phase);
        const Vec<Long, 2> now(c, s);
        const auto C = z.C.template cast<Long>().eval();
        const auto B = z.B.template cast<Long>().eval();
        const auto e = z.e.template cast<Long>().eval();
        const auto moved = z.q.template cast<Long>().eval();
        // rows w x = b that the start satisfies
        using Rows = Eigen::Matrix<Long, Eigen::Dynamic, N>;
        using Numbers = Eigen::Matrix<Long, Eigen::Dynamic, 1>;
        const Vec<Long, M> offset = z.d.template cast<Long>() + moved * now;
        Rows w = C.topRows(q.start == on_all ? M : 1);
        Numbers b = -offset.head(w.rows());
        if (q.start == near_surface) {
            const double side = chance(0.5) ? 1 : -1;
            b[0] += side * std::pow(10, uniform(-17, -3));
        }
        if (q.start == sliding_boundary) { // h_1' = 0 with s_1 = +-1, other sides as they fall
            Long rest = (chance(0.5) ? 1 : -1) * C.row(0).dot(B.col(0)) + C.row(0).dot(e * now) +
                        Long(z.omega) * (c * moved(0, 1) - s * moved(0, 0));
            const Vec<Long, M> h = C * free + offset;
            for (int j = 1; j < M; ++j)
                rest += (h[j] < 0 ? -1 : 1) * C.row(0).dot(B.col(j));
            w.conservativeResize(2, N);
            w.row(1) = C.row(0) * z.A.template cast<Long>();
            b.conservativeResize(2);
            b[1] = -rest;
        }
        const Numbers off = b - w * free;
        return free + w.completeOrthogonalDecomposition().solve(off);
    }

    void disguise(Problem<N, M>& q, const Vec<long double, N>& start) {
        Relays<N, M>& z = q.sys;
        q.turn = Eigen::HouseholderQR<Matrix<N, N>>(matrix<N, N>()).householderQ();
        for (int i = 0; i < N; ++i)
            q.size[i] = std::exp2(std::floor(uniform(-20, 20)));
        q.speed = std::pow(10, uniform(-6, 6));
        const Matrix<N, N> to = q.size.asDiagonal() * q.turn,
                           from = q.turn.transpose() * q.size.cwiseInverse().asDiagonal();
        z.A = (q.speed * to * z.A * from).eval();
        z.B = (q.speed * to * z.B).eval();
        z.e = (q.speed * to * z.e).eval();
        z.C = (z.C * from).eval();
        z.omega *= q.speed;
        q.t0 /= q.speed;
        q.t_end /= q.speed;
        for (int j = 0; j < M; ++j) {
            const double unit = std::pow(10, uniform(-9, 9));
            z.C.row(j) *= unit;
            z.d[j] *= unit;
            z.q.row(j) *= unit;
        }
        q.x0 = (to.template cast<long double>() * start).template cast<double>();
    }

    std::mt19937_64 random_;
    std::normal_distribution<> normal_;
};

} // namespace filippov::stability
