# SPDX-License-Identifier: BSD-3-Clause
"""Time stepping: the method without events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.store import Stored
from filippov._support.check import MOST, integer, number, refuse, start_first, time_span, vector
from filippov._support.progress import ended
from filippov._support.sound import complete, finite, ordered, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import Params, System, require_no_directions

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["TimeSteps", "time_stepping"]


@dataclass(frozen=True, eq=False, repr=False)
class TimeSteps(Stored):
    """A solution by time stepping."""

    t: Floats  #: shape (k,): the start, and the ends of the steps that are kept
    y: Floats  #: states there, shape (dim, k)
    s: Floats  #: blend variables over the steps that end there, in [-1, 1], shape (surfaces, k)
    n_steps: int  #: taken
    newtons: int  #: iterations of Newton's method
    status: Status  #: ok, "not_converged" where nothing solves a step, or "interrupted"
    message: str  #: the same in words
    system: System
    params: Params

    def _verify(self) -> None:
        n = self.t.size
        complete(self.params, self.system.params)
        ordered("t", self.t)
        require(n > 0, "t has no start")
        shaped((self.system.dim, n), y=self.y)
        finite(y=self.y)
        shaped((self.system.surfaces, n), s=self.s)

    @property
    def success(self) -> bool:
        """Whether the end was reached."""
        return self.status == Status.ok

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the components over time.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the lines.

        Returns
        -------
        list of artists
            One line a component.
        """
        from filippov._plot.plot import plot_time_steps

        return plot_time_steps(self, ax, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the solution as an `xarray.Dataset` over time."""
        variables: dict[str, Any] = {
            "y": (("state", "t"), self.y),
            "s": (("surface", "t"), self.s),
        }
        return dataset(self, variables, {"t": self.t, "state": list(self.system.state)})

    def __repr__(self) -> str:
        return (
            f"<TimeSteps of {self.system.name}: {self.n_steps} steps to t = {self.t[-1]:g},"
            f" {self.status.value}>"
        )


def time_stepping(
    sys: System,
    x0: ArrayLike,
    t_span: tuple[float, float],
    *,
    n_steps: int = 1000,
    theta: float = 1.0,
    keep: int = 1,
    params: Mapping[str, float] | None = None,
) -> TimeSteps:
    """Simulate by Moreau's time stepping: equal implicit steps that look for no event.

    In each step `x1 = x + dt ((1 - theta) f(t, x, s) + theta f(t1, x1, s))` with `s_j` in
    `Sgn(h_j(t1, x1))` is solved exactly. Sticking is exact, and events that accumulate cost
    nothing.

    Parameters
    ----------
    sys : System
        A system of formulas without jumps of the state. Where the sides were given one by one they
        are blended, and have to exist on both sides.
    x0 : array, shape (dim,)
        State at the start.
    t_span : (float, float)
        Start and end.
    n_steps : int
        Equal steps between them.
    theta : float
        1 is the implicit Euler method. With 1/2, the trapezoidal rule, the error is of second order
        as long as the solution sticks and slips, and of first order if it crosses a surface.
    keep : int
        Every so manieth step is kept, and the last.
    params : mapping, optional
        Parameter values, by name, that replace `sys.params`.

    Returns
    -------
    TimeSteps
        Also of a run that stopped: `status` says why.

    Raises
    ------
    TypeError
        For a system without formulas, or whose functions are not recorded.
    ValueError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        At Ctrl-C; its attribute `steps` is the run up to there.

    Notes
    -----
    Chapter, section 4.5; Acary & Brogliato (2008), Numerical Methods for Nonsmooth Dynamical
    Systems, chapter 9.

    Examples
    --------
    >>> import filippov as fp
    >>> steps = fp.time_stepping(fp.models.coulomb, [3, 0], (0, 20), n_steps=20_000)
    >>> bool(abs(steps.y[0, -1] + 0.2) < 0.02)
    True
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    require_no_directions(sys, "s is in a disc and not between -1 and 1")
    definition = sys._formulas()
    definition.require_formulas("be stepped in time")
    if definition.jumps or definition.smoothing is not None:
        refuse("sys", sys.name, "expected a system that switches, and whose state does not jump")
    values = sys._merged(params)
    start_first("time_stepping", x0, t_span, sys.dim)
    start = vector("x0", x0, sys.dim, sys.state)
    t0, t_end = time_span(t_span)
    n_steps = integer("n_steps", n_steps, most=MOST)
    keep = integer("keep", keep, most=MOST)
    expected = "expected a number from 1/2 to 1"
    theta = number("theta", theta, expected, least=0.5)
    if theta > 1:
        refuse("theta", theta, expected)
    run = _core.time_stepping(
        definition.graph,
        list(definition.params.values()),
        list(values.values()),
        definition.field,
        list(definition.surfaces.values()),
        start.tolist(),
        t0,
        t_end,
        n_steps,
        theta,
        keep,
    )
    result = TimeSteps(
        t=run.t,
        y=np.ascontiguousarray(run.y.T),
        s=np.ascontiguousarray(run.s.T),
        n_steps=run.n_steps,
        newtons=run.newtons,
        status=Status(run.status),
        message=run.message,
        system=sys,
        params=values,
    )
    ended(run.raised, steps=result)
    return result
