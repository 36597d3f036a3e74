# SPDX-License-Identifier: BSD-3-Clause
"""What is saved is there whole or not at all, whoever is killed and whoever does the same."""

import contextlib
import os
import random
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

import filippov as fp
from filippov._support.whole import PART, in_the_making, remove_abandoned

BLOCK = fp.models.oscillator

SAVES = """
    import sys
    import filippov as fp
    runs = [fp.simulate(fp.models.oscillator, [k, 0], (0, 40), t_eval=[0, 40]) for k in (0, 1)]
    print("ready", flush=True)
    while True:
        for run in runs:
            run.save(sys.argv[1])
"""


@contextlib.contextmanager
def child(program, *arguments):
    """Run a program, and kill it at the end."""
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(program), *map(os.fspath, arguments)],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


@pytest.fixture(params=[".npz", ".zarr"])
def target(request, tmp_path):
    if request.param == ".zarr":
        pytest.importorskip("zarr")
    return tmp_path / f"run{request.param}"


def known(run):
    """Which of the two runs this is, to the last bit."""
    starts = [fp.simulate(BLOCK, [k, 0], (0, 40), t_eval=[0, 40]) for k in (0, 1)]
    (same,) = [k for k, each in enumerate(starts) if np.array_equal(run.y, each.y)]
    return same


def entries(target):
    inside = sorted(path.name for path in target.iterdir()) if target.is_dir() else []
    return [path.name for path in target.parent.iterdir()], len(inside)


@pytest.mark.skipif(sys.platform == "win32", reason="kills by SIGKILL")
def test_a_killed_save_leaves_what_was_there_or_is_there_now(target):
    random.seed(20261126)
    fp.simulate(BLOCK, [0, 0], (0, 40), t_eval=[0, 40]).save(target)
    whole = entries(target)
    left = 0
    for _ in range(12):
        with child(SAVES, target):
            time.sleep(random.uniform(0.0, 0.06))
        known(fp.load(target))
        left += entries(target) != whole
        fp.simulate(BLOCK, [1, 0], (0, 40), t_eval=[0, 40]).save(target)
        assert entries(target) == whole
        assert known(fp.load(target)) == 1
    assert left > 0  # else nothing was killed in the middle


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills by SIGKILL")
def test_whoever_loads_meanwhile_gets_one_or_the_other(target):
    fp.simulate(BLOCK, [0, 0], (0, 40), t_eval=[0, 40]).save(target)
    whole = entries(target)
    with child(SAVES, target) as first, child(SAVES, target) as second:
        found = {known(fp.load(target)) for _ in range(60)}
        assert first.poll() is second.poll() is None  # neither is disturbed by the other
    assert found == {0, 1}
    fp.simulate(BLOCK, [0, 0], (0, 40), t_eval=[0, 40]).save(target)
    assert entries(target) == whole


def test_a_group_of_an_earlier_version_is_read_and_replaced(tmp_path):
    zarr = pytest.importorskip("zarr")
    run = fp.simulate(BLOCK, [0, 0], (0, 1))
    run.save(tmp_path / "run.zarr")
    # as it was written before: arrays in the group itself
    group = zarr.open_group(tmp_path / "run.zarr", mode="r+")
    data = tmp_path / "run.zarr" / group.attrs["arrays"]
    (data / "zarr.json").unlink()
    for array in data.iterdir():
        array.rename(tmp_path / "run.zarr" / array.name)
    data.rmdir()
    del group.attrs["arrays"]
    np.testing.assert_array_equal(fp.load(tmp_path / "run.zarr").y, run.y)
    run.save(tmp_path / "run.zarr")
    np.testing.assert_array_equal(fp.load(tmp_path / "run.zarr").y, run.y)
    assert len(list((tmp_path / "run.zarr").iterdir())) == 2


def test_a_save_that_fails_leaves_nothing(target, monkeypatch):
    def full(*_, **__):
        raise OSError("no space left on device")

    run = fp.simulate(BLOCK, [0, 0], (0, 1))
    run.save(target)
    whole = entries(target)
    monkeypatch.setattr(np, "savez_compressed", full)
    monkeypatch.setattr("filippov._results.store._write_zarr", full)
    with pytest.raises(OSError, match="no space"):
        fp.simulate(BLOCK, [1, 0], (0, 1)).save(target)
    assert entries(target) == whole
    np.testing.assert_array_equal(fp.load(target).y, run.y)


@pytest.mark.skipif(sys.platform == "win32", reason="there are no locks")
def test_what_somebody_works_on_is_not_taken_for_abandoned(tmp_path):
    for folder in (True, False):
        with in_the_making(tmp_path, folder=folder) as part:
            remove_abandoned(tmp_path)
            assert part.exists()
        assert not part.exists()
    (tmp_path / f"{PART}left").mkdir()
    (tmp_path / f"{PART}left" / "array").write_text("half of it")
    (tmp_path / "thesis.tex").write_text("all of it")
    remove_abandoned(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


CREATES = """
    import sys
    import numpy as np
    import filippov as fp
    y, v = np.meshgrid(np.linspace(-2, 2, 20), np.linspace(-1, 1.5, 11))
    print("ready", flush=True)
    sys.stdin.readline()
    ends = fp.ensemble(fp.models.oscillator, [y, v], (0.0, 20.0), store=sys.argv[1], tile=20)
    print(ends.y.sum().hex(), flush=True)
"""


@pytest.mark.slow
def test_two_processes_that_create_one_store_share_it(tmp_path):
    pytest.importorskip("zarr")
    for turn in range(6):
        store = tmp_path / f"{turn}.zarr"
        both = [
            subprocess.Popen(
                [sys.executable, "-c", textwrap.dedent(CREATES), os.fspath(store)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
            for _ in range(2)
        ]
        assert [each.stdout.readline() for each in both] == ["ready\n"] * 2
        for each in both:
            each.stdin.write("go\n")
            each.stdin.flush()
        sums = [each.communicate()[0] for each in both]
        assert [each.returncode for each in both] == [0, 0]
        assert sums[0] == sums[1] != ""
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{k}.zarr" for k in range(6)]
    assert not any(path.name.startswith(PART) for path in store.iterdir())
