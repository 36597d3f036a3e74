// SPDX-License-Identifier: BSD-3-Clause
// A bifurcation diagram by brute force: figure 4.5a of the chapter.
//
// The phase at which the block begins to slip, over the frequency of the drive: 200 forcing periods
// to settle, 1000 to look at.

#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/diagram.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

using namespace filippov;

int main() {
    const models::Oscillator block;
    std::vector<Params<models::Oscillator, double>> params;
    for (int i = 0; i <= 200; ++i) {
        params.push_back(default_params<models::Oscillator>());
        params.back()[0] = 0.5;               // A
        params.back()[1] = 2.84 + 0.0005 * i; // omega
    }
    DiagramSettings<double, 2> settings;
    settings.run = {.rtol = 1e-9, .atol = 1e-9};
    settings.section.events = {EventKind::exit_sliding};
    settings.transient = 200;
    settings.keep = 1000;
    const auto values =
        bifurcation_diagram<DormandPrince8>(block, params, Vec<double, 2>(0, 0), settings);

    const auto failed = std::count_if(values.begin(), values.end(),
                                      [](const auto& v) { return v.status != Status::ok; });
    std::printf("%zu values, %td failed\n", values.size(), failed);
    for (const int i : {200, 160, 130, 126, 120, 112, 69, 3}) {
        const auto& value = values[static_cast<std::size_t>(i)];
        std::vector<long> phases; // in thousandths
        for (const auto& point : value.points)
            phases.push_back(std::lround(2000 * std::numbers::pi * point.t_local / value.period));
        std::sort(phases.begin(), phases.end());
        phases.erase(std::unique(phases.begin(), phases.end()), phases.end());
        std::printf("omega = %.4f: %zu phases: [", params[static_cast<std::size_t>(i)][1],
                    phases.size());
        for (std::size_t k = 0; k < phases.size(); ++k)
            std::printf("%s%.3f", k > 0 ? " " : "", 1e-3 * static_cast<double>(phases[k]));
        std::printf("]\n");
    }
}
