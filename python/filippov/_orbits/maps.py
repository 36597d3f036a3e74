# SPDX-License-Identifier: BSD-3-Clause
"""The flow as a map, from a strobe or a section to the next, with derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.event import KIND_NAMES
from filippov._results.settings import analysis_settings
from filippov._results.store import Stored
from filippov._support.check import (
    LONGEST,
    floats,
    integer,
    number,
    one_of,
    refuse,
    start_within,
    transposed,
    word,
    words,
)
from filippov._support.progress import ended
from filippov._support.sound import complete, require, shaped
from filippov._support.status import Status
from filippov._support.types import FloatOrArray, Floats
from filippov._system.system import Params, System

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Mapped", "section_map", "strobe_map"]

MOST_ITERATES = 1_000_000
_SECTIONS = ("cross", "enter_sliding", "exit_sliding")
_ALL = 2


@dataclass(frozen=True, eq=False)
class Mapped(Stored):
    """Where a map leads, with its derivatives.

    Of one start, or of k starts: then arrays have a last axis of length k, and words, statuses and
    messages are tuples. A start on the surface has the derivatives of the mode it begins in.
    """

    x: Floats  #: state there, shape (dim,) or (dim, k); of a failure the last valid one
    t: FloatOrArray  #: time there
    #: d(x, t)/d(x0, t0), shape (dim + 1, dim + 1) or (dim + 1, dim + 1, k); NaN where `singular`,
    #: and of a failure
    slope: Floats
    param_slope: dict[str, Floats]  #: d(x, t)/dp by name of p, shape (dim + 1,) or (dim + 1, k)
    word: str | tuple[str, ...]  #: modes passed through: `-`, `0` and `+`
    slides: np.int64 | NDArray[np.int64]  #: how many of them slide
    singular: np.bool_ | NDArray[np.bool_]  #: an event was tangential: there are no derivatives
    status: Status | tuple[Status, ...]  #: ok, or why there is no image
    message: str | tuple[str, ...]  #: the same in words, empty for ok
    system: System
    params: Params

    def _verify(self) -> None:
        sys, several = self.system, isinstance(self.status, tuple)
        complete(self.params, sys.params)
        n = (len(self.status),) if several else ()
        shaped((sys.dim, *n), x=self.x)
        shaped((sys.dim + 1, sys.dim + 1, *n), slope=self.slope)
        shaped((sys.dim + 1, *n), **{f"slope by {p}": v for p, v in self.param_slope.items()})
        require(
            set(self.param_slope) <= set(sys.params), f"slopes by {', '.join(self.param_slope)}"
        )
        for name in ("t", "slides", "singular"):
            shaped(n, **{name: np.asarray(getattr(self, name))})
        for name in ("word", "message"):
            each = getattr(self, name)
            good = len(each) == len(self.status) if several else True
            require(isinstance(each, tuple) == several and good, f"{name} is of other starts")

    def __repr__(self) -> str:
        if isinstance(self.status, tuple):
            missed = sum(status != Status.ok for status in self.status)
            without = f", {missed} without an image" if missed else ""
            return f"<Mapped of {self.system.name}: {len(self.status)} starts{without}>"
        if self.status != Status.ok:
            return f"<Mapped of {self.system.name}: {self.status}: {self.message}>"
        singular = ", singular" if self.singular else ""
        return (
            f"<Mapped of {self.system.name}: x {np.array2string(self.x, separator=', ')}, "
            f"t {self.t:.9g}, word {self.word}{singular}>"
        )

    def to_xarray(self) -> xr.Dataset:
        """Give the images as an `xarray.Dataset` with dimensions `state` and, of many, `start`.

        Derivatives are over `of` and `by`: the state and then t.
        """
        start = ("start",) if self.x.ndim == 2 else ()
        variables: dict[str, Any] = {
            "x": (("state", *start), self.x),
            "t": (start, self.t),
            "slope": (("of", "by", *start), self.slope),
            "singular": (start, self.singular),
        }
        for name, slope in self.param_slope.items():
            variables[f"slope_{name}"] = (("of", *start), slope)
        for name in ("word", "status", "message"):
            each = getattr(self, name)
            words = [str(v) for v in each] if start else str(each)
            variables[name] = (start, np.array(words, dtype=np.str_))
        both = [*self.system.state, "t"]
        coords = {"state": list(self.system.state), "of": both, "by": both}
        return dataset(self, variables, coords)

    @property
    def success(self) -> bool:
        """Whether every start has an image."""
        each = self.status if isinstance(self.status, tuple) else (self.status,)
        return all(status == Status.ok for status in each)


def strobe_map(
    sys: System,
    x0: ArrayLike,
    *,
    iterate: int = 1,
    t0: ArrayLike = 0.0,
    params: Mapping[str, float] | None = None,
    wrt: str | Sequence[str] = (),
    rtol: float = 1e-12,
    atol: float = 1e-13,
) -> Mapped:
    """Map a state to the one `iterate` forcing periods later.

    Parameters
    ----------
    sys : System
        With a period.
    x0 : array, shape (dim,) or (dim, k)
        One start or several.
    iterate : int
        Number of periods.
    t0 : float or array, shape (k,)
        Time of the start.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    wrt : str or sequence of str
        Parameters with respect to which `param_slope` is wanted. More than two cost further runs.
    rtol, atol : float
        Tolerances of the flow.

    Returns
    -------
    Mapped
        A status for each start. The end moves with the start and with the period: a derivative by a
        parameter that the period depends on says so.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a fraction of a second of Ctrl-C.
    """
    _a_system(sys)
    if "period" not in sys.capabilities:
        refuse("sys", sys.name, "expected a forced System")
    task = _Task(sys, x0, t0, params, wrt, rtol, atol, iterate)
    return task.result(_core.strobe_map(*task.arguments()))


def section_map(
    sys: System,
    x0: ArrayLike,
    section: str = "exit_sliding",
    *,
    after: int | None = None,
    surface: int | None = None,
    iterate: int = 1,
    t0: ArrayLike = 0.0,
    max_time: float | None = None,
    params: Mapping[str, float] | None = None,
    wrt: str | Sequence[str] = (),
    rtol: float = 1e-12,
    atol: float = 1e-13,
) -> Mapped:
    """Map a state to state and time at the next event of a kind, `iterate` times.

    Parameters
    ----------
    sys : System
        Of what.
    x0 : array, shape (dim,) or (dim, k)
        One start or several. An event that a run starts at does not count.
    section : str
        "exit_sliding", "enter_sliding" or "cross".
    after : int, optional
        Only events that lead to this mode of their surface: -1, 0 or +1. `"exit_sliding", after=-1`
        are the exits at s = -1.
    surface : int, optional
        Only events of this surface, an index.
    iterate : int
        Which of the events.
    t0 : float or array, shape (k,)
        Time of the start.
    max_time : float, optional
        How long to wait for each event, by default 50 forcing periods, or 1000 units of time for a
        system that has none.
    params, wrt, rtol, atol
        As in `strobe_map`.

    Returns
    -------
    Mapped
        A status for each start, `escaped` where no such event comes. Derivatives are those of state
        and time at the event.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a fraction of a second of Ctrl-C.
    """
    _a_system(sys)
    task = _Task(sys, x0, t0, params, wrt, rtol, atol, iterate)
    period = sys.period(task.params)
    of, longest = section_of(section, after, max_time, period)
    among = f"expected a surface of {sys.name}, 0 to {sys.surfaces - 1}, or None for all"
    index = -1 if surface is None else one_of("surface", surface, range(sys.surfaces), among)
    run = _core.section_map(*task.arguments(), *of, index, longest)
    return task.result(run)


def _a_system(sys: System) -> None:
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System", TypeError)


def section_of(
    section: str, after: int | None, max_time: float | None, period: float | None
) -> tuple[tuple[int, int], float]:
    """Check a section: kind of the events, the mode that they lead to, and how long to wait."""
    kind = KIND_NAMES.index(word("section", section, _SECTIONS))
    target = _ALL
    if after is not None:
        expected = "expected a mode, -1, 0 or +1, or None for all"
        target = one_of("after", after, (-1, 0, 1), expected)
    if max_time is not None:
        most = math.inf if period is None or not period > 0 else LONGEST * period
        expected = "expected a finite number > 0, of fewer than 2**52 periods"
        longest = number("max_time", max_time, expected, above=0.0, below=most)
    else:
        longest = 50 * period if period is not None and period > 0 else 1000.0
    return (kind, target), longest


class _Task:
    """What both maps are told, checked."""

    def __init__(
        self,
        sys: System,
        x0: ArrayLike,
        t0: ArrayLike,
        params: Mapping[str, float] | None,
        wrt: str | Sequence[str],
        rtol: float,
        atol: float,
        iterate: int,
    ) -> None:
        self.system = sys
        self.params = sys._merged(params)
        sys._forced(self.params)
        self.wrt = _names(sys, wrt)
        self.t0, self.x0, self.single = _starts(sys, t0, x0)
        for time in (self.t0.min(), self.t0.max()) if self.t0.size else ():
            start_within("t0", float(time), sys.period(self.params))
        self.told = analysis_settings(rtol, atol)
        self.iterate = integer("iterate", iterate)
        if self.iterate > MOST_ITERATES:
            refuse("iterate", iterate, f"expected an integer from 1 to {MOST_ITERATES}")

    def arguments(
        self,
    ) -> tuple[_core.Model, Floats, Floats, Floats, list[int], _core.RunSettings, int]:
        """Give what the core takes first."""
        names = list(self.params)
        active = [names.index(name) for name in self.wrt]
        values = self.system._values(self.params)
        model = self.system._model
        return model, self.t0, self.x0, values, active, self.told, self.iterate

    def result(self, run: _core.MappedColumns) -> Mapped:
        """Shape what the core gives: without the axis of starts if there was one."""
        ended(run.raised)
        slopes = run.param_slope
        by_name = {name: slopes[:, :, k] for k, name in enumerate(self.wrt)}
        return Mapped(
            x=self._shaped(run.x),
            t=self._shaped(run.t),
            slope=self._shaped(run.slope),
            param_slope={name: self._shaped(column) for name, column in by_name.items()},
            word=self._shaped(tuple(run.word)),
            slides=self._shaped(run.slides),
            singular=self._shaped(run.singular.astype(np.bool_)),
            status=self._shaped(tuple(Status(name) for name in run.status)),
            message=self._shaped(tuple(run.message)),
            system=self.system,
            params=self.params,
        )

    def _shaped(self, column: Any) -> Any:  # noqa: ANN401 - an array or a tuple
        if self.single:
            return column[0]
        return np.moveaxis(column, 0, -1) if isinstance(column, np.ndarray) else column


def _names(sys: System, wrt: str | Sequence[str]) -> tuple[str, ...]:
    known = ", ".join(sys.params) or "none"
    names = words("wrt", wrt, sys.params, f"expected names among {known}")
    if len(set(names)) != len(names):
        refuse("wrt", wrt, "expected each name once")
    return names


def _starts(sys: System, t0: ArrayLike, x0: ArrayLike) -> tuple[Floats, Floats, bool]:
    """Shape times and states as the core takes them, and say whether it is one start."""
    shape = f"expected finite numbers, shape ({sys.dim},) or ({sys.dim}, k)"
    points = _finite("x0", x0, f"{shape} for ({', '.join(sys.state)})")
    times = _finite("t0", t0, "expected a finite number, or one for each start")
    if points.ndim == 0 and sys.dim == 1:
        points = points.reshape(1)
    if points.ndim not in (1, 2) or points.shape[0] != sys.dim:
        turned = transposed(points.shape, sys.dim)
        got = f"got shape {points.shape}{turned}"
        refuse("x0", points, f"{shape} for ({', '.join(sys.state)}), {got}")
    if times.ndim > 1:
        refuse("t0", times, f"expected a number or shape (k,), got shape {times.shape}")
    single = points.ndim == 1 and times.ndim == 0
    if points.ndim == 1:
        points = np.broadcast_to(points[:, None], (sys.dim, times.size))
    count = points.shape[1]
    if times.ndim == 1 and times.size != count:
        refuse("t0", times, f"expected one time or one for each of {count} starts")
    times = np.ascontiguousarray(np.broadcast_to(times, (count,)))
    return times, np.ascontiguousarray(points.T), single


def _finite(name: str, value: ArrayLike, expected: str) -> Floats:
    array = floats(name, value, expected)
    if not np.isfinite(array).all():
        refuse(name, value, expected)
    return array
