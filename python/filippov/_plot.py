# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of trajectories. matplotlib is imported here and nowhere else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._check import refuse
from ._sliding_region import SlidingRegion, sliding_region
from ._types import Floats

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from ._trajectory import Trajectory

SLIP = {"color": "#1f5fa8", "linewidth": 1.2, "zorder": 2.2}
STICK = {"color": "#101010", "linewidth": 3.0, "zorder": 2.3, "solid_capstyle": "butt"}
REGION: dict[str, Any] = {
    "color": "#e8a33d",
    "linewidth": 9.0,
    "solid_capstyle": "butt",
    "zorder": 1.5,
}
BOUNDARY: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 3.5,
    "markerfacecolor": "white",
    "markeredgecolor": "#7a4a00",
    "markeredgewidth": 0.8,
    "zorder": 2.1,
}
POINTS_PER_STEP = 12
MOST_POINTS = 200_000
REGION_TIMES = 24


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.gca()


def plot_trajectory(
    trajectory: Trajectory,
    ax: Axes | None,
    x: str | None,
    y: str | Sequence[str] | None,
    artist_kw: dict[str, Any],
) -> list[Artist]:
    """Draw a trajectory, one line for slip and one for sliding; see `Trajectory.plot`."""
    state = trajectory.system.state
    planar = len(state) == 2
    if x is None:
        x = state[0] if planar and y is None else "t"
    if y is None:
        y = state[1] if planar and x != "t" else state
    names = [y] if isinstance(y, str) else list(y)
    if not names:
        refuse("y", y, "expected a name or several")

    steps = max(trajectory.stats.steps, 1)
    pieces = list(trajectory.segments(int(np.clip(MOST_POINTS // steps, 1, POINTS_PER_STEP))))
    lines: dict[tuple[str, bool], list[Floats]] = {}
    for piece in pieces:
        slides = 0 in np.atleast_1d(piece.mode)
        for name in names:
            xy = np.array([trajectory._quantity(x, piece), trajectory._quantity(name, piece)])
            # NaN lifts the pen between pieces
            lines.setdefault((name, slides), []).extend([xy, np.full((2, 1), np.nan)])

    ax = _axes(ax)
    own_colour = {"color", "c"} & artist_kw.keys()
    artists: list[Artist] = []
    for k, name in enumerate(names):
        for slides in (False, True):
            if (name, slides) not in lines:
                continue
            style: dict[str, Any] = dict(STICK if slides else SLIP)
            if own_colour:
                del style["color"]
            elif len(names) > 1 and not slides:
                style["color"] = f"C{k}"
            what = "sliding (stick)" if slides else "slip"
            style["label"] = f"{name}, {what}" if len(names) > 1 else what
            style |= artist_kw
            if slides and "linewidth" in artist_kw:
                style["linewidth"] = 2.5 * artist_kw["linewidth"]
            data = np.concatenate(lines[name, slides][:-1], axis=1)
            artists += ax.plot(data[0], data[1], **style)
    if not ax.get_xlabel():
        ax.set_xlabel(x)
    if not ax.get_ylabel() and len(names) == 1:
        ax.set_ylabel(names[0])
    return artists


def plot_phase(
    trajectory: Trajectory,
    ax: Axes | None,
    bounds: dict[str, tuple[float, float]] | None,
    artist_kw: dict[str, Any],
) -> list[Artist]:
    """Draw a phase portrait over the sliding region; see `Trajectory.plot_phase`."""
    system = trajectory.system
    if system.dim != 2 or system.surfaces != 1:
        refuse("system", system.name, "expected a planar system with one surface")
    drawn = list(trajectory.segments(4))
    cloud = np.concatenate([piece.y for piece in drawn] or [trajectory.y], axis=1)
    if bounds is None:
        low, high = cloud.min(axis=1), cloud.max(axis=1)
        margin = 0.25 * np.maximum(high - low, 1e-3)
        bounds = {
            name: (float(a - m), float(b + m))
            for name, a, b, m in zip(system.state, low, high, margin, strict=True)
        }
    period = system.period(trajectory.params)
    t0, t1 = (0.0, period) if period is not None else trajectory.events["t"][[0, -1]]
    times = t0 + (t1 - t0) * np.arange(REGION_TIMES) / REGION_TIMES
    regions = [sliding_region(system, t, bounds=bounds, params=trajectory.params) for t in times]
    if all(_same(region, regions[0]) for region in regions):
        regions = regions[:1]

    ax = _axes(ax)
    artists: list[Artist] = []
    alpha = 1 - (1 - 0.8) ** (1 / len(regions))  # all of them together: 0.8
    for region in regions:
        for piece in region.pieces:
            artists += ax.plot(piece[0], piece[1], alpha=alpha, **REGION)
    if artists:  # for the legend: one layer would be too light
        artists += ax.plot([], [], alpha=0.8, label="sliding region", **REGION)
    edges = np.concatenate([region.boundary for region in regions], axis=1)
    boundary = "its boundary" if len(regions) == 1 else "its boundary, in time"
    if edges.size:
        artists += ax.plot(edges[0], edges[1], label=boundary, **BOUNDARY)
    return artists + plot_trajectory(trajectory, ax, None, None, artist_kw)


def _same(a: SlidingRegion, b: SlidingRegion) -> bool:
    return len(a.pieces) == len(b.pieces) and all(
        p.shape == q.shape and np.allclose(p, q, rtol=1e-12, atol=1e-12)
        for p, q in zip(a.pieces, b.pieces, strict=True)
    )
