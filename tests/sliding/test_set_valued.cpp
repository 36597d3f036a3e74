// SPDX-License-Identifier: BSD-3-Clause
// Slides whose s is not unique: what bounds the set of all s, and its point of least norm, against
// all 3^m active sets.

#include "catch.hpp"

#include <filippov/sliding/detail/set_valued.hpp>

#include <Eigen/QR>

#include <bit>
#include <cmath>
#include <random>
#include <vector>

using namespace filippov;

namespace {

constexpr int M = 6;
using Controls = detail::Controls<double, M>;
using Matrix = Eigen::MatrixXd;
using Column = Eigen::VectorXd;

/// L = a u + b with a = -N P N' D of a rank below n and b within its range; entries are small
/// integers, for ties, or any.
Controls draw(std::mt19937& generator, bool integers, bool contacts) {
    std::uniform_real_distribution<double> real(-1, 1);
    std::uniform_int_distribution<int> integer(-1, 1), any_n(2, M);
    const auto entry = [&] { return integers ? double(integer(generator)) : real(generator); };
    Controls c;
    const int n = c.n = any_n(generator);
    const int rank = std::uniform_int_distribution<int>(1, n - 1)(generator);
    Matrix rows(n, rank);
    for (;;) {
        for (double& v : rows.reshaped())
            v = entry();
        if (rows.rowwise().norm().minCoeff() > 0.1)
            break;
    }
    Column strength(n), start(n);
    for (int k = 0; k < n; ++k) {
        c.contact[std::size_t(k)] = contacts && real(generator) > 0.3;
        strength[k] = integers ? 1 : 1.1 + real(generator);
        start[k] = (integers ? 0.5 * integer(generator) : real(generator)) * 2;
    }
    Matrix a = -(rows * rows.transpose()) * strength.asDiagonal();
    for (int k = 0; k < n; ++k)
        if (c.contact[std::size_t(k)]) {
            a.col(k) *= -1;
            start[k] = std::abs(start[k]);
        }
    const Column b = -a * start;
    c.a.setZero();
    c.b.setZero();
    c.unit.setOnes();
    c.noise.setConstant(1e-15);
    c.a.topLeftCorner(n, n) = a;
    c.b.head(n) = b;
    return c;
}
Matrix matrix(const Controls& c) { return c.a.topLeftCorner(c.n, c.n); }
Column right(const Controls& c) { return -c.b.head(c.n); }

/// The largest margin: of all vertices, at which as many bounds are met as there are unknowns left.
double largest_margin(const Controls& c, int rank) {
    const int n = c.n, free = n - rank + 1;
    Matrix bounds(0, n + 1); // bounds * (u, margin) <= limits
    Column limits(0);
    const auto add = [&](int k, double sign, double limit) {
        bounds.conservativeResize(bounds.rows() + 1, n + 1);
        limits.conservativeResize(limits.size() + 1);
        bounds.bottomRows(1).setZero();
        bounds(bounds.rows() - 1, k) = sign;
        bounds(bounds.rows() - 1, n) = 1;
        limits[limits.size() - 1] = limit;
    };
    for (int k = 0; k < n; ++k) {
        if (!c.contact[std::size_t(k)])
            add(k, 1, 1);
        add(k, -1, c.contact[std::size_t(k)] ? 0 : 1);
    }
    const int m = int(bounds.rows());
    double best = -1e300;
    for (unsigned set = 0; set < 1u << m; ++set) {
        if (std::popcount(set) != free)
            continue;
        Matrix equations(n + free, n + 1);
        Column values(n + free);
        equations.setZero();
        equations.topLeftCorner(n, n) = matrix(c);
        values.head(n) = right(c);
        for (int i = 0, r = n; i < m; ++i)
            if ((set >> i & 1u) != 0) {
                equations.row(r) = bounds.row(i);
                values[r++] = limits[i];
            }
        const Eigen::CompleteOrthogonalDecomposition<Matrix> solver(equations);
        const Column u = solver.solve(values);
        if ((equations * u - values).cwiseAbs().maxCoeff() < 1e-9 &&
            (bounds * u - limits).maxCoeff() < 1e-9)
            best = std::max(best, u[n]);
    }
    return best;
}

/// The least norm of the relays' s: of all active sets, in each the least with free forces.
/// Infinite if there is no solution.
double smallest_norm(const Controls& c) {
    const int n = c.n;
    int sets = 1;
    for (int k = 0; k < n; ++k)
        sets *= 3;
    double best = std::numeric_limits<double>::infinity();
    for (int code = 0; code < sets; ++code) {
        Column rest = right(c);
        std::vector<int> relays, forces;
        double norm = 0;
        bool twice = false;
        for (int k = 0, digits = code; k < n; ++k, digits /= 3) {
            const int side = digits % 3 - 1;
            if (c.contact[std::size_t(k)]) {
                twice = twice || side > 0;
                if (side == 0)
                    forces.push_back(k);
            } else if (side == 0) {
                relays.push_back(k);
            } else {
                rest -= side * matrix(c).col(k);
                norm += 1;
            }
        }
        if (twice)
            continue;
        const Matrix push = matrix(c)(Eigen::all, forces), pull = matrix(c)(Eigen::all, relays);
        Eigen::CompleteOrthogonalDecomposition<Matrix> by_force;
        if (!forces.empty())
            by_force.compute(push);
        if (!forces.empty() && by_force.rank() < int(forces.size()))
            continue; // fewer of them do as well
        const Matrix beside =
            forces.empty() ? Matrix(Matrix::Identity(n, n))
                           : Matrix(Matrix::Identity(n, n) - push * by_force.pseudoInverse());
        Column s = Column::Zero(int(relays.size()));
        if (!relays.empty()) {
            Matrix seen = beside * pull;
            for (double& v : seen.reshaped())
                v = std::abs(v) < 1e-12 ? 0 : v;
            s = Eigen::CompleteOrthogonalDecomposition<Matrix>(seen).solve(beside * rest);
        }
        Column left = rest;
        if (!relays.empty())
            left -= pull * s;
        Column force = Column::Zero(int(forces.size()));
        if (!forces.empty()) {
            force = by_force.solve(left);
            left -= push * force;
        }
        const bool within = (relays.empty() || s.cwiseAbs().maxCoeff() <= 1 + 1e-9) &&
                            (forces.empty() || force.minCoeff() >= -1e-9);
        if (within && left.cwiseAbs().maxCoeff() < 1e-9)
            best = std::min(best, norm + s.squaredNorm());
    }
    return best;
}

template <class Check> void each(const Check& check) {
    std::mt19937 generator(7);
    for (const bool integers : {false, true})
        for (const bool contacts : {false, true})
            for (int k = 0; k < 60; ++k) {
                CAPTURE(integers, contacts, k);
                check(draw(generator, integers, contacts));
            }
}

} // namespace

TEST_CASE("set-valued: the margin is the largest of all vertices", "[set-valued]") {
    int empty = 0, full = 0, n = 0;
    each([&](const Controls& c) {
        const detail::Solutions<double, M> all(c);
        const int rank = int(Eigen::CompleteOrthogonalDecomposition<Matrix>(matrix(c)).rank());
        REQUIRE(all.rank == rank);
        CHECK(all.residual < 1e-9);
        const detail::Widest<double, M> widest(c, all);
        const double margin = std::min(largest_margin(c, rank), 1.0);
        INFO(matrix(c) << "\nb " << c.b.transpose());
        const bool relays = std::count(c.contact.begin(), c.contact.begin() + c.n, false) > 0;
        if (margin > -1e299 && (relays || margin < 1)) // contacts may push as hard as they like
            CHECK(widest.margin == Approx(margin).margin(1e-9));
        const auto [u, found] = widest.vertex(c);
        CHECK(found == Approx(widest.margin).margin(1e-9));
        CHECK((matrix(c) * u.head(c.n) - right(c)).cwiseAbs().maxCoeff() < 1e-8);
        for (int k = 0; k < c.n; ++k) { // it keeps all bounds by the margin
            const bool contact = c.contact[std::size_t(k)];
            CHECK((contact ? u[k] : 1 - std::abs(u[k])) > found - 1e-8);
            if (const int met = widest.met[std::size_t(k)]; met != 0)
                CHECK((contact ? u[k] : 1 - met * u[k]) == Approx(found).margin(1e-8));
        }
        empty += margin < 0;
        full += margin > 0;
        ++n;
    });
    CHECK(empty > n / 10);
    CHECK(full > n / 3);
}

TEST_CASE("set-valued: what bounds the set at margin zero is in every solution", "[set-valued]") {
    int met = 0;
    each([&](Controls c) {
        const detail::Solutions<double, M> all(c);
        const double from = detail::Widest<double, M>(c, all).margin;
        if (std::count(c.contact.begin(), c.contact.begin() + c.n, true) > 0 || !(from < 0.9))
            return;
        c.b /= 1 - from; // to the edge
        const detail::Solutions<double, M> edge(c);
        const detail::Widest<double, M> widest(c, edge);
        REQUIRE(widest.margin == Approx(0).margin(1e-12));
        // no solution has less of what is met: the least norm has all of it
        const auto s = detail::least_norm(c, edge, widest.vertex(c).first);
        for (int k = 0; k < c.n; ++k)
            if (const int side = widest.met[std::size_t(k)]; side != 0) {
                CHECK(s[k] == Approx(side).margin(1e-6));
                ++met;
            }
    });
    CHECK(met > 100);
}

TEST_CASE("set-valued: the reported s has the least norm", "[set-valued]") {
    int n = 0;
    each([&](const Controls& c) {
        const double least = smallest_norm(c);
        if (!(least < std::numeric_limits<double>::infinity()))
            return;
        const detail::Solutions<double, M> all(c);
        const detail::Widest<double, M> widest(c, all);
        const auto s = detail::least_norm(c, all, widest.vertex(c).first);
        INFO(matrix(c) << "\nb " << c.b.transpose() << "\ns " << s.transpose());
        double norm = 0;
        for (int k = 0; k < c.n; ++k) {
            const bool contact = c.contact[std::size_t(k)];
            norm += contact ? 0 : s[k] * s[k];
            CHECK((contact ? s[k] >= -1e-7 : std::abs(s[k]) <= 1 + 1e-7));
        }
        CHECK(norm <= least + 1e-6); // (and no solution has less than the least)
        CHECK((matrix(c) * s.head(c.n) - right(c)).cwiseAbs().maxCoeff() < 1e-7);
        ++n;
    });
    CHECK(n > 100);
}

TEST_CASE("set-valued: gradients and friction dissipate, in any units of h", "[set-valued]") {
    std::mt19937 generator(3);
    std::uniform_real_distribution<double> power(-9, 9);
    for (const bool contacts : {false, true})
        for (int k = 0; k < 100; ++k) {
            Controls c = draw(generator, false, contacts);
            for (int i = 0; i < c.n; ++i) {
                const double unit = std::pow(10, power(generator));
                c.a.row(i) *= unit;
                c.noise[i] *= unit;
            }
            CHECK(detail::dissipates(c) > 0);
            c.a.col(0).head(c.n) *= -1; // a relay the wrong way
            CHECK(detail::dissipates(c) < 0);
        }
    // a coupling that turns more than it dissipates
    Controls c;
    c.n = 3;
    c.a.setZero();
    c.noise.setConstant(1e-15);
    c.a.topLeftCorner(3, 3) << -1, 3, -1, -3, -1, -3, -1, 3, -1;
    CHECK(detail::dissipates(c) > 0);
    c.a(1, 0) = -12;
    c.a(1, 2) = 12;
    CHECK(detail::dissipates(c) < 0);
}
