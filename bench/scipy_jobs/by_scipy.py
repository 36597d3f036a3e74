# SPDX-License-Identifier: BSD-3-Clause
"""The block on the belt with scipy: from event to event, as a careful user writes it."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def slip_field(side, A, omega):
    """Field of a block slower (-1) or faster (+1) than the belt; smooth across v = 1."""

    def field(t, x):
        y, v = x.tolist()  # numbers of Python: those of numpy are slow one by one
        u = side * (v - 1.0)
        friction = 3.0 / (1.0 + 1.42 * u) + 1.0 + 0.1 * u * u
        return v, A * math.cos(omega * t) - y - side * friction

    return field


def belt_event(side, t_start):
    """Event v = 1: a start on the belt is none, a return within the first step is one."""

    def event(t, x):
        return x[1] - 1.0 if t > t_start else side

    event.terminal = True
    event.direction = -side
    return event


def mode_on_belt(t, y, fields):
    """Mode after v = 1 is reached: 0 where both fields point to the belt, else the side."""
    below, above = (fields[side](t, np.array([y, 1.0]))[1] for side in (-1, 1))
    return 0 if below > 0 > above else 1 if above >= 0 else -1


def end_of_stick(t, y, t_end, A, omega):
    """Time and side of the slip that ends a stick: y' = 1 as long as the pull is at most 4."""

    def pull(time):
        return A * math.cos(omega * time) - y - (time - t)

    def reserve(time):
        return 4.0 - abs(pull(time))

    left = right = t
    while reserve(right) >= 0:
        if right >= t_end:
            return t_end, 0
        left, right = right, min(right + 0.1 / omega, t_end)
    t_slip = brentq(reserve, left, right, xtol=1e-15) if right > left else t
    return t_slip, 1 if pull(t_slip) > 0 else -1


def follow(start, t_end, A, omega, **how):
    """State at t_end of the block that starts at t = 0, and its events: times and kinds."""
    t, (y, v) = 0.0, start
    fields = {side: slip_field(side, A, omega) for side in (-1, 1)}
    mode = mode_on_belt(t, y, fields) if v == 1.0 else -1 if v < 1.0 else 1
    events = []
    while t < t_end:
        if mode:
            event = belt_event(mode, t)
            run = solve_ivp(fields[mode], (t, t_end), (y, v), events=event, **how)
            if not run.success:
                raise RuntimeError(run.message)
            t, (y, v) = float(run.t[-1]), run.y[:, -1].tolist()
            if run.status == 1:
                v, mode = 1.0, mode_on_belt(t, y, fields)
                events.append((t, "cross" if mode else "stick"))
                if len(events) > 3 and t - events[-4][0] < 1e-10:
                    raise RuntimeError(f"finds one event again and again at t = {t}")
        else:
            t_slip, mode = end_of_stick(t, y, t_end, A, omega)
            t, y = t_slip, y + (t_slip - t)
            if mode:
                events.append((t, "slip"))
    return (y, v), events


def trajectory(A, omega, periods, **how):
    """State after so many periods of the forcing, from rest."""
    return np.array(follow((0.0, 0.0), periods * 2 * math.pi / omega, A, omega, **how)[0])


def diagram(A, omegas, transient, keep, **how):
    """Values of omega, and phases at which the block begins to slip."""
    points = []
    for omega in omegas.tolist():
        T = 2 * math.pi / omega
        _, events = follow((0.0, 0.0), (transient + keep) * T, A, omega, **how)
        times = [t for t, kind in events if kind == "slip" and t >= transient * T]
        points += [(omega, omega * t % (2 * math.pi)) for t in times]
    return np.array(points).reshape(-1, 2).T


def cell_images(A, omega, y, v, **how):
    """States to which the states (y, v) of a grid are mapped in one period."""
    T = 2 * math.pi / omega
    images = [[follow((a, b), T, A, omega, **how)[0] for b in v.tolist()] for a in y.tolist()]
    return np.moveaxis(np.array(images), -1, 0)


def basins(A, omega, grid, **how):
    """Label of every cell's attractor, which is taken to be of period one."""
    T = 2 * math.pi / omega
    (y, v) = (low + (high - low) * (np.arange(n) + 0.5) / n for low, high, n in grid.values())
    found = []

    def label(x):
        for _ in range(1000):
            for number, attractor in enumerate(found, 1):
                if math.dist(x, attractor) < 0.01:
                    return number
            last, x = x, follow(x, T, A, omega, **how)[0]
            if math.dist(x, last) < 1e-6:
                found.append(x)
        return 0

    return np.array([[label((a, b)) for b in v.tolist()] for a in y.tolist()])
