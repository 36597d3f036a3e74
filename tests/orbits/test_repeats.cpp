// SPDX-License-Identifier: BSD-3-Clause
// Repetition to rounding, told from slow motion and from a start on an unstable orbit.

#include "catch.hpp"

#include <filippov/orbits/repeats.hpp>

#include <functional>

using namespace filippov;

namespace {

struct Seen {
    int cycle = 0; ///< the first that was reported
    int at = 0;    ///< after how many returns
    double x = 0;  ///< the value there
    long long periods = 0;
};

/// Iterates x -> map(x), one return every second period, until a cycle is reported.
Seen watch(const std::function<double(double)>& map, double x, int n) {
    Repeats<double, 1> repeats(1.0);
    for (int k = 1; k <= n; ++k) {
        if (const int cycle = repeats.add({2 * k, 0.25, Vec<double, 1>(x), 0}))
            return {cycle, k, x, repeats.periods(cycle)};
        x = map(x);
    }
    return {0, n, x, 0};
}

} // namespace

TEST_CASE("repeats: a contraction to a fixed point repeats, once it has arrived", "[repeats]") {
    const Seen seen = watch([](double x) { return 1 + 0.5 * (x - 1); }, 2, 1000);
    CHECK(seen.cycle == 1);
    CHECK(seen.periods == 2);
    CHECK(seen.x == Approx(1).epsilon(1e-14));
    CHECK(seen.at > 50); // it takes 50 halvings to 16 ulp, and then 16 more returns
    CHECK(seen.at < 80);
}

TEST_CASE("repeats: cycles of the logistic map have their length", "[repeats]") {
    // r = 3.2, 3.5, 3.55: attracting cycles of 2, 4, 8; at 3.83 of 3
    for (const auto& [r, length] : {std::pair{3.2, 2}, {3.5, 4}, {3.55, 8}, {3.83, 3}}) {
        const double rate = r;
        INFO("r = " << rate);
        const Seen seen = watch([&](double x) { return rate * x * (1 - x); }, 0.3, 100'000);
        CHECK(seen.cycle == length);
        CHECK(seen.periods == 2 * length);
    }
}

TEST_CASE("repeats: chaos does not repeat", "[repeats]") {
    CHECK(watch([](double x) { return 3.9 * x * (1 - x); }, 0.3, 100'000).cycle == 0);
}

TEST_CASE("repeats: a transient is no cycle, however slow", "[repeats]") {
    // contraction by 1e-5 a return: it moves by more than 16 ulp (of 1.5, the largest value) until
    // it is within 5.4e-10, give or take an ulp
    const auto creep = [](double x) { return 1 + 0.99999 * (x - 1); };
    const Seen slow = watch(creep, 1.5, 5'000'000);
    CHECK(slow.cycle == 1);
    CHECK(std::abs(slow.x - 1) < 5.7e-10);
    // the bound that is promised: 1200 more returns move it by less than 1200 * 16 ulp of 1.5
    double later = slow.x;
    for (int k = 0; k < 1200; ++k)
        later = creep(later);
    CHECK(std::abs(later - slow.x) < 1200 * 16 * 1.5 * 2.3e-16);
    // drift at a constant rate of 32 ulp never is
    CHECK(watch([](double x) { return x + 7.1e-15; }, 1, 1'000'000).cycle == 0);
}

TEST_CASE("repeats: a start on an unstable orbit is not a cycle", "[repeats]") {
    // exactly on it, and one rounding away: neither has shown that it contracts
    const auto map = [](double x) { return 0.1 + 1.01 * (x - 0.1); };
    CHECK(watch(map, 0.1, 300).cycle == 0);
    CHECK(watch(map, 0.1 + 1e-17 * 2, 300).cycle == 0);
}

TEST_CASE("repeats: the tag and the time between returns count", "[repeats]") {
    // x settles at once, but two kinds take turns
    const auto first_cycle = [](auto tag_of, auto period_of) {
        Repeats<double, 1> repeats(1.0);
        for (int k = 1; k < 1000; ++k) {
            const double x = k < 5 ? double(k) : 5.0;
            if (const int cycle = repeats.add({period_of(k), 0.5, Vec<double, 1>(x), tag_of(k)}))
                return cycle;
        }
        return 0;
    };
    const auto same = [](int) { return 0; };
    const auto steady = [](int k) { return static_cast<long long>(k); };
    CHECK(first_cycle(same, steady) == 1);
    CHECK(first_cycle([](int k) { return k % 3; }, steady) == 3);
    // 1, 2, 1, 2, ... periods between returns
    CHECK(first_cycle(same, [](int k) { return static_cast<long long>(k + k / 2); }) == 2);
    // ever more periods between them
    CHECK(first_cycle(same, [](int k) { return static_cast<long long>(k) * k; }) == 0);
}
