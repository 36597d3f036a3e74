# SPDX-License-Identifier: BSD-3-Clause
import subprocess
import sys
import time

import numpy as np
import pytest

import filippov as fp

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402


@pytest.fixture(scope="module")
def run():
    return fp.simulate(fp.models.oscillator, [0, 0], (0, 50))


@pytest.fixture
def ax():
    figure, ax = plt.subplots()
    yield ax
    plt.close(figure)


def labels(artists):
    return [artist.get_label() for artist in artists if not artist.get_label().startswith("_")]


def test_a_planar_run_is_a_phase_portrait_with_stick_apart(run, ax):
    slip, stick = run.plot(ax)
    assert labels([slip, stick]) == ["slip", "sliding (stick)"]
    assert slip.axes is stick.axes is ax
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("y", "v")
    v = stick.get_ydata()
    assert (v[np.isfinite(v)] == 1).all()
    assert stick.get_linewidth() > 2 * slip.get_linewidth()
    # the curve is smooth: no corner of more than a few degrees inside a piece
    points = np.array(slip.get_data())
    d = np.diff(points[:, : np.flatnonzero(np.isnan(points[0]))[0]], axis=1)
    turn = np.abs(np.diff(np.unwrap(np.arctan2(d[1], d[0]))))
    assert np.degrees(turn.max()) < 8


def test_against_time_every_component_has_its_line(ax):
    run = fp.simulate(fp.models.relay, [0, -0.001, -0.02], (0, 4))
    artists = run.plot(ax)
    assert labels(artists) == [
        f"{name}, {what}" for name in ("x1", "x2", "x3") for what in ("slip", "sliding (stick)")
    ]
    assert ax.get_xlabel() == "t"


def test_what_is_drawn_can_be_chosen(run, ax):
    slip, stick = run.plot(ax, x="t", y="s", color="black", linewidth=0.5)
    assert slip.get_color() == stick.get_color() == "black"
    assert stick.get_linewidth() > slip.get_linewidth() == 0.5
    s = stick.get_ydata()
    assert (np.abs(s[np.isfinite(s)]) <= 1 + 1e-9).all()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("t", "s")
    with pytest.raises(ValueError, match="expected one of 'y', 'v', 't', 's'"):
        run.plot(ax, y="z")


def test_without_dense_output_the_points_are_drawn(ax):
    run = fp.simulate(fp.models.oscillator, [0, 0], (0, 50), dense_output=False)
    assert labels(run.plot(ax)) == ["slip", "sliding (stick)"]


def test_labels_already_there_stay(run, ax):
    ax.set_xlabel("displacement (m)")
    run.plot(ax)
    assert ax.get_xlabel() == "displacement (m)"


def test_the_current_axes_are_used_without_ax(run, ax):
    plt.sca(ax)
    assert run.plot()[0].axes is ax


def test_the_phase_plot_shows_region_and_boundary(run, ax):
    artists = run.plot_phase(ax)
    assert labels(artists) == [
        "sliding region", "its boundary, in time", "slip", "sliding (stick)",
    ]  # fmt: skip
    boundary = next(a for a in artists if a.get_label() == "its boundary, in time")
    y, v = boundary.get_data()
    assert (v == 1).all()
    assert y.max() == pytest.approx(4.5, abs=1e-12)


def test_a_region_that_does_not_move_is_drawn_once(ax):
    run = fp.simulate(fp.models.dieci_lopez, [0, 0], (0, 20))
    artists = run.plot_phase(ax)
    assert labels(artists) == ["sliding region", "its boundary", "slip", "sliding (stick)"]


def test_only_planar_systems_have_a_phase_plot(ax):
    run = fp.simulate(fp.models.relay, [0, -0.001, -0.02], (0, 1))
    with pytest.raises(ValueError, match="expected a planar system"):
        run.plot_phase(ax)


def test_plots_show_nothing_and_leave_the_settings_alone(run, ax, monkeypatch):
    monkeypatch.setattr(plt, "show", lambda *a, **k: pytest.fail("show was called"))
    before = dict(matplotlib.rcParams)
    run.plot(ax)
    run.plot_phase(ax)
    assert dict(matplotlib.rcParams) == before


def test_matplotlib_is_imported_only_when_used():
    code = """
import sys
import filippov as fp
run = fp.simulate(fp.models.oscillator, [0, 0], (0, 5))
run.event_table()
assert not [name for name in sys.modules if name.split('.')[0] in ('matplotlib', 'scipy')]
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


@fp.system("c x", jumps={"tick": ("1 - c", lambda t, s, p: (s.c - 1, s.x))})
def clock(t, s, p):
    return 1, np.cos(t)


def test_a_picture_of_many_events_is_drawn_at_once(ax):
    """The time for 40,000 jumps was a minute: every stretch looked at all times."""
    run = fp.simulate(clock, [0, 0], (0, 100_000.5))
    assert (run.events["kind"] == "jump").sum() == 100_000
    for drawn in ({}, {"x": "t"}, {"x": "t", "y": ["c", "s"]}):
        began = time.perf_counter()
        line = run.plot(ax, **drawn)[0]
        assert time.perf_counter() - began < 5.0  # 0.5 s where nothing else runs
        assert np.isnan(line.get_xdata()).sum() == 100_000  # the pen is lifted at every jump


def test_the_pen_is_lifted_where_pieces_end(run, ax):
    slip, stick = run.plot(ax, x="t", y="v")
    pieces = list(run.segments(12))
    for line, slides in ((slip, False), (stick, True)):
        mine = [piece for piece in pieces if (piece.mode == 0) == slides]
        gap = np.full((2, 1), np.nan)
        data = [part for piece in mine for part in (np.array([piece.t, piece.y[1]]), gap)]
        wanted = np.concatenate(data[:-1], axis=1)
        np.testing.assert_array_equal(np.array(line.get_data()), wanted)
