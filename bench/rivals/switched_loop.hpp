// SPDX-License-Identifier: BSD-3-Clause
//
// A system with one switching surface around somebody else's one-step integrator: the events by
// hand, as a careful user writes them, the same for every integrator. What event_loop.hpp is to the
// oscillator this is to the other problems; slides are integrated.

#pragma once

#include "roots.hpp"
#include "switched.hpp"

#include <cmath>

namespace filippov::rivals {

/// Integrator: as for detail::EventLoop. It is made once and serves many runs.
template <class Sys, class Integrator> class SwitchedLoop {
    using Problem = Switched<Sys>;
    using X = typename Problem::X;
    using Sample = typename Integrator::Sample;

public:
    SwitchedLoop(const Problem& problem, double tol)
        : problem_(problem), tol_(tol), integrator_(tol) {}
    SwitchedLoop(const SwitchedLoop&) = delete;
    SwitchedLoop& operator=(const SwitchedLoop&) = delete;

    SwitchedEnd<Sys> run(const X& x0, double t_end) {
        constexpr long most_steps = 10'000'000;
        end_ = {};
        t_ = 0;
        t_end_ = t_end;
        x_ = x0;
        h_slip_ = h_slide_ = integrator_.first_step();
        enter(problem_.first_mode(t_, x_), problem_.on_surface(t_, x_));
        for (long i = 0; i < most_steps && !end_.finished; ++i)
            step();
        end_.x = x_;
        return end_;
    }

private:
    static X vector(const typename Problem::State& x) { return Problem::vector(x.data()); }

    /// Starts a mode at x_. On the surface the gap is zero, whatever rounding makes of it, and
    /// opens: a start root of known order is never found again.
    void enter(int mode, bool on_surface, bool tangent = false) {
        mode_ = mode;
        const SwitchedField<Sys> field{&problem_, mode};
        typename Problem::State x, dxdt;
        Eigen::Map<X>(x.data()) = x_;
        field(x, dxdt, t_);
        integrator_.start(field, t_, x, dxdt);
        begin_ = problem_.gaps(mode, t_, x_, vector(dxdt));
        if (mode != 0 && on_surface) {
            begin_.gap[0] = 0;
            begin_.rate[0] = tangent ? 0.0 : std::fmax(begin_.rate[0], 0.0);
        }
    }

    /// Tries one step.
    void step() {
        // What is a good step in a slide says nothing about slip.
        double& h_next = mode_ == 0 ? h_slide_ : h_slip_;
        const double left = t_end_ - t_;
        const bool last = !(h_next < left);
        const double h = last ? left : h_next;
        const bool accepted = integrator_.attempt(h);
        if (!last || !accepted)
            h_next = integrator_.h_next();
        const detail::Search search = accepted ? transition(h) : detail::Search::retake;
        if (search == detail::Search::retake) {
            if (accepted)
                h_next = 0.1 * h;
            ++end_.n_rejected;
            return;
        }
        ++end_.n_steps;
        if (search == detail::Search::found) {
            ++end_.n_events;
            problem_.project(t_, x_);
            enter(problem_.next_mode(mode_, t_, x_), true, mode_ == 0);
            return;
        }
        x_ = vector(integrator_.end().x);
        end_.finished = last;
        t_ += h;
        begin_ = end_gaps_;
        integrator_.accept(t_);
    }

    typename Problem::Gaps gaps(double t, const Sample& s) const {
        return problem_.gaps(mode_, t, vector(s.x), vector(s.dxdt));
    }

    /// Looks for the end of the mode in the accepted step and goes there.
    detail::Search transition(double h) {
        end_gaps_ = gaps(t_ + h, integrator_.end());
        double first = 2;
        std::size_t closes = 0;
        for (std::size_t k = 0; k < 2; ++k) {
            const detail::Gap step{begin_.gap[k], h * begin_.rate[k], end_gaps_.gap[k],
                                   h * end_gaps_.rate[k]};
            if (step.stays_open())
                continue;
            const double guess = detail::first_crossing(step.with_bulge(bulge(step, k, h)));
            const detail::Search search = detail::judge(step, guess, h);
            if (search == detail::Search::retake)
                return search;
            if (search == detail::Search::found && guess < first) {
                first = guess;
                closes = k;
            }
        }
        return first > 1 ? detail::Search::nothing : locate(closes, first, h);
    }

    /// Of a dip the cubic alone cannot tell whether it reaches zero: the middle of the step does.
    double bulge(const detail::Gap& step, std::size_t k, double h) {
        if (!(step.w1 > 0))
            return 0;
        const double cubic = 0.5 * (step.w0 + step.w1) + 0.125 * (step.dw0 - step.dw1);
        return 16 * (gaps(t_ + 0.5 * h, integrator_.at(0.5)).gap[k] - cubic);
    }

    detail::Search locate(std::size_t k, double guess, double h) {
        Sample inside{};
        double at = 0, gap = 0;
        const double theta = detail::root_in_bracket(guess, [&](double s) {
            at = s;
            inside = integrator_.at(s);
            const auto there = gaps(t_ + s * h, inside);
            gap = there.gap[k];
            return detail::ValueAndSlope{gap, h * there.rate[k]};
        });
        if (!(std::abs(gap) <= std::fmax(tol_, 1e-8))) // the cubic's zero, not the solution's
            return detail::Search::nothing;
        // The last of Newton's steps is below 1e-9: the slope takes the state there.
        x_ = vector(inside.x) + (theta - at) * h * vector(inside.dxdt);
        t_ += theta * h;
        return detail::Search::found;
    }

    Problem problem_;
    double tol_;
    Integrator integrator_;
    double t_ = 0, t_end_ = 0, h_slip_ = 0, h_slide_ = 0;
    X x_{};
    int mode_ = 1;
    typename Problem::Gaps begin_{}, end_gaps_{};
    SwitchedEnd<Sys> end_{};
};

} // namespace filippov::rivals
