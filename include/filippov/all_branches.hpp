// SPDX-License-Identifier: BSD-3-Clause
// Every solution from a point, where there are several.
#pragma once

#include <filippov/trajectory.hpp>

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
    bool complete = true; ///< false: there are more than were asked for
};

namespace detail {

/// A recorder that makes the choices of a script, and from its end on the first.
template <class Sys, class S, bool Dense> struct ScriptedRecorder : Recorder<Sys, S, Dense> {
    static constexpr int M = surfaces_v<Sys>;
    const std::vector<int>& script;
    std::vector<Choice<S, M>>& choices;

    int choose(const Verdict<M>& v) {
        if (v.kept() == 0)
            return -1;
        const std::size_t n = choices.size();
        const int option = n < script.size() ? script[n] : 0;
        choices.push_back({S(0), v.option[std::size_t(option)], option, v.kept(), v.reason});
        return option;
    }
    void on_event(const Event<S, Recorder<Sys, S, Dense>::N, M>& event) {
        Recorder<Sys, S, Dense>::on_event(event);
        if (event.alternatives > 0 && dated < choices.size())
            choices[dated++].t = event.t;
    }
    std::size_t dated = 0;
};

} // namespace detail

/// Simulates every solution from x0: at each point where it is not unique all modes that are
/// admissible there are followed, depth first, each from the start.
///
/// A solution may slide on a repulsive surface and leave it at any later time; of these the one
/// that stays is followed.
/// @param most  solutions at most
/// @error std::invalid_argument as in `flow`, and for most < 1
/// @cost  one run a solution
template <class Tableau = DormandPrince5, bool Dense = true, class Sys, class S,
          class Sec = Sections<>>
Solutions<Sys, S> simulate_all(const Sys& sys, const Params<Sys, std::type_identity_t<S>>& p,
                               const Vec<S, dim_v<Sys>>& x0, std::type_identity_t<S> t0,
                               std::type_identity_t<S> t_end,
                               const Settings<S, dim_v<Sys>>& settings = {}, int most = 64,
                               const Sec& watched = {}) {
    detail::require_positive("most", most);
    Solutions<Sys, S> solutions;
    std::vector<int> script;
    for (;;) {
        if (int(solutions.all.size()) == most) {
            solutions.complete = false;
            return solutions;
        }
        solutions.all.push_back({{}, empty_trajectory(sys, p, x0, settings)});
        auto& solution = solutions.all.back();
        detail::ScriptedRecorder<Sys, S, Dense> recorder{
            {solution.trajectory}, script, solution.choices};
        solution.trajectory.result =
            flow<Tableau>(sys, p, x0, t0, t_end, settings, recorder, watched);
        // the last choice that has another option takes it
        const auto& made = solution.choices;
        std::size_t last = made.size();
        while (last > 0 && made[last - 1].option + 1 == made[last - 1].options)
            --last;
        if (last == 0)
            return solutions;
        script.clear();
        for (std::size_t k = 0; k < last; ++k)
            script.push_back(made[k].option + (k + 1 == last ? 1 : 0));
    }
}

} // namespace filippov
