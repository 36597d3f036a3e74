// SPDX-License-Identifier: BSD-3-Clause
//
// GSL's Prince-Dormand 8(9), rk8pd, events and stick phase by hand. It has no dense output: a
// transition is located by taking the step again with another length, which keeps its order.

#pragma once

#include "event_loop.hpp"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <cmath>
#include <memory>
#include <utility>

namespace filippov::rivals {
namespace detail {

class GslIntegrator {
public:
    explicit GslIntegrator(double tol)
        : tol_(tol), step_(gsl_odeiv2_step_alloc(gsl_odeiv2_step_rk8pd, 2)),
          control_(gsl_odeiv2_control_standard_new(tol, tol, 1.0, 0.0)) {}

    double first_step() const { return 0.3 * std::pow(tol_, 1.0 / 9); }

    void start(const OneSided& f, double t, const State& x, const State& dxdt) {
        f_ = f;
        t_ = t;
        begin_ = {x, dxdt};
    }

    bool attempt(double h) {
        h_ = h_next_ = h;
        State error;
        end_ = advance(h, error);
        const int result = gsl_odeiv2_control_hadjust(control_.get(), step_.get(), end_.x.data(),
                                                      error.data(), end_.dxdt.data(), &h_next_);
        return result != GSL_ODEIV_HADJ_DEC;
    }

    Sample at(double theta) {
        State error;
        return advance(theta * h_, error);
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
    struct Free {
        void operator()(gsl_odeiv2_step* p) const { gsl_odeiv2_step_free(p); }
        void operator()(gsl_odeiv2_control* p) const { gsl_odeiv2_control_free(p); }
    };

    static int call(double t, const double* x, double* dxdt, void* self) {
        auto& me = *static_cast<GslIntegrator*>(self);
        State out;
        me.f_({x[0], x[1]}, out, t);
        dxdt[0] = out[0];
        dxdt[1] = out[1];
        ++me.n_field_;
        return GSL_SUCCESS;
    }

    Sample advance(double h, State& error) {
        const gsl_odeiv2_system system{&call, nullptr, 2, this};
        Sample s{begin_.x, {}};
        gsl_odeiv2_step_apply(step_.get(), t_, h, s.x.data(), error.data(), begin_.dxdt.data(),
                              s.dxdt.data(), &system);
        return s;
    }

    double tol_;
    std::unique_ptr<gsl_odeiv2_step, Free> step_;
    std::unique_ptr<gsl_odeiv2_control, Free> control_;
    OneSided f_;
    double t_ = 0.0, h_ = 0.0, h_next_ = 0.0;
    Sample begin_{}, end_{};
    long n_field_ = 0;
};

} // namespace detail

/// As hand_loop, integrated by GSL's rk8pd.
inline RivalResult gsl_loop(double A, double omega, double y0, double v0, int n_periods,
                            double tol) {
    return detail::EventLoop<detail::GslIntegrator>(A, omega, y0, v0, n_periods, tol).run();
}

} // namespace filippov::rivals
