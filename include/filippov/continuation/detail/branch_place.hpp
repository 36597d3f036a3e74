// SPDX-License-Identifier: BSD-3-Clause
// Where the tracer of a branch is: a point of the curve of a word's orbits, with its tangent.
#pragma once

#include <filippov/continuation/continuation.hpp>
#include <filippov/orbits/orbit.hpp>

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

namespace filippov {

namespace detail {

/// What a branch is followed over: one parameter of a system, between bounds.
struct BranchLine {
    const AnySystem& system;
    int parameter;
    double low, high;

    double width() const { return high - low; }
    double value(const Cycle& c) const { return c.p[parameter]; }
    bool holds(double value) const { return value >= low && value <= high; }
    /// Lengths in which steps are measured: the orbit's own, and the width.
    Vector scales(const Shooting& shooting, const Cycle& c) const {
        Vector scale = shooting.scales(c);
        scale[scale.size() - 1] = width();
        return scale;
    }
};

/// See the top of the file.
struct BranchPlace {
    std::shared_ptr<const Shooting> shooting;
    Arclength curve;
    Vector z, t;
    /// While no point of its word is on the branch: its multipliers at the bifurcation, none if
    /// they are not known.
    std::optional<Multipliers> entered;

    Cycle cycle() const { return shooting->unpack(z); }
    double slope() const { return t[t.size() - 1]; }
    double parameter() const { return parameter_of(z); }
    static double parameter_of(const Vector& u) { return u[u.size() - 1]; }
    /// How far along the tangent another point of the curve lies.
    double along(const Vector& u) const { return t.dot((u - z).cwiseQuotient(curve.scale())); }
};

/// A place on the curve of the cycle's word, its tangent such that `forward` of it is positive.
/// @param lengths  in which steps are measured; empty: the orbit's own
inline std::optional<BranchPlace> place_of(const BranchLine& line, const Cycle& c,
                                           const std::function<double(const Vector&)>& forward,
                                           const Vector& lengths = {}) {
    const auto shooting =
        std::make_shared<const Shooting>(line.system, c, std::array<int, 2>{line.parameter, -1});
    const Vector scale = lengths.size() > 0 ? lengths : line.scales(*shooting, c);
    BranchPlace p{shooting, {equations_of(*shooting), scale}, shooting->pack(c), {}, {}};
    if (!p.curve.tangent_at(p.z, Vector::Unit(p.z.size(), p.z.size() - 1), p.t))
        return std::nullopt;
    if (forward(scale.cwiseProduct(p.t)) < 0)
        p.t = -p.t;
    return p;
}
/// How far along the tangent a cycle of the place's word lies, wherever it is cut; NaN if it is of
/// another word.
inline double along_to(const BranchLine& line, const BranchPlace& here, const Cycle& c) {
    double along = std::numeric_limits<double>::quiet_NaN(),
           least = std::numeric_limits<double>::infinity();
    for (const Cycle& r : aligned(line.system, c, here.cycle())) {
        const Vector z = here.shooting->pack(r);
        const double distance = (z - here.z).cwiseQuotient(here.curve.scale()).norm();
        if (distance < least) {
            least = distance;
            along = here.along(z);
        }
    }
    return along;
}
/// At the point of the branch where the tracer is, as an orbit of its word: they jump where the
/// word changes.
inline const Multipliers& multipliers_at(const BranchPlace& here, const Branch& branch) {
    return here.entered ? *here.entered : branch.points.back().multipliers;
}

} // namespace detail

} // namespace filippov
