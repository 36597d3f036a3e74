// SPDX-License-Identifier: BSD-3-Clause
// A translation unit of its own: compiled beside bench_methods.cpp.

#include "problem_rivals.hpp"

#include "switched_loop.hpp"
#ifdef FILIPPOV_HAVE_ODEINT
#include "odeint_integrator.hpp"
#endif
#ifdef FILIPPOV_HAVE_GSL
#include "gsl_driver.hpp"
#include "gsl_integrator.hpp"
#endif
#ifdef FILIPPOV_HAVE_SUNDIALS
#include "switched_sundials.hpp"
#endif

#include <cmath>
#include <memory>

namespace filippov::bench {
namespace {

using namespace rivals;

template <class Loop, class Sys, class... How>
void add(Cases& cases, const Problem<Sys>& q, const char* name, How... how) {
    for (int k = 4; k <= 13; ++k) {
        const double tol = std::pow(10.0, -k);
        const auto loop = std::make_shared<Loop>(Switched<Sys>{q.sys, q.p}, how..., tol);
        cases.push_back({q.name, name, "tol " + power(tol), tol, [=] {
                             const auto r = loop->run(q.x0, q.t_end);
                             return q.error(r.finished ? Status::ok : Status::not_converged, r.x);
                         }});
    }
}

template <Roots sought = Roots::gaps_and_rates, class Sys>
void add_nonstiff([[maybe_unused]] Cases& cases, [[maybe_unused]] const Problem<Sys>& q) {
    using Field [[maybe_unused]] = SwitchedField<Sys>;
#ifdef FILIPPOV_HAVE_ODEINT
    add<SwitchedLoop<Sys, rivals::detail::OdeintIntegrator<Field>>>(cases, q, "Boost.odeint");
#endif
#ifdef FILIPPOV_HAVE_GSL
    add<SwitchedLoop<Sys, rivals::detail::GslIntegrator<Field>>>(cases, q, "GSL rk8pd");
#endif
#ifdef FILIPPOV_HAVE_SUNDIALS
    using Erk = SundialsSwitched<Sys, rivals::detail::Erk, sought>;
    using Cvode = SundialsSwitched<Sys, rivals::detail::Cvode, sought>;
    add<Erk>(cases, q, "ARKODE DP5", SundialsMethod::dormand_prince5);
    add<Cvode>(cases, q, "CVODE Adams", SundialsMethod::adams);
    add<Cvode>(cases, q, "CVODE BDF", SundialsMethod::bdf);
#endif
}

/// (odeint's rosenbrock4 wants ublas, which is no C++20 in Boost 1.74.)
template <class Sys>
void add_stiff([[maybe_unused]] Cases& cases, [[maybe_unused]] const Problem<Sys>& q) {
#ifdef FILIPPOV_HAVE_GSL
    using Bsimp = rivals::detail::GslIntegrator<SwitchedField<Sys>, rivals::detail::GslBsimp>;
    add<SwitchedLoop<Sys, Bsimp>>(cases, q, "GSL bsimp");
    add<GslMsbdf<Sys>>(cases, q, "GSL msbdf");
#endif
}

} // namespace

void add_rivals(Cases& cases, const Problem<Blended<models::Coulomb>>& problem) {
    add_nonstiff(cases, problem);
}
void add_rivals(Cases& cases, const Problem<Blended<models::UnitCircle>>& problem) {
    add_nonstiff(cases, problem);
}
void add_rivals(Cases& cases, const Problem<DieciLopezField>& problem) {
    add_nonstiff(cases, problem);
}
void add_rivals(Cases& cases, const Problem<Blended<models::Relay>>& problem) {
    add_nonstiff(cases, problem);
}
void add_rivals(Cases& cases, const Problem<Blended<models::StiffRelay>>& problem) {
    add_nonstiff<Roots::gaps>(cases, problem);
    add_stiff(cases, problem);
}

} // namespace filippov::bench
