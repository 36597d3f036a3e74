// SPDX-License-Identifier: BSD-3-Clause
// All that the orbits of a system do in a rectangle of two parameters, from nothing but the model.
#pragma once

#include <filippov/continuation/branch.hpp>
#include <filippov/continuation/curve.hpp>
#include <filippov/orbits/orbit.hpp>

#include <functional>

namespace filippov {

/// How a rectangle is searched.
struct BoxSearch {
    int lines = 3;  ///< branches over the first parameter are followed at so many values of the
                    ///< second
    int starts = 3; ///< on each line orbits are looked for at so many values of the first
    OrbitSearch orbit{.max_turns = 1};
    Vector x0{}; ///< where the runs that look for orbits start; empty: the origin
    BranchSettings steps{};
    int max_curves = 64;
    /// May be empty. Called with the starts and curves that are done, and those known so far.
    std::function<void(std::size_t done, std::size_t total)> progress{};
};

/// Branches, and the curves through the bifurcations on them and at their points of codimension
/// two.
struct BifurcationSet {
    std::vector<Branch> branches;
    std::vector<Curve> curves;
    long long corrections = 0; ///< Newton iterations, each one flow with derivatives
    int failed_starts = 0;     ///< where no orbit was found
};

namespace detail {

class BoxExplorer {
public:
    BoxExplorer(const AnySystem& system, const Vector& p, const Box& box, const BoxSearch& search)
        : system_(system), p_(p), box_(box), search_(search),
          x0_(search.x0.size() > 0 ? search.x0 : Vector(Vector::Zero(system.dim()))) {
        require_point(system, 0, x0_, p, "x0");
        require_box(system, box);
        validate(search.steps);
        require_positive("lines", search.lines);
        require_positive("starts", search.starts);
        require_positive("max_curves", search.max_curves);
    }

    BifurcationSet explore() {
        for (int k = 0; k < search_.lines && !system_.interrupted(); ++k)
            follow_line(box_.low[1] + box_.width(1) * (k + 0.5) / search_.lines);
        // curves found on the way add to the queue
        for (std::size_t i = 0; i < queue_.size(); ++i) {
            if (std::ssize(set_.curves) < search_.max_curves && !system_.interrupted())
                follow_curve(CurveStart(queue_[i])); // the queue may grow
            tell(std::size_t(n_starts_) + i + 1);
        }
        return std::move(set_);
    }

private:
    void tell(std::size_t done) const {
        if (search_.progress)
            search_.progress(done, std::size_t(n_starts_) + queue_.size());
    }
    void follow_line(double value) {
        const std::size_t first = set_.branches.size();
        for (int j = 0; j < search_.starts && !system_.interrupted(); ++j) {
            Vector p = p_;
            p[box_.parameters[0]] = box_.low[0] + box_.width(0) * (j + 0.5) / search_.starts;
            p[box_.parameters[1]] = value;
            tell(done_++);
            const Orbit orbit = settle(system_, p, x0_, search_.orbit);
            if (orbit.status != Status::ok) {
                ++set_.failed_starts;
                continue;
            }
            if (on_branches(orbit.cycle, first))
                continue;
            BranchTracer tracer(system_, box_.parameters[0], box_.low[0], box_.high[0],
                                search_.steps);
            set_.branches.push_back(tracer.trace(orbit.cycle));
            set_.corrections += set_.branches.back().corrections;
            for (const SpecialPoint& s : set_.branches.back().special)
                if (s.kind != Kind::neimark_sacker && s.convergence.ok())
                    queue_.push_back(curve_start(s));
        }
    }
    /// True if a branch found before passes through this orbit.
    bool on_branches(const Cycle& c, std::size_t first) const {
        for (std::size_t b = first; b < set_.branches.size(); ++b)
            if (passes(set_.branches[b].points, c, 1))
                return true;
        return false;
    }

    void follow_curve(const CurveStart& start) {
        for (const Curve& curve : set_.curves)
            if (curve.kind == start.kind && passes(curve.points, start.orbit(), 2))
                return;
        CurveTracer tracer(system_, box_, search_.steps);
        set_.curves.push_back(tracer.trace(start));
        set_.corrections += set_.curves.back().corrections;
        for (const auto& point : tracer.degenerate())
            for (const CurveStart& next : curves_at_degenerate(point))
                if (next.kind != start.kind)
                    queue_.push_back(next);
    }

    /// True if a polyline of orbits passes through one: within a fraction of a step in the
    /// parameters, with all its nodes near.
    bool passes(const std::vector<BranchPoint>& points, const Cycle& c,
                std::size_t n_parameters) const {
        for (std::size_t i = 1; i < points.size(); ++i) {
            const Cycle &a = points[i - 1].cycle, &b = points[i].cycle;
            double along = 0, length = 0;
            std::array<double, 2> d{}, e{};
            for (std::size_t k = 0; k < n_parameters; ++k) {
                const int index = box_.parameters[k];
                d[k] = (b.p[index] - a.p[index]) / box_.width(k);
                e[k] = (c.p[index] - a.p[index]) / box_.width(k);
                along += d[k] * e[k];
                length += d[k] * d[k];
            }
            const double u = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0.0;
            double away = 0;
            for (std::size_t k = 0; k < n_parameters; ++k)
                away += (e[k] - u * d[k]) * (e[k] - u * d[k]);
            if (away < 9e-6 && near(a, b, u, c))
                return true;
        }
        return false;
    }
    /// The nodes of c lie near those of the cycle between a and b; where words differ (a node of a
    /// segment without length), near some.
    bool near(const Cycle& a, const Cycle& b, double u, const Cycle& c) const {
        const Vector size = Shooting(system_, c).scales(c).head(system_.dim());
        const auto apart = [&](const Vector& d) { return d.cwiseQuotient(size).norm(); };
        for (std::size_t i = 0; i < c.size(); ++i) {
            double best = std::numeric_limits<double>::infinity();
            for (std::size_t j = 0; j < a.size() && j < b.size(); ++j)
                best = std::min({best, apart(c.x[i] - a.x[j] - u * (b.x[j] - a.x[j])),
                                 apart(c.x[i] - a.x[j]), apart(c.x[i] - b.x[j])});
            if (!(best < 0.05))
                return false;
        }
        return true;
    }

    const AnySystem& system_;
    const Vector p_;
    const Box box_;
    const BoxSearch search_;
    const Vector x0_;
    const long long n_starts_ = static_cast<long long>(search_.lines) * search_.starts;
    std::size_t done_ = 0;
    BifurcationSet set_;
    std::vector<CurveStart> queue_;
};

} // namespace detail

/// The bifurcations of the periodic orbits of a system in a rectangle of parameters.
///
/// Orbits are what solutions from the origin settle on at a few points of the rectangle; their
/// branches over the first parameter give bifurcations, these their curves in both parameters, and
/// the points of codimension two further curves. What none of these orbits is connected with is not
/// found.
inline BifurcationSet bifurcation_set(const AnySystem& system, const Vector& p, const Box& box,
                                      const BoxSearch& search = {}) {
    return detail::BoxExplorer(system, p, box, search).explore();
}

} // namespace filippov
