# SPDX-License-Identifier: BSD-3-Clause
"""Refusals that name the argument, its value and what was expected."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from ._types import Floats

__all__ = ["choice", "integer", "number", "refuse", "span", "vector"]


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
    below: float = math.inf,
    infinite: bool = False,
) -> float:
    """Real number strictly between two bounds."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not isinstance(value, numbers.Real):
        refuse(name, value, expected, TypeError)
    result = float(value)
    good = above < result and (result < below or (infinite and result == math.inf == below))
    if math.isnan(result) or not good:
        refuse(name, value, expected)
    return result


def integer(name: str, value: object) -> int:
    """Positive integer; a float that is one passes."""
    if isinstance(value, (float, np.floating)) and float(value).is_integer():
        value = int(value)
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        refuse(name, value, "expected an integer > 0", TypeError)
    result = int(value)
    if not 0 < result < 2**63:
        refuse(name, value, "expected an integer > 0 (and below 2**63)")
    return result


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


def choice(name: str, value: object, accepted: Mapping[str, int]) -> int:
    """Meaning of one of the accepted words."""
    if isinstance(value, str) and value in accepted:
        return accepted[value]
    refuse(name, value, "expected one of " + ", ".join(map(repr, accepted)))


def span(name: str, value: float, forced: bool, least: float) -> float:
    """Length of a run: whole periods, or a time."""
    what = "whole periods" if forced else "a time"
    expected = f"expected a finite number {'>=' if least == 0 else '>'} 0: {what}"
    result = number(name, value, expected)
    if not result >= least or (forced and not result.is_integer()):
        refuse(name, value, expected)
    return result
