# SPDX-License-Identifier: BSD-3-Clause
"""Functions of which only values are known: machine code by its address, and Python's own."""

from __future__ import annotations

import ctypes
import math
import numbers
import sys
import warnings
from _ctypes import CFuncPtr  # what every function of ctypes is
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from filippov import _core
from filippov._support.check import number, refuse

from .define import Function, defaults_of, names_of, three_arguments
from .trace import DefinitionError, Expression, Numbers

__all__ = ["Foreign", "SlowSystemWarning", "Surroundings"]


class SlowSystemWarning(UserWarning):
    """A system calls Python functions: it is a hundred times slower than one that is recorded."""


class Foreign:
    """A function f(t, s, p) that is not recorded: what is recorded is that it is called."""

    def __init__(self, outputs: int, add: Callable[[_core.Graph], int], *, number: bool) -> None:
        self._outputs = outputs
        self._add = add
        self._number = number

    def __call__(self, t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401 - recorded numbers
        """Record a call."""
        graph = t._graph
        k = self._add(graph)
        found = tuple(Expression(graph, graph.call(k, i)) for i in range(self._outputs))
        return found[0] if self._number else found


class Surroundings:
    """What a system's foreign functions have in common: names, and sizes for differences."""

    def __init__(
        self,
        state: str | Sequence[str],
        params: Mapping[str, float] | None,
        period: object,
        scale: Mapping[str, float] | None,
    ) -> None:
        self.state = names_of("state", state)
        self.trials: list[Trial] = []
        values = defaults_of(params)
        self.params = tuple(values)
        sizes = {"t": 1.0} | dict.fromkeys(self.state, 1.0)
        for name, value in values.items():
            sizes[name] = abs(value) or 1.0
        if isinstance(period, numbers.Real) and not isinstance(period, bool):
            length = number("period", period, "expected a finite number > 0", above=0.0)
            sizes["t"] = length / math.tau
        if scale is not None and not isinstance(scale, Mapping):
            refuse("scale", scale, "expected a mapping of names to sizes", TypeError)
        for name, size in (scale or {}).items():
            if name not in sizes:
                refuse("scale", scale, f"{name!r} is no name of the system, and not t")
            sizes[name] = number(f"scale[{name!r}]", size, "expected a number > 0", above=0.0)
        self.scale = list(sizes.values())

    def pointer(
        self, what: str, pointer: object, *, number: bool = False, jacobian: object = None
    ) -> Foreign:
        """Give a function by its address."""
        outputs = 1 if number else len(self.state)
        sizes = (what, len(self.state), len(self.params), outputs, self.scale)
        value = _address(what, pointer)
        slopes = 0 if jacobian is None else _address(f"the Jacobian of {what}", jacobian)
        owner = (pointer, jacobian)  # kept alive with the system
        return Foreign(
            outputs, lambda graph: graph.add_pointer(*sizes, value, slopes, owner), number=number
        )

    def callable(self, what: str, function: Function, *, number: bool = False) -> Foreign:
        """Give a function of Python's."""
        if not callable(function):
            refuse(what, function, "expected a function f(t, s, p)", TypeError)
        outputs = 1 if number else len(self.state)
        sizes = (what, len(self.state), len(self.params), outputs, self.scale)
        three = three_arguments(function, what)
        nowhere = (math.nan,) * outputs
        trial = Trial(what)
        self.trials.append(trial)

        def values(t: float, x: Sequence[float], p: Sequence[float]) -> Sequence[float]:
            try:
                found = three(t, Numbers(self.state, x), Numbers(self.params, p))
            except (ArithmeticError, LookupError, ValueError) as error:
                trial.error = error
                return nowhere  # beyond its domain: as numpy's functions say it
            trial.works = True
            found = (found,) if number or not hasattr(found, "__len__") else found
            if isinstance(found, str) or len(found) != outputs:
                raise TypeError(f"{what} returned {found!r}: expected {outputs} numbers")
            try:
                return [float(v) for v in found]
            except (TypeError, ValueError):
                raise TypeError(f"{what} returned {found!r}: expected {outputs} numbers") from None

        return Foreign(outputs, lambda graph: graph.add_callable(*sizes, values), number=number)


class Trial:
    """Whether a function was seen to work, and what it raised."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.works = False
        self.error: Exception | None = None

    def judge(self) -> None:
        """Refuse a function that works nowhere."""
        if not self.works and self.error is not None:
            raise DefinitionError(f"{self.what} works nowhere: {self.error!r}") from self.error


def warn_slow(name: str) -> None:
    """Say that a system calls Python."""
    warnings.warn(
        f"{name} calls Python functions at every step: a hundred times slower than one that is"
        " recorded (filippov.system, filippov.System), its derivatives are differences, and threads"
        " do not help it",
        SlowSystemWarning,
        stacklevel=3,
    )


# --- addresses ------------------------------------------------------------------------------------


_SIGNATURE = "void f(double t, const double *x, const double *p, double *out)"


def _address(what: str, pointer: object) -> int:
    """Address of a function of machine code, of every kind of object that has one."""
    found = _address_of(what, pointer)
    if not found:
        refuse(
            what,
            pointer,
            f"expected {_SIGNATURE}: its address, a numba.cfunc, or a function of ctypes or cffi",
            TypeError,
        )
    if not 4096 <= found < 2**64:
        refuse(what, pointer, "expected the address of a function")
    return found


def _address_of(what: str, pointer: object) -> int | None:
    if isinstance(pointer, int) and not isinstance(pointer, bool):
        return pointer if pointer else 1
    if isinstance(pointer, CFuncPtr):
        declared = getattr(pointer, "argtypes", None)
        if declared is not None and (len(declared) != 4 or declared[0] is not ctypes.c_double):
            _refuse_signature(what, pointer, ", ".join(each.__name__ for each in declared))
        return ctypes.cast(pointer, ctypes.c_void_p).value
    if type(pointer).__module__ == "_cffi_backend":
        import cffi

        ffi = cffi.FFI()
        kind = ffi.typeof(pointer)
        if kind.kind == "pointer":
            kind = kind.item
        arguments = [each.cname for each in kind.args] if kind.kind == "function" else []
        if len(arguments) != 4 or arguments[0] != "double" or kind.result.kind != "void":
            _refuse_signature(what, pointer, kind.cname)
        return int(ffi.cast("uintptr_t", pointer))
    numba = sys.modules.get("numba")
    if numba is not None and isinstance(pointer, numba.core.ccallback.CFunc):
        declared = str(pointer._sig)
        if declared != "(float64, float64*, float64*, float64*) -> none":
            _refuse_signature(what, pointer, declared)
        return int(pointer.address)
    return None


def _refuse_signature(what: str, pointer: object, declared: str) -> None:
    refuse(what, pointer, f"expected {_SIGNATURE}, got {declared}", TypeError)
