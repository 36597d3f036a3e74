// SPDX-License-Identifier: BSD-3-Clause
// Labels: where starts lead, and those of the cells of a rectangle.
#pragma once

#include <filippov/run/settings.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

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
        refuse("columns", grid.columns,
               "expected a divisor of the number of labels, " + std::to_string(grid.labels.size()));
    require_labels(grid.labels);
}
inline double ratio(long long part, long long whole) {
    return static_cast<double>(part) / static_cast<double>(whole);
}

} // namespace detail

} // namespace filippov
