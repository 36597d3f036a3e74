# SPDX-License-Identifier: BSD-3-Clause
"""The sliding region of a planar system."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from filippov._results.dataset import dataset
from filippov._results.store import Stored
from filippov._support.check import integer, number, refuse
from filippov._support.sound import complete, require, shaped
from filippov._support.types import Bools, Floats
from filippov._system.bounds import Bounds, ranges
from filippov._system.system import Params, System

from .geometry import Tangency, tangencies_at

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["SlidingRegion", "sliding_region", "surface_curves"]


@dataclass(frozen=True, eq=False, repr=False)
class SlidingRegion(Stored):
    """Where a planar system slides at one time: attracting, `L1 > 0 > L2`, so `|s| < 1`."""

    t: float  #: the time
    pieces: tuple[Floats, ...]  #: curves on the surface, each of shape (2, k)
    boundary: Floats  #: points where a piece ends because |s| = 1, shape (2, m)
    tangencies: tuple[Tangency, ...]  #: the same points, each with what it is
    system: System
    params: Params

    _parts = (Tangency,)

    def _verify(self) -> None:
        complete(self.params, self.system.params)
        require(self.system.dim == 2, f"system is {self.system.name}")
        for piece in (*self.pieces, self.boundary):
            shaped((2, piece.shape[-1]), pieces=piece)
        n = self.boundary.shape[1]
        require(len(self.tangencies) == n, f"tangencies has {len(self.tangencies)}, expected {n}")
        require(all(len(each.x) == 2 for each in self.tangencies), "tangencies have other states")

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the region and its boundary in the plane of the state.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the region's lines.

        Returns
        -------
        list of artists
            A line for each piece, then the points of the boundary.
        """
        from filippov._plot.plot import plot_sliding_region

        return plot_sliding_region(self, ax, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the region as an `xarray.Dataset` over the points of all pieces."""
        lengths = [piece.shape[1] for piece in self.pieces]
        variables: dict[str, Any] = {
            "x": (("state", "point"), np.concatenate([np.empty((2, 0)), *self.pieces], axis=1)),
            "piece": ("point", np.repeat(np.arange(len(lengths)), lengths)),
            "boundary": (("state", "end"), self.boundary),
        }
        return dataset(self, variables, {"state": list(self.system.state)})

    def __repr__(self) -> str:
        return (
            f"<SlidingRegion of {self.system.name} at t = {self.t:.9g}: {len(self.pieces)} pieces,"
            f" {self.boundary.shape[1]} points of the boundary>"
        )


def sliding_region(
    sys: System,
    t: float = 0.0,
    *,
    bounds: Bounds,
    params: Mapping[str, float] | None = None,
) -> SlidingRegion:
    """Find the sliding region of a planar system within a rectangle.

    The surface is found on a grid, put on `h = 0` to rounding, and cut where |s| = 1 by bisection.
    A closed loop or a piece of region smaller than a cell of the grid is missed.

    Parameters
    ----------
    sys : System
        With two state components and one surface.
    t : float
        The time.
    bounds : mapping
        Range of each component: `{"y": (-6, 6), "v": (0, 2)}`, with the number of cells as an
        optional third entry (100 by default).
    params : mapping, optional
        Parameter values by name that replace `sys.params`.

    Returns
    -------
    SlidingRegion
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a planar System with one surface", TypeError)
    if sys.dim != 2 or sys.surfaces != 1:
        refuse("sys", sys.name, "expected a planar System with one surface (a kink is one, too)")
    time = number("t", t)
    axes = _axes(sys, bounds)
    values = sys._merged(params)
    pieces: list[Floats] = []
    edges: list[Floats] = []
    for curve in _curves(sys, time, axes, values):
        inside = _slides(sys, time, curve, values)
        # each change between neighbours is bisected along the surface
        flips = np.flatnonzero(inside[:-1] != inside[1:])
        cuts = _cut(sys, time, curve[:, flips], curve[:, flips + 1], inside[flips], values)
        edges.append(cuts)
        starts = [0, *(flips + 1)]
        ends = [*(flips + 1), curve.shape[1]]
        for k, (a, b) in enumerate(zip(starts, ends, strict=True)):
            if not inside[a]:
                continue
            parts = [curve[:, a:b]]
            if k > 0:
                parts.insert(0, cuts[:, k - 1 : k])
            if k < len(flips):
                parts.append(cuts[:, k : k + 1])
            pieces.append(np.concatenate(parts, axis=1))
    boundary = np.concatenate(edges, axis=1) if edges else np.empty((2, 0))
    kinds = tangencies_at(sys, time, boundary, sys._values(values))
    return SlidingRegion(time, tuple(pieces), boundary, kinds, sys, values)


def _axes(sys: System, bounds: Bounds) -> tuple[Floats, Floats]:
    axes = []
    for name, (low, high, *rest) in zip(sys.state, ranges(sys, bounds, most=3), strict=True):
        cells = integer(f"bounds[{name!r}][2]", rest[0], most=100_000) if rest else 100
        axes.append(np.linspace(low, high, cells + 1))
    return axes[0], axes[1]


def _curves(sys: System, t: float, axes: tuple[Floats, Floats], params: Params) -> list[Floats]:
    """Find all surfaces as curves, by marching squares."""
    if sys.surfaces == 0:
        return []
    u, v = axes
    grid = np.stack(np.meshgrid(u, v, indexing="ij"))
    h = np.asarray(sys.h(t, grid.reshape(2, -1), params)).reshape(sys.surfaces, u.size, v.size)
    values = sys._values(params)

    def on_surface(j: int, points: list[Floats]) -> Floats:
        return sys._model.project(np.array([t]), np.array(points), j, values)

    return [
        curve
        for j, each in enumerate(h)
        for curve in _curves_of(grid, each, functools.partial(on_surface, j))
    ]


def _curves_of(
    grid: Floats, h: Floats, on_surface: Callable[[list[Floats]], Floats]
) -> list[Floats]:
    """Find h = 0 from its values on a grid."""
    above = h > 0
    nu, nv = h.shape
    # A crossed edge is known by its first corner and its direction (0: along u, 1: along v).
    points: dict[tuple[int, int, int], int] = {}
    found: list[Floats] = []
    for axis, (di, dj) in enumerate([(1, 0), (0, 1)]):
        a = (slice(None, nu - di), slice(None, nv - dj))
        b = (slice(di, None), slice(dj, None))
        for i, j in np.argwhere(above[a] != above[b]):
            h0, h1 = h[i, j], h[i + di, j + dj]
            corner, other = grid[:, i, j], grid[:, i + di, j + dj]
            points[int(i), int(j), axis] = len(found)
            found.append(corner + (other - corner) * (h0 / (h0 - h1)))
    if not found:
        return []
    moved = on_surface(found)

    links: dict[int, list[int]] = {k: [] for k in range(len(found))}
    cells = {
        (i - di, j - dj)
        for i, j, axis in points
        for di, dj in [(0, 0), (0, 1) if axis == 0 else (1, 0)]
    }
    for i, j in sorted(cells):
        edges = [(i, j, 0), (i, j, 1), (i, j + 1, 0), (i + 1, j, 1)]
        met = [points[edge] for edge in edges if edge in points]
        inside = 0 <= i < nu - 1 and 0 <= j < nv - 1
        for k in range(0, len(met) - 1 if inside else 0, 2):
            links[met[k]].append(met[k + 1])
            links[met[k + 1]].append(met[k])
    return [moved[chain].T for chain in _chains(links)]


def _chains(links: dict[int, list[int]]) -> list[list[int]]:
    """Paths through a graph whose nodes have at most two neighbours; loops are closed."""
    left = set(links)
    chains = []
    for start in [*(k for k in links if len(links[k]) < 2), *links]:
        if start not in left:
            continue
        chain = [start]
        left.discard(start)
        while ahead := [k for k in links[chain[-1]] if k in left]:
            chain.append(ahead[0])
            left.discard(ahead[0])
        if len(chain) > 2 and start in links[chain[-1]]:
            chain.append(start)
        if len(chain) > 1:
            chains.append(chain)
    return chains


def surface_curves(sys: System, t: float, box: Floats, params: Params) -> list[Floats]:
    """Curves of the surfaces of a planar system in a rectangle, box of shape (2, 2): low, high."""
    u, v = (np.linspace(low, high, 101) for low, high in box)
    return _curves(sys, t, (u, v), params)


def _slides(sys: System, t: float, x: Floats, params: Params) -> Bools:
    l1, l2 = sys.normal_components(t, x, params)
    inside: Bools = (l1 > 0) & (l2 < 0)
    return inside


def _cut(sys: System, t: float, a: Floats, b: Floats, a_inside: Bools, params: Params) -> Floats:
    """Points between a and b where sliding begins or ends."""
    if a.shape[1] == 0:
        return np.empty((2, 0))
    p = sys._values(params)
    for _ in range(52):
        middle = sys._model.project(np.array([t]), np.ascontiguousarray((0.5 * (a + b)).T), 0, p).T
        same = _slides(sys, t, middle, params) == a_inside
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    return 0.5 * (a + b)
