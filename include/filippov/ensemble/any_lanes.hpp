// SPDX-License-Identifier: BSD-3-Clause
// Ensembles of a system whose type is forgotten: what pictures of basins need of one.
#pragma once

#include <filippov/ensemble/any_scalar.hpp>
#include <filippov/ensemble/ensemble.hpp>

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

namespace filippov {

/// Where a member begins and ends, to be filled in.
struct MemberView {
    std::span<double> x, p; ///< shapes (dim,), (params,)
    double t0 = 0, t_end = 0;
};

/// How a member stands, or ended: see Outcome.
struct OutcomeView {
    Status status = Status::ok;
    Clock<double> clock{};
    std::span<const double> x; ///< shape (dim,)
    int mode = 0;
    std::int32_t events = 0, slides = 0;
    double slide_time = 0;
    long long steps = 0;
};

/// What happened to a member: see MemberEvent.
struct MemberEventView {
    EventKind kind = EventKind::cross;
    int surface = 0;
    int before = 0, after = 0;
    Clock<double> clock{};
    std::span<const double> x; ///< shape (dim,)
};

/// Where members come from and go to: see Population.
class AnyPopulation {
public:
    virtual ~AnyPopulation() = default;
    AnyPopulation() = default;
    AnyPopulation(const AnyPopulation&) = delete;
    AnyPopulation& operator=(const AnyPopulation&) = delete;

    virtual void member(std::size_t id, MemberView& member) = 0;
    virtual bool goes_on(std::size_t, const OutcomeView&) { return false; }
    virtual double leg(std::size_t) { return 0; }
    virtual void hear(std::size_t, const MemberEventView&) {}
    virtual void take(std::size_t id, const OutcomeView& outcome) = 0;

    bool same_params = false, ends_at_exit = false, hears = false;
    std::size_t at_once = 0;
    std::vector<double> escape{}; ///< shape (dim,), or empty: no bounds
};

/// A population of vectors of N components, of which a system has the first few, and of P
/// parameters, of which the first few are given, as one whose sizes are forgotten. It has no bounds
/// of escape.
template <int N, int P> class ErasedPopulation final : public AnyPopulation {
public:
    explicit ErasedPopulation(Population<N, P>& population) : population_(population) {
        same_params = population.same_params;
        ends_at_exit = population.ends_at_exit;
        hears = population.hears;
        at_once = population.at_once;
    }
    void member(std::size_t id, MemberView& view) override {
        const Member<N, P> m = population_.member(id);
        std::copy_n(m.x.data(), view.x.size(), view.x.begin());
        std::copy_n(m.p.data(), view.p.size(), view.p.begin());
        view.t0 = m.t0;
        view.t_end = m.t_end;
    }
    bool goes_on(std::size_t id, const OutcomeView& o) override {
        return population_.goes_on(id, sized(o));
    }
    double leg(std::size_t id) override { return population_.leg(id); }
    void hear(std::size_t id, const MemberEventView& e) override {
        population_.hear(id, {e.kind, e.surface, e.before, e.after, e.clock, sized(e.x)});
    }
    void take(std::size_t id, const OutcomeView& o) override { population_.take(id, sized(o)); }

private:
    static Vec<double, N> sized(std::span<const double> x) { return padded<N>(x, int(x.size())); }
    static Outcome<N> sized(const OutcomeView& o) {
        return {o.status, o.clock, sized(o.x), o.mode, o.events, o.slides, o.slide_time, o.steps};
    }
    Population<N, P>& population_;
};

/// See the top of the file.
class AnyLanes {
public:
    virtual ~AnyLanes() = default;
    AnyLanes() = default;
    AnyLanes(const AnyLanes&) = delete;
    AnyLanes& operator=(const AnyLanes&) = delete;

    virtual int dim() const = 0;
    virtual int params() const = 0;
    /// How many lanes a register has; 1 for a system that does not run in lanes.
    virtual int width() const = 0;
    /// See `run_population`.
    virtual PopulationRun run(std::size_t n, AnyPopulation& population, const RunSettings& settings,
                              const Parallel& how) const = 0;
};

namespace detail {

template <class Sys, int W> class ErasedLanes final : public AnyLanes {
    static constexpr int N = dim_v<Sys>, P = params_v<Sys>;

    /// A population of the system's own sizes.
    class Sized final : public Population<N, P> {
    public:
        Sized(const Sys& sys, AnyPopulation& any) : sys_(sys), any_(any) {
            this->same_params = any.same_params;
            this->ends_at_exit = any.ends_at_exit;
            this->hears = any.hears;
            this->at_once = any.at_once;
            if (!any.escape.empty())
                this->escape = padded<N>(any.escape, component_count(sys));
        }
        Member<N, P> member(std::size_t id) override {
            Member<N, P> m;
            m.x.setZero();
            MemberView view{{m.x.data(), std::size_t(component_count(sys_))},
                            {m.p.data(), std::size_t(given_params(sys_))}};
            any_.member(id, view);
            m.p = all_params<double>(sys_, view.p);
            m.t0 = view.t0;
            m.t_end = view.t_end;
            return m;
        }
        bool goes_on(std::size_t id, const Outcome<N>& o) override {
            return any_.goes_on(id, view(o));
        }
        double leg(std::size_t id) override { return any_.leg(id); }
        void hear(std::size_t id, const MemberEvent<N>& e) override {
            any_.hear(id, {e.kind, e.surface, e.before, e.after, e.clock, components(e.x)});
        }
        void take(std::size_t id, const Outcome<N>& o) override { any_.take(id, view(o)); }

    private:
        OutcomeView view(const Outcome<N>& o) const {
            return {o.status, o.clock,  components(o.x), o.mode,
                    o.events, o.slides, o.slide_time,    o.steps};
        }
        std::span<const double> components(const Vec<double, N>& x) const {
            return {x.data(), std::size_t(component_count(sys_))};
        }
        const Sys& sys_;
        AnyPopulation& any_;
    };

public:
    ErasedLanes(Sys sys, std::shared_ptr<const AnyScalar> scalar)
        : sys_(std::move(sys)), scalar_(std::move(scalar)) {
        if (scalar_->dim() != N || scalar_->params() != P)
            refuse("scalar->dim()", scalar_->dim(),
                   "expected the scalar engine of the same system, of dim " + std::to_string(N) +
                       " and " + std::to_string(P) + " parameters");
    }

    int dim() const override { return component_count(sys_); }
    int params() const override { return given_params(sys_); }
    int width() const override { return RunsInLanes<Sys> ? W : 1; }
    PopulationRun run(std::size_t n, AnyPopulation& population, const RunSettings& settings,
                      const Parallel& how) const override {
        if (!population.escape.empty() && population.escape.size() != std::size_t(dim()))
            refuse("escape.size()", double(population.escape.size()), "expected dim entries");
        Sized sized(sys_, population);
        const auto own = sized_settings<N>(settings, dim());
        const auto engine =
            std::static_pointer_cast<const ScalarEngine<N, P>>(scalar_->engine(settings));
        return settings.method == Method::dop853
                   ? run_population<DormandPrince8, W>(sys_, n, sized, own, *engine, how)
                   : run_population<DormandPrince5, W>(sys_, n, sized, own, *engine, how);
    }

private:
    const Sys sys_;
    const std::shared_ptr<const AnyScalar> scalar_;
};

} // namespace detail

/// Forgets the type of a system.
/// @tparam W      lanes
/// @param scalar  of the same system; it may have been compiled elsewhere
template <int W = native_lanes, class Sys>
std::shared_ptr<const AnyLanes> any_lanes(const Sys& sys, std::shared_ptr<const AnyScalar> scalar) {
    require_system<Sys>();
    return std::make_shared<detail::ErasedLanes<Sys, W>>(sys, std::move(scalar));
}
template <int W = native_lanes, class Sys>
std::shared_ptr<const AnyLanes> any_lanes(const Sys& sys) {
    return any_lanes<W>(sys, any_scalar(sys));
}

} // namespace filippov
