// SPDX-License-Identifier: BSD-3-Clause
// Clocks, counters and latches: components whose rate is one constant, and which are else changed
// by jumps alone.
//
// Whatever a solution does, its neighbour with a clock that is a little ahead stays that much
// ahead: the multiplier of a clock is 1, and that of a latch, which jumps set, is 0. Neither says
// anything about whether the solution attracts. That is in the components that are left: to those
// with the clocks and latches of the solution itself the linear flow is restricted, being block
// triangular.
#pragma once

#include <filippov/orbits/system_interface.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace filippov {

namespace detail {

/// Components whose rates are constants at these points, each the same on all sides of all
/// surfaces.
/// @param xs  states, of which there is at least one
inline std::vector<int> constant_components(const AnySystem& system, double t,
                                            const std::vector<Vector>& xs, const Vector& p) {
    const int d = system.dim(), surfaces = system.surfaces();
    std::vector<bool> constant(std::size_t(d), true);
    Vector first;
    for (const Vector& x : xs)
        for (int region = 0; region < 1 << surfaces; ++region) {
            int mode = 0;
            for (int j = surfaces - 1; j >= 0; --j)
                mode = 3 * mode + ((region >> j & 1) != 0 ? 1 : -1);
            const Jet rate = system.rate(mode, t, x, p, {});
            if (first.size() == 0)
                first = rate.value;
            for (int i = 0; i < d; ++i) // what is no number is no constant
                if (!(rate.value[i] == first[i] &&
                      (rate.slope.row(i).head(d + 1).array() == 0).all()))
                    constant[std::size_t(i)] = false;
        }
    std::vector<int> found;
    for (int i = 0; i < d; ++i)
        if (constant[std::size_t(i)])
            found.push_back(i);
    return found;
}

} // namespace detail

/// The components of a state, parted into clocks and latches, and the rest.
struct DiscretePart {
    std::vector<int> discrete; ///< clocks, counters and latches, in order
    std::vector<int> rest;     ///< in order
    /// For each of the first: the one of them that a map takes it from, as an index into
    /// `discrete`, but for a constant; -1: it is set.
    std::vector<int> from;
    std::vector<int> sign; ///< 1, or -1 where the map turns it round

    /// Which of the `discrete` come back to themselves, at last: the neutral ones.
    std::vector<bool> neutral() const {
        std::vector<bool> comes_back(from.size(), false);
        for (std::size_t k = 0; k < from.size(); ++k) {
            int at = int(k);
            for (std::size_t n = 0; n < from.size() && at >= 0; ++n) {
                at = from[std::size_t(at)];
                if (at == int(k)) {
                    comes_back[k] = true;
                    break;
                }
            }
        }
        return comes_back;
    }
    /// Multipliers of the discrete components: roots of 1 or -1, and zeros.
    std::vector<std::complex<double>> multipliers() const {
        std::vector<std::complex<double>> all;
        std::vector<bool> seen(from.size(), false);
        const std::vector<bool> comes_back = neutral();
        for (std::size_t k = 0; k < from.size(); ++k) {
            if (!comes_back[k])
                all.emplace_back(0.0);
            if (!comes_back[k] || seen[k])
                continue;
            int length = 0, sign_round = 1;
            for (std::size_t at = k; !seen[at]; at = std::size_t(from[at])) {
                seen[at] = true;
                sign_round *= sign[at];
                ++length;
            }
            add_roots(length, sign_round, all);
        }
        return all;
    }
    /// The rows and columns of the rest.
    Matrix of_rest(const Matrix& M) const { return M(rest, rest); }
    Vector of_rest(const Vector& v) const { return v(rest); }

private:
    static void add_roots(int n, int of, std::vector<std::complex<double>>& all) {
        for (int m = 0; m < n; ++m) {
            const int halves = 2 * m + (of < 0); // of pi / n
            if (halves == 0)
                all.emplace_back(1.0);
            else if (halves == n)
                all.emplace_back(-1.0);
            else
                all.push_back(std::polar(1.0, std::numbers::pi * halves / n));
        }
    }
};

/// Which components a map treats as clocks and latches.
///
/// Those of the candidates whose row of the slope says that they are set (zeros), or that they are
/// one of them, up to a constant and the sign.
/// @param M           slope of a map of states, shape (dim, dim)
/// @param candidates  components of constant rate, in order
inline DiscretePart discrete_part(const Matrix& M, const std::vector<int>& candidates) {
    // what jumps do to a clock is computed from times and a rate
    constexpr double rounding = 1e-11;
    constexpr int no = -2;
    DiscretePart part;
    part.discrete = candidates;
    const auto source = [&](int i, int& sign) {
        const double largest = M.row(i).cwiseAbs().maxCoeff();
        if (largest == 0)
            return -1;
        for (std::size_t k = 0; k < part.discrete.size(); ++k) {
            const int j = part.discrete[k];
            if (!(std::abs(std::abs(M(i, j)) - 1) <= rounding))
                continue;
            sign = M(i, j) > 0 ? 1 : -1;
            const double others = M.row(i).cwiseAbs().sum() - std::abs(M(i, j));
            return others <= rounding ? int(k) : no;
        }
        return no;
    };
    for (bool changed = true; changed;) {
        changed = false;
        part.from.assign(part.discrete.size(), -1);
        part.sign.assign(part.discrete.size(), 1);
        for (std::size_t k = 0; k < part.discrete.size() && !changed; ++k) {
            part.from[k] = source(part.discrete[k], part.sign[k]);
            if (part.from[k] == no) {
                part.discrete.erase(part.discrete.begin() + std::ptrdiff_t(k));
                changed = true;
            }
        }
    }
    for (int i = 0; i < int(M.rows()); ++i)
        if (!std::binary_search(part.discrete.begin(), part.discrete.end(), i))
            part.rest.push_back(i);
    return part;
}

} // namespace filippov
