# SPDX-License-Identifier: BSD-3-Clause
"""Ready systems, compiled.

`oscillator`
    Block on a belt, spring to a wall, forced (chapter, (4.3), (4.5)):
    `m y'' + k y = A cos(omega t) + m g mu(V - y') sign(V - y')` with
    `mu(r) = alpha/(1 + gamma r) + beta + eta r**2`; `h = v - V`.
`coulomb`
    `x'' + x = a sin(omega t) - mu sign(x')`; `h = v`.
`stiction`
    The belt with constant kinetic friction and a static one above it (law (4.4)). Such a law is
    not a Filippov system: while the block sticks the friction may exceed what either side gives.
    This is the named model of it: stick lasts while `|s| <= mu_s/mu_0`, slip has `mu_0`.
`varying_belt`
    `x'' = -x - c x' + cos(omega t) - mu sign(x' - cos(t) - V)`; `h = v - cos(t) - V`.
`dieci_lopez`
    Stick-slip of Dieci and Lopez; `h = x2 - v`.
`dieci_lopez_2`
    The same with two surfaces, `h = (x2 - 0.2, x3 - 0.4)`.
`relay`
    Third-order relay feedback, `u = -sign(x1)`; `h = x1`.
`stiff_relay`
    `x' = -lambda (x - cos(t)) sign(x)`; `h = x`.
`unit_circle`
    `x' = A1 x` inside the unit circle, `A2 x` outside; `h = x**2 + y**2 - 1`.
`quartet`
    `x' = c + d t - b sign(x)`; `h = x`. Crossing, sliding, leaving, or not unique, by parameters.
"""

from __future__ import annotations

from . import _core
from ._system import System

__all__ = [
    "coulomb",
    "dieci_lopez",
    "dieci_lopez_2",
    "oscillator",
    "quartet",
    "relay",
    "stiction",
    "stiff_relay",
    "unit_circle",
    "varying_belt",
]

_compiled = {model.name: model for model in _core.models()}

oscillator = System(_compiled["oscillator"], switches=["v - V"])
coulomb = System(_compiled["coulomb"], switches=["v"])
stiction = System(_compiled["stiction"], switches=["v - V"])
varying_belt = System(_compiled["varying_belt"], switches=["v - cos(t) - V"])
dieci_lopez = System(_compiled["dieci_lopez"], switches=["x2 - v"])
dieci_lopez_2 = System(_compiled["dieci_lopez_2"], switches=["x2 - 0.2", "x3 - 0.4"])
relay = System(_compiled["relay"], switches=["x1"])
stiff_relay = System(_compiled["stiff_relay"], switches=["x"])
unit_circle = System(_compiled["unit_circle"], switches=["x**2 + y**2 - 1"])
quartet = System(_compiled["quartet"], switches=["x"])
