// SPDX-License-Identifier: BSD-3-Clause
// Pictures of basins, in units of mapping all of their cells by one period.
#pragma once

#include "measure.hpp"

#include <filippov/basins/basins.hpp>
#include <filippov/basins/refine.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/any_system.hpp>

#include <nlohmann/json.hpp>

#include <cstdio>
#include <vector>

namespace filippov::bench {

/// What a picture of n x n cells costs, and whether all ways give the same one.
struct Pictures {
    bool same = false;
    nlohmann::json results{};
};

inline Pictures pictures(int n, int levels, int turns) {
    const auto system = any_system(models::Oscillator{});
    const auto lanes = any_lanes(models::Oscillator{});
    Vector p = system->defaults();
    p[0] = 3.6;
    p[1] = 1.067;
    const CellGrid grid({0, -4, 4, n}, {1, -3, 4, n});
    BasinSettings settings;
    settings.parallel.threads = 1;
    const auto run = [&](bool times) {
        BasinSettings s = settings;
        s.times = times;
        return BasinFinder(*system, *lanes, grid, p, s).run();
    };
    const Basins direct = run(true), by_exit = run(false);
    const int side = 32 << levels;
    const BasinLabeller labeller(*system, *lanes, grid, direct.attractors, p, settings);
    const auto refined = [&] {
        return refine(labeller, {{-4, -3}, {4, 4}}, {.levels = levels, .audit = 0});
    };
    const Refined fine = refined();
    const auto images = [&] {
        BasinFinder(*system, *lanes, grid, p, settings).images({0, grid.cells()});
    };
    const std::vector<double> ms = time_in_turns(
        {images, [&] { run(true); }, [&] { run(false); }, [&] { refined(); }}, turns, cpu_ms);

    const double share = double(fine.trajectories) / double(side) / double(side);
    std::printf("\n%d x %d cells, dop853, tolerance 1e-08, in units of the image pass, %.0f ms:\n",
                n, n, ms[0]);
    std::printf("  certified basins with times      %6.2f  (%.2f periods a cell)\n", ms[1] / ms[0],
                double(direct.periods) / grid.cells());
    std::printf("  certified basins by the exit     %6.2f  (%.2f periods a cell)\n", ms[2] / ms[0],
                double(by_exit.periods) / grid.cells());
    std::printf("  %d x %d cells by refinement  %6.2f  (%.2f %% of the trajectories)\n", side, side,
                ms[3] / ms[0], 100 * share);
    return {direct.label == by_exit.label && direct.unresolved == 0 && direct.disagreements == 0 &&
                fine.status == Status::ok,
            {{"cells", n},
             {"image_pass_ms", ms[0]},
             {"certified", ms[1] / ms[0]},
             {"by_exit", ms[2] / ms[0]},
             {"refined_side", side},
             {"refined", ms[3] / ms[0]},
             {"refined_share_of_trajectories", share}}};
}

} // namespace filippov::bench
