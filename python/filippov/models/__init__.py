# SPDX-License-Identifier: BSD-3-Clause
"""Ready systems: one module each, with its formula and where it is from."""

from __future__ import annotations

import inspect
import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING

from filippov._system.system import System

__all__ = sorted(module.name for module in pkgutil.iter_modules(__path__))

for _name in __all__:
    _module = import_module(f"{__name__}.{_name}")
    globals()[_name] = getattr(_module, _name)  # the system, where the import put its module
    _text = inspect.cleandoc(_module.__doc__ or "").replace("\n", "\n    ")
    __doc__ += f"\n\n`{_name}`\n    {_text}"
del _name, _module, _text

if TYPE_CHECKING:

    def __getattr__(name: str) -> System: ...
