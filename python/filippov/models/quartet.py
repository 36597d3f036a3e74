# SPDX-License-Identifier: BSD-3-Clause
"""`x' = c + d t - b sign(x)`; `h = x`: one problem for each thing that can happen at a surface.

With `(b, c, d) = (1, 2, 0)` from -1 it crosses at t = 1/3; with (1, 0, 0) it slides; with
(1, 0, 1) from 0 it leaves at t = 1, x(2) = 0.5; with (-1, 0, 0) from 0 it is not unique.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(state="x", params={"b": 1.0, "c": 0.0, "d": 0.0}, surfaces={"h": "x"})
def quartet(t: Any, s: Any, p: Any) -> Any:
    return p.c + p.d * t - p.b * np.sign(s.x)
