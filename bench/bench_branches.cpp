// SPDX-License-Identifier: BSD-3-Clause
// What do branches and curves of bifurcations cost, in plain flows of the same orbit over one
// cycle?
//
// Tolerance 1e-12, 8th-order pair. "corrections" counts Newton iterations, each a flow of one cycle
// with derivatives; "flows" is the whole time, with test functions, multipliers and the location of
// all special points, over the time of one plain flow.

#include "measure.hpp"

#include <filippov/continuation/bifurcation_set.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/any_system.hpp>

#include <cmath>
#include <cstdio>
#include <string>

namespace {

using namespace filippov;

struct Case {
    std::string name;
    double A, omega;                ///< of the orbit whose flow is the unit
    double most;                    ///< flows it may cost
    std::function<long long()> run; ///< returns the number of corrections
    long long corrections = 0;
};

Orbit orbit_at(const AnySystem& system, double A, double omega) {
    Vector p = system.defaults();
    p[0] = A;
    p[1] = omega;
    return settle(system, p, Vector::Zero(2));
}

} // namespace

int main(int argc, char** argv) {
    const auto options = bench::parse(argc, argv, "Cost of branches and curves of bifurcations");
    const auto system = any_system(models::Oscillator{});
    bool right = true;
    const auto branch = [&](double A, double omega, double low, double high, std::size_t special) {
        return [=, &right, cycle = orbit_at(*system, A, omega).cycle] {
            const Branch b = BranchTracer(*system, 1, low, high).trace(cycle);
            right = right && b.special.size() == special && b.status == Status::ok;
            return b.corrections;
        };
    };
    const auto box = [&](const Box& b, Kind kind, double omega) {
        return [=, &right] {
            const BifurcationSet set = bifurcation_set(*system, system->defaults(), b);
            bool found = false;
            for (const Curve& curve : set.curves)
                for (const SpecialPoint& s : curve.special)
                    found = found || (s.kind == kind && std::abs(s.cycle.p[1] - omega) < 1e-9);
            right = right && found;
            return set.corrections;
        };
    };
    std::vector<Case> cases{
        {"branch of figure 4.6, A = 0.5", 0.5, 2.94, 2000, branch(0.5, 2.94, 2.84, 2.98, 2)},
        {"branch of figures 4.9-10, A = 5", 5, 1.6, 2000, branch(5, 1.6, 1.5, 3.2, 2)},
        {"figure 4.11, from the model", 4.4, 1.8, 100'000,
         box({{1, 0}, {1.5, 4.0}, {3.2, 5.5}}, Kind::degenerate_switching_sliding, 2.5354291756)},
        {"figure 4.13, from the model", 3.6, 1.067, 100'000,
         box({{1, 0}, {0.9, 3.0}, {1.6, 4.4}}, Kind::cusp, 1.3310364609)},
    };
    constexpr int n_flows = 100; // one is too short for the clock
    std::vector<std::function<void()>> runs;
    for (Case& c : cases) {
        const Orbit orbit = orbit_at(*system, c.A, c.omega);
        runs.push_back([&, orbit] {
            for (int k = 0; k < n_flows; ++k)
                right = system->run(orbit.t_start, orbit.x_start,
                                    orbit.t_start + orbit.cycle.period, orbit.cycle.p)
                                .status == Status::ok &&
                        right;
        });
        runs.push_back([&c] { c.corrections = c.run(); });
    }
    const auto ms = bench::time_in_turns(runs, options.turns);

    std::printf("%-34s %11s %8s %9s %9s\n", "", "corrections", "ms", "flows", "at most");
    nlohmann::json rows = nlohmann::json::array();
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const Case& c = cases[k];
        const double flows = ms[2 * k + 1] / (ms[2 * k] / n_flows);
        std::printf("%-34s %11lld %8.1f %9.0f %9.0f\n", c.name.c_str(), c.corrections,
                    ms[2 * k + 1], flows, c.most);
        rows.push_back({{"case", c.name},
                        {"corrections", c.corrections},
                        {"ms", ms[2 * k + 1]},
                        {"flows", flows},
                        {"at_most", c.most}});
    }
    bench::write_json(options, {{"rows", rows}});
    if (!right)
        std::printf("a special point was not found, or a flow failed\n");
    return right ? 0 : 1;
}
