// SPDX-License-Identifier: BSD-3-Clause
// The families of the campaign.
#pragma once

#include "belts.hpp"
#include "contacts.hpp"
#include "converters.hpp"
#include "gates.hpp"
#include "lines.hpp"
#include "relays.hpp"
#include "two_folds.hpp"

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
        {"belts", 8, draw_belt},
        {"slides", 8, [](std::uint64_t n) { return RelayDrawn(n, false).problem(); }},
        {"swings", 8, [](std::uint64_t n) { return RelayDrawn(n, true).problem(); }},
        {"ripples", 8, [](std::uint64_t n) { return RelayDrawn::rippled(n).problem(); }},
        {"gates", 8, draw_gate},
        {"contacts", 8, draw_contact},
        {"converters", 8, draw_converter},
        {"several", 8, [](std::uint64_t n) { return RelayDrawn(n, false).two_problem(); }},
        {"two-folds", 8, draw_two_fold},
        {"lines", 8, draw_lines},
    };
    return all;
}

} // namespace filippov::strangers
