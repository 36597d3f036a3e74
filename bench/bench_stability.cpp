// SPDX-License-Identifier: BSD-3-Clause
// Does the engine ever hang, lie or err? Random relay systems, whose solutions are known in closed
// form, in random rotations and units, against an oracle that shares no code with the engine.
//
// How far a run may be off is measured, too: the oracle is run again with an error of the size of
// the tolerance added in every step. Where solutions need not be unique and that changes which
// events happen, the problem is delicate at this tolerance, and only has to end, be finite and say
// something that is true.
#include "measure.hpp"
#include "stability/drift.hpp"
#include "stability/report.hpp"

#include <filippov/core/parallel.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <string>
#include <vector>

namespace {

using namespace filippov;
using namespace filippov::stability;

/// Calls `use` with the numbers of components and surfaces of every shape.
template <class Use> void each_shape(const Use& use) {
    use.template operator()<2, 1>();
    use.template operator()<3, 1>();
    use.template operator()<3, 2>();
    use.template operator()<4, 3>();
}

template <int N, int M> void campaign(long long n, std::uint64_t first, Report& total) {
    std::mutex guard;
    parallel_for(std::size_t(n), {}, [&](std::size_t i, Worker&) {
        Report mine;
        try_problem<N, M>(first + i, mine, false);
        const std::lock_guard lock(guard);
        for (const auto& [key, cell] : mine.cells)
            total.cells[key] += cell;
        for (const auto& [method, units] : mine.units)
            total.units[method] += units;
        for (const std::string& failure : mine.failures)
            total.failures.push_back(failure);
    });
}

/// Problems that were wrong once, beyond those of a quick run.
constexpr const char* were_wrong[] = {"2,1:5487"};

/// "3,2:17": problem 17 of 3 components and 2 surfaces. False if there is no such shape.
/// @param talk  in detail
bool one_case(const std::string& which, Report& report, bool talk) {
    int n = 0, m = 0;
    unsigned long long number = 0;
    bool found = false;
    if (std::sscanf(which.c_str(), "%d,%d:%llu", &n, &m, &number) == 3)
        each_shape([&]<int N, int M>() {
            if (n == N && m == M) {
                try_problem<N, M>(number, report, talk);
                found = true;
            }
        });
    return found;
}

Cell print(Report& report, nlohmann::json& results) {
    std::printf("%-5s %-12s %-6s %9s %9s %9s %8s %8s %6s %8s %8s %8s %9s %9s  %s\n", "shape",
                "method", "tol", "runs", "right", "delicate", "many", "several", "wrong", "median",
                "99.9 %", "worst", "us a run", "longest", "case");
    Cell all;
    for (auto& [key, c] : report.cells) {
        const double median = c.quantile(0.5), high = c.quantile(0.999);
        std::printf("%-5s %-12s %-6s %9lld %9lld %9lld %8lld %8lld %6lld %8.2f %8.2f %8.2f "
                    "%9.1f %9.0f  %llu\n",
                    key[0].c_str(), key[1].c_str(), key[2].c_str(), c.runs(), c.count[right],
                    c.count[delicate], c.count[accumulation], c.count[not_unique], c.count[wrong],
                    median, high, c.worst, 1e6 * c.seconds / double(c.runs()), 1e6 * c.longest,
                    static_cast<unsigned long long>(c.worst_case));
        results["cells"].push_back({{"shape", key[0]},
                                    {"method", key[1]},
                                    {"tolerance", key[2]},
                                    {"runs", c.runs()},
                                    {"right", c.count[right]},
                                    {"delicate", c.count[delicate]},
                                    {"accumulation", c.count[accumulation]},
                                    {"not_unique", c.count[not_unique]},
                                    {"wrong", c.count[wrong]},
                                    {"median", median},
                                    {"q999", high},
                                    {"worst", c.worst},
                                    {"seconds", c.seconds},
                                    {"longest", c.longest},
                                    {"case", c.worst_case}});
        all += c;
    }
    std::printf("\n%lld runs: %lld right (%lld of them on non-unique solutions), %lld delicate, "
                "%lld with more events than the oracle follows, %lld wrong\n",
                all.runs(), all.count[right] + all.count[not_unique], all.count[not_unique],
                all.count[delicate], all.count[accumulation], all.count[wrong]);
    for (const auto& [method, u] : report.units) {
        std::printf("%s in other units: %lld alike to the bit, %lld to rounding, %lld not\n",
                    method.c_str(), u.same, u.close, u.other);
        results["units"].push_back(
            {{"method", method}, {"same", u.same}, {"close", u.close}, {"other", u.other}});
        all.count[wrong] += u.other;
    }
    return all;
}

/// Long slides, a table; how many of them drift by more than their steps' errors may add up to.
template <class Tableau> int long_slides(const char* method, int turns, nlohmann::json& results) {
    int failed = 0;
    for (const double tolerance : {1e-6, 1e-9, 1e-12}) {
        const Drift d = drift_over<Tableau>(turns, tolerance);
        const double bound = tolerance * double(d.steps);
        const bool good = d.status == Status::ok && d.events == 0 && std::abs(d.energy) <= bound &&
                          std::abs(d.phase) <= bound && d.off <= 4e-16;
        failed += !good;
        std::printf("%-8s %5.0e %10lld %11.1e %11.1e %11.1e %11.1e%s\n", method, tolerance, d.steps,
                    d.energy, d.phase, bound, d.off, good ? "" : "  WRONG");
        results["drift"].push_back({{"method", method},
                                    {"tolerance", tolerance},
                                    {"turns", turns},
                                    {"steps", d.steps},
                                    {"energy", d.energy},
                                    {"phase", d.phase},
                                    {"off", d.off}});
    }
    return failed;
}

} // namespace

int main(int argc, char** argv) {
    long long n = 40'000;
    std::uint64_t first = 0;
    std::string which;
    const auto options = bench::parse(
        argc, argv, "Random systems against their exact solutions", [&](CLI::App& app) {
            app.add_option("--problems", n, "how many of each shape")
                ->check(CLI::Range(1, 1 << 30));
            app.add_option("--first", first, "number of the first");
            app.add_option("--case", which, "one problem in detail, as reports name it: 3,2:17");
        });
    Report report;
    if (!which.empty()) {
        if (!one_case(which, report, true)) {
            std::printf("no such case: expected 2,1:n, 3,1:n, 3,2:n or 4,3:n\n");
            return 1;
        }
        for (const std::string& line : report.failures)
            std::printf("%s\n", line.c_str());
        long long n_wrong = 0;
        for (const auto& [key, cell] : report.cells)
            n_wrong += cell.count[wrong];
        return n_wrong == 0 ? 0 : 1;
    }
    const double start = bench::wall_ms();
    if (options.quick) {
        n = 500;
        for (const char* once : were_wrong)
            one_case(once, report, false);
    }
    each_shape([&]<int N, int M>() { campaign<N, M>(n, first, report); });
    nlohmann::json results;
    const Cell all = print(report, results);
    std::printf("%.0f s\n", (bench::wall_ms() - start) / 1e3);
    for (std::size_t i = 0; i < std::min<std::size_t>(report.failures.size(), 40); ++i)
        std::printf("%s\n", report.failures[i].c_str());
    const int turns = options.quick ? 20 : 1'000;
    std::printf("\na slide of %d turns on a curved surface\n%-8s %5s %10s %11s %11s %11s %11s\n",
                turns, "method", "tol", "steps", "energy", "phase", "steps tol", "|h|");
    const int drifted = long_slides<DormandPrince5>("dopri5", turns, results) +
                        long_slides<DormandPrince8>("dop853", turns, results) +
                        long_slides<Rodas5P>("rodas5p", turns, results);
    bench::write_json(options, results);
    return all.count[wrong] == 0 && drifted == 0 ? 0 : 1;
}
