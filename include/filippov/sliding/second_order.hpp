// SPDX-License-Identifier: BSD-3-Clause
// Whether a solution slides to second order: whether h and h' both stay zero.
#pragma once

#include <filippov/sliding/sliding.hpp>

#include <algorithm>
#include <cmath>

namespace filippov {

namespace detail {

/// What the flow beside a slide of second order leads away from h_j = 0, as a speed: by how much
/// h_j' exceeds its value on the surface where a turn about the slide is highest, above and below
/// together, where h_j' rises or where it falls, whichever is more. With V = h'^2/2 + |h''| |h|,
/// which is zero in the slide alone, it is V'/|h''|.
/// @return 0 where it leads inwards, or no more than rounding outwards
template <class Sys, std::floating_point S>
S excess_beside(const Sys& sys, int j, const S& t, const State<Sys, S>& x, const Params<Sys, S>& p,
                const Sides<Sys, S>& b, const S& tau) {
    using std::abs;
    const S sense = tau < S(0) ? S(-1) : S(1), speed = (b.l1 - b.l2) * abs(tau);
    S most(0);
    for (const bool rises : {true, false}) { // with the field below, or that above
        const S dt = sense * speed / abs(rises ? b.l1 : b.l2), later = t + dt;
        const State<Sys, S> moved = x + dt * (rises ? b.f1 : b.f2);
        const auto [on, by, off] = exact_point(sys, j, later, moved, p);
        const S rate = mean_rate(sys, j, later, on, p);
        const S slope = grad_h(sys, j, later, on, p)[by];
        S sum(0), rounding(0);
        for (const int side : {-1, 1}) {
            const S height = speed * speed / (S(2) * abs(side < 0 ? b.l1 : b.l2));
            State<Sys, S> y = on;
            y[by] += S(side) * height / slope;
            Mode<surfaces_v<Sys>> mode;
            mode.set(j, side);
            const State<Sys, S> f = side_field(sys, mode, later, y, p);
            sum += sense * S(side) * (normal_component(sys, j, later, y, p, f) - rate);
            rounding += S(8) * rate_rounding(sys, j, later, y, p, f);
        }
        if (!(sum <= rounding))
            most = sum - sum == S(0) ? std::max(most, sum) : std::numeric_limits<S>::infinity();
    }
    return most;
}

} // namespace detail

/// True if h_j'' has opposite signs on both sides, here and nearby, so that some blend holds h_j'
/// at zero, and if both sides agree on h_j' = 0 wherever that blend leads. (In a two-fold they
/// agree at one point.)
template <class Sys, std::floating_point S>
FILIPPOV_COLD bool may_slide_to_second_order(const Sys& sys, int j, const S& t,
                                             const State<Sys, S>& x, const Params<Sys, S>& p,
                                             const S& tau) {
    using std::abs;
    const Sides<Sys, S> b = second_order_sides(sys, j, t, x, p);
    const S w = b.l1 - b.l2, least = S(1e-9) * w;
    if (!(b.l1 > least && b.l2 < -least))
        return false;
    Mode<surfaces_v<Sys>> mode;
    mode.hold_rate(j);
    const Constraints<Sys> held(sys, mode);
    const State<Sys, S> f = blended(b).f;
    const auto difference = [&](const S& time, const State<Sys, S>& y) {
        const Sides<Sys, S> sides = both_sides(sys, mode, j, time, y, p);
        return S(abs(sides.l1 - sides.l2));
    };
    const auto apart = [&](const S& dt) {
        const State<Sys, S> y = project(sys, held, S(t + dt), State<Sys, S>(x + dt * f), p,
                                        State<Sys, S>(State<Sys, S>::Ones()));
        return difference(S(t + dt), detail::exact_point(sys, j, S(t + dt), y, p).x);
    };
    // What a root of |h| makes of rounding of h, where this is not zero to the last bit.
    const auto exact = detail::exact_point(sys, j, t, x, p);
    State<Sys, S> beside = exact.x;
    if (exact.off != S(0))
        beside[exact.by] +=
            S(4) * rounding_band(sys, j, t, x, p) / grad_h(sys, j, t, x, p)[exact.by];
    const S noise =
        S(16) * (difference(t, beside) + apart(S(0)) + rate_rounding(sys, j, t, x, p, b.f1));
    if (!(noise <= S(1e-3) * w * abs(tau)))
        return false;
    for (const double part : {3e-3, 1.7e-2}) {
        const S dt = S(part) * tau;
        if (!(apart(dt) <= S(1e-6) * w * abs(dt) + noise))
            return false;
    }
    // Where the gradient of h ends like a root, h'' is without bound, and this w is rounding.
    for (const State<Sys, S>& field : {b.f1, b.f2}) {
        const S dt = S(1e-2) * tau;
        const Sides<Sys, S> there =
            second_order_sides(sys, j, S(t + dt), State<Sys, S>(x + dt * field), p);
        if (!(there.l1 - there.l2 > S(0.1) * w))
            return false;
    }
    return true;
}

/// True if nothing leaves a slide of second order in finite time: beside it no side leads outwards
/// by more than a smooth field can. V = h'^2/2 + |h''| |h| then grows no faster than V, and stays
/// zero. (A root of |h| that leads outwards, as of a super-twisting law with the wrong sign, makes
/// solutions spiral away.)
/// @param tau  a time over which the solution changes, in the direction of the run
template <class Sys, std::floating_point S>
FILIPPOV_COLD bool keeps_second_order(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                                      const Params<Sys, S>& p, const S& tau) {
    const Sides<Sys, S> b = second_order_sides(sys, j, t, x, p);
    constexpr double nearer = 16;
    const S far = detail::excess_beside(sys, j, t, x, p, b, S(S(1e-2) * tau)),
            near = detail::excess_beside(sys, j, t, x, p, b, S(S(1e-2 / nearer) * tau));
    // (smooth fields differ from their mirror images by the square of this, roots in proportion)
    return far == S(0) ? near == S(0) : near <= far / S(nearer * std::sqrt(nearer));
}

/// True if a solution at a point of the surface can only slide to second order: h' is zero here,
/// but for what turns back in no time or below the rounding of h, and stays zero.
/// @param band  rounding of h_j here
template <class Sys, class S>
bool slides_to_second_order(const Sys& sys, int j, const S& t, const State<Sys, S>& x,
                            const Params<Sys, S>& p, const S& tau, const S& band) {
    using std::abs;
    if constexpr (slides_twice_v<Sys>) {
        const Sides<Sys, S> b = second_order_sides(sys, j, t, x, p);
        const S bend = std::min(b.l1, S(-b.l2)), rate = abs(rate_on_surface(sys, j, t, x, p));
        const bool at_rest = rate * rate <= S(2) * bend * band || rate <= S(1e4) * ulp(t) * bend ||
                             rate <= rate_rounding(sys, j, t, x, p, b.f1);
        return at_rest && may_slide_to_second_order(sys, j, t, x, p, tau) &&
               keeps_second_order(sys, j, t, x, p, tau);
    } else {
        return false;
    }
}

} // namespace filippov
