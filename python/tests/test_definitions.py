# SPDX-License-Identifier: BSD-3-Clause
"""What is found in a user's function, and what is said of one that is wrong."""

import functools
import math
import pickle
import random

import numpy as np
import pytest

import filippov as fp
from filippov import DefinitionError
from filippov._system.define import Numbers, _moved_by_rounding


def trace(function, state="x v", **how):
    how.setdefault("params", {"A": 0.5, "F": 0.4})
    return fp.system(state=state, **how)(function)


@pytest.fixture(scope="module")
def typed():
    """Make the chapter's oscillator from its single formula."""
    omega = {"period": lambda p: 2 * np.pi / p.omega}

    @fp.system(state="y v", params=dict(fp.models.oscillator.params), **omega)
    def friction(t, s, p):
        u = p.V - s.v
        mu = p.alpha / (1 + p.gamma * abs(u)) + p.beta + p.eta * u**2
        force = p.A * np.cos(p.omega * t) + p.m * p.g * mu * np.sign(u)
        return s.v, (force - p.k * s.y) / p.m

    return friction


@pytest.fixture(scope="module")
def oriented():
    """Make the same with the model's orientation of the surface."""

    @fp.system(
        state="y v",
        params=dict(fp.models.oscillator.params),
        period="2*pi/omega",
        surfaces={"belt": "v - V"},
    )
    def friction(t, s, p):
        u = p.V - s.v
        mu = p.alpha / (1 + p.gamma * np.abs(u)) + p.beta + p.eta * u**2
        force = p.A * np.cos(p.omega * t) + p.m * p.g * mu * np.sign(u)
        return s.v, (force - p.k * s.y) / p.m

    return friction


# --- what is found --------------------------------------------------------------------------------


def test_one_surface_is_found_with_the_sign_that_was_written(typed):
    assert typed.switches == ("V - v",)
    assert typed.kinds == ("switching",)
    assert typed.sliding == "closed form"
    assert typed.period() == pytest.approx(2 * np.pi / 2.94)
    assert "V - v" in repr(typed)


def test_a_named_surface_has_its_sign(oriented):
    assert oriented.switches == ("v - V",)


def events_of_both(system, params, method, **settings):
    runs = [
        fp.simulate(either, [0.5, 0.2], (0, 60), params=params, method=method, **settings)
        for either in (system, fp.models.oscillator)
    ]
    mine, models = (run.events for run in runs)
    assert list(mine["kind"]) == list(models["kind"])
    assert runs[0].nfev == pytest.approx(runs[1].nfev, rel=0.01)
    return mine, models


MOTIONS = [
    {"A": 0.5, "omega": 2.94},
    {"A": 5.0, "omega": 1.72},
    {"A": 3.6, "omega": 1.067},
]


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
@pytest.mark.parametrize("params", MOTIONS)
@pytest.mark.parametrize(
    "settings",
    [{"rtol": 1e-10, "atol": 1e-10}, {"rtol": 1e-2, "first_step": 0.02, "max_step": 0.02}],
)
def test_the_formula_has_the_events_of_the_model(oriented, method, params, settings):
    # at 1e-2 every step is 0.02 long, until an event: of steps that are chosen see below
    mine, models = events_of_both(oriented, params, method, **settings)
    assert mine["t"] == pytest.approx(models["t"], abs=1e-12)
    assert mine["x_right"] == pytest.approx(models["x_right"], abs=1e-11)


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
@pytest.mark.parametrize("params", MOTIONS)
def test_at_a_loose_tolerance_they_differ_by_what_rounding_makes_of_steps(oriented, method, params):
    # A first step much too short has an error of 1e-11, of which rounding is 1e-7: so much the
    # next step differs, and by so much of the tolerance what comes of it. (It grows from event to
    # event by what a difference grows: up to 1.5e-11 in 210 runs.)
    mine, models = events_of_both(oriented, params, method, rtol=1e-6, atol=1e-6)
    assert mine["t"] == pytest.approx(models["t"], abs=1e-9)
    assert mine["x_right"] == pytest.approx(models["x_right"], abs=1e-9)


def test_the_other_sign_is_the_same_motion(typed):
    mine = fp.simulate(typed, [0.5, 0.2], (0, 60), rtol=1e-10, atol=1e-10)
    models = fp.simulate(fp.models.oscillator, [0.5, 0.2], (0, 60), rtol=1e-10, atol=1e-10)
    assert mine.events["t"] == pytest.approx(models.events["t"], abs=1e-12)
    assert np.array_equal(mine.events["mode_after"], -models.events["mode_after"])


def test_the_formula_has_the_basins_of_the_model(oriented):
    grid = {"y": (-3, 3, 60), "v": (-1, 3.5, 60)}
    at = {"A": 3.6, "omega": 1.067}
    mine, models = (
        fp.basins(system, grid, params=at) for system in (oriented, fp.models.oscillator)
    )
    assert np.array_equal(mine.label, models.label)


def test_maps_orbits_branches_and_exponents_of_a_formula(oriented):
    models = fp.models.oscillator
    maps = [fp.event_map(system).fixed_points() for system in (oriented, models)]
    for mine, other in zip(*maps, strict=True):
        assert (mine.phase, mine.slope) == pytest.approx((other.phase, other.slope), rel=1e-9)
    orbits = [fp.periodic_orbit(system) for system in (oriented, models)]
    assert orbits[0].word == orbits[1].word
    assert orbits[0].multipliers == pytest.approx(orbits[1].multipliers, abs=1e-9)
    branches = [fp.continuation(orbit, "omega", (2.8, 3.0)) for orbit in orbits]
    assert set(branches[0].special) == set(branches[1].special)
    for kind, points in branches[0].special.items():
        for mine, other in zip(points, branches[1].special[kind], strict=True):
            assert mine.param["omega"] == pytest.approx(other.param["omega"], abs=1e-9)
    exponents = [
        fp.lyapunov(system, [0.3, 0.2], params={"A": 5, "omega": 1.72}).exponents
        for system in (oriented, models)
    ]
    assert exponents[0] == pytest.approx(exponents[1], abs=1e-6)


def test_a_diagram_of_a_formula(oriented):
    values = np.linspace(1.7, 1.8, 5)
    mine, models = (
        fp.bifurcation_diagram(
            system, omega=values, params={"A": 5.0}, section="exit_sliding", transient=20, keep=20
        )
        for system in (oriented, fp.models.oscillator)
    )
    assert mine.y == pytest.approx(models.y, abs=1e-6)


def test_jacobians_are_exact(typed):
    x = np.array([0.3, 0.2])
    step = 1e-6
    for side in (-1, 1):
        wanted = np.array(
            [
                (typed.field(0.4, x + d, side) - typed.field(0.4, x - d, side)) / (2 * step)
                for d in step * np.eye(2)
            ]
        ).T
        assert typed.jacobian(0.4, x, side) == pytest.approx(wanted, rel=1e-7, abs=1e-7)


def test_kinks_are_told_from_switches():
    def field(t, s, p):
        return s.v, -s.x - abs(s.x) * s.v - p.F * np.sign(s.v)

    system = trace(field)
    assert dict(zip(system.switches, system.kinds, strict=True)) == {"x": "kink", "v": "switching"}


@pytest.mark.parametrize("F", [0.0, 1e-300, 1e-18, 1e-16, 1e-3, 1.0])
@pytest.mark.parametrize("k", [1.0, 1e9])
def test_a_force_is_one_however_small_it_is_by_default(F, k):
    params = {"F": F, "k": k, "m": 2.0}
    dry = trace(lambda t, s, p: (s.v, (-p.k * s.x - p.F * np.sign(s.v)) / p.m), params=params)
    assert dry.kinds == ("switching",)
    bent = trace(lambda t, s, p: (s.v, (-p.k * s.x - p.F * np.abs(s.v)) / p.m), params=params)
    assert bent.kinds == ("kink",)
    at_rest = fp.simulate(dry.with_params(k=1.0, F=3.0, m=1.0), [1, 0], (0, 5))
    assert at_rest.y[:, -1].tolist() == [1, 0]


@pytest.mark.parametrize("d", [1e-6, 1e-9, 1e-12, 1e-18])
def test_surfaces_that_are_near_each_other_by_default_are_two(d):
    near = trace(
        lambda t, s, p: 1 + 0.5 * np.sign(s.x - 1) + 0.25 * np.sign(s.x - 1 - p.d),
        state="x",
        params={"d": d},
    )
    assert near.switches == ("x - 1", "x - 1 - d")
    # 0.25 up to x = 1, 1.25 up to 1.5, then 1.75
    run = fp.simulate(near.with_params(d=0.5), [0], (0, 5))
    assert run.y[0, -1] == pytest.approx(1.5 + 1.75 * 0.6, abs=1e-12)


@pytest.mark.parametrize("eps", [1e-9, 1e-10, 1e-12, 1e-18])
def test_a_narrow_band_of_stiction_is_kept(eps):
    def field(t, s, p):
        return s.v, -s.x - np.where(np.abs(s.v) < eps, 4 * np.sign(s.v), 3 * np.sign(s.v))

    assert len(trace(field).switches) == 3
    stuck = fp.simulate(trace(field), [3.5, 0], (0, 1))
    assert stuck.y[:, -1] == pytest.approx([3.5, 0], abs=2 * eps)


def test_a_band_that_is_lost_in_rounding_is_refused():
    def band(eps):
        return lambda t, s, p: (s.v, np.where(np.abs(s.v - 1) < eps, 4, 3) * np.sign(1 - s.v))

    assert len(trace(band(1e-12)).switches) == 3
    with pytest.raises(DefinitionError, match="differ by 1e-18 alone"):
        trace(band(1e-18))


def test_what_is_clipped_is_continuous():
    @fp.system(state="x v", params={"a": 1.0})
    def spring(t, s, p):
        return s.v, -np.clip(s.x, -p.a, p.a) - np.sign(s.v)

    kinds = dict(zip(spring.switches, spring.kinds, strict=True))
    assert sorted(kinds.values()) == ["kink", "kink", "switching"]
    assert kinds["v"] == "switching"
    assert fp.system(state="x")(lambda t, s, p: np.sign(s.x - (-1)) + (-2)).switches == ("x + 1",)
    assert fp.system(state="x v")(lambda t, s, p: (s.v, -np.clip(s.x, -1, 1))).kinds == (
        "kink",
        "kink",
    )


STRIBECK = {
    "recorded": lambda law, h: fp.system(state="x v")(
        lambda t, s, p: (s.v, -2 * s.x + law(0.3 - s.v))
    ),
    "named": lambda law, h: fp.system(state="x v", surfaces={"belt": h})(
        lambda t, s, p: (s.v, -2 * s.x + law(0.3 - s.v))
    ),
    "sides": lambda law, h: fp.System(
        "x v",
        fields={
            "-": lambda t, s, p: (s.v, -2 * s.x + law(0.3 - s.v, 1)),
            "+": lambda t, s, p: (s.v, -2 * s.x + law(0.3 - s.v, -1)),
        },
        switch=h,
    ),
}


@pytest.mark.parametrize("written", STRIBECK)
@pytest.mark.parametrize("speed", [0.02, 0.05, 0.2, 0.5, 2.0])
def test_friction_that_falls_exponentially_jumps(written, speed):
    # beyond its side the formula grows by exp(|u|/speed), where no solution goes
    def law(u, sign=None):
        sign = np.sign(u) if sign is None else sign
        return sign * (0.5 + 0.5 * np.exp(-sign * u / speed))

    block = STRIBECK[written](law, "v - 0.3")
    assert block.kinds == ("switching",)
    run = fp.simulate(block, [0, 0.3], (0, 3))
    assert run.mode[0] == 0  # it sticks
    assert run.events["kind"].tolist()[:2] == ["start", "exit_sliding"]
    assert run.events["x_right"][1][0] == pytest.approx(0.5, abs=1e-12)  # 2 x = 1


@pytest.mark.parametrize(
    "force",
    [
        lambda s: np.sign(s.v),
        lambda s: np.where(s.v > 0, 1, -1),
        lambda s: np.where(s.v < 0, -1.0, 1.0),
        lambda s: 2 * np.heaviside(s.v, 0.5) - 1,
        lambda s: 2 * (s.v > 0) - 1,
        lambda s: 1 - 2 * ~(s.v >= 0),
        lambda s: s.v / abs(s.v),
        lambda s: np.select([s.v > 0, s.v < 0], [1, -1]),
        lambda s: np.where(np.logical_and(s.v > 0, s.v > 0), 1, -1),
        lambda s: np.where((s.v > 0) | (s.v > 0), 1, -1),
        lambda s: np.sign(2 * s.v),
        lambda s: -np.sign(-s.v),
        lambda s: np.sign(s)[1],
        lambda s: np.sign(np.tanh(s.v)),
    ],
)
def test_ways_to_write_a_sign(force):
    system = trace(lambda t, s, p: (s.v, -s.x - p.F * force(s)))
    assert system.surfaces == 1
    assert system.kinds == ("switching",)
    wanted = fp.simulate(fp.models.coulomb.with_params(a=0, mu=0.4), [3, 0], (0, 20))
    run = fp.simulate(system, [3, 0], (0, 20))
    assert run.y[:, -1] == pytest.approx(wanted.y[:, -1], abs=1e-6)


@pytest.mark.parametrize(
    "field",
    [
        lambda t, s, p: np.array([[0, 1], [-1, -0.1]]) @ s - np.array([0, 1]) * np.sign(s.v),
        lambda t, s, p: np.stack([s.v, -s.x - 0.1 * s.v - np.sign(s.v)]),
        lambda t, s, p: [s[1], -s[0] - 0.1 * s[1] - np.sign(s[1])],
        lambda t, s, p: np.concatenate([s[1:], -s[:1] - 0.1 * s[1:] - np.sign(s[1:])]),
        lambda t, s: (s.v, -s.x - 0.1 * s.v - np.sign(s.v)),
        lambda t, s, p: np.add(np.where(s.v > 0, [0, -1], [0, 1]), [s.v, -s.x - 0.1 * s.v]),
        lambda t, s, p: (s["v"], -s["x"] - np.dot([0, 0.1], s) - np.sign(s["v"])),
        lambda t, s, p: np.dot([[0, 1], [-1, -0.1]], s) - np.array([0, 1]) * np.sign(s.v),
        lambda t, s, p: [[0, 1], [-1, -0.1]] @ s - np.array([0, 1]) * np.sign(s.v),
    ],
)
def test_ways_to_write_vectors(field):
    system = trace(field)
    x = np.array([0.3, 0.2])
    assert system.field(0, x, 1) == pytest.approx([0.2, -0.3 - 0.02 - 1])
    assert system.field(0, x, -1) == pytest.approx([0.2, -0.3 - 0.02 + 1])


@pytest.mark.parametrize(
    "function",
    [np.sqrt, np.exp, np.log, np.sin, np.cos, np.tan, np.arcsin, np.arccos, np.arctan, np.sinh,
     np.cosh, np.tanh, np.exp2, np.expm1, np.log2, np.log10, np.log1p, np.arctanh, np.arcsinh,
     np.square, np.reciprocal, np.cbrt, np.radians, np.degrees, lambda x: np.arccosh(1 + x),
     lambda x: np.hypot(x, 2), lambda x: np.clip(x, 0.1, 0.2), lambda x: x**-3, lambda x: 2**x,
     lambda x: x**1.7, lambda x: np.maximum(x, 0.5), lambda x: np.minimum(0.3, x)],
)  # fmt: skip
def test_functions_of_numpy(function):
    system = trace(lambda t, s, p: (function(0.2 + s.x**2), np.sign(s.v)))
    for x in (0.1, 0.5, 0.8):
        side = [1 if h > 0 else -1 for h in np.atleast_1d(system.h(0, [x, 1.0]))]
        with np.errstate(all="ignore"):
            wanted = function(0.2 + x**2)
        got = system.field(0, [x, 1.0], side)[0]
        if math.isfinite(wanted):
            assert got == pytest.approx(wanted, rel=1e-12)


def test_sides_one_by_one():
    def push(by, t, s, p):
        return s.v, -s.x + by * p.F

    system = fp.System(
        "x v",
        {"F": 0.4},
        fields={"-": functools.partial(push, 1), "+": functools.partial(push, -1)},
        switch=lambda t, s, p: s.v,
    )
    run = fp.simulate(system, [3, 0], (0, 20))
    assert run.y[:, -1] == pytest.approx([-0.2, 0], abs=1e-6)


@pytest.mark.parametrize(
    ("switch", "shown", "sign", "at"),
    [
        ("c*v", "c*v", lambda c: c, 0),
        ("c*(v - 1)", "(v - 1)*c", lambda c: c, 1),
        ("(v - 1)/c", "(v - 1)/c", lambda c: c, 1),
        ("-c*v*exp(x)", "-exp(x)*c*v", lambda c: -c, 0),
        (lambda t, s, p: np.cbrt(s.v - 1), "v - 1", lambda c: 1, 1),
        (lambda t, s, p: -np.cbrt(2 * s.v - 2), "2 - 2*v", lambda c: -1, 1),
        ("cbrt(c*v)", "where(-sign(c) > 0.5, -1, 1)*v", lambda c: c, 0),
    ],
)
@pytest.mark.parametrize("c", [2.0, -2.0])
def test_a_switch_may_have_a_factor_of_parameters_or_be_a_cube_root(switch, shown, sign, at, c):
    fields = {"-": lambda t, s, p: (s.v, 1 - s.x), "+": lambda t, s, p: (s.v, -1 - s.x)}
    sides = fp.System("x v", {"c": 2.0}, fields=fields, switch=switch)
    assert sides.switches == (shown,)
    assert sides.kinds == ("switching",)
    sides = sides.with_params(c=c)
    for v in (-0.5, 0.5, 1.5):
        assert np.sign(sides.h(0.0, [0.3, v])) == np.sign(sign(c) * (v - at))
    one = trace(lambda t, s, p: (s.v, -s.x - np.sign(sign(c) * (s.v - at))))
    runs = [fp.simulate(f, [0.2, 3], (0, 6), rtol=1e-10, atol=1e-12) for f in (sides, one)]
    assert runs[0].y[:, -1] == pytest.approx(runs[1].y[:, -1], abs=1e-8)
    again = pickle.loads(pickle.dumps(sides))
    assert again == sides
    assert again.switches == sides.switches


@pytest.mark.parametrize(
    ("switch", "words"),
    [
        (lambda t, s, p: np.abs(s.x - 1) - 0.5, r"several \(x - 1, .*a name of its own"),
        ("v*(x - 1)", r"switches on several \(v, x - 1\)|switches on several \(x - 1, v\)"),
        ("where(x > 0, 2*x, x)", "without the switches in it, as 'x'"),
        (lambda t, s, p: np.heaviside(s.v - 1, 0.5) - 0.5, "as 'v - 1'"),
        ("exp(x)", "surface h is none: its sign never changes"),
    ],
)
def test_a_switch_that_is_not_one_surface_is_refused_with_the_remedy(switch, words):
    fields = {"-": lambda t, s, p: (s.v, 1 - s.x), "+": lambda t, s, p: (s.v, -1 - s.x)}
    with pytest.raises(DefinitionError, match=words):
        fp.System("x v", fields=fields, switch=switch)


def test_a_surface_that_is_another_is_refused_as_that():
    fields = {
        sides: lambda t, s, p, k=k: (s.v, k - s.x)
        for k, sides in enumerate(("--", "+-", "-+", "++"))
    }
    with pytest.raises(DefinitionError, match="surface h1 is the same as h0, up to a factor"):
        fp.System("x v", fields=fields, switch=["x", "2*x"])
    with pytest.raises(DefinitionError, match="surface b is the same as a, up to a factor"):
        fp.System("x v", {"c": 2.0}, fields=fields, switch={"a": "x - 1", "b": "c - c*x"})


def test_sides_around_two_surfaces():
    fields = {
        a + b: (lambda t, s, i=i, j=j: (-i + 2 * j, -2 * i - j))
        for a, i in (("-", -1), ("+", 1))
        for b, j in (("-", -1), ("+", 1))
    }
    system = fp.System("x y", fields=fields, switch=["x", "y"])
    assert system.surfaces == 2
    run = fp.simulate(system, [0, 1], (0, 1))
    assert np.abs(run.y[:, -1]).max() < 1e-9


def test_params_and_pickles(typed):
    hard = typed.with_params(A=5.0, omega=1.72)
    assert hard.params.A == 5.0
    assert typed.params.A == 0.5
    again = pickle.loads(pickle.dumps(hard))
    assert again.params == hard.params
    assert again.switches == hard.switches
    runs = [fp.simulate(system, [0.1, 0.2], (0, 30)) for system in (hard, again)]
    assert np.array_equal(runs[0].y, runs[1].y)


def test_results_are_saved_with_their_formulas(typed, tmp_path):
    orbit = fp.periodic_orbit(typed)
    orbit.save(tmp_path / "orbit")
    again = fp.load(tmp_path / "orbit")
    assert again.system.switches == typed.switches
    assert fp.periodic_orbit(again.system, again).period == pytest.approx(orbit.period)


def test_words(typed):
    latex = typed.latex()
    assert latex.startswith(r"\begin{aligned}")
    assert r"\cos" in latex
    assert latex.count("{") == latex.count("}")
    assert r"\alpha" in fp.models.oscillator.latex()  # its formulas are written down
    with pytest.raises(TypeError, match="compiled model"):
        fp.models.stiction.latex()


# --- what is wrong --------------------------------------------------------------------------------

COUNTER = [0]


def counting(t, s, p):
    COUNTER[0] += 1
    return s.v, -s.x - np.sign(s.v) * COUNTER[0]


def changing(t, s, p):
    s.x = 1
    return s.v, -s.x


def writing(t, s, p):
    out = np.zeros(2)
    out[0] = s.v
    return out


def deciding(t, s, p):
    if s.v > 0:
        return s.v, -s.x - p.F
    return s.v, -s.x + p.F


def branching_on_parameters(t, s, p):
    return (s.v, -s.x) if p.F else (s.v, s.x)


BOOK = {
    "if on the state": (deciding, {}, "np.where"),
    "if on a parameter": (branching_on_parameters, {}, "np.where"),
    "and": (lambda t, s, p: (s.v, np.where(s.v > 0 and s.x > 0, 1, -1)), {}, "& and |"),
    "max of Python": (lambda t, s, p: (s.v, max(s.x, 0)), {}, "np.maximum"),
    "math.cos": (lambda t, s, p: (s.v, math.cos(t)), {}, "np.cos"),
    "math.copysign": (lambda t, s, p: (s.v, math.copysign(1, s.v)), {}, "numpy's functions"),
    "float": (lambda t, s, p: (s.v, float(s.x)), {}, "numpy's functions"),
    "int": (lambda t, s, p: (s.v, int(s.x)), {}, "numpy's functions"),
    "array of state": (lambda t, s, p: np.asarray(s), {}, "np.stack"),
    "equality": (lambda t, s, p: (s.v, np.where(s.v == 0, 1, 0)), {}, "for no time"),
    "unequal": (lambda t, s, p: (s.v, (s.v != 0) * 1), {}, "for no time"),
    "floor": (lambda t, s, p: (s.v, np.floor(s.x)), {}, "infinitely many"),
    "modulo": (lambda t, s, p: (s.v, np.mod(t, 1.0)), {}, "infinitely many"),
    "percent": (lambda t, s, p: (s.v, t % 1.0), {}, "infinitely many"),
    "slashes": (lambda t, s, p: (s.v, 1.0 // s.x), {}, "infinitely many"),
    "caret": (lambda t, s, p: (s.v, s.x ^ 2), {}, "no power here"),
    "round": (lambda t, s, p: (s.v, round(s.v, 1)), {}, "infinitely many"),
    "round of all": (lambda t, s, p: round(s), {}, "no values yet"),
    "math.floor": (lambda t, s, p: (s.v, math.floor(s.v)), {}, "infinitely many"),
    "divmod": (lambda t, s, p: (s.v, divmod(s.v, 2)[1]), {}, "infinitely many"),
    "a number in a text": (lambda t, s, p: (s.v, float(f"{s.v:.2f}")), {}, "no value yet"),
    "times i": (lambda t, s, p: (s.v, 0.1j * s.v), {}, "a complex number, 0.1j"),
    "the real part": (lambda t, s, p: (s.v, s.v.real), {}, "have no values yet"),
    "times None": (lambda t, s, p: (s.v, s.v * None), {}, "have no values yet"),
    "a look-up": (lambda t, s, p: (s.v, {1: 2}[s.v]), {}, "have no values yet"),
    "dot of an array": (lambda t, s, p: np.eye(2).dot(s), {}, "A @ s"),
    "arctan2": (lambda t, s, p: (s.v, np.arctan2(s.x, s.v)), {}, "arctan2"),
    "gamma": (lambda t, s, p: (s.v, np.sinc(s.x)), {}, "sinc|not known"),
    "writing into an array": (writing, {}, "numpy's functions"),
    "setting the state": (changing, {}, "cannot be set"),
    "a random number": (lambda t, s, p: (s.v, random.random() - np.sign(s.v)), {}, "random"),
    "a function that changes": (counting, {}, "change"),
    "too few derivatives": (lambda t, s, p: (s.v,), {}, "returned 1 values"),
    "too many derivatives": (lambda t, s, p: (s.v, s.x, s.x), {}, "returned 3 values"),
    "nothing": (lambda t, s, p: None, {}, "returned None"),
    "a text": (lambda t, s, p: "ab", {}, "returned 'ab'"),
    "a complex number": (lambda t, s, p: (s.v, 1j), {}, "1j"),
    "a matrix": (lambda t, s, p: np.eye(2), {}, "returned"),
    "an unknown state": (lambda t, s, p: (s.w, s.x), {}, "'w' is unknown; there are: x, v"),
    "an unknown parameter": (lambda t, s, p: (s.v, p.B), {}, "'B' is unknown; there are: A, F"),
    "an index beyond": (lambda t, s, p: (s[2], s[0]), {}, "entry 2"),
    "NaN": (lambda t, s, p: (s.v, np.nan - np.sign(s.v)), {}, "not finite"),
    "infinity": (lambda t, s, p: (s.v, s.x * np.inf), {}, "not finite"),
    "a matrix of another size": (lambda t, s, p: np.eye(3) @ s, {}, "a matrix of shape"),
    "vectors of two lengths": (lambda t, s, p: s + np.ones(3), {}, "different lengths"),
    "where without values": (lambda t, s, p: (s.v, np.where(s.x > 0)), {}, "np.where"),
    "too many surfaces": (
        lambda t, s, p: (s.v, sum(np.sign(s.x - k) for k in range(9))),
        {},
        "more than 8 surfaces",
    ),
    "four arguments": (lambda t, s, p, q: (s.v, s.x), {}, "f\\(t, s, p\\)"),
    "one argument": (lambda s: (s.v, s.x), {}, "f\\(t, s, p\\)"),
    "an error of its own": (lambda t, s, p: (s.v, 1 / 0), {}, "division by zero"),
    "no state": (lambda t, s, p: (), {"state": ""}, "1 to 32 names"),
    "too many components": (
        lambda t, s, p: s,
        {"state": [f"x{k}" for k in range(33)]},
        "1 to 32 names",
    ),
    "a name twice": (lambda t, s, p: s, {"state": "x x"}, "different names"),
    "no name": (lambda t, s, p: s, {"state": "x 2v"}, "'2v' is no name"),
    "a keyword": (lambda t, s, p: s, {"state": "x lambda"}, "'lambda' is no name"),
    "time as a name": (lambda t, s, p: s, {"state": "t v"}, "another meaning"),
    "a method of a mapping": (lambda t, s, p: s, {"params": {"values": 1.0}}, "another meaning"),
    "a name in both": (lambda t, s, p: s, {"params": {"x": 1}}, "name of the state"),
    "params in a list": (lambda t, s, p: s, {"params": [1, 2]}, "mapping of names"),
    "a parameter that is no number": (lambda t, s, p: s, {"params": {"A": "1"}}, "finite number"),
    "a parameter that is NaN": (lambda t, s, p: s, {"params": {"A": math.nan}}, "finite number"),
    "a period of time": (lambda t, s, p: s, {"period": lambda p: None}, "period"),
    "a period of the state": (lambda t, s, p: (s.v, np.sign(s.v)), {"period": "x"}, "depends on"),
    "a period that is none": (
        lambda t, s, p: (s.v, np.cos(t) - np.sign(s.v)),
        {"period": 3.0},
        "does not repeat",
    ),
    "a surface at which nothing changes": (
        lambda t, s, p: (s.v, np.sign(s.v)),
        {"surfaces": {"wall": "x - 1"}},
        "nothing changes",
    ),
    "a surface that does not move": (
        lambda t, s, p: (s.v, np.sign(s.v)),
        {"surfaces": {"wall": "A - 1"}},
        "does not depend",
    ),
    "a surface that cannot be read": (
        lambda t, s, p: (s.v, np.sign(s.v)),
        {"surfaces": {"wall": "v - W"}},
        "name 'W' is unknown",
    ),
    "surfaces in a list": (lambda t, s, p: s, {"surfaces": ["v"]}, "mapping"),
    "a jump without a function": (lambda t, s, p: s, {"jumps": {"wall": ("x", 3)}}, "function"),
    "a jump without its place": (lambda t, s, p: s, {"jumps": {"wall": "x"}}, "expected \\(h"),
}


@pytest.mark.parametrize("name", BOOK)
def test_wrong_definitions_are_refused_with_their_reason(name):
    function, how, words = BOOK[name]
    error = (DefinitionError, ValueError, TypeError, ZeroDivisionError)
    with pytest.raises(error, match=words):
        trace(function, **how)


def test_there_are_fifty_of_them():
    assert len(BOOK) >= 50


def test_not_a_function():
    with pytest.raises(TypeError, match="function"):
        fp.system(state="x")(3)
    with pytest.raises(TypeError, match="names"):
        fp.system(deciding)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"fields": {"-": deciding}, "switch": "v"}, "each of -, \\+"),
        ({"fields": {"-": 1, "+": 2}, "switch": "v"}, "function"),
        ({"fields": {"-": deciding, "+": deciding}, "switch": None}, "switching function"),
        ({"fields": {}, "switch": ["v", "x"]}, "--, -\\+, \\+-, \\+\\+"),
    ],
)
def test_wrong_sides_are_refused(how, words):
    with pytest.raises((ValueError, TypeError), match=words):
        fp.System("x v", {"F": 1}, **how)


def test_what_rounding_of_one_argument_moves_is_no_sign_of_chance():
    # if x and y change by one factor, (x - y)**5 hardly does
    u = 2.0**-30

    def moved(function, x=1 + u):
        definition = trace(lambda t, s, p: (s.y, 0 * s.x), state="x y")._definition
        p = Numbers(tuple(definition.params), np.array(list(definition.params.values())))
        return _moved_by_rounding(function, definition, 0.5, np.array([x, 1.0]), p)

    by_rounding = moved(lambda t, s, p: ((s.x - s.y) ** 5, 0 * s.x))
    assert by_rounding[0] == pytest.approx(10 * 2.0**-51 * u**4, rel=1e-3)
    assert by_rounding[1] == 0
    assert np.all(np.isnan(moved(lambda t, s, p: (random.random(), random.random()))))
