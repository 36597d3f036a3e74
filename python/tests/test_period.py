# SPDX-License-Identifier: BSD-3-Clause
"""A period has to be that of the forcing, at every value of the parameters that a call is given."""

import re

import numpy as np
import pytest

import filippov as fp
from filippov._cli import main

TURN = 2 * np.pi


def forced(t, s, p):
    return s.v, -s.x - 0.1 * s.v - p.F * np.sign(s.v - 0.5) + p.A * np.cos(p.om * t + p.phi)


def made(period, function=forced, **params):
    defaults = {"om": 1.3, "A": 1.0, "F": 0.3, "phi": 0.0} | params
    return fp.system(state="x v", params=defaults, period=period)(function)


@pytest.fixture(scope="module")
def fixed():
    return made(TURN / 1.3)


@pytest.fixture(scope="module")
def right():
    return made(lambda p: TURN / p.om)


REFUSED = r"om = 1\.5: forced does not repeat after its period, 4\.83321947.*lambda p: .*p\.om"
GRID = {"x": (-1, 1, 4), "v": (-1, 1, 4)}
CALLS = {
    "with_params": lambda f: f.with_params(om=1.5),
    "simulate": lambda f: fp.simulate(f, [0, 0], (0, 6), params={"om": 1.5}),
    "simulate_all": lambda f: fp.simulate(
        f, [0, 0], (0, 6), params={"om": 1.5}, on_nonunique="all"
    ),
    "ensemble": lambda f: fp.ensemble(f, [0, 0], (0, 6), params={"om": 1.5}),
    "ensemble, last": lambda f: fp.ensemble(f, [0, 0], (0, 6), params={"om": [1.3, 1.5]}),
    "ensemble, first": lambda f: fp.ensemble(f, [0, 0], (0, 6), params={"om": [1.5, 1.3]}),
    "diagram": lambda f: fp.bifurcation_diagram(f, A=[1.0, 2.0], params={"om": 1.5}),
    "diagram, last": lambda f: fp.bifurcation_diagram(f, om=[1.3, 1.4, 1.5]),
    "diagram, first": lambda f: fp.bifurcation_diagram(f, om=[1.5, 1.4, 1.3]),
    "basins": lambda f: fp.basins(f, GRID, params={"om": 1.5}),
    "follow_basins": lambda f: fp.follow_basins(f, GRID, "om", [1.3, 1.5]),
    "cell_map": lambda f: fp.cell_map(f, GRID, params={"om": 1.5}),
    "strobe_map": lambda f: fp.strobe_map(f, [0, 0], params={"om": 1.5}),
    "periodic_orbit": lambda f: fp.periodic_orbit(f, params={"om": 1.5}),
    "event_map": lambda f: fp.event_map(f, params={"om": 1.5}),
    "lyapunov": lambda f: fp.lyapunov(f, params={"om": 1.5}),
    "bifurcation_set": lambda f: fp.bifurcation_set(f, {"om": (1.3, 1.5), "A": (0.5, 1.0)}),
    "continuation": lambda f: fp.continuation(fp.periodic_orbit(f), "om", (1.3, 1.5)),
    "period": lambda f: f.period({"om": 1.5}),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_fixed_period_is_refused_wherever_another_frequency_comes_in(fixed, call):
    with pytest.raises(ValueError, match=REFUSED):
        CALLS[call](fixed)


def test_a_saved_system_is_not_restored_with_another_frequency(right, tmp_path):
    # a file that an earlier version wrote has a fixed period and other values beside it
    from filippov._system.system import restore_defined

    plain = made(TURN / 1.3)._definition.plain()
    with pytest.raises(ValueError, match=r"om = 1\.5: forced does not repeat"):
        restore_defined(plain, {"om": 1.5, "A": 1.0, "F": 0.3, "phi": 0.0})


def test_the_command_line_refuses_it(tmp_path, capsys):
    file = tmp_path / "mine.py"
    file.write_text(
        "import numpy as np\nimport filippov as fp\n"
        "@fp.system(state='x v', params=dict(om=1.3), period=2*np.pi/1.3)\n"
        "def f(t, s, p): return s.v, -s.x - np.sign(s.v) + np.cos(p.om*t)\n"
    )
    arguments = ["run", f"{file}:f", "--start", "0,0", "--time", "0:6"]
    assert main(arguments) == 0
    assert main([*arguments, "--param", "om=1.5"]) != 0
    assert "om = 1.5: f does not repeat after its period" in capsys.readouterr().err


@pytest.mark.parametrize(
    "params",
    [
        {"om": 2.6},  # it repeats twice
        {"phi": 0.4},
        {"A": 2.0},
        {"F": 0.0},
        {"A": 0.0, "om": 1.5},  # nothing is forced
        {"A": -1.0, "om": -1.3},
    ],
)
def test_what_repeats_is_not_refused(fixed, right, params):
    run = fp.simulate(fixed, [0, 0], (0, 20), params=params, rtol=1e-10)
    reference = made(None).with_params(**params)
    expected = fp.simulate(reference, [0, 0], (0, 20), rtol=1e-10)
    assert run.y[:, -1] == pytest.approx(expected.y[:, -1], abs=1e-8)


def test_an_amplitude_that_comes_later_is_seen(fixed):
    silent = fixed.with_params(A=0.0, om=1.5)
    for A in (1.0, 1e-3, 1e-9):
        with pytest.raises(ValueError, match="does not repeat"):
            silent.with_params(A=A)
    # ... and where it was nothing by default
    nothing = made(1.0, A=0.0)
    with pytest.raises(ValueError, match="does not repeat"):
        nothing.with_params(A=1.0)
    assert nothing.with_params(F=2.0).params.F == 2.0


def test_a_period_follows_what_it_is_made_of(right):
    for om in (0.5, 1.5, 7.0):
        assert right.with_params(om=om).period() == TURN / om

    def two(t, s, p):
        return s.v, -s.x - p.F * np.sign(s.v) + p.A * (np.cos(p.om * t) + np.cos(p.phi * t))

    both = made(lambda p: TURN / p.om, two, phi=2.6)
    assert both.with_params(om=1.3, phi=3.9).params.phi == 3.9
    assert both.with_params(om=2.0, phi=6.0, A=0.5).params.om == 2.0
    with pytest.raises(ValueError, match=r"phi = 3\.0: two does not repeat .* p\.phi"):
        both.with_params(phi=3.0)


def test_sides_one_by_one_name_the_frequency_alone():
    sides = fp.System(
        "x v",
        {"om": 1.3, "F": 0.3},
        fields={
            "-": lambda t, s, p: (s.v, -s.x + p.F + np.cos(p.om * t)),
            "+": lambda t, s, p: (s.v, -s.x - p.F + np.cos(p.om * t)),
        },
        switch="v",
        period=TURN / 1.3,
    )
    with pytest.raises(ValueError, match=r"^om = 1\.5: .* a function of p\.om$"):
        sides.with_params(om=1.5, F=0.2)


def test_functions_that_are_called_are_looked_at_too():
    def field(sign):
        return lambda t, s, p: (s.v, -s.x + sign * 0.3 + np.cos(p.om * t))

    with pytest.warns(fp.SlowSystemWarning):
        called = fp.System.from_callables(
            "x v",
            {"om": 1.3},
            fields={"-": field(1), "+": field(-1)},
            switch="v",
            period=TURN / 1.3,
        )
    with pytest.raises(ValueError, match=r"om = 1\.5: system does not repeat"):
        called.with_params(om=1.5)
    assert called.with_params(om=2.6).params.om == 2.6


def test_values_are_looked_at_once(fixed, monkeypatch):
    from filippov._system import period as periods

    count = []
    change = periods._change
    monkeypatch.setattr(periods, "_change", lambda *args: count.append(1) or change(*args))
    for A in (0.3, 0.4, 0.5):
        fixed.with_params(phi=0.125, A=A)
    assert len(count) == 1


def test_a_period_that_is_none_is_told_by_its_value(right):
    words = re.escape("expected a period > 0 of forced, got -4.83321947")
    calls = (
        lambda p: fp.strobe_map(right, [0, 0], params=p),
        lambda p: fp.periodic_orbit(right, params=p),
        lambda p: fp.basins(right, GRID, params=p),
    )
    for call in calls:
        with pytest.raises(ValueError, match=words):
            call({"om": -1.3})
    with pytest.raises(ValueError, match="of forced, got inf"):
        fp.strobe_map(right, [0, 0], params={"om": 0.0})
    with pytest.raises(ValueError, match=r"of oscillator, got -6\.28318531"):
        fp.strobe_map(fp.models.oscillator, [0, 0], params={"omega": -1.0})
    # a run needs none, and is that of cos(-t)
    runs = [fp.simulate(right, [0, 0], (0, 6), params={"om": om}) for om in (-1.3, 1.3)]
    assert runs[0].y[:, -1] == pytest.approx(runs[1].y[:, -1], abs=1e-5)


def test_times_of_too_many_periods_are_refused_as_times(right):
    with pytest.raises(ValueError, match=r"t_span = .*: expected times of fewer than 2\*\*52 per"):
        fp.simulate(right, [0, 0], (1e17, 1e17 + 100))
