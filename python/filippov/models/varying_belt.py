# SPDX-License-Identifier: BSD-3-Clause
"""Friction on a belt whose speed varies, a surface that moves.

`x'' = -x - c x' + cos(omega t) - mu sign(x' - cos(t) - V)`; `h = v - cos(t) - V`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(
    state="x v",
    params={"c": 0.4, "omega": 0.7, "mu": 0.4, "V": 0.7},
    surfaces={"h": "v - cos(t) - V"},
)
def varying_belt(t: Any, s: Any, p: Any) -> Any:
    slip = np.sign(s.v - np.cos(t) - p.V)
    return s.v, -s.x - p.c * s.v + np.cos(p.omega * t) - p.mu * slip
