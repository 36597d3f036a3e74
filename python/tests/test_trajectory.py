# SPDX-License-Identifier: BSD-3-Clause
import dataclasses
import itertools
import time

import numpy as np
import pytest

import filippov as fp

OSCILLATOR = fp.models.oscillator


@pytest.fixture(scope="module")
def run():
    return fp.simulate(OSCILLATOR, [0, 0], (0, 50))


def test_fields_have_the_shapes_of_scipy(run):
    n = run.t.size
    assert run.t.shape == (n,)
    assert run.y.shape == (2, n)
    assert run.mode.shape == (n,)
    assert run.status is fp.Status.ok
    assert run.success
    assert run.nfev == run.stats.field > 0
    assert "end of the time span" in run.message
    assert run.t[0] == 0
    assert run.t[-1] == 50


def test_it_is_frozen(run):
    with pytest.raises(dataclasses.FrozenInstanceError):
        run.t = None


def test_it_knows_where_it_comes_from(run):
    assert run.system is OSCILLATOR
    assert run.params == OSCILLATOR.params
    assert run.settings.method == "dopri5"
    assert run.settings.atol == (1e-10, 1e-10)
    assert run.stats.steps == run.t.size - 1


def test_repr_is_one_short_line(run):
    text = repr(run)
    assert "\n" not in text
    assert len(text) < 200
    assert "oscillator" in text
    assert "enter_sliding" in text
    assert "ok" in text


def test_sol_gives_exactly_the_points(run):
    np.testing.assert_array_equal(run.sol(run.t), run.y)
    np.testing.assert_array_equal(run.sol.ts, run.t)
    assert (run.sol.t_min, run.sol.t_max) == (0, 50)


def test_sol_takes_a_number_or_an_array(run):
    assert run.sol(1.5).shape == (2,)
    assert run.sol([1.5]).shape == (2, 1)
    assert run.sol(np.linspace(0, 50, 7)).shape == (2, 7)
    assert run.sol([]).shape == (2, 0)
    assert run.sol.mode(0.1) == run.sol.mode([0.1])[0] == -1
    assert f"{run.stats.steps} steps" in repr(run.sol)


@pytest.mark.parametrize("t", [-1e-9, 50.0001, np.nan, [1, 51]])
def test_sol_refuses_times_outside(run, t):
    with pytest.raises(ValueError, match=r"expected a time in \[0.0, 50.0\]"):
        run.sol(t)


def test_sol_stays_on_the_surface_in_a_slide(run):
    t = np.linspace(0, 50, 5001)
    slides = run.sol.mode(t) == 0
    assert slides.any()
    v = run.sol(t[slides])[1]
    assert (v == 1).all()


def test_sol_is_as_accurate_as_the_steps():
    loose = fp.simulate(OSCILLATOR, [0, 0], (0, 20), rtol=1e-8)
    tight = fp.simulate(OSCILLATOR, [0, 0], (0, 20), rtol=1e-13, atol=1e-14, method="dop853")
    t = np.linspace(0, 20, 997)
    # some ten times the tolerance gathers over the run; the interpolant must not add to it
    at_steps = np.abs(loose.y - tight.sol(loose.t)).max()
    between = np.abs(loose.sol(t) - tight.sol(t)).max()
    assert between < 20 * at_steps < 1e-5


def test_s_is_the_force_over_its_maximum_in_stick_and_the_side_in_slip(run):
    t = np.linspace(0, 50, 2001)
    s, mode = run.s(t), run.sol.mode(t)
    np.testing.assert_array_equal(s[mode != 0], mode[mode != 0])
    y = run.sol(t)[0]
    force = 0.5 * np.cos(2.94 * t) - y
    np.testing.assert_allclose(s[mode == 0], force[mode == 0] / 4, atol=1e-12)
    assert np.abs(s).max() <= 1 + 1e-9
    assert isinstance(run.s(0.1), float)


def test_s_of_two_surfaces_has_two_rows():
    run = fp.simulate(fp.models.dieci_lopez_2, [0.04, -0.01, -0.02], (0, 0.5))
    s = run.s([0.1, 0.4])
    assert s.shape == (2, 2)
    assert s[:, 0].tolist() == [-1, -1]
    assert -1 < s[0, 1] < 1
    assert s[1, 1] == -1
    assert run.s(0.4).tolist() == s[:, 1].tolist()
    assert run.sol.mode(0.4).tolist() == [0, -1]


class TestTEval:
    def test_equals_sol_bit_for_bit(self, run):
        t = np.linspace(0, 50, 333)
        for dense in (False, True):
            at = fp.simulate(OSCILLATOR, [0, 0], (0, 50), t_eval=t, dense_output=dense)
            np.testing.assert_array_equal(at.t, t)
            np.testing.assert_array_equal(at.y, run.sol(t))
            np.testing.assert_array_equal(at.mode[1:], run.sol.mode(t)[1:])
            np.testing.assert_array_equal(at.events, run.events)

    def test_the_ends_are_the_ends(self, run):
        at = fp.simulate(OSCILLATOR, [0, 0], (0, 50), t_eval=[0, 50])
        np.testing.assert_array_equal(at.y, run.y[:, [0, -1]])

    def test_may_be_empty_or_repeat(self):
        assert fp.simulate(OSCILLATOR, [0, 0], (0, 5), t_eval=[]).y.shape == (2, 0)
        twice = fp.simulate(OSCILLATOR, [0, 0], (0, 5), t_eval=[1, 1, 5, 5])
        assert twice.t.tolist() == [1, 1, 5, 5]
        assert (twice.y[:, 0] == twice.y[:, 1]).all()

    @pytest.mark.parametrize("dense", [False, True])
    def test_a_run_that_ends_early_ends_at_its_event(self, dense):
        def g(t, y):
            return t - 2.5

        g.terminal = True
        run = fp.simulate(
            OSCILLATOR, [0, 0], (0, 5), t_eval=[0, 1, 2, 3, 4], events=g, dense_output=dense
        )
        assert run.t == pytest.approx([0, 1, 2, 2.5])
        assert run.t[-1] == run.t_events[0][0] == run.events["t"][-1]
        np.testing.assert_array_equal(run.y[:, -1], run.y_events[0][0])

    def test_without_dense_output_there_is_no_sol(self):
        run = fp.simulate(OSCILLATOR, [0, 0], (0, 5), dense_output=False)
        assert run.sol is None
        with pytest.raises(ValueError, match="dense_output"):
            run.s(1.0)


class TestBackward:
    def test_a_crossing_reverses(self):
        start = [3.0, 0.0]
        tight = {"rtol": 1e-11, "atol": 1e-13}
        there = fp.simulate(fp.models.coulomb, start, (0, 5), **tight)
        back = fp.simulate(fp.models.coulomb, there.y[:, -1], (5, 0.5), **tight)
        assert back.success
        np.testing.assert_allclose(back.y[:, -1], there.sol(0.5), atol=1e-9)
        t = np.linspace(5, 0.5, 40)
        np.testing.assert_allclose(back.sol(t), there.sol(t), atol=1e-9)
        assert (np.diff(back.t) < 0).all()
        at = fp.simulate(fp.models.coulomb, there.y[:, -1], (5, 0.5), t_eval=t, **tight)
        np.testing.assert_array_equal(at.y, back.sol(t))

    def test_a_slide_is_ambiguous(self):
        run = fp.simulate(OSCILLATOR, [0, 1], (5, 0))
        assert run.status == "ambiguous"
        assert not run.success

    def test_pieces_run_backward_too(self):
        run = fp.simulate(fp.models.coulomb, [-2.0, 0.3], (3, 0))
        pieces = list(run.segments())
        assert pieces[0].t[0] == 3
        assert pieces[-1].t[-1] == 0
        assert all((np.diff(piece.t) < 0).all() for piece in pieces)


def test_an_interval_of_no_length_is_its_start():
    run = fp.simulate(OSCILLATOR, [1, 0], (2, 2))
    assert run.success
    assert run.t.tolist() == [2]
    assert run.y.tolist() == [[1], [0]]
    assert run.sol(2).tolist() == [1, 0]
    assert run.sol.mode(2.0) == -1
    assert list(run.segments()) == []


def test_a_failed_run_keeps_its_last_state_and_its_events():
    run = fp.simulate(OSCILLATOR, [0, 0], (0, 1000), max_steps=400)
    assert run.status == "max_steps"
    assert not run.success
    assert run.stats.steps <= 400
    assert run.t[-1] == run.events["t"][-1] == run.sol.t_max
    assert (run.events["kind"] == "enter_sliding").any()
    assert "max_steps" in run.message


def test_max_events_ends_a_run():
    run = fp.simulate(OSCILLATOR, [0, 0], (0, 1000), max_events=3)
    assert run.status == "max_events"
    assert ((run.events["kind"] != "start") & (run.events["kind"] != "end")).sum() == 3


def test_raise_on_failure():
    with pytest.raises(fp.SimulationError, match="maximum number of steps") as caught:
        fp.simulate(OSCILLATOR, [0, 0], (0, 1000), max_steps=400, raise_on_failure=True)
    assert caught.value.trajectory.status == "max_steps"
    assert fp.simulate(OSCILLATOR, [0, 0], (0, 10), raise_on_failure=True).success


class TestSegments:
    @pytest.mark.parametrize("dense", [False, True])
    @pytest.mark.parametrize("t_eval", [None, np.linspace(0, 50, 101)])
    def test_cover_the_run_and_join(self, dense, t_eval):
        run = fp.simulate(OSCILLATOR, [0, 0], (0, 50), dense_output=dense, t_eval=t_eval)
        pieces = list(run.segments())
        assert pieces[0].t[0] == 0
        assert pieces[-1].t[-1] == 50
        for a, b in itertools.pairwise(pieces):
            assert a.t[-1] == b.t[0]
            assert a.mode != b.mode
            np.testing.assert_array_equal(a.y[:, -1], b.y[:, 0])
        assert {piece.mode for piece in pieces} == {-1, 0}
        for piece in pieces:
            assert piece.y.shape == (2, piece.t.size)
            if piece.mode == 0:
                np.testing.assert_array_equal(piece.y[1], 1)

    def test_can_be_refined(self, run):
        coarse = sum(piece.t.size for piece in run.segments())
        fine = sum(piece.t.size for piece in run.segments(points_per_step=5))
        assert 4 * coarse < fine < 5.5 * coarse
        with pytest.raises(ValueError, match="points_per_step = 0"):
            list(run.segments(0))


def pieces_one_by_one(run, per_step):
    """What `segments` gives, as it is defined: for each stretch all times are looked at."""
    log = run.events
    changed = (log["mode_before"] != log["mode_after"]).reshape(len(log), -1).any(axis=1)
    changed |= log["kind"] == "jump"
    changed[[0, -1]] = True
    t = run.t
    if run.sol is not None:
        parts = np.arange(per_step) / per_step
        t = run.sol.ts
        t = np.append((t[:-1, None] + np.diff(t)[:, None] * parts).ravel(), t[-1])
    for first, last in itertools.pairwise(log[changed]):
        if first["t"] == last["t"]:
            continue
        low, high = sorted([first["t"], last["t"]])
        inside = (t > low) & (t < high)
        y = run.y[:, inside] if run.sol is None else run.sol(t[inside])
        yield (
            np.concatenate([[first["t"]], t[inside], [last["t"]]]),
            np.column_stack([first["x_right"], y, last["x_left"]]),
            first["mode_after"].tolist(),
        )


@fp.system("c x", jumps={"tick": ("1 - c", lambda t, s, p: (s.c - 1, s.x))})
def clock(t, s, p):
    return 1, np.cos(t)


@pytest.mark.parametrize("per_step", [1, 3])
@pytest.mark.parametrize(
    ("system", "x0", "t_span", "settings"),
    [
        (OSCILLATOR, [0, 0], (0, 50), {}),
        (OSCILLATOR, [0, 0], (0, 50), {"dense_output": False}),
        (OSCILLATOR, [0, 0], (0, 50), {"dense_output": False, "t_eval": [0.0, 7.0, 7.5, 50.0]}),
        (fp.models.coulomb, [-2.0, 0.3], (3, 0), {}),
        (fp.models.coulomb, [-2.0, 0.3], (3, 0), {"dense_output": False}),
        (fp.models.bouncing_ball, [1, 0], (0, 10), {}),
        (fp.models.dieci_lopez_2, [0.04, -0.01, -0.02], (0, 0.4), {}),
        (clock, [0, 0], (0, 20.5), {}),
        (clock, [0, 0], (0, 20.5), {"dense_output": False, "t_eval": np.arange(21.0)}),
        (OSCILLATOR, [0, 0], (0, 1000), {"max_steps": 400}),
    ],
)
def test_segments_are_those_that_one_finds_one_by_one(system, x0, t_span, settings, per_step):
    run = fp.simulate(system, x0, t_span, **settings)
    found = list(run.segments(per_step))
    wanted = list(pieces_one_by_one(run, per_step))
    assert len(found) == len(wanted) > 0
    for piece, (t, y, mode) in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(piece.t, t)
        np.testing.assert_array_equal(piece.y, y)
        assert np.array_equal(piece.mode, mode)


def test_segments_of_many_events_take_time_in_proportion():
    """A hundred thousand jumps took minutes when every stretch looked at all times."""
    run = fp.simulate(clock, [0, 0], (0, 100_000.5), max_step=1.0)
    assert (run.events["kind"] == "jump").sum() == 100_000
    began = time.perf_counter()
    each = sum(1 for _ in run.segments())
    assert each == 100_001
    assert time.perf_counter() - began < 5.0  # 0.2 s where nothing else runs


def test_event_table_is_readable(run):
    lines = run.event_table().splitlines()
    assert len(lines) == run.events.size + 1
    assert lines[0].split() == ["t", "event", "mode", "y", "v", "s"]
    assert lines[1].split()[:3] == ["0.000000000", "start", "-1"]
    assert "-1 -> 0" in lines[2]
    assert run.event_table(last=2).splitlines()[-1].split() == lines[-1].split()
    assert len(run.event_table(last=2).splitlines()) == 3
    assert run.event_table(digits=2).splitlines()[-1].split()[0] == "50.00"
    assert len(run.event_table(last=10**6).splitlines()) == len(lines)


def test_event_table_names_surfaces_where_there_are_several():
    run = fp.simulate(fp.models.dieci_lopez_2, [0.04, -0.01, -0.02], (0, 0.4))
    header, _, enter, _ = run.event_table().splitlines()
    assert header.split()[2] == "surface"
    assert enter.split()[1:4] == ["enter_sliding", "0", "-1,-1"]
