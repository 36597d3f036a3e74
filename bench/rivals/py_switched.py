# SPDX-License-Identifier: BSD-3-Clause
"""Problems for the rivals from Python, besides the oscillator; all but one with one surface.

Fields take and give sequences of Python's numbers, which is quickest where there are two or three:
`fields[mode](t, x)` with mode -1 where h < 0, +1 where h > 0 and 0 in a slide, whose field and
control s are Utkin's, worked out by hand as a user would.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

State = Sequence[float]
Field = Callable[[float, State], tuple[float, ...]]


@dataclass(frozen=True)
class KnownEnd:
    """Where a problem starts, how long it runs and what is known of its end."""

    name: str
    start: tuple[float, ...]
    t_end: float
    end: tuple[float, ...]
    events: float

    def error(self, *x):
        return max(abs(a - b) for a, b in zip(x, self.end, strict=True))


@dataclass(frozen=True)
class Problem(KnownEnd):
    """A problem with one surface."""

    fields: dict[int, Field]
    h: Callable[[State], float]
    normal_speed: Callable[[State, State], float]  # of h along a slope f: (x, f)
    control: Callable[[State], float]  # s in a slide, which ends at +-1; linear in all of these

    def mode_on_surface(self, t, x):
        """0 where both fields point to the surface, else the side to which they lead."""
        below, above = (self.normal_speed(x, self.fields[side](t, x)) for side in (-1, 1))
        return 0 if below > 0 > above else 1 if above >= 0 else -1

    def start_mode(self):
        h = self.h(self.start)
        return self.mode_on_surface(0.0, self.start) if h == 0 else -1 if h < 0 else 1


def coulomb():
    """P1: x'' = -x - 0.4 sign x'."""
    mu = 0.4
    fields = {
        -1: lambda t, x: (x[1], mu - x[0]),
        0: lambda t, x: (0.0, 0.0),
        1: lambda t, x: (x[1], -mu - x[0]),
    }
    return Problem(
        "P1",
        fields=fields,
        h=lambda x: x[1],
        normal_speed=lambda x, f: f[1],
        control=lambda x: -x[0] / mu,
        start=(3.0, 0.0),
        t_end=20.0,
        end=(-0.2, 0.0),
        events=4,
    )


def unit_circle():
    """P2: outward spirals that turn one way inside the unit circle and the other way outside."""
    w = -2 * math.pi
    fields = {
        -1: lambda t, x: (x[0] + w * x[1], x[1] - w * x[0]),
        1: lambda t, x: (x[0] - w * x[1], x[1] + w * x[0]),
    }
    radius, angle = math.exp(math.pi / 2 - 1), math.pi**2  # exact
    return Problem(
        "P2",
        fields=fields,
        h=lambda x: x[0] * x[0] + x[1] * x[1] - 1,
        normal_speed=lambda x, f: 2 * (x[0] * f[0] + x[1] * f[1]),
        control=lambda x: 0.0,
        start=(math.exp(-1), 0.0),
        t_end=math.pi / 2,
        end=(radius * math.cos(angle), -radius * math.sin(angle)),
        events=1,
    )


def dieci_lopez():
    """P4: Dieci & Lopez (2009). The end is that of dop853 in extended precision at 1e-17."""
    v = 0.2
    fields = {
        -1: lambda t, x: (x[1], -x[0] + 1 / (1 + v - x[1])),
        0: lambda t, x: (v, 0.0),
        1: lambda t, x: (x[1], -x[0] - 1 / (1 - v + x[1])),
    }
    return Problem(
        "P4",
        fields=fields,
        h=lambda x: x[1] - v,
        normal_speed=lambda x, f: f[1],
        control=lambda x: -x[0],
        start=(0.0, 0.0),
        t_end=50.0,
        end=(0.74647431470441217, 0.2),
        events=11,
    )


def relay():
    """P6: relay feedback of third order. The end is that of dop853 at 1e-17."""
    zeta, omega = 0.05, 25.0
    a1, a2, a3 = 2 * zeta * omega + 1, 2 * zeta * omega + omega**2, omega**2
    b1, b2, b3 = 1.0, -2.0, 1.0

    def driven(x, u):
        y = x[0]
        return x[1] - a1 * y + b1 * u, x[2] - a2 * y + b2 * u, b3 * u - a3 * y

    fields = {
        -1: lambda t, x: driven(x, 1.0),
        0: lambda t, x: driven(x, -x[1] / b1),
        1: lambda t, x: driven(x, -1.0),
    }
    return Problem(
        "P6",
        fields=fields,
        h=lambda x: x[0],
        normal_speed=lambda x, f: f[0],
        control=lambda x: x[1] / b1,
        start=(0.0, -0.001, -0.02),
        t_end=20.0,
        end=(-0.0095452202495844, -0.90120706566785359, -1.6246924472183426),
        events=77,
    )


def stiff():
    """P8, which ends before it meets its surface."""
    rate, t_end = 1000.0, 1.5
    fields = {
        -1: lambda t, x: (rate * (x[0] - math.cos(t)),),
        1: lambda t, x: (-rate * (x[0] - math.cos(t)),),
    }
    exact = rate * (rate * math.cos(t_end) + math.sin(t_end)) / (1 + rate * rate)
    return Problem(
        "P8",
        fields=fields,
        h=lambda x: x[0],
        normal_speed=lambda x, f: f[0],
        control=lambda x: 0.0,
        start=(1.0,),
        t_end=t_end,
        end=(exact,),
        events=0,
    )


def infinitely_many_crossings():
    """P15: x' = -sign x + 2 sign y, y' = -2 sign x - sign y, at rest from t = 0.5."""
    return KnownEnd("P15", start=(0.0, 1.0), t_end=1.0, end=(0.0, 0.0), events=math.inf)


PROBLEMS = (
    coulomb(),
    unit_circle(),
    dieci_lopez(),
    relay(),
    stiff(),
    infinitely_many_crossings(),
)
