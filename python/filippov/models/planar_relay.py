# SPDX-License-Identifier: BSD-3-Clause
"""An unstable plant under a relay.

`x1' = -x1 + x2`, `x2' = 3 x2 - k sign(x1 + x2)`; `h = x1 + x2`. Where `|x2| >= k/3` the relay
cannot hold `x2`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x1 x2", params={"k": 10.0}, surfaces={"h": "x1 + x2"})
def planar_relay(t: Any, s: Any, p: Any) -> Any:
    return -s.x1 + s.x2, 3 * s.x2 - p.k * np.sign(s.x1 + s.x2)
