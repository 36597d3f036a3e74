// SPDX-License-Identifier: BSD-3-Clause
// The library filippov::compiled: what headers leave to it where FILIPPOV_COMPILED is defined.
#include <filippov/core/growth_rates.hpp>
#include <filippov/orbits/dense.hpp>

template filippov::GrowthRates filippov::growth_rates<filippov::most_growth_rates>(
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, filippov::most_growth_rates,
                        filippov::most_growth_rates>&);
