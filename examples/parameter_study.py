# SPDX-License-Identifier: BSD-3-Clause
"""A chart of attractor types over A and omega, with basins at a coarse grid of parameters.

Each row of the chart is a task, on the cores of this machine or on a Dask cluster; its results go
to a Zarr store as soon as they are there. Killed and started again, the study goes on where it was,
and ends with the same bits. The same script on a Slurm cluster: docs/scale.md.
Usage: python parameter_study.py [--points 100] [--basins 2] [--cells 100] [--store study]
           [--scheduler tcp://...] [--scheduler-file FILE] [--picture study.png]
"""

import argparse
import time
from pathlib import Path

import distributed
import numpy as np
import zarr

import filippov as fp

block = fp.models.oscillator
parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--points", type=int, default=100, help="of A, and of omega")
parser.add_argument("--basins", type=int, default=2, help="parameter values a side with basins")
parser.add_argument("--cells", type=int, default=100, help="a side, of the basins")
parser.add_argument("--store", type=Path, default=Path("study"), help="folder of the results")
parser.add_argument("--scheduler", help="address of a Dask cluster; none: one is started here")
parser.add_argument("--scheduler-file", help="the same, as Dask's scheduler writes it")
parser.add_argument("--picture", type=Path, help="where to draw the chart")


def attractor(A, omega):
    """Periods of the forcing in a turn, slides in it, and its largest multiplier.

    From the block at rest. No turns where no cycle of up to 16 periods was found: there it is
    the Lyapunov exponent that tells, a period, with its error.
    """
    here = block.with_params(A=A, omega=omega)
    orbit = fp.periodic_orbit(here, max_turns=16)
    if orbit.success:
        return orbit.turns, orbit.word.count("0"), abs(orbit.multipliers).max(), 0.0
    exponents = fp.lyapunov(here, transient=300, window=300, rtol=1e-9, atol=1e-10)
    return 0, 0, exponents.exponents[0], exponents.error[0]


def row(A, omegas):
    """One row of the chart, and the seconds that it took."""
    began = time.perf_counter()
    found = np.array([attractor(A, omega) for omega in omegas])
    return found, time.perf_counter() - began


def open_chart(path, A, omega):
    """The store of the chart; one of other parameters or of another version is refused."""
    shape = (len(A), len(omega))
    if not path.exists():
        new = path.with_name(path.name + ".new")  # it has its name when it is whole
        chart = zarr.open_group(new, mode="w", attributes={"version": fp.__version__})
        for name, values in (("A", A), ("omega", omega)):
            chart.create_array(name, data=values, dimension_names=[name])
        for name in ("turns", "slides", "multiplier", "error"):
            chart.create_array(
                name,
                shape=shape,
                chunks=(1, len(omega)),
                dtype="f8",
                fill_value=np.nan,
                dimension_names=["A", "omega"],
            )
        # Written last, after a row's values: a row counts when it has its seconds.
        chart.create_array(
            "seconds", shape=len(A), chunks=1, dtype="f8", fill_value=np.nan, dimension_names=["A"]
        )
        new.rename(path)
    chart = zarr.open_group(path, mode="r+")
    if not (np.array_equal(chart["A"][:], A) and np.array_equal(chart["omega"][:], omega)):
        parser.error(f"{path} holds another chart")
    if chart.attrs["version"] != fp.__version__:
        parser.error(f"{path} was begun by version {chart.attrs['version']}")
    return chart


def fill(chart, client, A, omega):
    """Compute the rows that are missing."""
    missing = np.flatnonzero(np.isnan(chart["seconds"][:]))
    if missing.size < len(A):
        print(f"{len(A) - missing.size} of {len(A)} rows are in the store")
    tasks = {client.submit(row, A[i], omega, pure=False): i for i in missing}
    for task, (found, seconds) in distributed.as_completed(list(tasks), with_results=True):
        i = tasks[task]
        for k, name in enumerate(("turns", "slides", "multiplier", "error")):
            chart[name][i] = found[:, k]
        chart["seconds"][i] = seconds
        print(f"row {i}: {seconds:.2f} s", flush=True)


def draw(chart, path):
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    turns = chart["turns"][:]
    chaos = (turns == 0) & (chart["multiplier"][:] > 3 * chart["error"][:])
    kinds = {"1": turns == 1, "2": turns == 2, "3, 4": (turns > 2) & (turns < 5)}
    kinds |= {"5 to 16": turns > 4, "none found": (turns == 0) & ~chaos, "chaos": chaos}
    kind = np.select(list(kinds.values()), range(len(kinds)))
    shades = ["#f2f2f2", "#cfd8e6", "#9db7d5", "#5b86b8", "#e0b060", "#7a1f1f"]
    fig, ax = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    colors = mpl.colors.ListedColormap(shades)
    mesh = ax.pcolormesh(chart["omega"][:], chart["A"][:], kind, cmap=colors, vmin=-0.5, vmax=5.5)
    bar = fig.colorbar(mesh, ticks=range(6), label="forcing periods in a cycle")
    bar.ax.set_yticklabels(list(kinds))
    ax.set(xlabel="$\\omega$ (rad/s)", ylabel="$A$ (N)", title="attractor from rest")
    fig.savefig(path, dpi=120)


def connect(args):
    if args.scheduler_file:
        return distributed.Client(scheduler_file=args.scheduler_file)
    if args.scheduler:
        return distributed.Client(args.scheduler)
    return distributed.Client(threads_per_worker=1, dashboard_address=None)


def main():
    args = parser.parse_args()
    A, omega = np.linspace(0.25, 5, args.points), np.linspace(0.8, 3.2, args.points)
    args.store.mkdir(exist_ok=True)
    chart = open_chart(args.store / "chart.zarr", A, omega)
    with connect(args) as client:
        fill(chart, client, A, omega)
        turns, counts = np.unique(chart["turns"][:], return_counts=True)
        for n, count in zip(turns, counts, strict=True):
            print(f"{count} points with {n:.0f} periods in a cycle")
        # The client in scope serves these, too; each has a store of its own.
        for a in np.linspace(3.5, 3.7, args.basins):
            for w in np.linspace(1.05, 1.08, args.basins):
                found = fp.basins(
                    block.with_params(A=a, omega=w),
                    {"y": (-4, 4, args.cells), "v": (-3, 4, args.cells)},
                    store=args.store / f"basins_{a:.3f}_{w:.3f}.zarr",
                    tile=2500,
                    threads=1,
                )
                print(f"A = {a:.3f}, omega = {w:.3f}: {found}")
    if args.picture:
        draw(chart, args.picture)
        print(f"picture: {args.picture}")


if __name__ == "__main__":  # workers of a cluster import this file
    main()
