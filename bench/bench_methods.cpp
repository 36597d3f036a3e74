// SPDX-License-Identifier: BSD-3-Clause
// Which method takes how long for which error: event-driven, smoothing, time stepping, and loops
// written by hand around other libraries?
//
// Errors are those of the final state, beside the event-driven run of the eighth-order method in
// extended precision; of P1, P2 and P8 beside the exact solution.

#include "measure.hpp"
#include "method_cases.hpp"
#include "rivals/hand_loop.hpp"
#include "rivals/problem_rivals.hpp"
#ifdef FILIPPOV_HAVE_ODEINT
#include "rivals/odeint_loop.hpp"
#endif
#ifdef FILIPPOV_HAVE_GSL
#include "rivals/gsl_loop.hpp"

#include <filippov/gsl/ode.hpp>
#endif
#ifdef FILIPPOV_HAVE_SUNDIALS
#include "rivals/sundials_loop.hpp"
#endif

#include <filippov/engine/flow.hpp>
#include <filippov/engine/time_stepping.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/unit_circle.hpp>
#include <filippov/system/smoothing.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace {

using namespace filippov;
using namespace filippov::bench;

/// The end by the eighth-order method in extended precision.
template <class Sys> Problem<Sys> solved(Problem<Sys> problem) {
    constexpr int N = dim_v<Sys>;
    using R = long double;
    Settings<R, N> settings;
    settings.rtol = 1e-17L;
    settings.atol = AbsoluteTolerance<R, N>(1e-17L);
    const auto r = flow<DormandPrince8>(problem.sys, Params<Sys, R>(problem.p.template cast<R>()),
                                        Vec<R, N>(problem.x0.template cast<R>()), R(0),
                                        R(problem.t_end), settings);
    if (r.status != Status::ok)
        std::printf("%s has no reference: %s\n", problem.name.c_str(), r.message().c_str());
    problem.end = r.x.template cast<double>();
    return problem;
}

template <class Tableau, class Run, class Sys>
double run_error(const Problem<Sys>& q, const Run& sys, double tolerance) {
    Settings<double, dim_v<Sys>> settings;
    settings.rtol = tolerance;
    settings.atol = AbsoluteTolerance<double, dim_v<Sys>>(tolerance);
    settings.max_steps = 1'000'000;
    const auto r = flow<Tableau>(sys, q.p, q.x0, 0.0, q.t_end, settings);
    return q.error(r.status, r.x);
}

template <class Sys> void event_driven(Cases& cases, const Problem<Sys>& q) {
    for (int k = 4; k <= q.hardest; ++k) {
        const double tol = std::pow(10.0, -k);
        cases.push_back({q.name, "dopri5", "tol " + power(tol), tol,
                         [=] { return run_error<DormandPrince5>(q, q.sys, tol); }});
        cases.push_back({q.name, "dop853", "tol " + power(tol), tol,
                         [=] { return run_error<DormandPrince8>(q, q.sys, tol); }});
        cases.push_back({q.name, "rodas5p", "tol " + power(tol), tol,
                         [=] { return run_error<Rodas5P>(q, q.sys, tol); }});
    }
}
template <class Sys> void smoothing(Cases& cases, const Problem<Sys>& q) {
    const auto add = [&](SmoothLaw law, const char* name) {
        for (const double c1 : {1e4, 1e6, 1e8, 1e10}) {
            const double tol = 1 / c1;
            const auto smooth = smoothed(q.sys, {.c1 = c1, .law = law});
            cases.push_back({q.name, name, "c1 " + power(c1), tol,
                             [=] { return run_error<Rodas5P>(q, smooth, tol); }});
        }
    };
    add(SmoothLaw::arctan, "arctan, rodas5p");
    add(SmoothLaw::tanh, "tanh, rodas5p");
#ifdef FILIPPOV_HAVE_GSL
    for (const double c1 : {1e4, 1e6, 1e8}) {
        const auto smooth = smoothed(q.sys, {.c1 = c1});
        cases.push_back({q.name, "arctan, gsl msbdf", "c1 " + power(c1), 1 / c1, [=] {
                             const auto r =
                                 gsl::run(gsl::Method::msbdf, smooth, q.p, q.x0, 0, q.t_end,
                                          {.rtol = 1 / c1, .atol = 1 / c1, .max_steps = 100'000});
                             return q.error(r.status, r.x);
                         }});
    }
#endif
}
template <class Sys> void steps_in_time(Cases& cases, const Problem<Sys>& q) {
    for (const double theta : {1.0, 0.5})
        for (const double per_unit : {1e2, 1e3, 1e4}) {
            const auto n = static_cast<long long>(per_unit * q.t_end);
            const char* name = theta < 1 ? "stepping, 1/2" : "time stepping";
            cases.push_back({q.name, name, "dt " + power(1 / per_unit), 1 / per_unit, [=] {
                                 const auto r =
                                     time_stepping(q.sys, q.p, q.x0, 0.0, q.t_end,
                                                   {.steps = n, .theta = theta, .keep = n});
                                 return q.error(r.status, r.x.back());
                             }});
        }
}
/// Loops of other people's on the oscillator, with its slides in closed form.
void rivals_of(Cases& cases, const Problem<models::Oscillator>& q, int n_periods) {
    using Loop = rivals::RivalResult (*)(double, double, double, double, int, double);
    std::vector<std::pair<const char*, Loop>> loops{
        {"by hand", [](double A, double omega, double y, double v, int n, double tol) {
             return rivals::hand_loop(A, omega, y, v, n, tol);
         }}};
#ifdef FILIPPOV_HAVE_ODEINT
    loops.push_back({"Boost.odeint", &rivals::odeint_loop});
#endif
#ifdef FILIPPOV_HAVE_GSL
    loops.push_back({"GSL rk8pd", &rivals::gsl_loop});
#endif
#ifdef FILIPPOV_HAVE_SUNDIALS
    using rivals::SundialsMethod;
    loops.push_back(
        {"ARKODE DP5", [](double A, double omega, double y, double v, int n, double tol) {
             return rivals::sundials_loop(SundialsMethod::dormand_prince5, A, omega, y, v, n, tol);
         }});
    loops.push_back(
        {"CVODE Adams", [](double A, double omega, double y, double v, int n, double tol) {
             return rivals::sundials_loop(SundialsMethod::adams, A, omega, y, v, n, tol);
         }});
    loops.push_back(
        {"CVODE BDF", [](double A, double omega, double y, double v, int n, double tol) {
             return rivals::sundials_loop(SundialsMethod::bdf, A, omega, y, v, n, tol);
         }});
#endif
    for (const auto& [name, loop] : loops)
        for (int k = 4; k <= 13; ++k) {
            const double tol = std::pow(10.0, -k);
            cases.push_back({q.name, name, "tol " + power(tol), tol, [=] {
                                 const auto r =
                                     loop(q.p[0], q.p[1], q.x0[0], q.x0[1], n_periods, tol);
                                 return q.error(Status::ok, {r.y, r.v});
                             }});
        }
}

template <class Sys> void all_of_ours(Cases& cases, const Problem<Sys>& q) {
    event_driven(cases, q);
    smoothing(cases, q);
    steps_in_time(cases, q);
}

template <class Sys> void compare(Cases& cases, const Problem<Sys>& q) {
    all_of_ours(cases, q);
    add_rivals(cases, q);
}

Problem<models::Oscillator> oscillator(const char* name, double A, double omega, int n_periods) {
    Problem<models::Oscillator> q{name, {}, default_params<models::Oscillator>(), {0, 0}, 0, {}};
    q.p[0] = A;
    q.p[1] = omega;
    q.t_end = n_periods * q.sys.period(q.p);
    return solved(q);
}

Cases all_cases(bool quick) {
    constexpr double pi = std::numbers::pi;
    Cases cases;
    const int periods = quick ? 20 : 200;
    const auto sticks = oscillator("stick-slip", 0.5, 2.94, periods);
    const auto crosses = oscillator("crossing", 5, 1.6, periods);
    for (const auto& q : {sticks, crosses}) {
        all_of_ours(cases, q);
        rivals_of(cases, q, periods);
    }
    compare(cases, Problem<Blended<models::Coulomb>>{
                       "P1", {}, default_params<models::Coulomb>(), {3, 0}, 20, {-0.2, 0}});
    // exp(pi/2 - 1) at the angle 2 pi (2 - pi/2)
    const double r = std::exp(pi / 2 - 1), angle = pi * pi;
    compare(cases,
            Problem<Blended<models::UnitCircle>>{"P2",
                                                 {},
                                                 default_params<models::UnitCircle>(),
                                                 {std::exp(-1), 0},
                                                 pi / 2,
                                                 {r * std::cos(angle), -r * std::sin(angle)}});
    compare(cases, solved(Problem<DieciLopezField>{
                       "P4", {}, default_params<models::DieciLopez>(), {0, 0}, 50, {}}));
    compare(cases, solved(Problem<Blended<models::Relay>>{
                       "P6", {}, default_params<models::Relay>(), {0, -0.001, -0.02}, 20, {}}));
    Problem<Blended<models::StiffRelay>> stiff{
        "P8", {}, default_params<models::StiffRelay>(), Vec<double, 1>(1), 1.5, {}};
    // before the surface is met, where there is something to be off by
    const double l = 1000;
    stiff.end[0] = (l * l * std::cos(1.5) + l * std::sin(1.5)) / (1 + l * l);
    event_driven(cases, stiff);
    add_rivals(cases, stiff);
    return cases;
}

void time(Cases& cases, int turns) {
    std::vector<std::function<void()>> timed;
    std::vector<int> repeats;
    for (const Case& c : cases) {
        const double start = bench::wall_ms();
        static_cast<void>(c.error());
        const double once = bench::wall_ms() - start;
        const int n = once < 0.5 ? int(std::ceil(0.5 / std::max(once, 1e-4))) : 1;
        repeats.push_back(n);
        timed.push_back([&c, n] {
            for (int k = 0; k < n; ++k)
                static_cast<void>(c.error());
        });
    }
    const auto ms = bench::time_in_turns(timed, turns);
    for (std::size_t i = 0; i < cases.size(); ++i)
        cases[i].ms = ms[i] / repeats[i];
}

std::vector<std::string> distinct(const Cases& cases, std::string Case::* what) {
    std::vector<std::string> all;
    for (const Case& c : cases)
        if (std::find(all.begin(), all.end(), c.*what) == all.end())
            all.push_back(c.*what);
    return all;
}

/// Milliseconds of every method for errors of 1e-4 to 1e-12 at most.
void print_at_errors(const Cases& cases, nlohmann::json& results) {
    for (const std::string& problem : distinct(cases, &Case::problem)) {
        std::printf("\n%s: milliseconds at equal error\n%-20s", problem.c_str(), "error");
        for (int k = 4; k <= 12; k += 2)
            std::printf("     1e-%02d", k);
        std::printf("\n");
        for (const std::string& method : distinct(cases, &Case::method)) {
            std::vector<bench::Point> points;
            for (const Case& c : cases)
                if (c.problem == problem && c.method == method && c.found == c.found)
                    points.push_back({c.found, c.ms});
            if (points.empty())
                continue;
            std::printf("%-20s", method.c_str());
            for (int k = 4; k <= 12; k += 2) {
                const double error = std::pow(10.0, -k);
                const double ms = bench::time_at_error(points, error);
                if (std::isinf(ms))
                    std::printf(" %9s", "-");
                else
                    std::printf(" %9.4f", ms);
                if (!std::isinf(ms))
                    results["at_error"].push_back(
                        {{"problem", problem}, {"method", method}, {"error", error}, {"ms", ms}});
            }
            std::printf("\n");
        }
    }
}

/// True if every run that follows events is as near as its tolerance lets expect: a rival that is
/// not would be a loop with a mistake.
bool check(const Cases& cases) {
    bool right = true;
    for (const Case& c : cases)
        if (c.setting.starts_with("tol") && !(c.found < 1e5 * c.asked)) {
            std::printf("wrong: %s by %s at %s is off by %.1e\n", c.problem.c_str(),
                        c.method.c_str(), c.setting.c_str(), c.found);
            right = false;
        }
    return right;
}

} // namespace

int main(int argc, char** argv) {
    const auto options = bench::parse(argc, argv, "Run time against error of all methods");
    Cases cases = all_cases(options.quick);
    for (Case& c : cases)
        c.found = c.error();
    const bool right = check(cases);
    time(cases, options.turns);
    nlohmann::json results;
    std::printf("%-11s %-18s %-10s %9s %10s\n", "problem", "method", "setting", "error", "ms");
    for (const Case& c : cases) {
        std::printf("%-11s %-18s %-10s %9.1e %10.4f\n", c.problem.c_str(), c.method.c_str(),
                    c.setting.c_str(), c.found, c.ms);
        results["runs"].push_back({{"problem", c.problem},
                                   {"method", c.method},
                                   {"setting", c.setting},
                                   {"error", c.found},
                                   {"ms", c.ms}});
    }
    print_at_errors(cases, results);
    bench::write_json(options, results);
    return right ? 0 : 1;
}
