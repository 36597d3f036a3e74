// SPDX-License-Identifier: BSD-3-Clause
// Basins of forced systems, against runs of the scalar engine, and against each other.

#include "catch.hpp"
#include "converter.hpp"
#include "systems.hpp"

#include <filippov/basins/basins.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/any_system.hpp>

#include <array>
#include <cmath>
#include <set>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

/// x' = x^3 - x - sign x + cos(t)/2, y' = -y: 0 attracts, sliding, and what is far out is lost.
struct Escaping {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"omega"};
    static constexpr std::array<double, 1> defaults{1};
    template <Scalar S>
    static Vec<S, 2> pushed(const S& t, const Vec<S, 2>& x, const Vec<S, 1>& p, const S& push) {
        using elementary::cos;
        return {x[0] * (x[0] * x[0] - S(1)) + push + S(0.5) * cos(p[0] * t), -x[1]};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return pushed(t, x, p, S(1));
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return pushed(t, x, p, S(-1));
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 1>&) const { return x[0]; }
    template <Scalar S> S period(const Vec<S, 1>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[0];
    }
};

/// A block between two springs, x'' = x - x^3 - x'/4 + cos(t)/10, beside which z chooses between
/// -c and c: four attractors. There is no switch but far away.
struct Beside {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 1> params{"c"};
    static constexpr std::array<double, 1> defaults{1};
    template <Scalar S> Vec<S, 3> f1(const S& t, const Vec<S, 3>& x, const Vec<S, 1>& p) const {
        using elementary::cos;
        const S z = x[2] / p[0];
        return {x[1], x[0] - x[0] * x[0] * x[0] - S(0.25) * x[1] + S(0.1) * cos(t),
                p[0] * (S(0.5) * z * (S(1) - z * z) + S(0.05) * x[1])};
    }
    template <Scalar S> Vec<S, 3> f2(const S& t, const Vec<S, 3>& x, const Vec<S, 1>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 1>&) const {
        return x[0] - S(100);
    }
    template <Scalar S> S period(const Vec<S, 1>&) const {
        return S(6.283185307179586476925286766559005768L);
    }
};

/// x' = q - x, y' = x - y/2, and a clock that turns q into 1 - q every unit of time.
struct Divided {
    static constexpr int dim = 4;
    static constexpr int surfaces = 1;
    static constexpr std::array kinds{SurfaceKind::jump};
    static constexpr std::array<std::string_view, 1> params{"k"};
    static constexpr std::array<double, 1> defaults{1};
    template <Scalar S> Vec<S, 4> f(const S&, const Vec<S, 4>& x, const Vec<S, 1>&) const {
        return {x[2] - x[0], x[0] - S(0.5) * x[1], S(0), S(1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 4>& x, const Vec<S, 1>&) const {
        return S(1) - x[3];
    }
    template <Scalar S> Vec<S, 4> jump(int, const S&, const Vec<S, 4>& x, const Vec<S, 1>&) const {
        return {x[0], x[1], S(1) - x[2], S(0)};
    }
    template <Scalar S> S period(const Vec<S, 1>&) const { return S(1); }
};

/// x' = x + u, where u = -k x is measured every half unit of time, and held.
struct Sampled {
    static constexpr int dim = 3;
    static constexpr int surfaces = 1;
    static constexpr std::array kinds{SurfaceKind::jump};
    static constexpr std::array<std::string_view, 1> params{"k"};
    static constexpr std::array<double, 1> defaults{1.5};
    template <Scalar S> Vec<S, 3> f(const S&, const Vec<S, 3>& x, const Vec<S, 1>&) const {
        return {x[0] + x[1], S(0), S(1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 3>& x, const Vec<S, 1>&) const {
        return S(0.5) - x[2];
    }
    template <Scalar S>
    Vec<S, 3> jump(int, const S&, const Vec<S, 3>& x, const Vec<S, 1>& p) const {
        return {x[0], -p[0] * x[0], x[2] - S(0.5)};
    }
    template <Scalar S> S period(const Vec<S, 1>&) const { return S(0.5); }
};

const std::shared_ptr<const AnySystem>& block() {
    static const auto system = oscillator_system();
    return system;
}
const std::shared_ptr<const AnyLanes>& block_lanes() {
    static const auto lanes = any_lanes(models::Oscillator{});
    return lanes;
}
#if defined(__SANITIZE_ADDRESS__)
constexpr bool slow = true; ///< thirty times as slow: smaller pictures
#else
constexpr bool slow = false;
#endif
CellGrid square(int n) { return {{0, -4, 4, n}, {1, -3, 4, n}}; }
BasinSettings quick() {
    BasinSettings s;
    s.seeds = slow ? 16 : 64;
    s.newtons = slow ? 9 : 16;
    s.audit = slow ? 20 : 100;
    s.settle = slow ? 80 : 200;
    s.parallel.threads = 1;
    return s;
}
/// A picture of a system with clocks.
template <class Sys>
Basins clocked(const Sys& sys, const CellGrid& grid, const Vector& rest, double parameter) {
    BasinSettings s = quick();
    s.rest = rest;
    const auto system = any_system(sys);
    const auto lanes = any_lanes(sys);
    return BasinFinder(*system, *lanes, grid, Vector::Constant(1, parameter), s).run();
}
void check_one_attractor(const Basins& b, int period) {
    CHECK(b.state == Status::ok);
    CHECK(b.unresolved == 0);
    CHECK(b.disagreements == 0);
    REQUIRE(b.attractors.size() == 1);
    CHECK(b.attractors[0].periodic);
    CHECK(b.attractors[0].cycle.period() == period);
    CHECK(b.attractors[0].cycle.stable());
    CHECK(b.attractors[0].cycle.multipliers[0] == 1.0); // the clock's
    CHECK(std::count(b.label.begin(), b.label.end(), 1) == b.grid.cells());
}

Basins picture(double A, double omega, const CellGrid& grid, const BasinSettings& settings) {
    return BasinFinder(*block(), *block_lanes(), grid, params_at(*block(), A, omega), settings)
        .run();
}
/// Built once for all tests.
constexpr int hundred_cells = slow ? 40 : 100;
const Basins& hundred() {
    static const Basins basins = picture(3.6, 1.067, square(hundred_cells), quick());
    return basins;
}

void check_two_attractors(const Basins& b) {
    CHECK(b.state == Status::ok);
    REQUIRE(b.attractors.size() == 2);
    REQUIRE(b.saddles.size() == 1);
    // docs/chapter.md, the three orbits of figure 4.16
    CHECK(std::abs(b.attractors[0].cycle.multipliers[0]) == Approx(0.481732).margin(1e-6));
    CHECK(std::abs(b.attractors[1].cycle.multipliers[0]) == Approx(0.743905).margin(1e-6));
    CHECK(std::abs(b.saddles[0].multipliers[0]) == Approx(2.126032).margin(1e-6));
    // H36: all three stick
    CHECK(b.attractors[0].cycle.multipliers[1] == 0.0);
    CHECK(b.attractors[1].cycle.multipliers[1] == 0.0);
    CHECK(b.saddles[0].multipliers[1] == 0.0);
    for (const Attractor& a : b.attractors) {
        CHECK(a.cycle.period() == 1);
        CHECK(a.cycle.residual < 1e-12);
        CHECK(a.radius > 0);
    }
    CHECK(b.unresolved == 0);
    CHECK(b.disagreements == 0);
}
/// Where the scalar engine is after so many periods.
Vector followed(double A, double omega, const std::array<double, 2>& from, int periods) {
    const Vector all = params_at(*block(), A, omega);
    const Params<models::Oscillator, double> p(all);
    const auto end =
        flow(models::Oscillator{}, p, Vec<double, 2>(from[0], from[1]), 0.0,
             periods * period(models::Oscillator{}, p), {.rtol = 1e-10, .atol = 1e-12});
    REQUIRE(end.status == Status::ok);
    return end.x;
}
/// The attractor that a point is on, to 1e-4.
int attractor_at(const Basins& b, const Vector& x) {
    for (std::size_t a = 0; a < b.attractors.size(); ++a)
        for (const Vector& y : b.attractors[a].cycle.points)
            if ((x - y).norm() < 1e-4)
                return int(a + 1);
    return 0;
}
void check_against_flow(const Basins& b, double A, double omega, int cells, int periods) {
    std::mt19937_64 random(5);
    for (int k = 0; k < cells; ++k) {
        const auto cell = std::int32_t(random() % std::uint64_t(b.grid.cells()));
        const auto from = b.grid.centre(cell);
        CAPTURE(cell, from[0], from[1]);
        CHECK(b.label[std::size_t(cell)] == attractor_at(b, followed(A, omega, from, periods)));
    }
}
void check_same(const Basins& a, const Basins& b) {
    CHECK(a.label == b.label);
    CHECK(a.time == b.time);
    CHECK(a.status == b.status);
    CHECK(a.periods == b.periods);
    CHECK(a.looked_up == b.looked_up);
    CHECK(a.plain.group == b.plain.group);
    REQUIRE(a.attractors.size() == b.attractors.size());
    for (std::size_t k = 0; k < a.attractors.size(); ++k) {
        CHECK(a.attractors[k].radius == b.attractors[k].radius);
        CHECK(a.attractors[k].cycle.points == b.attractors[k].cycle.points);
    }
}
void check_confusion(const Basins& b) {
    REQUIRE(b.confusion.size() == b.plain.groups.size() + 2);
    std::vector<std::int64_t> by_label(b.attractors.size() + 2, 0);
    for (std::size_t g = 0; g < b.confusion.size(); ++g) {
        const GroupCheck& row = b.confusion[g];
        REQUIRE(row.cells.size() == by_label.size());
        std::int64_t cells = 0;
        for (std::size_t k = 0; k < by_label.size(); ++k) {
            by_label[k] += row.cells[k];
            cells += row.cells[k];
        }
        const std::int64_t expected = g < b.plain.groups.size()    ? b.plain.groups[g].basin
                                      : g == b.plain.groups.size() ? b.plain.sink_basin
                                                                   : b.plain.unresolved_basin;
        CHECK(cells == expected);
    }
    for (std::size_t k = 0; k < by_label.size(); ++k)
        CHECK(by_label[k] == std::count(b.label.begin(), b.label.end(), std::int32_t(k) - 1));
}

} // namespace

TEST_CASE("basins: two attractors and a saddle, on any grid", "[basins]") {
    for (const int n : {20, 45, hundred_cells}) {
        if (slow && n == 45)
            continue;
        CAPTURE(n);
        const Basins b = n == hundred_cells ? hundred() : picture(3.6, 1.067, square(n), quick());
        check_two_attractors(b);
        check_confusion(b);
        CHECK(b.audited == quick().audit);
        for (std::size_t c = 0; c < b.label.size(); ++c)
            REQUIRE(b.time[c] >= 0);
    }
    // plain cell mapping sees more on the same 100 x 100 cells: what the table is for
    if (slow)
        return;
    CHECK(hundred().plain.groups.size() == 4);
    int named = 0, spurious = 0;
    for (const GroupCheck& g : hundred().confusion) {
        named += g.group >= 0 && g.attractor > 0;
        spurious += g.group >= 0 && g.attractor == 0;
    }
    CHECK(named == 2);
    CHECK(spurious == 2);
}

TEST_CASE("basins: labels are those of runs of the scalar engine", "[basins]") {
    check_against_flow(hundred(), 3.6, 1.067, slow ? 20 : 150, 60);
}

TEST_CASE("basins: larger pictures", "[.long][basins]") {
    for (const int n : {200, 500}) {
        const Basins b = picture(3.6, 1.067, square(n), {});
        check_two_attractors(b);
        check_confusion(b);
        check_against_flow(b, 3.6, 1.067, 1000, 60);
    }
}

TEST_CASE("basins: do not depend on the number of threads", "[basins]") {
    BasinSettings s = quick();
    s.parallel.threads = 2;
    const CellGrid grid = square(slow ? 16 : 50);
    const Basins in_two = picture(3.6, 1.067, grid, s);
    s.parallel.threads = 1;
    check_same(in_two, picture(3.6, 1.067, grid, s));
    s.times = false;
    const Basins by_exit = picture(3.6, 1.067, grid, s);
    s.parallel.threads = 2;
    check_same(by_exit, picture(3.6, 1.067, grid, s));
}

TEST_CASE("basins: the quotient gives the same labels", "[basins][quotient]") {
    BasinSettings s = quick();
    s.times = false;
    const Basins b = picture(3.6, 1.067, square(hundred_cells), s);
    CAPTURE(b.by_exit_reason);
    check_two_attractors(b);
    CHECK(b.by_exit);
    CHECK(b.label == hundred().label);
    CHECK(b.time.empty());
    CHECK(b.looked_up > hundred_cells * hundred_cells / 10);
    CHECK(b.periods < hundred().periods);
    REQUIRE(b.exit_label.size() == 2);
    CHECK(b.exit_label[0] != b.exit_label[1]);
    CHECK_FALSE(hundred().by_exit);
    CHECK_THAT(hundred().by_exit_reason, ContainsSubstring("times"));
    s.quotient = UseQuotient::never;
    const Basins direct = picture(3.6, 1.067, square(10), s);
    CHECK_FALSE(direct.by_exit);
    CHECK(direct.time.empty());
}

TEST_CASE("basins: a cycle of four periods is one attractor", "[basins]") {
    BasinSettings s = quick();
    const CellGrid grid = square(24);
    const Basins b = picture(0.5, 2.94, grid, s);
    REQUIRE(b.attractors.size() == 1);
    const Attractor& a = b.attractors[0];
    REQUIRE(a.cycle.period() == 4);
    CHECK(std::abs(a.cycle.multipliers[0]) == Approx(0.223177393122).margin(1e-9)); // chapter.md
    CHECK(b.unresolved == 0);
    CHECK(b.disagreements == 0);
    check_against_flow(b, 0.5, 2.94, 20, 80);
    // each point is mapped to the next
    for (std::size_t k = 0; k < 4; ++k) {
        const Vector& x = a.cycle.points[k];
        CHECK((followed(0.5, 2.94, {x[0], x[1]}, 1) - a.cycle.points[(k + 1) % 4]).norm() < 1e-8);
    }
    s.times = false;
    s.quotient = UseQuotient::always;
    CHECK(picture(0.5, 2.94, grid, s).label == b.label);
}

TEST_CASE("basins: a cycle longer than is looked for is kept as its points", "[basins]") {
    BasinSettings s = quick();
    s.seeds = 16;
    s.longest = 20; // the cycle has 50 periods, see docs/chapter.md
    const Basins b = picture(0.5, 2.893, square(10), s);
    REQUIRE(b.attractors.size() == 1);
    CHECK_FALSE(b.attractors[0].periodic);
    CHECK(b.attractors[0].cloud.size() >= 4000);
    CHECK(b.unresolved == 0);
    CHECK(b.disagreements == 0);
    for (const std::int32_t time : b.time)
        CHECK((time >= 0 && time < 400));
}

TEST_CASE("basins: a smaller distance takes longer to the same label", "[basins]") {
    BasinSettings s = quick();
    const CellGrid grid = square(slow ? 12 : 30);
    s.distance = 1e-3;
    const Basins near = picture(3.6, 1.067, grid, s);
    s.distance = 1e-6;
    const Basins nearer = picture(3.6, 1.067, grid, s);
    CHECK(near.label == nearer.label);
    for (std::size_t c = 0; c < near.time.size(); ++c)
        REQUIRE(near.time[c] <= nearer.time[c]);
    CHECK(near.time < nearer.time);
}

TEST_CASE("basins: centres on the surface and on an attractor", "[basins]") {
    const double y = hundred().attractors[1].cycle.points[0][0]; // it sticks: v = 1
    // the centre of the middle cell is (y, 1)
    const Basins b = picture(3.6, 1.067, {{0, y - 0.5, y + 0.5, 11}, {1, 0.5, 1.5, 11}}, quick());
    REQUIRE(b.attractors.size() == 2);
    CHECK(b.unresolved == 0);
    CHECK(b.grid.centre(60)[1] == 1);
    CHECK(b.label[60] == 2);
    CHECK(b.time[60] == 0);
    for (std::int32_t column = 0; column < 11; ++column) {
        const std::int32_t cell = column * 11 + 5;
        CHECK(b.label[std::size_t(cell)] ==
              attractor_at(b, followed(3.6, 1.067, b.grid.centre(cell), 60)));
    }
}

TEST_CASE("basins: what does not land in time is unresolved", "[basins]") {
    BasinSettings s = quick();
    s.periods = 3;
    const Basins b = picture(3.6, 1.067, square(20), s),
                 &all = picture(3.6, 1.067, square(20), quick());
    std::int64_t late = 0;
    for (std::size_t c = 0; c < b.label.size(); ++c) {
        const bool in_time = all.time[c] <= 3;
        late += !in_time;
        CHECK(b.label[c] == (in_time ? all.label[c] : 0));
        CHECK(b.time[c] == (in_time ? all.time[c] : -1));
        CHECK(b.status[c] == (in_time ? Status::ok : Status::not_converged));
    }
    CHECK(late > 0);
    CHECK(b.unresolved == late);
}

TEST_CASE("basins: what leaves has escaped", "[basins]") {
    const auto system = any_system(Escaping{});
    const auto lanes = any_lanes(Escaping{});
    BasinSettings s = quick();
    s.escape = {5, 5};
    s.newtons = 0;
    const CellGrid grid({0, -3, 3, 24}, {1, -1, 1, 4});
    const Basins b = BasinFinder(*system, *lanes, grid, system->defaults(), s).run();
    CHECK(b.state == Status::ok);
    REQUIRE(b.attractors.size() == 1);
    check_confusion(b);
    for (std::int32_t c = 0; c < grid.cells(); ++c) {
        const double x = std::abs(grid.centre(c)[0]);
        CAPTURE(c, x);
        // |x|' >= x^3 - x - 1.5 > 0 beyond 1.5, and <= x^3 - x - 0.5 < 0 below 1.1
        if (x > 1.5) {
            CHECK(b.label[std::size_t(c)] == -1);
            CHECK(b.time[std::size_t(c)] == -1);
            CHECK(b.status[std::size_t(c)] == Status::escaped);
        } else if (x < 1.1) {
            CHECK(b.label[std::size_t(c)] == 1);
        }
    }
    CHECK(b.unresolved == 0);
    CHECK(b.disagreements == 0);
}

TEST_CASE("basins: an interrupted run says so, and what it had labelled", "[basins]") {
    for (const std::size_t last : {0u, 200u, 700u}) {
        BasinSettings s = quick();
        std::size_t shown = 0;
        s.parallel.progress = [&](std::size_t done, std::size_t total) {
            CHECK(total == 2 * 2500);
            CHECK(done >= shown);
            shown = done;
        };
        s.parallel.cancelled = [&] { return shown >= 5 * last; };
        const Basins b = picture(3.6, 1.067, square(50), s);
        CHECK(b.state == Status::interrupted);
        REQUIRE(b.label.size() == 2500);
        REQUIRE(b.time.size() == 2500);
        REQUIRE(b.status.size() == 2500);
        CHECK(b.audited == 0);
        CHECK(b.unresolved == std::count(b.label.begin(), b.label.end(), 0));
        for (std::size_t c = 0; c < b.label.size(); ++c)
            REQUIRE((b.label[c] == 0) == (b.status[c] != Status::ok));
        check_confusion(b);
    }
}

TEST_CASE("basins: progress ends with all that is to be done", "[basins]") {
    BasinSettings s = quick();
    s.times = GENERATE(true, false);
    std::size_t shown = 0;
    s.parallel.progress = [&](std::size_t done, std::size_t) { shown = done; };
    CHECK(picture(3.6, 1.067, square(20), s).state == Status::ok);
    CHECK(shown == 800);
}

TEST_CASE("basins: refuses what makes no sense", "[basins]") {
    const auto refused = [](const char* why, auto change, const CellGrid& grid = square(5)) {
        BasinSettings s = quick();
        change(s);
        CHECK_THROWS_WITH(picture(3.6, 1.067, grid, s), ContainsSubstring(why));
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    refused("seeds", [](BasinSettings& s) { s.seeds = 0; });
    refused("settle", [](BasinSettings& s) { s.settle = 0; });
    refused("longest", [](BasinSettings& s) { s.longest = 0; });
    refused("periods", [](BasinSettings& s) { s.periods = -1; });
    refused("newtons", [](BasinSettings& s) { s.newtons = -1; });
    refused("audit", [](BasinSettings& s) { s.audit = -1; });
    refused("distance", [&](BasinSettings& s) { s.distance = nan; });
    refused("escape", [&](BasinSettings& s) { s.escape = {nan, 1}; });
    refused("escape.size()", [](BasinSettings& s) { s.escape = {1}; });
    refused("rtol", [&](BasinSettings& s) { s.run.rtol = nan; });
    refused("t0", [&](BasinSettings& s) { s.t0 = nan; });
    refused("x.size()", [](BasinSettings& s) { s.rest = Vector::Zero(3); });
    refused("threads", [](BasinSettings& s) { s.parallel.threads = -1; });
    refused("times", [](BasinSettings& s) { s.quotient = UseQuotient::always; });
    refused("coordinate", [](BasinSettings&) {}, {{0, -1, 1, 5}, {7, -1, 1, 5}});
    CHECK_THROWS_WITH(BasinFinder(*block(), *any_lanes(Escaping{}), square(5), block()->defaults()),
                      ContainsSubstring("lanes"));
    // no exit curves to look up in
    const auto system = any_system(Escaping{});
    const auto lanes = any_lanes(Escaping{});
    BasinSettings s = quick();
    s.times = false;
    s.escape = {5, 5};
    const CellGrid grid({0, -3, 3, 4}, {1, -1, 1, 4});
    const Basins b = BasinFinder(*system, *lanes, grid, system->defaults(), s).run();
    CHECK_FALSE(b.by_exit);
    CHECK_FALSE(b.by_exit_reason.empty());
    s.quotient = UseQuotient::always;
    CHECK_THROWS_WITH(BasinFinder(*system, *lanes, grid, system->defaults(), s).run(),
                      ContainsSubstring("quotient = always"));
}

TEST_CASE("basins: parts of a picture are those of the whole, to the last bit", "[basins]") {
    const CellGrid grid = square(40);
    BasinSettings s = quick();
    s.times = GENERATE(true, false);
    const Basins whole = picture(3.6, 1.067, grid, s);
    BasinFinder finder(*block(), *block_lanes(), grid, params_at(*block(), 3.6, 1.067), s);
    const std::vector<CellRange> parts{{0, 700}, {700, 1}, {701, 899}};
    std::vector<MappedCells> images;
    std::vector<std::int32_t> cell;
    for (const CellRange& part : parts) {
        images.push_back(finder.images(part));
        cell.insert(cell.end(), images.back().cell.begin(), images.back().cell.end());
    }
    Basins joined{.grid = grid};
    joined.plain = cell_map(grid, cell);
    LimitSets sets = finder.find(joined.plain);
    joined.attractors = sets.attractors;
    joined.saddles = sets.saddles;
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const CellLabels labels = finder.labels(joined.attractors, parts[k], images[k]);
        CHECK(labels.state == Status::ok);
        joined.label.insert(joined.label.end(), labels.label.begin(), labels.label.end());
        joined.time.insert(joined.time.end(), labels.time.begin(), labels.time.end());
        joined.status.insert(joined.status.end(), labels.status.begin(), labels.status.end());
        joined.periods += labels.periods;
        joined.looked_up += labels.looked_up;
    }
    finder.complete(joined);
    check_same(joined, whole);
    check_confusion(joined);
    CHECK(joined.audited == whole.audited);
    CHECK(joined.disagreements == 0);
    CHECK(joined.by_exit == whole.by_exit);
    CHECK(joined.exit_label == whole.exit_label);
    CHECK_THROWS_WITH(finder.images({1, 1600}), ContainsSubstring("cells.first"));
    CHECK_THROWS_WITH(finder.labels(sets.attractors, {0, 3}, images[1]),
                      ContainsSubstring("images"));
}

TEST_CASE("basins: the unit of a coordinate that the picture does not have is its own",
          "[basins]") {
    const auto system = any_system(Beside{});
    const auto lanes = any_lanes(Beside{});
    const auto of = [&](double c) {
        BasinSettings s = quick();
        s.run.atol = {1e-10, 1e-10, 1e-10 * c};
        return BasinFinder(*system, *lanes, {{0, -2, 2, 12}, {1, -2, 2, 12}},
                           Vector::Constant(1, c), s)
            .run();
    };
    const Basins one = of(1);
    REQUIRE(one.attractors.size() == 4);
    CHECK(one.unresolved == 0);
    for (const double c : {0x1p-20, 0x1p20}) {
        CAPTURE(c);
        const Basins b = of(c);
        CHECK(b.saddles.size() == one.saddles.size());
        REQUIRE(b.attractors.size() == 4);
        // the same attractors, perhaps in another order
        std::array<std::int32_t, 5> same{};
        for (std::size_t k = 0; k < 4; ++k) {
            REQUIRE(b.attractors[k].cycle.points.size() == 1);
            Vector x = b.attractors[k].cycle.points[0];
            x[2] /= c;
            for (std::size_t j = 0; j < 4; ++j)
                if ((x - one.attractors[j].cycle.points[0]).norm() < 1e-9)
                    same[k + 1] = std::int32_t(j + 1);
        }
        CHECK(std::set<std::int32_t>(same.begin(), same.end()).size() == 5);
        for (std::size_t k = 0; k < b.label.size(); ++k)
            CHECK(same[std::size_t(b.label[k])] == one.label[k]);
    }
}

TEST_CASE("basins: any point is labelled as the cell is of which it is the centre", "[basins]") {
    const Basins& b = hundred();
    const BasinLabeller labeller(*block(), *block_lanes(), b.grid, b.attractors,
                                 params_at(*block(), 3.6, 1.067), quick());
    std::vector<std::array<double, 2>> points;
    for (std::int32_t c = 0; c < b.grid.cells(); c += 7)
        points.push_back(b.grid.centre(c));
    points.push_back({b.attractors[0].cycle.points[0][0], b.attractors[0].cycle.points[0][1]});
    points.push_back({std::numeric_limits<double>::quiet_NaN(), 0});
    std::vector<CellLabel> labels(points.size());
    CHECK(labeller(points, labels));
    for (std::size_t k = 0; k + 2 < points.size(); ++k) {
        CHECK(labels[k].label == b.label[7 * k]);
        CHECK(labels[k].time == b.time[7 * k]);
    }
    CHECK((labels.end()[-2].label == 1 && labels.end()[-2].time == 0));
    CHECK((labels.back().label == 0 && labels.back().time == -1));
}

TEST_CASE("basins: what a clock shows does not part one attractor", "[basins]") {
    const CellGrid grid({0, 5, 25, 12}, {1, 0.2, 1.5, 12}); // v, i
    // at 0 the clock jumps whenever the strobe flashes
    for (const double tau : {0.0, 0.05, 0.0999}) {
        CAPTURE(tau);
        const Basins b = clocked(ClockedBoost<>{}, grid, Eigen::Vector4d(0, 0, 1, tau), 1.6);
        check_one_attractor(b, 1);
        const StrobeCycle& cycle = b.attractors[0].cycle;
        // test_discrete.cpp has them from matrix exponentials
        CHECK(cycle.multipliers[1].real() == Approx(-std::exp(-0.0697755)).epsilon(1e-5));
        CHECK(cycle.multipliers[2].real() == Approx(std::exp(-0.9970743)).epsilon(1e-5));
        CHECK(cycle.multipliers[3] == 0.0);
        CHECK(cycle.points[0][3] == Approx(tau).margin(1e-6));
        if (tau == 0) {
            CHECK(cycle.points[0][2] == 1); // after the jump, never before
            CHECK(cycle.points[0][0] == Approx(18.0289).epsilon(1e-4));
        }
    }
    // (a current above Iref would start beyond the switch)
    const CellGrid lower({0, 5, 25, 12}, {1, 0.2, 1.15, 12});
    check_one_attractor(clocked(ClockedBoost<3>{}, lower, Eigen::Vector4d(0, 0, 1, 0), 1.2), 1);
    check_one_attractor(clocked(ClockedBoost<>{}, grid, Eigen::Vector4d(0, 0, 1, 0), 1.8), 2);
    const auto picture_of_clock = [] {
        return clocked(ClockedBoost<>{}, {{0, 5, 25, 5}, {3, 0, 0.09, 5}},
                       Eigen::Vector4d(0, 1, 1, 0), 1.6);
    };
    CHECK_THROWS_WITH(picture_of_clock(), ContainsSubstring("grid.axis(1).coordinate = 3") &&
                                              ContainsSubstring("clock"));
}

TEST_CASE("basins: a clock that is divided by two, and a controller that samples", "[basins]") {
    const Basins divided = clocked(Divided{}, {{0, -1, 2, 8}, {1, -1, 3, 8}}, Vector::Zero(4), 1);
    check_one_attractor(divided, 2);
    const auto& mu = divided.attractors[0].cycle.multipliers; // of two units of time
    CHECK(mu[1] == 1.0);                                      // q, which comes back to itself
    CHECK(mu[2].real() == Approx(std::exp(-1.0)).epsilon(1e-9));
    CHECK(mu[3].real() == Approx(std::exp(-2.0)).epsilon(1e-9));
    // u does not jump to a constant: it is no latch
    const Basins sampled = clocked(Sampled{}, {{0, -1, 1, 8}, {1, -1, 1, 8}}, Vector::Zero(3), 1.5);
    check_one_attractor(sampled, 1);
    const auto& lambda = sampled.attractors[0].cycle.multipliers;
    CHECK(lambda[1].real() == Approx(1.5 - 0.5 * std::exp(0.5)).epsilon(1e-9));
    CHECK(std::abs(lambda[2]) < 1e-12);
}

TEST_CASE("basins: an audit that disagrees is not ok", "[basins]") {
    CHECK(audit_agrees(0, 0));
    CHECK(audit_agrees(500, 3));
    CHECK_FALSE(audit_agrees(500, 4));
    CHECK_FALSE(audit_agrees(100, 1));
    Basins b = hundred();
    BasinFinder finder(*block(), *block_lanes(), square(hundred_cells),
                       params_at(*block(), 3.6, 1.067), quick());
    b.confusion.clear();
    finder.complete(b);
    CHECK(b.state == Status::ok);
    for (auto& label : b.label)
        label = 3 - label; // each the other
    b.confusion.clear();
    finder.complete(b);
    CHECK(b.disagreements == b.audited);
    CHECK(b.state == Status::not_converged);
}
