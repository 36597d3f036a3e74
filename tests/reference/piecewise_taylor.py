# SPDX-License-Identifier: BSD-3-Clause
"""A Taylor integrator of any precision for piecewise smooth systems, for reference values.

It shares no code with the library, nor its methods: right sides and equivalent controls are
written by hand, Taylor coefficients come from recurrences, events are roots of the Taylor
polynomials, and every mode is tried where surfaces are met.

- `Tape` and `Series`: expressions; coefficient k of each follows from lower ones, so a step of
  order n takes O(n^2) operations.
- `Problem`: a system, its surfaces, its start and end.
- `solve`: the event loop. Roots are isolated by bounds and bisection, without samples, so that no
  pair of roots is missed, and refined by Newton's method at full precision. The next mode is found
  by a test of every combination of -1, 0 and 1 on the surfaces that the point is on: a side needs
  the first nonzero coefficient of h to have its sign, a slide an equivalent control between -1 and
  1, or at one of them and on its way inwards. Unless exactly one combination passes it is an error.
- `solve_twice`: the same at two precisions and orders, compared.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

from mpmath import mp, mpf

Mode = tuple[int, ...]
Coefficients = list[mpf]


class Tape:
    """Expressions in the order in which their coefficients are to be computed."""

    def __init__(self) -> None:
        self.entries: list[Series] = []

    def constant(self, value: mpf | int | str) -> Series:
        return Constant(self, value)

    def cosine(self, frequency: str) -> Series:
        """cos(frequency * t)."""
        return Cosine(self, frequency)

    def wrap(self, value: Series | mpf | int) -> Series:
        return value if isinstance(value, Series) else Constant(self, value)

    def compute(self, start: Sequence[mpf], t: mpf, order: int) -> None:
        """All coefficients up to `order` at time t; `start` belongs to the tape's states."""
        for entry in self.entries:
            entry.c = []
        states = [entry for entry in self.entries if isinstance(entry, State)]
        for state, value in zip(states, start, strict=True):
            state.start = value
        for k in range(order + 1):
            for entry in self.entries:
                entry.c.append(entry.coefficient(k, t))


class Series:
    """A quantity on a tape with its Taylor coefficients c."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.c: Coefficients = []
        tape.entries.append(self)

    def coefficient(self, k: int, t: mpf) -> mpf:
        raise NotImplementedError

    def sqrt(self) -> Series:
        return Root(self)

    def __add__(self, other: Series | mpf | int) -> Series:
        return Sum(self, self.tape.wrap(other))

    def __sub__(self, other: Series | mpf | int) -> Series:
        return Difference(self, self.tape.wrap(other))

    def __rsub__(self, other: mpf | int) -> Series:
        return Difference(self.tape.wrap(other), self)

    def __mul__(self, other: Series | mpf | int) -> Series:
        return Product(self, other) if isinstance(other, Series) else Multiple(self, other)

    def __truediv__(self, other: Series | mpf | int) -> Series:
        if isinstance(other, Series):
            return Quotient(self, other)
        return Multiple(self, mpf(1) / other)

    def __rtruediv__(self, other: mpf | int) -> Series:
        return Quotient(self.tape.wrap(other), self)

    def __neg__(self) -> Series:
        return Multiple(self, -1)

    __radd__ = __add__
    __rmul__ = __mul__


class State(Series):
    """A state; `rate` is its time derivative."""

    def __init__(self, tape: Tape) -> None:
        super().__init__(tape)
        self.start = mpf(0)
        self.rate: Series = self

    def coefficient(self, k: int, t: mpf) -> mpf:
        return self.rate.c[k - 1] / k if k else self.start


class Constant(Series):
    def __init__(self, tape: Tape, value: mpf | int | str) -> None:
        super().__init__(tape)
        self.value = mpf(value)

    def coefficient(self, k: int, t: mpf) -> mpf:
        return mpf(0) if k else self.value


class Cosine(Series):
    def __init__(self, tape: Tape, frequency: str) -> None:
        super().__init__(tape)
        self.frequency = mpf(frequency)

    def coefficient(self, k: int, t: mpf) -> mpf:
        w = self.frequency
        derivatives = (mp.cos, lambda q: -mp.sin(q), lambda q: -mp.cos(q), mp.sin)
        return w**k / mp.factorial(k) * derivatives[k % 4](w * t)


class Multiple(Series):
    def __init__(self, of: Series, factor: mpf | int) -> None:
        super().__init__(of.tape)
        self.of = of
        self.factor = mpf(factor)

    def coefficient(self, k: int, t: mpf) -> mpf:
        return self.factor * self.of.c[k]


class Root(Series):
    """The square root."""

    def __init__(self, of: Series) -> None:
        super().__init__(of.tape)
        self.of = of

    def coefficient(self, k: int, t: mpf) -> mpf:
        if k == 0:
            return mp.sqrt(self.of.c[0])
        lower = mp.fdot(zip(self.c[1:], reversed(self.c[1:]), strict=True))
        return (self.of.c[k] - lower) / (2 * self.c[0])


class Binary(Series):
    """An operation on two series."""

    def __init__(self, left: Series, right: Series) -> None:
        super().__init__(left.tape)
        self.left = left
        self.right = right


class Sum(Binary):
    def coefficient(self, k: int, t: mpf) -> mpf:
        return self.left.c[k] + self.right.c[k]


class Difference(Binary):
    def coefficient(self, k: int, t: mpf) -> mpf:
        return self.left.c[k] - self.right.c[k]


class Product(Binary):
    def coefficient(self, k: int, t: mpf) -> mpf:
        return mp.fdot(zip(self.left.c[: k + 1], reversed(self.right.c[: k + 1]), strict=True))


class Quotient(Binary):
    def coefficient(self, k: int, t: mpf) -> mpf:
        lower = mp.fdot(zip(self.right.c[1 : k + 1], reversed(self.c), strict=True))
        return (self.left.c[k] - lower) / self.right.c[0]


class Problem:
    """A piecewise smooth system with walls, from `start` at time 0 to time `end`.

    Numbers are decimal strings, so that they are exact at every precision. A mode has one entry
    for each surface: -1 or 1 for the side, 0 for a slide.
    """

    start: tuple[str, ...]
    end: str
    longest_step = "0.25"

    def surfaces(self, x: list[Series]) -> list[Series]:
        """h of each surface; its sign is the side."""
        raise NotImplementedError

    def may_slide(self, j: int, mode: Mode) -> bool:
        """Whether surface j can carry a slide in this mode at all."""
        return True

    def equivalent_control(self, j: int, x: list[Series], mode: Mode) -> Series | mpf:
        """s_j that keeps h_j = 0, for a mode that has a slide on surface j."""
        raise NotImplementedError

    def field(self, x: list[Series], s: list[Series], mode: Mode) -> list[Series | mpf | int]:
        """The right side; s_j is the equivalent control on a slide, else the side."""
        raise NotImplementedError

    def walls(self, x: list[Series]) -> list[Series]:
        """Functions that are positive inside; where one is 0 the state jumps."""
        return []

    def after_impact(self, wall: int, x: list[mpf]) -> list[mpf]:
        """The state just after a jump."""
        raise NotImplementedError


class Event(NamedTuple):
    """The lowest surface that changed, and the mode and the state just after.

    Walls are numbered after the surfaces.
    """

    t: mpf
    kind: str
    surface: int
    mode: Mode
    x: list[mpf]


class Solution(NamedTuple):
    """The events strictly between start and end, and the state at the end."""

    events: list[Event]
    end: list[mpf]


class Expansion(NamedTuple):
    """Taylor coefficients of the states, of h, of s and of the walls."""

    states: list[Coefficients]
    surfaces: list[Coefficients]
    controls: list[Coefficients]
    walls: list[Coefficients]


def tolerance() -> mpf:
    """Below this a number counts as zero: two thirds of the digits."""
    return mpf(10) ** -(2 * mp.dps // 3)


def polynomial(c: Sequence[mpf], u: mpf) -> mpf:
    value = mpf(0)
    for coefficient in reversed(c):
        value = value * u + coefficient
    return value


def shifted(c: Sequence[float], a: float) -> list[float]:
    """Coefficients in w of the polynomial at a + w."""
    p = list(c)
    for i in range(len(p) - 1):
        for j in range(len(p) - 2, i - 1, -1):
            p[j] += a * p[j + 1]
    return p


def refined_root(c: Coefficients, a: mpf, b: mpf) -> mpf:
    """The root between a and b, where the signs differ: Newton's method inside a bracket."""
    positive_at_a = polynomial(c, a) > 0
    slopes = [k * c[k] for k in range(1, len(c))]
    x = (a + b) / 2
    for _ in range(200):
        value = polynomial(c, x)
        if value == 0:
            return x
        if (value > 0) == positive_at_a:
            a = x
        else:
            b = x
        slope = polynomial(slopes, x)
        following = x - value / slope if slope else (a + b) / 2
        if abs(following - x) <= abs(x) * mpf(10) ** (2 - mp.dps):
            return following
        x = following if a < following < b else (a + b) / 2
    raise ArithmeticError("a root was not refined")


def first_root(c: Coefficients, step: mpf) -> mpf | None:
    """The earliest root in (0, step], or None."""
    scaled = [float(coefficient * step**k) for k, coefficient in enumerate(c)]
    rounding = 1e-15 * max(map(abs, scaled))

    def search(a: float, b: float) -> mpf | None:
        """The earliest root in (a, b], parts of the step."""
        middle = (a + b) / 2
        radius = (b - a) / 2
        p = shifted(scaled, middle)
        reach = sum(abs(p[k]) * radius**k for k in range(1, len(p)))
        if abs(p[0]) > reach + rounding:
            return None
        left = mpf(a) * step
        right = mpf(b) * step
        value_left = polynomial(c, left)
        value_right = polynomial(c, right)
        bend = sum(k * abs(p[k]) * radius ** (k - 1) for k in range(2, len(p)))
        if len(p) > 1 and abs(p[1]) > bend:  # monotone
            if value_left * value_right > 0:
                return None
            if value_left == 0:
                return left if a > 0 else None
            return refined_root(c, left, right)
        if b - a < 1e-7:
            raise ArithmeticError("two roots are too close to be told apart")
        root = search(a, middle)
        return search(middle, b) if root is None else root

    return search(0.0, 1.0)


def without_zero(c: Coefficients) -> Coefficients:
    """Divided by the time as often as it can be: the root at 0 is known."""
    return list(itertools.dropwhile(lambda coefficient: abs(coefficient) <= tolerance(), c))


def leading_sign(c: Sequence[mpf]) -> int:
    """The sign of the first of twelve coefficients that is not zero, else 0."""
    for coefficient in c[:12]:
        if abs(coefficient) > tolerance():
            return 1 if coefficient > 0 else -1
    return 0


def margins(control: Coefficients) -> tuple[Coefficients, Coefficients]:
    """1 - s and 1 + s: both are positive inside a slide."""
    upper = [1 - control[0]] + [-coefficient for coefficient in control[1:]]
    lower = [1 + control[0], *control[1:]]
    return upper, lower


class Trajectory:
    """The state of the event loop."""

    def __init__(self, problem: Problem, order: int) -> None:
        self.problem = problem
        self.order = order
        self.tapes: dict[Mode, tuple[Tape, list[list[Series]]]] = {}
        self.t = mpf(0)
        self.end = mpf(problem.end)
        self.x = [mpf(value) for value in problem.start]
        self.touched: list[int] = []  # surfaces that the point is on, only just after an event
        self.hit: list[int] = []  # the same of walls
        self.mode: Mode = ()
        self.mode = self.next_mode((0,) * len(self.surface_values()))

    def surface_values(self) -> list[mpf]:
        """The values of all h."""
        tape = Tape()
        surfaces = self.problem.surfaces([tape.constant(value) for value in self.x])
        tape.compute([], self.t, 0)
        return [surface.c[0] for surface in surfaces]

    def expand(self, mode: Mode, order: int) -> Expansion:
        """All Taylor coefficients at the current point in the given mode."""
        if mode not in self.tapes:
            tape = Tape()
            states = [State(tape) for _ in self.x]
            surfaces = self.problem.surfaces(states)
            controls = [
                tape.wrap(side or self.problem.equivalent_control(j, states, mode))
                for j, side in enumerate(mode)
            ]
            rates = self.problem.field(states, controls, mode)
            for state, rate in zip(states, rates, strict=True):
                state.rate = tape.wrap(rate)
            walls = self.problem.walls(states)
            self.tapes[mode] = tape, [states, surfaces, controls, walls]
        tape, groups = self.tapes[mode]
        tape.compute(self.x, self.t, order)
        return Expansion(*[[series.c for series in group] for group in groups])

    def is_consistent(self, mode: Mode, touched: list[int]) -> bool:
        """Whether the flow of this mode stays in it, as far as the touched surfaces tell."""
        if any(mode[j] == 0 and not self.problem.may_slide(j, mode) for j in touched):
            return False
        expansion = self.expand(mode, 14)
        for j in touched:
            rate = expansion.surfaces[j][1:]
            if mode[j]:
                if leading_sign(rate) != mode[j]:
                    return False
            elif abs(rate[0]) >= tolerance():  # the flow leaves the surface
                return False
            else:
                upper, lower = margins(expansion.controls[j])
                if leading_sign(upper) <= 0 or leading_sign(lower) <= 0:
                    return False
        return True

    def next_mode(self, mode: Mode) -> Mode:
        """The only consistent mode at the current point; surfaces away from it keep their side."""
        values = self.surface_values()
        self.touched = [j for j, value in enumerate(values) if abs(value) < tolerance()]
        choices = [
            (-1, 0, 1) if j in self.touched else (1 if values[j] > 0 else -1,)
            for j in range(len(mode))
        ]
        consistent = [
            candidate
            for candidate in itertools.product(*choices)
            if self.is_consistent(candidate, self.touched)
        ]
        if len(consistent) != 1:
            raise ArithmeticError(f"at t = {self.t} the consistent modes are {consistent}")
        return consistent[0]

    def step_length(self, expansion: Expansion) -> mpf:
        """A step on which the last two terms of the series stay below the precision."""
        step = min(mpf(self.problem.longest_step), self.end - self.t)
        precision = mpf(10) ** -mp.dps
        for c in expansion.states + expansion.controls:
            for k in (self.order - 1, self.order):
                if c[k]:
                    step = min(step, mpf("0.9") * (precision / abs(c[k])) ** (mpf(1) / k))
        return step

    def watched(self, expansion: Expansion) -> list[tuple[Coefficients, int | None]]:
        """Functions whose first root ends the mode, and the wall that each belongs to, if any.

        A root at the current point is taken out.
        """
        functions: list[tuple[Coefficients, int | None]] = []
        for j, side in enumerate(self.mode):
            if side:
                h = expansion.surfaces[j]
                functions.append((without_zero(h) if j in self.touched else h, None))
                continue
            for margin in margins(expansion.controls[j]):
                at_limit = abs(margin[0]) <= tolerance()
                functions.append((without_zero(margin) if at_limit else margin, None))
        for i, wall in enumerate(expansion.walls):
            functions.append((without_zero(wall) if i in self.hit else wall, i))
        return functions

    def advance(self) -> Event | None:
        """One step, to the next event or as far as the series reaches."""
        expansion = self.expand(self.mode, self.order)
        length = self.step_length(expansion)
        found = [
            (root, wall)
            for c, wall in self.watched(expansion)
            if c and (root := first_root(c, length)) is not None
        ]
        step = min((root for root, _ in found), default=length)
        self.x = [polynomial(c, step) for c in expansion.states]
        self.t += step
        self.touched = []
        self.hit = [wall for root, wall in found if wall is not None and root <= step + tolerance()]
        if not found:
            return None
        for wall in self.hit:
            self.x = self.problem.after_impact(wall, self.x)
        before = self.mode
        self.mode = self.next_mode(before)
        if self.hit:
            return Event(self.t, "jump", len(before) + self.hit[0], self.mode, self.x)
        changed = [j for j in range(len(before)) if self.mode[j] != before[j]]
        if not changed:
            raise ArithmeticError(f"at t = {self.t} a surface was touched and nothing changed")
        surface = changed[0]
        if self.mode[surface] == 0:
            kind = "enter_sliding"
        elif before[surface] == 0:
            kind = "exit_sliding"
        else:
            kind = "cross"
        return Event(self.t, kind, surface, self.mode, self.x)


def solve(problem: Problem, order: int) -> Solution:
    """The solution at mpmath's current precision."""
    trajectory = Trajectory(problem, order)
    events = []
    while trajectory.t < trajectory.end:
        event = trajectory.advance()
        if event is not None:
            events.append(event)
    return Solution(events, trajectory.x)


def solve_twice(problem: Problem, agreement: str = "1e-30") -> Solution:
    """The solution with 72 digits and order 70; one with 50 and 45 must have the same events.

    Every time and every state of the two must agree to the absolute difference `agreement`.
    """
    solutions = []
    for digits, order in ((50, 45), (72, 70)):
        mp.dps = digits
        solutions.append(solve(problem, order))
    coarse, fine = solutions
    history = [
        [(event.kind, event.surface, event.mode) for event in run.events] for run in solutions
    ]
    assert history[0] == history[1], "two precisions give different events"
    pairs = list(zip(coarse.end, fine.end, strict=True))
    for one, other in zip(coarse.events, fine.events, strict=True):
        pairs.append((one.t, other.t))
        pairs.extend(zip(one.x, other.x, strict=True))
    difference = max(abs(a - b) for a, b in pairs)
    assert difference < mpf(agreement), f"two precisions differ by {mp.nstr(difference, 3)}"
    return fine
