# SPDX-License-Identifier: BSD-3-Clause
"""A bifurcation diagram by brute force: figure 4.5a of the chapter.

The phase at which the block begins to slip, over the frequency of the drive. From the right: one
transition an orbit; two below 2.9043, where the stick is cut in two (adding-sliding); below 2.8942
long cycles and what looks like chaos. Usage: python 02_bifurcation_diagram.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

diagram = fp.bifurcation_diagram(
    fp.models.oscillator,
    omega=np.linspace(2.84, 2.94, 201),
    params={"A": 0.5},
    section="exit_sliding",
    transient=200,
    keep=1000,
)

failed = np.count_nonzero(diagram.status != "ok")
print(f"{diagram.values.size} values, {failed} failed")
for omega in (2.94, 2.92, 2.905, 2.903, 2.9, 2.896, 2.8745, 2.8415):
    k = np.abs(diagram.values - omega).argmin()
    phases = np.unique(diagram.phase[diagram.value == k].round(3))
    listed = " ".join(f"{phase:.3f}" for phase in phases)
    print(f"omega = {diagram.values[k]:.4f}: {phases.size} phases: [{listed}]")

figure, ax = plt.subplots(figsize=(9, 5), layout="constrained")
diagram.plot(ax, color="k")
for omega, word in ((2.9043, "adding-sliding"), (2.8942, "grazing-sliding")):
    ax.axvline(omega, color="#e8a33d", lw=1, zorder=0)
    ax.annotate(word, (omega, 6.1), ha="left", va="top", rotation=-90, color="#7a4a00", fontsize=8)
ax.set(xlim=(2.84, 2.94), ylim=(0, 2 * np.pi))
ax.set_xlabel(r"$\omega$ (rad/s)")
ax.set_ylabel(r"phase $\omega t$ mod $2\pi$ where stick ends (rad)")

picture = sys.argv[1] if len(sys.argv) > 1 else "02_bifurcation_diagram.png"
figure.savefig(picture, dpi=150)
print(f"picture: {picture}")
