# SPDX-License-Identifier: BSD-3-Clause
"""A block on a belt in front of a wall.

`x'' = A cos(omega t) - x - F sign(x' - V)`, `x <= wall`, `v -> -e v` at the wall;
`h = (v - V, wall - x)`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(
    state="x v",
    params={"A": 0.6, "omega": 1.2, "F": 0.2, "V": 0.5, "wall": 1.0, "e": 0.8},
    surfaces={"h": "v - V"},
    period=lambda p: 2 * np.pi / p.omega,
    jumps={"wall": ("wall - x", lambda t, s, p: (s.x, -p.e * s.v))},
)
def impact_belt(t: Any, s: Any, p: Any) -> Any:
    return s.v, p.A * np.cos(p.omega * t) - s.x - p.F * np.sign(s.v - p.V)
