# SPDX-License-Identifier: BSD-3-Clause
"""The comparison with scipy, `bench/against_scipy.py`."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")

BENCH = Path(__file__).resolve().parents[2] / "bench"


@pytest.fixture
def against_scipy(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCH))
    return importlib.import_module("against_scipy")


@pytest.mark.slow
def test_both_programs_agree_and_the_tables_are_written(tmp_path, against_scipy):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{against_scipy.BEGIN}\nold\n{against_scipy.END}\nafter\n")
    script = [sys.executable, str(BENCH / "against_scipy.py"), "--quick", "--write", str(page)]
    run = subprocess.run(script, capture_output=True, text=True, check=False, env=os.environ)
    assert run.returncode == 0, run.stderr
    written = page.read_text()
    assert run.stdout.strip() in written
    assert written.startswith("before\n")
    assert written.endswith("\nafter\n")
    assert "old" not in written
    lines, times = (
        [row.split(" | ") for row in part.splitlines()[2:]] for part in run.stdout.split("\n\n")[:2]
    )
    ours, theirs = np.array([[int(cell.strip(" |")) for cell in row[1:]] for row in lines]).T
    assert ours[-1] == ours[:-1].sum() < theirs[-1] == theirs[:-1].sum()
    assert [row[0].split()[1] for row in times] == ["trajectory", "diagram", "images", "basins"]


def test_a_disagreement_is_found(monkeypatch, against_scipy):
    trajectory = against_scipy.make_jobs(quick=True)[:1]
    monkeypatch.setattr(against_scipy, "make_jobs", lambda quick: trajectory)
    slip_field = against_scipy.by_scipy.slip_field
    monkeypatch.setattr(
        against_scipy.by_scipy,
        "slip_field",
        lambda side, A, omega: slip_field(side, A * (1 + 1e-5), omega),
    )
    _, wrong = against_scipy.compare(quick=True)
    assert [words.split(":")[0] for words in wrong] == ["trajectory", "trajectory"]
    assert "references" in wrong[0]
    assert "scipy does not reach 1e-06" in wrong[1]


def test_labels_are_compared_whatever_the_attractors_are_called(against_scipy):
    a = np.array([[1, 1, 2], [2, 2, 3]])
    assert against_scipy.between_labels(a, np.array([[2, 2, 3], [3, 3, 1]])) == 0
    assert against_scipy.between_labels(a, np.array([[2, 2, 3], [3, 2, 1]])) == 1
    assert against_scipy.between_labels(a, np.ones_like(a)) == 3


def test_points_of_diagrams_are_compared_on_the_circle(against_scipy):
    a = np.array([[2.9, 2.9, 2.94], [0.001, 3.0, 1.0]])
    b = np.array([[2.9, 2.9, 2.94], [3.0, 2 * np.pi - 0.001, 1.0005]])
    assert against_scipy.between_diagrams(a, b) == pytest.approx(0.002)
    assert against_scipy.between_diagrams(a, b[:, :2]) == np.inf


def test_only_code_is_counted(tmp_path, against_scipy):
    module = type(sys)("counted")
    module.__file__ = str(tmp_path / "counted.py")
    Path(module.__file__).write_text(
        '"""Two\nlines."""\n\nimport math  # counts\n\n\n# does not\n'
        'def job(x):\n    """Neither this."""\n\n    return math.sin(\n        x,\n    )\n'
    )
    assert against_scipy.lines_of(module, ["job"]) == [1, 4, 5]
