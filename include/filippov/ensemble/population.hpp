// SPDX-License-Identifier: BSD-3-Clause
// The members of an ensemble, and how one of them is run by the scalar engine.
#pragma once

#include <filippov/core/parallel.hpp>
#include <filippov/engine/flow.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace filippov {

/// A vector that is NaN until it is given: what was forgotten is refused, and never memory.
template <int K> struct GivenVec : Vec<double, K> {
    GivenVec()
        : Vec<double, K>(Vec<double, K>::Constant(std::numeric_limits<double>::quiet_NaN())) {}
    using Vec<double, K>::Vec;
    GivenVec(const Vec<double, K>& given) : Vec<double, K>(given) {}
    using Vec<double, K>::operator=;
};

/// A member of an ensemble: where a run starts and ends. A start or parameters that were not given
/// end it as `not_finite`.
template <int N, int P> struct Member {
    GivenVec<N> x{};
    GivenVec<P> p{};
    double t0 = 0, t_end = 0;
};

/// How long a member runs, units of t, negative backwards; not finite where its times say nothing.
template <int N, int P> double duration(const Member<N, P>& member, double period) {
    if (!std::isfinite(member.t_end - member.t0))
        return std::numeric_limits<double>::quiet_NaN();
    return Clock<double>::at(member.t0, period).until(Clock<double>::at(member.t_end, period));
}

/// How a member ended, or stands where a leg of its run ended.
template <int N> struct Outcome {
    Status status = Status::interrupted; ///< `interrupted`: it was not run to its end
    Clock<double> clock{};
    Vec<double, N> x = Vec<double, N>::Constant(std::numeric_limits<double>::quiet_NaN());
    int mode = 0;                        ///< see Mode::code
    std::int32_t events = 0, slides = 0; ///< changes of mode; those of them into a slide
    double slide_time = 0;               ///< spent in slides, units of t
    long long steps = 0;                 ///< accepted and rejected ones
};

/// An event of a member: a change of its mode, or a jump.
template <int N> struct MemberEvent {
    EventKind kind = EventKind::cross;
    int surface = 0;
    int before = 0, after = 0; ///< see Mode::code
    Clock<double> clock{};
    Vec<double, N> x = Vec<double, N>::Zero(); ///< after it
};

/// Of a member whose times say nothing.
template <int N, int P> Outcome<N> not_begun(const Member<N, P>& member) {
    Outcome<N> o;
    o.status = Status::not_finite;
    o.x = member.x;
    return o;
}

/// What a run in lanes did, counted.
struct LaneCounters {
    long long trips = 0;       ///< of all loops: each computes a step or a window in every lane
    long long useful = 0;      ///< lanes in them that had a member
    long long steps = 0;       ///< trial steps in slip that lanes took
    long long searches = 0;    ///< steps in doubt, taken again to look for events
    long long landings = 0;    ///< steps taken to land on events
    long long windows = 0;     ///< of slides, and trial steps along those without a closed form
    long long handed_over = 0; ///< stretches that the scalar engine ran
    int width = 1;

    double occupancy() const { return trips > 0 ? double(useful) / (double(trips) * width) : 1.0; }
    LaneCounters& operator+=(const LaneCounters& other) {
        trips += other.trips;
        useful += other.useful;
        steps += other.steps;
        searches += other.searches;
        landings += other.landings;
        windows += other.windows;
        handed_over += other.handed_over;
        width = other.width;
        return *this;
    }
};

/// Where the members of an ensemble come from and go to. Its functions are called by several
/// threads at once, each for members of its own.
template <int N, int P> class Population {
public:
    virtual ~Population() = default;
    Population() = default;
    Population(const Population&) = delete;
    Population& operator=(const Population&) = delete;

    virtual Member<N, P> member(std::size_t id) = 0;
    /// Asked where a member comes to its end: true if it is to go on by another leg.
    virtual bool goes_on(std::size_t, const Outcome<N>&) { return false; }
    /// How far: a whole number of periods if the system has one, > 0.
    virtual double leg(std::size_t) { return 0; }
    /// Told, if it `hears`, of each event that an outcome counts, in the order of time.
    virtual void hear(std::size_t, const MemberEvent<N>&) {}
    /// The end of a member, told once.
    virtual void take(std::size_t id, const Outcome<N>& outcome) = 0;

    /// True of a state outside the bounds.
    bool beyond(const Vec<double, N>& x) const {
        return !(x.cwiseAbs().array() <= escape.array()).all();
    }

    /// True of a run that ended outside the bounds, well or not.
    bool gone(Status status, const Vec<double, N>& x) const {
        return status != Status::interrupted && (status == Status::ok || x.allFinite()) &&
               beyond(x);
    }

    bool same_params = false;  ///< all members have the same parameters
    bool ends_at_exit = false; ///< the first exit from a slide ends a member, with status `event`
    bool hears = false;        ///< it wants to know of events
    /// Members that a thread takes up at once; 0: so many that they end at any time. Fewer, where
    /// they run for long, so that some have ended when a run is cancelled.
    std::size_t at_once = 0;
    /// A member of which a component is larger than this has escaped: looked at after steps in
    /// lanes, else where a leg or the run ends.
    Vec<double, N> escape = Vec<double, N>::Constant(std::numeric_limits<double>::infinity());
};

/// The next leg of a member.
/// @error std::invalid_argument for one that leads nowhere
template <int N, int P> double next_leg(Population<N, P>& population, std::size_t id) {
    const double leg = population.leg(id);
    if (!(leg > 0 && leg < std::numeric_limits<double>::infinity()))
        detail::refuse("leg", leg, "expected a finite number > 0");
    return leg;
}

// What follows crosses from one module to another, which may be compiled for other instruction
// sets: these decide how Eigen aligns its vectors, and by that where in a structure they are. So
// there are none in it, and the asserts say where everything is.

namespace detail {

/// The numbers of a vector of any kind, for the other side of a seam.
template <int N, class V> std::array<double, std::size_t(N)> plain(const V& v) {
    std::array<double, std::size_t(N)> numbers;
    for (std::size_t i = 0; i < std::size_t(N); ++i)
        numbers[i] = v[Eigen::Index(i)];
    return numbers;
}
/// ... and the vector of numbers that come from there.
template <std::size_t n> Vec<double, int(n)> vector_of(const std::array<double, n>& numbers) {
    Vec<double, int(n)> v;
    for (std::size_t i = 0; i < n; ++i)
        v[Eigen::Index(i)] = numbers[i];
    return v;
}

} // namespace detail

/// A stretch of a member's run.
template <int N, int P> struct Stretch {
    double t0 = 0; ///< when it starts, since the period began
    double dt = 0; ///< how long, of any sign
    long long max_steps = 1, max_events = 1;
    std::int32_t before = 0; ///< the mode before the event at which it starts, and ...
    std::int32_t guard = -1; ///< ... what was met there (see Guard); -1: nothing is known of it
    bool ends_at_exit = false;
    alignas(8) std::array<double, std::size_t(N)> x{}; ///< at its start
    alignas(8) std::array<double, std::size_t(P)> p{};
};
/// How it ended.
template <int N> struct StretchEnd {
    Clock<double> clock{}; ///< its index counts the periods of the stretch
    long long steps = 0;
    double slide_time = 0;
    Status status = Status::ok;
    std::int32_t mode = 0;
    std::int32_t events = 0, slides = 0; ///< changes of mode; those of them into a slide
    alignas(8) std::array<double, std::size_t(N)> x{};
};
/// An event in it, see MemberEvent.
template <int N> struct StretchEvent {
    std::int32_t kind = 0, surface = 0, before = 0, after = 0;
    long long period = 0; ///< counted from that in which the stretch starts
    double t_local = 0;   ///< since it began
    alignas(8) std::array<double, std::size_t(N)> x{};
};
/// Who hears of them. (No destructor: nobody owns one through this.)
template <int N> class StretchListener {
public:
    StretchListener() = default;
    StretchListener(const StretchListener&) = delete;
    StretchListener& operator=(const StretchListener&) = delete;

    virtual void hear(const StretchEvent<N>& event) = 0;

protected:
    ~StretchListener() = default;
};

namespace detail {

/// True if they are where they are with every compiler and all its options.
template <int N, int P> constexpr bool is_laid_out() {
    using Start = Stretch<N, P>;
    using End = StretchEnd<N>;
    using Event = StretchEvent<N>;
    return offsetof(Start, dt) == 8 && offsetof(Start, max_steps) == 16 &&
           offsetof(Start, max_events) == 24 && offsetof(Start, before) == 32 &&
           offsetof(Start, guard) == 36 && offsetof(Start, ends_at_exit) == 40 &&
           offsetof(Start, x) == 48 && offsetof(Start, p) == 48 + 8 * std::size_t(N) &&
           sizeof(Start) == 48 + 8 * std::size_t(N + std::max(P, 1)) && alignof(Start) == 8 &&
           offsetof(End, steps) == 32 && offsetof(End, slide_time) == 40 &&
           offsetof(End, status) == 48 && offsetof(End, mode) == 52 &&
           offsetof(End, events) == 56 && offsetof(End, slides) == 60 && offsetof(End, x) == 64 &&
           sizeof(End) == 64 + 8 * std::size_t(N) && alignof(End) == 8 &&
           offsetof(Event, period) == 16 && offsetof(Event, t_local) == 24 &&
           offsetof(Event, x) == 32 && sizeof(Event) == 32 + 8 * std::size_t(N) &&
           alignof(Event) == 8;
}
static_assert(sizeof(Clock<double>) == 32 && offsetof(Clock<double>, index) == 8 &&
              offsetof(Clock<double>, local) == 16 && offsetof(Clock<double>, carry) == 24);
static_assert(sizeof(Status) == 4);

} // namespace detail

/// Runs stretches one at a time: what is not plain enough for lanes, and systems and settings that
/// lanes do not know. An interface, so that lanes are compiled without it.
template <int N, int P> class ScalarEngine {
public:
    virtual ~ScalarEngine() = default;
    ScalarEngine() = default;
    ScalarEngine(const ScalarEngine&) = delete;
    ScalarEngine& operator=(const ScalarEngine&) = delete;
    static_assert(detail::is_laid_out<N, P>(), "filippov: every module has a stretch's numbers at "
                                               "the same places");

    /// @param listener  null: nobody wants to know of events
    virtual StretchEnd<N> run(const Stretch<N, P>& stretch, Worker& worker,
                              StretchListener<N>* listener) const = 0;
};

namespace detail {

/// Tells a population of the events in a stretch of a member's run.
template <int N, int P> class StretchTeller final : public StretchListener<N> {
public:
    /// @param begin  the member's clock where the stretch does
    StretchTeller(Population<N, P>& population, std::size_t id, const Clock<double>& begin)
        : population_(population), id_(id), begin_(begin) {}

    void hear(const StretchEvent<N>& e) override {
        const Clock<double> when{begin_.period, begin_.index + e.period, e.t_local, 0};
        population_.hear(id_, {static_cast<EventKind>(e.kind), e.surface, e.before, e.after, when,
                               vector_of(e.x)});
    }
    /// For the engine: null if nobody wants to know.
    StretchListener<N>* listener() { return population_.hears ? this : nullptr; }

private:
    Population<N, P>& population_;
    const std::size_t id_;
    const Clock<double> begin_;
};

} // namespace detail

/// The engine of `flow`.
template <class Sys, class Tableau>
class FlowEngine final : public ScalarEngine<dim_v<Sys>, params_v<Sys>> {
    static constexpr int N = dim_v<Sys>, M = surfaces_v<Sys>, P = params_v<Sys>;

public:
    FlowEngine(const Sys& sys, const Settings<double, N>& settings)
        : sys_(sys), settings_(settings) {}

    StretchEnd<N> run(const Stretch<N, P>& stretch, Worker& worker,
                      StretchListener<N>* listener) const override {
        StretchEnd<N> end;
        Settings<double, N> settings = settings_;
        settings.max_steps = stretch.max_steps;
        settings.max_events = stretch.max_events;
        KnownStart<M> known;
        known.before.set(0, stretch.before);
        known.guard = stretch.guard;
        Observer<double, N, M> observer;
        double since = stretch.t0;
        bool sliding = false;
        observer.event = [&](const Event<double, N, M>& e) {
            if (sliding)
                end.slide_time += std::abs(e.t - since);
            since = e.t;
            const bool was_sliding = sliding;
            sliding = e.mode_after.sliding() > 0;
            if (e.kind == EventKind::start || e.kind == EventKind::end ||
                (e.mode_before == e.mode_after && e.kind != EventKind::jump))
                return;
            ++end.events;
            end.slides += sliding && !was_sliding;
            if (listener != nullptr)
                listener->hear(plain_event(e));
        };
        observer.ends = [&](const Event<double, N, M>& e) {
            return stretch.ends_at_exit && e.kind == EventKind::exit_sliding;
        };
        observer.stop = [&] { return worker.stopped(); };
        const Vec<double, P> p = detail::vector_of(stretch.p);
        const Vec<double, N> x = detail::vector_of(stretch.x);
        const AnySections<double, N, P> none;
        StepsOf<Tableau, Sys, double> steps;
        const auto r = detail::Flow<Sys, double>(sys_, p, stretch.t0, x, stretch.t0 + stretch.dt,
                                                 settings, observer, none, known, steps)
                           .run();
        end.slide_time = std::min(end.slide_time, std::abs(stretch.dt)); // a sum may round up
        end.status = r.status;
        end.clock = r.clock;
        end.x = detail::plain<N>(r.x);
        end.mode = r.mode.code(surface_count(sys_));
        end.steps = r.counters.steps + r.counters.rejected;
        return end;
    }

private:
    StretchEvent<N> plain_event(const Event<double, N, M>& e) const {
        const int n = surface_count(sys_);
        return {.kind = std::int32_t(e.kind),
                .surface = e.surface,
                .before = e.mode_before.code(n),
                .after = e.mode_after.code(n),
                .period = e.period,
                .t_local = e.t_local,
                .x = detail::plain<N>(e.x_right)};
    }
    const Sys sys_;
    const Settings<double, N> settings_;
};

} // namespace filippov
