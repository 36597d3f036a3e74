# SPDX-License-Identifier: BSD-3-Clause
"""Systems: what a user types, recorded as formulas, and taken apart by the compiled core.

Start with ``system``; ``trace`` records a function, ``define`` makes a ``definition`` of it,
``text`` reads what is typed as text, ``period`` looks whether a forcing repeats, ``plain`` checks
what a file says, and ``built_in`` makes a model that is shipped. It must not know how a system is
run.
"""
