// SPDX-License-Identifier: BSD-3-Clause
// Systems for which nobody has written a loop by hand: a stiff one, one with several surfaces, and
// one whose curved surface has to be looked at closely in short runs.

#include "../../tests/stiff_systems.hpp"
#include "runs.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/unit_circle.hpp>

#include <cmath>

namespace {

using namespace filippov;

bool stiff_actuator() {
    const auto r = flow<Rodas5P>(FastActuator{}, default_params<FastActuator>(),
                                 Vec<double, 3>(1, 0, 0), 0.0, 50.0, {.rtol = 1e-6, .atol = 1e-8});
    return r.status == Status::ok && r.counters.events > 10;
}

bool three_blocks() {
    using Sys = models::BeltChain<3>;
    const Params<Sys, double> p = default_params<Sys>();
    Vec<double, 6> x = Vec<double, 6>::Zero();
    for (int i = 0; i < 3; ++i)
        x[2 * i] = 0.5 - 0.37 * i + 0.05 * i * i;
    const auto r = flow<DormandPrince5>(Sys{}, p, x, 0.0, 30.0, {.rtol = 1e-8, .atol = 1e-10});
    return r.status == Status::ok && r.counters.events > 10;
}

bool unit_circle() {
    using Sys = models::UnitCircle;
    const double t_end = 1.5707963267948966;
    bool crosses = true;
    for (int i = 0; i < 100; ++i) {
        const auto r = flow<DormandPrince8>(Sys{}, default_params<Sys>(),
                                            Vec<double, 2>(std::exp(-1.0 - 1e-3 * i), 0), 0.0,
                                            t_end, {.rtol = 1e-4, .atol = 1e-4});
        crosses = crosses && r.status == Status::ok && r.counters.events == 1;
    }
    return crosses;
}

} // namespace

int main(int argc, char** argv) {
    return bench::main_of({{"stiff actuator, rodas5p, 1e-6", "", stiff_actuator},
                           {"three blocks, dopri5, 1e-8", "", three_blocks},
                           {"unit circle, dop853, 1e-4", "", unit_circle}},
                          argc, argv);
}
