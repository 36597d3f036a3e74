// SPDX-License-Identifier: BSD-3-Clause
// Formulas with smooth functions, or blend variables, in place of their switches.
#include "catch.hpp"

#include <filippov/engine/time_stepping.hpp>
#include <filippov/formulas/switch_formulas.hpp>
#include <filippov/formulas/tape_system.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/system/smoothing.hpp>

#include <cmath>
#include <vector>

using namespace filippov;
using Catch::Matchers::WithinAbs;

namespace {

/// The oscillator's law with constants as they are, and what it switches on.
struct Friction {
    Graph g;
    Expr u;
    std::vector<Expr> field;

    Friction() {
        const Expr y = g.state(0), v = g.state(1), one = g.constant(1);
        u = g.sub(v, one);
        const Expr r = g.abs(u);
        const Expr mu = g.add(g.div(g.constant(0.3), g.add(one, g.mul(g.constant(1.42), r))),
                              g.add(g.constant(0.1), g.mul(g.constant(0.01), g.mul(r, r))));
        const Expr pull =
            g.sub(g.mul(g.constant(0.5), g.unary(Op::cos, g.mul(g.constant(2.94), g.time()))), y);
        field = {v, g.sub(pull, g.mul(g.mul(g.constant(10), mu), g.unary(Op::sign, u)))};
    }
};

/// The law with a smooth switch, of which parameter 0 is the steepness, split.
Definition smooth_friction(const Friction& f, SmoothLaw law, double c1) {
    Definition d;
    d.graph = f.g;
    d.dim = 2;
    d.defaults = {c1};
    const SmoothFormulas smooth = smooth_formulas(d.graph, f.field, law, d.graph.param(0));
    split(d, smooth.field);
    return d;
}

const std::vector<Vec<double, 2>> states{{0.3, -1}, {0.3, 0.99}, {-2, 1}, {0, 1.001}, {1, 3}};

} // namespace

TEST_CASE("smooth_formulas: is (4.30) with the true magnitude, as Smoothed is",
          "[switch_formulas]") {
    const auto p = default_params<models::Oscillator>();
    const auto law = GENERATE(SmoothLaw::arctan, SmoothLaw::tanh, SmoothLaw::saturation);
    Friction f;
    const SmoothFormulas smooth = smooth_formulas(f.g, f.field, law, f.g.param(0));
    REQUIRE(smooth.argument == std::vector<Expr>{f.u});
    const auto compiled = smoothed(models::Oscillator{}, {.c1 = 40, .law = law});
    for (const auto& x : states)
        for (int i = 0; i < 2; ++i) {
            const double value = f.g.value(smooth.field[std::size_t(i)], 0.7,
                                           std::array{x[0], x[1]}, std::array{40.0});
            CHECK_THAT(value, WithinAbs(compiled.f(0.7, x, p)[i], 1e-13));
        }
}

TEST_CASE("smooth_formulas: the kink of |u| is no surface of the smoothed system",
          "[switch_formulas]") {
    Friction f;
    Definition d = smooth_friction(f, SmoothLaw::arctan, 40);
    CHECK(d.surfaces() == 0);
    watch(d, d.graph.sub(f.u, d.graph.constant(0.5)));
    CHECK(d.surfaces() == 1);
    CHECK(d.kind[0] == SurfaceKind::kink);
    REQUIRE(d.region.size() == 2);
    CHECK(d.region[0] == d.region[1]);
}

TEST_CASE("smooth_formulas: corners of saturation are kinks", "[switch_formulas]") {
    Friction f;
    Definition d = smooth_friction(f, SmoothLaw::saturation, 40);
    REQUIRE(d.surfaces() == 2);
    CHECK(d.kind[0] == SurfaceKind::kink);
    CHECK(d.kind[1] == SurfaceKind::kink);
}

TEST_CASE("largest_error: of tapes as of Smoothed", "[switch_formulas]") {
    Friction f;
    Definition d = smooth_friction(f, SmoothLaw::arctan, 1e6);
    d.layer.push_back(d.graph.mul(d.graph.param(0), f.u));
    const TapeSystem<2, 8, 16> sys(std::make_shared<const TapeProgram>(d, 16));
    REQUIRE(sys.limits_errors());
    const auto compiled = smoothed(models::Oscillator{}, {.c1 = 1e6});
    const auto p = default_params<models::Oscillator>();
    const auto q = all_params<double>(sys, std::array{1e6});
    for (const auto& a : states)
        for (const auto& b : states) {
            const auto ours = sys.largest_error(0.0, a, 0.1, b, q);
            const auto theirs = compiled.largest_error(0.0, a, 0.1, b, p);
            CHECK_THAT(ours[1] / theirs[1], WithinAbs(1, 1e-9));
            CHECK(ours[0] > 1e300);
        }
}

TEST_CASE("smooth_formulas: a magnitude is no switch", "[switch_formulas]") {
    Graph g;
    const Expr x = g.state(0), v = g.state(1), u = g.sub(v, g.constant(0.5));
    const std::vector<Expr> field{
        v, g.sub(g.neg(g.mul(x, g.abs(x))), g.mul(g.constant(0.4), g.unary(Op::sign, u)))};
    CHECK(smooth_formulas(g, field, SmoothLaw::arctan, g.param(0)).argument ==
          std::vector<Expr>{u});
    CHECK(smooth_formulas(g, std::array{v, g.mul(x, g.abs(x))}, SmoothLaw::tanh, g.param(0))
              .argument.empty());
}

TEST_CASE("blend_formulas: nested switches blend their regions", "[switch_formulas]") {
    // clip(5 x, -1, 1) has kinks alone; x' = -sign(x + sign(y)/2), y' = -sign(y - 3/10)/2 slides
    Graph g;
    const Expr x = g.state(0), y = g.state(1), half = g.constant(0.5);
    const std::vector<Expr> field{
        g.neg(g.unary(Op::sign, g.add(x, g.mul(half, g.unary(Op::sign, y))))),
        g.neg(g.mul(half, g.unary(Op::sign, g.sub(y, g.constant(0.3)))))};
    Definition d;
    d.graph = g;
    d.dim = 2;
    split(d, field);
    const std::vector<Expr> blend = blend_formulas(d, field, 0);
    // at s = +-1 they are the regions
    for (unsigned code = 0; code < d.region.size(); ++code) {
        std::vector<double> s;
        for (std::size_t j = 0; j < d.h.size(); ++j)
            s.push_back(code >> j & 1 ? 1 : -1);
        for (std::size_t i = 0; i < 2; ++i)
            CHECK(d.graph.value(blend[i], 0, std::array{0.1, 0.2}, s) ==
                  d.graph.value(d.region[code][i], 0, std::array{0.1, 0.2}, {}));
    }
}

TEST_CASE("blend_formulas: s is an argument, and |u| what it is", "[switch_formulas]") {
    const auto p = default_params<models::Oscillator>();
    Friction f;
    Definition d;
    d.graph = f.g;
    d.dim = 2;
    split(d, f.field);
    REQUIRE(d.surfaces() == 1);
    const std::vector<Expr> blend = blend_formulas(d, f.field, 0);
    for (const auto& x : states)
        for (const double s : {-1.0, -0.3, 0.0, 0.8, 1.0}) {
            const double value =
                d.graph.value(blend[1], 0.7, std::array{x[0], x[1]}, std::array{s});
            CHECK_THAT(value, WithinAbs(models::Oscillator{}.field(0.7, x, s, p)[1], 1e-13));
        }
}

TEST_CASE("blend_formulas: a choice is blended, and a reversed argument turns s around",
          "[switch_formulas]") {
    Graph g;
    const Expr x = g.state(0), one = g.constant(1);
    // where(1 - x > 0, 5, x) + sign(x - 1): two ways to write one surface
    const Expr reversed = g.sub(one, x);
    const Expr e =
        g.add(g.where(g.step(reversed), g.constant(5), x), g.unary(Op::sign, g.sub(x, one)));
    Definition d;
    d.graph = g;
    d.dim = 1;
    split(d, std::array{e});
    REQUIRE(d.surfaces() == 1);
    const Expr blend = blend_formulas(d, std::array{e}, 0)[0];
    const double side = d.graph.value(d.h[0], 0, std::array{0.0}, {}) > 0 ? 1 : -1; // where x < 1
    for (const double s : {-1.0, 0.5, 1.0}) {
        const double below = (1 + side * s) / 2; // share of the side x < 1
        CHECK_THAT(d.graph.value(blend, 0, std::array{3.0}, std::array{s}),
                   WithinAbs(below * 5 + (1 - below) * 3 - side * s, 1e-14));
    }
}
