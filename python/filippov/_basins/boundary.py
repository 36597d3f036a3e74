# SPDX-License-Identifier: BSD-3-Clause
"""Boundaries of basins as curves, with their corners, and unstable sets of saddles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.store import Stored
from filippov._support.check import MOST, integer, number, refuse
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import codes, complete, known, require, shaped
from filippov._support.types import Floats
from filippov._system.system import Params, System

from .basins import Basins, Saddle, verify_cycles
from .cells import Grid, Integers

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = [
    "BasinBoundary",
    "BoundaryCorner",
    "BoundaryCurve",
    "UnstableBranch",
    "UnstableSet",
    "basin_boundary",
    "unstable_set",
]

KINDS = np.array(["unknown", "stable_set", "jump"])


@dataclass(frozen=True, eq=False)
class BoundaryCurve:
    """A polyline along a boundary, with the basin of one label on its left.

    Arrays over its points have the shape (2, n) or (n,); points are in the picture's coordinates.
    """

    points: Floats
    left_points: Floats  #: beside them, seen to end on the left label
    right_points: Floats  #: and on another
    left: int  #: label, the smaller one
    right: int  #: label; within a cell there may be a third one
    closed: bool  #: the last point is joined to the first
    #: "stable_set" of a saddle, "jump": the strobe map is discontinuous, "unknown"
    kind: NDArray[np.str_]
    saddle: Integers  #: of a stable set: its index in `Basins.saddles`, else -1
    periods: Integers  #: until both sides are nearest to the saddle, or until they jumped apart
    approach: Floats  #: how near that is, in pictures
    distance: float  #: of the boundary from the polyline, estimated, in pictures
    coarse: int  #: chords that may be farther from it

    def _verify(self) -> None:
        n = self.kind.size
        require(n > 0, "a curve has no points")
        shaped((2, n), points=self.points, left=self.left_points, right=self.right_points)
        columns = {name: getattr(self, name) for name in ("kind", "saddle", "periods", "approach")}
        shaped((n,), **columns)
        known(KINDS.tolist(), kind=self.kind)


@dataclass(frozen=True)
class BoundaryCorner:
    """A point where a boundary has two tangents."""

    position: tuple[float, float]  #: in the picture's coordinates
    turn: float  #: radians, in a picture that is one wide and one high, > 0 to the left
    error: float  #: by how much it moved at last, in pictures
    curve: int  #: index of the curve
    point: int  #: index of the nearest of its points


@dataclass(frozen=True, eq=False, repr=False)
class BasinBoundary(Stored):
    """Result of `basin_boundary`."""

    curves: tuple[BoundaryCurve, ...]
    corners: tuple[BoundaryCorner, ...]
    unresolved: int  #: cells without a label: curves end beside them
    stuck: int  #: points whose two sides stayed apart, because of unresolved labels between
    labels: int  #: trajectories that were followed
    status: str  #: "ok"; "max_steps", "interrupted": curves are incomplete
    message: str
    grid: Grid
    system: System
    params: Params

    _parts = (BoundaryCorner, BoundaryCurve, Grid)

    def _verify(self) -> None:
        self.grid.verify_in(self.system)
        complete(self.params, self.system.params)
        for corner in self.corners:
            codes(0, len(self.curves), curve=corner.curve)
            codes(0, self.curves[corner.curve].kind.size, point=corner.point)

    def to_xarray(self) -> xr.Dataset:
        """Give the curves as an `xarray.Dataset` over the points of all, `curve` telling which."""
        names = self.grid.names
        lengths = [c.points.shape[1] for c in self.curves]
        points = np.concatenate([np.empty((2, 0)), *(c.points for c in self.curves)], axis=1)
        variables: dict[str, Any] = {name: ("point", points[k]) for k, name in enumerate(names)}
        variables["curve"] = ("point", np.repeat(np.arange(len(lengths)), lengths))
        for name, empty in (("kind", KINDS[:0]), ("saddle", np.empty(0, np.int64))):
            column = np.concatenate([empty, *(getattr(c, name) for c in self.curves)])
            variables[name] = ("point", column)
        variables |= {
            side: ("curve_index", np.array([getattr(c, side) for c in self.curves], dtype=np.int64))
            for side in ("left", "right")
        }
        corners = np.array([c.position for c in self.corners]).reshape(-1, 2)
        variables |= {f"corner_{name}": ("corner", corners[:, k]) for k, name in enumerate(names)}
        return dataset(self, variables, {})

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the curves and their corners, over `Basins.plot` if that is there.

        Stable sets are solid, jumps dashed, what is unknown is dotted.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the lines.

        Returns
        -------
        list of artists
            A line for each piece of one kind, then the corners.
        """
        from filippov._plot.plot_boundary import plot_boundary

        return plot_boundary(self, ax, artist_kw)

    def __repr__(self) -> str:
        kinds = np.concatenate([c.kind for c in self.curves]) if self.curves else KINDS[:0]
        names, counts = np.unique(kinds, return_counts=True)
        shares = ", ".join(f"{n} {name}" for name, n in zip(names, counts, strict=True))
        return (
            f"<BasinBoundary: {len(self.curves)} curves, {len(self.corners)} corners; "
            f"points: {shares or 'none'}>"
        )


@dataclass(frozen=True, eq=False)
class UnstableBranch:
    """One side of an unstable set."""

    points: Floats  #: states, from the saddle on, shape (dim, n)
    breaks: NDArray[np.int64]  #: the map jumps between these points and the next
    length: float  #: in pictures
    attractor: int  #: label of the one that it ends at, 0: none
    status: str
    message: str


@dataclass(frozen=True, eq=False, repr=False)
class UnstableSet(Stored):
    """Result of `unstable_set`."""

    branches: tuple[UnstableBranch, ...]  #: along `direction`, and against it
    direction: Floats  #: unstable eigenvector at the saddle, of length 1 in pictures
    multiplier: float  #: > 1, of the map that the set was grown with
    turn: int  #: forcing periods of that map
    saddle: Saddle
    grid: Grid
    system: System
    params: Params

    _parts = (Grid, Saddle, UnstableBranch)

    def _verify(self) -> None:
        dim = self.system.dim
        self.grid.verify_in(self.system)
        complete(self.params, self.system.params)
        verify_cycles(self.system, (), (self.saddle,))
        shaped((dim,), direction=self.direction)
        require(len(self.branches) > 0, "branches is empty")
        for branch in self.branches:
            n = branch.points.shape[-1]
            shaped((dim, n), points=branch.points)
            shaped((branch.breaks.size,), breaks=branch.breaks)
            codes(0, n, breaks=branch.breaks)

    def to_xarray(self) -> xr.Dataset:
        """Give the set as an `xarray.Dataset` over the points of both branches."""
        lengths = [b.points.shape[1] for b in self.branches]
        points = np.concatenate([b.points for b in self.branches], axis=1)
        variables: dict[str, Any] = {
            "x": (("state", "point"), points),
            "branch": ("point", np.repeat(np.arange(len(lengths)), lengths)),
            "direction": ("state", self.direction),
            "attractor": ("branch_index", [b.attractor for b in self.branches]),
            "length": ("branch_index", [b.length for b in self.branches]),
        }
        return dataset(self, variables, {})

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw both branches, over `Basins.plot` if that is there.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the lines.

        Returns
        -------
        list of artists
            A line for each stretch without a break.
        """
        from filippov._plot.plot_boundary import plot_unstable_set

        return plot_unstable_set(self, ax, artist_kw)

    def __repr__(self) -> str:
        ends = ", ".join(f"{b.length:.4f} long to {b.attractor or 'none'}" for b in self.branches)
        return f"<UnstableSet of a saddle, multiplier {self.multiplier:.6f}: {ends}>"


def basin_boundary(
    basins: Basins,
    *,
    distance: float = 1e-3,
    width: float = 1e-12,
    turn: float = 0.02,
    near: float = 1e-4,
    max_labels: int = 100_000_000,
    progress: Progress = False,
) -> BasinBoundary:
    """Trace the boundaries of basins as curves, with their corners, and tell what they are.

    A slide loses a dimension: the strobe map cannot be inverted, and the stable set of a saddle is
    not grown backwards from it. It is found as the curve beside which trajectories differ.

    Parameters
    ----------
    basins : Basins
        The picture. What is thinner than its cells is missed where no centre meets it.
    distance : float
        Between polylines and boundary, in pictures: the picture is one wide and one high.
    width : float
        Of the two points beside each point of a curve, in pictures.
    turn : float
        The least turn of a corner, radians.
    near : float
        A point belongs to the stable set of a saddle if both sides come nearer to it than this
        before they part, in pictures.
    max_labels : int
        Trajectories at most.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in trajectories, of which
        the total is not known beforehand: it grows with what is done.

    Returns
    -------
    BasinBoundary

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `boundary` has what was finished.

    Notes
    -----
    Trajectories run at a relative tolerance of 1e-12. Chapter, section 4.7 and figure 4.16.
    """
    _require_basins(basins)
    width = number("width", width, "expected 1e-15 <= width < 1", least=1e-15, below=1.0)
    expected = "expected width < distance < 1"
    distance = number("distance", distance, expected, above=width, below=1.0)
    turn = number("turn", turn, "expected 0 < turn < pi", above=0.0, below=np.pi)
    near = number("near", near, "expected 0 < near < 1", above=0.0, below=1.0)
    max_labels = integer("max_labels", max_labels, most=MOST)
    picture, known = _picture(basins)
    with shown(progress, "label") as show:
        found = _core.basin_boundary(
            picture,
            known,
            [_columns(s) for s in basins.saddles],
            np.ascontiguousarray(basins.label).ravel(),
            distance,
            width,
            turn,
            near,
            max_labels,
            show,
        )
    result = BasinBoundary(
        curves=tuple(_curve(c) for c in found.curves),
        corners=tuple(_corner(c) for c in found.corners),
        unresolved=found.unresolved,
        stuck=found.stuck,
        labels=found.labels,
        status=found.status,
        message=found.message,
        grid=basins.grid,
        system=basins.system,
        params=basins.params,
    )
    ended(found.raised, boundary=result)
    return result


def unstable_set(
    basins: Basins,
    saddle: int = 0,
    *,
    point: int = 0,
    gap: float = 0.01,
    distance: float = 1e-6,
    near: float = 1e-4,
    length: float = 50.0,
    generations: int = 1000,
    max_points: int = 1_000_000,
) -> UnstableSet:
    """Grow the unstable set of a saddle of the strobe map, both branches.

    A first segment, from a point near the saddle to its image, is mapped again and again. Points
    are put in where they are far apart or the curve turns; none is interpolated.

    Parameters
    ----------
    basins : Basins
        The picture, with its saddles and attractors.
    saddle : int
        Index in `basins.saddles`.
    point : int
        The point of that cycle to begin at; the others' sets are its images.
    gap : float
        Between neighbours at most, in pictures: the picture is one wide and one high.
    distance : float
        Between polyline and curve, estimated, in pictures.
    near : float
        A branch ends where all of it is this near to an attractor, in pictures.
    length : float
        Of a branch at most, in pictures.
    generations, max_points : int
        Images of the first segment, and points of a branch, at most.

    Returns
    -------
    UnstableSet

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work; for a cycle that has not exactly one
        multiplier outside the unit circle.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `unstable` has what was finished.

    Notes
    -----
    Hobson, J. Comput. Phys. 104 (1993) 14-22.
    """
    _require_basins(basins)
    index = integer("saddle", saddle, 0)
    if index >= len(basins.saddles):
        refuse("saddle", saddle, f"expected an index of {len(basins.saddles)} saddles")
    chosen = basins.saddles[index]
    point = integer("point", point, 0)
    positive = "expected a number > 0"
    picture, known = _picture(basins)
    found = _core.unstable_set(
        picture,
        known,
        [_columns(chosen)],
        point,
        number("gap", gap, positive, above=0.0),
        number("distance", distance, positive, above=0.0),
        number("near", near, positive, above=0.0),
        number("length", length, positive, above=0.0),
        integer("generations", generations),
        integer("max_points", max_points, most=MOST),
    )
    result = UnstableSet(
        branches=tuple(_branch(b) for b in found.branches),
        direction=found.direction,
        multiplier=found.multiplier,
        turn=found.turn,
        saddle=chosen,
        grid=basins.grid,
        system=basins.system,
        params=basins.params,
    )
    ended(found.raised, unstable=result)
    return result


def _require_basins(basins: object) -> None:
    if not isinstance(basins, Basins):
        refuse("basins", basins, "expected Basins, as filippov.basins gives", TypeError)


def _picture(basins: Basins) -> tuple[_core.Picture, list[_core.AttractorColumns]]:
    """Give the compiled picture, and the attractors that it is to be given."""
    work, known = basins._labelling()
    return work.finder, known


def _columns(saddle: Saddle) -> _core.StrobeCycleColumns:
    return _core.StrobeCycleColumns(points=saddle.points.T, multipliers=saddle.multipliers)


def _curve(found: _core.BoundaryCurveColumns) -> BoundaryCurve:
    return BoundaryCurve(
        points=found.points,
        left_points=found.left_points,
        right_points=found.right_points,
        left=found.left,
        right=found.right,
        closed=found.closed,
        kind=KINDS[found.kind],
        saddle=found.saddle,
        periods=found.periods,
        approach=found.approach,
        distance=found.distance,
        coarse=found.coarse,
    )


def _corner(found: _core.BoundaryCorner) -> BoundaryCorner:
    x, y = found.at
    return BoundaryCorner((x, y), found.turn, found.error, found.curve, found.point)


def _branch(found: _core.UnstableBranchColumns) -> UnstableBranch:
    return UnstableBranch(
        points=np.ascontiguousarray(found.points.T),
        breaks=found.breaks,
        length=found.length,
        attractor=found.attractor,
        status=found.status,
        message=found.message,
    )
