// SPDX-License-Identifier: BSD-3-Clause
// The dry friction oscillator as one formula, which is split and run by tapes: one trajectory, and
// many in as many lanes as the Python package takes.

#include "../../tests/formulas.hpp"

#include "cells.hpp"

#include <cmath>

namespace {

using namespace filippov;
using Sys = TapeSystem<2, 1, 32>;

template <class Tableau> bench::Run run(const Sys& sys, const char* method, int digits) {
    const double tol = std::pow(10.0, -digits);
    return {std::string("home, formulas, ") + method + bench::at(digits),
            "home, hand loop" + bench::at(digits), [sys, tol] {
                const Params<Sys, double> p =
                    all_params<double>(sys, default_params<models::Oscillator>());
                const auto r = flow<Tableau>(sys, p, Vec<double, 2>(0, 0), 0.0,
                                             200 * period(sys, p), {.rtol = tol, .atol = tol});
                return r.status == Status::ok && r.counters.events == 100;
            }};
}

} // namespace

int main(int argc, char** argv) {
    const Sys sys = tests::tape_system<2>(tests::oscillator_formulas());
    const auto p = all_params<double>(sys, bench::cell_params());
    constexpr int W = 2 * native_lanes;
    return bench::main_of(
        {run<DormandPrince8>(sys, "dop853", 6), run<DormandPrince8>(sys, "dop853", 9),
         bench::cells<DormandPrince5, W>("cells, formulas, dopri5, 1e-8", sys, p),
         bench::cells<DormandPrince8, W>("cells, formulas, dop853, 1e-8", sys, p)},
        argc, argv);
}
