# SPDX-License-Identifier: BSD-3-Clause
import matplotlib.pyplot as plt
import numpy as np
import pytest

import filippov as fp

OSCILLATOR = fp.models.oscillator
SEED = {"A": 3.6, "omega": 1.067}
GRID = {"y": (-4.0, 4.0, 16), "v": (-3.0, 4.0, 16)}
SIZE = np.array([[8.0], [7.0]])


@pytest.fixture(scope="module")
def basins():
    return fp.basins(OSCILLATOR, GRID, params=SEED, audit=0, seeds=32, saddle_starts=36)


@pytest.fixture(scope="module")
def boundary(basins):
    return fp.basin_boundary(basins)


@pytest.fixture(scope="module")
def unstable(basins):
    return fp.unstable_set(basins)


def test_both_sides_of_every_point_have_their_labels(basins, boundary):
    assert boundary.status == "ok"
    assert boundary.unresolved == 0
    assert len(boundary.curves) == 2
    for curve in boundary.curves:
        # `at` runs at 1e-8, and a side is 1e-12 from the boundary: a little aside
        away = (curve.left_points - curve.right_points) / SIZE
        away *= 1e-5 / np.linalg.norm(away, axis=0) * SIZE
        assert (basins.at(curve.points + away)[0] == curve.left).all()
        assert (basins.at(curve.points - away)[0] == curve.right).all()
        sides = np.linalg.norm((curve.left_points - curve.right_points) / SIZE, axis=0)
        assert sides.max() <= 1.001e-12


def test_it_is_the_stable_set_of_the_saddle(basins, boundary):
    saddle = basins.saddles[0].points
    for curve in boundary.curves:
        assert (curve.kind == "stable_set").all()
        assert (curve.saddle == 0).all()
        assert not curve.closed
        assert curve.distance <= 1e-3
        assert curve.coarse == 0
        for k in range(0, curve.kind.size, 17):
            periods = int(curve.periods[k])
            end = fp.strobe_map(OSCILLATOR, curve.points[:, k], iterate=periods, params=SEED).x
            apart = np.linalg.norm((end - saddle[:, 0]) / SIZE[:, 0])
            assert apart < 1e-9
    assert "stable_set" in repr(boundary)


def test_its_corners_are_on_the_belt(boundary):
    # v = 1: a start above the belt and one below it are pushed in different directions
    assert len(boundary.corners) == 3
    for corner in boundary.corners:
        assert corner.position[1] == pytest.approx(1.0, abs=1e-9)
        assert corner.error < 1e-10
        assert abs(corner.turn) > 0.4
        nearest = boundary.curves[corner.curve].points[:, corner.point]
        assert np.abs((nearest - corner.position) / SIZE[:, 0]).max() < 2e-3


def test_the_unstable_set_ends_at_both_attractors(basins, unstable):
    assert unstable.multiplier == pytest.approx(abs(basins.saddles[0].multipliers[0]), rel=1e-9)
    assert sorted(b.attractor for b in unstable.branches) == [1, 2]
    for branch in unstable.branches:
        assert branch.status == "ok"
        assert branch.breaks.size == 0
        np.testing.assert_array_equal(branch.points[:, 0], basins.saddles[0].points[:, 0])
        end = basins.attractors[branch.attractor - 1].points[:, 0]
        assert np.abs(branch.points[:, -1] - end).max() < 8 * 1.5e-4
        # images of its points are on it
        image = fp.strobe_map(OSCILLATOR, branch.points[:, 40], params=SEED).x
        gap = np.linalg.norm((branch.points - image[:, None]) / SIZE, axis=0).min()
        assert gap < 0.01


def test_pictures(basins, boundary, unstable):
    figure, ax = plt.subplots()
    basins.plot(ax)
    before = len(ax.lines)
    artists = boundary.plot(ax, color="blue")
    assert len(artists) == 3  # two curves of one kind, and corners
    assert artists[0].get_color() == "blue"
    np.testing.assert_allclose(artists[0].get_xydata().T, boundary.curves[0].points)
    assert len(artists[-1].get_xdata()) == 3
    artists = unstable.plot(ax)
    assert [len(a.get_xdata()) for a in artists] == [b.points.shape[1] for b in unstable.branches]
    assert len(ax.lines) == before + 5
    assert ax.get_xlim() == (-4.0, 4.0)
    assert len(unstable.plot()) == 2
    plt.close("all")
    assert figure is not None


def test_results_are_kept(boundary, tmp_path):
    boundary.save(tmp_path / "boundary.npz")
    again = fp.load(tmp_path / "boundary.npz")
    np.testing.assert_array_equal(again.curves[1].points, boundary.curves[1].points)
    assert again.corners == boundary.corners


def test_limits_are_statuses(basins):
    seen = []
    few = fp.basin_boundary(
        basins, max_labels=200, progress=lambda done, total: seen.append((done, total))
    )
    assert few.status == "max_steps"
    assert few.labels <= 200
    assert seen[-1] == (few.labels, few.labels)
    assert all((c.kind == "unknown").all() for c in few.curves)
    short = fp.unstable_set(basins, length=0.01)
    assert [b.status for b in short.branches] == ["max_steps"] * 2
    assert [b.attractor for b in short.branches] == [0, 0]


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        ({"width": 0.0}, "width"),
        ({"distance": 1e-13}, "distance"),
        ({"distance": float("nan")}, "distance"),
        ({"turn": 4.0}, "turn"),
        ({"near": 0.0}, "near"),
        ({"max_labels": 0}, "max_labels"),
    ],
)
def test_wrong_arguments(basins, wrong, what):
    with pytest.raises(ValueError, match=what):
        fp.basin_boundary(basins, **wrong)


def test_wrong_saddles(basins):
    with pytest.raises(ValueError, match="saddle = 1"):
        fp.unstable_set(basins, 1)
    with pytest.raises(ValueError, match="point = 1"):
        fp.unstable_set(basins, point=1)
    with pytest.raises(ValueError, match="gap"):
        fp.unstable_set(basins, gap=-1.0)


def test_ctrl_c_keeps_what_is_finished(ctrl_c):
    ctrl_c(
        """
block = fp.models.oscillator.with_params(A=3.6, omega=1.067)
basins = fp.basins(block, {"y": (-4, 4, 16), "v": (-3, 4, 16)}, audit=0, seeds=32)
print("ready", flush=True)
try:
    fp.basin_boundary(basins, distance=1e-6)
except KeyboardInterrupt as e:
    assert e.boundary.status == "interrupted"
    assert len(e.boundary.curves) == 2
    sys.exit(7)
"""
    )
