# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of boundaries of basins and of unstable sets."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from .plot import _axes, full_names

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from filippov._basins.boundary import BasinBoundary, UnstableSet
    from filippov._basins.cells import Grid

LINES = {"stable_set": "-", "jump": "--", "unknown": ":"}
BOUNDARY: dict[str, Any] = {"color": "#101010", "linewidth": 1.2, "zorder": 2.0}
CORNER: dict[str, Any] = {
    "linestyle": "none",
    "marker": "D",
    "markersize": 4.5,
    "markerfacecolor": "white",
    "markeredgecolor": "#101010",
    "markeredgewidth": 1.0,
    "zorder": 2.5,
}
UNSTABLE: dict[str, Any] = {"color": "#b2182b", "linewidth": 1.4, "zorder": 2.2}


def _frame(grid: Grid, ax: Axes) -> None:
    """Frame the picture; labels that are there stay."""
    ax.set(
        xlabel=ax.get_xlabel() or grid.names[0],
        ylabel=ax.get_ylabel() or grid.names[1],
        xlim=(grid.low[0], grid.high[0]),
        ylim=(grid.low[1], grid.high[1]),
    )


@full_names
def plot_boundary(
    boundary: BasinBoundary, ax: Axes | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw a `BasinBoundary`."""
    ax = _axes(ax)
    artists: list[Artist] = []
    for curve in boundary.curves:
        points, kind = curve.points, curve.kind
        if curve.closed:
            points, kind = np.c_[points, points[:, :1]], np.r_[kind, kind[:1]]
        cuts = [0, *(np.flatnonzero(kind[1:] != kind[:-1]) + 1), kind.size]
        for first, last in itertools.pairwise(cuts):
            piece = points[:, first : last + 1]  # to the next piece
            style = BOUNDARY | {"linestyle": LINES[str(kind[first])]}
            artists += ax.plot(*piece, **(style | artist_kw))
    if boundary.corners:
        at = np.array([corner.position for corner in boundary.corners]).T
        artists += ax.plot(*at, **CORNER)
    _frame(boundary.grid, ax)
    return artists


@full_names
def plot_unstable_set(
    unstable: UnstableSet, ax: Axes | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw an `UnstableSet`."""
    ax = _axes(ax)
    artists: list[Artist] = []
    for branch in unstable.branches:
        points = branch.points[list(unstable.grid.coordinates)]
        for piece in np.split(points, branch.breaks + 1, axis=1):
            artists += ax.plot(*piece, **(UNSTABLE | artist_kw))
    _frame(unstable.grid, ax)
    return artists
