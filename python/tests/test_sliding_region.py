# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import filippov as fp

BOX = {"y": (-12, 12), "v": (-1, 3)}


@pytest.mark.parametrize("t", [0.0, 0.4, 2.0])
@pytest.mark.parametrize("A", [0.5, 5.0])
def test_the_oscillator_sticks_between_its_two_boundaries(t, A):
    region = fp.sliding_region(fp.models.oscillator, t, bounds=BOX, params={"A": A})
    ends = A * np.cos(2.94 * t) + np.array([-4, 4])
    (piece,) = region.pieces
    np.testing.assert_array_equal(piece[1], 1)  # on the surface exactly
    # |A cos(omega t) - y| < 4
    np.testing.assert_allclose(np.sort(region.boundary[0]), ends, atol=1e-12)
    np.testing.assert_allclose(piece[0][[0, -1]], ends, atol=1e-12)
    s = fp.models.oscillator.equivalent_control(t, piece, {"A": A})
    assert (np.abs(s) <= 1 + 1e-12).all()


def test_a_region_cut_by_the_rectangle_has_no_boundary_there():
    region = fp.sliding_region(fp.models.oscillator, bounds={"y": (-1, 1), "v": (0, 2)})
    (piece,) = region.pieces
    assert piece[0][[0, -1]] == pytest.approx([-1, 1])
    assert region.boundary.shape == (2, 0)


def test_no_surface_no_region():
    region = fp.sliding_region(fp.models.oscillator, bounds={"y": (-1, 1), "v": (2, 3)})
    assert region.pieces == ()
    assert region.boundary.shape == (2, 0)


def test_a_surface_that_moves_is_followed():
    system = fp.models.varying_belt
    box = {"x": (-3, 3), "v": (-3, 3)}
    for t in (0.0, 1.0, 2.5):
        region = fp.sliding_region(system, t, bounds=box)
        for piece in region.pieces:
            np.testing.assert_allclose(system.h(t, piece), 0, atol=1e-15)
            np.testing.assert_allclose(piece[1], np.cos(t) + 0.7, atol=1e-14)
        l1, l2 = system.normal_components(t, region.boundary)
        np.testing.assert_allclose(np.minimum(np.abs(l1), np.abs(l2)), 0, atol=1e-12)


def test_a_circle_that_is_only_crossed_has_none():
    box = {"x": (-2, 2), "y": (-2, 2)}
    assert fp.sliding_region(fp.models.unit_circle, bounds=box).pieces == ()


def test_repelling_parts_do_not_count():
    run = fp.sliding_region(
        fp.models.coulomb, bounds={"x": (-3, 3), "v": (-1, 1)}, params={"mu": -0.4}
    )
    assert run.pieces == ()


@pytest.mark.parametrize(
    ("system", "bounds", "error", "words"),
    [
        ("oscillator", BOX, TypeError, "sys = 'oscillator': expected a planar System"),
        (fp.models.relay, BOX, ValueError, "sys = 'relay': expected a planar System"),
        (fp.models.dieci_lopez_2, BOX, ValueError, "expected a planar System with one surface"),
        (fp.models.oscillator, [(-1, 1)] * 2, TypeError, "expected a mapping with 'y': "),
        (fp.models.oscillator, {"y": (-1, 1)}, ValueError, "'v': \\(low, high\\)"),
        (fp.models.oscillator, BOX | {"v": (1, 1)}, ValueError, "expected low < high"),
        (fp.models.oscillator, BOX | {"v": (1,)}, ValueError, "low, high, cells"),
        (fp.models.oscillator, BOX | {"v": (0, 1, 0)}, ValueError, "expected an integer > 0"),
    ],
)
def test_wrong_arguments_are_named(system, bounds, error, words):
    with pytest.raises(error, match=words):
        fp.sliding_region(system, bounds=bounds)
