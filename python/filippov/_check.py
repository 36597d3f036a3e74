# SPDX-License-Identifier: BSD-3-Clause
"""Refusals that name the argument, its value and what was expected."""

from __future__ import annotations

import keyword
import math
import numbers
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from ._types import Floats

__all__ = [
    "LAWS",
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
    "time_span",
    "vector",
    "word",
    "words",
]


LONGEST = 2.0**52  #: periods that can be told apart
LONGEST_NAME = 100  #: characters of a name of a component or a parameter
LONGEST_LABEL = 200  #: of the name of a system, a surface or a jump

#: Smooth functions in place of a sign.
LAWS = ("arctan", "tanh", "saturation")


def refuse(
    name: str, value: object, expected: str, error: type[Exception] = ValueError
) -> NoReturn:
    """Raise `error` with "name = value: expected ..."."""
    raise error(f"{name} = {_show(value)}: {expected}")


def _show(value: object) -> str:
    if isinstance(value, np.ndarray):
        text = np.array2string(value, threshold=6, separator=", ")
    elif isinstance(value, np.generic):
        text = repr(value.item())
    else:
        text = repr(value)
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


def integer(name: str, value: object, least: int = 1) -> int:
    """Integer from `least` on, 0 or 1; a float that is one passes."""
    expected = f"expected an integer {'>' if least else '>='} 0"
    if isinstance(value, (float, np.floating)) and float(value).is_integer():
        value = int(value)
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        refuse(name, value, expected, TypeError)
    result = int(value)
    if not least <= result < 2**63:
        refuse(name, value, f"{expected} (and below 2**63)")
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
    return isinstance(value, numbers.Real) and value in accepted


def one_of(name: str, value: object, accepted: Collection[int], expected: str) -> int:
    """One of the accepted integers."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not among(value, accepted):
        refuse(name, value, expected)
    return int(value)  # type: ignore[call-overload, no-any-return]


def floats(name: str, value: ArrayLike, expected: str) -> Floats:
    """Array of any shape."""
    try:
        raw = np.asarray(value)
        if raw.dtype.kind not in "fiub":
            raise TypeError
        return np.asarray(raw, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        refuse(name, value, expected, TypeError)


def vector(name: str, value: ArrayLike, size: int, names: tuple[str, ...] = ()) -> Floats:
    """Array of `size` finite numbers."""
    hint = f" ({', '.join(names)})" if names else ""
    expected = f"expected {size} finite number{'s' if size != 1 else ''}{hint}"
    try:
        raw = np.asarray(value)
        if raw.dtype.kind not in "fiub":
            raise TypeError
        array = np.array(raw, dtype=np.float64)
    except (TypeError, ValueError):
        refuse(name, value, expected, TypeError)
    if array.ndim == 0 and size == 1:
        array = array.reshape(1)
    if array.shape != (size,):
        refuse(name, value, f"{expected}, got shape {array.shape}")
    if not np.isfinite(array).all():
        refuse(name, value, expected)
    return array


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


def time_span(t_span: tuple[float, float]) -> tuple[float, float]:
    """Start and end of a run."""
    expected = "expected two finite numbers, start and end"
    try:
        t0, t_end = t_span
    except (TypeError, ValueError):
        refuse("t_span", t_span, expected)
    return number("t_span[0]", t0, expected), number("t_span[1]", t_end, expected)


def choice(name: str, value: object, accepted: Mapping[str, int]) -> int:
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
