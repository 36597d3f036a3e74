# SPDX-License-Identifier: BSD-3-Clause
"""Filippov systems, simulated with exact events and sliding.

>>> import filippov as fp
>>> run = fp.simulate(fp.models.oscillator, [0.0, 0.0], (0.0, 50.0), params={"A": 0.5})
>>> run.success
True
"""

from __future__ import annotations

from . import models
from ._config import get_include, show_config
from ._core import __version__
from ._event import EventKind
from ._simulate import SimulationError, simulate
from ._sliding_region import SlidingRegion, sliding_region
from ._status import Status
from ._system import Params, System
from ._trajectory import Piece, Settings, Solution, Stats, Trajectory

__all__ = [
    "EventKind",
    "Params",
    "Piece",
    "Settings",
    "SimulationError",
    "SlidingRegion",
    "Solution",
    "Stats",
    "Status",
    "System",
    "Trajectory",
    "__version__",
    "get_include",
    "models",
    "show_config",
    "simulate",
    "sliding_region",
]
