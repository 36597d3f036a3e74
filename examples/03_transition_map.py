# SPDX-License-Identifier: BSD-3-Clause
"""The map from one stick-to-slip transition to the next, and its periodic points.

Figures 4.6 and 4.8 of the chapter: P_trans of a dry friction oscillator at omega = 2.94, and its
second iterate at 2.9, 2.895 and 2.893. Usage: python 03_transition_map.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator.with_params(A=0.5)
cases = [("4.6a", 2.94, 1), ("4.6b", 2.9, 2), ("4.8a", 2.895, 2), ("4.8b", 2.893, 2)]

figure, axes = plt.subplots(2, 2, figsize=(10, 10), layout="constrained")
print("figure  omega  iterate  phase       slope          prime  periods")
for ax, (name, omega, iterate) in zip(axes.flat, cases, strict=True):
    graph = fp.event_map(block, iterate=iterate, params={"omega": omega})
    points = graph.fixed_points()
    for f in points:
        what = "stable" if f.stable else "unstable"
        print(
            f"{name:6}  {omega:<5}  {iterate:7}  {f.phase:.8f}  {f.slope:<13.6g}  "
            f"{f.prime:5}  {f.turns:7}  {what}"
        )
    if not points:
        print(f"{name:6}  {omega:<5}  {iterate:7}  none")

    graph.plot(ax)
    jumps = graph.breakpoints[graph.breakpoints["jump"] & (graph.breakpoints["boundary"] < 0)]
    for jump in jumps:  # both values of the map where it jumps
        ends = [jump["left"], jump["right"]]
        ax.plot([jump["phase"]] * 2, ends, ":", color="#b0b0b0", lw=0.8, zorder=1)
    ax.set_title(f"figure {name}: iterate {iterate}, $\\omega$ = {omega} rad/s")
    ax.set(xlim=(0, 2 * np.pi), ylim=(0, 2 * np.pi), aspect="equal")
    ax.set_xlabel("phase of a stick-to-slip transition (rad)")
    ax.set_ylabel(f"phase {iterate} transition{'s' if iterate > 1 else ''} later (rad)")
    ax.legend(fontsize=8, loc="upper left")

picture = sys.argv[1] if len(sys.argv) > 1 else "03_transition_map.png"
figure.savefig(picture, dpi=110)
print(f"picture: {picture}")
