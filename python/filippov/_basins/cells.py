# SPDX-License-Identifier: BSD-3-Clause
"""Grids of cells, and simple cell mapping."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._orbits.geometry import one_surface
from filippov._orbits.maps import section_of
from filippov._results.dataset import dataset
from filippov._results.settings import Settings, lane_settings
from filippov._results.store import Stored
from filippov._results.tiles import Arrays, Show, Stage, open_store, run_stage
from filippov._runs.ensemble import (
    COUNTS,
    INTERRUPTED,
    STATUS_NAMES,
    EnsembleWork,
    LaneStats,
    counts,
    escape_bounds,
    run_identity,
)
from filippov._runs.lanes import level_of
from filippov._support.check import integer, mapping, number, refuse, start_within
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import STATUSES, codes, complete, finite, known, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.bounds import interval
from filippov._system.system import Params, System

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["CellGroup", "CellMap", "Grid", "cell_map"]

Integers = NDArray[np.int32]
OK, ESCAPED = (list(STATUS_NAMES).index(status.value) for status in (Status.ok, Status.escaped))
GridArgument = Mapping[str, Sequence[float]]
MOST_CELLS = 100_000  #: along an axis, as the core takes them


@dataclass(frozen=True)
class Grid:
    """A rectangle of cells over two state components."""

    names: tuple[str, str]  #: components along the first and the second axis of the arrays
    coordinates: tuple[int, int]  #: their indices in the state
    low: tuple[float, float]
    high: tuple[float, float]
    shape: tuple[int, int]  #: cells along either axis

    def _verify(self) -> None:
        require(len(set(self.names)) == 2, f"names are {self.names}")
        for low, high in zip(self.low, self.high, strict=True):
            require(-math.inf < low < high < math.inf, f"low is {self.low}, high {self.high}")
        require(min(self.shape) > 0, f"shape is {self.shape}")

    def verify_in(self, sys: System, *others: str) -> None:
        """Refuse a grid over what is no component of the system, nor one of the others."""
        components = (*sys.state, *others)
        codes(0, len(components), coordinates=self.coordinates)
        names = tuple(components[k] for k in self.coordinates)
        require(names == self.names, f"names are {self.names}, those of coordinates {names}")

    @property
    def axes(self) -> list[tuple[int, float, float, int]]:
        """Rows (coordinate, low, high, n) for the compiled core."""
        return list(zip(self.coordinates, self.low, self.high, self.shape, strict=True))

    def centres(self, axis: int) -> Floats:
        """Centres of the cells along an axis."""
        n = self.shape[axis]
        low = self.low[axis]
        return np.asarray(low + (self.high[axis] - low) * ((np.arange(n) + 0.5) / n), np.float64)

    def coords(self) -> dict[str, Floats]:
        """Centres of the cells by component, as an `xarray.Dataset` takes them."""
        return {name: self.centres(k) for k, name in enumerate(self.names)}

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Ends of both axes, as matplotlib's `imshow` takes them."""
        return (self.low[0], self.high[0], self.low[1], self.high[1])


@dataclass(frozen=True)
class Picture:
    """A grid with the states that it stands for."""

    grid: Grid
    rest: Floats  #: state, of which two components are those of the grid
    t0: float
    params: Params
    period: float

    @property
    def table(self) -> Floats:
        """Values of the parameters."""
        return np.array(list(self.params.values()), dtype=np.float64)

    def starts(self, first: int, count: int) -> Floats:
        """States at the centres of the cells in some rows, and times, shape (cells, dim + 1)."""
        rows, columns = (self.grid.centres(axis) for axis in (0, 1))
        n = len(columns)
        starts = np.tile([*self.rest, self.t0], (count * n, 1))
        starts[:, self.grid.coordinates[0]] = np.repeat(rows[first : first + count], n)
        starts[:, self.grid.coordinates[1]] = np.tile(columns, count)
        return starts

    def identity(self) -> dict[str, Any]:
        """Give what a store is told of it."""
        return {
            "grid": asdict(self.grid),
            "params": dict(self.params),
            "rest": self.rest.tolist(),
            "t0": self.t0,
        }


def picture_of(
    sys: System,
    grid: GridArgument,
    rest: Mapping[str, float] | None,
    t0: float,
    params: Mapping[str, float] | None,
    section: bool = False,
) -> Picture:
    """Check what a picture is made of."""
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    forced = "period" in sys.capabilities
    if not forced and not section:
        refuse("sys", sys.name, "expected a System with a period")
    components = (*sys.state, "t") if section and forced else sys.state
    expected = f"expected two of {', '.join(components)}: {{name: (low, high, cells)}}"
    if not isinstance(grid, Mapping):
        refuse("grid", grid, expected, TypeError)
    if len(grid) != 2 or not set(grid) <= set(components):
        refuse("grid", dict(grid), expected)
    names: list[str] = []
    ends: list[tuple[float, float]] = []
    shape: list[int] = []
    for name, given in grid.items():
        span = interval(f"grid[{name!r}]", given, 3)
        if len(span) != 3:
            refuse(f"grid[{name!r}]", given, "expected (low, high, cells)")
        names.append(name)
        ends.append(span[:2])
        shape.append(integer(f"grid[{name!r}][2]", span[2], most=MOST_CELLS))
        if not span[1] - span[0] >= 1024 * shape[-1] * np.spacing(max(map(abs, span[:2]))):
            refuse(f"grid[{name!r}]", given, "expected cells wider than rounding, by far")
    others = [name for name in sys.state if name not in names]
    state = np.zeros(sys.dim)
    for name, value in mapping("rest", rest, "expected a mapping of names to values").items():
        if name not in others:
            refuse("rest", rest, f"expected values of {', '.join(others) or 'no component'}")
        state[sys.state.index(name)] = number(f"rest[{name!r}]", value)
    values = sys._merged(params)
    found = Grid(
        names=(names[0], names[1]),
        coordinates=(components.index(names[0]), components.index(names[1])),
        low=(ends[0][0], ends[1][0]),
        high=(ends[0][1], ends[1][1]),
        shape=(shape[0], shape[1]),
    )
    if forced:
        sys._forced(values)
    period = float((sys.period(values) if forced else None) or math.nan)
    t0 = start_within("t0", number("t0", t0), period)
    picture = Picture(found, state, t0, values, period)
    if "t" in names:
        return picture
    lines = _core.lines_on_surface(sys._model, found.axes, picture.table, state, picture.t0)
    warn_of_lines(lines, found)
    return picture


def warn_of_lines(lines: list[tuple[int, int, float]], grid: Grid) -> None:
    """Say that rounding decides where what is on a surface lies, a slide for one."""
    for axis, line, value in lines:
        name, low, high, n = grid.names[axis], grid.low[axis], grid.high[axis], grid.shape[axis]
        half = (high - low) / n / 2
        remedy = (
            "Move this end of the grid a little."
            if line in (0, n)
            else f"Shift the grid by half a cell, {name!r}: ({low + half:g}, {high + half:g}, {n})."
        )
        warnings.warn(
            f"the grid line {name} = {value:g} lies on a surface: rounding decides in which cell "
            f"what is on the surface lies, the image of a slide for one. {remedy}",
            stacklevel=4,
        )


@dataclass(frozen=True)
class CellGroup:
    """Cells that the map of cells leads around."""

    period: int  #: how many
    cells: Integers  #: indices along both axes, shape (period, 2), in the order of the map
    basin: int  #: cells that lead here, those of the group among them

    def _verify(self) -> None:
        shaped((self.period, 2), cells=self.cells)
        require(self.period > 0, "period is 0")


def verify_cells(grid: Grid, groups: tuple[CellGroup, ...], **group: Integers) -> None:
    """Refuse groups of cells that are not those of a grid."""
    for name, cells in group.items():
        codes(-2, len(groups), **{name: cells})
    for each in groups:
        for axis in (0, 1):
            codes(0, grid.shape[axis], cells=each.cells[:, axis])


@dataclass(frozen=True, eq=False, repr=False)
class CellMap(Stored):
    """Result of `cell_map`, one entry a cell: arrays have the shape of the grid."""

    group: Integers  #: index into `groups`, -1 for the outside, -2 where it is not known
    steps: Integers  #: maps until the group, the outside or the unknown
    image: Integers  #: cell of the centre's image, row-major; -1 outside, -2 not known
    status: NDArray[np.str_]  #: how each run ended: names of `Status`
    groups: tuple[CellGroup, ...]  #: by period, then by smallest cell
    sink_basin: int  #: cells that lead outside
    unresolved_basin: int  #: cells of which it is not known
    grid: Grid
    system: System
    params: Params
    rest: Floats  #: state, of which two components are those of the grid
    t0: float
    period: float  #: of the map; NaN between events, which take different times
    section: str | None  #: the event to which cells were mapped, None: for a period
    settings: Settings
    instruction_set: str
    stats: LaneStats

    _parts = (CellGroup, Grid, Settings, LaneStats)

    def _verify(self) -> None:
        self.settings._verify_cells()
        self.grid.verify_in(self.system, *(() if self.section is None else ("t",)))
        complete(self.params, self.system.params)
        shaped((self.system.dim,), rest=self.rest)
        finite(rest=self.rest)
        arrays = {name: getattr(self, name) for name in ("group", "steps", "image", "status")}
        shaped(self.grid.shape, **arrays)
        known(STATUSES, status=self.status)
        codes(-2, math.prod(self.grid.shape), image=self.image)
        verify_cells(self.grid, self.groups, group=self.group)

    @property
    def time(self) -> Floats:
        """Time until the group, of each cell; NaN of a section map."""
        return np.asarray(self.steps * self.period, dtype=np.float64)

    def to_xarray(self) -> xr.Dataset:
        """Give the map as an `xarray.Dataset` over the two components of the grid."""
        variables = {
            name: (self.grid.names, getattr(self, name))
            for name in ("group", "steps", "image", "status", "time")
        }
        return dataset(self, variables, self.grid.coords(), {"rest": self.rest.tolist()})

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the basins of the groups.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the image.

        Returns
        -------
        list of artists
            The image, and the groups' cells.
        """
        from filippov._plot.plot_basins import plot_cell_map

        return plot_cell_map(self, ax, artist_kw)

    def __repr__(self) -> str:
        words = ", ".join(f"period {g.period} with {g.basin} cells" for g in self.groups[:6])
        more = f" and {len(self.groups) - 6} more" if len(self.groups) > 6 else ""
        return (
            f"<CellMap of {self.system.name}, {self.grid.shape[0]} x {self.grid.shape[1]} cells: "
            f"{len(self.groups)} groups ({words}{more}), {self.sink_basin} cells lead outside>"
        )


def groups_of(found: _core.CellMapColumns, shape: tuple[int, int]) -> tuple[CellGroup, ...]:
    """Give the groups as `CellMap` has them."""
    return tuple(
        CellGroup(
            int(period), np.stack(np.unravel_index(cells, shape), axis=-1).astype(np.int32), int(n)
        )
        for period, cells, n in zip(found.period, found.cells, found.basin, strict=True)
    )


def cell_map(
    sys: System,
    grid: GridArgument,
    *,
    params: Mapping[str, float] | None = None,
    rest: Mapping[str, float] | None = None,
    t0: float = 0.0,
    periods: int = 1,
    section: str | None = None,
    after: int | None = None,
    max_time: float | None = None,
    method: str = "dop853",
    rtol: float = 1e-8,
    atol: ArrayLike = 1e-10,
    max_step: float = math.inf,
    max_steps: int = 10_000_000,
    max_events: int = 1_000_000,
    on_nonunique: str = "stop",
    escape: ArrayLike | None = None,
    threads: int | None = None,
    store: str | os.PathLike[str] | None = None,
    tile: int | None = None,
    progress: Progress = False,
) -> CellMap:
    """Map every cell of a grid to the cell that its centre reaches, and find where that leads.

    Simple cell mapping of the strobe map, or of a section. A cell moves by up to half its width
    before it is mapped: groups can be spurious, one attractor can look like several, and cells near
    the edge can fall outside falsely. `basins` labels cells by their own trajectories instead.

    Parameters
    ----------
    sys : System
        With a period, unless there is a `section`.
    grid : mapping
        Two components of the state: `{"y": (-4, 4, 500), "v": (-3, 4, 500)}`, low, high and the
        number of cells. The first is the first axis of the arrays. With a `section` of a forced
        system one of them may be "t", the time, of which images are taken modulo the period.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    rest : mapping, optional
        Values of the other components of the state; 0 where nothing is said. With a `section` the
        place of the section: of images these components are not looked at.
    t0 : float
        Time at which cells are mapped.
    periods : int
        Forcing periods of one map; with a `section` events.
    section : str, optional
        "exit_sliding", "enter_sliding" or "cross": cells are mapped to the next such event, as by
        `section_map`, instead of for a period. These runs are not made in lanes.
    after : int, optional
        Only events that lead to this mode: -1, 0 or +1.
    max_time : float, optional
        How long to wait for each event, as in `section_map`. A cell from which none comes in this
        time leads outside.
    method, rtol, atol, max_step, max_steps, max_events, on_nonunique, escape, threads, store
        As in `ensemble`, for every cell; with a `section` only rtol, atol, threads and store.
    tile : int, optional
        Cells of a tile, about: as many whole rows.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in cells.

    Returns
    -------
    CellMap

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `cell_map` has what was finished, and cells that
        were not mapped are unresolved.

    Warns
    -----
    UserWarning
        If a line of the grid lies on a surface.

    Notes
    -----
    Hsu and Guttalu, J. Appl. Mech. 47 (1980); chapter, section 4.7.
    """
    picture = picture_of(sys, grid, rest, t0, params, section is not None)
    periods = integer("periods", periods)
    settings = lane_settings(
        sys.dim, method, rtol, atol, max_step, max_steps, max_events, on_nonunique
    )
    bounds = escape_bounds(sys, escape)
    threads, tile = counts(threads=threads, tile=tile)
    cells = picture.grid
    work: CellMapWork | SectionWork
    if section is not None:
        one_surface(sys)
        # these runs are made as those of `section_map`
        for name, given, default in (
            ("method", method, "dop853"),
            ("max_step", max_step, math.inf),
            ("max_steps", max_steps, 10_000_000),
            ("max_events", max_events, 1_000_000),
            ("on_nonunique", on_nonunique, "stop"),
            ("escape", escape, None),
        ):
            if given is not default and given != default:
                refuse(name, given, f"expected {default!r} with a section")
        of, longest = section_of(section, after, max_time, picture.period)
        work = SectionWork(sys, picture, settings, of, longest, periods, threads or 0)
    else:
        for name, given in (("after", after), ("max_time", max_time)):
            if given is not None:
                refuse(name, given, "expected a section with it")
        shared = {
            "params": picture.table[np.newaxis, :],
            "t0": np.array([picture.t0]),
            "t_end": np.array([picture.t0 + periods * picture.period]),
        }
        members = EnsembleWork(sys, bounds, settings, threads or 0, level_of(sys), shared)
        work = CellMapWork(members, picture)
    outputs: Arrays = {
        "image": np.full(cells.shape, -2, dtype=np.int32),
        "status": np.full(cells.shape, INTERRUPTED, dtype=np.int8),
    }
    stage = Stage(
        "cells",
        work,
        outputs,
        COUNTS,
        dims=dict.fromkeys(outputs, cells.names),
    )

    def identity() -> dict[str, Any]:
        told = picture.identity() | run_identity(sys, settings, bounds) | {"periods": periods}
        if isinstance(work, SectionWork):
            told |= {"section": section, "after": after, "max_time": work.max_time}
        return told

    kept, tiling = open_store(store, "cell_map", identity, cells.shape[0], cells.shape[1], tile)
    with shown(progress, "cell") as show:
        columns, sums, raised = run_stage(stage, tiling, kept, show, cells.shape[1])
    found = _core.cell_map(cells.axes, columns["image"].ravel())
    result = CellMap(
        group=found.group.reshape(cells.shape),
        steps=found.steps.reshape(cells.shape),
        image=columns["image"],
        status=STATUS_NAMES[columns["status"]],
        groups=groups_of(found, cells.shape),
        sink_basin=found.sink_basin,
        unresolved_basin=found.unresolved_basin,
        grid=cells,
        system=sys,
        params=picture.params,
        rest=picture.rest,
        t0=picture.t0,
        period=math.nan if section is not None else periods * picture.period,
        section=section,
        settings=settings,
        instruction_set=level_of(sys),
        stats=LaneStats.of(sums),
    )
    ended(raised, cell_map=result)
    return result


@dataclass(frozen=True)
class SectionWork:
    """Maps cells to the next event of a kind, here or elsewhere."""

    sys: System
    picture: Picture
    settings: Settings
    section: tuple[int, int]  #: kind of the events, and the mode that they lead to (2: any)
    max_time: float
    iterate: int
    threads: int

    def __call__(self, first: int, count: int, inputs: Arrays, show: Show) -> Mapping[str, Any]:
        """Map rows of cells to the cells of their images."""
        del inputs
        picture, dim = self.picture, self.sys.dim
        starts = picture.starts(first, count)
        found = _core.section_images(
            self.sys._model,
            np.ascontiguousarray(starts[:, dim]),
            np.ascontiguousarray(starts[:, :dim]),
            picture.table,
            _core.RunSettings(
                rtol=self.settings.rtol,
                atol=[min(self.settings.atol)],
                max_steps=self.settings.max_steps,
            ),
            *self.section,
            self.max_time,
            self.iterate,
            self.threads,
            show,
        )
        t = found.t
        if "t" in picture.grid.names:
            low = picture.grid.low[picture.grid.names.index("t")]
            t = low + np.mod(t - low, picture.period)
        at = np.column_stack([found.x, t])[:, list(picture.grid.coordinates)]
        image = _core.cells_of(picture.grid.axes, np.ascontiguousarray(at))
        status = found.status
        image[status != OK] = -2
        image[status == ESCAPED] = -1
        columns = {"image": image, "status": status, "raised": found.raised}
        return columns | dict.fromkeys(COUNTS, 0)


@dataclass(frozen=True)
class CellMapWork:
    """Maps cells, here or elsewhere."""

    members: EnsembleWork
    picture: Picture

    def __call__(self, first: int, count: int, inputs: Arrays, show: Show) -> Mapping[str, Any]:
        """Map rows of cells to the cells of their images."""
        del inputs
        picture = self.picture
        starts = np.ascontiguousarray(picture.starts(first, count)[:, :-1])
        columns = dict(self.members(0, len(starts), {"x0": starts}, show))
        status = columns["status"]
        at = np.ascontiguousarray(columns["y"][:, list(picture.grid.coordinates)])
        image = _core.cells_of(picture.grid.axes, at)
        image[status != OK] = -2
        image[status == ESCAPED] = -1
        return columns | {"image": image}
