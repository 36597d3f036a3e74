// SPDX-License-Identifier: BSD-3-Clause
// The seam between Python and the engine: a system and a run without their types. Nothing here
// knows pybind11, so that a model's translation unit compiles the engine and nothing else.
#pragma once

#include <filippov/core/parallel.hpp>
#include <filippov/ensemble/any_lanes.hpp>
#include <filippov/orbits/system_interface.hpp>
#include <filippov/run/run_settings.hpp>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filippov {
class TapeProgram;
} // namespace filippov

namespace filippov::python {

/// What is known of a system without evaluating it.
struct Facts {
    std::string name;
    std::vector<std::string> state;
    std::vector<std::string> params;
    std::vector<double> defaults;
    std::vector<std::string> capabilities; ///< optional members that were found
    std::vector<std::string> kinds;        ///< of the surfaces: "switching", "kink" or "jump"
    int dim = 0;
    int surfaces = 0;
};

/// A user's event function g(t, x).
struct Watch {
    std::function<double(double t, const double* x)> value;
    int direction = 0;
    long long stop_after = 0; ///< end the run at this occurrence; 0: never
};

/// How many event functions a run takes: the engine keeps its guards in fixed storage.
inline constexpr int max_watches = 16;

/// Everything a run is told.
struct Task {
    RunSettings settings;
    std::vector<double> x0;
    std::vector<double> params;
    double t0 = 0;
    double t_end = 0;
    bool dense = true;
    std::optional<std::vector<double>> t_eval;
    std::vector<Watch> watches;
    std::function<bool()> interrupted;
};

/// Everything a bifurcation diagram is told.
struct DiagramTask {
    RunSettings settings;
    std::vector<double> x0;
    std::vector<double> params; ///< one row a value
    std::vector<int> kinds;     ///< event kinds; none: a strobe
    int surface = -1, direction = 0;
    double transient = 0;
    double keep = 0;
    bool follow = false;
    int chains = 1;
    bool skip_repeats = true;
    Parallel parallel;
    const AnyLanes* lanes = nullptr; ///< of the system; null if it does not run in lanes
};

/// Everything a bifurcation diagram leaves behind, one column a field.
struct DiagramColumns {
    // one entry a point
    std::vector<long long> period, value;
    std::vector<double> t_local, x; ///< states: dim values a point
    std::vector<int> kind, surface;
    std::vector<signed char> boundary;
    // one entry a value
    std::vector<double> forcing, x_end; ///< period of the forcing; dim values of the state
    std::vector<long long> cycle, skipped;
    std::vector<std::string> status, message;
    Counters counters; ///< of all runs
};

/// Terms of the polynomial of a piece, unused ones included.
inline constexpr std::size_t solution_terms = 8;

/// A solution in numbers, from which its model makes it again.
struct PackedSolution {
    std::vector<double> params, scale; ///< scale: dim values
    // one entry, or row, a knot
    std::vector<double> t, x;
    std::vector<signed char> mode;
    // one entry, or row, a piece, which is what is between two knots
    std::vector<long long> period;      ///< the clock at its start: index of the period,
    std::vector<double> t_local, carry; ///< time in it, and what that lacks
    std::vector<double> dt, x0;
    std::vector<double> polynomial;       ///< solution_terms rows of dim values
    std::vector<signed char> closed_form; ///< 1: is; 2: of a slide of second order
};

/// A run's solution at any time in its span.
class Solution {
public:
    Solution() = default;
    Solution(const Solution&) = delete;
    Solution& operator=(const Solution&) = delete;
    virtual ~Solution() = default;

    /// Ends of the steps, the start first.
    virtual std::span<const double> knots() const = 0;
    /// States, shape (times, dim); at a knot exactly the state there.
    virtual void states(std::span<const double> times, std::span<double> out) const = 0;
    /// Modes, shape (times, surfaces); at an event the mode before it.
    virtual void modes(std::span<const double> times, std::span<signed char> out) const = 0;
    /// Blend variables, shape (times, surfaces): the equivalent control where the mode slides, the
    /// side's -1 or +1 elsewhere.
    virtual void blend(std::span<const double> times, std::span<double> out) const = 0;
    virtual PackedSolution packed() const = 0;
};

/// The event log, one column a field.
struct EventColumns {
    std::vector<double> t, t_local, s, x_left, x_right; ///< states: dim values an event
    std::vector<long long> period;
    std::vector<int> kind, surface, alternatives;
    std::vector<unsigned> contacts;
    std::vector<signed char> mode_before, mode_after; ///< surfaces values an event
};

/// Everything a run leaves behind.
struct Run {
    std::vector<double> t;
    std::vector<double> x;         ///< dim values a point
    std::vector<signed char> mode; ///< surfaces values a point
    EventColumns events;
    std::shared_ptr<const Solution> solution; ///< null without dense output
    Counters counters;
    Status status = Status::ok;
    std::string message;
};

/// Every solution of a run that is not unique.
struct Runs {
    std::vector<Run> all;
    bool complete = true; ///< false: there are more than were asked for
};

/// A system whose type is forgotten. A compiled model is one kind; whatever else can be evaluated
/// and run is another.
///
/// Arrays of states are row by row, shape (k, dim); `t` has one entry or k. `side` has one entry a
/// surface: -1, +1, or 0 for sliding.
class Model {
public:
    Model() = default;
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;
    virtual ~Model() = default;

    virtual const Facts& facts() const = 0;
    /// Period of the forcing, 0 if there is none.
    virtual double period(std::span<const double> p) const = 0;
    /// Switching functions, shape (k, surfaces).
    virtual void h(std::span<const double> t, std::span<const double> x, std::span<const double> p,
                   std::span<double> out) const = 0;
    /// The field of a mode, shape (k, dim).
    virtual void field(std::span<const double> t, std::span<const double> x,
                       std::span<const int> side, std::span<const double> p,
                       std::span<double> out) const = 0;
    /// Its Jacobian, shape (k, dim, dim).
    virtual void jacobian(std::span<const double> t, std::span<const double> x,
                          std::span<const int> side, std::span<const double> p,
                          std::span<double> out) const = 0;
    /// Normal components L1, L2 at `surface`, the other surfaces as in `side`; shape (k, 2).
    virtual void normal_components(std::span<const double> t, std::span<const double> x,
                                   int surface, std::span<const int> side,
                                   std::span<const double> p, std::span<double> out) const = 0;
    /// Puts points on h = 0 of `surface` by Newton along grad h; shape (k, dim).
    virtual void project(std::span<const double> t, std::span<const double> x, int surface,
                         std::span<const double> p, std::span<double> out) const = 0;
    /// Follows the solution. Exceptions of watches and of `interrupted` pass through.
    virtual Run simulate(const Task& task) const = 0;
    /// The solution again that was packed; its columns fit together.
    virtual std::shared_ptr<const Solution> solution(const PackedSolution& packed) const = 0;
    /// Follows every solution, `most` at most.
    virtual Runs simulate_all(const Task& task, int most) const = 0;
    /// For maps, orbits and bifurcations.
    virtual std::shared_ptr<const AnySystem> analysis(const Precision& precision) const = 0;
    /// What lanes need to run it.
    virtual std::shared_ptr<const AnyScalar> scalar() const = 0;
    /// For ensembles of a system that does not run in lanes; null for one that does, whose lanes
    /// are compiled for each instruction set.
    virtual std::shared_ptr<const AnyLanes> one_lane() const = 0;
    /// The tapes of a system of formulas, from which lanes are made; null for any other.
    virtual std::shared_ptr<const TapeProgram> tapes() const = 0;
    /// Exceptions of the task's own functions pass through.
    virtual DiagramColumns diagram(const DiagramTask& task) const = 0;
};

// What formulas cannot say, or not as fast; one translation unit each.
std::shared_ptr<const Model> oscillator();
std::shared_ptr<const Model> stiction();
std::shared_ptr<const Model> dieci_lopez_2_moments();

} // namespace filippov::python
