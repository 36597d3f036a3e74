# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.9: crossing-sliding, A = 5. A slide is born where the orbit crosses the surface.

Orbits and velocities at omega = 1.6, which only crosses, and at 1.72, which sticks; between them
the bifurcation, with its conditions. Usage: python fig_4_09.py [picture.png]
"""

import numpy as np
from figure import EDGE, V, orbit_at, plt, portrait, row, save, say

import filippov as fp

fig, axes = plt.subplots(2, 2, figsize=(9, 6.6))
for (plane, history), letters, omega in zip(axes, ("ab", "cd"), (1.6, 1.72), strict=True):
    orbit = orbit_at(5, omega)
    print(f"omega = {omega:<4}  {row(orbit)}")
    portrait(plane, orbit, rf"({letters[0]}) $\omega = {omega}$ rad/s")
    orbit.plot(history, x="t", y="v")
    history.axhline(1, color=EDGE, lw=0.8, ls="--")
    history.set(title=f"({letters[1]}) time evolution", xlabel="$t$ (s)", ylabel=V)
axes[1, 0].legend(loc="center", bbox_to_anchor=(0.5, 0.38))
inset = axes[1, 1].inset_axes([0.5, 0.68, 0.45, 0.29])  # the short stick
axes[1, 1].set_ylim(top=5.5)
orbit.plot(inset, x="t", y="v")
inset.set(xlim=(1.0, 1.25), ylim=(0.95, 1.05), xticks=[], yticks=[], xlabel="", ylabel="")
axes[1, 1].indicate_inset_zoom(inset, edgecolor="#808080")

(crossing,) = fp.continuation(orbit, "omega", (1.6, 1.72)).specials
say(crossing)
printed = 1 + 5 * 1.65768 * np.sin(4.34218680843852)
ours = 1 + 5 * crossing.param["omega"] * np.sin(crossing.phase)
print(f"condition (3), 1 + A omega sin(phase) > 0: {ours:.6f}; as printed {printed:.6f}")
save(fig)
