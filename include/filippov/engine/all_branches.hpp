// SPDX-License-Identifier: BSD-3-Clause
// Every solution from a point, where there are several.
#pragma once

#include <filippov/engine/trajectory.hpp>

#include <utility>
#include <vector>

namespace filippov {

/// Where a solution was not unique, and how it went on.
template <class S, int M> struct Choice {
    S t{};                     ///< absolute time
    Mode<M> mode{};            ///< that was chosen
    int option = 0;            ///< its number among ...
    int options = 0;           ///< ... so many
    std::string_view reason{}; ///< why the solution is not unique there
};

/// One of the solutions.
template <class Sys, class S> struct Solution {
    std::vector<Choice<S, surfaces_v<Sys>>> choices;
    Trajectory<Sys, S> trajectory;
};

/// All solutions that were followed.
template <class Sys, class S> struct Solutions {
    std::vector<Solution<Sys, S>> all;
    bool complete = true; ///< false: there are more than were asked for, or than can be listed
};

/// What to choose where a solution is not unique, run after run until all has been tried: depth
/// first, each run from the start.
template <class S, int M> class Script {
public:
    /// The option to take: the next one planned, or the first.
    int choose(const Verdict<M>& v) {
        if (v.kept() == 0)
            return -1;
        const std::size_t n = made_.size();
        const int option = n < plan_.size() ? plan_[n] : 0;
        made_.push_back({S(0), v.option[std::size_t(option)], option, v.kept(), v.reason});
        complete_ = complete_ && v.n_options > 1 && v.kept() == v.n_options;
        return option;
    }
    /// Tells when the last choices were made: two changes of mode at one time are one event.
    void note(const S& t) {
        while (dated_ < made_.size())
            made_[dated_++].t = t;
    }
    const std::vector<Choice<S, M>>& made() const { return made_; }
    /// False if there are solutions beside the options, such as those that spiral away from an
    /// intersection which does not attract.
    bool complete() const { return complete_; }
    /// Plans the next run: the last choice that has another option takes it. False if none has.
    bool next() {
        std::size_t last = made_.size();
        while (last > 0 && made_[last - 1].option + 1 == made_[last - 1].options)
            --last;
        plan_.clear();
        for (std::size_t k = 0; k < last; ++k)
            plan_.push_back(made_[k].option + (k + 1 == last ? 1 : 0));
        made_.clear();
        dated_ = 0;
        return last > 0;
    }

private:
    std::vector<int> plan_;
    std::vector<Choice<S, M>> made_;
    std::size_t dated_ = 0;
    bool complete_ = true;
};

/// The same observer, which chooses by a script.
template <class S, int N, int M>
Observer<S, N, M> scripted(Observer<S, N, M> observer, Script<S, M>& script) {
    observer.event = [tell = std::move(observer.event), &script](const Event<S, N, M>& event) {
        if (tell)
            tell(event);
        if (event.alternatives > 0)
            script.note(event.t);
    };
    observer.choose = [&script](const Verdict<M>& verdict) { return script.choose(verdict); };
    return observer;
}

/// Simulates every solution from x0: at each point where it is not unique all modes that are
/// admissible there are followed.
///
/// A solution may slide on a repulsive surface and leave it at any later time. Of these the one
/// that stays is followed; it chooses again where it meets another surface.
/// @param params  `{}`: the defaults
/// @param most    solutions at most
/// @error std::invalid_argument as in `flow`, and for most < 1
/// @cost  one run a solution
template <class Tableau = DormandPrince5, bool Dense = true, class Sys, class S,
          class Sec = Sections<>>
Solutions<Sys, S>
simulate_all(const Sys& sys, const GivenParams<Sys, S>& params, const Vec<S, dim_v<Sys>>& x0,
             std::type_identity_t<S> t0, std::type_identity_t<S> t_end,
             const Settings<S, dim_v<Sys>>& settings = {}, int most = 64, const Sec& watched = {}) {
    constexpr int M = surfaces_v<Sys>;
    detail::require_positive("most", most);
    const Params<Sys, S> p = params.of(sys);
    Solutions<Sys, S> solutions;
    Script<S, M> script;
    do {
        if (int(solutions.all.size()) == most) {
            solutions.complete = false;
            break;
        }
        Solution<Sys, S> solution{{}, empty_trajectory(sys, p, x0, settings)};
        Recorder<Sys, S> recorder(solution.trajectory, Dense ? Keep::dense : Keep::steps);
        const Observer<S, dim_v<Sys>, M> observer = recorder;
        recorder.finish(
            flow<Tableau>(sys, p, x0, t0, t_end, settings, scripted(observer, script), watched));
        solution.choices = script.made();
        solutions.all.push_back(std::move(solution));
    } while (script.next());
    solutions.complete = solutions.complete && script.complete();
    return solutions;
}

} // namespace filippov
