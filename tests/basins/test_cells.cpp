// SPDX-License-Identifier: BSD-3-Clause
// Cells and cell maps, against brute force, hand-made maps and closed forms.

#include "catch.hpp"

#include <filippov/basins/cells.hpp>

#include <atomic>
#include <random>
#include <set>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double huge = std::numeric_limits<double>::max();

using Point = std::array<double, 2>;
using Cells = std::vector<std::int32_t>;

CellGrid grid_of(int n1, int n2) { return {{0, 0, 1, n1}, {1, 0, 1, n2}}; }

/// Next number up or down.
double up(double x) { return std::nextafter(x, inf); }
double down(double x) { return std::nextafter(x, -inf); }

/// What becomes of each cell, by following each for as many steps as there are cells.
void check_by_following(const CellMap& map, const Cells& image) {
    const auto n = static_cast<int>(image.size());
    std::set<std::pair<std::int32_t, std::int32_t>> keys; // (period, smallest) of true groups
    for (std::int32_t start = 0; start < n; ++start) {
        std::int32_t c = start;
        for (int k = 0; k < n && c >= 0; ++k)
            c = image[std::size_t(c)];
        const auto at = std::size_t(start);
        if (c < 0) {
            int steps = 0;
            for (c = start; c >= 0; c = image[std::size_t(c)])
                ++steps;
            REQUIRE(map.group[at] == c);
            REQUIRE(map.steps[at] == steps);
            continue;
        }
        std::vector<std::int32_t> loop{c}; // after n steps c is on its loop
        for (std::int32_t d = image[std::size_t(c)]; d != c; d = image[std::size_t(d)])
            loop.push_back(d);
        std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
        keys.emplace(loop.size(), loop.front());
        int steps = 0;
        for (c = start; std::find(loop.begin(), loop.end(), c) == loop.end(); ++steps)
            c = image[std::size_t(c)];
        REQUIRE(map.group[at] >= 0);
        REQUIRE(map.groups.at(std::size_t(map.group[at])).cells == loop);
        REQUIRE(map.steps[at] == steps);
    }
    REQUIRE(map.groups.size() == keys.size());
    std::size_t g = 0;
    for (const auto& [period, smallest] : keys) { // a set is in order
        CHECK(map.groups[g].period == period);
        CHECK(map.groups[g].cells.front() == smallest);
        CHECK(map.groups[g].basin == std::count(map.group.begin(), map.group.end(), int(g)));
        ++g;
    }
    CHECK(map.sink_basin == std::count(map.group.begin(), map.group.end(), CellGrid::sink));
    CHECK(map.unresolved_basin ==
          std::count(map.group.begin(), map.group.end(), CellGrid::unresolved));
}

} // namespace

TEST_CASE("cells: each cell holds its centre and begins at its edge", "[cells]") {
    std::mt19937_64 random(1);
    const auto unit = [&] { return double(random() >> 11) * 0x1p-53; };
    for (int trial = 0; trial < 200; ++trial) {
        CellAxis axis;
        axis.low = (unit() - 0.5) * std::pow(10, 8 * unit() - 4);
        axis.high = axis.low + std::pow(10, 6 * unit() - 3);
        axis.n = 1 + int(std::pow(10, 4.9 * unit()));
        if (axis.width() < 1024 * axis.spacing())
            continue; // CellGrid refuses these
        for (int i = 0; i < axis.n; i += 1 + axis.n / 2000) {
            REQUIRE(axis.cell_of(axis.centre(i)) == i);
            REQUIRE(axis.cell_of(axis.edge(i)) == i);
            REQUIRE(axis.cell_of(down(axis.edge(i + 1))) == i);
        }
        CHECK(axis.cell_of(axis.high) == CellAxis::outside);
        CHECK(axis.cell_of(down(axis.low)) == CellAxis::outside);
    }
}

TEST_CASE("cells: the finest axes that are allowed keep their centres", "[cells]") {
    // 1e5 cells of 1024 units in the last place
    const double high = 4503599627370496.0 + 102'400'000;
    const CellGrid grid({0, 4503599627370496.0, high, 100'000}, {1, 0, 1, 1});
    for (std::int32_t c = 0; c < grid.cells(); ++c) {
        const Point centre = grid.centre(c);
        REQUIRE(grid.cell_of(centre[0], centre[1]) == c);
    }
    CHECK_THROWS_WITH(CellGrid({0, 4503599627370496.0, high - 102'400, 100'000}, {1, 0, 1, 1}),
                      ContainsSubstring("expected cells wider than 1024 units in the last place"));
}

TEST_CASE("cells: outside is the sink, NaN is unresolved", "[cells]") {
    const CellGrid grid({0, -1, 2, 30}, {1, 5, 6, 7});
    for (const double far : {inf, -inf, huge, -huge, 2.0, up(2.0), down(-1.0), 1e10, -1e10}) {
        CHECK(grid.cell_of(far, 5.5) == CellGrid::sink);
        CHECK(grid.cell_of(far, not_a_number) == CellGrid::unresolved);
    }
    for (const double far : {inf, -inf, huge, -huge, 6.0, down(5.0), 3e9, -3e9}) {
        CHECK(grid.cell_of(0, far) == CellGrid::sink);
        CHECK(grid.cell_of(not_a_number, far) == CellGrid::unresolved);
    }
    CHECK(grid.cell_of(-1, 5) == 0);
    CHECK(grid.cell_of(down(2), down(6)) == grid.cells() - 1);
}

TEST_CASE("cells: numbering is row-major over (first axis, second axis)", "[cells]") {
    const CellGrid grid({3, 0, 3, 3}, {1, 0, 4, 4});
    CHECK(grid.cell_of(0.5, 3.5) == 3);
    CHECK(grid.cell_of(1.5, 0.5) == 4);
    CHECK(grid.centre(6) == Point{1.5, 2.5});
    CHECK(grid.axis(0).coordinate == 3);
}

TEST_CASE("cells: a shifted grid has its lines where centres were", "[cells]") {
    const CellGrid grid({0, -2, 2, 400}, {1, -1, 3, 300}), moved = grid.shifted();
    for (int k = 0; k < 2; ++k)
        for (int i = 0; i < grid.axis(k).n; ++i)
            CHECK(moved.axis(k).edge(i) == Approx(grid.axis(k).centre(i)).margin(1e-14));
}

TEST_CASE("cells: the largest grids are counted without overflow", "[cells]") {
    const CellGrid grid({0, 0, 1, 46'340}, {1, 0, 1, 46'340});
    CHECK(grid.cells() == 46'340 * 46'340);
    CHECK(grid.cell_of(down(1), down(1)) == grid.cells() - 1);
    CHECK_THROWS_WITH(CellGrid({0, 0, 1, 46'341}, {1, 0, 1, 46'341}),
                      ContainsSubstring("expected at most 2^31 - 1 cells"));
}

TEST_CASE("cells: refuses axes that make no sense", "[cells]") {
    const auto refused = [](const CellAxis& axis, const char* words) {
        CHECK_THROWS_WITH(CellGrid(axis, {9, 0, 1, 1}), ContainsSubstring(words));
        CHECK_THROWS_WITH(CellGrid({9, 0, 1, 1}, axis), ContainsSubstring(words));
    };
    refused({-1, 0, 1, 5}, "coordinate = -1: expected an index >= 0");
    refused({9, 0, 1, 5}, "expected another coordinate");
    refused({0, not_a_number, 1, 5}, "low = nan");
    refused({0, -inf, 1, 5}, "low = -inf");
    refused({0, 0, not_a_number, 5}, "high = nan");
    refused({0, 0, inf, 5}, "high = inf");
    refused({0, 1, 1, 5}, "high = 1: expected a finite number > low");
    refused({0, -huge, huge, 5}, "expected a finite number > low");
    refused({0, 0, 1, 0}, "n = 0: expected an integer from 1 to 100000");
    refused({0, 0, 1, 100'001}, "n = 100001");
}

TEST_CASE("cells: a map made by hand is unravelled by hand", "[cells]") {
    //  0 -> 3 -> 5 -> 3;  1 -> 1;  2 -> 0;  4 -> sink;  6 -> 4;  7 -> unresolved;  8 -> 7;  9 -> 9
    const Cells image{3, 1, 0, 5, -1, 3, 4, -2, 7, 9};
    const CellMap map = cell_map(grid_of(2, 5), image);
    REQUIRE(map.groups.size() == 3);
    CHECK(map.groups[0].cells == Cells{1});
    CHECK(map.groups[1].cells == Cells{9});
    CHECK(map.groups[2].cells == Cells{3, 5});
    CHECK(map.groups[2].basin == 4);
    CHECK(map.group == Cells{2, 0, 2, 2, -1, 2, -1, -2, -2, 1});
    CHECK(map.steps == Cells{1, 0, 2, 0, 1, 0, 2, 1, 2, 0});
    CHECK(map.sink_basin == 2);
    CHECK(map.unresolved_basin == 2);
}

TEST_CASE("cells: random maps agree with following each cell", "[cells]") {
    std::mt19937_64 random(2);
    for (int trial = 0; trial < 100; ++trial) {
        const int n = 1 + int(random() % 40);
        const int reach = trial % 3 == 0 ? n : n + 2; // some without sink and unresolved
        Cells image;
        for (int c = 0; c < n * n; ++c)
            image.push_back(int(random() % std::uint64_t(trial % 2 == 0 ? n : n * n)) -
                            (reach > n ? int(random() % 3) : 0));
        for (std::int32_t& c : image)
            c = std::max(c, CellGrid::unresolved);
        check_by_following(cell_map(grid_of(n, n), image), image);
    }
}

TEST_CASE("cells: permutations are groups and nothing else", "[cells]") {
    std::mt19937_64 random(3);
    Cells image(600);
    std::iota(image.begin(), image.end(), 0);
    for (std::size_t k = image.size(); k > 1; --k)
        std::swap(image[k - 1], image[random() % k]);
    const CellMap map = cell_map(grid_of(20, 30), image);
    check_by_following(map, image);
    CHECK(map.steps == Cells(600, 0));
    int members = 0;
    for (const CellGroup& g : map.groups)
        members += g.period;
    CHECK(members == 600);
}

TEST_CASE("cells: one path through a million cells needs no stack", "[cells]") {
    Cells image(1'000'000);
    for (std::size_t c = 0; c < image.size(); ++c)
        image[c] = std::int32_t(c + 1);
    image.back() = 0;
    const CellMap round = cell_map(grid_of(1000, 1000), image);
    REQUIRE(round.groups.size() == 1);
    CHECK(round.groups[0].period == 1'000'000);
    image.back() = CellGrid::sink;
    const CellMap out = cell_map(grid_of(1000, 1000), image);
    CHECK(out.groups.empty());
    CHECK(out.steps.front() == 1'000'000);
    CHECK(out.sink_basin == 1'000'000);
}

TEST_CASE("cells: refuses images that are no cells", "[cells]") {
    const auto grid = grid_of(2, 2);
    CHECK_THROWS_WITH(cell_map(grid, Cells{0, 1, 2}), ContainsSubstring("image.size() = 3"));
    CHECK_THROWS_WITH(cell_map(grid, Cells{0, 1, 2, 4}), ContainsSubstring("image[3] = 4"));
    CHECK_THROWS_WITH(cell_map(grid, Cells{-3, 1, 2, 3}), ContainsSubstring("image[0] = -3"));
}

TEST_CASE("cells: a contraction leads to its fixed cells, of which one can be spurious",
          "[cells]") {
    // x -> a + (x - a)/4 moves a centre by 3/4 of its distance from a: a cell stays in itself if
    // that is at most half a width, so if the distance is at most 2/3
    const CellGrid grid({0, -1, 1, 101}, {1, -1, 1, 77});
    const auto unravelled = [&](double aside) {
        const Point middle = grid.centre(grid.cell_of(0.2, -0.3));
        const Point a{middle[0] + aside * grid.axis(0).width(), middle[1]};
        const auto map = [&](std::span<const Point> from, std::span<Point> to) {
            for (std::size_t k = 0; k < from.size(); ++k)
                for (std::size_t d = 0; d < 2; ++d)
                    to[k][d] = a[d] + (from[k][d] - a[d]) / 4;
        };
        return cell_map(grid, cell_images(grid, map).image);
    };
    const std::int32_t own = grid.cell_of(0.2, -0.3);
    const CellMap good = unravelled(0.2);
    REQUIRE(good.groups.size() == 1);
    CHECK(good.groups[0].cells == Cells{own});
    CHECK(good.groups[0].basin == grid.cells());
    // 61 cells shrink to 61/64 + (1 + 1/4 + 1/16)/2 < 1.8 in three steps, and then to none
    CHECK(*std::max_element(good.steps.begin(), good.steps.end()) == 4);
    // distances 0.4 and 0.6: the neighbour in the first axis, 77 cells on, stays in itself too
    const CellMap split = unravelled(0.4);
    REQUIRE(split.groups.size() == 2);
    CHECK(split.groups[0].cells == Cells{own});
    CHECK(split.groups[1].cells == Cells{own + 77});
    CHECK(split.groups[0].basin + split.groups[1].basin == grid.cells());
}

TEST_CASE("cells: images do not depend on the threads, and come in tiles of one size", "[cells]") {
    const CellGrid grid({0, 0, 1, 211}, {1, 0, 1, 97});
    std::atomic<std::size_t> others{0};
    const auto map = [&](std::span<const Point> from, std::span<Point> to) {
        others += from.size() != cell_tile;
        for (std::size_t k = 0; k < from.size(); ++k) {
            to[k] = {4 * from[k][0] * (1 - from[k][0]), from[k][1] + from[k][0]};
            if (k % 17 == 0)
                to[k][1] = not_a_number;
        }
    };
    std::size_t shown = 0;
    Parallel one{.threads = 1}, four{.threads = 4};
    four.progress = [&](std::size_t done, std::size_t total) {
        CHECK(total == 211 * 97);
        shown = done;
    };
    const CellImages a = cell_images(grid, map, one), b = cell_images(grid, map, four);
    CHECK(a.status == Status::ok);
    CHECK(a.image == b.image);
    CHECK(shown == 211 * 97);
    CHECK(others == 2); // the last tile, twice
    for (std::size_t c = 0; c < a.image.size(); ++c) {
        const Point centre = grid.centre(std::int32_t(c));
        const std::int32_t expected =
            c % cell_tile % 17 == 0
                ? CellGrid::unresolved
                : grid.cell_of(4 * centre[0] * (1 - centre[0]), centre[1] + centre[0]);
        REQUIRE(a.image[c] == expected);
    }
}

TEST_CASE("cells: what a cancelled map did not do is unresolved", "[cells]") {
    const CellGrid grid({0, 0, 1, 200}, {1, 0, 1, 200});
    Parallel how{.threads = 1};
    int tiles = 0;
    how.cancelled = [&] { return tiles >= 2; };
    const auto identity = [&](std::span<const Point> from, std::span<Point> to, Worker& worker) {
        ++tiles;
        for (std::size_t k = 0; k < from.size() && !worker.stopped(); ++k)
            to[k] = from[k];
    };
    const CellImages images = cell_images(grid, identity, how);
    CHECK(images.status == Status::interrupted);
    CHECK(tiles == 2); // the second asks, and ends at once
    for (std::int32_t c = 0; c < grid.cells(); ++c)
        REQUIRE(images.image[std::size_t(c)] ==
                (c < std::int32_t(cell_tile) ? c : CellGrid::unresolved));
    CHECK(cell_map(grid, images.image).unresolved_basin == 40'000 - int(cell_tile));
}

TEST_CASE("cells: lines on the surface are found, and a shift moves them off", "[cells]") {
    // v = 1 on a round grid, with a belt speed that is no exact number of it
    const CellGrid grid({0, -5, 5, 500}, {1, -3, 3, 600});
    const auto belt = [](double, double v) { return v - 1; };
    const auto found = lines_on_surface(grid, belt);
    REQUIRE(found.size() == 1);
    CHECK(found[0].axis == 1);
    CHECK(found[0].index == 400);
    CHECK(found[0].value == Approx(1).epsilon(1e-15));
    CHECK(lines_on_surface(grid.shifted(), belt).empty());
    // rounding of the line and of h: 0.3 is met to an ulp, and h scaled by anything
    const auto scaled = [](double, double v) { return 1e-200 * (10 * v - 3); };
    REQUIRE(lines_on_surface(grid, scaled).size() == 1);
    CHECK(lines_on_surface(grid, scaled)[0].index == 330);
    // a line of the first axis, a wall at both ends
    const auto walls = [](double y, double) { return (y - 5) * (y + 5); };
    const auto both = lines_on_surface(grid, walls);
    REQUIRE(both.size() == 2);
    CHECK((both[0].axis == 0 && both[0].index == 0));
    CHECK((both[1].axis == 0 && both[1].index == 500));
}

TEST_CASE("cells: surfaces that only meet or approach a line are not on it", "[cells]") {
    const CellGrid grid({0, -5, 5, 500}, {1, -3, 3, 600});
    CHECK(lines_on_surface(grid, [](double y, double v) { return v - 1 - 1e-9 * y; }).empty());
    CHECK(lines_on_surface(grid, [](double, double v) { return v - 1 - 1e-9; }).empty());
    CHECK(lines_on_surface(grid, [](double y, double v) { return v - 1 - y * y; }).empty());
    CHECK(lines_on_surface(grid, [](double y, double v) { return y * y + v * v - 4; }).empty());
    CHECK(lines_on_surface(grid, [](double, double) { return 0.0; }).empty());
    CHECK(lines_on_surface(grid, [](double, double) { return not_a_number; }).empty());
}
