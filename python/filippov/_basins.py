# SPDX-License-Identifier: BSD-3-Clause
"""Basins of attraction, every cell labelled by its own trajectory."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._cells import CellGroup, Grid, GridArgument, Integers, picture_of, unpack_cell_map
from ._check import flag, integer, number
from ._ensemble import STATUS_NAMES, LaneStats, escape_bounds, run_settings
from ._lanes import instruction_set, lanes_of
from ._progress import Progress, ended, shown
from ._system import Params, System
from ._trajectory import Settings
from ._types import Floats

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Attractor", "Basins", "GroupCheck", "Saddle", "basins"]


@dataclass(frozen=True, eq=False)
class Saddle:
    """An unstable cycle of the strobe map."""

    points: Floats  #: states when the strobe flashes, shape (dim, period)
    multipliers: NDArray[np.complex128]  #: of the whole cycle, largest first
    residual: float  #: by how much it misses itself, in units of the picture

    @property
    def period(self) -> int:
        """Forcing periods of the cycle."""
        return int(self.points.shape[1])


@dataclass(frozen=True, eq=False)
class Attractor:
    """What trajectories end on."""

    periodic: bool  #: a cycle of the strobe map, exact; else `points` are some of its points
    points: Floats  #: states when the strobe flashes, shape (dim, period)
    multipliers: NDArray[
        np.complex128
    ]  #: of the whole cycle, largest first; empty if there is none
    residual: float  #: by how much the cycle misses itself, in units of the picture
    #: of the ellipsoids around its points that the map was seen to draw together, in the norm of
    #: the linear map and units of the picture
    radius: float

    @property
    def period(self) -> int | None:
        """Forcing periods of the cycle, None if there is none."""
        return int(self.points.shape[1]) if self.periodic else None


@dataclass(frozen=True, eq=False)
class GroupCheck:
    """What plain cell mapping makes of a group of cells, beside the labels."""

    group: int  #: index of the group, -1 for the outside, -2 for the unknown
    attractor: int  #: that it stands for, from 1; 0: none, the group is spurious
    #: cells that it takes, by label: escaped, unresolved, 1, 2, ...
    cells: NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class Basins:
    """Result of `basins`, one entry a cell: arrays have the shape of the grid."""

    label: Integers  #: 1, 2, ... the attractor, 0 unresolved, -1 escaped
    #: number of the flash, from 0, at which it had landed, -1 where it did not, or is not known
    time: Integers
    status: NDArray[np.str_]  #: how each run ended: names of `Status`
    attractors: tuple[Attractor, ...]  #: by period, then by their first point
    saddles: tuple[Saddle, ...]  #: unstable cycles that were found
    plain_group: Integers  #: what simple cell mapping makes of the same cells: index of the group
    plain_steps: Integers  #: maps until that group
    plain_groups: tuple[CellGroup, ...]
    confusion: tuple[GroupCheck, ...]  #: the plain map beside the labels
    by_exit: bool  #: cells were labelled by their next exit from stick to slip
    by_exit_reason: str  #: why, or why not
    looked_up: int  #: how many
    audited: int  #: cells, drawn at random, that were followed on to the attractor itself
    disagreements: int  #: those of them that did not come to the one of their label
    periods: int  #: forcing periods of all trajectories of the labelling
    grid: Grid
    system: str
    params: Params
    rest: Floats  #: state, of which two components are those of the grid
    t0: float
    period: float  #: of the forcing
    distance: float  #: below which a trajectory had landed, 0: within the ellipsoid
    settings: Settings
    instruction_set: str
    stats: LaneStats

    @property
    def unresolved(self) -> NDArray[np.int64]:
        """Indices of the cells without a label, shape (k, 2)."""
        return np.argwhere(self.label == 0)

    @property
    def fractions(self) -> dict[int, float]:
        """Share of the cells, by label."""
        labels, counts = np.unique(self.label, return_counts=True)
        return {
            int(label): float(n) / self.label.size for label, n in zip(labels, counts, strict=True)
        }

    def plot(
        self, ax: Axes | None = None, *, what: str = "label", **artist_kw: Any
    ) -> list[Artist]:
        """Draw the basins with attractors and saddles, or the times.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        what : str
            "label", "time" (with a scale), or "plain": the basins of simple cell mapping.
        **artist_kw
            For the image.

        Returns
        -------
        list of artists
            The image, then attractors and saddles.
        """
        from ._plot_basins import plot_basins

        return plot_basins(self, ax, what, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the picture as an `xarray.Dataset` over the two components of the grid."""
        import xarray as xr

        names = self.grid.names
        variables: dict[str, Any] = {
            name: (names, getattr(self, name))
            for name in ("label", "time", "status", "plain_group", "plain_steps")
        }
        coords = {name: self.grid.centres(k) for k, name in enumerate(names)}
        attrs: dict[str, Any] = {
            "filippov": _core.__version__,
            "system": self.system,
            "instruction_set": self.instruction_set,
            "t0": self.t0,
            "distance": self.distance,
            "method": self.settings.method,
            "rtol": self.settings.rtol,
            "atol": list(self.settings.atol),
        }
        return xr.Dataset(variables, coords, attrs | dict(self.params))

    def __repr__(self) -> str:
        shares = ", ".join(f"{label}: {share:.1%}" for label, share in self.fractions.items())
        return (
            f"<Basins of {self.system}, {self.grid.shape[0]} x {self.grid.shape[1]} cells: "
            f"{len(self.attractors)} attractors, {len(self.saddles)} saddles; {shares}>"
        )


def basins(
    sys: System,
    grid: GridArgument,
    *,
    params: Mapping[str, float] | None = None,
    rest: Mapping[str, float] | None = None,
    t0: float = 0.0,
    distance: float = 0.0,
    times: bool = True,
    max_periods: int = 10_000,
    seeds: int = 256,
    settle: int = 200,
    longest: int = 64,
    saddle_starts: int = 144,
    audit: int = 500,
    seed: int = 1,
    method: str = "dop853",
    rtol: float = 1e-8,
    atol: ArrayLike = 1e-10,
    max_step: float = math.inf,
    max_steps: int = 100_000_000,
    max_events: int = 10_000_000,
    on_nonunique: str = "stop",
    escape: ArrayLike | None = None,
    threads: int | None = None,
    progress: Progress = False,
) -> Basins:
    """Label every cell of a grid with the attractor that its centre goes to.

    Attractors are found without prior knowledge: from groups of simple cell mapping and from random
    cells. Cycles are refined by Newton with exact derivatives, merged, and fenced in by ellipsoids
    that the map is seen to draw together. Then every centre is followed until it is inside one.

    Parameters
    ----------
    sys : System
        With one surface and a period.
    grid : mapping
        Two components of the state: `{"y": (-4, 4, 500), "v": (-3, 4, 500)}`, low, high and the
        number of cells. The first is the first axis of the arrays.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    rest : mapping, optional
        Values of the other components of the state; 0 where nothing is said.
    t0 : float
        Time of the start, at which the strobe flashes.
    distance : float
        A trajectory has landed when it is nearer than this to the attractor, in units of the
        picture; 0: when it has entered its ellipsoid, which costs least.
    times : bool
        False: `time` is not wanted. Then a cell of a planar system is followed to its next exit
        from stick to slip only, which is looked up in the basins of the transition map.
    max_periods : int
        Forcing periods to wait for that.
    seeds, settle, longest : int
        Random cells that are followed to find attractors, the forcing periods before a cycle is
        looked for, and those of the longest one.
    saddle_starts : int
        Cells from which Newton looks for saddles.
    audit : int
        Random cells that are followed on to the attractor itself, as a check.
    seed : int
        Of the random cells.
    method, rtol, atol, max_step, max_steps, max_events, on_nonunique, escape, threads
        As in `ensemble`, for every cell.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in cells.

    Returns
    -------
    Basins

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `basins` has what was finished.

    Warns
    -----
    UserWarning
        If a line of the grid lies on a switching surface.

    Notes
    -----
    Chapter, section 4.7 and figure 4.15, which plain cell mapping gets wrong: see `confusion`.
    """
    picture = picture_of(sys, grid, rest, t0, params)
    run = run_settings(sys, method, rtol, atol, max_step, max_steps, max_events, on_nonunique)
    bounds = escape_bounds(sys, escape)
    distance = number("distance", distance, "expected 0 <= distance < 1", least=0.0, below=1.0)
    if threads is not None:
        threads = integer("threads", threads)
    cells = picture.grid
    with shown(progress, "cell") as show:
        columns = _core.basins(
            sys._model,
            lanes_of(sys),
            cells.axes,
            np.array(list(picture.params.values()), dtype=np.float64),
            picture.rest,
            picture.t0,
            integer("seeds", seeds),
            integer("settle", settle),
            integer("longest", longest),
            integer("saddle_starts", saddle_starts, 0),
            integer("max_periods", max_periods),
            distance,
            flag("times", times),
            integer("audit", audit, 0),
            integer("seed", seed, 0),
            bounds or [],
            *run.arguments,
            *run.limits,
            threads or 0,
            show,
        )
    shape = cells.shape
    plain = unpack_cell_map(columns["plain"], shape)
    result = Basins(
        label=columns["label"].reshape(shape),
        time=columns["time"].reshape(shape),
        status=STATUS_NAMES[columns["status"]].reshape(shape),
        attractors=tuple(_attractor(a) for a in columns["attractors"]),
        saddles=tuple(_saddle(s) for s in columns["saddles"]),
        plain_group=plain["group"],
        plain_steps=plain["steps"],
        plain_groups=plain["groups"],
        confusion=tuple(
            GroupCheck(group, attractor, np.array(counts, dtype=np.int64))
            for group, attractor, counts in columns["confusion"]
        ),
        by_exit=columns["by_exit"],
        by_exit_reason=columns["by_exit_reason"],
        looked_up=columns["looked_up"],
        audited=columns["audited"],
        disagreements=columns["disagreements"],
        periods=columns["periods"],
        grid=cells,
        system=sys.name,
        params=picture.params,
        rest=picture.rest,
        t0=picture.t0,
        period=picture.period,
        distance=distance,
        settings=run.settings,
        instruction_set=instruction_set(),
        stats=LaneStats(**columns["counters"]),
    )
    ended(columns["raised"], basins=result)
    return result


def _saddle(found: Mapping[str, Any]) -> Saddle:
    return Saddle(
        points=np.ascontiguousarray(found["points"].T),
        multipliers=np.array(found["multipliers"], dtype=np.complex128),
        residual=found["residual"],
    )


def _attractor(found: Mapping[str, Any]) -> Attractor:
    return Attractor(
        periodic=found["periodic"],
        points=np.ascontiguousarray(found["points"].T),
        multipliers=np.array(found["multipliers"], dtype=np.complex128),
        residual=found["residual"],
        radius=found["radius"],
    )
