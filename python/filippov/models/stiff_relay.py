# SPDX-License-Identifier: BSD-3-Clause
"""`x' = -lambda (x - cos(t)) sign(x)`; `h = x`: stiff off its surface.

From x(0) = 1 it follows cos(t), meets the surface at `pi - arctan(lambda)`, up to the initial
layer, and slides at 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x", params={"lambda": 1000.0}, surfaces={"h": "x"})
def stiff_relay(t: Any, s: Any, p: Any) -> Any:
    return -p["lambda"] * (s.x - np.cos(t)) * np.sign(s.x)
