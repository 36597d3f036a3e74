// SPDX-License-Identifier: BSD-3-Clause
//
// Boost.odeint's Dormand-Prince 5(4) with its dense output, for the loops of this folder. try_step
// with both derivatives is what odeint's own dense stepper calls; used directly it hands out the
// slopes at the ends of the step, which the event check needs, at no cost.

#pragma once

#include "sample.hpp"

#include <boost/numeric/odeint.hpp>

#include <cmath>
#include <utility>

namespace filippov::rivals::detail {

template <class Field> class OdeintIntegrator {
public:
    using State = typename Field::State;
    using Sample = detail::Sample<State>;

    explicit OdeintIntegrator(double tol)
        : tol_(tol), controlled_(typename Controlled::error_checker_type(tol, tol)) {}

    double first_step() const { return 0.3 * std::pow(tol_, 0.2); }

    void start(const Field& f, double t, const State& x, const State& dxdt) {
        f_ = f;
        t_ = t;
        begin_ = {x, dxdt};
    }

    bool attempt(double h) {
        double t = t_;
        h_ = h_next_ = h;
        n_field_ += 6;
        const auto result = f_.visit([&](const auto& f) {
            return controlled_.try_step(f, begin_.x, begin_.dxdt, t, end_.x, end_.dxdt, h_next_);
        });
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
    Field f_;
    double t_ = 0.0, h_ = 0.0, h_next_ = 0.0;
    Sample begin_{}, end_{};
    long n_field_ = 0;
};

} // namespace filippov::rivals::detail
