// SPDX-License-Identifier: BSD-3-Clause
// Timing that survives a noisy machine, and the command line that every benchmark has.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

namespace filippov::bench {

struct Options {
    bool quick = false; ///< check answers, time once
    std::string json;   ///< write results here as JSON
    int turns = 21;     ///< how often each case is timed
};

/// Parses the options, and what `more` adds to them; on --help or a mistake the program ends.
inline Options parse(int argc, char** argv, const std::string& question,
                     const std::function<void(CLI::App&)>& more = {}) {
    Options options;
    CLI::App app{question};
    app.add_flag("--quick", options.quick, "check the answers and time each case once");
    app.add_option("--json", options.json, "write the results to this file");
    app.add_option("--turns", options.turns, "how often each case is timed")
        ->check(CLI::Range(1, 10000));
    if (more)
        more(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        std::exit(app.exit(error));
    }
    if (options.quick)
        options.turns = 1;
    return options;
}

/// Milliseconds that pass.
inline double wall_ms() {
    using clock = std::chrono::steady_clock;
    return std::chrono::duration<double, std::milli>(clock::now().time_since_epoch()).count();
}
/// Milliseconds that this program computes, all its threads together: other programs add nothing to
/// them. (With the C library of Windows: that pass.)
inline double cpu_ms() { return 1e3 * double(std::clock()) / CLOCKS_PER_SEC; }

/// Milliseconds of each case, the fastest of several turns; the cases take turns, so that a slow
/// spell of the machine meets all of them.
inline std::vector<double> time_in_turns(const std::vector<std::function<void()>>& cases, int turns,
                                         double (*now)() = wall_ms) {
    std::vector<double> best(cases.size(), std::numeric_limits<double>::infinity());
    for (int turn = 0; turn < turns; ++turn)
        for (std::size_t i = 0; i < cases.size(); ++i) {
            const double start = now();
            cases[i]();
            best[i] = std::min(best[i], now() - start);
        }
    return best;
}

/// What a method reaches at a tolerance, and what it takes.
struct Point {
    double error, ms;
};

/// Time for at most a given error, on the lower envelope of a method's points in the order of their
/// tolerances, log-log interpolated; infinite where none has so small an error.
inline double time_at_error(const std::vector<Point>& points, double error) {
    double best = std::numeric_limits<double>::infinity();
    const Point* previous = nullptr;
    for (const Point& point : points) {
        if (point.error <= error)
            best = std::min(best, point.ms);
        if (previous && (previous->error - error) * (point.error - error) < 0) {
            const double u =
                std::log(previous->error / error) / std::log(previous->error / point.error);
            best = std::min(
                best, std::exp(std::log(previous->ms) + u * std::log(point.ms / previous->ms)));
        }
        previous = &point;
    }
    return best;
}

inline void write_json(const Options& options, const nlohmann::json& results) {
    if (options.json.empty())
        return;
    std::ofstream file(options.json);
    file << results.dump(2) << "\n";
    if (!file) {
        std::cerr << "could not write " << options.json << "\n";
        std::exit(1);
    }
    std::cout << "results written to " << options.json << "\n";
}

} // namespace filippov::bench
