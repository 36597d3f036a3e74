// SPDX-License-Identifier: BSD-3-Clause
// What a run can be told.
#pragma once

#include <filippov/core/refuse.hpp>
#include <filippov/sliding/mode.hpp>

#include <concepts>
#include <limits>
#include <string>
#include <type_traits>

namespace filippov {

/// No error is judged by less. A function, since variables that are passed by reference are
/// symbols that shared libraries export.
template <std::floating_point R> constexpr R smallest_error() {
    return std::numeric_limits<R>::min() / epsilon<R>;
}

/// What the tolerance lets a component of this size err.
/// @tparam S  a number, or lanes of them
template <class S, std::floating_point R>
FILIPPOV_INLINE S error_allowed(R atol, R rtol, const S& size) {
    using std::max;
    return max(S(fused(S(rtol), size, S(atol))), S(smallest_error<R>()));
}

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

/// See GivenParams.
template <class Sys, class S> class ParamsArgument {
    using Values = Params<Sys, S>;
    static constexpr int P = params_v<Sys>;

public:
    /// The defaults.
    ParamsArgument() {
        static_assert(has_defaults_v<Sys>,
                      "filippov: `{}` for the parameters of a system that has parameters and no "
                      "`defaults`: give their values, or write `static constexpr "
                      "std::array<double, n_params> defaults`");
    }
    /// A vector, or an expression of one.
    /// @error std::invalid_argument for one of another length
    template <class Given>
        requires std::convertible_to<const Given&, Values>
    ParamsArgument(const Given& given) : values_(checked(given)), given_(true) {}
    /// One value each, in braces.
    template <class... Value>
        requires(sizeof...(Value) >= 2 && ((std::convertible_to<const Value&, S> &&
                                            !std::convertible_to<const Value&, Values>) &&
                                           ...))
    ParamsArgument(const Value&... value) : given_(true) {
        static_assert(sizeof...(Value) == P,
                      "filippov: expected one value for each of the system's `params`");
        int i = 0;
        ((values_[i++] = S(value)), ...);
    }

    /// Those of this system.
    Values of(const Sys& sys) const {
        return given_ ? values_ : all_params<S>(sys, default_values(sys));
    }

private:
    template <class Given> static const Given& checked(const Given& given) {
        if constexpr (requires { Given::SizeAtCompileTime; }) {
            constexpr int size = int(Given::SizeAtCompileTime);
            static_assert(size == Eigen::Dynamic || size == P,
                          "filippov: expected one value for each of the system's `params`");
            if (given.size() != P)
                refuse("params.size()", static_cast<long long>(given.size()),
                       "expected one value for each of the system's " + std::to_string(P) +
                           " parameters");
        }
        return given;
    }

    Values values_ = Values::Constant(S(0));
    bool given_ = false;
};

} // namespace detail

/// The parameters that a function is given: a vector, or `{}` for the system's defaults.
///
/// Public functions take them as this, so that `{}` never is a vector that nobody has filled: that
/// is what Eigen makes of it. A vector that was declared and not filled cannot be told from others.
template <class Sys, class S>
using GivenParams =
    std::type_identity_t<detail::ParamsArgument<Sys, S>>; // nothing is deduced of it

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
