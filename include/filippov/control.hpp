// SPDX-License-Identifier: BSD-3-Clause
// Step size control.
#pragma once

#include <filippov/scalar.hpp>

#include <algorithm>
#include <cmath>

namespace filippov {

/// PI control of the step size.
///
///   dt_next = dt * 0.9 err^-exponent err_previous^memory, kept within [min_factor, max_factor]
///
/// @source Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, (4.13) and IV.2 of
///         volume II; exponents in the tableau
template <class Tableau> class StepControl {
public:
    /// Factor for the next step after an accepted one with error `err` (1 is the tolerance).
    template <class S> S after_accept(const S& err) {
        const float e = log2_of(err);
        float exponent = -static_cast<float>(Tableau::exponent) * e;
        if constexpr (Tableau::memory > 0)
            exponent += static_cast<float>(Tableau::memory) * previous_;
        previous_ = std::max(e, smallest);
        const double largest = rejected_ ? 1.0 : Tableau::max_factor;
        rejected_ = false;
        return S(std::clamp(0.9 * double(std::exp2(exponent)), Tableau::min_factor, largest));
    }
    /// Factor for the next trial after a rejected one.
    template <class S> S after_reject(const S& err) {
        rejected_ = true;
        const float exponent = -log2_of(err) / static_cast<float>(Tableau::order);
        return S(std::clamp(0.9 * double(std::exp2(exponent)), Tableau::min_factor, 0.9));
    }

private:
    // A factor needs three digits, not sixteen: single precision and one exponential.
    template <class S> static float log2_of(const S& err) {
        return std::log2(static_cast<float>(std::clamp(err, S(1e-12f), S(1e12f))));
    }
    static constexpr float smallest = -13.3f; ///< log2(1e-4): a lucky step is soon forgotten

    float previous_ = smallest;
    bool rejected_ = false;
};

} // namespace filippov
