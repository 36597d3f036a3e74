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


def make_spiral(tol):
    """P2 in one mode or the other: the sense of rotation is a parameter."""
    x, y = hy.make_vars("x", "y")
    w = hy.par[0]
    return hy.taylor_adaptive(
        [(x, x + w * y), (y, y - w * x)],
        [0.0, 0.0],
        pars=[0.0],
        tol=tol,
        t_events=[hy.t_event(x * x + y * y - 1.0, direction=hy.event_direction.positive)],
    )


def follow_spiral(integrator, problem):
    w = -2 * math.pi
    integrator.reset_cooldowns()
    integrator.time = 0.0
    integrator.state[:] = problem.start
    integrator.pars[0] = w
    integrator.propagate_until(problem.t_end)
    integrator.pars[0] = -w
    integrator.propagate_until(problem.t_end)
    return float(integrator.state[0]), float(integrator.state[1]), 1


def make_stick_slip(tol):
    """P4 below its surface, where all its slips are: there the slides end, and none crosses."""
    x, y = hy.make_vars("x", "y")
    return hy.taylor_adaptive(
        [(x, y), (y, 1.0 / (1.2 - y) - x)],
        [0.0, 0.0],
        tol=tol,
        t_events=[hy.t_event(y - 0.2, direction=hy.event_direction.positive)],
    )


def follow_stick_slip(integrator, problem):
    """The slide in closed form: x1' = 0.2 until s = -x1 is -1."""
    v, t_end = 0.2, problem.t_end
    integrator.reset_cooldowns()
    integrator.time = 0.0
    integrator.state[:] = problem.start
    events = 0
    while True:
        outcome = integrator.propagate_until(t_end)[0]
        x, t = float(integrator.state[0]), integrator.time
        if outcome == hy.taylor_outcome.time_limit:
            return x, float(integrator.state[1]), events
        events += 1
        if not -1 < x < 1:
            raise RuntimeError("crosses the surface, which it should not")
        t_exit = t + (1 - x) / v
        if t_exit >= t_end:
            return x + v * (t_end - t), v, events
        integrator.time = t_exit
        integrator.state[:] = (1.0, v)
        events += 1


def prepare_problem(problem, tol):
    """P2 and P4."""
    if problem.name == "P2":
        return partial(follow_spiral, make_spiral(tol), problem)
    if problem.name == "P4":
        return partial(follow_stick_slip, make_stick_slip(tol), problem)
    return None


PROBLEM_RIVALS = [Rival("heyoka", powers_of_ten(4, 13), prepare_problem)]
RIVALS = [Rival("heyoka", powers_of_ten(4, 13), prepare)]
