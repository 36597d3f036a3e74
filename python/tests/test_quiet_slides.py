# SPDX-License-Identifier: BSD-3-Clause
"""A block at rest and a relay under waves, in calculations of many runs: what ends their slides
swings forty times in a period, and the field there is nil. Each is compared with runs of
short steps.
"""

import numpy as np
import pytest

import filippov as fp

TURN = 2 * np.pi
EXACT = {"method": "dop853", "rtol": 1e-11, "atol": 1e-12, "max_step": 2e-3}


@fp.system(state="x v", params={"k": 0.3}, period="2*pi")
def block(t, s, p):
    return s.v, 0.9 * np.cos(t) + p.k * np.cos(40 * t) - s.x - np.sign(s.v)


def exits(run):
    return run.events[run.events["kind"] == fp.EventKind.exit_sliding]


@pytest.mark.parametrize("method", ["dopri5", "dop853", "rodas5p"])
def test_a_run_has_every_slip(method):
    run = fp.simulate(block, [0.2, 0], (0, 20), method=method)
    exact = fp.simulate(block, [0.2, 0], (0, 20), **EXACT)
    assert len(exits(run)) == len(exits(exact)) > 20
    np.testing.assert_allclose(exits(run)["t"], exits(exact)["t"], atol=1e-4)


def test_a_diagram_has_every_slip():
    values = [0.05, 0.15, 0.25, 0.3]
    diagram = fp.bifurcation_diagram(block, k=values, x0=[0.2, 0], transient=5, keep=2)
    for n, k in enumerate(values):
        run = fp.simulate(block, [0.2, 0], (0, 7 * TURN), params={"k": k}, **EXACT)
        late = exits(run)[exits(run)["period"] >= 5]
        mine = diagram.value == n
        assert mine.sum() == len(late)
        np.testing.assert_allclose(diagram.t_local[mine], late["t_local"], atol=1e-4)


def test_an_event_map_goes_to_the_next_slip():
    mapped = fp.event_map(block, params={"k": 0.3}, samples=8, max_evaluations=500)
    tried = 0
    for phase in np.linspace(0.01, 6.2, 60):  # (its own samples are dense where it breaks)
        for side in (-1, 1):
            push = 0.9 * np.cos(phase) + 0.3 * np.cos(40 * phase)
            leaves = -side * (0.9 * np.sin(phase) + 12 * np.sin(40 * phase))
            value = mapped(phase, side)
            if leaves < 1 or not np.isfinite(value):
                continue
            run = fp.simulate(block, [push - side, 0], (phase, phase + 3 * TURN), **EXACT)
            later = exits(run)["t"]
            later = later[later > phase + 1e-4]
            if later.size:
                gap = np.remainder(later[0] - value + np.pi, TURN) - np.pi
                assert gap == pytest.approx(0, abs=1e-4)
                tried += 1
    assert tried > 30


@fp.system(state="x y", params={"k": 0.3}, period="2*pi")
def relay(t, s, p):
    return 0.9 * np.cos(t) + p.k * np.cos(40 * t) - np.sign(s.x), np.cos(t) - s.y


@pytest.mark.parametrize(("k", "slips"), [(0.12, 5), (0.3, 17)])
def test_an_orbit_has_every_slip(k, slips):
    orbit = fp.periodic_orbit(relay, [0, 0], params={"k": k})
    assert orbit.success, orbit.message
    run = fp.simulate(
        relay, orbit.x0, (orbit.t0, orbit.t0 + orbit.period), params={"k": k}, **EXACT
    )
    assert len(exits(run)) == slips
    mine = orbit.events[orbit.events["kind"] == fp.EventKind.exit_sliding]
    np.testing.assert_allclose(mine["t"], exits(run)["t"] - orbit.t0, atol=1e-8)
    np.testing.assert_allclose(run.y[:, -1], orbit.x0, atol=1e-9)
    # what slides forgets where it was, the other component decays
    np.testing.assert_allclose(orbit.multipliers, [np.exp(-TURN), 0], atol=1e-9)


def test_exponents_are_those_between_the_slips():
    result = fp.lyapunov(relay, [0, 0], transient=5, window=40)
    assert result.success, result.message
    assert result.exponents[0] == pytest.approx(-1, abs=1e-6)
    assert result.exponents[1] == -np.inf
