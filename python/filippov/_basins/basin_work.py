# SPDX-License-Identifier: BSD-3-Clause
"""The parts of a picture of basins, to be run here or elsewhere."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from filippov import _core
from filippov._results.settings import Settings
from filippov._results.tiles import Arrays, Show
from filippov._runs.lanes import lanes_of, require_level
from filippov._system.system import System

from .cells import Integers, Picture

__all__ = ["BasinWork", "LabelWork"]


@dataclass(frozen=True)
class BasinWork:
    """The parts of a picture, here or elsewhere: sent, it makes a finder of its own."""

    sys: System
    picture: Picture
    settings: Settings
    search: Mapping[str, Any]  #: how attractors are looked for: fields of `_core.BasinSettings`
    bounds: list[float] | None
    threads: int
    level: str  #: instruction set

    def __reduce__(self) -> tuple[Any, ...]:
        return BasinWork, tuple(getattr(self, field.name) for field in fields(self))

    @functools.cached_property
    def finder(self) -> _core.BasinFinder:
        """Compiled, made when it is first asked for; it is not sent."""
        require_level(self.sys, self.level)
        picture = self.picture
        return _core.BasinFinder(
            self.sys._model,
            lanes_of(self.sys),
            picture.grid.axes,
            picture.table,
            _core.BasinSettings(
                run=self.settings._told(),
                rest=picture.rest,
                t0=picture.t0,
                escape=self.bounds or [],
                threads=self.threads,
                **self.search,
            ),
        )

    def _cells(self, first: int, count: int) -> tuple[int, int]:
        """Rows of the picture as cells."""
        n = self.picture.grid.shape[1]
        return first * n, count * n

    def images(self, first: int, count: int, inputs: Arrays, show: Show) -> Mapping[str, Any]:
        """Images of the cells in some rows."""
        del inputs
        found = self.finder.images(*self._cells(first, count), show)
        return {
            "image": found.image,
            "image_state": found.state,
            "image_status": found.status,
            **found.counters,
            "raised": found.raised,
        }

    def find(self, image: Integers, raised: BaseException | None) -> _core.LimitSetsResult:
        """Attractors, saddles, and the plain map; nothing but that after an interruption."""
        if raised is None:
            return self.finder.find(image.ravel())
        plain = _core.cell_map(self.picture.grid.axes, image.ravel())
        return _core.LimitSetsResult(plain=plain, raised=raised)

    def labels(self, attractors: list[_core.AttractorColumns]) -> LabelWork:
        """Work that labels cells."""
        return LabelWork(self, attractors)

    def complete(
        self,
        attractors: list[_core.AttractorColumns],
        image: Integers,
        label: Integers,
        raised: BaseException | None,
    ) -> _core.BasinChecks:
        """Audit, and the confusion table; nothing of it after an interruption."""
        if raised is None:
            return self.finder.complete(attractors, image.ravel(), label.ravel())
        return _core.BasinChecks(by_exit_reason="It was interrupted.", raised=raised)


@dataclass(frozen=True)
class LabelWork:
    """Labels cells from their images."""

    basins: BasinWork
    attractors: list[_core.AttractorColumns]

    def __call__(self, first: int, count: int, inputs: Arrays, show: Show) -> Mapping[str, Any]:
        """Labels of the cells in some rows."""
        found = self.basins.finder.labels(
            self.attractors,
            *self.basins._cells(first, count),
            inputs["state"].reshape(-1, self.basins.sys.dim),
            inputs["status"].ravel(),
            show,
        )
        return {
            "label": found.label,
            "time": found.time,
            "status": found.status,
            "periods": found.periods,
            "looked_up": found.looked_up,
            **found.counters,
            "raised": found.raised,
        }
