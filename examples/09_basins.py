# SPDX-License-Identifier: BSD-3-Clause
"""Basins of attraction. Figures 4.15 and 4.16 of the chapter.

Two orbits attract, a saddle lies between: its stable set, with corners at the belt's velocity,
bounds the basins. Every cell is labelled by its own trajectory; beside it is what plain cell
mapping makes of the same cells: spurious groups, and cells that seem to leave.
Usage: python 09_basins.py [picture.png] [cells]
"""

import sys

import matplotlib as mpl

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator.with_params(A=3.6, omega=1.067)
cells = int(sys.argv[2]) if len(sys.argv) > 2 else 100
basins = fp.basins(block, {"y": (-4, 4, cells), "v": (-3, 4, cells)})

for kind, cycles in (("attractor", basins.attractors), ("saddle", basins.saddles)):
    for cycle in cycles:
        y, v = cycle.points[:, 0]
        multiplier = abs(cycle.multipliers[0])
        print(f"{kind} of period {cycle.period} at ({y:.9f}, {v:.9f}), multiplier {multiplier:.6f}")
for label, share in basins.fractions.items():
    print(f"basin {label}: {share:.2%} of the cells")
print(f"unresolved: {len(basins.unresolved)}; audited: {basins.audited}", end=", ")
print(f"disagreements: {basins.disagreements}")

boundary, unstable = fp.basin_boundary(basins), fp.unstable_set(basins)
kinds = {kind for curve in boundary.curves for kind in curve.kind}
print(f"\nboundary: {len(boundary.curves)} curves, of kind {', '.join(sorted(kinds))}")
for corner in boundary.corners:
    y, v = corner.position
    print(f"  corner at ({y:.6f}, {v:.6f}), turn {corner.turn:+.4f} in the picture")
for branch in unstable.branches:
    print(f"unstable set: {branch.length:.4f} pictures to attractor {branch.attractor}")

print("\nplain cell mapping: cells by true label")
for row in basins.confusion:
    words = {-1: "outside", -2: "unknown"}.get(row.group, f"group {row.group}")
    stands = f"attractor {row.attractor}" if row.attractor else "spurious" if row.group >= 0 else ""
    if row.cells.sum():
        print(f"  {words:8s} {stands:12s}", *(f"{n:7d}" for n in row.cells[2:]))

print("\nforcing periods until a cell has landed, the most and the mean")
print(f"  in the attractor's ellipsoid  {basins.time.max():3d} {basins.time.mean():6.2f}")
for distance in (1e-3, 1e-6):
    time = fp.basins(
        block, {"y": (-4, 4, cells), "v": (-3, 4, cells)}, distance=distance, audit=0
    ).time
    print(f"  nearer than {distance:.0e} pictures    {time.max():3d} {time.mean():6.2f}")
plain = basins.plain_steps[basins.plain_group >= 0]
print(f"  in a group of cells (plain)   {plain.max():3d} {plain.mean():6.2f}")

figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
for ax, what in zip(axes, ("label", "plain", "time"), strict=True):
    basins.plot(ax, what=what)
    ax.set(xlabel="displacement y (m)", ylabel="velocity v (m/s)")
boundary.plot(axes[0])
unstable.plot(axes[0])
axes[0].set_title("basins, the saddle's stable set (black), unstable set (red)")
axes[1].set_title(f"plain cell mapping: {len(basins.plain_groups)} groups; white: outside")
axes[2].set_title("forcing periods until landed")
picture = sys.argv[1] if len(sys.argv) > 1 else "09_basins.png"
figure.savefig(picture, dpi=120)
print(f"\npicture: {picture}")
