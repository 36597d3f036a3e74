# SPDX-License-Identifier: BSD-3-Clause
"""Systems of a user's own: functions in, compiled model out."""

from __future__ import annotations

import inspect
import itertools
import math
import numbers
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from filippov import _core
from filippov._support.check import LAWS, label_of, mapping, names_of, number, refuse, two
from filippov._support.types import Floats

from .definition import Definition
from .period import check_period
from .text import formula_of
from .trace import DefinitionError, Expression, Names, Numbers, as_expressions

__all__ = ["LAWS", "Definition", "Formula", "Function", "check", "define", "names_of"]

#: `f(t, s, p)`: time, state and parameters by name; the derivatives, one a component.
Function = Callable[..., Any]
#: A formula as text, a number, or a function of `(t, s, p)`.
Formula = str | float | Function


class Recorder:
    """The arguments of a user's functions, and what becomes of them."""

    def __init__(self, state: tuple[str, ...], params: Mapping[str, float]) -> None:
        self.graph = _core.Graph()
        g = self.graph
        self.state_names = state
        self.param_names = tuple(params)
        self.t = Expression(g, g.time())
        self.s = Names(state, [Expression(g, g.state(i)) for i in range(len(state))], "state")
        self.p = Names(
            self.param_names,
            [Expression(g, g.param(i)) for i in range(len(params))],
            "parameter",
        )

    def record(
        self,
        function: Function,
        what: str,
        names: Sequence[str],
        meaning: str = "the derivatives of",
    ) -> list[int]:
        """Call a function of the state once; nodes of the numbers that it returns."""
        values = call(function, what, self.t, self.s, self.p)
        return as_expressions(self.graph, values, len(names), what, names, meaning)

    def formula(self, formula: object, what: str) -> int:
        """Node of one number, in text or as a function."""
        if isinstance(formula, str):
            value = self._read(formula, what)
        elif callable(formula):
            value = call(formula, what, self.t, self.s, self.p)
        else:
            value = formula
        try:
            e = self.t._lift(value)
        except DefinitionError as error:
            raise DefinitionError(f"{what}: {error}") from None
        if e is None:
            refuse(what, formula, "expected a formula in text, or a function f(t, s, p)", TypeError)
        return e

    def _read(self, text: str, what: str) -> Any:  # noqa: ANN401
        names = {"t": self.t}
        names |= dict(zip(self.param_names, self.p, strict=True))
        names |= dict(zip(self.state_names, self.s, strict=True))
        return formula_of(text, what, names)


def three_arguments(function: Function, what: str) -> Function:
    """Make `f(t, s, p)` of a function that may be `f(t, s)`."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # some compiled ones have none
        return function
    positional = [v for v in parameters if v.kind in (v.POSITIONAL_ONLY, v.POSITIONAL_OR_KEYWORD)]
    required = [v for v in positional if v.default is v.empty]
    many = any(v.kind is v.VAR_POSITIONAL for v in parameters)
    if len(required) > 3 or (len(positional) < 2 and not many):
        raise DefinitionError(
            f"{what} takes {len(required)} arguments; expected f(t, s, p): time, state, parameters"
        )
    # f(t, s, i=i) keeps its own i
    three = many or len(required) == 3 or (len(positional) > 2 and positional[2].name == "p")
    return function if three else lambda t, s, _: function(t, s)


def call(function: Function, what: str, t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    """Call `f(t, s, p)`, or `f(t, s)`."""
    three = three_arguments(function, what)
    try:
        return three(t, s, p)
    except (TypeError, AttributeError) as error:
        recorded = ("Expression", "Vector", "Names")
        if not isinstance(t, Expression) or not any(kind in str(error) for kind in recorded):
            raise
        raise DefinitionError(
            f"{what}: {error}. Time, the state and the parameters are recorded, and have no"
            " values yet: use arithmetic, comparisons and numpy's functions"
        ) from error


def defaults_of(params: object, *, typed: bool = True) -> dict[str, float]:
    """Check parameters and their default values."""
    if params is None:
        return {}
    if not isinstance(params, Mapping):
        refuse("params", params, "expected a mapping of names to default values", TypeError)
    names_of("params", tuple(params), typed=typed)
    for name, value in params.items():
        number(f"params[{name!r}]", value)
    if len(params) > _core.most_tape_params:
        refuse("params", params, f"expected {_core.most_tape_params} at most")
    return {name: float(value) for name, value in params.items()}


def define(
    name: str,
    state: str | Sequence[str],
    params: object,
    function: Function | None,
    *,
    fields: Mapping[str, Function] | None = None,
    switch: object = None,
    surfaces: Mapping[str, Formula] | None = None,
    period: object = None,
    jumps: Mapping[str, tuple[Formula, Function]] | None = None,
    typed: bool = True,
) -> tuple[_core.Model, Definition]:
    """Record functions and compile them; see `filippov.system` and `filippov.System`.

    Parameters
    ----------
    typed : bool
        Whether its names have to be such that Python can read them as words, unlike `lambda`.
    """
    label_of("name", name)
    components = names_of("state", state)
    if not 1 <= len(components) <= _core.most_tape_dims:
        refuse("state", state, f"expected 1 to {_core.most_tape_dims} names")
    defaults = defaults_of(params, typed=typed)
    for both in set(components) & set(defaults):
        refuse("params", params, f"{both!r} is a name of the state, too")
    for what, given in (("surfaces", surfaces), ("jumps", jumps)):
        for key in mapping(what, given, "expected a mapping of names"):
            label_of(f"a name of {what}", key)
    recorder = Recorder(components, defaults)
    named: dict[str, int] = {}
    for key, formula in mapping("surfaces", surfaces, "expected a mapping of names").items():
        named[key] = recorder.formula(formula, f"surfaces[{key!r}]")
    if function is not None:
        nodes = recorder.record(function, name, components)
    else:
        switches = {
            key: recorder.formula(formula, f"switch {key}")
            for key, formula in _switches(switch).items()
        }
        nodes = _joined_fields(recorder, fields, switches, components)
        named = switches
    for key, h in named.items():
        if not recorder.graph.varies(h):
            raise DefinitionError(f"surface {key}: its function does not depend on state or time")
    after = {}
    for key, (h, jump) in jumps_of(jumps).items():
        if not callable(jump):
            refuse(f"jumps[{key!r}][1]", jump, "expected a function f(t, s, p) behind h", TypeError)
        after[key] = (
            recorder.formula(h, f"jumps[{key!r}]"),
            recorder.record(jump, f"jumps[{key!r}]", components, "the state after the jump:"),
        )
    repeats = None
    if period is not None:
        if isinstance(period, (numbers.Real, np.bool_)):
            period = number("period", period, "expected a finite number > 0", above=0.0)
        of_p = _of_params(period) if callable(period) else period
        repeats = recorder.formula(of_p, "period")
        if recorder.graph.varies(repeats):
            raise DefinitionError("the period depends on time or state")
    definition = Definition(
        name, components, defaults, recorder.graph, nodes, named, after, repeats
    )
    return definition.made()


def jumps_of(jumps: object) -> dict[str, tuple[Any, Any]]:
    """Switching function and what is behind it, of each jump by its name."""
    expected = "expected (h, the function of the state after)"
    each = mapping("jumps", jumps, "expected a mapping of names").items()
    return {key: two(f"jumps[{key!r}]", pair, expected) for key, pair in each}


def _of_params(period: Callable[[Any], Any]) -> Function:
    """Give the function of the parameters alone as one of all arguments."""
    try:
        inspect.signature(period).bind(None)
    except TypeError:
        refuse("period", period, "expected a function of p, a number or a text", TypeError)
    except ValueError:  # a builtin does not tell
        pass
    return lambda t, s, p: period(p)


def _switches(switch: object) -> dict[str, Any]:
    """Switching functions by name: one formula, several, or a mapping."""
    if isinstance(switch, Mapping):
        return {label_of("a name of switch", key): h for key, h in switch.items()}
    if isinstance(switch, (list, tuple)):
        return {f"h{j}": h for j, h in enumerate(switch)}
    if switch is None:
        refuse("switch", switch, "expected the switching function", TypeError)
    return {"h": switch}


def _joined_fields(
    recorder: Recorder,
    fields: Mapping[str, Function] | None,
    switches: dict[str, int],
    components: tuple[str, ...],
) -> list[int]:
    """One right-hand side of the fields on all sides."""
    wanted = ["".join(sides) for sides in itertools.product("-+", repeat=len(switches))]
    if not isinstance(fields, Mapping) or set(fields) != set(wanted):
        each = ", ".join(wanted)
        refuse("fields", fields, f"expected a mapping with a function for each of {each}")
    g = recorder.graph
    recorded = {}
    for sides, function in fields.items():
        if not callable(function):
            refuse(f"fields[{sides!r}]", function, "expected a function f(t, s, p)", TypeError)
        recorded[sides] = recorder.record(function, f"fields[{sides!r}]", components)

    def chosen(sides: str, component: int) -> int:
        if len(sides) == len(switches):
            return recorded[sides][component]
        above = g.step(list(switches.values())[len(sides)])
        return g.where(above, chosen(sides + "+", component), chosen(sides + "-", component))

    return [chosen("", i) for i in range(len(components))]


# --- the check of what was recorded ---------------------------------------------------------------


def check(model: _core.Model, definition: Definition, functions: Mapping[str, Function]) -> None:
    """Compare the model with the functions that it was made from, at random points.

    Parameters
    ----------
    functions : mapping
        By the sides of the surfaces where each one counts; "" for everywhere.
    """
    check_period(model, definition)
    p = Numbers(tuple(definition.params), np.array(list(definition.params.values())))
    points = list(_points_to_compare(model, definition, functions, p))
    # of the values, so far; in the beginning of all, where those are small
    size = min(1.0, max((_largest(wanted) for *_, wanted, _ in points), default=0.0))
    for function, t, x, wanted, got in points:
        size = max(size, _largest(wanted))
        for i, name in enumerate(definition.state):
            if not math.isfinite(wanted[i]) or _close(got[i], wanted[i], size):
                continue
            by_rounding = _moved_by_rounding(function, definition, t, x, p)[i]
            if abs(got[i] - wanted[i]) <= 4 * by_rounding:
                continue
            at = ", ".join(
                f"{key} = {float(v):.6g}" for key, v in zip(definition.state, x, strict=True)
            )
            raise DefinitionError(
                f"{definition.name}: the derivative of {name} was recorded as"
                f" {float(got[i]):.9g}, and is {float(wanted[i]):.9g} at t = {t:.6g}, {at}. A"
                " function is called once, to be recorded: it cannot use random numbers, change"
                " what it uses, or write into arrays"
            )


def _points_to_compare(
    model: _core.Model, definition: Definition, functions: Mapping[str, Function], p: Numbers
) -> Iterator[tuple[Function, float, Floats, Floats, Floats]]:
    """Yield a function, time and state, and the derivatives there as typed and as recorded."""
    random = np.random.default_rng(20080131)
    values = np.array(list(definition.params.values()))
    n = len(definition.state)
    for k in range(24):
        t = 10.0 * random.random()
        x = random.standard_normal(n) * 10.0 ** (k % 3 - 1)
        with np.errstate(all="ignore"):
            h = model.h(np.array([t]), x[None, :], values)[0]
        if not np.all(np.abs(h) > 0):  # on a surface, or where one is not defined
            continue
        side = np.sign(h).astype(int)
        sides = "".join("+" if v > 0 else "-" for v in side)
        function = next(f for key, f in functions.items() if sides.startswith(key))
        wanted = _called(function, definition, t, x, p)
        got = model.field(np.array([t]), x[None, :], [int(v) for v in side], values)[0]
        yield function, t, x, wanted, got


def _moved_by_rounding(
    function: Function, definition: Definition, t: float, x: Floats, p: Numbers
) -> Floats:
    """How far rounding of each argument moves the values; NaN if two calls differ.

    ``cos(1e9 t)`` may differ by rounding of its argument, and ``(x - y)**5`` by that of x alone.
    """
    arguments = np.append(t, x)
    there = _called(function, definition, t, x, p)
    total = np.zeros(there.size)
    for j in range(arguments.size):
        moved = []
        for scale in (1 - 2.0**-51, 1 + 2.0**-51):
            a = arguments.copy()
            a[j] *= scale
            moved.append(np.abs(_called(function, definition, float(a[0]), a[1:], p) - there))
        total += np.fmax(*moved)
    return np.where(_called(function, definition, t, x, p) == there, total, math.nan)


def _called(function: Function, definition: Definition, t: float, x: Floats, p: Numbers) -> Floats:
    """Call what was typed, with numbers."""
    with np.errstate(all="ignore"):
        values = call(function, definition.name, t, Numbers(definition.state, x), p)
        return _numbers(values, definition)


def _numbers(values: Any, definition: Definition) -> Floats:  # noqa: ANN401
    try:
        found = np.array([float(v) for v in np.atleast_1d(np.asarray(tuple(values)))])
    except TypeError:
        found = np.array([float(values)])
    if found.size != len(definition.state):
        raise DefinitionError(f"{definition.name} returned {found.size} values for numbers")
    return found


def _largest(values: Floats) -> float:
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))


def _close(a: float, b: float, size: float) -> bool:
    return abs(a - b) <= 1e-8 * (abs(a) + abs(b)) + 1e-10 * size
