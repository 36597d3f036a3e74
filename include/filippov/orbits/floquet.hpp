// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits of a word, and their Floquet multipliers.
#pragma once

#include <filippov/orbits/dense.hpp>
#include <filippov/orbits/detail/shooting.hpp>

#include <cmath>
#include <complex>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Floquet multipliers, largest first.
using Multipliers = std::vector<std::complex<double>>;

namespace detail {

/// The derivative of one segment between nodes: acts on deviations (dx, dt) of state and time.
inline Matrix node_map(const AnySystem& system, const Cycle& c, std::size_t i, const Jet& arc) {
    const int d = system.dim();
    Eigen::RowVectorXd delay = Eigen::RowVectorXd::Zero(d + 1); // of the end
    const Matrix A = arc.slope.leftCols(d + 1);
    const Vector f = arc.slope.col(d + 1);
    if (c.word[i].until == Until::phase) {
        if (system.forced())
            delay[d] = 1; // the period later
        else
            delay = -(f.transpose() * A) / f.squaredNorm();
    } else {
        const Jet g = system.quantity(condition(c.word[i]), c.end(i), c.next(i), c.p, {});
        const Eigen::RowVectorXd gx = g.slope.row(0).head(d);
        delay = -(gx * A) / (gx.dot(f) + g.slope(0, d));
    }
    Matrix E(d + 1, d + 1);
    E << A + f * delay, delay;
    return E;
}

/// Orthonormal basis of the directions in which node i can vary.
inline Matrix node_tangent(const AnySystem& system, const Cycle& c, std::size_t node) {
    const int d = system.dim();
    const int m = system.forced() ? d + 1 : d;
    const std::size_t n = c.size();
    const Letter& before = c.word[node + n - 1];
    std::vector<Eigen::RowVectorXd> normals;
    const auto add = [&](const Quantity& q) {
        normals.push_back(system.quantity(q, c.t[node], c.x[node], c.p, {}).slope.row(0).head(m));
    };
    if (before.until == Until::phase) {
        Eigen::RowVectorXd normal = Eigen::RowVectorXd::Zero(m);
        if (system.forced())
            normal[d] = 1;
        else
            normal = system.field(before.mode, 0, c.x[node], c.p).transpose();
        normals.push_back(normal);
    } else {
        add(condition(before));
        for (int j = 0; j < c.word.surfaces; ++j)
            if (mode_entry(before.mode, j) == 0)
                add({Quantity::Kind::h, before.mode, 0, j});
    }
    Matrix C(Eigen::Index(normals.size()), m);
    for (std::size_t k = 0; k < normals.size(); ++k)
        C.row(Eigen::Index(k)) = normals[k] / normals[k].norm();
    const Matrix Q = dense::orthogonal(C.transpose());
    return Q.rightCols(m - C.rows());
}

/// NaN where the matrix has an entry that is no number.
inline std::vector<std::complex<double>> eigenvalues_of(const Matrix& J) {
    if (J.rows() == 0)
        return {};
    if (!J.allFinite()) // none of them is known to be stable
        return std::vector<std::complex<double>>(std::size_t(J.rows()),
                                                 std::numeric_limits<double>::quiet_NaN());
    const Eigen::VectorXcd values = dense::eigenvalues(J);
    return {values.begin(), values.end()};
}
/// Eigenvalues of a return map, and the multipliers that are known: 1 of an autonomous system, and
/// zeros for the directions in which a node cannot vary.
inline Multipliers sorted_multipliers(const AnySystem& system, const Matrix& reduced) {
    Multipliers multipliers = eigenvalues_of(reduced);
    const bool known = reduced.allFinite();
    if (!system.forced())
        multipliers.emplace_back(1);
    multipliers.resize(std::size_t(system.dim()), 0.0);
    if (known) // what is no number has no place
        std::sort(multipliers.begin(), multipliers.end(), [](const auto& a, const auto& b) {
            return std::abs(a) != std::abs(b) ? std::abs(a) > std::abs(b) : a.imag() > b.imag();
        });
    return multipliers;
}

} // namespace detail

/// Floquet multipliers of a solved cycle, dim of them, largest first.
///
/// They are the eigenvalues of the return map of one node, taken where the node can vary. At the
/// end of a slide that has a dimension less for each surface slid on: so many multipliers are 0
/// exactly, and so is the 1 of an autonomous system.
/// @param arcs  derivatives of the segments, if they are known: see Shooting::arcs_in
inline Multipliers floquet(const AnySystem& system, const Cycle& c,
                           const std::vector<Jet>& arcs = {}) {
    detail::require_cycle(system, c);
    const std::size_t n = c.size();
    std::size_t first = 0; // the end of a slide, if there is one, on most surfaces at once
    int most = 1;
    for (std::size_t i = 0; i < n; ++i)
        if (const int slides = slid_on(c.word[i].mode, c.word.surfaces); slides >= most) {
            first = (i + 1) % n;
            most = slides;
        }
    const Matrix Q = detail::node_tangent(system, c, first);
    Matrix M = Q;
    const auto m = Q.rows(); // an autonomous system does not care for a deviation of time
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t i = (first + k) % n;
        const Jet arc =
            arcs.empty() ? system.arc(c.word[i].mode, c.t[i], c.x[i], c.end(i), c.p, {}) : arcs[i];
        M = detail::node_map(system, c, i, arc).topLeftCorner(m, m) * M;
    }
    const Matrix reduced = Q.transpose() * M;
    return detail::sorted_multipliers(system, reduced);
}

/// True if all Floquet multipliers are inside the unit circle, but for the one of an autonomous
/// system that is 1.
inline bool is_stable(const Multipliers& multipliers, bool forced) {
    std::ptrdiff_t inside = forced ? 0 : 1;
    for (const auto& m : multipliers)
        inside += std::abs(m) < 1;
    return inside >= std::ptrdiff_t(multipliers.size());
}

/// A periodic orbit, or why there is none.
struct Orbit {
    Cycle cycle;
    Multipliers multipliers; ///< dim of them, largest first
    double t_start = 0;      ///< where the monodromy matrix is taken
    Vector x_start;          ///< state there
    Matrix monodromy;        ///< dx(t_start + period)/dx(t_start)
    Convergence convergence;
    Status status = Status::not_converged;
    std::string message; ///< of a failure

    bool stable(bool forced) const { return is_stable(multipliers, forced); }
};

namespace detail {

/// The cycle with a node of its own at time t inside segment i, where nothing happens.
inline Cycle cut(const AnySystem& system, const Cycle& c, std::size_t i, double t, Jet& to_cut) {
    to_cut = system.arc(c.word[i].mode, c.t[i], c.x[i], t, c.p, {});
    Cycle r = c;
    r.word.letters.insert(r.word.letters.begin() + std::ptrdiff_t(i),
                          {c.word[i].mode, Until::phase});
    r.t.insert(r.t.begin() + std::ptrdiff_t(i) + 1, t);
    r.x.insert(r.x.begin() + std::ptrdiff_t(i) + 1, to_cut.value);
    return r;
}

/// Onto the surface along f2 - f1: what a deviation becomes that starts where sliding attracts.
inline Matrix fall(const AnySystem& system, double t, const Vector& x, const Vector& p) {
    const auto rate = [&](int side) {
        return system.quantity({Quantity::Kind::h, side, 1}, t, x, p, {}).value[0];
    };
    const int d = system.dim();
    const Eigen::RowVectorXd normal =
        system.quantity({Quantity::Kind::h, -1, 0}, t, x, p, {}).slope.row(0).head(d);
    return Matrix::Identity(d, d) +
           (system.field(1, t, x, p) - system.field(-1, t, x, p)) * (normal / (rate(-1) - rate(1)));
}

} // namespace detail

/// Where a cycle is said to start, and which segment that is in.
struct CycleStart {
    double t = 0;
    std::size_t in = 0;
};

/// The start of a cycle: time 0, up to whole cycles, which is phase zero of the forcing; the middle
/// of the longest segment if there is none.
inline CycleStart start_of(const AnySystem& system, const Cycle& c) {
    const std::size_t n = c.size();
    CycleStart start;
    if (system.forced()) {
        start.t = c.period * std::ceil(c.t[0] / c.period - 1e-12);
        while (start.in + 1 < n && c.end(start.in) <= start.t)
            ++start.in;
    } else {
        for (std::size_t i = 0; i < n; ++i)
            if (c.duration(i) > c.duration(start.in))
                start.in = i;
        start.t = c.t[start.in] + c.duration(start.in) / 2;
    }
    return start;
}

/// State and monodromy matrix of a solved cycle at its start.
inline void find_start(const AnySystem& system, Orbit& orbit) {
    const Cycle& c = orbit.cycle;
    const std::size_t n = c.size();
    const int d = system.dim();
    const auto [t, in] = start_of(system, c);
    orbit.t_start = t;
    const int mode = c.word[in].mode;
    Jet to_start;
    const Cycle whole = detail::cut(system, c, in, t, to_start);
    orbit.x_start = to_start.value;
    if (c.word.surfaces > 1) {
        const Journey turn =
            system.journey({.t0 = t, .x = orbit.x_start, .t_end = t + c.period}, c.p, {});
        orbit.monodromy = turn.end.slope.topLeftCorner(d, d);
        return;
    }
    // from the start to the end of its segment, round the cycle, and back to the start
    const Jet out = system.arc(mode, t, orbit.x_start, c.end(in), c.p, {});
    Matrix M = detail::node_map(system, whole, in + 1, out);
    Matrix start = Matrix::Zero(d + 1, d);
    start.topRows(d) = slid_on(mode, c.word.surfaces) > 0
                           ? detail::fall(system, t, orbit.x_start, c.p)
                           : Matrix::Identity(d, d);
    M = M * start;
    for (std::size_t k = 1; k < n; ++k) {
        const std::size_t i = (in + k) % n;
        const Jet arc = system.arc(c.word[i].mode, c.t[i], c.x[i], c.end(i), c.p, {});
        M = detail::node_map(system, c, i, arc) * M;
    }
    orbit.monodromy = to_start.slope.leftCols(d + 1) * M;
}

namespace detail {

/// Whether a solved cycle is a solution: followed from its start it comes back, to ten thousand
/// tolerances of its size. (Shooting forces its modes.)
inline bool is_solution(const AnySystem& system, const Orbit& orbit) {
    const Cycle& c = orbit.cycle;
    const double t = orbit.t_start;
    const History turn = system.run(t, orbit.x_start, t + c.period, c.p);
    const Vector scale = Shooting(system, c).scales(c).head(system.dim());
    double growth = 1;
    for (const auto& m : orbit.multipliers)
        growth = std::max(growth, std::abs(m));
    return turn.status == Status::ok && (turn.x - orbit.x_start).cwiseQuotient(scale).norm() <=
                                            (1e4 * system.rtol() + 1e-8) * growth;
}

} // namespace detail

/// A cycle that is an orbit already, whether Newton's iteration converges to it or not: at a fold
/// the shortest step towards the solutions is next to nothing, but the Jacobian is singular.
inline Convergence solved_already(const AnySystem& system, const Cycle& cycle) {
    Convergence c;
    const Shooting shooting(system, cycle);
    const auto e = shooting.evaluate(shooting.pack(cycle));
    if (e.status != Status::ok || !e.F.allFinite() || !e.J.allFinite())
        return c;
    // Unknowns and equations in units of their own: what is singular has no unit.
    Matrix J = e.J * shooting.scales(cycle).asDiagonal();
    const Vector size = J.rowwise().norm().cwiseMax(std::numeric_limits<double>::min());
    J = size.cwiseInverse().asDiagonal() * J;
    c.step = dense::shortest(J, e.F.cwiseQuotient(size), 1e-6).norm();
    if (c.step < 1e-9)
        c.status = Status::ok;
    return c;
}

/// Newton on a cycle, then all that belongs to an orbit, and a run to see that it is one.
inline Orbit solve_orbit(const AnySystem& system, Cycle cycle) {
    detail::refuse_jumps(system);
    Orbit orbit;
    orbit.convergence = shoot(system, cycle);
    if (!orbit.convergence.ok() && !system.interrupted())
        orbit.convergence = solved_already(system, cycle);
    orbit.cycle = std::move(cycle);
    orbit.status = orbit.convergence.status;
    if (system.interrupted()) {
        orbit.status = Status::interrupted;
        orbit.message = message(Status::interrupted);
        return orbit;
    }
    if (!orbit.convergence.ok()) {
        orbit.message =
            "Newton's iteration on the word " + orbit.cycle.word.string() + " did not converge";
        return orbit;
    }
    orbit.multipliers = floquet(system, orbit.cycle);
    find_start(system, orbit);
    if (!detail::is_solution(system, orbit)) {
        orbit.status = Status::not_converged;
        orbit.message = "the cycle of the word " + orbit.cycle.word.string() +
                        " is no solution here: followed from its start the system goes elsewhere";
    }
    if (system.interrupted()) {
        orbit.status = Status::interrupted;
        orbit.message = message(Status::interrupted);
    }
    return orbit;
}

namespace detail {

/// A solved cycle without repetitions of itself.
/// @param tolerance  of times and states, in units of the orbit
inline Cycle shortest(const AnySystem& system, const Cycle& c, double tolerance = 1e-7) {
    const std::size_t n = c.size();
    const Vector scale = Shooting(system, c).scales(c).head(system.dim());
    const auto near = [&](const Vector& a, const Vector& b) {
        return (a - b).cwiseQuotient(scale).norm() < tolerance;
    };
    if (n == 1 && c.word[0].until == Until::phase) {
        for (int turns = 1; turns < c.turns; ++turns) {
            Cycle one = c;
            one.turns = turns;
            one.period = c.period * turns / c.turns;
            if (c.turns % turns == 0 &&
                near(system.arc(c.word[0].mode, c.t[0], c.x[0], one.end(0), c.p, {}).value, c.x[0]))
                return one;
        }
        return c;
    }
    for (std::size_t part = 1; part < n; ++part) {
        const auto times = int(n / part);
        if (n % part != 0 || (system.forced() && c.turns % times != 0))
            continue;
        const double period = c.period / times;
        bool same = true;
        for (std::size_t i = 0; same && i < n; ++i) {
            const std::size_t j = (i + part) % n;
            same = c.word[i] == c.word[j] &&
                   std::abs(std::remainder(c.t[j] - c.t[i] - period, c.period)) <
                       tolerance * c.period &&
                   near(c.x[j], c.x[i]);
        }
        if (!same)
            continue;
        Cycle one = c;
        one.word.letters.resize(part);
        one.t.resize(part);
        one.x.resize(part);
        one.period = period;
        if (system.forced())
            one.turns = c.turns / times;
        return one;
    }
    return c;
}

/// The orbit of the least period that Newton's iteration finds from a cycle.
inline Orbit solve_shortest(const AnySystem& system, const Cycle& cycle) {
    const Orbit orbit = solve_orbit(system, cycle);
    if (orbit.status != Status::ok)
        return orbit;
    const Cycle one = shortest(system, orbit.cycle);
    return one.period < 0.9 * orbit.cycle.period ? solve_orbit(system, one) : orbit;
}

} // namespace detail

} // namespace filippov
