# SPDX-License-Identifier: BSD-3-Clause
"""What goes between compiled modules: members that lanes hand over to the scalar engine."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import filippov as fp
from filippov import _core
from filippov._runs import lanes, seam

# Those that lanes are compiled for, one more than they are, and those of other sizes.
DIMS = [1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 32]
# Here as in `simulate`, where lanes round otherwise: a thousand tolerances of 1e-8.
CLOSE = 1e-5


# Each way gives the rate of the first component, which the others follow, where the first
# component begins in each member, the times, and more settings of the run.


def touched(t, s, p):
    """It comes to the surface at the top of a sine, and may step on it."""
    return np.where(s[0] > 1.0, np.cos(t) - 2.0, np.cos(t))


def slide(t, s, p):
    return 1.2 * np.sin(t) - np.sign(s[0])


def curved_slide(t, s, p):
    """The same on a surface that moves: it has no closed form."""
    return 1.2 * np.sin(t) - np.sign(s[0] - 0.2 * np.sin(3.0 * t))


def held(t, s, p):
    """The force touches what friction can hold, and does not exceed it."""
    return np.sin(t) - np.sign(s[0])


def repelling(t, s, p):
    return np.sign(s[0])


def backwards(t, s, p):
    return 0.3 * np.sin(t) + np.sign(s[0])


def blowing_up(t, s, p):
    return 1.0 + s[0] ** 2 - 0.1 * np.sign(s[0] - 0.5)


def crossing(t, s, p):
    return np.cos(t) - 0.5 * np.sign(s[0])


def kinked(t, s, p):
    return crossing(t, s, p) + abs(s[0] - 0.3)


def on_two_surfaces(t, s, p):
    return crossing(t, s, p) - 0.2 * np.sign(s[0] - 0.4)


def in_a_clearance(t, s, p):
    """A slide that gives way at a jump of its force."""
    return np.where(t > 1.0, 3.0, 0.5) * np.cos(t) - np.sign(s[0])


def falling(t, s, p):
    return -1.0


NEAR = (-1e-6, -1e-9, 0.0, 1e-9, 1e-6)
AROUND = (0.0, 0.3, -0.3, 1e-9)
WAYS = {
    "a touch": (touched, NEAR, (0.0, 5.0), {}),
    "the end of a slide": (slide, AROUND, (0.0, 9.0), {}),
    "a slide without a closed form": (curved_slide, AROUND, (0.0, 9.0), {}),
    "a touched end of a slide": (held, AROUND, (0.0, 9.0), {}),
    "a start that is not unique": (repelling, (0.0, 0.5, -0.5), (0.0, 2.0), {}),
    "a choice where it is not unique": (
        repelling,
        (0.0, 0.5),
        (0.0, 2.0),
        {"on_nonunique": "below"},
    ),
    "backwards": (backwards, (0.5, -0.5, 0.1), (3.0, -1.0), {}),
    "a pole": (blowing_up, (0.0, 0.2, -0.3), (0.0, 5.0), {}),
    "times too large for lanes": (crossing, (0.0, 0.5, -0.5), (2e5, 2e5 + 4.0), {}),
    "a kink": (kinked, (0.0, 0.5, -0.5), (0.0, 4.0), {}),
    "two surfaces": (on_two_surfaces, (0.0, 0.5, -0.5), (0.0, 4.0), {}),
    "a force that jumps in a slide": (in_a_clearance, AROUND, (0.0, 6.0), {}),
    "jumps": (falling, (1.0, 0.25, 2.0), (0.0, 4.3), {}),
    "too many events": (slide, AROUND, (0.0, 9.0), {"max_events": 1}),
    "too many steps": (slide, AROUND, (0.0, 9.0), {"max_steps": 7}),
    "starts that are none": (crossing, (0.0, np.nan, np.inf), (0.0, 2.0), {}),
    "the other method": (held, AROUND, (0.0, 9.0), {"method": "dopri5"}),
}


def chain(rate, dim):
    """Give a system whose first component has this rate."""

    def field(t, s, p):
        return [rate(t, s, p)] + [0.3 * s[i - 1] - 0.1 * s[i] - 0.01 * i for i in range(1, dim)]

    def bounce(t, s, p):
        return [1.0, *(s[i] for i in range(1, dim))]

    more = {"jumps": {"floor": ("x0", bounce)}} if rate is falling else {}
    return fp.system(state=[f"x{i}" for i in range(dim)], **more)(field)


def starts(firsts, dim):
    return np.array([firsts, *(np.full(len(firsts), 0.5 + 0.25 * i) for i in range(1, dim))])


def unlike(system, x0, span, settings):
    """Say which members do not end where single runs end."""
    ends = fp.ensemble(system, x0, span, **settings)
    whole = ends.stats.trips == 0  # the scalar engine ran them, each at once
    for m in range(x0.shape[1]):
        where = f"member {m}: {ends.y[:, m]}, {ends.status[m]} at {ends.t[m]}"
        if not np.isfinite(x0[:, m]).all():
            if ends.status[m] != "not_finite":
                yield f"{where}, not_finite expected"
            continue
        run = fp.simulate(system, x0[:, m], span, **{"method": "dop853"} | settings)
        alone = f"alone: {run.y[:, -1]}, {run.status.value} at {run.t[-1]}"
        if ends.status[m] != run.status:
            yield f"{where}, {alone}"
        elif whole and not (ends.y[:, m] == run.y[:, -1]).all():
            yield f"{where}, {alone}: not the same bits"
        elif run.status == "step_too_small":  # at a pole: a time, and no state
            if not abs(ends.t[m] - run.t[-1]) < CLOSE:
                yield f"{where}, {alone}"
        elif run.status != "max_steps" and not (  # which are others in lanes
            abs(ends.t[m] - run.t[-1]) < CLOSE
            and (abs(ends.y[:, m] - run.y[:, -1]) <= CLOSE * (1 + abs(run.y[:, -1]))).all()
            and ends.n_events[m] == changes(run)
        ):
            yield f"{where}, {ends.n_events[m]} events, {alone}, {changes(run)} events"
        elif not (0 <= ends.n_events[m] <= 100 and 0 <= ends.slide_time[m] <= abs(np.ptp(span))):
            yield f"{where}: {ends.n_events[m]} events, {ends.slide_time[m]} of slides"


def changes(run):
    modes = [
        np.reshape(run.events[f"mode_{k}"], (len(run.events), -1)) for k in ("before", "after")
    ]
    jumps = np.array([kind == "jump" for kind in run.events["kind"]], dtype=bool)
    return int(((modes[0] != modes[1]).any(axis=1) | jumps).sum())


def friction(dim):
    """An oscillator that touches its surface from (0.1, 0.9), and components that decay."""

    def field(t, s, p):
        return [s[1], -s[0] - 0.1 * np.sign(s[0] - 1), *(-0.1 * s[i] for i in range(2, dim))]

    return fp.system(state=[f"x{i}" for i in range(dim)])(field)


def check_dim(dim):
    for name, (rate, firsts, span, settings) in WAYS.items():
        for error in unlike(chain(rate, dim), starts(firsts, dim), span, settings):
            yield f"{name}, {dim} components: {error}"
    if dim > 1:
        x0 = np.ones((dim, 3))
        x0[0], x0[1] = 0.1, (0.8999999, 0.9, 0.9000001)
        for error in unlike(friction(dim), x0, (0, 5), {}):
            yield f"friction, {dim} components: {error}"


def check_cells():
    """The other caller of lanes: more components that follow change nothing of a picture."""

    def cells(dim):
        def field(t, s, p):
            return [held(t, s, p)] + [0.3 * s[i - 1] - 0.1 * s[i] for i in range(1, dim)]

        system = fp.system(state=[f"x{i}" for i in range(dim)], period=2 * np.pi)(field)
        rest = {f"x{i}": 0.0 for i in range(2, dim)}
        return fp.cell_map(system, {"x0": (-1.1, 1.2, 30), "x1": (-1.0, 1.0, 10)}, rest=rest)

    three = cells(3)
    for dim in (4, 5, 8):
        picture = cells(dim)
        if picture.stats.handed_over == 0:
            yield f"cells, {dim} components: none is handed over"
        if not ((picture.group == three.group) & (picture.steps == three.steps)).all():
            yield f"cells, {dim} components: {picture}, of three: {three}"


CHECK = """
import sys
sys.path.insert(0, sys.argv[1])
from test_seam import DIMS, check_cells, check_dim
for dim in DIMS:
    print(*check_dim(dim), sep="\\n", end="")
print(*check_cells(), sep="\\n", end="")
"""


@pytest.mark.slow
@pytest.mark.parametrize("level", lanes.LEVELS)
def test_members_that_are_handed_over_end_where_single_runs_end(level):
    if level not in lanes.instruction_sets():
        pytest.skip("the processor has no such registers, or lanes were not compiled for them")
    run = subprocess.run(
        [sys.executable, "-c", CHECK, str(Path(__file__).parent)],
        env=os.environ | {"FILIPPOV_SIMD": level},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.stderr == ""
    assert run.stdout == ""


def test_lanes_do_hand_over_in_these_ways():
    # of three components, for which there are lanes in every build: the test above would say
    # nothing if it did not happen
    def stats(name):
        rate, firsts, span, settings = WAYS[name]
        return fp.ensemble(chain(rate, 3), starts(firsts, 3), span, **settings).stats

    for name in ("a touch", "a touched end of a slide", "a start that is not unique", "a pole"):
        assert stats(name).handed_over > 0 < stats(name).trips, name
    assert stats("times too large for lanes").handed_over > 1000
    assert stats("backwards").trips == stats("two surfaces").trips == stats("jumps").trips == 0


def test_the_input_that_came_back_as_garbage():
    f = fp.system(state="a b c d")(
        lambda t, s, p: (s[1], -s[0] - 0.1 * np.sign(s[0] - 1), -0.1 * s[2], -0.1 * s[3])
    )
    ends = fp.ensemble(f, [[0.1], [0.8999999], [1.0], [1.0]], (0, 5))
    assert ends.stats.handed_over > 0
    # it does not reach the surface by 1.7e-7: an oscillator about -0.1 ... in closed form
    x0, v0 = 0.1 - 0.1, 0.8999999
    c, s = np.cos(5.0), np.sin(5.0)
    exact = [0.1 + x0 * c + v0 * s, v0 * c - x0 * s, np.exp(-0.5), np.exp(-0.5)]
    np.testing.assert_allclose(ends.y[:, 0], exact, atol=1e-7)


def test_modules_that_were_not_compiled_together_are_refused(monkeypatch):
    level = lanes.instruction_set()
    name = f"filippov._lanes_{level}"
    seam.load(name)
    monkeypatch.setattr(_core, "seam", _core.seam | {"StretchEnd::x of 4 components": "48"})
    message = (
        f"{name} does not fit filippov._core: StretchEnd::x of 4 components is 64 there and 48 "
        r"here \(expected modules of one build: install filippov again\)"
    )
    with pytest.raises(ImportError, match=f"^{message}$") as refused:
        seam.load(name)
    assert refused.value.name == name
    # and before anything is handed over
    monkeypatch.setattr(lanes, "_module", _seam_module)
    monkeypatch.setattr(lanes, "_made", {})
    with pytest.raises(ImportError, match="StretchEnd::x of 4 components is 64 there and 48 here"):
        fp.ensemble(fp.models.oscillator, [0.0, 0.0], (0.0, 1.0))


def _seam_module(level):
    return seam.load(f"filippov._lanes_{level}")


def test_a_module_that_does_not_say_how_it_is_laid_out_is_refused(monkeypatch):
    name = f"filippov._lanes_{lanes.instruction_set()}"
    monkeypatch.delattr(sys.modules.get(name) or seam.load(name), "seam")
    with pytest.raises(ImportError, match="it does not say how it lays out what goes between them"):
        seam.load(name)


def test_modules_export_nothing_of_the_library():
    # what two of them exported could be taken from the one by the other, compiled for another
    # instruction set
    nm = shutil.which("nm")
    if nm is None or sys.platform != "linux":
        pytest.skip("needs nm, and symbols as Linux has them")
    for name in ("_core", *(f"_lanes_{level}" for level in lanes.instruction_sets())):
        module = seam.load(f"filippov.{name}")
        run = subprocess.run(
            [nm, "-DC", "--defined-only", module.__file__],
            capture_output=True,
            text=True,
            check=True,
        )
        assert f"PyInit_{name}" in run.stdout
        shared = [line for line in run.stdout.splitlines() if re.search("filippov|Eigen", line)]
        assert shared == []


def test_every_module_says_the_same():
    for level in lanes.instruction_sets():
        module = seam.load(f"filippov._lanes_{level}")
        assert module.seam == _core.seam
    assert len(_core.seam) > 100
    assert _core.seam["version"] == fp.__version__
