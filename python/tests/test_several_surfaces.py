# SPDX-License-Identifier: BSD-3-Clause
"""Several surfaces, jumps, accumulation, and all solutions where there are several."""

import functools
import math
import pickle

import numpy as np
import pytest

import filippov as fp
from filippov import models

TIGHT = {"rtol": 1e-12, "atol": 1e-13, "method": "dop853"}


def kinds(run):
    return [str(kind) for kind in run.events["kind"]]


# --- several surfaces -----------------------------------------------------------------------------


def test_p12_two_blocks_come_to_rest():
    run = fp.simulate(models.two_blocks, [-2, 0, 3, 0], (0, 20), **TIGHT)
    assert run.success
    # a 50-digit Taylor integrator's values, tests/reference
    np.testing.assert_allclose(
        run.y[:, -1], [-0.46820604389228272, 0, -0.059536911593575687, 0], rtol=0, atol=1e-10
    )
    assert run.events["t"][-2] == pytest.approx(10.819728308717975957, abs=1e-10)
    assert tuple(run.events["mode_after"][-2]) == (0, 0, -1, -1)
    assert run.events["contacts"][-2] == 0b11
    assert run.mode.shape == (4, run.t.size)


def test_p13_leaves_and_meets_both_surfaces_at_once():
    run = fp.simulate(models.dieci_lopez_2, [0.04, -0.01, -0.02], (0, 40), **TIGHT)
    exits = run.events["t"][run.events["kind"] == "exit_sliding"]
    np.testing.assert_allclose(np.diff(exits), 8.288015791096261, rtol=0, atol=1e-10)
    returns = run.events[run.events["kind"] == "enter_sliding"][2:]
    assert (returns["contacts"] == 3).all()
    assert (returns["mode_before"] == -1).all()
    assert (returns["mode_after"] == 0).all()
    # on the intersection s1 = s2 = -x1
    t = np.linspace(8.5, 11, 7)
    np.testing.assert_allclose(run.s(t), [-run.sol(t)[0]] * 2, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(run.sol(t)[1:], [[0.2] * 7, [0.4] * 7])
    assert (run.sol.mode(t) == 0).all()
    moments = fp.simulate(models.dieci_lopez_2_moments, [0.04, -0.01, -0.02], (0, 40), **TIGHT)
    exits = moments.events["t"][moments.events["kind"] == "exit_sliding"]
    np.testing.assert_allclose(np.diff(exits), 8.246730522835675, rtol=0, atol=1e-10)


def test_a_joint_slide_has_the_field_of_a_blend():
    x = [0.5, 0.2, 0.4]
    field = models.dieci_lopez_2.field(0, x, [0, 0])
    # the bilinear blend on the intersection: x1' = 0.3 + x1 (1 - x1)^2/4
    assert field[0] == pytest.approx(0.3 + 0.5 * 0.25 / 4, rel=1e-14)
    np.testing.assert_allclose(field[1:], 0, atol=1e-16)
    jacobian = models.dieci_lopez_2.jacobian(0, x, [0, 0])
    # d/dx1 of it
    assert jacobian[0, 0] == pytest.approx((1 - 0.5) * (1 - 3 * 0.5) / 4, rel=1e-12)


def test_an_ensemble_tells_the_modes_of_all_surfaces():
    chain = models.belt_chain_2
    x0 = np.array([[0.5, 0.1, 0.2], [0.0, 0.1, 0.0], [-0.3, 0.0, 0.4], [0.0, 0.1, 0.1]])
    ends = fp.ensemble(chain, x0, (0, 7.0), rtol=1e-9)
    assert ends.success
    assert ends.mode.shape == (2, 3)
    for k in range(3):
        run = fp.simulate(chain, x0[:, k], (0, 7.0), method="dop853", rtol=1e-9)
        np.testing.assert_allclose(ends.y[:, k], run.y[:, -1], rtol=0, atol=1e-6)
        assert tuple(ends.mode[:, k]) == tuple(run.mode[:, -1])
    assert ends.to_xarray()["mode"].dims == ("surface", "axis_0")


def test_what_is_for_one_surface_says_so():
    chain = models.belt_chain_2.with_params(V=0.4)
    orbit = fp.periodic_orbit(chain, x0=[0.5, 0, -0.3, 0])
    for call in (
        lambda: fp.continuation(orbit, "V", (0.3, 0.5)),
        lambda: fp.equilibria(chain, bounds={}),
        lambda: fp.equilibria(models.bouncing_ball, bounds={}),
        lambda: fp.event_map(models.impact_belt),
        lambda: fp.bifurcation_set(models.impact_belt, {"A": (0, 1), "omega": (1, 2)}),
    ):
        with pytest.raises((ValueError, TypeError), match="one surface"):
            call()
    smooth = fp.system(state="x v", period="6.283185307179586")(
        lambda t, s, p: (s.v, -s.x - s.v + np.cos(t))
    )
    kink = fp.system(state="x v", period="6.283185307179586")(
        lambda t, s, p: (s.v, -s.x - s.v - np.abs(s.x) / 2 + np.cos(t))
    )
    for system, there in (
        (smooth, "0 surfaces"),
        (kink, "1 kink"),
        (chain, "2 switching surfaces"),
    ):
        with pytest.raises(
            ValueError, match=f"a switching one, and no kinks or jumps; it has {there}"
        ):
            fp.equilibria(system, bounds={})
    with pytest.raises(ValueError, match="does not jump"):
        fp.periodic_orbit(models.bouncing_ball)


# --- maps, orbits, exponents ----------------------------------------------------------------------


def test_a_chain_has_orbits_and_multipliers(tmp_path):
    chain = models.belt_chain_2.with_params(V=0.4)
    orbit = fp.periodic_orbit(chain, x0=[0.5, 0, -0.3, 0])
    assert orbit.success
    assert orbit.stable
    assert orbit.word == "0- -- -0 --"
    # shooting in prescribed modes against the derivatives of the engine's own run
    shot = np.sort(np.abs(orbit.multipliers))
    varied = np.sort(np.abs(np.linalg.eigvals(orbit.monodromy)))
    np.testing.assert_allclose(shot, varied, rtol=0, atol=1e-8)
    assert (orbit.multipliers == 1).sum() == 1
    assert (orbit.multipliers == 0).sum() == 1
    assert orbit.events["mode_after"].shape == (4, 2)
    assert sorted(orbit.events["surface"].tolist()) == [0, 0, 1, 1]
    run = orbit.trajectory()
    np.testing.assert_allclose(run.y[:, -1], orbit.x0, rtol=0, atol=1e-9)
    # every event of the run is one of the orbit's
    changes = run.events[1:-1]
    np.testing.assert_allclose(changes["t"], orbit.events["t"], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(changes["mode_after"], orbit.events["mode_after"])
    np.testing.assert_array_equal(changes["surface"], orbit.events["surface"])
    slides = changes["kind"] == "exit_sliding"
    np.testing.assert_allclose(orbit.events["s"][slides], -1, rtol=0, atol=1e-9)
    again = fp.periodic_orbit(chain, orbit, params={"V": 0.41})
    assert again.word == orbit.word
    assert again.success
    assert orbit.to_xarray()["mode_after"].dims == ("event", "switch")
    orbit.save(tmp_path / "orbit.npz")
    assert fp.load(tmp_path / "orbit.npz").word == orbit.word
    assert orbit.plot()


def test_an_orbit_of_forced_modes_must_be_a_solution():
    chain = models.belt_chain_2
    orbit = fp.periodic_orbit(chain.with_params(V=0.4), x0=[0.5, 0, -0.3, 0])
    beyond = fp.periodic_orbit(chain, orbit, params={"V": 0.55})
    assert not beyond.success
    assert "no solution" in beyond.message
    fresh = fp.periodic_orbit(chain.with_params(V=0.55), x0=[0.5, 0, -0.3, 0])
    assert fresh.success
    assert fresh.word == "0- -- -0 -- +-"
    block = models.oscillator
    slides = fp.periodic_orbit(block)
    moved = fp.periodic_orbit(block, slides, params={"A": 2 * slides.params["A"]})
    assert not moved.success


@pytest.mark.slow
def test_exponents_of_a_chain():
    chain = models.belt_chain_2.with_params(V=0.4)
    orbit = fp.periodic_orbit(chain, x0=[0.5, 0, -0.3, 0])
    found = fp.lyapunov(chain, orbit.x0, transient=50, window=4000)
    assert found.success
    expected = np.log(np.abs(orbit.multipliers[:3])) / orbit.period
    np.testing.assert_allclose(found.exponents[:3], expected, rtol=0, atol=1e-3)
    assert found.exponents[3] == -math.inf
    # where both stick at once two directions are lost
    both = fp.lyapunov(chain.with_params(V=0.2), [0.5, 0, -0.3, 0], transient=200, window=500)
    assert (both.exponents[2:] == -math.inf).all()


def test_maps_of_several_surfaces_and_of_impacts():
    belt = models.impact_belt
    x0 = np.array([0.1, 0.2])
    image = fp.strobe_map(belt, x0, iterate=2, wrt=["A", "e"])
    assert image.success
    h = 1e-6
    for k, by in enumerate(np.eye(2) * h):
        ends = [fp.strobe_map(belt, x0 + d, iterate=2).x for d in (by, -by)]
        np.testing.assert_allclose(
            image.slope[:2, k], (ends[0] - ends[1]) / (2 * h), rtol=1e-5, atol=1e-5
        )
    ends = [fp.strobe_map(belt, x0, iterate=2, params={"e": 0.8 + d}).x for d in (h, -h)]
    np.testing.assert_allclose(
        image.param_slope["e"][:2], (ends[0] - ends[1]) / (2 * h), rtol=1e-5, atol=1e-5
    )
    chain = models.belt_chain_2.with_params(V=0.4)
    orbit = fp.periodic_orbit(chain, x0=[0.5, 0, -0.3, 0])
    for surface in (0, 1):
        first = fp.section_map(chain, orbit.x0, "exit_sliding", surface=surface)
        second = fp.section_map(chain, first.x, "exit_sliding", surface=surface, t0=first.t)
        assert second.t - first.t == pytest.approx(orbit.period, abs=1e-9)
    for wrong in (2, True):
        with pytest.raises(ValueError, match=f"surface = {wrong}"):
            fp.section_map(chain, orbit.x0, surface=wrong)


def test_diagrams_of_several_surfaces_and_of_impacts():
    diagram = fp.bifurcation_diagram(
        models.belt_chain_2, V=[0.4, 0.5], x0=[0.5, 0, -0.3, 0], surface=1, transient=1000, keep=50
    )
    assert diagram.success
    assert (diagram.boundary == -1).all()
    for k, V in enumerate((0.4, 0.5)):
        orbit = fp.periodic_orbit(models.belt_chain_2.with_params(V=V), x0=[0.5, 0, -0.3, 0])
        exits = (orbit.events["kind"] == "exit_sliding") & (orbit.events["surface"] == 1)
        seen = diagram.y[0][diagram.value == k]
        np.testing.assert_allclose(seen, orbit.events["x"][exits][0, 0], rtol=0, atol=1e-6)
    with pytest.raises(ValueError, match="no jumps"):
        fp.bifurcation_diagram(models.oscillator, A=[0.5], section="jump")
    impacts = fp.bifurcation_diagram(models.impact_belt, A=[0.6], section="jump", keep=50)
    assert impacts.success
    assert impacts.value.size > 10
    np.testing.assert_allclose(impacts.y[0], 1, rtol=0, atol=1e-9)
    assert (impacts.y[1] < 0).all()


@pytest.mark.slow
def test_basins_of_impacts():
    # beyond the grazing of the free orbit: it and one that impacts once in two periods
    belt = models.impact_belt.with_params(A=0.8, omega=0.5, F=0.4, V=0.2, e=0.5, wall=1.196)
    basins = fp.basins(belt, {"x": (-2, 1.15, 20), "v": (-1.5, 1.53, 20)})
    assert [cycle.period for cycle in basins.attractors] == [1, 2]
    assert basins.disagreements == 0
    assert len(basins.unresolved) == 0
    assert 0 < basins.fractions[1] < 0.1
    free, impacts = basins.attractors
    for cycle in (free, impacts):
        run = fp.simulate(
            belt, cycle.points[:, 0], (0, cycle.period * belt.period()), method="dop853", rtol=1e-10
        )
        np.testing.assert_allclose(run.y[:, -1], cycle.points[:, 0], rtol=0, atol=1e-8)
        assert ("jump" in kinds(run)) == (cycle is impacts)


# --- jumps ----------------------------------------------------------------------------------------


def test_p10_a_ball_comes_to_rest():
    run = fp.simulate(models.bouncing_ball, [10, 0], (0, 30), rtol=1e-10, atol=1e-10)
    assert run.success
    limit = run.events[-2]
    assert limit["kind"] == "accumulation"
    assert limit["t"] == pytest.approx(190 / 7, abs=1e-9)
    assert limit["mode_after"] == 0
    assert tuple(run.y[:, -1]) == (0, 0)
    # both values at a jump: the left one in `sol`, both in `t` and `y`
    first = run.events[1]
    assert first["t"] == pytest.approx(10 / 7, rel=1e-14)
    assert (first["x_left"][1], first["x_right"][1]) == pytest.approx((-14, 12.6), rel=1e-12)
    assert run.sol(first["t"])[1] == pytest.approx(-14, rel=1e-12)
    assert run.sol(np.nextafter(first["t"], 2))[1] == pytest.approx(12.6, rel=1e-12)
    at = np.flatnonzero(run.t == first["t"])
    np.testing.assert_allclose(run.y[1, at], [-14, 12.6], rtol=1e-12)
    # energy between the bounces, from the interpolant
    t = np.linspace(4.1, 6.2, 50)
    x, v = run.sol(t)
    np.testing.assert_allclose(9.8 * x + v**2 / 2, 12.6**2 * 0.81 / 2, rtol=1e-9)


def test_p11_a_thermostat_switches():
    run = fp.simulate(models.thermostat, [15, 1], (0, 40), **TIGHT)
    gaps = np.diff(run.events["t"][:-1])
    up, down, again = (10 * math.log(q) for q in (23 / 14.5, 5.5 / 4, 16 / 14.5))
    np.testing.assert_allclose(gaps[:5], [up, down, again, down, again], rtol=1e-12)
    assert run.system.kinds == ("jump",)


def test_output_times_beside_a_jump():
    hit = 10 / 7
    times = [0.0, hit - 1e-9, hit, hit + 1e-9, 2.0]
    run = fp.simulate(models.bouncing_ball, [10, 0], (0, 2), t_eval=times, rtol=1e-10)
    np.testing.assert_array_equal(run.t, times)
    assert run.y[1, 1] < -13.9
    assert run.y[1, 3] > 12.5
    assert (run.y[0] >= -1e-12).all()


def test_segments_and_pictures_do_not_join_what_jumps():
    import matplotlib.pyplot as plt

    run = fp.simulate(models.impact_belt, [0, 0], (0, 20), rtol=1e-9)
    pieces = list(run.segments())
    jumps = run.events["kind"] == "jump"
    assert jumps.sum() == 3
    ends = [piece.y[:, -1] for piece in pieces]
    for event in run.events[jumps]:
        assert any(np.array_equal(end, event["x_left"]) for end in ends)
    fig, ax = plt.subplots()
    assert run.plot(ax)
    plt.close(fig)


# --- more than one solution -----------------------------------------------------------------------


@pytest.mark.parametrize("method", ["dopri5", "dop853", "rodas5p"])
def test_all_solutions_from_a_tie(method):
    found = fp.simulate(
        models.gene_switch, [3, 3], (0, 5), method=method, on_nonunique="all", rtol=1e-10
    )
    assert isinstance(found, fp.Branches)
    assert len(found) == 3
    assert found.complete
    assert found.success
    ends = {tuple(np.round(run.y[:, -1], 6)) for run in found}
    assert ends == {(8, 0.000212), (0.000212, 8), (4, 4)}
    for run in found:
        assert len(run.choices) == 1
        assert run.choices[0]["t"] == pytest.approx(math.log(7 / 6) / 2, abs=1e-9)
        assert run.choices[0]["alternatives"] == 3
    assert found[:2] == found.trajectories[:2]
    assert "3 solutions" in repr(found)
    few = fp.simulate(models.gene_switch, [3, 3], (0, 5), on_nonunique="all", max_branches=2)
    assert len(few) == 2
    assert not few.complete
    assert "and more" in repr(few)
    with pytest.raises(ValueError, match="max_branches"):
        fp.simulate(models.gene_switch, [3, 3], (0, 5), on_nonunique="all", max_branches=0)


def test_a_unique_solution_is_the_only_branch():
    found = fp.simulate(models.oscillator, [0, 0], (0, 5), on_nonunique="all")
    assert len(found) == 1
    assert len(found[0].choices) == 0
    one = fp.simulate(models.oscillator, [0, 0], (0, 5))
    np.testing.assert_array_equal(found[0].y, one.y)


def test_policies_are_told_by_the_events():
    quartet = models.quartet.with_params(b=-1, c=0, d=0)  # x' = sign x
    stopped = fp.simulate(quartet, [0.0], (0, 1))
    assert stopped.status == "ambiguous"
    assert not stopped.success
    for policy, end in (("below", -1), ("above", 1), ("stay", 0)):
        run = fp.simulate(quartet, [0.0], (0, 1), on_nonunique=policy)
        assert run.y[0, -1] == pytest.approx(end, abs=1e-9)
        assert run.events["alternatives"][0] == 3
        assert run.choices[0]["mode_after"] == end
    ends = sorted(r.y[0, -1] for r in fp.simulate(quartet, [0.0], (0, 1), on_nonunique="all"))
    np.testing.assert_allclose(ends, [-1, 0, 1], atol=1e-9)


# --- hard cases -----------------------------------------------------------------------------------


def test_h15_and_h43_spirals():
    come = fp.simulate(models.sign_plane, [0.3, 0.7], (0, 1), rtol=1e-10)
    assert kinds(come).count("accumulation") == 1
    assert come.events[-2]["t"] == pytest.approx(0.5, abs=1e-9)
    go = fp.simulate(models.sign_plane.with_params(a=1, d=1), [0, 0], (0, 1))
    assert go.status == "ambiguous"
    assert "not shown to attract" in go.message


def test_systems_with_several_surfaces_pickle():
    for system in (models.belt_chain_3, models.bouncing_ball, models.dieci_lopez_2_moments):
        again = pickle.loads(pickle.dumps(system))
        assert again.name == system.name
        assert again.kinds == system.kinds


@pytest.fixture(scope="module")
def beside():
    """What all analyses say of two blocks beside so many components that rest."""

    def blocks(idle):
        names = ["x", "v", "y", "w", *(f"z{k}" for k in range(idle))]
        values = {"A": 1.2, "om": 1.1, "V": 0.5}

        @fp.system(state=names, params=values, period=lambda p: 2 * np.pi / p.om)
        def two(t, s, p):
            pull = 0.4 * (s.y - s.x)
            push = p.A * np.cos(p.om * t) - 0.6 * np.sign(s.v - p.V)
            held = -0.7 * s.y - 0.5 * np.sign(s.w - p.V)
            rest = (-(1 + k) * s[4 + k] for k in range(idle))
            return (s.v, pull - s.x + push, s.w, held - pull, *rest)

        return two

    @functools.cache
    def told(idle):
        system, start = blocks(idle), np.zeros(4 + idle)
        orbit = fp.periodic_orbit(system)
        strobe = fp.strobe_map(system, start, wrt="A")
        seen = fp.bifurcation_diagram(system, om=[1.1], transient=10, keep=5, section="strobe")
        return {
            "word": orbit.word,
            "multipliers": np.sort(np.abs(orbit.multipliers))[::-1][:4],
            "slope": strobe.slope[:4, :4],
            "by A": strobe.param_slope["A"][:4],
            "diagram": seen.y[:4],
            "members": fp.ensemble(system, np.stack([start, start + 0.01], 1), (0, 30)).n_events,
            **{
                method: fp.simulate(system, start, (0, 30), method=method, rtol=1e-9).y[:4, -1]
                for method in ("dopri5", "dop853", "rodas5p")
            },
        }

    return told


@pytest.mark.parametrize("idle", [1, 6])  # 5 components and 10: each is compiled for another shape
def test_what_rests_beside_changes_nothing(beside, idle):
    alone, other = beside(0), beside(idle)
    for what, value in alone.items():
        same = value if isinstance(value, str) else pytest.approx(value, abs=1e-6)
        assert other[what] == same, what
