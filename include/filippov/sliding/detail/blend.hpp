// SPDX-License-Identifier: BSD-3-Clause
// The blend of the regions around an intersection with which the surfaces are slid on.
#pragma once

#include <filippov/sliding/detail/regions.hpp>

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

/// Distances of each s_i from the ends of its range, 1 + s_i and 1 - s_i, and each region's share.
/// NaN where there is no sliding field.
template <class S, int M> struct Blend {
    Vec<S, M> below, above;
    std::array<S, std::size_t(1) << M> share;
    /// The smallest relative pivot of the equations for s: none where s is not unique.
    Real<S> pivot = std::numeric_limits<Real<S>>::infinity();
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

/// True if s_i = -1 (`end` 0) or 1 (1) keeps h_i whatever the other shares: the fields of that end
/// are tangent to surface i, and those of the other are not.
template <class S, int M> bool tangent_at_end(const NormalField<S, M>& w, int i, unsigned end) {
    bool other = false;
    for (unsigned v = 0; v < w.regions(); ++v) {
        const bool nil = is_nil(w(v, i));
        if ((v >> i & 1u) == end && !nil)
            return false;
        other = other || !nil;
    }
    return other;
}

template <class S, int M> Blend<S, M> multilinear_blend(const NormalField<S, M>& w);

/// The blend with s_i at an end, where it is at a limit: of the others alone. (Of all together it
/// loses half its digits as what pushes to the limit vanishes.)
template <class S, int M>
FILIPPOV_COLD Blend<S, M> blend_at_end(const NormalField<S, M>& w, int i, unsigned end) {
    NormalField<S, M> others;
    others.n = w.n - 1;
    for (unsigned v = 0; v < others.regions(); ++v)
        for (int k = 0; k < others.n; ++k)
            others.normal[v][k] = w(with_end(v, i, end), k < i ? k : k + 1);
    const Blend<S, M> part = multilinear_blend(others);
    Blend<S, M> blend;
    blend.share.fill(S(0));
    for (unsigned v = 0; v < others.regions(); ++v)
        blend.share[with_end(v, i, end)] = part.share[v];
    for (int k = 0; k < others.n; ++k) {
        blend.below[k < i ? k : k + 1] = part.below[k];
        blend.above[k < i ? k : k + 1] = part.above[k];
    }
    blend.below[i] = S(end == 0 ? 0 : 2);
    blend.above[i] = S(end == 0 ? 2 : 0);
    return blend;
}

/// The multilinear blend: shares by their values, then Newton from the nearest corner of the cube,
/// so that the distances from it lose no digits, and duals and series get their derivatives.
template <class S, int M>
FILIPPOV_NOINLINE Blend<S, M> multilinear_blend(const NormalField<S, M>& w) {
    using R = Real<S>;
    const NormalField<R, M> plain = values_of_field(w);
    const int n = std::min(w.n, M);
    for (int i = 0; n > 1 && i < n; ++i)
        for (const unsigned end : {0u, 1u})
            if (tangent_at_end(w, i, end)) [[unlikely]]
                return blend_at_end(w, i, end);
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
    Blend<S, M> blend;
    for (int k = 0; k < steps; ++k) {
        blend.pivot = newton_step(seen, distance, step);
        if (!(blend.pivot > R(0)))
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

} // namespace filippov
