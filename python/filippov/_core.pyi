# SPDX-License-Identifier: BSD-3-Clause
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float64]

__version__: Final[str]
config: Final[dict[str, str | int | bool]]
max_event_functions: Final[int]

class _Run(TypedDict):
    t: _Floats
    y: _Floats
    mode: NDArray[np.int8]
    events: dict[str, NDArray[Any]]
    solution: Solution | None
    counters: dict[str, int]
    status: str
    message: str
    raised: BaseException | None

class Model:
    @property
    def name(self) -> str: ...
    @property
    def state(self) -> list[str]: ...
    @property
    def params(self) -> list[str]: ...
    @property
    def defaults(self) -> list[float]: ...
    @property
    def capabilities(self) -> list[str]: ...
    @property
    def dim(self) -> int: ...
    @property
    def surfaces(self) -> int: ...
    def period(self, p: _Floats, /) -> float: ...
    def h(self, t: _Floats, x: _Floats, p: _Floats, /) -> _Floats: ...
    def field(self, t: _Floats, x: _Floats, side: Sequence[int], p: _Floats, /) -> _Floats: ...
    def jacobian(self, t: _Floats, x: _Floats, side: Sequence[int], p: _Floats, /) -> _Floats: ...
    def normal_components(
        self, t: _Floats, x: _Floats, surface: int, side: Sequence[int], p: _Floats, /
    ) -> _Floats: ...
    def project(self, t: _Floats, x: _Floats, surface: int, p: _Floats, /) -> _Floats: ...

class Solution:
    def knots(self) -> _Floats: ...
    def states(self, t: _Floats, dim: int, /) -> _Floats: ...
    def modes(self, t: _Floats, surfaces: int, /) -> NDArray[np.int8]: ...
    def blend(self, t: _Floats, surfaces: int, /) -> _Floats: ...

def models() -> list[Model]: ...
def status_names() -> list[str]: ...
def event_kind_names() -> list[str]: ...
def simulate(
    model: Model,
    x0: _Floats,
    t0: float,
    t_end: float,
    p: _Floats,
    eighth_order: bool,
    rtol: float,
    atol: _Floats,
    max_step: float,
    first_step: float,
    max_steps: int,
    max_events: int,
    on_nonunique: int,
    dense: bool,
    t_eval: _Floats | None,
    events: list[tuple[Callable[..., float], int, int, bool]],
    params: object,
    /,
) -> _Run: ...
