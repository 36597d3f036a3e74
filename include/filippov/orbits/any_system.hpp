// SPDX-License-Identifier: BSD-3-Clause
// A system whose type is forgotten, behind the interface of system_interface.hpp: below it
// everything is compiled for the system, with nothing virtual in a step.
#pragma once

#include <filippov/engine/variation.hpp>
#include <filippov/methods/dormand_prince8.hpp>
#include <filippov/orbits/detail/sampled_minima.hpp>
#include <filippov/orbits/system_interface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace filippov {

namespace detail {

/// Steps of an arc. One that takes more leads far from the orbit that is looked for.
inline constexpr long long most_arc_steps = 100'000;

/// Taylor series long enough for short arcs.
inline constexpr int rise_order = 9;

/// How many terms of the series of a rise there are; 0 if they are too few, or tau too long.
/// @param c  h', h'', ...; of functions that are known by their values there are five
inline int terms_of_rise(const std::array<double, rise_order>& c, int order, double tau) {
    int terms = 0;
    while (terms < rise_order && std::isfinite(c[std::size_t(terms)]))
        ++terms;
    if (terms <= order)
        return 0;
    // The last terms stand for the remainder.
    double largest = 0, last = 0, factor = 1;
    for (int k = 1; k <= terms; ++k) {
        factor *= k > order ? tau / k : 1.0 / k;
        if (k < order)
            continue;
        const double term = std::abs(c[std::size_t(k - 1)]) * factor;
        largest = std::max(largest, term);
        if (k >= rise_order - 1 || k == terms)
            last += term;
    }
    return last <= (terms == rise_order ? 1e-16 : 1e-8) * largest ? terms : 0;
}

template <class Sys, class Tableau> class ErasedSystem final : public AnySystem {
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    static constexpr int P = params_v<Sys>;
    /// Directions of the duals: (x, a, b). Those of a flow's times are known without; that of a
    /// point's time is in place of a parameter that does not move, or is asked for by itself.
    static constexpr int directions = N + 2;
    using X = Vec<double, N>;

public:
    ErasedSystem(Sys sys, const Precision& precision)
        : sys_(std::move(sys)), n_(component_count(sys_)), interrupted_(precision.interrupted) {
        settings_.rtol = precision.rtol;
        settings_.atol = AbsoluteTolerance<double, N>(precision.atol);
        settings_.max_steps = precision.max_steps;
        validate(settings_);
    }

    int dim() const override { return n_; }
    std::vector<SurfaceKind> kinds() const override {
        std::vector<SurfaceKind> all;
        for (int j = 0; j < surface_count(sys_); ++j)
            all.push_back(kind_of_surface(sys_, j));
        return all;
    }
    std::vector<std::string> params() const override { return param_names(sys_); }
    Vector defaults() const override {
        const std::vector<double> values = default_values(sys_);
        Vector all(Eigen::Index(values.size()));
        for (std::size_t i = 0; i < values.size(); ++i)
            all[Eigen::Index(i)] = values[i];
        return all;
    }
    double rtol() const override { return settings_.rtol; }
    bool forced() const override { return is_forced<double>(sys_); }
    PeriodJet period(const Vector& p, const Directions& along) const override {
        using Inner = Dual<double, 2>;
        using D = Dual<Inner, 2>;
        std::vector<D> q(sized(p).begin(), p.end());
        for (int k = 0; k < 2; ++k)
            if (const int i = moving_parameter(along, k); i >= 0) {
                D& moves = q[std::size_t(i)];
                moves = D(Inner::variable(p[i], k));
                moves.d[std::size_t(k)] = Inner(1);
            }
        const D T = filippov::period(sys_, all_params<D>(sys_, q));
        PeriodJet jet;
        jet.value = T.v.v;
        for (std::size_t k = 0; k < 2; ++k) {
            jet.slope[k] = T.d[k].v;
            jet.bend[k] = T.d[k].d;
        }
        return jet;
    }
    double s_max(const Vector& p) const override { return filippov::s_max(sys_, values_of(p)); }
    Vector field(int mode, double t, const Vector& x, const Vector& p) const override {
        return cut(field_of(mode)(t, point(x), values_of(p)));
    }

    Jet rate(int mode, double t, const Vector& x, const Vector& p,
             const Directions& along) const override {
        return jet_at(t, x, p, along,
                      [&]<class D>(const D& time, const Vec<D, N>& y, const Vec<D, P>& q) {
                          return Vec<D, N>(field_of(mode)(time, y, q));
                      });
    }
    Jet quantity(const Quantity& q, double t, const Vector& x, const Vector& p,
                 const Directions& along) const override {
        return jet_at(t, x, p, along,
                      [&]<class D>(const D& time, const Vec<D, N>& y, const Vec<D, P>& r) {
                          return Vec<D, 1>(quantity_of(q, time, y, r));
                      });
    }

    Jet arc(int mode, double t0, const Vector& x, double t1, const Vector& p,
            const Directions& along) const override {
        if (!finite(t0, x, t1, p))
            return nowhere();
        auto settings = settings_;
        settings.max_steps = std::min(settings.max_steps, most_arc_steps);
        return with_scalar(along, [&]<class D>(const D*) {
            const auto r = segment<Tableau>(sys_, params_of<D>(p, along), mode_with(mode),
                                            state_of<D>(x, along), moving<D>(t0, n_, along),
                                            moving<D>(t1, n_ + 1, along), settings, interrupted_);
            counters_ += r.run.counters;
            Jet result = jet(r.x, along);
            result.status = r.run.status;
            depend_on_start_time(mode, t0, x, p, along, result);
            depend_on_end_time(mode, t1, r.x, p, along, result);
            return result;
        });
    }

    std::optional<Jet> rise(int side, int order, double t0, const Vector& x, double t1,
                            const Vector& p, const Directions& along) const override {
        if constexpr (M == 1)
            return rise_of_one(side, order, t0, x, t1, p, along);
        else
            return std::nullopt;
    }

    std::vector<Least> minima(int mode, double t0, const Vector& x, double t1,
                              const Vector& p) const override {
        if (!single_v<Sys>)
            throw std::logic_error("filippov: minima of a segment are for one surface");
        if (!finite(t0, x, t1, p))
            return {};
        const std::vector<Sample<N>> samples = samples_of(mode, t0, x, t1, p);
        std::vector<Least> found;
        if (samples.size() < 2)
            return found;
        const auto look = [&](std::size_t which, int side) {
            const Quantity slope{mode != 0 ? Quantity::Kind::h : Quantity::Kind::margin, side, 1};
            const auto rate = [&](const Sample<N>& sample) {
                return (mode != 0 ? mode : 1) *
                       quantity_of(slope, sample.t, sample.x, values_of(p));
            };
            for (const auto& least :
                 sampled_minima(samples, which, rate(samples.front()), rate(samples.back())))
                found.push_back({least.t, cut(least.x), least.value, side});
        };
        if (mode != 0) {
            look(0, mode);
        } else {
            look(0, -1);
            look(1, +1);
        }
        return found;
    }

    History run(double t0, const Vector& x, double t_end, const Vector& p) const override {
        History history;
        const auto keep = [&](const Event<double, N, M>& e) {
            if (e.kind != EventKind::start && e.kind != EventKind::end)
                history.events.push_back(happening(e));
        };
        const auto r = flow<Tableau>(sys_, values_of(p), point(x), t0, t_end, settings_,
                                     {.event = keep, .stop = interrupted_});
        counters_ += r.counters;
        history.status = r.status;
        history.message = r.message();
        history.t = r.t;
        history.x = cut(r.x);
        history.mode = code_of(r.mode);
        history.surfaces = surfaces();
        history.counters = r.counters;
        return history;
    }

    Journey journey(const Leg& leg, const Vector& p, const Directions& along) const override {
        using D = Dual<double, directions>;
        Journey journey;
        Traveller traveller{*this, leg, journey};
        KnownStart<M> known;
        known.held = leg.held;
        if (leg.boundary != 0)
            known.guard = leg.boundary < 0 ? Guard<M>::below(0) : Guard<M>::above(0);
        const auto r = flow<Tableau>(sys_, params_of<D>(p, along), state_of<D>(leg.x, along),
                                     D(leg.t0), D(leg.t_end), settings_, traveller, {}, known);
        counters_ += r.run.counters;
        journey.status = r.run.status;
        journey.message = r.run.message();
        journey.singular = r.singular;
        Vec<D, N + 1> end;
        for (int i = 0; i < n_; ++i)
            end[i] = r.x[i];
        end[n_] = r.t;
        journey.end = jet(end, along);
        journey.end.status = r.run.status;
        if (journey.word.empty())
            return journey;
        depend_on_start_time(journey.first, leg.t0, leg.x, p, along, journey.end);
        if (r.run.status == Status::ok) {
            depend_on_end_time(code_of(r.run.mode), leg.t_end, r.x, p, along, journey.end);
            journey.end.slope(n_, n_ + 1) = 1;
        }
        return journey;
    }

    bool interrupted() const override { return interrupted_ && interrupted_(); }
    Counters counters() const override { return counters_; }

private:
    /// Observer of a journey.
    struct Traveller {
        const ErasedSystem& system;
        const Leg& leg;
        Journey& journey;

        operator Observer<double, N, M>() & {
            return {.event = [this](const Event<double, N, M>& e) { on_event(e); },
                    .ends =
                        [this](const Event<double, N, M>& e) {
                            return leg.ends && leg.ends(system.happening(e));
                        },
                    .stop = system.interrupted_};
        }

    private:
        void on_event(const Event<double, N, M>& e) {
            if (e.kind == EventKind::end)
                return;
            if (e.kind != EventKind::start && e.mode_before == e.mode_after)
                return;
            if (journey.word.empty())
                journey.first = system.code_of(e.mode_after);
            else if (system.surfaces() > 1)
                journey.word += ' ';
            journey.last = system.code_of(e.mode_after);
            journey.word += mode_text(journey.last, system.surfaces());
            journey.slides += e.mode_after.sliding() > 0;
            journey.lost = std::max(journey.lost, lost_in(e.mode_after));
        }
        /// Sliding leaves the directions of the surface, contact also fixes the speed.
        int lost_in(const Mode<M>& mode) const {
            int lost = 0;
            for (int j = 0; j < M; ++j)
                if (mode[j] == 0)
                    lost += is_kind(system.sys_, j, SurfaceKind::jump) ? 2 : 1;
            return std::min(lost, system.n_);
        }
    };
    Happening happening(const Event<double, N, M>& e) const {
        return {e.kind, e.t,       cut(e.x_left), code_of(e.mode_before), code_of(e.mode_after),
                e.s,    e.surface, e.contacts};
    }
    /// An iteration may go anywhere; a run that cannot begin is a status like any other.
    static bool finite(double t0, const Vector& x, double t1, const Vector& p) {
        return x.allFinite() && p.allFinite() && std::isfinite(t0) && std::isfinite(t1);
    }
    Jet nowhere() const {
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        return {Vector::Constant(n_, nan), Matrix::Constant(n_, n_ + 4, nan),
                Matrix::Constant(n_, n_ + 4, nan), Status::not_finite};
    }
    std::optional<Jet> rise_of_one(int side, int order, double t0, const Vector& x, double t1,
                                   const Vector& p, const Directions& along) const {
        const auto plain = lie_derivatives<rise_order>(field_of(side), h_of(0), local(t0, p),
                                                       point(x), values_of(p));
        const int terms = terms_of_rise(plain, order, std::abs(t1 - t0));
        if (along.v != nullptr || terms == 0)
            return std::nullopt;
        // the sum over k >= order of c_k tau^(k - order)/k!, and its derivative
        double slope = 0;
        const auto sum_of = [&]<class D>(const D& time, const Vec<D, N>& y, const Vec<D, P>& q) {
            const auto c = lie_derivatives<rise_order>(field_of(side), h_of(0), time, y, q);
            D sum(0.0);
            slope = 0;
            double power = 1, power_before = 0, factorial = 1;
            for (int k = 1; k <= terms; ++k) {
                factorial *= k;
                if (k < order)
                    continue;
                const D& term = c[std::size_t(k - 1)];
                sum += term * (power / factorial);
                slope += term.v * ((k - order) * power_before / factorial);
                power_before = power;
                power *= t1 - t0;
            }
            return Vec<D, 1>(sum);
        };
        Jet result = jet_of<Dual<double, directions>>(t0, x, p, along, sum_of);
        result.slope(0, n_) -= slope;
        result.slope(0, n_ + 1) = slope;
        return result;
    }
    /// Samples of a prescribed segment, eight a step: |h|; or 1 + s and 1 - s.
    std::vector<Sample<N>> samples_of(int mode, double t0, const Vector& x, double t1,
                                      const Vector& p) const {
        const Mode<M> m = mode_with(mode);
        const Vec<double, P> q = values_of(p);
        std::vector<Sample<N>> samples;
        const auto keep = [&](const Clock<double>& clock, double dt, const X& y) {
            const double t = clock.local + dt;
            Sample<N> sample{clock.absolute() + dt, y, {0, 0}};
            if (mode != 0) {
                sample.value[0] = mode * switching(sys_, t, y, q)[0];
            } else {
                const auto margin = sliding_margin(sys_, m, 0, t, y, q);
                const double beyond = filippov::s_max(sys_, q) - 1;
                sample.value = {margin.below + beyond, margin.above + beyond};
            }
            samples.push_back(sample);
        };
        const auto keep_step = [&](const auto& step, const auto& path) {
            if (samples.empty())
                keep(step.clock, 0.0, step.x0);
            for (int k = 1; k <= 8; ++k)
                keep(step.clock, step.dt * k / 8, k == 8 ? step.x1 : path(k / 8.0));
        };
        counters_ += segment<Tableau>(sys_, q, m, point(x), t0, t1, -1, settings_,
                                      {.step = keep_step, .stop = interrupted_})
                         .counters;
        return samples;
    }

    auto field_of(int mode) const {
        return [this, m = mode_with(mode)](const auto& t, const auto& x, const auto& p) {
            return mode_field(sys_, m, t, x, p);
        };
    }
    auto h_of(int surface) const {
        return [this, surface](const auto& t, const auto& x, const auto& p) {
            using S = std::remove_cvref_t<decltype(t)>;
            return S(switching(sys_, t, x, p)[surface]);
        };
    }
    template <class D>
    D quantity_of(const Quantity& q, const D& t, const Vec<D, N>& x, const Vec<D, P>& p) const {
        require_surface(q.surface);
        if (q.order < 0)
            refuse("q.order", q.order, "expected an integer from 0 to 3");
        const Mode<M> slide = mode_with(q.slide);
        const auto margin = [&](const auto& time, const auto& y, const auto& r) {
            using S = std::remove_cvref_t<decltype(time)>;
            const auto m = sliding_margin(sys_, slide, q.surface, time, y, r);
            return S((q.side < 0 ? m.below : m.above) + (filippov::s_max(sys_, r) - S(1)));
        };
        const bool is_h = q.kind == Quantity::Kind::h;
        // Curves of folds and flips, which want second derivatives, have conditions of order 1, as
        // minima have, which want none; orbits of several surfaces have conditions of order 0.
        constexpr int highest = !single_v<Sys> ? 0 : nesting_v<D> == 1 ? 3 : 1;
        if (q.order > highest)
            throw std::logic_error("filippov: no derivatives of this quantity");
        if constexpr (highest > 0)
            if (q.order > 0) {
                const auto all =
                    is_h ? lie_derivatives<highest>(field_of(q.side), h_of(q.surface), t, x, p)
                         : lie_derivatives<highest>(field_of(q.slide), margin, t, x, p);
                return all[std::size_t(q.order - 1)];
            }
        return is_h ? D(h_of(q.surface)(t, x, p)) : D(margin(t, x, p));
    }

    // --- seeds and jets ------------------------------------------------------------------------

    template <class Use> Jet with_scalar(const Directions& along, Use use) const {
        if (along.v != nullptr && along.v->size() != n_ + 4)
            refuse("along.v.size()", along.v->size(), "expected dim + 4 entries");
        if (along.v == nullptr)
            return use(static_cast<const Dual<double, directions>*>(nullptr));
        if constexpr (single_v<Sys>)
            return use(static_cast<const Dual<Dual<double, 1>, directions>*>(nullptr));
        else
            throw std::logic_error("filippov: second derivatives are for one surface");
    }
    /// A function f(t, x, p) at a point with derivatives; t0 is its time.
    template <class F>
    Jet jet_at(double t, const Vector& x, const Vector& p, const Directions& along,
               const F& f) const {
        return with_scalar(along, [&]<class D>(const D*) { return jet_of<D>(t, x, p, along, f); });
    }
    template <class D, class F>
    Jet jet_of(double t, const Vector& x, const Vector& p, const Directions& along,
               const F& f) const {
        D time = moving<D>(t, n_, along);
        const Vec<D, N> y = state_of<D>(x, along);
        const Vec<D, P> q = params_of<D>(p, along);
        const int spare = spare_direction(along);
        if (spare >= 0)
            time.d[std::size_t(spare)] = 1.0;
        const auto value = f(time, y, q);
        Jet result = jet(value, along, spare);
        if (spare >= 0) {
            for (Eigen::Index r = 0; r < result.value.size(); ++r)
                set_slope(result, r, n_, value[r].d[std::size_t(spare)]);
            return result;
        }
        time.d[0] = 1.0;
        const auto by_time = f(time, state_of<D>(x, along, false), params_of<D>(p, along, false));
        for (Eigen::Index r = 0; r < result.value.size(); ++r)
            set_slope(result, r, n_, by_time[r].d[0]);
        return result;
    }
    /// The direction of a parameter that does not move, which may serve the time; -1: both move.
    static int spare_direction(const Directions& along) {
        for (int k = 0; k < 2; ++k)
            if (along.active[std::size_t(k)] < 0)
                return N + k;
        return -1;
    }
    /// The column of a jet that direction i of a dual belongs to; -1: none.
    int column(int i) const {
        if (i < N)
            return i < n_ ? i : -1;
        return i - N + n_ + 2;
    }
    /// A value that only moves along v, of which it is component i.
    template <class D> static D moving(double value, int i, const Directions& along) {
        D x(value);
        if constexpr (nesting_v<D> == 2)
            x.v.d[0] = (*along.v)[i];
        return x;
    }
    /// Direction i.
    template <class D> D variable(double value, int i, const Directions& along) const {
        D x = moving<D>(value, column(i), along);
        x.d[std::size_t(i)] = 1.0;
        return x;
    }
    // What is read here came from outside: nothing is read beyond its end.

    const Vector& sized(const Vector& p) const {
        if (p.size() != given_params(sys_))
            refuse("p.size()", p.size(), "expected one entry a parameter");
        return p;
    }
    const Vector& of_dim(const Vector& x) const {
        if (x.size() != n_)
            refuse("x.size()", x.size(), "expected dim entries");
        return x;
    }
    void require_surface(int j) const {
        // (what is asked of a system without surfaces is not looked at)
        if (!(j >= 0 && j < std::max(1, surface_count(sys_))))
            refuse("surface", j, "expected an index of a surface");
    }
    /// Parameter k that moves, -1: none.
    int moving_parameter(const Directions& along, int k) const {
        const int i = along.active[std::size_t(k)];
        if (!(i >= -1 && i < given_params(sys_)))
            refuse("along.active", i, "expected an index of a parameter, or -1");
        return i;
    }
    Mode<M> mode_with(int code) const {
        int largest = 0;
        for (int j = 0; j < surface_count(sys_); ++j)
            largest = 3 * largest + 1;
        if (!(std::abs(code) <= largest))
            refuse("mode", code, "expected the code of a mode, see Mode::code");
        return mode_of<M>(code, surface_count(sys_));
    }
    int code_of(const Mode<M>& mode) const { return mode.code(surface_count(sys_)); }
    Vec<double, P> values_of(const Vector& p) const { return all_params<double>(sys_, sized(p)); }
    /// Local time within the period: what the fields see.
    double local(double t, const Vector& p) const {
        return Clock<double>::at(t, filippov::period(sys_, values_of(p))).local;
    }
    X point(const Vector& x) const { return padded<N>(of_dim(x), n_); }
    /// The components that there are.
    Vector cut(const X& x) const {
        Vector given(n_);
        std::copy_n(x.data(), n_, given.data());
        return given;
    }
    /// @param varies  in directions of its own; else along v alone
    template <class D>
    Vec<D, N> state_of(const Vector& x, const Directions& along, bool varies = true) const {
        of_dim(x);
        Vec<D, N> y = Vec<D, N>::Constant(D(0.0));
        for (int i = 0; i < n_; ++i)
            y[i] = varies ? variable<D>(x[i], i, along) : moving<D>(x[i], i, along);
        return y;
    }
    template <class D>
    Vec<D, P> params_of(const Vector& p, const Directions& along, bool varies = true) const {
        std::vector<D> q(sized(p).begin(), p.end());
        for (int k = 0; k < 2; ++k)
            if (const int i = moving_parameter(along, k); i >= 0)
                q[std::size_t(i)] = varies ? variable<D>(p[i], N + k, along)
                                           : moving<D>(p[i], column(N + k), along);
        return all_params<D>(sys_, q);
    }
    /// Of a number, a state, or a state and what follows it.
    /// @param but  a direction that is none of the jet's; -1: all are
    template <class D, int R>
    Jet jet(const Vec<D, R>& value, const Directions& along, int but = -1) const {
        const int rows = R < N ? R : R - N + n_;
        Jet result;
        result.value.resize(rows);
        result.slope = Matrix::Zero(rows, n_ + 4);
        if (along.v != nullptr)
            result.bend = Matrix::Zero(rows, n_ + 4);
        for (int r = 0; r < rows; ++r) {
            result.value[r] = value_of(value[r]);
            for (int i = 0; i < directions; ++i)
                if (const int c = column(i); c >= 0 && i != but)
                    set_slope(result, r, c, value[r].d[std::size_t(i)]);
        }
        return result;
    }
    /// A derivative, which may have one along v.
    static void set_slope(Jet& jet, Eigen::Index row, int column, double d) {
        jet.slope(row, column) = d;
    }
    static void set_slope(Jet& jet, Eigen::Index row, int column, const Dual<double, 1>& d) {
        jet.slope(row, column) = d.v;
        jet.bend(row, column) = d.d[0];
    }

    // --- the times of a flow -------------------------------------------------------------------
    //
    // Starting later is starting further back on the same solution, dPhi/dt0 = -Phi_x f(t0, x0),
    // and ending later is going on, dPhi/dt1 = f(t1, x1): two directions that no step has to carry.

    void depend_on_start_time(int mode, double t0, const Vector& x, const Vector& p,
                              const Directions& along, Jet& jet) const {
        const Jet f = rate(mode, t0, x, p, {along.active, nullptr});
        jet.slope.col(n_) = -jet.slope.leftCols(n_) * f.value;
        if (along.v != nullptr)
            jet.bend.col(n_) =
                -jet.bend.leftCols(n_) * f.value -
                jet.slope.leftCols(n_) * moved(f, along.v->head(n_), (*along.v)[n_], along);
    }
    /// @param end  the state there, which has the derivative along v
    template <class D>
    void depend_on_end_time(int mode, double t1, const Vec<D, N>& end, const Vector& p,
                            const Directions& along, Jet& jet) const {
        const Jet f = rate(mode, t1, jet.value.head(n_), p, {along.active, nullptr});
        jet.slope.col(n_ + 1).head(n_) = f.value;
        if constexpr (nesting_v<D> == 2) {
            Vector dx(n_);
            for (int i = 0; i < n_; ++i)
                dx[i] = end[i].v.d[0];
            jet.bend.col(n_ + 1).head(n_) = moved(f, dx, (*along.v)[n_ + 1], along);
        }
    }
    /// How a field changes with its point, the parameters moving along v.
    Vector moved(const Jet& f, const Vector& dx, double dt, const Directions& along) const {
        return f.slope.leftCols(n_) * dx + f.slope.col(n_) * dt +
               f.slope.rightCols(2) * along.v->tail(2);
    }

    Sys sys_;
    const int n_; ///< components
    Settings<double, N> settings_;
    std::function<bool()> interrupted_;
    mutable Counters counters_{};
};

} // namespace detail

/// Forgets the type of a system.
template <class Tableau = DormandPrince8, class Sys>
std::shared_ptr<const AnySystem> any_system(const Sys& sys, const Precision& precision = {}) {
    require_system<Sys>();
    return std::make_shared<const detail::ErasedSystem<Sys, Tableau>>(sys, precision);
}

} // namespace filippov
