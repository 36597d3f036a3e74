// SPDX-License-Identifier: BSD-3-Clause
// Events that follow each other ever faster, and where that ends.
#pragma once

#include <filippov/run/clock.hpp>
#include <filippov/system/surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace filippov {

/// Where a pattern of events ends that repeats ever faster.
template <class S, int N> struct Limit {
    S after{};       ///< time from the last event, in the direction of the run
    Vec<S, N> x{};   ///< state there
    int pattern = 0; ///< number of events in a repetition
};

/// The last events of a run: their times, surfaces, and states.
///
/// Bounces of a ball and crossings of a spiral follow each other in times that shrink by a ratio r.
/// With the last repetition of length g the limit is g r / (1 - r) away, and the state is
/// extrapolated by the same ratio. Several repetitions are taken together as one: the longer g, the
/// less the rounding of the times says.
template <class S, int N, int M> class RecentEvents {
    static constexpr int kept = 19; ///< three times the longest pattern that is looked for, and one

public:
    /// @param mode   in which the solution goes on
    /// @param jumps  the state was thrown to x
    void add(const Clock<S>& clock, int surface, const Vec<S, N>& x, const Mode<M>& mode,
             bool jumps) {
        using std::abs;
        gap_ = n_ > 0 ? S(abs(ago(0).clock.until(clock))) : S(0);
        longest_gap_ = std::max(longest_gap_, gap_);
        last_ = last_ + 1 == kept ? 0 : last_ + 1;
        event_[std::size_t(last_)] = {clock, surface, x, mode, jumps};
        n_ = std::min(n_ + 1, kept);
    }
    /// Time between the last two events, without sign; 0 if there is no second.
    S gap() const { return gap_; }
    void clear() {
        n_ = 0;
        longest_gap_ = S(0);
    }
    /// True if it is worth while to look for a limit: the last event came far sooner than others.
    bool hurry() const { return n_ > 3 && gap_ < S(1e-2) * longest_gap_; }

    /// The limit of the shortest pattern that repeats three times ever faster, if less than the
    /// tolerance is left to it, or less time than can be resolved, or the rest of it is `lost` in
    /// rounding.
    /// @param scale      tolerance of each component
    /// @param direction  of time
    /// @param field      (mode, time from now): those of the pattern must not lead far in the time
    ///                   left. (Events that leave the same state again and again, as on a surface
    ///                   in one dimension, show nothing of what lies between them; and where a
    ///                   slide ends the field that leads away from it may be zero.)
    /// @param lost       the last event is a bounce, and so are those that it repeats
    template <class Field>
    std::optional<Limit<S, N>> limit(const Vec<S, N>& scale, const Field& field, int direction,
                                     bool lost) const {
        for (int pattern = 1; 3 * pattern < n_; ++pattern) {
            if (!repeats(pattern, 3) || (lost && !only_bounces(pattern)))
                continue;
            int q = pattern; // the longest multiple that is still known to repeat
            while (3 * (q + pattern) < n_ && repeats(pattern, 3 * (q / pattern + 1)))
                q += pattern;
            const S g2 = S(direction) * ago(q).clock.until(ago(0).clock);
            const S g1 = S(direction) * ago(2 * q).clock.until(ago(q).clock);
            const S g0 = S(direction) * ago(3 * q).clock.until(ago(2 * q).clock);
            if (!(g2 < g1 && g1 < g0 && g2 > S(0)))
                continue;
            // Three events ever sooner are no pattern yet: the ratio must be one.
            using std::abs;
            if (!(abs(g2 * g0 - g1 * g1) <= S(0.1) * (g1 * g1)))
                continue;
            const S ratio = g2 / g1, left = g2 * ratio / (S(1) - ratio);
            const Vec<S, N> rest = (ago(0).x - ago(q).x) * (ratio / (S(1) - ratio));
            Limit<S, N> limit{left, ago(0).x + rest, pattern};
            Vec<S, N> moved = rest.cwiseAbs();
            for (int k = 0; k <= pattern; ++k)
                for (const S part : {S(0), S(0.5), S(1)})
                    moved = moved.cwiseMax(field(ago(k).mode, part * left).cwiseAbs() *
                                           (S(0.1) * left));
            const S square = moved.cwiseQuotient(scale).squaredNorm();
            const bool unresolved = gap_ <= S(1024) * ulp(ago(0).clock.local);
            if (square <= S(N) || unresolved || lost)
                return limit;
        }
        return std::nullopt;
    }
    /// The surfaces of the last q events.
    SurfaceSet<M> surfaces(int q) const {
        SurfaceSet<M> set;
        for (int j = 0; j < M; ++j)
            for (int k = 0; k < q; ++k)
                if (ago(k).surface == j && !set.contains(j))
                    set.add(j);
        return set;
    }

private:
    struct Entry {
        Clock<S> clock{};
        int surface = -1;
        Vec<S, N> x{};
        Mode<M> mode{};
        bool jumps = false;
    };

    /// The k-th event before the last one.
    const Entry& ago(int k) const { return event_[std::size_t((last_ - k + kept) % kept)]; }
    /// True if the last q events have come `times` times.
    bool repeats(int q, int times) const {
        for (int k = 0; k < (times - 1) * q; ++k)
            if (ago(k).surface != ago(k + q).surface || ago(k).jumps != ago(k + q).jumps)
                return false;
        return true;
    }
    /// False if the surface of the last event let go of the state among the last q events: what
    /// rests and takes off in turns comes down again for reasons of its own.
    bool only_bounces(int q) const {
        for (int k = 0; k < q; ++k)
            if (ago(k).surface == ago(0).surface && !ago(k).jumps)
                return false;
        return true;
    }

    std::array<Entry, std::size_t(kept)> event_{};
    int n_ = 0, last_ = 0;
    S gap_ = S(0), longest_gap_ = S(0);
};

} // namespace filippov
