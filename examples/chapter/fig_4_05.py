# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.5: bifurcation diagram of the phases where stick ends, (a) event-driven, (b) smoothed.

A = 0.5, 1200 periods from rest for each omega, the last 1000 kept. Smoothed: (4.30) with c1 = 1e8;
for the stick band, which the chapter does not give, 1e-5 m/s. Below them the Lyapunov exponents of
the event-driven runs, since chaos is a claim to be tested.
Usage: python fig_4_05.py [picture.png] [--quick: an eighth of the values, a tenth of the periods]
"""

import numpy as np
from figure import EDGE, block, options, orbit_at, plt, save

import filippov as fp

quick = options().quick
omegas = np.linspace(2.84, 2.94, 26 if quick else 201)
runs = {"omega": omegas, "params": {"A": 0.5}, "transient": 200, "keep": 100 if quick else 1000}
smooth = fp.smoothed(block, c1=1e8, band=1e-5)
diagrams = {
    "(a) event-driven": fp.bifurcation_diagram(block, section="exit_sliding", **runs),
    "(b) smoothed, $c_1 = 10^8$, stick: $|v_{rel}| < 10^{-5}$ m/s": fp.bifurcation_diagram(
        smooth, section="cross", direction=1, method="rodas5p", rtol=1e-8, atol=1e-8, **runs
    ),
}


def phases(diagram, k):
    """Return the phases of one value, to three digits."""
    return np.unique(diagram.phase[diagram.value == k].round(3))


branch = fp.continuation(orbit_at(0.5, 2.94), "omega", (2.84, 2.94))
fig, axes = plt.subplots(3, 1, figsize=(8, 8.4), sharex=True, height_ratios=[3, 3, 1.4])
for ax, (title, diagram) in zip(axes, diagrams.items(), strict=False):
    diagram.plot(ax, color="k")
    ax.set(title=title, ylim=(0, 2 * np.pi), xlabel="")
    ax.set_ylabel(r"phase $\phi$ where stick ends (rad)")
    for point in branch.specials:
        omega = point.param["omega"]
        ax.axvline(omega, color=EDGE, lw=0.9, ls="--", zorder=0)
        ax.annotate(point.kind, (omega, 4.9), rotation=90, ha="right", va="center", fontsize=7.5)
    few = [k for k in range(omegas.size) if phases(diagram, k).size == 1]
    print(f"{title[:3]} {np.sum(diagram.status == 'ok')} of {omegas.size} runs ok;", end=" ")
    print(f"one phase for omega from {omegas[min(few)]:.4f}, {len(few)} values")
for omega in (2.94, 2.92, 2.9, 2.896):
    k = np.abs(omegas - omega).argmin()
    listed = [" ".join(f"{p:.3f}" for p in phases(d, k)) for d in diagrams.values()]
    print(f"omega = {omegas[k]:.3f}: phases event-driven {listed[0]}; smoothed {listed[1]}")

window = 2000 if quick else 4000
results = [
    fp.lyapunov(block, params={"A": 0.5, "omega": w}, transient=window, window=window)
    for w in omegas
]
first, error = np.transpose([[r.exponents[0], r.error[0]] for r in results])
positive = np.flatnonzero(first > 3 * error)
print(f"Lyapunov exponents over {window} periods after {window}:", end=" ")
print(f"positive by three errors at {positive.size} of {omegas.size} values")
if not quick:
    print(f"  and negative by three errors at {np.sum(first < -3 * error)}")
for k in positive:
    print(f"  omega = {omegas[k]:.4f}: {first[k]:.4f} +- {error[k]:.4f}")
axes[2].errorbar(omegas, first, error, fmt=".", color="#1f5fa8", ms=3, lw=1, capsize=1.5)
axes[2].axhline(0, color="k", lw=0.8)
axes[2].set(xlim=(2.84, 2.94), xlabel=r"$\omega$ (rad/s)", ylabel="Lyapunov\nexponent (1/s)")
save(fig)
