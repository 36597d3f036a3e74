// SPDX-License-Identifier: BSD-3-Clause
// Boundaries of basins as curves, with their corners and what each point of them belongs to.
//
// The strobe map of a system that slides cannot be inverted, so stable sets are not grown backwards
// from a saddle. They are found as what they are in the picture: the points beside which fates
// differ.
#pragma once

#include <filippov/basins/basins.hpp>
#include <filippov/basins/corners.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// How the boundaries of basins are traced. Lengths are in pictures: it is one wide and one high.
struct BoundarySettings {
    ContourSettings contours{};
    double turn = 0.02; ///< the least of a corner, radians, 0 < turn < pi
    /// A point belongs to the stable set of a saddle if both sides of its bracket come nearer to it
    /// than this before they part, 0 < near < 1.
    double near = 1e-4;
};

/// What a boundary is.
enum class BoundaryKind : unsigned char {
    unknown,    ///< its sides neither come near to a saddle nor part at once
    stable_set, ///< of a saddle
    jump,       ///< the strobe map is discontinuous there, or somewhere on the way
};

/// A point of a boundary. Points are in units of the coordinates, distances in pictures.
struct BoundaryPoint {
    std::array<double, 2> at{};
    std::array<double, 2> left{}, right{}; ///< beside it, seen to differ in label
    BoundaryKind kind = BoundaryKind::unknown;
    int saddle = -1; ///< of a stable set: an index into Basins::saddles
    int periods = 0; ///< until the sides are nearest to the saddle; of a jump: until they parted
    double approach = std::numeric_limits<double>::infinity(); ///< to any saddle
    double apart = 0;                                          ///< the sides, after so many periods
};

/// A polyline along a boundary, with one basin on its left.
struct BoundaryCurve {
    std::int32_t left = 0, right = 0; ///< labels, see Contour
    bool closed = false;              ///< the last point is joined to the first
    std::vector<BoundaryPoint> points{};
    double distance = 0; ///< from the boundary, estimated, in pictures, see Contour
    int coarse = 0;      ///< times that a chord may be farther from it
};

/// A corner of a boundary.
struct BoundaryCorner {
    std::array<double, 2> at{}; ///< units of the coordinates
    double turn = 0;            ///< radians, in the picture, > 0 to the left
    double error = 0;           ///< in pictures, see ContourCorner
    int curve = 0;
    std::size_t point = 0; ///< the nearest of the curve
};

/// The boundaries of basins in a picture.
struct BasinBoundary {
    std::vector<BoundaryCurve> curves{};
    std::vector<BoundaryCorner> corners{};
    int unresolved = 0; ///< cells without a label: curves end beside them
    LabelWork work{};   ///< `interrupted`: curves are coarse, or of unknown kind
};

namespace detail {

/// The units of the coordinates.
inline std::array<double, 2> coordinates(const CellGrid& grid, const PicturePoint& u) {
    const auto along = [&](int k) {
        const CellAxis& axis = grid.axis(k);
        return axis.low + u[k] * (axis.high - axis.low);
    };
    return {along(0), along(1)};
}

/// Follows points until they have landed, and keeps the states at all flashes.
class Trails final : public Labelling {
public:
    std::vector<std::vector<Vector>> states; ///< of each point, its own first

    Trails(const StrobePicture& picture, const Landings& landings,
           const std::vector<Vector>& points)
        : Labelling(picture, landings, std::vector<Progress>(points.size()),
                    picture.settings.periods),
          states(points.size()), points_(points) {}
    void member(std::size_t id, MemberView& m) override {
        states[id].push_back(points_[id]);
        start(m, view(points_[id]), 1);
    }
    bool goes_on(std::size_t id, const OutcomeView& o) override {
        states[id].push_back(Eigen::Map<const Vector>(o.x.data(), Eigen::Index(o.x.size())));
        return Labelling::goes_on(id, o);
    }

protected:
    void land(std::size_t, std::int32_t, const Progress&) override {}
    void end(std::size_t, const OutcomeView&) override {}

private:
    const std::vector<Vector>& points_;
};

/// Tells what boundaries are, by following both sides of their brackets.
class BoundaryJudge {
public:
    BoundaryJudge(const StrobePicture& picture, const Basins& basins, double near)
        : picture_(picture), saddles_(basins.saddles), near_(near),
          landings_(basins.attractors, picture.unit, picture.settings.distance, false) {}

    void run(BasinBoundary& boundary) const {
        std::vector<BoundaryPoint*> points;
        for (BoundaryCurve& curve : boundary.curves)
            for (BoundaryPoint& point : curve.points)
                points.push_back(&point);
        constexpr std::size_t batch = 4096; // whose trails are in memory
        for (std::size_t k = 0; k < points.size() && boundary.work.status == Status::ok; k += batch)
            judge(std::span(points).subspan(k, std::min(batch, points.size() - k)), boundary.work);
    }

private:
    /// The sides are this far apart when they have parted at once, and were less by this factor.
    static constexpr double parted = 1e-3, at_once = 1e5;

    void judge(std::span<BoundaryPoint*> points, LabelWork& work) const {
        std::vector<Vector> starts;
        for (const BoundaryPoint* point : points) {
            starts.push_back(picture_.state(point->left));
            starts.push_back(picture_.state(point->right));
        }
        Trails trails(picture_, landings_, starts);
        picture_.run(starts.size(), trails, picture_.settings.run, work.status);
        if (work.status != Status::ok) {
            work.message = std::string(message(work.status));
            return;
        }
        for (std::size_t k = 0; k < points.size(); ++k)
            judge(trails.states[2 * k], trails.states[2 * k + 1], *points[k]);
    }
    void judge(const std::vector<Vector>& left, const std::vector<Vector>& right,
               BoundaryPoint& point) const {
        double before = picture_.apart(left[0], right[0]);
        for (std::size_t n = 0; n < std::min(left.size(), right.size()); ++n) {
            const double apart = picture_.apart(left[n], right[n]);
            if (apart >= parted && apart >= at_once * before) {
                point.kind = BoundaryKind::jump;
                point.saddle = -1;
                point.periods = int(n);
                point.apart = apart;
                return;
            }
            if (!(apart < parted))
                break;
            approach(left[n], int(n), apart, point);
            approach(right[n], int(n), apart, point);
            before = apart;
        }
        if (point.approach < near_)
            point.kind = BoundaryKind::stable_set;
        else
            point.saddle = -1;
    }
    void approach(const Vector& x, int n, double apart, BoundaryPoint& point) const {
        for (std::size_t s = 0; s < saddles_.size(); ++s)
            for (const Vector& y : saddles_[s].points)
                if (const double distance = picture_.apart(x, y); distance < point.approach) {
                    point.approach = distance;
                    point.saddle = int(s);
                    point.periods = n;
                    point.apart = apart;
                }
    }

    const StrobePicture& picture_;
    const std::vector<StrobeCycle>& saddles_;
    const double near_;
    const Landings landings_;
};

inline BasinBoundary in_coordinates(const CellGrid& grid, Contours contours,
                                    const std::vector<ContourCorner>& corners) {
    BasinBoundary boundary{.unresolved = contours.unresolved, .work = std::move(contours.work)};
    for (const Contour& from : contours.curves) {
        BoundaryCurve curve{.left = from.left,
                            .right = from.right,
                            .closed = from.closed,
                            .distance = from.distance,
                            .coarse = from.coarse};
        for (const Bracket& b : from.points)
            curve.points.push_back({.at = coordinates(grid, b.middle()),
                                    .left = coordinates(grid, b.left),
                                    .right = coordinates(grid, b.right)});
        boundary.curves.push_back(std::move(curve));
    }
    for (const ContourCorner& c : corners)
        boundary.corners.push_back({.at = coordinates(grid, c.at),
                                    .turn = c.turn,
                                    .error = c.error,
                                    .curve = c.curve,
                                    .point = c.point});
    return boundary;
}

} // namespace detail

/// The boundaries of basins: `trace_contours` and `find_corners` with labels by runs.
///
/// Then both sides of each bracket are followed, one flash after the other. The boundary is a jump
/// where they part at once: to more than 1e-3 pictures, and by a factor above 1e5 in one period. It
/// belongs to the stable set of a saddle if, before they are 1e-3 pictures apart, they come nearer
/// to it than `near`. A bracket of width w comes as near as w^theta, theta = ln|m| / (ln|m| - ln M)
/// for multipliers M and m, the largest below 1; where a slide makes that 0, as w.
///
/// @param basins    of the same system, parameters and settings: their grid, labels, attractors and
///                  saddles are used
/// @param settings  those of the BasinFinder; runs are made at a relative tolerance of 1e-12 and an
///                  absolute one of 1e-13 unless theirs are tighter. Progress counts labels, of
///                  which nobody knows how many there will be
/// @error  std::invalid_argument for settings or parameters that make no sense
/// @cost   see `trace_contours`; a label beside a boundary takes ln(1/w) / ln M periods
inline BasinBoundary basin_boundary(const AnySystem& system, const AnyLanes& lanes,
                                    const Basins& basins, const Vector& p,
                                    const BasinSettings& settings = {},
                                    const BoundarySettings& how = {}) {
    if (!(how.near > 0 && how.near < 1))
        detail::refuse("near", how.near, "expected 0 < near < 1");
    const CellGrid& grid = basins.grid;
    const BasinSettings tight = detail::tightened(settings);
    const detail::StrobePicture picture(system, lanes, grid, p, tight);
    const BasinLabeller labeller(system, lanes, grid, basins.attractors, p, tight);
    std::size_t asked = 0;
    const PointLabeller labels_of = [&](std::span<const PicturePoint> points,
                                        std::span<std::int32_t> labels) {
        std::vector<std::array<double, 2>> at;
        for (const PicturePoint& u : points)
            at.push_back(detail::coordinates(grid, u));
        std::vector<CellLabel> found(points.size());
        const bool all = labeller(at, found);
        std::transform(found.begin(), found.end(), labels.begin(),
                       [](const CellLabel& l) { return l.label; });
        asked += points.size();
        if (settings.parallel.progress)
            settings.parallel.progress(asked, asked);
        return all;
    };
    Contours contours =
        trace_contours(labels_of, grid.axis(0).n, grid.axis(1).n, how.contours, basins.label);
    const auto corners = find_corners(labels_of, contours, how.contours, how.turn);
    BasinBoundary boundary = detail::in_coordinates(grid, std::move(contours), corners);
    detail::BoundaryJudge(picture, basins, how.near).run(boundary);
    return boundary;
}

} // namespace filippov
