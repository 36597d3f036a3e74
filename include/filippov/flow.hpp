// SPDX-License-Identifier: BSD-3-Clause
// The event loop: judges every contact and chains segments.
#pragma once

#include <filippov/dormand_prince5.hpp>
#include <filippov/dormand_prince8.hpp>
#include <filippov/segment.hpp>

#include <string>

namespace filippov {

/// How a run ended.
template <class S, int N, int M> struct FlowResult {
    Status status = Status::ok;
    S t{};            ///< absolute time of the last good state
    Clock<S> clock{}; ///< the same as (period index, local time)
    Vec<S, N> x{};    ///< last good state
    Mode<M> mode{};   ///< mode there
    Counters counters{};
    Diagnosis<S, N, M> diagnosis{}; ///< where and why, if status is not ok

    /// What happened, in a sentence or two.
    std::string message() const {
        std::string text(filippov::message(status));
        if (status == Status::ok || status == Status::event)
            return text;
        char at[64];
        std::snprintf(at, sizeof at, " At t = %.15Lg", static_cast<long double>(diagnosis.t));
        text += at;
        text += ", x = (";
        for (int i = 0; i < N; ++i) {
            std::snprintf(at, sizeof at, i == 0 ? "%.9Lg" : ", %.9Lg",
                          static_cast<long double>(diagnosis.x[i]));
            text += at;
        }
        text += "), mode (";
        for (int j = 0; j < M; ++j) {
            if (j > 0)
                text += ", ";
            text += std::to_string(diagnosis.mode[j]);
        }
        text += ")";
        if (diagnosis.surface >= 0) {
            text += ", surface ";
            text += std::to_string(diagnosis.surface);
        }
        if (!diagnosis.what.empty()) {
            text += ": ";
            text += diagnosis.what;
        }
        text += ".";
        return text;
    }
};

/// A start at an event that is known already: the end of a slide, say, where an iterate of a map
/// begins. `guard` counts as met in mode `before`, and the engine judges how the solution goes on.
template <int M> struct KnownStart {
    Mode<M> before{};
    int guard = -1; ///< see Guard; -1: nothing is known of the start
};

namespace detail {

/// The loop of `flow`, with its bookkeeping of events.
template <class Sys, class S, class Tableau, class Obs, class Sec> class Flow {
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using P = Params<Sys, S>;

public:
    Flow(const Sys& sys, const P& p, const S& t0, const X& x0, const S& t_end,
         const Settings<S, N>& settings, Obs& observer, const Sec& sections,
         const KnownStart<M>& known_start)
        : sys_(sys), p_(p), settings_(settings), observer_(observer), sections_(sections),
          known_start_(known_start), segment_(sys, p, t0, x0, t_end, settings, observer, sections) {
    }

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
            if constexpr (requires { observer_.ends_at(held_); })
                if (status == Status::ok && pending_ && observer_.ends_at(held_))
                    status = Status::event;
            segment_.let_observer_skip();
        }
        flush();
        Event<S, N, M> end = make_event(EventKind::end, -1, segment_.mode(), segment_.mode());
        observer_.on_event(end);
        FlowResult<S, N, M> result;
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
        Mode<M> mode;
        int contact = -1, n_contacts = 0;
        for (int j = 0; j < M; ++j) {
            mode.set(j, h[j] < S(0) ? -1 : 1);
            using std::abs;
            if (abs(h[j]) <= start_band(sys_, j, t, segment_.x(), p_, X(settings_.atol))) {
                contact = start_surface_ = j;
                ++n_contacts;
            }
        }
        segment_.enter(mode);
        if (n_contacts == 0) {
            segment_.choose_first_step();
        } else if (n_contacts > 1) {
            return segment_.fail(Status::ambiguous, "starts on several surfaces at once");
        } else {
            if (!(grad_h(sys_, contact, t, segment_.x(), p_).cwiseAbs().maxCoeff() > S(0)))
                return segment_.fail(Status::degenerate_surface, "grad h", contact);
            segment_.set_state(project(sys_, contact, t, segment_.x(), p_, segment_.scale()));
            segment_.enter(mode);
            segment_.choose_first_step();
            if (const Status status = judge(mode, contact, -1); status != Status::ok)
                return status;
        }
        return Status::ok;
    }

    Status start_as_known() {
        const int j = start_surface_ = known_start_.guard / 3;
        const S t = segment_.clock().local;
        segment_.set_state(project(sys_, j, t, segment_.x(), p_, segment_.scale()));
        segment_.enter(known_start_.before);
        segment_.choose_first_step();
        return judge(known_start_.before, j, known_start_.guard);
    }

    /// The first event, also of a run that could not start; a section that is zero here is met
    /// here, once, and does not end the run.
    void log_start(Status status) {
        observer_.on_event(
            make_event(EventKind::start, start_surface_, segment_.mode(), segment_.mode()));
        if (status != Status::ok)
            return;
        for (int q = 0; q < sections_.size(); ++q) {
            if (segment_.section_value(q) == S(0))
                log(EventKind::section, q, segment_.mode(), X(segment_.x()));
            segment_.start_section(q);
        }
    }

    /// Judges the point on surface j and enters the mode that goes on from there.
    /// @param guard  the one that was met there, -1 at the start
    Status judge(const Mode<M>& before, int j, int guard) {
        const S t = segment_.clock().local;
        for (int k = 0; k < M; ++k)
            if (k != j && before[k] == 0)
                return segment_.fail(Status::ambiguous, "an intersection of surfaces", j);
        Arrival<S> arrival{segment_.direction(), segment_.time_scale()};
        if (guard >= 0)
            arrival.from = before[j];
        // A slide ends where L1 or L2 vanishes, or both: the landing says so better than rounding.
        // (With static friction it ends elsewhere.)
        if (guard >= 0 && before[j] == 0 && !(s_max(sys_, p_) > S(1))) {
            arrival.below_tangent = guard != Guard<M>::above(j);
            arrival.above_tangent = guard != Guard<M>::below(j);
        }
        const Verdict<M> v =
            admissible(sys_, before, j, t, segment_.x(), p_, arrival, settings_.on_nonunique);
        if (!v.finite)
            return segment_.fail(Status::not_finite, v.below.finite ? side_name(+1) : side_name(-1),
                                 j);
        if (!v.unique && settings_.on_nonunique == NonUnique::stop)
            return segment_.fail(Status::ambiguous, v.reason, j);
        if (v.mode[j] == 0) {
            if (!all_finite<S, 1>(Vec<S, 1>(sliding_margin(sys_, v.mode, t, segment_.x(), p_).s)))
                return segment_.fail(Status::ambiguous, "L1 = L2: no sliding field", j);
        }
        segment_.enter(v.mode);
        if (v.mode[j] != 0) {
            segment_.start_root(Guard<M>::below(j),
                                std::max(1, v.mode[j] < 0 ? v.below.order : v.above.order));
        } else {
            if (v.below.order > 1)
                segment_.start_root(Guard<M>::below(j), v.below.order - 1);
            if (v.above.order > 1)
                segment_.start_root(Guard<M>::above(j), v.above.order - 1);
        }
        return Status::ok;
    }

    static std::string_view side_name(int side) {
        if constexpr (M == 1 && HasSides<Sys, S>)
            return side < 0 ? "f1" : "f2";
        return "field";
    }

    /// A guard was met: log it, and decide how to go on.
    Status handle(const Stop& stop) {
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
        if (stop.touch) {
            log(before[j] == 0 ? EventKind::slide_extremum : EventKind::graze, j, before,
                X(segment_.x()));
            segment_.enter(before);
            segment_.start_root(stop.guard, 2);
            return crossed_sections();
        }
        if (stop.jumped) {
            Mode<M> after = before;
            after.set(j, -before[j]);
            segment_.enter(after);
        } else if (const Status status = judge(before, j, stop.guard); status != Status::ok) {
            return status;
        }
        const Mode<M>& after = segment_.mode();
        log(kind_of(before[j], after[j]), j, before, X(segment_.x()));
        if (before[j] == 0 && after[j] == 0)
            segment_.start_root(stop.guard, 2);
        return crossed_sections();
    }

    Status handle_section(int q) {
        const Mode<M> mode = segment_.mode();
        const int side = segment_.section_side(q);
        const bool wanted = sections_.direction(q) == 0 || sections_.direction(q) * side < 0;
        segment_.passed_section(q);
        // Met twice within the resolution of time (with a surface at the same time) is met once.
        const Clock<S>& now = segment_.clock();
        using std::abs;
        const bool again = met_[std::size_t(q)] &&
                           abs(met_at_[std::size_t(q)].until(now)) <= S(8) * ulp(now.local);
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
            const int side = segment_.section_side(q);
            const int now = detail::sign(segment_.section_value(q));
            if (now == side || side == 0)
                continue;
            if (const Status s = handle_section(q); status == Status::ok)
                status = s;
        }
        return status;
    }

    static EventKind kind_of(int before, int after) {
        if (before == 0)
            return after == 0 ? EventKind::slide_extremum : EventKind::exit_sliding;
        if (after == 0)
            return EventKind::enter_sliding;
        return before == after ? EventKind::graze : EventKind::cross;
    }

    /// A mode that cannot be settled must not go round for ever at one time.
    Status no_progress() {
        const Clock<S>& now = segment_.clock();
        const bool same = now.index == last_clock_.index && now.local == last_clock_.local;
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
        for (int k = 0; k < M; ++k)
            if (k != j && mode[k] == 0)
                return std::numeric_limits<S>::quiet_NaN();
        mode.set(j, 0);
        const S s = sliding_margin(sys_, mode, segment_.clock().local, segment_.x(), p_).s;
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
        if (pending_ && changes && pending_changes_ && held_.surface == e.surface &&
            held_.period == e.period && held_.t_local == e.t_local) {
            e.mode_before = held_.mode_before;
            e.x_left = held_.x_left;
            e.kind = kind_of(e.mode_before[surface], e.mode_after[surface]);
            --segment_.counters().events;
            pending_changes_ = e.mode_before != e.mode_after;
            held_ = e;
            return;
        }
        flush();
        held_ = e;
        pending_ = true;
        pending_changes_ = changes;
    }
    void flush() {
        if (pending_)
            observer_.on_event(held_);
        pending_ = false;
    }

    const Sys& sys_;
    const P& p_;
    const Settings<S, N>& settings_;
    Obs& observer_;
    const Sec& sections_;
    const KnownStart<M> known_start_;
    Segment<Sys, S, Tableau, Obs, Sec> segment_;
    Event<S, N, M> held_{};
    bool pending_ = false, pending_changes_ = false;
    std::array<bool, Sec::capacity + 1> met_{}; ///< sections that were met, and when last
    std::array<Clock<S>, Sec::capacity + 1> met_at_{};
    int start_surface_ = -1; ///< the surface on which the run starts, -1 if none
    Clock<S> last_clock_{};
    int n_same_ = 0;
};

} // namespace detail

/// Follows the Filippov solution from x0 at t0 to t_end (backwards if t_end < t0).
///
/// @param p         parameters, shape (n_params,)
/// @param x0        start, shape (dim,)
/// @param observer  what to keep, see observers.hpp
/// @param watched   user sections, see event.hpp
/// @param known_start   the event at which the run starts, if that is known
/// @return          status, last state, counters
/// @error           std::invalid_argument for a start, span or settings that make no sense; all
///                  else is a Status
template <class Tableau = DormandPrince5, class Sys, std::floating_point S, class Obs,
          class Sec = Sections<>>
FlowResult<S, dim_v<Sys>, surfaces_v<Sys>>
flow(const Sys& sys, const Params<Sys, std::type_identity_t<S>>& p, const Vec<S, dim_v<Sys>>& x0,
     std::type_identity_t<S> t0, std::type_identity_t<S> t_end,
     const Settings<S, dim_v<Sys>>& settings, Obs& observer, const Sec& watched = {},
     const KnownStart<surfaces_v<Sys>>& known_start = {}) {
    require_system<Sys>();
    validate(settings);
    validate_start(x0, t0, t_end, p);
    return detail::Flow<Sys, S, Tableau, Obs, Sec>(sys, p, t0, x0, t_end, settings, observer,
                                                   watched, known_start)
        .run();
}

} // namespace filippov
