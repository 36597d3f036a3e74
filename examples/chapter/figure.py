# SPDX-License-Identifier: BSD-3-Clause
"""What the figures of the chapter share: the model, one style, and how a picture is saved."""

import argparse
import io
import sys
from pathlib import Path

import matplotlib as mpl
from PIL import Image

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt

block = fp.models.oscillator

#: Told apart by width and dashes as well, for prints in grey.
SLIP, STICK, EDGE, MARK = "#1f5fa8", "#101010", "#7a4a00", "#c0392b"
CURVES = {
    "crossing-sliding": {"ls": "--", "color": "#2a7f3e", "label": r"$\Gamma_c$, crossing-sliding"},
    "adding-sliding": {"ls": "-.", "color": "#c0392b", "label": r"$\Gamma_a$, adding-sliding"},
    "switching-sliding": {"ls": "-", "color": SLIP, "label": r"$\Gamma_s$, switching-sliding"},
    "fold": {"ls": "-", "color": "#101010", "label": r"$\Gamma_{f1}, \Gamma_{f2}$, folds"},
}
POINTS = [(2.4, 4.9), (2.7, 4.9), (1.6, 4.4), (1.8, 4.4), (2.0, 4.4)]  # (omega, A), figure 4.12
Y, V = "displacement $y$ (m)", "velocity $v$ (m/s)"

plt.rcParams.update(
    {
        "figure.constrained_layout.use": True,
        "font.size": 9,
        "axes.titlesize": 9,
        "legend.fontsize": 7.5,
        "legend.framealpha": 0.9,
        "mathtext.fontset": "cm",
    }
)


def options():
    """Read the path of the picture, and whether a coarser one will do."""
    parser = argparse.ArgumentParser()
    parser.add_argument("picture", nargs="?", default=f"{Path(sys.argv[0]).stem}.png")
    parser.add_argument("--quick", action="store_true", help="coarser grids, shorter runs")
    return parser.parse_args()


def save(fig):
    """Write the picture with a palette of its own, which takes half the space."""
    drawn = io.BytesIO()
    fig.savefig(drawn, dpi=110)
    picture = options().picture
    few = Image.open(drawn).convert("RGB").quantize(64, Image.Quantize.MAXCOVERAGE)
    few.save(picture, optimize=True)
    print(f"picture: {Path(picture).name}")


def orbit_at(A, omega, guess=None, **more):
    return fp.periodic_orbit(
        block, guess, params={"A": A, "omega": omega}, raise_on_failure=True, **more
    )


def portrait(ax, orbit, title):
    """Draw an orbit in the phase plane; its slides are thick."""
    orbit.plot(ax)
    ax.set(title=title, xlabel=Y, ylabel=V)


def row(orbit):
    """Word, stability and multipliers of an orbit, as text."""
    mu = " ".join(
        f"{m.real:9.5f}{m.imag:+.5f}j" if m.imag else f"{m.real:9.5f}" for m in orbit.multipliers
    )
    return f"word {orbit.word:5s} {'stable' if orbit.stable else 'unstable':8s} multipliers {mu}"


def say(special):
    """Print a sliding bifurcation with the conditions (4.24)-(4.29) at its point."""
    omega, y = special.param["omega"], special.x[0]
    print(f"{special.kind} at omega = {omega:.9f}: y = {y:.9f}, phase = {special.phase:.9f}")
    for name, value in special.conditions.items():
        print(f"  {name:5s} = {'0' if abs(value) < 1e-9 else f'{value:.6f}'}")


def event_maps(axes, cases):
    """Draw iterates of P_trans at A = 0.5, print their fixed points, and return them."""
    print("     omega  iterate  phase         slope          periods")
    graphs = []
    for ax, (letter, omega, iterate) in zip(axes, cases, strict=True):
        graph = fp.event_map(block, iterate=iterate, params={"A": 0.5, "omega": omega})
        points = graph.fixed_points()
        for f in points:
            what = "stable" if f.stable else "unstable"
            number = f"{letter:4} {omega:<5}  {iterate:7}  {f.phase:.9f}"
            print(f"{number}   {f.slope:<13.7g}  {f.turns:7}  {what}")
        if not points:
            print(f"{letter:4} {omega:<5}  {iterate:7}  none")
        graphs.append(graph)
        graph.plot(ax)
        name = r"$P_{trans}$" if iterate == 1 else rf"$P_{{trans}}^{iterate}$"
        ax.set(title=rf"({letter[1]}) {name}, $\omega = {omega}$ rad/s", aspect="equal")
        ax.set(xlim=(-0.15, 6.45), ylim=(-0.15, 6.45))
        ax.set_xlabel(r"phase $\phi$ of a stick-to-slip transition (rad)")
        ax.set_ylabel(f"phase {iterate} transition{'s' if iterate > 1 else ''} later (rad)")
    return graphs
