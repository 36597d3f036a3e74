# SPDX-License-Identifier: BSD-3-Clause
"""Basins on squares that are split along their boundaries only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.store import Stored
from filippov._support.check import MOST, integer, number, word
from filippov._support.progress import ended
from filippov._support.sound import codes, complete, require, shaped
from filippov._system.system import Params, System

from .basin_work import BasinWork
from .cells import Grid, Integers

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Audit", "RefinedBasins"]


@dataclass(frozen=True)
class Audit:
    """Random points in the squares without a neighbour of another label."""

    points: int
    wrong: int  #: of them, with another label than their square
    share: float  #: of the picture's area that those squares have
    bound: float  #: 95% upper bound of the wrong part of that area (Clopper and Pearson)


@dataclass(frozen=True, eq=False, repr=False)
class RefinedBasins(Stored):
    """Result of `Basins.refine`: squares, of which each was labelled at its centre."""

    squares: Integers  #: level, and place along both axes, shape (n, 3)
    label: Integers  #: 1, 2, ... the attractor, 0 unresolved, -1 escaped, shape (n,)
    time: Integers  #: number of the flash at which the centre had landed, -1: it did not
    counts: NDArray[np.int64]  #: squares at the boundary, and marked ones, shape (levels + 1, 2)
    trajectories: int  #: that were run, those of the audit not among them
    dimension: float  #: of the boundary, from the growth of the counts
    dimension_error: float  #: standard error
    audit: Audit
    status: str  #: "ok"; "not_converged" where the boundary fills the plane, "max_steps"
    message: str
    coarse: int  #: squares along either side on level 0
    levels: int
    grid: Grid  #: the rectangle, and the cells of the picture that it came from
    system: System
    params: Params

    _parts = (Audit, Grid)

    def _verify(self) -> None:
        self.grid.verify_in(self.system)
        complete(self.params, self.system.params)
        n = self.label.size
        shaped((n, 3), squares=self.squares)
        shaped((n,), label=self.label, time=self.time)
        require(self.coarse > 0 and 0 <= self.levels < 31, f"{self.coarse}, {self.levels}: levels")
        shaped((self.levels + 1, 2), counts=self.counts)
        codes(0, self.levels + 1, level=self.squares[:, 0])
        codes(-1, 2**15, label=self.label)  # what a picture has colours for
        codes(-1, 2**31, time=self.time)
        for level in range(self.levels + 1):
            here = self.squares[:, 0] == level
            codes(0, self.coarse << level, place=self.squares[here, 1:])
        sizes = np.bincount(self.squares[:, 0], minlength=self.levels + 1).tolist()
        area = sum(count << 2 * (self.levels - level) for level, count in enumerate(sizes))
        require(area == self.shape[0] ** 2, "squares do not cover the picture")

    @property
    def shape(self) -> tuple[int, int]:
        """Cells of the finest level, along both axes."""
        n = self.coarse << self.levels
        return (n, n)

    def paint(self, cells: int | None = None, *, what: str = "label") -> Integers:
        """Give the picture as an array.

        Parameters
        ----------
        cells : int, optional
            Along either side; by default those of the finest level.
        what : str
            "label" or "time".

        Returns
        -------
        array, shape (cells, cells)
            Of the square that holds each cell's centre; the first axis is the grid's first.
        """
        n = self.shape[0]
        what = word("what", what, ("label", "time"))
        if cells is not None:
            cells = integer("cells", cells)
        values = self.time if what == "time" else self.label
        picture = np.zeros((n, n), dtype=np.int32)
        for level in range(self.levels + 1):
            here = self.squares[:, 0] == level
            size = 1 << (self.levels - level)
            first = (self.squares[here, 1:] * size).T
            inside = np.arange(size)
            rows = first[0][:, None, None] + inside[None, :, None]
            columns = first[1][:, None, None] + inside[None, None, :]
            picture[rows, columns] = values[here][:, None, None]
        if cells is None or cells == n:
            return picture
        at = (2 * np.arange(cells) + 1) * n // (2 * cells)
        return picture[np.ix_(at, at)]

    def to_xarray(self) -> xr.Dataset:
        """Give the picture at its finest level as an `xarray.Dataset` over its two components.

        The squares, as `squares` and `label`, are `square_level`, `square_place`, `square_label`.
        """
        finest = replace(self.grid, shape=self.shape)
        variables: dict[str, Any] = {
            what: (finest.names, self.paint(what=what)) for what in ("label", "time")
        }
        variables |= {
            "square_level": ("square", self.squares[:, 0]),
            "square_place": (("square", "axis"), self.squares[:, 1:]),
            "square_label": ("square", self.label),
        }
        return dataset(self, variables, finest.coords())

    def plot(
        self, ax: Axes | None = None, *, cells: int | None = None, **artist_kw: Any
    ) -> list[Artist]:
        """Draw the picture.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        cells : int, optional
            As in `paint`.
        **artist_kw
            For the image.

        Returns
        -------
        list of artists
            The image.
        """
        from filippov._plot.plot_basins import plot_labels

        return plot_labels(self.grid, self.paint(cells), ax, artist_kw)

    def __repr__(self) -> str:
        n = self.shape[0]
        return (
            f"<RefinedBasins, {n} x {n} from {self.trajectories} trajectories "
            f"({self.trajectories / n**2:.2%}); {self.audit.wrong} of {self.audit.points} audited "
            f"wrong, at most {self.audit.bound:.2%} of the inside; {self.status}>"
        )


def refine(
    work: BasinWork,
    known: list[_core.AttractorColumns],
    coarse: int,
    levels: int,
    time_jump: int,
    audit: int,
    seed: int,
    full_dimension: float,
    max_points: int,
) -> RefinedBasins:
    """Label squares, see `Basins.refine`."""
    coarse, levels = integer("coarse", coarse, most=2**20), integer("levels", levels, 0)
    found = work.finder.refine(
        known,
        coarse,
        levels,
        integer("time_jump", time_jump, 0),
        number("full_dimension", full_dimension, "expected a number > 0", above=0.0),
        integer("max_points", max_points, most=MOST),
        integer("audit", audit, 0),
        integer("seed", seed, 0, MOST),
    )
    audited = found.audit
    result = RefinedBasins(
        squares=found.squares,
        label=found.label,
        time=found.time,
        counts=found.counts,
        trajectories=found.trajectories,
        dimension=found.dimension.value,
        dimension_error=found.dimension.error,
        audit=Audit(audited.points, audited.wrong, audited.share, audited.bound),
        status=found.status,
        message=found.message,
        coarse=coarse,
        levels=levels,
        grid=work.picture.grid,
        system=work.sys,
        params=work.picture.params,
    )
    ended(found.raised, refined=result)
    return result
