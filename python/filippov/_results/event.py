# SPDX-License-Identifier: BSD-3-Clause
"""What happened along a trajectory: event kinds, the event log, event functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._support.check import MOST, refuse
from filippov._support.types import Record

__all__ = [
    "KIND_NAMES",
    "EventFunction",
    "EventKind",
    "Watched",
    "event_log",
    "log_dtype",
    "mode_changes",
    "modes_of",
    "watch_all",
]


class EventKind(str, Enum):
    """What happened at an event; compares equal to its name, in `Trajectory.events` too."""

    cross = "cross"  #: from one side of a surface to the other
    enter_sliding = "enter_sliding"  #: from a side into a slide
    exit_sliding = "exit_sliding"  #: from a slide to a side
    graze = "graze"  #: touched a surface from one side; no change of mode
    slide_extremum = "slide_extremum"  #: a slide touched its boundary from inside
    section = "section"  #: zero of a user's event function
    jump = "jump"  #: the state jumped
    accumulation = "accumulation"  #: events accumulated here
    start = "start"  #: first point of the run
    end = "end"  #: last point of the run

    def __str__(self) -> str:
        return self.value


# An event function: `g(t, y)` or `g(t, y, p)`, with the optional attributes `terminal` and
# `direction`.
EventFunction = Callable[..., float]

KIND_NAMES = tuple(_core.event_kind_names())
_KINDS = np.array(KIND_NAMES)


def modes_of(code: NDArray[Any], surfaces: int) -> NDArray[np.int8]:
    """Modes from their codes, the sums of mode_j 3**j: shape (surfaces, *code.shape)."""
    modes = np.empty((surfaces, *code.shape), dtype=np.int8)
    rest = code.astype(np.int64)
    for j in range(surfaces):
        modes[j] = (rest + 1) % 3 - 1
        rest = (rest - modes[j]) // 3
    return modes


def log_dtype(dim: int, surfaces: int) -> np.dtype[Any]:
    """Columns of an event log."""
    side: tuple[int, ...] = () if surfaces == 1 else (surfaces,)
    return np.dtype(
        [
            ("t", "f8"),
            ("kind", _KINDS.dtype),
            ("surface", "i4"),
            ("mode_before", "i1", side),
            ("mode_after", "i1", side),
            ("x_left", "f8", (dim,)),
            ("x_right", "f8", (dim,)),
            ("s", "f8"),
            ("period", "i8"),
            ("t_local", "f8"),
            ("contacts", "u4"),
            ("alternatives", "i4"),
        ]
    )


def event_log(columns: _core.EventColumns, dim: int, surfaces: int) -> Record:
    """Structured array of events from its columns."""
    log = np.empty(len(columns.t), log_dtype(dim, surfaces))
    for name in log.dtype.names or ():
        column = getattr(columns, name)
        if name == "kind":
            log[name] = _KINDS[column]
        elif name.startswith("mode") and surfaces == 1:
            log[name] = column[:, 0]
        else:
            log[name] = column
    return log


def mode_changes(events: Record) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Find the events between which the mode stays the same, both ends included."""
    changed = events["mode_before"] != events["mode_after"]
    if changed.ndim > 1:
        changed = changed.any(axis=1)
    jumped = events["kind"] == EventKind.jump
    changed[:1] = changed[-1:] = True
    return np.flatnonzero(changed | jumped)


@dataclass(frozen=True)
class Watched:
    """An event function as the core takes it."""

    function: EventFunction
    direction: int
    stop_after: int
    with_params: bool

    def as_tuple(self) -> tuple[EventFunction, int, int, bool]:
        """Argument of the core."""
        return self.function, self.direction, self.stop_after, self.with_params


def watch_all(events: EventFunction | Iterable[EventFunction] | None) -> list[Watched]:
    """Check event functions: one, several, or none."""
    if events is None:
        return []
    if callable(events):
        return [_watch("events", events)]
    expected = "expected a function g(t, y) or a list of them"
    if isinstance(events, (str, bytes, Mapping)):
        refuse("events", events, expected, TypeError)
    try:
        each = list(events)
    except TypeError:
        refuse("events", events, expected, TypeError)
    most = _core.max_event_functions
    if len(each) > most:
        refuse("len(events)", len(each), f"expected at most {most} event functions")
    return [_watch(f"events[{k}]", function) for k, function in enumerate(each)]


def _watch(name: str, function: EventFunction) -> Watched:
    if not callable(function):
        refuse(name, function, "expected a function g(t, y) or g(t, y, p)", TypeError)
    with_params = False
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # a builtin does not tell; it is called as g(t, y)
        pass
    else:
        if not _takes(signature, 2):
            if not _takes(signature, 3):
                title = getattr(function, "__name__", type(function).__name__)
                raise TypeError(
                    f"{name} = {title}{signature}: expected a function g(t, y) or g(t, y, p)"
                )
            with_params = True
    direction = getattr(function, "direction", 0)
    try:
        if isinstance(direction, (bool, np.bool_)):
            raise TypeError
        sign = int(np.sign(float(direction)))
    except (TypeError, ValueError, OverflowError):
        refuse(f"{name}.direction", direction, "expected a number: -1, 0 or +1")
    terminal = getattr(function, "terminal", False)
    whole = isinstance(terminal, (bool, int, np.bool_, np.integer))
    if not whole or not 0 <= int(terminal) <= MOST:
        expected = "expected a bool, or after how many events to stop (below 2**63)"
        refuse(f"{name}.terminal", terminal, expected)
    return Watched(function, sign, int(terminal), with_params)


def _takes(signature: inspect.Signature, count: int) -> bool:
    try:
        signature.bind(*range(count))
    except TypeError:
        return False
    return True
