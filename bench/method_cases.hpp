// SPDX-License-Identifier: BSD-3-Clause
// What bench_methods runs: problems with known ends, and methods at their settings.
#pragma once

#include <filippov/core/status.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/system/system.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace filippov::bench {

/// One method at one setting.
struct Case {
    std::string problem, method, setting;
    double asked;                  ///< tolerance, or step
    std::function<double()> error; ///< runs; NaN if the run did not end
    double found = 0, ms = 0;
};
using Cases = std::vector<Case>;

inline constexpr double no_answer = std::numeric_limits<double>::quiet_NaN();

inline std::string power(double v) {
    std::ostringstream text;
    text << std::scientific;
    text.precision(0);
    text << v;
    return text.str();
}

/// Where a problem starts, how long it runs, and where it ends.
template <class Sys> struct Problem {
    static constexpr int N = dim_v<Sys>;
    std::string name;
    Sys sys;
    Params<Sys, double> p;
    Vec<double, N> x0;
    double t_end;
    Vec<double, N> end;
    int hardest = 13; ///< tolerances down to 10^-hardest

    double error(Status status, const Vec<double, N>& x) const {
        return status == Status::ok ? (x - end).cwiseAbs().maxCoeff() : no_answer;
    }
};

/// P4 as one field, for methods that evaluate it beyond the surface.
struct DieciLopezField : models::DieciLopez {
    template <Scalar S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const S& s, const Vec<S, 1>& p) const {
        using std::abs;
        return {x[1], -x[0] - s / (S(1) + abs(S(x[1] - p[0])))};
    }
};

} // namespace filippov::bench
