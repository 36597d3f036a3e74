// SPDX-License-Identifier: BSD-3-Clause
// Shortens a step until it ends on an event.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace filippov {

/// How a landing ended.
struct Landed {
    bool seen_beyond = false; ///< a trial lay beyond the event: there is one
    bool jumped = false;      ///< the residual changes sign without being zero
    int trials = 0;           ///< steps taken again
};

/// Newton on the length of the step itself, so that the state at the event has the order of the
/// method, not of the interpolant; within a bracket once there is one. The last corrections are
/// Taylor steps from the end of the path, where these are exact enough.
///
/// A path has `dt`, `shorten(d)` (takes the step again), `nudge(delta)` (moves its end),
/// `nudge_error(delta)`, in units of the tolerance, and `finite()`, true if its end is.
/// @param t          where the step starts
/// @param d, slope   first guess of its length, and of the derivative of the residual there:
/// infinite where the residual jumps, and slopes tell nothing
/// @param nudge_tolerance  what may be left to a Taylor step
/// @param tick       the residual tells no shorter times apart, if that is more than the rounding
/// of t + d
/// @param residual   of the path's end; positive before the event
/// @param on_target  true if the end is there but for the tolerance and the resolution of time
template <class Path, class S, class Residual, class OnTarget> class Landing {
public:
    Landing(Path& path, const S& t, const S& nudge_tolerance, Residual residual, OnTarget on_target,
            const S& tick = S(0))
        : path_(path), t_(t), full_(path.dt), nudge_tolerance_(nudge_tolerance), tick_(tick),
          residual_(residual), on_target_(on_target) {}

    Landed run(S d, S slope) {
        Landed result;
        const S forward = full_ < S(0) ? S(-1) : S(1);
        const bool smooth = abs_(slope) < std::numeric_limits<S>::infinity();
        bool seen_before = false;
        S before = S(0), beyond = full_, previous_d = d, previous_r = S(0);
        S ahead = S(2.5e-4) * full_;
        for (int k = 0; k < 100; ++k) {
            path_.shorten(d);
            ++result.trials;
            // What is undefined at the event itself (a sliding field 0/0) lies beyond it.
            const S r = path_.finite() ? residual_() : S(std::numeric_limits<S>::quiet_NaN());
            if (r == S(0))
                break;
            if (r > S(0)) {
                before = d;
                seen_before = true;
            } else {
                beyond = d;
                result.seen_beyond = true;
            }
            const bool bracketed = seen_before && result.seen_beyond;
            if (k > 0 && abs_(d - previous_d) > S(1e-12) * abs_(full_)) {
                const S secant = (r - previous_r) / (d - previous_d);
                if (abs_(secant) > S(0) && abs_(secant) < std::numeric_limits<S>::infinity())
                    slope = secant;
            }
            previous_d = d;
            previous_r = r;
            const S delta = -r / slope, next = d + delta;
            if (abs_(delta) <= tick(d) && on_target_())
                break;
            const bool inside = smooth && in_step(next) &&
                                !(seen_before && !(forward * (next - before) > S(0))) &&
                                !(result.seen_beyond && !(forward * (beyond - next) > S(0)));
            if (inside && path_.nudge_error(delta) <= nudge_tolerance_) {
                if (polish(slope, delta) && path_.finite() && on_target_())
                    break;
                path_.shorten(d);
            }
            if (bracketed && abs_(beyond - before) <= S(2) * tick(d)) {
                // the residual jumps here, or is too flat to tell: stop just beyond
                path_.shorten(beyond);
                result.jumped = !on_target_();
                if (result.jumped)
                    leave_pole(beyond);
                break;
            }
            if (inside && !(k > 6 && k % 2 == 1))
                d = next;
            else if (bracketed)
                d = before + (beyond - before) / S(2);
            else if (!seen_before)
                d = d / S(2);
            else if (d != full_) { // ever farther ahead: what lies beyond may be brief
                ahead *= S(4);
                d = abs_(full_ - d) > abs_(ahead) ? d + ahead : full_;
            } else
                break;
        }
        if (seen_before && !path_.finite())
            path_.shorten(before);
        return result;
    }

private:
    static S abs_(const S& v) {
        using std::abs;
        return abs(v);
    }

    /// At a pole itself, which the end of the path may be to the last bit, the residual is not
    /// finite: some ticks later it is.
    void leave_pole(S d) {
        const S forward = full_ < S(0) ? S(-1) : S(1);
        for (int k = 1; k <= 64 && !(residual_() > -std::numeric_limits<S>::infinity()); k *= 2) {
            d += forward * S(k) * tick(d);
            path_.shorten(d);
        }
    }
    S tick(const S& d) const { return std::max(tick_, ulp(t_ + d)); }
    /// True if a step of this length ends in the one that is shortened, or hardly beyond.
    bool in_step(const S& d) const {
        const S forward = full_ < S(0) ? S(-1) : S(1);
        return forward * d >= S(0) && forward * (full_ * S(1.01) - d) >= S(0);
    }

    /// Newton by Taylor steps; the slope stays. False if the residual does not follow it (a kink or
    /// a jump), or leads out of the step.
    bool polish(const S& slope, S delta) {
        const S noise = S(1e4) * epsilon<S> * abs_(path_.dt);
        for (int k = 0; k < 12; ++k) {
            path_.nudge(delta);
            if (!in_step(path_.dt))
                return false;
            const S next = -residual_() / slope;
            if (abs_(next) <= tick(path_.dt))
                return true;
            if (!(abs_(next) < S(0.5) * abs_(delta)))
                return abs_(next) <= noise;
            delta = next;
        }
        return abs_(delta) <= noise;
    }

    Path& path_;
    const S t_, full_, nudge_tolerance_, tick_;
    Residual residual_;
    OnTarget on_target_;
};

} // namespace filippov
