// SPDX-License-Identifier: BSD-3-Clause
// What came of a problem: right, delicate or wrong, by the rules of the first campaign.
#pragma once

#include "../stability/report.hpp"
#include "problem.hpp"

#include <algorithm>
#include <chrono>
#include <functional>

namespace filippov::strangers {

using stability::Cell;
using stability::digits;
using stability::multiple;
using stability::Report;
using stability::Verdict;

/// Makes problem `number` of a family.
using Draw = std::function<std::unique_ptr<Problem>(std::uint64_t number)>;

/// Tries everything with one problem.
class Trial {
public:
    Trial(const std::string& family, const Problem& problem, std::uint64_t number, Report& report,
          bool talk)
        : family_(family), problem_(problem), number_(number), report_(report), talk_(talk),
          dice_(number + 1) {}

    void run() {
        const Long speed = problem_.disguise.speed;
        const Natural start = problem_.disguise.exact(problem_.x0);
        if (talk_)
            std::printf("%s\nfrom (%.17Lg, %.17Lg, %.17Lg, %.17Lg) at %.17Lg to %.17Lg\n",
                        problem_.text().c_str(), start[0], start[1], start[2], start[3],
                        speed * problem_.t0, speed * problem_.t_end);
        const Exactly exact = way(problem_.x0, problem_.t0, problem_.t_end, "");
        if (exact.fate != Exactly::ok || exact.slides || !problem_.back)
            return;
        way(problem_.disguise.seen(exact.z), problem_.t_end, problem_.t0, " back");
    }

private:
    using Clock = std::chrono::steady_clock;
    static constexpr double tolerances[] = {1e-3, 1e-4, 1e-6, 1e-8, 1e-10};

    /// What errors of a tolerance's size in every step make of a run.
    struct Bounds {
        bool in_doubt = false;
        Long state = 0;
        std::vector<Long> times, met;
    };

    Exactly way(const std::array<double, most>& x0, double t0, double t_end, const char* mark) {
        const Long speed = problem_.disguise.speed;
        const Natural z0 = problem_.disguise.exact(x0);
        const auto follow = [&](const Nudge& nudge) {
            return problem_.follow(z0, speed * t0, speed * t_end, nudge);
        };
        const Exactly exact = follow({});
        if (talk_)
            say(exact);
        for (const double tolerance : tolerances) {
            if (!talk_ && dice_.chance(0.6))
                continue;
            const Long size =
                std::max({exact.largest, problem_.disguise.largest_seen(x0),
                          problem_.disguise.largest_seen(problem_.disguise.seen(exact.z))});
            const Bounds bounds = bounds_of(exact, Long(tolerance) * (1 + size), tolerance, follow);
            // (what is in doubt is tried now and then: it has to end, and well)
            if (bounds.in_doubt && !talk_ && !dice_.chance(0.1))
                continue;
            const auto explains = [&](const Told& told) {
                return explained(exact, told, t0, t_end, [&](Long times, int ways) {
                    return follow({times * Long(tolerance) * (1 + size) / 20, ways});
                });
            };
            try_methods(exact, bounds, explains, x0, t0, t_end, tolerance, mark);
        }
        return exact;
    }
    std::vector<int> directions() const {
        return problem_.coupled ? std::vector<int>{0, 7, 2, 5} : std::vector<int>{0, 7};
    }

    template <class Follow>
    Bounds bounds_of(const Exactly& exact, Long error, double tolerance,
                     const Follow& follow) const {
        Bounds b;
        b.in_doubt = exact.fate == Exactly::undecided;
        b.state = error;
        b.times.assign(exact.changes.size(), Long(tolerance) * Long(problem_.pace));
        b.met.assign(exact.met.size(), Long(tolerance) * Long(problem_.pace));
        for (const int ways : directions()) {
            const Exactly pushed = follow({error / 20, ways});
            if (!pushed.same_story(exact)) {
                b.in_doubt = true;
                continue;
            }
            for (std::size_t i = 0; i < most; ++i)
                b.state = std::max(b.state, std::abs(pushed.z[i] - exact.z[i]));
            b.state = std::max(b.state, std::abs(pushed.t - exact.t));
            for (std::size_t i = 0; i < exact.changes.size(); ++i)
                b.times[i] =
                    std::max(b.times[i], std::abs(pushed.changes[i].t - exact.changes[i].t));
            for (std::size_t i = 0; i < exact.met.size(); ++i)
                b.met[i] = std::max(b.met[i], std::abs(pushed.met[i] - exact.met[i]));
        }
        // What errors may carry beyond the end of the run is not certain to be in it.
        for (std::size_t i = 0; i < exact.changes.size(); ++i)
            b.in_doubt =
                b.in_doubt || std::abs(exact.changes[i].t - exact.t) < multiple * b.times[i];
        for (std::size_t i = 0; i < exact.met.size(); ++i)
            b.in_doubt = b.in_doubt || std::abs(exact.met[i] - exact.t) < multiple * b.met[i];
        return b;
    }

    /// True if a run has other changes than the oracle, but those that the oracle has, too, with
    /// errors no larger than a state that is right may have.
    template <class Follow>
    bool explained(const Exactly& exact, const Told& told, double t0, double t_end,
                   const Follow& follow) const {
        if (!told.has_story || exact.fate == Exactly::stops)
            return false;
        const auto changes = story_of(told, t0, t_end);
        const auto same = [&](const Exactly& e) {
            return e.met.size() == told.met.size() &&
                   std::equal(changes.begin(), changes.end(), e.changes.begin(), e.changes.end(),
                              [](const Told::Seen& a, const Change& b) {
                                  return a.surface == b.surface && a.mode == b.mode;
                              });
        };
        if (same(exact))
            return false;
        for (const Long times : {2.0L, 4.0L, 8.0L, 16.0L, 32.0L, 64.0L, Long(multiple)})
            for (const int ways : directions())
                if (same(follow(times, ways)))
                    return true;
        return false;
    }

    template <class Explains>
    void try_methods(const Exactly& exact, const Bounds& bounds, const Explains& explains,
                     const std::array<double, most>& x0, double t0, double t_end, double tolerance,
                     const std::string& mark) {
        const auto one = [&](Method method, bool in_lanes) {
            const auto began = Clock::now();
            const Told told = problem_.ask({method, in_lanes, tolerance, x0, t0, t_end});
            const std::chrono::duration<double> took = Clock::now() - began;
            judge(exact, bounds, explains, told, t0, t_end, tolerance,
                  (in_lanes ? "lanes" : method_names[std::size_t(method)]) + mark, took.count());
        };
        one(Method::dopri5, false);
        one(Method::dop853, false);
        if (tolerance >= 1e-8)
            one(Method::rodas5p, false);
        if (t_end > t0)
            one(Method::dop853, true);
    }

    template <class Explains>
    void judge(const Exactly& exact, const Bounds& bounds, const Explains& explains,
               const Told& told, double t0, double t_end, double tolerance,
               const std::string& method, double seconds) {
        bool finite = true;
        for (const double x : told.x)
            finite = finite && std::isfinite(x);
        const Natural z = problem_.disguise.exact(told.x);
        Long off = 0;
        for (std::size_t i = 0; i < most; ++i)
            off = std::max(off, std::abs(z[i] - exact.z[i]));
        const double ratio = finite ? double(off / bounds.state) : 1e300;
        std::string why = complaint(exact, bounds, told, t0, t_end, ratio);
        Verdict verdict = why.empty() ? stability::right : stability::wrong;
        const bool ended = told.status == Status::ok || told.status == Status::ambiguous;
        if (!finite || (!ended && told.status != Status::max_events))
            verdict = stability::wrong;
        else if (bounds.in_doubt ||
                 (verdict == stability::wrong && ratio <= multiple && explains(told)))
            verdict = stability::delicate;
        count(method, tolerance, verdict, ratio, seconds);
        if (verdict == stability::wrong || talk_)
            report_.failures.push_back(
                "--case " + family_ + ":" + std::to_string(number_) + "  " + method + " " +
                digits("%.0e", tolerance) + (problem_.disguise.period > 0 ? " period" : "") + ": " +
                (why.empty() ? "right" : why) + (bounds.in_doubt ? ", delicate" : "") +
                ", off by " + digits("%.1e", ratio) + ", " + std::string(name(told.status)) +
                " at " + digits("%.8g", told.t * problem_.disguise.speed) +
                (told.status == Status::ok ? "" : ". " + told.message));
    }

    /// What is wrong with a run; empty if nothing is.
    std::string complaint(const Exactly& exact, const Bounds& bounds, const Told& told, double t0,
                          double t_end, double ratio) const {
        const Long speed = problem_.disguise.speed;
        if (exact.fate == Exactly::stops) {
            if (told.status != Status::ambiguous)
                return "goes through a two-fold";
            if (!(std::abs(speed * told.t - exact.t) <= std::max(1e-6L, multiple * bounds.state)))
                return "two-fold at another time";
            if (!(ratio * bounds.state <= std::max(1e-5L, multiple * bounds.state)))
                return "two-fold at another place";
            return {};
        }
        const bool at_end = std::abs(told.t - t_end) <= 1e-6 * std::abs(t_end - t0);
        if (!(told.status == Status::ok || (told.status == Status::ambiguous && at_end)))
            return "stops";
        if (told.has_story) {
            const auto changes = story_of(told, t0, t_end);
            for (std::size_t i = 0; i < std::max(changes.size(), exact.changes.size()); ++i) {
                const bool both = i < changes.size() && i < exact.changes.size();
                if (both && changes[i].mode == exact.changes[i].mode &&
                    std::abs(speed * changes[i].t - exact.changes[i].t) <=
                        multiple * bounds.times[i] + 1e-13L * std::abs(exact.changes[i].t))
                    continue;
                const bool late =
                    i >= changes.size() ||
                    (i < exact.changes.size() && speed * changes[i].t > exact.changes[i].t);
                return std::string(late ? "missed a change" : "invented a change") + " (" +
                       (i < changes.size() ? said(changes[i], speed) : std::string("none")) +
                       " in place of " +
                       (i < exact.changes.size() ? said(exact.changes[i], 1)
                                                 : std::string("none")) +
                       ")";
            }
            for (std::size_t i = 0; i < std::max(told.met.size(), exact.met.size()); ++i)
                if (i >= told.met.size() || i >= exact.met.size() ||
                    !(std::abs(speed * told.met[i] - exact.met[i]) <=
                      multiple * bounds.met[i] + 1e-13L * std::abs(exact.met[i])))
                    return "section met " + std::to_string(told.met.size()) +
                           " times in place of " + std::to_string(exact.met.size()) + ", number " +
                           std::to_string(i) + " at " +
                           (i < told.met.size() ? digits("%.12g", double(speed * told.met[i]))
                                                : std::string("none")) +
                           " in place of " +
                           (i < exact.met.size() ? digits("%.12g", double(exact.met[i]))
                                                 : std::string("none"));
        }
        return ratio <= multiple ? std::string() : std::string("another end");
    }
    template <class Each> static std::string said(const Each& each, Long speed) {
        return "surface " + std::to_string(each.surface) + " to " + std::to_string(each.mode) +
               " at " + digits("%.12g", double(speed * each.t));
    }
    /// Without what happens in the first and last instants.
    std::vector<Told::Seen> story_of(const Told& told, double t0, double t_end) const {
        std::vector<Told::Seen> changes;
        const double near = 1e-9 * std::abs(t_end - t0);
        for (Told::Seen each : told.changes) {
            if (problem_.counts_jumps) { // (several at one time: beyond a surface between them)
                if (each.mode == -1)
                    continue;
                each.mode = 2;
            } else if (each.mode == 2) {
                continue;
            }
            if (std::abs(each.t - t0) > near && std::abs(each.t - t_end) > near)
                changes.push_back(each);
        }
        return changes;
    }

    void count(const std::string& method, double tolerance, Verdict verdict, double ratio,
               double seconds) {
        Cell& cell = report_.cells[{family_, method, digits("%.0e", tolerance)}];
        ++cell.count[verdict];
        cell.seconds += seconds;
        cell.longest = std::max(cell.longest, seconds);
        if (verdict == stability::right) {
            cell.ratios.push_back(ratio);
            if (ratio > cell.worst) {
                cell.worst = ratio;
                cell.worst_case = number_;
            }
        }
    }
    void say(const Exactly& exact) const {
        std::printf("exactly %s at %.15Lg: (%.15Lg, %.15Lg, %.15Lg, %.15Lg)\n",
                    exact.fate == Exactly::ok      ? "ok"
                    : exact.fate == Exactly::stops ? "stops"
                                                   : "undecided",
                    exact.t, exact.z[0], exact.z[1], exact.z[2], exact.z[3]);
        for (std::size_t i = 0; i < std::min<std::size_t>(exact.changes.size(), 12); ++i)
            std::printf("  %.15Lg: surface %d, mode %d\n", exact.changes[i].t,
                        exact.changes[i].surface, exact.changes[i].mode);
        std::printf("  section met %zu times\n", exact.met.size());
    }

    std::string family_;
    const Problem& problem_;
    std::uint64_t number_;
    Report& report_;
    bool talk_;
    Dice dice_;
};

} // namespace filippov::strangers
