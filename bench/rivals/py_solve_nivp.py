# SPDX-License-Identifier: BSD-3-Clause
#
# pip install solve_nivp (MIT)
"""solve_nivp: implicit steps in which a multiplier w is projected onto sign(h). No events.

As in the package's own example of a sliding mode: each w is a component of the state without a
rate, and so is h where it is no component by itself; semismooth Newton with the exact Jacobian.
The other projection of the package, Coulomb's cone, takes some 30 times as long on P1. Its steps
are the composite one (the default) and the trapezoidal one, of order 2 both. The multipliers count
in no error. The length of Newton's projected step, lam, is held at 1e-3: adapted, as by default,
P15 goes wrong; at 0.01 or more, Newton's method does not converge where P2 crosses.
"""

import math
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded

import numpy as np
from py_oscillator import BELT, CASES, Rival
from solve_nivp import solve_ivp_ns

VERSION = version("solve_nivp")


@dataclass(frozen=True)
class Inclusion:
    """A y' = f(t, y), whose components w are in sign(y_h)."""

    f: Callable
    jacobian: Callable
    start: Sequence[float]
    t_end: float
    h: list[int]
    w: list[int]
    end_of: Callable = tuple  # the state that is compared
    without_rate: tuple[int, ...] = ()  # besides w

    def rateless(self):
        return sorted({*self.w, *self.without_rate})


def oscillator(case):
    """(y, r, w), r = v - V."""

    def friction(r):
        return 3 / (1 + 1.42 * abs(r)) + 1 + 0.1 * r * r

    def f(t, x, Fk=None):
        y, r, w = x
        return np.array([r + BELT, case.A * math.cos(case.omega * t) - y - friction(r) * w, 0.0])

    def jacobian(t, x, Fk=None):
        _, r, w = x
        slope = math.copysign(1.0, r) * (0.2 * abs(r) - 4.26 / (1 + 1.42 * abs(r)) ** 2)
        return np.array([[0, 1, 0], [-1, -slope * w, -friction(r)], [0, 0, 0]])

    return Inclusion(
        f, jacobian, (0, -BELT, -1), case.t_end, [1], [2], lambda x: (x[0], x[1] + BELT)
    )


def linear(matrix, start, t_end, h, w, **more):
    matrix = np.array(matrix, dtype=float)

    def f(t, x, Fk=None):
        return matrix @ x

    def jacobian(t, x, Fk=None):
        return matrix

    return Inclusion(f, jacobian, start, t_end, h, w, **more)


def coulomb():
    """P1: (x, v, w); it starts at v = 0, from where it goes to v < 0."""
    matrix = [[0, 1, 0], [-1, 0, -0.4], [0, 0, 0]]
    return linear(matrix, (3, 0, -1), 20.0, [1], [2], end_of=lambda x: (x[0], x[1]))


def unit_circle():
    """P2: (x, y, h, w), h = x^2 + y^2 - 1 without a rate."""
    omega = -2 * math.pi

    def f(t, u, Fk=None):
        x, y, h, w = u
        return np.array(
            [x - omega * w * y, y + omega * w * x, h - (x * x + y * y - 1), 0.0],
        )

    def jacobian(t, u, Fk=None):
        x, y, _, w = u
        return np.array(
            [
                [1, -omega * w, 0, -omega * y],
                [omega * w, 1, 0, omega * x],
                [-2 * x, -2 * y, 1, 0],
                [0, 0, 0, 0],
            ],
        )

    x = math.exp(-1)
    start = (x, 0, x * x - 1, -1)
    return Inclusion(
        f, jacobian, start, math.pi / 2, [2], [3], lambda u: (u[0], u[1]), without_rate=(2,)
    )


def dieci_lopez():
    """P4: (x, r, w), r = y - 0.2."""

    def f(t, x, Fk=None):
        return np.array([x[1] + 0.2, -x[0] - x[2] / (1 + abs(x[1])), 0.0])

    def jacobian(t, x, Fk=None):
        size = 1 / (1 + abs(x[1]))
        slope = -math.copysign(1.0, x[1]) * size * size
        return np.array([[0, 1, 0], [-1, -slope * x[2], -size], [0, 0, 0]])

    return Inclusion(f, jacobian, (0, -0.2, -1), 50.0, [1], [2], lambda x: (x[0], x[1] + 0.2))


def relay():
    """P6: (x, y, z, w), zeta = 0.05, omega = 25; it starts in a slide, w = y."""
    matrix = [[-3.5, 1, 0, -1], [-627.5, 0, 1, 2], [-625, 0, 0, -1], [0, 0, 0, 0]]
    start = (0, -0.001, -0.02, -0.001)
    return linear(matrix, start, 20.0, [0], [3], end_of=lambda x: (x[0], x[1], x[2]))


def stiff():
    """P8: (x, w), lambda = 1000."""

    def f(t, x, Fk=None):
        return np.array([-1000 * (x[0] - math.cos(t)) * x[1], 0.0])

    def jacobian(t, x, Fk=None):
        return np.array([[-1000 * x[1], -1000 * (x[0] - math.cos(t))], [0, 0]])

    return Inclusion(f, jacobian, (1, 1), 1.5, [0], [1], lambda x: (x[0],))


def spiral():
    """P15: (x, y, r, s), r in sign(x) and s in sign(y)."""
    matrix = [[0, 0, -1, 2], [0, 0, -2, -1], [0, 0, 0, 0], [0, 0, 0, 0]]
    return linear(matrix, (0, 1, 1, 1), 1.0, [0, 1], [2, 3], end_of=lambda x: (x[0], x[1]))


PROBLEMS = {
    **{case.name: oscillator(case) for case in CASES},
    "P1": coulomb(),
    "P2": unit_circle(),
    "P4": dieci_lopez(),
    "P6": relay(),
    "P8": stiff(),
    "P15": spiral(),
}


def follow(problem, method, tol):
    n = len(problem.start)
    rateless = problem.rateless()
    mass = np.diag([0.0 if i in rateless else 1.0 for i in range(n)])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        t, x, *_ = solve_ivp_ns(
            fun=problem.f,
            t_span=(0.0, problem.t_end),
            y0=np.array(problem.start, dtype=float),
            method=method,
            projection="sign",
            solver="semismooth_newton",
            projection_opts={"y_indices": problem.h, "w_indices": problem.w},
            solver_opts={"rhs_jac": problem.jacobian, "adaptive_lam": False, "lam": 1e-3},
            adaptive_opts={"skip_error_indices": rateless},
            atol=tol,
            rtol=tol,
            h0=1e-3,
            component_slices=[slice(i, i + 1) for i in range(n)],
            A=mass,
        )
    if t[-1] < problem.t_end:
        raise RuntimeError(f"ends at t = {t[-1]:.6g}")
    return *(float(part) for part in problem.end_of(x[-1])), None


def prepare(method, case, tol):
    return partial(follow, PROBLEMS[case.name], method, tol)


RIVALS = [
    Rival(
        f"solve_nivp {method}",
        (1e-3, 1e-4, 1e-5, 1e-6),
        partial(prepare, method),
        apart=__name__,
    )
    for method in ("composite", "trapezoidal")
]
PROBLEM_RIVALS = RIVALS
