// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"
#include "formulas.hpp"

#include <filippov/formulas/split.hpp>

#include <functional>
#include <vector>

using namespace filippov;

namespace {

/// Two components x and y and one parameter, of which `field` makes a right-hand side.
Definition plane(const std::function<std::vector<Expr>(Graph&, Expr x, Expr y, Expr p)>& field,
                 double p = 1) {
    Definition d;
    d.dim = 2;
    d.defaults = {p};
    split(d, field(d.graph, d.graph.state(0), d.graph.state(1), d.graph.param(0)));
    return d;
}
Expr sign(Graph& g, Expr e) { return g.unary(Op::sign, e); }

} // namespace

TEST_CASE("split: one surface is found from two places", "[formulas]") {
    Definition d = tests::oscillator_formulas();
    REQUIRE(d.surfaces() == 1);
    CHECK(d.kind[0] == SurfaceKind::switching);
    CHECK(d.h[0] == d.graph.sub(d.graph.state(1), d.graph.param(5)));
    CHECK(d.region.size() == 2);
    for (const auto& f : d.region)
        for (const Expr e : f)
            CHECK_FALSE(d.graph.switches(e));
    CHECK(d.region[0][0] == d.region[1][0]);
    CHECK(d.region[0][1] != d.region[1][1]);
}

TEST_CASE("split: multiples are one surface, whatever their sign", "[formulas]") {
    const auto d = plane([](Graph& g, Expr x, Expr y, Expr) {
        const Expr u = g.sub(x, g.constant(1));
        const Expr v = g.sub(g.constant(2), g.mul(g.constant(2), x)); // -2 u, in other words
        return std::vector{sign(g, u), g.add(y, sign(g, v))};
    });
    REQUIRE(d.surfaces() == 1);
    CHECK(d.graph.is_constant(d.region[1][0], 1));
    CHECK(d.graph.value(d.region[1][1], 0, std::vector{3.0, 0.5}, {}) == -0.5);
}

TEST_CASE("split: surfaces that are near each other by default are two", "[formulas]") {
    for (const double d : {1e-6, 1e-9, 1e-12, 1e-18, 1e-300}) {
        CAPTURE(d);
        const auto two = plane(
            [](Graph& g, Expr x, Expr y, Expr p) {
                const Expr u = g.sub(x, g.constant(1));
                return std::vector{g.add(sign(g, u), sign(g, g.sub(u, p))), y};
            },
            d);
        REQUIRE(two.surfaces() == 2);
        CHECK(two.kind == std::vector(2, SurfaceKind::switching));
        // between them, for another distance
        const std::vector<double> at{1.2, 0}, p{0.5};
        std::size_t code = 0;
        for (std::size_t j = 0; j < 2; ++j)
            code |= std::size_t(two.graph.value(two.h[j], 0, at, p) > 0) << j;
        CHECK(two.graph.value(two.region[code][0], 0, at, p) == 0);
        // a constant, next to zero
        CHECK(plane([d](Graph& g, Expr x, Expr y, Expr) {
                  return std::vector{g.add(sign(g, x), sign(g, g.sub(x, g.constant(d)))), y};
              }).surfaces() == 2);
    }
}

TEST_CASE("split: surfaces that differ, by less than rounding, are refused", "[formulas]") {
    const auto band = [](double from, double width) {
        return plane([&](Graph& g, Expr x, Expr y, Expr) {
            const Expr u = g.sub(x, g.constant(from));
            return std::vector{g.add(sign(g, u), sign(g, g.sub(u, g.constant(width)))), y};
        });
    };
    CHECK(band(1, 1e-12).surfaces() == 2);
    CHECK(band(0, 1e-18).surfaces() == 2);
    CHECK_THROWS_WITH(band(1, 1e-18), Catch::Matchers::ContainsSubstring("differ by 1e-18 alone"));
    // what was written in two ways is one: 0.1 + 0.2 is not 0.3
    CHECK(plane([](Graph& g, Expr x, Expr y, Expr) {
              const Expr a = g.sub(g.sub(x, g.constant(0.1)), g.constant(0.2));
              return std::vector{g.add(sign(g, a), sign(g, g.sub(x, g.constant(0.3)))), y};
          }).surfaces() == 1);
    CHECK(plane([](Graph& g, Expr x, Expr y, Expr) { // sin(2x) = 2 sin(x) cos(x)
              const Expr a = g.sub(g.unary(Op::sin, g.mul(g.constant(2), x)), g.constant(0.5));
              const Expr b =
                  g.sub(g.mul(g.constant(4), g.mul(g.unary(Op::sin, x), g.unary(Op::cos, x))),
                        g.constant(1));
              return std::vector{g.add(sign(g, a), sign(g, b)), y};
          })
              .surfaces() == 1);
}

TEST_CASE("split: a jump is one whatever the size of what is given", "[formulas]") {
    for (const double F : {0.0, 1e-300, 1e-18, 1e-9, 1.0, -1e-18})
        for (const double k : {1.0, 1e9}) {
            CAPTURE(F, k);
            const auto kind = [&](const auto& force) {
                Definition d;
                d.dim = 2;
                d.defaults = {F, k, 2};
                Graph& g = d.graph;
                const Expr p = g.param(0), kx = g.mul(g.param(1), g.state(0)), m = g.param(2);
                const std::vector field{g.state(1), force(g, p, kx, g.state(1), m)};
                split(d, field);
                return d.kind;
            };
            // -k x - F sign(v); the same over a mass; k x (1 + F sign(v)); k x + F |v|
            CHECK(kind([](Graph& g, Expr p, Expr kx, Expr v, Expr) {
                      return g.sub(g.neg(kx), g.mul(p, sign(g, v)));
                  }) == std::vector{SurfaceKind::switching});
            CHECK(kind([](Graph& g, Expr p, Expr kx, Expr v, Expr m) {
                      return g.div(g.sub(g.neg(kx), g.mul(p, sign(g, v))), m);
                  }) == std::vector{SurfaceKind::switching});
            CHECK(kind([](Graph& g, Expr p, Expr kx, Expr v, Expr) {
                      return g.mul(kx, g.add(g.constant(1), g.mul(p, sign(g, v))));
                  }) == std::vector{SurfaceKind::switching});
            CHECK(kind([](Graph& g, Expr p, Expr kx, Expr v, Expr) {
                      return g.add(kx, g.mul(p, g.abs(v)));
                  }) == std::vector{SurfaceKind::kink});
        }
}

TEST_CASE("split: what is proportional at positive times only is another surface", "[formulas]") {
    const Definition d = plane([](Graph& g, Expr, Expr y, Expr) {
        const Expr t = g.time(), size = g.unary(Op::sqrt, g.mul(t, t));
        return std::vector<Expr>{sign(g, t), g.add(y, sign(g, size))};
    });
    const std::array<double, 2> x{0, 0.5};
    const std::array<double, 1> p{1};
    for (const double t : {-2.0, 2.0}) {
        std::size_t code = 0;
        for (std::size_t j = 0; j < d.h.size(); ++j)
            code |= std::size_t(d.graph.value(d.h[j], t, x, p) > 0) << j;
        CHECK(d.graph.value(d.region[code][0], t, x, p) == t / 2);
        CHECK(d.graph.value(d.region[code][1], t, x, p) == 1.5);
    }
}

TEST_CASE("split: a factor of parameters turns the surface with its sign", "[formulas]") {
    const auto d = plane(
        [](Graph& g, Expr x, Expr, Expr p) {
            // p x - p is p times x - 1, which is not seen from its form
            const Expr u = g.sub(g.mul(p, x), p);
            return std::vector{sign(g, g.sub(x, g.constant(1))), sign(g, u)};
        },
        0.0);
    REQUIRE(d.surfaces() == 1);
    for (const double p : {2.0, -2.0})
        CHECK(d.graph.value(d.region[1][1], 0, std::vector{3.0, 0.0}, std::vector{p}) ==
              (p > 0 ? 1 : -1));
}

TEST_CASE("split: where only a derivative jumps is a kink", "[formulas]") {
    const auto kinds = [](const auto& field) { return plane(field).kind; };
    CHECK(kinds([](Graph& g, Expr x, Expr y, Expr) { return std::vector{g.abs(x), y}; }) ==
          std::vector{SurfaceKind::kink});
    // continuous although made of signs
    CHECK(kinds([](Graph& g, Expr x, Expr y, Expr) {
              return std::vector{g.mul(sign(g, x), g.mul(x, x)), y};
          }) == std::vector{SurfaceKind::kink});
    // the jump has the size of a parameter, also where that is zero by default
    const auto d =
        plane([](Graph& g, Expr x, Expr y,
                 Expr p) { return std::vector{g.add(g.abs(x), g.mul(p, sign(g, x))), y}; },
              0.0);
    CHECK(d.kind == std::vector{SurfaceKind::switching});
    // small forces are forces
    CHECK(kinds([](Graph& g, Expr x, Expr y, Expr) {
              return std::vector{g.mul(g.constant(1e-12), sign(g, x)), y};
          }) == std::vector{SurfaceKind::switching});
}

TEST_CASE("split: regions that cannot be do not make a kink a jump", "[formulas]") {
    const auto where = [](Graph& g, Expr h, Expr above, Expr below) {
        const Expr s = sign(g, h);
        return g.add(g.mul(g.constant(0.5), g.mul(g.add(g.constant(1), s), above)),
                     g.mul(g.constant(0.5), g.mul(g.sub(g.constant(1), s), below)));
    };
    // x between -p and p: what is "above p and below -p" at once is nowhere
    const auto clipped = [&](Graph& g, Expr x, Expr p) {
        return where(g, g.sub(x, p), p, where(g, g.add(x, p), x, g.neg(p)));
    };
    CHECK(plane([&](Graph& g, Expr x, Expr y, Expr p) {
              return std::vector{y, g.neg(clipped(g, x, p))};
          }).kind == std::vector{SurfaceKind::kink, SurfaceKind::kink});
    // ... a jump beside it is one
    const auto with_jump = plane([&](Graph& g, Expr x, Expr y, Expr p) {
        return std::vector{y, g.sub(clipped(g, x, p), sign(g, y))};
    });
    CHECK(std::ranges::count(with_jump.kind, SurfaceKind::kink) == 2);
    CHECK(std::ranges::count(with_jump.kind, SurfaceKind::switching) == 1);
    // ... and where it is only between two surfaces that are next to each other
    auto strip = plane([&](Graph& g, Expr x, Expr y, Expr) {
        const Expr inside =
            where(g, x, where(g, g.sub(x, g.constant(1e-6)), g.constant(0), y), g.constant(0));
        return std::vector{y, sign(g, inside)};
    });
    const auto y = std::ranges::find(strip.h, strip.graph.state(1));
    REQUIRE(y != strip.h.end());
    CHECK(strip.kind[std::size_t(y - strip.h.begin())] == SurfaceKind::switching);
}

TEST_CASE("split: a jump is one however far the sides' formulas are apart elsewhere",
          "[formulas]") {
    // friction that falls exponentially: beyond its side its formula grows by e^(a |v|)
    for (const double a : {0.1, 1.0, 2.0, 5.0, 50.0, 1e3, 1e6}) {
        CAPTURE(a);
        const auto friction = [a](Graph& g, Expr x, Expr v, Expr p, bool odd) {
            const Expr u = g.sub(v, p), s = sign(g, u);
            const Expr size = g.unary(Op::exp, g.mul(g.constant(-a), g.abs(u)));
            // (1 + e^(-a|u|)) sign(u) jumps, (1 - e^(-a|u|)) sign(u) does not
            const Expr law =
                g.mul(s, odd ? g.add(g.constant(1), size) : g.sub(g.constant(1), size));
            return std::vector{v, g.sub(g.neg(x), law)};
        };
        const auto kinds = [&](bool odd) {
            return plane(
                       [&](Graph& g, Expr x, Expr v, Expr p) { return friction(g, x, v, p, odd); },
                       0.3)
                .kind;
        };
        CHECK(kinds(true) == std::vector{SurfaceKind::switching});
        CHECK(kinds(false) == std::vector{SurfaceKind::kink});
    }
}

TEST_CASE("split: kinks of every order, and far from zero", "[formulas]") {
    const auto kinds = [](const auto& field) { return plane(field).kind; };
    const std::vector kink{SurfaceKind::kink};
    for (const double at : {0.0, 1.0, 1e4, 1e8}) {
        CAPTURE(at);
        CHECK(kinds([at](Graph& g, Expr x, Expr y, Expr) {
                  const Expr u = g.sub(x, g.constant(at));
                  return std::vector{g.abs(u), g.mul(y, y)};
              }) == kink);
        CHECK(kinds([at](Graph& g, Expr x, Expr y, Expr) { // |u| u^2 + y
                  const Expr u = g.sub(x, g.constant(at));
                  return std::vector{g.add(g.mul(g.abs(u), g.mul(u, u)), y), y};
              }) == kink);
        CHECK(kinds([at](Graph& g, Expr x, Expr y, Expr) { // x^2 below, its tangent above
                  const Expr a = g.constant(at), u = g.sub(x, a);
                  const Expr line = g.add(g.mul(a, a), g.mul(g.mul(g.constant(2), a), u));
                  return std::vector{g.where(g.step(u), line, g.mul(x, x)), y};
              }) == kink);
        CHECK(kinds([at](Graph& g, Expr x, Expr y, Expr) { // the same with a small step
                  const Expr a = g.constant(at), u = g.sub(x, a);
                  const Expr line = g.add(g.mul(a, a), g.mul(g.mul(g.constant(2), a), u));
                  const Expr up = g.add(line, g.constant(1e-9 * (1 + at * at)));
                  return std::vector{g.where(g.step(u), up, g.mul(x, x)), y};
              }) == std::vector{SurfaceKind::switching});
    }
}

namespace {

/// exp(-((u - at)/width)^2)
Expr pulse(Graph& g, Expr u, double at, double width) {
    const Expr z = g.div(g.sub(u, g.constant(at)), g.constant(width));
    return g.unary(Op::exp, g.neg(g.mul(z, z)));
}
Expr steep(Graph& g, Expr u, double at, double slope) {
    return g.unary(Op::tanh, g.mul(g.constant(slope), g.sub(u, g.constant(at))));
}

} // namespace

TEST_CASE("split: what is flat near the origin is not taken for what is flat there, too",
          "[formulas]") {
    const auto surfaces = [](const auto& u, const auto& v) {
        return plane([&](Graph& g, Expr x, Expr y, Expr) {
                   return std::vector{g.add(sign(g, u(g, x, y)), g.step(v(g, x, y))), y};
               })
            .surfaces();
    };
    const auto pulse_at = [](double at, double width, double level) {
        return [=](Graph& g, Expr, Expr) {
            return g.sub(pulse(g, g.time(), at, width), g.constant(level));
        };
    };
    CHECK(surfaces(pulse_at(50, 8, 0.1), pulse_at(120, 4, 0.2)) == 2);
    CHECK(surfaces(pulse_at(500, 50, 0.1), pulse_at(900, 20, 0.1)) == 2);
    CHECK(surfaces(pulse_at(40, 4, 0.1), pulse_at(40, 4, 0.3)) == 2);
    CHECK(surfaces(pulse_at(40, 4, 0.1), pulse_at(40, 4, 0.1)) == 1);
    const auto step_at = [](double at, double part) {
        return [=](Graph& g, Expr x, Expr y) {
            return g.add(g.sub(steep(g, x, at, 20), g.constant(0.5)), g.mul(g.constant(part), y));
        };
    };
    CHECK(surfaces(step_at(50, 0), step_at(90, 0)) == 2);
    CHECK(surfaces(step_at(50, 1e-3), step_at(90, 1e-3)) == 2);
    CHECK(surfaces(step_at(50, 1e-3), step_at(50, 1e-3)) == 1);
    // (2 + 2 y^2) h and h, and h in other words
    CHECK(surfaces(step_at(50, 0), [&](Graph& g, Expr x, Expr y) {
              return g.mul(g.constant(-3), step_at(50, 0)(g, x, y));
          }) == 1);
    const auto lorentz = [](double at) { // 1/(1 + (x - at)^2) - 1/2, no argument of a function
        return [=](Graph& g, Expr x, Expr) {
            const Expr u = g.sub(x, g.constant(at));
            const Expr sum = g.add(g.constant(1), g.mul(g.constant(1e6), g.mul(u, u)));
            return g.sub(g.div(g.constant(1), sum), g.constant(0.5));
        };
    };
    CHECK(surfaces(lorentz(300), lorentz(700)) == 2);
}

TEST_CASE("split: regions have the values that were written, far away as well", "[formulas]") {
    // each of one number u: the time, or a component
    const std::vector<std::function<Expr(Graph&, Expr)>> formulas{
        [](Graph& g, Expr u) { // sign(|tanh(u - 50)| - 1/2)
            return sign(g, g.sub(g.abs(steep(g, u, 50, 1)), g.constant(0.5)));
        },
        [](Graph& g, Expr u) { // sign(|tanh(u - 50) + 1/2| - 2.52): -1
            const Expr a = g.add(steep(g, u, 50, 1), g.constant(0.5));
            return sign(g, g.sub(g.abs(a), g.constant(2.52)));
        },
        [](Graph& g, Expr u) {
            const Expr a = g.sub(pulse(g, u, 170, 30), g.constant(0.56));
            return sign(g, g.sub(g.abs(a), g.constant(0.2)));
        },
        [](Graph& g, Expr u) { // min(pulse, 0.3) + max(tanh(u - 90), -1/2)
            const Expr a = pulse(g, u, 60, 8), b = steep(g, u, 90, 1);
            const Expr low = g.where(g.step(g.sub(g.constant(0.3), a)), a, g.constant(0.3));
            const Expr high = g.where(g.step(g.add(b, g.constant(0.5))), b, g.constant(-0.5));
            return g.add(low, high);
        },
        [](Graph& g, Expr u) { // sign(sin(pulse) - 1/4) sign(tanh - 0.9)
            const Expr a = g.unary(Op::sin, pulse(g, u, -300, 40));
            return g.mul(sign(g, g.sub(a, g.constant(0.25))),
                         sign(g, g.sub(steep(g, u, 200, 3), g.constant(0.9))));
        },
    };
    for (std::size_t k = 0; k < formulas.size(); ++k)
        for (const bool of_time : {true, false}) {
            CAPTURE(k, of_time);
            Expr written = -1;
            const Definition d = plane([&](Graph& g, Expr x, Expr y, Expr) {
                written = formulas[k](g, of_time ? g.time() : x);
                return std::vector{y, written};
            });
            for (double at = -400.3; at < 400; at += 0.7) {
                const double t = of_time ? at : 0;
                const std::vector x{of_time ? 0.0 : at, 0.5}, p{1.0};
                unsigned code = 0;
                for (int j = 0; j < d.surfaces(); ++j)
                    code |= unsigned(d.graph.value(d.h[std::size_t(j)], t, x, p) > 0) << j;
                REQUIRE(d.graph.value(d.region[code][1], t, x, p) ==
                        d.graph.value(written, t, x, p));
            }
        }
}

TEST_CASE("split: a jump is one, wherever it is not zero", "[formulas]") {
    const auto kind_of = [](const auto& field) {
        const auto d = plane(field);
        REQUIRE(d.surfaces() == 1);
        return d.kind[0];
    };
    for (const double at : {30.0, 100.0, -400.0, 3000.0}) {
        CAPTURE(at);
        // 1 - 50 pulse(t) sign(x - at - 1/2)
        CHECK(kind_of([at](Graph& g, Expr x, Expr y, Expr) {
                  const Expr s = sign(g, g.sub(x, g.constant(at + 0.5)));
                  const Expr size = g.mul(g.constant(50), pulse(g, g.time(), at, 1));
                  return std::vector{g.sub(g.constant(1), g.mul(size, s)), y};
              }) == SurfaceKind::switching);
        // a rough patch behind x = at
        CHECK(kind_of([at](Graph& g, Expr x, Expr v, Expr) {
                  const Expr rough = g.add(g.constant(1), steep(g, x, at, 1));
                  return std::vector{v, g.neg(g.mul(rough, sign(g, v)))};
              }) == SurfaceKind::switching);
        // the same of |v|, where nothing jumps
        CHECK(kind_of([at](Graph& g, Expr x, Expr v, Expr) {
                  const Expr rough = g.add(g.constant(1), steep(g, x, at, 1));
                  return std::vector{v, g.neg(g.mul(rough, g.abs(v)))};
              }) == SurfaceKind::kink);
        // a jump that is brought in by a parameter, and underflows as it is given
        Definition d;
        d.dim = 2;
        d.defaults = {200 + at * at};
        Graph& g = d.graph;
        const Expr size = g.unary(Op::exp, g.mul(g.constant(-10), g.param(0)));
        split(d, std::vector{g.state(1), g.mul(size, sign(g, g.state(1)))});
        CHECK(d.kind[0] == SurfaceKind::switching);
    }
}

TEST_CASE("split: a surface at which nothing changes is none", "[formulas]") {
    CHECK(plane([](Graph& g, Expr x, Expr y, Expr) {
              return std::vector{g.mul(sign(g, x), g.abs(x)), y};
          }).surfaces() == 0);
    Definition d;
    d.dim = 1;
    const Expr x = d.graph.state(0);
    const std::vector<Expr> field{sign(d.graph, x)};
    const std::vector<Expr> named{d.graph.sub(x, d.graph.constant(1))};
    CHECK_THROWS_AS(split(d, field, named), std::invalid_argument);
}

TEST_CASE("split: a switch inside another's argument splits that one", "[formulas]") {
    const auto d = plane([](Graph& g, Expr x, Expr y, Expr) {
        return std::vector{sign(g, g.sub(g.abs(x), g.constant(1))), y};
    });
    // x itself, 1 and -1
    REQUIRE(d.surfaces() == 3);
    const std::vector<double> places{-2, -0.5, 0.5, 2};
    for (const double at : places) {
        unsigned code = 0;
        for (int j = 0; j < 3; ++j)
            code |= unsigned(d.graph.value(d.h[std::size_t(j)], 0, std::vector{at, 0.0}, {}) > 0)
                    << j;
        CHECK(d.graph.value(d.region[code][0], 0, std::vector{at, 0.0}, {}) ==
              (std::abs(at) > 1 ? 1 : -1));
    }
}

TEST_CASE("split: what switches smoothly inside another's argument leaves it one surface",
          "[formulas]") {
    const auto surfaces = [](const std::function<Expr(Graph&, Expr v, Expr size)>& curve) {
        return plane([&](Graph& g, Expr x, Expr y, Expr) {
            const Expr u = g.add(x, curve(g, y, g.abs(y)));
            return std::vector{y, g.neg(sign(g, u))};
        });
    };
    const auto power = [](double a) {
        return [a](Graph& g, Expr v, Expr size) {
            return g.mul(g.pow(size, g.constant(a)), sign(g, v));
        };
    };
    CHECK(surfaces([](Graph& g, Expr v, Expr size) { return g.mul(v, size); }).surfaces() == 1);
    for (const double a : {1.5, 2.0, 3.0, 0.5, 1.0 / 3}) { // of roots neither side goes on beyond
        CAPTURE(a);
        const auto d = surfaces(power(a));
        REQUIRE(d.surfaces() == 1);
        CHECK(d.kind[0] == SurfaceKind::switching);
        CHECK(d.graph.value(d.h[0], 0, std::vector{0.5, -4.0}, {}) ==
              Approx(0.5 - std::pow(4, a)).epsilon(1e-14));
    }
    // corners and jumps are surfaces of their own
    CHECK(surfaces([](Graph&, Expr, Expr size) { return size; }).surfaces() == 3);
    CHECK(surfaces([](Graph& g, Expr v, Expr) { return sign(g, v); }).surfaces() == 3);
    // also if the field switches there anyway
    const auto two = plane([&](Graph& g, Expr x, Expr y, Expr) {
        const Expr u = g.add(x, power(1.5)(g, y, g.abs(y)));
        return std::vector{y, g.sub(g.neg(sign(g, u)), sign(g, y))};
    });
    CHECK(two.surfaces() == 2);
    for (const auto& f : two.region)
        CHECK_FALSE(two.graph.switches(f[1]));
}

TEST_CASE("split: more surfaces than can be told apart are refused", "[formulas]") {
    CHECK_THROWS_AS(plane([](Graph& g, Expr x, Expr y, Expr) {
                        Expr sum = y;
                        for (int k = 0; k <= most_split_surfaces; ++k)
                            sum = g.add(sum, sign(g, g.sub(x, g.constant(k))));
                        return std::vector{sum, y};
                    }),
                    std::invalid_argument);
}

TEST_CASE("split: a named surface keeps its form where the field knows it by another",
          "[formulas]") {
    using Make = std::function<Expr(Graph&, Expr x, Expr y)>;
    const std::vector<Make> forms{
        [](Graph& g, Expr x, Expr y) { return g.mul(y, g.unary(Op::exp, x)); },
        [](Graph& g, Expr x, Expr y) { return g.mul(y, g.add(g.constant(1), g.mul(x, x))); },
        [](Graph& g, Expr x, Expr y) { return g.div(y, g.add(g.constant(1), g.mul(x, x))); },
        [](Graph& g, Expr, Expr y) { return g.pow(y, g.constant(3)); },
        [](Graph& g, Expr, Expr y) { return g.neg(y); },
    };
    for (std::size_t k = 0; k < forms.size(); ++k) {
        CAPTURE(k);
        Definition d;
        d.dim = 2;
        Graph& g = d.graph;
        const Expr h = forms[k](g, g.state(0), g.state(1));
        const std::vector field{g.state(1), sign(g, h)};
        split(d, field, std::vector{h});
        REQUIRE(d.surfaces() == 1);
        CHECK(d.h[0] == h);
        CHECK(g.is_constant(d.region[0][1], -1));
        CHECK(g.is_constant(d.region[1][1], 1));
    }
}

TEST_CASE("split: a named surface keeps its factor of parameters, and turns with it",
          "[formulas]") {
    using Make = std::function<Expr(Graph&, Expr v, Expr c)>;
    const std::vector<Make> forms{
        [](Graph& g, Expr v, Expr c) { return g.mul(c, v); },
        [](Graph& g, Expr v, Expr c) { return g.div(v, c); },
        [](Graph& g, Expr v, Expr c) { return g.neg(g.mul(g.mul(c, v), c)); },
        [](Graph& g, Expr v, Expr c) { return g.mul(g.sub(c, g.constant(1)), g.mul(c, v)); },
    };
    for (std::size_t k = 0; k < forms.size(); ++k)
        for (const bool by_name : {false, true}) {
            CAPTURE(k, by_name);
            Definition d;
            d.dim = 2;
            d.defaults = {2};
            Graph& g = d.graph;
            const Expr v = g.sub(g.state(1), g.constant(1)), h = forms[k](g, v, g.param(0));
            // 7 above h and 5 below it; or where v is positive and negative
            const Expr s = g.step(by_name ? h : v);
            split(d, std::vector{g.state(1), g.where(s, g.constant(7), g.constant(5))},
                  std::vector{h});
            REQUIRE(d.surfaces() == 1);
            CHECK(d.h[0] == h);
            if (by_name) {
                CHECK(g.is_constant(d.region[0][1], 5));
                CHECK(g.is_constant(d.region[1][1], 7));
            }
            for (const double c : {2.0, -2.0, 0.5})
                for (const double at : {0.5, 1.5}) {
                    const std::vector<double> x{0, at}, p{c};
                    const bool above = g.value(h, 0, x, p) > 0;
                    CHECK(g.value(d.region[above][1], 0, x, p) ==
                          ((by_name ? above : at > 1) ? 7 : 5));
                }
        }
}

TEST_CASE("split: a named surface that is a cube root stands for what is in it", "[formulas]") {
    Definition d;
    d.dim = 2;
    Graph& g = d.graph;
    const Expr u = g.sub(g.state(1), g.constant(1));
    const Expr root = g.mul(sign(g, u), g.pow(g.abs(u), g.constant(1.0 / 3)));
    const std::vector field{g.state(1), sign(g, root)};
    split(d, field, std::vector{g.neg(root)});
    REQUIRE(d.surfaces() == 1);
    CHECK(d.h[0] == g.neg(u));
    CHECK(g.is_constant(d.region[0][1], 1));
    CHECK(g.is_constant(d.region[1][1], -1));
}

TEST_CASE("split: a named surface that is several, or none, is refused for that", "[formulas]") {
    const auto named = [](const auto& make) {
        Definition d;
        d.dim = 2;
        Graph& g = d.graph;
        const Expr h = make(g, g.state(0), g.state(1));
        const std::vector field{g.state(1), sign(g, h)};
        split(d, field, std::vector{h});
    };
    using Catch::Matchers::ContainsSubstring;
    CHECK_THROWS_WITH(named([](Graph& g, Expr x, Expr y) { return g.mul(x, y); }),
                      ContainsSubstring("consists of several"));
    CHECK_THROWS_WITH(
        named([](Graph& g, Expr x, Expr) { return g.sub(g.abs(x), g.constant(0.5)); }),
        ContainsSubstring("consists of several"));
    CHECK_THROWS_WITH(named([](Graph& g, Expr x, Expr) { return g.unary(Op::exp, x); }),
                      ContainsSubstring("never changes"));
    Definition twice;
    twice.dim = 2;
    Graph& g = twice.graph;
    const Expr y = g.state(1), two_y = g.mul(g.constant(2), y);
    const std::vector field{g.state(0), sign(g, y)};
    CHECK_THROWS_WITH(split(twice, field, std::vector{y, two_y}),
                      ContainsSubstring("surface 1 is surface 0 again"));
}

TEST_CASE("split: h has the sign of the argument that was written first", "[formulas]") {
    using Write = std::function<Expr(Graph&, Expr u, Expr p)>; // c u, with c of any kind
    const std::vector<Write> factors{
        [](Graph&, Expr u, Expr) { return u; },
        [](Graph& g, Expr u, Expr) { return g.neg(u); },
        [](Graph& g, Expr u, Expr) { return g.mul(g.constant(-2), u); },
        [](Graph& g, Expr u, Expr) { return g.div(u, g.constant(-3)); },
        [](Graph& g, Expr u, Expr) { return g.mul(g.constant(-2), g.pow(u, g.constant(3))); },
        [](Graph& g, Expr u, Expr p) { return g.mul(p, u); },
        [](Graph& g, Expr u, Expr p) { return g.neg(g.div(u, p)); },
        [](Graph& g, Expr u, Expr p) { return g.mul(g.sub(p, g.constant(9)), u); },
        [](Graph& g, Expr u, Expr) {
            const Expr wave = g.unary(Op::sin, g.mul(g.constant(5), g.state(0)));
            return g.mul(g.sub(g.constant(-2), wave), u);
        }};
    const std::vector<Write> surfaces{
        [](Graph& g, Expr u, Expr) { return g.sub(u, g.constant(1)); },
        [](Graph&, Expr u, Expr) { return u; },
        [](Graph& g, Expr u, Expr) { return g.add(u, g.state(0)); },
        [](Graph& g, Expr u, Expr) { return g.sub(g.mul(u, u), g.unary(Op::cos, g.time())); }};
    const std::vector<Write> switches{
        [](Graph& g, Expr u, Expr) { return g.unary(Op::sign, u); },
        [](Graph& g, Expr u, Expr) { return g.abs(u); },
        [](Graph& g, Expr u, Expr) { return g.where(g.step(u), g.constant(3), g.state(0)); }};
    for (const Write& surface : surfaces)
        for (const Write& first : factors)
            for (const Write& second : factors)
                for (const Write& by : switches) {
                    Expr written = -1, other = -1, field = -1;
                    Definition d = plane([&](Graph& g, Expr x, Expr y, Expr p) {
                        written = first(g, surface(g, y, p), p);
                        field = by(g, written, p);
                        other = g.unary(Op::sign, second(g, surface(g, y, p), p));
                        return std::vector{field, g.add(x, other)};
                    });
                    REQUIRE(d.surfaces() == 1);
                    for (const double p : {1.0, -1.0, 0.0})
                        for (const double y : {-3.7, 0.2, 2.9}) {
                            const std::vector<double> at{0.4, y}, params{p};
                            const auto value = [&](Expr e) {
                                return d.graph.value(e, 0.3, at, params);
                            };
                            CAPTURE(p, y, value(written), value(d.h[0]));
                            CHECK(value(written) * value(d.h[0]) >= 0);
                            CHECK(value(d.h[0]) != 0);
                            const auto& f = d.region[value(d.h[0]) > 0 ? 1 : 0];
                            if (std::isfinite(value(written))) {
                                CHECK(value(f[0]) == value(field));
                            }
                            if (std::isfinite(value(other))) {
                                CHECK(value(f[1]) == 0.4 + value(other));
                            }
                        }
                }
}

TEST_CASE("split: each of several factors is a surface with its own sign", "[formulas]") {
    const auto d = plane([](Graph& g, Expr x, Expr y, Expr p) {
        const Expr u = g.sub(g.constant(1), x), v = g.sub(y, p);
        return std::vector{sign(g, g.mul(g.constant(-2), g.mul(u, v))), y};
    });
    REQUIRE(d.surfaces() == 2);
    for (const double x : {0.0, 2.0})
        for (const double y : {0.0, 2.0}) {
            const std::vector<double> at{x, y}, p{1};
            const double h0 = d.graph.value(d.h[0], 0, at, p), h1 = d.graph.value(d.h[1], 0, at, p);
            CHECK(h0 == y - 1);
            CHECK(h1 == 1 - x);
            CHECK(d.graph.value(d.region[(h0 > 0) + 2 * (h1 > 0)][0], 0, at, p) ==
                  (h0 * h1 > 0 ? -1 : 1));
        }
}

TEST_CASE("split: a factor without a zero is no surface", "[formulas]") {
    auto d = plane([](Graph& g, Expr x, Expr y, Expr) {
        const Expr two = g.constant(2);
        const Expr wave = g.add(two, g.unary(Op::sin, g.mul(g.constant(5), x)));
        const Expr never = g.add(two, g.unary(Op::sin, g.time()));
        const Expr root = g.mul(sign(g, never), g.pow(g.abs(never), g.constant(1.0 / 3)));
        return std::vector{sign(g, g.mul(wave, g.sub(y, x))), root};
    });
    REQUIRE(d.surfaces() == 1);
    CHECK(d.h[0] == d.graph.sub(d.graph.state(1), d.graph.state(0)));
    CHECK(d.kind[0] == SurfaceKind::switching);
}
