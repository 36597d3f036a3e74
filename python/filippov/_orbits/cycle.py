# SPDX-License-Identifier: BSD-3-Clause
"""Words and nodes of cycles: between the core's columns and event logs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._results.event import modes_of
from filippov._support.sound import codes, finite, known, record, require
from filippov._support.types import Floats, Record
from filippov._system.system import Params, System

__all__ = [
    "cycle_at",
    "cycle_of",
    "node_events",
    "verify_columns",
    "verify_nodes",
    "without_point",
    "word_of",
]

# What ends a segment, in the order of the core.
SURFACE, EXIT_BELOW, EXIT_ABOVE, GRAZE, EXTREMUM_BELOW, EXTREMUM_ABOVE, PHASE = range(7)

_KINDS = np.array(["cross", "exit_sliding", "exit_sliding", "graze"] + 2 * ["slide_extremum"])
_CHARACTERS = {0: "0", -1: "-", 1: "+"}
_SIDES = {letter: side for side, letter in _CHARACTERS.items()}
_RANK = {"0": 0, "-": 1, "+": 2}


def cycle_of(
    word: str,
    events: Record,
    start: tuple[float, Floats],
    turns: int,
    period: float,
    params: Params,
    *,
    forced: bool,
) -> _core.CycleColumns:
    """Make the cycle whose nodes are the events of an orbit.

    Segment i goes from node i to node i + 1: `mode` has its mode, the sum of mode_j 3**j, `until`
    what ends it, and `surface` on which.
    """
    if events.size == 0:  # one segment, cut at the start
        letters = np.array([[_SIDES[letter] for letter in word]])
        ends, surfaces = [PHASE], np.array([0])
        t, x = np.array([start[0]]), start[1][None, :]
    else:
        letters = events["mode_after"].reshape(events.size, -1)
        ends, surfaces = list(map(_until, np.roll(events, -1))), np.roll(events["surface"], -1)
        t, x = events["t"].copy(), events["x"].copy()
        if not forced:
            t -= t[0]  # time is what the first node makes it
    return _core.CycleColumns(
        mode=letters.astype(np.int32) @ 3 ** np.arange(letters.shape[1], dtype=np.int32),
        until=np.array(ends, dtype=np.int32),
        surface=surfaces.astype(np.int32),
        t=t,
        x=x,
        turns=np.array([turns]),
        period=np.array([period]),
        p=np.array([list(params.values())], dtype=np.float64),
    )


def cycle_at(cycle: _core.CycleColumns, sys: System, params: Params) -> _core.CycleColumns:
    """Give the same nodes for other parameter values, at the same phases."""
    forcing = sys.period(params)
    period = cycle.period if forcing is None else cycle.turns.astype(np.float64) * forcing
    return _core.CycleColumns(
        mode=cycle.mode,
        until=cycle.until,
        surface=cycle.surface,
        t=cycle.t * (period / cycle.period),
        x=cycle.x,
        turns=cycle.turns,
        period=period,
        p=np.array([list(params.values())], dtype=np.float64),
    )


def _until(event: np.void) -> int:
    """Tell what ends the segment before an event."""
    kind = str(event["kind"])
    if kind == "exit_sliding":
        after = np.atleast_1d(event["mode_after"])[event["surface"]]
        return EXIT_BELOW if after < 0 else EXIT_ABOVE
    if kind == "slide_extremum":
        return EXTREMUM_BELOW if event["s"] < 0 else EXTREMUM_ABOVE
    return GRAZE if kind == "graze" else SURFACE


def word_of(modes: NDArray[np.int8]) -> str:
    """Canonical reading of a cycle of modes: the first rotation in the order 0, -, +.

    `modes` has shape (surfaces, n); of several surfaces there are spaces between the modes.
    """
    letters = _letters(modes)
    rotations = [letters[i:] + letters[:i] for i in range(len(letters))]
    least = min(rotations, key=lambda word: [_RANK[c] for letter in word for c in letter])
    return ("" if len(modes) == 1 else " ").join(least)


def _letters(modes: NDArray[np.int8]) -> list[str]:
    """Write modes of shape (surfaces, n)."""
    return ["".join(_CHARACTERS[side] for side in mode) for mode in modes.T.tolist()]


def node_events(
    sys: System, cycles: _core.CycleColumns
) -> tuple[Record, list[str], NDArray[np.intp]]:
    """Event logs of cycles, one after the other, from the start of each on.

    Returns
    -------
    events : structured array
        As in `Orbit.events`, and `point`, the index of the cycle.
    words : list of str
        One a cycle.
    rank : array, shape (n_nodes,)
        Where each node of the core went, counted from the first event of its cycle.
    """
    size = cycles.size
    point = np.repeat(np.arange(size.size), size)
    first = np.cumsum(size) - size
    index = np.arange(point.size)
    before = np.where(index == first[point], first[point] + size[point] - 1, index - 1)
    mode, until = cycles.mode, cycles.until
    period = cycles.period[point]
    t = cycles.t - cycles.t_start[point]
    t = np.where(t < 0, t + period, t)
    t = np.where(t >= period, t - period, t)
    order = np.lexsort((t, point))
    rank = np.empty(order.size, dtype=np.intp)
    rank[order] = index - first[point]
    changes = until[before] != PHASE

    words: list[str] = []
    for a, n in zip(first, size, strict=True):
        here = slice(a, a + n)
        changed = mode[before[here]] != mode[here]
        kept = mode[here][changed] if changed.any() else mode[a : a + 1]
        words.append(word_of(modes_of(kept, sys.surfaces)))

    log = np.zeros(order.size, _dtype(sys))
    log["point"] = point
    log["t"] = t
    log["phase"] = np.nan
    if "period" in sys.capabilities:
        forcing = (cycles.period / cycles.turns)[point]
        log["phase"] = 2 * np.pi * (t / forcing % 1)
    surface = cycles.surface[before]
    sides = modes_of(mode, sys.surfaces)
    slides = np.zeros(mode.size, np.bool_)
    if sys.surfaces:
        slides = np.take_along_axis(sides, surface[None, :], 0)[0] == 0
    modes = sides[0] if sys.surfaces == 1 else sides.T
    log["mode_before"] = modes[before]
    log["mode_after"] = modes
    log["surface"] = surface
    log["kind"] = _KINDS[np.where(changes, until[before], SURFACE)]
    log["kind"][changes & (until[before] == SURFACE) & slides] = "enter_sliding"
    log["x"] = cycles.x
    log["s"] = cycles.s
    return log[order][changes[order]], words, rank


def verify_columns(sys: System, events: Record, branch: bool = False) -> None:
    """Refuse what is no event log of cycles; of a branch it has a `point`."""
    columns = _dtype(sys)
    if not branch:
        columns = np.dtype(
            [(name, columns[name]) for name in columns.names or () if name != "point"]
        )
    record("events", events, columns)


def verify_nodes(sys: System, events: Record, words: Sequence[str], branch: bool = False) -> None:
    """Refuse an event log that no orbits with these words have."""
    verify_columns(sys, events, branch)
    known({*_KINDS.tolist(), "enter_sliding"}, kind=events["kind"])
    codes(0, max(sys.surfaces, 1), surface=events["surface"])
    codes(-1, 2, **{name: events[name] for name in ("mode_before", "mode_after")})
    finite(t=events["t"], x=events["x"])
    point = events["point"] if branch else np.zeros(events.size, dtype=np.intp)
    codes(0, len(words), point=point)
    steps, rises = np.diff(point), np.diff(events["t"]) >= 0
    require(((steps > 0) | ((steps == 0) & rises)).all(), "events is out of order")

    shape = (events.size, sys.surfaces)
    after = events["mode_after"].reshape(shape)
    changed = (events["mode_before"].reshape(shape) != after).any(axis=1)
    ends = np.searchsorted(point, np.arange(len(words) + 1))
    for word, a, b in zip(words, ends[:-1], ends[1:], strict=True):
        modes = after[a:b][changed[a:b]].T
        letters = word.split(" ") if sys.surfaces > 1 else list(word)
        good = all(len(letter) == sys.surfaces and set(letter) <= set(_SIDES) for letter in letters)
        # in any order: two events at one time have none
        if modes.size:
            good = good and sorted(letters) == sorted(_letters(modes))
        elif sys.surfaces:
            good = good and len(letters) == 1
        require(good, f"word is {word!r}, which is not that of its events")


def without_point(events: Record) -> Record:
    """Give the log of one cycle, without the index of the cycle."""
    from numpy.lib.recfunctions import repack_fields  # slow to import

    names = [name for name in events.dtype.names or () if name != "point"]
    log: Record = repack_fields(events[names])
    return log


def _dtype(sys: System) -> np.dtype[Any]:
    side = () if sys.surfaces == 1 else (sys.surfaces,)
    return np.dtype(
        [
            ("t", "f8"),
            ("phase", "f8"),
            ("kind", "U14"),
            ("surface", "i4"),
            ("mode_before", "i1", side),
            ("mode_after", "i1", side),
            ("x", "f8", (sys.dim,)),
            ("s", "f8"),
            ("point", "i8"),
        ]
    )
