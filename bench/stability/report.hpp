// SPDX-License-Identifier: BSD-3-Clause
// What came of a campaign's problems, and how one is asked for.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <numeric>
#include <string>
#include <vector>

namespace filippov::stability {

/// The stated multiple: of what errors of the tolerance in every step amount to.
constexpr double multiple = 100;

enum Verdict { right, delicate, accumulation, not_unique, wrong, n_verdicts };

struct Cell {
    std::array<long long, n_verdicts> count{};
    double worst = 0;             ///< error in units of the bound
    std::uint64_t worst_case = 0; ///< its number
    std::vector<double> ratios{};
    double seconds = 0, longest = 0; ///< of all runs, and of one

    long long runs() const { return std::accumulate(count.begin(), count.end(), 0LL); }
    /// Of the ratios, which change their order.
    double quantile(double q) {
        if (ratios.empty())
            return 0;
        const auto at = ratios.begin() + std::ptrdiff_t(q * double(ratios.size() - 1));
        std::nth_element(ratios.begin(), at, ratios.end());
        return *at;
    }
    void operator+=(const Cell& c) {
        for (std::size_t v = 0; v < n_verdicts; ++v)
            count[v] += c.count[v];
        if (c.worst > worst) {
            worst = c.worst;
            worst_case = c.worst_case;
        }
        seconds += c.seconds;
        longest = std::max(longest, c.longest);
        ratios.insert(ratios.end(), c.ratios.begin(), c.ratios.end());
    }
};
using Key = std::array<std::string, 3>; ///< shape, method, tolerance

/// The same runs in other units: alike to the bit, to rounding, or not.
struct Units {
    long long same = 0, close = 0, other = 0;
    void operator+=(const Units& u) {
        same += u.same;
        close += u.close;
        other += u.other;
    }
};

struct Report {
    std::map<Key, Cell> cells;
    std::map<std::string, Units> units; ///< by method
    std::vector<std::string> failures;
};

inline std::string digits(const char* format, double v) {
    char text[40];
    std::snprintf(text, sizeof text, format, v);
    return text;
}

/// Tries everything with a problem of N components and M surfaces; with `talk` all is reported.
/// Compiled apart, in one_surface.cpp and several_surfaces.cpp: it instantiates most of the engine.
template <int N, int M> void try_problem(std::uint64_t number, Report& report, bool talk);

} // namespace filippov::stability
