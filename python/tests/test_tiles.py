# SPDX-License-Identifier: BSD-3-Clause
"""Long computations tile by tile: stores, kills, clusters. No bit depends on any of it."""

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

import filippov as fp
from filippov._results.tiles import Stage, open_store, run_stage

BLOCK = fp.models.oscillator.with_params(A=3.6, omega=1.067)
GRID = {"y": (-4, 4, 24), "v": (-3, 4, 25)}
QUICK = {"seeds": 32, "saddle_starts": 9, "audit": 40}


@pytest.fixture
def tmp_path(tmp_path):
    """Where stores are written, if there is what writes them (from Python 3.11 on)."""
    pytest.importorskip("zarr")
    return tmp_path


def basins(**kwargs):
    return fp.basins(BLOCK, GRID, **(QUICK | kwargs))


def cell_map(**kwargs):
    return fp.cell_map(BLOCK, GRID, **kwargs)


def ensemble(**kwargs):
    y, v = np.meshgrid(np.linspace(-2, 2, 20), np.linspace(-1, 1.5, 11))
    kwargs = {"params": {"A": np.linspace(0.5, 4, 20)}} | kwargs
    return fp.ensemble(BLOCK, [y, v], (0.0, 20.0), **kwargs)


CALLS = {"basins": basins, "cell_map": cell_map, "ensemble": ensemble}
ARRAYS = {
    "basins": ("label", "time", "status", "plain_group", "plain_steps"),
    "cell_map": ("group", "steps", "image", "status"),
    "ensemble": ("y", "t", "status", "mode", "n_events", "n_slides", "slide_time"),
}


def assert_same(kind, a, b):
    for name in ARRAYS[kind]:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    if kind == "basins":
        for left, right in zip(a.attractors + a.saddles, b.attractors + b.saddles, strict=True):
            np.testing.assert_array_equal(left.points, right.points)
            np.testing.assert_array_equal(left.multipliers, right.multipliers)
        assert (a.periods, a.audited, a.disagreements) == (b.periods, b.audited, b.disagreements)


@pytest.fixture(scope="module")
def whole():
    return {kind: call() for kind, call in CALLS.items()}


@pytest.mark.parametrize("kind", CALLS)
def test_tiles_change_nothing(whole, kind):
    assert_same(kind, CALLS[kind](tile=60), whole[kind])


@pytest.mark.parametrize("kind", CALLS)
def test_a_store_gives_the_same_and_again(tmp_path, whole, kind):
    store = tmp_path / "run.zarr"
    first = CALLS[kind](store=store, tile=60)
    assert_same(kind, first, whole[kind])
    seen = []
    again = CALLS[kind](store=store, tile=60, progress=lambda *now: seen.append(now))
    assert_same(kind, again, whole[kind])
    assert again.stats == first.stats  # of the tiles, whoever ran them
    assert seen == []  # nothing was left to do


def test_a_store_is_a_picture_that_xarray_opens(tmp_path, whole):
    import xarray as xr

    basins(store=tmp_path / "run.zarr", tile=60)
    with xr.open_zarr(tmp_path / "run.zarr", consolidated=False) as data:
        assert data["label"].dims == ("y", "v")
        np.testing.assert_array_equal(data["label"], whole["basins"].label)
        assert data.attrs["filippov_manifest"]["params"]["A"] == 3.6


@pytest.mark.parametrize("kind", CALLS)
def test_an_interrupted_store_is_resumed(tmp_path, whole, kind):
    store = tmp_path / "run.zarr"

    class Stop(Exception):
        pass

    def stop(done, total):
        if done > total // 3:
            raise Stop

    with pytest.raises(Stop) as stopped:
        CALLS[kind](store=store, tile=60, progress=stop)
    assert hasattr(stopped.value, kind)
    seen = []
    resumed = CALLS[kind](store=store, tile=60, progress=lambda *now: seen.append(now))
    assert_same(kind, resumed, whole[kind])
    assert seen[0][0] > 0  # it did not begin at the beginning
    assert all(a[0] <= b[0] for a, b in itertools.pairwise(seen))
    assert seen[-1][0] == seen[-1][1]


SCRIPT = """
    import sys
    import filippov as fp
    fp.basins(
        fp.models.oscillator.with_params(A=3.6, omega=1.067),
        {"y": (-4, 4, 120), "v": (-3, 4, 100)},
        seeds=32, saddle_starts=9, audit=40, store=sys.argv[1], tile=400, threads=1,
        progress=lambda done, total: print(done, flush=True),
    )
"""


def test_a_killed_run_is_resumed(tmp_path):
    store = tmp_path / "run.zarr"
    for least in (3000, 15_000):  # in the images, in the labels
        run = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(SCRIPT), os.fspath(store)],
            stdout=subprocess.PIPE,
            text=True,
        )
        for line in run.stdout:
            if int(line) >= least:
                break
        run.send_signal(signal.SIGKILL)
        run.wait()
        run.stdout.close()
    sizes = {"y": (-4, 4, 120), "v": (-3, 4, 100)}
    seen = []
    resumed = fp.basins(
        BLOCK, sizes, **QUICK, store=store, tile=400, progress=lambda *now: seen.append(now)
    )
    assert seen[0][0] >= 12_000 + 2000  # of what was labelled a tile or two at most were lost
    assert_same("basins", resumed, fp.basins(BLOCK, sizes, **QUICK))


def test_other_settings_are_refused(tmp_path):
    store = tmp_path / "run.zarr"
    cell_map(store=store)
    for name, other in {
        "settings.rtol": {"rtol": 1e-7},
        "settings.method": {"method": "dopri5"},
        "params.A": {"params": {"A": 3.5}},
        "t0": {"t0": 0.5},
        "periods": {"periods": 2},
        "escape": {"escape": 100.0},
        "rows_of_a_tile": {"tile": 30},
    }.items():
        with pytest.raises(ValueError, match=rf"made with {name}"):
            cell_map(store=store, **other)
    with pytest.raises(ValueError, match=r"made with kind = 'cell_map', expected 'basins'"):
        basins(store=store)
    with pytest.raises(ValueError, match="grid"):
        fp.cell_map(BLOCK, GRID | {"y": (-4, 4, 25)}, store=store)
    other = tmp_path / "members.zarr"
    ensemble(store=other)
    with pytest.raises(ValueError, match="made with members"):
        ensemble(store=other, params={"A": np.linspace(0.5, 4.1, 20)})


def test_other_systems_are_refused(tmp_path):
    store = tmp_path / "run.zarr"
    x0 = np.zeros((2, 3))
    fp.ensemble(fp.models.coulomb, x0, (0.0, 1.0), store=store)
    with pytest.raises(ValueError, match=r"made with system\.name"):
        fp.ensemble(BLOCK, x0, (0.0, 1.0), store=store)


def test_what_is_no_store_is_refused_and_left_alone(tmp_path):
    expected = "expected a directory that does not exist yet, or a store of the same run"
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "text").write_text("mine")
    with pytest.raises(ValueError, match=expected):
        cell_map(store=folder)
    assert [file.name for file in folder.iterdir()] == ["text"]
    with pytest.raises(ValueError, match=expected):
        cell_map(store=folder / "text")
    assert (folder / "text").read_text() == "mine"
    import zarr

    zarr.open_group(tmp_path / "foreign.zarr", mode="w")
    with pytest.raises(ValueError, match=expected):
        cell_map(store=tmp_path / "foreign.zarr")


def _truncated(chunk):
    chunk.write_bytes(chunk.read_bytes()[:5])


def _flipped(chunk):
    text = bytearray(chunk.read_bytes())
    text[-1] ^= 1
    chunk.write_bytes(bytes(text))


@pytest.mark.parametrize("damage", [_truncated, _flipped, lambda chunk: chunk.unlink()])
@pytest.mark.parametrize("kind", CALLS)
def test_a_damaged_store_is_no_result(tmp_path, kind, damage):
    import zarr

    store = tmp_path / "run.zarr"
    CALLS[kind](store=store, tile=60)
    chunks = [
        next(path for path in (store / name / "c").rglob("*") if path.is_file())
        for name, array in zarr.open_group(store, mode="r").arrays()
        if not name.endswith("_done") and array.size
    ]
    assert chunks
    for chunk in chunks:
        text = chunk.read_bytes()
        damage(chunk)
        with pytest.raises(ValueError, match=r"store = .*run\.zarr.*nobody has changed"):
            CALLS[kind](store=store, tile=60)
        chunk.write_bytes(text)


def test_a_store_whose_sums_were_changed_is_no_result(tmp_path):
    import zarr

    store = tmp_path / "run.zarr"
    cell_map(store=store, tile=60)
    group = zarr.open_group(store, mode="r+")
    (name,) = (name for name, _ in group.arrays() if name.endswith("_done"))
    group[name][1, -1] += 1
    with pytest.raises(ValueError, match=r"tile 1 of .* is not as it was written"):
        cell_map(store=store, tile=60)


def test_a_tile_of_nothing_but_another_nan_is_kept(tmp_path):
    of_x86 = np.full(4, 0xFFF8000000000000, dtype=np.uint64).view(float)  # 0/0 there
    _, tiling = open_store(tmp_path / "run.zarr", "test", dict, 4, 1, 4)
    for _ in range(2):
        store, _ = open_store(tmp_path / "run.zarr", "test", dict, 4, 1, 4)
        outputs = {"a": np.full(4, np.nan)}
        stage = Stage("only", lambda *_: {"a": of_x86.copy()}, outputs)
        arrays, _, raised = run_stage(stage, tiling, store, None)
        assert raised is None
        np.testing.assert_array_equal(arrays["a"].view(np.uint64), of_x86.view(np.uint64))


@pytest.mark.parametrize("kind", CALLS)
def test_a_saved_result_is_loaded(tmp_path, whole, kind):
    path = tmp_path / "result.npz"
    whole[kind].save(path)
    loaded = fp.load(path)
    assert type(loaded) is type(whole[kind])
    assert_same(kind, loaded, whole[kind])
    assert repr(loaded) == repr(whole[kind])
    assert loaded.settings == whole[kind].settings
    assert dict(loaded.params).keys() == dict(whole[kind].params).keys()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # the cluster's own
def test_a_cluster_gives_the_same(tmp_path, whole):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster),
    ):
        for kind, call in CALLS.items():
            seen = []
            store = tmp_path / f"{kind}.zarr"
            result = call(tile=100, store=store, progress=lambda *now, seen=seen: seen.append(now))
            assert_same(kind, result, whole[kind])
            assert seen[-1][0] == seen[-1][1]
        assert_same("basins", basins(tile=100, times=False), basins(times=False))
    # begun on a cluster, read without
    assert_same("basins", basins(tile=100, store=tmp_path / "basins.zarr"), whole["basins"])


def _in_child(queue):
    queue.put(fp.ensemble(BLOCK, np.zeros((2, 50)), (0.0, 5.0)).y)


def test_a_fork_after_use_does_not_hang():
    here = fp.ensemble(BLOCK, np.zeros((2, 50)), (0.0, 5.0)).y
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    child = context.Process(target=_in_child, args=(queue,))
    child.start()
    begun = time.monotonic()
    while queue.empty() and time.monotonic() - begun < 60:
        time.sleep(0.05)
    alive = queue.empty()
    if alive:
        child.kill()
    child.join()
    assert not alive
    np.testing.assert_array_equal(queue.get(), here)
