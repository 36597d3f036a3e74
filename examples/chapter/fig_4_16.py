# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.16: three periodic orbits that coexist at (A, omega) = (3.6, 1.067), one unstable.

Newton's iteration from the printed starts, which are good to the width of a line.
Usage: python fig_4_16.py [picture.png]
"""

from figure import MARK, orbit_at, plt, portrait, row, save

starts = [(-0.685, 3.01), (-0.295, 0.99), (-0.445, 1.27)]
fig, axes = plt.subplots(1, 3, figsize=(10.5, 3.5))
for ax, letter, start in zip(axes, "abc", starts, strict=True):
    orbit = orbit_at(3.6, 1.067, start)
    portrait(ax, orbit, f"({letter}) {'stable' if orbit.stable else 'unstable'}, word {orbit.word}")
    ax.plot(*orbit.x0, "*", color=MARK, mec="k", mew=0.5, ms=11, zorder=4, label="$t = 0$")
    y, v = orbit.x0
    print(f"({letter}) x0 = ({y:.9f}, {v:.9f}), printed {start}: {row(orbit)}")
axes[1].legend(loc="best")
save(fig)
