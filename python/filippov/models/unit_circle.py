# SPDX-License-Identifier: BSD-3-Clause
"""`x' = A1 x` inside the unit circle, `A2 x` outside; `h = x**2 + y**2 - 1`.

`A1 = [[1, w], [-w, 1]]`, `A2 = [[1, -w], [w, 1]]`. From (1/e, 0) the crossing is at t = 1
whatever w.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x y", params={"w": -2 * np.pi}, surfaces={"h": "x**2 + y**2 - 1"})
def unit_circle(t: Any, s: Any, p: Any) -> Any:
    turn = -p.w * np.sign(s.x**2 + s.y**2 - 1)
    return s.x + turn * s.y, -turn * s.x + s.y
