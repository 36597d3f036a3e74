// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of a run, events included: the same call in dual numbers.
//
// How the end of a run with two slides depends on the start and on the drive's amplitude and
// frequency, beside differences of two runs. A slide forgets where it was entered from: one
// direction of the start has no effect at all.

#include <filippov/engine/variation.hpp>
#include <filippov/models/oscillator.hpp>

#include <cmath>
#include <cstdio>

using namespace filippov;
using D = Dual<double, 4>; // directions: y0, v0, A, omega

int main() {
    const models::Oscillator block;
    const Settings<double, 2> settings{.rtol = 1e-11, .atol = 1e-12};
    auto p = default_params<models::Oscillator>();
    p[0] = 0.5;  // A
    p[1] = 2.94; // omega
    Vec<double, 2> start(0.1, 0.2);
    const double t_end = 14;

    Params<models::Oscillator, D> q;
    for (int k = 0; k < int(q.size()); ++k)
        q[k] = k < 2 ? D::variable(p[k], 2 + k) : D(p[k]);
    const Vec<D, 2> x(D::variable(start[0], 0), D::variable(start[1], 1));
    const auto r = flow<DormandPrince8>(block, q, x, 0, t_end, settings);

    const auto end = [&](int direction, double step) {
        auto p1 = p;
        Vec<double, 2> x1 = start;
        (direction < 2 ? x1[direction] : p1[direction - 2]) += step;
        return flow<DormandPrince8>(block, p1, x1, 0, t_end, settings).x;
    };
    std::printf("end: y = %.9f, v = %.9f\n", r.x[0].v, r.x[1].v);
    std::printf("by         dy          dv          differences\n");
    const char* const names[] = {"y0", "v0", "A", "omega"};
    for (int k = 0; k < 4; ++k) {
        const Vec<double, 2> slope = (end(k, 1e-5) - end(k, -1e-5)) / 2e-5;
        std::printf("%-6s %11.6f %11.6f   %11.6f %11.6f\n", names[k], r.x[0].d[std::size_t(k)],
                    r.x[1].d[std::size_t(k)], slope[0], slope[1]);
    }
}
