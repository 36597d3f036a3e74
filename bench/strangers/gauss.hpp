// SPDX-License-Identifier: BSD-3-Clause
// Gauss' method of five stages and order ten, with short steps: the integrator of the oracle of
// blocks on belts.
#pragma once

#include "wave.hpp"

#include <array>
#include <cmath>

namespace filippov::strangers {

class Gauss {
public:
    static constexpr int stages = 5;
    using Nodes = std::array<Long, stages>;

    Gauss() {
        for (int i = 0; i < stages; ++i)
            c[std::size_t(i)] = node(i);
        for (int j = 0; j < stages; ++j)
            integral_of_lagrange(j);
    }
    static const Gauss& method() {
        static const Gauss once;
        return once;
    }

    Nodes c{};
    /// What stage j weighs at theta: the integral of its Lagrange polynomial from 0.
    Long weight(int j, Long theta) const {
        const auto& p = integral_[std::size_t(j)];
        Long sum = 0;
        for (int k = stages; k-- > 0;)
            sum = (sum + p[std::size_t(k)]) * theta;
        return sum;
    }

private:
    /// Root of the Legendre polynomial of degree five, on (0, 1).
    static Long node(int i) {
        Long x = -std::cos(std::acos(-1.0L) * (Long(i) + 0.75L) / (stages + 0.5L));
        for (int k = 0; k < 20; ++k) {
            Long p0 = 1, p1 = x;
            for (int n = 2; n <= stages; ++n) {
                const Long p2 = ((2 * n - 1) * x * p1 - (n - 1) * p0) / n;
                p0 = p1;
                p1 = p2;
            }
            x -= p1 * (x * x - 1) / (stages * (x * p1 - p0));
        }
        return (1 + x) / 2;
    }
    void integral_of_lagrange(int j) {
        std::array<Long, stages> p{};
        p[0] = 1;
        for (int m = 0, degree = 0; m < stages; ++m) {
            if (m == j)
                continue;
            const Long root = c[std::size_t(m)], d = c[std::size_t(j)] - root;
            for (int k = ++degree; k >= 0; --k)
                p[std::size_t(k)] =
                    ((k > 0 ? p[std::size_t(k - 1)] : 0) - root * p[std::size_t(k)]) / d;
        }
        for (int k = 0; k < stages; ++k)
            p[std::size_t(k)] /= k + 1;
        integral_[std::size_t(j)] = p;
    }

    std::array<std::array<Long, stages>, stages> integral_{};
};

} // namespace filippov::strangers
