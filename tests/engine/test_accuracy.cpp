// SPDX-License-Identifier: BSD-3-Clause
// The home problem: 200 periods of the dry friction oscillator against a reference in quadruple
// precision.
#include "../bench/rivals/reference_oscillator.hpp"
#include "run.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/oscillator.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

using namespace filippov;

namespace {

struct Home {
    double error; ///< of the final state, maximum norm
    std::size_t events;
    Status status;
};

/// A free flight, a parabola, which passes a circle.
struct Flight {
    static constexpr int dim = 4;
    template <class S> using X = Vec<S, 4>;
    template <class S> using P = Vec<S, 0>;

    template <class S> X<S> f1(const S&, const X<S>& x, const P<S>&) const {
        return X<S>(x[2], x[3], S(0), S(-0.25));
    }
    template <class S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return f1(t, x, p);
    }
    template <class S> S h(const S&, const X<S>& x, const P<S>&) const {
        return S(2) - x[0] * x[0] - x[1] * x[1];
    }
};

/// Two decays, the second of which drives the first.
struct Decay {
    static constexpr int dim = 2;
    template <class S> using X = Vec<S, 2>;
    template <class S> using P = Vec<S, 0>;
    double a, b, c;

    template <class S> X<S> f1(const S&, const X<S>& x, const P<S>&) const {
        return X<S>(S(-a) * x[0] + S(c) * x[1], S(-b) * x[1]);
    }
    template <class S> X<S> f2(const S& t, const X<S>& x, const P<S>& p) const {
        return f1(t, x, p);
    }
    template <class S> S h(const S&, const X<S>& x, const P<S>&) const { return x[0] + S(100); }
};

template <class Tableau> Home home(double tol) {
    const auto& reference = rivals::reference_home;
    auto p = default_params<models::Oscillator>();
    p[0] = reference.A;
    p[1] = reference.omega;
    const double t_end = reference.n_periods * (2 * std::numbers::pi / reference.omega);
    const auto r =
        run<Tableau>(models::Oscillator{}, p, Vec<double, 2>(0, 0), 0, t_end, tolerance<2>(tol));
    const Vec<long double, 2> error =
        r.result.x.template cast<long double>() - Vec<long double, 2>(reference.y, reference.v);
    return {static_cast<double>(error.cwiseAbs().maxCoeff()), r.events.size(), r.result.status};
}

/// Final-state errors that hand-written loops reach at 1e-6, 1e-9, 1e-12, with pairs of the same
/// orders.
template <class Tableau> constexpr std::array<double, 3> by_hand() {
    if (Tableau::order == 5)
        return {1.6e-5, 7.9e-9, 5.4e-12};
    return {7.5e-7, 7.7e-10, 7.6e-13};
}

} // namespace

TEMPLATE_TEST_CASE("accuracy: 200 periods end within twice the error of loops written by hand",
                   "[accuracy]", DormandPrince5, DormandPrince8) {
    const double tolerances[] = {1e-6, 1e-9, 1e-12};
    for (std::size_t i = 0; i < 3; ++i) {
        const Home h = home<TestType>(tolerances[i]);
        CAPTURE(tolerances[i], h.error / by_hand<TestType>()[i]);
        CHECK(h.status == Status::ok);
        CHECK(h.events == 102); // 100 and the two ends
        CHECK(h.error <= 2 * by_hand<TestType>()[i]);
    }
}

TEMPLATE_TEST_CASE("accuracy: the error follows the tolerance, with a slope of one", "[accuracy]",
                   DormandPrince5, DormandPrince8) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    std::string table;
    for (int k = 8; k <= 24; ++k) {
        const double tol = std::pow(10.0, -k / 2.0);
        const Home h = home<TestType>(tol);
        REQUIRE(h.status == Status::ok);
        REQUIRE(h.events == 102);
        const double x = std::log(tol), y = std::log(h.error);
        n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
        char line[60];
        std::snprintf(line, sizeof line, "%.1e: %.2e\n", tol, h.error);
        table += line;
    }
    const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    INFO(table << "slope " << slope);
    CHECK(slope >= 0.85);
    CHECK(slope <= 1.15);
}

TEST_CASE("accuracy: a root that only the interpolant sees costs a few trial steps", "[accuracy]") {
    auto p = default_params<models::Oscillator>();
    p[0] = 0.5;
    p[1] = 2.94;
    const models::Oscillator sys;
    // at this tolerance the interpolant dips below the surface where no step does, every period
    const auto r = run<DormandPrince5>(sys, p, Vec<double, 2>(0, 0), 0, 200 * sys.period(p),
                                       tolerance<2>(1e-3));
    REQUIRE(r.result.status == Status::ok);
    const auto& counters = r.result.counters;
    CHECK(counters.interpolants > 80); // 50 slips land
    CHECK(counters.landings < 8 * counters.interpolants);
}

TEMPLATE_TEST_CASE("accuracy: dense output is exact within steps that end on an event, too",
                   "[accuracy]", DormandPrince5, DormandPrince8, Rodas5P) {
    // (the end of such a step is reached by a Taylor step: exact here, however long)
    std::size_t crossings = 0;
    for (int i = 0; i < 40; ++i) {
        const Vec<double, 4> x0(0.1 * (i % 5), 0.05 * (i % 7), 0.5 * std::cos(i),
                                0.5 * std::sin(i));
        const auto r = simulate<TestType>(Flight{}, {}, x0, 0, 8, tolerance<4>(1e-12));
        REQUIRE(r.result.status == Status::ok);
        for (const auto& event : r.events)
            crossings += event.kind == EventKind::cross;
        double off = 0;
        for (int k = 0; k <= 1000; ++k) {
            const double t = 8e-3 * k;
            const auto x = r(t);
            off = std::max({off, std::abs(x[0] - x0[0] - x0[2] * t),
                            std::abs(x[1] - x0[1] - (x0[3] - 0.125 * t) * t)});
        }
        CAPTURE(i);
        CHECK(off < 1e-11);
    }
    CHECK(crossings >= 40);
}

TEMPLATE_TEST_CASE("accuracy: dense output keeps the tolerance where stability bounds the steps",
                   "[accuracy]", DormandPrince5, DormandPrince8, Rodas5P) {
    const double tol = GENERATE(1e-3, 1e-6, 1e-9);
    for (int i = 0; i < 60; ++i) {
        const Decay sys{0.4 + 0.11 * i, 0.4 + 0.07 * ((7 * i) % 60) + 1e-3, std::cos(3 * i)};
        const Vec<double, 2> x0(2 * std::sin(i), 2 * std::cos(5 * i));
        const auto r = simulate<TestType>(sys, {}, x0, 0, 30, tolerance<2>(tol));
        REQUIRE(r.result.status == Status::ok);
        const double k = sys.c * x0[1] / (sys.a - sys.b);
        double off = 0;
        for (int j = 0; j <= 2000; ++j) {
            const double t = 0.015 * j;
            const double x = (x0[0] - k) * std::exp(-sys.a * t) + k * std::exp(-sys.b * t);
            off = std::max(off, std::abs(r(std::min(t, r.t.back()))[0] - x) / (1 + std::abs(x)));
        }
        CAPTURE(i, sys.a, sys.b, sys.c);
        CHECK(off < 6 * tol);
    }
}
