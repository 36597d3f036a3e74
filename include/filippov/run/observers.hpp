// SPDX-License-Identifier: BSD-3-Clause
// What a run leaves behind, chosen at compile time: what nobody asked for is neither computed nor
// stored.
#pragma once

#include <filippov/methods/runge_kutta.hpp>
#include <filippov/run/clock.hpp>
#include <filippov/run/event.hpp>
#include <filippov/run/settings.hpp>
#include <filippov/sliding/mode.hpp>

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace filippov {

/// One accepted step as an observer sees it.
template <class S, int N, int M> struct StepView {
    const Clock<S>& clock; ///< at the start of the step
    const Clock<S>& end;   ///< at its end
    S dt;                  ///< signed length
    const Vec<S, N>& x0;
    const Vec<S, N>& x1;
    const Mode<M>& mode;
};

/// An observer: `on_event(event)`, and if `wants_steps`, `on_step(view, path)` where path(theta) is
/// the state at theta in [0, 1] of the step; the interpolant behind it is built at the first call.
/// An optional `interrupted()` is asked now and then and ends the run with status `interrupted`; an
/// optional `ends_at(event)` is asked at every event and ends the run with status `event`; an
/// optional `skip_periods(left)`, asked after steps and events, says how many of the whole periods
/// left the run need not follow. An optional `on_jump(clock, before, j, after)` hears of a jump of
/// the state at surface j when it happens: the modes are the one before and the sides after, where
/// a slide may follow. An optional `on_limit(clock, mode)` hears that events accumulated, after the
/// step that leads past them, and in which mode the solution is held from there on. An optional
/// `choose(verdict)` names one of a Verdict's options where the solution is not unique, -1 to leave
/// that to the policy. An optional `prepare(t0, t_end)` is called before any work, and may refuse
/// the run by std::invalid_argument.
template <class O, class S, int N, int M>
concept Observer = requires(O& o, const Event<S, N, M>& event) {
    { O::wants_steps } -> std::convertible_to<bool>;
    o.on_event(event);
};

/// The path of a step, called through pointers.
template <class S, int N> class StepPath {
public:
    template <class Path>
    explicit StepPath(Path& path)
        : path_(&path), call_([](void* object, const S& theta) -> Vec<S, N> {
              return (*static_cast<Path*>(object))(theta);
          }),
          store_([](void* object, Kept& kept) { static_cast<Path*>(object)->store(kept); }) {}
    Vec<S, N> operator()(const S& theta) const { return call_(path_, theta); }
    /// Leaves in a DensePiece what is needed to evaluate the step later.
    template <class Piece> void store(Piece& piece) const {
        Kept kept{piece.polynomial, piece.closed_form};
        store_(path_, kept);
    }

private:
    struct Kept {
        Interpolant<S, N, 8>& polynomial;
        bool& closed_form;
    };
    void* path_;
    Vec<S, N> (*call_)(void*, const S&);
    void (*store_)(void*, Kept&);
};

/// Whoever wants to hear of a run without the engine being compiled for him. All runs of a system
/// and method that are heard by listeners share one engine (AnySections); the calls cost some
/// nanoseconds a step.
template <class S, int N, int M> struct Listener {
    static constexpr bool wants_steps = true;
    // each may be empty
    std::function<void(const StepView<S, N, M>&, const StepPath<S, N>&)> step{};
    std::function<void(const Event<S, N, M>&)> event{};
    std::function<bool(const Event<S, N, M>&)> ends{};
    std::function<bool()> stop{};
    std::function<long long(long long)> skip{};
    std::function<int(const Verdict<M>&)> chooser{};
    std::function<void(const Clock<S>&, const Mode<M>&, int, const Mode<M>&)> jump{};
    std::function<void(const Clock<S>&, const Mode<M>&)> limit{};

    void on_event(const Event<S, N, M>& e) {
        if (event)
            event(e);
    }
    template <class Path> void on_step(const StepView<S, N, M>& view, Path& path) {
        if (step)
            step(view, StepPath<S, N>(path));
    }
    bool ends_at(const Event<S, N, M>& e) { return ends && ends(e); }
    bool interrupted() { return stop && stop(); }
    long long skip_periods(long long left) { return skip ? skip(left) : 0; }
    int choose(const Verdict<M>& verdict) { return chooser ? chooser(verdict) : -1; }
    void on_limit(const Clock<S>& clock, const Mode<M>& mode) {
        if (limit)
            limit(clock, mode);
    }
    void on_jump(const Clock<S>& clock, const Mode<M>& before, int j, const Mode<M>& after) {
        if (jump)
            jump(clock, before, j, after);
    }
};

/// Keeps nothing: the result of the run is its final state.
struct Nothing {
    static constexpr bool wants_steps = false;
    void on_event(const auto&) {}
};

/// Keeps the event log.
template <class S, int N, int M> struct EventLog {
    static constexpr bool wants_steps = false;
    std::vector<Event<S, N, M>> events;

    void on_event(const Event<S, N, M>& event) { events.push_back(event); }
};

/// Keeps the state at given times, and the events. Of a run that ended early there are the states
/// up to its end. Each run begins with nothing kept; at a jump the state before it is kept.
///
/// The times, if there are any, lie from t0 to t_end in the order in which the run meets them:
/// rising, or falling where it runs backwards. A time that is there twice is kept twice.
/// @error std::invalid_argument, by the run, for other times
template <class S, int N, int M> struct OutputTimes {
    static constexpr bool wants_steps = true;
    std::span<const S> times;
    std::vector<Vec<S, N>> states{};
    std::vector<Mode<M>> modes{};
    std::vector<Event<S, N, M>> events{};

    void prepare(const S& t0, const S& t_end) {
        states.clear();
        modes.clear();
        events.clear();
        const S direction = t_end < t0 ? S(-1) : S(1);
        for (std::size_t k = 0; k < times.size(); ++k) {
            if (!std::isfinite(times[k]))
                refuse_time(k, "expected a finite number");
            if (direction * (times[k] - t0) < S(0))
                refuse_time(k, "expected no time before the start, t0 = " + digits(t0));
            if (direction * (times[k] - t_end) > S(0))
                refuse_time(k, "expected no time after the end, t_end = " + digits(t_end));
            if (k > 0 && direction * (times[k] - times[k - 1]) < S(0))
                refuse_time(k, "expected the order in which the run meets them, after times[" +
                                   std::to_string(k - 1) + "] = " + digits(times[k - 1]));
        }
    }
    void on_event(const Event<S, N, M>& event) {
        events.push_back(event);
        // A time at an end of the run is the state there, also where no step was taken.
        if (event.kind == EventKind::start || event.kind == EventKind::end)
            while (states.size() < times.size() && times[states.size()] == event.t)
                keep(event.x_right, event.mode_after);
    }
    template <class Path> void on_step(const StepView<S, N, M>& step, Path& path) {
        for (; states.size() < times.size();) {
            const S theta =
                step.clock.until(Clock<S>::at(times[states.size()], step.clock.period)) / step.dt;
            if (!(theta <= S(1)))
                break;
            keep(theta <= S(0) ? step.x0 : theta == S(1) ? step.x1 : path(theta), step.mode);
        }
    }

private:
    void keep(const Vec<S, N>& x, const Mode<M>& mode) {
        states.push_back(x);
        modes.push_back(mode);
    }
    /// All of them: times that differ by rounding are told apart.
    static std::string digits(const S& t) {
        char text[48];
        std::snprintf(text, sizeof text, "%.*Lg", std::numeric_limits<S>::max_digits10,
                      static_cast<long double>(t));
        return text;
    }
    [[noreturn]] void refuse_time(std::size_t k, const std::string& expectation) const {
        throw std::invalid_argument("filippov: times[" + std::to_string(k) +
                                    "] = " + digits(times[k]) + ": " + expectation);
    }
};

} // namespace filippov
