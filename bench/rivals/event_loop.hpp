// SPDX-License-Identifier: BSD-3-Clause
//
// The dry friction oscillator around somebody else's integrator: events, restarts and the stick
// phase by hand, the same for every rival, so that the integrators are compared and not the care
// spent on each.

#pragma once

#include "oscillator.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace filippov::rivals::detail {

/// One-sided field, smooth across the surface: side = +1 in S1, -1 in S2.
struct OneSided {
    using State = std::array<double, 2>; // y, v

    double A = 0.0, omega = 1.0, side = 1.0;

    double friction(double r) const { return 3.0 / (1.0 + gamma * r) + 1.0 + 0.1 * r * r; }

    /// Hands `use` a function of (x, dxdt, t) without a branch: here itself.
    template <class Use> decltype(auto) visit(Use&& use) const { return use(*this); }

    void rates(double t, const double* x, double* dxdt) const {
        dxdt[0] = x[1];
        dxdt[1] = A * std::cos(omega * t) - x[0] + side * friction(side * (belt - x[1]));
    }
    void operator()(const State& x, State& dxdt, double t) const {
        rates(t, x.data(), dxdt.data());
    }
};

/// Integrator: start(f, t, x, dxdt); attempt(h) -> accepted?; begin(), end() of the last attempt;
/// at(theta) inside it; accept(); h_next(); n_field().
template <class Integrator> class EventLoop {
    using State = OneSided::State;
    using Sample = typename Integrator::Sample;

public:
    EventLoop(double A, double omega, double y0, double v0, int n_periods, double tol)
        : field_{A, omega, 1.0}, tol_(tol), integrator_(tol), clock_{0.0, n_periods},
          h_(integrator_.first_step()) {
        const double q = A - y0;
        stuck_ = v0 == belt && std::abs(q) < edge;
        x_ = {y0, v0};
        const bool in_s1 = v0 < belt || (v0 == belt && q < 0.0);
        if (!stuck_)
            enter(in_s1 ? 1.0 : -1.0);
    }

    RivalResult run() {
        while (clock_.periods_left > 0) {
            if (stuck_)
                stick();
            else
                slip();
        }
        count_.n_field += integrator_.n_field();
        count_.y = x_[0];
        count_.v = x_[1];
        return count_;
    }

private:
    double time() const { return clock_.phi / field_.omega; }
    double gap(const State& x) const { return field_.side * (belt - x[1]); }

    void enter(double side) {
        field_.side = side;
        State dxdt;
        field_(x_, dxdt, time());
        ++count_.n_field;
        integrator_.start(field_, time(), x_, dxdt);
    }

    /// As enter, with the speed away from the surface as the event fixes it: a start root of
    /// known order is never found again.
    void enter_from_surface(double side, double speed) {
        field_.side = side;
        const State dxdt{belt, -side * std::max(speed, 0.0)};
        integrator_.start(field_, time(), x_, dxdt);
    }

    void slip() {
        for (;;) {
            const double h_left = clock_.phase_left() / field_.omega;
            const bool last = !(h_ < h_left);
            const double h = last ? h_left : h_;
            const bool accepted = integrator_.attempt(h);
            if (!last || !accepted)
                h_ = integrator_.h_next();
            const Search search = accepted ? transition(h) : Search::retake;
            if (search == Search::retake) {
                if (accepted)
                    h_ = 0.1 * h;
                ++count_.n_rejected;
                continue;
            }
            ++count_.n_steps;
            if (search == Search::found) {
                arrive();
                return;
            }
            x_ = integrator_.end().x;
            if (last) {
                clock_ = {0.0, 0};
                return;
            }
            clock_.advance(field_.omega * h);
            integrator_.accept(time());
        }
    }

    /// Looks for the surface in the accepted step and goes there.
    Search transition(double h) {
        const Sample &begin = integrator_.begin(), &end = integrator_.end();
        const double rate = -field_.side * h;
        const Gap step{gap(begin.x), rate * begin.dxdt[1], gap(end.x), rate * end.dxdt[1]};
        if (step.stays_open())
            return Search::nothing;
        double bulge = 0.0;
        if (step.w1 > 0.0) { // a dip: the cubic alone cannot tell whether it reaches the surface
            const double cubic = 0.5 * (step.w0 + step.w1) + 0.125 * (step.dw0 - step.dw1);
            bulge = 16.0 * (gap(integrator_.at(0.5).x) - cubic);
        }
        const double guess = first_crossing(step.with_bulge(bulge));
        const Search search = judge(step, guess, h);
        if (search != Search::found)
            return search;
        const double theta = root_in_bracket(guess, [&](double s) {
            const Sample inside = integrator_.at(s);
            return ValueAndSlope{gap(inside.x), rate * inside.dxdt[1]};
        });
        const State x = integrator_.at(theta).x;
        if (std::abs(gap(x)) > tol_)
            return Search::nothing;
        clock_.advance(field_.omega * h * theta);
        x_ = {x[0], belt};
        return Search::found;
    }

    void arrive() {
        const double q = field_.A * std::cos(clock_.phi) - x_[0];
        const Verdict verdict = arrival(field_.side, q);
        if (verdict == Verdict::touches) {
            enter_from_surface(field_.side, -field_.side * q - edge);
            return;
        }
        ++count_.n_events;
        stuck_ = verdict == Verdict::sticks;
        if (!stuck_)
            enter_from_surface(-field_.side, field_.side * q - edge);
    }

    void stick() {
        const double left = clock_.phase_left() / field_.omega;
        const StickEnd end = stick_end(field_.A, field_.omega, clock_.phi, x_[0]);
        if (end.duration >= left) {
            x_[0] += belt * left;
            clock_ = {0.0, 0};
            return;
        }
        x_[0] += belt * end.duration;
        clock_.advance(field_.omega * end.duration);
        stuck_ = false;
        ++count_.n_events;
        enter_from_surface(end.side, 0.0);
    }

    OneSided field_;
    double tol_;
    Integrator integrator_;
    Clock clock_;
    double h_;
    State x_{};
    bool stuck_ = false;
    RivalResult count_{};
};

} // namespace filippov::rivals::detail
