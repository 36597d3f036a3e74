# SPDX-License-Identifier: BSD-3-Clause
"""Cell maps from event to event."""

import numpy as np
import pytest

import filippov as fp

BLOCK = fp.models.oscillator.with_params(A=3.6, omega=1.067)
T = BLOCK.period()
GRID = {"t": (0, T, 60), "y": (-8, 8, 60)}


def mapped(**kwargs):
    return fp.cell_map(BLOCK, GRID, rest={"v": 1.0}, section="enter_sliding", **kwargs)


@pytest.fixture(scope="module")
def cells():
    return mapped()


def test_images_are_those_of_the_section_map(cells):
    random = np.random.default_rng(3)
    for _ in range(40):
        i, j = random.integers(60, size=2)
        t, y = cells.grid.centres(0)[i], cells.grid.centres(1)[j]
        end = fp.section_map(BLOCK, [y, 1.0], "enter_sliding", t0=t, rtol=1e-8, atol=1e-10)
        assert end.status == "ok"
        there = (end.t % T / T * 60, (end.x[0] + 8) / 16 * 60)
        assert cells.image[i, j] == int(there[0]) * 60 + int(there[1])


def test_groups_lie_where_attractors_enter(cells):
    entries = []
    for attractor in fp.basins(BLOCK, {"y": (-4, 4, 10), "v": (-3, 4, 10)}).attractors:
        for iterate in (1, 2):
            end = fp.section_map(BLOCK, attractor.points[:, 0], "enter_sliding", iterate=iterate)
            entries.append((end.t % T, end.x[0]))
    widths = T / 60, 16 / 60
    large = sorted(cells.groups, key=lambda group: -group.basin)[:2]
    for group in large:
        for i, j in group.cells:
            at = cells.grid.centres(0)[i], cells.grid.centres(1)[j]
            apart = [
                max(abs(a - b) / w for a, b, w in zip(at, e, widths, strict=True)) for e in entries
            ]
            assert min(apart) < 1.5
    assert sum(group.basin for group in large) > 0.8 * 3600
    assert np.isnan(cells.period)
    assert np.isnan(cells.time).all()
    assert cells.section == "enter_sliding"
    assert cells.sink_basin == 0


def test_nothing_depends_on_threads_or_tiles(cells):
    for other in (mapped(threads=1), mapped(tile=120)):
        np.testing.assert_array_equal(other.image, cells.image)
        np.testing.assert_array_equal(other.group, cells.group)


def test_a_store_knows_its_section(tmp_path, cells):
    pytest.importorskip("zarr")
    stored = mapped(store=tmp_path / "run.zarr")
    np.testing.assert_array_equal(stored.image, cells.image)
    np.testing.assert_array_equal(stored.group, cells.group)
    with pytest.raises(ValueError, match="made with section = 'enter_sliding', expected 'cross'"):
        fp.cell_map(BLOCK, GRID, rest={"v": 1.0}, section="cross", store=tmp_path / "run.zarr")


def test_a_second_event_and_a_mode(cells):
    twice = mapped(periods=2)
    i, j = 10, 30
    t, y = cells.grid.centres(0)[i], cells.grid.centres(1)[j]
    end = fp.section_map(BLOCK, [y, 1.0], "enter_sliding", t0=t, iterate=2, rtol=1e-8, atol=1e-10)
    assert twice.image[i, j] == int(end.t % T / T * 60) * 60 + int((end.x[0] + 8) / 16 * 60)
    below = fp.cell_map(BLOCK, GRID, rest={"v": 1.0}, section="exit_sliding", after=-1)
    both = fp.cell_map(BLOCK, GRID, rest={"v": 1.0}, section="exit_sliding")
    assert (below.image != both.image).any()


def test_what_meets_no_event_leads_outside():
    cells = fp.cell_map(
        fp.models.relay,
        {"x2": (-1, 1, 6), "x3": (-1, 1, 6)},
        rest={"x1": 0.0},
        section="cross",
        max_time=1e-9,
    )
    assert cells.sink_basin == 36
    assert set(cells.status.ravel()) == {"escaped"}


def test_wrong_sections_are_refused():
    with pytest.raises(ValueError, match="section"):
        fp.cell_map(BLOCK, GRID, section="graze")
    with pytest.raises(ValueError, match="expected two of y, v"):
        fp.cell_map(BLOCK, GRID)  # a strobe map has no time
    with pytest.raises(ValueError, match="after"):
        fp.cell_map(BLOCK, {"y": (-1, 1, 3), "v": (-1, 0.9, 3)}, after=1)
    with pytest.raises(ValueError, match="max_time"):
        mapped(max_time=float("nan"))
    for unused in ({"method": "dopri5"}, {"max_steps": 7}, {"escape": 5.0}, {"max_step": 0.1}):
        with pytest.raises(ValueError, match="with a section"):
            mapped(**unused)
    with pytest.raises(ValueError, match="expected a System with a period"):
        fp.cell_map(fp.models.relay, {"x2": (-1, 1, 3), "x3": (-1, 1, 3)})
