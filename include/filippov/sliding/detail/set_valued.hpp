// SPDX-License-Identifier: BSD-3-Clause
// Slides whose s is not unique though their field is: more surfaces meet than there are dimensions.
#pragma once

#include <filippov/sliding/detail/attraction.hpp>
#include <filippov/sliding/detail/blend.hpp>

#include <tuple>

namespace filippov {

namespace detail {

/// What the surfaces of a slide do to it, where the fields are affine in s: L = a u + b. Of a relay
/// u is s; of a contact it is the force, in units of what the relays do to its surface.
template <class S, int M> struct Controls {
    int n = 0;
    Mat<S, M, M> a;
    Vec<S, M> b;
    std::array<bool, std::size_t(M)> contact{};
    /// of a contact: (1 - s) by a unit of force
    Vec<S, M> unit;
    Vec<Real<S>, M> noise; ///< what rounding leaves of entries of each row of a

    /// (1 + s_k)/2
    S share(const Vec<S, M>& u, int k) const {
        return contact[std::size_t(k)] ? S(S(1) - S(0.5) * unit[k] * u[k])
                                       : S((S(1) + u[k]) * S(0.5));
    }
};

/// The bits of the contacts: v with all of them are the regions in which none pushes, whose fields
/// are of the size of what the solution does.
template <class Sys, class S> unsigned free_regions(const Sys& sys, const Regions<Sys, S>& r) {
    unsigned contacts = 0;
    for (int i = 0; i < r.flow.n; ++i)
        contacts |= unsigned(is_kind(sys, r.on[i], SurfaceKind::jump)) << i;
    return contacts;
}

/// True if the fields of the regions are affine in s, to rounding: then so are their blends, and
/// corners say nothing more than edges. (Pushes of contacts are.)
template <class Sys, class S> bool is_affine(const Regions<Sys, S>& r, unsigned base) {
    using R = Real<S>;
    using std::abs;
    for (int i = 0; i < dim_v<Sys>; ++i) {
        const auto field = [&](unsigned v) { return value_of(r.field[v | base][i]); };
        R size(0);
        for (unsigned v = 0; v < r.flow.regions(); ++v)
            size = std::max(size, R(abs(field(v))));
        for (unsigned v = 0; v < r.flow.regions(); ++v) {
            R sum = field(0);
            for (int k = 0; k < r.flow.n; ++k)
                if ((v >> k & 1u) != 0)
                    sum += field(1u << k) - field(0);
            if (!(abs(field(v) - sum) <= R(64) * epsilon<R> * size))
                return false;
        }
    }
    return true;
}

template <class Sys, class S>
Controls<S, surfaces_v<Sys>> controls_of(const Sys& sys, const Regions<Sys, S>& r, unsigned base) {
    using R = Real<S>;
    using std::abs;
    Controls<S, surfaces_v<Sys>> c;
    const int n = c.n = r.flow.n;
    for (int i = 0; i < n; ++i) {
        c.contact[std::size_t(i)] = is_kind(sys, r.on[i], SurfaceKind::jump);
        R size(0);
        for (unsigned v = 0; v < r.flow.regions(); ++v)
            size = std::max(size, R(abs(value_of(r.flow(v | base, i)))));
        c.noise[i] = R(64) * epsilon<R> * size;
        c.b[i] = r.flow(base, i);
        for (int k = 0; k < n; ++k)
            c.a(i, k) = (r.flow(base | 1u << k, i) - r.flow(base & ~(1u << k), i)) * S(0.5);
    }
    for (int k = 0; k < n; ++k) {
        c.unit[k] = S(0);
        if (!c.contact[std::size_t(k)]) {
            for (int i = 0; i < n; ++i)
                c.b[i] += c.a(i, k);
            continue;
        }
        S relays(0);
        for (int i = 0; i < n; ++i)
            if (!c.contact[std::size_t(i)])
                relays += value_of(c.a(k, i)) < R(0) ? S(-c.a(k, i)) : c.a(k, i);
        if (!(value_of(relays) > c.noise[k])) // a force has no scale
            relays = S(1);
        c.unit[k] = S(2) * relays / r.strength[k];
        for (int i = 0; i < n; ++i)
            c.a(i, k) = -c.unit[k] * c.a(i, k);
    }
    return c;
}

template <class S, int M> Controls<Real<S>, M> values_of_controls(const Controls<S, M>& controls) {
    Controls<Real<S>, M> plain;
    plain.n = controls.n;
    plain.contact = controls.contact;
    plain.noise = controls.noise;
    for (int i = 0; i < controls.n; ++i) {
        plain.b[i] = value_of(controls.b[i]);
        plain.unit[i] = value_of(controls.unit[i]);
        for (int k = 0; k < controls.n; ++k)
            plain.a(i, k) = value_of(controls.a(i, k));
    }
    return plain;
}

/// The solutions of a u + b = 0, by elimination with complete pivoting: of the controls in the
/// order of `column` the first `rank` follow from the others, which are free.
template <std::floating_point R, int M> struct Solutions {
    int n = 0, rank = 0;
    std::array<int, std::size_t(M)> row{}, column{};
    Mat<R, M, M> by; ///< u[column[i]] = at[i] - sum over free f of by(i, f) u[column[f]], i < rank
    Vec<R, M> at;
    R residual =
        R(0); ///< of the equations left over, in units of their rows; 0: they have solutions
    bool zero_row = false; ///< some surface's L is the same in all regions

    explicit Solutions(const Controls<R, M>& c) : n(std::min(c.n, M)), by(c.a), at(-c.b) {
        Vec<R, M> largest = Vec<R, M>::Zero();
        R noise(1e-12);
        std::array<bool, std::size_t(M)> zero{};
        for (int i = 0; i < n; ++i) {
            row[std::size_t(i)] = column[std::size_t(i)] = i;
            R size(0);
            for (int k = 0; k < n; ++k)
                size = std::max(size, std::abs(by(i, k)));
            zero[std::size_t(i)] = !(size > c.noise[i]);
            zero_row = zero_row || zero[std::size_t(i)];
            if (zero[std::size_t(i)]) {
                by.row(i).setZero();
                at[i] = R(0);
                continue;
            }
            by.row(i) /= size;
            at[i] /= size;
            noise = std::max(noise, c.noise[i] / size);
            for (int k = 0; k < n; ++k)
                largest[k] = std::max(largest[k], std::abs(by(i, k)));
        }
        eliminate_all(largest, noise);
        for (int i = rank; i < n; ++i)
            residual = std::max(residual, std::abs(at[i]) / (R(1) + noise * R(1e9)));
    }

private:
    void eliminate_all(Vec<R, M> largest, const R& noise) {
        for (; rank < n; ++rank) {
            int pr = rank, pc = rank;
            R best(0);
            for (int i = rank; i < n; ++i)
                for (int k = rank; k < n; ++k)
                    if (const R share = std::abs(by(i, k)) / largest[k]; share > best) {
                        best = share;
                        pr = i;
                        pc = k;
                    }
            if (!(best > noise))
                return;
            by.row(pr).swap(by.row(rank));
            by.col(pc).swap(by.col(rank));
            std::swap(at[pr], at[rank]);
            std::swap(largest[pc], largest[rank]);
            std::swap(row[std::size_t(pr)], row[std::size_t(rank)]);
            std::swap(column[std::size_t(pc)], column[std::size_t(rank)]);
            const R pivot = by(rank, rank);
            by.row(rank) /= pivot;
            at[rank] /= pivot;
            for (int i = 0; i < n; ++i)
                if (const R factor = by(i, rank); i != rank && factor != R(0)) {
                    by.row(i) -= factor * by.row(rank);
                    at[i] -= factor * at[rank];
                }
        }
    }
};

/// How far the set of controls is from empty, and what bounds it there: the largest `margin` for
/// which some solution has |s| <= 1 - margin for all relays, and forces >= margin of all contacts.
///
/// A linear program in the free controls and the margin, of at most eight unknowns, by the simplex
/// method with Bland's rule, which ends.
template <std::floating_point R, int M> class Widest {
    static constexpr int rows = 2 * M, columns = M + 1;
    // Variables: the slack of each upper (2 k) and lower (2 k + 1) bound, free controls, the
    // margin.
    static constexpr int free_one = 2 * M, the_margin = 3 * M;

public:
    R margin = R(1);     ///< NaN: not found
    bool smooth = false; ///< it is a smooth function of L here: what bounds it stays the same
    /// A bound that is met for certain where the margin is zero: +1 and -1 of a relay, +1 of a
    /// contact (its force is zero); 0: none.
    std::array<int, std::size_t(M)> met{};

    Widest(const Controls<R, M>& c, const Solutions<R, M>& all) : all_(all), contact_(c.contact) {
        width_ = all.n - all.rank;
        for (int f = 0; f < width_; ++f)
            column_[std::size_t(f)] = free_one + f;
        column_[std::size_t(width_)] = the_margin;
        for (int i = 0; i < all.n; ++i) {
            const int k = all.column[std::size_t(i)];
            const bool contact = contact_[std::size_t(k)];
            if (!contact)
                bound(2 * k, i, R(-1), R(1)); // 1 - s - margin >= 0
            bound(2 * k + 1, i, R(1), contact ? R(0) : R(1));
        }
        maximize();
    }

    /// The vertex at which the margin is largest, in any scalar: all solutions of these equations.
    template <class S> std::pair<Vec<S, M>, S> vertex(const Controls<S, M>& c) const {
        constexpr int size = M + 1;
        const int n = all_.n;
        Mat<S, size, size> m = Mat<S, size, size>::Constant(S(0));
        Vec<S, size> u = Vec<S, size>::Constant(S(0));
        for (int i = 0; i < all_.rank; ++i) {
            const int r = all_.row[std::size_t(i)];
            for (int k = 0; k < n; ++k)
                m(i, k) = c.a(r, k);
            u[i] = -c.b[r];
        }
        for (int q = 0; q <= width_; ++q) {
            const int i = all_.rank + q, id = column_[std::size_t(q)];
            if (id >= the_margin) {
                m(i, n) = S(1);
                u[i] = S(1);
            } else if (id >= free_one) {
                m(i, all_.column[std::size_t(all_.rank + id - free_one)]) = S(1);
            } else {
                m(i, id / 2) = S(1);
                m(i, n) = S(id % 2 == 0 ? 1 : -1);
                u[i] = c.contact[std::size_t(id / 2)] ? S(0) : S(id % 2 == 0 ? 1 : -1);
            }
        }
        if (!(eliminate(m, u, n + 1) > R(0)))
            u = Vec<S, size>::Constant(S(std::numeric_limits<R>::quiet_NaN()));
        Vec<S, M> controls = Vec<S, M>::Constant(S(0));
        for (int k = 0; k < n; ++k)
            controls[k] = u[k];
        return {controls, u[n]};
    }

private:
    static constexpr R tiny = R(1e5) * epsilon<R>;

    /// slack = sign u + offset - margin
    /// @param i  place of the control in the order of the solutions
    void bound(int id, int i, const R& sign, const R& offset) {
        const int r = height_++;
        basic_[std::size_t(r)] = id;
        value_[r] = offset;
        for (int f = 0; f < width_; ++f)
            by_(r, f) = i < all_.rank        ? -sign * all_.by(i, all_.rank + f)
                        : i - all_.rank == f ? sign
                                             : R(0);
        if (i < all_.rank)
            value_[r] += sign * all_.at[i];
        by_(r, width_) = R(-1);
    }
    void pivot(int r, int c) {
        const R by = R(1) / by_(r, c);
        value_[r] *= -by;
        for (int k = 0; k <= width_; ++k)
            by_(r, k) = k == c ? by : -by_(r, k) * by;
        for (int i = 0; i < height_; ++i) {
            const R factor = by_(i, c);
            if (i == r || factor == R(0))
                continue;
            value_[i] += factor * value_[r];
            for (int k = 0; k <= width_; ++k)
                by_(i, k) = k == c ? factor * by_(r, k) : by_(i, k) + factor * by_(r, k);
        }
        std::swap(basic_[std::size_t(r)], column_[std::size_t(c)]);
    }
    /// The slack that vanishes first as column c moves; -1: none.
    int first_to_vanish(int c, int direction) const {
        int leaving = -1;
        R least(0);
        for (int r = 0; r < height_; ++r) {
            const R rate = R(direction) * by_(r, c);
            if (basic_[std::size_t(r)] >= free_one || !(rate < -tiny))
                continue;
            const R way = std::max(value_[r], R(0)) / -rate;
            if (leaving < 0 || way < least ||
                (way == least && basic_[std::size_t(r)] < basic_[std::size_t(leaving)])) {
                leaving = r;
                least = way;
            }
        }
        return leaving;
    }
    void maximize() {
        int goal = 0; // the row of the margin: what bounds it first at free controls of zero
        for (int r = 1; r < height_; ++r)
            if (value_[r] < value_[goal])
                goal = r;
        pivot(goal, width_);
        std::array<bool, std::size_t(columns)> idle{}; // free controls that nothing bounds
        for (int k = 0; k < 1000; ++k) {
            int c = -1;
            for (int q = 0; q <= width_; ++q) {
                const int id = column_[std::size_t(q)];
                const bool is_free = id >= free_one && !idle[std::size_t(q)];
                if (is_free || (id < free_one && by_(goal, q) > tiny &&
                                (c < 0 || id < column_[std::size_t(c)])))
                    c = q;
                if (is_free)
                    break;
            }
            if (c < 0)
                return done(goal);
            const R gain = by_(goal, c);
            int direction = gain < R(0) ? -1 : 1;
            int leaving = first_to_vanish(c, direction);
            if (leaving < 0 && !(std::abs(gain) > tiny))
                leaving = first_to_vanish(c, -direction);
            if (leaving < 0 && std::abs(gain) > tiny)
                return jam(goal, c);
            if (leaving < 0)
                idle[std::size_t(c)] = true;
            else
                pivot(leaving, c);
        }
        margin = std::numeric_limits<R>::quiet_NaN();
    }
    void done(int goal) {
        margin = value_[goal];
        smooth = true;
        for (int r = 0; r < height_; ++r)
            smooth =
                smooth && (r == goal || basic_[std::size_t(r)] >= free_one || value_[r] > R(1e-9));
        for (int q = 0; q <= width_; ++q)
            if (const int id = column_[std::size_t(q)]; id < free_one && by_(goal, q) < -tiny)
                met[std::size_t(id / 2)] = id % 2 == 0 || contact_[std::size_t(id / 2)] ? 1 : -1;
    }
    /// Contacts that push against each other as hard as they like: a margin of one will do.
    void jam(int goal, int c) {
        pivot(goal, c);
        margin = R(1);
    }

    const Solutions<R, M>& all_;
    const std::array<bool, std::size_t(M)> contact_;
    int width_ = 0, height_ = 0;
    std::array<int, std::size_t(rows)> basic_{};
    std::array<int, std::size_t(columns)> column_{};
    Mat<R, rows, columns> by_;
    Vec<R, rows> value_;
};

/// The controls of least norm among all solutions within their bounds, forces of contact not
/// counted: from a solution within them to the least one along the bounds that are met, which are
/// let go of where they push outward.
/// @param u  a solution; if it is not within its bounds, neither is the result
template <std::floating_point R, int M>
Vec<R, M> least_norm(const Controls<R, M>& c, const Solutions<R, M>& all, Vec<R, M> u) {
    const int width = all.n - all.rank;
    Mat<R, M, M> z = Mat<R, M, M>::Zero(); // the controls by the free ones
    for (int i = 0; i < all.n; ++i)
        for (int f = 0; f < width; ++f)
            z(all.column[std::size_t(i)], f) =
                i < all.rank ? -all.by(i, all.rank + f) : R(i - all.rank == f);
    const auto counts = [&](int k) { return R(c.contact[std::size_t(k)] ? 0 : 1); };
    Mat<R, M, M> bend = Mat<R, M, M>::Zero();
    for (int f = 0; f < width; ++f)
        for (int g = 0; g < width; ++g) {
            for (int k = 0; k < all.n; ++k)
                bend(f, g) += z(k, f) * z(k, g) * counts(k);
            bend(f, g) += f == g ? R(1e-9) : R(0); // forces stay where they are if they may
        }
    struct Bound {
        int control;
        R sign;
    };
    std::array<Bound, std::size_t(M)> met{}; // independent of each other
    int n_met = 0;
    for (int k = 0; k < 200; ++k) {
        constexpr int size = 2 * M;
        Mat<R, size, size> m = Mat<R, size, size>::Zero();
        Vec<R, size> way = Vec<R, size>::Zero(); // of the free controls, and what the bounds push
        for (int f = 0; f < width; ++f) {
            for (int g = 0; g < width; ++g)
                m(f, g) = bend(f, g);
            for (int i = 0; i < n_met; ++i)
                m(f, width + i) = m(width + i, f) =
                    met[std::size_t(i)].sign * z(met[std::size_t(i)].control, f);
            for (int q = 0; q < all.n; ++q)
                way[f] -= z(q, f) * u[q] * counts(q);
        }
        if (!(eliminate(m, way, width + n_met) > R(0)))
            return u;
        Vec<R, M> move = Vec<R, M>::Zero();
        for (int q = 0; q < all.n; ++q)
            for (int f = 0; f < width; ++f)
                move[q] += z(q, f) * way[f];
        if (move.cwiseAbs().maxCoeff() <= R(1e-13)) {
            int outward = -1;
            R most(1e-13);
            for (int i = 0; i < n_met; ++i)
                if (way[width + i] > most) {
                    most = way[width + i];
                    outward = i;
                }
            if (outward < 0)
                return u;
            met[std::size_t(outward)] = met[std::size_t(--n_met)];
            continue;
        }
        R part(1);
        Bound first{-1, R(0)};
        for (int q = 0; q < all.n; ++q)
            for (const int sign : {-1, 1}) {
                const bool contact = c.contact[std::size_t(q)];
                const R rate = R(sign) * move[q];
                const bool there =
                    std::any_of(met.begin(), met.begin() + n_met,
                                [&](const auto& b) { return b.control == q && b.sign == R(sign); });
                if (there || (contact && sign < 0) || !(rate < R(-1e-13)))
                    continue;
                const R room = std::max(R(0), R(sign) * u[q] + (contact ? R(0) : R(1)));
                if (room < part * -rate) {
                    part = room / -rate;
                    first = {q, R(sign)};
                }
            }
        u += part * move;
        if (first.control >= 0 && n_met < width)
            met[std::size_t(n_met++)] = first;
    }
    return u;
}

/// True if all solutions have the same field: what leaves all L as they are leaves the field as it
/// is, to rounding.
template <class Sys, class S>
bool field_is_unique(const Regions<Sys, S>& r, unsigned base,
                     const Controls<Real<S>, surfaces_v<Sys>>& c,
                     const Solutions<Real<S>, surfaces_v<Sys>>& all) {
    using R = Real<S>;
    for (int i = 0; i < dim_v<Sys>; ++i) {
        const auto field = [&](unsigned v) { return value_of(r.field[v][i]); };
        const auto by = [&](int place) { // what one unit of a control does to the field
            const int k = all.column[std::size_t(place)];
            const R unit = c.contact[std::size_t(k)] ? -c.unit[k] : R(1);
            return unit * R(0.5) * (field(base | 1u << k) - field(base & ~(1u << k)));
        };
        R largest(0);
        for (unsigned v = 0; v < r.flow.regions(); ++v)
            largest = std::max(largest, std::abs(field(v | base)));
        for (int f = all.rank; f < all.n; ++f) {
            R sum = by(f), size = std::abs(sum);
            for (int k = 0; k < all.rank; ++k) {
                sum -= all.by(k, f) * by(k);
                size += std::abs(all.by(k, f) * by(k));
            }
            if (!(std::abs(sum) <= R(1e-9) * size + R(64) * epsilon<R> * largest))
                return false;
        }
    }
    return true;
}

/// How surely sum d_i (|z_i| - s_i z_i) does not grow along solutions of z' = a u + b, s a solution
/// within its bounds: 1 if D a + a' D is negative semidefinite for some diagonal D, else -1. Where
/// it is, solutions that start at z = 0 stay there. (Contacts push where relays pull.)
template <std::floating_point R, int M> R dissipates(const Controls<R, M>& c) {
    Mat<R, M, M> a = Mat<R, M, M>::Zero();
    for (int i = 0; i < c.n; ++i)
        for (int k = 0; k < c.n; ++k)
            if (std::abs(c.a(i, k)) > c.noise[i])
                a(i, k) = c.contact[std::size_t(k)] ? -c.a(i, k) : c.a(i, k);
    for (int i = 0; i < c.n; ++i)
        if (!(a(i, i) < R(0)))
            return R(-1);
    const Vec<R, M> d = balancing(a, c.n);
    Mat<R, M, M> k = Mat<R, M, M>::Zero();
    Vec<R, M> full = Vec<R, M>::Zero();
    for (int i = 0; i < c.n; ++i) {
        for (int q = 0; q < c.n; ++q)
            k(i, q) = -(d[i] * a(i, q) + d[q] * a(q, i));
        full[i] = k(i, i);
    }
    // Cholesky's factors, the largest pivot first; what is left over has to be rounding.
    std::array<bool, std::size_t(M)> used{};
    for (int step = 0; step < c.n; ++step) {
        int pivot = -1;
        for (int i = 0; i < c.n; ++i) {
            if (used[std::size_t(i)])
                continue;
            if (!(k(i, i) >= R(-1e-9) * full[i]))
                return R(-1);
            if (pivot < 0 || k(i, i) / full[i] > k(pivot, pivot) / full[pivot])
                pivot = i;
        }
        if (!(k(pivot, pivot) > R(1e-9) * full[pivot]))
            break;
        used[std::size_t(pivot)] = true;
        for (int i = 0; i < c.n; ++i)
            for (int q = 0; q < c.n; ++q)
                if (!used[std::size_t(i)] && !used[std::size_t(q)])
                    k(i, q) -= k(i, pivot) * k(pivot, q) / k(pivot, pivot);
    }
    for (int i = 0; i < c.n; ++i)
        for (int q = 0; q < c.n; ++q)
            if (!used[std::size_t(i)] && !used[std::size_t(q)] &&
                !(std::abs(k(i, q)) <= R(1e-8) * std::sqrt(full[i] * full[q])))
                return R(-1);
    return R(1);
}

/// The same where z1' is the same in all regions, as of twisting: z1' = c z2, z2' = b - q s1 - r s2
/// with c q > 0 and r > 0. (What c is the field shows elsewhere, not at z = 0: see `twists`.)
/// @return that, and |q| - r - |b|, positive where nothing rests on z2 = 0 beside z1 = 0
template <std::floating_point R, int M>
std::pair<R, R> twisting(const Controls<R, M>& c, const Solutions<R, M>& all) {
    if (c.n != 2 || all.rank != 1 || c.contact[0] || c.contact[1])
        return {R(-1), R(0)};
    const int to = all.row[0], from = 1 - to;
    const R q = std::abs(c.a(to, from)), r = -c.a(to, to);
    return {std::min(q, r) / std::max(q, r), q - r - std::abs(c.b[to])};
}

} // namespace detail

/// True of a slide in contact that `dissipates`: contacts push as hard as they have to, whatever
/// the pushes are that their regions stand for.
template <class Sys, class S>
FILIPPOV_COLD bool contacts_hold(const Sys& sys, const Regions<Sys, S>& regions) {
    if (any_directed(sys, regions.on)) // one measure for all components, which that does not know
        return false;
    const unsigned base = detail::free_regions(sys, regions);
    return base != 0 && selection_v<Sys> == Selection::multilinear &&
           detail::is_affine(regions, base) &&
           detail::dissipates(detail::values_of_controls(detail::controls_of(sys, regions, base))) >
               Real<S>(0);
}

/// A slide whose s is not unique, though its field is.
template <class S, int M> struct SetValued {
    bool found = false; ///< false: s is unique, or what follows is not known
    Blend<S, M> blend;  ///< one of those that have this field
    S margin;           ///< how far the set of all s is from empty, 1 at most; of contacts
                        ///< alone their least force
    std::array<int, std::size_t(M)> met{}; ///< ends of s by which the slide is over at margin 0
    Vec<Real<S>, M> s;                     ///< of least norm, in plain numbers
    Real<S> w = Real<S>(-1);               ///< positive where solutions that are here stay
    bool consistent = false;               ///< all surfaces can be held
    bool smooth = false;                   ///< the margin is, in what the fields do to the surfaces
    bool twists = false;                   ///< if so, then by `twisting`, and
    Real<S> pull = Real<S>(0);             ///< positive where they come here from z2 = 0, too
};

/// True of a blend that says that s may not be unique.
template <class S, int M> FILIPPOV_INLINE bool may_be_set_valued(const Blend<S, M>& blend) {
    return !(blend.pivot > Real<S>(1e-9));
}

/// The velocity of a slide on surfaces whose L depend on each other: a solution of L = 0 with s in
/// [-1, 1] and contact forces >= 0. It is unique if what leaves all L as they are leaves the field
/// as it is: null(A) within null(G), L = A s + b, F = G s + c.
///
/// @param regions  around all surfaces of the slide, two or more
/// @cost  a linear program of at most eight unknowns
template <class Sys, class S>
FILIPPOV_COLD SetValued<S, surfaces_v<Sys>> set_valued(const Sys& sys,
                                                       const Regions<Sys, S>& regions) {
    constexpr int M = surfaces_v<Sys>;
    using R = Real<S>;
    using std::abs;
    SetValued<S, M> r;
    const int n = regions.flow.n;
    const unsigned base = detail::free_regions(sys, regions);
    if (any_directed(sys, regions.on)) // their s is in a disc, not in a cube
        return r;
    if (selection_v<Sys> != Selection::multilinear || !detail::is_affine(regions, base))
        return r;
    const auto controls = detail::controls_of(sys, regions, base);
    const auto plain = detail::values_of_controls(controls);
    const detail::Solutions<R, M> all(plain);
    if (all.rank == n || all.rank == 0 || !detail::field_is_unique(regions, base, plain, all))
        return r;
    const detail::Widest<R, M> widest(plain, all);
    if (!(abs(widest.margin) <= std::numeric_limits<R>::max()))
        return r;
    const auto [u, margin] = widest.vertex(controls);
    r.found = true;
    r.margin = margin;
    r.met = widest.met;
    r.smooth = widest.smooth;
    for (int k = 0; k < n; ++k) {
        const S share = controls.share(u, k);
        r.blend.below[k] = S(2) * share;
        r.blend.above[k] = S(2) * (S(1) - share);
    }
    for (unsigned v = 0; v < regions.flow.regions(); ++v) {
        S share(1);
        for (int i = 0; i < n; ++i)
            share = share * ((v >> i & 1u) != 0 ? r.blend.below[i] : r.blend.above[i]) * S(0.5);
        r.blend.share[v] = share;
    }
    Vec<R, M> vertex = Vec<R, M>::Zero();
    for (int k = 0; k < n; ++k)
        vertex[k] = value_of(u[k]);
    r.s = std::floating_point<S> ? detail::least_norm(plain, all, vertex) : vertex;
    r.twists = all.zero_row;
    if (all.zero_row)
        std::tie(r.w, r.pull) = detail::twisting(plain, all);
    else
        r.w = detail::dissipates(plain);
    // Where surfaces part that were one the equations have no solution any more.
    r.w = std::min(r.w, R(1) - R(1e9) * all.residual);
    r.consistent = all.residual <= R(1e-10);
    return r;
}

} // namespace filippov
