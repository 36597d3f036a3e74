// SPDX-License-Identifier: BSD-3-Clause
// The chapter's bifurcation points by another route: GSL's hybrid solver, derivatives by
// differences, on the event-driven flow instead of prescribed segments, with the bifurcation's
// point in closed form on the boundary of the sliding region.

#include "run.hpp"
#include "systems.hpp"

#include <filippov/continuation/bifurcation_set.hpp>
#include <filippov/models/oscillator.hpp>

#include <gsl/gsl_errno.h>
#include <gsl/gsl_multiroots.h>
#include <gsl/gsl_vector.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

using namespace filippov;

namespace {

using Unknowns = std::vector<double>;
using Residual = std::function<Unknowns(const Unknowns&)>;

/// gsl_multiroot_fsolver_hybrids: Powell's hybrid method with internal scaling.
Unknowns solve_by_gsl(const Residual& residual, const Unknowns& guess) {
    const std::size_t n = guess.size();
    gsl_multiroot_function function{[](const gsl_vector* x, void* params, gsl_vector* f) {
                                        const auto& r = *static_cast<const Residual*>(params);
                                        const Unknowns value =
                                            r(Unknowns(x->data, x->data + x->size));
                                        for (std::size_t i = 0; i < value.size(); ++i)
                                            gsl_vector_set(f, i, value[i]);
                                        return static_cast<int>(GSL_SUCCESS);
                                    },
                                    n, const_cast<void*>(static_cast<const void*>(&residual))};
    gsl_set_error_handler_off();
    gsl_vector* x = gsl_vector_alloc(n);
    for (std::size_t i = 0; i < n; ++i)
        gsl_vector_set(x, i, guess[i]);
    gsl_multiroot_fsolver* solver = gsl_multiroot_fsolver_alloc(gsl_multiroot_fsolver_hybrids, n);
    gsl_multiroot_fsolver_set(solver, &function, x);
    for (int k = 0; k < 100 && gsl_multiroot_fsolver_iterate(solver) == GSL_SUCCESS; ++k)
        if (gsl_multiroot_test_residual(solver->f, 1e-13) == GSL_SUCCESS)
            break;
    CHECK(gsl_multiroot_test_residual(solver->f, 1e-9) == GSL_SUCCESS);
    const Unknowns root(solver->x->data, solver->x->data + n);
    gsl_multiroot_fsolver_free(solver);
    gsl_vector_free(x);
    return root;
}

Vec<double, 10> params(double A, double omega) {
    auto p = default_params<models::Oscillator>();
    p[0] = A;
    p[1] = omega;
    return p;
}
/// The state `turns` periods after (y, v) at a phase, by the event-driven flow.
Vec<double, 2> return_of(double A, double omega, double phase, const Vec<double, 2>& x, int turns) {
    const double t0 = phase / omega, T = 2 * std::numbers::pi / omega;
    const auto r = run<DormandPrince8>(models::Oscillator{}, params(A, omega), x, t0,
                                       t0 + turns * T, tolerance<2>(1e-13));
    REQUIRE(r.result.status == Status::ok);
    return r.result.x;
}
/// On the boundary s = side at a phase: -y + A cos phi = 4 side, v = V = 1.
Vec<double, 2> boundary(double A, double phase, int side) {
    return {-4.0 * side + A * std::cos(phase), 1};
}

Branch branch_at(double A, double omega, double low, double high) {
    static const auto system = oscillator_system();
    const Orbit orbit = settle(*system, Vector(params(A, omega)), Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    BranchTracer tracer(*system, 1, low, high);
    return tracer.trace(orbit.cycle);
}
SpecialPoint find(const Branch& branch, Kind kind) {
    for (const SpecialPoint& s : branch.special)
        if (s.kind == kind)
            return s;
    FAIL("no " << name(kind));
    return branch.special.front();
}
double phase_of(const SpecialPoint& s) {
    return std::fmod(s.cycle.t[s.node] * s.cycle.p[1], 2 * std::numbers::pi);
}

} // namespace

TEST_CASE("second opinion: crossing- and switching-sliding", "[gsl]") {
    // The orbit starts on the boundary of the sliding region and has to hit the surface there
    // again, from the other side: unknowns omega and the phase. (v itself returns to V with zero
    // slope: it would be a bad equation.)
    const Branch branch = branch_at(5, 1.6, 1.5, 3.2);
    for (const Kind kind : {Kind::crossing_sliding, Kind::switching_sliding}) {
        const SpecialPoint s = find(branch, kind);
        const Residual residual = [&](const Unknowns& z) -> Unknowns {
            const double t0 = z[1] / z[0], T = 2 * std::numbers::pi / z[0];
            const Vec<double, 2> x = boundary(5, z[1], s.side);
            const auto r = run<DormandPrince8>(models::Oscillator{}, params(5, z[0]), x, t0,
                                               t0 + 1.2 * T, tolerance<2>(1e-13));
            Unknowns best{1, 1};
            for (const auto& e : r.events)
                if (e.mode_before[0] == -s.side && std::abs(e.t - t0 - T) < std::abs(best[0]))
                    best = {e.t - t0 - T, e.x_left[0] - x[0]};
            return best;
        };
        const Unknowns root = solve_by_gsl(residual, {s.cycle.p[1] + 1e-4, phase_of(s) - 2e-4});
        CAPTURE(name(kind));
        CHECK(root[0] == Approx(s.cycle.p[1]).epsilon(1e-10));
        CHECK(root[1] == Approx(phase_of(s)).epsilon(1e-9).margin(1e-10));
    }
}

TEST_CASE("second opinion: adding-sliding", "[gsl]") {
    // On the slide v = V and y' = V: the touch is where 1 + A omega sin phi = 0, and only omega is
    // unknown. (The orbit takes four periods.)
    const SpecialPoint s = find(branch_at(0.5, 2.94, 2.84, 2.98), Kind::adding_sliding);
    const auto touch = [](double omega) {
        return std::numbers::pi + std::asin(1 / (0.5 * omega)); // rising through -1/(A omega)
    };
    const Residual residual = [&](const Unknowns& z) -> Unknowns {
        const Vec<double, 2> x = boundary(0.5, touch(z[0]), -1);
        return {return_of(0.5, z[0], touch(z[0]), x, 4)[0] - x[0]};
    };
    CHECK(touch(s.cycle.p[1]) == Approx(phase_of(s)).epsilon(1e-10));
    const Unknowns root = solve_by_gsl(residual, {s.cycle.p[1] + 1e-4});
    CHECK(root[0] == Approx(s.cycle.p[1]).epsilon(1e-10));
}

TEST_CASE("second opinion: the three orbits of figure 4.16", "[gsl]") {
    const auto system = oscillator_system();
    for (const auto& [y, v] : {std::pair{-0.685, 3.01}, {-0.445, 1.27}}) {
        Vector guess(2);
        guess << y, v;
        const Orbit orbit = orbit_near(*system, Vector(params(3.6, 1.067)), 0, guess, 1);
        REQUIRE(orbit.status == Status::ok);
        const Residual residual = [](const Unknowns& z) -> Unknowns {
            const Vec<double, 2> x(z[0], z[1]), r = return_of(3.6, 1.067, 0, x, 1);
            return {r[0] - x[0], r[1] - x[1]};
        };
        const Unknowns root = solve_by_gsl(residual, {y, v});
        CHECK(root[0] == Approx(orbit.x_start[0]).epsilon(1e-10));
        CHECK(root[1] == Approx(orbit.x_start[1]).epsilon(1e-10));
    }
}
