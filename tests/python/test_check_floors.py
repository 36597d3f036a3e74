# SPDX-License-Identifier: BSD-3-Clause
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "check_floors.py"
HEAD = "// SPDX-License-Identifier: BSD-3-Clause\n#pragma once\n"


def check(folder):
    return subprocess.run(
        [sys.executable, SCRIPT, folder], capture_output=True, text=True, check=False
    )


@pytest.fixture
def house(tmp_path):
    for name in ("version", "scalar", "system", "sliding"):
        (tmp_path / f"{name}.hpp").write_text(HEAD)
    return tmp_path


def test_lower_floors_third_party_and_std_are_accepted(house):
    (house / "system.hpp").write_text(
        HEAD + "#include <filippov/scalar.hpp>\n#include <Eigen/Core>\n#include <array>\n"
    )
    assert check(house).returncode == 0


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("scalar", HEAD + "#include <filippov/system.hpp>\n", "(floor 0) includes"),
        ("scalar", HEAD + "#  include <filippov/system.hpp>\n", "(floor 0) includes"),
        ("scalar", HEAD + '#include "version.hpp"\n', "write <filippov/...>"),
        ("scalar", HEAD + "#include <gsl/gsl_math.h>\n", "only Eigen and the standard library"),
        ("scalar", HEAD + "#include <math.h>\n", "no header of the C++ standard library"),
        ("scalar", HEAD + "#include <omp.h>\n", "no header of the C++ standard library"),
        ("scalar", HEAD + "auto x = A.partialPivLu().solve(b);\n", "uses what <Eigen/LU> declares"),
        ("scalar", HEAD + "#include <filippov/scalar.hpp>\n", "scalar -> scalar"),
        ("sliding", HEAD + "#include <filippov/mode.hpp>\n", "does not exist"),
        ("shortcut", HEAD, "is on no floor"),
        ("scalar", "#pragma once\n", "no SPDX line"),
        ("scalar", "// SPDX-License-Identifier: BSD-3-Clause\n", "no #pragma once"),
    ],
)
def test_a_violation_is_named(house, name, text, words):
    (house / f"{name}.hpp").write_text(text)
    ran = check(house)
    assert ran.returncode == 1
    assert words in ran.stdout


def test_a_cycle_on_one_floor_is_named(house):
    (house / "version.hpp").write_text(HEAD + "#include <filippov/scalar.hpp>\n")
    (house / "scalar.hpp").write_text(HEAD + "#include <filippov/version.hpp>\n")
    assert "include each other: scalar -> version -> scalar" in check(house).stdout


def test_an_empty_folder_is_an_error(tmp_path):
    assert check(tmp_path).returncode == 1
