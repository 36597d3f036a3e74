// SPDX-License-Identifier: BSD-3-Clause
// Refined pictures, against brute force over all finest squares, exact areas and known dimensions.

#include "catch.hpp"

#include <filippov/basins/cells.hpp>
#include <filippov/basins/refine.hpp>

#include <numbers>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

using Point = std::array<double, 2>;

/// A labeller from a function of one point, that counts what it is asked.
template <class F> struct Labels {
    F f;
    long long asked = 0;
    int batches = 0;

    void operator()(std::span<const Point> points, std::span<CellLabel> labels) {
        asked += static_cast<long long>(points.size());
        ++batches;
        for (std::size_t k = 0; k < points.size(); ++k)
            labels[k] = f(points[k][0], points[k][1]);
    }
};
template <class F> Labels(F) -> Labels<F>;

CellLabel inside(bool yes) { return {yes ? 2 : 1, 0}; }

CellLabel circle(double x, double y) {
    return inside((x - 0.51) * (x - 0.51) + (y - 0.47) * (y - 0.47) < 0.35 * 0.35);
}
CellLabel half_plane(double x, double y) { return inside(x + 0.3 * y > 0.6); }

/// Basins of y -> +-infinity under x -> 2x mod 1, y -> lambda y + cos(2 pi x), 1 < lambda < 2.
/// Their boundary is the graph of -sum_k cos(2 pi 2^k x) / lambda^(k+1), of dimension 2 - ln lambda
/// / ln 2. (McDonald, Grebogi, Ott, Yorke: Fractal basin boundaries, Physica 17D (1985).) Doubling
/// is exact.
template <int hundredths> CellLabel escape(double x, double y) {
    const double lambda = hundredths / 100.0;
    for (int n = 1; n < 1000; ++n) {
        y = lambda * y + std::cos(2 * std::numbers::pi * x);
        x = 2 * x - std::floor(2 * x);
        if (std::abs(y) > 1 / (lambda - 1)) // beyond, |y| grows
            return {y > 0 ? 1 : 2, n};
    }
    return {};
}

/// Label and number of wrong squares: the picture against the labels of all finest centres.
template <class F> int wrong_squares(const Refined& r, F f) {
    const int n = r.tree.side(r.tree.levels());
    const Picture picture = r.paint(n, n);
    const CellGrid grid({0, r.box.low[0], r.box.high[0], n}, {1, r.box.low[1], r.box.high[1], n});
    int wrong = 0;
    for (std::int32_t c = 0; c < grid.cells(); ++c) {
        const Point at = grid.centre(c);
        wrong += picture.label[std::size_t(c)] != f(at[0], at[1]).label;
    }
    return wrong;
}

/// Neighbouring leaves, corners included: those with different labels are of the finest level, and
/// no two are more than a level apart.
void check_closed_and_balanced(const Refined& r) {
    const int n = r.tree.side(r.tree.levels());
    int open = 0, unbalanced = 0;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (const auto& [di, dj] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
                if (i + di >= n || j + dj >= n || j + dj < 0)
                    continue;
                const Leaf &a = r.tree.at(i, j), &b = r.tree.at(i + di, j + dj);
                open +=
                    a.label.label != b.label.label && std::min(a.level, b.level) < r.tree.levels();
                unbalanced += std::abs(a.level - b.level) > 1;
            }
    CHECK(open == 0);
    CHECK(unbalanced == 0);
}

/// The counts agree with each other and with what the labeller saw.
template <class L> void check_counts(const Refined& r, const L& labels) {
    CHECK(labels.asked == r.trajectories + r.audit.points);
    long long split = 0;
    for (std::size_t k = 0; k + 1 < r.counts.size(); ++k) {
        split += r.counts[k].marked;
        CHECK(r.counts[k].boundary <= r.counts[k].marked);
    }
    const long long roots = static_cast<long long>(r.tree.side(0)) * r.tree.side(0);
    CHECK(r.trajectories == roots + 4 * split);
    CHECK(r.leaves().size() == std::size_t(roots + 3 * split));
    CHECK(r.tree.size() == r.trajectories);
}

double area_of(const Refined& r, std::int32_t label) {
    double area = 0;
    for (const Leaf& leaf : r.leaves())
        if (leaf.label.label == label)
            area += std::pow(r.tree.side(leaf.level), -2.0);
    return area;
}

} // namespace

TEST_CASE("refine: a circle at 2048 x 2048 is that of all labels, from 3% of them", "[refine]") {
    Labels labels{circle};
    const Refined r = refine(labels, {});
    REQUIRE(r.status == Status::ok);
    CHECK(wrong_squares(r, circle) == 0);
    CHECK(double(r.trajectories) <= 0.03 * 2048 * 2048);
    check_counts(r, labels);
    check_closed_and_balanced(r);
    // only squares with a neighbour of another label can be crossed
    const double pixel = std::pow(2048, -2);
    CHECK(std::abs(area_of(r, 2) - std::numbers::pi * 0.35 * 0.35) <=
          double(r.counts[6].boundary) * pixel);
    CHECK(area_of(r, 1) + area_of(r, 2) == Approx(1).epsilon(1e-12));
    // counts on four levels double to within the squares by which each can be off, some 1%
    CHECK(r.dimension.value == Approx(1).margin(0.01));
    CHECK(r.dimension.error < 0.01);
    CHECK(r.audit.points == 1000);
    CHECK(r.audit.wrong == 0);
    CHECK(r.audit.share == Approx(1 - double(r.counts[6].boundary) * pixel).epsilon(1e-12));
}

TEST_CASE("refine: a half plane on a rectangle, whatever the levels", "[refine]") {
    const auto f = [](double x, double y) { return half_plane(x / 40, y + 3); };
    for (int levels = 0; levels <= 6; ++levels) {
        RefineSettings settings{.coarse = 7, .levels = levels};
        Labels labels{f};
        const Refined r = refine(labels, {{0, -3}, {40, -2}}, settings);
        REQUIRE(r.status == Status::ok);
        CHECK(wrong_squares(r, f) == 0);
        check_counts(r, labels);
        check_closed_and_balanced(r);
        // on x + 0.3 y = 0.6 of the unit square: a trapezium
        const double exact = 1 - (0.6 + 0.3) / 2, n = r.tree.side(levels);
        CHECK(std::abs(area_of(r, 2) - exact) <= double(r.counts.back().boundary) / (n * n));
        if (levels == 6)
            CHECK(r.dimension.value == Approx(1).margin(0.01));
    }
}

TEST_CASE("refine: paints at any resolution from the leaf that holds the pixel's centre",
          "[refine]") {
    Labels labels{[](double x, double y) {
        CellLabel label = circle(x, y);
        label.time = int(1000 * x);
        return label;
    }};
    const Refined r = refine(labels, {}, {.coarse = 12, .levels = 4});
    for (const auto& [nx, ny] : {std::pair{1, 1}, {5, 300}, {511, 7}, {1000, 1000}}) {
        const Picture picture = r.paint(nx, ny);
        REQUIRE(picture.label.size() == std::size_t(nx) * std::size_t(ny));
        for (int i = 0; i < nx; ++i)
            for (int j = 0; j < ny; ++j) {
                const double x = (i + 0.5) / nx, y = (j + 0.5) / ny;
                // 192 squares: a centre on a line belongs to the square that begins there
                const Leaf& leaf = r.tree.at(int(std::floor(192 * x)), int(std::floor(192 * y)));
                const auto at = std::size_t(i) * std::size_t(ny) + std::size_t(j);
                if (std::abs(std::remainder(192 * x, 1)) > 1e-9 &&
                    std::abs(std::remainder(192 * y, 1)) > 1e-9)
                    REQUIRE(picture.label[at] == leaf.label.label);
                REQUIRE(picture.time[at] >= 0);
            }
    }
    const Leaf first = r.leaves().front();
    CHECK(first.label.time == int(1000 * r.point(first)[0]));
    CHECK_THROWS_WITH(r.paint(0, 5), ContainsSubstring("nx = 0"));
    CHECK_THROWS_WITH(r.paint(5, 100'001), ContainsSubstring("ny = 100001"));
}

TEST_CASE("refine: fractal boundaries have the dimension that is known", "[refine]") {
    const auto check = [](auto f, double lambda) {
        Labels labels{f};
        const Refined r = refine(labels, {{0, -1}, {1, 1}});
        REQUIRE(r.status == Status::ok);
        check_counts(r, labels);
        // The squares of the smooth part, ~1/size, are still some of the ~1/size^D that count:
        // from 256 to 2048 squares the growth comes near D from below.
        const double exact = 2 - std::log2(lambda);
        CHECK(std::abs(r.dimension.value - exact) < 0.05);
        CHECK(r.dimension.value < exact);
        // Squares that refinement got wrong are no more than the audit lets one expect.
        CHECK(wrong_squares(r, f) <= r.audit.bound * r.audit.share * 2048 * 2048);
        CHECK(double(r.trajectories) < 0.2 * 2048 * 2048);
    };
    check(escape<130>, 1.3); // 1.621
    check(escape<150>, 1.5); // 1.415
    check(escape<170>, 1.7); // 1.234
}

TEST_CASE("refine: a tongue seen at one end is followed to the other", "[refine]") {
    // along a line of every grid: no centre within 1/64 is on it at first, save at the wide end
    const auto f = [](double x, double y) { return inside(std::abs(y - 0.5) < 0.02 * (1 - x)); };
    Labels labels{f};
    const Refined r = refine(labels, {});
    REQUIRE(r.status == Status::ok);
    CHECK(wrong_squares(r, f) == 0);
    check_closed_and_balanced(r);
    CHECK(r.leaves().size() < 40'000);
}

TEST_CASE("refine: what all first centres miss, the audit finds", "[refine]") {
    // 4/1000 of the plane, between two rows of centres
    const auto f = [](double, double y) { return inside(std::abs(y - 0.5) < 0.002); };
    const double area = 0.004;
    int held = 0, found = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        Labels labels{f};
        const Refined r = refine(labels, {}, {.seed = seed});
        REQUIRE(r.trajectories == 32 * 32);
        REQUIRE(r.audit.share == 1);
        held += r.audit.bound >= area;
        found += r.audit.wrong > 0;
        CHECK(r.audit.bound < 5 * area);
    }
    // at least 95% of 200, less 3.2 standard deviations of 3; and 1 - 0.996^1000 = 0.982 of them
    CHECK(held >= 180);
    CHECK(found >= 187);
}

TEST_CASE("refine: the audit weighs by area, and leaves boundaries out", "[refine]") {
    // a disc, and a strip that is never seen, of 1/500 of the height, in the quarter beyond it
    const auto f = [](double x, double y) {
        if (x > 0.5 && std::abs(y - 0.9375) < 0.001)
            return CellLabel{3, 0};
        return inside((x - 0.25) * (x - 0.25) + (y - 0.25) * (y - 0.25) < 0.04);
    };
    Labels labels{f};
    const Refined r = refine(labels, {}, {.levels = 5, .audit = 400'000});
    REQUIRE(r.status == Status::ok);
    CHECK(area_of(r, 3) == 0);
    // 0.5 * 0.002 of the plane are wrong, and none of that is beside a boundary
    const double expected = 0.001 / r.audit.share, sd = std::sqrt(expected / 400'000);
    CHECK(std::abs(r.audit.wrong / 400'000.0 - expected) < 4 * sd);
    CHECK(r.audit.bound > expected);
    CHECK(r.audit.bound < expected + 6 * sd);
}

TEST_CASE("refine: jumps of the time are refined where that is asked for", "[refine]") {
    const auto f = [](double x, double) { return CellLabel{1, x < 0.3 ? 2 : x < 0.7 ? 4 : 40}; };
    Labels plain{f}, jumps{f};
    CHECK(refine(plain, {}).trajectories == 32 * 32);
    const Refined r = refine(jumps, {}, {.levels = 3, .time_jump = 2});
    REQUIRE(r.status == Status::ok);
    for (const Leaf& leaf : r.leaves()) {
        const double x = r.point(leaf)[0], width = 1.0 / r.tree.side(leaf.level);
        if (std::abs(x - 0.7) < width)
            CHECK(leaf.level == 3);
        if (std::abs(x - 0.3) < width) // a jump by 2 is not larger than 2
            CHECK(leaf.level == 0);
    }
    CHECK(r.counts[1].boundary == 0);
    CHECK(r.counts[1].marked > 0);
    CHECK(std::isnan(r.dimension.value));
}

TEST_CASE("refine: labels without any order stop it, and it says so", "[refine]") {
    const auto riddled = [](double x, double y) {
        std::uint64_t bits = std::uint64_t(x * 0x1p20) << 20 ^ std::uint64_t(y * 0x1p20);
        for (const std::uint64_t factor : {0xBF58476D1CE4E5B9u, 0x94D049BB133111EBu})
            bits = (bits ^ (bits >> 30)) * factor;
        return inside(bits >> 63 == 0);
    };
    Labels labels{riddled};
    const Refined r = refine(labels, {});
    CHECK(r.status == Status::not_converged);
    CHECK_THAT(r.message, ContainsSubstring("-dimensional from level 0 to level 3"));
    CHECK(double(r.counts[3].marked) > 0.98 * 64 * 32 * 32);
    CHECK(double(r.trajectories) <= 0.03 * 2048 * 2048);
    CHECK(r.trajectories == labels.asked - r.audit.points);
    CHECK(r.dimension.value == Approx(2).margin(0.02)); // 1 of 256 squares has equal neighbours
    CHECK(r.paint(256, 256).label[0] > 0);
    // in a tenth of the picture only
    Labels corner{[&](double x, double y) { return x * y > 0.6 ? riddled(x, y) : inside(false); }};
    CHECK(refine(corner, {}).status == Status::not_converged);
    // unless told that this is no reason
    Labels all{riddled};
    const Refined full = refine(all, {}, {.levels = 4, .full_dimension = 9});
    CHECK(full.status == Status::ok);
    CHECK(wrong_squares(full, riddled) < 512 * 512 / 256);
}

TEST_CASE("refine: stops before max_points, and keeps what it has", "[refine]") {
    Labels labels{circle};
    const Refined r = refine(labels, {}, {.max_points = 10'000});
    CHECK(r.status == Status::max_steps);
    CHECK_THAT(r.message, ContainsSubstring("max_points"));
    CHECK(r.trajectories <= 10'000);
    CHECK(labels.asked == r.trajectories + r.audit.points);
    CHECK(area_of(r, 2) == Approx(std::numbers::pi * 0.35 * 0.35).epsilon(0.02));
}

TEST_CASE("refine: an interrupted labeller ends the picture, what it did not label is unresolved",
          "[refine]") {
    int batches = 0;
    const auto labeller = [&](std::span<const Point> points, std::span<CellLabel> labels) {
        for (std::size_t k = 0; k < points.size() / 2; ++k)
            labels[k] = circle(points[k][0], points[k][1]);
        if (batches++ == 3)
            return false;
        for (std::size_t k = points.size() / 2; k < points.size(); ++k)
            labels[k] = circle(points[k][0], points[k][1]);
        return true;
    };
    const Refined r = refine(labeller, {});
    CHECK(r.status == Status::interrupted);
    CHECK(batches == 4);
    CHECK(area_of(r, 0) > 0);
    CHECK(area_of(r, 0) < 0.1);
    CHECK(r.audit.points == 0);
    CHECK(std::isnan(r.dimension.value));
}

TEST_CASE("refine: the bound of Clopper and Pearson solves its equation", "[refine]") {
    CHECK(clopper_pearson_upper(0, 1000) == Approx(1 - std::pow(0.05, 1e-3)).epsilon(1e-12));
    CHECK(clopper_pearson_upper(999, 1000) == Approx(std::pow(0.95, 1e-3)).epsilon(1e-12));
    CHECK(clopper_pearson_upper(7, 7) == 1);
    CHECK(clopper_pearson_upper(0, 0) == 1);
    for (const double confidence : {0.5, 0.95, 0.999})
        for (int m = 1; m <= 40; ++m)
            for (int k = 0; k < m; ++k) {
                const long double p = clopper_pearson_upper(k, m, confidence);
                long double term = std::pow(1 - p, static_cast<long double>(m)), sum = 0;
                for (int i = 0; i <= k; ++i) {
                    sum += term;
                    term *= p / (1 - p) * (m - i) / (i + 1);
                }
                REQUIRE(double(sum) == Approx(1 - confidence).epsilon(1e-10));
            }
    // 1000 of 10^6: its normal approximation is right to the skewness, 1/sqrt(1000) of the width
    CHECK(clopper_pearson_upper(1000, 1'000'000) ==
          Approx(1e-3 + 1.6449 * std::sqrt(1e-9)).epsilon(2e-3));
    CHECK_THROWS_WITH(clopper_pearson_upper(5, 4), ContainsSubstring("k = 5"));
    CHECK_THROWS_WITH(clopper_pearson_upper(1, 4, 1), ContainsSubstring("confidence = 1"));
}

TEST_CASE("refine: refuses what makes no sense", "[refine]") {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const auto refused = [](const Rectangle& box, const RefineSettings& s, const char* words) {
        Labels labels{circle};
        CHECK_THROWS_WITH(refine(labels, box, s), ContainsSubstring(words));
        CHECK(labels.asked == 0);
    };
    refused({{nan, 0}, {1, 1}}, {}, "low[0] = nan");
    refused({{0, 1}, {1, 1}}, {}, "high[1] = 1: expected a finite number > low");
    refused({{0, 0}, {1, nan}}, {}, "high[1] = nan");
    refused({}, {.coarse = 0}, "coarse = 0");
    refused({}, {.levels = -1}, "levels = -1");
    refused({}, {.levels = 16}, "levels = 16: expected an integer >= 0 with coarse * 2^levels");
    refused({}, {.time_jump = -1}, "time_jump = -1");
    refused({}, {.full_dimension = nan}, "full_dimension = nan");
    refused({}, {.max_points = 0}, "max_points = 0");
    refused({}, {.coarse = 40, .max_points = 1000}, "expected at most max_points squares");
    refused({}, {.audit = -1}, "audit = -1");
}
