# SPDX-License-Identifier: BSD-3-Clause
"""A Filippov system as Python sees it."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from filippov import _core
from filippov._support.check import (
    among,
    floats,
    mapping,
    name_of,
    number,
    one_of,
    refuse,
    transposed,
)
from filippov._support.types import FloatOrArray, Floats

from .define import Formula, Function, check, define, jumps_of
from .definition import Definition
from .foreign import Surroundings, warn_slow
from .formula import clipped, cpp_struct, entry_names, latex, latex_name, write, write_all
from .period import check_period, period_of, require_period

__all__ = [
    "Params",
    "System",
    "require_no_directions",
    "restore",
    "restore_defined",
    "switches_of",
    "system",
]

Side = int | Sequence[int]
_WORDS = {"switching": "switch", "direction": "unit", "component": "and"}


class Params(Mapping[str, float]):
    """Parameter values by name: `p["A"]` or `p.A`."""

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, float]) -> None:
        self._values = dict(values)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __getattr__(self, name: str) -> float:
        if name.startswith("_") or name not in self._values:
            raise AttributeError(f"no parameter {name!r}")
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Params({', '.join(f'{name}={value:g}' for name, value in self.items())})"

    def __reduce__(self) -> tuple[type[Params], tuple[dict[str, float]]]:
        return Params, (self._values,)


class System:
    """A system whose right-hand side switches on surfaces `h_j(t, x) = 0`.

    Side -1 is where `h < 0`, side +1 where `h > 0`; 0 stands for sliding on the surface. Every
    method takes `params`, values by name that replace `System.params` for that call.

    Ready systems are in `filippov.models`; `filippov.system` makes one of a single function in
    which something switches. This makes one of fields that are given side by side: a side's
    function need not exist beyond its side.

    Parameters
    ----------
    state : str or sequence of str
        Names of the components: `"y v"`.
    params : mapping, optional
        Names and default values of the parameters.
    fields : mapping
        `{"-": f, "+": g}`: the right-hand sides where the switching function is negative and
        positive, each `f(t, s, p)` with the state and the parameters by name (`s.v`, `p.A`); for
        two switching functions `{"--": ..., "+-": ..., "-+": ..., "++": ...}`.
    switch : formula, or several
        Switching function: a text (`"v - V"`) or a function of `(t, s, p)`; a list or a mapping of
        names for several surfaces.
    period : formula, optional
        Period of the forcing: a number, a text, or a function of `p`.
    jumps : mapping, optional
        `{"wall": (h, after)}`: where `h` falls to zero the state becomes `after(t, s, p)`.
    name : str, optional
        What it is called.

    Raises
    ------
    DefinitionError
        If the functions cannot be made into a system.

    Examples
    --------
    >>> import filippov as fp
    >>> relay = fp.System(
    ...     "x",
    ...     {"b": 1.0, "c": 0.5},
    ...     fields={"-": lambda t, s, p: p.c + p.b, "+": lambda t, s, p: p.c - p.b},
    ...     switch="x",
    ... )
    >>> float(fp.simulate(relay, [1.0], (0, 5)).events["t"][1])
    2.0
    """

    __slots__ = ("_definition", "_model", "_params", "_switches")

    _model: _core.Model
    _params: Params
    _switches: tuple[str, ...]
    _definition: Definition | None

    def __init__(
        self,
        state: str | Sequence[str],
        params: Mapping[str, float] | None = None,
        *,
        fields: Mapping[str, Function],
        switch: Formula | Sequence[Formula] | Mapping[str, Formula],
        period: Formula | None = None,
        jumps: Mapping[str, tuple[Formula, Function]] | None = None,
        name: str = "system",
    ) -> None:
        model, definition = define(
            name, state, params, None, fields=fields, switch=switch, period=period, jumps=jumps
        )
        check(model, definition, fields)
        self._fill(model, switches_of(definition), None, definition)

    def _fill(
        self,
        model: _core.Model,
        switches: Sequence[str],
        params: Mapping[str, float] | None,
        definition: Definition | None,
    ) -> None:
        self._model = model
        self._switches = tuple(switches)
        self._definition = definition
        self._params = Params(dict(zip(model.params, model.defaults, strict=True)))
        self._params = self._merged(params)

    @classmethod
    def _of(
        cls,
        model: _core.Model,
        switches: Sequence[str] = (),
        params: Mapping[str, float] | None = None,
        definition: Definition | None = None,
    ) -> System:
        """Make one of what evaluates and runs it."""
        made = cls.__new__(cls)
        made._fill(model, switches, params, definition)
        return made

    @classmethod
    def from_sympy(
        cls,
        state: Sequence[Any],
        field: Sequence[Any],
        params: Mapping[Any, float] | None = None,
        *,
        time: Any | None = None,  # noqa: ANN401 - a symbol of sympy
        period: Any | None = None,  # noqa: ANN401 - an expression
        surfaces: Mapping[str, Any] | None = None,
        jumps: Mapping[str, tuple[Any, Sequence[Any]]] | None = None,
        name: str = "system",
    ) -> System:
        """Make a system of formulas of sympy.

        Parameters
        ----------
        state : sequence of sympy.Symbol
            The components, as symbols: x for x(t).
        field : sequence of sympy.Expr
            Their derivatives, with `sign`, `Abs`, `Heaviside`, `Piecewise`, `Max`, `Min` in them.
        params : mapping of sympy.Symbol to float, optional
            Parameters and their default values.
        time : sympy.Symbol, optional
            By default the symbol t.
        period, surfaces, jumps, name
            As in `filippov.system`, in expressions.

        Raises
        ------
        DefinitionError
            For symbols and functions that are not known.
        """
        from .sympy import Formulas

        formulas = Formulas(state, params, time)
        function = formulas.function
        f = function(name, list(field))
        model, definition = define(
            name,
            formulas.names(formulas.state),
            dict(zip(formulas.names(list(formulas.params)), formulas.params.values(), strict=True)),
            f,
            period=None if period is None else _of_params(function("period", period), state),
            surfaces={
                key: function(key, h)
                for key, h in mapping("surfaces", surfaces, "expected a mapping of names").items()
            },
            jumps={
                key: (function(key, h), function(key, list(after)))
                for key, (h, after) in jumps_of(jumps).items()
            },
        )
        check(model, definition, {"": f})
        return cls._of(model, switches_of(definition), None, definition)

    @classmethod
    def from_pointers(
        cls,
        state: str | Sequence[str],
        params: Mapping[str, float] | None = None,
        *,
        fields: Mapping[str, Any],
        switch: Any,  # noqa: ANN401 - a pointer or a formula, or several
        jacobians: Mapping[str, Any] | None = None,
        period: Formula | None = None,
        jumps: Mapping[str, tuple[Any, Any]] | None = None,
        scale: Mapping[str, float] | None = None,
        name: str = "system",
    ) -> System:
        """Make a system of functions in machine code: of numba, a C file, cffi, ctypes.

        All have one signature, `void f(double t, const double *x, const double *p, double *out)`:
        time, state and parameters in the order of their names. A field fills `out` with its `dim`
        derivatives, a switching function with one number. They are called from several threads.

        Parameters
        ----------
        state, params
            As in `System`.
        fields : mapping
            `{"-": f, "+": g}`: functions on the sides of the surfaces, as in `System`. Each is an
            address (int), a `numba.cfunc`, or a function of ctypes or cffi; it is kept alive with
            the system.
        switch : pointer or formula, or several
            Switching function. In text (`"v - V"`) its derivatives are exact.
        jacobians : mapping, optional
            `{"-": j, "+": k}`: functions that fill `out` with df_i/dx_j at `[i*dim + j]`. Without
            them, and by time and parameters, derivatives are differences over five points: first
            ones are good to about 1e-12.
        period : formula, optional
            As in `System`.
        jumps : mapping, optional
            `{"wall": (h, after)}`: a pointer or formula, and the pointer of the state after.
        scale : mapping, optional
            Typical sizes of components, parameters and of the time "t": differences take steps of
            a thousandth of them. By default 1, of parameters their values, and of the time
            period/(2 pi) where that is a number.
        name : str, optional
            What it is called.

        Raises
        ------
        TypeError
            For what has no address, or is declared with another signature. An address itself
            cannot be checked.
        """
        around = Surroundings(state, params, period, scale)
        slopes = mapping("jacobians", jacobians, "expected a mapping of sides to functions")
        if not isinstance(fields, Mapping):
            refuse("fields", fields, "expected a mapping of sides to functions", TypeError)
        if not set(slopes) <= set(fields):
            refuse("jacobians", jacobians, "expected some of the sides that fields has")
        made = {
            sides: around.pointer(f"f[{sides}]", f, jacobian=slopes.get(sides))
            for sides, f in fields.items()
        }
        return cls._of_foreign(
            around, around.pointer, made, switch, state, params, period, jumps, name
        )

    @classmethod
    def from_callables(
        cls,
        state: str | Sequence[str],
        params: Mapping[str, float] | None = None,
        *,
        fields: Mapping[str, Function],
        switch: Formula | Sequence[Formula] | Mapping[str, Formula],
        period: Formula | None = None,
        jumps: Mapping[str, tuple[Formula, Function]] | None = None,
        scale: Mapping[str, float] | None = None,
        name: str = "system",
    ) -> System:
        """Make a system of Python functions that cannot be recorded, and are called.

        The slow way, for tables, loops that depend on the state, or another library's code: every
        step calls Python, which takes a hundred times longer than a recorded function, and says so
        by a `SlowSystemWarning`. Each function has the smooth field of one side; an
        ArithmeticError, a LookupError or a ValueError in one means that it does not exist there.
        Functions are called at some random times and states when the system is made.

        Parameters
        ----------
        state, params, fields, period, jumps, name
            As in `System`; functions get numpy arrays with names.
        switch : formula, or several
            As in `System`. In text (`"v - V"`) its derivatives are exact; a function is called.
        scale : mapping, optional
            As in `from_pointers`.
        """
        around = Surroundings(state, params, period, scale)
        if not isinstance(fields, Mapping):
            refuse("fields", fields, "expected a mapping of sides to functions", TypeError)
        made = {sides: around.callable(f"f[{sides}]", f) for sides, f in fields.items()}
        warn_slow(name)
        return cls._of_foreign(
            around, around.callable, made, switch, state, params, period, jumps, name
        )

    @classmethod
    def _of_foreign(
        cls,
        around: Surroundings,
        foreign: Callable[..., Function],
        fields: Mapping[str, Function],
        switch: Any,  # noqa: ANN401
        state: str | Sequence[str],
        params: Mapping[str, float] | None,
        period: Formula | None,
        jumps: Mapping[str, tuple[Any, Any]] | None,
        name: str,
    ) -> System:
        def number(what: str, function: object) -> Formula:
            if isinstance(function, str):
                return function
            return foreign(what, function, number=True)

        if isinstance(switch, Mapping):
            switch = {key: number(key, h) for key, h in switch.items()}
        elif isinstance(switch, (list, tuple)):
            switch = [number(f"h{j}", h) for j, h in enumerate(switch)]
        else:
            switch = number("h", switch)
        after = {
            key: (number(f"h of {key}", h), foreign(f"the state after {key}", jump))
            for key, (h, jump) in jumps_of(jumps).items()
        }
        model, definition = define(
            name, state, params, None, fields=fields, switch=switch, period=period, jumps=after
        )
        for trial in around.trials:
            trial.judge()
        check_period(model, definition)
        return cls._of(model, switches_of(definition), None, definition)

    # --- what it is ---------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """Name of the model."""
        return self._model.name

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the state components, in order."""
        return tuple(self._model.state)

    @property
    def params(self) -> Params:
        """Parameter values by name, used where a call does not give others."""
        return self._params

    @property
    def dim(self) -> int:
        """Number of state components."""
        return self._model.dim

    @property
    def surfaces(self) -> int:
        """Number of switching surfaces."""
        return self._model.surfaces

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each surface is.

        `"switching"`: the field jumps there, and it is crossed or slid on. `"kink"`: the field is
        continuous there, and it is always crossed. `"jump"`: the solution stays where h >= 0, and
        where h falls to zero the state jumps; 0 (sliding) is contact at rest there.
        `"direction"` and `"component"`: the first and the other entries of the vector of a `unit`;
        in a mode all of them are +1, it moves, or all are 0, it sticks.
        """
        return tuple(self._model.kinds)

    @property
    def switches(self) -> tuple[str, ...]:
        """The switching functions in words, one a surface."""
        return self._switches

    def _surface_label(self, j: int) -> str:
        """Call a surface by its name, or by what it is if it has none."""
        d = self._definition
        if d is not None and d.smoothing is None:
            jumps = list(d.jumps)
            if j < len(d.surfaces):
                return list(d.surfaces)[j]
            if j >= self.surfaces - len(jumps):
                return jumps[j - self.surfaces + len(jumps)]
        return clipped(self._switches[j])

    @property
    def capabilities(self) -> frozenset[str]:
        """What the model gives itself: `grad_h`, `h_t`, `sliding_flow`, `period`, ...

        Whatever is not among them is derived by automatic differentiation or integrated.
        """
        return frozenset(self._model.capabilities)

    @property
    def sliding(self) -> str:
        """How a slide is followed: `"closed form"` or `"equivalent control"`."""
        return "closed form" if "sliding_flow" in self.capabilities else "equivalent control"

    def period(self, params: Mapping[str, float] | None = None) -> float | None:
        """Period of the forcing, None for a system that has none."""
        value = self._model.period(self._values(params))
        return value if value > 0 else None

    def with_params(self, **params: float) -> System:
        """Replace parameter values: `sys.with_params(A=5)` is another system."""
        return System._of(self._model, self._switches, self._merged(params), self._definition)

    # --- evaluation ---------------------------------------------------------------------------

    def h(
        self, t: ArrayLike, x: ArrayLike, params: Mapping[str, float] | None = None
    ) -> FloatOrArray:
        """Switching function.

        Parameters
        ----------
        t : float or array, shape (k,)
        x : array, shape (dim,) or (dim, k)
        params : mapping, optional

        Returns
        -------
        float or array, shape (k,)
            For several surfaces one row each: shape (surfaces,) or (surfaces, k).
        """
        times, points, single = self._points(t, x)
        out = self._model.h(times, points, self._values(params))
        if self.surfaces == 1:
            out = out[:, 0]
        return out[0] if single else out.T

    def field(
        self,
        t: ArrayLike,
        x: ArrayLike,
        side: Side,
        params: Mapping[str, float] | None = None,
    ) -> Floats:
        """Right-hand side in a mode.

        Parameters
        ----------
        t : float or array, shape (k,)
        x : array, shape (dim,) or (dim, k)
        side : int, or one int a surface
            -1 is F1 of (4.8), +1 is F2, 0 the sliding field of (4.11) and (4.12); on
            several surfaces at once it is the blend that keeps all their h at zero. A side's field
            goes smoothly across the surface: it is not asked whether x lies on that side.
        params : mapping, optional

        Returns
        -------
        array, shape (dim,) or (dim, k)
        """
        times, points, single = self._points(t, x)
        out = self._model.field(times, points, self._side(side), self._values(params))
        return out[0] if single else out.T

    def jacobian(
        self,
        t: ArrayLike,
        x: ArrayLike,
        side: Side,
        params: Mapping[str, float] | None = None,
    ) -> Floats:
        """Jacobian of `field` with respect to x; shape (dim, dim) or (dim, dim, k).

        By automatic differentiation, to rounding; of functions that are known by their values
        alone (numba, C, Python) by differences.
        """
        times, points, single = self._points(t, x)
        out = self._model.jacobian(times, points, self._side(side), self._values(params))
        return out[0] if single else np.moveaxis(out, 0, -1)

    def normal_components(
        self,
        t: ArrayLike,
        x: ArrayLike,
        params: Mapping[str, float] | None = None,
        *,
        surface: int = 0,
        side: Side | None = None,
    ) -> Floats:
        """Compute the normal components `L_i = h_t + <grad h, F_i>` of the two fields at a surface.

        Parameters
        ----------
        t, x, params
            As in `field`.
        surface : int
            Which surface.
        side : sequence of int, optional
            Sides of the other surfaces; needed if there are others.

        Returns
        -------
        array, shape (2,) or (2, k)
            L1 and L2; sliding is attracting where `L1 > 0 > L2`.
        """
        times, points, single = self._points(t, x)
        index = self._surface(surface)
        if self.kinds[index] in ("direction", "component"):
            refuse("surface", surface, "expected a surface that has two sides, not one of a unit")
        sides = self._others(index, side)
        out = self._model.normal_components(times, points, index, sides, self._values(params))
        return out[0] if single else out.T

    def equivalent_control(
        self,
        t: ArrayLike,
        x: ArrayLike,
        params: Mapping[str, float] | None = None,
        *,
        surface: int = 0,
        side: Side | None = None,
    ) -> FloatOrArray:
        """Blend variable that keeps x on the surface, `s = -(L1 + L2)/(L2 - L1)` (4.12).

        Arguments as in `normal_components`; a float, or an array of shape (k,). The point slides
        where |s| < 1 and sliding attracts. NaN where `L1 = L2`.
        """
        l1, l2 = self.normal_components(t, x, params, surface=surface, side=side)
        with np.errstate(invalid="ignore", divide="ignore"):
            s: FloatOrArray = np.where(l1 == l2, np.nan, (l1 + l2) / (l1 - l2))[()]
        return s

    # --- words --------------------------------------------------------------------------------

    def latex(self) -> str:
        r"""Write the system in LaTeX: an `aligned` block of its fields, one for each region.

        Raises
        ------
        TypeError
            For a compiled system, whose formulas are not known.
        """
        definition = self._formulas()
        dim, splits = len(self.state), definition.h[: self._splits()]
        entries = definition.h[len(splits) : len(splits) + definition.entries]
        fields = [e for region in definition.region for e in region]
        names = entry_names((*self.state, *self._params), len(entries))
        named, words = write_all(
            definition.graph,
            [*splits, *entries, *fields],
            (*self.state, *names),
            tuple(self._params),
            latex,
        )
        rows = [f"{name} &= {formula}" for name, formula in named]
        rows += self._directions_in_latex(names, words[len(splits) :])
        for k, derivative in enumerate(words[len(splits) + len(entries) :]):
            code, i = divmod(k, dim)
            where = r",\ ".join(
                f"{h} {'>' if code >> j & 1 else '<'} 0" for j, h in enumerate(words[: len(splits)])
            )
            rows.append(rf"\dot{{{latex_name(self.state[i])}}} &= {derivative} && {where}")
        return "\\begin{aligned}\n" + " \\\\\n".join(rows) + "\n\\end{aligned}"

    def _directions_in_latex(self, names: Sequence[str], vectors: Sequence[str]) -> list[str]:
        """Write what the entries of directions are: one row a direction."""
        directed = [kind for kind in self.kinds if kind in ("direction", "component")]
        begins = [k for k, kind in enumerate(directed) if kind == "direction"]
        return [
            rf"\left({', '.join(map(latex_name, names[a:b]))}\right)"
            rf" &= \operatorname{{unit}}\left({', '.join(vectors[a:b])}\right)"
            for a, b in itertools.pairwise([*begins, len(directed)])
        ]

    def to_cpp(self, name: str | None = None) -> str:
        """Write a C++ header with a struct that is this system, for `#include <filippov/...>`.

        Parameters
        ----------
        name : str, optional
            Of the struct; by default the system's.

        Raises
        ------
        TypeError
            For a compiled system, which is C++ already.
        ValueError
            For a system without surfaces, of which the headers know none.
        """
        definition = self._formulas()
        definition.require_formulas("be written in C++")
        called = self.name if name is None else name_of("name", name)
        if self.surfaces == 0:
            refuse("sys", self.name, "expected a system with a surface, as all in the headers have")
        return cpp_struct(definition, called, dict(self._params), self.kinds)

    def _identity(self) -> dict[str, Any]:
        """Tell which equations it has, as JSON can hold it; parameter values are apart."""
        told: dict[str, Any] = {"name": self.name, "state": list(self.state)}
        if (own := self._own_definition()) is not None:
            told["formulas"] = own.identity()
        return told

    def _own_definition(self) -> Definition | None:
        """Give its formulas, None for a model in `filippov.models`, which its name tells."""
        definition = self._definition
        return None if definition is None or definition.built_in else definition

    def _formulas(self) -> Definition:
        if self._definition is None:
            raise TypeError(f"{self.name} is a compiled model: its formulas are not known here")
        return self._definition

    def _splits(self) -> int:
        return sum(kind in ("switching", "kink") for kind in self.kinds)

    def __eq__(self, other: object) -> bool:
        """Tell whether both have the same equations and parameter values."""
        if not isinstance(other, System):
            return NotImplemented
        return dict(self._params) == dict(other._params) and (
            self._model is other._model or self._identity() == other._identity()
        )

    def __hash__(self) -> int:
        return hash((self.name, self.state, tuple(self._params.items())))

    def __repr__(self) -> str:
        model = self._model
        lines = [f"System {self.name!r}", f"  state    {', '.join(self.state)}"]
        if self._params:
            shown = ", ".join(f"{name}={value:g}" for name, value in self._params.items())
            lines.append(f"  params   {shown}")
        lines += [
            f"  {_WORDS.get(kind, kind):8} h{j if self.surfaces > 1 else ''} = {clipped(text)}"
            for j, (text, kind) in enumerate(zip(self._switches, self.kinds, strict=False))
        ]
        period = self.period()
        if period is not None:
            lines.append(f"  period   {period:.9g}")
        if {"switching", "direction"} & set(self.kinds):
            lines.append(f"  slides   by {self.sliding}")
        lines.append(f"  found    {', '.join(model.capabilities) or 'the required members only'}")
        derived = [what for what in ("grad_h", "h_t") if what not in model.capabilities]
        lines.append(f"  derived  {', '.join([*derived, 'jacobian'])} ({self._derivatives()})")
        return "\n".join(lines)

    def _derivatives(self) -> str:
        """How derivatives are found."""
        functions = self._definition.graph.functions() if self._definition is not None else []
        if not functions:
            return "automatic differentiation"
        if any(has_jacobian for _, has_jacobian in functions):
            return "Jacobians as given, else differences over five points"
        return "differences over five points"

    def __copy__(self) -> System:
        return self  # nothing in it changes

    def __deepcopy__(self, memo: object) -> System:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        if (own := self._own_definition()) is not None:
            return restore_defined, (own.plain(), dict(self._params))
        return restore, (self.name, dict(self._params))

    # --- arguments ----------------------------------------------------------------------------

    def _merged(self, params: Mapping[str, float] | None) -> Params:
        """Own parameter values with some of them replaced."""
        if params is None:
            return self._params
        mapping("params", params, "expected a mapping of names to values")
        merged = dict(self._params)
        for name, value in params.items():
            if name not in merged:
                refuse("params", params, self._unknown(name))
            what = f"params[{name!r}]"
            if name in self._positive():
                merged[name] = number(what, value, "expected a finite number > 0", above=0.0)
            else:
                merged[name] = number(what, value)
        self._require_period(merged)
        return Params(merged)

    def _require_period(
        self, params: Mapping[str, float], ends: Mapping[str, Sequence[float]] | None = None
    ) -> None:
        """Refuse parameter values at which the period is another one.

        Parameters
        ----------
        ends : mapping, optional
            Ends of the ranges of some of them: every combination is looked at.
        """
        definition = self._own_definition()
        if definition is None or definition.period is None:
            return
        for values in itertools.product(*(ends or {}).values()):
            here = dict(params) | dict(zip(ends or {}, map(float, values), strict=True))
            require_period(self._model, definition, here)

    def _positive(self) -> tuple[str, ...]:
        """Parameters that have to be > 0."""
        smooth = self._definition is not None and self._definition.smoothing is not None
        return ("c1", "band") if smooth else ()

    def _unknown(self, name: str) -> str:
        known = ", ".join(self._params) or "none"
        text = f"{self.name} has no parameter {name!r}; expected names among {known}"
        if name in ("mu_0", "mu_s"):
            text += (
                ". A static friction above the kinetic one (4.4) is not a Filippov system; the"
                " stiction model that has it is filippov.models.stiction"
            )
        return text

    def _forced(self, params: Params) -> bool:
        """Whether there is a forcing; one that does not come back is refused."""
        forced = "period" in self.capabilities
        period = self._model.period(self._values(params))
        if forced and not 0 < period < np.inf:
            got = period if self._definition is None else period_of(self._definition, params)
            refuse("params", params, f"expected a period > 0 of {self.name}, got {got:.9g}")
        return forced

    def _values(self, params: Mapping[str, float] | None) -> Floats:
        return np.array(list(self._merged(params).values()), dtype=np.float64)

    def _points(self, t: ArrayLike, x: ArrayLike) -> tuple[Floats, Floats, bool]:
        """Shape times and states as the core takes them, and whether it is one point."""
        shape = f"expected shape ({self.dim},) or ({self.dim}, k)"
        times = floats("t", t, "expected numbers, one or shape (k,)")
        points = floats("x", x, "expected numbers")
        if points.ndim not in (1, 2) or points.shape[0] != self.dim:
            turned = transposed(points.shape, self.dim)
            got = f"got {points.shape}{turned}"
            refuse("x", points, f"{shape} for ({', '.join(self.state)}), {got}")
        if times.ndim > 1:
            refuse("t", times, f"expected a number or shape (k,), got shape {times.shape}")
        single = points.ndim == 1 and times.ndim == 0
        if points.ndim == 1:
            points = np.broadcast_to(points[:, None], (self.dim, times.size))
        times = times.reshape(-1)
        if times.size not in (1, points.shape[1]):
            refuse("t", times, f"expected one time or one for each of {points.shape[1]} states")
        return times, np.ascontiguousarray(points.T), single

    def _side(self, side: Side) -> list[int]:
        one = self.surfaces == 1
        what = "-1, 0 or +1" if one else f"{self.surfaces} of -1, 0 or +1, one a surface"
        try:
            each = [side] if isinstance(side, (int, np.integer)) else list(side)
        except TypeError:
            refuse("side", side, f"expected {what}", TypeError)
        if len(each) != self.surfaces or not all(among(v, (-1, 0, 1)) for v in each):
            refuse("side", side, f"expected {what}")
        for j, kind in enumerate(self.kinds):
            if kind == "component" and (each[j] == 0) != (each[j - 1] == 0):
                refuse("side", side, f"expected 0 for all entries of a unit, or for none: h{j}")
        return [int(v) for v in each]

    def _surface(self, surface: int) -> int:
        return one_of(
            "surface", surface, range(self.surfaces), f"expected an index below {self.surfaces}"
        )

    def _others(self, surface: int, side: Side | None) -> list[int]:
        if side is None:
            if self.surfaces > 1:
                refuse("side", side, f"expected {self.surfaces} of -1 or +1, one a surface")
            return [0]
        sides = self._side(side)
        sides[surface] = 0
        if sides.count(0) > 1:
            refuse("side", side, "expected -1 or +1 for the other surfaces")
        return sides


def require_no_directions(sys: System, what: str) -> None:
    """Refuse a system with a `unit`, at rest of which something has no meaning."""
    if "direction" in sys.kinds:
        refuse(
            "sys",
            sys.name,
            f"expected a System without a direction (unit), at rest of which {what}; a regularised"
            " one has none: v/np.sqrt(v @ v + eps**2)",
        )


def restore(name: str, params: dict[str, float]) -> System:
    """Give a system of `filippov.models` with other parameter values."""
    from filippov import models

    system: System = getattr(models, name)
    return system.with_params(**params)


def restore_defined(plain: dict[str, Any], params: dict[str, float]) -> System:
    """Make a defined system again."""
    model, definition = Definition.of(plain).made()
    return System._of(model, switches_of(definition), params, definition)


def _of_params(f: Function, state: Sequence[Any]) -> Function:
    """Give a function of parameters, from one of time, state and parameters."""
    return lambda p: f(0.0, [0.0] * len(state), p)


def switches_of(definition: Definition) -> tuple[str, ...]:
    """Switching functions in words."""
    names = (definition.state, tuple(definition.params))
    return tuple(write(definition.graph, h, *names) for h in definition.h)


def system(
    state: str | Sequence[str],
    params: Mapping[str, float] | None = None,
    *,
    period: Formula | None = None,
    surfaces: Mapping[str, Formula] | None = None,
    jumps: Mapping[str, tuple[Formula, Function]] | None = None,
    name: str | None = None,
) -> Callable[[Function], System]:
    """Make a system of one function in which something switches.

    The function is called once, with numbers that record what is done with them: plain numpy code
    with `sign`, `abs`, `where`, `heaviside`, `minimum`, `maximum` and comparisons, and
    `filippov.unit` for friction in a plane. What it switches
    on is found, and the right-hand side is split there into smooth fields, which run compiled and
    are differentiated exactly. Where the field jumps is a surface that is crossed or slid on; where
    only a derivative jumps (`abs`) it is a kink. The formulas are checked against the function at
    random points.

    Parameters
    ----------
    state : str or sequence of str
        Names of the components: `"y v"`.
    params : mapping, optional
        Names and default values of the parameters.
    period : formula, optional
        Period of the forcing: a number, a text, or a function of `p`. Without it the system counts
        as autonomous, or forced without a period.
    surfaces : mapping, optional
        Names for surfaces, each with its switching function: a text (`"v - 1"`) or a function of
        `(t, s, p)`. They come first, in this order, with the sign they are given; else
        `h` has the sign of the argument of the switch as it is first written.
    jumps : mapping, optional
        `{"wall": (h, after)}`: where `h` falls to zero the state becomes `after(t, s, p)`.
    name : str, optional
        What it is called; by default the name of the function.

    Returns
    -------
    decorator
        Of a function `f(t, s, p)`: time, state and parameters, whose entries have names (`s.v`,
        `p.A`), indices and unpack. It returns the derivatives, one a component.

    Raises
    ------
    DefinitionError
        If the function cannot be recorded; the message says what to write instead.

    Examples
    --------
    >>> import numpy as np
    >>> import filippov as fp
    >>> @fp.system(state="x v", params={"F": 0.4})
    ... def block(t, s, p):
    ...     return s.v, -s.x - p.F * np.sign(s.v)
    >>> run = fp.simulate(block, [3, 0], (0, 20))
    >>> run.y[:, -1].round(6)
    array([-0.2,  0. ])
    """
    if callable(state):
        refuse("state", state, "expected names, as in @filippov.system(state='y v')", TypeError)

    def decorate(function: Function) -> System:
        if not callable(function):
            refuse("function", function, "expected a function f(t, s, p)", TypeError)
        given = None if name is None else name_of("name", name)
        called = given or str(getattr(function, "__name__", "system"))
        model, definition = define(
            called, state, params, function, surfaces=surfaces, period=period, jumps=jumps
        )
        check(model, definition, {"": function})
        return System._of(model, switches_of(definition), None, definition)

    return decorate
