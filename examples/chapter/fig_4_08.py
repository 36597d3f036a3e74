# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.8: grazing-sliding, A = 0.5. P_trans^2 before and after it, what grazes, what follows.

The unstable orbit comes to touch the belt's velocity where the stable one has a short second stick;
both end there, a fold without a smooth turn (a border collision). Lyapunov exponents tell what
comes after it. Usage: python fig_4_08.py [picture.png] [--quick: shorter runs]
"""

import numpy as np
from figure import EDGE, MARK, SLIP, V, block, event_maps, options, orbit_at, plt, save, say

import filippov as fp

fig, axes = plt.subplots(2, 2, figsize=(9, 8), height_ratios=[5, 3.2])
graphs = event_maps(axes[0], [("(a)", 2.895, 2), ("(b)", 2.893, 2)])
for ax, graph in zip(axes[0], graphs, strict=True):
    inset = ax.inset_axes([0.66, 0.05, 0.31, 0.24])
    graph.plot(inset)
    inset.set(xlim=(3.45, 3.53), ylim=(3.45, 3.53), xticks=[3.45, 3.53], yticks=[3.45, 3.53])
    inset.set(xlabel="", ylabel="")
    inset.tick_params(labelsize=7)
    ax.indicate_inset_zoom(inset, edgecolor="#808080")
axes[0, 0].legend(loc="upper left")

branch = fp.continuation(orbit_at(0.5, 2.9), "omega", (2.89, 2.9))
(grazing,) = branch.special["grazing-sliding"]
say(grazing)
ends = [event for event in grazing.orbit.events if event["kind"] == "exit_sliding"]
touch = axes[1, 0]


def draw(orbit, dashes, label):
    """Draw the slip that comes to graze, from the end of the stick before it."""
    exits = orbit.events[orbit.events["kind"] == "exit_sliding"]
    end = exits["t"][np.abs(exits["phase"] - ends[0]["phase"]).argmin()]
    t = np.linspace(0, 1.3, 500)
    v = orbit.trajectory(2, rtol=1e-12, atol=1e-12).sol(end + t)[1]
    touch.plot(t, v, dashes, color="k" if dashes == ":" else SLIP, lw=1.6, label=label)


for word, dashes in (("0-", "--"), ("0-0-", "-")):
    points = np.flatnonzero(branch.word == word)
    for distance in (1e-6, 2e-3):
        omega = grazing.param["omega"] + distance
        near = points[np.abs(branch.param["omega"][points] - omega).argmin()]
        orbit = orbit_at(0.5, omega, branch.orbit(near))
        mu = orbit.multipliers[0].real
        print(f"  {word:4s} at omega + {distance:.0e}: multiplier {mu:8.4f}")
    what = "stable" if orbit.stable else "unstable"
    draw(orbit, dashes, rf"{what}, word {word}, at $\omega_g + 0.002$")
draw(grazing.orbit, ":", r"both, at $\omega_g$")
touch.plot(grazing.t - ends[0]["t"], 1, "^", color=MARK)
touch.axhline(1, color=EDGE, lw=0.8)
touch.set(title="(c) what grazes", ylim=(0.966, 1.004))
touch.set(xlabel="time since stick ended (s)", ylabel=V)
touch.legend(loc="lower center")

quick = options().quick
window = 4000 if quick else 20_000
omegas = np.linspace(2.8925, 2.8945, 5 if quick else 41)
results = [
    fp.lyapunov(block, params={"A": 0.5, "omega": w}, transient=window, window=window)
    for w in omegas
]
first, error = np.transpose([[r.exponents[0], r.error[0]] for r in results])
print(f"Lyapunov exponents over {window} periods after {window}, by three errors:")
for what, chosen in (("positive", first > 3 * error), ("negative", first < -3 * error)):
    few = " ".join(f"{omega:.5f}" for omega in omegas[chosen])
    print(f"  {what} at", few if chosen.sum() < 6 else f"{chosen.sum()} of {omegas.size} values")
if not quick:  # digits of a chaotic run are rounding's, but for those that its error leaves
    for k in np.flatnonzero(first > 3 * error):
        print(f"  at {omegas[k]:.5f}: {first[k]:.4f} +- {error[k]:.4f}")
after = axes[1, 1]
after.errorbar(omegas, first, error, fmt="o", color="#1f5fa8", ms=3, capsize=2)
after.axhline(0, color="k", lw=0.8)
after.axvline(grazing.param["omega"], color=EDGE, ls="--", lw=0.9)
after.set(title="(d) what follows", xticks=np.linspace(2.8925, 2.8945, 5))
after.set(xlabel=r"$\omega$ (rad/s)", ylabel="Lyapunov exponent (1/s)")
save(fig)
