# SPDX-License-Identifier: BSD-3-Clause
"""Adding-sliding: a stick is cut in two. Figure 4.7 of the chapter.

A branch of periodic orbits over the drive's frequency finds the bifurcation by itself. The stick
touches the boundary s = -1 of the sliding region from inside; before it there is one stick, after
it there are two with a slip between. Usage: python 05_adding_sliding.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator
start = fp.periodic_orbit(block, params={"A": 0.5, "omega": 2.94})
branch = fp.continuation(start, "omega", (2.84, 2.98))
print(f"{branch.status}: {branch.message}")
for special in branch.specials:
    print(f"\n{special.kind} at omega = {special.param['omega']:.9f}, phase {special.phase:.6f}")
    print(f"words {special.word_before} and {special.word_after}, x = {special.x.round(6)}")
    for name, value in special.conditions.items():
        print(f"  {name:5s} {'0' if abs(value) < 1e-9 else f'{value:.6f}'}")

(adding,) = branch.special["adding-sliding"]
omega = adding.param["omega"]
around = {
    "before": fp.periodic_orbit(block, start, params={"omega": omega + 0.006}),
    "at": adding.orbit,
    "after": fp.periodic_orbit(
        block, adding.orbit.x0, params={"A": 0.5, "omega": omega - 0.006}, turns=adding.orbit.turns
    ),
}

figure, axes = plt.subplots(3, 3, figsize=(12, 9), layout="constrained")
for (when, orbit), (portrait, surface, history) in zip(around.items(), axes.T, strict=True):
    orbit.plot(portrait)
    title = rf"{when}: $\omega = {orbit.params['omega']:.6f}$, word {orbit.word}"
    portrait.set(title=title, xlabel="displacement y (m)", ylabel="velocity v (m/s)")

    # on the belt: the stick, y' = 1, below the boundary s = -1 where the friction gives way
    run = orbit.trajectory(2)
    T = orbit.period / orbit.turns
    t = np.linspace(0, 2 * orbit.period, 2001)
    edge = 4 + 0.5 * np.cos(2 * np.pi * t / T)
    surface.plot(t, edge, color="#1f5fa8", lw=1.2, label="boundary s = -1")
    for piece in run.segments(points_per_step=8):
        if piece.mode == 0:
            surface.plot(piece.t, piece.y[0], color="#101010", lw=2.5)
    touch = run.events["t"][run.events["kind"] == "exit_sliding"]
    surface.plot(touch, 4 + 0.5 * np.cos(2 * np.pi * touch / T), "s", color="k", label="stick ends")
    if when == "at":
        surface.plot(adding.t, adding.x[0], "D", color="#c0392b", label="touches the boundary")
    # the stick that is cut: around the phase of the bifurcation
    near = adding.t / adding.orbit.period * orbit.period
    surface.set(xlim=(near - 0.9, near + 0.9), ylim=(2.6, 4.7), xlabel="t (s)", ylabel="y (m)")
    surface.legend(fontsize=8, loc="lower right")

    run.plot(history, x="t", y="v")
    history.set(xlim=(near - 0.9, near + 0.9), ylim=(0.98, 1.004), xlabel="t (s)", ylabel="v (m/s)")

picture = sys.argv[1] if len(sys.argv) > 1 else "05_adding_sliding.png"
figure.savefig(picture, dpi=150)
print(f"\npicture: {picture}")
