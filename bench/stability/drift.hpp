// SPDX-License-Identifier: BSD-3-Clause
// A slide that lasts thousands of turns and whose energy and phase are known: what drifts?
#pragma once

#include <filippov/engine/flow.hpp>

#include <cmath>
#include <numbers>

namespace filippov::stability {

/// A harmonic oscillator (q, p) in a slide on the curved surface z = q^2/4, from which both fields
/// lead back whatever q and p: |s| <= 0.3.
struct CurvedSlide {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 0> params{};
    template <class S> static Vec<S, 3> field(const Vec<S, 3>& x, double push) {
        using std::cos;
        return {x[1], S(-x[0]), S(x[0] * x[1] / S(2) + S(0.3) * cos(x[0]) + S(push))};
    }
    template <Scalar S> Vec<S, 3> f1(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return field(x, 1);
    }
    template <Scalar S> Vec<S, 3> f2(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return field(x, -1);
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return x[2] - x[0] * x[0] / S(4);
    }
};

/// What is left of q^2 + p^2 = 1, of q + i p = exp(-i t), and of h = 0.
struct Drift {
    Status status;
    long long events, steps;
    double energy; ///< relative
    double phase;  ///< radians
    double off;    ///< the largest |h| at the end of a step
};

template <class Tableau> Drift drift_over(int turns, double tolerance) {
    double off = 0;
    const auto look = [&off](const auto& step, const auto&) {
        const auto& x = step.x1;
        off = std::max(off, std::abs(x[2] - x[0] * x[0] / 4));
    };
    Settings<double, 3> settings;
    settings.rtol = tolerance;
    settings.atol = AbsoluteTolerance<double, 3>(tolerance);
    settings.max_steps = 100'000'000;
    const auto r = flow<Tableau>(CurvedSlide{}, Vec<double, 0>(), Vec<double, 3>(1, 0, 0.25), 0.0,
                                 2 * std::numbers::pi * turns, settings, {.step = look});
    return {r.status,
            r.counters.events,
            r.counters.steps,
            r.x[0] * r.x[0] + r.x[1] * r.x[1] - 1,
            std::atan2(-r.x[1], r.x[0]),
            off};
}

} // namespace filippov::stability
