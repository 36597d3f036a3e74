// SPDX-License-Identifier: BSD-3-Clause
// The first step of a direction that leaves rest, where a/|a| turns infinitely fast.
#pragma once

#include <filippov/engine/detail/probed_field.hpp>
#include <filippov/run/path.hpp>
#include <filippov/sliding/rest.hpp>

namespace filippov {

/// The series with which a direction leaves rest, as far as it is good to the tolerance.
template <class Sys, class S> struct PathFromRest final : TriedPath<S, dim_v<Sys>> {
    static constexpr int N = dim_v<Sys>;
    using X = State<Sys, S>;
    using TriedPath<S, N>::dt;
    using TriedPath<S, N>::x1;

    const Place<Sys, S>& at;
    typename LeavingRest<Sys, S>::Series series;

    /// @param longest  step
    PathFromRest(const Place<Sys, S>& place, const LeavingRest<Sys, S>& how, const S& longest)
        : TriedPath<S, N>({.by_method = false, .exact_probes = false, .vouched = false}), at(place),
          series(how.series()) {
        using std::abs;
        using std::cbrt;
        S step = longest;
        for (int k = 0; k < 60; ++k) {
            const X third = how.third_term(series, step),
                    earlier = how.third_term(series, S(step / S(2)));
            const S cube = step * step * step / S(6);
            // (a term may be small by chance once, and what is not finite is too long)
            const S error = std::max(at.norm(X(cube * earlier)), at.norm(X(cube * third)));
            if (error <= S(1) || abs(step) <= S(16) * at.resolution()) {
                series.f2 = all_finite<S, N>(third) ? third : X(X::Constant(S(0)));
                break;
            }
            const S shorter = S(0.8) / cbrt(error);
            step *= shorter > S(0.1) ? shorter : S(0.1);
        }
        shorten(step);
    }

    X operator()(const S& theta) override {
        const S step = theta * dt;
        return project(at.sys, at.held, S(at.clock.local + step), series(at.x, step), at.p,
                       at.scale);
    }
    /// Probes the guards along it.
    void probe(Watch<Sys, S>& guards, const ProbeTimes<S>& times) {
        probed_field(at, guards, [&](auto&& rhs) {
            for (std::size_t k = 1; k <= times.n; ++k)
                rhs.probe(k, S(at.clock.local + times.theta[k] * dt), (*this)(times.theta[k]));
        });
    }
    void store(const StoredPath<S, N>& kept) override {
        kept.polynomial.c[0] = at.x;
        kept.polynomial.c[1] = dt * series.f0;
        kept.polynomial.c[2] = dt * dt / S(2) * series.f1;
        kept.polynomial.c[3] = dt * dt * dt / S(6) * series.f2;
    }
    X end_field() const override { return at.field(S(at.clock.local + dt), x1); }
    void shorten(const S& step) override {
        dt = step;
        x1 = (*this)(S(1));
    }
    void nudge(const S& delta) override { shorten(dt + delta); }
    /// Evaluating again is as cheap.
    S nudge_error(const S&) const override { return std::numeric_limits<S>::infinity(); }
};

} // namespace filippov
