# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.15: basins and transient times at (A, omega) = (3.6, 1.067), 500 x 500 cells.

Above plain cell-to-cell mapping, the chapter's method: a cell has landed when it has come to a
group of cells that the map leads around. Below the same cells, each labelled by its own trajectory,
landed when it is nearer than 1e-9 of the picture to its attractor. The saddle's stable set is drawn
over them. Usage: python fig_4_15.py [picture.png] [--quick: 100 x 100 cells]
"""

import numpy as np
from figure import V, Y, block, options, plt, save
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

import filippov as fp

driven = block.with_params(A=3.6, omega=1.067)
n = 100 if options().quick else 500
grid = {"y": (-4, 4, n), "v": (-3, 4, n)}
basins = fp.basins(driven, grid)
for kind, cycles in (("attractor", basins.attractors), ("saddle", basins.saddles)):
    for cycle in cycles:
        y, v = cycle.points[:, 0]
        print(f"{kind} at ({y:.6f}, {v:.6f}), multiplier {abs(cycle.multipliers[0]):.6f}")
print(f"certified: {basins.fractions[1]:.2%} and {basins.fractions[2]:.2%},", end=" ")
print(f"{len(basins.unresolved)} unresolved,", end=" ")
print(f"audit: {basins.disagreements} of {basins.audited} wrong")

print("plain cell mapping: cells by group and true label")
kinds = np.full(basins.plain_group.shape, 3)  # 0, 1: of an attractor, 2: spurious, 3: outside
for row in basins.confusion:
    if row.cells.sum():
        stands = f"attractor {row.attractor}" if row.attractor else "spurious"
        stands = stands if row.group >= 0 else "outside"
        print(f"  {stands:12s}", *(f"{c:7d}" for c in row.cells[2:]))
    if row.group >= 0:
        kinds[basins.plain_group == row.group] = row.attractor - 1 if row.attractor else 2

tight = {"audit": 0, "rtol": 1e-12, "atol": 1e-12}
near = fp.basins(driven, grid, distance=1e-9, **tight)
rules = {
    "in a group of cells": basins.plain_steps[basins.plain_group >= 0],
    "in the ellipsoid": basins.time,
    "within 1e-3": fp.basins(driven, grid, distance=1e-3, **tight).time,
    "within 1e-9": near.time,
}
print("landed                 mean  longest  cells above 60")
for rule, time in rules.items():
    print(f"  {rule:20s} {time.mean():4.1f}  {time.max():7d}  {np.sum(time > 60):14d}")

boundary = fp.basin_boundary(basins)
for corner in boundary.corners:
    y, v = corner.position
    print(f"corner of the stable set at ({y:.6f}, {v:.6f})")

colours = ("#f6dc8c", "#8c2d19", "#a8a8a8", "#ffffff")  # yellow and dark red, as in the chapter
fig, axes = plt.subplots(2, 2, figsize=(9.5, 7.8))
look = {"cmap": ListedColormap(colours), "vmin": -0.5, "vmax": 3.5}
whole = {"origin": "lower", "extent": basins.grid.extent, "aspect": "auto"}
whole |= {"interpolation": "nearest"}
axes[0, 0].imshow(kinds.T, **look, **whole)
axes[1, 0].imshow(basins.label.T - 1, **look, **whole)
plain = np.ma.masked_where(basins.plain_group < 0, basins.plain_steps)
for ax, time in ((axes[0, 1], plain), (axes[1, 1], near.time)):
    shown = ax.imshow(time.T, cmap="viridis", **whole)
    fig.colorbar(shown, ax=ax, label="forcing periods until landed")
for ax in axes[:, 0]:
    boundary.plot(ax)
for ax, title in zip(
    axes.flat,
    (
        "(a) plain cell mapping",
        "(b) its transient time, to a group of cells",
        "certified basins",
        r"their transient time, to within $10^{-9}$",
    ),
    strict=True,
):
    for cycle in basins.attractors:
        ax.plot(*cycle.points, "o", mfc="white", mec="k", ms=6, label="stable orbit")
    ax.plot(*basins.saddles[0].points, "X", mfc="white", mec="k", ms=8, label="saddle")
    ax.set(title=title, xlabel=Y, ylabel=V, xlim=(-4, 4), ylim=(-3, 4))
names = ("orbit of fig. 4.16 (a)", "orbit of fig. 4.16 (b)", "spurious group", "outside")
patches = [Patch(fc=c, ec="k", lw=0.5, label=name) for c, name in zip(colours, names, strict=True)]
axes[0, 0].legend(handles=patches, loc="lower left")
axes[1, 0].legend(handles=axes[1, 0].lines[-2:], loc="lower left")
save(fig)
