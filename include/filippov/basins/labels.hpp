// SPDX-License-Identifier: BSD-3-Clause
// Attractors, and labels of points of a picture: the one that each comes to by its own trajectory.
#pragma once

#include <filippov/basins/detail/strobe_cycle.hpp>
#include <filippov/basins/picture.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_set>
#include <vector>

namespace filippov {

/// What trajectories end on.
struct Attractor {
    bool periodic = true;
    StrobeCycle cycle{};         ///< if it is periodic
    std::vector<Vector> cloud{}; ///< else points of it, one a forcing period
    /// Ellipsoids around the points of a cycle that P^period is seen to map into themselves,
    /// |v|^2 = v' S v in units of the picture: one S a point, one radius for all; 0: none found.
    std::vector<Matrix> norms{};
    double radius = 0;
};

namespace detail {

/// Boxes that a non-periodic attractor visits.
class VisitedBoxes {
public:
    VisitedBoxes(const std::vector<Vector>& cloud, const Vector& unit) : unit_(unit) {
        for (const Vector& x : cloud)
            if (const auto k = key(view(x)))
                visited_.insert(*k);
    }
    bool holds(std::span<const double> x) const {
        const auto k = key(x);
        return k && visited_.contains(*k);
    }

private:
    static constexpr double boxes = 100; ///< along the width of the picture
    std::optional<std::uint64_t> key(std::span<const double> x) const {
        std::uint64_t k = 0xcbf29ce484222325u;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double box = std::floor(x[i] / unit_[Eigen::Index(i)] * boxes);
            if (!(std::abs(box) < 1e15))
                return std::nullopt;
            k = (k ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(box))) * 0x100000001b3u;
        }
        return k;
    }
    Vector unit_;
    std::unordered_set<std::uint64_t> visited_; ///< hashes
};

/// Where a trajectory stands that is followed to its attractor.
struct Progress {
    std::int32_t periods = 0; ///< that are over
    std::int32_t box = 0;     ///< the non-periodic attractor that is visited, and how often
    std::int32_t in_box = 0;  ///< in a row
    std::int32_t time = -1;   ///< when it had landed
};

/// Tells whether trajectories have landed. Without allocations: it is asked once a period.
class Landings {
public:
    /// @param distance  from cycles, in units of the picture; 0: their ellipsoids
    /// @param strict    a tenth of the ellipsoids and ten times the visits, for an audit
    Landings(const std::vector<Attractor>& attractors, const Vector& unit, double distance,
             bool strict)
        : dim_(std::size_t(unit.size())), visits_(strict ? 200 : 20) {
        const Matrix scale = unit.cwiseInverse().asDiagonal();
        for (std::size_t a = 0; a < attractors.size(); ++a) {
            const Attractor& at = attractors[a];
            boxes_.emplace_back(at.cloud, unit);
            for (std::size_t k = 0; k < at.norms.size(); ++k) {
                // what labels go by, or a tenth of it
                const bool ball = distance > 0 && (!strict || !(at.radius > 0));
                const double own = ball ? distance : at.radius;
                const double bound = strict ? std::min(own / 10, 1e-4) : own;
                if (!(bound > 0))
                    continue;
                const Matrix S =
                    scale *
                    (ball ? Matrix::Identity(unit.size(), unit.size()).eval() : at.norms[k]) *
                    scale / (bound * bound);
                labels_.push_back(std::int32_t(a + 1));
                const Vector& x = at.cycle.points[k];
                numbers_.insert(numbers_.end(), x.begin(), x.end());
                numbers_.insert(numbers_.end(), S.data(), S.data() + S.size());
            }
        }
    }

    /// The attractor, from 1, at which a trajectory is known to be by this flash; 0: none.
    std::int32_t visit(std::span<const double> x, Progress& at) const {
        const double* from = numbers_.data();
        for (std::size_t k = 0; k < labels_.size(); ++k, from += dim_ * (dim_ + 1))
            if (size(x, from) <= 1) {
                at.time = at.periods;
                return labels_[k];
            }
        for (std::size_t a = 0; a < boxes_.size(); ++a)
            if (boxes_[a].holds(x)) {
                const auto label = std::int32_t(a + 1);
                at.in_box = at.box == label ? at.in_box + 1 : 1;
                at.box = label;
                if (at.in_box < visits_)
                    return 0;
                at.time = at.periods - at.in_box + 1;
                return label;
            }
        at.in_box = 0;
        return 0;
    }

private:
    /// (x - c)' S (x - c) of the c and S that are stored there.
    double size(std::span<const double> x, const double* c) const {
        const double* S = c + dim_;
        double sum = 0;
        for (std::size_t i = 0; i < dim_; ++i) {
            double row = 0;
            for (std::size_t j = 0; j < dim_; ++j)
                row += S[i * dim_ + j] * (x[j] - c[j]);
            sum += (x[i] - c[i]) * row;
        }
        return sum;
    }

    const std::size_t dim_;
    const int visits_;
    std::vector<std::int32_t> labels_;
    std::vector<double> numbers_; ///< of each ellipsoid: centre, and S, for the bound 1
    std::vector<VisitedBoxes> boxes_;
};

/// Follows points to their attractors.
class Labelling : public Flashes {
public:
    /// @param most  forcing periods of one
    Labelling(const StrobePicture& picture, const Landings& landings,
              std::vector<Progress> progress, int most)
        : Flashes(picture), landings_(landings), most_(most), progress_(std::move(progress)) {}

    bool goes_on(std::size_t id, const OutcomeView& o) override {
        Progress& at = progress_[id];
        ++at.periods;
        const std::int32_t label = landings_.visit(o.x, at);
        if (label > 0)
            land(id, label, at);
        return label == 0 && at.periods < most_;
    }
    void take(std::size_t id, const OutcomeView& o) override {
        const bool in_between = o.status != Status::ok;
        periods_ += progress_[id].periods + in_between;
        if (progress_[id].time < 0)
            end(id, o);
    }
    long long periods() const { return periods_; }

protected:
    virtual void land(std::size_t id, std::int32_t label, const Progress& at) = 0;
    /// It has ended without; with the status `ok` after as many periods as it may take.
    virtual void end(std::size_t id, const OutcomeView& o) = 0;

private:
    const Landings& landings_;
    const int most_;
    std::vector<Progress> progress_;
    std::atomic<long long> periods_{0};
};

/// Points on their way to their labels.
class PointLabelling final : public Labelling {
public:
    /// @param open  indices of the points that are followed
    PointLabelling(const StrobePicture& picture, const std::vector<Vector>& points,
                   const std::vector<std::size_t>& open, std::vector<Progress> progress,
                   const Landings& landings, int most, std::span<CellLabel> labels)
        : Labelling(picture, landings, std::move(progress), most), points_(points), open_(open),
          labels_(labels) {}
    void member(std::size_t id, MemberView& m) override { start(m, view(points_[open_[id]]), 1); }

protected:
    void land(std::size_t id, std::int32_t label, const Progress& at) override {
        labels_[open_[id]] = {label, at.time};
    }
    void end(std::size_t id, const OutcomeView& o) override {
        labels_[open_[id]].label = o.status == Status::escaped ? -1 : 0;
    }

private:
    const std::vector<Vector>& points_;
    const std::vector<std::size_t>& open_;
    std::span<CellLabel> labels_;
};

/// Follows points until they have landed, for so many forcing periods at most.
inline std::vector<CellLabel> label_points(const StrobePicture& picture,
                                           const std::vector<Vector>& points,
                                           const Landings& landings, int most, Status& state) {
    std::vector<CellLabel> labels(points.size());
    std::vector<std::size_t> open;
    std::vector<Progress> progress;
    for (std::size_t k = 0; k < points.size(); ++k) {
        Progress at;
        labels[k] = {landings.visit(view(points[k]), at), at.time};
        if (labels[k].label == 0) {
            open.push_back(k);
            progress.push_back(at);
        }
    }
    PointLabelling run(picture, points, open, std::move(progress), landings, most, labels);
    picture.run(open.size(), run, picture.settings.run, state);
    return labels;
}

} // namespace detail

/// Labels any points of a picture by their own trajectories, in lanes: for `refine`,
/// `count_uncertain_pairs`, and whatever else asks a function of points.
class BasinLabeller {
public:
    /// @param system, lanes  of the same model; they must outlive the labeller
    /// @param attractors     see BasinFinder
    /// @error std::invalid_argument for what makes no sense, as BasinFinder
    BasinLabeller(const AnySystem& system, const AnyLanes& lanes, const CellGrid& grid,
                  const std::vector<Attractor>& attractors, Vector p, BasinSettings settings = {})
        : picture_(system, lanes, grid, std::move(p), std::move(settings)),
          landings_(attractors, picture_.unit, picture_.settings.distance, false) {
        picture_.settings.parallel.progress = nullptr;
    }

    /// @param labels  of the same size: 1, 2, ... the attractor, 0 unresolved, -1 escaped, and the
    ///                number of the flash at which it had landed, -1 where it did not
    /// @return        false if it was interrupted
    bool operator()(std::span<const std::array<double, 2>> points,
                    std::span<CellLabel> labels) const {
        // an interruption is noticed by runs, so what comes before them must not be long
        constexpr std::size_t block = 1 << 18;
        Status ended = Status::ok;
        for (std::size_t first = 0; first < points.size() && ended == Status::ok; first += block) {
            std::vector<Vector> states;
            for (const auto& point : points.subspan(first, std::min(block, points.size() - first)))
                states.push_back(state(point));
            const auto found =
                detail::label_points(picture_, states, landings_, picture_.settings.periods, ended);
            std::copy(found.begin(), found.end(), labels.begin() + std::ptrdiff_t(first));
        }
        return ended == Status::ok;
    }
    /// The state of a point of the picture.
    Vector state(const std::array<double, 2>& point) const { return picture_.state(point); }

private:
    detail::StrobePicture picture_;
    const detail::Landings landings_;
};

} // namespace filippov
