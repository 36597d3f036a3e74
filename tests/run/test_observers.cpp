// SPDX-License-Identifier: BSD-3-Clause
// What a run tells an observer, and what the observer may ask for.
#include "catch.hpp"

#include <filippov/engine/all_branches.hpp>
#include <filippov/engine/variation.hpp>
#include <filippov/models/impacts.hpp>
#include <filippov/models/oscillator.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

using namespace filippov;
using enum EventKind;

namespace {

using Block = models::Oscillator;
using Seen = std::vector<Event<double, 2, 1>>;
const Vec<double, 2> rest(0, 0);
const auto speed = [](const auto&, const auto& x, const auto&) { return x[1]; };

/// All events of a run.
template <class Sec = Sections<>> Seen events_of(double t_end, const Sec& watched = {}) {
    EventLog<double, 2, 1> log;
    flow(Block{}, {}, rest, 0, t_end, {}, log, watched);
    return log.events;
}

/// A surface that repels on both sides: from x = 0 there are several solutions.
struct Undecided {
    static constexpr int dim = 1;
    template <class S> Vec<S, 1> f1(const S&, const Vec<S, 1>&, const Vec<S, 0>&) const {
        return Vec<S, 1>(S(-1));
    }
    template <class S> Vec<S, 1> f2(const S&, const Vec<S, 1>&, const Vec<S, 0>&) const {
        return Vec<S, 1>(S(1));
    }
    template <class S> S h(const S&, const Vec<S, 1>& x, const Vec<S, 0>&) const { return x[0]; }
};

} // namespace

TEST_CASE("observers: each function by itself hears what a log of all has", "[observers]") {
    const Seen all = events_of(30);
    REQUIRE(all.size() > 6);
    std::size_t events = 0, asked = 0, begun = 0;
    long long steps = 0;
    flow(Block{}, {}, rest, 0, 30, {}, {.event = [&](const auto&) { ++events; }});
    CHECK(events == all.size());
    const auto ask = [&](const Event<double, 2, 1>& e) {
        ++asked;
        CHECK(e.t == all[asked].t);
        return false;
    };
    flow(Block{}, {}, rest, 0, 30, {}, {.ends = ask});
    CHECK(asked == all.size() - 2); // not of the start nor of the end
    const auto r =
        flow(Block{}, {}, rest, 0, 30, {}, {.step = [&](const auto&, const auto&) { ++steps; }});
    CHECK(steps == r.counters.steps);
    const auto begin = [&](double t0, double t_end) {
        ++begun;
        CHECK(t0 == 0);
        CHECK(t_end == 30);
    };
    flow(Block{}, {}, rest, 0, 30, {}, {.begin = begin});
    CHECK(begun == 1);
}

TEST_CASE("observers: two are put together by hand", "[observers]") {
    const std::vector<double> times{1, 2, 3, 4, 5, 6, 7, 8, 9};
    OutputTimes<double, 2, 1> out{times};
    Observer<double, 2, 1> both = out;
    both.ends = [](const Event<double, 2, 1>& e) { return e.t > 2; };
    const auto r = flow(Block{}, {}, rest, 0, 30, {}, both);
    CHECK(r.status == Status::event);
    CHECK(r.t < 9);
    CHECK(double(out.states.size()) == std::floor(r.t));
    CHECK(out.events.back().t == r.t);
}

TEST_CASE("observers: the run ends at the event of which that was said", "[observers]") {
    // A section that is met in a direction nobody wants is no event.
    const auto third = [](int& n) {
        return [&n](const Event<double, 2, 1>& e) { return is_change(e.kind) && ++n == 3; };
    };
    int with = 0, without = 0;
    const auto a = flow(Block{}, {}, rest, 0, 30, {}, {.ends = third(with)},
                        sections(Section{speed, GENERATE(-1, 0, 1)}));
    const auto b = flow(Block{}, {}, rest, 0, 30, {}, {.ends = third(without)});
    REQUIRE(b.status == Status::event);
    CHECK(a.status == Status::event);
    CHECK(std::abs(a.t - b.t) <= 1e-6);
}

TEST_CASE("observers: a section that is zero at the start does not end the run", "[observers]") {
    const auto at_start = [](const Event<double, 2, 1>& e) {
        return e.kind == section && e.t == 0;
    };
    const auto r = flow(Block{}, {}, rest, 0, 10, {}, {.ends = at_start}, sections(Section{speed}));
    CHECK(r.status == Status::ok);
    CHECK(r.t == 10);
}

TEST_CASE("observers: of two events at one time each can end the run", "[observers]") {
    const auto double_speed = [](const auto&, const auto& x, const auto&) { return 2 * x[1]; };
    const auto watched = sections(Section{speed}, Section{double_speed});
    const int which = GENERATE(0, 1);
    const auto is = [which](const Event<double, 2, 1>& e) {
        return e.kind == section && e.surface == which && e.t > 1;
    };
    const auto r = flow(Block{}, {}, rest, 0, 30, {}, {.ends = is}, watched);
    REQUIRE(r.status == Status::event);
    const Seen all = events_of(30, watched);
    const auto first = std::find_if(all.begin(), all.end(), is);
    REQUIRE(first != all.end());
    CHECK(r.t == first->t);
}

TEST_CASE("observers: a jump beside a section, or before bounces end, can end the run",
          "[observers]") {
    using Ball = models::BouncingBall;
    const Vec<double, 2> dropped(1, 0);
    int asked = 0, told = 0;
    const auto count = [&](const Event<double, 2, 1>& e) {
        asked += e.kind == jump;
        return false;
    };
    flow(Ball{}, {}, dropped, 0, 20, {},
         {.event = [&](const auto& e) { told += e.kind == jump; }, .ends = count},
         sections(Section{speed}));
    CHECK(told > 5);
    CHECK(asked == told);
    const auto at_jump = [](const Event<double, 2, 1>& e) { return e.kind == jump; };
    const auto r =
        flow(Ball{}, {}, dropped, 0, 20, {}, {.ends = at_jump}, sections(Section{speed}));
    CHECK(r.status == Status::event);
    CHECK(r.x[1] > 0); // it has bounced once
    // the last jump before the rest
    EventLog<double, 2, 1> log;
    flow(Ball{}, {}, dropped, 0, 40, {}, log);
    const auto rest_at = std::find_if(log.events.begin(), log.events.end(),
                                      [](const auto& e) { return e.kind == accumulation; });
    REQUIRE(rest_at != log.events.end());
    const auto before = std::count_if(log.events.begin(), rest_at, at_jump);
    std::ptrdiff_t n = 0;
    const auto at_last = [&](const Event<double, 2, 1>& e) {
        return e.kind == jump && ++n == before;
    };
    const auto last = flow(Ball{}, {}, dropped, 0, 40, {}, {.ends = at_last});
    CHECK(last.status == Status::event);
    CHECK(last.t == (rest_at - 1)->t);
    CHECK(last.mode[0] == 1);
}

TEST_CASE("observers: the choice where a solution is not unique", "[observers]") {
    const Vec<double, 1> on(0);
    for (int k = -1; k < 2; ++k) {
        int options = 0;
        const auto choose = [&](const Verdict<1>& v) {
            options = v.kept();
            return k;
        };
        const auto r = flow(Undecided{}, {}, on, 0, 1, {}, {.choose = choose});
        CHECK(options >= 2);
        CHECK(r.status == (k < 0 ? Status::ambiguous : Status::ok));
    }
    for (const int k : {-2, 3, 7, 100000})
        CHECK_THROWS_AS(
            flow(Undecided{}, {}, on, 0, 1, {}, {.choose = [k](const auto&) { return k; }}),
            std::invalid_argument);
}

TEST_CASE("observers: a run in dual numbers tells what the plain one does", "[observers]") {
    using D = Dual<double, 2>;
    const Vec<D, 2> x(D::variable(0, 0), D::variable(0, 1));
    struct Told {
        int begun = 0, events = 0, asked = 0, steps = 0, stops = 0;
        bool operator==(const Told&) const = default;
    } plain, dual;
    const auto hear = [](Told& told) {
        return Observer<double, 2, 1>{.begin = [&told](double, double) { ++told.begun; },
                                      .event = [&told](const auto&) { ++told.events; },
                                      .step = [&told](const auto&, const auto&) { ++told.steps; },
                                      .ends =
                                          [&told](const auto&) {
                                              ++told.asked;
                                              return false;
                                          },
                                      .stop =
                                          [&told] {
                                              ++told.stops;
                                              return false;
                                          },
                                      .skip = [](long long left) { return left; }};
    };
    Observer<double, 2, 1> without_skip = hear(plain);
    without_skip.skip = nullptr;
    flow(Block{}, {}, rest, 0, 30, {}, without_skip);
    flow(Block{}, {}, x, D(0), D(30), {}, hear(dual)); // derivatives do not skip
    CHECK(plain == dual);
    CHECK(plain.begun == 1);
    CHECK(plain.steps > 10);
    // a function with a state of its own is called, not copied
    int n = 0;
    const Observer<double, 2, 1> third{
        .ends = [k = 0, &n](const Event<double, 2, 1>&) mutable { return n = ++k, k == 3; }};
    CHECK(flow(Block{}, {}, x, D(0), D(30), {}, third).run.status == Status::event);
    CHECK(n == 3);
}

TEST_CASE("observers: a prescribed segment tells its steps", "[observers]") {
    long long steps = 0;
    Mode<1> below;
    below.set(0, -1);
    const auto r = segment<DormandPrince5>(Block{}, {}, below, rest, 0, 5, -1, {},
                                           {.step = [&](const auto&, const auto&) { ++steps; }});
    CHECK(steps == r.counters.steps);
    CHECK(steps > 5);
}

TEST_CASE("a trajectory begins and ends at the times that were given, and is known at every event",
          "[observers]") {
    // with a period the clock rounds where it turns absolute times into periods and back
    for (int k = 0; k < 60; ++k) {
        const double t0 = -3, t_end = -1.234e-5 * (1 + 1.7 * k);
        CAPTURE(k, t_end);
        const auto at_ends =
            sections(Section{[=](const auto& t, const auto&, const auto&) { return t - t_end; }},
                     Section{[=](const auto& t, const auto&, const auto&) { return t - t0; }});
        const auto run = simulate(Block{}, {}, Vec<double, 2>(0.3, 0.1), t0, t_end, {}, at_ends);
        REQUIRE(run.result.status == Status::ok);
        CHECK(run.t.front() == t0);
        CHECK(run.t.back() == t_end);
        CHECK(run.events.front().t == t0);
        CHECK(run.events.back().t == t_end);
        for (std::size_t i = 1; i < run.events.size(); ++i)
            CHECK(run.events[i - 1].t <= run.events[i].t);
        for (const auto& event : run.events)
            CHECK((run(event.t) - event.x_left).norm() < 1e-9);
    }
}
