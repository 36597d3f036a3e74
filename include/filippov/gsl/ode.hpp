// SPDX-License-Identifier: BSD-3-Clause
// GSL's integrators for smoothed systems, as a second opinion. Needs the component filippov::gsl.
//
// This file is permissive like the rest; GSL is GPL, and so is, as a whole, a program that links
// it.
#pragma once

#include <filippov/core/status.hpp>
#include <filippov/methods/rosenbrock.hpp>
#include <filippov/run/settings.hpp>
#include <filippov/system/system.hpp>

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <cmath>
#include <memory>
#include <mutex>
#include <string>

namespace filippov::gsl {

/// GSL's methods by their names. The implicit ones and bsimp use exact Jacobians.
enum class Method : unsigned char {
    msbdf,   ///< backward differences of orders 1 to 5, Newton's method
    msadams, ///< Adams, functional iteration: not for stiff systems
    bsimp,   ///< Bader and Deuflhard's implicit extrapolation
    rk4imp,  ///< Gaussian Runge-Kutta of order 4
    rk2imp,  ///< ... of order 2
    rk1imp,  ///< implicit Euler
    rk8pd,   ///< Prince-Dormand 8(9), explicit
};

/// What a run is told.
struct Settings {
    double rtol = 1e-8, atol = 1e-10; ///< of the local error; 0 < rtol < 1, atol >= 0
    double first_step = 1e-6;         ///< units of t, > 0
    long long max_steps = 1'000'000;  ///< > 0
};

/// Where a run ended.
template <int N> struct Result {
    Status status = Status::ok; ///< not_converged: GSL gave up
    double t = 0;
    Vec<double, N> x;
    long long steps = 0, field = 0, jacobians = 0;
    std::string reason{}; ///< GSL's own words, if it gave up

    /// What happened.
    std::string message() const {
        const std::string said(filippov::message(status));
        return reason.empty() ? said : said + " GSL says: " + reason + ".";
    }
};

namespace detail {

/// GSL's error handler ends the process; while one of these lives it is off. The handler is global,
/// so that runs on several threads share it.
class NoAbort {
public:
    NoAbort() {
        const std::lock_guard lock(guard());
        if (count()++ == 0)
            before() = gsl_set_error_handler_off();
    }
    ~NoAbort() {
        const std::lock_guard lock(guard());
        if (--count() == 0)
            gsl_set_error_handler(before());
    }
    NoAbort(const NoAbort&) = delete;
    NoAbort& operator=(const NoAbort&) = delete;

private:
    static std::mutex& guard() {
        static std::mutex m;
        return m;
    }
    static int& count() {
        static int n = 0;
        return n;
    }
    static gsl_error_handler_t*& before() {
        static gsl_error_handler_t* handler = nullptr;
        return handler;
    }
};

inline const gsl_odeiv2_step_type* step_type(Method method) {
    switch (method) {
    case Method::msbdf:
        return gsl_odeiv2_step_msbdf;
    case Method::msadams:
        return gsl_odeiv2_step_msadams;
    case Method::bsimp:
        return gsl_odeiv2_step_bsimp;
    case Method::rk4imp:
        return gsl_odeiv2_step_rk4imp;
    case Method::rk2imp:
        return gsl_odeiv2_step_rk2imp;
    case Method::rk1imp:
        return gsl_odeiv2_step_rk1imp;
    default:
        return gsl_odeiv2_step_rk8pd;
    }
}

/// A system as GSL calls it.
template <class Sys> struct Calls {
    static constexpr int N = dim_v<Sys>;
    const Sys& sys;
    const Params<Sys, double> p;
    Result<N>& result;

    static int field(double t, const double* x, double* f, void* self) {
        auto& me = *static_cast<Calls*>(self);
        ++me.result.field;
        const Vec<double, N> at = Eigen::Map<const Vec<double, N>>(x);
        const Vec<double, N> value = me.sys.f(t, at, me.p);
        Eigen::Map<Vec<double, N>> out(f);
        out = value;
        return value.allFinite() ? GSL_SUCCESS : GSL_EBADFUNC;
    }
    static int jacobian(double t, const double* x, double* by_x, double* by_t, void* self) {
        auto& me = *static_cast<Calls*>(self);
        ++me.result.jacobians;
        const auto f = [&](const auto& time, const auto& y, const auto& q) {
            return me.sys.f(time, y, q);
        };
        const Slopes<double, N> slopes =
            slopes_of(f, t, Vec<double, N>(Eigen::Map<const Vec<double, N>>(x)), me.p);
        for (int i = 0; i < N; ++i) {
            by_t[i] = slopes.by_t[i];
            for (int k = 0; k < N; ++k)
                by_x[i * N + k] = slopes.by_x(i, k);
        }
        return GSL_SUCCESS;
    }
};

} // namespace detail

/// Follows a system with one smooth field, `f(t, x, p)`, by a method of GSL.
///
/// GSL's step control knows nothing of the layer of a smoothed system: unlike the library's own
/// runs these may miss it and still end with status ok. Errors of GSL are statuses here, and never
/// end the process.
/// @param sys  `smoothed(...)`, for instance
/// @error std::invalid_argument for arguments that make no sense; else a Status
template <class Sys>
    requires HasOneField<Sys, double>
Result<dim_v<Sys>> run(Method method, const Sys& sys, const GivenParams<Sys, double>& params,
                       const Vec<double, dim_v<Sys>>& x0, double t0, double t_end,
                       const Settings& settings = {}) {
    constexpr int N = dim_v<Sys>;
    filippov::Settings<double, N> checked;
    checked.rtol = settings.rtol;
    checked.atol = AbsoluteTolerance<double, N>(settings.atol);
    checked.max_steps = settings.max_steps;
    validate(checked);
    const Params<Sys, double> p = params.of(sys);
    validate_start(x0, t0, t_end, p, given_params(sys));
    if (!(settings.first_step > 0 && std::isfinite(settings.first_step)))
        filippov::detail::refuse("first_step", settings.first_step, "expected a finite number > 0");

    const detail::NoAbort no_abort;
    Result<N> result;
    result.t = t0;
    result.x = x0;
    detail::Calls<Sys> calls{sys, p, result};
    gsl_odeiv2_system system{&detail::Calls<Sys>::field, &detail::Calls<Sys>::jacobian, N, &calls};
    const std::unique_ptr<gsl_odeiv2_driver, void (*)(gsl_odeiv2_driver*)> driver(
        gsl_odeiv2_driver_alloc_y_new(&system, detail::step_type(method),
                                      t_end < t0 ? -settings.first_step : settings.first_step,
                                      settings.atol, settings.rtol),
        &gsl_odeiv2_driver_free);
    if (!driver) {
        result.status = Status::not_converged;
        result.reason = "no memory, or a method that it does not know";
        return result;
    }
    gsl_odeiv2_driver_set_nmax(driver.get(), static_cast<unsigned long>(settings.max_steps));
    const int code = gsl_odeiv2_driver_apply(driver.get(), &result.t, t_end, result.x.data());
    result.steps = static_cast<long long>(driver->n);
    if (code == GSL_EMAXITER)
        result.status = Status::max_steps;
    else if (code == GSL_EBADFUNC)
        result.status = Status::not_finite;
    else if (code == GSL_ENOPROG)
        result.status = Status::step_too_small;
    else if (code != GSL_SUCCESS)
        result.status = Status::not_converged;
    else if (!result.x.allFinite())
        result.status = Status::not_finite;
    if (code != GSL_SUCCESS)
        result.reason = gsl_strerror(code);
    return result;
}

} // namespace filippov::gsl
