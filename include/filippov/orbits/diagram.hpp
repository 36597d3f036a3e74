// SPDX-License-Identifier: BSD-3-Clause
// Brute-force bifurcation diagram: where long runs meet a section, for many parameter values.
#pragma once

#include <filippov/core/parallel.hpp>
#include <filippov/engine/flow.hpp>
#include <filippov/orbits/repeats.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filippov {

/// A set of event kinds.
struct EventKinds {
    std::uint16_t bits = 0;

    EventKinds() = default;
    EventKinds(std::initializer_list<EventKind> kinds) {
        for (const EventKind kind : kinds)
            add(kind);
    }
    void add(EventKind kind) { bits = static_cast<std::uint16_t>(bits | bit(kind)); }
    bool has(EventKind kind) const { return (bits & bit(kind)) != 0; }
    static constexpr unsigned bit(EventKind kind) { return 1u << static_cast<unsigned>(kind); }
};

/// Where a diagram takes its points.
struct DiagramSection {
    EventKinds events{EventKind::exit_sliding}; ///< at events of these kinds
    int surface = -1;    ///< of this surface only (section for kind `section`); -1: of any
    int direction = 0;   ///< +1: only to the side where its h > 0; -1: to the other; 0: to any
    bool strobe = false; ///< instead: once a period, where its index changes
};

/// What a diagram is told.
template <class S, int N> struct DiagramSettings {
    Settings<S, N> run{}; ///< of every run
    DiagramSection section{};
    S transient = S(200);     ///< left out: whole periods, or a time if the system has none; >= 0
    S keep = S(1000);         ///< kept after that, in the same unit; > 0
    bool follow = false;      ///< start each value from the end of the one before it
    int chains = 1;           ///< with `follow`: as many stretches of values that begin at x0; > 0
    bool skip_repeats = true; ///< a run that repeats itself to rounding is not followed further
    Parallel parallel{};
};

/// A point of the diagram.
template <class S, int N> struct DiagramPoint {
    long long period = 0; ///< period index, 0 without a period
    S t_local{};          ///< time since the start of that period; t without a period
    Vec<S, N> x{};
    EventKind kind = EventKind::section; ///< `section` for a strobe
    int surface = -1;
    /// The side that takes part: where an exit or a crossing leads, where an entry or a graze comes
    /// from, the nearer of s = -1 and +1 at a slide's extremum; else the mode.
    int boundary = 0;
};

/// What one parameter value gives.
template <class S, int N> struct DiagramValue {
    Status status = Status::interrupted; ///< `interrupted` also if it was not begun
    std::string message{};               ///< what happened, if status is not ok
    std::vector<DiagramPoint<S, N>> points{};
    S period = S(0);       ///< of the forcing, 0 if there is none
    int cycle = 0;         ///< points after which the run was seen to repeat itself, 0: not seen
    long long skipped = 0; ///< periods that were therefore not followed
    /// State at the end, NaN if there was no run.
    Vec<S, N> x_end = Vec<S, N>::Constant(std::numeric_limits<S>::quiet_NaN());
    Counters counters{};
};

/// Keeps the points of one run that it listens to, or is told of.
template <class S, int N, int M> class DiagramRecorder {
public:
    /// @param period    of the forcing, 0 if there is none
    /// @param transient whole periods, or a time, before which nothing is kept
    /// @param skip      whether to leave out what repeats itself
    DiagramRecorder(const DiagramSection& section, const S& period, const S& transient, bool skip,
                    std::vector<DiagramPoint<S, N>>& points)
        : section_(section), period_(period), transient_(transient), skip_(skip && period > S(0)),
          points_(points), repeats_(period) {}

    /// What is heard of the run, which this must outlive.
    operator Observer<S, N, M>() & {
        Observer<S, N, M> all{.skip = [this](long long left) { return skip(left); }};
        if (section_.strobe)
            all.step = [this](const auto& step, const auto& path) { on_step(step, path); };
        else
            all.event = [this](const auto& event) { hear(event); };
        return all;
    }

    void hear(const Event<S, N, M>& e) {
        if (section_.surface >= 0) {
            at_surface(e, section_.surface);
            return;
        }
        // Several surfaces may change their modes at once: one point, of the first that counts.
        bool taken = at_surface(e, e.surface);
        for (int j = 0; j < M && !taken && is_change(e.kind); ++j)
            taken = j != e.surface && at_surface(e, j);
    }
    /// Where period `index` begins.
    void strobe(long long index, const Vec<S, N>& x, int mode) {
        take({index, S(0), x, EventKind::section, -1, mode}, S(index + shift_) > transient_);
    }
    /// How many of the whole periods left the run need not follow. The repetitions are put in here,
    /// and what comes is later by as much.
    long long skip(long long left) {
        if (cycle_ == 0 || shift_ > 0)
            return 0;
        const long long took = repeats_.periods(cycle_);
        const long long n = left / took;
        for (long long k = 1; k <= n; ++k)
            repeat(k * took);
        return shift_ = n * took;
    }

    /// Points after which the run repeats itself, 0 if it was not seen to.
    int cycle() const { return shift_ > 0 ? cycle_ : 0; }
    long long skipped() const { return shift_; }

private:
    using Point = DiagramPoint<S, N>;

    /// True if the event counts as one of this surface.
    bool at_surface(const Event<S, N, M>& e, int surface) {
        EventKind kind = e.kind;
        if (surface != e.surface) {
            if (!is_change(kind) || surface >= M || e.mode_before[surface] == e.mode_after[surface])
                return false;
            kind = kind_of(e.mode_before[surface], e.mode_after[surface]);
        }
        if (!section_.events.has(kind))
            return false;
        if (section_.direction != 0 &&
            (surface < 0 || surface >= M || e.mode_after[surface] != section_.direction))
            return false;
        const S when = period_ > S(0) ? S(e.period + shift_) : e.t_local;
        take({e.period, e.t_local, e.x_right, kind, surface, boundary(e, kind, surface)},
             when >= transient_);
        return true;
    }
    /// Of a strobe.
    void on_step(const StepView<S, N, M>& step, const StepPath<S, N>& path) {
        if (step.end.index != step.clock.index)
            pass_periods(step, path);
    }

    static int boundary(const Event<S, N, M>& e, EventKind kind, int surface) {
        switch (kind) {
        case EventKind::exit_sliding:
        case EventKind::cross:
            return e.mode_after[surface];
        case EventKind::enter_sliding:
        case EventKind::graze:
            return e.mode_before[surface];
        case EventKind::slide_extremum:
            return e.s < S(0) ? -1 : 1;
        default:
            return M == 1 ? e.mode_after[0] : 0;
        }
    }
    FILIPPOV_COLD void pass_periods(const StepView<S, N, M>& step, const StepPath<S, N>& path) {
        for (long long k = step.clock.index + 1; k <= step.end.index; ++k) {
            const S theta = step.clock.until({period_, k, S(0), S(0)}) / step.dt;
            strobe(k, theta < S(1) ? path(theta) : step.x1, M == 1 ? step.mode[0] : 0);
        }
    }
    void take(Point point, bool kept) {
        // also of a cycle that is known, until it is put in: from the last point on
        if (skip_ && shift_ == 0)
            if (const int found = repeats_.add({point.period, point.t_local, point.x, tag(point)});
                cycle_ == 0)
                cycle_ = found;
        point.period += shift_;
        if (kept)
            points_.push_back(point);
    }
    static int tag(const Point& p) {
        return (static_cast<int>(p.kind) * 64 + p.surface + 1) * 4 + p.boundary + 1;
    }
    /// Puts in the points of the cycle, so many periods later.
    void repeat(long long later) {
        for (int k = cycle_ - 1; k >= 0; --k) {
            const Return<S, N>& r = repeats_.back(k);
            const S when = S(r.period + later);
            if (!(section_.strobe ? when > transient_ : when >= transient_))
                continue;
            const int kind = r.tag / 256, surface = r.tag / 4 % 64 - 1;
            points_.push_back({r.period + later, r.t_local, r.x, static_cast<EventKind>(kind),
                               surface, r.tag % 4 - 1});
        }
    }

    const DiagramSection& section_;
    const S period_, transient_;
    const bool skip_;
    std::vector<Point>& points_;
    Repeats<S, N> repeats_;
    int cycle_ = 0;
    long long shift_ = 0;
};

namespace detail {

/// The end of a run over whole periods. The product may round to just before the end of the last.
template <class S> S end_of_periods(const S& n, const S& period) {
    using std::nextafter;
    S t = n * period;
    for (int k = 0; k < 4 && Clock<S>::at(t, period).index < static_cast<long long>(n); ++k)
        t = nextafter(t, std::numeric_limits<S>::infinity());
    return t;
}

template <class S, int N, int M> void validate(const DiagramSettings<S, N>& d, bool has_period) {
    using std::floor;
    filippov::validate(d.run);
    const S inf = std::numeric_limits<S>::infinity();
    const char* whole = has_period ? " (whole periods)" : " (a time)";
    if (!(d.transient >= S(0) && d.transient < inf) ||
        (has_period && floor(d.transient) != d.transient))
        refuse("transient", d.transient, std::string("expected a number >= 0") + whole);
    if (!(d.keep > S(0) && d.keep < inf) || (has_period && floor(d.keep) != d.keep))
        refuse("keep", d.keep, std::string("expected a number > 0") + whole);
    if (!d.section.strobe && d.section.events.bits == 0)
        refuse("section.events", 0, "expected at least one kind of event, or strobe");
    if (d.section.strobe && !has_period)
        refuse("section.strobe", 1, "expected a system with a period");
    if (!(d.section.direction >= -1 && d.section.direction <= 1))
        refuse("section.direction", d.section.direction, "expected -1, 0 or +1");
    const bool any_index = d.section.strobe || d.section.events.has(EventKind::section);
    if (!(d.section.surface >= -1 && (any_index || d.section.surface < M)))
        refuse("section.surface", d.section.surface, "expected an index, or -1");
    if (!d.section.strobe && d.section.events.has(EventKind::section) && d.section.direction != 0)
        refuse("section.direction", d.section.direction, "expected 0: sections have their own");
    if (has_period && !(d.transient + d.keep < Clock<S>::most_periods))
        refuse("transient + keep", d.transient + d.keep, "expected fewer periods");
    require_positive("chains", d.chains);
}

/// ... and of a start that makes no sense either.
template <class Sys, class S>
void validate(const Sys& sys, const DiagramSettings<S, dim_v<Sys>>& d, const State<Sys, S>& x0) {
    validate<S, dim_v<Sys>, surfaces_v<Sys>>(d, is_forced<S>(sys));
    validate_start(x0, S(0), S(1), Params<Sys, S>(Params<Sys, S>::Constant(S(0))), 0);
}

/// False of parameters that are not finite, or leave no period where there has to be one.
template <class S, class Sys> bool can_begin(const Sys& sys, const Params<Sys, S>& p) {
    S sum(0);
    for (int i = 0; i < params_v<Sys>; ++i)
        sum += p[i] * S(0);
    const S T = filippov::period(sys, p);
    return sum == S(0) && (!is_forced<S>(sys) || (T > S(0) && T * S(0) == S(0)));
}

/// One value of the diagram.
template <class With, class Sys, class S, class Sec>
void follow_value(const With& with_steps, const Sys& sys, const Params<Sys, S>& p,
                  const State<Sys, S>& x0, const DiagramSettings<S, dim_v<Sys>>& d, Worker* worker,
                  const Sec& watched, DiagramValue<S, dim_v<Sys>>& value) {
    constexpr int N = dim_v<Sys>, M = surfaces_v<Sys>;
    const S T = filippov::period(sys, p);
    value.period = T;
    if (!can_begin<S>(sys, p)) {
        value.status = Status::not_finite;
        value.message = "The parameters are not finite, or the period is not a finite number > 0.";
        return;
    }
    const S span = d.transient + d.keep;
    const S t_end = T > S(0) ? end_of_periods(span, T) : span;
    DiagramRecorder<S, N, M> recorder(d.section, T, d.transient, d.skip_repeats, value.points);
    Observer<S, N, M> observer = recorder;
    if (worker != nullptr)
        observer.stop = [worker] { return worker->stopped(); };
    const auto result = with_steps([&](Steps<Sys, S>& steps) {
        return flow_by<Sys, S>(steps, sys, p, x0, S(0), t_end, d.run, observer, watched);
    });
    value.status = result.status;
    if (result.status != Status::ok)
        value.message = result.message();
    value.cycle = recorder.cycle();
    value.skipped = recorder.skipped();
    value.x_end = result.x;
    value.counters = result.counters;
}

/// `bifurcation_diagram` by the steps of any method.
template <class With, class Sys, class S, class Sec>
std::vector<DiagramValue<S, dim_v<Sys>>>
diagram_by(const With& with_steps, const Sys& sys, std::span<const Params<Sys, S>> params,
           const Vec<S, dim_v<Sys>>& x0, const DiagramSettings<S, dim_v<Sys>>& settings,
           const Sec& watched) {
    validate(sys, settings, x0);
    std::vector<DiagramValue<S, dim_v<Sys>>> values(params.size());
    const std::size_t n = params.size();
    const std::size_t items =
        settings.follow ? std::min(n, static_cast<std::size_t>(settings.chains)) : n;
    Parallel how = settings.parallel;
    how.total = n;
    parallel_for(items, how, [&](std::size_t item, Worker& worker) {
        Vec<S, dim_v<Sys>> start = x0;
        for (std::size_t i = item * n / items; i < (item + 1) * n / items; ++i) {
            if (worker.stopped())
                return;
            follow_value(with_steps, sys, params[i], start, settings, &worker, watched, values[i]);
            worker.count();
            if (settings.follow)
                start = values[i].status == Status::ok ? values[i].x_end : x0;
        }
    });
    return values;
}

} // namespace detail

/// Brute-force bifurcation diagram: for each parameter vector the run from x0 at t = 0, and the
/// points in which it meets a section after a transient.
///
/// With `follow` each value starts from the end of the one before it (from x0 again after a value
/// that failed); the values are then cut into `chains` stretches of equal length, each followed in
/// order from x0, and only the stretches run side by side. So a result depends on `chains`, but
/// never on the number of threads.
///
/// @param params   one parameter vector a value, shape (n_values,)
/// @param watched  user sections, for points of kind `section`; called from several threads
/// @return         one entry a value, each with its own status: what fails leaves the rest alone
/// @error          std::invalid_argument for a start or settings that make no sense, before any
///                 work
/// @cost           in the transient no allocation and no storage
/// @source         chapter, section 4.5 (200 + 1000 periods, transitions from stick to slip)
template <class Tableau = DormandPrince5, class Sys, class S, class Sec = Sections<>>
std::vector<DiagramValue<S, dim_v<Sys>>>
bifurcation_diagram(const Sys& sys, std::span<const Params<Sys, std::type_identity_t<S>>> params,
                    const Vec<S, dim_v<Sys>>& x0, const DiagramSettings<S, dim_v<Sys>>& settings,
                    const Sec& watched = {}) {
    require_system<Sys>();
    return detail::diagram_by(WithSteps<Tableau, Sys, S>{}, sys, params, x0, settings, watched);
}

} // namespace filippov
