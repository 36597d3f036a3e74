// SPDX-License-Identifier: BSD-3-Clause
#include "arguments.hpp"
#include "catch.hpp"

#include <algorithm>
#include <random>

using namespace filippov;

TEST_CASE("arguments: what makes no sense is refused by name, and `{}` are the defaults",
          "[arguments]") {
    const arguments::Judge judge = arguments::judged();
    for (const std::string& fault : judge.faults)
        UNSCOPED_INFO(fault);
    CHECK(judge.faults.empty());
    CHECK(judge.cases > 400);
}

TEST_CASE("OutputTimes: a state for every time, also beside the ends of a run with a period",
          "[arguments]") {
    using models::Oscillator;
    std::mt19937_64 random(20261126);
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    auto p = default_params<Oscillator>();
    int whole = 0; // backwards a run may come to where it is not unique
    for (int run = 0; run < 300; ++run) {
        p[1] = uniform(0.5, 5);
        const double T = 6.283185307179586476925 / p[1];
        // some runs begin or end where a period does, to rounding
        const double t0 = run % 3 == 0 ? T * double(run - 150) : uniform(-50, 50);
        const double span = run % 5 == 0 ? 3 * T : run % 7 == 0 ? 0 : uniform(-10, 10);
        const double t_end = t0 + span;
        const auto within = [&](double t) {
            return std::clamp(t, std::min(t0, t_end), std::max(t0, t_end));
        };
        std::vector<double> times{t0, t_end, within(std::nextafter(t0, t_end)),
                                  within(std::nextafter(t_end, t0))};
        for (int k = 0; k < 5; ++k)
            times.push_back(within(t0 + span * uniform(0, 1)));
        std::sort(times.begin(), times.end());
        if (t_end < t0)
            std::reverse(times.begin(), times.end());
        OutputTimes<double, 2, 1> output{times};
        const auto end = flow(Oscillator{}, p, Vec<double, 2>(0, 0), t0, t_end, {}, output);
        CAPTURE(run, t0, t_end, p[1]);
        if (t_end >= t0)
            REQUIRE(end.status == Status::ok);
        if (end.status != Status::ok)
            continue;
        ++whole;
        REQUIRE(output.states.size() == times.size());
        CHECK(output.modes.size() == times.size());
        CHECK(output.states.front() == Vec<double, 2>(0, 0));
        CHECK(output.states.back() == end.x);
    }
    CHECK(whole > 200);
}
