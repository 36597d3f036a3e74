# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.3: the four sliding bifurcations, each computed from a normal form.

The surface is z = 0 with F1 = (1, 0, L1(x, y)) below and F2 = (1, 0, -1) above, so that it slides
where L1 > 0. Of three neighbouring solutions the middle one meets the boundary L1 = 0 as the
bifurcating orbit does. Printed are their sequences of modes, what happens at the boundary, and the
conditions (4.24)-(4.29) there: full derivatives along F1, S1 = {h < 0}.
Usage: python fig_4_03.py [picture.png]
"""

import numpy as np
from figure import EDGE, MARK, SLIP, STICK, plt, save

import filippov as fp

# L1, starts before, at and after, duration
scenarios = {
    "crossing-sliding": (lambda x, y: y - x, [(-1, y, 1) for y in (-0.6, 0, 0.6)], 2.1),
    "grazing-sliding": (lambda x, y: y - x, [(-1.4, y, -0.98) for y in (-0.6, 0, 0.6)], 2.2),
    "switching-sliding": (lambda x, y: x - y, [(-1, y, 1) for y in (-0.6, 0, 0.6)], 3.0),
    "adding-sliding": (lambda x, y: y + x**2, [(-1.5, y, 0.3) for y in (0.6, 0, -0.6)], 3.2),
}


def normal_form(L1):
    @fp.system(state="x y z", surfaces={"sigma": "z"})
    def form(t, s, p):
        return 1, 0, np.where(s.z < 0, L1(s.x, s.y), -1)

    return form


def lie_derivatives(form, point):
    """L1, and its first and second derivative along F1."""

    def first(x):  # h = z is linear, and nothing depends on time
        return (form.jacobian(0, x, -1) @ form.field(0, x, -1))[2]

    step = form.field(0, point, -1) / 8  # first() is linear here, so the difference is exact
    second = (first(point + step) - first(point - step)) * 4
    return form.normal_components(0, point)[0], first(point), second


x, y = np.meshgrid(np.linspace(-1.7, 2, 75), np.linspace(-1, 1, 41))
paper = {"fc": "white", "ec": "none", "alpha": 0.8, "pad": 0.5}
fig = plt.figure(figsize=(9, 5.6), layout="none")
for k, (name, (L1, starts, duration)) in enumerate(scenarios.items()):
    form = normal_form(L1)
    # cells overlap, since a third of each is empty
    cell = (0.5 * (k % 2), 0.3 - 0.48 * (k // 2), 0.5, 0.78)
    ax = fig.add_axes(cell, projection="3d", computed_zorder=False)
    shade = {"levels": [-9, 0, 9], "colors": ["#efefef", "#e3cfa8"], "alpha": 0.8}
    ax.contourf(x, y, L1(x, y), offset=0, zorder=1, **shade)
    ax.contour(x, y, L1(x, y), levels=[0], offset=0, zorder=2, colors=EDGE, linewidths=1.4)
    words = []
    for when, start in zip(("before", "at", "after"), starts, strict=True):
        run = fp.simulate(form, start, (0, duration), rtol=1e-11, atol=1e-11)
        pieces = list(run.segments(points_per_step=40))
        words.append(f"{when} {''.join('-0+'[piece.mode + 1] for piece in pieces)}")
        for piece in pieces:
            look = {"color": STICK, "lw": 3.2} if piece.mode == 0 else {"color": SLIP, "lw": 1.4}
            ax.plot(*piece.y, zorder=3, **look)
        ax.text(*start, f"{when} ", ha="right", va="center", fontsize=8, bbox=paper)
        if when == "at":
            contacts = run.events[1:-1]
            met = contacts[np.abs(contacts["s"] + 1).argmin()]
    point = met["x_right"]
    ax.plot(*point, "o", color=MARK, ms=5, zorder=4)
    values = [*lie_derivatives(form, point), point[2]]
    L, L_1, L_2, h = (0.0 if abs(value) < 1e-9 else value for value in values)
    print(f"{name:18s} words: {', '.join(words)}")
    print(f"  {met['kind']}: h = {h:g}, L1 = {L:g}, L1' = {L_1:g}, L1'' = {L_2:g}")
    ax.text2D(0.75, 0.77, name, transform=ax.transAxes, ha="center")
    ax.patch.set_visible(False)
    ax.set(xlim=(-1.7, 2), ylim=(-1, 1), zlim=(-1.5, 1))
    ax.set_box_aspect((3.7, 2.2, 2.2), zoom=1.02)
    ax.view_init(26, -68)
    ax.set_axis_off()
fig.text(0.5, 0.02, "dark: the sliding region, $L_1 > 0$; thick: sliding", ha="center")
save(fig)
