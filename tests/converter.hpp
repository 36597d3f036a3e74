// SPDX-License-Identifier: BSD-3-Clause
// A buck converter, fed with E where h > 0: its voltage and current. What h compares is up to a
// test.
#pragma once

#include <filippov/system/system.hpp>

/// @tparam P  parameters, of which E is the first
template <int P> struct Converter {
    static constexpr int dim = 2;

    template <filippov::Scalar S>
    filippov::Vec<S, 2> f1(const S&, const filippov::Vec<S, 2>& x,
                           const filippov::Vec<S, P>&) const {
        return fed(x, S(0));
    }
    template <filippov::Scalar S>
    filippov::Vec<S, 2> f2(const S&, const filippov::Vec<S, 2>& x,
                           const filippov::Vec<S, P>& p) const {
        return fed(x, p[0]);
    }
    template <filippov::Scalar S> S period(const filippov::Vec<S, P>&) const { return S(0.4); }

private:
    template <filippov::Scalar S>
    static filippov::Vec<S, 2> fed(const filippov::Vec<S, 2>& x, const S& u) {
        return {(x[1] - x[0] / S(22)) / S(0.047), (u - x[0]) / S(20)};
    }
};

/// A boost converter under peak-current control: voltage, current, latch and clock. The clock
/// (every 0.1 ms) closes the switch, q = 1; the current's peak opens it, q = 0. Units: V, A, ms,
/// mH, mF.
///
/// @tparam Latched  by how much a latch that is open keeps the current from its peak: any number
template <int Latched = 100> struct ClockedBoost {
    static constexpr int dim = 4;
    static constexpr bool linear_h = true;
    static constexpr int surfaces = 2;
    static constexpr std::array<std::string_view, 4> state{"v", "i", "q", "tau"};
    static constexpr std::array<std::string_view, 1> params{"Iref"};
    static constexpr std::array<double, 1> defaults{1.6};
    static constexpr std::array kinds{filippov::SurfaceKind::jump, filippov::SurfaceKind::jump};
    static constexpr double E = 10, L = 1, C = 0.012, R = 20, T = 0.1;

    template <filippov::Scalar S>
    filippov::Vec<S, 4> field(const S&, const filippov::Vec<S, 4>& x, const filippov::Vec<S, 2>&,
                              const filippov::Vec<S, 1>&) const {
        const S off = S(1) - x[2];
        return {(off * x[1] - x[0] / S(R)) / S(C), (S(E) - off * x[0]) / S(L), S(0), S(1)};
    }
    template <filippov::Scalar S>
    filippov::Vec<S, 2> h(const S&, const filippov::Vec<S, 4>& x,
                          const filippov::Vec<S, 1>& p) const {
        return {S(T) - x[3], p[0] - x[1] + S(Latched) * (S(1) - x[2])};
    }
    template <filippov::Scalar S>
    filippov::Vec<S, 4> jump(int j, const S&, const filippov::Vec<S, 4>& x,
                             const filippov::Vec<S, 1>&) const {
        if (j == 0)
            return {x[0], x[1], S(1), S(0)};
        return {x[0], x[1], S(0), x[3]};
    }
    template <filippov::Scalar S> S period(const filippov::Vec<S, 1>&) const { return S(T); }
};
