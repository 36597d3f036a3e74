# SPDX-License-Identifier: BSD-3-Clause
"""A whole run kept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from filippov._results.dataset import dataset, event_variables
from filippov._results.event import KIND_NAMES, EventKind, log_dtype, mode_changes
from filippov._results.settings import Settings, Stats
from filippov._results.solution import Solution
from filippov._results.store import Stored
from filippov._support.check import MOST, integer, refuse
from filippov._support.sound import codes, complete, finite, known, ordered, record, require, shaped
from filippov._support.status import SUCCESS, Status
from filippov._support.types import FloatOrArray, Floats, Modes, Record
from filippov._system.system import Params, System

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

__all__ = ["Branches", "Piece", "Stretches", "Trajectory"]


class Piece(NamedTuple):
    """A stretch of a trajectory in one mode."""

    mode: Any  #: -1, +1 or 0 (sliding); for several surfaces a tuple
    t: Floats  #: times, shape (k,), both ends included
    y: Floats  #: states, shape (dim, k)


class Stretches(NamedTuple):
    """All stretches of a trajectory, one after the other."""

    mode: Modes  #: of each, shape (n,) or (n, surfaces)
    ends: NDArray[np.intp]  #: stretch k has the points from ends[k] to before ends[k + 1]
    t: Floats  #: times of all points
    y: Floats  #: states there, shape (dim, n_points)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Stored):
    """Result of `simulate`; names as in scipy where scipy has one.

    In `mode` and in the event log -1 is h < 0, +1 is h > 0 and 0 is sliding. `events` has one
    record an event:

    =========================  ====================================================================
    `t`                        time
    `kind`                     what happened, see `EventKind`; compare with a kind or its name
    `surface`                  index of the surface, of the event function for `section`, else -1
    `mode_before, mode_after`  modes; one value, or one a surface
    `x_left, x_right`          state just before and just after
    `s`                        equivalent control in contact with a surface, -1 or +1 off it
    `period, t_local`          the time as period index and time since that period began
    `contacts`                 surfaces that the point is on: bit j for surface j
    `alternatives`             modes among which `on_nonunique` chose; 0 if there was one
    =========================  ====================================================================
    """

    t: Floats  #: times, shape (n_points,): ends of the steps, or `t_eval`
    y: Floats  #: states there, shape (dim, n_points)
    sol: Solution | None  #: solution at any time, if `dense_output`
    t_events: tuple[Floats, ...] | None  #: times of each event function's zeros
    y_events: tuple[Floats, ...] | None  #: states there, shape (n_zeros, dim) each
    status: Status  #: how the run ended
    message: str  #: the same in words, with time, state, mode and surface of a failure
    events: Record  #: the event log, a structured array
    mode: Modes  #: mode of the step that ends at each point, (n_points,) or (surfaces, n_points)
    stats: Stats  #: what the run did, counted
    system: System  #: what was simulated
    params: Params  #: with these parameter values
    settings: Settings  #: and these settings

    _parts = (Settings, Stats)

    @property
    def success(self) -> bool:
        """True if the run reached its end or a terminal event."""
        return self.status in SUCCESS

    @property
    def nfev(self) -> int:
        """Evaluations of a one-sided field."""
        return self.stats.field

    @property
    def choices(self) -> Record:
        """The events after which the solution is not unique, and `on_nonunique` chose."""
        chosen: Record = self.events[self.events["alternatives"] > 0]
        return chosen

    def _verify(self) -> None:
        dim, surfaces, n = self.system.dim, self.system.surfaces, self.t.size
        complete(self.params, self.system.params)
        require(len(self.settings.atol) == dim, f"atol has {len(self.settings.atol)} entries")
        ordered("t", self.t)
        shaped((dim, n), y=self.y)
        shaped((n,) if surfaces == 1 else (surfaces, n), mode=self.mode)
        log = self.events
        record("events", log, log_dtype(dim, surfaces))
        ends = log["kind"][[0, -1]].tolist() if log.size else []
        require(ends == ["start", "end"], "events is not from a start to an end")
        joined = (log["mode_after"][:-1] == log["mode_before"][1:]).all()
        require(joined, "mode_before is not the mode after the event before")
        ordered("events.t", log["t"])
        known(KIND_NAMES, kind=log["kind"])
        finite(y=self.y, x_left=log["x_left"], x_right=log["x_right"])
        modes = {name: log[name] for name in ("mode_before", "mode_after")}
        codes(-1, 2, mode=self.mode, **modes)
        section = log["kind"] == EventKind.section
        codes(-1, surfaces, surface=log["surface"][~section])
        codes(0, len(self.t_events or ()), surface=log["surface"][section])
        codes(0, 2**31, alternatives=log["alternatives"])
        first, last = log["t"][0], log["t"][-1]
        low, high = min(first, last), max(first, last)
        require(((self.t >= low) & (self.t <= high)).all(), "t is not within events.t")
        require(
            n < 2 or (self.t[-1] >= self.t[0]) == (last >= first) or self.t[0] == self.t[-1],
            "t and events.t go opposite ways",
        )
        require((self.t_events is None) == (self.y_events is None), "t_events without y_events")
        for times, states in zip(self.t_events or (), self.y_events or (), strict=True):
            ordered("t_events", times)
            shaped((times.size, dim), y_events=states)
        if self.sol is not None:
            of, values = self.sol._system, self.sol._packed()["params"].tolist()
            require((of.dim, of.surfaces) == (dim, surfaces), "sol is of another system")
            require(values == list(self.params.values()), "sol has other params")
            require((self.sol.t_min, self.sol.t_max) == (low, high), "sol has another span")

    def s(self, t: ArrayLike) -> FloatOrArray:
        """Blend variable at one time or several: for friction, the force over its maximum.

        The equivalent control in a slide, -1 or +1 off the surface; at an event the value before
        it. For several surfaces one row each.
        """
        return self._dense().s(t)

    def segments(self, points_per_step: int = 1) -> Iterator[Piece]:
        """Stretches between changes of mode, in order: `(mode, t, y)`.

        Parameters
        ----------
        points_per_step : int
            With dense output, how many points to give for each step of the integration; without
            it, the stretches have the trajectory's own points and their two ends.
        """
        points_per_step = integer("points_per_step", points_per_step)
        each = self._stretches(points_per_step)
        one = self.system.surfaces == 1
        for mode, a, b in zip(each.mode, each.ends[:-1], each.ends[1:], strict=True):
            piece = int(mode) if one else tuple(int(v) for v in mode)
            yield Piece(piece, each.t[a:b], each.y[:, a:b])

    def _stretches(self, per_step: int) -> Stretches:
        """Points of all stretches between changes of mode, in arrays: there may be many."""
        log = self.events
        at = mode_changes(log)
        first, last = log[at[:-1]], log[at[1:]]
        lasting = first["t"] != last["t"]
        first, last = first[lasting], last[lasting]
        t = self._times(per_step)
        along = 1.0 if log["t"][-1] >= log["t"][0] else -1.0
        # points strictly between the two events
        begin = np.searchsorted(along * t, along * first["t"], side="right")
        count = np.maximum(np.searchsorted(along * t, along * last["t"]) - begin, 0)
        ends = np.concatenate([[0], np.cumsum(count + 2)])
        inside = np.ones(ends[-1], dtype=np.bool_)
        inside[ends[:-1]] = inside[ends[1:] - 1] = False
        before = np.cumsum(count) - count
        taken = np.arange(count.sum()) + np.repeat(begin - before, count)
        times, states = np.empty(ends[-1]), np.empty((self.system.dim, ends[-1]))
        times[inside] = t[taken]
        states[:, inside] = self.y[:, taken] if self.sol is None else self.sol(t[taken])
        for where, event, side in ((ends[:-1], first, "x_right"), (ends[1:] - 1, last, "x_left")):
            times[where], states[:, where] = event["t"], event[side].T
        return Stretches(first["mode_after"], ends, times, states)

    def _times(self, per_step: int) -> Floats:
        """Give times of points, so many for each step if there is dense output."""
        if self.sol is None:
            return self.t
        t = self.sol.ts
        if per_step == 1 or t.size < 2:
            return t
        parts = np.arange(per_step) / per_step
        return np.append((t[:-1, None] + np.diff(t)[:, None] * parts).ravel(), t[-1])

    def event_table(self, last: int | None = None, *, digits: int = 9) -> str:
        """Readable table of the events, of all or of the last few.

        Parameters
        ----------
        last : int, optional
            How many; by default all.
        digits : int
            Digits after the point.
        """
        log = self.events
        if last is not None:
            log = log[max(len(log) - integer("last", last, least=0, most=MOST), 0) :]
        digits = integer("digits", digits, least=0, most=1074)
        several = self.system.surfaces > 1
        header = ["t", "event", "surface", "mode", *self.system.state, "s"]
        rows = [header]
        for event in log:
            before, after = (np.atleast_1d(event[f"mode_{when}"]) for when in ("before", "after"))
            changed = not np.array_equal(before, after)
            words = [",".join(f"{v:+d}" if v else "0" for v in mode) for mode in (before, after)]
            surface = int(event["surface"])
            index = event["kind"] == EventKind.section or (several and surface >= 0)
            rows.append(
                [
                    f"{event['t']:.{digits}f}",
                    str(event["kind"]),
                    str(surface) if index else "",
                    " -> ".join(words) if changed else words[1],
                    *(f"{v:.{digits}f}" for v in event["x_right"]),
                    "" if np.isnan(event["s"]) else f"{event['s']:.{min(digits, 6)}f}",
                ]
            )
        if all(row[2] == "" for row in rows[1:]):
            rows = [row[:2] + row[3:] for row in rows]
        left = {"event", "mode"}
        widths = [max(len(row[c]) for row in rows) for c in range(len(rows[0]))]
        titles = rows[0]
        return "\n".join(
            "  ".join(
                cell.ljust(width) if title in left else cell.rjust(width)
                for cell, width, title in zip(row, widths, titles, strict=True)
            ).rstrip()
            for row in rows
        )

    def plot(
        self,
        ax: Axes | None = None,
        *,
        x: str | None = None,
        y: str | Sequence[str] | None = None,
        **artist_kw: Any,
    ) -> list[Artist]:
        """Draw the trajectory, sliding apart from the rest.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        x, y : str, optional
            What to draw against what: names of state components, "t" or "s"; `y` may be a list.
            By default the phase portrait of a planar system, else all components against t.
        **artist_kw
            For the lines.

        Returns
        -------
        list of artists
            For each `y` a line for slip and one for sliding, without the empty ones.
        """
        from filippov._plot.plot import plot_trajectory

        return plot_trajectory(self, ax, x, y, artist_kw)

    def plot_phase(
        self,
        ax: Axes | None = None,
        *,
        bounds: dict[str, tuple[float, float]] | None = None,
        **artist_kw: Any,
    ) -> list[Artist]:
        """Draw the phase portrait of a planar system over its sliding region.

        The region is drawn at several times of the period, each lightly, so that it is darker
        where it lasts longer; its boundary is marked at each of these times. Without a period the
        times are taken from the run; where nothing depends on time there is one.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where; by default the current axes.
        bounds : dict, optional
            Where to look for the region, `{"y": (-6, 6), "v": (-3, 2)}`; by default around the
            trajectory.
        **artist_kw
            For the trajectory's lines.

        Returns
        -------
        list of artists
            Of the region, of its boundary, then those of `plot`.
        """
        from filippov._plot.plot import plot_phase

        return plot_phase(self, ax, bounds, artist_kw)

    def to_xarray(self) -> xr.Dataset:
        """Give the trajectory as an `xarray.Dataset` with dimensions `t`, `state` and `event`.

        Events are variables `event_t`, `event_kind`, ... A time at which the state jumps occurs
        twice.
        """
        several = self.mode.ndim == 2
        variables: dict[str, Any] = {
            "y": (("state", "t"), self.y),
            "mode": (("surface", "t") if several else "t", self.mode),
        }
        variables |= event_variables(self.events, "event_", x_left="state", x_right="state")
        return dataset(self, variables, {"t": self.t, "state": list(self.system.state)})

    def __repr__(self) -> str:
        log = self.events
        kinds = Counter(str(kind) for kind in log["kind"] if kind not in ("start", "end"))
        events = ", ".join(f"{count} {kind}" for kind, count in kinds.items()) or "no events"
        return (
            f"<Trajectory of {self.system.name}, t = {log['t'][0]:.9g} to {log['t'][-1]:.9g}: "
            f"{self.t.size} points, {self.stats.steps} steps; {events}; {self.status}>"
        )

    def _dense(self) -> Solution:
        if self.sol is None:
            raise ValueError("dense_output = False: expected a trajectory with dense output")
        return self.sol

    def _quantity(self, name: str, each: Stretches) -> Floats:
        """Values of a state component, of "t" or of "s" along all stretches."""
        if name in self.system.state:
            values: Floats = each.y[self.system.state.index(name)]
            return values
        if name == "t":
            return each.t
        if name == "s" and self.system.surfaces == 1:
            mode = np.repeat(each.mode, np.diff(each.ends))
            s = mode.astype(np.float64)
            at = mode == 0
            if at.any():
                s[at] = self.system.equivalent_control(each.t[at], each.y[:, at], self.params)
            return s
        names = ", ".join(map(repr, (*self.system.state, "t", "s")))
        return refuse("x or y", name, f"expected one of {names}")


@dataclass(frozen=True, eq=False, repr=False)
class Branches(Stored, Sequence[Trajectory]):
    """Every solution from a start, result of `simulate` with `on_nonunique="all"`.

    A sequence of trajectories; each tells by its `choices` where it went another way than others.
    """

    trajectories: tuple[Trajectory, ...]
    complete: bool  #: False: there are more than `max_branches`

    def _verify(self) -> None:
        require(len(self) > 0, "it has no trajectories")

    @overload
    def __getitem__(self, index: int) -> Trajectory: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Trajectory, ...]: ...
    def __getitem__(self, index: int | slice) -> Trajectory | tuple[Trajectory, ...]:
        return self.trajectories[index]

    def __len__(self) -> int:
        return len(self.trajectories)

    @property
    def success(self) -> bool:
        """True if every one reached its end."""
        return all(each.success for each in self.trajectories)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        x: str | None = None,
        y: str | Sequence[str] | None = None,
        **artist_kw: Any,
    ) -> list[Artist]:
        """Draw all of them; arguments as in `Trajectory.plot`."""
        artists: list[Artist] = []
        for each in self.trajectories:
            artists += each.plot(ax, x=x, y=y, **artist_kw)
        return artists

    def __repr__(self) -> str:
        more = "" if self.complete else " (and more)"
        lines = [f"<Branches: {len(self)} solutions{more}"]
        lines += [f"  {each!r}" for each in self.trajectories]
        return "\n".join(lines) + ">"
