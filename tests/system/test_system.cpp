// SPDX-License-Identifier: BSD-3-Clause
// What is a system and what is not, and what each model can do: a misspelt optional member is
// silently unused.
#include "catch.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/models/belt.hpp>
#include <filippov/models/coulomb.hpp>
#include <filippov/models/dieci_lopez.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/models/quartet.hpp>
#include <filippov/models/relay.hpp>
#include <filippov/models/stiff_relay.hpp>
#include <filippov/models/unit_circle.hpp>

#include <string>

using namespace filippov;

namespace {

/// The optional members found, in one string: a sum of names that a misspelling shortens.
template <class Sys, class S = double> std::string capabilities() {
    std::string list;
    const auto add = [&](bool has, const char* what) {
        if (!has)
            return;
        if (!list.empty())
            list += ' ';
        list += what;
    };
    add(HasSides<Sys, S>, "f1,f2");
    add(HasField<Sys, S>, "field");
    add(HasGradH<Sys, S>, "grad_h");
    add(HasHt<Sys, S>, "h_t");
    add(HasSlidingFlow<Sys, S>, "sliding_flow");
    add(HasEquivalentControl<Sys, S>, "equivalent_control");
    add(HasPeriod<Sys, S>, "period");
    add(HasSMax<Sys, S>, "s_max");
    return list;
}

template <class Sys, int Dim, int Surfaces, int Parameters>
constexpr bool sizes = dim_v<Sys> == Dim && surfaces_v<Sys> == Surfaces &&
                       params_v<Sys> == Parameters && FilippovSystem<Sys>;

using namespace models;
static_assert(sizes<Oscillator, 2, 1, 10>);
static_assert(sizes<Coulomb, 2, 1, 3>);
static_assert(sizes<Stiction, 2, 1, 6>);
static_assert(sizes<VaryingBelt, 2, 1, 4>);
static_assert(sizes<DieciLopez, 2, 1, 1>);
static_assert(sizes<DieciLopez2, 3, 2, 0>);
static_assert(sizes<Relay, 3, 1, 6>);
static_assert(sizes<StiffRelay, 1, 1, 1>);
static_assert(sizes<UnitCircle, 2, 1, 1>);
static_assert(sizes<Quartet, 1, 1, 3>);

static_assert(HasGradH<Oscillator, double> && HasHt<Oscillator, double> &&
              HasSlidingFlow<Oscillator, double> && HasEquivalentControl<Oscillator, double> &&
              HasPeriod<Oscillator, double> && HasField<Oscillator, double>);
static_assert(HasSlidingFlow<Coulomb, double> && HasSlidingFlow<Stiction, double> &&
              HasSMax<Stiction, double> && HasPeriod<Stiction, double>);
// two surfaces: a field, and no sides
static_assert(HasField<DieciLopez2, double> && !HasSides<DieciLopez2, double>);

// --- what is refused -----------------------------------------------------------------------------

/// A valid system; every one below differs from it in one thing.
struct Valid {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};
static_assert(FilippovSystem<Valid>);

struct NoDim {
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};
static_assert(!FilippovSystem<NoDim>);
static_assert(!FilippovSystem<int>);

struct DimZero {
    static constexpr int dim = 0;
    template <class S> Vec<S, 0> f1(const S&, const Vec<S, 0>&, const Vec<S, 0>&) const {
        return {};
    }
    template <class S> Vec<S, 0> f2(const S&, const Vec<S, 0>&, const Vec<S, 0>&) const {
        return {};
    }
    template <class S> S h(const S&, const Vec<S, 0>&, const Vec<S, 0>&) const { return S(1); }
};
static_assert(!FilippovSystem<DimZero>);

struct NoH {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(-1)};
    }
};
static_assert(!FilippovSystem<NoH>);

struct NoF2 {
    static constexpr int dim = 2;
    template <class S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return {x[1], S(1)};
    }
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return x[1]; }
};
static_assert(!FilippovSystem<NoF2>);

struct BoolH : Valid {
    template <class S> bool h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x[1] > S(0);
    }
};
static_assert(!FilippovSystem<BoolH>);

struct ExpressionF1 : Valid { // returned by value it dangles
    template <class S> auto f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const { return -x; }
};
static_assert(!FilippovSystem<ExpressionF1>);

struct ShortF1 : Valid {
    template <class S> Vec<S, 1> f1(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return Vec<S, 1>(x[1]);
    }
};
static_assert(!FilippovSystem<ShortF1>);

struct DoubleF1 : Valid { // cannot be differentiated
    Vec<double, 2> f1(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const {
        return {x[1], 1};
    }
};
static_assert(HasSides<DoubleF1, double> && !FilippovSystem<DoubleF1>);

struct DoubleH : Valid {
    double h(const double&, const Vec<double, 2>& x, const Vec<double, 0>&) const { return x[1]; }
};
static_assert(HasSwitch<DoubleH, double> && !FilippovSystem<DoubleH>);

struct NotConst : Valid {
    template <class S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) { return x[1]; }
};
static_assert(!FilippovSystem<NotConst>);

struct OtherParameters : Valid {
    static constexpr std::array<std::string_view, 1> params{"a"};
};
static_assert(!FilippovSystem<OtherParameters>);

/// Two surfaces need h of length two, and a field; sides cannot say what holds in four regions.
struct TwoSurfaces : Valid {
    static constexpr int surfaces = 2;
    template <class S> Vec<S, 2> h(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    }
};
static_assert(HasSwitch<TwoSurfaces, double> && !HasSides<TwoSurfaces, double> &&
              !FilippovSystem<TwoSurfaces>);

struct TwoSurfacesOneH : Valid {
    static constexpr int surfaces = 2;
    template <class S>
    Vec<S, 2> field(const S&, const Vec<S, 2>& x, const Vec<S, 2>& s, const Vec<S, 0>&) const {
        return {x[1], s[0] * s[1]};
    }
};
static_assert(HasField<TwoSurfacesOneH, double> && !FilippovSystem<TwoSurfacesOneH>);

struct ZeroSurfaces : Valid {
    static constexpr int surfaces = 0;
};
static_assert(!FilippovSystem<ZeroSurfaces>);

// --- optional members with another signature are not found, and the system still is one
// ------------

struct Misspelt : Valid {
    template <class S> Vec<S, 2> gradh(const S&, const Vec<S, 2>&, const Vec<S, 0>&) const {
        return {S(0), S(1)};
    }
    template <class S> S period(const S& t) const { return t; } // not a function of p
    template <class S> S h_t(const S&, const Vec<S, 2>&) const { return S(0); } // no p
    template <class S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 0>&) const {
        return x;
    } // no dt
};
static_assert(FilippovSystem<Misspelt>);

// A blend alone is a system, with s a scalar or a vector of length one.
struct BlendOnly {
    static constexpr int dim = 1;
    template <class S>
    Vec<S, 1> field(const S&, const Vec<S, 1>&, const S& s, const Vec<S, 0>&) const {
        return Vec<S, 1>(-s);
    }
    template <class S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const { return x[0]; }
};
static_assert(FilippovSystem<BlendOnly> && !HasSides<BlendOnly, double>);

} // namespace

TEST_CASE("system: every model has the optional members that it means to have", "[system]") {
    CHECK(capabilities<Oscillator>() ==
          "f1,f2 field grad_h h_t sliding_flow equivalent_control period");
    CHECK(capabilities<Coulomb>() == "f1,f2 sliding_flow");
    CHECK(capabilities<Stiction>() == "f1,f2 sliding_flow period s_max");
    CHECK(capabilities<VaryingBelt>() == "f1,f2");
    CHECK(capabilities<DieciLopez>() == "f1,f2");
    CHECK(capabilities<DieciLopez2>() == "field");
    CHECK(capabilities<Relay>() == "f1,f2");
    CHECK(capabilities<StiffRelay>() == "f1,f2");
    CHECK(capabilities<UnitCircle>() == "f1,f2");
    CHECK(capabilities<Quartet>() == "f1,f2");
    CHECK(capabilities<Misspelt>() == "f1,f2");
    CHECK(capabilities<BlendOnly>() == "field");
    // and in every scalar
    CHECK(capabilities<Oscillator, float>() == capabilities<Oscillator>());
    CHECK(capabilities<Oscillator, long double>() == capabilities<Oscillator>());
    CHECK(capabilities<Oscillator, Taylor<double, 3>>() == capabilities<Oscillator>());
}

TEST_CASE("system: what the system does not say is derived or has a default", "[system]") {
    const Valid sys;
    const Vec<double, 0> p;
    const Vec<double, 2> x(0.5, 0.25);
    CHECK(period(sys, p) == 0.0);
    CHECK(s_max(sys, p) == 1.0);
    CHECK(grad_h(sys, 0, 0.0, x, p) == Vec<double, 2>(0, 1));
    CHECK(switching(sys, 0.0, x, p)[0] == 0.25);
    CHECK(default_params<Valid>().size() == 0);
    CHECK(default_params<Relay>()[1] == 25);
    CHECK(default_params<Relay, float>()[0] == 0.05f);
}

TEST_CASE("system: the oscillator's members say what its fields and h say", "[system]") {
    const Oscillator sys;
    const auto p = default_params<Oscillator>();
    const double t = 0.7;
    for (const double v : {0.4, 1.0, 2.3}) {
        const Vec<double, 2> x(1.3, v);
        // s = -1 and s = +1 of the blend are the sides, each on its own side
        if (v <= 1)
            CHECK((sys.field(t, x, -1.0, p) - sys.f1(t, x, p)).norm() < 1e-15);
        if (v >= 1)
            CHECK((sys.field(t, x, +1.0, p) - sys.f2(t, x, p)).norm() < 1e-15);
    }
    const Vec<double, 2> on(1.3, 1);
    const Mode<1> slide{};
    const auto slid = sliding(sys, slide, t, on, p);
    const double s = sys.equivalent_control(t, on, p);
    CHECK(slid.below == Approx(1 + s).epsilon(1e-14));
    CHECK(slid.above == Approx(1 - s).epsilon(1e-14));
    CHECK(slid.w == Approx(8).epsilon(1e-14)); // L1 - L2 = 2 m g mu(0)
    CHECK((slid.f - Vec<double, 2>(1, 0)).norm() < 1e-14);
    CHECK((sys.sliding_flow(t, on, p, 0.25) - Vec<double, 2>(1.55, 1)).norm() < 1e-15);
    CHECK(sys.period(p) == Approx(6.283185307179586 / 2.94).epsilon(1e-15));
    const auto there = sys.f1(t + sys.period(p), on, p), here = sys.f1(t, on, p);
    CHECK((there - here).norm() < 1e-14);
}

TEST_CASE("system: a blend alone slides and can be left to", "[system]") {
    EventLog<double, 1, 1> log;
    const auto r =
        flow(BlendOnly{}, Vec<double, 0>(), Vec<double, 1>(0.5), 0, 1, Settings<double, 1>{}, log);
    CHECK(r.status == Status::ok);
    REQUIRE(log.events.size() == 3);
    CHECK(log.events[1].kind == EventKind::enter_sliding);
    CHECK(log.events[1].t == Approx(0.5).epsilon(1e-15));
    CHECK(r.x[0] == 0);
}

TEST_CASE("system: a mode counts its slides", "[system]") {
    Mode<2> mode{{-1, 1}};
    CHECK(mode.sliding() == 0);
    mode.set(1, 0);
    CHECK(mode.sliding() == 1);
    CHECK(mode[0] == -1);
    CHECK(mode[1] == 0);
    CHECK(mode == Mode<2>{{-1, 0}});
    CHECK_FALSE(mode == Mode<2>{{-1, 1}});
}
