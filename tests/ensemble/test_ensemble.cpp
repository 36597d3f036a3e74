// SPDX-License-Identifier: BSD-3-Clause
// Ensembles in lanes: the same bits whatever runs beside a member, and the answers of `flow`.

#include "ensembles.hpp"

#include <filippov/models/belt.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/relay.hpp>

#include <concepts>
#include <numeric>

using namespace ensembles;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Planar systems drawn by their parameters, period 2 pi / omega:
///
///   x' = v,  v' = -x - c v - d v^3 + a cos(omega t) + b sin(2 x) + e x v -+ (m + n cos x)
///
/// and h = v - V: it knows its slides.
struct Drawn {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 11> params{"c", "d", "a", "b", "e", "m",
                                                             "n", "V", "w", "r", "q"};
    using P = Vec<double, 11>;

    template <Scalar S>
    static Vec<S, 2> field(const S& t, const Vec<S, 2>& x, const Vec<S, 11>& p, const S& s) {
        using elementary::cos;
        using elementary::sin;
        const S& v = x[1];
        return {v, p[2] * cos(p[8] * t) - x[0] - p[0] * v - p[1] * v * v * v +
                       p[3] * sin(x[0] + x[0]) + p[4] * x[0] * v - s * (p[5] + p[6] * cos(x[0]))};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 11>& p) const {
        return field(t, x, p, S(-1));
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 11>& p) const {
        return field(t, x, p, S(1));
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 11>& p) const {
        return x[1] - p[7];
    }
    template <Scalar S> Vec<S, 2> grad_h(const S&, const Vec<S, 2>&, const Vec<S, 11>&) const {
        return {S(0), S(1)};
    }
    template <Scalar S> S h_t(const S&, const Vec<S, 2>&, const Vec<S, 11>&) const { return S(0); }
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 11>& p, const S& dt) const {
        return {x[0] + p[7] * dt, p[7]};
    }
    template <Scalar S> S period(const Vec<S, 11>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[8];
    }
};
/// The same fields and a surface that is curved and moves; it knows nothing else.
struct DrawnCurved {
    static constexpr int dim = 2;
    static constexpr auto params = Drawn::params;

    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 11>& p) const {
        return Drawn::field(t, x, p, S(-1));
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 11>& p) const {
        return Drawn::field(t, x, p, S(1));
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 11>& p) const {
        using elementary::cos;
        return x[1] - p[7] - p[9] * x[0] * x[0] - p[10] * cos(p[8] * t);
    }
    template <Scalar S> S period(const Vec<S, 11>& p) const {
        return S(6.283185307179586476925286766559005768L) / p[8];
    }
};

/// ... and holds on beyond |s| = 1.
struct DrawnSticky : DrawnCurved {
    template <Scalar S> S s_max(const Vec<S, 11>&) const { return S(1.3); }
};
/// The same, known for doubles only.
struct DrawnStickyOnly : DrawnCurved {
    double s_max(const Vec<double, 11>&) const { return 1.3; }
};

Drawn::P draw(Random& random) {
    Drawn::P p;
    p << random(0.02, 0.3), random(0, 0.1), random(0, 3), random(-0.4, 0.4), random(-0.2, 0.2),
        random(0.3, 2), random(-0.25, 0.25), random(-0.8, 0.8), random(0.6, 2), random(-0.2, 0.2),
        random(-0.4, 0.4);
    return p;
}

static_assert(RunsInLanes<Drawn> && RunsInLanes<DrawnCurved> && HasSMax<DrawnSticky, Lanes<8>>);
static_assert(!RunsInLanes<models::DieciLopez2>);
static_assert(HasSMax<DrawnStickyOnly, double> && !RunsInLanes<DrawnStickyOnly>);

// --- ensembles ---------------------------------------------------------------------------------

Members<Oscillator> many_parameters(int n, double periods) {
    Members<Oscillator> m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const auto p = forced(0.2 + 4.0 * i / n, 0.7 + 2.0 * j / n);
            m.push_back({{0.1, 1.0}, p, 0, periods * period_of(p)});
        }
    return m;
}
Members<models::Coulomb> coulomb(int n) {
    Members<models::Coulomb> m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            m.push_back({{-4 + 8 * (i + 0.5) / n, -3 + 6 * (j + 0.5) / n},
                         {0.4, 0.3, 0.5 + 0.4 * j / n},
                         0,
                         30});
    return m;
}
Members<models::Stiction> stiction(int n) {
    Members<models::Stiction> m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            m.push_back({{-4 + 8 * (i + 0.5) / n, -3 + 6 * (j + 0.5) / n},
                         default_params<models::Stiction>(),
                         0.1 * j,
                         20});
    return m;
}
Members<models::Relay> relay(int n) {
    Members<models::Relay> m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            m.push_back({{-0.1 + 0.2 * (i + 0.5) / n, -0.1 + 0.2 * (j + 0.5) / n, -0.02},
                         default_params<models::Relay>(),
                         0,
                         4});
    return m;
}
/// A surface that moves, and a slide with a field that is not constant.
Members<models::VaryingBelt> belt(int n) {
    Members<models::VaryingBelt> m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            m.push_back({{-2 + 4 * (i + 0.5) / n, -2 + 5 * (j + 0.5) / n},
                         {0.4, 0.7, 0.4 + 0.8 * i / n, 0.7},
                         0.3 * j,
                         0.3 * j + 20});
    return m;
}
template <class Sys> Members<Sys> drawn(std::size_t n, double periods) {
    Random random(21);
    Members<Sys> m;
    for (std::size_t k = 0; k < n; ++k) {
        const Drawn::P p = draw(random);
        const double t0 = random(-20, 20);
        m.push_back({{random(-3, 3), random(-3, 3)}, p, t0, t0 + periods * Drawn{}.period(p)});
    }
    return m;
}

/// Members whose bits depend on lanes, threads or order.
template <class Tableau, int... W, class Sys>
int differing(const Sys& sys, const Members<Sys>& members, double each) {
    const auto settings = tolerance<Sys>(each);
    const auto one = run<Tableau, 1>(sys, members, settings);
    int n = 0;
    const auto compare = [&](const auto& other, const auto& where) {
        for (std::size_t i = 0; i < members.size(); ++i)
            n += !same(one.outcomes[i], other.outcomes[where(i)]);
    };
    const auto in_place = [](std::size_t i) { return i; };
    (compare(run<Tableau, W>(sys, members, settings, 1 + W / 4), in_place), ...);
    // another order, and fewer of them
    constexpr int widest = std::max({W...});
    std::vector<std::size_t> order(members.size()), place(members.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    Random random(3);
    for (std::size_t i = order.size(); i > 1; --i)
        std::swap(order[i - 1], order[random.below(i)]);
    Members<Sys> shuffled, some;
    for (std::size_t i = 0; i < order.size(); ++i) {
        shuffled.push_back(members[order[i]]);
        place[order[i]] = i;
        if (i % 7 == 0)
            some.push_back(members[i]);
    }
    compare(run<Tableau, widest>(sys, shuffled, settings, 2), [&](auto i) { return place[i]; });
    const auto few = run<Tableau, widest>(sys, some, settings);
    for (std::size_t i = 0; i < some.size(); ++i)
        n += !same(one.outcomes[7 * i], few.outcomes[i]);
    return n;
}

/// An ensemble against `flow`, and both against a run at 1e-13 where they disagree.
struct Agreement {
    int statuses = 0;      ///< members with another status
    int lanes_wrong = 0;   ///< another count, or more than the margin apart: the lanes' fault
    int flow_wrong = 0;    ///< ... the scalar engine's
    double worst = 0;      ///< largest distance where they agree, units of the tolerance
    double worst_time = 0; ///< of the time in slides, units of the tolerance
    double periods_handed_over = 0; ///< hand-overs a member
};
template <class Tableau, class Sys>
Agreement agreement(const Sys& sys, const Members<Sys>& members, double each, double margin) {
    const auto settings = tolerance<Sys>(each);
    const auto r = run<Tableau, 8>(sys, members, settings, 2);
    Agreement a;
    a.periods_handed_over = double(r.counters.handed_over) / double(members.size());
    for (std::size_t i = 0; i < members.size(); ++i) {
        const auto &o = r.outcomes[i], s = by_flow<Tableau>(sys, members[i], settings);
        a.statuses += o.status != s.status;
        const auto apart = [](const auto& u, const auto& v) {
            return (u.x - v.x).cwiseAbs().maxCoeff();
        };
        const auto agree = [&](const auto& u, const auto& v) {
            return u.events == v.events && u.slides == v.slides && apart(u, v) <= margin * each;
        };
        if (agree(o, s)) {
            a.worst = std::max(a.worst, apart(o, s) / each);
            a.worst_time = std::max(a.worst_time, std::abs(o.slide_time - s.slide_time) / each);
            continue;
        }
        const auto exact =
            by_flow<DormandPrince8>(sys, members[i], tolerance<Sys>(std::min(1e-13, each)));
        a.lanes_wrong += !agree(o, exact);
        a.flow_wrong += !agree(s, exact);
        UNSCOPED_INFO("member " << i << ": lanes " << o.events << "/" << o.slides << ", flow "
                                << s.events << "/" << s.slides << ", exact " << exact.events << "/"
                                << exact.slides << ", errors " << apart(o, exact) / each << " and "
                                << apart(s, exact) / each);
    }
    return a;
}

} // namespace

TEST_CASE("ensemble: no bit depends on lanes, threads or neighbours: the oscillator",
          "[ensemble]") {
    const Oscillator sys;
    CHECK(differing<DormandPrince8, 2, 4, 8>(sys, grid(20, 3), 1e-8) == 0);
    CHECK(differing<DormandPrince5, 8>(sys, grid(20, 3), 1e-5) == 0);
    CHECK(differing<DormandPrince5, 2, 8>(sys, grid(16, 1), 1e-10) == 0);
    CHECK(differing<DormandPrince8, 2, 4, 8>(sys, many_parameters(20, 5), 1e-8) == 0);
}

TEST_CASE("ensemble: no bit depends on lanes, threads or neighbours: other systems", "[ensemble]") {
    CHECK(differing<DormandPrince8, 8>(models::Coulomb{}, coulomb(20), 1e-8) == 0);
    CHECK(differing<DormandPrince8, 8>(models::Stiction{}, stiction(16), 1e-8) == 0);
    CHECK(differing<DormandPrince8, 8>(models::Relay{}, relay(6), 1e-7) == 0);
    CHECK(differing<DormandPrince8, 8>(Drawn{}, drawn<Drawn>(300, 4), 1e-7) == 0);
    CHECK(differing<DormandPrince5, 8>(DrawnCurved{}, drawn<DrawnCurved>(300, 4), 1e-6) == 0);
}

TEST_CASE("ensemble: no bit depends on lanes, threads or neighbours: slides of any kind",
          "[ensemble]") {
    CHECK(differing<DormandPrince8, 2, 4, 8>(Unsolved<Oscillator>{}, grid(20, 3), 1e-8) == 0);
    CHECK(differing<DormandPrince8, 8>(Unsolved<models::Stiction>{}, stiction(16), 1e-8) == 0);
    CHECK(differing<DormandPrince8, 8>(models::VaryingBelt{}, belt(16), 1e-8) == 0);
    CHECK(differing<DormandPrince5, 8>(DrawnSticky{}, drawn<DrawnSticky>(300, 4), 1e-6) == 0);
}

// Margins: a hundred tolerances, which the slowest contacts of these ensembles need; most members
// agree within ten.
TEST_CASE("ensemble: agrees with flow: models", "[ensemble]") {
    const double each = GENERATE(1e-4, 1e-6, 1e-8, 1e-10);
    CAPTURE(each);
    const auto check = [&](const Agreement& a, int sensitive = 0) {
        CHECK(a.statuses == 0);
        CHECK(a.lanes_wrong <= sensitive);
        CHECK(a.flow_wrong <= sensitive);
        CHECK(a.worst_time <= 300); // errors of states over the speed of contact
    };
    check(agreement<DormandPrince8>(Oscillator{}, grid(16, 3), each, 100));
    check(agreement<DormandPrince5>(Oscillator{}, grid(16, 3), each, 100));
    check(agreement<DormandPrince8>(Oscillator{}, many_parameters(16, 5), each, 100));
    check(agreement<DormandPrince8>(models::Coulomb{}, coulomb(16), each, 100));
    check(agreement<DormandPrince8>(models::Stiction{}, stiction(16), each, 100));
    check(agreement<DormandPrince8>(Unsolved<Oscillator>{}, grid(16, 3), each, 100));
    check(agreement<DormandPrince5>(Unsolved<Oscillator>{}, grid(16, 3), each, 100));
    check(agreement<DormandPrince8>(Unsolved<models::Stiction>{}, stiction(16), each, 100));
    check(agreement<DormandPrince8>(models::VaryingBelt{}, belt(16), each, 100));
    // At 1e-4 visits to the surface by 7e-6 are missed: slides of 0.002, members 30, 32, 33,
    // 34, 45.
    check(agreement<DormandPrince8>(models::Relay{}, relay(8), each, 100), each > 1e-5 ? 5 : 0);
}

TEST_CASE("ensemble: agrees with flow: random systems", "[ensemble]") {
    const double each = GENERATE(1e-4, 1e-6, 1e-8, 1e-10);
    CAPTURE(each);
    const auto check = [&](const Agreement& a, int sensitive) {
        CHECK(a.statuses == 0);
        CHECK(a.lanes_wrong <= sensitive);
        CHECK(a.flow_wrong <= sensitive);
        CHECK(a.worst_time <= 300); // errors of states over the speed of contact
    };
    check(agreement<DormandPrince8>(Drawn{}, drawn<Drawn>(300, 4), each, 100), 0);
    // At 1e-4 steps of the fifth-order pair are too long for its estimate: member 119, which never
    // slides, errs by 161 tolerances.
    const int coarse = each > 1e-5 ? 1 : 0;
    check(agreement<DormandPrince5>(Drawn{}, drawn<Drawn>(300, 4), each, 100), coarse);
    // Member 240 multiplies errors by some thousand; both engines are off by 600 tolerances and
    // more.
    check(agreement<DormandPrince8>(DrawnCurved{}, drawn<DrawnCurved>(300, 4), each, 100), 1);
    check(agreement<DormandPrince5>(DrawnCurved{}, drawn<DrawnCurved>(300, 4), each, 100), 1);
    check(agreement<DormandPrince8>(DrawnSticky{}, drawn<DrawnSticky>(300, 4), each, 100), 1);
    check(agreement<DormandPrince5>(Unsolved<Drawn>{}, drawn<Unsolved<Drawn>>(300, 4), each, 100),
          coarse);
}

namespace {

/// A block that rests: mu g = 0.4 cos t, which turns negative at pi/2.
struct Brake {
    static constexpr int dim = 2;
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        using std::cos;
        return {x[1], S(0.4) * cos(t)};
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        using std::cos;
        return {x[1], S(-0.4) * cos(t)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 0>&, const S&) const {
        return x;
    }
};

} // namespace

TEST_CASE("ensemble: a slide in closed form ends where the surface ceases to attract",
          "[ensemble]") {
    const Members<Brake> members(3, {Vec<double, 2>(0, 0), Vec<double, 0>(), 0, 3});
    const auto ends = ensembles::run(Brake{}, members, ensembles::tolerance<Brake>(1e-9));
    for (const auto& o : ends.outcomes) {
        CHECK(o.status == Status::ambiguous);
        CHECK(o.clock.absolute() == Approx(1.5707963267948966));
    }
}

namespace {

/// x' = x^2 is gone at t = 1.
struct BlowUp {
    static constexpr int dim = 1;
    template <Scalar S> Vec<S, 1> f1(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        return Vec<S, 1>(x[0] * x[0]);
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>& x, const Vec<S, 0>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const {
        return -S(1) - x[0];
    }
};

} // namespace

TEST_CASE("ensemble: a blow-up ends as it does by flow", "[ensemble]") {
    const Members<BlowUp> members(3, {Vec<double, 1>(1), Vec<double, 0>(), 0, 2});
    for (const double each : {1e-6, 1e-9, 1e-12})
        for (const auto& o :
             ensembles::run(BlowUp{}, members, ensembles::tolerance<BlowUp>(each)).outcomes) {
            CHECK(o.status == Status::step_too_small);
            CHECK(o.clock.absolute() == Approx(1));
        }
}

TEST_CASE("ensemble: hardly ever hands members over", "[ensemble]") {
    const auto share = [](const auto& sys, const auto& members, double each, double periods) {
        using Sys = std::decay_t<decltype(sys)>;
        const auto r = run<DormandPrince8>(sys, members, tolerance<Sys>(each));
        return double(r.counters.handed_over) / (periods * double(members.size()));
    };
    // a share of the periods; where a time scale is not a period, of ten units of time
    CHECK(share(Oscillator{}, grid(20, 20), 1e-6, 20) < 0.01);
    CHECK(share(Oscillator{}, grid(20, 20), 1e-8, 20) < 0.02);
    CHECK(share(Oscillator{}, many_parameters(20, 5), 1e-8, 5) < 0.02);
    CHECK(share(models::Coulomb{}, coulomb(20), 1e-6, 3) < 0.01);
    CHECK(share(models::Coulomb{}, coulomb(20), 1e-8, 3) < 0.01);
    CHECK(share(models::Stiction{}, stiction(20), 1e-8, 2) < 0.01);
    CHECK(share(Drawn{}, drawn<Drawn>(400, 4), 1e-6, 4) < 0.02);
    // slides that are not known in closed form
    CHECK(share(Unsolved<Oscillator>{}, grid(20, 20), 1e-6, 20) < 0.01);
    CHECK(share(Unsolved<Oscillator>{}, grid(20, 20), 1e-8, 20) < 0.02);
    CHECK(share(Unsolved<models::Stiction>{}, stiction(20), 1e-8, 2) < 0.01);
    CHECK(share(models::VaryingBelt{}, belt(16), 1e-8, 2) < 0.02);
    CHECK(share(models::Relay{}, relay(20), 1e-8, 0.4) < 0.05); // h is not said to be linear
    CHECK(share(Unsolved<Drawn>{}, drawn<Unsolved<Drawn>>(400, 4), 1e-6, 4) < 0.02);
    CHECK(share(DrawnCurved{}, drawn<DrawnCurved>(400, 4), 1e-6, 4) < 0.02);
    CHECK(share(DrawnSticky{}, drawn<DrawnSticky>(400, 4), 1e-6, 4) < 0.02);
}

namespace {

/// The oscillator in units of h, and seen from a frame of which its belt is far from the origin:
/// h = size (v - V), and v is `afar` larger.
struct Seen {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr auto params = Oscillator::params;
    double size = 1, afar = 0;

    template <class S> Vec<S, 2> near(const Vec<S, 2>& x) const { return {x[0], x[1] - S(afar)}; }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return Oscillator{}.f1(t, near(x), p);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return Oscillator{}.f2(t, near(x), p);
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return S(size) * Oscillator{}.h(t, near(x), p);
    }
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 10>& p, const S& dt) const {
        return {x[0] + p[5] * dt, p[5] + S(afar)};
    }
    template <Scalar S> S period(const Vec<S, 10>& p) const { return Oscillator{}.period(p); }
};
Members<Seen> seen(const Seen& from, int n, double periods) {
    Members<Seen> m;
    for (const auto& member : grid(n, periods)) {
        m.push_back({member.x, member.p, member.t0, member.t_end});
        m.back().x[1] += from.afar;
    }
    return m;
}

} // namespace

// Steps of a small tolerance are short. How plain an event is does not depend on that.
TEST_CASE("ensemble: hands over as few members at small tolerances", "[ensemble]") {
    const double each = GENERATE(1e-4, 1e-7, 3e-10, 1e-10, 1e-12);
    CAPTURE(each);
    const auto share = [&]<class Tableau>(Tableau, const auto& sys, const auto& members) {
        using Sys = std::decay_t<decltype(sys)>;
        const auto r = run<Tableau>(sys, members, tolerance<Sys>(each));
        return double(r.counters.handed_over) / double(members.size());
    };
    const Seen tiny{1e-9, 0}, afar{1, 1e4};
    const auto check = [&]<class Tableau>(Tableau method) {
        CHECK(share(method, Oscillator{}, grid(20, 1)) < 0.01);
        CHECK(share(method, Unsolved<Oscillator>{}, grid(20, 1)) < 0.01);
        CHECK(share(method, tiny, seen(tiny, 20, 1)) < 0.01);
        // there a tolerance is 1e4 times as large, and none is met by less than rounding
        if (each < 1e-8 && each > 1e-11)
            CHECK(share(method, afar, seen(afar, 20, 1)) < 0.02);
    };
    check(DormandPrince5{});
    check(DormandPrince8{});
}
TEST_CASE("ensemble: members that are not handed over end where they should", "[ensemble]") {
    const double each = GENERATE(1e-8, 1e-10);
    CAPTURE(each);
    const auto check = [&]<class Tableau>(Tableau, const auto& sys, const auto& members) {
        using Sys = std::decay_t<decltype(sys)>;
        const auto r = run<Tableau>(sys, members, tolerance<Sys>(each));
        double worst = 0;
        int miscounted = 0;
        for (std::size_t i = 0; i < members.size(); ++i) {
            const auto& o = r.outcomes[i];
            const auto exact = by_flow<DormandPrince8>(sys, members[i], tolerance<Sys>(1e-13));
            miscounted += o.status != Status::ok || o.events != exact.events ||
                          o.slides != exact.slides || o.mode != exact.mode;
            worst = std::max(worst, (o.x - exact.x).cwiseAbs().maxCoeff() / each);
        }
        CHECK(miscounted == 0);
        // Contacts at a small angle multiply errors: the scalar engine is off by 18, too.
        CHECK(worst < 30);
    };
    check(DormandPrince5{}, Oscillator{}, grid(20, 1));
    check(DormandPrince8{}, Oscillator{}, grid(20, 1));
    check(DormandPrince5{}, Unsolved<Oscillator>{}, grid(20, 1));
    check(DormandPrince5{}, Seen{1e-9, 0}, seen({1e-9, 0}, 20, 1));
}

TEST_CASE("ensemble: refuses settings that make no sense", "[ensemble]") {
    const auto m = grid(2, 1);
    auto settings = tolerance<Oscillator>(1e-8);
    settings.rtol = 0;
    CHECK_THROWS_WITH(ensemble(Oscillator{}, m, settings), ContainsSubstring("rtol"));
    CHECK_THROWS_WITH(ensemble(OneByOne{}, m, settings), ContainsSubstring("rtol"));
    settings = tolerance<Oscillator>(1e-8);
    settings.max_steps = 0;
    CHECK_THROWS_WITH(ensemble(Oscillator{}, m, settings), ContainsSubstring("max_steps"));
    CHECK_THROWS_WITH(ensemble(Oscillator{}, m, tolerance<Oscillator>(1e-8), {.threads = -1}),
                      ContainsSubstring("threads"));
    const auto none = ensemble(Oscillator{}, {}, tolerance<Oscillator>(1e-8));
    CHECK(none.status == Status::ok);
    CHECK(none.outcomes.empty());
}

TEST_CASE("ensemble: what cannot run in lanes is run by flow", "[ensemble]") {
    const auto check = [](const auto& sys, const auto& members, const auto& settings) {
        const auto r = ensemble<DormandPrince8, 8>(sys, members, settings, within_time(2));
        int differ = 0;
        for (std::size_t i = 0; i < members.size(); ++i) {
            const auto s = flow<DormandPrince8>(sys, members[i].p, members[i].x, members[i].t0,
                                                members[i].t_end, settings);
            const auto& o = r.outcomes[i];
            // to rounding: ensembles count time from the start of the first period
            differ += o.status != s.status || !((o.x - s.x).cwiseAbs().maxCoeff() < 1e-10);
        }
        CHECK(differ == 0);
        CHECK(r.counters.trips == 0);
        CHECK(r.counters.handed_over == static_cast<long long>(members.size()));
    };
    auto m = grid(5, 1);
    for (auto& member : m) {
        member.t_end -= member.t0;
        member.t0 = 0;
    }
    auto settings = tolerance<Oscillator>(1e-8);
    check(OneByOne{}, m, settings);
    settings.fixed_step = 0.01;
    check(Oscillator{}, m, settings);
    settings = tolerance<Oscillator>(1e-8);
    settings.skip_root_search = false;
    check(Oscillator{}, m, settings);
    settings = tolerance<Oscillator>(1e-8);
    settings.closed_form_slides = false;
    check(Oscillator{}, m, settings);
    Members<models::DieciLopez2> two{{{0.04, -0.01, -0.02}, {}, 0, 0.5}};
    check(models::DieciLopez2{}, two, tolerance<models::DieciLopez2>(1e-8));
}

// --- legs, ends and threads --------------------------------------------------------------------

namespace {

struct Legs : Population<2, 10> {
    const Members<Oscillator>* members = nullptr;
    std::vector<Outcome<2>> outcomes;
    std::vector<int> told;      ///< ends, each member's
    std::vector<int> legs_left; ///< each member's
    double length = 0;

    explicit Legs(const Members<Oscillator>& all, int more = 0)
        : members(&all), outcomes(all.size()), told(all.size(), 0), legs_left(all.size(), more) {}
    Member<2, 10> member(std::size_t id) override { return (*members)[id]; }
    bool goes_on(std::size_t id, const Outcome<2>& o) override {
        outcomes[id] = o;
        return legs_left[id]-- > 0;
    }
    double leg(std::size_t) override { return length; }
    void take(std::size_t id, const Outcome<2>& o) override {
        outcomes[id] = o;
        ++told[id];
    }
};

} // namespace

TEST_CASE("ensemble: ten legs are one run of ten periods", "[ensemble]") {
    const auto settings = tolerance<Oscillator>(1e-9);
    // from no length at all, too: a leg from a start that nothing is known of
    const int first = GENERATE(0, 1);
    CAPTURE(first);
    auto m = grid(10, first), whole = grid(10, 10);
    const double T = period_of(forced());
    const auto check = [&](const auto& sys) {
        Legs legs(m, 10 - first);
        legs.length = T;
        REQUIRE(run_population<DormandPrince8, 8>(sys, m.size(), legs, settings, within_time(2))
                    .status == Status::ok);
        const auto r = ensemble<DormandPrince8, 8>(sys, whole, settings, within_time());
        int bad = 0;
        for (std::size_t i = 0; i < m.size(); ++i) {
            const auto &a = legs.outcomes[i], &b = r.outcomes[i];
            const double apart = (a.x - b.x).cwiseAbs().maxCoeff();
            const bool alike = legs.told[i] == 1 && a.status == b.status && a.events == b.events &&
                               a.slides == b.slides && a.mode == b.mode &&
                               a.clock.index == b.clock.index &&
                               std::abs(a.clock.local - b.clock.local) < 1e-12 && apart < 1e-7 &&
                               std::abs(a.slide_time - b.slide_time) < 1e-6;
            if (!alike)
                UNSCOPED_INFO(i << ": " << name(a.status) << " " << a.events << "/" << b.events
                                << " slides " << a.slides << "/" << b.slides << " modes " << a.mode
                                << "/" << b.mode << " slid " << a.slide_time << "/" << b.slide_time
                                << " apart " << apart);
            bad += !alike;
        }
        CHECK(bad == 0);
    };
    check(Oscillator{});
    check(Unsolved<Oscillator>{});
    check(OneByOne{});
}

TEST_CASE("ensemble: refuses a leg that leads nowhere", "[ensemble]") {
    const auto m = grid(3, 1);
    const double length = GENERATE(0.0, -1.0, no_number, inf);
    const auto go = [&](const auto& sys) {
        Legs legs(m, 2);
        legs.length = length;
        (void)run_population<DormandPrince8, 8>(sys, m.size(), legs, tolerance<Oscillator>(1e-8),
                                                within_time());
    };
    CHECK_THROWS_WITH(go(Oscillator{}), ContainsSubstring("leg"));
    CHECK_THROWS_WITH(go(OneByOne{}), ContainsSubstring("leg"));
}

TEST_CASE("ensemble: ends at the first exit from a slide", "[ensemble]") {
    const auto settings = tolerance<Oscillator>(1e-9);
    auto m = grid(10, 4);
    for (std::size_t k = 0; k < m.size(); k += 5)
        m[k].x[1] = 1; // some start on the belt
    const auto check = [&](const auto& sys) {
        Legs ends(m);
        ends.ends_at_exit = true;
        REQUIRE(run_population<DormandPrince8, 8>(sys, m.size(), ends, settings, within_time(2))
                    .status == Status::ok);
        int exits = 0;
        for (std::size_t i = 0; i < m.size(); ++i) {
            EventLog<double, 2, 1> log;
            const auto s = by_flow<DormandPrince8>(Oscillator{}, m[i], settings, &log);
            const auto exit = std::find_if(log.events.begin(), log.events.end(), [](const auto& e) {
                return e.kind == EventKind::exit_sliding;
            });
            const auto& o = ends.outcomes[i];
            CAPTURE(i, name(o.status));
            CHECK(ends.told[i] == 1);
            if (exit == log.events.end()) {
                CHECK(o.status == s.status);
                continue;
            }
            ++exits;
            CHECK(o.status == Status::event);
            CHECK(o.mode == exit->mode_after[0]);
            CHECK((o.x - exit->x_right).cwiseAbs().maxCoeff() < 1e-7);
            CHECK(o.clock.absolute() == Approx(exit->t).epsilon(0).margin(1e-7));
        }
        CHECK(exits > 50);
    };
    check(Oscillator{});
    check(Unsolved<Oscillator>{});
    check(OneByOne{});
}

TEST_CASE("ensemble: shows its progress, and stops when it is told", "[ensemble]") {
    const auto settings = tolerance<Oscillator>(1e-8);
    const auto m = grid(40, 4);
    const auto all = run(Oscillator{}, m, settings);
    const int threads = GENERATE(1, 2);
    CAPTURE(threads);

    std::vector<std::size_t> shown;
    Parallel how{.threads = threads};
    how.progress = [&](std::size_t done, std::size_t total) {
        CHECK(total == m.size());
        shown.push_back(done);
    };
    (void)ensemble<DormandPrince8, 8>(Oscillator{}, m, settings, how);
    REQUIRE_FALSE(shown.empty());
    CHECK(std::is_sorted(shown.begin(), shown.end()));
    CHECK(shown.back() == m.size());

    const auto stopped = [&](const auto& sys) {
        int asked = 0;
        Parallel until{.threads = threads};
        until.cancelled = [&] { return ++asked > 20; };
        const auto r = ensemble<DormandPrince8, 8>(sys, m, settings, until);
        CHECK(r.status == Status::interrupted);
        int interrupted = 0, differ = 0;
        for (std::size_t i = 0; i < m.size(); ++i) {
            const bool left = r.outcomes[i].status == Status::interrupted;
            interrupted += left;
            // nothing is told of what did not end
            differ += left ? !std::isnan(r.outcomes[i].x[0]) : r.outcomes[i].status != Status::ok;
            if constexpr (std::same_as<std::decay_t<decltype(sys)>, Oscillator>)
                differ += !left && !same(r.outcomes[i], all.outcomes[i]);
        }
        CHECK(interrupted > 0);
        CHECK(differ == 0);
    };
    stopped(Oscillator{});
    stopped(OneByOne{});
}

TEST_CASE("ensemble: stops while the scalar engine has a member", "[ensemble]") {
    // backwards and handed over for ever: what is told of it is nothing
    auto settings = tolerance<Oscillator>(1e-8);
    settings.max_step = 1e-4;
    const auto p = forced(0.1);
    const Members<Oscillator> m{{{0.1, 0.5}, p, 0, -1e6}};
    int asked = 0;
    const auto r = ensemble<DormandPrince8, 8>(
        Oscillator{}, m, settings, {.threads = 1, .cancelled = [&] { return ++asked > 5; }});
    CHECK(r.status == Status::interrupted);
    CHECK(r.outcomes[0].status == Status::interrupted);
    CHECK(std::isnan(r.outcomes[0].x[0]));
}
