#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Check the floors of ``include/filippov``.

A header includes headers of lower floors, or of its own floor as long as there is no cycle; beyond
that only Eigen and the standard library, and of Eigen the solvers that it names. Each header has
its SPDX line and ``#pragma once``.

The folder to check is the first argument, by default the library's own.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

# The floors, from the ground up: names of headers below include/filippov, without ".hpp".
# "models/*" stands for every header of that folder. A header that is not listed is an error.
FLOORS: list[list[str]] = [
    # 0: ground
    [
        "version",
        "config",
        "refuse",
        "scalar",
        "elementary",
        "lanes",
        "taylor",
        "dual",
        "status",
        "parallel",
        "statistics",
        "smooth_law",
        "elimination",
        "external",
        "value_range",
        "expression",
        "terms",
        "sample_points",
        "tape",
        "tape_writer",
    ],
    # 1: what a system is
    ["system"],
    # 2: geometry at the surface
    [
        "derivatives",
        "surface",
        "sliding",
        "regions",
        "blend",
        "intersection",
        "mode",
        "junction",
        "split",
        "switch_formulas",
        "tape_system",
    ],
    # 3: integration
    [
        "runge_kutta",
        "dormand_prince5",
        "dormand_prince8",
        "rosenbrock",
        "rodas5p",
        "control",
        "roots",
    ],
    # 4: trajectories
    [
        "clock",
        "event",
        "guards",
        "landing",
        "lost_surface",
        "two_fold",
        "accumulation",
        "counters",
        "settings",
        "arguments",
        "smoothing",
        "time_stepping",
        "observers",
        "report",
        "place",
        "watch",
        "target",
        "probed_field",
        "paths",
        "first_step",
        "segment",
        "flow",
        "flow_result",
        "variation",
        "trajectory",
        "all_branches",
        "lane_guards",
        "population",
        "lane_group",
        "lane_step",
        "lane_landing",
        "lane_slip",
        "lane_slides",
        "lane_flow",
        "ensemble",
        "any_scalar",
        "any_lanes",
        "seam",
    ],
    # 5: maps and orbits
    [
        "repeats",
        "diagram",
        "system_interface",
        "discrete",
        "sampled_minima",
        "any_system",
        "maps",
        "map_graph",
        "lyapunov",
        "word",
        "shooting",
        "arclength",
        "floquet",
        "orbit",
        "geometry",
        "bifurcation",
        "continuation",
        "sliding_point",
        "multiplier_tests",
        "branch_place",
        "word_change",
        "smooth_points",
        "branch",
        "curve_start",
        "curve_place",
        "degenerate_points",
        "double_bifurcations",
        "curve",
        "bifurcation_set",
    ],
    # 6: cells and basins
    [
        "strobe_cycle",
        "cells",
        "quad_tree",
        "refine",
        "label_grid",
        "basin_fractions",
        "basin_entropy",
        "uncertainty_exponent",
        "box_dimension",
        "attractor_match",
        "basin_numbers",
        "cubic_map",
        "exit_basins",
        "exit_search",
        "exit_attractors",
        "exit_ends",
        "quotient",
        "picture",
        "labels",
        "attractors",
        "exit_lookup",
        "basins",
        "brackets",
        "contours",
        "corners",
        "boundary",
        "unstable_set",
    ],
    # 7: top
    ["models/*", "filippov", "gsl/*"],
]

# Headers of the system that one header alone may include, where they exist.
SYSTEM: dict[str, set[str]] = {"parallel": {"omp.h", "unistd.h"}, "lanes": {"immintrin.h"}}

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


def floor_of(name: str) -> int | None:
    """Return the floor of a header, None if it is not in the table."""
    folder = name.rpartition("/")[0] + "/*"
    for floor, names in enumerate(FLOORS):
        if name in names or folder in names:
            return floor
    return None


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
    floor = floor_of(name)
    errors: list[str] = []
    included: list[str] = []
    if floor is None:
        errors.append("is on no floor: add it to FLOORS in scripts/check_floors.py")
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
            other_floor = floor_of(other)
            included.append(other)
            if other_floor is None:
                errors.append(f"includes <{path}>, which is on no floor")
            elif floor is not None and other_floor > floor:
                errors.append(f"(floor {floor}) includes <{path}> (floor {other_floor})")
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


def main() -> int:
    """Check, print what is wrong, return 0 if nothing is."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "include" / "filippov"
    errors = check(folder)
    for error in errors:
        print(error)
    if not errors:
        print("floors: every header stands on lower ones")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
