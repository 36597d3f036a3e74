# SPDX-License-Identifier: BSD-3-Clause
from types import SimpleNamespace

import numpy as np
import pytest

import filippov as fp
from filippov import _core
from filippov._results.settings import analysis_settings

BLOCK = fp.models.oscillator
TIGHT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-14}


def simulated(orbit, x0, periods=1):
    end = orbit.t0 + periods * orbit.period
    run = fp.simulate(orbit.system, x0, (orbit.t0, end), params=orbit.params, **TIGHT)
    assert run.success
    return run.y[:, -1]


def sorted_by_size(values):
    return values[np.argsort(-np.abs(values), kind="stable")]


@pytest.fixture(scope="module")
def orbits():
    """The three period-one orbits of figure 4.16: stable, stable, unstable."""
    p = {"A": 3.6, "omega": 1.067}
    return (
        fp.periodic_orbit(BLOCK, [-0.685, 3.01], params=p),
        fp.periodic_orbit(BLOCK, params=p),
        fp.periodic_orbit(BLOCK, [-0.445, 1.27], params=p),
    )


# --- what is found ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("A", "omega", "word"),
    [
        (5, 1.6, "-+"),
        (5, 1.72, "0-+"),
        (5, 2.5, "0-+"),
        (5, 2.8, "0-"),
        (4.9, 2.4, "0-+"),
        (4.9, 2.7, "0-"),
        (4.4, 1.6, "0-+"),
        (4.4, 1.8, "0-0+"),
        (4.4, 2.0, "0-"),
    ],
)
def test_words_of_the_chapters_orbits(A, omega, word):
    # figures 4.9, 4.10 and 4.12
    orbit = fp.periodic_orbit(BLOCK, params={"A": A, "omega": omega})
    assert orbit.success
    assert orbit.status == "ok"
    assert orbit.message == ""
    assert orbit.word == word
    assert orbit.turns == 1
    assert orbit.stable
    assert orbit.period == BLOCK.period({"omega": omega})
    assert orbit.residual < 1e-12
    assert (orbit.multipliers[-1] == 0) == ("0" in word)  # a slide: exactly
    np.testing.assert_allclose(simulated(orbit, orbit.x0), orbit.x0, atol=1e-11)


def test_a_cycle_goes_into_the_core_as_it_came_out():
    p, told = BLOCK._values({"A": 3.6, "omega": 1.067}), analysis_settings(1e-12, 1e-13)
    found = _core.settle(BLOCK._model, p, np.zeros(2), 200.0, 1, 200.0, told)
    again = _core.solve_orbit(BLOCK._model, found.cycles, told)
    assert (found.status, again.status) == ("ok", "ok")
    np.testing.assert_array_equal(again.cycles.mode, found.cycles.mode)
    np.testing.assert_allclose(again.cycles.x, found.cycles.x, atol=1e-11)
    with pytest.raises(ValueError, match="there is one cycle"):
        _core.solve_orbit(BLOCK._model, _core.CycleColumns(), told)


def test_the_three_orbits_of_figure_4_16(orbits):
    printed = [(-0.685, 3.01), (-0.295, 0.99), (-0.445, 1.27)]
    for orbit, start in zip(orbits, printed, strict=True):
        np.testing.assert_allclose(orbit.x0, start, atol=0.02)  # read off a picture
        np.testing.assert_allclose(simulated(orbit, orbit.x0), orbit.x0, atol=1e-11)
    assert [orbit.stable for orbit in orbits] == [True, True, False]


def test_period_of_dieci_and_lopez():
    orbit = fp.periodic_orbit(fp.models.dieci_lopez)  # P4
    assert orbit.word == "0-"
    assert orbit.period == pytest.approx(9.230770458083, rel=1e-12)
    np.testing.assert_array_equal(orbit.multipliers, [1, 0])  # planar, with a slide
    assert orbit.stable
    assert np.isnan(orbit.events["phase"]).all()
    again = fp.periodic_orbit(fp.models.dieci_lopez, orbit)
    assert again.iterations <= 2
    np.testing.assert_allclose(again.x0, orbit.x0, atol=1e-12)
    np.testing.assert_allclose(simulated(orbit, orbit.x0), orbit.x0, atol=1e-11)


@pytest.mark.parametrize(
    ("zeta", "omega", "period", "slides"),
    [(1, 1, 8.8607064541, 2), (0.05, 8, 5.6077496932, 4)],
)
def test_periods_of_relay_feedback(zeta, omega, period, slides):
    relay = fp.models.relay  # P7
    names = list(relay.params)
    values = dict(zip(names, [zeta, omega, 1, 1, -2, 1], strict=True))
    orbit = fp.periodic_orbit(relay, params=values, x0=[0, 0.5, 0], transient=100)
    assert orbit.success, orbit.message
    assert orbit.period == pytest.approx(period, rel=1e-10)
    assert orbit.word.count("0") == slides
    assert orbit.multipliers[0] == 1
    assert orbit.multipliers[-1] == 0
    # the system is symmetric, and half a period later the orbit is its own mirror image
    np.testing.assert_allclose(simulated(orbit, orbit.x0, 0.5), -orbit.x0, atol=1e-9)


def test_two_tolerances_agree(orbits):
    loose = fp.periodic_orbit(BLOCK, orbits[2], rtol=1e-10, atol=1e-11)
    assert loose.rtol == 1e-10
    np.testing.assert_allclose(loose.x0, orbits[2].x0, atol=1e-9)
    np.testing.assert_allclose(loose.multipliers, orbits[2].multipliers, atol=1e-8)


def test_an_orbit_without_events():
    p = {"A": 0.5, "omega": 3.0, "V": 50, "beta": 0.1, "alpha": 0.3}
    p = {name: value for name, value in p.items() if name in BLOCK.params} | {"alpha": 0}
    orbit = fp.periodic_orbit(BLOCK, params=p, transient=100)
    assert orbit.word == "-"
    assert orbit.events.size == 0
    assert orbit.stable
    np.testing.assert_allclose(simulated(orbit, orbit.x0), orbit.x0, atol=1e-10)
    again = fp.periodic_orbit(BLOCK, orbit, params={"omega": 3.05})
    assert again.success
    assert again.params["V"] == 50
    np.testing.assert_allclose(simulated(again, again.x0), again.x0, atol=1e-10)


def test_longer_orbits_have_turns():
    # section 4.6: the orbit at omega = 2.9 leaves the stick twice in four periods of the forcing
    orbit = fp.periodic_orbit(BLOCK, params={"A": 0.5, "omega": 2.9})
    assert orbit.word == "0-0-"
    assert orbit.period == pytest.approx(orbit.turns * BLOCK.period({"omega": 2.9}), rel=1e-15)
    assert orbit.turns > 1
    assert "of the forcing" in repr(orbit)
    # the start of an orbit is a strobe of it, and stays the same strobe
    near = fp.periodic_orbit(BLOCK, orbit.x0, params=orbit.params, turns=orbit.turns)
    again = fp.periodic_orbit(BLOCK, near)
    np.testing.assert_allclose(near.x0, orbit.x0, atol=1e-11)
    np.testing.assert_allclose(again.x0, orbit.x0, atol=1e-11)
    np.testing.assert_allclose(again.events["t"], orbit.events["t"], atol=1e-11)


# --- derivatives --------------------------------------------------------------------------------


def test_eigenvalues_of_the_monodromy_matrix_are_the_multipliers(orbits):
    # two products of different matrices: over the whole cycle, and between nodes
    for orbit in orbits:
        values = sorted_by_size(np.linalg.eigvals(orbit.monodromy))
        np.testing.assert_allclose(values, orbit.multipliers, atol=1e-11)


def test_the_monodromy_matrix_is_that_of_differences(orbits):
    step = 1e-5  # differences of second order with an error of 1e-10 of integration: about 1e-5
    for orbit in orbits:
        if orbit.events["mode_before"][0] == 0:
            continue  # starts in a slide: differences leave the surface
        columns = [
            (simulated(orbit, orbit.x0 + e) - simulated(orbit, orbit.x0 - e)) / (2 * step)
            for e in step * np.eye(2)
        ]
        np.testing.assert_allclose(np.transpose(columns), orbit.monodromy, atol=1e-6)


def test_events_are_the_events_of_a_run(orbits):
    for orbit in orbits:
        log = orbit.trajectory().events
        log = log[log["mode_before"] != log["mode_after"]]
        log = log[(log["t"] > 0) & (log["t"] < orbit.period)]
        np.testing.assert_allclose(orbit.events["t"], log["t"], atol=1e-10)
        np.testing.assert_array_equal(orbit.events["kind"], log["kind"].astype(str))
        np.testing.assert_array_equal(orbit.events["mode_after"], log["mode_after"])
        np.testing.assert_allclose(orbit.events["x"], log["x_right"], atol=1e-10)
        np.testing.assert_allclose(orbit.events["s"], log["s"], atol=1e-9)
        omega = orbit.params["omega"]
        np.testing.assert_allclose(orbit.events["phase"], omega * orbit.events["t"], atol=1e-12)


# --- guesses ------------------------------------------------------------------------------------


def test_a_trajectory_is_a_guess(orbits):
    stable = orbits[0]
    run = fp.simulate(BLOCK, stable.x0 + np.array([1e-3, 0]), (0, 20.3), params=stable.params)
    found = fp.periodic_orbit(BLOCK, run)  # with the parameter values of the run
    assert dict(found.params) == dict(stable.params)
    np.testing.assert_allclose(found.x0, stable.x0, atol=1e-11)


def test_an_orbit_is_a_guess_at_other_parameter_values(orbits):
    moved = fp.periodic_orbit(BLOCK, orbits[2], params={"omega": 1.0671})
    assert moved.success
    assert not moved.stable
    assert moved.params["A"] == 3.6
    np.testing.assert_allclose(simulated(moved, moved.x0), moved.x0, atol=1e-11)
    assert 0 < np.abs(moved.x0 - orbits[2].x0).max() < 0.05
    # a system with values of its own keeps them
    other = fp.periodic_orbit(BLOCK.with_params(A=3.6001, omega=1.067), orbits[2])
    assert other.params["A"] == 3.6001


def test_a_fixed_point_of_the_event_map_is_a_guess():
    p = {"A": 0.5, "omega": 2.94}
    orbit = fp.periodic_orbit(BLOCK, params=p)
    exits = orbit.events[orbit.events["kind"] == "exit_sliding"]
    assert exits.size == 1
    # figure 4.6a: a stable fixed point at about 0.5 and an unstable one at about 3.5
    point = SimpleNamespace(phase=exits["phase"][0] + 1e-4, boundary=-1, iterate=1)
    again = fp.periodic_orbit(BLOCK, point, params=p)
    assert (again.word, again.turns) == (orbit.word, orbit.turns)
    events = again.events[again.events["kind"] == "exit_sliding"]
    np.testing.assert_allclose(events["phase"], exits["phase"], atol=1e-10)


# --- failures -----------------------------------------------------------------------------------


def test_a_search_that_fails_says_why():
    p = {"A": 0.5, "omega": 2.87}
    none = fp.periodic_orbit(BLOCK, params=p, transient=50, max_turns=2)
    assert none.status == "not_converged"
    assert not none.success
    assert none.message == "no periodic orbit within max_turns forcing periods"
    assert none.message in repr(none)
    assert np.isnan(none.x0).all()
    assert np.isnan(none.multipliers).all()
    assert none.monodromy.shape == (2, 2)
    assert none.events.size == 0
    assert none.params["omega"] == 2.87
    for use in (none.trajectory, none.plot, lambda: fp.periodic_orbit(BLOCK, none)):
        with pytest.raises(ValueError, match=r"orbit\.status = 'not_converged': expected an or"):
            use()
    with pytest.raises(fp.OrbitError, match="no periodic orbit") as caught:
        fp.periodic_orbit(BLOCK, params=p, transient=50, max_turns=2, raise_on_failure=True)
    assert caught.value.orbit.status == "not_converged"


def test_a_run_that_fails_gives_its_own_status():
    few = fp.periodic_orbit(BLOCK, params={"A": 0.5}, max_steps=20)
    assert few.status == "max_steps"
    assert "max_steps" in few.message


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"sys": 3}, TypeError, "sys = 3: expected a System"),
        ({"sys": fp.models.bouncing_ball}, ValueError, "expected a System whose state does not"),
        ({"guess": [1]}, ValueError, "guess = .*expected 2 finite numbers"),
        ({"guess": [1, np.nan]}, ValueError, "guess = "),
        ({"guess": "orbit"}, TypeError, "guess = 'orbit'"),
        ({"guess": [1, 1], "turns": 0}, ValueError, "turns = 0"),
        ({"guess": [1, 1], "x0": [1, 1]}, ValueError, "x0 = .*: expected None where a guess"),
        ({"x0": [1]}, ValueError, "x0 = "),
        ({"params": {"B": 1}}, ValueError, "no parameter 'B'"),
        ({"params": {"omega": 0}}, ValueError, "params = .*: expected a period > 0"),
        ({"transient": 1.5}, ValueError, "transient = 1.5: .*whole periods"),
        ({"transient": -1}, ValueError, "transient = -1"),
        ({"max_turns": 0}, ValueError, "max_turns = 0"),
        ({"window": 0}, ValueError, "window = 0"),
        ({"rtol": 0}, ValueError, "rtol = 0"),
        ({"atol": -1}, ValueError, "atol = -1"),
        ({"max_steps": 0}, ValueError, "max_steps = 0"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(arguments, error, words):
    with pytest.raises(error, match=words):
        fp.periodic_orbit(**{"sys": BLOCK, **arguments})


def test_guesses_of_other_systems_are_refused(orbits):
    with pytest.raises(ValueError, match="expected one of the system relay"):
        fp.periodic_orbit(fp.models.relay, orbits[0])
    with pytest.raises(ValueError, match="turns = 2: expected None: the guess has 1"):
        fp.periodic_orbit(BLOCK, orbits[0], turns=2)


@pytest.mark.parametrize(
    "arguments",
    [
        "params={'A': 0.5, 'omega': 2.87}, transient=10**9, max_steps=10**15",  # one long run
        # many short ones: resonance without friction grows for ever
        "params={'omega': 1, 'alpha': 0, 'beta': 0, 'eta': 0, 'V': 1e12}, max_turns=2**31 - 1",
    ],
)
def test_ctrl_c_stops_at_once(ctrl_c, arguments):
    program = f"""
print("ready", flush=True)
try:
    fp.periodic_orbit(fp.models.oscillator, {arguments})
except KeyboardInterrupt as stop:
    assert stop.orbit.status == "interrupted", stop.orbit
    sys.exit(7)
"""
    ctrl_c(program, pause=0.5)


# --- on disk, as a table, as a picture -----------------------------------------------------------


def test_save_and_load_give_the_same_back(orbits, tmp_path):
    for k, orbit in enumerate(orbits):
        orbit.save(tmp_path / f"orbit {k}")
        again = fp.load(tmp_path / f"orbit {k}")
        assert isinstance(again, fp.Orbit)
        for name in ("multipliers", "monodromy", "x0", "events"):
            np.testing.assert_array_equal(getattr(again, name), getattr(orbit, name))
        for name in ("word", "period", "turns", "stable", "t0", "status", "message", "residual",
                     "iterations", "rtol", "atol"):  # fmt: skip
            assert getattr(again, name) == getattr(orbit, name), name
        assert dict(again.params) == dict(orbit.params)
        assert again.system.name == "oscillator"
        # and goes on as a guess
        assert fp.periodic_orbit(BLOCK, again).iterations <= 2


def test_to_xarray_has_everything(orbits):
    pytest.importorskip("xarray")
    data = orbits[1].to_xarray()
    assert dict(data.sizes)["event"] == orbits[1].events.size
    np.testing.assert_array_equal(data["monodromy"], orbits[1].monodromy)
    np.testing.assert_array_equal(data["x0"].sel(state="v"), orbits[1].x0[1])
    assert data.attrs["word"] == orbits[1].word
    assert data.attrs["omega"] == 1.067


def test_plot_draws_slides_apart_with_surface_and_events(orbits):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    figure, ax = plt.subplots()
    orbit = orbits[1]
    artists = orbit.plot(ax)
    labels = [artist.get_label() for artist in artists]
    assert labels == ["h = 0", "slip", "sliding (stick)", "slide begins", "slide ends"]
    np.testing.assert_allclose(artists[0].get_ydata(), 1)  # v = V
    ends = orbit.events[orbit.events["kind"] == "exit_sliding"]["x"]
    np.testing.assert_array_equal(artists[-1].get_xdata(), ends[:, 0])
    in_time = orbit.plot(ax, x="t", y="v", color="k")
    assert in_time[0].get_color() == "k"
    with pytest.raises(ValueError, match="expected names among y, v, t"):
        orbit.plot(ax, y="z")
    assert dict(matplotlib.rcParams) == before
    plt.close(figure)


def test_an_orbit_of_a_system_that_switches_nowhere():
    @fp.system(state="y v", params={"A": 1.0}, period="2*pi")
    def spring(t, s, p):
        return s.v, -s.y - 0.3 * s.v - s.y**3 + p.A * np.cos(t)

    assert spring.kinds == ()
    assert "slides" not in repr(spring)
    orbit = fp.periodic_orbit(spring, rtol=1e-11, atol=1e-11)
    assert orbit.success
    assert orbit.stable
    # the same by a run with derivatives
    once = fp.strobe_map(spring, orbit.x0, t0=orbit.t0, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(once.x, orbit.x0, atol=1e-8)
    expected = np.sort_complex(np.linalg.eigvals(once.slope[:2, :2]))
    np.testing.assert_allclose(np.sort_complex(orbit.multipliers), expected, rtol=1e-6)
    assert repr(orbit).startswith("<Orbit of spring: period 6.28318531")


def test_an_orbit_is_drawn_with_all_surfaces_that_there_are():
    plt = pytest.importorskip("matplotlib.pyplot")

    @fp.system(state="x v", params={"A": 2.0}, period="2*pi/1.3")
    def rubbing(t, s, p):
        friction = 0.3 * np.sign(s.v) + 0.2 * np.sign(s.v - 0.5)
        return s.v, -s.x - 0.2 * s.v - friction + p.A * np.cos(1.3 * t)

    nowhere = fp.system(state="x v", period="2*pi")(
        lambda t, s, p: (s.v, -0.3 * s.v - 2 * s.x + np.cos(t))
    )
    for system, surfaces in ((rubbing, 2), (nowhere, 0)):
        figure, ax = plt.subplots()
        lines = fp.periodic_orbit(system).plot(ax)
        drawn = [line for line in lines if np.ptp(line.get_ydata()) < 1e-12]
        assert len(drawn) == surfaces
        plt.close(figure)


@pytest.mark.parametrize(
    ("sys", "multipliers", "stable", "word"),
    [
        (BLOCK, [1.0, 0.0], False, "neutral"),
        (BLOCK, [-1.0 - 1e-12, 0.0], False, "neutral"),
        (BLOCK, [1.0 + 1e-6, 0.0], False, "unstable"),
        (BLOCK, [0.5, 0.0], True, "stable"),
        # without a forcing one multiplier is 1 along the orbit
        (fp.models.unit_circle, [1.0, 1.0], False, "neutral"),
        (fp.models.unit_circle, [1.0, 0.5], True, "stable"),
        (fp.models.unit_circle, [2.0, 1.0], False, "unstable"),
    ],
)
def test_a_multiplier_on_the_unit_circle_is_neutral(sys, multipliers, stable, word):
    orbit = fp.Orbit(
        word="-", period=1.0, turns=1, stable=stable, multipliers=np.array(multipliers, complex),
        monodromy=np.eye(2), t0=0.0, x0=np.zeros(2), events=np.empty(0), params=sys.params,
        system=sys, status=fp.Status.ok, message="", residual=0.0, iterations=1, rtol=1e-12,
        atol=1e-13,
    )  # fmt: skip
    assert f", {word}, |multipliers|" in repr(orbit)
