# SPDX-License-Identifier: BSD-3-Clause
"""Results on disk: arrays as numpy's `.npz`, everything else as JSON inside it. No pickle."""

from __future__ import annotations

import dataclasses
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from . import _core
from ._check import refuse
from ._system import Params, System, restore, restore_defined

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Stored", "StoredFields", "load", "pack_system", "unpack_system"]

FORMAT = "filippov"
VERSION = 1
META = "__filippov__"


class Stored:
    """A result that can be saved. A subclass is known to `load` by its class name."""

    _classes: ClassVar[dict[str, type[Stored]]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        Stored._classes[cls.__name__] = cls

    def _pack(self) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]]:
        """Arrays by name, and what JSON can hold."""
        raise NotImplementedError

    @classmethod
    def _unpack(cls, arrays: dict[str, np.ndarray[Any, Any]], meta: dict[str, Any]) -> Self:
        """Build the result from what `_pack` gave."""
        raise NotImplementedError

    def save(self, path: str | os.PathLike[str]) -> None:
        """Save to a file, for `filippov.load`; a file that is there is replaced as a whole.

        The file is numpy's `.npz` without pickle: `numpy.load` reads its arrays too.
        """
        arrays, content = self._pack()
        meta = {
            "format": FORMAT,
            "version": VERSION,
            "class": type(self).__name__,
            "filippov": _core.__version__,
            "content": content,
        }
        target = Path(path)
        part = target.with_name(target.name + ".part")
        with part.open("wb") as file:
            np.savez_compressed(file, **{META: np.array(json.dumps(meta))}, **arrays)  # type: ignore[arg-type]
        part.replace(target)


class StoredFields(Stored):
    """A result that is saved field by field: arrays, and what JSON can hold.

    `_parts` are the dataclasses that its fields consist of.
    """

    _parts: ClassVar[tuple[type, ...]] = ()

    def _pack(self) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, Any]]:
        arrays: dict[str, np.ndarray[Any, Any]] = {}

        def packed(value: Any, name: str) -> Any:  # noqa: ANN401 - any field
            if isinstance(value, np.ndarray):
                arrays[name] = value
                return {"array": name}
            if isinstance(value, np.generic):
                return value.item()
            if isinstance(value, System):
                return {"system": pack_system(value)}
            if isinstance(value, tuple | list):
                return {"tuple": [packed(v, f"{name}.{k}") for k, v in enumerate(value)]}
            if isinstance(value, self._parts):
                fields = {
                    field.name: packed(getattr(value, field.name), f"{name}.{field.name}")
                    for field in dataclasses.fields(value)  # type: ignore[arg-type]
                }
                return {"class": type(value).__name__, "fields": fields}
            if isinstance(value, Mapping):
                items = {key: packed(v, f"{name}.{key}") for key, v in value.items()}
                return {"params" if isinstance(value, Params) else "mapping": items}
            return value

        fields = {
            field.name: packed(getattr(self, field.name), field.name)
            for field in dataclasses.fields(self)  # type: ignore[arg-type]
        }
        return arrays, fields

    @classmethod
    def _unpack(cls, arrays: dict[str, np.ndarray[Any, Any]], meta: dict[str, Any]) -> Self:
        parts = {part.__name__: part for part in cls._parts}

        def unpacked(value: Any) -> Any:  # noqa: ANN401 - any field
            if not isinstance(value, dict):
                return value
            if "array" in value:
                return arrays[value["array"]]
            if "system" in value:
                return unpack_system(value["system"])
            if "tuple" in value:
                return tuple(unpacked(v) for v in value["tuple"])
            if "class" in value:
                fields = {name: unpacked(v) for name, v in value["fields"].items()}
                return parts[value["class"]](**fields)
            if "params" in value:
                return Params({key: unpacked(v) for key, v in value["params"].items()})
            return {key: unpacked(v) for key, v in value["mapping"].items()}

        return cls(**{name: unpacked(value) for name, value in meta.items()})


def load(path: str | os.PathLike[str]) -> Any:  # noqa: ANN401 - the class is known when the file is read
    """Load a result that was saved with its method `save`.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Branch, Diagram, Orbit, ...
        An object of the class that was saved, equal to it in every array.

    Raises
    ------
    ValueError
        For a file that is not one of filippov's results, or of a newer format.
    OSError
        For a file that cannot be read.
    """
    foreign = "expected a file written by the method save of a result of filippov"
    try:
        with Path(path).open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (ValueError, EOFError, zipfile.BadZipFile, TypeError, AttributeError):
        refuse("path", os.fspath(path), foreign)
    try:
        meta = json.loads(str(arrays.pop(META)))
    except (KeyError, json.JSONDecodeError):
        refuse("path", os.fspath(path), foreign)
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        refuse("path", os.fspath(path), foreign)
    if meta.get("version") != VERSION:
        expected = f"its format has version {meta.get('version')}, expected version {VERSION}"
        refuse("path", os.fspath(path), expected)
    known = _known_classes()
    if meta.get("class") not in known:
        expected = f"it holds a {meta.get('class')}, expected one of {', '.join(sorted(known))}"
        refuse("path", os.fspath(path), expected)
    try:
        return known[meta["class"]]._unpack(arrays, meta["content"])
    except (KeyError, TypeError, IndexError):
        refuse("path", os.fspath(path), f"its {meta['class']} is incomplete; {foreign}")


def _known_classes() -> dict[str, type[Stored]]:
    """Give every class that can be saved: its module must have been imported."""
    import importlib

    from . import _NAMES

    for module in _NAMES:
        importlib.import_module(f".{module}", __package__)
    return Stored._classes


def pack_system(sys: System) -> dict[str, Any]:
    """Give a system as JSON can hold it, with its parameter values."""
    sys.__reduce__()  # refuses what cannot be made again
    return sys._identity() | {"params": dict(sys.params)}


def unpack_system(content: dict[str, Any]) -> System:
    """Give the system that was packed."""
    if "formulas" in content:
        return restore_defined(content["formulas"], content["params"])
    try:
        return restore(content["name"], content["params"])
    except AttributeError:
        return refuse("system", content["name"], "expected one of filippov.models")
