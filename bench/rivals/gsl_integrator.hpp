// SPDX-License-Identifier: BSD-3-Clause
//
// GSL's steppers for the loops of this folder. They have no dense output: a transition is located
// by taking the step again with another length, which keeps its order.

#pragma once

#include "sample.hpp"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <array>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

namespace filippov::rivals::detail {

/// Prince-Dormand 8(9), explicit.
struct GslRk8pd {
    static constexpr bool implicit = false;
    static const gsl_odeiv2_step_type* type() { return gsl_odeiv2_step_rk8pd; }
};
/// Bader and Deuflhard's implicit extrapolation: asks for the field's `jacobian` and `time_slope`.
struct GslBsimp {
    static constexpr bool implicit = true;
    static const gsl_odeiv2_step_type* type() { return gsl_odeiv2_step_bsimp; }
};

/// What GSL calls back, for a field over plain arrays; the parameter is the field.
template <class Field> struct GslCalls {
    static constexpr std::size_t N = std::tuple_size_v<typename Field::State>;

    static int field(double t, const double* x, double* dxdt, void* field) {
        static_cast<const Field*>(field)->rates(t, x, dxdt);
        return GSL_SUCCESS;
    }
    /// Row by row, where the field's own is column by column.
    static int jacobian(double t, const double* x, double* by_x, double* by_t, void* field) {
        const Field& f = *static_cast<const Field*>(field);
        std::array<double, N * N> by_column;
        f.jacobian(t, x, by_column.data());
        for (std::size_t i = 0; i < N; ++i)
            for (std::size_t j = 0; j < N; ++j)
                by_x[i * N + j] = by_column[j * N + i];
        f.time_slope(t, x, by_t);
        return GSL_SUCCESS;
    }
};

template <class Field, class Method = GslRk8pd> class GslIntegrator {
public:
    using State = typename Field::State;
    using Sample = detail::Sample<State>;
    static constexpr std::size_t N = std::tuple_size_v<State>;

    explicit GslIntegrator(double tol)
        : tol_(tol), step_(gsl_odeiv2_step_alloc(Method::type(), N)),
          control_(gsl_odeiv2_control_standard_new(tol, tol, 1.0, 0.0)) {}

    double first_step() const { return 0.3 * std::pow(tol_, 1.0 / 9); }

    void start(const Field& f, double t, const State& x, const State& dxdt) {
        static_cast<Field&>(f_) = f;
        t_ = t;
        begin_ = {x, dxdt};
    }

    bool attempt(double h) {
        h_ = h_next_ = h;
        State error;
        const bool done = advance(h, end_, error);
        if (!done) { // implicit methods may fail to solve for a step
            h_next_ = 0.5 * h;
            return false;
        }
        const int result = gsl_odeiv2_control_hadjust(control_.get(), step_.get(), end_.x.data(),
                                                      error.data(), end_.dxdt.data(), &h_next_);
        return result != GSL_ODEIV_HADJ_DEC;
    }

    Sample at(double theta) {
        State error;
        Sample s;
        advance(theta * h_, s, error);
        return s;
    }

    void accept(double t) {
        std::swap(begin_, end_);
        t_ = t;
    }

    const Sample& begin() const { return begin_; }
    const Sample& end() const { return end_; }
    double h_next() const { return h_next_; }
    long n_field() const { return f_.n_field; }

private:
    struct Counted : Field {
        mutable long n_field = 0;
        void rates(double t, const double* x, double* dxdt) const {
            Field::rates(t, x, dxdt);
            ++n_field;
        }
    };

    struct Free {
        void operator()(gsl_odeiv2_step* p) const { gsl_odeiv2_step_free(p); }
        void operator()(gsl_odeiv2_control* p) const { gsl_odeiv2_control_free(p); }
    };

    bool advance(double h, Sample& s, State& error) {
        gsl_odeiv2_system system{&GslCalls<Counted>::field, nullptr, N, &f_};
        if constexpr (Method::implicit)
            system.jacobian = &GslCalls<Counted>::jacobian;
        s.x = begin_.x;
        return gsl_odeiv2_step_apply(step_.get(), t_, h, s.x.data(), error.data(),
                                     begin_.dxdt.data(), s.dxdt.data(), &system) == GSL_SUCCESS;
    }

    double tol_;
    std::unique_ptr<gsl_odeiv2_step, Free> step_;
    std::unique_ptr<gsl_odeiv2_control, Free> control_;
    Counted f_{};
    double t_ = 0.0, h_ = 0.0, h_next_ = 0.0;
    Sample begin_{}, end_{};
};

} // namespace filippov::rivals::detail
