# SPDX-License-Identifier: BSD-3-Clause
"""A dry friction oscillator sticks and slips: exact event times and a picture.

A block on a belt with speed V, held by a spring and driven by A cos(omega t), once gently and once
hard. Usage: python 01_quickstart.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator
drives = [(0.5, 2.94), (5.0, 1.72)]
tight = {"method": "dop853", "rtol": 1e-11, "atol": 1e-11}
periods, kept = 120, 4  # let the motion settle, then look at the last few periods

figure, axes = plt.subplots(2, 2, figsize=(10, 7.5), layout="constrained")
for column, (A, omega) in zip(axes.T, drives, strict=True):
    driven = block.with_params(A=A, omega=omega)
    T = driven.period()
    settled = fp.simulate(driven, [0, 0], (0, periods * T), **tight)
    run = fp.simulate(driven, settled.y[:, -1], (0, kept * T), **tight)
    print(f"A = {A}, omega = {omega}: {settled.stats.events} events; the last:")
    print(settled.event_table(last=7, digits=5), end="\n\n")

    portrait, surface = column
    run.plot_phase(portrait)
    portrait.set_title(f"A = {A} N, $\\omega$ = {omega} rad/s: {kept} forcing periods")
    portrait.set_xlabel("displacement y (m)")
    portrait.set_ylabel("velocity v (m/s)")

    # On the belt v = V the state is (phase, y): the block sticks between two moving boundaries.
    low, high = run.y[0].min(), run.y[0].max()
    phase = np.linspace(0, T, 121)
    box = {"y": (-15, 15), "v": (0.5, 1.5, 4)}
    edges = [np.sort(fp.sliding_region(driven, t, bounds=box).boundary[0]) for t in phase]
    lower, upper = np.transpose(edges)
    surface.fill_between(
        phase / T, lower, upper, color="#e8a33d", alpha=0.35, label="sliding region"
    )
    surface.plot(phase / T, upper, "--", color="#7a4a00", lw=1.2, label="leaves into v < V: s = -1")
    surface.plot(phase / T, lower, "-.", color="#7a4a00", lw=1.2, label="leaves into v > V: s = +1")
    marks = {
        "enter_sliding": ("o", "sticks"),
        "exit_sliding": ("s", "slips"),
        "cross": ("x", "crosses"),
    }
    for piece in run.segments(points_per_step=8):
        if piece.mode == 0:
            first, last = np.floor(piece.t[[0, -1]] / T)
            for start in np.arange(first, last + 1):  # once for each period it is in
                surface.plot(piece.t / T - start, piece.y[0], color="#101010", lw=2.5)
    for kind, (marker, word) in marks.items():
        met = run.events[run.events["kind"] == kind]
        if met.size:
            style = {"mfc": "white"} if marker == "o" else {}
            surface.plot(
                met["t"] / T % 1, met["x_right"][:, 0], marker, color="k", label=word, **style
            )
    surface.set(xlim=(0, 1), ylim=(low - 1.5, high + 1.5))
    surface.set_xlabel("phase t/T")
    surface.set_ylabel("displacement y on the belt (m)")
    for ax in column:
        ax.legend(fontsize=8, loc="best")

picture = sys.argv[1] if len(sys.argv) > 1 else "01_quickstart.png"
figure.savefig(picture, dpi=150)
print(f"picture: {picture}")
