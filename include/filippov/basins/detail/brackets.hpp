// SPDX-License-Identifier: BSD-3-Clause
// Points beside a boundary between labels of a picture, brought together by bisection.
#pragma once

#include <filippov/core/status.hpp>
#include <filippov/run/settings.hpp>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// A point or a direction in a picture, which is one wide and one high.
using PicturePoint = Vec<double, 2>;

/// Labels points of a picture: 0 where it cannot tell. False ends the work as `interrupted`.
using PointLabeller =
    std::function<bool(std::span<const PicturePoint> points, std::span<std::int32_t> labels)>;

/// Two points beside a boundary, which lies between them.
struct Bracket {
    PicturePoint left = PicturePoint::Zero();  ///< has the label on the left of the contour
    PicturePoint right = PicturePoint::Zero(); ///< has another label

    PicturePoint middle() const { return (left + right) / 2; }
    double width() const { return (left - right).norm(); }
};

/// What was asked of a labeller.
struct LabelWork {
    long long labels = 0;
    int stuck = 0; ///< brackets that stayed wide because a label inside was unresolved
    Status status = Status::ok;
    std::string message = "All labels were found.";
};

namespace detail {

inline double cross(const PicturePoint& a, const PicturePoint& b) {
    return a.x() * b.y() - a.y() * b.x();
}
inline PicturePoint left_of(const PicturePoint& direction) {
    return PicturePoint(-direction.y(), direction.x()).normalized();
}

/// A place where a boundary is looked for, on either side.
struct Probe {
    PicturePoint at = PicturePoint::Zero(), normal = PicturePoint::Zero(); ///< that points left
    double reach = 0, most = 0; ///< how far is looked at first, and at last
    std::int32_t left = 0;      ///< the label there
    bool found = false;
    Bracket bracket{};
};

/// Asks the labeller, and halves brackets, always many at once.
class Bisection {
public:
    /// @param width  that brackets are to have
    Bisection(const PointLabeller& labeller, double width, long long max_labels, LabelWork& work)
        : labeller_(labeller), width_(width), max_labels_(max_labels), work_(work) {}

    bool ok() const { return work_.status == Status::ok; }

    /// False, and the work ends there, if there are too many points or it was interrupted.
    bool ask(const std::vector<PicturePoint>& points, std::vector<std::int32_t>& labels) {
        labels.assign(points.size(), 0);
        if (!ok())
            return false;
        const auto more = static_cast<long long>(points.size());
        if (more > max_labels_ - work_.labels)
            return end(Status::max_steps, "max_labels would be exceeded; curves are incomplete.");
        work_.labels += more;
        return labeller_(points, labels) ||
               end(Status::interrupted, std::string(message(Status::interrupted)));
    }

    /// @param left   the label of the left sides, one a bracket
    /// @param least  they are narrowed to this width, where it is larger than the usual one
    void narrow(std::vector<Bracket>& brackets, const std::vector<std::int32_t>& left,
                double least = 0) {
        const double width = std::max(width_, least);
        constexpr int halvings = 64; // more than there are bits
        std::vector<bool> stuck(brackets.size(), false);
        for (int k = 0; k < halvings; ++k) {
            std::vector<std::size_t> wide;
            std::vector<PicturePoint> middles;
            for (std::size_t i = 0; i < brackets.size(); ++i)
                if (!stuck[i] && brackets[i].width() > width) {
                    wide.push_back(i);
                    middles.push_back(brackets[i].middle());
                }
            std::vector<std::int32_t> labels;
            if (wide.empty() || !ask(middles, labels))
                return;
            for (std::size_t n = 0; n < wide.size(); ++n) {
                const std::size_t i = wide[n];
                stuck[i] = labels[n] == 0;
                work_.stuck += stuck[i];
                if (!stuck[i])
                    (labels[n] == left[i] ? brackets[i].left : brackets[i].right) = middles[n];
            }
        }
    }

    /// Looks across each probe, farther and farther, for points on both sides, and narrows.
    void find(std::vector<Probe>& probes) {
        constexpr int doublings = 8;
        for (int k = 0; k < doublings && widen(probes); ++k) {
        }
        std::vector<Bracket> brackets;
        std::vector<std::int32_t> left;
        for (const Probe& p : probes)
            if (p.found) {
                brackets.push_back(p.bracket);
                left.push_back(p.left);
            }
        narrow(brackets, left);
        auto next = brackets.begin();
        for (Probe& p : probes)
            if (p.found) {
                p.bracket = *next++;
                p.found = p.bracket.width() <= width_; // else it is stuck
            }
    }

private:
    bool end(Status status, std::string why) {
        work_.status = status;
        work_.message = std::move(why);
        return false;
    }
    bool widen(std::vector<Probe>& probes) {
        std::vector<Probe*> open;
        std::vector<PicturePoint> ends;
        for (Probe& p : probes)
            if (!p.found && p.reach <= p.most) {
                open.push_back(&p);
                ends.push_back(p.at + p.reach * p.normal);
                ends.push_back(p.at - p.reach * p.normal);
            }
        std::vector<std::int32_t> labels;
        if (open.empty() || !ask(ends, labels))
            return false;
        for (std::size_t i = 0; i < open.size(); ++i) {
            Probe& p = *open[i];
            const std::int32_t left = labels[2 * i], right = labels[2 * i + 1];
            p.found = left == p.left && right != p.left && right != 0;
            p.bracket = {ends[2 * i], ends[2 * i + 1]};
            p.reach *= 2;
        }
        return true;
    }

    const PointLabeller& labeller_;
    const double width_;
    const long long max_labels_;
    LabelWork& work_;
};

} // namespace detail

} // namespace filippov
