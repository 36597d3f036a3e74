# SPDX-License-Identifier: BSD-3-Clause
"""Invariants over many starts."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import filippov as fp

settings.register_profile("fixed", deadline=None, derandomize=True, max_examples=40)
settings.load_profile("fixed")

POSITION = st.floats(-4, 4)
VELOCITY = st.floats(-2, 3)
METHOD = st.sampled_from(["dopri5", "dop853"])


@given(POSITION, VELOCITY, METHOD, st.lists(st.floats(0, 30), max_size=20))
def test_output_times_equal_sol(y, v, method, times):
    times = sorted(times)
    run = fp.simulate(fp.models.oscillator, [y, v], (0, 30), method=method)
    assume(run.success)
    for dense in (False, True):
        at = fp.simulate(
            fp.models.oscillator, [y, v], (0, 30), method=method, t_eval=times, dense_output=dense
        )
        assert at.t.tolist() == times
        np.testing.assert_array_equal(at.y, run.sol(times))


@given(POSITION, VELOCITY, METHOD)
def test_the_log_and_the_modes_tell_one_story(y, v, method):
    run = fp.simulate(fp.models.oscillator, [y, v], (0, 30), method=method)
    assume(run.success)
    log = run.events
    assert log["mode_before"][0] == log["mode_after"][0]
    np.testing.assert_array_equal(log["mode_before"][1:], log["mode_after"][:-1])
    assert (np.diff(run.t) >= 0).all()
    h = run.system.h(run.t, run.y)
    # between the events of a side h has its sign; at points the tolerance is the user's
    assert (h * run.mode >= -1e-7).all()
    assert (h[run.mode == 0] == 0).all()
    for event in log:
        if event["kind"] in ("cross", "enter_sliding", "exit_sliding"):
            assert abs(run.system.h(event["t"], event["x_right"])) < 1e-14
        if event["kind"] == "exit_sliding":
            assert abs(abs(event["s"]) - 1) < 1e-9


@given(st.floats(-4, 4), st.floats(-3, 3), st.integers(-20, 20), METHOD)
def test_coulomb_friction_scales_with_its_start(x, v, power, method):
    # x'' + x = -mu sign x' is the same for (c x, c mu, c atol)
    c = 2.0**power
    one = fp.simulate(fp.models.coulomb, [x, v], (0, 15), method=method, atol=1e-10)
    scaled = fp.simulate(
        fp.models.coulomb,
        [c * x, c * v],
        (0, 15),
        method=method,
        atol=c * 1e-10,
        params={"mu": c * 0.4},
    )
    assert scaled.status == one.status
    assert list(scaled.events["kind"]) == list(one.events["kind"])
    np.testing.assert_allclose(scaled.events["t"], one.events["t"], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(scaled.y[:, -1] / c, one.y[:, -1], atol=1e-9)


@given(POSITION, VELOCITY, st.integers(-1000, 1000))
def test_a_start_one_period_later_is_the_same_start(y, v, n):
    system = fp.models.oscillator
    shift = n * system.period()
    here = fp.simulate(system, [y, v], (0, 20), t_eval=[20.0])
    assume(here.success)
    there = fp.simulate(system, [y, v], (shift, shift + 20), t_eval=[shift + 20])
    # the shift itself is rounded; the flow may stretch that
    np.testing.assert_allclose(there.y, here.y, atol=1e-6)
    assert list(there.events["kind"]) == list(here.events["kind"])


@given(st.floats(0.5, 4), st.floats(0.05, 0.6))
def test_every_half_swing_loses_twice_the_friction(x, mu):
    run = fp.simulate(fp.models.coulomb, [x, 0], (0, 40), params={"mu": mu}, rtol=1e-10, atol=1e-12)
    turns = run.events[np.isin(run.events["kind"], ["cross", "enter_sliding"])]
    peaks = np.abs(np.concatenate([[x], turns["x_right"][:, 0]]))
    drop = -np.diff(peaks)
    np.testing.assert_allclose(drop[:-1], 2 * mu, atol=1e-7)
    assert (peaks[:-1] > mu * (1 - 1e-7)).all()
    if run.mode[-1] == 0:
        assert peaks[-1] <= mu * (1 + 1e-6)
