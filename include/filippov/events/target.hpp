// SPDX-License-Identifier: BSD-3-Clause
// What a step is to end on.
#pragma once

#include <filippov/events/watch.hpp>

namespace filippov {

/// The event found in a step: what is zero there, and what an end of the step must be to be there.
/// A step that ends on it is shortened by `Landing`.
template <class Sys, class S, class Guards> class Target {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using Path = TriedPath<S, N>;

    Target(const Place<Sys, S>& place, const Guards& guards, const Found<S>& found)
        : at_(place), guards_(guards), found_(found) {}

    /// Positive if the path ends before the event.
    S residual(const Path& path) const {
        const S t = at_.clock.local + path.dt;
        return found_.touch ? S(at_.direction) * minus_slope(t, path.x1, path.end_field(), path.dt)
                            : guards_.value_of(found_, t, path.x1);
    }
    /// Derivative of the residual by time, on the interpolant.
    S slope(Path& path) const {
        const S step = found_.touch ? S(1e-3) : S(1e-4);
        const S ahead = found_.pole < 0 ? step : S(0); // (behind the root is the pole)
        const S u = std::min(found_.theta + ahead, S(1)), v = std::max(found_.theta - step, S(0));
        const auto raw = [&](const S& theta) {
            return guards_.value_of(found_, S(at_.clock.local + theta * path.dt), path(theta));
        };
        if (!found_.touch)
            return (raw(u) - raw(v)) / ((u - v) * path.dt);
        const S m = (u + v) / S(2), w = (u - v) / S(2) * path.dt;
        return -S(at_.direction) * (raw(u) - S(2) * raw(m) + raw(v)) / (w * w);
    }
    /// What a landing may leave to a Taylor step: a hundredth of the tolerance, or rounding if
    /// there is none.
    S nudge_tolerance() const {
        return at_.settings.fixed_step > S(0) ? S(0.01) * epsilon<S> / at_.settings.rtol : S(0.01);
    }

    /// The shortest time that the event's function may tell apart: sections see absolute time.
    S tick() const {
        return ulp(found_.guard < Guard<M>::first_section ? at_.clock.local : at_.clock.absolute());
    }
    /// True of a plain end of a slide, by s.
    bool ends_slide() const {
        return guards_.is_end_by_s(found_.guard) && !found_.touch && found_.pole < 0;
    }
    /// True of the end of a slide's field, by L1 - L2.
    bool loses_surface() const {
        return found_.guard < Guard<M>::first_section && !found_.touch &&
               found_.guard == Guard<M>::transversal(surface());
    }
    /// True if the end of the path is on the surface met but for the tolerance and the resolution
    /// of time: what lies farther off is not to be moved there. The end of a slide is at |s| = 1,
    /// unless s jumps; a section, or a force of contact, is zero beside what it was in the step.
    bool reached(const Path& path) const {
        using std::abs;
        const S t = at_.clock.local + path.dt;
        if (ends_slide() && !is_kind(at_.sys, surface(), SurfaceKind::jump)) // (a push has no unit)
            return abs(guards_.guard_value(found_.guard, t, path.x1)) <= S(1e-6);
        if (found_.touch)
            return true;
        if (found_.guard >= Guard<M>::first_section || ends_slide())
            return guards_.is_zero(found_.guard, guards_.guard_value(found_.guard, t, path.x1));
        if (!meets_surface())
            return true;
        if (found_.jumps) // (at a pole the band is as large as h)
            return false;
        const S rate = normal_component(at_.sys, surface(), t, path.x1, at_.p, path.end_field());
        const S band = S(1e3) * rounding_band(at_.sys, surface(), t, path.x1, at_.p) +
                       S(8) * ulp(t) * abs(rate) +
                       change_over(at_.sys, surface(), t, path.x1, at_.p, at_.scale);
        return abs(h(t, path.x1)) <= band;
    }
    /// Puts the landed state on the surface that was met (not after a touch, nor where h jumped)
    /// and on the one slid on.
    /// @param t  where the clock will be then, which may round otherwise than `local + dt`
    void settle(Path& path, const S& t, bool jumped) const {
        const bool on_surface = meets_surface() && !found_.touch && !jumped;
        const X x = path.x1;
        if (on_surface) {
            path.x1 = project(at_.sys, at_.held_with(surface(), t, x), t, x, at_.p, at_.scale);
            if (may_be_put_on(at_.sys, surface(), t, at_.p, x, path.x1, at_.field(t, path.x1),
                              at_.scale))
                return;
        }
        path.x1 = project(at_.sys, at_.held, t, x, at_.p, at_.scale);
    }
    /// True if the gradient of h vanishes where the surface was met: to first order the step, and
    /// its second half, explain less than a millionth of the change of h, and no part of the
    /// gradient is what it was. (At a tangency a curved surface is met by motion along it, and its
    /// gradient is there. A step that began at a pole of h shows less than its second half.)
    bool degenerate(Path& path) const {
        return meets_surface() && !found_.jumps && flat_since(path, S(0), at_.x) &&
               flat_since(path, S(0.5), path(S(0.5)));
    }

private:
    bool flat_since(const Path& path, const S& theta, const X& x) const {
        using std::abs;
        const S t0 = at_.clock.local + theta * path.dt, t1 = at_.clock.local + path.dt;
        const X now = grad_h(at_.sys, surface(), t1, path.x1, at_.p);
        const S rate = h_t(at_.sys, surface(), t1, path.x1, at_.p);
        S first_order = abs(rate * (t1 - t0));
        for (int i = 0; i < N; ++i)
            first_order += abs(now[i] * (path.x1[i] - x[i]));
        const S change = abs(h(t1, path.x1) - h(t0, x));
        if (first_order > S(1e-6) * change || !(change > S(0)))
            return false;
        const X before = grad_h(at_.sys, surface(), t0, x, at_.p);
        bool remains = vanishes_not(rate, h_t(at_.sys, surface(), t0, x, at_.p));
        for (int i = 0; i < N; ++i)
            remains = remains || vanishes_not(now[i], before[i]);
        return !remains;
    }
    static bool vanishes_not(const S& now, const S& before) {
        using std::abs;
        return abs(now) > S(1e-3) * abs(before);
    }
    int surface() const { return found_.guard / 3; }
    bool meets_surface() const {
        return found_.guard < Guard<M>::first_section && at_.mode[surface()] != 0;
    }
    S h(const S& t, const X& x) const { return switching(at_.sys, t, x, at_.p)[surface()]; }

    /// Derivative of the guard along the path at its end, times -1: positive before a minimum.
    /// @param dt  the length of the path
    S minus_slope(const S& t, const X& x, const X& f, [[maybe_unused]] const S& dt) const {
        const int g = found_.guard, j = surface();
        if (at_.mode[j] != 0)
            return -guards_.sense(g) * normal_component(at_.sys, j, t, x, at_.p, f);
        if constexpr (slides_twice_v<Sys>)
            if (at_.mode.holds_rate(j)) {
                using std::abs;
                const S d = S(1e-3) * abs(dt) + S(64) * ulp(t);
                return (guards_.guard_value(g, S(t - d), X(x - d * f)) -
                        guards_.guard_value(g, S(t + d), X(x + d * f))) /
                       (S(2) * d);
            }
        const auto q = lift<1>(at_.p);
        const auto margin = [&](const auto& time, const auto& y) {
            const auto m = sliding_margin(at_.sys, at_.mode, j, time, y, q, at_.its_layers());
            return g % 3 == 0 ? m.below : m.above;
        };
        return -directional(margin, t, x, S(1), f);
    }

    const Place<Sys, S>& at_;
    const Guards& guards_;
    const Found<S>& found_;
};

} // namespace filippov
