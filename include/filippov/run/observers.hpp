// SPDX-License-Identifier: BSD-3-Clause
// What is heard of a run. What nobody asks for is neither computed nor stored.
#pragma once

#include <filippov/run/clock.hpp>
#include <filippov/run/event.hpp>
#include <filippov/run/path.hpp>
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

/// The path of a step as an observer sees it.
template <class S, int N> class StepPath {
public:
    explicit StepPath(Path<S, N>& path) : path_(path) {}
    Vec<S, N> operator()(const S& theta) const { return path_(theta); }
    /// Leaves in a DensePiece what is needed to evaluate the step later.
    template <class Piece> void store(Piece& piece) const {
        path_.store({piece.polynomial, piece.closed_form});
    }

private:
    Path<S, N>& path_;
};

/// What a run tells and asks: a set of functions, each of which may be empty,
/// {.event = [&](const auto& e) { ... }, .stop = [&] { ... }}, in the order in which they stand
/// here.
///
/// They are copied: an object with a state of its own is captured by reference, or converts to an
/// observer as EventLog does. What they are given lives as long as the call. `segment` tells steps
/// alone, and asks `begin`, `stop` and `skip`.
template <class S, int N, int M> struct Observer {
    /// Before any work; may refuse the run by std::invalid_argument.
    std::function<void(const S& t0, const S& t_end)> begin{};
    /// Every event, in the order of the run. One is held back until the next or the end, since two
    /// changes of mode at one time are one: the steps after it are told before it.
    std::function<void(const Event<S, N, M>&)> event{};
    /// Every accepted step; path(theta) is the state at theta in [0, 1] of it. The interpolant
    /// behind the path is built at the first call.
    std::function<void(const StepView<S, N, M>&, const StepPath<S, N>&)> step{};
    /// Asked at every event but those at the start of a run (its first point, and sections that are
    /// zero there) and its end, before `event` tells of it: true ends the run there, with status
    /// `event`.
    std::function<bool(const Event<S, N, M>&)> ends{};
    /// Asked every 256 trials of a step, and where a run fails: true ends it, with status
    /// `interrupted`.
    std::function<bool()> stop{};
    /// Asked where the solution is not unique: k for `verdict.option[k]`, k < `verdict.kept()`, or
    /// -1 to leave it to the policy.
    /// @error std::invalid_argument, by the run, for other numbers
    std::function<int(const Verdict<M>&)> choose{};
    /// The state jumps at surface j: the mode before, and the sides after, where a slide may
    /// follow. Told at once.
    std::function<void(const Clock<S>&, const Mode<M>& before, int j, const Mode<M>& after)> jump{};
    /// Events accumulated, told after the step that leads past them: the mode in which the solution
    /// is held from there on.
    std::function<void(const Clock<S>&, const Mode<M>&)> limit{};
    /// Asked after steps and events of a run forwards with a period: how many of the whole periods
    /// left need not be followed. (Not of a run in dual numbers: derivatives do not repeat with the
    /// solution.)
    std::function<long long(long long left)> skip{};
};

/// An observer of runs of a system.
template <class Sys, class S>
using ObserverOf = std::type_identity_t<Observer<S, dim_v<Sys>, surfaces_v<Sys>>>;

/// Keeps the event log.
template <class S, int N, int M> struct EventLog {
    std::vector<Event<S, N, M>> events;

    operator Observer<S, N, M>() & {
        return {.event = [this](const Event<S, N, M>& event) { events.push_back(event); }};
    }
};

/// Keeps the state at given times, and the events. Of a run that ended early there are the states
/// up to its end. Each run begins with nothing kept; at a jump the state before it is kept.
///
/// The times, if there are any, lie from t0 to t_end in the order in which the run meets them:
/// rising, or falling where it runs backwards. A time that is there twice is kept twice.
/// @error std::invalid_argument, by the run, for other times
template <class S, int N, int M> struct OutputTimes {
    std::span<const S> times;
    std::vector<Vec<S, N>> states{};
    std::vector<Mode<M>> modes{};
    std::vector<Event<S, N, M>> events{};

    operator Observer<S, N, M>() & {
        return {.begin = [this](const S& t0, const S& t_end) { begin(t0, t_end); },
                .event = [this](const Event<S, N, M>& event) { on_event(event); },
                .step = [this](const StepView<S, N, M>& step,
                               const StepPath<S, N>& path) { on_step(step, path); }};
    }

private:
    void begin(const S& t0, const S& t_end) {
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
    void on_step(const StepView<S, N, M>& step, const StepPath<S, N>& path) {
        for (; states.size() < times.size();) {
            const S theta =
                step.clock.until(Clock<S>::at(times[states.size()], step.clock.period)) / step.dt;
            if (!(theta <= S(1)))
                break;
            keep(theta <= S(0) ? step.x0 : theta == S(1) ? step.x1 : path(theta), step.mode);
        }
    }
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
