// SPDX-License-Identifier: BSD-3-Clause
// A whole run kept: steps, modes, events, and the solution at any time.
#pragma once

#include <filippov/engine/flow.hpp>

#include <algorithm>
#include <vector>

namespace filippov {

/// One step as it can be evaluated later.
template <class S, int N, int M> struct DensePiece {
    Clock<S> clock; ///< at its start
    S dt{};         ///< signed length
    Vec<S, N> x0;
    Mode<M> mode;
    Interpolant<S, N, 8> polynomial; ///< unused terms are zero
    bool closed_form = false;        ///< a slide that the system evaluates itself
};

/// A piece of no length: the state after a jump.
template <class S, int N, int M>
DensePiece<S, N, M> resting_piece(const Clock<S>& clock, const Vec<S, N>& x, const Mode<M>& mode) {
    DensePiece<S, N, M> piece{clock, S(0), x, mode, {}, false};
    for (auto& c : piece.polynomial.c)
        c.setZero();
    piece.polynomial.c[0] = x;
    return piece;
}

/// Result of `simulate`.
template <class Sys, class S> struct Trajectory {
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;

    Sys sys;
    Params<Sys, S> p;
    std::vector<S> t; ///< absolute times of the start, of every step's end, so of every event
    std::vector<Vec<S, N>> x; ///< states there
    std::vector<Mode<M>>
        mode; ///< mode of the step that ends there; at the start, of the first step
    std::vector<Event<S, N, M>> events;
    std::vector<DensePiece<S, N, M>> pieces; ///< if dense output was asked for
    FlowResult<S, N, M> result;
    Vec<S, N> scale; ///< lengths for putting a slide's interpolant on the surface

    bool dense() const { return !pieces.empty(); }

    /// State at time t between the first and the last; at a jump the state before it.
    /// @error std::out_of_range outside, std::logic_error without dense output
    Vec<S, N> operator()(const S& time) const {
        const auto& piece = piece_at(time);
        const S theta = piece.dt != S(0)
                            ? std::clamp(S((time - piece.clock.absolute()) / piece.dt), S(0), S(1))
                            : S(0);
        if (piece.closed_form) {
            if constexpr (HasSlidingFlow<Sys, S>)
                return sys.sliding_flow(piece.clock.local, piece.x0, p, S(theta * piece.dt));
        }
        const Vec<S, N> y = piece.polynomial(theta);
        const S local = piece.clock.local + theta * piece.dt;
        Constraints<Sys> held(sys, piece.mode);
        if constexpr (!single_v<Sys>)
            held = independent_part(sys, held, local, y, p, scale);
        return project(sys, held, local, y, p, scale);
    }
    /// Mode at time t; at an event the mode before it.
    Mode<M> mode_at(const S& time) const { return piece_at(time).mode; }

    /// Blend variable of surface j at time t: -1 and +1 off the surface, the equivalent control on
    /// it; NaN in contact, where there is a force and no s.
    S s(const S& time, int j = 0) const {
        const auto& piece = piece_at(time);
        if (piece.mode[j] != 0)
            return S(piece.mode[j]);
        if (is_kind(sys, j, SurfaceKind::jump))
            return std::numeric_limits<S>::quiet_NaN();
        const S local = piece.clock.local + (time - piece.clock.absolute());
        return sliding_margin(sys, piece.mode, j, local, (*this)(time), p).s;
    }

private:
    const DensePiece<S, N, M>& piece_at(const S& time) const {
        if (pieces.empty())
            throw std::logic_error("filippov: this trajectory has no dense output");
        const S first = t.front(), last = t.back();
        const bool forward = last >= first;
        if (!(time >= std::min(first, last) && time <= std::max(first, last)))
            throw std::out_of_range("filippov: time is outside the trajectory");
        const auto before = [forward](const S& a, const S& b) { return forward ? a < b : a > b; };
        const auto next = std::lower_bound(t.begin() + 1, t.end(), time, before);
        const auto index =
            std::min<std::ptrdiff_t>(next - (t.begin() + 1), std::ptrdiff_t(pieces.size()) - 1);
        return pieces[std::size_t(index)];
    }
};

/// A trajectory of which nothing is known yet.
template <class Sys, class S>
Trajectory<Sys, S> empty_trajectory(const Sys& sys, const Params<Sys, S>& p,
                                    const Vec<S, dim_v<Sys>>& x0,
                                    const Settings<S, dim_v<Sys>>& settings) {
    Trajectory<Sys, S> trajectory{sys, p, {}, {}, {}, {}, {}, {}, {}};
    for (int i = 0; i < dim_v<Sys>; ++i) {
        using std::abs;
        trajectory.scale[i] = error_allowed(settings.atol[i], settings.rtol, S(abs(x0[i])));
    }
    return trajectory;
}

/// An accepted step as it can be evaluated later.
template <class S, int N, int M>
DensePiece<S, N, M> piece_of(const StepView<S, N, M>& step, const StepPath<S, N>& path) {
    DensePiece<S, N, M> piece{step.clock, step.dt, step.x0, step.mode, {}, false};
    for (auto& c : piece.polynomial.c)
        c.setZero();
    path.store(piece);
    return piece;
}

/// What is kept of the steps of a run; its events are kept anyway.
enum class Keep {
    events, ///< nothing
    steps,  ///< where they end
    dense   ///< and what lies between
};

/// Observer that fills a trajectory. It hears one run, whose result `finish` is told.
template <class Sys, class S> class Recorder {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;

    explicit Recorder(Trajectory<Sys, S>& trajectory, Keep keep = Keep::dense)
        : trajectory_(trajectory), keep_(keep) {}

    operator Observer<S, N, M>() & {
        return {.begin =
                    [this](const S& t0, const S& t_end) {
                        t0_ = t0;
                        t_end_ = t_end;
                    },
                .event = [this](const Event<S, N, M>& event) { on_event(event); },
                .step =
                    keep_ == Keep::events
                        ? nullptr
                        : std::function<void(const StepView<S, N, M>&, const StepPath<S, N>&)>(
                              [this](const auto& step, const auto& path) { on_step(step, path); })};
    }

    /// The clock rounds where it turns absolute times into periods and back: what is at the ends of
    /// a run is there at exactly the times that were given.
    void finish(FlowResult<S, N, M> result) {
        if (result.status == Status::ok) {
            auto& t = trajectory_.t;
            auto& events = trajectory_.events;
            const S reached = events.back().t;
            for (std::size_t k = events.size(); k-- > 1 && events[k].t == reached;)
                events[k].t = t_end_;
            for (std::size_t k = t.size(); k-- > 1 && t[k] == reached;) // twice after a jump
                t[k] = t_end_;
        }
        trajectory_.result = std::move(result);
    }

private:
    void on_event(const Event<S, N, M>& event) {
        if (event.kind == EventKind::start)
            start_ = event.t;
        trajectory_.events.push_back(event);
        trajectory_.events.back().t = given(event.t);
        if (keep_ == Keep::events)
            return;
        if (event.kind == EventKind::start)
            add(event.t, event.x_right, event.mode_after);
        if constexpr (has_jumps_v<Sys>) // a jump in the last instant
            if (event.kind == EventKind::end && event.x_right != trajectory_.x.back())
                land(Clock<S>::at(event.t, period(trajectory_.sys, trajectory_.p)), event.t,
                     event.x_right, event.mode_after);
    }
    void on_step(const StepView<S, N, M>& step, const StepPath<S, N>& path) {
        if (trajectory_.t.size() == 1)
            trajectory_.mode.front() = step.mode;
        if constexpr (has_jumps_v<Sys>)
            if (step.x0 != trajectory_.x.back())
                land(step.clock, step.clock.absolute(), step.x0, step.mode);
        add(step.end.absolute(), step.x1, step.mode);
        if (keep_ == Keep::dense)
            trajectory_.pieces.push_back(piece_of(step, path));
    }
    /// After a jump of the state the time is there twice, with the states before and after.
    void land(const Clock<S>& clock, const S& t, const Vec<S, N>& x, const Mode<M>& mode) {
        add(t, x, mode);
        if (keep_ == Keep::dense)
            trajectory_.pieces.push_back(resting_piece(clock, x, mode));
    }
    S given(const S& t) const { return t == start_ ? t0_ : t; }
    void add(const S& t, const Vec<S, N>& x, const Mode<M>& mode) {
        trajectory_.t.push_back(given(t));
        trajectory_.x.push_back(x);
        trajectory_.mode.push_back(mode);
    }

    Trajectory<Sys, S>& trajectory_;
    const Keep keep_;
    S t0_{}, t_end_{};
    S start_{}; ///< by the clock
};

/// Simulates and keeps everything: the convenient form of `flow`.
/// @param params  `{}`: the defaults
template <class Tableau = DormandPrince5, bool Dense = true, class Sys, class S,
          class Sec = Sections<>>
Trajectory<Sys, S> simulate(const Sys& sys, const GivenParams<Sys, S>& params,
                            const Vec<S, dim_v<Sys>>& x0, std::type_identity_t<S> t0,
                            std::type_identity_t<S> t_end,
                            const Settings<S, dim_v<Sys>>& settings = {}, const Sec& watched = {}) {
    const Params<Sys, S> p = params.of(sys);
    Trajectory<Sys, S> trajectory = empty_trajectory(sys, p, x0, settings);
    Recorder<Sys, S> recorder(trajectory, Dense ? Keep::dense : Keep::steps);
    recorder.finish(flow<Tableau>(sys, p, x0, t0, t_end, settings, recorder, watched));
    return trajectory;
}

} // namespace filippov
