// SPDX-License-Identifier: BSD-3-Clause
// The only decision the engine makes: which mode goes on from a point of a surface.
#pragma once

#include <filippov/sliding/second_order.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace filippov {

/// What to do where the solution is not unique.
enum class NonUnique : std::uint8_t {
    stop,  ///< end the run with status `ambiguous`
    below, ///< go on in h < 0
    above, ///< go on in h > 0
    stay,  ///< slide
};

constexpr std::string_view name(NonUnique policy) {
    constexpr std::array<std::string_view, 4> names{"stop", "below", "above", "stay"};
    return names[static_cast<std::size_t>(policy)];
}

/// How a solution came to a point of a surface.
template <class S> struct Arrival {
    int direction = 1;          ///< of time
    S tau = S(0);               ///< a time over which it changes: the step size
    int from = 0;               ///< the side that it came from; 0 if it starts or slid here
    bool below_tangent = false; ///< L1 = 0, because the end of a slide was located by it
    bool above_tangent = false; ///< the same of L2
    bool looks_ahead = false;   ///< where no derivative shows where h goes, the field a while later
};

/// Where one side's field takes a point of h_j = 0: the first non-zero derivative of h_j along it.
struct Departure {
    int sign = 0;  ///< -1 into h < 0, +1 into h > 0, 0 if four derivatives vanish
    int order = 0; ///< which derivative decided, 1 to 4; 0 if none
    bool finite = true;
};

namespace detail {

template <class S> int sign(const S& v) { return v > S(0) ? 1 : v < S(0) ? -1 : 0; }

/// How small a visit must be to count as none.
template <class S> struct Smallness {
    S height; ///< of |h|: its rounding
    S time;   ///< 0: the height decides
};

/// One derivative of h along a field.
template <class S> struct Derivative {
    int order;
    S value;
};

/// True if the first derivative of h that is not zero is no more than rounding: what it starts,
/// before the `next` one turns it back, is too low or too brief to be told from nothing.
template <class S>
bool negligible(const Derivative<S>& first, const Derivative<S>& next, const Smallness<S>& small) {
    using std::abs;
    using std::pow;
    if (first.value == S(0))
        return true;
    if (next.value == S(0) || sign(first.value) == sign(next.value))
        return false;
    // their Taylor terms balance after tau; the height between is about half of one
    constexpr std::array<int, 5> factorial{1, 1, 2, 6, 24};
    const auto coefficient = [&](const Derivative<S>& d) {
        return abs(d.value / S(factorial[std::size_t(d.order)]));
    };
    const S tau = pow(coefficient(first) / coefficient(next), S(1) / S(next.order - first.order));
    if (small.time > S(0))
        return tau <= small.time;
    return coefficient(first) * pow(tau, S(first.order)) / S(2) <= small.height;
}

} // namespace detail

/// The mode of a point beside one in `mode`: surfaces in contact and those slid on as there, the
/// others by the sign of their h, but for directions, which move. (An inflow that opens as the
/// level falls to the floor is met a hair later.)
template <class Sys, class S>
Mode<surfaces_v<Sys>> mode_beside(const Sys& sys, Mode<surfaces_v<Sys>> mode,
                                  const SurfaceSet<surfaces_v<Sys>>& on, const S& t,
                                  const State<Sys, S>& x, const Params<Sys, S>& p) {
    if constexpr (!single_v<Sys>) {
        const auto h = switching(sys, t, x, p);
        for (int k = 0; k < surfaces_v<Sys>; ++k)
            if (!on.contains(k) && mode[k] != 0 && !is_kind(sys, k, SurfaceKind::jump) &&
                !is_directed(sys, k) && h[k] != S(0))
                mode.set(k, h[k] < S(0) ? -1 : 1);
    }
    return mode;
}

/// How h_j' changes with time along the surface, where derivatives of the field of `mode` do not
/// tell where it leads: it bends infinitely (a law of friction like a root of the speed), it is not
/// smooth (an inflow that opens), or all of them vanish. Told by a while short enough; 0 where none
/// up to a hundredth of tau shows more than rounding.
template <class Sys, class S>
FILIPPOV_COLD S change_along_surface(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j,
                                     const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
                                     const S& slope, const S& tau) {
    using std::abs;
    const State<Sys, S> gradient = grad_h(sys, j, t, x, p), f = side_field(sys, mode, t, x, p);
    const S size = gradient.squaredNorm();
    S dt = S(1e-6) * tau;
    for (int k = 0; k < 5 && size > S(0); ++k, dt *= S(10)) { // up to 1e-2 tau
        const S later = t + dt;
        State<Sys, S> y = x + dt * f;
        y -= (switching(sys, later, y, p)[j] / size) * gradient;
        const auto mode_there = mode_beside(sys, mode, {{j}, 1}, later, y, p);
        const State<Sys, S> there = side_field(sys, mode_there, later, y, p);
        const S change = normal_component(sys, j, later, y, p, there) - slope;
        if (abs(change) > S(100) * (abs(slope) + rate_rounding(sys, j, later, y, p, there)))
            return change / dt;
    }
    return S(0);
}

/// What rounding leaves of h at a point of its surface: of its terms, and of the step that led
/// there, of the length tau.
/// @param rounding  see `rounding_band`
/// @param b         the two sides
/// @tparam S        a number, or lanes of them
template <class S, class Both>
FILIPPOV_INLINE S contact_band(const S& rounding, const Both& b, const S& tau) {
    using std::abs;
    const S both = abs(b.l1) + abs(b.l2);
    return fused(S(16 * epsilon<Real<S>>), S(both * abs(tau)), rounding);
}
/// What tau h' is beyond, in size, if its sign is that of the departure, whatever follows,
template <class S> FILIPPOV_INLINE S plain_slope(const S& band) {
    using R = Real<S>;
    return S(R(100) / std::sqrt(epsilon<R>)) * band;
}
/// and what tau^2 h'' is beyond, where h' is zero.
template <class S> FILIPPOV_INLINE S plain_bend(const S& band) {
    using R = Real<S>;
    return ratio(band, R(std::cbrt(epsilon<R> * epsilon<R>)));
}

/// The departure of the field of `mode` (surface j at -1 or +1) from a point of h_j = 0.
///
/// Lie derivatives of h_j up to order four, time included. h' counts as zero where what it starts
/// is too small, a test without units. A visit to this side is too small if it stays below the
/// rounding of h. Flow towards the surface, the part of this side in a slide, is too small if the
/// slide would end within some units of the last place of t; but where the solution came from this
/// side, h' at contact is no better than h, and the height decides; and of no more than the
/// rounding of its own terms.
/// @param slope_found  h_j' along the field, in the direction of time
/// @param band   rounding of h_j here
/// @cost nothing, nearly always; else two or four fields in Taylor arithmetic
template <class Sys, class S>
Departure departure(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j, const S& t,
                    const State<Sys, S>& x, const Params<Sys, S>& p, const Arrival<S>& arrival,
                    const S& slope_found, const S& band) {
    using std::abs;
    using std::cbrt;
    using std::pow;
    using std::sqrt;
    const S tau = arrival.tau;
    if (!(abs(slope_found) <= std::numeric_limits<S>::max()))
        return {0, 0, false};
    if (abs(slope_found * tau) > plain_slope(band) && slope_found != S(0))
        return {detail::sign(slope_found), 1, true};

    const auto field = [&](const auto& time, const auto& y, const auto& q) {
        return side_field(sys, mode, time, y, q);
    };
    const auto h = [&](const auto& time, const auto& y, const auto& q) {
        return switching(sys, time, y, q)[j];
    };
    const bool slide = detail::sign(slope_found) == -mode[j] && arrival.from != mode[j];
    const bool none =
        slide && abs(slope_found) <= rate_rounding(sys, j, t, x, p, side_field(sys, mode, t, x, p));
    const S slope = none ? S(0) : slope_found;
    const detail::Smallness<S> first{band, slide ? S(16) * ulp(t) : S(0)};
    const detail::Smallness<S> higher{band, S(0)};
    // Below this a derivative is rounding of something that is zero for all time.
    const S noise = S(1e-3) * band;
    S second = lie_derivatives<2>(field, h, t, x, p)[1];
    if (!(abs(second) <= std::numeric_limits<S>::max()))
        second = change_along_surface(sys, mode, j, t, x, p, S(S(arrival.direction) * slope_found),
                                      S(S(arrival.direction) * tau));
    // Plainly not zero: whatever the next derivatives, what h'' starts is above rounding.
    if (abs(second * tau * tau) > plain_bend(band))
        return detail::negligible<S>({1, slope}, {2, second}, first)
                   ? Departure{detail::sign(second), 2, true}
                   : Departure{detail::sign(slope), 1, true};

    // From the highest down: each counts unless it is rounding, or not finite (the field need not
    // be that smooth), or the next that counts undoes what it starts.
    const auto rates = lie_derivatives<4>(field, h, t, x, p);
    const std::array<S, 5> derivative{S(0), slope, second, S(arrival.direction) * rates[2],
                                      rates[3]};
    detail::Derivative<S> next{0, S(0)};
    for (int k = 4; k >= 1; --k) {
        const detail::Derivative<S> d{k, derivative[std::size_t(k)]};
        const S height = abs(d.value) * pow(tau, S(k));
        const bool rounding = !(height > noise && height <= std::numeric_limits<S>::max());
        const bool nothing =
            next.order == 0
                ? rounding
                : (k > 1 && rounding) || detail::negligible<S>(d, next, k > 1 ? higher : first);
        if (!nothing)
            next = d;
    }
    if (next.order == 0 && arrival.looks_ahead)
        if (const S change =
                change_along_surface(sys, mode, j, t, x, p, S(0), S(S(arrival.direction) * tau));
            change != S(0))
            return {detail::sign(change), 2, true};
    return {detail::sign(next.value), next.order, true};
}

/// True if both sides' fields bend h_j alike.
template <class Sys, class S>
bool same_curvature(const Sys& sys, Mode<surfaces_v<Sys>> mode, int j, const S& t,
                    const State<Sys, S>& x, const Params<Sys, S>& p) {
    const auto field = [&](const auto& time, const auto& y, const auto& q) {
        return side_field(sys, mode, time, y, q);
    };
    const auto h = [&](const auto& time, const auto& y, const auto& q) {
        return switching(sys, time, y, q)[j];
    };
    // (of order four, since series of that length are compiled anyway)
    mode.set(j, -1);
    const auto below = lie_derivatives<4>(field, h, t, x, p);
    mode.set(j, +1);
    const auto above = lie_derivatives<4>(field, h, t, x, p);
    return std::equal(below.begin(), below.begin() + 3, above.begin());
}

/// True if h_j' is the same on both sides around a point, as where a force depends on the side of a
/// position: then what both sides bend alike leaves to where they bend it, and does not slide.
template <class Sys, class S>
bool same_rate(const Sys& sys, const Mode<surfaces_v<Sys>>& mode, int j, const S& t, const S& tau,
               const State<Sys, S>& x, const Params<Sys, S>& p, const Sides<Sys, S>& here) {
    for (const double later : {0.3, 1.7})
        for (const State<Sys, S>& f : {here.f1, here.f2}) {
            const S dt = S(later) * tau, time = t + dt;
            const State<Sys, S> y = x + dt * f;
            const auto there =
                both_sides(sys, mode_beside(sys, mode, {{j}, 1}, time, y, p), j, time, y, p);
            if (!(there.l1 == there.l2))
                return false;
        }
    return true;
}

/// True if a field is nil at x, now and later: no component is more than the rounding of `other`,
/// the field with which it is compared.
template <class F, class S, int N>
bool rests(const F& field, const S& t, const S& tau, const Vec<S, N>& x, const Vec<S, N>& other) {
    using std::abs;
    for (const double later : {0.0, 0.3, 1.7, 9.1}) { // what turns round in time does not rest
        const Vec<S, N> f = field(S(t + S(later) * tau), x);
        for (int i = 0; i < N; ++i)
            if (!(abs(f[i]) <= S(2) * epsilon<S> * abs(other[i])))
                return false;
    }
    return true;
}

/// The roots on which guards start in a mode, by their orders (0: none): of h_j, and in a slide of
/// 1 + s_j and 1 - s_j.
template <int M> struct Starts {
    std::array<int, std::size_t(M)> side{}, below{}, above{};
};

/// A slide that ended by s_j = side[j] on some surfaces j; 0: not on this one.
template <int M> struct SlideEnd {
    Mode<M> mode{};
    Mode<M> side{};
    unsigned parted = 0; ///< bit j: s_j stayed at an end, and now both sides are tangent

    bool any() const { return !(side == Mode<M>{}) || parted != 0; }
    bool ends_on(int j) const { return side[j] != 0 || (parted >> j & 1u) != 0; }
    /// True of a mode that goes on with the sides of some of these surfaces, and else as the slide:
    /// it starts along all of them.
    bool leads_to(const Mode<M>& after) const {
        for (int j = 0; j < M; ++j)
            if (after[j] != mode[j] && (parted >> j & 1u) == 0 &&
                (side[j] == 0 || after[j] != side[j]))
                return false;
        return !(after == mode);
    }
};

/// The mode in which a solution leaves a point of one surface or several, and how sure that is.
template <int M> struct Verdict {
    Mode<M> mode{};
    Starts<M> starts{};
    bool unique = false;
    bool finite = true;
    Departure below, above;  ///< of the two sides, at one surface
    std::string_view reason; ///< why not unique

    /// The modes that could go on from here, if that is not unique; `n_options` may be more than
    /// are kept.
    static constexpr int most_options = M == 1 ? 3 : 27;
    std::array<Mode<M>, most_options> option{};
    std::array<Starts<M>, most_options> option_starts{};
    int n_options = 0;

    /// Adds a mode. The one to go on with is the first, or the one that the policy names: the
    /// lowest sides, the highest, or the most slides, of all and not only of those that are kept.
    void add(const Mode<M>& admissible, const Starts<M>& roots, NonUnique policy) {
        if (n_options < most_options) {
            option[std::size_t(n_options)] = admissible;
            option_starts[std::size_t(n_options)] = roots;
        }
        if (n_options == 0 || rank(admissible, policy) > rank(mode, policy)) {
            mode = admissible;
            starts = roots;
        }
        ++n_options;
    }
    int kept() const { return std::min(n_options, most_options); }
    void take(int k) {
        mode = option[std::size_t(k)];
        starts = option_starts[std::size_t(k)];
    }

private:
    static int rank(const Mode<M>& m, NonUnique policy) {
        int sum = 0;
        for (int j = 0; j < M; ++j)
            sum += m[j];
        return policy == NonUnique::below ? -sum : policy == NonUnique::above ? sum : m.sliding();
    }
};

namespace detail {

/// The roots on which guards start in `mode` after this verdict on surface j.
template <int M> Starts<M> starts_at(const Verdict<M>& v, const Mode<M>& mode, int j) {
    Starts<M> starts;
    const auto i = std::size_t(j);
    if (mode[j] != 0)
        starts.side[i] = std::max(1, mode[j] < 0 ? v.below.order : v.above.order);
    else {
        // (a side whose field stays tangent holds s at its end for as long as it does)
        const auto order = [](const Departure& d) { return d.sign == 0 ? 2 : d.order - 1; };
        starts.below[i] = order(v.below);
        starts.above[i] = order(v.above);
    }
    return starts;
}

} // namespace detail

/// Admissible modes at a point of h_j = 0 (the other surfaces as in `mode`).
///
/// A mode is admissible if its own field keeps it. With the departures (below, above) of the two
/// sides, as signs:
///
///   (-, -)  leaves into h < 0          (+, +)  leaves into h > 0
///   (+, -)  slides (attracting)        (-, +)  all three: repulsive, not unique
///
/// and at a point where both sides agree on h' = 0, and h'' has opposite signs, it slides to second
/// order if nothing leads away from there.
///
/// At the boundary of the sliding region one first derivative vanishes and the next one decides; it
/// is then also the derivative of s along the sliding field, so that exactly one of "slide" and
/// "leave" is admissible. Two vanishing at once is a two-fold: not unique.
///
/// **Staying at a limit.** Where one side's field stays tangent to the surface (all its derivatives
/// vanish, and a while later so do they), and the other leads to the surface, the solution stays: a
/// slide with s at the end of the first, whose field is then the sliding field. So does what is
/// empty, blocked or clamped, and what rests at the limit of friction.
///
/// @source design of (4.9), (4.10) with both signs required; Filippov (1988), section 10
template <class Sys, class S>
Verdict<surfaces_v<Sys>> admissible(const Sys& sys, Mode<surfaces_v<Sys>> mode, int j, const S& t,
                                    const State<Sys, S>& x, const Params<Sys, S>& p,
                                    const Arrival<S>& arrival, NonUnique policy) {
    using std::abs;
    const Sides<Sys, S> b = both_sides(sys, mode, j, t, x, p);
    const S band = contact_band(rounding_band(sys, j, t, x, p), b, arrival.tau);
    Verdict<surfaces_v<Sys>> v;
    const S forward = S(arrival.direction);
    const int side_before = mode[j];
    mode.set(j, -1);
    v.below = departure(sys, mode, j, t, x, p, arrival,
                        arrival.below_tangent ? S(0) : S(forward * b.l1), band);
    mode.set(j, +1);
    v.above = departure(sys, mode, j, t, x, p, arrival,
                        arrival.above_tangent ? S(0) : S(forward * b.l2), band);
    v.mode = mode;
    v.finite = v.below.finite && v.above.finite;
    if (!v.finite)
        return v;

    // Static friction above kinetic: sliding is kept up to |s| = s_max, whatever the sides would
    // do.
    const S limit = s_max(sys, p);
    const S w = forward * (b.l1 - b.l2), s = (b.l1 + b.l2) / (b.l1 - b.l2);
    const bool held = limit > S(1) && w > S(0) && abs(s) < limit * (S(1) - S(16) * epsilon<S>);

    const bool two_fold = v.below.order != 1 && v.above.order != 1;
    // Where the field does not jump at all (to second order) a double tangency is an ordinary one.
    const bool same_field = two_fold && b.f1 == b.f2 && same_curvature(sys, mode, j, t, x, p);
    const bool bent_alike = two_fold && v.below.sign == v.above.sign &&
                            same_rate(sys, mode, j, t, S(forward * arrival.tau), x, p, b);
    const bool vanish = v.below.sign == 0 || v.above.sign == 0;
    const auto at_rest = [&](int side, const Departure& departure) {
        if (departure.sign != 0)
            return false;
        mode.set(j, side);
        const auto field = [&](const S& time, const State<Sys, S>& y) {
            return side_field(sys, mode, time, y, p);
        };
        return rests(field, t, S(forward * arrival.tau), x, side < 0 ? b.f2 : b.f1);
    };
    // To second order it can slide only where both sides agree on h': that shows, or derivatives do
    // not decide, or h is not zero to the last bit, and a root of it hides the rest.
    const auto holds_rate = [&] {
        if constexpr (slides_twice_v<Sys>) {
            const bool agree = abs(b.l1 - b.l2) <= S(1e-6) * abs(b.l1 + b.l2);
            return (agree || v.below.order != 1 || v.above.order != 1 ||
                    switching(sys, t, x, p)[j] != S(0)) &&
                   slides_to_second_order(sys, j, t, x, p, S(forward * arrival.tau), band);
        }
        return false;
    };
    const auto option = [&](int side) {
        mode.set(j, side);
        v.add(mode, detail::starts_at(v, mode, j), policy);
    };
    if (held) {
        v.unique = true;
        option(0);
    } else if (at_rest(-1, v.below) && at_rest(+1, v.above)) {
        v.unique = true;
        option(side_before < 0 ? -1 : +1);
    } else if (holds_rate()) {
        v.unique = true;
        mode.hold_rate(j);
        v.add(mode, {}, policy);
    } else if ((v.below.sign == 0 && v.above.sign < 0) ||
               (v.above.sign == 0 && v.below.sign > 0)) { // stays at a limit
        v.unique = true;
        option(0);
    } else if (vanish) {
        v.reason = v.below.sign == v.above.sign
                       ? "both sides' fields are tangent to the surface"
                       : "one side's field is tangent to the surface, the other leads away from it";
        for (const int side : {-1, 0, 1})
            option(side);
    } else if (two_fold && !same_field && !bent_alike) {
        const bool visible_below = v.below.sign < 0, visible_above = v.above.sign > 0;
        v.reason = visible_below && visible_above     ? "two-fold, visible-visible"
                   : !visible_below && !visible_above ? "two-fold, invisible-invisible"
                                                      : "two-fold, visible-invisible";
        if (visible_below)
            option(-1);
        option(0);
        if (visible_above)
            option(+1);
    } else if (v.below.sign == v.above.sign) {
        v.unique = true;
        option(v.below.sign);
    } else if (v.below.sign > 0) {
        v.unique = true;
        option(0);
    } else {
        v.reason = "both sides lead away from the surface (repulsive sliding)";
        for (const int side : {-1, 0, 1})
            option(side);
    }
    // At one surface a policy names the branch, whatever its side would do.
    const int named = policy == NonUnique::below ? -1 : policy == NonUnique::above ? 1 : 0;
    if (!v.unique && policy != NonUnique::stop && v.mode[j] != named) {
        v.mode.set(j, named);
        v.starts = detail::starts_at(v, v.mode, j);
    }
    return v;
}

} // namespace filippov
