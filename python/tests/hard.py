# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of hard cases share."""

import numpy as np
import pytest

import filippov as fp

EPS = np.finfo(float).eps
METHODS = ("dopri5", "dop853", "rodas5p")
EXPLICIT = METHODS[:2]
MODE_CHANGES = {"cross", "enter_sliding", "exit_sliding", "accumulation"}

each_method = pytest.mark.parametrize("method", METHODS)
explicit = pytest.mark.parametrize("method", EXPLICIT)


def sides(below, above, switch, state="x y"):
    return fp.System(state, fields={"-": below, "+": above}, switch=switch)


def strip(l1, l2):
    """(1, l1(x)) below y = 0 and (1, l2(x)) above: on the surface x is the time."""
    return sides(lambda t, s, p: (1.0, l1(s.x)), lambda t, s, p: (1.0, l2(s.x)), "y")


def line(switch, slow=1.0, fast=2.0):
    """Speeds of x where h < 0 and where h > 0."""
    return sides(lambda t, s, p: slow, lambda t, s, p: fast, switch, "x")


def called(below, above, switch, state="x"):
    """Make a system of functions that Python calls."""
    with pytest.warns(fp.SlowSystemWarning):
        return fp.System.from_callables(state, fields={"-": below, "+": above}, switch=switch)


def down(x):
    return -1.0


def up(x):
    return 1.0


def plus(x):
    return x


def minus(x):
    return -x


def go(system, x0, t_span, tol=1e-9, method="dopri5", **options):
    """Run with a bound on everything, and check the log."""
    bounds = {"max_steps": 100_000, "max_events": 2_000}
    given = {"rtol": tol, "atol": tol} | bounds | options
    run = fp.simulate(system, x0, t_span, method=method, **given)
    assert faults(run, np.sign(t_span[1] - t_span[0])) == ""
    return run


def faults(run, direction=1):
    """Every log starts and ends, is finite, and its times and modes follow on each other."""
    log = run.events
    if log["kind"][0] != "start" or log["kind"][-1] != "end":
        return "no start or no end"
    if not (np.isfinite(log["x_left"]).all() and np.isfinite(log["x_right"]).all()):
        return "a state is not finite"
    if (direction * np.diff(log["t"]) < 0).any():
        return "time turns back"
    if (log["mode_before"][1:] != log["mode_after"][:-1]).any():
        return "modes do not follow on each other"
    for event in log[1:-1]:
        changed = np.any(event["mode_before"] != event["mode_after"])
        if event["kind"] != "jump" and changed != (event["kind"] in MODE_CHANGES):
            return "kind and modes contradict each other"
    return ""


def word(run):
    return " ".join(str(kind) for kind in run.events["kind"][1:-1])


def times(run, *kinds):
    return [float(e["t"]) for e in run.events if e["kind"] in kinds]


def assert_failed(run, status, *words):
    """The status, and a message that names time, state and mode besides these words."""
    assert run.status == status, run.message
    assert not run.success
    for part in ("At t = ", "x = (", "mode (", *words):
        assert part in run.message


def close(x, tol):
    return pytest.approx(x, rel=0, abs=tol)
