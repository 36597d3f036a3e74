# SPDX-License-Identifier: BSD-3-Clause
"""Compiled modules beside `_core`: they are loaded if both agree on what goes between them."""

from __future__ import annotations

import importlib
from typing import Any

from filippov import _core

__all__ = ["load"]


def load(name: str) -> Any:  # noqa: ANN401 - compiled
    """Import a compiled module that takes objects of `_core`.

    Raises
    ------
    ImportError
        If it lays them out otherwise, or does not say how: it was compiled with other options, or
        is of another version.
    """
    module = importlib.import_module(name)
    apart = _differences(getattr(module, "seam", None))
    if apart:
        shown = "; ".join(apart[:4]) + (f"; and {len(apart) - 4} more" if len(apart) > 4 else "")
        raise ImportError(
            f"{name} does not fit filippov._core: {shown} (expected modules of one build: install "
            "filippov again)",
            name=name,
            path=module.__file__,
        )
    return module


def _differences(theirs: dict[str, str] | None) -> list[str]:
    """Say what is different, in the order of `_core`."""
    ours = _core.seam
    if theirs is None:
        return ["it does not say how it lays out what goes between them"]
    return [
        f"{what} is {theirs.get(what, 'not known')} there and {ours.get(what, 'not known')} here"
        for what in {**ours, **theirs}
        if theirs.get(what) != ours.get(what)
    ]
