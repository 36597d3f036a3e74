# SPDX-License-Identifier: BSD-3-Clause
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias, TypedDict

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float64]

__version__: Final[str]
config: Final[dict[str, str | int | bool]]
seam: Final[dict[str, str]]
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

class _Diagram(TypedDict):
    value: NDArray[np.int64]
    period: NDArray[np.int64]
    t_local: _Floats
    y: _Floats
    kind: NDArray[np.int32]
    surface: NDArray[np.int32]
    boundary: NDArray[np.int8]
    forcing: _Floats
    y_end: _Floats
    cycle: NDArray[np.int64]
    skipped: NDArray[np.int64]
    status: list[str]
    message: list[str]
    counters: dict[str, int]
    raised: BaseException | None

class _Cycles(TypedDict):
    size: NDArray[np.int64]
    mode: NDArray[np.int32]
    until: NDArray[np.int32]
    surface: NDArray[np.int32]
    t: _Floats
    x: _Floats
    s: _Floats
    turns: NDArray[np.int64]
    period: _Floats
    p: _Floats
    t_start: _Floats
    x_start: _Floats

class _Orbit(_Cycles):
    multipliers: NDArray[np.complex128]
    monodromy: _Floats
    stable: bool
    iterations: int
    residual: float
    status: str
    message: str
    raised: BaseException | None

class _Columns(TypedDict):
    phase: _Floats
    boundary: NDArray[np.int8]
    value: _Floats
    value_boundary: NDArray[np.int8]
    slope: _Floats
    turns: NDArray[np.int64]
    true_exit: NDArray[np.uint8]
    status: NDArray[np.int32]
    word: list[str]

class _Images(_Columns):
    raised: BaseException | None

class _Graph(TypedDict):
    samples: _Columns
    left: _Columns
    right: _Columns
    jump: list[bool]
    points: list[dict[str, Any]]
    status: str
    message: str
    evaluations: int
    raised: BaseException | None

class _Mapped(TypedDict):
    x: _Floats
    t: _Floats
    slope: _Floats
    param_slope: _Floats
    word: list[str]
    slides: NDArray[np.int64]
    singular: NDArray[np.uint8]
    status: list[str]
    message: list[str]
    raised: BaseException | None

class _Found(TypedDict):
    found: list[dict[str, Any]]
    raised: BaseException | None

class _Exponents(TypedDict):
    exponents: _Floats
    error: _Floats
    t_begin: float
    t_end: float
    slides: int
    stretches: int
    skipped: int
    x: _Floats
    status: str
    message: str
    raised: BaseException | None

class _Special(TypedDict):
    orbit: _Orbit
    kind: str
    node: int
    side: int
    word_before: str
    word_after: str
    conditions: list[tuple[str, float]]
    multipliers: NDArray[np.complex128]

class _Branch(_Cycles):
    kind: str
    multipliers: NDArray[np.complex128]
    stable: NDArray[np.int8]
    special: list[_Special]
    ends: tuple[str, str]
    corrections: int
    status: str
    raised: BaseException | None

class _Curves(TypedDict):
    curves: list[_Branch]
    raised: BaseException | None

class _Set(TypedDict):
    branches: list[_Branch]
    curves: list[_Branch]
    corrections: int
    failed_starts: int
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
    def kinds(self) -> list[str]: ...
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

_Node: TypeAlias = tuple[str, int, int, int, int, float]

class Graph:
    def __init__(self) -> None: ...
    def __len__(self) -> int: ...
    def nodes(self) -> list[_Node]: ...
    @staticmethod
    def of(rows: Sequence[_Node], /) -> Graph: ...
    def constant(self, value: float, /) -> int: ...
    def time(self) -> int: ...
    def state(self, i: int, /) -> int: ...
    def param(self, k: int, /) -> int: ...
    def varies(self, e: int, /) -> bool: ...
    def of_params(self, e: int, p: Sequence[float], /) -> float: ...
    def binary(self, name: str, a: int, b: int, /) -> int: ...
    def unary(self, name: str, a: int, /) -> int: ...
    def abs(self, a: int, /) -> int: ...
    def step(self, a: int, /) -> int: ...
    def where(self, condition: int, a: int, b: int, /) -> int: ...
    def add_pointer(
        self,
        name: str,
        dim: int,
        params: int,
        outputs: int,
        scale: Sequence[float],
        address: int,
        jacobian: int,
        owner: object,
        /,
    ) -> int: ...
    def add_callable(
        self,
        name: str,
        dim: int,
        params: int,
        outputs: int,
        scale: Sequence[float],
        function: Callable[[float, Sequence[float], Sequence[float]], Sequence[float]],
        /,
    ) -> int: ...
    def call(self, function: int, output: int, /) -> int: ...
    def functions(self) -> list[tuple[str, bool]]: ...

class _Defined(TypedDict):
    model: Model
    h: list[int]
    region: list[list[int]]
    graph: Graph

class _Steps(TypedDict):
    status: str
    message: str
    n_steps: int
    newtons: int
    t: _Floats
    y: _Floats
    s: _Floats
    raised: BaseException | None

most_tape_dims: Final[int]
most_tape_params: Final[int]

def define(
    graph: Graph,
    name: str,
    state: Sequence[str],
    params: Sequence[str],
    defaults: Sequence[float],
    field: Sequence[int],
    named: Sequence[int],
    jumps: Sequence[tuple[int, Sequence[int]]],
    period: int | None,
    smoothing: tuple[int, int, int] | None,
    /,
) -> _Defined: ...
def time_stepping(
    graph: Graph,
    defaults: Sequence[float],
    params: Sequence[float],
    field: Sequence[int],
    named: Sequence[int],
    x0: Sequence[float],
    t0: float,
    t_end: float,
    steps: int,
    theta: float,
    keep: int,
    /,
) -> _Steps: ...

class Solution:
    def pack(self) -> dict[str, np.ndarray[Any, Any]]: ...
    @staticmethod
    def unpack(model: Model, packed: dict[str, np.ndarray[Any, Any]], /) -> Solution: ...
    def knots(self) -> _Floats: ...
    def states(self, t: _Floats, dim: int, /) -> _Floats: ...
    def modes(self, t: _Floats, surfaces: int, /) -> NDArray[np.int8]: ...
    def blend(self, t: _Floats, surfaces: int, /) -> _Floats: ...

def models() -> list[Model]: ...
def status_names() -> list[str]: ...
def event_kind_names() -> list[str]: ...

class RunSettings:
    rtol: float
    atol: list[float]
    max_step: float
    first_step: float
    max_steps: int
    max_events: int
    on_nonunique: str
    method: str
    def __init__(
        self,
        *,
        rtol: float = ...,
        atol: list[float] = ...,
        max_step: float = ...,
        first_step: float = ...,
        max_steps: int = ...,
        max_events: int = ...,
        on_nonunique: str = ...,
        method: str = ...,
    ) -> None: ...

class BasinSettings:
    run: RunSettings
    t0: float
    rest: _Floats
    seeds: int
    settle: int
    longest: int
    saddle_starts: int
    max_periods: int
    distance: float
    times: bool
    audit: int
    escape: list[float]
    seed: int
    threads: int
    def __init__(
        self,
        *,
        run: RunSettings = ...,
        t0: float = ...,
        rest: _Floats = ...,
        seeds: int = ...,
        settle: int = ...,
        longest: int = ...,
        saddle_starts: int = ...,
        max_periods: int = ...,
        distance: float = ...,
        times: bool = ...,
        audit: int = ...,
        escape: list[float] = ...,
        seed: int = ...,
        threads: int = ...,
    ) -> None: ...

def simulate(
    model: Model,
    x0: _Floats,
    t0: float,
    t_end: float,
    p: _Floats,
    settings: RunSettings,
    most: int,
    dense: bool,
    t_eval: _Floats | None,
    events: list[tuple[Callable[..., float], int, int, bool]],
    params: object,
    /,
) -> tuple[list[_Run], bool]: ...
def diagram(
    model: Model,
    x0: _Floats,
    params: _Floats,
    settings: RunSettings,
    kinds: Sequence[int],
    surface: int,
    direction: int,
    transient: float,
    keep: float,
    follow: bool,
    chains: int,
    skip_repeats: bool,
    threads: int,
    progress: Callable[[int, int], object] | None,
    /,
) -> _Diagram: ...
def settle(
    model: Model,
    p: _Floats,
    x0: _Floats,
    transient: float,
    max_turns: int,
    window: float,
    settings: RunSettings,
    /,
) -> _Orbit: ...
def orbit_near(
    model: Model,
    p: _Floats,
    t0: float,
    x0: _Floats,
    turns: int,
    window: float,
    settings: RunSettings,
    /,
) -> _Orbit: ...
def solve_orbit(model: Model, cycle: tuple[Any, ...], settings: RunSettings, /) -> _Orbit: ...
def trace(
    model: Model,
    cycle: tuple[Any, ...],
    kind: int,
    node: int,
    side: int,
    parameter: int,
    low: float,
    high: float,
    first_step: float,
    max_step: float,
    max_points: int,
    progress: Callable[[int, int], object] | None,
    settings: RunSettings,
    /,
) -> _Branch: ...
def trace_curves(
    model: Model,
    cycle: tuple[object, ...],
    kind: int,
    node: int,
    side: int,
    parameters: Sequence[int],
    low: Sequence[float],
    high: Sequence[float],
    first_step: float,
    max_step: float,
    max_points: int,
    settings: RunSettings,
    /,
) -> _Curves: ...
def bifurcation_set(
    model: Model,
    p: _Floats,
    parameters: Sequence[int],
    low: Sequence[float],
    high: Sequence[float],
    x0: _Floats,
    lines: int,
    starts: int,
    max_turns: int,
    transient: float,
    window: float,
    max_curves: int,
    first_step: float,
    max_step: float,
    max_points: int,
    show: Callable[[int, int], object] | None,
    settings: RunSettings,
    /,
) -> _Set: ...
def bifurcation_names() -> list[str]: ...
def map_graph(
    model: Model,
    p: _Floats,
    settings: RunSettings,
    max_periods: float,
    guess: _Floats | None,
    iterate: int,
    samples: int,
    max_evaluations: int,
    progress: Callable[[int, int], object] | None,
    /,
) -> _Graph: ...
def map_images(
    model: Model,
    p: _Floats,
    settings: RunSettings,
    max_periods: float,
    guess: _Floats | None,
    iterate: int,
    boundary: NDArray[np.int32],
    phase: _Floats,
    /,
) -> _Images: ...
def lyapunov(
    model: Model,
    p: _Floats,
    x0: _Floats,
    settings: RunSettings,
    transient: float,
    window: float,
    stretch: float,
    batches: int,
    progress: Callable[[int, int], object] | None,
    /,
) -> _Exponents: ...
def strobe_map(
    model: Model,
    t0: _Floats,
    x0: _Floats,
    p: _Floats,
    active: Sequence[int],
    settings: RunSettings,
    iterate: int,
    /,
) -> _Mapped: ...
def section_map(
    model: Model,
    t0: _Floats,
    x0: _Floats,
    p: _Floats,
    active: Sequence[int],
    settings: RunSettings,
    iterate: int,
    kind: int,
    after: int,
    surface: int,
    max_time: float,
    /,
) -> _Mapped: ...
def tangencies(
    model: Model,
    sides: Sequence[int],
    t: float,
    low: _Floats,
    high: _Floats,
    p: _Floats,
    seeds: int,
    /,
) -> _Found: ...
def describe_tangencies(
    model: Model, t: float, x: _Floats, p: _Floats, /
) -> list[dict[str, Any]]: ...
def sliding_boundaries(
    model: Model, low: _Floats, high: _Floats, p: _Floats, samples: int, seeds: int, /
) -> _Found: ...
def equilibria(model: Model, low: _Floats, high: _Floats, p: _Floats, seeds: int, /) -> _Found: ...
def boundary_equilibria(
    model: Model,
    low: _Floats,
    high: _Floats,
    p: _Floats,
    parameter: int,
    start: float,
    end: float,
    seeds: int,
    /,
) -> _Found: ...
def depends_on_time(model: Model, low: _Floats, high: _Floats, p: _Floats, /) -> bool: ...

class _Ensemble(TypedDict):
    x: _Floats
    t: _Floats
    period: NDArray[np.int64]
    status: NDArray[np.int8]
    mode: NDArray[np.int8]
    events: NDArray[np.int32]
    slides: NDArray[np.int32]
    slide_time: _Floats
    counters: dict[str, int]
    raised: BaseException | None

_Axes: TypeAlias = list[tuple[int, float, float, int]]

def instruction_set() -> str: ...
def scalar(model: Model) -> object: ...
def one_lane(model: Model) -> object | None: ...
def tapes(model: Model) -> object | None: ...
def ensemble(
    capsule: object,
    n: int,
    x0: _Floats,
    params: _Floats,
    t0: _Floats,
    t_end: _Floats,
    escape: list[float] | None,
    settings: RunSettings,
    threads: int,
    show: Callable[[int, int], object] | None,
) -> _Ensemble: ...
def cells_of(axes: _Axes, points: _Floats) -> NDArray[np.int32]: ...
def centres(axes: _Axes) -> _Floats: ...
def lines_on_surface(
    model: Model, axes: _Axes, p: _Floats, rest: _Floats, t0: float
) -> list[tuple[int, int, float]]: ...
def section_images(
    model: Model,
    t0: _Floats,
    x0: _Floats,
    p: _Floats,
    settings: RunSettings,
    kind: int,
    after: int,
    max_time: float,
    iterate: int,
    threads: int,
    show: Callable[[int, int], object] | None,
) -> dict[str, Any]: ...
def cell_map(axes: _Axes, image: NDArray[np.int32]) -> dict[str, Any]: ...

class Picture: ...

class BasinFinder(Picture):
    def __init__(
        self,
        model: Model,
        lanes: object,
        axes: _Axes,
        p: _Floats,
        settings: BasinSettings,
        /,
    ) -> None: ...
    def images(
        self, first: int, count: int, show: Callable[[int, int], object] | None
    ) -> dict[str, Any]: ...
    def find(self, image: NDArray[np.int32]) -> dict[str, Any]: ...
    def labels(
        self,
        attractors: list[dict[str, Any]],
        first: int,
        count: int,
        state: _Floats,
        status: NDArray[np.int8],
        show: Callable[[int, int], object] | None,
    ) -> dict[str, Any]: ...
    def complete(
        self,
        attractors: list[dict[str, Any]],
        image: NDArray[np.int32],
        label: NDArray[np.int32],
    ) -> dict[str, Any]: ...
    def points(self, attractors: list[dict[str, Any]], points: _Floats) -> dict[str, Any]: ...
    def pairs(
        self,
        attractors: list[dict[str, Any]],
        epsilons: list[float],
        n: int,
        seed: int,
        show: Callable[[int, int], object] | None,
    ) -> dict[str, Any]: ...
    def refine(
        self,
        attractors: list[dict[str, Any]],
        coarse: int,
        levels: int,
        time_jump: int,
        full_dimension: float,
        max_points: int,
        audit: int,
        seed: int,
    ) -> dict[str, Any]: ...

def basin_boundary(
    picture: Picture,
    attractors: list[dict[str, Any]],
    saddles: list[dict[str, Any]],
    label: NDArray[np.int32],
    distance: float,
    width: float,
    turn: float,
    near: float,
    max_labels: int,
    show: Callable[[int, int], object] | None,
) -> dict[str, Any]: ...
def unstable_set(
    picture: Picture,
    attractors: list[dict[str, Any]],
    saddles: list[dict[str, Any]],
    point: int,
    gap: float,
    distance: float,
    near: float,
    length: float,
    generations: int,
    max_points: int,
) -> dict[str, Any]: ...
def grid_fractions(labels: NDArray[np.int32]) -> list[tuple[Any, ...]]: ...
def sampled_fractions(
    labels: NDArray[np.int32], level: float, also: list[int]
) -> list[tuple[Any, ...]]: ...
def basin_entropy(labels: NDArray[np.int32], box: int) -> tuple[Any, ...]: ...
def box_dimension(labels: NDArray[np.int32], smallest: int, largest: int) -> tuple[Any, ...]: ...
def uncertainty_exponent(rows: list[tuple[Any, ...]]) -> tuple[Any, ...]: ...
def match_attractors(
    known: list[tuple[int, _Floats]],
    found: list[_Floats],
    scale: _Floats,
    threshold: float,
    next_id: int,
) -> tuple[list[int], list[float], int]: ...
