// SPDX-License-Identifier: BSD-3-Clause
// Whether the intersection of surfaces attracts.
#pragma once

#include <filippov/sliding/detail/regions.hpp>

namespace filippov {

template <std::floating_point R, int M> R attraction(const NormalField<R, M>& w);

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

/// What has no speed leads to the surface, slowly: so do sides that stay tangent to it, and a state
/// that rests.
template <std::floating_point R, int M> NormalField<R, M> tangent_leads_in(NormalField<R, M> w) {
    for (int i = 0; i < w.n; ++i) {
        R largest(0);
        for (unsigned v = 0; v < w.regions(); ++v)
            largest = std::max(largest, std::abs(w(v, i)));
        for (unsigned v = 0; v < w.regions(); ++v)
            if (std::abs(w(v, i)) <= R(2) * epsilon<R> * largest)
                w.normal[v][i] = R((v >> i & 1u) != 0 ? -64 : 64) * epsilon<R> * largest;
    }
    return w;
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

/// dL_i/ds_k along the edge of the cube at corner v.
template <std::floating_point R, int M>
FILIPPOV_INLINE R slope_at(const NormalField<R, M>& w, unsigned v, int i, int k) {
    return (w(v | 1u << k, i) - w(v & ~(1u << k), i)) / R(2);
}
/// How surely D J + J' D is negative definite all over the cube, J = dL/ds and D a diagonal matrix.
/// J is multilinear, so that its corners decide.
/// @param enough  less than this is not worth an answer
template <std::floating_point R, int M>
R surely_falls(const NormalField<R, M>& w, const Vec<R, M>& d, const R& enough) {
    const int n = w.n;
    R least(1);
    Mat<R, M, M> last = Mat<R, M, M>::Zero();
    for (unsigned v = 0; v < w.regions() && least > enough; ++v) {
        Mat<R, M, M> a = Mat<R, M, M>::Zero();
        for (int i = 0; i < n; ++i)
            for (int k = i; k < n; ++k)
                a(i, k) = a(k, i) = -(d[i] * slope_at(w, v, i, k) + d[k] * slope_at(w, v, k, i));
        if (a == last) // as where L is affine in s
            continue;
        last = a;
        least = std::min(least, definiteness(a, n));
    }
    return least;
}
/// dL/ds in the middle of the cube.
template <std::floating_point R, int M> Mat<R, M, M> mean_slope(const NormalField<R, M>& w) {
    Mat<R, M, M> mean = Mat<R, M, M>::Zero();
    for (unsigned v = 0; v < w.regions(); ++v)
        for (int i = 0; i < w.n; ++i)
            for (int k = 0; k < w.n; ++k)
                mean(i, k) += slope_at(w, v, i, k) / R(w.regions());
    return mean;
}

/// How surely D J + J' D is negative definite: if it is, sum d_i (|z_i| - s_i z_i), s the blend,
/// falls along every solution. Two D are tried: the inverse diagonal, and the balancing one.
template <std::floating_point R, int M> R attraction_by_lyapunov(const NormalField<R, M>& w) {
    const int n = w.n;
    const Mat<R, M, M> mean = mean_slope(w);
    Vec<R, M> inverse = Vec<R, M>::Zero();
    for (int i = 0; i < n; ++i) {
        if (!(mean(i, i) < R(0)))
            return R(-1);
        inverse[i] = R(1) / -mean(i, i);
    }
    R best(-1);
    for (const bool balanced : {false, true}) {
        best = std::max(best, surely_falls(w, balanced ? balancing(mean, n) : inverse, best));
        if (best > R(0.25)) // clear enough, and guards see no jump near zero
            break;
    }
    return best;
}

/// The same where some of the surfaces are components of directions: sum d (|z| - s.z) with one d
/// for each direction. It falls as surely, whatever the angle between z and s: its rate is
/// (u - s)' D J (u - s), u the directions and sides.
/// @param first  of each surface the first one that belongs with it
template <std::floating_point R, int M>
FILIPPOV_COLD R attraction_with_directions(const NormalField<R, M>& w,
                                           const std::array<int, std::size_t(M)>& first) {
    const Mat<R, M, M> mean = mean_slope(w);
    Mat<R, M, M> square = Mat<R, M, M>::Zero(), whole = square; // of blocks, and their sizes
    Vec<R, M> trace = Vec<R, M>::Zero(), count = trace;
    for (int i = 0; i < w.n; ++i) {
        const int a = first[std::size_t(i)];
        trace[a] += mean(i, i);
        count[a] += R(1);
        for (int k = 0; k < w.n; ++k)
            square(a, first[std::size_t(k)]) += mean(i, k) * mean(i, k);
    }
    for (int i = 0; i < w.n; ++i) {
        const int a = first[std::size_t(i)];
        if (!(trace[a] < R(0)))
            return R(-1);
        for (int k = 0; k < w.n; ++k)
            whole(i, k) = a == first[std::size_t(k)] ? trace[a] / count[a]
                                                     : std::sqrt(square(a, first[std::size_t(k)]));
    }
    R best(-1);
    const Vec<R, M> balanced = balancing(whole, w.n);
    for (const bool balance : {false, true}) {
        Vec<R, M> d = Vec<R, M>::Zero();
        for (int i = 0; i < w.n; ++i)
            d[i] = balance ? balanced[first[std::size_t(i)]] : R(1) / -whole(i, i);
        best = std::max(best, surely_falls(w, d, best));
        if (best > R(0.25))
            break;
    }
    return best;
}

/// How surely solutions reach one surface after another: all regions lead towards some surface, and
/// from then on, along it, to the others.
template <std::floating_point R, int M>
FILIPPOV_COLD R attraction_by_stages(const NormalField<R, M>& w) {
    R best(-1);
    for (int i = 0; i < w.n; ++i) {
        NormalField<R, M> rest;
        rest.n = w.n - 1;
        R size(0), least(1);
        for (unsigned v = 0; v < w.regions(); ++v)
            size = std::max(size, std::abs(w(v, i)));
        for (unsigned v = 0; v < rest.regions(); ++v) {
            const unsigned low = with_end(v, i, 0), high = with_end(v, i, 1);
            const R l = w(low, i), r = w(high, i);
            least = std::min(least, std::min(l, -r) / size);
            for (int k = 0; k < rest.n; ++k) {
                const int of = k < i ? k : k + 1;
                rest.normal[v][k] = (l * w(high, of) - r * w(low, of)) / (l - r);
            }
        }
        if (!(least > R(0)))
            continue;
        if (const R then = attraction(rest); then > R(0))
            best = std::max(best, std::min(least, then));
    }
    return best;
}

} // namespace detail

/// How surely solutions near an intersection reach it: positive if that is shown of
/// z' = w(sign z), the normal components taken as constant in each region.
///
/// On one surface and on two this decides. On three and more it is one of three sufficient tests:
/// all regions lead towards all surfaces, or a piecewise linear Lyapunov function falls, or the
/// surfaces are reached one after another.
template <std::floating_point R, int M> FILIPPOV_NOINLINE R attraction(const NormalField<R, M>& w) {
    if (w.n == 1)
        return std::min(w(0, 0), -w(1, 0)) / std::max(std::abs(w(0, 0)), std::abs(w(1, 0)));
    if (w.n == 2)
        return detail::attraction_in_plane(w);
    const R least = std::max(detail::attraction_from_all(w), detail::attraction_by_lyapunov(w));
    return least > R(0) ? least : std::max(least, detail::attraction_by_stages(w));
}
template <std::floating_point R, int M> bool attracts(const NormalField<R, M>& w) {
    return attraction(w) > R(0);
}

/// The same where some of the surfaces `on` may be components of directions.
template <class Sys, std::floating_point R, int M>
FILIPPOV_INLINE R attraction([[maybe_unused]] const Sys& sys,
                             [[maybe_unused]] const SurfaceSet<M>& on, const NormalField<R, M>& w) {
    if constexpr (has_directions_v<Sys>) {
        std::array<int, std::size_t(M)> first{};
        bool any = false;
        for (int i = 0; i < on.n; ++i) {
            const bool further = is_kind(sys, on[i], SurfaceKind::component);
            first[std::size_t(i)] = further ? first[std::size_t(i - 1)] : i;
            any = any || further;
        }
        if (any)
            return detail::attraction_with_directions(w, first);
    }
    return attraction(w);
}

} // namespace filippov
