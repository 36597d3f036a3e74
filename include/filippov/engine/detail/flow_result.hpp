// SPDX-License-Identifier: BSD-3-Clause
// How a run ended, and what it says of that.
#pragma once

#include <filippov/run/clock.hpp>
#include <filippov/run/report.hpp>

#include <cstdio>
#include <string>

namespace filippov {

/// How a run ended.
template <class S, int N, int M> struct FlowResult {
    Status status = Status::ok;
    S t{};                           ///< absolute time of the last good state
    Clock<S> clock{};                ///< the same as (period index, local time)
    Vec<S, N> x = Vec<S, N>::Zero(); ///< last good state
    Mode<M> mode{};                  ///< mode there
    Counters counters{};
    Diagnosis<S, N, M> diagnosis{}; ///< where and why, if status is not ok
    int surfaces = M;               ///< how many of the modes mean something
    int components = N;             ///< and of the state

    /// What happened, in a sentence or two.
    std::string message() const {
        std::string text(filippov::message(status));
        if (status == Status::ok || status == Status::event)
            return text;
        if (status == Status::ambiguous) {
            text.pop_back();
            text += diagnosis.branches > 1    ? "; choose a branch with on_nonunique."
                    : diagnosis.branches == 1 ? "; on_nonunique = stay stays there all the same."
                                              : ", and no branch is known that goes on.";
        }
        char at[64];
        std::snprintf(at, sizeof at, " At t = %.15Lg", static_cast<long double>(diagnosis.t));
        text += at;
        text += ", x = (";
        for (int i = 0; i < components; ++i) {
            std::snprintf(at, sizeof at, i == 0 ? "%.9Lg" : ", %.9Lg",
                          static_cast<long double>(diagnosis.x[i]));
            text += at;
        }
        text += "), mode (";
        for (int j = 0; j < surfaces; ++j) {
            if (j > 0)
                text += ", ";
            text += std::to_string(diagnosis.mode[j]);
        }
        text += ")";
        if (diagnosis.surface >= 0) {
            text += ", surface ";
            text += std::to_string(diagnosis.surface);
        }
        if (!diagnosis.what.empty()) {
            text += ": ";
            text += diagnosis.what;
        }
        text += ".";
        return text;
    }
};

} // namespace filippov
