# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import filippov as fp

BOX = {"omega": (1.5, 3.2), "A": (4.0, 5.5)}
BOUNDS = tuple(BOX.values())
B1 = {"omega": 2.53542917557, "A": 4.83569011359}
B2 = {"omega": 1.33103646087, "A": 3.98676448369}


@pytest.fixture(scope="module")
def branch():
    orbit = fp.periodic_orbit(fp.models.oscillator, params={"A": 5.0, "omega": 1.6})
    return fp.continuation(orbit, "omega", (1.5, 3.2))


@pytest.fixture(scope="module")
def switching(branch):
    return fp.continuation(branch.special["switching-sliding"][0], ("omega", "A"), BOUNDS)


def test_a_switching_curve_ends_where_crossing_and_adding_curves_begin(switching):
    assert switching.kind == "switching-sliding"
    assert list(switching.param) == ["omega", "A"]
    assert switching.success
    (point,) = switching.special["degenerate-switching-sliding"]
    assert point.param == pytest.approx(B1, abs=1e-10)
    assert abs(point.conditions["L2'"]) < 1e-10
    assert point.conditions["L2''"] < 0
    assert sorted(c.kind for c in switching.connected) == ["adding-sliding", "crossing-sliding"]
    for curve in switching.connected:
        starts = [(v[0], v[-1]) for v in curve.param.values()]
        at = [
            any(v == pytest.approx(b, abs=1e-9) for v in s)
            for s, b in zip(starts, B1.values(), strict=True)
        ]
        assert all(at)


def test_points_of_a_curve_bifurcate(switching):
    # on the boundary s = +1 at the entry: -y + A cos(phi) = 4, the entry node has L2 = 0
    k = len(switching) // 2
    events = switching.events[switching.events["point"] == k]
    entry = events[events["kind"] == "enter_sliding"]
    assert entry["s"] == pytest.approx(1, abs=1e-10)
    # on one side of it the orbit crosses before it slides, on the other it does not
    at = {name: float(values[k]) for name, values in switching.param.items()}
    words = [
        fp.periodic_orbit(fp.models.oscillator, params=at | {"omega": at["omega"] + shift}).word
        for shift in (-0.01, 0.01)
    ]
    assert words == ["0-+", "0-"]


def test_folds_meet_in_a_cusp():
    orbit = fp.periodic_orbit(fp.models.oscillator, params={"A": 3.6, "omega": 1.067})
    branch = fp.continuation(orbit, "omega", (0.9, 1.3))
    folds = branch.special["fold"]
    assert len(folds) == 2
    curve = fp.continuation(folds[0], ("omega", "A"), ((0.9, 1.6), (2.5, 5.0)))
    (cusp,) = curve.special["cusp"]
    assert cusp.param == pytest.approx(B2, abs=1e-10)
    # one multiplier is 1 all along
    assert np.abs(curve.multipliers - 1).min(axis=1).max() < 1e-8


def test_a_rectangle_is_explored_from_the_model_alone(tmp_path):
    told = []
    found = fp.bifurcation_set(fp.models.oscillator, BOX, progress=lambda *at: told.append(at))
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert told[0] == (0, 9)
    assert told[-1][0] == told[-1][1] > 9
    kinds = sorted(curve.kind for curve in found.curves)
    assert kinds == ["adding-sliding", "crossing-sliding", "crossing-sliding", "switching-sliding"]
    (point,) = found.specials
    assert point.param == pytest.approx(B1, abs=1e-10)
    assert found.failed_starts == 0
    assert found.corrections < 100_000

    found.save(tmp_path / "set.npz")
    again = fp.load(tmp_path / "set.npz")
    for a, b in zip(found.curves, again.curves, strict=True):
        assert (a.kind, a.ends, a.bounds) == (b.kind, b.ends, b.bounds)
        for name in a.param:
            assert np.array_equal(a.param[name], b.param[name])
    assert repr(again) == repr(found)


def test_orbits_of_a_rectangle_are_looked_for_where_it_is_asked():
    @fp.system(
        state="prey predator",
        params={"alpha": 0.6, "e": 0.2},
        surfaces={"threshold": "predator - alpha"},
    )
    def fishery(t, s, p):
        caught = s.prey / (0.4 + s.prey) * s.predator
        harvest = np.where(s.predator > p.alpha, p.e * s.predator, 0)
        return s.prey * (1 - s.prey) - caught, caught - 0.25 * s.predator - harvest

    box = {"alpha": (0.8, 1.2), "e": (0.15, 0.25)}
    found = fp.bifurcation_set(fishery, box, x0=[0.5, 0.3], lines=1, starts=1)
    assert "grazing-sliding" in {curve.kind for curve in found.curves}
    # The origin is an equilibrium: nothing is met from there.
    none = fp.bifurcation_set(fishery, box, lines=1, starts=1)
    assert not none.curves
    with pytest.raises(ValueError, match="x0"):
        fp.bifurcation_set(fishery, box, x0=[0.5])


def test_a_curve_is_saved_with_what_is_connected(switching, tmp_path):
    switching.save(tmp_path / "curve.npz")
    again = fp.load(tmp_path / "curve.npz")
    assert [c.kind for c in again.connected] == [c.kind for c in switching.connected]
    assert np.array_equal(again.connected[0].param["A"], switching.connected[0].param["A"])


def test_curves_are_drawn_in_the_plane_of_their_parameters(switching):
    plt = pytest.importorskip("matplotlib.pyplot")
    _, ax = plt.subplots()
    artists = switching.plot(ax)
    assert len(artists) >= 4  # three curves and the point
    assert ax.get_xlabel() == "omega"
    assert ax.get_ylabel() == "A"
    plt.close("all")


def test_xarray_has_both_parameters(switching):
    pytest.importorskip("xarray")
    data = switching.to_xarray()
    assert data["A"].shape == data["omega"].shape == (len(switching),)
    assert data.attrs["kind"] == "switching-sliding"


def test_mistakes_are_refused_before_any_work(branch):
    point = branch.specials[0]
    with pytest.raises(ValueError, match="two different names"):
        fp.continuation(point, ("omega", "omega"), BOUNDS)
    with pytest.raises(ValueError, match="two different names"):
        fp.continuation(point, ("omega", "nothing"), BOUNDS)
    with pytest.raises(ValueError, match="two pairs"):
        fp.continuation(point, ("omega", "A"), 1.0)
    with pytest.raises(ValueError, match=r"bounds\[1\]"):
        fp.continuation(point, ("omega", "A"), ((1.5, 3.2), (6.0, 7.0)))
    with pytest.raises(TypeError, match="SpecialPoint"):
        fp.continuation(point.orbit, ("omega", "A"), BOUNDS)
    with pytest.raises(ValueError, match="two different names"):
        fp.bifurcation_set(fp.models.oscillator, {"omega": (1, 2)})
    with pytest.raises(ValueError, match="low < high"):
        fp.bifurcation_set(fp.models.oscillator, {"omega": (2, 1), "A": (4, 5)})
    with pytest.raises(ValueError, match="one surface"):
        fp.bifurcation_set(fp.models.dieci_lopez_2, {"omega": (1, 2), "A": (4, 5)})
