# SPDX-License-Identifier: BSD-3-Clause
"""Systems: what a user types, recorded as formulas, and taken apart by the compiled core.

Start with ``system``; ``trace`` records a function, ``define`` makes a system of it, ``text`` and
``period`` read what is typed as text. It must not know how a system is run.
"""
