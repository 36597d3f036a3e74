# SPDX-License-Identifier: BSD-3-Clause
"""How far a long computation is, and what is left of one that was ended."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

from .check import refuse

__all__ = ["Progress", "ended", "shown"]

Progress = bool | Callable[[int, int], object]


@contextlib.contextmanager
def shown(progress: Progress, unit: str) -> Iterator[Callable[[int, int], object] | None]:
    """Give the function `(done, total)` to call, None if nobody wants to know.

    True shows a bar of tqdm, or a line on stderr where tqdm is not installed.
    """
    if progress is False:
        yield None
    elif progress is True:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            yield lambda done, total: sys.stderr.write(f"\r{done} of {total} {unit}s")
            sys.stderr.write("\n")
            return
        with tqdm(unit=unit) as bar:

            def update(done: int, total: int) -> None:
                bar.total = total
                bar.update(done - bar.n)

            yield update
    elif callable(progress):
        yield progress
    else:
        refuse("progress", progress, "expected a bool or a function (done, total)", TypeError)


def ended(raised: BaseException | None, **finished: object) -> None:
    """Raise what ended a computation, if anything did, with what was finished as its attribute."""
    if raised is None:
        return
    for name, value in finished.items():
        with contextlib.suppress(AttributeError):
            setattr(raised, name, value)
    raise raised
