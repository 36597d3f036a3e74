// SPDX-License-Identifier: BSD-3-Clause
// Slides near two-folds in normal form, in disguise, and what they do by the desingularised field.
#pragma once

#include <filippov/system/system.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <random>

/// Fields of (u, v, h): u = L1 and v = -L2 on h = 0, and
///
///   F1 = (uv + ..., vv + ..., u + g1 h),   F2 = (uu + ..., vu + ..., -v + g2 h),
///
/// the dots linear in (u, v) with coefficients `bend`. The slide times u + v is
///
///   d/dtau (u, v) = v F1 + u F2,   dt/dtau = u + v.
struct Coefficients {
    double uu, uv, vu, vv;
    std::array<double, 8> bend{};
    double g1 = 0, g2 = 0;

    /// The tangential parts of F1 (side 1) and F2.
    template <class S> std::array<S, 2> along(int side, const S& u, const S& v) const {
        const std::size_t k = side == 1 ? 0 : 4;
        return {S(side == 1 ? uv : uu) + S(bend[k]) * u + S(bend[k + 1]) * v,
                S(side == 1 ? vv : vu) + S(bend[k + 2]) * u + S(bend[k + 3]) * v};
    }
};

/// The same in other coordinates and units: with (u, v, h) = y,
///   z = (y0 + c0 y1^2 + o0, y1 + c1 y0 + o1, y2 + c2 y0 y1 + o2),   x = scale z.
struct TwoFoldSystem {
    static constexpr int dim = 3;
    Coefficients c;
    std::array<double, 3> bend{}, offset{}, scale{1, 1, 1};
    double h_scale = 1, t_scale = 1;

    template <class S> std::array<S, 3> normal(const filippov::Vec<S, 3>& x) const {
        const S z0 = x[0] / S(scale[0]) - S(offset[0]), z1 = x[1] / S(scale[1]) - S(offset[1]),
                z2 = x[2] / S(scale[2]) - S(offset[2]);
        // bend[1] shears, so that two equations are to be solved: z1 = y1 + b1 y0 with
        // y0 = z0 - b0 z1^2
        const S y0 = z0 - S(bend[0]) * z1 * z1, y1 = z1 - S(bend[1]) * y0;
        return {y0, y1, z2 - S(bend[2]) * y0 * y1};
    }
    filippov::Vec<double, 3> start(double u, double v) const {
        const double z1 = v + bend[1] * u;
        return {scale[0] * (u + bend[0] * z1 * z1 + offset[0]), scale[1] * (z1 + offset[1]),
                scale[2] * (bend[2] * u * v + offset[2])};
    }
    template <class S> filippov::Vec<S, 3> field(int side, const filippov::Vec<S, 3>& x) const {
        const auto y = normal(x);
        const auto a = c.along(side, y[0], y[1]);
        const S rise = side == 1 ? y[0] + S(c.g1) * y[2] : -y[1] + S(c.g2) * y[2];
        const S z1 = y[1] + S(bend[1]) * y[0], z1_rate = a[1] + S(bend[1]) * a[0];
        filippov::Vec<S, 3> f;
        f[0] = S(scale[0] / t_scale) * (a[0] + S(2 * bend[0]) * z1 * z1_rate);
        f[1] = S(scale[1] / t_scale) * z1_rate;
        f[2] = S(scale[2] / t_scale) * (rise + S(bend[2]) * (a[0] * y[1] + y[0] * a[1]));
        return f;
    }
    template <filippov::Scalar S>
    filippov::Vec<S, 3> f1(const S&, const filippov::Vec<S, 3>& x,
                           const filippov::Vec<S, 0>&) const {
        return field(1, x);
    }
    template <filippov::Scalar S>
    filippov::Vec<S, 3> f2(const S&, const filippov::Vec<S, 3>& x,
                           const filippov::Vec<S, 0>&) const {
        return field(2, x);
    }
    template <filippov::Scalar S>
    S h(const S&, const filippov::Vec<S, 3>& x, const filippov::Vec<S, 0>&) const {
        return S(h_scale) * normal(x)[2];
    }
};

/// How a slide ends.
struct SlideOutcome {
    enum Kind { fold, below, above, none } kind = none;
    long double t = 0, u = 0, v = 0;
};

/// The desingularised field, followed in extended precision by the classical method: to u = 0 or
/// v = 0, to the two-fold, or to where it is plain that the slide leaves.
inline SlideOutcome outcome(const Coefficients& c, double u0, double v0, long double part = 2e-3L) {
    using R = long double;
    using Y = std::array<R, 3>; // u, v, t
    const auto rate = [&](const Y& y) {
        const auto a1 = c.along(1, y[0], y[1]), a2 = c.along(2, y[0], y[1]);
        return Y{y[1] * a1[0] + y[0] * a2[0], y[1] * a1[1] + y[0] * a2[1], y[0] + y[1]};
    };
    const auto plus = [](const Y& a, R s, const Y& b) {
        return Y{a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
    };
    const auto step = [&](const Y& y, R d) {
        const Y k1 = rate(y), k2 = rate(plus(y, d / 2, k1)), k3 = rate(plus(y, d / 2, k2)),
                k4 = rate(plus(y, d, k3));
        return plus(plus(plus(plus(y, d / 6, k1), d / 3, k2), d / 3, k3), d / 6, k4);
    };
    const R size = std::abs(c.uu) + std::abs(c.uv) + std::abs(c.vu) + std::abs(c.vv);
    const R d = part / size, first = u0 + v0;
    Y y{u0, v0, 0};
    for (int k = 0; k < 400'000; ++k) {
        const Y next = step(y, d);
        const int out = next[0] < 0 && next[0] <= next[1] ? 0 : next[1] < 0 ? 1 : -1;
        if (out >= 0) {
            R low = 0, high = d;
            for (int i = 0; i < 60; ++i) {
                const R m = (low + high) / 2;
                (step(y, m)[std::size_t(out)] < 0 ? high : low) = m;
            }
            const Y end = step(y, low);
            return {out == 0 ? SlideOutcome::below : SlideOutcome::above, end[2], end[0], end[1]};
        }
        y = next;
        if (y[0] + y[1] < 1e-9L * first) { // linear from here on
            const R det = R(c.uu) * c.vv - R(c.uv) * c.vu;
            const R left = ((c.uv - c.uu) * y[1] + (c.vu - c.vv) * y[0]) / det;
            return {SlideOutcome::fold, y[2] + left, 0, 0};
        }
        if (y[0] + y[1] > 20 * first)
            break;
    }
    return {SlideOutcome::none, y[2], y[0], y[1]};
}
