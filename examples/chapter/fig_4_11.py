# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.11: curves of sliding bifurcations in the plane of omega and A, and the point B1.

The switching-sliding curve is followed down from A = 5. It ends where L2' = 0, in a degenerate
point, and the crossing- and the adding-sliding curve that begin there come with it. The crossing of
figure 4.9 lies on a second crossing-sliding curve.
Usage: python fig_4_11.py [picture.png]
"""

from figure import CURVES, POINTS, orbit_at, plt, save, say

import filippov as fp

box = (("omega", "A"), ((1.5, 3.2), (4.0, 5.5)))
branch = fp.continuation(orbit_at(5, 1.6), "omega", (1.5, 3.2))
(switching,) = branch.special["switching-sliding"]
(crossing,) = branch.special["crossing-sliding"]
gamma_s = fp.continuation(switching, *box)
(B1,) = gamma_s.special["degenerate-switching-sliding"]
second = fp.continuation(crossing, *box)

fig, ax = plt.subplots(figsize=(7, 4.8))
for curve in (gamma_s, *gamma_s.connected):
    ax.plot(curve.param["omega"], curve.param["A"], lw=1.6, **CURVES[curve.kind])
    (start, end) = (
        ", ".join(f"{curve.param[name][k]:.6f}" for name in ("omega", "A")) for k in (0, -1)
    )
    print(f"{curve.kind}: ({start}) to ({end})")
look = CURVES["crossing-sliding"] | {"lw": 1, "label": "another crossing-sliding curve"}
ax.plot(second.param["omega"], second.param["A"], **look)
for point, name in ((crossing, "4.9"), (switching, "4.10")):
    ax.plot(point.param["omega"], 5, "s", color="k", ms=4)
    ax.annotate(f"fig. {name}", (point.param["omega"], 5), (6, -3), textcoords="offset points")
near = fp.continuation(orbit_at(4.82, 2.4), "omega", (2.4, 2.6))  # at the chapter's A of B1
for point in near.specials:
    print(f"at A = 4.82 {point.kind} at omega = {point.param['omega']:.9f}")
print(f"B1: A = {B1.param['A']:.9f}", end=", ")
say(B1)
ax.plot(B1.param["omega"], B1.param["A"], "o", color="k", ms=7)
ax.annotate("$B_1$", list(B1.param.values()), (-6, 9), textcoords="offset points", fontsize=11)
for k, point in enumerate(POINTS, 1):
    ax.plot(*point, "o", mfc="white", mec="k", ms=13)
    ax.annotate(f"{k}", point, ha="center", va="center", fontsize=8)
ax.set(xlim=(1.5, 3.2), ylim=(4.0, 5.5), xlabel=r"$\omega$ (rad/s)", ylabel="$A$ (N)")
ax.legend(loc="lower right")
save(fig)
