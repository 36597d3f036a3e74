// SPDX-License-Identifier: BSD-3-Clause
// Small linear systems of any scalar, without allocation.
#pragma once

#include <filippov/core/scalar.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filippov {

/// Solves the first n equations of A x = b by elimination with row scaling and partial pivoting.
///
/// Pivots are chosen by the values: the scalars may be duals or series.
/// @param b  the right-hand side, then the solution
/// @return   the smallest pivot relative to the largest entry of its equation; 0: singular
template <class S, int M> Real<S> eliminate(Mat<S, M, M> a, Vec<S, M>& b, int n) {
    using R = Real<S>;
    using std::abs;
    n = std::min(n, M);
    Vec<R, M> size = Vec<R, M>::Zero();
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k)
            size[i] = std::max(size[i], R(abs(value_of(a(i, k)))));
    R smallest = std::numeric_limits<R>::infinity();
    for (int c = 0; c < n; ++c) {
        const auto relative = [&](int i) {
            const R largest = size[i];
            return largest > R(0) ? R(abs(value_of(a(i, c)))) / largest : R(0);
        };
        int pivot = c;
        for (int i = c + 1; i < n; ++i)
            if (relative(i) > relative(pivot))
                pivot = i;
        const R share = relative(pivot);
        smallest = share < smallest ? share : smallest;
        if (!(share > R(0)))
            return R(0);
        if (pivot != c) {
            for (int k = c; k < n; ++k)
                std::swap(a(c, k), a(pivot, k));
            std::swap(b[c], b[pivot]);
            std::swap(size[c], size[pivot]);
        }
        for (int i = c + 1; i < n; ++i) {
            const S factor = a(i, c) / a(c, c);
            for (int k = c + 1; k < n; ++k)
                a(i, k) -= factor * a(c, k);
            b[i] -= factor * b[c];
        }
    }
    for (int c = n - 1; c >= 0; --c) {
        for (int k = c + 1; k < n; ++k)
            b[c] -= a(c, k) * b[k];
        b[c] = b[c] / a(c, c);
    }
    return smallest;
}

} // namespace filippov
