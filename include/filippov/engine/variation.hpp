// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of a flow: the steps of a run, taken again in dual numbers.
//
// A run decides (steps, events, modes) with plain numbers; an observer repeats each accepted step
// in dual arithmetic. Nothing is decided twice, the values are those of the plain run to the last
// bit, and neither root searches nor step control pay for derivatives. At an event one Newton
// correction in infinitesimals moves the event to where the neighbouring solutions have it, and is
// undone in the new mode, so that the running time stays real: the saltation matrix, and the terms
// of second order if duals are nested, appear by themselves.
#pragma once

#include <filippov/core/dual.hpp>
#include <filippov/engine/flow.hpp>

namespace filippov {

/// How a solution passed from one mode to the next, in dual numbers.
template <DualNumber D, int N, int M> struct Passage {
    Mode<M> before{}, after{};
    int surface = -1;
    D t{};         ///< absolute time of the event
    Vec<D, N> x{}; ///< state at the event
};

/// Result of a flow in dual numbers.
template <DualNumber D, int N, int M> struct VariedResult {
    FlowResult<Real<D>, N, M> run; ///< the plain run
    D t{};                         ///< time of the end: t_end, or the event that ended the run
    Vec<D, N> x{};                 ///< state there
    bool singular = false; ///< an event was tangential within the tolerance: derivatives are NaN
};

namespace detail {

/// The dual state of a run.
template <class Sys, DualNumber D, class Tableau> class Variation {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    static constexpr int nesting = nesting_v<D>;
    static_assert(nesting <= 2, "filippov: duals of third and higher order are not supported");
    using R = Real<D>;
    using X = Vec<D, N>;
    using P = Params<Sys, D>;

    /// @param held  neighbours of a start that slides do so, too
    Variation(const Sys& sys, const P& p, const D& t0, const X& x0, const Settings<R, N>& settings,
              bool held = false)
        : sys_(sys), p_(p), values_(values_of(p)), settings_(settings), held_(held), x_(x0),
          delay_(infinitesimal(t0)), period_(infinitesimal(period(sys, p))) {}

    void take(const StepView<R, N, M>& step) {
        follow(step.clock, step.mode);
        if (!lost_)
            advance(step);
    }

    /// Starts in a prescribed mode.
    void prescribe(const Clock<R>& clock, const Mode<M>& mode) {
        started_ = true;
        mode_ = mode;
        x_ = shifted(x_, time_at(clock) + delay_, -delay_, mode_);
    }
    /// Brings the state to `clock` in `mode`, if a mode was entered there.
    void follow(const Clock<R>& clock, const Mode<M>& mode) {
        if (loses_derivatives(mode))
            return;
        if (!started_)
            start(clock, mode);
        else if (!(mode == mode_))
            pass(clock, mode);
    }
    /// The state jumps at surface j.
    /// @param mode  before and after
    void jump(const Clock<R>& clock, const Mode<M>& before, int j, const Mode<M>& after) {
        follow(clock, before);
        const auto h = [&](const auto& t, const auto& x, const auto& p) {
            using S = std::remove_cvref_t<decltype(t)>;
            return S(switching(sys_, t, x, p)[j]);
        };
        suspect(tangential(clock, j, h));
        check_order(clock, j);
        const D delay = delay_of(clock, h), t = time_at(clock) + delay;
        last_.before = mode_;
        last_.x = sys_.jump(j, t, shifted(x_, time_at(clock), delay, mode_), p_);
        mode_ = after;
        last_.after = after;
        last_.surface = j;
        last_.t = D(clock.absolute()) + delay;
        x_ = shifted(last_.x, t, -delay, mode_);
        have_k0_ = false;
    }
    /// Of two jumps at one time one neighbour makes this one first and another that: if that makes
    /// a difference there is no derivative.
    void check_order(const Clock<R>& clock, int j) {
        const Vec<R, N> x = values_of(x_);
        if (jump_surface_ >= 0 && jump_surface_ != j && clock.index == jump_clock_.index &&
            clock.local == jump_clock_.local) {
            const auto jump = [&](int k, const Vec<R, N>& y) {
                return Vec<R, N>(sys_.jump(k, R(clock.local), y, values_));
            };
            const Vec<R, N> other = jump(jump_surface_, jump(j, before_jump_));
            const Vec<R, N> apart = (jump(j, x) - other).cwiseQuotient(scale());
            singular_ = singular_ || !(apart.cwiseAbs().maxCoeff() <= R(1));
        }
        jump_clock_ = clock;
        jump_surface_ = j;
        before_jump_ = x;
    }
    /// State at the (dual) time `t`, whose value `clock` shows.
    X state_at(const Clock<R>& clock, const D& t) const {
        return shifted(x_, time_at(clock), infinitesimal(t), mode_);
    }
    /// The last change of mode.
    const Passage<D, N, M>& last() const { return last_; }
    bool singular() const { return singular_ || suspected_; }
    /// Marks a run that is over as failed if its derivatives wanted steps too short to be taken:
    /// the solution rests where its neighbours are stiff, and the method is explicit.
    template <class Run> void judge(Run& run) const {
        if (too_stiff_ && (run.status == Status::ok || run.status == Status::event)) {
            run.status = Status::step_too_small;
            run.diagnosis = {"derivatives: neighbours of the solution are stiff", run.t, run.x,
                             run.mode, -1};
        }
    }
    /// Events accumulated: from here on the solution is held in `mode`, and so are its neighbours.
    void settle(const Clock<R>& clock, const Mode<M>& mode) {
        if constexpr (has_jumps_v<Sys>)
            for (int j = 0; j < M; ++j)
                if (mode[j] == 0 && mode_[j] != 0 && is_kind(sys_, j, SurfaceKind::jump))
                    take_normal_speed(clock, j);
        suspected_ = false;
        if (loses_derivatives(mode))
            return;
        last_.before = mode_;
        mode_ = last_.after = mode;
        x_ = on_surface(x_, time_at(clock), mode_);
        last_.t = D(clock.absolute());
        last_.x = x_;
        have_k0_ = false;
    }

    /// The delay of the zero of g(t, x, p), met at `clock` in the present mode.
    template <class G> D delay_of(const Clock<R>& clock, const G& g) {
        const auto rate = lie_derivatives<2>(field(), g, R(clock.local), values_of(x_), values_);
        D delay(R(0));
        // Chord iterations: each is right to one more order in the infinitesimals.
        for (int k = 0; k < nesting; ++k) {
            const D t = time_at(clock) + delay;
            const X y = shifted(x_, time_at(clock), delay, mode_);
            delay -= infinitesimal(g(t, y, p_)) * (R(1) / rate[0]);
        }
        return delay;
    }

private:
    /// Local time, dual because the start of the period is.
    D time_at(const Clock<R>& clock) const { return D(clock.local) - period_ * R(clock.index); }
    auto field() const {
        return [this](const auto& t, const auto& x, const auto& p) {
            return mode_field(sys_, mode_, t, x, p);
        };
    }
    FILIPPOV_NOINLINE X field_at(const Mode<M>& mode, const D& t, const X& x) const {
        if (sliding_surface(mode) < 0)
            return side_field(sys_, mode, t, x, p_);
        return mode_field(sys_, mode, t, toward(sys_, held_in(mode, t, x), t, x, p_, scale()), p_);
    }
    /// What holds the solution in a mode, at (t, x) when it was asked first.
    const Constraints<Sys>& held_in(const Mode<M>& mode, const D& t, const X& x) const {
        if (held_by_.size() == 0 || !(mode == held_mode_)) {
            held_mode_ = mode;
            held_by_ = Constraints<Sys>(sys_, mode);
            if constexpr (!single_v<Sys>)
                held_by_ =
                    independent_part(sys_, held_by_, value_of(t), values_of(x), values_, scale());
        }
        return held_by_;
    }
    Vec<R, N> scale() const {
        using std::abs;
        Vec<R, N> s;
        for (int i = 0; i < N; ++i)
            s[i] = error_allowed(settings_.atol[i], settings_.rtol, R(abs(value_of(x_[i]))));
        return s;
    }
    /// Newton in infinitesimals onto the surfaces slid on.
    X on_surface(X x, const D& t, const Mode<M>& mode) const {
        if (sliding_surface(mode) >= 0) {
            const Constraints<Sys>& held = held_in(mode, t, x);
            for (int k = 0; k < nesting; ++k)
                x = with_values(toward(sys_, held, t, x, p_, scale()), values_of(x));
            // One after another: exactly zero where each surface has a component of its own.
            for (int i = 0; i < held.size() && held.size() > 1; ++i)
                x = with_values(toward(sys_, held.only(i), t, x, p_, scale()), values_of(x));
        }
        return x;
    }
    static X with_values(X x, const Vec<R, N>& values) {
        for (int i = 0; i < N; ++i)
            x[i] += D(values[i] - value_of(x[i]));
        return x;
    }
    /// The state an infinitesimal time later: Euler's step, or the midpoint's, is exact.
    FILIPPOV_NOINLINE X shifted(const X& x, const D& t, const D& dt, const Mode<M>& mode) const {
        const auto stepped = [&](const D& h, const X& f) {
            X y;
            for (int i = 0; i < N; ++i)
                y[i] = x[i] + h * f[i];
            return y;
        };
        X f = field_at(mode, t, x);
        if constexpr (nesting == 2) {
            const D half = dt * R(0.5);
            f = field_at(mode, t + half, stepped(half, f));
        }
        return on_surface(stepped(dt, f), t + dt, mode);
    }

    /// True from where a slide of second order begins: what neighbours do there is not known.
    bool loses_derivatives(const Mode<M>& mode) {
        lost_ = lost_ || mode.second_order != 0;
        singular_ = singular_ || lost_;
        return lost_;
    }
    void start(const Clock<R>& clock, const Mode<M>& mode) {
        if (held_)
            return prescribe(clock, mode);
        Mode<M> first = mode;
        for (int j = 0; j < M; ++j) {
            if (mode[j] != 0)
                continue;
            // A neighbour that starts off the surface falls onto it: the same from either side.
            first.set(j, +1);
            if (is_kind(sys_, j, SurfaceKind::jump))
                continue;
            const auto b =
                both_sides(sys_, region_of(first), j, R(clock.local), values_of(x_), values_);
            using std::abs;
            first.set(j, abs(b.l1) > abs(b.l2) ? -1 : 1);
        }
        prescribe(clock, first);
        pass(clock, mode);
        last_ = {};
    }

    /// Changes to the mode `after`. Where several surfaces are met at once one neighbour meets this
    /// one first and another that: if that makes a difference there is no derivative.
    void pass(const Clock<R>& clock, const Mode<M>& after) {
        if constexpr (M == 1) {
            if (mode_ != after)
                pass(clock, 0, after);
        } else if (mode_ != after && pass_set_valued(clock, after)) {
        } else {
            // What has not reached an event of its own follows the first that has.
            std::array<bool, std::size_t(M)> own{};
            int events = 0;
            for (int j = 0; j < M; ++j)
                if (mode_[j] != after[j] && met(clock, j, after[j])) {
                    own[std::size_t(j)] = true;
                    ++events;
                }
            const auto pass_own = [&](int j) {
                if (!own[std::size_t(j)])
                    return;
                Mode<M> with = mode_;
                for (int k = 0; k < M; ++k)
                    if (!own[std::size_t(k)] || k == j)
                        with.set(k, after[k]);
                pass(clock, j, with);
            };
            const X x = x_;
            const Mode<M> before = mode_;
            for (int j = M - 1; j >= 0; --j)
                pass_own(j);
            const X backwards = x_;
            x_ = x;
            mode_ = before;
            for (int j = 0; j < M; ++j)
                pass_own(j);
            if (events > 1 && !agree(x_, backwards))
                singular_ = true;
            for (int j = 0; j < M; ++j) // none had
                if (mode_[j] != after[j]) {
                    Mode<M> with = mode_;
                    with.set(j, after[j]);
                    pass(clock, j, with);
                }
        }
    }
    /// Passes to or from a slide whose s is not unique; false if neither is.
    ///
    /// It begins where the surfaces that are met hold one direction more than was held: they are
    /// met at one time by neighbours, too. It ends by the margin of them all, where that is smooth.
    bool pass_set_valued(const Clock<R>& clock, const Mode<M>& after) {
        const R t(clock.local);
        const Vec<R, N> x = values_of(x_);
        const auto from = set_valued_slide(sys_, mode_, t, x, values_);
        const auto to = set_valued_slide(sys_, after, t, x, values_);
        if (!from.found && !to.found)
            return false;
        const auto rank = [&](const Mode<M>& mode) {
            const Constraints<Sys> held(sys_, mode);
            return held.size() == 0 ? 0
                                    : independent_part(sys_, held, t, x, values_, scale()).size();
        };
        if (from.found) {
            const auto [j, side] = margin_of_all(sys_, slid_surfaces(mode_));
            singular_ = singular_ || to.found || !from.smooth;
            pass(clock, j, after, side);
            return true;
        }
        int met = -1;
        for (int j = 0; j < M; ++j) {
            if (after[j] != 0 || mode_[j] == 0)
                continue;
            met = met < 0 ? j : met;
            singular_ = singular_ || is_kind(sys_, j, SurfaceKind::jump);
        }
        singular_ = singular_ || met < 0 || rank(after) != rank(mode_) + 1;
        if (met >= 0 && !singular_)
            pass(clock, met, after, 0);
        mode_ = after;
        return true;
    }
    /// True if surface j is where it changes: on h = 0, or in a slide at the end that it leaves by.
    bool met(const Clock<R>& clock, int j, int side) const {
        if (mode_[j] != 0 || is_kind(sys_, j, SurfaceKind::jump))
            return true;
        const auto margin = sliding_margin(sys_, mode_, j, R(clock.local), values_of(x_), values_);
        using std::abs;
        return abs(side < 0 ? margin.below : margin.above) < R(1e-6);
    }
    /// True if two states have the same first derivatives, to a millionth of the largest.
    bool agree(const X& a, const X& b) const {
        using std::abs;
        const Vec<R, N> unit = scale();
        R largest(0), difference(0);
        for (int i = 0; i < N; ++i)
            for (std::size_t k = 0; k < a[i].d.size(); ++k) {
                const R u = value_of(a[i].d[k]) / unit[i], v = value_of(b[i].d[k]) / unit[i];
                largest = std::max({largest, abs(u), abs(v)});
                difference = std::max(difference, abs(u - v));
                if (!(abs(u - v) < std::numeric_limits<R>::infinity()))
                    return false;
            }
        return difference <= R(1e-6) * largest;
    }
    /// Changes to the mode `after` where surface j is met or left.
    void pass(const Clock<R>& clock, int j, const Mode<M>& after) {
        pass(clock, j, after, after[j]);
    }
    /// @param side  the end at which surface j is left, if it was slid on
    void pass(const Clock<R>& clock, int j, const Mode<M>& after, int side) {
        if constexpr (has_jumps_v<Sys>)
            if (is_kind(sys_, j, SurfaceKind::jump) && side == 0)
                return settle(clock, after);
        const bool slid = mode_[j] == 0;
        // what rests where its field ends like a root has come there with an infinite gradient
        singular_ = singular_ || (is_kind(sys_, j, SurfaceKind::kink) && (slid || side == 0));
        const auto guard = [&](const auto& t, const auto& x, const auto& p) {
            using S = std::remove_cvref_t<decltype(t)>;
            if (!slid)
                return S(switching(sys_, t, x, p)[j]);
            const auto margin = sliding_margin(sys_, mode_, j, t, x, p);
            return S((side < 0 ? margin.below : margin.above) + (s_max(sys_, p) - S(1)));
        };
        if (!slid)
            suspect(tangential(clock, j, guard));
        singular_ = singular_ || jumps(clock, j, guard);
        const D delay = delay_of(clock, guard), t = time_at(clock);
        const X x = shifted(x_, t, delay, mode_);
        last_.before = mode_;
        mode_ = last_.after = after;
        last_.surface = j;
        last_.t = D(clock.absolute()) + delay;
        last_.x = on_surface(x, t + delay, mode_);
        x_ = shifted(last_.x, t + delay, -delay, mode_);
        have_k0_ = false;
    }
    /// True if guard j of the event is not zero there: h has jumped, or s, and when that was does
    /// not follow from the state. (Of several surfaces s_j may be ended by another's event.)
    template <class G> bool jumps(const Clock<R>& clock, int j, const G& guard) const {
        using std::abs;
        const R t(clock.local);
        const Vec<R, N> x = values_of(x_);
        const R off = abs(R(guard(t, x, values_)));
        if (mode_[j] == 0)
            return M == 1 && !(off <= R(1e-6));
        return !(off <= slide_band(sys_, j, t, x, values_, scale()));
    }
    /// A tangential event has no derivative, unless it is one of those that accumulate: then no
    /// other sort follows before the limit.
    void suspect(bool tangential) {
        singular_ = singular_ || (suspected_ && !tangential);
        suspected_ = tangential;
    }
    /// Neighbours of what comes to rest on surface j do so a little sooner or later, but what
    /// impacts do to them until then contact does as well: what they have of the normal speed is
    /// taken from them along the push.
    void take_normal_speed(const Clock<R>& clock, int j) {
        const D t = time_at(clock);
        const Mode<M> side = region_of(mode_);
        const X push = contact_push(sys_, side, j, t, x_, p_);
        for (int k = 0; k < nesting; ++k) {
            const D excess = infinitesimal(normal_speed(sys_, side, j, t, x_, p_));
            for (int i = 0; i < N; ++i)
                x_[i] -= push[i] * excess;
        }
    }
    /// True if the dip of h behind the event is below what the tolerance resolves: the solutions on
    /// one side of this one do not meet the surface at all.
    template <class G> bool tangential(const Clock<R>& clock, int j, const G& guard) const {
        using std::abs;
        const Vec<R, N> x = values_of(x_);
        const auto rate = lie_derivatives<2>(field(), guard, R(clock.local), x, values_);
        const R band = rounding_band(sys_, j, R(clock.local), x, values_) +
                       change_over(sys_, j, R(clock.local), x, values_, scale());
        return !(rate[0] * rate[0] > R(2) * abs(rate[1]) * band);
    }

    void advance(const StepView<R, N, M>& step) {
        const D t = time_at(step.clock);
        X x1 = x_;
        if (!closed_form(t, step.dt, x1)) {
            if (!have_k0_)
                rk_.k[0] = field_at(mode_, t, x_);
            follow_step(t, step.dt, x1, most_halvings, {}, {});
            have_k0_ = true;
        }
        x_ = on_surface(with_values(x1, step.x1), t + D(step.dt), mode_);
    }
    /// A number for each direction, in units of the tolerance.
    using PerDirection = std::array<R, std::tuple_size_v<decltype(D::d)>>;

    /// Takes x and k[0] a step on. Steps are chosen for the values alone, which may rest while
    /// their neighbours run away: where an infinitesimal needs it, a step is taken in halves.
    /// @param whole  errors of the step that this is a part of
    /// @param twice  errors of the step of which this is a half
    void follow_step(const D& t, const R& dt, X& x, int halvings, const PerDirection& whole,
                     const PerDirection& twice) {
        const auto rhs = [&](std::size_t, const D& time, const X& at) {
            return field_at(mode_, time, at);
        };
        X x1;
        rk_.step(rhs, t, x, dt, x1);
        PerDirection errors{};
        if (!too_stiff_ && coarse(x, x1, dt, errors)) {
            if (halvings > 0) {
                const PerDirection& all = halvings == most_halvings ? errors : whole;
                follow_step(t, dt / 2, x, halvings - 1, all, errors);
                follow_step(t + D(dt / 2), dt / 2, x, halvings - 1, all, errors);
                return;
            }
            give_up(x, x1, errors, whole, twice);
        }
        x = x1;
        rk_.k[0] = rk_.k[RungeKutta<Tableau, D, N>::last];
    }
    static constexpr int most_halvings = 12;

    /// The shortest steps err, too. In neighbours that are stiff they do by many orders less than
    /// the whole step, and by some less than the next longer ones; otherwise it is rounding, of
    /// what cancels, and not asked for again.
    void give_up(const X& x, const X& x1, const PerDirection& errors, const PerDirection& whole,
                 const PerDirection& twice) {
        const Vec<R, N> unit = scale();
        for (std::size_t k = 0; k < errors.size(); ++k)
            if (errors[k] > R(0)) {
                too_stiff_ = too_stiff_ || (errors[k] < whole[k] * R(0x1p-30) &&
                                            errors[k] < twice[k] * R(0x1p-5));
                noise_[k] = R(1e3) * size_of(x, x1, k, unit);
            }
    }
    /// Of the derivatives in direction k, at both ends of a step.
    static R size_of(const X& x, const X& x1, std::size_t k, const Vec<R, N>& unit) {
        using std::abs;
        R size(0);
        for (int i = 0; i < N; ++i)
            size = std::max({size, R(abs(value_of(x[i].d[k])) / unit[i]),
                             R(abs(value_of(x1[i].d[k])) / unit[i])});
        return size;
    }

    /// The derivatives in one direction, as the tableau's estimate of the error sees its stages.
    struct Part {
        using Scalar = R;
        const RungeKutta<Tableau, D, N>& rk;
        std::size_t k;

        R of(const D& x) const { return value_of(x.d[k]); }

        template <class Row> R mean_square(Row, const Vec<R, N>& weight) const {
            static constexpr auto row = [] {
                std::array<R, std::size_t(Tableau::stages)> w{};
                for (std::size_t j = 0; j < w.size(); ++j)
                    w[j] = R(Row{}(j));
                return w;
            }();
            R sum(0);
            for (int i = 0; i < N; ++i) {
                R error(0);
                for (std::size_t j = 0; j < row.size(); ++j)
                    error += row[j] * of(rk.k[j][i]);
                sum += (weight[i] * error) * (weight[i] * error);
            }
            return sum / R(N);
        }
    };
    /// True if a step errs in the derivatives of first order by more than ten relative tolerances.
    /// @param errors  of the directions in which it does
    bool coarse(const X& x, const X& x1, const R& dt, PerDirection& errors) const {
        using std::sqrt;
        const Vec<R, N> unit = scale();
        const R tolerance = R(10) * std::max(settings_.rtol, derivative_error<R>(sys_));
        bool found = false;
        for (std::size_t k = 0; k < errors.size(); ++k) {
            const R size = size_of(x, x1, k, unit);
            if (!(size > noise_[k] && size > R(1e20) * std::numeric_limits<R>::min()))
                continue; // nothing is left of it but rounding
            Vec<R, N> weight;
            for (int i = 0; i < N; ++i)
                weight[i] = dt / (unit[i] * size) * mean_weight<Sys, R>(sys_);
            const R error = sqrt(Tableau::squared_error(Part{rk_, k}, weight));
            if (error > tolerance) {
                errors[k] = error * size;
                found = true;
            }
        }
        return found;
    }
    bool closed_form([[maybe_unused]] const D& t, [[maybe_unused]] const R& dt,
                     [[maybe_unused]] X& x1) const {
        if constexpr (HasSlidingFlow<Sys, D>)
            if (settings_.closed_form_slides && sliding_surface(mode_) >= 0 &&
                slides_in_closed_form<D>(sys_)) {
                x1 = sys_.sliding_flow(t, x_, p_, D(dt));
                return true;
            }
        return false;
    }

    const Sys& sys_;
    const P& p_;
    const Params<Sys, R> values_;
    const Settings<R, N>& settings_;
    const bool held_;
    mutable Constraints<Sys> held_by_{}; ///< what holds the solution in the last slide,
    mutable Mode<M> held_mode_{};        ///< and that
    X x_;
    Mode<M> mode_{};
    const D delay_;  ///< of the start
    const D period_; ///< infinitesimal part of the period
    RungeKutta<Tableau, D, N> rk_;
    bool started_ = false, have_k0_ = false, singular_ = false, suspected_ = false;
    bool lost_ = false;      ///< the solution has slid to second order
    PerDirection noise_{};   ///< derivatives below this are rounding
    bool too_stiff_ = false; ///< a step in as many halves as there may be was too long
    Passage<D, N, M> last_{};
    Clock<R> jump_clock_{}; ///< of the last jump, the surface it was at, and the state before it
    int jump_surface_ = -1;
    Vec<R, N> before_jump_ = Vec<R, N>::Zero();
};

/// Every derivative becomes NaN; the value stays.
template <class S, int K> void make_singular(Dual<S, K>& x) {
    if constexpr (is_dual_v<S>)
        make_singular(x.v);
    x.d.fill(S(std::numeric_limits<Real<S>>::quiet_NaN()));
}

} // namespace detail

/// `flow` in dual numbers: the end of the run with its derivatives.
///
/// x0, t0, t_end and p may each depend on whatever the duals' directions mean. The end is t_end, or
/// the event that ended the run: a terminal section, or one that `observer.ends`. There t has
/// derivatives, too.
/// @param settings  in plain numbers: the run is the plain one
/// @param observer  of the plain run
/// @error  as the plain run; status `step_too_small` where derivatives want far shorter steps than
///         the solution, which rests while its neighbours are stiff
/// @return `singular` where a surface was met tangentially within the tolerance, or a direction was
///         at rest: derivatives are NaN
/// @cost   one plain run, and its accepted steps once more in dual arithmetic
template <class Tableau = DormandPrince5, class Sys, DualNumber D, class Sec = Sections<>>
VariedResult<D, dim_v<Sys>, surfaces_v<Sys>>
flow(const Sys& sys, const GivenParams<Sys, D>& params, const Vec<D, dim_v<Sys>>& x0,
     std::type_identity_t<D> t0, std::type_identity_t<D> t_end,
     const Settings<Real<D>, dim_v<Sys>>& settings = {},
     const ObserverOf<Sys, Real<D>>& observer = {}, const Sec& watched = {},
     const KnownStart<surfaces_v<Sys>>& known_start = {}) {
    constexpr int N = dim_v<Sys>, M = surfaces_v<Sys>;
    using R = Real<D>;
    require_system<Sys>();
    const Params<Sys, D> p = params.of(sys);
    validate(settings);
    validate_start(values_of(x0), value_of(t0), value_of(t_end), values_of(p), given_params(sys));
    detail::Variation<Sys, D, Tableau> variation(sys, p, t0, x0, settings, known_start.held);
    int section = -1; // the last one met
    // what `ends` ended the run at: a change of mode, or an event without one
    bool passed = false, touched = false;
    VariedResult<D, N, M> result;
    Observer<R, N, M> both; // (its functions are called, not copied: they may count)
    if (observer.begin)
        both.begin = [&](const R& from, const R& to) { observer.begin(from, to); };
    if (observer.stop)
        both.stop = [&] { return observer.stop(); };
    if (observer.choose)
        both.choose = [&](const auto& verdict) { return observer.choose(verdict); };
    both.step = [&](const auto& step, const auto& path) {
        variation.take(step);
        if (observer.step)
            observer.step(step, path);
    };
    both.limit = [&](const auto& clock, const auto& mode) {
        variation.settle(clock, mode);
        if (observer.limit)
            observer.limit(clock, mode);
    };
    if constexpr (has_jumps_v<Sys>)
        both.jump = [&](const auto& clock, const auto& before, int j, const auto& after) {
            variation.jump(clock, before, j, after);
            if (observer.jump)
                observer.jump(clock, before, j, after);
        };
    both.event = [&](const auto& event) {
        if (event.kind == EventKind::section)
            section = event.surface;
        if (event.kind == EventKind::graze) // one neighbour meets the surface, another does not
            result.singular = true;
        if constexpr (has_directions_v<Sys>) // a/|a| has no derivative at rest
            for (int j = 0; j < M; ++j)
                if (is_directed(sys, j) &&
                    (event.mode_before[j] == 0 || event.mode_after[j] == 0 ||
                     (event.kind != EventKind::section && (event.contacts >> j & 1u) != 0)))
                    result.singular = true;
        if (observer.event)
            observer.event(event);
    };
    if (observer.ends)
        both.ends = [&](const auto& event) {
            const bool over = observer.ends(event);
            if (over && event.kind != EventKind::section) {
                touched = event.mode_before == event.mode_after && event.kind != EventKind::jump;
                passed = !touched;
            }
            return over;
        };
    result.run = flow<Tableau>(sys, values_of(p), values_of(x0), value_of(t0), value_of(t_end),
                               settings, both, watched, known_start);
    const bool at_event = result.run.status == Status::event;
    variation.follow(result.run.clock, result.run.mode);
    if (at_event && passed) {
        result.t = variation.last().t;
        result.x = variation.last().x;
    } else {
        result.t = result.run.status == Status::ok ? D(t_end) : D(result.run.t);
        if constexpr (Sec::capacity > 0)
            if (at_event && !touched)
                result.t += variation.delay_of(
                    result.run.clock, [&](const auto& t, const auto& x, const auto& q) {
                        using S = std::remove_cvref_t<decltype(t)>;
                        const S turns(static_cast<R>(result.run.clock.index));
                        return watched.value(section, S(t + turns * period(sys, q)), x, q);
                    });
        result.x = variation.state_at(result.run.clock, result.t);
    }
    // a neighbour of a solution that touches has no such event
    result.singular = result.singular || variation.singular() || touched;
    if (result.singular) {
        // The values are those of the run: at a tangency derivatives are not even finite.
        result.t = D(result.run.t);
        for (int i = 0; i < dim_v<Sys>; ++i)
            result.x[i] = D(result.run.x[i]);
        detail::make_singular(result.t);
        for (D& v : result.x)
            detail::make_singular(v);
    }
    variation.judge(result.run);
    return result;
}

/// `segment` in dual numbers, from t0 to t_end: a prescribed mode and no target.
///
/// @param stop  may be empty; as in Observer: true ends the segment with `interrupted`
template <class Tableau, class Sys, DualNumber D>
VariedResult<D, dim_v<Sys>, surfaces_v<Sys>>
segment(const Sys& sys, const GivenParams<Sys, D>& params, const Mode<surfaces_v<Sys>>& mode,
        const Vec<D, dim_v<Sys>>& x0, std::type_identity_t<D> t0, std::type_identity_t<D> t_end,
        const Settings<Real<D>, dim_v<Sys>>& settings, const std::function<bool()>& stop = {}) {
    constexpr int N = dim_v<Sys>, M = surfaces_v<Sys>;
    using R = Real<D>;
    require_system<Sys>();
    const Params<Sys, D> p = params.of(sys);
    validate(settings);
    validate_start(values_of(x0), value_of(t0), value_of(t_end), values_of(p), given_params(sys));
    detail::validate_prescribed(sys, mode, -1);
    detail::Variation<Sys, D, Tableau> variation(sys, p, t0, x0, settings);
    variation.prescribe(Clock<R>::at(value_of(t0), value_of(period(sys, p))), mode);
    const auto take = [&](const auto& step, const auto&) { variation.take(step); };
    const auto run = segment<Tableau>(sys, values_of(p), mode, values_of(x0), value_of(t0),
                                      value_of(t_end), -1, settings, {.step = take, .stop = stop});
    VariedResult<D, N, M> result;
    result.run.status = run.status;
    result.run.clock = run.clock;
    result.run.t = run.t;
    result.run.x = run.x;
    result.run.mode = mode;
    result.run.counters = run.counters;
    result.run.diagnosis = run.diagnosis;
    result.run.surfaces = surface_count(sys);
    result.run.components = component_count(sys);
    variation.judge(result.run);
    result.t = t_end;
    result.x = variation.state_at(run.clock, t_end);
    return result;
}

} // namespace filippov
