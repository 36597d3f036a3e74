# SPDX-License-Identifier: BSD-3-Clause
"""Systems from sympy: its formulas are written as a function of numpy, which is recorded."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from filippov._support.check import mapping, refuse

from .trace import DefinitionError

__all__ = ["Formulas"]

#: What sympy would write in a way that cannot be recorded.
_OWN: dict[str, Callable[..., Any]] = {
    "Heaviside": lambda x, *_: np.heaviside(x, 0.5),
    "And": lambda *all_: functools.reduce(operator.and_, all_),
    "Or": lambda *all_: functools.reduce(operator.or_, all_),
    "Not": operator.invert,
}


class Formulas:
    """Expressions of sympy as what `filippov.system` takes.

    Parameters
    ----------
    state : sequence of sympy.Symbol
    params : mapping of sympy.Symbol to float
    time : sympy.Symbol, optional
    """

    def __init__(
        self,
        state: Sequence[Any],
        params: Mapping[Any, float] | None,
        time: Any | None,  # noqa: ANN401 - a symbol
    ) -> None:
        import sympy

        self._sympy = sympy
        self.params = dict(mapping("params", params, "expected a mapping of symbols to values"))
        self.time = sympy.Symbol("t") if time is None else time
        if isinstance(state, str) or not isinstance(state, Sequence):
            refuse("state", state, "expected a list of sympy symbols", TypeError)
        self.state = list(state)
        for what, symbols in (
            ("state", self.state), ("params", list(self.params)), ("time", [self.time]),
        ):  # fmt: skip
            for symbol in symbols:
                if not isinstance(symbol, sympy.Symbol):
                    refuse(what, symbol, "expected a sympy symbol", TypeError)
                if not str(symbol).isidentifier():  # sympy writes a program with them
                    refuse(what, str(symbol), "expected a symbol whose name is one of Python")

    def names(self, symbols: Sequence[Any]) -> list[str]:
        """Names of symbols."""
        return [str(symbol) for symbol in symbols]

    def _expression(self, what: str, value: object) -> Any:  # noqa: ANN401
        """Take an expression or a number; sympy would evaluate a text as Python."""
        try:
            return self._sympy.sympify(value, strict=True)
        except self._sympy.SympifyError:
            refuse(what, value, "expected an expression of sympy, and no text", TypeError)

    def function(self, what: str, expressions: Any) -> Callable[..., Any]:  # noqa: ANN401
        """Write expressions as a function of `(t, s, p)`."""
        symbols = [self.time, *self.state, *self.params]
        several = isinstance(expressions, (list, tuple, self._sympy.MatrixBase))
        listed = [self._expression(what, e) for e in (expressions if several else [expressions])]
        for e in listed:
            unknown = e.free_symbols - set(symbols)
            if unknown:
                known = ", ".join(map(str, symbols))
                raise DefinitionError(
                    f"{what}: the symbol {sorted(map(str, unknown))[0]} is unknown; there are:"
                    f" {known}"
                )
            undefined = e.atoms(self._sympy.core.function.AppliedUndef)
            if undefined:
                raise DefinitionError(
                    f"{what}: {sorted(map(str, undefined))[0]} is a function; write the state as"
                    " symbols, x for x(t)"
                )
        written = self._sympy.lambdify(symbols, listed, modules=[_OWN, "numpy"])

        def f(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
            values = written(t, *s, *p)
            return values if several else values[0]

        return f
