# SPDX-License-Identifier: BSD-3-Clause
"""Results as `xarray.Dataset`; xarray is imported when one is made."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._settings import Settings
from ._system import Params, System
from ._types import Record

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["dataset", "event_variables"]


def dataset(
    result: object,
    variables: Mapping[str, Any],
    coords: Mapping[str, Any],
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Make the dataset of a result, a dataclass.

    Its numbers and words, settings and parameters become attributes of kinds that a NetCDF file can
    hold; arrays are what is given as variables.
    """
    import xarray

    told: dict[str, Any] = {"filippov": _core.__version__}
    for field in dataclasses.fields(result):  # type: ignore[arg-type]
        if field.name not in (*variables, *coords) and not field.name.startswith("_"):
            told |= _attributes(field.name, getattr(result, field.name))
    return xarray.Dataset(variables, coords, told | dict(attrs or {}))


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
        return {name: list(value)}
    if isinstance(value, Settings):
        return {
            key: list(v) if isinstance(v, tuple) else v
            for key, v in dataclasses.asdict(value).items()
            if v is not None
        }
    return {}
