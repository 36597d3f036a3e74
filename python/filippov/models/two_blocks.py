# SPDX-License-Identifier: BSD-3-Clause
"""Two blocks on rough ground joined by a spring, friction that depends on where they are.

`x1'' = x2 - x1 - F1(x1) sign(x1')`, `x2'' = x1 - x2 - F2(x2) sign(x2')`; `h = (v1, v2, x1, x2)`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(
    state="x1 v1 x2 v2",
    params={"F1_right": 1.0, "F1_left": 0.6, "F2_right": 0.2, "F2_left": 0.5},
    surfaces={"v1": "v1", "v2": "v2", "x1": "x1", "x2": "x2"},
)
def two_blocks(t: Any, s: Any, p: Any) -> Any:
    pull = s.x2 - s.x1
    F1 = np.where(s.x1 > 0, p.F1_right, p.F1_left)
    F2 = np.where(s.x2 > 0, p.F2_right, p.F2_left)
    return s.v1, pull - F1 * np.sign(s.v1), s.v2, -pull - F2 * np.sign(s.v2)
