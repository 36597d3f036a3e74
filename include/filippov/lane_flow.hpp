// SPDX-License-Identifier: BSD-3-Clause
// The event loop in lanes: many members of an ensemble at once, each with its own time, step, mode
// and parameters.
//
// Members wait in lists by what is to be done with them next: a start, a step in slip below or
// above the surface, the end of one that falls through it, an event in such a step, a step along a
// slide or a window of one that is known in closed form, and what may end it. A list is worked off
// in full registers, so that no lane waits for another: one that is done is refilled from the list,
// and goes on to the list of its next task. What a lane computes depends on its own member alone.
// Whatever is not plain (a touch, a tangency, a point where the solution is not unique, a field
// that is not finite) goes to the scalar engine for a while, which judges it as it judges
// everything.
#pragma once

#include <filippov/lane_guards.hpp>
#include <filippov/population.hpp>

#include <bit>
#include <vector>

namespace filippov {

/// Systems whose members can run in lanes. A system that branches on its scalars declares
/// `static constexpr bool lanes = false`, and is run by the scalar engine.
template <class Sys>
concept RunsInLanes = surfaces_v<Sys> == 1 && HasSides<Sys, Lanes<1>> && HasSwitch<Sys, Lanes<1>> &&
                      !requires { requires !Sys::lanes; };

/// Runs members in W lanes, on one thread.
template <class Sys, int W, class Tableau> class LaneFlow {
    static constexpr int N = dim_v<Sys>;
    static constexpr int P = params_v<Sys>;
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, N>;
    using Q = Vec<T, P>;
    using Rk = RungeKutta<Tableau, T, N>;
    using Times = StageTimes<Tableau, double>;
    static constexpr unsigned all_lanes = W == 32 ? ~0u : (1u << W) - 1u;
    /// Slides are known in closed form.
    static constexpr bool knows_slides = HasSlidingFlow<Sys, T>;

public:
    LaneFlow(const Sys& sys, const Settings<double, N>& settings, const ScalarEngine<N, P>& scalar,
             Population<N, P>& population, Worker& worker)
        : sys_(sys), settings_(settings), scalar_(scalar), population_(population), worker_(worker),
          slots_(pool) {
        for (int i = 0; i < N; ++i)
            bounded_ = bounded_ || population.escape[i] < infinite;
        for (int s = pool; s-- > 0;)
            free_.push_back(s);
        for (auto& list : lists_)
            list.reserve(pool);
    }

    /// Runs members `next` to `end`; those that were not run to their end when the worker is
    /// stopped are not told of.
    LaneCounters run(std::size_t next, std::size_t end) {
        counters_.width = W;
        next_ = next;
        end_ = end;
        while (!worker_.stopped()) {
            take_new_members();
            const Task task = longest_list();
            if (lists_[task].empty())
                break;
            work_off(task);
        }
        return counters_;
    }

private:
    // --- members in memory and in lanes --------------------------------------------------------

    /// What is to be done with a member next.
    enum Task : std::size_t {
        start,
        slip_below,
        slip_above,
        fall_below, ///< at the end of a step that falls through the surface
        fall_above,
        event_below, ///< of a step in doubt
        event_above,
        slide,
        slide_end, ///< of a step or a window in doubt
        n_tasks
    };
    static constexpr Task slip_task(int side) { return side < 0 ? slip_below : slip_above; }
    static constexpr Task fall_task(int side) { return side < 0 ? fall_below : fall_above; }
    static constexpr Task event_task(int side) { return side < 0 ? event_below : event_above; }

    /// The numbers of a member that its lane computes with.
    enum Field : std::size_t {
        time,        ///< since the period began; since ever without one
        carry,       ///< what rounding cut off it
        index,       ///< of the period
        left,        ///< time to the end of the run, or of its leg
        proposal,    ///< of the next step
        reach,       ///< where the next step should end at the latest; in a window: of its end
        trial,       ///< the step in doubt; the next window of a slide in closed form
        start_value, ///< of the guard at the start of the step; of s in a slide
        start_order, ///< of a root there, 0: none
        last_error,  ///< of the step control, with ...
        largest,     ///< ... the largest factor
        tries,       ///< steps
        state,
        field = state + N,  ///< there
        across = field + N, ///< L1 - L2 there, in a slide that is not known in closed form
        n_changed = across + (knows_slides ? 0 : 1),
        end_time = n_changed, ///< of the run, or of its leg
        end_index,
        n_moved,
        fall_end = n_moved, ///< the guard at the end of a step that falls through the surface, ...
        fall_slope,         ///< ... and its derivative there
        n_of_fall,
        period_length = n_of_fall, ///< 0: none
        longest_step,
        param,
        n_fields = param + P,
    };
    struct Slot {
        std::array<double, n_fields> v;
        std::size_t id;
        double before_slide; ///< the proposal when the last slide began
        double slid;         ///< time spent in slides
        double slid_left;    ///< `left` where the last slide, or this leg of it, began
        double leg;          ///< time from the start to the end of the run, or of its leg
        std::int32_t events, slides;
        signed char mode;   ///< in which it goes on; `none`: it did not begin yet
        signed char before; ///< mode before the event at which it stands; `none`: it stands at none
        signed char guard;  ///< met there
    };
    static constexpr signed char none = 2;

    /// Members in lanes. A lane without one computes on what was there before.
    struct Group {
        std::array<T, n_fields> v;
        std::array<int, W> slot;
        unsigned active = 0;

        T& operator[](Field f) { return v[f]; }
        const T& operator[](Field f) const { return v[f]; }
        X x() const { return vector<N>(state); }
        X k0() const { return vector<N>(field); }
        Q p() const { return vector<P>(param); }
        Mask members() const { return Mask::from_word(active); }
        void set(Field f, const T& value, const Mask& where) { v[f] = select(where, value, v[f]); }
        void set(Field first, const X& x, const Mask& where) {
            for (std::size_t i = 0; i < N; ++i)
                v[first + i] = select(where, x[Eigen::Index(i)], v[first + i]);
        }

    private:
        template <int n> Vec<T, n> vector(Field first) const {
            Vec<T, n> r;
            for (std::size_t i = 0; i < n; ++i)
                r[Eigen::Index(i)] = v[first + i];
            return r;
        }
    };

    static constexpr int pool = 64 * W;

    static void each_lane(unsigned word, const auto& f) {
        for (; word != 0; word &= word - 1)
            f(std::countr_zero(word));
    }
    Slot& slot_of(const Group& g, int l) { return slots_[std::size_t(g.slot[std::size_t(l)])]; }

    void load(Group& g, int l, int slot, std::size_t n) {
        const Slot& from = slots_[std::size_t(slot)];
        const Mask lane = Mask::from_word(1u << l);
        for (std::size_t f = 0; f < n; ++f) // whole registers: a part stored, and the whole loaded
            g.v[f] = select(lane, T(from.v[f]), g.v[f]); // at once, would wait for the memory
        g.slot[std::size_t(l)] = slot;
        g.active |= 1u << l;
    }
    /// The same for all lanes, from the end of a list.
    void load_all(Group& g, std::vector<int>& list, std::size_t n) {
        std::array<const double*, W> from;
        for (std::size_t l = 0; l < W; ++l) {
            g.slot[l] = list.back();
            from[l] = slots_[std::size_t(list.back())].v.data();
            list.pop_back();
        }
        for (std::size_t f = 0; f < n; ++f)
            g.v[f] = T::of([&](int l) { return from[std::size_t(l)][f]; });
        g.active = all_lanes;
    }
    /// Takes the member out of its lane.
    int unload(Group& g, int l) {
        Slot& to = slot_of(g, l);
        for (std::size_t f = 0; f < n_changed; ++f)
            to.v[f] = g.v[f][l];
        g.active &= ~(1u << l);
        return g.slot[std::size_t(l)];
    }
    void leave(Group& g, int l, Task next) { lists_[next].push_back(unload(g, l)); }

    /// Fills lanes without a member from a list.
    void fill(Group& g, Task task) {
        auto& list = lists_[task];
        const std::size_t n = !population_.same_params                   ? n_fields
                              : task == fall_below || task == fall_above ? n_of_fall
                                                                         : n_moved;
        if (g.active == 0 && list.size() >= std::size_t(W))
            return load_all(g, list, n);
        for (unsigned idle = all_lanes & ~g.active; idle != 0 && !list.empty(); idle &= idle - 1) {
            load(g, std::countr_zero(idle), list.back(), n);
            list.pop_back();
        }
    }
    /// A group's first members. Lanes without one hold a copy of another, so that they compute
    /// nothing strange, and all have the parameters, should these be the same.
    void begin_group(Group& g, Task task) {
        const Slot& first = slots_[std::size_t(lists_[task].back())];
        for (std::size_t f = 0; f < n_fields; ++f)
            g.v[f] = T(first.v[f]);
        g.slot.fill(lists_[task].back());
        fill(g, task);
    }

    Task longest_list() const {
        std::size_t longest = 0;
        for (std::size_t t = 1; t < n_tasks; ++t)
            if (lists_[t].size() > lists_[longest].size())
                longest = t;
        return Task(longest);
    }
    /// Works a list off. A group that is no longer full is given up while others could be.
    void work_off(Task task) {
        Group g;
        begin_group(g, task);
        while (g.active != 0) {
            if (g.active != all_lanes && lists_[longest_list()].size() >= std::size_t(W))
                break;
            ++counters_.trips;
            counters_.useful += std::popcount(g.active);
            trip(g, task);
            if ((counters_.trips & 255) == 0 && worker_.stopped())
                break;
            fill(g, task);
        }
        each_lane(g.active, [&](int l) { leave(g, l, task); });
    }
    void trip(Group& g, Task task) {
        switch (task) {
        case start:
            return begin(g);
        case slip_below:
            return step<-1>(g);
        case slip_above:
            return step<+1>(g);
        case fall_below:
            return fall<-1>(g);
        case fall_above:
            return fall<+1>(g);
        case event_below:
            return meet<-1>(g);
        case event_above:
            return meet<+1>(g);
        case slide:
            if constexpr (knows_slides)
                return follow_window(g);
            else
                return step_along(g);
        case slide_end:
            if constexpr (knows_slides)
                return end_window(g);
            else
                return end_along(g);
        case n_tasks:
            break;
        }
    }

    void take_new_members() {
        for (; !free_.empty() && next_ < end_; ++next_) {
            const Member<N, P> member = population_.member(next_);
            const int s = free_.back();
            Slot& slot = slots_[std::size_t(s)];
            if (!begin_slot(slot, next_, member)) {
                population_.take(next_, not_begun(member));
                worker_.count();
                continue;
            }
            free_.pop_back();
            if (slot.v[left] >= 0)
                lists_[start].push_back(s);
            else
                hand_over(s); // lanes run forwards
        }
    }
    /// False of a member whose times say nothing.
    bool begin_slot(Slot& slot, std::size_t id, const Member<N, P>& member) const {
        if (!std::isfinite(member.t_end - member.t0))
            return false;
        slot = {};
        slot.id = id;
        slot.mode = slot.before = none;
        const double T0 = period(sys_, member.p);
        const auto now = Clock<double>::at(member.t0, T0),
                   end = Clock<double>::at(member.t_end, T0);
        slot.v[time] = now.local;
        slot.v[index] = double(now.index);
        slot.v[left] = slot.leg = now.until(end);
        slot.v[end_time] = end.local;
        slot.v[end_index] = double(end.index);
        slot.v[period_length] = T0;
        slot.v[longest_step] = T0 > 0 ? std::min(T0, settings_.max_step) : settings_.max_step;
        for (std::size_t i = 0; i < N; ++i)
            slot.v[state + i] = member.x[Eigen::Index(i)];
        for (std::size_t i = 0; i < P; ++i)
            slot.v[param + i] = member.p[Eigen::Index(i)];
        return std::isfinite(slot.v[left]);
    }

    // --- pieces of a step ----------------------------------------------------------------------

    static constexpr double infinite = std::numeric_limits<double>::infinity();

    /// Moves the clock, as Clock::advance does. A step is no longer than a period. (What is left is
    /// told by the clock: a difference for every step would lose digits in a long run.)
    static void advance(Group& g, const T& dt, const Mask& where) {
        const T step = dt + g[carry], next = g[time] + step;
        const T lost = step - (next - g[time]);
        const T T0 = g[period_length], turned = next - T0, back = turned - next;
        const T lost_too = (next - (turned - back)) - (T0 + back);
        const Mask wraps = (T0 > T(0)) & (next >= T0);
        g.set(time, select(wraps, turned, next), where);
        g.set(carry, select(wraps, lost + lost_too, lost), where);
        g.set(index, select(wraps, g[index] + T(1), g[index]), where);
        const T periods = select(T0 > T(0), (g[end_index] - g[index]) * T0, T(0));
        g.set(left, periods + ((g[end_time] - g[time]) - g[carry]), where);
    }
    /// Four units in the last place of t: steps below this do not move the clock.
    static T resolution(const T& t) {
        return T(4) * max(T(epsilon<double>) * abs(t), T(std::numeric_limits<double>::min()));
    }
    /// The tolerance of the components, of which x has the larger size.
    X scale(const X& x) const {
        X r;
        for (int i = 0; i < N; ++i)
            r[i] = max(fused(T(settings_.rtol), abs(x[i]), T(settings_.atol[i])), T(smallest));
        return r;
    }
    static T mean_square(const X& v, const X& scale) {
        T sum(0);
        for (int i = 0; i < N; ++i) {
            const T u = v[i] / scale[i];
            sum = fused(u, u, sum);
        }
        return sum * T(1.0 / N);
    }
    static T sum(const X& x) {
        T total = x[0];
        for (int i = 1; i < N; ++i)
            total += x[i];
        return total;
    }
    static Mask finite(const T& sum) { return sum * T(0) == T(0); }
    template <int Side> FILIPPOV_INLINE X side(const T& t, const X& x, const Q& p) const {
        if constexpr (Side < 0)
            return sys_.f1(t, x, p);
        else
            return sys_.f2(t, x, p);
    }
    X side(const Mask& below, const T& t, const X& x, const Q& p) const {
        return select_each(below, side<-1>(t, x, p), side<+1>(t, x, p));
    }
    static X select_each(const Mask& m, const X& a, const X& b) {
        X r;
        for (int i = 0; i < N; ++i)
            r[i] = select(m, a[i], b[i]);
        return r;
    }
    FILIPPOV_INLINE T h(const T& t, const X& x, const Q& p) const {
        return switching(sys_, t, x, p)[0];
    }

    /// A trial step: how long, and what cut it to that.
    struct Trial {
        T dt;
        Mask last; ///< it ends with the run or its leg
        Mask cut;  ///< it goes no farther than `reach`
    };
    FILIPPOV_INLINE static Trial next_trial(const Group& g, const T& longest) {
        const T wanted = min(g[proposal], longest);
        Trial r;
        r.cut = g[reach] < wanted;
        const T dt = min(wanted, g[reach]);
        r.last = dt >= g[left] * T(1 - 1e-9);
        r.dt = select(r.last, g[left], dt);
        return r;
    }
    /// Where a step is accurate enough; the step control takes note.
    /// @param total    finite where all of the step is
    /// @param shorter  gives the next trial where it is not
    template <class Shorter>
    FILIPPOV_INLINE Mask accept(Group& g, const Rk& rk, const X& x, const X& x1, const T& total,
                                const Trial& r, const Shorter& shorter) const {
        X weight;
        for (int i = 0; i < N; ++i)
            weight[i] = max(abs(x[i]), abs(x1[i]));
        weight = scale(weight);
        for (int i = 0; i < N; ++i)
            weight[i] = r.dt / weight[i];
        const T error = Tableau::squared_error(rk, weight);
        const Mask sound = finite(total) & (error < T(infinite));
        const Mask accepted = sound & (error <= T(1));

        StepControl<Tableau, T> control{g[last_error], g[largest]};
        const T next = r.dt * control.factor(error, accepted);
        T proposed = select(accepted & (r.last | r.cut), max(next, g[proposal]), next);
        if (any(~sound))
            proposed = select(sound, proposed, shorter());
        g.set(last_error, control.previous, sound);
        g.set(largest, control.largest, sound);
        g[proposal] = proposed;
        g[tries] += T(1);
        return accepted;
    }

    // --- slip ----------------------------------------------------------------------------------

    /// A trial step of every lane. It is taken, or to be tried shorter, or in doubt: then it goes
    /// to those who look for events.
    template <int Side> FILIPPOV_FLATTEN void step(Group& g) {
        const X x = g.x();
        const Q p = g.p();
        const Trial r = next_trial(g, g[longest_step]);
        const T t = g[time], dt = r.dt;

        Rk rk;
        rk.k[0] = g.k0();
        lanes::Probed<Times, W> guard{g[start_value], g[start_order], {}};
        const auto rhs = [&](std::size_t k, const T& tau, const X& y) FILIPPOV_LAMBDA_INLINE {
            guard.probe[k] = T(Side) * h(tau, y, p);
            return side<Side>(tau, y, p);
        };
        X x1;
        rk.step(rhs, t, x, dt, x1);

        T total = sum(X(x1 + rk.sum_of_stages()));
        for (std::size_t k = 1; k <= Times::n; ++k)
            total += guard.probe[k];
        const Mask accepted =
            accept(g, rk, x, x1, total, r, [&] { return shorter_than(g, x, p, dt); });
        g.set(reach, guard.reach(dt, T(4) * resolution(t)), accepted);

        const Mask doubt = accepted & guard.doubtful(), taken = accepted & ~doubt;
        g.set(trial, dt, doubt);
        g.set(state, x1, taken);
        g.set(field, rk.k[Rk::last], taken);
        g.set(start_value, guard.end(), taken);
        g.set(start_order, T(0), taken);
        advance(g, dt, taken);
        counters_.steps += std::popcount(g.active);

        const Mask stuck = ~accepted & (g[proposal] < resolution(t));
        const Mask gone = taken & beyond_bounds(x1);
        const Mask ended = taken & r.last & ~gone,
                   spent = g[tries] >= T(double(settings_.max_steps));
        const unsigned leaving = (doubt | gone | ended | stuck | spent).word() & g.active;
        if (leaving == 0)
            return;
        const Fall falls = falls_through<Side>(g, rk, guard, dt, x1, p);
        const Mask falling = doubt & falls.plain;
        each_lane(leaving, [&](int l) {
            if (falling[l])
                leave_falling(g, l, fall_task(Side), falls);
            else if (doubt[l])
                leave(g, l, event_task(Side));
            else if (gone[l])
                finish(unload(g, l), Status::escaped);
            else if (ended[l])
                end_leg(unload(g, l));
            else
                hand_over(unload(g, l));
        });
    }
    /// The end of a step that falls through the surface, as the fields of a member have it.
    struct Fall {
        Mask plain; ///< it does, once and all the way
        T end, slope;
    };
    /// Plain are falls from stage to stage, with slopes at both ends that lead down.
    template <int Side, class Guard>
    FILIPPOV_INLINE Fall falls_through(const Group& g, const Rk& rk, const Guard& guard,
                                       const T& dt, const X& x1, const Q& p) const {
        const T end = g[time] + dt;
        Fall f;
        f.end = guard.end();
        f.slope = T(Side) * normal_component(sys_, 0, end, x1, p, rk.k[Rk::last]);
        const T slope0 = T(Side) * normal_component(sys_, 0, g[time], g.x(), p, g.k0());
        f.plain = guard.falls() & (slope0 < T(0)) & (f.slope < T(0)) & (f.end < T(0));
        return f;
    }
    void leave_falling(Group& g, int l, Task next, const Fall& falls) {
        Slot& slot = slot_of(g, l);
        slot.v[fall_end] = falls.end[l];
        slot.v[fall_slope] = falls.slope[l];
        leave(g, l, next);
    }
    Mask beyond_bounds(const X& x) const {
        Mask out(false);
        for (int i = 0; bounded_ && i < N; ++i)
            out = out | (abs(x[i]) > T(population_.escape[i]));
        return out;
    }
    /// The next trial after a stage that was not finite: nearly to the surface if the step led
    /// across it, else a quarter.
    FILIPPOV_COLD T shorter_than(const Group& g, const X& x, const Q& p, const T& dt) const {
        const T eta = -h(g[time], x, p) / normal_component(sys_, 0, g[time], x, p, g.k0());
        return select((eta > T(0)) & (eta < dt), T(0.9) * eta, T(0.25) * dt);
    }

    // --- events --------------------------------------------------------------------------------

    /// A step that falls through the surface: its end is sought at once. Where that is not found as
    /// plainly, it is looked along like any other step in doubt.
    template <int Side> FILIPPOV_FLATTEN void fall(Group& g) {
        const Q p = g.p();
        Rk rk;
        rk.k[0] = g.k0();
        const auto rhs = [&](std::size_t, const T& tau, const X& y)
                             FILIPPOV_LAMBDA_INLINE { return side<Side>(tau, y, p); };
        Landing at{g.x(), g.k0(), g[trial]};
        const Mask landed =
            land(g, rk, rhs, foreseen<Side>(g, p), Mask(true), at, surface_ahead(g, p));
        const Contact contact = judge<Side>(g, p, at, landed);
        const Mask met = landed & contact.plain;
        advance(g, at.dt, met);
        take_up(g, contact, met);
        each_lane(g.active, [&](int l) {
            if (met[l])
                enter(g, l, Side, contact);
            else
                leave(g, l, event_task(Side));
        });
    }
    /// When a falling guard is zero, by Newton on the cubic through its ends.
    template <int Side> T foreseen(const Group& g, const Q& p) const {
        const T dt = g[trial], h0 = g[start_value], rise = g[fall_end] - h0;
        const T slope0 = T(Side) * normal_component(sys_, 0, g[time], g.x(), p, g.k0());
        const T bend = fused(dt, slope0, -rise), tilt = fused(-dt, g[fall_slope], rise) - bend;
        T u = h0 / -rise;
        for (int k = 0; k < 3; ++k) {
            // h(u) = h0 + u (rise + (1 - u) (bend + u tilt))
            const T v = T(1) - u, inner = fused(u, tilt, bend);
            const T value = fused(u, fused(v, inner, rise), h0);
            const T slope = fused(u * v, tilt, fused(v - u, inner, rise));
            u = min(max(u - value / slope, T(0)), T(1));
        }
        return u * dt;
    }

    /// A step in doubt: taken again, looked along, and ended at the event if there is one.
    template <int Side> FILIPPOV_FLATTEN void meet(Group& g) {
        const Q p = g.p();
        const T t = g[time], dt = g[trial];
        Rk rk;
        rk.k[0] = g.k0();
        const auto rhs = [&](std::size_t, const T& tau, const X& y)
                             FILIPPOV_LAMBDA_INLINE { return side<Side>(tau, y, p); };
        Landing at;
        at.dt = dt;
        rk.step(rhs, t, g.x(), dt, at.x);
        const X full = at.x, full_field = rk.k[Rk::last];
        at.field = full_field;
        const auto path = rk.interpolant(rhs, t, g.x(), dt, full);
        counters_.searches += std::popcount(g.active);

        const Mask rooted = g[start_order] > T(0), twice = g[start_order] > T(1);
        const T offset = select(rooted, g[start_value], T(0));
        const auto guard = [&](const T& u) {
            const T raw = T(Side) * h(fused(u, dt, t), path(u), p) - offset;
            return raw / select(twice, u * u, select(rooted, u, T(1)));
        };
        constexpr std::size_t n = 8;
        std::array<T, n + 1> v;
        v[0] = g[start_value];
        for (std::size_t k = 1; k < n; ++k)
            v[k] = guard(T(double(k) / n));
        const T end = T(Side) * h(t + dt, full, p);
        v[n] = end - offset;
        const lanes::Look<W> look = lanes::look_along(v, rooted);
        const T guess = lanes::root(look, 1e-6, guard) * dt;
        const Mask landed = land(g, rk, rhs, guess, look.found, at, surface_ahead(g, p));
        const Contact contact = judge<Side>(g, p, at, landed);

        const Mask met = landed & contact.plain, passes = ~(look.hard | look.found);
        const Mask last = passes & (dt >= g[left]), gone = passes & beyond_bounds(full);
        g.set(state, full, passes);
        g.set(field, full_field, passes);
        g.set(start_value, end, passes);
        g.set(start_order, T(0), passes);
        advance(g, select(passes, dt, at.dt), passes | met);
        take_up(g, contact, met);
        each_lane(g.active, [&](int l) {
            if (met[l])
                enter(g, l, Side, contact);
            else if (gone[l])
                finish(unload(g, l), Status::escaped);
            else if (last[l])
                end_leg(unload(g, l));
            else if (passes[l])
                leave(g, l, slip_task(Side));
            else
                hand_over(unload(g, l));
        });
    }

    /// The end of a step.
    struct Landing {
        X x, field;
        T dt;
    };
    /// What a step is to end on.
    /// @tparam Correction  Newton's, of the time at which a landing is there
    template <class Correction> struct Target {
        double near; ///< what the last correction may be, units of the step
        Correction correction;
    };
    /// Shortens steps until they end on a target, by Newton on their length; the last correction
    /// is a Taylor step, once its error is below a hundredth of the tolerance.
    /// @param at  the whole step; where this succeeds, the shortened one
    /// @return    where it does
    template <class Rhs, class Correction>
    Mask land(const Group& g, Rk& rk, Rhs& rhs, T d, const Mask& wanted, Landing& at,
              const Target<Correction>& target) {
        const X x = g.x(), k0 = g.k0(), tolerance = scale(x);
        const T t = g[time], longest = min(T(1.01) * at.dt, g[left]);
        Mask todo = wanted & g.members(), done(false);
        for (int k = 0; k < 8 && any(todo); ++k) {
            Landing tried;
            rk.step(rhs, t, x, d, tried.x);
            counters_.landings += std::popcount(todo.word());
            tried.field = rk.k[Rk::last];
            tried.dt = d;
            X bend;
            for (int i = 0; i < N; ++i)
                bend[i] = (tried.field[i] - k0[i]) / d;
            T delta = target.correction(tried);
            const T error = mean_square(bend, tolerance) * (delta * delta) * (delta * delta);
            const T next = d + delta;
            todo = todo & (next > T(0)) & (next < longest);
            for (int n = 0; n < 2; ++n) { // the second one mends what curvature left
                nudge(tried, delta, bend);
                delta = target.correction(tried);
            }
            const Mask there = todo & (error <= T(1e-4)) & (abs(delta) <= T(target.near) * d) &
                               (tried.dt < longest);
            at.x = select_each(there, tried.x, at.x);
            at.field = select_each(there, tried.field, at.field);
            at.dt = select(there, tried.dt, at.dt);
            done = done | there;
            todo = todo & ~there;
            d = select(todo, next, d);
        }
        return done;
    }
    /// Where h is zero.
    auto surface_ahead(const Group& g, const Q& p) const {
        return Target{1e-3, [this, t = g[time], &p](const Landing& at) {
                          const T end = t + at.dt;
                          return -h(end, at.x, p) /
                                 normal_component(sys_, 0, end, at.x, p, at.field);
                      }};
    }
    static void nudge(Landing& at, const T& delta, const X& bend) {
        for (int i = 0; i < N; ++i) {
            at.x[i] = fused(delta, fused(T(0.5) * delta, bend[i], at.field[i]), at.x[i]);
            at.field[i] = fused(delta, bend[i], at.field[i]);
        }
        at.dt += delta;
    }

    /// What goes on from a point of the surface.
    struct Contact {
        X x;        ///< there
        T mode;     ///< -1, 0 or +1
        Mask plain; ///< nothing to think about
        T h;        ///< what rounding leaves of it
        X field;    ///< of the mode, unless its slides are known in closed form
        T s, w;     ///< of a slide, and L1 - L2
    };
    /// The sizes of normal components that need no thought: see `departure`.
    struct Plainly {
        T least, band;
        Mask finite;
    };
    Plainly plainly(const Sides<Sys, T>& b, const T& rounding, const T& tau) const {
        const T both = abs(b.l1) + abs(b.l2);
        const T band = fused(T(16 * epsilon<double>), both * tau, rounding);
        return {T(100 / std::sqrt(epsilon<double>)) * band / tau, band, both < T(infinite)};
    }
    /// The first-order case of `admissible`: both normal components plainly not zero.
    /// @tparam Side  from which the solution comes; 0: it starts here
    template <int Side>
    Contact judge(const Group& g, const Q& p, const Landing& at, const Mask& where) const {
        const T t = g[time] + select(where, at.dt, T(0));
        Contact c;
        c.x = project(sys_, 0, t, at.x, p, scale(at.x));
        c.h = h(t, c.x, p);
        const Sides<Sys, T> b = both_sides(sys_, Mode<1>{}, 0, t, c.x, p);
        const T rounding = rounding_band(sys_, 0, t, c.x, p);
        const Plainly size = plainly(b, rounding, g[proposal]);
        const Mask up1 = b.l1 > T(0), up2 = b.l2 > T(0);
        c.w = b.l1 - b.l2;
        c.s = (b.l1 + b.l2) / c.w;
        const T limit = s_max(sys_, p);
        // static friction: sliding is kept up to |s| = s_max, whatever the sides would do
        const Mask held =
            (limit > T(1)) & (b.l1 > b.l2) & (abs(c.s) < limit * T(1 - 16 * epsilon<double>));
        const Mask slides = (up1 & ~up2) | held, repels = ~up1 & up2;
        c.plain = (abs(b.l1) > size.least) & (abs(b.l2) > size.least) & size.finite & ~repels &
                  (abs(c.h) <= T(4) * rounding);
        if constexpr (Side != 0) // it comes from there
            c.plain = c.plain & (Side < 0 ? up1 : ~up2);
        c.mode = select(slides, T(0), select(up1, T(1), T(-1)));
        c.field = select_each(up1, b.f2, b.f1);
        if constexpr (!knows_slides)
            for (int i = 0; i < N; ++i)
                c.field[i] = select(slides, (b.l1 * b.f2[i] - b.l2 * b.f1[i]) / c.w, c.field[i]);
        return c;
    }
    /// Members at a contact take up their next mode.
    static void take_up(Group& g, const Contact& c, const Mask& where) {
        const Mask slides = c.mode == T(0);
        g.set(state, c.x, where);
        g.set(field, c.field, where);
        g.set(start_value, select(slides, c.s, c.mode * c.h), where);
        g.set(start_order, select(slides, T(0), T(1)), where);
        g.set(reach, T(infinite), where);
        if constexpr (!knows_slides)
            g.set(across, c.w, where);
        const T window = select(g[period_length] > T(0), T(0.125) * g[period_length], g[proposal]);
        g.set(trial, window, where & slides);
    }
    /// ... and go to its list.
    void enter(Group& g, int l, int before, const Contact& c) {
        const int s = unload(g, l);
        Slot& slot = slots_[std::size_t(s)];
        if (!change_mode(s, static_cast<int>(c.mode[l])))
            return;
        slot.before = static_cast<signed char>(before);
        slot.guard = static_cast<signed char>(Guard<1>::below(0));
        if (slot.mode == 0) {
            slot.before_slide = slot.v[proposal];
            slot.slid_left = slot.v[left];
        }
        go_on(s);
    }
    /// Counts the event, if it is one: a member that begins, or was handed back in this mode, meets
    /// none. False where it is one too many.
    bool change_mode(int s, int mode) {
        Slot& slot = slots_[std::size_t(s)];
        if (slot.mode != none && slot.mode != mode) {
            if (slot.events >= settings_.max_events) {
                finish(s, Status::max_events);
                return false;
            }
            ++slot.events;
            slot.slides += mode == 0;
        }
        slot.mode = static_cast<signed char>(mode);
        return true;
    }
    /// Sends a member that is in its mode to what is to be done there.
    void go_on(int s) {
        const Slot& slot = slots_[std::size_t(s)];
        if (!(slot.v[left] > 0))
            return end_leg(s);
        lists_[slot.mode == 0 ? slide : slip_task(slot.mode)].push_back(s);
    }

    // --- slides --------------------------------------------------------------------------------

    /// Half of a period, in which a forced s shows its swings.
    static T half_period(const Group& g) {
        return select(g[period_length] > T(0), T(0.5) * g[period_length], T(infinite));
    }

    /// What goes on from the end of a slide.
    struct Exit {
        Mask plain;
        X field; ///< of the side it leaves into
        T h;     ///< what rounding leaves of it, positive on that side
    };
    /// The plain case of `admissible` there: the other side still holds, and the second derivative
    /// of h along this side's field, which is that of L along the slide, leads away.
    /// @param sign   +1 where the slide leaves below, -1 above
    /// @param slope  of s_max + sign s along the slide
    Exit judge_end(const Group& g, const Q& p, const X& x, const T& t, const T& sign,
                   const T& slope) const {
        const Sides<Sys, T> b = both_sides(sys_, Mode<1>{}, 0, t, x, p);
        const Mask below = sign > T(0), kinetic = s_max(sys_, p) > T(1);
        const T tau = g[proposal], w = b.l1 - b.l2;
        const T own = sign * select(below, b.l1, b.l2), other = -sign * select(below, b.l2, b.l1);
        const Plainly size = plainly(b, rounding_band(sys_, 0, t, x, p), tau);
        const T curvature = T(0.5) * slope * w * tau * tau;
        const Mask turns_away =
            -curvature > size.band * T(1 / std::cbrt(epsilon<double> * epsilon<double>));
        Exit e;
        e.plain =
            (w > T(0)) & size.finite &
            ((~kinetic & turns_away & (other > size.least)) | (kinetic & (-own > size.least)));
        e.field = select_each(below, b.f1, b.f2);
        e.h = -sign * h(t, x, p);
        return e;
    }
    /// Members at the end of a slide take up the slip after it ...
    static void leave_slide(Group& g, const T& limit, const Exit& exit, const X& x, const T& dt,
                            const Mask& where) {
        g.set(state, x, where);
        g.set(field, exit.field, where);
        g.set(start_value, exit.h, where);
        g.set(start_order, select(limit > T(1), T(1), T(2)), where);
        g.set(reach, T(infinite), where);
        advance(g, dt, where);
    }
    /// ... and go to its list.
    void enter_slip(int s, int side) {
        Slot& slot = slots_[std::size_t(s)];
        if (!change_mode(s, side))
            return;
        slot.before = 0;
        slot.guard = static_cast<signed char>(side < 0 ? Guard<1>::below(0) : Guard<1>::above(0));
        slot.slid += slot.slid_left - slot.v[left];
        // a slide may take far longer steps than the slip after it
        slot.v[proposal] = std::min(slot.before_slide, slot.v[proposal]);
        if (population_.ends_at_exit)
            return finish(s, Status::event);
        go_on(s);
    }

    // --- slides not known in closed form -------------------------------------------------------

    /// The slide at a point, which is put on the surface first, so that the fields need not exist
    /// off it.
    FILIPPOV_INLINE Sliding<Sys, T> slide_at(const T& t, const X& x, const Q& p,
                                             const X& size) const {
        return sliding(sys_, Mode<1>{}, t, toward_surface(sys_, 0, t, x, p, size), p);
    }
    static T s_of(const Sliding<Sys, T>& a) { return T(0.5) * (a.below - a.above); }

    /// A trial step along the slide of every lane: see `step`. The field of a slide can be
    /// constant, and then no error estimate keeps a step from spanning many swings of s: s has to
    /// be far from both ends to be out of doubt, and a step that shows swings is tried shorter.
    FILIPPOV_FLATTEN void step_along(Group& g) {
        const X x = g.x(), size = scale(x);
        const Q p = g.p();
        const Trial r = next_trial(g, min(half_period(g), g[longest_step]));
        const T t = g[time], limit = s_max(sys_, p), dt = r.dt;

        Rk rk;
        rk.k[0] = g.k0();
        lanes::Probed<Times, W> s{g[start_value], T(0), {}}, w{g[across], T(0), {}};
        const auto rhs = [&](std::size_t k, const T& tau, const X& y) FILIPPOV_LAMBDA_INLINE {
            const Sliding<Sys, T> at = slide_at(tau, y, p, size);
            s.probe[k] = s_of(at);
            w.probe[k] = at.w;
            return at.f;
        };
        X x1;
        rk.step(rhs, t, x, dt, x1);
        T total = sum(X(x1 + rk.sum_of_stages()));
        for (std::size_t k = 1; k <= Times::n; ++k)
            total += s.probe[k] + w.probe[k];
        const Mask accepted = accept(g, rk, x, x1, total, r, [&] { return T(0.25) * dt; });

        const auto range = s.range(), range_w = w.range();
        const T twice = T(2) * range.spread();
        const Mask still = (limit + range.low > twice) & (limit - range.high > twice);
        const T rounding(64 * epsilon<double> + settings_.rtol);
        const Mask swings = accepted & ~still & (range.spread() > rounding) & (s.turns() > T(1)) &
                            (dt > T(16) * resolution(t));
        const Mask clear = still & (range_w.low > T(2) * range_w.spread());
        const Mask taken = accepted & ~swings & clear, doubt = accepted & ~swings & ~clear;
        x1 = project(sys_, 0, t + dt, x1, p, size);
        g.set(reach, T(0.5) * dt, swings);
        g.set(trial, dt, doubt);
        go_along(g, {x1, rk.k[Rk::last], dt}, s.end(), w.end(), taken);
        counters_.windows += std::popcount(g.active);

        const Mask stuck = ~accepted & (g[proposal] < resolution(t));
        const Mask gone = taken & beyond_bounds(x1);
        const Mask ended = taken & r.last & ~gone,
                   spent = g[tries] >= T(double(settings_.max_steps));
        each_lane((doubt | gone | ended | stuck | spent).word() & g.active, [&](int l) {
            if (doubt[l])
                leave(g, l, slide_end);
            else if (gone[l])
                finish(unload(g, l), Status::escaped);
            else if (ended[l])
                end_leg(unload(g, l));
            else
                hand_over(unload(g, l));
        });
    }
    /// Members that go on in their slide, at the end of a step.
    static void go_along(Group& g, const Landing& at, const T& s, const T& w, const Mask& where) {
        g.set(state, at.x, where);
        g.set(field, at.field, where);
        g.set(start_value, s, where);
        g.set(across, w, where);
        g.set(reach, T(1.25) * g[reach], where);
        advance(g, at.dt, where);
    }

    /// A step along a slide in doubt: taken again, looked along, and ended where the slide ends. A
    /// step that does not show plainly which end it meets, if any, is tried shorter.
    FILIPPOV_FLATTEN void end_along(Group& g) {
        const X x = g.x(), size = scale(x);
        const Q p = g.p();
        const T t = g[time], dt = g[trial], limit = s_max(sys_, p);
        Rk rk;
        rk.k[0] = g.k0();
        const auto rhs = [&](std::size_t, const T& tau, const X& y)
                             FILIPPOV_LAMBDA_INLINE { return slide_at(tau, y, p, size).f; };
        Landing full;
        full.dt = dt;
        rk.step(rhs, t, x, dt, full.x);
        full.x = project(sys_, 0, t + dt, full.x, p, size);
        full.field = rk.k[Rk::last];
        const auto path = rk.interpolant(rhs, t, x, dt, full.x);
        const auto slide_in = [&](const T& u) {
            return slide_at(fused(u, dt, t), path(u), p, size);
        };
        counters_.searches += std::popcount(g.active);

        constexpr std::size_t n = 8;
        std::array<T, n + 1> s, w, below, above;
        s[0] = g[start_value];
        w[0] = g[across];
        for (std::size_t k = 1; k <= n; ++k) {
            const Sliding<Sys, T> at = slide_in(T(double(k) / n));
            s[k] = s_of(at);
            w[k] = at.w;
        }
        for (std::size_t k = 0; k <= n; ++k) {
            below[k] = limit + s[k];
            above[k] = limit - s[k];
        }
        const Mask unrooted(false);
        const lanes::Look<W> down = lanes::look_along(below, unrooted),
                             up = lanes::look_along(above, unrooted),
                             flat = lanes::look_along(w, unrooted);
        const Mask hard = down.hard | up.hard | (down.found & up.found) | flat.hard | flat.found;
        const Mask ends = (down.found | up.found) & ~hard, passes = ~hard & ~ends;

        lanes::Look<W> look;
        const T sign = select(down.found, T(1), T(-1));
        look.found = ends;
        look.low = select(down.found, down.low, up.low);
        look.high = select(down.found, down.high, up.high);
        look.value_low = select(down.found, down.value_low, up.value_low);
        look.value_high = select(down.found, down.value_high, up.value_high);
        const auto margin = [&](const T& u) { return fused(sign, s_of(slide_in(u)), limit); };
        const T u = lanes::root(look, 1e-6, margin), apart(0x1p-13);
        const T slope = (margin(u + apart) - margin(u - apart)) / (T(2) * apart * dt);
        const Target end{1e-9, [&](Landing& at) {
                             at.x = project(sys_, 0, t + at.dt, at.x, p, size);
                             const T s1 = s_of(slide_at(t + at.dt, at.x, p, size));
                             return -fused(sign, s1, limit) / slope;
                         }};
        Landing at = full;
        const Mask landed = land(g, rk, rhs, u * dt, ends, at, end);
        const Exit exit = judge_end(g, p, at.x, t + at.dt, sign, slope);
        const Mask leaves = landed & exit.plain & finite(sum(at.x));

        const T shortest = T(1e-4) * min(half_period(g), g[proposal]);
        const Mask shorter = hard & (dt > shortest);
        const Mask last = passes & (dt >= g[left]), gone = passes & beyond_bounds(full.x);
        g.set(reach, T(0.5) * dt, shorter);
        leave_slide(g, limit, exit, at.x, at.dt, leaves);
        go_along(g, full, s[n], w[n], passes);
        each_lane(g.active, [&](int l) {
            if (leaves[l])
                enter_slip(unload(g, l), down.found[l] ? -1 : 1);
            else if (gone[l])
                finish(unload(g, l), Status::escaped);
            else if (last[l])
                end_leg(unload(g, l));
            else if (passes[l] || shorter[l])
                leave(g, l, slide);
            else
                hand_over(unload(g, l));
        });
    }

    // --- slides in closed form -----------------------------------------------------------------

    static constexpr std::size_t n_window = WindowTimes<double>::n;

    /// s at a time after the clock.
    FILIPPOV_INLINE T s_after(const T& tau, const T& t, const X& x, const Q& p) const {
        return sliding_margin(sys_, Mode<1>{}, t + tau, sys_.sliding_flow(t, x, p, tau), p).s;
    }

    /// A window of a slide of every lane, as Segment::run_closed_form takes them.
    FILIPPOV_FLATTEN void follow_window(Group& g) {
        const X x = g.x();
        const Q p = g.p();
        const T t = g[time], limit = s_max(sys_, p);
        const T half = half_period(g), longest = min(half, g[longest_step]);
        T dt = min(g[trial], longest);
        const Mask last = dt >= g[left];
        dt = select(last, g[left], dt);
        counters_.windows += std::popcount(g.active);

        std::array<T, n_window + 1> below, above;
        T s = g[start_value];
        for (std::size_t k = 0; k <= n_window; ++k) {
            if (k > 0)
                s = s_after(T(WindowTimes<double>::theta(k)) * dt, t, x, p);
            below[k] = limit + s;
            above[k] = limit - s;
        }
        const lanes::Look<W> down = lanes::look_in_window(below), up = lanes::look_in_window(above);
        // both ends in sight: the window is too long to tell which comes first
        const Mask hard = down.hard | up.hard | (down.found & up.found);
        const Mask ends = (down.found | up.found) & ~hard;
        const X x1 = sys_.sliding_flow(t, x, p, dt);
        const Mask passes = ~hard & ~ends & finite(sum(x1));
        const T shortest = T(1e-4) * select(g[period_length] > T(0), half, g[proposal]);
        const Mask shorter = hard & (dt > shortest);

        g.set(state, x1, passes);
        g.set(start_value, s, passes);
        g.set(trial, select(passes, T(4) * dt, select(shorter, T(0.5) * dt, dt)), ~Mask(false));
        g.set(reach, select(down.found, down.low, up.low), ends);
        g[tries] += T(1);
        advance(g, dt, passes);
        const Mask gone = passes & beyond_bounds(x1), stays = (passes & ~last & ~gone) | shorter,
                   spent = g[tries] >= T(double(settings_.max_steps));
        each_lane((~stays | spent).word() & g.active, [&](int l) {
            if (ends[l])
                leave(g, l, slide_end);
            else if (gone[l])
                finish(unload(g, l), Status::escaped);
            else if (passes[l] && last[l])
                end_leg(unload(g, l));
            else
                hand_over(unload(g, l));
        });
    }
    /// The end of a slide in the piece of a window behind `reach`.
    FILIPPOV_FLATTEN void end_window(Group& g) {
        const X x = g.x();
        const Q p = g.p();
        const T t = g[time], dt = g[trial], limit = s_max(sys_, p);
        const auto s_at = [&](const T& u) { return s_after(u * dt, t, x, p); };
        lanes::Look<W> look;
        look.low = g[reach];
        look.high = look.low + T(1.0 / n_window);
        const T s_low = s_at(look.low), s_high = s_at(look.high);
        const Mask down = s_high < s_low;
        const T sign = select(down, T(1), T(-1));
        const auto margin = [&](const T& u) { return fused(sign, s_at(u), limit); };
        look.value_low = fused(sign, s_low, limit);
        look.value_high = fused(sign, s_high, limit);
        look.found = look.value_low > T(0);
        const T u = lanes::root(look, 4 * epsilon<double>, margin), d = u * dt;
        const T apart(0x1p-13);
        const T slope = (margin(u + apart) - margin(u - apart)) / (T(2) * apart * dt);
        const X x1 = project(sys_, 0, t + d, sys_.sliding_flow(t, x, p, d), p, scale(x));
        const Exit exit = judge_end(g, p, x1, t + d, sign, slope);
        const Mask leaves = look.found & exit.plain & finite(sum(x1)) & (d < g[left]);
        leave_slide(g, limit, exit, x1, d, leaves);
        each_lane(g.active, [&](int l) {
            if (leaves[l])
                enter_slip(unload(g, l), down[l] ? -1 : 1);
            else
                hand_over(unload(g, l));
        });
    }

    // --- starts --------------------------------------------------------------------------------

    /// Finds the mode by the sign of h, or as at any contact where h is zero.
    void begin(Group& g) {
        const X x = g.x();
        const Q p = g.p();
        const T t = g[time], value = h(t, x, p);
        X atol;
        for (int i = 0; i < N; ++i)
            atol[i] = T(settings_.atol[i]);
        const Mask on = abs(value) <= start_band(sys_, 0, t, x, p, atol);
        const Mask below = value < T(0);
        const X f = side(below, t, x, p);
        const T natural = first_step(g, x, p, f, below);
        const T first = settings_.first_step > 0 ? T(settings_.first_step) : natural;
        const StepControl<Tableau, T> control;
        g[proposal] = min(first, g[longest_step]);
        g[last_error] = control.previous;
        g[largest] = control.largest;
        g[reach] = T(infinite);
        g[start_order] = T(0);
        g.set(field, f, ~on);
        g.set(start_value, abs(value), ~on);
        Contact c = judge<0>(g, p, Landing{x, f, T(0)}, on);
        c.mode = select(on, c.mode, select(below, T(-1), T(1)));
        c.plain = (on & c.plain) | (~on & finite(sum(f)) & (abs(value) < T(infinite)));
        take_up(g, c, on & c.plain);
        each_lane(g.active, [&](int l) {
            if (c.plain[l])
                enter(g, l, none, c);
            else
                hand_over(unload(g, l));
        });
    }
    /// Hairer, Norsett, Wanner I, II.4, with a coarser power.
    T first_step(const Group& g, const X& x, const Q& p, const X& f, const Mask& below) const {
        const X size = scale(x);
        const T d0 = mean_square(x, size), d1 = mean_square(f, size);
        const T span = select(g[left] > T(0), g[left], T(1)); // its first leg may have no length
        const T h0 =
            select((d0 < T(1e-10)) | (d1 < T(1e-10)), T(1e-6) * span, T(0.01) * sqrt(d0 / d1));
        X y;
        for (int i = 0; i < N; ++i)
            y[i] = fused(h0, f[i], x[i]);
        const X change = side(below, g[time] + h0, y, p) - f;
        const T d2 = mean_square(change, size) / (h0 * h0), rate = max(d1, d2);
        const T power = T(-0.5 / Tableau::order) * detail::log2_of(T(rate * T(1e4)));
        const T h1 =
            select(rate <= T(1e-30), max(T(1e-6) * span, T(1e-3) * h0), detail::exp2_of(power));
        const T first = min(min(T(100) * h0, h1), span);
        return select((first > T(0)) & (first < T(infinite)), first, T(1e-6) * span);
    }

    // --- ends ----------------------------------------------------------------------------------

    static Clock<double> clock_of(const Slot& slot) {
        return {slot.v[period_length], static_cast<long long>(slot.v[index]), slot.v[time],
                slot.v[carry]};
    }
    static Clock<double> end_of(const Slot& slot) {
        return {slot.v[period_length], static_cast<long long>(slot.v[end_index]), slot.v[end_time],
                0};
    }
    Outcome<N> outcome(const Slot& slot, Status status) const {
        Outcome<N> o;
        o.status = status;
        o.clock = clock_of(slot);
        for (std::size_t i = 0; i < N; ++i)
            o.x[Eigen::Index(i)] = slot.v[state + i];
        o.mode = slot.mode;
        o.events = slot.events;
        o.slides = slot.slides;
        o.slide_time = slot.slid + (slot.mode == 0 ? slot.slid_left - slot.v[left] : 0.0);
        return o;
    }
    void finish(int s, Status status) {
        const Slot& slot = slots_[std::size_t(s)];
        take(s, outcome(slot, status));
    }
    void take(int s, const Outcome<N>& o) {
        population_.take(slots_[std::size_t(s)].id, o);
        worker_.count();
        free_.push_back(s);
    }
    void end_leg(int s) {
        if (reach_end(s))
            go_on(s);
    }
    /// At the end of a leg: true if the member has another.
    bool reach_end(int s) {
        Slot& slot = slots_[std::size_t(s)];
        if (slot.mode == 0)
            slot.slid += slot.slid_left - slot.v[left];
        slot.v[time] = slot.v[end_time];
        slot.v[index] = slot.v[end_index];
        slot.v[carry] = 0;
        slot.v[left] = slot.slid_left = 0;
        const Outcome<N> o = outcome(slot, Status::ok);
        if (!population_.goes_on(slot.id, o)) {
            take(s, o);
            return false;
        }
        const double leg = next_leg(population_, slot.id), T0 = slot.v[period_length];
        slot.v[left] = slot.slid_left = slot.leg = leg;
        if (T0 > 0)
            slot.v[end_index] += std::round(leg / T0);
        else
            slot.v[end_time] += leg;
        return true;
    }

    // --- the scalar engine ---------------------------------------------------------------------

    /// For how long. Not for a whole period: on a periodic orbit that would end at the very event
    /// that was not plain. And so long that a member is handed over a thousand times at most.
    double stretch_of(const Slot& slot) const {
        const double T0 = slot.v[period_length];
        return T0 > 0 ? 0.9 * T0 : std::max(100 * slot.v[proposal], 1e-3 * slot.leg);
    }
    /// Has a member run by the scalar engine for a while, or to the end of its leg.
    FILIPPOV_COLD void hand_over(int s) {
        Slot& slot = slots_[std::size_t(s)];
        ++counters_.handed_over;
        const double some = stretch_of(slot);
        const bool last = !(some < slot.v[left]);
        Stretch<N, P> stretch;
        for (std::size_t i = 0; i < N; ++i)
            stretch.x[Eigen::Index(i)] = slot.v[state + i];
        for (std::size_t i = 0; i < P; ++i)
            stretch.p[Eigen::Index(i)] = slot.v[param + i];
        stretch.t0 = slot.v[time];
        stretch.dt = last ? slot.v[left] : some;
        if (slot.before != none && slot.v[start_order] > 0) {
            stretch.before = slot.before;
            stretch.guard = slot.guard;
        }
        stretch.ends_at_exit = population_.ends_at_exit;
        stretch.max_steps = settings_.max_steps - static_cast<long long>(slot.v[tries]);
        stretch.max_events = settings_.max_events - slot.events;
        const StretchEnd<N> end = scalar_.run(stretch, worker_);
        if (end.status == Status::interrupted) // as all others that were not run to their end
            return;
        for (std::size_t i = 0; i < N; ++i)
            slot.v[state + i] = end.x[Eigen::Index(i)];
        if (slot.mode == 0) // until here; the stretch counted from here
            slot.slid += slot.slid_left - slot.v[left];
        slot.v[index] += double(end.clock.index);
        slot.v[time] = end.clock.local;
        slot.v[carry] = end.clock.carry;
        slot.v[left] = slot.slid_left = last ? 0 : clock_of(slot).until(end_of(slot));
        slot.v[tries] += double(end.steps);
        slot.v[start_order] = 0;
        slot.slid += end.slide_time;
        slot.events += end.events;
        slot.slides += end.slides;
        slot.mode = static_cast<signed char>(end.mode);
        slot.before = none;
        if (end.status != Status::ok)
            return finish(s, end.status);
        if (population_.beyond(end.x))
            return finish(s, Status::escaped);
        if (!last || reach_end(s))
            lists_[start].push_back(s);
    }

    static constexpr double smallest = std::numeric_limits<double>::min() / epsilon<double>;

    const Sys& sys_;
    const Settings<double, N>& settings_;
    const ScalarEngine<N, P>& scalar_;
    Population<N, P>& population_;
    Worker& worker_;
    std::vector<Slot> slots_;
    std::vector<int> free_;
    std::array<std::vector<int>, n_tasks> lists_;
    LaneCounters counters_;
    std::size_t next_ = 0, end_ = 0; ///< members that were not taken up yet
    bool bounded_ = false;           ///< there is a bound to escape from
};

} // namespace filippov
