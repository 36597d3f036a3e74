# SPDX-License-Identifier: BSD-3-Clause
"""Two genes that inhibit each other, and at a higher level themselves.

`a' = k [a < high] [b < low] - g a`, `b' = k [a < low] [b < high] - g b`;
`h = (a - low, b - low, a - high, b - high)`. Either gene can win; the point (low, low) between
them is a saddle at which solutions are not unique.
After Casey, de Jong & Gouze (2006), J. Math. Biol. 52, 27-56.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(
    state="a b",
    params={"k": 20.0, "g": 2.0, "low": 4.0, "high": 8.0},
    surfaces={"a": "a - low", "b": "b - low", "A": "a - high", "B": "b - high"},
)
def gene_switch(t: Any, s: Any, p: Any) -> Any:
    def below(level: Any, gene: Any) -> Any:
        return np.where(gene < level, 1, 0)

    return (
        p.k * below(p.high, s.a) * below(p.low, s.b) - p.g * s.a,
        p.k * below(p.low, s.a) * below(p.high, s.b) - p.g * s.b,
    )
