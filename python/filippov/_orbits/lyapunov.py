# SPDX-License-Identifier: BSD-3-Clause
"""Lyapunov exponents through crossings and slides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.settings import analysis_settings
from filippov._results.store import Stored
from filippov._support.check import integer, number, refuse, vector
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import complete, require, shaped
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import Params, System, require_no_directions

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Lyapunov", "lyapunov"]


@dataclass(frozen=True, eq=False, repr=False)
class Lyapunov(Stored):
    """Lyapunov exponents over a window of one solution."""

    exponents: Floats  #: largest first, per unit of time; -inf exactly where slides end all
    error: Floats  #: standard error of each over the window, from batch means
    window: tuple[float, float]  #: times between which growth was averaged
    slides: int  #: modes with a slide that were entered within the window
    stretches: int  #: that were averaged
    skipped: int  #: left out, since they pass a tangency and have no derivative
    x: Floats  #: state at the end
    status: Status  #: ok, or why the window ended early
    message: str  #: the same in words
    system: System
    params: Params

    def _verify(self) -> None:
        complete(self.params, self.system.params)
        shaped((self.system.dim,), exponents=self.exponents, error=self.error, x=self.x)
        require(not (self.error < 0).any(), "error is negative")

    @property
    def success(self) -> bool:
        """Whether the window was followed to its end."""
        return self.status == Status.ok

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the exponents with their error bars.

        Exponents of -inf, which slides have, are arrows at the lower edge.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For the points.

        Returns
        -------
        list of artists
            The points, the bars, the line of zero, then the arrows.
        """
        from filippov._plot.plot import plot_lyapunov

        return plot_lyapunov(self, ax, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the exponents as an `xarray.Dataset`, the largest first."""
        variables: dict[str, Any] = {
            "exponents": ("exponent", self.exponents),
            "error": ("exponent", self.error),
            "x": ("state", self.x),
        }
        return dataset(self, variables, {"state": list(self.system.state)})

    def __repr__(self) -> str:
        each = ", ".join(
            f"{value:.6g} +- {error:.2g}" if np.isfinite(value) else f"{value:.6g}"
            for value, error in zip(self.exponents, self.error, strict=True)
        )
        found = f"{each}; {self.slides} slides; {self.status}"
        return f"<Lyapunov exponents of {self.system.name}: {found}>"


def lyapunov(
    sys: System,
    x0: ArrayLike | None = None,
    *,
    params: Mapping[str, float] | None = None,
    transient: float = 1000.0,
    window: float = 1000.0,
    stretch: float = 1.0,
    batches: int = 20,
    rtol: float = 1e-12,
    atol: float = 1e-13,
    progress: Progress = False,
) -> Lyapunov:
    """Compute Lyapunov exponents of the solution from x0 at t = 0.

    Tangent vectors go along with the flow, through all events, and are made orthonormal after every
    stretch. A slide takes one direction for good for each surface slid on at once, contact with
    an impact surface two: their exponents are -inf exactly. The error bar is that of the mean over
    this window; a transient that outlasts `transient` it cannot know of.

    Parameters
    ----------
    sys : System
        Of what.
    x0 : array, shape (dim,), optional
        State at t = 0, the origin by default.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    transient, window, stretch : float
        Before averaging, of averaging, and between orthonormalisations: in forcing periods, or in
        units of time for a system that has none.
    batches : int
        Whose means make the error bar, at least 2.
    rtol, atol : float
        Tolerances of the flow.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in stretches, always from
        the calling thread.

    Returns
    -------
    Lyapunov

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a fraction of a second of Ctrl-C; its attribute `lyapunov` has the exponents of what
        was finished of the window.
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System", TypeError)
    require_no_directions(sys, "solutions have no derivatives")
    values = sys._merged(params)
    start = vector("x0", np.zeros(sys.dim) if x0 is None else x0, sys.dim, sys.state)
    sys._forced(values)
    positive = "expected a finite number > 0"
    transient = number("transient", transient, "expected a finite number >= 0", least=0.0)
    stretch = number("stretch", stretch, positive, above=0.0)
    window = number("window", window, positive, above=0.0)
    batches = integer("batches", batches)
    if not 2 <= batches <= 1_000_000:
        refuse("batches", batches, "expected an integer from 2 to 1000000")
    if not window >= batches * stretch:
        least = f"{batches * stretch:g}: {batches} batches of one stretch, {stretch:g}"
        refuse("window", window, f"expected at least {least}")
    told = analysis_settings(rtol, atol)
    with shown(progress, "stretch") as show:
        run = _core.lyapunov(
            sys._model,
            np.array(list(values.values()), dtype=np.float64),
            start,
            told,
            transient,
            window,
            stretch,
            batches,
            show,
        )
    result = Lyapunov(
        exponents=run.exponents,
        error=run.error,
        window=(run.t_begin, run.t_end),
        slides=run.slides,
        stretches=run.stretches,
        skipped=run.skipped,
        x=run.x,
        status=Status(run.status),
        message=run.message,
        system=sys,
        params=values,
    )
    ended(run.raised, lyapunov=result)
    return result
