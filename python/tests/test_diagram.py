# SPDX-License-Identifier: BSD-3-Clause
import json
import multiprocessing
import sys
import threading

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator
FEW = {"params": {"A": 0.5}, "transient": 100, "keep": 40}


def phases(diagram, k, apart=1e-5):
    each = np.sort(diagram.phase[diagram.value == k])
    return each[np.append(True, np.diff(each) > apart)]


def same(a, b):
    columns = ("value", "period", "t_local", "y", "kind", "surface", "boundary", "status", "y_end")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in columns)


@pytest.fixture(scope="module")
def diagram():
    return fp.bifurcation_diagram(BLOCK, omega=[2.94, 2.91, 2.9, 2.896], **FEW)


def test_the_attractors_have_the_chapters_numbers_of_transitions(diagram):
    # section 4.6: one transition above omega = 2.9043, two below
    assert [phases(diagram, k).size for k in range(4)] == [1, 1, 2, 2]
    assert diagram.success
    assert (diagram.status == "ok").all()
    assert diagram.message == ("", "", "", "")


def test_points_are_on_the_exit_curve(diagram):
    # q = A cos(omega t) - y = -4 where s = -1
    y = 4 + 0.5 * np.cos(diagram.phase)
    np.testing.assert_allclose(diagram.y[0], y, rtol=1e-13)
    np.testing.assert_array_equal(diagram.y[1], 1)
    assert (diagram.boundary == -1).all()
    assert (diagram.kind == fp.EventKind.exit_sliding).all()
    assert (diagram.surface == 0).all()
    assert ((diagram.period >= 100) & (diagram.period < 140)).all()
    np.testing.assert_array_equal(diagram.param, diagram.values[diagram.value])
    np.testing.assert_allclose(diagram.phase, diagram.param * diagram.t_local, rtol=1e-14)


def test_the_points_are_the_events_of_a_run(diagram):
    p = {"A": 0.5, "omega": 2.9}
    T = BLOCK.period(p)
    settings = {"method": "dop853", "rtol": 1e-9, "atol": 1e-9}
    run = fp.simulate(BLOCK, [0, 0], (0, 140 * T), params=p, **settings)
    events = run.events[(run.events["kind"] == "exit_sliding") & (run.events["period"] >= 100)]
    mine = diagram.value == 2
    np.testing.assert_array_equal(diagram.period[mine], events["period"])
    # in lanes to the tolerance; one value after the other by the same engine
    np.testing.assert_allclose(diagram.t_local[mine], events["t_local"], rtol=0, atol=100 * 1e-9)
    alone = fp.bifurcation_diagram(BLOCK, omega=[2.9], follow=True, **FEW)
    np.testing.assert_array_equal(alone.period, events["period"])
    np.testing.assert_allclose(alone.t_local, events["t_local"], rtol=0, atol=1e-11)


def test_a_strobe_has_one_point_a_period():
    strobe = fp.bifurcation_diagram(BLOCK, omega=[2.94, 2.9], section="strobe", **FEW)
    np.testing.assert_array_equal(strobe.period, np.tile(np.arange(101, 141), 2))
    np.testing.assert_array_equal(strobe.phase, 0)
    # the orbit takes four periods, so the strobe sees four points
    for k in range(4):
        orbit = strobe.y[:, :40][:, k::4]
        np.testing.assert_allclose(orbit, orbit[:, :1] @ np.ones((1, 10)), atol=1e-7)
    # the last point may be a copy, which is as good as 16 units in the last place
    np.testing.assert_allclose(strobe.y[:, [39, 79]], strobe.y_end, atol=1e-11)


def test_several_kinds_of_event_are_taken_in_order_of_time():
    both = fp.bifurcation_diagram(BLOCK, omega=[2.94], section=["enter_sliding", "exit_sliding"],
                                  **FEW)  # fmt: skip
    assert both.kind.tolist() == ["enter_sliding", "exit_sliding"] * 10
    t = both.period + both.t_local / both.forcing[0]
    assert (np.diff(t) > 0).all()


def test_a_system_without_a_period_takes_times():
    relay = fp.models.relay
    name = next(iter(relay.params))
    d = fp.bifurcation_diagram(
        relay, section=["cross", "enter_sliding"], x0=[0, -0.001, -0.02], transient=20.5, keep=30,
        **{name: [relay.params[name]]},
    )  # fmt: skip
    assert d.success
    assert d.value.size > 2
    assert ((d.t_local >= 20.5) & (d.t_local <= 50.5)).all()
    assert np.isnan(d.phase).all()
    assert (d.forcing == 0).all()


@pytest.mark.parametrize("follow", [False, True])
def test_the_number_of_threads_changes_no_bit(follow):
    args = {"omega": np.linspace(2.85, 2.9, 7), "follow": follow, "chains": 3, **FEW}
    one = fp.bifurcation_diagram(BLOCK, threads=1, **args)
    assert same(one, fp.bifurcation_diagram(BLOCK, threads=3, **args))
    assert same(one, fp.bifurcation_diagram(BLOCK, **args))


def test_follow_starts_from_the_end_of_the_value_before():
    args = {"params": {"A": 0.5}, "transient": 3, "keep": 5}
    chain = fp.bifurcation_diagram(BLOCK, omega=[2.9, 2.89], follow=True, **args)
    alone = fp.bifurcation_diagram(BLOCK, omega=[2.89], x0=chain.y_end[:, 0], follow=True, **args)
    np.testing.assert_array_equal(chain.y[:, chain.value == 1], alone.y)
    fixed = fp.bifurcation_diagram(BLOCK, omega=[2.9, 2.89], **args)
    assert not np.array_equal(fixed.y_end[:, 1], chain.y_end[:, 1])
    assert (fixed.chains, chain.chains) == (0, 1)


def test_skipping_repeats_shows_and_changes_nothing_but_rounding():
    args = {"omega": [2.94, 2.91], "params": {"A": 0.5}, "transient": 200, "keep": 300}
    skipped = fp.bifurcation_diagram(BLOCK, **args)
    full = fp.bifurcation_diagram(BLOCK, skip_repeats=False, **args)
    assert (full.cycle == 0).all()
    assert (full.skipped == 0).all()
    assert (skipped.cycle > 0).all()
    assert (skipped.skipped > 300).all()
    assert skipped.stats.steps < full.stats.steps / 2
    np.testing.assert_array_equal(skipped.period, full.period)
    np.testing.assert_allclose(skipped.t_local, full.t_local, atol=1e-10)
    np.testing.assert_allclose(skipped.y_end, full.y_end, atol=1e-10)


def test_a_value_that_fails_has_its_own_status():
    d = fp.bifurcation_diagram(BLOCK, omega=[2.94, 0.0, 2.9], **FEW)
    assert d.status.tolist() == ["ok", "not_finite", "ok"]
    assert "period" in d.message[1]
    assert not d.success
    assert np.isnan(d.y_end[:, 1]).all()
    assert set(d.value.tolist()) == {0, 2}
    assert "1 not_finite" in repr(d)
    few_steps = fp.bifurcation_diagram(BLOCK, omega=[2.94], max_steps=50, **FEW)
    assert few_steps.status.tolist() == ["max_steps"]


def test_progress_is_called_with_values_from_the_calling_thread():
    calls = []
    fp.bifurcation_diagram(
        BLOCK, omega=np.linspace(2.85, 2.9, 9), threads=2, **FEW,
        progress=lambda done, total: calls.append((done, total, threading.get_ident())),
    )  # fmt: skip
    done = [call[0] for call in calls]
    assert done == sorted(set(done))
    assert done[-1] == 9
    assert {call[1:] for call in calls} == {(9, threading.get_ident())}


def test_progress_true_shows_a_bar(capsys):
    pytest.importorskip("tqdm")
    fp.bifurcation_diagram(BLOCK, omega=[2.94, 2.9], progress=True, **FEW)
    assert "2/2" in capsys.readouterr().err


def test_what_progress_raises_comes_out_with_what_is_finished():
    def progress(done, total):
        if done >= 2:
            raise ZeroDivisionError

    def finished(n, **args):
        with pytest.raises(ZeroDivisionError) as caught:
            fp.bifurcation_diagram(
                BLOCK, omega=np.full(n, 2.94), threads=1, progress=progress, **args, **FEW
            )
        part = caught.value.diagram
        ok = np.flatnonzero(part.status == "ok")
        assert set(part.status) == {"ok", "interrupted"}
        np.testing.assert_array_equal(np.unique(part.value), ok)
        return ok.tolist()

    assert finished(50, follow=True) == [0, 1]
    side_by_side = finished(500)  # 64 values at a time
    assert 2 <= len(side_by_side) <= 64
    assert max(side_by_side) < 64


@pytest.mark.parametrize("follow", [False, True])
def test_ctrl_c_stops_at_once_and_keeps_what_is_finished(ctrl_c, follow):
    # 2.94 repeats itself and is done at once; a fast drive never does, and takes half an hour
    ctrl_c(f"""
def progress(done, total):
    if done >= 1: print("ready", flush=True)
try:
    fp.bifurcation_diagram(fp.models.oscillator, omega=[2.94, 1e4], transient=2*10**9, keep=1,
                           max_steps=10**15, rtol=1e-12,
                           follow={follow}, threads=2, progress=progress)
except KeyboardInterrupt as stop:
    d = stop.diagram
    assert d.status.tolist() == ["ok", "interrupted"], d.status
    sys.exit(7)
""")


def in_a_child():
    return fp.bifurcation_diagram(BLOCK, omega=[2.94, 2.9], threads=2, **FEW).t_local.tolist()


@pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods() or sys.version_info >= (3, 12),
    reason="forks; from Python 3.12 on that warns where there are threads",
)
def test_a_forked_child_does_not_hang():
    here = in_a_child()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(in_a_child).get(timeout=30) == here


# --- on disk -----------------------------------------------------------------------------------


def test_save_and_load_give_the_same_back(diagram, tmp_path):
    path = tmp_path / "figure 4.5a"  # exactly this name
    diagram.save(path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    again = fp.load(path)
    assert isinstance(again, fp.Diagram)
    assert same(again, diagram)
    np.testing.assert_array_equal(again.values, diagram.values)
    np.testing.assert_array_equal(again.forcing, diagram.forcing)
    for name in ("system", "state", "parameter", "section", "transient", "keep", "chains",
                 "settings", "stats", "message"):  # fmt: skip
        assert getattr(again, name) == getattr(diagram, name), name
    assert dict(again.params) == dict(diagram.params)
    np.testing.assert_array_equal(again.x0, diagram.x0)


def altered(path, out, **changes):
    """Copy a file with other metadata."""
    with np.load(path) as file:
        arrays = dict(file)
    meta = json.loads(str(arrays.pop("__filippov__"))) | changes
    with out.open("wb") as file:
        np.savez(file, __filippov__=np.array(json.dumps(meta)), **arrays)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": 99}, "its format has version 99, expected version 2"),
        (
            {"content": {"class": "Nonsense", "fields": {}}},
            "it holds a Nonsense, expected one of .*Diagram",
        ),
        ({"format": "other"}, "expected a file written by"),
        ({"content": {"class": "Diagram", "fields": {}}}, "its Diagram is incomplete"),
    ],
)
def test_load_refuses_other_formats(diagram, tmp_path, changes, words):
    diagram.save(tmp_path / "good")
    altered(tmp_path / "good", tmp_path / "bad", **changes)
    with pytest.raises(ValueError, match=words):
        fp.load(tmp_path / "bad")


def test_load_refuses_files_of_others(tmp_path):
    text, plain, pickled, cut = (tmp_path / name for name in ("text", "plain", "pickled", "cut"))
    text.write_text("no result")
    with plain.open("wb") as file:
        np.savez(file, a=np.zeros(3))
    with pickled.open("wb") as file:
        np.savez(file, __filippov__=np.array([{}], dtype=object))
    cut.write_bytes(plain.read_bytes()[:60])
    array = tmp_path / "array"
    with array.open("wb") as file:
        np.save(file, np.zeros(3))
    for path in (text, plain, pickled, cut, array):
        with pytest.raises(ValueError, match="expected a file written by the method save"):
            fp.load(path)
    with pytest.raises(FileNotFoundError):
        fp.load(tmp_path / "nothing")


def test_to_xarray_has_everything(diagram):
    pytest.importorskip("xarray")
    data = diagram.to_xarray()
    assert dict(data.sizes) == {"point": diagram.value.size, "value": 4, "state": 2}
    np.testing.assert_array_equal(data["phase"], diagram.phase)
    np.testing.assert_array_equal(data["y"], diagram.y)
    np.testing.assert_array_equal(data["omega"], diagram.param)
    assert data.attrs["A"] == 0.5
    assert data.attrs["method"] == "dop853"


# --- pictures ----------------------------------------------------------------------------------


def test_plot_draws_the_points_on_the_axes_given(diagram):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    before = dict(matplotlib.rcParams)
    figure, ax = plt.subplots()
    (points,) = diagram.plot(ax, color="k")
    assert points.axes is ax
    assert points.get_color() == "k"
    np.testing.assert_array_equal(points.get_xdata(), diagram.param)
    np.testing.assert_array_equal(points.get_ydata(), diagram.phase)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("omega", "phase (rad)")
    (states,) = diagram.plot(ax, y="y")
    np.testing.assert_array_equal(states.get_ydata(), diagram.y[0])
    with pytest.raises(ValueError, match="expected one of 'phase', 't_local', 'y', 'v'"):
        diagram.plot(ax, y="z")
    assert dict(matplotlib.rcParams) == before
    plt.close(figure)


def test_plot_tells_the_boundaries_apart():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    d = fp.bifurcation_diagram(BLOCK, omega=[1.72], params={"A": 5}, section="cross",
                               transient=20, keep=20)  # fmt: skip
    figure, ax = plt.subplots()
    assert d.value.size == 20  # once an orbit, which takes one period
    assert (d.kind == "cross").all()
    assert [a.get_label() for a in d.plot(ax)] == [
        {-1: "h < 0", 1: "h > 0"}[side] for side in np.unique(d.boundary)
    ]
    plt.close(figure)


# --- refusals ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({}, TypeError, "swept parameters: none: expected one"),
        ({"omega": [1], "A": [1]}, TypeError, "swept parameters: omega, A: expected one"),
        ({"omega": [1], "speed": 3}, TypeError, "no argument 'speed', and oscillator has no param"),
        ({"omega": 2.9}, ValueError, "omega = 2.9: expected an array"),
        ({"omega": []}, ValueError, r"omega = \[\]: expected an array"),
        ({"omega": [2.9, np.nan]}, ValueError, "omega = .*: expected 2 finite numbers"),
        ({"omega": ["a"]}, TypeError, "omega = .*: expected 1 finite number"),
        ({"omega": [1], "params": {"omega": 2}}, ValueError, "other parameters than omega"),
        ({"omega": [1], "params": {"B": 2}}, ValueError, "no parameter 'B'"),
        ({"omega": [1], "section": "exit"}, ValueError, "section = 'exit': expected one of strobe"),
        ({"omega": [1], "section": []}, ValueError, r"section = \[\]"),
        ({"omega": [1], "section": ["strobe", "cross"]}, ValueError, '"strobe" alone'),
        ({"omega": [1], "transient": 1.5}, ValueError, "transient = 1.5: .*whole periods"),
        ({"omega": [1], "transient": -1}, ValueError, "transient = -1"),
        ({"omega": [1], "keep": 0}, ValueError, "keep = 0: expected a finite number > 0"),
        ({"omega": [1], "keep": np.inf}, ValueError, "keep = inf"),
        ({"omega": [1], "chains": 0}, ValueError, "chains = 0"),
        ({"omega": [1], "threads": 0}, ValueError, "threads = 0"),
        ({"omega": [1], "x0": [1]}, ValueError, "x0 = "),
        ({"omega": [1], "method": "euler"}, ValueError, "method = 'euler'"),
        ({"omega": [1], "rtol": 0}, ValueError, "rtol = 0"),
        ({"omega": [1], "surface": 1}, ValueError, "surface = 1"),
        ({"omega": [1], "progress": 3}, TypeError, "progress = 3: expected a bool or a function"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(arguments, error, words):
    with pytest.raises(error, match=words):
        fp.bifurcation_diagram(BLOCK, **arguments)


def test_a_strobe_needs_a_period():
    with pytest.raises(ValueError, match="relay has no period"):
        fp.bifurcation_diagram(fp.models.relay, section="strobe",
                               **{next(iter(fp.models.relay.params)): [1.0]})  # fmt: skip


def test_pictures_lead_over_all_values():
    plt = pytest.importorskip("matplotlib.pyplot")
    figure, ax = plt.subplots()
    some = fp.bifurcation_diagram(
        fp.models.oscillator, transient=5, keep=5, max_events=3, omega=np.linspace(2, 3, 5)
    )
    assert some.param.size == 0  # every value failed
    some.plot(ax)
    low, high = ax.get_xlim()
    assert low <= 2
    assert high >= 3
    plt.close(figure)


def test_a_diagram_without_a_point_says_where_to_look():
    none = fp.bifurcation_diagram(BLOCK, omega=[2.94, 2.95], section="cross", **FEW)
    assert none.success
    assert "0 points (no such events from x0: see section= and x0=)" in repr(none)
