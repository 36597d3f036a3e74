# SPDX-License-Identifier: BSD-3-Clause
"""Third-order relay feedback, `x' = A x + B u`, `u = -sign(x1)`; `h = x1`.

`A = [[-(2 zeta omega + lambda), 1, 0], [-(2 zeta omega lambda + omega**2), 0, 1],
[-lambda omega**2, 0, 0]]`, `B = (b1, b2, b3)`. By default a limit cycle with several slides.
di Bernardo, Johansson, Vasca (2001), Int. J. Bifurcation and Chaos 11, 1121-1140.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(
    state="x1 x2 x3",
    params={"zeta": 0.05, "omega": 25.0, "lambda": 1.0, "b1": 1.0, "b2": -2.0, "b3": 1.0},
    surfaces={"h": "x1"},
)
def relay(t: Any, s: Any, p: Any) -> Any:
    damping, decay = 2 * p["zeta"] * p["omega"], p["lambda"]
    u = -np.sign(s.x1)
    return (
        -(damping + decay) * s.x1 + s.x2 + p.b1 * u,
        -(damping * decay + p.omega**2) * s.x1 + s.x3 + p.b2 * u,
        -(p.omega**2) * decay * s.x1 + p.b3 * u,
    )
