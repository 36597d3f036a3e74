# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.4: the friction law smoothed by (4.30), (2/pi) atan(c1 v_rel) mu(|v_rel|).

The larger c1, the nearer it comes to (4.5), but from below and slowly: beyond the layer it falls
short by the share 2/(pi c1 v_rel). As printed, with the odd mu_II of (4.5), (4.30) would be even in
v_rel; meant is its magnitude. Usage: python fig_4_04.py [picture.png]
"""

import numpy as np
from figure import block, plt, save

import filippov as fp

v_rel = np.linspace(-2, 2, 4001)
states = np.array([np.full(v_rel.size, block.params["A"]), 1 - v_rel])  # spring and drive cancel


def law(c1):
    """mu_III at `v_rel`: the acceleration over g, where nothing else pulls."""
    return fp.smoothed(block, c1=c1).field(0.0, states, [])[1] / 10


# (4.5), from the side that is in force
sides = [block.field(0.0, states, side)[1] / 10 for side in (-1, 1)]
exact = np.where(v_rel > 0, *sides)

fig, (whole, near) = plt.subplots(1, 2, figsize=(9, 3.4))
print("    c1  largest  at v_rel  short of (4.5) at 0.1  and at 2")
for c1, dashes in ((2, ":"), (10, "-."), (50, "--"), (1e3, "-")):
    mu = law(c1)
    best = mu.argmax()
    short = [exact[at] - mu[at] for at in (np.abs(v_rel - v).argmin() for v in (0.1, 2))]
    print(f"{c1:6g}  {mu[best]:.5f}     {v_rel[best]:.3f}  {short[0]:21.6f}  {short[1]:8.6f}")
    for ax in (whole, near):
        ax.plot(v_rel, mu, dashes, color="#1f5fa8", lw=1.3, label=f"$c_1 = {c1:g}$")
for ax in (whole, near):
    for side in (v_rel < 0, v_rel > 0):
        name = "(4.5)" if side[0] else None
        ax.plot(v_rel[side], exact[side], color="#101010", lw=2.6, alpha=0.4, label=name)
    ax.set_xlabel(r"relative velocity $v_{rel} = V_{dr} - \dot y$ (m/s)")
whole.set(ylabel=r"friction coefficient $\mu_{III}$", title="the law")
near.set(xlim=(-0.02, 0.5), ylim=(0, 0.42), title="near the jump")
near.legend(loc="lower right")
save(fig)
