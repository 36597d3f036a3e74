# SPDX-License-Identifier: BSD-3-Clause
#
# pip install pydiffsol (MIT)
"""pydiffsol: models in the text of DiffSL, whose roots and resets its solvers follow by themselves.

Three ways to write a system with a surface, from the shortest on:

sign   the right-hand side with a jump, by heaviside(h), and no event;
hops   below and above the surface are two models, and each root of h changes to the other;
modes  a slide is a third model. Which root is looked for depends on where both fields lead, as in
       the hand-written loops; that and Utkin's field are worked out by hand.

A root changes to the model of its own number, and a run starts in model 0. After a root the state
is put 1e-12 off the surface, as the bouncing ball of pydiffsol's documentation is. Each solver is
made before it is timed. The state is asked for at the end only, so that no history is kept.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
import pydiffsol
from py_oscillator import BELT, CASES, EDGE, Rival, powers_of_ten

VERSION = pydiffsol.version()
OFF = {"below": -1e-12, "above": 1e-12, "slide": 0.0}


@dataclass(frozen=True)
class Model:
    """Formulas of a system: its fields, h, and the speeds of h on the surface by both fields."""

    start: dict[str, float]
    below: tuple[str, ...]
    above: tuple[str, ...]
    h: str
    speed_below: str
    speed_above: str
    reset: tuple[str, ...]  # the state on the surface, `off[N]` away from it
    slide: tuple[str, ...] | None = None
    first: str = "below"  # where the run starts
    before: str = ""  # what the formulas use


def vector(name, elements):
    return f"{name}_i {{ {', '.join(elements)} }}\n"


def by_model(name, formulas):
    """Text in which element k of a vector is formulas[k][N]."""
    vectors = [vector(f"{name}{k}", of_models) for k, of_models in enumerate(formulas)]
    return "".join(vectors) + vector(name, [f"{name}{k}_i[N]" for k in range(len(vectors))])


def states(model):
    return vector("u", [f"{x} = {value!r}" for x, value in model.start.items()])


def with_sign(model):
    fields = zip(model.below, model.above, strict=True)
    rates = [f"up * ({above}) + (1 - up) * ({below})" for below, above in fields]
    return f"{states(model)}{model.before}\nup {{ heaviside({model.h}) }}\n{vector('F', rates)}"


def with_models(model, names, roots):
    """The text for these models, roots[a][b] being what falls to zero where a follows b."""
    names = sorted(names, key=lambda name: name != model.first)
    fields = {name: getattr(model, name) or ["0.0"] * len(model.start) for name in names}
    return (
        f"{states(model)}{model.before}\nh {{ {model.h} }}\n"
        f"down {{ heaviside(-({model.speed_below})) }}\nup {{ heaviside({model.speed_above}) }}\n"
        + by_model("stop", [[roots[after][name] for name in names] for after in names])
        + by_model("F", zip(*(fields[name] for name in names), strict=True))
        + vector("off", [repr(OFF[name]) for name in names])
        + vector("reset", [part.replace("off", "off_i[N]") for part in model.reset])
    )


def with_hops(model):
    roots = {
        "below": {"below": "1.0", "above": "h"},
        "above": {"below": "-h", "above": "1.0"},
    }
    return with_models(model, ("below", "above"), roots)


def with_modes(model):
    """What is not looked for has the value 1, of the sign that it has where it is looked for."""
    roots = {
        "below": {"below": "1.0", "above": "down * h + 1 - down", "slide": model.speed_below},
        "above": {"below": "1 - up - up * h", "above": "1.0", "slide": f"-({model.speed_above})"},
        "slide": {"below": "up - (1 - up) * h", "above": "(1 - down) * h + down", "slide": "1.0"},
    }
    return with_models(model, ("below", "above", "slide"), roots)


def oscillator(case):
    friction = "(3 / (1 + 1.42 * abs(w)) + 1 + 0.1 * w * w)"
    return Model(
        start={"y": 0.0, "v": 0.0},
        before=f"w {{ v - {BELT} }}\nq {{ {case.A} * cos({case.omega} * t) - y }}",
        below=("v", f"q + {friction}"),
        above=("v", f"q - {friction}"),
        slide=(f"{BELT}", "0.0"),
        h="w",
        speed_below=f"q + {EDGE}",
        speed_above=f"q - {EDGE}",
        reset=("y", f"{BELT} + off"),
    )


COULOMB = Model(
    start={"x": 3.0, "v": 0.0},
    below=("v", "0.4 - x"),
    above=("v", "-0.4 - x"),
    slide=("0.0", "0.0"),
    h="v",
    speed_below="0.4 - x",
    speed_above="-0.4 - x",
    reset=("x", "off"),
)
UNIT_CIRCLE = Model(
    start={"x": math.exp(-1), "y": 0.0},
    before=f"w {{ {-2 * math.pi!r} }}",
    below=("x + w * y", "y - w * x"),
    above=("x - w * y", "y + w * x"),
    h="x * x + y * y - 1",
    speed_below="1.0",
    speed_above="1.0",
    reset=("x * (1 + off)", "y * (1 + off)"),
)
DIECI_LOPEZ = Model(
    start={"x": 0.0, "y": 0.0},
    below=("y", "1 / (1.2 - y) - x"),
    above=("y", "-1 / (0.8 + y) - x"),
    slide=("0.2", "0.0"),
    h="y - 0.2",
    speed_below="1 - x",
    speed_above="-1 - x",
    reset=("x", "0.2 + off"),
)
RELAY = Model(
    start={"x": 0.0, "y": -0.001, "z": -0.02},
    before="a { 3.5 }\nb { 627.5 }\nc { 625.0 }",  # zeta = 0.05, omega = 25
    below=("y - a * x + 1", "z - b * x - 2", "1 - c * x"),
    above=("y - a * x - 1", "z - b * x + 2", "-1 - c * x"),
    slide=("-a * x", "z - b * x + 2 * y", "-y - c * x"),
    h="x",
    speed_below="y + 1",
    speed_above="y - 1",
    reset=("off", "y", "z"),
    first="slide",
)
STIFF = Model(
    start={"x": 1.0},
    below=("1000 * (x - cos(t))",),
    above=("1000 * (cos(t) - x)",),
    h="x",
    speed_below="-1000 * cos(t)",
    speed_above="1000 * cos(t)",
    reset=("off",),
    first="above",
)
MODELS = {
    **{case.name: oscillator(case) for case in CASES},
    "P1": COULOMB,
    "P2": UNIT_CIRCLE,
    "P4": DIECI_LOPEZ,
    "P6": RELAY,
    "P8": STIFF,
}
# P15 has two surfaces. Its quadrants follow each other in turn, a quarter of the way round each;
# that it comes to rest is no root of anything.
SIGNS_OF_TWO = """
u_i { x = 0.0, y = 1.0 }
r { 2 * heaviside(x) - 1 }
s { 2 * heaviside(y) - 1 }
F_i { 2 * s - r, -2 * r - s }
"""
QUADRANTS = """
u_i { x = 0.0, y = 1.0 }
r_i { 1.0, 1.0, -1.0, -1.0 }
s_i { 1.0, -1.0, -1.0, 1.0 }
a_i { 1.0, 1.0, 1.0, -x }
b_i { y, 1.0, 1.0, 1.0 }
c_i { 1.0, x, 1.0, 1.0 }
d_i { 1.0, 1.0, -y, 1.0 }
stop_i { a_i[N], b_i[N], c_i[N], d_i[N] }
F_i { 2 * s_i[N] - r_i[N], -2 * r_i[N] - s_i[N] }
reset_i { x, y }
"""
WRITTEN = {"sign": with_sign, "hops": with_hops, "modes": with_modes}
TWO_SURFACES = {"sign": SIGNS_OF_TWO, "modes": QUADRANTS}


def text_of(way, name):
    """The model, None where it is the same as another way's."""
    if name == "P15":
        return TWO_SURFACES.get(way)
    return WRITTEN[way](MODELS[name])


def follow(ode, t_end):
    run = ode.solve_dense(np.array([]), np.array([t_end]))
    if run.ts[-1] != t_end:
        raise RuntimeError(f"ends at t = {run.ts[-1]:.6g}")
    return *run.ys[:, -1].tolist(), None


def prepare(way, solver, case, tol):
    text = text_of(way, case.name)
    if text is None:
        return None
    ode = pydiffsol.Ode(text, ode_solver=solver)
    ode.rtol = ode.atol = tol
    return partial(follow, ode, case.t_end)


RIVALS = [
    Rival(
        f"pydiffsol {way}, {name}",
        powers_of_ten(4, 13) if way == "modes" else (1e-4, 1e-6, 1e-8),
        partial(prepare, way, getattr(pydiffsol, name)),
        apart=__name__,
    )
    for way, name in (
        ("sign", "tsit45"),
        ("sign", "bdf"),
        ("hops", "tsit45"),
        ("modes", "tsit45"),
        ("modes", "bdf"),
    )
]
PROBLEM_RIVALS = RIVALS
