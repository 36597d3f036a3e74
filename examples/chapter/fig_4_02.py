# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.2: a stable sliding mode. Both fields point at the surface, so solutions stay on it.

The normal form x' = 1, y' = x/2 - sgn y has L1 = x/2 + 1 below and L2 = x/2 - 1 above its surface
y = 0: it slides for |x| < 2 with s = x/2 and leaves upwards at x = 2, where s = +1. The chapter's
(4.9) tests the difference of L1 and L2 only, which has the same sign everywhere here; attracting is
the surface where L1 > 0 > L2. Usage: python fig_4_02.py [picture.png]
"""

import numpy as np
from figure import EDGE, SLIP, STICK, plt, save

import filippov as fp


@fp.system(state="x y", surfaces={"sigma": "y"})
def normal_form(t, s, p):
    return 1, s.x / 2 - np.sign(s.y)


print("    x     L1     L2      s    L2 - L1")
for x in (-3, -1, 0, 1, 3):
    L1, L2 = normal_form.normal_components(0, [x, 0])
    what = "slides" if L1 > 0 > L2 else "crosses"
    s = -(L1 + L2) / (L2 - L1)  # (4.12)
    print(f"{x:5.1f}  {L1:5.2f}  {L2:5.2f}  {s:5.2f}  {L2 - L1:5.2f}  {what}")

fig, ax = plt.subplots(figsize=(6, 3.4))
for side in (-1, 1):
    at = np.array(np.meshgrid(np.linspace(-3.3, 3.3, 14), side * np.array([0.35, 0.8, 1.3])))
    at = at.reshape(2, -1)
    field = normal_form.field(0, at, side)
    ax.quiver(*at, *field, color="#a0a0a0", width=0.0025, scale=45)
ax.axhline(0, color=EDGE, lw=0.8)
ax.axvspan(-2, 2, color="#f3ead9", zorder=0, lw=0)
for start in ([-3.2, 1.2], [-1.5, 1.3], [-2.2, -0.9], [-0.5, -1.3]):
    run = fp.simulate(normal_form, start, (0, 3.4 - start[0]), rtol=1e-10, atol=1e-10)
    run.plot(ax)
    for event in run.events[1:-1]:
        marker = {"enter_sliding": "o", "exit_sliding": "s", "cross": "x"}[event["kind"]]
        ax.plot(*event["x_right"], marker, mfc="w" if marker == "o" else "k", mec="k")
    print(
        f"from ({start[0]:4.1f}, {start[1]:4.1f}):",
        ", ".join(f"{e['kind']} at x = {e['x_right'][0]:.6f}" for e in run.events[1:-1]),
    )
ax.plot([], [], color=SLIP, lw=1.2, label="solutions off the surface")
ax.plot([], [], color=STICK, lw=3, label="sliding")
ax.legend(handles=ax.lines[-2:], loc="lower right")
ax.text(-3.4, 1.75, "$S_2$, $h > 0$", va="top")
ax.text(-3.4, -1.75, "$S_1$, $h < 0$")
both = r"over $\hat\Sigma$, $|s| < 1$: both fields point at the surface"
ax.text(0, 1.75, both, ha="center", va="top")
ax.set(xlim=(-3.5, 3.5), ylim=(-1.9, 1.9), xlabel="$x$", ylabel="$h = y$")
save(fig)
