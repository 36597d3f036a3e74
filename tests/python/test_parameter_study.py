# SPDX-License-Identifier: BSD-3-Clause
"""The study of docs/scale.md: killed and started again, it ends with the same bits."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "examples" / "parameter_study.py"
SMALL = ("--points", "6", "--basins", "1", "--cells", "20")

zarr = pytest.importorskip("zarr")
pytest.importorskip("distributed")


def study(folder, *more):
    return [sys.executable, SCRIPT, *SMALL, "--store", folder, *more]


def arrays(folder):
    chart = zarr.open_group(folder / "chart.zarr", mode="r")
    basins = zarr.open_group(next(folder.glob("basins_*.zarr")), mode="r")
    kept = {name: chart[name][:] for name in ("A", "omega", "turns", "slides", "multiplier")}
    return kept | {"label": basins["label"][:], "seconds": np.isfinite(chart["seconds"][:])}


def test_a_killed_study_goes_on_and_ends_with_the_same_bits(tmp_path):
    picture = tmp_path / "study.png"
    plain = subprocess.run(
        study(tmp_path / "plain", "--picture", picture),
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert plain.returncode == 0, plain.stderr
    assert picture.read_bytes().startswith(b"\x89PNG")

    killed = subprocess.Popen(
        study(tmp_path / "killed"), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    rows = 0
    for line in killed.stdout:
        rows += line.startswith("row")
        if rows == 2:
            break
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    killed.stdout.close()
    again = subprocess.run(
        study(tmp_path / "killed"), capture_output=True, text=True, timeout=280, check=False
    )
    assert again.returncode == 0, again.stderr
    first = again.stdout.splitlines()[0]
    assert int(first.split()[0]) >= 2, first
    assert first.endswith("of 6 rows are in the store"), first
    expected = arrays(tmp_path / "plain")
    for name, values in arrays(tmp_path / "killed").items():
        np.testing.assert_array_equal(values, expected[name], err_msg=name)

    other = subprocess.run(
        [*study(tmp_path / "plain"), "--points", "7"],
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert other.returncode == 2
    assert "holds another chart" in other.stderr
