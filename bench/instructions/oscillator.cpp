// SPDX-License-Identifier: BSD-3-Clause
// The dry friction oscillator, by the library and by the loop written by hand for it.

#include "../rivals/hand_loop.hpp"
#include "../rivals/reference_oscillator.hpp"
#include "cells.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/engine/variation.hpp>
#include <filippov/orbits/diagram_in_lanes.hpp>

#include <cmath>

namespace {

using namespace filippov;
using bench::at;
using Sys = models::Oscillator;
using P = Params<Sys, double>;
using X = Vec<double, 2>;

/// Where 200 periods from (0, 0) are looked at.
struct Place {
    const char* name;
    double A, omega;
};
constexpr Place home{"home", 0.5, 2.94}; // two slides in four periods
constexpr Place crossing{"crossing", 5, 1.6};
constexpr int periods = 200;

P params_at(double A, double omega) {
    P p = default_params<Sys>();
    p[0] = A;
    p[1] = omega;
    return p;
}
Settings<double, 2> settings_of(double tol) { return {.rtol = tol, .atol = tol}; }

/// The state is known where the place is home.
bool is_right(const Place& place, double y, double v, double tol) {
    const auto& exact = rivals::reference_home;
    const auto error = std::max(std::abs(y - exact.y), std::abs(v - exact.v));
    return place.A != home.A || error < 100 * tol;
}

std::string hand_name(const Place& place, int digits) {
    return place.name + std::string(", hand loop") + at(digits);
}
bench::Run by_hand(const Place& place, int digits) {
    const double tol = std::pow(10.0, -digits);
    return {hand_name(place, digits), "", [place, tol] {
                const auto r = rivals::hand_loop(place.A, place.omega, 0, 0, periods, tol);
                return r.n_events >= 100 && is_right(place, r.y, r.v, tol);
            }};
}
template <class Tableau> bench::Run plain(const char* method, const Place& place, int digits) {
    const double tol = std::pow(10.0, -digits);
    return {std::string(place.name) + ", " + method + at(digits), hand_name(place, digits),
            [place, tol] {
                const P p = params_at(place.A, place.omega);
                const double t_end = periods * Sys{}.period(p);
                const auto r = flow<Tableau>(Sys{}, p, X(0, 0), 0.0, t_end, settings_of(tol));
                return r.counters.events >= 100 && is_right(place, r.x[0], r.x[1], tol);
            }};
}

bench::Run kept() {
    return {"home, dop853, 1e-9, events logged, dense", hand_name(home, 9), [] {
                const P p = params_at(home.A, home.omega);
                const double t_end = periods * Sys{}.period(p);
                const auto r =
                    simulate<DormandPrince8>(Sys{}, p, X(0, 0), 0.0, t_end, settings_of(1e-9));
                return r.dense() && r.events.size() > 100 &&
                       is_right(home, r.result.x[0], r.result.x[1], 1e-9);
            }};
}

bench::Run derived() {
    using D = Dual<double, 4>; // by y0, v0, A, omega
    return {"home, dop853, 1e-9, four derivatives", hand_name(home, 9), [] {
                const P p = params_at(home.A, home.omega);
                Params<Sys, D> q;
                for (int k = 0; k < int(q.size()); ++k)
                    q[k] = k < 2 ? D::variable(p[k], 2 + k) : D(p[k]);
                const Vec<D, 2> x(D::variable(0, 0), D::variable(0, 1));
                const double t_end = periods * Sys{}.period(p);
                const auto r = flow<DormandPrince8>(Sys{}, q, x, 0, t_end, settings_of(1e-9));
                return is_right(home, r.x[0].v, r.x[1].v, 1e-9) && std::isfinite(r.x[0].d[3]);
            }};
}

constexpr int n_values = 4, transient = 50, keep = 50;
double omega_of(int value) { return 2.84 + 0.1 * value / (n_values - 1); }

bench::Run diagram_by_hand() {
    return {"diagram, hand loop, 1e-9", "", [] {
                std::vector<double> phases;
                for (int i = 0; i < n_values; ++i)
                    rivals::hand_loop(home.A, omega_of(i), 0, 0, transient + keep, 1e-9,
                                      [&](const rivals::detail::Clock& clock, double, double) {
                                          if (clock.periods_left <= keep)
                                              phases.push_back(clock.phi);
                                      });
                return phases.size() >= 50;
            }};
}
/// Every run to its end: where one begins to repeat itself is a matter of rounding.
DiagramSettings<double, 2> diagram_settings() {
    DiagramSettings<double, 2> settings;
    settings.run = settings_of(1e-9);
    settings.transient = transient;
    settings.keep = keep;
    settings.skip_repeats = false;
    settings.parallel.threads = 1;
    return settings;
}
std::vector<P> diagram_values() {
    std::vector<P> values;
    for (int i = 0; i < n_values; ++i)
        values.push_back(params_at(home.A, omega_of(i)));
    return values;
}
bool has_points(const std::vector<DiagramValue<double, 2>>& diagram) {
    std::size_t points = 0;
    for (const auto& value : diagram)
        points += value.points.size();
    return points >= 50;
}
bench::Run diagram() {
    return {"diagram, dop853, 1e-9", "diagram, hand loop, 1e-9", [] {
                return has_points(bifurcation_diagram<DormandPrince8>(Sys{}, diagram_values(),
                                                                      X(0, 0), diagram_settings()));
            }};
}
bench::Run diagram_in_lanes() {
    return {"diagram, lanes, dop853, 1e-9", "diagram, hand loop, 1e-9", [] {
                return has_points(bifurcation_diagram_in_lanes<DormandPrince8>(
                    Sys{}, diagram_values(), X(0, 0), diagram_settings()));
            }};
}

bench::Run cells_by_hand() {
    return {"cells, hand loop, 1e-8", "", [] {
                const P p = bench::cell_params();
                double sum = 0;
                for (int i = 0; i < bench::cells_a_side; ++i)
                    for (int j = 0; j < bench::cells_a_side; ++j) {
                        const X x = bench::cell_centre(i, j);
                        sum += rivals::hand_loop(p[0], p[1], x[0], x[1], 1, 1e-8).y;
                    }
                return std::isfinite(sum);
            }};
}
template <class Tableau> bench::Run cells(const char* method) {
    return bench::cells<Tableau, native_lanes>(std::string("cells, ") + method + ", 1e-8", Sys{},
                                               bench::cell_params());
}

} // namespace

int main(int argc, char** argv) {
    std::vector<bench::Run> runs;
    for (const int digits : {6, 9, 12}) {
        runs.push_back(by_hand(home, digits));
        runs.push_back(plain<DormandPrince5>("dopri5", home, digits));
        runs.push_back(plain<DormandPrince8>("dop853", home, digits));
    }
    runs.push_back(kept());
    runs.push_back(derived());
    runs.push_back(by_hand(crossing, 9));
    runs.push_back(plain<DormandPrince5>("dopri5", crossing, 9));
    runs.push_back(plain<DormandPrince8>("dop853", crossing, 9));
    runs.push_back(diagram_by_hand());
    runs.push_back(diagram());
    runs.push_back(diagram_in_lanes());
    runs.push_back(cells_by_hand());
    runs.push_back(cells<DormandPrince5>("dopri5"));
    runs.push_back(cells<DormandPrince8>("dop853"));
    return bench::main_of(runs, argc, argv);
}
