# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.14: P_trans^2 in the wedge of figure 4.13, at its cusp, and on either fold.

Three orbits, a triple root, and a double root beside a simple one, where stick ends at s = -1. Two
of the orbits stick twice, and have a point on the boundary s = +1, too. Printed are the slopes,
which are the multipliers of the orbits: +1 where roots meet.
Usage: python fig_4_14.py [picture.png]
"""

from figure import MARK, block, orbit_at, plt, save

import filippov as fp

inside = orbit_at(3.6, 1.067)
branch = fp.continuation(inside, "omega", (0.9, 1.3))
left, right = sorted(branch.special["fold"], key=lambda fold: fold.param["omega"])
curve = fp.continuation(left, ("omega", "A"), ((0.9, 1.6), (3.0, 4.4)))
(cusp,) = curve.special["cusp"]

cases = {
    "(a) region 1": inside,
    "(b) cusp $B_2$": cusp.orbit,
    r"(c) $\Gamma_{f1}$": left.orbit,
    r"(d) $\Gamma_{f2}$": right.orbit,
}
fig, axes = plt.subplots(2, 2, figsize=(8.6, 8.6))
for ax, (title, orbit) in zip(axes.flat, cases.items(), strict=True):
    omega, A = orbit.params["omega"], orbit.params["A"]
    second = fp.event_map(block, iterate=2, params={"omega": omega, "A": A})
    second.plot(ax, boundary=-1)
    print(f"{title[:3]} omega = {omega:.6f}, A = {A:.6f}", end=": ")
    if orbit is inside:  # elsewhere roots are double or triple, and their number is rounding
        found = ((f"{f.phase:.6f} (slope {f.slope:.4f})") for f in second.fixed_points())
        print("fixed points", ", ".join(found))
    else:
        ends = orbit.events[orbit.events["kind"] == "exit_sliding"]
        meets = ends["phase"][ends["mode_after"] < 0]
        ax.plot(meets, meets, "o", mfc="none", mec=MARK, mew=1.6, ms=14, label="roots meet")
        phases = ", ".join(f"{phase:.6f}" for phase in ends["phase"])
        print(f"roots meet at {phases}, multiplier {orbit.multipliers[0].real:.6f}")
    ax.set(title=rf"{title}: $\omega = {omega:.5g}$, $A = {A:.5g}$", aspect="equal")
    ax.set(xlim=(1.35, 2.55), ylim=(1.35, 2.55))
    ax.set_xlabel(r"phase $\phi$ of a stick-to-slip transition (rad)")
    ax.set_ylabel("phase 2 transitions later (rad)")
handles, names = axes[0, 0].get_legend_handles_labels()
named = dict(zip(names, handles, strict=True)) | {"roots meet": axes[0, 1].lines[-1]}
shown = [name for name in named if "slide" not in name]  # such phases are outside the picture
axes[0, 0].legend([named[name] for name in shown], shown, loc="upper left")
save(fig)
