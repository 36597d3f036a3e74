# SPDX-License-Identifier: BSD-3-Clause
"""What this installation is made of."""

from __future__ import annotations

import platform
import sys
from pathlib import Path

import numpy as np

from . import _core
from ._runs.gsl_run import has_gsl
from ._runs.lanes import instruction_set, lanes_in_a_register
from ._support.check import word

__all__ = ["get_cmake_dir", "get_include", "show_config"]


def get_include() -> str:
    """Folder of the C++ headers, for `#include <filippov/filippov.hpp>`."""
    folder = Path(_core.__file__).parent / "include"
    if not (folder / "filippov").is_dir():
        raise FileNotFoundError(f"{folder} has no headers: this is not an installed package")
    return str(folder)


def get_cmake_dir() -> str:
    """Folder of `filippovConfig.cmake`, for `cmake -Dfilippov_DIR=...`.

    Projects that scikit-build-core builds find it without; Eigen may come from the package index,
    too: with the extra `cpp`.
    """
    folder = Path(_core.__file__).parent / "share" / "cmake" / "filippov"
    if not (folder / "filippovConfig.cmake").is_file():
        raise FileNotFoundError(f"{folder} has no CMake files: this is not an installed package")
    return str(folder)


def show_config(mode: str = "stdout") -> dict[str, str] | None:
    """Print what this installation is made of, or return it with `mode="dicts"`."""
    config = {
        "filippov": _core.__version__,
        "compiler": str(_core.config["compiler"]),
        "C++": str(_core.config["cxx"]),
        "Eigen": str(_core.config["eigen"]),
        "instruction set": str(_core.config["simd"]),
        "lanes": f"{instruction_set()}, {lanes_in_a_register()} in a register",
        "threads": str(_core.config["threads"]),
        "GSL": "yes" if has_gsl() else "no",
        "optimised": "no, for tests (FILIPPOV_LEAN)" if _core.config["lean"] else "yes",
        "assertions": "on" if _core.config["assertions"] else "off",
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
    }
    if word("mode", mode, ("stdout", "dicts"), "expected 'stdout' or 'dicts'") == "dicts":
        return config
    width = max(map(len, config))
    for name, value in config.items():
        sys.stdout.write(f"{name:{width}}  {value}\n")
    return None
