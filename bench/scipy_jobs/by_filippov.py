# SPDX-License-Identifier: BSD-3-Clause
"""The block on the belt with filippov: what a user types."""

import numpy as np

import filippov as fp


@fp.system(state="y v", params={"A": 0.5, "omega": 2.94}, period=lambda p: 2 * np.pi / p.omega)
def block(t, s, p):
    u = 1.0 - s.v
    mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
    return s.v, -s.y + p.A * np.cos(p.omega * t) + 10 * mu * np.sign(u)


def trajectory(A, omega, periods, system=block, **how):
    """State after so many periods of the forcing, from rest."""
    span = (0, periods * 2 * np.pi / omega)
    params = {"A": A, "omega": omega}
    return fp.simulate(system, [0, 0], span, params=params, dense_output=False, **how).y[:, -1]


def diagram(A, omegas, transient, keep, system=block, **how):
    """Values of omega, and phases at which the block begins to slip."""
    kept = {"transient": transient, "keep": keep}
    d = fp.bifurcation_diagram(system, omega=omegas, params={"A": A}, threads=1, **kept, **how)
    return d.param, d.phase


def cell_images(A, omega, y, v, system=block, **how):
    """States to which the states (y, v) of a grid are mapped in one period."""
    starts, span = np.meshgrid(y, v, indexing="ij"), (0, 2 * np.pi / omega)
    params = {"A": A, "omega": omega}
    return fp.ensemble(system, starts, span, params=params, threads=1, **how).y


def basins(A, omega, grid, system=block, **how):
    """Label of every cell's attractor."""
    return fp.basins(system, grid, params={"A": A, "omega": omega}, threads=1, **how).label
