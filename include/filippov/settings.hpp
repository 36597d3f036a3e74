// SPDX-License-Identifier: BSD-3-Clause
// What a run can be told.
#pragma once

#include <filippov/mode.hpp>

#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

namespace filippov {

/// Absolute tolerance: one number for all components, or one each.
template <class S, int N> struct AbsoluteTolerance : Vec<S, N> {
    AbsoluteTolerance(S each = S(1e-10)) : Vec<S, N>(Vec<S, N>::Constant(each)) {}
    AbsoluteTolerance(const Vec<S, N>& per_component) : Vec<S, N>(per_component) {}
};

/// Settings of a run; an aggregate, so `{.rtol = 1e-9, .atol = 1e-12}` works.
template <class S, int N> struct Settings {
    S rtol = S(1e-8);               ///< relative tolerance of the local error, > 0
    AbsoluteTolerance<S, N> atol{}; ///< absolute tolerance, units of x, >= 0; default 1e-10
    S max_step = std::numeric_limits<S>::infinity(); ///< largest step, units of t, > 0
    S first_step = S(0);                             ///< first step, units of t; 0: automatic
    S fixed_step = S(0);                      ///< > 0: steps of this size and no error control
    long long max_steps = 100'000'000;        ///< attempted steps in the whole run, > 0
    long long max_events = 10'000'000;        ///< events in the whole run, > 0
    NonUnique on_nonunique = NonUnique::stop; ///< what to do where the solution is not unique
    bool skip_root_search =
        true; ///< false: look for events in every step (to measure what the skip saves)
    bool closed_form_slides =
        true; ///< false: integrate slides even if the system knows them in closed form
};

namespace detail {

/// Throws std::invalid_argument with "argument = value: expectation".
template <class Number>
[[noreturn]] void refuse(const std::string& argument, Number value,
                         const std::string& expectation) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%Lg", static_cast<long double>(value));
    throw std::invalid_argument("filippov: " + argument + " = " + digits + ": " + expectation);
}
inline void require_positive(const std::string& argument, long long n) {
    if (!(n > 0))
        refuse(argument, n, "expected an integer > 0");
}

} // namespace detail

/// Refuses settings that make no sense, before any work.
/// @error std::invalid_argument naming argument, value and expectation
template <class S, int N> void validate(const Settings<S, N>& s) {
    constexpr S inf = std::numeric_limits<S>::infinity();
    if (!(s.rtol > S(0) && s.rtol < S(1)))
        detail::refuse("rtol", s.rtol, "expected 0 < rtol < 1");
    for (int i = 0; i < N; ++i)
        if (!(s.atol[i] >= S(0) && s.atol[i] < inf))
            detail::refuse("atol[" + std::to_string(i) + "]", s.atol[i],
                           "expected a finite number >= 0");
    if (!(s.max_step > S(0)))
        detail::refuse("max_step", s.max_step, "expected a number > 0");
    if (!(s.first_step >= S(0) && s.first_step < inf))
        detail::refuse("first_step", s.first_step, "expected a finite number >= 0 (0: automatic)");
    if (!(s.fixed_step >= S(0) && s.fixed_step < inf))
        detail::refuse("fixed_step", s.fixed_step, "expected a finite number >= 0 (0: adaptive)");
    detail::require_positive("max_steps", s.max_steps);
    detail::require_positive("max_events", s.max_events);
}

/// Refuses a start, parameters or a time span that make no sense.
/// @param given  how many of the parameters are the caller's
/// @error std::invalid_argument naming argument, value and expectation
template <class S, int N, int P>
void validate_start(const Vec<S, N>& x0, const S& t0, const S& t_end, const Vec<S, P>& p,
                    int given) {
    using std::isfinite;
    for (int i = 0; i < N; ++i)
        if (!isfinite(x0[i]))
            detail::refuse("x0[" + std::to_string(i) + "]", x0[i], "expected a finite number");
    for (int i = 0; i < given; ++i)
        if (!isfinite(p[i]))
            detail::refuse("params[" + std::to_string(i) + "]", p[i], "expected a finite number");
    if (!isfinite(t0))
        detail::refuse("t0", t0, "expected a finite number");
    if (!isfinite(t_end))
        detail::refuse("t_end", t_end, "expected a finite number");
}

} // namespace filippov
