# SPDX-License-Identifier: BSD-3-Clause
"""Many trajectories at once."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.event import modes_of
from filippov._results.settings import Settings, lane_settings
from filippov._results.store import Stored
from filippov._results.tiles import Arrays, Show, Stage, open_store, run_stage
from filippov._support.check import (
    floats,
    integer,
    mapping,
    refuse,
    start_first,
    transposed,
    two,
)
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import STATUSES, codes, complete, known, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import System

from .lanes import lanes_in_a_register, lanes_of, level_of, require_level

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Ensemble", "LaneStats", "ensemble"]

STATUS_NAMES = np.array(_core.status_names())
INTERRUPTED = list(STATUS_NAMES).index(Status.interrupted.value)


@dataclass(frozen=True)
class LaneStats:
    """What a run in lanes did, counted."""

    trips: int  #: of all loops: each computes a step or a window in every lane
    useful: int  #: lanes in them that had a member
    steps: int  #: trial steps in slip
    searches: int  #: steps in doubt, taken again to look for events
    landings: int  #: steps taken to land on events
    windows: int  #: of slides, and trial steps along those without a closed form
    handed_over: int  #: stretches that the scalar engine ran
    width: int  #: lanes in a register

    def _verify(self) -> None:
        require(min(astuple(self)) >= 0 and self.width > 0, f"{self}: expected counts")

    @property
    def occupancy(self) -> float:
        """Share of the lanes that had a member."""
        return self.useful / (self.trips * self.width) if self.trips else 1.0

    @classmethod
    def of(cls, sums: Mapping[str, int]) -> LaneStats:
        """From sums over tiles."""
        return cls(**{name: sums[name] for name in COUNTS}, width=lanes_in_a_register())


#: What is summed over tiles.
COUNTS = tuple(field.name for field in fields(LaneStats) if field.name != "width")


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Stored):
    """Result of `ensemble`, one entry a member: arrays have the shape that the arguments have."""

    y: Floats  #: states at the end, shape (dim, ...); of a failure the last valid ones
    t: Floats  #: time there, shape (...)
    status: NDArray[np.str_]  #: how each member ended: names of `Status`, shape (...)
    #: mode at the end: -1, 0 (sliding), +1, shape (...); for several surfaces (surfaces, ...)
    mode: NDArray[np.int8]
    n_events: NDArray[np.int32]  #: changes of mode
    n_slides: NDArray[np.int32]  #: those of them into a slide
    slide_time: Floats  #: time spent in slides
    y0: Floats  #: starts, shape (dim, ...)
    params: Mapping[str, float | Floats]  #: values by name, numbers or arrays of shape (...)
    system: System  #: of what
    state: tuple[str, ...]  #: names of the state components
    settings: Settings  #: of every member
    instruction_set: str  #: bits are those of this set
    stats: LaneStats

    _parts = (Settings, LaneStats)

    def _verify(self) -> None:
        self.settings._verify_lanes()
        dim, surfaces, shape = self.system.dim, self.system.surfaces, self.shape
        complete(self.params, self.system.params)
        require(self.state == self.system.state, f"state is {self.state}")
        require(len(self.settings.atol) == dim, f"atol has {len(self.settings.atol)} entries")
        known(STATUSES, status=self.status)
        columns = ("t", "n_events", "n_slides", "slide_time")
        shaped(shape, **{name: getattr(self, name) for name in columns})
        shaped((dim, *shape), y=self.y, y0=self.y0)
        shaped(shape if surfaces == 1 else (surfaces, *shape), mode=self.mode)
        codes(-1, 2, mode=self.mode)
        for name, value in self.params.items():
            require(
                np.broadcast_shapes(np.shape(value), shape) == shape, f"params[{name!r}] differs"
            )

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
        axes = tuple(f"axis_{k}" for k in range(len(self.shape)))
        variables: dict[str, Any] = {
            name: (axes, getattr(self, name))
            for name in ("t", "status", "n_events", "n_slides", "slide_time")
        }
        several = self.mode.ndim > len(axes)
        variables["mode"] = (("surface", *axes) if several else axes, self.mode)
        variables |= {name: (("state", *axes), getattr(self, name)) for name in ("y", "y0")}
        attrs: dict[str, Any] = {}
        for name, value in self.params.items():
            if np.ndim(value) == 0:
                attrs[name] = value
            else:
                variables[name] = (axes, np.broadcast_to(value, self.shape))
        return dataset(self, variables, {"state": ("state", list(self.state))}, attrs)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        x: str | None = None,
        y: str | None = None,
        **artist_kw: Any,
    ) -> list[Artist]:
        """Draw where the members end, in the colour of the mode they end in.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        x, y : str, optional
            State components, parameters that differ between members, or "t"; by default the first
            two components, of one component the member's parameter or start.
        **artist_kw
            For the points.

        Returns
        -------
        list of artists
            A set of points for each mode, then crosses for members that failed.
        """
        from filippov._plot.plot import plot_ensemble

        return plot_ensemble(self, ax, x, y, artist_kw)

    def __repr__(self) -> str:
        ends = Counter(self.status.ravel().tolist())
        failed = ", ".join(f"{count} {word}" for word, count in ends.items() if word != "ok")
        return (
            f"<Ensemble of {self.system.name}: {self.status.size} members, {failed or 'all ok'}; "
            f"{self.instruction_set}>"
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
    store: str | os.PathLike[str] | None = None,
    tile: int | None = None,
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
        `params`. Of no starts, shape (dim, 0), comes an ensemble without members.
    t_span : (t0, t_end)
        Numbers or arrays.
    params : mapping, optional
        Parameter values by name, numbers or arrays.
    method : str
        "dop853" (eighth order, the faster one in lanes) or "dopri5".
    rtol, atol, max_step, first_step, max_steps, max_events, on_nonunique
        As in `simulate`, for every member.
    escape : float or array, shape (dim,), optional
        A member of which a component is larger than this, in size, ends with status "escaped":
        looked at after steps in lanes, else where its run ends.
    threads : int, optional
        At most so many; by default as many as OpenMP takes by itself.
    store : path, optional
        A directory in Zarr's format, written tile by tile. If it is there, what is complete in it
        is taken from it; a store made by other equations, starts or settings is refused. Needs
        the extra `store`.
    tile : int, optional
        Members of a tile, which is written, or sent to a cluster, as a whole; by default 65,536.
        With a Dask client in scope its workers run the tiles. No bit depends on it.
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
    settings = lane_settings(
        sys.dim, method, rtol, atol, max_step, max_steps, max_events, on_nonunique, first_step
    )
    bounds = escape_bounds(sys, escape)
    threads, tile = counts(threads=threads, tile=tile)
    shared, each = members.rows()
    level = level_of(sys)
    work = EnsembleWork(sys, bounds, settings, threads or 0, level, shared)
    outputs: Arrays = {
        "y": np.full((members.size, sys.dim), np.nan),
        "t": np.full(members.size, np.nan),
        "status": np.full(members.size, INTERRUPTED, dtype=np.int8),
        "mode": np.zeros(members.size, dtype=np.int16),
        "n_events": np.zeros(members.size, dtype=np.int32),
        "n_slides": np.zeros(members.size, dtype=np.int32),
        "slide_time": np.zeros(members.size),
    }
    dims = dict.fromkeys(outputs, ("member",)) | {"y": ("member", "state")}
    stage = Stage("members", work, outputs, COUNTS, each, dims)

    def identity() -> dict[str, Any]:
        return run_identity(sys, settings, bounds) | {
            "shape": list(members.shape),
            "members": fingerprint(shared | each),
        }

    kept, tiling = open_store(store, "ensemble", identity, members.size, 1, tile)
    with shown(progress, "member") as show:
        columns, sums, raised = run_stage(stage, tiling, kept, show)
    shape = members.shape
    modes = modes_of(columns["mode"].reshape(shape), sys.surfaces)
    result = Ensemble(
        y=np.ascontiguousarray(columns["y"].T).reshape(sys.dim, *shape),
        t=columns["t"].reshape(shape),
        status=STATUS_NAMES[columns["status"]].reshape(shape),
        mode=modes[0] if sys.surfaces == 1 else modes,
        n_events=columns["n_events"].reshape(shape),
        n_slides=columns["n_slides"].reshape(shape),
        slide_time=columns["slide_time"].reshape(shape),
        y0=members.starts(),
        params=members.params,
        system=sys,
        state=sys.state,
        settings=settings,
        instruction_set=level_of(sys),
        stats=LaneStats.of(sums),
    )
    ended(raised, ensemble=result)
    return result


@dataclass(frozen=True)
class EnsembleWork:
    """Runs members, here or elsewhere."""

    sys: System
    bounds: list[float] | None
    settings: Settings
    threads: int
    level: str  #: instruction set
    shared: Arrays  #: what of "x0", "params", "t0" and "t_end" is the same for all, in one row

    def __call__(self, first: int, count: int, inputs: Arrays, show: Show) -> Mapping[str, Any]:
        """Give the columns of an ensemble."""
        del first
        require_level(self.sys, self.level)
        given = self.shared | inputs
        found = _core.ensemble(
            lanes_of(self.sys),
            count,
            given["x0"],
            given["params"],
            given["t0"],
            given["t_end"],
            self.bounds,
            self.settings._told(),
            self.threads,
            show,
        )
        return {
            "y": found.x,
            "t": found.t,
            "status": found.status,
            "mode": found.mode,
            "n_events": found.events,
            "n_slides": found.slides,
            "slide_time": found.slide_time,
            **found.counters,
            "raised": found.raised,
        }


def fingerprint(arrays: Arrays) -> str:
    """Give a hash of arrays with their names and shapes."""
    import hashlib

    digest = hashlib.sha256()
    for name, rows in sorted(arrays.items()):
        digest.update(f"{name} {rows.shape} ".encode())
        digest.update(np.ascontiguousarray(rows).tobytes())
    return digest.hexdigest()


def run_identity(sys: System, settings: Settings, bounds: list[float] | None) -> dict[str, Any]:
    """All that determines what comes of a start, as JSON can hold it."""
    return {
        "system": sys._identity(),
        "settings": asdict(settings) | {"atol": list(settings.atol)},
        "escape": bounds,
        "instruction_set": level_of(sys),
    }


def counts(**given: int | None) -> list[int | None]:
    """Check numbers that may be left out."""
    return [None if n is None else integer(name, n) for name, n in given.items()]


class _Members:
    """Starts, times and parameters, broadcast with each other."""

    def __init__(
        self,
        sys: System,
        x0: ArrayLike,
        t_span: tuple[ArrayLike, ArrayLike],
        params: Mapping[str, ArrayLike] | None,
    ) -> None:
        start_first("ensemble", x0, t_span, sys.dim)
        expected = f"expected an array of shape ({sys.dim}, ...): {', '.join(sys.state)}"
        self.x0 = floats("x0", x0, expected)
        if self.x0.ndim < 1 or self.x0.shape[0] != sys.dim:
            turned = transposed(self.x0.shape, sys.dim)
            refuse("x0", x0, f"{expected}, got shape {self.x0.shape}{turned}")
        t0, t_end = two("t_span", t_span, "expected (t0, t_end)")
        finite = "expected finite numbers"
        self.t0 = floats("t_span[0]", t0, finite)
        self.t_end = floats("t_span[1]", t_end, finite)
        if not (np.isfinite(self.t0).all() and np.isfinite(self.t_end).all()):
            refuse("t_span", t_span, finite)
        given = {
            name: floats(f"params[{name!r}]", value, "expected a number or an array")
            for name, value in mapping(
                "params", params, "expected a mapping of names to numbers or arrays"
            ).items()
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
            expected = "expected shapes that broadcast with each other"
            raise ValueError(f"x0, t_span, params: {error} ({expected})") from None
        self.size = math.prod(self.shape)
        for member in (0, -1) if self.size else ():
            sys._require_period(
                {
                    name: float(np.broadcast_to(value, self.shape).flat[member])
                    for name, value in self.params.items()
                }
            )

    def rows(self) -> tuple[Arrays, Arrays]:
        """Give starts, parameters and times: those that all share, and those with a row a member.

        Shared parameters are worth knowing: lanes then hold them once.
        """
        shared: Arrays = {}
        each: Arrays = {}
        values = list(self.params.values())
        if all(np.ndim(value) == 0 for value in values):
            shared["params"] = np.array([values], dtype=np.float64)
        else:
            columns = [np.broadcast_to(value, self.shape).ravel() for value in values]
            each["params"] = np.stack(columns, axis=-1)
        if self.x0.ndim == 1:
            shared["x0"] = np.ascontiguousarray(self.x0[np.newaxis, :])
        else:
            each["x0"] = np.ascontiguousarray(self.starts().reshape(self.x0.shape[0], -1).T)
        for name, t in (("t0", self.t0), ("t_end", self.t_end)):
            if t.ndim == 0:
                shared[name] = t.reshape(1)
            else:
                each[name] = np.broadcast_to(t, self.shape).ravel().copy()
        return shared, each

    def starts(self) -> Floats:
        """Give the starts of all members."""
        dim = self.x0.shape[0]
        return np.stack([np.broadcast_to(self.x0[k], self.shape) for k in range(dim)])
