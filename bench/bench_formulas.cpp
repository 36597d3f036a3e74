// SPDX-License-Identifier: BSD-3-Clause
// What does a system of formulas cost, beside the same system compiled?
//
// The chapter's oscillator as one formula, split and run by tapes, and as the model: one trajectory
// of 200 periods, and 10,000 members of an ensemble over one period in lanes. The trajectories have
// the same events and the same steps, to rounding.

#include "../tests/formulas.hpp"
#include "measure.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/dormand_prince5.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

using namespace filippov;

using Model = models::Oscillator;
using Formulas = TapeSystem<2, 1, 32>;
using V2 = Vec<double, 2>;

Settings<double, 2> settings_of(double tol) {
    Settings<double, 2> settings;
    settings.rtol = tol;
    settings.atol = AbsoluteTolerance<double, 2>(tol);
    return settings;
}

struct End {
    V2 x = V2::Zero();
    long long steps = 0;
    std::size_t events = 0;
};
template <class Tableau, class Sys>
End trajectory(const Sys& sys, const Params<Sys, double>& p, double tol) {
    const double T = period(sys, p);
    const auto run = simulate<Tableau, false>(sys, p, V2(0, 0), 0.0, 200 * T, settings_of(tol));
    return {run.result.x, run.result.counters.steps, run.events.size()};
}
/// The sum of the final states of a grid of starts.
template <class Tableau, int W, class Sys>
End cells(const Sys& sys, const Params<Sys, double>& p, double tol, int side) {
    std::vector<Member<2, params_v<Sys>>> members;
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j)
            members.push_back(
                {V2(-4 + 8 * (i + 0.5) / side, -3 + 7 * (j + 0.5) / side), p, 0, period(sys, p)});
    Parallel one;
    one.threads = 1;
    const auto all = ensemble<Tableau, W>(sys, members, settings_of(tol), one);
    End end;
    for (const auto& o : all.outcomes) {
        end.x += o.x;
        end.events += std::size_t(o.events);
    }
    return end;
}

bool same(const End& a, const End& b, double tol) {
    return (a.x - b.x).norm() <= tol * (1 + a.x.norm()) && a.events == b.events &&
           std::abs(a.steps - b.steps) <= static_cast<long long>(a.events);
}

/// A line of the table.
void tell(nlohmann::json& results, const char* method, const char* what, double tol,
          const std::vector<double>& ms, bool equal) {
    std::printf("%-8s %-14s  %6.0e  %8.3f %8.3f ms  ratio %.2f\n", method, what, tol, ms[0], ms[1],
                ms[1] / ms[0]);
    results.push_back({{"method", method},
                       {"what", what},
                       {"tol", tol},
                       {"model_ms", ms[0]},
                       {"formulas_ms", ms[1]}});
    if (!equal) {
        std::printf("the two differ\n");
        std::exit(1);
    }
}

template <class Tableau>
void compare(const char* name, const bench::Options& options, nlohmann::json& results) {
    const Model model;
    const Formulas formulas = tests::tape_system<2>(tests::oscillator_formulas());
    for (const double tol : {1e-6, 1e-9, 1e-12}) {
        Params<Model, double> p = default_params<Model>();
        const auto q = all_params<double>(formulas, p);
        End a, b;
        const auto ms = bench::time_in_turns({[&] { a = trajectory<Tableau>(model, p, tol); },
                                              [&] { b = trajectory<Tableau>(formulas, q, tol); }},
                                             options.turns, bench::cpu_ms);
        tell(results, name, "one trajectory", tol, ms, same(a, b, 1e-9));
    }
    for (const double tol : {1e-6, 1e-9}) {
        Params<Model, double> p = default_params<Model>();
        p[0] = 3.6;
        p[1] = 1.067;
        const auto q = all_params<double>(formulas, p);
        const int side = options.quick ? 20 : 100;
        End a, b;
        const auto ms = bench::time_in_turns(
            {[&] { a = cells<Tableau, native_lanes>(model, p, tol, side); },
             [&] { b = cells<Tableau, 2 * native_lanes>(formulas, q, tol, side); }},
            options.turns, bench::cpu_ms);
        tell(results, name, "in lanes", tol, ms, same(a, b, tol));
    }
}

} // namespace

int main(int argc, char** argv) {
    const bench::Options options =
        bench::parse(argc, argv, "What does a system of formulas cost, beside a compiled one?");
    std::printf("%40s %8s\n", "model", "formulas");
    nlohmann::json results;
    compare<DormandPrince5>("dopri5", options, results);
    compare<DormandPrince8>("dop853", options, results);
    bench::write_json(options, results);
}
