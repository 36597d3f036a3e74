# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of trajectories; matplotlib is imported when one is drawn."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from filippov._orbits.sliding_region import SlidingRegion, sliding_region
from filippov._support.check import integer, number, one_of, refuse, word, words
from filippov._support.types import Bools, Floats

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from filippov._orbits.event_map import EventMap
    from filippov._orbits.lyapunov import Lyapunov
    from filippov._orbits.sliding_boundary import SlidingBoundary
    from filippov._runs.diagram import Diagram
    from filippov._runs.ensemble import Ensemble
    from filippov._runs.time_stepping import TimeSteps
    from filippov._runs.trajectory import Trajectory

Plot = TypeVar("Plot", bound=Callable[..., Any])

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
POINT: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 1.5, "rasterized": True}
SIDES = {-1: ("#1f5fa8", "h < 0"), 0: ("#101010", "sliding"), 1: ("#c0392b", "h > 0")}
# Curves of a map: the slide ends at the phase; the map starts with the rest of a slide.
MAP: dict[str, Any] = {"color": "#1f5fa8", "linewidth": 1.6, "zorder": 2.2}
PROLONGED: dict[str, Any] = {"color": "#e8a33d", "linewidth": 1.6, "linestyle": "--", "zorder": 2.1}
DIAGONAL: dict[str, Any] = {"color": "#808080", "linewidth": 0.8, "zorder": 1.5}
FIXED: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 7.0,
    "markeredgecolor": "#101010",
    "markeredgewidth": 1.2,
    "zorder": 3.0,
}
COBWEB: dict[str, Any] = {"color": "#2a7f3e", "linewidth": 0.8, "zorder": 2.4}
FAILED: dict[str, Any] = {"linestyle": "none", "marker": "x", "color": "#808080", "markersize": 5}
POINTS_PER_STEP = 12
MOST_POINTS = 200_000
REGION_TIMES = 24


def full_names(plot: Plot) -> Plot:
    """Give the last argument, keywords of lines, with matplotlib's full names: c is color."""

    @functools.wraps(plot)
    def named(*args: Any) -> Any:  # noqa: ANN401
        from matplotlib.cbook import normalize_kwargs
        from matplotlib.lines import Line2D

        with artist_keywords():
            return plot(*args[:-1], normalize_kwargs(args[-1], Line2D))

    return cast("Plot", named)


@contextlib.contextmanager
def artist_keywords() -> Iterator[None]:
    """Refuse what is no keyword as any function does; matplotlib has an AttributeError for it."""
    try:
        yield
    except AttributeError as error:
        if "unexpected keyword argument" not in str(error):
            raise
        raise TypeError(
            f"{error}; expected arguments of plot, or keywords of its artists"
        ) from None


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        if not hasattr(ax, "imshow"):
            refuse("ax", ax, "expected Axes of matplotlib, or None", TypeError)
        return ax
    import matplotlib.pyplot as plt

    return plt.gca()


def show_range(ax: Axes, values: Floats) -> None:
    """Have the axis lead over all values, also where there is nothing to draw."""
    if values.size:
        ax.update_datalim([(values.min(), 0), (values.max(), 0)], updatey=False)
        ax.autoscale_view()


@full_names
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
    known = (*state, "t", "s")
    if x is not None:
        x = word("x or y", x, known)
    if x is None:
        x = state[0] if planar and y is None else "t"
    if y is None:
        y = state[1] if planar and x != "t" else state
    names = words("x or y", y, known, "expected one of " + ", ".join(map(repr, known)))
    if not names:
        refuse("y", y, "expected a name or several")

    steps = max(trajectory.stats.steps, 1)
    each = trajectory._stretches(int(np.clip(MOST_POINTS // steps, 1, POINTS_PER_STEP)))
    size = np.diff(each.ends)
    slides_in = (each.mode == 0).reshape(size.size, -1).any(axis=1)
    over = trajectory._quantity(x, each)
    values = {name: trajectory._quantity(name, each) for name in names}

    ax = _axes(ax)
    own_colour = "color" in artist_kw
    artists: list[Artist] = []
    for k, name in enumerate(names):
        for slides in (False, True):
            mine = slides_in == slides
            if not mine.any():
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
            drawn = np.repeat(mine, size)
            between = np.cumsum(size[mine])[:-1]  # where NaN lifts the pen
            line = (np.insert(v[drawn], between, np.nan) for v in (over, values[name]))
            artists += ax.plot(*line, **style)
    if not ax.get_xlabel():
        ax.set_xlabel(x)
    if not ax.get_ylabel() and len(names) == 1:
        ax.set_ylabel(names[0])
    return artists


@full_names
def plot_phase(
    trajectory: Trajectory,
    ax: Axes | None,
    bounds: dict[str, tuple[float, float]] | None,
    artist_kw: dict[str, Any],
) -> list[Artist]:
    """Draw a phase portrait over the sliding region; see `Trajectory.plot_phase`."""
    system = trajectory.system
    if system.dim != 2 or system.surfaces != 1:
        refuse(
            "system", system.name, "expected a planar system with one surface (a kink is one, too)"
        )
    drawn = trajectory._stretches(4).y
    cloud = drawn if drawn.size else trajectory.y
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


@full_names
def plot_sliding_region(
    region: SlidingRegion, ax: Axes | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw a sliding region at one time; see `SlidingRegion.plot`."""
    ax = _axes(ax)
    artists: list[Artist] = []
    for piece in region.pieces:
        label = None if artists else "sliding region"
        artists += ax.plot(piece[0], piece[1], **(REGION | {"label": label} | artist_kw))
    if region.boundary.size:
        artists += ax.plot(*region.boundary, label="its boundary", **BOUNDARY)
    _name_axes(ax, *region.system.state)
    return artists


@full_names
def plot_ensemble(
    ensemble: Ensemble,
    ax: Axes | None,
    x: str | None,
    y: str | None,
    artist_kw: dict[str, Any],
) -> list[Artist]:
    """Draw the ends of an ensemble's members; see `Ensemble.plot`."""
    shape = ensemble.shape
    swept = {name: v for name, v in ensemble.params.items() if np.ndim(v) > 0}
    columns = dict(zip(ensemble.state, ensemble.y, strict=True)) | swept | {"t": ensemble.t}
    starts = f"{ensemble.state[0]} at the start"
    if x is None:
        x = ensemble.state[0] if len(ensemble.state) > 1 else next(iter(swept), starts)
    else:
        x = word("x", x, columns)
    y = ensemble.state[min(1, len(ensemble.state) - 1)] if y is None else word("y", y, columns)
    columns[starts] = ensemble.y0[0]
    across, along = (np.broadcast_to(columns[name], shape).ravel() for name in (x, y))
    modes = ensemble.mode if ensemble.mode.ndim == len(shape) else ensemble.mode[:1]
    sides = SIDES if modes.size or not ensemble.t.size else {None: ("#1f5fa8", None)}
    ok = (ensemble.status == "ok").ravel()
    ax = _axes(ax)
    artists: list[Artist] = []
    for side, (colour, label) in sides.items():
        mine = ok & (modes.ravel() == side) if side is not None else ok
        if mine.any():
            style = POINT | {"color": colour, "label": label, "markersize": 4} | artist_kw
            artists += ax.plot(across[mine], along[mine], **style)
    if not ok.all():
        artists += ax.plot(across[~ok], along[~ok], label="failed", **FAILED)
    _name_axes(ax, x, y)
    return artists


@full_names
def plot_time_steps(steps: TimeSteps, ax: Axes | None, artist_kw: dict[str, Any]) -> list[Artist]:
    """Draw the components over time; see `TimeSteps.plot`."""
    ax = _axes(ax)
    artists: list[Artist] = []
    for k, (name, values) in enumerate(zip(steps.system.state, steps.y, strict=True)):
        style: dict[str, Any] = {"linewidth": 1.2, "color": f"C{k}", "label": name} | artist_kw
        artists += ax.plot(steps.t, values, **style)
    if not ax.get_xlabel():
        ax.set_xlabel("t")
    return artists


@full_names
def plot_lyapunov(lyapunov: Lyapunov, ax: Axes | None, artist_kw: dict[str, Any]) -> list[Artist]:
    """Draw exponents with their errors; see `Lyapunov.plot`."""
    ax = _axes(ax)
    order = np.arange(1, lyapunov.exponents.size + 1)
    known = np.isfinite(lyapunov.exponents)
    style: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": "#1f5fa8", "capsize": 4}
    points, caps, bars = ax.errorbar(
        order[known], lyapunov.exponents[known], lyapunov.error[known], **(style | artist_kw)
    )
    artists: list[Artist] = [points, *caps, *bars, ax.axhline(0.0, **DIAGONAL)]
    if not known.all():
        bottom = ax.get_ylim()[0]
        arrows: dict[str, Any] = {"linestyle": "none", "marker": "v", "color": "#101010"}
        gone = order[~known]
        artists += ax.plot(gone, np.full(gone.size, bottom), label="-inf", clip_on=False, **arrows)
        ax.set_ylim(bottom=bottom)
    ax.set_xticks(order)
    _name_axes(ax, "exponent", "per unit of time")
    return artists


def _name_axes(ax: Axes, x: str, y: str) -> None:
    """Label what has no label yet."""
    if not ax.get_xlabel():
        ax.set_xlabel(x)
    if not ax.get_ylabel():
        ax.set_ylabel(y)


def _same(a: SlidingRegion, b: SlidingRegion) -> bool:
    return len(a.pieces) == len(b.pieces) and all(
        p.shape == q.shape and np.allclose(p, q, rtol=1e-12, atol=1e-12)
        for p, q in zip(a.pieces, b.pieces, strict=True)
    )


@full_names
def plot_diagram(
    diagram: Diagram, ax: Axes | None, y: str | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw the points of a diagram; see `Diagram.plot`."""
    forced = bool((diagram.forcing > 0).any())
    if y is None:
        y = "phase" if forced and diagram.section != ("strobe",) else diagram.state[0]
    y = word("y", y, [*(["phase"] if forced else []), "t_local", *diagram.state])
    if y in diagram.state:
        column = diagram.y[diagram.state.index(y)]
    else:
        column = diagram.phase if y == "phase" else diagram.t_local
    ax = _axes(ax)
    artists: list[Artist] = []
    for side, (colour, label) in SIDES.items():
        mine = diagram.boundary == side
        if mine.any():
            style = {**POINT, "color": colour, "label": label} | artist_kw
            artists += ax.plot(diagram.param[mine], column[mine], **style)
    show_range(ax, diagram.values)
    _name_axes(ax, diagram.parameter, "phase (rad)" if y == "phase" else y)
    return artists


@full_names
def plot_sliding_boundary(
    boundary: SlidingBoundary, ax: Axes | None, y: str | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw a boundary of the sliding region over the phase; see `SlidingBoundary.plot`."""
    state = boundary.system.state
    y = state[0] if y is None else word("y", y, state)
    row = state.index(y)
    # both parts of the curve go up to the points between them
    cuts = [2 * np.pi * point.t / boundary.t[-1] for point in boundary.tangential]
    at = np.searchsorted(boundary.phase, cuts)
    phase = np.insert(boundary.phase, at, cuts)
    values = np.insert(boundary.x[row], at, [point.x[row] for point in boundary.tangential])
    drift = np.insert(boundary.drift, at, 0.0)
    ax = _axes(ax)
    artists: list[Artist] = []
    name = f"s = {boundary.side:+d}"
    for sign, line, what in ((1, "-", "slides end"), (-1, "--", "slides go inward")):
        if (sign * drift > 0).any():
            style: dict[str, Any] = {"color": SIDES[boundary.side][0], "linestyle": line}
            style |= {"linewidth": 1.4, "label": f"{name}, {what}"} | artist_kw
            shown = np.where(sign * drift >= 0, values, np.nan)
            artists += ax.plot(phase, shown, **style)
    if cuts:
        points = [point.x[row] for point in boundary.tangential]
        artists += ax.plot(cuts, points, label="tangential slide", **BOUNDARY)
    _name_axes(ax, "phase (rad)", y)
    return artists


@full_names
def plot_event_map(
    graph: EventMap,
    ax: Axes | None,
    boundary: int | None,
    cobweb: float | None,
    iterations: int,
    artist_kw: dict[str, Any],
) -> list[Artist]:
    """Draw a transition map with its diagonal and fixed points; see `EventMap.plot`."""
    if boundary is not None:
        boundary = one_of("boundary", boundary, (-1, 1), "expected -1 or +1, or None")
    returns = graph.true_exit & (graph.value_boundary == graph.boundary)
    drawn = [b for b in (-1, 1) if (graph.boundary[returns] == b).any()] or [-1, 1]
    drawn = drawn if boundary is None else [boundary]

    ax = _axes(ax)
    artists: list[Artist] = []
    labelled: set[str] = set()
    for b in drawn:
        where = f" from s = {b:+d}" if len(drawn) > 1 else ""
        for true_exit, style, what in (
            (True, MAP, "transition map"),
            (False, PROLONGED, "starts with a slide: never an image"),
        ):
            for target in (-1, 1):
                chosen = (graph.boundary == b) & (graph.true_exit == true_exit)
                chosen &= graph.value_boundary == target
                if not chosen.any():
                    continue
                label = None if what + where in labelled else what + where
                labelled.add(what + where)
                look = style | {"label": label} | artist_kw
                if len(drawn) > 1 and "color" not in artist_kw:
                    look["alpha"] = 1.0 if b < 0 else 0.5
                artists += ax.plot(*_curve(graph, chosen), **look)
    turn = 2 * np.pi
    artists += ax.plot([0, turn], [0, turn], **DIAGONAL)
    if cobweb is not None:
        start = number("cobweb", cobweb)
        stairs = _staircase(graph, start % turn, drawn[0], integer("iterations", iterations))
        artists += ax.plot(*stairs, label="iterates", **COBWEB)
    for stable in (True, False):
        met = [f.phase for f in graph.fixed_points() if f.stable == stable and f.boundary in drawn]
        if met:
            face = "#101010" if stable else "white"
            label = "stable" if stable else "unstable"
            artists += ax.plot(met, met, markerfacecolor=face, label=label, **FIXED)
    if not ax.get_xlabel():
        ax.set_xlabel("phase")
    if not ax.get_ylabel():
        many = graph.iterate > 1
        ax.set_ylabel(f"phase {graph.iterate} transitions on" if many else "phase of the next one")
    return artists


def _staircase(
    graph: EventMap, phase: float, boundary: int, iterations: int
) -> tuple[list[float], list[float]]:
    """Lead from the diagonal up to the graph and across to the diagonal again, and so on."""
    x, y = [phase], [phase]
    for _ in range(iterations):
        (image,), (there,) = graph._images(np.array([phase]), np.array([boundary]))
        if not np.isfinite(image):
            break
        x += [phase, image]
        y += [image, image]
        phase, boundary = float(image), int(there)
    return x, y


def _curve(graph: EventMap, chosen: Bools) -> tuple[Floats, Floats]:
    """Make a curve of the chosen samples; NaN lifts the pen at jumps."""
    k = np.flatnonzero(chosen)
    x, y = graph.phase[k], graph.value[k]
    # breaks are bisected: a leap between close neighbours is a jump
    leaps = (np.diff(x) < 1e-12) & (np.abs(np.diff(y)) > 1e-5)
    lifted = leaps | (np.diff(k) > 1) | (np.abs(np.diff(y)) > np.pi)
    at = np.flatnonzero(lifted) + 1
    return np.insert(x, at, np.nan), np.insert(y, at, np.nan)
