# SPDX-License-Identifier: BSD-3-Clause
"""What runs were told, and what they did."""

from __future__ import annotations

from dataclasses import astuple, dataclass

from filippov._support.check import MOST, integer, number, word
from filippov._support.sound import require

__all__ = ["Settings", "Stats"]


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
        from filippov._runs.simulate import ALL, METHOD_NAMES, POLICIES

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
