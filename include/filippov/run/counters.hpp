// SPDX-License-Identifier: BSD-3-Clause
// What a run did, counted.
#pragma once

namespace filippov {

/// Of a run, or of many.
struct Counters {
    long long steps = 0;         ///< accepted steps
    long long rejected = 0;      ///< rejected trial steps
    long long field = 0;         ///< evaluations of a one-sided field
    long long root_searches = 0; ///< steps in which roots were looked for
    long long interpolants = 0;  ///< interpolants built
    long long landings = 0;      ///< trial steps taken to land on events
    long long events = 0;        ///< events logged

    Counters& operator+=(const Counters& other) {
        steps += other.steps;
        rejected += other.rejected;
        field += other.field;
        root_searches += other.root_searches;
        interpolants += other.interpolants;
        landings += other.landings;
        events += other.events;
        return *this;
    }
};

} // namespace filippov
