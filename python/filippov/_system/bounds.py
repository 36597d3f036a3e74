# SPDX-License-Identifier: BSD-3-Clause
"""Rectangles of states."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from filippov._support.check import UNORDERED, number, refuse, two
from filippov._support.types import Floats

from .system import System

__all__ = ["Bounds", "box", "interval", "pair", "ranges"]

Bounds = Mapping[str, Sequence[float] | Floats]


def ranges(sys: System, bounds: Bounds, most: int = 2) -> list[tuple[float, ...]]:
    """Low and high of each component in the order of the state, and what follows, up to `most`."""
    expected = " and ".join(f"{name!r}: (low, high)" for name in sys.state)
    if not isinstance(bounds, Mapping):
        refuse("bounds", bounds, f"expected a mapping with {expected}", TypeError)
    if set(bounds) != set(sys.state):
        refuse("bounds", bounds, f"expected a mapping with {expected}")
    return [interval(f"bounds[{name!r}]", bounds[name], most) for name in sys.state]


def interval(name: str, given: object, most: int = 2) -> tuple[float, ...]:
    """Low and high of any sequence of two numbers, and what follows, up to `most`."""
    try:
        if isinstance(given, UNORDERED):
            raise TypeError
        span: tuple[Any, ...] = tuple(given)  # type: ignore[arg-type]
    except TypeError:
        refuse(name, given, "expected (low, high)", TypeError)
    if not 2 <= len(span) <= most:
        cells = " or (low, high, cells)" if most > 2 else ""
        refuse(name, span, f"expected (low, high){cells}")
    low, high = (number(name, value) for value in span[:2])
    if not 0 < high - low < math.inf:
        refuse(name, span, "expected low < high, no more than the largest number apart")
    return low, high, *span[2:]


def pair(name: str, given: Any, expected: str) -> tuple[float, float]:  # noqa: ANN401 - checked here
    """Low and high of the range of a parameter."""
    low, high = two(name, given, expected)
    low, high = number(f"{name}[0]", low, expected), number(f"{name}[1]", high, expected)
    if not 0 < high - low < math.inf:
        refuse(name, (low, high), expected)
    return low, high


def box(sys: System, bounds: Bounds) -> tuple[Floats, Floats]:
    """Lower and upper corner."""
    low, high = np.array(ranges(sys, bounds), dtype=np.float64).T
    return np.ascontiguousarray(low), np.ascontiguousarray(high)
