# SPDX-License-Identifier: BSD-3-Clause
"""Lanes for the processor at hand: one compiled module an instruction set, loaded when needed."""

from __future__ import annotations

import functools
import importlib.util
import os
from typing import Any
from weakref import WeakKeyDictionary

from filippov import _core
from filippov._support.check import refuse
from filippov._system.system import System

from .seam import load

__all__ = [
    "LEVELS",
    "instruction_set",
    "instruction_sets",
    "lanes_in_a_register",
    "lanes_of",
    "level_of",
    "register_lanes_of",
    "require_level",
]

#: Instruction sets, the least first; a processor that has one has those before it.
LEVELS = ("baseline", "avx2", "avx512")


def _path(level: str) -> str:
    return f"filippov._lanes_{level}"


@functools.cache
def instruction_sets() -> tuple[str, ...]:
    """Name those that this processor has and this installation was compiled for."""
    best = LEVELS.index(_core.instruction_set())
    return tuple(level for level in LEVELS[: best + 1] if importlib.util.find_spec(_path(level)))


@functools.cache
def instruction_set() -> str:
    """Name of the instruction set in use: the best one, or what `FILIPPOV_SIMD` asks for."""
    possible = instruction_sets()
    wanted = os.environ.get("FILIPPOV_SIMD", possible[-1])
    if wanted not in possible:
        refuse("FILIPPOV_SIMD", wanted, f"expected one of {', '.join(possible)}")
    return wanted


@functools.cache
def _module(level: str) -> Any:  # noqa: ANN401 - compiled
    return load(_path(level))


_made: WeakKeyDictionary[_core.Model, object] = WeakKeyDictionary()


def lanes_of(sys: System) -> object:
    """Give what `_core` runs ensembles of a system with."""
    model = sys._model
    if model not in _made:
        _made[model] = _core.one_lane(model) or _lanes(model, _module(instruction_set()))
    return _made[model]


def register_lanes_of(sys: System) -> object | None:
    """Give the same of a system that runs in lanes, None for any other."""
    return None if _core.one_lane(sys._model) else lanes_of(sys)


def _lanes(model: _core.Model, module: Any) -> object:  # noqa: ANN401 - compiled
    scalar, tapes = _core.scalar(model), _core.tapes(model)
    if tapes is None:
        return module.lanes(model.name, scalar)
    return module.tape_lanes(model.dim, tapes, scalar)


def lanes_in_a_register() -> int:
    """How many trajectories one register holds."""
    return int(_module(instruction_set()).width)


def level_of(sys: System) -> str:
    """Name of the instruction set that ensembles of a system run with."""
    return LEVELS[0] if _core.one_lane(sys._model) else instruction_set()


def require_level(sys: System, level: str) -> None:
    """Refuse to mix instruction sets: their results differ by rounding."""
    here = level_of(sys)
    if here != level:
        refuse("FILIPPOV_SIMD", here, f"expected {level}, which the run was begun with")
