// SPDX-License-Identifier: BSD-3-Clause
// The engine, asked to run a problem. It is compiled once for each kind of system: problems are
// data.
#pragma once

#include "problem.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <limits>

namespace filippov::strangers {

/// The section of a system, if it has one.
template <class Sys> struct Watch {
    static constexpr int capacity = 1;
    const Sys* sys;

    int size() const { return sys->has_section() ? 1 : 0; }
    template <class S, class X, class P> S value(int, const S& t, const X& x, const P&) const {
        return sys->section(t, x);
    }
    int direction(int) const { return 0; }
    bool terminal(int) const { return false; }
};

template <class Sys> Settings<double, Sys::dim> settings_of(const Disguise& d, double tolerance) {
    constexpr int N = Sys::dim;
    Settings<double, N> settings;
    settings.rtol = tolerance;
    Vec<double, N> each;
    for (int i = 0; i < N; ++i)
        each[i] = tolerance * d.size[std::size_t(i)];
    settings.atol = AbsoluteTolerance<double, N>(each);
    settings.max_steps = 2'000'000;
    settings.max_events = 100'000;
    return settings;
}

template <class Tableau, class Sys> Told by_flow(const Sys& sys, const Ask& ask) {
    constexpr int N = Sys::dim, M = surfaces_v<Sys>;
    Told told;
    Observer<double, N, M> observer;
    Mode<M> before{};
    bool begun = false;
    observer.event = [&](const Event<double, N, M>& e) {
        if (e.kind == EventKind::section)
            told.met.push_back(e.t);
        for (int j = 0; j < M && begun; ++j) {
            if (before[j] != e.mode_after[j])
                told.changes.push_back({e.t, j, e.mode_after[j]});
            else if (e.kind == EventKind::jump && e.surface == j)
                told.changes.push_back({e.t, j, 2});
        }
        told.count += begun && before != e.mode_after;
        begun = true;
        before = e.mode_after;
    };
    Vec<double, N> x0;
    for (int i = 0; i < N; ++i)
        x0[i] = ask.x0[std::size_t(i)];
    const auto r =
        flow<Tableau>(sys, Vec<double, 0>(), x0, ask.t0, ask.t_end,
                      settings_of<Sys>(sys.disguise(), ask.tolerance), observer, Watch<Sys>{&sys});
    told.status = r.status;
    told.t = r.t;
    for (int i = 0; i < N; ++i)
        told.x[std::size_t(i)] = r.x[i];
    told.message = r.message();
    return told;
}

template <class Tableau, class Sys> Told by_lanes(const Sys& sys, const Ask& ask) {
    constexpr int N = Sys::dim;
    Vec<double, N> x0, moved;
    for (int i = 0; i < N; ++i) {
        x0[i] = ask.x0[std::size_t(i)];
        moved[i] = x0[i] + sys.disguise().size[std::size_t(i)] / 8;
    }
    // (not alone)
    const double half = ask.t0 + (ask.t_end - ask.t0) / 2;
    const std::vector<Member<N, 0>> members{{moved, {}, ask.t0, half}, {x0, {}, ask.t0, ask.t_end}};
    const auto r = ensemble<Tableau, 8>(
        sys, members, settings_of<Sys>(sys.disguise(), ask.tolerance), Parallel{.threads = 1});
    const auto& o = r.outcomes[1];
    Told told;
    told.has_story = false;
    told.status = o.status;
    told.t = o.clock.absolute();
    told.count = o.events;
    for (int i = 0; i < N; ++i)
        told.x[std::size_t(i)] = o.x[i];
    return told;
}

template <class Sys> Told ask_engine(const Sys& sys, const Ask& ask) {
    switch (ask.method) {
    case Method::dopri5:
        return by_flow<DormandPrince5>(sys, ask);
    case Method::rodas5p:
        return by_flow<Rodas5P>(sys, ask);
    default:
        return ask.in_lanes ? by_lanes<DormandPrince8>(sys, ask)
                            : by_flow<DormandPrince8>(sys, ask);
    }
}

} // namespace filippov::strangers
