# SPDX-License-Identifier: BSD-3-Clause
"""Whether what was read from a file can be a result: kinds, lengths, indices, order of times."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Collection, Mapping
from typing import Any, Union

import numpy as np

from .status import Status
from .types import Record

__all__ = [
    "Unsound",
    "codes",
    "complete",
    "finite",
    "known",
    "ordered",
    "printable",
    "record",
    "require",
    "shaped",
    "typed",
]

STATUSES = frozenset(status.value for status in Status)


class Unsound(ValueError):
    """What makes no sense in a file, in words."""


def require(good: Any, words: str) -> None:  # noqa: ANN401 - a bool of Python or of numpy
    """Refuse what is not good."""
    if not good:
        raise Unsound(words)


def shaped(expected: tuple[int, ...], **arrays: np.ndarray[Any, Any]) -> None:
    """Arrays of one shape."""
    for name, array in arrays.items():
        require(array.shape == expected, f"{name} has shape {array.shape}, expected {expected}")


def codes(low: int, end: int, **arrays: Any) -> None:
    """Integers, or arrays of them, from `low` on and below `end`."""
    for name, values in arrays.items():
        each = np.asarray(values)
        outside = each[(each < low) | (each >= end)]
        if outside.size:
            require(False, f"{name} has {outside.flat[0]}, expected {low} to {end - 1}")


def printable(what: str, value: Any) -> None:  # noqa: ANN401 - a text, or any array
    """Refuse words that would steer a terminal: control characters, and those that turn a line."""
    if isinstance(value, str):
        value = np.array(value)
    if value.dtype.names is not None:
        for name in value.dtype.names:
            printable(f"{what}.{name}", value[name])
    elif value.dtype.kind == "U" and value.size and value.dtype.itemsize:
        order = value.dtype.byteorder
        codes = np.ascontiguousarray(value).reshape(-1).view(f"{order}u4")
        steers = np.zeros(codes.shape, dtype=bool)
        # without 0, which fills words up, and 10, which ends a line
        for first, last in ((1, 9), (11, 31), (127, 159), (0x202A, 0x202E), (0x2066, 0x2069),
                            (0xD800, 0xDFFF), (0x110000, 2**32 - 1)):  # fmt: skip
            steers |= (codes >= first) & (codes <= last)
        require(not steers.any(), f"{what} has words with control characters")


def finite(**arrays: Any) -> None:
    """Arrays without NaN and infinities."""
    for name, values in arrays.items():
        require(np.isfinite(values).all(), f"{name} has values that are not finite")


def known(accepted: Collection[str], **words: Any) -> None:
    """Words, or arrays of them, among the accepted ones."""
    for name, given in words.items():
        for word in np.unique(np.asarray(given, dtype=np.str_)).tolist():
            require(word in accepted, f"{name} has {word!r}, expected one of {', '.join(accepted)}")


def ordered(name: str, times: np.ndarray[Any, Any]) -> None:
    """Finite times that only rise, or only fall, but for some ulp.

    (A time is that within its period and the period's: events at one time may be an ulp apart.)
    """
    require(times.ndim == 1, f"{name} has shape {times.shape}, expected one dimension")
    finite(**{name: times})
    steps = np.diff(times)
    steps[np.abs(steps) <= 8 * np.spacing(np.abs(times[1:]))] = 0
    require((steps >= 0).all() or (steps <= 0).all(), f"{name} is out of order")


def record(name: str, values: Record, expected: np.dtype[Any]) -> None:
    """One axis of records with these columns, of which words may be of another length."""

    def kinds(dtype: np.dtype[Any]) -> list[tuple[str, object, tuple[int, ...]]]:
        columns = [(each, dtype[each]) for each in dtype.names or ()]
        return [(each, "U" if of.kind == "U" else of.base, of.shape) for each, of in columns]

    require(values.ndim == 1, f"{name} has shape {values.shape}, expected one dimension")
    require(kinds(values.dtype) == kinds(expected), f"{name} has the columns {values.dtype}")


def complete(params: Mapping[str, Any], names: Collection[str], *others: str) -> None:
    """Parameters of a system, each once, with others that are kept elsewhere."""
    have = [*params, *others]
    words = f"params are {', '.join(have) or 'none'}, expected {', '.join(names) or 'none'}"
    require(sorted(have) == sorted(names), words)


# --- kinds ----------------------------------------------------------------------------------------


def typed(made: object) -> None:
    """Refuse a dataclass with a field that is not what its annotation says."""
    for name, hint in _hints(type(made)).items():
        value = getattr(made, name)
        if not _fits(value, hint):
            kind = f"an array of {value.dtype}" if isinstance(value, np.ndarray) else repr(value)
            shown = kind if len(kind) <= 80 else kind[:77] + "..."
            raise Unsound(f"{name} is {shown}, expected {_words(hint)}")


def _hints(cls: Any) -> dict[str, Any]:  # noqa: ANN401 - a dataclass
    hints = typing.get_type_hints(cls)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls)}


def _fits(value: Any, hint: Any) -> bool:  # noqa: ANN401 - any field
    if hint is Any:
        return True
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (Union, types.UnionType):
        return any(_fits(value, each) for each in inner)
    if origin is np.ndarray:
        # a scalar stands for an array without axes
        array = isinstance(value, (np.ndarray, np.generic))
        return array and _is_of(value.dtype, typing.get_args(inner[1])[0])
    if origin is tuple:
        if not isinstance(value, tuple):
            return False
        if inner[-1] is Ellipsis:
            return all(_fits(each, inner[0]) for each in value)
        return len(value) == len(inner) and all(map(_fits, value, inner))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return isinstance(value, Mapping) and all(
            _fits(key, inner[0]) and _fits(each, inner[1]) for key, each in value.items()
        )
    if hint in (int, float) and isinstance(value, (bool, np.bool_)):
        return False
    also = {float: (int, np.integer, np.floating), int: (np.integer,), bool: (np.bool_,)}
    return isinstance(value, (hint, *also.get(hint, ())))


def _is_of(dtype: np.dtype[Any], scalar: Any) -> bool:  # noqa: ANN401 - Any, or a scalar of numpy
    if scalar is Any:
        return True
    expected = np.dtype(scalar)
    # words are as long as they are; integers as wide as the platform has them
    return dtype.kind == expected.kind and (dtype.kind in "Ui" or dtype == expected)


def _words(hint: Any) -> str:  # noqa: ANN401 - an annotation
    if typing.get_origin(hint) is np.ndarray:
        scalar = typing.get_args(typing.get_args(hint)[1])[0]
        return "an array" if scalar is Any else f"an array of {np.dtype(scalar).name}"
    return str(getattr(hint, "__name__", hint)) if isinstance(hint, type) else str(hint)
