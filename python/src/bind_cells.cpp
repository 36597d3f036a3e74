// SPDX-License-Identifier: BSD-3-Clause
#include "bind_cells.hpp"

#include <filippov/orbits/maps.hpp>

namespace filippov::python {

namespace {

using Doubles = Array<double>;

/// States and times at the next event of a kind, one row a start.
struct SectionImages {
    py::array_t<double> x, t;
    py::array_t<signed char> status;
    py::object raised = py::none();
};

SectionImages section_images(const Model& model, const Doubles& t0, const Doubles& x0,
                             const Doubles& p, const RunSettings& settings, int kind, int after,
                             double max_time, int iterate, int threads, const py::object& show) {
    const auto dim = py::ssize_t(model.facts().dim), n = x0.shape(0);
    expect(x0.ndim() == 2 && x0.shape(1) == dim, "x0 has dim columns");
    expect(t0.size() == n, "t0 has one entry a start");
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> x(std::size_t(n * dim), nan), t(std::size_t(n), nan);
    std::vector<signed char> status(std::size_t(n), static_cast<signed char>(Status::interrupted));
    const SectionOf section{static_cast<EventKind>(kind), after};
    const Vector params = vector_of(p);
    SignalCheck signals;
    Parallel how;
    how.threads = threads;
    how.total = std::size_t(n);
    how.cancelled = [&signals] { return signals(); };
    how.progress = progress(show, signals);
    constexpr py::ssize_t block = 64;
    const auto run = [&](std::size_t item, Worker& worker) {
        // systems count what they do: one a block, none is shared
        const auto system = model.analysis(precision_of(settings));
        const py::ssize_t first = py::ssize_t(item) * block;
        for (py::ssize_t k = first; k < std::min(first + block, n) && !worker.stopped(); ++k) {
            const Mapped m = section_map(*system, section, t0.data()[k],
                                         Eigen::Map<const Vector>(x0.data() + k * dim, dim), params,
                                         max_time, iterate);
            status[std::size_t(k)] = static_cast<signed char>(m.status);
            if (m.ok()) {
                std::copy(m.x.begin(), m.x.end(), x.begin() + k * dim);
                t[std::size_t(k)] = m.t;
            }
            worker.count();
        }
    };
    {
        const py::gil_scoped_release unlocked;
        parallel_for(std::size_t((n + block - 1) / block), how, run);
    }
    return {.x = as_array(std::move(x), {n, dim}),
            .t = as_array(std::move(t), {n}),
            .status = as_array(std::move(status), {n}),
            .raised = signals.raised()};
}

} // namespace

void bind_cells(py::module_& m) {
    bind_struct<SectionImages>(m, "SectionImages")
        .field("x", &SectionImages::x)
        .field("t", &SectionImages::t)
        .field("status", &SectionImages::status)
        .field("raised", &SectionImages::raised);
    m.def("section_images", &section_images);
    bind_struct<CellMapColumns>(m, "CellMapColumns")
        .field("group", &CellMapColumns::group)
        .field("steps", &CellMapColumns::steps)
        .field("period", &CellMapColumns::period)
        .field("basin", &CellMapColumns::basin)
        .field("cells", &CellMapColumns::cells)
        .field("sink_basin", &CellMapColumns::sink_basin)
        .field("unresolved_basin", &CellMapColumns::unresolved_basin);
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
        return columns_of(cell_map(grid_of(axes), view(image)));
    });
}

} // namespace filippov::python
