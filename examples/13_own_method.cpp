// SPDX-License-Identifier: BSD-3-Clause
// A method of one's own: a tableau is data, and the engine does the rest, events included.
//
// Bogacki-Shampine 3(2) on the driven block, with fixed steps, whose error falls by eight when they
// are halved, although surfaces are met between, and with steps that it chooses itself.

#include <filippov/engine/trajectory.hpp>
#include <filippov/models/oscillator.hpp>

#include <cmath>
#include <cstdio>

using namespace filippov;

/// Bogacki and Shampine (1989), Appl. Math. Lett. 2, 321-325.
struct BogackiShampine3 {
    template <class S, int N> using Stepper = RungeKutta<BogackiShampine3, S, N>;

    static constexpr int order = 3;
    static constexpr int stages = 4; ///< the last one is the first of the next step
    static constexpr int extra_stages = 0;
    static constexpr double exponent = 1 / 3.0, memory = 0; ///< step ~ err^-exponent, no PI control
    static constexpr double min_factor = 0.2, max_factor = 5.0;

    static constexpr long double c[4] = {0, 1 / 2.0L, 3 / 4.0L, 1};
    static constexpr long double a[4][4] = {
        {0}, {1 / 2.0L}, {0, 3 / 4.0L}, {2 / 9.0L, 1 / 3.0L, 4 / 9.0L}};
    /// Third-order minus second-order weights.
    static constexpr long double e[4] = {-5 / 72.0L, 1 / 12.0L, 1 / 9.0L, -1 / 8.0L};
    /// The interpolant is the cubic Hermite polynomial alone, and has no more rows.
    static constexpr int d_rows = 0;

    template <class K, class W> static auto squared_error(const K& k, const W& weight) {
        return k.mean_square([](std::size_t j) { return e[j]; }, weight);
    }
};

int main() {
    const models::Oscillator block;
    const Vec<double, 2> start(0, 0);
    const double t_end = 40;
    const auto end_by = [&]<class Tableau>(Tableau, const Settings<double, 2>& settings) {
        const auto run = simulate<Tableau>(block, {}, start, 0, t_end, settings);
        return std::pair(run.x.back(), run.result.counters.steps);
    };
    const Vec<double, 2> exact = end_by(DormandPrince8{}, {.rtol = 1e-13, .atol = 1e-13}).first;

    std::printf("fixed steps     steps     error   ratio\n");
    double before = 0;
    for (double step = 0.04; step > 0.002; step /= 2) {
        const auto [end, steps] = end_by(BogackiShampine3{}, {.fixed_step = step});
        const double error = (end - exact).cwiseAbs().maxCoeff();
        std::printf("%-11.4g %9lld  %.1e", step, steps, error);
        before > 0 ? std::printf("%8.1f\n", before / error) : std::printf("\n");
        before = error;
    }
    std::printf("tolerance       steps     error\n");
    for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
        const auto [end, steps] =
            end_by(BogackiShampine3{}, {.rtol = tolerance, .atol = tolerance});
        std::printf("%-11.0e %9lld  %.1e\n", tolerance, steps, (end - exact).cwiseAbs().maxCoeff());
    }
}
