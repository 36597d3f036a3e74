// SPDX-License-Identifier: BSD-3-Clause
// Basin entropy.
#pragma once

#include <filippov/basins/detail/label_grid.hpp>
#include <filippov/core/statistics.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

namespace filippov {

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
        detail::refuse("box", box, "expected 2 cells to the shorter side, " + std::to_string(side));
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

} // namespace filippov
