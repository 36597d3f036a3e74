// SPDX-License-Identifier: BSD-3-Clause
// Grids of cells, as the typed layer gives and takes them.
#pragma once

#include "bind_lanes.hpp"

#include <filippov/basins/cells.hpp>

#include <cstdint>
#include <tuple>
#include <vector>

namespace filippov::python {

/// Rows (coordinate, low, high, n), one an axis.
using Axes = std::vector<std::tuple<int, double, double, int>>;

inline CellGrid grid_of(const Axes& axes) {
    expect(axes.size() == 2, "a grid has two axes");
    const auto axis = [](const auto& a) {
        return CellAxis{std::get<0>(a), std::get<1>(a), std::get<2>(a), std::get<3>(a)};
    };
    return {axis(axes[0]), axis(axes[1])};
}

inline py::dict cell_map_to_dict(const CellMap& map) {
    py::dict d;
    std::vector<std::int32_t> group = map.group, steps = map.steps, period, basin;
    py::list cells;
    for (const CellGroup& g : map.groups) {
        period.push_back(g.period);
        basin.push_back(g.basin);
        std::vector<std::int32_t> members = g.cells;
        const auto size = py::ssize_t(members.size());
        cells.append(as_array(std::move(members), {size}));
    }
    const auto n = py::ssize_t(group.size()), groups = py::ssize_t(period.size());
    d["group"] = as_array(std::move(group), {n});
    d["steps"] = as_array(std::move(steps), {n});
    d["period"] = as_array(std::move(period), {groups});
    d["basin"] = as_array(std::move(basin), {groups});
    d["cells"] = cells;
    d["sink_basin"] = map.sink_basin;
    d["unresolved_basin"] = map.unresolved_basin;
    return d;
}

} // namespace filippov::python
