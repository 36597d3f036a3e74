# SPDX-License-Identifier: BSD-3-Clause
#
# pip install numba numpy
"""The loop of hand_loop.hpp in Python, compiled by numba: Dormand-Prince 5(4), events by hand.

Slip in mirrored coordinates, Y = side y and r = side (V - v) > 0, side = +1 in S1 and -1 in S2:
Y' = side V - r, r' = Y - side A cos(omega t) - 10 mu(r). The surface is r = 0.
"""

import math
from functools import partial

import numba
import numpy as np
from numba import njit
from py_oscillator import (
    BELT,
    EDGE,
    PERIODS,
    STICKS,
    TOUCHES,
    TWO_PI,
    Rival,
    advance,
    arrival,
    powers_of_ten,
    stick_end,
)

VERSION = numba.__version__


@njit
def slope(drift, force, Y, r):
    return drift - r, Y - force - (3 / (1 + 1.42 * r) + (1 + 0.1 * r * r))


@njit
def attempt(drift, A, omega, phi, h, Y, r, k1, tol):
    """One step: its end, the slopes k3, ..., k7 and the square of its scaled error."""
    dphi = omega * h
    Y1, r1 = k1
    Y2, r2 = slope(drift, A * math.cos(phi + 0.2 * dphi), Y + h * 0.2 * Y1, r + h * 0.2 * r1)
    Y3, r3 = slope(
        drift,
        A * math.cos(phi + 0.3 * dphi),
        Y + h * (3 / 40 * Y1 + 9 / 40 * Y2),
        r + h * (3 / 40 * r1 + 9 / 40 * r2),
    )
    Y4, r4 = slope(
        drift,
        A * math.cos(phi + 0.8 * dphi),
        Y + h * (44 / 45 * Y1 - 56 / 15 * Y2 + 32 / 9 * Y3),
        r + h * (44 / 45 * r1 - 56 / 15 * r2 + 32 / 9 * r3),
    )
    a1, a2, a3, a4 = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
    Y5, r5 = slope(
        drift,
        A * math.cos(phi + 8 / 9 * dphi),
        Y + h * (a1 * Y1 + a2 * Y2 + a3 * Y3 + a4 * Y4),
        r + h * (a1 * r1 + a2 * r2 + a3 * r3 + a4 * r4),
    )
    b1, b2, b3, b4, b5 = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
    last_force = A * math.cos(phi + dphi)
    Y6, r6 = slope(
        drift,
        last_force,
        Y + h * (b1 * Y1 + b2 * Y2 + b3 * Y3 + b4 * Y4 + b5 * Y5),
        r + h * (b1 * r1 + b2 * r2 + b3 * r3 + b4 * r4 + b5 * r5),
    )
    c1, c3, c4, c5, c6 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
    Y_end = Y + h * (c1 * Y1 + c3 * Y3 + c4 * Y4 + c5 * Y5 + c6 * Y6)
    r_end = r + h * (c1 * r1 + c3 * r3 + c4 * r4 + c5 * r5 + c6 * r6)
    Y7, r7 = slope(drift, last_force, Y_end, r_end)
    e1, e3, e4, e5 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200
    e6, e7 = 22 / 525, -1 / 40
    e_Y = h * (e1 * Y1 + e3 * Y3 + e4 * Y4 + e5 * Y5 + e6 * Y6 + e7 * Y7)
    e_r = h * (e1 * r1 + e3 * r3 + e4 * r4 + e5 * r5 + e6 * r6 + e7 * r7)
    e_Y /= tol + tol * max(abs(Y), abs(Y_end))
    e_r /= tol + tol * max(abs(Y1), abs(Y7))  # |Y'| = |v|
    ks_Y, ks_r = (Y3, Y4, Y5, Y6, Y7), (r3, r4, r5, r6, r7)
    return Y_end, r_end, ks_Y, ks_r, 0.5 * (e_Y * e_Y + e_r * e_r)


@njit
def bulge(k1, ks):
    """Coefficient of theta^2 (1 - theta)^2 in DOPRI5's dense output, per unit of h."""
    k3, k4, k5, k6, k7 = ks
    return (
        -12715105075 / 11282082432 * k1
        + 87487479700 / 32700410799 * k3
        - 10690763975 / 1880347072 * k4
        + 701980252875 / 199316789632 * k5
        - 1453857185 / 822651844 * k6
        + 69997945 / 29380423 * k7
    )


@njit
def dense(theta, x0, x1, d0, d1, b):
    """Hermite's cubic from values and slopes (per step), plus the bulge."""
    rest, rise = 1 - theta, x1 - x0
    bend = d0 - rise
    return x0 + theta * (rise + rest * (bend + theta * (rise - d1 - bend + rest * b)))


@njit
def sign_changes(c):
    n, positive = 0, True  # positive just right of 0 by decree: the start is never found again
    for x in c:
        if x != 0 and (x > 0) != positive:
            positive = not positive
            n += 1
    return n


@njit
def root_in_bracket(c):
    """The one root of a quartic in Bernstein form, by Newton's method in a bracket."""
    lo, hi = 0.0, 1.0
    theta = min(max(c[0] / (c[0] - c[4]), 0.0), 1.0)
    for _ in range(60):
        d = c.copy()
        for n in range(4, 1, -1):
            for i in range(n):
                d[i] += theta * (d[i + 1] - d[i])
        w, dw = d[0] + theta * (d[1] - d[0]), 4 * (d[1] - d[0])
        if w > 0:
            lo = theta
        else:
            hi = theta
        newton = theta - w / dw if dw != 0 else math.inf
        inside = lo <= newton <= hi
        if inside and abs(newton - theta) < 1e-9:
            return newton
        theta = newton if inside else 0.5 * (lo + hi)
    return theta


@njit
def first_crossing(r0, r1, d0, d1, b):
    """First theta in (0, 1] at which r leaves the positive side, 2 if it never does.

    Halves until Descartes' rule leaves one root, so that a pair of crossings is not missed.
    """
    p, q = r0 + d0 / 3, r1 - d1 / 3
    stack = np.empty((32, 5))
    starts, widths = np.empty(32), np.empty(32)
    middle = 0.5 * (p + q) + b / 6
    stack[0] = np.array([r0, 0.25 * (r0 + 3 * p), middle, 0.25 * (3 * q + r1), r1])
    starts[0], widths[0] = 0.0, 1.0
    n = 1
    while n > 0:
        n -= 1
        c, start, width = stack[n].copy(), starts[n], widths[n]
        changes = sign_changes(c)
        if changes == 0:
            continue
        if changes == 1:
            return start + width * root_in_bracket(c)
        if width < 2**-24:  # a double root: touches, does not cross
            continue
        left, right = c.copy(), c.copy()
        for level in range(5):
            left[level], right[4 - level] = c[0], c[4 - level]
            for i in range(4 - level):
                c[i] += 0.5 * (c[i + 1] - c[i])
        stack[n], starts[n], widths[n] = right, start + 0.5 * width, 0.5 * width
        stack[n + 1], starts[n + 1], widths[n + 1] = left, start, 0.5 * width
        n += 2
    return 2.0 if r1 > 0 else 1.0


@njit
def slip(A, omega, tol, phi, left, side, y, v, speed, h, old_error2):
    """Until the belt, or the end (left = 0): phase, periods to go, y, v, h, last error.

    speed is that away from the belt where an event has fixed it, else negative.
    """
    drift, A = side * BELT, side * A
    Y, r = side * y, side * (BELT - v)
    k_Y, k_r = slope(drift, A * math.cos(phi), Y, r)
    k_r = speed if speed >= 0 else k_r
    rejected = False
    while True:
        h_left = (left * TWO_PI - phi) / omega
        last = h >= h_left
        step = h_left if last else h
        Y_end, r_end, ks_Y, ks_r, error2 = attempt(
            drift, A, omega, phi, step, Y, r, (k_Y, k_r), tol
        )
        if not error2 <= 1:  # nan too: a stage ran into the pole beyond the belt
            h = step * (max(0.2, 0.9 * error2**-0.1) if error2 > 1 else 0.2)
            rejected = True
            continue
        d0, d1 = step * k_r, step * ks_r[4]
        theta = 2.0
        if not (r_end > 0 and 3 * r + d0 >= 0 and 3 * r_end - d1 >= 0):
            theta = first_crossing(r, r_end, d0, d1, step * bulge(k_r, ks_r))
            if r == 0 and theta <= 1e-3:  # too long a step for the excursion, or only rounding
                if step > 1e-10:
                    h = 0.1 * step
                    continue
                theta = 2.0
        error2 = max(error2, 1e-8)
        if not last:
            factor = 0.9 * error2 ** (-1 / 12) * old_error2 ** (1 / 45)
            h = step * min(max(factor, 0.2), 1.0 if rejected else 5.0)
        old_error2, rejected = error2, False
        if theta <= 1:
            b = step * bulge(k_Y, ks_Y)
            Y = dense(theta, Y, Y_end, step * k_Y, step * ks_Y[4], b)
            phi, left = advance(phi, left, omega * step * theta)
            return phi, left, side * Y, BELT, h, old_error2
        if last:
            return 0.0, 0, side * Y_end, BELT - side * r_end, h, old_error2
        Y, r, k_Y, k_r = Y_end, r_end, ks_Y[4], ks_r[4]
        phi, left = advance(phi, left, omega * step)


@njit
def follow(A, omega, tol):
    """State after 200 periods from (0, 0), and the number of events."""
    phi, left, side, y, v, speed = 0.0, PERIODS, 1.0, 0.0, 0.0, -1.0
    h, old_error2, events = 0.3 * tol**0.2, 1e-8, 0
    while left > 0:
        phi, left, y, v, h, old_error2 = slip(
            A, omega, tol, phi, left, side, y, v, speed, h, old_error2
        )
        if left == 0:
            break
        q = A * math.cos(phi) - y
        verdict = arrival(side, q)
        if verdict == TOUCHES:
            speed = max(-side * q - EDGE, 0.0)
            continue
        events += 1
        if verdict != STICKS:
            side, speed = -side, max(side * q - EDGE, 0.0)
            continue
        dt, side = stick_end(A, omega, phi, y)
        t_left = (left * TWO_PI - phi) / omega
        if dt >= t_left:
            return y + BELT * t_left, BELT, events
        y, speed = y + BELT * dt, 0.0
        phi, left = advance(phi, left, omega * dt)
        events += 1
    return y, v, events


def prepare(case, tol):
    follow(case.A, case.omega, 1e-3)  # compiles
    return partial(follow, case.A, case.omega, tol)


RIVALS = [Rival("numba loop", powers_of_ten(4, 13), prepare)]
