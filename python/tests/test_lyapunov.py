# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator


def test_on_a_periodic_orbit_with_slides():
    result = fp.lyapunov(BLOCK, params={"A": 5, "omega": 2.8}, transient=300, window=200)
    assert result.success, result.message
    assert result.exponents[0] < 0
    assert result.exponents[1] == -np.inf
    assert result.error[0] < 1e-10
    assert result.slides == 200
    T = BLOCK.period({"omega": 2.8})
    assert result.window == pytest.approx((300 * T, 500 * T))


def test_without_slides_all_are_finite():
    # figure 4.9: crossings only
    result = fp.lyapunov(BLOCK, params={"A": 5, "omega": 1.6}, transient=300, window=200)
    assert result.slides == 0
    assert np.isfinite(result.exponents).all()
    assert result.exponents[0] >= result.exponents[1]


def test_an_autonomous_cycle_has_the_exponent_zero():
    result = fp.lyapunov(fp.models.dieci_lopez, [0, 0], transient=200, window=900, stretch=0.5)
    assert abs(result.exponents[0]) < 3 / 900
    assert result.exponents[1] == -np.inf


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"sys": 1}, TypeError, "sys = 1: expected a System"),
        ({"x0": [1]}, ValueError, "x0 = "),
        ({"window": 3}, ValueError, "window = 3.0: expected at least 20: 20 batches"),
        ({"batches": 1}, ValueError, "batches = 1"),
        ({"stretch": 0}, ValueError, "stretch = 0"),
        ({"transient": -1}, ValueError, "transient = -1"),
        ({"transient": "long"}, TypeError, "transient = 'long'"),
        ({"atol": np.nan}, ValueError, "atol = nan"),
    ],
)
def test_wrong_arguments_are_named(arguments, error, words):
    with pytest.raises(error, match=words):
        fp.lyapunov(**({"sys": BLOCK} | arguments))


def test_repr_shows_exponents_and_errors():
    result = fp.lyapunov(fp.models.oscillator, transient=10, window=20)
    assert repr(result).startswith("<Lyapunov exponents of oscillator: ")
    assert "-inf; " in repr(result)
    assert len(repr(result)) < 120
