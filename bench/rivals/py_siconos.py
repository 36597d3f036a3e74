# SPDX-License-Identifier: BSD-3-Clause
#
# Debian: python3-siconos, which Debian's own python3 imports
"""Siconos, time stepping: the block on the belt as a first order system with a relay.

x' = A x + b + (0, lambda), lambda in -4 Sgn(v - V): the jump of the friction is the relay, its
continuous rest (10 mu(|u|) - 4) sgn(u), u = V - v, and the forcing go into b, set before each step
for its middle; v there is extrapolated, which makes the error up to 60 times smaller than v at the
step's start would. The "tolerance" is the step size. There are no events; where the block crosses
the belt's speed the method is of first order.

Usage: python3 py_siconos.py [--json FILE] [--quick]
"""

import math
import sys
from functools import partial

import numpy as np
import siconos
import siconos.kernel as sk
from py_oscillator import BELT, EDGE, PERIODS, TWO_PI, Rival

VERSION = siconos.version


def smooth_force(case, t, v):
    """Forcing and the part of the friction that is continuous."""
    u = BELT - v
    friction = 3 / (1 + 1.42 * abs(u)) + 1 + 0.1 * u * u
    return case.A * math.cos(case.omega * t) + (friction - EDGE) * math.copysign(1.0, u)


def make_simulation(h, t_end):
    block = sk.FirstOrderLinearDS(np.zeros(2), np.array([[0.0, 1.0], [-1.0, 0.0]]))
    block.setbPtr(np.zeros(2))
    slip = sk.FirstOrderLinearTIR(np.array([[0.0, 1.0]]), np.array([[0.0], [1.0]]))
    slip.setePtr(np.array([-BELT]))
    model = sk.NonSmoothDynamicalSystem(0.0, t_end)
    model.insertDynamicalSystem(block)
    model.link(sk.Interaction(sk.RelayNSL(1, -EDGE, EDGE), slip), block)
    stepping = sk.TimeStepping(model, sk.TimeDiscretisation(0.0, h))
    stepping.insertIntegrator(sk.EulerMoreauOSI(0.5))
    stepping.insertNonSmoothProblem(sk.Relay())
    return block, stepping


def follow(case, h):
    """State after 200 periods from (0, 0)."""
    t_end = PERIODS * TWO_PI / case.omega
    n = math.ceil(t_end / h)
    h = t_end / n
    block, stepping = make_simulation(h, t_end + h)
    b, x = block.b(), block.x()
    before = x.copy()
    for i in range(n):
        b[1] = smooth_force(case, (i + 0.5) * h, 1.5 * x[1] - 0.5 * before[1])
        before[:] = x
        stepping.computeOneStep()
        stepping.nextStep()
    return float(x[0]), float(x[1]), None


def prepare(case, h):
    return partial(follow, case, h)


RIVALS = [Rival("siconos", (1e-1, 3e-2, 1e-2, 3e-3, 1e-3), prepare)]


if __name__ == "__main__":
    import python_rivals

    sys.exit(python_rivals.main(["--only", "siconos", *sys.argv[1:]]))
