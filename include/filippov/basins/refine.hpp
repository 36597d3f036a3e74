// SPDX-License-Identifier: BSD-3-Clause
// Pictures of basins by cells that are split only along the boundaries, with an audit of the rest.
#pragma once

#include <filippov/basins/detail/quad_tree.hpp>
#include <filippov/core/statistics.hpp>
#include <filippov/core/status.hpp>
#include <filippov/run/settings.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace filippov {

/// A part of the plane.
struct Rectangle {
    std::array<double, 2> low{0, 0}, high{1, 1}; ///< finite, low < high, units of the coordinates
};

/// How a picture is refined.
struct RefineSettings {
    int coarse = 32; ///< cells along either side at first, > 0; what is finer can be missed
    int levels = 6;  ///< splits, 0 ... 20, so that coarse * 2^levels <= 2^20 are the finest cells
    std::int32_t time_jump = 0; ///< split also where `time` differs by more, >= 0; 0: labels alone
    /// Stop where the counts of split cells grow with this dimension, or a higher one, over four
    /// levels; > 0. Near 2 every cell is split, and refinement gains nothing.
    double full_dimension = 1.9;
    long long max_points = 50'000'000; ///< labels before the audit, 1 ... 2^31 - 1
    int audit = 1000;                  ///< points of the audit, 0 ... 10'000'000
    std::uint64_t seed = 1;            ///< of the audit
};

/// Labels on a grid of pixels, row-major over (first axis, second axis): pixel (i, j) is entry
/// i * ny + j.
struct Picture {
    int nx = 0, ny = 0;
    std::vector<std::int32_t> label, time; ///< shape (nx, ny)
};

/// What was found on one level.
struct LevelCount {
    /// Squares with another label than a neighbour of the same level (or a larger leaf beside it):
    /// those of the boundary in the picture of this level alone.
    long long boundary = 0;
    /// Squares marked to be split, also because of finer neighbours, a jump of `time` or the
    /// balance. They were, save the last ones where refinement stopped early.
    long long marked = 0;
};

/// Dimension of a boundary, from the growth of the counts of its squares.
struct BoundaryDimension {
    double value = std::numeric_limits<double>::quiet_NaN(); ///< NaN below two counts
    /// Standard error of the fitted slope, NaN below three counts. The counts' own approach to a
    /// power law is no random error: on few levels the truth can be several errors away.
    double error = std::numeric_limits<double>::quiet_NaN();
    int levels = 0; ///< counts that were fitted
};

/// Random points in the leaves without a neighbour of another label, uniform over their area.
struct Audit {
    int points = 0, wrong = 0;
    double share = 0; ///< of the picture's area that those leaves have
    double bound = 1; ///< 95% upper bound of the wrong part of that area
};

/// A refined picture.
struct Refined {
    Rectangle box;
    QuadTree tree;
    std::vector<LevelCount> counts; ///< by level, 0 ... levels
    long long trajectories = 0;     ///< labels taken, those of the audit not among them
    BoundaryDimension dimension;
    Audit audit;
    /// `not_converged` where the boundary fills the plane, `max_steps` where `max_points` were not
    /// enough, `interrupted`.
    Status status = Status::ok;
    std::string message = "Every square with a neighbour of another label is of the finest level.";

    std::vector<Leaf> leaves() const {
        std::vector<Leaf> all;
        for (std::int32_t k = 0; k < tree.size(); ++k)
            if (tree.is_leaf(k))
                all.push_back(tree[k]);
        return all;
    }
    /// A point of a leaf: u = v = 1/2 is the centre, where it was labelled.
    std::array<double, 2> point(const Leaf& leaf, double u = 0.5, double v = 0.5) const {
        const double n = tree.side(leaf.level);
        return {box.low[0] + (box.high[0] - box.low[0]) * ((leaf.i + u) / n),
                box.low[1] + (box.high[1] - box.low[1]) * ((leaf.j + v) / n)};
    }
    /// Labels of the leaves that hold the centres of nx times ny pixels.
    /// @error std::invalid_argument unless 1 <= nx, ny <= 100'000
    Picture paint(int nx, int ny) const {
        if (!(nx >= 1 && nx <= 100'000))
            detail::refuse("nx", nx, "expected an integer from 1 to 100000");
        if (!(ny >= 1 && ny <= 100'000))
            detail::refuse("ny", ny, "expected an integer from 1 to 100000");
        const std::int64_t n = tree.side(tree.levels());
        const auto finest = [n](int pixel, int pixels) {
            return static_cast<std::int32_t>((2 * pixel + 1) * n / (2 * pixels));
        };
        Picture picture{nx, ny, {}, {}};
        picture.label.reserve(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
        picture.time.reserve(picture.label.capacity());
        for (int i = 0; i < nx; ++i)
            for (int j = 0; j < ny; ++j) {
                const CellLabel& found = tree.at(finest(i, nx), finest(j, ny)).label;
                picture.label.push_back(found.label);
                picture.time.push_back(found.time);
            }
        return picture;
    }
};

namespace detail {

inline void validate(const Rectangle& box) {
    for (std::size_t k = 0; k < 2; ++k) {
        const std::string index = "[" + std::to_string(k) + "]";
        if (!std::isfinite(box.low[k]))
            refuse("low" + index, box.low[k], "expected a finite number");
        if (!(box.high[k] > box.low[k] && std::isfinite(box.high[k] - box.low[k])))
            refuse("high" + index, box.high[k], "expected a finite number > low");
    }
}
inline void validate(const RefineSettings& s) {
    if (!(s.coarse >= 1 && s.coarse <= 1 << 20))
        refuse("coarse", s.coarse, "expected an integer from 1 to 2^20");
    if (!(s.levels >= 0 && s.levels <= 20 && std::int64_t(s.coarse) << s.levels <= 1 << 20))
        refuse("levels", s.levels, "expected an integer >= 0 with coarse * 2^levels <= 2^20");
    if (!(s.time_jump >= 0))
        refuse("time_jump", s.time_jump, "expected an integer >= 0 (0: labels alone)");
    if (!(s.full_dimension > 0))
        refuse("full_dimension", s.full_dimension, "expected a number > 0");
    if (!(s.max_points >= 1 && s.max_points <= std::numeric_limits<std::int32_t>::max()))
        refuse("max_points", s.max_points, "expected an integer from 1 to 2^31 - 1");
    if (!(std::int64_t(s.coarse) * s.coarse <= s.max_points))
        refuse("coarse", s.coarse, "expected at most max_points squares at first");
    if (!(s.audit >= 0 && s.audit <= 10'000'000))
        refuse("audit", s.audit, "expected an integer from 0 to 10000000");
}

/// Least squares of log2(count) over the finer half of the levels, but at least three: the first
/// levels do not see a boundary's details yet.
inline BoundaryDimension boundary_dimension(const std::vector<LevelCount>& counts) {
    std::vector<double> levels, logs;
    for (std::size_t k = 0; k < counts.size(); ++k)
        if (counts[k].boundary > 0) {
            levels.push_back(double(k));
            logs.push_back(std::log2(double(counts[k].boundary)));
        }
    const std::size_t n = std::min(levels.size(), std::max<std::size_t>(3, levels.size() / 2 + 1));
    BoundaryDimension fit;
    fit.levels = static_cast<int>(n);
    if (n < 2)
        return fit;
    const std::size_t first = levels.size() - n;
    const Line line = fit_line(std::span(levels).subspan(first), std::span(logs).subspan(first),
                               std::vector(n, 1.0));
    fit.value = line.slope;
    if (n > 2)
        fit.error = std::sqrt(line.chi2 / (double(n) - 2) / line.spread);
    return fit;
}

/// Splits a picture until its boundaries are of the finest level.
template <class Labeller> class Refinement {
public:
    Refinement(Labeller& labeller, const Rectangle& box, const RefineSettings& settings)
        : labeller_(labeller), settings_(settings) {
        picture_.box = box;
        picture_.tree = QuadTree(settings.coarse, settings.levels);
        picture_.counts.resize(static_cast<std::size_t>(settings.levels) + 1);
    }

    Refined run() {
        label_from(0);
        std::int32_t fresh = 0; // what is not older is new in this round
        while (picture_.status == Status::ok && mark_from(fresh) && may_split()) {
            fresh = tree().size();
            for (const std::int32_t k : marked_)
                tree().split(k);
            label_from(fresh);
        }
        if (picture_.status != Status::interrupted)
            judge();
        return std::move(picture_);
    }

private:
    QuadTree& tree() { return picture_.tree; }
    LevelCount& count(std::int32_t k) {
        return picture_.counts[static_cast<std::size_t>(tree()[k].level)];
    }
    void end(Status status, std::string why) {
        picture_.status = status;
        picture_.message = std::move(why);
    }

    /// False, and the run ends, if the labeller says that it was interrupted.
    bool ask(const std::vector<std::array<double, 2>>& points, std::vector<CellLabel>& labels) {
        labels.assign(points.size(), {});
        const std::span<const std::array<double, 2>> from(points);
        const std::span<CellLabel> to(labels);
        if constexpr (std::convertible_to<decltype(labeller_(from, to)), bool>) {
            if (!labeller_(from, to)) {
                end(Status::interrupted, std::string(message(Status::interrupted)));
                return false;
            }
        } else {
            labeller_(from, to);
        }
        return true;
    }
    void label_from(std::int32_t fresh) {
        std::vector<std::array<double, 2>> points;
        std::vector<CellLabel> labels;
        for (std::int32_t k = fresh; k < tree().size(); ++k)
            points.push_back(picture_.point(tree()[k]));
        ask(points, labels);
        picture_.trajectories += static_cast<long long>(points.size());
        for (std::size_t k = 0; k < labels.size(); ++k)
            tree().set_label(fresh + static_cast<std::int32_t>(k), labels[k]);
    }

    bool jumps(const CellLabel& a, const CellLabel& b) const {
        return settings_.time_jump > 0 &&
               std::abs(std::int64_t(a.time) - b.time) > settings_.time_jump;
    }
    /// Marks what the new squares show to be too coarse, themselves or their neighbours. False if
    /// that is nothing.
    bool mark_from(std::int32_t fresh) {
        is_marked_.resize(static_cast<std::size_t>(tree().size()));
        marked_.clear();
        for (std::int32_t a = fresh; a < tree().size(); ++a)
            tree().visit_touching(a, [&](std::int32_t b) { compare(a, b); });
        return !marked_.empty();
    }
    void compare(std::int32_t a, std::int32_t b) {
        const Leaf &s = tree()[a], &t = tree()[b];
        const bool differ = s.label.label != t.label.label || jumps(s.label, t.label);
        // Neighbours are at most one level apart, so that no thin feature ends at a wide square.
        if (differ || s.level > t.level + 1)
            mark(b);
        if (differ || t.level > s.level + 1)
            mark(a);
    }
    void mark(std::int32_t k) {
        const auto at = static_cast<std::size_t>(k);
        if (tree()[k].level == tree().levels() || is_marked_[at])
            return;
        is_marked_[at] = true;
        marked_.push_back(k);
        ++count(k).marked;
    }

    bool may_split() {
        if (const int top = full_from(); top >= 0) {
            const auto last = static_cast<std::size_t>(top) + growth_levels;
            char digits[16];
            std::snprintf(digits, sizeof digits, "%.2f", growth(last - growth_levels, last));
            end(Status::not_converged,
                "The boundary looks " + std::string(digits) + "-dimensional from level " +
                    std::to_string(top) + " to level " + std::to_string(last) +
                    ": nearly every square would be split. Sample the basins instead, or raise "
                    "coarse or full_dimension if they are only finer than these squares.");
        } else if (picture_.trajectories + 4 * static_cast<long long>(marked_.size()) >
                   settings_.max_points) {
            end(Status::max_steps, "max_points would be exceeded; squares beside a boundary are "
                                   "coarser than the finest level.");
        }
        return picture_.status == Status::ok;
    }
    static constexpr std::size_t growth_levels = 3;
    /// Dimension by which the counts of split squares grow from one level to another.
    double growth(std::size_t from, std::size_t to) const {
        return std::log2(double(picture_.counts[to].marked) /
                         double(picture_.counts[from].marked)) /
               double(to - from);
    }
    /// The first of the levels over which nearly every square is split, -1 if there are none.
    int full_from() const {
        std::size_t last = picture_.counts.size();
        while (last > 0 && picture_.counts[last - 1].marked == 0)
            --last;
        if (last <= growth_levels)
            return -1;
        for (std::size_t k = last - growth_levels; k < last; ++k)
            if (!(growth(k - 1, k) >= settings_.full_dimension))
                return -1;
        return static_cast<int>(last - 1 - growth_levels);
    }

    // --- what the picture is worth
    // -----------------------------------------------------------------

    void judge() {
        for (std::int32_t k = 0; k < tree().size(); ++k)
            count(k).boundary += differs_on_level(k);
        picture_.dimension = boundary_dimension(picture_.counts);
        audit();
    }
    bool differ(std::int32_t a, std::int32_t b) {
        return tree()[a].label.label != tree()[b].label.label;
    }
    bool differs_on_level(std::int32_t k) {
        const Leaf& s = tree()[k];
        const std::int32_t last = tree().side(s.level) - 1;
        for (std::int32_t i = std::max(s.i - 1, 0); i <= std::min(s.i + 1, last); ++i)
            for (std::int32_t j = std::max(s.j - 1, 0); j <= std::min(s.j + 1, last); ++j)
                if (differ(k, tree().find(s.level, i, j)))
                    return true;
        return false;
    }
    bool is_inner(std::int32_t k) {
        bool differs = false;
        tree().visit_touching(k, [&](std::int32_t b) { differs = differs || differ(k, b); });
        return !differs;
    }
    /// Leaves are of area 4^(levels - level), and chosen with probability proportional to it.
    void audit() {
        std::vector<std::int32_t> inner;
        std::vector<std::int64_t> up_to;
        std::int64_t area = 0;
        for (std::int32_t k = 0; k < tree().size(); ++k)
            if (tree().is_leaf(k) && is_inner(k)) {
                inner.push_back(k);
                up_to.push_back(area += std::int64_t(1) << 2 * (tree().levels() - tree()[k].level));
            }
        const double side = tree().side(tree().levels());
        picture_.audit.share = double(area) / (side * side);
        if (inner.empty() || settings_.audit == 0)
            return;
        std::mt19937_64 random(settings_.seed);
        std::vector<std::array<double, 2>> points;
        std::vector<std::int32_t> expected;
        for (int m = 0; m < settings_.audit; ++m) {
            const auto at = static_cast<std::int64_t>(uniform(random) * double(area));
            const auto k = std::upper_bound(up_to.begin(), up_to.end(), at) - up_to.begin();
            const Leaf& leaf = tree()[inner[static_cast<std::size_t>(k)]];
            const double u = uniform(random), v = uniform(random);
            points.push_back(picture_.point(leaf, u, v));
            expected.push_back(leaf.label.label);
        }
        std::vector<CellLabel> labels;
        if (!ask(points, labels))
            return;
        Audit& a = picture_.audit;
        a.points = settings_.audit;
        for (std::size_t m = 0; m < expected.size(); ++m)
            a.wrong += labels[m].label != expected[m];
        a.bound = clopper_pearson_upper(a.wrong, a.points);
    }

    Labeller& labeller_;
    const RefineSettings settings_;
    Refined picture_;
    std::vector<bool> is_marked_;
    std::vector<std::int32_t> marked_;
};

} // namespace detail

/// Labels a rectangle with few trajectories: coarse squares by their centres, and again the
/// quarters of each square that touches one of another label, until those are of the finest level.
/// A square that gets a new label also splits its older, coarser neighbours, so a thin tongue that
/// is seen once is followed along its length; one that no centre meets is missed, and the audit
/// tells how much area that can be. Squares side by side are at most one level apart.
///
/// The result depends on the labels alone: each round is one batch, in a fixed order.
///
/// @param labeller  called as labeller(std::span<const std::array<double, 2>> points,
///                  std::span<CellLabel> labels); a label depends on its own point alone. If it
///                  returns a bool, false means that it was interrupted: labels that it did not
///                  write are unresolved, and the picture ends there
/// @error           std::invalid_argument for a box or settings that make no sense; what the
///                  labeller throws
/// @cost            for a boundary of length B, in sides of the rectangle, about B * 2^levels *
///                  coarse times twelve labels; memory 24 bytes a square and 24 a point of a round
template <class Labeller>
Refined refine(Labeller&& labeller, const Rectangle& box, const RefineSettings& settings = {}) {
    detail::require_callable("labeller", labeller);
    detail::validate(box);
    detail::validate(settings);
    return detail::Refinement<std::remove_reference_t<Labeller>>(labeller, box, settings).run();
}

} // namespace filippov
