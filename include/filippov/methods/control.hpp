// SPDX-License-Identifier: BSD-3-Clause
// Step size control.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

namespace filippov {

namespace detail {

// A factor needs two digits, and the next step waits for it: the bits of a floating-point number
// are its logarithm, linear between powers of two. That makes the factor 0 to 6 % too large.
inline double number_of_bits(double v) {
    return static_cast<double>(std::bit_cast<std::int64_t>(v));
}
inline double with_bits(double v) { return std::bit_cast<double>(static_cast<std::int64_t>(v)); }

inline constexpr double octave = 0x1p52;             ///< bits from 1 to 2
inline constexpr double bits_of_one = 1023 * octave; ///< bits of 1

template <class S> FILIPPOV_INLINE S log2_of(const S& v) {
    return (number_of_bits(v) - bits_of_one) * S(1 / octave);
}
template <class S> FILIPPOV_INLINE S exp2_of(const S& v) {
    return with_bits(S(v * S(octave) + S(bits_of_one)));
}

} // namespace detail

/// A step to be tried.
/// @tparam S  a number, or lanes of them
template <class S> struct Trial {
    using Mask = decltype(std::declval<S>() < std::declval<S>());
    S dt;      ///< its length
    Mask last; ///< it ends where the run does
    Mask cut;  ///< it goes no farther than `reach`
};
/// All of them lengths.
/// @param proposal  by the last step's error
/// @param reach     where the next surface is foreseen
/// @param left      to the end of the run: no step ends shortly before that
template <class S>
FILIPPOV_INLINE Trial<S> next_trial(const S& proposal, const S& longest, const S& reach,
                                    const S& left) {
    using std::min;
    const S wanted = min(proposal, longest), dt = min(wanted, reach);
    const auto last = dt >= left * S(1 - 1e-9);
    return {select(last, left, dt), last, reach < wanted};
}

/// PI control of the step size, from the square of the error in units of the tolerance.
///
///   dt_next = dt * safety err^-exponent err_previous^memory, kept within [min_factor, max_factor]
///
/// @tparam Method  a tableau, or MethodFacts: order, exponent, memory, min_factor, max_factor
/// @tparam S       double, or lanes of them, each with its own control
/// @source Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, (4.13) and IV.2 of
///         volume II; exponents in the tableau
template <class Method, class S = double> class StepControl {
public:
    [[no_unique_address]] Method method{};
    S previous = S(smallest);         ///< log2 of the last accepted step's squared error
    S largest = S(method.max_factor); ///< factor: 1 right after a rejection

    /// Factor for the next step after one that is accepted, or for the next trial.
    template <class Mask> FILIPPOV_INLINE S factor(const S& squared_error, const Mask& accepted) {
        using std::max;
        using std::min;
        const S e = detail::log2_of(squared_error);
        const S proportional = select(accepted, S(-0.5 * method.exponent), S(-0.5 / method.order));
        S exponent = proportional * e;
        if (method.memory > 0)
            exponent = fused(select(accepted, S(0.5 * method.memory), S(0)), previous, exponent);
        const S most = select(accepted, largest, S(0.9));
        previous = select(accepted, max(e, S(smallest)), previous);
        largest = select(accepted, S(method.max_factor), S(1));
        return min(max(S(safety) * detail::exp2_of(exponent), S(method.min_factor)), most);
    }
    S after_accept(const S& squared_error) { return factor(squared_error, true); }
    S after_reject(const S& squared_error) { return factor(squared_error, false); }

private:
    // Beside the usual 0.9, 0.8 saves a tenth of the work of the 8th-order pair at equal error:
    // fewer steps are rejected where a contact is near.
    static constexpr double safety = 0.8;
    static constexpr double smallest = -26.6; ///< log2(1e-8): a lucky step is soon forgotten
};

} // namespace filippov
