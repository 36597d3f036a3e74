# SPDX-License-Identifier: BSD-3-Clause
"""The boundaries of the sliding region over a period of the forcing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.store import Stored
from filippov._support.check import integer, refuse
from filippov._support.progress import ended
from filippov._support.sound import complete, ordered, require, shaped
from filippov._support.status import Status
from filippov._support.types import Bools, Floats
from filippov._system.bounds import Bounds, box
from filippov._system.system import Params, System

from .geometry import Tangency, one_surface, seeds_of, tangency

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["SlidingBoundary", "sliding_boundaries"]

MOST_SAMPLES = 1_000_000


@dataclass(frozen=True, eq=False, repr=False)
class SlidingBoundary(Stored):
    """One boundary of the sliding region, s = -1 or +1, over one period of the forcing."""

    side: int  #: whose field is tangent there: -1 (s = -1) or +1 (s = +1)
    t: Floats  #: times from 0 to the period, shape (k,)
    phase: Floats  #: the same as phases of the forcing, from 0 to 2 pi
    x: Floats  #: states, shape (2, k)
    drift: Floats  #: derivative of |s| along the sliding field: > 0 where slides end
    visible: Bools  #: that side's solution touches the surface from its own side
    attracting: Bools  #: the sliding beside it attracts
    #: where the sliding flow is tangent to the boundary, in order of time: there slides begin to
    #: end or cease to, and adding-sliding happens
    tangential: tuple[Tangency, ...]
    status: Status  #: ok, or `not_converged` if the boundary could not be followed all round
    message: str  #: the same in words
    system: System
    params: Params

    _parts = (Tangency,)

    def _verify(self) -> None:
        n = self.t.size
        complete(self.params, self.system.params)
        require(self.system.dim == 2, f"system is {self.system.name}")
        require(self.side in (-1, 1), f"side is {self.side}, expected -1 or +1")
        ordered("t", self.t)
        require(n > 1 and self.t[0] < self.t[-1], "t does not rise")
        columns = ("phase", "drift", "visible", "attracting")
        shaped((n,), **{name: getattr(self, name) for name in columns})
        shaped((2, n), x=self.x)
        require(all(len(each.x) == 2 for each in self.tangential), "tangential has other states")

    @property
    def success(self) -> bool:
        """Whether the boundary was followed all round."""
        return self.status == Status.ok

    def plot(
        self, ax: Axes | None = None, *, y: str | None = None, **artist_kw: Any
    ) -> list[Artist]:
        """Draw a state component over the phase: solid where slides end, dashed elsewhere.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            The current ones by default.
        y : str, optional
            The component, the first by default.
        **artist_kw
            For the curve, for instance `color`.

        Returns
        -------
        list of artists
        """
        from filippov._plot.plot import plot_sliding_boundary

        return plot_sliding_boundary(self, ax, y, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the boundary as an `xarray.Dataset` over the time of one period."""
        variables: dict[str, Any] = {"x": (("state", "t"), self.x)}
        variables |= {
            name: ("t", getattr(self, name)) for name in ("phase", "drift", "visible", "attracting")
        }
        return dataset(self, variables, {"t": self.t, "state": list(self.system.state)})

    def __repr__(self) -> str:
        return (
            f"<SlidingBoundary of {self.system.name}, s = {self.side:+d}: {self.t.size} points,"
            f" {len(self.tangential)} tangential slides; {self.status}>"
        )


def sliding_boundaries(
    sys: System,
    *,
    bounds: Bounds,
    params: Mapping[str, float] | None = None,
    samples: int = 256,
    seeds: int = 64,
) -> list[SlidingBoundary]:
    """Follow the boundaries of the sliding region over a period of the forcing.

    Each tangency within the bounds at phase zero is followed to phase 2 pi, beyond the bounds if it
    goes there. A boundary that appears later in the period is not seen.

    Parameters
    ----------
    sys : System
        With two state components, one surface and a period; without static friction, with which a
        slide does not end at |s| = 1.
    bounds, params, seeds
        As in `tangencies`.
    samples : int
        Steps over the period, at equidistant phases.

    Returns
    -------
    list of SlidingBoundary
        Those where F1 is tangent first.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    KeyboardInterrupt
        Within a fraction of a second of Ctrl-C.
    """
    expected = "expected a forced planar System with one surface"
    one_surface(sys)
    if sys.dim != 2 or "period" not in sys.capabilities:
        refuse("sys", sys.name, expected)
    if "s_max" in sys.capabilities:
        refuse("sys", sys.name, "expected a system without static friction")
    low, high = box(sys, bounds)
    values = sys._merged(params)
    sys._forced(values)
    steps = integer("samples", samples)
    if not 8 <= steps <= MOST_SAMPLES:
        refuse("samples", samples, f"expected an integer from 8 to {MOST_SAMPLES}")
    run = _core.sliding_boundaries(
        sys._model, low, high, sys._values(values), steps, seeds_of(seeds)
    )
    ended(run.raised)
    return [_boundary(each, sys, values) for each in run.found]


def _boundary(found: _core.SlidingBoundaryColumns, sys: System, params: Params) -> SlidingBoundary:
    period = sys.period(params) or np.nan
    side = found.side
    return SlidingBoundary(
        side=side,
        t=found.t,
        phase=2 * np.pi * found.t / period,
        x=found.x.T,
        drift=found.drift,
        visible=side * found.second > 0,
        attracting=side * found.other > 0,
        tangential=tuple(tangency(each) for each in found.tangential),
        status=Status(found.status),
        message=found.message,
        system=sys,
        params=params,
    )
