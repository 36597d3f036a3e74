// SPDX-License-Identifier: BSD-3-Clause
// What does a trajectory cost at which error, beside a loop written by hand for this one problem?
//
// 200 forcing periods of the oscillator at (A, omega) = (0.5, 2.94) from (0, 0), 100 events; error
// of the final state against a reference in quadruple precision.

#include "measure.hpp"
#include "rivals/hand_loop.hpp"
#include "rivals/reference_oscillator.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/models/oscillator.hpp>

#include <cmath>
#include <cstdio>

namespace {

using namespace filippov;

struct Row {
    std::string method;
    double tolerance, error;
    long long steps, rejected, field, root_searches, interpolants, landings, events;
    double ms = 0;
};

double error_of(double y, double v) {
    const auto& ref = rivals::reference_home;
    return static_cast<double>(std::max(std::abs(y - ref.y), std::abs(v - ref.v)));
}

template <class Tableau> Row run(const char* method, double tolerance) {
    const models::Oscillator sys;
    const auto p = default_params<models::Oscillator>();
    const Settings<double, 2> settings{.rtol = tolerance, .atol = tolerance};
    const auto r = flow<Tableau>(sys, p, Vec<double, 2>(0, 0), 0.0, 200 * sys.period(p), settings);
    const Counters& c = r.counters;
    return {method,  tolerance,       error_of(r.x[0], r.x[1]), c.steps,    c.rejected,
            c.field, c.root_searches, c.interpolants,           c.landings, c.events};
}

Row run_hand(double tolerance) {
    const auto r = rivals::hand_loop(0.5, 2.94, 0, 0, 200, tolerance);
    return {"hand", tolerance, error_of(r.y, r.v), r.n_steps, r.n_rejected, r.n_field, -1,
            -1,     -1,        r.n_events};
}

double time_at_error(const std::vector<Row>& rows, const std::string& method, double error) {
    std::vector<bench::Point> points;
    for (const Row& row : rows)
        if (row.method == method)
            points.push_back({row.error, row.ms});
    return bench::time_at_error(points, error);
}

} // namespace

int main(int argc, char** argv) {
    const auto options = bench::parse(argc, argv, "Run time against error of one trajectory");
    std::vector<Row> rows;
    std::vector<std::function<void()>> cases;
    for (const char* method : {"dopri5", "dop853", "hand"})
        for (int k = 4; k <= 13; ++k) {
            const double tolerance = std::pow(10.0, -k);
            const std::string name = method;
            const auto once = [name, tolerance] {
                return name == "hand"     ? run_hand(tolerance)
                       : name == "dopri5" ? run<DormandPrince5>("dopri5", tolerance)
                                          : run<DormandPrince8>("dop853", tolerance);
            };
            rows.push_back(once());
            cases.push_back([once] { static_cast<void>(once()); });
        }
    bool right = true;
    for (const Row& row : rows)
        right = right && row.error < 100 * row.tolerance && row.events == 100;
    const auto ms = bench::time_in_turns(cases, options.turns);
    for (std::size_t i = 0; i < rows.size(); ++i)
        rows[i].ms = ms[i];

    std::printf("%-7s %8s %9s %8s %7s %5s %8s %7s %8s %8s %7s\n", "method", "tol", "error", "ms",
                "steps", "rej", "field", "roots", "no roots", "interp", "landing");
    nlohmann::json results = nlohmann::json::array();
    for (const Row& r : rows) {
        std::printf("%-7s %8.0e %9.1e %8.3f %7lld %5lld %8lld", r.method.c_str(), r.tolerance,
                    r.error, r.ms, r.steps, r.rejected, r.field);
        if (r.root_searches >= 0)
            std::printf(" %7lld %8lld %8lld %7lld", r.root_searches, r.steps - r.root_searches,
                        r.interpolants, r.landings);
        std::printf("\n");
        results.push_back({{"method", r.method},
                           {"tolerance", r.tolerance},
                           {"error", r.error},
                           {"ms", r.ms},
                           {"steps", r.steps},
                           {"rejected", r.rejected},
                           {"field", r.field},
                           {"root_searches", r.root_searches},
                           {"interpolants", r.interpolants},
                           {"landings", r.landings},
                           {"events", r.events}});
    }
    nlohmann::json ratios = nlohmann::json::object();
    std::printf("\ntime at equal error, best method / hand loop\n");
    for (const double error : {1e-6, 1e-9, 1e-12}) {
        const double ours =
            std::min(time_at_error(rows, "dopri5", error), time_at_error(rows, "dop853", error));
        const double ratio = ours / time_at_error(rows, "hand", error);
        char key[16];
        std::snprintf(key, sizeof key, "%.0e", error);
        ratios[key] = ratio;
        std::printf("  error %s: %.2f\n", key, ratio);
    }
    bench::write_json(options, {{"rows", results}, {"ratio_to_hand_at_equal_error", ratios}});
    if (!right)
        std::printf("a run is wrong: error beyond 100 tolerances, or not 100 events\n");
    return right ? 0 : 1;
}
