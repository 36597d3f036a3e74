# SPDX-License-Identifier: BSD-3-Clause
"""Two blocks on a belt, and a block in front of a wall.

Two blocks joined by a spring stick and slip in turn: the bifurcation diagram over the velocity of
the belt, points where the first block begins to slip, and the orbits with their multipliers. A
block that is forced in front of a wall, moved towards it: the wall at which the free orbit grazes,
and what impacts make of it there.
Usage: python 10_several_surfaces.py [picture.png] [values]  (400 make a fine picture, in minutes)
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

n = int(sys.argv[2]) if len(sys.argv) > 2 else 120

# --- stick and slip of two blocks ---
chain = fp.models.belt_chain_2
start = [0.5, 0.0, -0.3, 0.0]
slips = fp.bifurcation_diagram(
    chain, V=np.linspace(0.05, 0.4, n), x0=start, surface=0, transient=400, keep=200
)
print("two blocks: orbits at the belt's velocity V")
for V in (0.4, 0.35, 0.3, 0.2):
    orbit = fp.periodic_orbit(chain.with_params(V=V), x0=start)
    sizes = ", ".join(f"{abs(m):.6f}" for m in orbit.multipliers)
    print(f"  V = {V}: period {orbit.period:.9f}, word {orbit.word}, |multipliers| {sizes}")
chaos = fp.lyapunov(chain.with_params(V=0.1), start, transient=500, window=1000)
lost = int(np.isneginf(chaos.exponents).sum())
sign = "positive" if chaos.exponents[0] > 0.01 else "not positive"
print(f"  V = 0.1: largest Lyapunov exponent {sign}, {lost} directions lost to slides")

# --- impacts and friction ---
block = fp.models.impact_belt.with_params(A=0.8, omega=0.5, F=0.4, V=0.2, e=0.5)


def turns(t, y):
    """Velocity, which falls through zero where the block is nearest to the wall."""
    return y[1]


turns.direction = -1
free = fp.simulate(
    block, [0, 0], (0, 40 * block.period()), params={"wall": 20}, events=turns, rtol=1e-12
)
wall = free.events[free.events["kind"] == "section"]["x_left"][-4:, 0].max()
print(f"\nblock and wall: the free orbit grazes a wall at {wall:.9f}")
walls = np.linspace(1.05, 1.25, n)
settings = {"section": "strobe", "transient": 100, "keep": 60, "follow": True}
nearer = fp.bifurcation_diagram(block, wall=walls[::-1], **settings)
farther = fp.bifurcation_diagram(block, wall=walls, **settings)
impacts = fp.bifurcation_diagram(
    block,
    wall=[wall + 1e-9, wall - 1e-9],
    section="jump",
    transient=300,
    keep=60,
    x0=free.sol(30 * block.period()),
)
for k, side in enumerate(("farther", "nearer")):
    speeds = -impacts.y[1][impacts.value == k] / block.params["e"]
    what = f", of speed {speeds.min():.6f} to {speeds.max():.6f}" if speeds.size else ""
    print(f"  the wall 1e-9 {side}: {speeds.size} impacts in 60 periods{what}")
touched = farther.values[np.unique(farther.value[farther.y[0] < 0.825])]
print(f"  moved away again, the wall is hit up to {touched.max():.4f}")

figure, axes = plt.subplots(1, 2, figsize=(12, 4.6), layout="constrained")
slips.plot(axes[0], color="black", markersize=1, label="")
axes[0].set(xlabel="velocity V of the belt", ylabel="$x_1$ where block 1 begins to slip")
axes[0].set_title("two blocks on a belt")
for diagram, size, colour, label in (
    (farther, 4, "tab:red", "wall moved away"),
    (nearer, 1.5, "black", "wall moved nearer"),
):
    axes[1].plot(
        diagram.values[diagram.value], diagram.y[0], ".", ms=size, color=colour, label=label
    )
axes[1].axvline(wall, color="tab:blue", lw=0.8, label="the free orbit grazes")
axes[1].set(xlabel="position of the wall", ylabel="x once a period", title="impacts and friction")
axes[1].legend(markerscale=2)
picture = sys.argv[1] if len(sys.argv) > 1 else "10_several_surfaces.png"
figure.savefig(picture, dpi=120)
print(f"\npicture: {picture}")
