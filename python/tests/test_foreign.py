# SPDX-License-Identifier: BSD-3-Clause
"""Systems of functions that are not recorded: machine code, and Python's own."""

import ctypes
import math
import pickle
import shutil
import subprocess

import numpy as np
import pytest

import filippov as fp

TIGHT = {"method": "dop853", "rtol": 1e-11, "atol": 1e-11}
PARAMS = {"A": 0.5, "omega": 2.92, "V": 1.0}
POINTER = "void(float64, CPointer(float64), CPointer(float64), CPointer(float64))"
SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_double, *3 * [ctypes.POINTER(ctypes.c_double)])


def friction(t, y, v, p, sign):
    u = p[2] - v
    mu = 0.3 / (1 + sign * 1.42 * u) + 0.1 + 0.01 * u**2
    return -y + p[0] * math.cos(p[1] * t) + 10 * mu * sign


@fp.system(state="y v", params=PARAMS, period=lambda p: 2 * np.pi / p.omega)
def recorded(t, s, p):
    u = p.V - s.v
    mu = 0.3 / (1 + 1.42 * abs(u)) + 0.1 + 0.01 * u**2
    return s.v, -s.y + p.A * np.cos(p.omega * t) + 10 * mu * np.sign(u)


@pytest.fixture(scope="module")
def by_numba():
    numba = pytest.importorskip("numba")
    friction_ = numba.njit(friction)

    @numba.cfunc(POINTER)
    def below(t, x, p, out):  # V - v < 0
        out[0] = x[1]
        out[1] = friction_(t, x[0], x[1], p, -1.0)

    @numba.cfunc(POINTER)
    def above(t, x, p, out):
        out[0] = x[1]
        out[1] = friction_(t, x[0], x[1], p, 1.0)

    return fp.System.from_pointers(
        "y v",
        PARAMS,
        fields={"-": below, "+": above},
        switch="V - v",
        period="2*pi/omega",
        name="friction",
    )


C_FILE = """
#include <math.h>
void slow(double t, const double *x, const double *p, double *out) {
    out[0] = x[1];
    out[1] = -x[0] - 0.4 * x[1] + cos(p[1] * t) + 0.4;
}
void fast(double t, const double *x, const double *p, double *out) {
    out[0] = x[1];
    out[1] = -x[0] - 0.4 * x[1] + cos(p[1] * t) - 0.4;
}
void jacobian(double t, const double *x, const double *p, double *out) {
    out[0] = 0; out[1] = 1; out[2] = -1; out[3] = -0.4;
}
void moving(double t, const double *x, const double *p, double *out) {
    out[0] = x[1] - cos(t) - p[0];
}
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    compiler = shutil.which("cc") or pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("library")
    (folder / "belt.c").write_text(C_FILE)
    subprocess.run(
        [compiler, "-O2", "-shared", "-fPIC", "belt.c", "-o", "belt.so", "-lm"],
        check=True,
        cwd=folder,
    )
    return folder / "belt.so"


def belt_by_ctypes(library, **more):
    code = ctypes.CDLL(str(library))
    return fp.System.from_pointers(
        "x v",
        {"V": 0.7, "w": 0.7},
        fields={"-": code.slow, "+": code.fast},
        switch=code.moving,
        **more,
    )


def events_of(result):
    assert result.status == "ok", result.message
    return [(e["kind"], e["t"]) for e in result.events]


def assert_same_events(a, b, tolerance):
    assert [k for k, _ in a] == [k for k, _ in b]
    assert [t for _, t in a] == pytest.approx([t for _, t in b], abs=tolerance)


# --- machine code ---------------------------------------------------------------------------------


def test_numba_gives_the_same_events(by_numba):
    a = events_of(fp.simulate(by_numba, [0.5, 1.2], (0, 60), **TIGHT))
    b = events_of(fp.simulate(recorded, [0.5, 1.2], (0, 60), **TIGHT))
    assert len(a) > 10
    assert_same_events(a, b, 1e-8)


def test_numba_orbit_and_its_multipliers(by_numba):
    orbit = fp.periodic_orbit(by_numba)
    wanted = fp.periodic_orbit(recorded)
    assert orbit.word == wanted.word
    assert orbit.period == pytest.approx(wanted.period, rel=1e-10)
    assert orbit.multipliers == pytest.approx(wanted.multipliers, abs=1e-8)


@pytest.mark.slow
def test_numba_in_ensembles_and_basins(by_numba):
    starts = np.random.default_rng(1).normal(size=(2, 50))
    a, b = (fp.ensemble(s, starts, (0, 20), rtol=1e-9) for s in (by_numba, recorded))
    assert a.y == pytest.approx(b.y, abs=1e-6)
    axes = {"y": (-3, 3, 12), "v": (-1.1, 3, 12)}
    assert np.array_equal(fp.basins(by_numba, axes).label, fp.basins(recorded, axes).label)


def test_parameters_by_name(by_numba):
    moved = by_numba.with_params(omega=2.8)
    a = events_of(fp.simulate(moved, [0.5, 1.2], (0, 30), **TIGHT))
    b = events_of(fp.simulate(recorded.with_params(omega=2.8), [0.5, 1.2], (0, 30), **TIGHT))
    assert_same_events(a, b, 1e-8)


@pytest.mark.parametrize("omega", [2.907, 2.915, 2.92, 2.9241])
def test_continuation(by_numba, omega):
    branches = [
        fp.continuation(fp.periodic_orbit(s.with_params(omega=omega)), "omega", (2.9, 2.94))
        for s in (by_numba, recorded)
    ]
    assert branches[0].ends == branches[1].ends
    for kind, points in branches[1].special.items():
        mine = [point.param["omega"] for point in branches[0].special[kind]]
        assert mine == pytest.approx([point.param["omega"] for point in points], abs=1e-11)


def test_c_file_with_a_surface_of_its_own(library):
    # problem P3 with its surface in C: gradients by differences
    sys = belt_by_ctypes(library)
    result = fp.simulate(sys, [3, 0], (0, 30), **TIGHT)
    crossings = [e["t"] for e in result.events if e["kind"] == "cross"]
    assert crossings == pytest.approx([7.6055699647, 14.8051056891, 17.4589396439], abs=1e-8)
    assert "differences over five points" in repr(sys)


def test_jacobians_are_used(library):
    code = ctypes.CDLL(str(library))
    with_them = belt_by_ctypes(library, jacobians={"-": code.jacobian, "+": code.jacobian})
    exact = [[0.0, 1.0], [-1.0, -0.4]]
    point = (0.3, [0.5, 0.2])
    assert np.array_equal(with_them.jacobian(*point, 1), exact)
    assert belt_by_ctypes(library).jacobian(*point, 1) == pytest.approx(np.array(exact), abs=1e-11)
    assert "Jacobians as given" in repr(with_them)


def test_scale_is_the_size_of_differences():
    tiny = 1e-6  # exp(x/tiny) is far from its tangent a step of 1e-3 away

    def field(t, x, p, out):
        out[0] = math.exp(min(x[0] / tiny, 50.0))

    def other(t, x, p, out):
        out[0] = -1.0

    pointers = {"-": SIGNATURE(field), "+": SIGNATURE(other)}
    sys = fp.System.from_pointers("x", fields=pointers, switch="x - 1", scale={"x": tiny})
    assert sys.jacobian(0.0, [tiny], -1)[0, 0] == pytest.approx(math.e / tiny, rel=1e-10)


def test_cffi_and_plain_addresses(library):
    cffi = pytest.importorskip("cffi")
    ffi = cffi.FFI()
    ffi.cdef(
        "".join(
            f"void {name}(double, const double *, const double *, double *);"
            for name in ("slow", "fast", "moving")
        )
    )
    code = ffi.dlopen(str(library))
    by_cffi = fp.System.from_pointers(
        "x v",
        {"V": 0.7, "w": 0.7},
        fields={"-": code.slow, "+": ffi.addressof(code, "fast")},
        switch=code.moving,
    )
    again = ctypes.CDLL(str(library))
    address = {
        name: ctypes.cast(getattr(again, name), ctypes.c_void_p).value
        for name in ("slow", "fast", "moving")
    }
    by_address = fp.System.from_pointers(
        "x v",
        {"V": 0.7, "w": 0.7},
        fields={"-": address["slow"], "+": address["fast"]},
        switch=address["moving"],
    )
    wanted = fp.simulate(belt_by_ctypes(library), [3, 0], (0, 10)).y
    for sys in (by_cffi, by_address):
        assert np.array_equal(fp.simulate(sys, [3, 0], (0, 10)).y, wanted)


def test_jump_by_pointer():
    def fall(t, x, p, out):
        out[0], out[1] = x[1], -p[0]

    def bounce(t, x, p, out):
        out[0], out[1] = x[0], -0.5 * x[1]

    # where only the state jumps the field has one side; a far kink stands for the switch
    def same(t, x, p, out):
        fall(t, x, p, out)
        out[1] += 1.0

    ball = fp.System.from_pointers(
        "y v",
        {"g": 2.0},
        fields={"-": SIGNATURE(fall), "+": SIGNATURE(same)},
        switch="y - 100",
        jumps={"ground": ("y", SIGNATURE(bounce))},
    )
    result = fp.simulate(ball, [1.0, 0.0], (0, 2.2), **TIGHT)
    assert [e["t"] for e in result.events if e["kind"] == "jump"] == pytest.approx([1.0, 2.0])


@pytest.mark.parametrize(
    "pointer",
    [
        pytest.param(None, id="nothing"),
        pytest.param(3.5, id="a number that is no address"),
        pytest.param(True, id="a truth value"),
        pytest.param(0, id="null"),
        pytest.param(7, id="no address of code"),
        pytest.param(-1, id="below zero"),
        pytest.param("f", id="text"),
        pytest.param(lambda t, x, p, out: None, id="a function of Python's"),
        pytest.param(ctypes.CFUNCTYPE(None, ctypes.c_double)(lambda t: None), id="one argument"),
    ],
)
def test_what_is_no_pointer(pointer):
    with pytest.raises((TypeError, ValueError), match=r"f\[-\]"):
        fp.System.from_pointers("x", fields={"-": pointer, "+": pointer}, switch="x")


def test_numba_functions_of_another_signature():
    numba = pytest.importorskip("numba")

    @numba.cfunc("float64(float64)")
    def f(t):
        return t

    with pytest.raises(TypeError, match="const double"):
        fp.System.from_pointers("x", fields={"-": f, "+": f}, switch="x")


def test_wrong_calls(by_numba):
    f = SIGNATURE(lambda t, x, p, out: None)
    both = {"-": f, "+": f}
    for match, call in {
        "fields": lambda: fp.System.from_pointers("x", fields=f, switch="x"),
        "a function for each": lambda: fp.System.from_pointers("x", fields={"-": f}, switch="x"),
        "jacobians": lambda: fp.System.from_pointers(
            "x", fields=both, switch="x", jacobians={"0": f}
        ),
        "scale": lambda: fp.System.from_pointers("x", fields=both, switch="x", scale={"z": 1}),
        r"scale\['x'\]": lambda: fp.System.from_pointers(
            "x", fields=both, switch="x", scale={"x": 0}
        ),
        "does not repeat": lambda: fp.System.from_pointers(
            "y v",
            PARAMS,
            fields={"-": _forced, "+": _forced},
            switch="v",
            period=1.0,
        ),
    }.items():
        with pytest.raises((TypeError, ValueError), match=match):
            call()


@SIGNATURE
def _forced(t, x, p, out):
    out[0], out[1] = x[1], math.cos(t)


def test_what_needs_formulas_says_so(by_numba):
    with pytest.raises(TypeError, match="cannot be written in C"):
        by_numba.to_cpp()
    with pytest.raises(TypeError, match="cannot be pickled"):
        pickle.dumps(by_numba)
    assert "f[-](t, s, p)[1]" in by_numba.latex()


def test_the_same_system_goes_on_with_its_store(by_numba, tmp_path):
    pytest.importorskip("zarr")
    starts = np.zeros((2, 4))
    first = fp.ensemble(by_numba, starts, (0, 1), store=tmp_path / "run.zarr")
    # one that cannot be told to be the same may not
    again = fp.ensemble(by_numba, starts, (0, 1), store=tmp_path / "run.zarr")
    assert np.array_equal(first.y, again.y)


# --- Python's functions ---------------------------------------------------------------------------


def slow(name="slow", **sides):
    with pytest.warns(fp.SlowSystemWarning, match=name):
        return fp.System.from_callables(
            "y v",
            PARAMS,
            fields=sides["fields"],
            switch=sides.get("switch", "V - v"),
            period=sides.get("period"),
            name=name,
        )


def by_python():
    def side(sign):
        return lambda t, s, p: (s.v, friction(t, s.y, s.v, p, sign))

    return slow(fields={"-": side(-1.0), "+": side(1.0)}, period="2*pi/omega")


def test_callables_give_the_same_events():
    a = events_of(fp.simulate(by_python(), [0.5, 1.2], (0, 10), **TIGHT))
    b = events_of(fp.simulate(recorded, [0.5, 1.2], (0, 10), **TIGHT))
    assert_same_events(a, b, 1e-8)


def test_callables_in_threads():
    starts = np.random.default_rng(1).normal(size=(2, 6))
    a, b = (fp.ensemble(s, starts, (0, 3), rtol=1e-8) for s in (by_python(), recorded))
    assert a.y == pytest.approx(b.y, abs=1e-6)


def test_callables_may_decide():
    def side(t, s, p):
        push = 0.3 if t > 1 else 0.0  # a jump in time inside a side: the step control's to find
        return [s.v, -s.y + push]

    sys = slow(fields={"-": side, "+": lambda t, s, p: np.array([s.v, -s.y])}, switch="v - 100")
    result = fp.simulate(sys, [0.0, 0.0], (0, 1 + math.pi), rtol=1e-9, atol=1e-12)
    assert result.y[:, -1] == pytest.approx([0.6, 0.0], abs=1e-6)


def test_beyond_the_domain_of_a_callable():
    def side(t, s, p):
        return s.v, -math.sqrt(0.5 - t)  # a ValueError for t > 0.5

    sys = slow(fields={"-": side, "+": lambda t, s, p: (s.v, 0.0)}, switch="v - 100")
    result = fp.simulate(sys, [0.0, 0.0], (0, 1))
    assert not result.success
    assert result.t[-1] <= 0.5 + 1e-6


@pytest.mark.parametrize("threads", [1, 2])
def test_errors_of_a_callable_come_through(threads):
    armed = False

    def side(t, s, p):
        if armed and t > 0.5:
            raise RuntimeError("no such row")
        return s.v, -s.y

    sys = slow(fields={"-": side, "+": lambda t, s, p: (s.v, -1.0)}, switch="v - 100")
    armed = True
    if threads == 1:
        with pytest.raises(RuntimeError, match="no such row"):
            fp.simulate(sys, [0.0, 0.0], (0, 1))
    else:
        with pytest.raises(RuntimeError, match="no such row"):
            fp.ensemble(sys, np.zeros((2, 8)), (0, 1), threads=threads)


def test_callables_that_return_something_else():
    with pytest.raises(TypeError, match="expected 2 numbers"):
        slow(fields={"-": lambda t, s, p: (s.v,), "+": lambda t, s, p: (s.v, 0.0)})


def test_a_table_may_end():
    table = {-1: -0.3, 0: 0.0, 1: 0.3}

    def side(t, s, p):
        return s.v, table[round(float(s.y))]  # a KeyError far away

    sys = slow(fields={"-": side, "+": lambda t, s, p: (s.v, -1.0)}, switch="v - 100")
    result = fp.simulate(sys, [1.0, 0.0], (0, 10))
    assert not result.success
    assert abs(result.y[0, -1]) < 1.6


def test_a_callable_that_works_nowhere():
    def side(t, s, p):
        return s.v, {}["no such key"]

    with pytest.raises(fp.DefinitionError, match=r"f\[-\].*no such key"):
        slow(fields={"-": side, "+": lambda t, s, p: (s.v, 0.0)})


def test_callables_in_diagrams_and_maps():
    sys = by_python()
    diagram = fp.bifurcation_diagram(sys, A=[0.4, 0.5], transient=2, keep=2, threads=2)
    wanted = fp.bifurcation_diagram(recorded, A=[0.4, 0.5], transient=2, keep=2)
    assert diagram.y == pytest.approx(wanted.y, abs=1e-6)
    image = fp.strobe_map(sys, [0.5, 0.2])
    assert image.slope == pytest.approx(fp.strobe_map(recorded, [0.5, 0.2]).slope, abs=1e-8)
