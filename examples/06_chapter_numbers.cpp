// SPDX-License-Identifier: BSD-3-Clause
// The numbers of the chapter's bifurcations, computed on three routes: the 8th- and the 5th-order
// pair, and a looser tolerance. "ok" where all of them agree to one unit in the eleventh digit.

#include <filippov/continuation/bifurcation_set.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/orbits/any_system.hpp>

#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <string>

using namespace filippov;

using Numbers = std::map<std::string, double>;

Numbers compute(const AnySystem& system) {
    Numbers n;
    const auto params = [&](double A, double omega) {
        Vector p = system.defaults();
        p[0] = A;
        p[1] = omega;
        return p;
    };
    const auto note = [&](const std::string& what, const SpecialPoint& s, double A) {
        const double omega = s.cycle.p[1];
        n[what + " omega"] = omega;
        if (!is_sliding(s.kind))
            return;
        const double phase = std::fmod(omega * s.cycle.t[s.node], 2 * std::numbers::pi);
        n[what + " phase"] = phase;
        n[what + " y"] = -4.0 * s.side + A * std::cos(phase);
    };
    const auto branch = [&](double A, double omega, double low, double high) {
        const Orbit orbit = settle(system, params(A, omega), Vector::Zero(2));
        return BranchTracer(system, 1, low, high).trace(orbit.cycle);
    };

    for (const auto& [A, omega, low, high] :
         {std::array{0.5, 2.94, 2.84, 2.98}, {5.0, 1.6, 1.5, 3.2}, {3.6, 1.067, 1.0, 1.11325}}) {
        int folds = 0;
        for (const SpecialPoint& s : branch(A, omega, low, high).special)
            if (s.kind == Kind::fold)
                note("4.13 fold " + std::to_string(++folds) + " at A = 3.6", s, A);
            else if (A != 3.6)
                note("4.6 " + std::string(name(s.kind)), s, A);
    }
    for (const Box& box :
         {Box{{1, 0}, {1.5, 4.0}, {3.2, 5.5}}, Box{{1, 0}, {0.9, 3.0}, {1.6, 4.4}}})
        for (const Curve& curve : bifurcation_set(system, system.defaults(), box).curves)
            for (const SpecialPoint& s : curve.special)
                if (!is_sliding(s.kind)) {
                    const std::string what = "4.7-8 " + std::string(name(s.kind));
                    n[what + " omega"] = s.cycle.p[1];
                    n[what + " A"] = s.cycle.p[0];
                }
    int k = 0;
    for (const auto& [y, v] : {std::pair{-0.685, 3.01}, {-0.2806, 1.0}, {-0.445, 1.27}}) {
        Vector x(2);
        x << y, v;
        const Orbit o = orbit_near(system, params(3.6, 1.067), 0, x, 1);
        const std::string what = std::string("4.16 orbit ") + "abc"[k++];
        n[what + " y(0)"] = o.x_start[0];
        n[what + " v(0)"] = o.x_start[1];
        n[what + " multiplier"] = o.multipliers[0].real();
    }
    return n;
}

int main() {
    const models::Oscillator block;
    const Numbers a = compute(*any_system(block, {1e-13, 1e-14}));
    const Numbers b = compute(*any_system<DormandPrince5>(block, {1e-12, 1e-13}));
    const Numbers c = compute(*any_system(block, {1e-12, 1e-13}));
    for (const auto& [what, value] : a) {
        const double spread = std::max(std::abs(b.at(what) - value), std::abs(c.at(what) - value));
        std::printf("%-40s %.11g  %s\n", what.c_str(), value,
                    spread <= 1e-10 * std::abs(value) ? "ok" : "routes differ");
    }
}
