// SPDX-License-Identifier: BSD-3-Clause
// Systems of formulas for tests.
#pragma once

#include <filippov/formulas/tape_system.hpp>
#include <filippov/models/oscillator.hpp>

#include <memory>
#include <vector>

namespace filippov::tests {

/// The oscillator as a user would write it: one formula with a sign and an absolute value. Its
/// surface has the model's orientation.
inline Definition oscillator_formulas() {
    Definition d;
    d.dim = 2;
    d.state_names = {"y", "v"};
    d.param_names = {models::Oscillator::params.begin(), models::Oscillator::params.end()};
    d.defaults = {models::Oscillator::defaults.begin(), models::Oscillator::defaults.end()};
    Graph& g = d.graph;
    const Expr y = g.state(0), v = g.state(1), u = g.sub(g.param(5), v);
    const Expr A = g.param(0), omega = g.param(1), m = g.param(2), k = g.param(3),
               gravity = g.param(4), alpha = g.param(6), gamma = g.param(7), beta = g.param(8),
               eta = g.param(9);
    const Expr falling = g.div(alpha, g.add(g.constant(1), g.mul(gamma, g.abs(u))));
    const Expr mu = g.add(g.add(falling, beta), g.mul(eta, g.mul(u, u)));
    const Expr friction = g.mul(g.mul(g.mul(m, gravity), mu), g.unary(Op::sign, u));
    const Expr forcing = g.mul(A, g.unary(Op::cos, g.mul(omega, g.time())));
    const Expr f = g.div(g.add(g.sub(forcing, g.mul(k, y)), friction), m);
    d.period = g.div(g.constant(6.283185307179586476925), omega);
    split(d, std::vector<Expr>{v, f}, std::vector<Expr>{g.sub(v, g.param(5))});
    return d;
}

template <int N, int M = 1> TapeSystem<N, M, 32> tape_system(Definition d) {
    return TapeSystem<N, M, 32>(std::make_shared<const TapeProgram>(d, 32));
}

} // namespace filippov::tests
