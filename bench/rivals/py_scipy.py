# SPDX-License-Identifier: BSD-3-Clause
#
# pip install scipy
"""scipy's solve_ivp, restarted at events: the loop of scipy_jobs/by_scipy.py, and one for systems
with any surface.

BDF and Radau stop at 1e-8, where they take ten times as long as the explicit methods.
"""

import sys
from functools import partial
from pathlib import Path

import numpy as np
import scipy
from py_oscillator import PERIODS, TWO_PI, Rival, powers_of_ten
from py_switched import Problem
from scipy.integrate import solve_ivp

sys.path.append(str(Path(__file__).parents[1]))
from scipy_jobs.by_scipy import follow

VERSION = scipy.__version__


def prepare(method, case, tol):
    def run():
        t_end = PERIODS * TWO_PI / case.omega
        how = {"method": method, "rtol": tol, "atol": tol}
        (y, v), events = follow((0.0, 0.0), t_end, case.A, case.omega, **how)
        return y, v, len(events)

    return run


def gaps_of(problem, mode):
    """Functions (x, f) -> value and rate of what ends a mode where it falls to zero."""
    if mode:
        return [(lambda x, f: mode * problem.h(x), lambda x, f: mode * problem.normal_speed(x, f))]
    s = problem.control
    return [
        (lambda x, f: 1 + s(x), lambda x, f: s(f)),
        (lambda x, f: 1 - s(x), lambda x, f: -s(f)),
    ]


def event_of(function, field, t_start, direction, terminal):
    """A zero at the start is no event, a return within the first step is one."""

    def event(t, x):
        x = x.tolist()
        return function(x, field(t, x)) if t > t_start else 1.0

    event.direction, event.terminal = direction, terminal
    return event


def run_mode(problem, mode, t, x, **how):
    """The run until the mode ends, and which of its gaps has closed.

    Only signs at the ends of steps are seen. So the minima of the gaps are events, too: if a gap is
    below zero at one, the solution has dipped through the surface and back within a step, and is
    followed again up to there.
    """
    field, gaps = problem.fields[mode], gaps_of(problem, mode)
    ends = [event_of(gap, field, t, -1, True) for gap, _ in gaps]
    minima = [event_of(rate, field, t, 1, False) for _, rate in gaps]

    def slope(t, x):
        return field(t, x.tolist())

    x = np.array(x)
    run = solve_ivp(slope, (t, problem.t_end), x, events=ends + minima, **how)
    dips = [
        time
        for k, (gap, _) in enumerate(gaps, len(gaps))
        for time, y in zip(run.t_events[k], run.y_events[k], strict=True)
        if gap(y.tolist(), None) < 0
    ]
    if dips:
        run = solve_ivp(slope, (t, min(dips)), x, events=ends, **how)
    if not run.success:
        raise RuntimeError(run.message)
    return run, [k for k in range(len(gaps)) if len(run.t_events[k])]


def follow_switched(problem, **how):
    """State at the end, and the number of events."""
    t, x, mode = 0.0, problem.start, problem.start_mode()
    events = 0
    while events < 10_000:
        run, closed = run_mode(problem, mode, t, x, **how)
        t, x = float(run.t[-1]), tuple(run.y[:, -1].tolist())
        if t >= problem.t_end:
            return *x, events
        if not closed:
            continue  # a dip that was none, seen again with shorter steps
        events += 1
        mode = problem.mode_on_surface(t, x) if mode else 2 * closed[0] - 1
    raise RuntimeError("events without end")


def prepare_switched(method, problem, tol):
    if not isinstance(problem, Problem):
        return None
    return partial(follow_switched, problem, method=method, rtol=tol, atol=tol)


METHODS = (("RK45", 11), ("DOP853", 11), ("LSODA", 11), ("BDF", 8), ("Radau", 8))
RIVALS = [
    Rival(f"scipy {method}", powers_of_ten(4, last), partial(prepare, method))
    for method, last in METHODS
]
PROBLEM_RIVALS = [
    Rival(f"scipy {method}", powers_of_ten(4, min(last + 2, 13)), partial(prepare_switched, method))
    for method, last in METHODS
    if last > 8
]
