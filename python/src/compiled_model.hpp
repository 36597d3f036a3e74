// SPDX-License-Identifier: BSD-3-Clause
// A C++ system behind the interface of model.hpp.
#pragma once

#include "dense_solution.hpp"
#include "samples.hpp"

#include <filippov/engine/all_branches.hpp>
#include <filippov/methods/rodas5p.hpp>
#include <filippov/orbits/any_system.hpp>
#include <filippov/orbits/diagram_in_lanes.hpp>

#include <algorithm>
#include <string>
#include <utility>

namespace filippov::python {

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
            facts_.kinds.emplace_back(
                std::array{"switching", "kink", "jump", "direction",
                           "component"}[static_cast<std::size_t>(kind_of_surface(sys_, j))]);
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
        return columns(values_of(all, x0, d, task));
    }

private:
    /// See `WithSteps`.
    struct WithMethod {
        Method method;

        template <class Use> auto operator()(const Use& use) const {
            switch (method) {
            case Method::dopri5:
                return WithSteps<DormandPrince5, Sys, double>{}(use);
            case Method::dop853:
                return WithSteps<DormandPrince8, Sys, double>{}(use);
            default:
                return WithSteps<Rodas5P, Sys, double>{}(use);
            }
        }
    };
    std::vector<DiagramValue<double, N>> values_of(const std::vector<P>& params, const X& x0,
                                                   const DiagramSettings<double, N>& d,
                                                   const DiagramTask& task) const {
        const WithMethod with_steps{task.settings.method};
        if constexpr (single_v<Sys>)
            if (task.lanes != nullptr && with_steps.method != Method::rodas5p && lanes_know(d))
                return filippov::detail::diagram_by_members(
                    with_steps, sys_, params, x0, d, [&](Population<N, params_v<Sys>>& members) {
                        ErasedPopulation<N, params_v<Sys>> any(members);
                        task.lanes->run(params.size(), any, task.settings, d.parallel);
                    });
        return filippov::detail::diagram_by(with_steps, sys_, std::span<const P>(params), x0, d,
                                            Sections<>{});
    }
    DiagramColumns columns(const std::vector<DiagramValue<double, N>>& values) const {
        DiagramColumns c;
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
        const Settings<double, N> settings =
            filippov::detail::sized_settings<N>(task.settings, facts_.dim);
        const X x0 = padded<N>(task.x0, facts_.dim);
        const P p = params(task.params);
        Trajectory<Sys, double> kept = empty_trajectory(sys_, p, x0, settings);
        Recorder<Sys, double> recorder(kept, task.dense    ? Keep::dense
                                             : task.t_eval ? Keep::events
                                                           : Keep::steps);
        Observer<double, N, M> observer = recorder;
        std::optional<Samples<Sys>> samples;
        if (task.t_eval)
            observer = samples.emplace(kept, task).heard_with(observer);
        if (script != nullptr)
            observer = scripted(observer, *script);
        std::array<long long, max_watches> hits{};
        if (!task.watches.empty())
            observer.ends = [&](const Event<double, N, M>& event) {
                const auto q = std::size_t(event.surface);
                return event.kind == EventKind::section && ++hits[q] == task.watches[q].stop_after;
            };
        observer.stop = task.interrupted;
        recorder.finish(WithMethod{task.settings.method}([&](Steps<Sys, double>& steps) {
            return filippov::detail::flow_by<Sys, double>(steps, sys_, p, x0, task.t0, task.t_end,
                                                          settings, observer,
                                                          sections_of(task.watches));
        }));
        if (samples)
            samples->finish(kept.result);
        Run run = samples ? columns(*samples) : columns(kept);
        run.events = event_columns(kept.events);
        run.status = kept.result.status;
        run.message = kept.result.message();
        run.counters = kept.result.counters;
        kept.events.clear();
        if (task.dense)
            run.solution = std::make_shared<const DenseSolution<Sys>>(std::move(kept));
        return run;
    }
    static DynamicSections<double, N, params_v<Sys>>
    sections_of(const std::vector<Watch>& watches) {
        DynamicSections<double, N, params_v<Sys>> sections;
        for (const Watch& watch : watches)
            sections.all[std::size_t(sections.count++)] = {
                [&watch](double t, const X& x, const P&) { return watch.value(t, x.data()); },
                watch.direction};
        return sections;
    }
    template <class Points> Run columns(const Points& points) const {
        Run run;
        run.t = points.t;
        for (const X& x : points.x)
            append(run.x, x);
        for (const Mode<M>& mode : points.mode)
            append(run.mode, mode);
        return run;
    }
    EventColumns event_columns(const std::vector<Event<double, N, M>>& events) const {
        EventColumns log;
        for (const Event<double, N, M>& event : events) {
            log.t.push_back(event.t);
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
        return log;
    }
    void append(std::vector<double>& column, const X& x) const {
        column.insert(column.end(), x.begin(), x.begin() + facts_.dim);
    }
    void append(std::vector<signed char>& column, const Mode<M>& mode) const {
        column.insert(column.end(), mode.side.begin(), mode.side.begin() + facts_.surfaces);
    }

    const Sys sys_;
    Facts facts_;
};

template <class Sys> std::shared_ptr<const Model> bind_model(std::string name) {
    return std::make_shared<const CompiledModel<Sys>>(std::move(name));
}

} // namespace filippov::python
