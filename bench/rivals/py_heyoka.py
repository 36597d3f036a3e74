# SPDX-License-Identifier: BSD-3-Clause
#
# pip install heyoka numpy (and numba, which compiles the closed form of the stick)
"""heyoka's Taylor integrator with its own event detection; the modes are switched in Python.

Slip in the mirrored coordinates of py_numba.py, so that one integrator serves both sides: the side
enters by parameters. It is made anew for each tolerance, which is not timed.
"""

import math
from functools import partial

import heyoka as hy
from py_oscillator import (
    BELT,
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

VERSION = hy.__version__


def make_integrator(tol):
    Y, r = hy.make_vars("Y", "r")
    drift, force, omega = hy.par[0], hy.par[1], hy.par[2]
    friction = 3.0 / (1.0 + 1.42 * r) + 1.0 + 0.1 * r * r
    return hy.taylor_adaptive(
        [(Y, drift - r), (r, Y - force * hy.cos(omega * hy.time) - friction)],
        [0.0, BELT],
        pars=[0.0, 0.0, 0.0],
        tol=tol,
        t_events=[hy.t_event(r, direction=hy.event_direction.negative)],
    )


def follow(integrator, A, omega):
    """State after 200 periods from (0, 0), and the number of events."""
    state, pars = integrator.state, integrator.pars
    integrator.reset_cooldowns()
    phi, left, side, events = 0.0, PERIODS, 1.0, 0
    y, v = 0.0, 0.0
    while True:
        t = phi / omega
        integrator.time = t
        state[0], state[1] = side * y, side * (BELT - v)
        pars[0], pars[1], pars[2] = side * BELT, side * A, omega
        t_end = t + (left * TWO_PI - phi) / omega
        outcome = integrator.propagate_until(t_end)[0]
        y, v = side * float(state[0]), BELT - side * float(state[1])
        if outcome == hy.taylor_outcome.time_limit:
            return y, v, events
        if outcome == hy.taylor_outcome.err_nf_state:
            raise RuntimeError("the state is no longer finite")
        phi, left = advance(phi, left, omega * (integrator.time - t))
        v = BELT
        verdict = arrival(side, A * math.cos(phi) - y)
        if verdict == TOUCHES:
            continue
        events += 1
        if verdict != STICKS:
            side = -side
            continue
        dt, side = stick_end(A, omega, phi, y)
        t_left = (left * TWO_PI - phi) / omega
        if dt >= t_left:
            return y + BELT * t_left, BELT, events
        y += BELT * dt
        phi, left = advance(phi, left, omega * dt)
        events += 1


def prepare(case, tol):
    run = partial(follow, make_integrator(tol), case.A, case.omega)
    run()  # compiles the closed form of the stick
    return run


RIVALS = [Rival("heyoka", powers_of_ten(4, 13), prepare)]
