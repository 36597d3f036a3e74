// SPDX-License-Identifier: BSD-3-Clause
//
// Boost.odeint's Dormand-Prince 5(4) with its dense output, events and stick phase by hand.
// try_step with both derivatives is what odeint's own dense stepper calls; used directly it hands
// out the slopes at the ends of the step, which the event check needs, at no cost.

#pragma once

#include "event_loop.hpp"

#include <boost/numeric/odeint.hpp>

#include <cmath>
#include <utility>

namespace filippov::rivals {
namespace detail {

class OdeintIntegrator {
public:
    explicit OdeintIntegrator(double tol)
        : tol_(tol), controlled_(Controlled::error_checker_type(tol, tol)) {}

    double first_step() const { return 0.3 * std::pow(tol_, 0.2); }

    void start(const OneSided& f, double t, const State& x, const State& dxdt) {
        f_ = f;
        t_ = t;
        begin_ = {x, dxdt};
    }

    bool attempt(double h) {
        double t = t_;
        h_ = h_next_ = h;
        n_field_ += 6;
        const auto result =
            controlled_.try_step(f_, begin_.x, begin_.dxdt, t, end_.x, end_.dxdt, h_next_);
        return result == boost::numeric::odeint::success;
    }

    Sample at(double theta) {
        Sample s;
        controlled_.stepper().calc_state(t_ + theta * h_, s.x, begin_.x, begin_.dxdt, t_, end_.x,
                                         end_.dxdt, t_ + h_);
        f_(s.x, s.dxdt, t_ + theta * h_);
        ++n_field_;
        return s;
    }

    void accept(double t) {
        std::swap(begin_, end_);
        t_ = t;
    }

    const Sample& begin() const { return begin_; }
    const Sample& end() const { return end_; }
    double h_next() const { return h_next_; }
    long n_field() const { return n_field_; }

private:
    using Stepper =
        boost::numeric::odeint::runge_kutta_dopri5<State, double, State, double,
                                                   boost::numeric::odeint::array_algebra>;
    using Controlled = boost::numeric::odeint::controlled_runge_kutta<Stepper>;

    double tol_;
    Controlled controlled_;
    OneSided f_;
    double t_ = 0.0, h_ = 0.0, h_next_ = 0.0;
    Sample begin_{}, end_{};
    long n_field_ = 0;
};

} // namespace detail

/// As hand_loop, integrated by Boost.odeint.
inline RivalResult odeint_loop(double A, double omega, double y0, double v0, int n_periods,
                               double tol) {
    return detail::EventLoop<detail::OdeintIntegrator>(A, omega, y0, v0, n_periods, tol).run();
}

} // namespace filippov::rivals
