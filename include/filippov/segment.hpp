// SPDX-License-Identifier: BSD-3-Clause
// Follows one forced mode until something happens. No judgement: what a contact means is for flow.
#pragma once

#include <filippov/clock.hpp>
#include <filippov/control.hpp>
#include <filippov/event.hpp>
#include <filippov/guards.hpp>
#include <filippov/intersection.hpp>
#include <filippov/landing.hpp>
#include <filippov/observers.hpp>
#include <filippov/roots.hpp>
#include <filippov/rosenbrock.hpp>
#include <filippov/settings.hpp>
#include <filippov/status.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

namespace filippov {

/// What a run did, counted.
struct Counters {
    long long steps = 0;         ///< accepted steps
    long long rejected = 0;      ///< rejected trial steps
    long long field = 0;         ///< evaluations of a one-sided field
    long long root_searches = 0; ///< steps in which roots were looked for
    long long interpolants = 0;  ///< interpolants built
    long long landings = 0;      ///< trial steps taken to land on events
    long long events = 0;        ///< events logged

    Counters& operator+=(const Counters& other) {
        steps += other.steps;
        rejected += other.rejected;
        field += other.field;
        root_searches += other.root_searches;
        interpolants += other.interpolants;
        landings += other.landings;
        events += other.events;
        return *this;
    }
};

/// Where and in what a run failed.
template <class S, int N, int M> struct Diagnosis {
    std::string_view what; ///< "f1", "f2", "h", ..., or the reason of an ambiguity
    S t{};
    Vec<S, N> x{};
    Mode<M> mode{};
    int surface = -1;
};

/// Why a segment ended.
struct Stop {
    Status status = Status::ok; ///< not ok: the run is over
    int guard = -1;             ///< >= 0: the guard met; -1: the end of the time span
    bool touch = false;         ///< an extremum that touches zero, not a root
    bool missed = false;        ///< no event after all: the whole step is free
    bool jumped = false;        ///< h changed sign without being zero (a jump of h)
};

/// State and machinery of a run; `advance` follows the current mode to the next stop.
template <class Sys, class S, class Tableau, class Obs, class Sec> class Segment {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    static constexpr int n_guards = 3 * M + Sec::capacity;
    using X = State<Sys, S>;
    using P = Params<Sys, S>;
    using Stepper = typename Tableau::template Stepper<S, N>;

    /// @error std::invalid_argument for a period too short to tell the phase of t0 or t_end
    Segment(const Sys& sys, const P& p, const S& t0, const X& x0, const S& t_end,
            const Settings<S, N>& settings, Obs& observer, const Sec& sections)
        : sys_(sys), p_(p), settings_(settings), observer_(observer), sections_(sections) {
        const S T = period(sys, p);
        clock_ = Clock<S>::at(t0, T);
        end_ = Clock<S>::at(t_end, T);
        const S both = clock_.local + end_.local;
        if (!(both - both == S(0)))
            detail::refuse("period", T,
                           "expected 0, or one of which fewer than 2^52 fit in t0 and t_end");
        direction_ = t_end < t0 ? -1 : 1;
        x_ = x0;
        weigh(x_);
    }

    const Clock<S>& clock() const { return clock_; }
    const X& x() const { return x_; }
    const Mode<M>& mode() const { return mode_; }
    int direction() const { return direction_; }
    const Counters& counters() const { return counters_; }
    Counters& counters() { return counters_; }
    const Diagnosis<S, N, M>& diagnosis() const { return diagnosis_; }
    /// A time over which the solution changes: the step size, unless settings make it tiny.
    S time_scale() const { return std::max(abs_(dt_), natural_step_); }
    const X& scale() const { return scale_; }

    void set_state(const X& x) {
        x_ = x;
        weigh(x_);
        have_k0_ = false;
    }

    /// Forces a mode. Guards start from their values here; `start_root(guard, order)` afterwards
    /// tells which of them start on a root.
    void enter(const Mode<M>& mode) {
        const bool changed = !(mode == mode_), slid = mode_.sliding() > 0 && dt_ != S(0);
        if (changed)
            have_k0_ = false;
        mode_ = mode;
        held_ = Constraints<Sys>(sys_, mode);
        list_active();
        if (changed && dt_ != S(0) && abs_(dt_) < S(100) * resolution())
            choose_first_step();
        // A slide may take far longer steps than the slip after it: that one goes on as before it.
        if (!slid && mode.sliding() > 0)
            dt_before_slide_ = counters_.steps > 0 ? dt_ : S(0);
        if (slid && mode.sliding() == 0 && dt_before_slide_ != S(0) &&
            abs_(dt_before_slide_) < abs_(dt_))
            dt_ = dt_before_slide_;
        for (const int g : active_guards()) {
            if (g >= Guard<M>::first_section)
                break;
            const S value = raw_guard(g, clock_.local, x_);
            const bool repels = g == Guard<M>::transversal(g / 3) && value < S(0);
            trace(g).sense = mode_[g / 3] != 0 ? S(mode_[g / 3]) : repels ? S(-1) : S(1);
            trace(g).start_at(trace(g).sense * value);
        }
    }

    /// Guard g starts on a root of this order: it is divided out of g in the next step.
    void start_root(int g, int order) {
        trace(g).order = order;
        trace(g).offset = g < Guard<M>::first_section ? guard_value(g, clock_.local, x_) : S(0);
    }

    /// A slide goes on after guard g of its end was met: g starts on a root, and on an intersection
    /// its attraction does, too, if that ended with s.
    void go_on_sliding(int g) {
        start_root(g, 2);
        if constexpr (M > 1) {
            const int attraction = Guard<M>::transversal(sliding_surface(mode_));
            GuardTrace& w = trace(attraction);
            if (mode_.sliding() < 2 ||
                !(w.start <= S(4) * touch_band(Guard<M>::below(g / 3), false)))
                return;
            w.start_at(w.sense * w.start);
            w.sense = S(1);
            start_root(attraction, 2);
        }
    }

    /// Watches guard g alone, from whichever side it starts on; -1: none.
    void watch_only(int guard) {
        for (int g = 0; g < n_guards; ++g)
            trace(g).watched = g == guard;
        list_active();
        if (guard < 0 || !active(guard))
            return;
        const S value = raw_guard(guard, clock_.local, x_);
        trace(guard).sense = S(detail::sign(value));
        trace(guard).start = abs_(value);
        const bool off_surface = guard < Guard<M>::first_section && mode_[guard / 3] != 0;
        const S band = off_surface
                           ? start_band(sys_, guard / 3, clock_.local, x_, p_, X(settings_.atol))
                           : touch_band(guard, true);
        if (abs_(value) <= band) {
            trace(guard).sense = S(0);
            start_root(guard, 1);
        }
    }

    /// Section q starts here, on the side of its value; exactly on it the side is where the step
    /// goes.
    void start_section(int q) {
        const S value = section_value(q);
        GuardTrace& section = trace(Guard<M>::first_section + q);
        section.sense = S(detail::sign(value));
        section.start_at(abs_(value), value == S(0) ? 1 : 0);
    }
    /// Section q was just crossed: the next step starts on its root, on the other side.
    void passed_section(int q) {
        GuardTrace& section = trace(Guard<M>::first_section + q);
        section.sense = -section.sense;
        section.order = 1;
        section.offset = S(0);
    }
    /// The sign that section q had before, 0 if not known yet.
    int section_side(int q) const { return detail::sign(trace(Guard<M>::first_section + q).sense); }
    S section_value(int q) const {
        return raw_guard(Guard<M>::first_section + q, clock_.local, x_);
    }

    void choose_first_step() {
        S span = abs_(clock_.until(end_));
        if (span == S(0))
            span = S(1); // nothing to integrate, but a contact wants a time scale
        natural_step_ = std::max(estimate_first_step(span), resolution());
        S first = std::min({natural_step_, span, settings_.max_step});
        if (settings_.first_step > S(0))
            first = std::min(settings_.first_step, span);
        if (settings_.fixed_step > S(0))
            first = settings_.fixed_step;
        dt_ = S(direction_) * std::max(first, resolution());
    }

    /// Follows the mode to the next stop.
    Stop advance() {
        if (const int j = sliding_surface(mode_); j >= 0) {
            if constexpr (HasSlidingFlow<Sys, S>)
                if (settings_.closed_form_slides && slides_in_closed_form<S>(sys_))
                    return run_closed_form();
            return run(SlideRhs{*this});
        }
        if constexpr (HasSides<Sys, S>)
            return mode_[0] < 0 ? run(SideRhs<-1>{*this}) : run(SideRhs<+1>{*this});
        else
            return run(SideRhs<0>{*this});
    }

    /// Lets the observer bring the end nearer by whole periods, which moves nothing else: it has
    /// seen that they would repeat what was.
    void let_observer_skip() {
        if constexpr (requires { observer_.skip_periods(0LL); })
            if (clock_.period > S(0) && direction_ > 0) {
                const long long left =
                    end_.index - clock_.index - (clock_.local > end_.local ? 1 : 0);
                end_.index -= observer_.skip_periods(left);
            }
    }

    Status fail(Status status, std::string_view what, int surface = -1) {
        diagnosis_ = {what, clock_.absolute(), x_, mode_, surface};
        return status;
    }

    /// An event came this time after the last one, and the one after it may come as soon: a
    /// step very much longer would not show it.
    void expect_event_after(const S& gap) {
        first_reach_ = std::max(S(1e3) * gap, S(16) * resolution());
    }
    /// True if a time dt from now is not after the end of the run.
    bool reaches(const S& dt) const { return S(direction_) * (clock_.until(end_) - dt) >= S(0); }
    /// Goes straight to x, a time dt later: past events that accumulate there.
    void leap(const S& dt, const X& x) {
        remaining_ = clock_.until(end_);
        StraightPath path{dt, x_, x};
        accept(path);
        have_k0_ = false;
    }

    /// Names the function that is not finite at (t, x), if one is.
    std::string_view what_is_not_finite(const S& t, const X& x) const {
        if (!all_finite<S, M>(switching(sys_, t, x, p_)))
            return "h";
        if (!all_finite<S, N>(mode_field(t, x))) {
            if constexpr (HasSides<Sys, S>)
                return mode_[0] < 0 ? "f1" : mode_[0] > 0 ? "f2" : "sliding field";
            return mode_.sliding() > 0 ? "sliding field" : "field";
        }
        return "";
    }

private:
    /// Where in a step guards are probed.
    using StepTimes =
        std::conditional_t<Stepper::probes_stages, StageTimes<Tableau, S>, WindowTimes<S>>;
    using GuardTrace = Trace<S, std::max<std::size_t>(Tableau::stages + Tableau::extra_stages,
                                                      WindowTimes<S>::n + 1)>;

    static std::size_t idx(int g) { return static_cast<std::size_t>(g); }
    FILIPPOV_INLINE GuardTrace& trace(int g) { return traces_[idx(g)]; }
    FILIPPOV_INLINE const GuardTrace& trace(int g) const { return traces_[idx(g)]; }
    static S abs_(const S& v) {
        using std::abs;
        return abs(v);
    }

    // --- fields with probes --------------------------------------------------------------------

    /// A one-sided field; every stage also probes the guards.
    template <int Side> struct SideRhs {
        Segment& seg;
        static constexpr bool slides = false;
        FILIPPOV_INLINE X field(const S& t, const X& x) const {
            if constexpr (Side == -1)
                return seg.sys_.f1(t, x, seg.p_);
            else if constexpr (Side == +1)
                return seg.sys_.f2(t, x, seg.p_);
            else
                return side_field(seg.sys_, seg.mode_, t, x, seg.p_);
        }
        FILIPPOV_INLINE void probe(std::size_t k, const S& t, const X& x) {
            const Vec<S, M> h = switching(seg.sys_, t, x, seg.p_);
            if constexpr (Side != 0)
                seg.probe(0, k, h[0]);
            else
                for (int j = 0; j < M; ++j)
                    seg.probe(Guard<M>::below(j), k, h[j]);
            seg.probe_sections(k, t, x);
        }
        FILIPPOV_INLINE X operator()(std::size_t k, const S& t, const X& x) {
            probe(k, t, x);
            return field(t, x);
        }
        auto slopes(const S& t, const X& x) const { return seg.slopes(t, x); }
    };

    /// The sliding field; a stage is put on the surface first, so that the fields need not exist
    /// off it.
    struct SlideRhs {
        Segment& seg;
        static constexpr bool slides = true;
        FILIPPOV_INLINE X field(const S& t, const X& x) const { return at(t, x).f; }
        FILIPPOV_INLINE auto at(const S& t, const X& x) const {
            const X y = toward(seg.sys_, seg.held_, t, x, seg.p_, seg.scale_);
            if constexpr (single_v<Sys>)
                return sliding(seg.sys_, seg.mode_, t, y, seg.p_);
            else
                return joint_sliding(seg.sys_, seg.mode_, t, y, seg.p_);
        }
        FILIPPOV_INLINE void probe(std::size_t k, const S& t, const X& x) { (*this)(k, t, x); }
        FILIPPOV_INLINE X operator()(std::size_t k, const S& t, const X& x) {
            const auto slide = at(t, x);
            if constexpr (single_v<Sys>) {
                const S beyond = s_max(seg.sys_, seg.p_) - S(1);
                seg.probe_margins(0, k, beyond + slide.below, beyond + slide.above, slide.w);
            } else {
                const Vec<S, M> h = switching(seg.sys_, t, x, seg.p_);
                for (int j = 0; j < M; ++j)
                    if (seg.mode_[j] == 0)
                        seg.probe_margins(j, k, slide.below[j], slide.above[j], slide.w);
                    else
                        seg.probe(Guard<M>::below(j), k, h[j]);
            }
            seg.probe_sections(k, t, x);
            return slide.f;
        }
        auto slopes(const S& t, const X& x) const { return seg.slopes(t, x); }
    };

    /// Derivatives of the field of the current mode, as its stages see it.
    Slopes<S, N> slopes(const S& t, const X& x) const {
        const auto field = [&](const auto& time, const auto& y, const auto& p) {
            return filippov::mode_field(
                sys_, mode_, time,
                mode_.sliding() > 0 ? toward(sys_, held_, time, y, p, scale_) : y, p);
        };
        Slopes<S, N> slopes = slopes_of(field, t, x, p_);
        slopes.size = scale_;
        return slopes;
    }

    /// First step size by the field of the current mode: Hairer, Norsett, Wanner I, II.4, in the
    /// system's own unit of time, whatever the user's is: the time in which the field, or its
    /// change, makes as much as there is.
    S estimate_first_step(const S& span) const {
        using std::pow;
        using std::sqrt;
        constexpr S infinity = std::numeric_limits<S>::infinity();
        const X f0 = mode_field(clock_.local, x_);
        const S d0 = norm(x_), d1 = norm(f0);
        const bool some = d0 >= S(1e-5) && d0 < infinity;
        S h0 = some && d1 > S(0) ? S(0.01) * std::min(S(d0 / d1), span) : S(1e-6) * span, d2(0);
        for (int k = 0; k < 8; ++k) { // an Euler step may leave the domain of the field
            const X y = x_ + S(direction_) * h0 * f0;
            const X f1 = mode_field(S(clock_.local + S(direction_) * h0), y);
            d2 = norm(X(f1 - f0)) / h0;
            if (d2 < infinity)
                break;
            h0 /= S(10);
        }
        S unit = std::min(S(d0 / d1), S(sqrt(d0 / d2)));
        // a field of rounding size has no unit (over no time at all, any field is as small)
        const bool still = d1 * span < S(1e-13) * d0 && span > S(1e3) * resolution();
        if (!some || still || !(unit < infinity)) {
            unit = S(1e-4) * span;
            if (d2 * span <= S(1e-9) * d1) // what moves steadily may soon be somewhere
                unit = std::min(unit, S(S(1e3) / d1));
        }
        const S most = std::max(S(d1 * unit), S(d2 * unit * unit));
        const S h = unit * std::min(S(1), S(pow(S(0.01) / most, S(1) / S(Tableau::order))));
        // With no absolute tolerance at x = 0 nothing is small: the error test will find the size.
        return h > S(0) && h < infinity ? h : S(1e-6) * span;
    }

    X mode_field(const S& t, const X& x) const {
        return filippov::mode_field(sys_, mode_, t, x, p_);
    }

    // --- guards --------------------------------------------------------------------------------

    bool active(int g) const {
        if (!trace(g).watched)
            return false;
        if (g >= Guard<M>::first_section)
            return g - Guard<M>::first_section < sections_.size();
        if (g % 3 == 2) // one for all the surfaces slid on
            return g / 3 == sliding_surface(mode_);
        return mode_[g / 3] == 0 || g % 3 == 0;
    }
    void list_active() {
        n_active_ = 0;
        for (int g = 0; g < n_guards; ++g)
            if (active(g))
                active_[idx(n_active_++)] = g;
    }
    std::span<const int> active_guards() const { return {active_.data(), idx(n_active_)}; }

    /// A guard before it is given its sense.
    S raw_guard(int g, const S& t, const X& x) const {
        if (g >= Guard<M>::first_section)
            return sections_.value(g - Guard<M>::first_section, S(clock_.offset() + t), x, p_);
        const int j = g / 3;
        if (mode_[j] != 0)
            return switching(sys_, t, x, p_)[j];
        const Margin<S> margin = sliding_margin(sys_, mode_, j, t, x, p_);
        if (g % 3 == 2)
            return margin.w;
        return s_max(sys_, p_) - S(1) + (g % 3 == 0 ? margin.below : margin.above);
    }
    /// Oriented value of a guard: positive before the event.
    S guard_value(int g, const S& t, const X& x) const {
        return trace(g).sense * raw_guard(g, t, x);
    }

    FILIPPOV_INLINE void probe_margins(int slid, std::size_t k, const S& below, const S& above,
                                       const S& w) {
        for (const auto& [g, value] :
             {std::pair{Guard<M>::below(slid), below}, std::pair{Guard<M>::above(slid), above},
              std::pair{Guard<M>::transversal(slid), w}})
            probe(g, k, value);
    }
    /// The value of guard g, not oriented yet, at probe k of the step.
    FILIPPOV_INLINE void probe(int g, std::size_t k, const S& value) {
        trace(g).probe[k] = trace(g).sense * value;
    }
    FILIPPOV_INLINE void probe_sections(std::size_t k, const S& t, const X& x) {
        if constexpr (Sec::capacity > 0)
            for (int q = 0; q < sections_.size(); ++q) {
                const int g = Guard<M>::first_section + q;
                probe(g, k, raw_guard(g, t, x));
            }
    }

    /// True unless the probes show that guard g stays clear of zero.
    template <class Path> FILIPPOV_INLINE bool doubtful(int g) const {
        using Times = typename Path::Times;
        const bool off_surface = g < Guard<M>::first_section && !Path::slides;
        // Off the surfaces a step with a NaN was rejected before.
        if (!off_surface && !(trace(g).template sum<Times>() < std::numeric_limits<S>::infinity()))
            return true;
        return trace(g).template doubtful<Times>(may_swing<Path>(g));
    }
    template <class Path> FILIPPOV_INLINE bool any_doubt() const {
        for (const int g : active_guards())
            if (doubtful<Path>(g))
                return true;
        return false;
    }
    /// A field can be constant, and then no error estimate keeps a step from spanning many swings
    /// of h, or, as a matter of course, in a slide of s.
    template <class Path> bool may_swing(int g) const {
        return Path::slides && g < Guard<M>::first_section && mode_[g / 3] == 0;
    }
    template <class Path> FILIPPOV_INLINE bool swings() const {
        using Times = typename Path::Times;
        for (const int g : active_guards()) {
            const bool transversal = g % 3 == 2;
            if (g >= Guard<M>::first_section || Path::slides != (mode_[g / 3] == 0) ||
                (transversal && M == 1))
                continue;
            const S band = transversal ? S(64) * epsilon<S> : touch_band(g, false);
            if (trace(g).template swings<Times>(band))
                return true;
        }
        return false;
    }

    /// Minima of guard g closer to zero than this count as touches: the error that the tolerance
    /// allows, or rounding.
    S touch_band(int g, bool rounding_only) const {
        if (g >= Guard<M>::first_section || (mode_[g / 3] == 0 && g % 3 == 2))
            return S(0);
        const int j = g / 3;
        const bool fixed = settings_.fixed_step > S(0);
        if (mode_[j] == 0 && is_kind(sys_, j, SurfaceKind::jump))
            return S(0); // a share of the push has no scale
        if (mode_[j] == 0)
            return S(64) * epsilon<S> + (fixed || rounding_only ? S(0) : settings_.rtol);
        const S rounding = rounding_band(sys_, j, clock_.local, x_, p_);
        if (fixed || rounding_only)
            return rounding;
        return rounding + change_over(sys_, j, clock_.local, x_, p_, scale_);
    }

    /// True if the far side of surface j leads back to it: a touch within the tolerance then
    /// changes nothing.
    bool far_side_attracts(int j, const S& t, const X& x) const {
        if (is_kind(sys_, j, SurfaceKind::jump))
            return true; // there is no far side: a jump from a touch changes nothing either
        Mode<M> far = mode_;
        far.set(j, -mode_[j]);
        const X f = filippov::mode_field(sys_, far, t, x, p_);
        return S(direction_ * mode_[j]) * normal_component(sys_, j, t, x, p_, f) > S(0);
    }

    struct Found {
        int guard = -1;
        S theta = S(2);
        bool touch = false;
    };

    /// True if x1 and every stage are finite, and h at every stage.
    FILIPPOV_INLINE bool finite(const X& x1) const {
        X sum = x1 + rk_.sum_of_stages();
        S total(0);
        for (int i = 0; i < N; ++i)
            total += sum[i];
        for (int j = 0; j < M; ++j)
            if (mode_[j] != 0)
                total += trace(Guard<M>::below(j)).template sum<StepTimes>();
        return total * S(0) == S(0);
    }
    bool starts_on_root() const {
        for (const int g : active_guards())
            if (trace(g).order > 0)
                return true;
        return false;
    }

    /// True of a guard that starts on a root and has not left it by more than rounding in a step:
    /// that step is too short to tell.
    template <class Path> bool says_nothing(int g) const {
        if (g >= Guard<M>::first_section || trace(g).order == 0 || trace(g).sense == S(0))
            return false;
        const Range<S> r = trace(g).template range<typename Path::Times>();
        const S band = touch_band(g, true);
        return r.high <= band && r.low >= -band;
    }

    /// How near to a root at the start of a step nothing can be told from its quotient.
    template <class Path> S root_sliver(int g) const {
        using std::pow;
        using std::sqrt;
        const Range<S> r = trace(g).template range<typename Path::Times>();
        const S lost = S(4) * touch_band(g, true) / std::max(r.high, -r.low);
        const int order = trace(g).order;
        const S least = order == 1 ? S(1e-9) : std::max(S(1e-3), sqrt(sqrt(epsilon<S>)));
        const S sliver = pow(lost, S(1) / S(order));
        return sliver > least ? std::min(sliver, S(0.5)) : least;
    }

    /// The earliest event of a step among the guards in doubt.
    template <class Path> FILIPPOV_COLD Found first_event(Path& path) {
        Found first;
        ++counters_.root_searches;
        for (const int g : active_guards()) {
            if ((settings_.skip_root_search && !doubtful<Path>(g)) || says_nothing<Path>(g))
                continue;
            const auto raw = [&](const S& theta) {
                return guard_value(g, S(clock_.local + theta * path.dt), path(theta));
            };
            if (trace(g).sense == S(0))
                find_sense(g, path, raw);
            // A function that stays zero (a section given as max(0, ...)) is not crossed again and
            // again.
            const bool from_zero = !(trace(g).start > S(0) && trace(g).order == 0);
            if (g >= Guard<M>::first_section && from_zero && raw(S(0.5)) == S(0) &&
                raw(S(1)) == S(0)) {
                trace(g).sense = S(0);
                continue;
            }
            if (const Found found = event_of(g, path, raw); found.theta < first.theta)
                first = found;
        }
        return first;
    }

    /// The side of a guard that starts exactly on zero: where the step goes.
    template <class Path, class Raw> void find_sense(int g, const Path& path, const Raw& raw) {
        trace(g).sense = S(1);
        const S early = raw(S(1e-3)), late = raw(S(1));
        if (early < S(0) || (early == S(0) && late < S(0)))
            trace(g).sense = S(-1);
        trace(g).probe[Path::Times::n] = guard_value(g, S(clock_.local + path.dt), path.x1);
    }

    /// The first root or touch of guard g, `raw` along the path.
    template <class Path, class Raw> Found event_of(int g, Path& path, const Raw& raw) {
        using Times = typename Path::Times;
        GuardTrace& w = trace(g);
        if (const std::size_t k = w.template falls_through<Times>())
            return {g,
                    bracketed_root<S>(raw, Times::theta(k - 1), k > 1 ? w.probe[k - 1] : w.start,
                                      Times::theta(k), w.probe[k]),
                    false};
        // The root at the start is divided out. Within the sliver the quotient is rounding (for a
        // double root, error of the interpolant): its value there is the one at the sliver's end.
        const int order = w.order;
        const S sliver = order == 0 ? S(0) : root_sliver<Path>(g);
        const auto value = [&](const S& theta) {
            if (order == 0)
                return raw(theta);
            const S u = std::max(theta, sliver);
            const S v = w.divided(raw(u), u);
            return theta < sliver ? abs_(v) : v;
        };
        S g0 = order == 0 ? w.start : value(S(0));
        if (!(g0 > S(0)))
            g0 = std::numeric_limits<S>::min();
        S theta(2);
        // A touch comes down to zero from outside its band: what still leaves it does not touch,
        // and is searched from where it has left.
        const S band = touch_band(g, false);
        const bool outside = order == 0 && (w.start > band || w.descended);
        Contact contact = first_contact(value, g0, outside ? band : S(0), theta);
        if (!outside && band > S(0)) {
            S touch = contact == Contact::none ? S(1) : theta;
            if (touch_after_leaving<Path>(g, raw, band, touch)) {
                contact = Contact::touch;
                theta = touch;
            }
        }
        if (contact == Contact::touch && g < Guard<M>::first_section && mode_[g / 3] != 0 &&
            !far_side_attracts(g / 3, S(clock_.local + theta * path.dt), path(theta)))
            contact = first_contact(value, g0, outside ? touch_band(g, true) : S(0), theta);
        if (contact == Contact::none && w.descended && first_minimum(raw, w.start, theta))
            contact = Contact::touch;
        w.descended =
            outside && contact == Contact::none && w.probe[Times::n] <= band && band > S(0);
        return contact == Contact::none ? Found{} : Found{g, theta, contact == Contact::touch};
    }

    /// The first touch of a guard that starts within its touch band, or on a root, after it has
    /// left the band and before theta.
    template <class Path, class Raw>
    bool touch_after_leaving(int g, const Raw& raw, const S& band, S& theta) const {
        using Times = typename Path::Times;
        if (!may_swing<Path>(g) && trace(g).template turns<Times>() == 0)
            return false; // it leaves, and that is all
        S from = S(1e-3), g0 = S(0);
        while (from < theta && !((g0 = raw(from)) > S(2) * band))
            from *= S(2);
        const S width = theta - from;
        if (!(width > S(0)))
            return false;
        const auto later = [&](const S& u) { return raw(S(from + u * width)); };
        S u(2);
        if (first_contact(later, g0, band, u) != Contact::touch)
            return false;
        theta = from + u * width;
        return true;
    }

    /// The minimum of a guard that still falls at the start of a step. Steps are cut where a
    /// contact is near, so the least distance tends to lie just behind the start, too close to it
    /// for the pieces of first_contact.
    template <class Raw> static bool first_minimum(const Raw& raw, const S& start, S& theta) {
        S u(1), later = raw(u);
        for (int k = 0; k < 40; ++k) {
            const S value = raw(S(u / S(2)));
            if (value < start && value <= later) {
                theta = minimum<S>(raw, S(0), u);
                return raw(theta) < start;
            }
            u /= S(2);
            later = value;
        }
        return false;
    }

    /// A guard that is zero to rounding at the end of a step is met there: the next step, or nobody
    /// at the end of the run, would find its root at the start.
    template <class Path> Found contact_at_end(Path& path, bool last) {
        for (const int g : active_guards()) {
            const GuardTrace& w = trace(g);
            if (w.order > 0 || w.sense == S(0))
                continue;
            const Range<S> r = w.template range<typename Path::Times>();
            const S size = std::max(abs_(r.low), abs_(r.high));
            if (!(abs_(w.probe[Path::Times::n]) <= S(1e-6) * size))
                continue;
            const S value = guard_value(g, S(clock_.local + path.dt), path.x1);
            const S band = g < Guard<M>::first_section ? touch_band(g, true)
                                                       : (last ? S(64) * epsilon<S> * size : S(-1));
            if (abs_(value) <= band && w.start > band)
                return {g, S(1), false};
        }
        return {};
    }

    // --- landing -------------------------------------------------------------------------------

    /// Derivative of guard g along the path at its end, times -1: positive before a minimum.
    S minus_slope(int g, const S& t, const X& x, const X& f) const {
        const int j = g / 3;
        if (mode_[j] != 0)
            return -trace(g).sense * normal_component(sys_, j, t, x, p_, f);
        const auto q = lift<1>(p_);
        const auto s = [&](const auto& time, const auto& y) {
            return sliding_margin(sys_, mode_, j, time, y, q).s;
        };
        return (g % 3 == 0 ? S(-1) : S(1)) * directional(s, t, x, S(1), f);
    }

    /// Shortens the step so that it ends on the event.
    template <class Path> FILIPPOV_COLD Stop land(Path& path, const Found& found) {
        const int g = found.guard;
        const X x_before = x_;
        const S full = path.dt;
        const S forward = S(direction_);
        const auto residual = [&] {
            const S t = clock_.local + path.dt;
            return found.touch ? forward * minus_slope(g, t, path.x1, path.end_field())
                               : guard_value(g, t, path.x1);
        };
        const auto on_target = [&] { return landed(path, g, found.touch); };
        const S slope = landing_slope(path, found);
        const Landed landing = Landing(path, clock_.local, nudge_tolerance(), residual, on_target)
                                   .run(found.theta * full, slope);
        counters_.landings += landing.trials;
        // An event at the end of the run is not after it.
        if (forward * (path.dt - remaining_) > S(0))
            path.shorten(remaining_);
        Stop stop;
        if (!landing.seen_beyond && !on_target()) { // the interpolant saw a root that no step has
            path.shorten(full);
            stop.missed = true;
            return stop;
        }
        stop.guard = g;
        stop.touch = found.touch;
        stop.jumped = landing.jumped;
        settle_on_surface(path, g, found.touch || landing.jumped);
        const bool flat = degenerate(g, path, x_before);
        accept(path);
        for (const int q : active_guards())
            if (q >= Guard<M>::first_section)
                trace(q).start_at(guard_value(q, clock_.local, x_));
        if (flat)
            stop.status = fail(Status::degenerate_surface, "grad h", g / 3);
        return stop;
    }

    template <class Path> S landing_slope(Path& path, const Found& found) {
        const int g = found.guard;
        const S step = found.touch ? S(1e-3) : S(1e-4);
        const S u = std::min(found.theta + step, S(1)), v = std::max(found.theta - step, S(0));
        const auto raw = [&](const S& theta) {
            return guard_value(g, S(clock_.local + theta * path.dt), path(theta));
        };
        if (!found.touch)
            return (raw(u) - raw(v)) / ((u - v) * path.dt);
        const S m = (u + v) / S(2), w = (u - v) / S(2) * path.dt;
        return -S(direction_) * (raw(u) - S(2) * raw(m) + raw(v)) / (w * w);
    }

    /// What a landing may leave to a Taylor step: a hundredth of the tolerance, or rounding if
    /// there is none.
    S nudge_tolerance() const {
        return settings_.fixed_step > S(0) ? S(0.01) * epsilon<S> / settings_.rtol : S(0.01);
    }

    /// True if the end of the path is on the surface of guard g but for the tolerance and the
    /// resolution of time: what lies farther off is not to be moved there.
    template <class Path> bool landed(const Path& path, int g, bool touch) const {
        if (touch || g >= Guard<M>::first_section || mode_[g / 3] == 0)
            return true;
        const int j = g / 3;
        const S t = clock_.local + path.dt;
        const S rate = normal_component(sys_, j, t, path.x1, p_, path.end_field());
        const S band = S(1e3) * rounding_band(sys_, j, t, path.x1, p_) +
                       S(8) * ulp(t) * abs_(rate) + change_over(sys_, j, t, path.x1, p_, scale_);
        return abs_(switching(sys_, t, path.x1, p_)[j]) <= band;
    }

    /// Puts the landed state on the surface that was met (not after a touch) and on the one slid
    /// on.
    template <class Path> void settle_on_surface(Path& path, int g, bool off_surface) {
        const S t = clock_.local + path.dt;
        const bool met = g < Guard<M>::first_section && mode_[g / 3] != 0 && !off_surface;
        path.x1 = project(sys_, met ? held_with(g / 3, t, path.x1) : held_, t, path.x1, p_, scale_);
    }
    /// What holds the solution in this mode, and surface j that it meets.
    Constraints<Sys> held_with(int j, const S& t, const X& x) const {
        Constraints<Sys> on = held_;
        on.add(j, false);
        if constexpr (single_v<Sys>)
            return on;
        else
            return on.of_state(sys_, t, x, p_);
    }

    /// True if the gradient of h vanishes where the surface was met: to first order the step
    /// explains less than a millionth of the change of h.
    template <class Path> bool degenerate(int g, const Path& path, const X& x_before) const {
        if (g >= Guard<M>::first_section || mode_[g / 3] == 0)
            return false;
        const int j = g / 3;
        const S t = clock_.local + path.dt;
        const X gradient = grad_h(sys_, j, t, path.x1, p_);
        S first_order = abs_(h_t(sys_, j, t, path.x1, p_) * path.dt);
        for (int i = 0; i < N; ++i)
            first_order += abs_(gradient[i] * (path.x1[i] - x_before[i]));
        const S change = abs_(switching(sys_, t, path.x1, p_)[j] -
                              switching(sys_, clock_.local, x_before, p_)[j]);
        return !(first_order > S(1e-6) * change) && change > S(0);
    }

    // --- integration ---------------------------------------------------------------------------

    void weigh(const X& x) {
        for (int i = 0; i < N; ++i)
            scale_[i] =
                std::max(S(settings_.atol[i] + settings_.rtol * abs_(x[i])), smallest_scale);
        limit(scale_, x, clock_.local, x);
    }
    /// Takes scales down to what the system lets a step from `from` to (t, x) err.
    FILIPPOV_INLINE void limit([[maybe_unused]] X& scale, [[maybe_unused]] const X& from,
                               [[maybe_unused]] const S& t, [[maybe_unused]] const X& x) const {
        if constexpr (HasLargestError<Sys, S>) {
            if constexpr (requires { sys_.limits_errors(); })
                if (!sys_.limits_errors())
                    return;
            const X largest = sys_.largest_error(clock_.local, from, t, x, p_);
            for (int i = 0; i < N; ++i)
                scale[i] = std::max(std::min(scale[i], largest[i]), smallest_scale);
        }
    }
    S norm(const X& v) const {
        using std::sqrt;
        S sum(0);
        for (int i = 0; i < N; ++i)
            sum += (v[i] / scale_[i]) * (v[i] / scale_[i]);
        return sqrt(sum / S(N));
    }
    /// Square of the error of a step in units of the tolerance.
    FILIPPOV_INLINE S step_error(const X& x1, const S& dt) const {
        X weight;
        for (int i = 0; i < N; ++i)
            weight[i] = std::max(scale_[i], S(settings_.atol[i] + settings_.rtol * abs_(x1[i])));
        limit(weight, x_, S(clock_.local + dt), x1);
        for (int i = 0; i < N; ++i)
            weight[i] = dt / weight[i];
        return Tableau::squared_error(rk_, weight);
    }

    /// Takes the step along a path: observer, state, clock.
    template <class Path> FILIPPOV_INLINE void accept(Path& path) {
        Clock<S> next = clock_;
        next.advance(path.dt);
        if (path.dt == remaining_)
            next = end_;
        if constexpr (Obs::wants_steps)
            observer_.on_step(StepView<S, N, M>{clock_, next, path.dt, x_, path.x1, mode_}, path);
        x_ = path.x1;
        weigh(x_);
        clock_ = next;
        ++counters_.steps;
        if constexpr (Obs::wants_steps)
            let_observer_skip();
    }
    template <class Path> FILIPPOV_INLINE void keep_guard_values() {
        for (const int g : active_guards()) {
            if (trace(g).order > 0 && says_nothing<Path>(g)) [[unlikely]]
                continue; // still on its root
            trace(g).start = trace(g).probe[Path::Times::n];
            trace(g).order = 0;
        }
    }

    /// A step over [clock, clock + dt] by the method, its interpolant built when first
    /// asked for.
    template <class Rhs> struct TrialPath {
        using Times = StepTimes;
        static constexpr bool slides = Rhs::slides;

        Segment& seg;
        Rhs& rhs;
        S dt;
        X x1;
        bool built = false;
        typename Stepper::Polynomial polynomial;

        TrialPath(Segment& segment, Rhs& field, const S& step)
            : seg(segment), rhs(field), dt(step) {}

        X on_surface(const X& x, const S& t) const {
            if constexpr (Rhs::slides)
                return project(seg.sys_, seg.held_, t, x, seg.p_, seg.scale_);
            else
                return x;
        }
        void put_end_on_surface() {
            x1 = on_surface(x1, S(seg.clock_.local + dt));
            built = false;
        }
        /// Probes the guards along the interpolant.
        void probe() {
            for (std::size_t k = 1; k <= Times::n; ++k) {
                const S theta = Times::theta(k);
                rhs.probe(k, S(seg.clock_.local + theta * dt), (*this)(theta));
            }
        }
        X operator()(const S& theta) {
            if (!built) {
                polynomial = seg.rk_.interpolant(rhs, seg.clock_.local, seg.x_, dt, x1);
                seg.counters_.field += Tableau::extra_stages;
                ++seg.counters_.interpolants;
                built = true;
            }
            return on_surface(polynomial(theta), S(seg.clock_.local + theta * dt));
        }
        /// Leaves what is needed to evaluate this step later.
        template <class Piece> void store(Piece& piece) {
            (*this)(S(0));
            for (std::size_t m = 0; m < polynomial.c.size(); ++m)
                piece.polynomial.c[m] = polynomial.c[m];
        }
        bool finite() const { return all_finite<S, N>(x1); }
        const X& end_field() const { return seg.rk_.k[Stepper::last]; }
        FILIPPOV_COLD void shorten(const S& d) {
            seg.rk_.step(rhs, seg.clock_.local, seg.x_, d, x1);
            x1 = on_surface(x1, S(seg.clock_.local + d));
            seg.counters_.field += Tableau::stages - 1;
            dt = d;
            built = false;
        }
        /// Moves the end by a second-order Taylor step, x'' from the stages.
        void nudge(const S& delta) {
            X& end = seg.rk_.k[Stepper::last];
            for (int i = 0; i < N; ++i) {
                const S bend = dt != S(0) ? (end[i] - seg.rk_.k[0][i]) / dt : S(0);
                x1[i] += delta * (end[i] + delta / S(2) * bend);
                end[i] += delta * bend;
            }
            dt += delta;
            x1 = on_surface(x1, S(seg.clock_.local + dt));
            built = false;
        }
        /// Bound on the error of a nudge in units of the tolerance: all of its second-order term.
        S nudge_error(const S& delta) const {
            X bend;
            for (int i = 0; i < N; ++i)
                bend[i] = (end_field()[i] - seg.rk_.k[0][i]) / dt;
            return seg.norm(bend) * delta * delta;
        }
    };

    /// The smallest step that still moves the clock.
    S resolution() const { return S(4) * ulp(clock_.local); }

    /// Not ok if the steps are used up or the observer asks to stop.
    Status may_go_on() {
        if (counters_.steps + counters_.rejected >= settings_.max_steps)
            return fail(Status::max_steps, "");
        if constexpr (requires { observer_.interrupted(); })
            if (((counters_.steps + counters_.rejected) & 255) == 0 && observer_.interrupted())
                return fail(Status::interrupted, "");
        return Status::ok;
    }

    /// When surface j would be met at the present rate; infinite if the rate is (as a root's is,
    /// where it ends), which tells nothing.
    S time_to_surface(int j) const {
        constexpr S infinity = std::numeric_limits<S>::infinity();
        const S rate = normal_component(sys_, j, clock_.local, x_, p_, rk_.k[0]);
        return abs_(rate) < infinity ? -switching(sys_, clock_.local, x_, p_)[j] / rate : infinity;
    }

    /// The next trial after a stage that was not finite: nearly to the surface if the step led
    /// across it (the field may not exist beyond), else a quarter.
    FILIPPOV_COLD S shorter_than(const S& dt) const {
        for (int j = 0; j < M; ++j) {
            if (mode_[j] == 0)
                continue;
            const S eta = time_to_surface(j);
            if (eta / dt > S(0) && eta / dt < S(1))
                return S(0.9) * eta;
        }
        return dt / S(4);
    }
    /// Where a field ends at its surface no step reaches across: the surface is met when the time
    /// left to it is below the resolution of time.
    FILIPPOV_COLD Stop contact_at_edge() {
        Stop stop;
        for (int j = 0; j < M; ++j) {
            if (mode_[j] == 0)
                continue;
            const S eta = time_to_surface(j);
            if (!(S(direction_) * eta >= S(0) && abs_(eta) <= S(8) * resolution()))
                continue;
            x_ = project(sys_, held_with(j, clock_.local, x_), clock_.local, x_, p_, scale_);
            stop.guard = Guard<M>::below(j);
        }
        return stop;
    }
    FILIPPOV_COLD Status fail_small(bool bad_stage) {
        if (!bad_stage)
            return fail(Status::step_too_small, "");
        std::string_view what;
        for (int k = 1; k <= 64 && what.empty(); k *= 2) {
            const S dt = S(direction_) * S(k) * resolution();
            what = what_is_not_finite(S(clock_.local + dt), X(x_ + dt * rk_.k[0]));
        }
        if (what.empty())
            what = what_is_not_finite(clock_.local, x_);
        return fail(Status::not_finite, what.empty() ? "a stage of the step" : what);
    }

    /// How far the next step should go: a fifth beyond the contact that a parabola through h over
    /// the last step foresees. One-sided fields may grow wild behind their surface (a pole, a
    /// square root), and steps that plunge there are mostly rejected.
    template <class Path> FILIPPOV_INLINE S reach_after(const S& dt) const {
        S nearest = std::numeric_limits<S>::infinity();
        for (int j = 0; j < M; ++j) {
            const GuardTrace& w = trace(Guard<M>::below(j));
            if (mode_[j] != 0 && w.watched && w.order == 0)
                nearest = std::min(nearest, w.template next_zero<typename Path::Times>());
        }
        return std::max(S(1.2) * nearest * abs_(dt), S(16) * resolution());
    }

    /// A step to be tried.
    struct Trial {
        S dt;      ///< signed
        bool cut;  ///< shorter than proposed, before a surface
        bool last; ///< it ends where the run does
    };
    FILIPPOV_INLINE Trial trial(bool fixed) const {
        Trial t{dt_, false, false};
        if (abs_(t.dt) > settings_.max_step)
            t.dt = S(direction_) * settings_.max_step;
        t.cut = !fixed && abs_(t.dt) > reach_;
        if (t.cut)
            t.dt = S(direction_) * reach_;
        t.last = S(direction_) * t.dt >= S(direction_) * remaining_ * (S(1) - S(1e-9));
        if (t.last)
            t.dt = remaining_;
        return t;
    }
    /// Steps have shrunk to nothing: an event at the edge of where the field is, or the end.
    FILIPPOV_COLD Stop too_small(bool bad_stage) {
        Stop stop = bad_stage ? contact_at_edge() : Stop{};
        if (bad_stage && stop.guard < 0 && mode_.sliding() > 1)
            stop.guard = Guard<M>::transversal(sliding_surface(mode_)); // no blend beyond
        return stop.guard >= 0 ? stop : Stop{fail_small(bad_stage)};
    }
    /// The next step, after one that was good.
    template <class Path>
    FILIPPOV_INLINE void propose(const Trial& t, const S& error, bool unjudged) {
        constexpr bool slides = Path::slides;
        // A step cut by the end of the run, or before a surface, does not shrink the next proposal;
        // one that ends at an event keeps the full step's.
        S proposed = t.dt * S(control_.after_accept(static_cast<double>(error)));
        // a step that is far too long shows nothing of its swings
        if (unjudged && swings_seen_ && !slides && abs_(proposed) > S(2) * abs_(t.dt))
            proposed = S(2) * t.dt;
        if (!(t.last || t.cut) || abs_(proposed) > abs_(dt_))
            dt_ = proposed;
        const S further = slides ? S(1.25) * reach_ : std::numeric_limits<S>::infinity();
        reach_ = slides && M == 1 ? further : std::min(further, reach_after<Path>(t.dt));
    }

    template <class Rhs> FILIPPOV_FLATTEN Stop run(Rhs rhs) {
        if (!have_k0_) {
            rk_.begin(rhs.field(clock_.local, x_));
            ++counters_.field;
            have_k0_ = true;
            if (!all_finite<S, N>(rk_.k[0]))
                return {fail(Status::not_finite, what_is_not_finite(clock_.local, x_))};
        }
        const bool fixed = settings_.fixed_step > S(0);
        bool bad_stage = false;
        reach_ = Rhs::slides ? std::numeric_limits<S>::infinity() : first_reach_;
        first_reach_ = std::numeric_limits<S>::infinity();
        for (;;) {
            remaining_ = clock_.until(end_);
            if (!(S(direction_) * remaining_ > S(0)))
                return {};
            if (const Status status = may_go_on(); status != Status::ok)
                return {status};
            const auto [dt, cut, last] = trial(fixed);
            if (abs_(dt_) < resolution() && !(last && !bad_stage))
                return too_small(bad_stage);

            TrialPath<Rhs> path(*this, rhs, dt);
            rk_.step(rhs, clock_.local, x_, dt, path.x1);
            counters_.field += Tableau::stages - 1;
            if constexpr (!Stepper::probes_stages)
                path.probe();
            const bool good = finite(path.x1);
            const S error = good && !fixed ? step_error(path.x1, dt) : S(0);
            if (!good || !(error <= S(1))) {
                ++counters_.rejected;
                bad_stage = !good || !(error < std::numeric_limits<S>::infinity());
                dt_ = bad_stage ? shorter_than(dt)
                                : dt * S(control_.after_reject(static_cast<double>(error)));
                if (bad_stage && fixed)
                    return {fail_small(true)};
                continue;
            }
            const bool unjudged = !(error > S(1e-10)); // (it is a square)
            if ((Rhs::slides || unjudged) && !fixed && abs_(dt) > S(64) * resolution() &&
                swings<TrialPath<Rhs>>()) {
                ++counters_.rejected;
                reach_ = abs_(dt) / S(2);
                if (!Rhs::slides) {
                    dt_ = dt / S(2);
                    swings_seen_ = true;
                }
                continue;
            }
            path.put_end_on_surface();

            Found found;
            if (!settings_.skip_root_search || any_doubt<TrialPath<Rhs>>()) {
                // a step of a few ulp from a root has no inside: the root divided out leaves
                // rounding
                if (abs_(dt) > S(8) * resolution() || !starts_on_root())
                    found = first_event(path);
                if (found.guard < 0)
                    found = contact_at_end(path, last);
            }
            if (!fixed)
                propose<TrialPath<Rhs>>({dt, cut, last}, error, unjudged);
            bad_stage = false;
            if (found.guard >= 0) {
                const Stop stop = land(path, found);
                if (!stop.missed) {
                    rk_.go_on();
                    return stop;
                }
            }
            accept(path);
            rk_.go_on();
            keep_guard_values<TrialPath<Rhs>>();
        }
    }

    struct StraightPath {
        S dt;
        X x0, x1;

        X operator()(const S& theta) const {
            X x;
            for (int i = 0; i < N; ++i)
                x[i] = x0[i] + theta * (x1[i] - x0[i]);
            return x;
        }
        template <class Piece> void store(Piece& piece) const {
            piece.polynomial.c[0] = x0;
            piece.polynomial.c[1] = x1 - x0;
        }
    };

    // --- slides in closed form -----------------------------------------------------------------

    /// A window of a slide that the system knows in closed form.
    struct ClosedFormPath {
        using Times = WindowTimes<S>;
        static constexpr bool slides = true;

        Segment& seg;
        S dt;
        X x1;

        X operator()(const S& theta) const {
            return seg.sys_.sliding_flow(seg.clock_.local, seg.x_, seg.p_, S(theta * dt));
        }
        template <class Piece> void store(Piece& piece) const { piece.closed_form = true; }
        bool finite() const { return all_finite<S, N>(x1); }
        X end_field() const { return seg.mode_field(S(seg.clock_.local + dt), x1); }
        void shorten(const S& d) {
            dt = d;
            x1 = (*this)(S(1));
        }
        void nudge(const S& delta) { shorten(dt + delta); }
        S nudge_error(const S&) const {
            return std::numeric_limits<S>::infinity();
        } // re-evaluating is as cheap
    };

    Stop run_closed_form() {
        have_k0_ = false;
        // A forced s swings with the period: windows of half of it show it.
        const S longest =
            clock_.period > S(0) ? clock_.period / S(2) : std::numeric_limits<S>::infinity();
        S window = clock_.period > S(0) ? longest / S(4) : abs_(dt_);
        for (;;) {
            remaining_ = clock_.until(end_);
            if (!(S(direction_) * remaining_ > S(0)))
                return {};
            if (const Status status = may_go_on(); status != Status::ok)
                return {status};
            window = std::max(std::min({window, longest, settings_.max_step}), resolution());
            const bool last = window >= abs_(remaining_);
            ClosedFormPath path{*this, last ? remaining_ : S(direction_) * window, X(x_)};
            for (std::size_t k = 1; k <= WindowTimes<S>::n; ++k) {
                const S theta = WindowTimes<S>::theta(k);
                path.x1 = path(theta);
                probe_slide(k, S(clock_.local + theta * path.dt), path.x1);
            }
            if (!all_finite<S, N>(path.x1))
                return {fail(Status::not_finite, "sliding_flow")};
            Found found;
            if (!settings_.skip_root_search || any_doubt<ClosedFormPath>()) {
                found = first_event(path);
                if (found.guard < 0)
                    found = contact_at_end(path, last);
            }
            if (found.guard >= 0)
                return land(path, found);
            accept(path);
            keep_guard_values<ClosedFormPath>();
            window *= S(4);
        }
    }

    void probe_slide(std::size_t k, const S& t, const X& x) {
        const Margin<S> margin = sliding_margin(sys_, mode_, t, x, p_);
        const S beyond = s_max(sys_, p_) - S(1);
        probe_margins(0, k, beyond + margin.below, beyond + margin.above, margin.w);
        probe_sections(k, t, x);
    }

    static constexpr S smallest_scale =
        std::numeric_limits<S>::min() / std::numeric_limits<S>::epsilon();

    const Sys& sys_;
    const P p_;
    const Settings<S, N>& settings_;
    Obs& observer_;
    const Sec& sections_;
    Clock<S> clock_{}, end_{};
    X x_;
    Mode<M> mode_{};
    Constraints<Sys> held_{}; ///< what holds the solution in this mode
    int direction_ = 1;
    S dt_ = S(0);
    S natural_step_ = S(0); ///< what the first step would be if no setting said otherwise
    S reach_ = std::numeric_limits<S>::infinity(); ///< where the next step should end at the latest
    S first_reach_ = std::numeric_limits<S>::infinity(); ///< of the first step after an event
    S remaining_ = S(0);       ///< from the clock to the end of the run, at the last trial
    S dt_before_slide_ = S(0); ///< the proposal when the last slide began; 0: the run began in it
    bool have_k0_ = false;
    bool swings_seen_ = false; ///< of h, in a step of which no error estimate told anything
    Stepper rk_;
    StepControl<Tableau> control_;
    X scale_;
    std::array<GuardTrace, n_guards> traces_{};
    std::array<int, n_guards> active_{}; ///< those that this mode has and somebody watches
    int n_active_ = 0;
    Counters counters_{};
    Diagnosis<S, N, M> diagnosis_{};
};

/// Where a forced segment ended.
template <class S, int N, int M> struct SegmentResult {
    Status status = Status::ok; ///< `event` if the target was met, `ok` at t_end
    Clock<S> clock{};
    S t{};
    Vec<S, N> x{};
    Counters counters{};
    Diagnosis<S, N, M> diagnosis{};
};

/// Follows one forced mode from x0 at t0 to the first root of a target, or to t_end.
///
/// Nothing is judged: a slide goes on beyond |s| = 1, a one-sided field beyond its side as long as
/// it is finite, and other surfaces are passed. So the end depends smoothly on the start wherever
/// the target is met transversally, which shooting and continuation need.
/// @param target  Guard<M>::below(j): h_j = 0, or in a slide s = -1; Guard<M>::above(j): s = +1;
/// -1: none.
///                A target that is zero at the start is not found there.
/// @error std::invalid_argument as in `flow`; else a Status
template <class Tableau, class Sys, std::floating_point S, class Obs>
SegmentResult<S, dim_v<Sys>, surfaces_v<Sys>>
segment(const Sys& sys, const Params<Sys, std::type_identity_t<S>>& p,
        const Mode<surfaces_v<Sys>>& mode, const Vec<S, dim_v<Sys>>& x0, std::type_identity_t<S> t0,
        std::type_identity_t<S> t_end, int target, const Settings<S, dim_v<Sys>>& settings,
        Obs& observer) {
    require_system<Sys>();
    validate(settings);
    validate_start(x0, t0, t_end, p, given_params(sys));
    using Sec = std::conditional_t<std::is_same_v<Obs, Listener<S, dim_v<Sys>, surfaces_v<Sys>>>,
                                   AnySections<S, dim_v<Sys>, params_v<Sys>>, Sections<>>;
    const Sec none;
    Segment<Sys, S, Tableau, Obs, Sec> run(sys, p, t0, x0, t_end, settings, observer, none);
    run.enter(mode);
    run.choose_first_step();
    run.watch_only(target);
    const Stop stop = run.advance();
    SegmentResult<S, dim_v<Sys>, surfaces_v<Sys>> result;
    result.status = stop.status != Status::ok ? stop.status
                    : stop.guard >= 0         ? Status::event
                                              : Status::ok;
    result.clock = run.clock();
    result.t = result.clock.absolute();
    result.x = run.x();
    result.counters = run.counters();
    result.diagnosis = run.diagnosis();
    return result;
}

/// The same, and nothing kept on the way.
template <class Tableau, class Sys, std::floating_point S>
SegmentResult<S, dim_v<Sys>, surfaces_v<Sys>>
segment(const Sys& sys, const Params<Sys, std::type_identity_t<S>>& p,
        const Mode<surfaces_v<Sys>>& mode, const Vec<S, dim_v<Sys>>& x0, std::type_identity_t<S> t0,
        std::type_identity_t<S> t_end, int target, const Settings<S, dim_v<Sys>>& settings) {
    Nothing nothing;
    return segment<Tableau>(sys, p, mode, x0, t0, t_end, target, settings, nothing);
}

} // namespace filippov
