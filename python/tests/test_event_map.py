# SPDX-License-Identifier: BSD-3-Clause

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator.with_params(A=0.5)
TURN = 2 * np.pi


@fp.system(state="x v", period="2*pi", jumps={"ground": ("x", lambda t, s, p: (s.x, -s.v))})
def wall(t, s, p):
    return s.v, np.cos(t) - s.x


@pytest.fixture(scope="module")
def one():
    return fp.event_map(BLOCK, params={"omega": 2.94})


@pytest.fixture(scope="module")
def two():
    return fp.event_map(BLOCK, iterate=2, params={"omega": 2.9})


def test_figure_4_6(one, two):
    assert one.success, one.message
    assert [(f.prime, f.stable) for f in one.fixed_points()] == [(1, True), (1, False)]
    assert [(f.prime, f.stable) for f in two.fixed_points()] == [(2, True), (1, False), (2, True)]
    stable, unstable = one.fixed_points()
    assert stable.phase == pytest.approx(0.5, abs=0.1)  # read off a picture
    assert unstable.phase == pytest.approx(3.5, abs=0.1)
    # one cycle, so one slope; 1e-9 of the product of two slopes
    first, _, last = two.fixed_points()
    assert first.slope == pytest.approx(last.slope, abs=1e-9)


def test_a_run_goes_where_the_map_says(one):
    for phase in (0.3, 1.7, 3.3, 6.1):
        T = BLOCK.period({"omega": 2.94})
        start = np.array([4 + 0.5 * np.cos(phase), 1 - 1e-13])
        run = fp.simulate(
            BLOCK, start, (phase / TURN * T, phase / TURN * T + 10 * T),
            params={"omega": 2.94}, method="dop853", rtol=1e-12, atol=1e-13,
        )  # fmt: skip
        exits = run.events[run.events["kind"] == fp.EventKind.exit_sliding]
        met = exits["t"][exits["t"] > run.t[0] + 1e-6][0] / T * TURN % TURN
        assert one(phase) == pytest.approx(met, abs=1e-7)


def test_every_sample_is_a_value_of_the_map(one):
    some = slice(None, None, 97)
    value = one(one.phase[some], one.boundary[some])
    np.testing.assert_array_equal(value, one.value[some])
    assert one(0.5 + TURN) == pytest.approx(one(0.5), abs=1e-10)
    assert one(np.full((2, 3), 0.5)).shape == (2, 3)


def test_prolonged_starts_are_those_of_the_closed_form(one):
    drift = 1 + 0.5 * 2.94 * np.sin(one.phase)
    clear = np.abs(drift) > 1e-9
    np.testing.assert_array_equal(one.true_exit[clear], (-one.boundary * drift > 0)[clear])
    starts_sliding = np.array([word.startswith("0") for word in one.word])
    clear = np.abs(drift) > 1e-3  # nearer, a slip can be too low to be told from nothing
    np.testing.assert_array_equal(starts_sliding[clear], ~one.true_exit[clear])
    # such phases are never images
    landed = 1 + 0.5 * 2.94 * np.sin(one.value)
    assert (-one.value_boundary * landed > -1e-6).all()


def test_breaks_have_both_values(one):
    jumps = one.breakpoints[one.breakpoints["jump"]]
    assert jumps.size == 6
    for b in jumps:
        for side, phase in (("left", b["phase"] - 1e-9), ("right", b["phase"] + 1e-9)):
            moved = one(phase, b["boundary"]) - b[side]
            # a root's singularity on one side: 1e-9 in phase is 1e-4 there
            assert abs(np.remainder(moved + np.pi, TURN) - np.pi) < 1e-3


def test_the_slope_is_the_growth_of_tangent_vectors(one):
    f = one.fixed_points()[0]
    exponents = fp.lyapunov(BLOCK, params={"omega": 2.94}, transient=300, window=400).exponents
    T = BLOCK.period({"omega": 2.94})
    assert exponents[0] == pytest.approx(np.log(abs(f.slope)) / (f.turns * T), rel=1e-9)


def test_fixed_points_know_their_state(one):
    for f in one.fixed_points():
        assert f.x == pytest.approx((4 + 0.5 * np.cos(f.phase), 1.0), abs=1e-13)
        assert f.t == pytest.approx(f.phase / 2.94)
        assert one(f.phase) == pytest.approx(f.phase, abs=1e-11 * (1 + abs(f.slope)))


def test_beyond_the_grazing_a_long_cycle_is_found():
    # where figure 4.5 shows chaos, a run from rest repeats itself after 16 transitions
    rest = BLOCK.with_params(omega=2.893)
    result = fp.lyapunov(rest, transient=1000, window=1000)
    cycle = 16 * 2 * np.pi / 2.893 * (1000 / result.slides)
    once = fp.event_map(rest, samples=8, max_evaluations=17)
    phase = 1.0
    for _ in range(500):
        phase = once(phase)
    points = [phase]
    for _ in range(16):
        points.append(once(points[-1]))
    assert points[16] == pytest.approx(points[0], abs=1e-9)
    slopes = [(once(p + 1e-6) - once(p - 1e-6)) / 2e-6 for p in points[:16]]
    growth = np.log(np.abs(slopes)).sum() / cycle
    assert result.exponents[0] == pytest.approx(growth, rel=1e-3)
    assert result.error[0] < 1e-9


def test_no_stick_no_map():
    slip = BLOCK.with_params(V=50, gamma=0)  # a belt that is never caught up
    graph = fp.event_map(slip, samples=8, max_periods=3)
    assert graph.status == "escaped"
    assert "No stick" in graph.message
    assert not graph.defined[graph.true_exit].any()
    assert np.isnan(graph(0.5))


def test_bounded_work_is_reported(one):
    graph = fp.event_map(BLOCK, max_evaluations=50)
    assert graph.status == "max_steps"
    assert not graph.success


def test_pictures(one, two):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots()
    artists = one.plot(ax)
    labels = [artist.get_label() for artist in artists]
    assert "stable" in labels
    assert "unstable" in labels
    faces = {a.get_label(): a.get_markerfacecolor() for a in artists}
    assert faces["unstable"] == "white" != faces["stable"]
    curve = artists[0]
    # the pen is lifted: no stroke jumps
    y = curve.get_ydata()
    assert np.isnan(y).sum() >= 2
    steps = np.abs(np.diff(y))
    assert steps[np.isfinite(steps)].max() < 0.2
    assert len(one.plot(ax, boundary=1, color="red")) > 0
    plt.close(figure)


def test_xarray(one):
    pytest.importorskip("xarray")
    data = one.to_xarray()
    assert data["value"].dims == ("sample",)
    assert data.attrs["omega"] == 2.94


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"sys": "oscillator"}, TypeError, "sys = 'oscillator': expected a forced planar System"),
        ({"sys": fp.models.dieci_lopez}, ValueError, "'dieci_lopez': expected a forced planar"),
        ({"sys": fp.models.stiction}, ValueError, "without static friction"),
        (
            {"sys": wall},
            ValueError,
            "sys = 'wall': expected a forced planar System with one surface, a sw",
        ),
        ({"iterate": 0}, ValueError, "iterate = 0: expected an integer > 0"),
        ({"samples": 3}, ValueError, "samples = 3"),
        ({"rtol": 2.0}, ValueError, "rtol = 2.0"),
        ({"max_periods": -1}, ValueError, "max_periods = -1"),
        ({"guess": [1]}, ValueError, "guess = "),
        ({"params": {"B": 1}}, ValueError, "no parameter 'B'"),
    ],
)
def test_wrong_arguments_are_named(arguments, error, words):
    with pytest.raises(error, match=words):
        fp.event_map(**({"sys": BLOCK} | arguments))


def test_wrong_phases_are_named(one):
    with pytest.raises(ValueError, match="phase = "):
        one([0.5, np.nan])
    with pytest.raises(ValueError, match="boundary = 0"):
        one(0.5, 0)
    with pytest.raises(ValueError, match="boundary = 2"):
        one.plot(boundary=2)


@pytest.mark.parametrize(
    ("call", "result"),
    [
        ("fp.event_map(fp.models.oscillator, iterate=1000, samples=100000)", "event_map"),
        ("fp.lyapunov(fp.models.oscillator, transient=0, window=1e7)", "lyapunov"),
        ("fp.lyapunov(fp.models.oscillator, transient=1e9)", "lyapunov"),
    ],
)
def test_ctrl_c_stops_at_once_and_keeps_what_is_finished(ctrl_c, call, result):
    ctrl_c(f"""
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt as stop:
    sys.exit(7 if stop.{result}.status == "interrupted" else 1)
""")


def test_progress_counts_to_the_end():
    seen = []
    fp.event_map(fp.models.oscillator, samples=16, progress=lambda *at: seen.append(at))
    assert seen == [(k, 32) for k in range(1, 33)]
    seen.clear()
    fp.lyapunov(
        fp.models.oscillator, transient=150, window=50, progress=lambda *at: seen.append(at)
    )
    assert seen[-1] == (200, 200)
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})

    def stop(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough") as caught:
        fp.event_map(fp.models.oscillator, progress=stop)
    assert caught.value.event_map.status == "interrupted"


def test_repr_counts():
    graph = fp.event_map(fp.models.oscillator.with_params(A=0.5, omega=2.94))
    found = len(graph.fixed_points())
    assert repr(graph).startswith("<EventMap of oscillator, iterate 1: ")
    assert f"{found} fixed points; ok>" in repr(graph)
