// SPDX-License-Identifier: BSD-3-Clause
//
// The oscillator by GSL's Prince-Dormand 8(9), rk8pd, events and stick phase by hand.

#pragma once

#include "event_loop.hpp"
#include "gsl_integrator.hpp"

namespace filippov::rivals {

/// As hand_loop, integrated by GSL's rk8pd.
inline RivalResult gsl_loop(double A, double omega, double y0, double v0, int n_periods,
                            double tol) {
    using Integrator = detail::GslIntegrator<detail::OneSided>;
    return detail::EventLoop<Integrator>(A, omega, y0, v0, n_periods, tol).run();
}

} // namespace filippov::rivals
