// SPDX-License-Identifier: BSD-3-Clause
// Guards: functions that are positive until their event. Which there are, and what a step shows of
// one: in numbers, or in lanes of them.
#pragma once

#include <filippov/core/scalar.hpp>

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

/// Where in a window of a slide in closed form guards are probed, if the system says how soon s may
/// turn.
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

/// Where on the path of a step a guard is sampled that keeps a pace of its own. The places are
/// nowhere farther apart than a sixteenth of the step, and keep no beat: cubic residues shift them,
/// so that no wave of up to a thousand cycles in the step looks like a slow one there.
template <class S> struct SampleTimes {
    static constexpr bool equidistant = false;
    static constexpr std::size_t n = 25; ///< samples are numbered 1 to n, the last one at the end
    static constexpr S theta(std::size_t k) { return times[k]; }
    static constexpr auto in_time = [] {
        std::array<std::size_t, n> order{};
        std::iota(order.begin(), order.end(), std::size_t(1));
        return order;
    }();

private:
    static constexpr std::array<S, n + 1> times = [] {
        std::array<S, n + 1> t{};
        for (std::size_t k = 1; k < n; ++k) {
            const long double shift = static_cast<long double>(2 * k * k * k % 43) / 43;
            t[k] = static_cast<S>((static_cast<long double>(k) - 0.25L + 0.5L * (shift - 0.5L)) /
                                  static_cast<long double>(n - 1));
        }
        t[n] = S(1);
        return t;
    }();
};

/// The number of the probe that is nearest to a place in the step, but for its end.
template <class Times> constexpr std::size_t nearest_to(double place) {
    std::size_t best = 1;
    for (std::size_t k = 2; k < Times::n; ++k) {
        const double d = static_cast<double>(Times::theta(k)) - place,
                     e = static_cast<double>(Times::theta(best)) - place;
        if ((d < 0 ? -d : d) < (e < 0 ? -e : e))
            best = k;
    }
    return best;
}

/// By how many times what n values on a step are off their cubic others may be. A method of seven
/// stages has two besides the nodes: in one of two thousand steps both are off by less than a
/// thirtieth of what swings there.
constexpr double doubt_of(std::size_t n) { return n < 10 ? 32 : 8; }

/// Where in a step a guard is known, as data: the engine does not know at compile time by which
/// method it steps.
template <class S> struct ProbeTimes {
    static constexpr std::size_t most = 32;

    std::size_t n;                         ///< values are numbered 1 to n, the last at the end
    std::array<S, most + 1> theta;         ///< where they are, in units of the step
    std::array<std::size_t, most> in_time; ///< their numbers in the order of their times
    bool equidistant;
    std::size_t near_third, near_two_thirds; ///< the nodes of a fit
    S widest_gap;                            ///< between neighbours
    std::size_t late;                        ///< one in the last part of the step,
    S before_late, behind_late; ///< and 1 over what lies before and behind it; 0 if that is nothing

    template <class Times> static constexpr ProbeTimes of() {
        static_assert(Times::n <= most, "filippov: expected a method of at most 33 stages");
        ProbeTimes times{.n = Times::n,
                         .theta = {},
                         .in_time = {},
                         .equidistant = Times::equidistant,
                         .near_third = nearest_to<Times>(1.0 / 3),
                         .near_two_thirds = nearest_to<Times>(2.0 / 3),
                         .widest_gap = S(0),
                         .late = std::max(std::size_t(1), Times::n * 2 / 3),
                         .before_late = S(0),
                         .behind_late = S(0)};
        S before(0);
        for (std::size_t i = 0; i < Times::n; ++i) {
            const std::size_t k = Times::in_time[i];
            times.in_time[i] = k;
            times.theta[k] = Times::theta(k);
            times.widest_gap = std::max(times.widest_gap, S(times.theta[k] - before));
            before = times.theta[k];
        }
        const S late = times.theta[times.late];
        times.before_late = late > S(0) ? S(1) / late : S(0);
        times.behind_late = late < S(1) ? S(1) / (S(1) - late) : S(0);
        return times;
    }
};
template <class Times, class S>
inline constexpr ProbeTimes<S> probe_times = ProbeTimes<S>::template of<Times>();

/// True if the least value of a guard on a step shows that it stays clear of zero: a parabola dips
/// below it by 0.27 of the spread of the values at most,
template <class S> FILIPPOV_INLINE auto stays_clear(const S& low, const S& spread) {
    return low > S(0.3) * spread;
}
/// and by 0.01 if they rise or fall all the way.
template <class S> FILIPPOV_INLINE auto stays_clear_if_monotone(const S& low, const S& spread) {
    return low > S(0.03) * spread;
}

/// What the cubic through four values of a guard on a step says of the others.
/// @tparam S  a number, or lanes of them
template <class S> struct Fit {
    S off = S(0);     ///< how far they are off it, at most; NaN if one is not finite
    S floor = S(0);   ///< the least Bernstein coefficient: the cubic lies above it,
    S ceiling = S(0); ///< and below the largest
    S spread = S(0);  ///< of all values
    S bend = S(0);    ///< the largest second derivative of the cubic
    double doubt = 8; ///< by how many times `off` the guard may be off it elsewhere

    /// The same where values may be off by `noise` for no reason.
    Fit without(const S& noise) const {
        Fit fit = *this;
        fit.off = select(off <= noise, S(0), off); // (a NaN stays, and excuses nothing)
        return fit;
    }
    /// True if the guard keeps away from zero: by far more than it is off its cubic, and by what
    /// is no rounding of its values.
    auto clear() const { return floor > fused(S(doubt), off, S(S(1e-6) * spread)); }
    /// Between two values beyond this, no farther apart than a gap, there is no zero.
    S far(const S& gap) const {
        return S(doubt) * off + gap * gap / S(4) * bend + S(1e-6) * spread;
    }
    /// True if the cubic is as good as the guard.
    auto resolved() const { return off <= S(0.02) * spread; }
    /// By how much a step may be longer until the guard is a twentieth of its spread off a cubic,
    /// or no longer clear of zero; the former grows with the third power of the length, the latter
    /// with the fourth.
    S room() const {
        using std::cbrt;
        using std::sqrt;
        if (!(off > S(0)))
            return off == S(0) ? std::numeric_limits<S>::infinity() : S(0);
        const S within = cbrt(S(0.05) * spread / off);
        return clear() ? std::max(within, S(sqrt(sqrt(floor / (S(doubt) * off))))) : within;
    }
    /// In lanes: where there is no room for a longer step.
    auto full() const { return ~(S(0.05) * spread > off) & ~(floor > S(80) * off); }
};

/// The fit of values v(k) at theta(k), k = 1 to n, the last one at 1, and `start` at 0. Nodes are
/// the ends and the places nearest to a third and two thirds.
/// @tparam S  a number, or lanes of them
/// @tparam R  a number
template <class S, class R, class Value>
Fit<S> fit_of(const ProbeTimes<R>& times, const S& start, const Value& v) {
    using std::abs;
    using std::max;
    using std::min;
    const std::size_t a = times.near_third, b = times.near_two_thirds, n = times.n;
    const R ta = times.theta[a], tb = times.theta[b];
    // divided differences at 0, ta, tb, 1
    const S f1 = ratio(S(v(a) - start), ta), f2 = ratio(S(v(b) - v(a)), R(tb - ta)),
            f3 = ratio(S(v(n) - v(b)), R(R(1) - tb));
    const S g1 = ratio(S(f2 - f1), tb), g2 = ratio(S(f3 - f2), R(R(1) - ta)), third = g2 - g1;
    Fit<S> fit;
    S low = start, high = start, sum(0);
    for (std::size_t k = 1; k <= n; ++k) {
        const R u = times.theta[k];
        const S value = v(k);
        low = min(low, value);
        high = max(high, value);
        sum += value;
        if (k == n || u == R(1))
            continue; // an earlier, cruder stage at the end
        const S inner = fused(S(u - tb), third, g1), slope = fused(S(u - ta), inner, f1);
        fit.off = max(fit.off, S(abs(S(value - fused(S(u), slope, start)))));
    }
    fit.off = select((sum + third) * S(0) == S(0), fit.off, S(std::numeric_limits<R>::quiet_NaN()));
    fit.spread = high - low;
    const S c1 = f1 - S(ta) * g1 + S(ta * tb) * third, c2 = g1 - S(ta + tb) * third;
    const S b1 = start + ratio(c1, R(3)), b2 = start + ratio(S(S(2) * c1 + c2), R(3));
    fit.floor = min(min(start, b1), min(b2, S(v(n))));
    fit.ceiling = max(max(start, b1), max(b2, S(v(n))));
    fit.bend = S(2) * max(S(abs(c2)), S(abs(S(fused(S(3), third, c2)))));
    fit.doubt = doubt_of(n);
    return fit;
}

template <class S> struct Range {
    S low = std::numeric_limits<S>::infinity(), high = -std::numeric_limits<S>::infinity();

    S spread() const { return high - low; }
    FILIPPOV_INLINE void include(const S& v) {
        low = std::min(low, v);
        high = std::max(high, v);
    }
};

/// What a step shows of one guard. Values are oriented: positive before the event.
template <class S> struct Trace {
    using Times = ProbeTimes<S>;

    S sense = S(0);  ///< sign of the guard before its event, 0 if not known yet
    S start = S(0);  ///< value at the start of the step
    int order = 0;   ///< order of a root at the start, to be divided out; 0: none
    S offset = S(0); ///< what rounding left at that root
    S sliver = S(0); ///< nothing nearer to that root tells of another
    bool watched = true;
    bool descended = false; ///< into its touch band in an earlier step, and has not left it yet
    // (not cleared: a run that lasts a few steps has no time for it)
    std::array<S, Times::most + 1> probe; ///< probe[k]: value at Times::theta[k]
    /// sample[k]: value on the path at SampleTimes::theta(k), of a guard with a pace of its own
    std::array<S, SampleTimes<S>::n + 1> sample;
    Range<S> seen{};       ///< start and probes of the step
    S sum = S(0);          ///< of the probes: minimum and maximum pass over NaN, this does not
    Fit<S> fit{};          ///< of probes or samples of the step, of such a guard
    bool sampled = false;  ///< in this step
    bool own_pace = false; ///< in this step no error estimate of the field resolves it

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
    FILIPPOV_INLINE Range<S> range(const Times& times) const {
        Range<S> r{start, start};
        for (std::size_t k = 1; k <= times.n; ++k)
            r.include(probe[k]);
        return r;
    }
    /// The range over a step without the root at the start. The first stages of a method are too
    /// crude to tell more than a slope: a double root is judged by the later ones.
    FILIPPOV_COLD Range<S> divided_range(const Times& times) const {
        Range<S> r;
        for (std::size_t k = 1; k <= times.n; ++k)
            if (order == 1 || times.theta[k] >= S(0.25))
                r.include(divided(probe[k], times.theta[k]));
        return r;
    }
    /// Looks at the probes of a step that is tried. (Steps of a method know their number when they
    /// are compiled.)
    FILIPPOV_INLINE void see(const Times& times) {
        seen = range(times);
        S total(0);
        for (std::size_t k = 1; k <= times.n; ++k)
            total += probe[k];
        sum = total;
    }

    /// True unless the probes show that the guard stays clear of zero.
    ///
    /// How far a smooth function dips below its smallest probe is judged by a parabola: see
    /// `stays_clear`; between equidistant probes by an eighth of the largest second difference,
    /// which is doubled here, since they may not show it, where they follow a cubic, else by twice
    /// the spread.
    FILIPPOV_INLINE bool doubtful(const Times& times) const {
        if (sense == S(0))
            return true;
        const Range<S> r = order > 0 ? divided_range(times) : seen;
        if (times.equidistant)
            return follows_cubic(times, r) ? !(r.low > S(0.25) * bend(times))
                                           : !(r.low > S(2) * r.spread());
        return !stays_clear(r.low, r.spread()) &&
               !(stays_clear_if_monotone(r.low, r.spread()) && order == 0 && turns(times) == 0);
    }

    /// How often the values turn from rising to falling or back.
    FILIPPOV_COLD int turns(const Times& times) const {
        S previous = start, last_rise(0);
        int n = 0;
        for (std::size_t i = 0; i < times.n; ++i) {
            const std::size_t k = times.in_time[i];
            if (k != times.n && times.theta[k] == S(1))
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

    /// The first probe that is not positive, if those up to it plainly fall through zero (having
    /// risen before, perhaps, but clear of it): then the root lies between it and the one before. 0
    /// if that is not so plain, or the probes are stages, whose values are not those of the
    /// solution.
    std::size_t falls_through(const Times& times) const {
        if (order > 0 || !follows_cubic(times, range(times)))
            return 0;
        const S clear = S(0.25) * bend(times);
        S previous = start;
        bool falls = false;
        for (std::size_t k = 1; k <= times.n; ++k) {
            if (falls && !(probe[k] < previous))
                return 0;
            if (!(probe[k] > S(0)))
                return falls_once(times, k) ? k : 0;
            if (!(previous > clear)) // a dip may be hidden before or behind it
                return 0;
            falls = probe[k] < previous;
            previous = probe[k];
        }
        return 0;
    }

    /// True if the cubic through the probes has one root between probe k and the one before: it has
    /// more only where it bends back in between, and is flat.
    bool falls_once(const Times& times, std::size_t k) const {
        const auto at = [&](std::size_t i) { return i == 0 ? start : probe[i]; };
        const auto second = [&](std::size_t i) { return at(i - 1) - S(2) * at(i) + at(i + 1); };
        const std::size_t n = times.n;
        const S before = k > 1 ? second(k - 1) : S(2) * second(1) - second(2),
                after = k < n ? second(k) : S(2) * second(n - 1) - second(n - 2);
        const S bends = std::max(before, -before) + std::max(after, -after);
        return !(before * after < S(0)) || at(k - 1) - at(k) > S(0.5) * bends;
    }

    /// When the guard will be zero, in units of the step from its end, if it goes on as the
    /// parabola through its start, a probe and its end; infinite if it will not, or plainly later
    /// than `within`, which is told without a division that the next step would wait for.
    FILIPPOV_INLINE S next_zero(const Times& times, const S& within) const {
        const std::size_t m = times.late;
        const S theta = times.theta[m];
        const S end = probe[times.n];
        if (falls_by(times, within) < end) [[likely]]
            return std::numeric_limits<S>::infinity();
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
    /// What that parabola falls by from the end of the step until `within`, at most.
    FILIPPOV_INLINE S falls_by(const Times& times, const S& within) const {
        const S late = probe[times.late];
        const S rise = (probe[times.n] - late) * times.behind_late;
        const S bend = rise - (late - start) * times.before_late;
        const S slope = rise + bend * (S(1) - times.theta[times.late]);
        return -within * (std::min(slope, S(0)) + within * std::min(bend, S(0)));
    }
    /// The largest second difference of equidistant values.
    S bend(const Times& times) const {
        using std::abs;
        S largest = abs(start - S(2) * probe[1] + probe[2]);
        for (std::size_t k = 1; k + 2 <= times.n; ++k)
            largest = std::max(largest, abs(probe[k] - S(2) * probe[k + 1] + probe[k + 2]));
        return largest;
    }
    /// True if equidistant probes follow a cubic: their fourth differences, 0.08 of the amplitude
    /// for half a swing and up to 16 of it for many, are small.
    bool follows_cubic(const Times& times, const Range<S>& r) const {
        if (!times.equidistant)
            return false;
        S largest(0);
        for (std::size_t k = 1; k + 4 <= times.n; ++k) {
            const S difference = probe[k] - S(4) * probe[k + 1] + S(6) * probe[k + 2] -
                                 S(4) * probe[k + 3] + probe[k + 4];
            largest = std::max({largest, difference, -difference});
        }
        return order == 0 && largest < S(0.25) * r.spread();
    }
};

} // namespace filippov
