# SPDX-License-Identifier: BSD-3-Clause
"""Draw run time against error from what bench_methods and the rivals in Python wrote.

bench_methods --json methods.json
python bench/plot_methods.py methods.json [rivals.json ...] --out docs/images
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

OURS = {
    "dopri5": {"color": "#1f5fa8", "marker": "o"},
    "dop853": {"color": "#101010", "marker": "s"},
    "rodas5p": {"color": "#c0392b", "marker": "^"},
    "arctan, rodas5p": {"color": "#e8a33d", "marker": "v", "linestyle": "--"},
    "tanh, rodas5p": {"color": "#7a4a00", "marker": "v", "linestyle": "--"},
    "time stepping": {"color": "#2a7f3e", "marker": "D", "linestyle": ":"},
    "stepping, 1/2": {"color": "#2a7f3e", "marker": "d", "linestyle": "--"},
}
TITLES = {
    "stick-slip": "oscillator (0.5, 2.94), 200 periods",
    "crossing": "oscillator (5, 1.6), 200 periods",
    "P1": "P1, Coulomb decay",
    "P2": "P2, curved surface",
    "P4": "P4, stick-slip with poles",
    "P6": "P6, relay feedback",
    "P8": "P8, stiff",
}


def rows_of(path):
    """Runs in a file: of bench_methods, or a list of rows."""
    content = json.loads(Path(path).read_text())
    rows = content["runs"] if isinstance(content, dict) else content
    return [row | {"problem": row.get("problem", row.get("case"))} for row in rows]


def main():
    """Draw one panel a problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", help="JSON files of runs")
    parser.add_argument("--out", default=".", help="folder of the picture")
    options = parser.parse_args()
    curves = defaultdict(lambda: defaultdict(list))
    for path in options.files:
        for row in rows_of(path):
            if row["error"] is not None and row["error"] > 0:
                curves[row["problem"]][row["method"]].append((row["error"], row["ms"]))
    figure, axes = plt.subplots(2, 4, figsize=(17, 8.5), layout="constrained")
    others = {}  # colours of what is not ours, by method
    panels = [problem for problem in TITLES if problem in curves]
    for problem, ax in zip(panels, axes.flat, strict=False):
        for method, points in curves[problem].items():
            colour = mpl.colormaps["tab20"](others.setdefault(method, len(others)) % 20)
            rival = {"linewidth": 0.9, "marker": ".", "color": colour}
            style = {"linewidth": 1.2, "markersize": 4} | OURS.get(method, rival)
            ax.loglog(*zip(*points, strict=True), label=method, **style)
        ax.set(title=TITLES[problem], xlabel="error of the final state", ylabel="milliseconds")
        ax.set_xlim(1e-14, 10)
        ax.invert_xaxis()
        ax.grid(alpha=0.3)
    for ax in axes.flat[len(panels) :]:
        ax.axis("off")
    handles = {}
    for ax in axes.flat:
        handles |= dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    axes.flat[-1].legend(handles.values(), handles.keys(), loc="center", ncols=2, fontsize=9)
    out = Path(options.out) / "methods.png"
    figure.savefig(out, dpi=110)
    print(f"picture: {out}")


if __name__ == "__main__":
    main()
