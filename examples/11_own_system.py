# SPDX-License-Identifier: BSD-3-Clause
"""A system of one's own: a damped block on a belt, typed as one function.

What is found in it, its events, an orbit, a bifurcation diagram, and the start of the C++ struct
that is the same system.
Usage: python 11_own_system.py [picture.png]
"""

import sys

import matplotlib as mpl
import numpy as np

import filippov as fp

mpl.use("Agg")
import matplotlib.pyplot as plt


@fp.system(
    state="x v",
    params={"A": 0.2, "omega": 1.067, "V": 1.0, "c": 0.2},
    period=lambda p: 2 * np.pi / p.omega,
    surfaces={"belt": "v - V"},
)
def block(t, s, p):
    u = p.V - s.v
    mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
    return s.v, -s.x - p.c * s.v + p.A * np.cos(p.omega * t) + 10 * mu * np.sign(u)


print(block)
run = fp.simulate(block, [1, 3], (0, 20), rtol=1e-10, atol=1e-10)
for event in run.events[1:-1]:
    print(f"{event['t']:9.6f} {event['kind']:13s} x = {event['x_right'][0]:.6f}")

orbit = fp.periodic_orbit(block, params={"A": 1.0})
print(f"A = 1: orbit of {orbit.word}, multipliers {np.round(orbit.multipliers.real, 6)}")

weak = block.with_params(A=0.5, c=0.01)
omegas = np.linspace(2.5, 3.0, 400)
diagram = fp.bifurcation_diagram(
    weak, omega=omegas, section="exit_sliding", transient=200, keep=100
)
print(f"A = 0.5, c = 0.01: 400 runs, of which {np.sum(diagram.status == 'ok')} are ok")
print("\n".join(block.to_cpp().splitlines()[10:14]))

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
run.plot(ax=left)
left.set_title("A = 0.2: stick and slip")
diagram.plot(ax=right)
right.set_title("A = 0.5, c = 0.01")
path = sys.argv[1] if len(sys.argv) > 1 else "11_own_system.png"
figure.savefig(path, dpi=130)
print(f"\npicture: {path}")
