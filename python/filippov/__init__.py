# SPDX-License-Identifier: BSD-3-Clause
"""Filippov systems, simulated event by event, with sliding.

>>> import filippov as fp
>>> run = fp.simulate(fp.models.oscillator, [0.0, 0.0], (0.0, 50.0), params={"A": 0.5})
>>> run.success
True
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from ._core import __version__

if TYPE_CHECKING:
    from . import models
    from ._basin_numbers import BasinEntropy, BoxDimension, Fraction, PairCount, UncertaintyExponent
    from ._basin_sweep import BasinSweep, follow_basins
    from ._basins import Attractor, Basins, GroupCheck, Saddle, basins
    from ._bifurcation_set import BifurcationSet, bifurcation_set
    from ._boundary import (
        BasinBoundary,
        BoundaryCorner,
        BoundaryCurve,
        UnstableBranch,
        UnstableSet,
        basin_boundary,
        unstable_set,
    )
    from ._branch import Branch, SpecialPoint, continuation
    from ._cells import CellGroup, CellMap, Grid, cell_map
    from ._config import get_cmake_dir, get_include, show_config
    from ._diagram import Diagram, bifurcation_diagram
    from ._ensemble import Ensemble, LaneStats, ensemble
    from ._event import EventKind
    from ._event_map import EventMap, FixedPoint, event_map
    from ._foreign import SlowSystemWarning
    from ._geometry import Equilibrium, Tangency, boundary_equilibria, equilibria, tangencies
    from ._gsl_run import GslRun, gsl_run
    from ._lyapunov import Lyapunov, lyapunov
    from ._maps import Mapped, section_map, strobe_map
    from ._orbit import Orbit, OrbitError, periodic_orbit
    from ._refine import Audit, RefinedBasins
    from ._settings import Settings, Stats
    from ._simulate import SimulationError, simulate
    from ._sliding_boundary import SlidingBoundary, sliding_boundaries
    from ._sliding_region import SlidingRegion, sliding_region
    from ._smoothing import smoothed
    from ._solution import Solution
    from ._status import Status
    from ._store import load
    from ._system import Params, System, system
    from ._time_stepping import TimeSteps, time_stepping
    from ._trace import DefinitionError
    from ._trajectory import Branches, Piece, Trajectory

__all__ = [
    "Attractor",
    "Audit",
    "BasinBoundary",
    "BasinEntropy",
    "BasinSweep",
    "Basins",
    "BifurcationSet",
    "BoundaryCorner",
    "BoundaryCurve",
    "BoxDimension",
    "Branch",
    "Branches",
    "CellGroup",
    "CellMap",
    "DefinitionError",
    "Diagram",
    "Ensemble",
    "Equilibrium",
    "EventKind",
    "EventMap",
    "FixedPoint",
    "Fraction",
    "Grid",
    "GroupCheck",
    "GslRun",
    "LaneStats",
    "Lyapunov",
    "Mapped",
    "Orbit",
    "OrbitError",
    "PairCount",
    "Params",
    "Piece",
    "RefinedBasins",
    "Saddle",
    "Settings",
    "SimulationError",
    "SlidingBoundary",
    "SlidingRegion",
    "SlowSystemWarning",
    "Solution",
    "SpecialPoint",
    "Stats",
    "Status",
    "System",
    "Tangency",
    "TimeSteps",
    "Trajectory",
    "UncertaintyExponent",
    "UnstableBranch",
    "UnstableSet",
    "__version__",
    "basin_boundary",
    "basins",
    "bifurcation_diagram",
    "bifurcation_set",
    "boundary_equilibria",
    "cell_map",
    "continuation",
    "ensemble",
    "equilibria",
    "event_map",
    "follow_basins",
    "get_cmake_dir",
    "get_include",
    "gsl_run",
    "load",
    "lyapunov",
    "models",
    "periodic_orbit",
    "section_map",
    "show_config",
    "simulate",
    "sliding_boundaries",
    "sliding_region",
    "smoothed",
    "strobe_map",
    "system",
    "tangencies",
    "time_stepping",
    "unstable_set",
]

# Modules are imported when the first of their names is used: most sessions need few of them.
_NAMES = {
    "models": ("models",),
    "_basin_numbers": (
        "BasinEntropy",
        "BoxDimension",
        "Fraction",
        "PairCount",
        "UncertaintyExponent",
    ),
    "_basin_sweep": (
        "BasinSweep",
        "follow_basins",
    ),
    "_basins": (
        "Attractor",
        "Basins",
        "GroupCheck",
        "Saddle",
        "basins",
    ),
    "_bifurcation_set": (
        "BifurcationSet",
        "bifurcation_set",
    ),
    "_boundary": (
        "BasinBoundary",
        "BoundaryCorner",
        "BoundaryCurve",
        "UnstableBranch",
        "UnstableSet",
        "basin_boundary",
        "unstable_set",
    ),
    "_branch": (
        "Branch",
        "SpecialPoint",
        "continuation",
    ),
    "_cells": (
        "CellGroup",
        "CellMap",
        "Grid",
        "cell_map",
    ),
    "_config": ("get_cmake_dir", "get_include", "show_config"),
    "_diagram": (
        "Diagram",
        "bifurcation_diagram",
    ),
    "_ensemble": (
        "Ensemble",
        "LaneStats",
        "ensemble",
    ),
    "_event": ("EventKind",),
    "_event_map": (
        "EventMap",
        "FixedPoint",
        "event_map",
    ),
    "_geometry": (
        "Equilibrium",
        "Tangency",
        "boundary_equilibria",
        "equilibria",
        "tangencies",
    ),
    "_gsl_run": ("GslRun", "gsl_run"),
    "_lyapunov": (
        "Lyapunov",
        "lyapunov",
    ),
    "_maps": (
        "Mapped",
        "section_map",
        "strobe_map",
    ),
    "_orbit": (
        "Orbit",
        "OrbitError",
        "periodic_orbit",
    ),
    "_refine": (
        "Audit",
        "RefinedBasins",
    ),
    "_simulate": (
        "SimulationError",
        "simulate",
    ),
    "_sliding_boundary": (
        "SlidingBoundary",
        "sliding_boundaries",
    ),
    "_sliding_region": (
        "SlidingRegion",
        "sliding_region",
    ),
    "_status": ("Status",),
    "_store": ("load",),
    "_system": (
        "Params",
        "System",
        "system",
    ),
    "_foreign": ("SlowSystemWarning",),
    "_trace": ("DefinitionError",),
    "_settings": ("Settings", "Stats"),
    "_smoothing": ("smoothed",),
    "_solution": ("Solution",),
    "_time_stepping": ("TimeSteps", "time_stepping"),
    "_trajectory": ("Branches", "Piece", "Trajectory"),
}
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names}


def __getattr__(name: str) -> object:
    """Import what a name stands for, once."""
    module = _MODULE_OF.get(name)
    if module is None:
        raise AttributeError(f"module 'filippov' has no attribute {name!r}")
    found = importlib.import_module(f".{module}", __name__)
    value = found if name == module else getattr(found, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List what can be used."""
    return __all__
