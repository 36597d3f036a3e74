# SPDX-License-Identifier: BSD-3-Clause
"""Formulas in text: read by Python's parser, then computed from a list of what may be in them.

Nothing is ever evaluated as code: a text from a stranger can name numbers, the system's own names
and numpy's functions, and nothing else.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .trace import DefinitionError

__all__ = ["MOST_CHARACTERS", "formula_of"]

#: Of a formula. What is longer is written as a function.
MOST_CHARACTERS = 10_000

#: What formulas in text may call besides arithmetic.
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    word: getattr(np, word)
    for line in (
        "abs arccos arcsin arctan cbrt clip cos cosh exp heaviside hypot log log10 maximum minimum",
        "select sign sin sinh sqrt square tan tanh where",
    )
    for word in line.split()
}
_CONSTANTS = {"pi": np.pi}

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.Pow: operator.pow, ast.Mod: operator.mod,
    ast.FloorDiv: operator.floordiv, ast.BitAnd: operator.and_, ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
}  # fmt: skip
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Invert: operator.invert,
}  # fmt: skip
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}  # fmt: skip


def formula_of(text: str, what: str, names: Mapping[str, Any]) -> Any:  # noqa: ANN401
    """Compute a formula.

    Parameters
    ----------
    text : str
        As Python writes it: `"v - V*cos(t)"`.
    what : str
        What it is called in messages.
    names : mapping
        What its names stand for; they come before functions of the same name.

    Raises
    ------
    DefinitionError
        For a text that is no formula, with what is wrong with it.
    """
    shown = repr(text) if len(text) <= 100 else f"{text[:97]!r}..."
    if len(text) > MOST_CHARACTERS:
        raise DefinitionError(
            f"{what} = {shown} has {len(text)} characters, expected {MOST_CHARACTERS} at most:"
            " write it as a function f(t, s, p)"
        )
    try:
        tree = ast.parse(text.strip(), mode="eval")
        with np.errstate(all="ignore"):  # what is not finite is refused where it is recorded
            return _computed(tree.body, names)
    except DefinitionError as error:
        if isinstance(error, _NotAFormula):
            raise DefinitionError(f"{what} = {shown}: {error}") from None
        raise
    except (RecursionError, MemoryError):
        raise DefinitionError(
            f"{what} = {shown} is nested too deeply: write it as a function f(t, s, p)"
        ) from None
    except Exception as error:
        reason = error.msg if isinstance(error, SyntaxError) else error
        raise DefinitionError(
            f"{what} = {shown} cannot be read: {reason}. Known are {', '.join(names)} and numpy's"
            " functions"
        ) from None


class _NotAFormula(DefinitionError):
    """Something in a text that no formula has."""


def _computed(tree: ast.expr, names: Mapping[str, Any]) -> Any:  # noqa: ANN401
    """Value of a tree; operands first, without recursion: sums may have a thousand terms."""
    values: list[Any] = []
    todo: list[tuple[ast.expr, bool]] = [(tree, False)]
    while todo:
        node, below_is_done = todo.pop()
        parts = _parts(node)
        if parts and not below_is_done:
            todo.append((node, True))
            todo += [(part, False) for part in reversed(parts)]
            continue
        given = values[len(values) - len(parts) :]
        del values[len(values) - len(parts) :]
        values.append(_value(node, given, names))
    return values[0]


def _parts(node: ast.expr) -> Sequence[ast.expr]:
    """Give what a node is made of; refuse one that no formula has."""
    match node:
        case ast.Constant() | ast.Name():
            return ()
        case ast.BinOp(left=a, right=b):
            return (a, b)
        case ast.UnaryOp(op=ast.Not()) | ast.BoolOp():
            raise _NotAFormula("`and`, `or` and `not` decide at once: write &, | and ~")
        case ast.UnaryOp(operand=a):
            return (a,)
        case ast.Compare(left=a, comparators=[b]):
            return (a, b)
        case ast.Compare():
            raise _NotAFormula("a chain of comparisons: write (a < b) & (b < c)")
        case ast.Call(func=ast.Name(), args=args, keywords=[]):
            return args
        case ast.List(elts=elements) | ast.Tuple(elts=elements):
            return elements
        case ast.IfExp():
            raise _NotAFormula("`if` decides at once: write where(condition, a, b)")
        case ast.Call():
            raise _NotAFormula("only functions by their plain names are called, as sin(x)")
    raise _NotAFormula(f"{_written(node)} is no part of a formula")


def _written(node: ast.expr) -> str:
    words = ast.unparse(node)
    return repr(words if len(words) <= 60 else words[:57] + "...")


def _value(node: ast.expr, given: list[Any], names: Mapping[str, Any]) -> Any:  # noqa: ANN401
    match node:
        case ast.Constant(value=bool() | int() | float() as value):
            # of numpy, whose conditions have ~ and &; 9**9**9 of integers would not end
            return np.float64(value)
        case ast.Name(id=name):
            return _named(name, names)
        case ast.BinOp(op=op):
            if type(op) not in _BINARY:
                raise _NotAFormula("@, << and >> are no operations of a formula")
            return _BINARY[type(op)](*given)
        case ast.UnaryOp(op=op):
            return _UNARY[type(op)](*given)
        case ast.Compare(ops=[op]) if type(op) in _COMPARE:
            return _COMPARE[type(op)](*given)
        case ast.Call(func=ast.Name(id=name)):
            return _function(name, names)(*given)
        case ast.List() | ast.Tuple():
            return given
    raise _NotAFormula(f"{_written(node)} is no part of a formula")


def _named(name: str, names: Mapping[str, Any]) -> Any:  # noqa: ANN401
    if name in names:
        return names[name]
    if name in _CONSTANTS:
        return _CONSTANTS[name]
    also = ": it is a function" if name in _FUNCTIONS else ""
    raise _NotAFormula(f"the name {name!r} is unknown{also}. Known are {', '.join(names)}, pi")


def _function(name: str, names: Mapping[str, Any]) -> Callable[..., Any]:
    if name in names or name in _CONSTANTS:
        raise _NotAFormula(f"{name!r} is a number, and no function")
    if name not in _FUNCTIONS:
        raise _NotAFormula(
            f"the function {name!r} is unknown. Known are {', '.join(sorted(_FUNCTIONS))}"
        )
    return _FUNCTIONS[name]
