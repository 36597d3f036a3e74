# SPDX-License-Identifier: BSD-3-Clause
"""Files and folders that are there whole or not at all, whenever a process is killed.

They are made under another name, and one rename puts them in their place. While they are made they
are locked, and the system frees the lock of a process that has died: what carries a name of these
and is locked by nobody is what a killed process left.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

__all__ = ["PART", "in_the_making", "remove_abandoned"]

PART = ".filippov-part-"
#: Where there are no locks: so old, in seconds, is what nobody works on any more.
_ABANDONED = 86_400.0


@contextlib.contextmanager
def in_the_making(
    parent: Path,
    prefix: str = PART,
    *,
    folder: bool = True,
    keep: Callable[[Path], bool] = lambda _: False,
) -> Iterator[Path]:
    """Give a new empty folder or file, which nobody takes for abandoned until this ends.

    What is there under its name at the end is removed, unless it is to be kept.
    """
    while True:
        path = parent / f"{prefix}{uuid.uuid4().hex}"
        if folder:
            path.mkdir()
        else:
            path.open("xb").close()
        with contextlib.suppress(FileNotFoundError):
            lock = _lock(path, wait=True)
            if lock is None or path.exists():
                break
            os.close(lock)
        # somebody took it for abandoned before it was locked
    try:
        yield path
    finally:
        if not keep(path):
            _remove(path)
        if lock is not None:
            os.close(lock)


def remove_abandoned(
    parent: Path, prefix: str = PART, keep: Callable[[Path], bool] = lambda _: False
) -> None:
    """Remove what processes that were killed left behind; that of others who work on it stays."""
    for path in list(parent.iterdir()):
        if not path.name.startswith(prefix):
            continue
        try:
            lock = _lock(path, wait=False)
        except (BlockingIOError, FileNotFoundError):
            continue
        try:
            if (lock is not None or _old(path)) and not keep(path):
                _remove(path)
        finally:
            if lock is not None:
                os.close(lock)


def _lock(path: Path, *, wait: bool) -> int | None:
    """Lock it for this process; None where there are no locks.

    Raises
    ------
    BlockingIOError
        If another process has locked it, and this one is not to wait.
    """
    if fcntl is None:
        return None
    handle = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise
    except OSError:  # a file system without locks
        os.close(handle)
        return None
    return handle


def _old(path: Path) -> bool:
    try:
        return time.time() - path.stat().st_mtime > _ABANDONED
    except OSError:
        return False


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
