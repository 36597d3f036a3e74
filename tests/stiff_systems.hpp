// SPDX-License-Identifier: BSD-3-Clause
// Stiff Filippov systems.
#pragma once

#include <filippov/system/system.hpp>

/// A relay behind a fast actuator: x'' = -x - x'/5 + w/2 + 2 cos(2t), epsilon w' = -sign(x) - w.
/// After each switch w settles within some epsilon.
struct FastActuator {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 1> params{"epsilon"};
    static constexpr std::array<double, 1> defaults{1e-4};

    template <class S> using X = filippov::Vec<S, 3>;
    template <class S> using P = filippov::Vec<S, 1>;

    template <filippov::Scalar S>
    static X<S> field(int u, const S& t, const X<S>& x, const P<S>& p) {
        using std::cos;
        return {x[1], S(2) * cos(S(2) * t) - x[0] - x[1] / S(5) + x[2] / S(2),
                (S(u) - x[2]) / p[0]};
    }
    template <filippov::Scalar S> X<S> f1(const S& t, const X<S>& x, const P<S>& p) const {
        return field(1, t, x, p);
    }
    template <filippov::Scalar S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return field(-1, t, x, p);
    }
    template <filippov::Scalar S> S h(const S&, const X<S>& x, const P<S>&) const { return x[0]; }
};

/// Two blocks pressed against each other through a contact of stiffness 1e6 and damping 2e3; the
/// first lies on a belt of speed 1 with friction falling with speed, the second is pulled to and
/// fro. States y1, v1, y2, v2. Where the first block sticks the second is still stiff.
struct StiffContact {
    static constexpr int dim = 4;
    static constexpr std::array<std::string_view, 2> params{"stiffness", "damping"};
    static constexpr std::array<double, 2> defaults{1e6, 2e3};

    template <class S> using X = filippov::Vec<S, 4>;
    template <class S> using P = filippov::Vec<S, 2>;

    template <filippov::Scalar S>
    static X<S> field(const S& friction, const S& t, const X<S>& x, const P<S>& p) {
        using std::cos;
        const S contact = p[0] * (x[2] - x[0]) + p[1] * (x[3] - x[1]);
        return {x[1], contact - x[0] + friction, x[3], S(2) * cos(S(1.5) * t) - contact - x[2]};
    }
    /// Magnitude of the friction at relative speed r.
    template <filippov::Scalar S> static S mu(const S& r) { return S(1) + S(2) / (S(1) + r); }

    template <filippov::Scalar S> X<S> f1(const S& t, const X<S>& x, const P<S>& p) const {
        return field(mu(S(S(1) - x[1])), t, x, p);
    }
    template <filippov::Scalar S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return field(S(-mu(S(x[1] - S(1)))), t, x, p);
    }
    template <filippov::Scalar S> S h(const S&, const X<S>& x, const P<S>&) const {
        return x[1] - S(1);
    }
};
