# SPDX-License-Identifier: BSD-3-Clause
"""Three blocks on a belt, each tied to the wall and to its neighbours; `h_i = v_i - V`.

`x_i'' = -x_i - c (x_i - x_(i-1)) - c (x_i - x_(i+1)) - s_i F_i/(1 + gamma |v_i - V|)`,
`s_i = sign(h_i)`. After Galvanetto (2001), J. Sound Vib. 248, 653-669.
"""

from __future__ import annotations

from typing import Any

from filippov._system.built_in import built_in

from .belt_chain_2 import chain


@built_in(
    state="x1 v1 x2 v2 x3 v3",
    params={"V": 0.1, "c": 1.2, "gamma": 3.0, "F1": 1.0, "F2": 1.3, "F3": 1.0},
    surfaces={"h0": "v1 - V", "h1": "v2 - V", "h2": "v3 - V"},
)
def belt_chain_3(t: Any, s: Any, p: Any) -> Any:
    return chain(s, p)
