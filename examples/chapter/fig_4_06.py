# SPDX-License-Identifier: BSD-3-Clause
"""Figure 4.6: P_trans at omega = 2.94 and its second iterate at 2.9, with the diagonal, A = 0.5.

Where the graph meets the diagonal are orbits, stable where its slope there is less than one in
magnitude. The slopes are derivatives through all events. Usage: python fig_4_06.py [picture.png]
"""

from figure import event_maps, plt, save

fig, axes = plt.subplots(1, 2, figsize=(9, 4.7))
event_maps(axes, [("(a)", 2.94, 1), ("(b)", 2.9, 2)])
axes[0].legend(loc="upper left")
save(fig)
