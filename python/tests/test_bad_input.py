# SPDX-License-Identifier: BSD-3-Clause
"""H41: a mistake is an error that names argument, value and what was expected, before any work."""

import re

import numpy as np
import pytest

import filippov as fp

GOOD = {"sys": fp.models.oscillator, "x0": [0, 0], "t_span": (0, 1)}


def two_needed(t):
    return t


class BadTerminal:
    terminal = -1

    def __call__(self, t, y):
        return t


class BadDirection:
    direction = "up"

    def __call__(self, t, y):
        return t


ALL = "on_nonunique = 'any': expected one of 'stop', 'below', 'above', 'stay', 'all'"

MISTAKES = [
    ({"sys": "oscillator"}, TypeError, "sys = 'oscillator': expected a System"),
    ({"x0": [0]}, ValueError, "x0 = [0]: expected 2 finite numbers (y, v), got shape (1,)"),
    ({"x0": 0.0}, ValueError, "x0 = 0.0: expected 2 finite numbers (y, v), got shape ()"),
    ({"x0": [[0, 0]]}, ValueError, "got shape (1, 2)"),
    ({"x0": [0, np.nan]}, ValueError, "x0 = [0, nan]: expected 2 finite numbers"),
    ({"x0": [0, np.inf]}, ValueError, "x0 = [0, inf]: expected 2 finite numbers"),
    ({"x0": "ab"}, TypeError, "x0 = 'ab': expected 2 finite numbers"),
    ({"x0": [1j, 0]}, TypeError, "x0 = [1j, 0]: expected 2 finite numbers"),
    ({"x0": None}, TypeError, "x0 = None: expected 2 finite numbers"),
    ({"t_span": (0, np.nan)}, ValueError, "t_span[1] = nan: expected two finite numbers"),
    ({"t_span": (-np.inf, 0)}, ValueError, "t_span[0] = -inf: expected two finite numbers"),
    ({"t_span": 5}, ValueError, "t_span = 5: expected two finite numbers, start and end"),
    ({"t_span": (0, 1, 2)}, ValueError, "t_span = (0, 1, 2): expected two finite numbers"),
    ({"t_span": ("a", 1)}, TypeError, "t_span[0] = 'a': expected two finite numbers"),
    ({"params": {"B": 1}}, ValueError, "no parameter 'B'; expected names among A, omega, m"),
    ({"params": {"A": np.nan}}, ValueError, "params['A'] = nan: expected a finite number"),
    ({"params": {"A": "5"}}, TypeError, "params['A'] = '5': expected a finite number"),
    ({"params": [5]}, TypeError, "params = [5]: expected a mapping of names to values"),
    ({"params": {"mu_s": 0.5}}, ValueError, "filippov.models.stiction"),
    ({"method": "euler"}, ValueError, "method = 'euler': expected one of 'dopri5', 'dop853'"),
    ({"method": 5}, ValueError, "method = 5: expected one of"),
    ({"rtol": 0}, ValueError, "rtol = 0: expected 0 < rtol < 1"),
    ({"rtol": 1.0}, ValueError, "rtol = 1.0: expected 0 < rtol < 1"),
    ({"rtol": np.nan}, ValueError, "rtol = nan: expected 0 < rtol < 1"),
    ({"atol": -1e-9}, ValueError, "atol = -1e-09: expected a finite number >= 0, or 2 of them"),
    ({"atol": [1e-9] * 3}, ValueError, "expected a finite number >= 0, or 2 of them"),
    ({"atol": [1e-9, np.inf]}, ValueError, "expected a finite number >= 0, or 2 of them"),
    ({"atol": "small"}, TypeError, "atol = 'small': expected a finite number"),
    ({"max_step": -1}, ValueError, "max_step = -1: expected a number > 0"),
    ({"max_step": 0.0}, ValueError, "max_step = 0.0: expected a number > 0"),
    ({"max_step": None}, TypeError, "max_step = None: expected a number > 0"),
    ({"first_step": 0}, ValueError, "first_step = 0: expected a number > 0, or None"),
    ({"first_step": np.inf}, ValueError, "first_step = inf: expected a number > 0, or None"),
    ({"max_steps": 0}, ValueError, "max_steps = 0: expected an integer > 0"),
    ({"max_steps": 2.5}, TypeError, "max_steps = 2.5: expected an integer > 0"),
    ({"max_events": -3}, ValueError, "max_events = -3: expected an integer > 0"),
    ({"max_events": True}, TypeError, "max_events = True: expected an integer > 0"),
    ({"on_nonunique": "any"}, ValueError, ALL),
    ({"t_eval": [0, 2]}, ValueError, "t_eval[1] = 2.0: expected a time in t_span = (0.0, 1.0)"),
    ({"t_eval": [0, np.nan]}, ValueError, "t_eval[1] = nan: expected a time in t_span"),
    ({"t_eval": [0, 0.5, 0.2]}, ValueError, "t_eval[2] = 0.2: expected times ordered"),
    ({"t_eval": [0, 1], "t_span": (1, 0)}, ValueError, "t_eval[1] = 1.0: expected times ordered"),
    ({"t_eval": 0.5}, ValueError, "t_eval = 0.5: expected one dimension, got shape ()"),
    ({"t_eval": ["a"]}, TypeError, "t_eval = ['a']: expected an array of numbers"),
    ({"events": two_needed}, TypeError, "events = two_needed(t): expected a function g(t, y) or"),
    ({"events": [lambda a, b, c, d: 0]}, TypeError, "<lambda>(a, b, c, d): expected a function"),
    ({"events": [3]}, TypeError, "events[0] = 3: expected a function g(t, y)"),
    ({"events": 3}, TypeError, "events = 3: expected a function g(t, y) or a list of them"),
    ({"events": [lambda t, y: t] * 17}, ValueError, "len(events) = 17: expected at most 16"),
    ({"events": BadTerminal()}, ValueError, "events.terminal = -1: expected a bool"),
    ({"events": BadDirection()}, ValueError, "events.direction = 'up': expected a number"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "error", "words"),
    MISTAKES,
    ids=[str(i) + "-" + next(iter(m[0])) for i, m in enumerate(MISTAKES)],
)
def test_h41_a_mistake_is_named(wrong, error, words):
    called = []
    arguments = {"events": [lambda t, y: called.append(t) or 1.0]} | GOOD | wrong
    with pytest.raises(error, match=re.escape(words)):
        fp.simulate(**arguments)
    assert not called


def test_the_words_for_long_values_are_cut():
    with pytest.raises(ValueError, match=r"\.\.\.") as caught:
        fp.simulate(**GOOD | {"x0": list(range(10_000))})
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("good"),
    [
        {"method": "RK45"},
        {"method": "DOP853"},
        {"max_steps": 1e6},
        {"atol": [1e-9, 1e-10]},
        {"atol": 0},
        {"rtol": np.float32(1e-6)},
        {"max_step": np.array(0.1)},
        {"x0": np.array([0, 0], dtype=np.int32)},
        {"t_span": np.array([0, 1])},
        {"first_step": 1e-3},
    ],
)
def test_what_is_nearly_a_mistake_is_taken(good):
    assert fp.simulate(**GOOD | good).success


def test_max_step_and_first_step_are_obeyed():
    run = fp.simulate(**GOOD, max_step=0.01)
    assert np.diff(run.t).max() <= 0.01 * (1 + 1e-12)
    run = fp.simulate(**GOOD, first_step=1e-4)
    assert run.t[1] == pytest.approx(1e-4)


# --- the other functions --------------------------------------------------------------------------

BLOCK = fp.models.oscillator
FREE = BLOCK.with_params(A=0)
BOX = {"y": (-6, 6), "v": (-3, 3)}
PAIR = np.array([1, -1])
STILL = [{"omega": 0}, {"omega": -2.94}]


@pytest.fixture(scope="module")
def run():
    return fp.simulate(**GOOD)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: fp.tangencies(BLOCK, bounds=BOX, side=PAIR), ValueError, "side = [ 1, -1]: expec"),
        (lambda: fp.section_map(BLOCK, [0, 0], after=PAIR), ValueError, "after = [ 1, -1]: expec"),
        (lambda: fp.section_map(BLOCK, [0, 0], section=PAIR), ValueError, "section = [ 1, -1]: ex"),
        (lambda: fp.lyapunov(BLOCK, transient=np.zeros(2)), TypeError, "transient = [0., 0.]: exp"),
        (lambda: fp.lyapunov(BLOCK, window=10**400), ValueError, "window = 1000000"),
        (lambda: fp.simulate(**GOOD, dense_output=PAIR), TypeError, "dense_output = [ 1, -1]: exp"),
        (lambda: fp.simulate(**GOOD, raise_on_failure=PAIR), TypeError, "raise_on_failure = [ 1,"),
        (lambda: fp.periodic_orbit(BLOCK, raise_on_failure=PAIR), TypeError, "raise_on_failure ="),
        (lambda: fp.bifurcation_diagram(BLOCK, A=[1], follow=PAIR), TypeError, "follow = [ 1, -1]"),
        (lambda: fp.bifurcation_diagram(BLOCK, A=[1], surface=PAIR), ValueError, "surface = [ 1,"),
        (lambda: fp.bifurcation_diagram(BLOCK, A=[1], section=3), TypeError, "section = 3: expect"),
        (
            lambda: fp.boundary_equilibria(FREE, PAIR, (0, 1), bounds=BOX),
            ValueError,
            "parameter = [ 1, -1]: expected one of A",
        ),
        (lambda: BLOCK.field(0, [0, 0], 2.5), TypeError, "side = 2.5: expected -1, 0 or +1"),
        (lambda: BLOCK.field(0, [0, 0], [PAIR]), ValueError, "side = "),
        (lambda: BLOCK.h("now", [0, 0]), TypeError, "t = 'now': expected"),
        (
            lambda: BLOCK.normal_components(0, [0, 0], surface=PAIR),
            ValueError,
            "surface = [ 1, -1]: expected an index below 1",
        ),
        (lambda: fp.show_config(PAIR), ValueError, "mode = [ 1, -1]: expected 'stdout' or 'dicts'"),
    ],
)
def test_arrays_and_others_where_one_value_is_expected(call, error, words):
    with pytest.raises(error, match=re.escape(words)):
        call()


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda run: list(run.segments(PAIR)), TypeError, "points_per_step = [ 1, -1]: expected"),
        (lambda run: list(run.segments("two")), TypeError, "points_per_step = 'two': expected"),
        (lambda run: run.event_table(PAIR), TypeError, "last = [ 1, -1]: expected an integer >= 0"),
        (lambda run: run.event_table(-1), ValueError, "last = -1: expected an integer >= 0"),
        (lambda run: run.event_table(digits=2.5), TypeError, "digits = 2.5: expected an integer"),
        (lambda run: run.plot(x=PAIR), ValueError, "x or y = [ 1, -1]: expected one of 'y', 'v'"),
        (lambda run: run.plot(y=3), TypeError, "x or y = 3: expected one of 'y', 'v', 't', 's'"),
    ],
)
def test_what_is_asked_of_a_trajectory(run, call, error, words):
    with pytest.raises(error, match=re.escape(words)):
        call(run)


@pytest.mark.parametrize("params", STILL)
@pytest.mark.parametrize(
    "call",
    [
        lambda params: fp.lyapunov(BLOCK, params=params),
        lambda params: fp.event_map(BLOCK, params=params),
        lambda params: fp.strobe_map(BLOCK, [0, 0], params=params),
        lambda params: fp.section_map(BLOCK, [0, 0], params=params),
        lambda params: fp.periodic_orbit(BLOCK, params=params),
        lambda params: fp.sliding_boundaries(BLOCK, bounds=BOX, params=params),
        lambda params: fp.bifurcation_diagram(BLOCK, A=[1, 2], params=params),
        lambda params: fp.event_map(BLOCK.with_params(**params)),
    ],
)
def test_a_forcing_that_does_not_come_back(call, params):
    words = rf"params = Params\(.*omega={params['omega']}, .*expected a period > 0 of oscillator"
    with pytest.raises(ValueError, match=words):
        call(params)


def test_the_period_is_that_of_the_parameters_given():
    still = BLOCK.with_params(omega=0)
    image = fp.strobe_map(still, [0, 0], params={"omega": 2.94})
    np.testing.assert_array_equal(image.x, fp.strobe_map(BLOCK, [0, 0]).x)
    diagram = fp.bifurcation_diagram(still, omega=[-1, 0, 2.94], transient=1, keep=1)
    assert diagram.status.tolist() == ["not_finite", "not_finite", "ok"]
    assert not fp.bifurcation_diagram(BLOCK, omega=[0], transient=1, keep=1).success


@pytest.mark.parametrize("pair", [list, tuple, np.array])
def test_any_sequence_of_two_numbers_bounds(pair):
    box = {name: pair(each) for name, each in BOX.items()}
    assert fp.tangencies(BLOCK, bounds=box) == fp.tangencies(BLOCK, bounds=BOX)
    assert fp.sliding_region(BLOCK, bounds=box).tangencies
    expected = fp.boundary_equilibria(FREE, "V", (0, 1), bounds=BOX)
    assert fp.boundary_equilibria(FREE, "V", pair((0, 1)), bounds=box) == expected


def test_bounds_of_a_branch_may_be_an_array():
    orbit = fp.periodic_orbit(BLOCK, params={"A": 5, "omega": 2.5})
    ends = np.array([2.49, 2.51])
    over = fp.continuation(orbit, "omega", ends, max_points=1)
    assert over.bounds == {"omega": (2.49, 2.51)}
    assert len(over) == 3  # the start and a step either way
