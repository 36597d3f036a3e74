// SPDX-License-Identifier: BSD-3-Clause
// What the tests of hard cases share: systems written where they are used, and runs that cannot
// hang.
#pragma once

#include "run.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

/// A system made of generic functions of (t, x), all of one type: a file compiles the engine once a
/// dimension and method, however many systems it tries.
template <int N> class AnySystem {
    template <class S>
    using Field = std::function<filippov::Vec<S, N>(const S&, const filippov::Vec<S, N>&)>;
    template <class S> using Switch = std::function<S(const S&, const filippov::Vec<S, N>&)>;
    template <template <class> class F>
    using EachScalar =
        std::tuple<F<double>, F<filippov::Taylor<double, 1>>, F<filippov::Taylor<double, 2>>,
                   F<filippov::Taylor<double, 3>>, F<filippov::Taylor<double, 4>>,
                   F<filippov::Taylor<filippov::Taylor<double, 1>, 1>>>;

    EachScalar<Field> f1_, f2_;
    EachScalar<Switch> h_;

public:
    static constexpr int dim = N;

    template <class F1, class F2, class H>
    AnySystem(F1 f1, F2 f2, H h)
        : f1_{f1, f1, f1, f1, f1, f1}, f2_{f2, f2, f2, f2, f2, f2}, h_{h, h, h, h, h, h} {}

    template <filippov::Scalar S>
    filippov::Vec<S, N> f1(const S& t, const filippov::Vec<S, N>& x,
                           const filippov::Vec<S, 0>&) const {
        return std::get<Field<S>>(f1_)(t, x);
    }
    template <filippov::Scalar S>
    filippov::Vec<S, N> f2(const S& t, const filippov::Vec<S, N>& x,
                           const filippov::Vec<S, 0>&) const {
        return std::get<Field<S>>(f2_)(t, x);
    }
    template <filippov::Scalar S>
    S h(const S& t, const filippov::Vec<S, N>& x, const filippov::Vec<S, 0>&) const {
        return std::get<Switch<S>>(h_)(t, x);
    }
};

using Line = AnySystem<1>;
using Plane = AnySystem<2>;
using V1 = filippov::Vec<double, 1>;
using V2 = filippov::Vec<double, 2>;

constexpr double pi = std::numbers::pi;
constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double inf = std::numeric_limits<double>::infinity();

/// The integral of f from a to b by Simpson's rule on n parts, an even number.
template <class F> double simpson(const F& f, double a, double b, int n) {
    double sum = 0;
    for (int i = 0; i <= n; ++i)
        sum += (i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2) * f(a + (b - a) * i / n);
    return sum * (b - a) / n / 3;
}

/// The value of these components, as the same kind of vector as x.
template <class X, class... C> X like(const X&, const C&... component) {
    using S = typename X::Scalar;
    X v;
    int i = 0;
    ((v[i++] = S(component)), ...);
    return v;
}

/// Settings with rtol = atol and a bound on everything: a case that would go round for ever fails.
template <int N, class S = double>
filippov::Settings<S, N> bounded(S each, long long max_steps = 100'000,
                                 long long max_events = 2'000) {
    filippov::Settings<S, N> settings;
    settings.rtol = each;
    settings.atol = filippov::AbsoluteTolerance<S, N>(each);
    settings.max_steps = max_steps;
    settings.max_events = max_events;
    return settings;
}

constexpr bool changes_mode(filippov::EventKind kind) {
    return kind == filippov::EventKind::cross || kind == filippov::EventKind::enter_sliding ||
           kind == filippov::EventKind::exit_sliding || kind == filippov::EventKind::accumulation;
}

/// What every log obeys: it starts and ends, time does not turn back, modes follow on each other,
/// no two changes of mode at one time, every state is finite.
template <class R> std::string faults(const R& r, int direction = 1) {
    using filippov::EventKind;
    const auto& e = r.events;
    if (e.size() < 2 || e.front().kind != EventKind::start || e.back().kind != EventKind::end)
        return "no start or no end";
    for (int i = 0; i < R::N; ++i)
        if (!std::isfinite(static_cast<double>(r.result.x[i])))
            return "final state is not finite";
    for (std::size_t k = 0; k < e.size(); ++k) {
        for (int i = 0; i < R::N; ++i)
            if (!std::isfinite(static_cast<double>(e[k].x_right[i] + e[k].x_left[i])))
                return "a state is not finite";
        if (k == 0)
            continue;
        if (direction > 0 ? e[k].t < e[k - 1].t : e[k].t > e[k - 1].t)
            return "time turns back";
        if (!(e[k].mode_before == e[k - 1].mode_after))
            return "modes do not follow on each other";
        // (a jump may end on another side)
        if (e[k].kind != EventKind::jump &&
            changes_mode(e[k].kind) == (e[k].mode_before == e[k].mode_after))
            return "kind and modes contradict each other";
        if (changes_mode(e[k].kind) && changes_mode(e[k - 1].kind) && e[k].t == e[k - 1].t &&
            e[k].t_local == e[k - 1].t_local)
            return "two changes of mode at one time";
    }
    return "";
}

/// The kinds of the events between `start` and `end`, as a word.
template <class R> std::string word(const R& r) {
    std::string text;
    for (std::size_t k = 1; k + 1 < r.events.size(); ++k) {
        if (k > 1)
            text += ' ';
        text += name(r.events[k].kind);
    }
    return text;
}

/// A run from time 0, its log checked by `faults`.
template <class T, class Sys, int N>
Run<Sys> follow(const Sys& sys, const filippov::Params<Sys, double>& p,
                const filippov::Vec<double, N>& x0, double t_end,
                const filippov::Settings<double, N>& settings) {
    const auto r = run<T>(sys, p, x0, 0, t_end, settings);
    INFO(r.result.message());
    CHECK(faults(r) == "");
    return r;
}

/// A run of a system without parameters, its log checked by `faults`.
template <class Tableau, int N>
Run<AnySystem<N>> go(const AnySystem<N>& sys, const filippov::Vec<double, N>& x0, double t0,
                     double t_end, const filippov::Settings<double, N>& settings) {
    const auto r = run<Tableau>(sys, filippov::Vec<double, 0>(), x0, t0, t_end, settings);
    INFO(r.result.message());
    CHECK(faults(r, t_end < t0 ? -1 : 1) == "");
    return r;
}
