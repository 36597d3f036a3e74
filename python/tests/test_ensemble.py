# SPDX-License-Identifier: BSD-3-Clause
import os
import subprocess
import sys

import numpy as np
import pytest

import filippov as fp

OSCILLATOR = fp.models.oscillator
SEED = {"A": 3.6, "omega": 1.067}


def grid(n):
    return np.meshgrid(np.linspace(-4, 4, n), np.linspace(-3, 4, n), indexing="ij")


def test_members_end_where_single_runs_end():
    y, v = grid(5)
    ends = fp.ensemble(OSCILLATOR, [y, v], (0.3, 9.0), params=SEED, rtol=1e-9, atol=1e-9)
    assert ends.y.shape == (2, 5, 5)
    assert ends.success
    for i in range(5):
        for j in range(5):
            run = fp.simulate(
                OSCILLATOR, [y[i, j], v[i, j]], (0.3, 9.0), params=SEED, rtol=1e-12, atol=1e-12
            )
            changes = run.events["mode_before"] != run.events["mode_after"]
            np.testing.assert_allclose(ends.y[:, i, j], run.y[:, -1], atol=1e-6)
            assert ends.n_events[i, j] == changes.sum()
            assert ends.t[i, j] == pytest.approx(9.0)


def test_every_member_has_its_own_parameters_and_times():
    A = np.array([0.5, 1.0, 2.0])
    t_end = np.array([[5.0], [11.0]])
    ends = fp.ensemble(OSCILLATOR, [0.0, 0.0], (0.0, t_end), params={"A": A})
    assert ends.shape == (2, 3)
    for i, t in enumerate(t_end[:, 0]):
        for j, a in enumerate(A):
            run = fp.simulate(OSCILLATOR, [0.0, 0.0], (0.0, t), params={"A": a}, rtol=1e-10)
            np.testing.assert_allclose(ends.y[:, i, j], run.y[:, -1], atol=1e-6)


def test_the_number_of_threads_changes_no_bit():
    y, v = grid(40)
    one, two = (
        fp.ensemble(OSCILLATOR, [y, v], (0.0, 12.0), params=SEED, threads=n) for n in (1, 2)
    )
    assert (one.y == two.y).all()
    assert (one.n_events == two.n_events).all()


def test_a_member_that_fails_spoils_no_other():
    ends = fp.ensemble(OSCILLATOR, [[0.0, np.nan, 1.0], [0.0, 0.0, 0.0]], (0.0, 5.0))
    assert ends.status.tolist() == ["ok", "not_finite", "ok"]
    good = fp.ensemble(OSCILLATOR, [[0.0, 1.0], [0.0, 0.0]], (0.0, 5.0))
    assert (ends.y[:, [0, 2]] == good.y).all()


def test_members_escape():
    ends = fp.ensemble(OSCILLATOR, [[0.0, 50.0], [0.0, 0.0]], (0.0, 50.0), escape=[20.0, 100.0])
    assert ends.status.tolist() == ["ok", "escaped"]
    assert ends.t[1] < 50.0


def test_a_member_that_fails_beyond_its_bounds_has_escaped():
    # w is infinite at t = 1, and with jumps there are no lanes: bounds are looked at in the end
    @fp.system(state="x v w", jumps={"ground": ("x", lambda t, s, p: (s.x, -s.v, s.w))})
    def ball(t, s, p):
        return s.v, -1.0, s.w**2

    start = [1.0, 0.0, 1.0]
    assert fp.ensemble(ball, start, (0.0, 2.0)).status.item() not in ("ok", "escaped")
    ends = fp.ensemble(ball, start, (0.0, 2.0), escape=100.0)
    assert ends.status.item() == "escaped"
    assert ends.t.item() == pytest.approx(1.0, abs=1e-2)


def test_a_system_without_closed_slides_and_one_with_two_surfaces():
    for system, start in ((fp.models.relay, [0.3, 0.2, 0.1]), (fp.models.dieci_lopez_2, None)):
        x0 = np.full(system.dim, 0.1) if start is None else np.array(start)
        ends = fp.ensemble(system, x0, (0.0, 3.0))
        run = fp.simulate(system, x0, (0.0, 3.0), rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(ends.y, run.y[:, -1], atol=1e-6)


def test_arguments_that_make_no_sense_are_refused():
    with pytest.raises(ValueError, match=r"x0 = .*expected an array of shape \(2, ...\)"):
        fp.ensemble(OSCILLATOR, [0.0, 0.0, 0.0], (0.0, 1.0))
    with pytest.raises(ValueError, match="t_span"):
        fp.ensemble(OSCILLATOR, [0.0, 0.0], (0.0, np.nan))
    with pytest.raises(ValueError, match="params"):
        fp.ensemble(OSCILLATOR, [0.0, 0.0], (0.0, 1.0), params={"B": np.ones(3)})
    with pytest.raises(ValueError, match="x0, t_span, params: shape mismatch"):
        fp.ensemble(OSCILLATOR, np.zeros((2, 3)), (0.0, np.ones(4)))
    with pytest.raises(ValueError, match="escape"):
        fp.ensemble(OSCILLATOR, [0.0, 0.0], (0.0, 1.0), escape=-1.0)
    with pytest.raises(TypeError, match="expected a System"):
        fp.ensemble("oscillator", [0.0, 0.0], (0.0, 1.0))


def test_progress_is_told_in_members():
    seen = []
    y, v = grid(30)
    fp.ensemble(
        OSCILLATOR, [y, v], (0.0, 1.0), progress=lambda done, total: seen.append((done, total))
    )
    assert seen[-1] == (900, 900)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_as_xarray():
    y, v = grid(3)
    data = fp.ensemble(OSCILLATOR, [y, v], (0.0, 1.0)).to_xarray()
    assert data["y"].dims == ("state", "axis_0", "axis_1")
    assert data.attrs["system"] == "oscillator"


LEVEL = """
import numpy as np, filippov as fp
y, v = np.meshgrid(np.linspace(-4, 4, 20), np.linspace(-3, 4, 20))
ends = fp.ensemble(fp.models.oscillator, [y, v], (0, 12), params={"A": 3.6, "omega": 1.067})
print(ends.instruction_set, repr(float(ends.y.sum())), int(ends.n_events.sum()))
"""


@pytest.mark.parametrize("level", ["baseline", "avx2", "avx512"])
def test_every_instruction_set_gives_the_same_but_for_rounding(level):
    from filippov._runs.lanes import instruction_sets

    if level not in instruction_sets():
        pytest.skip("the processor has no such registers, or lanes were not compiled for them")
    run = subprocess.run(
        [sys.executable, "-c", LEVEL],
        env=os.environ | {"FILIPPOV_SIMD": level},
        capture_output=True,
        text=True,
        check=True,
    )
    name, total, events = run.stdout.split()
    y, v = np.meshgrid(np.linspace(-4, 4, 20), np.linspace(-3, 4, 20))
    here = fp.ensemble(OSCILLATOR, [y, v], (0, 12), params=SEED)
    assert name == level
    assert int(events) == here.n_events.sum()
    # 400 members, each within some tolerances of 1e-8
    assert float(total) == pytest.approx(float(here.y.sum()), abs=1e-4)


def test_an_unknown_instruction_set_is_refused():
    run = subprocess.run(
        [sys.executable, "-c", LEVEL],
        env=os.environ | {"FILIPPOV_SIMD": "sse9"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode != 0
    assert "FILIPPOV_SIMD = 'sse9': expected one of baseline" in run.stderr


@pytest.mark.parametrize("tile", [None, 3])
@pytest.mark.parametrize(
    ("given", "shape"),
    [
        ({"x0": np.zeros((2, 0))}, (0,)),
        ({"x0": np.zeros((2, 0, 3))}, (0, 3)),
        ({"params": {"A": np.zeros(0)}}, (0,)),
        ({"t_span": (0.0, np.zeros(0))}, (0,)),
    ],
)
def test_no_starts_make_an_empty_ensemble(tmp_path, given, shape, tile):
    arguments = {"x0": [0.0, 0.0], "t_span": (0.0, 1.0)} | given
    ends = fp.ensemble(OSCILLATOR, **arguments, tile=tile)
    assert ends.shape == ends.t.shape == ends.mode.shape == shape
    assert ends.y.shape == ends.y0.shape == (2, *shape)
    assert "0 members" in repr(ends)
    ends.save(tmp_path / "ends.npz")
    assert fp.load(tmp_path / "ends.npz").shape == shape


def test_no_starts_are_kept_in_a_store(tmp_path):
    pytest.importorskip("zarr")
    for _ in range(2):  # made, then taken from there
        ends = fp.ensemble(OSCILLATOR, np.zeros((2, 0)), (0.0, 1.0), store=tmp_path / "run.zarr")
        assert ends.y.shape == (2, 0)
    assert fp.ensemble(fp.models.two_blocks, np.zeros((4, 0)), (0.0, 1.0)).mode.shape == (4, 0)


def test_ends_of_a_system_without_surfaces_are_drawn():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    smooth = fp.smoothed(OSCILLATOR, c1=10.0)
    (points,) = fp.ensemble(smooth, np.zeros((2, 3)), (0.0, 0.1)).plot()
    assert points.get_xdata().size == 3
    assert fp.ensemble(smooth, np.zeros((2, 0)), (0.0, 0.1)).plot() == []
    plt.close("all")
