# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.7: adding-sliding. A stick touches the boundary s = -1 from inside and is cut in two.

The branch of orbits over omega, A = 0.5, finds the bifurcation by itself; orbits before, at and
after it, with the boundary of the sliding region and the velocity around the touch.
Usage: python fig_4_07.py [picture.png]
"""

import numpy as np
from figure import EDGE, MARK, STICK, V, Y, orbit_at, plt, portrait, row, save, say

import filippov as fp

start = orbit_at(0.5, 2.94)
branch = fp.continuation(start, "omega", (2.88, 2.95))
(adding,) = branch.special["adding-sliding"]
say(adding)
omega = adding.param["omega"]
around = {
    "before": orbit_at(0.5, omega + 0.006, start),
    "at": adding.orbit,
    "after": orbit_at(0.5, omega - 0.006, adding.orbit.x0, turns=adding.orbit.turns),
}

fig, axes = plt.subplots(3, 3, figsize=(9.5, 8.2))
for (when, orbit), (plane, belt, history) in zip(around.items(), axes.T, strict=True):
    print(f"{when:6s} omega = {orbit.params['omega']:.6f}  {row(orbit)}")
    portrait(plane, orbit, rf"{when}: $\omega = {orbit.params['omega']:.6f}$ rad/s")
    run = orbit.trajectory(2)  # two turns, so that the touch is not at an end
    t = np.linspace(0, 2 * orbit.period, 2001)
    phase = orbit.params["omega"] * t
    belt.plot(t, 4 + 0.5 * np.cos(phase), color=EDGE, lw=1.2, ls="--", label=r"$\partial\Sigma^-$")
    for piece in run.segments(points_per_step=8):
        if piece.mode == 0:
            belt.plot(piece.t, piece.y[0], color=STICK, lw=2.8)
    run.plot(history, x="t", y="v")
    if when == "at":
        belt.plot(adding.t, adding.x[0], "D", color=MARK, zorder=4, label="touches")
        history.plot(adding.t, adding.x[1], "D", color=MARK, zorder=4)
    belt.plot([], [], color=STICK, lw=2.8, label="stick")
    near = (adding.t - 0.9, adding.t + 0.9)
    belt.set(xlim=near, ylim=(2.6, 4.7), xlabel="$t$ (s)", ylabel=Y)
    history.set(xlim=near, ylim=(0.98, 1.004), xlabel="$t$ (s)", ylabel=V)
axes[1, 1].legend(loc="lower right")
save(fig)
