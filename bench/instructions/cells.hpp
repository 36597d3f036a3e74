// SPDX-License-Identifier: BSD-3-Clause
// The image pass of a cell map: the centres of 20 x 20 cells of the oscillator at (A, omega) =
// (3.6, 1.067), one forcing period forward.
#pragma once

#include "runs.hpp"

#include <filippov/ensemble/ensemble.hpp>
#include <filippov/models/oscillator.hpp>

namespace filippov::bench {

constexpr int cells_a_side = 20;

inline Vec<double, 2> cell_centre(int i, int j) {
    return {-4 + 8 * (i + 0.5) / cells_a_side, -3 + 7 * (j + 0.5) / cells_a_side};
}
inline Params<models::Oscillator, double> cell_params() {
    auto p = default_params<models::Oscillator>();
    p[0] = 3.6;
    p[1] = 1.067;
    return p;
}

/// In W lanes, tolerance 1e-8.
template <class Tableau, int W, class Sys>
Run cells(const std::string& name, const Sys& sys, const Params<Sys, double>& p) {
    return {name, "cells, hand loop, 1e-8", [sys, p] {
                std::vector<Member<2, params_v<Sys>>> members;
                for (int i = 0; i < cells_a_side; ++i)
                    for (int j = 0; j < cells_a_side; ++j)
                        members.push_back({cell_centre(i, j), p, 0, period(sys, p)});
                Parallel one;
                one.threads = 1;
                const auto all =
                    ensemble<Tableau, W>(sys, members, {.rtol = 1e-8, .atol = 1e-8}, one);
                bool ok = all.status == Status::ok;
                for (const auto& o : all.outcomes)
                    ok = ok && o.status == Status::ok;
                return ok;
            }};
}

} // namespace filippov::bench
