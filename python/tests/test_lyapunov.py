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


def boost(latched=100.0, period=0.1):
    """Give a boost converter under peak-current control: its clock and its latch are components."""

    @fp.system(
        state="v i q tau",
        params={"Iref": 1.6},
        jumps={
            "clock": (f"{period!r} - tau", lambda t, s, p: (s.v, s.i, 1, 0)),
            "peak": (f"Iref - i + {latched!r}*(1 - q)", lambda t, s, p: (s.v, s.i, 0, s.tau)),
        },
        period=period,
    )
    def converter(t, s, p):
        off = 1 - s.q
        return (off * s.i - s.v / 20) / 0.012, 10 - off * s.v, 0, 1

    return converter


def exact_exponents(current):
    """Those of the converter's fixed point, by matrix exponentials."""
    A = np.array([[-1 / 0.24, 1 / 0.012], [-1.0, 0.0]])
    rest = np.array([10.0, 0.5])
    values, vectors = np.linalg.eig(A)

    def period(x, peak):
        on = (peak - x[1]) / 10
        fall = np.exp(-on / 0.24)
        top = np.array([x[0] * fall, peak])
        off = (vectors * np.exp(values * (0.1 - on)) @ np.linalg.inv(vectors)).real
        to_top = np.array([[fall, top[0] / 2.4], [0.0, 0.0]])
        slope = off @ to_top + np.outer(A @ off @ (top - rest), [0.0, 0.1])
        return rest + off @ (top - rest), slope

    x = np.array([13.8, 0.75])
    for k in range(2001):
        x, slope = period(x, 1 + (current - 1) * min(k / 1000, 1))
    return np.sort(np.log(np.abs(np.linalg.eigvals(slope))) / 0.1)[::-1]


@pytest.mark.parametrize("current", [1.0, 1.2, 1.5, 1.6])
def test_a_clock_and_a_latch_are_exact_and_leave_the_others_alone(current):
    for latched, tau in ((100.0, 0.0), (100.0, 0.037), (3.0, 0.0), (1e6, 0.0999)):
        result = fp.lyapunov(
            boost(latched),
            [15, 0.5, 1, tau],
            params={"Iref": current},
            transient=400,
            window=100,
        )
        assert result.success, result.message
        assert result.exponents[0] == 0
        assert result.error[0] == 0
        # derivatives err by some 1e-11 a period
        np.testing.assert_allclose(result.exponents[1:3], exact_exponents(current), rtol=1e-7)
        assert result.exponents[3] == -np.inf


def test_a_short_transient_is_within_the_error_bar():
    result = fp.lyapunov(boost(), [12, 0.5, 1, 0], transient=50, window=100)
    gaps = np.abs(result.exponents[1:3] - exact_exponents(1.6))
    assert (gaps < 3 * result.error[1:3]).all()
