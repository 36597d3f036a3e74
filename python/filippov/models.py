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
    The same with two surfaces, `h = (x2 - 0.2, x3 - 0.4)`; the fields around their intersection
    are blended multilinearly. `dieci_lopez_2_moments`: by the moments of Dieci and Difonzo.
`two_blocks`
    Two blocks on rough ground joined by a spring, friction that depends on where they are:
    `x1'' = x2 - x1 - F1(x1) sign(x1')`, `x2'' = x1 - x2 - F2(x2) sign(x2')`;
    `h = (v1, v2, x1, x2)`.
`belt_chain_2`, `belt_chain_3`
    Two and three blocks on a belt, each tied to the wall and to its neighbours:
    `x_i'' = -x_i - c (x_i - x_(i-1)) - c (x_i - x_(i+1)) - s_i F_i/(1 + gamma |v_i - V|)`,
    `s_i = sign(h_i)`, `h_i = v_i - V`.
`sign_plane`
    `x' = a sign(x) + b sign(y)`, `y' = c sign(x) + d sign(y)`; `h = (x, y)`. Spirals into the
    origin in finite time, with the values it comes with.
`planar_relay`
    `x1' = -x1 + x2`, `x2' = 3 x2 - k sign(x1 + x2)`; `h = x1 + x2`.
`gene_switch`
    Two genes that inhibit each other, and at a higher level themselves:
    `a' = k [a < high] [b < low] - g a`, `b' = k [a < low] [b < high] - g b`;
    `h = (a - low, b - low, a - high, b - high)`.
`bouncing_ball`
    `x'' = -g`, `v -> -e v` on the floor `h = x`.
`thermostat`
    `y' = -rate (y - outside) + q power`; the switch `q` goes off at `high` and on at `low`:
    `h = q (high - y) + (1 - q) (y - low)`.
`impact_belt`
    A block on a belt in front of a wall: `x'' = A cos(omega t) - x - F sign(x' - V)`, `x <= wall`,
    `v -> -e v` at the wall; `h = (v - V, wall - x)`.
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
from ._system.system import System

__all__ = [
    "belt_chain_2",
    "belt_chain_3",
    "bouncing_ball",
    "coulomb",
    "dieci_lopez",
    "dieci_lopez_2",
    "dieci_lopez_2_moments",
    "gene_switch",
    "impact_belt",
    "oscillator",
    "planar_relay",
    "quartet",
    "relay",
    "sign_plane",
    "stiction",
    "stiff_relay",
    "thermostat",
    "two_blocks",
    "unit_circle",
    "varying_belt",
]

_compiled = {model.name: model for model in _core.models()}

oscillator = System._of(_compiled["oscillator"], ["v - V"])
coulomb = System._of(_compiled["coulomb"], ["v"])
stiction = System._of(_compiled["stiction"], ["v - V"])
varying_belt = System._of(_compiled["varying_belt"], ["v - cos(t) - V"])
dieci_lopez = System._of(_compiled["dieci_lopez"], ["x2 - v"])
dieci_lopez_2 = System._of(_compiled["dieci_lopez_2"], ["x2 - 0.2", "x3 - 0.4"])
dieci_lopez_2_moments = System._of(_compiled["dieci_lopez_2_moments"], ["x2 - 0.2", "x3 - 0.4"])
two_blocks = System._of(_compiled["two_blocks"], ["v1", "v2", "x1", "x2"])
belt_chain_2 = System._of(_compiled["belt_chain_2"], ["v1 - V", "v2 - V"])
belt_chain_3 = System._of(_compiled["belt_chain_3"], ["v1 - V", "v2 - V", "v3 - V"])
sign_plane = System._of(_compiled["sign_plane"], ["x", "y"])
planar_relay = System._of(_compiled["planar_relay"], ["x1 + x2"])
gene_switch = System._of(_compiled["gene_switch"], ["a - low", "b - low", "a - high", "b - high"])
bouncing_ball = System._of(_compiled["bouncing_ball"], ["x"])
thermostat = System._of(_compiled["thermostat"], ["q*(high - y) + (1 - q)*(y - low)"])
impact_belt = System._of(_compiled["impact_belt"], ["v - V", "wall - x"])
relay = System._of(_compiled["relay"], ["x1"])
stiff_relay = System._of(_compiled["stiff_relay"], ["x"])
unit_circle = System._of(_compiled["unit_circle"], ["x**2 + y**2 - 1"])
quartet = System._of(_compiled["quartet"], ["x"])
