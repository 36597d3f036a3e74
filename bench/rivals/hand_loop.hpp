// SPDX-License-Identifier: BSD-3-Clause
//
// The rival to beat: a Dormand-Prince 5(4) loop written by hand for the dry friction oscillator
// and nothing else. Every trap of the problem is handled here by hand; what a general library
// does by itself can be measured against it.
//
// Constants, dense output and step control follow Hairer, Norsett, Wanner, Solving Ordinary
// Differential Equations I, II.4-II.6 (DOPRI5).

#pragma once

#include "oscillator.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace filippov::rivals {

/// Where the forcing takes its cosine from: the loop's own, five at a time, or the standard
/// library, as a field would that knows nothing of the steps around it.
enum class Cosine { in_lanes, standard };

namespace detail {

/// cos of five phases at once, each |phi| < 1e5, absolute error below 3e-16. Branch-free, so
/// that the compiler takes the five together: an eighth faster a step than five calls of std::cos.
inline std::array<double, 5> cosines(const std::array<double, 5>& phi) {
    constexpr double to_integer = 6755399441055744.0; // 1.5 * 2^52: adding it rounds
    constexpr double pi_hi = 3.14159265358979312, pi_lo = 1.2246467991473532e-16;
    std::array<double, 5> result{};
    for (std::size_t i = 0; i < 5; ++i) {
        const double n = (phi[i] * (1.0 / pi_hi) + to_integer) - to_integer;
        const double half_n = (0.5 * n + to_integer) - to_integer;
        const double sign = 1.0 - 2.0 * std::abs(n - 2.0 * half_n); // (-1)^n
        const double z = (phi[i] - n * pi_hi) - n * pi_lo;
        const double u = z * z, u2 = u * u, u4 = u2 * u2;
        const double p01 = 1.0 - u * (1.0 / 2), p23 = 1.0 / 24 - u * (1.0 / 720);
        const double p45 = 1.0 / 40320 - u * (1.0 / 3628800);
        const double p67 = 1.0 / 479001600 - u * (1.0 / 87178291200);
        const double p89 = 1.0 / 20922789888000 - u * (1.0 / 6402373705728000);
        const double low = p01 + u2 * p23, high = p45 + u2 * p67;
        result[i] = sign * (low + u4 * (high + u4 * (p89 + u2 * (1.0 / 2432902008176640000))));
    }
    return result;
}

template <Cosine cosine> std::array<double, 5> stage_cosines(const std::array<double, 5>& phi) {
    if constexpr (cosine == Cosine::in_lanes)
        return cosines(phi);
    std::array<double, 5> result{};
    for (std::size_t i = 0; i < 5; ++i)
        result[i] = std::cos(phi[i]);
    return result;
}

/// Step size control of DOPRI5, fac = 0.9 err^-(0.2 - 0.75 beta) err_old^beta with beta = 2/45,
/// from the squares of the scaled errors. A step size needs no exact power: the bits of a double
/// are its logarithm, piecewise linearly, which gives the factor 0 to 6% too large; hence 0.87.
inline double step_factor(double error2, double old_error2) {
    constexpr std::uint64_t one = std::bit_cast<std::uint64_t>(1.0);
    constexpr std::uint64_t offset = one + one / 12 - one / 45;
    const auto now = std::bit_cast<std::uint64_t>(error2);
    const auto old = std::bit_cast<std::uint64_t>(old_error2);
    return std::clamp(0.87 * std::bit_cast<double>(offset - now / 12 + old / 45), 0.2, 5.0);
}

/// Slip in mirrored coordinates: Y = side * y and r = side * (V - v) > 0, side = +1 in S1 and -1
/// in S2. One field, without |v| and without a branch, serves both regions; the surface is r = 0.
///
///   Y' = side V - r,   r' = Y - side A cos(omega t) - g mu(r)
struct Slip {
    double Y, r;
};

struct Attempt {
    Slip end;
    Slip k1, k3, k4, k5, k6, k7;
    double error2; // square of the scaled error norm
};

/// Is told nothing.
struct NoListener {
    void operator()(const Clock&, double, double) const {}
};

template <Cosine cosine, class OnExit> class HandLoop {
public:
    HandLoop(double A, double omega, double y0, double v0, int n_periods, double tol,
             const OnExit& on_exit)
        : A_(A), omega_(omega), tol_(tol), h_(0.3 * std::pow(tol, 0.2)), clock_{0.0, n_periods},
          on_exit_(on_exit) {
        const double q = A * std::cos(0.0) - y0;
        stuck_ = v0 == belt && std::abs(q) < edge;
        // On the surface without stick the flow goes where both normal components point.
        const bool in_s1 = v0 < belt || (v0 == belt && q < 0.0);
        enter(in_s1 ? 1.0 : -1.0, y0, v0);
    }

    RivalResult run() {
        while (clock_.periods_left > 0) {
            if (stuck_)
                stick();
            else
                slip();
        }
        count_.n_field += 6 * (count_.n_steps + count_.n_rejected);
        count_.y = side_ * x_.Y;
        count_.v = belt - side_ * x_.r;
        return count_;
    }

private:
    static double friction(double r) { return 3.0 / (1.0 + gamma * r) + (1.0 + 0.1 * r * r); }

    Slip field(const Slip& x, double force) const {
        return {drift_ - x.r, (x.Y - force) - friction(x.r)};
    }

    void enter(double side, double y, double v) {
        side_ = side;
        drift_ = side * belt;
        forcing_ = side * A_;
        x_ = {side * y, side * (belt - v)};
        k1_ = field(x_, forcing_ * std::cos(clock_.phi));
        ++count_.n_field;
    }

    /// One step of size h. Products h a_ij come first and the newest stage last in every sum:
    /// then one multiplication-addition lies between a stage and the next.
    Attempt attempt(double h) const {
        const double dphi = omega_ * h, phi = clock_.phi;
        const auto c = stage_cosines<cosine>({phi + dphi * 0.2, phi + dphi * 0.3, phi + dphi * 0.8,
                                              phi + dphi * (8.0 / 9), phi + dphi});
        Attempt a;
        const Slip k1 = k1_;
        const auto stage = [&](std::size_t i, double Y, double r) {
            return field({Y, r}, forcing_ * c[i]);
        };
        const double a21 = h * 0.2;
        const Slip k2 = stage(0, x_.Y + a21 * k1.Y, x_.r + a21 * k1.r);
        const double a31 = h * (3.0 / 40), a32 = h * (9.0 / 40);
        const Slip k3 = stage(1, x_.Y + a31 * k1.Y + a32 * k2.Y, x_.r + a31 * k1.r + a32 * k2.r);
        const double a41 = h * (44.0 / 45), a42 = h * (-56.0 / 15), a43 = h * (32.0 / 9);
        const Slip k4 = stage(2, x_.Y + a41 * k1.Y + a42 * k2.Y + a43 * k3.Y,
                              x_.r + a41 * k1.r + a42 * k2.r + a43 * k3.r);
        const double a51 = h * (19372.0 / 6561), a52 = h * (-25360.0 / 2187),
                     a53 = h * (64448.0 / 6561), a54 = h * (-212.0 / 729);
        const Slip k5 = stage(3, x_.Y + a51 * k1.Y + a52 * k2.Y + a53 * k3.Y + a54 * k4.Y,
                              x_.r + a51 * k1.r + a52 * k2.r + a53 * k3.r + a54 * k4.r);
        const double a61 = h * (9017.0 / 3168), a62 = h * (-355.0 / 33), a63 = h * (46732.0 / 5247),
                     a64 = h * (49.0 / 176), a65 = h * (-5103.0 / 18656);
        const Slip k6 =
            stage(4, x_.Y + a61 * k1.Y + a62 * k2.Y + a63 * k3.Y + a64 * k4.Y + a65 * k5.Y,
                  x_.r + a61 * k1.r + a62 * k2.r + a63 * k3.r + a64 * k4.r + a65 * k5.r);
        const double b1 = h * (35.0 / 384), b3 = h * (500.0 / 1113), b4 = h * (125.0 / 192),
                     b5 = h * (-2187.0 / 6784), b6 = h * (11.0 / 84);
        a.end = {x_.Y + b1 * k1.Y + b3 * k3.Y + b4 * k4.Y + b5 * k5.Y + b6 * k6.Y,
                 x_.r + b1 * k1.r + b3 * k3.r + b4 * k4.r + b5 * k5.r + b6 * k6.r};
        a.k1 = k1;
        a.k3 = k3;
        a.k4 = k4;
        a.k5 = k5;
        a.k6 = k6;
        a.k7 = stage(4, a.end.Y, a.end.r);
        a.error2 = error2(a, h);
        return a;
    }

    /// The scales need no stage 7, so their divisions run beside it. |v| = |Y'| in either region.
    double error2(const Attempt& a, double h) const {
        const double e1 = h * (71.0 / 57600), e3 = h * (-71.0 / 16695), e4 = h * (71.0 / 1920),
                     e5 = h * (-17253.0 / 339200), e6 = h * (22.0 / 525), e7 = h * (-1.0 / 40);
        const double max_y = std::max(std::abs(x_.Y), std::abs(a.end.Y));
        const double max_v = std::max(std::abs(a.k1.Y), std::abs(a.k7.Y));
        const double weight_y = 1.0 / (tol_ + tol_ * max_y), weight_v = 1.0 / (tol_ + tol_ * max_v);
        const double y =
            e1 * a.k1.Y + e3 * a.k3.Y + e4 * a.k4.Y + e5 * a.k5.Y + e6 * a.k6.Y + e7 * a.k7.Y;
        const double r =
            e1 * a.k1.r + e3 * a.k3.r + e4 * a.k4.r + e5 * a.k5.r + e6 * a.k6.r + e7 * a.k7.r;
        const double ey = y * weight_y, er = r * weight_v;
        return 0.5 * (ey * ey + er * er);
    }

    /// Steps until a transition or the end.
    void slip() {
        bool rejected = false;
        for (;;) {
            const double h_left = clock_.phase_left() / omega_;
            const bool last = !(h_ < h_left);
            const double h = last ? h_left : h_;
            const Attempt a = attempt(h);
            const double factor = step_factor(a.error2, old_error2_);
            if (!(a.error2 <= 1.0)) { // NaN too: a stage ran into the pole beyond the surface
                h_ = h * (a.error2 > 1.0 ? factor : 0.2);
                ++count_.n_rejected;
                rejected = true;
                continue;
            }
            const Gap gap{x_.r, h * k1_.r, a.end.r, h * a.k7.r};
            double theta = 2.0;
            if (!gap.stays_open()) {
                theta = crossing(a, gap, h);
                if (judge(gap, theta, h) == Search::retake) {
                    h_ = 0.1 * h;
                    ++count_.n_rejected;
                    continue;
                }
            }
            ++count_.n_steps;
            old_error2_ = std::max(a.error2, 1e-8);
            // A step cut at the end says nothing about the next; after a rejection none grows.
            if (!last)
                h_ = h * (rejected ? std::min(1.0, factor) : factor);
            rejected = false;
            if (judge(gap, theta, h) == Search::found) {
                const double Y = interpolate_Y(a, h, theta);
                clock_.advance(omega_ * h * theta);
                arrive(side_ * Y);
                return;
            }
            x_ = a.end;
            k1_ = a.k7;
            if (last) {
                clock_ = {0.0, 0};
                return;
            }
            clock_.advance(omega_ * h);
        }
    }

    static double bulge(double k1, double k3, double k4, double k5, double k6, double k7) {
        return -12715105075.0 / 11282082432.0 * k1 + 87487479700.0 / 32700410799.0 * k3 -
               10690763975.0 / 1880347072.0 * k4 + 701980252875.0 / 199316789632.0 * k5 -
               1453857185.0 / 822651844.0 * k6 + 69997945.0 / 29380423.0 * k7;
    }

    double interpolate_Y(const Attempt& a, double h, double theta) const {
        const double rest = 1.0 - theta, rise = a.end.Y - x_.Y, bend = h * a.k1.Y - rise;
        const double b = h * bulge(a.k1.Y, a.k3.Y, a.k4.Y, a.k5.Y, a.k6.Y, a.k7.Y);
        return x_.Y +
               theta * (rise + rest * (bend + theta * (rise - h * a.k7.Y - bend + rest * b)));
    }

    static double crossing(const Attempt& a, const Gap& gap, double h) {
        const double b = h * bulge(a.k1.r, a.k3.r, a.k4.r, a.k5.r, a.k6.r, a.k7.r);
        return first_crossing(gap.with_bulge(b));
    }

    void arrive(double y) {
        const double force = A_ * std::cos(clock_.phi);
        const Verdict verdict = arrival(side_, force - y);
        if (verdict == Verdict::touches) {
            start_on_surface(side_, y, -side_ * (force - y) - edge);
            return;
        }
        ++count_.n_events;
        stuck_ = verdict == Verdict::sticks;
        if (stuck_)
            x_ = {side_ * y, 0.0};
        else
            start_on_surface(-side_, y, -side_ * (y - force) - edge);
    }

    /// Speed away from the surface as the event fixes it, not as rounding leaves it: the start
    /// is then a root of known order, which the search in the first step leaves out.
    void start_on_surface(double side, double y, double speed) {
        enter(side, y, belt);
        k1_.r = std::max(speed, 0.0);
    }

    void stick() {
        const double y = side_ * x_.Y, left = clock_.phase_left() / omega_;
        const StickEnd end = stick_end(A_, omega_, clock_.phi, y);
        if (end.duration >= left) {
            x_.Y = side_ * (y + belt * left);
            clock_ = {0.0, 0};
            return;
        }
        clock_.advance(omega_ * end.duration);
        stuck_ = false;
        ++count_.n_events;
        on_exit_(clock_, y + belt * end.duration, end.side);
        start_on_surface(end.side, y + belt * end.duration, 0.0);
    }

    double A_, omega_, tol_, h_;
    double old_error2_ = 1e-8;
    double side_ = 1.0, drift_ = 1.0, forcing_ = 0.0;
    Clock clock_;
    const OnExit& on_exit_;
    Slip x_{}, k1_{};
    bool stuck_ = false;
    RivalResult count_{};
};

} // namespace detail

/// Orbit of the oscillator from (y0, v0) at t = 0 over n_periods of the forcing.
///
/// @param tol      absolute and relative tolerance of either component, in [1e-14, 1e-2]
/// @param on_exit  on_exit(clock, y, side) at every end of a stick; side +1: into S1, -1: into S2
/// @pre            all arguments finite, omega > 0
/// @source         model: Sliding bifurcations in a dry friction oscillator, (4.5), (4.11), (4.18)
template <Cosine cosine = Cosine::in_lanes, class OnExit>
RivalResult hand_loop(double A, double omega, double y0, double v0, int n_periods, double tol,
                      const OnExit& on_exit) {
    return detail::HandLoop<cosine, OnExit>(A, omega, y0, v0, n_periods, tol, on_exit).run();
}
template <Cosine cosine = Cosine::in_lanes>
RivalResult hand_loop(double A, double omega, double y0, double v0, int n_periods, double tol) {
    return hand_loop<cosine>(A, omega, y0, v0, n_periods, tol, detail::NoListener{});
}

} // namespace filippov::rivals
