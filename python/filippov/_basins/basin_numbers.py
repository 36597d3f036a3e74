# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of basins, each with its error: shares, entropy, uncertainty exponent, dimension."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from filippov import _core
from filippov._support.check import MOST, UNORDERED, integer, number, refuse
from filippov._support.progress import Progress, ended, shown

if TYPE_CHECKING:
    from .basin_work import BasinWork
    from .cells import Grid, Integers

__all__ = [
    "BasinEntropy",
    "BoxDimension",
    "Fraction",
    "PairCount",
    "UncertaintyExponent",
    "basin_entropy",
    "box_dimension",
    "grid_fractions",
    "sampled_fractions",
    "uncertainty_exponent",
]


@dataclass(frozen=True)
class Fraction:
    """Share of a label."""

    label: int  #: 1, 2, ... the attractor, 0 unresolved, -1 escaped
    value: float
    low: float  #: bounds, whose meaning is that of the function that gave them
    high: float
    count: int  #: cells, or points


@dataclass(frozen=True)
class BasinEntropy:
    """How unpredictable the label is within a box, in natural units.

    Daza et al., Sci. Rep. 6, 31416 (2016).
    """

    mean: float  #: S_b, over all boxes
    mean_error: float  #: its standard deviation over placements of the boxes
    boundary: float  #: S_bb, over boxes with several labels; NaN: there are none
    boundary_error: float
    boxes: int  #: with a cell whose label is known
    boundary_boxes: int  #: with several labels
    unresolved: int  #: cells left out
    #: S_bb exceeds ln 2 by more than two errors: the boundary is fractal, as far as the boxes are
    #: small against all that is smooth. The converse does not hold.
    fractal: bool


@dataclass(frozen=True)
class BoxDimension:
    """Box-counting dimension of the boundary in a picture."""

    dimension: float  #: NaN without a boundary
    error: float  #: standard error
    counts: tuple[tuple[int, int], ...]  #: side of a box in cells, boxes with several labels


@dataclass(frozen=True)
class PairCount:
    """Pairs of points at a distance."""

    epsilon: float  #: in units of the picture
    uncertain: int  #: pairs with different labels
    trials: int  #: pairs with both labels known
    unresolved: int  #: pairs left out


@dataclass(frozen=True)
class UncertaintyExponent:
    """Fit of f ~ epsilon^alpha to the share f of pairs with different labels.

    McDonald, Grebogi, Ott, Yorke, Physica D 17, 125 (1985).
    """

    alpha: float
    error: float  #: standard error of alpha and of the dimension
    dimension: float  #: of the boundary, 2 - alpha
    probability: float  #: of a worse fit if the power law holds; NaN with two distances
    counts: tuple[PairCount, ...]
    left_out: tuple[int, ...]  #: indices of counts with none or only uncertain pairs


def grid_fractions(label: Integers) -> tuple[Fraction, ...]:
    """Shares of a picture's labels, between bounds from the cells beside boundaries."""
    return _shares(_core.grid_fractions(label))


def sampled_fractions(
    label: Integers, level: float = 0.95, also: Sequence[int] = ()
) -> tuple[Fraction, ...]:
    """Shares of independent points' labels, with Wilson's intervals."""
    return _shares(_core.sampled_fractions(label, level, list(also)))


def _shares(found: list[_core.Fraction]) -> tuple[Fraction, ...]:
    return tuple(Fraction(f.label, f.value, f.low, f.high, f.count) for f in found)


def basin_entropy(label: Integers, box: int) -> BasinEntropy:
    """Entropy of a picture's labels in boxes of `box` x `box` cells."""
    side = min(label.shape)
    box = integer("box", box, 2)
    if box > side:
        refuse("box", box, f"expected 2 to the shorter side, {side}")
    found = _core.basin_entropy(label, box)
    return BasinEntropy(
        mean=found.mean,
        mean_error=found.mean_error,
        boundary=found.boundary,
        boundary_error=found.boundary_error,
        boxes=found.boxes,
        boundary_boxes=found.boundary_boxes,
        unresolved=found.unresolved,
        fractal=found.passes_log2_test(),
    )


def box_dimension(label: Integers) -> BoxDimension:
    """Dimension of the boundary between a picture's labels."""
    if min(label.shape) < 2:
        refuse("label.shape", label.shape, "expected two cells or more either way")
    found = _core.box_dimension(label, 1, 0)
    return BoxDimension(
        found.dimension, found.error, tuple((c.size, c.boxes) for c in found.counts)
    )


def uncertainty_exponent(
    work: BasinWork,
    known: list[_core.AttractorColumns],
    epsilons: Sequence[float],
    pairs: int,
    seed: int,
    progress: Progress,
) -> UncertaintyExponent:
    """Label pairs of random points and fit."""
    try:
        size = len(list(epsilons)) if not isinstance(epsilons, UNORDERED) else 0
    except TypeError:
        refuse("epsilons", epsilons, "expected two distances or more", TypeError)
    if size < 2:
        refuse("epsilons", epsilons, "expected two distances or more")
    distances = [
        number(f"epsilons[{k}]", e, "expected 0 < epsilon < 1", above=0.0, below=1.0)
        for k, e in enumerate(epsilons)
    ]
    with shown(progress, "pair") as show:
        found = work.finder.pairs(
            known,
            distances,
            integer("pairs", pairs, most=10**9),
            integer("seed", seed, 0, MOST),
            show,
        )
    ended(found.raised)
    counts = found.counts
    fit = _core.uncertainty_exponent(counts)
    return UncertaintyExponent(
        alpha=fit.alpha,
        error=fit.error,
        dimension=fit.dimension,
        probability=fit.probability,
        counts=tuple(PairCount(c.epsilon, c.uncertain, c.trials, c.unresolved) for c in counts),
        left_out=tuple(fit.left_out),
    )


def random_points(
    grid: Grid, n: int, seed: int
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Points drawn uniformly from the picture, shape (n, 2)."""
    return np.random.default_rng(seed).uniform(grid.low, grid.high, size=(n, 2))
