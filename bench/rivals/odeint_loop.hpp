// SPDX-License-Identifier: BSD-3-Clause
//
// The oscillator by Boost.odeint's Dormand-Prince 5(4), events and stick phase by hand.

#pragma once

#include "event_loop.hpp"
#include "odeint_integrator.hpp"

namespace filippov::rivals {

/// As hand_loop, integrated by Boost.odeint.
inline RivalResult odeint_loop(double A, double omega, double y0, double v0, int n_periods,
                               double tol) {
    using Integrator = detail::OdeintIntegrator<detail::OneSided>;
    return detail::EventLoop<Integrator>(A, omega, y0, v0, n_periods, tol).run();
}

} // namespace filippov::rivals
