// SPDX-License-Identifier: BSD-3-Clause
// Guards: functions that are positive until their event. Which there are, and what a step shows of
// one.
#pragma once

#include <filippov/scalar.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <type_traits>

namespace filippov {

/// The guards of a mode, numbered.
///
/// Surface j owns three: 3j is side * h_j off the surface and s_max + s on it; 3j+1 is s_max - s;
/// 3j+2 is the transversality L1 - L2, oriented. User sections follow after 3M.
template <int M> struct Guard {
    static constexpr int below(int j) { return 3 * j; }
    static constexpr int above(int j) { return 3 * j + 1; }
    static constexpr int transversal(int j) { return 3 * j + 2; }
    static constexpr int first_section = 3 * M;
};

/// Where in a step guards are probed: at the stages of a method.
template <class Tableau, class S> struct StageTimes {
    static constexpr bool equidistant = false;
    static constexpr std::size_t n = Tableau::stages - 1; ///< probes are numbered 1 to n
    static constexpr S theta(std::size_t k) { return static_cast<S>(Tableau::c[k]); }
    /// The probes in the order of their times.
    static constexpr auto in_time = [] {
        std::array<std::size_t, n> order{};
        std::iota(order.begin(), order.end(), std::size_t(1));
        std::sort(order.begin(), order.end(),
                  [](std::size_t a, std::size_t b) { return Tableau::c[a] < Tableau::c[b]; });
        return order;
    }();
};

/// Where in a window of a slide in closed form guards are probed.
template <class S> struct WindowTimes {
    static constexpr bool equidistant = true;
    static constexpr std::size_t n = 6;
    static constexpr S theta(std::size_t k) { return S(k) / S(n); }
    static constexpr std::array<std::size_t, n> in_time{1, 2, 3, 4, 5, 6};
};

/// Where in a step of a method guards are probed: at its stages, or, where these are too crude, on
/// its interpolant.
template <class Tableau, class S, int N>
using StepTimes = std::conditional_t<Tableau::template Stepper<S, N>::probes_stages,
                                     StageTimes<Tableau, S>, WindowTimes<S>>;

template <class S> struct Range {
    S low = std::numeric_limits<S>::infinity(), high = -std::numeric_limits<S>::infinity();

    S spread() const { return high - low; }
    FILIPPOV_INLINE void include(const S& v) {
        low = std::min(low, v);
        high = std::max(high, v);
    }
};

/// What a step shows of one guard. Values are oriented: positive before the event.
template <class S, std::size_t Capacity> struct Trace {
    S sense = S(0);  ///< sign of the guard before its event, 0 if not known yet
    S start = S(0);  ///< value at the start of the step
    int order = 0;   ///< order of a root at the start, to be divided out; 0: none
    S offset = S(0); ///< what rounding left at that root
    bool watched = true;
    bool descended = false; ///< into its touch band in an earlier step, and has not left it yet
    std::array<S, Capacity> probe{}; ///< probe[k]: value at Times::theta(k)

    void start_at(const S& value, int root_order = 0) {
        start = value;
        order = root_order;
        offset = S(0);
        descended = false;
    }

    /// A value at theta without the root at the start.
    S divided(const S& v, const S& theta) const {
        S r = (v - offset) / theta;
        for (int k = 1; k < order; ++k)
            r /= theta;
        return r;
    }

    /// The range over a step, start and probes.
    template <class Times> FILIPPOV_INLINE Range<S> range() const {
        Range<S> r{start, start};
        for (std::size_t k = 1; k <= Times::n; ++k)
            r.include(probe[k]);
        return r;
    }
    /// The range over a step without the root at the start. The first stages of a method are too
    /// crude to tell more than a slope: a double root is judged by the later ones.
    template <class Times> FILIPPOV_COLD Range<S> divided_range() const {
        Range<S> r;
        for (std::size_t k = 1; k <= Times::n; ++k)
            if (order == 1 || Times::theta(k) >= S(0.25))
                r.include(divided(probe[k], Times::theta(k)));
        return r;
    }
    /// Minimum and maximum pass over NaN; the sum does not.
    template <class Times> FILIPPOV_INLINE S sum() const {
        S total(0);
        for (std::size_t k = 1; k <= Times::n; ++k)
            total += probe[k];
        return total;
    }

    /// True unless the probes show that the guard stays clear of zero.
    ///
    /// How far a smooth function dips below its smallest probe is judged by a parabola: 0.27 of the
    /// spread of the probes at most, and 0.01 if they rise or fall all the way; between equidistant
    /// probes an eighth of the largest second difference, which is doubled here, since they may not
    /// show it.
    /// @param may_swing  nothing bounds the length of the step against the guard's swings
    template <class Times> FILIPPOV_INLINE bool doubtful(bool may_swing) const {
        if (sense == S(0))
            return true;
        const Range<S> r = order > 0 ? divided_range<Times>() : range<Times>();
        if (may_swing && !follows_cubic<Times>(r))
            return !(r.low > S(2) * r.spread());
        if (Times::equidistant && order == 0)
            return !(r.low > S(0.25) * bend<Times>());
        return !(r.low > S(0.3) * r.spread()) &&
               !(r.low > S(0.03) * r.spread() && order == 0 && turns<Times>() == 0);
    }

    /// True if the probes turn within reach of zero. They may be those of a whole swing, of which
    /// half is hidden.
    template <class Times> FILIPPOV_COLD bool turns_near_zero() const {
        const Range<S> r = range<Times>();
        return !(r.low > S(2) * r.spread()) && turns<Times>() > 0;
    }

    /// How often the values turn from rising to falling or back.
    template <class Times> FILIPPOV_COLD int turns() const {
        S previous = start, last_rise(0);
        int n = 0;
        for (const std::size_t k : Times::in_time) {
            if (k != Times::n && Times::theta(k) == S(1))
                continue; // an earlier, cruder stage at the end
            const S rise = probe[k] - previous;
            if (rise == S(0))
                continue;
            n += rise * last_rise < S(0);
            last_rise = rise;
            previous = probe[k];
        }
        return n;
    }

    /// How far values at Times::theta(k), k = 1 to n - 1, are off the parabola through the start,
    /// one of them and the end, in units of their spread; 0 if that is no more than `noise`.
    template <class Times, class Value>
    FILIPPOV_COLD S off_parabola(const Value& value, const S& end, const S& noise) const {
        using std::abs;
        constexpr std::size_t m = Times::n * 2 / 3;
        constexpr S theta = Times::theta(m);
        const S chord = end - start;
        const S bend = (value(m) - start - theta * chord) / (theta * (S(1) - theta));
        S largest(0);
        Range<S> r{std::min(start, end), std::max(start, end)};
        for (std::size_t k = 1; k < Times::n; ++k) {
            const S u = Times::theta(k), v = value(k);
            largest = std::max(largest, S(abs(v - start - u * (chord + (S(1) - u) * bend))));
            r.include(v);
        }
        return largest > noise ? largest / r.spread() : S(0);
    }

    /// True if the step shows more than one swing that could reach zero, wider than `band`.
    template <class Times> bool swings(const S& band) const {
        const Range<S> r = range<Times>();
        return !(r.low > S(2) * r.spread()) && r.spread() > band && turns<Times>() > 1;
    }

    /// The first probe that is not positive, if those up to it plainly fall through zero (having
    /// risen before, perhaps, but clear of it): then the root lies between it and the one before. 0
    /// if that is not so plain, or the probes are stages, whose values are not those of the
    /// solution.
    template <class Times> std::size_t falls_through() const {
        if (order > 0 || !follows_cubic<Times>(range<Times>()))
            return 0;
        const S clear = S(0.25) * bend<Times>();
        S previous = start;
        bool falls = false;
        for (std::size_t k = 1; k <= Times::n; ++k) {
            if (falls && !(probe[k] < previous))
                return 0;
            if (!(probe[k] > S(0)))
                return falls_once<Times>(k) ? k : 0;
            if (!(previous > clear)) // a dip may be hidden before or behind it
                return 0;
            falls = probe[k] < previous;
            previous = probe[k];
        }
        return 0;
    }

    /// True if the cubic through the probes has one root between probe k and the one before: it has
    /// more only where it bends back in between, and is flat.
    template <class Times> bool falls_once(std::size_t k) const {
        const auto at = [&](std::size_t i) { return i == 0 ? start : probe[i]; };
        const auto second = [&](std::size_t i) { return at(i - 1) - S(2) * at(i) + at(i + 1); };
        constexpr std::size_t n = Times::n;
        const S before = k > 1 ? second(k - 1) : S(2) * second(1) - second(2),
                after = k < n ? second(k) : S(2) * second(n - 1) - second(n - 2);
        const S bends = std::max(before, -before) + std::max(after, -after);
        return !(before * after < S(0)) || at(k - 1) - at(k) > S(0.5) * bends;
    }

    /// When the guard will be zero, in units of the step from its end, if it goes on as the
    /// parabola through its start, a probe and its end; infinite if it will not.
    template <class Times> FILIPPOV_INLINE S next_zero() const {
        constexpr std::size_t m = Times::n * 2 / 3;
        constexpr S theta = Times::theta(m);
        const S end = probe[Times::n];
        // value / end = 1 + slope u + bend u^2, u = theta - 1
        const S rise = (S(1) - probe[m] / end) / (S(1) - theta);
        const S bend = rise - (probe[m] - start) / (end * theta);
        const S slope = rise + bend * (S(1) - theta);
        const S discriminant = slope * slope - S(4) * bend;
        using std::sqrt;
        const S denominator = sqrt(std::max(discriminant, S(0))) - slope;
        return discriminant >= S(0) && denominator > S(0) && end > S(0)
                   ? S(2) / denominator
                   : std::numeric_limits<S>::infinity();
    }

private:
    /// The largest second difference of equidistant values.
    template <class Times> S bend() const {
        using std::abs;
        S largest = abs(start - S(2) * probe[1] + probe[2]);
        for (std::size_t k = 1; k + 2 <= Times::n; ++k)
            largest = std::max(largest, abs(probe[k] - S(2) * probe[k + 1] + probe[k + 2]));
        return largest;
    }
    /// True if equidistant probes follow a cubic: their fourth differences, 0.08 of the amplitude
    /// for half a swing and up to 16 of it for many, are small.
    template <class Times> bool follows_cubic(const Range<S>& r) const {
        if constexpr (!Times::equidistant)
            return false;
        S largest(0);
        for (std::size_t k = 1; k + 4 <= Times::n; ++k) {
            const S difference = probe[k] - S(4) * probe[k + 1] + S(6) * probe[k + 2] -
                                 S(4) * probe[k + 3] + probe[k + 4];
            largest = std::max({largest, difference, -difference});
        }
        return order == 0 && largest < S(0.25) * r.spread();
    }
};

} // namespace filippov
