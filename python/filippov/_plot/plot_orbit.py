# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of orbits and branches; matplotlib is imported when one is drawn."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from filippov._orbits.sliding_region import surface_curves
from filippov._support.check import word
from filippov._support.types import Floats

from .plot import _axes, full_names, plot_trajectory, show_range

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from filippov._orbits.branch import Branch, SpecialPoint
    from filippov._orbits.orbit import Orbit

SURFACE: dict[str, Any] = {"color": "#7a4a00", "linewidth": 0.8, "zorder": 1.6}
EVENT: dict[str, Any] = {"linestyle": "none", "color": "#101010", "markersize": 6, "zorder": 2.5}
EVENTS: dict[str, dict[str, Any]] = {
    "enter_sliding": {"marker": "o", "markerfacecolor": "white", "label": "slide begins"},
    "exit_sliding": {"marker": "s", "label": "slide ends"},
    "cross": {"marker": "x", "label": "crosses"},
    "graze": {"marker": "^", "label": "grazes"},
    "slide_extremum": {"marker": "D", "label": "touches |s| = 1"},
}
STABLE: dict[str, Any] = {"color": "#1f5fa8", "linewidth": 1.5, "linestyle": "-"}
UNSTABLE: dict[str, Any] = {"color": "#1f5fa8", "linewidth": 1.2, "linestyle": "--"}
BIFURCATION: dict[str, Any] = {"linestyle": "none", "markersize": 7, "zorder": 3}
# Each kind its own marker: sliding bifurcations full, smooth ones open.
BIFURCATIONS: dict[str, dict[str, Any]] = {
    "crossing-sliding": {"marker": "X", "color": "#c0392b"},
    "grazing-sliding": {"marker": "^", "color": "#c0392b"},
    "switching-sliding": {"marker": "s", "color": "#c0392b"},
    "adding-sliding": {"marker": "D", "color": "#c0392b"},
    "fold": {"marker": "o", "color": "#101010", "markerfacecolor": "white"},
    "flip": {"marker": "v", "color": "#101010", "markerfacecolor": "white"},
    "neimark-sacker": {"marker": "h", "color": "#101010", "markerfacecolor": "white"},
    "cusp": {"marker": "*", "color": "#101010"},
    "degenerate-switching-sliding": {"marker": "P", "color": "#c0392b"},
    "grazing": {"marker": "^", "color": "#101010", "markerfacecolor": "white"},
}


@full_names
def plot_orbit(
    orbit: Orbit, ax: Axes | None, x: str | None, y: str | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw one cycle of an orbit; see `Orbit.plot`."""
    state = orbit.system.state
    if x is None:
        x = state[0] if len(state) == 2 and y is None else "t"
    known = (*state, "t")
    expected = f"expected names among {', '.join(known)}; y a component"
    x = word("x", x, known, expected)
    if y is None:
        y = state[1] if len(state) == 2 and x != "t" else state[0]
    y = word("y", y, state, expected)
    run = orbit.trajectory()
    ax = _axes(ax)
    artists: list[Artist] = []
    if (x, y) == state:
        low, high = run.y.min(axis=1), run.y.max(axis=1)
        size = np.maximum(np.abs(low), np.abs(high))
        margin = 0.08 * np.maximum(high - low, np.where(size > 0, 1e-3 * size, 1.0))
        box = np.column_stack([low - margin, high + margin])
        for curve in surface_curves(orbit.system, orbit.t0, box, orbit.params):
            label = None if artists else "h = 0"
            artists += ax.plot(curve[0], curve[1], label=label, **SURFACE)
    artists += plot_trajectory(run, ax, x, y, artist_kw)
    for kind, style in EVENTS.items():
        met = orbit.events[orbit.events["kind"] == kind]
        if met.size:
            columns = {"t": met["t"]} | {name: met["x"][:, k] for k, name in enumerate(state)}
            artists += ax.plot(columns[x], columns[y], **(EVENT | style))
    return artists


@full_names
def plot_branch(
    branch: Branch, ax: Axes | None, y: str | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw a branch over its parameter; see `Branch.plot`."""
    (name,) = branch.param
    state = branch.system.state
    exits = branch.events[branch.events["kind"] == "exit_sliding"]
    phases = bool(np.isfinite(exits["phase"]).any())
    if y is None:
        y = "phase" if phases else state[0]
    known = [*(["phase"] if phases else []), "period", "multiplier", *state]
    y = word("y", y, known)
    ax = _axes(ax)
    artists: list[Artist] = []
    labelled: set[bool] = set()
    for a, b in _runs(branch):
        stable = bool(branch.stable[a])
        what = "stable" if stable else "unstable"
        style = (STABLE if stable else UNSTABLE) | {"label": what} | artist_kw
        for curve in _curves(branch, y, a, b):
            if stable in labelled:
                style["label"] = None
            labelled.add(stable)
            artists += ax.plot(*_pen_lifted(*_to_bifurcations(branch, y, a, b, curve), y), **style)
    for kind, marker in BIFURCATIONS.items():
        points = [point for point in branch.specials if point.kind == kind]
        where = [(point.param[name], at) for point in points for at in _heights(point, y)]
        if where:
            over, height = np.array(where).T
            artists += ax.plot(over, height, label=kind, **(BIFURCATION | marker))
    show_range(ax, branch.param[name])
    if not ax.get_xlabel():
        ax.set_xlabel(name)
    if not ax.get_ylabel():
        labels = {"phase": "phase where a slide ends (rad)", "multiplier": "largest |multiplier|"}
        ax.set_ylabel(labels.get(y, y))
    return artists


def _runs(branch: Branch) -> list[tuple[int, int]]:
    """Stretches of one word and one stability; the next point of the word closes it."""
    n = len(branch)
    changed = (branch.stable[1:] != branch.stable[:-1]) | (branch.word[1:] != branch.word[:-1])
    starts = [0, *(np.flatnonzero(changed) + 1), n]
    runs = []
    for a, b in itertools.pairwise(starts):
        joined = b < n and branch.word[b] == branch.word[a]
        runs.append((int(a), int(b) + joined))
    return runs if n else []


def _curves(branch: Branch, y: str, a: int, b: int) -> list[Floats]:
    """Values of a quantity on the points a to b - 1: one curve, or one a slide of the word."""
    if y == "period":
        return [branch.period[a:b]]
    if y == "multiplier":
        return [np.abs(branch.multipliers[a:b, 0])]
    if y != "phase":
        return [branch.x0[branch.system.state.index(y), a:b]]
    events = branch.events[branch.events["kind"] == "exit_sliding"]
    cuts = np.searchsorted(events["point"], np.arange(a, b + 1))  # a branch lists them in order
    rows = [events["phase"][i:j] for i, j in itertools.pairwise(cuts)]
    if not rows or rows[0].size == 0 or any(row.size != rows[0].size for row in rows):
        return []
    followed = [rows[0]]
    for row in rows[1:]:  # the first exit after phase zero may become the last before it
        turned = [np.roll(row, k) for k in range(row.size)]
        followed.append(min(turned, key=lambda each: float(_apart(each, followed[-1]).sum())))
    return list(np.array(followed).T)


def _bifurcations_between(branch: Branch) -> dict[int, SpecialPoint]:
    """Where the word changes from point i to the next: the bifurcation at which it does."""
    changing = [point for point in branch.specials if point.word_before != point.word_after]
    between = {}
    for i in np.flatnonzero(branch.word[1:] != branch.word[:-1]):
        while changing:  # both are in the order of the branch
            point = changing.pop(0)
            if point.word_after == branch.word[i + 1]:
                between[int(i)] = point
                break
    return between


def _to_bifurcations(
    branch: Branch, y: str, a: int, b: int, curve: Floats
) -> tuple[Floats, Floats]:
    """Parameters and values of a stretch, drawn on to the bifurcations where its word changes."""
    ((name, values),) = branch.param.items()
    over, heights = list(values[a:b]), list(curve)
    between = {} if y == "multiplier" else _bifurcations_between(branch)
    for place, end, i in ((len(over), -1, b - 1), (0, 0, a - 1)):
        if (point := between.get(i)) is None:
            continue
        found = _heights(point, y) + (_exit_phases(point.orbit) if y == "phase" else [])
        if found:
            at_end = heights[end]
            nearest = min(found, key=lambda height: float(_apart(np.array(height), at_end)))
            over.insert(place, point.param[name])
            heights.insert(place, nearest)
    return np.array(over), np.array(heights)


def _pen_lifted(over: Floats, heights: Floats, y: str) -> tuple[Floats, Floats]:
    """Interrupt a curve of phases where it leaves the picture and comes in on the other side."""
    if y != "phase":
        return over, heights
    turns = np.flatnonzero(np.abs(np.diff(heights)) > np.pi) + 1
    return np.insert(over, turns, np.nan), np.insert(heights, turns, np.nan)


def _apart(a: Floats, b: Floats) -> Floats:
    """Distances of phases on their circle."""
    d = np.abs(a - b) % (2 * np.pi)
    return np.minimum(d, 2 * np.pi - d)


def _heights(point: SpecialPoint, y: str) -> list[float]:
    """Where a bifurcation is marked."""
    orbit = point.orbit
    if not orbit.success:
        return []
    if y == "period":
        return [orbit.period]
    if y == "multiplier":
        return [float(np.abs(point.multipliers).max())]
    if y != "phase":
        return [float(orbit.x0[orbit.system.state.index(y)])]
    # at a switching-sliding bifurcation a slide begins; at the others one ends, or could
    if point.node >= 0 and point.kind != "switching-sliding":
        return [point.phase]
    return _exit_phases(orbit)


def _exit_phases(orbit: Orbit) -> list[float]:
    if not orbit.success:
        return []
    return [float(v) for v in orbit.events["phase"][orbit.events["kind"] == "exit_sliding"]]


# Curves in two parameters, with the names of their kinds; told apart in grey by their dashes.
CURVES: dict[str, dict[str, Any]] = {
    "crossing-sliding": {"color": "#2a7f3e", "linestyle": "--"},
    "grazing-sliding": {"color": "#8e44ad", "linestyle": ":"},
    "switching-sliding": {"color": "#1f5fa8", "linestyle": (0, (8, 2))},
    "adding-sliding": {"color": "#c0392b", "linestyle": "-."},
    "fold": {"color": "#101010", "linestyle": "-"},
    "flip": {"color": "#e8a33d", "linestyle": (0, (4, 1, 1, 1, 1, 1))},
    "grazing": {"color": "#8e44ad", "linestyle": (0, (1, 4))},
}
CURVE: dict[str, Any] = {"linewidth": 1.5}


@full_names
def plot_curves(
    curves: Sequence[Branch], ax: Axes | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw curves of bifurcations in the plane of their parameters; see `Branch.plot`."""
    ax = _axes(ax)
    artists: list[Artist] = []
    labelled: set[str] = set()
    for curve in curves:
        over, along = curve.param.values()
        label = curve.kind if curve.kind not in labelled else None
        labelled.add(curve.kind)
        artists += ax.plot(
            over, along, **(CURVE | CURVES[curve.kind] | {"label": label} | artist_kw)
        )
    for kind, marker in BIFURCATIONS.items():
        own = kind in ("cusp", "degenerate-switching-sliding")
        points = [s for curve in curves for s in curve.specials if s.kind == kind]
        where = np.array([list(s.param.values()) for s in points if s.orbit.success])
        if where.size:
            label = kind if own else f"second: {kind}"
            artists += ax.plot(*where.T, label=label, **(BIFURCATION | marker))
    if curves and not ax.get_xlabel():
        ax.set_xlabel(next(iter(curves[0].param)))
        ax.set_ylabel(list(curves[0].param)[1])
    return artists


CIRCLE: dict[str, Any] = {"color": "#808080", "linewidth": 0.8, "zorder": 1.5}
MULTIPLIER: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5, "zorder": 2.5}


@full_names
def plot_multipliers(
    multipliers: NDArray[np.complex128], ax: Axes | None, artist_kw: dict[str, Any]
) -> list[Artist]:
    """Draw multipliers with the unit circle; shape (dim,), or (n, dim) along a branch."""
    ax = _axes(ax)
    angle = np.linspace(0, 2 * np.pi, 361)
    artists: list[Artist] = list(ax.plot(np.cos(angle), np.sin(angle), **CIRCLE))
    each = multipliers.ravel()
    for inside, colour, label in (
        (np.abs(each) < 1, "#1f5fa8", "inside"),
        (np.abs(each) >= 1, "#c0392b", "on the circle or outside"),
    ):
        if inside.any():
            style = MULTIPLIER | {"color": colour, "label": label} | artist_kw
            artists += ax.plot(each[inside].real, each[inside].imag, **style)
    ax.set_aspect("equal")
    ax.set_xlabel(ax.get_xlabel() or "real part")
    ax.set_ylabel(ax.get_ylabel() or "imaginary part")
    return artists
