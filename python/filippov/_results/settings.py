# SPDX-License-Identifier: BSD-3-Clause
"""What runs are told, checked in one place, and what they did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from filippov import _core
from filippov._support.check import MOST, choice, floats, integer, number, refuse, word
from filippov._support.sound import require

__all__ = ["Settings", "Stats", "analysis_settings", "lane_settings", "run_settings"]


METHOD_NAMES = ("dopri5", "dop853", "rodas5p")
#: Methods by their names, and by those that others gave them.
METHODS = {name: name for name in METHOD_NAMES} | {
    "RK45": "dopri5",
    "DOP853": "dop853",
    "Rodas5P": "rodas5p",
}
#: Those that lanes have.
EXPLICIT = {name: method for name, method in METHODS.items() if method != "rodas5p"}
POLICIES = ("stop", "below", "above", "stay")
ALL = "all"


@dataclass(frozen=True)
class Settings:
    """What a run was told; the arguments of `simulate`, with one `atol` a component."""

    method: str
    rtol: float
    atol: tuple[float, ...]
    max_step: float
    first_step: float | None
    max_steps: int
    max_events: int
    on_nonunique: str

    def _verify(self) -> None:
        word("method", self.method, METHOD_NAMES)
        word("on_nonunique", self.on_nonunique, (*POLICIES, ALL))
        number("rtol", self.rtol, "expected 0 < rtol < 1", above=0.0, below=1.0)
        for atol in self.atol:
            number("atol", atol, "expected numbers >= 0", least=0.0)
        number("max_step", self.max_step, "expected a number > 0", above=0.0, infinite=True)
        if self.first_step is not None:
            number("first_step", self.first_step, "expected a number > 0", above=0.0)
        integer("max_steps", self.max_steps, most=MOST)
        integer("max_events", self.max_events, most=MOST)

    def _verify_lanes(self) -> None:
        """Refuse what no ensemble is told."""
        word("method", self.method, METHOD_NAMES[:2])
        word("on_nonunique", self.on_nonunique, POLICIES)

    def _verify_cells(self) -> None:
        """Refuse what no grid of cells is told."""
        self._verify_lanes()
        require(self.first_step is None, "settings have a first_step")

    def _told(self) -> _core.RunSettings:
        """Give what the compiled core is told."""
        return _core.RunSettings(
            method=self.method,
            rtol=self.rtol,
            atol=list(self.atol),
            max_step=self.max_step,
            first_step=self.first_step or 0.0,
            max_steps=self.max_steps,
            max_events=self.max_events,
            on_nonunique="stop" if self.on_nonunique == ALL else self.on_nonunique,
        )


@dataclass(frozen=True)
class Stats:
    """What a run did, counted."""

    steps: int  #: accepted steps
    rejected: int  #: rejected trial steps
    field: int  #: evaluations of a one-sided field
    root_searches: int  #: steps in which events were looked for
    interpolants: int  #: interpolants built
    landings: int  #: trial steps taken to land on events
    events: int  #: events met

    def _verify(self) -> None:
        require(min(astuple(self)) >= 0, f"{self}: expected counts")


def run_settings(
    dim: int,
    method: str,
    rtol: float,
    atol: ArrayLike,
    max_step: float,
    max_steps: int,
    max_events: int,
    on_nonunique: str,
    first_step: float | None = None,
    *,
    methods: Mapping[str, str] = METHODS,
    policies: tuple[str, ...] = POLICIES,
) -> Settings:
    """Check what runs are told."""
    if first_step is not None:
        first_step = number("first_step", first_step, "expected a number > 0, or None", above=0.0)
    return Settings(
        method=choice("method", method, methods),
        rtol=number("rtol", rtol, "expected 0 < rtol < 1", above=0.0, below=1.0),
        atol=_absolute_tolerance(atol, dim),
        max_step=number("max_step", max_step, "expected a number > 0", above=0.0, infinite=True),
        first_step=first_step,
        max_steps=integer("max_steps", max_steps, most=MOST),
        max_events=integer("max_events", max_events, most=MOST),
        on_nonunique=word("on_nonunique", on_nonunique, policies),
    )


#: The same of what runs in lanes.
lane_settings = partial(run_settings, methods=EXPLICIT)


def analysis_settings(rtol: float, atol: float, max_steps: int = 10_000_000) -> _core.RunSettings:
    """Check what maps, orbits and branches are told of their runs."""
    return _core.RunSettings(
        rtol=number("rtol", rtol, "expected 0 < rtol < 1", above=0.0, below=1.0),
        atol=[number("atol", atol, "expected a finite number > 0", above=0.0)],
        max_steps=integer("max_steps", max_steps, most=MOST),
    )


def _absolute_tolerance(atol: ArrayLike, dim: int) -> tuple[float, ...]:
    """One number for all components, or one each."""
    expected = f"expected a finite number >= 0, or {dim} of them"
    array = floats("atol", atol, expected)
    if array.shape not in ((), (dim,)) or not (np.isfinite(array) & (array >= 0)).all():
        refuse("atol", atol, expected)
    return tuple(np.broadcast_to(array, (dim,)).tolist())
