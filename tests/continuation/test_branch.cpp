// SPDX-License-Identifier: BSD-3-Clause
// Branches of periodic orbits, and the bifurcations on them.

#include "catch.hpp"
#include "converter.hpp"
#include "slow_belt.hpp"
#include "systems.hpp"

#include <filippov/continuation/branch.hpp>
#include <filippov/orbits/any_system.hpp>

#include <algorithm>
#include <cmath>

using namespace filippov;
using Catch::Matchers::ContainsSubstring;

namespace {

struct Traced {
    Branch branch;
    std::shared_ptr<const AnySystem> system;

    const SpecialPoint* find(Kind kind, double omega) const {
        const SpecialPoint* best = nullptr;
        for (const SpecialPoint& s : branch.special)
            if (s.kind == kind && (best == nullptr || std::abs(s.cycle.p[1] - omega) <
                                                          std::abs(best->cycle.p[1] - omega)))
                best = &s;
        return best;
    }
};

Traced trace(double A, double omega, double low, double high,
             std::shared_ptr<const AnySystem> system = oscillator_system()) {
    Vector p = params_at(*system, A, omega);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    BranchTracer tracer(*system, 1, low, high);
    return {tracer.trace(orbit.cycle), system};
}

double residual(const SpecialPoint& s, const std::string& name) {
    for (const auto& [key, value] : s.conditions)
        if (key == name)
            return value;
    FAIL("no condition " << name);
    return 0;
}

/// A circle of radius sqrt(mu) about (c, d), far from where anything switches.
struct Circle {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 3> params{"mu", "c", "d"};
    static constexpr std::array<double, 3> defaults{1, 0, 0};
    template <Scalar S>
    State<Circle, S> f1(const S&, const State<Circle, S>& x, const Params<Circle, S>& p) const {
        const S u = x[0] - p[1], v = x[1] - p[2], growth = p[0] - u * u - v * v;
        return {growth * u - v, growth * v + u};
    }
    template <Scalar S>
    State<Circle, S> f2(const S& t, const State<Circle, S>& x, const Params<Circle, S>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const State<Circle, S>& x, const Params<Circle, S>&) const {
        return x[0] + S(100);
    }
};
/// That circle followed in one of its parameters.
Branch trace_circle(int parameter, double low, double high) {
    const auto system = any_system(Circle{});
    Cycle c;
    c.word.letters = {{1, Until::phase}};
    c.period = 2 * std::acos(-1.0);
    c.t = {0};
    c.x = {Vector::Unit(2, 0)};
    c.p = system->defaults();
    REQUIRE(shoot(*system, c).ok());
    return BranchTracer(*system, parameter, low, high).trace(c);
}

/// A mass on a belt of speed V, driven by A cos(om t); the friction dips by `dip` as it slips.
struct Belt {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 4> params{"V", "A", "om", "dip"};
    static constexpr std::array<double, 4> defaults{0.5, 0.5, 1.3, 0.3};
    template <Scalar S>
    static State<Belt, S> pulled(const S& t, const State<Belt, S>& x, const Params<Belt, S>& p,
                                 double side) {
        using elementary::cos;
        using std::exp;
        const S slip = (p[0] - x[1]) / S(0.4), friction = S(0.3) + p[3] * exp(-slip * slip);
        return {x[1], p[1] * cos(p[2] * t) - x[0] - S(0.05) * x[1] - S(side) * friction};
    }
    template <Scalar S>
    State<Belt, S> f1(const S& t, const State<Belt, S>& x, const Params<Belt, S>& p) const {
        return pulled(t, x, p, -1);
    }
    template <Scalar S>
    State<Belt, S> f2(const S& t, const State<Belt, S>& x, const Params<Belt, S>& p) const {
        return pulled(t, x, p, 1);
    }
    template <Scalar S> S h(const S&, const State<Belt, S>& x, const Params<Belt, S>& p) const {
        return x[1] - p[0];
    }
    template <Scalar S> S period(const Params<Belt, S>& p) const {
        return S(2 * std::acos(-1.0)) / p[2];
    }
};

/// A buck converter in voltage mode. What switches is not what h looks at: the fields differ in i
/// alone, so both cross h = 0 alike, and nothing slides.
struct Buck : Converter<1> {
    static constexpr std::array<std::string_view, 1> params{"E"};
    static constexpr std::array<double, 1> defaults{24};
    template <Scalar S> S h(const S& t, const State<Buck, S>& x, const Params<Buck, S>&) const {
        using elementary::sin;
        return S(6) + S(2.2) * sin(t * S(5 * std::acos(-1.0))) - S(8.4) * (x[0] - S(11.3));
    }
};

/// r' = m r (1 - r^2) and one turn in 2 pi where y < g, towards which the other field leads.
struct Ring {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"m", "g"};
    static constexpr std::array<double, 2> defaults{2.5, 0.9};
    template <Scalar S>
    State<Ring, S> f1(const S&, const State<Ring, S>& x, const Params<Ring, S>& p) const {
        const S growth = p[0] * (S(1) - x[0] * x[0] - x[1] * x[1]);
        return {growth * x[0] - x[1], growth * x[1] + x[0]};
    }
    template <Scalar S>
    State<Ring, S> f2(const S&, const State<Ring, S>&, const Params<Ring, S>&) const {
        return {S(0.3), S(-1)};
    }
    template <Scalar S> S h(const S&, const State<Ring, S>& x, const Params<Ring, S>& p) const {
        return x[1] - p[1];
    }
};

/// 1 / (s + 1)^3 under a relay with lead: x''' + 3 x'' + 3 x' + x = -sign(x + b x').
struct Lead {
    static constexpr int dim = 3;
    static constexpr std::array<std::string_view, 1> params{"b"};
    static constexpr std::array<double, 1> defaults{0.1};
    template <Scalar S> static State<Lead, S> field(const State<Lead, S>& x, const S& u) {
        return {x[1], x[2], u - S(3) * x[2] - S(3) * x[1] - x[0]};
    }
    template <Scalar S>
    State<Lead, S> f1(const S&, const State<Lead, S>& x, const Params<Lead, S>&) const {
        return field(x, S(1));
    }
    template <Scalar S>
    State<Lead, S> f2(const S&, const State<Lead, S>& x, const Params<Lead, S>&) const {
        return field(x, S(-1));
    }
    template <Scalar S> S h(const S&, const State<Lead, S>& x, const Params<Lead, S>& p) const {
        return x[0] + p[0] * x[1];
    }
};

/// Van der Pol's, slower by a tenth above y = -0.6: its cycle explodes where a is just below 1.
struct Canard {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"a"};
    static constexpr std::array<double, 1> defaults{0.992};
    template <Scalar S> static State<Canard, S> field(const State<Canard, S>& x, const S& a, S g) {
        return {(x[1] - x[0] * x[0] * x[0] / S(3) + x[0]) / S(0.05), g * (a - x[0])};
    }
    template <Scalar S>
    State<Canard, S> f1(const S&, const State<Canard, S>& x, const Params<Canard, S>& p) const {
        return field(x, p[0], S(1));
    }
    template <Scalar S>
    State<Canard, S> f2(const S&, const State<Canard, S>& x, const Params<Canard, S>& p) const {
        return field(x, p[0], S(0.9));
    }
    template <Scalar S> S h(const S&, const State<Canard, S>& x, const Params<Canard, S>&) const {
        return x[1] + S(0.6);
    }
};

/// x'' = -x - 0.1 x' + A cos 0.6 t - sign(x' - 1) / (1 + |x' - 1|).
struct Weakening {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"A"};
    static constexpr std::array<double, 1> defaults{2.655};
    template <Scalar S>
    State<Weakening, S> f1(const S& t, const State<Weakening, S>& x,
                           const Params<Weakening, S>& p) const {
        return pulled(t, x, p, S(-1));
    }
    template <Scalar S>
    State<Weakening, S> f2(const S& t, const State<Weakening, S>& x,
                           const Params<Weakening, S>& p) const {
        return pulled(t, x, p, S(1));
    }
    template <Scalar S>
    S h(const S&, const State<Weakening, S>& x, const Params<Weakening, S>&) const {
        return x[1] - S(1);
    }
    template <Scalar S> S period(const Params<Weakening, S>&) const {
        return S(2 * std::acos(-1.0) / 0.6);
    }

private:
    template <Scalar S>
    static State<Weakening, S> pulled(const S& t, const State<Weakening, S>& x,
                                      const Params<Weakening, S>& p, const S& side) {
        using elementary::cos;
        const S friction = side / (S(1) + side * (x[1] - S(1)));
        return {x[1], p[0] * cos(S(0.6) * t) - x[0] - S(0.1) * x[1] - friction};
    }
};

/// x'' + x' + x = A cos t where x < 1, and x' >= 1 above.
struct Thrown {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"A"};
    static constexpr std::array<double, 1> defaults{0.5};
    template <Scalar S>
    State<Thrown, S> f1(const S& t, const State<Thrown, S>& x, const Params<Thrown, S>& p) const {
        using elementary::cos;
        return {x[1], p[0] * cos(t) - x[1] - x[0]};
    }
    template <Scalar S>
    State<Thrown, S> f2(const S&, const State<Thrown, S>& x, const Params<Thrown, S>&) const {
        return {S(1) + x[1] * x[1], S(0)};
    }
    template <Scalar S> S h(const S&, const State<Thrown, S>& x, const Params<Thrown, S>&) const {
        return x[0] - S(1);
    }
    template <Scalar S> S period(const Params<Thrown, S>&) const { return S(2 * std::acos(-1.0)); }
};

/// The bifurcation is one of the orbit itself: the words of plain runs on its two sides.
std::string word_at(const Traced& traced, const SpecialPoint& s, double omega) {
    Cycle near = parent_of({s.kind, s.cycle, s.node, s.side});
    Vector p = near.p;
    p[1] = omega;
    const Orbit orbit = settle(*traced.system, p, near.x[0]);
    return orbit.status == Status::ok ? orbit.cycle.word.string() : "none";
}

} // namespace

TEST_CASE("branch: adding- and grazing-sliding at A = 0.5", "[branch]") {
    const Traced traced = trace(0.5, 2.94, 2.84, 2.98);
    const SpecialPoint* adding = traced.find(Kind::adding_sliding, 2.904);
    REQUIRE(adding);
    // printed 2.904315905; good to nine digits, says the reading of the chapter
    CHECK(adding->cycle.p[1] == Approx(2.904315905).epsilon(2e-9));
    CHECK(std::abs(residual(*adding, "h")) < 1e-12);
    CHECK(std::abs(residual(*adding, "1 + s")) < 1e-12);
    CHECK(std::abs(residual(*adding, "L1")) < 1e-12);
    CHECK(std::abs(residual(*adding, "L1'")) < 1e-10);
    CHECK(residual(*adding, "L1''") > 0);
    CHECK(adding->side == -1);
    // closed form on the slide: 1 + A omega sin phi = 0
    const double omega = adding->cycle.p[1];
    CHECK(1 + 0.5 * omega * std::sin(omega * adding->cycle.t[adding->node]) ==
          Approx(0).margin(1e-10));
    CHECK(word_at(traced, *adding, omega + 1e-3) == "0-");
    CHECK(word_at(traced, *adding, omega - 1e-3) == "0-0-");

    const SpecialPoint* grazing = traced.find(Kind::grazing_sliding, 2.894);
    REQUIRE(grazing);
    CHECK(grazing->cycle.p[1] == Approx(2.8942).epsilon(1e-4)); // printed with five digits
    CHECK(residual(*grazing, "L1'") < 0);
    // a border collision: the multiplier jumps, from that of the unstable orbit to the stable one's
    CHECK(grazing->border_class == "fold");
    CHECK(grazing->multipliers[0].real() > 1);
    CHECK(std::abs(grazing->multipliers_child[0]) < 1);
    CHECK(grazing->multipliers_child[1] == 0.0);
    std::vector<std::pair<double, double>> near; // distance from the point, multiplier
    for (const BranchPoint& point : traced.branch.points)
        if (point.cycle.word.string() == "0-0-")
            near.emplace_back(point.cycle.p[1] - grazing->cycle.p[1], point.multipliers[0].real());
    std::sort(near.begin(), near.end());
    REQUIRE(near.size() >= 2);
    // it moves like a square root of the distance
    const double u = std::sqrt(near[0].first), w = std::sqrt(near[1].first);
    CHECK(near[0].second - u * (near[1].second - near[0].second) / (w - u) ==
          Approx(grazing->multipliers_child[0].real()).margin(0.02));
    // both orbits end there: the branch turns back
    CHECK(traced.branch.points.front().cycle.p[1] == 2.98);
    CHECK(traced.branch.points.back().cycle.p[1] == 2.98);
    CHECK(traced.branch.special.size() == 2);
    for (const BranchPoint& point : traced.branch.points)
        CHECK(point.cycle.p[1] >= grazing->cycle.p[1] - 1e-12);
    // one end stable, the other not (figure 4.6a)
    CHECK(traced.branch.points.front().stable(true) != traced.branch.points.back().stable(true));
}

TEST_CASE("branch: crossing- and switching-sliding at A = 5", "[branch]") {
    const Traced traced = trace(5, 1.6, 1.5, 3.2);
    REQUIRE(traced.branch.special.size() == 2);
    const SpecialPoint &crossing = traced.branch.special[0], &switching = traced.branch.special[1];
    CHECK(crossing.kind == Kind::crossing_sliding);
    CHECK(crossing.cycle.p[1] == Approx(1.65768).epsilon(5e-4));
    CHECK(crossing.word_before == "-+");
    CHECK(crossing.word_after == "0-+");
    CHECK(residual(crossing, "L1'") < 0);
    CHECK(switching.kind == Kind::switching_sliding);
    CHECK(switching.cycle.p[1] == Approx(2.7992).epsilon(2e-5));
    CHECK(switching.word_before == "0-+");
    CHECK(switching.word_after == "0-");
    CHECK(switching.side == 1);
    CHECK(residual(switching, "L2'") < 0);
    for (const SpecialPoint* s : {&crossing, &switching}) {
        CHECK(s->convergence.ok());
        CHECK(std::abs(residual(*s, "h")) < 1e-12);
        CHECK(std::abs(residual(*s, s->side < 0 ? "L1" : "L2")) < 1e-12);
        CHECK(word_at(traced, *s, s->cycle.p[1] - 1e-3) == s->word_before);
        CHECK(word_at(traced, *s, s->cycle.p[1] + 1e-3) == s->word_after);
    }
}

TEST_CASE("branch: folds and what lies between them at A = 3.6", "[branch]") {
    const Traced traced = trace(3.6, 1.067, 1.0, 1.15);
    int folds = 0;
    for (const SpecialPoint& s : traced.branch.special)
        if (s.kind == Kind::fold) {
            ++folds;
            CHECK(std::abs(residual(s, "mu - 1")) < 1e-10);
        }
    CHECK(folds == 2);
    // three orbits at omega = 1.0672
    int crossings = 0;
    const auto& points = traced.branch.points;
    for (std::size_t i = 1; i < points.size(); ++i)
        crossings += (points[i - 1].cycle.p[1] - 1.0672) * (points[i].cycle.p[1] - 1.0672) < 0;
    CHECK(crossings == 3);
}

TEST_CASE("branch: twelve digits, whatever the method", "[branch]") {
    const Traced a = trace(5, 1.6, 1.5, 3.2, oscillator_system({1e-13, 1e-14}));
    const Traced b = trace(5, 1.6, 1.5, 3.2, oscillator_system_5({1e-13, 1e-14}));
    REQUIRE(a.branch.special.size() == b.branch.special.size());
    for (std::size_t i = 0; i < a.branch.special.size(); ++i)
        CHECK(a.branch.special[i].cycle.p[1] ==
              Approx(b.branch.special[i].cycle.p[1]).epsilon(1e-12));
}

TEST_CASE("branch: costs at most two thousand flows of one period", "[branch]") {
    const Traced traced = trace(0.5, 2.94, 2.84, 2.98);
    CHECK(traced.branch.corrections < 2000);
}

TEST_CASE("branch: a caller who asks to stop keeps what is finished", "[branch]") {
    const Traced whole = trace(0.5, 2.94, 2.84, 2.98);
    const Cycle start = whole.branch.points.front().cycle;
    std::size_t longest = 0, told = 0;
    Status status = Status::interrupted;
    for (int patience = 0; status == Status::interrupted; patience = 3 * patience / 2 + 1) {
        int asked = 0;
        const auto system = oscillator_system({.interrupted = [&] { return ++asked > patience; }});
        BranchTracer tracer(*system, 1, 2.84, 2.98,
                            {.progress = [&](std::size_t points) { told = points; }});
        const Branch branch = tracer.trace(start);
        status = branch.status;
        CHECK(asked < patience + 400);
        REQUIRE(branch.points.size() >= longest);
        longest = branch.points.size();
        CHECK(told == longest);
        for (const BranchPoint& point : branch.points)
            CHECK(std::abs(point.multipliers[0]) > 0); // a number
        for (const SpecialPoint& s : branch.special)
            CHECK(s.cycle.size() > 0);
    }
    CHECK(status == Status::ok);
    CHECK(longest > 40);
}

TEST_CASE("branch: a closed branch is followed once", "[branch]") {
    const Traced traced = trace(0.5, 2.94, 2.0, 4.0);
    CHECK(traced.branch.status == Status::ok);
    CHECK(traced.branch.begin == BranchEnd::closed);
    CHECK(traced.branch.end == traced.branch.begin);
    const auto& points = traced.branch.points;
    CHECK(points.front().cycle.p[1] == 2.94);
    CHECK(points.back().cycle.p[1] == 2.94);
    CHECK((points.front().multipliers[0] - points.back().multipliers[0]) == 0.0);
    // grazing- and adding-sliding on the left, a fold on the right
    REQUIRE(traced.branch.special.size() == 3);
    CHECK(traced.find(Kind::fold, 3.3)->cycle.p[1] == Approx(3.30798384).epsilon(1e-8));
    CHECK(std::abs(residual(*traced.find(Kind::fold, 3.3), "mu - 1")) < 1e-9);
}

TEST_CASE("branch: jumps of the multipliers are no flips, and nothing throws", "[branch]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 5, 1.6);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    // through folds, flips and sliding bifurcations to where Newton's iteration gives up
    for (const auto& [parameter, low, high] :
         {std::tuple{1, 0.19, 2.0}, {0, -5.0, 20.0}, {2, -1.0, 20.0}}) {
        const Branch branch =
            BranchTracer(*system, parameter, low, high, {.max_points = 400}).trace(orbit.cycle);
        CHECK(branch.points.size() > 10);
        for (const SpecialPoint& s : branch.special)
            if (s.kind == Kind::flip) {
                CHECK(std::abs(s.conditions[0].second) < 1e-9);
                CHECK(std::abs(s.multipliers[0] + 1.0) < 1e-9);
            }
    }
}

TEST_CASE("branch: A and -A are one orbit half a period apart", "[branch]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 5, 1.6);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    // down to small forces, where the block slips for ever, and up again
    const Branch branch = BranchTracer(*system, 0, -5.0, 5.0).trace(orbit.cycle);
    REQUIRE(branch.status == Status::ok);
    const std::size_t n = branch.special.size();
    REQUIRE(n == 14);
    for (std::size_t i = 0; i < n / 2; ++i) {
        const SpecialPoint &a = branch.special[i], &b = branch.special[n - 1 - i];
        CHECK(a.kind == b.kind);
        CHECK(a.word_before == b.word_after);
        CHECK(a.word_after == b.word_before);
        CHECK(a.cycle.p[0] == Approx(-b.cycle.p[0]).epsilon(1e-10));
    }
}

TEST_CASE("branch: an orbit without events that moves away from where it was", "[branch]") {
    const int parameter = GENERATE(1, 2); // along the plane in which the node moves, and across
    const Branch branch = trace_circle(parameter, -5, 5);
    CHECK(branch.status == Status::ok);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::bound);
    CHECK(branch.special.empty());
    CHECK(branch.points.size() < 500);
    for (const BranchPoint& point : branch.points) {
        const Vector x = point.cycle.x[0] - point.cycle.p.tail(2);
        CHECK(x.norm() == Approx(1).epsilon(1e-9));
        CHECK(point.cycle.period == Approx(2 * std::acos(-1.0)).epsilon(1e-9));
    }
}

TEST_CASE("branch: an orbit that shrinks to an equilibrium ends there", "[branch]") {
    const Branch branch = trace_circle(0, -1, 2);
    CHECK(branch.status == Status::ok);
    CHECK(branch.end == BranchEnd::bound);
    CHECK(branch.begin == BranchEnd::equilibrium);
    CHECK(branch.special.empty());
    CHECK(branch.points.front().cycle.p[0] == Approx(0).margin(1e-7));
    for (const BranchPoint& point : branch.points)
        CHECK(point.cycle.x[0].squaredNorm() == Approx(point.cycle.p[0]).margin(1e-10));
    CHECK(branch.points.size() < 200);
}

TEST_CASE("branch: relay feedback, both halves bifurcate at once (P7)", "[branch]") {
    const auto system = relay_system();
    const auto settled = [&](double omega) {
        Vector p = system->defaults();
        p << 0.05, omega, 1, 1, -2, 1;
        Vector x(3);
        x << 0, 0.5, 0;
        const Orbit orbit = settle(*system, p, x);
        REQUIRE(orbit.status == Status::ok);
        return orbit;
    };
    const Orbit start = settled(8);
    REQUIRE(start.cycle.word.string() == "0-0-0+0+");
    const Branch branch = BranchTracer(*system, 1, 6.9, 11).trace(start.cycle);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::bound);
    std::vector<Kind> kinds;
    for (const SpecialPoint& s : branch.special)
        kinds.push_back(s.kind);
    REQUIRE(kinds == std::vector{Kind::fold, Kind::adding_sliding, Kind::adding_sliding, Kind::fold,
                                 Kind::adding_sliding, Kind::adding_sliding});
    for (const std::size_t i : {1, 4}) {
        // one half of the orbit and the other: the same parameter, opposite sides, half a period
        // apart, and two slides more or less
        const SpecialPoint &a = branch.special[i], &b = branch.special[i + 1];
        CHECK(a.cycle.p[1] == Approx(b.cycle.p[1]).epsilon(1e-12));
        CHECK(a.side == -b.side);
        CHECK((a.cycle.x[a.node] + b.cycle.x[b.node]).norm() < 1e-9);
        CHECK(a.word_after.size() == a.word_before.size() + 4);
        CHECK(a.word_after == b.word_after);
        CHECK(std::abs(residual(a, a.side < 0 ? "1 + s" : "1 - s")) < 1e-12);
    }
    // The words of plain runs on both sides of a bifurcation of the stable part.
    const double adding = branch.special[4].cycle.p[1];
    CHECK(adding == Approx(10.2414098890).epsilon(1e-10)); // from the words of plain runs, bisected
    CHECK(settled(adding - 1e-3).cycle.word.string() == "0-0-0+0+");
    CHECK(settled(adding + 1e-3).cycle.word.string() == "0-0-0-0+0+0+");
    // The orbit attracts down to the fold, and beyond it is gone: a plain run goes elsewhere.
    const double fold = branch.special[3].cycle.p[1];
    CHECK(std::abs(residual(branch.special[3], "mu - 1")) < 1e-9);
    int stable = 0;
    for (const BranchPoint& point : branch.points)
        if (point.cycle.word.string() == "0-0-0+0+" && point.stable(system->forced()) &&
            point.cycle.p[1] < fold + 0.02) {
            ++stable;
            Vector p = point.cycle.p;
            CHECK(settle(*system, p, point.cycle.x[0]).cycle.period ==
                  Approx(point.cycle.period).epsilon(1e-9));
            p[1] = fold - 0.01;
            CHECK(settle(*system, p, point.cycle.x[0]).cycle.period < 0.9 * point.cycle.period);
        }
    CHECK(stable > 0);
}

TEST_CASE("branch: Neimark-Sacker where the damping changes its sign", "[branch]") {
    // The divergence is -2 delta on both sides and nothing jumps: det M = exp(-2 delta T) exactly.
    const auto system = bilinear_system();
    const Orbit orbit = settle(*system, system->defaults(), Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    REQUIRE(orbit.multipliers[0].imag() != 0);
    const Branch branch = BranchTracer(*system, 0, -0.1, 0.2).trace(orbit.cycle);
    REQUIRE(branch.special.size() == 1);
    const SpecialPoint& torus = branch.special[0];
    CHECK(torus.kind == Kind::neimark_sacker);
    CHECK(std::abs(torus.cycle.p[0]) < 1e-11);
    CHECK(std::abs(torus.conditions[0].second) < 1e-11);
    CHECK(std::abs(std::abs(torus.multipliers[0]) - 1) < 1e-11);
    for (const BranchPoint& point : branch.points) {
        const double det = (point.multipliers[0] * point.multipliers[1]).real();
        CHECK(det == Approx(std::exp(-2 * point.cycle.p[0] * point.cycle.period)).epsilon(1e-10));
        CHECK(point.stable(true) == (point.cycle.p[0] > 0));
    }
}

TEST_CASE("branch: nothing is missed in the last step before a bound", "[branch]") {
    const Traced low = trace(5, 1.72, 1.65, 3.2), none = trace(5, 1.72, 1.6572506, 1.8);
    CHECK(low.find(Kind::crossing_sliding, 1.657) != nullptr);
    CHECK(none.branch.special.empty());
    for (const Traced* traced : {&low, &none})
        for (const BranchPoint* end :
             {&traced->branch.points.front(), &traced->branch.points.back()}) {
            const Orbit orbit = settle(*traced->system, end->cycle.p, end->cycle.x[0]);
            CHECK(orbit.cycle.word.string() == end->cycle.word.string());
        }
    // a flip within the last step: at A = 2.45 the orbit is unstable
    const auto system = oscillator_system();
    Vector p = params_at(*system, 3, 1.72);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    const Branch branch = BranchTracer(*system, 0, 2.45, 3.5).trace(orbit.cycle);
    REQUIRE(branch.special.size() == 1);
    CHECK(branch.special[0].kind == Kind::flip);
    CHECK(branch.special[0].cycle.p[0] == Approx(2.456262616).epsilon(1e-9));
    CHECK_FALSE(branch.points.front().stable(true));
    CHECK(branch.points.back().stable(true));
}

TEST_CASE("branch: steps are never shorter than the shortest", "[branch]") {
    const auto system = oscillator_system();
    const Orbit orbit = settle(*system, params_at(*system, 0.5, 2.94), Vector::Zero(2));
    // what is behind a bifurcation is looked at with a tenth of the first step
    const Branch branch =
        BranchTracer(*system, 1, 2.84, 2.98, {.min_step = 2e-3}).trace(orbit.cycle);
    CHECK(branch.status == Status::ok);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == branch.begin);
    CHECK(branch.special.size() == 2);
    CHECK_THROWS_WITH(BranchTracer(*system, 1, 2.84, 2.98, {.first_step = 1e-8}),
                      ContainsSubstring("first_step"));
}

TEST_CASE("branch: a start that is not within the bounds is refused", "[branch]") {
    const Traced traced = trace(0.5, 2.94, 2.84, 2.98);
    const Cycle start = trace(0.5, 2.94, 2.93, 2.98).branch.points[0].cycle;
    CHECK(start.p[1] == 2.93);
    for (const auto& [low, high] : {std::pair{2.95, 3.2}, {2.0, 2.9}}) {
        BranchTracer tracer(*traced.system, 1, low, high);
        CHECK_THROWS_WITH(tracer.trace(start), ContainsSubstring("start.p[1] = 2.93"));
    }
    BranchTracer beside(*traced.system, 1, 2.95, 3.2);
    const SpecialPoint* special = traced.find(Kind::grazing_sliding, 2.9);
    REQUIRE(special != nullptr);
    CHECK_THROWS_WITH(beside.trace(*special), ContainsSubstring("start.p[1]"));
    CHECK(BranchTracer(*traced.system, 1, 2.93, 2.98).trace(start).status == Status::ok);
}

TEST_CASE("bifurcation: a test that is no number is a cause, in whatever order", "[branch]") {
    Cycle c;
    for (int i = 0; i < 6; ++i) {
        c.t.push_back(i);
        c.x.push_back(Vector::Zero(2));
        c.word.letters.push_back({i % 2 == 0 ? -1 : 1, Until::surface});
    }
    c.period = 6;
    std::vector<Test> failed;
    for (const std::size_t i : {0, 1, 2, 3, 4, 5})
        failed.push_back({Test::What::far_side, i, i == 3 ? std::nan("") : -1 - double(i), {}});
    for (int k = 0; k < 6; ++k) {
        const std::vector<Test> causes = causes_of(failed, c);
        REQUIRE(causes.size() == 3);
        CHECK(causes[0].i == 3);
        CHECK(causes[1].i == 5);
        CHECK(causes[2].i == 1);
        std::rotate(failed.begin(), failed.begin() + 1, failed.end());
    }
}

TEST_CASE("branch: different bifurcations within one step", "[branch]") {
    // near the degenerate point a slip is born in the slide (adding) and at once reaches its start
    // (crossing): the words of plain runs between them
    const Traced down = trace(4.76, 2.6, 1.5, 3.2);
    const SpecialPoint* adding = down.find(Kind::adding_sliding, 2.411);
    const SpecialPoint* crossing = down.find(Kind::crossing_sliding, 2.4055);
    REQUIRE(adding != nullptr);
    REQUIRE(crossing != nullptr);
    CHECK(adding->word_after == "0-");
    CHECK(adding->word_before == "0-0+");
    CHECK(crossing->word_before == "0-+");
    CHECK(word_at(down, *adding, adding->cycle.p[1] + 1e-3) == "0-");
    CHECK(word_at(down, *adding, adding->cycle.p[1] - 1e-3) == "0-0+");
    CHECK(word_at(down, *crossing, crossing->cycle.p[1] + 1e-3) == "0-0+");
    CHECK(word_at(down, *crossing, crossing->cycle.p[1] - 1e-3) == "0-+");

    // the same two, whatever the step
    const auto system = oscillator_system();
    Vector p = params_at(*system, 4.3, 2.3);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    for (const double max_step : {0.05, 0.02, 0.01}) {
        const Branch branch =
            BranchTracer(*system, 0, 4, 6, {.max_step = max_step}).trace(orbit.cycle);
        REQUIRE(branch.special.size() == 2);
        CHECK(branch.special[0].kind == Kind::adding_sliding);
        CHECK(branch.special[1].kind == Kind::crossing_sliding);
        CHECK(branch.special[0].cycle.p[0] == Approx(4.689174157).epsilon(1e-9));
        CHECK(branch.special[1].cycle.p[0] == Approx(4.701591259).epsilon(1e-9));
        CHECK(branch.points.back().cycle.word.string() == "0-+");
    }

    // four slides a turn, one of which vanishes while another begins: an end, whichever it is
    p[0] = 3;
    p[1] = 0.3625;
    const Orbit slow = settle(*system, p, Vector::Zero(2));
    REQUIRE(slow.status == Status::ok);
    const Branch hard = BranchTracer(*system, 0, 2.78, 3.3, {.max_points = 100}).trace(slow.cycle);
    CHECK(hard.points.size() > 10);
    for (const SpecialPoint& s : hard.special)
        CHECK(s.word_after.find("00") == std::string::npos);
}

TEST_CASE("branch: an excursion from a slide that shrinks to nothing next to where another starts",
          "[branch]") {
    // The nodes at its ends are those of the cycle's first slide, a period apart.
    const auto system = oscillator_system();
    Vector p = params_at(*system, 4.1171, 0.7655);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    const Branch branch = BranchTracer(*system, 4, 0.5, 30).trace(orbit.cycle); // over g
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::bound);
    const auto adding = std::find_if(branch.special.begin(), branch.special.end(),
                                     [](auto& s) { return s.kind == Kind::adding_sliding; });
    REQUIRE(adding != branch.special.end());
    CHECK(adding->word_before == "0-0+");
    CHECK(adding->word_after == "0-");
    // a second opinion: plain runs over a period, at every point of both words behind the last fold
    int runs = 0;
    for (const BranchPoint& point : branch.points) {
        const Cycle& c = point.cycle;
        if (std::abs(c.p[4] - adding->cycle.p[4]) > 0.03 || std::abs(point.multipliers[0]) > 0.5 ||
            point.multipliers[0].real() > 0)
            continue;
        CAPTURE(c.p[4], c.word.string());
        const History run = system->run(c.t[0], c.x[0], c.end(c.size() - 1), c.p);
        CHECK((run.x - c.x[0]).norm() < 1e-9);
        ++runs;
    }
    CHECK(runs >= 4);
}

TEST_CASE("branch: a grazing just before another that ends the word is not stepped over",
          "[branch]") {
    // 3 turns: the branch is closed; 3e-5 beyond its grazing the orbit without slides grazes
    const auto system = oscillator_system();
    Vector p = params_at(*system, 0.52568, 2.30292);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    const Branch branch = BranchTracer(*system, 0, 0.1, 4).trace(orbit.cycle);
    CHECK(branch.begin == branch.end);
    CHECK(branch.end == BranchEnd::closed);
    int grazings = 0;
    for (const SpecialPoint& s : branch.special)
        if (s.kind == Kind::grazing_sliding) {
            ++grazings;
            CHECK(s.cycle.p[0] == Approx(2.1254299585).epsilon(1e-9));
            CHECK(s.word_before == "0-0-");
            CHECK(s.word_after == "0-");
        }
    CHECK(grazings == 1);
    // every point is a solution: plain runs over a cycle, where it is not too unstable for one
    for (const BranchPoint& point : branch.points) {
        const Cycle& c = point.cycle;
        CAPTURE(c.p[0], c.word.string());
        if (std::abs(point.multipliers[0]) < 1e3) {
            const History run = system->run(c.t[0], c.x[0], c.end(c.size() - 1), c.p);
            CHECK((run.x - c.x[0]).norm() < 1e-7);
        }
    }
}

TEST_CASE("branch: from a bifurcation both ways, as from any other orbit", "[branch]") {
    struct Line {
        double A, omega;
        int parameter;
        double low, high;
    };
    for (const Line& line : {Line{5, 1.6, 0, 0.5, 12},
                             {0.5, 2.94, 1, 2.84, 2.98},
                             {5, 1.6, 1, 1, 3.2},
                             {3.6, 1.067, 1, 0.5, 2}}) {
        const auto system = oscillator_system();
        Vector p = params_at(*system, line.A, line.omega);
        const auto trace_from = [&](const auto& start, double low, double high) {
            return BranchTracer(*system, line.parameter, low, high).trace(start);
        };
        const Branch branch =
            trace_from(settle(*system, p, Vector::Zero(2)).cycle, line.low, line.high);
        REQUIRE(branch.special.size() >= 2);
        for (const SpecialPoint& s : branch.special) {
            const double value = s.cycle.p[line.parameter];
            CAPTURE(std::string(name(s.kind)), value);
            const Branch near = trace_from(s, value - 0.02, value + 0.02);
            CHECK(near.begin == BranchEnd::bound);
            CHECK(near.end == BranchEnd::bound);
            const auto here =
                std::find_if(near.special.begin(), near.special.end(), [&](const auto& other) {
                    return other.kind == s.kind &&
                           std::abs(other.cycle.p[line.parameter] - value) < 1e-9;
                });
            REQUIRE(here != near.special.end());
            CHECK((here->word_before == s.word_before || here->word_before == s.word_after));
            CHECK((here->word_after == s.word_before || here->word_after == s.word_after));
        }
    }
}

TEST_CASE("branch: a doubled orbit ends on the flip of the single one", "[branch]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 2.4032608052598086, 1.8273360523278304);
    const Orbit doubled = settle(*system, p, Vector::Zero(2));
    REQUIRE(doubled.cycle.turns == 2);
    const Branch branch = BranchTracer(*system, 0, 0.1, 8).trace(doubled.cycle);
    CHECK(branch.status == Status::ok);
    for (const SpecialPoint* end : {&branch.special.front(), &branch.special.back()}) {
        CHECK(end->kind == Kind::flip);
        CHECK(end->cycle.turns == 1);
        // the single orbit's branch has the same flip
        const Branch single = BranchTracer(*system, 0, 0.1, 8).trace(end->cycle);
        const auto same =
            std::find_if(single.special.begin(), single.special.end(), [&](const SpecialPoint& s) {
                return s.kind == Kind::flip && std::abs(s.cycle.p[0] - end->cycle.p[0]) < 1e-10;
            });
        CHECK(same != single.special.end());
    }
}

TEST_CASE("branch: three turns end on an orbit of one where that grazes", "[branch]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 1.0864180153416454, 2.4912950268095804);
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    REQUIRE(orbit.cycle.turns == 3);
    const Branch branch = BranchTracer(*system, 0, 0.1, 8).trace(orbit.cycle);
    CHECK(branch.status == Status::ok);
    for (const BranchEnd end : {branch.begin, branch.end})
        CHECK(end == BranchEnd::part_of_period);
    for (const BranchPoint& point : branch.points)
        CHECK(detail::shortest(*system, point.cycle).turns == 3);
    // the orbit of one turn grazes there
    p[0] = branch.special.front().cycle.p[0];
    const Branch single =
        BranchTracer(*system, 0, p[0] - 0.1, p[0] + 0.1)
            .trace(solve_orbit(*system,
                               detail::shortest(*system, parent_of({branch.special.front().kind,
                                                                    branch.special.front().cycle,
                                                                    branch.special.front().node,
                                                                    branch.special.front().side})))
                       .cycle);
    REQUIRE_FALSE(single.points.empty());
    CHECK(single.points.front().cycle.turns == 1);
}

TEST_CASE("branch: smooth bifurcations in one step come in their order", "[branch]") {
    const auto system = oscillator_system();
    Vector p = params_at(*system, 5, 1.6);
    BranchSettings settings;
    settings.max_points = 400;
    const Branch branch = BranchTracer(*system, 6, -0.1, 2, settings)
                              .trace(settle(*system, p, Vector::Zero(2)).cycle); // over alpha
    std::vector<Kind> late; // 1.2342: the multiplier runs from -1177 to 221 in one step
    for (const SpecialPoint& s : branch.special)
        if (std::abs(s.cycle.p[6] - 1.234230408) < 1e-7)
            late.push_back(s.kind);
    CHECK(late == std::vector{Kind::flip, Kind::fold});
}

TEST_CASE("branch: a flip just before or behind a grazing", "[branch]") {
    // A curve of flips ends on the curve of grazing-sliding at omega = 1.893093; below it there is
    // one more flip, ever nearer to the grazing, whatever the steps.
    const auto system = oscillator_system();
    for (const double omega : {1.8925, 1.89305, 1.8935}) {
        std::vector<double> found;
        for (const double max_step : {0.05, 0.003}) {
            CAPTURE(omega, max_step);
            Vector p = params_at(*system, 5, omega);
            BranchSettings settings;
            settings.max_step = max_step;
            const Branch branch = BranchTracer(*system, 0, 1.2, 5.5, settings)
                                      .trace(settle(*system, p, Vector::Zero(2)).cycle);
            int flips = 0;
            for (const SpecialPoint& s : branch.special)
                if (s.kind == Kind::flip && s.cycle.p[0] < 2) {
                    ++flips;
                    found.push_back(s.cycle.p[0]);
                    CHECK(s.convergence.ok());
                    CHECK(std::abs(s.multipliers[0] + 1.0) < 1e-6);
                }
            CHECK(flips == (omega < 1.893093 ? 1 : 0));
        }
        for (const double A : found)
            CHECK(A == Approx(found[0]).epsilon(1e-9));
    }
}

TEST_CASE(
    "branch: a doubled orbit ends on the flip of its half, and does not come back along itself",
    "[branch]") {
    // Beside that flip both halves still differ where the turn of the parameter is looked for.
    const auto [A, omega] = GENERATE(std::pair{1.5, 1.86}, std::pair{2.27, 1.43});
    const auto [branch, system] = trace(A, omega, 0.75 * omega, 1.3 * omega);
    INFO("A = " << A << ", omega = " << omega << ": " << message(branch.begin) << ", "
                << message(branch.end));
    CHECK((branch.begin == BranchEnd::half_period || branch.end == BranchEnd::half_period));
    int halves = 0;
    for (const SpecialPoint& s : branch.special) {
        INFO(name(s.kind) << " at " << s.cycle.p[1]);
        CHECK(s.convergence.ok());
        if (s.kind == Kind::flip && s.cycle.turns == 1) {
            ++halves;
            CHECK(std::abs(residual(s, "det(M + 1)")) < 1e-8);
        }
        // each bifurcation is passed once
        CHECK(std::count_if(branch.special.begin(), branch.special.end(), [&](const auto& other) {
                  return other.kind == s.kind && other.cycle.turns == s.cycle.turns &&
                         std::abs(other.cycle.p[1] - s.cycle.p[1]) < 1e-9;
              }) == 1);
    }
    CHECK(halves >= 1);
}

TEST_CASE(
    "branch: an orbit that grazes goes on without touching, and the branch does not turn back",
    "[branch]") {
    const auto system = any_system(Belt{});
    const double dip = GENERATE(0.0, 0.3);
    Vector p = system->defaults();
    p[3] = dip;
    const Orbit orbit = settle(*system, p, Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    const auto check = [&](const Branch& branch) {
        CHECK(branch.status == Status::ok);
        CHECK(branch.begin == BranchEnd::bound);
        CHECK(branch.end == BranchEnd::bound);
        CHECK(std::min(branch.points.front().cycle.p[2], branch.points.back().cycle.p[2]) == 0.5);
        CHECK(std::max(branch.points.front().cycle.p[2], branch.points.back().cycle.p[2]) == 3);
        int grazings = 0;
        for (const SpecialPoint& s : branch.special) {
            CAPTURE(name(s.kind), s.cycle.p[2]);
            // each bifurcation is passed once
            CHECK(std::count_if(branch.special.begin(), branch.special.end(),
                                [&](const SpecialPoint& other) {
                                    return other.kind == s.kind &&
                                           std::abs(other.cycle.p[2] - s.cycle.p[2]) < 1e-9;
                                }) == 1);
            if (s.kind != Kind::grazing_sliding)
                continue;
            ++grazings;
            CHECK((s.word_before == "-" || s.word_after == "-"));
            // a linear oscillator where the friction is constant: its amplitude is the belt's speed
            const double om = s.cycle.p[2];
            if (dip == 0)
                CHECK(0.5 * om / std::hypot(1 - om * om, 0.05 * om) == Approx(0.5).epsilon(1e-9));
        }
        CHECK(grazings == 2);
        // a second opinion where nothing touches: a run over a period
        for (const BranchPoint& point : branch.points) {
            const Cycle& c = point.cycle;
            const bool grazes = std::any_of(
                branch.special.begin(), branch.special.end(),
                [&](const SpecialPoint& s) { return std::abs(s.cycle.p[2] - c.p[2]) < 1e-9; });
            if (c.word.string() != "-" || grazes)
                continue;
            const History run = system->run(c.t[0], c.x[0], c.end(0), c.p);
            CHECK((run.x - c.x[0]).norm() < 1e-8);
            CHECK(std::none_of(run.events.begin(), run.events.end(),
                               [](const Happening& e) { return e.before != e.after; }));
        }
    };
    const Branch branch = BranchTracer(*system, 2, 0.5, 3).trace(orbit.cycle);
    check(branch);
    for (const SpecialPoint& s : branch.special)
        if (s.kind == Kind::grazing_sliding)
            check(BranchTracer(*system, 2, 0.5, 3).trace(s));
}

TEST_CASE("branch: a closed branch is followed once from each of its bifurcations", "[branch]") {
    const Traced traced = trace(0.5, 2.94, 2.0, 4.0);
    REQUIRE(traced.branch.special.size() == 3);
    for (const SpecialPoint& s : traced.branch.special) {
        CAPTURE(name(s.kind));
        const Branch branch = BranchTracer(*traced.system, 1, 2.0, 4.0).trace(s);
        CHECK(branch.status == Status::ok);
        CHECK(branch.end == BranchEnd::closed);
        CHECK(branch.begin == branch.end);
        CHECK(branch.points.front().cycle.p[1] == branch.points.back().cycle.p[1]);
        CHECK(double(branch.points.size()) < 1.5 * double(traced.branch.points.size()));
        std::vector<double> once, all;
        for (const SpecialPoint& other : branch.special)
            once.push_back(other.cycle.p[1]);
        for (const SpecialPoint& other : traced.branch.special)
            all.push_back(other.cycle.p[1]);
        std::sort(once.begin(), once.end());
        std::sort(all.begin(), all.end());
        REQUIRE(once.size() == all.size());
        for (std::size_t i = 0; i < all.size(); ++i)
            CHECK(once[i] == Approx(all[i]).epsilon(1e-9));
    }
}

TEST_CASE("branch: a grazing where both fields cross alike is passed from both sides", "[branch]") {
    const auto system = any_system(Buck{});
    Vector p = system->defaults(), x(2);
    const Orbit above = settle(*system, p, Vector::Zero(2));
    REQUIRE(above.cycle.word.string() == "-+");
    REQUIRE(above.cycle.turns == 3);
    p[0] = 20.822354;
    x << 12.31664, 0.57491; // a fixed point of three turns, from Newton's iteration on plain runs
    const Orbit below = orbit_near(*system, p, 0, x, 3);
    REQUIRE(below.cycle.word.string() == "-+-+");

    const auto trace_from = [&](const auto& start) {
        return BranchTracer(*system, 0, 20, 60).trace(start);
    };
    const Branch branch = trace_from(above.cycle);
    std::vector<Branch> all{branch, trace_from(below.cycle)};
    for (const SpecialPoint& s : branch.special)
        if (s.kind == Kind::grazing)
            all.push_back(trace_from(s));
    REQUIRE(all.size() == 7);
    const auto places = [](const Branch& b) {
        std::vector<double> sorted;
        for (const SpecialPoint& s : b.special)
            sorted.push_back(s.cycle.p[0]);
        std::sort(sorted.begin(), sorted.end());
        return sorted;
    };
    const double trace_of_field = -1 / (22 * 0.047); // i does not act on its own rate
    for (const Branch& b : all) {
        CHECK(b.status == Status::ok);
        CHECK(b.begin == BranchEnd::bound);
        CHECK(b.end == BranchEnd::bound);
        CHECK_THAT(places(b), Catch::Matchers::Approx(places(branch)).epsilon(1e-8));
        for (const BranchPoint& point : b.points) {
            const Cycle& c = point.cycle;
            CAPTURE(c.p[0], c.word.string());
            // a run leaves an unstable orbit
            if (!(std::abs(point.multipliers[0]) < 1e3))
                continue;
            // Nothing jumps but the curvature: det M = exp(3 T tr A) exactly. The small multiplier
            // is known to rounding of the large one, their product to rounding of its square.
            if (std::abs(point.multipliers[0]) < 30)
                CHECK((point.multipliers[0] * point.multipliers[1]).real() ==
                      Approx(std::exp(1.2 * trace_of_field)).epsilon(1e-8));
            const History run = system->run(c.t[0], c.x[0], c.end(c.size() - 1), c.p);
            CHECK((run.x - c.x[0]).norm() < 1e-7);
        }
    }
    const auto first =
        std::find_if(branch.special.begin(), branch.special.end(), [](const SpecialPoint& s) {
            return std::abs(s.cycle.p[0] - 20.8323542) < 1e-7;
        });
    REQUIRE(first != branch.special.end());
    CHECK(first->kind == Kind::grazing);
    CHECK(first->word_before == "-+-+");
    CHECK(first->word_after == "-+");
    CHECK(std::abs(residual(*first, "h")) < 1e-12);
    CHECK(std::abs(residual(*first, "L1")) < 1e-10);
    CHECK(std::abs(residual(*first, "L2")) < 1e-10);
    CHECK(residual(*first, "L1'") < 0); // from below, and back from above
    CHECK(residual(*first, "L2'") < 0);
    CHECK(first->multipliers_child.empty());
    for (const auto& [key, value] : first->conditions)
        CHECK(std::isfinite(value));
}

TEST_CASE("branch: where a touch leads away for good, no slide and no end of all orbits is claimed",
          "[branch]") {
    // Forced, below a surface above which everything is thrown upwards.
    const auto system = any_system(Thrown{});
    const Orbit orbit = settle(*system, system->defaults(), Vector::Zero(2));
    REQUIRE(orbit.status == Status::ok);
    Cycle start = orbit.cycle;
    const Branch branch = BranchTracer(*system, 0, 0.1, 2).trace(start);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::no_orbit);
    REQUIRE(branch.special.size() == 1);
    CHECK(branch.special[0].kind == Kind::grazing);
    // x'' + x' + x = A cos t is A sin t
    CHECK(branch.special[0].cycle.p[0] == Approx(1).epsilon(1e-10));
}

TEST_CASE("branch: a component that is zero at all events is no smaller between them", "[branch]") {
    const auto system = any_system(SlowBelt{});
    std::vector<double> places;
    for (const double V : {0.0, 0.1, 0.5}) {
        CAPTURE(V);
        Vector p = system->defaults(), x(2);
        p[0] = V;
        x << 0.3, 0.1;
        const Branch branch = BranchTracer(*system, 0, 0, 2).trace(settle(*system, p, x).cycle);
        CHECK(branch.begin == BranchEnd::bound);
        CHECK(branch.end == BranchEnd::bound);
        CHECK(branch.points.size() < 100);
        REQUIRE(branch.special.size() == 1);
        CHECK(branch.special[0].kind == Kind::crossing_sliding);
        places.push_back(branch.special[0].cycle.p[0]);
    }
    for (const double place : places)
        CHECK(place == Approx(places[0]).epsilon(1e-11));
}

TEST_CASE("branch: derivatives down to rounding are not stiff", "[branch]") {
    // Along the circle, which attracts strongly, neighbours become one.
    const auto system = any_system(Ring{});
    Vector p = system->defaults(), x(2);
    x << 0.1, 0;
    const Branch branch = BranchTracer(*system, 0, 0.5, 3).trace(settle(*system, p, x).cycle);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::bound);
    p[0] = 1.9;
    const Orbit other = settle(*system, p, x);
    const BranchPoint* last = nullptr;
    for (const BranchPoint& point : branch.points) { // the period grows with m
        if (last != nullptr)
            CHECK((point.cycle.period > last->cycle.period) ==
                  (point.cycle.p[0] > last->cycle.p[0]));
        if (point.cycle.p[0] < 1.9)
            CHECK(point.cycle.period < other.cycle.period);
        last = &point;
    }
}

TEST_CASE("branch: an orbit that comes to an equilibrium ends with its period", "[branch]") {
    // Below some g the slide along y = g ends at an equilibrium: where the fields are parallel
    // there, m (1 - x^2 - g^2) (x + 0.3 g) - g + 0.3 x = 0 first has a root, which is double.
    const auto system = any_system(Ring{});
    for (const auto& [m, fold] : {std::pair(0.5, 0.364104031464), std::pair(2.5, 0.683672390718)}) {
        CAPTURE(m);
        Vector p = system->defaults(), x(2);
        p[0] = m;
        x << 0.1, 0;
        const Branch branch =
            BranchTracer(*system, 1, 0.1, 0.95).trace(settle(*system, p, x).cycle);
        CHECK(branch.status == Status::ok);
        CHECK(branch.begin == BranchEnd::homoclinic);
        CHECK(branch.end == BranchEnd::bound);
        CHECK(branch.points.size() < 400);
        // near a fold of equilibria g goes as 1 / T^2
        const Cycle &last = branch.points.front().cycle, &other = branch.points[40].cycle;
        CHECK(last.p[1] - fold > 0);
        CHECK((last.p[1] - fold) * last.period * last.period ==
              Approx((other.p[1] - fold) * other.period * other.period).epsilon(0.05));
    }
}

TEST_CASE(
    "branch: where nodes stand still, and nothing waits, the period does not grow without bound",
    "[branch]") {
    const auto system = any_system(Canard{});
    Vector x(2);
    x << 2, 0;
    const Orbit orbit = settle(*system, system->defaults(), x);
    REQUIRE(orbit.status == Status::ok);
    const Branch branch = BranchTracer(*system, 0, 0.8, 1.1).trace(orbit.cycle);
    for (const BranchEnd end : {branch.begin, branch.end}) {
        CHECK(end != BranchEnd::homoclinic);
        CHECK(end != BranchEnd::half_period);
        CHECK(end != BranchEnd::part_of_period);
        CHECK(end != BranchEnd::point);
    }
}

TEST_CASE("branch: a touch soon after a crossing is seen late, but it is seen", "[branch]") {
    // 4e-5 later what was born in it, a visit of a hundredth of a period, begins in a slide.
    const auto system = any_system(Weakening{});
    const Vector p = system->defaults(), x = Vector::Zero(2);
    const Branch branch = BranchTracer(*system, 0, 2.5, 2.9).trace(settle(*system, p, x).cycle);
    CHECK(branch.status == Status::ok);
    REQUIRE(branch.special.size() == 3);
    CHECK(branch.special[0].kind == Kind::grazing_sliding);
    CHECK(branch.special[1].kind == Kind::switching_sliding);
    CHECK(branch.special[2].kind == Kind::flip);
    const double graze = branch.special[0].cycle.p[0], entry = branch.special[1].cycle.p[0];
    CHECK(entry - graze == Approx(3.9e-5).epsilon(0.02));
    for (const BranchPoint& point : branch.points)
        if (point.cycle.word.string() == "0-+-+")
            CHECK(point.cycle.p[0] <= graze);
    // what solutions settle on says the same
    const auto word_at = [&](double A) {
        return settle(*system, Vector::Constant(1, A), x).cycle.word.string();
    };
    CHECK(word_at(graze - 5e-6) == branch.special[0].word_before);
    CHECK(word_at(graze + 5e-6) == branch.special[0].word_after);
    CHECK(word_at(entry - 5e-6) == branch.special[1].word_before);
    CHECK(word_at(entry + 5e-6) == branch.special[1].word_after);
}

TEST_CASE("branch: a relay whose lead ends its oscillation", "[branch]") {
    // For fast oscillations the loop is (1 + b s) / (s + 1)^3: its phase reaches -pi, to first
    // order in 1 / omega, where 3 = 1 / b.
    const auto system = any_system(Lead{});
    Vector x(3);
    x << 0.1, 0.1, 0;
    const Branch branch =
        BranchTracer(*system, 0, 0, 1).trace(settle(*system, system->defaults(), x).cycle);
    CHECK(branch.status == Status::ok);
    CHECK(branch.begin == BranchEnd::bound);
    CHECK(branch.end == BranchEnd::point);
    const Cycle& last = branch.points.back().cycle;
    CHECK(last.p[0] == Approx(1.0 / 3).margin(1e-5));
    CHECK(last.period < 0.05);
}

TEST_CASE("branch: a symmetric orbit begins to stick in both halves, from wherever", "[branch]") {
    const auto system = any_system(SlowBelt{});
    for (const double F : {1.9, 2.0, 2.1}) {
        CAPTURE(F);
        Vector p = system->defaults(), x(2);
        p[1] = F;
        x << 0.3, 0.1;
        const Branch branch = BranchTracer(*system, 1, 0.3, 4).trace(settle(*system, p, x).cycle);
        CHECK(branch.end == BranchEnd::bound);
        std::vector<double> places;
        for (const SpecialPoint& s : branch.special)
            if (s.kind == Kind::crossing_sliding)
                places.push_back(s.cycle.p[1]);
        REQUIRE(places.size() == 2);
        CHECK(places[0] == Approx(places[1]).epsilon(1e-11));
        CHECK(branch.special.back().word_before == "0-0+");
        CHECK(branch.special.back().word_after == "-+");
    }
}
