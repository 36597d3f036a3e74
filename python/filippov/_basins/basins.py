# SPDX-License-Identifier: BSD-3-Clause
"""Basins of attraction, every cell labelled by its own trajectory."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.settings import Settings, lane_settings
from filippov._results.store import Stored
from filippov._results.tiles import Arrays, Show, Stage, open_store, run_stage
from filippov._runs.ensemble import (
    COUNTS,
    INTERRUPTED,
    STATUS_NAMES,
    LaneStats,
    counts,
    escape_bounds,
    run_identity,
)
from filippov._runs.lanes import level_of
from filippov._support.check import MOST, flag, floats, integer, number, refuse, transposed
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import STATUSES, codes, complete, finite, known, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import Params, System

from .basin_numbers import (
    BasinEntropy,
    BoxDimension,
    Fraction,
    UncertaintyExponent,
    basin_entropy,
    box_dimension,
    grid_fractions,
    random_points,
    sampled_fractions,
    uncertainty_exponent,
)
from .basin_work import BasinWork
from .cells import (
    CellGroup,
    Grid,
    GridArgument,
    Integers,
    Picture,
    groups_of,
    picture_of,
    verify_cells,
)
from .refine import RefinedBasins, refine

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Attractor", "Basins", "GroupCheck", "Saddle", "basins"]

#: Share of cells that may be wrong, as `audit_agrees` has it in C++: what an audit of 500 cells
#: without disagreement leaves open, with 95% confidence.
AUDIT_BOUND = 0.006


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

    def __repr__(self) -> str:
        return f"<Saddle: period {self.period}, {_first_point(self)}>"


@dataclass(frozen=True, eq=False)
class Attractor:
    """What trajectories end on."""

    periodic: bool  #: a cycle of the strobe map, exact; else `points` are some of its points
    points: Floats  #: states when the strobe flashes, shape (dim, period)
    #: of the whole cycle, largest first, 1 exactly for a clock; empty if there is none
    multipliers: NDArray[np.complex128]
    residual: float  #: by how much the cycle misses itself, in units of the picture
    #: of the ellipsoids around its points that the map was seen to draw together, in the norm of
    #: the linear map and units of the picture
    radius: float
    #: matrices S of these norms, v' S v with v in units of the picture, shape (period, dim, dim)
    norms: Floats

    @property
    def period(self) -> int | None:
        """Forcing periods of the cycle, None if there is none."""
        return int(self.points.shape[1]) if self.periodic else None

    def __repr__(self) -> str:
        if not self.periodic:
            return f"<Attractor: not periodic, {self.points.shape[1]} points kept>"
        return f"<Attractor: period {self.period}, {_first_point(self)}>"


def verify_cycles(
    sys: System, attractors: tuple[Attractor, ...], saddles: tuple[Saddle, ...]
) -> None:
    """Refuse cycles that are not those of a system."""
    dim = sys.dim
    for points in [a.points for a in attractors] + [s.points for s in saddles]:
        require(points.size > 0, "points is empty")
        shaped((dim, points.shape[-1]), points=points)
    for saddle in saddles:
        shaped((dim,), multipliers=saddle.multipliers)
    for attractor in attractors:
        n = attractor.points.shape[1]
        shaped((dim,) if attractor.periodic else (0,), multipliers=attractor.multipliers)
        shaped(
            (n, dim, dim) if attractor.periodic else attractor.norms.shape, norms=attractor.norms
        )


def _first_point(cycle: Saddle | Attractor) -> str:
    """Write down where a cycle is, and how it attracts."""
    sizes = ", ".join(f"{abs(m):.4g}" for m in cycle.multipliers)
    return f"at {np.array2string(cycle.points[:, 0], separator=', ')}, |multipliers| {sizes}"


@dataclass(frozen=True, eq=False)
class GroupCheck:
    """What plain cell mapping makes of a group of cells, beside the labels."""

    group: int  #: index of the group, -1 for the outside, -2 for the unknown
    attractor: int  #: that it stands for, from 1; 0: none, the group is spurious
    #: cells that it takes, by label: escaped, unresolved, 1, 2, ...
    cells: NDArray[np.int64]


@dataclass(frozen=True, eq=False, repr=False)
class Basins(Stored):
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
    system: System
    params: Params
    rest: Floats  #: state, of which two components are those of the grid
    t0: float  #: of the starts, and of the first flash, but for what `basins` says of jumps
    period: float  #: of the forcing
    distance: float  #: below which a trajectory had landed, 0: within the ellipsoid
    search: Mapping[str, Any]  #: how attractors were looked for: arguments of `basins`
    escape: tuple[float, ...] | None  #: sizes of the components beyond which a run has escaped
    settings: Settings
    instruction_set: str
    stats: LaneStats

    _parts = (Attractor, CellGroup, Grid, GroupCheck, LaneStats, Saddle, Settings)

    def _verify(self) -> None:
        sys, n = self.system, len(self.attractors)
        self.grid.verify_in(sys)
        complete(self.params, sys.params)
        verify_cycles(sys, self.attractors, self.saddles)
        self.settings._verify_cells()
        shaped((sys.dim,), rest=self.rest)
        finite(rest=self.rest)
        arrays = ("label", "time", "status", "plain_group", "plain_steps")
        shaped(self.grid.shape, **{name: getattr(self, name) for name in arrays})
        codes(-1, n + 1, label=self.label)
        codes(-1, 2**31, time=self.time)
        known(STATUSES, status=self.status)
        verify_cells(self.grid, self.plain_groups, plain_group=self.plain_group)
        for check in self.confusion:
            codes(-2, len(self.plain_groups), group=check.group)
            codes(0, n + 1, attractor=check.attractor)
            shaped((n + 2,), cells=check.cells)
        require(len(self.settings.atol) == sys.dim, f"atol has {len(self.settings.atol)} entries")
        require(self.escape is None or len(self.escape) == sys.dim, f"escape is {self.escape}")
        require(0 < self.period < np.inf, f"period is {self.period}")
        search_of(**self.search)

    @property
    def state(self) -> Status:
        """Of the whole picture: `not_converged` if the audit disagrees with more than 0.6%."""
        wrong = self.disagreements > AUDIT_BOUND * self.audited
        return Status("not_converged" if wrong else "ok")

    @property
    def success(self) -> bool:
        """Whether the audit bears the labels out."""
        return self.state == Status.ok

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

    @property
    def bounds(self) -> dict[int, Fraction]:
        """Shares by label, between bounds from the cells beside boundaries.

        They hold for boundaries that are straight on the scale of a cell; `sample` gives intervals
        that do not need that.
        """
        return {share.label: share for share in grid_fractions(self.label)}

    def at(self, points: ArrayLike) -> tuple[Integers, Integers]:
        """Label any points of the picture, each by its own trajectory.

        Parameters
        ----------
        points : array, shape (2, ...)
            In the two components of the grid; they may lie outside it.

        Returns
        -------
        label, time : arrays, shape (...)
            As those of cells.
        """
        given = floats("points", points, "expected an array of shape (2, ...)")
        if given.ndim < 1 or given.shape[0] != 2:
            turned = transposed(given.shape, 2)
            expected = f"expected an array of shape (2, ...), got shape {given.shape}{turned}"
            refuse("points", points, expected)
        work, known = self._labelling()
        rows = np.ascontiguousarray(given.reshape(2, -1).T)
        found = work.finder.points(known, rows)
        ended(found.raised)
        shape = given.shape[1:]
        return found.label.reshape(shape), found.time.reshape(shape)

    def sample(
        self, n: int = 10_000, *, level: float = 0.95, seed: int = 1
    ) -> tuple[Fraction, ...]:
        """Shares of random points' labels, with Wilson's intervals.

        Parameters
        ----------
        n : int
            Points, drawn uniformly from the picture, each labelled by its own trajectory.
        level : float
            Probability that an interval covers the true share, each by itself.
        seed : int
            Of the points.
        """
        level = number("level", level, "expected 0 < level < 1", above=0.0, below=1.0)
        points = random_points(self.grid, integer("n", n), integer("seed", seed, 0, MOST))
        labels = range(1, len(self.attractors) + 1)
        return sampled_fractions(self.at(points.T)[0], level, labels)

    def entropy(self, box: int = 5) -> BasinEntropy:
        """Entropy of the labels in boxes of `box` x `box` cells: how unpredictable they are."""
        return basin_entropy(self.label, box)

    def boundary_dimension(self) -> BoxDimension:
        """Box-counting dimension of the boundary, as far as the cells resolve it."""
        return box_dimension(self.label)

    def uncertainty_exponent(
        self,
        epsilons: Sequence[float] = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4),
        *,
        pairs: int = 10_000,
        seed: int = 1,
        progress: Progress = False,
    ) -> UncertaintyExponent:
        """How the share of pairs with different labels falls with their distance.

        Parameters
        ----------
        epsilons : sequence of float
            Distances, in units of the picture.
        pairs : int
            Of random points, at each distance: twice as many trajectories.
        seed : int
            Of the points.
        progress : bool or function
            True shows a bar; a function is called as `progress(done, total)`, in pairs.
        """
        return uncertainty_exponent(*self._labelling(), epsilons, pairs, seed, progress)

    def refine(
        self,
        *,
        coarse: int = 32,
        levels: int = 6,
        time_jump: int = 0,
        audit: int = 1000,
        seed: int = 1,
        full_dimension: float = 1.9,
        max_points: int = 50_000_000,
    ) -> RefinedBasins:
        """Label the same rectangle on squares that are split along the boundaries only.

        A picture of coarse * 2**levels cells either way for a few per cent of their trajectories.

        Parameters
        ----------
        coarse, levels : int
            Squares along either side at first, and how often they are split.
        time_jump : int
            Split also where times differ by more; 0: where labels do.
        audit : int
            Random points in the squares that were not split.
        seed : int
            Of the audit.
        full_dimension : float
            Stop where the boundary grows with this dimension: it fills the plane.
        max_points : int
            Trajectories before the audit.

        Returns
        -------
        RefinedBasins

        Raises
        ------
        KeyboardInterrupt
            Within a second of Ctrl-C; its attribute `refined` has what was finished.
        """
        work, known = self._labelling()
        return refine(
            work, known, coarse, levels, time_jump, audit, seed, full_dimension, max_points
        )

    def _labelling(self) -> tuple[BasinWork, list[_core.AttractorColumns]]:
        """Give what labels points, and the attractors that it is to be given."""
        picture = Picture(self.grid, self.rest, self.t0, self.params, self.period)
        bounds = None if self.escape is None else list(self.escape)
        level = level_of(self.system)
        work = BasinWork(self.system, picture, self.settings, self.search, bounds, 0, level)
        known = [
            _core.AttractorColumns(
                periodic=a.periodic, points=a.points.T, radius=a.radius, norms=a.norms
            )
            for a in self.attractors
        ]
        return work, known

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
        from filippov._plot.plot_basins import plot_basins

        return plot_basins(self, ax, what, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the picture as an `xarray.Dataset` over the two components of the grid."""
        names = self.grid.names
        variables: dict[str, Any] = {
            name: (names, getattr(self, name))
            for name in ("label", "time", "status", "plain_group", "plain_steps")
        }
        return dataset(self, variables, self.grid.coords())

    def __repr__(self) -> str:
        shares = ", ".join(f"{label}: {share:.1%}" for label, share in self.fractions.items())
        wrong = ""
        if self.disagreements:
            wrong = f"; {self.disagreements} of {self.audited} audited cells disagree"
        return (
            f"<Basins of {self.system.name}, {self.grid.shape[0]} x {self.grid.shape[1]} cells: "
            f"{len(self.attractors)} attractors, {len(self.saddles)} saddles; {shares}{wrong}>"
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
    store: str | os.PathLike[str] | None = None,
    tile: int | None = None,
    progress: Progress = False,
) -> Basins:
    """Label every cell of a grid with the attractor that its centre goes to.

    Attractors are found without prior knowledge: from groups of simple cell mapping and from random
    cells. Cycles are refined by Newton with exact derivatives, merged, and fenced in by ellipsoids
    that the map is seen to draw together. Then every centre is followed until it is inside one.

    Parameters
    ----------
    sys : System
        With a period.
    grid : mapping
        Two components of the state: `{"y": (-4, 4, 500), "v": (-3, 4, 500)}`, low, high and the
        number of cells. The first is the first axis of the arrays.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    rest : mapping, optional
        Values of the other components of the state; 0 where nothing is said.
    t0 : float
        Time of the start, at which the strobe flashes. If the state jumps whenever it flashes, as
        by a clock, the flashes come a millionth of a period later.
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
    method, rtol, atol, max_step, max_steps, max_events, on_nonunique, escape, threads, store
        As in `ensemble`, for every cell.
    tile : int, optional
        Cells of a tile, about: as many whole rows.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in cells, each of which
        counts twice: when it is mapped by a period, and when it is labelled.

    Returns
    -------
    Basins

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C, and 0.2 s a million cells for the result; its
        attribute `basins` has what was finished.

    Warns
    -----
    UserWarning
        If a line of the grid lies on a surface, and if the audit disagrees with more cells than it
        may: then `state` is `not_converged`.

    Notes
    -----
    Chapter, section 4.7 and figure 4.15, which plain cell mapping gets wrong: see `confusion`.
    """
    picture = picture_of(sys, grid, rest, t0, params)
    settings = lane_settings(
        sys.dim, method, rtol, atol, max_step, max_steps, max_events, on_nonunique
    )
    threads, tile = counts(threads=threads, tile=tile)
    search = search_of(
        seeds=seeds,
        settle=settle,
        longest=longest,
        saddle_starts=saddle_starts,
        max_periods=max_periods,
        distance=distance,
        times=times,
        audit=audit,
        seed=seed,
    )
    bounds = escape_bounds(sys, escape)
    work = BasinWork(sys, picture, settings, search, bounds, threads or 0, level_of(sys))
    cells = picture.grid

    def identity() -> dict[str, Any]:
        return picture.identity() | run_identity(sys, settings, bounds) | {"search": search}

    kept, tiling = open_store(store, "basins", identity, cells.shape[0], cells.shape[1], tile)
    shape = cells.shape
    outputs: Arrays = {
        "image": np.full(shape, -2, dtype=np.int32),
        "image_state": np.full((*shape, sys.dim), np.nan),
        "image_status": np.full(shape, INTERRUPTED, dtype=np.int8),
    }
    dims = dict.fromkeys(outputs, cells.names) | {"image_state": (*cells.names, "state")}
    images = Stage("images", work.images, outputs, COUNTS, dims=dims)
    with shown(progress, "cell") as show:
        halves = [_half(show, k) for k in (0, 1)]
        mapped, image_sums, raised = run_stage(images, tiling, kept, halves[0], shape[1])
        found = work.find(mapped["image"], raised)
        attractors = found.attractors
        labels = Stage(
            "labels",
            work.labels(attractors),
            {
                "label": np.zeros(shape, dtype=np.int32),
                "time": np.full(shape, -1, dtype=np.int32),
                "status": np.full(shape, INTERRUPTED, dtype=np.int8),
            },
            (*COUNTS, "periods", "looked_up"),
            {"state": mapped["image_state"], "status": mapped["image_status"]},
            dict.fromkeys(("label", "time", "status"), cells.names),
        )
        raised = found.raised
        labelled, sums = labels.outputs, dict.fromkeys(labels.numbers, 0)
        if raised is None:
            labelled, sums, raised = run_stage(labels, tiling, kept, halves[1], shape[1])
        checked = work.complete(attractors, mapped["image"], labelled["label"], raised)
    plain = found.plain
    result = Basins(
        label=labelled["label"],
        time=labelled["time"],
        status=STATUS_NAMES[labelled["status"]],
        attractors=tuple(_attractor(a) for a in attractors),
        saddles=tuple(_saddle(s) for s in found.saddles),
        plain_group=plain.group.reshape(shape),
        plain_steps=plain.steps.reshape(shape),
        plain_groups=groups_of(plain, shape),
        confusion=tuple(
            GroupCheck(g.group, g.attractor, np.array(g.cells, dtype=np.int64))
            for g in checked.confusion
        ),
        by_exit=checked.by_exit,
        by_exit_reason=checked.by_exit_reason,
        looked_up=sums["looked_up"],
        audited=checked.audited,
        disagreements=checked.disagreements,
        periods=sums["periods"],
        grid=cells,
        system=sys,
        params=picture.params,
        rest=picture.rest,
        t0=picture.t0,
        period=picture.period,
        distance=search["distance"],
        search=search,
        escape=None if bounds is None else tuple(bounds),
        settings=settings,
        instruction_set=level_of(sys),
        stats=LaneStats.of({name: image_sums[name] + sums[name] for name in COUNTS}),
    )
    ended(checked.raised, basins=result)
    if not result.success:
        warnings.warn(
            f"{result.disagreements} of {result.audited} audited cells do not come to the "
            "attractor of their label: do not trust the picture, nor its attractors",
            stacklevel=2,
        )
    return result


def search_of(
    *,
    seeds: int,
    settle: int,
    longest: int,
    saddle_starts: int,
    max_periods: int,
    distance: float,
    times: bool,
    audit: int,
    seed: int,
) -> dict[str, Any]:
    """Check how attractors are looked for."""
    return {
        "seeds": integer("seeds", seeds),
        "settle": integer("settle", settle),
        "longest": integer("longest", longest),
        "saddle_starts": integer("saddle_starts", saddle_starts, 0),
        "max_periods": integer("max_periods", max_periods),
        "distance": number("distance", distance, "expected 0 <= distance < 1", least=0, below=1),
        "times": flag("times", times),
        "audit": integer("audit", audit, 0),
        "seed": integer("seed", seed, 0, MOST),
    }


def _half(show: Show, half: int) -> Show:
    """Of a run that shows every cell twice."""
    if show is None:
        return None
    return lambda done, total: show(half * total + done, 2 * total)


def _saddle(found: _core.StrobeCycleColumns) -> Saddle:
    return Saddle(
        points=np.ascontiguousarray(found.points.T),
        multipliers=found.multipliers,
        residual=found.residual,
    )


def _attractor(found: _core.AttractorColumns) -> Attractor:
    return Attractor(
        periodic=found.periodic,
        points=np.ascontiguousarray(found.points.T),
        multipliers=found.multipliers,
        residual=found.residual,
        radius=found.radius,
        norms=found.norms,
    )
