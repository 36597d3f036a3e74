# SPDX-License-Identifier: BSD-3-Clause
"""GSL's integrators as a second opinion, where the package was built with them."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from filippov import _core
from filippov._support.check import (
    MOST,
    integer,
    number,
    refuse,
    start_first,
    time_span,
    vector,
    word,
)
from filippov._support.status import Status
from filippov._support.types import Floats
from filippov._system.system import System

from .seam import load

__all__ = ["GslRun", "gsl_run", "has_gsl"]


@dataclass(frozen=True, eq=False, repr=False)
class GslRun:
    """Where a run by one of GSL's integrators ended."""

    t: float  #: time reached
    y: Floats  #: state there, shape (dim,)
    status: Status  #: ok, or why it stopped
    message: str  #: the same in words, GSL's own among them
    n_steps: int  #: taken
    nfev: int  #: evaluations of the field
    njev: int  #: evaluations of its Jacobian

    @property
    def success(self) -> bool:
        """Whether the end was reached."""
        return self.status == Status.ok

    def __repr__(self) -> str:
        return f"<GslRun: {self.n_steps} steps to t = {self.t:g}, {self.status.value}>"


def has_gsl() -> bool:
    """Tell whether this installation was built with GSL, without loading it."""
    return importlib.util.find_spec("filippov._gsl") is not None


def _module() -> Any:  # noqa: ANN401 - compiled, and there only on demand
    return load("filippov._gsl") if has_gsl() else None


def gsl_run(
    sys: System,
    x0: ArrayLike,
    t_span: tuple[float, float],
    *,
    method: str = "msbdf",
    rtol: float = 1e-8,
    atol: float = 1e-10,
    first_step: float = 1e-6,
    max_steps: int = 1_000_000,
    params: Mapping[str, float] | None = None,
) -> GslRun:
    """Follow a smoothed system by one of GSL's integrators, as a second opinion.

    GSL's step control knows nothing of the layer of a smoothed system: unlike `simulate` with
    `method="rodas5p"`, it may miss the layer and still end with status ok.

    Only in packages that were built from source with
    `pip install -C cmake.define.FILIPPOV_GSL=ON .`, where GSL's headers are installed. GSL is under
    the GPL: what is distributed together with such a build has to be, too.

    Parameters
    ----------
    sys : System
        What `smoothed` gives, of at most 8 components.
    x0 : array, shape (dim,)
        State at the start.
    t_span : (float, float)
        Start and end.
    method : {"msbdf", "msadams", "bsimp", "rk4imp", "rk2imp", "rk1imp", "rk8pd"}
        GSL's names. Those that are implicit, and bsimp, use exact Jacobians.
    rtol, atol : float
        Of the local error.
    first_step : float
        Units of t, > 0.
    max_steps : int
        More end the run with status "max_steps".
    params : mapping, optional
        Parameter values, by name, that replace `sys.params`.

    Returns
    -------
    GslRun
        Also of a run that stopped: `status` says why. No error of GSL ends the process.

    Raises
    ------
    ImportError
        If the package was built without GSL.
    TypeError
        For a system without formulas.
    ValueError
        For arguments that make no sense.
    """
    module = _module()
    if module is None:
        raise ImportError(
            "this filippov was built without GSL; where GSL's headers are installed, build it from"
            " source with: pip install -C cmake.define.FILIPPOV_GSL=ON ."
        )
    if not isinstance(sys, System):
        refuse("sys", sys, "expected a System, for instance filippov.smoothed(...)", TypeError)
    definition = sys._formulas()
    definition.require_formulas("be handed to GSL")
    tapes = _core.tapes(sys._model)
    if definition.jumps or definition.smoothing is None or tapes is None or sys.dim > 8:
        refuse("sys", sys.name, "expected what filippov.smoothed gives, of at most 8 components")
    values = sys._merged(params)
    start_first("gsl_run", x0, t_span, sys.dim)
    start = vector("x0", x0, sys.dim, sys.state)
    t0, t_end = time_span(t_span)
    run = module.run(
        tapes,
        word("method", method, module.methods),
        list(values.values()),
        start.tolist(),
        t0,
        t_end,
        number("rtol", rtol, "expected a number > 0", above=0.0),
        number("atol", atol, "expected a number >= 0", least=0.0),
        number("first_step", first_step, "expected a number > 0", above=0.0),
        integer("max_steps", max_steps, most=MOST),
    )
    return GslRun(
        t=run.t,
        y=np.asarray(run.y),
        status=Status(run.status),
        message=run.message,
        n_steps=run.n_steps,
        nfev=run.nfev,
        njev=run.njev,
    )
