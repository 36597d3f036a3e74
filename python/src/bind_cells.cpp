// SPDX-License-Identifier: BSD-3-Clause
#include "bind_cells.hpp"

namespace filippov::python {

namespace {

using Doubles = Array<double>;
} // namespace

void bind_cells(py::module_& m) {
    // Cells that hold points, shape (k, 2); -1 outside, -2 for NaN.
    m.def("cells_of", [](const Axes& axes, const Doubles& points) {
        const CellGrid grid = grid_of(axes);
        expect(points.ndim() == 2 && points.shape(1) == 2, "points have two columns");
        std::vector<std::int32_t> cells;
        for (py::ssize_t k = 0; k < points.shape(0); ++k)
            cells.push_back(grid.cell_of(points.at(k, 0), points.at(k, 1)));
        return as_array(std::move(cells), {points.shape(0)});
    });
    // Centres of all cells, shape (cells, 2).
    m.def("centres", [](const Axes& axes) {
        const CellGrid grid = grid_of(axes);
        std::vector<double> centres;
        for (std::int32_t cell = 0; cell < grid.cells(); ++cell)
            for (const double x : grid.centre(cell))
                centres.push_back(x);
        return as_array(std::move(centres), {py::ssize_t(grid.cells()), 2});
    });
    // Grid lines on a surface: (axis, index, value).
    m.def("lines_on_surface", [](const Model& model, const Axes& axes, const Doubles& p,
                                 const Doubles& rest, double t0) {
        const CellGrid grid = grid_of(axes);
        const auto surfaces = std::size_t(model.facts().surfaces);
        std::vector<double> x = copy(rest), h(surfaces);
        std::vector<std::tuple<int, int, double>> found;
        for (std::size_t j = 0; j < surfaces; ++j)
            for (const GridLine& line : lines_on_surface(grid, [&](double a, double b) {
                     x[std::size_t(grid.axis(0).coordinate)] = a;
                     x[std::size_t(grid.axis(1).coordinate)] = b;
                     model.h({&t0, 1}, x, view(p), h);
                     return h[j];
                 }))
                found.emplace_back(line.axis, line.index, line.value);
        return found;
    });
    m.def("cell_map", [](const Axes& axes, const Array<std::int32_t>& image) {
        return cell_map_to_dict(cell_map(grid_of(axes), view(image)));
    });
}

} // namespace filippov::python
