# SPDX-License-Identifier: BSD-3-Clause
"""Smoothing, and the stiff method that it needs."""

import pickle

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator
STIFF = {"method": "rodas5p", "rtol": 1e-9, "atol": 1e-9}


@fp.system(state="y v", params={"A": 0.5, "omega": 2.94}, period=lambda p: 2 * np.pi / p.omega)
def typed(t, s, p):
    u = 1.0 - s.v
    mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
    return s.v, -s.y + p.A * np.cos(p.omega * t) + 10 * mu * np.sign(u)


@pytest.mark.parametrize("law", ["arctan", "tanh", "saturation"])
@pytest.mark.parametrize("sys", [BLOCK, typed], ids=["model", "typed"])
def test_the_law_is_smooth_and_has_the_true_magnitude(sys, law):
    smooth = fp.smoothed(sys, c1=40, law=law)
    shape = {
        "arctan": lambda u: 2 / np.pi * np.arctan(u),
        "tanh": np.tanh,
        "saturation": lambda u: np.clip(u, -1, 1),
    }[law]
    v = np.array([-1, 0.9, 0.999, 1.0, 1.003, 1.4, 3])
    r = np.abs(v - 1)
    friction = shape(40 * (v - 1)) * 10 * (0.3 / (1 + 1.42 * r) + 0.1 + 0.01 * r**2)
    for k, x in enumerate(zip(np.full(v.size, 0.2), v, strict=True)):
        side = [1 if h > 0 else -1 for h in smooth._model.h(
            np.zeros(1), np.array([x]), smooth._values(None))[0]]  # fmt: skip
        rate = smooth.field(0.0, x, side)
        assert rate[1] == pytest.approx(0.5 - 0.2 - friction[k], abs=1e-13)
    assert smooth.period() == pytest.approx(2 * np.pi / 2.94, rel=1e-15)
    assert smooth.params["c1"] == 40


@pytest.mark.parametrize("sys", [BLOCK, typed], ids=["model", "typed"])
def test_tends_to_the_event_driven_solution(sys):
    exact = fp.simulate(sys, [0, 0], (0, 40), method="dop853", rtol=1e-11, atol=1e-12)
    errors = []
    for c1 in (1e5, 1e8):
        run = fp.simulate(fp.smoothed(sys, c1=c1), [0, 0], (0, 40), **STIFF)
        assert run.success
        errors.append(abs(run.y[:, -1] - exact.y[:, -1]).max())
    # like c1**(-2/3) with the arctan
    assert np.log10(errors[0] / errors[1]) / 3 == pytest.approx(2 / 3, abs=0.06)


@pytest.mark.parametrize("c1", [1e4, 1e8, 1e12])
@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9])
def test_right_at_every_tolerance_or_says_so(c1, tol):
    exact = fp.simulate(BLOCK, [0, 0], (0, 40), method="dop853", rtol=1e-11, atol=1e-12)
    run = fp.simulate(
        fp.smoothed(BLOCK, c1=c1), [0, 0], (0, 40), method="rodas5p", rtol=tol, atol=tol,
        max_steps=20_000,
    )  # fmt: skip
    if run.success:
        error = abs(run.y[:, -1] - exact.y[:, -1]).max()
        assert error < 100 * c1 ** (-2 / 3) + 3e3 * tol
    else:
        assert c1 >= 1e10


def test_bands_tell_stick_from_slip():
    smooth = fp.smoothed(BLOCK, c1=1e8, band=1e-5)
    assert smooth.kinds == ("kink", "kink")
    assert smooth.params["band"] == 1e-5
    exact = fp.simulate(BLOCK, [0, 0], (0, 40), rtol=1e-10)
    exits = exact.events["t"][exact.events["kind"] == "exit_sliding"]
    run = fp.simulate(smooth, [0, 0], (0, 40), **STIFF)
    events = run.events[run.events["kind"] == "cross"]
    outward = events["mode_after"][np.arange(events.size), events["surface"]] == 1
    leaves = events["t"][outward]
    assert leaves.size == exits.size
    assert ((leaves > exits) & (leaves < exits + 0.02)).all()
    assert abs(events["x_right"][:, 1] - 1) == pytest.approx(1e-5, rel=1e-6)


def test_a_diagram_of_transitions():
    smooth = fp.smoothed(BLOCK, c1=1e8, band=1e-5)
    options = {"transient": 20, "keep": 10, "omega": [2.94]}
    by_events = fp.bifurcation_diagram(BLOCK, **options)
    diagram = fp.bifurcation_diagram(
        smooth, section="cross", direction=1, method="rodas5p", rtol=1e-8, atol=1e-8, **options
    )
    assert (diagram.status == "ok").all()
    # one transition a period, a little later
    assert diagram.t_local.size == by_events.t_local.size
    late = diagram.t_local - by_events.t_local
    assert ((late > 0) & (late < 0.02)).all()
    assert (diagram.boundary == 1).all()


def test_a_band_that_is_never_left_has_no_transitions():
    wide = fp.smoothed(BLOCK, c1=1e8, band=100.0)
    diagram = fp.bifurcation_diagram(
        wide, section="cross", method="rodas5p", transient=2, keep=3, omega=[2.94], rtol=1e-8
    )
    assert (diagram.status == "ok").all()
    assert diagram.t_local.size == 0


def test_pickles_saves_and_is_written_down(tmp_path):
    smooth = fp.smoothed(typed, c1=1e6, law="tanh", band=1e-3)
    again = pickle.loads(pickle.dumps(smooth))
    assert again == smooth
    assert again.params["band"] == 1e-3
    run = fp.simulate(smooth, [0, 0], (0, 5), **STIFF)
    run.save(tmp_path / "run.npz")
    loaded = fp.load(tmp_path / "run.npz")
    assert loaded.system == smooth
    np.testing.assert_array_equal(loaded.y, run.y)
    assert r"\tanh" in smooth.latex()
    assert r"\left|" in smooth.latex()
    assert "tanh" in smooth.to_cpp()
    assert smooth != fp.smoothed(typed, c1=1e6, band=1e-3)


def test_steepness_is_a_parameter():
    smooth = fp.smoothed(BLOCK)
    runs = fp.ensemble(
        smooth, np.zeros((2, 3)), (0, 1), params={"c1": np.array([1.0, 10.0, 100.0])}, rtol=1e-8
    )
    assert np.unique(runs.y[1]).size == 3
    for name in ("c1", "band"):
        with pytest.raises(ValueError, match=f"{name}.*> 0"):
            fp.smoothed(BLOCK, band=0.1).with_params(**{name: -1.0})


def test_what_makes_no_sense_is_refused():
    for c1 in (0, -1, np.nan, np.inf, "steep"):
        with pytest.raises((ValueError, TypeError), match="c1"):
            fp.smoothed(BLOCK, c1=c1)
    for band in (0, -1, np.nan):
        with pytest.raises(ValueError, match="band"):
            fp.smoothed(BLOCK, band=band)
    with pytest.raises(ValueError, match="law"):
        fp.smoothed(BLOCK, law="cubic")
    with pytest.raises(ValueError, match="band is 1/c1"):
        fp.smoothed(BLOCK, law="saturation", band=0.1)
    with pytest.raises(TypeError, match="expected a System"):
        fp.smoothed("oscillator")
    with pytest.raises(TypeError, match="compiled model"):
        fp.smoothed(fp.models.stiction)
    with pytest.raises(ValueError, match="not smoothed yet"):
        fp.smoothed(fp.smoothed(BLOCK))
    with pytest.raises(ValueError, match="c1"):

        @fp.smoothed
        @fp.system(state="x", params={"c1": 1.0})
        def has_it(t, s, p):
            return -p.c1 * np.sign(s.x)

    with pytest.raises(fp.DefinitionError, match="nothing switches"):

        @fp.smoothed
        @fp.system(state="x")
        def smooth(t, s):
            return -s.x


@pytest.mark.parametrize("law", ["arctan", "tanh", "saturation"])
@pytest.mark.parametrize("tol", [1e-4, 1e-8])
def test_a_layer_that_repels_is_left(law, tol):
    # L-stable methods damp what grows like anything else: they would rest in the layer
    @fp.system(state="x")
    def accelerates(t, s):
        return 1.5 + np.sign(s.x)

    smooth = fp.smoothed(accelerates, c1=1e6, law=law)
    run = fp.simulate(smooth, [-0.01], (0, 3), method="rodas5p", rtol=tol, atol=tol)
    assert run.success
    assert run.y[0, -1] == pytest.approx(7.45, abs=1e-3)
    assert run.stats.steps < 200


def test_magnitudes_are_no_switches():
    @fp.system(state="x v")
    def both(t, s):
        return s.v, -s.x * abs(s.x) - 0.4 * np.sign(s.v - 0.5)

    assert fp.smoothed(both, band=0.1).switches == ("0.5 - v - band", "v - 0.5 - band")
    assert fp.smoothed(both, law="saturation").surfaces == 2

    @fp.system(state="x v")
    def drag(t, s):
        return s.v, -s.x - s.v * abs(s.v)

    with pytest.raises(fp.DefinitionError, match="nothing switches"):
        fp.smoothed(drag)


def test_at_most_eight_switches_are_smoothed():
    @fp.system(state="x v")
    def steps(t, s, p):  # one surface, ten arguments of sign
        return s.v, -s.x - sum(np.sign(k * s.x + k * s.v) for k in range(1, 11))

    assert steps.kinds == ("switching",)
    with pytest.raises(ValueError, match="more than 8 switches are smoothed"):
        fp.smoothed(steps)


def test_what_would_help_is_said():
    explicit = {"method": "dopri5", "max_steps": 1000, "dense_output": False}
    run = fp.simulate(fp.smoothed(BLOCK), [0, 0], (0, 40), **explicit)
    assert run.status == "max_steps"
    assert "rodas5p" in run.message
    run = fp.simulate(fp.smoothed(BLOCK), [0, 0], (0, 40))
    assert run.success
    assert run.settings.method == "rodas5p"
    diagram = fp.bifurcation_diagram(
        fp.smoothed(BLOCK), section="strobe", transient=1, keep=1, omega=[2.94]
    )
    assert diagram.settings.method == "rodas5p"
    run = fp.simulate(BLOCK, [0, 0], (0, 40), max_steps=10)
    assert "rodas5p" not in run.message


def test_a_smoothed_system_has_no_slides_to_look_for():
    with pytest.raises(ValueError, match=r"section.*no surface on which it could slide"):
        fp.bifurcation_diagram(fp.smoothed(BLOCK), omega=[2.9])
    with pytest.raises(ValueError, match=r"direction.*strobe"):
        fp.bifurcation_diagram(BLOCK, omega=[2.9], section="strobe", direction=1)


def test_the_stiff_method_says_where_it_is_not():
    with pytest.raises(ValueError, match="method"):
        fp.ensemble(BLOCK, np.zeros((2, 2)), (0, 1), method="rodas5p")


def test_the_stiff_method_takes_few_steps_where_it_is_stiff():
    stiff = fp.models.stiff_relay.with_params(**{"lambda": 1e6})
    run = fp.simulate(stiff, [1], (0, 3), method="rodas5p", rtol=1e-8, atol=1e-8)
    assert run.success
    assert run.stats.steps < 100
    (hit,) = run.events["t"][run.events["kind"] == "enter_sliding"]
    assert hit == pytest.approx(np.pi - np.arctan(1e6), abs=1e-7)
    assert run.settings.method == "rodas5p"
    # also where nothing is stiff, with every event in its place
    exact = fp.simulate(BLOCK, [0, 0], (0, 50), method="dop853", rtol=1e-11, atol=1e-12)
    run = fp.simulate(BLOCK, [0, 0], (0, 50), **STIFF)
    assert run.events["kind"].tolist() == exact.events["kind"].tolist()
    assert run.events["t"] == pytest.approx(exact.events["t"], abs=1e-6)
    t = np.linspace(0, 50, 301)
    assert run.sol(t) == pytest.approx(exact.sol(t), abs=1e-6)


def test_formulas_of_the_oscillator_are_those_that_are_compiled():
    model = fp.models.oscillator
    random = np.random.default_rng(7)
    values = {key: value * random.uniform(0.8, 1.2) for key, value in model.params.items()}
    compiled, _ = model._formulas().made()
    written = fp.System._of(compiled, ["h"] * model.surfaces)
    assert written.kinds == model.kinds
    for _ in range(60):
        x, t = random.standard_normal(model.dim), random.uniform(0, 10)
        p = np.array(list(values.values()))
        h = model._model.h(np.array([t]), x[None], p)
        np.testing.assert_allclose(written._model.h(np.array([t]), x[None], p), h, rtol=1e-13)
        side = [1 if v > 0 else -1 for v in h[0]]
        np.testing.assert_allclose(
            written.field(t, x, side, values), model.field(t, x, side, values), rtol=1e-11
        )
