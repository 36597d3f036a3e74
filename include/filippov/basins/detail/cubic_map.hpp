// SPDX-License-Identifier: BSD-3-Clause
// A transition map made of the cubics through its graph.
#pragma once

#include <filippov/orbits/map_graph.hpp>

#include <algorithm>
#include <array>
#include <vector>

namespace filippov::detail {

/// One application of the map, or of the cubics through its graph.
struct MapStep {
    Status status = Status::ok;
    Transition to;
    long long turns = 0;
    double slope = 0;
    bool ok() const { return status == Status::ok; }
};

/// A map made of the cubics through a graph: some nanoseconds where the map itself needs an
/// integration.
class CubicMap {
public:
    struct Node {
        double phase = 0;
        MapStep image;
        double lifted = 0; ///< to.phase with its turns
        bool singular = false;
        bool breaks = false; ///< between this node and the next
        bool jumps = false;  ///< and that is a jump
    };

    explicit CubicMap(const MapGraph& graph) {
        for (const MapSample& s : graph.samples) {
            Node n;
            n.phase = s.at.phase;
            n.image = {s.image.status, s.image.to, s.image.turns, s.image.slope};
            n.lifted = s.image.to.phase + TransitionMap::turn * double(s.image.turns);
            n.singular = s.image.singular;
            circles_[circle(s.at.boundary)].push_back(n);
        }
        for (auto& nodes : circles_) {
            Node last = nodes.front(); // a sample at phase 0
            last.phase = TransitionMap::turn;
            last.lifted += TransitionMap::turn;
            ++last.image.turns;
            nodes.push_back(last);
        }
        for (const MapBreak& b : graph.breaks)
            mark(b);
    }

    const std::vector<Node>& nodes(int boundary) const { return circles_[circle(boundary)]; }
    /// The node at or before a phase in [0, 2 pi).
    std::size_t piece(int boundary, double phase) const {
        const auto& n = nodes(boundary);
        const auto after = std::upper_bound(n.begin(), n.end() - 1, phase,
                                            [](double x, const Node& a) { return x < a.phase; });
        return std::size_t(after - n.begin()) - 1;
    }
    /// The jump at a phase, if there is one as near as this.
    const Node* jump(const Transition& at, double within) const {
        const auto& n = nodes(at.boundary);
        const std::size_t k = piece(at.boundary, at.phase);
        for (std::size_t i = k > 0 ? k - 1 : 0; i <= k + 1 && i + 1 < n.size(); ++i)
            if (n[i].jumps && at.phase >= n[i].phase - within &&
                at.phase <= n[i + 1].phase + within)
                return &n[i];
        return nullptr;
    }

    MapStep operator()(const Transition& at) const {
        const auto& n = nodes(at.boundary);
        const std::size_t k = piece(at.boundary, at.phase);
        const Node &a = n[k], &b = n[k + 1];
        const double w = b.phase - a.phase, u = (at.phase - a.phase) / w, v = 1 - u;
        if (a.breaks)
            return u < 0.5 ? a.image : b.image;
        if (!a.image.ok())
            return a.image;
        const double rise = b.lifted - a.lifted;
        const double sa = a.singular ? rise : w * a.image.slope;
        const double sb = b.singular ? rise : w * b.image.slope;
        const double lifted = a.lifted + v * v * u * sa + u * u * ((1 + 2 * v) * rise - v * sb);
        MapStep s{Status::ok, {a.image.to.boundary, TransitionMap::wrapped(lifted)}, 0, 0};
        s.turns = std::llround((lifted - s.to.phase) / TransitionMap::turn);
        s.slope = (6 * u * v * rise + v * (1 - 3 * u) * sa + u * (1 - 3 * v) * sb) / w;
        return s;
    }

private:
    void mark(const MapBreak& b) {
        auto& n = circles_[circle(b.left.at.boundary)];
        for (std::size_t k = piece(b.left.at.boundary, b.left.at.phase);
             k + 1 < n.size() && n[k].phase < b.right.at.phase; ++k) {
            n[k].breaks = true;
            n[k].jumps = b.jump();
        }
    }
    std::array<std::vector<Node>, 2> circles_;
};

} // namespace filippov::detail
