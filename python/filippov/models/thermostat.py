# SPDX-License-Identifier: BSD-3-Clause
"""A room with a heater that goes on below `low` and off above `high`.

`y' = -rate (y - outside) + q power`; `h = q (high - y) + (1 - q) (y - low)`. Components that only
jumps change are the discrete state.
"""

from __future__ import annotations

from typing import Any

from filippov._system.built_in import built_in


@built_in(
    state="y q",
    params={"rate": 0.1, "outside": 18.0, "power": 2.0, "low": 22.0, "high": 23.5},
    jumps={"switch": ("q*(high - y) + (1 - q)*(y - low)", lambda t, s, p: (s.y, 1 - s.q))},
)
def thermostat(t: Any, s: Any, p: Any) -> Any:
    return -p.rate * (s.y - p.outside) + s.q * p.power, 0
