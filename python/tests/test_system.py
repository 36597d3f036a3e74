# SPDX-License-Identifier: BSD-3-Clause
import pickle

import numpy as np
import pytest

import filippov as fp
from filippov import models

ALL = [getattr(models, name) for name in models.__all__]
EACH = pytest.mark.parametrize("system", ALL, ids=lambda system: system.name)
RNG = np.random.default_rng(1)


@EACH
def test_a_model_says_what_it_is(system):
    assert isinstance(system, fp.System)
    assert getattr(models, system.name) is system
    assert len(system.state) == system.dim
    assert len(system.switches) == system.surfaces
    text = repr(system)
    for name in (*system.state, *system.params, *system.switches, *system.capabilities):
        assert name in text
    assert f"`{system.name}`" in models.__doc__


@EACH
def test_the_jacobian_is_the_derivative_of_the_field(system):
    x = 0.3 * RNG.standard_normal(system.dim) + 0.1
    for side in (-1, 1):
        sides = side if system.surfaces == 1 else [side] * system.surfaces
        steps = 1e-6 * np.eye(system.dim)
        slope = [
            (system.field(0.3, x + e, sides) - system.field(0.3, x - e, sides)) / 2e-6
            for e in steps
        ]
        jacobian = system.jacobian(0.3, x, sides)
        # central differences: step**2 and rounding/step, relative to the size of the entries
        np.testing.assert_allclose(
            jacobian, np.transpose(slope), rtol=1e-6, atol=1e-7 * max(1, np.abs(jacobian).max())
        )


def test_values_are_those_of_the_paper():
    p = models.oscillator.params
    t, x = 0.7, np.array([0.4, 0.2])
    q = p.A * np.cos(p.omega * t) - p.k * x[0]
    r = p.V - x[1]
    mu = p.alpha / (1 + p.gamma * r) + p.beta + p.eta * r**2
    assert models.oscillator.h(t, x) == pytest.approx(x[1] - p.V)
    expected = [x[1], (q + p.m * p.g * mu) / p.m]
    np.testing.assert_allclose(models.oscillator.field(t, x, -1), expected, rtol=1e-14)
    on_belt = [x[0], p.V]
    np.testing.assert_allclose(models.oscillator.field(t, on_belt, 0), [p.V, 0], atol=1e-15)
    assert models.oscillator.equivalent_control(t, on_belt) == pytest.approx(q / 4, rel=1e-13)
    l1, l2 = models.oscillator.normal_components(t, on_belt)
    assert (l1, l2) == pytest.approx((q + 4, q - 4))


def test_arrays_of_points_and_times():
    system = models.oscillator
    x = RNG.standard_normal((2, 5))
    t = np.arange(5.0)
    assert system.h(0, x).shape == (5,)
    assert system.field(0, x, 1).shape == (2, 5)
    assert system.field(t, [0, 0], 1).shape == (2, 5)
    assert system.jacobian(0, x, 1).shape == (2, 2, 5)
    assert system.equivalent_control(t, x).shape == (5,)
    one_by_one = [system.field(t[k], x[:, k], -1) for k in range(5)]
    np.testing.assert_array_equal(system.field(t, x, -1), np.transpose(one_by_one))
    two = models.dieci_lopez_2
    assert two.h(0, np.zeros((3, 4))).shape == (2, 4)
    np.testing.assert_allclose(two.h(0, [0, 0, 0]), [-0.2, -0.4])


def test_two_surfaces_take_two_sides():
    two = models.dieci_lopez_2
    x = [0.1, 0.2, 0.0]
    s = two.equivalent_control(0, x, surface=0, side=[0, -1])
    assert -1 < s < 1
    assert two.field(0, x, [0, -1])[1] == pytest.approx(0, abs=1e-15)  # stays on x2 = 0.2
    with pytest.raises(ValueError, match="side = None"):
        two.equivalent_control(0, x)
    np.testing.assert_allclose(two.field(0, [0.1, 0.2, 0.4], [0, 0])[1:], 0, atol=1e-15)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.field(0, [0, 0], 2), "side = 2: expected -1, 0 or"),
        (lambda s: s.field(0, [0, 0], [1, 1]), r"side = \[1, 1\]: expected -1, 0 or"),
        (lambda s: s.field(0, [0], 1), r"expected shape \(2,\) or \(2, k\) for \(y, v\)"),
        (lambda s: s.field(0, np.zeros((3, 2)), 1), r"expected shape \(2,\) or \(2, k\)"),
        (lambda s: s.h([0, 1, 2], np.zeros((2, 2))), "one time or one for each of 2 states"),
        (lambda s: s.h([[0]], [0, 0]), "t = .*expected a number or shape"),
        (lambda s: s.normal_components(0, [0, 0], surface=1), "surface = 1: expected an index"),
        (lambda s: s.h(0, [0, 0], {"B": 1}), "no parameter 'B'"),
        (lambda s: s.with_params(B=1), "no parameter 'B'"),
    ],
)
def test_wrong_arguments_are_named(call, words):
    with pytest.raises(ValueError, match=words):
        call(models.oscillator)


def test_no_numbers_is_a_type_error():
    with pytest.raises(TypeError, match="expected numbers"):
        models.oscillator.h("a", [0, 0])


def test_with_params_is_another_system():
    hard = models.oscillator.with_params(A=5, omega=1.72)
    assert hard is not models.oscillator
    assert models.oscillator.params.A == 0.5
    assert hard.params["A"] == hard.params.A == 5
    assert hard.params.V == 1
    assert hard.period() == pytest.approx(2 * np.pi / 1.72)
    assert hard.period({"omega": 1.0}) == pytest.approx(2 * np.pi)
    run = fp.simulate(hard, [0, 0], (0, 10), params={"omega": 2.0})
    assert (run.params.A, run.params.omega) == (5, 2)
    same = fp.simulate(models.oscillator, [0, 0], (0, 10), params={"A": 5, "omega": 2.0})
    np.testing.assert_array_equal(run.y, same.y)


def test_period_is_none_without_one():
    assert models.unit_circle.period() is None


def test_parameters_are_a_mapping_that_cannot_be_changed():
    p = models.oscillator.params
    assert list(p)[:2] == ["A", "omega"]
    assert len(p) == 10
    assert dict(p)["V"] == 1
    assert "omega=2.94" in repr(p)
    with pytest.raises(AttributeError, match="no parameter 'B'"):
        _ = p.B
    with pytest.raises(TypeError):
        p["A"] = 3
    assert pickle.loads(pickle.dumps(p)) == p


def test_a_system_survives_pickling():
    hard = models.oscillator.with_params(A=5)
    copy = pickle.loads(pickle.dumps(hard))
    assert copy.name == "oscillator"
    assert copy.params == hard.params
    relay = pickle.loads(pickle.dumps(models.relay))
    assert relay.params["lambda"] == 1


def test_static_friction_above_kinetic_is_refused_with_the_way_out():
    with pytest.raises(ValueError, match=r"not a Filippov system.*models\.stiction"):
        models.oscillator.with_params(mu_s=0.5)
    assert "s_max" in models.stiction.capabilities
    assert "not a Filippov system" in models.__doc__


def test_how_slides_are_followed():
    assert models.oscillator.sliding == "closed form"
    assert models.relay.sliding == "equivalent control"
