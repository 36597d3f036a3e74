// SPDX-License-Identifier: BSD-3-Clause
// Modules that are compiled for other instruction sets, and with other options: what goes between
// them arrives as it was sent, or is known not to.
#include "../python/src/instruction_set.hpp"
#include "catch.hpp"
#include "seam/module.hpp"

#include <filippov/ensemble/seam.hpp>

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

using namespace seam;

namespace {

using Table = std::map<std::string, std::string>;

/// A module, loaded as Python loads its own: none sees another's functions.
class Module {
public:
    explicit Module(const std::string& name)
        : handle_(::dlopen((FILIPPOV_SEAM_FOLDER "/seam_" + name + ".so").c_str(),
                           RTLD_NOW | RTLD_LOCAL)) {
        INFO(name << ": " << (handle_ == nullptr ? ::dlerror() : "loaded"));
        REQUIRE(handle_ != nullptr);
    }
    template <class Function> Function get(const char* name) const {
        void* const address = ::dlsym(handle_, name);
        REQUIRE(address != nullptr);
        Function function;
        std::memcpy(&function, &address, sizeof function);
        return function;
    }
    Table facts() const {
        Table all;
        get<Facts>("seam_facts")(&all, [](void* to, const char* what, const char* value) {
            (*static_cast<Table*>(to))[what] = value;
        });
        return all;
    }

private:
    void* const handle_; ///< not closed: objects of the module may outlive this
};

Table own_facts() {
    const auto all = seam_facts();
    return {all.begin(), all.end()};
}

/// Those that this processor can run.
std::vector<std::string> levels() {
    std::vector<std::string> all{"baseline"};
    const std::string best = python::instruction_set();
    if (best != "baseline")
        all.emplace_back("avx2");
    if (best == "avx512")
        all.emplace_back("avx512");
    return all;
}

/// Numbers of which no two are alike.
Sent sent_of(int n) {
    Sent sent{.t0 = 0.25,
              .dt = -3.5,
              .x = {},
              .p = {-1.5, 2.5, -4.5},
              .max_steps = 1LL << 40,
              .max_events = (1LL << 41) + 1,
              .before = -1,
              .guard = 5,
              .ends_at_exit = n % 2 == 0};
    for (int i = 0; i < n; ++i)
        sent.x[i] = 100 + i;
    return sent;
}

/// Notes what comes to it, and answers with numbers of its own.
template <int N> class Echo final : public ScalarEngine<N, n_params> {
public:
    StretchEnd<N> run(const Stretch<N, n_params>& stretch, Worker& worker,
                      StretchListener<N>* listener) const override {
        stopped = worker.stopped();
        came = {stretch.t0,
                stretch.dt,
                {},
                {},
                stretch.max_steps,
                stretch.max_events,
                stretch.before,
                stretch.guard,
                stretch.ends_at_exit};
        std::copy(stretch.x.begin(), stretch.x.end(), came.x);
        std::copy(stretch.p.begin(), stretch.p.end(), came.p);
        StretchEnd<N> end;
        end.status = Status::ambiguous;
        end.clock = {0.5, -(1LL << 42), 0.125, 0x1p-60};
        end.steps = (1LL << 43) + 1;
        end.slide_time = 7.25;
        end.mode = -2;
        end.events = 3;
        end.slides = 4;
        StretchEvent<N> event{.kind = 6,
                              .surface = 7,
                              .before = -13,
                              .after = 12,
                              .period = -(1LL << 44),
                              .t_local = 0.375};
        for (std::size_t i = 0; i < end.x.size(); ++i) {
            end.x[i] = 200 + double(i);
            event.x[i] = 300 + double(i);
        }
        listener->hear(event);
        listener->hear(event);
        return end;
    }
    mutable Sent came{};
    mutable bool stopped = false;
};

template <int N> void compare(const Module& module) {
    INFO(N << " components");
    const Echo<N> engine;
    const ScalarEngine<N, n_params>* const any = &engine;
    const Sent sent = sent_of(N);
    Came came{};
    REQUIRE(module.get<HandOver>("seam_hand_over")(N, any, &sent, &came));
    CHECK(engine.stopped);
    CHECK(engine.came.t0 == sent.t0);
    CHECK(engine.came.dt == sent.dt);
    CHECK(engine.came.max_steps == sent.max_steps);
    CHECK(engine.came.max_events == sent.max_events);
    CHECK(engine.came.before == sent.before);
    CHECK(engine.came.guard == sent.guard);
    CHECK(engine.came.ends_at_exit == sent.ends_at_exit);
    for (int k = 0; k < n_params; ++k)
        CHECK(engine.came.p[k] == sent.p[k]);
    CHECK(came.status == Status::ambiguous);
    CHECK(came.period == 0.5);
    CHECK(came.index == -(1LL << 42));
    CHECK(came.local == 0.125);
    CHECK(came.carry == 0x1p-60);
    CHECK(came.steps == (1LL << 43) + 1);
    CHECK(came.slide_time == 7.25);
    CHECK(came.mode == -2);
    CHECK(came.events == 3);
    CHECK(came.slides == 4);
    CHECK(came.n_told == 2);
    CHECK(came.kind == 6);
    CHECK(came.surface == 7);
    CHECK(came.before == -13);
    CHECK(came.after == 12);
    CHECK(came.period_told == -(1LL << 44));
    CHECK(came.t_told == 0.375);
    for (int i = 0; i < N; ++i) {
        CHECK(engine.came.x[i] == sent.x[i]);
        CHECK(came.x[i] == 200 + i);
        CHECK(came.x_told[i] == 300 + i);
    }
}

constexpr double p[2]{0.1, 0.1};

/// Where member `id` begins: close to (0.1, 0.9), from where the surface is touched.
template <int N> std::array<double, std::size_t(N)> start(std::size_t id) {
    std::array<double, std::size_t(N)> x;
    for (std::size_t i = 0; i < x.size(); ++i)
        x[i] = 1.0 + double(i);
    x[0] = 0.1;
    x[1] = 0.9 + 1e-7 * (double(id % 5) - 2);
    return x;
}
/// How long it runs; lanes run forwards only.
double span(std::size_t id) { return id % 3 == 2 ? -5 : 5; }

template <int N> class Members final : public AnyPopulation {
public:
    void member(std::size_t id, MemberView& m) override {
        std::ranges::copy(start<N>(id), m.x.begin());
        std::copy_n(p, 2, m.p.begin());
        m.t0 = 0;
        m.t_end = span(id);
    }
    void take(std::size_t id, const OutcomeView& o) override {
        status[id] = o.status;
        events[id] = o.events;
        t[id] = o.clock.absolute();
        x[id].assign(o.x.begin(), o.x.end());
    }
    static constexpr std::size_t size = 30;
    std::array<Status, size> status{};
    std::array<int, size> events{};
    std::array<double, size> t{};
    std::array<std::vector<double>, size> x;
};

/// What the engine says without a seam.
template <int N> StretchEnd<N> at_home(std::size_t id) {
    const FlowEngine<Chain<N>, DormandPrince8> engine(Chain<N>{}, {});
    Stretch<N, 2> stretch;
    stretch.x = start<N>(id);
    stretch.p = {p[0], p[1]};
    stretch.dt = span(id);
    stretch.max_steps = stretch.max_events = 10'000;
    const Parallel how;
    Worker worker(how, 1);
    return engine.run(stretch, worker, nullptr);
}

template <int N> void compare_lanes(const Module& module) {
    const std::shared_ptr<const AnyScalar> scalar = any_scalar(Chain<N>{});
    std::shared_ptr<const AnyLanes> there;
    module.get<MakeLanes>("seam_lanes")(N, &scalar, &there);
    REQUIRE(there->dim() == N);
    Members<N> members;
    const auto run = there->run(members.size, members, RunSettings{}, {.threads = 1});
    CHECK(run.status == Status::ok);
    CHECK(run.counters.handed_over >= 10); // all that run backwards
    for (std::size_t id = 0; id < members.size; ++id) {
        INFO("member " << id << " of " << N << " components");
        const StretchEnd<N> end = at_home<N>(id);
        CHECK(members.status[id] == end.status);
        CHECK(members.events[id] == end.events);
        CHECK(members.t[id] == span(id));
        REQUIRE(members.x[id].size() == end.x.size());
        for (std::size_t i = 0; i < end.x.size(); ++i) // both to a tolerance of 1e-8
            CHECK(std::abs(members.x[id][i] - end.x[i]) < 1e-6 * (1 + std::abs(end.x[i])));
    }
}

} // namespace

TEST_CASE("seam: every number of components arrives as it was sent", "[seam]") {
    for (const std::string& level : levels()) {
        INFO(level);
        const Module module(level);
        [&]<int... N>(std::integer_sequence<int, N...>) {
            (compare<N>(module), ...);
        }(std::integer_sequence<int, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 32>{});
    }
}

TEST_CASE("seam: members of four and eight components go through lanes of every instruction set",
          "[seam]") {
    for (const std::string& level : levels()) {
        INFO(level);
        const Module module(level);
        compare_lanes<4>(module);
        compare_lanes<8>(module);
    }
}

TEST_CASE("seam: instruction sets do not change what crosses, though they change Eigen's vectors",
          "[seam]") {
    const Table ours = own_facts();
    CHECK(ours.size() == seam_facts().size()); // each has a name of its own
    for (const std::string& level : levels()) {
        INFO(level);
        const Module module(level);
        CHECK(module.facts() == ours);
        // without which this file would test nothing
        const auto alignment = module.get<Alignment>("seam_alignment")();
        if (level == "avx512")
            CHECK(alignment == 64);
        else if (level == "avx2")
            CHECK(alignment == 32);
    }
}

#if defined(__GLIBCXX__) && !defined(_GLIBCXX_DEBUG)
TEST_CASE("seam: another layout of the standard library is told", "[seam]") {
    const Module module("debug");
    const Table theirs = module.facts(), ours = own_facts();
    CHECK(theirs.at("size of std::vector") != ours.at("size of std::vector"));
    CHECK(theirs.at("TapeProgram::slide") != ours.at("TapeProgram::slide"));
    CHECK(theirs.at("StretchEnd::x of 4 components") == ours.at("StretchEnd::x of 4 components"));
}
#endif

TEST_CASE("seam: lanes refuse the scalar engine of a system of another size", "[seam]") {
    const Module module("baseline");
    const std::shared_ptr<const AnyScalar> scalar = any_scalar(Chain<8>{});
    std::shared_ptr<const AnyLanes> lanes;
    CHECK_THROWS_WITH(module.get<MakeLanes>("seam_lanes")(4, &scalar, &lanes),
                      "filippov: scalar->dim() = 8: expected the scalar engine of the same system, "
                      "of dim 4 and 2 parameters");
}
