# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of basins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from filippov._support.check import word

from .plot import _axes, artist_keywords

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.colors import BoundaryNorm, ListedColormap

    from filippov._basins.basin_sweep import BasinSweep
    from filippov._basins.basins import Basins
    from filippov._basins.cells import CellMap, Grid, Integers

ESCAPED, UNRESOLVED = "#ffffff", "#101010"
#: Basins take these in turn.
BASINS = ("#dcebf8", "#f0a94b", "#4f9d69", "#7b4a9a", "#f3c9d3", "#b5651d", "#2f5d8a", "#c9d37a")
ATTRACTOR: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 6.0,
    "markeredgecolor": "#101010",
    "markeredgewidth": 1.0,
    "zorder": 3.0,
}
SADDLE: dict[str, Any] = {
    "linestyle": "none",
    "marker": "X",
    "markersize": 7.0,
    "markerfacecolor": "white",
    "markeredgecolor": "#101010",
    "markeredgewidth": 1.0,
    "zorder": 3.0,
}
LABELS = ("label", "time", "plain")


def _colours(labels: int) -> tuple[ListedColormap, BoundaryNorm]:
    """Colours of -1, 0, 1, ..., `labels`."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    colours = [ESCAPED, UNRESOLVED, *(BASINS[k % len(BASINS)] for k in range(labels))]
    return ListedColormap(colours), BoundaryNorm(np.arange(-1.5, labels + 1), len(colours))


def _image(grid: Grid, values: Any, ax: Axes, artist_kw: dict[str, Any]) -> Any:  # noqa: ANN401
    """Draw an array over the grid, the first axis to the right."""
    given = {"origin": "lower", "aspect": "auto", "interpolation": "nearest"} | artist_kw
    with artist_keywords():
        image = ax.imshow(values.T, extent=grid.extent, **given)
    ax.set(xlabel=grid.names[0], ylabel=grid.names[1])
    return image


def _groups(group: Integers, n: int, grid: Grid, ax: Axes, artist_kw: dict[str, Any]) -> Any:  # noqa: ANN401
    """Draw the basins of plain cell mapping: outside white, unknown black."""
    values = np.where(group >= 0, group + 1, np.where(group == -1, -1, 0))
    colours, norm = _colours(n)
    return _image(grid, values, ax, {"cmap": colours, "norm": norm} | artist_kw)


def plot_cell_map(cells: CellMap, ax: Axes | None, artist_kw: dict[str, Any]) -> list[Artist]:
    """Draw a `CellMap`."""
    ax = _axes(ax)
    grid = cells.grid
    artists: list[Artist] = [_groups(cells.group, len(cells.groups), grid, ax, artist_kw)]
    for k, group in enumerate(cells.groups):
        first, second = (grid.centres(axis)[group.cells[:, axis]] for axis in (0, 1))
        colour = {"markerfacecolor": BASINS[k % len(BASINS)]}
        artists += ax.plot(first, second, **(ATTRACTOR | colour))
    return artists


def plot_labels(
    grid: Grid, label: Integers, ax: Axes | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw an array of labels over a grid's rectangle."""
    colours, norm = _colours(max(int(label.max()), 1))
    return [_image(grid, label, _axes(ax), {"cmap": colours, "norm": norm} | artist_kw)]


def plot_basins(
    basins: Basins, ax: Axes | None, what: str, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw `Basins`."""
    what = word("what", what, LABELS)
    ax = _axes(ax)
    grid = basins.grid
    artists: list[Artist]
    if what == "plain":
        groups = len(basins.plain_groups)
        artists = [_groups(basins.plain_group, groups, grid, ax, artist_kw)]
    elif what == "time":
        times = np.ma.masked_less(basins.time, 0)
        artists = [_image(grid, times, ax, {"cmap": "viridis"} | artist_kw)]
        ax.figure.colorbar(artists[0], ax=ax, label="forcing periods")  # type: ignore[arg-type]
    else:
        colours, norm = _colours(len(basins.attractors))
        artists = [_image(grid, basins.label, ax, {"cmap": colours, "norm": norm} | artist_kw)]
    for k, attractor in enumerate(basins.attractors):
        at = attractor.points[list(grid.coordinates)]
        colour = {"markerfacecolor": BASINS[k % len(BASINS)]}
        few = {} if attractor.periodic else {"marker": ".", "markersize": 1.5, "rasterized": True}
        name: dict[str, Any] = {"label": f"attractor {k + 1}"}
        artists += ax.plot(*at, **(ATTRACTOR | colour | few | name))
    for k, saddle in enumerate(basins.saddles):
        name = {"label": "saddle" if k == 0 else None}
        artists += ax.plot(*saddle.points[list(grid.coordinates)], **(SADDLE | name))
    ax.set(xlim=(grid.low[0], grid.high[0]), ylim=(grid.low[1], grid.high[1]))
    return artists


def plot_sweep(sweep: BasinSweep, ax: Axes | None, artist_kw: dict[str, Any]) -> list[Artist]:
    """Draw a `BasinSweep`."""
    ax = _axes(ax)
    shares = np.nan_to_num(sweep.fractions)
    columns = [*shares.T, sweep.escaped, sweep.unresolved]
    names = [*(f"attractor {n}" for n in sweep.ids), "escaped", "unresolved"]
    colours = [*(BASINS[k % len(BASINS)] for k in range(len(sweep.ids))), ESCAPED, UNRESOLVED]
    artists: list[Artist] = []
    below = np.zeros(sweep.values.size)
    for share, name, colour in zip(columns, names, colours, strict=True):
        if share.any():
            given: dict[str, Any] = {
                "facecolor": colour,
                "edgecolor": "#606060",
                "linewidth": 0.5,
                "label": name,
            }
            with artist_keywords():
                area = ax.fill_between(sweep.values, below, below + share, **(given | artist_kw))
            artists.append(area)
        below = below + share
    ax.set(xlabel=sweep.parameter, ylabel="share of the picture", ylim=(0, 1))
    return artists
