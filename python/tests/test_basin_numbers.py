# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of basins, refinement, and basins over a parameter."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator.with_params(A=3.6, omega=1.067)
GRID = {"y": (-4, 4, 60), "v": (-3, 4, 60)}
QUICK = {"seeds": 32, "saddle_starts": 9, "audit": 40}


@pytest.fixture(scope="module")
def basins():
    return fp.basins(BLOCK, GRID, **QUICK)


def test_points_have_the_labels_of_the_cells_of_which_they_are_the_centres(basins):
    y, v = np.meshgrid(basins.grid.centres(0), basins.grid.centres(1), indexing="ij")
    label, time = basins.at([y, v])
    np.testing.assert_array_equal(label, basins.label)
    np.testing.assert_array_equal(time, basins.time)
    label, time = basins.at(basins.attractors[1].points[:, 0])
    assert (label, time) == (2, 0)
    assert basins.at([np.nan, 0.0])[0] == 0
    with pytest.raises(ValueError, match=r"points = .*shape \(2, \.\.\.\)"):
        basins.at([1.0, 2.0, 3.0])


def test_shares_lie_between_their_bounds(basins):
    finer = fp.basins(BLOCK, {"y": (-4, 4, 240), "v": (-3, 4, 240)}, **QUICK)
    for label, share in basins.bounds.items():
        assert share.low <= basins.fractions[label] <= share.high
        assert share.low <= finer.fractions[label] <= share.high
        assert share.count == np.count_nonzero(basins.label == label)
    sample = {share.label: share for share in basins.sample(4000, level=0.999)}
    for label, share in finer.fractions.items():
        assert sample[label].low <= share <= sample[label].high
    assert sum(share.count for share in sample.values()) == 4000


def test_a_smooth_boundary_has_dimension_one(basins):
    box = basins.boundary_dimension()
    assert abs(box.dimension - 1) < 3 * box.error + 0.05
    exponent = basins.uncertainty_exponent((3e-2, 1e-2, 3e-3), pairs=3000)
    assert abs(exponent.alpha - 1) < 4 * exponent.error
    assert exponent.dimension == pytest.approx(2 - exponent.alpha)
    assert [count.trials for count in exponent.counts] == [3000] * 3
    assert basins.uncertainty_exponent((3e-2, 1e-2, 3e-3), pairs=3000) == exponent
    entropy = basins.entropy()
    assert not entropy.fractal
    assert 0 < entropy.mean < entropy.boundary < np.log(2)
    assert entropy.unresolved == 0


def test_entropy_of_known_pictures(basins):
    import dataclasses

    checkers = np.indices((60, 60)).sum(axis=0) % 2 + 1
    known = dataclasses.replace(basins, label=checkers.astype(np.int32))
    assert known.entropy(2).boundary == pytest.approx(np.log(2))
    assert known.entropy(2).boundary_error < 1e-12
    striped = dataclasses.replace(basins, label=np.full((60, 60), 1, dtype=np.int32))
    assert striped.entropy(2).mean == 0
    assert np.isnan(striped.boundary_dimension().dimension)


def test_a_refined_picture_is_the_picture(basins):
    refined = basins.refine(coarse=32, levels=3)
    full = fp.basins(BLOCK, {"y": (-4, 4, 256), "v": (-3, 4, 256)}, **QUICK)
    assert refined.status == "ok"
    assert refined.shape == (256, 256)
    np.testing.assert_array_equal(refined.paint(), full.label)
    # times only where squares are of the finest level: they jump elsewhere
    finest = refined.squares[:, 0] == 3
    rows, columns = refined.squares[finest, 1:].T
    np.testing.assert_array_equal(refined.time[finest], full.time[rows, columns])
    assert refined.trajectories < 0.15 * 256**2
    assert (refined.audit.points, refined.audit.wrong) == (1000, 0)
    assert 0 < refined.audit.bound < 0.01
    assert refined.paint(64).shape == (64, 64)
    np.testing.assert_array_equal(refined.paint(128), full.label[1::2, 1::2])


def test_a_refined_picture_is_saved(tmp_path, basins):
    refined = basins.refine(coarse=8, levels=2, audit=10)
    refined.save(tmp_path / "refined.npz")
    loaded = fp.load(tmp_path / "refined.npz")
    np.testing.assert_array_equal(loaded.paint(), refined.paint())
    assert repr(loaded) == repr(refined)


def test_a_loaded_picture_labels_points(tmp_path, basins):
    basins.save(tmp_path / "basins.npz")
    loaded = fp.load(tmp_path / "basins.npz")
    points = np.array([[0.3, -2.0], [0.9, 1.0]])
    np.testing.assert_array_equal(loaded.at(points)[0], basins.at(points)[0])
    assert loaded.system == basins.system or loaded.system.name == basins.system.name


def test_pictures_are_drawn(basins):
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2)
    assert len(basins.refine(coarse=8, levels=2, audit=0).plot(axes[0])) == 1
    sweep = fp.follow_basins(BLOCK, GRID | {"y": (-4, 4, 12)}, "A", [3.6, 3.7], **QUICK)
    assert len(sweep.plot(axes[1])) == 2
    plt.close(figure)


@pytest.mark.parametrize(
    ("call", "why"),
    [
        (lambda b: b.entropy(1), "box = 1"),
        (lambda b: b.entropy(61), "box = 61"),
        (lambda b: b.uncertainty_exponent((0.1,)), "epsilons"),
        (lambda b: b.uncertainty_exponent((0.1, 1.5)), r"epsilons\[1\]"),
        (lambda b: b.uncertainty_exponent(pairs=0), "pairs"),
        (lambda b: b.sample(0), "n = 0"),
        (lambda b: b.sample(10, level=1.0), "level"),
        (lambda b: b.refine(coarse=0), "coarse"),
        (lambda b: b.refine(levels=-1), "levels"),
        (lambda b: b.refine(levels=30), "levels"),
        (lambda b: b.refine(audit=-1), "audit"),
        (lambda b: b.refine(full_dimension=float("nan")), "full_dimension"),
    ],
)
def test_what_makes_no_sense_is_refused(basins, call, why):
    with pytest.raises(ValueError, match=why):
        call(basins)


# --- over a parameter -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sweep():
    grid = {"y": (-4, 4, 20), "v": (-3, 4, 20)}
    return fp.follow_basins(BLOCK, grid, "omega", [1.05, 1.06, 1.067, 1.075], **QUICK)


def test_attractors_keep_their_ids(sweep):
    assert sweep.ids == (1, 2)
    assert sweep.fractions.shape == (4, 2)
    np.testing.assert_allclose(np.nansum(sweep.fractions, axis=1), 1)
    for k in range(4):
        alone = fp.basins(
            BLOCK,
            {"y": (-4, 4, 20), "v": (-3, 4, 20)},
            params={"omega": sweep.values[k]},
            times=False,
            **QUICK,
        )
        for label, attractor in enumerate(sweep.labels[k].tolist(), start=1):
            share = alone.fractions.get(label, 0.0)
            assert sweep.fractions[k, sweep.ids.index(attractor)] == pytest.approx(share)
    assert (sweep.low <= sweep.fractions).all()
    assert (sweep.fractions <= sweep.high).all()
    data = sweep.to_xarray()
    assert data["fractions"].dims == ("omega", "attractor")


def test_a_sweep_goes_on_from_its_store(tmp_path, sweep):
    grid = {"y": (-4, 4, 20), "v": (-3, 4, 20)}

    class Stop(Exception):
        pass

    def stop(done, total):
        assert total == 4
        if done == 2:
            raise Stop

    store = tmp_path / "sweep"
    values = sweep.values.tolist()
    with pytest.raises(Stop) as stopped:
        fp.follow_basins(BLOCK, grid, "omega", values, store=store, progress=stop, **QUICK)
    assert stopped.value.sweep.values.tolist() == values[:2]
    kept = {file: file.stat().st_mtime_ns for file in store.iterdir()}
    assert len(kept) == 2
    whole = fp.follow_basins(BLOCK, grid, "omega", values, store=store, **QUICK)
    np.testing.assert_array_equal(whole.fractions, sweep.fractions)
    assert len(list(store.iterdir())) == 4
    assert all(file.stat().st_mtime_ns == when for file, when in kept.items())
    whole.save(tmp_path / "sweep.npz")
    loaded = fp.load(tmp_path / "sweep.npz")
    np.testing.assert_array_equal(loaded.fractions, sweep.fractions)
    assert loaded.ids == sweep.ids


def test_wrong_sweeps_are_refused():
    grid = {"y": (-4, 4, 4), "v": (-3, 4, 4)}
    with pytest.raises(ValueError, match="parameter = 'B'"):
        fp.follow_basins(BLOCK, grid, "B", [1.0])
    with pytest.raises(ValueError, match="values"):
        fp.follow_basins(BLOCK, grid, "A", [])
    with pytest.raises(ValueError, match="values"):
        fp.follow_basins(BLOCK, grid, "A", [np.nan])
    with pytest.raises(ValueError, match="which varies"):
        fp.follow_basins(BLOCK, grid, "A", [1.0], params={"A": 2.0})
    with pytest.raises(ValueError, match="threshold"):
        fp.follow_basins(BLOCK, grid, "A", [1.0], threshold=0)
    with pytest.raises(TypeError):
        fp.follow_basins(BLOCK, grid, "A", [1.0], colour="red")


# --- Ctrl-C ---------------------------------------------------------------------------------------


# Long by the work of a cell, not by the number of cells: handing back what is finished takes time.
LARGE = {"y": (-4, 4, 1000), "v": (-3, 4, 999)}
SLOW = {"method": "dopri5", "rtol": 1e-12, "atol": 1e-12}


@pytest.mark.parametrize(
    "call",
    [
        lambda b: fp.ensemble(BLOCK, np.zeros((2, 500_000)), (0.0, 1000.0)),
        lambda b: fp.cell_map(BLOCK, LARGE, **SLOW),
        lambda b: fp.basins(BLOCK, LARGE, **SLOW),
        lambda b: fp.basins(BLOCK, GRID, distance=1e-300, settle=10**6, seeds=10**5),
        lambda b: b.uncertainty_exponent(pairs=3_000_000),
        lambda b: b.refine(coarse=2000, levels=0, audit=10_000_000),
        lambda b: b.at(np.random.default_rng(1).uniform(-3, 3, (2, 5_000_000))),
    ],
    ids=["ensemble", "cell_map", "basins", "attractors", "pairs", "refine", "points"],
)
def test_ctrl_c_stops_within_a_second(basins, call):
    # a shell starts what runs in its background with Ctrl-C ignored
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert_ctrl_c_stops(lambda: call(basins))
    finally:
        signal.signal(signal.SIGINT, before)


def assert_ctrl_c_stops(call):
    sent = []
    timer = threading.Timer(1.0, lambda: (sent.append(time.monotonic()), _interrupt()))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        call()
    timer.cancel()
    assert sent
    assert time.monotonic() - sent[0] < 2  # a second, and as much for a busy machine


def _interrupt():
    os.kill(os.getpid(), signal.SIGINT)
