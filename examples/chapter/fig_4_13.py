# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.13: two curves of folds meet in the cusp B2; in the wedge between them are three orbits.

The folds are those of the branch over omega at A = 3.6, followed in both parameters. How many
orbits of one forcing period there are is counted on both sides, from the fixed points of the
transition map. Usage: python fig_4_13.py [picture.png]
"""

from figure import CURVES, block, orbit_at, plt, save

import filippov as fp

branch = fp.continuation(orbit_at(3.6, 1.067), "omega", (0.9, 1.3))
folds = sorted(branch.special["fold"], key=lambda fold: fold.param["omega"])
for fold in folds:
    print(f"fold at A = 3.6: omega = {fold.param['omega']:.9f}, {fold.orbit.word}")
curve = fp.continuation(folds[0], ("omega", "A"), ((0.9, 1.6), (3.0, 4.4)))
(B2,) = curve.special["cusp"]
omega, A = B2.param.values()
print(f"cusp B2: omega = {omega:.9f}, A = {A:.9f}")
ends = curve.param["A"][[0, -1]]
print(f"the folds reach omega = 0.9 at A = {ends[0]:.6f} and {ends[1]:.6f}")


def orbits(omega, A):
    """Count the periodic orbits that take one period of the forcing, by their transitions."""
    params, count = {"omega": omega, "A": A}, 0
    for k in (1, 2, 3):
        points = fp.event_map(block, iterate=k, params=params, samples=256).fixed_points()
        count += sum(f.prime == k and f.turns == 1 for f in points) // k
    return count


fig, ax = plt.subplots(figsize=(7, 4.6))
ax.plot(curve.param["omega"], curve.param["A"], lw=1.6, **CURVES["fold"])
ax.fill(
    [*curve.param["omega"], 0.9],
    [*curve.param["A"], curve.param["A"][0]],
    color="#d9d9d9",
    label="region 1: three orbits",
)
for point in [(1.067, 3.6), (1.15, 3.71), (0.95, 3.4), (1.0, 3.7), (1.15, 3.5), (1.4, 4.05)]:
    n = orbits(*point)
    print(f"omega = {point[0]:5}, A = {point[1]:4}: {n} orbit{'s' if n > 1 else ''}")
    ax.annotate(f"{n}", point, ha="center", va="center", weight="bold")
ax.plot(omega, A, "*", color="k", ms=11)
ax.annotate("$B_2$", (omega, A), (8, 4), textcoords="offset points", fontsize=11)
ax.annotate(r"$\Gamma_{f1}$", (1.08, 3.72), ha="right", fontsize=11)
ax.annotate(r"$\Gamma_{f2}$", (1.18, 3.68), fontsize=11)
ax.set(xlim=(0.9, 1.6), ylim=(3.0, 4.4), xlabel=r"$\omega$ (rad/s)", ylabel="$A$ (N)")
ax.legend(loc="lower right")
save(fig)
