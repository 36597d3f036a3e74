# SPDX-License-Identifier: BSD-3-Clause
"""Periodic orbits: found, described, drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._results.dataset import dataset, event_variables
from filippov._results.event import EventKind
from filippov._results.settings import analysis_settings
from filippov._results.store import Stored
from filippov._runs.simulate import simulate
from filippov._runs.trajectory import Trajectory
from filippov._support.check import (
    LONGEST,
    flag,
    integer,
    number,
    one_of,
    refuse,
    span,
    vector,
)
from filippov._support.progress import ended
from filippov._support.sound import complete, finite, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats, Record
from filippov._system.system import Params, System, require_no_directions

from .cycle import (
    cycle_at,
    cycle_of,
    node_events,
    verify_columns,
    verify_nodes,
    without_point,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Complexes", "Orbit", "OrbitError", "orbit_from", "periodic_orbit"]

Complexes = NDArray[np.complex128]


@runtime_checkable
class FixedPoint(Protocol):
    """What a fixed point of the event map tells."""

    phase: float  #: of the forcing, rad
    boundary: int  #: of the sliding region: the slide ends at `s = boundary`
    iterate: int  #: of the map, after which it returns


class OrbitError(RuntimeError):
    """A search that failed, with `raise_on_failure=True`; `orbit` has its status and message."""

    def __init__(self, orbit: Orbit) -> None:
        super().__init__(orbit.message)
        self.orbit = orbit


@dataclass(frozen=True, eq=False, repr=False)
class Orbit(Stored):
    """A periodic orbit, or why none was found.

    `events` has one record a change of mode, in the order of time from the start on:

    =========================  ====================================================================
    `t`                        time since the start, in [0, period)
    `phase`                    phase of the forcing, `omega t mod 2 pi`; NaN where there is none
    `kind`                     "cross", "enter_sliding" or "exit_sliding"; at a bifurcation also
                               "graze" and "slide_extremum", which change no mode
    `surface`                  index of the surface that is met or left
    `mode_before, mode_after`  -1 (h < 0), +1 (h > 0) or 0 (sliding); one value, or one a surface
    `x`                        state, shape (dim,)
    `s`                        equivalent control (4.12); NaN of a surface with jumps
    =========================  ====================================================================
    """

    #: modes of one cycle: `-` for h < 0, `+` for h > 0, `0` for sliding; with several surfaces so
    #: many characters a mode and spaces between the modes
    word: str
    period: float  #: duration of one cycle
    turns: int  #: forcing periods of one cycle; 1 for a system that has none
    stable: bool  #: every multiplier inside the unit circle, but for the 1 of an autonomous orbit
    multipliers: Complexes  #: Floquet multipliers, largest first, shape (dim,); 0 and 1 are exact
    monodromy: Floats  #: derivative of the state after one cycle, at the start; shape (dim, dim)
    t0: float  #: time of the start: 0, which is phase zero of the forcing
    x0: Floats  #: state there, shape (dim,); without a forcing amid the longest segment
    events: Record  #: changes of mode, a structured array
    params: Params  #: parameter values
    system: System  #: of what
    status: Status  #: `ok`, or why there is no orbit
    message: str  #: the same in words, empty for `ok`
    residual: float  #: largest of what is left of the shooting equations
    iterations: int  #: of Newton's method
    rtol: float  #: tolerances of every integration: relative
    atol: float  #: and absolute

    @property
    def success(self) -> bool:
        """True if this is an orbit."""
        return self.status is Status.ok

    def _verify(self) -> None:
        dim = self.system.dim
        complete(self.params, self.system.params)
        analysis_settings(self.rtol, self.atol)
        shaped((dim,), multipliers=self.multipliers, x0=self.x0)
        shaped((dim, dim), monodromy=self.monodromy)
        verify_columns(self.system, self.events)
        if not self.success:
            return
        verify_nodes(self.system, self.events, [self.word])
        require(self.turns > 0, f"turns is {self.turns}")
        require(0 < self.period < np.inf, f"period is {self.period}")
        if self.system._forced(self.params):
            whole = self.turns * (self.system.period(self.params) or np.nan)
            near = abs(self.period - whole) <= 1e-9 * whole
            require(near, f"period is {self.period}, of {self.turns} turns {whole}")
        finite(x0=self.x0, t0=self.t0)
        t = self.events["t"]
        require(((t >= 0) & (t < self.period)).all(), "events.t is not within a period")

    def trajectory(self, periods: float = 1, **settings: Any) -> Trajectory:
        """Simulate the orbit from its start.

        An unstable orbit is left again, by a factor of its largest multiplier a cycle.

        Parameters
        ----------
        periods : float
            How many cycles.
        **settings
            For `simulate`; by default "dop853" with the tolerances of the orbit.
        """
        self._cycle()  # says so if there is no orbit
        expected = "expected a number > 0 and below 2**52"
        cycles = number("periods", periods, expected, above=0.0, below=LONGEST)
        tight: dict[str, Any] = {"method": "dop853", "rtol": self.rtol, "atol": self.atol}
        end = self.t0 + cycles * self.period
        run: Trajectory = simulate(
            self.system, self.x0, (self.t0, end), params=self.params, **(tight | settings)
        )
        return run

    def plot(
        self,
        ax: Axes | None = None,
        *,
        x: str | None = None,
        y: str | None = None,
        **artist_kw: Any,
    ) -> list[Artist]:
        """Draw one cycle: slip, sliding apart, events, and for a planar system the surface.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        x, y : str, optional
            State components or "t"; by default the phase plane of a planar system, else the first
            component against t.
        **artist_kw
            For the orbit's lines.

        Returns
        -------
        list of artists
            The surface if it is drawn, the orbit's lines, one set of marks for each kind of event.
        """
        from filippov._plot.plot_orbit import plot_orbit

        return plot_orbit(self, ax, x, y, artist_kw)

    def plot_multipliers(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the Floquet multipliers in the complex plane, with the unit circle.

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
        """Give the orbit as an `xarray.Dataset` with dimensions `event`, `state` and `other`.

        Multipliers, which are complex, are `multipliers_real` and `multipliers_imag`.
        """
        variables: dict[str, Any] = {
            "x0": ("state", self.x0),
            "multipliers": ("multiplier", self.multipliers),
            "monodromy": (("state", "other"), self.monodromy),
        }
        inner = {"x": "state", "mode_before": "switch", "mode_after": "switch"}
        columns = event_variables(self.events, **inner)
        columns["y"] = columns.pop("x")
        variables |= columns
        states = list(self.system.state)
        return dataset(self, variables, {"state": states, "other": states})

    def __repr__(self) -> str:
        if not self.success:
            return f"<Orbit of {self.system.name}: {self.status}: {self.message}>"
        what = "stable" if self.stable else "neutral" if self._neutral() else "unstable"
        sizes = ", ".join(f"{abs(m):.4g}" for m in self.multipliers)
        word = f"word {self.word}, " if self.word else ""  # none where nothing switches
        turns = f" ({self.turns} of the forcing)" if self.turns > 1 else ""
        return (
            f"<Orbit of {self.system.name}: {word}period {self.period:.9g}{turns}, "
            f"{what}, |multipliers| {sizes}>"
        )

    def _neutral(self) -> bool:
        """Tell whether the largest multiplier is on the unit circle, as far as the run can tell."""
        sizes = np.sort(np.abs(self.multipliers))
        if self.system.period(self.params) is None and sizes.size:
            sizes = np.delete(sizes, np.argmin(np.abs(sizes - 1)))  # the one along the orbit
        return sizes.size > 0 and bool(abs(sizes[-1] - 1) <= 1e3 * self.rtol)

    def _cycle(self) -> _core.CycleColumns:
        """Give the word and the nodes, as the core takes them."""
        if not self.success:
            refuse("orbit.status", str(self.status), f"expected an orbit; {self.message}")
        return cycle_of(
            self.word,
            self.events,
            (self.t0, self.x0),
            self.turns,
            self.period,
            self.params,
            forced=self.system.period(self.params) is not None,
        )


def periodic_orbit(
    sys: System,
    guess: ArrayLike | Trajectory | Orbit | FixedPoint | None = None,
    *,
    params: Mapping[str, float] | None = None,
    turns: int | None = None,
    x0: ArrayLike | None = None,
    transient: float = 200,
    max_turns: int = 32,
    window: float = 200.0,
    rtol: float = 1e-12,
    atol: float = 1e-13,
    max_steps: int = 10_000_000,
    raise_on_failure: bool = False,
) -> Orbit:
    """Find a periodic orbit, stable or not.

    The modes of a run near it give its word; Newton's method on the states and times of the events
    (multiple shooting, every segment in its prescribed mode) gives the orbit, and the same
    derivatives its monodromy matrix and multipliers.

    Parameters
    ----------
    sys : System
        The system; without jumps of the state.
    guess : optional
        None: the orbit that the run from `x0` settles on. A state, shape (dim,): at phase zero of
        the forcing, for an orbit of `turns` forcing periods. A `Trajectory`: its end. An `Orbit`:
        its word and nodes are the start, for other parameter values. A fixed point of the event
        map of a planar system: anything with the attributes `phase, boundary, iterate`.
    params : mapping, optional
        Parameter values by name that replace `sys.params`, or those of a guess that was computed
        with this `sys`.
    turns : int, optional
        Forcing periods of the orbit near a state or a trajectory; 1 by default.
    x0 : array, shape (dim,), optional
        State at t = 0 from which a run settles, without a guess; by default the origin.
    transient : float
        How long it settles: whole forcing periods, or a time for a system that has none.
    max_turns : int
        Forcing periods of the longest orbit that is looked for after that.
    window : float
        Time in which an orbit has to return, for a system without a forcing.
    rtol, atol : float
        Tolerances of every integration (Dormand-Prince 8(5,3)); `atol` in units of x.
    max_steps : int
        Bound on the steps of one run.
    raise_on_failure : bool
        Turn a failed search into an `OrbitError`.

    Returns
    -------
    Orbit
        Of a failed search too: `status` and `message` say what happened.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a second of Ctrl-C.

    Notes
    -----
    Sections 4.4 and 4.6 of the chapter. A slide costs a dimension for each surface slid on at once:
    so many multipliers are exactly 0. Without a forcing one is exactly 1. An orbit that meets two
    surfaces at the same time has no word and is not found.
    """
    _refuse_systems(sys)
    values = _base_params(sys, guess)._merged(params)
    told = analysis_settings(rtol, atol, max_steps)
    if turns is not None:
        turns = integer("turns", turns)
    if x0 is not None and guess is not None:
        refuse("x0", x0, "expected None where a guess is given")
    p = np.array(list(values.values()), dtype=np.float64)
    forced = sys._forced(values)
    raises = flag("raise_on_failure", raise_on_failure)
    limit = number("window", window, "expected a time > 0", above=0.0)
    longest, length = integer("max_turns", max_turns), span("transient", transient, forced, 0.0)
    if guess is None:
        start = vector("x0", np.zeros(sys.dim) if x0 is None else x0, sys.dim, sys.state)
        found = _core.settle(sys._model, p, start, length, longest, limit, told)
    elif isinstance(guess, Orbit):
        if turns not in (None, guess.turns):
            refuse("turns", turns, f"expected None: the guess has {guess.turns}")
        cycle = cycle_at(guess._cycle(), sys, values)
        found = _core.solve_orbit(sys._model, cycle, told)
    else:
        t0, state, times = _near(sys, guess, values, turns)
        found = _core.orbit_near(sys._model, p, t0, state, times, limit, told)
    orbit = orbit_from(sys, found, values, told)
    ended(found.raised, orbit=orbit)
    if raises and not orbit.success:
        raise OrbitError(orbit)
    return orbit


def orbit_from(
    sys: System, found: _core.OrbitResult, params: Mapping[str, float], told: _core.RunSettings
) -> Orbit:
    """Build an orbit from what the core gave; `params` are those that were asked for."""
    status, cycles = Status(found.status), found.cycles
    events, words, _ = node_events(sys, cycles)
    values = dict(zip(sys.params, cycles.p[0].tolist(), strict=True)) if words else params
    known, dim = status is Status.ok, sys.dim
    nothing = np.full(dim, np.nan)
    return Orbit(
        word=words[0] if words else "",
        period=float(cycles.period[0]) if known else np.nan,
        turns=int(cycles.turns[0]) if known else 0,
        stable=found.stable,
        multipliers=found.multipliers if known else nothing.astype(np.complex128),
        monodromy=found.monodromy if known else np.full((dim, dim), np.nan),
        t0=0.0,
        x0=cycles.x_start[0] if known else nothing,
        events=without_point(events),
        params=Params(values),
        system=sys,
        status=status,
        message="" if known else found.message,
        residual=found.residual,
        iterations=found.iterations,
        rtol=told.rtol,
        atol=told.atol[0],
    )


def _refuse_systems(sys: System) -> None:
    """Refuse what has no orbits to be found."""
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    if "jump" in sys.kinds:
        refuse("sys", sys.name, "expected a System whose state does not jump")
    require_no_directions(sys, "orbits have no derivatives")


def _base_params(sys: System, guess: object) -> System:
    """Give the system with the values that `params` replaces."""
    if isinstance(guess, (Orbit, Trajectory)):
        if guess.system._identity() != sys._identity():
            refuse("guess", guess, f"expected one of the system {sys.name}")
        if dict(guess.system.params) == dict(sys.params):
            return sys.with_params(**guess.params)
    return sys


def _near(
    sys: System, guess: object, params: Params, turns: int | None
) -> tuple[float, Floats, int]:
    """Time, state and forcing periods from which an orbit is looked for."""
    if isinstance(guess, Trajectory):
        end = guess.events[-1]
        return float(end["t"]), np.array(end["x_right"], dtype=np.float64), turns or 1
    if isinstance(guess, FixedPoint):
        if turns is not None:
            refuse("turns", turns, "expected None: a fixed point knows how long its orbit is")
        return _at_fixed_point(sys, guess, params)
    return 0.0, vector("guess", guess, sys.dim, sys.state), turns or 1  # type: ignore[arg-type]


def _at_fixed_point(sys: System, point: FixedPoint, params: Params) -> tuple[float, Floats, int]:
    """Time and state amid the slip that begins at a fixed point of the event map, and periods."""
    T = sys.period(params)
    if sys.dim != 2 or T is None:
        refuse("sys", sys.name, "expected a planar system with a period, as the event map has")
    boundary = one_of("guess.boundary", point.boundary, (-1, 1), "expected -1 or +1")
    iterate = integer("guess.iterate", point.iterate)
    t0 = number("guess.phase", point.phase) / (2 * np.pi) * T
    start = _exit_point(sys, t0, boundary, params)
    longest = (16 * iterate + 16) * T
    run = simulate(sys, start, (t0, t0 + longest), params=params, method="dop853", rtol=1e-11)
    exits = run.events[run.events["kind"] == EventKind.exit_sliding]["t"]
    exits = exits[exits > t0 + 1e-6 * T]  # the start may be logged as one
    changes = run.events["t"][run.events["t"] > t0 + 1e-6 * T]
    turns = round((exits[iterate - 1] - t0) / T) if exits.size >= iterate else 0
    if turns < 1:
        refuse("guess", point, f"expected a fixed point of the event map of {sys.name} at {params}")
    middle = 0.5 * (t0 + float(changes[0]))
    return middle, run._dense()(middle), turns


def _exit_point(sys: System, t: float, boundary: int, params: Params) -> Floats:
    """Point of the surface with s = boundary, by the secant method along the surface."""
    p = sys._values(params)

    def put(x: Floats) -> Floats:
        on_surface: Floats = sys._model.project(np.array([t]), x[None, :], 0, p)[0]
        return on_surface

    def excess(x: Floats) -> float:
        return float(sys.equivalent_control(t, x, params)) - boundary

    x = put(np.zeros(2))
    rise = np.array([sys.h(t, x + e, params) - sys.h(t, x - e, params) for e in 1e-6 * np.eye(2)])
    along = np.array([-rise[1], rise[0]]) / np.hypot(*rise)
    before, after = x, put(x + along)
    for _ in range(50):
        f0, f1 = excess(before), excess(after)
        if not abs(f1) > 1e-13 or f0 == f1:
            break
        before, after = after, put(after - f1 * (after - before) / (f1 - f0))
    if not abs(excess(after)) < 1e-9:
        refuse("guess.phase", t, f"expected a phase at which s = {boundary:+d} occurs")
    return after
