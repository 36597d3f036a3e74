// SPDX-License-Identifier: BSD-3-Clause
// The sliding quotient: basins of P_trans on (boundary, phase), to which every trajectory that
// sticks is led by its first exit.
#pragma once

#include <filippov/basins/detail/exit_attractors.hpp>
#include <filippov/basins/detail/exit_ends.hpp>
#include <filippov/core/statistics.hpp>

#include <random>
#include <set>

namespace filippov {

namespace detail {

class BasinBuilder {
public:
    BasinBuilder(const TransitionMap& map, const QuotientSettings& settings)
        : search_(map, settings), random_(settings.seed) {}

    ExitBasins run() {
        const MapGraph graph = map_graph(search_.map, 1, search_.settings.graph);
        graph_evaluations_ = graph.evaluations;
        if (graph.status != Status::ok) {
            search_.fail(graph.status, graph.message);
        } else {
            search_.cubics.emplace(graph);
            ExitAttractors(search_).find(graph);
            raw_ = ends_.find();
            if (!search_.interrupted())
                make_basins();
        }
        explain();
        return std::move(found_);
    }

private:
    void make_basins() {
        make_intervals();
        EndSolver(search_, raw_).run();
        name_ends();
        count_iterates();
        check_ends();
        audit();
    }
    void make_intervals() {
        for (const int boundary : {-1, 1}) {
            double begin = 0;
            for (const RawEnd& r : raw_)
                if (r.at.boundary == boundary) {
                    add_interval(boundary, begin, r.at.phase);
                    begin = r.at.phase;
                }
            add_interval(boundary, begin, turn);
        }
    }
    /// Its fate is that of its middle; a few other phases of it must have the same.
    void add_interval(int boundary, double begin, double end) {
        const Fate f = search_.fate({boundary, begin + (end - begin) / 2});
        BasinInterval interval{boundary, begin, end, f.attractor, f.residue, f.status};
        for (int k = 0; k < 8 && end - begin > 1e2 * ExitSearch::finest; ++k) {
            const double phase = begin + (end - begin) * (0.01 + 0.98 * uniform(random_));
            const Fate other = search_.fate({boundary, phase});
            if (other.attractor != f.attractor || other.status != f.status)
                interval.attractor = 0;
            if (!(other == f))
                interval.residue = -1;
        }
        found_.intervals.push_back(interval);
    }
    /// Moves the ends of the intervals from the cubics' to the map's.
    void name_ends() {
        std::size_t k = 0;
        for (std::size_t i = 0; i < raw_.size(); ++i) {
            BasinEnd end = raw_[i].end;
            // Led across phase 0: it stays on the side of its intervals.
            if (std::abs(end.at.phase - raw_[i].at.phase) > turn / 2) {
                const double edge = raw_[i].at.phase < turn / 2 ? 0 : ExitSearch::last_phase;
                end.uncertainty += std::abs(around(end.at.phase - edge));
                end.at.phase = edge;
            }
            // Nearer to each other than they are known: their order is kept.
            if (i > 0 && found_.ends.back().at.boundary == end.at.boundary &&
                end.at.phase < found_.ends.back().at.phase) {
                end.uncertainty += found_.ends.back().at.phase - end.at.phase;
                end.at.phase = found_.ends.back().at.phase;
            }
            while (found_.intervals[k].boundary != end.at.boundary ||
                   found_.intervals[k].end != raw_[i].at.phase)
                ++k;
            found_.intervals[k].end = found_.intervals[k + 1].begin = end.at.phase;
            found_.ends.push_back(end);
        }
    }
    /// The number of iterates changes at the edges of what is landed, at jumps, and at what is led
    /// to either. All on the cubics; then stretched as the ends of the intervals were moved.
    void count_iterates() {
        if (!search_.cut_short)
            find_changes();
        std::size_t e = 0; // the end at the right of an interval
        auto change = changes_.begin();
        for (const BasinInterval& i : found_.intervals) {
            const bool first = i.begin == 0, last = i.end == turn;
            const double a = first ? 0 : raw_[e - 1].at.phase, b = last ? turn : raw_[e].at.phase;
            const double stretch = b > a ? (i.end - i.begin) / (b - a) : 1;
            e += !last;
            double from = a;
            const auto keep = [&](double to) {
                const bool known = !search_.cut_short && i.attractor > 0 && i.residue >= 0;
                const int n =
                    known ? search_.fate({i.boundary, from + (to - from) / 2}).iterates : -1;
                found_.iterates.push_back({i.boundary, i.begin + (from - a) * stretch, n});
                from = to;
            };
            for (; change != changes_.end() && before(*change, {i.boundary, b}); ++change)
                keep(change->phase);
            keep(b);
        }
    }
    void find_changes() {
        std::vector<Transition> work;
        const auto count = [&](int boundary, double phase) {
            return search_.fate({boundary, phase}).iterates;
        };
        const auto offer = [&](int boundary, double phase) {
            const double room = 1e4 * ExitSearch::finest;
            double a = std::max(phase - room, 0.0),
                   b = std::min(phase + room, ExitSearch::last_phase);
            const auto near = changes_.lower_bound({boundary, a});
            if (near != changes_.end() && !before({boundary, b}, *near))
                return;
            const int left = count(boundary, a);
            if (count(boundary, b) == left)
                return;
            while (b - a > ExitSearch::finest) {
                const double middle = a + (b - a) / 2;
                if (!(middle > a && middle < b))
                    break;
                (count(boundary, middle) == left ? a : b) = middle;
            }
            work.push_back({boundary, b});
            changes_.insert(work.back());
        };
        for_edges(offer);
        for (std::size_t k = 0; k < work.size(); ++k) {
            if (search_.interrupted())
                return;
            if (work.size() > 16 * std::size_t(search_.settings.max_intervals))
                return search_.fail(Status::ambiguous,
                                    "The number of iterates changes too often to be "
                                    "counted everywhere.");
            ends_.preimages(Transition(work[k]), offer);
        }
    }
    template <class Offer> void for_edges(const Offer& offer) const {
        for (const MapAttractor& a : found_.attractors) {
            for (std::size_t j = 0; j < a.orbit.points.size(); ++j)
                for (const int side : {-1, 1})
                    offer(a.orbit.points[j].boundary,
                          TransitionMap::wrapped(a.orbit.points[j].phase +
                                                 side * std::min(a.reach[j], found_.distance)));
            for (const int boundary : {-1, 1})
                for (std::size_t j = 0; j < a.cells[circle(boundary)].size(); ++j)
                    offer(boundary, turn * double(j) / search_.settings.cells);
        }
        for (const int boundary : {-1, 1})
            for (const auto& n : search_.cubics->nodes(boundary))
                if (n.breaks)
                    offer(boundary, n.phase);
    }

    // --- checks --------------------------------------------------------------------------------

    /// On either side of an end the image of the map lies where the label does not change.
    void check_ends() {
        const std::size_t stride = 1 + found_.ends.size() / 256;
        for (std::size_t i = 0; i < found_.ends.size(); i += stride) {
            const BasinEnd& e = found_.ends[i];
            const double aside = std::max(64 * e.uncertainty, 1e-10);
            for (const double x : {e.at.phase - aside, e.at.phase + aside}) {
                const Transition at{e.at.boundary, TransitionMap::wrapped(x)};
                const ExitLabel here = found_.at(at);
                if (std::abs(here.distance - aside) > aside / 2)
                    continue; // another end is as near
                const MapStep s = search_.real(at);
                if (s.status != Status::interrupted)
                    compare(here, s.ok() ? found_.at(s.to, s.turns) : ExitLabel{.attractor = -1});
            }
        }
    }
    void audit() {
        for (int k = 0; k < search_.settings.audits && found_.status != Status::interrupted; ++k) {
            const int boundary = uniform(random_) < 0.5 ? -1 : 1;
            const Transition at{boundary, turn * uniform(random_)};
            const Fate f = search_.follow(at);
            ExitLabel label;
            label.attractor = f.attractor;
            label.residue = f.residue;
            compare(found_.at(at), label);
        }
    }
    void compare(const ExitLabel& a, const ExitLabel& b) {
        if (a.attractor == 0 || b.attractor == 0)
            return;
        ++found_.checks;
        const bool same_copy = a.residue < 0 || b.residue < 0 || a.residue == b.residue;
        found_.disagreements += a.attractor != b.attractor || !same_copy;
    }
    void explain() {
        for (const BasinInterval& i : found_.intervals)
            if (i.attractor == 0 || (i.attractor > 0 && i.residue < 0))
                found_.unresolved += i.width() / (2 * turn);
        found_.evaluations += graph_evaluations_;
        if (search_.cut_short)
            search_.fail(Status::ambiguous,
                         "There are more than max_intervals intervals: basins are as "
                         "fine as that, or finer than any number.");
        if (found_.disagreements > 0)
            search_.fail(Status::not_converged,
                         "Some checks disagree: lower the graph's tolerance.");
        if (found_.unresolved > 0)
            search_.fail(Status::ambiguous, "Some intervals are not resolved.");
    }

    static constexpr double turn = TransitionMap::turn;
    struct Earlier {
        bool operator()(const Transition& a, const Transition& b) const { return before(a, b); }
    };

    ExitSearch search_;
    ExitBasins& found_ = search_.found;
    EndSearch ends_{search_};
    std::vector<RawEnd> raw_;
    std::mt19937_64 random_;
    std::set<Transition, Earlier> changes_; ///< of the number of iterates
    long long graph_evaluations_ = 0;
};

} // namespace detail

/// Whether basins may be looked up by the first exit, and why not.
struct QuotientApplies {
    bool applies = false;
    std::string reason;
    explicit operator bool() const { return applies; }
};

/// Basins of P_trans: what every exit from stick to slip leads to.
///
/// The graph of the first iterate is built once, as cubics; on them attractors are looked for,
/// fates are compared and ends are found, and what is led to an end is one. Each end is then solved
/// for with the map itself: its image is an end, so that a few evaluations give it to rounding from
/// the unstable orbit or the jump that it comes from. At the end images beside ends and the fates
/// of random phases, by the map itself, are compared with what was found.
///
/// @return  status `ambiguous` if some phases are not resolved, `not_converged` if checks disagree
/// @error   std::invalid_argument for settings that make no sense
/// @cost    the graph; beyond it a handful of evaluations of the map an end, and for an audit its
///          iterates
inline ExitBasins exit_basins(const TransitionMap& map, const QuotientSettings& settings = {}) {
    return detail::BasinBuilder(map, settings).run();
}

/// What becomes of an exit by the map itself, iterate by iterate: slow, and exact.
/// @param basins whose attractors are those that it may come to
/// @return the same label as `ExitBasins::at`, but for the distance to ends, which is NaN
/// @cost   an evaluation of the map an iterate
inline ExitLabel follow_exit(const TransitionMap& map, const ExitBasins& basins,
                             const Transition& exit, long long period = 0,
                             int max_iterates = 2000) {
    detail::require_positive("max_iterates", max_iterates);
    const detail::Fate f = detail::fate_of(exit, basins, max_iterates, [&](const Transition& at) {
        const Image image = map(at);
        return detail::MapStep{image.status, image.to, image.turns, image.slope};
    });
    ExitLabel label{f.attractor, f.residue, f.iterates, std::numeric_limits<double>::quiet_NaN(),
                    f.status};
    if (f.attractor > 0)
        label.residue = detail::residue_of(
            f.residue + period, basins.attractors[std::size_t(f.attractor - 1)].orbit.periods);
    return label;
}

namespace detail {

/// What exit curves lack: a point, or sliding that attracts there.
inline std::string lack_of_curves(const TransitionMap& map, int n) {
    for (const int boundary : {-1, 1})
        for (int k = 0; k < n; ++k) {
            const Transition at{boundary, TransitionMap::turn * (k + 0.5) / n};
            const auto exit = map.exit_point(at);
            const std::string where = " at boundary " + std::to_string(boundary) + ", phase " +
                                      std::to_string(at.phase) + ".";
            if (!exit)
                return "No end of a slide was found" + where;
            if (!exit->attracting)
                return "Sliding repels at the end of a slide" + where;
        }
    return "";
}
/// Of runs from beside the curves: exits elsewhere.
inline std::string lack_of_exits(const TransitionMap& map, double periods) {
    int exits = 0;
    for (int k = 0; k < 16; ++k) {
        const auto from = map.exit_point({k % 2 == 0 ? -1 : 1, TransitionMap::turn * k / 16});
        const double angle = TransitionMap::turn * 0.381966 * k; // every direction, evenly
        const Vector x = from->x + 0.1 * (1 + from->x.norm()) *
                                       Eigen::Vector2d(std::cos(angle), std::sin(angle));
        const double T = map.period(), t0 = T * k / 16;
        const History run = map.system().run(t0, x, t0 + periods * T, map.params());
        if (run.status == Status::interrupted)
            return std::string(message(Status::interrupted));
        for (const Happening& e : run.events) {
            if (e.kind != EventKind::exit_sliding)
                continue;
            ++exits;
            if (!map.knows({e.after, e.t / T * TransitionMap::turn}, e.x))
                return "A slide ended beside the exit curve that was found, at t = " +
                       std::to_string(e.t) + ": the curve has another branch.";
        }
    }
    return exits > 0 ? "" : "No slide ended in runs from around the exit curves.";
}

} // namespace detail

/// Whether a system's trajectories may be labelled by their first exit.
///
/// It must be planar and forced, without static friction; both exit curves must be found all round
/// and attract; and of runs from beside the curves some slides must end, all of them on the curves:
/// an exit elsewhere is on another branch. That runs show none does not prove that there is none.
/// @error none: what the system lacks is the reason
/// @cost  16 runs of at most 10 forcing periods
inline QuotientApplies quotient_applies(const AnySystem& system, const Vector& p,
                                        const TransitionSettings& settings = {}) {
    try {
        const TransitionMap map(system, p, settings);
        std::string lack = detail::lack_of_curves(map, 64);
        if (lack.empty())
            lack = detail::lack_of_exits(map, std::min(10.0, settings.max_periods));
        return {lack.empty(), lack.empty() ? "Every slide ends on a curve." : lack};
    } catch (const std::invalid_argument& why) {
        return {false, why.what()};
    }
}

} // namespace filippov
