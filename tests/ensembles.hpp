// SPDX-License-Identifier: BSD-3-Clause
// Ensembles for tests: runs that cannot hang, and what `flow` says of their members.
#pragma once

#include "catch.hpp"

#include <filippov/ensemble/ensemble.hpp>
#include <filippov/models/oscillator.hpp>
#include <filippov/run/observers.hpp>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace ensembles {

using namespace filippov;

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

using Oscillator = models::Oscillator;

template <class Sys> using MemberOf = Member<dim_v<Sys>, params_v<Sys>>;
template <class Sys> using Members = std::vector<MemberOf<Sys>>;

template <class Sys> Settings<double, dim_v<Sys>> tolerance(double each) {
    return {.rtol = each, .atol = AbsoluteTolerance<double, dim_v<Sys>>(each)};
}

/// Nothing here takes a second; what goes round for ever is cancelled, and fails.
inline Parallel within_time(int threads = 1) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    return {.threads = threads,
            .cancelled = [end] { return std::chrono::steady_clock::now() > end; }};
}
template <class Tableau = DormandPrince8, int W = 8, class Sys>
Ensemble<dim_v<Sys>> run(const Sys& sys, const Members<Sys>& members,
                         const Settings<double, dim_v<Sys>>& settings, int threads = 1) {
    auto r = ensemble<Tableau, W>(sys, members, settings, within_time(threads));
    REQUIRE(r.status == Status::ok);
    return r;
}

inline bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
template <int N> bool same(const Outcome<N>& a, const Outcome<N>& b) {
    bool x = true;
    for (int i = 0; i < N; ++i)
        x = x && same_bits(a.x[i], b.x[i]);
    return x && a.status == b.status && a.mode == b.mode && a.events == b.events &&
           a.slides == b.slides && same_bits(a.slide_time, b.slide_time) &&
           a.clock.index == b.clock.index && same_bits(a.clock.local, b.clock.local) &&
           same_bits(a.clock.carry, b.clock.carry);
}

/// Numbers that are the same everywhere.
class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double operator()(double low, double high) {
        return low + (high - low) * (static_cast<double>(bits_() >> 11) * 0x1p-53);
    }
    std::size_t below(std::size_t n) { return static_cast<std::size_t>(bits_() % n); }

private:
    std::mt19937_64 bits_;
};

/// The oscillator, were it not fit for lanes.
struct OneByOne : Oscillator {
    static constexpr bool lanes = false;
};
/// A system, were its slides not known in closed form.
template <class Sys> struct Unsolved : Sys {
    void sliding_flow() const = delete;
    void equivalent_control() const = delete;
};
static_assert(RunsInLanes<Oscillator> && !RunsInLanes<OneByOne>);
static_assert(RunsInLanes<Unsolved<Oscillator>>);
static_assert(HasSlidingFlow<Oscillator, double> && HasSlidingFlow<Oscillator, Lanes<8>>);
static_assert(!HasSlidingFlow<Unsolved<Oscillator>, Lanes<8>> &&
              !HasEquivalentControl<Unsolved<Oscillator>, Lanes<8>>);

inline Oscillator::P<double> forced(double A = 3.6, double omega = 1.067) {
    auto p = default_params<Oscillator>();
    p[0] = A;
    p[1] = omega;
    return p;
}
double period_of(const auto& p) { return Oscillator{}.period(p); }

/// A grid of starts of the oscillator, each at its own phase.
inline Members<Oscillator> grid(int n, double periods) {
    const auto p = forced();
    const double T = period_of(p);
    Members<Oscillator> m;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double t0 = 0.13 * i * j - 2;
            m.push_back(
                {{-4 + 8 * (i + 0.5) / n, -3 + 7 * (j + 0.5) / n}, p, t0, t0 + periods * T});
        }
    return m;
}

/// What the scalar engine says of a member.
template <class Tableau, class Sys>
Outcome<dim_v<Sys>> by_flow(const Sys& sys, const MemberOf<Sys>& m,
                            const Settings<double, dim_v<Sys>>& settings,
                            EventLog<double, dim_v<Sys>, 1>* keep = nullptr) {
    EventLog<double, dim_v<Sys>, 1> log;
    const auto r = flow<Tableau>(sys, m.p, m.x, m.t0, m.t_end, settings, log);
    Outcome<dim_v<Sys>> o;
    o.status = r.status;
    o.x = r.x;
    o.clock = r.clock;
    o.mode = r.mode[0];
    for (std::size_t k = 1; k < log.events.size(); ++k) {
        const auto &before = log.events[k - 1], &e = log.events[k];
        if (before.mode_after[0] == 0)
            o.slide_time += std::abs(e.t - before.t);
        if (e.kind == EventKind::start || e.kind == EventKind::end)
            continue;
        o.events += e.mode_before != e.mode_after;
        o.slides += e.mode_before[0] != 0 && e.mode_after[0] == 0;
    }
    if (keep != nullptr)
        *keep = log;
    return o;
}

} // namespace ensembles
