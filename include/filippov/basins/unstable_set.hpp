// SPDX-License-Identifier: BSD-3-Clause
// Unstable sets of saddles of the strobe map.
#pragma once

#include <filippov/basins/boundary.hpp>
#include <filippov/orbits/dense.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// How an unstable set is grown. Lengths are in pictures: it is one wide and one high.
struct UnstableSettings {
    double gap = 0.01;                ///< between neighbours at most, > 0
    double turn = 0.3;                ///< at a point at most, radians, > 0
    double distance = 1e-6;           ///< from polyline to curve, estimated; > 0
    double first = 1e-6;              ///< from the saddle to the first point at most, > 0
    double near = 1e-4;               ///< a branch ends this near to an attractor, > 0
    double length = 50;               ///< of a branch at most, > 0
    int generations = 1000;           ///< images of the first segment at most, > 0
    long long max_points = 1'000'000; ///< of a branch, > 0
};

/// One of the two branches of an unstable set.
struct UnstableBranch {
    int side = 1;                    ///< begins along `direction`, or against it: -1
    std::vector<Vector> points;      ///< in order from the saddle, which is the first
    std::vector<std::size_t> breaks; ///< the map jumps between these points and the next
    double length = 0;
    int attractor = -1; ///< the index of the one it ends at, -1: none
    Status status = Status::ok;
    std::string message = "The branch ends at an attractor.";
};

/// The unstable set of a saddle of the strobe map.
struct UnstableSet {
    Vector saddle;                          ///< the point of it that the set was grown from
    Vector direction;                       ///< unstable eigenvector there, of length 1 in pictures
    double multiplier = 0;                  ///< > 1, of the map that it was grown with
    int turn = 1;                           ///< forcing periods of that map: those of the cycle,
                                            ///< twice if its own multiplier is negative
    std::array<UnstableBranch, 2> branches; ///< +, -
    Status status = Status::ok;             ///< the first of the branches' that is not ok
};

namespace detail {

/// Grows one branch, generation by generation.
class BranchGrower {
public:
    BranchGrower(const StrobePicture& picture, const std::vector<Attractor>& attractors,
                 const UnstableSettings& settings, const UnstableSet& set)
        : picture_(picture), attractors_(attractors), settings_(settings), set_(set) {}

    UnstableBranch grow(int side) {
        branch_ = {};
        branch_.side = side;
        branch_.points.push_back(set_.saddle);
        begin();
        for (int n = 1; open() && n <= settings_.generations; ++n) {
            keep();
            if (!open() || arrived())
                return std::move(branch_);
            next(n);
        }
        if (open())
            fail(Status::max_steps,
                 "`generations` was used up before the branch came to an attractor.");
        return std::move(branch_);
    }

private:
    struct Sample {
        double u; ///< place in the first segment, from 0 to 1
        Vector x;
    };

    bool open() const { return branch_.status == Status::ok; }
    void fail(Status status, std::string why) {
        branch_.status = status;
        branch_.message = std::move(why);
    }

    /// A point of the first segment.
    Vector seed(double u) const {
        return set_.saddle + branch_.side * first_ * std::pow(set_.multiplier, u) * set_.direction;
    }
    /// Near enough to the saddle that the segment's image continues it.
    void begin() {
        first_ = settings_.first;
        generation_.clear();
        for (int k = 0; k < 20 && open(); ++k, first_ /= 2) {
            std::vector<Vector> image{seed(0)};
            if (map(image, 1) && picture_.apart(image[0], seed(1)) <= 1e-3 * first_) {
                for (const double u : {0.0, 0.25, 0.5, 0.75, 1.0}) // by which turns are seen
                    generation_.push_back({u, seed(u)});
                return;
            }
        }
        if (open())
            fail(Status::not_converged, "The map is not linear near the saddle, on this side of it "
                                        "and in the direction of its eigenvector.");
    }
    /// Images of points after so many turns.
    bool map(std::vector<Vector>& points, int turns) {
        Followed run(picture_, points, PointsAre::flashed, turns * set_.turn, 1);
        Status status = Status::ok;
        picture_.run(points.size(), run, picture_.settings.run, status);
        if (status != Status::ok)
            fail(status, std::string(message(status)));
        for (std::size_t k = 0; k < points.size() && open(); ++k) {
            if (run.status[k] != Status::ok)
                fail(run.status[k], "A point of it: " + std::string(message(run.status[k])));
            else
                points[k] = run.states[k].back();
        }
        return open();
    }

    void next(int n) {
        std::vector<Vector> points;
        for (const Sample& s : generation_)
            points.push_back(s.x);
        if (!map(points, 1))
            return;
        for (std::size_t k = 0; k < points.size(); ++k)
            generation_[k].x = points[k];
        constexpr int rounds = 60;
        for (int round = 0; round < rounds && open() && insert(n); ++round) {
        }
    }
    /// Hobson's criteria: new points where neighbours are far apart, or where the curve turns more
    /// than its chords show.
    bool insert(int n) {
        std::vector<double> where;
        std::vector<Vector> fresh;
        for (std::size_t k = 0; k + 1 < generation_.size(); ++k)
            if (too_coarse(k)) {
                where.push_back((generation_[k].u + generation_[k + 1].u) / 2);
                fresh.push_back(seed(where.back()));
            }
        const std::size_t all = branch_.points.size() + generation_.size() + fresh.size();
        if (all > std::size_t(settings_.max_points))
            fail(Status::max_steps, "`max_points` was used up.");
        if (!open() || fresh.empty() || !map(fresh, n))
            return false;
        for (std::size_t k = 0; k < fresh.size(); ++k)
            generation_.push_back({where[k], fresh[k]});
        std::sort(generation_.begin(), generation_.end(),
                  [](const Sample& a, const Sample& b) { return a.u < b.u; });
        return true;
    }
    bool too_coarse(std::size_t k) const {
        constexpr double finest = 1e-13; // of the first segment
        const Sample &a = generation_[k], &b = generation_[k + 1];
        const double gap = picture_.apart(a.x, b.x);
        if (!(b.u - a.u > finest) || gap <= settings_.distance)
            return false;
        const double turns = std::max(turn_at(k), turn_at(k + 1));
        return gap > settings_.gap || turns > settings_.turn ||
               gap * turns > 8 * settings_.distance; // an arc is gap * turn / 8 off its chord
    }
    /// Of the polyline at a point of the generation; 0 at its ends.
    double turn_at(std::size_t k) const {
        if (k == 0 || k + 1 >= generation_.size())
            return 0;
        const Vector a = (generation_[k].x - generation_[k - 1].x).cwiseQuotient(picture_.unit),
                     b = (generation_[k + 1].x - generation_[k].x).cwiseQuotient(picture_.unit);
        if (!(a.norm() * b.norm() > 0))
            return 0;
        // By the chords' difference: exact for small angles, too.
        return 2 * std::asin(std::min(1.0, (a / a.norm() - b / b.norm()).norm() / 2));
    }

    /// Takes a generation over, but for its last point, from which the next begins.
    void keep() {
        for (std::size_t k = 0; k + 1 < generation_.size() && open(); ++k) {
            const Vector& x = generation_[k].x;
            const double step = picture_.apart(x, branch_.points.back());
            if (k > 0 && step > settings_.gap)
                branch_.breaks.push_back(branch_.points.size() - 1);
            branch_.length += step;
            branch_.points.push_back(x);
            if (!(branch_.length < settings_.length))
                fail(Status::max_steps,
                     "`length` was reached before the branch came to an attractor.");
        }
    }
    /// Whether all points of the generation are near to one attractor.
    bool arrived() {
        for (std::size_t a = 0; a < attractors_.size(); ++a) {
            const Attractor& to = attractors_[a];
            const auto& points = to.periodic ? to.cycle.points : to.cloud;
            const auto near = [&](const Sample& s) {
                return std::any_of(points.begin(), points.end(), [&](const Vector& y) {
                    return picture_.apart(s.x, y) <= settings_.near;
                });
            };
            if (std::all_of(generation_.begin(), generation_.end(), near)) {
                branch_.attractor = int(a);
                return true;
            }
        }
        return false;
    }

    const StrobePicture& picture_;
    const std::vector<Attractor>& attractors_;
    const UnstableSettings& settings_;
    const UnstableSet& set_;
    double first_ = 0;
    std::vector<Sample> generation_;
    UnstableBranch branch_;
};

inline void validate(const UnstableSettings& s) {
    const auto positive = [](const char* name, double value) {
        if (!(value > 0 && value < std::numeric_limits<double>::infinity()))
            refuse(name, value, "expected a finite number > 0");
    };
    positive("gap", s.gap);
    positive("turn", s.turn);
    positive("distance", s.distance);
    positive("first", s.first);
    positive("near", s.near);
    positive("length", s.length);
    positive("generations", s.generations);
    positive("max_points", double(s.max_points));
}

/// A set without branches: where it begins, in which direction, with which map.
inline UnstableSet unstable_direction(const StrobePicture& picture, const StrobeCycle& saddle,
                                      int point) {
    const auto unstable = std::count_if(saddle.multipliers.begin(), saddle.multipliers.end(),
                                        [](const auto& mu) { return !(std::abs(mu) < 1); });
    if (unstable != 1 || saddle.multipliers.front().imag() != 0)
        refuse("saddle.multipliers", double(unstable),
               "expected exactly one outside the unit circle, a real one");
    const auto k = std::size_t(point);
    const dense::EigenPairs eigen = dense::eigen_pairs(saddle.round(k));
    Eigen::Index largest = 0, leading = 0;
    eigen.values.cwiseAbs().maxCoeff(&largest);
    UnstableSet set{.saddle = saddle.points[k],
                    .direction = eigen.vectors.col(largest).real(),
                    .multiplier = eigen.values[largest].real(),
                    .turn = saddle.period(),
                    .branches = {}};
    const Vector size = set.direction.cwiseQuotient(picture.unit);
    size.cwiseAbs().maxCoeff(&leading); // the sign of an eigenvector is nobody's choice
    set.direction /= size[leading] < 0 ? -size.norm() : size.norm();
    if (set.multiplier < 0) {
        set.multiplier *= set.multiplier;
        set.turn *= 2;
    }
    return set;
}

} // namespace detail

/// The unstable set of a saddle: both branches, grown by mapping a first segment, from a point near
/// the saddle to its image, forwards.
///
/// Each generation is the image of the one before. Where neighbours are too far apart, or the
/// polyline turns too much for its chords, points are put in: each is a point of the first segment,
/// mapped as often as the generation counts, so that no point is interpolated. Errors across the
/// curve contract on the way. Where the map jumps, points stay far apart: `breaks`.
///
/// @param basins    of the same system, parameters and settings: their grid, and the attractors,
///                  near which a branch ends
/// @param settings  those of the BasinFinder; runs are tightened as in `basin_boundary`
/// @param point     which point of a cycle to begin at; the others' sets are its images
/// @error  std::invalid_argument for a cycle that has not exactly one multiplier, a real one,
///         outside the unit circle, for a point that it does not have, or settings or parameters
///         that make no sense
/// @source Hobson, J. Comput. Phys. 104 (1993) 14-22
inline UnstableSet unstable_set(const AnySystem& system, const AnyLanes& lanes,
                                const Basins& basins, const StrobeCycle& saddle, const Vector& p,
                                const BasinSettings& settings = {},
                                const UnstableSettings& how = {}, int point = 0) {
    detail::validate(how);
    if (!(point >= 0 && point < saddle.period()))
        detail::refuse("point", point, "expected an index of a point of the cycle");
    const detail::StrobePicture picture(system, lanes, basins.grid, p, detail::tightened(settings));
    UnstableSet set = detail::unstable_direction(picture, saddle, point);
    detail::BranchGrower grower(picture, basins.attractors, how, set);
    std::array<UnstableBranch, 2> branches{grower.grow(1), grower.grow(-1)};
    set.branches = std::move(branches);
    for (const UnstableBranch& branch : set.branches)
        if (set.status == Status::ok)
            set.status = branch.status;
    return set;
}

} // namespace filippov
