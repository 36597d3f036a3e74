# SPDX-License-Identifier: BSD-3-Clause
"""Strobe and section maps, against closed forms and differences of runs."""

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator.with_params(A=3.6, omega=1.067)
COULOMB = fp.models.coulomb.with_params(a=0.0, mu=0.4)
CYCLE = fp.models.dieci_lopez
TIGHT = {"method": "dop853", "rtol": 1e-13, "atol": 1e-13}


def strobed(x0, t0, params, iterate=1):
    T = BLOCK.period(params)
    run = fp.simulate(BLOCK, x0, (t0, t0 + iterate * T), params=params, **TIGHT)
    assert run.success
    return np.append(run.y[:, -1], run.t[-1])


def differences(f, at, e=1e-6):
    columns = [(f(at + e * unit) - f(at - e * unit)) / (2 * e) for unit in np.eye(len(at))]
    return np.array(columns).T


# --- strobe ---------------------------------------------------------------------------------------


def test_the_strobe_map_is_that_of_runs_and_their_differences():
    start = np.array([-0.7, 0.2, 0.3])
    m = fp.strobe_map(BLOCK, start[:2], t0=start[2], iterate=2)
    assert (m.status, m.message) == ("ok", "")
    expected = strobed(start[:2], start[2], {}, 2)
    np.testing.assert_allclose(np.append(m.x, m.t), expected, atol=1e-10)
    numeric = differences(lambda z: strobed(z[:2], z[2], {}, 2), start)
    np.testing.assert_allclose(m.slope, numeric, atol=5e-6)  # rounding of 1e-12/e
    assert m.slides >= 1
    assert m.word.count("0") == m.slides
    assert not m.singular


def test_slopes_by_any_number_of_parameters():
    start, names = [-0.7, 0.2], ["omega", "V", "A"]
    m = fp.strobe_map(BLOCK, start, t0=0.3, wrt=names)
    assert list(m.param_slope) == names

    def at(values):
        return strobed(start, 0.3, dict(zip(names, values, strict=True)))

    numeric = differences(at, np.array([BLOCK.params[name] for name in names]))
    for k, name in enumerate(names):
        assert m.param_slope[name].shape == (3,)
        np.testing.assert_allclose(m.param_slope[name], numeric[:, k], atol=5e-6)
    # the strobe moves with the period, 2 pi/omega
    assert m.param_slope["omega"][2] == pytest.approx(-2 * np.pi / 1.067**2)
    assert fp.strobe_map(BLOCK, start, t0=0.3, wrt="A").param_slope["A"] == pytest.approx(
        m.param_slope["A"]
    )


def test_an_orbit_is_a_fixed_point_with_its_monodromy_matrix():
    orbit = fp.periodic_orbit(BLOCK, params={"A": 5, "omega": 1.72})
    m = fp.strobe_map(BLOCK, orbit.x0, t0=orbit.t0, params={"A": 5, "omega": 1.72})
    np.testing.assert_allclose(m.x, orbit.x0, atol=1e-10)
    multipliers = np.linalg.eigvals(m.slope[:2, :2])
    assert np.abs(multipliers).max() == pytest.approx(np.abs(orbit.multipliers).max(), rel=1e-8)


def test_repr_is_a_line_that_says_where():
    one = fp.strobe_map(BLOCK, [0, 0], params={"A": 0.5, "omega": 2.94})
    assert repr(one).startswith("<Mapped of oscillator: x [")
    assert repr(one).endswith(f"t {one.t:.9g}, word {one.word}>")
    assert repr(fp.strobe_map(BLOCK, np.zeros((2, 3)))) == "<Mapped of oscillator: 3 starts>"


def test_many_starts_are_each_on_its_own():
    rng = np.random.default_rng(3)
    starts, times = rng.uniform(-2, 2, (2, 7)), rng.uniform(0, 5, 7)
    many = fp.strobe_map(BLOCK, starts, t0=times, wrt=("V", "A", "m"))
    assert many.x.shape == (2, 7)
    assert many.slope.shape == (3, 3, 7)
    assert many.status == ("ok",) * 7
    for k in range(7):
        one = fp.strobe_map(BLOCK, starts[:, k], t0=times[k], wrt=("V", "A", "m"))
        np.testing.assert_array_equal(many.x[:, k], one.x)
        np.testing.assert_array_equal(many.slope[..., k], one.slope)
        np.testing.assert_array_equal(many.param_slope["m"][:, k], one.param_slope["m"])
        assert (many.t[k], many.word[k], many.slides[k]) == (one.t, one.word, one.slides)
    along = fp.strobe_map(BLOCK, starts[:, 0], t0=times)  # one state, several times
    np.testing.assert_array_equal(along.x[:, 0], many.x[:, 0])
    assert along.x.shape == (2, 7)
    assert fp.strobe_map(BLOCK, np.empty((2, 0))).slope.shape == (3, 3, 0)


def test_a_slip_that_touches_the_surface_has_no_slope():
    # back from a visible tangency along its own side, then forth again
    (edge,) = fp.tangencies(BLOCK, 1.0, bounds={"y": (-9, 9), "v": (0, 2)}, side=-1)
    assert edge.visible
    back = fp.simulate(BLOCK, edge.x, (1.0, 0.6), on_nonunique="below", **TIGHT)
    assert back.y[1, -1] < BLOCK.params.V
    m = fp.strobe_map(BLOCK, back.y[:, -1], t0=0.6)
    assert m.singular
    assert m.success
    assert np.isnan(m.slope).all()
    assert np.isfinite(m.x).all()


# --- section --------------------------------------------------------------------------------------


def half_turn(x0, v0, mu):
    """The reversal of a block with v0 < 0, and when, by the circle about (mu, 0)."""
    u, R = x0 - mu, np.hypot(x0 - mu, v0)
    return np.array([mu - R, 0.0, np.pi - np.arctan2(-v0, u)])


def test_reversals_of_coulomb_friction_in_closed_form():
    x0, v0, mu = 3.0, -0.5, 0.4
    m = fp.section_map(COULOMB, [x0, v0], "cross", wrt="mu")
    assert m.success, m.message
    np.testing.assert_allclose(np.append(m.x, m.t), half_turn(x0, v0, mu), atol=1e-11)
    u, R = x0 - mu, np.hypot(x0 - mu, v0)
    slope = [[-u / R, -v0 / R, 0], [0, 0, 0], [-v0 / R**2, u / R**2, 1]]
    np.testing.assert_allclose(m.slope, slope, atol=1e-10)
    np.testing.assert_allclose(m.param_slope["mu"], [1 + u / R, 0, v0 / R**2], atol=1e-10)
    assert (m.word, m.slides) == ("-+", 0)


def test_iterates_and_statuses_of_a_block_that_comes_to_rest():
    # problem P1: reversals at k pi, x = -2.2, 1.4, -0.6, then rest
    for k, x in ((1, -2.2), (2, 1.4), (3, -0.6)):
        m = fp.section_map(COULOMB, [3, 0], "cross", iterate=k)
        np.testing.assert_allclose(np.append(m.x, m.t), [x, 0, k * np.pi], atol=1e-10)
    rest = fp.section_map(COULOMB, [3, 0], "enter_sliding")
    np.testing.assert_allclose(np.append(rest.x, rest.t), [0.2 * -1, 0, 4 * np.pi], atol=1e-10)

    several = fp.section_map(COULOMB, [[3, 0.1], [0, 0]], "cross", max_time=20.0)
    assert several.status == ("ok", "escaped")
    assert not several.success
    assert "cross" in several.message[1]
    assert several.message[0] == ""
    assert np.isnan(several.slope[..., 1]).all()
    assert np.isfinite(several.slope[..., 0]).all()
    np.testing.assert_array_equal(several.x[:, 1], [0.1, 0])


def test_after_chooses_the_mode_behind_the_event():
    up = fp.section_map(COULOMB, [3, 0], "cross", after=1)
    down = fp.section_map(COULOMB, [3, 0], "cross", after=-1)
    assert (up.t, down.t) == pytest.approx((np.pi, 2 * np.pi))


def test_the_cycle_of_dieci_and_lopez_returns_after_its_period():
    first = fp.section_map(CYCLE, [0, 0], iterate=2)
    again = fp.section_map(CYCLE, first.x, t0=first.t, wrt="v")
    np.testing.assert_allclose(again.x, first.x, atol=1e-11)
    assert again.t - first.t == pytest.approx(9.230770458083, abs=1e-10)

    # exits are at (1, v) whatever the start: the derivative of the period is that of the time
    def period(v):
        start = np.array([1.0, v])
        return fp.section_map(CYCLE, start, params={"v": v}).t

    numeric = (period(0.2 + 1e-5) - period(0.2 - 1e-5)) / 2e-5
    total = again.param_slope["v"][2] + again.slope[2, 1]  # the start moves with v, too
    assert total == pytest.approx(numeric, abs=1e-6)
    np.testing.assert_allclose(again.param_slope["v"][:2], [0, 1], atol=1e-9)


# --- mistakes -------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", [fp.strobe_map, fp.section_map])
@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"sys": 1}, TypeError, "sys = 1: expected a System"),
        ({"x0": [0]}, ValueError, "x0 = .*\\(y, v\\), got shape \\(1,\\)"),
        ({"x0": [0, np.nan]}, ValueError, "x0 = \\[0, nan\\]: expected finite"),
        ({"x0": [0, 1j]}, TypeError, "x0 = "),
        ({"x0": "ab"}, TypeError, "x0 = 'ab'"),
        ({"x0": np.zeros((2, 2, 2))}, ValueError, "got shape \\(2, 2, 2\\)"),
        ({"t0": np.inf}, ValueError, "t0 = inf"),
        ({"t0": [[0.0]]}, ValueError, "t0 = "),
        ({"x0": np.zeros((2, 3)), "t0": [0, 1]}, ValueError, "one for each of 3 starts"),
        ({"iterate": 0}, ValueError, "iterate = 0"),
        ({"iterate": 10**7}, ValueError, "iterate = 10000000"),
        ({"params": {"A": np.nan}}, ValueError, "params\\['A'\\] = nan"),
        ({"params": {"B": 1}}, ValueError, "no parameter 'B'"),
        ({"wrt": "B"}, ValueError, "wrt = 'B': expected names among A"),
        ({"wrt": 3}, TypeError, "wrt = 3: expected names among A"),
        ({"wrt": None}, TypeError, "wrt = None: expected names among A"),
        ({"wrt": [["A"]]}, ValueError, "wrt = \\[\\['A'\\]\\]: expected names among A"),
        ({"wrt": ("A", "A")}, ValueError, "expected each name once"),
        ({"rtol": 1.0}, ValueError, "rtol = 1.0"),
        ({"atol": np.nan}, ValueError, "atol = nan"),
    ],
)
def test_wrong_arguments_are_named(function, arguments, error, words):
    with pytest.raises(error, match=words):
        function(**({"sys": BLOCK, "x0": [0, 0]} | arguments))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"section": "graze"}, "section = 'graze': expected one of 'cross'"),
        ({"section": "strobe"}, "section = 'strobe'"),
        ({"after": 2}, "after = 2"),
        ({"max_time": 0}, "max_time = 0"),
        ({"max_time": np.nan}, "max_time = nan"),
    ],
)
def test_wrong_sections_are_named(arguments, words):
    with pytest.raises(ValueError, match=words):
        fp.section_map(BLOCK, [0, 0], **arguments)


def test_no_forcing_no_strobe():
    with pytest.raises(ValueError, match="'dieci_lopez': expected a forced System"):
        fp.strobe_map(CYCLE, [0, 0])


def test_no_starts_have_no_images():
    for call in (fp.strobe_map, fp.section_map):
        none = call(fp.models.oscillator, np.zeros((2, 0)), wrt="A")
        assert none.x.shape == (2, 0)
        assert none.param_slope["A"].shape == (3, 0)
        assert "0 starts" in repr(none)


def test_a_flash_at_which_the_clock_jumps_sees_what_comes_after():
    # the clock is set back by a constant, and so drifts across the flash by rounding
    for rate, T in ((3.0, 0.1), (0.1, 0.1), (1.0, 0.7)):
        turn = rate * T

        @fp.system(
            state="x q tau",
            period=T,
            jumps={"clock": (f"{turn!r} - tau", lambda t, s, p: (s.x, 1, s.tau - turn))},
        )
        def ticking(t, s, p):
            return s.q - s.x, 0, rate  # noqa: B023

        x = np.array([0.0, 1, 0])
        for _ in range(25):
            image = fp.strobe_map(ticking, x, iterate=7)
            assert image.success
            x = image.x
            assert abs(x[2]) < 1e-9 * turn
            assert image.slope[2, 2] == pytest.approx(1, abs=1e-12)
