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

/// A CellMap: a row a cell, and one a group.
struct CellMapColumns {
    py::array_t<std::int32_t> group, steps;  // a cell
    py::array_t<std::int32_t> period, basin; // a group
    std::vector<py::array_t<std::int32_t>> cells;
    std::int32_t sink_basin = 0, unresolved_basin = 0;
};

inline CellMapColumns columns_of(const CellMap& map) {
    CellMapColumns c;
    std::vector<std::int32_t> group = map.group, steps = map.steps, period, basin;
    for (const CellGroup& g : map.groups) {
        period.push_back(g.period);
        basin.push_back(g.basin);
        std::vector<std::int32_t> members = g.cells;
        const auto size = py::ssize_t(members.size());
        c.cells.push_back(as_array(std::move(members), {size}));
    }
    const auto n = py::ssize_t(group.size()), groups = py::ssize_t(period.size());
    c.group = as_array(std::move(group), {n});
    c.steps = as_array(std::move(steps), {n});
    c.period = as_array(std::move(period), {groups});
    c.basin = as_array(std::move(basin), {groups});
    c.sink_basin = map.sink_basin;
    c.unresolved_basin = map.unresolved_basin;
    return c;
}

} // namespace filippov::python
