// SPDX-License-Identifier: BSD-3-Clause
// Populations that hear of their members' events: those of `flow`, at its times.

#include "ensembles.hpp"

#include <filippov/ensemble/any_lanes.hpp>
#include <filippov/models/blocks.hpp>
#include <filippov/models/impacts.hpp>

using namespace ensembles;

namespace {

template <class Sys> class Heard final : public Population<dim_v<Sys>, params_v<Sys>> {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;

public:
    explicit Heard(const Members<Sys>& members)
        : events(members.size()), ends(members.size()), members_(members) {
        this->hears = true;
    }
    Member<N, P> member(std::size_t id) override { return members_[id]; }
    void hear(std::size_t id, const MemberEvent<N>& e) override { events[id].push_back(e); }
    void take(std::size_t id, const Outcome<N>& o) override { ends[id] = o; }

    std::vector<std::vector<MemberEvent<N>>> events;
    std::vector<Outcome<N>> ends;

private:
    const Members<Sys>& members_;
};

/// What `flow` counts as an event of a member.
template <class Sys, int N = dim_v<Sys>, int M = surfaces_v<Sys>>
std::vector<Event<double, N, M>> events_of(const Sys& sys, const MemberOf<Sys>& m,
                                           const Settings<double, N>& settings) {
    std::vector<Event<double, N, M>> all;
    const Observer<double, N, M> observer{.event = [&](const Event<double, N, M>& e) {
        if (is_change(e.kind) || e.kind == EventKind::jump)
            all.push_back(e);
    }};
    flow<DormandPrince8>(sys, m.p, m.x, m.t0, m.t_end, settings, observer);
    return all;
}

template <class Sys>
void compare(const Sys& sys, const Members<Sys>& members, double tol, std::size_t least) {
    constexpr int N = dim_v<Sys>;
    const auto settings = tolerance<Sys>(tol);
    Heard<Sys> heard(members);
    run_population<DormandPrince8, 8>(sys, members.size(), heard, settings, within_time(2));
    std::size_t n = 0;
    for (std::size_t id = 0; id < members.size(); ++id) {
        CAPTURE(id);
        const auto& events = heard.events[id];
        const auto expected = events_of(sys, members[id], settings);
        REQUIRE(events.size() == expected.size());
        CHECK(events.size() == std::size_t(heard.ends[id].events));
        int before = 0;
        for (std::size_t k = 0; k < events.size(); ++k) {
            const MemberEvent<N>& e = events[k];
            CHECK(e.kind == expected[k].kind);
            CHECK(e.surface == expected[k].surface);
            CHECK(e.before == expected[k].mode_before.code());
            CHECK(e.after == expected[k].mode_after.code());
            CHECK(e.clock.index == expected[k].period);
            CHECK(std::abs(e.clock.local - expected[k].t_local) < 1e4 * tol);
            CHECK((e.x - expected[k].x_right).norm() < 1e4 * tol);
            CHECK((k == 0 || e.before == before));
            before = e.after;
        }
        n += events.size();
    }
    CHECK(n >= least);
}

Members<Oscillator> oscillators(double periods) {
    Members<Oscillator> m;
    for (int i = 0; i < 10; ++i)
        for (int j = 0; j < 10; ++j) {
            Params<Oscillator, double> p = default_params<Oscillator>();
            p[0] = 0.2 + 0.4 * i;
            p[1] = 0.7 + 0.2 * j;
            m.push_back({{0.1, 1.0}, p, 0.3, 0.3 + periods * Oscillator{}.period(p)});
        }
    return m;
}

} // namespace

TEST_CASE("hearing: of members in lanes", "[ensemble]") {
    compare(Oscillator{}, oscillators(6), 1e-10, 500);
}
TEST_CASE("hearing: of members whose slides are not known in closed form", "[ensemble]") {
    Members<Unsolved<Oscillator>> members;
    for (const auto& m : oscillators(6))
        members.push_back({m.x, m.p, m.t0, m.t_end});
    compare(Unsolved<Oscillator>{}, members, 1e-10, 500);
}
TEST_CASE("hearing: of members that run alone", "[ensemble]") {
    Members<OneByOne> members;
    for (const auto& m : oscillators(6))
        members.push_back({m.x, m.p, m.t0, m.t_end});
    compare(OneByOne{}, members, 1e-10, 500);
}
TEST_CASE("hearing: of members that run backwards", "[ensemble]") {
    Members<Oscillator> members;
    for (auto m : oscillators(1)) {
        m.x = Vec<double, 2>(0.3, 5.0);
        m.t_end = -1.5 * m.t_end;
        members.push_back(m);
    }
    compare(Oscillator{}, members, 1e-10, 50);
}
TEST_CASE("hearing: of several surfaces, and of jumps", "[ensemble]") {
    using Blocks = models::BeltChain<3>;
    Vec<double, 6> x = Vec<double, 6>::Zero();
    for (int i = 0; i < 3; ++i)
        x[2 * i] = 0.5 - 0.37 * i + 0.05 * i * i;
    compare(Blocks{}, {{x, default_params<Blocks>(), 0, 30}}, 1e-10, 10);
    using Ball = models::BouncingBall;
    compare(Ball{}, {{Vec<double, 2>(1, 0), default_params<Ball>(), 0, 2}}, 1e-10, 2);
}
TEST_CASE("hearing: who does not want to know is not told", "[ensemble]") {
    const auto members = oscillators(6);
    Heard<Oscillator> heard(members);
    heard.hears = false;
    run_population<DormandPrince8, 8>(Oscillator{}, members.size(), heard,
                                      tolerance<Oscillator>(1e-6), within_time());
    for (const auto& events : heard.events)
        CHECK(events.empty());
}
TEST_CASE("hearing: through a population and lanes whose sizes are forgotten", "[ensemble]") {
    const auto members = oscillators(6);
    Heard<Oscillator> heard(members), direct(members);
    const RunSettings settings{.rtol = 1e-9, .atol = {1e-9, 1e-9}, .method = Method::dop853};
    ErasedPopulation<2, 10> erased(heard);
    any_lanes(Oscillator{})->run(members.size(), erased, settings, within_time());
    run_population<DormandPrince8>(Oscillator{}, members.size(), direct,
                                   tolerance<Oscillator>(1e-9), within_time());
    for (std::size_t id = 0; id < members.size(); ++id) {
        CHECK(same(heard.ends[id], direct.ends[id]));
        CHECK(heard.ends[id].steps == direct.ends[id].steps);
        REQUIRE(heard.events[id].size() == direct.events[id].size());
        for (std::size_t k = 0; k < heard.events[id].size(); ++k) {
            const auto &a = heard.events[id][k], &b = direct.events[id][k];
            CHECK(a.kind == b.kind);
            CHECK(a.surface == b.surface);
            CHECK(a.before == b.before);
            CHECK(a.after == b.after);
            CHECK(a.clock.index == b.clock.index);
            CHECK(a.clock.local == b.clock.local);
            CHECK(a.x == b.x);
        }
    }
}
