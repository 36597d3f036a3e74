// SPDX-License-Identifier: BSD-3-Clause
//
// GSL's multistep method for stiff fields, msbdf, by GSL's own driver. Its steps cannot be taken
// again with another length, and it has no dense output: it serves runs that meet no surface, and
// says so of others.

#pragma once

#include "gsl_integrator.hpp"
#include "switched.hpp"

#include <memory>

namespace filippov::rivals {

/// As SwitchedLoop, in the mode in which the run begins.
template <class Sys> class GslMsbdf {
    using X = typename Switched<Sys>::X;
    using Field = SwitchedField<Sys>;

public:
    GslMsbdf(const Switched<Sys>& problem, double tol)
        : problem_(problem), field_{&problem_, 1},
          driver_(gsl_odeiv2_driver_alloc_y_new(&system_, gsl_odeiv2_step_msbdf, first_step, tol,
                                                tol)) {}
    GslMsbdf(const GslMsbdf&) = delete; // GSL is handed its address
    GslMsbdf& operator=(const GslMsbdf&) = delete;

    SwitchedEnd<Sys> run(const X& x0, double t_end) {
        SwitchedEnd<Sys> end;
        end.x = x0;
        double t = 0;
        field_.mode = problem_.first_mode(t, x0);
        gsl_odeiv2_driver_reset_hstart(driver_.get(), first_step);
        const int code = gsl_odeiv2_driver_apply(driver_.get(), &t, t_end, end.x.data());
        end.finished =
            code == GSL_SUCCESS && field_.mode * problem_.sys.h(t, end.x, problem_.p) > 0;
        return end;
    }

private:
    static constexpr double first_step = 1e-6;

    struct Free {
        void operator()(gsl_odeiv2_driver* p) const { gsl_odeiv2_driver_free(p); }
    };

    Switched<Sys> problem_;
    Field field_;
    gsl_odeiv2_system system_{&detail::GslCalls<Field>::field, &detail::GslCalls<Field>::jacobian,
                              std::size_t(Field::dim), &field_};
    std::unique_ptr<gsl_odeiv2_driver, Free> driver_;
};

} // namespace filippov::rivals
