# SPDX-License-Identifier: BSD-3-Clause
"""Bytes become files and formulas for the Python package: entry points for fuzzers.

`tests/python/test_fuzz.py` calls them with hypothesis. As a program, with atheris installed, this
looks at coverage: `python python_surface.py stores|formulas [corpus] [libFuzzer's options]`.
"""

from __future__ import annotations

import contextlib
import json
import math
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

import filippov as fp

EVENTS = {"max_steps": 200, "max_events": 40}


class Choices:
    """What a fuzzer gives, read from the front; zeros where it ends."""

    def __init__(self, data: bytes) -> None:
        self._data = iter(data)

    def byte(self) -> int:
        return next(self._data, 0)

    def of(self, options):
        return options[(self.byte() + 256 * self.byte() * (len(options) > 256)) % len(options)]


# --- stores ---------------------------------------------------------------------------------------


@fp.system(state="x v", params={"F": 0.4, "w": 0.7}, period=lambda p: 2 * np.pi / p.w)
def typed(t, s, p):
    return s.v, -s.x + np.cos(p.w * t) - p.F * np.sign(s.v - 0.5)


def seeds(path):
    """Give metadata and arrays of some results, which are saved there on the way."""
    block = fp.models.oscillator
    drive = {"A": 5.0, "omega": 2.5}
    results = [
        fp.simulate(typed, [1, 0], (0, 6)),
        fp.simulate(fp.models.bouncing_ball, [1, 0], (0, 1.0), method="dop853"),
        fp.simulate(fp.models.two_blocks, [1, 0.5, 0, 0], (0, 3)),
        fp.periodic_orbit(block, params=drive),
        fp.bifurcation_diagram(typed, w=[0.6, 0.7], transient=5, keep=10),
        fp.ensemble(typed, np.zeros((2, 3)), (0, 5)),
        fp.event_map(block, params=drive, samples=16),
        fp.basins(block, {"y": (-3.0, 3.0, 6), "v": (-1.1, 3.0, 6)}),
        fp.sliding_region(block, 0.3, bounds={"y": (-3.0, 3.0), "v": (-1.1, 3.0)}),
    ]
    for result in results:
        result.save(path)
        with np.load(path) as file:
            arrays = dict(file)
        yield str(arrays.pop("__filippov__")), arrays


ODD = [
    None, True, -1, 0, 1, 2, 7, 255, 2**31, -(2**31), 2**63, 2**70, 0.5, -1e308, 1e-320,
    math.inf, math.nan, "", "x", "y", "F", "oscillator", "relay", "Trajectory", "Orbit", "Basins",
    "Trace", "ok", "<f8", "|O", "add", "state", "param", "call", "where", "sign", "\0", [], {},
    [1, 2], {"array": "y"}, {"array": "t"}, {"system": 0}, {"system": -1}, {"tuple": []},
    {"class": "Orbit", "fields": {}}, {"mapping": {}}, {"solution": 0, "parts": {}},
]  # fmt: skip


def places(value, found):
    """List every container in a tree with each of its keys."""
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in list(entries):
        found.append((value, key))
        if isinstance(inner, dict | list):
            places(inner, found)
    return found


def edit_tree(meta, choices):
    everywhere = places(meta, [])
    holder, key = choices.of(everywhere)
    with contextlib.suppress(KeyError, IndexError):  # gone with an earlier edit
        match choices.byte() % 5:
            case 0:
                del holder[key]
            case 1:
                other, name = choices.of(everywhere)
                holder[key] = json.loads(json.dumps(other[name]))
            case 2 if isinstance(holder[key], int | float):
                holder[key] += choices.of([1, -1, 2, 0.5, 1e-9, 100])
            case 3 if isinstance(holder[key], list):
                holder[key] = holder[key] * choices.of([0, 2, 3])
            case _:
                holder[key] = json.loads(json.dumps(choices.of(ODD)))


def edit_array(arrays, choices):
    if not arrays:
        return
    name = choices.of(sorted(arrays))
    array = arrays[name]
    match choices.byte() % 7:
        case 0:
            del arrays[name]
        case 1:
            arrays[name] = array[: choices.byte() % 4] if array.ndim else array[None]
        case 2:
            arrays[name] = array[..., None]
        case 3:
            arrays[name] = array.reshape(-1)
        case 4 if array.dtype.names is None:
            kind = choices.of(["<f4", "<i8", "|i1", "<c16", "<U3", "|b1", ">f8"])
            with contextlib.suppress(ValueError, TypeError), np.errstate(all="ignore"):
                arrays[name] = array.astype(kind)
        case 5 if array.size and array.dtype.kind in "fiu":
            wild = array.reshape(-1).copy()
            odd = choices.of([0, 1, -1, 100, 2**31 - 1, 1e300, math.nan, math.inf])
            with np.errstate(all="ignore"), contextlib.suppress(ValueError, OverflowError):
                wild[choices.byte() % wild.size] = odd
            arrays[name] = wild.reshape(array.shape)
        case _:
            arrays[name] = arrays[choices.of(sorted(arrays))]


class Stores:
    """Results with edits, in a folder of files that may be overwritten: refused, or used."""

    def __init__(self, folder) -> None:
        self._path = Path(folder) / "edited.npz"
        self._seeds = list(seeds(self._path))

    def __call__(self, data: bytes) -> None:
        choices = Choices(data)
        text, arrays = choices.of(self._seeds)
        meta, arrays = json.loads(text), dict(arrays)
        for _ in range(1 + choices.byte() % 3):
            if choices.byte() % 3:
                edit_tree(meta, choices)
            else:
                edit_array(arrays, choices)
        with self._path.open("wb") as file:
            np.savez(file, __filippov__=np.array(json.dumps(meta)), **arrays)
        with contextlib.suppress(ValueError):  # refused
            use(fp.load(self._path), self._path)


#: What a result may say that makes no sense.
REFUSALS = (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError)


def use(result, path) -> None:
    """Use a result that was loaded: what is inside cannot be known, but nothing may crash."""
    with warnings.catch_warnings(), contextlib.suppress(*REFUSALS):
        warnings.simplefilter("ignore")
        repr(result)
        result.save(path)
        system = result.system
        str(system)
        system.to_cpp("Loaded")
        system.latex()
        fp.simulate(system, np.ones(system.dim), (0, 1), **EVENTS)
        if getattr(result, "sol", None) is not None:
            result.sol(np.linspace(result.sol.t_min, result.sol.t_max, 7))
            result.sol.s(result.sol.t_min)


# --- formulas -------------------------------------------------------------------------------------

FUNCTIONS = [
    np.sin, np.cos, np.tan, np.exp, np.log, np.sqrt, np.arctan, np.arcsin, np.tanh, np.sinh,
    np.cosh, np.sign, np.abs, np.negative, np.square,
]  # fmt: skip
OPERATORS = [
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: a * b,
    lambda a, b: a / b,
    lambda a, b: a**b,
    np.maximum,
    np.minimum,
    lambda a, b: np.where(a > b, a, b),
    lambda a, b: np.where(a <= 1, b, 0),
    lambda a, b: (a > 0) * b,
    lambda a, b: a if b == 1 else a * 2,  # asks a formula for its truth
]


def define(data: bytes) -> None:
    """Define a system by operators of Python's, and run it."""
    choices = Choices(data)
    dim = 1 + choices.byte() % 3
    order = [choices.byte() for _ in range(3 + choices.byte() % 12)]
    tail = [choices.byte() for _ in range(64)]

    def field(t, s, p):
        rest = iter(tail)
        known = [t, *s, p.a, 1, 0.5, -2.0]
        for k in order:
            first, second = (known[next(rest, 0) % len(known)] for _ in range(2))
            if k % 2:
                known.append(FUNCTIONS[k // 2 % len(FUNCTIONS)](first))
            else:
                known.append(OPERATORS[k // 2 % len(OPERATORS)](first, second))
        return known[-dim:]

    names = " ".join("xyz"[:dim])
    # numpy divides numbers by zero with a warning
    with (
        warnings.catch_warnings(),
        contextlib.suppress(ValueError, TypeError, ZeroDivisionError, OverflowError),
    ):
        warnings.simplefilter("ignore")
        system = fp.system(field, state=names, params={"a": choices.of([0.0, 1.0, -2.5, 1e9])})
        method = choices.of(["dopri5", "dop853", "rodas5p"])
        start = [choices.of([0.0, 1.0, -0.5, 1e-9, 1e6]) for _ in range(dim)]
        run = fp.simulate(system, start, (0, 1), method=method, **EVENTS)
        assert run.status in list(fp.Status)
        assert (run.status == "ok") == run.success
        assert run.message
        if run.success:
            assert np.isfinite(run.y).all()
            assert run.t[-1] == 1
        again = fp.simulate(system, start, (0, 1), method=method, **EVENTS)
        np.testing.assert_array_equal(run.y, again.y)
        system.to_cpp()
        system.latex()


def main() -> None:
    import atheris

    what = sys.argv.pop(1)
    with tempfile.TemporaryDirectory() as folder:
        atheris.instrument_all()
        atheris.Setup(sys.argv, Stores(folder) if what == "stores" else define)
        atheris.Fuzz()


if __name__ == "__main__":
    main()
