// SPDX-License-Identifier: BSD-3-Clause
// Many trajectories: lanes on every thread.
#pragma once

#include <filippov/ensemble/detail/lane_flow.hpp>

#include <algorithm>
#include <mutex>

namespace filippov {

namespace detail {

/// The same as LaneFlow, one member after the other: for systems and settings that lanes do not
/// know.
template <class Sys> class ScalarFlow {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;

public:
    ScalarFlow(const Sys& sys, const Settings<double, N>& settings,
               const ScalarEngine<N, P>& scalar, Population<N, P>& population, Worker& worker)
        : sys_(sys), settings_(settings), scalar_(scalar), population_(population),
          worker_(worker) {}

    LaneCounters run(std::size_t next, std::size_t end) {
        for (; next < end && !worker_.stopped(); ++next)
            run_member(next);
        return counters_;
    }

private:
    void run_member(std::size_t id) {
        const Member<N, P> member = population_.member(id);
        const double T0 = period(sys_, member.p);
        double left = duration(member, T0);
        Outcome<N> o = not_begun(member);
        if (std::isfinite(left))
            o.clock = Clock<double>::at(member.t0, T0);
        while (std::isfinite(left)) {
            run_leg(id, member.p, left, o);
            if (o.status == Status::interrupted)
                return;
            if (o.status != Status::ok || !population_.goes_on(id, o))
                break;
            left = next_leg(population_, id);
        }
        population_.take(id, o);
        worker_.count();
    }
    void run_leg(std::size_t id, const Params<Sys, double>& p, double left, Outcome<N>& o) {
        ++counters_.handed_over;
        Stretch<N, P> stretch;
        stretch.p = plain<P>(p);
        stretch.x = plain<N>(o.x);
        stretch.t0 = o.clock.local;
        stretch.dt = left;
        stretch.ends_at_exit = population_.ends_at_exit;
        stretch.max_steps = settings_.max_steps - o.steps;
        stretch.max_events = settings_.max_events - o.events;
        StretchTeller<N, P> teller(population_, id, o.clock);
        const StretchEnd<N> end = scalar_.run(stretch, worker_, teller.listener());
        o.x = vector_of(end.x);
        const bool gone = population_.gone(end.status, o.x);
        o.status = gone ? Status::escaped : end.status;
        o.clock = {end.clock.period, o.clock.index + end.clock.index, end.clock.local,
                   end.clock.carry};
        o.mode = end.mode;
        o.events += end.events;
        o.slides += end.slides;
        o.slide_time += end.slide_time;
        o.steps += end.steps;
    }

    const Sys& sys_;
    const Settings<double, N>& settings_;
    const ScalarEngine<N, P>& scalar_;
    Population<N, P>& population_;
    Worker& worker_;
    LaneCounters counters_;
};

/// Settings that a lane can follow.
template <int N> bool lanes_know(const Settings<double, N>& s) {
    return !(s.fixed_step > 0) && s.skip_root_search && s.closed_form_slides;
}

} // namespace detail

/// How the run of a population ended.
struct PopulationRun {
    Status status = Status::ok; ///< `interrupted` if it was cancelled
    LaneCounters counters{};
};

/// Runs a population of n members in W lanes, on as many threads as there are.
///
/// What comes of a member depends neither on the others, nor on W, nor on threads: to the last bit
/// in one build, and between builds for one instruction set (see lanes.hpp).
/// @tparam W      lanes, a power of two up to 32; as many as a register holds are fastest
/// @param scalar  of the same settings and method
/// @error std::invalid_argument for settings that make no sense; all else is a member's status
/// @cost  memory: 64 W members a thread
template <class Tableau, int W, class Sys>
PopulationRun
run_population(const Sys& sys, std::size_t n, Population<dim_v<Sys>, params_v<Sys>>& population,
               const Settings<double, dim_v<Sys>>& settings,
               const ScalarEngine<dim_v<Sys>, params_v<Sys>>& scalar, const Parallel& how = {}) {
    require_system<Sys>();
    validate(settings);
    PopulationRun result;
    std::mutex adding;
    const auto run_tile = [&](auto&& flow, std::size_t from, std::size_t to) {
        const LaneCounters counters = flow.run(from, to);
        const std::lock_guard lock(adding);
        result.counters += counters;
    };
    // Long enough that lanes are full nearly all the time, short enough for the threads to share.
    const std::size_t team =
        std::max(std::size_t(detail::team_size(n, how.threads)), std::size_t(1));
    const std::size_t wanted = population.at_once > 0
                                   ? population.at_once
                                   : std::clamp<std::size_t>(n / 64, 64 * W, 16384);
    const std::size_t tile = std::max<std::size_t>(std::min(wanted, n / team + 1), W);
    Parallel tiles = how;
    tiles.total = n;
    const bool done =
        parallel_for((n + tile - 1) / tile, tiles, [&](std::size_t i, Worker& worker) {
            const std::size_t from = i * tile, to = std::min(n, from + tile);
            if constexpr (RunsInLanes<Sys>)
                if (detail::lanes_know(settings))
                    return run_tile(
                        LaneFlow<Sys, W, Tableau>(sys, settings, scalar, population, worker), from,
                        to);
            run_tile(detail::ScalarFlow<Sys>(sys, settings, scalar, population, worker), from, to);
        });
    if (!done)
        result.status = Status::interrupted;
    return result;
}
template <class Tableau = DormandPrince8, int W = native_lanes, class Sys>
PopulationRun
run_population(const Sys& sys, std::size_t n, Population<dim_v<Sys>, params_v<Sys>>& population,
               const Settings<double, dim_v<Sys>>& settings, const Parallel& how = {}) {
    const FlowEngine<Sys, Tableau> scalar(sys, settings);
    return run_population<Tableau, W>(sys, n, population, settings, scalar, how);
}

/// What became of an ensemble.
template <int N> struct Ensemble {
    Status status = Status::ok;       ///< `interrupted` if it was cancelled
    std::vector<Outcome<N>> outcomes; ///< one a member, `interrupted` where it did not end
    LaneCounters counters{};
};

/// Runs an ensemble, each member with its own start, times and parameters.
///
/// @param members  in any order, which nothing depends on
/// @error std::invalid_argument for settings that make no sense; a member that makes none has its
///        own status
template <class Tableau = DormandPrince8, int W = native_lanes, class Sys>
Ensemble<dim_v<Sys>>
ensemble(const Sys& sys, const std::vector<Member<dim_v<Sys>, params_v<Sys>>>& members,
         const Settings<double, dim_v<Sys>>& settings, const Parallel& how = {}) {
    constexpr int N = dim_v<Sys>, P = params_v<Sys>;
    struct Listed : Population<N, P> {
        const std::vector<Member<N, P>>* members;
        Ensemble<N>* result;
        Member<N, P> member(std::size_t id) override { return (*members)[id]; }
        void take(std::size_t id, const Outcome<N>& o) override { result->outcomes[id] = o; }
    };
    Ensemble<N> result;
    result.outcomes.resize(members.size());
    Listed listed;
    listed.members = &members;
    listed.result = &result;
    listed.same_params = std::all_of(members.begin(), members.end(), [&](const auto& m) {
        return std::equal(m.p.begin(), m.p.end(), members.front().p.begin()); // and none is NaN
    });
    const PopulationRun run =
        run_population<Tableau, W>(sys, members.size(), listed, settings, how);
    result.status = run.status;
    result.counters = run.counters;
    return result;
}

} // namespace filippov
