# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.1: a block on a moving belt, held by a spring and driven by A cos(omega t).

The picture is a sketch; printed are the model's parameters as the library has them, and its
friction by (4.5). Usage: python fig_4_01.py [picture.png]
"""

import numpy as np
from figure import block, plt, save
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

fig, ax = plt.subplots(figsize=(6, 3))
ax.set(xlim=(-0.3, 8.3), ylim=(-0.9, 3.1), aspect="equal")
ax.axis("off")

ax.add_patch(Rectangle((-0.2, 0), 0.2, 2.4, hatch="////", fill=False, lw=0))  # the fixed support
ax.plot([0, 0], [0, 2.4], "k", lw=1.5)
ax.plot(  # the spring, unstretched at y = 0
    np.interp(np.arange(12), [0, 1, 10, 11], [0, 0.5, 2.5, 3]),
    1.3 + 0.22 * np.array([0, 0, 1, -1, 1, -1, 1, -1, 1, -1, 0, 0]),
    "k",
    lw=1.2,
)
ax.text(1.5, 1.75, "$k$", ha="center", fontsize=12)
ax.add_patch(Rectangle((3, 0.6), 1.8, 1.4, fc="#d9d9d9", ec="k", lw=1.5))
ax.text(3.9, 1.3, "$m$", ha="center", va="center", fontsize=13)

ax.plot([1.1, 6.9], [0.6, 0.6], "k", lw=1.5)  # the belt and its pulleys
ax.plot([1.1, 6.9], [-0.6, -0.6], "k", lw=1.5)
for x in (1.1, 6.9):
    ax.add_patch(Circle((x, 0), 0.6, fc="white", ec="k", lw=1.5))
    ax.plot(x, 0, "k.", ms=4)


def arrow(start, end, text, at, **look):
    style = {"arrowstyle": "-|>", "mutation_scale": 13, "lw": 1.4, "color": "k"} | look
    ax.add_patch(FancyArrowPatch(start, end, **style))
    ax.text(*at, text, ha="center", va="center", fontsize=11)


arrow((4.8, 1.6), (6.3, 1.6), r"$A\cos\omega t$", (5.6, 1.9))
arrow((5.2, 0.78), (6.5, 0.78), "$V_{dr}$", (6.85, 0.82))
ax.plot([3.9, 3.9], [2.0, 2.75], "k", lw=0.8)
arrow((3.9, 2.6), (4.9, 2.6), "$y$", (5.1, 2.6), lw=1.0)
arrow((3.15, 0.4), (4.65, 0.4), "$F_{fr}$", (5.0, 0.3), color="#c0392b")

p = block.params
print(", ".join(f"{name} = {p[name]:g}" for name in ("m", "k", "g", "V")))
print(", ".join(f"{name} = {p[name]:g}" for name in ("alpha", "gamma", "beta", "eta")))
for r in (0.0, 1.0, 5.0):  # m g mu(r) is half of what the sides' fields differ by
    below, above = (block.field(0.0, [0.0, p["V"] - r], side, {"A": 0}) for side in (-1, 1))
    if r == 0:
        print(f"friction holds up to {p['m'] * (below - above)[1] / 2:g} N, and slips")
    else:
        print(f"  at {r:g} m/s with {p['m'] * below[1]:.6f} N")
save(fig)
