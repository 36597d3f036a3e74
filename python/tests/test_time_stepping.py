# SPDX-License-Identifier: BSD-3-Clause
"""Time stepping, the method without events."""

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator


@fp.system(state="x v", params={"F": 0.4})
def typed(t, s, p):
    return s.v, -s.x - p.F * np.sign(s.v)


def test_first_order_over_crossings_stick_and_slip():
    exact = fp.simulate(BLOCK, [0, 0], (0, 40), method="dop853", rtol=1e-11, atol=1e-12)
    steps = 5000 * 2 ** np.arange(6)
    errors = [
        abs(fp.time_stepping(BLOCK, [0, 0], (0, 40), n_steps=int(n)).y[:, -1] - exact.y[:, -1])
        for n in steps
    ]
    slope = np.polyfit(np.log(steps), np.log(np.max(errors, axis=1)), 1)[0]
    assert slope == pytest.approx(-1, abs=0.1)


def test_second_order_over_stick_and_slip_by_the_trapezoidal_rule():
    exact = fp.simulate(BLOCK, [0, 0], (0, 40), method="dop853", rtol=1e-11, atol=1e-12)
    steps = 2000 * 2 ** np.arange(7)
    errors = [
        abs(
            fp.time_stepping(BLOCK, [0, 0], (0, 40), n_steps=int(n), theta=0.5).y[:, -1]
            - exact.y[:, -1]
        )
        for n in steps
    ]
    slope = np.polyfit(np.log(steps), np.log(np.max(errors, axis=1)), 1)[0]
    assert slope < -1.7


def test_rests_to_the_last_bit():
    run = fp.time_stepping(typed, [3, 0], (0, 40), n_steps=20_000)
    assert run.success
    late = run.t > 20
    assert (run.y[:, late] == run.y[:, late][:, :1]).all()
    assert abs(run.y[1, -1]) < 1e-15
    # the friction holds the spring
    assert 0.4 * run.s[0, -1] == pytest.approx(-run.y[0, -1], abs=1e-12)
    assert (np.abs(run.s) <= 1).all()


def test_events_that_accumulate_cost_nothing():
    spiral = fp.models.sign_plane
    run = fp.time_stepping(spiral, [0, 1], (0, 1), n_steps=2000)
    assert run.success
    assert np.abs(run.y[:, -1]).max() < 1e-14


def test_sides_that_are_given_one_by_one_are_blended():
    relay = fp.System(
        "x", {"b": 1.0}, fields={"-": lambda t, s, p: p.b, "+": lambda t, s, p: -p.b}, switch="x"
    )
    run = fp.time_stepping(relay, [1], (0, 2), n_steps=1000)
    assert run.y[0, -1] == 0
    assert run.t[np.argmax(run.y[0] == 0)] == pytest.approx(1, abs=0.003)


def test_begins_on_the_side_where_it_starts():
    @fp.system(state="x")
    def repels(t, s):
        return np.sign(s.x) + 0.1

    for n_steps in (10, 1000):
        run = fp.time_stepping(repels, [-1e-4], (0, 1), n_steps=n_steps)
        assert run.y[0, -1] == pytest.approx(-0.9001, abs=1e-12)


def test_switches_in_switches():
    @fp.system(state="x v")
    def clipped(t, s):
        return s.v, -np.clip(5 * s.x, -1, 1) - 0.2 * np.sign(s.v)

    @fp.system(state="x y")
    def nested(t, s):
        return -np.sign(s.x + 0.5 * np.sign(s.y)), -0.5 * np.sign(s.y - 0.3)

    for system, start in ((clipped, [1.0, 0]), (nested, [1.3, 2])):
        exact = fp.simulate(system, start, (0, 6), method="dop853", rtol=1e-10, atol=1e-11)
        errors = []
        for n_steps in (5_000, 20_000, 80_000):
            run = fp.time_stepping(system, start, (0, 6), n_steps=n_steps)
            assert run.success
            errors.append(abs(run.y[:, -1] - exact.y[:, -1]).max())
        # first order, or exact as soon as it rests
        assert errors[2] < errors[1] / 3 < errors[0] / 9 or errors[2] < 1e-9


def test_keeps_what_is_asked_for():
    run = fp.time_stepping(typed, [3, 0], (0, 1), n_steps=100, keep=30)
    assert run.t == pytest.approx([0, 0.3, 0.6, 0.9, 1.0])
    assert run.y.shape == (2, 5)
    assert run.s.shape == (1, 5)
    assert run.n_steps == 100
    other = fp.time_stepping(typed, [3, 0], (0, 1), n_steps=100, params={"F": 0.1})
    assert other.params["F"] == 0.1
    assert other.y[0, -1] != run.y[0, -1]


def test_saves_plots_and_repeats(tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    run = fp.time_stepping(typed, [3, 0], (0, 10), n_steps=200)
    run.save(tmp_path / "steps.npz")
    loaded = fp.load(tmp_path / "steps.npz")
    np.testing.assert_array_equal(loaded.y, run.y)
    assert loaded.system == typed
    figure, ax = plt.subplots()
    assert len(run.plot(ax, lw=2)) == 2
    plt.close(figure)
    assert "200 steps" in repr(run)
    xarray = pytest.importorskip("xarray")
    assert isinstance(run.to_xarray(), xarray.Dataset)


def test_where_nothing_solves_a_step_it_says_so():
    @fp.system(state="x")
    def ends(t, s):
        return 1 + np.sqrt(-s.x) + 0.1 * np.sign(s.x + 10)

    run = fp.time_stepping(ends, [-1.0], (0, 5), n_steps=500)
    assert run.status == "not_converged"
    assert "smaller" in run.message
    assert run.n_steps > 10


def test_what_makes_no_sense_is_refused():
    with pytest.raises(TypeError, match="expected a System"):
        fp.time_stepping("typed", [3, 0], (0, 1))
    for n_steps in (0, -1, 1.5):
        with pytest.raises((ValueError, TypeError), match="n_steps"):
            fp.time_stepping(typed, [3, 0], (0, 1), n_steps=n_steps)
    for theta in (0.4, 1.1, np.nan):
        with pytest.raises(ValueError, match="theta"):
            fp.time_stepping(typed, [3, 0], (0, 1), theta=theta)
    with pytest.raises(ValueError, match="x0"):
        fp.time_stepping(typed, [np.nan, 0], (0, 1))
    with pytest.raises(ValueError, match="t_span"):
        fp.time_stepping(typed, [3, 0], (0, np.inf))
    with pytest.raises(ValueError, match="params"):
        fp.time_stepping(typed, [3, 0], (0, 1), params={"G": 1})
    with pytest.raises(TypeError, match="compiled model"):
        fp.time_stepping(fp.models.stiction, [0, 0], (0, 1))
    with pytest.raises(ValueError, match="switches"):
        fp.time_stepping(fp.smoothed(typed), [3, 0], (0, 1))
