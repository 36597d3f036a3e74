# SPDX-License-Identifier: BSD-3-Clause
"""`x'' = -g`, `v -> -e v` on the floor `h = x`.

From (x0, 0) it hits the floor at `t1 = sqrt(2 x0/g)`, and with e < 1 comes to rest at
`t1 (1 + 2 e/(1 - e))`, after infinitely many bounces.
"""

from __future__ import annotations

from typing import Any

from filippov._system.built_in import built_in


@built_in(
    state="x v",
    params={"g": 9.8, "e": 0.9},
    jumps={"floor": ("x", lambda t, s, p: (s.x, -p.e * s.v))},
)
def bouncing_ball(t: Any, s: Any, p: Any) -> Any:
    return s.v, -p.g
