// SPDX-License-Identifier: BSD-3-Clause
// The event loop in lanes where it is hard: starts and ends at events, and members that come to
// grief.

#include "ensembles.hpp"

#include <filippov/models/quartet.hpp>

using namespace ensembles;

namespace {

/// x' = c + x^2, far from its surface: with c = 1 from 0 to infinity in pi/2.
struct BlowUp {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"c"};
    template <Scalar S> Vec<S, 1> f1(const S&, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        return Vec<S, 1>(S(p[0] + x[0] * x[0]));
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        return f1(t, x, p);
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 1>&) const {
        return x[0] + S(10);
    }
};

/// Forced, and says of no period; the forcing is given by lanes up to a time of 1e5 only.
struct Late {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"c"};
    template <Scalar S> Vec<S, 1> f1(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        using elementary::cos;
        return Vec<S, 1>(S(cos(t) + p[0] - x[0]));
    }
    template <Scalar S> Vec<S, 1> f2(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        using elementary::cos;
        return Vec<S, 1>(S(cos(t) - p[0] - x[0]));
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 1>&) const { return x[0]; }
};

/// A slide along y = 0 at speed c that attracts while x < 1 and repels beyond; s is 0 all the way.
struct Parting {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"c"};
    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {p[0], S(1) - x[0]};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        return {p[0], x[0] - S(1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 1>&) const { return x[1]; }
};

/// A block that friction m holds on a belt of speed 1, y' = 1, against a force y cos(omega t) that
/// grows: it slips when |y cos(omega t)| > m. It says of no period, and steps along the slide make
/// no error however long they are.
struct Shaken {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 2> params{"m", "omega"};
    template <Scalar S>
    static Vec<S, 2> field(const S& t, const Vec<S, 2>& x, const Vec<S, 2>& p, const S& friction) {
        using elementary::cos;
        return {x[1], x[0] * cos(p[1] * t) + friction};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return field(t, x, p, p[0]);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return field(t, x, p, S(-p[0]));
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const {
        return x[1] - S(1);
    }
};

/// A slide on a surface that jumps from x = 0 to x = J at t = 1, in 1e-9 of a unit of time.
struct Jumping {
    static constexpr int dim = 1;
    static constexpr std::array<std::string_view, 1> params{"J"};
    template <Scalar S> Vec<S, 1> f1(const S&, const Vec<S, 1>&, const Vec<S, 1>&) const {
        return Vec<S, 1>(S(1));
    }
    template <Scalar S> Vec<S, 1> f2(const S&, const Vec<S, 1>&, const Vec<S, 1>&) const {
        return Vec<S, 1>(S(-1));
    }
    template <Scalar S> S h(const S& t, const Vec<S, 1>& x, const Vec<S, 1>& p) const {
        using std::tanh;
        return x[0] - p[0] / S(2) * (S(1) + tanh(S(S(1e10) * (t - S(1)))));
    }
};

/// A latch x that rests while y is shaken up or down, and an h that x hardly has a part in.
struct Latched {
    static constexpr int dim = 2;
    static constexpr std::array<std::string_view, 1> params{"k"};
    template <Scalar S> static Vec<S, 2> shaken(const S& t, double push) {
        using elementary::cos;
        return {S(0), S(push) + S(4) * cos(S(3) * t)};
    }
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>&, const Vec<S, 1>&) const {
        return shaken(t, -1);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>&, const Vec<S, 1>&) const {
        return shaken(t, 1);
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 1>& p) const {
        using elementary::sin;
        return sin(t) + S(0.3) + p[0] * x[0];
    }
};

} // namespace

// --- starts and ends ---------------------------------------------------------------------------

namespace {

/// Members one by one as `flow` has them: status, counts, and the state to within `margin`
/// tolerances where it is sure. Returns how many differ.
template <class Tableau = DormandPrince8, class Sys>
int unlike_flow(const Sys& sys, const Members<Sys>& members, double each, double margin = 100) {
    const auto settings = tolerance<Sys>(each);
    const auto r = run<Tableau>(sys, members, settings);
    int n = 0;
    for (std::size_t i = 0; i < members.size(); ++i) {
        const auto &o = r.outcomes[i], s = by_flow<Tableau>(sys, members[i], settings);
        const double apart = (o.x - s.x).cwiseAbs().maxCoeff();
        const bool alike = o.status == s.status && o.events == s.events && o.slides == s.slides &&
                           o.mode == s.mode && apart <= margin * each &&
                           std::abs(o.clock.absolute() - s.clock.absolute()) <= margin * each;
        if (!alike)
            UNSCOPED_INFO("member " << i << " from (" << members[i].x.transpose() << ") at "
                                    << members[i].t0 << ": lanes " << name(o.status) << " "
                                    << o.events << "/" << o.slides << " mode " << o.mode
                                    << ", flow " << name(s.status) << " " << s.events << "/"
                                    << s.slides << " mode " << s.mode << ", apart " << apart);
        n += !alike;
    }
    return n;
}

double ulps(double v, int k) {
    for (; k > 0; --k)
        v = std::nextafter(v, inf);
    for (; k < 0; ++k)
        v = std::nextafter(v, -inf);
    return v;
}

} // namespace

TEST_CASE("lane_flow: starts on the surface and within some ulps of it", "[lane_flow]") {
    const auto p = forced();
    const double T = period_of(p);
    Members<Oscillator> m;
    // at t = 0 the block slides for -0.4 < y < 7.6
    for (const double y : {-3.0, -0.9, -0.4, 0.0, 1.0, 5.0, 7.6, 7.9, 9.0})
        for (int k = -3; k <= 3; ++k)
            m.push_back({{y, ulps(1.0, k)}, p, 0, 2 * T});
    CHECK(unlike_flow(Oscillator{}, m, 1e-8) == 0);
    CHECK(unlike_flow(Unsolved<Oscillator>{}, m, 1e-8) == 0);
}

TEST_CASE("H40, lane_flow: starts within some ulps of the boundary of sliding", "[lane_flow]") {
    const auto p = forced();
    const double T = period_of(p);
    Members<Oscillator> m;
    for (const double t0 : {0.0, 0.5, 2.9, 5.0, -3.3, 40 * T})
        for (const double s : {-1.0, 1.0}) {
            const double y = 3.6 * std::cos(1.067 * t0) - 4 * s;
            for (int k = -12; k <= 12; ++k)
                m.push_back({{ulps(y, k), 1.0}, p, t0, t0 + 2 * T});
        }
    CHECK(unlike_flow(Oscillator{}, m, 1e-8) == 0);
    CHECK(unlike_flow(Unsolved<Oscillator>{}, m, 1e-8) == 0);
}

namespace {

/// Starts y (at v = 2) around the one between `low` and `high` at which the outcome after a time
/// changes: neighbours in floating point.
template <class Same>
Members<Oscillator> tuned(double low, double high, double span, const Same& same_as_low) {
    const auto p = forced();
    const auto at = [&](double y) { return MemberOf<Oscillator>{{y, 2.0}, p, 0, span}; };
    for (int k = 0; k < 200 && std::nextafter(low, high) != high; ++k) {
        const double middle = low + (high - low) / 2;
        (same_as_low(at(middle)) ? low : high) = middle;
    }
    Members<Oscillator> m;
    for (int k = -40; k <= 40; ++k)
        m.push_back(at(ulps(low, k)));
    return m;
}

} // namespace

TEST_CASE("H40, lane_flow: orbits that pass the boundary of sliding within some ulps",
          "[lane_flow]") {
    const auto settings = tolerance<Oscillator>(1e-8);
    const auto first = [&](const MemberOf<Oscillator>& m) {
        EventLog<double, 2, 1> log;
        by_flow<DormandPrince8>(Oscillator{}, m, settings, &log);
        return log.events.size() > 2 ? log.events[1].kind : EventKind::end;
    };
    // the first contact: crossing for small y, sliding for larger ones
    const double span = 2 * period_of(forced());
    double low = -8, high = -8;
    const auto kind = [&](double y) { return first({{y, 2.0}, forced(), 0, span}); };
    int found = 0;
    for (; high < 8; low = high) {
        high = low + 0.25;
        if (kind(low) == kind(high))
            continue;
        ++found;
        const auto reference = kind(low);
        const auto m = tuned(low, high, span, [&](const auto& q) { return first(q) == reference; });
        // Beside the boundary the two engines may see a slide or none, and go on alike.
        const auto r = run<DormandPrince8>(Oscillator{}, m, settings);
        int bad = 0;
        double apart = 0;
        for (std::size_t i = 0; i < m.size(); ++i) {
            const auto &o = r.outcomes[i],
                       s = by_flow<DormandPrince8>(Oscillator{}, m[i], settings);
            bad += o.status != Status::ok || s.status != Status::ok ||
                   std::abs(o.events - s.events) > 2 || std::abs(o.slides - s.slides) > 1;
            apart = std::max(apart, (o.x - s.x).cwiseAbs().maxCoeff());
        }
        CAPTURE(low);
        CHECK(bad == 0);
        CHECK(apart <= 1e-6);
    }
    CHECK(found >= 2);
}

namespace {

/// From below, h' = 1; above h' = a - k h: a hop that ends at a height of a/k, k^-1 of a unit of
/// time after the contact.
struct Hop {
    static constexpr int dim = 1;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> params{"a", "k"};
    template <Scalar S> Vec<S, 1> f1(const S&, const Vec<S, 1>&, const Vec<S, 2>&) const {
        return Vec<S, 1>(S(1));
    }
    template <Scalar S> Vec<S, 1> f2(const S&, const Vec<S, 1>& x, const Vec<S, 2>& p) const {
        return Vec<S, 1>(S(p[0] - p[1] * (x[0] - S(1))));
    }
    template <Scalar S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 2>&) const {
        return x[0] - S(1);
    }
};

/// A slide along h = y - 1 at x' = 1 that ends at x = 0: below, y' = -c x + e x^2. So it dips to
/// c^3/(6 e^2) below the surface, and comes back at x = 3c/(2e).
struct Dip {
    static constexpr int dim = 2;
    static constexpr bool linear_h = true;
    static constexpr std::array<std::string_view, 2> params{"c", "e"};
    template <Scalar S> Vec<S, 2> f1(const S&, const Vec<S, 2>& x, const Vec<S, 2>& p) const {
        return {S(1), x[0] * (p[1] * x[0] - p[0])};
    }
    template <Scalar S> Vec<S, 2> f2(const S&, const Vec<S, 2>&, const Vec<S, 2>&) const {
        return {S(1), S(-1)};
    }
    template <Scalar S> S h(const S&, const Vec<S, 2>& x, const Vec<S, 2>&) const {
        return x[1] - S(1);
    }
};
struct DipInClosedForm : Dip {
    template <Scalar S>
    Vec<S, 2> sliding_flow(const S&, const Vec<S, 2>& x, const Vec<S, 2>&, const S& dt) const {
        return {x[0] + dt, S(1)};
    }
};

} // namespace

TEST_CASE("lane_flow: hops of any size are what flow says they are", "[lane_flow]") {
    const double each = GENERATE(1e-5, 1e-8, 1e-11);
    CAPTURE(each);
    Members<Hop> m;
    for (double a = 1; a > 1e-13; a /= 10)
        for (double k = 1; k < 1e7; k *= 10)
            m.push_back({Vec<double, 1>(0.99), {a, k}, 0, 0.01 + 3 / k});
    CHECK(unlike_flow<DormandPrince5>(Hop{}, m, each) == 0);
    CHECK(unlike_flow<DormandPrince8>(Hop{}, m, each) == 0);
}

TEST_CASE("lane_flow: a slide dips below its surface where its closed form says", "[lane_flow]") {
    const double each = GENERATE(1e-5, 1e-8, 1e-11);
    CAPTURE(each);
    const auto check = [&]<class Tableau, class Sys>(Tableau, const Sys& sys) {
        Members<Sys> m;
        std::vector<int> changes;
        for (double c = 1; c > 1e-9; c /= 10)
            for (double e = 1e-3; e < 1e7; e *= 10) {
                // lower ones are nothing to the tolerance, or to the rounding of y
                if (c * c * c / (6 * e * e) < std::max(1e-12, each))
                    continue;
                m.push_back({{-0.01, 1}, {c, e}, 0, 0.02});
                changes.push_back(1.5 * c / e < 0.01 ? 2 : 1);
            }
        const auto r = run<Tableau>(sys, m, tolerance<Sys>(each));
        int bad = 0;
        for (std::size_t i = 0; i < m.size(); ++i)
            bad += r.outcomes[i].status != Status::ok || r.outcomes[i].events != changes[i];
        CHECK(m.size() >= 10);
        CHECK(bad == 0);
    };
    check(DormandPrince5{}, Dip{});
    check(DormandPrince8{}, Dip{});
    check(DormandPrince5{}, DipInClosedForm{});
    check(DormandPrince8{}, DipInClosedForm{});
}

TEST_CASE("lane_flow: runs of no length, and runs that end at an event or in a slide",
          "[lane_flow]") {
    const auto settings = tolerance<Oscillator>(1e-8);
    Members<Oscillator> m, ends, within;
    for (auto member : grid(6, 3)) {
        EventLog<double, 2, 1> log;
        by_flow<DormandPrince8>(Oscillator{}, member, settings, &log);
        for (const auto& e : log.events)
            for (int k = -2; k <= 2; ++k) {
                member.t_end = ulps(e.t, k);
                ends.push_back(member);
            }
        for (std::size_t k = 1; k < log.events.size(); ++k)
            if (const auto &e = log.events[k - 1], &next = log.events[k]; e.mode_after[0] == 0)
                for (const double part : {0.01, 0.5, 0.99, 0.9999}) {
                    member.t_end = e.t + part * (next.t - e.t);
                    within.push_back(member);
                }
        member.t_end = member.t0;
        m.push_back(member);
        member.x[1] = 1; // on the surface
        m.push_back(member);
    }
    const auto check = [&](const auto& sys) {
        CHECK(unlike_flow(sys, m, 1e-8) == 0);
        CHECK(unlike_flow(sys, within, 1e-8) == 0);
        for (const auto& o : run<DormandPrince8>(sys, within, settings).outcomes)
            CHECK(o.mode == 0);
        // whether the event at the end is one of the run is a matter of rounding
        const auto r = run<DormandPrince8>(sys, ends, settings);
        int bad = 0;
        for (std::size_t i = 0; i < ends.size(); ++i) {
            const auto &o = r.outcomes[i], s = by_flow<DormandPrince8>(sys, ends[i], settings);
            bad += o.status != s.status || std::abs(o.events - s.events) > 1 ||
                   !((o.x - s.x).cwiseAbs().maxCoeff() <= 1e-6);
        }
        CHECK(bad == 0);
    };
    check(Oscillator{});
    check(Unsolved<Oscillator>{});
}

TEST_CASE("lane_flow: backwards, at negative times, and after many periods", "[lane_flow]") {
    const auto p = forced();
    const double T = period_of(p);
    Members<Oscillator> back, away;
    Random random(5);
    for (int k = 0; k < 60; ++k) {
        const double t0 = random(-50, 50);
        back.push_back({{random(-4, 4), random(-3, 4)}, p, t0, t0 - 0.5 * T});
        const double begin = T * std::floor(random(-1e6, 1e6));
        away.push_back({{random(-4, 4), random(-3, 4)}, p, begin, begin + 3 * T});
    }
    CHECK(unlike_flow(Oscillator{}, back, 1e-8) == 0);
    CHECK(unlike_flow(Oscillator{}, away, 1e-8) == 0);
    CHECK(unlike_flow(Unsolved<Oscillator>{}, back, 1e-8) == 0);
    CHECK(unlike_flow(Unsolved<Oscillator>{}, away, 1e-8) == 0);
}

TEST_CASE("lane_flow: after a thousand periods the end is where it was asked for", "[lane_flow]") {
    // near an attractor the engines agree for ever, if their clocks do
    const auto p = forced();
    const double T = period_of(p);
    Members<Oscillator> m;
    for (int k = 0; k < 5; ++k)
        m.push_back({{-3 + 0.9 * k, 0.5 * k}, p, 0.1 * k, 0.1 * k + 1000 * T});
    CHECK(unlike_flow(Oscillator{}, m, 1e-8) == 0);
    CHECK(unlike_flow(Oscillator{}, m, 1e-12) == 0);
    CHECK(unlike_flow(Unsolved<Oscillator>{}, m, 1e-8) == 0);
    CHECK(unlike_flow(Unsolved<Oscillator>{}, m, 1e-12) == 0);
}

TEST_CASE("lane_flow: a forcing that lanes cannot follow is left to the scalar engine",
          "[lane_flow]") {
    Members<Late> m;
    for (const double t0 : {0.0, 99990.0, 200000.0, -99995.0, -1e6})
        for (const double c : {0.4, 1.2})
            m.push_back({Vec<double, 1>(0.3), Vec<double, 1>(c), t0, t0 + 20});
    CHECK(unlike_flow(Late{}, m, 1e-8) == 0);
    const auto r = run(Late{}, m, tolerance<Late>(1e-8));
    CHECK(r.counters.handed_over <= 1100 * static_cast<long long>(m.size()));
}

// --- slides that are not known in closed form --------------------------------------------------

TEST_CASE("lane_flow: a slide without a closed form ends as the closed form says", "[lane_flow]") {
    // grazing ends, below and above: amplitudes for which |s| just reaches 1 or does not
    Members<Oscillator> m;
    for (int k = 0; k < 400; ++k) {
        const auto p = forced(0.2 + 0.02 * k, 0.7 + 0.004 * k);
        const double y = (k % 2 == 0 ? 1 : -1) * 3.9 * ((k % 37) / 37.0);
        m.push_back({{y, 1.0}, p, 0.1 * k, 0.1 * k + 2 * period_of(p)});
    }
    const auto settings = tolerance<Oscillator>(1e-9);
    const auto known = run(Oscillator{}, m, settings),
               stepped = run(Unsolved<Oscillator>{}, m, settings);
    for (std::size_t i = 0; i < m.size(); ++i) {
        const auto &a = known.outcomes[i], &b = stepped.outcomes[i];
        CAPTURE(i);
        CHECK(a.status == b.status);
        CHECK(a.mode == b.mode);
        CHECK(a.events == b.events);
        CHECK(a.slides == b.slides);
        CHECK((a.x - b.x).cwiseAbs().maxCoeff() < 1e-7);
        CHECK(std::abs(a.slide_time - b.slide_time) < 1e-6);
    }
    CHECK(stepped.counters.handed_over < 20);
    // The first slip of a run that begins in a slide starts with the slide's step: member 57 errs
    // by 127 tolerances.
    CHECK(unlike_flow(Unsolved<Oscillator>{}, m, 1e-9, 200) == 0);
}

TEST_CASE("lane_flow: a slide whose s swings ends at the first swing that is too wide",
          "[lane_flow]") {
    Members<Shaken> m;
    std::vector<double> ends;
    for (int k = 0; k < 200; ++k) {
        const double omega = 0.9 * std::pow(1.03, k), y = -3.0 + 0.015 * k; // up to 320
        m.push_back({{y, 1.0}, {3.5, omega}, 0, 12});
        // the first time at which |y + t| |cos(omega t)| is 3.5
        const auto over = [&](double t) { return std::abs((y + t) * std::cos(omega * t)) - 3.5; };
        const double dt = 1e-3 / omega;
        double t = 0;
        while (over(t + dt) < 0)
            t += dt;
        double low = t, high = t + dt;
        for (int n = 0; n < 60; ++n)
            (over((low + high) / 2) < 0 ? low : high) = (low + high) / 2;
        ends.push_back(low);
    }
    struct Exits : Population<2, 2> {
        const Members<Shaken>* members;
        std::vector<Outcome<2>> outcomes;
        Member<2, 2> member(std::size_t id) override { return (*members)[id]; }
        void take(std::size_t id, const Outcome<2>& o) override { outcomes[id] = o; }
    } exits;
    exits.members = &m;
    exits.outcomes.resize(m.size());
    exits.ends_at_exit = true;
    const auto r = run_population<DormandPrince8, 8>(Shaken{}, m.size(), exits,
                                                     tolerance<Shaken>(1e-8), within_time());
    REQUIRE(r.status == Status::ok);
    int below = 0;
    for (std::size_t i = 0; i < m.size(); ++i) {
        const auto& o = exits.outcomes[i];
        CAPTURE(i, m[i].p[1], ends[i], o.clock.local);
        CHECK(o.status == Status::event);
        CHECK(o.clock.local == Approx(ends[i]).epsilon(0).margin(1e-7));
        CHECK(o.slide_time == Approx(ends[i]).epsilon(0).margin(1e-7));
        below += o.mode < 0;
    }
    CHECK(below > 50);
    CHECK(below < 150);
    CHECK(r.counters.handed_over < 20);
}

TEST_CASE("H22, lane_flow: a surface that jumps away leaves a slide behind", "[lane_flow]") {
    Members<Jumping> m;
    for (int k = 0; k < 40; ++k)
        for (const double J : {-2.0, -0.1, 0.01, 0.3, 1.0}) // back on it at t = 1 + |J|
            m.push_back({Vec<double, 1>(0.0), Vec<double, 1>(J), 0.01 * k, 4.0 + 0.01 * k});
    const auto r = run(Jumping{}, m, tolerance<Jumping>(1e-8));
    for (std::size_t i = 0; i < m.size(); ++i) {
        const auto& o = r.outcomes[i];
        CAPTURE(i);
        CHECK(o.status == Status::ok);
        CHECK(o.slides == 1); // it starts in one
        CHECK(std::abs(o.x[0] - m[i].p[0]) < 1e-12);
        const double away = std::abs(m[i].p[0]);
        CHECK(std::abs(o.slide_time - (m[i].t_end - m[i].t0 - away)) < 1e-7);
    }
    CHECK(unlike_flow(Jumping{}, m, 1e-8) == 0);
}

TEST_CASE("H20, lane_flow: a state that h hardly depends on stays where it is", "[lane_flow]") {
    Members<Latched> m;
    for (int i = 0; i < 40; ++i)
        for (const double k : {1e-18, 1e-14, 1e-10, 1e-6})
            for (const double late : {0.0, 1e4})
                m.push_back({{1, 0}, Vec<double, 1>(k), late + 0.5 + 0.1 * i, late + 20 + 0.1 * i});
    for (const double tol : {1e-6, 1e-10}) {
        const auto r = run(Latched{}, m, tolerance<Latched>(tol));
        if (tol > 1e-8) // lanes did it
            CHECK(r.counters.handed_over < 32);
        for (const auto& o : r.outcomes) {
            REQUIRE(o.status == Status::ok);
            CHECK(o.events >= 6);
            CHECK(o.x[0] == 1);
        }
        CHECK(unlike_flow(Latched{}, m, tol) == 0);
    }
}

TEST_CASE("lane_flow: a slide that ceases to attract stops there", "[lane_flow]") {
    Members<Parting> m;
    for (int k = 0; k < 40; ++k)
        m.push_back({{-2 + 0.07 * k, k % 3 == 0 ? 0.0 : 0.02 * k},
                     Vec<double, 1>(0.3 + 0.05 * k),
                     0,
                     1.0 + 0.5 * k});
    CHECK(unlike_flow(Parting{}, m, 1e-8) == 0);
    int stopped = 0;
    for (const auto& o : run(Parting{}, m, tolerance<Parting>(1e-8)).outcomes) {
        if (o.status == Status::ok)
            continue;
        ++stopped;
        CHECK(o.status == Status::ambiguous);
        CHECK(o.x[0] == Approx(1).epsilon(1e-6));
    }
    CHECK(stopped > 20);
    CHECK(stopped < 40);
}

// --- members that come to grief ----------------------------------------------------------------

TEST_CASE("lane_flow: what is not finite has a status, and spoils no other member", "[lane_flow]") {
    auto m = grid(6, 2);
    const auto alone = run(Oscillator{}, m, tolerance<Oscillator>(1e-8));
    Members<Oscillator> mixed;
    std::vector<std::size_t> place;
    const double bad_numbers[] = {no_number, inf, -inf};
    int k = 0;
    for (const auto& good : m) {
        auto bad = good;
        const double v = bad_numbers[k % 3];
        switch (k++ % 6) {
        case 0:
            bad.x[0] = v;
            break;
        case 1:
            bad.x[1] = v;
            break;
        case 2:
            bad.p[0] = v;
            break;
        case 3:
            bad.t0 = v;
            break;
        case 4:
            bad.t_end = v;
            break;
        default:
            bad.p[1] = 1e300; // a period of which too many fit in any time
        }
        mixed.push_back(bad);
        place.push_back(mixed.size());
        mixed.push_back(good);
    }
    const auto check = [&](const auto& sys) {
        const auto r =
            ensemble<DormandPrince8, 8>(sys, mixed, tolerance<Oscillator>(1e-8), within_time());
        REQUIRE(r.status == Status::ok);
        for (std::size_t i = 0; i < mixed.size(); i += 2) {
            CAPTURE(i, name(r.outcomes[i].status));
            CHECK(r.outcomes[i].status == Status::not_finite);
            CHECK(r.outcomes[i].slide_time == 0.0);
        }
        return r;
    };
    check(OneByOne{});
    const auto r = check(Oscillator{});
    int differ = 0;
    for (std::size_t i = 0; i < m.size(); ++i)
        differ += !same(alone.outcomes[i], r.outcomes[place[i]]);
    CHECK(differ == 0);
}

TEST_CASE("lane_flow: a forcing without period is constant", "[lane_flow]") {
    auto m = grid(6, 2);
    for (auto& member : m)
        member.p[1] = 0; // 2 pi / 0
    CHECK(unlike_flow(Oscillator{}, m, 1e-8) == 0);
    CHECK(unlike_flow(OneByOne{}, m, 1e-8) == 0);
}

TEST_CASE("lane_flow: blows up by itself, or escapes its bounds", "[lane_flow]") {
    Members<BlowUp> m;
    for (int k = 0; k < 40; ++k) // tan(t) from 0 where c = 1
        m.push_back({Vec<double, 1>(-9 + 0.4 * k), Vec<double, 1>(k % 3 == 0 ? -64.0 : 1.0), 0,
                     1.0 + 0.1 * (k % 7)});
    // next to a pole how far off a state is says nothing: x^2 multiplies errors
    CHECK(unlike_flow(BlowUp{}, m, 1e-8, inf) == 0);

    struct Bounded : Population<1, 1> {
        const Members<BlowUp>* members;
        std::vector<Outcome<1>> outcomes;
        Member<1, 1> member(std::size_t id) override { return (*members)[id]; }
        void take(std::size_t id, const Outcome<1>& o) override { outcomes[id] = o; }
    } population;
    population.members = &m;
    population.outcomes.resize(m.size());
    population.escape[0] = 50;
    const auto free = run(BlowUp{}, m, tolerance<BlowUp>(1e-8));
    REQUIRE(run_population<DormandPrince8, 8>(BlowUp{}, m.size(), population,
                                              tolerance<BlowUp>(1e-8), within_time())
                .status == Status::ok);
    int escaped = 0;
    for (std::size_t i = 0; i < m.size(); ++i) {
        const auto &o = population.outcomes[i], &f = free.outcomes[i];
        escaped += o.status == Status::escaped;
        CAPTURE(i, name(o.status), name(f.status), o.x[0], f.x[0]);
        if (o.status == Status::escaped)
            CHECK((std::abs(o.x[0]) > 50 && (f.status != Status::ok || std::abs(f.x[0]) > 50)));
        else
            CHECK(same(o, f));
    }
    CHECK(escaped > 5);
    CHECK(escaped < 35);
}

TEST_CASE("lane_flow: escapes while it slides", "[lane_flow]") {
    struct Belt : Population<2, 10> {
        Outcome<2> outcome;
        Member<2, 10> member(std::size_t) override {
            return {{0.0, 1.0}, forced(), 0, period_of(forced())};
        }
        void take(std::size_t, const Outcome<2>& o) override { outcome = o; }
    } belt;
    belt.escape[0] = 0.5;
    const auto check = [&](const auto& sys) {
        const auto r = run_population<DormandPrince8, 8>(sys, 1, belt, tolerance<Oscillator>(1e-8),
                                                         within_time());
        REQUIRE(r.status == Status::ok);
        CHECK(r.counters.handed_over == 0);
        CHECK(belt.outcome.status == Status::escaped);
        CHECK(belt.outcome.mode == 0);
        CHECK(belt.outcome.events == 0);
        CHECK(belt.outcome.x[0] > 0.5);
        CHECK(belt.outcome.slide_time == Approx(belt.outcome.x[0]));
    };
    check(Oscillator{});
    check(Unsolved<Oscillator>{});
}

TEST_CASE("lane_flow: bounds on steps and events are those of flow", "[lane_flow]") {
    const auto m = grid(6, 4);
    const auto check = [&](const auto& sys) {
        auto settings = tolerance<Oscillator>(1e-8);
        const auto free = run(sys, m, settings);
        for (const int most : {1, 3, 5, 8}) {
            settings.max_events = most;
            const auto r = run(sys, m, settings);
            for (std::size_t i = 0; i < m.size(); ++i) {
                const auto &o = r.outcomes[i], &f = free.outcomes[i];
                CAPTURE(most, i, f.events, o.events);
                if (f.events <= most) {
                    CHECK(same(o, f));
                    continue;
                }
                const auto s = by_flow<DormandPrince8>(sys, m[i], settings);
                CHECK(o.status == Status::max_events);
                CHECK(s.status == Status::max_events);
                CHECK(o.events == most);
                CHECK(o.mode == s.mode);
                CHECK(std::abs(o.clock.absolute() - s.clock.absolute()) < 1e-6);
                CHECK((o.x - s.x).cwiseAbs().maxCoeff() < 1e-6);
            }
        }
        settings = tolerance<Oscillator>(1e-8);
        settings.max_steps = 10;
        const auto r = run(sys, m, settings);
        for (const auto& o : r.outcomes)
            CHECK(o.status == Status::max_steps);
    };
    check(Oscillator{});
    check(Unsolved<Oscillator>{});
}

TEST_CASE("lane_flow: a start that is not unique stops, or goes where it is told", "[lane_flow]") {
    using models::Quartet;
    Members<Quartet> m;
    for (const double x : {-1.0, 0.0, 1.0})
        m.push_back({Vec<double, 1>(x), {-1, 0, 0}, 0, 2});
    auto settings = tolerance<Quartet>(1e-8);
    auto r = run(Quartet{}, m, settings);
    CHECK(r.outcomes[0].x[0] == Approx(-3));
    CHECK(r.outcomes[1].status == Status::ambiguous);
    CHECK(r.outcomes[1].slide_time == 0.0);
    CHECK(r.outcomes[2].x[0] == Approx(3));
    settings.on_nonunique = NonUnique::above;
    CHECK(run(Quartet{}, m, settings).outcomes[1].x[0] == Approx(2));
    settings.on_nonunique = NonUnique::below;
    CHECK(run(Quartet{}, m, settings).outcomes[1].x[0] == Approx(-2));
    settings.on_nonunique = NonUnique::stay;
    r = run(Quartet{}, m, settings);
    CHECK(r.outcomes[1].x[0] == 0.0);
    CHECK(r.outcomes[1].slide_time == Approx(2));
    CHECK(r.outcomes[1].slides == 0);
}
