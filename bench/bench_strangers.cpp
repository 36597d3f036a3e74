// SPDX-License-Identifier: BSD-3-Clause
// Does the engine err on problems unlike those of bench_stability? Families whose fields are quiet
// while what is watched is not, contacts, clocks, changed variables and two-folds, each against an
// oracle that shares no code with the engine.
#include "measure.hpp"
#include "strangers/families.hpp"
#include "strangers/judge.hpp"
#include "strangers/misses.hpp"

#include <filippov/core/parallel.hpp>

#include <algorithm>
#include <cstdio>
#include <mutex>
#include <string>
#include <vector>

namespace {

using namespace filippov;
using namespace filippov::strangers;

void try_problem(const Family& family, std::uint64_t number, Report& report, bool talk) {
    const auto problem = family.draw(number);
    Trial(family.name, *problem, number, report, talk).run();
}

void add(Report& total, const Report& mine) {
    for (const auto& [key, cell] : mine.cells)
        total.cells[key] += cell;
    total.failures.insert(total.failures.end(), mine.failures.begin(), mine.failures.end());
}

void campaign(const Family& family, std::uint64_t first, long long n, int threads, Report& total) {
    std::mutex guard;
    Parallel how;
    how.threads = threads;
    parallel_for(std::size_t(n), how, [&](std::size_t i, Worker&) {
        Report mine;
        try_problem(family, first + i, mine, false);
        const std::lock_guard lock(guard);
        add(total, mine);
    });
}

/// "slides:17": problem 17 of a family. False if there is no such family.
bool one_case(const std::string& which, Report& report, bool talk) {
    const auto colon = which.find(':');
    for (const Family& family : families())
        if (colon != std::string::npos && which.substr(0, colon) == family.name) {
            try_problem(family, std::stoull(which.substr(colon + 1)), report, talk);
            return true;
        }
    return false;
}

/// One line a family and method; returns the sum of all.
Cell print(Report& report, nlohmann::json& results) {
    std::map<std::array<std::string, 2>, Cell> lines;
    std::map<std::string, Cell> by_family;
    for (const auto& [key, cell] : report.cells) {
        lines[{key[0], key[1]}] += cell;
        by_family[key[0]] += cell;
    }
    std::printf("%-12s %-13s %9s %9s %9s %7s %8s %8s %9s %10s  %s\n", "family", "method", "runs",
                "right", "delicate", "wrong", "median", "worst", "us a run", "longest", "case");
    for (auto& [key, c] : lines) {
        const double median = c.quantile(0.5);
        std::printf("%-12s %-13s %9lld %9lld %9lld %7lld %8.2g %8.2g %9.1f %10.0f  %llu\n",
                    key[0].c_str(), key[1].c_str(), c.runs(), c.count[stability::right],
                    c.count[stability::delicate], c.count[stability::wrong], median, c.worst,
                    1e6 * c.seconds / double(c.runs()), 1e6 * c.longest,
                    static_cast<unsigned long long>(c.worst_case));
        results["cells"].push_back({{"family", key[0]},
                                    {"method", key[1]},
                                    {"runs", c.runs()},
                                    {"right", c.count[stability::right]},
                                    {"delicate", c.count[stability::delicate]},
                                    {"wrong", c.count[stability::wrong]},
                                    {"median", median},
                                    {"worst", c.worst},
                                    {"seconds", c.seconds}});
    }
    Cell all;
    std::printf("\n");
    for (auto& [name, c] : by_family) {
        std::printf("%-12s %9lld runs, %5.2f %% delicate, %lld wrong\n", name.c_str(), c.runs(),
                    100 * double(c.count[stability::delicate]) / double(c.runs()),
                    c.count[stability::wrong]);
        all += c;
    }
    std::printf("\n%lld runs: %lld right, %lld delicate, %lld wrong\n", all.runs(),
                all.count[stability::right], all.count[stability::delicate],
                all.count[stability::wrong]);
    return all;
}

/// The share of short visits beyond zero that each method misses, as a table in Markdown. The
/// tolerance is below the height of each: 3e-10.
void misses(int n, int threads, nlohmann::json& results) {
    constexpr double parts[] = {0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-5};
    constexpr const char* ways[] = {"dopri5", "dop853", "rodas5p", "lanes"};
    std::printf("| what is watched | by |");
    for (const double q : parts)
        std::printf(" %g |", q);
    std::printf("\n|---|---|");
    for ([[maybe_unused]] const double q : parts)
        std::printf("---|");
    std::printf("\n");
    for (const Shape& shape : shapes)
        for (std::size_t way = 0; way < std::size(ways); ++way) {
            std::printf("| %s | %s |", shape.name, ways[way]);
            for (const double q : parts) {
                std::mutex guard;
                int missed = 0;
                Parallel how;
                how.threads = threads;
                parallel_for(std::size_t(n), how, [&](std::size_t i, Worker&) {
                    const Visit visit = draw_visit(shape, q, i);
                    const Told told =
                        visit.problem->ask({way == 3 ? Method::dop853 : Method(way), way == 3,
                                            1e-10, visit.problem->x0, 0, 1});
                    const bool is = is_missed(visit, told);
                    const std::lock_guard lock(guard);
                    missed += is;
                });
                if (missed == 0)
                    std::printf(" 0 |");
                else
                    std::printf(" %.3g %% |", 100.0 * missed / n);
                std::fflush(stdout);
                results["misses"].push_back({{"watched", shape.name},
                                             {"by", ways[way]},
                                             {"part", q},
                                             {"missed", missed},
                                             {"of", n}});
            }
            std::printf("\n");
        }
}

} // namespace

int main(int argc, char** argv) {
    long long runs = 20'000, problems = 0;
    std::uint64_t first = 0;
    int threads = 0, visits = 0;
    std::size_t most_shown = 60;
    std::string which, only;
    const auto options = bench::parse(
        argc, argv, "Problems of other families against their exact solutions", [&](CLI::App& app) {
            app.add_option("--runs", runs, "how many runs of each family, about")
                ->check(CLI::Range(1, 1 << 30));
            app.add_option("--problems", problems, "how many problems of each family, instead");
            app.add_option("--first", first, "number of the first problem");
            app.add_option("--family", only, "one family only, by its name");
            app.add_option("--threads", threads, "threads; 0: as many as there are");
            app.add_option("--misses", visits,
                           "a table instead: how often short visits beyond zero are missed, from "
                           "so many problems a number");
            app.add_option("--show", most_shown, "how many failures are listed");
            app.add_option("--case", which, "one problem in detail, as reports name it: slides:17");
        });
    Report report;
    if (!which.empty()) {
        if (!one_case(which, report, true)) {
            std::printf("no such case: expected name:number, where name is one of");
            for (const Family& family : families())
                std::printf(" %s", family.name);
            std::printf("\n");
            return 1;
        }
        for (const std::string& line : report.failures)
            std::printf("%s\n", line.c_str());
        long long n_wrong = 0;
        for (const auto& [key, cell] : report.cells)
            n_wrong += cell.count[stability::wrong];
        return n_wrong == 0 ? 0 : 1;
    }
    nlohmann::json results;
    if (visits > 0) {
        misses(visits, threads, results);
        bench::write_json(options, results);
        return 0;
    }
    if (options.quick)
        runs = 200;
    const double start = bench::wall_ms();
    bool found = false;
    for (const Family& family : families())
        if (only == family.name || only.empty()) {
            const double begun = bench::wall_ms();
            campaign(family, first, problems > 0 ? problems : runs / family.runs_a_problem + 1,
                     threads, report);
            std::printf("%-12s %.1f s\n", family.name, (bench::wall_ms() - begun) / 1e3);
            found = true;
        }
    if (!found) {
        std::printf("no family is called %s\n", only.c_str());
        return 1;
    }
    const Cell all = print(report, results);
    std::printf("%.0f s\n", (bench::wall_ms() - start) / 1e3);
    for (std::size_t i = 0; i < std::min(report.failures.size(), most_shown); ++i)
        std::printf("%s\n", report.failures[i].c_str());
    bench::write_json(options, results);
    return all.count[stability::wrong] == 0 ? 0 : 1;
}
