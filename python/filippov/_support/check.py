# SPDX-License-Identifier: BSD-3-Clause
"""Refusals that name the argument, its value and what was expected."""

from __future__ import annotations

import keyword
import math
import numbers
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .types import Floats

T = TypeVar("T")

__all__ = [
    "LAWS",
    "MOST",
    "UNORDERED",
    "among",
    "choice",
    "flag",
    "floats",
    "integer",
    "label_of",
    "mapping",
    "name_of",
    "names_of",
    "number",
    "one_of",
    "path_of",
    "refuse",
    "span",
    "start_first",
    "start_within",
    "time_span",
    "transposed",
    "two",
    "vector",
    "word",
    "words",
]


LONGEST = 2.0**52  #: periods that can be told apart
LONGEST_NAME = 100  #: characters of a name of a component or a parameter
LONGEST_LABEL = 200  #: of the name of a system, a surface or a jump

#: Smooth functions in place of a sign.
LAWS = ("arctan", "tanh", "saturation")
MOST = 2**63 - 1  #: of counts that only end a run
#: Without an order, or in one that has no meaning.
UNORDERED = (set, frozenset, Mapping, str, bytes)


def refuse(
    name: str, value: object, expected: str, error: type[Exception] = ValueError
) -> NoReturn:
    """Raise `error` with "name = value: expected ..."."""
    raise error(f"{name} = {_show(value)}: {expected}")


def _show(value: object) -> str:
    if np.ma.isMaskedArray(value):
        text = str(value)
    elif isinstance(value, np.ndarray):
        text = np.array2string(value, threshold=6, separator=", ")
    elif hasattr(value, "columns"):
        text = f"<a {type(value).__name__} of pandas>"
    elif isinstance(value, np.generic):
        text = repr(value.item())
    else:
        try:
            text = repr(value)
        except ValueError:  # an integer of more digits than Python writes
            text = f"a very large {type(value).__name__}"
    return text if len(text) <= 200 else text[:197] + "..."


def number(
    name: str,
    value: object,
    expected: str = "expected a finite number",
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    below: float = math.inf,
    infinite: bool = False,
) -> float:
    """Real number strictly between two bounds, and not below `least`."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        refuse(name, value, expected, TypeError)
    try:
        result = float(value)
    except OverflowError:
        refuse(name, value, expected)
    good = above < result >= least and (
        result < below or (infinite and result == math.inf == below)
    )
    if math.isnan(result) or not good:
        refuse(name, value, expected)
    return result


def integer(name: str, value: object, least: int = 1, most: int = 2**31 - 1) -> int:
    """Integer from `least` on, 0 or 1, to `most`; a float that is one passes."""
    expected = f"expected an integer {'>' if least else '>='} 0"
    if isinstance(value, (float, np.floating)) and float(value).is_integer():
        value = int(value)
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        refuse(name, value, expected, TypeError)
    result = int(value)
    if not least <= result <= most:
        bound = f"below 2**{most.bit_length()}" if (most + 1).bit_count() == 1 else f"up to {most}"
        refuse(name, value, f"{expected} (and {bound})")
    return result


def flag(name: str, value: object) -> bool:
    """Take True or False, of Python or of numpy, or 1 or 0; the text "no" would be true."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_, int, np.integer)) and value in (0, 1):
        return bool(value)
    refuse(name, value, "expected True or False", TypeError)


def mapping(name: str, value: object, expected: str) -> Mapping[str, Any]:
    """Names to values; None is none of them."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        refuse(name, value, expected, TypeError)
    return value


def name_of(name: str, value: object) -> str:
    """Text that something is called."""
    if not isinstance(value, str):
        refuse(name, value, "expected a text", TypeError)
    return value


def label_of(name: str, value: object) -> str:
    """Text that something is called in messages and titles: one line of what can be printed."""
    text = name_of(name, value)
    if not text or not text.isprintable() or len(text) > LONGEST_LABEL:
        refuse(name, value, f"expected a text of one line, 1 to {LONGEST_LABEL} characters")
    return text


def names_of(what: str, names: Any, *, typed: bool = True) -> tuple[str, ...]:  # noqa: ANN401 - checked here
    """Names in a text, separated by spaces or commas, or in a sequence.

    Parameters
    ----------
    typed : bool
        Whether they are for use in Python, where `lambda` is none.
    """
    if isinstance(names, str):
        names = names.replace(",", " ").split()
    try:
        found = tuple(names)
    except TypeError:
        refuse(what, names, "expected names, as in 'y v'", TypeError)
    for name in found:
        if not isinstance(name, str):
            refuse(what, names, f"{name!r} is no name", TypeError)
        if len(name) > LONGEST_NAME:
            refuse(what, names, f"expected names of {LONGEST_NAME} characters at most")
        if not name.isidentifier() or (typed and keyword.iskeyword(name)):
            refuse(what, names, f"{name!r} is no name")
        if name.startswith("_") or name == "t" or (what == "params" and hasattr(Mapping, name)):
            refuse(what, names, f"the name {name!r} has another meaning")
    if len(set(found)) != len(found):
        refuse(what, names, "expected different names")
    return found


def path_of(name: str, value: object) -> Path:
    """Path of a file or a directory."""
    if not isinstance(value, (str, os.PathLike)) or value == "":
        refuse(name, value, "expected a path", TypeError)
    try:
        return Path(value)
    except TypeError:  # one of bytes
        refuse(name, value, "expected a path", TypeError)


def among(value: object, accepted: Collection[int]) -> bool:
    """Whether this is a number, and one of the accepted."""
    return not isinstance(value, bool) and isinstance(value, numbers.Real) and value in accepted


def one_of(name: str, value: object, accepted: Collection[int], expected: str) -> int:
    """One of the accepted integers."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not among(value, accepted):
        refuse(name, value, expected)
    return int(value)  # type: ignore[call-overload, no-any-return]


def floats(name: str, value: ArrayLike, expected: str) -> Floats:
    """Array of any shape, of numbers: what is masked, or only true or false, is none."""
    if (lost := _lost(value)) is not None:
        refuse(name, value, f"{expected}, {lost}", TypeError)
    try:
        raw = np.asarray(value)
        if raw.dtype == object and _all_real(raw):  # integers beyond 64 bits are among them
            raw = raw.astype(np.float64)
        if raw.dtype.kind not in "fiu":
            raise TypeError
        with np.errstate(over="ignore"):  # a longer double; what is too large is not finite
            return np.asarray(raw, dtype=np.float64)
    # a RuntimeError is that of objects of other libraries that cannot be made an array of now
    except (TypeError, ValueError, OverflowError, RuntimeError):
        refuse(name, value, expected, TypeError)


def _lost(value: object) -> str | None:
    """Tell what an array of this would lose: a mask, names of rows or columns, a yes or no."""
    if isinstance(value, (list, tuple)):
        return next((lost for lost in map(_lost, value) if lost is not None), None)
    if isinstance(value, (bool, np.bool_)):
        return "not True or False"
    if np.ma.isMaskedArray(value):
        masked = np.ma.is_masked(value)
        return "none of them masked: fill them, or leave them out" if masked else None
    if hasattr(value, "columns") and hasattr(value, "index"):
        return "not a table: take columns, as in df[names].to_numpy().T"
    return None


def _all_real(raw: np.ndarray[Any, Any]) -> bool:
    return raw.size > 0 and all(
        isinstance(v, numbers.Real) and not isinstance(v, bool) for v in raw.flat
    )


def transposed(shape: tuple[int, ...], size: int) -> str:
    """Say what to write where the components come last: they come first everywhere."""
    turned = len(shape) > 1 and shape[0] != size and shape[-1] == size
    return ": the components come first, as in the transpose .T of this" if turned else ""


def vector(name: str, value: ArrayLike, size: int, names: tuple[str, ...] = ()) -> Floats:
    """Array of `size` finite numbers."""
    hint = f" ({', '.join(names)})" if names else ""
    expected = f"expected {size} finite number{'s' if size != 1 else ''}{hint}"
    array = floats(name, value, expected).copy()
    if array.ndim == 0 and size == 1:
        array = array.reshape(1)
    if array.shape != (size,):
        alone = array.ndim == 2 and array.size == size and 1 in array.shape
        more = f": one list, {array.ravel().tolist()}, not lists in a list" if alone else ""
        refuse(name, value, f"{expected}, got shape {array.shape}{more}")
    if not np.isfinite(array).all():
        refuse(name, value, expected)
    _in_order(name, value, names, expected)
    return array


def _in_order(name: str, value: object, names: tuple[str, ...], expected: str) -> None:
    """Refuse a pandas Series whose labels are the names in another order."""
    labels = getattr(value, "index", None)
    if labels is None or callable(labels):  # a list has a method of this name
        return
    given = tuple(labels)
    if given != names and len(given) == len(names) and set(given) == set(names):
        refuse(name, list(given), f"{expected} in this order")


def start_first(call: str, x0: object, t_span: object, dim: int) -> None:
    """Refuse times in place of the start: scipy has the times first.

    With one component, or three and more, two times are no start. In the plane both orders fit.
    There a start that is written as everywhere else, as a list or an array before a tuple of times,
    is taken as it is. Else two numbers that rise are times if they are further apart than the times
    that follow, in a tuple before a list, and two different ones if no time passes.
    """
    pair = _two_numbers(x0)
    if pair is None:
        return
    a, b = pair
    crossed = isinstance(x0, tuple) and not isinstance(t_span, tuple)
    usual = isinstance(x0, list) and isinstance(t_span, tuple)
    if dim != 2:
        swapped = np.shape(_quiet(t_span))[:1] == (dim,)
    elif usual or (length := _length(t_span)) is None:
        swapped = False
    elif crossed and a < b:
        swapped = length < b - a
    else:
        swapped = length == 0 and a != b
    if swapped:
        right = f"{call}(sys, x0={_show(_plain(t_span))}, t_span={_show(pair)})"
        way = "; if this is the start, write it as a list, and the times as a tuple"
        refuse("x0", x0, f"expected the start before the times, as in {right}{way * (dim == 2)}")


def _two_numbers(value: object) -> tuple[float, float] | None:
    """Two numbers in a list or a tuple; an array has been computed, and is a start."""
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        return None
    good = all(isinstance(v, numbers.Real) and not isinstance(v, bool) for v in value)
    return (value[0], value[1]) if good else None


def _quiet(value: object) -> np.ndarray[Any, Any]:
    """Array of whatever it is; the argument itself is checked elsewhere."""
    if _lost(value) is not None:
        return np.empty(0)
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        return np.empty(0)


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _length(t_span: object) -> float | None:
    """Longest time between starts and ends, None of what are no times."""
    times = _quiet(t_span)
    if times.shape[:1] != (2,) or times.size == 0:
        return None
    return float(np.max(times[1] - times[0]))


def word(name: str, value: object, accepted: Collection[str], expected: str = "") -> str:
    """One of the accepted words."""
    if isinstance(value, str) and value in accepted:
        return str(value)
    refuse(name, value, expected or "expected one of " + ", ".join(map(repr, accepted)))


def words(
    name: str, value: object, accepted: Collection[str], expected: str = ""
) -> tuple[str, ...]:
    """One of the accepted words, or several."""
    expected = expected or "expected one or several of " + ", ".join(map(repr, accepted))
    each: tuple[object, ...]
    try:
        each = (value,) if isinstance(value, str) else tuple(value)  # type: ignore[arg-type]
    except TypeError:
        refuse(name, value, expected, TypeError)
    if not all(isinstance(one, str) and one in accepted for one in each):
        refuse(name, value, expected)
    return tuple(map(str, each))


def two(name: str, value: Any, expected: str) -> tuple[Any, Any]:  # noqa: ANN401 - of any kind
    """First and second of two in an order."""
    try:
        if isinstance(value, UNORDERED) or not hasattr(value, "__len__"):
            raise TypeError
        first, second = value
    except (TypeError, ValueError):
        refuse(name, value, expected, ValueError)
    return first, second


def time_span(t_span: tuple[float, float]) -> tuple[float, float]:
    """Start and end of a run."""
    expected = "expected two finite numbers, start and end"
    t0, t_end = two("t_span", t_span, expected)
    return number("t_span[0]", t0, expected), number("t_span[1]", t_end, expected)


def start_within(name: str, t0: float, period: float | None) -> float:
    """Refuse a time of more periods than can be told apart."""
    if period is not None and abs(t0) / period >= LONGEST:
        refuse(name, t0, f"expected a time of fewer than 2**52 periods, {period:.9g} each")
    return t0


def choice(name: str, value: object, accepted: Mapping[str, T]) -> T:
    """Meaning of one of the accepted words."""
    return accepted[word(name, value, accepted)]


def span(name: str, value: float, forced: bool, least: float) -> float:
    """Length of a run: whole periods, or a time."""
    what = "whole periods" if forced else "a time"
    expected = f"expected a finite number {'>=' if least == 0 else '>'} 0: {what}"
    result = number(name, value, expected)
    if forced and result >= LONGEST:
        refuse(name, value, f"{expected}, fewer than 2**52")
    if not result >= least or (forced and not result.is_integer()):
        refuse(name, value, expected)
    return result
