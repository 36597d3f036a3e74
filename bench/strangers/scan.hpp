// SPDX-License-Identifier: BSD-3-Clause
// Roots of a function in closed form, by a dense scan and bisection: the logic of the oracles.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace filippov::strangers {

using Long = long double;

/// Where a function that is positive after `from` becomes zero first, up to `to`; infinity: it does
/// not. It is sampled at least eight times a `step`; where three samples have a least one in the
/// middle, the minimum is found between them.
/// @param step  over which the function cannot do more than swing once
template <class F> Long first_root(const F& f, Long from, Long to, Long step) {
    const auto bisect = [&](Long a, Long b) { // f(a) > 0 >= f(b)
        for (int k = 0; k < 200; ++k) {
            const Long c = a + (b - a) / 2;
            if (!(a < c && c < b))
                break;
            (f(c) > 0 ? a : b) = c;
        }
        return b;
    };
    const Long d = step / 8;
    Long t0 = from, t1 = from, f0 = std::numeric_limits<Long>::infinity(), f1 = f0;
    for (long long k = 1;; ++k) {
        // (the first samples are close: what rises from zero does so slowly)
        const Long t = std::min(to, from + (k <= 16 ? d * Long(k) / 16 : d * Long(k - 15)));
        const Long f2 = f(t);
        if (!(f2 > 0)) {
            if (k == 1) { // it falls at once, or it has risen and come back before the first sample
                Long a = t;
                for (int halved = 0; halved < 36 && !(f(a) > 0); ++halved)
                    a = from + (a - from) / 2;
                return f(a) > 0 ? bisect(a, t) : from;
            }
            return bisect(t1, t);
        }
        // (the last samples may have it between them)
        const bool last = !(t < to) && f2 < f1 && f2 < 0.2L * std::abs(f1) + 0.05L;
        const bool least =
            f1 <= f0 && f1 <= f2 && f1 < 0.2L * (std::abs(f0) + std::abs(f2)) + 0.05L;
        if (k > 2 && (least || last)) {
            Long a = t0, b = t;
            for (int i = 0; i < 90; ++i) { // golden section
                const Long c = a + (b - a) * 0.381966011250105151796L,
                           e = a + (b - a) * 0.618033988749894848204L;
                const Long fc = f(c), fe = f(e);
                if (!(fc > 0))
                    return bisect(t0, c);
                if (!(fe > 0))
                    return bisect(t0, e);
                (fc < fe ? b : a) = fc < fe ? e : c;
                if (b - a < 1e-9L * (t - t0))
                    break;
            }
        }
        if (!(t < to))
            return std::numeric_limits<Long>::infinity();
        t0 = t1, f0 = f1, t1 = t, f1 = f2;
    }
}

/// All roots, both ways.
template <class F>
void all_roots(const F& f, Long from, Long to, Long step, std::vector<Long>& roots) {
    Long sign = f(from) > 0 ? 1 : -1;
    while (from < to) {
        const Long root = first_root([&](Long t) { return sign * f(t); }, from, to, step);
        if (!(root <= to))
            return;
        if (root > from)
            roots.push_back(root);
        from = std::max(root, std::nextafter(from, to));
        sign = -sign;
    }
}

} // namespace filippov::strangers
