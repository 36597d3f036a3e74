// SPDX-License-Identifier: BSD-3-Clause
// Orbits of P_trans, and what its trajectories tend to.
#pragma once

#include <filippov/basins/detail/exit_search.hpp>

namespace filippov::detail {

/// Looks for what runs of the cubics tend to.
class ExitAttractors {
public:
    explicit ExitAttractors(ExitSearch& search) : search_(search) {}

    void find(const MapGraph& graph) {
        std::vector<Transition> from;
        for (const MapSample& s : graph.samples)
            if (s.image.ok())
                from.push_back(s.image.to);
        const auto n = std::min(from.size(), std::size_t(search_.settings.starts));
        for (std::size_t k = 0; k < n; ++k) {
            Transition at = from[k * from.size() / n];
            if (search_.fate(at).attractor == 0 && run_on(at, search_.settings.settle))
                add_attractor(at);
            if (search_.interrupted())
                return;
        }
        std::sort(search_.found.attractors.begin(), search_.found.attractors.end(),
                  [](const auto& a, const auto& b) {
                      if (a.periodic != b.periodic)
                          return a.periodic;
                      return a.periodic && before(a.orbit.points[0], b.orbit.points[0]);
                  });
    }

private:
    bool run_on(Transition& at, int iterates) const {
        for (int k = 0; k < iterates; ++k) {
            const MapStep s = search_.cubic(at);
            if (!s.ok())
                return false;
            at = s.to;
        }
        return true;
    }
    void add_attractor(const Transition& at) {
        const auto add_periodic = [&](const Transition& x, int period) {
            const auto orbit = period > 0 ? search_.newton(x, period) : std::nullopt;
            return orbit && orbit->stable() && add(*orbit);
        };
        const auto by_cubics = [this](const Transition& x) { return search_.cubic(x); };
        if (add_periodic(at, repeats(at, by_cubics)))
            return;
        // The cubics are not the map: an orbit that attracts weakly may be lost in their errors.
        if (++long_runs_ > most_long_runs)
            return;
        Transition x = at;
        for (int k = 0; k < search_.settings.settle; ++k) {
            const MapStep s = search_.real(x);
            if (!s.ok())
                return;
            x = s.to;
        }
        if (!add_periodic(x, repeats(x, [this](const Transition& y) { return search_.real(y); })))
            add_visited(x);
    }
    /// After how many iterates a run is back where it was; 0 if it is not.
    template <class Step> int repeats(const Transition& from, const Step& step) const {
        Transition at = from;
        for (int k = 1; k <= search_.settings.max_period; ++k) {
            const MapStep s = step(at);
            if (!s.ok())
                return 0;
            at = s.to;
            if (at.boundary == from.boundary && std::abs(around(at.phase - from.phase)) < 1e-6)
                return k;
        }
        return 0;
    }
    bool add(const MapOrbit& orbit) {
        for (const MapAttractor& other : search_.found.attractors)
            for (std::size_t j = 0; j < other.orbit.points.size(); ++j) {
                const Transition &c = orbit.points[0], &known = other.orbit.points[j];
                if (c.boundary == known.boundary &&
                    std::abs(around(c.phase - known.phase)) < other.reach[j])
                    return true; // a start that took long to come to it
            }
        MapAttractor a;
        a.orbit = orbit;
        for (const Transition& c : orbit.points) {
            a.reach.push_back(reach(c, orbit.period()));
            if (a.reach.back() == 0) {
                search_.fail(Status::not_converged,
                             "An orbit attracts too weakly for the graph: lower its tolerance.");
                return false;
            }
        }
        // What was seen before it was found was the way there.
        std::erase_if(search_.found.attractors, [&](const MapAttractor& other) {
            const Transition& c = orbit.points[0];
            return !other.periodic && other.cells[circle(c.boundary)][search_.cell(c.phase)];
        });
        search_.found.attractors.push_back(a);
        return true;
    }
    /// A distance within which P^period contracts, and stays; 0 if none is well above the graph's
    /// tolerance.
    double reach(const Transition& c, int period) const {
        for (double r = 0.25; r > 100 * search_.settings.graph.tolerance; r /= 2)
            if (contracts(c, period, r))
                return r;
        return 0;
    }
    bool contracts(const Transition& c, int period, double r) const {
        constexpr int n = 16;
        double last = 0;
        long long turns = 0;
        for (int i = -n; i <= n; ++i) {
            Transition at{c.boundary, TransitionMap::wrapped(c.phase + r * i / n)};
            // The start is lifted, too: it may lie beyond 0 or 2 pi.
            long long passed = std::llround((c.phase + r * i / n - at.phase) / turn);
            for (int k = 0; k < period; ++k) {
                const MapStep s = search_.cubic(at);
                if (!s.ok())
                    return false;
                at = s.to;
                passed += s.turns;
            }
            const double off = around(at.phase - c.phase);
            passed += std::llround((at.phase - off - c.phase) / turn);
            const bool inside = std::abs(off) < r - 4 * search_.settings.graph.tolerance;
            if (at.boundary != c.boundary || !inside)
                return false;
            if (i > -n && (passed != turns || !(std::abs(off - last) < r / n)))
                return false;
            last = off;
            turns = passed;
        }
        return true;
    }
    void add_visited(Transition at) {
        MapAttractor a;
        a.periodic = false;
        for (auto& cells : a.cells)
            cells.assign(std::size_t(search_.settings.cells), false);
        for (int k = 0; k < 50 * search_.settings.cells; ++k) {
            Fate known;
            if (land(at, 0, k, search_.found, known) || known.attractor > 0)
                return; // a long way to an attractor is none
            a.cells[circle(at.boundary)][search_.cell(at.phase)] = true;
            const MapStep s = search_.cubic(at);
            if (!s.ok())
                return;
            at = s.to;
        }
        search_.found.attractors.push_back(a);
    }

    static constexpr double turn = TransitionMap::turn;
    static constexpr int most_long_runs = 8;

    ExitSearch& search_;
    int long_runs_ = 0; ///< of the map itself
};

} // namespace filippov::detail
