// SPDX-License-Identifier: BSD-3-Clause
// What does the bifurcation diagram of figure 4.5a cost, beside a loop written by hand for it?
//
// A = 0.5, 200 values of omega in [2.84, 2.94], each from (0, 0) over 1200 periods, transitions
// from stick to slip of the last 1000 kept; tolerance 1e-9, one core; then with more threads. One
// value after the other, and side by side in lanes.

#include "measure.hpp"
#include "rivals/hand_loop.hpp"

#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/diagram_in_lanes.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace {

using namespace filippov;
using models::Oscillator;
using P = Params<Oscillator, double>;

constexpr int n_values = 200, n_transient = 200, n_keep = 1000;
constexpr double tolerance = 1e-9;

/// Phases omega t mod 2 pi of the kept transitions, one list a value, and what it took.
struct Diagram {
    std::vector<std::vector<double>> phases = std::vector<std::vector<double>>(n_values);
    long long steps = 0, skipped = 0;
    int repeating = 0;
};

std::vector<P> parameters() {
    std::vector<P> all(n_values, default_params<Oscillator>());
    for (int i = 0; i < n_values; ++i) {
        const auto k = static_cast<std::size_t>(i);
        all[k][0] = 0.5;
        all[k][1] = 2.84 + 0.1 * i / (n_values - 1);
    }
    return all;
}

Diagram by_hand(double tol) {
    Diagram d;
    for (std::size_t i = 0; const P& p : parameters()) {
        auto& phases = d.phases[i++];
        const auto keep = [&](const rivals::detail::Clock& clock, double, double) {
            if (clock.periods_left <= n_keep)
                phases.push_back(clock.phi);
        };
        d.steps += rivals::hand_loop(p[0], p[1], 0, 0, n_transient + n_keep, tol, keep).n_steps;
    }
    return d;
}

template <class Tableau, bool in_lanes = false> Diagram ours(double tol, bool skip, int threads) {
    DiagramSettings<double, 2> settings;
    settings.run.rtol = settings.run.atol[0] = settings.run.atol[1] = tol;
    settings.transient = n_transient;
    settings.keep = n_keep;
    settings.skip_repeats = skip;
    settings.parallel.threads = threads;
    Diagram d;
    const auto params = parameters();
    const Vec<double, 2> x0(0, 0);
    const auto values = [&] {
        if constexpr (in_lanes)
            return bifurcation_diagram_in_lanes<Tableau>(Oscillator{}, params, x0, settings);
        else
            return bifurcation_diagram<Tableau>(Oscillator{}, params, x0, settings);
    }();
    for (std::size_t i = 0; const auto& value : values) {
        for (const auto& point : value.points)
            d.phases[i].push_back(2 * std::numbers::pi * point.t_local / value.period);
        d.steps += value.counters.steps;
        d.skipped += value.skipped;
        d.repeating += value.cycle > 0;
        ++i;
    }
    return d;
}

/// Largest difference of two lists of phases, in order; infinite if they have not as many.
double difference(const std::vector<double>& a, const std::vector<double>& b) {
    if (a.size() != b.size())
        return std::numeric_limits<double>::infinity();
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k)
        largest = std::max(largest, std::abs(std::remainder(a[k] - b[k], 2 * std::numbers::pi)));
    return largest;
}

/// Differences of two diagrams, value by value: the median and the largest.
struct Differences {
    double median = 0, largest = 0;

    Differences() = default;
    Differences(const Diagram& a, const Diagram& b) {
        std::vector<double> each;
        for (std::size_t i = 0; i < n_values; ++i)
            each.push_back(difference(a.phases[i], b.phases[i]));
        std::sort(each.begin(), each.end());
        median = each[n_values / 2];
        largest = each.back();
    }
};

/// True if, where the orbit is simple, the diagram has the chapter's number of distinct phases, and
/// these within 1000 tolerances of the reference: one above omega = 2.9043, two above 2.8943
/// (section 4.6); further down cycles are long and slow, and no bound is known.
bool as_in_the_chapter(const Diagram& d, const Diagram& reference) {
    const auto params = parameters();
    for (std::size_t i = 0; i < n_values; ++i) {
        const double omega = params[i][1];
        if (omega < 2.8948)
            continue;
        std::vector<double> phases = d.phases[i];
        std::sort(phases.begin(), phases.end());
        std::ptrdiff_t n = 1;
        for (std::size_t k = 1; k < phases.size(); ++k)
            n += phases[k] - phases[k - 1] > 1e-5;
        if (n != (omega > 2.9043 ? 1 : 2) ||
            !(difference(d.phases[i], reference.phases[i]) < 1000 * tolerance))
            return false;
    }
    return true;
}

struct Case {
    std::string name;
    int threads;
    std::function<Diagram()> run;
    int without = -1; ///< index of the case that differs in skip_repeats only
    Diagram result{};
    Differences error{};
};

} // namespace

int main(int argc, char** argv) {
    const auto options = bench::parse(argc, argv, "Figure 4.5a beside a loop written by hand");
    std::vector<Case> cases{
        {"hand", 1, [] { return by_hand(tolerance); }},
        {"dopri5", 1, [] { return ours<DormandPrince5>(tolerance, false, 1); }},
        {"dopri5, skip_repeats", 1, [] { return ours<DormandPrince5>(tolerance, true, 1); }, 1},
        {"dop853", 1, [] { return ours<DormandPrince8>(tolerance, false, 1); }},
        {"dop853, skip_repeats", 1, [] { return ours<DormandPrince8>(tolerance, true, 1); }, 3},
        {"dop853, tolerance x 50", 1,
         [] { return ours<DormandPrince8>(50 * tolerance, false, 1); }},
        {"lanes, dopri5", 1, [] { return ours<DormandPrince5, true>(tolerance, false, 1); }},
        {"lanes, dop853", 1, [] { return ours<DormandPrince8, true>(tolerance, false, 1); }},
        // (with `skip_repeats` lanes take other steps: what it changes is no rounding)
        {"lanes, dop853, skip", 1, [] { return ours<DormandPrince8, true>(tolerance, true, 1); }},
    };
    for (int threads = 2; threads <= detail::team_size(options.quick ? 2 : 64, 0); threads *= 2) {
        cases.push_back({"dop853, skip_repeats", threads,
                         [threads] { return ours<DormandPrince8>(tolerance, true, threads); }, 3});
        cases.push_back({"lanes, dop853, skip", threads, [threads] {
                             return ours<DormandPrince8, true>(tolerance, true, threads);
                         }});
    }

    const Diagram reference = ours<DormandPrince8>(1e-13, false, 0);
    bool right = true;
    std::vector<std::function<void()>> runs;
    for (Case& c : cases) {
        c.result = c.run();
        c.error = {c.result, reference};
        right = right && as_in_the_chapter(c.result, reference);
        runs.push_back([&c] { static_cast<void>(c.run()); });
    }
    const auto ms = bench::time_in_turns(runs, options.turns);

    std::printf("%-23s %7s %8s %6s %9s %9s %9s %8s %10s\n", "loop", "threads", "ms", "ratio",
                "error", "worst", "repeating", "skipped", "by skip");
    nlohmann::json rows = nlohmann::json::array();
    for (std::size_t k = 0; k < cases.size(); ++k) {
        const Case& c = cases[k];
        const double ratio = ms[k] / ms[0];
        const double skipped = double(c.result.skipped) / (n_values * (n_transient + n_keep));
        std::printf("%-23s %7d %8.1f %6.2f %9.1e %9.1e %9d %7.0f%%", c.name.c_str(), c.threads,
                    ms[k], ratio, c.error.median, c.error.largest, c.result.repeating,
                    100 * skipped);
        double by_skip = 0;
        if (c.without >= 0) {
            by_skip = Differences(c.result, cases[std::size_t(c.without)].result).largest;
            std::printf(" %10.1e", by_skip);
        }
        // copies may differ from what would have come by no more than the error there is
        right = right && by_skip < 10 * tolerance;
        std::printf("\n");
        rows.push_back({{"loop", c.name},
                        {"threads", c.threads},
                        {"ms", ms[k]},
                        {"ratio_to_hand", ratio},
                        {"median_error", c.error.median},
                        {"worst_error", c.error.largest},
                        {"steps", c.result.steps},
                        {"repeating", c.result.repeating},
                        {"skipped", skipped},
                        {"difference_by_skip", by_skip}});
    }
    bench::write_json(options, {{"rows", rows}});
    if (!right)
        std::printf(
            "a diagram is wrong: not the phases of the chapter, or skipping changes them\n");
    return right ? 0 : 1;
}
