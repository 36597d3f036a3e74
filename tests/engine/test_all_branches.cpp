// SPDX-License-Identifier: BSD-3-Clause
// Every solution, where there are several.
#include "hard.hpp"

#include <filippov/engine/all_branches.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/switches.hpp>

#include <algorithm>
#include <set>

using namespace filippov;

TEST_CASE("all branches: a unique solution is the only one", "[branches]") {
    const models::SignPlane sys;
    const auto s =
        simulate_all(sys, default_params<models::SignPlane>(), V2(0, 1), 0, 1, bounded<2>(1e-9));
    REQUIRE(s.all.size() == 1);
    CHECK(s.complete);
    CHECK(s.all[0].choices.empty());
    CHECK(s.all[0].trajectory.result.status == Status::ok);
}

TEST_CASE("all branches: from a repulsive surface there are three", "[branches]") {
    // x' = sign x from 0: x = t, x = -t, x = 0
    const Line sys([](const auto&, const auto& x) { return like(x, -1); },
                   [](const auto&, const auto& x) { return like(x, 1); },
                   [](const auto&, const auto& x) { return x[0]; });
    const auto s = simulate_all(sys, Vec<double, 0>(), V1(0), 0, 2, bounded<1>(1e-9));
    REQUIRE(s.all.size() == 3);
    CHECK(s.complete);
    std::set<double> ends;
    for (const auto& solution : s.all) {
        CHECK(solution.trajectory.result.status == Status::ok);
        ends.insert(std::round(solution.trajectory.result.x[0] * 1e9) / 1e9);
        REQUIRE(solution.choices.size() == 1);
        CHECK(solution.choices[0].t == 0);
        CHECK(solution.choices[0].options == 3);
        CHECK(solution.choices[0].mode == solution.trajectory.events[0].mode_after);
        CHECK(solution.trajectory.events[0].alternatives == 3);
    }
    CHECK(ends == std::set<double>{-2, 0, 2});
}

TEST_CASE("all branches: two genes at a tie have three ways on", "[branches]") {
    const models::GeneSwitch genes;
    const auto p = default_params<models::GeneSwitch>();
    const auto s = simulate_all(genes, p, V2(3, 3), 0, 5, bounded<2>(1e-9));
    REQUIRE(s.all.size() == 3);
    std::vector<V2> ends;
    for (const auto& solution : s.all) {
        CHECK(solution.trajectory.result.status == Status::ok);
        ends.push_back(solution.trajectory.result.x);
        REQUIRE(solution.choices.size() == 1);
        CHECK(solution.choices[0].t == Approx(std::log(7.0 / 6) / 2).epsilon(1e-9));
    }
    // a table's value for the winner's other gene, 5 units after the start
    const auto wins = [&](int i) {
        return std::any_of(ends.begin(), ends.end(), [i](const V2& x) {
            return x[i] == 8 &&
                   std::abs(x[1 - i] - 0.00021186633889159597383) < 1e-7; // ten steps of 1e-9 each
        });
    };
    CHECK(wins(0));
    CHECK(wins(1));
    CHECK(std::any_of(ends.begin(), ends.end(),
                      [](const V2& x) { return (x - V2(4, 4)).norm() < 1e-12; }));
}

namespace {

/// x' = sign x; z' = -sign z while y < 1, sign z later; y = t: a choice of x at 0, of z at 1.
struct Later {
    static constexpr int dim = 3;
    static constexpr int surfaces = 3;
    template <Scalar S>
    Vec<S, 3> field(const S&, const Vec<S, 3>&, const Vec<S, 3>& s, const Vec<S, 0>&) const {
        return {s[0], S(1), s[1] * s[2]};
    }
    template <Scalar S> Vec<S, 3> h(const S&, const Vec<S, 3>& x, const Vec<S, 0>&) const {
        return {x[0], x[1] - S(1), x[2]};
    }
};

} // namespace

TEST_CASE("all branches: choices follow on each other", "[branches]") {
    const auto s =
        simulate_all(Later{}, Vec<double, 0>(), Vec<double, 3>(0, 0, 0), 0, 2, bounded<3>(1e-9));
    CHECK(s.complete);
    CHECK(s.all.size() == 15); // what stayed on x = 0 chooses again at 1
    std::set<std::pair<double, double>> ends;
    for (const auto& solution : s.all) {
        INFO(solution.trajectory.result.message());
        CHECK(solution.trajectory.result.status == Status::ok);
        REQUIRE(solution.choices.size() == 2);
        CHECK(solution.choices[0].t == 0);
        CHECK(solution.choices[1].t == Approx(1).epsilon(1e-14));
        const auto& x = solution.trajectory.result.x;
        ends.insert({std::round(x[0] * 1e6) / 1e6, std::round(x[2] * 1e6) / 1e6});
    }
    for (const double x : {-2.0, -1.0, 0.0, 1.0, 2.0})
        for (const double z : {-1.0, 0.0, 1.0})
            CHECK(ends.contains({x, z}));
}

TEST_CASE("all branches: no more than asked for", "[branches]") {
    const models::GeneSwitch genes;
    const auto p = default_params<models::GeneSwitch>();
    const auto s = simulate_all(genes, p, V2(3, 3), 0, 1, bounded<2>(1e-9), 2);
    CHECK(s.all.size() == 2);
    CHECK(!s.complete);
    CHECK_THROWS_AS(simulate_all(genes, p, V2(3, 3), 0, 1, bounded<2>(1e-9), 0),
                    std::invalid_argument);
}
