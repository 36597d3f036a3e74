// SPDX-License-Identifier: BSD-3-Clause
// Sliding on several surfaces at once: the regions that meet there, and their blend.
#pragma once

#include <filippov/sliding.hpp>

namespace filippov {

/// How the fields of the regions around an intersection are blended, where they leave a choice.
/// (On one surface, and wherever the field is affine in s, they leave none.)
enum class Selection : unsigned char {
    /// Affine in each s_j: a region's share is the product of (1 +- s_j)/2. Utkin's method with a
    /// control a surface. Alexander & Seidman (1998), Houston J. Math. 24, 545-569.
    multilinear,
    /// The shares l_v solve sum s1 s2 |w_v| l_v = 0, w_v the normal components in region v (two
    /// surfaces). Dieci & Difonzo (2015), J. Comput. Appl. Math. 288, 57-73.
    moments,
};

/// The selection of a system: `static constexpr Selection selection`, multilinear if absent.
template <class Sys>
inline constexpr Selection selection_v = [] {
    if constexpr (requires { Sys::selection; })
        return Sys::selection;
    else
        return Selection::multilinear;
}();

/// A system with the moments selection.
template <class Sys> struct WithMoments : Sys {
    static_assert(surfaces_v<Sys> == 2,
                  "filippov: the moments selection is defined for two surfaces");
    static constexpr Selection selection = Selection::moments;
};

/// Most surfaces of a system: 2^M regions can meet.
inline constexpr int max_surfaces = 8;

/// What 2^n regions around an intersection of n surfaces do to these surfaces: component i of
/// normal[v] is L of the i-th surface in region v. Bit i of v: the region is where its h > 0.
template <class S, int M> struct NormalField {
    static_assert(M <= max_surfaces, "filippov: a system has at most 8 surfaces");
    int n = 0;
    std::array<Vec<S, M>, std::size_t(1) << M> normal;

    unsigned regions() const { return 1u << n; }
    const S& operator()(unsigned v, int i) const { return normal[v][i]; }
};

/// The regions around an intersection, their fields and what these do to its surfaces.
template <class Sys, class S> struct Regions {
    static constexpr int M = surfaces_v<Sys>;
    SurfaceSet<M> on;
    std::array<State<Sys, S>, std::size_t(1) << M> field;
    NormalField<S, M> flow;
};

/// L_j of a field value for all surfaces.
template <class Sys, class S>
Vec<S, surfaces_v<Sys>> normal_components(const Sys& sys, const S& t, const State<Sys, S>& x,
                                          const Params<Sys, S>& p, const State<Sys, S>& f) {
    Vec<Taylor<S, 1>, dim_v<Sys>> y = lift<1>(x);
    for (int i = 0; i < dim_v<Sys>; ++i)
        y[i].c[1] = f[i];
    const auto h = switching(sys, Taylor<S, 1>::variable(t), y, lift<1>(p));
    Vec<S, surfaces_v<Sys>> normal;
    for (int j = 0; j < surfaces_v<Sys>; ++j)
        normal[j] = h[j].c[1];
    return normal;
}

/// How a surface with jumps pushes back in contact: what it adds to the field for one unit of
/// normal acceleration, in the direction in which its impacts throw the state.
///
/// An impact is x+ = x + W(x) h', so in contact F_s = F - W h''/(W h')', whatever the length of W;
/// W comes from the derivative of `jump` at h' = 0.
/// @return zero if the jump does not turn the normal speed: then there is no contact
/// @source di Bernardo, Budd, Champneys & Kowalczyk (2008), Piecewise-smooth Dynamical Systems,
///         section 2.2.4
template <class Sys, class S>
State<Sys, S> contact_push(const Sys& sys, const Mode<surfaces_v<Sys>>& side, int j, const S& t,
                           const State<Sys, S>& x, const Params<Sys, S>& p) {
    const auto q = lift<1>(p);
    const auto speed = [&](const auto& time, const auto& y) {
        return normal_speed(sys, side, j, time, y, q);
    };
    Vec<Taylor<S, 1>, dim_v<Sys>> y = lift<1>(x);
    for (int i = 0; i < dim_v<Sys>; ++i)
        y[i].c[1] = directional(speed, t, x, S(0), State<Sys, S>(State<Sys, S>::Unit(i)));
    const auto after = sys.jump(j, Taylor<S, 1>(t), y, q);
    State<Sys, S> push;
    S turn(0);
    for (int i = 0; i < dim_v<Sys>; ++i) {
        push[i] = y[i].c[1] - after[i].c[1];
        turn += y[i].c[1] * push[i];
    }
    for (int i = 0; i < dim_v<Sys>; ++i)
        push[i] = turn > S(0) ? S(push[i] / turn) : S(0);
    return push;
}

namespace detail {

/// Contact with a surface that has jumps as a slide: between the field, and the field pushed so
/// hard that it leaves whatever it was (by one unit of acceleration more than twice the largest;
/// the sliding field does not depend on it). The slide ends where the share of the push vanishes.
template <class Sys, class S>
void push_regions(const Sys& sys, Regions<Sys, S>& r, const Mode<surfaces_v<Sys>>& side, int i,
                  const S& t, const State<Sys, S>& x, const Params<Sys, S>& p) {
    using std::abs;
    const auto q = lift<1>(p);
    const auto speed = [&](const auto& time, const auto& y) {
        return normal_speed(sys, side, r.on[i], time, y, q);
    };
    const unsigned bit = 1u << i;
    S largest(0);
    for (unsigned v = 0; v < r.flow.regions(); ++v) {
        r.flow.normal[v][i] = directional(speed, t, x, S(1), r.field[v]);
        largest = std::max(largest, S(abs(r.flow.normal[v][i])));
    }
    const State<Sys, S> push = contact_push(sys, side, r.on[i], t, x, p);
    S length(0);
    for (int k = 0; k < dim_v<Sys>; ++k)
        length += abs(push[k]);
    const S strength = length > S(0) ? S(1) + S(2) * largest : S(0);
    for (unsigned v = 0; v < r.flow.regions(); ++v)
        if ((v & bit) == 0) {
            for (int k = 0; k < dim_v<Sys>; ++k)
                r.field[v][k] += strength * push[k];
            r.flow.normal[v][i] += strength;
        }
}

} // namespace detail

/// The regions that meet where the surfaces `on` do, the other surfaces as in `mode`. Of a surface
/// with jumps one is free, the other pushed, and what they do to it is to its normal speed.
/// @cost 2^n fields and derivatives of h
template <class Sys, class S>
FILIPPOV_NOINLINE Regions<Sys, S> regions_at(const Sys& sys, Mode<surfaces_v<Sys>> mode,
                                             const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p) {
    constexpr int M = surfaces_v<Sys>;
    const int n = std::min(on.n, M);
    const auto jumps = [&](int i) { return is_kind(sys, on[i], SurfaceKind::jump); };
    Regions<Sys, S> r;
    r.on = on;
    r.flow.n = n;
    for (unsigned v = 0; v < r.flow.regions(); ++v) {
        for (int i = 0; i < n; ++i)
            mode.set(on[i], jumps(i) || (v >> i & 1u) != 0 ? 1 : -1);
        r.field[v] = side_field(sys, mode, t, x, p);
    }
    if constexpr (has_jumps_v<Sys>)
        for (int i = 0; i < n; ++i)
            if (jumps(i))
                detail::push_regions(sys, r, region_of(mode), i, t, x, p);
    for (unsigned v = 0; v < r.flow.regions(); ++v) {
        const auto normal = normal_components(sys, t, x, p, r.field[v]);
        for (int i = 0; i < n; ++i)
            if (!jumps(i))
                r.flow.normal[v][i] = normal[on[i]];
    }
    return r;
}

/// Distances of each s_i from the ends of its range, 1 + s_i and 1 - s_i, and each region's share.
/// NaN where there is no sliding field.
template <class S, int M> struct Blend {
    Vec<S, M> below, above;
    std::array<S, std::size_t(1) << M> share;
};

namespace detail {

/// The normal components at a point of the cube of s, and their derivatives, from its corners.
/// @param share  (1 + s_i)/2
template <class S, int M> struct Multilinear {
    const NormalField<S, M>& w;

    Vec<S, M> value(const Vec<S, M>& share) const { return folded(share, -1); }
    /// d/d share_k
    Vec<S, M> slope(const Vec<S, M>& share, int k) const { return folded(share, k); }

private:
    /// Corners folded together, one surface after another; along `k` their difference.
    Vec<S, M> folded(const Vec<S, M>& share, int k) const {
        if (w.n == 0)
            return w.normal[0];
        std::array<Vec<S, M>, (std::size_t(1) << M) / 2> fold;
        const auto fold_along = [&](int i, const auto& normal) {
            const unsigned half = 1u << i;
            for (unsigned v = 0; v < half; ++v)
                for (int r = 0; r < w.n; ++r) {
                    const S &low = normal[v][r], &high = normal[v + half][r];
                    fold[v][r] =
                        i == k ? S(high - low) : S(low * (S(1) - share[i]) + high * share[i]);
                }
        };
        fold_along(w.n - 1, w.normal);
        for (int i = w.n - 2; i >= 0; --i)
            fold_along(i, fold);
        return fold[0];
    }
};

/// One Newton step for the shares at which all normal components vanish.
/// @return the smallest relative pivot, 0 if singular
template <class S, int M>
Real<S> newton_step(const NormalField<S, M>& w, const Vec<S, M>& share, Vec<S, M>& step) {
    const Multilinear<S, M> blend{w};
    Mat<S, M, M> slope;
    for (int k = 0; k < w.n; ++k) {
        const Vec<S, M> column = blend.slope(share, k);
        for (int i = 0; i < w.n; ++i)
            slope(i, k) = column[i];
    }
    const Vec<S, M> value = blend.value(share);
    for (int i = 0; i < w.n; ++i)
        step[i] = -value[i];
    return eliminate(slope, step, w.n);
}

template <class S, int M> NormalField<Real<S>, M> values_of_field(const NormalField<S, M>& w) {
    NormalField<Real<S>, M> plain;
    plain.n = w.n;
    for (unsigned v = 0; v < w.regions(); ++v)
        for (int i = 0; i < w.n; ++i)
            plain.normal[v][i] = value_of(w(v, i));
    return plain;
}

/// Shares (1 + s_i)/2 of two surfaces, from a quadratic. Of its two solutions only the one with
/// det dL/ds > 0 can attract: that one, unless it is not in the cube and the other is nearer.
template <std::floating_point R, int M> Vec<R, M> shares_of_two(const NormalField<R, M>& w) {
    // L_i = a_i + b_i u + c_i v + d_i u v, each row in units of its largest entry
    R a[2], b[2], c[2], d[2];
    for (int i = 0; i < 2; ++i) {
        R size(0);
        for (unsigned v = 0; v < 4; ++v)
            size = std::max(size, std::abs(w(v, i)));
        a[i] = w(0, i) / size;
        b[i] = w(1, i) / size - a[i];
        c[i] = w(2, i) / size - a[i];
        d[i] = w(3, i) / size - w(2, i) / size - b[i];
    }
    // The resultant A u^2 + B u + C; its derivative is the determinant.
    const R A = b[0] * d[1] - b[1] * d[0], C = a[0] * c[1] - a[1] * c[0];
    const R B = a[0] * d[1] + b[0] * c[1] - a[1] * d[0] - b[1] * c[0];
    const R root = std::sqrt(B * B - R(4) * A * C);
    const auto with = [&](const R& u) {
        const R slope0 = c[0] + d[0] * u, slope1 = c[1] + d[1] * u;
        Vec<R, M> share = Vec<R, M>::Zero();
        share[0] = u;
        share[1] = std::abs(slope0) > std::abs(slope1) ? -(a[0] + b[0] * u) / slope0
                                                       : -(a[1] + b[1] * u) / slope1;
        return share;
    };
    const auto outside = [](const Vec<R, M>& share) {
        const R far = std::abs(share[0] - R(0.5)) + std::abs(share[1] - R(0.5));
        return far < std::numeric_limits<R>::infinity()
                   ? std::max(std::abs(share[0] - R(0.5)), std::abs(share[1] - R(0.5)))
                   : std::numeric_limits<R>::infinity();
    };
    const R sum = B >= R(0) ? B + root : B - root; // of equal signs: no cancellation
    const R u = R(-2) * C / sum, v = sum / (R(-2) * A);
    const Vec<R, M> attracting = with(B >= R(0) ? u : v), other = with(B >= R(0) ? v : u);
    return outside(attracting) <= std::max(R(0.5), outside(other)) ? attracting : other;
}

/// Shares of three and more surfaces: damped Newton from the centre of the cube; NaN if it does not
/// converge in 60 steps.
template <std::floating_point R, int M> Vec<R, M> shares_of_many(const NormalField<R, M>& w) {
    const Multilinear<R, M> blend{w};
    Vec<R, M> size = Vec<R, M>::Zero();
    for (unsigned v = 0; v < w.regions(); ++v)
        for (int i = 0; i < w.n; ++i)
            size[i] = std::max(size[i], std::abs(w(v, i)));
    const auto residual = [&](const Vec<R, M>& share) {
        const Vec<R, M> value = blend.value(share);
        R sum(0);
        for (int i = 0; i < w.n; ++i)
            sum += (value[i] / size[i]) * (value[i] / size[i]);
        return sum;
    };
    const auto nan = std::numeric_limits<R>::quiet_NaN();
    Vec<R, M> share = Vec<R, M>::Constant(R(0.5)), step = Vec<R, M>::Zero();
    R now = residual(share);
    for (int k = 0; k < 60; ++k) {
        if (!(newton_step(w, share, step) > R(0)))
            break;
        R length(0), damping(1);
        for (int i = 0; i < w.n; ++i)
            length = std::max(length, std::abs(step[i]));
        Vec<R, M> next = share;
        R then = now;
        for (int halving = 0; halving < 20; ++halving, damping /= R(2)) {
            for (int i = 0; i < w.n; ++i)
                next[i] = share[i] + damping * step[i];
            then = residual(next);
            if (then < now || length < R(1e-9))
                break;
        }
        share = next;
        now = then;
        if (length < R(1e-9) || now < R(1e-18)) // what is left is squared twice by the blend
            return share;
        if (!(length < std::numeric_limits<R>::infinity()))
            break;
    }
    return Vec<R, M>::Constant(nan);
}

/// The multilinear blend: shares by their values, then Newton from the nearest corner of the cube,
/// so that the distances from it lose no digits, and duals and series get their derivatives.
template <class S, int M>
FILIPPOV_NOINLINE Blend<S, M> multilinear_blend(const NormalField<S, M>& w) {
    using R = Real<S>;
    const NormalField<R, M> plain = values_of_field(w);
    const int n = std::min(w.n, M);
    Vec<R, M> guess = Vec<R, M>::Zero();
    if (n == 1)
        guess[0] = plain(0, 0) / (plain(0, 0) - plain(1, 0));
    else if constexpr (M > 1)
        guess = n == 2 ? shares_of_two(plain) : shares_of_many(plain);
    unsigned corner = 0;
    for (int i = 0; i < n; ++i)
        corner |= unsigned(guess[i] > R(0.5)) << i;
    NormalField<S, M> seen;
    seen.n = w.n;
    for (unsigned v = 0; v < w.regions(); ++v)
        seen.normal[v] = w.normal[v ^ corner];
    Vec<S, M> distance = Vec<S, M>::Constant(S(0)), step = distance;
    for (int i = 0; i < n; ++i)
        distance[i] = S((corner >> i & 1u) != 0 ? R(1) - guess[i] : guess[i]);
    // Each step squares the error; an infinitesimal of order 2^k - 1 is right after k.
    constexpr int steps = std::floating_point<S> ? 2 : 3;
    for (int k = 0; k < steps; ++k) {
        if (!(newton_step(seen, distance, step) > R(0)))
            break;
        bool done = std::floating_point<S>;
        for (int i = 0; i < n; ++i) {
            distance[i] += step[i];
            if constexpr (std::floating_point<S>)
                done = done && step[i] * step[i] <= epsilon<R> * distance[i] * distance[i];
        }
        if (done)
            break;
    }
    Blend<S, M> blend;
    for (int i = 0; i < n; ++i) {
        const S near = S(2) * distance[i], far = S(2) - near;
        blend.below[i] = (corner >> i & 1u) != 0 ? far : near;
        blend.above[i] = (corner >> i & 1u) != 0 ? near : far;
    }
    for (unsigned v = 0; v < w.regions(); ++v) {
        S share(1);
        for (int i = 0; i < n; ++i)
            share = share * ((v >> i & 1u) != 0 ? blend.below[i] : blend.above[i]) * S(0.5);
        blend.share[v] = share;
    }
    return blend;
}

/// The moments blend of two surfaces.
template <class S, int M> Blend<S, M> moments_blend(const NormalField<S, M>& w) {
    using std::sqrt;
    constexpr int four = 4;
    Mat<S, four, four> a;
    Vec<S, four> b;
    // Each normal component in units of its size, without which |w| would have none.
    for (int i = 0; i < 2; ++i) {
        S size(0);
        for (unsigned v = 0; v < 4; ++v)
            size += w(v, i) * w(v, i);
        size = sqrt(size);
        for (unsigned v = 0; v < 4; ++v)
            a(i, int(v)) = w(v, i) / size;
        b[i] = S(0);
    }
    for (unsigned v = 0; v < 4; ++v) {
        const S x = a(0, int(v)), y = a(1, int(v)), length = sqrt(x * x + y * y);
        a(2, int(v)) = v == 0 || v == 3 ? length : S(-length);
        a(3, int(v)) = S(1);
    }
    b[2] = S(0);
    b[3] = S(1);
    if (!(eliminate(a, b, four) > Real<S>(0)))
        b = Vec<S, four>::Constant(S(std::numeric_limits<Real<S>>::quiet_NaN()));
    Blend<S, M> blend;
    for (unsigned v = 0; v < 4; ++v)
        blend.share[v] = b[int(v)];
    for (int i = 0; i < 2; ++i) {
        const unsigned bit = 1u << i, other = 3u - bit;
        blend.below[i] = S(2) * (b[int(bit)] + b[3]);
        blend.above[i] = S(2) * (b[0] + b[int(other)]);
    }
    return blend;
}

} // namespace detail

/// The shares of the regions with which all normal components vanish.
/// @error NaN where there are none, or none could be found
template <class Sys, class S>
Blend<S, surfaces_v<Sys>> blend_of(const NormalField<S, surfaces_v<Sys>>& w) {
    if constexpr (selection_v<Sys> == Selection::moments)
        if (w.n == 2)
            return detail::moments_blend(w);
    return detail::multilinear_blend(w);
}

// --- attraction --------------------------------------------------------------------------------

namespace detail {

/// How surely every solution of z' = w(sign z) in the plane reaches 0: positive if they do, exact.
///
/// They do unless a quadrant's field leads out of it, or a slide along a half-axis leads outward,
/// or solutions turn round and come back no nearer. The least of these margins, each in units of
/// the field's size, is continuous where it changes sign.
template <std::floating_point R, int M> R attraction_in_plane(const NormalField<R, M>& w) {
    R size[2] = {R(0), R(0)};
    for (unsigned v = 0; v < 4; ++v)
        for (int i = 0; i < 2; ++i)
            size[i] = std::max(size[i], std::abs(w(v, i)));
    R least(1);
    bool slides = false;
    for (int i = 0; i < 2; ++i)
        for (const int side : {-1, 1}) {
            const int k = 1 - i;
            const unsigned low = side > 0 ? 1u << k : 0u, high = low | 1u << i;
            const R l = w(low, i), r = w(high, i);
            if ((l > R(0)) == (r > R(0)))
                continue; // crossed
            const R speed = (l * w(high, k) - r * w(low, k)) / (l - r);
            least = std::min(least, R(-side) * speed / size[k]);
            slides = slides || l > R(0);
        }
    R turn(1);
    for (unsigned v = 0; v < 4; ++v) {
        R inward(-1), grows(0), falls(0);
        int growing = 0;
        for (int i = 0; i < 2; ++i) {
            const R outward = (v >> i & 1u) != 0 ? w(v, i) : -w(v, i);
            inward = std::max(inward, -outward / size[i]);
            growing += outward >= R(0);
            (outward >= R(0) ? grows : falls) = std::abs(w(v, i));
        }
        least = std::min(least, inward);
        if (growing == 1)
            turn *= grows / falls;
    }
    return slides ? least : std::min(least, R(1) - turn - R(16) * epsilon<R>);
}

/// How surely all regions' fields lead towards all surfaces, so that max |z_i| falls along every
/// solution: positive if they do.
template <std::floating_point R, int M> R attraction_from_all(const NormalField<R, M>& w) {
    R least(1);
    for (int i = 0; i < w.n; ++i) {
        R size(0);
        for (unsigned v = 0; v < w.regions(); ++v)
            size = std::max(size, std::abs(w(v, i)));
        for (unsigned v = 0; v < w.regions(); ++v)
            least = std::min(least, ((v >> i & 1u) != 0 ? -w(v, i) : w(v, i)) / size);
    }
    return least;
}

/// d with which the couplings i -> k and k -> i of a matrix are equally strong, and a one-way
/// coupling is weak.
template <std::floating_point R, int M> Vec<R, M> balancing(const Mat<R, M, M>& a, int n) {
    Vec<R, M> d = Vec<R, M>::Zero();
    for (int start = 0; start < n; ++start) {
        if (d[start] > R(0))
            continue;
        d[start] = R(1) / -a(start, start);
        for (int pass = 0; pass < n; ++pass)
            for (int i = 0; i < n; ++i)
                for (int k = 0; k < n; ++k) {
                    if (!(d[i] > R(0)) || d[k] > R(0))
                        continue;
                    const R there = std::abs(a(i, k)), back = std::abs(a(k, i));
                    if (there > R(0) && back > R(0))
                        d[k] = d[i] * there / back;
                    else if (there > R(0))
                        d[k] = R(n * n) * d[i] * there * there / (a(i, i) * a(k, k));
                    else if (back > R(0))
                        d[k] = d[i] * a(i, i) * a(k, k) / (R(n * n) * back * back);
                }
    }
    return d;
}

/// The smallest pivot of a symmetric matrix relative to its diagonal, by Cholesky's factors:
/// positive if the matrix is positive definite.
template <std::floating_point R, int M> R definiteness(Mat<R, M, M> a, int n) {
    R least(1);
    for (int i = 0; i < n; ++i) {
        const R full = a(i, i);
        for (int k = 0; k < i; ++k)
            for (int r = i; r < n; ++r)
                a(r, i) -= a(r, k) * a(i, k);
        least = std::min(least, full > R(0) ? a(i, i) / full - R(64) * epsilon<R> : R(-1));
        if (!(least > R(0)))
            return least;
        const R root = std::sqrt(a(i, i));
        for (int r = i; r < n; ++r)
            a(r, i) /= root;
    }
    return least;
}

/// How surely D J + J' D is negative definite all over the cube, J = dL/ds and D a diagonal matrix:
/// if it is, sum d_i (|z_i| - s_i z_i), s the blend, falls along every solution. J is multilinear,
/// so that its corners decide. Two D are tried: the inverse diagonal, and the balancing one.
template <std::floating_point R, int M> R attraction_by_lyapunov(const NormalField<R, M>& w) {
    const int n = w.n;
    const auto slope = [&](unsigned v, int i, int k) {
        return (w(v | 1u << k, i) - w(v & ~(1u << k), i)) / R(2);
    };
    Mat<R, M, M> mean = Mat<R, M, M>::Zero();
    for (unsigned v = 0; v < w.regions(); ++v)
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < n; ++k)
                mean(i, k) += slope(v, i, k) / R(w.regions());
    Vec<R, M> inverse = Vec<R, M>::Zero();
    for (int i = 0; i < n; ++i) {
        if (!(mean(i, i) < R(0)))
            return R(-1);
        inverse[i] = R(1) / -mean(i, i);
    }
    R best(-1);
    for (const bool balanced : {false, true}) {
        const Vec<R, M> d = balanced ? balancing(mean, n) : inverse;
        R least(1);
        Mat<R, M, M> last = Mat<R, M, M>::Zero();
        for (unsigned v = 0; v < w.regions() && least > best; ++v) {
            Mat<R, M, M> a = Mat<R, M, M>::Zero();
            for (int i = 0; i < n; ++i)
                for (int k = i; k < n; ++k)
                    a(i, k) = a(k, i) = -(d[i] * slope(v, i, k) + d[k] * slope(v, k, i));
            if (a == last) // as where L is affine in s
                continue;
            last = a;
            least = std::min(least, definiteness(a, n));
        }
        best = std::max(best, least);
        if (best > R(0.25)) // clear enough, and guards see no jump near zero
            break;
    }
    return best;
}

} // namespace detail

/// How surely solutions near an intersection reach it: positive if that is shown of
/// z' = w(sign z), the normal components taken as constant in each region.
///
/// On one surface and on two this decides. On three and more it is one of two sufficient tests:
/// all regions lead towards all surfaces, or a piecewise linear Lyapunov function falls.
template <std::floating_point R, int M> FILIPPOV_NOINLINE R attraction(const NormalField<R, M>& w) {
    if (w.n == 1)
        return std::min(w(0, 0), -w(1, 0)) / std::max(std::abs(w(0, 0)), std::abs(w(1, 0)));
    if (w.n == 2)
        return detail::attraction_in_plane(w);
    return std::max(detail::attraction_from_all(w), detail::attraction_by_lyapunov(w));
}
template <std::floating_point R, int M> bool attracts(const NormalField<R, M>& w) {
    return attraction(w) > R(0);
}

// --- sliding -----------------------------------------------------------------------------------

/// Sliding on all surfaces with mode 0.
template <class Sys, class S> struct JointSliding {
    static constexpr int M = surfaces_v<Sys>;
    State<Sys, S> f;        ///< F_s
    Vec<S, M> below, above; ///< 1 + s_j and 1 - s_j of the surfaces slid on, others unspecified
    /// On one surface L1 - L2: positive where sliding attracts, negative where it repels. On more
    /// +1 where the intersection is shown to attract, else -1.
    Real<S> w;
};

/// Sliding vector field on the intersection of the surfaces with mode 0: the blend of the regions
/// that meet there with which all their h stay zero.
///
/// @param x   state, shape (dim,), on these surfaces
/// @error     none; NaN where there is no such blend
/// @cost      2^n fields and derivatives of h, n surfaces
/// @source    chapter, (4.11)-(4.12), for each surface; Selection for several
template <class Sys, class S>
FILIPPOV_NOINLINE JointSliding<Sys, S>
joint_sliding(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, const S& t, const State<Sys, S>& x,
              const Params<Sys, S>& p) {
    const auto regions = regions_at(sys, mode, slid_surfaces(mode), t, x, p);
    const auto blend = blend_of<Sys, S>(regions.flow);
    JointSliding<Sys, S> r;
    r.f = State<Sys, S>::Constant(S(0));
    for (unsigned v = 0; v < regions.flow.regions(); ++v)
        for (int i = 0; i < dim_v<Sys>; ++i)
            r.f[i] += blend.share[v] * regions.field[v][i];
    for (int i = 0; i < regions.on.n; ++i) {
        r.below[regions.on[i]] = blend.below[i];
        r.above[regions.on[i]] = blend.above[i];
    }
    const auto plain = detail::values_of_field(regions.flow);
    r.w = regions.on.n == 1 ? plain(0, 0) - plain(1, 0) : attraction(plain);
    return r;
}

/// The field of any mode.
template <class Sys, class S>
FILIPPOV_INLINE State<Sys, S> mode_field(const Sys& sys, const Mode<surfaces_v<Sys>>& mode,
                                         const S& t, const State<Sys, S>& x,
                                         const Params<Sys, S>& p) {
    if (sliding_surface(mode) < 0)
        return side_field(sys, mode, t, x, p);
    if constexpr (single_v<Sys>)
        return sliding(sys, mode, t, x, p).f;
    else
        return joint_sliding(sys, mode, t, x, p).f;
}

/// The margins of the slide of `mode` at surface j.
template <class Sys, class S>
FILIPPOV_INLINE Margin<S> sliding_margin(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j,
                                         const S& t, const State<Sys, S>& x,
                                         const Params<Sys, S>& p) {
    if constexpr (single_v<Sys>) {
        return sliding_margin(sys, mode, t, x, p);
    } else {
        const auto slide = joint_sliding(sys, mode, t, x, p);
        const S s =
            slide.below[j] < slide.above[j] ? S(slide.below[j] - S(1)) : S(S(1) - slide.above[j]);
        return {s, slide.below[j], slide.above[j], S(slide.w)};
    }
}

} // namespace filippov
