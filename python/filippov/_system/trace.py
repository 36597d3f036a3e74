# SPDX-License-Identifier: BSD-3-Clause
"""Numbers that record what is done with them: how an ordinary function becomes formulas."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from filippov import _core
from filippov._support.check import floats, refuse

__all__ = [
    "DefinitionError",
    "Expression",
    "Names",
    "Numbers",
    "Vector",
    "as_expressions",
    "unit",
]


class DefinitionError(ValueError):
    """A function cannot be made into a system; the message says why, and what to write instead."""


def _operators(name: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Give an operator of two numbers, and the one with its operands exchanged."""
    return (
        lambda self, other: self._with(name, other),
        lambda self, other: self._with(name, other, swapped=True),
    )


class _Recorded:
    """Takes over what numpy is asked to do with it."""

    __slots__ = ()
    __array_priority__ = 1000

    def __array_ufunc__(
        self,
        ufunc: np.ufunc,
        method: str,
        *inputs: Any,
        **kwargs: Any,
    ) -> Any:
        return _apply_ufunc(ufunc, method, inputs, kwargs)

    def __array_function__(
        self,
        func: Callable[..., Any],
        types: object,
        args: Sequence[Any],
        kwargs: Mapping[str, Any],
    ) -> Any:
        return _apply_function(func, args, kwargs)


class Expression(_Recorded):
    """A number that is not known yet: a component of the state, the time, or what is made of them.

    Arithmetic, comparisons and numpy's functions of it are recorded.
    """

    __slots__ = ("_e", "_graph")
    # A comparison gives an expression, so that it cannot be looked up by its value.
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, graph: _core.Graph, e: int) -> None:
        self._graph = graph
        self._e = e

    # --- arithmetic -----------------------------------------------------------------------------

    __add__, __radd__ = _operators("add")
    __sub__, __rsub__ = _operators("sub")
    __mul__, __rmul__ = _operators("mul")
    __truediv__, __rtruediv__ = _operators("div")
    __pow__, __rpow__ = _operators("pow")
    # conditions are 1 or 0: both is their product
    __and__, __rand__ = _operators("mul")

    def __neg__(self) -> Expression:
        return self._unary("neg")

    def __pos__(self) -> Expression:
        return self

    def __abs__(self) -> Expression:
        return Expression(self._graph, self._graph.abs(self._e))

    # --- comparisons: conditions are expressions that are 1 or 0 ----------------------------------

    def __lt__(self, other: object) -> Any:
        return self._beyond(other, sign=-1)

    def __le__(self, other: object) -> Any:
        return self._beyond(other, sign=-1)

    def __gt__(self, other: object) -> Any:
        return self._beyond(other, sign=1)

    def __ge__(self, other: object) -> Any:
        return self._beyond(other, sign=1)

    def __eq__(self, other: object) -> Any:
        _refuse_equality()

    def __ne__(self, other: object) -> Any:
        _refuse_equality()

    def __or__(self, other: object) -> Any:
        both = self._with("mul", other)
        return both if both is NotImplemented else self + other - both

    def __ror__(self, other: object) -> Any:
        return self.__or__(other)

    def __invert__(self) -> Any:
        return 1 - self

    # --- what Python would refuse without a word of what to write instead -------------------------

    def __mod__(self, _other: object) -> NoReturn:
        _integer_part()

    __rmod__ = __floordiv__ = __rfloordiv__ = __divmod__ = __rdivmod__ = __mod__

    def __round__(self, _digits: object = None) -> NoReturn:
        _integer_part()

    __floor__ = __ceil__ = __trunc__ = __round__

    def __format__(self, spec: str) -> str:
        if spec:
            raise DefinitionError(
                f"a text of a number ({spec!r}) where time, the state or a parameter is only"
                " recorded: it has no value yet"
            )
        return repr(self)

    def __xor__(self, _other: object) -> NoReturn:
        raise DefinitionError("^ is no power here: write x**2 for the square of x")

    __rxor__ = __xor__

    # --- what is not possible -------------------------------------------------------------------

    def __bool__(self) -> NoReturn:
        raise DefinitionError(
            "a decision on time, the state or a parameter (`if`, `and`, `or`, `while`, max(),"
            " min(), or np.sign of an array of recorded numbers): the function is called once, to"
            " be recorded. Use np.where(condition, a, b), np.minimum, np.maximum, & and |, or give"
            " each side its own function: filippov.System(fields={'-': f, '+': g}, switch=h)"
        )

    def __float__(self) -> NoReturn:
        raise DefinitionError(
            "a number is wanted where time, the state or a parameter is only recorded (math.cos,"
            " float(), an entry of an array of floats): use numpy's functions (np.cos for"
            " math.cos), and return a tuple of the derivatives"
        )

    __int__ = __index__ = __complex__ = __float__

    def __iter__(self) -> NoReturn:
        raise DefinitionError("a component of the state is one number: it has no entries")

    def __repr__(self) -> str:
        from .formula import text

        return text(self._graph, self._e)

    # --- how it is made ---------------------------------------------------------------------------

    def _lift(self, other: object) -> int | None:
        """Node of a number or an expression; None of anything else."""
        if isinstance(other, Expression):
            if other._graph is not self._graph:
                raise DefinitionError("a recorded number of another function was used")
            return other._e
        if isinstance(other, np.ndarray) and other.ndim == 0:
            other = other[()]
        if isinstance(other, numbers.Complex) and not isinstance(other, numbers.Real):
            raise DefinitionError(
                f"a complex number, {other}: write the real and the imaginary part of the state as"
                " components of their own"
            )
        if isinstance(other, (numbers.Real, np.bool_)):
            try:
                value = float(other)
            except OverflowError:
                value = math.inf
            if not math.isfinite(value):
                raise DefinitionError(f"the constant {value} is not finite")
            return self._graph.constant(value)
        return None

    def _with(self, name: str, other: object, *, swapped: bool = False) -> Any:
        b = self._lift(other)
        if b is None:
            return NotImplemented
        pair = (b, self._e) if swapped else (self._e, b)
        return Expression(self._graph, self._graph.binary(name, *pair))

    def _unary(self, name: str) -> Expression:
        return Expression(self._graph, self._graph.unary(name, self._e))

    def _beyond(self, other: object, sign: int) -> Any:
        difference = self._with("sub", other)
        if difference is NotImplemented:
            return NotImplemented
        e = difference._e if sign > 0 else self._graph.unary("neg", difference._e)
        return Expression(self._graph, self._graph.step(e))


def _refuse_equality() -> NoReturn:
    raise DefinitionError(
        "== and != of recorded numbers: a solution is at one value for no time. Compare with < or >"
    )


# --- functions of numbers -------------------------------------------------------------------------


def _as_expression(like: Expression, value: object) -> Expression:
    e = like._lift(value)
    if e is None:
        raise DefinitionError(f"{value!r} is no number that can be recorded")
    return Expression(like._graph, e)


def _unary(name: str) -> Callable[[Any], Any]:
    def function(x: Expression) -> Expression:
        return x._unary(name)

    return function


def _choose(condition: Any, a: Any, b: Any) -> Any:
    """Give a where the condition holds, else b."""
    if isinstance(condition, (bool, np.bool_)):
        return a if condition else b
    recorded = next(v for v in (condition, a, b) if isinstance(v, Expression))
    c, x, y = (_as_expression(recorded, v)._e for v in (condition, a, b))
    return Expression(recorded._graph, recorded._graph.where(c, x, y))


def _minimum(a: Any, b: Any) -> Any:
    return _choose(a < b, a, b)


def _maximum(a: Any, b: Any) -> Any:
    return _choose(a > b, a, b)


def _heaviside(x: Any, _at_zero: Any) -> Any:
    return x > 0  # a solution is at zero for no time, or slides there


def _hypot(a: Any, b: Any) -> Any:
    return np.sqrt(a * a + b * b)


def _integer_part(*_: object) -> NoReturn:
    raise DefinitionError(
        "%, //, round, floor, ceil, rint, fmod and the like switch at infinitely many places. Of a"
        " period of time use np.sign(np.sin(omega*t)); write a few steps as np.where(x > 1, ..., 0)"
    )


def _inverse_of_two(*_: object) -> NoReturn:
    raise DefinitionError("arctan2 is not known; use np.arctan of a quotient where that is enough")


#: numpy's functions of one number and more, as they are recorded.
_UFUNCS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "true_divide": lambda a, b: a / b,
    "power": lambda a, b: a**b,
    "float_power": lambda a, b: a**b,
    "negative": lambda a: -a,
    "positive": lambda a: a,
    "absolute": abs,
    "fabs": abs,
    "square": lambda a: a * a,
    "reciprocal": lambda a: 1 / a,
    "sqrt": _unary("sqrt"),
    "cbrt": lambda a: np.sign(a) * np.abs(a) ** (1 / 3),
    "exp": _unary("exp"),
    "exp2": lambda a: np.exp(a * math.log(2)),
    "expm1": lambda a: 2 * np.sinh(a / 2) * np.exp(a / 2),
    "log": _unary("log"),
    "log2": lambda a: np.log(a) / math.log(2),
    "log10": lambda a: np.log(a) / math.log(10),
    "log1p": lambda a: np.log(1 + a),
    "sin": _unary("sin"),
    "cos": _unary("cos"),
    "tan": _unary("tan"),
    "arcsin": _unary("asin"),
    "arccos": lambda a: math.pi / 2 - np.arcsin(a),
    "arctan": _unary("atan"),
    "sinh": _unary("sinh"),
    "cosh": _unary("cosh"),
    "tanh": _unary("tanh"),
    "arctanh": lambda a: np.log((1 + a) / (1 - a)) / 2,
    "arccosh": lambda a: np.log(a + np.sqrt(a * a - 1)),
    "arcsinh": lambda a: 2 * np.arctanh(a / (1 + np.sqrt(a * a + 1))),  # smooth, on both sides
    "deg2rad": lambda a: a * (math.pi / 180),
    "radians": lambda a: a * (math.pi / 180),
    "rad2deg": lambda a: a * (180 / math.pi),
    "degrees": lambda a: a * (180 / math.pi),
    "hypot": _hypot,
    "sign": _unary("sign"),
    "heaviside": _heaviside,
    "minimum": _minimum,
    "fmin": _minimum,
    "maximum": _maximum,
    "fmax": _maximum,
    "less": lambda a, b: a < b,
    "less_equal": lambda a, b: a <= b,
    "greater": lambda a, b: a > b,
    "greater_equal": lambda a, b: a >= b,
    "logical_and": lambda a, b: a & b,
    "bitwise_and": lambda a, b: a & b,
    "logical_or": lambda a, b: a | b,
    "bitwise_or": lambda a, b: a | b,
    "logical_not": lambda a: ~a,
    "invert": lambda a: ~a,
    "equal": lambda _a, _b: _refuse_equality(),
    "not_equal": lambda _a, _b: _refuse_equality(),
    "floor": _integer_part,
    "ceil": _integer_part,
    "rint": _integer_part,
    "trunc": _integer_part,
    "fmod": _integer_part,
    "remainder": _integer_part,
    "floor_divide": _integer_part,
    "arctan2": _inverse_of_two,
}
# numpy calls these methods for entries of arrays of objects.
for _name in ("sqrt", "exp", "log", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "sinh",
              "cosh", "tanh", "log10", "log2", "log1p", "expm1", "exp2"):  # fmt: skip
    setattr(Expression, _name, (lambda function: lambda self: function(self))(_UFUNCS[_name]))


def _apply_ufunc(
    ufunc: np.ufunc, method: str, inputs: Sequence[Any], kwargs: Mapping[str, Any]
) -> Any:
    name = ufunc.__name__
    if kwargs.get("out") is not None or method == "at":
        raise DefinitionError(f"np.{name} writes into an array, which cannot be recorded")
    if name == "matmul" and method == "__call__":
        return _matmul(*inputs)
    function = _UFUNCS.get(name)
    if function is None:
        raise DefinitionError(f"np.{name} is not known; compose it of others, or use to_cpp")
    if method == "reduce" and name in ("add", "multiply", "minimum", "maximum"):
        return _fold(function, list(inputs[0]))
    if method != "__call__" or any(value is not None for value in kwargs.values()):
        raise DefinitionError(f"np.{name}.{method} with {sorted(kwargs)} cannot be recorded")
    if any(isinstance(v, Vector) or (isinstance(v, np.ndarray) and v.ndim) for v in inputs):
        return _elementwise(function, inputs)
    first = next(v for v in inputs if isinstance(v, Expression))
    return function(*(_as_expression(first, v) for v in inputs))


def _fold(function: Callable[..., Any], values: list[Any]) -> Any:
    if not values:
        raise DefinitionError("a sum of nothing")
    result = values[0]
    for value in values[1:]:
        result = function(result, value)
    return result


def unit(a: Any, b: Any, c: Any = None) -> Any:
    """Direction of a vector, `v/|v|`: of friction in a plane or in space.

    Where the vector is zero it is any vector of the unit disc, as `sign(0)` is any number from -1
    to 1: a body sticks there for as long as one of these holds it, and then leaves in the direction
    of the force.

    Parameters
    ----------
    a, b, c : number, array, or what is recorded of a function of a system
        Entries of the vector, two or three.

    Returns
    -------
    array, shape (2,) or (3,), or (2, k) or (3, k) of arrays
        Of length 1; NaN where the vector is zero, since it is no number there. In a function of a
        system a vector of what is recorded.

    Raises
    ------
    DefinitionError
        In a function of a system, for entries that cannot be recorded.
    TypeError, ValueError
        For entries that are no numbers, or arrays of different shapes.

    Examples
    --------
    >>> import filippov as fp
    >>> @fp.system(state="x y u w", params={"mu_g": 2.5})
    ... def puck(t, s, p):
    ...     n = fp.unit(s.u, s.w)
    ...     return s.u, s.w, -p.mu_g * n[0], -p.mu_g * n[1]
    >>> run = fp.simulate(puck, [0, 0, 3, 4], (0, 5))
    >>> run.y[:, -1].round(6)
    array([3., 4., 0., 0.])
    >>> fp.unit(3, 4)
    array([0.6, 0.8])
    """
    entries = (a, b) if c is None else (a, b, c)
    recorded = next((v for v in entries if isinstance(v, Expression)), None)
    if any(isinstance(v, Vector) for v in entries):
        raise DefinitionError("unit takes the entries of a vector one by one: unit(*v)")
    if recorded is not None:
        nodes = [_as_expression(recorded, v)._e for v in entries]
        g = recorded._graph
        return Vector([Expression(g, g.unit(nodes, k)) for k in range(len(nodes))])
    each = [floats(f"entry {'abc'[k]}", v, "expected numbers") for k, v in enumerate(entries)]
    shapes = {v.shape for v in each if v.ndim > 0}
    if len(shapes) > 1:
        refuse("entry b", b, f"expected entries of one shape, got {sorted(shapes)}")
    v = np.stack(np.broadcast_arrays(*each))
    with np.errstate(all="ignore"):
        scaled = v / np.max(np.abs(v), axis=0)
        return scaled / np.sqrt(np.sum(scaled**2, axis=0))


# --- vectors --------------------------------------------------------------------------------------


class Vector(_Recorded, Sequence[Any]):
    """Some numbers, of which some are recorded: what arithmetic with arrays gives."""

    __slots__ = ("_entries",)
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, entries: Sequence[Any]) -> None:
        self._entries = list(entries)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return Vector(self._entries[index])
        try:
            return self._entries[index]
        except IndexError:
            raise DefinitionError(
                f"entry {index} of a vector that has {len(self)}: {self!r}"
            ) from None

    def __len__(self) -> int:
        return len(self._entries)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._entries)

    @property
    def shape(self) -> tuple[int]:
        """One dimension."""
        return (len(self),)

    ndim = 1

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self)

    @property
    def T(self) -> Vector:
        """Itself."""
        return self

    def sum(self) -> Any:
        """Add the entries."""
        return _fold(lambda a, b: a + b, self._entries)

    def dot(self, other: Any) -> Any:
        """Multiply with a vector or a matrix."""
        return _matmul(self, other)

    def copy(self) -> Vector:
        """Give a vector with the same entries."""
        return Vector(self._entries)

    def __setitem__(self, index: Any, value: Any) -> NoReturn:
        raise DefinitionError(
            "an entry of a recorded vector cannot be changed: make the vector anew, with np.stack"
            " or as a tuple"
        )

    def __repr__(self) -> str:
        return f"Vector({self._entries!r})"

    def __bool__(self) -> NoReturn:
        Expression.__bool__(None)  # type: ignore[arg-type]

    def __array__(self, *_: object, **__: object) -> NoReturn:
        raise DefinitionError(
            "np.array or np.asarray of recorded numbers, or A.dot(s): use np.stack, np.concatenate,"
            " A @ s, or return a tuple"
        )


def _install_vector_operators() -> None:
    """Arithmetic of vectors is numpy's, entry by entry."""
    binary = {
        "add": np.add, "sub": np.subtract, "mul": np.multiply, "truediv": np.divide,
        "pow": np.power, "and": np.bitwise_and, "or": np.bitwise_or,
    }  # fmt: skip
    for name, ufunc in binary.items():
        setattr(Vector, f"__{name}__", lambda self, other, f=ufunc: f(self, other))
        setattr(Vector, f"__r{name}__", lambda self, other, f=ufunc: f(other, self))
    compare = {"lt": np.less, "le": np.less_equal, "gt": np.greater, "ge": np.greater_equal}
    for name, ufunc in compare.items():
        setattr(Vector, f"__{name}__", lambda self, other, f=ufunc: f(self, other))
    for name, one in {"neg": np.negative, "abs": np.absolute, "invert": np.invert}.items():
        setattr(Vector, f"__{name}__", lambda self, f=one: f(self))
    setattr(Vector, "__matmul__", lambda self, other: _matmul(self, other))  # noqa: B010
    setattr(Vector, "__rmatmul__", lambda self, other: _matmul(other, self))  # noqa: B010


_install_vector_operators()


def _length(value: object) -> int | None:
    """Entries of a vector; None of a number."""
    if isinstance(value, Vector):
        return len(value)
    if isinstance(value, (np.ndarray, list, tuple)):
        array = np.asarray(value, dtype=object)
        if array.ndim > 1:
            raise DefinitionError(f"an array of shape {array.shape} in arithmetic with a vector")
        return None if array.ndim == 0 else array.size
    return None


def _elementwise(function: Callable[..., Any], inputs: Sequence[Any]) -> Vector:
    lengths = {n for n in map(_length, inputs) if n is not None}
    if len(lengths) != 1:
        raise DefinitionError(f"vectors of different lengths: {sorted(lengths)}")
    (n,) = lengths
    columns = [[v] * n if _length(v) is None else list(v) for v in inputs]
    first = next((v for column in columns for v in column if isinstance(v, Expression)), None)
    if first is None:
        raise DefinitionError("arithmetic with a vector in which nothing is recorded")
    return Vector(
        [function(*(_as_expression(first, v) for v in row)) for row in zip(*columns, strict=True)]
    )


def _matmul(a: Any, b: Any) -> Any:
    """Multiply vectors with vectors and with matrices of numbers."""
    a, b = (np.array(v, dtype=object) if isinstance(v, (list, tuple)) else v for v in (a, b))
    if isinstance(a, np.ndarray) and a.ndim == 2:
        if a.shape[1] != len(b):
            raise DefinitionError(f"a matrix of shape {a.shape} times {len(b)} entries")
        return Vector([_matmul(row, b) for row in a])
    if isinstance(b, np.ndarray) and b.ndim == 2:
        return _matmul(b.T, a)
    if len(a) != len(b):
        raise DefinitionError(f"a product of vectors with {len(a)} and {len(b)} entries")
    return _fold(lambda x, y: x + y, [x * y for x, y in zip(a, b, strict=True)])


def _where(condition: Any, a: Any = None, b: Any = None) -> Any:
    if a is None or b is None:
        raise DefinitionError("np.where without the two values: np.where(condition, a, b)")
    if any(_length(v) is not None for v in (condition, a, b)):
        return _elementwise(_choose, (condition, a, b))
    return _choose(condition, a, b)


def _clip(x: Any, low: Any = None, high: Any = None, **_: object) -> Any:
    x = x if low is None else np.maximum(x, low)
    return x if high is None else np.minimum(x, high)


def _select(conditions: Sequence[Any], values: Sequence[Any], default: Any = 0) -> Any:
    for condition, value in zip(reversed(conditions), reversed(values), strict=True):
        default = np.where(condition, value, default)
    return default


def _joined(arrays: Sequence[Any], *_: object, **__: object) -> Vector:
    return Vector([v for part in arrays for v in (part if _length(part) is not None else [part])])


def _total(x: Any, **_: object) -> Any:
    return _fold(lambda a, b: a + b, list(x))


#: numpy's other functions.
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "where": _where,
    "clip": _clip,
    "select": _select,
    "stack": _joined,
    "hstack": _joined,
    "concatenate": _joined,
    "array": _joined,
    "sum": _total,
    "dot": _matmul,
    "inner": _matmul,
    "vdot": _matmul,
    "norm": lambda x, **_: np.sqrt(_matmul(x, x)),
    "copy": lambda x, **_: x,
    "ndim": lambda x: 0 if isinstance(x, Expression) else 1,
    "shape": lambda x: () if isinstance(x, Expression) else (len(x),),
    "size": lambda x: 1 if isinstance(x, Expression) else len(x),
}


def _apply_function(
    func: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]
) -> Any:
    function = _FUNCTIONS.get(func.__name__)
    if function is None:
        raise DefinitionError(
            f"np.{func.__name__} of recorded numbers is not known; write it with arithmetic,"
            " np.where, np.sign, ..."
        )
    return function(*args, **kwargs)


# --- arguments of a user's function ---------------------------------------------------------------


class Names(Vector):
    """Named numbers: `s.v`, `s[1]`, `s["v"]`, and `y, v = s`."""

    __slots__ = ("_names", "_what")

    def __init__(self, names: Sequence[str], entries: Sequence[Any], what: str) -> None:
        super().__init__(entries)
        self._names = tuple(names)
        self._what = what

    def __getattribute__(self, name: str) -> Any:
        # a name first: a state may be called T or size
        if not name.startswith("_") and name in object.__getattribute__(self, "_names"):
            return self._entries[self._names.index(name)]
        return super().__getattribute__(name)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # numpy and copy look for what is not there
            raise AttributeError(name)
        known = ", ".join(self._names) or "none"
        raise DefinitionError(f"{self._what} {name!r} is unknown; there are: {known}")

    def __setattr__(self, name: str, value: object) -> None:
        if name in ("_names", "_what", "_entries"):
            return super().__setattr__(name, value)
        raise DefinitionError(
            f"{self._what} {name!r} cannot be set: a function returns derivatives"
        )

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, str):
            return getattr(self, index)
        return super().__getitem__(index)


class Numbers(np.ndarray):
    """The same of numbers that are known: what a function is checked with."""

    _names: tuple[str, ...] = ()

    def __new__(cls, names: Sequence[str], values: Any) -> Numbers:  # noqa: PYI034 - 3.10
        """Name the entries of an array."""
        self = np.array(values, dtype=np.float64).view(cls)
        self._names = tuple(names)
        return self

    def __getattribute__(self, name: str) -> Any:
        if not name.startswith("_"):
            names = super().__getattribute__("_names")
            if name in names:
                return super().__getitem__(names.index(name))
        return super().__getattribute__(name)

    def __getitem__(self, index: Any) -> Any:
        return getattr(self, index) if isinstance(index, str) else super().__getitem__(index)


def as_expressions(
    graph: _core.Graph,
    values: object,
    n: int,
    what: str,
    names: Sequence[str],
    meaning: str = "the derivatives of",
) -> list[int]:
    """Nodes of what a function returned: n numbers."""
    wanted = f"expected {n} number{'s' if n > 1 else ''}, {meaning} {', '.join(names)}"
    if isinstance(values, (Expression, numbers.Real)):
        values = (values,)
    if isinstance(values, np.ndarray):
        values = list(values.reshape(-1)) if values.ndim <= 1 else None
    if not isinstance(values, (list, tuple, Vector)):
        raise DefinitionError(f"{what} returned {values!r}: {wanted}")
    if len(values) != n:
        raise DefinitionError(f"{what} returned {len(values)} values: {wanted}")
    zero = Expression(graph, graph.constant(0.0))
    nodes = []
    for name, value in zip(names, values, strict=True):
        e = zero._lift(value)
        if e is None:
            raise DefinitionError(f"{what} returned {value!r} for {name}: {wanted}")
        nodes.append(e)
    return nodes
