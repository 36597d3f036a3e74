// SPDX-License-Identifier: BSD-3-Clause
// Numbers of basins against closed forms, published tables and exactly known boundaries.

#include "catch.hpp"

#include <filippov/basins/basin_numbers.hpp>

#include <functional>
#include <numeric>
#include <vector>

using namespace filippov;

namespace {

const double ln2 = std::numbers::ln2, ln3 = std::log(3.0);

/// Labels of a grid by row and column.
struct Picture {
    std::vector<Label> labels;
    std::size_t columns;
    LabelGrid grid() const { return {labels, columns}; }
};

template <class F> Picture picture(std::size_t rows, std::size_t columns, F label) {
    Picture made{{}, columns};
    for (std::size_t row = 0; row < rows; ++row)
        for (std::size_t column = 0; column < columns; ++column)
            made.labels.push_back(static_cast<Label>(label(row, column)));
    return made;
}

/// The centre of cell i of n on [0, 1].
double centre(std::size_t i, std::size_t n) {
    return (static_cast<double>(i) + 0.5) / static_cast<double>(n);
}

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Entropy of two labels with shares p and 1 - p.
double entropy(double p) { return -p * std::log(p) - (1 - p) * std::log(1 - p); }

/// P(Binomial(n, p) = k).
double binomial(int k, int n, double p) {
    return std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                    k * std::log(p) + (n - k) * std::log1p(-p));
}

const Fraction& of(const std::vector<Fraction>& fractions, Label label) {
    for (const Fraction& fraction : fractions)
        if (fraction.label == label)
            return fraction;
    FAIL("no label " << label);
    return fractions.front();
}

using Points = std::span<const std::array<double, 2>>;

/// A labeller from a label of one point.
template <class F> auto labelling(F label) {
    return [label](Points points, std::span<Label> labels) {
        for (std::size_t k = 0; k < points.size(); ++k)
            labels[k] = label(points[k][0], points[k][1]);
    };
}

/// The gap of the middle-third Cantor set in which x lies, every gap with a label of its own, down
/// to gaps of length 3^-28.
Label gap(double x) {
    if (!(x > 0 && x < 1))
        return 1;
    Label name = 1; // 1, then a binary digit a level: left or right
    for (int level = 1; level <= 28; ++level) {
        x *= 3;
        if (x > 1 && x < 2)
            break;
        name = 2 * name + (x >= 2);
        x -= x >= 2 ? 2 : 0;
    }
    return name + 1;
}

std::vector<PairCount> counts_of(std::initializer_list<std::array<double, 3>> list) {
    std::vector<PairCount> counts;
    for (const auto& [epsilon, uncertain, trials] : list) {
        PairCount count;
        count.epsilon = epsilon;
        count.uncertain = std::llround(uncertain);
        count.trials = std::llround(trials);
        counts.push_back(count);
    }
    return counts;
}

using Point = Vec<double, Eigen::Dynamic>;

Point at(double x) { return Point::Constant(1, x); }
Point at(double x, double y) { return Vec<double, 2>(x, y); }

/// Attractors of one point each.
std::vector<KnownAttractor> known_at(const std::vector<double>& x) {
    std::vector<KnownAttractor> known;
    for (std::size_t i = 0; i < x.size(); ++i)
        known.push_back({static_cast<Label>(i + 1), {at(x[i])}});
    return known;
}
std::vector<AttractorPoints> found_at(const std::vector<double>& x) {
    std::vector<AttractorPoints> found;
    for (const double value : x)
        found.push_back({at(value)});
    return found;
}

} // namespace

// --- fractions ---------------------------------------------------------------------------------

TEST_CASE("wilson_fraction: has the published intervals", "[basin_numbers]") {
    // Newcombe, Stat. Med. 17 (1998) 857, table I, method 3; the last two by hand: 0 of n has the
    // upper end z^2/(n + z^2), z = 1.959964
    struct Row {
        long long count, n;
        double low, high;
    };
    for (const Row& row :
         {Row{81, 263, 0.2553, 0.3662}, Row{15, 148, 0.0624, 0.1605}, Row{0, 20, 0.0000, 0.1611},
          Row{1, 29, 0.0061, 0.1718}, Row{0, 10, 0.0000, 0.2775}, Row{10, 10, 0.7225, 1.0000}}) {
        INFO(row.count << " of " << row.n);
        const Fraction f = wilson_fraction(1, row.count, row.n);
        CHECK(f.low == Approx(row.low).epsilon(0).margin(0.5e-4)); // four digits are printed
        CHECK(f.high == Approx(row.high).epsilon(0).margin(0.5e-4));
        CHECK(f.value == double(row.count) / double(row.n));
        CHECK(f.count == row.count);
    }
    CHECK(wilson_fraction(1, 0, 10).low == 0);
    CHECK(wilson_fraction(1, 10, 10).high == 1);
}

TEST_CASE("wilson_fraction: its ends are the shares that a score test just accepts",
          "[basin_numbers]") {
    // quantiles of the normal distribution, to the digits of tables
    for (const auto& [level, z] : {std::pair{0.5, 0.674489750196},
                                   {0.9, 1.644853626951},
                                   {0.95, 1.959963984540},
                                   {0.999999, 4.891638475699}})
        for (const auto& [count, n] : {std::pair{1LL, 7LL}, {3, 10}, {499, 1000}, {1, 100'000'000}})
            for (const bool upper : {false, true}) {
                const Fraction f = wilson_fraction(1, count, n, level);
                const double p = upper ? f.high : f.low;
                const double score = std::abs(f.value - p) / std::sqrt(p * (1 - p) / double(n));
                CHECK(score == Approx(z).epsilon(1e-11)); // digits of the table
            }
}

TEST_CASE("sampled_fractions: intervals cover the truth as often as the binomial law says",
          "[basin_numbers]") {
    const int n = 200, repetitions = 4000;
    for (const double p : {0.03, 0.3, 0.5}) {
        double exact = 0;
        for (int k = 0; k <= n; ++k) {
            const Fraction f = wilson_fraction(1, k, n);
            exact += f.low <= p && p <= f.high ? binomial(k, n, p) : 0;
        }
        CHECK(exact == Approx(0.95).margin(0.02)); // steps of k: the interval cannot have 0.95
        std::mt19937_64 random(7);
        int covered = 0;
        for (int i = 0; i < repetitions; ++i) {
            std::vector<Label> labels;
            for (int k = 0; k < n; ++k)
                labels.push_back(uniform(random) < p ? 1 : 2);
            const Label also[] = {1};
            const Fraction f = of(sampled_fractions(labels, 0.95, also), 1);
            covered += f.low <= p && p <= f.high;
        }
        // four standard deviations of the simulation
        CHECK(double(covered) / repetitions ==
              Approx(exact).margin(4 * std::sqrt(exact * (1 - exact) / repetitions)));
    }
}

TEST_CASE("sampled_fractions: every label has its entry, in order", "[basin_numbers]") {
    const std::vector<Label> labels{3, -1, 0, 3};
    const Label also[] = {3, 7};
    const auto fractions = sampled_fractions(labels, 0.95, also);
    REQUIRE(fractions.size() == 4);
    const std::vector<std::pair<Label, long long>> expected{{-1, 1}, {0, 1}, {3, 2}, {7, 0}};
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK(fractions[i].label == expected[i].first);
        CHECK(fractions[i].count == expected[i].second);
    }
    CHECK(fractions[3].high == Approx(0.4899).margin(1e-4)); // z^2/(4 + z^2)
}

TEST_CASE("grid_fractions: boundary cells are counted on both sides", "[basin_numbers]") {
    // 1 1 2
    // 1 1 2
    // 1 1 0
    const Picture p{{1, 1, 2, 1, 1, 2, 1, 1, 0}, 3};
    const auto fractions = grid_fractions(p.grid());
    REQUIRE(fractions.size() == 3);
    const auto check = [&](Label label, int cells, int low, int high) {
        INFO("label " << label);
        const Fraction& f = of(fractions, label);
        CHECK(f.count == cells);
        CHECK(f.value == Approx(cells / 9.0));
        CHECK(f.low == Approx(low / 9.0).margin(1e-15));
        CHECK(f.high == Approx(high / 9.0));
    };
    check(0, 1, 0, 3); // beside it, a 1 and a 2
    check(1, 6, 3, 9);
    check(2, 2, 0, 5); // beside it, two 1 and the 0
    // an island: four cells around it may be its, one cell may be the sea's
    const Picture island{{1, 1, 1, 1, 2, 1, 1, 1, 1}, 3};
    const auto two = grid_fractions(island.grid());
    CHECK(of(two, 2).low == 0);
    CHECK(of(two, 2).high == Approx(5.0 / 9));
    CHECK(of(two, 1).low == Approx(4.0 / 9));
    CHECK(of(two, 1).high == 1);
    const auto whole = grid_fractions(picture(4, 5, [](auto, auto) { return 1; }).grid());
    REQUIRE(whole.size() == 1);
    CHECK(whole[0].low == 1);
    CHECK(whole[0].high == 1);
}

TEST_CASE("grid_fractions: the area of a disc lies between the bounds, which close in",
          "[basin_numbers]") {
    std::mt19937_64 random(11);
    for (const std::size_t n : {20, 80, 320})
        for (int k = 0; k < 25; ++k) {
            const double r = 0.1 + 0.2 * uniform(random);
            const double x0 = 0.4 + 0.2 * uniform(random), y0 = 0.4 + 0.2 * uniform(random);
            const Picture p = picture(n, n, [&](auto row, auto column) {
                return std::hypot(centre(column, n) - x0, centre(row, n) - y0) < r ? 1 : 2;
            });
            const double area = std::numbers::pi * r * r;
            const Fraction f = of(grid_fractions(p.grid()), 1);
            CHECK(f.low <= area);
            CHECK(f.high >= area);
            // a circle has fewer than 8 r n cells on either side
            CHECK(f.high - f.low < 16 * r / double(n));
        }
}

// --- basin entropy -----------------------------------------------------------------------------

TEST_CASE("basin_entropy: a straight boundary has its closed form, wherever the boxes lie",
          "[basin_numbers]") {
    const auto half = [](std::size_t border) {
        return picture(100, 100, [=](auto, auto column) { return column < border ? 1 : 2; });
    };
    const BasinEntropy cut = basin_entropy(half(52).grid()); // 2 : 3 in 20 of 400 boxes
    CHECK(cut.boxes == 400);
    CHECK(cut.boundary_boxes == 20);
    CHECK(cut.boundary == Approx(entropy(0.4)).epsilon(1e-14));
    CHECK(cut.mean == Approx(entropy(0.4) / 20).epsilon(1e-14));
    // shifts by 0 ... 4 columns cut 2, 1, 0, 4, 3 columns off; from 1 on there are 19 in a row
    CHECK(cut.boundary_error == Approx((entropy(0.4) - entropy(0.2)) / 2).epsilon(1e-12));
    const double mean[] = {entropy(0.4) / 20, entropy(0.2) / 19, 0, entropy(0.2) / 19,
                           entropy(0.4) / 19};
    double sum = 0, square = 0;
    for (const double m : mean) {
        sum += m / 5;
        square += m * m / 5;
    }
    CHECK(cut.mean_error == Approx(std::sqrt(square - sum * sum)).epsilon(1e-9));

    const BasinEntropy between = basin_entropy(half(50).grid()); // falls between two boxes
    CHECK(between.mean == 0);
    CHECK(between.boundary_boxes == 0);
    CHECK(std::isnan(between.boundary));
    CHECK_FALSE(between.passes_log2_test());
    CHECK(between.mean_error > 0); // and yet it is there
}

TEST_CASE("basin_entropy: checkerboards and boxes of three labels have their closed forms",
          "[basin_numbers]") {
    const Picture board = picture(50, 50, [](auto i, auto j) { return 1 + (i + j) % 2; });
    const BasinEntropy e = basin_entropy(board.grid());
    CHECK(e.boxes == 100);
    CHECK(e.boundary_boxes == 100);
    CHECK(e.mean == Approx(entropy(12.0 / 25)).epsilon(1e-13));
    CHECK(e.boundary == e.mean);
    CHECK(e.mean_error == Approx(0).margin(1e-15));

    const Picture thirds = picture(9, 9, [](auto, auto j) { return 1 + j % 3; });
    CHECK(basin_entropy(thirds.grid(), 3).boundary == Approx(ln3).epsilon(1e-14));
    CHECK(basin_entropy(thirds.grid(), 3).passes_log2_test());

    // one box: shares 10, 10 and 5 of 25; without another placement there is no error, no verdict
    const Picture one = picture(5, 5, [](auto, auto j) { return 1 + j / 2; });
    const BasinEntropy single = basin_entropy(one.grid());
    CHECK(single.boundary == Approx(0.8 * std::log(2.5) + 0.2 * std::log(5)).epsilon(1e-14));
    CHECK(std::isnan(single.boundary_error));
    CHECK_FALSE(single.passes_log2_test());
}

TEST_CASE("basin_entropy: leaves unresolved cells out and counts them", "[basin_numbers]") {
    // left half of each box unresolved, the rest 1 : 1; one box of four wholly unresolved
    const Picture p = picture(8, 8, [](auto i, auto j) {
        return (i < 4 && j < 4) || j % 4 < 2 ? label_unresolved : Label(1 + i % 2);
    });
    const BasinEntropy e = basin_entropy(p.grid(), 4);
    CHECK(e.unresolved == 40);
    CHECK(e.boxes == 3);
    CHECK(e.boundary_boxes == 3);
    CHECK(e.mean == Approx(ln2).epsilon(1e-14));
    const Picture none = picture(4, 4, [](auto, auto) { return label_unresolved; });
    CHECK(std::isnan(basin_entropy(none.grid(), 4).mean));
}

TEST_CASE("basin_entropy: two labels never pass the log 2 test, riddled ones of three do",
          "[basin_numbers]") {
    std::mt19937_64 random(3);
    for (const int labels : {2, 3}) {
        const Picture noise =
            picture(60, 60, [&](auto, auto) { return 1 + int(labels * uniform(random)); });
        const BasinEntropy e = basin_entropy(noise.grid());
        CHECK((e.boundary > ln2) == (labels == 3));
        CHECK(e.passes_log2_test() == (labels == 3));
        // to second order E S = ln k - (k - 1)/2n for n cells drawn at random
        CHECK(e.boundary == Approx(std::log(labels) - (labels - 1) / 50.0).margin(0.01));
    }
    for (const double slope : {0.0, 0.3, 0.77, 1.0}) { // straight boundaries of two basins
        const Picture line = picture(
            200, 200, [&](auto i, auto j) { return double(i) > 40.5 + slope * double(j) ? 1 : 2; });
        const BasinEntropy e = basin_entropy(line.grid());
        CHECK(e.boundary < ln2);
        CHECK_FALSE(e.passes_log2_test());
    }
}

// --- uncertainty exponent ----------------------------------------------------------------------

TEST_CASE("chi2_probability: has the values of tables", "[basin_numbers]") {
    // the upper 5 % and 1 % points, to three decimals
    for (const auto& [chi2, degrees] :
         {std::pair{3.841, 1}, {5.991, 2}, {7.815, 3}, {18.307, 10}, {32.671, 21}})
        CHECK(detail::chi2_probability(chi2, degrees) == Approx(0.05).margin(2e-5));
    CHECK(detail::chi2_probability(6.635, 1) == Approx(0.01).margin(1e-5));
    CHECK(detail::chi2_probability(0, 1) == 1);
    CHECK(detail::chi2_probability(0, 4) == 1);
    CHECK(detail::chi2_probability(1e6, 3) == 0);
}

TEST_CASE("uncertainty_exponent: an exact power law is met exactly", "[basin_numbers]") {
    // f = epsilon^(1/2), and two points: their line, and the sum of their variances
    const auto fit = uncertainty_exponent(counts_of({{1.0 / 4, 500, 1000}, {1.0 / 16, 250, 1000}}));
    CHECK(fit.alpha == Approx(0.5).epsilon(1e-14));
    CHECK(fit.dimension == Approx(1.5).epsilon(1e-14));
    CHECK(fit.log_factor == Approx(0).margin(1e-14));
    const double variance = 0.5 / 500 + 0.75 / 250;
    CHECK(fit.error == Approx(std::sqrt(variance) / std::log(4)).epsilon(1e-13));
    CHECK(fit.degrees == 0);
    CHECK(std::isnan(fit.probability));
    CHECK(fit.left_out.empty());
    const auto three = uncertainty_exponent(
        counts_of({{1.0 / 4, 500, 1000}, {1.0 / 16, 250, 1000}, {1.0 / 64, 125, 1000}}), 3);
    CHECK(three.alpha == Approx(0.5).epsilon(1e-14));
    CHECK(three.dimension == Approx(2.5).epsilon(1e-14));
    CHECK(three.chi2 == Approx(0).margin(1e-20));
    CHECK(three.probability == Approx(1));
}

TEST_CASE("uncertainty_exponent: leaves out what has no logarithm, and says so",
          "[basin_numbers]") {
    const auto fit = uncertainty_exponent(counts_of(
        {{1, 1000, 1000}, {0.25, 500, 1000}, {0.0625, 250, 1000}, {1e-6, 0, 1000}, {0.1, 0, 0}}));
    CHECK(fit.alpha == Approx(0.5).epsilon(1e-14));
    CHECK(std::isfinite(fit.error));
    CHECK(fit.left_out == std::vector<std::size_t>{0, 3, 4});
    for (const auto& counts : {counts_of({}), counts_of({{0.1, 0, 10}, {0.2, 0, 10}}),
                               counts_of({{0.1, 3, 10}, {0.1, 4, 10}})}) {
        const auto none = uncertainty_exponent(counts);
        CHECK(std::isnan(none.alpha));
        CHECK(std::isnan(none.error));
    }
}

TEST_CASE("uncertainty_exponent: a fit that is bad has a larger error", "[basin_numbers]") {
    const auto fit = uncertainty_exponent(
        counts_of({{1.0 / 4, 5000, 10'000}, {1.0 / 16, 2000, 10'000}, {1.0 / 64, 1250, 10'000}}));
    // three points evenly spaced: chi2 is that of their second difference
    const double w0 = 5000 / 0.5, w1 = 2000 / 0.8, w2 = 1250 / 0.875;
    const double bend = std::log(0.5) - 2 * std::log(0.2) + std::log(0.125);
    CHECK(fit.chi2 == Approx(bend * bend / (1 / w0 + 4 / w1 + 1 / w2)).epsilon(1e-12));
    CHECK(fit.degrees == 1);
    CHECK(fit.probability < 1e-6);
    const double spread = (w0 * w1 + w1 * w2 + 4 * w0 * w2) / (w0 + w1 + w2);
    CHECK(fit.error == Approx(std::sqrt(fit.chi2 / spread) / std::log(4)).epsilon(1e-12));
}

namespace {

/// (alpha - truth)/error over many seeds, and the mean of the fits' probabilities.
struct Pulls {
    double mean = 0, square = 0, probability = 0;
    int within2 = 0, n = 0;
};

template <class F>
Pulls pulls(F label, const std::array<double, 2>& low, const std::array<double, 2>& high,
            const std::vector<double>& epsilons, long long pairs, double truth, int seeds) {
    Pulls p;
    p.n = seeds;
    for (int seed = 1; seed <= seeds; ++seed) {
        const auto counts = count_pairs(low, high, labelling(label), epsilons, pairs,
                                        static_cast<std::uint64_t>(seed));
        const auto fit = uncertainty_exponent(counts);
        REQUIRE(fit.left_out.empty());
        const double pull = (fit.alpha - truth) / fit.error;
        p.mean += pull / seeds;
        p.square += pull * pull / seeds;
        p.probability += fit.probability / seeds;
        p.within2 += std::abs(pull) < 2;
    }
    return p;
}

} // namespace

TEST_CASE("uncertainty_exponent: is 1 for smooth boundaries, within its error bars",
          "[basin_numbers]") {
    // up to 0.16 of a radius of 1: f is bent by d^2/24, a thousandth
    const std::vector<double> epsilons{0.04, 0.02, 0.01, 0.005, 0.0025};
    for (const bool disc : {false, true}) {
        const auto label = [=](double x, double y) {
            return disc ? (std::hypot(x, y) < 1 ? 1 : 2) : (y < 0.3 * x ? 1 : 2);
        };
        const Pulls p = pulls(label, {-2, -2}, {2, 2}, epsilons, 20'000, 1, 100);
        CAPTURE(disc, p.mean, p.square, p.probability, p.within2);
        CHECK(p.within2 >= 90);
    }
}

TEST_CASE("uncertainty_exponent: is 1 - ln 2/ln 3 for Cantor's set times a line",
          "[basin_numbers]") {
    std::vector<double> epsilons; // 3^-k over the side 2
    for (int k = 2; k <= 8; ++k)
        epsilons.push_back(std::pow(3, -k) / 2);
    const auto label = [](double x, double) { return gap(x); };
    const std::array<double, 2> low{-0.5, 0}, high{1.5, 1};
    // Points less than 3^-k left of the set have measure 2 (2/3)^k, half the pairs lie along x.
    const long long n = 20'000;
    const auto counts = count_pairs(low, high, labelling(label), epsilons, n, 1);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const double f = std::pow(2.0 / 3, double(i + 2)) / 2;
        CHECK(counts[i].trials == n);
        CHECK(double(counts[i].uncertain) / double(n) ==
              Approx(f).margin(4 * std::sqrt(f * (1 - f) / double(n)))); // four deviations
    }
    const double alpha = 1 - ln2 / ln3;
    const Pulls p = pulls(label, low, high, epsilons, n, alpha, 100);
    CAPTURE(p.mean, p.square, p.probability, p.within2);
    CHECK(p.within2 >= 90);
    const auto fit = uncertainty_exponent(counts);
    CHECK(fit.dimension == 2 - fit.alpha);
}

TEST_CASE("count_pairs: a boundary is seen by the pairs that lie across it", "[basin_numbers]") {
    const std::array<double, 2> low{-3, 10}, high{5, 12};
    const std::vector<double> epsilons{0.5, 0.125, 1e-3};
    const long long n = 40'000;
    const auto vertical = count_pairs(
        low, high, labelling([](double x, double) { return x < 2 ? 1 : 2; }), epsilons, n, 5);
    const auto horizontal = count_pairs(
        low, high, labelling([](double, double y) { return y < 11.3 ? 1 : -1; }), epsilons, n, 5);
    REQUIRE(vertical.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
        const double f = epsilons[i] / 2; // of the pairs, half lie along the coordinate
        const double margin = 4 * std::sqrt(f * (1 - f) / double(n));
        CHECK(double(vertical[i].uncertain) / double(n) == Approx(f).margin(margin));
        CHECK(double(horizontal[i].uncertain) / double(n) == Approx(f).margin(margin));
        CHECK(vertical[i].epsilon == epsilons[i]);
    }
}

TEST_CASE("count_pairs: asks for the same points again", "[basin_numbers]") {
    const std::vector<double> epsilons{0.25, 0.01};
    std::vector<std::vector<std::array<double, 2>>> batches;
    const auto record = [&](Points points, std::span<Label> labels) {
        batches.emplace_back(points.begin(), points.end());
        // a labeller that gives up after three of four points
        for (std::size_t k = 0; k < points.size(); ++k)
            labels[k] = k % 4 < 3 ? 1 : label_unresolved;
    };
    const auto counts = count_pairs({0, -1}, {4, 1}, record, epsilons, 100, 42);
    REQUIRE(batches.size() == 2);
    for (std::size_t b = 0; b < 2; ++b) {
        REQUIRE(batches[b].size() == 200);
        CHECK(counts[b].trials == 50);
        CHECK(counts[b].unresolved == 50);
        CHECK(counts[b].uncertain == 0);
        int along_x = 0;
        for (std::size_t k = 0; k < 200; k += 2) {
            const auto &p = batches[b][k], &q = batches[b][k + 1];
            const double dx = q[0] - p[0], dy = q[1] - p[1];
            const bool x = dy == 0;
            CHECK((x ? dx / 4 : dy / 2) == Approx(epsilons[b]).epsilon(1e-12));
            CHECK((x || dx == 0));
            CHECK((p[0] >= 0 && p[0] < 4 && p[1] >= -1 && p[1] < 1));
            along_x += x;
        }
        CHECK(along_x > 30); // of 100, half: four deviations
        CHECK(along_x < 70);
    }
    CHECK(batches[0] != batches[1]);
    // The generator is the standard's: its first number for this seed, by another program.
    std::mt19937_64 random(42);
    CHECK(batches[0][0][0] == 4 * double(random() >> 11) / 9007199254740992.0);
    const auto first = batches;
    batches.clear();
    count_pairs({0, -1}, {4, 1}, record, epsilons, 100, 42);
    CHECK(batches == first);
    batches.clear();
    count_pairs({0, -1}, {4, 1}, record, epsilons, 100, 43);
    CHECK(batches != first);
}

TEST_CASE("count_pairs: asks for a limited number of points, until it is told to stop",
          "[basin_numbers]") {
    const std::vector<double> epsilons{0.25, 0.01};
    std::vector<std::size_t> sizes;
    std::size_t most = 100;
    const auto ask = [&](Points points, std::span<Label> labels) {
        sizes.push_back(points.size());
        std::fill(labels.begin(), labels.end(), 1);
        return sizes.size() < most;
    };
    const auto counts = count_pairs({0, 0}, {1, 1}, ask, epsilons, 40'000, 1);
    CHECK(sizes == std::vector<std::size_t>{65'536, 14'464, 65'536, 14'464});
    REQUIRE(counts.size() == 2);
    CHECK(counts[0].trials == 40'000);
    sizes.clear();
    most = 3;
    CHECK(count_pairs({0, 0}, {1, 1}, ask, epsilons, 1'000'000'000, 1).empty());
    CHECK(sizes.size() == 3);
}

// --- box-counting dimension --------------------------------------------------------------------

TEST_CASE("box_dimension: straight boundaries and full ones are exact", "[basin_numbers]") {
    for (const std::size_t border : {1, 37, 64, 127}) { // also on the edge of boxes of every size
        const Picture line =
            picture(129, 129, [=](auto, auto column) { return column < border ? 1 : 2; });
        const BoxDimension d = box_dimension(line.grid());
        REQUIRE(d.counts.size() == 5);
        for (std::size_t k = 0; k < 5; ++k) {
            CHECK(d.counts[k].size == std::size_t(1) << k);
            CHECK(d.counts[k].boxes == 128 >> k);
        }
        CHECK(d.dimension == Approx(1).epsilon(1e-13));
        CHECK(d.error == Approx(0).margin(1e-13));
    }
    const Picture board = picture(129, 257, [](auto i, auto j) { return 1 + (i + j) % 2; });
    CHECK(box_dimension(board.grid()).dimension == Approx(2).epsilon(1e-13));
    const Picture bare = picture(40, 40, [](auto, auto) { return 3; });
    CHECK(std::isnan(box_dimension(bare.grid()).dimension));
    CHECK(box_dimension(bare.grid()).counts.back().boxes == 0);
}

TEST_CASE("box_dimension: a disc's boundary meets a box for each line of boxes that it crosses",
          "[basin_numbers]") {
    const std::size_t n = 1025;
    std::mt19937_64 random(13);
    int within = 0;
    for (int k = 0; k < 20; ++k) {
        const double r = 0.2 + 0.2 * uniform(random);
        const double x0 = 0.45 + 0.1 * uniform(random), y0 = 0.45 + 0.1 * uniform(random);
        const Picture p = picture(n, n, [&](auto i, auto j) {
            return std::hypot(centre(j, n) - x0, centre(i, n) - y0) < r ? 1 : 2;
        });
        const BoxDimension d = box_dimension(p.grid());
        REQUIRE(d.counts.size() == 8);
        // 2 r n/size lines, each crossed twice, in both directions; at either end of both the
        // circle may turn back before a line
        for (const BoxCount& count : d.counts)
            CHECK(double(count.boxes) ==
                  Approx(8 * r * double(n) / double(count.size)).epsilon(0).margin(8));
        within += std::abs(d.dimension - 1) < d.error;
        CHECK(std::abs(d.dimension - 1) < 2 * d.error);
        CHECK(d.error < 0.05);
    }
    // two thirds of 20, and two deviations
    CHECK(within >= 9);
}

TEST_CASE("box_dimension: self-similar boundaries have theirs", "[basin_numbers]") {
    // Sierpinski's triangle: binary digits of row and column have no 1 in common. Half the size,
    // and it is three copies of itself and the three boxes where they touch.
    const Picture triangle =
        picture(1025, 1025, [](auto i, auto j) { return (i & j) == 0 ? 1 : 2; });
    const BoxDimension t = box_dimension(triangle.grid());
    REQUIRE(t.counts.size() == 8);
    for (std::size_t k = 1; k < 8; ++k)
        CHECK(t.counts[k - 1].boxes == 3 * t.counts[k].boxes + 3);
    // so every local slope, and the fit, lies between log2(3) and log2(3 + 3/N) of the largest
    CHECK(t.dimension > ln3 / ln2);
    CHECK(t.dimension < std::log2(3 + 3 / double(t.counts.back().boxes)));
    CHECK(t.dimension - ln3 / ln2 < 2 * t.error);

    // Cantor's set times a line, boxes of sizes that do not fit it
    const std::size_t n = 2188; // 3^7 + 1
    const Picture cantor =
        picture(300, n, [](auto, auto j) { return gap((double(j) + 0.5) / 2187.0); });
    const BoxDimension c = box_dimension(cantor.grid());
    CAPTURE(c.dimension, c.error);
    CHECK(std::abs(c.dimension - (1 + ln2 / ln3)) < 2 * c.error);
    CHECK(c.error < 0.1);
}

TEST_CASE("error_of_fit: is that of the mean of slopes with the weights of least squares",
          "[basin_numbers]") {
    // slopes 1, 2, 4: the line through 0, 1, 3, 7 has their mean with weights 3, 4, 3
    const std::vector<double> x{0, 1, 2, 3}, y{0, 1, 3, 7}, one(4, 1.0), slopes{1, 2, 4};
    CHECK(detail::fit_line(x, y, one).slope == Approx((3 * 1 + 4 * 2 + 3 * 4) / 10.0));
    // their sample variance is 7/3, the squares of the weights are 34/100
    CHECK(detail::error_of_fit(slopes) == Approx(std::sqrt(7.0 / 3 * 0.34)).epsilon(1e-14));
    CHECK(std::isnan(detail::error_of_fit(std::vector<double>{1})));
}

TEST_CASE("box_dimension: sizes are as asked, and unresolved cells are no boundary",
          "[basin_numbers]") {
    const Picture line = picture(100, 100, [](auto, auto j) { return j < 50 ? 1 : 2; });
    const BoxDimension d = box_dimension(line.grid(), 3, 30); // 3, 6, 12, 24 on 96 rows
    REQUIRE(d.counts.size() == 4);
    for (std::size_t k = 0; k < 4; ++k) {
        CHECK(d.counts[k].size == 3u << k);
        CHECK(d.counts[k].boxes == 32 >> k);
    }
    const BoxDimension two = box_dimension(line.grid(), 8, 16);
    CHECK(two.dimension == Approx(1).epsilon(1e-13));
    CHECK(std::isnan(two.error)); // two points say nothing of their scatter
    const Picture veiled = picture(65, 65, [](auto, auto j) {
        return j < 34 ? 1 : j < 38 ? 0 : 2;
    });
    const BoxDimension v = box_dimension(veiled.grid());
    REQUIRE(v.counts.size() == 4);
    CHECK(v.counts[0].boxes == 0); // four cells are unresolved between the two
    CHECK(v.counts[2].boxes == 0);
    CHECK(v.counts[3].boxes == 8);
    CHECK(std::isnan(v.dimension)); // one size
    const BoxDimension wider = box_dimension(veiled.grid(), 1, 32);
    CHECK(wider.counts.size() == 6);
    CHECK(wider.dimension == Approx(1).epsilon(1e-13)); // 8, 16 and 32 are left
    CHECK(wider.error == Approx(0).margin(1e-13));
}

// --- attractors over a parameter ---------------------------------------------------------------

TEST_CASE("attractor_distance: is the larger mean of nearest distances", "[basin_numbers]") {
    const AttractorPoints a{at(0, 0), at(4, 0)}, b{at(0, 3), at(4, 0), at(4, 1)};
    // from a: 3, 0; from b: 3, 0, 1
    CHECK(attractor_distance(a, b, at(1, 1)) == Approx(1.5));
    CHECK(attractor_distance(b, a, at(1, 1)) == Approx(1.5));
    CHECK(attractor_distance(a, b, at(1, 2)) == Approx(0.75));
    CHECK(attractor_distance(b, {b[2], b[0], b[1]}, at(1, 1)) == 0);
    // a part is not the whole: from the part 0, from the whole (0 + 3)/2
    CHECK(attractor_distance({at(0)}, {at(0), at(3)}, at(1)) == Approx(1.5));
    // a point doubled by a period doubling is as near as its halves
    CHECK(attractor_distance({at(1)}, {at(0.99), at(1.01)}, at(1)) == Approx(0.01));
}

TEST_CASE("match_attractors: a permutation is undone", "[basin_numbers]") {
    const auto m =
        match_attractors(known_at({1, 2, 3, 4}), found_at({3.01, 1.02, 4.03, 1.99}), at(1), 0.3, 5);
    CHECK(m.ids == std::vector<Label>{3, 1, 4, 2});
    const double moved[] = {0.01, 0.02, 0.03, 0.01};
    for (std::size_t i = 0; i < 4; ++i)
        CHECK(m.distances[i] == Approx(moved[i]));
    CHECK(m.vanished.empty());
    CHECK(m.appeared.empty());
    CHECK(m.next_id == 5);
}

TEST_CASE("match_attractors: what vanishes is named, and its id is never given again",
          "[basin_numbers]") {
    const auto gone = match_attractors(known_at({1, 2, 3}), found_at({3, 1}), at(1), 0.3, 4);
    CHECK(gone.ids == std::vector<Label>{3, 1});
    CHECK(gone.vanished == std::vector<Label>{2});
    CHECK(gone.next_id == 4);
    const std::vector<KnownAttractor> left{{3, {at(3)}}, {1, {at(1)}}};
    const auto back = match_attractors(left, found_at({1, 2, 3}), at(1), 0.3, gone.next_id);
    CHECK(back.ids == std::vector<Label>{1, 4, 3});
    CHECK(back.appeared == std::vector<Label>{4});
    CHECK(std::isnan(back.distances[1]));
    CHECK(back.vanished.empty());
    CHECK(back.next_id == 5);
}

TEST_CASE("match_attractors: what moves by more than the threshold is another one",
          "[basin_numbers]") {
    const auto near = match_attractors(known_at({1}), found_at({1.5}), at(1), 0.5, 2);
    CHECK(near.ids == std::vector<Label>{1});
    const auto far = match_attractors(known_at({1}), found_at({1.5}), at(1), 0.499, 2);
    CHECK(far.ids == std::vector<Label>{2});
    CHECK(far.vanished == std::vector<Label>{1});
    CHECK(far.appeared == std::vector<Label>{2});
    const auto longer = match_attractors(known_at({1}), found_at({1.5}), at(2), 0.499, 2);
    CHECK(longer.ids == std::vector<Label>{1});

    const auto first = match_attractors({}, found_at({7, 8}), at(1), 1, 1);
    CHECK(first.ids == std::vector<Label>{1, 2});
    CHECK(first.next_id == 3);
    const auto last = match_attractors(known_at({7, 8}), {}, at(1), 1, 3);
    CHECK(last.ids.empty());
    CHECK(last.vanished == std::vector<Label>{1, 2});
    CHECK(match_attractors({}, {}, at(1), 1, 1).ids.empty());
}

TEST_CASE("match_attractors: two close attractors both move on where greedy choice swaps them",
          "[basin_numbers]") {
    // Both moved by 0.6 along: the nearest pair of all is 2 with the image of 1, at 0.4; taking it
    // first leaves 1 with the image of 2, at 1.6.
    const auto m = match_attractors(known_at({0, 1}), found_at({0.6, 1.6}), at(1), 1, 3);
    CHECK(m.ids == std::vector<Label>{1, 2});
    CHECK(m.vanished.empty());
}

TEST_CASE("match_attractors: a pair that is none does not pull others apart", "[basin_numbers]") {
    // The sums of distances are 0.9 + 4 and 5 + 0.1; beyond 1 they count as 1: 1.9 and 1.1.
    const auto m = match_attractors(known_at({0, 1}), found_at({0.9, 5}), at(1), 1, 3);
    CHECK(m.ids == std::vector<Label>{2, 3});
    CHECK(m.vanished == std::vector<Label>{1});
}

TEST_CASE("least_cost: is the least of all permutations", "[basin_numbers]") {
    std::mt19937_64 random(17);
    for (int trial = 0; trial < 300; ++trial) {
        const int n = 1 + trial % 7;
        Mat<double, Eigen::Dynamic, Eigen::Dynamic> cost(n, n);
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) // every third time few values, so that there are ties
                cost(i, j) = trial % 3 == 0 ? std::floor(4 * uniform(random)) : uniform(random);
        const auto total = [&](const std::vector<std::size_t>& column_of) {
            double sum = 0;
            for (int i = 0; i < n; ++i)
                sum += cost(i, static_cast<int>(column_of[static_cast<std::size_t>(i)]));
            return sum;
        };
        std::vector<std::size_t> order(static_cast<std::size_t>(n));
        std::iota(order.begin(), order.end(), 0);
        const auto chosen = detail::least_cost(cost);
        CHECK(std::is_permutation(order.begin(), order.end(), chosen.begin()));
        double least = total(order);
        while (std::next_permutation(order.begin(), order.end()))
            least = std::min(least, total(order));
        CHECK(total(chosen) == Approx(least).margin(1e-14)); // rounding of seven terms
    }
}

// --- misuse ------------------------------------------------------------------------------------

TEST_CASE("basin_numbers: what makes no sense is refused by name", "[basin_numbers]") {
    using Catch::Matchers::ContainsSubstring;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<Label> labels{1, 2, 1, 2, 1, 2};
    const LabelGrid grid{labels, 3};
    const auto refused = [](const std::function<void()>& call, const std::string& words) {
        INFO(words);
        CHECK_THROWS_AS(call(), std::invalid_argument);
        CHECK_THROWS_WITH(call(), ContainsSubstring(words));
    };
    refused([] { wilson_fraction(1, 0, 0); }, "n = 0");
    refused([] { wilson_fraction(1, 3, 2); }, "count = 3");
    refused([&] { wilson_fraction(1, 1, 2, nan); }, "level = ");
    refused([] { wilson_fraction(1, 1, 2, 1); }, "level = 1");
    refused([] { sampled_fractions({}); }, "labels.size() = 0");
    refused([] { sampled_fractions(std::vector<Label>{1, -2}); }, "labels[1] = -2");
    refused([&] { sampled_fractions(labels, 0.95, std::vector<Label>{-3}); }, "also[0] = -3");
    refused([&] { grid_fractions({labels, 4}); }, "columns = 4");
    refused([&] { grid_fractions({labels, 0}); }, "columns = 0");
    refused([&] { basin_entropy(grid, 1); }, "box = 1");
    refused([&] { basin_entropy(grid, 3); }, "box = 3");
    refused([&] { box_dimension({labels, 6}); }, "smallest = 1");
    refused([&] { box_dimension(grid, 1, 2); }, "largest = 2");
    refused([] { uncertainty_exponent(counts_of({{0, 1, 2}})); }, "counts[0].epsilon = 0");
    refused([&] { uncertainty_exponent(counts_of({{nan, 1, 2}})); }, "counts[0].epsilon = ");
    refused([] { uncertainty_exponent(counts_of({{1, 3, 2}})); }, "counts[0].uncertain = 3");
    refused([&] { uncertainty_exponent({}, nan); }, "D = ");

    const auto same = labelling([](double, double) { return 1; });
    const auto count = [&](std::array<double, 2> low, std::array<double, 2> high, double epsilon,
                           long long n) {
        return [=] { count_pairs(low, high, same, std::vector<double>{epsilon}, n, 1); };
    };
    refused(count({0, nan}, {1, 1}, 0.1, 10), "low[1] = ");
    refused(count({0, 0}, {0, 1}, 0.1, 10), "high[0] = 0");
    refused(count({0, 0}, {1, 1}, nan, 10), "epsilon = ");
    refused(count({0, 0}, {1, 1}, 1, 10), "epsilon = 1");
    refused(count({1e6, 0}, {1e6 + 1, 1}, 1e-8, 10), "units in the last place");
    refused(count({0, 0}, {1, 1}, 0.1, 0), "n = 0");
    const auto wrong = labelling([](double, double) { return -7; });
    refused([&] { count_pairs({0, 0}, {1, 1}, wrong, std::vector<double>{0.1}, 1, 1); },
            "labels[0] = -7");

    const auto match = [&](const std::vector<KnownAttractor>& known, const Point& scale,
                           double threshold, Label next_id) {
        return [=] { match_attractors(known, found_at({1}), scale, threshold, next_id); };
    };
    refused(match(known_at({1}), at(1), nan, 2), "threshold = ");
    refused(match(known_at({1}), at(1), 0, 2), "threshold = 0");
    refused(match(known_at({1}), at(0), 1, 2), "scale[0] = 0");
    refused(match(known_at({1}), at(1, 1), 1, 2), "point.size() = 1");
    refused(match({{1, {}}}, at(1), 1, 2), "points.size() = 0");
    refused(match({{1, {at(nan)}}}, at(1), 1, 2), "point = ");
    refused(match(known_at({1, 2}), at(1), 1, 2), "id = 2");
    refused(match({{1, {at(1)}}, {1, {at(2)}}}, at(1), 1, 2), "expected each id once");
    refused(match({}, at(1), 1, 0), "next_id = 0");
    refused(match({}, at(1), 1, std::numeric_limits<Label>::max()), "next_id = 2.14748e+09");
}
