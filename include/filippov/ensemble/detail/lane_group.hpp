// SPDX-License-Identifier: BSD-3-Clause
// Members of an ensemble in memory, in lists by what is to be done with them next, and in lanes.
#pragma once

#include <filippov/core/lanes.hpp>
#include <filippov/system/system.hpp>

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace filippov {

/// Systems whose members can run in lanes. A system that branches on its scalars declares
/// `static constexpr bool lanes = false`, and is run by the scalar engine; so is one whose static
/// friction is known for plain numbers only.
template <class Sys>
concept RunsInLanes =
    single_v<Sys> && HasSides<Sys, Lanes<1>> && HasSwitch<Sys, Lanes<1>> &&
    HasSMax<Sys, Lanes<1>> == HasSMax<Sys, double> && !requires { requires !Sys::lanes; };

namespace lanes {

/// What is to be done with a member next.
enum class Task : std::size_t {
    // in lists, a group at a time
    start,
    slip_below,
    slip_above,
    fall_below, ///< at the end of a step that falls through the surface
    fall_above,
    event_below, ///< of a step in doubt
    event_above,
    slide,
    slide_end, ///< of a step or a window in doubt
    // at once
    enter_below, ///< a contact was judged: it goes on in this mode
    enter_slide,
    enter_above,
    exit_below, ///< the end of a slide was
    exit_above,
    end_leg, ///< it stands at the end of the run, or of its leg
    escape,
    hand_over, ///< to the scalar engine
};
inline constexpr std::size_t n_lists = std::size_t(Task::enter_below);

/// The numbers of a member that its lane computes with, besides its state, the field there and its
/// parameters.
enum class Field : std::size_t {
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
    across,      ///< L1 - L2, in a slide that is not known in closed form
    end_time,    ///< of the run, or of its leg
    end_index,
    fall_end,      ///< the guard at the end of a step that falls through the surface, ...
    fall_slope,    ///< ... and its derivative there
    period_length, ///< 0: none
    longest_step,
    n_numbers,
};
using enum Field;

/// A member in memory.
template <class Sys> struct Slot {
    static constexpr std::size_t N = dim_v<Sys>, P = params_v<Sys>;
    // In memory as a lane needs them: some tasks change only the first, or need no more than these.
    static constexpr std::size_t state = 0, field = N, numbers = 2 * N;
    static constexpr std::size_t n_changed = numbers + std::size_t(Field::end_time),
                                 n_moved = numbers + std::size_t(Field::fall_end),
                                 n_of_fall = numbers + std::size_t(Field::period_length),
                                 param = numbers + std::size_t(Field::n_numbers),
                                 n_fields = param + P;

    std::array<double, n_fields> v;
    std::size_t id;
    double before_slide; ///< the proposal when the last slide began
    double slid;         ///< time spent in slides
    double began;        ///< `left` where the mode, or this leg of it, began
    double leg;          ///< time from the start to the end of the run, or of its leg
    double ends;         ///< the same from the start of the run to the end of its leg
    std::int32_t events, slides;
    signed char mode;   ///< in which it goes on; `none`: it did not begin yet
    signed char before; ///< mode before the event at which it stands; `none`: it stands at none
    signed char guard;  ///< met there

    static constexpr signed char none = 2;

    double& operator[](Field f) { return v[numbers + std::size_t(f)]; }
    double operator[](Field f) const { return v[numbers + std::size_t(f)]; }
    auto x() { return Eigen::Map<Vec<double, dim_v<Sys>>>(v.data() + state); }
    auto x() const { return Eigen::Map<const Vec<double, dim_v<Sys>>>(v.data() + state); }
    auto p() { return Eigen::Map<Vec<double, params_v<Sys>>>(v.data() + param); }
    auto p() const { return Eigen::Map<const Vec<double, params_v<Sys>>>(v.data() + param); }
};

inline void each_lane(unsigned word, const auto& f) {
    for (; word != 0; word &= word - 1)
        f(std::countr_zero(word));
}

/// Members in lanes. A lane without one computes on what was there before.
template <class Sys, int W> struct Group {
    using Slot = lanes::Slot<Sys>;
    using T = Lanes<W>;
    using Mask = LaneMask<W>;
    using X = Vec<T, dim_v<Sys>>;
    using Q = Vec<T, params_v<Sys>>;
    static constexpr unsigned all_lanes = W == 32 ? ~0u : (1u << W) - 1u;

    std::array<T, Slot::param> v;
    Q params;
    std::array<int, W> slot;
    unsigned active = 0;

    T& operator[](Field f) { return v[Slot::numbers + std::size_t(f)]; }
    const T& operator[](Field f) const { return v[Slot::numbers + std::size_t(f)]; }
    X x() const { return vector<dim_v<Sys>>(Slot::state); }
    /// The field of the mode there: the first stage of the next step.
    X k0() const { return vector<dim_v<Sys>>(Slot::field); }
    const Q& p() const { return params; } // there may be many
    Mask members() const { return Mask::from_word(active); }

    void set(Field f, const T& value, const Mask& where) {
        (*this)[f] = select(where, value, (*this)[f]);
    }
    void set_x(const X& x, const Mask& where) { set(Slot::state, x, where); }
    void set_k0(const X& k0, const Mask& where) { set(Slot::field, k0, where); }

private:
    template <int n> Vec<T, n> vector(std::size_t first) const {
        Vec<T, n> r;
        for (std::size_t i = 0; i < n; ++i)
            r[Eigen::Index(i)] = v[first + i];
        return r;
    }
    void set(std::size_t first, const X& x, const Mask& where) {
        for (std::size_t i = 0; i < Slot::N; ++i)
            v[first + i] = select(where, x[Eigen::Index(i)], v[first + i]);
    }
};

/// Lanes whose members do not stay for another trip, and what is to be done with these.
template <int W> struct Leaving {
    unsigned lanes;
    std::array<Task, W> next;

    /// The scalar engine takes those of whom nothing else is said.
    explicit Leaving(unsigned leaving) : lanes(leaving), unsaid_(leaving) {
        each_lane(leaving, [&](int l) { next[std::size_t(l)] = Task::hand_over; });
    }
    /// Sends on those of whom nothing was said before.
    void send(const LaneMask<W>& where, Task task) {
        const unsigned word = where.word();
        each_lane(word & unsaid_, [&](int l) { next[std::size_t(l)] = task; });
        unsaid_ &= ~word;
    }

private:
    unsigned unsaid_;
};

/// The members that one thread has at hand, and their lists.
template <class Sys, int W> class Pool {
    using Slot = lanes::Slot<Sys>;
    using Group = lanes::Group<Sys, W>;
    using T = Lanes<W>;
    using List = std::vector<int>;
    static constexpr int size = 64 * W;

public:
    explicit Pool(bool same_params) : same_params_(same_params), slots_(size) {
        for (int s = size; s-- > 0;)
            free_.push_back(s);
        for (auto& list : lists_)
            list.reserve(size);
    }

    Slot& operator[](int s) { return slots_[std::size_t(s)]; }
    const Slot& operator[](int s) const { return slots_[std::size_t(s)]; }

    bool has_room() const { return !free_.empty(); }
    int next_free() const { return free_.back(); }
    void take_free() { free_.pop_back(); }
    void release(int s) { free_.push_back(s); }

    void push(int s, Task task) { list(task).push_back(s); }
    bool is_empty(Task task) const { return list(task).empty(); }
    Task longest_list() const {
        std::size_t longest = 0;
        for (std::size_t t = 1; t < n_lists; ++t)
            if (lists_[t].size() > lists_[longest].size())
                longest = t;
        return Task(longest);
    }
    /// True if some list fills a group.
    bool has_full_group() const { return list(longest_list()).size() >= std::size_t(W); }

    /// A group's first members. Lanes without one hold a copy of another, so that they compute
    /// nothing strange, and all have the parameters, should these be the same.
    void begin(Group& g, Task task) {
        const int s = list(task).back();
        const Slot& first = (*this)[s];
        for (std::size_t f = 0; f < Slot::param; ++f)
            g.v[f] = T(first.v[f]);
        for (std::size_t i = 0; i < Slot::P; ++i)
            g.params[Eigen::Index(i)] = T(first.v[Slot::param + i]);
        g.slot.fill(s);
        fill(g, task);
    }
    /// Fills lanes without a member from a list.
    void fill(Group& g, Task task) {
        List& from = list(task);
        const bool falls = task == Task::fall_below || task == Task::fall_above;
        // a member with its own parameters may have its own period
        const std::size_t n = !same_params_ ? Slot::param : falls ? Slot::n_of_fall : Slot::n_moved;
        if (g.active == 0 && from.size() >= std::size_t(W))
            return load_all(g, from, n);
        for (unsigned idle = Group::all_lanes & ~g.active; idle != 0 && !from.empty();
             idle &= idle - 1) {
            load(g, std::countr_zero(idle), from.back(), n);
            from.pop_back();
        }
    }
    /// Takes the member out of its lane.
    int unload(Group& g, int l, std::size_t n = Slot::n_changed) {
        const int s = g.slot[std::size_t(l)];
        for (std::size_t f = 0; f < n; ++f)
            (*this)[s].v[f] = g.v[f][l];
        g.active &= ~(1u << l);
        return s;
    }
    /// ... and puts it on a list.
    void leave(Group& g, int l, Task next) {
        const bool falls = next == Task::fall_below || next == Task::fall_above;
        push(unload(g, l, falls ? Slot::n_of_fall : Slot::n_changed), next);
    }

private:
    List& list(Task task) { return lists_[std::size_t(task)]; }
    const List& list(Task task) const { return lists_[std::size_t(task)]; }

    void load(Group& g, int l, int s, std::size_t n) {
        const Slot& from = (*this)[s];
        const auto lane = LaneMask<W>::from_word(1u << l);
        // whole registers: a part stored, and the whole loaded at once, would wait for the memory
        const auto put = [&](T& to, std::size_t f) { to = select(lane, T(from.v[f]), to); };
        for (std::size_t f = 0; f < n; ++f)
            put(g.v[f], f);
        each_param([&](std::size_t i) { put(g.params[Eigen::Index(i)], Slot::param + i); });
        g.slot[std::size_t(l)] = s;
        g.active |= 1u << l;
    }
    /// The same for all lanes, from the end of a list.
    void load_all(Group& g, List& list, std::size_t n) {
        std::array<const double*, W> from;
        for (std::size_t l = 0; l < W; ++l) {
            g.slot[l] = list.back();
            from[l] = (*this)[list.back()].v.data();
            list.pop_back();
        }
        const auto put = [&](T& to, std::size_t f) {
            to = T::of([&](int l) { return from[std::size_t(l)][f]; });
        };
        for (std::size_t f = 0; f < n; ++f)
            put(g.v[f], f);
        each_param([&](std::size_t i) { put(g.params[Eigen::Index(i)], Slot::param + i); });
        g.active = Group::all_lanes;
    }
    /// Those that differ from member to member.
    template <class F> void each_param(const F& f) const {
        for (std::size_t i = 0; i < Slot::P && !same_params_; ++i)
            f(i);
    }

    const bool same_params_;
    std::vector<Slot> slots_;
    List free_;
    std::array<List, n_lists> lists_;
};

} // namespace lanes

} // namespace filippov
