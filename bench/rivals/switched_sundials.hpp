// SPDX-License-Identifier: BSD-3-Clause
//
// A system with one switching surface by SUNDIALS, whose own root finding stops it where a mode
// ends.

#pragma once

#include "sundials_solvers.hpp"
#include "switched.hpp"

namespace filippov::rivals {

/// Solver: detail::Cvode or detail::Erk. It is made once and serves many runs.
template <class Sys, template <class> class Solver, Roots sought = Roots::gaps_and_rates>
class SundialsSwitched {
    using X = typename Switched<Sys>::X;

public:
    SundialsSwitched(const Switched<Sys>& problem, SundialsMethod method, double tol)
        : problem_(problem), solver_(method, tol) {}
    SundialsSwitched(const SundialsSwitched&) = delete; // SUNDIALS is handed its address
    SundialsSwitched& operator=(const SundialsSwitched&) = delete;

    SwitchedEnd<Sys> run(const X& x0, double t_end) {
        constexpr long most_events = 1'000'000;
        SwitchedEnd<Sys> end;
        end.x = x0;
        double t = 0;
        std::array<double, 2> h_next{}; // a good step in a slide says nothing about slip
        int mode = problem_.first_mode(t, x0);
        while (end.n_events < most_events) {
            solver_.problem().field = {&problem_, mode};
            solver_.problem().set(end.x);
            const detail::SundialsStop stop = solver_.go(t, t_end, end, h_next[mode == 0]);
            h_next[mode == 0] = stop.h_next;
            end.x = solver_.problem().template get<X>();
            end.finished = !stop.at_root && !stop.failed;
            if (!stop.at_root)
                return end;
            t = stop.t;
            problem_.project(t, end.x);
            mode = problem_.next_mode(mode, t, end.x);
            ++end.n_events;
        }
        return end;
    }

private:
    Switched<Sys> problem_;
    Solver<SwitchedField<Sys, sought>> solver_;
};

} // namespace filippov::rivals
