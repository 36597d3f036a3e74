# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.12: the orbits at points 1 to 5 of figure 4.11, around the degenerate point B1.

Words, multipliers, and where each stick begins and ends. Usage: python fig_4_12.py [picture.png]
"""

from figure import POINTS, orbit_at, plt, portrait, row, save

fig, axes = plt.subplots(2, 3, figsize=(10.5, 6.2))
for k, ((omega, A), ax) in enumerate(zip(POINTS, axes.flat, strict=False), 1):
    orbit = orbit_at(A, omega)
    print(f"point {k}: omega = {omega}, A = {A}  {row(orbit)}")
    for event in orbit.events:
        if event["kind"] != "cross":
            y, s = event["x"][0], event["s"]
            print(f"  {event['kind']:13s} phase {event['phase']:.6f}  y = {y:9.6f}  s = {s:9.6f}")
    portrait(ax, orbit, rf"({'abcde'[k - 1]}) point {k}: $\omega = {omega}$, $A = {A}$")
handles, labels = axes[0, 0].get_legend_handles_labels()
axes[1, 2].legend(handles, labels, loc="center")
axes[1, 2].axis("off")
save(fig)
