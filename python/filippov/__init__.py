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
    from ._basins.basin_numbers import (
        BasinEntropy,
        BoxDimension,
        Fraction,
        PairCount,
        UncertaintyExponent,
    )
    from ._basins.basin_sweep import BasinSweep, follow_basins
    from ._basins.basins import Attractor, Basins, GroupCheck, Saddle, basins
    from ._basins.boundary import (
        BasinBoundary,
        BoundaryCorner,
        BoundaryCurve,
        UnstableBranch,
        UnstableSet,
        basin_boundary,
        unstable_set,
    )
    from ._basins.cells import CellGroup, CellMap, Grid, cell_map
    from ._basins.refine import Audit, RefinedBasins
    from ._config import get_cmake_dir, get_include, show_config
    from ._orbits.bifurcation_set import BifurcationSet, bifurcation_set
    from ._orbits.branch import Branch, SpecialPoint, continuation
    from ._orbits.event_map import EventMap, FixedPoint, event_map
    from ._orbits.geometry import Equilibrium, Tangency, boundary_equilibria, equilibria, tangencies
    from ._orbits.lyapunov import Lyapunov, lyapunov
    from ._orbits.maps import Mapped, section_map, strobe_map
    from ._orbits.orbit import Orbit, OrbitError, periodic_orbit
    from ._orbits.sliding_boundary import SlidingBoundary, sliding_boundaries
    from ._orbits.sliding_region import SlidingRegion, sliding_region
    from ._results.event import EventKind
    from ._results.settings import Settings, Stats
    from ._results.solution import Solution
    from ._results.store import load
    from ._runs.diagram import Diagram, bifurcation_diagram
    from ._runs.ensemble import Ensemble, LaneStats, ensemble
    from ._runs.gsl_run import GslRun, gsl_run
    from ._runs.simulate import SimulationError, simulate
    from ._runs.smoothing import smoothed
    from ._runs.time_stepping import TimeSteps, time_stepping
    from ._runs.trajectory import Branches, Piece, Trajectory
    from ._support.status import Status
    from ._system.foreign import SlowSystemWarning
    from ._system.system import Params, System, system
    from ._system.trace import DefinitionError, unit

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
    "unit",
    "unstable_set",
]

# Modules are imported when the first of their names is used: most sessions need few of them.
_NAMES = {
    "models": ("models",),
    "_basins.basin_numbers": (
        "BasinEntropy",
        "BoxDimension",
        "Fraction",
        "PairCount",
        "UncertaintyExponent",
    ),
    "_basins.basin_sweep": (
        "BasinSweep",
        "follow_basins",
    ),
    "_basins.basins": (
        "Attractor",
        "Basins",
        "GroupCheck",
        "Saddle",
        "basins",
    ),
    "_orbits.bifurcation_set": (
        "BifurcationSet",
        "bifurcation_set",
    ),
    "_basins.boundary": (
        "BasinBoundary",
        "BoundaryCorner",
        "BoundaryCurve",
        "UnstableBranch",
        "UnstableSet",
        "basin_boundary",
        "unstable_set",
    ),
    "_orbits.branch": (
        "Branch",
        "SpecialPoint",
        "continuation",
    ),
    "_basins.cells": (
        "CellGroup",
        "CellMap",
        "Grid",
        "cell_map",
    ),
    "_config": ("get_cmake_dir", "get_include", "show_config"),
    "_runs.diagram": (
        "Diagram",
        "bifurcation_diagram",
    ),
    "_runs.ensemble": (
        "Ensemble",
        "LaneStats",
        "ensemble",
    ),
    "_results.event": ("EventKind",),
    "_orbits.event_map": (
        "EventMap",
        "FixedPoint",
        "event_map",
    ),
    "_orbits.geometry": (
        "Equilibrium",
        "Tangency",
        "boundary_equilibria",
        "equilibria",
        "tangencies",
    ),
    "_runs.gsl_run": ("GslRun", "gsl_run"),
    "_orbits.lyapunov": (
        "Lyapunov",
        "lyapunov",
    ),
    "_orbits.maps": (
        "Mapped",
        "section_map",
        "strobe_map",
    ),
    "_orbits.orbit": (
        "Orbit",
        "OrbitError",
        "periodic_orbit",
    ),
    "_basins.refine": (
        "Audit",
        "RefinedBasins",
    ),
    "_runs.simulate": (
        "SimulationError",
        "simulate",
    ),
    "_orbits.sliding_boundary": (
        "SlidingBoundary",
        "sliding_boundaries",
    ),
    "_orbits.sliding_region": (
        "SlidingRegion",
        "sliding_region",
    ),
    "_support.status": ("Status",),
    "_results.store": ("load",),
    "_system.system": (
        "Params",
        "System",
        "system",
    ),
    "_system.foreign": ("SlowSystemWarning",),
    "_system.trace": ("DefinitionError", "unit"),
    "_results.settings": ("Settings", "Stats"),
    "_runs.smoothing": ("smoothed",),
    "_results.solution": ("Solution",),
    "_runs.time_stepping": ("TimeSteps", "time_stepping"),
    "_runs.trajectory": ("Branches", "Piece", "Trajectory"),
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
