# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.10: switching-sliding, A = 5. The orbit no longer passes the surface before it sticks.

Orbits at omega = 2.5, which crosses to v > V and then sticks, and at 2.8, which stays at v <= V;
between them the bifurcation at the boundary s = +1. Usage: python fig_4_10.py [picture.png]
"""

from figure import orbit_at, plt, portrait, row, save, say

import filippov as fp

fig, axes = plt.subplots(1, 2, figsize=(9, 3.6))
for ax, letter, omega in zip(axes, "ab", (2.5, 2.8), strict=True):
    orbit = orbit_at(5, omega)
    print(f"omega = {omega:<3}  {row(orbit)}")
    portrait(ax, orbit, rf"({letter}) $\omega = {omega}$ rad/s")
axes[0].legend(loc="center")

(switching,) = fp.continuation(orbit, "omega", (2.5, 2.8)).specials
say(switching)
save(fig)
