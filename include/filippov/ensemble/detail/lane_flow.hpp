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

#include <filippov/ensemble/detail/lane_slides.hpp>
#include <filippov/ensemble/detail/lane_slip.hpp>

namespace filippov {

/// Runs members in W lanes, on one thread.
template <class Sys, int W, class Tableau> class LaneFlow {
    static constexpr int N = dim_v<Sys>;
    static constexpr int P = params_v<Sys>;
    using Slot = lanes::Slot<Sys>;
    using Group = lanes::Group<Sys, W>;
    using Leaving = lanes::Leaving<W>;
    using Task = lanes::Task;
    using enum lanes::Field;

public:
    LaneFlow(const Sys& sys, const Settings<double, N>& settings, const ScalarEngine<N, P>& scalar,
             Population<N, P>& population, Worker& worker)
        : sys_(sys), settings_(settings), scalar_(scalar), population_(population), worker_(worker),
          run_{sys, settings, population.escape}, pool_(population.same_params) {}

    /// Runs members `next` to `end`; those that were not run to their end when the worker is
    /// stopped are not told of.
    LaneCounters run(std::size_t next, std::size_t end) {
        run_.counters.width = W;
        next_ = next;
        end_ = end;
        while (!worker_.stopped()) {
            take_new_members();
            const Task task = pool_.longest_list();
            if (pool_.is_empty(task))
                break;
            work_off(task);
        }
        return run_.counters;
    }

private:
    // --- the lists -----------------------------------------------------------------------------

    /// Works a list off. A group that is no longer full is given up while others could be.
    void work_off(Task task) {
        Group g;
        pool_.begin(g, task);
        while (g.active != 0) {
            if (g.active != Group::all_lanes && pool_.has_full_group())
                break;
            ++run_.counters.trips;
            run_.counters.useful += std::popcount(g.active);
            const Leaving leaving = trip(g, task);
            lanes::each_lane(leaving.lanes, [&](int l) {
                send_on(g, l, leaving.next[std::size_t(l)], task == Task::start);
            });
            if ((run_.counters.trips & 255) == 0 && worker_.stopped())
                break;
            pool_.fill(g, task);
        }
        lanes::each_lane(g.active, [&](int l) { pool_.leave(g, l, task); });
    }
    Leaving trip(Group& g, Task task) const {
        switch (task) {
        case Task::start:
            return slip_.begin(g);
        case Task::slip_below:
        case Task::slip_above:
            return on_side(task == Task::slip_below,
                           [&](auto side) { return slip_.step(g, side); });
        case Task::fall_below:
        case Task::fall_above:
            return on_side(task == Task::fall_below,
                           [&](auto side) { return slip_.fall(g, side); });
        case Task::event_below:
        case Task::event_above:
            return on_side(task == Task::event_below,
                           [&](auto side) { return slip_.meet(g, side); });
        case Task::slide:
            return slides_.step(g);
        case Task::slide_end:
            return slides_.end(g);
        default: // no list
            return Leaving(g.active);
        }
    }
    /// Calls work(side), with a side that is known when this is compiled unless it is data.
    template <class Work> static Leaving on_side(bool below, const Work& work) {
        if constexpr (sides_are_data_v<Sys>)
            return work(below ? -1 : +1);
        else
            return below ? work(lanes::Known<-1>{}) : work(lanes::Known<+1>{});
    }
    /// Takes a member out of its lane, to what is to be done with it next.
    void send_on(Group& g, int l, Task next, bool starts) {
        if (std::size_t(next) < lanes::n_lists)
            return pool_.leave(g, l, next);
        const int s = pool_.unload(g, l);
        switch (next) {
        case Task::enter_below:
            return enter(s, -1, starts);
        case Task::enter_slide:
            return enter(s, 0, starts);
        case Task::enter_above:
            return enter(s, +1, starts);
        case Task::exit_below:
            return leave_slide(s, -1);
        case Task::exit_above:
            return leave_slide(s, +1);
        case Task::end_leg:
            return end_leg(s);
        case Task::escape:
            return finish(s, Status::escaped);
        default:
            return hand_over(s);
        }
    }

    void take_new_members() {
        for (; pool_.has_room() && next_ < end_; ++next_) {
            const Member<N, P> member = population_.member(next_);
            const int s = pool_.next_free();
            Slot& slot = pool_[s];
            if (!begin_slot(slot, next_, member)) {
                population_.take(next_, not_begun(member));
                worker_.count();
                continue;
            }
            pool_.take_free();
            if (slot[left] >= 0)
                pool_.push(s, Task::start);
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
        slot.mode = slot.before = Slot::none;
        const double T0 = period(sys_, member.p);
        const auto now = Clock<double>::at(member.t0, T0),
                   end = Clock<double>::at(member.t_end, T0);
        slot[time] = now.local;
        slot[index] = double(now.index);
        slot[left] = slot.began = slot.leg = slot.ends = now.until(end);
        slot[end_time] = end.local;
        slot[end_index] = double(end.index);
        slot[period_length] = T0;
        slot[longest_step] = T0 > 0 ? std::min(T0, settings_.max_step) : settings_.max_step;
        slot.x() = member.x;
        slot.p() = member.p;
        return std::isfinite(slot[left]);
    }

    // --- changes of mode -----------------------------------------------------------------------

    /// From a contact, or a start, which comes from no mode.
    void enter(int s, int mode, bool starts) {
        Slot& slot = pool_[s];
        const signed char before = starts ? Slot::none : slot.mode;
        const bool exits = slot.mode == 0 && mode != 0, // handed back at the very end of its slide
            begins = slot.mode == Slot::none;
        if (!change_mode(s, mode))
            return;
        if (exits && population_.ends_at_exit)
            return finish(s, Status::event);
        slot.before = before;
        slot.guard = static_cast<signed char>(Guard<1>::below(0));
        if (slot.mode == 0) {
            slot.before_slide = slot[proposal];
            shorten_first_step(slot, begins);
        }
        slot.began = slot[left];
        go_on(s);
    }
    void leave_slide(int s, int side) {
        Slot& slot = pool_[s];
        if (!change_mode(s, side))
            return;
        slot.before = 0;
        slot.guard = static_cast<signed char>(side < 0 ? Guard<1>::below(0) : Guard<1>::above(0));
        slot.slid += slot.began - slot[left];
        slot.began = slot[left];
        // a slide may take far longer steps than the slip after it
        slot[proposal] = std::min(slot.before_slide, slot[proposal]);
        if (population_.ends_at_exit)
            return finish(s, Status::event);
        go_on(s);
    }
    /// As Segment::enter and choose_first_step: no field says how soon s may turn, so that a slide
    /// is looked at from as near as the mode before it was long.
    void shorten_first_step(Slot& slot, bool begins) const {
        if (vouches_for_slides<Lanes<W>>(sys_))
            return;
        const double most = begins ? slot[left] / 128 : 2 * (slot.began - slot[left]);
        const double least = 4e4 * ulp(slot[time]);
        if (!(most > 0 && most < slot[proposal])) // (one handed back goes on as it is)
            return;
        slot[proposal] = std::max(most, std::min(least, slot[proposal]));
        if (!(slot[period_length] > 0))
            slot[trial] = slot[proposal];
    }
    /// Counts the event, if it is one: a member that begins, or was handed back in this mode, meets
    /// none. False where it is one too many.
    bool change_mode(int s, int mode) {
        Slot& slot = pool_[s];
        if (slot.mode != Slot::none && slot.mode != mode) {
            if (slot.events >= settings_.max_events) {
                finish(s, Status::max_events);
                return false;
            }
            ++slot.events;
            slot.slides += mode == 0;
            if (population_.hears)
                population_.hear(slot.id, {kind_of(slot.mode, mode), 0, slot.mode, mode,
                                           clock_of(slot), slot.x()});
        }
        slot.mode = static_cast<signed char>(mode);
        return true;
    }
    /// Sends a member that is in its mode to what is to be done there.
    void go_on(int s) {
        const Slot& slot = pool_[s];
        if (!(slot[left] > 0))
            return end_leg(s);
        pool_.push(s, slot.mode == 0  ? Task::slide
                      : slot.mode < 0 ? Task::slip_below
                                      : Task::slip_above);
    }

    // --- ends ----------------------------------------------------------------------------------

    static Clock<double> clock_of(const Slot& slot) {
        return {slot[period_length], static_cast<long long>(slot[index]), slot[time], slot[carry]};
    }
    static Clock<double> end_of(const Slot& slot) {
        return {slot[period_length], static_cast<long long>(slot[end_index]), slot[end_time], 0};
    }
    Outcome<N> outcome(const Slot& slot, Status status) const {
        Outcome<N> o;
        o.status = status;
        o.clock = clock_of(slot);
        o.x = slot.x();
        o.mode = slot.mode;
        o.events = slot.events;
        o.slides = slot.slides;
        const double slid = slot.slid + (slot.mode == 0 ? slot.began - slot[left] : 0.0);
        o.slide_time = std::min(slid, std::abs(slot.ends - slot[left])); // a sum may round up
        o.steps = static_cast<long long>(slot[tries]);
        return o;
    }
    void finish(int s, Status status) {
        const Slot& slot = pool_[s];
        take(s, outcome(slot, status));
    }
    void take(int s, const Outcome<N>& o) {
        population_.take(pool_[s].id, o);
        worker_.count();
        pool_.release(s);
    }
    void end_leg(int s) {
        if (reach_end(s))
            go_on(s);
    }
    /// At the end of a leg: true if the member has another.
    bool reach_end(int s) {
        Slot& slot = pool_[s];
        if (slot.mode == 0)
            slot.slid += slot.began - slot[left];
        slot[time] = slot[end_time];
        slot[index] = slot[end_index];
        slot[carry] = 0;
        slot[left] = slot.began = 0;
        const Outcome<N> o = outcome(slot, Status::ok);
        if (!population_.goes_on(slot.id, o)) {
            take(s, o);
            return false;
        }
        const double leg = next_leg(population_, slot.id), T0 = slot[period_length];
        slot[left] = slot.began = slot.leg = leg;
        slot.ends += leg;
        if (T0 > 0)
            slot[end_index] += std::round(leg / T0);
        else
            slot[end_time] += leg;
        return true;
    }

    // --- the scalar engine ---------------------------------------------------------------------

    /// For how long. Not for a whole period: on a periodic orbit that would end at the very event
    /// that was not plain. And so long that a member is handed over a thousand times at most.
    double stretch_of(const Slot& slot) const {
        const double T0 = slot[period_length];
        return T0 > 0 ? 0.9 * T0 : std::max(100 * slot[proposal], 1e-3 * slot.leg);
    }
    /// Has a member run by the scalar engine for a while, or to the end of its leg.
    FILIPPOV_COLD void hand_over(int s) {
        Slot& slot = pool_[s];
        ++run_.counters.handed_over;
        const double some = stretch_of(slot);
        const bool last = !(some < slot[left]);
        Stretch<N, P> stretch;
        stretch.x = detail::plain<N>(slot.x());
        stretch.p = detail::plain<P>(slot.p());
        stretch.t0 = slot[time];
        stretch.dt = last ? slot[left] : some;
        if (slot.before != Slot::none && slot[start_order] > 0) {
            stretch.before = slot.before;
            stretch.guard = slot.guard;
        }
        stretch.ends_at_exit = population_.ends_at_exit;
        stretch.max_steps = settings_.max_steps - static_cast<long long>(slot[tries]);
        stretch.max_events = settings_.max_events - slot.events;
        detail::StretchTeller<N, P> teller(population_, slot.id, clock_of(slot));
        const StretchEnd<N> end = scalar_.run(stretch, worker_, teller.listener());
        if (end.status == Status::interrupted) // as all others that were not run to their end
            return;
        const Vec<double, N> x = detail::vector_of(end.x);
        slot.x() = x;
        if (slot.mode == 0) // until here; the stretch counted from here
            slot.slid += slot.began - slot[left];
        slot[index] += double(end.clock.index);
        slot[time] = end.clock.local;
        slot[carry] = end.clock.carry;
        slot[left] = slot.began = last ? 0 : clock_of(slot).until(end_of(slot));
        slot[tries] += double(end.steps);
        slot[start_order] = 0;
        slot.slid += end.slide_time;
        slot.events += end.events;
        slot.slides += end.slides;
        slot.mode = static_cast<signed char>(end.mode);
        slot.before = Slot::none;
        if (population_.gone(end.status, x))
            return finish(s, Status::escaped);
        if (end.status != Status::ok)
            return finish(s, end.status);
        if (!last || reach_end(s))
            pool_.push(s, Task::start);
    }

    const Sys& sys_;
    const Settings<double, N>& settings_;
    const ScalarEngine<N, P>& scalar_;
    Population<N, P>& population_;
    Worker& worker_;
    lanes::Run<Sys> run_;
    const lanes::Slip<Sys, W, Tableau> slip_{run_};
    const lanes::Slides<Sys, W, Tableau> slides_{run_};
    lanes::Pool<Sys, W> pool_;
    std::size_t next_ = 0, end_ = 0; ///< members that were not taken up yet
};

} // namespace filippov
