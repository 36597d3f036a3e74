# SPDX-License-Identifier: BSD-3-Clause
"""Every argument of every public function, given what it cannot be: the error names the argument.

What arguments have in common is written once, by their kind; the table says which is of which kind,
and a test compares it with the signatures.
"""

import inspect
import math
import re
from collections.abc import Mapping

import numpy as np
import pytest

import filippov as fp

NAN, INF = math.nan, math.inf
HUGE = 10**400  # no float
LONGER = 10**5000  # Python refuses to write it
BLOCK = fp.models.oscillator
RELAY = fp.models.relay
FREE = BLOCK.with_params(A=0)
BOX = {"y": (-3, 3), "v": (-1.1, 3)}
GRID = {"y": (-3, 3, 6), "v": (-1.1, 3, 6)}
MASKED = np.ma.masked_array([0.0, 1.0], [False, True])


@fp.system("x v", {"F": 0.4}, period="2*pi")
def typed(t, s, p):
    return s.v, np.cos(t) - s.x - p.F * np.sign(s.v)


@fp.system("x v", {"F": 0.4})
def still(t, s, p):
    return s.v, -s.x - p.F * np.sign(s.v)


def generated():
    yield 0.0
    yield 1.0


# --- what an argument of a kind cannot be ---------------------------------------------------------

NO_NUMBER = [
    "1", b"1", True, np.True_, 1j, [1.0, 2.0], {"a": 1}, {1.0}, np.ma.masked, object(), generated(),
    np.zeros(2), np.array("1"), np.datetime64("2001-01-01"), len, NAN, np.float64(NAN), HUGE,
    -HUGE, LONGER,
]  # fmt: skip
NO_COUNT = [
    *NO_NUMBER, -1, 2.5, INF, 10**30, 2**63, -(2**63), np.uint64(2**63), 1e30, np.array([3]),
]  # fmt: skip
NO_ARRAY = ["01", "ab", ["a", "b"], 1j, {"a": 0}, {0, 1}, object(), len, generated(), MASKED,
            [np.ma.masked, 1.0], [[0, 1], [0]], [0.0, 1j], [True, 0.0], [0.0, None],
            np.array([True, False]), np.array(["2001"], dtype="M8[Y]")]  # fmt: skip
NO_STATE = [
    *NO_ARRAY, 0.0, (), [0.0], [0.0, 0.0, 0.0], [[0.0, 0.0]], [[0.0], [0.0]], np.zeros((2, 2)),
    [0.0, NAN], [INF, 0.0], [0.0, HUGE], [LONGER, 0.0],
]  # fmt: skip
NO_WORD = ["", "nonsense", 3, 1.5, [], ["nonsense"], {}, NAN, b"stop", np.zeros(2), object()]
NO_PAIR = [
    None, 5.0, "01", (0.0,), (0.0, 1.0, 2.0), {0.0, 1.0}, {0: 0.0, 1: 1.0}, (0.0, NAN), (0.0, INF),
    ("0", "1"), (0.0, True), (0.0, 1j), (0.0, HUGE), (0.0, None), MASKED, [[0.0, 1.0]], object(),
]  # fmt: skip


def boxes(wrong):
    """Rectangles, of which one side is wrong."""
    none = [None, 3, "y v", [(-3, 3), (-1, 3)], {}, {"y": (-3, 3)}, {**BOX, "z": (0, 1)}]
    return none + [{**BOX, "y": pair} for pair in wrong]


WRONG = {
    "system": ["oscillator", None, 3, fp.models, fp.System, [BLOCK]],
    "number": [*NO_NUMBER, INF, -INF],
    "at least 0": [*NO_NUMBER, INF, -1.0, -1e-300],
    "above 0": [*NO_NUMBER, 0, -0.0, -1.0, -INF],
    "above 0, or infinite": [*NO_NUMBER, 0, -1.0, -INF],
    "within 0 and 1": [*NO_NUMBER, 0.0, 1.0, -0.5, INF],
    "count": [*NO_COUNT, 0],
    "count or 0": NO_COUNT,
    "flag": ["no", "", 2, -1, NAN, [], [True], {}, np.zeros(2), object(), HUGE],
    "params": [
        [5], "A", 3, 0, True, [("A", 1)], {"B": 1}, {3: 1}, {"A": True}, {"A": "5"}, {"A": None},
        {"A": NAN}, {"A": INF}, {"A": 1j}, {"A": HUGE}, {"A": np.ma.masked}, {"A": {}},
    ],
    "state": NO_STATE,
    "times": [
        *NO_ARRAY, None, 5.0, (0.0,), (0.0, 1.0, 2.0), {0: 0.0, 1: 1.0}, (0.0, NAN), (0.0, INF),
        (0.0, HUGE), (-INF, 0.0), ("0", 1.0),
    ],
    "word": NO_WORD,
    "tolerances": [
        *NO_ARRAY, True, -1e-9, NAN, INF, [1e-9], [1e-9] * 3, [[1e-9, 1e-9]], [1e-9, NAN], HUGE,
        "small", [1e-9, -1e-9], None,
    ],
    "bounds": boxes([*NO_PAIR, (3, -3), (1, 1), (-1e308, 1e308)]),
    "grid": [
        None, 3, "y v", ((-3, 3, 6), (-1, 3, 6)), {}, {"y": (-3, 3, 6)}, {**GRID, "z": (0, 1, 6)},
        *({**GRID, "y": three} for three in [
            *NO_PAIR[:4], (-3, 3), (3, -3, 6), (-3, 3, 0), (-3, 3, 2.5), (-3, 3, True),
            (-3, 3, 10**30), (-3, 3, 2**31), (-3, 3, 100_001), (NAN, 3, 6),
            (-1e308, 1e308, 6), (1, 1 + 2**-50, 6), (-3, HUGE, 6), {-3, 3, 6},
        ]),
    ],
    "path": [3, b"run", True, [], {}, 1.5, ""],
    "progress": ["yes", 1, 0, [], object(), np.True_],
    "axes": ["left", 3, [], object()],
    "mode": ["-", "up", 2, -2, 0.5, NAN, [1], np.array([1, -1]), True, {}, HUGE],
    "functions": [3, "", "x", {}, [3], [None], b"", object(), True, [lambda t: t],
                  lambda a, b, c, d: a],
}  # fmt: skip
NONE_TOO = ("count", "number", "above 0", "at least 0", "flag", "params", "progress")

# --- which argument is of which kind --------------------------------------------------------------

RUN = {"sys": "system", "params": "params", "rtol": "within 0 and 1"}
LIMITS = {"max_steps": "count", "max_events": "count", "on_nonunique": "word"}
FLOW = RUN | {"atol": "above 0"}
LANES = RUN | LIMITS | {
    "method": "word", "atol": "tolerances", "max_step": "above 0, or infinite",
    "threads": "count", "tile": "count", "store": "path", "progress": "progress",
    "escape": "bounds on size",
}  # fmt: skip
WRONG["bounds on size"] = [*NO_ARRAY, True, 0.0, -1.0, NAN, [1.0], [1.0] * 3, [1.0, 0.0]]
WRONG["swept"] = [[*NO_ARRAY], 1.0, [], [[1.0]], [NAN], [INF], [HUGE], ["1"], None]
WRONG["sections"] = [*NO_WORD, ["strobe", "cross"]]
WRONG["starts"] = [
    *NO_ARRAY, 0.0, [], [0.0], [0.0, HUGE], np.zeros((3, 2)), np.zeros((1, 2)), np.zeros((5, 2, 1)),
]  # fmt: skip
WRONG["start in periods"] = [*WRONG["number"], 1e300, -1e18]
WRONG["times of starts"] = [
    *NO_ARRAY,
    1e300,
    [0.0, -1e18],
    NAN,
    INF,
    HUGE,
    [0.0, NAN],
    np.zeros((2, 2)),
    None,
]
WRONG["moments"] = [
    *NO_ARRAY, 0.5, [NAN], [0.0, 2.0], [-1.0], [0.5, 0.2], [[0.0, 1.0]], [HUGE], [LONGER],
]  # fmt: skip
WRONG["names"] = ["B", "A B", 3, ["A", "A"], [3], {}.get, NAN, ["B"], object()]
WRONG["pair"] = NO_PAIR
WRONG["rest"] = [[1], "v", 3, 0, {"z": 1.0}, {"y": 1.0}, True]
WRONG["surface"] = ["0", 1, -1, 0.5, NAN, [0], True, HUGE, {}]
WRONG["guess"] = NO_STATE

# A function, arguments with which it is good and quick, and the kinds of its arguments.
WRONG["array"] = NO_ARRAY
FUNCTIONS = {
    "unit": ({"a": 1.0, "b": 2.0}, dict.fromkeys("abc", "array")),
    "simulate": (
        {"sys": BLOCK, "x0": [0, 0], "t_span": (0, 1)},
        RUN | LIMITS | {
            "x0": "state", "t_span": "times", "method": "word", "atol": "tolerances",
            "t_eval": "moments", "dense_output": "flag", "events": "functions",
            "max_step": "above 0, or infinite", "first_step": "above 0", "max_branches": "count",
            "raise_on_failure": "flag",
        },
    ),
    "ensemble": (
        {"sys": BLOCK, "x0": np.zeros((2, 3)), "t_span": (0, 1)},
        LANES | {"x0": "starts", "t_span": "times", "first_step": "above 0"},
    ),
    "basins": (
        {"sys": BLOCK, "grid": GRID},
        LANES | {
            "grid": "grid", "rest": "rest", "t0": "start in periods", "distance": "at least 0",
            "times": "flag", "max_periods": "count", "seeds": "count", "settle": "count",
            "longest": "count", "saddle_starts": "count or 0", "audit": "count or 0",
            "seed": "count or 0",
        },
    ),
    "cell_map": (
        {"sys": BLOCK, "grid": GRID},
        LANES | {
            "grid": "grid", "rest": "rest", "t0": "start in periods", "periods": "count",
            "section": "word", "after": "mode", "max_time": "above 0",
        },
    ),
    "follow_basins": (
        {"sys": BLOCK, "grid": GRID, "parameter": "A", "values": [1.0]},
        {
            "sys": "system", "grid": "grid", "parameter": "word", "values": "swept",
            "threshold": "above 0", "params": "params of others", "store": "path",
            "progress": "progress",
        },
    ),
    "bifurcation_diagram": (
        {"sys": BLOCK, "A": [1.0], "transient": 1, "keep": 1},
        RUN | LIMITS | {
            "section": "sections", "transient": "at least 0", "keep": "above 0", "x0": "state",
            "follow": "flag", "chains": "count", "params": "params of others",
            "surface": "surface", "direction": "mode", "method": "word", "atol": "tolerances",
            "max_step": "above 0, or infinite", "skip_repeats": "flag", "threads": "count",
            "progress": "progress", "A": "swept",
        },
    ),
    "bifurcation_set": (
        {"sys": BLOCK, "box": {"A": (4, 5), "omega": (2, 3)}},
        FLOW | {
            "box": "box", "params": "params of others", "x0": "state", "lines": "count",
            "starts": "count", "max_turns": "count", "transient": "at least 0",
            "window": "above 0", "max_curves": "count", "max_step": "above 0",
            "first_step": "above 0", "max_points": "count", "max_steps": "count",
            "progress": "progress",
        },
    ),
    "periodic_orbit": (
        {"sys": BLOCK},
        FLOW | {
            "guess": "guess", "turns": "count", "x0": "state", "transient": "at least 0",
            "max_turns": "count", "window": "above 0", "max_steps": "count",
            "raise_on_failure": "flag",
        },
    ),
    "event_map": (
        {"sys": BLOCK},
        FLOW | {
            "iterate": "count", "samples": "count", "max_periods": "above 0", "guess": "state",
            "max_evaluations": "count", "progress": "progress",
        },
    ),
    "strobe_map": (
        {"sys": BLOCK, "x0": [0, 0]},
        FLOW | {"x0": "starts", "iterate": "count", "t0": "times of starts", "wrt": "names"},
    ),
    "section_map": (
        {"sys": BLOCK, "x0": [0, 0]},
        FLOW | {
            "x0": "starts", "section": "word", "after": "mode", "surface": "surface",
            "iterate": "count", "t0": "times of starts", "max_time": "above 0", "wrt": "names",
        },
    ),
    "lyapunov": (
        {"sys": BLOCK, "transient": 0, "window": 20},
        FLOW | {
            "x0": "state", "transient": "at least 0", "window": "above 0", "stretch": "above 0",
            "batches": "count", "progress": "progress",
        },
    ),
    "sliding_region": (
        {"sys": BLOCK, "bounds": BOX},
        {"sys": "system", "t": "number", "bounds": "bounds with cells", "params": "params"},
    ),
    "sliding_boundaries": (
        {"sys": BLOCK, "bounds": BOX},
        {"sys": "system", "bounds": "bounds", "params": "params", "samples": "count",
         "seeds": "count"},
    ),
    "tangencies": (
        {"sys": BLOCK, "bounds": BOX},
        {"sys": "system", "t": "number", "bounds": "bounds", "side": "mode", "params": "params",
         "seeds": "count"},
    ),
    "equilibria": (
        {"sys": FREE, "bounds": BOX},
        {"sys": "system", "bounds": "bounds", "params": "params", "seeds": "count"},
    ),
    "boundary_equilibria": (
        {"sys": FREE, "parameter": "V", "span": (0, 1), "bounds": BOX},
        {"sys": "system", "parameter": "word", "span": "pair", "bounds": "bounds",
         "params": "params", "seeds": "count"},
    ),
    "time_stepping": (
        {"sys": typed, "x0": [0, 0], "t_span": (0, 1), "n_steps": 10},
        {"sys": "system", "x0": "state", "t_span": "times", "n_steps": "count",
         "theta": "within 1/2 and 1", "keep": "count", "params": "params of F"},
    ),
    "smoothed": (
        {"sys": typed},
        {"sys": "system", "c1": "above 0", "law": "word", "band": "above 0"},
    ),
    "load": ({"path": "nowhere.npz"}, {"path": "path", "most_bytes": "above 0"}),
    "show_config": ({}, {"mode": "word"}),
}  # fmt: skip
WRONG["bounds with cells"] = boxes(
    [each for each in NO_PAIR if not (isinstance(each, tuple) and len(each) == 3)]
)
WRONG["bounds or none"] = WRONG["bounds with cells"][1:]
WRONG["within 1/2 and 1"] = [*NO_NUMBER, 0.0, 0.49, 1.01, -1.0, INF, None]
WRONG["params of F"] = [each for each in WRONG["params"] if not isinstance(each, Mapping)]
WRONG["params of others"] = WRONG["params of F"]
WRONG["box"] = [None, 3, "A", {}, {"A": (4, 5)}, {"A": (4, 5), "B": (0, 1)}] + [
    {"A": (4, 5), "omega": each} for each in [*NO_PAIR, (3, 2), (-1e308, 1e308)]
]
#: What is no mistake of that argument.
GOOD = {
    ("params", None), ("store", None), ("x0", None), ("guess", None), ("turns", None),
    ("threads", None), ("tile", None), ("escape", None), ("first_step", None), ("side", None),
}  # fmt: skip
#: Keywords of artists go to matplotlib.
NOT_OURS = {"swept", "settings", "artist_kw"}
#: Reached without an argument, or made by others: these are read, and not called.
CALLED_ELSEWHERE = {
    "get_cmake_dir", "get_include", "system", "continuation", "basin_boundary", "unstable_set",
    "gsl_run",
}  # fmt: skip


def public_functions():
    every = {name: getattr(fp, name) for name in fp.__all__}
    return {name for name, value in every.items() if inspect.isfunction(value)}


def test_the_table_has_every_public_function():
    assert public_functions() == set(FUNCTIONS) | CALLED_ELSEWHERE


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_table_has_every_argument(name):
    _, kinds = FUNCTIONS[name]
    arguments = set(inspect.signature(getattr(fp, name)).parameters) - NOT_OURS
    assert set(kinds) - {"A"} == arguments  # A is swept


def refused(call, argument, value):
    """What is wrong with how a wrong value is refused; None if nothing is."""
    try:
        shown = repr(value)[:60]
    except ValueError:
        shown = "a number of 5001 digits"
    try:
        call(value)
    except (TypeError, ValueError) as error:
        told = str(error)
        named = re.search(rf"\b{re.escape(argument)}\b", told)
        if named and "_core" not in told and "incompatible" not in told and len(told) < 700:
            return None
        return f"{shown}: {type(error).__name__}: {told}"
    except BaseException as error:
        return f"{shown}: {type(error).__name__}: {error}"
    return f"{shown} is taken"


CASES = [(name, argument) for name, (_, kinds) in FUNCTIONS.items() for argument in kinds]


@pytest.mark.parametrize(("name", "argument"), CASES, ids=[f"{n}-{a}" for n, a in CASES])
def test_what_an_argument_cannot_be_is_refused_by_its_name(name, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    good, kinds = FUNCTIONS[name]
    function = getattr(fp, name)
    wrong = [
        refused(lambda value: function(**(good | {argument: value})), argument, value)
        for value in WRONG[kinds[argument]]
    ]
    assert [each for each in wrong if each is not None] == []
    assert list(tmp_path.iterdir()) == []  # before any work


# --- of what is made --------------------------------------------------------------------------

WRONG["times of a run"] = [*NO_ARRAY, None, NAN, -0.5, 1.5, INF, HUGE, [0.5, 2.0], [[0.5]]]
WRONG["points"] = [*NO_ARRAY, 0.0, [0.0], [0.0, 0.0, 0.0], np.zeros((3, 2)), np.zeros((1, 2)), None]
WRONG["any times"] = [*NO_ARRAY, None, [[0.0]], [0.0, 1.0]]
WRONG["side"] = ["-", 2, 0.5, True, [1, 1], [True], None, {}, NAN, HUGE, np.array([1, -1])]
WRONG["other sides"] = [side for side in WRONG["side"] if side is not None]
WRONG["quantities"] = ["z", 3, [], ["z"], ["x", 3], {}, NAN, b"x"]
WRONG["quantity"] = ["z", 3, [], ["x"], {}, NAN, b"x"]
WRONG["index"] = [*NO_COUNT, 10**6, 2**31]
WRONG["distances"] = [0.1, [0.1], [0.1, -0.1], [0.1, NAN], [0.1, True], "ab", None, [0.1, HUGE],
                      {0.1, 0.2}]  # fmt: skip
WRONG["phases"] = [*NO_ARRAY, NAN, INF, HUGE, None]
WRONG["circles"] = [*NO_ARRAY, 0, 2, NAN, [1, 0], None]
WRONG["name"] = [3, b"x", [], True, {}, object()]
WRONG["params of h"] = [[5], 3, {"B": 1}, {"A": True}, {"A": NAN}, {"A": HUGE}, {"A": "1"}]

CALLS = {
    "sol": (lambda m: m["run"].sol, {"t": 0.5}, {"t": "times of a run"}),
    "sol.mode": (lambda m: m["run"].sol.mode, {"t": 0.5}, {"t": "times of a run"}),
    "sol.s": (lambda m: m["run"].sol.s, {"t": 0.5}, {"t": "times of a run"}),
    "Trajectory.s": (lambda m: m["run"].s, {"t": 0.5}, {"t": "times of a run"}),
    "Trajectory.segments": (
        lambda m: lambda **kw: list(m["run"].segments(**kw)),
        {}, {"points_per_step": "count"},
    ),
    "Trajectory.event_table": (
        lambda m: m["run"].event_table, {}, {"last": "count or 0", "digits": "count or 0"},
    ),
    "Trajectory.plot": (
        lambda m: m["run"].plot, {}, {"ax": "axes", "x": "quantity", "y": "quantities"},
    ),
    "Trajectory.plot_phase": (
        lambda m: m["run"].plot_phase, {}, {"ax": "axes", "bounds": "bounds or none"},
    ),
    "Trajectory.save": (lambda m: m["run"].save, {"path": "run.npz"}, {"path": "path"}),
    "System.h": (
        lambda m: BLOCK.h, {"t": 0.0, "x": [0, 0]},
        {"t": "any times of one", "x": "points", "params": "params of h"},
    ),
    "System.field": (
        lambda m: BLOCK.field, {"t": 0.0, "x": [0, 0], "side": 1},
        {"t": "any times of one", "x": "points", "side": "side", "params": "params of h"},
    ),
    "System.jacobian": (
        lambda m: BLOCK.jacobian, {"t": 0.0, "x": [0, 0], "side": 1},
        {"t": "any times of one", "x": "points", "side": "side", "params": "params of h"},
    ),
    "System.normal_components": (
        lambda m: BLOCK.normal_components, {"t": 0.0, "x": [0, 0]},
        {"t": "any times of one", "x": "points", "side": "other sides", "surface": "surface",
         "params": "params of h"},
    ),
    "System.equivalent_control": (
        lambda m: BLOCK.equivalent_control, {"t": 0.0, "x": [0, 0]},
        {"t": "any times of one", "x": "points", "side": "other sides", "surface": "surface",
         "params": "params of h"},
    ),
    "System.period": (lambda m: BLOCK.period, {}, {"params": "params of h"}),
    "System.to_cpp": (lambda m: typed.to_cpp, {}, {"name": "name"}),
    "Basins.at": (lambda m: m["basins"].at, {}, {"points": "points"}),
    "Basins.sample": (
        lambda m: m["basins"].sample, {"n": 2},
        {"n": "count", "level": "within 0 and 1", "seed": "count or 0"},
    ),
    "Basins.entropy": (lambda m: m["basins"].entropy, {}, {"box": "box of cells"}),
    "Basins.uncertainty_exponent": (
        lambda m: m["basins"].uncertainty_exponent, {"pairs": 2},
        {"epsilons": "distances", "pairs": "count", "seed": "count or 0", "progress": "progress"},
    ),
    "Basins.refine": (
        lambda m: m["basins"].refine, {"coarse": 2, "levels": 1, "audit": 1},
        {"coarse": "count", "levels": "count or 0", "time_jump": "count or 0",
         "audit": "count or 0", "seed": "count or 0", "full_dimension": "above 0",
         "max_points": "count"},
    ),
    "Basins.plot": (lambda m: m["basins"].plot, {}, {"ax": "axes", "what": "word"}),
    "basin_boundary": (
        lambda m: fp.basin_boundary, {"basins": None},
        {"basins": "system", "distance": "above 0", "width": "above 0", "turn": "above 0",
         "near": "within 0 and 1", "max_labels": "count", "progress": "progress"},
    ),
    "EventMap": (lambda m: m["map"], {"phase": 0.5}, {"phase": "phases", "boundary": "circles"}),
    "EventMap.plot": (
        lambda m: m["map"].plot, {"cobweb": 0.5, "iterations": 1},
        {"ax": "axes", "boundary": "mode", "cobweb": "number", "iterations": "count"},
    ),
    "Orbit.trajectory": (
        lambda m: m["orbit"].trajectory, {}, {"periods": "above 0", "rtol": "within 0 and 1"},
    ),
    "Orbit.plot": (lambda m: m["orbit"].plot, {}, {"ax": "axes", "x": "quantity", "y": "quantity"}),
    "continuation": (
        lambda m: fp.continuation,
        {"start": "orbit", "parameter": "omega", "bounds": (2.4, 2.6), "max_points": 1},
        {"start": "system", "parameter": "word", "bounds": "pair", "detect": "kinds",
         "max_step": "above 0", "first_step": "above 0", "max_points": "count",
         "rtol": "within 0 and 1", "atol": "above 0", "max_steps": "count",
         "progress": "progress"},
    ),
    "Ensemble.plot": (
        lambda m: m["ends"].plot, {}, {"ax": "axes", "x": "quantity", "y": "quantity"},
    ),
    "Diagram.plot": (lambda m: m["diagram"].plot, {}, {"ax": "axes", "y": "quantity"}),
}  # fmt: skip
WRONG["kinds"] = ["", "nonsense", 3, 1.5, ["nonsense"], NAN, b"stop", np.zeros(2), object()]
WRONG["any times of one"] = [*NO_ARRAY, None, [[0.0]]]
WRONG["box of cells"] = [*NO_COUNT, 0, 1, 7]
METHODS = [(name, argument) for name, (_, _, kinds) in CALLS.items() for argument in kinds]


@pytest.fixture(scope="module")
def made():
    """Results whose methods are called."""
    pytest.importorskip("matplotlib").use("Agg")
    orbit = fp.periodic_orbit(BLOCK, params={"A": 5, "omega": 2.5})
    return {
        "run": fp.simulate(BLOCK, [0, 0], (0, 1)),
        "basins": fp.basins(BLOCK, GRID, seeds=4, saddle_starts=0, audit=0),
        "map": fp.event_map(BLOCK, params={"A": 5, "omega": 2.5}, samples=64),
        "orbit": orbit,
        "ends": fp.ensemble(BLOCK, np.zeros((2, 3)), (0, 1)),
        "diagram": fp.bifurcation_diagram(BLOCK, A=[1.0], transient=1, keep=5),
    }


@pytest.mark.parametrize(("name", "argument"), METHODS, ids=[f"{n}-{a}" for n, a in METHODS])
def test_what_an_argument_of_a_method_cannot_be(made, name, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    of, good, kinds = CALLS[name]
    good = {key: made.get(v, v) if isinstance(v, str) else v for key, v in good.items()}
    if name == "basin_boundary":
        good = {"basins": made["basins"]}
    wrong = [
        refused(lambda value: of(made)(**(good | {argument: value})), argument, value)
        for value in WRONG[kinds[argument]]
    ]
    assert [each for each in wrong if each is not None] == []
    assert list(tmp_path.iterdir()) == []


# --- of what a system is made -----------------------------------------------------------------

FIELDS = {"-": lambda t, s, p: (s.v, 1.0), "+": lambda t, s, p: (s.v, -1.0)}
WALL = {"wall": ("x", lambda t, s, p: (-s.x, s.v))}
NO_NAMES = [3, None, [], "", "1x", "x x", "x-v", ["x", 3], "class", b"x", True, {}, object(), "t"]
NO_PARAMS = [
    [("F", 1.0)], "F", 3, {3: 1.0}, {"F": "1"}, {"F": None}, {"F": NAN}, {"F": INF}, {"F": True},
    {"F": 1j}, {"F": HUGE}, {"F": LONGER}, {"F": [1.0]}, {"F": np.ma.masked}, {"x": 1.0},
    {"1": 1.0}, {"F G": 1.0},
]  # fmt: skip
NO_PERIOD = [0, -1.0, NAN, INF, HUGE, LONGER, True, 1j, [], {}, "", "x", "1 +", object()]
NO_JUMPS = [
    3, "wall", [], ["wall"], True, {"wall": "x"}, {"wall": ("x",)}, {"wall": ("x", 3)},
    {"wall": None}, {"wall": ("x", len, 3)}, {"wall": {"x", len}}, {"wall": {"x": 1, "v": 2}},
]  # fmt: skip
NO_FIELDS = [3, None, [], {}, {"-": FIELDS["-"]}, {"-": 3, "+": 3}, {"a": len, "b": len}, "x"]
NO_SCALE = [3, [1.0], "x", {"z": 1.0}, {"x": 0.0}, {"x": NAN}, {"x": True}, {"x": HUGE}, {"x": "1"}]
COMMON = {"state": NO_NAMES, "params": NO_PARAMS, "period": NO_PERIOD, "jumps": NO_JUMPS,
          "name": [3, b"x", [], True, {}]}  # fmt: skip
MAKERS = {
    "system": (
        lambda **given: fp.system(**given)(lambda t, s, p: (s.v, -np.sign(s.v))),
        {"state": "x v"},
        COMMON | {"surfaces": [3, "x", [], True, {"a": None}, {"a": 1j}, {"a": "1 +"}, {"a": []}]},
    ),
    "System": (
        fp.System,
        {"state": "x v", "fields": FIELDS, "switch": "v"},
        COMMON | {"fields": NO_FIELDS, "switch": [None, {"a": None}, [None], object(), 1j, "1 +"]},
    ),
    "from_callables": (
        fp.System.from_callables,
        {"state": "x v", "fields": FIELDS, "switch": "v"},
        COMMON | {"fields": NO_FIELDS, "scale": NO_SCALE},
    ),
    "from_pointers": (
        fp.System.from_pointers,
        {"state": "x v", "fields": {"-": 4096, "+": 4096}, "switch": "v"},
        COMMON | {"fields": NO_FIELDS, "scale": NO_SCALE, "jacobians": [3, "x", [4096], {"*": 1}]},
    ),
}  # fmt: skip
MADE_OF = [(name, argument) for name, (_, _, kinds) in MAKERS.items() for argument in kinds]


@pytest.mark.filterwarnings("ignore::filippov.SlowSystemWarning")
@pytest.mark.parametrize(("name", "argument"), MADE_OF, ids=[f"{n}-{a}" for n, a in MADE_OF])
def test_what_a_system_cannot_be_made_of(name, argument):
    make, good, kinds = MAKERS[name]
    optional = argument in ("params", "period", "jumps", "scale", "jacobians")
    # what is within a mapping or a text is told by its own name
    told = {
        "fields": r"fields|f\[",
        "jumps": "jumps|wall",
        "switch": r"switch|\bh\b|h0|\ba\b",
        "surfaces": "surface",
    }
    found = told.get(argument, argument)
    for value in kinds[argument]:
        if optional and value is None:
            continue
        with pytest.raises((TypeError, ValueError)) as caught:
            make(**(good | {argument: value}))
        assert re.search(found, str(caught.value)), (str(caught.value), str(value)[:60])
        assert "incompatible" not in str(caught.value)


@pytest.mark.parametrize("argument", ["params", "surfaces", "jumps"])
def test_what_formulas_of_sympy_are_not_made_of(argument):
    sympy = pytest.importorskip("sympy")
    x, v = sympy.symbols("x v")
    for value in (3, "x", [], ["x"], True, *([{"wall": x}] if argument == "jumps" else [])):
        with pytest.raises((TypeError, ValueError), match=argument):
            fp.System.from_sympy([x, v], [v, -sympy.sign(v)], **{argument: value})


# --- integers and orders of arguments ---------------------------------------------------------


class Event:
    def __init__(self, **attributes):
        for name, value in attributes.items():
            setattr(self, name, value)

    def __call__(self, t, y):
        return y[0] - 1e9


@pytest.mark.parametrize(
    "wrong",
    [
        {"terminal": 10**30}, {"terminal": 2**63}, {"terminal": -1}, {"terminal": 1.5},
        {"terminal": "yes"}, {"terminal": None}, {"terminal": LONGER}, {"direction": HUGE},
        {"direction": LONGER}, {"direction": True}, {"direction": "up"}, {"direction": NAN},
        {"direction": None}, {"direction": [1]}, {"direction": 1j},
    ],
)  # fmt: skip
def test_attributes_of_event_functions_are_named(wrong):
    (name,) = wrong
    with pytest.raises((TypeError, ValueError), match=rf"events\.{name} = "):
        fp.simulate(BLOCK, [0, 0], (0, 1), events=Event(**wrong))


@pytest.mark.parametrize("terminal", [2**31, 2**40, 2**63 - 1, np.int64(2**62), np.uint8(3)])
def test_a_count_that_is_never_reached_is_taken(terminal):
    assert fp.simulate(BLOCK, [0, 0], (0, 1), events=Event(terminal=terminal)).success
    most = max(int(terminal), 1000)
    assert fp.simulate(BLOCK, [0, 0], (0, 1), max_steps=most, max_events=most).success


SWAPPED = [
    ((0, 10), [0, 0]), ((0, 10), [1, 0]), ((0, 50), [0, 1]), ([0, 10], [0, 0]), ((0, 10), (0, 0)),
    ((0, 10), np.zeros(2)), ([0, 10], np.zeros(2)), ((10, 0), [0, 0]), ((0.0, 5.0), [0.1, 0.2]),
    ((-5, 5), [3, 3]),
]  # fmt: skip
IN_ORDER = [
    ([0, 10], (0, 0)), ([1, 0], (0, 10)), ((0, 1), [0, 50]), (np.array([0, 10]), [0, 0]),
    ([0, 0], (2, 2)), ((0, 0), (2, 2)), ((1, 0), [0, 0.5]), ([0, 1], [0, 10]), ((0, 1), (0, 5)),
    (np.array([0.0, 1.0]), np.array([2.0, 2.0])), ([1.0, 2.0], (5, 3)), ((3.0, 3.0), [1, 0]),
]  # fmt: skip
PLANAR = {
    "simulate": lambda *args: fp.simulate(fp.models.coulomb, *args),
    "ensemble": lambda *args: fp.ensemble(fp.models.coulomb, *args),
    "time_stepping": lambda *args: fp.time_stepping(still, *args, n_steps=2),
}


@pytest.mark.parametrize("name", PLANAR)
@pytest.mark.parametrize(("x0", "t_span"), SWAPPED)
def test_times_in_place_of_the_start_are_refused(name, x0, t_span):
    with pytest.raises(
        ValueError, match=rf"x0 = .*start before the times, as in {name}\(sys, x0=.*t_span="
    ):
        PLANAR[name](x0, t_span)


@pytest.mark.parametrize("name", ["simulate", "ensemble"])
@pytest.mark.parametrize(("x0", "t_span"), IN_ORDER)
def test_a_start_before_the_times_is_taken(name, x0, t_span):
    PLANAR[name](x0, t_span)


@pytest.mark.parametrize("start", [[1], [1, 0, 0], np.zeros(3), [0.1]])
def test_times_before_a_start_of_one_or_three_components(start):
    system = {1: fp.models.quartet, 3: RELAY}[len(start)]
    if system.dim != len(start):
        pytest.skip("no model of that many components")
    for call in (fp.simulate, fp.ensemble):
        with pytest.raises(ValueError, match=r"x0 = \(0, 10\): expected the start before the"):
            call(system, (0, 10), start)


def test_starts_in_a_row_for_an_ensemble_are_times():
    with pytest.raises(ValueError, match=r"x0 = \(0, 10\): expected the start before the times"):
        fp.ensemble(BLOCK, (0, 10), np.zeros((2, 5)))


@pytest.mark.parametrize(
    "call",
    [
        lambda rows: fp.ensemble(BLOCK, rows, (0, 1)),
        lambda rows: fp.strobe_map(BLOCK, rows),
        lambda rows: fp.section_map(BLOCK, rows),
        lambda rows: BLOCK.h(0.0, rows),
        lambda rows: BLOCK.field(0.0, rows, 1),
    ],
)
def test_starts_in_rows_are_told_to_be_transposed(call):
    with pytest.raises(ValueError, match=r"the components come first, as in the transpose \.T"):
        call(np.zeros((3, 2)))
    call(np.zeros((3, 2)).T)


def test_a_start_in_a_list_by_itself_is_told_to_be_one():
    with pytest.raises(ValueError, match=r"one list, \[1.0, 2.0\], not lists in a list"):
        fp.simulate(BLOCK, [[1, 2]], (0, 1))


def test_tables_and_labels_of_pandas():
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"y": [0.0, 1.0], "v": [0.0, 0.5]})
    with pytest.raises(TypeError, match=r"x0 = .*not a table"):
        fp.ensemble(BLOCK, table, (0, 1))
    with pytest.raises(ValueError, match=r"x0 = \['v', 'y'\]: .*\(y, v\) in this order"):
        fp.simulate(BLOCK, pandas.Series({"v": 0.0, "y": 1.0}), (0, 1))
    for start in (pandas.Series({"y": 1.0, "v": 0.0}), table["v"], table.to_numpy()[1]):
        assert fp.simulate(BLOCK, start, (0, 1)).success


@pytest.mark.parametrize("start", [[10**20, 0], [2**64, 2**63], [np.float32(1), 2], (0, -(2**31))])
def test_integers_of_any_size_are_numbers(start):
    run = fp.simulate(fp.models.coulomb, start, (0, 1e-3))
    np.testing.assert_array_equal(run.y[:, 0], np.array(start, dtype=np.float64))


def test_a_masked_array_without_masked_entries_is_an_array():
    start = np.ma.masked_array([0.0, 1.0], mask=False)
    assert fp.simulate(BLOCK, start, (0, 1)).success
