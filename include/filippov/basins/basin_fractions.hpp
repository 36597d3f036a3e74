// SPDX-License-Identifier: BSD-3-Clause
// Shares of basins, of samples and of grids.
#pragma once

#include <filippov/basins/detail/label_grid.hpp>
#include <filippov/core/statistics.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <span>
#include <vector>

namespace filippov {

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
    detail::require_positive("n", n);
    if (!(count >= 0 && count <= n))
        detail::refuse("count", count, "expected 0 <= count <= n");
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

} // namespace filippov
