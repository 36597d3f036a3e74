# SPDX-License-Identifier: BSD-3-Clause
"""The campaign of typed formulas, `bench/strangers.py`."""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest

BENCH = Path(__file__).parents[2] / "bench"


@pytest.fixture
def strangers(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCH))
    return importlib.import_module("strangers")


@pytest.mark.parametrize(
    "term",
    [("power", 0.7, 2, 1.5), ("wave", 0.7, 3, 0.4), ("decay", 0.7, 0.3, 1), ("bump", 2, 0.5, 1)],
)
def test_derivatives_of_terms_are_those_of_the_values(strangers, term):
    f = strangers.Term(*term)
    t, d = 1.3, 1e-4
    for n in (-2, -1, 0, 1):  # central differences: third derivatives below 200, so 4e-7
        slope = (f(np.array(t + d), n) - f(np.array(t - d), n)) / (2 * d)
        assert slope == pytest.approx(f(np.array(t), n + 1), abs=1e-6)


def test_a_dip_between_samples_is_found(strangers):
    # below zero for 2e-6 around 0.3337, sampled every 1/160
    root = strangers.first_root(lambda t: (t - 0.3337) ** 2 - 1e-12, 0.0, 1.0, 0.1)
    assert root == pytest.approx(0.3337 - 1e-6, abs=1e-12)
    assert math.isinf(strangers.first_root(lambda t: (t - 0.3337) ** 2 + 1e-12, 0.0, 1.0, 0.1))


def test_a_relay_is_followed_by_its_closed_form(strangers):
    # x' = 1.25 cos t - sign x from rest: it leaves where 1.25 cos t falls below -1, at
    # t0 = pi - acos(0.8), and is back where 1.25 (sin t - sin t0) = -(t - t0)
    relay = strangers.Relay(
        strangers.Wave([strangers.Term("wave", 1.25, 1, 0)]), strangers.constant(0), 1.0
    )
    _, changes, _, known = relay.follow(0.0, True, 1.0, 4.5, 0.0, 1.0)
    assert known
    (t0, first), (t1, second) = changes
    assert (first, second) == (-1, 0)
    assert t0 == pytest.approx(math.pi - math.acos(0.8), abs=1e-12)
    assert 1.25 * (math.sin(t1) - math.sin(t0)) == pytest.approx(t0 - t1, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "family",
    [
        "slides",
        "swings",
        "ripples",
        "belts",
        "several",
        "contacts",
        "converters",
        "ends",
        "counters",
        "two-folds",
        "diagrams",
        "formulas",
    ],
)
def test_no_run_is_wrong(strangers, family):
    for number in range(6):
        report = strangers.one((family, number))
        assert report.failures == []
        assert sum(report.counts.values()) + report.left_out > 0
