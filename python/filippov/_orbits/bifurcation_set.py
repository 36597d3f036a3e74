# SPDX-License-Identifier: BSD-3-Clause
"""Bifurcations in a rectangle of two parameters, from nothing but the model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.settings import analysis_settings
from filippov._results.store import Stored
from filippov._support.check import LONGEST, integer, number, refuse, vector
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import require
from filippov._system.bounds import pair
from filippov._system.system import Params, System

from .branch import KINDS, Branch, SpecialPoint, branch_from, two_parameters
from .geometry import one_surface

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

__all__ = ["BifurcationSet", "bifurcation_set"]


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationSet(Stored):
    """Result of `bifurcation_set`."""

    branches: tuple[Branch, ...]  #: of orbits, over the first parameter
    curves: tuple[Branch, ...]  #: of bifurcations, in both
    corrections: int  #: Newton iterations, each one flow of one cycle with derivatives
    failed_starts: int  #: points of the rectangle from which no orbit was found
    system: System
    params: Params  #: the other parameters

    def _verify(self) -> None:
        over = {tuple(curve.param) for curve in self.curves}
        require(len(over) < 2, "curves are over different parameters")
        require(all(curve.kind for curve in self.curves), "a curve is one of orbits")
        require(not any(branch.kind for branch in self.branches), "a branch is one of bifurcations")
        names = set(self.params)
        require(names < set(self.system.params), f"params are {', '.join(names)}")

    @property
    def specials(self) -> tuple[SpecialPoint, ...]:
        """Points of codimension two, each once."""
        found: list[SpecialPoint] = []
        for curve in self.curves:
            for point in curve.specials:
                here = np.array(list(point.param.values()))
                known = (np.array(list(p.param.values())) for p in found if p.kind == point.kind)
                if not any(np.allclose(here, each, rtol=1e-8, atol=0) for each in known):
                    found.append(point)
        return tuple(found)

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw all curves in the plane of the parameters, points of codimension two marked.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the curves.

        Returns
        -------
        list of artists
        """
        from filippov._plot.plot_orbit import plot_curves

        return plot_curves(self.curves, ax, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the curves as an `xarray.Dataset` over the points of all, `curve` telling which.

        Branches of orbits are left out: each has a dataset of its own.
        """
        names = list(self.curves[0].param) if self.curves else []
        columns = {
            name: np.concatenate([curve.param[name] for curve in self.curves]) for name in names
        }
        which = np.repeat(np.arange(len(self.curves)), [len(curve) for curve in self.curves])
        variables: dict[str, Any] = {name: ("point", column) for name, column in columns.items()}
        variables["curve"] = ("point", which)
        variables["kind"] = ("curve_index", np.array([c.kind for c in self.curves], dtype=str))
        return dataset(self, variables, {})

    def __repr__(self) -> str:
        kinds = ", ".join(curve.kind for curve in self.curves)
        points = ", ".join(
            f"{s.kind} at ({', '.join(f'{v:.9g}' for v in s.param.values())})"
            for s in self.specials
        )
        return (
            f"<BifurcationSet: {len(self.branches)} branches; curves of {kinds or 'nothing'}; "
            f"{points or 'no points of codimension two'}; {self.corrections} flows>"
        )


def bifurcation_set(
    sys: System,
    box: Mapping[str, tuple[float, float]],
    *,
    params: Mapping[str, float] | None = None,
    x0: ArrayLike | None = None,
    lines: int = 3,
    starts: int = 3,
    max_turns: int = 1,
    transient: float = 200.0,
    window: float = 200.0,
    max_curves: int = 64,
    max_step: float = 0.05,
    first_step: float = 0.01,
    max_points: int = 2000,
    rtol: float = 1e-12,
    atol: float = 1e-13,
    max_steps: int = 10_000_000,
    progress: Progress = False,
) -> BifurcationSet:
    """Find the bifurcations of periodic orbits in a rectangle of two parameters.

    On a few lines over the first parameter the orbits on which solutions from `x0` settle are
    followed; each bifurcation met is followed in both parameters, and so are the curves that start
    at points of codimension two. What is not connected with any of these orbits is not found.

    Parameters
    ----------
    sys : System
        With one surface.
    box : mapping
        Range of two parameters: `{"omega": (1.5, 3.2), "A": (4.0, 5.5)}`.
    params : mapping, optional
        Values of the other parameters that replace `sys.params`.
    x0 : array, shape (dim,), optional
        Where those solutions start, at phase zero; by default at the origin.
    lines : int
        How many lines, at equidistant values of the second parameter.
    starts : int
        On each line, at how many values of the first parameter orbits are looked for.
    max_turns : int
        Longest orbit that is looked for, forcing periods.
    transient : float
        Before an orbit is looked for: forcing periods, or time for an autonomous system.
    window : float
        Time in which an orbit of an autonomous system has to return.
    max_curves : int
        Bound on the number of curves.
    max_step, first_step, max_points, rtol, atol, max_steps
        As in `continuation`.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, with the starts and
        curves that are done and those that are known so far: their number grows.

    Returns
    -------
    BifurcationSet

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `set` is what was found up to there.
    """
    one_surface(sys)
    if not isinstance(box, Mapping):
        refuse("box", box, "expected a mapping of two parameters to (low, high)", TypeError)
    names = two_parameters(sys, "box", tuple(box))
    expected = "expected two finite numbers, low < high"
    spans = {name: pair(f"box[{name!r}]", box[name], expected) for name in names}
    values = sys._merged(params)
    sys._require_period(values, spans)
    low, high = zip(*spans.values(), strict=True)
    told = analysis_settings(rtol, atol, max_steps)
    with shown(progress, "curve") as show:
        found = _core.bifurcation_set(
            sys._model,
            sys._values(params),
            [list(sys.params).index(name) for name in names],
            low,
            high,
            vector("x0", np.zeros(sys.dim) if x0 is None else x0, sys.dim, sys.state),
            integer("lines", lines),
            integer("starts", starts),
            integer("max_turns", max_turns),
            number(
                "transient", transient, "expected 0 <= transient < 2**52", least=0.0, below=LONGEST
            ),
            number("window", window, "expected a number > 0", above=0.0),
            integer("max_curves", max_curves),
            number(
                "first_step", first_step, "expected 0 < first_step < 1000", above=0.0, below=1e3
            ),
            number("max_step", max_step, "expected 0 < max_step < 1000", above=0.0, below=1e3),
            integer("max_points", max_points),
            show,
            told,
        )
    over = {names[0]: spans[names[0]]}
    result = BifurcationSet(
        branches=tuple(
            branch_from(sys, _at(values, names[1], each), over, KINDS, each, told)
            for each in found.branches
        ),
        curves=tuple(branch_from(sys, values, spans, KINDS, each, told) for each in found.curves),
        corrections=found.corrections,
        failed_starts=found.failed_starts,
        system=sys,
        params=Params({name: value for name, value in values.items() if name not in names}),
    )
    ended(found.raised, set=result)
    return result


def _at(values: Mapping[str, float], name: str, found: _core.BranchColumns) -> dict[str, float]:
    """Give the parameter values of a line."""
    index, p = list(values).index(name), found.cycles.p
    return dict(values) | ({name: float(p[0, index])} if p.size else {})
