# SPDX-License-Identifier: BSD-3-Clause
"""A Filippov system as Python sees it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._check import among, floats, number, one_of, refuse
from ._types import FloatOrArray, Floats

__all__ = ["Params", "System", "restore"]

Side = int | Sequence[int]


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

    The ready ones are in `filippov.models`.

    Parameters
    ----------
    model : _core.Model
        What evaluates and runs the system.
    switches : sequence of str, optional
        The switching functions as a reader would write them.
    params : mapping, optional
        Parameter values that replace the model's defaults.
    """

    __slots__ = ("_model", "_params", "_switches")

    def __init__(
        self,
        model: _core.Model,
        *,
        switches: Sequence[str] = (),
        params: Mapping[str, float] | None = None,
    ) -> None:
        if not isinstance(model, _core.Model):
            refuse(
                "model",
                model,
                "expected a model; the ready systems are in filippov.models",
                TypeError,
            )
        self._model = model
        self._switches = tuple(switches)
        self._params = Params(dict(zip(model.params, model.defaults, strict=True)))
        self._params = self._merged(params)

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
        """
        return tuple(self._model.kinds)

    @property
    def switches(self) -> tuple[str, ...]:
        """The switching functions in words, one a surface."""
        return self._switches

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
        return System(self._model, switches=self._switches, params=self._merged(params))

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
        """Jacobian of `field` with respect to x, exact; shape (dim, dim) or (dim, dim, k)."""
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

    def __repr__(self) -> str:
        model = self._model
        lines = [f"System {self.name!r}", f"  state    {', '.join(self.state)}"]
        if self._params:
            shown = ", ".join(f"{name}={value:g}" for name, value in self._params.items())
            lines.append(f"  params   {shown}")
        lines += [
            f"  {'switch' if kind == 'switching' else kind:8} "
            f"h{j if self.surfaces > 1 else ''} = {text}"
            for j, (text, kind) in enumerate(zip(self._switches, self.kinds, strict=False))
        ]
        period = self.period()
        if period is not None:
            lines.append(f"  period   {period:.9g}")
        lines.append(f"  slides   by {self.sliding}")
        lines.append(f"  found    {', '.join(model.capabilities) or 'the required members only'}")
        derived = [what for what in ("grad_h", "h_t") if what not in model.capabilities]
        lines.append(f"  derived  {', '.join([*derived, 'jacobian'])} (automatic differentiation)")
        return "\n".join(lines)

    def __reduce__(self) -> tuple[Any, ...]:
        from . import models

        if getattr(models, self.name, None) is None:
            raise TypeError(f"cannot pickle {self.name!r}: it is not among filippov.models")
        return restore, (self.name, dict(self._params))

    # --- arguments ----------------------------------------------------------------------------

    def _merged(self, params: Mapping[str, float] | None) -> Params:
        """Own parameter values with some of them replaced."""
        if params is None:
            return self._params
        if not isinstance(params, Mapping):
            refuse("params", params, "expected a mapping of names to values", TypeError)
        merged = dict(self._params)
        for name, value in params.items():
            if name not in merged:
                refuse("params", params, self._unknown(name))
            merged[name] = number(f"params[{name!r}]", value)
        return Params(merged)

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
            refuse("params", params, f"expected a period > 0 of {self.name}, got {period}")
        return forced

    def _values(self, params: Mapping[str, float] | None) -> Floats:
        return np.array(list(self._merged(params).values()), dtype=np.float64)

    def _points(self, t: ArrayLike, x: ArrayLike) -> tuple[Floats, Floats, bool]:
        """Shape times and states as the core takes them, and whether it is one point."""
        shape = f"expected shape ({self.dim},) or ({self.dim}, k)"
        times = floats("t", t, "expected numbers, one or shape (k,)")
        points = floats("x", x, "expected numbers")
        if points.ndim not in (1, 2) or points.shape[0] != self.dim:
            refuse("x", points, f"{shape} for ({', '.join(self.state)}), got {points.shape}")
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


def restore(name: str, params: dict[str, float]) -> System:
    """Give a system of `filippov.models` with other parameter values."""
    from . import models

    system: System = getattr(models, name)
    return system.with_params(**params)
