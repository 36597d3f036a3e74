// SPDX-License-Identifier: BSD-3-Clause
// Points on a switching surface: how near is on it, and how to get there.
#pragma once

#include <filippov/core/elimination.hpp>
#include <filippov/system/derivatives.hpp>

#include <algorithm>
#include <limits>
#include <utility>

namespace filippov {

/// A set of surfaces, in rising order.
template <int M> struct SurfaceSet {
    std::array<int, std::size_t(M)> surface{};
    int n = 0;

    void add(int j) { surface[std::size_t(n++)] = j; }
    int operator[](int i) const { return surface[std::size_t(i)]; }
    bool contains(int j) const { return std::find(begin(), end(), j) != end(); }
    const int* begin() const { return surface.data(); }
    const int* end() const { return surface.data() + n; }
};

/// The surfaces slid on in `mode`.
template <int M> SurfaceSet<M> slid_surfaces(const Mode<M>& mode) {
    SurfaceSet<M> on;
    for (int j = 0; j < M; ++j)
        if (mode[j] == 0)
            on.add(j);
    return on;
}

/// True if one of these is a component of a direction.
template <class Sys>
bool any_directed([[maybe_unused]] const Sys& sys,
                  [[maybe_unused]] const SurfaceSet<surfaces_v<Sys>>& on) {
    if constexpr (has_directions_v<Sys>)
        for (const int j : on)
            if (is_directed(sys, j))
                return true;
    return false;
}

/// Size of h_j that rounding of t and x alone can make: |h| below it is zero.
///
///   16 eps (sum_i |dh/dx_i| |x_i| + |dh/dt| |t|)
///
/// Scales with h, and not at all with the units of x and t.
template <class Sys, class S>
S rounding_band(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                const Params<Sys, S>& p) {
    using std::abs;
    const State<Sys, S> g = grad_h(sys, j, t, x, p);
    S sum = abs(h_t(sys, j, t, x, p) * t);
    for (int i = 0; i < dim_v<Sys>; ++i)
        sum += abs(g[i] * x[i]);
    return S(16 * epsilon<Real<S>>) * sum;
}

/// Size of h_j that rounding of x and t can make, and of the time at which a solution along `f` is
/// there.
template <class Sys, class S>
S rounding_band_along(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                      const Params<Sys, S>& p, const State<Sys, S>& f) {
    using std::abs;
    return rounding_band(sys, j, t, x, p) +
           S(8) * ulp(t) * abs(normal_component(sys, j, t, x, p, f));
}

/// How far h_j can change while each component of x changes by its length: sum_i |dh/dx_i| l_i.
template <class Sys, class S>
S change_over(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
              const State<Sys, S>& lengths) {
    using std::abs;
    const State<Sys, S> g = grad_h(sys, j, t, x, p);
    S sum(0);
    for (int i = 0; i < dim_v<Sys>; ++i)
        sum += abs(g[i]) * lengths[i];
    return sum;
}

/// Size of h_j below which a given start counts as on the surface: rounding, or a thousandth of the
/// absolute tolerance, below which the user said that nothing matters.
template <class Sys, class S>
S start_band(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
             const State<Sys, S>& atol) {
    return rounding_band(sys, j, t, x, p) + S(1e-3) * change_over(sys, j, t, x, p, atol);
}

namespace detail {

/// v in units of its largest component.
template <class S, int N> Vec<S, N> in_units_of_largest(const Vec<S, N>& v) {
    using std::abs;
    S largest(0);
    for (int i = 0; i < N; ++i)
        largest = select(abs(v[i]) > largest, S(abs(v[i])), largest);
    Vec<S, N> relative;
    for (int i = 0; i < N; ++i)
        relative[i] = v[i] / largest;
    return relative;
}

/// (g_i scale_i)^2 in units of their sum: exactly 1 where one component is all of the gradient.
template <class S, class R, int N>
FILIPPOV_INLINE Vec<S, N> shares(const Vec<S, N>& g, const Vec<R, N>& scale) {
    using Limits = std::numeric_limits<Real<S>>;
    const auto divided = [](Vec<S, N> squares) {
        S sum(0);
        for (int i = 0; i < N; ++i)
            sum += squares[i];
        for (int i = 0; i < N; ++i)
            squares[i] = squares[i] / sum;
        return std::pair{squares, sum};
    };
    Vec<S, N> squares;
    for (int i = 0; i < N; ++i)
        squares[i] = g[i] * g[i] * scale[i] * scale[i];
    auto [shares, sum] = divided(squares);
    const auto small = sum <= S(Limits::min() / Limits::epsilon());
    const auto large = sum >= S(Limits::max());
    if (any(small) || any(large)) [[unlikely]] { // squares that under- or overflow
        const Vec<S, N> slope = in_units_of_largest(g);
        const Vec<R, N> size = in_units_of_largest(scale);
        Vec<S, N> lengths;
        for (int i = 0; i < N; ++i)
            lengths[i] = slope[i] * size[i];
        lengths = in_units_of_largest(lengths);
        for (int i = 0; i < N; ++i)
            squares[i] = lengths[i] * lengths[i];
        const Vec<S, N> apart = divided(squares).first;
        for (int i = 0; i < N; ++i)
            shares[i] = select(small, apart[i], select(large, apart[i], shares[i]));
    }
    return shares;
}

} // namespace detail

/// One Newton step onto h_j = 0 along the gradient, in units of `scale` (one positive length per
/// component): x - h W g / (g' W g), W = diag(scale^2). The smallest change in the norm of the
/// error test, and so independent of the units of x.
///
/// @param scale  plain numbers, or lanes of them
/// @return x unchanged where h is zero already or the gradient vanishes
template <class Sys, class S, class R>
FILIPPOV_INLINE State<Sys, S> toward_surface(const Sys& sys, int j, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p,
                                             const Vec<R, dim_v<Sys>>& scale) {
    const S h = switching(sys, t, x, p)[j];
    if constexpr (std::floating_point<S>) // a dual that is zero still has derivatives
        if (h == S(0))
            return x;
    const State<Sys, S> g = grad_h(sys, j, t, x, p);
    if constexpr (!is_plain<S> && !is_wide<S>) { // duals and series divide by way of 1/norm
        int only = -1, n = 0;
        for (int i = 0; i < dim_v<Sys>; ++i)
            if (value_of(g[i]) != Real<S>(0)) {
                only = i;
                ++n;
            }
        if (n == 1) {
            State<Sys, S> y = x;
            y[only] = x[only] - h / g[only];
            return y;
        }
    }
    const State<Sys, S> shares = detail::shares(g, scale);
    State<Sys, S> y;
    for (int i = 0; i < dim_v<Sys>; ++i)
        y[i] = select(shares[i] > S(0), S(x[i] - h / g[i] * shares[i]), x[i]);
    return y;
}

/// Puts x on h_j = 0 to rounding: Newton until |h| stops falling, at most eight times.
template <class Sys, class S, class R>
State<Sys, S> project(const Sys& sys, int j, const S& t, State<Sys, S> x, const Params<Sys, S>& p,
                      const Vec<R, dim_v<Sys>>& scale) {
    using std::abs;
    S best = abs(switching(sys, t, x, p)[j]);
    for (int k = 0; k < 8 && any(best > S(0)); ++k) {
        const State<Sys, S> y = toward_surface(sys, j, t, x, p, scale);
        const S h = abs(switching(sys, t, y, p)[j]);
        const auto better = h < best;
        if (!any(better))
            break;
        best = select(better, h, best);
        for (int i = 0; i < dim_v<Sys>; ++i)
            x[i] = select(better, y[i], x[i]);
    }
    return x;
}

/// True if a state that was met on a surface may be moved by so much to lie on it to the last bit:
/// by rounding of itself and of the time of a solution as fast as `f`. Where h hardly depends on
/// the state, or on components that rest, rounding of h is no reason to move them.
template <class S, int N>
bool is_rounding(const Vec<S, N>& from, const Vec<S, N>& to, const Vec<S, N>& f, const S& t) {
    using std::abs;
    for (int i = 0; i < N; ++i)
        if (!(abs(to[i] - from[i]) <= S(32) * ulp(from[i]) + S(64) * ulp(t) * abs(f[i])))
            return false;
    return true;
}
/// True if no component is moved by more than its length.
template <class S, int N>
bool is_near(const Vec<S, N>& from, const Vec<S, N>& to, const Vec<S, N>& lengths) {
    using std::abs;
    for (int i = 0; i < N; ++i)
        if (!(abs(to[i] - from[i]) <= lengths[i]))
            return false;
    return true;
}

/// True if a state that was met on h_j = 0 may be moved to lie on it to the last bit: by rounding,
/// or by these lengths at most where no rounding explains why it is not there.
/// @param f  the field with which it came
template <class Sys, class S>
bool may_be_put_on(const Sys& sys, int j, const S& t, const Params<Sys, S>& p,
                   const State<Sys, S>& from, const State<Sys, S>& to, const State<Sys, S>& f,
                   const State<Sys, S>& lengths) {
    using std::abs;
    return is_rounding(from, to, f, t) ||
           (abs(switching(sys, t, from, p)[j]) > rounding_band_along(sys, j, t, from, p, f) &&
            is_near(from, to, lengths));
}

/// True of a system that may slide to second order.
template <class Sys>
inline constexpr bool slides_twice_v = single_v<Sys> && !HasEquivalentControl<Sys, double>;

namespace detail {

/// A point of h_j = 0, to the last bit if one component can put it there, and that component.
template <class Sys, class S> struct ExactPoint {
    State<Sys, S> x;
    int by = 0;
    S off = S(0); ///< what is left of h_j
};
/// @param x  on the surface, or near
template <class Sys, std::floating_point S>
FILIPPOV_COLD ExactPoint<Sys, S> exact_point(const Sys& sys, int j, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p) {
    using std::abs;
    const State<Sys, S> gradient = grad_h(sys, j, t, x, p);
    const S least = S(1e-3) * gradient.cwiseAbs().maxCoeff();
    S best = std::numeric_limits<S>::infinity();
    ExactPoint<Sys, S> found{x};
    for (int m = 0; m < dim_v<Sys> && best != S(0); ++m) {
        if (!(abs(gradient[m]) > least))
            continue;
        State<Sys, S> y = x;
        S h = switching(sys, t, y, p)[j];
        for (int k = 0; k < 4 && h != S(0); ++k) {
            y[m] -= h / gradient[m];
            h = switching(sys, t, y, p)[j];
        }
        if (abs(h) < best) {
            best = abs(h);
            found = {y, m, h};
        }
    }
    return found;
}
/// The mean of h_j' on both sides.
template <class Sys, class S>
S mean_rate(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
    Mode<surfaces_v<Sys>> mode;
    S sum(0);
    for (const int side : {-1, 1}) {
        mode.set(j, side);
        sum += normal_component(sys, j, t, x, p, side_field(sys, mode, t, x, p));
    }
    return S(0.5) * sum;
}

} // namespace detail

/// h_j' in a slide of second order, where both sides agree. It is a function on the surface: the
/// fields may end there like a root of |h_j|, which has no derivative across and none along.
template <class Sys, std::floating_point S>
FILIPPOV_COLD S rate_on_surface(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                                const Params<Sys, S>& p) {
    return detail::mean_rate(sys, j, t, detail::exact_point(sys, j, t, x, p).x, p);
}
/// Its derivative in the direction (dt, dx), which is turned along the surface: h_j stays the same
/// to the last bit, and roots of it are constants. (Where rounding forbids this each side is looked
/// at from a little way off, where slopes of roots are finite, and cancel if both sides have them.)
template <class Sys, std::floating_point S>
FILIPPOV_COLD S rate_change(const Sys& sys, int j, const S& t, const detail::ExactPoint<Sys, S>& at,
                            const Params<Sys, S>& p, const S& dt, State<Sys, S> dx) {
    const auto q = lift<1>(p);
    const auto h = [&](const auto& time, const auto& y) { return switching(sys, time, y, q)[j]; };
    const S slope = grad_h(sys, j, t, at.x, p)[at.by];
    const auto turn = [&](const State<Sys, S>& x) {
        for (int k = 0; k < 3; ++k)
            dx[at.by] -= directional(h, t, x, dt, dx) / slope;
        return directional(h, t, x, dt, dx) == S(0);
    };
    const S away =
        turn(at.x) && at.off == S(0) ? S(0) : S(1e5) * rounding_band(sys, j, t, at.x, p) / slope;
    Mode<surfaces_v<Sys>> mode;
    S sum(0);
    for (const int side : {-1, 1}) {
        mode.set(j, side);
        State<Sys, S> x = at.x;
        x[at.by] += S(side) * away;
        turn(x);
        const auto rate = [&](const auto& time, const auto& y) {
            return normal_component(sys, j, time, y, q, side_field(sys, mode, time, y, q));
        };
        sum += directional(rate, t, x, dt, dx);
    }
    return S(0.5) * sum;
}

/// How fast h_j of a surface with jumps changes in the region with these sides: the normal speed of
/// an impact.
template <class Sys, class S>
S normal_speed(const Sys& sys, const Mode<surfaces_v<Sys>>& side, int j, const S& t,
               const State<Sys, S>& x, const Params<Sys, S>& p) {
    return normal_component(sys, j, t, x, p, side_field(sys, side, t, x, p));
}
/// The region that a mode without some surfaces' sides is seen from: those surfaces from above.
template <int M> Mode<M> region_of(Mode<M> mode) {
    for (int j = 0; j < M; ++j)
        if (mode[j] == 0)
            mode.set(j, +1);
    return mode;
}

/// What holds a solution: some h_j = 0, and in contact with a surface that has jumps, or in a slide
/// of second order, h_j' = 0 as well.
template <class Sys> class Constraints {
    static constexpr int M = surfaces_v<Sys>;

public:
    static constexpr bool holds_rates = has_jumps_v<Sys> || slides_twice_v<Sys>;
    static constexpr int capacity = holds_rates ? 2 * M : M;

    Constraints() = default;
    /// Those of a mode.
    Constraints(const Sys& sys, const Mode<M>& mode) : side_(region_of(mode)) {
        for (int j = 0; j < M; ++j)
            if (mode[j] == 0)
                add(j, is_kind(sys, j, SurfaceKind::jump) || mode.holds_rate(j));
    }
    /// Those of a mode, and h_j = 0 of some surfaces more.
    Constraints(const Sys& sys, const Mode<M>& mode, const SurfaceSet<M>& met)
        : Constraints(sys, mode) {
        for (const int j : met)
            if (mode[j] != 0)
                add(j, false);
    }
    /// h_j = 0, and with `at_rest` h_j' = 0.
    void add(int j, bool at_rest) {
        row_[std::size_t(n_++)] = {j, false};
        if constexpr (holds_rates)
            if (at_rest)
                row_[std::size_t(n_++)] = {j, true};
    }

    int size() const { return n_; }
    /// Those that the state can do something about: a surface h(t) is where it is.
    template <class S>
    Constraints of_state(const Sys& sys, const S& t, const State<Sys, S>& x,
                         const Params<Sys, S>& p) const {
        Constraints some = *this;
        some.n_ = 0;
        for (int i = 0; i < n_; ++i) {
            const auto [j, speed] = row_[std::size_t(i)];
            if (speed || grad_h(sys, j, t, x, p).cwiseAbs().maxCoeff() > S(0) ||
                h_t(sys, j, t, x, p) == S(0))
                some.row_[std::size_t(some.n_++)] = row_[std::size_t(i)];
        }
        return some;
    }
    /// The i-th alone.
    Constraints only(int i) const {
        Constraints one;
        one.row_[0] = row_[std::size_t(i)];
        one.n_ = 1;
        one.side_ = side_;
        return one;
    }
    int surface(int i) const { return row_[std::size_t(i)].surface; }
    bool is_speed(int i) const { return row_[std::size_t(i)].speed; }
    /// Adds those of others.
    void add(const Constraints& others) {
        for (int i = 0; i < others.n_; ++i)
            row_[std::size_t(n_++)] = others.row_[std::size_t(i)];
    }

    template <class S>
    S value(const Sys& sys, int i, const S& t, const State<Sys, S>& x,
            const Params<Sys, S>& p) const {
        const auto [j, speed] = row_[std::size_t(i)];
        if constexpr (has_jumps_v<Sys>)
            if (speed)
                return normal_speed(sys, side_, j, t, x, p);
        if constexpr (slides_twice_v<Sys> && std::floating_point<S>)
            if (speed)
                return rate_on_surface(sys, j, t, x, p);
        return switching(sys, t, x, p)[j];
    }
    template <class S>
    State<Sys, S> gradient(const Sys& sys, int i, const S& t, const State<Sys, S>& x,
                           const Params<Sys, S>& p) const {
        const auto [j, speed] = row_[std::size_t(i)];
        if constexpr (has_jumps_v<Sys>)
            if (speed) {
                const auto q = lift<1>(p);
                const auto g = [&, surface = j](const auto& time, const auto& y) {
                    return normal_speed(sys, side_, surface, time, y, q);
                };
                State<Sys, S> gradient;
                for (int k = 0; k < dim_v<Sys>; ++k)
                    gradient[k] = directional(g, t, x, S(0), State<Sys, S>(State<Sys, S>::Unit(k)));
                return gradient;
            }
        if constexpr (slides_twice_v<Sys> && std::floating_point<S>)
            if (speed) {
                const auto exact = detail::exact_point(sys, j, t, x, p);
                State<Sys, S> gradient;
                for (int k = 0; k < dim_v<Sys>; ++k)
                    gradient[k] = rate_change(sys, j, t, exact, p, S(0),
                                              State<Sys, S>(State<Sys, S>::Unit(k)));
                return gradient;
            }
        return grad_h(sys, j, t, x, p);
    }

private:
    struct Row {
        int surface;
        bool speed;
    };
    std::array<Row, std::size_t(capacity)> row_{};
    int n_ = 0;
    Mode<M> side_{};
};

namespace detail {

/// Gradients of constraints, their lengths and the cosines between them, in units of `scale`.
template <class Sys, class S> struct Gradients {
    static constexpr int C = Constraints<Sys>::capacity;
    std::array<State<Sys, S>, std::size_t(C)> g;
    std::array<S, std::size_t(C)> length;
    Mat<S, C, C> cosine;
    Vec<Real<S>, dim_v<Sys>> weight; ///< squares of the scales, in units of the largest
};
template <class Sys, class S, class R>
Gradients<Sys, S> gradients(const Sys& sys, const Constraints<Sys>& on, const S& t,
                            const State<Sys, S>& x, const Params<Sys, S>& p,
                            const Vec<R, dim_v<Sys>>& scale) {
    using std::sqrt;
    Gradients<Sys, S> r;
    R largest(0);
    for (int i = 0; i < dim_v<Sys>; ++i)
        largest = std::max(largest, scale[i]);
    // Squares of tiny scales underflow, beside others too.
    const R least = sqrt(sqrt(std::numeric_limits<R>::min()));
    for (int i = 0; i < dim_v<Sys>; ++i) {
        const R share = std::max(R(scale[i] / largest), least);
        r.weight[i] = share * share;
    }
    const auto product = [&](int a, int b) {
        S sum(0);
        for (int i = 0; i < dim_v<Sys>; ++i)
            sum += r.g[std::size_t(a)][i] * r.g[std::size_t(b)][i] * r.weight[i];
        return sum;
    };
    for (int a = 0; a < on.size(); ++a) {
        r.g[std::size_t(a)] = on.gradient(sys, a, t, x, p);
        r.length[std::size_t(a)] = sqrt(product(a, a));
        for (int b = 0; b <= a; ++b)
            r.cosine(a, b) = r.cosine(b, a) =
                product(a, b) / (r.length[std::size_t(a)] * r.length[std::size_t(b)]);
    }
    return r;
}

} // namespace detail

/// True if the gradients of constraints are linearly independent: each at an angle of more than
/// a millionth to all before it, in units of `scale`.
template <class Sys, class S, class R>
bool independent(const Sys& sys, const Constraints<Sys>& on, const S& t, const State<Sys, S>& x,
                 const Params<Sys, S>& p, const Vec<R, dim_v<Sys>>& scale) {
    if constexpr (Constraints<Sys>::capacity > 1)
        if (on.size() > 1) {
            const auto gradients = detail::gradients(sys, on, t, x, p, scale);
            constexpr int C = Constraints<Sys>::capacity;
            Vec<S, C> none = Vec<S, C>::Constant(S(0));
            return eliminate(gradients.cosine, none, on.size()) > Real<S>(1e-12);
        }
    return true;
}

/// As many of some constraints as have independent gradients: all, if all do; else those at the
/// largest angles to the ones before.
template <class Sys, class S, class R>
FILIPPOV_COLD Constraints<Sys>
independent_part(const Sys& sys, const Constraints<Sys>& on, const S& t, const State<Sys, S>& x,
                 const Params<Sys, S>& p, const Vec<R, dim_v<Sys>>& scale) {
    if (independent(sys, on, t, x, p, scale))
        return on;
    auto rest = detail::gradients(sys, on, t, x, p, scale).cosine; // of what is left of them
    std::array<bool, std::size_t(Constraints<Sys>::capacity)> kept{};
    for (int n = 0; n < on.size(); ++n) {
        int next = -1;
        for (int a = 0; a < on.size(); ++a)
            if (!kept[std::size_t(a)] && rest(a, a) > S(1e-12) &&
                (next < 0 || rest(a, a) > rest(next, next)))
                next = a;
        if (next < 0)
            break;
        kept[std::size_t(next)] = true;
        for (int a = 0; a < on.size(); ++a)
            for (int b = 0; b < on.size(); ++b)
                if (!kept[std::size_t(a)] && !kept[std::size_t(b)])
                    rest(a, b) -= rest(a, next) * rest(next, b) / rest(next, next);
    }
    Constraints<Sys> part = on.only(0);
    bool first = true;
    for (int a = 0; a < on.size(); ++a) {
        if (!kept[std::size_t(a)])
            continue;
        if (first)
            part = on.only(a);
        else
            part.add(on.only(a));
        first = false;
    }
    return part;
}

/// True if h_b changes as h_a does, times a constant, from a point (t, x) on both to others around.
template <class Sys, class S>
FILIPPOV_COLD bool is_same_surface(const Sys& sys, int a, int b, const S& t, const State<Sys, S>& x,
                                   const Params<Sys, S>& p) {
    using std::abs;
    const auto here = switching(sys, t, x, p);
    S factor(0); // 0: not known yet
    for (int i = 0; i <= dim_v<Sys>; ++i)
        for (const double step : {1e-3, -0.7, 2.1}) {
            State<Sys, S> y = x;
            S time = t;
            S& moved = i < dim_v<Sys> ? y[i] : time;
            moved += S(step) * std::max(S(1), S(abs(moved)));
            const auto there = switching(sys, time, y, p);
            const S by_a = there[a] - here[a], by_b = there[b] - here[b];
            if (factor == S(0) && abs(by_a) > S(0))
                factor = by_b / by_a;
            if ((factor == S(0) && abs(by_a) > S(0)) ||
                !(abs(by_b - factor * by_a) <=
                  S(1e-9) * abs(by_b) + S(64) * rounding_band(sys, b, time, y, p)))
                return false;
        }
    return factor != S(0);
}

/// True if x, which lies on as many constraints as are independent, lies on all: to rounding, or to
/// a thousandth of the tolerance, by which what is met at one point may differ.
template <class Sys, class S, class R>
FILIPPOV_COLD bool lies_on(const Sys& sys, const Constraints<Sys>& on, const S& t,
                           const State<Sys, S>& x, const Params<Sys, S>& p,
                           const Vec<R, dim_v<Sys>>& scale) {
    using std::abs;
    for (int a = 0; a < on.size(); ++a) {
        const State<Sys, S> g = on.gradient(sys, a, t, x, p);
        if (!(g.cwiseAbs().maxCoeff() > S(0)))
            return false;
        const S unit = S(64 * epsilon<Real<S>>);
        S band = unit * abs(h_t(sys, on.surface(a), t, x, p)) * (on.is_speed(a) ? S(1) : abs(t));
        for (int i = 0; i < dim_v<Sys>; ++i)
            band += abs(g[i]) * (unit * abs(x[i]) + S(1e-3) * scale[i]);
        if (!(abs(on.value(sys, a, t, x, p)) <= band))
            return false;
    }
    return true;
}

namespace detail {

/// One Newton step onto constraints, by the smallest change in units of `scale`:
/// x - W G' (G W G')^-1 g.
template <class Sys, class S, class R>
FILIPPOV_NOINLINE State<Sys, S> toward_all(const Sys& sys, const Constraints<Sys>& on, const S& t,
                                           const State<Sys, S>& x, const Params<Sys, S>& p,
                                           const Vec<R, dim_v<Sys>>& scale) {
    if (on.size() == 1)
        return toward_surface(sys, on.surface(0), t, x, p, scale);
    const auto gradients = detail::gradients(sys, on, t, x, p, scale);
    Vec<S, Constraints<Sys>::capacity> share;
    for (int a = 0; a < on.size(); ++a)
        share[a] = on.value(sys, a, t, x, p) / gradients.length[std::size_t(a)];
    eliminate(gradients.cosine, share, on.size());
    State<Sys, S> y = x;
    for (int a = 0; a < on.size(); ++a)
        for (int i = 0; i < dim_v<Sys>; ++i)
            y[i] -= gradients.g[std::size_t(a)][i] * gradients.weight[i] *
                    (share[a] / gradients.length[std::size_t(a)]);
    return y;
}

/// Puts x on constraints to rounding: Newton until the largest violation, in units of the
/// gradients, stops falling, at most eight times.
template <class Sys, class S, class R>
FILIPPOV_NOINLINE State<Sys, S> project_all(const Sys& sys, const Constraints<Sys>& on, const S& t,
                                            State<Sys, S> x, const Params<Sys, S>& p,
                                            const Vec<R, dim_v<Sys>>& scale) {
    using std::abs;
    if (on.size() == 0)
        return x;
    if (on.size() == 1)
        return project(sys, on.surface(0), t, x, p, scale);
    const auto gradients = detail::gradients(sys, on, t, x, p, scale);
    const auto distance = [&](const State<Sys, S>& y) {
        S largest(0);
        for (int a = 0; a < on.size(); ++a)
            largest = std::max(
                largest, S(abs(on.value(sys, a, t, y, p)) / gradients.length[std::size_t(a)]));
        return largest;
    };
    S best = distance(x);
    for (int k = 0; k < 8 && best > S(0); ++k) {
        const State<Sys, S> y = toward_all(sys, on, t, x, p, scale);
        const S now = distance(y);
        if (!(now < best))
            break;
        best = now;
        x = y;
    }
    // One after another: exact to the last bit where each surface has a component of its own.
    State<Sys, S> y = x;
    for (int a = 0; a < on.size() && best > S(0); ++a)
        y = toward_all(sys, on.only(a), t, y, p, scale);
    return distance(y) < best ? y : x;
}

} // namespace detail

/// One Newton step onto constraints, by the smallest change in units of `scale`.
template <class Sys, class S, class R>
FILIPPOV_INLINE State<Sys, S> toward(const Sys& sys, const Constraints<Sys>& on, const S& t,
                                     const State<Sys, S>& x, const Params<Sys, S>& p,
                                     const Vec<R, dim_v<Sys>>& scale) {
    if constexpr (slides_twice_v<Sys> && std::floating_point<S>)
        if (on.size() > 1) [[unlikely]]
            return detail::toward_all(sys, on, t, x, p, scale);
    if constexpr (single_v<Sys>)
        return toward_surface(sys, 0, t, x, p, scale);
    else
        return detail::toward_all(sys, on, t, x, p, scale);
}

/// Puts x on constraints to rounding.
template <class Sys, class S, class R>
FILIPPOV_INLINE State<Sys, S> project(const Sys& sys, const Constraints<Sys>& on, const S& t,
                                      const State<Sys, S>& x, const Params<Sys, S>& p,
                                      const Vec<R, dim_v<Sys>>& scale) {
    if constexpr (slides_twice_v<Sys> && std::floating_point<S>)
        if (on.size() > 1) [[unlikely]]
            return detail::project_all(sys, on, t, x, p, scale);
    if constexpr (single_v<Sys>)
        return on.size() > 0 ? project(sys, 0, t, x, p, scale) : x;
    else
        return detail::project_all(sys, on, t, x, p, scale);
}

} // namespace filippov
