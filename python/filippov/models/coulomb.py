# SPDX-License-Identifier: BSD-3-Clause
"""Friction on resting ground: `x'' + x = a sin(omega t) - mu sign(x')`; `h = v`."""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x v", params={"mu": 0.4, "a": 0.0, "omega": 0.5}, surfaces={"h": "v"})
def coulomb(t: Any, s: Any, p: Any) -> Any:
    return s.v, -s.x + p.a * np.sin(p.omega * t) - p.mu * np.sign(s.v)
