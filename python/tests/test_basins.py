# SPDX-License-Identifier: BSD-3-Clause
import dataclasses
import pickle
import warnings

import matplotlib.pyplot as plt
import numpy as np
import pytest

import filippov as fp

OSCILLATOR = fp.models.oscillator
SEED = {"A": 3.6, "omega": 1.067}


def picture(n):
    return {"y": (-4.0, 4.0, n), "v": (-3.0, 4.0, n)}


@pytest.fixture(scope="module")
def seed():
    return fp.basins(OSCILLATOR, picture(60), params=SEED)


def test_two_attractors_and_a_saddle(seed):
    assert [a.period for a in seed.attractors] == [1, 1]
    assert [s.period for s in seed.saddles] == [1]
    # the starts of figure 4.16, read off a picture
    for found, printed in zip(
        (*seed.attractors, *seed.saddles),
        ((-0.685, 3.01), (-0.295, 0.99), (-0.445, 1.27)),
        strict=True,
    ):
        np.testing.assert_allclose(found.points[:, 0], printed, atol=0.02)
        image = fp.strobe_map(OSCILLATOR, found.points[:, 0], params=SEED).x
        np.testing.assert_allclose(image, found.points[:, 0], atol=1e-11)
        assert abs(found.multipliers[-1]) < 1e-9  # a slide costs a dimension
    assert all(abs(a.multipliers[0]) < 1 for a in seed.attractors)
    assert abs(seed.saddles[0].multipliers[0]) > 1


def test_labels_are_those_of_long_runs(seed):
    random = np.random.default_rng(1)
    cells = random.integers(0, 60, size=(2, 60))
    y, v = (seed.grid.centres(k)[cells[k]] for k in (0, 1))
    end = fp.ensemble(
        OSCILLATOR, [y, v], (0.0, 80 * seed.period), params=SEED, rtol=1e-10, atol=1e-12
    )
    for k in range(cells.shape[1]):
        gaps = [np.abs(a.points[:, 0] - end.y[:, k]).max() for a in seed.attractors]
        assert min(gaps) < 1e-6
        assert seed.label[tuple(cells[:, k])] == 1 + int(np.argmin(gaps))


def test_nothing_is_left_open(seed):
    assert seed.unresolved.size == 0
    assert seed.disagreements == 0
    assert seed.audited == 500
    assert sum(seed.fractions.values()) == pytest.approx(1.0)
    assert (seed.time >= 0).all()


def test_the_confusion_table_counts_every_cell(seed):
    table = np.array([row.cells for row in seed.confusion])
    assert table.sum() == seed.label.size
    assert [row.group for row in seed.confusion][-2:] == [-1, -2]
    stand_ins = sorted(row.attractor for row in seed.confusion if row.attractor > 0)
    assert stand_ins == [1, 2]
    # plain cell mapping sees more groups than there are attractors, and cells that leave
    assert len(seed.plain_groups) > 2
    assert table[-2].sum() > 0


def test_a_smaller_distance_takes_longer_and_changes_no_label(seed):
    exact = fp.basins(OSCILLATOR, picture(60), params=SEED, distance=1e-6)
    assert (exact.label == seed.label).all()
    assert (exact.time >= seed.time).all()
    assert exact.time.max() > seed.time.max()


def test_labels_by_exit_are_the_same(seed):
    assert not seed.by_exit
    quick = fp.basins(OSCILLATOR, picture(60), params=SEED, times=False)
    assert quick.by_exit, quick.by_exit_reason
    assert quick.looked_up > 1000  # the others were inside an ellipsoid before they left a slide
    assert (quick.label == seed.label).all()
    assert (quick.time == -1).all()


def test_the_number_of_threads_changes_nothing(seed):
    again = fp.basins(OSCILLATOR, picture(60), params=SEED, threads=1)
    assert (again.label == seed.label).all()
    assert (again.time == seed.time).all()


def test_plain_cell_mapping_agrees_with_its_definition():
    cells = fp.cell_map(OSCILLATOR, picture(20), params=SEED)
    assert cells.group.shape == (20, 20)
    flat = cells.image.ravel()
    for start in range(0, 400, 7):
        cell, steps = start, 0
        while cell >= 0 and steps < 400:
            group = cells.group.ravel()[cell]
            if group >= 0 and cells.steps.ravel()[cell] == 0:
                break
            cell, steps = flat[cell], steps + 1
        assert steps == cells.steps.ravel()[start]
    assert np.isclose(cells.time.max(), cells.steps.max() * 2 * np.pi / 1.067)


def test_a_grid_line_on_the_surface_is_told():
    with pytest.warns(UserWarning, match=r"v = 1 lies on a surface.* 'v': \(0.25, 2.25, 4\)"):
        fp.cell_map(OSCILLATOR, {"y": (-2, 2, 4), "v": (0, 2, 4)}, params=SEED)
    with pytest.warns(UserWarning, match="v = 1 lies on a surface.* Move this end"):
        fp.cell_map(OSCILLATOR, {"y": (-2, 2, 4), "v": (1, 2, 4)}, params=SEED)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fp.cell_map(OSCILLATOR, {"y": (-2, 2, 4), "v": (0.25, 2.25, 4)}, params=SEED)
        fp.cell_map(OSCILLATOR, {"y": (-2, 2, 4), "v": (0, 2, 5)}, params=SEED)


def test_plots_return_their_artists(seed):
    for what in ("label", "time", "plain"):
        artists = seed.plot(what=what)
        assert len(artists) == 1 + len(seed.attractors) + len(seed.saddles)
        plt.close("all")
    assert fp.cell_map(OSCILLATOR, picture(20), params=SEED).plot()
    plt.close("all")
    with pytest.raises(ValueError, match="what"):
        seed.plot(what="labels")


def test_as_xarray(seed):
    data = seed.to_xarray()
    assert data["label"].dims == ("y", "v")
    assert data.attrs["A"] == 3.6
    assert data["y"].size == 60


def test_arguments_that_make_no_sense_are_refused():
    with pytest.raises(ValueError, match="grid"):
        fp.basins(OSCILLATOR, {"y": (-4, 4, 10)})
    with pytest.raises(ValueError, match="grid"):
        fp.basins(OSCILLATOR, {"y": (-4, 4, 10), "w": (0, 1, 10)})
    with pytest.raises(ValueError, match=r"grid\['v'\]"):
        fp.basins(OSCILLATOR, {"y": (-4, 4, 10), "v": (1, 0, 10)})
    with pytest.raises(ValueError, match="expected a System with a period"):
        fp.basins(fp.models.unit_circle, {"x": (-1, 1, 4), "y": (-1, 1, 4)})
    with pytest.raises(ValueError, match="rest"):
        fp.cell_map(OSCILLATOR, picture(4), rest={"y": 1.0})
    with pytest.raises(ValueError, match="distance"):
        fp.basins(OSCILLATOR, picture(4), distance=-1.0)


def test_repr_of_a_cycle_says_where_it_is(seed):
    assert repr(seed.attractors[0]).startswith("<Attractor: period 1, at [")
    assert repr(seed.saddles[0]).startswith("<Saddle: period 1, at [")
    assert "\n" not in repr(seed.attractors[0]) + repr(seed.saddles[0])


def test_the_audit_is_told_where_it_disagrees(seed):
    assert "disagree" not in repr(seed)
    doubtful = dataclasses.replace(seed, audited=500, disagreements=3)
    assert "3 of 500 audited cells disagree" in repr(doubtful)


def test_h36_an_attractor_and_a_saddle_that_stick_have_zeros_exactly():
    block = fp.models.oscillator.with_params(A=3.6, omega=1.067)
    found = fp.basins(block, {"y": (-4, 4, 40), "v": (-3, 4, 40)}, times=False)
    assert len(found.attractors) == 2
    assert len(found.saddles) == 1
    for cycle in (*found.attractors, *found.saddles):
        assert cycle.multipliers[1] == 0
        orbit = fp.periodic_orbit(block, cycle.points[:, 0])
        assert orbit.multipliers == pytest.approx(cycle.multipliers, rel=1e-6, abs=0)


@fp.system(
    state="v i q tau",
    params={"Iref": 1.6},
    jumps={
        "clock": ("0.1 - tau", lambda t, s, p: (s.v, s.i, 1, 0)),
        "peak": ("Iref - i + 100*(1 - q)", lambda t, s, p: (s.v, s.i, 0, s.tau)),
    },
    period=0.1,
)
def boost(t, s, p):
    off = 1 - s.q
    return (off * s.i - s.v / 20) / 0.012, 10 - off * s.v, 0, 1


@pytest.mark.parametrize("tau", [0.0, 0.05])
def test_a_clocked_converter_has_one_attractor(tau):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fp.basins(
            boost, {"v": (5, 25, 12), "i": (0.2, 1.5, 12)}, rest={"q": 1, "tau": tau}, audit=100
        )
    assert found.state == "ok"
    assert found.success
    assert found.disagreements == 0
    (attractor,) = found.attractors
    assert attractor.period == 1
    assert attractor.multipliers[0] == 1
    assert attractor.multipliers[1].real == pytest.approx(-np.exp(-0.0697755), rel=1e-5)
    assert (found.label == 1).all()
    assert (found.at([[10, 20], [0.5, 1]])[0] == 1).all()


def test_a_clock_is_no_axis():
    with pytest.raises(ValueError, match=r"expected no clock.*Set it by rest"):
        fp.basins(boost, {"v": (5, 25, 4), "tau": (0, 0.09, 4)}, rest={"q": 1})


def test_attractors_are_sent_with_all_that_they_have(seed):
    _, known = seed._labelling()
    known[0].multipliers, known[0].residual = seed.attractors[0].multipliers, 1e-14
    for sent, again in zip(known, pickle.loads(pickle.dumps(known)), strict=True):
        for name in ("points", "multipliers", "norms"):
            np.testing.assert_array_equal(getattr(again, name), getattr(sent, name))
        for name in ("periodic", "residual", "radius"):
            assert getattr(again, name) == getattr(sent, name)


def test_an_audit_that_disagrees_is_not_ok(seed, monkeypatch):
    assert seed.state == "ok"
    assert dataclasses.replace(seed, disagreements=3).success
    doubtful = dataclasses.replace(seed, disagreements=4)
    assert doubtful.state == "not_converged"
    assert not doubtful.success
    from filippov._basins.basin_work import BasinWork

    complete = BasinWork.complete

    def disagreeing(*args):
        checked = complete(*args)
        checked.audited, checked.disagreements = 500, 430
        return checked

    monkeypatch.setattr(BasinWork, "complete", disagreeing)
    with pytest.warns(UserWarning, match="430 of 500 audited cells"):
        assert fp.basins(OSCILLATOR, picture(8), params=SEED).state == "not_converged"
