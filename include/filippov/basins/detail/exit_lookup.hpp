// SPDX-License-Identifier: BSD-3-Clause
// Labels of the cells of a picture looked up by their next exit from stick to slip.
#pragma once

#include <filippov/basins/labels.hpp>
#include <filippov/basins/quotient.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filippov {

namespace detail {

/// Both exit curves of a transition map, as cubics in the phase.
class ExitCurves {
public:
    explicit ExitCurves(const TransitionMap& map) {
        for (const int boundary : {-1, 1})
            for (int k = 0; k < n; ++k) {
                const auto e = map.exit_point({boundary, k * width});
                Node& node = nodes_[circle(boundary)][std::size_t(k)];
                if (e)
                    size_ = std::max(size_, e->x.lpNorm<1>());
                for (int i = 0; e && i < 2; ++i) {
                    node.x[std::size_t(i)] = e->x[i];
                    node.slope[std::size_t(i)] = e->rate[i] * map.period() / n;
                }
            }
    }
    /// Whether a slide ended where the map has the end of slides at this phase. It may have ended
    /// on another branch of the curve, of which the map knows nothing.
    bool hold(const Transition& at, std::span<const double> x) const {
        const auto& nodes = nodes_[circle(at.boundary)];
        const auto k = std::min(std::size_t(at.phase / width), std::size_t(n - 1));
        const Node &a = nodes[k], &b = nodes[(k + 1) % n];
        const double u = at.phase / width - double(k), v = 1 - u;
        double apart = 0;
        for (std::size_t i = 0; i < 2; ++i) {
            const double rise = b.x[i] - a.x[i];
            const double on =
                a.x[i] + v * v * u * a.slope[i] + u * u * ((1 + 2 * v) * rise - v * b.slope[i]);
            apart += std::abs(x[i] - on);
        }
        return apart <= 1e-6 * size_;
    }

private:
    static constexpr int n = 256;
    static constexpr double width = TransitionMap::turn / n;
    static constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    struct Node {
        std::array<double, 2> x{nan, nan}, slope{nan, nan}; ///< by u = phase / width
    };
    std::array<std::array<Node, std::size_t(n)>, 2> nodes_;
    double size_ = 0; ///< of the points, at most
};

/// The quotient of a picture, if it is to be used and applies.
class ExitLookup {
public:
    bool usable = false;
    std::string reason; ///< why, or why not
    ExitBasins basins;  ///< if it was built
    /// A state of each of its attractors when the strobe flashes; NaN if a run to there fails.
    std::vector<Vector> flashed;
    Status state = Status::ok;

    ExitLookup(const StrobePicture& picture, UseQuotient use) {
        const TransitionSettings& settings = picture.settings.transition;
        if (use == UseQuotient::never)
            reason = "It was not asked for.";
        else if (picture.settings.times)
            reason = "It does not know times, which are asked for.";
        else if (const auto can = quotient_applies(picture.system, picture.p, settings); !can)
            reason = can.reason;
        else
            build(picture);
        if (picture.stopped(state))
            usable = false;
        else if (use == UseQuotient::always && !usable)
            throw std::invalid_argument("filippov: quotient = always: " + reason);
    }
    /// The attractor, from 1, of a trajectory that has left a slide; 0: not known.
    int attractor_at(const OutcomeView& o) const {
        // nearer to an end than a run is exact
        constexpr double too_near = 1e-6;
        const double turns = o.clock.local / o.clock.period;
        const Transition at{o.mode, TransitionMap::wrapped(turns * TransitionMap::turn)};
        if (!((o.mode == -1 || o.mode == 1) && curves_->hold(at, o.x)))
            return 0;
        const ExitLabel label = basins.at(at);
        return label.distance > too_near ? label.attractor : 0;
    }

private:
    void build(const StrobePicture& picture) {
        const TransitionMap map(picture.system, picture.p, picture.settings.transition);
        basins = exit_basins(map, picture.settings.exits);
        if (basins.status == Status::interrupted)
            state = Status::interrupted;
        // `ambiguous`: some phases are not resolved, which then are followed
        usable = basins.status == Status::ok || basins.status == Status::ambiguous;
        reason = basins.message;
        curves_.emplace(map);
        for (const MapAttractor& a : basins.attractors)
            flashed.push_back(at_flash(picture, map, a));
    }
    static Vector at_flash(const StrobePicture& picture, const TransitionMap& map,
                           const MapAttractor& a) {
        const Vector none = Vector::Constant(2, std::numeric_limits<double>::quiet_NaN());
        const Transition at = a.periodic ? a.orbit.points.front() : some_phase(a);
        const auto exit = map.exit_point(at);
        if (!exit)
            return none;
        const double t0 = picture.settings.t0, t = map.time_of(at.phase), T = map.period();
        const Leg leg{.t0 = t,
                      .x = exit->x,
                      .t_end = t0 + T * (std::floor((t - t0) / T) + 1),
                      .boundary = at.boundary};
        const Journey journey = picture.system.journey(leg, picture.p, {});
        return journey.status == Status::ok ? Vector(journey.end.value.head(2)) : none;
    }
    static Transition some_phase(const MapAttractor& a) {
        for (const int boundary : {-1, 1}) {
            const auto& cells = a.cells[circle(boundary)];
            const auto visited = std::find(cells.begin(), cells.end(), true);
            if (visited != cells.end())
                return {boundary, TransitionMap::turn * (double(visited - cells.begin()) + 0.5) /
                                      double(cells.size())};
        }
        return {};
    }
    std::optional<ExitCurves> curves_;
};

} // namespace detail

} // namespace filippov
