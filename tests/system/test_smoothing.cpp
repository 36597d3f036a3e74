// SPDX-License-Identifier: BSD-3-Clause
// Smoothing, the rival method (4.30).
#include "run.hpp"

#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/orbits/diagram.hpp>
#include <filippov/system/smoothing.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace filippov;
using Catch::Matchers::WithinAbs;

namespace {

const auto p = default_params<models::Oscillator>();
const Vec<double, 2> origin(0, 0);

double periods(double n) { return n * models::Oscillator{}.period(p); }

Vec<double, 2> event_driven(double t_end) {
    const auto r =
        run<DormandPrince8>(models::Oscillator{}, p, origin, 0, t_end, tolerance<2>(1e-12));
    REQUIRE(r.result.status == Status::ok);
    return r.result.x;
}

} // namespace

TEST_CASE("smooth_sign: odd, rises to 1, of slope 1 or 2/pi at zero", "[smoothing]") {
    for (const SmoothLaw law : {SmoothLaw::arctan, SmoothLaw::tanh, SmoothLaw::saturation}) {
        double last = -2;
        for (double u = -50; u <= 50; u += 0.37) {
            const double s = smooth_sign(law, u);
            CHECK(s == -smooth_sign(law, -u));
            CHECK(s >= last);
            CHECK(std::abs(s) <= 1);
            last = s;
        }
        const double slope = smooth_sign(law, 1e-9) / 1e-9;
        CHECK_THAT(slope, WithinAbs(law == SmoothLaw::arctan ? 2 / std::numbers::pi : 1, 1e-9));
    }
    // what is missing from 1, far out
    CHECK_THAT(1 - smooth_sign(SmoothLaw::arctan, 1e3), WithinAbs(2e-3 / std::numbers::pi, 1e-9));
    CHECK(1 - smooth_sign(SmoothLaw::tanh, 10.0) < 1e-8);
    CHECK(smooth_sign(SmoothLaw::saturation, 1.0) == 1);
}

TEST_CASE("smoothed: the law of the oscillator is (4.30) with the true magnitude", "[smoothing]") {
    const models::Oscillator sys;
    const auto smooth = smoothed(sys, {.c1 = 50});
    for (const double v : {-1.0, 0.9, 0.999, 1.0, 1.02, 3.0}) {
        const Vec<double, 2> x(0.3, v);
        const double r = v - 1, mu = 0.3 / (1 + 1.42 * std::abs(r)) + 0.1 + 0.01 * r * r;
        const double pull = 0.5 * std::cos(2.94 * 0.7) - 0.3;
        const double friction = 2 / std::numbers::pi * std::atan(50 * r) * 10 * mu;
        CHECK_THAT(smooth.f(0.7, x, p)[1], WithinAbs(pull - friction, 1e-14));
    }
    CHECK(smooth.period(p) == sys.period(p));
}

TEST_CASE("smoothed: tends to the event-driven solution, the arctan like c1^(-2/3)",
          "[smoothing]") {
    // The layer is 1/c1 wide, and that is what tanh (but for a logarithm) and saturation cost. The
    // arctan nears 1 so slowly that a slide ends late: with |q| - 4 = rho t past the end,
    //   h' = rho t + 8/(pi c1 h),
    // whose scales are t ~ c1^(-1/3) and h ~ c1^(-2/3).
    const double t_end = periods(20);
    const Vec<double, 2> limit = event_driven(t_end);
    const auto law = GENERATE(SmoothLaw::arctan, SmoothLaw::tanh, SmoothLaw::saturation);
    const auto error = [&](double c1) {
        const auto smooth = smoothed(models::Oscillator{}, {.c1 = c1, .law = law});
        const auto r = run<Rodas5P>(smooth, p, origin, 0, t_end, tolerance<2>(1e-11));
        REQUIRE(r.result.status == Status::ok);
        return (r.result.x - limit).cwiseAbs().maxCoeff();
    };
    const double coarse = error(1e5), fine = error(1e8);
    const double slope = std::log10(fine / coarse) / 3;
    INFO("law " << int(law) << ": errors " << coarse << " and " << fine << ", slope " << slope);
    if (law == SmoothLaw::arctan) {
        CHECK(slope < -0.62);
        CHECK(slope > -0.70);
    } else {
        CHECK(slope < -0.9);
        CHECK(slope > -1.1);
    }
}

TEST_CASE("smoothed: at every tolerance the run is right or says that it is not", "[smoothing]") {
    // c1 = 1e8 is where several solvers report success and are off by their own size. The
    // first term is the model's error.
    const double t_end = periods(20);
    const Vec<double, 2> limit = event_driven(t_end);
    const auto law = GENERATE(SmoothLaw::arctan, SmoothLaw::tanh, SmoothLaw::saturation);
    for (const double c1 : {1e4, 1e6, 1e8, 1e10, 1e12, 1e15})
        for (const double tol : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
            auto settings = tolerance<2>(tol);
            settings.max_steps = 20'000;
            const auto smooth = smoothed(models::Oscillator{}, {.c1 = c1, .law = law});
            const auto r = run<Rodas5P>(smooth, p, origin, 0, t_end, settings);
            const double error = (r.result.x - limit).cwiseAbs().maxCoeff();
            INFO("law " << int(law) << ", c1 " << c1 << ", tolerance " << tol << ": "
                        << r.result.message() << " error " << error << ", "
                        << r.result.counters.steps << " steps");
            if (r.result.status == Status::ok)
                CHECK(error < (law == SmoothLaw::arctan ? 60 * std::pow(c1, -2.0 / 3) : 1e3 / c1) +
                                  3e3 * tol);
            else
                CHECK(c1 >= 1e10); // where rounding of v is a ten-thousandth of the layer and more
        }
}

TEST_CASE("smoothed: an explicit method needs a step for every width of the layer", "[smoothing]") {
    const auto r = run<DormandPrince8>(smoothed(models::Oscillator{}, {.c1 = 1e4}), p, origin, 0,
                                       periods(20), tolerance<2>(1e-8));
    REQUIRE(r.result.status == Status::ok);
    CHECK(r.result.counters.steps > 10'000);
    auto settings = tolerance<2>(1e-8);
    settings.max_steps = 10'000;
    const auto stopped =
        run<DormandPrince8>(smoothed(models::Oscillator{}), p, origin, 0, periods(20), settings);
    CHECK(stopped.result.status == Status::max_steps);
}

TEST_CASE("smoothed: P1 comes to rest, within what the layer lets it creep", "[smoothing]") {
    const auto smooth = smoothed(Blended<models::Coulomb>{}, {.c1 = 1e6});
    const auto r = run<Rodas5P>(smooth, default_params<models::Coulomb>(), Vec<double, 2>(3, 0), 0,
                                20, tolerance<2>(1e-9));
    REQUIRE(r.result.status == Status::ok);
    CHECK_THAT(r.result.x[0], WithinAbs(-0.2, 1e-4));
}

TEST_CASE("smoothed: the stick band tells stick from slip", "[smoothing]") {
    const auto exact =
        run<DormandPrince8>(models::Oscillator{}, p, origin, 0, periods(20), tolerance<2>(1e-12));
    const auto exits = exact.times(EventKind::exit_sliding);
    REQUIRE(exits.size() > 3);
    const auto smooth = smoothed(models::Oscillator{}, {.c1 = 1e8, .band = 1e-5});
    const auto r = run<Rodas5P>(smooth, p, origin, 0, periods(20), tolerance<2>(1e-10));
    REQUIRE(r.result.status == Status::ok);
    std::vector<double> leaves;
    for (const auto& e : r.events)
        if (e.kind == EventKind::cross && e.mode_after[e.surface] == 1) {
            leaves.push_back(e.t);
            // on the band, to rounding of v
            CHECK_THAT(std::abs(e.x_right[1] - 1), WithinAbs(1e-5, 1e-12));
        }
    REQUIRE(leaves.size() == exits.size());
    // The band is left later than the slide ends: |v - 1| = 1e-5 is reached after sqrt(2e-5/|q'|),
    // some 5e-3.
    for (std::size_t i = 0; i < exits.size(); ++i) {
        CHECK(leaves[i] > exits[i]);
        CHECK(leaves[i] < exits[i] + 0.02);
    }
}

TEST_CASE("smoothed: without a band nothing is watched, and no event is met", "[smoothing]") {
    const auto r =
        run<Rodas5P>(smoothed(models::Oscillator{}), p, origin, 0, periods(5), tolerance<2>(1e-8));
    CHECK(r.events.size() == 2);
    CHECK(r.result.counters.root_searches == 0);
}

TEST_CASE("smoothed: refuses what makes no sense", "[smoothing]") {
    const models::Oscillator sys;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double c1 : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
        CHECK_THROWS_AS(smoothed(sys, {.c1 = c1}), std::invalid_argument);
    for (const double band : {-1e-3, nan, std::numeric_limits<double>::infinity()})
        CHECK_THROWS_AS(smoothed(sys, {.band = band}), std::invalid_argument);
    CHECK_THROWS_WITH(smoothed(sys, {.c1 = 10, .law = SmoothLaw::saturation, .band = 0.5}),
                      Catch::Matchers::ContainsSubstring("band = 0.5") ||
                          Catch::Matchers::ContainsSubstring("expected 1/c1"));
    CHECK(smoothed(sys, {.c1 = 10, .law = SmoothLaw::saturation}).how.band == 0.1);
}
