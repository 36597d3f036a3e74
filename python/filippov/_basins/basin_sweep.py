# SPDX-License-Identifier: BSD-3-Clause
"""Basins followed over a parameter, with attractors that keep their numbers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._results.dataset import dataset
from filippov._results.store import Stored, load
from filippov._support.check import floats, mapping, number, path_of, refuse, word
from filippov._support.progress import Progress, ended, shown
from filippov._support.sound import complete, require, shaped
from filippov._support.types import Floats
from filippov._system.system import Params, System

from .basins import Attractor, Basins, Saddle, basins, verify_cycles
from .cells import GridArgument

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["BasinSweep", "follow_basins"]


@dataclass(frozen=True, eq=False, repr=False)
class BasinSweep(Stored):
    """Result of `follow_basins`, one entry a value of the parameter."""

    parameter: str
    values: Floats  #: those that were finished
    ids: tuple[int, ...]  #: of all attractors that were met, in the order in which they appeared
    #: Share of each one's basin, NaN where it is not, shape (values, ids).
    fractions: Floats
    low: Floats  #: bounds of the shares from the cells beside boundaries, shape (values, ids)
    high: Floats
    escaped: Floats  #: share of the cells, shape (values,)
    unresolved: Floats  #: share of the cells, shape (values,)
    attractors: tuple[tuple[Attractor, ...], ...]  #: of each value
    labels: tuple[NDArray[np.int64], ...]  #: of each value: the id of each of its attractors
    saddles: tuple[tuple[Saddle, ...], ...]  #: of each value
    system: System
    params: Params  #: the other parameters

    _parts = (Attractor, Saddle)

    def _verify(self) -> None:
        n = self.values.size
        complete(self.params, self.system.params)
        require(self.parameter in self.params, f"parameter is {self.parameter!r}")
        shaped((n,), values=self.values, escaped=self.escaped, unresolved=self.unresolved)
        shaped((n, len(self.ids)), fractions=self.fractions, low=self.low, high=self.high)
        require(len(set(self.ids)) == len(self.ids), f"ids are {self.ids}")
        each = (self.attractors, self.labels, self.saddles)
        require(all(len(column) == n for column in each), f"attractors are not of {n} values")
        for attractors, labels, saddles in zip(*each, strict=True):
            verify_cycles(self.system, attractors, saddles)
            shaped((len(attractors),), labels=labels)
            require(set(labels.tolist()) <= set(self.ids), f"labels are {labels.tolist()}")

    def to_xarray(self) -> xr.Dataset:
        """Give the shares as an `xarray.Dataset` over the parameter and the ids."""
        by_id = (self.parameter, "attractor")
        variables: dict[str, Any] = {
            name: (by_id, getattr(self, name)) for name in ("fractions", "low", "high")
        }
        variables |= {
            name: (self.parameter, getattr(self, name)) for name in ("escaped", "unresolved")
        }
        return dataset(self, variables, {self.parameter: self.values, "attractor": list(self.ids)})

    def plot(self, ax: Axes | None = None, **artist_kw: Any) -> list[Artist]:
        """Draw the shares over the parameter, one above the other.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        **artist_kw
            For all areas.

        Returns
        -------
        list of artists
            The areas of the attractors, of what escaped, and of what is unresolved.
        """
        from filippov._plot.plot_basins import plot_sweep

        return plot_sweep(self, ax, artist_kw)

    def __repr__(self) -> str:
        ends = f"{self.values[0]:g} to {self.values[-1]:g}" if self.values.size else "nothing"
        return (
            f"<BasinSweep of {self.system.name} over {self.parameter}, {ends}: "
            f"{self.values.size} values, {len(self.ids)} attractors>"
        )


def follow_basins(
    sys: System,
    grid: GridArgument,
    parameter: str,
    values: Sequence[float] | Floats,
    *,
    threshold: float = 0.1,
    params: Mapping[str, float] | None = None,
    store: str | os.PathLike[str] | None = None,
    progress: Progress = False,
    **settings: Any,
) -> BasinSweep:
    """Compute basins at one parameter value after the other, and match their attractors.

    An attractor keeps its id from value to value as long as it moves by less than the threshold:
    attractors are matched one to one with the least sum of distances. An id is never used again.

    Parameters
    ----------
    sys, grid, params
        As in `basins`.
    parameter : str
        Name of the parameter that varies.
    values : array
        Its values, in the order in which they are followed.
    threshold : float
        Largest distance of an attractor from the one it was before, in units of the picture.
    store : path, optional
        A directory with the result of each value, as `Basins.save` writes it: a run that was
        killed goes on from there. Results of other arguments are not taken.
    progress : bool or function
        True shows a bar; a function is called as `progress(done, total)`, in values.
    **settings
        Others of `basins`; `times` is False unless it is given, which is faster where cells can be
        labelled by their exit from stick to slip.

    Returns
    -------
    BasinSweep

    Raises
    ------
    KeyboardInterrupt
        Within a second of Ctrl-C; its attribute `sweep` has the values that were finished.
    """
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.models.oscillator", TypeError)
    names = tuple(sys.params)
    parameter = word("parameter", parameter, names, f"expected one of {', '.join(names)}")
    if parameter in mapping("params", params, "expected a mapping of names to values"):
        refuse("params", params, f"expected others than {parameter!r}, which varies")
    wanted = floats("values", values, "expected numbers")
    if wanted.ndim != 1 or wanted.size == 0 or not np.isfinite(wanted).all():
        refuse("values", values, "expected finite numbers, at least one")
    threshold = number("threshold", threshold, "expected a number > 0", above=0.0)
    if store is not None:
        path_of("store", store)
    settings = {"times": False} | settings
    for name in ("store", "progress", "params"):
        if name in settings:
            refuse("settings", name, "expected settings of each picture")
    base = sys._merged(params)
    sys._require_period(base, {parameter: wanted[[0, -1]].tolist()})
    sweep = _Sweep(threshold)
    raised: BaseException | None = None
    with shown(progress, "value") as show:
        try:
            for k, value in enumerate(wanted.tolist()):
                here = dict(base) | {parameter: value}
                sweep.add(value, _picture(sys, grid, here, settings, store))
                if show is not None:
                    show(k + 1, wanted.size)
        except BaseException as error:  # it is raised again, with what was finished
            if not sweep.values:
                raise
            raised = error
    result = sweep.result(sys, parameter, base)
    ended(raised, sweep=result)
    return result


def _picture(
    sys: System,
    grid: GridArgument,
    params: Mapping[str, float],
    settings: Mapping[str, Any],
    store: str | os.PathLike[str] | None,
) -> Basins:
    """One picture, from the store if it is there."""
    if store is None:
        return basins(sys, grid, params=params, **settings)
    import hashlib

    folder = Path(store)
    folder.mkdir(parents=True, exist_ok=True)
    told = repr(
        (_core.__version__, sys._identity(), grid, sorted(params.items()), sorted(settings.items()))
    )
    file = folder / f"{hashlib.sha256(told.encode()).hexdigest()[:32]}.npz"
    if file.exists():
        found = load(file)
        if isinstance(found, Basins):
            return found
    picture = basins(sys, grid, params=params, **settings)
    picture.save(file)
    return picture


class _Sweep:
    """What grows from value to value."""

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold
        self.known: list[tuple[int, Floats]] = []
        self.next_id = 1
        self.ids: list[int] = []
        self.values: list[float] = []
        self.pictures: list[Basins] = []
        self.labels: list[list[int]] = []

    def add(self, value: float, picture: Basins) -> None:
        """Match the attractors of one more picture."""
        grid = picture.grid
        scale = np.ones(picture.system.dim)
        for axis, coordinate in enumerate(grid.coordinates):
            scale[coordinate] = grid.high[axis] - grid.low[axis]
        points = [np.ascontiguousarray(a.points.T) for a in picture.attractors]
        ids, _, self.next_id = _core.match_attractors(
            self.known, points, scale, self.threshold, self.next_id
        )
        self.known = list(zip(ids, points, strict=True))
        self.ids += [n for n in ids if n not in self.ids]
        self.values.append(value)
        self.labels.append(ids)
        self.pictures.append(picture)

    def result(self, sys: System, parameter: str, base: Params) -> BasinSweep:
        """Tabulate."""
        shape = (len(self.values), len(self.ids))
        tables = {name: np.full(shape, np.nan) for name in ("value", "low", "high")}
        rest = {label: np.zeros(shape[0]) for label in (-1, 0)}
        for k, (picture, ids) in enumerate(zip(self.pictures, self.labels, strict=True)):
            bounds = picture.bounds
            for label, attractor in enumerate(ids, start=1):
                share = bounds.get(label)
                for name, table in tables.items():
                    table[k, self.ids.index(attractor)] = getattr(share, name, 0.0)
            for label, column in rest.items():
                if label in bounds:
                    column[k] = bounds[label].value
        return BasinSweep(
            parameter=parameter,
            values=np.array(self.values),
            ids=tuple(self.ids),
            fractions=tables["value"],
            low=tables["low"],
            high=tables["high"],
            escaped=rest[-1],
            unresolved=rest[0],
            attractors=tuple(picture.attractors for picture in self.pictures),
            labels=tuple(np.array(ids, dtype=np.int64) for ids in self.labels),
            saddles=tuple(picture.saddles for picture in self.pictures),
            system=sys,
            params=base,
        )
