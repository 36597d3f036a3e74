# SPDX-License-Identifier: BSD-3-Clause
"""Compiled models as formulas: for smoothing, time stepping, LaTeX and C++.

Each is written with the true magnitude of what switches, as smoothing and time stepping want it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .define import Definition, Formula, Function, Recorder

__all__ = ["formulas_of"]


class _Formulas(NamedTuple):
    field: Function
    surfaces: Mapping[str, Formula]
    period: Formula | None = None


def _forcing(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    return 2 * np.pi / p.omega


def _oscillator(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    r = abs(s.v - p.V)
    mu = p.alpha / (1 + p.gamma * r) + p.beta + p.eta * r**2
    pull = p.A * np.cos(p.omega * t) - p.k * s.y
    return s.v, pull / p.m - p.g * mu * np.sign(s.v - p.V)


def _coulomb(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    return s.v, -s.x + p.a * np.sin(p.omega * t) - p.mu * np.sign(s.v)


def _varying_belt(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    slip = np.sign(s.v - np.cos(t) - p.V)
    return s.v, -s.x - p.c * s.v + np.cos(p.omega * t) - p.mu * slip


def _dieci_lopez(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    return s.x2, -s.x1 - np.sign(s.x2 - p.v) / (1 + abs(s.x2 - p.v))


def _planar_relay(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    return -s.x1 + s.x2, 3 * s.x2 - p.k * np.sign(s.x1 + s.x2)


def _relay(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    damping, decay = 2 * p["zeta"] * p["omega"], p["lambda"]
    u = -np.sign(s.x1)
    return (
        -(damping + decay) * s.x1 + s.x2 + p.b1 * u,
        -(damping * decay + p.omega**2) * s.x1 + s.x3 + p.b2 * u,
        -(p.omega**2) * decay * s.x1 + p.b3 * u,
    )


def _sign_plane(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    x, y = np.sign(s)
    return p.a * x + p.b * y, p.c * x + p.d * y


def _stiff_relay(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    return -p["lambda"] * (s.x - np.cos(t)) * np.sign(s.x)


def _unit_circle(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    turn = -p.w * np.sign(s.x**2 + s.y**2 - 1)
    return s.x + turn * s.y, -turn * s.x + s.y


def _quartet(t: Any, s: Any, p: Any) -> Any:  # noqa: ANN401
    return p.c + p.d * t - p.b * np.sign(s.x)


_KNOWN = {
    "oscillator": _Formulas(_oscillator, {"h": "v - V"}, _forcing),
    "coulomb": _Formulas(_coulomb, {"h": "v"}, _forcing),
    "varying_belt": _Formulas(_varying_belt, {"h": "v - cos(t) - V"}),
    "dieci_lopez": _Formulas(_dieci_lopez, {"h": "x2 - v"}),
    "planar_relay": _Formulas(_planar_relay, {"h": "x1 + x2"}),
    "relay": _Formulas(_relay, {"h": "x1"}),
    "sign_plane": _Formulas(_sign_plane, {"x": "x", "y": "y"}),
    "stiff_relay": _Formulas(_stiff_relay, {"h": "x"}),
    "unit_circle": _Formulas(_unit_circle, {"h": "x**2 + y**2 - 1"}),
    "quartet": _Formulas(_quartet, {"h": "x"}),
}
_made: dict[str, Definition] = {}


def formulas_of(
    name: str, state: tuple[str, ...], params: Mapping[str, float]
) -> Definition | None:
    """Give the formulas of a model in `filippov.models`, None if they are not written down."""
    if name not in _KNOWN:
        return None
    if name not in _made:
        known = _KNOWN[name]
        recorder = Recorder(state, params)  # a parameter may be called lambda here
        period = known.period
        _made[name] = Definition(
            name,
            state,
            dict(params),
            recorder.graph,
            recorder.record(known.field, name, state),
            {key: recorder.formula(h, key) for key, h in known.surfaces.items()},
            period=None if period is None else recorder.formula(period, "period"),
        ).made()[1]
    return _made[name]
