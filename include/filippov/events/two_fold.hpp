// SPDX-License-Identifier: BSD-3-Clause
// Whether a slide runs into a two-fold: a point where L1 = L2 = 0 and the sliding field is 0/0.
#pragma once

#include <filippov/run/place.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace filippov {

namespace detail {

/// A slide on surface j near a two-fold, by its desingularised field
///
///   (L1 - L2) F_s = L1 F2 - L2 F1,   dt = (L1 - L2) dtau,
///
/// which is regular there, and zero. To first order u = L1 and v = -L2 follow
///
///   d/dtau (u, v) = (uu u + uv v, vu u + vv v),   of Lie derivatives u' along F2 and F1, and v'.
///
/// Signs are those of an attracting slide forwards: u, v > 0 within a slide.
/// @source Filippov (1988); Teixeira (1990); Colombo and Jeffrey (2011)
template <class Sys, class S> struct Desingularised {
    State<Sys, S> f1, f2; ///< the fields of both sides
    S u, v;
    S uu, uv, vu, vv;
};

/// @param attracts  1 where the slide attracts in the direction of time, -1 where it repels
template <class Sys, class S>
Desingularised<Sys, S> desingularised(const Place<Sys, S>& at, int j, const S& t,
                                      const State<Sys, S>& x, int attracts) {
    const Sides<Sys, S> here = both_sides(at.sys, at.mode, j, t, x, at.p);
    const auto q = lift<1>(at.p);
    const auto changes_along = [&](const State<Sys, S>& f) {
        const auto time = Taylor<S, 1>::variable(t);
        State<Sys, Taylor<S, 1>> y = lift<1>(x);
        for (int i = 0; i < dim_v<Sys>; ++i)
            y[i].c[1] = f[i];
        return both_sides(at.sys, at.mode, j, time, y, q);
    };
    const auto along1 = changes_along(here.f1), along2 = changes_along(here.f2);
    const S sign = S(attracts), forward = S(at.direction * attracts);
    return {here.f1,
            here.f2,
            forward * here.l1,
            -forward * here.l2,
            sign * along2.l1.c[1],
            sign * along1.l1.c[1],
            -sign * along2.l2.c[1],
            -sign * along1.l2.c[1]};
}

/// A pair (u, v), or the times that a slide owes to F2 and F1.
template <class S> struct OfSides {
    S u, v;
};

/// Between two points: what u and v change by on the way is the integral of M.
template <class Sys, class S>
Desingularised<Sys, S> mean(const Desingularised<Sys, S>& a, const Desingularised<Sys, S>& b) {
    const S half(0.5);
    Desingularised<Sys, S> m = a;
    m.f1 = half * (a.f1 + b.f1);
    m.f2 = half * (a.f2 + b.f2);
    m.uu = half * (a.uu + b.uu);
    m.uv = half * (a.uv + b.uv);
    m.vu = half * (a.vu + b.vu);
    m.vv = half * (a.vv + b.vv);
    return m;
}

/// True where the slide goes through the two-fold on its only orbit, as in the plane, or where a
/// scalar switches at an instant: M has rank one, (u, v) is its eigenvector, and F_s has a limit.
template <class Sys, class S> bool is_single_orbit(const Desingularised<Sys, S>& d) {
    using std::abs;
    const S trace = d.uu + d.vv;
    return abs(d.uu * d.vv - d.uv * d.vu) <= S(1e-6) * trace * trace;
}

/// How long F2 and F1 act until u = v = 0: the integrals of u and v over tau, -M^-1 (u, v).
template <class Sys, class S> OfSides<S> shares_left(const Desingularised<Sys, S>& d) {
    const S trace = d.uu + d.vv, det = d.uu * d.vv - d.uv * d.vu;
    if (is_single_orbit(d))
        return {-d.u / trace, -d.v / trace};
    return {(d.uv * d.v - d.vv * d.u) / det, (d.vu * d.u - d.uu * d.v) / det};
}

/// The same for what u and v may be off by: bounds of the times.
template <class Sys, class S>
OfSides<S> bounds_of_shares(const Desingularised<Sys, S>& d, const S& u, const S& v) {
    using std::abs;
    const S trace = d.uu + d.vv, det = d.uu * d.vv - d.uv * d.vu;
    if (is_single_orbit(d))
        return {u / abs(trace), v / abs(trace)};
    return {(abs(d.uv) * v + abs(d.vv) * u) / abs(det), (abs(d.vu) * u + abs(d.uu) * v) / abs(det)};
}

/// What u and v change by over these lengths.
template <class Sys, class S>
OfSides<S> changes_over(const Place<Sys, S>& at, int j, const S& t, const State<Sys, S>& x,
                        const State<Sys, S>& lengths) {
    using std::abs;
    const auto q = lift<1>(at.p);
    OfSides<S> sum{S(0), S(0)};
    for (int i = 0; i < dim_v<Sys>; ++i) {
        State<Sys, Taylor<S, 1>> y = lift<1>(x);
        y[i].c[1] = lengths[i];
        const auto sides = both_sides(at.sys, at.mode, j, Taylor<S, 1>(t), y, q);
        sum.u += abs(sides.l1.c[1]);
        sum.v += abs(sides.l2.c[1]);
    }
    return sum;
}

/// Whether a slide tends to the two-fold where it is linearised.
template <class S> struct Tendency {
    bool tends = false;
    /// How far beside the orbit that tends to it the slide may be, in tolerances.
    S beside = S(1);
    bool last_chance = false; ///< soon it will be too far beside it
};

/// How a slide turns: by an angle, or from one eigenvector to the other.
template <class S> struct TurnsBy {
    S rate;
    bool angle;
};
/// When cos(w tau) start + sin(w tau)/w r, or start + (exp(g tau) - 1)/g r, leaves the slide.
template <class S>
S turns_out(const OfSides<S>& start, const OfSides<S>& r, const S& s_most, const TurnsBy<S>& by) {
    using std::atan2;
    using std::log1p;
    const auto time = [&](const S& a, const S& b) { // until what is a > 0 at first is zero
        if (by.angle)
            return S(atan2(by.rate * a, -b) / by.rate);
        if (!(b < S(0)))
            return std::numeric_limits<S>::infinity();
        return by.rate > S(0) ? S(log1p(-by.rate * a / b) / by.rate) : S(-a / b);
    };
    const auto above = [&](const OfSides<S>& w) {
        return (s_most + S(1)) * w.u + (s_most - S(1)) * w.v;
    };
    const auto below = [&](const OfSides<S>& w) {
        return (s_most - S(1)) * w.u + (s_most + S(1)) * w.v;
    };
    return std::min(time(above(start), above(r)), time(below(start), below(r)));
}

/// Whether a slide at (u, v) = `start` tends to the two-fold where it is linearised by `d`, or its
/// orbit cannot be told from one that does.
///
/// With eigenvalues l2 < l1 of M the solution is exp(l2 tau) start + c(tau) r, r = (M - l2) start
/// along the eigenvector of l1 and c > 0. So it stays between `start` and r, and tends to zero
/// within the slide if l1 < 0 and r points into the slide. If r = 0 it tends to zero along the
/// eigenvector of l2: a single orbit, and what steps err beside it grows by |l1/l2| orders while
/// the slide comes nearer by one. Else it turns out of the slide, as it does with complex
/// eigenvalues: if it turns slowly, less than a tolerance beside the two-fold, or nearer to it than
/// any number could tell.
/// @param band    what a tolerance changes u and v by
/// @param nearer  by what factor the slide has come nearer on its way
template <class Sys, class S>
Tendency<S> tendency(const Desingularised<Sys, S>& d, const OfSides<S>& start,
                     const OfSides<S>& band, const S& nearer, const S& s_most) {
    using std::abs;
    using std::pow;
    using std::sqrt;
    const S half = (d.uu + d.vv) / S(2), apart = (d.uu - d.vv) / S(2);
    const S square = apart * apart + d.uv * d.vu;
    const auto changes = [&](const S& l) { // (M - l) start
        return OfSides<S>{(d.uu - l) * start.u + d.uv * start.v,
                          d.vu * start.u + (d.vv - l) * start.v};
    };
    const auto in_the_end = [&](const S& log_of_distance) {
        using std::log;
        const S least =
            std::max(S(4) * epsilon<S> * nearer, S((band.u + band.v) / (start.u + start.v)));
        return log_of_distance <= log(least);
    };
    if (!(square >= S(-1e-12) * half * half)) {
        const S tau = turns_out(start, changes(half), s_most, TurnsBy<S>{sqrt(-square), true});
        return {half < S(0) && in_the_end(half * tau), S(1), false};
    }
    const S root = sqrt(std::max(square, S(0))), l2 = half - root, l1 = half + root;
    if (!(l2 < S(0)))
        return {};
    const OfSides<S> r = changes(l2);
    if (l1 < S(1e-6) * l2 && r.u + r.v > S(0) && abs(r.u - r.v) < s_most * (r.u + r.v))
        return {true, S(1), false};
    if (l1 < S(0) && in_the_end(l1 * turns_out(start, r, s_most, TurnsBy<S>{S(2) * root, false})))
        return {true, S(1), false};
    const S growth = l1 / -l2, rate = std::max(S(l1 - l2), S(-l2));
    const S most = S(1) + S(10) * pow(nearer, growth); // errors of the last step, and of all before
    // in parts of the distance, now and when this is a quarter
    const S apart_now = (abs(r.u) + abs(r.v)) / ((l1 - l2) * (start.u + start.v));
    return {abs(r.u) <= most * rate * band.u && abs(r.v) <= most * rate * band.v, most,
            apart_now * pow(S(4), S(1) + growth) > S(0.1)};
}

} // namespace detail

/// A two-fold to which a slide may tend.
template <class Sys, class S> struct TwoFold {
    bool found = false;    ///< there is one: Newton's method has found it
    bool tends = false;    ///< the slide tends to it, or to within some tolerances seems to
    bool resolved = false; ///< the slide goes straight to it, but for the tolerance
    bool has_field = true; ///< F_s has a limit there: all slides have the same direction
    S reach = S(0);        ///< time that both fields take to it, signs left aside
    S after = S(0);        ///< when the slide is there, a time from now
    State<Sys, S> x;
};

/// The two-fold ahead of a slide on surface j.
///
/// From the state fields F1 and F2 lead to it, for the times that shares_left tells: each of these
/// steps is one of Newton's method, in the plane of both fields, for L1 = L2 = 0. The first one is
/// exact where fields are constant and L1, L2 linear. With the means of M and of the fields at both
/// ends of the way its error is of third order; what these change tells how far it is to be
/// believed. (Where L1 and L2 vanish to second order, steps halve and nothing is found: then
/// solutions may go on unharmed.)
///
/// @param widest  the largest |L1 - L2| of this slide
/// @cost  up to 8 times 5 fields of both sides, in Taylor arithmetic of first order, and dim + 1
/// @source linear flow at a two-fold: Filippov (1988); Colombo and Jeffrey (2011)
template <class Sys, class S>
FILIPPOV_COLD TwoFold<Sys, S> two_fold_ahead(const Place<Sys, S>& at, int j, const S& widest) {
    using std::abs;
    using X = State<Sys, S>;
    constexpr S infinity = std::numeric_limits<S>::infinity();
    const S forward = S(at.direction);
    S t = at.clock.local;
    X x = at.x;
    const Sides<Sys, S> sides = both_sides(at.sys, at.mode, j, t, x, at.p);
    const int attracts = forward * (sides.l1 - sides.l2) < S(0) ? -1 : 1;
    const auto start = detail::desingularised(at, j, t, x, attracts);
    const auto lengths = [&](const auto& d, const detail::OfSides<S>& times) {
        return at.norm(X(times.u * d.f2)) + at.norm(X(times.v * d.f1));
    };
    const auto rounding = [&](const auto& d) {
        return lengths(d, detail::bounds_of_shares(d, rate_rounding(at.sys, j, t, x, at.p, d.f1),
                                                   rate_rounding(at.sys, j, t, x, at.p, d.f2)));
    };

    /// One step of Newton's method: x, t and what is left after it.
    const auto go = [&](const auto& d, const detail::OfSides<S>& times) {
        x += forward * (times.v * d.f1 + times.u * d.f2);
        t += forward * (times.u + times.v);
        x = project(at.sys, at.held, t, x, at.p, at.scale);
        return detail::desingularised(at, j, t, x, attracts);
    };

    TwoFold<Sys, S> fold;
    fold.x = x;
    auto d = start;
    S last = infinity, last_times = infinity;
    for (int k = 0; k < 8 && !fold.found; ++k) {
        const detail::OfSides<S> left = detail::shares_left(d);
        const S length = lengths(d, left), band = S(0.1) + rounding(d);
        const S times = abs(left.u) + abs(left.v), instant = S(16) * at.resolution();
        if (!(length < infinity) || (k > 2 && !(length <= S(0.5) * last)))
            return fold;
        if (k == 0)
            fold.reach = times;
        // (times as well: where fields vanish, too, they move nothing)
        fold.found =
            k > 0 && length <= S(0.2) * last && length <= band && times <= S(0.2) * last_times;
        last = std::max(length, band);
        last_times = std::max(times, instant);
        d = go(d, left);
    }
    if (!fold.found || !(forward * (t - at.clock.local) > S(0)))
        return fold;
    const auto tendency =
        detail::tendency(d, {start.u, start.v}, detail::changes_over(at, j, t, x, at.scale),
                         S(widest / (start.u + start.v)), s_max(at.sys, at.p));
    fold.tends = tendency.tends;
    fold.has_field = detail::is_single_orbit(d);

    // The way there, again, by the mean of the fields at both of its ends.
    const auto mean = detail::mean(start, d);
    const detail::OfSides<S> first = detail::shares_left(start), way = detail::shares_left(mean);
    const S correction = lengths(mean, {way.u - first.u, way.v - first.v}) - rounding(mean);
    x = at.x;
    t = at.clock.local;
    fold.after = forward * (way.u + way.v);
    d = go(mean, way);
    for (int k = 0; k < 2; ++k) {
        const detail::OfSides<S> left = detail::shares_left(d);
        fold.after += forward * (left.u + left.v);
        d = go(d, left);
    }
    if (!all_finite<S, dim_v<Sys>>(x) || !(abs(fold.after) < infinity))
        return fold;
    fold.x = x;
    const X straight =
        (fold.after / (start.u + start.v)) * (start.v * start.f1 + start.u * start.f2);
    const S most =
        std::min(S(0.1) * lengths(start, first), tendency.last_chance ? tendency.beside : S(1));
    fold.resolved = abs(fold.after) <= S(16) * at.resolution() ||
                    (correction <= most && at.norm(X(at.x + straight - x)) <= tendency.beside);
    return fold;
}

} // namespace filippov
