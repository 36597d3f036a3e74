# SPDX-License-Identifier: BSD-3-Clause
"""How a run ended."""

from __future__ import annotations

from enum import Enum

__all__ = ["SUCCESS", "Status"]


class Status(str, Enum):
    """How a run ended; compares equal to its name.

    Everything but `ok` and `event` is a reason to look at the result twice.
    """

    ok = "ok"  #: reached the end of the time span
    event = "event"  #: stopped at a terminal event
    max_steps = "max_steps"  #: `max_steps` used up
    max_events = "max_events"  #: `max_events` used up
    step_too_small = "step_too_small"  #: the error test asks for steps below the resolution of time
    not_finite = "not_finite"  #: the field or h is NaN or infinite and no shorter step helps
    ambiguous = "ambiguous"  #: not unique here, or not shown to be unique; the policy is "stop"
    degenerate_surface = "degenerate_surface"  #: the gradient of h vanishes on the surface
    dependent_surfaces = "dependent_surfaces"  #: gradients of several surfaces are dependent
    jump_cascade = "jump_cascade"  #: too many state jumps in a row at one time
    accumulation = "accumulation"  #: events accumulate at a finite time
    not_converged = "not_converged"  #: an iteration did not converge
    escaped = "escaped"  #: the state left the domain of interest
    interrupted = "interrupted"  #: the caller asked to stop

    def __str__(self) -> str:
        return self.value


SUCCESS = frozenset({Status.ok, Status.event})
