// SPDX-License-Identifier: BSD-3-Clause
// Numbers of basins, from labels alone: fractions, entropy, dimensions of boundaries, each with its
// error, and the same attractors found again at another parameter value.
#pragma once

#include <filippov/settings.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Where a start leads: to an attractor, numbered from 1 on, or one of the two below.
using Label = std::int32_t;
inline constexpr Label label_escaped = -1;   ///< left the domain of interest
inline constexpr Label label_unresolved = 0; ///< it is not known where it leads

/// Labels of the centres of a rectangle's cells.
struct LabelGrid {
    std::span<const Label> labels; ///< shape (rows, columns), row by row
    std::size_t columns = 0;       ///< > 0
    std::size_t rows() const { return labels.size() / columns; }
    Label at(std::size_t row, std::size_t column) const { return labels[row * columns + column]; }
};

namespace detail {

inline constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

inline void require_each(std::span<const Label> labels, const std::string& name) {
    for (std::size_t i = 0; i < labels.size(); ++i)
        if (labels[i] < label_escaped)
            refuse(name + "[" + std::to_string(i) + "]", labels[i],
                   "expected -1 (escaped), 0 (unresolved) or an attractor from 1 on");
}
inline void require_labels(std::span<const Label> labels) {
    if (labels.empty())
        refuse("labels.size()", 0, "expected at least one label");
    require_each(labels, "labels");
}
inline void require_grid(const LabelGrid& grid) {
    if (grid.columns == 0 || grid.labels.size() % grid.columns != 0)
        refuse("columns", static_cast<long double>(grid.columns),
               "expected a divisor of the number of labels, " + std::to_string(grid.labels.size()));
    require_labels(grid.labels);
}
inline double ratio(long long part, long long whole) {
    return static_cast<double>(part) / static_cast<double>(whole);
}

/// A line through weighted points.
struct Line {
    double slope = unknown;
    double intercept = unknown;
    double spread = 0; ///< sum of w (x - mean)^2: with weights 1/variance, 1/variance of the slope
    double chi2 = 0;   ///< sum of w (y - line)^2
};

/// Weighted least squares. Without two different x there is no line.
inline Line fit_line(std::span<const double> x, std::span<const double> y,
                     std::span<const double> w) {
    Line line;
    const auto [least, largest] = std::minmax_element(x.begin(), x.end());
    if (x.empty() || !(*least < *largest))
        return line;
    double weight = 0, x_mean = 0, y_mean = 0, product = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        weight += w[i];
        x_mean += w[i] * x[i];
        y_mean += w[i] * y[i];
    }
    x_mean /= weight;
    y_mean /= weight;
    for (std::size_t i = 0; i < x.size(); ++i) {
        line.spread += w[i] * (x[i] - x_mean) * (x[i] - x_mean);
        product += w[i] * (x[i] - x_mean) * (y[i] - y_mean);
    }
    line.slope = product / line.spread;
    line.intercept = y_mean - line.slope * x_mean;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double off = y[i] - y_mean - line.slope * (x[i] - x_mean);
        line.chi2 += w[i] * off * off;
    }
    return line;
}

/// Probability that chi^2 of so many degrees of freedom exceeds a value: for whole degrees a finite
/// sum, of (chi2/2)^k/Gamma(k + 1) over k = 0, 1, ... or 1/2, 3/2, ... below degrees/2.
inline double chi2_probability(double chi2, int degrees) {
    const double half = chi2 / 2;
    double sum = degrees % 2 == 0 ? 0 : std::erfc(std::sqrt(half));
    for (double k = degrees % 2 == 0 ? 0 : 0.5; k < degrees / 2.0; k += 1)
        sum += half > 0 ? std::exp(k * std::log(half) - half - std::lgamma(k + 1)) : k == 0;
    return std::min(sum, 1.0);
}

} // namespace detail

// --- fractions ---------------------------------------------------------------------------------

/// The share of one label, between bounds whose meaning is their maker's.
struct Fraction {
    Label label = label_unresolved;
    double value = 0;
    double low = 0;
    double high = 1;
    long long count = 0;
};

namespace detail {

/// z with P(|standard normal| < z) = level, by bisection: 10 is beyond any level below 1.
inline double normal_quantile(double level) {
    double low = 0, high = 10;
    for (int k = 0; k < 60; ++k) {
        const double middle = (low + high) / 2;
        (std::erfc(middle / std::numbers::sqrt2) > 1 - level ? low : high) = middle;
    }
    return (low + high) / 2;
}

} // namespace detail

/// A share estimated from independent trials, with Wilson's score interval:
///
///   (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n),   p = count/n
///
/// Unlike p -+ z sqrt(p (1 - p)/n) it has a width for 0 and for n successes, where one end is
/// exactly 0 or 1.
/// @param level  probability that the interval covers the true share, on an average over shares;
///               z is its two-sided normal quantile
/// @error        std::invalid_argument unless 0 <= count <= n, n > 0 and 0 < level < 1
/// @source       Wilson, J. Am. Stat. Assoc. 22 (1927) 209; Brown, Cai, DasGupta, Stat. Sci. 16
///               (2001) 101
inline Fraction wilson_fraction(Label label, long long count, long long n, double level = 0.95) {
    if (!(n > 0))
        detail::refuse("n", static_cast<long double>(n), "expected an integer > 0");
    if (!(count >= 0 && count <= n))
        detail::refuse("count", static_cast<long double>(count), "expected 0 <= count <= n");
    if (!(level > 0 && level < 1))
        detail::refuse("level", level, "expected 0 < level < 1");
    const double z = detail::normal_quantile(level);
    const double p = detail::ratio(count, n), w = z * z / static_cast<double>(n);
    // The ends are the roots of (1 + w) x^2 - (2 p + w) x + p^2; the product gives the lower one
    // without cancellation, and 0 for no successes.
    const double upper = p + w / 2 + std::sqrt(w * p * (1 - p) + w * w / 4);
    return {label, p, p * p / upper, count == n ? 1 : upper / (1 + w), count};
}

/// Basin fractions from starts drawn independently, with Wilson's intervals.
///
/// Each interval holds by itself: that all of them hold at once is less probable. Unresolved starts
/// are a label of their own, which bounds what the intervals do not know.
/// @param also  labels to list even if no start has them: a basin never met has an upper bound, too
/// @return      by label, ascending
/// @error       std::invalid_argument for no labels, labels below -1, or a level outside (0, 1)
/// @cost        O(n log labels)
inline std::vector<Fraction> sampled_fractions(std::span<const Label> labels, double level = 0.95,
                                               std::span<const Label> also = {}) {
    detail::require_labels(labels);
    detail::require_each(also, "also");
    std::map<Label, long long> counts;
    for (const Label label : also)
        counts[label] = 0;
    for (const Label label : labels)
        ++counts[label];
    std::vector<Fraction> fractions;
    for (const auto& [label, count] : counts)
        fractions.push_back(
            wilson_fraction(label, count, static_cast<long long>(labels.size()), level));
    return fractions;
}

/// Basin fractions from a grid, with bounds from the cells on boundaries.
///
/// A boundary that is straight on the scale of a cell crosses only cells that have one of their
/// four neighbours on its other side (but along the grid's edge, where there is no neighbour, a
/// strip of less than half a cell). So what a basin has less than its cells is at most its own
/// cells with another neighbour, and what it has more at most the other cells with it as a
/// neighbour. These are bounds, and wide ones: a smooth boundary cuts its cells at random, and most
/// of it averages out. They do not hold for islands and tongues narrower than a cell; and
/// unresolved cells are a label of their own, whose share may belong to any basin.
/// @return  by label, ascending
/// @error   std::invalid_argument for a grid that is not a rectangle, or labels below -1
/// @cost    O(cells log labels)
inline std::vector<Fraction> grid_fractions(const LabelGrid& grid) {
    detail::require_grid(grid);
    struct Tally {
        long long cells = 0, on_boundary = 0, beside = 0;
    };
    std::map<Label, Tally> tallies;
    for (std::size_t row = 0; row < grid.rows(); ++row)
        for (std::size_t column = 0; column < grid.columns; ++column) {
            const Label own = grid.at(row, column);
            std::array<Label, 4> near{own, own, own, own};
            if (row > 0)
                near[0] = grid.at(row - 1, column);
            if (row + 1 < grid.rows())
                near[1] = grid.at(row + 1, column);
            if (column > 0)
                near[2] = grid.at(row, column - 1);
            if (column + 1 < grid.columns)
                near[3] = grid.at(row, column + 1);
            Tally& tally = tallies[own];
            ++tally.cells;
            if (near == std::array{own, own, own, own})
                continue;
            ++tally.on_boundary;
            std::sort(near.begin(), near.end());
            const auto end = std::unique(near.begin(), near.end());
            for (auto other = near.begin(); other != end; ++other)
                if (*other != own)
                    ++tallies[*other].beside;
        }
    const auto n = static_cast<long long>(grid.labels.size());
    std::vector<Fraction> fractions;
    for (const auto& [label, tally] : tallies)
        fractions.push_back({label, detail::ratio(tally.cells, n),
                             detail::ratio(tally.cells - tally.on_boundary, n),
                             detail::ratio(tally.cells + tally.beside, n), tally.cells});
    return fractions;
}

// --- basin entropy -----------------------------------------------------------------------------

/// How unpredictable the label is within a box, in units of ln: `log` is natural.
struct BasinEntropy {
    double mean = 0;                         ///< S_b, over all boxes
    double mean_error = detail::unknown;     ///< its standard deviation over placements of the grid
    double boundary = detail::unknown;       ///< S_bb, over boxes with several labels; NaN: none
    double boundary_error = detail::unknown; ///< its standard deviation over placements
    long long boxes = 0;                     ///< with a resolved cell
    long long boundary_boxes = 0;            ///< with several labels
    long long unresolved = 0;                ///< cells left out, of the whole grid
    /// S_bb above ln 2 by more than two errors. A smooth boundary has two labels nearly everywhere,
    /// and they give at most ln 2: above it, the boundary is fractal, as far as the boxes are small
    /// against all that is smooth. The converse does not hold.
    bool passes_log2_test() const { return boundary - 2 * boundary_error > std::numbers::ln2; }
};

namespace detail {

/// Sum of p ln(1/p) over the labels, which it sorts.
inline double gibbs_entropy(std::vector<Label>& labels) {
    std::sort(labels.begin(), labels.end());
    const auto n = static_cast<double>(labels.size());
    double sum = 0;
    for (auto run = labels.begin(); run != labels.end();) {
        const auto next = std::upper_bound(run, labels.end(), *run);
        const auto count = static_cast<double>(next - run);
        sum += count / n * std::log(n / count);
        run = next;
    }
    return sum;
}

/// The boxes of one placement.
struct BoxTiling {
    double entropy = 0; ///< sum over boxes
    long long boxes = 0, mixed = 0;
    double mean() const { return entropy / static_cast<double>(boxes); }
    double boundary() const { return entropy / static_cast<double>(mixed); }
};

inline BoxTiling tile(const LabelGrid& grid, std::size_t box, std::size_t top, std::size_t left) {
    BoxTiling tiling;
    std::vector<Label> labels;
    for (std::size_t row = top; row + box <= grid.rows(); row += box)
        for (std::size_t column = left; column + box <= grid.columns; column += box) {
            labels.clear();
            for (std::size_t i = row; i < row + box; ++i)
                for (std::size_t j = column; j < column + box; ++j)
                    if (const Label label = grid.at(i, j); label != label_unresolved)
                        labels.push_back(label);
            if (labels.empty())
                continue;
            ++tiling.boxes;
            if (std::equal(labels.begin() + 1, labels.end(), labels.begin()))
                continue;
            ++tiling.mixed;
            tiling.entropy += gibbs_entropy(labels);
        }
    return tiling;
}

/// Standard deviation of values that are all there are.
inline double deviation(std::span<const double> values) {
    if (values.empty())
        return unknown;
    const auto n = static_cast<double>(values.size());
    double mean = 0, square = 0;
    for (const double v : values)
        mean += v / n;
    for (const double v : values)
        square += (v - mean) * (v - mean) / n;
    return std::sqrt(square);
}

} // namespace detail

/// Basin entropy of a grid cut in boxes of box x box cells.
///
///   S_i = sum_j p_ij ln(1/p_ij),   S_b = sum_i S_i / boxes,   S_bb = sum_i S_i / boundary boxes
///
/// with p_ij the share of label j among the resolved cells of box i; escaped is a label as any
/// other. Rows and columns beyond the last whole box are left out. The error is that of the boxes'
/// place: the standard deviation over the tilings shifted by 0 to box - 1 cells either way (8
/// evenly spaced shifts either way if box > 8). Neighbouring boxes lie on the same curve, and
/// s/sqrt(boxes), which takes them to be independent, would be 0 for all boxes cut alike. It says
/// nothing of what box and resolution choose, on which the entropy depends. NaN if the grid has not
/// 2 box - 1 cells either way, so that not all tilings fit.
/// @param box  2 to the shorter side
/// @error      std::invalid_argument for a grid that is not a rectangle, labels below -1, or a box
///             out of range
/// @cost       min(box, 8)^2 times O(cells log cells of a box)
/// @source     Daza, Wagemakers, Georgeot, Guery-Odelin, Sanjuan, Sci. Rep. 6 (2016) 31416
inline BasinEntropy basin_entropy(const LabelGrid& grid, std::size_t box = 5) {
    detail::require_grid(grid);
    const std::size_t side = std::min(grid.columns, grid.rows());
    if (!(box >= 2 && box <= side))
        detail::refuse("box", static_cast<long double>(box),
                       "expected 2 cells to the shorter side, " + std::to_string(side));
    BasinEntropy result;
    result.unresolved = std::count(grid.labels.begin(), grid.labels.end(), label_unresolved);
    const detail::BoxTiling tiling = detail::tile(grid, box, 0, 0);
    result.boxes = tiling.boxes;
    result.boundary_boxes = tiling.mixed;
    result.mean = tiling.boxes > 0 ? tiling.mean() : detail::unknown;
    if (tiling.mixed > 0)
        result.boundary = tiling.boundary();
    if (side + 1 < 2 * box)
        return result;
    std::vector<double> mean, boundary;
    const std::size_t shifts = std::min<std::size_t>(box, 8);
    for (std::size_t k = 0; k < shifts * shifts; ++k) {
        const detail::BoxTiling shifted =
            detail::tile(grid, box, k / shifts * box / shifts, k % shifts * box / shifts);
        if (shifted.boxes > 0)
            mean.push_back(shifted.mean());
        if (shifted.mixed > 0)
            boundary.push_back(shifted.boundary());
    }
    result.mean_error = detail::deviation(mean);
    result.boundary_error = detail::deviation(boundary);
    return result;
}

// --- uncertainty exponent ----------------------------------------------------------------------

/// Pairs of starts at a distance: in how many of them the two have different labels.
struct PairCount {
    double epsilon = 0;       ///< the distance, in any unit, > 0
    long long uncertain = 0;  ///< pairs with different labels
    long long trials = 0;     ///< pairs with both labels known
    long long unresolved = 0; ///< pairs left out, with a label unknown
};

/// f(epsilon) ~ epsilon^alpha, fitted.
struct UncertaintyExponent {
    double alpha = detail::unknown;
    double error = detail::unknown;       ///< standard error of alpha, and of the dimension
    double dimension = detail::unknown;   ///< of the boundary, D - alpha
    double log_factor = detail::unknown;  ///< ln f = log_factor + alpha ln epsilon
    double chi2 = 0;                      ///< of the fit, from the binomial weights alone
    int degrees = 0;                      ///< of freedom
    double probability = detail::unknown; ///< of a chi^2 above this one; NaN without freedom
    std::vector<std::size_t> left_out;    ///< indices of counts with none or only uncertain pairs
};

/// The uncertainty exponent of a boundary, by weighted least squares in ln f over ln epsilon.
///
/// The variance of ln f is (1 - f)/(n f), that of a binomial count to first order. Counts of none
/// (ln f infinite) or all pairs (no longer a power law) are left out and listed; where few are
/// expected that is a choice by outcome, and weights from counts k have a bias of order 1/(2k): ten
/// uncertain pairs or more at the least distance are wanted. A fractal's f may wiggle about its
/// power law: if chi2 exceeds the degrees of freedom, the error is enlarged by the root of their
/// ratio, and `probability` tells how bad it is.
/// @param counts  independent ones; not two different distances left: alpha is NaN
/// @param D       dimension of the space in which the pairs lie
/// @error         std::invalid_argument for counts or distances that make no sense
/// @source        Grebogi, McDonald, Ott, Yorke, Phys. Lett. A 99 (1983) 415; McDonald et al.,
///                Physica D 17 (1985) 125
inline UncertaintyExponent uncertainty_exponent(std::span<const PairCount> counts, double D = 2) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    if (!(D > 0 && D < inf))
        detail::refuse("D", D, "expected a finite number > 0");
    UncertaintyExponent result;
    std::vector<double> x, y, weight;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const auto [epsilon, uncertain, trials, unresolved] = counts[i];
        const std::string which = "counts[" + std::to_string(i) + "].";
        if (!(epsilon > 0 && epsilon < inf))
            detail::refuse(which + "epsilon", epsilon, "expected a finite number > 0");
        if (!(uncertain >= 0 && uncertain <= trials))
            detail::refuse(which + "uncertain", static_cast<long double>(uncertain),
                           "expected 0 to trials, " + std::to_string(trials));
        if (uncertain == 0 || uncertain == trials) {
            result.left_out.push_back(i);
            continue;
        }
        const double f = detail::ratio(uncertain, trials);
        x.push_back(std::log(epsilon));
        y.push_back(std::log(f));
        weight.push_back(static_cast<double>(uncertain) / (1 - f));
    }
    const detail::Line line = detail::fit_line(x, y, weight);
    if (!(line.spread > 0))
        return result;
    result.alpha = line.slope;
    result.dimension = D - line.slope;
    result.log_factor = line.intercept;
    result.chi2 = line.chi2;
    result.degrees = static_cast<int>(x.size()) - 2;
    result.error = 1 / std::sqrt(line.spread);
    if (result.degrees > 0) {
        result.error *= std::sqrt(std::max(1.0, line.chi2 / result.degrees));
        result.probability = detail::chi2_probability(line.chi2, result.degrees);
    }
    return result;
}

/// Labels many points at once: called as labeller(points, labels), both of the same length.
template <class F>
concept Labeller =
    std::invocable<F&, std::span<const std::array<double, 2>>, std::span<std::int32_t>>;

namespace detail {

/// In [0, 1), the same numbers on every platform, which a standard distribution does not promise.
inline double uniform(std::mt19937_64& random) {
    return static_cast<double>(random() >> 11) * 0x1p-53;
}

inline void require_pairs(const std::array<double, 2>& low, const std::array<double, 2>& high,
                          std::span<const double> epsilons, long long n) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 2; ++i) {
        const std::string which = "[" + std::to_string(i) + "]";
        if (!(std::abs(low[i]) < inf))
            refuse("low" + which, low[i], "expected a finite number");
        if (!(high[i] > low[i] && high[i] - low[i] < inf))
            refuse("high" + which, high[i], "expected a finite number above low");
        for (const double epsilon : epsilons) {
            if (!(epsilon > 0 && epsilon < 1))
                refuse("epsilon", epsilon, "expected 0 < epsilon < 1, in sides of the rectangle");
            // Rounding changes the distance by less than a thousandth.
            if (!(epsilon * (high[i] - low[i]) >
                  1000 * ulp(std::max(std::abs(low[i]), std::abs(high[i])))))
                refuse("epsilon", epsilon, "expected 1000 units in the last place of coordinates");
        }
    }
    if (!(n > 0 && n <= 1'000'000'000))
        refuse("n", static_cast<long double>(n), "expected 1 to 1e9 pairs");
}

} // namespace detail

/// Counts uncertain pairs: a point drawn uniformly from a rectangle, and its neighbour at distance
/// epsilon along one of the coordinates, drawn too, since a boundary parallel to a fixed one would
/// never be seen.
///
/// @param low, high  corners of the rectangle; neighbours lie up to epsilon beyond `high`
/// @param labeller   exact labels, 0 where it has none; one call a distance, with the 2 n points in
///                   a fixed order, each followed by its neighbour
/// @param epsilons   distances, as shares of the side along which they lie, in (0, 1)
/// @param n          pairs a distance, 1 to 1e9
/// @param seed       of std::mt19937_64; the points are the same on every platform
/// @return           one count a distance, from points of its own: the counts are independent
/// @error            std::invalid_argument for arguments or labels that make no sense
/// @cost             2 n labels a distance, and their memory
template <Labeller F>
std::vector<PairCount>
count_pairs(const std::array<double, 2>& low, const std::array<double, 2>& high, F&& labeller,
            std::span<const double> epsilons, long long n, std::uint64_t seed) {
    detail::require_pairs(low, high, epsilons, n);
    std::mt19937_64 random(seed);
    std::vector<std::array<double, 2>> points(2 * static_cast<std::size_t>(n));
    std::vector<Label> labels(points.size());
    std::vector<PairCount> counts;
    for (const double epsilon : epsilons) {
        // fma: compilers differ in whether they would round the product
        for (std::size_t k = 0; k < points.size(); k += 2) {
            for (std::size_t i = 0; i < 2; ++i)
                points[k][i] = std::fma(detail::uniform(random), high[i] - low[i], low[i]);
            points[k + 1] = points[k];
            const std::size_t along = random() >> 63;
            points[k + 1][along] = std::fma(epsilon, high[along] - low[along], points[k][along]);
        }
        std::fill(labels.begin(), labels.end(), label_unresolved);
        labeller(std::span<const std::array<double, 2>>(points), std::span<Label>(labels));
        detail::require_labels(labels);
        PairCount count;
        count.epsilon = epsilon;
        for (std::size_t k = 0; k < points.size(); k += 2) {
            const bool known = labels[k] != label_unresolved && labels[k + 1] != label_unresolved;
            count.trials += known;
            count.unresolved += !known;
            count.uncertain += known && labels[k] != labels[k + 1];
        }
        counts.push_back(count);
    }
    return counts;
}

// --- box-counting dimension --------------------------------------------------------------------

/// Boxes of one size that the boundary meets.
struct BoxCount {
    std::size_t size = 0; ///< side, in cells
    long long boxes = 0;  ///< with several labels
};

/// N(size) ~ size^-dimension, fitted.
struct BoxDimension {
    double dimension = detail::unknown; ///< NaN without a boundary, or with one size only
    double error = detail::unknown;     ///< standard error; NaN with fewer than three sizes
    std::vector<BoxCount> counts;       ///< the sizes used, ascending; those of 0 boxes are not
};

namespace detail {

/// The least and the largest label of a box: several labels if they differ.
struct LabelRange {
    Label low = std::numeric_limits<Label>::max();
    Label high = std::numeric_limits<Label>::min();

    bool mixed() const { return low < high; }
    void add(Label label) {
        if (label != label_unresolved)
            add(LabelRange{label, label});
    }
    void add(const LabelRange& other) {
        low = std::min(low, other.low);
        high = std::max(high, other.high);
    }
};

/// Boxes in rows, made of the labels at their corners or of smaller boxes.
struct BoxLevel {
    std::size_t columns = 0;
    std::vector<LabelRange> boxes;

    BoxLevel(std::size_t columns_, std::size_t rows) : columns(columns_), boxes(columns_ * rows) {}
    /// Boxes of a side, from the first row and column of the grid on.
    BoxLevel(const LabelGrid& grid, std::size_t size, std::size_t columns_, std::size_t rows)
        : BoxLevel(columns_, rows) {
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const std::size_t top = i / columns * size, left = i % columns * size;
            for (std::size_t row = top; row <= top + size; ++row)
                for (std::size_t column = left; column <= left + size; ++column)
                    boxes[i].add(grid.at(row, column));
        }
    }
    /// Boxes of twice the side. @pre even numbers of rows and columns
    BoxLevel coarser() const {
        BoxLevel level(columns / 2, boxes.size() / columns / 2);
        for (std::size_t i = 0; i < boxes.size(); ++i)
            level.boxes[i / columns / 2 * level.columns + i % columns / 2].add(boxes[i]);
        return level;
    }
    long long mixed() const {
        return std::count_if(boxes.begin(), boxes.end(),
                             [](const auto& box) { return box.mixed(); });
    }
};

/// Standard error of the line through evenly spaced points, from its slopes between neighbours as
/// independent ones: the line's is their mean with weights k (n - k), for k = 1 ... n - 1.
inline double error_of_fit(std::span<const double> slopes) {
    const std::size_t n = slopes.size() + 1;
    if (n < 3)
        return unknown;
    double sum = 0, squares = 0;
    for (std::size_t k = 1; k < n; ++k) {
        const auto weight = static_cast<double>(k * (n - k));
        sum += weight;
        squares += weight * weight;
    }
    const double sample = static_cast<double>(n - 1) / static_cast<double>(n - 2);
    return deviation(slopes) * std::sqrt(sample * squares) / sum;
}

} // namespace detail

/// Box-counting dimension of the boundary: minus the slope of ln N over ln size, by least squares.
///
/// Boxes lie between centres of cells, which are points on their edges and corners: a box of side 1
/// has the four labels at its corners, and neighbours share those between them. So a boundary
/// between two centres is met by boxes of every size; with boxes made of cells it would be lost
/// wherever it falls between two of them. Sizes are `smallest` times 1, 2, 4, ...; all cover the
/// same rectangle, a whole number of the largest boxes from the first row and column on. Unresolved
/// cells are left out.
///
/// The error takes the slopes between neighbouring sizes to be independent: the boundary within a
/// box decides into how many smaller ones it goes. Least squares' own error takes the counts to be
/// independent, which those of nested boxes are not: of 200 discs and 100 straight lines it covered
/// the dimension 1 in 18 %, this one in 61 %, and twice this one in 98 %.
/// @param smallest  side of the smallest boxes, in cells, > 0
/// @param largest   bound on the side of the largest; 0: an eighth of the shorter side of the grid
/// @error           std::invalid_argument for a grid that is not a rectangle, labels below -1, or
///                  sizes that do not fit
/// @cost            O(cells), 8 bytes a cell
inline BoxDimension box_dimension(const LabelGrid& grid, std::size_t smallest = 1,
                                  std::size_t largest = 0) {
    detail::require_grid(grid);
    const std::size_t side = std::min(grid.columns, grid.rows()) - 1;
    if (!(smallest > 0 && smallest <= side))
        detail::refuse("smallest", static_cast<long double>(smallest),
                       "expected 1 to the shorter side less one, " + std::to_string(side));
    if (largest == 0)
        largest = std::max(smallest, side / 8);
    if (!(largest >= smallest && largest <= side))
        detail::refuse("largest", static_cast<long double>(largest),
                       "expected smallest to the shorter side less one, " + std::to_string(side));
    std::size_t doubled = 1; // largest size over smallest
    while (doubled <= largest / smallest / 2)
        doubled *= 2;
    const std::size_t top = smallest * doubled;
    BoxDimension result;
    std::vector<double> x, y, slopes;
    detail::BoxLevel level(grid, smallest, (grid.columns - 1) / top * doubled,
                           (grid.rows() - 1) / top * doubled);
    for (std::size_t size = smallest; size <= top; size *= 2) {
        if (size > smallest)
            level = level.coarser();
        const long long boxes = level.mixed();
        result.counts.push_back({size, boxes});
        if (boxes == 0) // no boundary, or one that unresolved cells hide from the least boxes
            continue;
        x.push_back(std::log(static_cast<double>(size)));
        y.push_back(-std::log(static_cast<double>(boxes)));
        if (x.size() > 1)
            slopes.push_back((y.back() - y[y.size() - 2]) / std::numbers::ln2);
    }
    result.dimension = detail::fit_line(x, y, std::vector<double>(x.size(), 1.0)).slope;
    result.error = detail::error_of_fit(slopes);
    return result;
}

// --- attractors over a parameter ---------------------------------------------------------------

/// Points of one attractor: an orbit's on a section, or samples of a chaotic one.
using AttractorPoints = std::vector<Vec<double, Eigen::Dynamic>>;

/// An attractor that has its number.
struct KnownAttractor {
    Label id = 1; ///< > 0
    AttractorPoints points;
};

/// Which of the attractors found are known.
struct AttractorMatch {
    std::vector<Label> ids;        ///< one for each attractor found
    std::vector<double> distances; ///< of each to the known one; NaN if it is new
    std::vector<Label> vanished;   ///< known ones that were not found
    std::vector<Label> appeared;   ///< ids that are new
    Label next_id = 1;             ///< not yet given to any
};

namespace detail {

inline double mean_distance(const AttractorPoints& from, const AttractorPoints& to,
                            const Vec<double, Eigen::Dynamic>& scale) {
    double sum = 0;
    for (const auto& a : from) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& b : to)
            nearest = std::min(nearest, (a - b).cwiseQuotient(scale).norm());
        sum += nearest;
    }
    return sum / static_cast<double>(from.size());
}

inline void require_scale(const Vec<double, Eigen::Dynamic>& scale) {
    for (Eigen::Index i = 0; i < scale.size(); ++i)
        if (!(scale[i] > 0 && scale[i] < std::numeric_limits<double>::infinity()))
            refuse("scale[" + std::to_string(i) + "]", scale[i], "expected a finite number > 0");
}
inline void require_attractor(const AttractorPoints& points,
                              const Vec<double, Eigen::Dynamic>& scale) {
    if (points.empty())
        refuse("points.size()", 0, "expected at least one point an attractor");
    for (const auto& x : points) {
        if (x.size() != scale.size())
            refuse("point.size()", static_cast<long double>(x.size()),
                   "expected one entry a scale, " + std::to_string(scale.size()));
        if (!x.allFinite())
            refuse("point", unknown, "expected finite numbers");
    }
}

/// The column of each row in the assignment of least total cost, by shortest augmenting paths.
/// @pre     square, finite
/// @cost    O(n^3)
/// @source  Kuhn, Nav. Res. Logist. Q. 2 (1955) 83; Jonker, Volgenant, Computing 38 (1987) 325
inline std::vector<std::size_t>
least_cost(const Mat<double, Eigen::Dynamic, Eigen::Dynamic>& cost) {
    const auto n = static_cast<std::size_t>(cost.rows());
    const auto c = [&](std::size_t row, std::size_t column) {
        return cost(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    };
    // Column n is a place where the row to be assigned starts; `none` is no row.
    const std::size_t none = n;
    std::vector<std::size_t> row_of(n + 1, none), before(n + 1, n);
    std::vector<double> u(n + 1, 0.0), v(n + 1, 0.0);
    for (std::size_t row = 0; row < n; ++row) {
        std::vector<double> way(n, std::numeric_limits<double>::infinity());
        std::vector<bool> reached(n + 1, false);
        std::size_t at = n;
        row_of[n] = row;
        while (row_of[at] != none) { // reaches one more column each time
            reached[at] = true;
            double step = std::numeric_limits<double>::infinity();
            std::size_t nearest = n;
            for (std::size_t j = 0; j < n; ++j) {
                if (reached[j])
                    continue;
                const double reduced = c(row_of[at], j) - u[row_of[at]] - v[j];
                if (reduced < way[j]) {
                    way[j] = reduced;
                    before[j] = at;
                }
                if (way[j] < step) {
                    step = way[j];
                    nearest = j;
                }
            }
            for (std::size_t j = 0; j <= n; ++j)
                if (reached[j]) {
                    u[row_of[j]] += step;
                    v[j] -= step;
                } else {
                    way[j] -= step;
                }
            at = nearest;
        }
        for (; at != n; at = before[at])
            row_of[at] = row_of[before[at]];
    }
    std::vector<std::size_t> column_of(n);
    for (std::size_t j = 0; j < n; ++j)
        column_of[row_of[j]] = j;
    return column_of;
}

} // namespace detail

/// Distance of two attractors: the larger of the two means of the distances of one's points to the
/// nearest of the other's.
///
/// Zero only for equal sets, as Hausdorff's distance, which has the largest of those distances
/// instead of the mean: of a chaotic attractor that is the luck of one sample. The larger of both,
/// since an attractor near to a part of another one is not near to it.
/// @param scale  length by which each coordinate is measured, > 0, shape (dim,)
/// @error        std::invalid_argument for points or scales that make no sense
/// @cost         the product of the numbers of points
/// @source       Dubuisson, Jain, 12th Int. Conf. Pattern Recognition (1994) 566
inline double attractor_distance(const AttractorPoints& a, const AttractorPoints& b,
                                 const Vec<double, Eigen::Dynamic>& scale) {
    detail::require_scale(scale);
    detail::require_attractor(a, scale);
    detail::require_attractor(b, scale);
    return std::max(detail::mean_distance(a, b, scale), detail::mean_distance(b, a, scale));
}

/// Gives attractors found at a parameter value the ids of those known from a neighbouring one.
///
/// One to one, with the least sum of distances, a pair farther apart than the threshold counting as
/// the threshold: such a pair is none, and its members have vanished and appeared. New ids count on
/// from `next_id`; if the `next_id` of the result is handed on, none is ever used again, not even
/// for an attractor that comes back.
/// @param known      from the last parameter value; may be empty, with `next_id` = 1
/// @param found      at this one, in any order; may be empty
/// @param scale      length by which each coordinate is measured, > 0, shape (dim,)
/// @param threshold  largest distance, in these lengths, to be the same attractor, > 0
/// @param next_id    above all ids known
/// @error            std::invalid_argument for arguments that make no sense
/// @cost             a distance for each pair, and O(n^3) for n = max(known, found)
inline AttractorMatch match_attractors(std::span<const KnownAttractor> known,
                                       std::span<const AttractorPoints> found,
                                       const Vec<double, Eigen::Dynamic>& scale, double threshold,
                                       Label next_id) {
    if (!(threshold > 0 && threshold < std::numeric_limits<double>::infinity()))
        detail::refuse("threshold", threshold, "expected a finite number > 0");
    std::vector<Label> vanished;
    for (const KnownAttractor& old : known) {
        if (!(old.id > 0 && old.id < next_id))
            detail::refuse("id", old.id, "expected 0 < id < next_id");
        vanished.push_back(old.id);
    }
    std::sort(vanished.begin(), vanished.end());
    if (const auto twice = std::adjacent_find(vanished.begin(), vanished.end());
        twice != vanished.end())
        detail::refuse("id", *twice, "expected each id once");
    constexpr std::size_t most = std::numeric_limits<Label>::max();
    if (!(next_id > 0 && found.size() <= most - static_cast<std::size_t>(next_id)))
        detail::refuse("next_id", next_id, "expected a number > 0 with ids left above it");

    const auto n = static_cast<Eigen::Index>(std::max(known.size(), found.size()));
    Mat<double, Eigen::Dynamic, Eigen::Dynamic> distance =
        Mat<double, Eigen::Dynamic, Eigen::Dynamic>::Constant(
            n, n, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < found.size(); ++i)
        for (std::size_t j = 0; j < known.size(); ++j)
            distance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
                attractor_distance(found[i], known[j].points, scale);
    const std::vector<std::size_t> partner = detail::least_cost(distance.cwiseMin(threshold));

    AttractorMatch match;
    match.next_id = next_id;
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double d =
            distance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(partner[i]));
        const bool same = d <= threshold;
        match.ids.push_back(same ? known[partner[i]].id : match.next_id++);
        match.distances.push_back(same ? d : detail::unknown);
        if (same)
            std::erase(vanished, match.ids.back());
        else
            match.appeared.push_back(match.ids.back());
    }
    match.vanished = std::move(vanished);
    return match;
}

} // namespace filippov
