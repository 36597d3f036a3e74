// SPDX-License-Identifier: BSD-3-Clause
// One random problem, and everything that is tried with it.
#pragma once

#include "curved.hpp"
#include "exact.hpp"
#include "report.hpp"

#include <filippov/engine/flow.hpp>
#include <filippov/ensemble/ensemble.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/methods/rodas5p.hpp>

#include <algorithm>
#include <chrono>
#include <random>
#include <string>

namespace filippov::stability {

template <int N, int M> class Trial {
public:
    Trial(std::uint64_t number, Report& report, bool talk)
        : number_(number), report_(report), talk_(talk), problem_(Drawn<N, M>(number).problem()),
          random_(number + 1), forwards_(problem_) {}

    void run() {
        const Vec<Long, N> start = forwards_.natural(problem_.x0);
        const Long span = (Long(problem_.t_end) - Long(problem_.t0)) * Long(problem_.speed);
        const auto exact = forwards_.run(start, problem_.t0, span, no_error);
        say(exact);
        compare(forwards_, exact, problem_.x0, problem_.t0, problem_.t_end, span, "");
        if (exact.fate != Fate::ok || exact.slides)
            return;
        // where nothing slides the way back is as determined
        const Exact<N, M> backwards(problem_, -1);
        const Vec<double, N> end = forwards_.disguised(exact.x);
        const auto back = backwards.run(backwards.natural(end), problem_.t_end, span, no_error);
        compare(backwards, back, end, problem_.t_end, problem_.t0, span, " back");
    }

private:
    using Clock = std::chrono::steady_clock;
    static inline const Vec<Long, N> no_error = Vec<Long, N>::Zero();

    void compare(const Exact<N, M>& oracle, const ExactRun<N, M>& exact, const Vec<double, N>& x0,
                 double t0, double t_end, Long span, const char* way) {
        constexpr double tolerances[] = {1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13};
        for (const double tolerance : tolerances) {
            if (!talk_ && random_() % 2)
                continue;
            const Long error = Long(tolerance) * (1 + exact.largest);
            Long bound = error;
            bool in_doubt = false;
            for (int k = 0; k < 2 * N; ++k) { // each way along each axis: some are what grows most
                const Vec<Long, N> push = Vec<Long, N>::Unit(k / 2) * (k % 2 ? -error : error) / 20;
                const auto pushed = oracle.run(oracle.natural(x0), t0, span, push);
                // where solutions are unique they depend continuously on the start, whatever
                // happens
                in_doubt = in_doubt || (problem_.passive ? pushed.fate != exact.fate
                                                         : !pushed.same_story(exact));
                bound = std::max(bound, (pushed.x - exact.x).cwiseAbs().maxCoeff());
            }
            const auto judge = [&](const char* method, Status status, double t,
                                   const Vec<double, N>& x, const std::string& message) {
                const std::chrono::duration<double> took = Clock::now() - began_;
                const Long off = x.allFinite() ? oracle.distance(x, exact.x)
                                               : std::numeric_limits<Long>::infinity();
                const double ratio = double(off / bound);
                const bool at_end = std::abs(t - t_end) <= 1e-6 * std::abs(t_end - t0);
                const Verdict verdict =
                    judged(exact, status, x.allFinite(), in_doubt, ratio, at_end);
                count(std::string(method) + way, tolerance, verdict, ratio, took.count());
                if (talk_ || verdict == wrong)
                    report(std::string(method) + way, tolerance, status, t, ratio, in_doubt, exact,
                           message);
            };
            try_methods(x0, t0, t_end, tolerance, judge);
            if (exact.fate == Fate::ok) // else nobody knows how far it goes
                try_curved(x0, t0, t_end, tolerance, double(exact.largest), judge);
            if (t_end > t0)
                try_units<DormandPrince5>("dopri5", tolerance);
            if (t_end > t0)
                try_units<DormandPrince8>("dop853", tolerance);
            if constexpr (M == 1)
                if (t_end > t0 && tolerance >= 1e-10)
                    try_units<Rodas5P>("rodas5p", tolerance);
        }
    }

    static Settings<double, N> settings_of(const Problem<N, M>& problem, double tolerance) {
        Settings<double, N> settings;
        settings.rtol = tolerance;
        settings.atol = AbsoluteTolerance<double, N>(Vec<double, N>(tolerance * problem.size));
        settings.max_steps = 200'000;
        settings.max_events = 2'000;
        return settings;
    }
    template <class Tableau>
    static auto by_flow(const Problem<N, M>& q, const Vec<double, N>& x0, double t0, double t_end,
                        double tolerance) {
        return flow<Tableau>(q.sys, Vec<double, 0>(), x0, t0, t_end, settings_of(q, tolerance));
    }

    /// The same solution in curved coordinates.
    template <class Judge>
    void try_curved(const Vec<double, N>& x0, double t0, double t_end, double tolerance,
                    double largest, const Judge& judge) {
        const Curved<N, M> sys(problem_, 1 + largest, number_);
        const Vec<double, N> start =
            sys.bent(Vec<Long, N>(x0.template cast<Long>())).template cast<double>();
        began_ = Clock::now();
        const auto r = flow<DormandPrince8>(sys, Vec<double, 0>(), start, t0, t_end,
                                            settings_of(problem_, tolerance));
        const Vec<Long, N> z = sys.straightened(Vec<Long, N>(r.x.template cast<Long>()));
        judge("dop853 curved", r.status, double(r.t), Vec<double, N>(z.template cast<double>()),
              r.message());
    }

    /// Runs the problem in its own units and in others: one in sixteen of a campaign.
    template <class Tableau> void try_units(const char* method, double tolerance) {
        if (number_ % 16 != 0 && !talk_)
            return;
        const Problem<N, M> other = in_other_units(problem_, number_);
        const auto go = [&](const Problem<N, M>& q) {
            return by_flow<Tableau>(q, q.x0, q.t0, q.t_end, tolerance);
        };
        const auto here = go(problem_), there = go(other);
        const Vec<double, N> x =
            there.x.cwiseProduct(problem_.size).cwiseQuotient(other.size); // exact
        const double off = (x - here.x).cwiseQuotient(problem_.size).cwiseAbs().maxCoeff(),
                     size = here.x.cwiseQuotient(problem_.size).cwiseAbs().maxCoeff();
        Units& units = report_.units[method];
        if (here.status == there.status && x == here.x &&
            here.counters.steps == there.counters.steps)
            ++units.same;
        else if (here.status == there.status &&
                 off <=
                     std::max(1e-12 * (1 + size), 10 * made_of_an_ulp<Tableau>(here.x, tolerance)))
            ++units.close;
        else {
            ++units.other;
            report_.failures.push_back(
                "--case " + shape() + ":" + std::to_string(number_) + "  " + method + " " +
                digits("%.0e", tolerance) + ": other units, off by " + digits("%.1e", off) + ", " +
                std::string(name(here.status)) + " and " + std::string(name(there.status)));
        }
    }

    /// What an ulp at the start makes of the end, in units of the state: rounding may change the
    /// length of a step, and the end by a part of the tolerance.
    template <class Tableau>
    double made_of_an_ulp(const Vec<double, N>& end, double tolerance) const {
        double most = 0;
        for (int k = 0; k < 1 << N; ++k) {
            const Vec<double, N> x =
                by_flow<Tableau>(problem_, nudged(problem_.x0, std::uint64_t(k)), problem_.t0,
                                 problem_.t_end, tolerance)
                    .x;
            most = std::max(most, (x - end).cwiseQuotient(problem_.size).cwiseAbs().maxCoeff());
        }
        return most;
    }
    /// Moved by an ulp in each component, this way or that by the bits of `ways`.
    static Vec<double, N> nudged(Vec<double, N> x, std::uint64_t ways) {
        for (int i = 0; i < N; ++i)
            x[i] = std::nextafter(x[i], (ways >> i) % 2 ? 1e300 : -1e300);
        return x;
    }

    template <class Judge>
    void try_methods(const Vec<double, N>& x0, double t0, double t_end, double tolerance,
                     const Judge& judge) {
        const auto one = [&](auto tableau, const char* method, const Vec<double, N>& start) {
            began_ = Clock::now();
            const auto r = by_flow<decltype(tableau)>(problem_, start, t0, t_end, tolerance);
            judge(method, r.status, double(r.t), r.x, r.message());
        };
        one(DormandPrince5{}, "dopri5", x0);
        one(DormandPrince8{}, "dop853", x0);
        one(DormandPrince8{}, "dop853 ulp", nudged(x0, number_)); // the same solution
        if constexpr (M == 1) {
            if (tolerance >= 1e-10)
                one(Rodas5P{}, "rodas5p", x0);
            if (t_end > t0) {
                began_ = Clock::now();
                const auto r = ensemble<DormandPrince8, 8>(
                    problem_.sys, {Member<N, 0>{x0, Vec<double, 0>(), t0, t_end}},
                    settings_of(problem_, tolerance), Parallel{.threads = 1});
                const auto& o = r.outcomes[0];
                judge("lanes", o.status, o.clock.absolute(), o.x, "");
            }
        }
    }

    static Verdict judged(const ExactRun<N, M>& exact, Status status, bool finite, bool in_doubt,
                          double ratio, bool at_end) {
        if (!finite)
            return wrong;
        if (exact.fate == Fate::accumulates || status == Status::max_events)
            return exact.fate == Fate::accumulates || in_doubt ? accumulation : wrong;
        if (status != Status::ok && status != Status::ambiguous)
            return wrong;
        if (in_doubt || exact.fate == Fate::undecided)
            return delicate;
        if (exact.fate == Fate::not_unique)
            return status == Status::ambiguous ? not_unique : wrong;
        // (what would not be unique after the end is no mistake)
        const bool arrived = status == Status::ok || at_end;
        return arrived && ratio <= multiple ? right : wrong;
    }

    void count(const std::string& method, double tolerance, Verdict verdict, double ratio,
               double seconds) {
        Cell& cell = report_.cells[Key{shape(), method, digits("%.0e", tolerance)}];
        ++cell.count[verdict];
        cell.seconds += seconds;
        cell.longest = std::max(cell.longest, seconds);
        if (verdict == right) {
            cell.ratios.push_back(ratio);
            if (ratio > cell.worst) {
                cell.worst = ratio;
                cell.worst_case = number_;
            }
        }
    }

    static std::string shape() { return std::to_string(N) + "," + std::to_string(M); }

    void report(const std::string& method, double tolerance, Status status, double t, double ratio,
                bool in_doubt, const ExactRun<N, M>& exact, const std::string& message) {
        report_.failures.push_back(
            "--case " + shape() + ":" + std::to_string(number_) + "  " + method + " " +
            digits("%.0e", tolerance) + ": " + std::string(name(status)) + " after " +
            digits("%.6g", (t - problem_.t0) * problem_.speed) + " of " +
            digits("%.6g", (problem_.t_end - problem_.t0) * problem_.speed) + ", off by " +
            digits("%.1e", ratio) + (in_doubt ? ", delicate" : "") + "; exactly " +
            std::to_string(int(exact.fate)) + " at " + digits("%.6g", double(exact.t)) + ", " +
            std::to_string(exact.events.size()) + " events, start " +
            std::to_string(problem_.start) + (problem_.passive ? "" : ", not passive") +
            (message.empty() ? "" : ". " + message));
    }

    void say(const ExactRun<N, M>& exact) const {
        if (!talk_)
            return;
        std::printf("forced %d, moving %d, speed %g\n", problem_.sys.omega > 0,
                    !problem_.sys.q.isZero(0), problem_.speed);
        for (const auto& e : exact.events) {
            std::printf("%.15Lf ", e.t);
            for (int j = 0; j < M; ++j)
                std::printf(" %+d", e.mode[j]);
            std::printf("\n");
        }
    }

    std::uint64_t number_;
    Report& report_;
    bool talk_;
    Problem<N, M> problem_;
    std::mt19937_64 random_;
    Exact<N, M> forwards_;
    Clock::time_point began_{}; ///< of the run that is judged next
};

template <int N, int M> void try_problem(std::uint64_t number, Report& report, bool talk) {
    Trial<N, M>(number, report, talk).run();
}

} // namespace filippov::stability
