// SPDX-License-Identifier: BSD-3-Clause
// The event loop: judges every contact and chains segments.
#pragma once

#include <filippov/engine/detail/flow_result.hpp>
#include <filippov/engine/segment.hpp>
#include <filippov/events/accumulation.hpp>
#include <filippov/methods/dormand_prince5.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/sliding/junction.hpp>
#include <filippov/sliding/rest.hpp>
#include <filippov/sliding/root_law.hpp>

#include <optional>

namespace filippov {

namespace detail {

/// The loop of `flow`, with its bookkeeping of events.
template <class Sys, class S> class Flow {
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using P = Params<Sys, S>;
    using Watched = AnySections<S, N, params_v<Sys>>;

public:
    Flow(const Sys& sys, const P& p, const S& t0, const X& x0, const S& t_end,
         const Settings<S, N>& settings, const Observer<S, N, M>& observer, const Watched& sections,
         const KnownStart<M>& known_start, Steps<Sys, S>& steps)
        : sys_(sys), p_(p), settings_(settings), observer_(observer), sections_(sections),
          known_start_(known_start),
          segment_(sys, p, t0, x0, t_end, settings, observer, sections, steps) {}

    FlowResult<S, N, M> run() {
        Status status = start();
        log_start(status);
        while (status == Status::ok) {
            const Stop stop = segment_.advance();
            if (stop.status != Status::ok) {
                status = stop.status;
                break;
            }
            if (stop.guard < 0)
                break;
            status = handle(stop);
            if (status == Status::ok && ends_here())
                status = Status::event;
            segment_.let_observer_skip();
        }
        flush();
        tell(make_event(EventKind::end, -1, segment_.mode(), segment_.mode()));
        FlowResult<S, N, M> result;
        result.surfaces = surface_count(sys_);
        result.components = component_count(sys_);
        result.status = status;
        result.clock = segment_.clock();
        result.t = result.clock.absolute();
        result.x = segment_.x();
        result.mode = segment_.mode();
        result.counters = segment_.counters();
        result.diagnosis = segment_.diagnosis();
        return result;
    }

private:
    /// Finds the mode at the start: by the sign of h, or as at any contact if h is zero.
    Status start() {
        const S t = segment_.clock().local;
        const Vec<S, M> h = switching(sys_, t, segment_.x(), p_);
        if (!all_finite<S, M>(h))
            return segment_.fail(Status::not_finite, "h");
        if (known_start_.guard >= 0)
            return start_as_known();
        const auto [mode, contacts] = place();
        for (int j = 0; j < M; ++j)
            if (is_kind(sys_, j, SurfaceKind::jump) && mode[j] < 0)
                return segment_.fail(Status::escaped, "starts beyond a surface with jumps", j);
        segment_.enter(mode);
        if (contacts.n > 0) {
            start_surface_ = contacts[0];
            contacts_ = contacts;
            if (const Status status = settle(mode, contacts); status != Status::ok)
                return status;
            segment_.enter(mode);
        }
        segment_.choose_first_step();
        start_x_ = segment_.x();
        return go_on(mode, contacts, -1);
    }

    /// On which sides of the surfaces the state is, and which of these it is on: to rounding, or to
    /// what the tolerance calls nothing.
    /// @param met, h_met  a surface that was met with this h: still there if |h| has not grown
    std::pair<Mode<M>, SurfaceSet<M>> place(int met = -1, const S& h_met = S(0)) const {
        const S t = segment_.clock().local;
        const Vec<S, M> h = switching(sys_, t, segment_.x(), p_);
        Mode<M> mode;
        SurfaceSet<M> contacts;
        for (int j = 0; j < M; ++j) {
            mode.set(j, h[j] < S(0) ? -1 : 1);
            using std::abs;
            if (abs(h[j]) <= start_band(sys_, j, t, segment_.x(), p_, X(settings_.atol)) ||
                (j == met && abs(h[j]) <= abs(h_met))) {
                contacts.add(j);
                if (is_kind(sys_, j, SurfaceKind::jump))
                    mode.set(j, +1);
            }
        }
        for (int j = 0; j < M; ++j)
            if (is_directed(sys_, j))
                mode.set(j, +1);
        return {mode, whole_directions(contacts)};
    }
    /// True of one surface, or of two components of one direction.
    bool same_direction(int j, int k) const {
        return j == k || (is_directed(sys_, j) && is_directed(sys_, k) &&
                          direction_begin(sys_, j) == direction_begin(sys_, k));
    }
    /// These surfaces, but for directions of which some components are not among them.
    SurfaceSet<M> whole_directions(const SurfaceSet<M>& on) const {
        if constexpr (!has_directions_v<Sys>)
            return on;
        SurfaceSet<M> whole;
        for (const int j : on) {
            bool all = true;
            if (is_directed(sys_, j))
                for (int k = direction_begin(sys_, j); k < direction_end(sys_, j); ++k)
                    all = all && on.contains(k);
            if (all)
                whole.add(j);
        }
        return whole;
    }

    /// Puts the state on surfaces that meet.
    Status settle(const Mode<M>& mode, const SurfaceSet<M>& on) {
        const Constraints<Sys> all(sys_, mode, on);
        SurfaceSet<M> without_kinks;
        for (const int j : on)
            if (!is_kind(sys_, j, SurfaceKind::kink))
                without_kinks.add(j);
        const S t = segment_.clock().local;
        const X& x = segment_.x();
        // What bends a field holds nothing: where not all can hold the state, kinks do not.
        if (without_kinks.n < on.n &&
            !independent(sys_, all.of_state(sys_, t, x, p_), t, x, p_, segment_.scale()))
            return settle(Constraints<Sys>(sys_, mode, without_kinks));
        return settle(all);
    }
    Status settle(const Constraints<Sys>& all) {
        const S t = segment_.clock().local;
        const Constraints<Sys> on = all.of_state(sys_, t, segment_.x(), p_);
        for (int i = 0; i < on.size(); ++i)
            if (!(on.gradient(sys_, i, t, segment_.x(), p_).cwiseAbs().maxCoeff() > S(0)))
                return segment_.fail(Status::degenerate_surface, "grad h", on.surface(i));
        const auto hold = independent_part(sys_, on, t, segment_.x(), p_, segment_.scale());
        const X there = project(sys_, hold, t, segment_.x(), p_, segment_.scale());
        if (is_near(segment_.x(), there, segment_.scale()))
            segment_.set_state(there);
        if (hold.size() < on.size()) {
            const int last = on.surface(on.size() - 1);
            if (one_is_given_twice(on))
                return segment_.fail(
                    Status::dependent_surfaces,
                    "two of these surfaces are the same: let one switch both terms", last);
            if (!lies_on(sys_, on, t, segment_.x(), p_, segment_.scale()))
                return segment_.fail(Status::dependent_surfaces, "grad h", last);
        }
        return Status::ok;
    }
    /// True if two of these surfaces that switch a field are the same, here and around: what each
    /// of them does alone no solution says.
    FILIPPOV_COLD bool one_is_given_twice(const Constraints<Sys>& on) const {
        const auto switches = [&](int i) {
            return is_kind(sys_, on.surface(i), SurfaceKind::switching);
        };
        for (int i = 0; i < on.size(); ++i)
            for (int k = 0; k < i; ++k)
                if (switches(i) && switches(k) &&
                    is_same_surface(sys_, on.surface(i), on.surface(k), segment_.clock().local,
                                    segment_.x(), p_))
                    return true;
        return false;
    }

    /// Starts where a guard was met in a mode that the caller names: on its surface, and on those
    /// slid on before.
    Status start_as_known() {
        Mode<M> before = known_start_.before;
        for (int k = surface_count(sys_); k < M; ++k)
            before.set(k, 1); // a surface that there is not
        const int j = start_surface_ = known_start_.guard / 3;
        SurfaceSet<M> on = slid_surfaces(before);
        if (!on.contains(j))
            on.add(j);
        if (on.n == 1) {
            put_on_known_surface(j);
        } else {
            segment_.enter(before);
            if (const Status status = settle(before, on); status != Status::ok)
                return status;
        }
        segment_.enter(before);
        segment_.choose_first_step();
        return judge(before, on, known_start_.guard);
    }

    void put_on_known_surface(int j) {
        const S t = segment_.clock().local;
        const X x = segment_.x(), there = project(sys_, j, t, x, p_, segment_.scale());
        const X f = mode_field(sys_, known_start_.before, t, x, p_);
        if (may_be_put_on(sys_, j, t, p_, x, there, f, segment_.scale()))
            segment_.set_state(there);
    }

    /// The first event, also of a run that could not start; a section that is zero here is met
    /// here, once, and does not end the run.
    void log_start(Status status) {
        Event<S, N, M> start =
            make_event(EventKind::start, start_surface_, segment_.mode(), segment_.mode());
        if (thrown_) { // it jumped at once
            start.mode_before = start.mode_after = held_.mode_before;
            start.x_left = start.x_right = start_x_;
        }
        tell(start);
        if (status != Status::ok)
            return;
        for (int q = 0; q < sections_.size(); ++q) {
            if (segment_.watch().section_value(q) == S(0))
                log(EventKind::section, q, segment_.mode(), X(segment_.x()));
            asked_ = true;
            segment_.watch().start_section(q);
        }
    }

    /// Judges the point where surfaces meet and enters the mode that goes on from there.
    /// @param on     the surfaces that were met and those slid on
    /// @param guard  the one that was met there, -1 at the start
    Status judge(const Mode<M>& before, const SurfaceSet<M>& on, int guard) {
        contacts_ = on;
        const int j = guard >= 0 ? guard / 3 : on[0];
        const bool one = on.n == 1 && !is_kind(sys_, j, SurfaceKind::jump);
        Verdict<M> v = one ? judge_one(before, on[0], guard) : judge_several(before, on, guard);
        RootLaws<Sys, S> roots;
        const Layers<Sys, S>* layers = nullptr;
        if constexpr (may_have_layers_v<Sys, S>)
            if (may_end_like_root(v, on)) {
                roots = roots_at(before, on);
                // (on the surface itself they may be no numbers: rounding of h has either sign)
                layers = roots.any()                       ? &roots.layers
                         : !v.finite && roots.beyond.any() ? &roots.beyond
                                                           : nullptr;
                if (layers != nullptr)
                    v = judge_beside(roots, *layers, before, on, guard, one);
            }
        if (!v.finite)
            return segment_.fail(Status::not_finite, v.below.finite ? side_name(+1) : side_name(-1),
                                 j);
        alternatives_ = v.unique ? 0 : v.n_options;
        if (!v.unique) {
            const int chosen = choice(v);
            const NonUnique policy = settings_.on_nonunique;
            // The one option there is may be to stay where nothing attracts.
            const bool only_stay = v.n_options == 1 && policy != NonUnique::stay;
            const bool none = v.n_options == 0 || (chosen < 0 && only_stay);
            if (v.n_options == 0 && !independent_here(on))
                return segment_.fail(Status::dependent_surfaces, "grad h", j);
            if (none || (chosen < 0 && policy == NonUnique::stop))
                return segment_.fail(Status::ambiguous, v.reason, j, v.n_options);
            if (chosen >= 0)
                v.take(chosen);
        }
        if (v.mode.sliding() > 0 && !v.mode.holds_rate(j) &&
            (segment_.field_is_lost() || !slides(v.mode, layers)))
            return segment_.fail(Status::ambiguous, "L1 = L2: no sliding field", j);
        if (v.mode.holds_rate(j))
            if (const Status status = settle(Constraints<Sys>(sys_, v.mode)); status != Status::ok)
                return status;
        if constexpr (has_jumps_v<Sys>) // in contact the normal speed is zero, too
            if (v.mode.sliding() > 0)
                if (const Status status = settle(Constraints<Sys>(sys_, v.mode));
                    status != Status::ok)
                    return status;
        if (roots.beyond.any())
            segment_.set_state(
                beside(sys_, roots.beyond, v.mode, on, segment_.clock().local, segment_.x(), p_));
        segment_.look_from_beside(roots.layers);
        if constexpr (slides_twice_v<Sys>)
            if (const S t = segment_.clock().local;
                v.mode[j] != 0 && switching(sys_, t, segment_.x(), p_)[j] * S(v.mode[j]) < S(0) &&
                !all_finite<S, N>(side_field(sys_, v.mode, t, segment_.x(), p_)))
                segment_.set_state(judged_at(j)); // a field may end at the surface
        segment_.enter(v.mode);
        for (const int k : on) {
            const auto i = std::size_t(k);
            if (roots.layers.has(k) || (roots.beyond.has(k) && v.mode[k] != 0))
                continue; // rests, or goes on from beside
            if (v.mode[k] != 0) {
                segment_.watch().start_root(Guard<M>::below(k), std::max(1, v.starts.side[i]));
                continue;
            }
            if (v.starts.below[i] > 0)
                segment_.watch().start_root(Guard<M>::below(k), v.starts.below[i]);
            if (v.starts.above[i] > 0)
                segment_.watch().start_root(Guard<M>::above(k), v.starts.above[i]);
        }
        if constexpr (has_directions_v<Sys>)
            if (const auto leaving = leaving_rest(sys_, v.mode, on); leaving.n > 0)
                segment_.leave_rest(leaving, slide_end(before, guard));
        return Status::ok;
    }
    /// True if fields may end like a root at one of these surfaces: at a kink, at what has a layer,
    /// and where their derivatives did not decide.
    bool may_end_like_root(const Verdict<M>& v, const SurfaceSet<M>& on) const {
        if (any_directed(sys_, on)) // modes of directions are judged by `admissible_at_rest` alone
            return false;
        bool may = !v.finite || !v.unique;
        for (const int k : on)
            may = may || is_kind(sys_, k, SurfaceKind::kink) || segment_.layers().has(k);
        return may || (on.n == 1 && (v.below.sign == 0 || v.above.sign == 0) &&
                       !is_kind(sys_, on[0], SurfaceKind::jump));
    }
    FILIPPOV_COLD RootLaws<Sys, S> roots_at(const Mode<M>& mode, const SurfaceSet<M>& on) const {
        const S t = segment_.clock().local;
        const X& x = segment_.x();
        const int direction = segment_.direction();
        auto laws = root_laws(sys_, mode, on, t, x, p_, direction, segment_.scale(),
                              [&](int k) { return !is_kind(sys_, k, SurfaceKind::jump); });
        for (const int k : on)
            laws.repels[std::size_t(k)] =
                laws.layers.has(k) && repels_to_second_order(sys_, mode, k, laws.layers, on, t, x,
                                                             p_, direction, segment_.time_scale());
        return laws;
    }
    /// Judges where fields end like a root, by what they do beside the surfaces.
    FILIPPOV_COLD Verdict<M> judge_beside(const RootLaws<Sys, S>& roots,
                                          const Layers<Sys, S>& layers, const Mode<M>& before,
                                          const SurfaceSet<M>& on, int guard, bool one) const {
        const SlideEnd<M> exit = slide_end(before, guard);
        if (one)
            return admissible_beside(roots, before, on[0], exit.side[on[0]],
                                     settings_.on_nonunique);
        Verdict<M> v;
        if constexpr (!single_v<Sys>) {
            const Arrival<S> arrival{segment_.direction(), segment_.time_scale()};
            v = admissible(sys_, before, on, segment_.clock().local, segment_.x(), p_, arrival,
                           exit, settings_.on_nonunique, &layers);
            for (const int k : on)
                if (!exit.ends_on(k) && layers.has(k) &&
                    (roots.grows_from_nothing(k) || roots.repels[std::size_t(k)])) {
                    v.unique = false;
                    v.reason =
                        roots.repels[std::size_t(k)]
                            ? "fields lead away from a surface to second order"
                            : "a field that leads away from a surface grows like a root from "
                              "nothing";
                }
        }
        return v;
    }
    /// What the observer chooses, -1: nothing.
    int choice(const Verdict<M>& v) const {
        const int chosen = observer_.choose ? observer_.choose(v) : -1;
        if (!(chosen >= -1 && chosen < v.kept()))
            refuse("choose", chosen,
                   "expected -1, or the number of an option, of which there are " +
                       std::to_string(v.kept()));
        return chosen;
    }
    /// True if all of these surfaces could hold the state at once, contact with its speed included.
    bool independent_here(const SurfaceSet<M>& on) const {
        Mode<M> held = segment_.mode();
        for (const int k : on)
            held.set(k, 0);
        return independent(sys_, Constraints<Sys>(sys_, held), segment_.clock().local, segment_.x(),
                           p_, segment_.scale());
    }
    /// The point that is judged. Beside the surface the fields may differ by the root of rounding,
    /// or end: it is on the surface to the last bit, if that is no farther than a thousandth of the
    /// tolerance.
    X judged_at([[maybe_unused]] int j) const {
        const X& x = segment_.x();
        if constexpr (slides_twice_v<Sys>) {
            const X exact = filippov::detail::exact_point(sys_, j, segment_.clock().local, x, p_).x;
            if (is_near(x, exact, X(S(1e-3) * segment_.scale())))
                return exact;
        }
        return x;
    }
    /// Where a slide of second order on surface j ended: to one side, by s, or else h' cannot be
    /// held any longer.
    static Verdict<M> end_of_second_order(Mode<M> mode, int j, int guard) {
        Verdict<M> v;
        v.unique = guard != Guard<M>::transversal(j);
        v.reason = "sliding to second order, h = h' = 0, is not shown to attract any longer";
        if (v.unique) {
            Starts<M> starts;
            starts.side[std::size_t(j)] = 3;
            mode.set(j, guard == Guard<M>::below(j) ? -1 : 1);
            v.add(mode, starts, NonUnique::stop);
        }
        return v;
    }
    /// Leaves a slide of second order. At first h' is rounding, and a root of |h| in the field all
    /// but holds the solution: it goes along the surface with the field of its side until h has
    /// left it by some tolerances, or, where nothing holds it, for as long as h does not leave it
    /// by a tenth of one.
    FILIPPOV_COLD void depart_from_second_order([[maybe_unused]] int j) {
        if constexpr (slides_twice_v<Sys>) {
            const Clock<S> from = segment_.clock();
            for (int k = 0; k < most_departures && depart(j); ++k) {
            }
            if (from.until(segment_.clock()) == S(0))
                return;
            segment_.enter(segment_.mode());
            const S t = segment_.clock().local;
            const S h = switching(sys_, t, segment_.x(), p_)[j];
            using std::abs;
            if (abs(h) <= rounding_band(sys_, j, t, segment_.x(), p_))
                segment_.watch().start_root(Guard<M>::below(j), 1);
        }
    }
    static constexpr int most_departures = 10000;
    /// One straight piece of this; false if there is none.
    FILIPPOV_COLD bool depart(int j) {
        using std::abs;
        const Mode<M> mode = segment_.mode();
        const S t = segment_.clock().local, forward = S(segment_.direction());
        const X start = filippov::detail::exact_point(sys_, j, t, segment_.x(), p_).x;
        const auto along = [&](const S& dt, const X& f) {
            return filippov::detail::exact_point(sys_, j, S(t + dt), X(start + dt * f), p_);
        };
        const auto field = [&](const S& time, const X& y) {
            return side_field(sys_, mode, time, y, p_);
        };
        const X f = field(t, start);
        S dt = forward * segment_.time_scale();
        for (int k = 0; k < 64; ++k, dt /= S(2)) {
            const S later = t + dt, half = dt / S(2);
            const X middle = along(half, f).x, straight = along(dt, f).x;
            const auto [end, m, off] = along(dt, field(S(t + half), middle));
            const S slope = grad_h(sys_, j, later, end, p_)[m];
            const S allowed = change_over(sys_, j, later, end, p_, segment_.scale());
            const auto at_height = [&, &on = end, by = m](const S& height) {
                X y = on;
                y[by] += S(mode[j]) * height / slope;
                return y;
            };
            const auto rise = [&](const S& height) { // away from the surface
                const X y = at_height(height);
                return forward * S(mode[j]) *
                       normal_component(sys_, j, later, y, p_, field(later, y));
            };
            S low(0), high = S(8) * allowed;
            const bool held = !(rise(high) > S(0));
            if (!(held || rise(low) * abs(dt) <= S(0.1) * allowed) || !segment_.reaches(dt) ||
                !is_near(straight, end, segment_.scale()))
                continue;
            if (!(rise(low) > S(0)))
                return false;
            for (int i = 0; held && i < 40; ++i)
                (rise((low + high) / S(2)) > S(0) ? low : high) = (low + high) / S(2);
            const X there = at_height(low);
            if (!keeps_sides(mode, later, there))
                return false;
            segment_.leap(dt, there);
            return held;
        }
        return false;
    }
    Verdict<M> judge_one(const Mode<M>& before, int j, int guard) const {
        if (guard >= 0 && before.holds_rate(j))
            return end_of_second_order(before, j, guard);
        Arrival<S> arrival{segment_.direction(), segment_.time_scale()};
        // Of a side that was left no sooner than it was met again nothing is known.
        if (guard >= 0 && n_same_ < 2)
            arrival.from = before[j];
        // A slide ends where L1 or L2 vanishes, or both: the landing says so better than rounding.
        // (With static friction it ends elsewhere.)
        if (guard >= 0 && before[j] == 0 && !(s_max(sys_, p_) > S(1))) {
            arrival.below_tangent = guard != Guard<M>::above(j);
            arrival.above_tangent = guard != Guard<M>::below(j);
        }
        const X x = judged_at(j);
        const auto judged = [&] {
            return admissible(sys_, before, j, segment_.clock().local, x, p_, arrival,
                              settings_.on_nonunique);
        };
        const auto undecided = [](const Verdict<M>& v) {
            return v.finite && (v.below.sign == 0 || v.above.sign == 0);
        };
        Verdict<M> v = judged();
        if (undecided(v) && segment_.longer_time_scale() > arrival.tau) {
            arrival.tau = segment_.longer_time_scale();
            v = judged();
        }
        if (undecided(v)) {
            arrival.looks_ahead = true;
            v = judged();
        }
        if (is_kind(sys_, j, SurfaceKind::kink) && v.finite) {
            // The field is continuous: both sides' departures are the same, and where there is none
            // the solution goes on along the kink, on either side. What was met has been crossed.
            const int along = (before[j] < 0) == (guard < 0) ? -1 : +1;
            v.unique = true;
            v.mode.set(j, v.below.sign != 0 ? v.below.sign : along);
            v.starts = starts_at(v, v.mode, j);
        }
        return v;
    }
    /// Which s_j ended a slide. (Where a slide along an intersection ends the attraction vanishes,
    /// too, and may be found first.)
    SlideEnd<M> slide_end(const Mode<M>& before, int guard) const {
        if (guard < 0 || guard >= Guard<M>::first_section || before[guard / 3] != 0)
            return {};
        if (guard == Guard<M>::transversal(guard / 3) && segment_.watch().limit(guard / 3) != 0)
            return limit_end(before);
        const S t = segment_.clock().local;
        const bool by_s = guard != Guard<M>::transversal(guard / 3);
        SlideEnd<M> end{before};
        if (const auto set =
                set_valued_slide(sys_, before, t, segment_.x(), p_, segment_.its_layers());
            set.found) { // all that bound it at once
            const auto slid = slid_surfaces(before);
            for (int i = 0; i < slid.n && (by_s || set.margin < S(1e-7)); ++i)
                end.side.set(slid[i], set.met[std::size_t(i)]);
            return end;
        }
        if (by_s) {
            end.side.set(guard / 3, guard == Guard<M>::below(guard / 3) ? -1 : 1);
            return end;
        }
        if (before.sliding() == 1) { // L1 = L2 = 0
            end.parted = 1u << guard / 3;
            return end;
        }
        S least(1e-7);
        for (int j = 0; j < M; ++j) {
            if (before[j] != 0)
                continue;
            const Margin<S> m =
                sliding_margin(sys_, before, j, t, segment_.x(), p_, segment_.its_layers());
            for (const int side : {-1, 1})
                if (const S margin = side < 0 ? m.below : m.above; margin < least) {
                    least = margin;
                    end.side = {};
                    end.side.set(j, side);
                }
        }
        return end;
    }
    /// The surfaces on which a slide that stays at their limits ends: L1 - L2 is there within
    /// rounding of the time, or a millionth of a while, from where it vanishes.
    FILIPPOV_COLD SlideEnd<M> limit_end(const Mode<M>& before) const {
        using std::abs;
        const S t = segment_.clock().local;
        const S ago = S(1e-3) * S(segment_.direction()) * segment_.time_scale();
        const X& x = segment_.x();
        const auto* layers = segment_.its_layers();
        Mode<M> at_ends = before; // whose field is that of the slide, but finite where it has ended
        for (int j = 0; j < M; ++j)
            if (const int end = segment_.watch().limit(j); end != 0)
                at_ends.set(j, end);
        const X then = x - ago * mode_field(sys_, at_ends, t, x, p_, layers);
        SlideEnd<M> end{before};
        for (int j = 0; j < M; ++j) {
            if (segment_.watch().limit(j) == 0)
                continue;
            const auto apart = [&](const S& time, const X& y) {
                return abs(sliding_margin(sys_, before, j, time, y, p_, layers).w);
            };
            const S now = apart(t, x), fallen = abs(apart(S(t - ago), then) - now);
            if (now * abs(ago) <= std::max(S(1e-6) * abs(ago), S(64) * ulp(t)) * fallen)
                end.parted |= 1u << j;
        }
        return end;
    }
    Verdict<M> judge_several(const Mode<M>& before, const SurfaceSet<M>& on, int guard) const {
        if constexpr (single_v<Sys>) {
            return {};
        } else {
            const SlideEnd<M> exit = slide_end(before, guard);
            const Arrival<S> arrival{segment_.direction(), segment_.time_scale()};
            return judged(before, on, segment_.clock().local, segment_.x(), arrival, exit,
                          settings_.on_nonunique);
        }
    }
    Verdict<M> judged(const Mode<M>& before, const SurfaceSet<M>& on, const S& t, const X& x,
                      const Arrival<S>& arrival, const SlideEnd<M>& exit, NonUnique policy) const {
        if constexpr (has_directions_v<Sys>)
            if (any_directed(sys_, on))
                return admissible_at_rest(sys_, before, on, t, x, p_, arrival, exit, policy);
        return admissible(sys_, before, on, t, x, p_, arrival, exit, policy);
    }
    /// True if the mode has a sliding field here.
    bool slides(const Mode<M>& mode, const Layers<Sys, S>* layers) const {
        const S t = segment_.clock().local;
        if constexpr (single_v<Sys>)
            return all_finite<S, 1>(
                Vec<S, 1>(sliding_margin(sys_, mode, 0, t, segment_.x(), p_, layers).s));
        else
            return all_finite<S, N>(mode_field(sys_, mode, t, segment_.x(), p_, layers));
    }

    /// The surfaces at the point where guard g was met in `before`: the one it belongs to, those
    /// slid on, and those met at the same time.
    SurfaceSet<M> surfaces_met(const Mode<M>& before, int g) const {
        SurfaceSet<M> on;
        for (int j = 0; j < M; ++j)
            if (same_direction(j, g / 3) || before[j] == 0 || (M > 1 && met_together(j)))
                on.add(j);
        return whole_directions(on);
    }
    /// True if surface j is here but for rounding of the state and of the time, or a thousandth of
    /// the tolerance: less than that apart two events cannot be told from one.
    bool met_together(int j) const {
        using std::abs;
        const S t = segment_.clock().local;
        const X& x = segment_.x();
        const X f = segment_.field();
        const S rounding = segment_.in_two_fold() || !all_finite<S, N>(f)
                               ? rounding_band(sys_, j, t, x, p_)
                               : rounding_band_along(sys_, j, t, x, p_, f);
        return abs(switching(sys_, t, x, p_)[j]) <=
               rounding + S(1e-3) * change_over(sys_, j, t, x, p_, segment_.scale());
    }

    static std::string_view side_name(int side) {
        if constexpr (M == 1 && HasSides<Sys, S>)
            return side < 0 ? "f1" : "f2";
        return "field";
    }

    /// A guard was met: log it, and decide how to go on.
    Status handle(Stop stop) {
        if (segment_.counters().events >= settings_.max_events)
            return segment_.fail(Status::max_events, "");
        if (const Status status = no_progress(); status != Status::ok)
            return status;
        if (stop.guard >= Guard<M>::first_section) {
            segment_.enter(segment_.mode());
            return handle_section(stop.guard - Guard<M>::first_section);
        }

        const int j = stop.guard / 3;
        const Mode<M> before = segment_.mode();
        alternatives_ = 0;
        if ((stop.touch || stop.jumped) && rests_at(before, stop.guard))
            stop.touch = stop.jumped = false;
        if (stop.touch) {
            contacts_ = slid_surfaces(before);
            if (!contacts_.contains(j))
                contacts_.add(j);
            log(before[j] == 0 ? EventKind::slide_extremum : EventKind::graze, j, before,
                X(segment_.x()));
            segment_.enter(before);
            if (before[j] == 0)
                segment_.watch().go_on_sliding(stop.guard);
            else
                segment_.watch().start_root(stop.guard, 2);
            return crossed_sections();
        }
        contacts_ = {};
        thrown_ = false;
        const X x_left = segment_.x();
        if (const Status status = change(before, stop); status != Status::ok)
            return status;
        // A hair before s or a surface jumps, but for rounding of the time.
        if ((stop.jumped || stop.left_behind) && !thrown_ && segment_.mode() == before)
            return crossed_sections();
        if (!thrown_) {
            const Mode<M>& after = segment_.mode();
            const int named = first_change(before, after, j);
            const bool comes_to_rest = after.holds_rate(named) && !before.holds_rate(named);
            log(comes_to_rest ? EventKind::enter_sliding : kind_of(before[named], after[named]),
                named, before, x_left);
            if (before == after && before[j] == 0)
                segment_.watch().go_on_sliding(stop.guard);
            if (before.holds_rate(j) && after[j] != 0)
                depart_from_second_order(j);
        }
        if (const Status status = crossed_sections(); status != Status::ok || ends_here())
            return status;
        return watch_for_limit(j, !thrown_ && before[j] != 0 && before == segment_.mode());
    }

    /// True if what was touched from outside, or passed in a step that saw no zero, is a surface at
    /// which the field ends like a root: then it is met. The state is put on it.
    FILIPPOV_COLD bool rests_at(const Mode<M>& before, int guard) {
        const int j = guard / 3;
        if constexpr (may_have_layers_v<Sys, S>)
            if (before[j] != 0 && segment_.is_root_near(j, S(before[j]))) {
                segment_.put_on_layers();
                return true;
            }
        return false;
    }
    /// Judges how the solution goes on from where the mode ended.
    Status change(const Mode<M>& before, const Stop& stop) {
        const int j = stop.guard / 3;
        if (stop.left_behind)
            return leave_behind(before, j);
        return stop.jumped && !is_at_edge(before, j) ? pass_jump_of_h(before, j, -before[j])
                                                     : meet(before, stop.guard);
    }
    /// True if the state is on surface j, for all that h seems to have jumped, and the field beyond
    /// ends there: no step is long enough to see h = 0.
    bool is_at_edge(const Mode<M>& before, int j) const {
        if constexpr (slides_twice_v<Sys>) {
            Mode<M> beyond = before;
            beyond.set(j, -before[j]);
            const X& x = segment_.x();
            return before[j] != 0 && judged_at(j) != x &&
                   !all_finite<S, N>(side_field(sys_, beyond, segment_.clock().local, x, p_));
        }
        return false;
    }
    Status meet(const Mode<M>& before, int guard) {
        const SurfaceSet<M> on = surfaces_met(before, guard);
        if (on.n > 1)
            if (const Status status = settle(before, on); status != Status::ok)
                return status;
        return go_on(before, on, guard);
    }
    /// Lets the state jump if one of the surfaces here throws it, and judges what goes on.
    Status go_on(const Mode<M>& before, const SurfaceSet<M>& on, int guard) {
        if constexpr (has_jumps_v<Sys>)
            if (const int j = throws(guard < 0 ? beside_walls(before, on) : before, on); j >= 0)
                return jump(before, j, on.contains(j));
        return on.n > 0 ? judge(before, on, guard) : Status::ok;
    }

    // --- jumps of the state --------------------------------------------------------------------

    /// The mode that would go on from here without the surfaces that have jumps: what it leads
    /// against throws the state. (Of a state that was put here no field says where it came from.)
    Mode<M> beside_walls(const Mode<M>& mode, const SurfaceSet<M>& on) const {
        SurfaceSet<M> others;
        for (const int k : on)
            if (!is_kind(sys_, k, SurfaceKind::jump))
                others.add(k);
        if (others.n == 0 || others.n == on.n)
            return mode;
        const Verdict<M> v =
            others.n == 1 ? judge_one(mode, others[0], -1) : judge_several(mode, others, -1);
        return v.finite && v.unique ? v.mode : mode;
    }
    /// A surface with jumps against which the state moves, or beyond which it is; -1: none.
    int throws(const Mode<M>& mode, const SurfaceSet<M>& contacts) const {
        const S t = segment_.clock().local;
        const X& x = segment_.x();
        for (int j = 0; j < M; ++j) {
            if (!is_kind(sys_, j, SurfaceKind::jump) || mode[j] == 0)
                continue;
            if (contacts.contains(j) ? is_thrown(sys_, mode, j, t, x, p_, segment_.direction())
                                     : mode[j] < 0)
                return j;
        }
        return -1;
    }
    /// Jumps at surface j, and again while the state lands where it is thrown on.
    /// @param met  it is on the surface but for rounding of h, not somewhere beyond
    Status jump(const Mode<M>& before, int j, bool met) {
        if (segment_.direction() < 0)
            return segment_.fail(
                Status::ambiguous,
                "jumps are not undone backwards in time, whatever on_nonunique says", j);
        const Clock<S>& now = segment_.clock();
        if (!(now.index == jump_clock_.index && now.local == jump_clock_.local))
            jumps_here_ = 0;
        jump_clock_ = now;
        Mode<M> left = before;
        for (;;) {
            if (++jumps_here_ > most_jumps)
                return segment_.fail(Status::jump_cascade, "", j);
            const X x_left = segment_.x();
            const X x = sys_.jump(j, now.local, x_left, p_);
            if (!all_finite<S, N>(x))
                return segment_.fail(Status::not_finite, "jump", j);
            if (x == x_left)
                return segment_.fail(Status::jump_cascade, "the jump here changes nothing", j);
            const S rounding = met ? switching(sys_, now.local, x_left, p_)[j] : S(0);
            segment_.set_state(x);
            const auto [mode, contacts] = place(j, rounding);
            recent_.add(now, j, x, mode, true);
            if (mode[j] < 0) {
                segment_.set_state(x_left);
                return segment_.fail(Status::escaped, "the jump leads beyond its surface", j);
            }
            contacts_ = contacts;
            if (observer_.jump)
                observer_.jump(now, left, j, mode);
            const int next = throws(beside_walls(mode, contacts), contacts);
            segment_.enter(mode);
            if (next < 0 && contacts.n > 0) {
                // Bounces too low for the rounding of h still take their time.
                const bool lost =
                    normal_motion(sys_, mode, j, now.local, x, p_, segment_.direction()) == 0 &&
                    free_rates(sys_, mode, j, now.local, x, p_)[0] > S(0);
                if (const auto rest = lost ? rest_of_lost_bounces(mode, contacts, j) : std::nullopt;
                    rest && rest->holds) {
                    log(EventKind::jump, j, left, x_left);
                    thrown_ = true;
                    return leap(*rest);
                }
                if (const Status status = settle(mode, contacts); status != Status::ok)
                    return status;
                if (const Status status = judge(mode, contacts, -1); status != Status::ok)
                    return status;
            }
            log(EventKind::jump, j, left, x_left);
            thrown_ = true;
            if (next < 0)
                return Status::ok;
            left = mode;
            j = next;
            met = contacts.contains(j);
        }
    }
    static constexpr int most_jumps = 100; ///< at one time

    // --- accumulation --------------------------------------------------------------------------

    /// Where events follow each other ever faster, goes on from their limit if there the solution
    /// is held by all their surfaces.
    /// @param came_back  to a surface, and leaves it on the side that it came from: what that means
    ///                   beside a slide of second order no step can tell
    Status watch_for_limit(int j, [[maybe_unused]] bool came_back) {
        if (!thrown_)
            recent_.add(segment_.clock(), j, segment_.x(), segment_.mode(), false);
        if (const S gap = recent_.gap(); gap > S(0))
            segment_.expect_event_after(gap);
        if constexpr (slides_twice_v<Sys>)
            if (came_back)
                if (const auto rest = rest_after_low_turn())
                    return leap(*rest);
        if (!recent_.hurry())
            return Status::ok;
        auto rest = rest_ahead(false);
        if constexpr (slides_twice_v<Sys>)
            if (rest ? !rest->holds : n_same_ > 4)
                if (const auto low = rest_after_low_turn())
                    rest = low;
        if (!rest || rest->held == segment_.mode()) // the last of them has ended there already
            return Status::ok;
        return rest->holds ? leap(*rest)
                           : segment_.fail(Status::accumulation, "no mode holds the solution there",
                                           rest->on[0]);
    }
    /// Where events accumulate and the solution is held by all their surfaces.
    struct Rest {
        S after{}; ///< time from now
        X x{};
        SurfaceSet<M> on{};
        Mode<M> held{};
        bool holds = true; ///< false: nothing does, and the events cannot be told apart any more
    };
    /// The rest in which the last events end, if they have one.
    /// @param lost  what comes next is lower than rounding of h can tell
    FILIPPOV_COLD std::optional<Rest> rest_ahead(bool lost) {
        const auto field_of = [&](const Mode<M>& mode, const S& after) {
            const S t = segment_.clock().local + S(segment_.direction()) * after;
            return mode_field(sys_, mode, t, segment_.x(), p_, segment_.its_layers());
        };
        const X field = field_of(segment_.mode(), S(0));
        const X lengths = segment_.scale() / mean_weight<Sys, S>(sys_);
        const auto limit = recent_.limit(lengths, field_of, segment_.direction(), lost);
        if (!limit)
            return std::nullopt;
        Rest rest;
        rest.after = S(segment_.direction()) * limit->after;
        if (!segment_.reaches(rest.after))
            return std::nullopt;
        rest.on = with_directions(recent_.surfaces(limit->pattern));
        const S t = segment_.clock().local + rest.after;
        hold_with(rest.on, t, limit->x);
        rest.held = segment_.mode();
        for (const int k : rest.on)
            rest.held.set(k, 0);
        const auto is_held = [&](const Constraints<Sys>& all) {
            const auto holding = independent_part(sys_, all, t, limit->x, p_, segment_.scale());
            rest.x = project(sys_, holding, t, limit->x, p_, segment_.scale());
            return near(rest.x, limit->x, field, lost) && keeps_sides(rest.held, t, rest.x) &&
                   (holding.size() == all.size() ||
                    lies_on(sys_, all, t, rest.x, p_, segment_.scale()));
        };
        if (!is_held(Constraints<Sys>(sys_, rest.held)))
            return std::nullopt;
        rest.holds = holds(rest.held, t, rest.x);
        if constexpr (slides_twice_v<Sys>)
            if (Mode<M> twice = rest.held; !rest.holds) {
                twice.hold_rate(0);
                const X once = rest.x;
                rest.holds =
                    is_held(Constraints<Sys>(sys_, twice)) &&
                    may_slide_to_second_order(sys_, 0, t, rest.x, p_,
                                              S(segment_.direction()) * segment_.time_scale());
                (rest.holds ? rest.held : twice) = twice;
                if (!rest.holds)
                    rest.x = once;
            }
        // what cannot be told apart any more cannot be followed either
        const bool unresolved = limit->after <= S(64) * ulp(segment_.clock().local);
        return rest.holds || unresolved ? std::optional(rest) : std::nullopt;
    }
    /// Where a last turn about a slide of second order ends, if it is lower than the tolerance.
    FILIPPOV_COLD std::optional<Rest> rest_after_low_turn() const {
        const auto turn = segment_.low_turn();
        if (!turn)
            return std::nullopt;
        Rest rest{.after = turn->after, .x = turn->x};
        rest.on.add(0);
        rest.held.hold_rate(0);
        return rest;
    }
    /// The rest where bounces on surface j are lost, if the others here go on as they do without
    /// it.
    FILIPPOV_COLD std::optional<Rest> rest_of_lost_bounces(const Mode<M>& mode,
                                                           const SurfaceSet<M>& contacts, int j) {
        SurfaceSet<M> others;
        for (const int k : contacts)
            if (k != j)
                others.add(k);
        if (others.n > 0 && judge(mode, others, -1) != Status::ok)
            return std::nullopt;
        return rest_ahead(true);
    }
    FILIPPOV_COLD Status leap(const Rest& rest) {
        if (ends_here())
            return Status::ok;
        const Mode<M> before = segment_.mode();
        const X x_left = segment_.x();
        segment_.leap(rest.after, rest.x);
        if (observer_.limit)
            observer_.limit(segment_.clock(), rest.held);
        segment_.enter(rest.held);
        contacts_ = rest.on;
        alternatives_ = 0;
        log(EventKind::accumulation, rest.on[0], before, x_left);
        recent_.clear();
        return crossed_sections();
    }
    /// These surfaces, and of directions all components.
    SurfaceSet<M> with_directions(const SurfaceSet<M>& on) const {
        if constexpr (!has_directions_v<Sys>)
            return on;
        SurfaceSet<M> all;
        for (int k = 0; k < M; ++k)
            if (on.contains(is_directed(sys_, k) ? direction_begin(sys_, k) : k))
                all.add(k);
        return all;
    }
    /// Adds the surfaces with jumps that the state is on as well: what bounces beside others.
    void hold_with(SurfaceSet<M>& on, const S& t, const X& x) const {
        using std::abs;
        SurfaceSet<M> all;
        for (int k = 0; k < M; ++k) {
            const S band =
                rounding_band(sys_, k, t, x, p_) + change_over(sys_, k, t, x, p_, segment_.scale());
            if (on.contains(k) ||
                (is_kind(sys_, k, SurfaceKind::jump) && abs(switching(sys_, t, x, p_)[k]) <= band))
                all.add(k);
        }
        on = all;
    }
    /// True if two states differ by some tolerances at most, or by what the field does in a time
    /// that cannot be resolved, or, of events that are `lost`, by a tenth of what these would do.
    bool near(const X& a, const X& b, const X& field, bool lost) const {
        using std::abs;
        const S unresolved = S(1024) * ulp(segment_.clock().local), part(lost ? 0.1 : 0);
        for (int i = 0; i < N; ++i)
            if (!(abs(a[i] - b[i]) <= S(10) * segment_.scale()[i] + unresolved * abs(field[i]) +
                                          part * abs(b[i] - segment_.x()[i])))
                return false;
        return true;
    }
    /// True if no surface that does not hold the state has been passed.
    bool keeps_sides(const Mode<M>& held, const S& t, const X& x) const {
        const Vec<S, M> h = switching(sys_, t, x, p_);
        for (int k = 0; k < M; ++k)
            if (held[k] != 0 && !is_directed(sys_, k) && h[k] * S(held[k]) < S(0))
                return false;
        return true;
    }
    /// True if at (t, x) the mode `held` is the only one that goes on.
    bool holds(const Mode<M>& held, const S& t, const X& x) const {
        const Arrival<S> arrival{segment_.direction(), segment_.time_scale()};
        const SurfaceSet<M> on = slid_surfaces(held);
        if constexpr (single_v<Sys>) {
            const auto v = admissible(sys_, held, 0, t, x, p_, arrival, NonUnique::stop);
            return v.unique && v.mode == held;
        } else {
            const auto v = judged(held, on, t, x, arrival, SlideEnd<M>{}, NonUnique::stop);
            return v.unique && v.mode == held;
        }
    }
    /// Surface j, which was slid on, has jumped away from the state.
    Status leave_behind(const Mode<M>& before, int j) {
        using std::abs;
        const S t = segment_.clock().local;
        const X& x = segment_.x();
        const S h = switching(sys_, t, x, p_)[j];
        if (abs(h) <= slide_band(sys_, j, t, x, p_, segment_.scale()))
            return Status::ok; // it is about to
        if (is_kind(sys_, j, SurfaceKind::jump) && h < S(0))
            return segment_.fail(Status::escaped, "the surface jumps across the state", j);
        return pass_jump_of_h(before, j, h < S(0) ? -1 : 1);
    }
    /// h_j jumped: the state is on this side now, whatever leads where. What was slid on meanwhile
    /// is judged again.
    Status pass_jump_of_h(const Mode<M>& before, int j, int side) {
        Mode<M> after = before;
        for (int k = 0; k < M; ++k)
            if (same_direction(k, j)) // what has left rest moves, whatever its side
                after.set(k, is_directed(sys_, k) && side != 0 ? +1 : side);
        // others may have jumped across the state at the same time
        after = mode_beside(sys_, after, {{j}, 1}, segment_.clock().local, segment_.x(), p_);
        const SurfaceSet<M> on = slid_surfaces(after);
        if constexpr (has_jumps_v<Sys>)
            if (is_kind(sys_, j, SurfaceKind::jump) && side < 0)
                return jump(before, j, false);
        if (on.n > 0)
            return judge(after, on, -1);
        segment_.enter(after);
        return Status::ok;
    }

    Status handle_section(int q) {
        const Mode<M> mode = segment_.mode();
        const int side = segment_.watch().section_side(q);
        const bool wanted = sections_.direction(q) == 0 || sections_.direction(q) * side < 0;
        segment_.watch().passed_section(q);
        // Met twice within the resolution of time (with a surface at the same time) is met once.
        // Sections see the absolute time.
        const Clock<S>& now = segment_.clock();
        using std::abs;
        const S moment = S(8) * std::max(ulp(now.local), ulp(now.absolute()));
        const bool again =
            met_[std::size_t(q)] && abs(met_at_[std::size_t(q)].until(now)) <= moment;
        met_[std::size_t(q)] = true;
        met_at_[std::size_t(q)] = now;
        if (!wanted || again)
            return Status::ok;
        log(EventKind::section, q, mode, X(segment_.x()));
        return sections_.terminal(q) ? Status::event : Status::ok;
    }

    /// Sections whose sign has changed at the event point belong to the same time.
    Status crossed_sections() {
        Status status = Status::ok;
        for (int q = 0; q < sections_.size(); ++q) {
            const int side = segment_.watch().section_side(q);
            const int now = detail::sign(segment_.watch().section_value(q));
            if (now == side || side == 0)
                continue;
            if (const Status s = handle_section(q); status == Status::ok)
                status = s;
        }
        return status;
    }

    /// The surface that names an event met on j: the first that is reached, else the first whose
    /// slide ends, a kink after all others, or j. (Where another surface is crossed a slide may end
    /// as well.)
    int first_change(const Mode<M>& before, const Mode<M>& after, int j) const {
        for (const bool kink : {false, true})
            for (const bool reached : {true, false})
                for (int k = 0; k < M; ++k)
                    if (before[k] != after[k] && (before[k] != 0) == reached &&
                        is_kind(sys_, k, SurfaceKind::kink) == kink)
                        return k;
        return j;
    }

    /// A mode that cannot be settled must not go round for ever at one time.
    Status no_progress() {
        const Clock<S>& now = segment_.clock();
        using std::abs;
        const bool same = abs(last_clock_.until(now)) <= S(8) * ulp(now.local);
        n_same_ = same ? n_same_ + 1 : 0;
        last_clock_ = now;
        return n_same_ > 16 + sections_.size()
                   ? segment_.fail(Status::step_too_small, "events repeat without progress of time")
                   : Status::ok;
    }

    Event<S, N, M> make_event(EventKind kind, int surface, const Mode<M>& before,
                              const Mode<M>& after) const {
        Event<S, N, M> e;
        const Clock<S>& c = segment_.clock();
        e.t = c.absolute();
        e.period = c.index;
        e.t_local = c.local;
        e.kind = kind;
        e.surface = surface;
        e.mode_before = before;
        e.mode_after = after;
        e.x_left = e.x_right = segment_.x();
        e.s = blend_variable(kind, surface, after);
        const bool contact = kind != EventKind::section && surface >= 0;
        for (const int j : contact ? contacts_ : slid_surfaces(after))
            e.contacts |= 1u << j;
        e.alternatives = contact ? alternatives_ : 0;
        if constexpr (M > 1)
            e.s_unique =
                !set_valued_slide(sys_, after, c.local, segment_.x(), p_, segment_.its_layers())
                     .found;
        return e;
    }

    /// s of (4.12) wherever the event is on a surface, the side's -1 or +1 elsewhere.
    S blend_variable(EventKind kind, int surface, Mode<M> mode) const {
        int j = sliding_surface(mode);
        const bool contact = kind != EventKind::section && surface >= 0;
        if (j < 0 && !contact)
            return M == 1 ? S(mode[0]) : std::numeric_limits<S>::quiet_NaN();
        if (contact)
            j = surface;
        if (segment_.layers().has(j)) // nothing of the field is left to blend there
            return std::numeric_limits<S>::quiet_NaN();
        if (is_kind(sys_, j, SurfaceKind::jump)) // free; in contact there is a force and no s
            return mode[j] != 0 ? S(1) : std::numeric_limits<S>::quiet_NaN();
        for (int k = 0; k < M; ++k)
            if (same_direction(k, j) && mode[k] != 0)
                mode.set(k, 0);
        const S s = sliding_margin(sys_, mode, j, segment_.clock().local, segment_.x(), p_).s;
        // Where L1 = L2 to rounding the field does not jump across the surface, and there is no s.
        using std::abs;
        return abs(s) < S(1e-3) / epsilon<S> ? s : std::numeric_limits<S>::quiet_NaN();
    }

    /// Logs an event. It is held back until time moves on: two changes of mode at one time are one
    /// (a slide or a slip that lasts no time is not in the log).
    void log(EventKind kind, int surface, const Mode<M>& before, const X& x_left) {
        ++segment_.counters().events;
        Event<S, N, M> e = make_event(kind, surface, before, segment_.mode());
        e.x_left = x_left;
        const bool changes = kind == EventKind::cross || kind == EventKind::enter_sliding ||
                             kind == EventKind::exit_sliding;
        if (pending_ && changes && pending_changes_ && (M > 1 || held_.surface == e.surface) &&
            held_.period == e.period && held_.t_local == e.t_local) {
            e.mode_before = held_.mode_before;
            e.x_left = held_.x_left;
            e.contacts |= held_.contacts;
            e.alternatives = std::max(e.alternatives, held_.alternatives);
            e.surface = first_change(e.mode_before, e.mode_after, surface);
            e.kind = kind_of(e.mode_before[e.surface], e.mode_after[e.surface]);
            --segment_.counters().events;
            pending_changes_ = e.mode_before != e.mode_after;
            held_ = e;
            asked_ = false;
            return;
        }
        flush();
        held_ = e;
        pending_ = true;
        asked_ = false;
        pending_changes_ = changes;
    }
    /// True if the observer ends the run at an event that was logged since it was asked last.
    bool ends_here() {
        if (pending_ && !asked_ && observer_.ends)
            over_ = observer_.ends(held_) || over_;
        asked_ = true;
        return over_;
    }
    void flush() {
        ends_here();
        if (pending_)
            tell(held_);
        pending_ = false;
    }
    void tell(const Event<S, N, M>& event) const {
        if (observer_.event)
            observer_.event(event);
    }

    const Sys& sys_;
    const P& p_;
    const Settings<S, N>& settings_;
    const Observer<S, N, M>& observer_;
    const Watched& sections_;
    const KnownStart<M> known_start_;
    Segment<Sys, S> segment_;
    Event<S, N, M> held_{};
    bool pending_ = false, pending_changes_ = false;
    bool asked_ = true; ///< the observer, whether the run ends at the event that is held back
    bool over_ = false; ///< it does
    std::array<bool, Watched::capacity> met_{}; ///< sections that were met, and when last
    std::array<Clock<S>, Watched::capacity> met_at_{};
    SurfaceSet<M> contacts_{}; ///< that the last event was on
    int alternatives_ = 0;     ///< among which a policy chose there
    RecentEvents<S, N, M> recent_{};
    X start_x_{};
    bool thrown_ = false; ///< the state jumped at the last event
    Clock<S> jump_clock_{};
    int jumps_here_ = 0;     ///< at one time
    int start_surface_ = -1; ///< the surface on which the run starts, -1 if none
    Clock<S> last_clock_{};
    int n_same_ = 0;
};

/// `flow` by the steps of any method: compiled once for all of them.
template <class Sys, std::floating_point S, class Sec>
FILIPPOV_INLINE FlowResult<S, dim_v<Sys>, surfaces_v<Sys>>
flow_by(Steps<Sys, S>& steps, const Sys& sys, const GivenParams<Sys, S>& params,
        const Vec<S, dim_v<Sys>>& x0, std::type_identity_t<S> t0, std::type_identity_t<S> t_end,
        const Settings<S, dim_v<Sys>>& settings, const ObserverOf<Sys, S>& observer,
        const Sec& watched, const KnownStart<surfaces_v<Sys>>& known_start = {}) {
    const Params<Sys, S> p = params.of(sys);
    validate(settings);
    validate_start(x0, t0, t_end, p, given_params(sys));
    validate_known_start(sys, known_start);
    validate_sections(watched);
    if (observer.begin)
        observer.begin(t0, t_end);
    const AnySections<S, dim_v<Sys>, params_v<Sys>> sections(watched);
    return Flow<Sys, S>(sys, p, t0, x0, t_end, settings, observer, sections, known_start, steps)
        .run();
}

} // namespace detail

/// Follows the Filippov solution from x0 at t0 to t_end (backwards if t_end < t0).
///
/// @param params    shape (n_params,); `{}`: the defaults
/// @param x0        start, shape (dim,)
/// @param observer  what to hear of the run: `{}`, one of Observer, EventLog, OutputTimes
/// @param watched   user sections, 16 at most, see event.hpp
/// @param known_start   the event at which the run starts, if that is known
/// @return          status, last state, counters
/// @error           std::invalid_argument for a start, span or settings that make no sense; all
///                  else is a Status
template <class Tableau = DormandPrince5, class Sys, std::floating_point S, class Sec = Sections<>>
FlowResult<S, dim_v<Sys>, surfaces_v<Sys>>
flow(const Sys& sys, const GivenParams<Sys, S>& params, const Vec<S, dim_v<Sys>>& x0,
     std::type_identity_t<S> t0, std::type_identity_t<S> t_end,
     const Settings<S, dim_v<Sys>>& settings = {}, const ObserverOf<Sys, S>& observer = {},
     const Sec& watched = {}, const KnownStart<surfaces_v<Sys>>& known_start = {}) {
    require_system<Sys>();
    StepsOf<Tableau, Sys, S> steps;
    return detail::flow_by<Sys, S>(steps, sys, params, x0, t0, t_end, settings, observer, watched,
                                   known_start);
}

} // namespace filippov
