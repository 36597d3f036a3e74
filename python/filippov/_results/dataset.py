# SPDX-License-Identifier: BSD-3-Clause
"""Results as `xarray.Dataset`; xarray is imported when one is made."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._support.types import Record
from filippov._system.system import Params, System

from .settings import Settings

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset", "event_variables"]


def dataset(
    result: object,
    variables: Mapping[str, Any],
    coords: Mapping[str, Any],
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Make the dataset of a result, a dataclass, of what every kind of NetCDF file can hold.

    Its numbers and words, settings and parameters become attributes; arrays are what is given as
    variables, complex ones as two: `name_real` and `name_imag`.
    """
    import xarray

    told: dict[str, Any] = {"filippov": _core.__version__}
    for field in dataclasses.fields(result):  # type: ignore[arg-type]
        if field.name not in (*variables, *coords) and not field.name.startswith("_"):
            told |= _attributes(field.name, getattr(result, field.name))
    told |= dict(attrs or {})
    told = {name: _plain(value) for name, value in told.items() if not _empty(value)}
    made = xarray.Dataset(_real(variables), coords, told)
    # The format of 1990 knows a dimension of length 0 only as the first one.
    empty = [name for name, size in made.sizes.items() if size == 0]
    return made.transpose(*empty, ...) if empty else made


def event_variables(
    events: Record, prefix: str = "", **inner: str
) -> dict[str, tuple[tuple[str, ...], NDArray[Any]]]:
    """Give the columns of an event log as variables over the dimension `event`.

    Parameters
    ----------
    inner
        Second dimension of columns that have one, by their names; of modes it is `surface`.
    """
    variables: dict[str, tuple[tuple[str, ...], NDArray[Any]]] = {}
    for name in events.dtype.names or ():
        column = events[name]
        dims = ("event", inner.get(name, "surface")) if column.ndim == 2 else ("event",)
        variables[prefix + name] = (dims, column)
    return variables


def _attributes(name: str, value: object) -> dict[str, Any]:
    if isinstance(value, System):
        return {name: value.name}
    if isinstance(value, Params):
        return dict(value)
    if isinstance(value, (bool, np.bool_)):
        return {name: int(value)}
    if isinstance(value, Enum):
        return {name: str(value.value)}
    if isinstance(value, (int, float, str, np.generic)):
        return {name: value}
    if isinstance(value, tuple) and all(isinstance(v, (int, float, str)) for v in value):
        return {name: value}
    if isinstance(value, Settings):
        return {key: v for key, v in dataclasses.asdict(value).items() if v is not None}
    return {}


def _empty(value: object) -> bool:
    return isinstance(value, (tuple, list)) and len(value) == 0


def _plain(value: Any) -> Any:  # noqa: ANN401 - any attribute
    """Give an attribute as the oldest format holds it: text, or numbers of 32 or 64 bits."""
    if isinstance(value, (str, np.str_)):
        return str(value)
    if isinstance(value, (tuple, list)):
        if any(isinstance(v, (str, np.str_)) for v in value):
            return "; ".join(map(str, value))
        return [_plain(v) for v in value]
    if isinstance(value, (int, np.integer)) and not -(2**31) <= int(value) < 2**31:
        return float(value)
    return value


def _real(variables: Mapping[str, Any]) -> dict[str, Any]:
    """Give complex variables in two parts: NetCDF has no complex numbers."""
    parts: dict[str, Any] = {}
    for name, (dims, values) in variables.items():
        if np.iscomplexobj(values):
            parts[f"{name}_real"] = (dims, np.real(values))
            parts[f"{name}_imag"] = (dims, np.imag(values))
        else:
            parts[name] = (dims, values)
    return parts
