// SPDX-License-Identifier: BSD-3-Clause
//
// The first zero of an interpolant over a step: what every hand-written event loop needs, whatever
// it follows and whatever integrates it.

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace filippov::rivals::detail {

/// Polynomial of degree 4 on [0,1] in Bernstein form.
using Quartic = std::array<double, 5>;

struct Split {
    Quartic left, right;
};

inline Split split_at(Quartic c, double theta) {
    Split s;
    for (std::size_t level = 0; level < 5; ++level) {
        s.left[level] = c[0];
        s.right[4 - level] = c[4 - level];
        for (std::size_t i = 0; i + level < 4; ++i)
            c[i] += theta * (c[i + 1] - c[i]);
    }
    return s;
}

/// Sign changes of the coefficients of a polynomial that is positive just right of 0 by decree:
/// it bounds the number of roots in (0,1), so a start on the surface is never found again.
inline int sign_changes(const Quartic& c) {
    int n = 0;
    bool positive = true;
    for (const double x : c) {
        if (x == 0.0 || (x > 0.0) == positive)
            continue;
        positive = !positive;
        ++n;
    }
    return n;
}

struct ValueAndSlope {
    double w, dw;
};

/// The one root in (0,1) of w, positive on its left, negative on its right. Newton in a bracket;
/// a Newton step below 1e-9 leaves an error far below rounding.
template <class F> double root_in_bracket(double theta, F&& w_at) {
    double lo = 0.0, hi = 1.0;
    for (int i = 0; i < 60; ++i) {
        const auto [w, dw] = w_at(theta);
        (w > 0.0 ? lo : hi) = theta;
        const double newton = theta - w / dw;
        const bool inside = newton >= lo && newton <= hi;
        if (inside && std::abs(newton - theta) < 1e-9)
            return newton;
        theta = inside ? newton : 0.5 * (lo + hi);
    }
    return theta;
}

inline ValueAndSlope evaluate(Quartic c, double theta) {
    for (std::size_t n = 4; n > 1; --n)
        for (std::size_t i = 0; i < n; ++i)
            c[i] += theta * (c[i + 1] - c[i]);
    const double dw = c[1] - c[0];
    return {c[0] + theta * dw, 4.0 * dw};
}

/// First theta in (0,1] at which the polynomial leaves the positive side; 2 if it never does.
/// Halves until Descartes' rule leaves one root, so that a pair of crossings is not missed.
inline double first_crossing(const Quartic& c) {
    struct Part {
        Quartic c;
        double start, width;
    };
    constexpr double smallest = 1.0 / (1 << 24); // a double root: touches, does not cross
    std::array<Part, 32> stack;
    std::size_t n = 0;
    stack[n++] = {c, 0.0, 1.0};
    while (n > 0) {
        const Part part = stack[--n];
        const int changes = sign_changes(part.c);
        if (changes == 0)
            continue;
        if (changes == 1) {
            const double guess = std::clamp(part.c[0] / (part.c[0] - part.c[4]), 0.0, 1.0);
            const auto w_at = [&](double theta) { return evaluate(part.c, theta); };
            return part.start + part.width * root_in_bracket(guess, w_at);
        }
        if (part.width < smallest)
            continue;
        const double half = 0.5 * part.width;
        const auto [left, right] = split_at(part.c, 0.5);
        stack[n++] = {right, part.start + half, half};
        stack[n++] = {left, part.start, half};
    }
    return c[4] > 0.0 ? 2.0 : 1.0;
}

/// Distance to the surface over one step: Hermite's cubic from values and slopes (per step) at
/// both ends, plus bulge * theta^2 (1 - theta)^2.
struct Gap {
    double w0, dw0, w1, dw1;

    /// No zero in (0,1]: all Bernstein coefficients of the cubic on the positive side. Two
    /// multiplications and compares, and unlike a sign check it sees a dip inside the step.
    bool stays_open() const { return w1 > 0.0 && 3.0 * w0 + dw0 >= 0.0 && 3.0 * w1 - dw1 >= 0.0; }
    Quartic with_bulge(double bulge) const {
        const double b1 = w0 + dw0 / 3.0, b2 = w1 - dw1 / 3.0;
        return {w0, 0.25 * (w0 + 3.0 * b1), 0.5 * (b1 + b2) + bulge / 6.0, 0.25 * (3.0 * b2 + w1),
                w1};
    }
};

enum class Search { nothing, found, retake };

/// What a zero at theta of a step of size h means. A step that starts on the surface and seems to
/// come back at once is too long for the excursion it should resolve: its polynomial has the
/// wrong curvature at the start. It is retaken shorter; below 1e-10 the excursion is rounding.
inline Search judge(const Gap& gap, double theta, double h) {
    if (theta > 1.0)
        return Search::nothing;
    if (gap.w0 != 0.0 || theta > 1e-3)
        return Search::found;
    return h > 1e-10 ? Search::retake : Search::nothing;
}

} // namespace filippov::rivals::detail
