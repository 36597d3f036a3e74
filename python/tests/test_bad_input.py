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


ALL = "on_nonunique = 'all': expected one of 'stop', 'below', 'above', 'stay'"

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
    ({"on_nonunique": "all"}, ValueError, ALL),
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
