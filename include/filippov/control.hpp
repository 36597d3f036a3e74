// SPDX-License-Identifier: BSD-3-Clause
// Step size control.
#pragma once

#include <filippov/scalar.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace filippov {

/// PI control of the step size, from the square of the error in units of the tolerance.
///
///   dt_next = dt * safety err^-exponent err_previous^memory, kept within [min_factor, max_factor]
///
/// @source Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, (4.13) and IV.2 of
///         volume II; exponents in the tableau
template <class Tableau> class StepControl {
public:
    /// Factor for the next step after an accepted one.
    double after_accept(double squared_error) {
        const double e = log2_of(squared_error);
        double exponent = -0.5 * Tableau::exponent * e;
        if constexpr (Tableau::memory > 0)
            exponent += 0.5 * Tableau::memory * previous_;
        previous_ = std::max(e, smallest);
        const double largest = rejected_ ? 1.0 : Tableau::max_factor;
        rejected_ = false;
        return std::clamp(safety * exp2_of(exponent), Tableau::min_factor, largest);
    }
    /// Factor for the next trial after a rejected one.
    double after_reject(double squared_error) {
        rejected_ = true;
        const double exponent = -0.5 / Tableau::order * log2_of(squared_error);
        return std::clamp(safety * exp2_of(exponent), Tableau::min_factor, 0.9);
    }

private:
    // A factor needs two digits, and the next step waits for it: the bits of a floating-point
    // number are its logarithm, linear between powers of two. That makes the factor 0 to 6 % too
    // large. Beside the usual 0.9, 0.8 saves a tenth of the work of the 8th-order pair at equal
    // error: fewer steps are rejected where a contact is near.
    static constexpr double safety = 0.8;
    static constexpr double octave = 0x1p52;     ///< bits from 1 to 2
    static constexpr double one = 1023 * octave; ///< bits of 1

    static double log2_of(double v) {
        return (static_cast<double>(std::bit_cast<std::int64_t>(v)) - one) / octave;
    }
    static double exp2_of(double v) {
        return std::bit_cast<double>(static_cast<std::int64_t>(v * octave + one));
    }

    static constexpr double smallest = -26.6; ///< log2(1e-8): a lucky step is soon forgotten

    double previous_ = smallest;
    bool rejected_ = false;
};

} // namespace filippov
