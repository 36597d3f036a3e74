# SPDX-License-Identifier: BSD-3-Clause
"""The transition map of a forced planar system, its iterates and their fixed points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.settings import analysis_settings
from filippov._results.store import Stored
from filippov._support.check import MOST, floats, integer, number, refuse, vector
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import codes, complete, ordered, record, require, shaped
from filippov._support.status import Status
from filippov._support.types import Bools, FloatOrArray, Floats, Record
from filippov._system.system import Params, System

from .geometry import ONE_SWITCHING, one_switching

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["EventMap", "FixedPoint", "event_map"]

_BREAK = np.dtype(
    [
        ("boundary", np.int8),
        ("phase", np.float64),
        ("left", np.float64),
        ("right", np.float64),
        ("left_boundary", np.int8),
        ("right_boundary", np.int8),
        ("left_slope", np.float64),
        ("right_slope", np.float64),
        ("jump", np.bool_),
    ]
)


@dataclass(frozen=True)
class FixedPoint:
    """A point of a periodic orbit: the iterate of the map leads back to it."""

    phase: float  #: omega t at the transition, in [0, 2 pi)
    boundary: int  #: s there, -1 or +1
    slope: float  #: of the iterate: the Floquet multiplier that is not 0
    stable: bool  #: |slope| < 1
    iterate: int  #: of the map
    prime: int  #: the least number of iterates that leads back
    turns: int  #: forcing periods of the iterate
    tangent: bool  #: a double root, where two fixed points are born
    t: float  #: time of the transition, in [0, T)
    x: tuple[float, ...]  #: state there


@dataclass(frozen=True)
class MapSettings:
    """How a map is computed."""

    rtol: float
    atol: float
    max_periods: float
    guess: tuple[float, ...] | None

    def _verify(self) -> None:
        number("rtol", self.rtol, above=0.0, below=1.0)
        number("atol", self.atol, above=0.0)
        number("max_periods", self.max_periods, above=0.0)
        if self.guess is not None:
            vector("guess", self.guess, 2)


@dataclass(frozen=True, eq=False, repr=False)
class EventMap(Stored):
    """Graph of an iterate of the transition map, from stick-to-slip to the next stick-to-slip.

    The map acts on (boundary, phase): where |s| reaches 1 at s = boundary, and when within the
    forcing. Samples are ordered by boundary, then phase, and lie densely where the map bends.
    """

    iterate: int  #: how often the map is applied
    phase: Floats  #: of the samples, shape (k,)
    boundary: NDArray[np.int8]  #: of the samples, -1 or +1
    value: Floats  #: phase where the map leads; NaN where it is not defined
    value_boundary: NDArray[np.int8]  #: boundary there; 0 where it is not defined
    slope: Floats  #: derivative of `value`; NaN also at a tangency
    turns: NDArray[np.int64]  #: how often the phase passed 2 pi on the way
    true_exit: Bools  #: the slide ends there; else the map starts with the rest of the slide
    word: tuple[str, ...]  #: modes on the way of each sample, a bar between iterates
    defined: Bools  #: where the map is defined
    reason: tuple[Status, ...]  #: for each sample: ok, or why the map is not defined
    breakpoints: Record  #: where the map or its slope jumps, with the values on both sides
    status: Status  #: ok, or what is wrong with the graph as a whole
    message: str  #: the same in words
    evaluations: int  #: of the iterate
    system: System
    params: Params
    _points: tuple[FixedPoint, ...]
    _settings: MapSettings

    _parts = (FixedPoint, MapSettings)

    def _verify(self) -> None:
        complete(self.params, self.system.params)
        require((self.system.dim, self.system.surfaces) == (2, 1), f"system is {self.system.name}")
        n = self.phase.size
        columns = "phase boundary value value_boundary slope turns true_exit defined"
        shaped((n,), **{name: getattr(self, name) for name in columns.split()})
        require(len(self.word) == len(self.reason) == n, "word and reason are of other samples")
        require(self.iterate > 0, f"iterate is {self.iterate}")
        codes(-1, 2, boundary=self.boundary, value_boundary=self.value_boundary)
        require((self.boundary != 0).all(), "boundary has 0, expected -1 or +1")
        for side in (-1, 1):
            ordered("phase", self.phase[self.boundary == side])
        ok = [reason is Status.ok for reason in self.reason]
        require((self.defined == ok).all(), "defined is not where reason is ok")
        record("breakpoints", self.breakpoints, _BREAK)

    @property
    def success(self) -> bool:
        """Whether the graph is complete."""
        return self.status == Status.ok

    def __repr__(self) -> str:
        return (
            f"<EventMap of {self.system.name}, iterate {self.iterate}: {self.phase.size} samples, "
            f"{len(self.breakpoints)} breaks, {len(self._points)} fixed points; {self.status}>"
        )

    def fixed_points(self) -> list[FixedPoint]:
        """All fixed points of the iterate: the points of its periodic orbits, by phase."""
        return list(self._points)

    def __call__(self, phase: ArrayLike, boundary: ArrayLike = -1) -> FloatOrArray:
        """Evaluate the map.

        Parameters
        ----------
        phase : float or array
            Phases, any real numbers.
        boundary : int or array
            -1 or +1; broadcast against `phase`.

        Returns
        -------
        float or array
            Phases in [0, 2 pi); NaN where the map is not defined.
        """
        phases = _floats("phase", phase)
        sides = floats("boundary", boundary, "expected -1 or +1")
        if not np.isin(sides, (-1, 1)).all():
            refuse("boundary", boundary, "expected -1 or +1")
        at, on = np.broadcast_arrays(phases, sides)
        images, _ = self._images(at, on)
        value: FloatOrArray = images.reshape(at.shape)[()]
        return value

    def _images(self, phase: Floats, boundary: NDArray[Any]) -> tuple[Floats, NDArray[np.int8]]:
        """Phases and boundaries where the map leads, both flat."""
        s = self._settings
        out = _core.map_images(
            self.system._model,
            np.array(list(self.params.values()), dtype=np.float64),
            analysis_settings(s.rtol, s.atol),
            s.max_periods,
            None if s.guess is None else np.array(s.guess),
            self.iterate,
            np.ascontiguousarray(boundary, dtype=np.int32).reshape(-1),
            np.ascontiguousarray(phase).reshape(-1),
        )
        ended(out.raised)
        return out.samples.value, out.samples.value_boundary

    def plot(
        self,
        ax: Axes | None = None,
        *,
        boundary: int | None = None,
        cobweb: float | None = None,
        iterations: int = 30,
        **artist_kw: Any,
    ) -> list[Artist]:
        """Draw the graph with the diagonal and the fixed points, and a cobweb.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            The current ones by default.
        boundary : int, optional
            The circle to draw, -1 or +1; by default those that orbits return to.
        cobweb : float, optional
            Phase, on the circle drawn first, from which iterates are drawn as a staircase between
            graph and diagonal; it goes on the circle that an iterate comes to.
        iterations : int
            How many.
        **artist_kw
            For the curves, for instance `color`.

        Returns
        -------
        list of artists
        """
        from filippov._plot.plot import plot_event_map

        return plot_event_map(self, ax, boundary, cobweb, iterations, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the samples as an `xarray.Dataset` over the dimension `sample`."""
        columns = ("value", "value_boundary", "slope", "turns", "true_exit", "defined")
        variables: dict[str, Any] = {name: ("sample", getattr(self, name)) for name in columns}
        for name in ("word", "reason"):
            each = [str(v) for v in getattr(self, name)]
            variables[name] = ("sample", np.array(each, dtype=np.str_))
        coords = {name: ("sample", getattr(self, name)) for name in ("phase", "boundary")}
        return dataset(self, variables, coords)


def event_map(
    sys: System,
    *,
    iterate: int = 1,
    params: Mapping[str, float] | None = None,
    samples: int = 512,
    rtol: float = 1e-12,
    atol: float = 1e-13,
    max_periods: float = 50.0,
    guess: ArrayLike | None = None,
    max_evaluations: int = 500_000,
    progress: Progress = False,
) -> EventMap:
    """Compute the transition map P_trans of a forced planar system, or an iterate of it.

    From one stick-to-slip transition to the next (chapter, section 4.5). Slopes come from
    derivatives through all events. The graph is sampled until cubics describe it, breaks are
    bisected to 1e-13, and every piece is searched for fixed points.

    Parameters
    ----------
    sys : System
        With two state components, one surface and a period.
    iterate : int
        How often the map is applied. Its fixed points are the orbits of that many transitions,
        however many forcing periods they take.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    samples : int
        Samples on each circle to begin with, at least 8. Two breaks within one interval and one
        word can be missed.
    rtol, atol : float
        Tolerances of the flow.
    max_periods : float
        Forcing periods to wait for the next transition; the map is not defined where none comes.
    guess : array, shape (2,), optional
        A state near the ends of slides at phase 0, where Newton's iteration starts.
    max_evaluations : int
        Bound on the work, in evaluations; one that passes more than a few modes, as where no
        stick comes within `max_periods`, counts as several.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in intervals of the first
        samples, always from the calling thread.

    Returns
    -------
    EventMap
        `status` says if the graph is complete; `escaped` if there is no stick to return to.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a fraction of a second of Ctrl-C; its attribute `event_map` has what was finished.
    """
    expected = "expected a forced planar System with"
    if not isinstance(sys, System):
        refuse("sys", sys, f"{expected} {ONE_SWITCHING}", TypeError)
    if sys.dim != 2 or sys.kinds != ("switching",) or "period" not in sys.capabilities:
        refuse("sys", sys.name, f"{expected} {one_switching(sys)}")
    if "s_max" in sys.capabilities:
        refuse("sys", sys.name, "expected a system without static friction")
    iterate = integer("iterate", iterate)
    values = sys._merged(params)
    sys._forced(values)
    samples = integer("samples", samples)
    if not 8 <= samples <= 1_000_000:
        refuse("samples", samples, "expected an integer from 8 to 1000000")
    if iterate > 1_000_000:
        refuse("iterate", iterate, "expected an integer from 1 to 1000000")
    start = None if guess is None else vector("guess", guess, sys.dim, sys.state)
    told = analysis_settings(rtol, atol)
    settings = MapSettings(
        rtol=told.rtol,
        atol=told.atol[0],
        max_periods=number(
            "max_periods", max_periods, "expected 0 < max_periods < 1e9", above=0.0, below=1e9
        ),
        guess=None if start is None else tuple(start.tolist()),
    )
    most = integer("max_evaluations", max_evaluations, most=MOST)
    with shown(progress, "interval") as show:
        run = _core.map_graph(
            sys._model,
            np.array(list(values.values()), dtype=np.float64),
            told,
            settings.max_periods,
            start,
            iterate,
            samples,
            most,
            show,
        )
    graph = _event_map(run, iterate, sys, values, settings)
    ended(run.raised, event_map=graph)
    return graph


def _event_map(
    run: _core.MapGraphResult, iterate: int, sys: System, params: Params, settings: MapSettings
) -> EventMap:
    s = run.samples
    reasons = [Status(name) for name in _core.status_names()]
    reason = tuple(reasons[code] for code in s.status.tolist())
    points = tuple(
        FixedPoint(
            phase=point.phase,
            boundary=point.boundary,
            slope=point.slope,
            stable=point.stable,
            iterate=point.iterate,
            prime=point.prime,
            turns=point.turns,
            tangent=point.tangent,
            t=point.t,
            x=tuple(point.x),
        )
        for point in sorted(run.points, key=lambda point: (point.boundary, point.phase))
    )
    return EventMap(
        iterate=iterate,
        phase=s.phase,
        boundary=s.boundary,
        value=s.value,
        value_boundary=s.value_boundary,
        slope=s.slope,
        turns=s.turns,
        true_exit=s.true_exit.astype(np.bool_),
        word=tuple(s.word),
        defined=np.array([each == Status.ok for each in reason], dtype=np.bool_),
        reason=reason,
        breakpoints=_breakpoints(run),
        status=Status(run.status),
        message=run.message,
        evaluations=run.evaluations,
        system=sys,
        params=params,
        _points=points,
        _settings=settings,
    )


def _breakpoints(run: _core.MapGraphResult) -> Record:
    left, right, jump = run.left, run.right, run.jump
    breaks = np.empty(len(jump), dtype=_BREAK)
    breaks["boundary"] = left.boundary
    breaks["phase"] = (left.phase + right.phase) / 2
    breaks["jump"] = jump
    for name, side in (("left", left), ("right", right)):
        breaks[name] = side.value
        breaks[f"{name}_boundary"] = side.value_boundary
        breaks[f"{name}_slope"] = side.slope
    return breaks


def _floats(name: str, value: ArrayLike) -> Floats:
    expected = "expected finite numbers"
    array = floats(name, value, expected)
    if not np.isfinite(array).all():
        refuse(name, value, expected)
    return array
