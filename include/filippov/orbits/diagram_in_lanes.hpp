// SPDX-License-Identifier: BSD-3-Clause
// Brute-force bifurcation diagrams in lanes: each parameter value is a member of a population.
#pragma once

#include <filippov/ensemble/any_lanes.hpp>
#include <filippov/orbits/diagram.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace filippov {

/// True of a diagram that lanes can make: strobes, and changes of mode. (They know nothing of
/// touches, of extrema of s, of user sections; and values that follow each other are not side by
/// side.)
template <int N> bool lanes_know(const DiagramSettings<double, N>& d) {
    const EventKinds changes{EventKind::cross, EventKind::enter_sliding, EventKind::exit_sliding};
    return !d.follow && (d.section.strobe || (d.section.events.bits & ~changes.bits) == 0) &&
           detail::lanes_know(d.run);
}

namespace detail {

/// The values of a diagram as members. A value that may be seen to repeat itself has legs of one
/// period: steps that end with the periods settle sooner, so that it repeats itself sooner, too.
template <class Sys> class DiagramMembers final : public Population<dim_v<Sys>, params_v<Sys>> {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;
    using Task = DiagramSettings<double, N>;
    using Value = DiagramValue<double, N>;

public:
    DiagramMembers(const Sys& sys, std::span<const Params<Sys, double>> params,
                   const Vec<double, N>& x0, const Task& task, std::vector<Value>& values)
        : sys_(sys), params_(params), x0_(x0), task_(task), values_(values), runs_(params.size()) {
        this->hears = !task.section.strobe;
        this->at_once = 64; // with fewer, lanes stand empty
    }

    Member<N, P> member(std::size_t id) override {
        Member<N, P> m;
        m.x = x0_;
        m.p = params_[id];
        m.t_end = std::numeric_limits<double>::quiet_NaN(); // of what cannot begin
        if (!can_begin<double>(sys_, params_[id]))
            return m;
        const double T = period(sys_, params_[id]), span = task_.transient + task_.keep;
        Value& value = values_[id];
        value.period = T;
        runs_[id] = std::make_unique<Run>(task_, T, value.points);
        if (T > 0) {
            runs_[id]->left = static_cast<long long>(span);
            m.t_end = end_of_periods(double(next_leg(*runs_[id], true)), T);
        } else {
            m.t_end = span;
        }
        return m;
    }
    bool goes_on(std::size_t id, const Outcome<N>& o) override {
        Run& run = *runs_[id];
        run.left -= run.leg;
        if (task_.section.strobe)
            run.recorder.strobe(o.clock.index, o.x, o.mode);
        if (run.left > 0)
            run.left -= run.recorder.skip(run.left);
        return run.left > 0;
    }
    double leg(std::size_t id) override {
        return double(next_leg(*runs_[id], false)) * values_[id].period;
    }
    void hear(std::size_t id, const MemberEvent<N>& e) override {
        Event<double, N, 1> event;
        event.period = e.clock.index;
        event.t_local = e.clock.local;
        event.kind = e.kind;
        event.surface = e.surface;
        event.mode_before.set(0, e.before);
        event.mode_after.set(0, e.after);
        event.x_left = event.x_right = e.x;
        runs_[id]->recorder.hear(event);
    }
    void take(std::size_t id, const Outcome<N>& o) override {
        Value& value = values_[id];
        value.status = o.status;
        value.x_end = o.x;
        value.counters.steps = o.steps;
        value.counters.events = o.events;
        if (runs_[id] == nullptr)
            return;
        value.cycle = runs_[id]->recorder.cycle();
        value.skipped = runs_[id]->recorder.skipped();
        runs_[id].reset();
    }

private:
    struct Run {
        Run(const Task& task, double T, std::vector<DiagramPoint<double, N>>& points)
            : recorder(task.section, T, task.transient, task.skip_repeats, points) {}

        DiagramRecorder<double, N, 1> recorder;
        long long left = 0, leg = 0; ///< periods: to be followed, and to the end of this leg
    };
    long long next_leg(Run& run, bool first) const {
        const long long transient = first ? static_cast<long long>(task_.transient) : 0;
        if (task_.skip_repeats)
            run.leg = 1;
        else
            run.leg = task_.section.strobe ? std::min(transient + 1, run.left) : run.left;
        return run.leg;
    }

    const Sys& sys_;
    const std::span<const Params<Sys, double>> params_;
    const Vec<double, N> x0_;
    const Task& task_;
    std::vector<Value>& values_;
    std::vector<std::unique_ptr<Run>> runs_; ///< of members that are under way
};

/// A diagram by whatever runs the population that it is given. What does not end well there is for
/// the scalar engine, which says why.
template <class With, class Sys, class RunMembers>
std::vector<DiagramValue<double, dim_v<Sys>>>
diagram_by_members(const With& with_steps, const Sys& sys,
                   std::span<const Params<Sys, double>> params, const Vec<double, dim_v<Sys>>& x0,
                   const DiagramSettings<double, dim_v<Sys>>& settings, const RunMembers& run) {
    validate(sys, settings, x0);
    std::vector<DiagramValue<double, dim_v<Sys>>> values(params.size());
    DiagramMembers<Sys> members(sys, params, x0, settings, values);
    run(members);
    std::vector<std::size_t> failed;
    for (std::size_t i = 0; i < values.size(); ++i)
        if (values[i].status == Status::interrupted)
            values[i] = {};
        else if (values[i].status != Status::ok)
            failed.push_back(i);
    Parallel how = settings.parallel;
    how.progress = {}; // they were told of
    parallel_for(failed.size(), how, [&](std::size_t k, Worker& worker) {
        const std::size_t i = failed[k];
        values[i] = {};
        follow_value(with_steps, sys, params[i], x0, settings, &worker, Sections<>{}, values[i]);
    });
    return values;
}

} // namespace detail

/// The diagram of `bifurcation_diagram`, whose values run side by side in lanes: several times as
/// fast, and the same to the tolerance.
///
/// Of a diagram or a system that lanes do not know it is that function. Counted are steps, rejected
/// ones included, and events.
/// @tparam W      lanes
/// @error std::invalid_argument as `bifurcation_diagram`
template <class Tableau = DormandPrince8, int W = native_lanes, class Sys>
std::vector<DiagramValue<double, dim_v<Sys>>>
bifurcation_diagram_in_lanes(const Sys& sys, std::span<const Params<Sys, double>> params,
                             const Vec<double, dim_v<Sys>>& x0,
                             const DiagramSettings<double, dim_v<Sys>>& settings) {
    if constexpr (RunsInLanes<Sys>)
        if (lanes_know(settings))
            return detail::diagram_by_members(
                WithSteps<Tableau, Sys, double>{}, sys, params, x0, settings,
                [&](Population<dim_v<Sys>, params_v<Sys>>& members) {
                    run_population<Tableau, W>(sys, params.size(), members, settings.run,
                                               settings.parallel);
                });
    return bifurcation_diagram<Tableau>(sys, params, x0, settings);
}

} // namespace filippov
