// SPDX-License-Identifier: BSD-3-Clause
// Branches of periodic orbits over one parameter, through folds and sliding bifurcations.
#pragma once

#include <filippov/continuation/detail/smooth_points.hpp>
#include <filippov/continuation/detail/word_change.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

/// Follows periodic orbits over one parameter.
class BranchTracer {
public:
    BranchTracer(const AnySystem& system, int parameter, double low, double high,
                 const BranchSettings& settings = {})
        : line_{system, parameter, low, high}, settings_(settings) {
        detail::require_parameter(system, "parameter", parameter);
        detail::require_range("low", low, high);
        detail::validate(settings);
    }

    /// The branch through a solved cycle, in both directions.
    /// @error std::invalid_argument unless there is one surface, a switching one without static
    /// friction, and the cycle lies within the bounds
    Branch trace(const Cycle& start) {
        require_start(start);
        Branch backward, forward;
        both_ways(start, backward, forward);
        return detail::joined(backward, forward);
    }
    /// The branch through a bifurcation, that one among its special points: from one of the four
    /// sliding bifurcations the orbit with fewer segments goes one way, that with more the other.
    /// The same from a grazing without a slide.
    /// @error std::invalid_argument unless there is one surface, a switching one without static
    /// friction, and the bifurcation lies within the bounds
    Branch trace(const SpecialPoint& start) {
        require_start(start.cycle);
        return changes_word(start.kind) ? trace_sliding(start) : trace_smooth(start);
    }

private:
    using Place = detail::BranchPlace;
    using StepEnd = detail::StepEnd;
    using SmoothEnd = detail::SmoothEnd;

    void require_start(const Cycle& start) const {
        detail::require_continuable(line_.system, start.p);
        if (!line_.holds(line_.value(start)))
            detail::refuse("start.p[" + std::to_string(line_.parameter) + "]", line_.value(start),
                           "expected a value within the bounds");
    }
    Branch trace_sliding(const SpecialPoint& start) {
        SlidingCondition s{start.kind, start.cycle, start.node, start.side};
        SpecialPoint here = detail::describe(line_.system, s, start.convergence);
        start_ = parent_of(s);
        met_ = here;
        Branch backward, forward;
        const auto fewer = detail::parent(line_, s);
        leaves_ = way_of(fewer);
        by_child_ = false;
        run(fewer, backward, 0);
        auto next = detail::child(line_, s);
        here.word_before = start_.word.string();
        leaves_ = -leaves_; // it comes back on the word with fewer segments
        by_child_ = true;
        if (next) {
            next->entered = here.multipliers_child;
            here.word_after = next->shooting->word().string();
            run_on(std::move(next), backward, forward);
        } else {
            forward.end = BranchEnd::no_orbit;
        }
        forward.special.insert(forward.special.begin(), here);
        return detail::joined(backward, forward);
    }
    Branch trace_smooth(const SpecialPoint& start) {
        Branch backward, forward;
        both_ways(start.cycle, backward, forward);
        const auto is_start = [&](const SpecialPoint& s) {
            return s.kind == start.kind &&
                   std::abs(line_.value(s.cycle) - line_.value(start.cycle)) < 1e-7 * line_.width();
        };
        // To rounding the test function is zero there: a step from it may see a change of sign.
        if (std::none_of(backward.special.begin(), backward.special.end(), is_start) &&
            std::none_of(forward.special.begin(), forward.special.end(), is_start)) {
            SpecialPoint here = start;
            detail::name_smooth(line_.system, here);
            forward.special.insert(forward.special.begin(), here);
        }
        return detail::joined(backward, forward);
    }
    void both_ways(const Cycle& start, Branch& backward, Branch& forward) {
        start_ = start;
        met_.reset();
        const auto up =
            detail::place_of(line_, start, [](const Vector& dz) { return dz[dz.size() - 1]; });
        auto down = up;
        if (down)
            down->t = -down->t;
        leaves_ = way_of(down);
        run(down, backward, 0);
        leaves_ = way_of(up);
        run_on(up, backward, forward);
    }
    /// The sign of the parameter's rate where the branch leaves a place, 0 at a fold.
    static double way_of(const std::optional<Place>& from) {
        return from && std::abs(from->slope()) > 1e-9 ? std::copysign(1.0, from->slope()) : 0.0;
    }

    /// The other direction. The start is the first point of both.
    void run_on(std::optional<Place> here, const Branch& backward, Branch& forward) {
        if (backward.end == BranchEnd::closed)
            forward.end = BranchEnd::closed;
        else
            run(std::move(here), forward, std::max<std::size_t>(backward.points.size(), 1) - 1);
    }
    void run(std::optional<Place> here, Branch& branch, std::size_t points_before) {
        const auto tell = [&] {
            if (settings_.progress)
                settings_.progress(points_before + branch.points.size());
        };
        if (detail::stopped(line_.system, branch))
            return;
        if (!here) {
            branch.status = Status::not_finite;
            branch.end = BranchEnd::no_start;
        } else {
            branch.points.push_back(point_of(start_));
            tell();
        }
        if (detail::stopped(line_.system, branch) || !here)
            return;
        passed_.clear();
        if (met_)
            passed_.push_back(*met_);
        bool first = met_ && met_->kind == Kind::grazing;
        detail::walk(line_.system, settings_, branch, [&](double& ds) {
            if (first)
                ds = std::min(ds, first_step_from(*here, met_->kind));
            first = false;
            const bool goes_on = advance(*here, ds, branch);
            tell();
            return goes_on;
        });
    }
    BranchPoint point_of(const Cycle& c, const std::vector<Jet>& arcs = {}) const {
        BranchPoint p{c, floquet(line_.system, c, arcs)};
        detail::normalize(line_.system, p.cycle);
        return p;
    }

    // --- a step --------------------------------------------------------------------------------

    /// Where a step leads.
    struct Target {
        Vector z;
        Matrix J;
        Cycle cycle;
        bool last = false; ///< it is at a bound
        int iterations = 0;
    };

    /// One step, whatever it meets; false at the end of the branch.
    bool advance(Place& here, double& ds, Branch& branch) {
        BranchEnd trouble = BranchEnd::no_convergence;
        for (; ds >= settings_.min_step; ds /= 2) {
            const StepEnd end = attempt(here, ds, branch, trouble);
            if (end == StepEnd::failed)
                break;
            if (end != StepEnd::retry)
                return end == StepEnd::goes_on;
        }
        if (trouble == BranchEnd::no_convergence && has_shrunk(branch))
            trouble = BranchEnd::point;
        if (trouble != BranchEnd::equilibrium && trouble != BranchEnd::point)
            branch.status = Status::not_converged;
        branch.end = trouble;
        return false;
    }
    StepEnd attempt(Place& here, double& ds, Branch& branch, BranchEnd& trouble) {
        Target to;
        if (!reach(here, ds, to, branch, trouble))
            return StepEnd::retry;
        if (passes_equilibrium(here, to.cycle)) {
            trouble = BranchEnd::equilibrium;
            return StepEnd::retry;
        }
        if (passes_start(here, to.cycle)) {
            // the other way it retraces its steps
            const bool same_way = leaves_ * (line_.value(to.cycle) - here.parameter()) >= 0;
            return same_way ? comes_back(branch) : turns_back(branch);
        }
        const std::vector<Test> failed = failures(to.cycle);
        if (failed.empty())
            return accept(here, to, ds, branch, trouble);
        const bool last_try = ds < 2 * settings_.min_step;
        const bool close = ds <= 1e-3 * settings_.first_step;
        const StepEnd end = bifurcate(here, to.cycle, failed, branch, trouble, close, last_try);
        if (end == StepEnd::goes_on)
            ds = std::min(ds, first_step_from(here, branch.special.back().kind));
        return end;
    }
    /// To see what happens right behind a bifurcation: a short one. Shorter still where multipliers
    /// come from infinity: they pass 1 or -1 soon.
    double first_step_from(const Place& here, Kind kind) const {
        const bool unknown = kind == Kind::grazing && here.entered && here.entered->empty();
        return std::max((unknown ? 1e-3 : 0.1) * settings_.first_step, settings_.min_step);
    }
    /// False if there is no point of the curve near the step's end.
    bool reach(const Place& here, double ds, Target& to, Branch& branch, BranchEnd& trouble) const {
        to.z = here.z;
        const Convergence c = here.curve.step(to.z, to.J, here.t, ds);
        branch.corrections += c.iterations;
        to.iterations = c.iterations;
        if (!c.ok()) {
            trouble = trouble == BranchEnd::equilibrium ? BranchEnd::no_convergence : trouble;
            return false;
        }
        if (!(here.curve.tangent(to.J, here.t).dot(here.t) > 0.9))
            return false;
        to.cycle = here.shooting->unpack(to.z);
        // A step that leaves the bounds becomes one to the bound.
        to.last = !line_.holds(here.parameter_of(to.z));
        return !to.last || stop_at_bound(here, to, branch);
    }
    /// The point at the bound between `here` and `to`, with its Jacobian.
    bool stop_at_bound(const Place& here, Target& to, Branch& branch) const {
        const double value = here.parameter_of(to.z),
                     bound = value < line_.low ? line_.low : line_.high;
        const double fraction = (bound - here.parameter()) / (value - here.parameter());
        to.cycle = here.shooting->unpack(here.z + fraction * (to.z - here.z));
        to.cycle.p[line_.parameter] = bound;
        const Convergence converged = shoot(line_.system, to.cycle);
        branch.corrections += converged.iterations;
        if (!converged.ok())
            return false;
        to.z = here.shooting->pack(to.cycle);
        auto e = here.shooting->evaluate(to.z);
        to.J = std::move(e.J);
        return e.status == Status::ok;
    }
    /// The step is one of the same word, and its end the next point.
    StepEnd accept(Place& here, const Target& to, double& ds, Branch& branch, BranchEnd& trouble) {
        BranchPoint next = point_of(to.cycle, here.shooting->arcs_in(to.J));
        if (!(std::abs(next.multipliers[0]) < detail::largest_multiplier)) {
            trouble = BranchEnd::too_unstable;
            return StepEnd::failed;
        }
        const Vector t = here.curve.tangent(to.J, here.t);
        const std::size_t known = branch.special.size();
        const bool last_try = ds < 2 * settings_.min_step;
        const SmoothEnd passed =
            detail::smooth_points(line_, here, t, here.along(to.z), branch, next, last_try);
        if (line_.system.interrupted())
            return StepEnd::ended;
        if (passed == SmoothEnd::unlocated) {
            trouble = BranchEnd::not_located;
            return StepEnd::retry;
        }
        if (passed == SmoothEnd::merges) {
            branch.end = BranchEnd::half_period;
            return StepEnd::ended;
        }
        if (branch.points.size() > 1 &&
            std::any_of(branch.special.begin() + std::ptrdiff_t(known), branch.special.end(),
                        [this](const SpecialPoint& s) { return is_start(s); }))
            return comes_back(branch);
        branch.points.push_back(std::move(next));
        if (to.last) {
            branch.end = BranchEnd::bound;
            return StepEnd::ended;
        }
        here.z = to.z;
        here.t = t;
        here.entered.reset();
        if (lasts_for_ever(here)) {
            branch.end = BranchEnd::homoclinic;
            return StepEnd::ended;
        }
        if (needs_phase(to.cycle)) // the plane before may touch the orbit further on, like a fold
            renew(here, to.cycle, here.curve.scale());
        else if (is_longer(here))
            renew(here, to.cycle, {});
        if (to.iterations <= 3)
            ds = std::min(1.5 * ds, settings_.max_step);
        return StepEnd::goes_on;
    }
    std::vector<Test> failures(const Cycle& c) const {
        std::vector<Test> failed;
        for (const Test& test : tests_of(line_.system, c))
            if (!(test.value > -1e-13))
                failed.push_back(test);
        return failed;
    }

    /// True for an orbit without events of an autonomous system: its only node is where it passes
    /// a plane.
    bool needs_phase(const Cycle& c) const {
        return !line_.system.forced() && c.word[0].until == Until::phase;
    }
    /// True if such an orbit is next to nothing, or has turned inside out since `here`: it shrinks
    /// to an equilibrium, where the parameter turns as well (a Hopf bifurcation, and no fold).
    bool passes_equilibrium(const Place& here, const Cycle& to) const {
        if (!needs_phase(to))
            return false;
        const auto length = [this](const Cycle& c) {
            return Vector(c.period * line_.system.field(c.word[0].mode, c.t[0], c.x[0], c.p));
        };
        const Vector now = length(to);
        return now.norm() <= 1e-4 * here.curve.scale().head(now.size()).norm() ||
               now.dot(length(here.cycle())) <= 0;
    }
    /// True if next to nothing is left of an orbit that no forcing keeps, of its period and between
    /// its nodes: its events, as the switchings of a relay, have come together.
    bool has_shrunk(const Branch& branch) const {
        if (line_.system.forced() || branch.points.empty())
            return false;
        const auto spread = [](const Cycle& c) {
            Vector low = c.x[0], high = c.x[0];
            for (const Vector& x : c.x) {
                low = low.cwiseMin(x);
                high = high.cwiseMax(x);
            }
            return Vector(high - low);
        };
        double longest = 0;
        Vector largest = Vector::Zero(line_.system.dim());
        for (const BranchPoint& point : branch.points) {
            longest = std::max(longest, point.cycle.period);
            largest = largest.cwiseMax(spread(point.cycle));
        }
        const Cycle& last = branch.points.back().cycle;
        return last.period < 0.05 * longest &&
               (spread(last).array() <= 0.05 * largest.array()).all();
    }
    /// True if nothing but the period grows along the branch: the orbit waits ever longer at an
    /// equilibrium, sliding or not, and the parameter has come to where it stays there (a
    /// homoclinic orbit, or a fold of equilibria on it).
    bool lasts_for_ever(const Place& here) const {
        return !line_.system.forced() && here.shooting->period_in(here.t) > 0 &&
               here.shooting->without_times(here.t).norm() <= 1e-6 && waits(here);
    }
    /// True if the orbit comes to a point where it would not get anywhere in a period: else it is
    /// only the nodes that stand still, as in a canard explosion.
    bool waits(const Place& here) const {
        const Cycle c = here.cycle();
        std::size_t longest = 0;
        for (std::size_t i = 1; i < c.size(); ++i)
            if (c.duration(i) > c.duration(longest))
                longest = i;
        const int mode = c.word[longest].mode;
        const Vector size = here.curve.scale().head(line_.system.dim());
        for (int k = 1; k < 32; ++k) {
            const double t = c.t[longest] + k / 32.0 * c.duration(longest);
            const Jet arc = line_.system.arc(mode, c.t[longest], c.x[longest], t, c.p, {});
            if (arc.status != Status::ok)
                return false;
            const Vector moved = c.period * line_.system.field(mode, t, arc.value, c.p);
            if (moved.cwiseQuotient(size).norm() <= 0.02)
                return true;
        }
        return false;
    }
    /// True if the period is twice that in which steps are measured.
    bool is_longer(const Place& here) const {
        const Shooting& shooting = *here.shooting;
        return !line_.system.forced() &&
               shooting.period_in(here.z) > 2 * shooting.period_in(here.curve.scale());
    }
    /// Takes the orbit that it is now for the one that steps start from: a plane across it, and
    /// these lengths, or its own.
    void renew(Place& here, const Cycle& cycle, const Vector& lengths) {
        const Vector before = here.t.cwiseQuotient(here.curve.scale());
        const auto forward = [&](const Vector& dz) { return before.dot(dz); };
        if (auto renewed = detail::place_of(line_, cycle, forward, lengths))
            here = std::move(*renewed);
    }
    /// True if the step from `here` to a cycle of the same word goes through the start again.
    bool passes_start(const Place& here, const Cycle& to) const {
        const double value = line_.value(start_), from = here.parameter(), past = line_.value(to);
        if (!((from - value) * (past - value) < 0) || to.size() != start_.size())
            return false;
        const double fraction = (value - from) / (past - from);
        Cycle c = here.shooting->unpack(here.z + fraction * (here.shooting->pack(to) - here.z));
        c.p = start_.p;
        return shoot(line_.system, c).ok() && detail::same_orbit(line_.system, c, start_);
    }

    /// True of a fold where the branch starts: its parameter turns there, and is not passed.
    bool is_start(const SpecialPoint& s) const {
        return s.kind == Kind::fold &&
               std::abs(line_.value(s.cycle) - line_.value(start_)) < 1e-9 * line_.width() &&
               detail::same_orbit(line_.system, s.cycle, start_);
    }
    StepEnd turns_back(Branch& branch) const {
        branch.status = Status::not_converged;
        branch.end = BranchEnd::turned_back;
        return StepEnd::ended;
    }
    StepEnd comes_back(Branch& branch) const {
        branch.points.push_back(point_of(start_));
        branch.end = BranchEnd::closed;
        return StepEnd::ended;
    }

    // --- a change of the word ------------------------------------------------------------------

    /// A word ends between `here` and `beyond`: find out where and why, and go on with the next.
    /// @param close  the step is short: what multipliers do before they become infinite was seen
    StepEnd bifurcate(Place& here, const Cycle& beyond, const std::vector<Test>& failed,
                      Branch& branch, BranchEnd& trouble, bool close, bool last_try) {
        std::vector<Test> causes = causes_of(failed, beyond);
        const bool born = causes[0].what != Test::What::duration;
        const auto others = std::erase_if(causes, [born](const Test& test) {
            return born != (test.what != Test::What::duration);
        });
        trouble = BranchEnd::several;
        if (others > 0 && !last_try) // which one comes first, a smaller step may tell
            return StepEnd::retry;
        const Cycle before = here.cycle();
        std::vector<SlidingCondition> conditions =
            detail::conditions_behind(line_.system, before, beyond, causes);
        if (conditions.size() == 1) {
            detail::add_twins(line_, conditions[0], causes);
            conditions = detail::conditions_behind(line_.system, before, beyond, causes);
        }
        if (conditions.empty()) {
            trouble = BranchEnd::touches_crossed;
            return StepEnd::retry;
        }
        std::vector<SpecialPoint> special;
        const double from = here.parameter(), to = line_.value(beyond);
        for (SlidingCondition& s : conditions) {
            const Convergence c = detail::solve(line_, s);
            branch.corrections += c.iterations;
            const double value = line_.value(s.cycle);
            const bool late = last_try && last_before(branch, before.word, value, to - from);
            if (!c.ok() || !(late || within(value, from, to))) {
                trouble = BranchEnd::not_located;
                return StepEnd::retry;
            }
            if (line_.system.interrupted())
                return StepEnd::ended;
            if (!born && s.kind == Kind::grazing) {
                if (!detail::crosses_alike(line_.system, s)) {
                    trouble = BranchEnd::touches_crossed;
                    return StepEnd::retry;
                }
                if (!close && !last_try)
                    return StepEnd::retry;
            }
            special.push_back(detail::describe(line_.system, s, c));
            special.back().word_before = before.word.string();
        }
        const bool together = detail::keep_first(line_, conditions, special, to - from);
        if ((!together && !born) || !detail::alone(line_.system, conditions[0]))
            return StepEnd::retry;
        if (const double value = line_.value(special[0].cycle); !within(value, from, to))
            take_back(branch, last_before(branch, before.word, value, to - from));
        auto next = !born                    ? detail::parent(line_, conditions[0])
                    : conditions.size() == 1 ? detail::child(line_, conditions[0])
                                             : detail::children(line_, conditions);
        if (next)
            next->entered.emplace();
        if (conditions.size() == 1) {
            detail::flip_before(line_, here, conditions[0], special[0], born, branch);
            if (next)
                next->entered = born ? special[0].multipliers_child : special[0].multipliers;
        }
        return change_word(here, std::move(next), born, special, branch);
    }
    /// How many points there are up to the last of this word before a bifurcation, if those behind
    /// it are a few of this word, too; 0: none. (A touch that is barely crossed, soon after the
    /// segment has begun, is seen late.)
    std::size_t last_before(const Branch& branch, const Word& word, double bifurcation,
                            double direction) const {
        std::size_t n = branch.points.size();
        while (n > 0 && branch.points[n - 1].cycle.word == word &&
               (line_.value(branch.points[n - 1].cycle) - bifurcation) * direction > 0)
            --n;
        const bool few = n < branch.points.size() && branch.points.size() - n <= 20;
        return few && n > 0 && branch.points[n - 1].cycle.word == word ? n : 0;
    }
    /// Keeps the first n points, and the bifurcations up to there.
    void take_back(Branch& branch, std::size_t n) const {
        const auto is_between = [&](const SpecialPoint& s) {
            const double value = line_.value(s.cycle), a = line_.value(branch.points[n - 1].cycle),
                         b = line_.value(branch.points.back().cycle);
            return (value - a) * (value - b) < 0;
        };
        while (!branch.special.empty() && is_between(branch.special.back()))
            branch.special.pop_back();
        branch.points.resize(n);
    }
    /// True if a bifurcation of this parameter can be one of the step.
    bool within(double value, double from, double to) const {
        const double slack = 0.1 * std::abs(to - from) + 1e-9 * line_.width();
        return value >= std::min(from, to) - slack && value <= std::max(from, to) + slack;
    }
    /// Goes on at the next word, past the bifurcations between.
    StepEnd change_word(Place& here, std::optional<Place> next, bool born,
                        std::vector<SpecialPoint>& special, Branch& branch) {
        const auto is_one_of = [&](const std::vector<SpecialPoint>& others) {
            return std::any_of(others.begin(), others.end(), [&](const SpecialPoint& other) {
                return detail::same_point(line_, special[0], other);
            });
        };
        if (is_one_of(passed_))
            return turns_back(branch);
        if (met_ && is_one_of({*met_}))
            return born == by_child_ ? comes_back(branch) : turns_back(branch);
        passed_ = special;
        if (next) {
            const Cycle after = next->cycle(), one = detail::shortest(line_.system, after);
            if (one.period < 0.9 * after.period) { // passed several times, and met at each
                special[0].word_after = one.word.string();
                branch.special.push_back(std::move(special[0]));
                branch.end = BranchEnd::part_of_period;
                return StepEnd::ended;
            }
        }
        for (SpecialPoint& s : special) {
            if (next)
                s.word_after = next->shooting->word().string();
            branch.special.push_back(std::move(s));
        }
        if (!next) {
            branch.end = BranchEnd::no_orbit;
            return StepEnd::ended;
        }
        here = std::move(*next);
        return StepEnd::goes_on;
    }

    detail::BranchLine line_;
    BranchSettings settings_;
    Cycle start_;
    double leaves_ = 0; ///< to which side of it the branch leaves, if it comes back the same way
    std::optional<SpecialPoint> met_; ///< the sliding bifurcation at the start
    bool by_child_ =
        false; ///< the branch leaves that with more segments, and with fewer comes back
    std::vector<SpecialPoint> passed_; ///< those of the last change of the word
};

} // namespace filippov
