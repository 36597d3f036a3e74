# SPDX-License-Identifier: BSD-3-Clause
"""Stick-slip with two surfaces, `h = (x2 - 0.2, x3 - 0.4)`.

`x1' = (x2 + x3)/2`, plus `x1 (x2 + 0.8)(x3 + 0.6)` where both are passed; `x2'` and `x3'` as in
`dieci_lopez`. The fields around the intersection are blended multilinearly.
Dieci & Lopez (2011), J. Comput. Appl. Math. 235, 3480-3500.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x1 x2 x3", surfaces={"h0": "x2 - 0.2", "h1": "x3 - 0.4"})
def dieci_lopez_2(t: Any, s: Any) -> Any:
    above2, above3 = s.x2 > 0.2, s.x3 > 0.4
    extra = np.where(above2, np.where(above3, s.x1 * (s.x2 + 0.8) * (s.x3 + 0.6), 0), 0)
    return (
        (s.x2 + s.x3) / 2 + extra,
        -s.x1 + np.where(above2, -1 / (0.8 + s.x2), 1 / (1.2 - s.x2)),
        -s.x1 + np.where(above3, -1 / (0.6 + s.x3), 1 / (1.4 - s.x3)),
    )
