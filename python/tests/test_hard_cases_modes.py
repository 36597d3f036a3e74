# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases of the decision at a surface: H5-H13, H16, H32, H35, H38.

Systems are typed as a user would type them.
"""

import math

import numpy as np
import pytest

import filippov as fp
from hard import (
    EPS,
    assert_failed,
    close,
    down,
    each_method,
    explicit,
    go,
    minus,
    plus,
    sides,
    strip,
    times,
    up,
    word,
)

# --- H5 -------------------------------------------------------------------------------------------


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


# --- H6 -------------------------------------------------------------------------------------------


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
def test_h6_where_l1_vanishes_triply_it_changes_sign_and_the_slide_ends(method):
    for start in (-1.0, -0.9, -0.7, -0.613, -0.31):
        for tol in (1e-4, 1e-6, 1e-9, 1e-12):
            run = go(strip(lambda x: -(x**3), down), [start, 0], (0, 2), tol, method)
            assert run.success, run.message
            assert word(run) == "exit_sliding"
            # 1 + s = x^3 is rounding below 6e-6
            assert run.events["t"][1] == close(-start, 1e-5)


# --- H7 -------------------------------------------------------------------------------------------

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


# --- H8 -------------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("start", [0.0, 1e-17, 1e-12, 1e-6, 0.1])
def test_h8_a_slide_that_is_over_at_the_start_is_not_begun(method, start):
    run = go(strip(minus, down), [start, 0], (0, 1), 1e-9, method)
    assert run.success
    assert word(run) == ""
    assert (run.events["mode_after"][0], run.events["surface"][0]) == (-1, 0)
    assert run.y[1, -1] == close(-0.5 - start, 1e-9)  # -(x^2 - start^2)/2


# --- H9 -------------------------------------------------------------------------------------------


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
@pytest.mark.parametrize("tol", [1e-6, 1e-9, 1e-12, 1e-13])
def test_h9_at_the_limit_of_friction_a_block_goes_on_resting(method, tol):
    for reversals in range(8):  # the last one ends at the limit
        start = 0.4 * (1 + 2 * reversals)
        run = fp.simulate(fp.models.coulomb, [start, 0], (0, 40), method=method, rtol=tol, atol=tol)
        assert run.success
        assert (np.diff(run.events["t"]) >= 0).all()
        assert run.y[:, -1] == close([0.4 * (-1) ** reversals, 0], 20 * (1 + reversals) * tol)


# --- H10 ------------------------------------------------------------------------------------------


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


# --- H11 ------------------------------------------------------------------------------------------


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


# --- H12 ------------------------------------------------------------------------------------------


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


# --- H13 ------------------------------------------------------------------------------------------


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


# --- H16 ------------------------------------------------------------------------------------------


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


# --- H32 ------------------------------------------------------------------------------------------


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


# --- H35 ------------------------------------------------------------------------------------------


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


# --- H38 ------------------------------------------------------------------------------------------


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
