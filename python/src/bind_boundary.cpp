// SPDX-License-Identifier: BSD-3-Clause
#include "bind_basins.hpp"

#include <filippov/basins/unstable_set.hpp>

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace filippov::python {

namespace {

/// A BoundaryCurve: a column a point, its two coordinates in rows.
struct BoundaryCurveColumns {
    py::array_t<double> points, left_points, right_points;
    py::array_t<signed char> kind;
    py::array_t<std::int32_t> saddle, periods;
    py::array_t<double> approach;
    std::int32_t left = 0, right = 0;
    bool closed = false;
    double distance = 0;
    int coarse = 0;
};

/// A BasinBoundary, with what it cost.
struct BasinBoundaryResult {
    std::vector<BoundaryCurveColumns> curves{};
    std::vector<BoundaryCorner> corners;
    int unresolved = 0;
    long long labels = 0;
    int stuck = 0;
    std::string status, message;
    py::object raised = py::none();
};

/// An UnstableBranch: a row a point; its attractor is counted from 1, 0: none.
struct UnstableBranchColumns {
    py::array_t<double> points;
    py::array_t<std::int64_t> breaks;
    double length = 0;
    int attractor = 0;
    std::string status, message;
};

/// An UnstableSet without its saddle.
struct UnstableSetResult {
    std::array<UnstableBranchColumns, 2> branches;
    py::array_t<double> direction;
    double multiplier = 0;
    int turn = 1;
    py::object raised = py::none();
};

/// Saddles, of which slopes are computed again.
std::vector<StrobeCycle> saddles_of(const PictureOf& picture,
                                    const std::vector<StrobeCycleColumns>& saddles) {
    const AnySystem& system = *picture.analysis_.unstoppable;
    std::vector<StrobeCycle> found;
    for (const StrobeCycleColumns& saddle : saddles) {
        StrobeCycle c;
        c.points = points_of(saddle.points);
        c.multipliers = copy(saddle.multipliers);
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
BoundaryCurveColumns columns_of(const BoundaryCurve& c) {
    return {.points = columns(c, &BoundaryPoint::at),
            .left_points = columns(c, &BoundaryPoint::left),
            .right_points = columns(c, &BoundaryPoint::right),
            .kind = values<signed char>(c, &BoundaryPoint::kind),
            .saddle = values<std::int32_t>(c, &BoundaryPoint::saddle),
            .periods = values<std::int32_t>(c, &BoundaryPoint::periods),
            .approach = values<double>(c, &BoundaryPoint::approach),
            .left = c.left,
            .right = c.right,
            .closed = c.closed,
            .distance = c.distance,
            .coarse = c.coarse};
}

BasinBoundaryResult boundary(PictureOf& picture, const std::vector<AttractorColumns>& attractors,
                             const std::vector<StrobeCycleColumns>& saddles,
                             const Array<std::int32_t>& label, double distance, double width,
                             double turn, double near, long long max_labels,
                             const py::object& show) {
    Basins basins{.grid = picture.grid_};
    expect(label.size() == basins.grid.cells(), "every cell has a label");
    basins.label = copy(label);
    basins.attractors = attractors_of(attractors);
    basins.saddles = saddles_of(picture, saddles);
    const BoundarySettings how{
        .contours = {.width = width, .distance = distance, .max_labels = max_labels},
        .turn = turn,
        .near = near};
    BasinBoundary b = picture.unlocked(show, [&] {
        return basin_boundary(*picture.analysis_.system, lanes_in(picture.lanes_), basins,
                              picture.p_, picture.settings_, how);
    });
    BasinBoundaryResult result{.corners = std::move(b.corners),
                               .unresolved = b.unresolved,
                               .labels = b.work.labels,
                               .stuck = b.work.stuck,
                               .status = std::string(name(b.work.status)),
                               .message = b.work.message,
                               .raised = picture.analysis_.signals.raised()};
    for (const BoundaryCurve& c : b.curves)
        result.curves.push_back(columns_of(c));
    return result;
}

UnstableBranchColumns columns_of(const UnstableBranch& branch, Eigen::Index dim) {
    std::vector<std::int64_t> breaks(branch.breaks.begin(), branch.breaks.end());
    const auto n = py::ssize_t(breaks.size());
    return {.points = rows(branch.points, dim),
            .breaks = as_array(std::move(breaks), {n}),
            .length = branch.length,
            .attractor = branch.attractor + 1,
            .status = std::string(name(branch.status)),
            .message = branch.message};
}

UnstableSetResult unstable(PictureOf& picture, const std::vector<AttractorColumns>& attractors,
                           const std::vector<StrobeCycleColumns>& saddles, int point, double gap,
                           double distance, double near, double length, int generations,
                           long long max_points) {
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
    return {.branches = {columns_of(set.branches[0], picture.dim()),
                         columns_of(set.branches[1], picture.dim())},
            .direction = array_of(set.direction),
            .multiplier = set.multiplier,
            .turn = set.turn,
            .raised = picture.analysis_.signals.raised()};
}

} // namespace

void bind_boundary(py::module_& m) {
    bind_struct<BoundaryCurveColumns>(m, "BoundaryCurveColumns")
        .field("points", &BoundaryCurveColumns::points)
        .field("left_points", &BoundaryCurveColumns::left_points)
        .field("right_points", &BoundaryCurveColumns::right_points)
        .field("kind", &BoundaryCurveColumns::kind)
        .field("saddle", &BoundaryCurveColumns::saddle)
        .field("periods", &BoundaryCurveColumns::periods)
        .field("approach", &BoundaryCurveColumns::approach)
        .field("left", &BoundaryCurveColumns::left)
        .field("right", &BoundaryCurveColumns::right)
        .field("closed", &BoundaryCurveColumns::closed)
        .field("distance", &BoundaryCurveColumns::distance)
        .field("coarse", &BoundaryCurveColumns::coarse);
    bind_struct<BoundaryCorner>(m, "BoundaryCorner")
        .field("at", &BoundaryCorner::at)
        .field("turn", &BoundaryCorner::turn)
        .field("error", &BoundaryCorner::error)
        .field("curve", &BoundaryCorner::curve)
        .field("point", &BoundaryCorner::point);
    bind_struct<BasinBoundaryResult>(m, "BasinBoundaryResult")
        .field("curves", &BasinBoundaryResult::curves)
        .field("corners", &BasinBoundaryResult::corners)
        .field("unresolved", &BasinBoundaryResult::unresolved)
        .field("labels", &BasinBoundaryResult::labels)
        .field("stuck", &BasinBoundaryResult::stuck)
        .field("status", &BasinBoundaryResult::status)
        .field("message", &BasinBoundaryResult::message)
        .field("raised", &BasinBoundaryResult::raised);
    bind_struct<UnstableBranchColumns>(m, "UnstableBranchColumns")
        .field("points", &UnstableBranchColumns::points)
        .field("breaks", &UnstableBranchColumns::breaks)
        .field("length", &UnstableBranchColumns::length)
        .field("attractor", &UnstableBranchColumns::attractor)
        .field("status", &UnstableBranchColumns::status)
        .field("message", &UnstableBranchColumns::message);
    bind_struct<UnstableSetResult>(m, "UnstableSetResult")
        .field("branches", &UnstableSetResult::branches)
        .field("direction", &UnstableSetResult::direction)
        .field("multiplier", &UnstableSetResult::multiplier)
        .field("turn", &UnstableSetResult::turn)
        .field("raised", &UnstableSetResult::raised);
    m.def("basin_boundary", &boundary);
    m.def("unstable_set", &unstable);
}

} // namespace filippov::python
