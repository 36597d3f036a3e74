#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Check the floors of ``include/filippov`` and of ``python/filippov``.

Each folder is on a floor. A header includes headers of folders on lower floors, but for what is in
their ``detail``, or of its own folder as long as there is no cycle; beyond that only Eigen and the
standard library, and of Eigen the solvers that it names. Each header has its SPDX line and
``#pragma once``, each folder a ``README.md``.

A module of the package imports from folders on lower floors, for types too, and from its own as
long as there is no circle, for types neither. Within functions it may ask for a picture
(``_plot``), and for the package's names and models, which stand on all floors.

The folders to check are the arguments, by default the library's own and the package's: with modules
in them, or with headers.
"""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

# The floors, from the ground up: folders below include/filippov. Folders of one floor do not know
# each other. What is directly in include/filippov stands on all of them, but for the version.
FLOORS = [
    ["core"],
    ["system"],
    ["sliding"],
    ["formulas", "methods"],
    ["run"],
    ["events"],
    ["engine"],
    ["ensemble"],
    ["orbits"],
    ["continuation", "basins"],
    ["models", "gsl"],
]
GROUND, TOP = -1, len(FLOORS)

# The same of the folders below python/filippov; what is directly in it stands on all of them, but
# for the compiled core.
PYTHON_FLOORS = [
    "_support",
    "_system",
    "models",
    "_results",
    "_runs",
    "_orbits",
    "_basins",
    "_plot",
]
CORE = "_core"
# What functions may import late, from whatever floor.
LATE = {"_plot", "models", "_NAMES"}

# Headers of the system that one header alone may include, where they exist.
SYSTEM: dict[str, set[str]] = {
    "core/parallel": {"omp.h", "unistd.h"},
    "core/lanes": {"immintrin.h"},
}

# Folders whose headers include another library's, and which no header includes.
FOREIGN = {"gsl/": "gsl/"}

ROOT = Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r"^[ \t]*#[ \t]*include[ \t]*([<\"])([^>\"]+)[>\"]", re.MULTILINE)


# Eigen's solvers, and how one tells that a header uses them.
SOLVERS = {
    "Eigen/Eigenvalues": re.compile(r"EigenSolver|\.eigenvalues\(\)"),
    "Eigen/LU": re.compile(r"PivLU<|PivLu\(\)|\.determinant\(\)|\.inverse\(\)"),
    "Eigen/QR": re.compile(r"QR<|Qr\(\)|[oO]rthogonalDecomposition"),
    "Eigen/SVD": re.compile(r"SVD<|Svd\(\)"),
}


def folder_of(name: str) -> str:
    """Return the folder of a header, "" for what is directly in the library."""
    return name.partition("/")[0] if "/" in name else ""


def floor_of(name: str) -> int | None:
    """Return the floor of a header, None if its folder is on none."""
    folder = folder_of(name)
    if not folder:
        return GROUND if name == "version" else TOP
    return next((floor for floor, each in enumerate(FLOORS) if folder in each), None)


def wrong_include(name: str, other: str) -> str:
    """Return what is wrong with a header that includes another one of the library's."""
    here, there = floor_of(name), floor_of(other)
    if there is None:
        return f"includes <filippov/{other}.hpp>, whose folder is on no floor"
    if folder_of(other) == folder_of(name) or here is None:
        return ""
    if there >= here:
        return f"(floor {here}) includes <filippov/{other}.hpp> (floor {there})"
    if "/detail/" in other:
        return f"includes <filippov/{other}.hpp>, which is private to {folder_of(other)}"
    return ""


def find_cycle(graph: dict[str, list[str]]) -> list[str]:
    """Return the headers of one include cycle, empty if there is none."""
    done: set[str] = set()

    def visit(name: str, path: list[str]) -> list[str]:
        if name in path:
            return [*path[path.index(name) :], name]
        if name not in done:
            for other in graph.get(name, []):
                if cycle := visit(other, [*path, name]):
                    return cycle
            done.add(name)
        return []

    for name in graph:
        if cycle := visit(name, []):
            return cycle
    return []


def check_header(name: str, text: str) -> tuple[list[str], list[str]]:
    """Return the names of the library's headers that this one includes, and what is wrong."""
    errors: list[str] = []
    included: list[str] = []
    if floor_of(name) is None:
        errors.append("is in a folder on no floor: add it to FLOORS in scripts/check_floors.py")
    if "// SPDX-License-Identifier: BSD-3-Clause" not in text:
        errors.append("has no SPDX line")
    if "#pragma once" not in text:
        errors.append("has no #pragma once")
    includes = INCLUDE.findall(text)
    for bracket, path in includes:
        if bracket == '"':
            errors.append(f'includes "{path}": write <filippov/...>')
        elif path.startswith("filippov/"):
            other = path.removeprefix("filippov/").removesuffix(".hpp")
            included.append(other)
            if wrong := wrong_include(name, other):
                errors.append(wrong)
        elif any(name.startswith(a) and path.startswith(b) for a, b in FOREIGN.items()):
            continue
        elif "/" in path and not path.startswith(("Eigen/", "unsupported/Eigen/", "experimental/")):
            errors.append(f"includes <{path}>: only Eigen and the standard library are allowed")
        elif path.endswith((".h", ".hpp")) and path not in SYSTEM.get(name, ()):
            errors.append(f"includes <{path}>, which is no header of the C++ standard library")
    errors += [
        f"uses what <{solver}> declares, and does not include it"
        for solver, names in SOLVERS.items()
        if names.search(text) and ("<", solver) not in includes
    ]
    return included, errors


def check(folder: Path) -> list[str]:
    """Return everything that is wrong with the headers below a folder."""
    errors: list[str] = []
    graph: dict[str, list[str]] = {}
    for header in sorted(folder.rglob("*.hpp")):
        name = header.relative_to(folder).with_suffix("").as_posix()
        graph[name], wrong = check_header(name, header.read_text(encoding="utf-8"))
        errors += [f"{name}.hpp {words}" for words in wrong]
    errors += [
        f"{each.name}/ has no README.md"
        for each in sorted(folder.iterdir())
        if each.is_dir() and not (each / "README.md").is_file()
    ]
    for name, included in graph.items():
        errors += [
            f"{name}.hpp includes <filippov/{other}.hpp>, which does not exist"
            for other in included
            if other not in graph
        ]
    if not graph:
        errors.append(f"no headers in {folder}")
    if cycle := find_cycle(graph):
        errors.append("headers include each other: " + " -> ".join(cycle))
    return errors


def imports_of(text: str, folder: str) -> list[tuple[str, bool]]:
    """Return what a module imports from the package, for types too, and if in a function."""
    tree = ast.parse(text)
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    late = {
        id(inner)
        for outer in ast.walk(tree)
        if isinstance(outer, functions)
        for inner in ast.walk(outer)
    }
    found: list[tuple[str, bool]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [a.name for a in node.names if a.name.split(".")[0] == "filippov"]
        elif isinstance(node, ast.ImportFrom) and node.level < 2:
            start = ["filippov", folder] if node.level and folder else ["filippov"]
            parts = [*(start if node.level else []), *(node.module or "").split(".")]
            module = ".".join(part for part in parts if part)
            if module.split(".")[0] != "filippov":
                continue
            whole = module == "filippov" or (module.count(".") == 1 and module[9:] in PYTHON_FLOORS)
            names = [f"{module}.{a.name}" for a in node.names] if whole else [module]
        elif isinstance(node, ast.ImportFrom):
            names = ["filippov.."]
        else:
            continue
        found += [(name.removeprefix("filippov."), id(node) in late) for name in names]
    return found


def check_package(folder: Path) -> list[str]:
    """Return everything that is wrong with the modules below a folder."""
    errors: list[str] = []
    graph: dict[str, list[str]] = {}
    floors = {name: floor for floor, name in enumerate(PYTHON_FLOORS)}
    for path in sorted(folder.rglob("*.py")):
        name = path.relative_to(folder).with_suffix("").as_posix().replace("/", ".")
        room = name.rpartition(".")[0]
        if room and room not in floors:
            errors.append(f"{name} is in a folder on no floor: add it to PYTHON_FLOORS")
            continue
        graph[name] = []
        for other, late in imports_of(path.read_text(encoding="utf-8"), room):
            first = other.split(".")[0]
            if first == CORE or (late and first in LATE):
                continue
            if not late:
                graph[name].append(other)
            if not room or first == room:
                continue
            if first not in floors:
                errors.append(f"{name} imports {other} from above")
            elif floors[first] > floors[room]:
                errors.append(f"{name} (floor {floors[room]}) imports {other} from a higher floor")
    if cycle := find_cycle(graph):
        errors.append("modules import each other: " + " -> ".join(cycle))
    return errors


def main() -> int:
    """Check, print what is wrong, return 0 if nothing is."""
    given = [Path(each) for each in sys.argv[1:]]
    errors: list[str] = []
    for folder in given or [ROOT / "include" / "filippov", ROOT / "python" / "filippov"]:
        is_package = (folder / "__init__.py").is_file()
        errors += check_package(folder) if is_package else check(folder)
    for error in errors:
        print(error)
    if not errors:
        print("floors: every header and every module stands on lower ones")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
