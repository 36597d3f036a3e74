// SPDX-License-Identifier: BSD-3-Clause
// The tableau of Dormand-Prince 5(4).
#pragma once

#include <filippov/methods/runge_kutta.hpp>

namespace filippov {

/// Dormand-Prince 5(4): fifth order, embedded fourth-order error estimate, free fourth-order
/// interpolant.
///
/// @source Dormand & Prince (1980), J. Comp. Appl. Math. 6, 19-26; interpolant and step control:
///         Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5-II.6.
struct DormandPrince5 {
    template <class S, int N> using Stepper = RungeKutta<DormandPrince5, S, N>;

    static constexpr int order = 5;
    static constexpr int stages = 7; ///< the last one is the first of the next step
    static constexpr int extra_stages = 0;
    static constexpr double exponent = 0.2 - 0.75 * 0.04; ///< step ~ err^-exponent
    static constexpr double memory = 0.04;                ///< weight of the previous error (PI)
    static constexpr double min_factor = 0.2, max_factor = 10.0;

    static constexpr long double c[7] = {0, 1 / 5.0L, 3 / 10.0L, 4 / 5.0L, 8 / 9.0L, 1, 1};
    static constexpr long double a[7][7] = {
        {0},
        {1 / 5.0L},
        {3 / 40.0L, 9 / 40.0L},
        {44 / 45.0L, -56 / 15.0L, 32 / 9.0L},
        {19372 / 6561.0L, -25360 / 2187.0L, 64448 / 6561.0L, -212 / 729.0L},
        {9017 / 3168.0L, -355 / 33.0L, 46732 / 5247.0L, 49 / 176.0L, -5103 / 18656.0L},
        {35 / 384.0L, 0, 500 / 1113.0L, 125 / 192.0L, -2187 / 6784.0L, 11 / 84.0L}};

    /// Fifth-order minus fourth-order weights.
    static constexpr long double e[7] = {
        71 / 57600.0L,      0,           -71 / 16695.0L, 71 / 1920.0L,
        -17253 / 339200.0L, 22 / 525.0L, -1 / 40.0L};

    /// Row of the interpolant beyond its cubic Hermite part.
    static constexpr int d_rows = 1;
    static constexpr long double d[1][7] = {
        {-12715105075 / 11282082432.0L, 0, 87487479700 / 32700410799.0L,
         -10690763975 / 1880347072.0L, 701980252875 / 199316789632.0L, -1453857185 / 822651844.0L,
         69997945 / 29380423.0L}};

    /// Square of the root-mean-square error of a step; the weights have the step in them.
    template <class K, class W> static auto squared_error(const K& k, const W& weight) {
        return k.mean_square([](std::size_t j) { return e[j]; }, weight);
    }
};

} // namespace filippov
