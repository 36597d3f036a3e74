// SPDX-License-Identifier: BSD-3-Clause
// Curves of bifurcations in two parameters, and the points of codimension two on them.
#pragma once

#include <filippov/continuation/detail/double_bifurcations.hpp>
#include <filippov/orbits/orbit.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Follows a bifurcation in two parameters.
class CurveTracer {
public:
    CurveTracer(const AnySystem& system, const Box& box, const BranchSettings& settings = {})
        : plane_{system, box}, settings_(settings) {
        detail::require_box(system, box);
        detail::validate(settings);
    }

    /// Where curves met degenerate switching-sliding points: the other curves start from there.
    const std::vector<DegeneratePoint>& degenerate() const { return degenerate_; }

    /// @error std::invalid_argument unless there is one surface, a switching one without static
    /// friction, and the bifurcation is a sliding one, a grazing, a fold or a flip
    Curve trace(const CurveStart& start) {
        if (!changes_word(start.kind) && start.kind != Kind::fold && start.kind != Kind::flip)
            throw std::invalid_argument("filippov: start.kind: expected a sliding bifurcation, a "
                                        "grazing, a fold or a flip, not " +
                                        std::string(name(start.kind)));
        detail::require_continuable(plane_.system, start.orbit().p);
        detail::HalfCurve forward, backward;
        run(start, +1, forward);
        if (forward.end == BranchEnd::closed)
            backward.end = BranchEnd::closed;
        else if (start.growing < 0 && start.growing_rate == 0)
            run(start, -1, backward);
        else
            backward.end = BranchEnd::codimension_two;
        for (const auto* half : {&forward, &backward})
            degenerate_.insert(degenerate_.end(), half->degenerate.begin(), half->degenerate.end());
        return {detail::joined(backward, forward), start.kind};
    }

private:
    using Place = detail::CurvePlace;
    using StepEnd = detail::StepEnd;

    void run(const CurveStart& start, int direction, detail::HalfCurve& curve) {
        auto here = detail::place_of(plane_, start, direction);
        if (detail::stopped(plane_.system, curve))
            return;
        if (!here) {
            curve.status = Status::not_finite;
            curve.end = BranchEnd::no_start;
            return;
        }
        Matrix J;
        const Convergence first = here->curve->step(here->z, J, here->t, 0);
        curve.corrections += first.iterations;
        if (first.ok())
            here->t = here->curve->tangent(J, here->t);
        curve.points.push_back(detail::point_of(plane_.system, *here, here->z));
        start_ = here->cycle();
        detail::walk(plane_.system, settings_, curve,
                     [&](double& ds) { return advance(*here, ds, curve); });
    }

    /// Where a step leads.
    struct Target {
        Vector z, t;
        double length = 0; ///< of the step, ds but for one to an edge
        bool last = false; ///< it is at an edge
        int iterations = 0;
    };

    /// One step, whatever it meets; false at the end of the curve.
    bool advance(Place& here, double& ds, detail::HalfCurve& curve) {
        BranchEnd trouble = BranchEnd::no_convergence;
        for (; ds >= settings_.min_step; ds /= 2) {
            const StepEnd end = attempt(here, ds, curve, trouble);
            if (end == StepEnd::failed)
                break;
            if (end != StepEnd::retry)
                return end == StepEnd::goes_on;
        }
        if (detail::ends_at_short_segment(plane_, here, curve) ||
            detail::ends_at_crossing(plane_, here, curve))
            return false;
        curve.status = Status::not_converged;
        curve.end = trouble;
        return false;
    }
    StepEnd attempt(Place& here, double& ds, detail::HalfCurve& curve, BranchEnd& trouble) {
        Target to;
        const bool reached = reach(here, ds, to, curve);
        if (plane_.system.interrupted())
            return StepEnd::ended;
        if (!reached || !stay_inside(here, to, curve))
            return StepEnd::retry;
        const double before = detail::second_order_test(here, here.z),
                     after = detail::second_order_test(here, to.z);
        const bool from_degenerate =
            curve.points.size() == 1 && std::abs(before) < 1e-6 * std::abs(after);
        if (from_degenerate && detail::is_beyond_degenerate(here, after)) {
            curve.end = BranchEnd::codimension_two;
            return StepEnd::ended;
        }
        if (!from_degenerate && before * after < 0 &&
            detail::second_order_point(plane_.system, here, to.length, before, after, curve))
            return StepEnd::ended;
        const std::vector<Test> failed = detail::failures(plane_.system, here, to.z, 1e-11);
        if (failed.empty())
            return accept(here, to, ds, curve, trouble);
        const StepEnd end =
            detail::change_word(plane_, here, to.z, to.length, failed, curve, trouble);
        if (end != StepEnd::retry)
            ds = std::min(ds, settings_.first_step);
        return end;
    }
    /// False if there is no point of the curve near the step's end.
    static bool reach(const Place& here, double ds, Target& to, Branch& curve) {
        to.z = here.z;
        Matrix J;
        const Convergence c = here.curve->step(to.z, J, here.t, ds);
        curve.corrections += c.iterations;
        to.iterations = c.iterations;
        if (!c.ok())
            return false;
        to.t = here.curve->tangent(J, here.t);
        to.length = ds;
        return to.t.dot(here.t) > 0.9;
    }
    /// A step that leaves the rectangle becomes one to its edge; false if that was not found.
    bool stay_inside(const Place& here, Target& to, Branch& curve) const {
        for (std::size_t k = 0; k < 2; ++k) {
            const double value = here.parameter(to.z, k), low = plane_.box.low[k],
                         high = plane_.box.high[k];
            if (value >= low && value <= high)
                continue;
            const double bound = value < low ? low : high;
            const auto excess = [&](const Vector& u, const Matrix&) {
                return here.parameter(u, k) - bound;
            };
            const Matrix none;
            const Located at = zero_along(*here.curve, here.z, here.t, to.length, excess,
                                          excess(here.z, none), excess(to.z, none));
            curve.corrections += at.convergence.iterations;
            if (!at.ok())
                return false;
            to.z = at.z;
            to.length = here.t.dot((to.z - here.z).cwiseQuotient(here.curve->scale()));
            to.last = true;
        }
        return true;
    }
    /// The step is one of the same word, and its end the next point.
    StepEnd accept(Place& here, const Target& to, double& ds, Branch& curve,
                   BranchEnd& trouble) const {
        BranchPoint next = detail::point_of(plane_.system, here, to.z);
        if (!(std::abs(next.multipliers[0]) < detail::largest_multiplier)) {
            trouble = BranchEnd::too_unstable;
            return StepEnd::failed;
        }
        if (changes_word(here.kind))
            for (const Kind kind : {Kind::fold, Kind::flip})
                detail::add_smooth_point(plane_.system, here, to.length, kind, next.multipliers,
                                         curve);
        if (passes_start(here, to)) {
            curve.points.push_back(curve.points.front());
            curve.end = BranchEnd::closed;
            return StepEnd::ended;
        }
        curve.points.push_back(std::move(next));
        if (to.last) {
            curve.end = BranchEnd::bound_of_two;
            return StepEnd::ended;
        }
        here.z = to.z;
        here.t = to.t;
        if (!changes_word(here.kind) && !renew(here))
            return StepEnd::failed;
        if (to.iterations <= 3)
            ds = std::min(1.5 * ds, settings_.max_step);
        return StepEnd::goes_on;
    }

    /// True if the step from `here` goes through the start again.
    bool passes_start(const Place& here, const Target& to) const {
        const std::size_t k = std::abs(here.direction()[0]) > std::abs(here.direction()[1]) ? 0 : 1;
        const auto from = [&](const Vector& u, const Matrix&) {
            return here.parameter(u, k) - plane_.value(start_, k);
        };
        const Matrix none;
        const double f0 = from(here.z, none), f1 = from(to.z, none);
        if (!(f0 * f1 < 0))
            return false;
        // only where a straight step comes near in the other parameter, too
        const std::size_t other = 1 - k;
        const double width = plane_.box.width(other);
        const double slope = here.direction()[Eigen::Index(other)] * width;
        const double apart = here.parameter(other) + f0 / (f0 - f1) * to.length * slope -
                             plane_.value(start_, other);
        if (!(std::abs(apart) <= to.length * width))
            return false;
        const Located at = zero_along(*here.curve, here.z, here.t, to.length, from, f0, f1);
        return at.ok() && detail::same_orbit(plane_.system, here.cycle(at.z), start_);
    }
    /// Normalizes the null vector anew where it has turned so far from the one at the start that
    /// its length, measured along that one, dominates the steps.
    bool renew(Place& here) const {
        const auto m = here.shooting->columns(), n = here.shooting->rows();
        const Vector scaled = here.z.tail(n).cwiseQuotient(here.curve->scale().tail(n));
        if (scaled.norm() < 1.5)
            return true;
        CurveStart start;
        start.kind = here.kind;
        start.cycle = here.cycle();
        auto anew = detail::smooth_place(plane_, start, +1);
        if (!anew)
            return false;
        if (anew->t.head(m).dot(here.t.head(m)) < 0)
            anew->t = -anew->t;
        here = std::move(*anew);
        return true;
    }

    detail::CurvePlane plane_;
    BranchSettings settings_;
    Cycle start_; ///< of the curve being followed
    std::vector<DegeneratePoint> degenerate_;
};

namespace detail {

inline bool same_place(const Box& box, const Vector& p, const Vector& q) {
    for (std::size_t k = 0; k < 2; ++k) {
        const Eigen::Index i = box.parameters[k];
        if (!(std::abs(p[i] - q[i]) <= 1e-6 * box.width(k)))
            return false;
    }
    return true;
}

} // namespace detail

/// A curve, the curves that start at its degenerate switching-sliding points, those that start at
/// theirs, and so on: up to `most` of them.
inline std::vector<Curve> trace_connected(const AnySystem& system, const Box& box,
                                          const CurveStart& start,
                                          const BranchSettings& settings = {},
                                          std::size_t most = 16) {
    detail::require_positive("most", static_cast<long long>(most));
    CurveTracer tracer(system, box, settings);
    std::vector<Curve> all{tracer.trace(start)};
    std::vector<Vector> left; // points whose curves have been followed
    for (std::size_t i = 0; i < tracer.degenerate().size(); ++i) {
        const auto point = tracer.degenerate()[i]; // tracing finds more of them
        const auto here = [&](const Vector& p) {
            return detail::same_place(box, p, point.cycle.p);
        };
        if (std::ranges::any_of(left, here))
            continue;
        left.push_back(point.cycle.p);
        const auto arrives = [&](const Curve& curve, Kind kind) {
            return curve.kind == kind &&
                   std::ranges::any_of(curve.special, [&](const SpecialPoint& s) {
                       return s.kind == Kind::degenerate_switching_sliding && here(s.cycle.p);
                   });
        };
        for (const CurveStart& next : curves_at_degenerate(point))
            if (all.size() < most && std::ranges::none_of(all, [&](const Curve& curve) {
                    return arrives(curve, next.kind);
                }))
                all.push_back(tracer.trace(next));
    }
    return all;
}

} // namespace filippov
