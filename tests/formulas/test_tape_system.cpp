// SPDX-License-Identifier: BSD-3-Clause
// Systems of formulas are systems: the model of the same formulas is the oracle.
#include "catch.hpp"
#include "formulas.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/dormand_prince5.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/orbits/any_system.hpp>

#include <limits>
#include <numbers>
#include <vector>

using namespace filippov;
using V2 = Vec<double, 2>;

namespace {

template <int N> Settings<double, N> tight(double tol) {
    Settings<double, N> settings;
    settings.rtol = tol;
    settings.atol = AbsoluteTolerance<double, N>(tol);
    return settings;
}
/// The same run of both: events of the same kinds, at the same times to rounding.
template <class Tableau, int N, class A, class B>
void same_runs(const A& a, const B& b, const Vec<double, N>& x0, double t_end, double tol) {
    const auto mine = simulate<Tableau>(a, all_params<double>(a, default_values(a)), x0, 0.0, t_end,
                                        tight<N>(tol));
    const auto other = simulate<Tableau>(b, all_params<double>(b, default_values(b)), x0, 0.0,
                                         t_end, tight<N>(tol));
    REQUIRE(mine.result.status == Status::ok);
    REQUIRE(mine.events.size() == other.events.size());
    const int m = surface_count(a);
    for (std::size_t k = 0; k < mine.events.size(); ++k) {
        CAPTURE(k);
        const auto& e = mine.events[k];
        const auto& f = other.events[k];
        CHECK(e.kind == f.kind);
        CHECK(e.surface == f.surface);
        CHECK(std::abs(e.t - f.t) < 1e-12 * (1 + f.t));
        CHECK((e.x_right - f.x_right).norm() < 1e-11 * (1 + f.x_right.norm()));
        CHECK(e.mode_after.code(m) == f.mode_after.code(m));
    }
    CHECK(std::abs(mine.result.counters.steps - other.result.counters.steps) <=
          std::max(static_cast<long long>(mine.events.size()), other.result.counters.steps / 1000));
}

/// Two blocks on a belt, and said of them what their formulas show.
struct Chain : models::BeltChain<2> {
    static constexpr bool linear_h = true;
};

/// The same as formulas.
Definition chain_formulas() {
    Definition d;
    d.dim = 4;
    d.defaults = {Chain::defaults.begin(), Chain::defaults.end()};
    d.param_names = {Chain::params.begin(), Chain::params.end()};
    Graph& g = d.graph;
    const Expr V = g.param(0), c = g.param(1), gamma = g.param(2);
    std::vector<Expr> field, belts;
    for (int i = 0; i < 2; ++i) {
        const Expr y = g.state(2 * i), v = g.state(2 * i + 1), other = g.state(2 - 2 * i);
        const Expr h = g.sub(v, V);
        const Expr pull = g.sub(g.neg(y), g.mul(c, g.sub(y, other)));
        const Expr friction = g.div(g.param(3 + i), g.add(g.constant(1), g.mul(gamma, g.abs(h))));
        field.push_back(v);
        field.push_back(g.sub(pull, g.mul(g.unary(Op::sign, h), friction)));
        belts.push_back(h);
    }
    split(d, field, belts);
    return d;
}

} // namespace

static_assert(FilippovSystem<TapeSystem<2, 1, 32>>);
static_assert(HasGradH<TapeSystem<2, 1, 32>, double>);
static_assert(HasHt<TapeSystem<2, 1, 32>, double>);
static_assert(HasSlideField<TapeSystem<2, 1, 32>, double>);
static_assert(HasPeriod<TapeSystem<2, 1, 32>, double>);
static_assert(RunsInLanes<TapeSystem<2, 1, 32>>);
static_assert(FilippovSystem<TapeSystem<4, 4, 32>>);
static_assert(HasGradients<TapeSystem<4, 4, 32>, double>);

TEMPLATE_TEST_CASE("tape system: runs as the model does", "[formulas]", DormandPrince5,
                   DormandPrince8) {
    const auto formulas = tests::tape_system<2>(tests::oscillator_formulas());
    CHECK(slides_in_closed_form<double>(formulas));
    CHECK(is_forced<double>(formulas));
    for (const double tol : {1e-6, 1e-10})
        same_runs<TestType>(formulas, models::Oscillator{}, V2(0.5, 0.2), 100, tol);
}

namespace {

/// A block on a belt of speed 1 that slides along y = y0 + t, with a push in place of the forcing.
template <class Push> TapeProgram pushed_block(const Push& push) {
    Definition d;
    d.dim = 2;
    d.param_names = {"A", "omega"};
    d.defaults = {0.5, 3};
    Graph& g = d.graph;
    const Expr v = g.state(1), u = g.sub(v, g.constant(1));
    split(d, std::vector<Expr>{v, g.sub(push(g), g.unary(Op::sign, u))}, std::vector<Expr>{u});
    return TapeProgram(d, 32);
}
/// How soon s may turn; negative where nothing is known of it.
double swing_of(const TapeProgram& program) {
    if (program.swing < 0)
        return -1;
    std::vector<double> p(32, 0.0);
    p[0] = 0.5;
    p[1] = 3;
    const V2 x(0, 0);
    program.derived.run(0.0, x.data(), p.data(), p.data() + 2);
    return p[std::size_t(program.swing)];
}

} // namespace

TEST_CASE("tape system: s of a line and waves of one frequency turns after half a period",
          "[formulas]") {
    const double pi = std::numbers::pi;
    const auto wave = [](Graph& g, double factor) {
        return g.mul(g.param(0),
                     g.unary(Op::cos, g.mul(g.mul(g.constant(factor), g.param(1)), g.time())));
    };
    const auto swing = [](const auto& push) { return swing_of(pushed_block(push)); };
    CHECK(swing([&](Graph& g) { return wave(g, 1); }) == Approx(pi / 3));
    CHECK(swing([&](Graph& g) { return wave(g, -2); }) == Approx(pi / 6));
    // a line, and a wave of another phase beside it
    CHECK(swing([&](Graph& g) {
              const Expr turned = g.unary(Op::sin, g.add(g.mul(g.param(1), g.time()), g.param(0)));
              return g.div(g.sub(g.add(wave(g, 1), turned), g.state(0)), g.param(0));
          }) == Approx(pi / 3));
    // a wave in space, which the block passes with the belt's speed
    CHECK(swing([&](Graph& g) { return g.unary(Op::sin, g.mul(g.constant(4), g.state(0))); }) ==
          Approx(pi / 4));
    // nothing turns
    CHECK(swing([](Graph& g) { return g.neg(g.state(0)); }) ==
          std::numeric_limits<double>::infinity());
    // two frequencies, a wave that grows, a spring that is not linear, a weight that is not
    // constant
    CHECK(swing([&](Graph& g) { return g.add(wave(g, 1), wave(g, 2)); }) < 0);
    CHECK(swing([&](Graph& g) { return g.mul(g.time(), wave(g, 1)); }) < 0);
    CHECK(swing([&](Graph& g) { return g.mul(g.state(0), g.state(0)); }) < 0);
    CHECK(swing([&](Graph& g) { return g.unary(Op::cos, g.mul(g.time(), g.time())); }) < 0);
    CHECK(swing([&](Graph& g) {
              return g.mul(g.unary(Op::cos, g.time()),
                           g.unary(Op::sign, g.sub(g.state(1), g.constant(1))));
          }) < 0);
    const auto formulas = tests::tape_system<2>(tests::oscillator_formulas());
    const models::Oscillator model;
    CHECK(formulas.slide_swing(all_params<double>(formulas, default_values(formulas))) ==
          Approx(model.slide_swing(default_params<models::Oscillator>())));
}

TEMPLATE_TEST_CASE("tape system: several surfaces, compiled for more than there are", "[formulas]",
                   DormandPrince5, DormandPrince8) {
    const auto formulas = tests::tape_system<4, 4>(chain_formulas());
    CHECK(surface_count(formulas) == 2);
    same_runs<TestType>(formulas, Chain{}, Vec<double, 4>(0.5, 0, 0.13, 0), 40, 1e-9);
}

TEMPLATE_TEST_CASE_SIG("tape system: analysis sees the same maps", "[formulas]", ((int N), N), 2,
                       16) { // compiled for just as many components, and for more
    const auto mine = any_system(tests::tape_system<N>(tests::oscillator_formulas()));
    const auto model = any_system(models::Oscillator{});
    CHECK(mine->dim() == 2);
    CHECK(mine->params() == model->params());
    CHECK(mine->defaults() == model->defaults());
    CHECK(mine->forced());
    const Vector p = model->defaults(), x = V2(0.1, 0.3);
    const Directions along{{0, 1}, nullptr};
    const auto close = [](const Matrix& a, const Matrix& b) {
        CHECK((a - b).norm() < 1e-10 * (1 + b.norm()));
    };
    const PeriodJet one = mine->period(p, along), two = model->period(p, along);
    CHECK(one.value == two.value);
    CHECK(std::abs(one.slope[1] - two.slope[1]) < 1e-14);
    for (const int mode : {-1, 0, 1}) {
        CAPTURE(mode);
        const Vector at = V2(0.1, 1 + 1.5 * mode);
        const Jet a = mine->arc(mode, 0.2, at, 0.4, p, along);
        const Jet b = model->arc(mode, 0.2, at, 0.4, p, along);
        close(a.value, b.value);
        close(a.slope, b.slope);
        for (const int order : {0, 1, 2, 3}) {
            if (mode == 0)
                continue;
            const Quantity h{Quantity::Kind::h, mode, order};
            close(mine->quantity(h, 0.2, at, p, along).slope,
                  model->quantity(h, 0.2, at, p, along).slope);
        }
    }
    const Leg leg{0, x, 20};
    const Journey a = mine->journey(leg, p, along), b = model->journey(leg, p, along);
    CHECK(a.word == b.word);
    close(a.end.slope, b.end.slope);
    CHECK(a.lost == b.lost);
    const History c = mine->run(0, x, 20, p), d = model->run(0, x, 20, p);
    REQUIRE(c.events.size() == d.events.size());
    close(c.x, d.x);
    for (std::size_t k = 0; k < c.events.size(); ++k)
        close(c.events[k].x, d.events[k].x);
    const Vector direction = Vector::LinSpaced(6, -1, 1); // (x, t0, t1, a, b)
    const Directions bent{{0, 1}, &direction};
    close(mine->arc(-1, 0.2, x, 0.4, p, bent).bend, model->arc(-1, 0.2, x, 0.4, p, bent).bend);
}

TEST_CASE("tape system: components that there are not", "[formulas]") {
    const auto exact = tests::tape_system<2>(tests::oscillator_formulas());
    const auto wide = tests::tape_system<16>(tests::oscillator_formulas());
    CHECK(component_count(wide) == 2);
    CHECK_FALSE(RunsInLanes<TapeSystem<16, 1, 32>>);
    CHECK_THROWS_AS((tests::tape_system<3>(tests::oscillator_formulas())), std::invalid_argument);
    Vec<double, 16> start = Vec<double, 16>::Zero();
    start[0] = 0.5;
    start[1] = 0.2;
    const auto p = all_params<double>(wide, default_values(wide));
    const auto mine = simulate<DormandPrince8>(wide, p, start, 0.0, 60.0, tight<16>(1e-11));
    const auto other =
        simulate<DormandPrince8>(exact, all_params<double>(exact, default_values(exact)),
                                 V2(0.5, 0.2), 0.0, 60.0, tight<2>(1e-11));
    REQUIRE(mine.result.status == Status::ok);
    REQUIRE(mine.events.size() == other.events.size());
    for (std::size_t k = 0; k < mine.events.size(); ++k)
        CHECK(std::abs(mine.events[k].t - other.events[k].t) < 1e-8);
    for (const auto& x : mine.x)
        CHECK(x.tail<14>().isZero(0));
}

TEST_CASE("tape system: a lane runs as the model's does", "[formulas]") {
    const auto formulas = tests::tape_system<2>(tests::oscillator_formulas());
    const models::Oscillator model;
    const auto settings = tight<2>(1e-8);
    const auto members = [&](const auto& sys) {
        using Sys = std::remove_cvref_t<decltype(sys)>;
        std::vector<Member<dim_v<Sys>, params_v<Sys>>> all;
        for (int i = 0; i < 100; ++i) {
            State<Sys, double> x = State<Sys, double>::Zero();
            x.template head<2>() = V2(-2 + 0.04 * i, 0.02 * i);
            all.push_back({x, all_params<double>(sys, default_values(sys)), 0, 10});
        }
        return all;
    };
    const auto mine = ensemble<DormandPrince8, 4>(formulas, members(formulas), settings);
    const auto other = ensemble<DormandPrince8, 2>(model, members(model), settings);
    // compiled for more components than there are
    const auto spacious = tests::tape_system<8>(tests::oscillator_formulas());
    const auto wide = ensemble<DormandPrince8, 4>(spacious, members(spacious), tight<8>(1e-8));
    CHECK(wide.counters.steps == mine.counters.steps);
    CHECK(wide.counters.handed_over == mine.counters.handed_over);
    for (std::size_t k = 0; k < 100; ++k) {
        CAPTURE(k);
        CHECK(mine.outcomes[k].status == Status::ok);
        CHECK(mine.outcomes[k].events == other.outcomes[k].events);
        CHECK((mine.outcomes[k].x - other.outcomes[k].x).norm() < 1e-7);
        CHECK(wide.outcomes[k].status == Status::ok);
        CHECK(wide.outcomes[k].events == mine.outcomes[k].events);
        CHECK((wide.outcomes[k].x.head<2>() - mine.outcomes[k].x).norm() < 1e-12);
        CHECK(wide.outcomes[k].x.tail<6>().isZero(0));
    }
}
