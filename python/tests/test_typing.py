# SPDX-License-Identifier: BSD-3-Clause
"""The types that users see, and the stub against the core."""

import subprocess
import sys

import pytest

from filippov import _core

pytest.importorskip("mypy")

PROGRAM = """
import numpy as np
from numpy.typing import NDArray

import filippov as fp


def g(t: float, y: NDArray[np.float64]) -> float:
    return float(y[0])


run: fp.Trajectory = fp.simulate(fp.models.oscillator, [0.0, 0.0], (0.0, 1.0), events=[g])
y: NDArray[np.float64] = run.y
ok: bool = run.success
status: fp.Status = run.status
period: float | None = fp.models.oscillator.with_params(A=5.0).period()
for piece in run.segments():
    t: NDArray[np.float64] = piece.t
region = fp.sliding_region(fp.models.oscillator, bounds={"y": (-1.0, 1.0), "v": (0.0, 2.0)})
ends: NDArray[np.float64] = region.boundary
graph: fp.EventMap = fp.event_map(fp.models.oscillator, samples=16)
points: list[fp.FixedPoint] = graph.fixed_points()
slope: NDArray[np.float64] = graph.slope
growth: NDArray[np.float64] = fp.lyapunov(
    fp.models.oscillator, [0.0, 0.0], transient=0, window=20
).exponents
image: fp.Mapped = fp.strobe_map(fp.models.oscillator, [0.0, 0.0], wrt="omega")
by_omega: NDArray[np.float64] = image.param_slope["omega"]
box = {"y": (-9.0, 9.0), "v": (0.0, 2.0)}
edges: list[fp.Tangency] = fp.tangencies(fp.models.oscillator, bounds=box)
curve: fp.SlidingBoundary = fp.sliding_boundaries(fp.models.oscillator, bounds=box)[0]
rest: fp.Equilibrium = fp.equilibria(fp.models.oscillator, bounds=box, params={"A": 0.0})[0]
basins: fp.Basins = fp.basins(
    fp.models.oscillator, {"y": (-1, 1, 3), "v": (-1.0, 0.9, 3)}, audit=0, saddle_starts=0
)
label: NDArray[np.int32] = basins.at([0.0, 0.0])[0]
shares: dict[int, fp.Fraction] = basins.bounds
refined: fp.RefinedBasins = basins.refine(coarse=2, levels=1, audit=0)
cells: fp.CellMap = fp.cell_map(fp.models.oscillator, {"y": (-1, 1, 3), "v": (-1.0, 0.9, 3)})
members: fp.Ensemble = fp.ensemble(fp.models.oscillator, [[0.0, 1.0], [0.0, 0.0]], (0.0, 1.0))
wrong: int = run.message  # type: ignore[assignment]
"""


def run(*command, cwd):
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=cwd, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_users_program_is_checked_strictly(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    # a type that was Any would make the ignored mistake no mistake, and the ignore an error
    run("mypy", "--strict", "program.py", cwd=tmp_path)


def test_the_stub_is_that_of_the_core(tmp_path):
    # a bound class has a metaclass and an __init__ that no stub can name
    allowed = tmp_path / "allowed.txt"
    bound = [name for name, value in vars(_core).items() if isinstance(value, type)]
    allowed.write_text("".join(f"filippov._core.{name}(.__init__)?\n" for name in bound))
    run("mypy.stubtest", "filippov._core", "--allowlist", str(allowed), cwd=tmp_path)
