// SPDX-License-Identifier: BSD-3-Clause
#include "catch.hpp"
#include "formulas.hpp"

#include <filippov/continuation/branch.hpp>
#include <filippov/core/lanes.hpp>
#include <filippov/engine/trajectory.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/orbit.hpp>

#include <cmath>
#include <memory>
#include <vector>

using namespace filippov;

namespace {

/// f = (x0 sin(p0 t) x1, exp(x1) + p1 x0^2), in any scalar
template <class S> std::array<S, 2> truth(const S& t, const S* x, const S* p) {
    using std::exp, std::sin;
    return {x[0] * sin(p[0] * t) * x[1], exp(x[1]) + p[1] * x[0] * x[0]};
}

std::shared_ptr<External> example() {
    auto f = std::make_shared<External>();
    f->name = "f";
    f->dim = f->params = f->outputs = 2;
    f->scale.assign(5, 1.0);
    f->value = [](double t, const double* x, const double* p, double* out) {
        const auto value = truth(t, x, p);
        std::copy(value.begin(), value.end(), out);
    };
    return f;
}
std::shared_ptr<External> with_jacobian() {
    auto f = example();
    auto j = std::make_shared<External>(*f);
    j->outputs = 4;
    j->value = [](double t, const double* x, const double* p, double* out) {
        out[0] = std::sin(p[0] * t) * x[1];
        out[1] = x[0] * std::sin(p[0] * t);
        out[2] = 2 * p[1] * x[0];
        out[3] = std::exp(x[1]);
    };
    f->jacobian = j;
    return f;
}

/// Both outputs of f, and of what it should be, at a point that moves with a scalar.
template <class S> struct Both {
    std::array<S, 2> got, wanted;
};
template <class S>
Both<S> at(const External& f, const S& t, const S& x0, const S& x1, const S& p0) {
    const std::array<S, 2> x{x0, x1}, p{p0, S(0.7)};
    Both<S> both;
    evaluate(f, t, x.data(), p.data(), both.got.data());
    both.wanted = truth(t, x.data(), p.data());
    return both;
}

} // namespace

TEST_CASE("External: derivatives of a function that is known by its values", "[formulas]") {
    for (const auto& f : {example(), with_jacobian()}) {
        CAPTURE(f->jacobian != nullptr);
        using D = Dual<double, 3>;
        const auto first = at<D>(*f, D::variable(0.3, 0), D::variable(1.5, 1), D::variable(-0.4, 1),
                                 D::variable(2.0, 2));
        for (std::size_t i = 0; i < 2; ++i) {
            CHECK(first.got[i].v == first.wanted[i].v);
            for (std::size_t k = 0; k < 3; ++k)
                CHECK(first.got[i].d[k] == Approx(first.wanted[i].d[k]).margin(5e-12));
        }
        using DD = Dual<Dual<double, 1>, 1>;
        const auto twice = [](double value) {
            DD x(Dual<double, 1>::variable(value, 0));
            x.d[0] = Dual<double, 1>(1.0);
            return x;
        };
        const auto second = at<DD>(*f, twice(0.3), twice(1.5), twice(-0.4), DD(2.0));
        for (std::size_t i = 0; i < 2; ++i)
            CHECK(second.got[i].d[0].d[0] ==
                  Approx(second.wanted[i].d[0].d[0]).margin(f->jacobian ? 5e-9 : 5e-9));
        using T = Taylor<double, 3>;
        T x0(1.5), x1(-0.4);
        x0.c = {1.5, 0.3, -0.2, 0.1};
        x1.c = {-0.4, -1.0, 0.4, 0.0};
        const auto third = at<T>(*f, T::variable(0.3), x0, x1, T(2.0));
        constexpr std::array margin{0.0, 5e-11, 5e-8, 5e-5};
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t k = 0; k <= 3; ++k)
                CHECK(third.got[i].c[k] == Approx(third.wanted[i].c[k]).margin(margin[k]));
    }
}

TEST_CASE("External: constants, lanes and what is not finite", "[formulas]") {
    const auto f = example();
    using D = Dual<double, 1>;
    const auto still = at<D>(*f, D(0.3), D(1.5), D(-0.4), D(2.0));
    CHECK(still.got[0].d[0] == 0);
    using L = Lanes<4>;
    L x0(1.0);
    x0.set(2, -3.0);
    const auto lanes = at<L>(*f, L(0.3), x0, L(-0.4), L(2.0));
    for (int l = 0; l < 4; ++l)
        CHECK(lanes.got[1][l] == Approx(lanes.wanted[1][l]).epsilon(1e-15));
    D nan = D::variable(std::nan(""), 0);
    const auto lost = at<D>(*f, D(0.3), nan, D(-0.4), D(2.0));
    CHECK(std::isnan(lost.got[0].v));
    CHECK(std::isnan(lost.got[0].d[0]));
}

TEST_CASE("External: in formulas, an output at a time, called once", "[formulas]") {
    int calls = 0;
    auto f = example();
    f->value = [&calls, inner = f->value](double t, const double* x, const double* p, double* out) {
        ++calls;
        inner(t, x, p, out);
    };
    Graph g;
    const int k = g.add_function(f);
    const Expr a = g.call(k, 0), b = g.call(k, 1);
    const Expr e = g.add(g.mul(a, b), g.unary(Op::sin, b));
    CHECK(g.varies(e));
    CHECK_FALSE(g.switches(e));
    CHECK_THROWS_AS(g.call(k, 2), std::invalid_argument);
    const std::vector x{1.5, -0.4}, p{2.0, 0.7};
    const auto [fa, fb] = truth(0.3, x.data(), p.data());
    CHECK(g.value(e, 0.3, x, p) == Approx(fa * fb + std::sin(fb)).epsilon(1e-14));
    calls = 0;
    double out[2];
    const Tape tape = write_tape(g, std::vector{e, b});
    tape.run(0.3, x.data(), p.data(), out);
    CHECK(calls == 1);
    CHECK(out[0] == Approx(fa * fb + std::sin(fb)).epsilon(1e-14));
    CHECK(out[1] == fb);
    // its derivative by a leaf is another function, the same one each time
    const Expr slope = g.derivative(e, g.state(0));
    CHECK(slope == g.derivative(e, g.state(0)));
    const double h = 1e-6;
    const double difference = (g.value(e, 0.3, std::vector{1.5 + h, -0.4}, p) -
                               g.value(e, 0.3, std::vector{1.5 - h, -0.4}, p)) /
                              (2 * h);
    CHECK(g.value(slope, 0.3, x, p) == Approx(difference).epsilon(1e-8));
}

namespace {

/// The same system, its sides known by their values.
Definition by_values(Definition formulas) {
    const TapeProgram inside(formulas, 32);
    const auto known = std::make_shared<TapeProgram>(inside);
    Definition d;
    d.dim = 2;
    d.state_names = formulas.state_names;
    d.param_names = formulas.param_names;
    d.defaults = formulas.defaults;
    const auto side = [&](std::size_t code) {
        auto f = std::make_shared<External>();
        f->name = "side";
        f->dim = f->outputs = 2;
        f->params = int(d.defaults.size());
        f->scale.assign(std::size_t(f->inputs()), 1.0);
        f->value = [known, code](double t, const double* x, const double* p, double* out) {
            std::array<double, 32> all{};
            std::copy_n(p, known->given(), all.begin());
            std::array<double, 2> zero{};
            known->derived.run(t, zero.data(), all.data(), all.data() + known->given());
            known->region[code].run(t, x, all.data(), out);
        };
        return d.graph.add_function(f);
    };
    const int below = side(0), above = side(1);
    const Expr h = d.graph.sub(d.graph.state(1), d.graph.param(5));
    const Expr on = d.graph.step(h);
    d.period = d.graph.div(d.graph.constant(6.283185307179586476925), d.graph.param(1));
    split(d,
          std::vector{d.graph.where(on, d.graph.call(above, 0), d.graph.call(below, 0)),
                      d.graph.where(on, d.graph.call(above, 1), d.graph.call(below, 1))},
          std::vector{h});
    return d;
}

Branch branch_of(const AnySystem& system, const Vector& p) {
    return BranchTracer(system, 1, 2.9, 2.94).trace(settle(system, p, Vector::Zero(2)).cycle);
}

} // namespace

TEST_CASE("External: the oscillator's sides as functions", "[formulas]") {
    const Definition formulas = tests::oscillator_formulas(), d = by_values(formulas);
    REQUIRE(d.surfaces() == 1);
    CHECK(d.kind[0] == SurfaceKind::switching);
    const auto sys = tests::tape_system<2>(d), wanted = tests::tape_system<2>(formulas);
    const auto p = all_params<double>(sys, d.defaults), q = all_params<double>(wanted, d.defaults);
    const Vec<double, 2> x0(0.5, 1.2);
    const Settings<double, 2> settings;
    const auto got = simulate(sys, p, x0, 0.0, 40.0, settings);
    const auto reference = simulate(wanted, q, x0, 0.0, 40.0, settings);
    REQUIRE(got.result.status == Status::ok);
    REQUIRE(got.events.size() == reference.events.size());
    REQUIRE(got.events.size() > 10);
    for (std::size_t i = 0; i < got.events.size(); ++i)
        CHECK(got.events[i].t == Approx(reference.events[i].t).margin(1e-10));
}

TEST_CASE("External: an orbit and its multipliers, as tight as of formulas", "[formulas]") {
    const auto mine = any_system(tests::tape_system<2>(by_values(tests::oscillator_formulas())));
    const auto model = any_system(models::Oscillator{});
    Vector p = model->defaults();
    p[0] = 0.5;
    p[1] = 2.92;
    const Vector start = Vector::Zero(2);
    const Orbit a = settle(*mine, p, start), b = settle(*model, p, start);
    INFO(a.message);
    REQUIRE(a.status == Status::ok);
    CHECK(a.cycle.word.string() == b.cycle.word.string());
    CHECK(a.cycle.period == b.cycle.period);
    CHECK((a.x_start - b.x_start).norm() < 1e-11);
    CHECK(std::abs(a.multipliers[0] - b.multipliers[0]) < 1e-9);
    CHECK(mine->counters().steps < 10 * model->counters().steps);
}

TEST_CASE("External: a branch goes on where a slip is born", "[formulas]") {
    // with the length zero, which every word has there, divided out as for formulas
    const auto mine = any_system(tests::tape_system<2>(by_values(tests::oscillator_formulas())));
    const auto model = any_system(models::Oscillator{});
    for (const double omega : {2.915, 2.92}) {
        CAPTURE(omega);
        Vector p = model->defaults();
        p[0] = 0.5;
        p[1] = omega;
        const Branch a = branch_of(*mine, p), b = branch_of(*model, p);
        CHECK(a.end == b.end);
        CHECK(a.begin == b.begin);
        REQUIRE(a.special.size() == 1);
        REQUIRE(b.special.size() == 1);
        CHECK(a.special[0].kind == b.special[0].kind);
        CHECK(a.special[0].word_before == b.special[0].word_before);
        CHECK(a.special[0].word_after == b.special[0].word_after);
        CHECK(a.special[0].cycle.p[1] == Approx(b.special[0].cycle.p[1]).epsilon(1e-12));
    }
}

TEST_CASE("External: differences far from zero, and what is not written", "[formulas]") {
    auto f = std::make_shared<External>();
    f->name = "sin";
    f->dim = 1;
    f->outputs = 2;
    f->scale.assign(2, 1.0);
    f->value = [](double, const double* x, const double*, double* out) { out[0] = std::sin(x[0]); };
    using D = Dual<double, 1>;
    for (const double x : {0.0, 1e-9, 10.0, 1e3, 1e6}) {
        CAPTURE(x);
        const D at = D::variable(x, 0);
        std::array<D, 2> out;
        evaluate(*f, D(0.0), &at, &at, out.data());
        // the rounding of x, over a step of a thousandth
        CHECK(out[0].d[0] == Approx(std::cos(x)).margin(1e-12 + 1e-12 * x));
        CHECK(std::isnan(out[1].v));
        CHECK(std::isnan(out[1].d[0]));
    }
}

TEST_CASE("External: derivatives beside a wall are taken on the side where there is none",
          "[formulas]") {
    // exp(t x), and sin(x), which is there on both sides
    for (const double side : {-1.0, 1.0})
        for (const double wall : {0.0, 1e-8, 1e-3, 0.5}) {
            CAPTURE(side, wall);
            auto f = std::make_shared<External>();
            f->name = "walled";
            f->dim = 1;
            f->outputs = 2;
            f->scale.assign(2, 1.0);
            const double at = 0.4;
            f->value = [=](double t, const double* x, const double*, double* out) {
                out[0] = side * (x[0] - at) > wall ? std::nan("") : std::exp(t * x[0]);
                out[1] = std::sin(x[0]);
            };
            using D = Dual<double, 2>;
            const D x = D::variable(at, 0), t = D::variable(0.7, 1);
            std::array<D, 2> first;
            evaluate(*f, t, &x, &x, first.data());
            const D wanted = exp(t * x);
            for (std::size_t k = 0; k < 2; ++k)
                CHECK(first[0].d[k] == Approx(wanted.d[k]).margin(2e-11));
            CHECK(first[1].d[0] == Approx(std::cos(at)).margin(5e-12));

            using T = Taylor<double, 3>;
            const T y = T::variable(at), one(1.0);
            std::array<T, 2> third;
            evaluate(*f, one, &y, &y, third.data());
            const T series = exp(y);
            constexpr std::array margin{0.0, 2e-11, 2e-7, 1e-3};
            for (std::size_t k = 0; k <= 3; ++k)
                CHECK(third[0].c[k] == Approx(series.c[k]).margin(margin[k]));

            const auto slope = partial(f, 1);
            std::array<double, 2> out{};
            slope->value(0.7, &at, &at, out.data());
            CHECK(out[0] == Approx(wanted.d[0]).margin(2e-11));
        }
}
