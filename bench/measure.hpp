// SPDX-License-Identifier: BSD-3-Clause
// Timing that survives a noisy machine, and the command line that every benchmark has.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
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

/// Parses the options; on --help or a mistake the program ends.
inline Options parse(int argc, char** argv, const std::string& question) {
    Options options;
    CLI::App app{question};
    app.add_flag("--quick", options.quick, "check the answers and time each case once");
    app.add_option("--json", options.json, "write the results to this file");
    app.add_option("--turns", options.turns, "how often each case is timed")
        ->check(CLI::Range(1, 10000));
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        std::exit(app.exit(error));
    }
    if (options.quick)
        options.turns = 1;
    return options;
}

/// Milliseconds of each case, the fastest of several turns; the cases take turns, so that a slow
/// spell of the machine meets all of them.
inline std::vector<double> time_in_turns(const std::vector<std::function<void()>>& cases,
                                         int turns) {
    using clock = std::chrono::steady_clock;
    std::vector<double> best(cases.size(), std::numeric_limits<double>::infinity());
    for (int turn = 0; turn < turns; ++turn)
        for (std::size_t i = 0; i < cases.size(); ++i) {
            const auto start = clock::now();
            cases[i]();
            best[i] = std::min(
                best[i], std::chrono::duration<double, std::milli>(clock::now() - start).count());
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
