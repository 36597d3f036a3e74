// SPDX-License-Identifier: BSD-3-Clause
// What the parts of a search for basins of P_trans share: the map, its cubics, and what a phase
// leads to by either.
#pragma once

#include <filippov/basins/detail/cubic_map.hpp>
#include <filippov/basins/detail/exit_basins.hpp>

#include <optional>

namespace filippov::detail {

/// What becomes of a phase.
struct Fate {
    int attractor = 0;
    long long residue = -1;
    int iterates = -1;
    Status status = Status::ok;
    bool operator==(const Fate& o) const { // one basin; iterates do not count
        return attractor == o.attractor && residue == o.residue && status == o.status;
    }
};

inline std::size_t cell_of(double phase, std::size_t cells) {
    return std::min(std::size_t(phase / TransitionMap::turn * double(cells)), cells - 1);
}
/// Whether all is known of a phase that is met after k iterates, in this forcing period.
inline bool land(const Transition& at, long long period, int k, const ExitBasins& basins, Fate& f) {
    for (std::size_t i = 0; i < basins.attractors.size(); ++i) {
        const MapAttractor& a = basins.attractors[i];
        const auto& cells = a.cells[circle(at.boundary)];
        if (!cells.empty() && cells[cell_of(at.phase, cells.size())]) {
            f = {int(i) + 1, 0, k, Status::ok};
            return true;
        }
        for (std::size_t j = 0; j < a.orbit.points.size(); ++j) {
            const Transition& c = a.orbit.points[j];
            const double apart = std::abs(at.phase - c.phase);
            const bool near = std::min(apart, TransitionMap::turn - apart) < a.reach[j];
            if (c.boundary != at.boundary || !near)
                continue;
            const double off = around(at.phase - c.phase);
            if (f.attractor == 0) {
                f.attractor = int(i) + 1;
                const long long passed =
                    std::llround((at.phase - off - c.phase) / TransitionMap::turn);
                f.residue = residue_of(period + passed - a.orbit.turns[j], a.orbit.periods);
            }
            if (std::abs(off) < basins.distance)
                f.iterates = k;
            return f.iterates >= 0;
        }
    }
    return false;
}
template <class Step>
Fate fate_of(Transition at, const ExitBasins& basins, int max_iterates, const Step& step) {
    Fate f;
    long long period = 0;
    for (int k = 0; k <= max_iterates; ++k) {
        if (land(at, period, k, basins, f))
            break;
        const MapStep s = step(at);
        if (!s.ok()) {
            if (s.status != Status::interrupted && f.attractor == 0)
                f = {-1, -1, k, s.status};
            break;
        }
        at = s.to;
        period += s.turns;
    }
    return f;
}

/// The map and the cubics through its graph, and what has been found by them.
struct ExitSearch {
    const TransitionMap& map;
    const QuotientSettings settings;
    std::optional<CubicMap> cubics;
    ExitBasins found;
    bool cut_short = false; ///< there are more ends

    static constexpr double turn = TransitionMap::turn;
    static constexpr double last_phase = turn * (1 - 2e-16);
    static constexpr double finest = 1e-13; ///< on the cubics

    ExitSearch(const TransitionMap& of, const QuotientSettings& with) : map(of), settings(with) {
        require(settings);
        found.distance = settings.distance;
    }
    void fail(Status status, std::string why) {
        // the first failure wins, but for an interruption
        if (found.status != Status::ok && status != Status::interrupted)
            return;
        found.status = status;
        found.message = std::move(why);
    }
    MapStep real(const Transition& at) {
        MapStep s;
        s.status = Status::interrupted;
        if (map.interrupted()) {
            fail(Status::interrupted, std::string(message(Status::interrupted)));
        } else if (found.evaluations >= settings.max_evaluations) {
            fail(Status::max_steps, "max_evaluations was used up; ends may be less exact than "
                                    "their uncertainty says.");
        } else {
            ++found.evaluations;
            const Image image = map(at);
            s = {image.status, image.to, image.turns, image.slope};
        }
        return s;
    }
    MapStep cubic(const Transition& at) const { return (*cubics)(at); }
    /// By the cubics.
    Fate fate(const Transition& at) const {
        return fate_of(at, found, settings.max_iterates,
                       [this](const Transition& x) { return cubic(x); });
    }
    /// By the map itself.
    Fate follow(const Transition& at) {
        return fate_of(at, found, settings.max_iterates,
                       [this](const Transition& x) { return real(x); });
    }
    std::size_t cell(double phase) const { return cell_of(phase, std::size_t(settings.cells)); }

    bool interrupted() {
        if (map.interrupted())
            fail(Status::interrupted, std::string(message(Status::interrupted)));
        return found.status == Status::interrupted;
    }

    /// The orbit of the map itself near a phase, of this period.
    std::optional<MapOrbit> newton(Transition at, int period) {
        double last = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 30; ++k) {
            MapOrbit orbit;
            orbit.slope = 1;
            Transition x = at;
            for (int j = 0; j < period; ++j) {
                orbit.points.push_back(x);
                orbit.turns.push_back(orbit.periods);
                const MapStep s = real(x);
                if (!s.ok())
                    return std::nullopt;
                orbit.slope *= s.slope;
                orbit.periods += s.turns;
                x = s.to;
            }
            const double f = around(x.phase - at.phase), dx = -f / (orbit.slope - 1);
            if (x.boundary != at.boundary || !(std::abs(dx) < 0.1))
                return std::nullopt;
            // At the floor of rounding steps no longer shrink.
            if (std::abs(dx) <= 1e-14 || (std::abs(dx) < 1e-10 && std::abs(dx) >= last / 2)) {
                orbit.periods += std::llround((x.phase - f - at.phase) / turn);
                return rotated(orbit);
            }
            last = std::abs(dx);
            at.phase = TransitionMap::wrapped(at.phase + dx);
        }
        return std::nullopt;
    }

private:
    /// The same orbit from its least point.
    static MapOrbit rotated(const MapOrbit& orbit) {
        const auto n = orbit.points.size();
        const auto least =
            std::size_t(std::min_element(orbit.points.begin(), orbit.points.end(), before) -
                        orbit.points.begin());
        MapOrbit r = orbit;
        for (std::size_t j = 0; j < n; ++j) {
            const std::size_t i = (least + j) % n;
            r.points[j] = orbit.points[i];
            r.turns[j] = orbit.turns[i] - orbit.turns[least] + (i < least ? orbit.periods : 0);
        }
        return r;
    }
    static void require(const QuotientSettings& s) {
        if (!(s.distance > 0 && s.distance < std::numbers::pi))
            refuse("distance", s.distance, "expected 0 < distance < pi");
        if (!(s.resolution >= 1e-14 && s.resolution <= 1e-3))
            refuse("resolution", s.resolution, "expected 1e-14 <= resolution <= 1e-3");
        require_positive("starts", s.starts);
        require_positive("settle", s.settle);
        require_positive("max_period", s.max_period);
        require_positive("max_iterates", s.max_iterates);
        require_positive("cells", s.cells);
        require_positive("max_intervals", s.max_intervals);
        require_positive("max_evaluations", s.max_evaluations);
        if (!(s.audits >= 0))
            refuse("audits", s.audits, "expected an integer >= 0");
    }
};

} // namespace filippov::detail
