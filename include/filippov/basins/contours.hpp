// SPDX-License-Identifier: BSD-3-Clause
// Boundaries between labels of a picture as polylines. Where labels come from is not known here.
#pragma once

#include <filippov/basins/cells.hpp>
#include <filippov/basins/detail/brackets.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace filippov {

/// How contours are traced. Lengths are in pictures.
struct ContourSettings {
    double width = 1e-12;   ///< of the bracket around a point of a contour, 1e-15 <= width < 1
    double distance = 1e-3; ///< between polyline and boundary, width < distance < 1
    long long max_labels = 100'000'000; ///< points that the labeller is asked for, > 0
};

/// A polyline along a boundary, with one label on its left.
struct Contour {
    std::int32_t left = 0;  ///< the smaller label
    std::int32_t right = 0; ///< on the other side; within a cell there may be a third one
    bool closed = false;    ///< the last point is joined to the first
    std::vector<Bracket> points{};
    /// The largest distance of the boundary from a chord before the last split, measured at 3/7 of
    /// it: an estimate of the polyline's from above, but no bound for what is thinner than a chord.
    double distance = 0;
    int coarse = 0; ///< times that no boundary was found across a chord: there it is not as close
};

/// All contours of a picture.
struct Contours {
    std::vector<Contour> curves;
    int unresolved = 0; ///< points of the grid without a label: curves end beside them
    LabelWork work{};
};

namespace detail {

inline double distance_to_chord(const PicturePoint& at, const PicturePoint& a,
                                const PicturePoint& b) {
    const PicturePoint chord = b - a, from = at - a;
    const double size = chord.squaredNorm();
    const double along = size > 0 ? std::clamp(from.dot(chord) / size, 0.0, 1.0) : 0;
    return (from - along * chord).norm();
}
/// Leaves out points that chords between those that stay pass by within a distance.
inline void thin_out(std::vector<Bracket>& points, double distance) {
    constexpr double longest = 0.02; // of such chords: corners are told by several on either side
    std::vector<Bracket> kept;
    std::size_t last = 0;
    const auto at = [&](std::size_t k) { return points[k].middle(); };
    for (std::size_t k = 0; k < points.size(); ++k) {
        bool needed =
            k == 0 || k + 1 == points.size() || !((at(k + 1) - at(last)).norm() < longest);
        for (std::size_t j = last + 1; j <= k && !needed; ++j)
            needed = !(distance_to_chord(at(j), at(last), at(k + 1)) <= distance);
        if (needed) {
            kept.push_back(points[k]);
            last = k;
        }
    }
    points = std::move(kept);
}

/// Finds where edges between neighbours of a grid are crossed, and joins the crossings.
///
/// Squares of four neighbours are cut in two triangles. A triangle with two labels is crossed on
/// two edges, which are joined: nothing is ambiguous. In one with three labels three curves end.
class GridContours {
public:
    GridContours(Bisection& bisection, int rows, int columns, Contours& result)
        : bisection_(bisection), rows_(rows), columns_(columns), result_(result) {}

    void run(std::span<const std::int32_t> known, double distance) {
        label(known);
        result_.unresolved = int(std::count(label_.begin(), label_.end(), 0));
        // A fine grid is crossed more often than the curve has to be known: what is left of the
        // crossings is narrowed on.
        const double enough = distance / 16;
        cross_edges(enough);
        join_squares();
        chain_all(2 * enough);
        for (Contour& curve : result_.curves) {
            thin_out(curve.points, distance / 4);
            bisection_.narrow(curve.points,
                              std::vector<std::int32_t>(curve.points.size(), curve.left));
        }
    }

private:
    static constexpr std::array<std::array<int, 2>, 3> steps{{{1, 0}, {0, 1}, {1, 1}}};
    static constexpr std::int32_t none = -1;

    /// A crossing of an edge.
    struct Node {
        std::int32_t left, right; ///< labels
        std::int32_t next = none, previous = none;
    };

    std::int32_t cells() const { return rows_ * columns_; }
    PicturePoint centre(std::int32_t c) const {
        return {(c / columns_ + 0.5) / rows_, (c % columns_ + 0.5) / columns_};
    }
    std::int32_t label_of(std::int32_t c) const { return label_[std::size_t(c)]; }
    Node& node(std::int32_t k) { return nodes_[std::size_t(k)]; }
    /// The other end of an edge that begins at a point.
    std::int32_t end_of(std::int32_t c, std::size_t step) const {
        const int i = c / columns_ + steps[step][0], j = c % columns_ + steps[step][1];
        return i < rows_ && j < columns_ ? i * columns_ + j : none;
    }
    /// Calls visit(from, to, edge) for edges whose ends have different labels.
    template <class Visit> void visit_crossed(Visit&& visit) const {
        for (std::int32_t c = 0; c < cells(); ++c)
            for (std::size_t s = 0; s < steps.size(); ++s)
                if (const std::int32_t e = end_of(c, s);
                    e != none && label_of(c) != label_of(e) && label_of(c) != 0 && label_of(e) != 0)
                    visit(c, e, steps.size() * std::size_t(c) + s);
    }

    /// Labels that are known elsewhere may be wrong beside a boundary: those are asked for, and
    /// again those beside the boundaries that this makes.
    void label(std::span<const std::int32_t> known) {
        label_.assign(known.begin(), known.end());
        label_.resize(std::size_t(cells()), 0);
        std::vector<bool> asked(label_.size(), false);
        for (std::int32_t round = 0; round < cells(); ++round) {
            std::vector<std::int32_t> doubtful;
            const auto doubt = [&](std::int32_t c) {
                if (!asked[std::size_t(c)])
                    doubtful.push_back(c);
                asked[std::size_t(c)] = true;
            };
            if (known.empty())
                for (std::int32_t c = 0; c < cells(); ++c)
                    doubt(c);
            else
                visit_crossed([&](std::int32_t c, std::int32_t e, std::size_t) {
                    doubt(c);
                    doubt(e);
                });
            std::vector<PicturePoint> points;
            for (const std::int32_t c : doubtful)
                points.push_back(centre(c));
            std::vector<std::int32_t> labels;
            if (doubtful.empty() || !bisection_.ask(points, labels))
                return;
            for (std::size_t k = 0; k < doubtful.size(); ++k)
                label_[std::size_t(doubtful[k])] = labels[k];
        }
    }
    void cross_edges(double enough) {
        std::vector<std::int32_t> left;
        crossing_.assign(steps.size() * label_.size(), none);
        visit_crossed([&](std::int32_t from, std::int32_t to, std::size_t edge) {
            if (label_of(to) < label_of(from))
                std::swap(from, to);
            crossing_[edge] = std::int32_t(nodes_.size());
            nodes_.push_back({label_of(from), label_of(to)});
            brackets_.push_back({centre(from), centre(to)});
            left.push_back(label_of(from));
        });
        bisection_.narrow(brackets_, left, enough);
    }
    void join_squares() {
        for (int i = 0; i + 1 < rows_; ++i)
            for (int j = 0; j + 1 < columns_; ++j) {
                const std::int32_t a = i * columns_ + j, b = a + columns_, c = b + 1, d = a + 1;
                join({a, b, c});
                join({a, c, d});
            }
    }
    std::int32_t crossing(std::int32_t a, std::int32_t b) const {
        const std::int32_t c = std::min(a, b), by = std::max(a, b) - c;
        const std::size_t step = by == columns_ ? 0 : by == 1 ? 1 : 2;
        return crossing_[steps.size() * std::size_t(c) + step];
    }
    /// @param corners  of a triangle, counterclockwise
    void join(const std::array<std::int32_t, 3>& corners) {
        std::array<std::int32_t, 3> on{}; // the edge from corner k to the next
        for (std::size_t k = 0; k < 3; ++k)
            on[k] = crossing(corners[k], corners[(k + 1) % 3]);
        if (std::count(on.begin(), on.end(), none) != 1)
            return;
        // The corner between the crossed edges is the one that differs. A curve goes round it
        // counterclockwise if it is on the left.
        std::size_t alone = 0;
        while (on[alone] == none || on[(alone + 2) % 3] == none)
            ++alone;
        std::int32_t from = on[alone], to = on[(alone + 2) % 3];
        if (label_of(corners[alone]) != node(from).left)
            std::swap(from, to);
        node(from).next = to;
        node(to).previous = from;
    }
    /// Open curves first, each from its beginning. Of crossings that nearly coincide, where a
    /// boundary passes close by a point of the grid, one is kept: between them is no direction.
    void chain_all(double least) {
        std::vector<bool> used(nodes_.size(), false);
        for (const bool open : {true, false})
            for (std::size_t k = 0; k < nodes_.size(); ++k)
                if (!used[k] && (!open || nodes_[k].previous == none))
                    chain(std::int32_t(k), !open, least, used);
    }
    void chain(std::int32_t first, bool closed, double least, std::vector<bool>& used) {
        Contour curve{.left = node(first).left, .right = node(first).right, .closed = closed};
        for (std::int32_t k = first; k != none && !used[std::size_t(k)]; k = node(k).next) {
            used[std::size_t(k)] = true;
            const Bracket& b = brackets_[std::size_t(k)];
            if (curve.points.empty() || (b.middle() - curve.points.back().middle()).norm() > least)
                curve.points.push_back(b);
        }
        const auto ends_meet = [&] {
            return (curve.points.front().middle() - curve.points.back().middle()).norm() <= least;
        };
        if (closed && curve.points.size() > 1 && ends_meet())
            curve.points.pop_back();
        result_.curves.push_back(std::move(curve));
    }

    Bisection& bisection_;
    const int rows_, columns_;
    Contours& result_;
    std::vector<std::int32_t> label_, crossing_;
    std::vector<Node> nodes_;
    std::vector<Bracket> brackets_; ///< of the nodes
};

/// Marks of chords: that from point k of curve c to the next.
using ChordMarks = std::vector<std::vector<bool>>;

/// Makes chords finer until the boundary is near to them.
class ChordSplitter {
public:
    ChordSplitter(Bisection& bisection, Contours& contours)
        : bisection_(bisection), curves_(contours.curves) {}

    /// @param open  chords that may be split
    void run(ChordMarks open, double distance) {
        constexpr int rounds = 48;
        for (int round = 0; round < rounds && split(open, distance); ++round) {
        }
    }

private:
    /// False if there is no chord left to split.
    bool split(ChordMarks& open, double distance) {
        std::vector<Probe> probes;
        for (std::size_t c = 0; c < curves_.size(); ++c)
            for (std::size_t k = 0; k < open[c].size(); ++k)
                if (open[c][k])
                    open[c][k] = probe(curves_[c], k, distance, probes);
        bisection_.find(probes);
        if (probes.empty() || !bisection_.ok())
            return false;
        std::span<const Probe> rest(probes);
        for (std::size_t c = 0; c < curves_.size(); ++c)
            rest = insert(curves_[c], open[c], rest, distance);
        return true;
    }
    static bool probe(const Contour& curve, std::size_t k, double distance,
                      std::vector<Probe>& probes) {
        const std::size_t next = (k + 1) % curve.points.size();
        const PicturePoint a = curve.points[k].middle(), chord = curve.points[next].middle() - a;
        if (!(chord.norm() > distance))
            return false;
        // Not at the middle, where an S crosses its chord.
        probes.push_back({.at = a + 3.0 / 7 * chord,
                          .normal = left_of(chord),
                          .reach = chord.norm() / 64,
                          .most = chord.norm(),
                          .left = curve.left});
        return true;
    }
    /// @return the probes of the curves that follow
    static std::span<const Probe> insert(Contour& curve, std::vector<bool>& open,
                                         std::span<const Probe> probes, double distance) {
        std::vector<Bracket> points;
        std::vector<bool> still;
        for (std::size_t k = 0; k < curve.points.size(); ++k) {
            points.push_back(curve.points[k]);
            still.push_back(false);
            if (!open[k])
                continue;
            const Probe& p = probes.front();
            probes = probes.subspan(1);
            if (!p.found) {
                ++curve.coarse;
                continue;
            }
            const double off = (p.bracket.middle() - p.at).norm();
            const bool again = off > distance;
            if (!again)
                curve.distance = std::max(curve.distance, off);
            still.back() = again;
            points.push_back(p.bracket);
            still.push_back(again);
        }
        curve.points = std::move(points);
        open = std::move(still);
        return probes;
    }

    Bisection& bisection_;
    std::vector<Contour>& curves_;
};

/// One mark a point; an open curve has no chord from its last.
inline ChordMarks chords_of(const Contours& contours, bool mark) {
    ChordMarks marks;
    for (const Contour& curve : contours.curves) {
        marks.emplace_back(curve.points.size(), mark);
        if (!curve.closed)
            marks.back().back() = false;
    }
    return marks;
}

inline void validate(const ContourSettings& s) {
    if (!(s.width >= 1e-15 && s.width < 1))
        refuse("width", s.width, "expected 1e-15 <= width < 1");
    if (!(s.distance > s.width && s.distance < 1))
        refuse("distance", s.distance, "expected width < distance < 1");
    require_positive("max_labels", s.max_labels);
}

} // namespace detail

/// Traces the boundaries between labels.
///
/// The centres of rows x columns cells are labelled. Edges between neighbours of different labels
/// are halved, all at once, until the two sides are `width` apart, and the crossings are joined.
/// Then chords are split, by halving across them, until the boundary is within `distance` of them.
/// What is thinner than a cell is missed where no centre meets it. Curves reach from centre to
/// centre; they end half a cell inside the picture, less than a cell from where three labels meet,
/// and beside centres without a label.
///
/// The result depends on the labels alone: each round is one batch, in a fixed order.
///
/// @param known  labels of all centres, row by row, to save asking; those beside a boundary are
///               asked for again. Empty: all are asked for
/// @error        std::invalid_argument for settings that make no sense or labels of another grid
/// @cost         one label a centre, and about 35 a point of a curve
inline Contours trace_contours(const PointLabeller& labeller, int rows, int columns,
                               const ContourSettings& settings = {},
                               std::span<const std::int32_t> known = {}) {
    detail::require_callable("labeller", labeller);
    detail::validate(settings);
    const CellGrid grid({0, 0, 1, rows}, {1, 0, 1, columns}); // refuses numbers that make no sense
    if (!known.empty() && known.size() != std::size_t(grid.cells()))
        detail::refuse("known.size()", known.size(), "expected one label a cell, or none");
    Contours result;
    detail::Bisection bisection(labeller, settings.width, settings.max_labels, result.work);
    detail::GridContours(bisection, rows, columns, result).run(known, settings.distance);
    detail::ChordSplitter(bisection, result)
        .run(detail::chords_of(result, true), settings.distance);
    return result;
}

} // namespace filippov
