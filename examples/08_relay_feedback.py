# SPDX-License-Identifier: BSD-3-Clause
"""Orbits that slide many times: relay feedback of third order over its frequency omega.

The orbit is symmetric, so each sliding bifurcation happens in both halves at once; both are listed,
one is printed. One slide more at every adding-sliding bifurcation, until grazings take them away
again. The words are checked against plain runs that know nothing of the branch.
Usage: python 08_relay_feedback.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

relay = fp.models.relay.with_params(zeta=0.05)
start = fp.periodic_orbit(relay, x0=[0, 0.5, 0], params={"omega": 8.0}, raise_on_failure=True)
branch = fp.continuation(start, "omega", (5.0, 30.0))
for special in branch.specials:
    if special.side <= 0:  # a fold, or the lower half
        slides = [word.count("0") for word in (special.word_before, special.word_after)]
        print(
            f"{special.kind:16s} omega = {special.param['omega']:.10f}"
            f"   slides in a turn: {slides[0]} to {slides[1]}"
        )

checked = 0
for omega in (7.5, 9.0, 12.0, 15.0, 20.0, 24.5, 26.5, 28.0, 29.0):
    plain = fp.periodic_orbit(relay, x0=[0, 0.5, 0], params={"omega": omega})
    near = int(np.argmin(np.where(branch.stable, abs(branch.param["omega"] - omega), np.inf)))
    checked += plain.success and plain.word == branch.word[near]
print(f"words of plain runs that are the branch's: {checked} of 9")

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
slides = np.array([word.count("0") for word in branch.word])
for count in np.unique(slides):
    for stable, style in ((True, "-"), (False, "--")):
        shown = (slides == count) & (branch.stable == stable)
        period = np.where(shown, branch.period, np.nan)
        if shown.any():
            color = plt.cm.viridis(count / slides.max())
            label = f"{count} slides" if stable else None
            left.plot(branch.param["omega"], period, style, color=color, lw=2, label=label)
for kind, marker in (("adding-sliding", "^"), ("grazing-sliding", "o"), ("fold", "s")):
    points = branch.special.get(kind, ())
    left.plot(
        [s.param["omega"] for s in points],
        [s.orbit.period for s in points],
        marker,
        color="k",
        ms=5,
        mfc="w",
        label=kind,
    )
left.set_xlabel("omega")
left.set_ylabel("period")
left.legend(fontsize=8, ncols=2)
orbit = fp.periodic_orbit(relay, x0=[0, 0.5, 0], params={"omega": 20.0})
orbit.plot(right, x="x1", y="x2")
right.set_title(f"omega = 20: {orbit.word}")
picture = sys.argv[1] if len(sys.argv) > 1 else "08_relay_feedback.png"
figure.savefig(picture, dpi=120)
print(f"picture: {picture}")
