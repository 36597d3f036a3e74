// SPDX-License-Identifier: BSD-3-Clause
// How fast linear systems grow. What finds eigenvalues takes longer to compile than what asks it,
// and does so once: for matrices of any size up to one.
#pragma once

#include <filippov/core/config.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <type_traits>

namespace filippov {

/// How fast solutions of x' = A x may grow forwards and backwards in time.
struct GrowthRates {
    double forwards = 0, backwards = 0;
};

/// The largest real parts of the eigenvalues of A and of -A; 0 where they are negative, or not
/// found.
/// @tparam Most  rows that A may have
template <int Most>
GrowthRates
growth_rates(const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, Most>& A) {
    GrowthRates rates;
    if (!A.allFinite())
        return rates;
    const Eigen::EigenSolver<std::decay_t<decltype(A)>> solver(A, false);
    if (solver.info() == Eigen::Success)
        for (const auto& value : solver.eigenvalues()) {
            rates.forwards = std::max(rates.forwards, value.real());
            rates.backwards = std::max(rates.backwards, -value.real());
        }
    return rates;
}

/// The one size of matrices that serves all systems of so many components.
inline constexpr int most_growth_rates = 32;

#if defined(FILIPPOV_COMPILED)
extern template GrowthRates
growth_rates<most_growth_rates>(const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0,
                                                    most_growth_rates, most_growth_rates>&);
#endif

} // namespace filippov
