# SPDX-License-Identifier: BSD-3-Clause
"""Block on a belt, spring to a wall, forced; compiled.

`m y'' + k y = A cos(omega t) + m g mu(V - y') sign(V - y')` with
`mu(r) = alpha/(1 + gamma r) + beta + eta r**2`; `h = v - V`.
Chapter, (4.3), (4.5). The formula has the true magnitude of the friction, as smoothing and time
stepping need it; each side of the compiled model extends beyond `h = 0`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import compiled


def _formula(t: Any, s: Any, p: Any) -> Any:
    r = abs(s.v - p.V)
    mu = p.alpha / (1 + p.gamma * r) + p.beta + p.eta * r**2
    pull = p.A * np.cos(p.omega * t) - p.k * s.y
    return s.v, pull / p.m - p.g * mu * np.sign(s.v - p.V)


oscillator = compiled("oscillator", ["v - V"], _formula, period=lambda p: 2 * np.pi / p.omega)
