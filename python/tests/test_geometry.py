# SPDX-License-Identifier: BSD-3-Clause
"""Tangencies, boundaries of the sliding region and equilibria, against closed forms."""

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator
BOX = {"y": (-12, 12), "v": (-1, 3)}
FREE = BLOCK.with_params(A=0)
STILL = BLOCK.with_params(A=2.0, omega=0.5, V=0.0)
STEP = {"x1": (-3, 3), "x2": (-0.7, 0.7)}
STRAIGHT = {"x": (-3, 3), "v": (-1, 1)}


# --- tangencies -----------------------------------------------------------------------------------


@pytest.mark.parametrize("t", [0.0, 0.9, 1.7])
@pytest.mark.parametrize("A", [0.5, 5.0])
def test_tangencies_of_the_block_are_those_of_the_closed_form(t, A):
    omega, V = BLOCK.params.omega, BLOCK.params.V
    found = fp.tangencies(BLOCK, t, bounds=BOX, params={"A": A})
    assert [each.side for each in found] == [-1, 1]
    second = -V - A * omega * np.sin(omega * t)  # along both fields, where v' = 0
    for each in found:
        ends = A * np.cos(omega * t) - 4 * each.side
        assert each.x == pytest.approx((ends, V), abs=1e-13)
        assert each.t == t
        assert each.second == pytest.approx(second, abs=1e-12)
        assert each.visible == (each.side * second > 0)
        assert each.attracting
        assert each.other == pytest.approx(8 * each.side)
        assert each.drift == pytest.approx(each.side * second / 4)  # s = (A cos - y) / 4


def test_a_visible_tangency_is_one_that_slips_on_its_side_touch():
    for each in fp.tangencies(BLOCK, 0.2, bounds=BOX):
        point = np.array(each.x)
        e = 1e-4
        f = BLOCK.field(each.t, point, each.side)
        later = BLOCK.field(each.t + e, point + e * f, each.side)
        # two steps of second order, there and back: h = h'' e^2/2
        ahead = point + e / 2 * (f + later)
        assert (BLOCK.h(each.t + e, ahead) * each.side > 0) == each.visible


def test_tangencies_of_a_surface_that_moves():
    belt = fp.models.varying_belt
    box = {"x": (-3, 3), "v": (-3, 3)}
    for t in (0.0, 1.0, 2.5):
        found = fp.tangencies(belt, t, bounds=box)
        assert len(found) == 2
        for each in found:
            point = np.array(each.x)
            components = belt.normal_components(t, point)
            which = (each.side + 1) // 2
            assert belt.h(t, point) == pytest.approx(0, abs=1e-14)
            assert components[which] == pytest.approx(0, abs=1e-13)
            assert components[1 - which] == pytest.approx(each.other)
            # h'' by differences of L along the field, rounding 1e-16/e and curvature e^2
            e = 1e-5
            f = belt.field(t, point, each.side)
            ahead = belt.normal_components(t + e, point + e * f)[which]
            behind = belt.normal_components(t - e, point - e * f)[which]
            assert (ahead - behind) / (2 * e) == pytest.approx(each.second, abs=1e-8)


def test_a_side_alone_and_a_box_without_any():
    both = fp.tangencies(BLOCK, bounds=BOX)
    assert fp.tangencies(BLOCK, bounds=BOX, side=-1) == both[:1]
    assert fp.tangencies(BLOCK, bounds=BOX, side=1) == both[1:]
    assert fp.tangencies(BLOCK, bounds={"y": (-1, 1), "v": (0, 2)}) == []
    # a surface along the edge of the box is inside
    assert fp.tangencies(BLOCK, bounds={"y": (-12, 12), "v": (1, 3)}) == both


def test_in_three_dimensions_some_points_of_each_line():
    box = {"x1": (-1, 1), "x2": (-3, 3), "x3": (-3, 3)}
    found = fp.tangencies(fp.models.relay, bounds=box)
    assert len(found) > 2
    for each in found:  # x1' = x2 - sign(x1) on x1 = 0
        assert each.x[:2] == pytest.approx((0, each.side), abs=1e-13)


def test_a_sliding_region_knows_what_its_ends_are():
    region = fp.sliding_region(BLOCK, 0.4, bounds=BOX)
    expected = fp.tangencies(BLOCK, 0.4, bounds=BOX)
    ends = sorted(region.tangencies, key=lambda each: each.side)
    assert [end.side for end in ends] == [-1, 1]
    for end, tangency in zip(ends, expected, strict=True):
        assert end.x == pytest.approx(tangency.x, abs=1e-12)
        assert end.visible == tangency.visible
        assert end.drift == pytest.approx(tangency.drift, abs=1e-11)
    np.testing.assert_array_equal(region.boundary, np.array([end.x for end in region.tangencies]).T)
    nothing = fp.sliding_region(BLOCK, bounds={"y": (-1, 1), "v": (0, 2)})
    assert nothing.tangencies == ()


# --- boundaries -----------------------------------------------------------------------------------


def test_boundaries_on_a_belt_at_rest_in_closed_form():
    below, above = fp.sliding_boundaries(STILL, bounds=BOX, samples=100)
    omega, A = 0.5, 2.0
    for boundary, side in ((below, -1), (above, 1)):
        assert boundary.side == side
        assert boundary.success, boundary.message
        assert boundary.x.shape == (2, 101)
        np.testing.assert_allclose(boundary.phase, omega * boundary.t, atol=1e-14)
        assert boundary.phase[-1] == pytest.approx(2 * np.pi)
        np.testing.assert_allclose(boundary.x[0], A * np.cos(boundary.phase) - 4 * side, atol=1e-13)
        np.testing.assert_allclose(boundary.x[1], 0, atol=1e-14)
        # s = (A cos(omega t) - y) / 4 at rest
        rate = -side * A * omega * np.sin(boundary.phase) / 4
        np.testing.assert_allclose(boundary.drift, rate, atol=1e-12)
        assert boundary.attracting.all()
        clear = np.abs(rate) > 1e-9
        np.testing.assert_array_equal(boundary.visible[clear], (rate > 0)[clear])
        # one of them where the period begins and ends
        phases = [omega * each.t for each in boundary.tangential]
        assert phases == pytest.approx([0, np.pi], abs=1e-12)


def test_a_weak_forcing_has_no_tangential_slides():
    # 1 + A omega sin(phase) = 0 has roots for A omega > 1
    for A, count in ((0.3, 0), (0.5, 2)):
        for boundary in fp.sliding_boundaries(BLOCK, bounds=BOX, params={"A": A}):
            assert len(boundary.tangential) == count
            for each in boundary.tangential:
                sine = np.sin(BLOCK.params.omega * each.t)
                assert 1 + A * BLOCK.params.omega * sine == pytest.approx(0, abs=1e-12)


def test_slides_end_at_solid_parts_of_the_boundary():
    run = fp.simulate(BLOCK, [0, 0], (0, 60), method="dop853", rtol=1e-11, atol=1e-12)
    exits = run.events[run.events["kind"] == fp.EventKind.exit_sliding]
    assert exits.size > 5
    curves = {b.side: b for b in fp.sliding_boundaries(BLOCK, bounds=BOX, samples=4000)}
    for event in exits:
        boundary = curves[round(event["s"])]
        phase = event["t"] * BLOCK.params.omega % (2 * np.pi)
        y = np.interp(phase, boundary.phase, boundary.x[0])
        assert y == pytest.approx(event["x_left"][0], abs=1e-6)  # chord of 4000
        assert np.interp(phase, boundary.phase, boundary.drift) > 0


def test_a_picture_of_a_boundary():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots()
    below, above = fp.sliding_boundaries(BLOCK, bounds=BOX)
    solid, dashed, points = below.plot(ax)
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    x, y = solid.get_data()
    drawn = np.isfinite(y)
    assert (1 + 0.5 * 2.94 * np.sin(x[drawn]) > -1e-9).all()
    assert np.isfinite(dashed.get_ydata()).sum() + drawn.sum() == below.t.size + 4
    np.testing.assert_allclose(points.get_xdata(), [each.t * 2.94 for each in below.tangential])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("phase (rad)", "y")
    assert len(above.plot(ax, y="v", color="red")) == 3
    with pytest.raises(ValueError, match="y = 'z': expected one of 'y', 'v'"):
        below.plot(ax, y="z")
    plt.close(figure)


# --- equilibria -----------------------------------------------------------------------------------


def test_the_block_without_a_forcing():
    below, beyond = fp.equilibria(FREE, bounds=BOX)
    friction = 10 * (0.3 / 2.42 + 0.1 + 0.01)
    assert below.kind == "regular"
    assert below.side == -1
    assert below.real
    assert below.x == pytest.approx((friction, 0), abs=1e-13)
    # falling friction feeds the oscillation: x'' = -x + g |mu'(1)| x'
    trace = 10 * (0.3 * 1.42 / 2.42**2 - 0.02)
    expected = np.roots([1, -trace, 1])
    assert np.sort_complex(below.eigenvalues) == pytest.approx(np.sort_complex(expected))
    assert not below.stable
    assert (beyond.side, beyond.real) == (1, False)
    rising = fp.equilibria(FREE, bounds=BOX, params={"gamma": 0})[0]
    assert rising.stable


def test_a_run_goes_to_a_stable_equilibrium():
    system = FREE.with_params(gamma=0, eta=0.2)
    rest = fp.equilibria(system, bounds=BOX)[0]
    assert rest.stable
    run = fp.simulate(system, [rest.x[0] + 0.1, 0], (0, 400), rtol=1e-10, atol=1e-12)
    assert run.y[:, -1] == pytest.approx(rest.x, abs=1e-8)


def test_the_pseudo_equilibrium_of_a_relay_has_the_zeros_of_its_transfer_function():
    box = {"x1": (-1, 1), "x2": (-3, 3), "x3": (-3, 3)}
    found = fp.equilibria(fp.models.relay, bounds=box)
    (pseudo,) = (each for each in found if each.kind == "pseudo")
    assert pseudo.x == pytest.approx((0, 0, 0), abs=1e-14)
    assert pseudo.s == pytest.approx(0, abs=1e-14)
    assert pseudo.real
    assert pseudo.attracting
    # z^2 - 2 z + 1: a double root, so 1e-8 of rounding's 1e-16
    assert pseudo.eigenvalues == pytest.approx([1, 1], abs=1e-6)
    assert not pseudo.stable
    # x1 = 1/omega^2 for u = 1, which is for x1 < 0
    assert not any(each.real for each in found if each.kind == "regular")


def test_on_a_line_a_pseudo_equilibrium_is_stable_where_sliding_attracts():
    # x' = c - b sign x rests at 0 with s = c/b
    line = fp.models.quartet
    for c, b in ((0.3, 1.0), (0.3, -1.0), (2.0, 1.0)):
        (rest,) = fp.equilibria(line, bounds={"x": (-1, 2)}, params={"c": c, "d": 0, "b": b})
        assert (rest.kind, rest.x) == ("pseudo", (0,))
        assert rest.s == pytest.approx(c / b)
        assert rest.real == (abs(c / b) < 1)
        assert rest.attracting == (b > 0)
        assert rest.stable == (rest.real and b > 0)
        assert rest.eigenvalues == ()


def test_boundary_equilibria_of_dieci_and_lopez():
    found = fp.boundary_equilibria(fp.models.dieci_lopez, "v", (-0.4, 0.6), bounds=STEP)
    assert [each.side for each in found] == [-1, 1]
    for each in found:
        assert each.kind == "boundary"
        assert each.param["v"] == pytest.approx(0, abs=1e-13)
        assert each.x == pytest.approx((-each.side, 0), abs=1e-13)
        # x1' = x2 = v on the surface: at v = 0 all of it rests
        assert each.encounter == "degenerate"
        assert len(each.eigenvalues) == 2
        assert not each.stable
    assert fp.boundary_equilibria(fp.models.dieci_lopez, "v", (0.1, 0.6), bounds=STEP) == []


# --- mistakes and signals -------------------------------------------------------------------------

ONE = "expected a System with one surface"
MISTAKES = [
    (fp.tangencies, {"sys": "block"}, TypeError, ONE),
    (fp.tangencies, {"sys": fp.models.dieci_lopez_2}, ValueError, ONE),
    (fp.tangencies, {"t": np.nan}, ValueError, "t = nan"),
    (fp.tangencies, {"side": 0}, ValueError, "side = 0: expected -1 or \\+1"),
    (fp.tangencies, {"bounds": {"y": (0, 1)}}, ValueError, "'v': \\(low, high\\)"),
    (fp.tangencies, {"bounds": [(0, 1)]}, TypeError, "expected a mapping"),
    (fp.tangencies, {"bounds": BOX | {"v": (1, 1)}}, ValueError, "expected low < high"),
    (fp.tangencies, {"bounds": BOX | {"v": (0, np.nan)}}, ValueError, "bounds\\['v'\\] = nan"),
    (fp.tangencies, {"bounds": BOX | {"v": (0, np.inf)}}, ValueError, "bounds\\['v'\\] = inf"),
    (fp.tangencies, {"bounds": BOX | {"v": (0, 1, 50)}}, ValueError, "expected \\(low, high\\)$"),
    (fp.tangencies, {"bounds": BOX | {"v": 3}}, TypeError, "bounds\\['v'\\] = 3"),
    (fp.tangencies, {"seeds": 0}, ValueError, "seeds = 0"),
    (fp.tangencies, {"seeds": 10**7}, ValueError, "seeds = 10000000"),
    (fp.tangencies, {"params": {"A": np.nan}}, ValueError, "params\\['A'\\] = nan"),
    (fp.sliding_boundaries, {"sys": fp.models.dieci_lopez}, ValueError, "a forced planar System"),
    (fp.sliding_boundaries, {"sys": fp.models.stiction}, ValueError, "without static friction"),
    (fp.sliding_boundaries, {"samples": 3}, ValueError, "samples = 3"),
    (fp.sliding_boundaries, {"bounds": {}}, ValueError, "bounds = {}"),
    (fp.equilibria, {}, ValueError, "'oscillator': expected an autonomous system"),
    (fp.equilibria, {"sys": FREE, "seeds": 1.5}, TypeError, "seeds = 1.5"),
    (fp.equilibria, {"sys": fp.models.varying_belt, "bounds": STRAIGHT}, ValueError, "autonomous"),
    (fp.boundary_equilibria, {"parameter": "B"}, ValueError, "parameter = 'B': expected one of A"),
    (
        fp.boundary_equilibria,
        {"span": (1, 0)},
        ValueError,
        "span = \\(1, 0\\): expected low < high",
    ),
    (fp.boundary_equilibria, {"span": (0, np.nan)}, ValueError, "span = nan"),
    (fp.boundary_equilibria, {"span": 1}, TypeError, "span = 1: expected \\(low, high\\)"),
    (fp.boundary_equilibria, {"span": (0, 1, 2)}, ValueError, "span = \\(0, 1, 2\\)"),
    (fp.boundary_equilibria, {"parameter": "A"}, ValueError, "expected an autonomous system"),
]


@pytest.mark.parametrize(("function", "arguments", "error", "words"), MISTAKES)
def test_wrong_arguments_are_named(function, arguments, error, words):
    given = {"sys": BLOCK, "bounds": BOX} | arguments
    if function is fp.boundary_equilibria:
        given = {"sys": FREE, "parameter": "V", "span": (0.0, 1.0)} | given | {"sys": FREE}
    with pytest.raises(error, match=words):
        function(**given)


@pytest.mark.parametrize(
    "call",
    [
        "fp.tangencies(fp.models.relay, bounds=dict.fromkeys(['x1', 'x2', 'x3'], (-1, 1)),"
        " seeds=10**6)",
        "fp.sliding_boundaries(fp.models.oscillator, bounds={'y': (-9, 9), 'v': (0, 2)},"
        " samples=10**6)",
        "fp.equilibria(fp.models.relay, bounds=dict.fromkeys(['x1', 'x2', 'x3'], (-1, 1)),"
        " seeds=10**6)",
        "fp.strobe_map(fp.models.oscillator, [0, 0], iterate=10**6)",
        "fp.section_map(fp.models.oscillator, [0, 0], iterate=10**6)",
    ],
)
def test_ctrl_c_stops_at_once(ctrl_c, call):
    ctrl_c(f"""
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    sys.exit(7)
""")
