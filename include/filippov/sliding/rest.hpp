// SPDX-License-Identifier: BSD-3-Clause
// Where a direction a/|a| is at rest, a = 0: whether it sticks there, and how it leaves.
#pragma once

#include <filippov/sliding/junction.hpp>

namespace filippov {

/// How directions leave rest: u(t) = u + (t - t0) turn.
template <class S, int M> struct SetOff {
    SurfaceSet<M> on; ///< their components
    S t0{};
    Vec<S, M> u, turn; ///< of these; others unspecified
};

/// A system some of whose directions are given as functions of time, since a/|a| is 0/0 at rest.
template <class Sys, class S> struct Leaving : Sys {
    SetOff<S, surfaces_v<Sys>> off;

    Leaving(const Sys& sys, const SetOff<S, surfaces_v<Sys>>& how) : Sys(sys), off(how) {}

    template <class T> void set_directions(Vec<T, surfaces_v<Sys>>& s, const T& t) const {
        for (const int j : off.on)
            s[j] = T(off.u[j]) + T(off.turn[j]) * (t - T(off.t0));
    }
};

/// Directions that leave rest at (t, x) in some mode, in which these components move.
///
/// With a' = w + W u the direction at the start has a' = lambda u, |u| = 1, lambda >= 0: one u
/// where W + W' is negative definite, as |(lambda - W)^-1 w| falls with lambda. At the end of
/// sticking lambda is 0, and a grows with the square of time. A little later u has turned by
///
///   (2 lambda - P W P) u' = P w',   P = 1 - u u',   w' = a'' with u held,
///
/// the first terms of the series of r du/dt = P a', r = |a|, which has no other bounded solution.
template <class Sys, class S> class LeavingRest {
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using U = Vec<S, M>; // by the number of the component among those that leave
    using W = Mat<S, M, M>;

public:
    LeavingRest(const Sys& sys, const Mode<M>& mode, const SurfaceSet<M>& leaving, const S& t,
                const X& x, const Params<Sys, S>& p)
        : sys_(&sys), mode_(mode), on_(leaving), n_(std::min(leaving.n, M)), t_(t), x_(x), p_(p) {}

    /// Finds how; false if they do not leave.
    /// @param exit  the slide that ended here, if one did
    /// @param tau   a time over which the solution changes
    bool solve(const SlideEnd<M>& exit, const S& tau) {
        if (!find_start(exit))
            return false;
        for (int i = 0; i < n_; i = end(i))
            if (tied_[std::size_t(i)] && !leaves_disc(i, tau))
                return false;
        const auto frozen = [&](const auto& time, const auto& y, const auto& q) {
            return mode_field(with(u_, zero()), mode_, time, y, q);
        };
        U bend = zero();
        for (int i = 0; i < n_; ++i)
            bend[i] = lie_derivatives<2>(
                frozen,
                [&](const auto& time, const auto& y, const auto& q) {
                    return switching(*sys_, time, y, q)[on_[i]];
                },
                t_, x_, p_)[1];
        turn_ = turned(bend, 1);
        for (int i = 0; i < n_; i = end(i)) {
            S growth(0); // of |a'|
            for (int k = i; k < end(i); ++k) {
                S second = bend[k];
                for (int c = 0; c < n_; ++c)
                    second += slope_(k, c) * turn_[c];
                growth += u_[k] * second;
            }
            if (tied_[std::size_t(i)] && !(growth > S(0)))
                return false;
        }
        return true;
    }

    /// The system with these directions as they leave.
    Leaving<Sys, S> system() const { return with(u_, turn_); }

    /// The state in a time after (t, x), as far as it is known: x + f0 dt + f1 dt^2/2, and what the
    /// field there says of the next term.
    struct Series {
        X f0, f1, f2;
        X operator()(const X& x, const S& dt) const {
            return x + dt * (f0 + (dt / S(2)) * (f1 + (dt / S(3)) * f2));
        }
    };
    /// Its first two terms.
    Series series() const {
        const auto leaving = system();
        Series s;
        s.f0 = mode_field(leaving, mode_, t_, x_, p_);
        Vec<Taylor<S, 1>, dim_v<Sys>> y = lift<1>(x_);
        for (int i = 0; i < dim_v<Sys>; ++i)
            y[i].c[1] = s.f0[i];
        const auto f = mode_field(leaving, mode_, Taylor<S, 1>::variable(t_), y, lift<1>(p_));
        for (int i = 0; i < dim_v<Sys>; ++i)
            s.f1[i] = f[i].c[1];
        s.f2 = X::Constant(S(0));
        return s;
    }
    /// The third one, from the field a time dt later. The direction there is corrected for what it
    /// lacks of solving its own equation.
    X third_term(const Series& s, const S& dt) const {
        const S t = t_ + dt;
        const X y = s(x_, dt);
        U u = zero();
        for (int i = 0; i < n_; i = end(i)) {
            S size(0);
            for (int k = i; k < end(i); ++k) {
                u[k] = u_[k] + dt * turn_[k];
                size += u[k] * u[k];
            }
            using std::sqrt;
            for (int k = i; k < end(i); ++k)
                u[k] /= sqrt(size);
        }
        const U a = components(switching(*sys_, t, y, p_));
        const U rate = components(normal_components(*sys_, t, y, p_, field(t, y, u)));
        U lacks = zero();
        for (int i = 0; i < n_; i = end(i)) {
            S along(0), length(0);
            for (int k = i; k < end(i); ++k) {
                along += u[k] * rate[k];
                length += u[k] * a[k];
            }
            for (int k = i; k < end(i); ++k)
                lacks[k] = rate[k] - along * u[k] - length * turn_[k];
        }
        const U more = turned(lacks, 2);
        for (int i = 0; i < n_; ++i)
            u[i] += more[i];
        return S(2) / (dt * dt) * (field(t, y, u) - s.f0 - dt * s.f1);
    }

private:
    static U zero() { return U::Constant(S(0)); }
    /// Behind the last component of the direction of the i-th.
    int end(int i) const {
        do
            ++i;
        while (i < n_ && is_kind(*sys_, on_[i], SurfaceKind::component));
        return i;
    }
    U components(const U& of_all) const {
        U some = zero();
        for (int i = 0; i < n_; ++i)
            some[i] = of_all[on_[i]];
        return some;
    }
    Leaving<Sys, S> with(const U& u, const U& turn) const {
        SetOff<S, M> off{.on = on_, .t0 = t_, .u = zero(), .turn = zero()};
        for (int i = 0; i < n_; ++i) {
            off.u[on_[i]] = u[i];
            off.turn[on_[i]] = turn[i];
        }
        return {*sys_, off};
    }
    /// The field with given directions.
    X field(const S& t, const X& x, const U& u) const {
        return mode_field(with(u, zero()), mode_, t, x, p_);
    }
    /// a' with given directions.
    U rate(const U& u) const {
        return components(normal_components(*sys_, t_, x_, p_, field(t_, x_, u)));
    }

    /// u and lambda. Where several directions leave, one is found after the other, until all fit.
    bool find_start(const SlideEnd<M>& exit) {
        using std::abs;
        constexpr S small = S(64) * epsilon<S>;
        u_ = zero();
        for (int pass = 0; pass < 20; ++pass) { // (one or two where a' is affine in u)
            const U base = rate(u_), before = u_;
            for (int k = 0; k < n_; ++k) {
                U beside = u_;
                beside[k] += S(0.5);
                const U there = rate(beside);
                for (int i = 0; i < n_; ++i)
                    slope_(i, k) = S(2) * (there[i] - base[i]);
            }
            U w = base;
            for (int i = 0; i < n_; ++i)
                for (int k = 0; k < n_; ++k)
                    w[i] -= slope_(i, k) * u_[k];
            for (int sweep = 0; sweep < 200; ++sweep) {
                const U last = u_;
                for (int i = 0; i < n_; i = end(i))
                    if (!find_direction(i, w, exit))
                        return false;
                if (largest(U(u_ - last)) <= small)
                    break;
            }
            if (largest(U(u_ - before)) <= small)
                break;
        }
        const U now = rate(u_);
        S size(0);
        for (int i = 0; i < n_; ++i)
            for (int k = 0; k < n_; ++k)
                size = std::max(size, S(abs(slope_(i, k))));
        for (int i = 0; i < n_; ++i)
            if (!inside_[std::size_t(i)] ||
                !(abs(now[i] - lambda_[i] * u_[i]) <= S(1e-9) * (size + abs(lambda_[i]))))
                return false;
        return true;
    }
    S largest(const U& u) const {
        using std::abs;
        S all(0);
        for (int i = 0; i < n_; ++i)
            all = std::max(all, S(abs(u[i])));
        return all;
    }
    /// u and lambda of the direction whose first component is the b-th, the others as they are;
    /// within the disc it rests.
    bool find_direction(int b, const U& w, const SlideEnd<M>& exit) {
        using std::abs;
        using std::sqrt;
        const int e = end(b), n = e - b;
        U push = zero();
        S most(0);
        for (int i = b; i < e; ++i) {
            push[i - b] = w[i];
            for (int k = 0; k < n_; ++k)
                if (k < b || k >= e)
                    push[i - b] += slope_(i, k) * u_[k];
            most += push[i - b] * push[i - b];
        }
        const auto against = [&](const S& lambda, U v) {
            W a = W::Zero();
            for (int i = b; i < e; ++i)
                for (int k = b; k < e; ++k)
                    a(i - b, k - b) = (i == k ? lambda : S(0)) - slope_(i, k);
            const bool solved = eliminate(a, v, n) > S(0);
            return solved ? v : U(U::Constant(std::numeric_limits<S>::quiet_NaN()));
        };
        const auto product = [&](const U& v, const U& z) {
            S sum(0);
            for (int i = 0; i < n; ++i)
                sum += v[i] * z[i];
            return sum;
        };
        S lambda(0);
        U u = against(lambda, push);
        const S margin = S(1) - product(u, u);
        if (!(abs(margin) <= std::numeric_limits<S>::max()))
            return false;
        const bool tied = exit.side[on_[b]] < 0 || abs(margin) <= S(1024) * epsilon<S>;
        if (!tied && margin < S(0)) {
            S low(0), high = sqrt(most);
            for (int k = 0; k < 100; ++k) { // |u| falls: Newton on 1/|u| - 1, nearly a line
                const S size = sqrt(product(u, u)), off = S(1) / size - S(1);
                (off < S(0) ? low : high) = lambda;
                const S bend = product(u, against(lambda, u)) / (size * size * size);
                S next = lambda - off / bend;
                if (!(next > low && next < high))
                    next = low + (high - low) / S(2);
                const bool done = abs(next - lambda) <= S(2) * epsilon<S> * next;
                lambda = next;
                u = against(lambda, push);
                if (done)
                    break;
            }
        }
        const bool rests = !tied && margin > S(0);
        const S size = rests ? S(1) : S(sqrt(product(u, u)));
        for (int i = b; i < e; ++i) {
            u_[i] = u[i - b] / size;
            lambda_[i] = lambda;
            tied_[std::size_t(i)] = tied;
            inside_[std::size_t(i)] = !rests;
        }
        return true;
    }
    /// True if s of the direction whose first component is the i-th, which is on the edge of the
    /// disc, is about to leave it.
    bool leaves_disc(int i, const S& tau) const {
        using std::abs;
        Mode<M> stuck = mode_;
        SetOff<S, M> others = with(u_, zero()).off;
        others.on = {};
        for (int k = 0; k < n_; ++k)
            if (k >= i && k < end(i))
                stuck.set(on_[k], 0);
            else
                others.on.add(on_[k]);
        const Leaving<Sys, S> rest(*sys_, others);
        const auto field = [&](const auto& t, const auto& x, const auto& p) {
            return mode_field(rest, stuck, t, x, p);
        };
        const auto margin = [&](const auto& t, const auto& x, const auto& p) {
            return sliding_margin(rest, stuck, on_[i], t, x, p).below;
        };
        const auto change = lie_derivatives<2>(field, margin, t_, x_, p_);
        S unit(1);
        for (const S& c : change) {
            unit *= tau;
            if (abs(c * unit) > S(1024) * epsilon<S>)
                return c < S(0);
        }
        return false;
    }
    /// v with ((order + 1) lambda - P W P) v = P rate: a term of u of this order in time.
    U turned(const U& rate, int order) const {
        W across = W::Zero(), a; // P, of all directions
        S size(0);
        for (int i = 0; i < n_; ++i)
            for (int k = 0; k < n_; ++k) {
                using std::abs;
                const S along = first(i) == first(k) ? u_[i] * u_[k] : S(0);
                across(i, k) = (i == k ? S(1) : S(0)) - along;
                size = std::max(size, S(abs(slope_(i, k))));
            }
        a = -(across * slope_ * across);
        U v = across * rate;
        for (int i = 0; i < n_; ++i)
            for (int k = 0; k < n_; ++k) {
                const S along = (i == k ? S(1) : S(0)) - across(i, k); // u u'
                a(i, k) += (i == k ? S(order + 1) * lambda_[i] : S(0)) + size * along;
            }
        eliminate(a, v, n_);
        return v;
    }
    int first(int i) const {
        while (is_kind(*sys_, on_[i], SurfaceKind::component))
            --i;
        return i;
    }

    const Sys* sys_;
    Mode<M> mode_;
    SurfaceSet<M> on_;
    int n_;
    S t_;
    X x_;
    Params<Sys, S> p_;
    W slope_ = W::Zero(); ///< of a' by u
    U u_ = zero(), turn_ = zero(), lambda_ = zero();
    std::array<bool, std::size_t(M)> tied_{}, inside_{}; ///< |s| = 1 where it rests; it moves
};

namespace detail {

/// True if all components of each direction among the surfaces `on` do the same: rest, or move.
template <class Sys>
bool moves_whole(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                 const SurfaceSet<surfaces_v<Sys>>& on) {
    for (const int j : on)
        if (is_directed(sys, j) && (mode[j] < 0 || mode[j] != mode[direction_begin(sys, j)]))
            return false;
    return true;
}

} // namespace detail

/// The directed surfaces among these that move in a mode: they leave rest.
template <class Sys>
SurfaceSet<surfaces_v<Sys>> leaving_rest(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                                         const SurfaceSet<surfaces_v<Sys>>& on) {
    SurfaceSet<surfaces_v<Sys>> leaving;
    for (const int j : on)
        if (is_directed(sys, j) && mode[j] != 0)
            leaving.add(j);
    return leaving;
}

/// Admissible modes where directions are at rest, and other surfaces may be met. As of several
/// surfaces: a mode is admissible if its own field keeps it.
///
/// A direction sticks where s, with which a' = 0, is in the unit disc, or on its edge and not about
/// to leave it. It leaves where there is a u with a' = lambda u; see LeavingRest. The verdict is
/// unique if one mode is admissible and what rests or leaves is shown to be held back by friction:
/// D W + W' D is negative definite, W = da'/du.
template <class Sys, class S>
FILIPPOV_COLD Verdict<surfaces_v<Sys>>
admissible_at_rest(const Sys& sys, const Mode<surfaces_v<Sys>>& before,
                   const SurfaceSet<surfaces_v<Sys>>& on, const S& t, const State<Sys, S>& x,
                   const Params<Sys, S>& p, const Arrival<S>& arrival,
                   const SlideEnd<surfaces_v<Sys>>& exit, NonUnique policy) {
    constexpr int M = surfaces_v<Sys>;
    Verdict<M> v;
    v.mode = before;
    v.finite = are_finite(regions_at(sys, before, on, t, x, p));
    if (!v.finite)
        return v;
    bool attracting = true;
    detail::in_each_mode(before, on, [&](const Mode<M>& mode) {
        if (!detail::moves_whole(sys, mode, on))
            return;
        const SurfaceSet<M> leaving = leaving_rest(sys, mode, on);
        SurfaceSet<M> others, held; // those that do not leave, and what friction acts on
        for (const int j : on) {
            if (!leaving.contains(j))
                others.add(j);
            if (leaving.contains(j) || mode[j] == 0)
                held.add(j);
        }
        LeavingRest<Sys, S> off(sys, mode, leaving, t, x, p);
        if (leaving.n > 0 && (arrival.direction < 0 || !off.solve(exit, arrival.tau)))
            return;
        const Leaving<Sys, S> system = off.system();
        Starts<M> starts;
        const auto regions = regions_at(system, mode, others, t, x, p);
        detail::Candidate<Leaving<Sys, S>, S> candidate(system, mode, before, regions, t, x, p,
                                                        arrival, nullptr);
        if (!candidate.admissible(exit, starts))
            return;
        attracting = attracting && candidate.attracts() &&
                     (leaving.n == 0 ||
                      attraction(sys, held, regions_at(sys, mode, held, t, x, p).flow) > S(0));
        v.add(mode, starts, policy);
    });
    v.unique = v.n_options == 1 && attracting;
    if (v.n_options == 0)
        v.reason = "a direction at rest neither sticks nor leaves";
    else if (v.n_options > 1)
        v.reason = "several modes are admissible where a direction is at rest";
    else if (!attracting)
        v.reason = "a direction at rest is not shown to be held back";
    return v;
}

} // namespace filippov
