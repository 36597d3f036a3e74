// SPDX-License-Identifier: BSD-3-Clause
// The families of the campaign.
#pragma once

#include "relays.hpp"

#include <functional>
#include <vector>

namespace filippov::strangers {

struct Family {
    const char* name;
    int runs_a_problem; ///< about
    std::function<std::unique_ptr<Problem>(std::uint64_t)> draw;
};

inline const std::vector<Family>& families() {
    static const std::vector<Family> all{
        {"slides", 8, [](std::uint64_t n) { return RelayDrawn(n, false).problem(); }},
        {"swings", 8, [](std::uint64_t n) { return RelayDrawn(n, true).problem(); }},
    };
    return all;
}

} // namespace filippov::strangers
