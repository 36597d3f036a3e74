// SPDX-License-Identifier: BSD-3-Clause
// The sliding quotient: basins of P_trans on (boundary, phase), to which every trajectory that
// sticks is led by its first exit.
#pragma once

#include <filippov/map_graph.hpp>

#include <cstdint>
#include <random>
#include <set>

namespace filippov {

/// A periodic orbit of P_trans.
struct MapOrbit {
    std::vector<Transition> points; ///< as they follow each other; the first is the least
    std::vector<long long> turns;   ///< passes of 2 pi from the first to each of them
    long long periods = 0;          ///< forcing periods of one round: K
    double slope = 0;               ///< of a round: the multiplier that is not 0
    int period() const { return int(points.size()); }
    bool stable() const { return std::abs(slope) < 1; }
};

/// What trajectories tend to under P_trans.
struct MapAttractor {
    bool periodic = true;
    MapOrbit orbit;            ///< if it is periodic
    std::vector<double> reach; ///< around each of its points: what is nearer tends to it
    /// If it is not: which of `cells` equal arcs of the circles -1 and +1 it was seen in. That it
    /// does not repeat itself holds for the iterates that were looked at.
    std::array<std::vector<bool>, 2> cells{};
};

/// Why two basins meet at a phase.
enum class EndCause : unsigned char {
    unstable_orbit, ///< it is led to an unstable periodic orbit, or is on one
    jump,           ///< it is led to a jump of the map, or is one
    unknown,        ///< it was found, but not what it is led to
};

/// An end of two intervals.
struct BasinEnd {
    Transition at;
    double uncertainty = 0; ///< of the phase
    EndCause cause = EndCause::unknown;
    int steps = 0;  ///< iterates until it is on the orbit or the jump
    int orbit = -1; ///< of an unstable orbit: its index in `saddles`
};

/// An interval of phases with one fate.
struct BasinInterval {
    int boundary = -1;
    double begin = 0, end = 0; ///< phases; 0 and 2 pi are ends of intervals, too
    /// From 1, the index in `attractors` plus one; 0: not resolved; -1: no return.
    int attractor = 0;
    long long residue = 0;      ///< see ExitLabel; for a start in period 0. -1: not resolved
    Status status = Status::ok; ///< of no return: of the map where it ends
    double width() const { return end - begin; }
};

/// What becomes of a trajectory after an exit.
struct ExitLabel {
    int attractor = 0; ///< from 1; 0: not resolved; -1: no return
    /// Which of the K copies of the attractor, K its forcing periods, shifted against each other by
    /// a period, the strobe map has. On the copy 0 its first point is passed in the periods 0, K,
    /// 2 K ... In 0 ... K-1; 0 for one that is not periodic; -1: not resolved.
    long long residue = -1;
    int iterates = -1;          ///< of P_trans until it is within `distance`; -1: not resolved
    double distance = 0;        ///< in phase to the nearest end; infinite if the circle has none
    Status status = Status::ok; ///< of no return
};

/// How closely basins are looked at.
struct QuotientSettings {
    GraphSettings graph{.samples = 64}; ///< of the first iterate
    double distance = 1e-3;    ///< in phase from an attractor: where iterates end to be counted
    int starts = 256;          ///< runs that look for attractors
    int settle = 2000;         ///< iterates of each before it is looked at
    int max_period = 128;      ///< of the orbits of P_trans that are told from other attractors
    int max_iterates = 2000;   ///< after which a phase is not resolved
    int cells = 1024;          ///< of a circle, for attractors that are not periodic
    int max_intervals = 1024;  ///< on both circles; where there are more they are not resolved
    double resolution = 1e-12; ///< of ends, in phase
    int audits = 64;           ///< phases followed with the map itself to compare with
    long long max_evaluations = 200'000; ///< of the map itself, the graph's apart
    std::uint64_t seed = 1;              ///< of the phases of audits
};

/// A change of the number of iterates.
struct IteratesFrom {
    int boundary = -1;
    double begin = 0;
    int iterates = -1;
};

/// Basins of P_trans on both circles.
struct ExitBasins {
    std::vector<MapAttractor> attractors;
    std::vector<MapOrbit> saddles;        ///< the unstable orbits that bound basins
    std::vector<BasinInterval> intervals; ///< by boundary, then by phase; they cover both circles
    std::vector<BasinEnd> ends;           ///< in the same order
    std::vector<IteratesFrom> iterates;   ///< in the same order
    double distance = 0;                  ///< see QuotientSettings
    double unresolved = 0;                ///< share of both circles
    int checks = 0;                       ///< images of the map beside ends, and audits
    int disagreements = 0;                ///< of those
    long long evaluations = 0;            ///< of the map, its graph included
    Status status = Status::ok;
    std::string message = "The basins are complete.";

    /// What becomes of a trajectory after an exit.
    ///
    /// An attractor of P_trans that takes K forcing periods is K attractors of the strobe map, told
    /// apart by the residue. Counts of iterates come from cubics through the graph: where they
    /// change is as exact as `GraphSettings::tolerance` over the slope to where it is decided.
    /// @param exit   a transition from stick to slip
    /// @param period the forcing period in which it happens: t = (period + phase/2 pi) T
    /// @error  std::invalid_argument for a boundary that is not -1 or +1 and a phase not finite
    /// @cost   three binary searches
    ExitLabel at(const Transition& exit, long long period = 0) const;
};

/// Whether basins may be looked up by the first exit, and why not.
struct QuotientApplies {
    bool applies = false;
    std::string reason;
    explicit operator bool() const { return applies; }
};

namespace detail {

/// n mod k in 0 ... k-1.
inline long long residue_of(long long n, long long k) { return k > 0 ? ((n % k) + k) % k : 0; }
inline double around(double phase) { return std::remainder(phase, TransitionMap::turn); }
inline std::size_t circle(int boundary) { return boundary < 0 ? 0 : 1; }
inline bool before(const Transition& a, const Transition& b) {
    return a.boundary != b.boundary ? a.boundary < b.boundary : a.phase < b.phase;
}

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

class BasinBuilder {
public:
    BasinBuilder(const TransitionMap& map, const QuotientSettings& settings)
        : map_(&map), settings_(settings), random_(settings.seed) {
        require(settings);
        out_.distance = settings.distance;
    }

    ExitBasins run() {
        MapGraph graph = map_graph(*map_, 1, settings_.graph);
        graph_evaluations_ = graph.evaluations;
        if (graph.status != Status::ok) {
            fail(graph.status, graph.message);
        } else {
            cubic_.emplace(graph);
            find_attractors(graph);
            find_ends();
            make_intervals();
            classify();
            name_ends();
            count_iterates();
            check_ends();
            audit();
        }
        explain();
        return std::move(out_);
    }

private:
    static constexpr double turn = TransitionMap::turn;
    /// An end as the cubics have it, and as the map itself has it.
    struct Raw {
        Transition at;
        Fate left, right;
        BasinEnd end{};
        int next = -1; ///< the end that it is led to
        bool done = false;
    };

    static void require(const QuotientSettings& s) {
        const auto positive = [](const char* what, long long value) {
            if (!(value > 0))
                refuse(what, double(value), "expected an integer > 0");
        };
        if (!(s.distance > 0 && s.distance < std::numbers::pi))
            refuse("distance", s.distance, "expected 0 < distance < pi");
        if (!(s.resolution >= 1e-14 && s.resolution <= 1e-3))
            refuse("resolution", s.resolution, "expected 1e-14 <= resolution <= 1e-3");
        positive("starts", s.starts);
        positive("settle", s.settle);
        positive("max_period", s.max_period);
        positive("max_iterates", s.max_iterates);
        positive("cells", s.cells);
        positive("max_intervals", s.max_intervals);
        positive("max_evaluations", s.max_evaluations);
        if (!(s.audits >= 0))
            refuse("audits", s.audits, "expected an integer >= 0");
    }
    void fail(Status status, std::string why) {
        if (out_.status != Status::ok) // the first failure wins
            return;
        out_.status = status;
        out_.message = std::move(why);
    }
    /// 53 bits of the generator: the same on every platform.
    double uniform() { return double(random_() >> 11) * 0x1p-53; }

    // --- one step, and the fate of a phase -----------------------------------------------------

    MapStep real(const Transition& at) {
        MapStep s;
        s.status = Status::interrupted;
        if (map_->interrupted()) {
            fail(Status::interrupted, std::string(message(Status::interrupted)));
        } else if (out_.evaluations >= settings_.max_evaluations) {
            fail(Status::max_steps, "max_evaluations was used up; ends may be less exact than "
                                    "their uncertainty says.");
        } else {
            ++out_.evaluations;
            const Image image = (*map_)(at);
            s = {image.status, image.to, image.turns, image.slope};
        }
        return s;
    }
    MapStep cubic(const Transition& at) const { return (*cubic_)(at); }
    /// By the cubics.
    Fate fate(const Transition& at) const {
        return fate_of(at, out_, settings_.max_iterates,
                       [this](const Transition& x) { return cubic(x); });
    }
    /// By the map itself.
    Fate follow(const Transition& at) {
        return fate_of(at, out_, settings_.max_iterates,
                       [this](const Transition& x) { return real(x); });
    }
    std::size_t cell(double phase) const { return cell_of(phase, std::size_t(settings_.cells)); }

    // --- attractors ----------------------------------------------------------------------------

    void find_attractors(const MapGraph& graph) {
        std::vector<Transition> from;
        for (const MapSample& s : graph.samples)
            if (s.image.ok())
                from.push_back(s.image.to);
        const auto n = std::min(from.size(), std::size_t(settings_.starts));
        for (std::size_t k = 0; k < n; ++k) {
            Transition at = from[k * from.size() / n];
            if (fate(at).attractor == 0 && run_on(at, settings_.settle))
                add_attractor(at);
            if (interrupted())
                return;
        }
        std::sort(out_.attractors.begin(), out_.attractors.end(), [](const auto& a, const auto& b) {
            if (a.periodic != b.periodic)
                return a.periodic;
            return a.periodic && before(a.orbit.points[0], b.orbit.points[0]);
        });
    }
    bool interrupted() {
        if (map_->interrupted())
            fail(Status::interrupted, std::string(message(Status::interrupted)));
        return out_.status == Status::interrupted;
    }
    bool run_on(Transition& at, int iterates) const {
        for (int k = 0; k < iterates; ++k) {
            const MapStep s = cubic(at);
            if (!s.ok())
                return false;
            at = s.to;
        }
        return true;
    }
    void add_attractor(const Transition& at) {
        const auto add_periodic = [&](const Transition& x, int period) {
            const auto orbit = period > 0 ? newton(x, period) : std::nullopt;
            return orbit && orbit->stable() && add(*orbit);
        };
        const auto by_cubics = [this](const Transition& x) { return cubic(x); };
        if (add_periodic(at, repeats(at, by_cubics)))
            return;
        // The cubics are not the map: an orbit that attracts weakly may be lost in their errors.
        if (++long_runs_ > most_long_runs)
            return;
        Transition x = at;
        for (int k = 0; k < settings_.settle; ++k) {
            const MapStep s = real(x);
            if (!s.ok())
                return;
            x = s.to;
        }
        if (!add_periodic(x, repeats(x, [this](const Transition& y) { return real(y); })))
            add_visited(x);
    }
    /// After how many iterates a run is back where it was; 0 if it is not.
    template <class Step> int repeats(const Transition& from, const Step& step) const {
        Transition at = from;
        for (int k = 1; k <= settings_.max_period; ++k) {
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
        for (const MapAttractor& other : out_.attractors)
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
                fail(Status::not_converged,
                     "An orbit attracts too weakly for the graph: lower its tolerance.");
                return false;
            }
        }
        // What was seen before it was found was the way there.
        std::erase_if(out_.attractors, [&](const MapAttractor& other) {
            const Transition& c = orbit.points[0];
            return !other.periodic && other.cells[circle(c.boundary)][cell(c.phase)];
        });
        out_.attractors.push_back(a);
        return true;
    }
    /// A distance within which P^period contracts, and stays; 0 if none is well above the graph's
    /// tolerance.
    double reach(const Transition& c, int period) const {
        for (double r = 0.25; r > 100 * settings_.graph.tolerance; r /= 2)
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
                const MapStep s = cubic(at);
                if (!s.ok())
                    return false;
                at = s.to;
                passed += s.turns;
            }
            const double off = around(at.phase - c.phase);
            passed += std::llround((at.phase - off - c.phase) / turn);
            const bool inside = std::abs(off) < r - 4 * settings_.graph.tolerance;
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
            cells.assign(std::size_t(settings_.cells), false);
        for (int k = 0; k < 50 * settings_.cells; ++k) {
            Fate known;
            if (land(at, 0, k, out_, known) || known.attractor > 0)
                return; // a long way to an attractor is none
            a.cells[circle(at.boundary)][cell(at.phase)] = true;
            const MapStep s = cubic(at);
            if (!s.ok())
                return;
            at = s.to;
        }
        out_.attractors.push_back(a);
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

    // --- ends, on the cubics -------------------------------------------------------------------

    void find_ends() {
        if (interrupted())
            return;
        for (const int boundary : {-1, 1}) {
            const auto& nodes = cubic_->nodes(boundary);
            for (std::size_t k = 0; k + 1 < nodes.size() && !full(); ++k) {
                const double a = nodes[k].phase, b = nodes[k + 1].phase;
                // As fine as cells at least: cubics may be long where the map is smooth.
                const int parts = 1 + int((b - a) / turn * settings_.cells);
                for (int i = 0; i < parts; ++i)
                    split(boundary, a + (b - a) * i / parts,
                          i + 1 < parts ? a + (b - a) * (i + 1) / parts : std::min(b, last_phase));
            }
        }
        cut_parts();
        // What is led to an end is one.
        for (std::size_t k = 0; k < raw_.size() && !full(); ++k) {
            if (interrupted())
                return;
            pull_back(Transition(raw_[k].at));
        }
        std::sort(raw_.begin(), raw_.end(),
                  [](const Raw& a, const Raw& b) { return before(a.at, b.at); });
        cut_short_ = full();
        merge_ends();
    }
    /// On the end itself rounding may keep an iterate for ever: a fate of its own, between two ends
    /// that are one.
    void merge_ends() {
        std::vector<Raw> kept;
        for (const Raw& r : raw_) {
            if (!kept.empty() && kept.back().at.boundary == r.at.boundary &&
                r.at.phase - kept.back().at.phase <= settings_.resolution) {
                kept.back().right = r.right;
                if (kept.back().left == r.right)
                    kept.pop_back();
            } else {
                kept.push_back(r);
            }
        }
        raw_ = std::move(kept);
    }
    bool full() const { return raw_.size() >= std::size_t(settings_.max_intervals); }

    /// All ends between two phases by halving: where a middle has a third fate there are two.
    void split(int boundary, double a, double b) {
        Fate left = fate({boundary, a});
        const Fate right = fate({boundary, b});
        while (!(left == right) && !full()) {
            double low = a, high = b;
            Fate above = right;
            while (high - low > finest) {
                const double middle = low + (high - low) / 2;
                if (!(middle > low && middle < high))
                    break;
                const Fate f = fate({boundary, middle});
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
            const double room = 1e3 * finest;
            for (const Raw& r : raw_)
                if (r.at.boundary == boundary && std::abs(around(r.at.phase - x)) <= room)
                    return;
            split(boundary, std::max(x - room, 0.0), std::min(x + room, last_phase));
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
            const auto& nodes = cubic_->nodes(boundary);
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
        const MapStep s = cubic({boundary, phase});
        return s.to.phase + turn * double(s.turns);
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
                for (int k = 0; k < 60 && b - a > finest; ++k) {
                    const double middle = a + (b - a) / 2;
                    const bool beyond = lifted(part.boundary, middle) > target;
                    (beyond == (part.fb > part.fa) ? b : a) = middle;
                }
                found(part.boundary, a);
            }
        }
    }

    // --- ends, on the map itself ---------------------------------------------------------------

    /// What each end is led to makes a graph: its cycles are unstable orbits, all else comes from
    /// them or from jumps.
    void classify() {
        for (std::size_t k = 0; k < raw_.size(); ++k)
            link(k);
        for (std::size_t k = 0; k < raw_.size() && out_.status != Status::interrupted; ++k) {
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
    void link(std::size_t k) {
        Raw& r = raw_[k];
        r.end.at = r.at;
        r.end.uncertainty = 10 * settings_.graph.tolerance;
        if (const auto* n = cubic_->jump(r.at, 10 * finest)) {
            const double width = (n + 1)->phase - n->phase;
            r.end.at.phase = n->phase + width / 2;
            r.end.uncertainty = std::max(width, settings_.resolution);
            r.end.cause = EndCause::jump;
            r.done = true;
            return;
        }
        const MapStep s = cubic(r.at);
        if (s.ok())
            r.next = nearest(s.to, 1e3 * finest * (1 + std::abs(s.slope)));
    }
    /// The end nearest to a phase; -1 if none is so near.
    int nearest(const Transition& at, double within) const {
        int best = -1;
        const auto from =
            std::lower_bound(raw_.begin(), raw_.end(), at,
                             [](const Raw& r, const Transition& x) { return before(r.at, x); });
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
        const auto orbit = newton(raw_[std::size_t(cycle[0])].at, int(cycle.size()));
        if (!orbit || orbit->stable())
            return;
        for (const int i : cycle) {
            Raw& r = raw_[std::size_t(i)];
            double within = moved;
            for (const Transition& x : orbit->points) {
                const double apart = std::abs(around(x.phase - r.at.phase));
                if (x.boundary != r.at.boundary || !(apart < within))
                    continue;
                within = apart;
                r.end = {x, settings_.resolution, EndCause::unstable_orbit, 0,
                         int(out_.saddles.size())};
                r.done = true;
            }
        }
        out_.saddles.push_back(*orbit);
    }
    /// Newton on P(x) = the end that it is led to; halving if that fails.
    void solve_preimage(Raw& r) {
        if (r.done)
            return;
        r.done = true;
        const Raw* to = r.next >= 0 ? &raw_[std::size_t(r.next)] : nullptr;
        if (to == nullptr || to->end.cause == EndCause::unknown || !solve_for(r, to->end))
            halve(r);
    }
    bool solve_for(Raw& r, const BasinEnd& to) {
        Transition x = r.at;
        double last = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 12; ++k) {
            const MapStep s = real(x);
            if (!s.ok() || s.to.boundary != to.at.boundary)
                return false;
            const double dx = -around(s.to.phase - to.at.phase) / s.slope;
            if (!(std::abs(around(x.phase + dx - r.at.phase)) < moved))
                return false;
            x.phase = TransitionMap::wrapped(x.phase + dx);
            const double size = std::abs(dx);
            if (size <= 1e-14 || (size <= settings_.resolution && size >= last / 2)) {
                r.end = {x, settings_.resolution + to.uncertainty / std::abs(s.slope), to.cause,
                         to.steps + 1, to.orbit};
                return true;
            }
            last = size;
        }
        return false;
    }
    /// By fates of the map itself.
    void halve(Raw& r) {
        double a = r.at.phase - r.end.uncertainty, b = r.at.phase + r.end.uncertainty;
        // Of ends without number each would take as many evaluations as all else.
        if (cut_short_)
            return;
        const auto at = [&](double phase) {
            return follow({r.at.boundary, TransitionMap::wrapped(phase)});
        };
        if (!(at(a) == r.left) || !(at(b) == r.right))
            return;
        while (b - a > settings_.resolution) {
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

    // --- intervals -----------------------------------------------------------------------------

    void make_intervals() {
        for (const int boundary : {-1, 1}) {
            double begin = 0;
            for (const Raw& r : raw_)
                if (r.at.boundary == boundary) {
                    add_interval(boundary, begin, r.at.phase);
                    begin = r.at.phase;
                }
            add_interval(boundary, begin, turn);
        }
    }
    /// Its fate is that of its middle; a few other phases of it must have the same.
    void add_interval(int boundary, double begin, double end) {
        const Fate f = fate({boundary, begin + (end - begin) / 2});
        BasinInterval interval{boundary, begin, end, f.attractor, f.residue, f.status};
        for (int k = 0; k < 8 && end - begin > 1e2 * finest; ++k) {
            const double phase = begin + (end - begin) * (0.01 + 0.98 * uniform());
            const Fate other = fate({boundary, phase});
            if (other.attractor != f.attractor || other.status != f.status)
                interval.attractor = 0;
            if (!(other == f))
                interval.residue = -1;
        }
        out_.intervals.push_back(interval);
    }
    /// Moves the ends of the intervals from the cubics' to the map's.
    void name_ends() {
        std::size_t k = 0;
        for (std::size_t i = 0; i < raw_.size(); ++i) {
            BasinEnd end = raw_[i].end;
            // Nearer to each other than they are known: their order is kept.
            if (i > 0 && out_.ends.back().at.boundary == end.at.boundary &&
                end.at.phase < out_.ends.back().at.phase) {
                end.uncertainty += out_.ends.back().at.phase - end.at.phase;
                end.at.phase = out_.ends.back().at.phase;
            }
            while (out_.intervals[k].boundary != end.at.boundary ||
                   out_.intervals[k].end != raw_[i].at.phase)
                ++k;
            out_.intervals[k].end = out_.intervals[k + 1].begin = end.at.phase;
            out_.ends.push_back(end);
        }
    }
    /// The number of iterates changes at the edges of what is landed, at jumps, and at what is led
    /// to either. All on the cubics; then stretched as the ends of the intervals were moved.
    void count_iterates() {
        if (!cut_short_)
            find_changes();
        std::size_t e = 0; // the end at the right of an interval
        auto change = changes_.begin();
        for (const BasinInterval& i : out_.intervals) {
            const bool first = i.begin == 0, last = i.end == turn;
            const double a = first ? 0 : raw_[e - 1].at.phase, b = last ? turn : raw_[e].at.phase;
            const double stretch = b > a ? (i.end - i.begin) / (b - a) : 1;
            e += !last;
            double from = a;
            const auto keep = [&](double to) {
                const bool known = !cut_short_ && i.attractor > 0 && i.residue >= 0;
                const int n = known ? fate({i.boundary, from + (to - from) / 2}).iterates : -1;
                out_.iterates.push_back({i.boundary, i.begin + (from - a) * stretch, n});
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
            return fate({boundary, phase}).iterates;
        };
        const auto offer = [&](int boundary, double phase) {
            const double room = 1e4 * finest;
            double a = std::max(phase - room, 0.0), b = std::min(phase + room, last_phase);
            const auto near = changes_.lower_bound({boundary, a});
            if (near != changes_.end() && !before({boundary, b}, *near))
                return;
            const int left = count(boundary, a);
            if (count(boundary, b) == left)
                return;
            while (b - a > finest) {
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
            if (interrupted())
                return;
            if (work.size() > 16 * std::size_t(settings_.max_intervals))
                return fail(Status::ambiguous, "The number of iterates changes too often to be "
                                               "counted everywhere.");
            preimages(Transition(work[k]), offer);
        }
    }
    template <class Offer> void for_edges(const Offer& offer) const {
        for (const MapAttractor& a : out_.attractors) {
            for (std::size_t j = 0; j < a.orbit.points.size(); ++j)
                for (const int side : {-1, 1})
                    offer(a.orbit.points[j].boundary,
                          TransitionMap::wrapped(a.orbit.points[j].phase +
                                                 side * std::min(a.reach[j], out_.distance)));
            for (const int boundary : {-1, 1})
                for (std::size_t j = 0; j < a.cells[circle(boundary)].size(); ++j)
                    offer(boundary, turn * double(j) / settings_.cells);
        }
        for (const int boundary : {-1, 1})
            for (const auto& n : cubic_->nodes(boundary))
                if (n.breaks)
                    offer(boundary, n.phase);
    }

    // --- checks --------------------------------------------------------------------------------

    /// On either side of an end the image of the map lies where the label does not change.
    void check_ends() {
        const std::size_t stride = 1 + out_.ends.size() / 256;
        for (std::size_t i = 0; i < out_.ends.size(); i += stride) {
            const BasinEnd& e = out_.ends[i];
            const double aside = std::max(64 * e.uncertainty, 1e-10);
            for (const double x : {e.at.phase - aside, e.at.phase + aside}) {
                const Transition at{e.at.boundary, TransitionMap::wrapped(x)};
                const ExitLabel here = out_.at(at);
                if (std::abs(here.distance - aside) > aside / 2)
                    continue; // another end is as near
                const MapStep s = real(at);
                if (s.status != Status::interrupted)
                    compare(here, s.ok() ? out_.at(s.to, s.turns) : ExitLabel{.attractor = -1});
            }
        }
    }
    void audit() {
        for (int k = 0; k < settings_.audits && out_.status != Status::interrupted; ++k) {
            const int boundary = uniform() < 0.5 ? -1 : 1;
            const Transition at{boundary, turn * uniform()};
            const Fate f = follow(at);
            ExitLabel label;
            label.attractor = f.attractor;
            label.residue = f.residue;
            compare(out_.at(at), label);
        }
    }
    void compare(const ExitLabel& a, const ExitLabel& b) {
        if (a.attractor == 0 || b.attractor == 0)
            return;
        ++out_.checks;
        const bool same_copy = a.residue < 0 || b.residue < 0 || a.residue == b.residue;
        out_.disagreements += a.attractor != b.attractor || !same_copy;
    }
    void explain() {
        for (const BasinInterval& i : out_.intervals)
            if (i.attractor == 0 || (i.attractor > 0 && i.residue < 0))
                out_.unresolved += i.width() / (2 * turn);
        out_.evaluations += graph_evaluations_;
        if (cut_short_)
            fail(Status::ambiguous, "There are more than max_intervals intervals: basins are as "
                                    "fine as that, or finer than any number.");
        if (out_.disagreements > 0)
            fail(Status::not_converged, "Some checks disagree: lower the graph's tolerance.");
        if (out_.unresolved > 0)
            fail(Status::ambiguous, "Some intervals are not resolved.");
    }

    static constexpr double finest = 1e-13; ///< on the cubics
    static constexpr int most_long_runs = 8;
    static constexpr double moved = 1e-2; ///< an end of the map is no further from the cubics'
    static constexpr double last_phase = turn * (1 - 2e-16);

    const TransitionMap* map_;
    QuotientSettings settings_;
    std::mt19937_64 random_;
    std::optional<CubicMap> cubic_;
    std::vector<Raw> raw_;
    std::vector<Part> parts_;
    struct Earlier {
        bool operator()(const Transition& a, const Transition& b) const { return before(a, b); }
    };
    std::set<Transition, Earlier> changes_; ///< of the number of iterates
    int long_runs_ = 0;                     ///< of the map itself
    bool cut_short_ = false;                ///< there are more ends
    long long graph_evaluations_ = 0;
    ExitBasins out_;
};

} // namespace detail

inline ExitLabel ExitBasins::at(const Transition& exit, long long period) const {
    if (exit.boundary != -1 && exit.boundary != 1)
        detail::refuse("exit.boundary", exit.boundary, "expected -1 or +1");
    if (!std::isfinite(exit.phase))
        detail::refuse("exit.phase", exit.phase, "expected a finite number");
    ExitLabel label;
    if (intervals.empty())
        return label;
    const double phase = TransitionMap::wrapped(exit.phase);
    const Transition at{exit.boundary, phase};
    const auto last_from = [&](const auto& sorted, auto of) {
        return std::upper_bound(
                   sorted.begin(), sorted.end(), at,
                   [&](const Transition& x, const auto& e) { return detail::before(x, of(e)); }) -
               sorted.begin() - 1;
    };
    const auto begin_of = [](const auto& e) { return Transition{e.boundary, e.begin}; };
    const BasinInterval& in = intervals[std::size_t(last_from(intervals, begin_of))];
    label.distance = std::numeric_limits<double>::infinity();
    // Neighbours round the circle: the first end follows the last.
    const auto mine = [&](int boundary) {
        return std::lower_bound(
                   ends.begin(), ends.end(), Transition{boundary, 0},
                   [](const BasinEnd& e, const Transition& x) { return detail::before(e.at, x); }) -
               ends.begin();
    };
    const auto low = mine(exit.boundary);
    const auto high = exit.boundary < 0 ? mine(1) : std::ptrdiff_t(ends.size());
    const auto below = last_from(ends, [](const BasinEnd& e) { return e.at; });
    bool resolved = true;
    if (high > low)
        for (const auto j : {below, below + 1}) {
            const BasinEnd& e = ends[std::size_t(low + (j - low + high - low) % (high - low))];
            const double apart = std::abs(detail::around(e.at.phase - phase));
            label.distance = std::min(label.distance, apart);
            resolved = resolved && apart > e.uncertainty;
        }
    if (!resolved)
        return label;
    label.attractor = in.attractor;
    label.status = in.status;
    if (in.attractor <= 0)
        return label;
    const MapAttractor& a = attractors[std::size_t(in.attractor - 1)];
    if (in.residue >= 0)
        label.residue = a.periodic ? detail::residue_of(in.residue + period, a.orbit.periods) : 0;
    if (!iterates.empty())
        label.iterates = iterates[std::size_t(last_from(iterates, begin_of))].iterates;
    return label;
}

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
    detail::require_iterate(max_iterates);
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
            const auto exit = map.exit_point({e.after, e.t / T * TransitionMap::turn});
            if (!exit || !((exit->x - e.x).norm() <= 1e-6 * (1 + e.x.norm())))
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
