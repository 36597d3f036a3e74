// SPDX-License-Identifier: BSD-3-Clause
// Watches the guards of a run: what each step shows of them, and the first event in it.
#pragma once

#include <filippov/events/guards.hpp>
#include <filippov/events/roots.hpp>
#include <filippov/run/event.hpp>
#include <filippov/run/path.hpp>
#include <filippov/run/place.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

namespace filippov {

/// The event that a step shows first.
template <class S> struct Found {
    int guard = -1;       ///< -1: none
    S theta = S(2);       ///< where in the step
    bool touch = false;   ///< an extremum that touches zero, not a root
    int pole = -1;        ///< of the end of a slide: the guard of L1 - L2, if that ends with it
    bool blurred = false; ///< a guard swings too fast in the step to tell
    S next = S(2);        ///< where the first event is that is not of its surface
    bool jumps = false;   ///< the guard changes sign there without being zero: a jump, or a pole
};

/// The guards of a run, those of its user's sections among them. What asks for more of a step than
/// was probed has its path as an argument.
template <class Sys, class S> class Watch {
public:
    static constexpr int N = dim_v<Sys>;
    static constexpr int M = surfaces_v<Sys>;
    using X = State<Sys, S>;
    using Path = TriedPath<S, N>;
    using Watched = AnySections<S, N, params_v<Sys>>;
    static constexpr int n_guards = 3 * M + Watched::capacity;

    /// @param place  of the run, which must outlive this
    Watch(const Place<Sys, S>& place, const Watched& sections)
        : at_(place), sections_(sections), declared_linear_(has_linear_h(place.sys)) {}

    /// Where the steps from here on are probed.
    void probe_at(const ProbeTimes<S>& times) { times_ = &times; }

    // --- where guards start --------------------------------------------------------------------

    /// The run has entered its mode, or goes on in it. Guards start from their values here;
    /// `start_root(guard, order)` afterwards tells which of them start on a root. (In a slide that
    /// goes on those of an end at which s stays do.)
    /// @param tau  a time over which the solution changes
    void enter(bool goes_on, const S& tau) {
        see_limits(tau);
        list_active();
        see_gradients();
        for (const int g : active_guards()) {
            if (g >= Guard<M>::first_section)
                break;
            const S value = raw_guard(g, at_.clock.local, at_.x);
            const bool repels = g == Guard<M>::transversal(g / 3) && value < S(0);
            trace(g).sense = at_.mode[g / 3] != 0 ? S(at_.mode[g / 3]) : repels ? S(-1) : S(1);
            trace(g).start_at(trace(g).sense * value);
            if (goes_on && is_end_by_s(g) && value <= touch_band(g, true)) [[unlikely]]
                start_root(g, 2);
        }
        if constexpr (has_directions_v<Sys>) // what moves is no guard, but looked at
            for (int j = 0; j < M; ++j)
                if (moves_with_direction(j)) {
                    trace(Guard<M>::below(j)).sense = S(1);
                    trace(Guard<M>::below(j)).order = 0;
                }
    }
    /// A slide on surface j begins with these margins, where the fields beside it are not those
    /// that its mode names (a direction that leaves rest has none yet).
    FILIPPOV_COLD void start_slide(int j, const S& below, const S& above, const S& w) {
        for (const auto& [g, value] :
             {std::pair{Guard<M>::below(j), below}, std::pair{Guard<M>::above(j), above},
              std::pair{Guard<M>::transversal(j), w}})
            trace(g).start_at(trace(g).sense * value, trace(g).order);
    }
    /// True if in a step the direction whose first component is surface j turns by more than a
    /// third of half a turn: it has passed rest, or nearly.
    FILIPPOV_COLD bool turns_too_far(int j) const {
        using std::sqrt;
        const int end = direction_end(at_.sys, j);
        const Vec<S, M> a = switching(at_.sys, at_.clock.local, at_.x, at_.p);
        for (std::size_t k = 1; k <= times_->n; ++k) {
            S along(0), before(0), after(0);
            for (int i = j; i < end; ++i) {
                const S there = trace(Guard<M>::below(i)).probe[k];
                along += a[i] * there;
                before += a[i] * a[i];
                after += there * there;
            }
            if (!(along >= S(0.5) * sqrt(before) * sqrt(after)))
                return true;
        }
        return false;
    }

    /// Guard g starts on a root of this order: it is divided out of g in the next step.
    void start_root(int g, int order) {
        trace(g).order = order;
        trace(g).offset =
            g < Guard<M>::first_section ? guard_value(g, at_.clock.local, at_.x) : S(0);
    }

    /// A slide goes on after guard g of its end was met: g starts on a root, and on an intersection
    /// its attraction does, too, if that ended with s.
    void go_on_sliding(int g) {
        start_root(g, 2);
        if constexpr (M > 1) {
            const int attraction = Guard<M>::transversal(sliding_surface(at_.mode));
            GuardTrace& w = trace(attraction);
            if (at_.mode.sliding() < 2 ||
                !(w.start <= S(4) * touch_band(Guard<M>::below(g / 3), false)))
                return;
            w.start_at(w.sense * w.start);
            w.sense = S(1);
            start_root(attraction, 2);
        }
    }

    /// Watches guard g alone, from whichever side it starts on; -1: none.
    void only(int guard) {
        for (int g = 0; g < n_guards; ++g)
            trace(g).watched = g == guard;
        list_active();
        if (guard < 0 || !active(guard))
            return;
        const S value = raw_guard(guard, at_.clock.local, at_.x);
        trace(guard).sense = S(detail::sign(value));
        trace(guard).start = abs_(value);
        const S band = off_surface(guard) ? start_band(at_.sys, guard / 3, at_.clock.local, at_.x,
                                                       at_.p, X(at_.settings.atol))
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
    /// Sections go on from their values here, where a step has ended on an event.
    void go_on_with_sections() {
        for (const int q : active_guards())
            if (q >= Guard<M>::first_section)
                trace(q).start_at(guard_value(q, at_.clock.local, at_.x));
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
        return raw_guard(Guard<M>::first_section + q, at_.clock.local, at_.x);
    }

    /// A step was taken: the next one starts where it ended, or still on its root.
    FILIPPOV_INLINE void go_on() {
        for (const int g : active_guards()) {
            const bool on_root = trace(g).order > 0 && (says_nothing(g) || is_below_zero(g));
            if (on_root) [[unlikely]]
                continue; // still
            trace(g).start = end_value(g);
            trace(g).order = 0;
        }
    }

    /// The end of s, -1 or 1, at which a slide on an intersection started on surface j, and may
    /// stay; 0: at none.
    int limit(int j) const { return limits_[idx(j)]; }
    /// How surely a slide on an intersection attracts; what is left to the end of staying at a
    /// limit, if it does on surface j.
    template <class Slide> S attracts(const Slide& slide, int j) const {
        return limit(j) != 0 ? slide.apart[j] : slide.w;
    }
    /// True if h, where it was said to touch zero, is farther beyond than the tolerance explains.
    FILIPPOV_COLD bool dips(int g, const S& t, const X& x) const {
        return off_surface(g) && !(guard_value(g, t, x) >= -touch_band(g, false));
    }
    /// True of s_max + s and s_max - s of a surface slid on.
    bool is_end_by_s(int g) const { return of_slide(g) && g != Guard<M>::transversal(g / 3); }

    // --- values and probes ---------------------------------------------------------------------

    /// Sign of guard g before its event, 0 if not known yet.
    S sense(int g) const { return trace(g).sense; }
    /// Oriented value of a guard: positive before the event.
    S guard_value(int g, const S& t, const X& x) const {
        return trace(g).sense * raw_guard(g, t, x);
    }
    /// The same of the guard that was found, without its pole.
    S value_of(const Found<S>& found, const S& t, const X& x) const {
        const S value = guard_value(found.guard, t, x);
        return found.pole < 0 ? value : value * guard_value(found.pole, t, x);
    }

    /// The value of guard g, not oriented yet, at probe k of the step.
    FILIPPOV_INLINE void probe(int g, std::size_t k, const S& value) {
        trace(g).probe[k] = trace(g).sense * value;
    }
    FILIPPOV_INLINE void probe_margins(int slid, std::size_t k, const S& below, const S& above,
                                       const S& w) {
        for (const auto& [g, value] :
             {std::pair{Guard<M>::below(slid), below}, std::pair{Guard<M>::above(slid), above},
              std::pair{Guard<M>::transversal(slid), w}})
            probe(g, k, value);
    }
    /// Of a slide on the one surface there is. (Its friction may be static: then it ends beyond
    /// |s| = 1.)
    template <class Margins> FILIPPOV_INLINE void probe_slide(std::size_t k, const Margins& slide) {
        const S beyond = s_max(at_.sys, at_.p) - S(1);
        probe_margins(0, k, beyond + slide.below, beyond + slide.above, slide.w);
    }
    bool watches_sections() const { return sections_.size() > 0; }
    void probe_sections(std::size_t k, const S& t, const X& x) {
        for (int q = 0; q < sections_.size(); ++q) {
            const int g = Guard<M>::first_section + q;
            probe(g, k, raw_guard(g, t, x));
        }
    }
    /// Looks at what was probed of a step that is tried. Returns the sum of all that was probed of
    /// every h off its surface: finite only if all of it is.
    FILIPPOV_INLINE S see(const ProbeTimes<S>& times) {
        S total(0);
        for (int j = 0; j < M; ++j)
            if (at_.mode[j] != 0) {
                trace(Guard<M>::below(j)).see(times);
                total += trace(Guard<M>::below(j)).sum;
            }
        if (slides_ || watches_sections())
            for (const int g : active_guards())
                if (!off_surface(g))
                    trace(g).see(times);
        return total;
    }

    // --- what a step shows ---------------------------------------------------------------------

    /// Looks which guards keep a pace of their own in a step, and if these are clear of zero.
    ///
    /// A field's error estimate bounds a step by how the state bends. It says nothing of s along a
    /// slide, nor of an h or a section that is not linear in t and x (where the field is constant,
    /// one that has looked linear may be none). Those are held against a cubic: at the probes, and
    /// where these are off it, or too few, at samples on the path. Too few they are if a sixteenth
    /// of the time since the mode began fits between them.
    /// @param unjudged  of the step's length the error estimate told nothing
    /// @param elapsed   since the mode began
    FILIPPOV_INLINE void look(Path& path, bool unjudged, const S& elapsed) {
        if (any_pace_) [[unlikely]]
            see_pace(path, unjudged, elapsed);
    }
    FILIPPOV_INLINE bool any_doubt() const {
        for (const int g : active_guards())
            if (doubtful(g))
                return true;
        return false;
    }
    /// True if the field alone says nothing of how soon an event may come: sections are watched, or
    /// an h that is not known to be linear.
    bool may_outpace() const {
        for (const int g : active_guards())
            if (g >= Guard<M>::first_section || (off_surface(g) && !declared_linear_))
                return true;
        return false;
    }
    /// By how much the next step may be longer, or has to be shorter, for the sake of guards with a
    /// pace of their own: it is not longer than what the mode has shown so far.
    FILIPPOV_INLINE S growth(Path& path) {
        return any_pace_ ? growth_by_pace(path) : std::numeric_limits<S>::infinity();
    }
    bool starts_on_root() const {
        for (const int g : active_guards())
            if (trace(g).order > 0)
                return true;
        return false;
    }
    /// True if guard g starts on a root of second order or higher.
    bool starts_on_higher_root(int g) const {
        return g < Guard<M>::first_section && trace(g).order > 1;
    }
    /// True if it does, and the path is too short to leave that root by more than rounding.
    bool is_on_higher_root(int g, Path& path) const {
        if (!starts_on_higher_root(g))
            return false;
        const S band = touch_band(g, true), t = at_.clock.local;
        return abs_(guard_value(g, S(t + path.dt), path.x1)) <= band &&
               abs_(guard_value(g, S(t + path.dt / S(2)), path(S(0.5)))) <= band;
    }
    /// When the first surface will be met, in units of the step from its end, that a parabola
    /// through h over the step foresees; infinite if that is plainly later than `within`.
    FILIPPOV_INLINE S next_contact(const S& within) const {
        S nearest = std::numeric_limits<S>::infinity();
        for (int j = 0; j < M; ++j) {
            const GuardTrace& w = trace(Guard<M>::below(j));
            if (at_.mode[j] != 0 && w.watched && w.order == 0 && !moves_with_direction(j))
                nearest = std::min(nearest, w.next_zero(*times_, within));
        }
        return nearest;
    }

    /// The earliest event of a step among the guards in doubt.
    /// @param patient  it is sought as long as it takes
    /// @param missed   bit g: of guard g the interpolant shows a root that no step has
    FILIPPOV_COLD Found<S> first_event(Path& path, bool patient, std::uint64_t missed) {
        static_assert(n_guards <= 64);
        Found<S> first;
        for (const int g : active_guards()) {
            if ((missed >> g & 1u) != 0)
                continue;
            if ((at_.settings.skip_root_search && !doubtful(g)) || says_nothing(g))
                continue;
            const auto raw = [&](const S& theta) {
                return guard_value(g, S(at_.clock.local + theta * path.dt), path(theta));
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
            trace(g).sliver = S(0);
            Found<S> found = event_of(g, path, raw, patient);
            if (found.guard >= 0 && trace(g).order > 0) {
                trace(g).sliver = leaves_rounding(g, raw, found.theta);
                if (trace(g).sliver > S(0)) // that was none
                    found = event_of(g, path, raw, patient);
            }
            if (found.blurred)
                return found;
            if (found.guard >= 0 && !found.touch && trace(g).own_pace && !looks_linear(g) &&
                !falls_smoothly(found.theta, without_root(g, raw))) {
                found.theta = first_of_several(g, raw, found.theta);
                found.jumps = changes_without_zero(g, raw, found.theta);
            }
            if (found.theta < first.theta)
                std::swap(first, found);
            first.next = std::min(first.next, found.next);
            if (found.guard >= 0 && !ends_same_slide(first.guard, found.guard))
                first.next = std::min(first.next, found.theta);
        }
        return first;
    }

    /// True if in a step of a slide L1 - L2 of surface j falls below half of its start, or of what
    /// it was `before`.
    FILIPPOV_INLINE bool loses_transversality(int j, const S& before) const {
        const GuardTrace& w = trace(Guard<M>::transversal(j));
        return !(w.seen.low > S(0.5) * std::max(w.start, before));
    }
    /// L1 - L2 of surface j, slid on, where a step starts.
    S transversality(int j) const { return trace(Guard<M>::transversal(j)).start; }
    /// True if no guard but those of the slide on surface j has changed its sign at (t, x).
    FILIPPOV_COLD bool only_slide_ends(int j, const S& t, const X& x) const {
        for (const int g : active_guards())
            if (!(of_slide(g) && g / 3 == j) && trace(g).order == 0 && guard_value(g, t, x) < S(0))
                return false;
        return true;
    }

    /// True if at the end of a path, on the event of one guard, another has fallen through zero by
    /// more than its rounding and this part of its range: its event came before. (The interpolant
    /// of the whole step had placed it behind: an error that is nothing to the state may be much
    /// beside how high a guard gets between two events of its own.)
    FILIPPOV_COLD bool another_came_before(int guard, const Path& path, const S& part) const {
        const S t = at_.clock.local + path.dt;
        for (const int g : active_guards()) {
            const GuardTrace& w = trace(g);
            if (w.sense == S(0) || w.offset < S(0) || ends_same_slide(g, guard))
                continue;
            if (guard_value(g, t, path.x1) < -(touch_band(g, true) + part * size_of(g)))
                return true;
        }
        return false;
    }

    /// True of a value of guard g that is zero beside what g was in a step.
    FILIPPOV_COLD bool is_zero(int g, const S& value) const {
        return abs_(value) <= S(1e-6) * size_of(g);
    }
    /// The guard of an end by s at which a slide is over at (t, x), -1: none.
    FILIPPOV_COLD int ended_slide(const S& t, const X& x) const {
        for (const int g : active_guards())
            if (is_end_by_s(g) && !(guard_value(g, t, x) >= S(0)))
                return g;
        return -1;
    }
    /// The end of a slide that came before the end of this path, where L1 - L2 (guard `pole`) has
    /// just vanished: there 1 + s and 1 - s have poles, and where a root and the pole behind it lie
    /// between two probes, those show neither. Their numerators have no poles. None at a two-fold,
    /// where they vanish with L1 - L2; and none of a slide on several surfaces, whose guard tells
    /// of attraction and divides nothing.
    FILIPPOV_COLD Found<S> before_pole(int pole, Path& path) {
        Found<S> first;
        if (slid_surfaces(at_.mode).n != 1)
            return first;
        const S reach = S(1) - S(64) * ulp(S(at_.clock.local + path.dt)) / abs_(path.dt);
        if (!(reach > S(0)))
            return first;
        for (const int g : active_guards()) {
            if (!is_end_by_s(g))
                continue;
            const Found<S> end{g, S(0), false, pole};
            const auto numerator = [&](const S& u) {
                const S theta = u * reach;
                return value_of(end, S(at_.clock.local + theta * path.dt), path(theta));
            };
            if (!(numerator(S(1)) < S(0)))
                continue;
            const auto value = without_root(g, numerator);
            const S start = value(S(0));
            S u(2);
            if (start > S(0) && first_contact(value, start, S(0), u) == Contact::root &&
                u * reach < first.theta)
                first = {g, u * reach, false, pole};
        }
        return first;
    }

    /// A guard that is zero to rounding at the end of a step is met there: the next step, or nobody
    /// at the end of the run, would find its root at the start.
    Found<S> contact_at_end(const Path& path, bool last) const {
        for (const int g : active_guards()) {
            const GuardTrace& w = trace(g);
            if (w.order > 0 || w.sense == S(0))
                continue;
            const S size = size_of(g);
            if (!is_zero(g, w.probe[times_->n]))
                continue;
            const S t = at_.clock.local + path.dt, value = guard_value(g, t, path.x1);
            S band = g < Guard<M>::first_section ? touch_band(g, true)
                                                 : (last ? S(64) * epsilon<S> * size : S(-1));
            if (last && off_surface(g)) // what is met sooner than time can tell is met
                band += S(4) * ulp(t) *
                        abs_(normal_component(at_.sys, g / 3, t, path.x1, at_.p, path.end_field()));
            if (abs_(value) <= band && w.start > band)
                return {g, S(1), false};
        }
        return {};
    }

private:
    /// What the run has seen of a surface.
    struct Surface {
        X gradient;
        S rate = S(0);      ///< dh/dt
        bool seen = false;  ///< these are its
        bool linear = true; ///< these are the same everywhere, as far as was seen
    };
    using GuardTrace = Trace<S>;
    static constexpr const ProbeTimes<S>& sample_times = probe_times<SampleTimes<S>, S>;

    static std::size_t idx(int g) { return static_cast<std::size_t>(g); }
    FILIPPOV_INLINE GuardTrace& trace(int g) { return traces_[idx(g)]; }
    FILIPPOV_INLINE const GuardTrace& trace(int g) const { return traces_[idx(g)]; }
    /// The value of guard g at the end of the step.
    S end_value(int g) const { return trace(g).probe[times_->n]; }
    static S abs_(const S& v) {
        using std::abs;
        return abs(v);
    }

    /// The largest value of guard g at the start of a step and its probes.
    S size_of(int g) const {
        const Range<S> r = trace(g).range(*times_);
        return std::max(abs_(r.low), abs_(r.high));
    }
    /// True of a component of a direction that moves.
    bool moves_with_direction(int j) const { return at_.mode[j] != 0 && is_directed(at_.sys, j); }
    /// True of what ends a slide.
    bool of_slide(int g) const { return g < Guard<M>::first_section && at_.mode[g / 3] == 0; }
    /// True of one guard, or of two that end the same slide.
    bool ends_same_slide(int a, int b) const {
        return a == b || (of_slide(a) && of_slide(b) && a / 3 == b / 3);
    }
    /// True of h on a surface that is not slid on.
    bool off_surface(int g) const { return g < Guard<M>::first_section && at_.mode[g / 3] != 0; }
    bool active(int g) const {
        if (!trace(g).watched)
            return false;
        if (g >= Guard<M>::first_section)
            return g - Guard<M>::first_section < sections_.size();
        if (g % 3 == 2) // one for all the surfaces slid on, or for each where s stays at an end
            return any_limit_ ? limit(g / 3) != 0 : g / 3 == sliding_surface(at_.mode);
        if constexpr (has_directions_v<Sys>)
            if (is_directed(at_.sys,
                            g / 3)) // 1 - |s|^2 where it sticks, and nothing where it moves
                return at_.mode[g / 3] == 0 && g % 3 == 0 &&
                       is_kind(at_.sys, g / 3, SurfaceKind::direction);
        return at_.mode[g / 3] == 0 || g % 3 == 0;
    }
    /// Sees on which surfaces of an intersection s is at an end, and a little later, too: what only
    /// touches it does not stay.
    void see_limits([[maybe_unused]] const S& tau) {
        if constexpr (M > 1) {
            limits_ = {};
            any_limit_ = false;
            if (at_.mode.sliding() < 2)
                return;
            const auto slide_at = [&](const S& t, const X& x) {
                return joint_sliding(at_.sys, at_.mode, t, x, at_.p, at_.its_layers());
            };
            const auto ends = [&](const auto& slide, int j) {
                return std::min(slide.below[j], slide.above[j]) <= detail::share_rounding<S>;
            };
            const S t = at_.clock.local, dt = S(1e-3) * tau;
            const auto slide = slide_at(t, at_.x);
            for (int j = 0; j < M; ++j)
                if (at_.mode[j] == 0 && is_kind(at_.sys, j, SurfaceKind::switching) &&
                    !(at_.layered && at_.layers.has(j)) && ends(slide, j) &&
                    ends(slide_at(S(t + dt), X(at_.x + dt * slide.f)), j)) {
                    limits_[idx(j)] = slide.below[j] < slide.above[j] ? -1 : 1;
                    any_limit_ = true;
                }
        }
    }
    void list_active() {
        slides_ = at_.mode.sliding() > 0;
        n_active_ = 0;
        for (int g = 0; g < Guard<M>::first_section + sections_.size(); ++g)
            if (active(g))
                active_[idx(n_active_++)] = g;
        any_pace_ = false;
        for (const int g : active_guards()) {
            trace(g).own_pace = false;
            any_pace_ = any_pace_ || !off_surface(g) || !declared_linear_;
        }
    }
    std::span<const int> active_guards() const { return {active_.data(), idx(n_active_)}; }

    /// A guard before it is given its sense.
    S raw_guard(int g, const S& t, const X& x) const {
        if (g >= Guard<M>::first_section)
            return sections_.value(g - Guard<M>::first_section, S(at_.clock.offset() + t), x,
                                   at_.p);
        const int j = g / 3;
        if (at_.mode[j] != 0)
            return switching(at_.sys, t, x, at_.p)[j];
        if constexpr (M > 1)
            if (g % 3 == 2)
                return attracts(joint_sliding(at_.sys, at_.mode, t, x, at_.p, at_.its_layers()), j);
        const Margin<S> margin = at_.margin(j, t, x);
        if (g % 3 == 2)
            return margin.w;
        return s_max(at_.sys, at_.p) - S(1) + (g % 3 == 0 ? margin.below : margin.above);
    }

    /// True unless the step shows that guard g stays clear of zero.
    FILIPPOV_INLINE bool doubtful(int g) const {
        const GuardTrace& w = trace(g);
        const bool of_h = g < Guard<M>::first_section && !slides_;
        // Off the surfaces a step with a NaN was rejected before.
        if (!of_h && !(w.sum < std::numeric_limits<S>::infinity()))
            return true;
        // (what comes down to a thirtieth of its spread may be within its touch band there)
        return w.own_pace ? !(w.fit.clear() && stays_clear_if_monotone(w.fit.floor, w.fit.spread))
                          : w.doubtful(*times_);
    }

    // --- guards with a pace of their own -------------------------------------------------------

    FILIPPOV_COLD void see_pace(Path& path, bool unjudged, const S& elapsed) {
        bool any = false;
        // (a step that is long beside what the mode has shown so far may hide a bump of an h that
        // is flat elsewhere)
        unjudged = unjudged || is_long(path, elapsed);
        for (const int g : active_guards()) {
            trace(g).own_pace = keeps_pace(g, path, unjudged);
            any = any || trace(g).own_pace;
        }
        if (any)
            look_closely(path, elapsed);
    }
    FILIPPOV_COLD S growth_by_pace(Path& path) {
        S most = std::numeric_limits<S>::infinity();
        for (const int g : active_guards())
            if (trace(g).own_pace)
                most = std::min({most, room_of(g, path), S(2)});
        return most;
    }
    /// True of a guard that the steps of a field do not resolve as a matter of course.
    bool keeps_pace(int g, const Path& path, bool unjudged) {
        if (g >= Guard<M>::first_section)
            return true;
        if (at_.mode[g / 3] == 0)
            return !path.kind.vouched;
        if (declared_linear_)
            return false;
        Surface& surface = surfaces_[idx(g / 3)];
        surface.linear = surface.linear && is_straight(g, path) &&
                         has_gradient(surface, g / 3, S(at_.clock.local + path.dt), path.x1);
        return unjudged || !surface.linear;
    }
    /// True of an h that was linear in t and x wherever the run has looked.
    bool looks_linear(int g) const { return off_surface(g) && surfaces_[idx(g / 3)].linear; }
    /// True if h_j changes over a step as its gradient says.
    bool is_straight(int g, const Path& path) const {
        const Surface& surface = surfaces_[idx(g / 3)];
        const GuardTrace& w = trace(g);
        S linear = surface.rate * path.dt, size = abs_(w.start) + abs_(w.probe[times_->n]);
        for (int i = 0; i < N; ++i) {
            linear += surface.gradient[i] * (path.x1[i] - at_.x[i]);
            size += abs_(surface.gradient[i] * path.x1[i]);
        }
        const S change = w.probe[times_->n] - w.start;
        return abs_(change - w.sense * linear) <= S(1e-8) * size;
    }
    /// Which h are linear: their gradients stay the same. (At some places others may seem to be.)
    void see_gradients() {
        for (int j = 0; j < M && !declared_linear_; ++j) {
            Surface& surface = surfaces_[idx(j)];
            if (at_.mode[j] == 0 || !surface.linear)
                continue;
            if (!surface.seen) {
                surface.gradient = grad_h(at_.sys, j, at_.clock.local, at_.x, at_.p);
                surface.rate = h_t(at_.sys, j, at_.clock.local, at_.x, at_.p);
                surface.seen = true;
            } else {
                surface.linear = has_gradient(surface, j, at_.clock.local, at_.x);
            }
        }
    }
    /// True if h_j has the gradient here that it had where it was seen first, to the last bit.
    bool has_gradient(const Surface& surface, int j, const S& t, const X& x) const {
        return surface.rate == h_t(at_.sys, j, t, x, at_.p) &&
               surface.gradient == grad_h(at_.sys, j, t, x, at_.p);
    }

    FILIPPOV_COLD void look_closely(Path& path, const S& elapsed) {
        bool more = is_long(path, elapsed);
        for (const int g : active_guards()) {
            GuardTrace& w = trace(g);
            w.sampled = false;
            if (!w.own_pace || w.sense == S(0))
                continue;
            w.fit = fit(g, *times_, [&](std::size_t k) { return w.probe[k]; });
            // (what swings at the beat of equidistant probes looks still at them)
            more = more || times_->equidistant || !(w.fit.clear() || w.fit.resolved());
        }
        if (more)
            take_samples(path);
    }
    /// True if a sixteenth of the time since the mode began fits between probes.
    bool is_long(const Path& path, const S& elapsed) const {
        return !path.kind.exact_probes && abs_(path.dt) * times_->widest_gap > elapsed * S(0.0625);
    }
    FILIPPOV_COLD void take_samples(Path& path) {
        sample(path);
        for (const int g : active_guards()) {
            GuardTrace& w = trace(g);
            w.sampled = w.own_pace && w.sense != S(0);
            if (w.sampled)
                w.fit = fit(g, sample_times, [&](std::size_t k) { return w.sample[k]; });
        }
    }
    /// Samples guards with a pace of their own along a step.
    void sample(Path& path) {
        using Times = SampleTimes<S>;
        for (std::size_t k = 1; k <= Times::n; ++k) {
            if (path.kind.exact_probes) {
                for (const int g : active_guards())
                    trace(g).sample[k] = trace(g).probe[k];
                continue;
            }
            const S t = at_.clock.local + Times::theta(k) * path.dt;
            const X x = k < Times::n ? path(Times::theta(k)) : path.x1;
            if (slides_ && !path.kind.vouched)
                sample_slide(k, t, x);
            for (const int g : active_guards())
                if (trace(g).own_pace && !of_slide(g))
                    trace(g).sample[k] = guard_value(g, t, x);
        }
    }
    /// Samples all guards of a slide, which one look at the fields gives.
    void sample_slide(std::size_t k, const S& t, const X& x) {
        if constexpr (single_v<Sys>) {
            sample_margins(0, k, at_.margin(0, t, x));
        } else {
            const auto slide = joint_sliding(at_.sys, at_.mode, t, x, at_.p, at_.its_layers());
            for (int j = 0; j < M; ++j)
                if (at_.mode[j] == 0)
                    sample_margins(
                        j, k, {slide.s[j], slide.below[j], slide.above[j], attracts(slide, j)});
        }
    }
    void sample_margins(int slid, std::size_t k, const Margin<S>& slide) {
        const S beyond = s_max(at_.sys, at_.p) - S(1);
        for (const auto& [g, value] : {std::pair{Guard<M>::below(slid), S(beyond + slide.below)},
                                       std::pair{Guard<M>::above(slid), S(beyond + slide.above)},
                                       std::pair{Guard<M>::transversal(slid), slide.w}})
            trace(g).sample[k] = trace(g).sense * value;
    }
    /// The fit of guard g to its values on a step, but for their rounding.
    template <class Value>
    FILIPPOV_COLD Fit<S> fit(int g, const ProbeTimes<S>& times, const Value& value) const {
        return fit_of(times, trace(g).start, value).without(noise(g));
    }
    /// What rounding alone may make of guard g.
    S noise(int g) const {
        const S of_value = S(64) * epsilon<S> * (abs_(trace(g).start) + trace(g).fit.spread);
        return g < Guard<M>::first_section ? of_value + touch_band(g, true) : of_value;
    }
    /// By how much the next step may be longer for the sake of guard g. What is not smooth up
    /// close, as the rounding of what cancels within h, would hold back the steps for nothing.
    FILIPPOV_COLD S room_of(int g, Path& path) const {
        const S room =
            trace(g).sense != S(0) ? trace(g).fit.room() : std::numeric_limits<S>::infinity();
        if (room >= S(1))
            return room;
        const auto off_in = [&](const S& part) { // of the step, from its start
            const auto value = [&](std::size_t k) {
                const S theta = part * WindowTimes<S>::theta(k);
                return guard_value(g, S(at_.clock.local + theta * path.dt), path(theta));
            };
            const Fit<S> part_fit = fit(g, probe_times<WindowTimes<S>, S>, value);
            return part_fit.off == S(0) ? S(0) : part_fit.off / part_fit.spread;
        };
        const S off = off_in(S(1));
        for (S part = S(1) / S(2); part > S(1e-3); part /= S(2))
            if (off_in(part) < off / S(2))
                return std::max(room, S(0.25));
        return S(1);
    }

    /// Minima of guard g closer to zero than this count as touches: the error that the tolerance
    /// allows, or rounding.
    S touch_band(int g, bool rounding_only) const {
        if (g >= Guard<M>::first_section || (at_.mode[g / 3] == 0 && g % 3 == 2))
            return S(0);
        const int j = g / 3;
        const bool fixed = at_.settings.fixed_step > S(0);
        if (at_.mode[j] == 0 && is_kind(at_.sys, j, SurfaceKind::jump))
            return S(0); // a force has no scale
        if (at_.mode[j] == 0)
            return S(64) * epsilon<S> + (fixed || rounding_only ? S(0) : at_.settings.rtol);
        const S rounding = rounding_band(at_.sys, j, at_.clock.local, at_.x, at_.p);
        if (fixed || rounding_only)
            return rounding;
        return rounding + change_over(at_.sys, j, at_.clock.local, at_.x, at_.p, at_.scale);
    }

    /// True if the far side of surface j leads back to it: a touch within the tolerance then
    /// changes nothing.
    bool far_side_attracts(int j, const S& t, const X& x) const {
        if (is_kind(at_.sys, j, SurfaceKind::jump))
            return true; // there is no far side: a jump from a touch changes nothing either
        Mode<M> far = at_.mode;
        far.set(j, -at_.mode[j]);
        const X f = mode_field(at_.sys, far, t, x, at_.p);
        return S(at_.direction * at_.mode[j]) * normal_component(at_.sys, j, t, x, at_.p, f) > S(0);
    }

    /// True of a guard that starts on a root and has not left it by more than rounding in a step:
    /// that step is too short to tell. (From a higher root the step's end alone shows it: the
    /// stages' errors are larger than the guard.)
    bool says_nothing(int g) const {
        const GuardTrace& w = trace(g);
        if (g >= Guard<M>::first_section || w.order == 0 || w.sense == S(0))
            return false;
        const S band = touch_band(g, true);
        if (w.order > 1)
            return abs_(w.probe[times_->n]) <= band;
        const Range<S> r = w.range(*times_);
        return r.high <= band && r.low >= -band;
    }

    /// True of a guard that has touched zero a little beyond it, within the tolerance, and has not
    /// come back yet: it is measured from that touch.
    bool is_below_zero(int g) const {
        const GuardTrace& w = trace(g);
        return w.offset < S(0) && !(w.probe[times_->n] > S(0));
    }

    /// How near to a root at the start of a step nothing can be told from its quotient. How soon a
    /// guard leaves a higher root is asked of the guard itself: the first stages may say too soon;
    /// and so may the guard, where a slide's end was not met to the last digit.
    template <class Raw> S root_sliver(int g, const Raw& raw) const {
        using std::pow;
        using std::sqrt;
        const Range<S> r = trace(g).range(*times_);
        const S rounding = S(4) * touch_band(g, true), size = std::max(r.high, -r.low);
        const S lost = rounding / size, nothing = std::max(rounding, S(1e-8) * size);
        const int order = trace(g).order;
        const S least = order == 1 ? S(1e-9) : std::max(S(1e-3), sqrt(sqrt(epsilon<S>)));
        S sliver = pow(lost, S(1) / S(order));
        sliver = sliver > least ? std::min(sliver, S(0.5)) : least;
        while (order > 1 && sliver < S(0.5) && !(abs_(raw(sliver)) > nothing))
            sliver = std::min(S(2) * sliver, S(0.5));
        return std::max(sliver, trace(g).sliver);
    }

    /// The side of a guard that starts exactly on zero: where the step goes.
    template <class Raw> void find_sense(int g, const Path& path, const Raw& raw) {
        trace(g).sense = S(1);
        const S early = raw(S(1e-3)), late = raw(S(1));
        if (early < S(0) || (early == S(0) && late < S(0)))
            trace(g).sense = S(-1);
        trace(g).probe[times_->n] = guard_value(g, S(at_.clock.local + path.dt), path.x1);
    }

    /// Where guard g leaves its root at the start by more than rounding, if it has not before a
    /// root at theta, and does so on the side on which it began; else 0.
    template <class Raw> S leaves_rounding(int g, const Raw& raw, const S& theta) const {
        const S rounding = S(4) * touch_band(g, true);
        if (!(abs_(raw(S(theta / S(2)))) <= rounding))
            return S(0);
        S u = theta;
        do
            u = std::min(S(2) * u, S(1));
        while (u < S(1) && abs_(raw(u)) <= rounding);
        return u < S(1) && raw(u) > rounding ? u : S(0);
    }

    /// The first root or touch of guard g, `raw` along the path.
    template <class Raw> Found<S> event_of(int g, Path& path, const Raw& raw, bool patient) {
        const ProbeTimes<S>& times = *times_;
        GuardTrace& w = trace(g);
        if (const std::size_t k = w.own_pace ? 0 : w.falls_through(times))
            return {g,
                    bracketed_root<S>(raw, times.theta[k - 1], k > 1 ? w.probe[k - 1] : w.start,
                                      times.theta[k], w.probe[k]),
                    false};
        const auto value = without_root(g, raw);
        S g0 = w.order == 0 ? w.start : value(S(0));
        if (!(g0 > S(0)))
            g0 = std::numeric_limits<S>::min();
        S theta(2);
        // A touch comes down to zero from outside its band: what still leaves it does not touch,
        // and is searched from where it has left.
        const S band = touch_band(g, false);
        const bool outside = w.order == 0 && (w.start > band + touch_band(g, true) || w.descended);
        Samples samples;
        const KnownValues<S> known = known_values(path, g, raw, value, samples);
        Contact contact = first_contact(value, g0, outside ? band : S(0), theta, known, patient);
        if (contact == Contact::blurred)
            return {.guard = g, .blurred = true};
        if (!outside && band > S(0)) {
            S touch = contact == Contact::none ? S(1) : theta;
            if (touch_after_leaving(g, raw, band, touch)) {
                contact = Contact::touch;
                theta = touch;
            }
        }
        if (contact == Contact::touch && off_surface(g) &&
            !far_side_attracts(g / 3, S(at_.clock.local + theta * path.dt), path(theta)))
            contact = first_contact(value, g0, outside ? touch_band(g, true) : S(0), theta, known);
        if (contact == Contact::none && w.descended &&
            first_minimum(raw, S(w.start - touch_band(g, true)), theta))
            contact = Contact::touch;
        w.descended =
            outside && contact == Contact::none && w.probe[times_->n] <= band && band > S(0);
        return contact == Contact::none ? Found<S>{}
                                        : Found<S>{g, theta, contact == Contact::touch};
    }

    /// How many more there are between a root at the start and the first of the others, each twice
    /// as near to it as the last, as far as g is no rounding there: one of several roots is
    /// followed by the next at once.
    static constexpr std::size_t n_near_root = 6;
    using Samples = std::array<KnownValue<S>, n_near_root + SampleTimes<S>::n - 1>;
    /// The samples that a search has to begin with: those of a guard that is not quite a cubic.
    template <class Raw, class Value>
    KnownValues<S> known_values(Path& path, int g, const Raw& raw, const Value& value,
                                Samples& samples) {
        using Times = SampleTimes<S>;
        const GuardTrace& w = trace(g);
        if (!w.own_pace || w.fit.off <= S(1e-6) * w.fit.spread ||
            (looks_linear(g) && w.fit.resolved())) // (what is off is rounding)
            return {};
        if (!w.sampled)
            take_samples(path);
        const bool rooted = w.order > 0;
        std::size_t n = 0;
        for (std::size_t k = n_near_root; rooted && k > 0; --k) {
            const S theta = Times::theta(1) / S(1u << k);
            if (abs_(raw(theta)) > S(64) * touch_band(g, true))
                samples[n++] = {theta, value(theta)};
        }
        for (std::size_t k = 1; k < Times::n; ++k)
            samples[n++] = {Times::theta(k), rooted ? value(Times::theta(k)) : w.sample[k]};
        KnownValues<S> known{std::span(samples).first(n)};
        if (!rooted && w.fit.resolved())
            known.far = w.fit.far(S(1) / S(16));
        return known;
    }

    /// The first of the roots of guard g, of which one is at theta. Behind a surface that moves a
    /// step may go on for many swings of it, small beside how deep that is: the root is looked for
    /// again, as if the step ended there, and in ever shorter windows before it. (A swing that
    /// makes three roots of one is no smaller than what h falls in the meantime.)
    template <class Raw> S first_of_several(int g, const Raw& raw, S theta) const {
        const auto value = without_root(g, raw);
        const S least = std::numeric_limits<S>::min(), rounding = S(4) * touch_band(g, true);
        const S depth = rounding + touch_band(g, false); // of what is no error of the path
        const S start = std::max(trace(g).order == 0 ? trace(g).start : value(S(0)), least);
        int more = 64; // roots
        for (S part(1); part > S(1) / S(512); part /= S(4)) {
            const S from = part < S(1) ? theta - part * theta : S(0);
            const S before = part < S(1) ? value(from) : start;
            if (part < S(1) && !(abs_(raw(from)) > rounding))
                break;
            const auto within = [&](const S& u) { return value(S(from + u * (theta - from))); };
            S earlier = theta, u(2);
            if (!(before > S(0)))
                earlier = bracketed_root<S>(value, S(0), start, from, before);
            else if (first_contact(within, before, S(0), u) == Contact::root)
                earlier = from + u * (theta - from);
            if (!(earlier < theta * (S(1) - S(1e-4))))
                continue;
            S between = theta - earlier; // plainly beyond, before it comes back
            while (between > S(1e-4) * theta && !(raw(S(earlier + between)) < -depth))
                between /= S(2);
            if (between > S(1e-4) * theta && more-- > 0) {
                theta = earlier;
                part = S(4);
            }
        }
        return theta;
    }

    /// True if guard g changes its sign at theta without being zero: closer to it, it gets no
    /// smaller.
    template <class Raw> bool changes_without_zero(int g, const Raw& raw, const S& theta) const {
        S low = theta - S(1e-3) * theta, high = std::min(theta + S(1e-3) * theta, S(1));
        const S far = std::min(raw(low), -raw(high));
        if (!(far > S(0)))
            return false;
        for (int k = 0; k < 20; ++k) {
            const S middle = low + (high - low) / S(2);
            (raw(middle) > S(0) ? low : high) = middle;
        }
        const S close = std::min(abs_(raw(low)), abs_(raw(high)));
        return close > S(1e3) * touch_band(g, true) && close > S(0.5) * far;
    }

    /// Guard g along a step with the root at its start divided out. Within the sliver the quotient
    /// is rounding (for a double root, error of the interpolant): its value there is the one at the
    /// sliver's end.
    template <class Raw> auto without_root(int g, const Raw& raw) const {
        const GuardTrace& w = trace(g);
        const S sliver = w.order == 0 ? S(0) : root_sliver(g, raw);
        return [&w, &raw, sliver](const S& theta) {
            if (w.order == 0)
                return raw(theta);
            const S u = std::max(theta, sliver);
            const S v = w.divided(raw(u), u);
            return theta < sliver ? abs_(v) : v;
        };
    }

    /// The first touch of a guard that starts within its touch band, or on a root, after it has
    /// left the band and before theta.
    template <class Raw>
    bool touch_after_leaving(int g, const Raw& raw, const S& band, S& theta) const {
        if (!trace(g).own_pace && trace(g).turns(*times_) == 0)
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

    /// The minimum of a guard that still falls at the start of a step, below what is lower than
    /// there but for rounding. Steps are cut where a contact is near, so the least distance tends
    /// to lie just behind the start, too close to it for the pieces of first_contact.
    template <class Raw> static bool first_minimum(const Raw& raw, const S& below, S& theta) {
        S u(1), later = raw(u);
        for (int k = 0; k < 40; ++k) {
            const S value = raw(S(u / S(2)));
            if (value < below && value <= later) {
                theta = minimum<S>(raw, S(0), u);
                return raw(theta) < below;
            }
            u /= S(2);
            later = value;
        }
        return false;
    }

    const Place<Sys, S>& at_;
    const Watched& sections_;
    const bool declared_linear_;
    std::array<GuardTrace, n_guards> traces_;
    std::array<Surface, std::size_t(M)> surfaces_{};
    std::array<int, n_guards> active_{}; ///< those that the mode has and somebody watches
    int n_active_ = 0;
    bool slides_ = false; ///< the mode does
    const ProbeTimes<S>* times_ = &probe_times<WindowTimes<S>, S>;
    std::array<signed char, std::size_t(M)> limits_{}; ///< see `limit`
    bool any_limit_ = false;
    bool any_pace_ = false; ///< some of them may keep a pace of their own
};

} // namespace filippov
