# SPDX-License-Identifier: BSD-3-Clause
"""Tangencies and equilibria: what is known of a system without a trajectory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from filippov import _core
from filippov._support.check import integer, number, one_of, refuse, word
from filippov._support.progress import ended
from filippov._support.sound import require
from filippov._support.types import Floats
from filippov._system.bounds import Bounds, box, interval
from filippov._system.system import System

__all__ = [
    "Equilibrium",
    "Tangency",
    "boundary_equilibria",
    "equilibria",
    "one_surface",
    "seeds_of",
    "tangencies",
    "tangencies_at",
    "tangency",
]

MOST_SEEDS = 1_000_000


@dataclass(frozen=True)
class Tangency:
    """A point where the field of one side is tangent to the surface: h = 0, L = 0, so s = -1 or +1.

    An end of the sliding region, or of an escaping one.
    """

    t: float  #: the time
    x: tuple[float, ...]  #: the state
    side: int  #: whose field is tangent: -1 (there s = -1) or +1 (s = +1)
    visible: bool  #: that side's solution touches the surface from its own side
    attracting: bool  #: the sliding beside it attracts
    second: float  #: h'' along that field
    other: float  #: L of the other side's field
    drift: float  #: derivative of |s| along the sliding field: > 0 where slides end

    def _verify(self) -> None:
        require(self.side in (-1, 1), f"side is {self.side}, expected -1 or +1")
        require(len(self.x) > 0, "x is empty")


@dataclass(frozen=True)
class Equilibrium:
    """A point where an autonomous system rests."""

    kind: str  #: "regular" (of F1 or F2), "pseudo" (of the sliding field), "boundary" (both)
    x: tuple[float, ...]  #: the state
    side: int  #: -1 or +1: of which field; 0 for a pseudo-equilibrium
    s: float  #: blend variable of a pseudo-equilibrium, else the side
    real: bool  #: on its own side, |s| < 1 for a pseudo-equilibrium; else it is virtual
    stable: bool  #: solutions nearby tend to it; False for a boundary equilibrium
    attracting: bool  #: of a pseudo-equilibrium: the sliding around it attracts
    #: of the Jacobian of its field; on the surface, so one less, for a pseudo-equilibrium
    eigenvalues: tuple[complex, ...]
    param: dict[str, float]  #: of a boundary equilibrium: the parameter's value, by name
    #: of a boundary equilibrium: "persistence" if it becomes a pseudo-equilibrium, so that one of
    #: the two is real on either side of the value; "nonsmooth-fold" if both are real on one side,
    #: where they meet and vanish; "degenerate" if neither can be said
    encounter: str


def tangencies(
    sys: System,
    t: float = 0.0,
    *,
    bounds: Bounds,
    side: int | None = None,
    params: Mapping[str, float] | None = None,
    seeds: int = 64,
) -> list[Tangency]:
    """Find where a side's field is tangent to the surface at one time.

    Newton's iteration from a grid of `seeds` points. In the plane tangencies are isolated; a system
    of higher dimension has curves or more of them, on which some points are found.

    Parameters
    ----------
    sys : System
        With one surface.
    t : float
        The time.
    bounds : mapping
        Range of each component: `{"y": (-6, 6), "v": (0, 2)}`.
    side : int, optional
        -1 or +1: tangencies of F1 or of F2 alone.
    params : mapping, optional
        Parameter values by name that replace `sys.params`.
    seeds : int
        About how many points the iteration starts from.

    Returns
    -------
    list of Tangency
        Those of F1 first.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    """
    one_surface(sys)
    time = number("t", t)
    sides = [-1, 1]
    if side is not None:
        sides = [one_of("side", side, sides, "expected -1 or +1, or None for both")]
    low, high = box(sys, bounds)
    values = sys._values(params)
    run = _core.tangencies(sys._model, sides, time, low, high, values, seeds_of(seeds))
    ended(run.raised)
    return [tangency(each) for each in run.found]


def equilibria(
    sys: System,
    *,
    bounds: Bounds,
    params: Mapping[str, float] | None = None,
    seeds: int = 64,
) -> list[Equilibrium]:
    """Find the equilibria of an autonomous system.

    Those of F1 and F2 on their own side (real) and beyond it (virtual), and pseudo-equilibria,
    where a blend of both fields vanishes on the surface: with |s| < 1 (real) and beyond.

    Parameters
    ----------
    sys : System
        With one surface, and neither forced nor otherwise dependent on time at these parameter
        values: the oscillator with A = 0 will do.
    bounds, params, seeds
        As in `tangencies`.

    Returns
    -------
    list of Equilibrium
        Those of F1, of F2, then pseudo-equilibria.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.
    """
    one_surface(sys)
    low, high = box(sys, bounds)
    values = sys._values(params)
    number_of_seeds = seeds_of(seeds)
    _autonomous(sys, low, high, values)
    run = _core.equilibria(sys._model, low, high, values, number_of_seeds)
    ended(run.raised)
    return [_equilibrium(each, {}) for each in run.found]


def boundary_equilibria(
    sys: System,
    parameter: str,
    span: Sequence[float] | Floats,
    *,
    bounds: Bounds,
    params: Mapping[str, float] | None = None,
    seeds: int = 64,
) -> list[Equilibrium]:
    """Find where an equilibrium of F1 or F2 reaches the surface as a parameter changes.

    Parameters
    ----------
    sys : System
        As in `equilibria`.
    parameter : str
        Name of the parameter.
    span : (float, float)
        Its range.
    bounds, params, seeds
        As in `tangencies`.

    Returns
    -------
    list of Equilibrium
        Of the kind "boundary", with `param` and `encounter`.

    Raises
    ------
    ValueError, TypeError
        For arguments that make no sense, before any work.

    References
    ----------
    di Bernardo, Nordmark & Olivar (2008), Physica D 237, 119-136.
    """
    one_surface(sys)
    names = list(sys.params)
    parameter = word("parameter", parameter, names, f"expected one of {', '.join(names) or 'none'}")
    start, end = interval("span", span)
    low, high = box(sys, bounds)
    values = sys._values(params)
    number_of_seeds = seeds_of(seeds)
    index = names.index(parameter)
    for value in (start, (start + end) / 2, end):
        values[index] = value
        _autonomous(sys, low, high, values)
    run = _core.boundary_equilibria(
        sys._model, low, high, values, index, start, end, number_of_seeds
    )
    ended(run.raised)
    return [_equilibrium(each, {parameter: each.value}) for each in run.found]


def tangencies_at(sys: System, t: float, x: Floats, params: Floats) -> tuple[Tangency, ...]:
    """Describe points where |s| = 1; x of shape (dim, k)."""
    points = np.ascontiguousarray(x.T)
    return tuple(
        tangency(each) for each in _core.describe_tangencies(sys._model, t, points, params)
    )


def tangency(found: _core.TangencyResult) -> Tangency:
    """Make a tangency of the core's one of ours."""
    return Tangency(
        t=found.t,
        x=tuple(found.x),
        side=found.side,
        visible=found.visible,
        attracting=found.attracting,
        second=found.second,
        other=found.other,
        drift=found.drift,
    )


def one_surface(sys: System) -> None:
    """Refuse everything but a system with one surface, at which the field jumps."""
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System with one surface", TypeError)
    if sys.kinds != ("switching",):
        refuse("sys", sys.name, f"expected a System with {one_switching(sys)}")


ONE_SWITCHING = "one surface, a switching one, and no kinks or jumps"


def one_switching(sys: System) -> str:
    """Tell that one switching surface is needed, and what there is."""
    kinds = {"switching": "switching surface", "kink": "kink", "jump": "jump"}
    kinds["direction"] = "direction"
    counts = [(sys.kinds.count(kind), word) for kind, word in kinds.items()]
    there = [f"{n} {word}{'s' if n != 1 else ''}" for n, word in counts if n > 0]
    return f"{ONE_SWITCHING}; it has {', '.join(there) or '0 surfaces'}"


def seeds_of(seeds: int) -> int:
    """Check the number of starts of Newton's iteration."""
    result = integer("seeds", seeds)
    if result > MOST_SEEDS:
        refuse("seeds", seeds, f"expected an integer from 1 to {MOST_SEEDS}")
    return result


def _equilibrium(found: _core.EquilibriumResult, param: dict[str, float]) -> Equilibrium:
    return Equilibrium(
        kind=found.kind,
        x=tuple(found.x),
        side=found.side,
        s=found.s,
        real=found.real,
        stable=found.stable,
        attracting=found.attracting,
        eigenvalues=tuple(found.eigenvalues),
        param=param,
        encounter=found.encounter,
    )


def _autonomous(sys: System, low: Floats, high: Floats, params: Floats) -> None:
    if _core.depends_on_time(sys._model, low, high, params):
        refuse("sys", sys.name, "expected an autonomous system; this one depends on time")
