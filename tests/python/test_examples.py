# SPDX-License-Identifier: BSD-3-Clause
import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def lines(text):
    return [line.rstrip() for line in text.strip().splitlines()]


# explore.py is a page, not a program that prints.
@pytest.mark.parametrize("example", sorted(EXAMPLES.glob("[0-9]*.py")), ids=lambda path: path.stem)
def test_an_example_prints_its_stored_output(example, tmp_path):
    # The twins print the same, unless the Python one has an output of its own.
    stored = [EXAMPLES / "output" / f"{example.stem}{end}" for end in (".py.txt", ".txt")]
    ran = subprocess.run(
        [sys.executable, example],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    for expected in stored:
        if expected.exists():
            assert lines(ran.stdout) == lines(expected.read_text())
            break
