# SPDX-License-Identifier: BSD-3-Clause
"""Problems with known answers, typed as a user would type them.

Exact numbers are written as formulas. The others are facts computed by independent programs of high
accuracy, printed with the digits that count: each tolerance is a unit of the last one.
"""

import numpy as np
import pytest

import filippov as fp

TIGHT = {"method": "dop853", "rtol": 1e-12, "atol": 1e-12}


def run(system, x0, t_span, **options):
    result = fp.simulate(system, x0, t_span, **TIGHT | options)
    assert result.status == "ok", result.message
    return result


def times(result, *kinds):
    return [e["t"] for e in result.events if e["kind"] in kinds]


def test_p1_coulomb_decay():
    @fp.system(state="x v")
    def block(t, s):
        return s.v, -s.x - 0.4 * np.sign(s.v)

    result = run(block, [3, 0], (0, 20))
    turns = np.array(times(result, "cross", "enter_sliding"))
    assert turns == pytest.approx(np.pi * np.arange(1, 5), abs=1e-10)
    assert result.sol(turns)[0] == pytest.approx([-2.2, 1.4, -0.6, -0.2], abs=1e-10)
    assert result.y[:, -1] == pytest.approx([-0.2, 0], abs=1e-10)


def test_p2_curved_surface():
    w = -2 * np.pi

    @fp.system(state="x y")
    def spiral(t, s):
        turn = np.where(np.hypot(s.x, s.y) < 1, w, -w)
        return s.x + turn * s.y, -turn * s.x + s.y

    result = run(spiral, [np.exp(-1), 0], (0, np.pi / 2))
    assert times(result, "cross") == pytest.approx([1], abs=1e-10)
    wanted = (-1.5974603774507, 0.7614936206060)
    assert result.y[:, -1] == pytest.approx(wanted, abs=1e-10)


def test_p3_surface_that_moves():
    @fp.system(state="x v", params={"V": 0.7})
    def belt(t, s, p):
        return s.v, -s.x - 0.4 * s.v + np.cos(0.7 * t) - 0.4 * np.sign(s.v - np.cos(t) - p.V)

    result = run(belt, [3, 0], (0, 30))
    assert times(result, "cross") == pytest.approx(
        [7.6055699647, 14.8051056891, 17.4589396439], abs=1e-9
    )
    assert times(result, "enter_sliding", "exit_sliding") == pytest.approx(
        [9.4833785789, 9.7652587545, 26.1316818246, 27.2911568935], abs=1e-9
    )


def test_p4_stick_slip_with_sides_that_end():
    def below(t, s, p):
        return s.x2, -s.x1 + 1 / (1.2 - s.x2)

    def above(t, s, p):
        return s.x2, -s.x1 - 1 / (0.8 + s.x2)

    block = fp.System("x1 x2", fields={"-": below, "+": above}, switch="x2 - 0.2")
    result = run(block, [0, 0], (0, 6))
    assert times(result, "enter_sliding") == pytest.approx([0.221654814176], abs=1e-11)
    assert times(result, "exit_sliding") == pytest.approx([5.113776136063], abs=1e-11)
    enters = next(e for e in result.events if e["kind"] == "enter_sliding")
    assert enters["x_right"][0] == pytest.approx(0.021575735623, abs=1e-11)
    orbit = fp.periodic_orbit(block, result)
    assert orbit.period == pytest.approx(9.230770458083, abs=1e-10)


def test_p5_friction_with_a_forcing():
    @fp.system(state="x v", params={"omega": 0.5}, period=lambda p: 2 * np.pi / p.omega)
    def block(t, s, p):
        return s.v, -s.x + np.sin(p.omega * t) - 0.4 * np.sign(s.v)

    result = run(block, [1, 2], (0, 7))
    turns = times(result, "cross")
    assert turns == pytest.approx([1.062846232871, 3.913987190289], abs=1e-11)
    assert result.sol(turns[0])[0] == pytest.approx(2.121614175528, abs=1e-11)
    sticks = times(result, "enter_sliding")
    assert sticks == pytest.approx([4.415348156986], abs=1e-11)
    assert result.sol(sticks[0])[0] == pytest.approx(0.471047029348, abs=1e-11)
    assert times(result, "exit_sliding") == pytest.approx([6.140971435234], abs=1e-11)


def relay(zeta, omega, b, constant=1.0):
    a = np.array(
        [
            [-(2 * zeta * omega + constant), 1, 0],
            [-(2 * zeta * omega * constant + omega**2), 0, 1],
            [-(omega**2) * constant, 0, 0],
        ]
    )

    @fp.system(state="x1 x2 x3")
    def feedback(t, s):
        return a @ s - np.array(b) * np.sign(s.x1)

    return feedback


def test_p6_relay_feedback():
    result = run(relay(0.05, 25, [1, -2, 1]), [0, -0.001, -0.02], (0, 3.3))
    assert result.events[0]["mode_after"] == 0
    changes = times(result, "enter_sliding", "exit_sliding")
    assert changes == pytest.approx([2.812403376, 3.041621639, 3.068976833, 3.289499164], abs=1e-8)


@pytest.mark.parametrize(
    ("zeta", "omega", "period", "slides"), [(1, 1, 8.8607064541, 2), (0.05, 8, 5.6077496932, 4)]
)
def test_p7_relay_feedback_cycles(zeta, omega, period, slides):
    s, k, r = -1, 1, 1
    system = relay(zeta, omega, [k, 2 * k * s * r, k * r**2])
    orbit = fp.periodic_orbit(system, fp.simulate(system, [0, 0.5, 0], (0, 200), **TIGHT))
    assert orbit.period == pytest.approx(period, abs=1e-9)
    assert orbit.word.count("0") == slides


def test_p8_stiff_sliding():
    @fp.system(state="x")
    def stiff(t, s):
        return -1000 * (s.x - np.cos(t)) * np.sign(s.x)

    result = run(stiff, [1], (0, 3))
    assert times(result, "enter_sliding") == pytest.approx([np.pi - np.arctan(1000)], abs=1e-10)
    assert result.y[0, -1] == 0


def test_p9_quartet():
    def one(rate):
        @fp.system(state="x")
        def system(t, s):
            return (rate(t, np.sign(s.x)),)

        return system

    crosses = run(one(lambda t, sign: 2 - sign), [-1], (0, 1))
    assert times(crosses, "cross") == pytest.approx([1 / 3], abs=1e-14)
    slides = run(one(lambda t, sign: -sign), [0], (0, 1))
    assert np.all(slides.y == 0)
    leaves = run(one(lambda t, sign: -sign + t), [0], (0, 2))
    assert times(leaves, "exit_sliding") == pytest.approx([1], abs=1e-14)
    assert leaves.y[0, -1] == pytest.approx(0.5, abs=1e-12)
    assert fp.simulate(one(lambda t, sign: sign), [0], (0, 1)).status == "ambiguous"


def test_p10_bouncing_ball():
    bounce = {"ground": ("x", lambda t, s, p: (s.x, -p.e * s.v))}

    @fp.system(state="x v", params={"e": 0.9}, jumps=bounce)
    def ball(t, s, p):
        return s.v, -9.8

    first = np.sqrt(20 / 9.8)
    rest = first * (1 + 2 * 0.9 / 0.1)
    result = run(ball, [10, 0], (0, rest + 1))
    assert times(result, "jump")[0] == pytest.approx(first, abs=1e-12)
    assert result.events[-2]["t"] == pytest.approx(rest, abs=1e-9)
    assert np.all(result.y[:, -1] == 0)


def test_p11_thermostat():
    def after(t, s, p):
        return s.y, 1 - s.q

    @fp.system(
        state="y q",
        jumps={"switch": (lambda t, s, p: s.q * (23.5 - s.y) + (1 - s.q) * (s.y - 22), after)},
    )
    def room(t, s):
        return -0.1 * (s.y - 18) + 2 * s.q, 0 * s.q

    switched = times(run(room, [15, 1], (0, 30)), "jump")
    gaps = [10 * np.log(23 / 14.5), 10 * np.log(5.5 / 4), 10 * np.log(16 / 14.5)]
    assert np.diff([0, *switched])[:3] == pytest.approx(gaps, abs=1e-10)


def test_p12_two_blocks_with_two_frictions_and_two_switches():
    @fp.system(state="x1 x2 v1 v2")
    def blocks(t, s):
        f1 = np.where(s.x1 > 0, 1, 0.6)
        f2 = np.where(s.x2 > 0, 0.2, 0.5)
        pull = s.x1 - s.x2
        return s.v1, s.v2, -pull - f1 * np.sign(s.v1), pull - f2 * np.sign(s.v2)

    assert blocks.surfaces == 4
    result = run(blocks, [-2, 3, 0, 0], (0, 12))
    x1 = blocks.switches.index("x1")
    crossed = [e["t"] for e in result.events if e["surface"] == x1 and e["kind"] == "cross"]
    assert crossed[0] == pytest.approx(1.05247882, abs=1e-8)
    v1, v2 = blocks.switches.index("v1"), blocks.switches.index("v2")
    stuck = [e["t"] for e in result.events if e["mode_after"][v1] == 0 != e["mode_before"][v1]]
    assert stuck[-1] == pytest.approx(8.82592343, abs=1e-8)
    rest = [e["t"] for e in result.events if e["mode_after"][v1] == e["mode_after"][v2] == 0]
    assert rest[0] == pytest.approx(10.81972831, abs=1e-8)
    assert result.y[:2, -1] == pytest.approx((-0.46820604, -0.05953691), abs=1e-8)


def test_p13_two_surfaces():
    @fp.system(state="x1 x2 x3", surfaces={"second": "x2 - 0.2", "third": "x3 - 0.4"})
    def blocks(t, s):
        both = (s.x2 > 0.2) & (s.x3 > 0.4)
        return (
            (s.x2 + s.x3) / 2 + np.where(both, s.x1 * (s.x2 + 0.8) * (s.x3 + 0.6), 0),
            -s.x1 + np.where(s.x2 < 0.2, 1 / (1.2 - s.x2), -1 / (0.8 + s.x2)),
            -s.x1 + np.where(s.x3 < 0.4, 1 / (1.4 - s.x3), -1 / (0.6 + s.x3)),
        )

    result = run(blocks, [0.04, -0.01, -0.02], (0, 0.7))
    hits = times(result, "enter_sliding", "enter_intersection")
    assert hits[:2] == pytest.approx([0.244330789560, 0.554993242465], abs=1e-11)


def test_p14_planar_relay():
    @fp.system(state="x1 x2")
    def plane(t, s):
        return -s.x1 + s.x2, 3 * s.x2 - 10 * np.sign(s.x1 + s.x2)

    assert abs(run(plane, [0.5, 1], (0, 3)).y[1, -1]) < 10 / 3
    lost = fp.simulate(plane, [-3.3, 3.4], (0, 200))
    assert not lost.success or abs(lost.y[1, -1]) > 1e6


def test_p15_spiral():
    @fp.system(state="x y")
    def spiral(t, s):
        x, y = np.sign(s)
        return -x + 2 * y, -2 * x - y

    result = run(spiral, [0, 1], (0, 1))
    assert np.abs(result.y[:, -1]).max() < 1e-12
    limit = [e["t"] for e in result.events if e["kind"] == "accumulation"]
    assert limit == pytest.approx([0.5], abs=1e-9)


def test_p16_what_a_user_typed():
    @fp.system(state="x v")
    def block(t, s):
        u = 1 - s.v
        mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
        return s.v, -s.x - 0.2 * s.v + 0.2 * np.cos(1.067 * t) + 10 * mu * np.sign(u)

    result = fp.simulate(block, [1, 3], (0, 20), rtol=1e-10, atol=1e-10)
    assert result.success
    # the events of README's C++ program, which is the same system
    assert times(result, "enter_sliding", "exit_sliding") == pytest.approx(
        [0.467253, 2.163577, 6.581930, 9.078314, 13.847282, 16.353385], abs=1e-6
    )


# --- many components ------------------------------------------------------------------------------


def chain(n, V=0.4):
    """Blocks of mass 1 on one belt, each joined to the next and to a wall: P13 for any number."""

    @fp.system(state=[f"{name}{k}" for k in range(n) for name in "yv"], params={"V": V})
    def blocks(t, s, p):
        y, v = s[0::2], s[1::2]
        rates = []
        for k in range(n):
            neighbours = [y[j] - y[k] for j in (k - 1, k + 1) if 0 <= j < n]
            # friction under the first one only, the others are damped
            push = 0.4 * np.sign(p.V - v[0]) if k == 0 else -0.2 * v[k]
            rates += [v[k], -y[k] + sum(neighbours) + push]
        return tuple(rates)

    return blocks


@pytest.mark.parametrize("n", [5, 8, 9, 16])  # 10, 16, 18 and 32 components
def test_more_components_than_are_compiled(n):
    many = chain(n)
    assert many.dim == 2 * n
    start = np.zeros(2 * n)
    start[0] = 0.3
    run = fp.simulate(many, start, (0, 30), method="dop853", rtol=1e-10, atol=1e-10)
    assert run.success
    assert run.y.shape[0] == 2 * n
    assert run.events.dtype["x_right"].shape == (2 * n,)
    # the same as another method, and as an ensemble of one
    other = fp.simulate(many, start, (0, 30), rtol=1e-10, atol=1e-10)
    assert run.y[:, -1] == pytest.approx(other.y[:, -1], abs=1e-7)
    crowd = fp.ensemble(many, np.column_stack([start, start]), (0, 30), rtol=1e-10, atol=1e-10)
    assert crowd.y[:, 1] == pytest.approx(run.y[:, -1], abs=1e-7)
    # linear sides: their Jacobian is exact, and has no rows of padding
    J = many.jacobian(0.0, start, 1)
    assert J.shape == (2 * n, 2 * n)
    step = 0.5 * np.arange(2 * n)
    moved = many.field(0.0, start + step, 1) - many.field(0.0, start, 1)
    assert J @ step == pytest.approx(moved, abs=1e-12)


@pytest.mark.parametrize("n", range(1, 33))
def test_every_number_of_components(n):
    @fp.system(state=[f"x{k}" for k in range(n)])
    def line(t, s, p):
        pull = -np.sign(s[0]) + 0.5 * np.sin(t)
        return (pull, *(s[k - 1] - s[k] for k in range(1, n)))

    run = fp.simulate(line, [0.5] + [0.1] * (n - 1), (0, 3))
    assert run.success
    assert run.y.shape[0] == n
    assert run.y[0, -1] == 0


@pytest.mark.parametrize("method", ["dopri5", "dop853", "rodas5p"])
@pytest.mark.parametrize("surfaces", [1, 2])
@pytest.mark.parametrize("growth", [-1, 2])
def test_padding_is_not_averaged_over(method, surfaces, growth):
    def run(n):
        @fp.system(state=[f"x{k}" for k in range(n)])
        def copies(t, s, p):
            switch = np.sign(s[0]) if surfaces == 1 else np.sign(s[0]) + np.sign(s[1] - 9)
            return tuple(2 * np.cos(3 * t) + growth * s[k] - 0.3 * switch for k in range(n))

        return fp.simulate(copies, [0.5] * n, (0, 3), method=method).t

    two = run(2)  # with one surface nothing is padded
    assert two.size > 10
    for n in (3, 5, 9, 20):
        assert run(n) == pytest.approx(two, rel=1e-6)


def test_balls_come_to_rest_with_padding_as_without():
    def rest(n):
        balls = [(f"x{k}", f"v{k}") for k in range(n)]

        @fp.system(
            state=[name for ball in balls for name in ball],
            jumps={
                "floor": ("x0", lambda t, s, p: [(1, -0.6)[k % 2] * x for k, x in enumerate(s)])
            },
        )
        def fall(t, s, p):
            return tuple(v for ball in range(n) for v in (s[2 * ball + 1], -1.0))

        run = fp.simulate(fall, [1.0, 0.0] * n, (0, 8), rtol=1e-4, atol=1e-4)
        return run.events["t"][run.events["kind"] == "accumulation"], len(run.events)

    (one,), events = rest(1)  # two components of four
    for n in (2, 3, 5):  # none of padding, six of eight, ten of sixteen
        (t,), count = rest(n)
        assert count == events
        assert t == pytest.approx(one, abs=1e-9)


def test_an_orbit_of_many_components():
    n = 5

    @fp.system(
        state=[f"{name}{k}" for k in range(n) for name in "yv"],
        params={"A": 2.0, "w": 0.9, "V": 0.4},
        period=lambda p: 2 * np.pi / p.w,
    )
    def driven(t, s, p):
        y, v = s[0::2], s[1::2]
        rates = []
        for k in range(n):
            pull = sum(y[j] - y[k] for j in (k - 1, k + 1) if 0 <= j < n)
            push = p.A * np.cos(p.w * t) + 0.4 * np.sign(p.V - v[0]) if k == 0 else 0.0
            rates += [v[k], -y[k] + pull - 0.2 * v[k] + push]
        return tuple(rates)

    orbit = fp.periodic_orbit(driven)
    assert orbit.success, orbit.message
    assert orbit.monodromy.shape == (2 * n, 2 * n)
    assert orbit.multipliers.size == 2 * n
    assert orbit.stable
    assert (np.abs(orbit.multipliers) < 1).all()  # none of padding, which would be 1
    run = orbit.trajectory(rtol=1e-11, atol=1e-12)
    assert run.y[:, -1] == pytest.approx(orbit.x0, abs=1e-8)
    # the derivative of the map, by differences
    T = orbit.period
    moved = orbit.x0 + 1e-6 * np.eye(2 * n)[3]
    ends = [
        fp.simulate(driven, x, (0, T), method="dop853", rtol=1e-12, atol=1e-12).y[:, -1]
        for x in (moved, orbit.x0)
    ]
    assert (ends[0] - ends[1]) / 1e-6 == pytest.approx(orbit.monodromy[:, 3], abs=1e-4)
