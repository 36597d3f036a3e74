// SPDX-License-Identifier: BSD-3-Clause
// Diagrams of the oscillator for tests.
#pragma once

#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/diagram.hpp>

#include <initializer_list>
#include <vector>

namespace diagrams {

using P = filippov::Params<filippov::models::Oscillator, double>;
using Value = filippov::DiagramValue<double, 2>;

inline std::vector<P> oscillators(std::initializer_list<double> omegas, double A = 0.5) {
    std::vector<P> params;
    for (const double omega : omegas) {
        params.push_back(filippov::default_params<filippov::models::Oscillator>());
        params.back()[0] = A;
        params.back()[1] = omega;
    }
    return params;
}

/// To the last bit; counters aside. (A state that is NaN is that of a run that there was not.)
inline bool same(const Value& a, const Value& b) {
    if (a.status != b.status || a.message != b.message || a.points.size() != b.points.size() ||
        a.cycle != b.cycle || a.skipped != b.skipped ||
        !(a.x_end == b.x_end || (a.x_end.hasNaN() && b.x_end.hasNaN())))
        return false;
    for (std::size_t i = 0; i < a.points.size(); ++i) {
        const auto &p = a.points[i], &q = b.points[i];
        if (p.period != q.period || p.t_local != q.t_local || p.x != q.x || p.kind != q.kind ||
            p.boundary != q.boundary || p.surface != q.surface)
            return false;
    }
    return true;
}

} // namespace diagrams
