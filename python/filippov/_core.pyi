# SPDX-License-Identifier: BSD-3-Clause
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

_Floats: TypeAlias = NDArray[np.float64]

__version__: Final[str]
config: Final[dict[str, str | int | bool]]
seam: Final[dict[str, str]]
max_event_functions: Final[int]

class EventColumns:
    t: _Floats
    t_local: _Floats
    s: _Floats
    x_left: _Floats
    x_right: _Floats
    period: NDArray[np.int64]
    kind: NDArray[np.int32]
    surface: NDArray[np.int32]
    alternatives: NDArray[np.int32]
    contacts: NDArray[np.uint32]
    mode_before: NDArray[np.int8]
    mode_after: NDArray[np.int8]
    def __init__(self, **fields: Any) -> None: ...

class Run:
    t: _Floats
    y: _Floats
    mode: NDArray[np.int8]
    events: EventColumns
    solution: Solution | None
    counters: dict[str, int]
    status: str
    message: str
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class Diagram:
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
    def __init__(self, **fields: Any) -> None: ...

class CycleColumns:
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
    def __init__(
        self,
        *,
        size: NDArray[np.int64] = ...,
        mode: NDArray[np.int32] = ...,
        until: NDArray[np.int32] = ...,
        surface: NDArray[np.int32] = ...,
        t: _Floats = ...,
        x: _Floats = ...,
        s: _Floats = ...,
        turns: NDArray[np.int64] = ...,
        period: _Floats = ...,
        p: _Floats = ...,
        t_start: _Floats = ...,
        x_start: _Floats = ...,
    ) -> None: ...

class OrbitResult:
    cycles: CycleColumns
    multipliers: NDArray[np.complex128]
    monodromy: _Floats
    stable: bool
    iterations: int
    residual: float
    status: str
    message: str
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class SpecialPointResult:
    orbit: OrbitResult
    kind: str
    node: int
    side: int
    word_before: str
    word_after: str
    conditions: list[tuple[str, float]]
    multipliers: NDArray[np.complex128]
    def __init__(self, **fields: Any) -> None: ...

class BranchColumns:
    kind: str
    cycles: CycleColumns
    multipliers: NDArray[np.complex128]
    stable: NDArray[np.int8]
    special: list[SpecialPointResult]
    ends: tuple[str, str]
    corrections: int
    status: str
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class Curves:
    curves: list[BranchColumns]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class BifurcationSetResult:
    branches: list[BranchColumns]
    curves: list[BranchColumns]
    corrections: int
    failed_starts: int
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class LyapunovResult:
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
    def __init__(self, **fields: Any) -> None: ...

class MapSampleColumns:
    phase: _Floats
    boundary: NDArray[np.int8]
    value: _Floats
    value_boundary: NDArray[np.int8]
    slope: _Floats
    turns: NDArray[np.int64]
    true_exit: NDArray[np.uint8]
    status: NDArray[np.int32]
    word: list[str]
    def __init__(self, **fields: Any) -> None: ...

class FixedPointResult:
    phase: float
    boundary: int
    slope: float
    stable: bool
    iterate: int
    prime: int
    turns: int
    tangent: bool
    t: float
    x: list[float]
    def __init__(self, **fields: Any) -> None: ...

class MapGraphResult:
    samples: MapSampleColumns
    left: MapSampleColumns
    right: MapSampleColumns
    jump: list[bool]
    points: list[FixedPointResult]
    status: str
    message: str
    evaluations: int
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class MapImages:
    samples: MapSampleColumns
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class MappedColumns:
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
    def __init__(self, **fields: Any) -> None: ...

class TangencyResult:
    t: float
    x: list[float]
    side: int
    second: float
    other: float
    drift: float
    visible: bool
    attracting: bool
    def __init__(self, **fields: Any) -> None: ...

class Tangencies:
    found: list[TangencyResult]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class SlidingBoundaryColumns:
    side: int
    t: _Floats
    x: _Floats
    second: _Floats
    other: _Floats
    drift: _Floats
    tangential: list[TangencyResult]
    status: str
    message: str
    def __init__(self, **fields: Any) -> None: ...

class SlidingBoundaries:
    found: list[SlidingBoundaryColumns]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class EquilibriumResult:
    kind: str
    x: list[float]
    side: int
    s: float
    real: bool
    attracting: bool
    stable: bool
    encounter: str
    eigenvalues: list[complex]
    value: float
    def __init__(self, **fields: Any) -> None: ...

class Equilibria:
    found: list[EquilibriumResult]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

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
    def unit(self, a: Sequence[int], k: int, /) -> int: ...
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

class DefinedSystem:
    model: Model
    h: list[int]
    region: list[list[int]]
    graph: Graph
    def __init__(self, **fields: Any) -> None: ...

class StepColumns:
    status: str
    message: str
    n_steps: int
    newtons: int
    t: _Floats
    y: _Floats
    s: _Floats
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

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
) -> DefinedSystem: ...
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
) -> StepColumns: ...

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
) -> tuple[list[Run], bool]: ...
def diagram(
    model: Model,
    lanes: object | None,
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
) -> Diagram: ...
def settle(
    model: Model,
    p: _Floats,
    x0: _Floats,
    transient: float,
    max_turns: int,
    window: float,
    settings: RunSettings,
    /,
) -> OrbitResult: ...
def orbit_near(
    model: Model,
    p: _Floats,
    t0: float,
    x0: _Floats,
    turns: int,
    window: float,
    settings: RunSettings,
    /,
) -> OrbitResult: ...
def solve_orbit(model: Model, cycle: CycleColumns, settings: RunSettings, /) -> OrbitResult: ...
def trace(
    model: Model,
    cycle: CycleColumns,
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
) -> BranchColumns: ...
def trace_curves(
    model: Model,
    cycle: CycleColumns,
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
) -> Curves: ...
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
) -> BifurcationSetResult: ...
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
) -> MapGraphResult: ...
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
) -> MapImages: ...
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
) -> LyapunovResult: ...
def strobe_map(
    model: Model,
    t0: _Floats,
    x0: _Floats,
    p: _Floats,
    active: Sequence[int],
    settings: RunSettings,
    iterate: int,
    /,
) -> MappedColumns: ...
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
) -> MappedColumns: ...
def tangencies(
    model: Model,
    sides: Sequence[int],
    t: float,
    low: _Floats,
    high: _Floats,
    p: _Floats,
    seeds: int,
    /,
) -> Tangencies: ...
def describe_tangencies(
    model: Model, t: float, x: _Floats, p: _Floats, /
) -> list[TangencyResult]: ...
def sliding_boundaries(
    model: Model, low: _Floats, high: _Floats, p: _Floats, samples: int, seeds: int, /
) -> SlidingBoundaries: ...
def equilibria(
    model: Model, low: _Floats, high: _Floats, p: _Floats, seeds: int, /
) -> Equilibria: ...
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
) -> Equilibria: ...
def depends_on_time(model: Model, low: _Floats, high: _Floats, p: _Floats, /) -> bool: ...

class EnsembleColumns:
    x: _Floats
    t: _Floats
    period: NDArray[np.int64]
    status: NDArray[np.int8]
    mode: NDArray[np.int16]
    events: NDArray[np.int32]
    slides: NDArray[np.int32]
    slide_time: _Floats
    counters: dict[str, int]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

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
) -> EnsembleColumns: ...

class SectionImages:
    x: _Floats
    t: _Floats
    status: NDArray[np.int8]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class CellMapColumns:
    group: NDArray[np.int32]
    steps: NDArray[np.int32]
    period: NDArray[np.int32]
    basin: NDArray[np.int32]
    cells: list[NDArray[np.int32]]
    sink_basin: int
    unresolved_basin: int
    def __init__(self, **fields: Any) -> None: ...

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
) -> SectionImages: ...
def cell_map(axes: _Axes, image: NDArray[np.int32]) -> CellMapColumns: ...

class StrobeCycleColumns:
    points: _Floats
    multipliers: NDArray[np.complex128]
    residual: float
    def __init__(self, **fields: Any) -> None: ...

class AttractorColumns:
    periodic: bool
    points: _Floats
    multipliers: NDArray[np.complex128]
    residual: float
    radius: float
    norms: _Floats
    def __init__(self, **fields: Any) -> None: ...

class MappedCellsColumns:
    image: NDArray[np.int32]
    state: _Floats
    status: NDArray[np.int8]
    counters: dict[str, int]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class LimitSetsResult:
    plain: CellMapColumns
    attractors: list[AttractorColumns]
    saddles: list[StrobeCycleColumns]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class CellLabelsColumns:
    label: NDArray[np.int32]
    time: NDArray[np.int32]
    status: NDArray[np.int8]
    periods: int
    looked_up: int
    counters: dict[str, int]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class GroupCheck:
    group: int
    attractor: int
    cells: list[int]
    def __init__(self, **fields: Any) -> None: ...

class BasinChecks:
    confusion: list[GroupCheck]
    by_exit: bool
    by_exit_reason: str
    audited: int
    disagreements: int
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class PointLabels:
    label: NDArray[np.int32]
    time: NDArray[np.int32]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class PairCount:
    epsilon: float
    uncertain: int
    trials: int
    unresolved: int
    def __init__(self, **fields: Any) -> None: ...

class PairCounts:
    counts: list[PairCount]
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class BoundaryDimension:
    value: float
    error: float
    levels: int
    def __init__(self, **fields: Any) -> None: ...

class Audit:
    points: int
    wrong: int
    share: float
    bound: float
    def __init__(self, **fields: Any) -> None: ...

class RefinedColumns:
    squares: NDArray[np.int32]
    label: NDArray[np.int32]
    time: NDArray[np.int32]
    counts: NDArray[np.int64]
    trajectories: int
    dimension: BoundaryDimension
    audit: Audit
    status: str
    message: str
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

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
    ) -> MappedCellsColumns: ...
    def find(self, image: NDArray[np.int32]) -> LimitSetsResult: ...
    def labels(
        self,
        attractors: list[AttractorColumns],
        first: int,
        count: int,
        state: _Floats,
        status: NDArray[np.int8],
        show: Callable[[int, int], object] | None,
    ) -> CellLabelsColumns: ...
    def complete(
        self,
        attractors: list[AttractorColumns],
        image: NDArray[np.int32],
        label: NDArray[np.int32],
    ) -> BasinChecks: ...
    def points(self, attractors: list[AttractorColumns], points: _Floats) -> PointLabels: ...
    def pairs(
        self,
        attractors: list[AttractorColumns],
        epsilons: list[float],
        n: int,
        seed: int,
        show: Callable[[int, int], object] | None,
    ) -> PairCounts: ...
    def refine(
        self,
        attractors: list[AttractorColumns],
        coarse: int,
        levels: int,
        time_jump: int,
        full_dimension: float,
        max_points: int,
        audit: int,
        seed: int,
    ) -> RefinedColumns: ...

class BoundaryCurveColumns:
    points: _Floats
    left_points: _Floats
    right_points: _Floats
    kind: NDArray[np.int8]
    saddle: NDArray[np.int32]
    periods: NDArray[np.int32]
    approach: _Floats
    left: int
    right: int
    closed: bool
    distance: float
    coarse: int
    def __init__(self, **fields: Any) -> None: ...

class BoundaryCorner:
    at: list[float]
    turn: float
    error: float
    curve: int
    point: int
    def __init__(self, **fields: Any) -> None: ...

class BasinBoundaryResult:
    curves: list[BoundaryCurveColumns]
    corners: list[BoundaryCorner]
    unresolved: int
    labels: int
    stuck: int
    status: str
    message: str
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

class UnstableBranchColumns:
    points: _Floats
    breaks: NDArray[np.int64]
    length: float
    attractor: int
    status: str
    message: str
    def __init__(self, **fields: Any) -> None: ...

class UnstableSetResult:
    branches: list[UnstableBranchColumns]
    direction: _Floats
    multiplier: float
    turn: int
    raised: BaseException | None
    def __init__(self, **fields: Any) -> None: ...

def basin_boundary(
    picture: Picture,
    attractors: list[AttractorColumns],
    saddles: list[StrobeCycleColumns],
    label: NDArray[np.int32],
    distance: float,
    width: float,
    turn: float,
    near: float,
    max_labels: int,
    show: Callable[[int, int], object] | None,
) -> BasinBoundaryResult: ...
def unstable_set(
    picture: Picture,
    attractors: list[AttractorColumns],
    saddles: list[StrobeCycleColumns],
    point: int,
    gap: float,
    distance: float,
    near: float,
    length: float,
    generations: int,
    max_points: int,
) -> UnstableSetResult: ...

class Fraction:
    label: int
    value: float
    low: float
    high: float
    count: int
    def __init__(self, **fields: Any) -> None: ...

class BasinEntropy:
    mean: float
    mean_error: float
    boundary: float
    boundary_error: float
    boxes: int
    boundary_boxes: int
    unresolved: int
    def __init__(self, **fields: Any) -> None: ...
    def passes_log2_test(self) -> bool: ...

class BoxCount:
    size: int
    boxes: int
    def __init__(self, **fields: Any) -> None: ...

class BoxDimension:
    dimension: float
    error: float
    counts: list[BoxCount]
    def __init__(self, **fields: Any) -> None: ...

class UncertaintyExponent:
    alpha: float
    error: float
    dimension: float
    log_factor: float
    chi2: float
    degrees: int
    probability: float
    left_out: list[int]
    def __init__(self, **fields: Any) -> None: ...

def grid_fractions(labels: NDArray[np.int32]) -> list[Fraction]: ...
def sampled_fractions(
    labels: NDArray[np.int32], level: float, also: list[int]
) -> list[Fraction]: ...
def basin_entropy(labels: NDArray[np.int32], box: int) -> BasinEntropy: ...
def box_dimension(labels: NDArray[np.int32], smallest: int, largest: int) -> BoxDimension: ...
def uncertainty_exponent(counts: list[PairCount]) -> UncertaintyExponent: ...
def match_attractors(
    known: list[tuple[int, _Floats]],
    found: list[_Floats],
    scale: _Floats,
    threshold: float,
    next_id: int,
) -> tuple[list[int], list[float], int]: ...
