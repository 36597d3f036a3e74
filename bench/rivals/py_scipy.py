# SPDX-License-Identifier: BSD-3-Clause
#
# pip install scipy
"""scipy's solve_ivp, restarted at events: the loop of scipy_jobs/by_scipy.py.

BDF and Radau stop at 1e-8, where they take ten times as long as the explicit methods.
"""

import sys
from functools import partial
from pathlib import Path

import scipy
from py_oscillator import PERIODS, TWO_PI, Rival, powers_of_ten

sys.path.append(str(Path(__file__).parents[1]))
from scipy_jobs.by_scipy import follow

VERSION = scipy.__version__


def prepare(method, case, tol):
    def run():
        t_end = PERIODS * TWO_PI / case.omega
        how = {"method": method, "rtol": tol, "atol": tol}
        (y, v), events = follow((0.0, 0.0), t_end, case.A, case.omega, **how)
        return y, v, len(events)

    return run


RIVALS = [
    Rival(f"scipy {method}", powers_of_ten(4, last), partial(prepare, method))
    for method, last in (("RK45", 11), ("DOP853", 11), ("LSODA", 11), ("BDF", 8), ("Radau", 8))
]
