// SPDX-License-Identifier: BSD-3-Clause
// What does each further surface cost?
//
// Chains of n blocks on a belt, n surfaces and 2n components: a step of slip, a step of a slide on
// all n surfaces, and a whole run with its events, a component and an event.

#include "measure.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/models/blocks.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

using namespace filippov;

template <int n> struct Chain {
    using Sys = models::BeltChain<n>;
    static constexpr int N = 2 * n;
    const Sys sys{};
    const Params<Sys, double> p = default_params<Sys>();

    /// All blocks stick on the belt.
    Vec<double, N> stuck() const {
        Vec<double, N> x;
        for (int i = 0; i < n; ++i) {
            x[2 * i] = 0;
            x[2 * i + 1] = p[0];
        }
        return x;
    }
    /// All slip against it, and none meets it soon.
    Vec<double, N> slipping() const {
        Vec<double, N> x = stuck();
        for (int i = 0; i < n; ++i)
            x[2 * i + 1] = -3 - 0.1 * i;
        return x;
    }
    Vec<double, N> scattered() const {
        Vec<double, N> x = stuck();
        for (int i = 0; i < n; ++i) {
            x[2 * i] = 0.5 - 0.37 * i + 0.05 * i * i;
            x[2 * i + 1] = 0;
        }
        return x;
    }
    FlowResult<double, N, n> run(const Vec<double, N>& x0, double t_end, double step) const {
        Settings<double, N> settings{.rtol = 1e-8, .atol = 1e-10};
        if (step > 0)
            settings.fixed_step = step;
        return flow<DormandPrince5>(sys, p, x0, 0.0, t_end, settings);
    }
};

struct Row {
    int n = 0;
    double slip = 0, slide = 0; ///< ns a step
    double run = 0;             ///< ms
    long long steps = 0, events = 0;
};

template <int n> Row measure(int turns) {
    const Chain<n> chain;
    const int n_steps = 2000;
    const auto steps = [&](const auto& x0) { return chain.run(x0, 0.2, 0.2 / n_steps); };
    const auto whole = [&] { return chain.run(chain.scattered(), 200, 0); };
    // answers first: nothing happens in the steps, a slide keeps the blocks on the belt
    const auto slid = steps(chain.stuck()), slipped = steps(chain.slipping());
    const auto full = whole();
    bool right = slid.counters.events == 0 && slipped.counters.events == 0 &&
                 slid.mode.sliding() == n && slipped.mode.sliding() == 0 &&
                 full.status == Status::ok && full.counters.events > 20;
    for (int i = 0; i < n; ++i)
        right = right && slid.x[2 * i + 1] == chain.p[0] &&
                std::abs(slid.x[2 * i] - 0.2 * chain.p[0]) < 1e-12;
    if (!right) {
        std::fprintf(stderr, "a chain of %d blocks does not do what it should\n", n);
        std::exit(1);
    }
    const auto ms = bench::time_in_turns(
        {[&] { steps(chain.slipping()); }, [&] { steps(chain.stuck()); }, [&] { whole(); }}, turns,
        bench::cpu_ms);
    return {n,     ms[0] * 1e6 / n_steps, ms[1] * 1e6 / n_steps,
            ms[2], full.counters.steps,   full.counters.events};
}

} // namespace

int main(int argc, char** argv) {
    const auto options = filippov::bench::parse(argc, argv, "What does each further surface cost?");
    const std::vector<Row> rows{measure<1>(options.turns), measure<2>(options.turns),
                                measure<3>(options.turns), measure<4>(options.turns),
                                measure<6>(options.turns)};
    std::printf("%8s  %12s %12s  %8s  %10s %8s %8s  %14s\n", "surfaces", "slip ns/step",
                "slide ns/step", "slide/slip", "run ms", "steps", "events", "us an event");
    nlohmann::json results;
    for (const Row& r : rows) {
        std::printf("%8d  %12.0f %13.0f  %10.1f  %10.3f %8lld %8lld  %14.2f\n", r.n, r.slip,
                    r.slide, r.slide / r.slip, r.run, r.steps, r.events,
                    1e3 * r.run / double(r.events));
        results.push_back({{"surfaces", r.n},
                           {"slip_ns", r.slip},
                           {"slide_ns", r.slide},
                           {"run_ms", r.run},
                           {"steps", r.steps},
                           {"events", r.events}});
    }
    filippov::bench::write_json(options, results);
}
