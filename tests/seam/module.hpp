// SPDX-License-Identifier: BSD-3-Clause
// A system for the test of the seam, and what the test asks modules that are compiled apart.
#pragma once

#include <filippov/ensemble/any_lanes.hpp>

#include <array>
#include <memory>
#include <string_view>

namespace seam {

using namespace filippov;

/// An oscillator with dry friction of force F at place 1, and N - 2 components that decay; of one
/// component, only that.
template <int N> struct Chain {
    static constexpr int dim = N;
    static constexpr std::array<std::string_view, 2> params{"F", "decay"};
    template <class S> using X = Vec<S, N>;
    template <class S> using Q = Vec<S, 2>;

    template <Scalar S> static X<S> field(const X<S>& x, const Q<S>& p, const S& force) {
        X<S> f;
        for (int i = 0; i < N; ++i)
            f[i] = -p[1] * x[i];
        if constexpr (N > 1) {
            f[0] = x[1];
            f[1] = force - x[0];
        } else {
            f[0] += force;
        }
        return f;
    }
    template <Scalar S> X<S> f1(const S&, const X<S>& x, const Q<S>& p) const {
        return field(x, p, p[0]);
    }
    template <Scalar S> X<S> f2(const S&, const X<S>& x, const Q<S>& p) const {
        return field(x, p, S(-p[0]));
    }
    template <Scalar S> S h(const S&, const X<S>& x, const Q<S>&) const { return x[0] - S(1); }
};

/// The parameters of a stretch.
inline constexpr int n_params = 3;
/// All of a stretch, or of its end, as plain numbers.
struct Sent {
    double t0, dt, x[32], p[n_params];
    long long max_steps, max_events;
    int before, guard;
    bool ends_at_exit;
};
struct Came {
    Status status;
    double period, local, carry, slide_time, x[32];
    long long index, steps;
    int mode, events, slides;
    // of the events that were told of
    int n_told, kind, surface, before, after;
    long long period_told;
    double t_told, x_told[32];
};

// What a module exports.
extern "C" {
/// Tells each fact about its layout.
using Facts = void (*)(void* to, void (*tell)(void* to, const char* what, const char* value));
/// How Eigen aligns a vector of eight numbers there.
using Alignment = std::size_t (*)();
/// Hands a stretch of n components to an engine that was compiled elsewhere, a
/// ScalarEngine<n, n_params>, and tells how it ended.
using HandOver = bool (*)(int n, const void* engine, const Sent* sent, Came* came);
/// Lanes of a Chain<4> or Chain<8>, for an engine that was compiled elsewhere.
using MakeLanes = void (*)(int n, const std::shared_ptr<const AnyScalar>* scalar,
                           std::shared_ptr<const AnyLanes>* lanes);
}

} // namespace seam
