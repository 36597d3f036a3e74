// SPDX-License-Identifier: BSD-3-Clause
// Runs of the engine for tests: one observer, so that a file compiles each system and method once.
#pragma once

#include "catch.hpp"

#include <filippov/engine/flow.hpp>

#include <string>
#include <string_view>
#include <vector>

template <class Sys, class S = double> struct Run {
    static constexpr int N = filippov::dim_v<Sys>;
    static constexpr int M = filippov::surfaces_v<Sys>;

    filippov::FlowResult<S, N, M> result;
    std::vector<filippov::Event<S, N, M>> events; ///< from `start` to `end`

    /// Times of all events of one kind.
    std::vector<S> times(filippov::EventKind kind) const {
        std::vector<S> t;
        for (const auto& e : events)
            if (e.kind == kind)
                t.push_back(e.t);
        return t;
    }
};

template <class Tableau, class Sys, class S, int N>
Run<Sys, S> run(const Sys& sys, const filippov::Params<Sys, std::type_identity_t<S>>& p,
                const filippov::Vec<S, N>& x0, std::type_identity_t<S> t0,
                std::type_identity_t<S> t_end, const filippov::Settings<S, N>& settings) {
    filippov::EventLog<S, N, filippov::surfaces_v<Sys>> log;
    const auto result = filippov::flow<Tableau>(sys, p, x0, t0, t_end, settings, log);
    return {result, log.events};
}

/// Settings with rtol = atol.
template <int N, class S = double> filippov::Settings<S, N> tolerance(S each) {
    filippov::Settings<S, N> settings;
    settings.rtol = each;
    settings.atol = filippov::AbsoluteTolerance<S, N>(each);
    settings.max_steps = 10'000'000;
    settings.max_events = 100'000;
    return settings;
}

struct Expected {
    filippov::EventKind kind;
    double t;
};

/// The events between `start` and `end` are these, at these times within `margin`.
template <class Events>
void check_events(const Events& events, const std::vector<Expected>& expected, double margin) {
    REQUIRE(events.size() == expected.size() + 2);
    CHECK(events.front().kind == filippov::EventKind::start);
    CHECK(events.back().kind == filippov::EventKind::end);
    for (std::size_t i = 0; i < expected.size(); ++i) {
        INFO("event " << i << ", " << name(events[i + 1].kind));
        CHECK(name(events[i + 1].kind) == name(expected[i].kind));
        CHECK(static_cast<double>(events[i + 1].t) ==
              Approx(expected[i].t).epsilon(0).margin(margin));
    }
}
