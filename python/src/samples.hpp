// SPDX-License-Identifier: BSD-3-Clause
// The states of a run at its task's times.
#pragma once

#include "model.hpp"

#include <filippov/engine/trajectory.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace filippov::python {

/// States at the times that a task asks for, by the arithmetic of its solution.
template <class Sys> class Samples {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = Vec<double, N>;

    /// @param kept  of the run, whose pieces they are not taken from
    Samples(const Trajectory<Sys, double>& kept, const Task& task)
        : task_(task), one_{kept.sys, kept.p, {}, {}, {}, {}, {}, {}, kept.scale} {}

    std::vector<double> t;
    std::vector<X> x;
    std::vector<Mode<M>> mode;

    /// The same observer, to which this one listens as well.
    Observer<double, N, M> heard_with(Observer<double, N, M> observer) {
        observer.event = [this, tell = std::move(observer.event)](const auto& event) {
            tell(event);
            if (event.kind == EventKind::start)
                start(event);
        };
        observer.step = [this, tell = std::move(observer.step)](const auto& step,
                                                                const auto& path) {
            if (tell)
                tell(step, path);
            on_step(step, path);
        };
        return observer;
    }
    /// Adds times at the end that rounding put behind it; of a run that failed, where it ended.
    void finish(const FlowResult<double, N, M>& result) {
        if (result.status == Status::ok)
            while (wanted())
                add(next(), result.x, last_mode_);
        else if (t.empty() || t.back() != result.t)
            add(result.t, result.x, last_mode_);
    }

private:
    void start(const Event<double, N, M>& event) {
        last_mode_ = event.mode_after;
        while (wanted() && next() == task_.t0)
            add(next(), event.x_right, event.mode_after);
    }
    void on_step(const StepView<double, N, M>& step, const StepPath<double, N>& path) {
        if (!stepped_) // the first point has the mode of the first step
            std::fill(mode.begin(), mode.end(), step.mode);
        stepped_ = true;
        last_mode_ = step.mode;
        const double t1 = step.end.absolute();
        const bool forward = task_.t_end >= task_.t0;
        const auto reached = [&] { return wanted() && (forward ? next() <= t1 : next() >= t1); };
        if (!reached())
            return;
        one_.t = {step.clock.absolute(), t1};
        one_.pieces.clear();
        const auto [low, high] = std::minmax(one_.t[0], one_.t[1]);
        while (reached()) {
            if (next() != t1 && one_.pieces.empty())
                one_.pieces = {piece_of(step, path)};
            add(next(), next() == t1 ? step.x1 : one_(std::clamp(next(), low, high)), step.mode);
        }
    }
    bool wanted() const { return t.size() < task_.t_eval->size(); }
    double next() const { return (*task_.t_eval)[t.size()]; }
    void add(double time, const X& state, const Mode<M>& in) {
        t.push_back(time);
        x.push_back(state);
        mode.push_back(in);
    }

    const Task& task_;
    Trajectory<Sys, double> one_; ///< of one piece
    Mode<M> last_mode_{};
    bool stepped_ = false;
};

} // namespace filippov::python
