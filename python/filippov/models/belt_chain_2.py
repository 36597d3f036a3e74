# SPDX-License-Identifier: BSD-3-Clause
"""Two blocks on a belt, each tied to the wall and to its neighbours; `h_i = v_i - V`.

`x_i'' = -x_i - c (x_i - x_(i-1)) - c (x_i - x_(i+1)) - s_i F_i/(1 + gamma |v_i - V|)`,
`s_i = sign(h_i)`. After Galvanetto (2001), J. Sound Vib. 248, 653-669.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from filippov._system.built_in import built_in


def chain(s: Any, p: Any) -> Any:
    """Give the derivatives of a chain of any length."""
    blocks = len(s) // 2
    derivatives: list[Any] = []
    for i in range(blocks):
        x, v = s[2 * i], s[2 * i + 1]
        pull = -x
        if i > 0:
            pull = pull - p.c * (x - s[2 * i - 2])
        if i + 1 < blocks:
            pull = pull - p.c * (x - s[2 * i + 2])
        slip = v - p.V
        friction = np.sign(slip) * p[f"F{i + 1}"] / (1 + p.gamma * abs(slip))
        derivatives += [v, pull - friction]
    return derivatives


@built_in(
    state="x1 v1 x2 v2",
    params={"V": 0.1, "c": 1.2, "gamma": 3.0, "F1": 1.0, "F2": 1.3},
    surfaces={"h0": "v1 - V", "h1": "v2 - V"},
)
def belt_chain_2(t: Any, s: Any, p: Any) -> Any:
    return chain(s, p)
