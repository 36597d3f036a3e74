# SPDX-License-Identifier: BSD-3-Clause
"""Definitions as a file or a pickle holds them: checked as strictly as those that are typed.

A file is data of anybody's. Its names come into programs that `to_cpp` writes, into LaTeX, titles
and messages; its numbers are places in a graph.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

from filippov import _core
from filippov._support.check import LAWS, label_of, names_of
from filippov._support.sound import Unsound, require

__all__ = ["MOST_OPERATIONS", "check_plain"]

#: Of the formulas in a file.
MOST_OPERATIONS = 100_000

_LEAVES = {"constant", "time", "state", "param"}
_OPERANDS = dict.fromkeys(_LEAVES, 0)
_OPERANDS |= dict.fromkeys(("add", "sub", "mul", "div", "pow"), 2)
_OPERANDS |= dict.fromkeys(("neg", "powi", "sqrt", "exp", "log", "magnitude", "sign"), 1)
_OPERANDS |= dict.fromkeys(("sin", "cos", "tan", "asin", "atan", "sinh", "cosh", "tanh"), 1)
_OPERANDS |= {"where": 3, "unit2": 2, "unit3": 3}
_FIELDS = {"name", "state", "params", "nodes", "field", "surfaces", "jumps", "period", "smoothing"}


def check_plain(plain: Any) -> None:  # noqa: ANN401 - what a file holds
    """Refuse what `Definition.plain` cannot have written.

    Raises
    ------
    Unsound
        With what is wrong.
    """
    require(isinstance(plain, Mapping), "formulas are no mapping")
    unknown = set(plain) - _FIELDS
    missing = _FIELDS - {"smoothing"} - set(plain)
    require(not unknown, f"formulas have {len(unknown)} fields that are unknown")
    require(not missing, f"formulas have no {', '.join(sorted(missing))}")
    try:
        label_of("name", plain["name"])
        _check_names(plain)
    except (TypeError, ValueError) as error:
        raise Unsound(str(error)) from None
    dim, n_params = len(plain["state"]), len(plain["params"])
    nodes = plain["nodes"]
    require(_is_list(nodes), "nodes are no list")
    require(len(nodes) <= MOST_OPERATIONS, f"more than {MOST_OPERATIONS} operations")
    for place, node in enumerate(nodes):
        _check_node(place, node, dim, n_params)
    _check_roots(plain, dim, len(nodes))
    _check_smoothing(plain)


def _check_names(plain: Mapping[str, Any]) -> None:
    require(_is_list(plain["state"]), "state is no list of names")
    names_of("state", plain["state"], typed=False)
    require(
        1 <= len(plain["state"]) <= _core.most_tape_dims,
        f"{len(plain['state'])} components, expected 1 to {_core.most_tape_dims}",
    )
    params = plain["params"]
    require(isinstance(params, Mapping), "params are no mapping")
    names_of("params", tuple(params), typed=False)
    require(
        len(params) <= _core.most_tape_params,
        f"{len(params)} parameters, expected {_core.most_tape_params} at most",
    )
    both = set(params) & set(plain["state"])
    require(not both, f"names {sorted(both)} of the state and of a parameter")
    for name, value in params.items():
        require(_is_number(value), f"the parameter {name} is no finite number")
    for what in ("surfaces", "jumps"):
        require(isinstance(plain[what], Mapping), f"{what} are no mapping")
        for name in plain[what]:
            label_of(f"a name of {what}", name)


def _is_list(value: object) -> TypeGuard[Sequence[Any]]:
    return isinstance(value, (list, tuple))


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and _is_finite(value)


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond every float
        return False


def _is_index(value: object, low: int, end: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and low <= value < end


def _check_node(place: int, node: object, dim: int, n_params: int) -> None:
    """Refuse a node that is none, or that is not made of nodes before it."""
    where = f"operation {place}"
    if not _is_list(node) or len(node) != 6:
        raise Unsound(f"{where} has not six entries")
    op, *operands, index, value = node
    n = _OPERANDS.get(op) if isinstance(op, str) else None
    require(n is not None, f"{where} is unknown")
    for k, operand in enumerate(operands):
        low, end = (0, place) if k < (n or 0) else (-1, 0)
        require(_is_index(operand, low, end), f"{where} has an operand that is not before it")
    ranges = {"state": (0, dim), "param": (0, n_params), "powi": (-999, 1000)}
    ranges |= {"unit2": (0, 2), "unit3": (0, 3)}
    low, end = ranges.get(op, (0, 1))
    require(_is_index(index, low, end), f"{where} has an index beyond what there is")
    require(_is_number(value), f"{where} has a constant that is no finite number")


def _check_roots(plain: Mapping[str, Any], dim: int, n: int) -> None:
    """Refuse places of formulas at which there is none."""

    def places(what: str, values: object) -> None:
        if not _is_list(values) or len(values) != dim:
            raise Unsound(f"{what} has not {dim} entries")
        for value in values:
            place(what, value)

    def place(what: str, value: object) -> None:
        require(_is_index(value, 0, n), f"{what} is no place of a formula")

    places("the field", plain["field"])
    for name, h in plain["surfaces"].items():
        place(f"the surface {name}", h)
    for name, pair in plain["jumps"].items():
        require(_is_list(pair) and len(pair) == 2, f"the jump {name} is no pair")
        place(f"the jump {name}", pair[0])
        places(f"the state after {name}", pair[1])
    if plain["period"] is not None:
        place("the period", plain["period"])


def _check_smoothing(plain: Mapping[str, Any]) -> None:
    smoothing = plain.get("smoothing")
    if smoothing is None:
        return
    require(_is_list(smoothing) and len(smoothing) == 2, "smoothing is no pair")
    law, watched = smoothing
    require(
        isinstance(law, str) and law in LAWS and isinstance(watched, bool), "smoothing has no law"
    )
    wanted = {"c1", "band"} if watched else {"c1"}
    require(not plain["jumps"], "smoothing beside jumps")
    require(wanted <= set(plain["params"]), f"smoothing without {', '.join(sorted(wanted))}")
