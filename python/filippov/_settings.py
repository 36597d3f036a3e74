# SPDX-License-Identifier: BSD-3-Clause
"""What runs were told, and what they did."""

from __future__ import annotations

from dataclasses import dataclass

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
