# SPDX-License-Identifier: BSD-3-Clause
"""What runs were told, and what they did."""

from __future__ import annotations

from dataclasses import astuple, dataclass

from filippov._support.check import MOST, integer, number, word
from filippov._support.sound import require

__all__ = ["Settings", "Stats"]


METHODS = {"dopri5": 0, "dop853": 1, "RK45": 0, "DOP853": 1, "rodas5p": 2, "Rodas5P": 2}
METHOD_NAMES = ("dopri5", "dop853", "rodas5p")
#: Those that lanes have.
EXPLICIT = {name: k for name, k in METHODS.items() if k < 2}
POLICIES = {"stop": 0, "below": 1, "above": 2, "stay": 3}
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
