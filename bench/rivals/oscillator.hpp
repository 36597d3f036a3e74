// SPDX-License-Identifier: BSD-3-Clause
//
// What every hand-written loop for the dry friction oscillator needs, whatever integrates it: the
// end of the stick phase, the decision at the surface; roots.hpp has the rest.

#pragma once

#include "roots.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filippov::rivals {

struct RivalResult {
    double y, v;
    long n_steps, n_rejected, n_field, n_events;
};

namespace detail {

inline constexpr double two_pi = 2.0 * std::numbers::pi;
inline constexpr double belt = 1.0; // V
inline constexpr double edge = 4.0; // (alpha + beta) m g
inline constexpr double gamma = 1.42;

/// Phase of the forcing, kept below 2 pi so that it loses no digits, and the periods still to go.
struct Clock {
    double phi = 0.0;
    int periods_left = 0;

    void advance(double dphi) {
        phi += dphi;
        while (phi >= two_pi) {
            phi -= two_pi;
            --periods_left;
        }
    }
    double phase_left() const { return periods_left * two_pi - phi; }
};

struct StickEnd {
    double duration;
    double side; // +1: leaves into S1 (q = -4), -1: leaves into S2 (q = +4)
};

/// Largest dt in which a gap of curvature at most m, closing at the given rate, must stay open.
inline double safe_time(double gap, double rate, double m) {
    const double root = std::sqrt(rate * rate + 2.0 * m * gap);
    return rate > 0.0 ? 2.0 * gap / (rate + root) : (root - rate) / m;
}

/// First time at which |q| = 4, q = -y + A cos(omega t), while y' = V.
///
/// Marches by steps that cannot pass a root because |q''| <= A omega^2; at a simple root they
/// become Newton's. So the first root is found, however close the second may follow. Where q = 4
/// is out of reach the march starts when q = -4 comes into reach.
inline StickEnd stick_end(double A, double omega, double phi, double y) {
    const double swing = std::abs(A), m = swing * omega * omega + 1e-300;
    double dt = swing - y < edge ? std::max(0.0, (edge - swing - y) / belt) : 0.0;
    for (;;) {
        const double psi = phi + omega * dt;
        const double q = A * std::cos(psi) - (y + belt * dt);
        const double rise = -A * omega * std::sin(psi) - belt;
        if (q <= -edge)
            return {dt, +1.0};
        if (q >= edge)
            return {dt, -1.0};
        const double to_lower = safe_time(q + edge, -rise, m);
        const double to_upper = safe_time(edge - q, rise, m);
        const double step = std::min(to_lower, to_upper);
        dt += step;
        // After such a step less than m step^2/|q'| is left.
        const bool converged =
            m * step * step <= 1e-16 * std::abs(rise) || step < 1e-16 + 4e-16 * dt;
        if (converged)
            return {dt, to_lower < to_upper ? +1.0 : -1.0};
    }
}

enum class Verdict { touches, sticks, crosses };

/// Arrival at the surface out of S1 (side = +1) or S2 (side = -1), from the signs of both normal
/// components, L1 = q + 4 and L2 = q - 4.
inline Verdict arrival(double side, double q) {
    const double towards = side * q; // mirrored, so that the arrival is always out of S1
    if (towards + edge <= 0.0)
        return Verdict::touches;
    return towards - edge < 0.0 ? Verdict::sticks : Verdict::crosses;
}

} // namespace detail
} // namespace filippov::rivals
