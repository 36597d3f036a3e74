# SPDX-License-Identifier: BSD-3-Clause
"""How a model of `filippov.models` becomes a system: of its formula, or out of the core."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from filippov import _core

from .define import Formula, Function, define
from .system import System, switches_of

__all__ = ["built_in", "compiled"]


def built_in(
    state: str,
    params: Mapping[str, float] | None = None,
    *,
    surfaces: Mapping[str, Formula] | None = None,
    period: Formula | None = None,
    jumps: Mapping[str, tuple[Formula, Function]] | None = None,
) -> Callable[[Function], System]:
    """Make a model of its formula, as `filippov.system` does; files and pickles hold its name.

    Its formula is not called again to be compared with what was recorded, which
    `test_models.py` does, and a parameter may be called `lambda`.
    """

    def decorate(function: Function) -> System:
        model, definition = define(
            function.__name__,
            state,
            params,
            function,
            surfaces=surfaces,
            period=period,
            jumps=jumps,
            typed=False,
        )
        return System._of(model, switches_of(definition), None, replace(definition, built_in=True))

    return decorate


def compiled(
    name: str,
    switches: Sequence[str],
    formula: Function | None = None,
    period: Formula | None = None,
) -> System:
    """Give a model that is compiled into the core, by its name there.

    Parameters
    ----------
    switches : sequence of str
        Its switching functions.
    formula, period : optional
        What it is in formulas: for smoothing, time stepping, LaTeX and C++, which want the true
        magnitude of what switches, and not the extension of each side beyond its surface.
    """
    model = _in_the_core()[name]
    definition = None
    if formula is not None:
        params = dict(zip(model.params, model.defaults, strict=True))
        surfaces = {f"h{j}": h for j, h in enumerate(switches)}
        written = define(
            name, model.state, params, formula, surfaces=surfaces, period=period, typed=False
        )[1]
        definition = replace(written, built_in=True)
    return System._of(model, switches, None, definition)


@functools.cache
def _in_the_core() -> dict[str, _core.Model]:
    return {model.name: model for model in _core.models()}
