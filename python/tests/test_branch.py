# SPDX-License-Identifier: BSD-3-Clause
import threading

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator


def traced(A, omega, bounds, **settings):
    start = fp.periodic_orbit(BLOCK, params={"A": A, "omega": omega})
    assert start.success, start.message
    return fp.continuation(start, "omega", bounds, **settings)


@pytest.fixture(scope="module")
def soft():
    """Figure 4.5a's orbits, beyond its grazing too."""
    return traced(0.5, 2.94, (2.84, 2.98))


@pytest.fixture(scope="module")
def hard():
    """Figures 4.9 and 4.10."""
    return traced(5, 1.6, (1.5, 3.2))


def word_at(special, omega):
    """Word of the orbit that a run settles on beside a bifurcation."""
    values = dict(special.orbit.params) | {"omega": omega}
    return fp.periodic_orbit(BLOCK, params=values, x0=special.orbit.x0).word


# --- the four sliding bifurcations ---------------------------------------------------------------


def test_adding_and_grazing_sliding_at_half_a_newton(soft):
    assert soft.success
    (adding,), (grazing,) = soft.special["adding-sliding"], soft.special["grazing-sliding"]
    # printed: 2.904315905, x = (3.63744370156881, 1), phase 3.9011910917405
    assert adding.param["omega"] == pytest.approx(2.904315907, abs=1e-9)
    assert adding.side == -1
    assert {adding.word_before, adding.word_after} == {"0-", "0-0-"}
    c = adding.conditions
    assert max(abs(c[name]) for name in ("h", "1 + s", "L1")) < 1e-12
    assert abs(c["L1'"]) < 1e-10
    assert c["L1''"] > 0
    # closed form of the slide: 1 + A omega sin(phase) = 0 there, and the exit curve's x
    assert 1 + 0.5 * adding.param["omega"] * np.sin(adding.phase) == pytest.approx(0, abs=1e-9)
    assert adding.x == pytest.approx([4 + 0.5 * np.cos(adding.phase), 1], abs=1e-12)
    assert adding.phase == pytest.approx(3.9011910917405, abs=1e-8)
    # printed: 2.8942
    assert grazing.param["omega"] == pytest.approx(2.894149, abs=1e-6)
    assert grazing.conditions["L1'"] < 0
    assert grazing.orbit.events["kind"][grazing.node] == "graze"
    # runs beside the point have the words of its sides
    omega = adding.param["omega"]
    assert word_at(adding, omega + 1e-3) == "0-"
    assert word_at(adding, omega - 1e-3) == "0-0-"


def test_the_orbits_of_figure_4_6_meet_at_the_grazing(soft):
    omega = soft.param["omega"]
    assert omega[0] == omega[-1] == 2.98
    assert soft.stable[0] != soft.stable[-1]
    turn = soft.special["grazing-sliding"][0].param["omega"]
    assert omega.min() >= turn - 1e-12
    assert soft.ends == ("bound of the parameter", "bound of the parameter")


def test_crossing_and_switching_sliding_at_five_newtons(hard):
    assert hard.success
    assert [s.kind for s in hard.specials] == ["crossing-sliding", "switching-sliding"]
    crossing, switching = hard.specials
    assert crossing.param["omega"] == pytest.approx(1.657250519, abs=1e-9)  # printed 1.65768
    assert (crossing.word_before, crossing.word_after) == ("-+", "0-+")
    assert switching.param["omega"] == pytest.approx(2.799190025, abs=1e-9)  # printed 2.7992
    assert (switching.word_before, switching.word_after) == ("0-+", "0-")
    assert (crossing.side, switching.side) == (-1, 1)
    assert crossing.conditions["L1'"] < 0
    assert switching.conditions["L2'"] < 0
    for special in hard.specials:
        c, omega = special.conditions, special.param["omega"]
        L, margin = ("L1", "1 + s") if special.side < 0 else ("L2", "1 - s")
        assert list(c) == ["h", margin, L, f"{L}'", f"{L}''"]
        assert max(abs(c["h"]), abs(c[margin]), abs(c[L])) < 1e-12
        assert special.status == "ok"
        assert special.orbit.success
        assert word_at(special, omega - 1e-3) == special.word_before
        assert word_at(special, omega + 1e-3) == special.word_after


def test_two_tolerances_agree(hard):
    other = traced(5, 1.6, (1.5, 3.2), rtol=1e-10, atol=1e-11)
    assert other.rtol == 1e-10
    for a, b in zip(hard.specials, other.specials, strict=True):
        assert a.param["omega"] == pytest.approx(b.param["omega"], rel=1e-9)


def test_folds_at_3_6():
    branch = traced(3.6, 1.067, (1.0, 1.15))
    folds = branch.special["fold"]
    assert len(folds) == 2
    for fold in folds:
        assert abs(fold.conditions["mu - 1"]) < 1e-9
        assert (fold.node, fold.side) == (-1, 0)
        assert np.isnan(fold.phase)
    # three orbits between them, as in figure 4.14
    low, high = sorted(fold.param["omega"] for fold in folds)
    between = branch.param["omega"] - 0.5 * (low + high)
    assert np.count_nonzero(between[1:] * between[:-1] < 0) == 3
    # stability changes there and nowhere else
    assert np.count_nonzero(branch.stable[1:] != branch.stable[:-1]) == 2


def test_a_closed_branch_is_followed_once():
    branch = traced(0.5, 2.94, (2.0, 4.0))
    assert branch.success
    assert branch.ends == 2 * ("the branch is closed: it comes back to its start",)
    kinds = sorted(special.kind for special in branch.specials)
    assert kinds == ["adding-sliding", "fold", "grazing-sliding"]
    assert branch.param["omega"][0] == branch.param["omega"][-1] == 2.94
    np.testing.assert_array_equal(branch.x0[:, 0], branch.x0[:, -1])
    (fold,) = branch.special["fold"]
    assert branch.param["omega"].max() == pytest.approx(fold.param["omega"], rel=1e-3)


# --- points --------------------------------------------------------------------------------------


def test_points_are_orbits(soft):
    n = len(soft)
    assert soft.x0.shape == (2, n)
    assert soft.multipliers.shape == (n, 2)
    assert set(soft.events["point"].tolist()) == set(range(n))
    for i in (0, n // 3, n // 2, -1):
        orbit = soft.orbit(i)
        assert orbit.iterations <= 2
        assert orbit.params["omega"] == soft.param["omega"][i]
        assert orbit.params["A"] == 0.5
        assert orbit.word == soft.word[i]
        assert orbit.stable == soft.stable[i]
        np.testing.assert_allclose(orbit.x0, soft.x0[:, i], atol=1e-10)
        np.testing.assert_allclose(orbit.multipliers, soft.multipliers[i], atol=1e-9)
        events = soft.events[soft.events["point"] == i % n]
        np.testing.assert_allclose(orbit.events["t"], events["t"], atol=1e-10)
    with pytest.raises(ValueError, match=f"index = {n}: expected an index of {n} points"):
        soft.orbit(n)


def test_a_point_is_a_start(hard):
    middle = hard.orbit(len(hard) // 2)
    again = fp.continuation(middle, "omega", (1.5, 3.2))
    for a, b in zip(hard.specials, again.specials, strict=True):
        assert a.param["omega"] == pytest.approx(b.param["omega"], rel=1e-11)
    other = fp.continuation(middle, "A", (4.9, 5.1))
    assert set(other.param) == {"A"}
    assert other.params["omega"] == middle.params["omega"]


def test_a_system_without_a_period_has_branches():
    start = fp.periodic_orbit(fp.models.dieci_lopez)
    name = next(iter(start.params), None)
    if name is None:
        pytest.skip("no parameter")
    value = start.params[name]
    branch = fp.continuation(start, name, (0.9 * value, 1.1 * value))
    assert branch.success, branch.message
    assert branch.stable.all()
    np.testing.assert_array_equal(branch.multipliers[:, 0], 1)
    assert np.ptp(branch.period) > 0


# --- how it is asked ------------------------------------------------------------------------------


def test_detect_chooses_what_is_reported(hard):
    some = traced(5, 1.6, (1.5, 3.2), detect=["switching-sliding", "fold"])
    assert set(some.special) == {"switching-sliding", "fold"}
    assert [s.kind for s in some.specials] == ["switching-sliding"]
    np.testing.assert_array_equal(some.param["omega"], hard.param["omega"])
    assert set(hard.special) == {
        "crossing-sliding", "grazing-sliding", "switching-sliding", "adding-sliding", "fold",
        "flip", "neimark-sacker", "cusp", "degenerate-switching-sliding", "grazing",
    }  # fmt: skip


def test_few_points_are_a_status_with_words():
    branch = traced(5, 1.6, (1.5, 3.2), max_points=3)
    assert branch.status == "max_steps"
    assert not branch.success
    assert "max_points reached" in branch.message
    assert 2 < len(branch) <= 7


def test_steps_are_no_longer_than_asked(hard):
    fine = traced(5, 2.5, (2.4, 2.6), max_step=0.01)
    assert np.abs(np.diff(fine.param["omega"])).max() <= 0.01 * 0.2 * (1 + 1e-9)
    assert len(fine) > 50


def test_progress_is_called_from_the_calling_thread():
    calls = []

    def progress(done, total):
        calls.append((done, total, threading.get_ident()))

    branch = traced(5, 2.5, (2.4, 2.6), max_points=50, progress=progress)
    done = [call[0] for call in calls]
    assert done == sorted(done)
    assert done[-1] == len(branch)
    assert {call[1:] for call in calls} == {(100, threading.get_ident())}


def test_what_progress_raises_comes_out_with_the_branch():
    def progress(done, total):
        if done >= 4:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as caught:
        traced(5, 1.6, (1.5, 3.2), progress=progress)
    part = caught.value.branch
    assert part.status == "interrupted"
    assert 3 <= len(part) <= 4
    assert np.isfinite(part.x0).all()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"start": 3}, TypeError, "start = 3: expected an Orbit"),
        ({"parameter": "B"}, ValueError, "parameter = 'B': expected the name of one parameter"),
        ({"parameter": ("omega", "A")}, TypeError, "expected a SpecialPoint of a Branch"),
        ({"bounds": 3}, ValueError, "bounds = 3: expected two finite numbers"),
        ({"bounds": (3, 2)}, ValueError, "bounds = .*low < high"),
        ({"bounds": (2.6, 3)}, ValueError, "bounds = .*with omega = 2.5 between them"),
        ({"bounds": (2, np.inf)}, ValueError, r"bounds\[1\] = inf"),
        ({"detect": "hopf"}, ValueError, 'detect = .*: expected "all", or some of crossing-sl'),
        ({"detect": ["fold", 3]}, ValueError, "detect = "),
        ({"detect": 3}, TypeError, "detect = 3"),
        ({"max_step": 0}, ValueError, "max_step = 0"),
        ({"first_step": -1}, ValueError, "first_step = -1"),
        ({"max_points": 0}, ValueError, "max_points = 0"),
        ({"rtol": 2}, ValueError, "rtol = 2"),
        ({"progress": 3}, TypeError, "progress = 3"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(arguments, error, words):
    start = fp.periodic_orbit(BLOCK, params={"A": 5, "omega": 2.5})
    with pytest.raises(error, match=words):
        fp.continuation(**{"start": start, "parameter": "omega", "bounds": (2.4, 2.6), **arguments})


def test_a_start_that_is_no_orbit_is_refused():
    none = fp.periodic_orbit(BLOCK, params={"A": 0.5, "omega": 2.87}, transient=10, max_turns=1)
    with pytest.raises(ValueError, match=r"orbit\.status = 'not_converged'"):
        fp.continuation(none, "omega", (2.8, 2.9))


def test_ctrl_c_stops_at_once_and_keeps_the_branch(ctrl_c):
    ctrl_c("""
orbit = fp.periodic_orbit(fp.models.oscillator, params={"A": 5, "omega": 2.5})
def progress(done, total):
    if done == 20: print("ready", flush=True)
try:
    fp.continuation(orbit, "omega", (2.4, 2.6), max_step=1e-7, max_points=10**8,
                    progress=progress)
except KeyboardInterrupt as stop:
    branch = stop.branch
    assert branch.status == "interrupted", branch.status
    assert len(branch) >= 20 and branch.stable.all()
    sys.exit(7)
""")


# --- on disk, as a table, as a picture ------------------------------------------------------------


def test_save_and_load_give_the_same_back(soft, tmp_path):
    soft.save(tmp_path / "branch")
    again = fp.load(tmp_path / "branch")
    assert isinstance(again, fp.Branch)
    for name in ("word", "period", "turns", "stable", "multipliers", "x0", "events"):
        np.testing.assert_array_equal(getattr(again, name), getattr(soft, name))
    for name in ("status", "ends", "corrections", "bounds", "detect", "rtol", "atol"):
        assert getattr(again, name) == getattr(soft, name), name
    np.testing.assert_array_equal(again.param["omega"], soft.param["omega"])
    for a, b in zip(again.specials, soft.specials, strict=True):
        assert repr(a) == repr(b)
        assert a.conditions == b.conditions
        np.testing.assert_array_equal(a.x, b.x)
        np.testing.assert_array_equal(a.multipliers, b.multipliers)
        np.testing.assert_array_equal(a.orbit.events, b.orbit.events)
    np.testing.assert_array_equal(again.orbit(3).x0, soft.orbit(3).x0)


def test_to_xarray_has_everything(soft):
    pytest.importorskip("xarray")
    data = soft.to_xarray()
    assert data.sizes["point"] == len(soft)
    assert data.sizes["special"] == 2
    np.testing.assert_array_equal(data["omega"], soft.param["omega"])
    np.testing.assert_array_equal(data["special_kind"], [s.kind for s in soft.specials])
    assert data.attrs["A"] == 0.5


def test_plot_has_lines_for_stability_and_a_marker_a_kind(soft, hard):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    figure, ax = plt.subplots()
    artists = soft.plot(ax)
    styles = {line.get_linestyle() for line in artists}
    assert styles == {"-", "--", "None"}
    marks = {line.get_label(): line for line in artists if line.get_linestyle() == "None"}
    assert set(marks) == {"adding-sliding", "grazing-sliding"}
    adding = soft.special["adding-sliding"][0]
    assert marks["adding-sliding"].get_xdata()[0] == adding.param["omega"]
    assert marks["adding-sliding"].get_ydata()[0] == adding.phase
    assert len({line.get_marker() for line in marks.values()}) == 2
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("omega", "phase where a slide ends (rad)")
    for y in ("y", "v", "period", "multiplier"):
        assert hard.plot(ax, y=y, color="k")[0].get_color() == "k"
    with pytest.raises(ValueError, match="expected one of 'phase', 'period', 'multiplier'"):
        soft.plot(ax, y="z")
    assert dict(matplotlib.rcParams) == before
    plt.close(figure)


def test_lines_lead_to_their_bifurcations_and_are_lifted_where_phases_turn(hard, soft):
    pytest.importorskip("matplotlib").use("Agg")
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots()
    for branch in (hard, soft):
        lines = [line for line in branch.plot(ax) if line.get_linestyle() != "None"]
        over = np.concatenate([line.get_xdata() for line in lines])
        for special in branch.specials:  # a word changes: both stretches reach it
            sliding = [w for w in (special.word_before, special.word_after) if "0" in w]
            if special.word_before != special.word_after:
                assert np.count_nonzero(over == special.param["omega"]) >= len(sliding)
        for line in lines:
            x, y = line.get_data()
            assert (np.isnan(x) == np.isnan(y)).all()
            assert not (np.abs(np.diff(y)) > np.pi).any()
    # a slide begins at a switching-sliding bifurcation: it is marked where that slide ends
    (switching,) = hard.special["switching-sliding"]
    mark = next(a for a in hard.plot(ax) if a.get_label() == "switching-sliding")
    ends = switching.orbit.events[switching.orbit.events["kind"] == "exit_sliding"]["phase"]
    assert mark.get_ydata().tolist() == ends.tolist()
    plt.close(figure)


def test_what_is_no_parameter_and_no_index_is_refused():
    orbit = fp.periodic_orbit(fp.models.oscillator, params={"A": 5, "omega": 1.72})
    with pytest.raises(TypeError, match="parameter = "):
        fp.continuation(orbit, ["omega"], (1.6, 1.8))
    branch = fp.continuation(orbit, "omega", (1.71, 1.73))
    with pytest.raises(ValueError, match=r"index = 1\.5"):
        branch.orbit(1.5)


def test_a_branch_from_a_bifurcation_goes_both_ways():
    branch = fp.continuation(
        fp.periodic_orbit(BLOCK, params={"A": 5.0, "omega": 1.6}), "A", (0.5, 12)
    )
    assert {s.kind for s in branch.specials} >= {"grazing-sliding", "adding-sliding", "fold"}
    for start in branch.specials:
        at = start.param["A"]
        near = fp.continuation(start, "A", (at - 0.05, at + 0.05))
        assert near.success
        assert near.ends == ("bound of the parameter", "bound of the parameter")
        assert any(s.kind == start.kind and abs(s.param["A"] - at) < 1e-9 for s in near.specials)


def test_orbits_of_a_curve_of_folds():
    branch = fp.continuation(
        fp.periodic_orbit(BLOCK, params={"A": 5.0, "omega": 1.6}), "A", (0.5, 12)
    )
    curve = fp.continuation(branch.special["fold"][0], ("A", "omega"), ((0.5, 12), (1, 3)))
    for i in range(len(curve) - 1):  # at the last one a slide has no length
        orbit = curve.orbit(i)
        assert orbit.status == "ok"
        assert np.abs(orbit.multipliers - 1).min() < 1e-5
        assert np.allclose(orbit.x0, curve.x0[:, i], atol=1e-9)


def test_static_friction_has_orbits_and_no_branches():
    stiction = fp.models.stiction
    orbit = fp.periodic_orbit(stiction, params={"A": 2.0, "omega": 1.2})
    assert orbit.success
    exits = orbit.events["s"][orbit.events["kind"] == "exit_sliding"]
    assert np.allclose(np.abs(exits), 4 / 3)
    end = fp.simulate(
        stiction, orbit.x0, (orbit.t0, orbit.t0 + orbit.period), params=orbit.params, rtol=1e-11
    ).y[:, -1]
    assert np.allclose(end, orbit.x0, atol=1e-8)
    with pytest.raises(ValueError, match="static friction"):
        fp.continuation(orbit, "A", (1.0, 3.0))
    with pytest.raises(ValueError, match="static friction"):
        fp.bifurcation_set(stiction, {"A": (1, 3), "omega": (1, 2)})
