// SPDX-License-Identifier: BSD-3-Clause
// What does each skip save? Every row is the same run with one thing done that the scene does not
// need.

#include "measure.hpp"

#include <filippov/engine/trajectory.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/models/oscillator.hpp>

#include <cmath>
#include <cstdio>

namespace {

using namespace filippov;
using Sys = models::Oscillator;

/// Looks at every step, and keeps nothing.
struct StepsSeen {
    long long n = 0;
    operator Observer<double, 2, 1>() {
        return {.step = [this](const auto&, const auto&) { ++n; }};
    }
};

/// Asks for the interpolant of every step.
struct MiddleOfEveryStep {
    double sum = 0;
    operator Observer<double, 2, 1>() {
        return {.step = [this](const auto&, const auto& path) { sum += path(0.5)[0]; }};
    }
};

/// The oscillator without what it says about itself: no closed forms, no gradient.
struct Bare {
    static constexpr int dim = 2;
    static constexpr auto params = Sys::params;
    static constexpr auto defaults = Sys::defaults;
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return Sys{}.f1(t, x, p);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return Sys{}.f2(t, x, p);
    }
    template <Scalar S> S h(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return Sys{}.h(t, x, p);
    }
    template <Scalar S> S period(const Vec<S, 10>& p) const { return Sys{}.period(p); }
};

/// The oscillator whose sides are its blend at s = -1 and +1.
struct ThroughBlend : Sys {
    template <Scalar S> Vec<S, 2> f1(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return blended(S(-1), t, x, p);
    }
    template <Scalar S> Vec<S, 2> f2(const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) const {
        return blended(S(1), t, x, p);
    }
    /// Both sides, and their blend (4.11).
    template <Scalar S>
    static Vec<S, 2> blended(const S& s, const S& t, const Vec<S, 2>& x, const Vec<S, 10>& p) {
        const Vec<S, 2> a = Sys{}.f1(t, x, p), b = Sys{}.f2(t, x, p);
        return Vec<S, 2>(S(0.5) * (S(1) - s) * a + S(0.5) * (S(1) + s) * b);
    }
};

struct Case {
    const char* what;
    std::function<Vec<double, 2>()> run;
};

template <class Tableau> std::vector<Case> cases(double tolerance) {
    static const Sys sys;
    static const auto p = default_params<Sys>();
    const double t_end = 200 * sys.period(p);
    const Vec<double, 2> x0(0, 0);
    const Settings<double, 2> plain{.rtol = tolerance, .atol = tolerance};
    Settings<double, 2> always = plain, integrated = plain;
    always.skip_root_search = false;
    integrated.closed_form_slides = false;
    const auto with = [=](auto observer, const Settings<double, 2>& settings) {
        return [=]() mutable {
            auto fresh = observer;
            return flow<Tableau>(sys, p, x0, 0.0, t_end, settings, fresh).x;
        };
    };
    return {{"nothing but the final state", with(Observer<double, 2, 1>{}, plain)},
            {"+ event log", with(EventLog<double, 2, 1>{}, plain)},
            {"+ a look at every step", with(StepsSeen{}, plain)},
            {"+ an interpolant in every step", with(MiddleOfEveryStep{}, plain)},
            {"+ everything stored, dense",
             [=] { return simulate<Tableau>(sys, p, x0, 0.0, t_end, plain).result.x; }},
            {"+ a root search in every step", with(Observer<double, 2, 1>{}, always)},
            {"+ slides integrated", with(Observer<double, 2, 1>{}, integrated)},
            {"+ both fields in slip, blended",
             [=] { return flow<Tableau>(ThroughBlend{}, p, x0, 0.0, t_end, plain).x; }},
            {"+ no closed forms, no gradient given",
             [=] { return flow<Tableau>(Bare{}, p, x0, 0.0, t_end, plain).x; }}};
}

template <class Tableau>
bool measure(const char* method, const bench::Options& options, nlohmann::json& results) {
    const double tolerance = 1e-8;
    const auto all = cases<Tableau>(tolerance);
    std::vector<std::function<void()>> timed;
    bool right = true;
    const Vec<double, 2> x = all[0].run();
    for (const Case& c : all) {
        // the same run to about the tolerance, whatever was done besides
        right = right && (c.run() - x).cwiseAbs().maxCoeff() < 1e3 * tolerance;
        timed.push_back([&c] { static_cast<void>(c.run()); });
    }
    const auto ms = bench::time_in_turns(timed, options.turns);
    std::printf("%s, tolerance %.0e\n", method, tolerance);
    for (std::size_t i = 0; i < all.size(); ++i) {
        std::printf("  %-38s %8.3f ms   x %.2f\n", all[i].what, ms[i], ms[i] / ms[0]);
        results.push_back(
            {{"method", method}, {"what", all[i].what}, {"ms", ms[i]}, {"ratio", ms[i] / ms[0]}});
    }
    return right;
}

/// Many starts over five periods: each by itself, and in the lanes of a register.
bool measure_lanes(const bench::Options& options, nlohmann::json& results) {
    const Sys sys;
    const auto p = default_params<Sys>();
    std::vector<Member<2, 10>> members;
    for (int i = 0; i < 512; ++i)
        members.push_back({{-4 + i / 64.0, 0.5}, p, 0.0, 5 * sys.period(p)});
    const Settings<double, 2> settings{.rtol = 1e-8, .atol = 1e-8};
    const Parallel one{.threads = 1};
    Ensemble<2> alone, together;
    const auto ms = bench::time_in_turns(
        {[&] { alone = ensemble<DormandPrince8, 1>(sys, members, settings, one); },
         [&] { together = ensemble<DormandPrince8>(sys, members, settings, one); }},
        options.turns);
    double apart = 0;
    for (std::size_t i = 0; i < members.size(); ++i)
        apart =
            std::max(apart, (alone.outcomes[i].x - together.outcomes[i].x).cwiseAbs().maxCoeff());
    std::printf("512 starts over 5 periods, dop853\n");
    std::printf("  %-38s %8.3f ms   x %.2f\n", "in lanes", ms[1], 1.0);
    std::printf("  %-38s %8.3f ms   x %.2f\n", "+ one after another", ms[0], ms[0] / ms[1]);
    results.push_back({{"method", "dop853"},
                       {"what", "512 starts one after another, not in lanes"},
                       {"ms", ms[0]},
                       {"ratio", ms[0] / ms[1]}});
    return apart < 1e-6;
}

} // namespace

int main(int argc, char** argv) {
    const auto options = bench::parse(argc, argv, "What each skip saves");
    nlohmann::json results = nlohmann::json::array();
    const bool right5 = measure<DormandPrince5>("dopri5", options, results);
    const bool right8 = measure<DormandPrince8>("dop853", options, results);
    const bool right_lanes = measure_lanes(options, results);
    bench::write_json(options, results);
    const bool right = right5 && right8 && right_lanes;
    if (!right)
        std::printf("a run is wrong: the cases do not agree\n");
    return right ? 0 : 1;
}
