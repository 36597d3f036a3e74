# SPDX-License-Identifier: BSD-3-Clause
"""Rectangles of states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ._check import number, refuse
from ._system import System
from ._types import Floats

__all__ = ["Bounds", "box", "ranges"]

Bounds = Mapping[str, tuple[float, ...]]


def ranges(sys: System, bounds: Bounds, most: int = 2) -> list[tuple[float, ...]]:
    """Low and high of each component in the order of the state, and what follows, up to `most`."""
    expected = " and ".join(f"{name!r}: (low, high)" for name in sys.state)
    if not isinstance(bounds, Mapping):
        refuse("bounds", bounds, f"expected a mapping with {expected}", TypeError)
    if set(bounds) != set(sys.state):
        refuse("bounds", bounds, f"expected a mapping with {expected}")
    spans = []
    for name in sys.state:
        label = f"bounds[{name!r}]"
        try:
            span = tuple(bounds[name])
        except TypeError:
            refuse(label, bounds[name], "expected (low, high)", TypeError)
        if not 2 <= len(span) <= most:
            cells = " or (low, high, cells)" if most > 2 else ""
            refuse(label, span, f"expected (low, high){cells}")
        low, high = (number(label, value) for value in span[:2])
        if not low < high:
            refuse(label, span, "expected low < high")
        spans.append((low, high, *span[2:]))
    return spans


def box(sys: System, bounds: Bounds) -> tuple[Floats, Floats]:
    """Lower and upper corner."""
    low, high = np.array(ranges(sys, bounds), dtype=np.float64).T
    return np.ascontiguousarray(low), np.ascontiguousarray(high)
