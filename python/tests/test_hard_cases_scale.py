# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases of scale: H20, H26, H34.

Systems are typed as a user would type them.

Not from Python: float and long double of H34, since Python's numbers are double.
"""

import math

import numpy as np
import pytest

import filippov as fp
from hard import assert_failed, close, each_method, go, sides, word

# --- H20 ------------------------------------------------------------------------------------------


def friction(switch, sign=1):
    low, high = (lambda t, s, p: (s.v, -s.x + 0.4 * sign), lambda t, s, p: (s.v, -s.x - 0.4 * sign))
    return sides(low, high, switch, "x v")


@each_method
@pytest.mark.parametrize("c", [1e-9, 1.0, 1e9])
def test_h20_h_in_other_units_and_with_a_gradient_of_any_length(method, c):
    scaled = friction(lambda t, s, p: c * (s.v + s.x**2 / 4 * s.v))
    run = go(scaled, [3, 0], (0, 20), 1e-10, method)
    assert word(run) == "cross cross cross enter_sliding"
    # half swings about -0.4 and 0.4 by turns; some hundred steps at 1e-10
    assert run.events["t"][1:5] == close(math.pi * np.arange(1, 5), 1e-8)
    assert run.y[:, -1] == close([-0.2, 0], 1e-8)


@pytest.mark.parametrize("switch", ["v*(1 + x**2)", "v*exp(x)", "v/(1 + x**2)", "v + x**2*v"])
def test_h20_a_switching_function_may_be_a_product(switch):
    run = go(friction(switch), [3, 0], (0, 20))
    assert run.events["t"][1:5] == close(math.pi * np.arange(1, 5), 1e-7)


# --- H26 ------------------------------------------------------------------------------------------


def belt(unit_x=1.0, unit_v=1.0, unit_t=1.0):
    """P3, a block on a belt of varying speed, in units of its state and time."""

    @fp.system(state="x v")
    def block(t, s):
        x, v, t = unit_x * s.x, unit_v * s.v, unit_t * t
        push = -x - 0.4 * v + np.cos(0.7 * t) - 0.4 * np.sign(v - np.cos(t) - 0.7)
        return v * (unit_t / unit_x), push * (unit_t / unit_v)

    return block


#: Events of P3 from (3, 0) until t = 30, by a program of high accuracy.
BELT_EVENTS = [
    7.6055699647,
    9.4833785789,
    9.7652587545,
    14.8051056891,
    17.4589396439,
    26.1316818246,
    27.2911568935,
]


@each_method
@pytest.mark.parametrize(
    "units", [(1e9, 1e-9, 1), (1e-9, 1e9, 1), (1, 1, 1e-6), (1e9, 1e9, 1e-6), (1, 1, 1e-12)]
)
def test_h26_other_units_of_state_and_time_give_the_same_events(method, units):
    x, v, t = units
    run = go(belt(*units), [3 / x, 0], (0, 30 / t), 1e-10, method, atol=[1e-10 / x, 1e-10 / v])
    assert run.success
    # some hundred steps, each with an error of 1e-10
    assert run.events["t"][1:-1] * t == close(BELT_EVENTS, 1e-8)


@pytest.mark.parametrize("unit", [1e9, 1e12])
def test_h26_a_fast_time_can_be_defined(unit):
    run = go(belt(1, 1, unit), [3, 0], (0, 30 / unit), 1e-10)
    assert run.events["t"][1:-1] * unit == close(BELT_EVENTS, 1e-8)


# --- H34 ------------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("tol", [1e-13, 1e-14, 1e-15, 1e-16])
def test_h34_tolerances_at_the_floor_end_in_a_result(method, tol):
    run = go(belt(), [3, 0], (0, 30), tol, method)
    if tol < 1e-14 and not run.success:
        assert_failed(run, "step_too_small", "tolerance is below rounding")
        return
    assert run.success
    assert run.events["t"][1:-1] == close(BELT_EVENTS, 1e-10)  # their last digit
