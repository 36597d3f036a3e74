// SPDX-License-Identifier: BSD-3-Clause
// Follows one prescribed mode until something happens. No judgement: what a contact means is for
// flow.
#pragma once

#include <filippov/engine/detail/paths.hpp>
#include <filippov/engine/detail/probed_field.hpp>
#include <filippov/engine/detail/rest_path.hpp>
#include <filippov/events/arguments.hpp>
#include <filippov/events/landing.hpp>
#include <filippov/events/lost_surface.hpp>
#include <filippov/events/target.hpp>
#include <filippov/events/two_fold.hpp>
#include <filippov/events/watch.hpp>
#include <filippov/methods/control.hpp>
#include <filippov/run/first_step.hpp>
#include <filippov/run/observers.hpp>
#include <filippov/run/report.hpp>
#include <filippov/sliding/root_law.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

namespace filippov {

/// State and machinery of a run; `advance` follows the current mode to the next stop.
template <class Sys, class S> class Segment {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using P = Params<Sys, S>;
    using Guards = Watch<Sys, S>;
    using Watched = typename Guards::Watched;
    using Method = Steps<Sys, S>;

    /// @error std::invalid_argument for a period too short to tell the phase of t0 or t_end
    Segment(const Sys& sys, const P& p, const S& t0, const X& x0, const S& t_end,
            const Settings<S, N>& settings, const Observer<S, N, M>& observer,
            const Watched& sections, Method& steps)
        : place_(sys, p, settings), watch_(place_, sections), observer_(observer), steps_(steps),
          control_{.method = steps.facts()} {
        const S T = period(sys, p);
        place_.clock = Clock<S>::at(t0, T);
        end_ = Clock<S>::at(t_end, T);
        const S both = place_.clock.local + end_.local;
        if (!(both - both == S(0)))
            detail::refuse("period", T,
                           "expected 0, or one of which fewer than 2^52 fit in t0 and t_end");
        place_.direction = t_end < t0 ? -1 : 1;
        place_.put(x0);
    }
    // the guards look at this very place
    Segment(const Segment&) = delete;
    Segment& operator=(const Segment&) = delete;

    const Clock<S>& clock() const { return place_.clock; }
    const X& x() const { return place_.x; }
    const Mode<M>& mode() const { return place_.mode; }
    int direction() const { return place_.direction; }
    const X& scale() const { return place_.scale; }
    const Layers<Sys, S>& layers() const { return place_.layers; }
    const Layers<Sys, S>* its_layers() const { return place_.its_layers(); }
    /// The field of the mode, where it is.
    X field() const { return place_.field(place_.clock.local, place_.x); }
    const Guards& watch() const { return watch_; }
    Guards& watch() { return watch_; }
    const Counters& counters() const { return counters_; }
    Counters& counters() { return counters_; }
    const Diagnosis<S, N, M>& diagnosis() const { return diagnosis_; }
    /// A time over which the solution changes: the step size, unless settings make it tiny.
    S time_scale() const { return std::max(abs_(dt_), natural_step_); }
    /// The same for what that time shows nothing of: the window of a slide in closed form, which no
    /// tolerance has made short.
    S longer_time_scale() const { return std::max(time_scale(), window_); }

    void set_state(const X& x) {
        place_.put(x);
        have_k0_ = false;
    }

    /// The surfaces that are slid on from here on are looked at from beside, if they have layers.
    void look_from_beside(const Layers<Sys, S>& layers) {
        if (place_.layered || layers.any()) {
            place_.layers = layers;
            place_.layered = true; // `enter` takes those out that are not slid on
            have_k0_ = false;
        }
    }
    /// Puts the state on the surfaces whose layers it is in.
    void put_on_layers() {
        const S t = place_.clock.local;
        set_state(put_on(near_layers(t, place_.x), t, place_.x));
    }
    /// True if surface j is no farther than the width of its layer, and the field on this side of
    /// it ends like a root and leads to it.
    FILIPPOV_COLD bool is_root_near(int j, const S& side) const {
        return root_near(j, side).holds();
    }

    /// Prescribes a mode; its guards start from their values here.
    void enter(const Mode<M>& mode) {
        const bool changed = !(mode == place_.mode),
                   slid = place_.mode.sliding() > 0 && dt_ != S(0);
        const S lasted = elapsed_;
        if (changed) {
            have_k0_ = false;
            elapsed_ = S(0);
        }
        place_.enter(mode);
        watch_.enter(!changed, forward() * time_scale());
        if constexpr (has_directions_v<Sys>)
            leaving_.reset();
        transversality_ = widest_ = S(0);
        if (changed && dt_ != S(0) && abs_(dt_) < S(100) * place_.resolution())
            choose_first_step();
        // A slide may take far longer steps than the slip after it: that one goes on as before it.
        if (!slid && mode.sliding() > 0)
            dt_before_slide_ = counters_.steps > 0 ? dt_ : S(0);
        if (slid && mode.sliding() == 0 && dt_before_slide_ != S(0) &&
            abs_(dt_before_slide_) < abs_(dt_))
            dt_ = dt_before_slide_;
        // What the field does not resolve is looked at from as near as it changed before.
        if (changed && lasted > S(0) && may_outpace())
            dt_ = forward() * std::min(abs_(dt_), std::max(S(2) * lasted, least_first_step()));
        const bool first_slip = slid && mode.sliding() == 0 && dt_before_slide_ == S(0);
        checks_ = first_slip || counters_.steps == 0 ? most_checks : 0;
    }

    /// The mode begins with directions at rest that it moves: the next step takes them off.
    /// @param on    their components
    /// @param exit  the slide that ended here, if one did
    void leave_rest(const SurfaceSet<M>& on, const SlideEnd<M>& exit)
        requires has_directions_v<Sys>
    {
        const S t = place_.clock.local;
        leaving_.emplace(place_.sys, place_.mode, on, t, place_.x, place_.p);
        if (!leaving_->solve(exit, time_scale()))
            leaving_.reset();
        if (!leaving_ || place_.mode.sliding() == 0)
            return;
        const auto slide = joint_sliding(leaving_->system(), place_.mode, t, place_.x, place_.p);
        for (const int j : slid_surfaces(place_.mode))
            watch_.start_slide(j, slide.below[j], slide.above[j], watch_.attracts(slide, j));
    }

    /// Follows a mode, whatever that means, to the first root of one guard; -1: to the end.
    void prescribe(const Mode<M>& mode, int target) {
        prescribed_ = true;
        enter(mode);
        choose_first_step();
        watch_.only(target);
    }

    void choose_first_step() {
        const Settings<S, N>& settings = place_.settings;
        S span = abs_(place_.clock.until(end_));
        if (span == S(0))
            span = S(1); // nothing to integrate, but a contact wants a time scale
        natural_step_ =
            std::max(estimate_first_step(place_, span, steps_.facts().order), place_.resolution());
        S first = std::min({natural_step_, span, settings.max_step});
        if (settings.first_step > S(0))
            first = std::min(settings.first_step, span);
        else if (!prescribed_ && may_outpace())
            first = std::min(first, std::max(span / S(128), least_first_step()));
        if (settings.fixed_step > S(0))
            first = settings.fixed_step;
        dt_ = forward() * std::max(first, place_.resolution());
    }
    S least_first_step() const { return S(1e4) * place_.resolution(); }
    /// True if the mode's field says nothing of how soon an event may come: as Watch::may_outpace,
    /// and of s, unless the system vouches for it.
    bool may_outpace() const {
        const bool vouched = place_.settings.closed_form_slides &&
                             vouches_for_slides<S>(place_.sys) && place_.mode.second_order == 0;
        return (place_.mode.sliding() > 0 && !vouched) || watch_.may_outpace();
    }

    /// Follows the mode to the next stop.
    Stop advance() {
        window_ = S(0);
        in_two_fold_ = field_is_lost_ = false;
        if (sliding_surface(place_.mode) >= 0) {
            if constexpr (HasSlidingFlow<Sys, S>)
                if (place_.settings.closed_form_slides && slides_in_closed_form<S>(place_.sys) &&
                    place_.mode.second_order == 0)
                    return run_closed_form();
        }
        return run();
    }

    /// True if a slide has ended in a two-fold, where its field is 0/0.
    bool in_two_fold() const { return in_two_fold_; }
    /// True if a slide has ended in a two-fold from which slides go in many directions.
    bool field_is_lost() const { return field_is_lost_; }
    /// Lets the observer bring the end nearer by whole periods, which moves nothing else: it has
    /// seen that they would repeat what was.
    void let_observer_skip() {
        const Clock<S>& now = place_.clock;
        if (observer_.skip && now.period > S(0) && place_.direction > 0) {
            const long long left = end_.index - now.index - (now.local > end_.local ? 1 : 0);
            end_.index -= observer_.skip(left);
        }
    }

    /// @param branches  of an ambiguity, among which a policy may choose
    Status fail(Status status, std::string_view what, int surface = -1, int branches = 0) {
        // A function that is interrupted has no value, and what is made of it is no failure.
        if (interrupted()) {
            status = Status::interrupted;
            what = "";
        }
        diagnosis_ = {what, place_.clock.absolute(), place_.x, place_.mode, surface, branches};
        return status;
    }

    /// An event came this time after the last one, and the one after it may come as soon: a
    /// step very much longer would not show it.
    void expect_event_after(const S& gap) {
        first_reach_ = std::max(S(1e3) * gap, S(16) * place_.resolution());
    }
    /// True if a time dt from now is not after the end of the run.
    bool reaches(const S& dt) const { return forward() * (place_.clock.until(end_) - dt) >= S(0); }
    /// Goes straight to x, a time dt later: past events that accumulate there.
    void leap(const S& dt, const X& x) {
        remaining_ = place_.clock.until(end_);
        StraightPath<S, N> path(dt, place_.x, x);
        accept(path);
        have_k0_ = false;
    }

    /// Where the last turn about a slide of second order ends.
    struct Turn {
        S after{}; ///< time from now
        X x{};
    };
    /// The rest of a turn that is lower than the tolerance: h is zero but for that, and h' takes it
    /// no higher before it vanishes. No step resolves such a turn, nor those after it.
    FILIPPOV_COLD std::optional<Turn> low_turn() const {
        if constexpr (slides_twice_v<Sys>) {
            const S t = place_.clock.local;
            const X& x = place_.x;
            const S allowed = change_over(place_.sys, 0, t, x, place_.p, place_.scale);
            if (!(abs_(switching(place_.sys, t, x, place_.p)[0]) <= allowed))
                return std::nullopt;
            const Sides<Sys, S> b = second_order_sides(place_.sys, 0, t, x, place_.p);
            const S rate = forward() * rate_on_surface(place_.sys, 0, t, x, place_.p);
            const S bend = rate > S(0) ? S(-b.l2) : b.l1;
            if (!(bend > S(0)) || !(rate * rate <= S(0.2) * bend * allowed))
                return std::nullopt;
            Mode<M> twice;
            twice.hold_rate(0);
            const Constraints<Sys> holding(place_.sys, twice);
            Turn turn{.after = forward() * abs_(rate) / bend, .x = x};
            const S later = t + turn.after, tau = forward() * longer_time_scale();
            const X ahead = x + turn.after * (rate > S(0) ? b.f2 : b.f1);
            turn.x = project(place_.sys, holding, later, ahead, place_.p, place_.scale);
            turn.x = detail::exact_point(place_.sys, 0, later, turn.x, place_.p).x;
            if (reaches(turn.after) && is_near(ahead, turn.x, X(S(10) * place_.scale)) &&
                independent(place_.sys, holding, later, turn.x, place_.p, place_.scale) &&
                may_slide_to_second_order(place_.sys, 0, later, turn.x, place_.p, tau) &&
                keeps_second_order(place_.sys, 0, later, turn.x, place_.p, tau))
                return turn;
        }
        return std::nullopt;
    }

private:
    using Path = TriedPath<S, N>;
    using Attempt = TrialPath<Sys, S>; ///< a step of the method

    static S abs_(const S& v) {
        using std::abs;
        return abs(v);
    }
    /// The sign of a step.
    S forward() const { return S(place_.direction); }

    /// Moves a clock that starts where the step does to its end.
    FILIPPOV_INLINE void move(Clock<S>& clock, const S& dt) const {
        if (dt == remaining_)
            clock = end_;
        else
            clock.advance(dt);
    }
    /// Takes the step along a path: observer, state, clock.
    FILIPPOV_INLINE void accept(filippov::Path<S, N>& path) {
        if (observer_.step) {
            Clock<S> next = place_.clock;
            move(next, path.dt);
            observer_.step({place_.clock, next, path.dt, place_.x, path.x1, place_.mode},
                           StepPath<S, N>(path));
            place_.clock = next;
        } else {
            move(place_.clock, path.dt); // where it is: a copy would wait for what was just stored
        }
        place_.put(path.x1); // after the clock: its errors are judged at that time
        elapsed_ += abs_(path.dt);
        blurred_ = 0;
        ++counters_.steps;
        if (observer_.skip) [[unlikely]]
            let_observer_skip();
    }

    /// True if another guard's event came before the one that a path ends on, as the end shows or
    /// the interpolant of the whole step did: it is tried again, no longer than to here. (Two at
    /// one time differ by the rounding of the landing.)
    FILIPPOV_COLD bool comes_too_late(const Path& path, const Found<S>& found, const S& full) {
        const bool shorter = abs_(path.dt) < S(0.9) * abs_(full);
        const S part = shorter ? S(1e4) * epsilon<S> : S(0.01);
        if (!(abs_(path.dt) > S(16) * place_.resolution()) || place_.settings.fixed_step > S(0) ||
            !(path.dt / full > found.next + S(1e-3) ||
              watch_.another_came_before(found.guard, path, part)))
            return false;
        ++counters_.rejected;
        again_ = shorter ? path.dt : full / S(2);
        return true;
    }
    /// True if a step errs more than the tolerance after it was shortened: that of the whole one
    /// was small by chance.
    FILIPPOV_COLD bool errs_more(const Path& path, const S& full) {
        if (!path.kind.by_method || path.dt == full || place_.settings.fixed_step > S(0))
            return false;
        const S error = steps_.squared_error(place_, path.dt, path.x1);
        if (error <= S(4) || !(abs_(path.dt) > S(16) * place_.resolution()))
            return false;
        ++counters_.rejected;
        again_ = path.dt * S(control_.after_reject(static_cast<double>(error)));
        return true;
    }
    /// True if what the interpolant took for a touch is a crossing: it is tried again, in a step
    /// that ends before. (An interpolant knows nothing of a field that ends there like a root.)
    FILIPPOV_COLD bool crosses_instead(const Path& path, const Found<S>& found) {
        if (!found.touch || !(abs_(path.dt) > S(16) * place_.resolution()) ||
            place_.settings.fixed_step > S(0) ||
            !watch_.dips(found.guard, S(place_.clock.local + path.dt), path.x1))
            return false;
        ++counters_.rejected;
        again_ = path.dt / S(2);
        return true;
    }
    /// Shortens the step so that it ends on the event, and takes it.
    FILIPPOV_COLD Stop land(Path& path, const Found<S>& found) {
        const Target target(place_, watch_, found);
        const S full = path.dt;
        // Rounding of a guard that has not left a higher root yet is no root of it.
        const auto residual = [&] {
            return !found.touch && watch_.is_on_higher_root(found.guard, path)
                       ? std::numeric_limits<S>::infinity()
                       : target.residual(path);
        };
        const auto on_target = [&] { return target.reached(path); };
        const S slope = found.jumps ? std::numeric_limits<S>::infinity() : target.slope(path);
        const Landed landing = Landing(path, place_.clock.local, target.nudge_tolerance(), residual,
                                       on_target, target.tick())
                                   .run(found.theta * full, slope);
        counters_.landings += landing.trials;
        // An event at the end of the run is not after it.
        if (forward() * (path.dt - remaining_) > S(0))
            path.shorten(remaining_);
        Stop stop;
        const bool there =
            on_target() && (found.touch || !watch_.starts_on_higher_root(found.guard) ||
                            (path.dt != full && !watch_.is_on_higher_root(found.guard, path)));
        if (!landing.seen_beyond && !there) { // the interpolant saw a root that no step has
            path.shorten(full);
            stop.missed = true;
            return stop;
        }
        if (errs_more(path, full) || crosses_instead(path, found)) {
            stop.again = true;
            return stop;
        }
        if (comes_too_late(path, found, full)) {
            stop.again = true;
            return stop;
        }
        const bool s_jumps = target.ends_slide() && (landing.jumped || !on_target());
        if (target.loses_surface() || s_jumps) // (s jumps where L1 - L2 has a root, too)
            if (const Found<S> end = watch_.before_pole(found.guard, path); end.guard >= 0)
                return land(path, end);
        stop.guard = found.guard;
        stop.touch = found.touch;
        stop.jumped = landing.jumped || s_jumps; // of h, or of s
        if (const int j = carried_off(path); j >= 0 && target.ends_slide())
            return left_behind(j, path.dt);
        Clock<S> end = place_.clock;
        move(end, path.dt);
        target.settle(path, end.local, landing.jumped);
        const bool flat = target.degenerate(path);
        accept(path);
        watch_.go_on_with_sections();
        if (flat)
            stop.status = fail(Status::degenerate_surface, "grad h", found.guard / 3);
        return stop;
    }

    bool interrupted() const { return observer_.stop && observer_.stop(); }
    /// Not ok if the steps are used up or the observer asks to stop.
    Status may_go_on() {
        if (counters_.steps + counters_.rejected >= place_.settings.max_steps)
            return fail(Status::max_steps, "");
        if (((counters_.steps + counters_.rejected) & 255) == 0 && interrupted())
            return fail(Status::interrupted, "");
        return Status::ok;
    }

    // --- where steps fail ----------------------------------------------------------------------

    /// When surface j would be met at the present rate; infinite if the rate is (as a root's is,
    /// where it ends), which tells nothing.
    S time_to_surface(int j) const {
        constexpr S infinity = std::numeric_limits<S>::infinity();
        const S rate = normal_component(place_.sys, j, place_.clock.local, place_.x, place_.p,
                                        steps_.start_field());
        const S h = switching(place_.sys, place_.clock.local, place_.x, place_.p)[j];
        return abs_(rate) < infinity ? -h / rate : infinity;
    }
    /// The next trial after a stage that was not finite: nearly to the surface if the step led
    /// across it (the field may not exist beyond), else a quarter.
    FILIPPOV_COLD S shorter_than(const S& dt) const {
        for (int j = 0; j < M; ++j) {
            if (place_.mode[j] == 0 || is_directed(place_.sys, j))
                continue;
            const S eta = time_to_surface(j);
            if (eta / dt > S(0) && eta / dt < S(1))
                return S(0.9) * eta;
        }
        return dt / S(4);
    }
    /// The surfaces slid on, and others that are no farther than the width of their layers.
    FILIPPOV_COLD SurfaceSet<M> near_layers(const S& t, const X& x) const {
        const Vec<S, M> h = switching(place_.sys, t, x, place_.p);
        SurfaceSet<M> on;
        for (int k = 0; k < M; ++k)
            if (place_.mode[k] == 0 ||
                (may_have_layer(k) &&
                 abs_(h[k]) <= layer_width(place_.sys, k, t, x, place_.p, place_.scale)))
                on.add(k);
        return on;
    }
    bool may_have_layer(int k) const {
        return !is_kind(place_.sys, k, SurfaceKind::jump) && !is_directed(place_.sys, k);
    }
    X put_on(const SurfaceSet<M>& on, const S& t, const X& x) const {
        const Constraints<Sys> all(place_.sys, place_.mode, on);
        return project(place_.sys, all.of_state(place_.sys, t, x, place_.p), t, x, place_.p,
                       place_.scale);
    }
    /// The law of the field near surface j, if that is no farther than the width of its layer, and
    /// the field ends there like a root and leads to it.
    FILIPPOV_COLD RootLaw<S> root_near(int j, const S& side) const {
        const S t = place_.clock.local;
        const S h = switching(place_.sys, t, place_.x, place_.p)[j];
        if (!may_have_layer(j) ||
            !(abs_(h) <= layer_width(place_.sys, j, t, place_.x, place_.p, place_.scale)))
            return {};
        const SurfaceSet<M> on = near_layers(t, place_.x);
        const auto laws =
            root_laws(place_.sys, place_.mode, on, t, put_on(on, t, place_.x), place_.p,
                      place_.direction, place_.scale, [&](int k) {
                          return may_have_layer(k) && (place_.mode[k] != 0 || place_.layers.has(k));
                      });
        const RootLaw<S>& law = (side < S(0) ? laws.below : laws.above)[std::size_t(j)];
        return laws.layers.has(j) && side * law.rate < S(0) ? law : RootLaw<S>{};
    }
    /// True if nothing is left to surface j but rounding of h, and the field leads there.
    bool is_met_but_for_rounding(int j) const {
        const S t = place_.clock.local;
        const S rate = normal_component(place_.sys, j, t, place_.x, place_.p, steps_.start_field());
        return S(place_.mode[j]) * forward() * rate < S(0) &&
               abs_(switching(place_.sys, t, place_.x, place_.p)[j]) <=
                   rounding_band(place_.sys, j, t, place_.x, place_.p) / S(4);
    }
    /// Where a field ends like a root at its surface steps shrink with the way that is left, and
    /// rounding of h may be all of it. The surface is met when that way is within its layer: after
    /// the time that is left by the law, if nothing else changes in it, or at once, where steps
    /// have become too short to get there.
    FILIPPOV_COLD Stop contact_at_root(const S& dt, bool bad_stage) {
        Stop stop;
        for (int j = 0; j < M && stop.guard < 0; ++j) {
            if (place_.mode[j] == 0 || is_directed(place_.sys, j))
                continue;
            const S side(place_.mode[j]);
            if (bad_stage && elapsed_ > S(0) && is_met_but_for_rounding(j)) {
                place_.put(put_on(near_layers(place_.clock.local, place_.x), place_.clock.local,
                                  place_.x));
                have_k0_ = false;
                stop.guard = Guard<M>::below(j);
                break;
            }
            const RootLaw<S> law = root_near(j, side);
            if (!law.holds())
                continue;
            const S t = place_.clock.local, left = time_to_surface(j) / (S(1) - law.exponent);
            const X& f = steps_.start_field();
            const SurfaceSet<M> on = near_layers(t, place_.x);
            const X there = put_on(on, S(t + left), X(place_.x + left * f));
            const X as_far_beside = there + (place_.x - put_on(on, t, place_.x));
            const X change = left * (place_.field(S(t + left), as_far_beside) - f);
            // (from where it leaves the surface it does not come back at once)
            const bool comes = elapsed_ > S(0) ? forward() * left >= S(0) : forward() * left > S(0);
            if (comes && reaches(left) && place_.norm(change) <= S(0.1)) {
                leap(left, there);
                watch_.go_on_with_sections();
            } else if (abs_(dt) <= S(1e-3) * elapsed_) {
                place_.put(put_on(on, t, place_.x));
                have_k0_ = false;
            } else {
                continue;
            }
            stop.guard = Guard<M>::below(j);
        }
        return stop;
    }
    /// Where a field ends at its surface no step reaches across: the surface is met when the time
    /// left to it is below the resolution of time.
    FILIPPOV_COLD Stop contact_at_edge() {
        Stop stop;
        const S t = place_.clock.local;
        for (int j = 0; j < M; ++j) {
            if (place_.mode[j] == 0 || is_directed(place_.sys, j))
                continue;
            const S eta = time_to_surface(j);
            if (!(forward() * eta >= S(0) && abs_(eta) <= S(8) * place_.resolution()))
                continue;
            const X there = project(place_.sys, place_.held_with(j, t, place_.x), t, place_.x,
                                    place_.p, place_.scale);
            if (is_near(place_.x, there, place_.scale))
                place_.x = there;
            stop.guard = Guard<M>::below(j);
        }
        return stop;
    }
    FILIPPOV_COLD Status fail_small(bool bad_stage) {
        if (!bad_stage)
            return fail(Status::step_too_small, "");
        std::string_view what;
        const S t = place_.clock.local;
        for (int k = 1; k <= 64 && what.empty(); k *= 2) {
            const S dt = forward() * S(k) * place_.resolution();
            what = place_.what_is_not_finite(S(t + dt), X(place_.x + dt * steps_.start_field()));
        }
        if (what.empty())
            what = place_.what_is_not_finite(t, place_.x);
        return fail(Status::not_finite, what.empty() ? "a stage of the step" : what);
    }
    /// Where the field at the start of a step leads in a time too short to show another. (What
    /// moves by more than the tolerance is a surface that has begun to jump, and takes no state
    /// along.)
    X alone(const S& dt) const {
        const X moved = dt * steps_.start_field();
        return place_.norm(moved) <= S(1) ? X(place_.x + moved) : place_.x;
    }
    /// Leaves a slide, at guard g, for where the field leads alone.
    Stop break_off(int g, const S& dt) {
        leap(dt, alone(dt));
        watch_.go_on_with_sections();
        Stop stop;
        stop.guard = g;
        return stop;
    }
    /// Puts the end of a slide's step on its surface. Returns the surface that the step has lost
    /// instead, -1 if none (a fixed step follows it wherever it is).
    FILIPPOV_INLINE int hold_end(Attempt& path, bool beside) const {
        const X raw = path.x1;
        path.put_end_on_surface();
        // Of a step that errs by less than the tolerance the projection is as small; where it moves
        // nothing there may be nothing to move, or no way to the surface.
        const bool near = path.x1 != raw && place_.norm(X(path.x1 - raw)) <= S(1);
        return near || place_.settings.fixed_step > S(0)
                   ? -1
                   : lost_surface(place_, raw, path.dt, beside);
    }
    /// The surface that has run away from a slide within a few ulp of the time, and was followed by
    /// more than ten tolerances; -1: none.
    int carried_off(const Path& path) const {
        if (place_.mode.sliding() == 0 || prescribed_ || place_.settings.fixed_step > S(0) ||
            !(abs_(path.dt) <= few_ulp * place_.resolution()))
            return -1;
        return place_.norm(X(path.x1 - alone(path.dt))) > S(10) ? sliding_surface(place_.mode) : -1;
    }
    /// No step follows surface j of a slide: it has jumped within dt, and the state goes on alone.
    FILIPPOV_COLD Stop left_behind(int j, const S& dt) {
        if (prescribed_)
            return {fail(Status::step_too_small, "h jumps", j)};
        Stop stop = break_off(Guard<M>::below(j), dt);
        stop.left_behind = true;
        return stop;
    }
    /// No step of a slide is short enough: its surface is about to jump, or has a kink beyond
    /// which the slide has ended.
    FILIPPOV_COLD Stop end_of_short_slide() {
        if (may_meet_two_fold())
            if (const auto fold = two_fold_ahead(place_, sliding_surface(place_.mode), widest_);
                is_reached(fold))
                return end_in_two_fold(fold);
        for (int k = 1; k <= 16; k *= 2) {
            const S dt = forward() * S(k) * place_.resolution();
            if (!reaches(dt))
                break;
            const X x = alone(dt);
            if (const int lost = lost_surface(place_, x, dt, false); lost >= 0)
                return left_behind(lost, dt);
            const int g = prescribed_ ? -1 : watch_.ended_slide(S(place_.clock.local + dt), x);
            if (g < 0)
                continue;
            Stop stop = break_off(g, dt);
            stop.jumped = true;
            return stop;
        }
        if (may_meet_two_fold() && (is_at_pole() || ends_at_rest()))
            return at_pole();
        return {fail_small(false)};
    }
    /// True if h' vanishes where a slide has ended, on both sides, to the tolerance; the state is
    /// put there.
    FILIPPOV_COLD bool ends_at_rest() {
        if constexpr (slides_twice_v<Sys>) {
            Mode<M> twice = place_.mode;
            twice.hold_rate(sliding_surface(twice));
            const S t = place_.clock.local;
            const X there = project(place_.sys, Constraints<Sys>(place_.sys, twice), t, place_.x,
                                    place_.p, place_.scale);
            const S tau = forward() * time_scale();
            if (!is_near(place_.x, there, place_.scale) ||
                !may_slide_to_second_order(place_.sys, 0, t, there, place_.p, tau))
                return false;
            set_state(there);
            return true;
        }
        return false;
    }

    // --- two-folds -----------------------------------------------------------------------------

    /// True of a slide on one surface, judged, and with a field that has a pole.
    FILIPPOV_INLINE bool may_meet_two_fold() const {
        if constexpr (HasEquivalentControl<Sys, S>)
            return false;
        return !prescribed_ && !place_.layered && place_.mode.sliding() == 1 &&
               place_.mode.second_order == 0 &&
               !is_kind(place_.sys, sliding_surface(place_.mode), SurfaceKind::jump);
    }
    /// True if the slide goes to a two-fold, straight, and nothing else happens on the way.
    bool is_reached(const TwoFold<Sys, S>& fold) const {
        return fold.tends && fold.resolved && reaches(fold.after) &&
               watch_.only_slide_ends(sliding_surface(place_.mode),
                                      S(place_.clock.local + fold.after), fold.x);
    }
    Stop end_in_two_fold(const TwoFold<Sys, S>& fold) {
        leap(fold.after, fold.x);
        watch_.go_on_with_sections();
        in_two_fold_ = true;
        field_is_lost_ = !fold.has_field;
        Stop stop;
        stop.guard = Guard<M>::transversal(sliding_surface(place_.mode));
        return stop;
    }
    enum class Approach { none, shorter, ends };
    /// What a step is worth in which L1 - L2 has fallen to half: nothing if there is a two-fold
    /// less than two of these steps away. The field bends infinitely beside it, and has poles
    /// behind. Its length is halved with the distance, until this is resolved.
    FILIPPOV_COLD Approach approach_two_fold(const S& dt, TwoFold<Sys, S>& fold) {
        fold = two_fold_ahead(place_, sliding_surface(place_.mode), widest_);
        if (is_reached(fold))
            return Approach::ends;
        const S most = std::max(fold.reach / S(2), place_.resolution());
        if (fold.found && abs_(dt) > most) {
            ++counters_.rejected;
            dt_ = forward() * std::min(most, abs_(dt) / S(2));
            return Approach::shorter;
        }
        return Approach::none;
    }
    /// True if a step of a slide ends where L1 - L2 vanishes, though no two-fold was resolved: it
    /// is tried shorter, as far as time can be resolved.
    bool cuts_before_pole(const Found<S>& found, const S& dt) {
        if (!may_meet_two_fold() || found.touch ||
            found.guard != Guard<M>::transversal(sliding_surface(place_.mode)) ||
            !(abs_(dt) > S(16) * place_.resolution()))
            return false;
        ++counters_.rejected;
        dt_ = S(0.4375) * dt; // no probe falls again on the instant at which it may but touch zero
        return true;
    }
    /// L1 - L2 vanishes here, and no two-fold was resolved.
    Stop at_pole() {
        in_two_fold_ = true;
        Stop stop;
        stop.guard = Guard<M>::transversal(sliding_surface(place_.mode));
        return stop;
    }
    /// True if L1 - L2 only touches zero in a step, at its end or in the middle of it: where a
    /// switch loses its force for an instant the slide attracts before and after.
    FILIPPOV_COLD bool only_touches_pole(Attempt& path, Found<S>& found) {
        const int j = sliding_surface(place_.mode);
        if (!may_meet_two_fold() || found.guard != Guard<M>::transversal(j))
            return false;
        const auto w = [&](const S& theta) {
            return watch_.guard_value(found.guard, S(place_.clock.local + theta * path.dt),
                                      path(theta));
        };
        const S after = S(1) - found.theta;
        if (!(w(found.theta) >= S(0)) || !(after > S(1e-3)))
            return false;
        for (const double part : {1e-2, 0.1, 0.5, 1.0})
            if (!(w(S(found.theta + S(part) * after)) > S(0)))
                return false;
        return watch_.only_slide_ends(j, S(place_.clock.local + path.dt), path.x1);
    }
    /// True if L1 - L2 vanishes, or is no number, before time is resolved.
    FILIPPOV_COLD bool is_at_pole() const {
        const int j = sliding_surface(place_.mode);
        for (int k = 1; k <= 64; k *= 2) {
            const S dt = forward() * S(k) * place_.resolution();
            const Margin<S> m = place_.margin(j, S(place_.clock.local + dt), alone(dt));
            if (!(m.w * watch_.sense(Guard<M>::transversal(j)) > S(0)))
                return true;
        }
        return false;
    }
    /// Steps have shrunk to nothing: an event at the edge of where the field is, or the end.
    FILIPPOV_COLD Stop too_small(bool bad_stage) {
        if (place_.mode.sliding() == 0 && !prescribed_)
            if (const auto turn = low_turn()) {
                leap(turn->after, turn->x);
                watch_.go_on_with_sections();
                return {.guard = Guard<M>::below(0)};
            }
        if (!bad_stage)
            return place_.mode.sliding() > 0 ? end_of_short_slide() : Stop{fail_small(false)};
        Stop stop = contact_at_edge();
        if (stop.guard < 0 && may_meet_two_fold() && is_at_pole())
            return at_pole();
        if (stop.guard < 0 && place_.mode.sliding() > 1)
            stop.guard = Guard<M>::transversal(sliding_surface(place_.mode)); // no blend beyond
        return stop.guard >= 0 ? stop : Stop{fail_small(true)};
    }

    // --- directions ----------------------------------------------------------------------------

    /// A direction that moves, as it comes to rest.
    struct Stopping {
        int surface = -1;                             ///< its first component
        S after = std::numeric_limits<S>::infinity(); ///< the time to it at the present rate
    };
    /// The direction that comes to rest first.
    Stopping next_rest() const {
        using std::sqrt;
        Stopping first;
        const S t = place_.clock.local;
        const X& f = steps_.start_field();
        const Vec<S, M> a = switching(place_.sys, t, place_.x, place_.p),
                        rate = normal_components(place_.sys, t, place_.x, place_.p, f);
        for (int j = 0; j < M; ++j) {
            if (place_.mode[j] == 0 || !is_kind(place_.sys, j, SurfaceKind::direction))
                continue;
            S square(0), along(0), speed(0);
            for (int k = j; k < direction_end(place_.sys, j); ++k) {
                square += a[k] * a[k];
                along += a[k] * rate[k];
                speed += rate[k] * rate[k];
            }
            S after = -forward() * square / along;
            if (!(after >= S(0)) && square <= speed * brief() * brief())
                after = S(0); // it turns faster than time is resolved
            if (after >= S(0) && after < first.after)
                first = {j, after};
        }
        return first;
    }
    /// A time in which nothing can be resolved.
    S brief() const { return S(16) * place_.resolution(); }
    /// The mode in which that direction sticks.
    Mode<M> stuck(int j) const {
        Mode<M> mode = place_.mode;
        for (int k = j; k < direction_end(place_.sys, j); ++k)
            mode.set(k, 0);
        return mode;
    }
    /// True if a direction is as good as at rest: what the state changes until then is known to the
    /// tolerance, whatever way it turns, and nothing else happens in the meantime.
    bool is_at_rest(const Stopping& stopping, X& there) const {
        const S t = place_.clock.local, dt = forward() * stopping.after;
        if (!reaches(dt))
            return false;
        const X& f = steps_.start_field();
        const Mode<M> rest = stuck(stopping.surface);
        there = project(place_.sys, Constraints<Sys>(place_.sys, rest), S(t + dt),
                        X(place_.x + dt * f), place_.p, place_.scale);
        if (!all_finite<S, N>(there))
            return false;
        // What Newton's method leaves of a zero is none, but would be thrown by a floor.
        for (int i = 0; i < N; ++i)
            if (there[i] * there[i] < std::numeric_limits<S>::min())
                there[i] = S(0);
        if (stopping.after <= brief() || stopping.after <= place_.settings.fixed_step)
            return true;
        const X held = mode_field(place_.sys, rest, t, place_.x, place_.p);
        return place_.norm(X(dt * (f - held))) <= S(1) &&
               watch_.only_slide_ends(-1, S(t + dt), there);
    }
    /// Ends the mode where a direction comes to rest, straight, if it has as good as done so; else
    /// the next step is to end on the way there. A direction turns ever faster as it comes to rest
    /// and no step leads across: |a| falls in proportion.
    FILIPPOV_COLD bool comes_to_rest(Stop& stop) {
        if constexpr (has_directions_v<Sys>) {
            if (!has_directions(place_.sys) || prescribed_)
                return false;
            const Stopping stopping = next_rest();
            X there;
            if (stopping.surface < 0)
                return false;
            if (!is_at_rest(stopping, there)) {
                reach_ = std::min(reach_, S(0.9) * stopping.after);
                return false;
            }
            leap(forward() * stopping.after, there);
            watch_.go_on_with_sections();
            stop.guard = Guard<M>::below(stopping.surface);
            return true;
        }
        return false;
    }
    /// True if a direction turns too far in a step for it to be what it seems; half of it is tried.
    FILIPPOV_COLD bool turns_too_far(const S& dt) {
        if constexpr (has_directions_v<Sys>) {
            if (!has_directions(place_.sys) || place_.settings.fixed_step > S(0))
                return false;
            for (int j = 0; j < M; ++j)
                if (place_.mode[j] != 0 && is_kind(place_.sys, j, SurfaceKind::direction) &&
                    watch_.turns_too_far(j)) {
                    ++counters_.rejected;
                    dt_ = dt / S(2);
                    return true;
                }
        }
        return false;
    }
    /// The step with which directions leave rest. Returns true if the mode ends in it.
    FILIPPOV_COLD bool take_off(Stop& stop) {
        if constexpr (has_directions_v<Sys>) {
            const ProbeTimes<S>& times = probe_times<WindowTimes<S>, S>;
            watch_.probe_at(times);
            remaining_ = place_.clock.until(end_);
            S longest = std::min(place_.settings.max_step, abs_(remaining_));
            if (place_.settings.fixed_step > S(0))
                longest = std::min(place_.settings.fixed_step, abs_(remaining_));
            PathFromRest<Sys, S> path(place_, *leaving_, S(forward() * longest));
            for (int k = 0; k < 64; ++k) {
                path.probe(watch_, times);
                watch_.see(times);
                watch_.look(path, true, elapsed_);
                Found<S> found;
                if (watch_.any_doubt())
                    found = first_event(path, false);
                if (found.blurred) {
                    path.shorten(path.dt / S(4));
                    continue;
                }
                if (found.guard >= 0) {
                    stop = land_on_first(path, found, false);
                    if (stop.again) {
                        path.shorten(again_);
                        continue;
                    }
                    if (!stop.missed) {
                        leaving_.reset();
                        return true;
                    }
                }
                break;
            }
            dt_ = path.dt;
            accept(path);
            watch_.go_on();
            leaving_.reset();
            have_k0_ = false;
        }
        return false;
    }

    // --- steps ---------------------------------------------------------------------------------

    /// A step to be tried, of signed length.
    FILIPPOV_INLINE Trial<S> trial(bool fixed) const {
        Trial<S> t = next_trial(abs_(dt_), place_.settings.max_step,
                                fixed ? std::numeric_limits<S>::infinity() : reach_,
                                S(forward() * remaining_));
        t.dt *= forward();
        return t;
    }

    /// How far the next step should go: a fifth beyond the contact that is foreseen. One-sided
    /// fields may grow wild behind their surface (a pole, a square root), and steps that plunge
    /// there are mostly rejected.
    FILIPPOV_INLINE S reach_after(const S& dt) const {
        const S nearest = watch_.next_contact(abs_(dt_) / abs_(dt));
        return std::max(S(1.2) * nearest * abs_(dt), S(16) * place_.resolution());
    }
    /// The next step, after one that was good.
    FILIPPOV_INLINE void propose(Attempt& path, const Trial<S>& t, const S& error) {
        // A step cut by the end of the run, or before a surface, does not shrink the next proposal;
        // one that ends at an event keeps the full step's.
        S proposed = t.dt * S(control_.after_accept(static_cast<double>(error)));
        const S most = watch_.growth(path);
        if (abs_(proposed) > most * abs_(t.dt))
            proposed = most * t.dt;
        if (!(t.last || t.cut) || abs_(proposed) > abs_(dt_))
            dt_ = proposed;
        reach_ = path.slides && M == 1 ? std::numeric_limits<S>::infinity() : reach_after(t.dt);
    }

    /// The field where the steps begin.
    Status begin() {
        field_of_mode(place_, watch_,
                      [&](auto&& rhs) { steps_.begin(rhs.field(place_.clock.local, place_.x)); });
        ++counters_.field;
        have_k0_ = true;
        return all_finite<S, N>(steps_.start_field())
                   ? Status::ok
                   : fail(Status::not_finite,
                          place_.what_is_not_finite(place_.clock.local, place_.x));
    }

    /// True if a guard swings too fast in a step to tell its first event: a quarter of it is tried
    /// next. (What is no smoother in a short step, as noise, is followed after some trials.)
    FILIPPOV_COLD bool is_blurred(const Found<S>& found, const S& dt) {
        if (!found.blurred)
            return false;
        ++counters_.rejected;
        ++blurred_;
        dt_ = dt / S(4);
        return true;
    }
    /// True if a step is not like the solution, though its error estimates are small by chance;
    /// half of it is tried next. (Of first steps that are right of random problems 4% have a larger
    /// defect with dopri5 and none with the others; of those that erred by 300 tolerances one had a
    /// defect of 49.)
    FILIPPOV_COLD bool is_lucky(Attempt& path) {
        --checks_;
        if (path.defect() <= S(32)) {
            checks_ = 0;
            return false;
        }
        ++counters_.rejected;
        dt_ = path.dt / S(2);
        return true;
    }
    /// Steps of the method.
    Stop run() {
        if constexpr (has_directions_v<Sys>)
            if (leaving_)
                if (Stop stop; take_off(stop))
                    return stop;
        watch_.probe_at(steps_.times());
        const bool slides = place_.mode.sliding() > 0;
        if (!have_k0_)
            if (const Status status = begin(); status != Status::ok)
                return {status};
        const bool fixed = place_.settings.fixed_step > S(0);
        bool bad_stage = false,
             beside = prescribed_; // a prescribed mode may begin beside its surface
        reach_ = slides ? std::numeric_limits<S>::infinity() : first_reach_;
        first_reach_ = std::numeric_limits<S>::infinity();
        for (;;) {
            remaining_ = place_.clock.until(end_);
            if (!(forward() * remaining_ > S(0)))
                return {};
            if (const Status status = may_go_on(); status != Status::ok)
                return {status};
            if constexpr (has_directions_v<Sys>)
                if (Stop stop; comes_to_rest(stop))
                    return stop;
            const Trial<S> tried = trial(fixed);
            const S dt = tried.dt;
            if (abs_(dt_) < place_.resolution() && !(tried.last && !bad_stage))
                return too_small(bad_stage);

            Attempt path(place_, watch_, steps_, counters_, dt);
            if (!steps_.facts().probes_stages)
                path.probe();
            const bool good = path.judged.finite();
            const S error = path.judged.error;
            if (!good || !(error <= S(1))) {
                ++counters_.rejected;
                bad_stage = !good || !(error < std::numeric_limits<S>::infinity());
                dt_ = bad_stage ? shorter_than(dt)
                                : dt * S(control_.after_reject(static_cast<double>(error)));
                if (!bad_stage && error > S(far_off))
                    checks_ = std::max(checks_, 1);
                if (bad_stage && fixed)
                    return {fail_small(true)};
                if constexpr (may_have_layers_v<Sys, S>)
                    if ((bad_stage || counters_.rejected % 8 == 0) && !prescribed_ && !fixed)
                        if (const Stop stop = contact_at_root(dt, bad_stage); stop.guard >= 0)
                            return stop;
                continue;
            }
            if constexpr (has_directions_v<Sys>)
                if (turns_too_far(dt))
                    continue;
            const bool unjudged = !(error > S(1e-10)); // (it is a square)
            if (!slides && checks_ > 0 && !fixed && is_lucky(path))
                continue;
            if (slides)
                if (const int lost = hold_end(path, beside); lost >= 0) {
                    if (abs_(dt) <= S(2) * place_.resolution())
                        return left_behind(lost, dt);
                    ++counters_.rejected;
                    dt_ = forward() * std::max(abs_(dt) / S(4), place_.resolution());
                    continue;
                }

            if (slides)
                if (may_meet_two_fold()) {
                    const int j = sliding_surface(place_.mode);
                    const S now = watch_.transversality(j);
                    transversality_ = std::max(transversality_, now);
                    widest_ = std::max(widest_, now);
                    if (watch_.loses_transversality(j, transversality_)) {
                        TwoFold<Sys, S> fold;
                        const Approach how = approach_two_fold(dt, fold);
                        if (how == Approach::ends)
                            return end_in_two_fold(fold);
                        if (how == Approach::shorter)
                            continue;
                        transversality_ = S(0);
                    }
                }
            Found<S> found;
            watch_.look(path, unjudged, elapsed_);
            if (!place_.settings.skip_root_search || watch_.any_doubt()) {
                // a step of a few ulp from a root has no inside: the root divided out leaves
                // rounding
                if (abs_(dt) > S(8) * place_.resolution() || !watch_.starts_on_root())
                    found = first_event(path, fixed);
                if (is_blurred(found, dt))
                    continue;
                if (found.guard < 0)
                    found = watch_.contact_at_end(path, tried.last);
            }
            if (slides)
                if (found.guard >= 0) {
                    if (only_touches_pole(path, found)) {
                        if (found.theta < S(0.7)) { // (what comes later in this step is not known)
                            ++counters_.rejected;
                            dt_ = S(1.25) * found.theta * dt;
                            continue;
                        }
                        found = {};
                    } else if (cuts_before_pole(found, dt)) {
                        continue;
                    }
                }
            if (!fixed)
                propose(path, tried, error);
            else
                dt_ = forward() * place_.settings.fixed_step; // (it may have been cut)
            if (found.guard >= 0) {
                const Stop stop = land_on_first(path, found, fixed);
                if (stop.again) {
                    dt_ = again_;
                    continue;
                }
                if (!stop.missed) {
                    steps_.go_on();
                    return stop;
                }
            }
            bad_stage = beside = false;
            accept(path);
            steps_.go_on();
            watch_.go_on();
            if constexpr (slides_twice_v<Sys>)
                if (place_.mode.second_order != 0 && !fixed) [[unlikely]]
                    if (!keeps_second_order(place_.sys, 0, place_.clock.local, place_.x, place_.p,
                                            S(forward() * time_scale())))
                        return at_pole();
        }
    }
    Found<S> first_event(Path& path, bool fixed, std::uint64_t missed = 0) {
        ++counters_.root_searches;
        return watch_.first_event(path, fixed || blurred_ >= most_blurred, missed);
    }
    /// Lands on what was found first, or, where no step has that root, on what comes after it.
    FILIPPOV_COLD Stop land_on_first(Path& path, Found<S> found, bool fixed) {
        Stop stop = land(path, found);
        for (std::uint64_t missed = 0; stop.missed;) {
            missed |= std::uint64_t(1) << found.guard;
            found = first_event(path, fixed, missed);
            if (found.guard < 0 || found.blurred)
                break;
            stop = land(path, found);
        }
        return stop;
    }

    /// Windows of a slide that the system knows in closed form.
    Stop run_closed_form() {
        using Window = ClosedFormPath<Sys, S>;
        const bool vouched = vouches_for_slides<S>(place_.sys);
        const ProbeTimes<S>& times = Window::times(vouched);
        watch_.probe_at(times);
        have_k0_ = false;
        const S period = place_.clock.period;
        S longest = period > S(0) ? period / S(2) : std::numeric_limits<S>::infinity();
        if constexpr (HasSlideSwing<Sys, S>)
            if (vouched)
                longest = place_.sys.slide_swing(place_.p);
        S window = vouched || period > S(0) ? longest / S(4) : abs_(dt_);
        for (;;) {
            remaining_ = place_.clock.until(end_);
            if (!(forward() * remaining_ > S(0)))
                return {};
            if (const Status status = may_go_on(); status != Status::ok)
                return {status};
            window = std::max(std::min({window, longest, place_.settings.max_step}),
                              place_.resolution());
            const bool last = window >= abs_(remaining_);
            Window path(place_, last ? remaining_ : S(forward() * window), vouched);
            window_ = abs_(path.dt);
            path.probe(watch_);
            watch_.see(times);
            if (!path.finite())
                return {fail(Status::not_finite, "sliding_flow")};
            Found<S> found;
            watch_.look(path, !vouched, elapsed_);
            if (!place_.settings.skip_root_search || watch_.any_doubt()) {
                found = first_event(path, false);
                if (found.blurred) {
                    ++blurred_;
                    window /= S(4);
                    continue;
                }
                if (found.guard < 0)
                    found = watch_.contact_at_end(path, last);
            }
            if (found.guard >= 0) {
                const Stop stop = land_on_first(path, found, false);
                if (!stop.again && !stop.missed)
                    return stop;
                if (stop.again) {
                    window = abs_(again_);
                    continue;
                }
            }
            window = window_ * std::min(S(4), watch_.growth(path));
            accept(path);
            watch_.go_on();
        }
    }

    Place<Sys, S> place_;
    Guards watch_;
    const Observer<S, N, M>& observer_;
    Clock<S> end_{};
    S dt_ = S(0);
    S natural_step_ = S(0); ///< what the first step would be if no setting said otherwise
    S window_ = S(0);       ///< length of the last window of a slide in closed form
    S reach_ = std::numeric_limits<S>::infinity(); ///< where the next step should end at the latest
    S first_reach_ = std::numeric_limits<S>::infinity(); ///< of the first step after an event
    S remaining_ = S(0);       ///< from the clock to the end of the run, at the last trial
    S dt_before_slide_ = S(0); ///< the proposal when the last slide began; 0: the run began in it
    S widest_ = S(0);          ///< the largest L1 - L2 of a slide,
    S transversality_ = S(0);  ///< and since its two-fold was looked for last
    bool in_two_fold_ = false, field_is_lost_ = false;
    bool have_k0_ = false;
    bool prescribed_ = false; ///< nobody judges: the mode is followed wherever it leads
    /// How many trials are checked by their defect until one passes: the first ones of a run, and
    /// those of its first slip if it began in a slide, whose steps tell nothing of it (a field with
    /// noise may never pass); and one after a trial whose error was far above the tolerance, where
    /// no order of the method holds.
    int checks_ = 0;
    static constexpr int most_checks = 8;
    static constexpr double far_off = 1e4; ///< the square of that error
    /// So many units of the resolution of time are no time for a solution. (A thousand in `float`
    /// are a step.)
    static constexpr S few_ulp = epsilon<S> < S(1e-12) ? S(4096) : S(64);
    S again_ = S(0);   ///< how long the step is that is tried again
    S elapsed_ = S(0); ///< since the mode began
    int blurred_ = 0;  ///< trials in a row in which a guard swung too fast
    static constexpr int most_blurred = 8;
    Method& steps_;
    StepControl<MethodFacts> control_;
    Counters counters_{};
    Diagnosis<S, N, M> diagnosis_{};
    struct Nothing {};
    /// How directions that are at rest leave it in this mode.
    [[no_unique_address]] std::conditional_t<
        has_directions_v<Sys>, std::optional<LeavingRest<Sys, S>>, Nothing> leaving_{};
};

/// Where a prescribed segment ended.
template <class S, int N, int M> struct SegmentResult {
    Status status = Status::ok; ///< `event` if the target was met, `ok` at t_end
    Clock<S> clock{};
    S t{};
    Vec<S, N> x{};
    Counters counters{};
    Diagnosis<S, N, M> diagnosis{};
};

/// Follows one prescribed mode from x0 at t0 to the first root of a target, or to t_end.
///
/// Nothing is judged: a slide goes on beyond |s| = 1, a one-sided field beyond its side as long as
/// it is finite, and other surfaces are passed. So the end depends smoothly on the start wherever
/// the target is met transversally, which shooting and continuation need.
/// @param target  Guard<M>::below(j): h_j = 0, or in a slide s = -1; Guard<M>::above(j): s = +1;
/// -1: none.
///                A target that is zero at the start is not found there.
/// @param observer  hears of steps alone, see Observer
/// @error std::invalid_argument as in `flow`; else a Status
template <class Tableau, class Sys, std::floating_point S>
SegmentResult<S, dim_v<Sys>, surfaces_v<Sys>>
segment(const Sys& sys, const GivenParams<Sys, S>& params, const Mode<surfaces_v<Sys>>& mode,
        const Vec<S, dim_v<Sys>>& x0, std::type_identity_t<S> t0, std::type_identity_t<S> t_end,
        int target, const Settings<S, dim_v<Sys>>& settings,
        const ObserverOf<Sys, S>& observer = {}) {
    require_system<Sys>();
    const Params<Sys, S> p = params.of(sys);
    validate(settings);
    validate_start(x0, t0, t_end, p, given_params(sys));
    detail::validate_prescribed(sys, mode, target);
    if (observer.begin)
        observer.begin(t0, t_end);
    const AnySections<S, dim_v<Sys>, params_v<Sys>> none;
    StepsOf<Tableau, Sys, S> steps;
    Segment<Sys, S> run(sys, p, t0, x0, t_end, settings, observer, none, steps);
    run.prescribe(mode, target);
    const Stop stop = run.advance();
    SegmentResult<S, dim_v<Sys>, surfaces_v<Sys>> result;
    result.status = stop.status != Status::ok ? stop.status
                    : stop.guard < 0          ? Status::ok
                    : stop.guard == target    ? Status::event
                                              : Status::step_too_small;
    result.clock = run.clock();
    result.t = result.clock.absolute();
    result.x = run.x();
    result.counters = run.counters();
    result.diagnosis = run.diagnosis();
    return result;
}

} // namespace filippov
