// SPDX-License-Identifier: BSD-3-Clause
// Systems for tests of the analysis, compiled once for all of them.
#pragma once

#include <filippov/orbits/system_interface.hpp>

#include <memory>

std::shared_ptr<const filippov::AnySystem>
oscillator_system(const filippov::Precision& precision = {});
/// The same with the 5th-order pair.
std::shared_ptr<const filippov::AnySystem>
oscillator_system_5(const filippov::Precision& precision = {});
std::shared_ptr<const filippov::AnySystem>
dieci_lopez_system(const filippov::Precision& precision = {});
std::shared_ptr<const filippov::AnySystem> relay_system(const filippov::Precision& precision = {});
/// x'' + 2 delta x' + k x = cos(omega t), k = 1 for x < 0 and 2 for x > 0; parameters delta, omega.
std::shared_ptr<const filippov::AnySystem>
bilinear_system(const filippov::Precision& precision = {});

/// Parameters of the oscillator (or of a system whose first two are these), else the defaults.
inline filippov::Vector params_at(const filippov::AnySystem& system, double A, double omega) {
    filippov::Vector p = system.defaults();
    p[0] = A;
    p[1] = omega;
    return p;
}
