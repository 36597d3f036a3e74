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
    for name in ("version", "core/scalar", "core/dual", "core/detail/bits", "system/system"):
        header = tmp_path / f"{name}.hpp"
        header.parent.mkdir(parents=True, exist_ok=True)
        header.write_text(HEAD)
    for folder in ("core", "system"):
        (tmp_path / folder / "README.md").write_text("what it is")
    return tmp_path


def test_lower_floors_third_party_and_std_are_accepted(house):
    (house / "system/system.hpp").write_text(
        HEAD
        + "#include <filippov/core/scalar.hpp>\n#include <filippov/version.hpp>\n"
        + "#include <Eigen/Core>\n#include <array>\n"
    )
    (house / "core/scalar.hpp").write_text(HEAD + "#include <filippov/core/detail/bits.hpp>\n")
    (house / "filippov.hpp").write_text(HEAD + "#include <filippov/system/system.hpp>\n")
    assert check(house).returncode == 0


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("core/scalar", "#include <filippov/system/system.hpp>", "(floor 0) includes"),
        ("core/scalar", "#  include <filippov/system/system.hpp>", "(floor 0) includes"),
        ("core/scalar", "#include <filippov/filippov.hpp>", "(floor 0) includes"),
        ("methods/step", "#include <filippov/formulas/tape.hpp>", "(floor 3) includes"),
        ("system/system", "#include <filippov/core/detail/bits.hpp>", "private to core"),
        ("core/scalar", '#include "version.hpp"', "write <filippov/...>"),
        ("core/scalar", "#include <gsl/gsl_math.h>", "only Eigen and the standard library"),
        ("core/scalar", "#include <math.h>", "no header of the C++ standard library"),
        ("core/scalar", "#include <omp.h>", "no header of the C++ standard library"),
        ("core/scalar", "auto x = A.partialPivLu().solve(b);", "uses what <Eigen/LU> declares"),
        ("core/scalar", "#include <filippov/core/scalar.hpp>", "core/scalar -> core/scalar"),
        ("system/system", "#include <filippov/core/taylor.hpp>", "does not exist"),
        ("system/system", "#include <filippov/attic/box.hpp>", "whose folder is on no floor"),
        ("attic/box", "", "is in a folder on no floor"),
        ("run/clock", "", "run/ has no README.md"),
    ],
)
def test_a_violation_is_named(house, name, text, words):
    header = house / f"{name}.hpp"
    header.parent.mkdir(exist_ok=True)
    header.write_text(HEAD + text + "\n")
    ran = check(house)
    assert ran.returncode == 1
    assert words in ran.stdout


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("#pragma once\n", "no SPDX line"),
        ("// SPDX-License-Identifier: BSD-3-Clause\n", "no #pragma once"),
    ],
)
def test_a_head_that_lacks_something_is_named(house, text, words):
    (house / "core/scalar.hpp").write_text(text)
    assert words in check(house).stdout


def test_a_cycle_in_a_folder_is_named(house):
    (house / "core/dual.hpp").write_text(HEAD + "#include <filippov/core/scalar.hpp>\n")
    (house / "core/scalar.hpp").write_text(HEAD + "#include <filippov/core/dual.hpp>\n")
    words = "include each other: core/dual -> core/scalar -> core/dual"
    assert words in check(house).stdout


def test_an_empty_folder_is_an_error(tmp_path):
    assert check(tmp_path).returncode == 1


@pytest.fixture
def package(tmp_path):
    for name in ("__init__", "models", "_system/system", "_system/trace", "_plot/plot"):
        module = tmp_path / f"{name}.py"
        module.parent.mkdir(exist_ok=True)
        module.write_text("")
    return tmp_path


def test_lower_floors_the_core_and_pictures_within_functions_are_accepted(package):
    (package / "_plot/plot.py").write_text("from filippov._system.system import System\n")
    (package / "_system/trace.py").write_text("from filippov import _core\nimport numpy as np\n")
    (package / "_system/system.py").write_text(
        "from .trace import record\n\ndef plot():\n    from filippov._plot.plot import draw\n"
    )
    (package / "models.py").write_text("from ._system.system import System\n")
    ran = check(package)
    assert ran.stdout == "floors: every header and every module stands on lower ones\n"
    assert ran.returncode == 0


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("_system/system", "from filippov._plot.plot import draw", "from a higher floor"),
        ("_system/system", "from filippov._plot import plot", "from a higher floor"),
        ("_system/system", "import filippov._plot.plot", "from a higher floor"),
        ("_system/system", "def f():\n    from filippov._runs.simulate import go", "higher floor"),
        ("_system/system", "from filippov import models", "imports models from a higher floor"),
        ("_system/system", "from filippov import simulate", "imports simulate from above"),
        ("_system/trace", "from .trace import record", "_system.trace -> _system.trace"),
        ("_attic/box", "", "is in a folder on no floor"),
    ],
)
def test_an_import_from_above_is_named(package, name, text, words):
    module = package / f"{name}.py"
    module.parent.mkdir(exist_ok=True)
    module.write_text(text + "\n")
    ran = check(package)
    assert ran.returncode == 1
    assert words in ran.stdout


def test_a_circle_of_modules_is_named(package):
    (package / "_system/system.py").write_text("from .trace import record\n")
    (package / "_system/trace.py").write_text("from .system import System\n")
    assert "modules import each other" in check(package).stdout


def test_types_of_a_higher_floor_are_named(package):
    (package / "_system/system.py").write_text(
        "from typing import TYPE_CHECKING\n\n"
        "if TYPE_CHECKING:\n    from filippov._plot.plot import Picture\n"
    )
    assert "from a higher floor" in check(package).stdout


def test_a_circle_for_types_is_named(package):
    (package / "_system/system.py").write_text("from .trace import record\n")
    (package / "_system/trace.py").write_text(
        "from typing import TYPE_CHECKING\n\nif TYPE_CHECKING:\n    from .system import System\n"
    )
    assert "modules import each other" in check(package).stdout
