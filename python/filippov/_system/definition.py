# SPDX-License-Identifier: BSD-3-Clause
"""A system as formulas, from which its compiled model is made, and made again."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from dataclasses import field as default
from typing import Any

from filippov import _core
from filippov._support.check import LAWS
from filippov._support.sound import require

from .plain import check_plain
from .trace import DefinitionError

__all__ = ["Definition", "Repeats"]


@dataclass
class Repeats:
    """What is known of a system's period: which parameters count, and which values are good."""

    shape: tuple[tuple[int, ...], tuple[int, ...]] | None = None
    seen: set[tuple[tuple[int, float], ...]] = default(default_factory=set)


@dataclass(frozen=True)
class Definition:
    """A system as formulas: everything that is needed to make it again."""

    name: str
    state: tuple[str, ...]
    params: dict[str, float]
    graph: _core.Graph
    field: list[int]  #: right-hand side
    surfaces: dict[str, int] = default(default_factory=dict)  #: named ones
    jumps: dict[str, tuple[int, list[int]]] = default(default_factory=dict)
    period: int | None = None
    #: law in place of the switches, and whether bands are watched; parameters c1 and band
    smoothing: tuple[str, bool] | None = None
    # what is found
    h: list[int] = default(default_factory=list)
    region: list[list[int]] = default(default_factory=list)  #: bit j of its number: side of h_j
    #: what tells functions apart that are not recorded
    token: str = default(default_factory=lambda: os.urandom(16).hex())
    #: at which parameter values the period is known to be right
    repeats: Repeats = default(default_factory=Repeats, compare=False, repr=False)
    built_in: bool = False  #: one of `filippov.models`, which its name tells

    @property
    def entries(self) -> int:
        """Entries of all directions: in the formulas of regions they come behind the state."""
        splits = len(self.region).bit_length() - 1
        return len(self.h) - splits - len(self.jumps)

    def made(self) -> tuple[_core.Model, Definition]:
        """Compile it."""
        try:
            found = _core.define(
                self.graph,
                self.name,
                list(self.state),
                list(self.params),
                list(self.params.values()),
                self.field,
                list(self.surfaces.values()),
                list(self.jumps.values()),
                self.period,
                self._smoothing(),
            )
        except ValueError as error:
            raise DefinitionError(self._by_names(str(error))) from None
        full = replace(self, graph=found.graph, h=found.h, region=found.region)
        return found.model, full

    def _by_names(self, message: str) -> str:
        """Name the surface of which a message of the core speaks, and the remedy."""
        found = re.fullmatch(
            r"filippov: (?:nothing changes at )?surface (\d+)(?: is surface (\d+))?(.*)", message
        )
        names = list(self.surfaces)
        if found is None or self.smoothing is not None or int(found[1]) >= len(names):
            return message
        name = names[int(found[1])]
        if "nothing changes" in message:
            return f"surface {name}: nothing changes there, the field does not switch at it"
        if found[2] is not None:
            return f"surface {name} is the same as {names[int(found[2])]}, up to a factor"
        if "several" in message:
            return f"surface {name} {self._several(self.surfaces[name])}"
        return f"surface {name}{found[3]}"

    def _several(self, h: int) -> str:
        """Tell on which surfaces a switching function switches, and what to write instead."""
        from .formula import clipped, write

        none = [self.graph.constant(0.0)] * (len(self.state) - 1)
        field = [self.graph.unary("sign", h), *none]
        try:
            made = replace(self, field=field, surfaces={}, jumps={}, period=None).made()[1]
        except DefinitionError:  # there are too many
            made = self
        each = [clipped(write(made.graph, e, self.state, tuple(self.params))) for e in made.h]
        if len(each) == 1:
            return f"switches itself: write it without the switches in it, as {each[0]!r}"
        return (
            "is not one surface, it switches on several"
            + (f" ({', '.join(each)})" if each else "")
            + ": give each of them a name of its own, with fields for every combination of sides;"
            " or write one function with np.where or np.sign of it, in which filippov.system finds"
            " them"
        )

    def _smoothing(self) -> tuple[int, int, int] | None:
        """Law, and places of steepness and band among the parameters (-1: there is none)."""
        if self.smoothing is None:
            return None
        law, watched = self.smoothing
        places = list(self.params)
        return LAWS.index(law), places.index("c1"), places.index("band") if watched else -1

    def plain(self) -> dict[str, Any]:
        """Give it in numbers, text, lists and dictionaries.

        Raises
        ------
        TypeError
            If it has functions that are not recorded.
        """
        self.require_formulas("be pickled or saved")
        return {
            "name": self.name,
            "state": list(self.state),
            "params": dict(self.params),
            "nodes": self._nodes(),
            "field": self.field,
            "surfaces": dict(self.surfaces),
            "jumps": {name: [h, after] for name, (h, after) in self.jumps.items()},
            "period": self.period,
            "smoothing": self.smoothing and list(self.smoothing),
        }

    def _nodes(self) -> list[list[Any]]:
        """Give its operations; without those of directions, which are found again."""
        nodes = [list(node) for node in self.graph.nodes()]
        if self.region and self.entries > 0:
            after = [e for h, jump in self.jumps.values() for e in (h, *jump)]
            roots = [*self.field, *self.surfaces.values(), *after]
            nodes = nodes[: 1 + max([*roots, -1 if self.period is None else self.period])]
        return nodes

    def identity(self) -> dict[str, Any]:
        """Tell which equations these are, as JSON can hold it."""
        return {"functions": self.token} if self.graph.functions() else self.plain()

    def require_formulas(self, purpose: str) -> None:
        """Refuse what needs formulas of a system that has functions of machine code or Python."""
        if self.graph.functions():
            raise TypeError(
                f"{self.name} calls functions of which only values are known: it cannot {purpose}."
                " A system of recorded functions can (filippov.system)"
            )

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Definition:
        """Make it again from `plain`, which may come from anywhere.

        Raises
        ------
        Unsound
            If it is not what `plain` gives.
        """
        check_plain(plain)
        made = cls(
            plain["name"],
            tuple(plain["state"]),
            {name: float(value) for name, value in plain["params"].items()},
            _core.Graph.of([tuple(node) for node in plain["nodes"]]),
            list(plain["field"]),
            dict(plain["surfaces"]),
            {name: (h, list(after)) for name, (h, after) in plain["jumps"].items()},
            plain["period"],
            tuple(plain["smoothing"]) if plain.get("smoothing") else None,
        )
        varies = made.graph.varies
        require(made.period is None or not varies(made.period), "the period depends on the state")
        for name, h in made.surfaces.items():
            require(varies(h), f"the surface {name} does not depend on state or time")
        return made
