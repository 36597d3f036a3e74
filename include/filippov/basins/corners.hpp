// SPDX-License-Identifier: BSD-3-Clause
// Corners of boundaries between labels of a picture.
#pragma once

#include <filippov/basins/contours.hpp>
#include <filippov/orbits/dense.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace filippov {

/// A point where a boundary has two tangents.
struct ContourCorner {
    PicturePoint at = PicturePoint::Zero();
    double turn = 0; ///< radians, in the picture, > 0 to the left
    PicturePoint before = PicturePoint::Zero(), after = PicturePoint::Zero(); ///< unit tangents
    double error = std::numeric_limits<double>::infinity(); ///< its last move, in pictures
    int curve = 0;
    std::size_t point = 0; ///< the nearest of the curve
};

namespace detail {

inline double turn_between(const PicturePoint& a, const PicturePoint& b) {
    return std::atan2(cross(a, b), a.dot(b));
}

/// Turns of a polyline.
class PolylineTurns {
public:
    explicit PolylineTurns(const Contour& curve) : curve_(curve) {}

    /// A chord, from point k on, whose ends turn by more than both neighbours' curvature explains.
    struct Suspect {
        std::size_t k;
        double turn; ///< of both ends, radians, >= 0
    };
    std::vector<Suspect> suspects(double least) const {
        std::vector<Suspect> found;
        const std::ptrdiff_t n = points();
        if (n < 4)
            return found;
        const std::ptrdiff_t first = curve_.closed ? 0 : 1, end = curve_.closed ? n : n - 2;
        for (std::ptrdiff_t k = first; k < end; ++k) {
            const double around =
                chord(k - 1).norm() / 2 + chord(k).norm() + chord(k + 1).norm() / 2;
            const double both = turn(k) + turn(k + 1);
            if (!(std::abs(both - smooth(k) * around) < least))
                found.push_back({std::size_t(k), std::abs(both)});
        }
        return found;
    }
    /// A corner makes its neighbours suspect: of suspects in a row the one that turns most.
    std::vector<std::size_t> strongest(double least) const {
        std::vector<std::size_t> found;
        std::size_t last = 0;
        double most = 0;
        for (const Suspect& s : suspects(least)) {
            const bool in_row = !found.empty() && s.k == last + 1;
            last = s.k;
            if (in_row && !(s.turn > most))
                continue;
            if (in_row)
                found.pop_back();
            found.push_back(s.k);
            most = s.turn;
        }
        return found;
    }
    PicturePoint at(std::ptrdiff_t k) const {
        const std::ptrdiff_t n = points();
        return curve_.points[std::size_t((k + n) % n)].middle();
    }
    PicturePoint chord(std::ptrdiff_t k) const { return at(k + 1) - at(k); }

private:
    std::ptrdiff_t points() const { return std::ptrdiff_t(curve_.points.size()); }
    double turn(std::ptrdiff_t k) const { return turn_between(chord(k - 1), chord(k)); }
    double bend(std::ptrdiff_t k) const {
        return 2 * turn(k) / (chord(k - 1).norm() + chord(k).norm());
    }
    /// The neighbours' curvature; at an end of the curve that of the one neighbour there is.
    double smooth(std::ptrdiff_t k) const {
        const bool left = curve_.closed || k > 1, right = curve_.closed || k < points() - 3;
        const double sum = (left ? bend(k - 1) : 0) + (right ? bend(k + 2) : 0);
        return sum / std::max(1, int(left) + int(right));
    }

    const Contour& curve_;
};

/// A cubic on one side of a corner: y(s) across the axis, s away from the corner.
struct SideFit {
    PicturePoint origin, axis, normal;
    Eigen::Vector4d c = Eigen::Vector4d::Zero();

    PicturePoint point(double s) const {
        return origin + s * axis + (c[0] + s * (c[1] + s * (c[2] + s * c[3]))) * normal;
    }
    PicturePoint tangent(double s) const {
        return axis + (c[1] + s * (2 * c[2] + s * 3 * c[3])) * normal;
    }

    /// None if a probe found nothing.
    static std::optional<SideFit> through(std::span<const Probe> probes, const PicturePoint& origin,
                                          const PicturePoint& axis) {
        SideFit side{.origin = origin, .axis = axis, .normal = left_of(axis)};
        const auto n = Eigen::Index(probes.size());
        Matrix A(n, 4);
        Eigen::VectorXd y(n);
        for (Eigen::Index k = 0; k < n; ++k) {
            const Probe& p = probes[std::size_t(k)];
            if (!p.found)
                return std::nullopt;
            const PicturePoint v = p.bracket.middle() - origin;
            const double s = v.dot(axis);
            A.row(k) << 1, s, s * s, s * s * s;
            y[k] = v.dot(side.normal);
        }
        // Columns of very different size: scaled by the farthest station.
        const double far = A(n - 1, 1);
        const Eigen::Vector4d scale(1, far, far * far, far * far * far);
        side.c = dense::least_squares(A * scale.cwiseInverse().asDiagonal(), y);
        side.c = side.c.cwiseQuotient(scale);
        return side;
    }
};

/// Where two fits meet, by Newton; none if not within reach, or not at an angle.
inline std::optional<ContourCorner> meet(const SideFit& before, const SideFit& after, double reach,
                                         double least) {
    Eigen::Vector2d s(0, 0);
    for (int k = 0; k < 20; ++k) {
        Eigen::Matrix2d J;
        J << before.tangent(s[0]), -after.tangent(s[1]);
        if (!(std::abs(J.determinant()) > least))
            return std::nullopt;
        const Eigen::Vector2d step = J.inverse() * (before.point(s[0]) - after.point(s[1]));
        s -= step;
        if (!(s.norm() <= reach))
            return std::nullopt;
        if (step.norm() < 1e-15)
            break;
    }
    ContourCorner corner;
    corner.at = (before.point(s[0]) + after.point(s[1])) / 2;
    corner.before = -before.tangent(s[0]).normalized();
    corner.after = after.tangent(s[1]).normalized();
    corner.turn = turn_between(corner.before, corner.after);
    return corner;
}

/// Locates corners: cubics are fitted to both sides of a suspect, on windows that shrink around
/// where they meet.
class CornerSearch {
public:
    static constexpr double near = 1e-5; ///< of chords to the boundary, for windows to hold it

    CornerSearch(Bisection& bisection, Contours& contours, const ContourSettings& settings,
                 double least)
        : bisection_(bisection), contours_(contours), settings_(settings), least_(least) {}

    std::vector<ContourCorner> run() {
        refine_suspects();
        std::vector<ContourCorner> all;
        for (std::size_t c = 0; c < contours_.curves.size(); ++c)
            for (ContourCorner corner : corners_of(contours_.curves[c])) {
                corner.curve = int(c);
                all.push_back(corner);
            }
        return all;
    }

private:
    static constexpr int windows = 8;                         ///< at most
    static constexpr double widest = 0.008, narrowest = 1e-6; ///< pictures
    static constexpr std::array<double, 6> stations{0.08, 0.2, 0.4, 0.6, 0.8, 1};

    struct Candidate {
        ContourCorner now{}, best{};
        double reach = widest; ///< of the window
        bool fitted = false;   ///< in the window before
        int smooth = 0;        ///< windows in a row that saw a bend without a corner
        bool done = false;     ///< it does not move any more
    };

    /// Windows can only be laid where chords already tell where the boundary is. Of a bend, finer
    /// chords turn less; a corner stays suspect.
    void refine_suspects() {
        constexpr double finer = 0.1;
        double distance = settings_.distance;
        while (distance > near && bisection_.ok()) {
            distance = std::max(finer * distance, near);
            ChordMarks open = chords_of(contours_, false);
            for (std::size_t c = 0; c < open.size(); ++c) {
                const Contour& curve = contours_.curves[c];
                for (const auto& suspect : PolylineTurns(curve).suspects(least_ / 4))
                    open[c][suspect.k] = true;
                if (!curve.closed && curve.points.size() > 1) // those have no neighbours to tell
                    open[c].front() = open[c][curve.points.size() - 2] = true;
            }
            ChordSplitter(bisection_, contours_).run(std::move(open), distance);
        }
    }
    std::vector<ContourCorner> corners_of(const Contour& curve) {
        std::vector<Candidate> candidates;
        const PolylineTurns turns(curve);
        for (const std::size_t suspect : turns.strongest(least_ / 4)) {
            const auto k = std::ptrdiff_t(suspect);
            Candidate c;
            c.now.before = turns.chord(k - 1).normalized();
            c.now.after = turns.chord(k + 1).normalized();
            c.now.at = between(turns.at(k), c.now.before, turns.at(k + 1), c.now.after);
            candidates.push_back(c);
        }
        for (int k = 0; k < windows && bisection_.ok(); ++k)
            fit_all(candidates, curve.left);
        return confirmed(candidates, curve);
    }
    /// Where the chords before and after a chord from a to b meet, if that is near it.
    static PicturePoint between(const PicturePoint& a, const PicturePoint& before,
                                const PicturePoint& b, const PicturePoint& after) {
        const PicturePoint middle = (a + b) / 2;
        const PicturePoint met = a + cross(b - a, after) / cross(before, after) * before;
        return (met - middle).norm() <= (b - a).norm() ? met : middle;
    }

    void fit_all(std::vector<Candidate>& candidates, std::int32_t left) {
        std::vector<Probe> probes;
        for (const Candidate& c : candidates)
            for (const int side : {-1, 1})
                for (const double station : stations) {
                    if (c.done)
                        continue;
                    const double s = station * c.reach;
                    const PicturePoint& tangent = side < 0 ? c.now.before : c.now.after;
                    probes.push_back({.at = c.now.at + side * s * tangent,
                                      .normal = left_of(tangent),
                                      .reach = 0.01 * s,
                                      .most = 0.3 * s,
                                      .left = left});
                }
        bisection_.find(probes);
        if (!bisection_.ok())
            return;
        std::span<const Probe> rest(probes);
        constexpr std::size_t n = stations.size();
        for (Candidate& c : candidates)
            if (!c.done) {
                update(c, rest.first(n), rest.subspan(n, n));
                rest = rest.subspan(2 * n);
            }
        std::erase_if(candidates, [](const Candidate& c) { return c.smooth >= 2; });
    }
    void update(Candidate& c, std::span<const Probe> before, std::span<const Probe> after) const {
        const auto left = SideFit::through(before, c.now.at, -c.now.before),
                   right = SideFit::through(after, c.now.at, c.now.after);
        const bool both = left && right;
        const bool bend =
            both && std::abs(turn_between(-left->tangent(0), right->tangent(0))) < least_ / 4;
        c.smooth = bend ? c.smooth + 1 : 0;
        auto met = both ? meet(*left, *right, c.reach, least_ / 2) : std::nullopt;
        if (met) {
            met->error = (met->at - c.now.at).norm();
            if (c.fitted && met->error < c.best.error)
                c.best = *met;
            c.now = *met;
        }
        c.fitted = met.has_value();
        c.done = c.best.error <= 4 * settings_.width || !(c.reach > narrowest);
        c.reach *= met ? 1.0 / 16 : 0.5;
    }
    /// In their order along the curve, each once.
    std::vector<ContourCorner> confirmed(std::vector<Candidate>& candidates,
                                         const Contour& curve) const {
        std::sort(candidates.begin(), candidates.end(),
                  [](const auto& a, const auto& b) { return a.best.error < b.best.error; });
        std::vector<ContourCorner> found;
        for (const Candidate& c : candidates) {
            const auto same = [&](const ContourCorner& other) {
                return (other.at - c.best.at).norm() < near;
            };
            if (!(c.best.error < near) || !(std::abs(c.best.turn) >= least_) ||
                std::any_of(found.begin(), found.end(), same))
                continue;
            found.push_back(c.best);
            found.back().point = nearest(curve, c.best.at);
        }
        std::sort(found.begin(), found.end(),
                  [](const auto& a, const auto& b) { return a.point < b.point; });
        return found;
    }
    static std::size_t nearest(const Contour& curve, const PicturePoint& at) {
        const auto far = [&](const Bracket& b) { return (b.middle() - at).squaredNorm(); };
        const auto it =
            std::min_element(curve.points.begin(), curve.points.end(),
                             [&](const auto& a, const auto& b) { return far(a) < far(b); });
        return std::size_t(it - curve.points.begin());
    }

    Bisection& bisection_;
    Contours& contours_;
    const ContourSettings& settings_;
    const double least_;
};

} // namespace detail

/// Locates the corners of contours.
///
/// They are looked for where a polyline turns more than its neighbours' curvature explains; chords
/// there are refined first. Cubics through points on either side are met on windows that shrink
/// until nothing moves. Neither a cusp, where both tangents coincide, nor a corner in the first or
/// last chord of an open curve is found.
///
/// @param contours  as `trace_contours` gave them, with the same labeller and settings; chords
///                  beside corners become finer
/// @param least     the least turn of a corner, radians, 0 < least < pi
/// @error           std::invalid_argument for settings that make no sense
/// @cost            about 400 labels a window, of 8 at most, and suspect
inline std::vector<ContourCorner> find_corners(const PointLabeller& labeller, Contours& contours,
                                               const ContourSettings& settings = {},
                                               double least = 0.02) {
    detail::validate(settings);
    if (!(least > 0 && least < std::numbers::pi))
        detail::refuse("turn", least, "expected 0 < turn < pi");
    detail::Bisection bisection(labeller, settings.width, settings.max_labels, contours.work);
    return detail::CornerSearch(bisection, contours, settings, least).run();
}

} // namespace filippov
