// SPDX-License-Identifier: BSD-3-Clause
// Time that keeps its digits over a million periods.
#pragma once

#include <filippov/core/scalar.hpp>

#include <cmath>
#include <limits>

namespace filippov {

/// The smallest step from t that moves a clock for sure.
/// @tparam S  a number, or lanes of them
template <class S> FILIPPOV_INLINE S resolution(const S& t) { return S(4) * ulp(t); }

/// A time as (period index, local time) if the system has a period, else compensated.
///
/// The fields see `local` only. With a period it stays within one period of zero, so the phase of a
/// forcing keeps its digits for ever; without one it is the time itself, and `carry` holds what
/// rounding cut off.
template <class S> struct Clock {
    S period = S(0); ///< 0: none
    long long index = 0;
    S local = S(0);
    S carry = S(0);

    /// Periods that can be counted one by one, in any precision.
    static constexpr S most_periods = S(1LL << 52);

    /// The clock that shows absolute time t; its time is NaN if that is more than `most_periods`
    /// from zero.
    static Clock at(const S& t, const S& period) {
        using std::abs;
        using std::floor;
        using std::fma;
        Clock c;
        c.period = period;
        if (period > S(0)) {
            const S n = floor(t / period);
            if (!(abs(n) < most_periods)) {
                c.local = std::numeric_limits<S>::quiet_NaN();
                return c;
            }
            c.index = static_cast<long long>(n);
            c.local = fma(-n, period, t);
            c.wrap();
        } else {
            c.local = t;
        }
        return c;
    }

    /// Absolute time.
    S absolute() const {
        using std::fma;
        return period > S(0) ? fma(S(index), period, local) : local;
    }

    /// What to add to `local` for absolute time.
    S offset() const { return period > S(0) ? S(index) * period : S(0); }

    /// Time from this clock to `other` (of the same period), without cancellation of large indices.
    FILIPPOV_INLINE S until(const Clock& other) const {
        return S(other.index - index) * period + ((other.local - local) - carry + other.carry);
    }

    FILIPPOV_INLINE void advance(const S& dt) {
        // Neumaier: what the sum loses goes into the carry, and comes back with the next step
        const S step = dt + carry;
        const S next = local + step;
        carry = step - (next - local);
        local = next;
        if (period > S(0) && !(local >= S(0) && local < period)) [[unlikely]]
            wrap();
    }

private:
    FILIPPOV_COLD void wrap() {
        using std::abs;
        using std::floor;
        using std::fma;
        if (abs(local) > S(8) * period) { // a field that does not notice its period
            const S n = floor(local / period);
            local = fma(-n, period, local);
            index += static_cast<long long>(n);
        }
        while (local >= period)
            turn(-period, +1);
        while (local < S(0))
            turn(period, -1);
    }
    /// Adds a period; what the sum rounds off goes into the carry (Knuth's two-sum).
    void turn(const S& by, int count) {
        const S next = local + by;
        const S back = next - local;
        carry += (local - (next - back)) + (by - back);
        local = next;
        index += count;
    }
};

} // namespace filippov
