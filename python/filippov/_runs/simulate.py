# SPDX-License-Identifier: BSD-3-Clause
"""Simulation: from a system and a start to a trajectory."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from filippov import _core
from filippov._results.event import EventFunction, EventKind, event_log, watch_all
from filippov._results.settings import (
    ALL,
    EXPLICIT,
    POLICIES,
    Settings,
    Stats,
    run_settings,
)
from filippov._results.solution import Solution
from filippov._support.check import (
    LONGEST,
    flag,
    floats,
    integer,
    refuse,
    start_first,
    time_span,
    vector,
)
from filippov._support.progress import ended
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import Params, System

from .trajectory import Branches, Trajectory

__all__ = [
    "SimulationError",
    "advice",
    "method_for",
    "simulate",
]


class SimulationError(RuntimeError):
    """A run that failed, with `raise_on_failure=True`; `trajectory` is what there is of it."""

    def __init__(self, trajectory: Trajectory) -> None:
        super().__init__(trajectory.message)
        self.trajectory = trajectory


Policy = Literal["stop", "below", "above", "stay"]


@overload
def simulate(
    sys: System,
    x0: ArrayLike,
    t_span: tuple[float, float],
    *,
    params: Mapping[str, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-8,
    atol: ArrayLike = 1e-10,
    t_eval: ArrayLike | None = None,
    dense_output: bool = True,
    events: EventFunction | Iterable[EventFunction] | None = None,
    max_step: float = math.inf,
    first_step: float | None = None,
    max_steps: int = 10_000_000,
    max_events: int = 1_000_000,
    on_nonunique: Policy = "stop",
    max_branches: int = 64,
    raise_on_failure: bool = False,
) -> Trajectory: ...
@overload
def simulate(
    sys: System,
    x0: ArrayLike,
    t_span: tuple[float, float],
    *,
    params: Mapping[str, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-8,
    atol: ArrayLike = 1e-10,
    t_eval: ArrayLike | None = None,
    dense_output: bool = True,
    events: EventFunction | Iterable[EventFunction] | None = None,
    max_step: float = math.inf,
    first_step: float | None = None,
    max_steps: int = 10_000_000,
    max_events: int = 1_000_000,
    on_nonunique: Literal["all"],
    max_branches: int = 64,
    raise_on_failure: bool = False,
) -> Branches: ...
def simulate(
    sys: System,
    x0: ArrayLike,
    t_span: tuple[float, float],
    *,
    params: Mapping[str, float] | None = None,
    method: str | None = None,
    rtol: float = 1e-8,
    atol: ArrayLike = 1e-10,
    t_eval: ArrayLike | None = None,
    dense_output: bool = True,
    events: EventFunction | Iterable[EventFunction] | None = None,
    max_step: float = math.inf,
    first_step: float | None = None,
    max_steps: int = 10_000_000,
    max_events: int = 1_000_000,
    on_nonunique: Policy | Literal["all"] = "stop",
    max_branches: int = 64,
    raise_on_failure: bool = False,
) -> Trajectory | Branches:
    """Follow the Filippov solution from a start, with all its events.

    Parameters
    ----------
    sys : System
        The system, for instance `filippov.models.oscillator`.
    x0 : array, shape (dim,)
        State at the start. A start on a surface is judged like any other contact.
    t_span : (float, float)
        Start and end; the end may lie before the start.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    method : {"dopri5", "dop853", "rodas5p"}, optional
        Dormand-Prince 5(4), or 8(5,3) for tight tolerances; Rodas5P, linearly implicit, for stiff
        fields. scipy's names "RK45" and "DOP853" are taken too. By default dopri5, and rodas5p for
        a smoothed system, which is stiff.
    rtol : float
        Relative tolerance of the local error, in (0, 1).
    atol : float or array, shape (dim,)
        Absolute tolerance, units of x.
    t_eval : array, shape (k,), optional
        Times at which to give the solution, ordered from start to end; by default the ends of all
        steps, so also all events. If the run ends early, its last point is added.
    dense_output : bool
        Keep the solution between the steps, as `Trajectory.sol`. Without it, and with `t_eval`, a
        run needs no memory for its steps.
    events : function or list of functions, optional
        `g(t, y)` or `g(t, y, p)`, `p` being the parameters (`p.A`); zeros of g are logged with
        kind `section`. Attributes as in scipy: `terminal` (a bool, or after how many zeros to
        stop) and `direction` (sign of the slope that counts, along the run). A zero at the start
        is logged but ends nothing.
    max_step : float
        Longest step, units of t.
    first_step : float, optional
        First step, units of t.
    max_steps, max_events : int
        Bounds on the work; reaching one ends the run with that status.
    on_nonunique : {"stop", "below", "above", "stay", "all"}
        What to do where the solution is not unique: end with status `ambiguous`, go on in h < 0,
        in h > 0, or slide; where several surfaces meet, in the mode with the lowest sides, the
        highest, or the most slides. "all" follows every solution. Events tell by `alternatives`
        where there was a choice.
    max_branches : int
        Solutions at most, with "all".
    raise_on_failure : bool
        Turn a failed run into a `SimulationError`.

    Returns
    -------
    Trajectory, or Branches with `on_nonunique="all"`
        Of a failed run too: `status` and `message` say what happened, the last point is the last
        good state, and all events up to there are logged.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a fraction of a second of Ctrl-C; its attribute `trajectory` is the run up to there.
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    run_params = sys._merged(params)
    p = np.array(list(run_params.values()), dtype=np.float64)
    start_first("simulate", x0, t_span, sys.dim)
    start = vector("x0", x0, sys.dim, sys.state)
    t0, t_end = time_span(t_span)
    period = sys._model.period(p)
    if period > 0 and not max(abs(t0), abs(t_end)) / period < LONGEST:
        refuse("t_span", t_span, f"expected times of fewer than 2**52 periods, {period:.9g} each")
    settings = run_settings(
        sys.dim,
        method_for(sys, method, "dopri5"),
        rtol,
        atol,
        max_step,
        max_steps,
        max_events,
        on_nonunique,
        first_step,
        policies=(*POLICIES, ALL),
    )
    branches = on_nonunique == ALL
    most = integer("max_branches", max_branches)
    most = most if branches else 0
    times = None if t_eval is None else _times(t_eval, t0, t_end)
    watched = watch_all(events)
    dense = flag("dense_output", dense_output)
    raises = flag("raise_on_failure", raise_on_failure)

    runs, complete = _core.simulate(
        sys._model,
        start,
        t0,
        t_end,
        p,
        settings._told(),
        most,
        dense,
        times,
        [watch.as_tuple() for watch in watched],
        run_params,
    )
    n_watched = None if events is None else len(watched)
    found = [_trajectory(sys, run, run_params, settings, n_watched) for run in runs]
    result = Branches(tuple(found), complete) if branches else found[0]
    ended(runs[-1].raised, trajectory=result)
    for trajectory in found:
        if raises and not trajectory.success:
            raise SimulationError(trajectory)
    return result


def _trajectory(
    sys: System, run: _core.Run, params: Params, settings: Settings, n_watched: int | None
) -> Trajectory:
    log = event_log(run.events, sys.dim, sys.surfaces)
    t_events: tuple[Floats, ...] | None = None
    y_events: tuple[Floats, ...] | None = None
    if n_watched is not None:
        section = log["kind"] == EventKind.section
        mine = [log[section & (log["surface"] == q)] for q in range(n_watched)]
        t_events = tuple(each["t"].copy() for each in mine)
        y_events = tuple(each["x_right"].copy() for each in mine)
    return Trajectory(
        t=run.t,
        y=run.y.T,
        sol=None if run.solution is None else Solution(run.solution, sys),
        t_events=t_events,
        y_events=y_events,
        status=Status(run.status),
        message=by_name(sys, run.message) + advice(sys, settings.method, run.status),
        events=log,
        mode=run.mode[:, 0] if sys.surfaces == 1 else run.mode.T,
        stats=Stats(**run.counters),
        system=sys,
        params=params,
        settings=settings,
    )


def method_for(sys: System, method: str | None, default: str) -> str:
    """Name a method; without one the default, or what a stiff system needs."""
    if method is None:
        return "rodas5p" if sys._positive() else default
    return method


def by_name(sys: System, message: str) -> str:
    """Say which surface a message of the core means by its number: its name, or what it is."""

    def named(found: re.Match[str]) -> str:
        return f"{found[0]} ({sys._surface_label(int(found[1]))})"

    return re.sub(r", surface (\d+)", named, message)


def advice(sys: System, method: str, status: str) -> str:
    """Say what else helps a run that used its steps up, if that is known."""
    stiff = bool(sys._positive()) and method in EXPLICIT
    helps = stiff and status == Status.max_steps
    return " A smoothed system is stiff: use method='rodas5p'." if helps else ""


def _times(t_eval: ArrayLike, t0: float, t_end: float) -> Floats:
    times = floats("t_eval", t_eval, "expected an array of numbers").copy()
    if times.ndim != 1:
        refuse("t_eval", times, f"expected one dimension, got shape {times.shape}")
    low, high = min(t0, t_end), max(t0, t_end)
    outside = ~((times >= low) & (times <= high))
    if outside.any():
        k = int(outside.argmax())
        refuse(f"t_eval[{k}]", times[k], f"expected a time in t_span = ({t0!r}, {t_end!r})")
    wrong = np.diff(times) < 0 if t_end >= t0 else np.diff(times) > 0
    if wrong.any():
        k = int(wrong.argmax()) + 1
        refuse(
            f"t_eval[{k}]", times[k], "expected times ordered from the start to the end of t_span"
        )
    return times
