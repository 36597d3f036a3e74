# SPDX-License-Identifier: BSD-3-Clause
import ast
import doctest
import re
import subprocess
import sys
from pathlib import Path

import pytest

import filippov as fp


def test_everything_announced_is_there():
    for name in fp.__all__:
        assert getattr(fp, name) is not None
    assert sorted(fp.__all__) == list(fp.__all__)


def test_the_version_is_that_of_the_headers():
    header = Path(fp.get_include()) / "filippov" / "version.hpp"
    (version,) = re.findall(r'#define FILIPPOV_VERSION "([^"]+)"', header.read_text())
    assert fp.__version__ == version


def test_the_headers_are_all_there():
    folder = Path(fp.get_include()) / "filippov"
    assert (folder / "filippov.hpp").is_file()
    assert (folder / "models" / "oscillator.hpp").is_file()


def test_show_config_prints_or_returns(capsys):
    assert fp.show_config() is None
    shown = capsys.readouterr().out
    config = fp.show_config("dicts")
    for name, value in config.items():
        assert name in shown
        assert value in shown
    assert config["filippov"] == fp.__version__
    # one wheel for every processor of its kind
    assert config["instruction set"] in ("sse2", "neon", "none")
    assert config["assertions"] == "off"
    with pytest.raises(ValueError, match="expected 'stdout' or 'dicts'"):
        fp.show_config("yaml")


def test_the_example_in_the_docstring_runs():
    assert doctest.testmod(fp).failed == 0


def test_the_package_says_that_it_is_typed():
    assert (Path(fp.__file__).parent / "py.typed").is_file()


def imported_at_once(tree):
    """Names of the packages that a module imports when it is imported itself."""
    for node in tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module


def test_importing_it_needs_numpy_and_nothing_else():
    for path in Path(fp.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        needed = {name.partition(".")[0] for name in imported_at_once(tree)}
        assert needed <= {"numpy", *sys.stdlib_module_names}, path.name


def test_importing_takes_in_what_is_used():
    code = (
        "import sys, filippov as fp; assert 'filippov._basins.basins' not in sys.modules;"
        "fp.simulate; assert 'filippov._basins.basins' not in sys.modules;"
        "assert all(getattr(fp, name) is not None for name in fp.__all__);"
        "assert dir(fp) == sorted(fp.__all__)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_there_is_no_other_name():
    with pytest.raises(AttributeError, match="'filippov' has no attribute 'simulat'"):
        _ = fp.simulat
