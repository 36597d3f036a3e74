# SPDX-License-Identifier: BSD-3-Clause
"""How much memory a file asks for, found before any is given.

A file may declare any shape in a few bytes. What it declares is believed as far as its own length
goes, times what the compression can do, and no further than a bound.
"""

from __future__ import annotations

import json
import math
import os
import re
import struct
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from .sound import Unsound, require

__all__ = ["MOST_BYTES", "require_room"]

#: Of all arrays of a file, unless `load` is told another number.
MOST_BYTES = 2**32
#: Of the words of a file: as text they take several times as much.
MOST_WORDS = 2**28
#: What a byte can unfold to, by deflate and by zstandard.
_DEFLATED, _ZSTANDARD = 1032, 2**15
#: Arrays of nothing but their fill value have no byte in a zarr group.
_FREE = 2**26

_NAME = re.compile(r"[A-Za-z0-9_-]{1,80}")
_KINDS = re.compile(r"bool|u?int(8|16|32|64)|float(16|32|64)|complex(64|128)")


def require_room(path: Path, most: int, words: str) -> None:
    """Refuse a result that declares more than its bytes can hold, or more than a bound.

    Parameters
    ----------
    most : int
        Bytes that its arrays may take.
    words : str
        Name of the array with the words of an archive.

    Raises
    ------
    Unsound
        With what is wrong. Files that are damaged in another way raise whatever they do.
    """
    if path.is_dir():
        _require_group(path, most)
    else:
        with path.open("rb") as file:
            _require_archive(file, most, words)


def _require_total(total: int, most: int) -> None:
    require(
        total <= most,
        f"its arrays take {total} bytes, more than most_bytes = {most}; where it comes from"
        " somebody you trust, give load a larger number",
    )


# --- archives of numpy ----------------------------------------------------------------------------


def _require_archive(file: BinaryIO, most: int, words: str) -> None:
    length = os.fstat(file.fileno()).st_size
    require(file.read(4) == b"PK\x03\x04", "it is no archive")
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        require(len({m.filename for m in members}) == len(members), "two arrays have one name")
        packed = sum(m.compress_size for m in members)
        require(packed <= length, "it declares more bytes than it has")
        _require_total(sum(m.file_size for m in members), most)
        for member in members:
            times = {zipfile.ZIP_STORED: 1, zipfile.ZIP_DEFLATED: _DEFLATED}.get(
                member.compress_type
            )
            require(times is not None, "it is compressed in another way than by deflate")
            require(
                member.file_size <= (times or 0) * member.compress_size,
                f"{member.filename[:80]!r} declares more than its bytes can hold",
            )
            if member.filename == f"{words}.npy":
                require(member.file_size <= MOST_WORDS, f"its words take {member.file_size} bytes")
            with archive.open(member) as stream:
                _require_header(stream, member)


def _require_header(stream: Any, member: zipfile.ZipInfo) -> None:  # noqa: ANN401 - a binary file
    """Refuse an array whose header declares another size than it has."""
    version = np.lib.format.read_magic(stream)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    require(version in readers, "an array has an unknown format")
    shape, _, dtype = readers[version](stream)
    require(not dtype.hasobject, "an array has objects in it")
    declared = math.prod(shape) * dtype.itemsize
    require(
        min(shape, default=0) >= 0 and declared == member.file_size - stream.tell(),
        f"{member.filename[:80]!r} declares {declared} bytes, and has others",
    )


# --- groups of zarr -------------------------------------------------------------------------------


def _require_group(path: Path, most: int) -> None:
    on_disk = 0
    arrays: dict[str, tuple[int, int]] = {}  # rows and bytes
    root = _told_by(path / "zarr.json")["attributes"]
    inside = root.get("arrays")
    # what another process is removing beside the arrays is no part of it
    held = path / inside if isinstance(inside, str) and _NAME.fullmatch(inside) else path
    for part in path.iterdir():
        require(not part.is_symlink(), "it has links to other places")
    for file in _files(held):
        on_disk += file.stat().st_size
        if file.name == "zarr.json":
            told = _told_by(file)
            if told["node_type"] == "array":
                arrays[file.parent.name] = _require_array(file.parent, told)
    total = sum(size for _, size in arrays.values())
    for name, columns in root.get("records", {}).items():
        total += _size_of_records(name, columns, arrays)
    require(
        total <= _FREE + _ZSTANDARD * on_disk, "it declares more than its bytes on disk can hold"
    )
    _require_total(total, most)


def _told_by(file: Path) -> Any:  # noqa: ANN401 - JSON
    """Give what a group or an array of it says of itself."""
    require(not file.is_symlink(), "it has links to other places")
    require(file.stat().st_size <= MOST_WORDS, "its words take too many bytes")
    told = json.loads(file.read_text())
    require(told.get("zarr_format") == 3, "a part of it is of another format")
    require(not told.get("consolidated_metadata"), "its parts are described twice")
    return told


def _files(path: Path) -> Iterator[Path]:
    for folder, folders, names in os.walk(path):
        for name in (*folders, *names):
            require(not (Path(folder) / name).is_symlink(), "it has links to other places")
        yield from (Path(folder) / name for name in names)


def _require_array(folder: Path, told: Mapping[str, Any]) -> tuple[int, int]:
    """Refuse an array that `save` does not write; its rows and bytes otherwise."""
    shape, chunks = told["shape"], told["chunk_grid"]["configuration"]["chunk_shape"]
    name = folder.name[:80]
    require(_are_sizes(shape) and _are_sizes(chunks), f"{name!r} has no shape")
    whole = [max(n, 1) for n in shape]
    require(told["chunk_grid"]["name"] == "regular" and chunks == whole, f"{name!r} is in parts")
    require(
        [codec["name"] for codec in told["codecs"]] in (["bytes"], ["bytes", "zstd"]),
        f"{name!r} is compressed in another way than by zstandard",
    )
    require(not told.get("storage_transformers"), f"{name!r} is stored in another way")
    kind = told["data_type"]
    require(
        isinstance(kind, str) and _KINDS.fullmatch(kind) is not None, f"{name!r} is of another kind"
    )
    size = math.prod(whole) * np.dtype(kind).itemsize
    for file in _files(folder):
        if file.name != "zarr.json" and len(told["codecs"]) == 2:
            with file.open("rb") as chunk:
                require(_unpacked(chunk.read(18)) == size, f"a part of {name!r} has another size")
    attributes = told.get("attributes", {})
    if "words" in attributes:
        dtype = np.dtype(attributes["dtype"])
        longest = max((len(word) for word in attributes["words"]), default=1)
        require(dtype.kind == "U", f"{name!r} has no words")
        require(dtype.itemsize <= 4 * max(longest, 64), f"{name!r} declares words that it has not")
        size += math.prod(shape) * dtype.itemsize
    return shape[0] if shape else 1, size


def _are_sizes(values: object) -> bool:
    return isinstance(values, list) and all(type(n) is int and 0 <= n < 2**48 for n in values)


def _size_of_records(name: str, columns: list[Any], arrays: Mapping[str, tuple[int, int]]) -> int:
    """Bytes of records that are put together of columns."""
    size = 0
    for column in columns:
        dtype = np.dtype(column[1])
        inner = column[2] if len(column) > 2 else []
        require(_are_sizes(list(inner)) and not dtype.hasobject, f"{name[:80]!r} has no columns")
        rows, there = arrays[f"{name}.{column[0]}"]
        own = rows * math.prod(inner) * dtype.itemsize
        require(own <= there, f"{name[:80]!r} declares columns that it has not")
        size += own
    return size


def _unpacked(start: bytes) -> int:
    """Length of what a frame of zstandard holds, by its first bytes (RFC 8878, 3.1.1.1)."""
    require(start[:4] == b"\x28\xb5\x2f\xfd" and len(start) > 5, "a part is not compressed")
    told = start[4]
    single = bool(told & 0x20)
    at = 5 + (0 if single else 1) + (0, 1, 2, 4)[told & 3]
    form = ("<B" if single else "", "<H", "<I", "<Q")[told >> 6]
    if not form or len(start) < at + struct.calcsize(form):
        raise Unsound("a part does not tell its size")
    (size,) = struct.unpack_from(form, start, at)
    return int(size) + (256 if form == "<H" else 0)
