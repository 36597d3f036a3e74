// SPDX-License-Identifier: BSD-3-Clause
#include "bind_lanes.hpp"

#include <filippov/basins.hpp>

namespace filippov::python {

namespace {

using Doubles = Array<double>;
/// Rows (coordinate, low, high, n), one an axis.
using Axes = std::vector<std::tuple<int, double, double, int>>;

CellGrid grid_of(const Axes& axes) {
    expect(axes.size() == 2, "a grid has two axes");
    const auto axis = [](const auto& a) {
        return CellAxis{std::get<0>(a), std::get<1>(a), std::get<2>(a), std::get<3>(a)};
    };
    return {axis(axes[0]), axis(axes[1])};
}

py::dict to_dict(const CellMap& map) {
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

py::array_t<double> rows(const std::vector<Vector>& points, Eigen::Index dim) {
    std::vector<double> all;
    for (const Vector& x : points)
        all.insert(all.end(), x.begin(), x.end());
    return as_array(std::move(all), {py::ssize_t(points.size()), dim});
}
py::dict to_dict(const StrobeCycle& c, Eigen::Index dim) {
    py::dict d;
    d["points"] = rows(c.points, dim);
    d["multipliers"] = c.multipliers;
    d["residual"] = c.residual;
    return d;
}
py::dict to_dict(const Attractor& a, Eigen::Index dim) {
    py::dict d = to_dict(a.cycle, dim);
    d["periodic"] = a.periodic;
    d["radius"] = a.radius;
    if (!a.periodic)
        d["points"] = rows(a.cloud, dim);
    return d;
}

py::dict basins(const Model& model, const py::capsule& capsule, const Axes& axes, const Doubles& p,
                const Doubles& rest, double t0, int seeds, int settle, int longest, int newtons,
                int periods, double distance, bool times, int audit, std::uint64_t seed,
                const std::vector<double>& escape, bool eighth_order, double rtol,
                const Doubles& atol, double max_step, long long max_steps, long long max_events,
                int on_nonunique, int threads, const py::object& show) {
    const AnyLanes& lanes = lanes_in(capsule);
    const CellGrid grid = grid_of(axes);
    Analysis analysis(model, {.rtol = std::min(rtol, 1e-12), .atol = 1e-13});
    BasinSettings settings;
    settings.run = ensemble_settings(eighth_order, rtol, atol, max_step, 0, max_steps, max_events,
                                     on_nonunique);
    settings.t0 = t0;
    settings.rest = vector_of(rest);
    settings.seeds = seeds;
    settings.settle = settle;
    settings.longest = longest;
    settings.newtons = newtons;
    settings.periods = periods;
    settings.distance = distance;
    settings.times = times;
    settings.audit = audit;
    settings.seed = seed;
    settings.escape = escape;
    settings.parallel.threads = threads;
    settings.parallel.cancelled = [&analysis] { return analysis.signals(); };
    settings.parallel.progress = progress(show, analysis.signals);
    BasinFinder finder(*analysis.system, lanes, grid, vector_of(p), settings);
    std::optional<Basins> found;
    {
        const py::gil_scoped_release unlocked;
        found.emplace(finder.run());
    }
    Basins& b = *found;
    const auto n = py::ssize_t(grid.cells());
    std::vector<signed char> status;
    for (const Status s : b.status)
        status.push_back(static_cast<signed char>(s));
    status.resize(std::size_t(n), static_cast<signed char>(Status::interrupted));
    b.time.resize(std::size_t(n), -1);
    const Eigen::Index dim = analysis.system->dim();
    py::dict d;
    d["label"] = as_array(std::move(b.label), {n});
    d["time"] = as_array(std::move(b.time), {n});
    d["status"] = as_array(std::move(status), {n});
    py::list attractors, saddles, confusion;
    for (const Attractor& a : b.attractors)
        attractors.append(to_dict(a, dim));
    for (const StrobeCycle& s : b.saddles)
        saddles.append(to_dict(s, dim));
    for (const GroupCheck& g : b.confusion)
        confusion.append(py::make_tuple(g.group, g.attractor, g.cells));
    d["attractors"] = attractors;
    d["saddles"] = saddles;
    d["confusion"] = confusion;
    d["plain"] = to_dict(b.plain);
    d["periods"] = b.periods;
    d["by_exit"] = b.by_exit;
    d["by_exit_reason"] = b.by_exit_reason;
    d["looked_up"] = b.looked_up;
    d["audited"] = b.audited;
    d["disagreements"] = b.disagreements;
    d["counters"] = lane_counters_to_dict(b.counters);
    d["raised"] = analysis.signals.raised();
    return d;
}

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
        return to_dict(cell_map(grid_of(axes), view(image)));
    });
    m.def("basins", &basins);
}

} // namespace filippov::python
