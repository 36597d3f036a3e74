// SPDX-License-Identifier: BSD-3-Clause
// What a step of every lane shows of its guard: the tests of guards.hpp without branches.
#pragma once

#include <filippov/core/lanes.hpp>
#include <filippov/events/guards.hpp>
#include <filippov/events/roots.hpp>

#include <array>

namespace filippov::lanes {

template <int W> inline Lanes<W> infinity() { return std::numeric_limits<double>::infinity(); }

/// A guard at the start of a step, and at its probes: numbers 1 to Times::n.
template <class Times, int W> struct Probed {
    Lanes<W> start; ///< where order > 0: what rounding left at the root
    Lanes<W> order; ///< of a root at the start, 0: none
    std::array<Lanes<W>, Times::n + 1> probe;

    const Lanes<W>& end() const { return probe[Times::n]; }

    /// Where the probes do not show that the guard stays clear of zero: see Trace::doubtful.
    FILIPPOV_INLINE LaneMask<W> doubtful() const {
        using T = Lanes<W>;
        const Range r = range();
        const T spread = r.spread();
        LaneMask<W> clear = stays_clear(r.low, spread);
        const LaneMask<W> perhaps = ~clear & stays_clear_if_monotone(r.low, spread);
        if (any(perhaps))
            clear = clear | (perhaps & monotone());
        const LaneMask<W> rooted = order > T(0);
        if (!any(rooted))
            return ~clear;
        return ~((rooted & divided_clear()) | (~rooted & clear));
    }

    /// The range over a step, start and probes.
    struct Range {
        Lanes<W> low, high;
        Lanes<W> spread() const { return high - low; }
    };
    FILIPPOV_INLINE Range range() const {
        Range r{start, start};
        for (std::size_t k = 1; k <= Times::n; ++k) {
            r.low = min(r.low, probe[k]);
            r.high = max(r.high, probe[k]);
        }
        return r;
    }
    /// How often the values turn from rising to falling or back.
    FILIPPOV_INLINE Lanes<W> turns() const {
        using T = Lanes<W>;
        T previous = start, last(0), n(0);
        for (const std::size_t k : Times::in_time) {
            if (k != Times::n && Times::theta(k) == 1.0)
                continue; // an earlier, cruder stage at the end
            const T change = probe[k] - previous;
            n += select(change * last < T(0), T(1), T(0));
            last = select(change == T(0), last, change);
            previous = probe[k];
        }
        return n;
    }

    /// How far the next step should go: a fifth beyond the contact that a parabola through this one
    /// foresees: see Trace::next_zero.
    FILIPPOV_INLINE Lanes<W> reach(const Lanes<W>& dt, const Lanes<W>& least) const {
        using T = Lanes<W>;
        constexpr std::size_t m = Times::n * 2 / 3;
        constexpr double theta = Times::theta(m);
        // h(u) = end + slope u + bend u^2, u = theta - 1
        const T rise = (end() - probe[m]) * T(1 / (1 - theta));
        const T bend = fused(probe[m] - start, T(-1 / theta), rise);
        const T slope = fused(bend, T(1 - theta), rise);
        const T discriminant = fused(slope, slope, T(-4) * bend * end());
        const T denominator = sqrt(max(discriminant, T(0))) - slope;
        const LaneMask<W> comes =
            (discriminant >= T(0)) & (denominator > T(0)) & (end() > T(0)) & (order == T(0));
        return select(comes, max(T(2.4) * end() * dt / denominator, least), infinity<W>());
    }

    /// Where it falls from probe to probe, and there was no root at the start.
    FILIPPOV_INLINE LaneMask<W> falls() const {
        using T = Lanes<W>;
        return (order == T(0)) & (changes().fall >= T(0));
    }

private:
    FILIPPOV_INLINE LaneMask<W> monotone() const {
        const Changes c = changes();
        return (c.rise >= Lanes<W>(0)) | (c.fall >= Lanes<W>(0));
    }
    /// The least rise and the least fall from one probe to the next.
    struct Changes {
        Lanes<W> rise, fall;
    };
    FILIPPOV_INLINE Changes changes() const {
        using T = Lanes<W>;
        Changes least{infinity<W>(), infinity<W>()};
        T previous = start;
        for (const std::size_t k : Times::in_time) {
            if (k != Times::n && Times::theta(k) == 1.0)
                continue; // an earlier, cruder stage at the end
            const T change = probe[k] - previous;
            least.rise = min(least.rise, change);
            least.fall = min(least.fall, -change);
            previous = probe[k];
        }
        return least;
    }
    /// The first test without the root at the start. The first stages of a method are too crude to
    /// tell more than a slope: a double root is judged by the later ones.
    FILIPPOV_INLINE LaneMask<W> divided_clear() const {
        using T = Lanes<W>;
        const LaneMask<W> twice = order > T(1);
        T low = infinity<W>(), high = -low;
        for (std::size_t k = 1; k <= Times::n; ++k) {
            const double u = Times::theta(k);
            const T once = (probe[k] - start) * T(1 / u);
            const T v = select(twice, T(once * T(1 / u)), once);
            if (u >= 0.25) {
                low = min(low, v);
                high = max(high, v);
            } else {
                low = select(twice, low, min(low, v));
                high = select(twice, high, max(high, v));
            }
        }
        return stays_clear(low, T(high - low));
    }
};

/// What samples of a guard along a step or a window show of its first zero.
template <int W> struct Look {
    LaneMask<W> found{false}; ///< there is one, in [low, high] and no other before
    LaneMask<W> hard{false};  ///< that is not so plain; elsewhere there is none
    Lanes<W> low{0.0}, high{1.0};
    Lanes<W> value_low{0.0}, value_high{0.0};

    /// Takes the next sample: positive ones are passed until the first that is not.
    FILIPPOV_INLINE void take(double at, const Lanes<W>& v, const LaneMask<W>& counts) {
        using T = Lanes<W>;
        const LaneMask<W> zero = counts & ~(v > T(0)) & ~found;
        high = select(zero, T(at), high);
        value_high = select(zero, v, value_high);
        found = found | zero;
        const LaneMask<W> passes = counts & ~found;
        low = select(passes, T(at), low);
        value_low = select(passes, v, value_low);
    }
    void settle() { found = found & ~hard; }
};

/// Looks at samples v[0] to v[n] at equal distances, positive at first.
///
/// Between two positive ones nothing is hidden if they are clear of zero by twice what a parabola
/// bent upwards dips below them, or differ by twice as much as one that turns between them could;
/// bent by the largest second difference and by as much as these change from one to the next.
/// Between a positive one and the next that is not there is one zero.
/// @param rooted  where v[0] does not count: there was a root at the start, which is divided out
template <std::size_t Size, int W>
Look<W> look_along(const std::array<Lanes<W>, Size>& v, const LaneMask<W>& rooted) {
    using T = Lanes<W>;
    constexpr std::size_t n = Size - 1;
    T bend = -infinity<W>(), change(0), previous(0);
    for (std::size_t k = 1; k < n; ++k) {
        const T difference = (v[k - 1] - v[k]) - (v[k] - v[k + 1]);
        if (k > 1) {
            const T by = abs(difference - previous);
            change = max(change, k == 2 ? select(rooted, T(0), by) : by);
        }
        bend = max(bend, k == 1 ? select(rooted, bend, difference) : difference);
        previous = difference;
    }
    bend = max(bend + change, T(0));
    const T clear = T(0.25) * bend;
    Look<W> r;
    r.take(0, v[0], ~rooted);
    for (std::size_t k = 1; k <= n; ++k) {
        r.take(double(k) / n, v[k], LaneMask<W>(true));
        const LaneMask<W> both = k == 1 ? ~rooted : LaneMask<W>(true);
        const LaneMask<W> turns = ~both | (abs(v[k] - v[k - 1]) <= bend);
        const LaneMask<W> near = ~(v[k] > clear) | (both & ~(v[k - 1] > clear));
        r.hard = r.hard | (~r.found & near & turns);
    }
    // What lies between a root at the start and the first sample would not be seen.
    const LaneMask<W> at_start = r.high <= select(rooted, T(1.0 / n), T(0));
    r.hard = r.hard | (r.found & at_start) | ~(bend < infinity<W>());
    r.settle();
    return r;
}

/// The fit of values v[k] at Times::theta(k), v[0] at the start, but for their rounding.
template <class Times, int W, std::size_t Size>
FILIPPOV_INLINE Fit<Lanes<W>> fit_of(const std::array<Lanes<W>, Size>& v) {
    const auto fit = filippov::fit_of(probe_times<Times, double>, v[0],
                                      [&](std::size_t k) FILIPPOV_LAMBDA_INLINE { return v[k]; });
    return fit.without(Lanes<W>(64 * epsilon<double>) * (abs(v[0]) + fit.spread));
}

/// Looks at samples of a guard that follow one cubic, v[0] at the start.
///
/// It is hard to say more where no cubic fits, or where samples come so close to zero before the
/// first that is not positive that a dip may be hidden beside them: of what they are off the cubic,
/// and of what that dips between two of them.
template <class Times, int W, std::size_t Size>
Look<W> look_at_samples(const std::array<Lanes<W>, Size>& v) {
    using T = Lanes<W>;
    constexpr double gap = 1.0 / 16; // the widest
    const Fit<Lanes<W>> fit = fit_of<Times>(v);
    const T close = fused(T(4), fit.off, T(gap * gap / 4) * fit.bend);
    Look<W> r;
    LaneMask<W> pending(false), falls(true);
    for (std::size_t k = 0; k <= Times::n; ++k) {
        const LaneMask<W> before = r.found;
        r.take(k == 0 ? 0.0 : Times::theta(k), v[k], LaneMask<W>(true));
        const LaneMask<W> just = r.found & ~before;
        r.hard = r.hard | (pending & ~before & ~(just & falls));
        pending = ~r.found & ~(v[k] > close);
        falls = k == 0 ? LaneMask<W>(true) : v[k] < v[k - 1];
    }
    const LaneMask<W> none = fit.clear();
    r.hard = ~none & (r.hard | ~fit.resolved() | (r.found & (r.high <= T(0))));
    r.settle();
    return r;
}

/// Looks at a margin at the probes of a window of a slide, m[0] at its start: see
/// Trace::falls_through.
template <int W> Look<W> look_in_window(const std::array<Lanes<W>, WindowTimes<double>::n + 1>& m) {
    using T = Lanes<W>;
    constexpr std::size_t n = WindowTimes<double>::n;
    T low = m[0], high = m[0], bend(0), fourth(0);
    for (std::size_t k = 1; k <= n; ++k) {
        low = min(low, m[k]);
        high = max(high, m[k]);
    }
    for (std::size_t k = 1; k < n; ++k)
        bend = max(bend, abs(m[k - 1] - T(2) * m[k] + m[k + 1]));
    for (std::size_t k = 0; k + 4 <= n; ++k)
        fourth =
            max(fourth, abs(fused(T(6), m[k + 2], m[k] + m[k + 4]) - T(4) * (m[k + 1] + m[k + 3])));
    const T spread = high - low, clear = T(0.25) * bend;
    Look<W> r;
    LaneMask<W> unclear(false);
    for (std::size_t k = 0; k <= n; ++k) {
        r.take(double(k) / n, m[k], LaneMask<W>(true));
        unclear = unclear | (~r.found & ~(m[k] > clear));
    }
    const LaneMask<W> cubic = fourth < T(0.25) * spread;
    const LaneMask<W> still = low > T(2) * spread; // whatever it does between
    r.hard = ~still & (~cubic | unclear | (r.found & (r.high <= T(0))));
    r.settle();
    return r;
}

/// The zero of f that a look found: false position with Illinois's halving, in every lane until the
/// step or the bracket is below `tolerance`.
template <int W, class F>
FILIPPOV_INLINE Lanes<W> root(const Look<W>& look, double tolerance, const F& f) {
    using T = Lanes<W>;
    T a = look.low, b = look.high, fa = look.value_low, fb = look.value_high, c = b;
    LaneMask<W> todo = look.found & (fb < T(0));
    T stayed(0); // -1: b did, +1: a did
    for (int k = 0; k < 100 && any(todo); ++k) {
        const T secant = (a * fb - b * fa) / (fb - fa);
        const T u = select((secant > a) & (secant < b), secant, T(0.5) * (a + b));
        const T fu = f(u);
        const LaneMask<W> moves = abs(u - c) > T(tolerance);
        c = select(todo, u, c);
        const LaneMask<W> to_a = todo & (fu > T(0)), to_b = todo & ~(fu > T(0));
        a = select(to_a, u, a);
        b = select(to_b, u, b);
        fa = select(to_a, fu, select(to_b & (stayed > T(0)), T(0.5) * fa, fa));
        fb = select(to_b, fu, select(to_a & (stayed < T(0)), T(0.5) * fb, fb));
        stayed = select(to_a, T(-1), select(to_b, T(1), stayed));
        todo = todo & moves & ~(fu == T(0)) & (b - a > T(tolerance));
    }
    return c;
}

} // namespace filippov::lanes
