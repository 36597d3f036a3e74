#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Does the package err on systems typed as formulas, of families unlike relays?

Random text is written, defined by ``fp.system`` and run by ``simulate``, ``ensemble``,
``strobe_map`` and ``bifurcation_diagram``, against oracles of this file in closed form: events are
roots of functions of time, found by dense scans and bisection. The rules of right, delicate and
wrong are those of ``bench_strangers``: a run is right if it says ``ok``, tells the changes of mode
that happen, and is off by at most 100 times what errors of a twentieth of the tolerance in every
step cause in the oracle. Where such errors change what happens, the run is delicate: it has to end,
be finite and say ``ok`` or ``ambiguous``; of such problems nine in ten are left out.

Usage: python strangers.py [--quick] [--problems N] [--family NAME] [--case NAME:NUMBER] [--first N]
                           [--processes N] [--show N] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import filippov as fp

MULTIPLE = 100
Floats = np.ndarray[Any, Any]
Function = Callable[[Floats], Floats]


# --- functions of time, with derivatives and antiderivatives ------------------------------------


@dataclass
class Term:
    """c (t-q)^p with p = 0, 1, 2; c cos(p t + q); c exp(-p (t - q)); c/(1 + ((t - q)/p)^2)."""

    kind: str
    c: float
    p: float = 0.0
    q: float = 0.0

    def __call__(self, t: Floats, n: int = 0) -> Floats:
        """Derivative of order n, or antiderivative of order -n."""
        c, p, q = self.c, self.p, self.q
        if self.kind == "wave":
            return c * p**n * np.cos(p * t + q + n * math.pi / 2)
        if self.kind == "decay":
            return c * (-p) ** n * np.exp(-p * (t - q))
        u = (t - q) / (p if self.kind == "bump" else 1)
        if self.kind == "bump":
            d = 1 + u * u
            form = {
                -2: u * np.arctan(u) - np.log(d) / 2,
                -1: np.arctan(u),
                0: 1 / d,
                1: -2 * u / d**2,
                2: (6 * u * u - 2) / d**3,
            }
            return c * p ** float(-n) * form[n]
        power = int(p)
        for k in range(n):
            c *= power - k
        for k in range(-n):
            c /= power + k + 1
        return np.zeros_like(u) if c == 0 else c * u ** (power - n)

    def pace(self) -> float:
        if self.kind in ("wave", "decay"):
            return 1 / abs(self.p)
        return self.p / 3 if self.kind == "bump" else math.inf

    def text(self, t: str) -> str:
        c, p, q = (repr(float(v)) for v in (self.c, self.p, self.q))
        if self.kind == "wave":
            return f"{c}*np.cos({p}*{t} + {q})"
        if self.kind == "decay":
            return f"{c}*np.exp(-{p}*({t} - {q}))"
        if self.kind == "bump":
            return f"{c}/(1 + (({t} - {q})/{p})**2)"
        return {0: c, 1: f"{c}*({t} - {q})", 2: f"{c}*({t} - {q})**2"}[int(self.p)]


@dataclass
class Wave:
    terms: list[Term] = field(default_factory=list)

    def __call__(self, t: Any, n: int = 0) -> Any:
        t = np.asarray(t, dtype=float)
        return sum((term(t, n) for term in self.terms), np.zeros_like(t))

    def pace(self) -> float:
        return min((term.pace() for term in self.terms if term.c), default=math.inf)

    def scale(self, by: float) -> None:
        for term in self.terms:
            term.c *= by

    def text(self, t: str) -> str:
        return " + ".join(term.text(t) for term in self.terms) or "0.0"


def constant(c: float) -> Wave:
    return Wave([Term("power", c)])


class Dice:
    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def uniform(self, a: float, b: float) -> float:
        return float(self.random.uniform(a, b))

    def log(self, a: float, b: float) -> float:
        return math.exp(self.uniform(math.log(a), math.log(b)))

    def chance(self, p: float) -> bool:
        return self.uniform(0, 1) < p

    def sign(self) -> float:
        return 1.0 if self.chance(0.5) else -1.0

    def one_of(self, *choices: Any) -> Any:
        return choices[int(self.random.integers(len(choices)))]

    def wave(self, size: float, fast: float, periodic: bool, t0: float, span: float) -> Wave:
        """A wave of that frequency; unless it is to be periodic also others, polynomials,
        decays and bumps between t0 and t0 + span."""
        w = Wave([Term("wave", size * self.uniform(0.3, 1), fast, self.uniform(-3, 3))])
        if periodic:
            if self.chance(0.4):
                part = fast / self.one_of(1, 2, 3)
                w.terms.append(
                    Term("wave", size * self.uniform(-0.6, 0.6), part, self.uniform(-3, 3))
                )
            return w
        for _ in range(self.one_of(0, 1, 2)):
            c = size * self.uniform(-0.6, 0.6)
            w.terms.append(
                self.one_of(
                    Term("wave", c, fast * self.uniform(0.05, 1), self.uniform(-3, 3)),
                    Term("decay", c, self.uniform(0.05, 2) / span, t0),
                    Term("bump", c, span * self.log(0.02, 0.5), t0 + span * self.uniform(0, 1)),
                    Term("power", c / span, 1, t0),
                    Term("power", c / span**2, 2, t0),
                )
            )
        return w

    def rippled(self, size: float, fast: float, span: float) -> Wave:
        """A wave of a swing or two in `span`, with a small ripple of this frequency on top."""
        slow = min(self.uniform(1, 12) / span, fast / 4)
        return Wave(
            [
                Term("wave", size * self.uniform(0.3, 1), slow, self.uniform(-3, 3)),
                Term("wave", size * self.log(1e-4, 0.03), fast, self.uniform(-3, 3)),
            ]
        )


# --- roots ---------------------------------------------------------------------------------------


def bisected(f: Function, a: float, b: float) -> float:
    """Where f, positive at a and not at b, becomes zero."""
    for _ in range(100):
        c = a + (b - a) / 2
        if not a < c < b:
            break
        if f(c) > 0:
            a = c
        else:
            b = c
    return b


def lowest(f: Function, a: float, b: float) -> tuple[float, float]:
    """A minimum between, by golden sections; sooner, where f is no more positive."""
    g = (math.sqrt(5) - 1) / 2
    for _ in range(60):
        c, d = b - g * (b - a), a + g * (b - a)
        fc, fd = float(f(c)), float(f(d))
        if not fc > 0:
            return c, fc
        if not fd > 0:
            return d, fd
        a, b = (a, d) if fc < fd else (c, b)
    return a, float(f(a))


def first_root(f: Function, start: float, end: float, step: float) -> float:
    """Where f, positive after the start, becomes zero first; infinite: it does not.

    It is sampled sixteen times a `step`, and more closely at first; minima between the samples
    are looked at where they may be zero."""
    near = start + step / 16 * np.arange(1, 17) / 16
    far = start + step / 16 * np.arange(2, 2 + max(0, int((end - start) / step * 16)))
    for chunk in np.split(np.concatenate([near, far]), range(512, len(far) + 16, 512)):
        t = np.concatenate([chunk[chunk < end], [min(end, chunk[-1] + step / 16)]])
        if len(t) < 2:
            t = np.array([start + (end - start) / 64, end])
        v = f(t)
        below = np.flatnonzero(~(v > 0))
        last = int(below[0]) if len(below) else len(t)
        i = np.arange(1, min(last, len(t) - 1))
        dips = i[
            (v[i] <= v[i - 1]) & (v[i] <= v[i + 1]) & (v[i] < 0.1 * (v[i - 1] + v[i + 1]) + 0.02)
        ]
        for k in dips:
            at, value = lowest(f, t[k - 1], t[k + 1])
            if not value > 0:
                return bisected(f, float(t[k - 1]), at)
        if len(below):
            if last == 0:
                a = start + (t[0] - start) / 1024 if t[0] <= near[0] else t[0] - step / 16
                return bisected(f, a, t[0]) if f(a) > 0 else start
            return bisected(f, float(t[last - 1]), float(t[last]))
        if t[-1] >= end:
            break
    return math.inf


def all_roots(f: Function, start: float, end: float, step: float) -> list[float]:
    """Both ways."""
    roots: list[float] = []
    sign = 1 if f(start) > 0 else -1
    while start < end:
        root = first_root(lambda t, sign=sign: sign * f(t), start, end, step)
        if not root <= end:
            break
        if root > start:
            roots.append(root)
        start, sign = max(root, math.nextafter(start, end)), -sign
    return roots


# --- what happens exactly ------------------------------------------------------------------------


@dataclass
class Exactly:
    """The end, and the changes of mode (time, surface, mode) on the way, natural units."""

    z: Floats
    t: float
    changes: list[tuple[float, int, int]] = field(default_factory=list)
    largest: float = 0.0
    met: list[float] = field(default_factory=list)  #: roots of the user's event
    fate: str = "ok"  #: "undecided": it depends on rounding; "stops": in a two-fold

    def same_story(self, other: Exactly) -> bool:
        return (
            self.fate == other.fate
            and len(self.met) == len(other.met)
            and [c[1:] for c in self.changes] == [c[1:] for c in other.changes]
        )


#: Forms of sign(h) of which h is another: the argument as it is written, what is compared.
MIRRORED = ("-np.sign(-", "< 0, -1, 1)", " < 0))")


@dataclass
class Problem:
    """A system as text, in units of its own, and its oracle."""

    source: str  #: of a system `f`, and maybe of a user's event `g`
    x0: Floats  #: engine's units
    t0: float
    t_end: float
    size: Floats
    speed: float
    pace: float
    follow: Callable[[Floats, float, float, Floats], Exactly]
    period: float = 0.0
    to_natural: Callable[[Floats], Floats] = lambda z: z
    ends_early: bool = False
    counts_jumps: bool = False  #: else impacts are not compared, but rests are
    lanes: bool = True

    @property
    def sense(self) -> int:
        """-1 where what is written is below zero above the surface."""
        return -1 if any(text in self.source for text in MIRRORED) else 1

    def natural(self, x: Any) -> Floats:
        return self.to_natural(np.asarray(x, dtype=float) / self.size)


@dataclass
class Relay:
    """z' = a(t) - b sign(z - g(t)): everything is known in closed form."""

    a: Wave
    g: Wave
    b: float

    def pace(self) -> float:
        return min(self.a.pace(), self.g.pace(), 1.0)

    def follow(
        self, z: float, on: bool, t: float, end: float, nudge: float, pace: float
    ) -> tuple[float, list[tuple[float, int]], float, bool]:
        """The end, changes, the largest |z|, and if it is decided.

        @nudge  an error in every step of length `pace`"""
        a, g, b, rate = self.a, self.g, self.b, nudge / pace
        changes: list[tuple[float, int]] = []
        mode = self._next(t, rate) if on else 1 if z + nudge > g(t) else -1
        z = float(g(t)) if on else z + nudge
        largest = abs(z)
        step = min(pace, (end - t) / 64)
        known, slip = True, None
        while len(changes) < 1000 and mode is not None:

            def height(at: Any, t: float = t, z: float = z, mode: int = mode) -> Any:
                return z + a(at, -1) - a(t, -1) + (rate - mode * b) * (at - t)

            def margin(at: Any, mode: int = mode, height: Function = height) -> Any:
                if mode:
                    return mode * (height(at) - g(at))
                return 1 - np.abs((a(at) + rate - g(at, 1)) / b)

            root = first_root(margin, t, end, step)
            if not root <= end:
                last = float(height(end)) if mode else float(g(end))
                return last, changes, max(largest, abs(last)), known
            # Of a slip that hardly leaves its surface, by a few tolerances, nothing is known; nor
            # of a slide where a slip hardly comes down and leaves again.
            far = margin((t + root) / 2) if mode else slip(root) if slip else math.inf
            if changes:
                known = known and abs(far) >= 100 * abs(nudge)
            slip = margin if mode else None
            before, t = mode, root
            z = float(height(t)) if before else float(g(t))
            drift = float(a(t) + rate - g(t, 1))
            mode = (1 if drift / b > 0 else -1) if before == 0 else self._next(t, rate)
            changes.append((t, mode))
            largest = max(largest, abs(z))
        return math.nan, changes, largest, False

    def _next(self, t: float, rate: float) -> Any:
        drift = float(self.a(t) + rate - self.g(t, 1))
        s = abs(drift / self.b) if self.b else math.inf
        if abs(s - 1) < 1e-10 or (self.b < 0 and s < 1):
            return None
        return 0 if s < 1 and self.b > 0 else 1 if drift > 0 else -1


# --- drawing -------------------------------------------------------------------------------------


@dataclass
class Frame:
    """Time, units and the words of a problem."""

    dice: Dice
    fast: float
    span: float
    periodic: bool
    t0: float
    speed: float
    ripples: bool = False

    def wave(self, size: float) -> Wave:
        if self.ripples:
            return self.dice.rippled(size, self.fast, self.span)
        return self.dice.wave(size, self.fast, self.periodic, self.t0, self.span)

    @property
    def time(self) -> str:
        return "t" if self.speed == 1 else f"({self.speed!r}*t)"

    def period(self) -> tuple[str, float]:
        """For the text, and engine's units; none, half of the time."""
        if not self.periodic or self.dice.chance(0.4):
            return "", 0.0
        T = 12 * math.pi / self.fast / self.speed
        return f", period={T!r}", T


def frame(dice: Dice) -> Frame:
    fast = dice.log(0.5, 1000)
    span = min(dice.uniform(2, 12), (1000 if dice.chance(0.05) else 150) / fast)
    return Frame(
        dice,
        fast,
        span,
        dice.chance(0.4),
        0.0 if dice.chance(0.5) else dice.uniform(0, 100),
        1.0 if dice.chance(0.3) else dice.log(1e-6, 1e6),
    )


def rippled_frame(dice: Dice) -> Frame:
    f = frame(dice)
    fast = dice.log(50, 3000)
    return replace(
        f, fast=fast, span=min(dice.uniform(2, 12), 1000 / fast), periodic=False, ripples=True
    )


def posed(
    f: Frame,
    source: str,
    start: Floats,
    size: list[float],
    pace: float,
    follow: Callable[[Floats, float, float, Floats], Exactly],
    period: float,
    to_natural: Callable[[Floats], Floats] = lambda z: z,
    lanes: bool = True,
) -> Problem:
    """In the engine's units."""
    sizes = np.array(size)
    return Problem(
        source=source,
        x0=start * sizes,
        t0=f.t0 / f.speed,
        t_end=(f.t0 + f.span) / f.speed,
        size=sizes,
        speed=f.speed,
        pace=pace,
        follow=follow,
        period=period,
        to_natural=to_natural,
        lanes=lanes,
    )


def relay_of(f: Frame, swings: bool) -> Relay:
    d = f.dice
    r = Relay(constant(0), constant(0), d.uniform(0.5, 2))
    if swings:
        r.a = constant(d.uniform(-0.6, 0.6))
        kind = d.uniform(0, 1)
        r.b = 0.0 if kind < 0.3 else r.b if kind < 0.8 else -r.b
        r.g = f.wave(1)
        if r.b > 0 and d.chance(0.7):
            r.g.scale(beyond(f, r))
        r.g.terms.append(Term("power", d.uniform(-0.5, 0.5)))
    else:
        c = 0.0 if f.periodic or d.chance(0.3) else d.uniform(-0.5, 0.5)
        r.a = f.wave(1)
        r.a.terms.append(Term("power", d.uniform(-0.5, 0.5)))
        r.a.scale(beyond(f, r))
        r.g = constant(d.uniform(-1, 1))
        if c:
            r.a.terms.append(Term("power", c))
            r.g.terms.append(Term("power", c, 1, f.t0))
    return r


def beyond(f: Frame, r: Relay) -> float:
    """By what to multiply the forcing, so that the largest |s| is just beyond 1, or short of it."""
    t = np.linspace(f.t0, f.t0 + f.span, max(200, int(f.span / r.pace() * 16)))
    largest = float(np.max(np.abs(r.a(t) - r.g(t, 1)) / r.b)) + 1e-9
    if f.dice.chance(0.25):
        return f.dice.uniform(0.5, 3) / largest
    part = f.dice.log(1e-5, 0.5)
    return (1 + (part if f.dice.chance(0.7) else -part)) / largest


def begins_on(f: Frame, r: Relay) -> bool:
    return r.b > 0 and bool(abs((r.a(f.t0) - r.g(f.t0, 1)) / r.b) < 0.98 and f.dice.chance(0.7))


def sign_text(d: Dice, h: str, size: float) -> str:
    """sign(h), as somebody may write it; h may be multiplied by anything."""
    k = size * d.log(1e-3, 1e3)
    return d.one_of(
        f"np.sign({h})",
        f"np.sign({k!r}*({h}))",
        f"-np.sign({-k!r}*({h}))",
        f"np.where({h} > 0, 1, -1)",
        f"(1 - 2*({h} < 0))" if d.chance(0.3) else f"np.where({h} < 0, -1, 1)",
        f"(2*np.heaviside({h}, 0.5) - 1)",
    )


def relay_family(number: int, swings: bool, ripples: bool = False) -> Problem:
    """One relay, alone or with 1 to 8 quiet components."""
    d = Dice(number)
    f = rippled_frame(d) if ripples else frame(d)
    r = relay_of(f, swings)
    more = d.one_of(0, 0, 1, 1, 2, 3, 7)
    if not more:
        r.b = r.b or 0.05  # (a term of no size is no switch)
    n = 1 + more
    size = [2.0 ** math.floor(d.uniform(-20, 20)) for _ in range(n)]
    drift = [0.0 if d.chance(0.5) else d.uniform(-1, 1) for _ in range(more)]
    shift = [0.0 if d.chance(0.7) else d.uniform(-1, 1) for _ in drift]
    if swings and more:
        shift[0] = d.uniform(0.2, 1)
    # (what looks on, y' = drift + shift s, is checked through its integral below)
    names = "zabcdefgh"[:n]
    z, T = f"s.z/{size[0]!r}", f.time
    sign = sign_text(d, f"{z} - ({r.g.text(T)})", 1.0)
    rates = [f"({r.a.text(T)} - {r.b!r}*{sign})*{size[0] * f.speed!r}"]
    for k in range(more):
        look = f" + {shift[k]!r}*{sign}" if shift[k] else ""
        rates.append(f"({drift[k]!r}{look})*{size[k + 1] * f.speed!r}")
    declared, period = f.period()
    source = (
        f'f = fp.system(state="{" ".join(names)}"{declared})(lambda t, s, p: ({", ".join(rates)},))'
    )
    on = begins_on(f, r)
    z0 = np.array([float(r.g(f.t0))] + [d.uniform(-1, 1) for _ in range(more)])
    if not on:
        z0[0] += d.sign() * d.uniform(0.05, 1)
    pace = r.pace()
    # a user's event: of the time, and of what only looks on
    quiet = [k for k in range(more) if not shift[k]]
    pitch = d.one_of(f.fast, d.log(0.5, f.fast + 1))
    event = f.wave(1) if ripples else d.wave(1, pitch, False, f.t0, f.span)
    event.terms.append(Term("power", d.uniform(-1.2, 1.2)))
    slope = d.uniform(-1, 1) if quiet and d.chance(0.5) else 0.0
    watched = d.chance(0.5)
    if watched:
        k = quiet[0] + 1 if quiet else 0
        seen = f" + {slope!r}*s[{k}]/{size[k]!r}" if slope else ""
        source += f"\ng = lambda t, s, p: {event.text(T)}{seen}"

    def looks_on(
        start: Floats, t: float, end: float, nudge: float, shift: float = 0
    ) -> list[float]:
        def value(at: Any) -> Any:
            if not slope:
                return event(at)
            k = quiet[0]
            return event(at) + slope * (start[k + 1] + drift[k] * (at - t) + nudge) + shift

        return all_roots(value, t, end, min(event.pace(), 1.0, (end - t) / 16))

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        last, changes, largest, known = r.follow(float(start[0]), on, t, end, float(nudge[0]), pace)
        e = Exactly(np.array(start), end, [(at, 0, m) for at, m in changes], largest)
        e.z[0] = last
        e.fate = "ok" if known else "undecided"
        if watched:
            error = float(nudge[0]) * (1 + (end - t) / pace)
            e.met = looks_on(start, t, end, error)
            few = 100 * abs(float(nudge[0]) * slope)
            for way in (-few, few):  # (where errors alone make roots, or take them away)
                if few and len(looks_on(start, t, end, error, way)) != len(e.met):
                    e.fate = "undecided"
        if known and more:
            turn = blend_integral(r, on, t, end, start[0], changes, float(nudge[0]) / pace)
            for k in range(more):
                e.z[k + 1] += (
                    drift[k] * (end - t) + shift[k] * turn + nudge[0] * (1 + (end - t) / pace)
                )
        e.largest = max(e.largest, float(np.max(np.abs(e.z)))) if known else e.largest
        return e

    return posed(f, source, z0, size, pace, follow, period)


def blend_integral(
    r: Relay, on: bool, t: float, end: float, z: float, changes: list[tuple[float, int]],
    rate: float,
) -> float:  # fmt: skip
    """The integral of s over a run."""
    mode = r._next(t, rate) if on else 1 if z > r.g(t) else -1
    total = 0.0
    for at, after in [*changes, (end, 0)]:
        if mode:
            total += mode * (at - t)
        else:
            whole = r.a(at, -1) - r.a(t, -1) - r.g(at) + r.g(t)
            total += float(whole + rate * (at - t)) / r.b
        t, mode = at, after
    return total


def several_family(number: int) -> Problem:
    """Two relays apart from each other, in changed variables x_i = z_i + k_i z_{i+1}^2."""
    d = Dice(number)
    f = frame(d)
    relays = [relay_of(f, d.chance(0.5)) for _ in range(2)]
    for r in relays:
        r.b = r.b or 0.05  # (a term of no size is no switch)
    size = [2.0 ** math.floor(d.uniform(-20, 20)) for _ in range(3)]
    bend = [d.uniform(-0.25, 0.25) / (5 + f.span) if d.chance(0.7) else 0.0 for _ in range(2)]
    c2 = 0.0 if d.chance(0.5) else d.uniform(-1, 1)
    T = f.time
    c = f"(s.c/{size[2]!r})"
    b = f"(s.b/{size[1]!r} - {bend[1]!r}*{c}**2)" if bend[1] else f"(s.b/{size[1]!r})"
    a = f"(s.a/{size[0]!r} - {bend[0]!r}*{b}**2)" if bend[0] else f"(s.a/{size[0]!r})"
    factor = d.uniform(0, 1)
    h = [f"{z} - ({r.g.text(T)})" for z, r in zip((a, b), relays, strict=True)]
    if d.chance(0.5):
        h[0] = f"({h[0]})*(1 + {factor!r}*{c}**2)"
    rate = [f"({r.a.text(T)} - {r.b!r}*np.sign({each}))" for r, each in zip(relays, h, strict=True)]
    speed, c2_text = f.speed, repr(c2)
    db = f"{rate[1]} + {2 * bend[1]!r}*{c}*{c2_text}" if bend[1] else rate[1]
    da = f"{rate[0]} + {2 * bend[0]!r}*{b}*{rate[1]}" if bend[0] else rate[0]
    declared, period = f.period()
    source = (
        f'f = fp.system(state="a b c"{declared})(lambda t, s, p: ('
        f"({da})*{size[0] * speed!r}, ({db})*{size[1] * speed!r}, {c2 * size[2] * speed!r}))"
    )
    on = [begins_on(f, r) for r in relays]
    z0 = np.array([float(r.g(f.t0)) for r in relays] + [d.uniform(-1, 1)])
    for j in range(2):
        if not on[j]:
            z0[j] += d.sign() * d.uniform(0.05, 1)
    y0 = z0.copy()
    y0[1] += bend[1] * z0[2] ** 2
    y0[0] += bend[0] * z0[1] ** 2
    pace = min(r.pace() for r in relays)

    def to_natural(y: Floats) -> Floats:
        z = np.array(y)
        z[1] -= bend[1] * z[2] ** 2
        z[0] -= bend[0] * z[1] ** 2
        return z

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        e = Exactly(np.array(start), end)
        for j, r in enumerate(relays):
            last, changes, largest, known = r.follow(
                float(start[j]), on[j], t, end, float(nudge[j]), pace
            )
            e.z[j] = last
            e.changes += [(at, j, m) for at, m in changes]
            e.largest = max(e.largest, largest)
            e.fate = e.fate if known else "undecided"
        e.changes.sort()
        e.z[2] += c2 * (end - t) + nudge[2]
        e.largest = max(e.largest, abs(float(e.z[2])), abs(float(start[2])))
        return e

    return posed(f, source, y0, size, pace, follow, period, to_natural)


def belt_family(number: int) -> Problem:
    """A block on a belt that moves evenly, driven by waves: x'' = F(t) - k x - m sign(x' - V)."""
    d = Dice(number)
    f = frame(d)
    f.span = min(f.span, 80 / f.fast)
    m = d.uniform(0.4, 1.5)
    V = d.one_of(0.0, d.uniform(-0.1, 0.1), d.uniform(-1, 1))
    k = d.one_of(0.0, d.uniform(0.2, 2))
    force = Wave([Term("wave", d.uniform(0.3, 1), f.fast, d.uniform(-3, 3))])
    if d.chance(0.4):
        part = f.fast / d.one_of(1, 2, 3)
        force.terms.append(Term("wave", d.uniform(-0.5, 0.5), part, d.uniform(-3, 3)))
    if any(abs(term.p**2 - k) < 0.05 for term in force.terms):
        k = 0.0
    grid = np.linspace(f.t0, f.t0 + f.span, 2000)
    offset = d.one_of(0.0, d.uniform(-0.4, 0.4) * m)
    part = d.log(1e-4, 1) * (1 if d.chance(0.75) else -0.5)
    force.scale((m - abs(offset)) * (1 + part) / float(np.max(np.abs(force(grid)))))
    force.terms.append(Term("power", offset))
    size = [2.0 ** math.floor(d.uniform(-20, 20)) for _ in range(2)]
    T, x, v = f.time, f"s.x/{size[0]!r}", f"s.v/{size[1]!r}"
    sign = sign_text(d, f"{v} - {V!r}", 1.0)
    declared, period = f.period()
    source = (
        f'f = fp.system(state="x v"{declared})(lambda t, s, p: ({v}*{size[0] * f.speed!r}, '
        f"({force.text(T)} - {k!r}*{x} - {m!r}*{sign})*{size[1] * f.speed!r}))"
    )
    pace = min(force.pace(), 0.4)

    def forced(t: Any, n: int) -> Any:
        """The part of x that the waves drive."""
        if k == 0:
            return force(t, n - 2)
        total = sum(
            (Term(e.kind, e.c / (k - e.p**2), e.p, e.q)(np.asarray(t, float), n)
             for e in force.terms if e.kind == "wave"), np.zeros_like(np.asarray(t, float)),
        )  # fmt: skip
        return total + (offset / k if n == 0 else 0)

    def slip(t0: float, x0: float, v0: float, mode: int, t: Any) -> tuple[Any, Any]:
        dt = np.asarray(t, float) - t0
        if k == 0:
            x = x0 + v0 * dt - mode * m * dt**2 / 2
            x = x + forced(t, 0) - forced(t0, 0) - forced(t0, 1) * dt
            return x, v0 - mode * m * dt + forced(t, 1) - forced(t0, 1)
        w = math.sqrt(k)
        a, b = x0 - forced(t0, 0) + mode * m / k, v0 - forced(t0, 1)
        return (
            a * np.cos(w * dt) + b / w * np.sin(w * dt) - mode * m / k + forced(t, 0),
            b * np.cos(w * dt) - a * w * np.sin(w * dt) + forced(t, 1),
        )

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        nx, nv = (float(each) for each in nudge[:2])
        x, v = float(start[0]) + nx, float(start[1]) + nv
        e = Exactly(np.array(start), end)
        few = 100 * max(abs(nx), abs(nv))  # some tolerances

        def contact(at: float, x: float) -> int | None:
            s = float(force(at) - k * x + nv / pace) / m
            return None if abs(abs(s) - 1) < 1e-10 else 0 if abs(s) < 1 else 1 if s > 0 else -1

        mode = contact(t, x) if on else 1 if v > V else -1
        v = V if on else v
        while mode is not None and len(e.changes) < 500:
            e.largest = max(e.largest, abs(x), abs(v))

            def margin(at: Any, t: float = t, x: float = x, v: float = v, mode: int = mode) -> Any:
                if mode == 0:
                    there = x + (V + nx / pace) * (at - t)
                    # A dip of s beyond its end that is lower than the tolerance may be a touch.
                    return 1 + 20 * nv - np.abs((force(at) - k * there + nv / pace) / m)
                return mode * (slip(t, x, v, mode, at)[1] + nv / pace * (at - t) - V)

            root = first_root(margin, t, end, min(pace, (end - t) / 64))
            stop = min(root, end)
            if mode == 0:
                x, v = x + (V + nx / pace) * (stop - t), V
            else:
                # Of a slip that hardly leaves the belt nothing is known.
                highest = float(np.max(margin(np.linspace(t, stop, 64))))
                if root <= end and e.changes and highest < few:
                    break
                drift = nv / pace * (stop - t)
                there = slip(t, x, v, mode, stop)
                x, v = float(there[0]) + drift * (stop - t) / 2, float(there[1]) + drift
            t = stop
            if not root <= end:
                e.z = np.array([x, v])
                e.largest = max(e.largest, abs(x), abs(v))
                return e
            v = V
            after = contact(t, x)
            # ... nor of one that would hardly get beyond the belt where it comes down to stick.
            if mode and after == 0:
                lowest = float(np.min(margin(np.linspace(t, t + 4 * pace, 64))))
                if few > 0 and lowest > -few:
                    break
            if mode == 0:
                after = 1 if float(force(t) - k * x) > 0 else -1
            mode = after
            if mode is not None:
                e.changes.append((t, 0, mode))
        e.fate = "undecided"
        return e

    x0 = d.uniform(-0.5, 0.5)
    on = bool(abs(float(force(f.t0)) - k * x0) / m < 0.98 and d.chance(0.7))
    z0 = np.array([x0, V if on else V + d.sign() * d.uniform(0.05, 1)])
    return posed(f, source, z0, size, pace, follow, period)


def contact_family(number: int) -> Problem:
    """A body that falls on a moving floor, e = 0, rests there and takes off."""
    d = Dice(number)
    f = frame(d)
    weight, on_floor = d.uniform(0.5, 1.5), d.chance(0.5)
    most = weight * (1 + d.log(1e-4, 1) * (1 if d.chance(0.8) else -0.5))
    force, floor = Wave(), constant(d.uniform(-0.5, 0.5))
    if on_floor:
        w = f.fast if f.periodic else min(f.fast, d.log(0.5, 30))
        f.fast, f.span = w, min(f.span, 100 / w)
        floor.terms.append(Term("wave", most / w**2, w, d.uniform(-3, 3)))
    else:
        force = d.wave(1, f.fast, f.periodic, f.t0, f.span)
        grid = np.linspace(f.t0, f.t0 + f.span, max(400, int(f.span / force.pace() * 16)))
        force.scale(most / (float(np.max(force(grid))) + 1e-9))
        if not f.periodic and d.chance(0.4):
            floor.terms.append(Term("power", d.uniform(-0.3, 0.3), 1, f.t0))
    size = [2.0 ** math.floor(d.uniform(-20, 20)) for _ in range(2)]
    T, speed = f.time, f.speed
    speed_text = " + ".join(
        [f"{-e.c * e.p!r}*np.sin({e.p!r}*{T} + {e.q!r})" for e in floor.terms if e.kind == "wave"]
        + [repr(e.c) for e in floor.terms if e.kind == "power" and e.p == 1]
    )
    declared, period = f.period()
    after = f"(s.y, ({speed_text or '0.0'})*{size[1]!r})"
    # (h is text: a formula of the state and the time)
    h = f"y/{size[0]!r} - ({floor.text(T)})".replace("np.", "")
    source = (
        f'f = fp.system(state="y v"{declared}, jumps={{"floor": ("{h}", lambda t, s, p: {after})}})'
        f"(lambda t, s, p: (s.v/{size[1]!r}*{size[0] * speed!r}, "
        f"({force.text(T)} - {weight!r})*{size[1] * speed!r}))"
    )
    pace = min(force.pace(), floor.pace(), 1.0)

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        rate = float(nudge[0]) / pace
        y, v, rests = float(start[0]) + float(nudge[0]), float(start[1]) + float(nudge[1]), False
        e = Exactly(np.array(start), end)
        step = min(pace, (end - t) / 64)

        def pressure(at: Any) -> Any:
            return weight - rate - force(at) + floor(at, 2)

        while len(e.changes) < 500:
            e.largest = max(e.largest, abs(y), abs(v))

            def height(at: Any, t: float = t, y: float = y, v: float = v) -> Any:
                dt = at - t
                fall = y + v * dt + (rate - weight) * dt**2 / 2
                return fall + force(at, -2) - force(t, -2) - force(t, -1) * dt

            def margin(at: Any, height: Function = height, rests: bool = rests) -> Any:
                return pressure(at) if rests else height(at) - floor(at)

            root = first_root(margin, t, end, step)
            stop = min(root, end)
            if rests:
                y, v = float(floor(stop)), float(floor(stop, 1))
            else:
                y, v = (
                    float(height(stop)),
                    v + (rate - weight) * (stop - t) + float(force(stop, -1) - force(t, -1)),
                )
            t = stop
            if not root <= end:
                e.z = np.array([y, v])
                e.largest = max(e.largest, abs(y), abs(v))
                return e
            y, v = float(floor(t)), float(floor(t, 1))
            if rests:
                e.changes.append((t, 0, 1))
            elif abs(float(pressure(t))) < 1e-8:
                break
            elif pressure(t) > 0:
                e.changes.append((t, 0, 0))
            rests = not rests and pressure(t) > 0
        e.fate = "undecided"
        return e

    z0 = np.array([
        float(floor(f.t0)) + d.log(1e-3, 1) * min(1, f.span),
        float(floor(f.t0, 1)) + d.uniform(-1, 0.2),
    ])  # fmt: skip
    return posed(f, source, z0, size, pace, follow, period, lanes=False)


def exponential(a: Floats, t: float) -> Floats:
    """Of a matrix of two rows."""
    mean = (a[0, 0] + a[1, 1]) / 2
    rest = a - mean * np.eye(2)
    square = complex(mean**2 - np.linalg.det(a)) ** 0.5
    sinh = t if square == 0 else np.sinh(square * t) / square
    return math.exp(mean * t) * np.real(np.cosh(square * t) * np.eye(2) + sinh * rest)


def converter_family(number: int) -> Problem:
    """A boost converter with a clock and a latch as components."""
    d = Dice(number)
    L, C, R = d.uniform(0.5, 2), d.uniform(0.5, 4), d.uniform(1, 20)
    r, E, clock = d.uniform(0.01, 0.3), d.uniform(0.5, 2), d.log(0.05, 1.5)
    ramp, level = d.one_of(0.0, d.uniform(0, 1)), d.uniform(0.8, 3)
    a = [np.array([[-r / L, -1 / L], [1 / C, -1 / R / C]]), np.diag([-r / L, -1 / R / C])]
    b = np.array([E / L, 0])
    far = d.one_of(100.0, 100.0, d.log(30, 1000))
    period = d.one_of(0.0, clock)
    declared = f", period={period!r}" if period else ""
    source = (
        f'f = fp.system(state="i v tau q"{declared}, jumps={{'
        f'"clock": ("{clock!r} - tau", lambda t, s, p: (s.i, s.v, 0, 1)), '
        f'"peak": ("{level!r} - i - {ramp!r}*tau + {far!r}*(1 - q)", '
        f"lambda t, s, p: (s.i, s.v, s.tau, 0))}})(lambda t, s, p: ("
        f"{E / L!r} - {r / L!r}*s.i - (1 - s.q)*s.v*{1 / L!r}, "
        f"(1 - s.q)*s.i*{1 / C!r} - s.v*{1 / R / C!r}, 1, 0))"
    )
    pace = min(1.0, clock)

    def moved(x: Floats, q: int, dt: float) -> Floats:
        rest = -np.linalg.solve(a[q], b)
        return rest + exponential(a[q], dt) @ (x - rest)

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        x, on, left = start[:2] + nudge[:2], start[3] > 0.5, t + clock - float(start[2])
        e = Exactly(np.array(start), end)
        while True:
            stop = min(left, end)
            root = math.inf
            if on:
                rest = -np.linalg.solve(a[1], b)

                def below(
                    at: Any, t: float = t, x: Floats = x, left: float = left, rest: Floats = rest
                ) -> Any:
                    i = rest[0] + np.exp(a[1][0, 0] * (at - t)) * (x[0] - rest[0])
                    return level - i - ramp * (clock - left + at)

                root = first_root(below, t, stop, min(0.25, clock / 16))
            if root <= stop:
                x, t, on = moved(x, 1, root - t) + nudge[:2], root, False
                e.changes.append((t, 1, 2))
                continue
            x, t = moved(x, int(on), stop - t), stop
            e.largest = max(e.largest, float(np.max(np.abs(x))))
            if not left < end:
                break
            x, on, left = x + nudge[:2], True, left + clock
            e.changes.append((t, 0, 2))
            if level - x[0] < 0:
                on = False
                e.changes.append((t, 1, 2))
        e.z = np.array([x[0], x[1], clock - (left - end), float(on)])
        return e

    z0 = np.array([
        level * d.uniform(0.1, 0.8), d.uniform(0, 3), clock * d.uniform(0, 0.95), d.one_of(0.0, 1.0)
    ])  # fmt: skip
    if level - z0[0] - ramp * z0[2] <= 0:
        z0[3] = 0.0  # beyond the peak the switch is open
    return Problem(
        source, z0, 0.0, clock * d.uniform(3, 25), np.ones(4), 1.0, pace, follow, period,
        lanes=False, counts_jumps=True,
    )  # fmt: skip


def end_family(number: int) -> Problem:
    """x' = k (a - t) below zero and m (t - b) above: a slide ends by tangency at the first of a and
    b, and at a mean of them, which may be near, its two fields are the same."""
    d = Dice(number)
    k, m = d.log(0.03, 30), d.log(0.03, 30)
    t0 = d.one_of(0.0, d.uniform(0, 100))
    a = t0 + d.uniform(0.2, 4)
    b = a + d.sign() * d.log(1e-5, 2)
    x0 = d.one_of(0.0, d.uniform(-1, 1))
    source = (
        f'f = fp.System("x", fields={{"-": lambda t, s, p: ({k!r}*({a!r} - t),), '
        f'"+": lambda t, s, p: ({m!r}*(t - {b!r}),)}}, switch="x")'
    )

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        x = float(start[0])
        e = Exactly(np.array([x]), end, largest=abs(x))

        def went(mode: int, x: float, since: float, to: float) -> float:
            if mode < 0:
                return x + k * ((a - since) ** 2 - (a - to) ** 2) / 2
            return x + m * ((to - b) ** 2 - (since - b) ** 2) / 2

        def meets(mode: int, x: float, since: float) -> float:
            """When it comes to zero, as long as its field leads there."""
            last, size = (a, k) if mode < 0 else (b, m)
            left = (last - since) ** 2 - 2 * abs(x) / size
            return last - math.sqrt(left) if left > 0 and since < last else math.inf

        mode = int(np.sign(x)) if x else (0 if t < b else 1)
        x += float(nudge[0]) if mode else 0.0
        for _ in range(3):
            at = min(a, b) if mode == 0 else meets(mode, x, t)
            if not at < end:
                break
            before, t, x = mode, at, float(nudge[0])
            if before == 0:
                mode = -1 if a < b else 1
            else:
                up, down = t < a, t < b
                mode = 0 if up and down else 1 if up else -1
            e.changes.append((t, 0, mode))
        e.z = np.array([went(mode, x, t, end) if mode else 0.0])
        e.largest = max(e.largest, abs(float(e.z[0])))
        return e

    return Problem(
        source, np.array([x0]), t0, max(a, b) + d.uniform(0.3, 3), np.ones(1), 1.0, 1.0, follow
    )


def counter_family(number: int) -> Problem:
    """Neurons that fire at 1, come down by 1 and kick each other, and one that counts what they
    fire: whatever lies beyond its limit fires, in any order."""
    d = Dice(number)
    n, K = d.one_of(1, 2, 3), d.one_of(4, 5, 7)
    leak = np.array([d.one_of(0.0, d.uniform(0.1, 1)) for _ in range(n)])
    rate = np.array([each * d.uniform(1.1, 3) if each else d.log(0.2, 3) for each in leak])
    kick = np.array([[d.one_of(0.0, d.uniform(-0.2, 0.3)) for _ in range(n)] for _ in range(n + 1)])
    kick[range(n), range(n)] = -1
    limit = np.array([1.0] * n + [float(K)])
    kick = np.column_stack([kick, [1.0] * n + [-float(K)]])
    names = [*(f"x{i}" for i in range(n)), "c"]
    jumps = ", ".join(
        f'"{name}": ("{float(limit[j])!r} - {name}", lambda t, s, p: ('
        + ", ".join(f"s.{other} + {float(w)!r}" for other, w in zip(names, kick[j], strict=True))
        + "))"
        for j, name in enumerate(names)
    )
    rates = ", ".join(f"{float(rate[i])!r} - {float(leak[i])!r}*s.x{i}" for i in range(n))
    source = (
        f'f = fp.system(state="{" ".join(names)}", jumps={{{jumps}}})(lambda t, s, p: ({rates}, 0))'
    )

    rest = np.divide(rate, leak, out=np.zeros(n), where=leak > 0)

    def moved(x: Floats, dt: float) -> Floats:
        y = x.copy()
        y[:n] = np.where(leak > 0, rest + (x[:n] - rest) * np.exp(-leak * dt), x[:n] + rate * dt)
        return y

    def cascade(x: Floats, first: int, last: bool) -> tuple[Floats, list[int]]:
        """What fires when one does; of several, the last or the first one."""
        x, fires, fired = x.copy(), [first], []
        while fires:
            j = fires.pop(-1 if last else 0)
            x += kick[j]
            fired.append(j)
            fires = [k for k in range(n + 1) if x[k] >= limit[k]]
        return x, sorted(fired)

    def follow(start: Floats, t: float, end: float, nudge: Floats) -> Exactly:
        push = np.append(nudge[:n], 0.0)
        x = np.array(start, dtype=float) + push
        e = Exactly(x, end, largest=1.0)
        while len(e.changes) < 2000:
            with np.errstate(all="ignore"):
                late = np.where(
                    leak > 0, np.log((x[:n] - rest) / (1 - rest)) / leak, (1 - x[:n]) / rate
                )
            i = int(np.argmin(late))
            if not t + late[i] < end:
                break
            x, t = moved(x, float(late[i])) + push, t + float(late[i])
            x[i] = 1.0
            (x, fired), other = cascade(x, i, last=True), cascade(x, i, last=False)
            if fired != other[1]:  # one that another holds back may fire before that
                e.fate = "undecided"
            e.changes += [(t, j, 2) for j in fired]
        e.z = moved(x, end - t)
        return e

    x0 = np.append(d.random.uniform(0, 0.95, n), float(d.random.integers(K)))
    span = d.uniform(3, 12) / float(np.max(rate))
    return Problem(
        source, x0, 0.0, span, np.ones(n + 1), 1.0, min(1.0, 1 / float(np.max(rate))), follow,
        lanes=False, counts_jumps=True,
    )  # fmt: skip


def two_fold_family(number: int) -> Problem:
    """Slides to the folds and into the two-fold of two even fields."""
    d = Dice(number)
    node = d.chance(0.5)
    while True:
        below, above = d.random.uniform(-1.5, 1.5, 2), d.random.uniform(-1.5, 1.5, 2)
        m = np.column_stack([above, below])
        if abs(np.linalg.det(m)) < 0.02:
            continue
        inverse = np.linalg.inv(m)
        w0 = d.random.uniform(0.1, 1, 2)

        def follow(
            start: Floats, t: float, end: float, nudge: Floats, m: Floats = m,
            inverse: Floats = inverse, below: Floats = below, above: Floats = above,
        ) -> Exactly:  # fmt: skip
            w = start[:2] + 20 * (1 + end - t) * nudge[:2]
            e = Exactly(np.zeros(3), end, largest=float(np.max(np.abs(start))))
            one = np.ones(2) @ inverse
            scale = float(np.sum(np.abs(m)))
            tau, step = 0.0, 0.5 / scale

            def at(tau: float) -> Floats:
                return exponential(m, tau) @ w

            def margin(tau: Any) -> Any:
                return np.array([
                    min(v := at(float(each))) / float(np.sum(np.abs(v))) for each in np.ravel(tau)
                ]).reshape(np.shape(tau))  # fmt: skip

            def clock(tau: float) -> float:
                return float(one @ (at(tau) - w))

            for _ in range(600):
                root = first_root(margin, tau, tau + step, step) if min(w) > 0 else -1.0
                if root < 0:
                    break
                last = min(root, tau + step)
                if t + clock(last) >= end:
                    e.z[:2] = at(bisected(lambda x, t=t: end - t - clock(float(x)), tau, last))
                    return e
                v = at(last)
                # what leaves some errors beside the two-fold may as well end in it
                if np.sum(v) < max(1e-13, 400 * np.max(np.abs(nudge[:2]))):
                    e.fate, e.t = "stops", t - float(one @ w)
                    return e
                if root <= tau + step:
                    t, dt = t + clock(root), end - t - clock(root)
                    if v[0] < v[1]:
                        e.z = np.array([below[0] * dt, v[1] + below[1] * dt, below[0] * dt**2 / 2])
                    else:
                        e.z = np.array([v[0] + above[0] * dt, above[1] * dt, -above[1] * dt**2 / 2])
                    e.changes.append((t, 0, -1 if v[0] < v[1] else 1))
                    e.largest = max(e.largest, float(np.max(np.abs(e.z))))
                    return e
                tau += step
            e.fate = "undecided"
            return e

        exact = follow(np.array([*w0, 0.0]), 0.0, 1e4, np.zeros(3))
        if exact.fate != "undecided" and node == (exact.fate == "stops"):
            break
    last = exact.t if node else exact.changes[0][0] if exact.changes else 10.0
    span = min(last * (d.uniform(1.05, 2) if d.chance(0.85) else 0.9), 20.0)
    bend = 0.0 if d.chance(0.6) else d.uniform(-0.25, 0.25) / (4 + 2 * span**2)
    u = f"(s.u - {bend!r}*s.v**2)" if bend else "s.u"
    period = d.one_of(0.0, 0.0, d.uniform(0.5, 3))
    declared = f", period={period!r}" if period else ""

    def side(rate: Floats, h: str) -> str:
        first = f"{rate[0]!r} + {2 * bend * rate[1]!r}*s.v" if bend else f"{rate[0]!r}"
        return f"({first}, {rate[1]!r}, {h})".replace("np.float64(", "").replace(")", ")")

    below, above = [[float(v) for v in each] for each in (below, above)]
    source = (
        f'f = fp.System("u v h", fields={{"-": lambda t, s, p: {side(below, u)}, '
        f'"+": lambda t, s, p: {side(above, "-s.v")}}}, switch="h"{declared})'
    )
    y0 = np.array([w0[0] + bend * w0[1] ** 2, w0[1], 0.0])

    def to_natural(y: Floats) -> Floats:
        return np.array([y[0] - bend * y[1] ** 2, y[1], y[2]])

    return Problem(
        source, y0, 0.0, span, np.ones(3), 1.0, 1.0, follow, period, to_natural, ends_early=node
    )


FAMILIES: dict[str, Callable[[int], Problem]] = {
    "slides": lambda n: relay_family(n, False),
    "swings": lambda n: relay_family(n, True),
    "ripples": lambda n: relay_family(n, n % 2 == 0, True),
    "belts": belt_family,
    "several": several_family,
    "contacts": contact_family,
    "converters": converter_family,
    "ends": end_family,
    "counters": counter_family,
    "two-folds": two_fold_family,
}


# --- judging -------------------------------------------------------------------------------------


@dataclass
class Told:
    """What the package says, engine's units."""

    status: str
    t: float
    x: Floats
    changes: list[tuple[float, int, int]] | None = None
    met: list[float] = field(default_factory=list)
    message: str = ""


def changes_of(run: Any, problem: Problem) -> list[tuple[float, int, int]]:
    """Changes of mode within the run, or jumps, mode 2."""
    told: list[tuple[float, int, int]] = []
    before = None
    near = 1e-9 * abs(problem.t_end - problem.t0)
    for e in run.events:
        after = [int(m) for m in np.atleast_1d(e["mode_after"])]
        inside = abs(e["t"] - problem.t0) > near and abs(e["t"] - problem.t_end) > near
        if before is not None and inside:
            for j, m in enumerate(after):
                if problem.counts_jumps:
                    if str(e["kind"]) == "jump" and int(e["surface"]) == j:
                        told.append((float(e["t"]), j, 2))
                elif m != before[j]:
                    told.append((float(e["t"]), j, m))
        before = after
    if problem.counts_jumps:  # what is thrown at one time is so in any order
        told.sort(key=lambda change: change[:2])
    return told


def runs_of(
    f: Any, g: Any, problem: Problem, tolerance: float, dice: Dice
) -> Iterator[tuple[str, Told]]:
    """The problem in all ways there are."""
    span = (problem.t0, problem.t_end)
    atol = tolerance * problem.size
    for method in ("dopri5", "dop853", "rodas5p"):
        if method == "rodas5p" and tolerance < 1e-8:
            continue
        run = fp.simulate(
            f, problem.x0, span, method=method, rtol=tolerance, atol=atol,
            dense_output=dice.chance(0.5), max_steps=2_000_000, events=g,
        )  # fmt: skip
        met = [] if g is None else [float(t) for t in run.t_events[0]]
        end = (run.status, float(run.t[-1]), run.y[:, -1])
        yield method, Told(*end, changes_of(run, problem), met, run.message)
    # among others: starts beside it, and itself twice
    n = dice.one_of(2, 3, 9, 17)
    x0 = np.repeat(problem.x0[:, None], n, axis=1)
    if problem.lanes:
        x0[:, 1:-1] += problem.size[:, None] * dice.random.uniform(-0.1, 0.1, (len(x0), n - 2))
    for method in ("dop853", "dopri5"):
        ends = fp.ensemble(
            f, x0, span, method=method, rtol=tolerance, atol=atol, max_steps=2_000_000
        )
        for member in {0, n - 1}:
            yield (
                f"lanes {method}",
                Told(str(ends.status[member]), float(ends.t[member]), ends.y[:, member]),
            )
    if problem.period > 0 and tolerance == 1e-8 and not problem.ends_early:
        yield from strobed(f, problem)


def strobed(f: Any, problem: Problem) -> Iterator[tuple[str, Told]]:
    """As many periods as fit, by the map; the rest by a run."""
    n = int((problem.t_end - problem.t0) / problem.period)
    if n < 1:
        return
    mapped = fp.strobe_map(f, problem.x0, iterate=n, t0=problem.t0, rtol=1e-10, atol=1e-12)
    status, x = str(np.asarray(mapped.status).item()), np.asarray(mapped.x).ravel()
    if status != "ok":
        yield "strobe_map", Told(status, problem.t0, x)
        return
    rest = fp.simulate(
        f, x, (problem.t0 + n * problem.period, problem.t_end), rtol=1e-10,
        atol=1e-10 * problem.size,
    )  # fmt: skip
    yield "strobe_map", Told(rest.status, float(rest.t[-1]), rest.y[:, -1])


@dataclass
class Bounds:
    in_doubt: bool
    state: float
    times: list[float]
    met: list[float]


def bounds_of(problem: Problem, exact: Exactly, z0: Floats, tolerance: float) -> Bounds:
    """What errors of a twentieth of the tolerance in every step cause."""
    error = tolerance * (1 + exact.largest)
    least = tolerance * problem.pace
    b = Bounds(
        exact.fate == "undecided", error, [least] * len(exact.changes), [least] * len(exact.met)
    )
    for signs in ([1, 1, 1, 1], [-1, -1, -1, -1], [1, -1, 1, -1], [-1, 1, -1, 1]):
        nudge = np.resize(np.array(signs, dtype=float), max(4, len(z0))) * error / 20
        pushed = problem.follow(
            z0, problem.t0 * problem.speed, problem.t_end * problem.speed, nudge[: len(z0)]
        )
        if not pushed.same_story(exact):
            b.in_doubt = True
            break
        b.state = max(b.state, float(np.max(np.abs(pushed.z - exact.z))), abs(pushed.t - exact.t))
        b.times = [
            max(old, abs(one[0] - other[0]))
            for old, one, other in zip(b.times, pushed.changes, exact.changes, strict=True)
        ]
        b.met = [
            max(old, abs(one - other))
            for old, one, other in zip(b.met, pushed.met, exact.met, strict=True)
        ]
    # What errors may carry beyond the end of the run is not certain to be in it.
    near_end = [(at[0], error) for at, error in zip(exact.changes, b.times, strict=True)]
    near_end += list(zip(exact.met, b.met, strict=True))
    b.in_doubt = b.in_doubt or any(abs(t - exact.t) < MULTIPLE * error for t, error in near_end)
    return b


def is_mirrored(told: list[tuple[float, int, int]], exact: list[tuple[float, int, int]]) -> bool:
    """True if all modes are those of -h, of one surface at least."""
    if len(told) != len(exact):
        return False
    for mirrored in ([0], [1], [0, 1]):
        if any(c[1] in mirrored and c[2] in (-1, 1) for c in exact) and all(
            one[1] == other[1] and one[2] == (-other[2] if one[1] in mirrored else other[2])
            for one, other in zip(told, exact, strict=True)
        ):
            return True
    return False


def complaint(problem: Problem, exact: Exactly, b: Bounds, told: Told) -> str:
    """What is wrong; empty if nothing is."""
    off = float(np.max(np.abs(problem.natural(told.x) - exact.z)))
    if exact.fate == "stops":
        if told.status != "ambiguous":
            return f"goes through a two-fold, {told.status}"
        if abs(told.t * problem.speed - exact.t) > max(1e-6, MULTIPLE * b.state):
            return f"two-fold at another time: {told.t * problem.speed:.9g} for {exact.t:.9g}"
        if off > max(1e-5, MULTIPLE * b.state):
            return f"two-fold at another place, off by {off:.2g}"
        return ""
    near_end = abs(told.t - problem.t_end) <= 1e-6 * abs(problem.t_end - problem.t0)
    if not (told.status == "ok" or (told.status == "ambiguous" and near_end)):
        return f"stops: {told.status}"
    if told.changes is not None:
        changes = [(t, j, problem.sense * mode) for t, j, mode in told.changes]
        if is_mirrored(changes, exact.changes):
            return "h has the other sign"
        for i in range(max(len(changes), len(exact.changes))):
            mine = changes[i] if i < len(changes) else None
            right = exact.changes[i] if i < len(exact.changes) else None
            if mine and right:
                slack = MULTIPLE * b.times[i] + 1e-12 * abs(right[0])
                if mine[1:] == right[1:] and abs(mine[0] * problem.speed - right[0]) <= slack:
                    continue
            late = mine is None or (right is not None and mine[0] * problem.speed > right[0])
            got = f"{mine[0] * problem.speed:.12g} {mine[1:]}" if mine else "none"
            want = f"{right[0]:.12g} {right[1:]}" if right else "none"
            return f"{'missed' if late else 'invented'} a change ({got} in place of {want})"
        for i in range(max(len(told.met), len(exact.met))):
            both = i < len(told.met) and i < len(exact.met)
            if both and abs(told.met[i] * problem.speed - exact.met[i]) <= (
                MULTIPLE * b.met[i] + 1e-12 * abs(exact.met[i])
            ):
                continue
            at = f"{told.met[i] * problem.speed:.12g}" if i < len(told.met) else "none"
            right_at = f"{exact.met[i]:.12g}" if i < len(exact.met) else "none"
            return (
                f"event met {len(told.met)} times in place of {len(exact.met)}, number {i} at {at} "
                f"in place of {right_at}"
            )
    if not off <= MULTIPLE * b.state:
        return f"another end, off by {off / b.state:.2g}"
    return ""


@dataclass
class Report:
    counts: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)
    left_out: int = 0
    seconds: float = 0.0


def try_problem(family: str, number: int, talk: bool = False) -> Report:
    report = Report()
    began = time.perf_counter()
    problem = FAMILIES[family](number)
    dice = Dice(number + 1)
    z0 = problem.natural(problem.x0)
    exact = problem.follow(
        z0, problem.t0 * problem.speed, problem.t_end * problem.speed, np.zeros(len(z0))
    )
    start = f"# from {problem.x0.tolist()} at {problem.t0!r} to {problem.t_end!r}"
    if talk:
        print(problem.source, start, sep="\n")
        print(f"exactly {exact.fate} at {exact.t:.12g}: {exact.z}")
        print(f"  event met {len(exact.met)} times")
        for change in exact.changes[:20]:
            print("  {:.12g}: surface {}, mode {}".format(*change))
    space: dict[str, Any] = {"np": np, "fp": fp}
    try:
        exec(problem.source, space)
    except Exception as error:  # whatever it is: a definition that is refused is a finding
        report.counts[family, "definition", "wrong"] += 1
        report.failures.append(f"--case {family}:{number}  definition: {error!r}"[:400])
        return report
    for tolerance in (1e-3, 1e-4, 1e-6, 1e-8, 1e-9):
        if not talk and dice.chance(0.6):
            continue
        b = bounds_of(problem, exact, z0, tolerance)
        if b.in_doubt and not talk and not dice.chance(0.1):
            report.left_out += 1
            continue
        try:
            for method, told in runs_of(space["f"], space.get("g"), problem, tolerance, dice):
                why = complaint(problem, exact, b, told)
                finite = bool(np.all(np.isfinite(told.x)))
                if not finite or told.status not in ("ok", "ambiguous"):
                    why = why or f"ends as {told.status}"
                    verdict = "wrong"
                else:
                    verdict = "delicate" if b.in_doubt else "wrong" if why else "right"
                report.counts[family, method, verdict] += 1
                if verdict == "wrong" or talk:
                    report.failures.append(
                        f"--case {family}:{number}  {method} {tolerance:.0e}"
                        f"{' period' if problem.period else ''}: {why or 'right'}, {told.status}"
                        f"{', delicate' if b.in_doubt else ''}. {told.message}"[:300]
                    )
        except Exception:
            report.counts[family, "call", "wrong"] += 1
            last = traceback.format_exc().strip().splitlines()[-1]
            report.failures.append(f"--case {family}:{number}  {tolerance:.0e}: {last}"[:400])
    report.seconds = time.perf_counter() - began
    return report


# --- a picture: the exits of a relay over its amplitude ------------------------------------------


def try_diagram(number: int, talk: bool = False) -> Report:
    """x' = A cos(w t + q) + c - sign(x), from rest: each period it slides, leaves and comes back;
    the phases of its exits, which no transient changes, over A."""
    d = Dice(number)
    w, q, c = d.log(0.5, 200), d.uniform(-3, 3), d.uniform(-0.1, 0.1)
    T = 2 * math.pi / w
    source = (
        f'f = fp.system(state="x", params={{"A": 1.2}}, period={T!r})('
        f"lambda t, s, p: (p.A*np.cos({w!r}*t + {q!r}) + {c!r} - np.sign(s.x),))"
    )
    space: dict[str, Any] = {"np": np, "fp": fp}
    exec(source, space)
    if talk:
        print(source)
    amplitudes = np.sort(1.1 + np.array([d.log(1e-3, 0.5) for _ in range(3)]))
    report = Report()
    all_periods = d.chance(0.5)
    diagram = fp.bifurcation_diagram(
        space["f"], A=amplitudes, transient=4, keep=6, x0=[0.0], section="exit_sliding",
        skip_repeats=not all_periods,
    )  # fmt: skip
    for k, A in enumerate(amplitudes):
        r = Relay(Wave([Term("wave", float(A), w, q), Term("power", c)]), constant(0), 1.0)
        on = abs(float(r.a(0.0))) < 1
        _, changes, _, known = r.follow(0.0, on, 0.0, 10 * T, 0.0, 1 / w)
        slides = [0 if on else 1, *[m for _, m in changes]]
        exits = [t for i, (t, m) in enumerate(changes) if m != 0 and slides[i] == 0 and t >= 4 * T]
        mine = diagram.t_local[diagram.value == k]
        expected = sorted(t % T for t in exits)
        if not all_periods:  # repeats are left out
            mine, expected = (
                sorted({round(float(t), 9) for t in each}) for each in (mine, expected)
            )
        same = known and len(mine) == len(expected)
        same = same and all(
            min(abs(a - b), T - abs(a - b)) <= 1e-6 * T
            for a, b in zip(sorted(mine), expected, strict=True)
        )
        report.counts["diagrams", "bifurcation_diagram", "right" if same else "wrong"] += 1
        if not same or talk:
            report.failures.append(
                f"--case diagrams:{number}  A = {A!r}: {len(mine)} exits at "
                f"{np.round(sorted(mine), 6)[:8]} in place of {len(expected)} at "
                f"{np.round(expected, 6)[:8]}"
            )
    return report


# --- formulas, far from where they are looked at ------------------------------------------------


def formula(d: Dice, depth: int, pulses: bool = True) -> str:
    """A formula of t, x and y whose functions bend anywhere within some hundreds of zero.

    @pulses  of which numbers become zero where the formula is not"""
    if depth == 0:
        names = d.one_of(["x"], ["x"], ["y"], ["t"], ["x", "y"], ["x", "t"], ["x", "y", "t"])
        terms = [
            f"{d.sign() * d.log(0.1, 10)!r}*{name if name == 't' else 's.' + name}"
            for name in names
        ]
        return "(" + " + ".join([*terms, repr(d.uniform(-400, 400) * d.one_of(0, 1, 1))]) + ")"
    u = formula(d, depth - 1, pulses)
    kind = d.one_of(
        "tanh", "pulse" if pulses else "tanh", "well", "arctan", "sin", "sum", "product", "ratio"
    )
    if kind in ("sum", "product", "ratio"):
        v = formula(d, d.one_of(depth - 1, 0), pulses)
        if kind == "ratio":
            return f"({u}/(1 + {v}**2))"
        return f"({u} {'+' if kind == 'sum' else '*'} {v})"
    return {
        "tanh": f"np.tanh({u})",
        "pulse": f"np.exp(-{u}**2)",
        "well": f"(1/(1 + {u}**2))",
        "arctan": f"np.arctan({u})",
        "sin": f"np.sin({d.log(0.01, 2)!r}*{u})",
    }[kind]


def switched(d: Dice) -> str:
    """A formula that has another form beyond some zeros."""
    a, b = (formula(d, d.one_of(0, 1, 2)) for _ in range(2))
    level = f"({formula(d, d.one_of(1, 2))} - {d.uniform(-1, 1)!r})"
    switch = d.one_of(level, formula(d, 0), formula(d, 2, pulses=False))
    return d.one_of(
        f"{a}*np.sign({switch})",
        f"np.where({switch} > 0, {a}, {b})",
        f"np.abs({switch}) + {a}",
        f"np.maximum({a}, {b})",
        f"{a} + {b}*np.heaviside({switch}, 0.5)",
    )


def try_formulas(number: int, talk: bool = False) -> Report:
    """The field of a definition, on the side where each point is, beside what was written."""
    d = Dice(number)
    parts = [switched(d) for _ in range(d.one_of(1, 1, 2))]
    if d.chance(0.3):
        parts[0] = f"{parts[0]} - {switched(d)}"
    written = f"({', '.join(parts)},{'' if len(parts) == 2 else ' 0*s.y'})"
    source = f'f = fp.system(state="x y")(lambda t, s, p: {written})'
    if talk:
        print(source)
    report = Report()
    space: dict[str, Any] = {"np": np, "fp": fp}
    try:
        exec(source, space)
    except Exception as error:
        report.counts["formulas", "definition", "wrong"] += 1
        report.failures.append(f"--case formulas:{number}  definition: {error!r}"[:600])
        return report
    n = 600
    wide = np.repeat([1.0, 30.0, 400.0], n // 3)
    t = np.abs(wide * d.random.uniform(-1, 1, n))
    x = wide * d.random.uniform(-1, 1, (2, n))
    f = space["f"]
    function = eval("lambda t, s: " + written, space)
    with np.errstate(all="ignore"):
        values = function(t, argparse.Namespace(x=x[0], y=x[1]))
    right = np.array([np.broadcast_to(v, n) for v in values])
    h = np.atleast_2d(f.h(t, x)) if f.surfaces else np.ones((0, n))
    wrong, compared = [], 0
    for i in range(n):
        if not np.all(np.abs(h[:, i]) > 1e-9) or not np.all(np.isfinite(right[:, i])):
            continue
        compared += 1
        side = [int(v) for v in np.sign(h[:, i])]
        got = f.field(t[i], x[:, i], side if len(side) != 1 else side[0])
        if not np.all(np.abs(got - right[:, i]) <= 1e-7 * (1 + np.abs(right[:, i]))):
            wrong.append(f"{got} for {right[:, i]} at t = {t[i]!r}, {x[:, i]}")
    if compared < n / 4 and not wrong:
        report.left_out += 1
        return report
    report.counts["formulas", "regions", "wrong" if wrong else "right"] += 1
    if wrong or talk:
        report.failures.append(
            f"--case formulas:{number}  {len(wrong)} of {n} points, {(wrong or ['right'])[0]}"
        )
    return report


# --- how often a short visit beyond zero is missed ----------------------------------------------


def visit(swings: float, q: float, number: int) -> tuple[Wave, float]:
    """What goes beyond 1 once between 0 and 1, for a part q of that time or of a swing; the end of
    the visit."""
    d = Dice(number)
    if not swings:
        top, middle = 1 + d.log(1e-2, 1), d.uniform(0.05 + q / 2, 0.95 - q / 2)
        return Wave([Term("bump", top, q / 2 / math.sqrt(top - 1), middle)]), middle + q / 2
    # a bump lifts one of the tops, long after the first step
    swing, middle = d.uniform(1, 1.1) / swings, d.uniform(0.1 if swings > 1 else 0.4, 0.9)
    w, rate = q * swing / 2, 2 * math.pi / swing
    lift = (1 - 0.9 * math.cos(math.pi * q)) * (1 + (w / (swing / 2)) ** 2)
    return (
        Wave([Term("wave", 0.9, rate, -rate * middle), Term("bump", lift, swing / 2, middle)]),
        middle + w,
    )


def misses(n: int) -> None:
    """Print the share of visits of s beyond 1, in slides of length 1 at rest, that are missed.

    The tolerance is below the height of each: 3e-10."""
    parts = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-5)
    print("| swings in a slide | by | " + " | ".join(f"{q:g}" for q in parts) + " |")
    print("|---" * (2 + len(parts)) + "|")
    for swings in (0, 1, 10, 100, 1000):
        missed = Counter[tuple[str, float]]()
        for q in parts:
            for number in range(n):
                wave, end = visit(swings, q, number)
                space: dict[str, Any] = {"np": np, "fp": fp}
                source = f'fp.system(state="x")(lambda t, s, p: ({wave.text("t")} - np.sign(s.x),))'
                exec("f = " + source, space)
                for method in ("dopri5", "dop853", "rodas5p"):
                    run = fp.simulate(
                        space["f"], [0.0], (0, 1), method=method, rtol=1e-10, atol=1e-10
                    )
                    exits = run.events["t"][run.events["kind"] == "exit_sliding"]
                    missed[method, q] += not np.any(exits <= end)
        for method in ("dopri5", "dop853", "rodas5p"):
            shares = [missed[method, q] / n for q in parts]
            row = " | ".join(f"{100 * share:.3g} %" if share else "0" for share in shares)
            print(f"| {swings or 'one bump'} | {method} | {row} |", flush=True)


#: Families without trajectories of their own.
OTHERS = {"diagrams": try_diagram, "formulas": try_formulas}


def one(job: tuple[str, int], talk: bool = False) -> Report:
    family, number = job
    if family in OTHERS:
        return OTHERS[family](number, talk)
    return try_problem(family, number, talk)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a few of each family")
    parser.add_argument("--problems", type=int, default=200, help="of each family")
    parser.add_argument("--family", help="one only: " + ", ".join([*FAMILIES, *OTHERS]))
    parser.add_argument("--first", type=int, default=0, help="number of the first problem")
    parser.add_argument("--case", help="one problem in detail, as reports name it: slides:17")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--show", type=int, default=60, help="how many failures are listed")
    parser.add_argument(
        "--misses", type=int, default=0,
        help="a table instead: how often short visits beyond zero are missed, from so many each",
    )  # fmt: skip
    parser.add_argument("--json", help="write the counts to this file")
    args = parser.parse_args()
    if args.misses:
        misses(args.misses)
        return 0
    if args.case:
        family, number = args.case.rsplit(":", 1)
        report = one((family, int(number)), talk=True)
        print("\n".join(report.failures))
        return int(any(key[2] == "wrong" for key in report.counts))
    families = [args.family] if args.family else [*FAMILIES, *OTHERS]
    n = 12 if args.quick else args.problems
    jobs = [(family, args.first + i) for family in families for i in range(n)]
    began = time.perf_counter()
    total = Report()
    with multiprocessing.Pool(args.processes) as pool:
        for report in pool.imap_unordered(one, jobs, chunksize=4):
            total.counts += report.counts
            total.failures += report.failures
            total.left_out += report.left_out
    rows: dict[tuple[str, str], Counter[str]] = {}
    for (family, method, verdict), count in sorted(total.counts.items()):
        rows.setdefault((family, method), Counter())[verdict] += count
    print(f"{'family':12} {'by':20} {'right':>8} {'delicate':>9} {'wrong':>7}")
    for (family, method), row in rows.items():
        print(f"{family:12} {method:20} {row['right']:8} {row['delicate']:9} {row['wrong']:7}")
    whole = Counter[str]()
    for row in rows.values():
        whole += row
    print(f"{whole.total()} runs: {dict(whole)}; {time.perf_counter() - began:.0f} s")
    print("\n".join(sorted(total.failures)[: args.show]))
    if args.json:
        counts = {" ".join(key): value for key, value in total.counts.items()}
        results = {"counts": counts, "failures": total.failures}
        Path(args.json).write_text(json.dumps(results, indent=2))
    return int(whole["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main())
