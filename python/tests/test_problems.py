# SPDX-License-Identifier: BSD-3-Clause
"""Problems with known answers, by number; each tolerance is that of the digits given."""

import math

import numpy as np
import pytest

import filippov as fp

TIGHT = {"rtol": 1e-12, "atol": 1e-13}
METHODS = pytest.mark.parametrize("method", ["dopri5", "dop853"])


def events(run, *kinds):
    return run.events[np.isin(run.events["kind"], kinds)]


@METHODS
def test_p1_coulomb_decay_reverses_at_multiples_of_pi_and_rests(method):
    run = fp.simulate(fp.models.coulomb, [3, 0], (0, 20), method=method, **TIGHT)
    cross, enter = events(run, "cross"), events(run, "enter_sliding")
    # exact; 1e-10 is some hundred times the local tolerance
    np.testing.assert_allclose(cross["t"], np.pi * np.arange(1, 4), atol=1e-10)
    np.testing.assert_allclose(cross["x_right"][:, 0], [-2.2, 1.4, -0.6], atol=1e-10)
    np.testing.assert_allclose(enter["t"], [4 * np.pi], atol=1e-10)
    np.testing.assert_allclose(run.y[:, -1], [-0.2, 0], atol=1e-10)
    assert run.t[-1] == 20
    assert run.mode[-1] == 0
    assert run.success


@METHODS
def test_p2_curved_surface_is_crossed_at_time_one(method):
    start = [math.exp(-1), 0]
    run = fp.simulate(fp.models.unit_circle, start, (0, math.pi / 2), method=method, **TIGHT)
    assert events(run, "cross")["t"] == pytest.approx([1], abs=1e-11)
    exact = [-1.5974603774507, 0.7614936206060]
    np.testing.assert_allclose(run.y[:, -1], exact, atol=2e-11)


def test_p3_belt_with_varying_speed():
    run = fp.simulate(fp.models.varying_belt, [3, 0], (0, 30), method="dop853", **TIGHT)
    assert events(run, "cross")["t"] == pytest.approx(
        [7.6055699647, 14.8051056891, 17.4589396439], abs=2e-10
    )
    assert events(run, "enter_sliding")["t"] == pytest.approx(
        [9.4833785789, 26.1316818246], abs=2e-10
    )
    assert events(run, "exit_sliding")["t"] == pytest.approx(
        [9.7652587545, 27.2911568935], abs=2e-10
    )


@METHODS
def test_p4_dieci_lopez_hits_leaves_and_comes_back_after_its_period(method):
    run = fp.simulate(fp.models.dieci_lopez, [0, 0], (0, 50), method=method, **TIGHT)
    enter, leave = events(run, "enter_sliding"), events(run, "exit_sliding")
    assert enter["t"][0] == pytest.approx(0.221654814176, abs=1e-11)
    assert enter["x_right"][0, 0] == pytest.approx(0.021575735623, abs=1e-11)
    assert leave["t"][0] == pytest.approx(5.113776136063, abs=1e-10)
    np.testing.assert_allclose(np.diff(leave["t"])[1:], 9.230770458083, atol=1e-9)


@METHODS
def test_p5_coulomb_with_sine_force(method):
    run = fp.simulate(fp.models.coulomb, [1, 2], (0, 8), params={"a": 1.0}, method=method, **TIGHT)
    cross = events(run, "cross")
    assert cross["t"] == pytest.approx([1.062846232871, 3.913987190289], abs=1e-11)
    assert cross["x_right"][0, 0] == pytest.approx(2.121614175528, abs=1e-11)
    stick, slip = events(run, "enter_sliding"), events(run, "exit_sliding")
    assert stick["t"] == pytest.approx([4.415348156986], abs=1e-11)
    assert stick["x_right"][0, 0] == pytest.approx(0.471047029348, abs=1e-11)
    assert slip["t"] == pytest.approx([6.140971435234], abs=1e-11)


@METHODS
def test_p6_relay_feedback_slides_from_the_start(method):
    start = [0, -0.001, -0.02]
    run = fp.simulate(fp.models.relay, start, (0, 3.3), method=method, **TIGHT)
    assert run.mode[0] == 0
    met = run.events[1:-1]
    assert list(met["kind"]) == ["exit_sliding", "enter_sliding"] * 2
    expected = [2.812403376, 3.041621639, 3.068976833, 3.289499164]
    assert met["t"] == pytest.approx(expected, abs=1e-9)


def test_p8_stiff_relay_hits_and_slides():
    run = fp.simulate(fp.models.stiff_relay, [1], (0, 3), rtol=1e-10, atol=1e-12)
    assert events(run, "enter_sliding")["t"] == pytest.approx([math.pi - math.atan(1000)], abs=1e-9)
    assert abs(run.y[0, -1]) < 1e-15


class TestP9Quartet:
    def test_crosses(self):
        run = fp.simulate(fp.models.quartet, [-1], (0, 1), params={"b": 1, "c": 2})
        assert events(run, "cross")["t"] == pytest.approx([1 / 3], abs=1e-14)

    def test_slides(self):
        run = fp.simulate(fp.models.quartet, [-1], (0, 4), params={"b": 1})
        assert events(run, "enter_sliding")["t"] == pytest.approx([1], abs=1e-14)
        assert abs(run.y[0, -1]) < 1e-15

    def test_leaves_at_one(self):
        run = fp.simulate(fp.models.quartet, [0], (0, 2), params={"d": 1})
        assert events(run, "exit_sliding")["t"] == pytest.approx([1], abs=1e-14)
        assert run.y[0, -1] == pytest.approx(0.5, abs=1e-13)

    def test_is_not_unique_and_says_so(self):
        run = fp.simulate(fp.models.quartet, [0], (0, 1), params={"b": -1})
        assert run.status == "ambiguous"
        assert not run.success
        assert "on_nonunique" in run.message
        assert "t = 0" in run.message

    @pytest.mark.parametrize(("policy", "end"), [("below", -1), ("above", 1), ("stay", 0)])
    def test_policy_chooses(self, policy, end):
        run = fp.simulate(fp.models.quartet, [0], (0, 1), params={"b": -1}, on_nonunique=policy)
        assert run.success
        assert run.y[0, -1] == pytest.approx(end, abs=1e-14)
        assert run.events["mode_after"][0] == end


def test_p13_two_surfaces_reach_the_intersection_and_slide_on_it():
    run = fp.simulate(fp.models.dieci_lopez_2, [0.04, -0.01, -0.02], (0, 1), **TIGHT)
    expected = [0.244330789560, 0.554993242465]
    assert events(run, "enter_sliding")["t"] == pytest.approx(expected, abs=1e-11)
    assert run.success
    assert run.mode.shape == (2, run.t.size)
    assert run.mode[:, -1].tolist() == [0, 0]


def test_stiction_sticks_longer_than_its_kinetic_law():
    loose = fp.models.stiction.with_params(mu_s=0.3)
    held = fp.models.stiction.with_params(mu_s=0.4)
    ends = []
    for system in (loose, held):
        run = fp.simulate(system, [0, 1], (0, 10))
        leave = events(run, "exit_sliding")[0]
        p = system.params
        # on the belt y = V t; it slips where |A cos(omega t) - y| reaches m g mu_s
        force = p.A * np.cos(p.omega * leave["t"]) - p.V * leave["t"]
        assert abs(force) == pytest.approx(p.weight * p.mu_s, abs=1e-9)
        ends.append(leave["t"])
    assert ends[1] > ends[0] + 0.5
