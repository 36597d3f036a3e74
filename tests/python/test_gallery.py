# SPDX-License-Identifier: BSD-3-Clause
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHAPTER = ROOT / "examples" / "chapter"
SCRIPTS = sorted(CHAPTER.glob("fig_*.py"))


def run(*command, cwd):
    return subprocess.run(
        [sys.executable, *command],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_figure_is_drawn_and_prints_its_stored_numbers(script, tmp_path):
    ran = run(script, "--quick", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    expected = (ROOT / "examples" / "output" / "chapter" / f"{script.stem}.txt").read_text()
    assert ran.stdout.splitlines() == expected.splitlines()
    picture = (tmp_path / f"{script.stem}.png").read_bytes()
    assert picture.startswith(b"\x89PNG")


def test_every_figure_of_the_chapter_stands_in_the_gallery_and_is_small():
    assert [path.stem for path in SCRIPTS] == [f"fig_4_{k:02}" for k in range(1, 17)]
    page = (ROOT / "docs" / "gallery.md").read_text()
    for script in SCRIPTS:
        assert f"(images/gallery/{script.stem}.png)" in page
        assert f"examples/chapter/{script.name}" in page
        picture = ROOT / "docs" / "images" / "gallery" / f"{script.stem}.png"
        assert picture.stat().st_size < 100_000


def test_all_counts_the_figures_that_fail_and_draws_the_others(tmp_path):
    for name in ("all.py", "figure.py", "fig_4_01.py"):
        shutil.copy(CHAPTER / name, tmp_path)
    (tmp_path / "fig_4_02.py").write_text("raise SystemExit('no figure')")
    ran = run("all.py", "--out", "drawn", cwd=tmp_path)
    assert ran.returncode == 1
    assert re.search(r"figure 4\.2 .* failed\nno figure", ran.stdout)
    assert (tmp_path / "drawn" / "fig_4_01.png").exists()
    one = run("all.py", "--only", "4.1", "--out", "one", cwd=tmp_path)
    assert one.returncode == 0
    assert "1 of 1 figures" in one.stdout
