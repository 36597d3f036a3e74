// SPDX-License-Identifier: BSD-3-Clause
// Basins of P_trans on (boundary, phase), to which every trajectory that sticks is led by its first
// exit: what they consist of, and how an exit is looked up in them.
#pragma once

#include <filippov/orbits/map_graph.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

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

namespace detail {

/// n mod k in 0 ... k-1.
inline long long residue_of(long long n, long long k) { return k > 0 ? ((n % k) + k) % k : 0; }

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

} // namespace filippov
