// SPDX-License-Identifier: BSD-3-Clause
// Curves of bifurcations in two parameters, and the points of codimension two on them.

#include "catch.hpp"
#include "slow_belt.hpp"
#include "systems.hpp"

#include <filippov/continuation/bifurcation_set.hpp>
#include <filippov/core/elementary.hpp>
#include <filippov/orbits/any_system.hpp>

#include <algorithm>
#include <cmath>
#include <map>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::shared_ptr<const AnySystem> oscillator = oscillator_system();

Branch branch_at(double A, double omega, double low, double high) {
    Vector p = params_at(*oscillator, A, omega);
    const Orbit orbit = settle(*oscillator, p, Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    BranchTracer tracer(*oscillator, 1, low, high);
    return tracer.trace(orbit.cycle);
}
const SpecialPoint& find(const Branch& branch, Kind kind) {
    for (const SpecialPoint& s : branch.special)
        if (s.kind == kind)
            return s;
    FAIL("no " << name(kind));
    return branch.special.front();
}
double residual(const SpecialPoint& s, const std::string& name) {
    for (const auto& [key, value] : s.conditions)
        if (key == name)
            return value;
    FAIL("no condition " << name);
    return 0;
}
/// Distance of a point (omega, A) from a curve's polyline.
double distance(const Curve& curve, double omega, double A) {
    double best = 1e9;
    for (std::size_t i = 1; i < curve.points.size(); ++i) {
        const Vector &p = curve.points[i - 1].cycle.p, &q = curve.points[i].cycle.p;
        const double dx = q[1] - p[1], dy = q[0] - p[0];
        const double u =
            std::clamp(((omega - p[1]) * dx + (A - p[0]) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
        best = std::min(best, std::hypot(p[1] + u * dx - omega, p[0] + u * dy - A));
    }
    return best;
}

/// x'' + x' + x = A cos omega t where x < 1; with a spring of stiffness 1 + k above.
struct Stiffened {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"A", "omega", "k"};
    static constexpr std::array<double, 3> defaults{0.5, 1, 3};
    template <Scalar S>
    State<Stiffened, S> f1(const S& t, const State<Stiffened, S>& x,
                           const Params<Stiffened, S>& p) const {
        using elementary::cos;
        return {x[1], p[0] * cos(p[1] * t) - x[1] - x[0]};
    }
    template <Scalar S>
    State<Stiffened, S> f2(const S& t, const State<Stiffened, S>& x,
                           const Params<Stiffened, S>& p) const {
        State<Stiffened, S> f = f1(t, x, p);
        f[1] -= p[2] * (x[0] - S(1));
        return f;
    }
    template <Scalar S>
    S h(const S&, const State<Stiffened, S>& x, const Params<Stiffened, S>&) const {
        return x[0] - S(1);
    }
    template <Scalar S> S period(const Params<Stiffened, S>& p) const {
        return S(2 * std::acos(-1.0)) / p[1];
    }
};

/// A block on a belt, its friction 1/(1 + |v - 1|).
struct Belt {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"A", "omega"};
    static constexpr std::array<double, 2> defaults{1, 2};
    template <Scalar S>
    State<Belt, S> f1(const S& t, const State<Belt, S>& x, const Params<Belt, S>& p) const {
        return pulled(t, x, p, S(1) / (S(2) - x[1]));
    }
    template <Scalar S>
    State<Belt, S> f2(const S& t, const State<Belt, S>& x, const Params<Belt, S>& p) const {
        return pulled(t, x, p, S(-1) / x[1]);
    }
    template <Scalar S> S h(const S&, const State<Belt, S>& x, const Params<Belt, S>&) const {
        return x[1] - S(1);
    }
    template <Scalar S> S period(const Params<Belt, S>& p) const {
        return S(2 * std::acos(-1.0)) / p[1];
    }

private:
    template <Scalar S>
    static State<Belt, S> pulled(const S& t, const State<Belt, S>& x, const Params<Belt, S>& p,
                                 const S& friction) {
        using elementary::cos;
        return {x[1], friction - x[0] - S(0.1) * x[1] + p[0] * cos(p[1] * t)};
    }
};

/// r' = r (mu - r^2) and one turn in 2 pi where x < a; beyond, x is pushed back.
struct Circle {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"mu", "a"};
    static constexpr std::array<double, 2> defaults{1.5, 1};
    template <Scalar S>
    State<Circle, S> f1(const S&, const State<Circle, S>& x, const Params<Circle, S>& p) const {
        const S growth = p[0] - x[0] * x[0] - x[1] * x[1];
        return {growth * x[0] - x[1], growth * x[1] + x[0]};
    }
    template <Scalar S>
    State<Circle, S> f2(const S& t, const State<Circle, S>& x, const Params<Circle, S>& p) const {
        State<Circle, S> f = f1(t, x, p);
        f[0] -= S(0.5) * (x[0] - p[1]);
        return f;
    }
    template <Scalar S> S h(const S&, const State<Circle, S>& x, const Params<Circle, S>& p) const {
        return x[0] - p[1];
    }
};

} // namespace

TEST_CASE("curve: a switching-sliding curve ends where two others begin", "[curve]") {
    const Box box{{1, 0}, {1.5, 4.0}, {3.2, 5.5}};
    const Branch branch = branch_at(5, 1.6, 1.5, 3.2);
    CurveTracer tracer(*oscillator, box);
    const Curve switching = tracer.trace(curve_start(find(branch, Kind::switching_sliding)));
    REQUIRE(tracer.degenerate().size() == 1);
    REQUIRE(switching.special.size() == 1);
    const SpecialPoint& b1 = switching.special[0];
    CHECK(b1.kind == Kind::degenerate_switching_sliding);
    CHECK(std::abs(residual(b1, "h")) < 1e-12);
    CHECK(std::abs(residual(b1, "L2")) < 1e-12);
    CHECK(std::abs(residual(b1, "L2'")) < 1e-10);
    CHECK(residual(b1, "L2''") < 0);
    CHECK(b1.cycle.p[0] == Approx(4.82).margin(0.03)); // printed with three digits

    // on the boundary s = +1 both conditions are closed forms of the phase
    const double A = b1.cycle.p[0], omega = b1.cycle.p[1];
    const double phase = omega * b1.cycle.t[b1.node];
    CHECK(1 + A * omega * std::sin(phase) == Approx(0).margin(1e-9));
    CHECK(b1.cycle.x[b1.node][0] == Approx(-4 + A * std::cos(phase)).epsilon(1e-11));

    const auto starts = curves_at_degenerate(tracer.degenerate()[0]);
    const Curve crossing = tracer.trace(starts[1]), adding = tracer.trace(starts[2]);
    for (const Curve* curve : {&crossing, &adding}) {
        CHECK(curve->points.size() > 10);
        CHECK(std::abs(curve->points.front().cycle.p[1] - omega) < 1e-9);
        CHECK(curve->end == BranchEnd::bound_of_two);
    }
    // figure 4.11: at A = 4.4 crossing-sliding lies between 1.6 and 1.8, adding-sliding between 1.8
    // and 2; and plain branches over omega meet both curves
    const Branch low = branch_at(4.4, 1.6, 1.5, 2.2);
    for (const auto& [kind, curve] :
         {std::pair{Kind::crossing_sliding, &crossing}, std::pair{Kind::adding_sliding, &adding}}) {
        const SpecialPoint& s = find(low, kind);
        CHECK(distance(*curve, s.cycle.p[1], 4.4) < 1e-3);
    }
    CHECK(find(low, Kind::crossing_sliding).cycle.p[1] > 1.6);
    CHECK(find(low, Kind::crossing_sliding).cycle.p[1] < 1.8);
    CHECK(find(low, Kind::adding_sliding).cycle.p[1] > 1.8);
    CHECK(find(low, Kind::adding_sliding).cycle.p[1] < 2.0);
}

TEST_CASE("curve: the degenerate point is the same from all three curves", "[curve]") {
    const Box box{{1, 0}, {1.5, 4.0}, {3.2, 5.5}};
    const Branch high = branch_at(5, 1.6, 1.5, 3.2), low = branch_at(4.4, 1.6, 1.5, 2.2);
    std::vector<Vector> found;
    for (const SpecialPoint* s :
         {&find(high, Kind::switching_sliding), &find(low, Kind::crossing_sliding),
          &find(low, Kind::adding_sliding)}) {
        CurveTracer tracer(*oscillator, box);
        const Curve curve = tracer.trace(curve_start(*s));
        CAPTURE(name(s->kind), message(curve.begin), message(curve.end));
        for (const SpecialPoint& c : curve.special)
            if (c.kind == Kind::degenerate_switching_sliding)
                found.push_back(c.cycle.p);
    }
    REQUIRE(found.size() == 3);
    for (const Vector& p : found)
        CHECK((p - found[0]).norm() < 1e-9);
}

TEST_CASE("curve: of bifurcations that are not followed none starts", "[curve]") {
    const Branch branch = branch_at(5, 1.6, 1.5, 3.2);
    CurveTracer tracer(*oscillator, {{1, 0}, {1.5, 4.0}, {3.2, 5.5}});
    for (const Kind kind : {Kind::neimark_sacker, Kind::cusp, Kind::degenerate_switching_sliding}) {
        CurveStart start;
        start.kind = kind;
        start.cycle = branch.points[3].cycle;
        CHECK_THROWS_WITH(tracer.trace(start), ContainsSubstring(std::string(name(kind))));
    }
}

TEST_CASE("bifurcation_set: rectangles that make no sense are refused before any work", "[curve]") {
    const Vector p = oscillator->defaults();
    const auto before = oscillator->counters().field;
    CHECK_THROWS_WITH(bifurcation_set(*oscillator, p, {{77, 0}, {1, 3}, {2, 4}}),
                      ContainsSubstring("box.parameters = 77"));
    CHECK_THROWS_WITH(bifurcation_set(*oscillator, p, {{1, 1}, {1, 3}, {2, 4}}),
                      ContainsSubstring("box.parameters = 1"));
    CHECK_THROWS_WITH(bifurcation_set(*oscillator, p, {{1, 0}, {1, 3}, {std::nan(""), 4}}),
                      ContainsSubstring("box.low = 1"));
    CHECK_THROWS_WITH(
        bifurcation_set(*oscillator, p, {{1, 0}, {1, 3}, {2, 4}}, {.steps = {.min_step = 1}}),
        ContainsSubstring("min_step"));
    CHECK(oscillator->counters().field == before);
}

TEST_CASE("curve: two folds meet in a cusp", "[curve]") {
    const Branch branch = branch_at(3.6, 1.067, 0.9, 1.3);
    const Box box{{1, 0}, {0.9, 2.5}, {1.6, 5.0}};
    std::vector<Vector> cusps;
    int folds = 0;
    for (const SpecialPoint& s : branch.special) {
        if (s.kind != Kind::fold)
            continue;
        ++folds;
        CurveTracer tracer(*oscillator, box);
        const Curve curve = tracer.trace(curve_start(s));
        CHECK(distance(curve, s.cycle.p[1], 3.6) < 1e-9);
        for (const SpecialPoint& c : curve.special)
            if (c.kind == Kind::cusp)
                cusps.push_back(c.cycle.p);
    }
    CHECK(folds == 2);
    REQUIRE(cusps.size() == 2);
    CHECK((cusps[0] - cusps[1]).norm() < 1e-10);
    // a triple orbit: beyond the cusp a branch has no fold, before it two
    const double A = cusps[0][0], omega = cusps[0][1];
    const auto count = [](const Branch& b) {
        return std::count_if(b.special.begin(), b.special.end(),
                             [](const SpecialPoint& s) { return s.kind == Kind::fold; });
    };
    CHECK(count(branch_at(A + 0.05, omega - 0.1, omega - 0.2, omega + 0.3)) == 0);
    CHECK(count(branch_at(A - 0.05, omega - 0.1, omega - 0.2, omega + 0.3)) == 2);
}

TEST_CASE("bifurcation_set: figures 4.11 and 4.13 from the model and a rectangle", "[curve]") {
    const auto count = [](const BifurcationSet& set, Kind kind) {
        return std::count_if(set.curves.begin(), set.curves.end(),
                             [kind](const Curve& c) { return c.kind == kind; });
    };
    const Vector p = oscillator->defaults();
    const BifurcationSet sliding =
        bifurcation_set(*oscillator, p, {{1, 0}, {1.5, 4.0}, {3.2, 5.5}});
    CHECK(sliding.failed_starts == 0);
    CHECK(count(sliding, Kind::switching_sliding) == 1);
    CHECK(count(sliding, Kind::adding_sliding) == 1);
    CHECK(count(sliding, Kind::crossing_sliding) == 2); // at either end of the slip above
    int degenerate = 0;
    for (const Curve& curve : sliding.curves)
        for (const SpecialPoint& s : curve.special)
            if (s.kind == Kind::degenerate_switching_sliding) {
                ++degenerate;
                CHECK(s.cycle.p[1] == Approx(2.53542917558).epsilon(1e-11));
            }
    CHECK(degenerate >= 1); // a curve that starts there does not find it again
    CHECK(sliding.corrections < 100'000);

    const BifurcationSet cusp = bifurcation_set(*oscillator, p, {{1, 0}, {0.9, 3.0}, {1.6, 4.4}});
    CHECK(count(cusp, Kind::fold) == 1); // both folds are one curve, through the cusp
    CHECK(cusp.corrections < 100'000);
}

TEST_CASE("curve: both halves of a symmetric orbit bifurcate all along it", "[curve]") {
    const auto relay = relay_system();
    const auto settled = [&](double omega, double zeta) {
        Vector p = relay->defaults(), x(3);
        p << zeta, omega, 1, 1, -2, 1;
        x << 0, 0.5, 0;
        const Orbit orbit = settle(*relay, p, x);
        REQUIRE(orbit.status == Status::ok);
        return orbit.cycle;
    };
    const Branch branch = BranchTracer(*relay, 1, 9.5, 11).trace(settled(10, 0.05));
    REQUIRE(branch.special.size() == 2);
    const Box box{{1, 0}, {9.5, 0.005}, {11, 0.1}};
    for (const SpecialPoint& s : branch.special) {
        REQUIRE(s.kind == Kind::adding_sliding);
        const Curve curve = CurveTracer(*relay, box).trace(curve_start(s));
        CAPTURE(s.side, message(curve.begin), message(curve.end));
        CHECK(curve.begin == BranchEnd::bound_of_two);
        CHECK(curve.end == BranchEnd::bound_of_two);
        CHECK(curve.special.empty());
        for (const std::size_t i : {std::size_t(1), curve.points.size() / 2}) {
            const Vector& p = curve.points[i].cycle.p;
            CHECK(settled(p[1] - 2e-3, p[0]).word.string() == "0-0-0+0+");
            CHECK(settled(p[1] + 2e-3, p[0]).word.string() == "0-0-0-0+0+0+");
        }
    }
}

TEST_CASE("curve: flips and folds end on curves of grazing-sliding at one point, from wherever",
          "[curve]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 5, 1.6);
    const Branch branch =
        BranchTracer(*system, 0, 0.5, 12).trace(settle(*system, p, Vector::Zero(2)).cycle);
    const Box box{{0, 1}, {0.5, 1}, {12, 3}};
    std::map<Kind, std::vector<Vector>> ends;
    for (const SpecialPoint& s : branch.special)
        if (s.kind == Kind::flip || s.kind == Kind::fold)
            for (const double max_step : {0.05, 0.02}) {
                BranchSettings settings;
                settings.max_step = max_step;
                const Curve curve = CurveTracer(*system, box, settings).trace(curve_start(s));
                CHECK(curve.status == Status::ok);
                REQUIRE(curve.special.size() == 1);
                const SpecialPoint& end = curve.special[0];
                REQUIRE(end.kind == Kind::grazing_sliding);
                CHECK(std::abs(end.multipliers_child[0] - (s.kind == Kind::flip ? -1.0 : 1.0)) <
                      1e-8);
                ends[s.kind].push_back(end.cycle.p);
            }
    CHECK(ends[Kind::flip].size() == 4); // both flips lie on one curve
    for (const auto& [kind, points] : ends)
        for (const Vector& q : points)
            CHECK((q - points[0]).norm() < 1e-9);
}

TEST_CASE("curve: grazings without a slide lie where a linear oscillator's amplitude says",
          "[curve]") {
    const auto system = any_system(Stiffened{});
    const Orbit orbit = settle(*system, system->defaults(), Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    const Branch branch = BranchTracer(*system, 0, 0.1, 2).trace(orbit.cycle);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::bound);
    const SpecialPoint& touch = find(branch, Kind::grazing);
    CHECK(touch.cycle.p[0] == Approx(1).epsilon(1e-10));
    const Box box{{0, 1}, {0.1, 0.3}, {4, 2}};
    const Curve curve = CurveTracer(*system, box).trace(curve_start(touch));
    CHECK(curve.status == Status::ok);
    CHECK(curve.begin == BranchEnd::bound_of_two);
    CHECK(curve.end == BranchEnd::bound_of_two);
    REQUIRE(curve.points.size() > 10);
    for (const BranchPoint& point : curve.points) {
        const double w = point.cycle.p[1], detuned = 1 - w * w;
        CHECK(point.cycle.p[0] == Approx(std::hypot(detuned, w)).epsilon(1e-9));
    }
    const auto [low, high] =
        std::minmax(curve.points.front().cycle.p[1], curve.points.back().cycle.p[1]);
    CHECK(low == Approx(0.3).epsilon(1e-9));
    CHECK(high == Approx(2).epsilon(1e-9));
}

TEST_CASE("curve: a free oscillator's circle grazes where its radius says", "[curve]") {
    const auto system = any_system(Circle{});
    Vector x(2);
    x << 0.3, 0.1;
    const Orbit orbit = settle(*system, system->defaults(), x);
    REQUIRE(orbit.status == Status::ok);
    const Branch branch = BranchTracer(*system, 0, 0.1, 2).trace(orbit.cycle);
    const SpecialPoint& touch = find(branch, Kind::grazing);
    CHECK(touch.cycle.p[0] == Approx(1).epsilon(1e-10));
    CHECK(touch.word_before == "-");
    CHECK(touch.word_after == "-+");
    const Curve curve =
        CurveTracer(*system, {{0, 1}, {0.05, 0.2}, {4, 2}}).trace(curve_start(touch));
    CHECK(curve.begin == BranchEnd::bound_of_two);
    CHECK(curve.end == BranchEnd::bound_of_two);
    REQUIRE(curve.points.size() > 10);
    for (const BranchPoint& point : curve.points) {
        CHECK(point.cycle.p[0] == Approx(point.cycle.p[1] * point.cycle.p[1]).epsilon(1e-9));
        CHECK(point.cycle.period == Approx(2 * std::acos(-1.0)).epsilon(1e-9));
    }
}

TEST_CASE("curve: adding-sliding ends where the touch comes to the slide's entry", "[curve]") {
    const auto system = any_system(Belt{});
    const Orbit orbit = settle(*system, system->defaults(), Vector::Zero(2));
    const Branch branch = BranchTracer(*system, 1, 1, 3).trace(orbit.cycle);
    const Curve curve = CurveTracer(*system, {{1, 0}, {0.3, 0.2}, {4.5, 5}})
                            .trace(curve_start(find(branch, Kind::adding_sliding)));
    REQUIRE(curve.end == BranchEnd::end_of_slide);
    for (const SpecialPoint& s : curve.special)
        CHECK((s.kind == Kind::fold || s.kind == Kind::switching_sliding));
    const Cycle& last = curve.points.back().cycle;
    CHECK(last.p[1] == Approx(2.06683687).epsilon(1e-8));
    // There the block arrives with no force left, and none growing: L1 = L1' = 0, and s = -1.
    const double A = last.p[0], w = last.p[1], t = last.t[0], x = last.x[0][0];
    CHECK(last.t[1] == Approx(t).margin(1e-7));
    CHECK(1 - x - 0.1 + A * std::cos(w * t) == Approx(0).margin(1e-9));
    CHECK(-1 - A * w * std::sin(w * t) == Approx(0).margin(1e-6));
    // all others are touches, and orbits
    for (std::size_t i = 0; i + 1 < curve.points.size(); ++i) {
        const Cycle& c = curve.points[i].cycle;
        const bool touches = std::ranges::any_of(c.t, [&](double at) {
            return std::abs(1 + c.p[0] * c.p[1] * std::sin(c.p[1] * at)) < 1e-6;
        });
        CHECK(touches);
    }
}

TEST_CASE("curve: a slide that begins on its boundary and vanishes there", "[curve]") {
    // Where L2 = L2' = 0 and L2'' > 0 at the entry: beyond, the orbit crosses, tangent at first.
    const auto system = any_system(SlowBelt{});
    Vector p = system->defaults(), x(2);
    p[0] = 0.5;
    x << 0.3, 0.1;
    const Branch branch = BranchTracer(*system, 1, 0.3, 4).trace(settle(*system, p, x).cycle);
    const auto is_switching = [](const SpecialPoint& s) {
        return s.kind == Kind::switching_sliding;
    };
    const auto entry = std::ranges::find_if(branch.special, is_switching);
    REQUIRE(entry != branch.special.end());
    CurveTracer tracer(*system, {{0, 1}, {0, 0.3}, {2, 4}});
    const Curve curve = tracer.trace(curve_start(*entry));
    CHECK(curve.status == Status::ok);
    CHECK(curve.begin == BranchEnd::degenerate_crossing_sliding);
    CHECK(curve.end == BranchEnd::bound_of_two);
    REQUIRE(curve.special.size() == 2);
    const SpecialPoint& point = curve.special[0];
    CHECK(point.kind == Kind::crossing_sliding);
    CHECK(point.cycle.word.string() == "0-+");
    for (const auto& [condition, value] : point.conditions) {
        CAPTURE(condition);
        if (condition == "L2''")
            CHECK(value > 0.1);
        else
            CHECK(std::abs(value) < 1e-10);
    }
    CHECK(curve.special[1].kind == Kind::adding_sliding);

    // the curve of crossings starts there, and one that comes from elsewhere ends there
    const Curve crossings = tracer.trace(curve_start(point));
    CHECK(crossings.begin == BranchEnd::bound_of_two);
    CHECK(crossings.end == BranchEnd::codimension_two);
    CurveStart start = curve_start(point);
    start.condition.cycle = crossings.points[crossings.points.size() / 2].cycle;
    const Curve back = tracer.trace(start);
    CHECK(back.begin == BranchEnd::bound_of_two);
    REQUIRE(back.end == BranchEnd::degenerate_crossing_sliding);
    for (const int k : {0, 1})
        CHECK(back.points.back().cycle.p[k] == Approx(point.cycle.p[k]).epsilon(1e-10));
    // also where its first step from the start leads beyond
    start.condition.cycle = back.points[back.points.size() - 2].cycle;
    const Curve near = tracer.trace(start);
    REQUIRE(near.end == BranchEnd::degenerate_crossing_sliding);
    CHECK(near.points.back().cycle.p[0] == Approx(point.cycle.p[0]).epsilon(1e-10));
}
