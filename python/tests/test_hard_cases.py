# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases by the ids of docs/hard-cases.md, with systems typed as a user would type them.

Elsewhere: H28 in test_event.py (TestH28), H41 in test_bad_input.py and test_wrong_calls.py.
Not from Python: the part of H34 about float and long double, since Python's numbers are double;
the fifty components of H39, since a definition has at most 32 (tests/test_hard_cases_limits.cpp
has both), and H27's million of periods, which take too long here: there are ten thousand.
"""

import math
from collections import Counter

import numpy as np
import pytest

import filippov as fp

EPS = np.finfo(float).eps
METHODS = ("dopri5", "dop853", "rodas5p")
EXPLICIT = METHODS[:2]
MODE_CHANGES = {"cross", "enter_sliding", "exit_sliding", "accumulation"}

each_method = pytest.mark.parametrize("method", METHODS)
explicit = pytest.mark.parametrize("method", EXPLICIT)


def sides(below, above, switch, state="x y"):
    return fp.System(state, fields={"-": below, "+": above}, switch=switch)


def strip(l1, l2):
    """(1, l1(x)) below y = 0 and (1, l2(x)) above: on the surface x is the time."""
    return sides(lambda t, s, p: (1.0, l1(s.x)), lambda t, s, p: (1.0, l2(s.x)), "y")


def line(switch, slow=1.0, fast=2.0):
    """Speeds of x where h < 0 and where h > 0."""
    return sides(lambda t, s, p: slow, lambda t, s, p: fast, switch, "x")


def called(below, above, switch, state="x"):
    """Make a system of functions that Python calls."""
    with pytest.warns(fp.SlowSystemWarning):
        return fp.System.from_callables(state, fields={"-": below, "+": above}, switch=switch)


def down(x):
    return -1.0


def up(x):
    return 1.0


def plus(x):
    return x


def minus(x):
    return -x


def go(system, x0, t_span, tol=1e-9, method="dopri5", **options):
    """Run with a bound on everything, and check the log."""
    bounds = {"max_steps": 100_000, "max_events": 2_000}
    given = {"rtol": tol, "atol": tol} | bounds | options
    run = fp.simulate(system, x0, t_span, method=method, **given)
    assert faults(run, np.sign(t_span[1] - t_span[0])) == ""
    return run


def faults(run, direction=1):
    """Every log starts and ends, is finite, and its times and modes follow on each other."""
    log = run.events
    if log["kind"][0] != "start" or log["kind"][-1] != "end":
        return "no start or no end"
    if not (np.isfinite(log["x_left"]).all() and np.isfinite(log["x_right"]).all()):
        return "a state is not finite"
    if (direction * np.diff(log["t"]) < 0).any():
        return "time turns back"
    if (log["mode_before"][1:] != log["mode_after"][:-1]).any():
        return "modes do not follow on each other"
    for event in log[1:-1]:
        changed = np.any(event["mode_before"] != event["mode_after"])
        if event["kind"] != "jump" and changed != (event["kind"] in MODE_CHANGES):
            return "kind and modes contradict each other"
    return ""


def word(run):
    return " ".join(str(kind) for kind in run.events["kind"][1:-1])


def times(run, *kinds):
    return [float(e["t"]) for e in run.events if e["kind"] in kinds]


def assert_failed(run, status, *words):
    """The status, and a message that names time, state and mode besides these words."""
    assert run.status == status, run.message
    assert not run.success
    for part in ("At t = ", "x = (", "mode (", *words):
        assert part in run.message


def close(x, tol):
    return pytest.approx(x, rel=0, abs=tol)


# --- H1, H2: touches ------------------------------------------------------------------------------


def grazing(far=-1.0):
    """x = sin t below the line x = 1, which it touches; beyond it `far`."""
    return sides(lambda t, s, p: (s.y, -s.x), lambda t, s, p: (far, 0.0), "x - 1")


@each_method
@pytest.mark.parametrize("tol", [1e-6, 1e-9, 1e-12])
def test_h1_a_touch_is_a_graze_at_the_extremum(method, tol):
    run = go(grazing(), [0, 1], (0, 3), tol, method)
    assert run.success
    assert word(run) == "graze"
    touch = run.events[1]
    # some ten steps, each with an error of tol; x' = 0 gives the time of the extremum as well
    assert touch["t"] == close(math.pi / 2, 100 * tol)
    assert (touch["mode_before"], touch["mode_after"], touch["surface"]) == (-1, -1, 0)
    assert run.y[:, -1] == close([math.sin(3), math.cos(3)], 100 * tol)


@each_method
def test_h1_a_touch_of_a_surface_that_moves(method):
    # x = 1 - t, so that h = (t - 1)^2 along the path; below everything rises
    moving = sides(
        lambda t, s, p: 5.0, lambda t, s, p: -1.0, lambda t, s, p: s.x - 1 + t + (t - 1) ** 2, "x"
    )
    run = go(moving, [1], (0, 2), 1e-9, method)
    assert run.success
    assert word(run) == "graze"
    assert run.events["t"][1] == close(1, 1e-9)
    assert run.events["mode_after"][1] == 1
    assert run.y[0, -1] == close(-1, 1e-13)


@each_method
@pytest.mark.parametrize("tol", [1e-6, 1e-9, 1e-12])
def test_h2_some_ulp_short_or_deep_are_answered_alike(method, tol):
    block = grazing()
    words = Counter(word(go(block, [0, 1 + k * EPS], (0, 3), tol, method)) for k in range(-40, 41))
    assert set(words) == {"graze"}


@each_method
def test_h2_from_a_miss_to_a_slide_the_answer_changes_twice(method):
    sizes = 10.0 ** (-3 - 0.25 * np.arange(53))
    starts = 1 + np.concatenate([-sizes, sizes[::-1]])
    block = grazing()
    words = [word(go(block, [0, start], (0, 3), 1e-9, method)) for start in starts]
    changes = [w for k, w in enumerate(words) if k == 0 or w != words[k - 1]]
    assert changes == ["", "graze", "enter_sliding exit_sliding"]


@each_method
def test_h2_where_the_far_side_leads_away_a_touch_has_one_of_two_answers(method):
    away = grazing(far=1.0)
    for k in range(-20, 21):
        run = go(away, [0, 1 + k * 1e-12], (0, 3), 1e-10, method)
        crosses = word(run) == "cross"
        assert run.success
        assert crosses or word(run) in ("", "graze")
        end = 1 + 3 - run.events["t"][1] if crosses else math.sin(3)
        assert run.y[0, -1] == close(end, 1e-7)  # 1000 tolerances: no third solution is near
    # what is a hundred times deeper than 1e-10 is plain
    assert word(go(away, [0, 1 + 1e-5], (0, 3), 1e-10, method)) == "cross"
    assert word(go(away, [0, 1 - 1e-5], (0, 3), 1e-10, method)) == ""


# --- H3, H4: many roots ---------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("w", [0.3, 0.1, 1e-2, 1e-3, 1e-4])
def test_h3_two_crossings_inside_one_step(method, w):
    gate = line(lambda t, s, p: w**2 - (s.x - 0.5) ** 2)
    for start in (0.0, -0.13, -0.3):
        run = go(gate, [start], (0, 2), 1e-9, method)
        assert run.success
        assert word(run) == "cross cross"
        reached = 0.5 - w - start
        # h is flat, so that its rounding moves its root by eps/w; some ulp of t besides
        assert run.events["t"][1:3] == close([reached, reached + w], 8 * EPS / w + 1e-14)


def wave(frequency):
    return lambda t, s, p: np.sin(frequency * s.x) + 0.5


def crossings_of_wave(frequency, t_end):
    """Times at which x from 0, of speed 1 where h < 0 and 2 where h > 0, meets a zero of it."""
    first = 7 * math.pi / 6 / frequency / 2
    gap = np.tile([4 * math.pi / 6, 8 * math.pi / 6 / 2], 1000) / frequency
    met = first + np.concatenate([[0], np.cumsum(gap)])
    return met[met < t_end]


@each_method
@pytest.mark.parametrize("frequency", [10.0, 30.0, 70.0, 100.0, 300.0, 1000.0])
def test_h4_all_roots_of_a_fast_h_in_order(method, frequency):
    # the field is constant: no error estimate bounds a step
    run = go(line(wave(frequency)), [0], (0, 0.7), 1e-9, method)
    assert run.success
    # hundreds of crossings, each to an ulp of 1
    assert times(run, "cross") == close(crossings_of_wave(frequency, 0.7), 1e-12)


@each_method
@pytest.mark.parametrize("d", [0.2, 0.05, 0.01])
def test_h4_three_roots_close_to_each_other(method, d):
    near = line(lambda t, s, p: (s.x - 0.5) ** 3 - d**2 * (s.x - 0.5))
    run = go(near, [0], (0, 1), 1e-9, method)
    assert word(run) == "cross cross cross"
    wanted = [0.5 - d, 0.5 - d / 2, 0.5 + d / 2]
    # h is flat: its rounding over its slope 2 d^2
    assert run.events["t"][1:4] == close(wanted, 1e-14 + 8 * EPS * 0.25 / d**2)


# --- H5 to H8: leaving a slide --------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_h5_an_exit_is_a_root_of_l1_whatever_the_tolerance(method, tol):
    fold = sides(lambda t, s, p: (1.0, np.cos(s.x)), lambda t, s, p: (3.0, -1.0), "y")
    run = go(fold, [0, 0], (0, 2), tol, method)
    assert run.success
    assert word(run) == "exit_sliding"
    leave = run.events[1]
    # L1 = cos x, found to rounding
    assert leave["x_right"][0] == pytest.approx(math.pi / 2, rel=4 * EPS)
    assert leave["x_right"][1] == 0
    assert leave["s"] == close(-1, 4 * EPS)
    # on the surface x' = (1 + 3 cos x)/(1 + cos x): its reciprocal by Gauss's rule
    node, weight = np.polynomial.legendre.leggauss(40)
    c = np.cos(math.pi / 4 * (node + 1))
    exact = math.pi / 4 * (weight * (1 + c) / (1 + 3 * c)).sum()
    assert leave["t"] == close(exact, 20 * tol)  # the error of some steps


@each_method
def test_h5_an_exit_upwards(method):
    run = go(strip(up, plus), [-1, 0], (0, 2), 1e-9, method)
    assert times(run, "exit_sliding") == close([1], 1e-14)  # some ulp
    assert run.events["s"][1] == close(1, 4 * EPS)
    assert run.y[1, -1] == close(0.5, 1e-9)  # y = x^2/2


@each_method
def test_h6_where_l1_touches_zero_the_slide_goes_on(method):
    run = go(strip(lambda x: x**2, down), [-1, 0], (0, 2), 1e-9, method)
    assert word(run) == "slide_extremum"
    assert run.events["t"][1] == close(1, 1e-8)  # a double root: the square root of rounding
    assert (run.mode[-1], run.y[1, -1]) == (0, 0)


@each_method
@pytest.mark.parametrize(("sign", "mode", "end"), [(1, 0, 0), (-1, -1, -1 / 3)])
def test_h6_a_start_on_a_double_zero_goes_where_the_next_derivative_says(method, sign, mode, end):
    run = go(strip(lambda x: sign * x**2, down), [0, 0], (0, 1), 1e-9, method)
    assert run.success
    assert word(run) == ""
    assert run.mode[-1] == mode
    assert run.y[1, -1] == close(end, 1e-8)


@each_method
@pytest.mark.xfail(
    strict=True, reason="ambiguous or with touches, by the rounding of the place where it lands"
)
def test_h6_where_l1_vanishes_triply_it_changes_sign_and_the_slide_ends(method):
    for start in (-1.0, -0.9, -0.7):
        for tol in (1e-6, 1e-9, 1e-12):
            run = go(strip(lambda x: -(x**3), down), [start, 0], (0, 2), tol, method)
            assert run.success, run.message
            assert word(run) == "exit_sliding"
            # 1 + s = x^3 is rounding below 6e-6
            assert run.events["t"][1] == close(-start, 1e-5)


TWO_FOLDS = [
    (-1, 1, "two-fold, visible-visible"),
    (-1, -2, "two-fold, visible-invisible"),
    (1, 2, "two-fold, visible-invisible"),
    (1, -1, "two-fold, invisible-invisible"),
]


@each_method
@pytest.mark.parametrize(("a", "b", "kind"), TWO_FOLDS)
def test_h7_a_two_fold_is_ambiguous_and_named(method, a, b, kind):
    run = go(strip(lambda x: a * x, lambda x: b * x), [0, 0], (0, 1), 1e-9, method)
    assert_failed(run, "ambiguous", "At t = 0, x = (0, 0)", "surface 0", kind)
    assert run.stats.steps == 0


@each_method
def test_h7_a_policy_chooses(method):
    fold = strip(minus, lambda x: 2 * x)
    for policy, mode, end in (("below", -1, -0.5), ("above", 1, 1.0)):
        run = go(fold, [0, 0], (0, 1), 1e-9, method, on_nonunique=policy)
        assert run.success
        assert run.events["mode_after"][0] == mode
        assert run.choices["t"].tolist() == [0]
        assert run.y[1, -1] == close(end, 1e-9)
    stay = go(fold, [0, 0], (0, 1), 1e-9, method, on_nonunique="stay")
    assert_failed(stay, "ambiguous", "no sliding field")  # 0/0 there


@each_method
def test_h7_all_branches_of_a_two_fold(method):
    found = fp.simulate(
        strip(minus, lambda x: 2 * x), [0, 0], (0, 1), method=method, on_nonunique="all"
    )
    ends = sorted(branch.y[1, -1] for branch in found if branch.success)
    assert ends == close([-0.5, 1], 1e-8)


@each_method
@pytest.mark.parametrize("start", [0.0, 1e-17, 1e-12, 1e-6, 0.1])
def test_h8_a_slide_that_is_over_at_the_start_is_not_begun(method, start):
    run = go(strip(minus, down), [start, 0], (0, 1), 1e-9, method)
    assert run.success
    assert word(run) == ""
    assert (run.events["mode_after"][0], run.events["surface"][0]) == (-1, 0)
    assert run.y[1, -1] == close(-0.5 - start, 1e-9)  # -(x^2 - start^2)/2


# --- H9 to H13: starts, two-folds, boundaries -----------------------------------------------------


@each_method
@pytest.mark.parametrize("start", [-1.0, -0.1, -1e-3, 0.0, 1e-3, 1.0])
def test_h9_starts_a_rounding_error_off_the_surface_are_as_on_it(method, start):
    block = strip(minus, down)
    on = go(block, [start, 0], (0, 2), 1e-9, method)
    for h in (1e-17, -1e-17, 1e-16, -1e-16, 1e-14, -1e-14):
        off = go(block, [start, h], (0, 2), 1e-9, method)
        assert (off.status, word(off)) == (on.status, word(on))
        assert off.events["mode_after"][0] == on.events["mode_after"][0]
        assert off.y[:, -1] == close(on.y[:, -1], 1e-12)  # a thousandth of the tolerance


@each_method
def test_h10_on_repulsive_sliding_the_policy_decides_and_the_result_says_so(method):
    repulsive = strip(down, up)
    stopped = go(repulsive, [0, 0], (0, 1), 1e-9, method)
    assert_failed(stopped, "ambiguous", "At t = 0,", "surface 0", "repulsive")
    for policy, mode in (("below", -1), ("above", 1), ("stay", 0)):
        run = go(repulsive, [0, 0], (0, 1), 1e-9, method, on_nonunique=policy)
        assert run.success
        assert word(run) == ""
        (choice,) = run.choices
        assert (choice["mode_after"], choice["alternatives"]) == (mode, 3)
        assert run.y[1, -1] == close(mode, 1e-13)  # unit speed or rest


@each_method
def test_h11_a_slide_that_turns_repulsive_stops_there(method):
    fold = strip(minus, lambda x: 2 * x)
    run = go(fold, [-1, 0], (0, 2), 1e-9, method)
    assert_failed(run, "ambiguous", "mode (0)", "surface 0", "two-fold, visible-visible")
    assert run.t[-1] == close(1, 1e-8)  # L1 - L2 is located, with the error of some steps
    assert run.y[1, -1] == 0
    for policy, end in (("below", -0.5), ("above", 1.0)):
        run = go(fold, [-1, 0], (0, 2), 1e-9, method, on_nonunique=policy)
        assert word(run) == "exit_sliding"
        assert run.y[1, -1] == close(end, 1e-7)


def brake():
    """A mass whose friction falls through zero at pi/2 while it is held."""

    @fp.system(state="x v")
    def mass(t, s):
        return s.v, -0.4 * np.cos(t) * np.sign(s.v)

    return mass


@each_method
def test_h11_friction_that_falls_through_zero(method):
    run = go(brake(), [0, 0], (0, 3), 1e-9, method)
    assert_failed(run, "ambiguous", "surface 0", "two-fold")
    assert run.t[-1] == close(math.pi / 2, 1e-8)


CLOSED = {
    "friction": (brake(), [0, 0], math.pi / 2),
    "visible": (strip(minus, lambda x: 2 * x), [-1, 0], 1),
    "sines": (strip(lambda x: -np.sin(x), lambda x: np.sin(2 * x)), [-0.5, 0], 0.5),
}


@explicit
@pytest.mark.parametrize("name", CLOSED)
def test_h11_an_ensemble_stops_there_too(method, name):
    system, start, t_fold = CLOSED[name]
    assert system.sliding == "closed form"
    ends = fp.ensemble(system, np.array([start]).T, (0, 3), method=method)
    assert ends.status[0] == "ambiguous"
    assert ends.t[0] == close(t_fold, 1e-8)


@explicit
def test_h11_an_ensemble_stops_where_the_slide_is_integrated(method):
    fold = sides(lambda t, s, p: (1 + 0.1 * s.x, -s.x), lambda t, s, p: (1.5, 2 * s.x), "y")
    assert fold.sliding == "equivalent control"
    ends = fp.ensemble(fold, [[-1], [0]], (0, 2), rtol=1e-9, atol=1e-9, method=method)
    assert ends.status[0] == "ambiguous"
    assert ends.y[:, 0] == close([0, 0], 1e-8)


@each_method
def test_h12_the_corner_where_slides_end_is_a_crossing(method):
    for k in (-50, -5, 0, 5, 50):
        run = go(strip(minus, down), [-1 + k * EPS, 1], (0, 2), 1e-9, method)
        assert run.success
        assert word(run) in ("cross", "enter_sliding exit_sliding")
        assert run.y[1, -1] == close(-0.5, 1e-8)
    corner = go(strip(minus, down), [-1, 1], (0, 2), 1e-9, method).events[1]
    assert (corner["mode_before"], corner["mode_after"]) == (1, -1)
    assert corner["s"] == close(-1, 1e-12)  # linear in x, which is 0 to some ulp


@each_method
def test_h12_the_corner_where_slides_begin_is_an_entry(method):
    for k in (-50, -5, 0, 5, 50):
        run = go(strip(plus, down), [-1 + k * EPS, 1], (0, 2), 1e-9, method)
        assert run.success
        assert word(run) in ("enter_sliding", "cross enter_sliding")
        assert run.y[1, -1] == close(0, 1e-15)
        assert run.mode[-1] == 0
    corner = go(strip(plus, down), [-1, 1], (0, 2), 1e-9, method).events[1]
    assert (corner["kind"], corner["mode_before"], corner["mode_after"]) == ("enter_sliding", 1, 0)


@each_method
@pytest.mark.parametrize("gap", [1e-2, 1e-5, 1e-8, 1e-12, 1e-16, 0.0])
def test_h13_a_slide_that_nears_its_boundary_goes_on(method, gap):
    tol = 1e-9
    run = go(strip(lambda x: x**2 + gap, down), [-1, 0], (0, 2), tol, method)
    assert run.success
    assert (run.mode == 0).all()
    assert word(run) in ("", "slide_extremum")
    assert gap > 0 or word(run) == "slide_extremum"
    assert gap <= 10 * tol or word(run) == ""
    assert times(run, "slide_extremum") in ([], close([1], 1e-6))  # the parabola is flat there


@each_method
def test_h13_each_touch_of_an_oscillating_s_is_found(method):
    run = go(strip(lambda x: 1 + np.cos(2 * math.pi * x), down), [0, 0], (0, 10), 1e-9, method)
    assert set(word(run).split()) == {"slide_extremum"}
    # double roots: the square root of rounding
    assert times(run, "slide_extremum") == close(0.5 + np.arange(10), 1e-7)


@each_method
def test_h13_no_exit_is_missed_however_fast_s_swings(method):
    # a + cos 2 pi x < 0 around x = 0.5, 1.5, ...: one exit a unit of time
    for a in np.linspace(0.6, 0.9, 11):
        swing = strip(lambda x, a=a: a + np.cos(2 * math.pi * x), down)
        run = go(swing, [a - 1, 0], (0, 6.2), 1e-9, method)
        exits = math.acos(-a) / (2 * math.pi) + 1 - a + np.arange(7)
        # the end of the last fall, and of the steps before it, in ulp
        assert times(run, "exit_sliding") == close(exits[exits < 6.2], 1e-12)


# --- H14, H15: accumulation -----------------------------------------------------------------------


def ball(restitution, g=9.8):
    @fp.system(
        state="x v",
        params={"e": restitution, "g": g},
        jumps={"floor": ("x", lambda t, s, p: (s.x, -p.e * s.v))},
    )
    def falling(t, s, p):
        return s.v, -p.g

    return falling


@each_method
@pytest.mark.parametrize("e", [0.01, 0.3, 0.7, 0.95])
@pytest.mark.parametrize("tol", [1e-3, 1e-7, 1e-13])
def test_h14_bounces_end_in_rest_at_the_limit_of_their_times(method, e, tol):
    run = go(ball(e), [1, 0.5], (0, 60), tol, method)
    assert run.success
    v1 = math.sqrt(0.5**2 + 2 * 9.8)
    exact = (0.5 + v1) / 9.8 + 2 * e * v1 / (9.8 * (1 - e))
    # five hundred bounces at most, each to some ulp of t = 18
    assert times(run, "accumulation") == close([exact], tol + 5e-12)
    assert run.events.size < 600
    assert (run.y[0, -1], run.y[1, -1], run.mode[-1]) == (0, 0, 0)


@each_method
def test_h14_an_elastic_ball_bounces_on(method):
    run = go(ball(1.0), [1, 0], (0, 10), 1e-9, method)
    assert run.success
    fall = math.sqrt(2 / 9.8)
    # ten flights, each to a relative 1e-9
    assert times(run, "jump") == close(fall * (1 + 2 * np.arange(11)), 1e-7)
    assert times(run, "accumulation") == []
    assert 9.8 * run.y[0, -1] + run.y[1, -1] ** 2 / 2 == pytest.approx(9.8, rel=1e-7)


def signs(a):
    """x' = a sign x + 2 sign y, y' = -2 sign x + a sign y: a spiral, inwards for a < 0."""

    @fp.system(state="x y")
    def spiral(t, s):
        return a * np.sign(s.x) + 2 * np.sign(s.y), -2 * np.sign(s.x) + a * np.sign(s.y)

    return spiral


@each_method
@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e9])
def test_h15_crossings_that_accumulate_end_on_the_intersection(method, scale):
    run = go(signs(-1), [0, scale], (0, 2 * scale), 1e-9 * min(scale, 1), method)
    assert run.success
    # |x| + |y| falls at the rate 2 in every quadrant; the limit is good to the tolerance
    assert times(run, "accumulation") == pytest.approx([scale / 2], rel=1e-9)
    assert run.mode[:, -1].tolist() == [0, 0]
    assert run.y[:, -1].tolist() == [0, 0]
    assert run.events.size < 80


# --- H16: rounding at contact ---------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("tol", [1e-6, 1e-12])
def test_h16_a_normal_component_of_rounding_size_is_decided_by_a_rule(method, tol):
    ends, begins, above = strip(minus, down), strip(plus, down), strip(up, plus)
    for d in 10.0 ** np.arange(-18, -11):
        for start in (-1 + d, -1 - d):  # contact where L = +-d
            run = go(ends, [start, 1], (0, 2), tol, method)
            assert run.success
            assert run.y[1, -1] == close(-0.5, 1e-9)  # a parabola: no error but rounding
            run = go(begins, [start, 1], (0, 2), tol, method)
            assert run.success
            assert run.mode[-1] == 0
            run = go(above, [start, -1], (0, 2), tol, method)
            assert run.success
            assert run.y[1, -1] == close(0.5, 1e-9)


@each_method
@pytest.mark.parametrize("first", [1e-14, 1e-10, 1e-6, 1e-2, 0.5])
def test_h16_a_first_step_of_any_size_changes_no_event(method, first):
    for system, wanted in (
        (strip(up, lambda x: 2.0), ""),
        (strip(down, lambda x: -2.0), ""),
        (strip(lambda x: -1 - x, down), ""),
        (strip(minus, down), "exit_sliding"),
    ):
        run = go(system, [-1, 0], (0, 2), 1e-9, method, first_step=first)
        assert run.success
        assert word(run) == wanted


# --- H17 to H19: several surfaces -----------------------------------------------------------------


@fp.system(state="x y")
def planes(t, s):
    return 0.3 - np.sign(s.x), -0.2 - 2 * np.sign(s.y)


@each_method
def test_h17_two_surfaces_hit_at_once_are_one_event(method):
    run = go(planes, [0.7, 2.2], (0, 2), 1e-10, method)  # -0.7 and -2.2 a unit of time
    assert word(run) == "enter_sliding"
    hit = run.events[1]
    assert hit["t"] == close(1, 1e-14)  # some steps of a constant field, an ulp each
    assert (hit["surface"], hit["contacts"]) == (0, 0b11)
    assert hit["mode_after"].tolist() == [0, 0]


@each_method
def test_h17_hit_at_different_times_they_are_two_events(method):
    run = go(planes, [1.3, 2.2], (0, 3), 1e-10, method)
    assert word(run) == "enter_sliding enter_sliding"
    assert run.events["surface"][1:3].tolist() == [1, 0]
    assert run.events["t"][1:3] == close([1, 13 / 7], 1e-13)


def test_h17_starts_beside_an_intersection_are_as_on_it():
    for x in (0.0, 1e-17, -1e-17):
        for y in (0.0, 1e-17, -1e-17):
            run = go(planes, [x, y], (0, 1))
            assert run.success
            assert run.events["mode_after"][0].tolist() == [0, 0]
            assert run.y[:, -1].tolist() == [0, 0]


@each_method
@pytest.mark.parametrize("right", [0.5, 0.99, 1.01, 2.0, -0.5, -2.0])
def test_h18_a_slide_goes_on_or_ends_where_another_surface_is_crossed(method, right):
    @fp.system(state="x y", surfaces={"gate": "x", "road": "y"})
    def gate(t, s):  # held on y = 0 by a force of at most 1
        return 1.0, -np.sign(s.y) + right * np.heaviside(s.x, 0.5)

    run = go(gate, [-1, 0], (0, 2), 1e-9, method)
    assert run.success
    (met,) = run.events[1:-1]
    assert met["t"] == close(1, 1e-13)
    leaves = 0 if abs(right) < 1 else int(np.sign(right))
    assert (met["mode_before"].tolist(), met["mode_after"].tolist()) == ([-1, 0], [1, leaves])
    assert run.y[1, -1] == close(right - leaves if leaves else 0, 1e-9)


@each_method
def test_h18_an_intersection_is_left_where_the_first_s_reaches_its_end(method):
    @fp.system(state="x y")
    def pulled(t, s):  # s1 + 0.3 s2 = 0.1 + 0.5 t and s2 - 0.4 s1 = -0.2 + 0.2 t hold both
        one, two = np.sign(s.x), np.sign(s.y)
        return 0.1 + 0.5 * t - one - 0.3 * two, -0.2 + 0.2 * t - two + 0.4 * one

    run = go(pulled, [0, 0], (0, 2.2), 1e-9, method)
    assert word(run) == "exit_sliding"
    leave = run.events[1]
    assert leave["t"] == pytest.approx((1.12 - 0.16) / 0.44, rel=1e-11)  # located on s1 = 1
    assert leave["surface"] == 0
    assert leave["mode_after"].tolist() == [1, 0]


@each_method
def test_h18_where_an_intersection_ceases_to_attract_the_run_stops(method):
    @fp.system(state="x y z")
    def loosening(t, s):  # spirals onto x = y = 0 while z < 1, and away from it after that
        one, two = np.sign(s.x), np.sign(s.y)
        return (s.z - 1) * one + 2 * two, -2 * one + (s.z - 1) * two, 1.0

    run = go(loosening, [0, 0, 0], (0, 3), 1e-9, method)
    assert_failed(run, "ambiguous", "not shown to attract")
    assert run.t[-1] == close(1, 1e-9)
    assert run.mode[:, -1].tolist() == [0, 0]


@each_method
@pytest.mark.parametrize("scale", [1.0, -1.0, 1e9])
def test_h19_surfaces_that_touch_where_they_are_hit_are_dependent(method, scale):
    @fp.system(state="x y", surfaces={"road": "y", "arc": lambda t, s: scale * (s.y + s.x**2)})
    def twice(t, s):
        return 0.0, -1 - 0.1 * np.sign(s.y) - 0.1 * np.sign(s.y + s.x**2)

    assert twice.surfaces == 2
    run = go(twice, [0, 1], (0, 5), 1e-9, method)
    assert_failed(run, "dependent_surfaces", "surface 1")
    assert run.t[-1] == pytest.approx(1 / 1.2, rel=1e-9)
    assert go(twice, [0, 0], (0, 5), 1e-9, method).status == "dependent_surfaces"


@each_method
def test_h19_a_wall_and_friction_that_hold_the_same_speed(method):
    @fp.system(state="x v", jumps={"wall": ("x", lambda t, s, p: (s.x, -0.5 * s.v))})
    def block(t, s):
        return s.v, -1 - 0.3 * np.sign(s.v)

    run = go(block, [0, 0], (0, 3), 1e-9, method)
    assert_failed(run, "dependent_surfaces", "At t = 0, x = (0, 0)")


def test_h19_a_surface_given_twice_is_one_or_is_refused():
    @fp.system(state="x y")
    def merged(t, s):
        return 1.0, -0.1 * np.sign(s.y) - 0.2 * np.sign(2 * s.y) + 0.3 * np.sign(-s.y)

    assert merged.surfaces == 1
    assert go(merged, [0, 0.6], (0, 2)).events["t"][1] == close(1, 1e-13)  # falls at 0.6
    corners = {key: lambda t, s, p: (1.0, -1.0) for key in ("--", "+-", "-+")}
    with pytest.raises(fp.DefinitionError, match="surface 1"):
        fp.System("x y", fields=corners | {"++": lambda t, s, p: (1.0, -1.2)}, switch=["y", "2*y"])


# --- H20 to H22: switching functions --------------------------------------------------------------


def friction(switch, sign=1):
    low, high = (lambda t, s, p: (s.v, -s.x + 0.4 * sign), lambda t, s, p: (s.v, -s.x - 0.4 * sign))
    return sides(low, high, switch, "x v")


@each_method
@pytest.mark.parametrize("c", [1e-9, 1.0, 1e9])
def test_h20_h_in_other_units_and_with_a_gradient_of_any_length(method, c):
    scaled = friction(lambda t, s, p: c * (s.v + s.x**2 / 4 * s.v))
    run = go(scaled, [3, 0], (0, 20), 1e-10, method)
    assert word(run) == "cross cross cross enter_sliding"
    # half swings about -0.4 and 0.4 by turns; some hundred steps at 1e-10
    assert run.events["t"][1:5] == close(math.pi * np.arange(1, 5), 1e-8)
    assert run.y[:, -1] == close([-0.2, 0], 1e-8)


@pytest.mark.parametrize("switch", ["v*(1 + x**2)", "v*exp(x)", "v/(1 + x**2)", "v + x**2*v"])
def test_h20_a_switching_function_may_be_a_product(switch):
    run = go(friction(switch), [3, 0], (0, 20))
    assert run.events["t"][1:5] == close(math.pi * np.arange(1, 5), 1e-7)


FLAT = ["cos(v) - 1", "v - sin(v)"]  # -v^2/2 and v^3/6


@each_method
@pytest.mark.parametrize("switch", FLAT)
def test_h21_a_surface_without_gradient_is_refused_with_the_point(method, switch):
    flat = sides(lambda t, s, p: (s.v, 1.0), lambda t, s, p: (s.v, -1.0), switch, "x v")
    run = go(flat, [0, -1], (0, 2), 1e-9, method)
    assert_failed(run, "degenerate_surface", "surface 0", "grad h")
    # h is rounding, and has no root that can be told, below v = 1e-5
    assert run.t[-1] == close(1, 1e-4)
    assert run.y[:, -1] == close([-0.5, 0], 1e-4)
    at_once = go(flat, [0, 0], (0, 2), 1e-9, method)
    assert_failed(at_once, "degenerate_surface", "At t = 0, x = (0, 0)")


def test_h21_a_called_function_without_gradient():
    flat = called(
        lambda t, s, p: (s.v, 1.0), lambda t, s, p: (s.v, -1.0), lambda t, s, p: s.v**3, "x v"
    )
    run = go(flat, [0, -1], (0, 2))
    assert_failed(run, "degenerate_surface", "grad h")
    assert run.t[-1] == close(1, 1e-4)


@each_method
def test_h21_a_start_where_two_branches_of_a_surface_cross(method):
    cross = sides(lambda t, s, p: (1.0, 0.0), lambda t, s, p: (2.0, 0.0), "x**2 - y**2")
    assert_failed(go(cross, [0, 0], (0, 1), 1e-9, method), "degenerate_surface", "surface 0")


def roof(t, s, p):
    return 2 * abs(s.x - 0.7) + s.y - 0.9


#: Where the path from (0, 0), of slope -1 above the roof and 0.3 below, meets it; and its end.
ROOF_MET = [1 / 6, (2.3 + 1 / 6 + 0.05) / 2.3]
ROOF_END = 0.9 - 2 * (ROOF_MET[1] - 0.7) - (2 - ROOF_MET[1])


@each_method
def test_h22_a_kink_of_h_away_from_its_roots(method):
    @fp.system(state="x y")
    def kinked(t, s):
        return 1.0, -0.35 - 0.65 * np.sign(roof(t, s, None))

    run = go(kinked, [0, 0], (0, 2), 1e-9, method)
    assert run.success
    # constant fields: some ulp. The kink at x = 0.7 is a surface of its own, and crossed
    assert times(run, "cross") == close([ROOF_MET[0], 0.7, ROOF_MET[1]], 1e-13)
    assert run.y[1, -1] == close(ROOF_END, 1e-13)


@each_method
def test_h22_a_called_function_with_a_kink(method):
    kinked = called(lambda t, s, p: (1.0, 0.3), lambda t, s, p: (1.0, -1.0), roof, "x y")
    run = go(kinked, [0, 0], (0, 2), 1e-9, method)
    assert run.success
    assert times(run, "cross") == close(ROOF_MET, 1e-12)
    assert run.y[1, -1] == close(ROOF_END, 1e-12)


@pytest.mark.parametrize("switch", [roof, "maximum(x, y) - 0.5", "abs(x) - 0.5"])
def test_h22_a_recorded_switching_function_with_a_kink_is_refused_with_the_reason(switch):
    with pytest.raises(fp.DefinitionError, match="surface 0 consists of several"):
        sides(lambda t, s, p: (1.0, 0.3), lambda t, s, p: (1.0, -1.0), switch)


@each_method
@pytest.mark.parametrize("slope", [0.5, 0.9, -0.9])
def test_h22_a_kink_at_the_root(method, slope):
    @fp.system(state="x")
    def gate(t, s):
        return 1.5 + 0.5 * np.sign(s.x - 0.5 + slope * abs(s.x - 0.5))

    run = go(gate, [0], (0, 1), 1e-9, method)
    assert times(run, "cross") == close([0.5], 1e-13)
    assert run.y[0, -1] == close(1.5, 1e-13)


@each_method
@pytest.mark.parametrize("width", [0.05, 0.01, 2e-3, 1e-6])
def test_h22_a_narrow_peak_of_h_is_passed(method, width):
    @fp.system(state="x", surfaces={"middle": "x - 0.5"})
    def peak(t, s):
        return 1.5 + 0.5 * np.sign(width - abs(s.x - 0.5))

    run = go(peak, [0], (0, 0.9), 1e-9, method)
    assert run.success
    assert times(run, "cross") == close([0.5 - width, 0.5 - width / 2, 0.5], 1e-13)
    assert run.y[0, -1] == close(0.9 + width, 1e-13)


@each_method
@pytest.mark.parametrize("at", [1.0, 0.3, 1.7320508])
def test_h22_a_jump_of_h_in_time_is_an_event_at_the_jump(method, at):
    def ahead(t, s, p):
        return s.x - 1 if t < at else s.x + 1

    @fp.system(state="x")
    def recorded(t, s):
        return -0.1 * np.sign(np.where(t < at, s.x - 1, s.x + 1))

    both = (recorded, called(lambda t, s, p: 0.1, lambda t, s, p: -0.1, ahead))
    for system in both:
        run = go(system, [0], (0, 2), 1e-9, method)
        assert run.success
        assert times(run, "cross") == close([at], 1e-13)
        # not moved onto a surface that is not there
        assert run.events["x_right"][1, 0] == close(0.1 * at, 1e-14)
        assert run.y[0, -1] == close(0.1 * at - 0.1 * (2 - at), 1e-14)


@each_method
def test_h22_h_of_infinite_slope(method):
    def root(t, s, p):
        return math.copysign(math.sqrt(abs(s.x - 0.5)), s.x - 0.5)

    run = go(called(lambda t, s, p: 1.0, lambda t, s, p: 2.0, root), [0], (0, 1), 1e-9, method)
    assert run.success
    assert times(run, "cross") == close([0.5], 1e-9)  # the landing is as good as the tolerance
    assert run.y[0, -1] == close(1.5, 1e-9)


# --- H23 to H25: not finite -----------------------------------------------------------------------

# system, start, and where its square root ends: time and state
ROOT = math.sqrt(0.5)
NOT_FINITE = {
    "f1": (
        sides(lambda t, s, p: 1 + np.sqrt(0.5 - t), lambda t, s, p: 1.0, "x - 10", "x"),
        [0],
        0.5,
        0.5 + 2 / 3 * ROOT**3,
    ),
    "f2": (
        sides(lambda t, s, p: 2.0, lambda t, s, p: 1 + np.sqrt(0.5 - s.x), "x + 10", "x"),
        [0],
        2 * (ROOT - math.log(1 + ROOT)),
        0.5,
    ),
    "h": (line("x - 300 + sqrt(20 - t)"), [0], 20, 20),
    "sliding field": (
        sides(lambda t, s, p: (1 + np.sqrt(0.5 - t), 1.0), lambda t, s, p: (1.0, -1.0), "y"),
        [0, 0],
        0.5,
        0.5 + 1 / 3 * ROOT**3,
    ),
}


@each_method
@pytest.mark.parametrize("what", NOT_FINITE)
def test_h23_nan_is_reported_with_function_time_and_state(method, what):
    system, start, t_bad, x_bad = NOT_FINITE[what]
    run = go(system, start, (0, 30), 1e-9, method)
    assert_failed(run, "not_finite", f": {what}.")
    # the last good state: steps shrink towards a root's end, with the error of the last of them
    assert run.t[-1] == close(t_bad, 1e-6)
    assert run.y[0, -1] == close(x_bad, 1e-6)


@each_method
def test_h23_at_the_start(method):
    log = sides(lambda t, s, p: np.log(s.x), lambda t, s, p: 1.0, "x - 10", "x")
    run = go(log, [0], (0, 2), 1e-9, method)
    assert_failed(run, "not_finite", "At t = 0, x = (0)", "f1")
    assert run.stats.steps == 0


@each_method
def test_h23_the_other_side_at_contact(method):
    gate = sides(lambda t, s, p: 1.0, lambda t, s, p: np.sqrt(s.x - 1), "x - 0.5", "x")
    run = go(gate, [0], (0, 2), 1e-9, method)
    assert_failed(run, "not_finite", "surface 0: f2")
    assert (run.t[-1], run.y[0, -1]) == close((0.5, 0.5), 1e-13)  # landed to some ulp


def ends_in(bad):
    """Of a unit speed that is `bad` after t = 0.5 (definitions are tried at later times, too)."""

    def speed(t, s, p):
        return bad if 0.5 < t < 3 else 1.0

    return called(speed, lambda t, s, p: 2.0, "x - 10")


@each_method
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_h23_a_called_function_that_is_not_finite(method, bad):
    run = go(ends_in(bad), [0.1], (0, 2), 1e-9, method)
    assert_failed(run, "not_finite")
    # derivatives by time, of rodas5p, are differences that look a thousandth ahead
    assert run.t[-1] == close(0.5, 1e-9 if method in EXPLICIT else 1e-3)
    assert run.y[0, -1] == close(0.1 + run.t[-1], 1e-13)


@explicit
def test_h23_a_called_function_that_is_not_finite_is_named(method):
    assert_failed(go(ends_in(math.inf), [0.1], (0, 2), 1e-9, method), "not_finite", ": f1.")


@pytest.mark.xfail(
    strict=True, reason="rodas5p says 'a stage of the step', where it is a derivative of f1"
)
def test_h23_a_called_function_that_is_not_finite_is_named_by_rodas5p():
    assert_failed(go(ends_in(math.inf), [0.1], (0, 2), 1e-9, "rodas5p"), "not_finite", ": f1.")


@pytest.mark.parametrize("switch", ["sqrt(x) - 0.5", "log(x) - log(0.25)"])
def test_h23_a_switching_function_need_not_exist_everywhere(switch):
    run = go(line(switch), [0.1], (0, 1))
    assert times(run, "cross") == close([0.15], 1e-13)


@each_method
@pytest.mark.parametrize("tol", [1e-6, 1e-9, 1e-12])
def test_h24_a_blow_up_ends_near_its_time_with_a_good_state(method, tol):
    square = sides(lambda t, s, p: s.x**2, lambda t, s, p: 2.0, "-1 - x", "x")
    run = go(square, [1], (0, 2), tol, method)
    assert_failed(run, "step_too_small", "blow up", "mode (-1)")
    assert run.t[-1] == close(1, 10 * tol)  # x = 1/(1 - t), off by the errors of its first steps
    assert 1e9 < run.y[0, -1] < math.inf


@explicit
def test_h24_a_blow_up_in_an_ensemble_ends_alike(method):
    square = sides(lambda t, s, p: s.x**2, lambda t, s, p: 2.0, "-1 - x", "x")
    ends = fp.ensemble(square, [[1.0]], (0, 2), rtol=1e-9, atol=1e-9, method=method)
    assert ends.status[0] == "step_too_small"


@each_method
@pytest.mark.parametrize("start", [-1.0, 1.0])
@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9])
def test_h25_fields_that_end_at_the_surface_are_followed_to_it(method, start, tol):
    funnel = sides(lambda t, s, p: 1 + np.sqrt(-s.x), lambda t, s, p: -1 - np.sqrt(s.x), "x", "x")
    run = go(funnel, [start], (0, 2), tol, method)
    assert run.success
    # u = sqrt|x|: 2 u u' = -1 - u. Its derivatives grow without bound: ten errors of a step
    assert times(run, "enter_sliding") == close([2 * (1 - math.log(2))], 10 * tol)
    assert (run.y[0, -1], run.mode[-1]) == (0, 0)


@each_method
def test_h25_the_other_side_is_not_asked_before_contact(method):
    asked = []

    def above(t, s, p):
        asked.append((float(t), float(s.y)))
        return 1.0, -1.0

    block = called(lambda t, s, p: (1.0, 0.5 - s.x), above, "y", "x y")
    asked.clear()
    # y = (x - x^2)/2 - 3/8 from x = -1: contact at -0.5, a slide until 0.5
    run = go(block, [-1, 0.375 - 1], (0, 2), 1e-9, method)
    assert run.success
    assert run.events["t"][1:3] == close([0.5, 1.5], 1e-8)
    # the start counts, where no side is left out, and differences look a thousandth aside
    assert min(t for t, y in asked) > 0.5 - 2.1e-3
    assert max(abs(y) for t, y in asked) < 2.1e-3


# --- H26, H27: scales and long runs ---------------------------------------------------------------


def belt(unit_x=1.0, unit_v=1.0, unit_t=1.0):
    """P3, a block on a belt of varying speed, in units of its state and time."""

    @fp.system(state="x v")
    def block(t, s):
        x, v, t = unit_x * s.x, unit_v * s.v, unit_t * t
        push = -x - 0.4 * v + np.cos(0.7 * t) - 0.4 * np.sign(v - np.cos(t) - 0.7)
        return v * (unit_t / unit_x), push * (unit_t / unit_v)

    return block


#: Events of P3 from (3, 0) until t = 30, by a program of high accuracy.
BELT_EVENTS = [
    7.6055699647,
    9.4833785789,
    9.7652587545,
    14.8051056891,
    17.4589396439,
    26.1316818246,
    27.2911568935,
]


@each_method
@pytest.mark.parametrize(
    "units", [(1e9, 1e-9, 1), (1e-9, 1e9, 1), (1, 1, 1e-6), (1e9, 1e9, 1e-6), (1, 1, 1e-12)]
)
def test_h26_other_units_of_state_and_time_give_the_same_events(method, units):
    x, v, t = units
    run = go(belt(*units), [3 / x, 0], (0, 30 / t), 1e-10, method, atol=[1e-10 / x, 1e-10 / v])
    assert run.success
    # some hundred steps, each with an error of 1e-10
    assert run.events["t"][1:-1] * t == close(BELT_EVENTS, 1e-8)


@pytest.mark.parametrize("unit", [1e9, 1e12])
def test_h26_a_fast_time_can_be_defined(unit):
    run = go(belt(1, 1, unit), [3, 0], (0, 30 / unit), 1e-10)
    assert run.events["t"][1:-1] * unit == close(BELT_EVENTS, 1e-8)


@each_method
def test_h27_ten_thousand_periods_repeat_to_the_digit(method):
    block = fp.models.oscillator
    end = 10_000 * block.period()
    run = go(block, [0, 0], (0, end), 1e-9, method, max_steps=10**7, max_events=10**5, t_eval=[])
    assert run.success
    met = run.events[1:-1]
    assert (met["x_right"][:, 1] == 1).all()  # v = V on every contact
    exits = met[(met["kind"] == "exit_sliding") & (met["period"] >= 1000)]
    assert exits.size == 2250
    assert (np.diff(exits["period"]) == 4).all()
    # every fourth period alike: time is kept within a period, where an ulp is 4e-16
    assert np.ptp(exits["t_local"]) < 1e-13
    assert np.ptp(exits["x_right"][:, 0]) < 1e-13


@each_method
def test_h27_without_a_period_the_error_grows_no_faster_than_linearly(method):
    @fp.system(state="x")
    def swing(t, s):  # sin t while x < 0.5, and twice the amplitude above
        return np.cos(t) * (1.5 + 0.5 * np.sign(s.x - 0.5))

    run = go(swing, [0], (0, 1000 * math.pi), 1e-10, method, max_steps=10**6, dense_output=False)
    turn = np.arange(500)[:, None] * 2 * math.pi
    exact = (turn + np.array([math.pi / 6, 5 * math.pi / 6])).ravel()
    late = np.array(times(run, "cross")) - exact
    # some ten steps an event, each with an error of 1e-10
    assert np.abs(late / np.arange(1, 1001)).max() < 1e-9


# --- H29 to H32: jumps, short visits --------------------------------------------------------------


@explicit
def test_h29_an_event_inside_a_rejected_step_is_ignored(method):
    # x = e^-50t stays above -0.5; an explicit step of 1 lands far below it
    decay = sides(lambda t, s, p: -49 * s.x, lambda t, s, p: -50 * s.x, "x + 0.5", "x")
    run = go(decay, [1], (0, 1), 1e-6, method, first_step=1)
    assert run.success
    assert run.stats.rejected > 0
    assert word(run) == ""
    assert run.y[0, -1] == close(0, 1e-5)


def thrown(floor, wall=lambda t, s, p: (s.x, -0.5 * s.v)):
    """Falls from 0.5, in one unit of time, onto a floor that does `floor`; a wall is at 2."""

    @fp.system(state="x v", jumps={"floor": ("x", floor), "wall": ("2 - x", wall)})
    def point(t, s):
        return s.v, -1.0

    return point


@each_method
def test_h30_a_jump_onto_another_surface_is_judged_again(method):
    run = go(thrown(lambda t, s, p: (2.0, 1.0)), [0.5, 0], (0, 1.5), 1e-9, method)
    assert run.success
    assert word(run) == "jump jump"
    assert run.events["surface"][1:3].tolist() == [0, 1]
    assert run.events["t"][1] == run.events["t"][2] == close(1, 1e-13)
    assert run.events["x_right"][2].tolist() == [2, -0.5]
    assert run.y[0, -1] == close(2 - 0.5 / 2 - 0.5**2 / 2, 1e-12)


@each_method
def test_h30_jumps_to_and_fro_end_as_a_cascade(method):
    to_and_fro = thrown(lambda t, s, p: (2.0, 1.0), lambda t, s, p: (0.0, -1.0))
    run = go(to_and_fro, [0.5, 0], (0, 1.5), 1e-9, method)
    assert_failed(run, "jump_cascade", "surface")
    assert run.t[-1] == close(1, 1e-13)
    assert run.stats.events <= 101


NOWHERE = {
    "the jump leads beyond its surface": ("escaped", lambda t, s, p: (-1.0, s.v)),
    "jump": ("not_finite", lambda t, s, p: (np.log(-1 - s.x**2), s.v)),
    "the jump here changes nothing": ("jump_cascade", lambda t, s, p: (s.x, s.v)),
}


@each_method
@pytest.mark.parametrize("reason", NOWHERE)
def test_h30_a_jump_that_leads_nowhere_has_its_reason(method, reason):
    status, floor = NOWHERE[reason]
    run = go(thrown(floor), [0.5, 0], (0, 3), 1e-9, method)
    assert_failed(run, status, "surface 0", f": {reason}.")
    # the state before it, with some ulp of its flight
    assert (run.t[-1], *run.y[:, -1]) == close((1, 0, -1), 1e-13)


def test_h30_a_start_beyond_a_surface_with_jumps_has_no_meaning():
    run = go(thrown(lambda t, s, p: (s.x, -s.v)), [-0.5, 0], (0, 3))
    assert_failed(run, "escaped", "At t = 0, x = (-0.5, 0)", "surface 0")


@each_method
def test_h30_a_reset_while_sliding(method):
    @fp.system(state="x y", jumps={"reset": ("1 - x", lambda t, s, p: (0.0, s.y))})
    def sawtooth(t, s):  # held on y = 0 with s = 0.2
        return 1 - 0.3 * np.sign(s.y), 0.2 - np.sign(s.y)

    run = go(sawtooth, [0, 0], (0, 5), 1e-9, method)
    assert run.success
    assert times(run, "jump") == close(np.arange(1, 5) / 0.94, 1e-12)
    assert run.y[:, -1] == close([5 * 0.94 - 4, 0], 1e-9)
    assert run.mode[:, -1].tolist() == [0, 1]


@each_method
@pytest.mark.parametrize("speed", [0.0, 1e-18, -1e-18])
def test_h31_contact_with_no_normal_speed_is_rest(method, speed):
    run = go(ball(0.9), [0, speed], (0, 1), 1e-9, method)
    assert run.success
    assert run.events.size < 100
    assert (run.y[0, -1], run.y[1, -1], run.mode[-1]) == (0, 0, 0)
    assert speed or (word(run) == "" and run.events["mode_after"][0] == 0)


@each_method
def test_h31_contact_lets_go_where_its_force_vanishes_and_comes_back(method):
    @fp.system(state="x v", jumps={"table": ("x", lambda t, s, p: (s.x, -0.25 * s.v))})
    def shaken(t, s):
        return s.v, -1 + 2 * np.sin(t)

    run = go(shaken, [0, 0], (0, 9), 1e-11, method)
    assert run.success
    assert run.events["mode_after"][0] == 0
    lets_go = math.pi / 6  # 2 sin t = 1, located to rounding
    assert times(run, "exit_sliding") == close([lets_go, lets_go + 2 * math.pi], 1e-12)
    assert len(times(run, "accumulation")) == 1
    first = run.events[2]
    t = first["t"]
    u = t - lets_go
    flight = -(u**2) / 2 - 2 * (math.sin(t) - 0.5) + 2 * u * math.cos(lets_go)
    assert (first["kind"], flight) == ("jump", close(0, 1e-10))
    assert first["x_right"][1] == pytest.approx(-0.25 * first["x_left"][1], rel=1e-15)


@each_method
@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_h32_a_slide_is_kept_if_its_ends_differ(method, tol):
    block = strip(minus, down)  # contact at x = -d, exit at x = 0
    for d in 10.0 ** np.arange(-16.5, -3, 0.5):
        run = go(block, [-1 - d, 1], (0, 2), tol, method)
        assert run.success
        assert word(run) in ("cross", "enter_sliding exit_sliding")
        assert d < 1e-12 or word(run) == "enter_sliding exit_sliding"
        if word(run) != "cross":
            enter, leave = run.events["t"][1:3]
            assert leave > enter
            assert leave - enter == close(d, 4 * EPS)
        assert run.y[1, -1] == close(-0.5 * (1 - d) ** 2, 1e-9)


@each_method
def test_h32_a_slip_is_kept_if_its_ends_differ(method):
    block = strip(plus, down)  # crosses at x = -d, and is back at x = d
    for d in 10.0 ** np.arange(-16.5, -3, 0.5):
        run = go(block, [-1 - d, 1], (0, 2), 1e-9, method)
        assert run.success
        assert word(run) in ("enter_sliding", "cross enter_sliding")
        # its depth, d^2/2, is rounding of h below
        assert d < 1e-6 or word(run) == "cross enter_sliding"


# --- H33, H34: stiff, and at the floor ------------------------------------------------------------


def stiff(level, rate=1000.0):
    """Follows cos t; its path meets 0 at pi - arctan(rate)."""

    def below(t, s, p):
        return -rate * (s.x - np.cos(t))

    # the sides differ by less than any tolerance, for otherwise there were no surface
    return sides(below, lambda t, s, p: below(t, s, p) + 1e-9, lambda t, s, p: s.x - level, "x")


@each_method
def test_h33_a_surface_does_not_limit_the_steps_of_a_stiff_field(method):
    def steps(level):
        run = go(stiff(level), [1], (0, 3), 1e-6, method)
        assert run.success
        assert times(run, "cross") == close([math.pi - math.atan(1000)] * (level == 0), 1e-5)
        return run.stats.steps + run.stats.rejected

    far = steps(-10)
    assert far < (2000 if method in EXPLICIT else 40)  # a thousandth each, by their stability
    assert steps(0) < 1.05 * far + 10  # some steps for the landing
    assert steps(-1 - 1e-9) < 1.05 * far + 10


@each_method
def test_h33_a_stiff_slide_takes_the_steps_of_its_flow_alone(method):
    def pushed(push):
        return lambda t, s, p: (-1000 * (s.x - np.cos(t)), push)

    held = go(sides(pushed(1.0), pushed(-1.0), "y"), [1, 0], (0, 3), 1e-6, method)
    free = go(sides(pushed(0.0), pushed(1.0), "y - 10"), [1, 0], (0, 3), 1e-6, method)
    assert (held.mode == 0).all()
    assert held.stats.steps < 1.05 * free.stats.steps + 10
    assert held.y[0, -1] == close(free.y[0, -1], 1e-5)  # ten tolerances


@each_method
@pytest.mark.parametrize("rate", [1e3, 1e5])
def test_h33_a_slide_is_not_stiff_where_only_the_sides_are(method, rate):
    @fp.system(state="x", params={"rate": rate})
    def relay(t, s, p):
        return -p.rate * (s.x - np.cos(t)) * np.sign(s.x)

    hit = go(relay, [1], (0, 1.6), 1e-6, method)
    run = go(relay, [1], (0, 4), 1e-6, method)
    assert run.success
    assert word(run) == "enter_sliding"
    assert run.events["t"][1] == close(math.pi - math.atan(rate), 1e-5)  # ten tolerances
    assert run.y[0, -1] == 0
    assert run.stats.steps - hit.stats.steps < 50


@each_method
@pytest.mark.parametrize("tol", [1e-13, 1e-14, 1e-15, 1e-16])
def test_h34_tolerances_at_the_floor_end_in_a_result(method, tol):
    run = go(belt(), [3, 0], (0, 30), tol, method)
    if tol < 1e-14 and not run.success:
        assert_failed(run, "step_too_small", "tolerance is below rounding")
        return
    assert run.success
    assert run.events["t"][1:-1] == close(BELT_EVENTS, 1e-10)  # their last digit


# --- H35: backward time ---------------------------------------------------------------------------


@each_method
def test_h35_backward_time_undoes_crossings(method):
    @fp.system(state="x v")
    def pendulum(t, s):  # a stiffer spring on the right, and a constant push
        return s.v, -np.where(s.x > 0, 4 * s.x + 0.5, s.x)

    assert pendulum.kinds == ("switching",)
    there = go(pendulum, [-1, 0], (0, 20), 1e-11, method)
    back = go(pendulum, there.y[:, -1], (20, 0), 1e-11, method)
    assert back.success
    assert word(back) == word(there) == " ".join(["cross"] * there.events[1:-1].size)
    assert there.events["t"][1] == close(math.pi / 2, 1e-9)
    # some hundred steps forth and back, each with an error of 1e-11
    assert back.events["t"][1:-1] == close(there.events["t"][-2:0:-1], 1e-8)
    assert back.y[:, -1] == close([-1, 0], 1e-8)


@each_method
def test_h35_backward_from_a_slide_is_ambiguous(method):
    run = go(strip(up, down), [0, 0], (0, -1), 1e-9, method)
    assert_failed(run, "ambiguous", "At t = 0,", "surface 0", "repulsive")
    # what repels attracts
    run = go(strip(down, up), [0, -0.5], (0, -1), 1e-9, method)
    assert run.success
    assert times(run, "enter_sliding") == close([-0.5], 1e-13)
    assert run.y[0, -1] == close(-1, 1e-13)


# --- H36, H37: derivatives ------------------------------------------------------------------------


@fp.system(state="x v", params={"w": 0.5}, period=lambda p: 2 * np.pi / p.w)
def one_block(t, s, p):
    return s.v, -s.x + np.sin(p.w * t) - 0.4 * np.sign(s.v)


@fp.system(state="x1 v1 x2 v2", params={"w": 0.5}, period=lambda p: 2 * np.pi / p.w)
def two_blocks(t, s, p):
    pull = 0.05 * (s.x2 - s.x1)
    return (
        s.v1,
        -s.x1 + np.sin(p.w * t) - 0.4 * np.sign(s.v1) + pull,
        s.v2,
        -s.x2 + np.sin(p.w * t + 0.3) - 0.4 * np.sign(s.v2) - pull,
    )


@pytest.mark.parametrize(("blocks", "held"), [(one_block, 1), (two_blocks, 2)])
def test_h36_each_surface_slid_on_takes_a_multiplier(blocks, held):
    orbit = fp.periodic_orbit(blocks)
    assert orbit.success
    modes = orbit.word.split() if held == 2 else list(orbit.word)
    assert "0" * held in modes  # all blocks stick at once
    sizes = np.sort(np.abs(orbit.multipliers))
    assert (sizes[:held] == 0).all()
    assert (sizes[held:] > 0.1).all()
    # differentiated through all events, not through the word; rank by its singular values
    assert (np.linalg.svd(orbit.monodromy)[1][-held:] < 1e-14).all()
    exponents = fp.lyapunov(blocks, transient=50, window=20)
    assert (exponents.exponents[-held:] == -math.inf).all()
    rates = np.log(sizes[: held - 1 : -1]) / orbit.period
    assert exponents.exponents[:-held] == close(rates, 1e-6)  # 50 periods shrink 1e-6 off the orbit
    assert exponents.slides == 20 * sum("0" in mode for mode in modes)  # stretches that slide


def test_h37_the_derivative_at_a_touch_is_singular():
    @fp.system(state="x v", period=3.0)
    def turn(t, s):  # a circle below the line x = 1, as in H1
        return np.where(s.x > 1, -1.0, s.v), np.where(s.x > 1, 0.0, -s.x)

    touching = fp.strobe_map(turn, [0, 1])
    assert touching.success
    assert touching.singular
    assert np.isnan(touching.slope).all()
    assert touching.x == close([math.sin(3), math.cos(3)], 1e-10)
    beside = fp.strobe_map(turn, [0, 0.9])
    assert not beside.singular
    c, s = math.cos(3), math.sin(3)
    assert beside.slope[:2, :2] == close(np.array([[c, s], [-s, c]]), 1e-10)


# --- H38: static friction -------------------------------------------------------------------------


def test_h38_another_value_at_rest_is_refused_with_the_reason():
    with pytest.raises(fp.DefinitionError, match="at one value for no time"):

        @fp.system(state="x v")
        def sticks(t, s):
            return s.v, -s.x - np.where(s.v == 0, 0.4, 0.3 * np.sign(s.v))


@each_method
@pytest.mark.parametrize("tol", [1e-6, 1e-9, 1e-12])
def test_h38_the_named_model_slips_in_closed_form(method, tol):
    # weight 10, mu_0 = 0.3, mu_s = 0.4: sticks until y = 4, slips as y - 3 = cos + sin for 3 pi/2,
    # and sticks again at y = 2
    run = go(fp.models.stiction, [0, 1], (0, 30), tol, method, params={"A": 0})
    assert run.success
    starts = 4 + (2 + 1.5 * math.pi) * np.arange(4)
    # four slips of some steps, each with an error of tol
    assert times(run, "exit_sliding") == close(starts, 100 * tol)
    assert times(run, "enter_sliding") == close(starts + 1.5 * math.pi, 100 * tol)
    assert run.events["x_right"][1:3, 0] == close([4, 2], 100 * tol)


@each_method
def test_h38_between_kinetic_and_static_friction_a_stick_is_kept(method):
    for y, mode in ((-4.1, 1), (-3.9, 0), (-3, 0), (0, 0), (3.5, 0), (3.999999, 0), (4.1, -1)):
        run = go(fp.models.stiction, [y, 1], (0, 1e-8), 1e-9, method, params={"A": 0})
        assert run.success
        assert run.events["mode_after"][0] == mode


# --- H39: plain equations -------------------------------------------------------------------------


@each_method
def test_h39_with_no_surface_reached_it_is_an_ordinary_equation(method):
    decay = sides(lambda t, s, p: 1.0, lambda t, s, p: -s.x, "x + 1", "x")
    run = go(decay, [1], (0, 5), 1e-10, method)
    assert run.success
    assert word(run) == ""
    assert run.stats.landings == 0
    assert run.y[0, -1] == close(math.exp(-5), 1e-9)  # ten tolerances


@each_method
@pytest.mark.parametrize("t", [0.0, 1.0, -7.5, 1e300])
def test_h39_no_time_at_all(method, t):
    for start in (2.0, 3.0):  # beside and on the surface
        run = go(line("x - 3"), [start], (t, t), 1e-9, method)
        assert run.success
        assert word(run) == ""
        assert (run.t.tolist(), run.y.tolist(), run.stats.steps) == ([t], [[start]], 0)


#: Start, length, x at the start.
SPANS = [
    (0, 1e-300, 0),
    (1, EPS, 0),
    (1e9, 1e-7, 0),
    (1e9, 1, 0),
    (1e15, 4, 0),
    (0, 1e12, 0),
    (0, 1e300, 0),
    (-1e15, 2e15, 0),
    (0, 1e-10, 0.5 - 5e-11),
]


@each_method
@pytest.mark.parametrize(("t0", "length", "start"), SPANS)
def test_h39_spans_of_an_ulp_and_of_any_length(method, t0, length, start):
    run = go(line("x - 0.5"), [start], (t0, t0 + length), 1e-9, method)
    assert run.success
    assert run.t[-1] == t0 + length
    length = t0 + length - t0  # as it is in floating point
    crosses = start + length > 0.5
    assert word(run) == ("cross" if crosses else "")
    end = 0.5 + 2 * (length - (0.5 - start)) if crosses else start + length
    assert run.y[0, -1] == pytest.approx(end, rel=1e-13, abs=0)  # some steps, an ulp each


@each_method
def test_h39_a_span_of_the_smallest_number(method):
    run = go(line("x - 0.5"), [0], (0, 5e-324), 1e-9, method)
    assert run.success
    assert run.t[-1] == 5e-324


@each_method
def test_h39_as_many_components_as_there_may_be(method):
    rates = 0.1 * np.arange(1, 33)

    @fp.system(state=[f"x{k}" for k in range(32)])
    def decay(t, s):  # the first one twice as fast once the last one is below a half
        faster = np.where(s.x31 < 0.5, 2.0, 1.0)
        return tuple(
            -rate * x * (faster if k == 0 else 1)
            for k, (rate, x) in enumerate(zip(rates, s, strict=True))
        )

    run = go(decay, np.ones(32), (0, 2), 1e-10, method)
    assert run.success
    half = math.log(2) / 3.2
    assert times(run, "cross") == close([half], 1e-9)  # ten tolerances
    assert run.y[1:, -1] == close(np.exp(-2 * rates[1:]), 1e-9)
    assert run.y[0, -1] == close(math.exp(-0.1 * half - 0.2 * (2 - half)), 1e-9)


def test_h39_too_many_components_are_refused():
    with pytest.raises(ValueError, match="expected 1 to 32 names"):
        fp.system(state=[f"x{k}" for k in range(50)])(lambda t, s: tuple(-x for x in s))


# --- H40, H42: short visits, stages beyond --------------------------------------------------------


@each_method
@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_h40_an_excursion_from_a_slide_is_two_events_or_none(method, tol):
    for a in 10.0 ** np.arange(-16, -1.9, 0.5):
        # leaves at x = -a, comes back at x = 2 a: y = (x + a)^2 (x - 2 a)/3
        run = go(strip(lambda x, a=a: (x - a) * (x + a), down), [-1, 0], (0, 2), tol, method)
        assert run.success
        assert word(run) in ("", "slide_extremum", "exit_sliding enter_sliding")
        assert a**2 <= 100 * tol or a <= 1e-4 or word(run) == "exit_sliding enter_sliding"
        if word(run) == "exit_sliding enter_sliding":
            # L1 is rounding within eps/a; y' = 3 a^2 where it comes back
            assert run.events["t"][1] == close(1 - a, 1e-13 + EPS / a)
            assert run.events["t"][2] == close(1 + 2 * a, 1e-13 + 10 * (EPS + tol) / a**2)
        assert run.y[:, -1] == close([1, 0], 1e-12)
        assert run.mode[-1] == 0


@each_method
@pytest.mark.parametrize("tol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_h40_a_crossing_a_hair_outside_the_sliding_region(method, tol):
    block = strip(plus, down)  # contact at x = -d is a crossing, the visit below ends at x = d
    for d in 10.0 ** np.arange(-17, -1.9, 0.5):
        run = go(block, [-1 - d, 1], (0, 2), tol, method)
        assert run.success
        assert word(run) in ("enter_sliding", "cross enter_sliding")
        assert d < 1e-6 or word(run) == "cross enter_sliding"  # its depth is d^2/2
        if d > 1e-6:
            assert run.events["t"][1:3] == close([1, 1 + 2 * d], 1e-13 + EPS / d)
        assert run.y[:, -1] == close([1 - d, 0], 1e-12)


NEAR = pytest.mark.xfail(strict=True, reason="derivatives of rodas5p are differences over the wall")


@pytest.mark.parametrize(
    ("method", "wall"),
    [
        *((method, wall) for method in EXPLICIT for wall in (0.5, 0.1, 1e-3, 1e-8, 0.0)),
        *(("rodas5p", wall) for wall in (0.5, 0.1)),
        *(pytest.param("rodas5p", wall, marks=NEAR) for wall in (1e-3, 1e-8, 0.0)),
    ],
)
def test_h42_a_stage_beyond_the_surface_that_is_nan_cuts_the_step(method, wall):
    slow = called(lambda t, s, p: math.nan if s.x > wall else 1.0, lambda t, s, p: 2.0, "x")
    for first in (0.01, 0.3, 1.0, 2.0, 10.0):
        run = go(slow, [-1], (0, 2), 1e-9, method, first_step=first)
        assert run.success
        assert times(run, "cross") == close([1], 1e-13)
        assert run.y[0, -1] == close(2, 1e-13)


@each_method
@pytest.mark.parametrize("first", [0.3, 1.0, 3.0])
def test_h42_a_step_over_the_pole_beyond_the_belt_is_cut(method, first):
    # the oscillator's friction below v = 1 has its pole at v = 1.704
    block = fp.models.oscillator
    for y in np.linspace(-4, 4, 9):
        for v in np.linspace(-2, 3, 7):
            rough = go(block, [y, v], (0, 4), 1e-3, method, first_step=first)
            assert rough.success
            fine = go(block, [y, v], (0, 4), 1e-10, "dop853")
            # a step across the pole would throw it off by far more
            assert np.linalg.norm(rough.y[:, -1] - fine.y[:, -1]) < 0.3


# --- H43: a repelling intersection ----------------------------------------------------------------


@each_method
def test_h43_a_repelling_intersection_is_ambiguous_and_never_a_silent_rest(method):
    run = go(signs(1), [0, 0], (0, 1), 1e-9, method)
    assert_failed(run, "ambiguous", "At t = 0, x = (0, 0)", "not shown to attract")
    stay = go(signs(1), [0, 0], (0, 1), 1e-9, method, on_nonunique="stay")
    assert stay.success
    assert stay.y[:, -1].tolist() == [0, 0]
    assert stay.choices["t"].tolist() == [0]


@each_method
def test_h43_beside_it_solutions_spiral_away(method):
    run = go(signs(1), [0, 1e-6], (0, 0.5), 1e-9, method)
    assert run.success
    assert times(run, "accumulation") == []
    # |x| + |y| grows at the rate 2 in every quadrant
    assert np.abs(run.y[:, -1]).sum() == close(1 + 1e-6, 1e-12)


@each_method
def test_h43_backwards_in_time_what_repels_attracts(method):
    back = go(signs(1), [0, 0], (0, -1), 1e-9, method)
    assert back.success
    assert back.y[:, -1].tolist() == [0, 0]
    assert go(signs(-1), [0, 0], (0, -1), 1e-9, method).status == "ambiguous"


def test_h43_the_message_has_the_mode_of_each_surface():
    assert_failed(go(signs(1), [0, 0], (0, 1)), "ambiguous", "mode (1, 1), surface 0")
