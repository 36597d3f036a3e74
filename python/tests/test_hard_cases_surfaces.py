# SPDX-License-Identifier: BSD-3-Clause
"""Hard cases of several surfaces, jumps, accumulation: H14, H15, H17-H19, H30, H31, H36, H37, H43.

Systems are typed as a user would type them.
"""

import math

import numpy as np
import pytest

import filippov as fp
from hard import assert_failed, close, each_method, go, times, word

# --- H14 ------------------------------------------------------------------------------------------


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


# --- H15 ------------------------------------------------------------------------------------------


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


# --- H17 ------------------------------------------------------------------------------------------


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


@each_method
@pytest.mark.parametrize(
    "force",
    [
        lambda t, s: -np.where(s.x > 0, 2.0, 1.0) * s.x - np.sign(s.v) + 0.2 * np.sin(t),
        lambda t, s: -s.x * abs(s.x) - np.sign(s.v),
        lambda t, s: -s.x - (0.3 + abs(s.x)) * np.sign(s.v),
        lambda t, s: -s.x - np.where(s.x > 0, 1.0, 0.6) * np.sign(s.v),
    ],
)
def test_h17_a_block_rests_where_its_spring_or_friction_changes(method, force):
    block = fp.system(state="x v")(lambda t, s, p: (s.v, force(t, s)))
    run = go(block, [0, 0], (0, 20), 1e-8, method)
    assert run.success
    assert run.y[:, -1].tolist() == [0, 0]


@each_method
@pytest.mark.parametrize("gain", [lambda s: 1 + 2 * abs(s.x), lambda s: 1 + abs(s.x) + abs(s.v)])
def test_h17_a_slide_goes_on_where_its_gain_has_kinks(method, gain):
    control = fp.system(state="x v")(lambda t, s, p: (s.v, -gain(s) * np.sign(s.v + s.x)))
    run = go(control, [1, 0], (0, 200), 1e-8, method)
    assert run.success
    assert np.abs(run.y[:, -1]).max() < 1e-7


@each_method
def test_h17_a_kink_is_followed(method):
    kinked = fp.system(state="x y")(lambda t, s, p: (-s.x, abs(s.x) - s.y))
    rectified = fp.system(state="x y")(
        lambda t, s, p: (-s.x + np.maximum(s.y, 0), -s.y + 0.5 * np.maximum(s.x, 0))
    )
    for system in (kinked, rectified):
        for start in ([1, 0], [-1, 0], [0, 0], [0, -1]):
            run = go(system, start, (0, 100), 1e-8, method)
            assert run.success, (start, run.message)
            assert np.abs(run.y[:, -1]).max() < 1e-7


def test_h17_starts_beside_an_intersection_are_as_on_it():
    for x in (0.0, 1e-17, -1e-17):
        for y in (0.0, 1e-17, -1e-17):
            run = go(planes, [x, y], (0, 1))
            assert run.success
            assert run.events["mode_after"][0].tolist() == [0, 0]
            assert run.y[:, -1].tolist() == [0, 0]


# --- H18 ------------------------------------------------------------------------------------------


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


# --- H19 ------------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("scale", [1.0, -1.0, 1e9])
def test_h19_surfaces_that_touch_where_they_are_hit_are_crossed_together(method, scale):
    @fp.system(state="x y", surfaces={"road": "y", "arc": lambda t, s: scale * (s.y + s.x**2)})
    def twice(t, s):
        return 0.0, -1 - 0.1 * np.sign(s.y) - 0.1 * np.sign(s.y + s.x**2)

    assert twice.surfaces == 2
    run = go(twice, [0, 1], (0, 5), 1e-9, method)  # falls at 1.2, then at 0.8
    assert word(run) == "cross"
    assert run.events[1]["t"] == close(1 / 1.2, 1e-12)
    assert run.y[1, -1] == close(-0.8 * (5 - 1 / 1.2), 1e-12)
    assert go(twice, [0, 0], (0, 5), 1e-9, method).y[1, -1] == close(-4, 1e-12)


@each_method
def test_h19_a_wall_and_friction_that_hold_the_same_speed(method):
    @fp.system(state="x v", jumps={"wall": ("x", lambda t, s, p: (s.x, -0.5 * s.v))})
    def block(t, s):
        return s.v, -1 - 0.3 * np.sign(s.v)

    run = go(block, [0, 0], (0, 3), 1e-9, method)
    assert run.success
    assert run.y[:, -1].tolist() == [0, 0]
    # from a height it falls at 0.7, rises against 1.3, and keeps half of its speed at the wall
    run = go(block, [0.5, 0], (0, 3), 1e-9, method)
    assert run.success
    assert run.y[:, -1].tolist() == [0, 0]
    up, ratio = 0.5 * np.sqrt(0.7), 0.5 * np.sqrt(0.7 / 1.3)
    flights = up * (1 / 1.3 + np.sqrt(0.7 / 1.3) / 0.7) / (1 - ratio)
    rest = run.events[-2]  # what bounces lower than the tolerance rests at once
    assert rest["kind"] == "enter_sliding"
    assert rest["t"] == close(np.sqrt(1 / 0.7) + flights, 1e-5)


def test_h19_a_surface_given_twice_is_one_or_is_refused():
    @fp.system(state="x y")
    def merged(t, s):
        return 1.0, -0.1 * np.sign(s.y) - 0.2 * np.sign(2 * s.y) + 0.3 * np.sign(-s.y)

    assert merged.surfaces == 1
    assert go(merged, [0, 0.6], (0, 2)).events["t"][1] == close(1, 1e-13)  # falls at 0.6
    corners = {key: lambda t, s, p: (1.0, -1.0) for key in ("--", "+-", "-+")}
    with pytest.raises(fp.DefinitionError, match="surface h1 is the same as h0"):
        fp.System("x y", fields=corners | {"++": lambda t, s, p: (1.0, -1.2)}, switch=["y", "2*y"])


# --- H30 ------------------------------------------------------------------------------------------


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


# --- H31 ------------------------------------------------------------------------------------------


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


# --- H36 ------------------------------------------------------------------------------------------


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


# --- H37 ------------------------------------------------------------------------------------------


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


# --- H43 ------------------------------------------------------------------------------------------


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
