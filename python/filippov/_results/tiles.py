# SPDX-License-Identifier: BSD-3-Clause
"""Long computations tile by tile: kept in a Zarr store, or distributed over a Dask cluster.

What is computed are entries of arrays along their first axis, each by itself: which are computed
together, where and when changes no bit.
"""

from __future__ import annotations

import json
import os
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from filippov import _core
from filippov._support.check import path_of, refuse
from filippov._support.whole import in_the_making, remove_abandoned

__all__ = ["Stage", "Store", "Tiling", "open_store", "run_stage"]

Show = Callable[[int, int], object] | None
Arrays = dict[str, NDArray[Any]]

#: Entries of a tile, about, if nothing else is asked for.
ENTRIES = 65_536
FORMAT, VERSION = "filippov.tiles", 3


@dataclass(frozen=True)
class Tiling:
    """The first axis cut in pieces of equal length but for the last."""

    length: int
    rows: int

    def __len__(self) -> int:
        return -(-self.length // self.rows)

    def slice(self, k: int) -> slice:
        """Rows of tile k."""
        return slice(k * self.rows, min((k + 1) * self.rows, self.length))

    def count(self, k: int) -> int:
        """How many."""
        rows = self.slice(k)
        return int(rows.stop - rows.start)


@dataclass(frozen=True)
class Stage:
    """Arrays of equal length that one function fills tile by tile.

    `work(first, count, inputs, show)` gives a mapping: the arrays' rows from `first` on, whole
    numbers by name (to be summed), and under "raised" what has ended it. To be sent to a cluster it
    must be picklable.
    """

    name: str
    work: Callable[[int, int, Arrays, Show], Mapping[str, Any]]
    outputs: Arrays  #: as they are before, and where nothing was computed
    numbers: tuple[str, ...] = ()
    inputs: Arrays = field(default_factory=dict)  #: of which a tile gets its own rows
    dims: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  #: names of the axes


class Store:
    """A directory in Zarr's format: arrays with one chunk a tile, and which tiles are complete."""

    def __init__(self, path: str, group: Any, tiling: Tiling) -> None:  # noqa: ANN401 - a zarr.Group
        self.path = path
        self.group = group
        self.tiling = tiling

    def begin(self, stage: Stage) -> None:
        """Make a stage's arrays, unless they are there."""
        for name, values in stage.outputs.items():
            self._make(
                name,
                shape=values.shape,
                chunks=(max(1, min(self.tiling.rows, len(values))), *values.shape[1:]),
                dtype=values.dtype,
                fill_value=values.flat[0] if values.size else 0,
                dimension_names=stage.dims.get(name),
            )
        self._make(
            self._done(stage),
            shape=(len(self.tiling), 2 + len(stage.numbers)),
            chunks=(1, 2 + len(stage.numbers)),
            dtype=np.int64,
            fill_value=0,
            compressors=None,
            dimension_names=("tile", f"{stage.name}_number"),
        )

    def _make(self, name: str, **how: Any) -> None:
        """Make an array; where two processes do, the first one's is taken by both."""
        if name in self.group:
            return
        import zarr

        folder = Path(self.path)
        with in_the_making(folder) as part:
            zarr.open_group(part, mode="a").create_array(name, **how)
            try:
                (part / name).rename(folder / name)
            except OSError:
                if name not in self.group:
                    raise

    def verify(self, stage: Stage) -> None:
        """Refuse arrays that are not those that `begin` makes: a file may declare any size."""
        width = 2 + len(stage.numbers)
        expected = {
            name: (values.shape, values.dtype, min(self.tiling.rows, len(values)))
            for name, values in stage.outputs.items()
        }
        expected[self._done(stage)] = ((len(self.tiling), width), np.dtype(np.int64), 1)
        for name, (shape, dtype, rows) in expected.items():
            try:
                found = self.group[name]
                made = (found.shape, found.dtype, found.chunks)
            except (OSError, MemoryError):
                raise
            except Exception as error:
                self._refuse(f"{name!r} cannot be read ({error})")
            wanted = (shape, dtype, (max(1, rows), *shape[1:]))
            if made != wanted:
                self._refuse(f"{name!r} is {made}, expected {wanted}")

    def complete(self, stage: Stage) -> NDArray[np.int64]:
        """Rows (1, checksum, numbers...) of the tiles that are complete, 0 for the others."""
        return self._read(self._done(stage), slice(None))

    def read(self, stage: Stage, k: int, row: NDArray[np.int64]) -> Arrays:
        """Give a complete tile's arrays; what is not as it was written is refused."""
        rows = self.tiling.slice(k)
        arrays = {name: self._read(name, rows) for name in stage.outputs}
        if _checksum(arrays, row[2:].tolist()) != row[1]:
            names = ", ".join(repr(name) for name in arrays)
            self._refuse(f"tile {k} of {names} is not as it was written")
        return arrays

    def write(self, stage: Stage, k: int, arrays: Arrays, numbers: list[int]) -> None:
        """Write a tile, and then that it is complete: each file is written as a whole."""
        import zarr

        # a chunk that is not written is read as the fill value, which may be another NaN
        with zarr.config.set({"array.write_empty_chunks": True}):
            for name in stage.outputs:
                self.group[name][self.tiling.slice(k)] = arrays[name]
        self.group[self._done(stage)][k] = [1, _checksum(arrays, numbers), *numbers]

    def _read(self, name: str, rows: slice) -> NDArray[Any]:
        try:
            return np.asarray(self.group[name][rows])
        except (OSError, MemoryError):
            raise
        except Exception as error:
            self._refuse(f"{name!r} cannot be read ({error})")

    def _refuse(self, reason: str) -> NoReturn:
        refuse("store", self.path, f"{reason}; expected files that nobody has changed")

    def note(self, **attributes: Any) -> None:
        """Keep what belongs to the whole."""
        self.group.attrs.update(attributes)

    @staticmethod
    def _done(stage: Stage) -> str:
        return f"{stage.name}_done"


def open_store(
    path: str | os.PathLike[str] | None,
    kind: str,
    identity: Callable[[], Mapping[str, Any]],
    length: int,
    entries_in_a_row: int,
    tile: int | None,
) -> tuple[Store | None, Tiling]:
    """Open a store, or make it.

    Parameters
    ----------
    path
        The directory; None: nothing is stored.
    identity
        Gives all that determines the result, as JSON can hold it; asked only where it is stored.
    length, entries_in_a_row
        Of the arrays' first axis, and of one entry of it.
    tile
        Entries of a tile, about.

    Raises
    ------
    ValueError
        If the store holds something else: the first difference is named.
    ImportError
        Without zarr.
    """
    client = _client() is not None
    whole = path is None and not client and tile is None
    rows = length if whole else max(1, (tile or ENTRIES) // max(entries_in_a_row, 1))
    tiling = Tiling(length, max(1, min(rows, length)))  # of nothing there are no tiles
    if path is None:
        return None, tiling
    target = path_of("store", path)
    import zarr

    manifest = json.loads(
        json.dumps(
            {"format": FORMAT, "version": VERSION, "kind": kind, "filippov": _core.__version__}
            | dict(identity())
            | {"rows_of_a_tile": tiling.rows}
        )
    )
    shown = os.fspath(path)
    if not target.exists() or (target.is_dir() and not any(target.iterdir())):
        _create(target, manifest)
    foreign = "expected a directory that does not exist yet, or a store of the same run"
    try:
        group = zarr.open_group(target, mode="r+")
        found = group.attrs["filippov_manifest"]
    except (OSError, KeyError, ValueError, TypeError):
        refuse("store", shown, foreign)
    if not isinstance(found, dict):
        refuse("store", shown, foreign)
    remove_abandoned(target)
    made, wanted = dict(_flat(found)), dict(_flat(manifest))
    for name, expected in wanted.items():
        if made.get(name) != expected:
            refuse(
                "store",
                shown,
                f"it was made with {name} = {made.get(name)!r}, expected {expected!r}",
            )
    for name, there in made.items():
        if name not in wanted:
            refuse("store", shown, f"it was made with {name} = {there!r}, which is not asked for")
    return Store(shown, group, tiling), tiling


def _create(target: Path, manifest: dict[str, Any]) -> None:
    """Make a store without arrays, unless another process does so first."""
    import zarr

    target.parent.mkdir(parents=True, exist_ok=True)
    remove_abandoned(target.parent)
    with in_the_making(target.parent) as part:
        zarr.open_group(part, mode="a", attributes={"filippov_manifest": manifest})
        try:
            part.rename(target)
        except OSError:
            if not target.is_dir():
                raise


def _checksum(arrays: Arrays, numbers: list[int]) -> int:
    """Of a tile; a chunk that is missing reads as one that was never written."""
    sum_ = zlib.crc32(np.array(numbers, dtype=np.int64).tobytes())
    for values in arrays.values():
        sum_ = zlib.crc32(np.ascontiguousarray(values).tobytes(), sum_)
    return sum_


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - JSON
    """Leaves of a nested mapping by dotted names."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}.{key}" if name else str(key))
    else:
        yield name, value


def run_stage(
    stage: Stage, tiling: Tiling, store: Store | None, show: Show, weight: int = 1
) -> tuple[Arrays, dict[str, int], BaseException | None]:
    """Fill a stage's arrays: those of complete tiles from the store, the others by its function.

    Parameters
    ----------
    show
        Called with the rows that are done and all rows, times `weight`.

    Returns
    -------
    arrays, sums, raised
        What was finished, the sums of the stage's numbers, and what ended it, if anything did.
    """
    todo = list(range(len(tiling)))
    sums = dict.fromkeys(stage.numbers, 0)
    if store is not None:
        store.begin(stage)
        store.verify(stage)
        complete = store.complete(stage)
        for k in [k for k in todo if complete[k, 0] == 1]:
            for name, values in store.read(stage, k, complete[k]).items():
                stage.outputs[name][tiling.slice(k)] = values
            for name, value in zip(stage.numbers, complete[k, 2:], strict=True):
                sums[name] += int(value)
        todo = [k for k in todo if complete[k, 0] != 1]
    done = tiling.length - sum(tiling.count(k) for k in todo)
    total = tiling.length * weight

    def told(more: int, _: int) -> None:
        if show is not None:
            show(done * weight + more, total)

    distributed = _client() is not None
    run = _run_there if distributed else _run_here
    raised: BaseException | None = None
    try:
        for k, result in run(stage, tiling, todo, None if show is None else told):
            raised = result.get("raised")
            rows = tiling.slice(k)
            for name, values in stage.outputs.items():
                values[rows] = result[name].reshape(values[rows].shape)
            numbers = [int(result[name]) for name in stage.numbers]
            sums = {name: sums[name] + n for name, n in zip(sums, numbers, strict=True)}
            if raised is not None:
                break
            if store is not None:
                store.write(stage, k, {n: v[rows] for n, v in stage.outputs.items()}, numbers)
            done += tiling.count(k)
            if distributed:
                told(0, total)
    except KeyboardInterrupt as signal:  # between tiles, or while waiting for a cluster
        raised = signal
    return stage.outputs, sums, raised


def _arguments(stage: Stage, tiling: Tiling, k: int) -> tuple[int, int, Arrays]:
    rows = tiling.slice(k)
    inputs = {name: values[rows] for name, values in stage.inputs.items()}
    return rows.start, tiling.count(k), inputs


def _run_here(
    stage: Stage, tiling: Tiling, todo: list[int], show: Show
) -> Iterator[tuple[int, Mapping[str, Any]]]:
    for k in todo:
        yield k, stage.work(*_arguments(stage, tiling, k), show)


def _client() -> Any:  # noqa: ANN401 - a distributed.Client
    """Give the Dask client in scope, None without one: nobody has one who did not import dask."""
    distributed = sys.modules.get("distributed")
    if distributed is None:
        return None
    try:
        return distributed.default_client()
    except ValueError:
        return None


def _run_there(
    stage: Stage, tiling: Tiling, todo: list[int], show: Show
) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Send tiles to a cluster, never many more than it has threads."""
    from distributed import as_completed

    del show
    client = _client()
    waiting = iter(todo)
    futures: dict[Any, int] = {}

    def submit() -> Any:  # noqa: ANN401 - a future, None if all are sent
        for k in waiting:
            future = client.submit(stage.work, *_arguments(stage, tiling, k), None, pure=False)
            futures[future] = k
            return future
        return None

    threads = sum(client.nthreads().values()) or 1
    first = [future for future in (submit() for _ in range(2 * threads)) if future is not None]
    running = as_completed(first)
    try:
        for future in running:
            k = futures.pop(future)
            result = future.result()
            if (following := submit()) is not None:
                running.add(following)
            yield k, result
    finally:
        client.cancel(list(futures))
