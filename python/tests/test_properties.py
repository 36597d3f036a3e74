# SPDX-License-Identifier: BSD-3-Clause
"""Invariants over many starts, definitions and arguments."""

import math

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


# --- definitions ----------------------------------------------------------------------------------

NUMBER = st.floats(-3, 3).map(lambda v: round(v, 3))
UNARY = [np.sin, np.cos, np.tanh, np.exp, np.arctan, np.negative, np.square]
BINARY = [np.add, np.subtract, np.multiply]
FORMULA = st.recursive(
    st.sampled_from(["x", "v", "t", "a"]) | NUMBER,
    lambda inner: (
        st.tuples(st.sampled_from(UNARY), inner)
        | st.tuples(st.sampled_from(BINARY), inner, inner)
        | st.tuples(st.just(lambda u, w: u / (1 + w * w)), inner, inner)
    ),
    max_leaves=12,
)


def value(formula, names):
    if isinstance(formula, tuple):
        return formula[0](*(value(inner, names) for inner in formula[1:]))
    return names[formula] if isinstance(formula, str) else formula


@given(FORMULA, FORMULA, st.tuples(*[st.floats(-2, 2)] * 4))
def test_what_is_recorded_is_what_was_written(left, right, point):
    # the system's own value against numpy's, on both sides of x = 0.1, and its derivatives
    # against differences of 2e-6
    def rhs(t, s, p):
        names = {"x": s.x, "v": s.v, "t": t, "a": p.a}
        side = np.sign(s.x - 0.1)
        return s.v + 0 * side, value(left, names) - (1 + value(right, names) ** 2) * side

    t, x, v, a = point
    names = {"x": x, "v": v, "t": t, "a": a}
    values = value(left, names), value(right, names)
    assume(all(math.isfinite(u) and abs(u) < 1e6 for u in values))
    system = fp.system(state="x v", params={"a": 1.0})(rhs)
    for side in (-1, 1):
        expected = values[0] - (1 + values[1] ** 2) * side
        got = system.field(t, [x, v], side, {"a": a})
        np.testing.assert_allclose(got, [v, expected], rtol=1e-12, atol=1e-12)


@given(st.floats(0.2, 4), st.floats(0, 0.5), st.floats(0.1, 2), st.floats(-3, 3), st.floats(-2, 2))
def test_own_systems_run_as_their_closed_form(k, c, mu, x, v):
    # x'' = -k x - 2 c x' - mu above x' = -50, where it stays: a damped oscillation
    @fp.system(state="x v", params={"k": k, "c": c, "mu": mu})
    def swing(t, s, p):
        return s.v, -p.k * s.x - 2 * p.c * s.v - p.mu * np.sign(s.v + 50)

    assume(k > c * c + 0.01)
    run = fp.simulate(swing, [x, v], (0, 7), rtol=1e-10, atol=1e-12)
    assert run.success
    w = math.sqrt(k - c * c)
    rest = -mu / k
    turned = (x - rest) * np.cos(w * run.t) + (v + c * (x - rest)) / w * np.sin(w * run.t)
    np.testing.assert_allclose(run.y[0], rest + np.exp(-c * run.t) * turned, atol=1e-7)


# --- results --------------------------------------------------------------------------------------


@given(st.lists(st.tuples(POSITION, VELOCITY), min_size=1, max_size=9), st.floats(1, 30))
def test_an_ensemble_ends_where_its_members_do(starts, t_end):
    x0 = np.array(starts).T
    ends = fp.ensemble(fp.models.oscillator, x0, (0, t_end), rtol=1e-10, atol=1e-12)
    for k, start in enumerate(starts):
        run = fp.simulate(fp.models.oscillator, start, (0, t_end), rtol=1e-10, atol=1e-12)
        assert ends.status[k] == run.status
        if run.success:
            np.testing.assert_allclose(ends.y[:, k], run.y[:, -1], atol=1e-5)


@given(st.floats(0.5, 5), st.floats(0.8, 2.9))
def test_a_periodic_orbit_comes_back(A, omega):
    block = fp.models.oscillator.with_params(A=A, omega=omega)
    orbit = fp.periodic_orbit(block, max_turns=8)
    assume(orbit.success)
    run = fp.simulate(block, orbit.x0, (orbit.t0, orbit.t0 + orbit.period), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(run.y[:, -1], orbit.x0, atol=1e-6)
    assert orbit.stable == (np.abs(orbit.multipliers).max() < 1)


# --- arguments ------------------------------------------------------------------------------------

ANYTHING = (
    st.none()
    | st.booleans()
    | st.integers(-3, 10**20)
    | st.floats()
    | st.text(max_size=5)
    | st.lists(st.floats() | st.text(max_size=2), max_size=4)
    | st.binary(max_size=3)
    | st.complex_numbers()
    | st.dictionaries(st.text(max_size=3), st.floats(), max_size=2)
)


ASKED = [
    "x0",
    "t_span",
    "rtol",
    "atol",
    "method",
    "max_step",
    "first_step",
    "t_eval",
    "params",
    "max_events",
]
ENDS = [
    "ok",
    "max_steps",
    "max_events",
    "step_too_small",
    "not_finite",
    "escaped",
    "event",
    "ambiguous",
]


@given(st.sampled_from([*ASKED, "max_steps", "on_nonunique", "dense_output"]), ANYTHING)
@settings(max_examples=300)
def test_whatever_is_asked_is_answered_or_refused_by_name(name, what):
    # bounded: an argument that makes sense may ask for a long run
    asked = {"x0": [0.1, 0.2], "t_span": (0, 1), "max_steps": 1000} | {name: what}
    refusal = None
    try:
        run = fp.simulate(fp.models.oscillator, **asked)
    except (ValueError, TypeError) as refused:
        refusal = str(refused)
    if refusal is None:
        assert run.status in ENDS
        assert np.isfinite(run.y).all()
    else:
        assert name in refusal
