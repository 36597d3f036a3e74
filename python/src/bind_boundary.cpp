// SPDX-License-Identifier: BSD-3-Clause
#include "bind_basins.hpp"

#include <filippov/basins/unstable_set.hpp>

namespace filippov::python {

namespace {

/// @param saddles  points of each, shape (period, dim), and multipliers; slopes are computed again
std::vector<StrobeCycle> saddles_of(const PictureOf& picture, const py::list& saddles) {
    const AnySystem& system = *picture.analysis_.unstoppable;
    std::vector<StrobeCycle> found;
    for (const py::handle item : saddles) {
        const auto d = py::reinterpret_borrow<py::dict>(item);
        StrobeCycle c;
        c.points = points_of(d["points"].cast<Array<double>>());
        c.multipliers = d["multipliers"].cast<std::vector<std::complex<double>>>();
        for (const Vector& x : c.points)
            c.slopes.push_back(strobe(system, picture.settings_.t0, x, picture.p_)
                                   .slope.topLeftCorner(x.size(), x.size()));
        found.push_back(std::move(c));
    }
    return found;
}
template <class Member> py::array_t<double> columns(const BoundaryCurve& curve, Member member) {
    std::vector<double> all;
    for (const std::size_t k : {0u, 1u})
        for (const BoundaryPoint& point : curve.points)
            all.push_back((point.*member)[k]);
    return as_array(std::move(all), {2, py::ssize_t(curve.points.size())});
}
template <class T, class Member> py::array_t<T> values(const BoundaryCurve& curve, Member member) {
    std::vector<T> all;
    for (const BoundaryPoint& point : curve.points)
        all.push_back(static_cast<T>(point.*member));
    return as_array(std::move(all), {py::ssize_t(curve.points.size())});
}
py::dict to_dict(const BoundaryCurve& c) {
    py::dict d;
    d["points"] = columns(c, &BoundaryPoint::at);
    d["left_points"] = columns(c, &BoundaryPoint::left);
    d["right_points"] = columns(c, &BoundaryPoint::right);
    d["kind"] = values<signed char>(c, &BoundaryPoint::kind);
    d["saddle"] = values<std::int32_t>(c, &BoundaryPoint::saddle);
    d["periods"] = values<std::int32_t>(c, &BoundaryPoint::periods);
    d["approach"] = values<double>(c, &BoundaryPoint::approach);
    d["left"] = c.left;
    d["right"] = c.right;
    d["closed"] = c.closed;
    d["distance"] = c.distance;
    d["coarse"] = c.coarse;
    return d;
}

py::dict boundary(PictureOf& picture, const py::list& attractors, const py::list& saddles,
                  const Array<std::int32_t>& label, double distance, double width, double turn,
                  double near, long long max_labels, const py::object& show) {
    Basins basins{.grid = picture.grid_};
    expect(label.size() == basins.grid.cells(), "every cell has a label");
    basins.label = copy(label);
    basins.attractors = attractors_of(attractors);
    basins.saddles = saddles_of(picture, saddles);
    const BoundarySettings how{
        .contours = {.width = width, .distance = distance, .max_labels = max_labels},
        .turn = turn,
        .near = near};
    const BasinBoundary b = picture.unlocked(show, [&] {
        return basin_boundary(*picture.analysis_.system, lanes_in(picture.lanes_), basins,
                              picture.p_, picture.settings_, how);
    });
    py::list curves, corners;
    for (const BoundaryCurve& c : b.curves)
        curves.append(to_dict(c));
    for (const BoundaryCorner& c : b.corners)
        corners.append(py::make_tuple(c.at[0], c.at[1], c.turn, c.error, c.curve, c.point));
    py::dict d;
    d["curves"] = curves;
    d["corners"] = corners;
    d["unresolved"] = b.unresolved;
    d["labels"] = b.work.labels;
    d["stuck"] = b.work.stuck;
    d["status"] = std::string(name(b.work.status));
    d["message"] = b.work.message;
    d["raised"] = picture.analysis_.signals.raised();
    return d;
}

py::dict to_dict(const UnstableBranch& branch, Eigen::Index dim) {
    std::vector<double> points;
    for (const Vector& x : branch.points)
        points.insert(points.end(), x.begin(), x.end());
    std::vector<std::int64_t> breaks(branch.breaks.begin(), branch.breaks.end());
    const auto n = py::ssize_t(breaks.size());
    py::dict d;
    d["points"] = as_array(std::move(points), {py::ssize_t(branch.points.size()), dim});
    d["breaks"] = as_array(std::move(breaks), {n});
    d["length"] = branch.length;
    d["attractor"] = branch.attractor + 1;
    d["status"] = std::string(name(branch.status));
    d["message"] = branch.message;
    return d;
}

py::dict unstable(PictureOf& picture, const py::list& attractors, const py::list& saddles,
                  int point, double gap, double distance, double near, double length,
                  int generations, long long max_points) {
    Basins basins{.grid = picture.grid_};
    basins.attractors = attractors_of(attractors);
    const std::vector<StrobeCycle> saddle = saddles_of(picture, saddles);
    expect(saddle.size() == 1, "one saddle is given");
    const UnstableSettings how{.gap = gap,
                               .distance = distance,
                               .near = near,
                               .length = length,
                               .generations = generations,
                               .max_points = max_points};
    const UnstableSet set = picture.unlocked(py::none(), [&] {
        return unstable_set(*picture.analysis_.system, lanes_in(picture.lanes_), basins, saddle[0],
                            picture.p_, picture.settings_, how, point);
    });
    py::dict d;
    d["branches"] = py::make_tuple(to_dict(set.branches[0], picture.dim()),
                                   to_dict(set.branches[1], picture.dim()));
    d["direction"] =
        as_array(std::vector<double>(set.direction.begin(), set.direction.end()), {picture.dim()});
    d["multiplier"] = set.multiplier;
    d["turn"] = set.turn;
    d["raised"] = picture.analysis_.signals.raised();
    return d;
}

} // namespace

void bind_boundary(py::module_& m) {
    m.def("basin_boundary", &boundary);
    m.def("unstable_set", &unstable);
}

} // namespace filippov::python
