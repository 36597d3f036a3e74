# SPDX-License-Identifier: BSD-3-Clause
"""Branches of periodic orbits over one parameter, and the bifurcations on them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._results.dataset import dataset, event_variables
from filippov._results.settings import analysis_settings
from filippov._results.store import Stored
from filippov._support.check import among, integer, number, refuse, word, words
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import codes, complete, finite, known, require, shaped
from filippov._support.status import Status
from filippov._support.types import Bools, Floats, Record
from filippov._system.bounds import pair
from filippov._system.system import Params, System

from .cycle import node_events, verify_nodes, without_point
from .geometry import one_surface
from .orbit import Complexes, Orbit, orbit_from

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Branch", "SpecialPoint", "continuation"]

KINDS = tuple(_core.bifurcation_names())
CURVE_KINDS = (*KINDS[:6], "grazing")  #: that are followed in two parameters


@dataclass(frozen=True, eq=False, repr=False)
class SpecialPoint:
    """A bifurcation on a branch."""

    kind: str  #: which, for instance "adding-sliding"
    param: dict[str, float]  #: values of the followed parameters, by name
    orbit: Orbit  #: the orbit there; its events include the node where it bifurcates
    node: int  #: index of that event; -1 for a fold, a flip, a Neimark-Sacker bifurcation
    side: int  #: boundary of the sliding region that is met, `s = side`; 0 for those
    word_before: str  #: word of the branch before the point, in the order of the branch
    word_after: str  #: and after it; empty if no orbit goes on there
    #: residuals and signs of the conditions of section 4.4, by name: `h`, `1 + s` (`1 - s`), `L1`
    #: (`L2`) and its derivatives along its own field `L1'` and `L1''`
    conditions: dict[str, float]
    multipliers: Complexes  #: of the branch just before the point, shape (dim,)
    status: Status  #: `ok`, or `not_converged` if the point was seen and not located

    def _verify(self) -> None:
        known(KINDS, kind=self.kind)
        codes(-1, self.orbit.events.size, node=self.node)
        codes(-1, 2, side=self.side)
        dim = self.orbit.system.dim
        none = len(self.param) == 2 and not self.multipliers.size
        shaped((0 if none else dim,), multipliers=self.multipliers)
        require(set(self.param) <= set(self.orbit.system.params), f"param is {self.param}")

    @property
    def t(self) -> float:
        """Time of the bifurcating event since the start; NaN for smooth bifurcations."""
        return float(self.orbit.events["t"][self.node]) if self.node >= 0 else np.nan

    @property
    def x(self) -> Floats:
        """State at the bifurcating event; at the start for smooth bifurcations."""
        if self.node < 0:
            return self.orbit.x0
        x: Floats = self.orbit.events["x"][self.node]
        return x

    @property
    def phase(self) -> float:
        """Phase of the forcing at the bifurcating event; NaN where there is none."""
        return float(self.orbit.events["phase"][self.node]) if self.node >= 0 else np.nan

    def __repr__(self) -> str:
        where = ", ".join(f"{name} = {value:.12g}" for name, value in self.param.items())
        words = f"{self.word_before} to {self.word_after or 'nothing'}"
        return f"<{self.kind} at {where}: {words}; {self.status}>"


@dataclass(frozen=True, eq=False, repr=False)
class Branch(Stored):
    """Result of `continuation`: one entry a point, in the order along the branch.

    A branch of periodic orbits over one parameter, or of bifurcations of one `kind` in two.
    """

    kind: str  #: of a curve of bifurcations; empty for orbits
    param: dict[str, Floats]  #: values of the followed parameters, by name, shape (n_points,)
    word: NDArray[np.str_]  #: see `Orbit.word`
    period: Floats  #: duration of one cycle
    turns: NDArray[np.int64]  #: forcing periods of one cycle
    stable: Bools  #: see `Orbit.stable`
    multipliers: Complexes  #: largest first, shape (n_points, dim)
    x0: Floats  #: state at the start of the cycle, see `Orbit.x0`; shape (dim, n_points)
    events: Record  #: as `Orbit.events`, of all points; `point` is the index of the point

    specials: tuple[SpecialPoint, ...]  #: bifurcations in the order along the branch
    status: Status  #: `ok`, or of the end that went worse
    ends: tuple[str, str]  #: why the branch ends there, first point and last
    corrections: int  #: Newton iterations, each one flow of one cycle with derivatives

    system: System  #: of what
    params: Params  #: the other parameter values
    bounds: dict[str, tuple[float, float]]  #: of the parameters, by name
    detect: tuple[str, ...]  #: kinds that were asked for
    rtol: float  #: tolerances of every integration: relative
    atol: float  #: and absolute
    #: curves of other kinds that start at points of codimension two of this one
    connected: tuple[Branch, ...] = ()

    _parts = (SpecialPoint,)

    def _verify(self) -> None:
        dim, n = self.system.dim, self.period.size
        over = tuple(self.param)
        complete(
            self.params, self.system.params, *(over if len(over) == 1 + bool(self.kind) else ())
        )
        require(tuple(self.bounds) == over, f"bounds are of {', '.join(self.bounds)}")
        known(("", *CURVE_KINDS), kind=self.kind)
        known(KINDS, detect=self.detect)
        analysis_settings(self.rtol, self.atol)
        columns = {name: getattr(self, name) for name in ("word", "period", "turns", "stable")}
        shaped((n,), **columns, **{f"param[{name}]": each for name, each in self.param.items()})
        shaped((n, dim), multipliers=self.multipliers)
        shaped((dim, n), x0=self.x0)
        finite(period=self.period, x0=self.x0, **self.param)
        require(((self.period > 0) & (self.turns > 0)).all(), "period or turns is not > 0")
        verify_nodes(self.system, self.events, self.word.tolist(), branch=True)
        t = self.events["t"]
        within = (t >= 0) & (t < self.period[self.events["point"]])
        require(within.all(), "events.t is not within a period")
        for point in self.specials:
            require(tuple(point.param) == over, f"special points are over {tuple(point.param)}")
            require(point.orbit.system == self.system, "special points are of another system")
        for curve in self.connected:
            require(tuple(curve.param) == over, f"connected curves are over {tuple(curve.param)}")

    @property
    def special(self) -> dict[str, tuple[SpecialPoint, ...]]:
        """Bifurcations by kind, for every kind that was asked for."""
        return {kind: tuple(s for s in self.specials if s.kind == kind) for kind in self.detect}

    @property
    def success(self) -> bool:
        """True if both ends are proper: a bound, or a point where the orbit ceases to exist."""
        return self.status is Status.ok

    @property
    def message(self) -> str:
        """Why the branch ends where it ends."""
        return f"first point: {self.ends[0]}; last point: {self.ends[1]}"

    def __len__(self) -> int:
        return self.period.size

    def orbit(self, index: int) -> Orbit:
        """Orbit of one point, with its monodromy matrix.

        Parameters
        ----------
        index : int
            Which point; negative ones count from the end.
        """
        n = len(self)
        if not among(index, range(-n, n)):
            refuse("index", index, f"expected an index of {n} points")
        i = int(index) % n
        values = self._params_at(i)
        nodes = without_point(self.events[self.events["point"] == i])
        start = Orbit(
            word=str(self.word[i]),
            period=float(self.period[i]),
            turns=int(self.turns[i]),
            stable=bool(self.stable[i]),
            multipliers=self.multipliers[i],
            monodromy=np.full(2 * (self.system.dim,), np.nan),
            t0=0.0,
            x0=self.x0[:, i].copy(),
            events=nodes,
            params=values,
            system=self.system,
            status=Status.ok,
            message="",
            residual=np.nan,
            iterations=0,
            rtol=self.rtol,
            atol=self.atol,
        )
        told = analysis_settings(self.rtol, self.atol)
        found = _core.solve_orbit(self.system._model, start._cycle(), told)
        ended(found.raised)
        return orbit_from(self.system, found, values, told)

    def plot(
        self, ax: Axes | None = None, *, y: str | None = None, **artist_kw: Any
    ) -> list[Artist]:
        """Draw the branch over its parameter: stable solid, unstable dashed, bifurcations marked.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        y : str, optional
            "phase" (where slides end, as in figure 4.5), "period", "multiplier" (the largest
            modulus) or a state component at the start of the cycle. By default the phase for a
            forced system with slides, else the first state component. A curve in two parameters is
            drawn in their plane, with the curves connected with it.
        **artist_kw
            For the lines.

        Returns
        -------
        list of artists
            Lines, then one set of marks for each kind of bifurcation.
        """
        from filippov._plot.plot_orbit import plot_branch, plot_curves

        if self.kind:
            if y is not None:
                refuse("y", y, "expected None: a curve is drawn over its two parameters")
            return plot_curves([self, *self.connected], ax, artist_kw)
        return plot_branch(self, ax, y, artist_kw)

    def plot_multipliers(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the Floquet multipliers of all points in the complex plane, with the unit circle.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the points.

        Returns
        -------
        list of artists
            The circle, multipliers inside, then the others.
        """
        from filippov._plot.plot_orbit import plot_multipliers

        return plot_multipliers(self.multipliers, ax, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the branch as an `xarray.Dataset`: dimensions `point`, `event`, `special`, `state`.

        Orbits of bifurcations are left out; their parameter values, kinds and words are there.
        Multipliers, which are complex, are `multipliers_real` and `multipliers_imag`.
        """
        variables: dict[str, Any] = {
            column: ("point", getattr(self, column))
            for column in ("word", "period", "turns", "stable")
        }
        variables["multipliers"] = (("point", "multiplier"), self.multipliers)
        variables["x0"] = (("state", "point"), self.x0)
        variables |= event_variables(self.events, "event_", x="state")
        for column in ("kind", "word_before", "word_after", "side"):
            each = [getattr(s, column) for s in self.specials]
            kind = np.int64 if column == "side" else np.str_
            variables[f"special_{column}"] = ("special", np.array(each, dtype=kind))
        coords: dict[str, Any] = {"state": list(self.system.state)}
        for name, values in self.param.items():
            where = np.array([s.param[name] for s in self.specials])
            coords |= {name: ("point", values), f"special_{name}": ("special", where)}
        return dataset(self, variables, coords, {"message": self.message})

    def __repr__(self) -> str:
        def where(point: SpecialPoint) -> str:
            return ", ".join(f"{value:.9g}" for value in point.param.values())

        found = ", ".join(f"{s.kind} at {where(s)}" for s in self.specials)
        spans = (
            f"{name} {values.min():g} to {values.max():g}" if values.size else f"{name} nothing"
            for name, values in self.param.items()
        )
        what = f"{self.kind} curve" if self.kind else "Branch"
        return (
            f"<{what} of {self.system.name} over {', '.join(spans)}: {len(self)} points; "
            f"{found or 'no special points'}; {self.status}>"
        )

    def _params_at(self, i: int) -> Params:
        values = dict(self.params) | {name: float(v[i]) for name, v in self.param.items()}
        return Params({name: values[name] for name in self.system.params})


def continuation(
    start: Orbit | SpecialPoint,
    parameter: str | tuple[str, str],
    bounds: tuple[float, float] | tuple[tuple[float, float], tuple[float, float]],
    *,
    detect: str | Iterable[str] = "all",
    max_step: float = 0.05,
    first_step: float = 0.01,
    max_points: int = 2000,
    rtol: float | None = None,
    atol: float | None = None,
    max_steps: int = 10_000_000,
    progress: Progress = False,
) -> Branch:
    """Follow a periodic orbit over a parameter, or a bifurcation in two.

    Pseudo-arclength steps on the shooting equations of the orbit's word. Where a test function
    says that the word ends, the bifurcation is solved for as equations of its own, named by its
    conditions, and the branch goes on with the word behind it. In two parameters the equations
    have the condition of the bifurcation as one more; a fold or a flip has its null vector.

    Parameters
    ----------
    start : Orbit or SpecialPoint
        The first orbit, or a bifurcation of an orbit from `Branch.specials`; the branch is followed
        from it both ways. In two parameters a bifurcation: one of the four sliding bifurcations, a
        grazing, a fold or a flip.
    parameter : str, or two of them
        Names of the parameters.
    bounds : (float, float), or two such pairs
        Range of each parameter, with the value of `start` in it. Each end goes on to a bound, or to
        where the orbit or the bifurcation ceases to exist; a closed branch goes round once.
    detect : "all" or iterable of str
        Kinds of bifurcation to report: "crossing-sliding", "grazing-sliding", "switching-sliding",
        "adding-sliding", "grazing", "fold", "flip", "neimark-sacker"; in two parameters also
        "cusp" and "degenerate-switching-sliding", where another kind is a second bifurcation of the
        same orbit. The branch itself does not depend on it.
    max_step, first_step : float
        Longest and first step, in units of the orbit's size and of the width of the bounds.
    max_points : int
        Bound on the steps in each direction.
    rtol, atol, max_steps
        As in `periodic_orbit`; the tolerances by default those of `start`.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, with the points so far
        and the most there can be, always from the calling thread. (Over one parameter.)

    Returns
    -------
    Branch
        Also of a branch that had to stop: `status` and `ends` say why. A curve that meets a
        degenerate switching-sliding point brings the two curves of other kinds that start there:
        `Branch.connected`.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `branch` is the branch up to there.

    Notes
    -----
    Sliding bifurcations of section 4.4, conditions (4.24) to (4.29) in the signs of this library
    (`h < 0` is side -1), with full Lie derivatives. Two parameters: sections 4.7 and 4.8.
    """
    kinds = _kinds(detect)
    longest = number("max_step", max_step, "expected 0 < max_step < 1000", above=0.0, below=1e3)
    first = number("first_step", first_step, "expected 0 < first_step < 1000", above=0.0, below=1e3)
    most = integer("max_points", max_points)
    if isinstance(start, SpecialPoint):
        orbit = start.orbit
    elif isinstance(start, Orbit):
        orbit = start
    else:
        expected = "expected an Orbit, as periodic_orbit gives, or a SpecialPoint of a Branch"
        refuse("start", start, expected, TypeError)
    one_surface(orbit.system)
    told = analysis_settings(
        orbit.rtol if rtol is None else rtol, orbit.atol if atol is None else atol, max_steps
    )
    steps = (first, longest, most)
    if isinstance(parameter, str):
        return _over_one(start, orbit, parameter, bounds, kinds, steps, told, progress)
    names: object = parameter
    if not isinstance(names, (tuple, list)) or len(names) != 2:
        expected = "expected the name of a parameter, or a tuple of two"
        refuse("parameter", parameter, expected, TypeError)
    if not isinstance(start, SpecialPoint):
        expected = "expected a SpecialPoint of a Branch to follow in two parameters"
        refuse("start", start, expected, TypeError)
    return _in_two(start, parameter, bounds, kinds, steps, told)


def _over_one(
    start: Orbit | SpecialPoint,
    orbit: Orbit,
    parameter: str,
    bounds: Any,  # noqa: ANN401 - checked here
    kinds: tuple[str, ...],
    steps: tuple[float, float, int],
    told: _core.RunSettings,
    progress: Progress,
) -> Branch:
    cycle = orbit._cycle()
    name = _one_parameter(orbit, parameter)
    span = _bounds("bounds", bounds, name, orbit.params[name])
    sys = orbit.system
    sys._require_period(orbit.params, {name: span})
    index = list(sys.params).index(name)
    point = (-1, -1, 0)
    if isinstance(start, SpecialPoint):
        point = (KINDS.index(start.kind), start.node, start.side)
    with shown(progress, "point") as show:
        found = _core.trace(
            sys._model,
            cycle,
            *point,
            index,
            span[0],
            span[1],
            steps[0],
            steps[1],
            steps[2],
            show,
            told,
        )
    branch = branch_from(sys, orbit.params, {name: span}, kinds, found, told)
    ended(found.raised, branch=branch)
    return branch


def _in_two(
    start: SpecialPoint,
    parameters: Any,  # noqa: ANN401 - checked here
    bounds: Any,  # noqa: ANN401 - checked here
    kinds: tuple[str, ...],
    steps: tuple[float, float, int],
    told: _core.RunSettings,
) -> Branch:
    if start.kind not in CURVE_KINDS:
        refuse("start", start, f"expected one of {', '.join(CURVE_KINDS)}")
    cycle = start.orbit._cycle()
    sys, params = start.orbit.system, start.orbit.params
    names = two_parameters(sys, "parameter", parameters)
    expected = "expected two pairs (low, high)"
    try:
        first, second = bounds
    except (TypeError, ValueError):
        refuse("bounds", bounds, expected)
    spans = {
        name: _bounds(f"bounds[{k}]", each, name, params[name])
        for k, (name, each) in enumerate(zip(names, (first, second), strict=True))
    }
    sys._require_period(params, spans)
    index = [list(sys.params).index(name) for name in names]
    low, high = zip(*spans.values(), strict=True)
    found = _core.trace_curves(
        sys._model,
        cycle,
        KINDS.index(start.kind),
        start.node,
        start.side,
        index,
        low,
        high,
        *steps,
        told,
    )
    curves = [branch_from(sys, params, spans, kinds, each, told) for each in found.curves]
    branch = dataclasses.replace(curves[0], connected=tuple(curves[1:]))
    ended(found.raised, branch=branch)
    return branch


def two_parameters(sys: System, argument: str, names: Any) -> tuple[str, str]:  # noqa: ANN401
    """Two different names of parameters."""
    known = ", ".join(sys.params)
    expected = f"expected two different names among {known}"
    try:
        a, b = names
    except (TypeError, ValueError):
        refuse(argument, names, expected)
    if a not in sys.params or b not in sys.params or a == b:
        refuse(argument, names, expected)
    return a, b


def branch_from(
    sys: System,
    params: Mapping[str, float],
    bounds: dict[str, tuple[float, float]],
    kinds: tuple[str, ...],
    found: _core.BranchColumns,
    told: _core.RunSettings,
) -> Branch:
    """Build a branch from what the core gave."""
    cycles = found.cycles
    events, words, _ = node_events(sys, cycles)
    names = list(bounds)
    specials = (_special_from(sys, params, names, each, told) for each in found.special)
    columns = {name: list(sys.params).index(name) for name in names}
    return Branch(
        kind=found.kind,
        param={name: cycles.p[:, k].copy() for name, k in columns.items()},
        word=np.array(words, dtype=np.str_),
        period=cycles.period,
        turns=cycles.turns,
        stable=found.stable.astype(np.bool_),
        multipliers=found.multipliers,
        x0=np.ascontiguousarray(cycles.x_start.T),
        events=events,
        specials=tuple(special for special in specials if special.kind in kinds),
        status=Status(found.status),
        ends=found.ends,
        corrections=found.corrections,
        system=sys,
        params=Params({key: value for key, value in params.items() if key not in bounds}),
        bounds=bounds,
        detect=kinds,
        rtol=told.rtol,
        atol=told.atol[0],
    )


def _special_from(
    sys: System,
    params: Mapping[str, float],
    names: list[str],
    found: _core.SpecialPointResult,
    told: _core.RunSettings,
) -> SpecialPoint:
    orbit = orbit_from(sys, found.orbit, params, told)
    node = found.node
    if node >= 0:
        node = int(node_events(sys, found.orbit.cycles)[2][node])
    return SpecialPoint(
        kind=found.kind,
        param={name: orbit.params[name] if orbit.success else np.nan for name in names},
        orbit=orbit,
        node=node,
        side=found.side,
        word_before=found.word_before,
        word_after=found.word_after,
        conditions=dict(found.conditions),
        multipliers=found.multipliers,
        status=orbit.status,
    )


def _one_parameter(start: Orbit, parameter: object) -> str:
    known = ", ".join(start.params) or "none"
    expected = f"expected the name of one parameter: {known}"
    return word("parameter", parameter, start.params, expected)


def _bounds(
    what: str,
    bounds: Any,  # noqa: ANN401 - checked here
    name: str,
    value: float,
) -> tuple[float, float]:
    expected = f"expected two finite numbers, low < high, with {name} = {value!r} between them"
    low, high = pair(what, bounds, expected)
    if not low <= value <= high:
        refuse(what, (low, high), expected)
    return low, high


def _kinds(detect: str | Iterable[str]) -> tuple[str, ...]:
    expected = f'expected "all", or some of {", ".join(KINDS)}'
    if isinstance(detect, str) and detect == "all":
        return KINDS
    asked = words("detect", detect, KINDS, expected)
    return tuple(kind for kind in KINDS if kind in asked)
