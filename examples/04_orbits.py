# SPDX-License-Identifier: BSD-3-Clause
"""Periodic orbits and their words: figures 4.9, 4.10, 4.12 and 4.16 of the chapter.

Orbits on either side of a crossing-sliding (4.9) and of a switching-sliding bifurcation (4.10), of
the five points of the two-parameter diagram (4.12), and three that coexist, one of them unstable
(4.16). Usage: python 04_orbits.py [picture.png]
"""

import sys

import matplotlib as mpl

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator


def orbit_at(A, omega, guess=None):
    return fp.periodic_orbit(block, guess, params={"A": A, "omega": omega}, raise_on_failure=True)


def row(orbit):
    mu = orbit.multipliers
    shown = " ".join(f"{m.real:9.5f}{m.imag:+.5f}j" if m.imag else f"{m.real:9.5f}" for m in mu)
    return f"{orbit.word:5s} {'stable' if orbit.stable else 'unstable':9s} {shown}"


figure, axes = plt.subplots(4, 4, figsize=(13, 12), layout="constrained")

# 4.9: slip only, with two crossings; then a stick between them. 4.10: a second slip goes.
for panels, pair in ((axes[0], (1.6, 1.72)), (axes[1], (2.5, 2.8))):
    for k, omega in enumerate(pair):
        orbit = orbit_at(5, omega)
        portrait, history = panels[2 * k : 2 * k + 2]
        orbit.plot(portrait)
        orbit.plot(history, x="t", y="v")
        history.axhline(1, color="#7a4a00", lw=0.8)
        number = "4.9" if omega < 2 else "4.10"
        portrait.set_title(rf"{number}: $A = 5$, $\omega = {omega}$: word {orbit.word}")
        print(f"figure {number:5s} A = 5    omega = {omega:<6} {row(orbit)}")

# 4.12: points 1 to 5 around the degenerate point of figure 4.11
points = [(2.4, 4.9), (2.7, 4.9), (1.6, 4.4), (1.8, 4.4), (2.0, 4.4)]
for k, (omega, A) in enumerate(points):
    orbit = orbit_at(A, omega)
    ax = axes.flat[8 + k]
    orbit.plot(ax)
    ax.set_title(rf"4.12, point {k + 1}: $({omega}, {A})$: {orbit.word}")
    print(f"figure 4.12  A = {A}  omega = {omega:<6} {row(orbit)}")

# 4.16: two stable orbits and a saddle; the printed starts are good to two digits
starts = [(-0.685, 3.01), (-0.295, 0.99), (-0.445, 1.27)]
for k, start in enumerate(starts):
    orbit = orbit_at(3.6, 1.067, start)
    ax = axes.flat[13 + k]
    orbit.plot(ax)
    ax.plot(*orbit.x0, "*", color="#c0392b", ms=9, label="t = 0")
    ax.set_title(f"4.16 ({'abc'[k]}): {'stable' if orbit.stable else 'unstable'}: {orbit.word}")
    x0 = ", ".join(f"{v:.9f}" for v in orbit.x0)
    print(f"figure 4.16  A = 3.6  omega = 1.067  {row(orbit)}  x0 = ({x0})")

for ax in axes.flat:
    if ax.get_xlabel() == "t":
        ax.set(xlabel="t (s)", ylabel="velocity v (m/s)")
    else:
        ax.set(xlabel="displacement y (m)", ylabel="velocity v (m/s)")
axes[0, 2].legend(fontsize=7, loc="lower center")
axes[3, 1].legend(fontsize=7, loc="lower center")

picture = sys.argv[1] if len(sys.argv) > 1 else "04_orbits.png"
figure.savefig(picture, dpi=150)
print(f"picture: {picture}")
