// SPDX-License-Identifier: BSD-3-Clause
// What happened along a trajectory: the typed event log, and user sections.
#pragma once

#include <filippov/system/system.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string_view>
#include <tuple>
#include <utility>

namespace filippov {

/// Event kinds, one list everywhere.
enum class EventKind : std::uint8_t {
    cross,          ///< from one side of a surface to the other
    enter_sliding,  ///< from a side into a slide
    exit_sliding,   ///< from a slide to a side
    graze,          ///< touched a surface from one side; no change of mode
    slide_extremum, ///< a slide touched its boundary from inside; no change of mode
    section,        ///< a user section was crossed
    jump,           ///< the state jumped
    accumulation,   ///< events accumulated here
    start,          ///< first point of the run
    end,            ///< last point of the run
};

constexpr std::string_view name(EventKind kind) {
    constexpr std::array<std::string_view, 10> names{
        "cross",   "enter_sliding", "exit_sliding", "graze", "slide_extremum",
        "section", "jump",          "accumulation", "start", "end"};
    return names[static_cast<std::size_t>(kind)];
}

/// What a change of the mode at one surface is.
constexpr EventKind kind_of(int before, int after) {
    if (before == 0)
        return after == 0 ? EventKind::slide_extremum : EventKind::exit_sliding;
    if (after == 0)
        return EventKind::enter_sliding;
    return before == after ? EventKind::graze : EventKind::cross;
}
constexpr bool is_change(EventKind kind) {
    return kind == EventKind::cross || kind == EventKind::enter_sliding ||
           kind == EventKind::exit_sliding;
}

/// One event.
template <class S, int N, int M> struct Event {
    S t{};                ///< absolute time
    long long period = 0; ///< period index, 0 without a period
    S t_local{};          ///< time since the start of that period; t without a period
    EventKind kind{};
    int surface = -1; ///< index of the surface, of the section for `section`, else -1
    Mode<M> mode_before{}, mode_after{};
    Vec<S, N> x_left{}, x_right{}; ///< state just before and just after
    S s{}; ///< blend variable: equivalent control in contact, -1 or +1 off the surface, NaN where
           ///< undefined
    unsigned contacts = 0; ///< surfaces that the point is on: bit j for surface j
    int alternatives = 0;  ///< modes among which a policy chose `mode_after`; 0 if it was unique
    bool s_unique = true;  ///< false: many s have the field of this slide; `s` is of least norm
};

/// A user's event function g(t, x, p) with scipy's attributes.
template <class F> struct Section {
    F value;               ///< g(t, x, p); t is absolute time
    int direction = 0;     ///< +1: only where g rises, -1: only where it falls, 0: both
    bool terminal = false; ///< end the run here
};
template <class F> Section(F) -> Section<F>;
template <class F> Section(F, int) -> Section<F>;
template <class F> Section(F, int, bool) -> Section<F>;

/// Several sections; an empty pack costs nothing.
template <class... F> struct Sections {
    std::tuple<Section<F>...> all;
    static constexpr int capacity = sizeof...(F);

    static constexpr int size() { return capacity; }
    template <class S, class X, class P> S value(int q, const S& t, const X& x, const P& p) const {
        S result(0);
        visit(q, [&](const auto& section) { result = section.value(t, x, p); });
        return result;
    }
    int direction(int q) const {
        int d = 0;
        visit(q, [&](const auto& section) { d = section.direction; });
        return d;
    }
    bool terminal(int q) const {
        bool b = false;
        visit(q, [&](const auto& section) { b = section.terminal; });
        return b;
    }

private:
    template <class Use> void visit(int q, Use use) const {
        int k = 0;
        std::apply([&](const auto&... section) { ((k++ == q ? use(section) : void()), ...); }, all);
    }
};

template <class... F> Sections(std::tuple<Section<F>...>) -> Sections<F...>;

/// sections(Section{f}, Section{g, +1, true}, ...)
template <class... F> Sections<F...> sections(Section<F>... section) {
    return {std::tuple<Section<F>...>(std::move(section)...)};
}

/// Any sections, called through pointers, so that one engine serves them all.
template <class S, int N, int P> class AnySections {
public:
    static constexpr int capacity = 16;

    AnySections() = default; ///< none
    template <class Sec>
    explicit AnySections(const Sec& sections)
        : sections_(&sections), size_(sections.size()),
          value_([](const void* all, int q, const S& t, const Vec<S, N>& x, const Vec<S, P>& p) {
              return S(static_cast<const Sec*>(all)->value(q, t, x, p));
          }),
          direction_(
              [](const void* all, int q) { return static_cast<const Sec*>(all)->direction(q); }),
          terminal_(
              [](const void* all, int q) { return static_cast<const Sec*>(all)->terminal(q); }) {
        static_assert(Sec::capacity <= capacity, "at most 16 sections");
    }

    int size() const { return size_; }
    S value(int q, const S& t, const Vec<S, N>& x, const Vec<S, P>& p) const {
        return value_(sections_, q, t, x, p);
    }
    int direction(int q) const { return direction_(sections_, q); }
    bool terminal(int q) const { return terminal_(sections_, q); }

private:
    const void* sections_ = nullptr;
    int size_ = 0;
    S (*value_)(const void*, int, const S&, const Vec<S, N>&, const Vec<S, P>&) = nullptr;
    int (*direction_)(const void*, int) = nullptr;
    bool (*terminal_)(const void*, int) = nullptr;
};

/// Up to `Capacity` sections chosen at run time.
template <class S, int N, int P, int Capacity = 16> struct DynamicSections {
    using Function = std::function<S(const S&, const Vec<S, N>&, const Vec<S, P>&)>;
    std::array<Section<Function>, Capacity> all;
    int count = 0;
    static constexpr int capacity = Capacity;

    int size() const { return count; }
    S value(int q, const S& t, const Vec<S, N>& x, const Vec<S, P>& p) const {
        return all[std::size_t(q)].value(t, x, p);
    }
    int direction(int q) const { return all[std::size_t(q)].direction; }
    bool terminal(int q) const { return all[std::size_t(q)].terminal; }
    bool callable(int q) const { return bool(all[std::size_t(q)].value); }
};

} // namespace filippov
