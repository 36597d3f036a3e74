# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import filippov as fp

sympy = pytest.importorskip("sympy")
x, v, F, A, omega, t = sympy.symbols("x v F A omega t")


def test_formulas_of_sympy_run_as_those_of_a_function():
    block = fp.System.from_sympy(
        [x, v],
        [v, -x + A * sympy.cos(omega * t) - F * sympy.sign(v)],
        {A: 0.5, omega: 0.9, F: 0.4},
        period=2 * sympy.pi / omega,
        surfaces={"ground": v},
    )

    @fp.system(
        state="x v",
        params={"A": 0.5, "omega": 0.9, "F": 0.4},
        period=lambda p: 2 * np.pi / p.omega,
    )
    def typed(t, s, p):
        return s.v, -s.x + p.A * np.cos(p.omega * t) - p.F * np.sign(s.v)

    assert block.switches == ("v",)
    runs = [fp.simulate(system, [1, 0.3], (0, 30)) for system in (block, typed)]
    assert np.array_equal(runs[0].events["kind"], runs[1].events["kind"])
    assert runs[0].events["t"] == pytest.approx(runs[1].events["t"], abs=1e-12)
    assert block.period() == typed.period()


@pytest.mark.parametrize(
    "force",
    [
        sympy.sign(v),
        sympy.Piecewise((-1, v < 0), (1, True)),
        2 * sympy.Heaviside(v) - 1,
        sympy.Piecewise((1, sympy.And(v > 0, v > 0)), (-1, True)),
        v / sympy.Abs(v),
        sympy.Max(v, 0) / v - sympy.Min(v, 0) / v,
    ],
)
def test_ways_to_switch(force):
    block = fp.System.from_sympy([x, v], [v, -x - F * force], {F: 0.4})
    assert block.kinds == ("switching",)
    run = fp.simulate(block, [3, 0], (0, 20))
    assert run.y[:, -1] == pytest.approx([-0.2, 0], abs=1e-6)


def test_jumps():
    e = sympy.Symbol("e")
    ball = fp.System.from_sympy(
        [x, v], [v, sympy.Float(-9.8)], {e: 0.9}, jumps={"ground": (x, [x, -e * v])}
    )
    first = np.sqrt(20 / 9.8)
    run = fp.simulate(ball, [10, 0], (0, 30), rtol=1e-10, atol=1e-10)
    assert run.events["t"][1] == pytest.approx(first, abs=1e-9)
    assert run.events["t"][-2] == pytest.approx(19 * first, abs=1e-8)


@pytest.mark.parametrize(
    ("state", "field", "words"),
    [
        ([x, v], [v, -x - F * sympy.sign(v)], "symbol F is unknown"),
        ([x, v], [v, -sympy.Function("y")(t)], r"y\(t\) is a function"),
        ([x, v], [v], "returned 1 values"),
        (["x", v], [v, x], "sympy symbol"),
        ("x v", [v, x], "list of sympy symbols"),
        ([x, v], [v, sympy.floor(x)], "infinitely many"),
        ([x, v], ["v", "__import__('os').getcwd()"], "no text"),
        ([x, sympy.Symbol("v, (), print")], [v, x], "name is one of Python"),
    ],
)
def test_wrong_formulas_are_refused_with_their_reason(state, field, words):
    with pytest.raises((ValueError, TypeError), match=words):
        fp.System.from_sympy(state, field)
