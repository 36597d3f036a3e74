# SPDX-License-Identifier: BSD-3-Clause
"""Brute-force bifurcation diagrams."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.event import KIND_NAMES
from filippov._results.settings import Settings, Stats, run_settings
from filippov._results.store import Stored
from filippov._support.check import (
    flag,
    integer,
    one_of,
    refuse,
    span,
    vector,
    words,
)
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import STATUSES, codes, complete, known, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import Params, System

from .lanes import register_lanes_of
from .simulate import method_for

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Diagram", "bifurcation_diagram"]

Integers = NDArray[np.int64]

_SECTIONS = (
    "strobe",
    "cross",
    "enter_sliding",
    "exit_sliding",
    "graze",
    "slide_extremum",
    "jump",
)


@dataclass(frozen=True, eq=False, repr=False)
class Diagram(Stored):
    """Result of `bifurcation_diagram`: points, one entry each, and values, one entry each."""

    # points, in the order of the values and of time
    value: Integers  #: index into `values`, shape (n_points,)
    period: Integers  #: index of the forcing period, 0 for a system that has none
    t_local: Floats  #: time since that period began; time, for a system that has none
    y: Floats  #: states, shape (dim, n_points)
    kind: NDArray[np.str_]  #: kind of event, "section" for a strobe
    surface: NDArray[np.int32]  #: index of the surface, -1 for a strobe
    #: side of the surface: where an exit (s = -1 or +1) or a crossing leads, where an entry or a
    #: graze comes from, the nearer one for a slide's extremum; for a strobe the mode
    boundary: NDArray[np.int8]

    # values of the swept parameter
    values: Floats  #: as given, shape (n_values,)
    status: NDArray[np.str_]  #: how each run ended: names of `Status`
    message: tuple[str, ...]  #: in words, empty for `ok`
    forcing: Floats  #: period of the forcing, 0 if there is none
    cycle: Integers  #: points after which the run was seen to repeat itself, 0: not seen
    skipped: Integers  #: forcing periods that were therefore not followed
    y_end: Floats  #: states at the end, shape (dim, n_values); NaN if there is none

    # what was asked
    system: System  #: of what
    state: tuple[str, ...]  #: names of the state components
    parameter: str  #: name of the swept parameter
    params: Params  #: the others
    section: tuple[str, ...]  #: "strobe", or kinds of event
    transient: float  #: left out: forcing periods, or time for a system that has none
    keep: float  #: kept after that, in the same unit
    x0: Floats  #: start, shape (dim,)
    chains: int  #: stretches of values followed from end to start, 0: every value starts at `x0`
    settings: Settings  #: of every run
    #: what all runs did, counted; in lanes steps, rejected ones among them, and events alone
    stats: Stats

    _parts = (Settings, Stats)

    def _verify(self) -> None:
        dim, n, m = self.system.dim, self.value.size, self.values.size
        complete(self.params, self.system.params, self.parameter)
        require(self.state == self.system.state, f"state is {self.state}")
        require(len(self.settings.atol) == dim, f"atol has {len(self.settings.atol)} entries")
        require(m > 0, "values is empty")
        points = ("value", "period", "t_local", "kind", "surface", "boundary")
        shaped((n,), **{name: getattr(self, name) for name in points})
        shaped((dim, n), y=self.y)
        values = ("values", "status", "forcing", "cycle", "skipped")
        shaped((m,), **{name: getattr(self, name) for name in values})
        require(len(self.message) == m, f"message has {len(self.message)} entries, expected {m}")
        shaped((dim, m), y_end=self.y_end)
        shaped((dim,), x0=self.x0)
        known(_SECTIONS, section=self.section)
        known(KIND_NAMES, kind=self.kind)
        known(STATUSES, status=self.status)
        codes(0, m, value=self.value)
        codes(-1, self.system.surfaces, surface=self.surface)
        codes(-1, 2, boundary=self.boundary)

    @property
    def param(self) -> Floats:
        """Value of the swept parameter of each point, shape (n_points,)."""
        return self.values[self.value]

    @property
    def phase(self) -> Floats:
        """Phase of the forcing `omega t mod 2 pi` of each point; NaN where there is none."""
        with np.errstate(divide="ignore", invalid="ignore"):
            phase: Floats = 2 * np.pi * self.t_local / self.forcing[self.value]
        phase[~(self.forcing[self.value] > 0)] = np.nan
        return phase

    @property
    def success(self) -> bool:
        """True if every run reached its end."""
        return bool((self.status == Status.ok.value).all())

    def plot(
        self, ax: Axes | None = None, *, y: str | None = None, **artist_kw: Any
    ) -> list[Artist]:
        """Draw the points over the swept parameter, each boundary in its own colour.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        y : str, optional
            "phase", "t_local" or a state component; by default the phase, for a strobe or a system
            without a period the first state component.
        **artist_kw
            For the points.

        Returns
        -------
        list of artists
            One for each boundary that occurs: -1, 0, +1.
        """
        from filippov._plot.plot import plot_diagram

        return plot_diagram(self, ax, y, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the diagram as an `xarray.Dataset` with dimensions `point` and `value`.

        Everything that was asked is in its attributes.
        """
        at_points = ("period", "t_local", "kind", "surface", "boundary", "phase")
        at_values = ("status", "forcing", "cycle", "skipped")
        variables: dict[str, Any] = {
            "y": (("state", "point"), self.y),
            "y_end": (("state", "value"), self.y_end),
        }
        variables |= {name: ("point", getattr(self, name)) for name in at_points}
        variables |= {name: ("value", getattr(self, name)) for name in at_values}
        variables["message"] = ("value", np.array(self.message, dtype=np.str_))
        coords = {
            "value": ("value", self.values),
            "state": ("state", list(self.state)),
            self.parameter: ("point", self.param),
        }
        return dataset(self, variables, coords, {"x0": self.x0.tolist()})

    def __repr__(self) -> str:
        ends = Counter(self.status.tolist())
        failed = ", ".join(f"{count} {word}" for word, count in ends.items() if word != "ok")
        empty = self.values.size - np.unique(self.param).size
        without = f" ({empty} values have none)" if empty > 0 else ""
        if empty == self.values.size and not failed:
            without = " (no such events from x0: see section= and x0=)"
        low, high = self.values.min(), self.values.max()
        return (
            f"<Diagram of {self.system.name}, {' and '.join(self.section)}: "
            f"{self.values.size} values "
            f"of {self.parameter} from {low:g} to {high:g}, {self.value.size} "
            f"points{without}; {failed or 'all ok'}>"
        )


def bifurcation_diagram(
    sys: System,
    *,
    section: str | Sequence[str] = "exit_sliding",
    transient: float = 200,
    keep: float = 1000,
    x0: ArrayLike | None = None,
    follow: bool = False,
    chains: int = 1,
    params: Mapping[str, float] | None = None,
    surface: int | None = None,
    direction: int = 0,
    method: str | None = None,
    rtol: float = 1e-9,
    atol: ArrayLike = 1e-9,
    max_step: float = math.inf,
    max_steps: int = 10_000_000,
    max_events: int = 1_000_000,
    on_nonunique: str = "stop",
    skip_repeats: bool = True,
    threads: int | None = None,
    progress: Progress = False,
    **swept: ArrayLike,
) -> Diagram:
    """Compute a bifurcation diagram by brute force: long runs, their transients left out.

    For each value of one parameter the run from `x0` at t = 0, and the points in which it meets a
    section. Only attractors show, and of several only the one that the start leads to.

    Parameters
    ----------
    sys : System
        The system, for instance `filippov.models.oscillator`.
    section : str or list of str
        Where points are taken: "strobe" (once a forcing period, at its start), or kinds of event,
        one or several: "exit_sliding" (transitions from stick to slip), "enter_sliding", "cross",
        "graze", "slide_extremum", "jump" (the state after it).
    transient, keep : float
        How long a run is left to settle, and how long it is looked at after that: whole periods of
        the forcing, or a time for a system that has none.
    x0 : array, shape (dim,), optional
        State at the start; by default the origin.
    follow : bool
        Start each value from the end of the one before it, in the order given, so that an attractor
        is followed; after a value that failed from `x0` again.
    chains : int
        With `follow`: cut the values into so many stretches of equal length, each of which starts
        from `x0`. Within a stretch values wait for each other; stretches run side by side.
    params : mapping, optional
        Values of other parameters, by name, that replace `sys.params`.
    surface : int, optional
        Take events of this surface only.
    direction : int
        +1: only events that lead to the side where the surface's h > 0; -1: to the other side.
    method : {"dopri5", "dop853", "rodas5p"}, optional
        By default dop853, and rodas5p for a smoothed system.
    rtol, atol, max_step, max_steps, max_events, on_nonunique
        As in `simulate`, for every run.
    skip_repeats : bool
        Do not follow a run further that repeats itself to rounding: that has come back to the same
        point (within 16 units in the last place) for at least three cycles of up to 32 points, and
        16 points, after having been a thousand times farther from it. The points left out are
        copies.
    threads : int, optional
        At most so many; by default as many as OpenMP takes by itself. The result never depends on
        it. A process that was forked works with one.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in values, always from
        the calling thread.
    **swept : array, shape (n_values,)
        The swept parameter by its name: `omega=np.linspace(2.84, 2.94, 200)`.

    Returns
    -------
    Diagram
        A value that fails has its own status and spoils no other.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `diagram` has what was finished, and the status
        `interrupted` for the rest.

    Notes
    -----
    Values run side by side, several in a register (see `ensemble`), where the section is a strobe
    or changes of mode and the system runs in lanes: three to seven times as fast, and the same to
    the tolerance. With `follow`, and for other events, the engine of single runs takes them.

    Chapter, section 4.5; its figure 4.5a has 200 + 1000 periods of the oscillator at A = 0.5.
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    parameter, values = _one_swept(sys, swept, params)
    fixed = sys._merged(params)
    sys._require_period(fixed, {parameter: values[[0, -1]].tolist()})
    rows = np.tile(np.array(list(fixed.values()), dtype=np.float64), (values.size, 1))
    rows[:, list(fixed).index(parameter)] = values
    start = vector("x0", np.zeros(sys.dim) if x0 is None else x0, sys.dim, sys.state)
    sections = _sections(section)
    # of a value of the swept parameter that leaves no period the status tells
    swept_default = dict(zip(sys._model.params, sys._model.defaults, strict=True))[parameter]
    forced = sys._forced(Params(dict(fixed) | {parameter: swept_default}))
    if "jump" in sections and "jump" not in sys.kinds:
        refuse("section", section, f"expected kinds of event: {sys.name} has no jumps")
    direction = one_of("direction", direction, (-1, 0, 1), "expected -1, 0 or +1")
    if direction != 0 and sections == ("strobe",):
        refuse("direction", direction, "expected 0 with a strobe, which has no surface")
    slides = {"exit_sliding", "enter_sliding", "slide_extremum"} & set(sections)
    if slides and not set(sys.kinds) - {"kink"}:
        expected = f"expected other events: {sys.name} has no surface on which it could slide"
        refuse("section", section, expected)
    if sections == ("strobe",) and not forced:
        refuse("section", section, f"expected kinds of event: {sys.name} has no period")
    told = method_for(sys, method, "dop853")
    settings = run_settings(
        sys.dim, told, rtol, atol, max_step, max_steps, max_events, on_nonunique
    )
    transient = span("transient", transient, forced, 0.0)
    keep = span("keep", keep, forced, math.ulp(0.0))
    chains = integer("chains", chains)
    follow = flag("follow", follow)
    skip_repeats = flag("skip_repeats", skip_repeats)
    if threads is not None:
        threads = integer("threads", threads)
    with shown(progress, "value") as show:
        found = _core.diagram(
            sys._model,
            register_lanes_of(sys),
            start,
            rows,
            settings._told(),
            [] if sections == ("strobe",) else [KIND_NAMES.index(kind) for kind in sections],
            -1 if surface is None else sys._surface(surface),
            direction,
            transient,
            keep,
            follow,
            chains,
            skip_repeats,
            threads or 0,
            show,
        )
    diagram = Diagram(
        value=found.value,
        period=found.period,
        t_local=found.t_local,
        y=np.ascontiguousarray(found.y.T),
        kind=np.array(KIND_NAMES)[found.kind],
        surface=found.surface,
        boundary=found.boundary,
        values=values,
        status=np.array(found.status),
        message=tuple(found.message),
        forcing=found.forcing,
        cycle=found.cycle,
        skipped=found.skipped,
        y_end=np.ascontiguousarray(found.y_end.T),
        system=sys,
        state=sys.state,
        parameter=parameter,
        params=Params({name: value for name, value in fixed.items() if name != parameter}),
        section=sections,
        transient=transient,
        keep=keep,
        x0=start,
        chains=chains if follow else 0,
        settings=settings,
        stats=Stats(**found.counters),
    )
    ended(found.raised, diagram=diagram)
    return diagram


def _one_swept(
    sys: System, swept: Mapping[str, ArrayLike], params: Mapping[str, float] | None
) -> tuple[str, Floats]:
    """Name and values of the swept parameter."""
    for name in swept:
        if name not in sys.params:
            raise TypeError(
                f"bifurcation_diagram() has no argument {name!r}, and {sys._unknown(name)}"
            )
    if len(swept) != 1:
        got = ", ".join(swept) or "none"
        raise TypeError(f"swept parameters: {got}: expected one, as in omega=np.linspace(2, 3, 50)")
    ((name, given),) = swept.items()
    if isinstance(params, Mapping) and name in params:
        refuse("params", params, f"expected values of other parameters than {name}, which is swept")
    expected = "expected an array of shape (n_values,), of at least one value"
    try:
        shape = np.shape(given)
    except ValueError:  # rows of unequal lengths
        refuse(name, given, expected)
    if len(shape) != 1 or shape[0] == 0:
        refuse(name, given, f"{expected}, got shape {shape}")
    return name, vector(name, given, shape[0])


def _sections(section: str | Sequence[str]) -> tuple[str, ...]:
    """Check where points are taken: a strobe, or kinds of event."""
    expected = f"expected one of {', '.join(_SECTIONS)}, or several events"
    kinds = words("section", section, _SECTIONS, expected)
    if not kinds:
        refuse("section", section, expected)
    if len(kinds) > 1 and "strobe" in kinds:
        refuse("section", section, 'expected "strobe" alone, or kinds of event')
    return kinds
