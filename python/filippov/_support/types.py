# SPDX-License-Identifier: BSD-3-Clause
"""Names for the array types of the interface."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Bools", "FloatOrArray", "Floats", "Modes", "Record"]

Bools: TypeAlias = NDArray[np.bool_]
Floats: TypeAlias = NDArray[np.float64]
FloatOrArray: TypeAlias = "np.float64 | NDArray[np.float64]"
Modes: TypeAlias = NDArray[np.int8]
Record: TypeAlias = "np.ndarray[Any, np.dtype[Any]]"
