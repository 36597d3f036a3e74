# SPDX-License-Identifier: BSD-3-Clause
"""Friction of two and three components, as users write it.

Against closed forms, the same motion along a line by ordinary signs, balances of energy, and the
symmetries of the plane.
"""

import json
import pickle
import re
import shutil
import subprocess

import numpy as np
import pytest

import filippov as fp

METHODS = ["dopri5", "dop853", "rodas5p"]
TIGHT = {"rtol": 1e-10, "atol": 1e-10}


def kinds_of(run):
    return [str(kind) for kind in run.events["kind"]]


# --- ways to write it -----------------------------------------------------------------------------

FORMS = {
    "unit": lambda u, w: fp.unit(u, w),
    "root of squares": lambda u, w: (u / np.sqrt(u**2 + w**2), w / np.sqrt(u**2 + w**2)),
    "hypot": lambda u, w: (u / np.hypot(u, w), w / np.hypot(u, w)),
    "hypot, exchanged": lambda u, w: (u / np.hypot(w, -u), w / np.hypot(w, -u)),
    "reciprocal": lambda u, w: (1 / np.hypot(u, w) * u, 1 / np.hypot(u, w) * w),
    "power": lambda u, w: (u * (u * u + w * w) ** -0.5, w * (u * u + w * w) ** -0.5),
    "half power": lambda u, w: (u / (u * u + w * w) ** 0.5, w / (u * u + w * w) ** 0.5),
    "both signs": lambda u, w: (-(-u / np.hypot(u, w)), -fp.unit(-u, -w)[1]),
    "scaled": lambda u, w: fp.unit(1e-9 * u, 1e-9 * w),
    "where it moves": lambda u, w: (
        np.where(np.hypot(u, w) > 0, u / np.hypot(u, w), 0),
        np.where(u**2 + w**2 > 0, w / np.hypot(u, w), 0),
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_puck_stops_however_its_friction_is_written(form):
    @fp.system(state="x y u w", params={"mug": 2.94})
    def puck(t, s, p):
        n = FORMS[form](s.u, s.w)
        return s.u, s.w, -p.mug * n[0], -p.mug * n[1]

    assert puck.kinds == ("direction", "component")
    run = fp.simulate(puck, [0, 0, 3, 4], (0, 5))
    far = 25 / 2.94 / 2
    assert run.success
    np.testing.assert_allclose(run.y[:, -1], [0.6 * far, 0.8 * far, 0, 0], atol=1e-8)
    assert kinds_of(run) == ["start", "enter_sliding", "end"]
    assert run.events["t"][1] == pytest.approx(5 / 2.94, abs=1e-9)
    assert run.events["surface"][1] == 0
    assert run.stats.steps < 60


def test_vectors_of_numpy():
    @fp.system(state="x y u w", params={"mug": 2.94})
    def norm(t, s, p):
        v = s[2:]
        return [*v, *(-p.mug * v / np.linalg.norm(v))]

    @fp.system(state="x y u w", params={"mug": 2.94})
    def square(t, s, p):
        v = s[2:]
        return np.concatenate([v, -p.mug * v / np.sqrt(v @ v)])

    @fp.system(state="x y u w", params={"mug": 2.94})
    def unit(t, s, p):
        return np.concatenate([s[2:], -p.mug * fp.unit(*s[2:])])

    for sys in (norm, square, unit):
        assert sys.kinds == ("direction", "component")
        run = fp.simulate(sys, [0, 0, 3, 4], (0, 5))
        np.testing.assert_allclose(run.y[:2, -1], [2.5510204, 3.4013605], atol=1e-7)


def test_a_root_of_one_square_is_an_absolute_value():
    @fp.system(state="x u")
    def block(t, s, p):
        return s.u, -s.u / np.sqrt(s.u**2)

    assert block.kinds == ("switching",)
    run = fp.simulate(block, [0, 3], (0, 5))
    np.testing.assert_allclose(run.y[:, -1], [4.5, 0], atol=1e-8)


def test_what_is_not_pulled_to_rest_stays_a_quotient():
    """A spring along its length, gravity, thrust, a regularised friction: nothing changes."""

    @fp.system(state="x y u w", params={"k": 2.0, "L": 1.0})
    def spring(t, s, p):
        r = np.hypot(s.x, s.y)
        return s.u, s.w, -p.k * (r - p.L) * s.x / r, -p.k * (r - p.L) * s.y / r

    @fp.system(state="x y u w")
    def planet(t, s, p):
        r = np.hypot(s.x, s.y)
        return s.u, s.w, -s.x / r**3, -s.y / (r * r * r)

    @fp.system(state="x y u w", params={"T": 0.1})
    def rocket(t, s, p):
        v = np.hypot(s.u, s.w)
        return s.u, s.w, p.T * s.u / v, p.T * s.w / v

    @fp.system(state="x y u w", params={"eps": 1e-3})
    def soft(t, s, p):
        v = np.sqrt(s.u**2 + s.w**2 + p.eps**2)
        return s.u, s.w, -s.u / v, -s.w / v

    for sys in (spring, planet, rocket, soft):
        assert sys.kinds == ()
    run = fp.simulate(planet, [1, 0, 0, 1], (0, 2 * np.pi), **TIGHT)
    np.testing.assert_allclose(run.y[:, -1], [1, 0, 0, 1], atol=1e-7)


# --- closed forms ---------------------------------------------------------------------------------


@fp.system(state="x y u w", params={"mug": 2.0, "V": 1.0, "W": 0.0})
def belt(t, s, p):
    n = fp.unit(s.u - p.V, s.w - p.W)
    return s.u, s.w, -p.mug * n[0], -p.mug * n[1]


@pytest.mark.parametrize("method", METHODS)
def test_a_puck_is_carried_by_a_belt(method):
    """Seen from the belt it stops on a straight line."""
    random = np.random.default_rng(1)
    for _ in range(5):
        mug, V, W, u, w = random.uniform([0.5, -2, -2, -4, -4], [4, 2, 2, 4, 4])
        speed = np.hypot(u - V, w - W)
        T, end = speed / mug, 2 * speed / mug
        params = {"mug": mug, "V": V, "W": W}
        run = fp.simulate(belt, [0, 0, u, w], (0, end), params=params, method=method)
        assert run.success
        assert run.events["t"][1] == pytest.approx(T, abs=1e-8)
        wanted = [V * end + (u - V) * T / 2, W * end + (w - W) * T / 2, V, W]
        np.testing.assert_allclose(run.y[:, -1], wanted, atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_force_that_grows_breaks_a_puck_loose(method):
    """It sticks while the force is less than friction, and leaves with the force."""

    @fp.system(state="x y u w", params={"mug": 1.5, "g": 0.5, "angle": 0.7})
    def pulled(t, s, p):
        n = fp.unit(s.u, s.w)
        f = p.g * t
        return s.u, s.w, f * np.cos(p.angle) - p.mug * n[0], f * np.sin(p.angle) - p.mug * n[1]

    run = fp.simulate(pulled, np.zeros(4), (0, 5), method=method, dense_output=True, **TIGHT)
    assert kinds_of(run) == ["start", "exit_sliding", "end"]
    assert run.events["t"][1] == pytest.approx(3, abs=1e-9)
    along = np.array([np.cos(0.7), np.sin(0.7)])
    later = 2.0
    np.testing.assert_allclose(run.y[:2, -1], 0.5 * later**3 / 6 * along, atol=1e-8)
    np.testing.assert_allclose(run.y[2:, -1], 0.5 * later**2 / 2 * along, atol=1e-8)
    # s holds the puck, then has the direction of its speed
    np.testing.assert_allclose(run.s(1.2), 1.2 / 3 * along, atol=1e-12)
    np.testing.assert_allclose(run.s(4.0), along, atol=1e-9)
    assert list(run.sol.mode(1.0)) == [0, 0]
    assert list(run.sol.mode(4.0)) == [1, 1]


@pytest.mark.parametrize("method", METHODS)
def test_a_turntable_that_gains_speed_throws_a_puck_off(method):
    """It turns by alpha t^2/2, so that what holds a puck at r is r sqrt(alpha^2 + (alpha t)^4)."""
    r, alpha, mug = 0.8, 0.6, 1.9

    @fp.system(state="x y u w", params={"mug": mug, "alpha": alpha})
    def table(t, s, p):
        omega = p.alpha * t
        n = fp.unit(s.u + omega * s.y, s.w - omega * s.x)
        return s.u, s.w, -p.mug * n[0], -p.mug * n[1]

    t_off = ((mug / r) ** 2 - alpha**2) ** 0.25 / alpha
    run = fp.simulate(table, [r, 0, 0, 0], (0, t_off + 0.5), method=method, rtol=1e-10, atol=1e-11)
    assert run.success
    assert kinds_of(run)[:2] == ["start", "exit_sliding"]
    assert run.events["t"][1] == pytest.approx(t_off, abs=1e-8)
    turned = alpha * t_off**2 / 2
    x, y = run.events["x_left"][1][:2]
    np.testing.assert_allclose([x, y], [r * np.cos(turned), r * np.sin(turned)], atol=1e-8)
    assert np.hypot(*run.y[:2, -1]) > r + 1e-3


def test_a_turntable_at_constant_speed_keeps_a_puck():
    @fp.system(state="x y u w", params={"mug": 2.0, "omega": 1.3})
    def table(t, s, p):
        n = fp.unit(s.u + p.omega * s.y, s.w - p.omega * s.x)
        return s.u, s.w, -p.mug * n[0], -p.mug * n[1]

    run = fp.simulate(table, [1, 0, 0, 1.3], (0, 20), dense_output=True, **TIGHT)
    assert kinds_of(run) == ["start", "end"]
    wanted = [np.cos(26), np.sin(26), -1.3 * np.sin(26), 1.3 * np.cos(26)]
    np.testing.assert_allclose(run.y[:, -1], wanted, atol=1e-7)
    assert np.hypot(*run.s(7.0)) == pytest.approx(1.3**2 / 2.0, abs=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_body_in_space_stops_on_a_straight_line(method):
    @fp.system(state="x y z u v w", params={"a": 1.2})
    def body(t, s, p):
        n = fp.unit(s.u, s.v, s.w)
        return s.u, s.v, s.w, -p.a * n[0], -p.a * n[1], -p.a * n[2]

    assert body.kinds == ("direction", "component", "component")
    start = np.array([1.0, -2.0, 2.0])
    run = fp.simulate(body, [0, 0, 0, *start], (0, 5), method=method)
    assert run.events["t"][1] == pytest.approx(3 / 1.2, abs=1e-9)
    np.testing.assert_allclose(run.y[:3, -1], start * 3 / 1.2 / 2, atol=1e-7)
    assert list(run.y[3:, -1]) == [0, 0, 0]


# --- two routes -----------------------------------------------------------------------------------


def along_a_line(angle, sys_line, sys_plane, x0, t_end, params, pairs):
    """Compare a motion in the plane along a line with the one of ordinary signs."""
    c = np.array([np.cos(angle), np.sin(angle)])
    one = fp.simulate(sys_line, x0, (0, t_end), params=params, **TIGHT)
    start = np.outer(x0, c).reshape(-1)
    two = fp.simulate(sys_plane, start, (0, t_end), params=params | {"angle": angle}, **TIGHT)
    assert one.success
    assert two.success
    np.testing.assert_allclose(two.y[:, -1], np.outer(one.y[:, -1], c).reshape(-1), atol=1e-7)
    wanted = [str(k) for k in one.events["kind"]]
    assert kinds_of(two) == [pairs.get(k, k) for k in wanted]
    np.testing.assert_allclose(two.events["t"], one.events["t"], atol=1e-7)
    return len(wanted)


@fp.system(state="x u", params={"A": 1.5, "om": 1.1, "mu": 1.0, "d": 0.0, "vs": 0.3})
def line(t, s, p):
    mu = p.mu + p.d * np.exp(-abs(s.u) / p.vs)
    return s.u, p.A * np.cos(p.om * t) - s.x - mu * np.sign(s.u)


@fp.system(
    state="x y u w", params={"A": 1.5, "om": 1.1, "mu": 1.0, "d": 0.0, "vs": 0.3, "angle": 0.0}
)
def plane(t, s, p):
    n = fp.unit(s.u, s.w)
    mu = p.mu + p.d * np.exp(-np.hypot(s.u, s.w) / p.vs)
    f = p.A * np.cos(p.om * t)
    return (
        s.u,
        s.w,
        f * np.cos(p.angle) - s.x - mu * n[0],
        f * np.sin(p.angle) - s.y - mu * n[1],
    )


def test_along_a_line_it_is_ordinary_friction():
    """Also where friction falls with the speed: what it is at rest, |v| is smooth there."""
    random = np.random.default_rng(5)
    events = 0
    for d in (0.0, 0.4):
        for _ in range(4):
            A, om, mu, angle, x, u = random.uniform(
                [1.1, 0.5, 0.4, 0, -1, -1], [2.5, 2, 0.8, 6, 1, 1]
            )
            params = {"A": A, "om": om, "mu": mu, "d": d}
            # where the sign changes a puck in the plane touches rest and goes on
            events += along_a_line(angle, line, plane, [x, u], 12.0, params, {"cross": "graze"})
    assert events > 60


def test_beside_a_second_friction_pair():
    """A block on a block on a table."""

    @fp.system(state="x y u v", params={"A": 2.6, "om": 0.8, "mu": 0.9, "nu": 0.6})
    def blocks(t, s, p):
        n, m = np.sign(s.u), np.sign(s.u - s.v)
        return s.u, s.v, p.A * np.sin(p.om * t) - p.mu * n - p.nu * m, p.nu * m

    @fp.system(
        state="x1 x2 y1 y2 u1 u2 v1 v2",
        params={"A": 2.6, "om": 0.8, "mu": 0.9, "nu": 0.6, "angle": 0.0},
    )
    def plates(t, s, p):
        n = fp.unit(s.u1, s.u2)
        m = fp.unit(s.v1 - s.u1, s.v2 - s.u2)  # the other way round
        f = p.A * np.sin(p.om * t)
        return (
            s.u1,
            s.u2,
            s.v1,
            s.v2,
            f * np.cos(p.angle) - p.mu * n[0] + p.nu * m[0],
            f * np.sin(p.angle) - p.mu * n[1] + p.nu * m[1],
            -p.nu * m[0],
            -p.nu * m[1],
        )

    assert plates.kinds == ("direction", "component") * 2
    events = along_a_line(0.9, blocks, plates, [0, 0, 0, 0], 12.0, {"nu": 0.6}, {"cross": "graze"})
    assert events > 5


def test_action_and_reaction_are_one_direction():
    @fp.system(state="x1 x2 y1 y2 u1 u2 v1 v2", params={"mu": 0.7})
    def pair(t, s, p):
        n = fp.unit(s.u1 - s.v1, s.u2 - s.v2)
        m = fp.unit(s.v1 - s.u1, s.v2 - s.u2)
        return s.u1, s.u2, s.v1, s.v2, *(-p.mu * n), *(-p.mu * m)

    assert pair.kinds == ("direction", "component")
    run = fp.simulate(pair, [0, 0, 0, 0, 2, 0, 0, 1], (0, 4), **TIGHT)
    # both end with the mean velocity
    np.testing.assert_allclose(run.y[4:, -1], [1, 0.5, 1, 0.5], atol=1e-9)
    T = np.hypot(2, 1) / 1.4
    assert run.events["t"][1] == pytest.approx(T, abs=1e-9)


@fp.system(state="x y th u w om work", params={"mu": 0.8, "A": 1.1, "f": 0.9, "d": 0.5, "J": 0.3})
def turning_block(t, s, p):
    """Held by friction at a point at distance d from its middle; `work` is what that takes away."""
    c, q = np.cos(s.th), np.sin(s.th)
    a, b = s.u - s.om * p.d * q, s.w + s.om * p.d * c
    n = fp.unit(a, b)
    force = p.A * np.cos(p.f * t)
    torque = p.d * (-q * (-p.mu * n[0]) + c * (-p.mu * n[1]))
    return (
        s.u,
        s.w,
        s.om,
        force - p.mu * n[0],
        0.4 * force - p.mu * n[1],
        torque / p.J,
        force * (s.u + 0.4 * s.w) - p.mu * np.hypot(a, b),
    )


@pytest.mark.parametrize("method", METHODS)
def test_the_work_of_friction_on_a_block_that_turns(method):
    """Kinetic energy is what the force gave and friction took."""
    run = fp.simulate(turning_block, np.zeros(7), (0, 10), method=method, **TIGHT)
    assert run.success
    assert len(run.events) > 4
    for k in range(len(run.events)):
        *_, u, w, om, work = run.events["x_right"][k]
        assert (u**2 + w**2 + 0.3 * om**2) / 2 == pytest.approx(work, abs=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_drill_bit_that_sticks_and_slips(method):
    """One torsional and one axial motion under one friction; energy as above."""

    @fp.system(state="z th w om twist work", params={"mu": 1.0, "r": 0.6, "k": 1.5, "drive": 0.8})
    def bit(t, s, p):
        n = fp.unit(s.w, p.r * s.om)
        torque = p.k * s.twist
        push = 0.3 * np.sin(0.7 * t)
        return (
            s.w,
            s.om,
            push - p.mu * n[0],
            torque - p.mu * p.r * n[1],
            p.drive - s.om,
            push * s.w + torque * s.om - p.mu * np.hypot(s.w, p.r * s.om),
        )

    run = fp.simulate(bit, np.zeros(6), (0, 15), method=method, **TIGHT)
    assert run.success
    assert {"enter_sliding", "exit_sliding"} <= set(kinds_of(run))
    for x in run.events["x_right"]:
        assert (x[2] ** 2 + x[3] ** 2) / 2 == pytest.approx(x[5], abs=1e-7)


def test_a_plane_is_as_good_in_any_direction():
    """A rotating force on a puck on a slope: turned, it is the same."""

    @fp.system(state="x y u w", params={"mu": 1.0, "A": 1.3, "om": 0.9, "f": 0.3, "turn": 0.0})
    def puck(t, s, p):
        n = fp.unit(s.u, s.w)
        a = p.A * np.abs(np.sin(p.om * t))
        g = p.om * t / 3 + p.turn
        return (
            s.u,
            s.w,
            a * np.cos(g) + p.f * np.cos(p.turn) - p.mu * n[0],
            a * np.sin(g) + p.f * np.sin(p.turn) - p.mu * n[1],
        )

    ends = []
    for turn in (0.0, 1.0, 2.5):
        run = fp.simulate(puck, np.zeros(4), (0, 15), params={"turn": turn}, **TIGHT)
        assert run.success
        c, q = np.cos(turn), np.sin(turn)
        back = np.array([[c, q], [-q, c]])
        ends.append(np.concatenate([back @ run.y[:2, -1], back @ run.y[2:, -1]]))
        assert len(run.events) > 4
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-6)
    np.testing.assert_allclose(ends[2], ends[0], atol=1e-6)


def test_between_walls():
    """Unfolded, its path is straight."""

    @fp.system(
        state="x y u w",
        params={"mu": 0.5},
        jumps={
            "right": ("1 - x", lambda t, s, p: (s.x, s.y, -s.u, s.w)),
            "left": ("1 + x", lambda t, s, p: (s.x, s.y, -s.u, s.w)),
        },
    )
    def puck(t, s, p):
        n = fp.unit(s.u, s.w)
        return s.u, s.w, -p.mu * n[0], -p.mu * n[1]

    assert puck.kinds == ("direction", "component", "jump", "jump")
    run = fp.simulate(puck, [0.1, 0, 2, -1], (0, 10), **TIGHT)
    T = np.sqrt(5) / 0.5
    x = np.fmod(0.1 + 2 * T / 2 + 1, 4.0)
    x = x - 1 if x < 2 else 3 - x
    np.testing.assert_allclose(run.y[:, -1], [x, -T / 2, 0, 0], atol=1e-8)


def test_on_steps_and_slopes_of_other_switches():
    """A patch of ice under it, and a fan that is switched on: signs beside a direction."""

    @fp.system(state="x y u w", params={"mu": 1.0})
    def puck(t, s, p):
        n = fp.unit(s.u, s.w)
        mu = np.where(s.x > 1, 0.5, 1.0) * p.mu
        return s.u, s.w, -mu * n[0], -mu * n[1]

    assert puck.kinds == ("switching", "direction", "component")
    run = fp.simulate(puck, [0, 0, 1.8, 2.4], (0, 10), **TIGHT)
    # x = 1 at speed v1 after 5/3 of the way
    v1 = np.sqrt(9 - 2 * 5 / 3)
    far = 5 / 3 + v1**2
    np.testing.assert_allclose(run.y[:, -1], [0.6 * far, 0.8 * far, 0, 0], atol=1e-8)
    assert kinds_of(run) == ["start", "cross", "enter_sliding", "end"]


# --- what is made of it ---------------------------------------------------------------------------


@fp.system(
    state="x y u w", params={"mu": 1.0, "A": 1.4, "om": 0.9}, period=lambda p: 2 * np.pi / p.om
)
def forced(t, s, p):
    n = fp.unit(s.u, s.w)
    ru = np.where(s.x > 0, 1.0, 0.8)
    return (
        s.u,
        s.w,
        p.A * np.cos(p.om * t) - ru * s.x - p.mu * n[0],
        0.7 * p.A * np.sin(p.om * t) - s.y - p.mu * n[1],
    )


def test_pickles_and_files_have_it(tmp_path):
    again = pickle.loads(pickle.dumps(forced))
    assert again == forced
    assert again.kinds == forced.kinds
    run = fp.simulate(forced, [0.2, 0, 0, 0], (0, 8), dense_output=True)
    run.save(tmp_path / "run.npz")
    back = fp.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(back.y, run.y)
    np.testing.assert_array_equal(back.s([1.0, 5.0]), run.s([1.0, 5.0]))
    json.dumps(forced._identity())
    assert fp.simulate(again, [0.2, 0, 0, 0], (0, 8)).y[:, -1] == pytest.approx(run.y[:, -1], abs=0)


def test_words_tell_what_it_is():
    told = repr(forced)
    assert "unit     h1 = u" in told
    assert "and      h2 = w" in told
    written = forced.latex()
    assert r"\left(n_{0}, n_{1}\right) &= \operatorname{unit}\left(u, w\right)" in written
    assert re.search(r"n_\{1\}", written.rsplit("&=", 1)[1])

    @fp.system(state="x y u w n0", params={"n1": 1.0})
    def named(t, s, p):
        n = fp.unit(s.u, s.w)
        return s.u, s.w, -p.n1 * n[0], -p.n1 * n[1], -s.n0

    assert r"e_{0}" in named.latex()


def test_fields_by_sides():
    x = [0.1, 0, 3, -4]
    moving = forced.field(0.0, x, (1, 1, 1))
    np.testing.assert_allclose(moving, [3, -4, 1.4 - 0.1 - 0.6, 0.8])
    stuck = forced.field(0.0, [0.1, 0, 0, 0], (1, 0, 0))
    np.testing.assert_allclose(stuck, [0, 0, 0, 0], atol=1e-15)
    with pytest.raises(ValueError, match="all entries of a unit, or for none"):
        forced.field(0.0, x, (1, 0, 1))
    with pytest.raises(ValueError, match="has two sides, not one of a unit"):
        forced.normal_components(0.0, x, surface=1, side=(1, 1, 1))
    by_differences = np.empty((4, 4))
    for j in range(4):
        step = np.zeros(4)
        step[j] = 1e-6
        ahead = forced.field(0.0, x + step, (1, 1, 1))
        behind = forced.field(0.0, x - step, (1, 1, 1))
        by_differences[:, j] = (ahead - behind) / 2e-6
    np.testing.assert_allclose(forced.jacobian(0.0, x, (1, 1, 1)), by_differences, atol=1e-8)


@pytest.mark.skipif(shutil.which("g++") is None, reason="no compiler")
def test_in_cpp(tmp_path):
    @fp.system(
        state="x y u w q",
        params={"mu": 0.8},
        jumps={"wall": ("2 - x", lambda t, s, p: (s.x, s.y, -0.5 * s.u, s.w, s.q))},
    )
    def puck(t, s, p):
        n = fp.unit(s.u, s.w)
        return (
            s.u,
            s.w,
            0.9 * np.sin(t) - p.mu * n[0],
            0.3 - p.mu * n[1] * (1 + 0.2 * np.hypot(s.u, s.w)),
            -np.sign(s.q - 0.5),
        )

    run = fp.simulate(puck, [0, 0, 1, 2, 1], (0, 9), method="dop853", **TIGHT)
    (tmp_path / "own.hpp").write_text(puck.to_cpp())
    (tmp_path / "main.cpp").write_text(
        '#include "own.hpp"\n#include <filippov/filippov.hpp>\n#include <cstdio>\n'
        "int main() {\n"
        "    filippov::Settings<double, 5> settings;\n"
        "    settings.rtol = 1e-10;\n"
        "    settings.atol = filippov::AbsoluteTolerance<double, 5>(1e-10);\n"
        "    const auto run = filippov::simulate<filippov::DormandPrince8>(puck{},\n"
        "        filippov::default_params<puck>(), filippov::Vec<double, 5>(0, 0, 1, 2, 1), 0.0,\n"
        "        9.0, settings);\n"
        '    std::printf("%zu", run.events.size());\n'
        '    for (const double v : run.result.x) std::printf(" %.17g", v);\n'
        "}\n"
    )
    compiler = ["g++", "-std=c++20", "-O0", "-isystem", "/usr/include/eigen3", "-I"]
    subprocess.run(
        [*compiler, fp.get_include(), "main.cpp", "-o", "main"], cwd=tmp_path, check=True
    )
    out = subprocess.run(
        [tmp_path / "main"], capture_output=True, text=True, check=True
    ).stdout.split()
    assert int(out[0]) == len(run.events)
    np.testing.assert_allclose([float(v) for v in out[1:]], run.y[:, -1], atol=1e-8)


def test_many_at_once():
    starts = np.array([[0, 0, 0], [0, 0, 0], [3, 1, 0], [4, -1, 0.5]], dtype=float)
    many = fp.ensemble(belt, starts, (0, 6))
    for k in range(3):
        one = fp.simulate(belt, starts[:, k], (0, 6))
        np.testing.assert_allclose(many.y[:, k], one.y[:, -1], atol=1e-8)


def test_maps_say_that_rest_has_no_derivatives():
    weak = forced.with_params(A=0.9)
    image = fp.strobe_map(weak, [0.2, 0, 0, 0])
    run = fp.simulate(weak, [0.2, 0, 0, 0], (0, weak.period()), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(image.x, run.y[:, -1], atol=1e-9)
    assert "enter_sliding" in kinds_of(run) or "exit_sliding" in kinds_of(run)
    assert image.singular
    assert np.isnan(image.slope).all()


def test_where_it_moves_there_are_derivatives():
    """A puck that is fast: by differences of runs."""
    x = np.array([0.3, 0.1, 8.0, 5.0])

    def end(x):
        run = fp.strobe_map(short, x)
        assert not run.singular
        return run

    @fp.system(state="x y u w", params={"mu": 1.0, "A": 0.2}, period="1.5")
    def short(t, s, p):
        n = fp.unit(s.u, s.w)
        return s.u, s.w, p.A - p.mu * n[0], -s.y - p.mu * n[1]

    image = end(x)
    for j in range(4):
        step = np.zeros(4)
        step[j] = 1e-5
        by_differences = (end(x + step).x - end(x - step).x) / 2e-5
        np.testing.assert_allclose(image.slope[:4, j], by_differences, atol=1e-7)


def test_diagrams_have_it():
    diagram = fp.bifurcation_diagram(
        forced, A=np.linspace(1.2, 1.8, 4), transient=20, keep=5, x0=[0.2, 0, 0, 0]
    )
    assert set(map(str, np.atleast_1d(diagram.status))) == {"ok"}
    T = forced.period()
    run = fp.simulate(forced, [0.2, 0, 0, 0], (0, 25 * T), params={"A": 1.2}, **TIGHT)
    np.testing.assert_allclose(diagram.y_end[:, 0], run.y[:, -1], atol=1e-5)


# --- what is refused ------------------------------------------------------------------------------


def test_analyses_that_cannot_treat_rest_say_so():
    for call in (
        lambda: fp.periodic_orbit(forced, [0.2, 0, 0, 0]),
        lambda: fp.lyapunov(forced, [0.2, 0, 0, 0]),
        lambda: fp.smoothed(forced, c1=1e4),
        lambda: fp.time_stepping(forced, [0.2, 0, 0, 0], (0, 1), n_steps=10),
    ):
        with pytest.raises(ValueError, match=r"without a direction \(unit\).*eps\*\*2"):
            call()
    for call in (
        lambda: fp.sliding_boundaries(forced, bounds=dict.fromkeys("xyuw", (-1, 1))),
        lambda: fp.equilibria(forced, bounds=dict.fromkeys("xyuw", (-1, 1))),
    ):
        with pytest.raises(ValueError, match="1 direction"):
            call()


@pytest.mark.parametrize(
    ("field", "told"),
    [
        (lambda s: -(fp.unit(s.u, s.w)[0] ** 2), "not linear in unit"),
        (lambda s: -np.sign(fp.unit(s.u, s.w)[0] - 0.5), "switches by an entry of unit"),
        (lambda s: -fp.unit(abs(s.u), s.w)[0], "an entry of unit switches itself"),
        (lambda s: -fp.unit(s.u + fp.unit(s.u, s.w)[1], s.w)[0], "an entry of unit switches"),
        (lambda s: -fp.unit(s.u, 1e-3 * s.p0)[0], "does not change with time or state"),
        (lambda s: -fp.unit(s.vector, s.w)[0], r"unit\(\*v\)"),
        (lambda s: -fp.unit(s.u, "w")[0], "no number that can be recorded"),
    ],
)
def test_what_is_no_direction_is_refused_with_what_to_write(field, told):
    class Given:
        def __init__(self, s, p):
            self.u, self.w, self.p0, self.vector = s.u, s.w, p.p0, s[2:]

    with pytest.raises(fp.DefinitionError, match=told):

        @fp.system(state="x y u w", params={"p0": 1.0})
        def puck(t, s, p):
            return s.u, s.w, field(Given(s, p)), -s.w


def test_of_numbers():
    np.testing.assert_array_equal(fp.unit(3, 4), [0.6, 0.8])
    np.testing.assert_allclose(fp.unit(1e-200, 1e-200), np.sqrt([0.5, 0.5]))
    np.testing.assert_allclose(fp.unit(1, 2, -2), [1 / 3, 2 / 3, -2 / 3])
    assert np.isnan(fp.unit(0, 0)).all()
    many = fp.unit(np.array([3.0, 0.0]), np.array([4.0, -2.0]))
    np.testing.assert_array_equal(many, [[0.6, 0.0], [0.8, -1.0]])
    np.testing.assert_allclose(fp.unit(np.array([3.0, 0.0]), 4.0)[:, 1], [0, 1])
    with pytest.raises(ValueError, match="one shape"):
        fp.unit(np.zeros(2), np.zeros(3))


def test_entries_that_do_not_count():
    @fp.system(state="x u", params={"mu": 1.0})
    def block(t, s, p):
        n = fp.unit(s.u, 0)
        return s.u, -p.mu * n[0] + n[1]

    assert block.kinds == ("switching",)

    @fp.system(state="x u", params={"mu": 1.0})
    def never(t, s, p):
        return s.u, -p.mu * fp.unit(s.u, 1e-3)[0]

    assert never.kinds == ()
