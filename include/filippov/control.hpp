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
template <class Tableau>
class StepControl {
public:
    /// Factor for the next step after an accepted one with error `err` (1 is the tolerance).
    template <class S>
    S after_accept(const S& err) {
        const float e = clamp(err);
        double factor = 0.9 * power(e, -Tableau::exponent);
        if constexpr (Tableau::memory > 0) factor *= power(previous_, Tableau::memory);
        previous_ = std::max(e, 1e-4f);
        if (rejected_) factor = std::min(factor, 1.0);
        rejected_ = false;
        return S(std::clamp(factor, Tableau::min_factor, Tableau::max_factor));
    }
    /// Factor for the next trial after a rejected one.
    template <class S>
    S after_reject(const S& err) {
        rejected_ = true;
        return S(std::clamp(0.9 * power(clamp(err), -1.0 / Tableau::order), double(Tableau::min_factor), 0.9));
    }

private:
    // A factor needs three digits, not sixteen: single precision saves a tenth of a small step.
    static float power(float base, double exponent) { return std::pow(base, static_cast<float>(exponent)); }
    template <class S>
    static float clamp(const S& err) {
        return static_cast<float>(std::clamp(err, S(1e-12f), S(1e12f)));
    }

    float previous_ = 1e-4f;
    bool rejected_ = false;
};

} // namespace filippov
