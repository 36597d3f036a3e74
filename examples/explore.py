# SPDX-License-Identifier: BSD-3-Clause
"""A page with sliders: orbit, map and basins of a block on a belt change while they move.

Usage: marimo run explore.py
"""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="A block on a belt")

with app.setup:
    import marimo as mo
    import numpy as np
    from matplotlib.figure import Figure

    import filippov as fp

    # periods of the forcing: of the longest cycle that is looked for, drawn of a run that is on
    # none, and for which the map waits for the next end of a slide
    LONGEST, DRAWN, WAIT = 64, 12, 20


@app.function
def settle(block: fp.System, start: list[float]) -> tuple[fp.Orbit, fp.Trajectory]:
    """Find the orbit that a start settles on and run along it, or just on for a while."""
    orbit = fp.periodic_orbit(block, x0=start, max_turns=LONGEST)
    if orbit.success:
        return orbit, orbit.trajectory()
    T = 2 * np.pi / block.params["omega"]
    settled = fp.simulate(block, start, (0, 200 * T), dense_output=False)
    return orbit, fp.simulate(block, settled.y[:, -1], (0, DRAWN * T))


@app.function
def transition_map(block: fp.System, iterate: int) -> fp.EventMap:
    """Compute the map as exactly as a screen shows it."""
    return fp.event_map(
        block, iterate=iterate, samples=128, rtol=1e-9, atol=1e-10, max_periods=WAIT
    )


@app.function
def label_cells(block: fp.System, cells: int) -> fp.Basins:
    """Label the cells; if their number is odd, no line of the grid lies on the surface v = V."""
    V = block.params["V"]
    return fp.basins(
        block,
        {"y": (-6, 8, cells), "v": (V - 5, V + 5, cells)},
        max_periods=2000,
        seeds=64,
        longest=LONGEST,
        saddle_starts=36,
        audit=0,
    )


@app.function
def say_orbit(orbit: fp.Orbit) -> str:
    if not orbit.success:
        return f"**No orbit** from this start: {orbit.message}. {DRAWN} periods are drawn."
    multipliers = ", ".join(f"{m if m.imag else m.real:.4g}" for m in orbit.multipliers)
    return (
        f"**Orbit** `{orbit.word}`, {'stable' if orbit.stable else 'unstable'}: "
        f"period {orbit.period:.6g} s, {orbit.turns} of the forcing; multipliers {multipliers}."
    )


@app.function
def say_map(graph: fp.EventMap) -> str:
    if not graph.success:
        return f"**No map**: {graph.message}"
    slopes = {
        what: ", ".join(f"{p.slope:.4g}" for p in graph.fixed_points() if p.stable == stable)
        for what, stable in (("stable", True), ("unstable", False))
    }
    points = "; ".join(f"{what}, of slope {listed}" for what, listed in slopes.items() if listed)
    gaps = "" if graph.defined.all() else f" Gaps: no slide ends within {WAIT} periods."
    return f"**Map**, fixed points of iterate {graph.iterate}: {points or 'none'}.{gaps}"


@app.function
def say_basins(basins: fp.Basins, start: list[float]) -> str:
    attractors = [
        f"({k}) {f'of period {a.period}' if a.periodic else f'no cycle up to {LONGEST}'}, "
        f"{basins.fractions.get(k, 0):.1%}"
        for k, a in enumerate(basins.attractors, 1)
    ]
    label, _ = basins.at(start)
    goal = f"({label})" if label > 0 else "none of them in time"
    missed = f" Unresolved: {len(basins.unresolved)} cells." if len(basins.unresolved) else ""
    return (
        f"**Basins** of {len(attractors)} attractor{'s' * (len(attractors) != 1)}: "
        f"{'; '.join(attractors)}. The start goes to {goal}.{missed}"
    )


@app.function
def draw_orbit(run: fp.Trajectory) -> Figure:
    """Draw the phase portrait over the sliding region, and the velocity over time."""
    figure = Figure(figsize=(11, 3.7), layout="constrained")
    portrait, history = figure.subplots(1, 2)
    run.plot_phase(portrait)
    portrait.set(xlabel="displacement y (m)", ylabel="velocity v (m/s)", title="phase portrait")
    portrait.legend(fontsize=8)
    run.plot(history, x="t", y="v")
    history.set(xlabel="time t (s)", ylabel="velocity v (m/s)", title="history")
    return figure


@app.function
def draw_map_and_basins(
    graph: fp.EventMap, basins: fp.Basins, run: fp.Trajectory, start: list[float]
) -> Figure:
    """Draw the map, and the basins with the settled motion and its start."""
    figure = Figure(figsize=(11, 3.7), layout="constrained")
    left, right = figure.subplots(1, 2)
    graph.plot(left)
    left.set(xlim=(0, 2 * np.pi), ylim=(0, 2 * np.pi), aspect="equal")
    left.set_title("from one end of a slide to the next")
    left.legend(fontsize=7, bbox_to_anchor=(1, 1), loc="upper left")
    basins.plot(right)
    run.plot(right)
    right.plot(*start, "*", color="#c0392b", markersize=10)
    for k, attractor in enumerate(basins.attractors, 1):
        right.annotate(f"({k})", attractor.points[:, 0], (6, 5), textcoords="offset points")
    right.set(xlabel="displacement y (m)", ylabel="velocity v (m/s)", title="basins")
    return figure


@app.function
def slider(label: str, start: float, stop: float, step: float, value: float) -> mo.ui.slider:
    return mo.ui.slider(start, stop, step, value, label=label, include_input=True, full_width=True)


@app.cell
def _():
    place = mo.ui.dropdown(
        {
            "4.5: a long cycle": (0.5, 2.87, 1),
            "4.6a: one stick": (0.5, 2.94, 1),
            "4.6b: two sticks": (0.5, 2.9, 2),
            "4.9: crossing-sliding": (5.0, 1.66, 1),
            "4.10: switching-sliding": (5.0, 2.79, 1),
            "4.15: three orbits": (3.6, 1.067, 2),
        },
        value="4.15: three orbits",
        label="figure of the chapter",
        full_width=True,
    )
    return (place,)


@app.cell
def _(place):
    A = slider("$A$", 0, 6, 0.01, place.value[0])
    omega = slider(r"$\omega$", 0.3, 4, 0.001, place.value[1])
    V = slider("$V$", 0.2, 3, 0.05, 1)
    y = slider("$y$ at the start", -6, 8, 0.1, 0)
    v = slider("$v$ at the start", -4, 6, 0.1, 0)
    iterate = slider("iterate of the map", 1, 3, 1, place.value[2])
    cells = slider("cells, either way", 21, 201, 20, 81)
    return A, V, cells, iterate, omega, v, y


@app.cell
def _(A, V, cells, iterate, omega, place, v, y):
    head = mo.md(r"""
        ## A block on a belt

        $\ddot y = -y + A\cos\omega t + 10\,\mu(|u|)\,\mathrm{sign}\,u$, $u = V - \dot y$
    """)
    foot = mo.md("""
        Words: `0` sticks to the belt, `-` slips behind it, `+` ahead of it. Basins, at phase zero
        of the forcing: circles attract, crosses are saddles, the star is the start.
    """)
    mo.sidebar([head, place, A, omega, V, y, v, iterate, cells], foot, width="20rem")
    return


@app.cell
def _(A, V, omega):
    block = fp.models.oscillator.with_params(A=A.value, omega=omega.value, V=V.value)
    return (block,)


@app.cell
def _(block, v, y):
    start = [y.value, v.value]
    orbit, run = settle(block, start)
    mo.vstack([mo.md(say_orbit(orbit)), draw_orbit(run)])
    return run, start


@app.cell
def _(block, iterate):
    graph = transition_map(block, iterate.value)
    return (graph,)


@app.cell
def _(block, cells):
    basins = label_cells(block, cells.value)
    return (basins,)


@app.cell
def _(basins, graph, run, start):
    said = mo.hstack([mo.md(say_map(graph)), mo.md(say_basins(basins, start))], widths="equal")
    mo.vstack([said, draw_map_and_basins(graph, basins, run, start)])
    return


if __name__ == "__main__":
    app.run()
