# SPDX-License-Identifier: BSD-3-Clause
"""The solution of a run at any time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov import _core
from filippov._support.check import floats, refuse
from filippov._support.sound import finite, ordered, require, shaped
from filippov._support.types import FloatOrArray, Floats, Modes
from filippov._system.system import System

__all__ = ["Solution"]

_T = TypeVar("_T", bound=np.generic)


class Solution:
    """The solution at any time of a run.

    `sol(t)` has shape (dim,) for a number and (dim, k) for an array. At an event it is the state
    there, at the end of a step exactly the state of that step.
    """

    def __init__(self, core: _core.Solution, system: System) -> None:
        self._core = core
        self._system = system
        self._surfaces = system.surfaces
        self.ts: Floats = core.knots()  #: ends of the steps, the start first

    @property
    def t_min(self) -> float:
        """Earliest time."""
        return float(min(self.ts[0], self.ts[-1]))

    @property
    def t_max(self) -> float:
        """Latest time."""
        return float(max(self.ts[0], self.ts[-1]))

    def __call__(self, t: ArrayLike) -> Floats:
        """State at one time or several."""
        times = self._times(t)
        y = self._core.states(times.reshape(-1), self._system.dim)
        return y[0] if times.ndim == 0 else y.T

    def mode(self, t: ArrayLike) -> np.int8 | Modes:
        """Mode at one time or several; at an event the mode before it."""
        times = self._times(t)
        return self._each_surface(times, self._core.modes(times.reshape(-1), self._surfaces))

    def s(self, t: ArrayLike) -> FloatOrArray:
        """Blend variable: the equivalent control in a slide, -1 or +1 off the surface."""
        times = self._times(t)
        return self._each_surface(times, self._core.blend(times.reshape(-1), self._surfaces))

    def __repr__(self) -> str:
        return f"<Solution on [{self.t_min:.9g}, {self.t_max:.9g}], {len(self.ts) - 1} steps>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Solution._of, (self._system, self._packed())

    def _packed(self) -> dict[str, np.ndarray[Any, Any]]:
        """Give it in arrays."""
        return self._core.pack()

    @staticmethod
    def _verify(system: System, packed: Mapping[str, np.ndarray[Any, Any]]) -> None:
        """Refuse arrays that are no solution's, as far as the core does not."""
        n, pieces, dim = packed["t"].size, packed["dt"].size, system.dim
        shapes = {
            "params": (len(system.params),),
            "scale": (dim,),
            "t": (n,),
            "x": (n, dim),
            "mode": (n, system.surfaces),
            "x0": (pieces, dim if pieces else 0),
            "polynomial": (pieces, *packed["polynomial"].shape[1:2], dim),
        }
        for name, array in packed.items():
            kind = {"mode": "i", "period": "i", "closed_form": "i"}.get(name, "f")
            require(array.dtype.kind == kind, f"sol.{name} is an array of {array.dtype}")
            shaped(shapes.get(name, (pieces,)), **{f"sol.{name}": array})
            finite(**{f"sol.{name}": array})
        ordered("sol.t", packed["t"])

    @classmethod
    def _of(cls, system: System, packed: dict[str, np.ndarray[Any, Any]]) -> Solution:
        """Make it again of its system and its arrays."""
        return cls(_core.Solution.unpack(system._model, packed), system)

    def _times(self, t: ArrayLike) -> Floats:
        times = floats("t", t, "expected a time or an array of times")
        if times.ndim > 1:
            refuse("t", times, f"expected a number or shape (k,), got shape {times.shape}")
        outside = ~((times >= self.t_min) & (times <= self.t_max))
        if outside.any():
            first = times[outside][0] if times.ndim else times[()]
            refuse("t", first, f"expected a time in [{self.t_min!r}, {self.t_max!r}]")
        return times

    def _each_surface(self, times: Floats, values: NDArray[_T]) -> _T | NDArray[_T]:
        each = values[:, 0] if self._surfaces == 1 else values.T
        return each[..., 0][()] if times.ndim == 0 else each
