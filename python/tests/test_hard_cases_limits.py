# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases of size and number: H27, H33, H39.

Systems are typed as a user would type them.

Elsewhere: H41 in test_bad_input.py and test_wrong_calls.py. Not from Python: the fifty components
of H39, since a definition has at most 32, and H27's million of periods, which take too long here:
there are ten thousand (tests/engine/test_hard_cases_limits.cpp has both).
"""

import math

import numpy as np
import pytest

import filippov as fp
from hard import EPS, EXPLICIT, close, each_method, go, line, sides, times, word

# --- H27 ------------------------------------------------------------------------------------------


@each_method
def test_h27_ten_thousand_periods_repeat_to_the_digit(method):
    block = fp.models.oscillator
    end = 10_000 * block.period()
    run = go(block, [0, 0], (0, end), 1e-9, method, max_steps=10**7, max_events=10**5, t_eval=[])
    assert run.success
    met = run.events[1:-1]
    assert (met["x_right"][:, 1] == 1).all()  # v = V on every contact
    exits = met[(met["kind"] == "exit_sliding") & (met["period"] >= 1000)]
    assert exits.size == 2250
    assert (np.diff(exits["period"]) == 4).all()
    # every fourth period alike: time is kept within a period, where an ulp is 4e-16
    assert np.ptp(exits["t_local"]) < 1e-13
    assert np.ptp(exits["x_right"][:, 0]) < 1e-13


@each_method
def test_h27_without_a_period_the_error_grows_no_faster_than_linearly(method):
    @fp.system(state="x")
    def swing(t, s):  # sin t while x < 0.5, and twice the amplitude above
        return np.cos(t) * (1.5 + 0.5 * np.sign(s.x - 0.5))

    run = go(swing, [0], (0, 1000 * math.pi), 1e-10, method, max_steps=10**6, dense_output=False)
    turn = np.arange(500)[:, None] * 2 * math.pi
    exact = (turn + np.array([math.pi / 6, 5 * math.pi / 6])).ravel()
    late = np.array(times(run, "cross")) - exact
    # some ten steps an event, each with an error of 1e-10
    assert np.abs(late / np.arange(1, 1001)).max() < 1e-9


# --- H33 ------------------------------------------------------------------------------------------


def stiff(level, rate=1000.0):
    """Follows cos t; its path meets 0 at pi - arctan(rate)."""

    def below(t, s, p):
        return -rate * (s.x - np.cos(t))

    # the sides differ by less than any tolerance, for otherwise there were no surface
    return sides(below, lambda t, s, p: below(t, s, p) + 1e-9, lambda t, s, p: s.x - level, "x")


@each_method
def test_h33_a_surface_does_not_limit_the_steps_of_a_stiff_field(method):
    def steps(level):
        run = go(stiff(level), [1], (0, 3), 1e-6, method)
        assert run.success
        assert times(run, "cross") == close([math.pi - math.atan(1000)] * (level == 0), 1e-5)
        return run.stats.steps + run.stats.rejected

    far = steps(-10)
    assert far < (2000 if method in EXPLICIT else 40)  # a thousandth each, by their stability
    assert steps(0) < 1.05 * far + 10  # some steps for the landing
    assert steps(-1 - 1e-9) < 1.05 * far + 10


@each_method
def test_h33_a_stiff_slide_takes_the_steps_of_its_flow_alone(method):
    def pushed(push):
        return lambda t, s, p: (-1000 * (s.x - np.cos(t)), push)

    held = go(sides(pushed(1.0), pushed(-1.0), "y"), [1, 0], (0, 3), 1e-6, method)
    free = go(sides(pushed(0.0), pushed(1.0), "y - 10"), [1, 0], (0, 3), 1e-6, method)
    assert (held.mode == 0).all()
    assert held.stats.steps < 1.05 * free.stats.steps + 10
    assert held.y[0, -1] == close(free.y[0, -1], 1e-5)  # ten tolerances


@each_method
@pytest.mark.parametrize("rate", [1e3, 1e5])
def test_h33_a_slide_is_not_stiff_where_only_the_sides_are(method, rate):
    @fp.system(state="x", params={"rate": rate})
    def relay(t, s, p):
        return -p.rate * (s.x - np.cos(t)) * np.sign(s.x)

    hit = go(relay, [1], (0, 1.6), 1e-6, method)
    run = go(relay, [1], (0, 4), 1e-6, method)
    assert run.success
    assert word(run) == "enter_sliding"
    assert run.events["t"][1] == close(math.pi - math.atan(rate), 1e-5)  # ten tolerances
    assert run.y[0, -1] == 0
    assert run.stats.steps - hit.stats.steps < 50


# --- H39 ------------------------------------------------------------------------------------------


@each_method
def test_h39_with_no_surface_reached_it_is_an_ordinary_equation(method):
    decay = sides(lambda t, s, p: 1.0, lambda t, s, p: -s.x, "x + 1", "x")
    run = go(decay, [1], (0, 5), 1e-10, method)
    assert run.success
    assert word(run) == ""
    assert run.stats.landings == 0
    assert run.y[0, -1] == close(math.exp(-5), 1e-9)  # ten tolerances


@each_method
@pytest.mark.parametrize("t", [0.0, 1.0, -7.5, 1e300])
def test_h39_no_time_at_all(method, t):
    for start in (2.0, 3.0):  # beside and on the surface
        run = go(line("x - 3"), [start], (t, t), 1e-9, method)
        assert run.success
        assert word(run) == ""
        assert (run.t.tolist(), run.y.tolist(), run.stats.steps) == ([t], [[start]], 0)


#: Start, length, x at the start.
SPANS = [
    (0, 1e-300, 0),
    (1, EPS, 0),
    (1e9, 1e-7, 0),
    (1e9, 1, 0),
    (1e15, 4, 0),
    (0, 1e12, 0),
    (0, 1e300, 0),
    (-1e15, 2e15, 0),
    (0, 1e-10, 0.5 - 5e-11),
]


@each_method
@pytest.mark.parametrize(("t0", "length", "start"), SPANS)
def test_h39_spans_of_an_ulp_and_of_any_length(method, t0, length, start):
    run = go(line("x - 0.5"), [start], (t0, t0 + length), 1e-9, method)
    assert run.success
    assert run.t[-1] == t0 + length
    length = t0 + length - t0  # as it is in floating point
    crosses = start + length > 0.5
    assert word(run) == ("cross" if crosses else "")
    end = 0.5 + 2 * (length - (0.5 - start)) if crosses else start + length
    assert run.y[0, -1] == pytest.approx(end, rel=1e-13, abs=0)  # some steps, an ulp each


@each_method
def test_h39_a_span_of_the_smallest_number(method):
    run = go(line("x - 0.5"), [0], (0, 5e-324), 1e-9, method)
    assert run.success
    assert run.t[-1] == 5e-324


@each_method
def test_h39_as_many_components_as_there_may_be(method):
    rates = 0.1 * np.arange(1, 33)

    @fp.system(state=[f"x{k}" for k in range(32)])
    def decay(t, s):  # the first one twice as fast once the last one is below a half
        faster = np.where(s.x31 < 0.5, 2.0, 1.0)
        return tuple(
            -rate * x * (faster if k == 0 else 1)
            for k, (rate, x) in enumerate(zip(rates, s, strict=True))
        )

    run = go(decay, np.ones(32), (0, 2), 1e-10, method)
    assert run.success
    half = math.log(2) / 3.2
    assert times(run, "cross") == close([half], 1e-9)  # ten tolerances
    assert run.y[1:, -1] == close(np.exp(-2 * rates[1:]), 1e-9)
    assert run.y[0, -1] == close(math.exp(-0.1 * half - 0.2 * (2 - half)), 1e-9)


def test_h39_too_many_components_are_refused():
    with pytest.raises(ValueError, match="expected 1 to 32 names"):
        fp.system(state=[f"x{k}" for k in range(50)])(lambda t, s: tuple(-x for x in s))
