# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases of finding an event and landing on it: H1-H4, H21-H25, H29, H40, H42.

Systems are typed as a user would type them.

Elsewhere: H28 in test_event.py (TestH28).
"""

import math
from collections import Counter

import numpy as np
import pytest

import filippov as fp
from hard import (
    EPS,
    EXPLICIT,
    assert_failed,
    called,
    close,
    down,
    each_method,
    explicit,
    go,
    line,
    plus,
    sides,
    strip,
    times,
    word,
)

# --- H1 -------------------------------------------------------------------------------------------


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
    assert (touch["contacts"], touch["alternatives"]) == (0b1, 0)
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


# --- H2 -------------------------------------------------------------------------------------------


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


# --- H3 -------------------------------------------------------------------------------------------


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


# --- H4 -------------------------------------------------------------------------------------------


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
@pytest.mark.parametrize(("w", "a", "c"), [(4, 3, 15), (11, 1, 10), (30, 2, 20)])
def test_h4_a_surface_that_swings_above_a_constant_field(method, w, a, c):
    @fp.system(state="x")
    def beneath(t, s, p):
        return (-1 - 2 * np.sign(s.x - c - a * np.cos(w * t)),)

    t = np.linspace(0, 2 * c, 2_000_001)
    first = t[np.argmax(t - c - a * np.cos(w * t) > 0)]
    run = fp.simulate(beneath, [0], (0, 2 * c), method=method)
    assert run.events["t"][1] == close(first, 1e-4)


@each_method
@pytest.mark.parametrize("w", [5, 10, 50])
def test_h4_a_section_that_swings_above_a_constant_field(method, w):
    line = fp.system(state="x")(lambda t, s, p: (1.5 + 0 * s.x,))
    run = fp.simulate(line, [0], (0, 10), method=method, events=lambda t, y: np.cos(w * t))
    assert len(run.t_events[0]) == int(w * 10 / np.pi + 0.5)


@each_method
@pytest.mark.parametrize("d", [0.2, 0.05, 0.01])
def test_h4_three_roots_close_to_each_other(method, d):
    near = line(lambda t, s, p: (s.x - 0.5) ** 3 - d**2 * (s.x - 0.5))
    run = go(near, [0], (0, 1), 1e-9, method)
    assert word(run) == "cross cross cross"
    wanted = [0.5 - d, 0.5 - d / 2, 0.5 + d / 2]
    # h is flat: its rounding over its slope 2 d^2
    assert run.events["t"][1:4] == close(wanted, 1e-14 + 8 * EPS * 0.25 / d**2)


# --- H21 ------------------------------------------------------------------------------------------

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


# --- H22 ------------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("tol", [1e-4, 1e-8])
@pytest.mark.parametrize("declared", [False, True])
def test_h22_a_sawtooth_of_time_is_nowhere_stepped_over(method, tol, declared):
    # its slope is the same everywhere, but it is not linear
    T, a, n = 0.2, 0.2, 20
    for duty in (0.75, 0.25, 0.03, 0.97):

        @fp.system(state="x", period=T if declared else None)
        def pwm(t, s, p):
            ramp = np.arctan(np.tan(np.pi * t / T - np.pi / 2)) / np.pi + 0.5
            return (np.where(ramp < duty, 1, 0) - a * s.x,)  # noqa: B023

        x = 0.0
        for _ in range(n):
            x = (1 / a + (x - 1 / a) * np.exp(-a * duty * T)) * np.exp(-a * (1 - duty) * T)
        run = go(pwm, [0], (0, (n - 1e-3) * T), tol, method)
        assert run.success
        assert times(run, "cross") == close(
            sorted([(k + duty) * T for k in range(n)] + [k * T for k in range(1, n)]), 1e-9
        )
        assert run.y[0, -1] == close(x * np.exp(a * 1e-3 * T), 20 * tol)


@each_method
def test_h22_an_angle_that_is_wrapped(method):
    @fp.system(state="x z")
    def wrapped(t, s, p):
        return 1.0, np.where(np.arctan(np.tan(s.x / 2)) > 0.3, 1, 0)

    run = go(wrapped, [0.1, 0], (0, 30), 1e-8, method)
    assert run.success
    at = [0.6, np.pi]
    at = [t + 2 * np.pi * k - 0.1 for k in range(6) for t in at]
    at = [t for t in at if t < 30]
    assert times(run, "cross") == close(at, 1e-6)
    assert run.y[1, -1] == close(sum(at[1::2]) - sum(at[: len(at[1::2]) * 2 : 2]), 1e-5)


@each_method
@pytest.mark.parametrize("level", [0.5, -2.0])
def test_h22_an_h_that_changes_its_sign_at_a_pole(method, level):
    @fp.system(state="x v z")
    def ratio(t, s, p):
        return s.v, -s.x, np.where(s.v / s.x > level, 1, 0)

    run = go(ratio, [1, 0, 0], (0, 10), 1e-8, method)
    assert run.success
    root = -np.arctan(level)  # of v/x = -tan t, and where it is infinite
    at = sorted([root + np.pi * k for k in range(5)] + [np.pi * (k + 0.5) for k in range(4)])
    at = [t for t in at if 0 < t < 10]
    assert times(run, "cross") == close(at, 1e-6)


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
    with pytest.raises(fp.DefinitionError, match=r"surface h (is not one|switches itself)"):
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


# --- H23 ------------------------------------------------------------------------------------------


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
    assert_failed(run, "not_finite", "surface 0", ": f2")
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


@each_method
def test_h23_a_called_function_that_is_not_finite_is_named(method):
    assert_failed(go(ends_in(math.inf), [0.1], (0, 2), 1e-9, method), "not_finite", ": f1.")


@pytest.mark.parametrize("switch", ["sqrt(x) - 0.5", "log(x) - log(0.25)"])
def test_h23_a_switching_function_need_not_exist_everywhere(switch):
    run = go(line(switch), [0.1], (0, 1))
    assert times(run, "cross") == close([0.15], 1e-13)


# --- H24 ------------------------------------------------------------------------------------------


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


# --- H25 ------------------------------------------------------------------------------------------


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


# --- H29 ------------------------------------------------------------------------------------------


@explicit
def test_h29_an_event_inside_a_rejected_step_is_ignored(method):
    # x = e^-50t stays above -0.5; an explicit step of 1 lands far below it
    decay = sides(lambda t, s, p: -49 * s.x, lambda t, s, p: -50 * s.x, "x + 0.5", "x")
    run = go(decay, [1], (0, 1), 1e-6, method, first_step=1)
    assert run.success
    assert run.stats.rejected > 0
    assert word(run) == ""
    assert run.y[0, -1] == close(0, 1e-5)


# --- H40 ------------------------------------------------------------------------------------------


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


# --- H42 ------------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("wall", [0.5, 0.1, 1e-3, 1e-8, 0.0])
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
