# SPDX-License-Identifier: BSD-3-Clause
#
# pip install scipy numpy
"""The friction smoothed by an arctangent, given to scipy's stiff solvers.

v' = -y + A cos(omega t) - (2/pi) atan(c1 (v - V)) 10 mu(|v - V|), c1 = 1e8: 20 periods from (0, 0)
at (A, omega) = (0.5, 2.94). The error is that against the event-driven solution, by DOP853 at
1e-12; of it the smoothing itself makes about 2e-4. Each solver runs with its own differences for
the Jacobian and with the analytic one; the error is given beside what the solver says of itself.
"""

import math
import time

import numpy as np
from py_oscillator import BELT, CASES, TWO_PI
from py_scipy import follow
from scipy.integrate import solve_ivp

STEEPNESS = 1e8  # c1
T_END = 20 * TWO_PI / CASES[0].omega
SECONDS = 60.0  # that a run may take


class TooSlow(Exception):
    """The run has taken longer than it may."""


def make_problem(case):
    """Field and Jacobian; after so many seconds the field raises TooSlow."""
    deadline = time.monotonic() + SECONDS

    def friction(r):
        return 3 / (1 + 1.42 * r) + 1 + 0.1 * r * r

    def field(t, x):
        if time.monotonic() > deadline:
            raise TooSlow
        y, v = x.tolist()
        sign = 2 / math.pi * math.atan(STEEPNESS * (v - BELT))
        return v, case.A * math.cos(case.omega * t) - y - sign * friction(abs(v - BELT))

    def jacobian(t, x):
        s = x[1] - BELT
        r, steep = abs(s), STEEPNESS * s
        by_sign = 2 / math.pi * STEEPNESS / (1 + steep * steep) * friction(r)
        falling = 0.2 * r - 3 * 1.42 / (1 + 1.42 * r) ** 2
        by_r = 2 / math.pi * math.atan(steep) * falling * math.copysign(1.0, s)
        return np.array([[0.0, 1.0], [-1.0, -by_sign - by_r]])

    return field, jacobian


def solve(case, method, with_jacobian, tol):
    """End of the run and what the solver says; the end is None where there is none."""
    field, jacobian = make_problem(case)
    more = {"jac": jacobian} if with_jacobian else {}
    try:
        run = solve_ivp(field, (0, T_END), (0, 0), method=method, rtol=tol, atol=tol, **more)
    except TooSlow:
        return None, f"stopped after {SECONDS:g} s"
    if not run.success:
        return None, f"{run.message} (t = {run.t[-1]:.3g})"
    return run.y[:, -1], "success"


def compare(quick):
    case = CASES[0]
    exact, _ = follow(
        (0.0, 0.0), T_END, case.A, case.omega, method="DOP853", rtol=1e-12, atol=1e-12
    )
    print(f"\nsmoothed, c1 = {STEEPNESS:.0e}\n{'method':16} {'tol':>6} {'error':>9} {'ms':>10}")
    rows = []
    for method in ("BDF", "Radau", "LSODA"):
        for with_jacobian in (False, True):
            name = f"scipy {method}{' + jac' if with_jacobian else ''}"
            for tol in (1e-4,) if quick else (1e-4, 1e-6, 1e-8, 1e-10):
                start = time.process_time()
                end, says = solve(case, method, with_jacobian, tol)
                ms = 1e3 * (time.process_time() - start)
                error = None if end is None else float(np.abs(end - exact).max())
                shown = "-" if error is None else f"{error:.1e}"
                print(f"{name:16} {tol:6.0e} {shown:>9} {ms:10.1f}  {says}", flush=True)
                row = {"case": "smoothed", "method": name, "tol": tol, "error": error, "ms": ms}
                rows.append({**row, "says": says})
    return rows
