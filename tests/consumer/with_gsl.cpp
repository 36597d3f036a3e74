// SPDX-License-Identifier: BSD-3-Clause
#include <filippov/gsl/ode.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/system/smoothing.hpp>

int main() {
    using namespace filippov;
    const auto r = gsl::run(gsl::Method::msbdf, smoothed(models::Oscillator{}, {.c1 = 1e3}),
                            default_params<models::Oscillator>(), Vec<double, 2>(0, 0), 0, 1);
    return r.status == Status::ok ? 0 : 1;
}
