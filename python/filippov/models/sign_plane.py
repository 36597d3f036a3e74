# SPDX-License-Identifier: BSD-3-Clause
"""`x' = a sign(x) + b sign(y)`, `y' = c sign(x) + d sign(y)`; `h = (x, y)`.

Spirals into the origin in finite time, with the values it comes with: from (x0, y0) in
`(|x0| + |y0|)/2`, through infinitely many crossings. With (1, 2, -2, 1) it spirals away.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


@built_in(
    state="x y",
    params={"a": -1.0, "b": 2.0, "c": -2.0, "d": -1.0},
    surfaces={"x": "x", "y": "y"},
)
def sign_plane(t: Any, s: Any, p: Any) -> Any:
    x, y = np.sign(s)
    return p.a * x + p.b * y, p.c * x + p.d * y
