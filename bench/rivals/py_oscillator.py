# SPDX-License-Identifier: BSD-3-Clause
"""What the rivals from Python share: the two cases, the end of the stick, the verdict at the belt.

The same formulas as in oscillator.hpp. Needs no package; where numba is installed, it compiles
them, so that an integrator is not charged for Python's arithmetic.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

try:
    from numba import njit
except ImportError:

    def njit(function):
        return function


PERIODS = 200
TWO_PI = 2 * math.pi
BELT = 1.0  # V
EDGE = 4.0  # (alpha + beta) m g
TOUCHES, STICKS, CROSSES = 0, 1, 2


@dataclass(frozen=True)
class Case:
    """Forcing, and what is known of the end: from (0, 0), 200 periods."""

    name: str
    A: float
    omega: float
    y: float
    v: float
    events: int

    @property
    def t_end(self):
        return PERIODS * TWO_PI / self.omega

    def error(self, y, v):
        return max(abs(y - self.y), abs(v - self.v))


# Final states in quadruple precision, by the method of make_reference.cpp. That of "crossing" is
# the state after 50 periods too, reference_5_160: the orbit has settled by then.
CASES = (
    Case("stick-slip", 0.5, 2.94, 5.573365854277107660665e-02, 7.397537135751244343693e-01, 100),
    Case("crossing", 5.0, 1.6, -8.546641649393818892977e-01, 2.002066128783519719801e00, 403),
)


@dataclass(frozen=True)
class Rival:
    """One method: prepare(case, tolerance) compiles what is to be compiled, and is not timed.

    It returns a function without arguments that gives the final state, one number after the other,
    and the number of events (None where the method knows of none); or None if it has no such case.
    """

    name: str
    tolerances: tuple[float, ...]
    prepare: Callable[..., Callable[[], tuple] | None]
    apart: str = ""  # the module's name, where a run may not return: in a process of its own


def powers_of_ten(first, last):
    return tuple(float(f"1e-{k}") for k in range(first, last + 1))


@njit
def safe_time(gap, rate, m):
    """Largest dt in which a gap of curvature at most m, closing at that rate, must stay open."""
    root = math.sqrt(rate * rate + 2 * m * gap)
    return 2 * gap / (rate + root) if rate > 0 else (root - rate) / m


@njit
def stick_end(A, omega, phi, y):
    """Time until |q| = 4, q = A cos(omega t) - y, y' = V, and the side of the slip that follows.

    Marches by steps that cannot pass a root since |q''| <= A omega^2; they become Newton's.
    """
    m = abs(A) * omega * omega + 1e-300
    dt = max(0.0, (EDGE - abs(A) - y) / BELT) if abs(A) - y < EDGE else 0.0
    while True:
        q = A * math.cos(phi + omega * dt) - (y + BELT * dt)
        rise = -A * omega * math.sin(phi + omega * dt) - BELT
        if q <= -EDGE:
            return dt, 1.0
        if q >= EDGE:
            return dt, -1.0
        to_lower = safe_time(q + EDGE, -rise, m)
        to_upper = safe_time(EDGE - q, rise, m)
        step = min(to_lower, to_upper)
        dt += step
        if m * step * step <= 1e-16 * abs(rise) or step < 1e-16 + 4e-16 * dt:
            return dt, 1.0 if to_lower < to_upper else -1.0


@njit
def arrival(side, q):
    """What an arrival out of S1 (side = +1) or S2 (side = -1) leads to."""
    if side * q + EDGE <= 0:
        return TOUCHES
    return STICKS if side * q < EDGE else CROSSES


@njit
def advance(phi, periods_left, dphi):
    """Phase of the forcing, kept below 2 pi so that it loses no digits, and periods to go."""
    phi += dphi
    while phi >= TWO_PI:
        phi -= TWO_PI
        periods_left -= 1
    return phi, periods_left
