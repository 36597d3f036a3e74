# SPDX-License-Identifier: BSD-3-Clause
"""Whether a forcing repeats after the period that it was given, at every value of its parameters.

A run takes time apart into periods: of a wrong one it would give another trajectory, in silence.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from filippov import _core
from filippov._support.types import Floats

from .definition import Definition
from .trace import DefinitionError

__all__ = ["check_period", "period_of", "require_period"]

_SUMS = ("add", "sub", "neg", "where")  #: a choice is one of its parts
_ARITHMETIC = (*_SUMS, "mul", "div")


def check_period(model: _core.Model, definition: Definition) -> None:
    """Compare the fields with themselves a period later, at the default values.

    Raises
    ------
    DefinitionError
        If they differ.
    """
    wrong = _wrong(model, definition, dict(definition.params))
    if wrong is not None:
        raise DefinitionError(f"{definition.name} {wrong}")


def require_period(model: _core.Model, definition: Definition, params: Mapping[str, float]) -> None:
    """Refuse parameter values at which the system does not repeat after its period.

    Raises
    ------
    ValueError
        With the parameters, the period, and what to write instead.
    """
    wrong = _wrong(model, definition, params)
    if wrong is None:
        return
    names = list(params)
    timing = [names[k] for k in _shape(definition)[0]]
    moved = [name for name in timing if params[name] != definition.params[name]]
    alone = {name: dict(definition.params) | {name: params[name]} for name in moved}
    moved = [name for name in moved if _wrong(model, definition, alone[name])] or moved or timing
    values = ", ".join(f"{name} = {params[name]!r}" for name in moved)
    told = ", ".join(f"p.{name}" for name in moved)
    raise ValueError(
        f"{values}: {definition.name} {wrong}. Its period has to follow: write"
        f" period=lambda p: ..., a function of {told}"
    )


def _wrong(model: _core.Model, definition: Definition, params: Mapping[str, float]) -> str | None:
    """Tell what is wrong with the period at these values, if something is."""
    if definition.period is None:
        return None
    values = np.array(list(params.values()), dtype=np.float64)
    timing, all_forcing = _shape(definition)
    seen = definition.repeats.seen
    few, many = (tuple((k, float(values[k])) for k in ks) for ks in (timing, all_forcing))
    if few in seen or many in seen:
        return None
    period = model.period(values)
    if not 0 < period < math.inf:  # refused where it is needed
        return None
    if len(seen) > 10_000:
        seen.clear()
    # A forcing that is nothing or small now may be large another time. If it repeats when it can
    # be seen, it does at all amplitudes.
    seen_well = values.copy()
    for k in set(range(values.size)) - set(timing):
        if abs(values[k]) < 1e-3:
            seen_well[k] = math.copysign(1.0, values[k])
    known, change = _change(model, definition, seen_well, period)
    if known and change is None:
        seen.add(few)
        return None
    _, change = _change(model, definition, values, period)
    if change is None:
        seen.add(many)
        return None
    t, by = change
    return (
        f"does not repeat after its period, {period:.9g}: at t = {t:.6g} and a period later it"
        f" differs by {by:.3g}"
    )


def _change(
    model: _core.Model, definition: Definition, values: Floats, period: float
) -> tuple[bool, tuple[float, float] | None]:
    """Whether anything could be computed, and where it is different a period later."""
    random = np.random.default_rng(20080131)
    found: list[tuple[float, tuple[float, ...], tuple[float, ...], tuple[float, ...]]] = []
    for k in range(8):
        t = period * random.random()
        x = random.standard_normal(len(definition.state)) * 10.0 ** (k % 3 - 1)
        side = [1 if v > 0 else -1 for v in random.standard_normal(model.surfaces)]
        times = np.array([t, t + period, t + 0.37 * period])
        points = np.tile(x, (3, 1))
        with np.errstate(all="ignore"):
            both = (model.field(times, points, side, values), model.h(times, points, values))
            sizes, changes, swings = zip(*(_measured(rows) for rows in both), strict=True)
        found.append((t, sizes, changes, swings))
    known = False
    for which in (0, 1):  # the fields, the switching functions
        swing = max((s[which] for *_, s in found if math.isfinite(s[which])), default=0.0)
        for t, sizes, changes, _ in found:
            size, change = sizes[which], changes[which]
            if not math.isfinite(size):
                continue
            known = known or which == 0
            # relative to all of it, and to what changes with time, which may be small
            if change > 1e-6 * size or change > 1e-5 * swing + 1e-12 * size:
                return True, (t, change)
    return known, None


def _measured(rows: Floats) -> tuple[float, float, float]:
    """Size of the first row, and how far the second and the third are from it."""
    first, second, third = rows
    if not first.size:
        return 0.0, 0.0, 0.0
    size = float(np.max(np.abs(first)))
    return size, float(np.max(np.abs(second - first))), float(np.max(np.abs(third - first)))


def period_of(definition: Definition, params: Mapping[str, float]) -> float:
    """Compute the period, also one that makes no sense."""
    if definition.period is None:
        return math.nan
    return definition.graph.of_params(definition.period, list(params.values()))


# --- which parameters count -----------------------------------------------------------------------


def _shape(definition: Definition) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Parameters that can change how the forcing repeats; these and all others in the forcing."""
    known = definition.repeats.shape
    if known is None:
        nodes: Sequence[tuple[Any, ...]] = definition.graph.nodes()
        roots = [*definition.field, *definition.surfaces.values()]
        for h, after in definition.jumps.values():
            roots += [h, *after]
        timing, forcing = _parameters_with_time(nodes, roots, len(definition.params))
        if definition.period is not None:
            timing |= _parameters_below(nodes, definition.period)
        known = tuple(sorted(timing)), tuple(sorted(forcing | timing))
        definition.repeats.shape = known
    return known


def _parameters_below(nodes: Sequence[tuple[Any, ...]], root: int) -> set[int]:
    needed, found = {root}, set()
    for i in range(root, -1, -1):
        if i in needed:
            needed.update(a for a in nodes[i][1:4] if a >= 0)
            if nodes[i][0] == "param":
                found.add(nodes[i][4])
    return found


def _parameters_with_time(
    nodes: Sequence[tuple[Any, ...]], roots: Sequence[int], n: int
) -> tuple[set[int], set[int]]:
    """Those in functions of the time, as omega in cos(omega t); those in what is added with it."""
    timed: list[bool] = []
    below: list[int] = []  # parameters, as bits
    for op, a, b, c, index, _ in nodes:
        operands = [i for i in (a, b, c) if i >= 0]
        bits = 1 << index if op == "param" else (1 << n) - 1 if op == "call" else 0
        for i in operands:
            bits |= below[i]
        below.append(bits)
        timed.append(op in ("time", "call") or any(timed[i] for i in operands))
    timing = forcing = 0
    # every node with time in it, whether it is seen through arithmetic or sums alone from a root
    plain = {root: (True, True) for root in roots if timed[root]}
    for i in range(len(nodes) - 1, -1, -1):
        if i not in plain:
            continue
        arithmetic, summed = plain[i]
        op, *operands = nodes[i][:4]
        if op == "where" and timed[operands[0]]:
            timing |= below[operands[0]]
        elif op not in _ARITHMETIC:
            timing |= below[i]
        if summed and op not in _SUMS:
            forcing |= below[i]
        if op == "time" and arithmetic:  # the time itself, and not in a function
            timing |= (1 << n) - 1
        for k, a in enumerate(operands):
            if a >= 0 and timed[a]:
                before = plain.get(a, (False, False))
                inside = op not in _ARITHMETIC or (op == "where" and k == 0)
                plain[a] = (
                    before[0] or (arithmetic and not inside),
                    before[1] or (summed and not inside and op in _SUMS),
                )
    forcing |= timing
    return _bits(timing), _bits(forcing)


def _bits(mask: int) -> set[int]:
    return {k for k in range(mask.bit_length()) if mask >> k & 1}
