// SPDX-License-Identifier: BSD-3-Clause
// Systems of four components whose state jumps: two bodies on moving floors, and converters with a
// clock and a latch.
#pragma once

#include "problem.hpp"
#include "scan.hpp"

namespace filippov::strangers {

/// A body (height, speed) on a floor: y'' = -weight + F(t), y >= Y(t); v+ - Y' = -e (v - Y').
struct Body {
    Wave force, floor;
    double weight = 1, e = 0;
    double pace() const { return std::min({force.pace(), floor.pace(), 1.0}); }
};

/// Two bodies that know nothing of each other: z = (y, v, y, v).
struct TwoBodies {
    std::array<Body, 2> bodies{};

    template <class S> void field(const S& t, const S* z, S* f) const {
        for (std::size_t j = 0; j < 2; ++j) {
            f[2 * j] = z[2 * j + 1];
            f[2 * j + 1] = bodies[j].force(t) - S(bodies[j].weight);
        }
    }
    template <class S> S h(std::size_t j, const S& t, const S* z) const {
        return z[2 * j] - bodies[j].floor(t);
    }
    /// @param rate  of the floor
    template <class S> void jump(std::size_t j, const S& rate, S* z) const {
        S& v = z[2 * j + 1];
        v = rate - S(bodies[j].e) * (v - rate);
    }
};

/// A converter: z = (x1, x2, tau, q), x' = A_q x + b_q with q = 0 or 1; the clock sets q = 1 every
/// T, and q = 0 where c x + ramp tau reaches the level.
struct Converter {
    std::array<std::array<double, 4>, 2> a{}; ///< A_q, by rows
    std::array<std::array<double, 2>, 2> b{};
    std::array<double, 2> c{};
    double ramp = 0, level = 1, clock = 1;

    template <class S> void field(const S* z, S* f) const {
        for (std::size_t i = 0; i < 2; ++i) {
            const auto side = [&](std::size_t q) {
                return S(a[q][2 * i]) * z[0] + S(a[q][2 * i + 1]) * z[1] + S(b[q][i]);
            };
            f[i] = (S(1) - z[3]) * side(0) + z[3] * side(1);
        }
        f[2] = S(1);
        f[3] = S(0);
    }
    template <class S> S h(std::size_t j, const S* z) const {
        if (j == 0)
            return S(clock) - z[2];
        return S(level) - S(c[0]) * z[0] - S(c[1]) * z[1] - S(ramp) * z[2] + S(100) * (S(1) - z[3]);
    }
    template <class S> void jump(std::size_t j, S* z) const {
        if (j == 0)
            z[2] = S(0);
        z[3] = S(j == 0 ? 1 : 0);
    }
};

struct Jumping {
    bool converts = false;
    TwoBodies bodies{};
    Converter converter{};
};

/// Defined in jumps.cpp.
Told ask_jumping(const Jumping& law, const Disguise& disguise, const Ask& ask);

} // namespace filippov::strangers
