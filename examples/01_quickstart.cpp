// SPDX-License-Identifier: BSD-3-Clause
// A dry friction oscillator sticks and slips: exact event times.
//
// A block on a belt with speed V, held by a spring and driven by A cos(omega t), once gently and
// once hard: the last six events after 120 forcing periods.

#include <filippov/engine/flow.hpp>
#include <filippov/models/oscillator.hpp>

#include <cstdio>
#include <string>

using namespace filippov;

int main() {
    const models::Oscillator block;
    for (const auto& [A, omega] : {std::pair{0.5, 2.94}, std::pair{5.0, 1.72}}) {
        auto p = default_params<models::Oscillator>();
        p[0] = A;
        p[1] = omega;
        const double T = block.period(p);

        EventLog<double, 2, 1> log;
        const auto end = flow<DormandPrince8>(block, p, Vec<double, 2>(0, 0), 0.0, 120 * T,
                                              {.rtol = 1e-11, .atol = 1e-11}, log);

        std::printf("A = %g, omega = %g: %s, %zu events\n", A, omega,
                    std::string(name(end.status)).c_str(), log.events.size() - 2);
        std::printf("  %10s  %-13s  %11s  %11s  %11s\n", "t", "event", "y", "v", "s");
        for (std::size_t i = log.events.size() - 7; i + 1 < log.events.size(); ++i) {
            const auto& e = log.events[i];
            std::printf("  %10.5f  %-13s  %11.5f  %11.5f  %11.5f\n", e.t,
                        std::string(name(e.kind)).c_str(), e.x_right[0], e.x_right[1], e.s);
        }
    }
}
