# SPDX-License-Identifier: BSD-3-Clause
"""Filippov systems, simulated with exact events and sliding.

>>> import filippov as fp
>>> run = fp.simulate(fp.models.oscillator, [0.0, 0.0], (0.0, 50.0), params={"A": 0.5})
>>> run.success
True
"""

from __future__ import annotations

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
from ._config import get_include, show_config
from ._core import __version__
from ._diagram import Diagram, bifurcation_diagram
from ._ensemble import Ensemble, LaneStats, ensemble
from ._event import EventKind
from ._event_map import EventMap, FixedPoint, event_map
from ._geometry import Equilibrium, Tangency, boundary_equilibria, equilibria, tangencies
from ._lyapunov import Lyapunov, lyapunov
from ._maps import Mapped, section_map, strobe_map
from ._orbit import Orbit, OrbitError, periodic_orbit
from ._refine import Audit, RefinedBasins
from ._simulate import SimulationError, simulate
from ._sliding_boundary import SlidingBoundary, sliding_boundaries
from ._sliding_region import SlidingRegion, sliding_region
from ._status import Status
from ._store import load
from ._system import Params, System, system
from ._trace import DefinitionError
from ._trajectory import Branches, Piece, Settings, Solution, Stats, Trajectory

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
    "Solution",
    "SpecialPoint",
    "Stats",
    "Status",
    "System",
    "Tangency",
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
    "get_include",
    "load",
    "lyapunov",
    "models",
    "periodic_orbit",
    "section_map",
    "show_config",
    "simulate",
    "sliding_boundaries",
    "sliding_region",
    "strobe_map",
    "system",
    "tangencies",
    "unstable_set",
]
