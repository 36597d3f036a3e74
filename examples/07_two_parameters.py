# SPDX-License-Identifier: BSD-3-Clause
"""Two parameters (figures 4.11, 4.13): all bifurcations in a rectangle, from the model alone.

The switching-sliding curve ends at a degenerate point, where a crossing- and an adding-sliding
curve begin; two folds meet in a cusp. Figure 4.14: the second iterate of the transition map within
the wedge of the folds, on either of them and at the cusp.
"""

import matplotlib.pyplot as plt

import filippov as fp

block = fp.models.oscillator
fig, axes = plt.subplots(2, 3, figsize=(13, 8), layout="constrained")

# --- figures 4.11 and 4.13: one call each ---------------------------------------------------------
boxes = {
    "4.11": {"omega": (1.5, 3.2), "A": (4.0, 5.5)},
    "4.13": {"omega": (0.9, 1.6), "A": (3.0, 4.4)},
}
points = [(2.4, 4.9), (2.7, 4.9), (1.6, 4.4), (1.8, 4.4), (2.0, 4.4)]  # figure 4.12
found = {}
for ax, (figure, box) in zip(axes[0], boxes.items(), strict=False):
    found[figure] = fp.bifurcation_set(block, box)
    found[figure].plot(ax)
    for curve in found[figure].curves:
        ends = " to ".join(
            f"({curve.param['omega'][k]:.4f}, {curve.param['A'][k]:.4f})" for k in (0, -1)
        )
        print(f"{figure}  {curve.kind:17s} {ends}")
    for point in found[figure].specials:
        omega, A = point.param.values()
        print(f"{figure}  {point.kind} at omega = {omega:.9f}, A = {A:.9f}")
    ax.set(title=f"Figure {figure}", xlabel="omega", ylabel="A")
    ax.legend(fontsize="small")
for k, (omega, A) in enumerate(points):
    axes[0, 0].annotate(f"{k + 1}", (omega, A), ha="center", weight="bold")

# --- figure 4.14 ----------------------------------------------------------------------------------
orbit = fp.periodic_orbit(block, params={"A": 3.6, "omega": 1.067})
folds = fp.continuation(orbit, "omega", (0.9, 1.3)).special["fold"]
(cusp,) = found["4.13"].specials
cases = {
    "(a) within the wedge": orbit.params,
    "(b) at the cusp": cusp.orbit.params,
    "(c) on a fold": folds[0].orbit.params,
    "(d) on the other fold": folds[1].orbit.params,
}
for ax, (title, params) in zip([axes[0, 2], *axes[1]], cases.items(), strict=True):
    second = fp.event_map(block, iterate=2, params=dict(params))
    second.plot(ax)
    if params is orbit.params:  # elsewhere roots are double or triple, and their number is rounding
        slopes = ", ".join(f"{p.slope:.4f}" for p in second.fixed_points())
        print(f"4.14  slopes of P^2 at its fixed points {title}: {slopes}")
    ax.set_title(f"Figure 4.14 {title}")
fig.savefig("07_two_parameters.png", dpi=120)
