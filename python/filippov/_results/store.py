# SPDX-License-Identifier: BSD-3-Clause
"""Results on disk, field by field: arrays in numpy's `.npz` or in zarr, everything else as JSON.

No pickle. Systems stand aside, each once: with their formulas if they have them, else by the name
of their model.
"""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import zlib
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from filippov import _core
from filippov._support.check import number, path_of, refuse
from filippov._support.sizes import MOST_BYTES, require_room
from filippov._support.sound import Unsound, complete, known, printable, require, typed
from filippov._support.status import Status
from filippov._support.whole import in_the_making, remove_abandoned
from filippov._system.system import Params, System, restore, restore_defined

from .solution import Solution

__all__ = ["Stored", "load"]

FORMAT = "filippov"
VERSION = 2
META = "__filippov__"

Arrays = dict[str, np.ndarray[Any, Any]]


class Stored:
    """A result that can be saved: a dataclass. `load` knows it by its class name.

    `_parts` are the dataclasses that its fields consist of, besides other results.
    """

    _parts: ClassVar[tuple[type, ...]] = ()
    _classes: ClassVar[dict[str, type]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for each in (cls, *cls._parts):
            Stored._classes[each.__name__] = each

    def save(self, path: str | os.PathLike[str]) -> None:
        """Save for `filippov.load`; what is there is replaced as a whole.

        A path that ends in `.zarr` becomes a zarr group, any other one numpy's `.npz`, without
        pickle: `zarr.open_group` and `numpy.load` read the arrays, too. Equations, parameters and
        settings are inside.

        Raises
        ------
        TypeError
            If the system has functions of which only values are known.
        ImportError
            For `.zarr` without zarr.
        FileExistsError
            For a directory that is no result of filippov.

        Notes
        -----
        Whoever loads meanwhile gets what was there before or what is there afterwards, whole,
        also if this process is killed; what that leaves behind, the next save there removes. A zarr
        group keeps its arrays in a folder whose name is its attribute `arrays`.
        """
        target = path_of("path", path)
        pack = _Pack()
        content = pack.packed(self, "")
        meta = {
            "format": FORMAT,
            "version": VERSION,
            "filippov": _core.__version__,
            "systems": pack.systems,
            "content": content,
        }
        _require_replaceable(target)
        remove_abandoned(target.parent)
        if target.suffix == ".zarr":
            _save_zarr(target, meta, pack.arrays)
            return
        with in_the_making(target.parent, folder=False) as part:
            with part.open("wb") as file:
                np.savez_compressed(file, **{META: np.array(json.dumps(meta))}, **pack.arrays)  # type: ignore[arg-type]
            part.replace(target)


class _Pack:
    """Takes a result apart."""

    def __init__(self) -> None:
        self.arrays: Arrays = {}
        self.systems: list[dict[str, Any]] = []
        self._known: dict[tuple[int, tuple[float, ...]], int] = {}

    def packed(self, value: Any, name: str) -> Any:  # noqa: ANN401 - any field
        """Give a value as JSON can hold it, beside `arrays` and `systems`."""
        if isinstance(value, np.ndarray):
            self.arrays[name] = value
            return {"array": name}
        if isinstance(value, np.generic):
            return {"number": value.item(), "dtype": value.dtype.str}
        if isinstance(value, Enum):
            return {"status": value.value}
        if isinstance(value, System):
            return {"system": self._place(value)}
        if isinstance(value, Solution):
            parts = {key: self.packed(v, f"{name}.{key}") for key, v in value._packed().items()}
            return {"solution": self._place(value._system), "parts": parts}
        if dataclasses.is_dataclass(value):
            inside = f"{name}." if name else ""
            fields = {
                field.name: self.packed(getattr(value, field.name), inside + field.name)
                for field in dataclasses.fields(value)
            }
            return {"class": type(value).__name__, "fields": fields}
        if isinstance(value, tuple | list):
            return {"tuple": [self.packed(v, f"{name}.{k}") for k, v in enumerate(value)]}
        if isinstance(value, Mapping):
            items = {key: self.packed(v, f"{name}.{key}") for key, v in value.items()}
            return {"params" if isinstance(value, Params) else "mapping": items}
        return value

    def _place(self, system: System) -> int:
        key = (id(system._model), tuple(system.params.values()))
        if key not in self._known:
            system.__reduce__()  # refuses what cannot be made again
            self._known[key] = len(self.systems)
            self.systems.append(system._identity() | {"params": dict(system.params)})
        return self._known[key]


class _Unpack:
    """Puts it together again."""

    def __init__(self, meta: Mapping[str, Any], arrays: Arrays) -> None:
        self._arrays = arrays
        self._systems = [_system(content) for content in meta["systems"]]

    def unpacked(self, value: Any) -> Any:  # noqa: ANN401 - any field
        """Give what was packed."""
        if isinstance(value, str):
            printable("a text", value)
        if not isinstance(value, dict):
            return value
        if "array" in value:
            array = self._arrays[value["array"]]
            printable("an array", array)
            return array
        if "number" in value:
            dtype = np.dtype(value["dtype"])
            if dtype.kind not in "biufU" or dtype.itemsize > _MOST_BYTES:
                raise TypeError(value["dtype"])
            number_or_word = dtype.type(value["number"])
            printable("a word", np.asarray(number_or_word))
            return number_or_word
        if "status" in value:
            return Status(value["status"])
        if "system" in value:
            return self._systems[value["system"]]
        if "solution" in value:
            parts = {key: self.unpacked(v) for key, v in value["parts"].items()}
            Solution._verify(self._systems[value["solution"]], parts)
            return Solution._of(self._systems[value["solution"]], parts)
        if "class" in value:
            fields = {key: self.unpacked(v) for key, v in value["fields"].items()}
            made = Stored._classes[value["class"]]
            names = {field.name for field in dataclasses.fields(made)}
            if set(fields) != names:
                raise KeyError(value["class"])
            return _sound(made(**fields))
        if "tuple" in value:
            return tuple(self.unpacked(v) for v in value["tuple"])
        if "params" in value:
            return Params({key: self.unpacked(v) for key, v in value["params"].items()})
        for key in value["mapping"]:
            printable("a key", key)
        return {key: self.unpacked(v) for key, v in value["mapping"].items()}


def _sound(made: Any) -> Any:  # noqa: ANN401 - any class that is stored
    """Give an object back whose fields make sense: what uses it looks at them no more."""
    try:
        typed(made)
        if isinstance(values := getattr(made, "params", None), Params):
            for name, value in values.items():
                number(f"params[{name!r}]", value)
        if hasattr(made, "_verify"):
            made._verify()
    except (TypeError, ValueError) as error:
        raise Unsound(f"{type(made).__name__}: {error}") from None
    return made


def load(path: str | os.PathLike[str], *, most_bytes: int = MOST_BYTES) -> Any:  # noqa: ANN401 - the class is known when the file is read
    """Load a result that was saved with its method `save`.

    Nothing in a file is run, whoever made it: see the page "Files of strangers".

    Parameters
    ----------
    path : str or path
        The file, or the zarr group.
    most_bytes : int
        What its arrays may take in memory. By default 4 GiB.

    Returns
    -------
    Trajectory, Branch, Basins, ...
        An object of the class that was saved, equal to it in every array.

    Raises
    ------
    ValueError
        For a file that is not one of filippov's results, or of another format, and for one whose
        content makes no sense: arrays that do not fit together, indices of nothing, times out of
        order. Values that could be are not questioned.
    OSError
        For a file that cannot be read.
    """
    foreign = "expected a file written by the method save of a result of filippov"
    file = path_of("path", path)
    most = number("most_bytes", most_bytes, "expected a number of bytes > 0", above=0.0)
    try:
        if file.is_dir():
            meta, arrays = _read_group(file, int(most))
        else:
            require_room(file, int(most), META)
            meta, arrays = _read_npz(file)
    except (OSError, ImportError, MemoryError):
        raise
    except Unsound as error:
        refuse("path", os.fspath(path), f"{error}; {foreign}")
    except Exception:  # a damaged file fails in as many ways as there are libraries
        refuse("path", os.fspath(path), foreign)
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        refuse("path", os.fspath(path), foreign)
    if meta.get("version") != VERSION:
        expected = f"its format has version {meta.get('version')}, expected version {VERSION}"
        refuse("path", os.fspath(path), expected)
    _import_all()
    content = meta.get("content")
    found = content.get("class") if isinstance(content, dict) else None
    known = sorted(n for n, c in Stored._classes.items() if issubclass(c, Stored))
    if found not in known:
        refuse("path", os.fspath(path), f"it holds a {found}, expected one of {', '.join(known)}")
    try:
        return _Unpack(meta, arrays).unpacked(content)
    except MemoryError:
        raise
    except Unsound as error:
        refuse("path", os.fspath(path), f"its {found} makes no sense, {error}; {foreign}")
    except Exception:
        refuse("path", os.fspath(path), f"its {found} is incomplete; {foreign}")


def _import_all() -> None:
    """Import every module with results: their classes are known then."""
    import importlib

    from filippov import _NAMES

    for module in _NAMES:
        importlib.import_module(f"filippov.{module}")


def _system(content: Mapping[str, Any]) -> System:
    from filippov import models

    if "formulas" in content:
        made = restore_defined(content["formulas"], content["params"])
    else:
        known(models.__all__, system=content["name"])
        made = restore(content["name"], content["params"])
    require(list(made.state) == content["state"], f"state is {content['state']}")
    complete(content["params"], made.params)
    return made


# --- files ----------------------------------------------------------------------------------------


_MOST_BYTES = 1024  #: of one number or word


def _require_replaceable(target: Path) -> None:
    """Refuse to replace a directory that holds something else."""
    expected = "expected a path where nothing is, or a result of filippov"
    if not target.is_dir():
        if target.suffix == ".zarr" and target.exists():
            refuse("path", os.fspath(target), expected, FileExistsError)
        return
    if target.is_symlink() or target.suffix != ".zarr":
        refuse("path", os.fspath(target), expected, FileExistsError)
    try:
        attributes = json.loads((target / "zarr.json").read_text())["attributes"]
    except (OSError, ValueError, KeyError, TypeError):
        attributes = {}
    if META not in attributes:
        refuse("path", os.fspath(target), expected, FileExistsError)


def _read_npz(path: Path) -> tuple[Any, Arrays]:
    with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    return json.loads(str(arrays.pop(META))), arrays


_DATA = "data-"  #: folders of arrays in a group begin so


def _save_zarr(target: Path, meta: dict[str, Any], arrays: Arrays) -> None:
    """Make a group, or put other arrays in the place of those of one that is there.

    A folder cannot be replaced by another in one step, but the file that names the arrays can.
    """
    if not target.is_dir():
        with in_the_making(target.parent) as part:
            with in_the_making(part, _DATA, keep=lambda _: True) as data:
                _point_to(part, data, meta, arrays)
            try:
                part.rename(target)
            except OSError:
                if not target.is_dir():
                    raise
            else:
                return
        # another process was first
    before = _arrays_of(target)

    def current(data: Path) -> bool:
        return data.name in ("zarr.json", _arrays_of(target))

    with in_the_making(target, _DATA, keep=current) as data:
        _point_to(target, data, meta, arrays)
    if before is not None and not current(target / before):
        shutil.rmtree(target / before, ignore_errors=True)
    remove_abandoned(target, "", keep=current)


def _point_to(group: Path, data: Path, meta: dict[str, Any], arrays: Arrays) -> None:
    """Write arrays into a folder of a group, and then that the group consists of them."""
    attributes = _write_zarr(data, meta, arrays) | {"arrays": data.name}
    root = {"zarr_format": 3, "node_type": "group", "attributes": attributes}
    made = data / "root.json"
    made.write_text(json.dumps(root))
    made.replace(group / "zarr.json")


def _arrays_of(group: Path) -> str | None:
    """Name of the folder with a group's arrays; None where they are in the group itself."""
    name = json.loads((group / "zarr.json").read_text())["attributes"].get("arrays")
    return name if isinstance(name, str) else None


def _read_group(path: Path, most: int) -> tuple[Any, Arrays]:
    """Read a group, again if it was replaced meanwhile."""
    for _ in range(100):
        before = _arrays_of(path)
        try:
            require_room(path, most, META)
            return _read_zarr(path)
        except Exception:
            if _arrays_of(path) == before:
                raise
    require_room(path, most, META)
    return _read_zarr(path)


def _write_zarr(path: Path, meta: dict[str, Any], arrays: Arrays) -> dict[str, Any]:
    """Write records as arrays of columns, and words as numbers of their list; tell the rest."""
    import zarr

    group = zarr.open_group(path, mode="a", zarr_format=3)
    records: dict[str, list[Any]] = {}
    sums: dict[str, int] = {}

    def put(name: str, array: np.ndarray[Any, Any]) -> None:
        if array.dtype.names is not None:
            records[name] = array.dtype.descr
            for column in array.dtype.names:
                put(f"{name}.{column}", array[column])
            return
        attributes = {}
        if array.dtype.kind == "U":
            words, numbers = np.unique(array, return_inverse=True)
            attributes = {"words": words.tolist(), "dtype": array.dtype.str}
            array = numbers.reshape(array.shape).astype(np.int32)
        chunks = tuple(max(n, 1) for n in array.shape)
        stored = group.create_array(
            name, shape=array.shape, dtype=array.dtype, chunks=chunks, attributes=attributes
        )
        if array.size:
            stored[...] = array
        sums[name] = _checksum(array)

    for name, array in arrays.items():
        put(name, array)
    return {META: meta, "records": records, "checksums": sums}


def _checksum(array: np.ndarray[Any, Any]) -> int:
    """CRC-32 of the bytes: a chunk that is missing would be read as zeros."""
    return zlib.crc32(np.ascontiguousarray(array).tobytes())


def _read_zarr(path: Path) -> tuple[Any, Arrays]:
    import zarr

    group = zarr.open_group(path, mode="r", zarr_format=3)
    folder = group.attrs.get("arrays")
    require(
        folder is None or re.fullmatch(r"[A-Za-z0-9_-]{1,80}", folder) is not None,
        "the folder of its arrays has no name",
    )
    inside = "" if folder is None else f"{folder}/"
    columns: Arrays = {}
    for name, checksum in group.attrs["checksums"].items():
        stored = group[f"{inside}{name}"]
        if stored.dtype.kind not in "biufc":
            raise TypeError(f"{name} is of another kind")
        values = np.asarray(stored[...])
        if _checksum(values) != checksum:
            raise ValueError(f"{name} is damaged")
        if "words" in stored.attrs:
            words = np.array(stored.attrs["words"], dtype=stored.attrs["dtype"])
            if words.size:
                values = np.asarray(words[values], dtype=words.dtype)
            else:
                values = np.empty(values.shape, words.dtype)
        columns[name] = values
    for name, description in group.attrs["records"].items():
        dtype = np.dtype([(d[0], d[1], *(tuple(n) for n in d[2:])) for d in description])
        names = dtype.names or ()
        record = np.empty(columns[f"{name}.{names[0]}"].shape[:1], dtype)
        for column in names:
            record[column] = columns.pop(f"{name}.{column}")
        columns[name] = record
    return group.attrs[META], columns
