# SPDX-License-Identifier: BSD-3-Clause
"""Stick-slip, `x1' = x2`, `x2' = -x1 - sign(x2 - v)/(1 + |x2 - v|)`; `h = x2 - v`.

Dieci & Lopez (2009), SIAM J. Numer. Anal. 47, 2023-2051.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x1 x2", params={"v": 0.2}, surfaces={"h": "x2 - v"})
def dieci_lopez(t: Any, s: Any, p: Any) -> Any:
    return s.x2, -s.x1 - np.sign(s.x2 - p.v) / (1 + abs(s.x2 - p.v))
