# SPDX-License-Identifier: BSD-3-Clause
"""Many trajectories at once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._check import choice, floats, integer, number, refuse
from ._lanes import instruction_set, lanes_of
from ._progress import Progress, ended, shown
from ._simulate import METHOD_NAMES, METHODS, POLICIES, absolute_tolerance
from ._status import Status
from ._system import System
from ._trajectory import Settings
from ._types import Floats

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Ensemble", "LaneStats", "RunSettings", "ensemble", "run_settings"]

STATUS_NAMES = np.array(_core.status_names())


@dataclass(frozen=True)
class LaneStats:
    """What a run in lanes did, counted."""

    trips: int  #: of all loops: each computes a step or a window in every lane
    useful: int  #: lanes in them that had a member
    steps: int  #: trial steps in slip
    searches: int  #: steps in doubt, taken again to look for events
    landings: int  #: steps taken to land on events
    windows: int  #: of slides
    handed_over: int  #: stretches that the scalar engine ran
    width: int  #: lanes in a register

    @property
    def occupancy(self) -> float:
        """Share of the lanes that had a member."""
        return self.useful / (self.trips * self.width) if self.trips else 1.0


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble:
    """Result of `ensemble`, one entry a member: arrays have the shape that the arguments have."""

    y: Floats  #: states at the end, shape (dim, ...); of a failure the last valid ones
    t: Floats  #: time there, shape (...)
    status: NDArray[np.str_]  #: how each member ended: names of `Status`, shape (...)
    mode: NDArray[np.int8]  #: mode at the end: -1, 0 (sliding), +1; of the first surface
    n_events: NDArray[np.int32]  #: changes of mode
    n_slides: NDArray[np.int32]  #: those of them into a slide
    slide_time: Floats  #: time spent in slides
    y0: Floats  #: starts, shape (dim, ...)
    params: Mapping[str, float | Floats]  #: values by name, numbers or arrays of shape (...)
    system: str  #: name of the system
    state: tuple[str, ...]  #: names of the state components
    settings: Settings  #: of every member
    instruction_set: str  #: bits are those of this set
    stats: LaneStats

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the ensemble."""
        return self.status.shape

    @property
    def success(self) -> bool:
        """True if every member reached its end."""
        return bool((self.status == Status.ok.value).all())

    def to_xarray(self) -> xr.Dataset:
        """Give the ensemble as an `xarray.Dataset` with dimensions `state`, `axis_0`, ..."""
        import xarray as xr

        axes = tuple(f"axis_{k}" for k in range(len(self.shape)))
        variables: dict[str, Any] = {
            name: (axes, getattr(self, name))
            for name in ("t", "status", "mode", "n_events", "n_slides", "slide_time")
        }
        variables |= {name: (("state", *axes), getattr(self, name)) for name in ("y", "y0")}
        attrs: dict[str, Any] = {
            "filippov": _core.__version__,
            "system": self.system,
            "instruction_set": self.instruction_set,
        }
        for name, value in self.params.items():
            if np.ndim(value) == 0:
                attrs[name] = value
            else:
                variables[name] = (axes, value)
        return xr.Dataset(variables, {"state": ("state", list(self.state))}, attrs)

    def __repr__(self) -> str:
        ends = Counter(self.status.ravel().tolist())
        failed = ", ".join(f"{count} {word}" for word, count in ends.items() if word != "ok")
        return (
            f"<Ensemble of {self.system}: {self.status.size} members, {failed or 'all ok'}; "
            f"{self.instruction_set}>"
        )


@dataclass(frozen=True)
class RunSettings:
    """Settings of every member, checked, as the compiled core takes them."""

    settings: Settings
    arguments: tuple[bool, float, Floats, float]  #: eighth_order, rtol, atol, max_step
    limits: tuple[int, int, int]  #: max_steps, max_events, on_nonunique


def run_settings(
    sys: System,
    method: str,
    rtol: float,
    atol: ArrayLike,
    max_step: float,
    max_steps: int,
    max_events: int,
    on_nonunique: str,
    first_step: float | None = None,
) -> RunSettings:
    """Check what every run is told."""
    eighth_order = choice("method", method, METHODS)
    tolerance = absolute_tolerance(atol, sys.dim)
    settings = Settings(
        method=METHOD_NAMES[eighth_order],
        rtol=number("rtol", rtol, "expected 0 < rtol < 1", above=0.0, below=1.0),
        atol=tuple(tolerance.tolist()),
        max_step=number("max_step", max_step, "expected a number > 0", above=0.0, infinite=True),
        first_step=first_step,
        max_steps=integer("max_steps", max_steps),
        max_events=integer("max_events", max_events),
        on_nonunique=on_nonunique,
    )
    policy = choice("on_nonunique", on_nonunique, POLICIES)
    return RunSettings(
        settings,
        (bool(eighth_order), settings.rtol, tolerance, settings.max_step),
        (settings.max_steps, settings.max_events, policy),
    )


def escape_bounds(sys: System, escape: ArrayLike | None) -> list[float] | None:
    """Bounds on the size of each component, None if there are none."""
    if escape is None:
        return None
    expected = f"expected a number > 0, or {sys.dim} of them"
    bounds = floats("escape", escape, expected)
    if bounds.shape not in ((), (sys.dim,)) or not (bounds > 0).all():
        refuse("escape", escape, expected)
    return np.broadcast_to(bounds, (sys.dim,)).tolist()  # type: ignore[no-any-return]


def ensemble(
    sys: System,
    x0: ArrayLike,
    t_span: tuple[ArrayLike, ArrayLike],
    *,
    params: Mapping[str, ArrayLike] | None = None,
    method: str = "dop853",
    rtol: float = 1e-8,
    atol: ArrayLike = 1e-10,
    max_step: float = math.inf,
    first_step: float | None = None,
    max_steps: int = 10_000_000,
    max_events: int = 1_000_000,
    on_nonunique: str = "stop",
    escape: ArrayLike | None = None,
    threads: int | None = None,
    progress: Progress = False,
) -> Ensemble:
    """Run many trajectories, each from its own start, over its own times, with its own parameters.

    They run in the lanes of the processor's registers and on all its cores. What comes of a member
    depends neither on the others nor on the number of threads, to the last bit.

    Parameters
    ----------
    sys : System
        The system.
    x0 : array, shape (dim, ...)
        Starts: the first axis is that of the state, the others broadcast with `t_span` and
        `params`.
    t_span : (t0, t_end)
        Numbers or arrays.
    params : mapping, optional
        Parameter values by name, numbers or arrays.
    method : str
        "dop853" (eighth order, the faster one in lanes) or "dopri5".
    rtol, atol, max_step, max_steps, max_events, on_nonunique
        As in `simulate`, for every member.
    first_step : float, optional
        As in `simulate`.
    escape : float or array, shape (dim,), optional
        A member of which a component is larger than this, in size, after a step ends with status
        "escaped".
    threads : int, optional
        At most so many; by default as many as OpenMP takes by itself.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in members, always from
        the calling thread.

    Returns
    -------
    Ensemble
        Only the ends: a member that fails has its own status and spoils no other.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work. A start that is not finite is no such
        argument: its member fails.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `ensemble` has what was finished, and the status
        "interrupted" for the rest.

    Examples
    --------
    >>> import filippov as fp, numpy as np
    >>> y, v = np.meshgrid(np.linspace(-2, 2, 3), np.linspace(-1, 1, 2))
    >>> ends = fp.ensemble(fp.models.oscillator, [y, v], (0.0, 10.0), params={"A": 0.5})
    >>> ends.y.shape, ends.success
    ((2, 2, 3), True)
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    members = _Members(sys, x0, t_span, params)
    if first_step is not None:
        first_step = number("first_step", first_step, "expected a number > 0", above=0.0)
    run = run_settings(
        sys, method, rtol, atol, max_step, max_steps, max_events, on_nonunique, first_step
    )
    bounds = escape_bounds(sys, escape)
    if threads is not None:
        threads = integer("threads", threads)
    with shown(progress, "member") as show:
        columns = _core.ensemble(
            lanes_of(sys),
            members.size,
            *members.rows(),
            bounds,
            *run.arguments,
            first_step or 0.0,
            *run.limits,
            threads or 0,
            show,
        )
    shape = members.shape
    result = Ensemble(
        y=np.ascontiguousarray(columns["x"].T).reshape(sys.dim, *shape),
        t=columns["t"].reshape(shape),
        status=STATUS_NAMES[columns["status"]].reshape(shape),
        mode=columns["mode"].reshape(shape),
        n_events=columns["events"].reshape(shape),
        n_slides=columns["slides"].reshape(shape),
        slide_time=columns["slide_time"].reshape(shape),
        y0=members.starts(),
        params=members.params,
        system=sys.name,
        state=sys.state,
        settings=run.settings,
        instruction_set=instruction_set(),
        stats=LaneStats(**columns["counters"]),
    )
    ended(columns["raised"], ensemble=result)
    return result


class _Members:
    """Starts, times and parameters, broadcast with each other."""

    def __init__(
        self,
        sys: System,
        x0: ArrayLike,
        t_span: tuple[ArrayLike, ArrayLike],
        params: Mapping[str, ArrayLike] | None,
    ) -> None:
        expected = f"expected an array of shape ({sys.dim}, ...): {', '.join(sys.state)}"
        self.x0 = floats("x0", x0, expected)
        if self.x0.ndim < 1 or self.x0.shape[0] != sys.dim:
            refuse("x0", x0, f"{expected}, got shape {self.x0.shape}")
        try:
            t0, t_end = t_span
        except (TypeError, ValueError):
            refuse("t_span", t_span, "expected (t0, t_end)")
        finite = "expected finite numbers"
        self.t0 = floats("t_span[0]", t0, finite)
        self.t_end = floats("t_span[1]", t_end, finite)
        if not (np.isfinite(self.t0).all() and np.isfinite(self.t_end).all()):
            refuse("t_span", t_span, finite)
        given = {
            name: floats(f"params[{name!r}]", value, "expected a number or an array")
            for name, value in (params or {}).items()
        }
        numbers = sys._merged({name: float(v) for name, v in given.items() if v.ndim == 0})
        for name in given:
            if name not in numbers:
                refuse("params", name, sys._unknown(name))
        self.params: dict[str, float | Floats] = dict(numbers)
        self.params |= {name: value for name, value in given.items() if value.ndim > 0}
        arrays = [np.asarray(value) for value in self.params.values()]
        try:
            self.shape = np.broadcast_shapes(
                self.x0.shape[1:], self.t0.shape, self.t_end.shape, *(a.shape for a in arrays)
            )
        except ValueError as error:
            raise ValueError(f"x0, t_span, params: {error}") from None
        self.size = math.prod(self.shape)

    def rows(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Give starts, parameters and times, a row a member, or one for all."""
        values = list(self.params.values())
        if all(np.ndim(value) == 0 for value in values):
            table = np.array([values], dtype=np.float64)
        else:
            each = [np.broadcast_to(value, self.shape).ravel() for value in values]
            table = np.stack(each, axis=-1)
        return (
            self._rows(self.x0),
            table,
            self._column(self.t0),
            self._column(self.t_end),
        )

    def starts(self) -> Floats:
        """Give the starts of all members."""
        dim = self.x0.shape[0]
        return np.stack([np.broadcast_to(self.x0[k], self.shape) for k in range(dim)])

    def _rows(self, x: Floats) -> Floats:
        if x.ndim == 1:
            return np.ascontiguousarray(x[np.newaxis, :])
        return np.ascontiguousarray(self.starts().reshape(x.shape[0], -1).T)

    def _column(self, t: Floats) -> Floats:
        return t.reshape(1) if t.ndim == 0 else np.broadcast_to(t, self.shape).ravel().copy()
