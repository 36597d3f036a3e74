# SPDX-License-Identifier: BSD-3-Clause
"""One table of wrong calls: each is an error that names the argument, none a crash, none a hang.

Wrong definitions have a table of their own in test_definitions.py, `simulate` in test_bad_input.py.
"""

import math
import re

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator
FREE = BLOCK.with_params(A=0)
BALL = fp.models.bouncing_ball
TWO = fp.models.two_blocks
BOX = {"y": (-3, 3, 8), "v": (-1.1, 3, 8)}
NAN, INF = math.nan, math.inf
STARTS = np.zeros((2, 4))


@pytest.fixture(scope="module")
def made():
    """Results whose methods are called wrongly."""
    orbit = fp.periodic_orbit(BLOCK, params={"A": 5, "omega": 2.5})
    assert orbit.success
    return {
        "orbit": orbit,
        "map": fp.event_map(BLOCK, params={"A": 5, "omega": 2.5}, samples=64),
        "basins": fp.basins(BLOCK, BOX),
        "run": fp.simulate(BLOCK, [0, 0], (0, 1)),
    }


TABLE = {
    # several starts
    "ragged starts": (lambda m: fp.ensemble(BLOCK, [[0, 0], [0]], (0, 1)), "x0"),
    "starts of another dimension": (lambda m: fp.ensemble(BLOCK, np.zeros((3, 4)), (0, 1)), "x0"),
    "starts of words": (lambda m: fp.ensemble(BLOCK, [["a"], ["b"]], (0, 1)), "x0"),
    "complex starts": (lambda m: fp.ensemble(BLOCK, np.zeros((2, 4), complex), (0, 1)), "x0"),
    "arrays that do not broadcast": (
        lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), params={"A": np.zeros(3)}),
        "params",
    ),
    "an unknown parameter": (lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), params={"B": 1}), "'B'"),
    "an endless run": (lambda m: fp.ensemble(BLOCK, STARTS, (0, INF)), "t_span"),
    "a tolerance of zero": (lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), rtol=0), "rtol"),
    "no threads": (lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), threads=0), "threads"),
    "half a thread": (lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), threads=0.5), "threads"),
    "a bound of no size": (lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), bounds={"y": 0}), "bounds"),
    "a progress that is no function": (
        lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), progress="yes"),
        "progress",
    ),
    # event maps
    "a map of a name": (lambda m: fp.event_map("oscillator"), "sys"),
    "a map without forcing": (lambda m: fp.event_map(fp.models.relay), "sys"),
    "no iterate": (lambda m: fp.event_map(BLOCK, iterate=0), "iterate"),
    "a part of an iterate": (lambda m: fp.event_map(BLOCK, iterate=1.5), "iterate"),
    "no samples": (lambda m: fp.event_map(BLOCK, samples=0), "samples"),
    "a NaN period": (lambda m: fp.event_map(BLOCK, max_periods=NAN), "max_periods"),
    "a phase in words": (lambda m: m["map"]("zero"), "phase"),
    "a boundary inside": (lambda m: m["map"](0.5, 0), "boundary"),
    "a cobweb from nowhere": (lambda m: m["map"].plot(cobweb=NAN), "cobweb"),
    # maps
    "a strobe without a period": (lambda m: fp.strobe_map(fp.models.relay, [0, 0, 0]), "sys"),
    "a strobe of a bad state": (lambda m: fp.strobe_map(BLOCK, [0]), "x0"),
    "derivatives by a stranger": (lambda m: fp.strobe_map(BLOCK, [0, 0], wrt="B"), "wrt"),
    "an unknown section": (lambda m: fp.section_map(BLOCK, [0, 0], section="turn"), "section"),
    # diagrams
    "a diagram over nothing": (lambda m: fp.bifurcation_diagram(BLOCK), "parameter"),
    "a diagram over two": (lambda m: fp.bifurcation_diagram(BLOCK, A=[1], V=[1]), "one"),
    "a diagram over a stranger": (lambda m: fp.bifurcation_diagram(BLOCK, B=[1]), "'B'"),
    "a diagram over no values": (lambda m: fp.bifurcation_diagram(BLOCK, A=[]), "A"),
    "a diagram over a plane": (lambda m: fp.bifurcation_diagram(BLOCK, A=[[1, 2]]), "A"),
    "a diagram over a NaN": (lambda m: fp.bifurcation_diagram(BLOCK, A=[1, NAN]), "A"),
    "a transient backwards": (
        lambda m: fp.bifurcation_diagram(BLOCK, A=[1], transient=-1),
        "trans",
    ),
    "nothing kept": (lambda m: fp.bifurcation_diagram(BLOCK, A=[1], keep=0), "keep"),
    "an unknown event": (lambda m: fp.bifurcation_diagram(BLOCK, A=[1], section="hit"), "section"),
    # orbits and branches
    "an orbit of nothing": (lambda m: fp.periodic_orbit(None), "sys"),
    "a guess of another shape": (lambda m: fp.periodic_orbit(BLOCK, [0, 0, 0]), "guess"),
    "a guess in words": (lambda m: fp.periodic_orbit(BLOCK, "stable"), "guess"),
    "no turns": (lambda m: fp.periodic_orbit(BLOCK, turns=0), "turns"),
    "a branch of a system": (lambda m: fp.continuation(BLOCK, "A", (1, 2)), "start"),
    "a branch over a stranger": (lambda m: fp.continuation(m["orbit"], "B", (1, 2)), "'B'"),
    "bounds that do not hold it": (
        lambda m: fp.continuation(m["orbit"], "omega", (3, 4)),
        "bounds",
    ),
    "bounds in reverse": (lambda m: fp.continuation(m["orbit"], "omega", (3, 2)), "bounds"),
    "one bound": (lambda m: fp.continuation(m["orbit"], "omega", 3), "bounds"),
    "an unknown bifurcation": (
        lambda m: fp.continuation(m["orbit"], "omega", (2, 3), detect="hopf"),
        "detect",
    ),
    "two parameters of an orbit": (
        lambda m: fp.continuation(m["orbit"], ("omega", "A"), ((2, 3), (4, 6))),
        "parameter",
    ),
    "periods of no length": (lambda m: m["orbit"].trajectory(0), "periods"),
    # cells and basins
    "a grid of a name": (lambda m: fp.basins(BLOCK, "y v"), "grid"),
    "a grid over one": (lambda m: fp.basins(BLOCK, {"y": (-3, 3, 8)}), "grid"),
    "a grid over a stranger": (lambda m: fp.basins(BLOCK, BOX | {"z": (0, 1, 8)}), "grid"),
    "a grid in reverse": (lambda m: fp.basins(BLOCK, BOX | {"y": (3, -3, 8)}), "y"),
    "a grid without cells": (lambda m: fp.basins(BLOCK, BOX | {"y": (-3, 3, 0)}), "y"),
    "a part of a cell": (lambda m: fp.cell_map(BLOCK, BOX | {"y": (-3, 3, 2.5)}), "y"),
    "no periods": (lambda m: fp.cell_map(BLOCK, BOX, periods=0), "periods"),
    "an unknown picture": (lambda m: m["basins"].plot(what="colour"), "what"),
    # exponents and geometry
    "one batch": (lambda m: fp.lyapunov(BLOCK, batches=1), "batches"),
    "no window": (lambda m: fp.lyapunov(BLOCK, window=0), "window"),
    "a region of three": (lambda m: fp.sliding_region(fp.models.relay, bounds={}), "sys"),
    "a region of no bounds": (lambda m: fp.sliding_region(BLOCK, bounds={}), "bounds"),
    "a NaN time": (lambda m: fp.sliding_region(BLOCK, NAN, bounds={"y": (0, 1), "v": (0, 1)}), "t"),
    "tangencies of no side": (
        lambda m: fp.tangencies(BLOCK, bounds={"y": (0, 1), "v": (0, 1)}, side=0),
        "side",
    ),
    # systems, solutions, files
    "a parameter by a new name": (lambda m: BLOCK.with_params(B=1), "'B'"),
    "a parameter that is no number": (lambda m: BLOCK.with_params(A="5"), "params"),
    "a state of another dimension": (lambda m: BLOCK.field(0, [0, 0, 0], 1), "x"),
    "a side for two surfaces": (lambda m: TWO.field(0, np.zeros(TWO.dim), 1), "side"),
    "times that do not fit": (lambda m: BLOCK.h([0, 1, 2], np.zeros((2, 2))), "t"),
    "a time beyond the run": (lambda m: m["run"].sol(2.0), "t"),
    "a NaN time of the run": (lambda m: m["run"].sol(NAN), "t"),
    "a file that is not there": (lambda m: fp.load("nowhere.npz"), "nowhere"),
    "formulas of a compiled model": (lambda m: fp.models.stiction.to_cpp(), "stiction"),
    # kinds of arguments
    "parameters in a list": (
        lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), params=[5]),
        "params = [5]",
    ),
    "parameters in a text": (
        lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), params=""),
        "params = ''",
    ),
    "a store of a number": (lambda m: fp.ensemble(BLOCK, STARTS, (0, 1), store=3), "store = 3"),
    "a rest in a list": (
        lambda m: fp.basins(BLOCK, BOX, rest=[1]),
        "rest = [1]: expected a mapping",
    ),
    "a rest of zero": (lambda m: fp.cell_map(BLOCK, BOX, rest=0), "rest = 0: expected a mapping"),
    "a sweep over a list": (
        lambda m: fp.follow_basins(BLOCK, BOX, ["A"], [1]),
        "parameter = ['A']",
    ),
    "a sweep with a number": (
        lambda m: fp.follow_basins(BLOCK, BOX, "A", [1], params=3),
        "params = 3: expected a mapping",
    ),
    "a boundary of nothing": (lambda m: fp.basin_boundary(None), "basins = None: expected Basins"),
    "an unstable set of a map": (lambda m: fp.unstable_set(m["map"]), "basins = <EventMap"),
    "one distance": (lambda m: m["basins"].uncertainty_exponent(0.1), "epsilons = 0.1: expected"),
    "a boundary in rows": (lambda m: m["map"](0.5, [[1], [1, 1]]), "boundary = [[1], [1, 1]]: exp"),
    "directions": (
        lambda m: fp.bifurcation_diagram(BLOCK, A=[1], direction=np.zeros(2)),
        "direction = [0., 0.]: expected",
    ),
    "values in rows": (lambda m: fp.bifurcation_diagram(BLOCK, A=[[1], [1, 2]]), "A = [[1], [1, 2"),
    "a follow in words": (
        lambda m: fp.bifurcation_diagram(BLOCK, A=[1], follow="no"),
        "follow = 'no': expected True or False",
    ),
    "dense output of a NaN": (
        lambda m: fp.simulate(BLOCK, [0, 0], (0, 1), dense_output=NAN),
        "dense_output = nan: expected True or False",
    ),
    "a truth for a number": (
        lambda m: fp.simulate(BLOCK, [0, 0], (0, 1), max_step=True),
        "max_step = True: expected a number",
    ),
    "events in a text": (lambda m: fp.simulate(BLOCK, [0, 0], (0, 1), events=""), "events = ''"),
    "a transient without end": (
        lambda m: fp.periodic_orbit(BLOCK, transient=10**30),
        "transient = 1000000000000000000000000000000: expected",
    ),
    "a wait without end": (
        lambda m: fp.section_map(BLOCK, [0, 0], max_time=1e30),
        "max_time = 1e+30: expected",
    ),
    "cycles without end": (lambda m: m["orbit"].trajectory(1e30), "periods = 1e+30: expected"),
    "a step out of the world": (
        lambda m: fp.continuation(m["orbit"], "omega", (2, 3), first_step=1e30),
        "first_step = 1e+30: expected",
    ),
    "a struct of a number": (lambda m: BLOCK.to_cpp(3), "name = 3: expected a text"),
    "a system called 3": (
        lambda m: fp.System("x", fields={"-": str, "+": str}, switch="x", name=3),
        "name = 3: expected a text",
    ),
    "components of numbers": (
        lambda m: fp.System([NAN], fields={"-": str, "+": str}, switch="x"),
        "state = [nan]: nan is no name",
    ),
    "a period of two": (
        lambda m: fp.system("x", period=lambda t, s: 1.0)(lambda t, s, p: (np.sign(s.x),)),
        "period = <function",
    ),
    "a path of bytes": (lambda m: fp.load(b"run.npz"), "path = b'run.npz': expected a path"),
    "a path of a number": (lambda m: m["run"].save(5), "path = 5: expected a path"),
    "axes in words": (lambda m: m["run"].plot("left"), "ax = 'left': expected Axes"),
    "axes of a picture in words": (
        lambda m: m["basins"].plot("left"),
        "ax = 'left': expected Axes",
    ),
    "a misspelt keyword of lines": (lambda m: m["run"].plot(colour="r"), "'colour'; expected"),
    "a misspelt keyword of images": (
        lambda m: m["basins"].plot(colours="r"),
        "'colours'; expected",
    ),
}


@pytest.mark.parametrize("name", TABLE)
def test_a_wrong_call_names_what_is_wrong(made, name):
    call, words = TABLE[name]
    with pytest.raises((ValueError, TypeError, OSError), match=re.escape(words)) as caught:
        call(made)
    assert len(str(caught.value)) < 600
    assert "filippov._core" not in str(caught.value)  # the last line of defence is not the first


def test_a_start_that_is_not_finite_is_a_status_of_its_own():
    starts = np.array([[0.0, NAN, INF], [0.0, 0.0, 0.0]])
    ends = fp.ensemble(BLOCK, starts, (0, 1)).status
    assert ends[0] == "ok"
    assert (ends[1:] == "not_finite").all()
