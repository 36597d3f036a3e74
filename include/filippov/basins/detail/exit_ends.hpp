// SPDX-License-Identifier: BSD-3-Clause
// The ends of basins of P_trans: found on the cubics, solved for with the map itself.
#pragma once

#include <filippov/basins/detail/exit_search.hpp>

namespace filippov::detail {

/// An end as the cubics have it, and as the map itself has it.
struct RawEnd {
    Transition at;
    Fate left, right;
    BasinEnd end{};
    int next = -1; ///< the end that it is led to
    bool done = false;
};

/// Looks for ends on the cubics.
class EndSearch {
public:
    explicit EndSearch(ExitSearch& search) : search_(search) {}

    /// All of them in order, or as many as are asked for; not in order if it is interrupted.
    std::vector<RawEnd> find() {
        if (!search_.interrupted())
            look();
        return std::move(raw_);
    }
    /// What the cubics lead to a phase: found(boundary, phase).
    template <class Found> void preimages(const Transition& of, const Found& found) const {
        for (const Part& part : parts_) {
            if (part.to != of.boundary)
                continue;
            const double low = std::min(part.fa, part.fb), high = std::max(part.fa, part.fb);
            double target = of.phase + turn * std::ceil((low - of.phase) / turn);
            for (int n = 0; target < high && n < 1000; ++n, target += turn) {
                double a = part.a, b = part.b;
                for (int k = 0; k < 60 && b - a > ExitSearch::finest; ++k) {
                    const double middle = a + (b - a) / 2;
                    const bool beyond = lifted(part.boundary, middle) > target;
                    (beyond == (part.fb > part.fa) ? b : a) = middle;
                }
                found(part.boundary, a);
            }
        }
    }

private:
    void look() {
        for (const int boundary : {-1, 1}) {
            const auto& nodes = search_.cubics->nodes(boundary);
            for (std::size_t k = 0; k + 1 < nodes.size() && !full(); ++k) {
                if (search_.interrupted())
                    return;
                const double a = nodes[k].phase, b = nodes[k + 1].phase;
                // As fine as cells at least: cubics may be long where the map is smooth.
                const int parts = 1 + int((b - a) / turn * search_.settings.cells);
                for (int i = 0; i < parts; ++i)
                    split(boundary, a + (b - a) * i / parts,
                          i + 1 < parts ? a + (b - a) * (i + 1) / parts
                                        : std::min(b, ExitSearch::last_phase));
            }
        }
        cut_parts();
        // What is led to an end is one.
        for (std::size_t k = 0; k < raw_.size() && !full(); ++k) {
            if (search_.interrupted())
                return;
            pull_back(Transition(raw_[k].at));
        }
        std::sort(raw_.begin(), raw_.end(),
                  [](const RawEnd& a, const RawEnd& b) { return before(a.at, b.at); });
        search_.cut_short = full();
        merge_ends();
    }
    /// On the end itself rounding may keep an iterate for ever: a fate of its own, between two ends
    /// that are one.
    void merge_ends() {
        std::vector<RawEnd> kept;
        for (const RawEnd& r : raw_) {
            if (!kept.empty() && kept.back().at.boundary == r.at.boundary &&
                r.at.phase - kept.back().at.phase <= search_.settings.resolution) {
                kept.back().right = r.right;
                if (kept.back().left == r.right)
                    kept.pop_back();
            } else {
                kept.push_back(r);
            }
        }
        raw_ = std::move(kept);
    }
    bool full() const { return raw_.size() >= std::size_t(search_.settings.max_intervals); }

    /// All ends between two phases by halving: where a middle has a third fate there are two.
    void split(int boundary, double a, double b) {
        Fate left = search_.fate({boundary, a});
        const Fate right = search_.fate({boundary, b});
        while (!(left == right) && !full()) {
            double low = a, high = b;
            Fate above = right;
            while (high - low > ExitSearch::finest) {
                const double middle = low + (high - low) / 2;
                if (!(middle > low && middle < high))
                    break;
                const Fate f = search_.fate({boundary, middle});
                if (f == left) {
                    low = middle;
                } else {
                    high = middle;
                    above = f;
                }
            }
            raw_.push_back({{boundary, low + (high - low) / 2}, left, above});
            left = above;
            a = high;
        }
    }
    void pull_back(const Transition& end) {
        preimages(end, [&](int boundary, double x) {
            const double room = 1e3 * ExitSearch::finest;
            for (const RawEnd& r : raw_)
                if (r.at.boundary == boundary && std::abs(around(r.at.phase - x)) <= room)
                    return;
            split(boundary, std::max(x - room, 0.0), std::min(x + room, ExitSearch::last_phase));
        });
    }
    /// Parts of the smooth pieces of the cubics, short enough to hold a phase's preimage once.
    struct Part {
        int boundary, to;
        double a, b;   ///< phases
        double fa, fb; ///< the images, with turns
    };
    void cut_parts() {
        constexpr int parts = 4;
        for (const int boundary : {-1, 1}) {
            const auto& nodes = search_.cubics->nodes(boundary);
            for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
                const auto& n = nodes[k];
                if (n.breaks || !n.image.ok())
                    continue;
                const double w = nodes[k + 1].phase - n.phase;
                for (int i = 0; i < parts; ++i) {
                    const double x = n.phase + w * i / parts;
                    const double y = i + 1 < parts ? n.phase + w * (i + 1) / parts
                                                   : std::nextafter(nodes[k + 1].phase, n.phase);
                    parts_.push_back({boundary, n.image.to.boundary, x, y, lifted(boundary, x),
                                      lifted(boundary, y)});
                }
            }
        }
    }
    double lifted(int boundary, double phase) const {
        const MapStep s = search_.cubic({boundary, phase});
        return s.to.phase + turn * double(s.turns);
    }

    static constexpr double turn = TransitionMap::turn;

    ExitSearch& search_;
    std::vector<RawEnd> raw_;
    std::vector<Part> parts_;
};

/// Solves for ends with the map itself.
class EndSolver {
public:
    /// @param ends  as the cubics have them, in order
    EndSolver(ExitSearch& search, std::vector<RawEnd>& ends) : search_(search), raw_(ends) {}

    /// What each end is led to makes a graph: its cycles are unstable orbits, all else comes from
    /// them or from jumps.
    void run() {
        for (std::size_t k = 0; k < raw_.size(); ++k)
            link(k);
        for (std::size_t k = 0; k < raw_.size() && search_.found.status != Status::interrupted;
             ++k) {
            std::vector<int> path;
            int i = int(k);
            while (i >= 0 && !raw_[std::size_t(i)].done) {
                const auto met = std::find(path.begin(), path.end(), i);
                if (met != path.end()) {
                    solve_cycle({met, path.end()});
                    break;
                }
                path.push_back(i);
                i = raw_[std::size_t(i)].next;
            }
            for (auto p = path.rbegin(); p != path.rend(); ++p)
                solve_preimage(raw_[std::size_t(*p)]);
        }
    }

private:
    void link(std::size_t k) {
        RawEnd& r = raw_[k];
        r.end.at = r.at;
        r.end.uncertainty = 10 * search_.settings.graph.tolerance;
        if (const auto* n = search_.cubics->jump(r.at, 10 * ExitSearch::finest)) {
            const double width = (n + 1)->phase - n->phase;
            r.end.at.phase = n->phase + width / 2;
            r.end.uncertainty = std::max(width, search_.settings.resolution);
            r.end.cause = EndCause::jump;
            r.done = true;
            return;
        }
        const MapStep s = search_.cubic(r.at);
        if (s.ok())
            r.next = nearest(s.to, 1e3 * ExitSearch::finest * (1 + std::abs(s.slope)));
    }
    /// The end nearest to a phase; -1 if none is so near.
    int nearest(const Transition& at, double within) const {
        int best = -1;
        const auto from =
            std::lower_bound(raw_.begin(), raw_.end(), at,
                             [](const RawEnd& r, const Transition& x) { return before(r.at, x); });
        const auto i = from - raw_.begin();
        for (const auto j : {i - 1, i}) {
            if (j < 0 || j >= std::ptrdiff_t(raw_.size()))
                continue;
            const Transition& x = raw_[std::size_t(j)].at;
            const double apart = std::abs(around(x.phase - at.phase));
            if (x.boundary == at.boundary && apart <= within) {
                within = apart;
                best = int(j);
            }
        }
        return best;
    }
    void solve_cycle(const std::vector<int>& cycle) {
        const auto orbit = search_.newton(raw_[std::size_t(cycle[0])].at, int(cycle.size()));
        if (!orbit || orbit->stable())
            return;
        for (const int i : cycle) {
            RawEnd& r = raw_[std::size_t(i)];
            double within = moved;
            for (const Transition& x : orbit->points) {
                const double apart = std::abs(around(x.phase - r.at.phase));
                if (x.boundary != r.at.boundary || !(apart < within))
                    continue;
                within = apart;
                r.end = {x, search_.settings.resolution, EndCause::unstable_orbit, 0,
                         int(search_.found.saddles.size())};
                r.done = true;
            }
        }
        search_.found.saddles.push_back(*orbit);
    }
    /// Newton on P(x) = the end that it is led to; halving if that fails.
    void solve_preimage(RawEnd& r) {
        if (r.done)
            return;
        r.done = true;
        const RawEnd* to = r.next >= 0 ? &raw_[std::size_t(r.next)] : nullptr;
        if (to == nullptr || to->end.cause == EndCause::unknown || !solve_for(r, to->end))
            halve(r);
    }
    bool solve_for(RawEnd& r, const BasinEnd& to) {
        Transition x = r.at;
        double last = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 12; ++k) {
            const MapStep s = search_.real(x);
            if (!s.ok() || s.to.boundary != to.at.boundary)
                return false;
            const double dx = -around(s.to.phase - to.at.phase) / s.slope;
            if (!(std::abs(around(x.phase + dx - r.at.phase)) < moved))
                return false;
            x.phase = TransitionMap::wrapped(x.phase + dx);
            const double size = std::abs(dx);
            if (size <= 1e-14 || (size <= search_.settings.resolution && size >= last / 2)) {
                r.end = {x, search_.settings.resolution + to.uncertainty / std::abs(s.slope),
                         to.cause, to.steps + 1, to.orbit};
                return true;
            }
            last = size;
        }
        return false;
    }
    /// By fates of the map itself.
    void halve(RawEnd& r) {
        double a = r.at.phase - r.end.uncertainty, b = r.at.phase + r.end.uncertainty;
        // Of ends without number each would take as many evaluations as all else.
        if (search_.cut_short)
            return;
        const auto at = [&](double phase) {
            return search_.follow({r.at.boundary, TransitionMap::wrapped(phase)});
        };
        if (!(at(a) == r.left) || !(at(b) == r.right))
            return;
        while (b - a > search_.settings.resolution) {
            const double middle = a + (b - a) / 2;
            if (!(middle > a && middle < b))
                break;
            const Fate f = at(middle);
            if (f == r.left)
                a = middle;
            else if (f == r.right)
                b = middle;
            else
                break;
        }
        r.end.at.phase = TransitionMap::wrapped(a + (b - a) / 2);
        r.end.uncertainty = b - a;
    }

    static constexpr double moved = 1e-2; ///< an end of the map is no further from the cubics'

    ExitSearch& search_;
    std::vector<RawEnd>& raw_;
};

} // namespace filippov::detail
