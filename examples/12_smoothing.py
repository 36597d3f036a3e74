# SPDX-License-Identifier: BSD-3-Clause
"""Smoothing, the rival method: figures 4.4 and 4.5b of the chapter.

The smoothed law nears the switched one as its steepness c1 grows; the diagram of transitions looks
the same, but the adding-sliding point has moved: a slip that stays within the stick band is not
seen. Usage: python 12_smoothing.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator.with_params(A=0.5, omega=2.94)
smooth = fp.smoothed(block, c1=1e8, band=1e-5)
transitions = {"section": "cross", "direction": 1, "method": "rodas5p", "rtol": 1e-8, "atol": 1e-8}


def slips(system, omega, **section):
    """Count transitions from stick to slip in the orbit, which takes four periods."""
    run = fp.bifurcation_diagram(system, omega=[omega], transient=150, keep=40, **section)
    return run.t_local.size / 10


def adding_sliding(system, **section):
    """Find the frequency below which the orbit has two slips, by bisection to 1e-7."""
    below, above = 2.897, 2.94
    while above - below > 1e-7:
        middle = (below + above) / 2
        below, above = (below, middle) if slips(system, middle, **section) == 1 else (middle, above)
    return above


exact = adding_sliding(block)
print(f"adding-sliding at omega = {exact:.6f}, event-driven")
for c1, band in ((1e8, 1e-3), (1e8, 1e-4), (1e8, 1e-5), (1e6, 1e-4), (1e4, 1e-3)):
    moved = adding_sliding(fp.smoothed(block, c1=c1, band=band), **transitions) - exact
    print(f"c1 = {c1:.0e}, stick band {band:.0e}: {moved:+.1e}")

figure, (law, switched, smoothed) = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
v = np.linspace(0.0, 2.0, 1001)
for c1, line in ((2, ":"), (10, "-."), (50, "--"), (1e8, "-")):
    system = fp.smoothed(block, c1=c1)
    points = np.array([np.full(v.size, 0.5), v])  # where the spring and the drive cancel at t = 0
    law.plot(v - 1, -system.field(0.0, points, [])[1] / 10, ls=line, label=f"$c_1$ = {c1:g}")
law.set(xlabel="relative velocity (m/s)", ylabel=r"$\mu_{III}$", title="the smoothed law (4.30)")
law.legend()

sweep = {"omega": np.linspace(2.84, 2.94, 101), "transient": 150, "keep": 60}
fp.bifurcation_diagram(block, **sweep).plot(switched, color="k")
fp.bifurcation_diagram(smooth, **sweep, **transitions).plot(smoothed, color="k")
for ax, title in ((switched, "event-driven"), (smoothed, "smoothed, $c_1 = 10^8$, band $10^{-5}$")):
    ax.axvline(exact, color="#e8a33d", lw=1, zorder=0)
    ax.set(xlim=(2.84, 2.94), ylim=(0, 2 * np.pi), xlabel=r"$\omega$ (rad/s)", title=title)
    ax.set_ylabel("phase where stick ends (rad)")

picture = sys.argv[1] if len(sys.argv) > 1 else "12_smoothing.png"
figure.savefig(picture, dpi=120)
print(f"picture: {picture}")
