// SPDX-License-Identifier: BSD-3-Clause
// A C++ system behind the interface of model.hpp.
#pragma once

#include "model.hpp"

#include <filippov/engine/all_branches.hpp>
#include <filippov/engine/trajectory.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/diagram.hpp>

#include <algorithm>
#include <string>
#include <utility>

namespace filippov::python {

/// The solution of a run as its dense pieces.
template <class Sys> class DenseSolution final : public Solution {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = Vec<double, N>;

    Trajectory<Sys, double> trajectory;

    DenseSolution(const Sys& sys, const Params<Sys, double>& p, const X& scale)
        : trajectory{sys, p, {}, {}, {}, {}, {}, {}, scale}, n_(component_count(sys)),
          m_(surface_count(sys)) {}

    std::span<const double> knots() const override { return trajectory.t; }
    void states(std::span<const double> times, std::span<double> out) const override {
        for (std::size_t k = 0; k < times.size(); ++k) {
            const X x = state(times[k]);
            std::copy_n(x.data(), n_, out.begin() + std::ptrdiff_t(k) * n_);
        }
    }
    void modes(std::span<const double> times, std::span<signed char> out) const override {
        for (std::size_t k = 0; k < times.size(); ++k) {
            const Mode<M> mode = mode_at(times[k]);
            std::copy_n(mode.side.data(), m_, out.begin() + std::ptrdiff_t(k) * m_);
        }
    }
    void blend(std::span<const double> times, std::span<double> out) const override {
        for (std::size_t k = 0; k < times.size(); ++k) {
            const double time = times[k];
            const Mode<M> mode = mode_at(time);
            const double T = period(trajectory.sys, trajectory.p);
            for (int j = 0; j < m_; ++j) {
                double& s = out[k * std::size_t(m_) + std::size_t(j)];
                s = mode[j];
                if (mode[j] != 0)
                    continue;
                const double local = Clock<double>::at(time, T).local;
                s = is_kind(trajectory.sys, j, SurfaceKind::jump)
                        ? std::numeric_limits<double>::quiet_NaN() // contact: a force, and no s
                        : sliding_margin(trajectory.sys, mode, j, local, state(time), trajectory.p)
                              .s;
            }
        }
    }

    PackedSolution packed() const override {
        PackedSolution all;
        const auto append = [&](std::vector<double>& column, const X& x) {
            column.insert(column.end(), x.begin(), x.begin() + n_);
        };
        all.params.assign(trajectory.p.begin(),
                          trajectory.p.begin() + given_params(trajectory.sys));
        append(all.scale, trajectory.scale);
        all.t = trajectory.t;
        for (const X& x : trajectory.x)
            append(all.x, x);
        for (const Mode<M>& mode : trajectory.mode)
            all.mode.insert(all.mode.end(), mode.side.begin(), mode.side.begin() + m_);
        for (const auto& piece : trajectory.pieces) {
            all.period.push_back(piece.clock.index);
            all.t_local.push_back(piece.clock.local);
            all.carry.push_back(piece.clock.carry);
            all.dt.push_back(piece.dt);
            append(all.x0, piece.x0);
            for (const X& c : piece.polynomial.c)
                append(all.polynomial, c);
            all.closed_form.push_back(piece.closed_form);
        }
        return all;
    }
    static std::shared_ptr<const Solution> of(const Sys& sys, const PackedSolution& all) {
        const int n = component_count(sys), m = surface_count(sys);
        const auto vector = [n](const std::vector<double>& column, std::size_t row,
                                double rest = 0.0) {
            return padded<N>(std::span(column).subspan(row * std::size_t(n)), n, rest);
        };
        const auto p = all_params<double>(sys, all.params);
        auto made = std::make_shared<DenseSolution>(sys, p, vector(all.scale, 0, 1.0));
        Trajectory<Sys, double>& kept = made->trajectory;
        kept.t = all.t;
        for (std::size_t k = 0; k < all.t.size(); ++k) {
            kept.x.push_back(vector(all.x, k));
            Mode<M> mode;
            for (int j = 0; j < M; ++j)
                mode.set(j, j < m ? all.mode[k * std::size_t(m) + std::size_t(j)] : 1);
            kept.mode.push_back(mode);
        }
        for (std::size_t k = 0; k < all.dt.size(); ++k) {
            DensePiece<double, N, M> piece{
                {filippov::period(sys, p), all.period[k], all.t_local[k], all.carry[k]},
                all.dt[k],
                vector(all.x0, k),
                kept.mode[k + 1],
                {},
                all.closed_form[k] != 0};
            for (std::size_t i = 0; i < solution_terms; ++i)
                piece.polynomial.c[i] = vector(all.polynomial, k * solution_terms + i);
            kept.pieces.push_back(piece);
        }
        return made;
    }

private:
    X state(double time) const {
        if (const auto k = knot(time))
            return trajectory.x[*k];
        return trajectory(time);
    }
    Mode<M> mode_at(double time) const {
        if (trajectory.pieces.empty())
            return trajectory.mode.front();
        return trajectory.mode_at(time);
    }
    /// The knot at exactly this time, the first if there are several: the value from before.
    std::optional<std::size_t> knot(double time) const {
        const auto& t = trajectory.t;
        const bool forward = t.back() >= t.front();
        const auto before = [forward](double a, double b) { return forward ? a < b : a > b; };
        const auto found = std::lower_bound(t.begin(), t.end(), time, before);
        if (found == t.end() || *found != time)
            return std::nullopt;
        return std::size_t(found - t.begin());
    }

    const int n_, m_; ///< components, surfaces
};

/// Keeps what the task asks for of a run.
template <class Sys> class Keeper {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = Vec<double, N>;

    Keeper(const Sys& sys, const Params<Sys, double>& p, const Task& task, const X& scale)
        : task_(task), n_(component_count(sys)), m_(std::size_t(surface_count(sys))),
          scratch_(std::make_shared<DenseSolution<Sys>>(sys, p, scale)) {
        if (task.dense)
            solution_ = std::make_shared<DenseSolution<Sys>>(sys, p, scale);
    }

    operator Observer<double, N, M>() & {
        return {.event = [this](const Event<double, N, M>& event) { on_event(event); },
                .step = [this](const StepView<double, N, M>& step,
                               const StepPath<double, N>& path) { on_step(step, path); },
                .stop = task_.interrupted};
    }

    /// The run as a whole, its last point the point where it ended.
    Run finish(const FlowResult<double, N, M>& result) {
        run_.status = result.status;
        run_.message = result.message();
        run_.counters = result.counters;
        if constexpr (has_jumps_v<Sys>) // a jump in the last instant
            keep_moved(result.clock, result.t, result.x, result.mode);
        if (result.status == Status::ok) {
            run_.events.t.back() = task_.t_end;
            if (solution_ && stepped_)
                solution_->trajectory.t.back() = task_.t_end;
            if (!task_.t_eval && stepped_)
                run_.t.back() = task_.t_end;
            while (next_time_) {
                keep(*next_time_, result.x, last_mode_);
                advance_times();
            }
        } else if (task_.t_eval && (run_.t.empty() || run_.t.back() != result.t)) {
            keep(result.t, result.x, last_mode_);
        }
        run_.solution = solution_;
        return std::move(run_);
    }

private:
    void on_event(const Event<double, N, M>& event) {
        if (event.kind == EventKind::start)
            start(event);
        EventColumns& log = run_.events;
        // The clock rounds when it turns absolute time into periods and back; the ends are given.
        log.t.push_back(event.kind == EventKind::start ? task_.t0 : event.t);
        log.t_local.push_back(event.t_local);
        log.period.push_back(event.period);
        log.kind.push_back(int(event.kind));
        log.surface.push_back(event.surface);
        log.s.push_back(event.s);
        log.contacts.push_back(event.contacts);
        log.alternatives.push_back(event.alternatives);
        append(log.x_left, event.x_left);
        append(log.x_right, event.x_right);
        append(log.mode_before, event.mode_before);
        append(log.mode_after, event.mode_after);
    }

    void on_step(const StepView<double, N, M>& step, const StepPath<double, N>& path) {
        Clock<double> end = step.clock;
        end.advance(step.dt);
        const double t1 = end.absolute();
        last_mode_ = step.mode;
        if (!stepped_)
            set_first_mode(step.mode);
        if constexpr (has_jumps_v<Sys>)
            keep_moved(step.clock, step.clock.absolute(), step.x0, step.mode);
        const bool forward = task_.t_end >= task_.t0;
        const bool wanted = next_time_ && (forward ? *next_time_ <= t1 : *next_time_ >= t1);
        if (solution_ || wanted) {
            DensePiece<double, N, M> piece{step.clock, step.dt, step.x0, step.mode, {}, false};
            for (auto& c : piece.polynomial.c)
                c.setZero();
            path.store(piece);
            if (wanted)
                keep_times(piece, t1, step.x1);
            if (solution_) {
                auto& kept = solution_->trajectory;
                kept.t.push_back(t1);
                kept.x.push_back(step.x1);
                kept.mode.push_back(step.mode);
                kept.pieces.push_back(piece);
            }
        }
        if (!task_.t_eval)
            keep(t1, step.x1, step.mode);
    }

    /// Keeps a state to which the solution jumped: after a jump the time is there twice, with the
    /// states before and after.
    void keep_moved(const Clock<double>& clock, double t, const Vec<double, N>& x,
                    const Mode<M>& mode) {
        const auto moved = [&](const double* last) {
            return !std::equal(x.begin(), x.begin() + n_, last);
        };
        if (solution_ && moved(solution_->trajectory.x.back().data())) {
            auto& kept = solution_->trajectory;
            kept.t.push_back(t);
            kept.x.push_back(x);
            kept.mode.push_back(mode);
            kept.pieces.push_back(resting_piece(clock, x, mode));
        }
        if (!task_.t_eval && !run_.x.empty() &&
            moved(run_.x.data() + run_.x.size() - std::size_t(n_)))
            keep(t, x, mode);
    }
    void append(std::vector<double>& column, const X& x) const {
        column.insert(column.end(), x.begin(), x.begin() + n_);
    }
    void append(std::vector<signed char>& column, const Mode<M>& mode) const {
        column.insert(column.end(), mode.side.begin(), mode.side.begin() + std::ptrdiff_t(m_));
    }
    void keep(double t, const X& x, const Mode<M>& mode) {
        run_.t.push_back(t);
        append(run_.x, x);
        append(run_.mode, mode);
    }
    void advance_times() {
        ++n_times_;
        next_time_.reset();
        if (task_.t_eval && n_times_ < task_.t_eval->size())
            next_time_ = (*task_.t_eval)[n_times_];
    }
    void start(const Event<double, N, M>& event) {
        last_mode_ = event.mode_after;
        if (solution_) {
            auto& kept = solution_->trajectory;
            kept.t.push_back(task_.t0);
            kept.x.push_back(event.x_right);
            kept.mode.push_back(event.mode_after);
        }
        if (!task_.t_eval)
            keep(task_.t0, event.x_right, event.mode_after);
        if (task_.t_eval && !task_.t_eval->empty())
            next_time_ = task_.t_eval->front();
        while (next_time_ && *next_time_ == task_.t0) {
            keep(task_.t0, event.x_right, event.mode_after);
            advance_times();
        }
    }
    /// The first point has the mode of the first step.
    void set_first_mode(const Mode<M>& mode) {
        stepped_ = true;
        for (std::size_t i = 0; i < run_.mode.size(); ++i)
            run_.mode[i] = mode.side[i % m_];
        if (solution_)
            solution_->trajectory.mode.front() = mode;
    }
    void keep_times(const DensePiece<double, N, M>& piece, double t1, const X& x1) {
        // One piece as a trajectory of its own: output times and `sol` are the same arithmetic.
        auto& one = scratch_->trajectory;
        one.t = {piece.clock.absolute(), t1};
        one.pieces = {piece};
        const bool forward = task_.t_end >= task_.t0;
        while (next_time_ && (forward ? *next_time_ <= t1 : *next_time_ >= t1)) {
            const double time = *next_time_;
            keep(time, time == t1 ? x1 : one(within(time, one.t)), piece.mode);
            advance_times();
        }
    }
    static double within(double time, const std::vector<double>& ends) {
        return std::clamp(time, std::min(ends[0], ends[1]), std::max(ends[0], ends[1]));
    }

    const Task& task_;
    const int n_;         ///< components
    const std::size_t m_; ///< surfaces
    std::shared_ptr<DenseSolution<Sys>> solution_, scratch_;
    std::optional<double> next_time_;
    std::size_t n_times_ = 0;
    Mode<M> last_mode_{};
    bool stepped_ = false;
    Run run_;
};

/// The task's event functions as the engine's sections.
struct Watches {
    static constexpr int capacity = max_watches;
    std::span<const Watch> all;
    mutable std::array<long long, capacity> hits{};

    int size() const { return int(all.size()); }
    template <class X, class P> double value(int q, double t, const X& x, const P&) const {
        return all[std::size_t(q)].value(t, x.data());
    }
    int direction(int q) const { return all[std::size_t(q)].direction; }
    /// The engine asks once for every occurrence it logs.
    bool terminal(int q) const { return ++hits[std::size_t(q)] == all[std::size_t(q)].stop_after; }
};

template <class Sys> class CompiledModel final : public Model {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = Vec<double, N>;
    using P = Params<Sys, double>;

    /// A model with names of its own.
    explicit CompiledModel(std::string name)
        : CompiledModel(std::move(name), Sys{}, {Sys::state.begin(), Sys::state.end()}) {}
    CompiledModel(std::string name, Sys sys, std::vector<std::string> state)
        : sys_(std::move(sys)) {
        facts_.name = std::move(name);
        facts_.dim = component_count(sys_);
        facts_.surfaces = surface_count(sys_);
        facts_.state = std::move(state);
        facts_.params = param_names(sys_);
        facts_.defaults = default_values(sys_);
        const auto found = [&](bool has, const char* what) {
            if (has)
                facts_.capabilities.emplace_back(what);
        };
        for (int j = 0; j < facts_.surfaces; ++j)
            facts_.kinds.emplace_back(is_kind(sys_, j, SurfaceKind::jump)   ? "jump"
                                      : is_kind(sys_, j, SurfaceKind::kink) ? "kink"
                                                                            : "switching");
        found(HasField<Sys, double>, "field");
        found(HasRegions<Sys, double>, "region");
        found(selection_v<Sys> == Selection::moments, "moments");
        found(HasGradH<Sys, double> || HasGradients<Sys, double>, "grad_h");
        found(HasHt<Sys, double> || HasGradients<Sys, double>, "h_t");
        found(HasEquivalentControl<Sys, double>, "equivalent_control");
        found(slides_in_closed_form<double>(sys_), "sliding_flow");
        found(is_forced<double>(sys_), "period");
        found(HasSMax<Sys, double>, "s_max");
    }

    const Facts& facts() const override { return facts_; }
    double period(std::span<const double> p) const override {
        return filippov::period(sys_, params(p));
    }
    void h(std::span<const double> t, std::span<const double> x, std::span<const double> p,
           std::span<double> out) const override {
        const P q = params(p);
        each(t, x, [&](std::size_t k, double time, const X& y) {
            const Vec<double, M> value = switching(sys_, time, y, q);
            std::copy_n(value.data(), facts_.surfaces,
                        out.begin() + std::ptrdiff_t(k) * facts_.surfaces);
        });
    }
    void field(std::span<const double> t, std::span<const double> x, std::span<const int> side,
               std::span<const double> p, std::span<double> out) const override {
        const P q = params(p);
        const Mode<M> mode = mode_of(side);
        each(t, x, [&](std::size_t k, double time, const X& y) {
            const X f = mode_field(sys_, mode, time, y, q);
            std::copy_n(f.data(), facts_.dim, out.begin() + std::ptrdiff_t(k) * facts_.dim);
        });
    }
    void jacobian(std::span<const double> t, std::span<const double> x, std::span<const int> side,
                  std::span<const double> p, std::span<double> out) const override {
        const P q = params(p);
        const Mode<M> mode = mode_of(side);
        each(t, x, [&](std::size_t k, double time, const X& y) {
            const auto f = [&](const auto& tau, const auto& z, const auto& r) {
                return mode_field(sys_, mode, tau, z, r);
            };
            const Mat<double, N, N> J = filippov::jacobian(f, time, y, q);
            const int n = facts_.dim;
            for (int r = 0; r < n; ++r)
                for (int c = 0; c < n; ++c)
                    out[k * std::size_t(n * n) + std::size_t(r * n + c)] = J(r, c);
        });
    }
    void normal_components(std::span<const double> t, std::span<const double> x, int surface,
                           std::span<const int> side, std::span<const double> p,
                           std::span<double> out) const override {
        const P q = params(p);
        const Mode<M> mode = mode_of(side);
        each(t, x, [&](std::size_t k, double time, const X& y) {
            const Sides<Sys, double> b = both_sides(sys_, mode, surface, time, y, q);
            out[2 * k] = b.l1;
            out[2 * k + 1] = b.l2;
        });
    }
    void project(std::span<const double> t, std::span<const double> x, int surface,
                 std::span<const double> p, std::span<double> out) const override {
        const P q = params(p);
        each(t, x, [&](std::size_t k, double time, const X& y) {
            const X z = filippov::project(sys_, surface, time, y, q, X(X::Ones()));
            std::copy_n(z.data(), facts_.dim, out.begin() + std::ptrdiff_t(k) * facts_.dim);
        });
    }

    Run simulate(const Task& task) const override { return run(task, nullptr); }

    std::shared_ptr<const Solution> solution(const PackedSolution& packed) const override {
        return DenseSolution<Sys>::of(sys_, packed);
    }

    Runs simulate_all(const Task& task, int most) const override {
        Runs runs;
        Script<double, M> script;
        do {
            if (int(runs.all.size()) == most) {
                runs.complete = false;
                break;
            }
            runs.all.push_back(run(task, &script));
        } while (runs.all.back().status != Status::interrupted && script.next());
        runs.complete = runs.complete && script.complete();
        return runs;
    }

    std::shared_ptr<const AnySystem> analysis(const Precision& precision) const override {
        return any_system(sys_, precision);
    }
    std::shared_ptr<const AnyScalar> scalar() const override { return any_scalar(sys_); }
    std::shared_ptr<const AnyLanes> one_lane() const override {
        if constexpr (RunsInLanes<Sys>)
            return nullptr;
        else
            return any_lanes<1>(sys_);
    }
    std::shared_ptr<const TapeProgram> tapes() const override {
        if constexpr (requires { sys_.tapes(); })
            return sys_.tapes();
        else
            return nullptr;
    }
    DiagramColumns diagram(const DiagramTask& task) const override {
        switch (task.settings.method) {
        case Method::dopri5:
            return diagram<DormandPrince5>(task);
        case Method::dop853:
            return diagram<DormandPrince8>(task);
        default:
            return diagram<Rodas5P>(task);
        }
    }

private:
    template <class Tableau> DiagramColumns diagram(const DiagramTask& task) const {
        const std::size_t given = facts_.params.size();
        std::vector<P> all(task.params.size() / std::max<std::size_t>(given, 1));
        for (std::size_t i = 0; i < all.size(); ++i)
            all[i] = params(std::span(task.params).subspan(i * given));
        DiagramSettings<double, N> d;
        d.run = filippov::detail::sized_settings<N>(task.settings, facts_.dim);
        d.section.strobe = task.kinds.empty();
        d.section.events = {};
        for (const int kind : task.kinds)
            d.section.events.add(static_cast<EventKind>(kind));
        d.section.surface = task.surface;
        d.section.direction = task.direction;
        d.transient = task.transient;
        d.keep = task.keep;
        d.follow = task.follow;
        d.chains = task.chains;
        d.skip_repeats = task.skip_repeats;
        d.parallel = task.parallel;
        const X x0 = padded<N>(task.x0, facts_.dim);
        return columns(bifurcation_diagram<Tableau>(sys_, std::span<const P>(all), x0, d));
    }
    DiagramColumns columns(const std::vector<DiagramValue<double, N>>& values) const {
        DiagramColumns c;
        const auto append = [&](std::vector<double>& column, const X& x) {
            column.insert(column.end(), x.begin(), x.begin() + facts_.dim);
        };
        for (std::size_t i = 0; i < values.size(); ++i) {
            for (const DiagramPoint<double, N>& point : values[i].points) {
                c.value.push_back(static_cast<long long>(i));
                c.period.push_back(point.period);
                c.t_local.push_back(point.t_local);
                append(c.x, point.x);
                c.kind.push_back(static_cast<int>(point.kind));
                c.surface.push_back(point.surface);
                c.boundary.push_back(static_cast<signed char>(point.boundary));
            }
            c.forcing.push_back(values[i].period);
            append(c.x_end, values[i].x_end);
            c.cycle.push_back(values[i].cycle);
            c.skipped.push_back(values[i].skipped);
            c.status.emplace_back(name(values[i].status));
            c.message.push_back(values[i].message);
            c.counters += values[i].counters;
        }
        return c;
    }
    P params(std::span<const double> p) const { return all_params<double>(sys_, p); }
    Mode<M> mode_of(std::span<const int> side) const {
        Mode<M> mode;
        for (int j = 0; j < M; ++j)
            mode.set(j, j < facts_.surfaces ? side[std::size_t(j)] : 1);
        return mode;
    }
    template <class Use>
    void each(std::span<const double> t, std::span<const double> x, Use use) const {
        const auto n = std::size_t(facts_.dim);
        for (std::size_t k = 0; k < x.size() / n; ++k) {
            const X y = padded<N>(x.subspan(k * n, n), facts_.dim);
            use(k, t.size() == 1 ? t[0] : t[k], y);
        }
    }
    /// @param script  what to choose where the solution is not unique; null: by the policy
    Run run(const Task& task, Script<double, M>* script) const {
        switch (task.settings.method) {
        case Method::dopri5:
            return run<DormandPrince5>(task, script);
        case Method::dop853:
            return run<DormandPrince8>(task, script);
        default:
            return run<Rodas5P>(task, script);
        }
    }
    template <class Tableau> Run run(const Task& task, Script<double, M>* script) const {
        const Settings<double, N> settings =
            filippov::detail::sized_settings<N>(task.settings, facts_.dim);
        const X x0 = padded<N>(task.x0, facts_.dim);
        X scale;
        for (int i = 0; i < N; ++i)
            scale[i] = std::max(settings.atol[i] + settings.rtol * std::abs(x0[i]),
                                std::numeric_limits<double>::min() / epsilon<double>);
        const P p = params(task.params);
        Keeper<Sys> keeper(sys_, p, task, scale);
        Observer<double, N, M> observer = keeper;
        if (script != nullptr)
            observer = scripted(observer, *script);
        return keeper.finish(flow<Tableau>(sys_, p, x0, task.t0, task.t_end, settings, observer,
                                           Watches{task.watches, {}}));
    }

    const Sys sys_;
    Facts facts_;
};

template <class Sys> std::shared_ptr<const Model> bind_model(std::string name) {
    return std::make_shared<const CompiledModel<Sys>>(std::move(name));
}

} // namespace filippov::python
